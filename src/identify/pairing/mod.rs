//! From measured frequencies to numbers of modes.
//!
//! A structure without a joint is known but for a common factor, and its peaks are paired by frequency
//! ([`crate::predict::pair_by_ratio`]). With a joint the natural frequencies themselves are unknown, so that pairing and
//! joint are sought together ([`pair_modes`]):
//! 1. *Candidates*: for every joint of a grid the assignment of peaks to modes that suits it best, peaks left over
//!    and modes left out at a price. Mode n of any joint lies between those of the free and of the clamped beam.
//!    Every candidate keeps to that.
//! 2. *Joint* (`joint`): for each candidate the joint whose frequencies are nearest, and how probable the frequencies
//!    are over all joints (Laplace's approximation). An assignment that many joints fit is thus not beaten by one
//!    that a single joint fits perfectly.
//! 3. *Shape* (`joint`): measured shapes and signs against those of that joint; whether a mode left out
//!    could have been seen at all.
//! 4. *Strength*: of several poles that may be the same mode, a weak one has its price.
//! 5. *Verdict*: the best assignment, and every other that is not beaten by [`PairingSettings::odds`].
//!    Where the plain one (peaks numbered in ascending order) is among them it stays.

mod joint;

use super::frequency_fit::{FrequencyModel, JointedStructure, Parameter};
use joint::{JointSearch, Place, View, is_clear};
use rayon::prelude::*;
use std::collections::BTreeMap;
use tapjoint_beam::StructureError;

/// A measured peak that may be a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPeak {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its standard uncertainty (Hz), where known.
    pub std: Option<f64>,
    /// Values of its shape at the sensors; empty where places or amplitudes are unknown.
    pub shape: Vec<ShapeAt>,
    /// Strength in each recording, in the same order for all peaks. `None` of a recording that did not show it; empty
    /// where all strengths are unknown.
    pub strengths: Vec<Option<PeakStrength>>,
}

/// A shape's value at one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeAt {
    /// Place of the sensor (m).
    pub sensor: f64,
    /// Place of the tap (m), where the value is a modal constant; `None` of a shape in free units.
    pub tap: Option<f64>,
    /// Modal constant (1/kg), or displacement in any unit.
    pub value: f64,
    /// Its standard uncertainty (same unit).
    pub std: f64,
    /// Values of one group share their unit; modal constants of one hammer and one group share their
    /// signs between modes, too.
    pub group: usize,
}

/// Knowledge of the test that pairing uses.
#[derive(Debug, Clone, PartialEq)]
pub struct PairingSettings {
    /// Stiffnesses of the joint that are estimated: two by default; those not named are held.
    pub fit: Vec<Parameter>,
    /// Held stiffnesses Kt (N/m), Kr (N m/rad) and Ktr (N/rad). A stiffness that is neither estimated nor held is
    /// infinite: rigid, or without coupling. None.
    pub held: [Option<f64>; 3],
    /// True: all frequencies may differ from the model by one common factor, as where the modulus is estimated. Default:
    /// false.
    pub common_factor: bool,
    /// Bands (Hz) in which peaks were looked for: everywhere from 0 on.
    pub bands: Vec<(f64, f64)>,
    /// Error of the model in a frequency, relative: 1.5 %, what a beam's stated dimensions, its
    /// sensor's place and two springs for a joint usually leave (1 % and less in published tests). The
    /// tails are those of Student's t with 4 degrees of freedom: one mode may be off by 5 %.
    pub discrepancy: f64,
    /// An assignment less probable than the best by this factor is out: 20.
    pub odds: f64,
}

impl Default for PairingSettings {
    fn default() -> Self {
        PairingSettings {
            fit: vec![Parameter::Kt, Parameter::Kr],
            held: [None; 3],
            common_factor: false,
            bands: Vec::new(),
            discrepancy: 0.015,
            odds: 20.0,
        }
    }
}

/// One way to number the peaks.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbering {
    /// Number of each peak; `None` for one that is no mode.
    pub numbers: Vec<Option<usize>>,
    /// Modes below the highest numbered one that no peak is, and whether each could have been seen.
    pub missing: Vec<MissingMode>,
    /// Probability of the best over its own (1 for the best).
    pub odds: f64,
}

/// A mode without a peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissingMode {
    /// Number of the mode.
    pub mode: usize,
    /// Frequency with the best joint (Hz).
    pub frequency: f64,
    /// Reason for which it has no peak, if that is known.
    pub cause: MissingCause,
}

/// Reason for which a mode may have no peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissingCause {
    /// It lies outside the bands.
    OutsideBand,
    /// Every sensor or every tap is near one of its nodes.
    AtNode,
    /// Nothing explains it.
    Unknown,
}

/// The numbering, and what else it might be.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairing {
    /// The one to take.
    pub chosen: Numbering,
    /// Others that explain the peaks comparably, the most probable first.
    pub others: Vec<Numbering>,
}

/// Numbers the peaks (ascending) of a jointed structure.
///
/// # Errors
/// [`StructureError`] where the structure cannot exist.
pub fn pair_modes(
    structure: &JointedStructure,
    peaks: &[MeasuredPeak],
    settings: &PairingSettings,
) -> Result<Pairing, StructureError> {
    let highest = peaks.len() + MOST_MISSING;
    let mut bare = structure.clone();
    bare.masses.clear();
    bare.springs.clear();
    let coarse = FrequencyModel::new(&bare, highest)?;
    let fine = FrequencyModel::new(structure, highest)?;
    let neighbours = Neighbours::of(peaks);
    let found = candidates(&JointSearch::new(&coarse, peaks, settings), &neighbours);
    let search = JointSearch::new(&fine, peaks, settings);
    let mut numberings: Vec<Scored> = found
        .iter()
        .map(|(assignment, start)| score(&search, assignment, &neighbours, *start))
        .collect();
    numberings.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    // The plain numbering is taken where nothing beats it clearly. Numberings are comparable where the data do not
    // tell them apart: which of two close modes is missing is not decided by the wish that none were.
    let best = numberings.first();
    let (least, by_data) = best.map_or((0.0, 0.0), |best| (best.cost, best.by_data));
    let limit = settings.odds.ln();
    numberings.retain(|one| one.by_data.min(one.cost + by_data - least) - by_data < limit);
    let kept = numberings.into_iter().map(|scored| Numbering {
        odds: (scored.cost - least).exp(),
        ..scored.numbering
    });
    let mut kept: Vec<Numbering> = kept.collect();
    let plain = kept.iter().position(|one| is_plain(&one.numbers));
    let chosen = if kept.is_empty() {
        Numbering {
            numbers: Vec::new(),
            missing: Vec::new(),
            odds: 1.0,
        }
    } else {
        kept.remove(plain.unwrap_or(0))
    };
    Ok(Pairing {
        chosen,
        others: kept,
    })
}

/// A numbering with its negative logarithm of probability, and how much of that the data say: all but
/// the price of modes that could have been seen.
struct Scored {
    cost: f64,
    by_data: f64,
    numbering: Numbering,
}

/// Number of modes beyond that of peaks that are looked for.
const MOST_MISSING: usize = 3;

/// Price of a peak that is no mode: one in twenty is none, and it may lie anywhere over five e-folds of
/// frequency.
const EXTRA_COST: f64 = 3.0 + 1.6;

fn score(
    search: &JointSearch<'_>,
    assignment: &Assignment,
    neighbours: &Neighbours,
    start: Place,
) -> Scored {
    let pairs = pairs(assignment);
    let fit = search.refine(&pairs, start);
    let view = View::new(search, &fit);
    let top = pairs.last().map_or(0, |pair| pair.1);
    let missing: Vec<MissingMode> = (1..=top)
        .filter(|mode| pairs.iter().all(|pair| pair.1 != *mode))
        .map(|mode| view.missing(search, &fit, mode))
        .collect();
    let extra = (assignment.len() - pairs.len()) as f64;
    // A mode that could be seen is missed once in ten times: a weak tap, a soft tip, a neighbour's flank.
    let unseen: f64 = missing
        .iter()
        .map(|missing| match missing.cause {
            MissingCause::OutsideBand => 0.0,
            MissingCause::AtNode => 0.7,
            MissingCause::Unknown => 2.3,
        })
        .sum();
    let weak = neighbours.cost(assignment);
    // Shapes may be compared without those of the weak peaks beside a stronger one that is left over and whose own
    // shape is lost in noise. The shape of the weaker one then speaks for neither.
    let mut shaped = pairs.clone();
    shaped.retain(|pair| {
        !neighbours.stronger[pair.0].iter().any(|&(other, _)| {
            let shape = &search.peaks[other].shape;
            assignment[other].is_none() && !shape.is_empty() && !is_clear(shape)
        })
    });
    let by_data = fit.cost + extra * EXTRA_COST + weak + view.cost(search, &shaped);
    Scored {
        cost: by_data + unseen,
        by_data,
        numbering: Numbering {
            numbers: assignment.clone(),
            missing,
            odds: 1.0,
        },
    }
}

/// Returns true where the peaks are numbered 1, 2, 3 and so on.
fn is_plain(numbers: &[Option<usize>]) -> bool {
    let mut places = numbers.iter().enumerate();
    places.all(|(index, number)| *number == Some(index + 1))
}

// Assignments of peaks to modes that some joint makes likely.

/// A number, or none, for each peak.
type Assignment = Vec<Option<usize>>;

/// So many assignments are looked at closely.
const FOLLOWED: usize = 16;
/// Usual relative distances of a match on the grid. Its places may miss a frequency by 19 %: with the
/// first a match costs less than a peak and a mode left over up to 0.08 sqrt(2 (4.6 + 1.5 + ln 5)) = 31 %.
/// The second is for places that happen to be nearer.
const WIDTHS: [f64; 2] = [0.08, 0.03];
/// Price of a mode without a peak on the grid, the reasons for it not yet looked at: between that of
/// one that could be seen and that of one that could not.
const MISSING_COST: f64 = 1.5;

/// Peaks (from 0) with their modes (from 1), ascending.
fn pairs(assignment: &Assignment) -> Vec<(usize, usize)> {
    let numbers = assignment.iter().enumerate();
    numbers
        .filter_map(|(peak, number)| Some((peak, (*number)?)))
        .collect()
}

/// The most likely assignments, each with the joint of the grid that suits it best; the plain one is
/// always there.
fn candidates(search: &JointSearch<'_>, neighbours: &Neighbours) -> Vec<(Assignment, Place)> {
    let peaks: Vec<f64> = search
        .peaks
        .iter()
        .map(|peak| peak.frequency.ln())
        .collect();
    // A weak peak at its price, lest all places take a strong one's satellites; and without, lest a strong
    // peak that is no mode hides the mode beside it. The closer look prices both alike.
    let stronger = neighbours.stronger.iter();
    let weak = stronger.map(|others| others.iter().map(|one| one.1).fold(0.0, f64::max));
    let weak: Vec<f64> = weak.collect();
    let mut prices = vec![vec![0.0; peaks.len()]];
    prices.extend(weak.iter().any(|price| *price > 0.0).then_some(weak));
    let plain: Assignment = (1..=peaks.len()).map(Some).collect();
    let grid: Vec<(Place, Vec<f64>)> = search
        .grid()
        .into_par_iter()
        .map(|place| (place, search.predict(place)))
        .collect();
    let mut best: BTreeMap<Assignment, (f64, Place)> = BTreeMap::new();
    for (place, modes) in &grid {
        let mut offers = Vec::with_capacity(2 * WIDTHS.len() + 1);
        for width in WIDTHS {
            for weak in &prices {
                let (assignment, cost) = align(search, &peaks, weak, modes, width);
                let paid: f64 = pairs(&assignment).iter().map(|pair| weak[pair.0]).sum();
                let cost = cost - paid + neighbours.cost(&assignment);
                offers.push((assignment, cost));
            }
        }
        let misfit = peaks.iter().zip(modes).map(|(a, b)| (a - b).powi(2));
        offers.push((plain.clone(), misfit.sum()));
        for (assignment, cost) in offers {
            let known = best.entry(assignment).or_insert((f64::INFINITY, *place));
            if cost < known.0 {
                *known = (cost, *place);
            }
        }
    }
    let mut found: Vec<(Assignment, (f64, Place))> = best.into_iter().collect();
    found.sort_by(|a, b| {
        let by_cost = a.1.0.total_cmp(&b.1.0);
        (a.0 != plain).cmp(&(b.0 != plain)).then(by_cost)
    });
    found.truncate(FOLLOWED);
    found
        .into_iter()
        .map(|(assignment, (_, place))| (assignment, place))
        .collect()
}

/// The cheapest assignment that keeps the order, by dynamic programming over peaks and modes (both as
/// logarithms of frequency), weak peaks at their price. Modes above the highest peak are free.
fn align(
    search: &JointSearch<'_>,
    peaks: &[f64],
    weak: &[f64],
    modes: &[f64],
    width: f64,
) -> (Assignment, f64) {
    let (n, m) = (peaks.len(), modes.len());
    // Least cost of the first i peaks with the first j modes.
    let mut cost = vec![vec![0.0; m + 1]; n + 1];
    let unseen: Vec<f64> = modes
        .iter()
        .map(|f| {
            if search.in_band(f.exp()) {
                MISSING_COST
            } else {
                0.0
            }
        })
        .collect();
    let mut matched = vec![vec![0.0; m]; n];
    for (i, row) in matched.iter_mut().enumerate() {
        for (j, cost) in row.iter_mut().enumerate() {
            *cost = 0.5 * ((peaks[i] - modes[j]) / width).powi(2) + (width / 0.4).ln() + weak[i];
        }
    }
    for i in 0..=n {
        for j in 0..=m {
            let extra = (i > 0).then(|| cost[i - 1][j] + EXTRA_COST);
            let missing = (j > 0).then(|| cost[i][j - 1] + unseen[j - 1]);
            let both = (i > 0 && j > 0).then(|| cost[i - 1][j - 1] + matched[i - 1][j - 1]);
            let ways = [extra, missing, both].into_iter().flatten();
            let least = ways.fold(f64::INFINITY, f64::min);
            cost[i][j] = if least.is_finite() { least } else { 0.0 };
        }
    }
    let last = &cost[n];
    let end = (0..=m)
        .min_by(|&a, &b| last[a].total_cmp(&last[b]))
        .unwrap_or(0);
    let mut assignment = vec![None; n];
    let (mut i, mut j) = (n, end);
    while i > 0 {
        if j > 0 && cost[i][j] == cost[i - 1][j - 1] + matched[i - 1][j - 1] {
            assignment[i - 1] = Some(j);
            (i, j) = (i - 1, j - 1);
        } else if j > 0 && cost[i][j] == cost[i][j - 1] + unseen[j - 1] {
            j -= 1;
        } else {
            i -= 1;
        }
    }
    (assignment, last[end])
}

// How strongly each peak was seen, and what it costs to take a weak one for a mode while a strong one
// beside it is left over.
//
// A mode whose frequency changes while it rings is fitted by several poles, and some of them carry next
// to nothing. All lie within the model's discrepancy of the mode, so that frequencies do not tell them
// apart, and the shape of a weak pole is as good as any direction.

/// Strength of a peak in one recording.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PeakStrength {
    /// Energy of its fitted oscillation (a unit that all peaks of the recording share); `None` without
    /// a fit.
    pub energy: Option<f64>,
    /// Height of its own peak over the noise (dB); `None` of a pole that makes no peak.
    pub level_db: Option<f64>,
}

/// Peaks nearer than this, relative, may be the same mode: twice what the model usually misses of a
/// frequency.
const NEAR: f64 = 0.03;
/// A pole without a peak of its own counts a tenth of its energy where the stronger one makes a peak: poles
/// that only mend the line of another have large amplitudes that cancel.
const NO_PEAK: f64 = 0.1;
/// Largest price of one weak peak: a mode may be near its node at every tap and sensor while torsion
/// beside it is seen well, once in a hundred times.
const MOST: f64 = 4.6;

/// For each peak its stronger neighbours, with the price of taking this one while that one is left over.
struct Neighbours {
    stronger: Vec<Vec<(usize, f64)>>,
}

impl Neighbours {
    fn of(peaks: &[MeasuredPeak]) -> Self {
        let mut stronger = vec![Vec::new(); peaks.len()];
        for (index, own) in peaks.iter().enumerate() {
            for (other, peak) in peaks.iter().enumerate() {
                let is_near = (peak.frequency / own.frequency).ln().abs() <= NEAR;
                if let Some(price) = price(own, peak).filter(|_| is_near && other != index) {
                    stronger[index].push((other, price));
                }
            }
        }
        Neighbours { stronger }
    }

    /// Price of an assignment: of each numbered peak beside the strongest one left over.
    fn cost(&self, numbers: &[Option<usize>]) -> f64 {
        let numbered = numbers
            .iter()
            .zip(&self.stronger)
            .filter(|one| one.0.is_some());
        let prices = numbered.map(|(_, stronger)| {
            let left_over = stronger.iter().filter(|one| numbers[one.0].is_none());
            left_over.map(|one| one.1).fold(0.0, f64::max)
        });
        prices.sum()
    }
}

/// ln of the ratio of two amplitudes in the recording that sees the weaker one best; `None` where no
/// recording saw both, or it is not the weaker one.
fn price(own: &MeasuredPeak, other: &MeasuredPeak) -> Option<f64> {
    let mut prices = Vec::new();
    for (own, other) in own.strengths.iter().zip(&other.strengths) {
        let (Some(own), Some(other)) = (own, other) else {
            continue;
        };
        if let Some((a, b)) = own.energy.zip(other.energy) {
            let peakless = own.level_db.is_none() && other.level_db.is_some();
            let a = if peakless { NO_PEAK * a } else { a };
            prices.extend((a > 0.0 && b > 0.0).then(|| 0.5 * (b / a).ln()));
        } else if let Some((a, b)) = own.level_db.zip(other.level_db) {
            // 20 dB are a factor of ten in amplitude.
            prices.push((b - a) / 20.0 * std::f64::consts::LN_10);
        }
    }
    let least = prices.into_iter().reduce(f64::min)?;
    (least > 0.0).then_some(least.min(MOST))
}
