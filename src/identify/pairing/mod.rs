//! From measured frequencies to numbers of modes.
//!
//! A structure without a joint is known but for a common factor, and its peaks are paired by frequency
//! ([`crate::predict::pair_by_ratio`]). With a joint the natural frequencies themselves are unknown, so that pairing and
//! joint are sought together ([`pair_modes`]):
//! 1. *Candidates* (`candidates`): for every joint of a grid the assignment of peaks to modes that suits
//!    it best, peaks left over and modes left out at a price. Mode n of any joint lies between those of
//!    the free and of the clamped beam, so that no candidate violates that.
//! 2. *Joint* (`joint`): for each candidate the joint whose frequencies are nearest, and how probable
//!    the frequencies are over all joints (Laplace's approximation), so that an assignment that any joint
//!    could have explained is not preferred for a perfect fit.
//! 3. *Shape* (`shape`): measured shapes and signs against those of that joint; whether a mode left out
//!    could have been seen at all.
//! 4. *Strength* (`strength`): of several poles that may be the same mode, a weak one has its price.
//! 5. *Verdict*: the best assignment, and every other that is not beaten by [`PairingSettings::odds`].
//!    Where the plain one (peaks numbered in ascending order) is among them it stays.

mod candidates;
mod joint;
mod shape;

pub use candidates::PeakStrength;

use super::frequency_fit::{FrequencyModel, JointedStructure, Parameter};
use candidates::{Assignment, Neighbours, comparable};
use joint::JointSearch;
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
    /// Strength in each recording, in the same order for all peaks, `None` where it did not;
    /// empty where that is unknown.
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
    /// Held stiffnesses Kt (N/m), Kr (N m/rad) and Ktr (N/rad). What is neither estimated nor held is
    /// infinite: rigid, or without coupling. None.
    pub held: [Option<f64>; 3],
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
    let found = candidates::find(&JointSearch::new(&coarse, peaks, settings), &neighbours);
    let search = JointSearch::new(&fine, peaks, settings);
    let mut numberings: Vec<Scored> = found
        .iter()
        .map(|(assignment, start)| score(&search, assignment, &neighbours, *start))
        .collect();
    numberings.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    Ok(verdict(numberings, settings.odds))
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
    start: [f64; 3],
) -> Scored {
    let pairs = candidates::pairs(assignment);
    let fit = search.refine(&pairs, start);
    let view = shape::View::new(search, &fit);
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
    let shaped = comparable(&pairs, assignment, search.peaks, neighbours);
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

/// `sorted` by cost. The plain numbering is taken where nothing beats it clearly. Numberings are
/// comparable where the data do not tell them apart: which of two close modes is missing is not decided
/// by the wish that none were.
fn verdict(sorted: Vec<Scored>, odds: f64) -> Pairing {
    let (least, by_data) = sorted
        .first()
        .map_or((0.0, 0.0), |best| (best.cost, best.by_data));
    let mut kept: Vec<Numbering> = sorted
        .into_iter()
        .filter(|scored| scored.by_data.min(scored.cost + by_data - least) - by_data < odds.ln())
        .map(|scored| Numbering {
            odds: (scored.cost - least).exp(),
            ..scored.numbering
        })
        .collect();
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
    Pairing {
        chosen,
        others: kept,
    }
}

/// Returns true where the peaks are numbered 1, 2, 3 and so on.
pub fn is_plain(numbers: &[Option<usize>]) -> bool {
    let mut places = numbers.iter().enumerate();
    places.all(|(index, number)| *number == Some(index + 1))
}
