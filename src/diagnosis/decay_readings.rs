//! Readings of decays along which a frequency changes: what of them is compared, and how much less the
//! readings that take a decay for an exponential can then be trusted.

use super::along_decay::stiffness_change;
use super::decay_finding::{law_of, predicted, slopes};
use super::frame::{Frame, Row, reading_of};
use super::joint_energy::joint_shares;
use super::noise::Reading;
use super::solved::Solved;
use tapjoint_beam::effects::{JointLaw, JointLawKind};
use tapjoint_identify::observation::{DecayVerdict, Observations, ObservedMode};

/// A slope along the decay that is smaller cannot be told from what the fits' own bias leaves, in
/// relative frequency per e-fold.
const SLOPE_FLOOR: f64 = 5e-6;

/// How well the change along a decay is predicted of the joint's motion, relative to the prediction, or to
/// the reading where that is larger: a fifth, since several motions at once are reduced to one amplitude. A
/// share of the reading alone would give the readings that came out low the larger weight (Peelle's puzzle).
const CHANGE_MODEL: f64 = 0.2;

/// How well a mode's change is predicted that other modes cause, relative to the largest change of the
/// joint's stiffness along a decay of the same recording: of a spring, and of friction. Steady motions are
/// predicted to 6 and 13 % ([`JointLaw::change_among`]); in a dying one sliders remember what a steady one makes
/// them forget, and on virtual tests (none of those that are scored) smaller shares than these refuted true slip.
const SHARED_MODEL: [f64; 2] = [0.15, 0.4];

/// Fits of the law between which the readings' uncertainty takes up how well it is predicted.
const FITS: usize = 2;

/// Standard uncertainties by which the size of the law stands out.
const STANDS_OUT: f64 = 3.0;

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
                widen(&mut reading, SLOPE_FLOOR);
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
    /// Adds how well a law of the joint predicts the changes: a share of what it makes of each, or of the
    /// reading. And every mode of a recording feels how the others move the joint, which is known but roughly:
    /// to a share of the largest change of the joint's stiffness that the law makes along its decays.
    pub(super) fn widen_changes(&mut self, solved: &[Solved]) {
        let rows = slopes(self);
        let own: Vec<Reading> = rows.iter().map(|&row| self.readings[row]).collect();
        let mut readings = own.clone();
        let mut found = law_of(self, solved, &readings);
        for _ in 0..FITS {
            for (k, &row) in rows.iter().enumerate() {
                let change = found.map_or(0.0, |one| predicted(self, row, solved, &one.law));
                readings[k] = own[k];
                let least = own[k].value.abs();
                widen(&mut readings[k], CHANGE_MODEL * change.abs().max(least));
            }
            found = law_of(self, solved, &readings);
        }
        for (reading, &row) in readings.into_iter().zip(&rows) {
            self.readings[row] = reading;
        }
        if let Some(one) = found
            && one.law.ratio.abs() > STANDS_OUT * one.std
        {
            self.widen_shared(solved, &one.law);
        }
    }

    fn widen_shared(&mut self, solved: &[Solved], law: &JointLaw) {
        let largest: Vec<f64> = (0..solved.len())
            .map(|configuration| self.largest_change(configuration, law))
            .collect();
        let shared = match law.kind() {
            JointLawKind::Elastic => SHARED_MODEL[0],
            JointLawKind::MicroSlip => SHARED_MODEL[1],
        };
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
            let tones = match self.rows[row] {
                Row::Slope { .. } => self.tones(configuration, mode),
                _ => 1.0,
            };
            widen(&mut self.readings[row], tones * shared * felt / folds);
        }
        for (row, reading) in &mut self.withheld {
            if let Row::Frequency {
                configuration,
                mode,
            } = *row
            {
                let felt = sensitivity(&solved[configuration], mode) * largest[configuration];
                widen(reading, shared * felt);
            }
        }
    }

    /// How much more than its own motion the others' may disturb the slope of a mode, 1 at least. A joint whose
    /// stiffness changes makes tones at sums and differences of the modes' frequencies, in proportion to the amplitudes
    /// of those that make them. One near a mode rings with it, and pulls its frequency by what the mode feels of the
    /// joint's change times the ratio of the amplitudes, here those with which the decays begin. Whether a tone lies near
    /// is not asked: six modes make some hundred of the third order, so that this is the worst case. Frequencies keep
    /// the share that is their own: they are averages over whole decays.
    fn tones(&self, configuration: usize, mode: usize) -> f64 {
        let path = self.setups[configuration].path.as_ref();
        let ratio = path.and_then(|path| path.others_over_own(mode));
        ratio.map_or(1.0, |ratio| ratio.max(1.0))
    }

    /// Largest change of ln kr along the followed decays of a configuration.
    fn largest_change(&self, configuration: usize, law: &JointLaw) -> f64 {
        let change = |row: &Row| match *row {
            Row::Slope {
                configuration: own,
                mode,
            } if own == configuration => {
                let per_fold = stiffness_change(&self.setups[configuration], mode, law);
                per_fold.abs() * self.folds(configuration, mode)
            }
            _ => 0.0,
        };
        self.rows.iter().map(change).fold(0.0, f64::max)
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
    let ends = (decay.early.amplitude, decay.late.amplitude);
    let (seen, folds) = match (decay.frequency_change, ends) {
        (Some(change), (Some(early), Some(late))) if early > 1.05 * late && late > 0.0 => {
            (change, (early / late).ln())
        }
        _ => (decay.frequency_slope, 1.0),
    };
    let freedom = seen.freedom.unwrap_or(f64::INFINITY).max(3.0);
    let [value, std] = [seen.value, seen.std].map(|part| part / mode.frequency / folds);
    (std.is_finite() && std > 0.0).then(|| reading_of(value, std, freedom))
}

#[cfg(test)]
mod tests {
    use super::super::example::{plan, strip};
    use super::super::hypothesis::fit_nominal;
    use super::super::settings::GapSettings;
    use super::super::synthetic::{TestPlan, observe};
    use super::*;
    use tapjoint_identify::observation::{ExtraPeak, UNPAIRED};

    /// Two recordings of five modes, of a joint that does not depend on the amplitude.
    fn observations() -> Observations {
        let plan = TestPlan {
            modes: 5,
            frequency_std: 1e-5,
            slope_std: Some(1e-4),
            ..plan(&[0.34, 0.34])
        };
        observe(&plan, &strip(0.0), &[], 3).unwrap()
    }

    /// Sets the changes per e-fold, relative, of one mode; all known to 1e-4.
    fn change(observations: &mut Observations, mode: usize, values: [f64; 2]) {
        for (configuration, value) in observations.configurations.iter_mut().zip(values) {
            let seen = &mut configuration.modes[mode - 1];
            let slope = &mut seen.decay.as_mut().unwrap().frequency_slope;
            (slope.value, slope.std) = (value * seen.frequency, 1e-4 * seen.frequency);
        }
    }

    /// The frame before and after the changes along the decays are taken up, and sensitivities.
    fn frames(observations: &Observations) -> (Frame, Frame, Vec<f64>) {
        let settings = GapSettings::default();
        let before = Frame::new(observations, &strip(0.0), &settings);
        let fit = fit_nominal(&before, &settings).unwrap();
        let forward = super::super::forward::Forward::new(&before, &[]);
        let solved = forward.solve(&fit.branch.optimum.parameters).unwrap();
        let sensitivities = (1..=5).map(|mode| sensitivity(&solved[0], mode)).collect();
        let mut after = before.clone();
        after.set_paths(observations, &fit);
        (before, after, sensitivities)
    }

    fn reading(frame: &Frame, row: Row) -> Reading {
        frame.readings[frame.rows.iter().position(|one| *one == row).unwrap()]
    }

    fn frequency(configuration: usize, mode: usize) -> Row {
        Row::Frequency {
            configuration,
            mode,
        }
    }

    fn slope(configuration: usize, mode: usize) -> Row {
        Row::Slope {
            configuration,
            mode,
        }
    }

    #[test]
    fn regress_a_foreign_change_blinds_no_recording() {
        let mut observed = observations();
        for mode in 1..=5 {
            change(&mut observed, mode, [0.0; 2]);
        }
        let (_, _, sensitivities) = frames(&observed);
        let least = (1..=5)
            .min_by(|a, b| sensitivities[a - 1].total_cmp(&sensitivities[b - 1]))
            .unwrap();
        // 0.1 % per e-fold in the mode that feels the rotation least.
        change(&mut observed, least, [-1e-3, 0.0]);
        let (before, after, _) = frames(&observed);
        for mode in 1..=5 {
            let (own, wider) = (
                reading(&before, frequency(0, mode)),
                reading(&after, frequency(0, mode)),
            );
            assert!(wider.std < 1.01 * own.std, "mode {mode}: {own:?} {wider:?}");
        }
    }

    #[test]
    fn regress_low_readings_have_no_larger_weight() {
        let mut observed = observations();
        let (_, _, sensitivities) = frames(&observed);
        for (index, sensitivity) in sensitivities.iter().enumerate() {
            // 2 % of the joint's stiffness per e-fold, and readings to either side of what that makes.
            let value = -0.02 * sensitivity;
            change(&mut observed, index + 1, [1.2 * value, 0.8 * value]);
        }
        let (before, after, _) = frames(&observed);
        for mode in 1..=5 {
            let [high, low] = [0, 1].map(|k| reading(&after, slope(k, mode)));
            let own = reading(&before, slope(0, mode)).std;
            // A fifth of the common change, found from ten readings; what is felt of others comes to it.
            let model = 0.2 * 0.02 * sensitivities[mode - 1];
            assert!(low.std > 0.95 * own.hypot(model), "{low:?} {own} {model}");
            assert!(high.std > 0.999 * low.std, "{high:?} {low:?}");
        }
    }

    #[test]
    fn regress_a_split_decay_weakens_itself_alone() {
        let observed = observations();
        let mut split = observed.clone();
        split.configurations[0].extra_peaks.push(ExtraPeak {
            frequency: 1.005 * observed.configurations[0].modes[2].frequency,
            std: None,
            level_db: None,
            constant: None,
            label: UNPAIRED.to_owned(),
        });
        let (plain, _, _) = frames(&observed);
        let (twinned, _, _) = frames(&split);
        for (configuration, mode) in [(0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (1, 3)] {
            let row = frequency(configuration, mode);
            let (mut own, seen) = (reading(&plain, row), reading(&twinned, row));
            if (configuration, mode) == (0, 3) {
                widen(&mut own, 0.005 / 3.0_f64.sqrt());
            }
            // The peak's place is a ratio of two frequencies.
            assert!((seen.std / own.std - 1.0).abs() < 1e-6, "{row:?} {seen:?}");
            assert!((seen.freedom / own.freedom - 1.0).abs() < 1e-5, "{row:?}");
        }
    }
}
