//! What the decays say by themselves of a joint whose stiffness depends on the amplitude.
//!
//! Nothing else in the catalogue changes a frequency along a decay. The finding therefore stands beside the
//! verdict on the frequencies: a model may miss them for another reason, and its joint soften all the
//! same.

use super::along_decay::lawful_change;
use super::decay_law::{Changes, LARGEST, Regression};
use super::forward::Forward;
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::noise::{self, Reading};
use super::solved::Solved;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::effects::{EffectId, JointLaw};

/// Probability by chance below which a change counts: a false one in a thousand tests.
const CHANCE: f64 = 0.001;
/// Goodness of fit below which a joint's law does not explain the changes.
const MISFIT: f64 = 0.001;
/// Standard uncertainties beyond which a change has a direction, 95 % two-sided: that there are changes at all is
/// certain before that is asked.
const DIRECTED: f64 = 2.0;
/// Changes with a direction that have to go the same way before they are a joint's: one by itself always does.
const TOGETHER: usize = 2;

/// Frequencies that change along the decays, and what joint would do that.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct DecayFinding {
    /// "joint-nonlinearity" where a joint does that: a law of its rotation explains the changes, or all frequencies
    /// that change do so the same way, of which there are two at least; else null. Joints soften in translation too,
    /// which modes feel that do not turn them; the change of the rotation is then unknown.
    pub effect: Option<EffectId>,
    /// Whether more than one frequency changes in a certain direction: of one alone the cause stays open.
    pub enough: bool,
    /// Whether a law of the joint's rotation explains the changes: only then `ratio` is its size.
    pub lawful: bool,
    /// Relative change of the joint's rotational stiffness at the largest amplitude (1), over that at
    /// rest: negative where it softens. No change beyond 0.7 is looked for.
    pub ratio: f64,
    /// Its standard uncertainty (1).
    pub ratio_std: f64,
    /// Whether the changes ask for as much as is looked for: `ratio` is then a bound, and `ratio_std` does
    /// not hold.
    pub at_bound: bool,
    /// Power of the amplitude that fits best, of 1/2, 1, 3/2 and 2.
    pub exponent: f64,
    /// Probability of changes as large if there were none: noise, and what the model leaves open of them,
    /// so that it is larger than noise alone would have it.
    pub chance: f64,
    /// Probability of a misfit as large or larger, if the joint's stiffness changes like that.
    pub goodness_of_fit: Option<f64>,
    /// The frequencies that were followed.
    pub changes: Vec<DecayChange>,
}

/// How a frequency changes along the decays of a recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct DecayChange {
    /// The mode.
    pub mode: usize,
    /// The recording.
    pub recording: String,
    /// Amplitude of its taps over that of the hardest recording (1); `None` where no force was measured.
    pub level: Option<f64>,
    /// Change per e-fold of its amplitude (%): negative where the frequency falls with the amplitude.
    pub percent_per_fold: f64,
    /// Its standard uncertainty (%).
    pub std: f64,
    /// What the joint's law makes of it (%).
    pub explained: f64,
}

impl DecayFinding {
    /// Judges changes by the law that explains them best.
    pub fn new(
        law: JointLaw,
        ratio_std: f64,
        chance: f64,
        goodness_of_fit: Option<f64>,
        changes: Vec<DecayChange>,
    ) -> Self {
        let directed: Vec<&DecayChange> = changes
            .iter()
            .filter(|change| change.percent_per_fold.abs() > DIRECTED * change.std)
            .collect();
        let lawful = goodness_of_fit.is_some_and(|p| p >= MISFIT);
        let enough = directed.len() >= TOGETHER;
        let same_way = directed
            .iter()
            .all(|change| change.percent_per_fold * law.ratio > 0.0);
        DecayFinding {
            effect: (lawful || enough && same_way).then_some(EffectId::JointNonlinearity),
            enough,
            lawful,
            ratio: law.ratio,
            ratio_std,
            at_bound: law.ratio.abs() >= LARGEST,
            exponent: law.exponent,
            chance,
            goodness_of_fit,
            changes,
        }
    }

    /// "softens" or "stiffens".
    pub fn direction(&self) -> &'static str {
        if self.ratio < 0.0 {
            "softens"
        } else {
            "stiffens"
        }
    }
}

/// Rows of changes along the decays.
pub(super) fn slopes(frame: &Frame) -> Vec<usize> {
    (0..frame.rows.len())
        .filter(|&row| matches!(frame.rows[row], Row::Slope { .. }))
        .collect()
}

/// The law that explains the changes along the decays best, with the joint of a fitted model.
pub(super) fn best_law(frame: &Frame, nominal: &Fit) -> Option<Regression> {
    let forward = Forward::new(frame, &[]);
    let solved = forward.solve(&nominal.branch.optimum.parameters)?;
    let rows = slopes(frame);
    let readings: Vec<Reading> = rows.iter().map(|&row| frame.readings[row]).collect();
    law_of(frame, &solved, &readings)
}

/// The same of solved structures and of readings that may differ from the frame's, one for each row of a
/// change.
pub(super) fn law_of(frame: &Frame, solved: &[Solved], readings: &[Reading]) -> Option<Regression> {
    // Without a rotation that is sought there is no such law.
    frame.nominal.sought().iter().find(|one| one.0 == 1)?;
    let rows = slopes(frame);
    let changes = Changes {
        readings,
        predicted: &|law| {
            let of_row = |&row: &usize| predicted(frame, row, solved, law);
            rows.iter().map(of_row).collect()
        },
    };
    changes.best_law()
}

/// What a law makes of the change in a row; 0 where the row is of something else.
pub(super) fn predicted(frame: &Frame, row: usize, solved: &[Solved], law: &JointLaw) -> f64 {
    match frame.rows[row] {
        Row::Slope {
            configuration,
            mode,
        } => lawful_change(
            &frame.setups[configuration],
            mode,
            &solved[configuration],
            law,
        ),
        _ => 0.0,
    }
}

/// The finding, where frequencies change by more than chance.
pub(super) fn decay_finding(frame: &Frame, nominal: &Fit) -> Option<DecayFinding> {
    let rows = slopes(frame);
    let square = |residual: f64, row: usize| {
        let reading = frame.readings[row];
        noise::gaussian_square(residual / reading.std, reading.freedom)
    };
    let still = rows
        .iter()
        .map(|&row| square(frame.readings[row].value, row));
    let chance = noise::chi_square_tail(still.sum(), rows.len() as f64)?;
    if chance > CHANCE {
        return None;
    }
    let found = best_law(frame, nominal)?;
    let forward = Forward::new(frame, &[]);
    let solved = forward.solve(&nominal.branch.optimum.parameters)?;
    let explained = |row: usize| predicted(frame, row, &solved, &found.law);
    let left = rows
        .iter()
        .map(|&row| square(frame.readings[row].value - explained(row), row));
    // Size and exponent were sought.
    let goodness_of_fit = noise::chi_square_tail(left.sum(), rows.len() as f64 - 2.0);
    let change = |&row: &usize| match frame.rows[row] {
        Row::Slope {
            configuration,
            mode,
        } => Some(DecayChange {
            mode,
            recording: frame.setups[configuration].file.clone(),
            level: frame.setups[configuration].known_level,
            percent_per_fold: 100.0 * frame.readings[row].value,
            std: 100.0 * frame.readings[row].std,
            explained: 100.0 * explained(row),
        }),
        _ => None,
    };
    let changes = rows.iter().filter_map(change).collect();
    Some(DecayFinding::new(
        found.law,
        found.std,
        chance,
        goodness_of_fit,
        changes,
    ))
}
