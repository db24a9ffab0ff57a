//! Readings of decays along which a frequency changes: what of them is compared, and how much less the
//! readings that take a decay for an exponential can then be trusted.

use super::forward::Solved;
use super::frame::{Frame, Row, reading_of};
use super::joint_energy::joint_shares;
use super::noise::Reading;
use crate::identify::observation::{DecayVerdict, Observations, ObservedMode};

/// A slope along the decay that is smaller cannot be told from what the fits' own bias leaves, in
/// relative frequency per e-fold.
const SLOPE_FLOOR: f64 = 5e-6;

/// How well the change along a decay is predicted of the joint's motion, relative to the change: a fifth,
/// since several motions at once are reduced to one amplitude.
const CHANGE_MODEL: f64 = 0.2;

/// How well a mode's change is predicted that other modes cause, relative to the largest change of the
/// joint's stiffness along a decay of the same recording.
const SHARED_MODEL: f64 = 0.15;

/// Standard uncertainties by which a change stands out (their known part is a fifth of the change, so that
/// five is the most).
const STANDS_OUT: f64 = 3.0;

/// Least sensitivity to the joint from which a frequency says how much its stiffness changes.
const LEAST_SENSITIVITY: f64 = 0.02;

/// What of a change along the decay remains uncertain in the frequency that was fitted to all of it
/// (1): the average is that of a small change; 15 % where it is as large as the half-power width.
const AVERAGE: f64 = 0.15;

/// Relative error of a modal constant per half-power width by which the frequency changes along the decay:
/// what is no exponential is carried back to the blow by one.
const BENT: f64 = 0.5;

/// Damping ratio of a mode whose own was not read (1): the middle of what beams have, in logarithms.
const USUAL_DAMPING: f64 = 0.003;

impl Frame {
    /// Changes of the frequencies along the decays.
    pub(super) fn add_slopes(&mut self, observations: &Observations) {
        let fitted = self.fitted_modes;
        for (configuration, one) in observations.configurations.iter().enumerate() {
            for mode in one.modes.iter().filter(|m| m.mode <= fitted) {
                let Some(mut reading) = slope_of(mode) else {
                    continue;
                };
                let model = CHANGE_MODEL * reading.value;
                widen(&mut reading, SLOPE_FLOOR.hypot(model));
                let row = Row::Slope {
                    configuration,
                    mode: mode.mode,
                };
                self.push(row, reading);
            }
        }
    }
}

impl Frame {
    /// Every mode of a recording feels how the others move the joint, which is known but roughly: to a
    /// share of the largest change of the joint's stiffness that a decay of that recording shows.
    pub(super) fn widen_changes(&mut self, solved: &[Solved]) {
        let largest: Vec<f64> = (0..solved.len())
            .map(|configuration| self.largest_change(configuration, &solved[configuration]))
            .collect();
        for row in 0..self.rows.len() {
            let (configuration, mode, folds) = match self.rows[row] {
                Row::Slope {
                    configuration,
                    mode,
                } => (configuration, mode, self.folds(configuration, mode)),
                Row::Frequency {
                    configuration,
                    mode,
                } => (configuration, mode, 1.0),
                _ => continue,
            };
            let felt = sensitivity(&solved[configuration], mode) * largest[configuration];
            widen(&mut self.readings[row], SHARED_MODEL * felt / folds);
        }
        for (row, reading) in &mut self.withheld {
            if let Row::Frequency {
                configuration,
                mode,
            } = *row
            {
                let felt = sensitivity(&solved[configuration], mode) * largest[configuration];
                widen(reading, SHARED_MODEL * felt);
            }
        }
    }

    /// Largest change of ln kr along the decays of a configuration, of the changes that stand out.
    fn largest_change(&self, configuration: usize, solved: &Solved) -> f64 {
        let change = |row: usize| {
            let Row::Slope {
                configuration: own,
                mode,
            } = self.rows[row]
            else {
                return 0.0;
            };
            let (reading, sensitivity) = (self.readings[row], sensitivity(solved, mode));
            let stands_out = reading.value.abs() > STANDS_OUT * reading.std;
            if own != configuration || !stands_out || sensitivity < LEAST_SENSITIVITY {
                return 0.0;
            }
            reading.value.abs() * self.folds(configuration, mode) / sensitivity
        };
        (0..self.rows.len()).map(change).fold(0.0, f64::max)
    }

    /// Logarithm of the amplitudes between which a decay was followed; 1 where they are not known.
    fn folds(&self, configuration: usize, mode: usize) -> f64 {
        let spans = &self.setups[configuration].spans;
        let span = spans.iter().find(|span| span.0 == mode);
        span.map_or(1.0, |&(_, early, late)| (early / late).ln())
    }
}

/// d ln f/d ln kr.
fn sensitivity(solved: &Solved, mode: usize) -> f64 {
    let index = solved.index(mode);
    index.map_or(0.0, |index| 0.5 * joint_shares(solved, index)[1])
}

/// Adds an uncertainty that is known, not estimated: the degrees of freedom grow with the share that is
/// (Welch & Satterthwaite).
pub(super) fn widen(reading: &mut Reading, known: f64) {
    let wider = reading.std.hypot(known);
    if wider > reading.std {
        reading.freedom *= (wider / reading.std).powi(4);
        reading.std = wider;
    }
}

/// Displacement amplitude (m) and damping ratio with which a decay begins; `None` without a calibrated
/// sensor. Where the mode was followed at a larger amplitude than the fit to the whole decay has at
/// its begin, that fit has lost the begin to another pole, and the followed decay counts.
pub(super) fn beginning(mode: &ObservedMode) -> Option<(f64, f64)> {
    let fitted = mode.amplitude?;
    let damping = mode.damping.map_or(USUAL_DAMPING, |damping| damping.value);
    let followed = mode
        .decay
        .and_then(|decay| Some((decay.early.amplitude?, decay.early.damping.value)));
    Some(match followed {
        Some((early, own)) if early > fitted && own > 0.0 => (early, own),
        _ => (fitted, damping.max(1e-5)),
    })
}

/// Relative uncertainty that a change along the decay adds to the frequency fitted to all of it.
pub(super) fn average_std(mode: &ObservedMode) -> f64 {
    AVERAGE * change_along(mode).unwrap_or(0.0)
}

/// Relative uncertainty that it adds to a modal constant.
pub(super) fn bent_std(mode: &ObservedMode) -> f64 {
    BENT * chirp(mode)
}

/// Change of the logarithm of the frequency along the followed decay; `None` where it is steady.
fn change_along(mode: &ObservedMode) -> Option<f64> {
    let decay = mode.decay?;
    let (early, late) = (decay.early.frequency.value, decay.late.frequency.value);
    (decay.verdict != DecayVerdict::Steady).then(|| (early / late).ln().abs())
}

/// The same in half-power widths, 2 zeta f; 0 where it is steady.
fn chirp(mode: &ObservedMode) -> f64 {
    let damping = mode.damping.map(|damping| damping.value);
    match (change_along(mode), damping) {
        (Some(change), Some(damping)) if damping > 0.0 => 0.5 * change / damping,
        _ => 0.0,
    }
}

/// Change of the logarithm of a frequency per e-fold of the amplitude, between the ends of the followed
/// decay where their amplitudes are known.
fn slope_of(mode: &ObservedMode) -> Option<Reading> {
    let decay = mode.decay?;
    if decay.verdict == DecayVerdict::Doubtful {
        return None;
    }
    let slope = decay.frequency_slope;
    let freedom = slope.freedom.unwrap_or(f64::INFINITY).max(3.0);
    let (value, std) = match (decay.early.amplitude, decay.late.amplitude) {
        (Some(early), Some(late)) if early > 1.05 * late && late > 0.0 => {
            let (first, last) = (decay.early.frequency, decay.late.frequency);
            let folds = (early / late).ln();
            let std = first.std.hypot(last.std) / mode.frequency;
            ((first.value / last.value).ln() / folds, std / folds)
        }
        _ => (slope.value / mode.frequency, slope.std / mode.frequency),
    };
    (std.is_finite() && std > 0.0).then(|| reading_of(value, std, freedom))
}
