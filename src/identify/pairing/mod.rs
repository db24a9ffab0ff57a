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
//! 3. *Shape* (`shapes`): measured shapes and signs against those of that joint; whether a mode left out
//!    could have been seen at all.
//!    The sizes of modal constants do not decide, and show a wrong scale (`scale`).
//! 4. *Strength* (`strength`): a strong peak left over costs more than a weak one.
//! 5. *Verdict*: the best assignment, and every other that is not beaten by [`PairingSettings::odds`].
//!    Where the plain one (peaks numbered in ascending order) is among them it stays.

mod joint;
mod scale;
mod shapes;
mod strength;

use super::frequency_fit::{FrequencyModel, JointedStructure, Parameter};
use joint::{JointSearch, Place};
use rayon::prelude::*;
pub use scale::SizeAt;
use shapes::{View, is_clear};
use std::collections::BTreeMap;
use strength::{GRID_ODDS, Strengths};
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
    /// Amplitude over that which a mode of its frequency could have (1): modal constant over the strongest one, or velocity
    /// over the strongest at its frequency or above, at least 3 % of the strongest. A pole that makes no peak counts a
    /// tenth. `None` where unknown.
    pub strength: Option<f64>,
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
    /// Usual error of the model in a frequency, relative: 1.5 %, what a beam's stated dimensions, its sensor's place and
    /// two springs for a joint leave (1 % and less in published tests). Its true size is unknown and common to all modes:
    /// the errors have a multivariate t density with 2 degrees of freedom.
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
    /// Places (m) of sensors whose signs are those of the model only if they are inverted: mounted against the direction
    /// of the others, or with an inverted channel. Where half of them are inverted against the others, all places.
    pub inverted: Vec<f64>,
    /// How large the modal constants of each sensor are beside the model's, where hammer and sensor are calibrated and at
    /// least three modes away from their nodes say so.
    pub sizes: Vec<SizeAt>,
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
    let strengths = Strengths(peaks);
    let found = candidates(&JointSearch::new(&coarse, peaks, settings), &strengths);
    let search = JointSearch::new(&fine, peaks, settings);
    let mut numberings: Vec<Scored> = found
        .iter()
        .map(|(assignment, start)| score(&search, assignment, &strengths, *start))
        .collect();
    numberings.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    // The plain numbering is taken where nothing beats it clearly. Numberings are comparable where the data do not
    // tell them apart. The price of missing modes must not decide which of two close modes is missing.
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
            inverted: Vec::new(),
            sizes: Vec::new(),
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

/// Peaks nearer than this, relative, may be the same mode: twice what the model usually misses of a frequency.
const NEAR: f64 = 0.03;

fn score(
    search: &JointSearch<'_>,
    assignment: &Assignment,
    strengths: &Strengths<'_>,
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
    // A mode that could be seen is missed once in ten times: a weak tap, a soft tip, a neighbour's flank.
    let unseen: f64 = missing
        .iter()
        .map(|missing| match missing.cause {
            MissingCause::OutsideBand => 0.0,
            MissingCause::AtNode => 0.7,
            MissingCause::Unknown => 2.3,
        })
        .sum();
    // Shapes may be compared without those of the weak peaks beside a stronger one that is left over and whose own
    // shape is lost in noise. The shape of the weaker one then speaks for neither.
    let mut shaped = pairs.clone();
    shaped.retain(|&(own, _)| {
        !search.peaks.iter().enumerate().any(|(other, peak)| {
            let is_near = (peak.frequency / search.peaks[own].frequency).ln().abs() <= NEAR;
            let is_left_over = is_near && assignment[other].is_none();
            let both = peak.strength.zip(search.peaks[own].strength);
            let is_stronger = both.is_some_and(|(other, own)| other > own);
            is_left_over && is_stronger && !peak.shape.is_empty() && !is_clear(&peak.shape)
        })
    });
    let by_data = fit.cost + strengths.cost(assignment) + view.cost(search, &shaped);
    Scored {
        cost: by_data + unseen,
        by_data,
        numbering: Numbering {
            numbers: assignment.clone(),
            missing,
            inverted: view.inverted(search, &shaped),
            sizes: view.sizes(search, &shaped),
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
/// Of so many the peaks beside a numbered one are tried in its place.
const EXCHANGED: usize = 4;
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
fn candidates(search: &JointSearch<'_>, strengths: &Strengths<'_>) -> Vec<(Assignment, Place)> {
    let peaks: Vec<f64> = search
        .peaks
        .iter()
        .map(|peak| peak.frequency.ln())
        .collect();
    // The price of each peak left over.
    let own: Vec<f64> = (0..peaks.len())
        .map(|peak| strengths.leaving(peak))
        .collect();
    let prices = GRID_ODDS.map(|odds| own.iter().map(|price| odds + price).collect::<Vec<f64>>());
    let plain: Assignment = (1..=peaks.len()).map(Some).collect();
    let grid: Vec<(Place, Vec<f64>)> = search
        .grid()
        .into_par_iter()
        .map(|place| (place, search.predict(place)))
        .collect();
    let mut best: BTreeMap<Assignment, (f64, Place)> = BTreeMap::new();
    for (place, modes) in &grid {
        let mut offers = Vec::with_capacity(GRID_ODDS.len() * WIDTHS.len() + 1);
        for width in WIDTHS {
            for prices in &prices {
                let (assignment, cost) = align(search, &peaks, prices, modes, width);
                let over = prices.iter().zip(&assignment);
                let paid = over.filter(|(_, number)| number.is_none());
                let paid: f64 = paid.map(|(price, _)| price).sum();
                let cost = cost - paid + strengths.cost(&assignment);
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
    let mut followed: Vec<(Assignment, Place)> = Vec::with_capacity(2 * FOLLOWED);
    for (assignment, (_, place)) in found {
        followed.push((assignment, place));
    }
    // A place of the grid offers the nearer of two peaks about a mode alone. The other is looked at as well.
    for index in 0..followed.len().min(EXCHANGED) {
        let (assignment, place) = followed[index].clone();
        for other in exchanged(&assignment, &peaks) {
            if followed.iter().all(|one| one.0 != other) {
                followed.push((other, place));
            }
        }
    }
    followed
}

/// Returns the assignments in which one number passes to a peak left over beside its own.
fn exchanged(assignment: &Assignment, peaks: &[f64]) -> Vec<Assignment> {
    let mut others = Vec::new();
    for (own, _) in pairs(assignment) {
        let below = (0..own)
            .rev()
            .take_while(|&peak| assignment[peak].is_none());
        let above = (own + 1..peaks.len()).take_while(|&peak| assignment[peak].is_none());
        for peak in below.chain(above) {
            if (peaks[peak] - peaks[own]).abs() <= WIDTHS[0] {
                let mut other = assignment.clone();
                other.swap(own, peak);
                others.push(other);
            }
        }
    }
    others
}

/// The cheapest assignment that keeps the order, by dynamic programming over peaks and modes (both as
/// logarithms of frequency), peaks left over at these prices. Modes above the highest peak are free.
fn align(
    search: &JointSearch<'_>,
    peaks: &[f64],
    prices: &[f64],
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
            *cost = 0.5 * ((peaks[i] - modes[j]) / width).powi(2) + (width / 0.4).ln();
        }
    }
    for i in 0..=n {
        for j in 0..=m {
            let extra = (i > 0).then(|| cost[i - 1][j] + prices[i - 1]);
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
