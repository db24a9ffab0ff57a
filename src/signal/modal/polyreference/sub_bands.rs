//! Narrow bands around groups of peaks, each analysed on its own.
//!
//! The lag of the highest power, order times T_a, is the length of decay that a fit compares; over a
//! band of width B it is about order/B. Two modes 0.4 Hz apart look like one for a second or two; over
//! 800 Hz an order of 40 compares 0.05 s. In a band of 25 Hz it sees them part.

use std::f64::consts::TAU;

use super::{
    PolyreferenceError, PolyreferenceMode, PolyreferenceSettings, ResponseMatrix,
    StabilisationPole, least_lines, select_modes, stabilise_poles,
};
use crate::modal::{CompositeLevel, Peak, PeakSettings, find_peaks};
use crate::spectral::{DISPLAY_RATIO, Lines};

/// How sub-bands are laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubBandSettings {
    /// Least width (lines). 120: enough for an order of some 25, and at resolution 1/T, a sub-band in
    /// which modes a line and a half apart still part.
    pub least_lines: usize,
    /// Least width in half-power widths of the widest peak. 16: the flanks tell damping from
    /// background.
    pub half_power_widths: f64,
    /// What counts as a peak worth a band of its own.
    pub peaks: PeakSettings,
}

impl Default for SubBandSettings {
    fn default() -> Self {
        SubBandSettings {
            least_lines: 120,
            half_power_widths: 16.0,
            peaks: PeakSettings {
                // Less than the 8 dB and 15 dB that count as a resonance unseen: a band without a
                // mode costs time only.
                blind_prominence_db: 6.0,
                above_noise_db: 10.0,
                ..PeakSettings::default()
            },
        }
    }
}

/// A band of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubBand {
    /// Lower end (Hz) of what is fitted.
    pub low: f64,
    /// Upper end (Hz) of what is fitted.
    pub high: f64,
    /// Between these (Hz) modes are taken from this band; the rest belongs to its neighbours.
    pub core: (f64, f64),
}

/// One band's analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct BandSearch {
    /// The band.
    pub band: SubBand,
    /// Highest order used.
    pub order: usize,
    /// Its stabilisation diagram.
    pub diagram: Vec<StabilisationPole>,
    /// Modes within its core, ascending.
    pub modes: Vec<PolyreferenceMode>,
}

/// Peaks that share a band (Hz): the first, the last, and the reach to either side.
struct PeakGroup {
    first: f64,
    last: f64,
    reach: f64,
}

/// Bands around the groups of peaks of `matrix`, ascending; their cores do not overlap, and do not
/// cover what lies far from every peak.
pub fn sub_bands(matrix: &ResponseMatrix, settings: &SubBandSettings) -> Vec<SubBand> {
    let (low_end, high_end) = matrix.ends();
    let groups = peak_groups(matrix, settings);
    groups
        .iter()
        .enumerate()
        .map(|(index, group)| {
            let low = (group.first - group.reach).max(low_end);
            let high = (group.last + group.reach).min(high_end);
            let before = index
                .checked_sub(1)
                .map(|k| 0.5 * (groups[k].last + group.first));
            let after = groups.get(index + 1);
            let after = after.map(|next| 0.5 * (group.last + next.first));
            // Near the ends of a band the background is worst known: a tenth is left to the others.
            let margin = 0.1 * (high - low);
            let inner_low = if low > low_end { low + margin } else { low };
            let inner_high = if high < high_end { high - margin } else { high };
            let core = (
                before.map_or(inner_low, |edge| edge.max(inner_low)),
                after.map_or(inner_high, |edge| edge.min(inner_high)),
            );
            SubBand { low, high, core }
        })
        .collect()
}

fn peak_groups(matrix: &ResponseMatrix, settings: &SubBandSettings) -> Vec<PeakGroup> {
    if matrix.points() < 3 {
        return Vec::new();
    }
    let level = CompositeLevel::new(axis(matrix), &matrix.powers(), None);
    let mut groups: Vec<PeakGroup> = Vec::new();
    for peak in find_peaks(&level, &settings.peaks) {
        let frequency = matrix.frequency(peak.index);
        let width = half_power_lines(&level.level_db, &peak) as f64;
        let lines = (settings.half_power_widths * width).max(settings.least_lines as f64);
        let reach = 0.5 * lines * matrix.spacing();
        match groups.last_mut() {
            // A group is not longer than half a reach, so that its band stays narrow.
            Some(group) if frequency - group.first < 0.5 * group.reach.min(reach) => {
                group.last = frequency;
                group.reach = group.reach.max(reach);
            }
            _ => groups.push(PeakGroup {
                first: frequency,
                last: frequency,
                reach,
            }),
        }
    }
    groups
}

/// The matrix's axis as [`Lines`]: a block that displays just its points, of signal as long as the
/// spacing says.
fn axis(matrix: &ResponseMatrix) -> Lines {
    let (low, high) = matrix.ends();
    let intervals = matrix.points().saturating_sub(1) as f64;
    Lines {
        low,
        high,
        spacing: matrix.spacing(),
        block: (intervals * DISPLAY_RATIO).ceil() as usize,
        duration: 1.0 / matrix.spacing(),
    }
}

/// Lines over which the level stays within 3 dB of the peak.
fn half_power_lines(level_db: &[f64], peak: &Peak) -> usize {
    let least = level_db[peak.index] - 3.0;
    let falls = |level: &&f64| **level >= least;
    let right = level_db[peak.index..].iter().take_while(falls).count();
    let left = level_db[..peak.index]
        .iter()
        .rev()
        .take_while(falls)
        .count();
    left + right
}

/// Modes of the whole matrix, ascending: sub-bands for what a narrow band can hold, the whole band for
/// what lies outside them or is too wide for them. The first of the searches is the whole band's.
///
/// A band with too few lines for the order is searched at the order that they allow.
///
/// # Errors
/// As [`stabilise_poles`]; [`PolyreferenceError::TooFewLines`] only below some 16 lines.
pub fn find_modes(
    matrix: &ResponseMatrix,
    settings: &PolyreferenceSettings,
    bands: &SubBandSettings,
) -> Result<Vec<BandSearch>, PolyreferenceError> {
    let ends = matrix.ends();
    let whole_band = SubBand {
        low: ends.0,
        high: ends.1,
        core: ends,
    };
    let mut whole = search(matrix, whole_band, settings)?;
    let mut parts = sub_bands(matrix, bands)
        .into_iter()
        .map(|band| search(matrix, band, settings))
        .collect::<Result<Vec<BandSearch>, PolyreferenceError>>()?;
    for part in &mut parts {
        share_modes(&mut whole.modes, part);
    }
    Ok(std::iter::once(whole).chain(parts).collect())
}

/// Modes of all searches, ascending.
pub fn all_modes(searches: &[BandSearch]) -> Vec<PolyreferenceMode> {
    let mut modes: Vec<PolyreferenceMode> = searches
        .iter()
        .flat_map(|search| search.modes.iter().cloned())
        .collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    modes
}

/// Lines of a sub-band to each order at least. 5: over half the values are then left to average noise,
/// with two outputs.
const LINES_PER_ORDER: usize = 5;
/// Widest mode that is left to a sub-band, in parts of the band's width.
const WIDEST_SHARE: f64 = 0.125;

/// Settles which search keeps a mode that lies in a sub-band's core.
///
/// A mode that both read as one goes to the one whose pole explains more: of a mode that decays within
/// the lags of the whole band, a longer look only adds noise. Otherwise the sub-band decides, except
/// on modes too wide for it.
fn share_modes(whole: &mut Vec<PolyreferenceMode>, part: &mut BandSearch) {
    let band = part.band;
    let inside =
        |mode: &PolyreferenceMode| (band.core.0..=band.core.1).contains(&(mode.pole.im / TAU));
    let (rivals, mut kept): (Vec<_>, Vec<_>) = whole.drain(..).partition(inside);
    for rival in rivals {
        let width = 2.0 * rival.damping_ratio * rival.frequency;
        let near: Vec<usize> = (0..part.modes.len())
            .filter(|&k| (part.modes[k].frequency - rival.frequency).abs() < width)
            .collect();
        match near[..] {
            [] if width > WIDEST_SHARE * (band.high - band.low) => kept.push(rival),
            [one] if part.modes[one].above_noise_db < rival.above_noise_db => {
                part.modes.remove(one);
                kept.push(rival);
            }
            _ => {}
        }
    }
    *whole = kept;
}

fn search(
    matrix: &ResponseMatrix,
    band: SubBand,
    settings: &PolyreferenceSettings,
) -> Result<BandSearch, PolyreferenceError> {
    let part = matrix.band(band.low, band.high);
    let is_whole = part.points() == matrix.points();
    let most = if is_whole {
        settings.order
    } else {
        settings.order.min(part.points() / LINES_PER_ORDER)
    };
    let order = (1..=most)
        .rev()
        .find(|&order| least_lines(&part, order) <= part.points())
        .unwrap_or(settings.order);
    let settings = PolyreferenceSettings {
        order,
        ..settings.clone()
    };
    let diagram = stabilise_poles(&part, &settings)?;
    let mut modes = select_modes(&part, &diagram, &settings);
    modes.retain(|mode| (band.core.0..=band.core.1).contains(&(mode.pole.im / TAU)));
    Ok(BandSearch {
        band,
        order,
        diagram,
        modes,
    })
}
