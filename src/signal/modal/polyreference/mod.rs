//! Poles from frequency response functions: the polyreference least-squares complex frequency
//! estimator (Guillaume et al. 2003; Peeters et al. 2004), its stabilisation diagram, and the
//! selection of the physical poles.
//!
//! # Coefficients and band
//! The band is laid on four fifths of the unit circle, z_k = e^{j 2 pi (f_k - f_1) T_a}, and the
//! coefficients are complex. Real coefficients would say that every pole has a mirror image across
//! the band's lower end, which is so only where the band begins at 0 Hz; elsewhere they spend half
//! the order on images that are not there. With complex ones a band may begin anywhere, an order n
//! gives n poles within it, and the conjugate poles belong to the background. A mode is exactly
//! rational in j omega (and, of a sampled decay, in e^{j omega/rate}), not in z; but the difference
//! to 1/(1 - z_p/z) is smooth over the band, and the numerator takes it up.
//!
//! # Constraint
//! One coefficient must be fixed, and which one decides where the surplus poles go (Cauberghe 2004).
//! M is close to a Toeplitz matrix. Of such a matrix the minimiser with the highest coefficient fixed
//! is a linear predictor: all its roots lie within the unit circle, and surplus poles would look
//! like damped modes. Fixed here is the lowest, A_0 = I: the minimiser is the reversed predictor,
//! its surplus roots lie outside, |z| > 1, which is a growing oscillation, and are recognised by the sign
//! of their real part. Poles of the structure, which the data ask for, stay where they are.
//!
//! # Sub-bands
//! The lag of the highest power, order times T_a, is the length of decay that a fit compares; over a
//! band of width B it is about order/B. Two modes 0.4 Hz apart look like one for a second or two; over
//! 800 Hz an order of 40 compares 0.05 s. In a band of 25 Hz it sees them part. Groups of peaks are
//! therefore analysed in narrow bands of their own as well.
//!
//! # What it does not do
//! The estimator is linear and not efficient: its frequencies are a start for a maximum-likelihood fit.

mod roots;
mod selection;
mod stabilisation;

use std::f64::consts::TAU;
use std::slice::from_ref;

use num_complex::Complex64;

use super::{CompositeLevel, PeakSettings, find_peaks, noise_of_function};
use crate::spectral::{DISPLAY_RATIO, Lines};

pub use selection::{PolyreferenceMode, select_modes};
use stabilisation::{Circles, stabilise_on};
pub use stabilisation::{PoleStability, StabilisationPole, stabilise_poles};

/// Reason why a polyreference fit is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PolyreferenceError {
    /// An output with another shape than the first one.
    #[error(
        "output {output} has {inputs} inputs on {lines} lines, output 1 has {expected_inputs} on {expected_lines}: give every entry on the same lines"
    )]
    Shape {
        /// Output, counted from 1.
        output: usize,
        /// Its inputs.
        inputs: usize,
        /// Inputs of output 1.
        expected_inputs: usize,
        /// Its lines.
        lines: usize,
        /// Lines of output 1.
        expected_lines: usize,
    },
    /// A value that is no number.
    #[error(
        "output {output}, input {input} has no finite value at {frequency} Hz: leave the line out or replace it"
    )]
    NotFinite {
        /// Output, counted from 1.
        output: usize,
        /// Input, counted from 1.
        input: usize,
        /// Frequency of the line (Hz).
        frequency: f64,
    },
    /// Fewer lines than the order needs.
    #[error(
        "{lines} lines are too few for order {order}: at least {least} are needed; widen the band or lower the order"
    )]
    TooFewLines {
        /// Lines in the band.
        lines: usize,
        /// Order asked for.
        order: usize,
        /// Least number of lines.
        least: usize,
    },
    /// Nothing to fit.
    #[error(
        "the responses from {low} to {high} Hz have no content that a fit could use: check the band and the channels"
    )]
    Singular {
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
    },
}

/// Lowest order. 2: one pole alone says nothing of a band with several.
const LEAST_ORDER: usize = 2;
/// Damping ratio from which on a pole is no mode. 0.2: bolted structures have a few per cent.
pub const MOST_DAMPING: f64 = 0.2;

/// Settings of the search for poles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolyreferenceSettings {
    /// Highest order of the denominator; that times the inputs is the number of poles. 40: three to
    /// four times the modes of a band, as the surplus takes up noise and background.
    pub order: usize,
    /// Decay (1/s) that an exponential window has added to every pole; taken out of each. 0.
    pub added_decay: f64,
    /// Peaks about which narrow bands are laid.
    pub peaks: BandPeaks,
}

/// Peaks about which narrow bands are laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BandPeaks {
    /// Peaks of all entries together. For free decays: their lines share noise and ringing.
    #[default]
    Together,
    /// Also peaks of single entries over the noise of their own lines. For response functions.
    EveryFunction,
}

impl Default for PolyreferenceSettings {
    fn default() -> Self {
        PolyreferenceSettings {
            order: 40,
            added_decay: 0.0,
            peaks: BandPeaks::Together,
        }
    }
}

/// Lines that an order needs: numerators and the denominator's share of each output, and a quarter
/// more so that noise is averaged at all.
fn least_lines(matrix: &ResponseMatrix, order: usize) -> usize {
    let numerator = order + 1 + 2 * stabilisation::EXTRA_POWERS;
    let denominator = (order * matrix.inputs).div_ceil(matrix.outputs.max(1));
    (numerator + denominator) * 5 / 4
}

/// Responses on equally spaced lines: frequency response functions, or transforms of free decays
/// (then each tap and sensor is an output of one input).
#[derive(Debug, Clone)]
pub struct ResponseMatrix<'a> {
    first: f64,
    /// Distance between lines (Hz).
    pub spacing: f64,
    /// Number of outputs.
    pub outputs: usize,
    /// Number of inputs.
    pub inputs: usize,
    /// Entry (output, input) stands at output * inputs + input.
    entries: Vec<&'a [Complex64]>,
}

impl<'a> ResponseMatrix<'a> {
    /// Takes `values[output][input][line]` on lines `first + line * spacing` (both Hz).
    ///
    /// # Errors
    /// [`PolyreferenceError::Shape`] where an output lacks an input or an entry lacks lines,
    /// [`PolyreferenceError::NotFinite`] where a value is no number.
    pub fn new(
        first: f64,
        spacing: f64,
        values: &[Vec<&'a [Complex64]>],
    ) -> Result<Self, PolyreferenceError> {
        let inputs = values.first().map_or(0, Vec::len);
        let first_entry = values.first().and_then(|row| row.first());
        let points = first_entry.map_or(0, |entry| entry.len());
        for (output, row) in values.iter().enumerate() {
            let lengths = row.iter().map(|entry| entry.len());
            let least = lengths.clone().min().unwrap_or(0);
            let most = lengths.max().unwrap_or(0);
            if row.len() != inputs || least != points || most != points {
                return Err(PolyreferenceError::Shape {
                    output: output + 1,
                    inputs: row.len(),
                    expected_inputs: inputs,
                    lines: if least == points { most } else { least },
                    expected_lines: points,
                });
            }
        }
        let entries: Vec<&[Complex64]> = values.iter().flatten().copied().collect();
        for (index, entry) in entries.iter().enumerate() {
            if let Some(line) = entry.iter().position(|value| !value.is_finite()) {
                return Err(PolyreferenceError::NotFinite {
                    output: index / inputs + 1,
                    input: index % inputs + 1,
                    frequency: first + line as f64 * spacing,
                });
            }
        }
        Ok(ResponseMatrix {
            first,
            spacing,
            outputs: values.len(),
            inputs,
            entries,
        })
    }

    /// Returns the part between two frequencies (Hz), both ends included.
    #[must_use]
    pub fn band(&self, low: f64, high: f64) -> Self {
        // A millionth of a line more, so that an end that lies on a line is not lost by rounding.
        let [low, high] = [low, high].map(|frequency| (frequency - self.first) / self.spacing);
        let start = (low - 1e-6).ceil().max(0.0) as usize;
        let end = ((high + 1e-6).floor().max(-1.0) + 1.0) as usize;
        let end = end.min(self.points());
        let start = start.min(end);
        ResponseMatrix {
            first: self.frequency(start),
            entries: self
                .entries
                .iter()
                .map(|entry| &entry[start..end])
                .collect(),
            ..*self
        }
    }

    /// Number of lines.
    pub fn points(&self) -> usize {
        self.entries.first().map_or(0, |entry| entry.len())
    }

    /// Frequency of line `index` (Hz).
    pub fn frequency(&self, index: usize) -> f64 {
        self.first + index as f64 * self.spacing
    }

    /// First and last frequency (Hz).
    pub fn ends(&self) -> (f64, f64) {
        (self.first, self.frequency(self.points().saturating_sub(1)))
    }

    /// Values of one entry on all lines.
    pub fn entry(&self, output: usize, input: usize) -> &'a [Complex64] {
        self.entries[output * self.inputs + input]
    }
}

/// Least width of a sub-band (lines). 120: enough for an order of some 25, and at resolution 1/T, a sub-band in
/// which modes a line and a half apart still part.
const LEAST_BAND_LINES: f64 = 120.0;
/// Least width of a sub-band in half-power widths of the widest peak. 16: the flanks tell damping from
/// background.
const HALF_POWER_WIDTHS: f64 = 16.0;

/// Most lines of a band between the peaks. 600: fifteen for each order up to the highest. The longest lag is then a
/// fifteenth of the block.
const MOST_LINES_BETWEEN: f64 = 600.0;

/// Largest ratio of the reaches of two peaks of functions in one band. 4: over a wider band the lags of the model order
/// are too short for the decay of the lighter mode.
const MOST_UNEQUAL: f64 = 4.0;
/// Most functions whose peaks are looked for one by one. 12: more taps and sensors repeat each other.
const MOST_ALONE: usize = 12;

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

impl SubBand {
    fn core_holds(&self, mode: &PolyreferenceMode) -> bool {
        (self.core.0..=self.core.1).contains(&(mode.pole.im / TAU))
    }
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

/// Returns the bands around the groups of peaks of `matrix`, ascending; their cores do not overlap, and do
/// not cover what lies far from every peak.
pub fn sub_bands(matrix: &ResponseMatrix, peaks: BandPeaks) -> Vec<SubBand> {
    let (low_end, high_end) = matrix.ends();
    let groups = peak_groups(matrix, peaks);
    let mut bands = Vec::with_capacity(groups.len());
    for (index, group) in groups.iter().enumerate() {
        let low = (group.first - group.reach).max(low_end);
        let high = (group.last + group.reach).min(high_end);
        // Near the ends of a band the background is worst known: a tenth is left to the others.
        let margin = 0.1 * (high - low);
        let mut core = (
            if low > low_end { low + margin } else { low },
            if high < high_end { high - margin } else { high },
        );
        if let Some(before) = index.checked_sub(1).map(|k| &groups[k]) {
            core.0 = f64::max(core.0, 0.5 * (before.last + group.first));
        }
        if let Some(after) = groups.get(index + 1) {
            core.1 = f64::min(core.1, 0.5 * (group.last + after.first));
        }
        bands.push(SubBand { low, high, core });
    }
    bands
}

/// Returns bands that cover what lies between the cores of `bands`, ascending. A mode there makes no peak. Over the whole
/// band the lags of the model order are too short for its decay.
fn bands_between(matrix: &ResponseMatrix, bands: &[SubBand]) -> Vec<SubBand> {
    let (low_end, high_end) = matrix.ends();
    let mut found = Vec::new();
    let mut from = low_end;
    let cores = bands.iter().map(|band| band.core);
    for (core_low, core_high) in cores.chain([(high_end, high_end)]) {
        let lines = (core_low - from) / matrix.spacing;
        if lines >= LEAST_BAND_LINES {
            let parts = (lines / MOST_LINES_BETWEEN).ceil();
            let width = (core_low - from) / parts;
            for part in 0..parts as usize {
                let core = (from + part as f64 * width, from + (part + 1) as f64 * width);
                found.push(SubBand {
                    low: (core.0 - 0.1 * width).max(low_end),
                    high: (core.1 + 0.1 * width).min(high_end),
                    core,
                });
            }
        }
        from = from.max(core_high);
    }
    found
}

fn peak_groups(matrix: &ResponseMatrix, peaks: BandPeaks) -> Vec<PeakGroup> {
    if matrix.points() < 3 {
        return Vec::new();
    }
    let (low, high) = matrix.ends();
    // A block that displays just the matrix's points, of signal as long as the spacing says.
    let lines = Lines {
        low,
        high,
        spacing: matrix.spacing,
        block: ((matrix.points() - 1) as f64 * DISPLAY_RATIO).ceil() as usize,
        duration: 1.0 / matrix.spacing,
    };
    let entries = matrix.entries.iter();
    let powers: Vec<Vec<f64>> = entries
        .map(|entry| entry.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let mut levels = Vec::new();
    // Less than the 15 dB that count as a resonance unseen: a band without a mode costs time only.
    let mut settings = PeakSettings {
        above_noise_db: 10.0,
        ..PeakSettings::default()
    };
    // Without known noise, peaks of very different width may share a band.
    let mut most_unequal = f64::INFINITY;
    match peaks {
        BandPeaks::Together => {
            settings.blind_prominence_db = 6.0;
            levels.push(CompositeLevel::new(lines, &powers, None));
        }
        BandPeaks::EveryFunction => {
            most_unequal = MOST_UNEQUAL;
            let noise = matrix.entries.iter().map(|entry| noise_of_function(entry));
            let noise: Vec<Vec<f64>> = noise.collect();
            levels.push(CompositeLevel::new(lines, &powers, Some(&noise)));
            // A mode that moves one sensor alone may make no peak over all of them.
            let alone = powers.iter().zip(&noise).take(MOST_ALONE);
            levels.extend(alone.map(|(power, noise)| {
                CompositeLevel::new(lines, from_ref(power), Some(from_ref(noise)))
            }));
        }
    }
    let mut peaks: Vec<(usize, f64)> = Vec::new();
    for level in &levels {
        for peak in find_peaks(level, &settings) {
            // Lines over which the level stays within 3 dB of the peak.
            let (before, after) = level.level_db.split_at(peak.index);
            let least = after[0] - 3.0;
            let below = before.iter().rev().take_while(|level| **level >= least);
            let above = after.iter().take_while(|level| **level >= least);
            peaks.push((peak.index, (below.count() + above.count()) as f64));
        }
    }
    peaks.sort_by_key(|peak| peak.0);
    peaks.dedup_by_key(|peak| peak.0);
    let mut groups: Vec<PeakGroup> = Vec::new();
    for (index, width) in peaks {
        let frequency = matrix.frequency(index);
        let reach = 0.5 * (HALF_POWER_WIDTHS * width).max(LEAST_BAND_LINES) * matrix.spacing;
        match groups.last_mut() {
            // A group is not longer than half a reach, so that its band stays narrow. A light mode beside a plateau
            // has a band of its own.
            Some(group)
                if frequency - group.first < 0.5 * group.reach.min(reach)
                    && group.reach.max(reach) <= most_unequal * group.reach.min(reach) =>
            {
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

/// Finds the modes of the whole matrix, ascending: sub-bands for what a narrow band can hold, the whole band
/// for what lies outside them or is too wide for them. The first of the searches is the whole band's.
///
/// A band with too few lines for the order is searched at the order that they allow.
///
/// # Errors
/// As [`stabilise_poles`]; [`PolyreferenceError::TooFewLines`] only below some 16 lines.
pub fn find_modes(
    matrix: &ResponseMatrix,
    settings: &PolyreferenceSettings,
) -> Result<Vec<BandSearch>, PolyreferenceError> {
    let ends = matrix.ends();
    let whole_band = SubBand {
        low: ends.0,
        high: ends.1,
        core: ends,
    };
    let mut circles = Circles::new();
    let mut searches = vec![search(&mut circles, matrix, whole_band, settings)?];
    let mut bands = sub_bands(matrix, settings.peaks);
    let about_peaks = bands.len();
    // Of functions every entry has its own peaks, and a narrow band without any finds little but noise.
    if settings.peaks == BandPeaks::Together {
        bands.extend(bands_between(matrix, &bands));
    }
    for (index, band) in bands.into_iter().enumerate() {
        let mut part = search(&mut circles, matrix, band, settings)?;
        // A mode of the whole band that lies in the core and that both searches read as one goes to the one whose
        // pole explains more: of a mode that decays within the lags of the whole band, a longer look only adds
        // noise. Otherwise the sub-band decides, except on modes too wide for it.
        let whole = &mut searches[0].modes;
        let (rivals, mut kept): (Vec<_>, Vec<_>) =
            (whole.drain(..)).partition(|mode| band.core_holds(mode));
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
        // Bands between the peaks fill no diagram where they find nothing.
        if index < about_peaks || !part.modes.is_empty() {
            searches.push(part);
        }
    }
    Ok(searches)
}

/// Returns the modes of all searches, ascending.
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

fn search(
    circles: &mut Circles,
    matrix: &ResponseMatrix,
    band: SubBand,
    settings: &PolyreferenceSettings,
) -> Result<BandSearch, PolyreferenceError> {
    let part = matrix.band(band.low, band.high);
    let points = part.points();
    let most = match points == matrix.points() {
        true => settings.order,
        false => settings.order.min(points / LINES_PER_ORDER),
    };
    let mut orders = (1..=most).rev();
    let order = orders.find(|&order| least_lines(&part, order) <= points);
    let order = order.unwrap_or(settings.order);
    let settings = PolyreferenceSettings { order, ..*settings };
    let diagram = stabilise_on(circles, &part, &settings)?;
    let mut modes = select_modes(&part, &diagram, &settings);
    modes.retain(|mode| band.core_holds(mode));
    Ok(BandSearch {
        band,
        order,
        diagram,
        modes,
    })
}
