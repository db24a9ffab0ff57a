//! How the joint moves after the taps of one recording, and what a stiffness that depends on the
//! amplitude makes of it.
//!
//! All modes turn the joint at once, and each dies away at its own rate. What a mode feels at a time is
//! set by its own amplitude and by those of all others; what is read of it is an average over its decay,
//! or its frequency at two times.

use super::decay_readings::beginning;
use super::setup::Setup;
use super::solved::Solved;
use tapjoint_beam::effects::{JointLaw, ModeMotion};
use tapjoint_beam::specimen::SpecimenModes;
use tapjoint_identify::observation::Configuration;

/// Times at which an average over a decay is taken; they lie denser where the decay begins. 16 leave
/// 0.5 % of the average.
const TIMES: usize = 16;
/// Decay times after which a mode adds nothing to its average any more.
const RUNG_DOWN: f64 = 4.0;
/// Times in the first period of the lowest mode, among which the largest rotation is sought.
const PEAK_TIMES: usize = 400;

/// One mode's part in the joint's rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ModePath {
    /// Its number.
    pub(super) mode: usize,
    /// Amplitude of the joint's rotation when the decay begins, over the largest rotation of all
    /// recordings (1); with the sign that a tap gives it.
    amplitude: f64,
    /// Angular frequency (rad/s).
    omega: f64,
    /// Rate of decay (1/s).
    rate: f64,
}

/// How the joint moves after the taps of one configuration.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct JointPath {
    modes: Vec<ModePath>,
    /// Length of the decays that were fitted (s).
    seconds: f64,
}

/// Amplitude of the joint's rotation after a tap at a place (m) at a level (1), in units of the tap's force:
/// what it moves, summed over these modes as sqrt(sum (phi_i(tap) theta_i/omega_i)^2).
pub(super) fn joint_amplitude(
    modes: &SpecimenModes,
    (tap, level): (f64, f64),
    which: impl Iterator<Item = usize>,
) -> f64 {
    let square = |mode: usize| {
        let omega = std::f64::consts::TAU * modes.frequencies()[mode];
        (modes.displacement(mode, tap) * modes.joint_motion(mode)[1] / omega).powi(2)
    };
    level * which.map(square).sum::<f64>().sqrt()
}

/// Relative changes of the stiffness that the modes of one configuration feel.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Changes {
    /// Number of the mode and its change.
    modes: Vec<(usize, f64)>,
    /// Mean of all modes: what the structure is solved with.
    pub(super) mean: f64,
}

impl Changes {
    /// Of one mode, where its amplitude is known.
    pub(super) fn of(&self, mode: usize) -> Option<f64> {
        let found = self.modes.iter().find(|one| one.0 == mode);
        found.map(|one| one.1)
    }
}

impl JointPath {
    /// From the amplitudes that were observed at the sensors and the shapes of a fitted model; `None`
    /// where no amplitude is known.
    pub(super) fn new(
        configuration: &Configuration,
        setup: &Setup,
        solved: &Solved,
    ) -> Option<JointPath> {
        let mut modes = Vec::new();
        for mode in &configuration.modes {
            let (Some((amplitude, damping)), Some(reference)) = (beginning(mode), mode.reference)
            else {
                continue;
            };
            let Some(index) = solved.index(mode.mode) else {
                continue;
            };
            let rotation = solved.modes().joint_motion(index)[1];
            let at_sensor = solved
                .modes()
                .displacement(index, configuration.sensors.get(reference)?.position?);
            let at_tap = setup
                .tap
                .map_or(1.0, |tap| solved.modes().displacement(index, tap));
            let omega = std::f64::consts::TAU * mode.frequency;
            let size = (amplitude * rotation / at_sensor).abs();
            if size.is_finite() {
                modes.push(ModePath {
                    mode: mode.mode,
                    amplitude: size.copysign(rotation * at_tap),
                    omega,
                    rate: damping * omega,
                });
            }
        }
        let seconds = configuration.decay_seconds.unwrap_or(f64::INFINITY);
        (!modes.is_empty()).then_some(JointPath { modes, seconds })
    }

    /// The largest rotation of the free motion that a blow starts, in the unit of the amplitudes.
    pub(super) fn peak(&self) -> f64 {
        let lowest = self
            .modes
            .iter()
            .map(|m| m.omega)
            .fold(f64::INFINITY, f64::min);
        let step = std::f64::consts::TAU / lowest / PEAK_TIMES as f64;
        (1..=PEAK_TIMES)
            .map(|k| {
                let t = step * k as f64;
                let turn = |m: &ModePath| m.amplitude * (-m.rate * t).exp() * (m.omega * t).sin();
                self.modes.iter().map(turn).sum::<f64>().abs()
            })
            .fold(0.0, f64::max)
    }

    /// The same motion in units of another amplitude.
    pub(super) fn over(mut self, amplitude: f64) -> JointPath {
        for mode in &mut self.modes {
            mode.amplitude /= amplitude;
        }
        self
    }

    fn place(&self, mode: usize) -> Option<usize> {
        self.modes.iter().position(|one| one.mode == mode)
    }

    /// Largest rotation that another mode begins with over the own one (1); `None` of a mode whose amplitude is not
    /// known, or that does not turn the joint: such a one feels nothing of it either.
    pub(super) fn others_over_own(&self, mode: usize) -> Option<f64> {
        let place = self.place(mode)?;
        let others = self.modes.iter().enumerate().filter(|(k, _)| *k != place);
        let largest = others.map(|(_, m)| m.amplitude.abs()).fold(0.0, f64::max);
        let ratio = largest / self.modes[place].amplitude.abs();
        ratio.is_finite().then_some(ratio)
    }

    /// Relative change of the stiffness that a mode feels at a time (s) after its decay began.
    fn change_at(&self, place: usize, time: f64, law: &JointLaw) -> f64 {
        let motion = |m: &ModePath| ModeMotion {
            amplitude: m.amplitude.abs() * (-m.rate * time).exp(),
            omega: m.omega,
        };
        let own = motion(&self.modes[place]);
        let others = self.modes.iter().enumerate();
        let others = others.filter(|(k, _)| *k != place).map(|(_, m)| motion(m));
        law.change_among(own, others)
    }

    /// The change that the frequency fitted to a whole decay stands for; `None` of a mode whose
    /// amplitude is not known.
    ///
    /// Least squares weigh the phase with e^{-bt}, b = 2 rate; a change g(t) of the angular frequency then
    /// fits as cov(t, integral of g)/var(t), which is the integral of K g with
    /// K(t) ~ integral of e^{-bs} (s - mean) from t to T.
    fn whole(&self, mode: usize, law: &JointLaw) -> Option<f64> {
        let place = self.place(mode)?;
        let b = 2.0 * self.modes[place].rate;
        let last = self.seconds.min(2.0 * RUNG_DOWN / b);
        let tail = (-b * last).exp();
        let mean = 1.0 / b - last * tail / (1.0 - tail);
        let upper = tail * ((last - mean) / b + 1.0 / (b * b));
        let (mut sum, mut weights) = (0.0, 0.0);
        for k in 0..TIMES {
            // t = T u^2, dt ~ u du.
            let u = (k as f64 + 0.5) / TIMES as f64;
            let t = last * u * u;
            let weight = u * ((-b * t).exp() * ((t - mean) / b + 1.0 / (b * b)) - upper);
            sum += weight * self.change_at(place, t, law);
            weights += weight;
        }
        Some(sum / weights)
    }

    /// The change at two amplitudes of the mode, as shares of its first one.
    pub(super) fn between(
        &self,
        mode: usize,
        shares: (f64, f64),
        law: &JointLaw,
    ) -> Option<(f64, f64)> {
        let place = self.place(mode)?;
        let at = |share: f64| {
            let time = (-share.ln() / self.modes[place].rate).max(0.0);
            self.change_at(place, time, law)
        };
        Some((at(shares.0), at(shares.1)))
    }

    /// The change that each mode's frequency stands for, and their mean.
    pub(super) fn changes(&self, law: &JointLaw) -> Changes {
        let whole = |m: &ModePath| Some((m.mode, self.whole(m.mode, law)?));
        let modes: Vec<(usize, f64)> = self.modes.iter().filter_map(whole).collect();
        let mean = modes.iter().map(|mode| mode.1).sum::<f64>() / modes.len().max(1) as f64;
        Changes { modes, mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(amplitudes: &[f64]) -> JointPath {
        let one = |(index, &amplitude): (usize, &f64)| ModePath {
            mode: index + 1,
            amplitude,
            omega: 100.0 * (index + 1) as f64,
            rate: 1.0,
        };
        JointPath {
            modes: amplitudes.iter().enumerate().map(one).collect(),
            seconds: 10.0,
        }
    }

    /// A mode by itself is disturbed by nothing; one of several by the largest of the others, whatever the signs; of a
    /// mode that was not seen nothing is said, nor of one that does not turn the joint.
    #[test]
    fn limit_only_others_disturb_a_mode() {
        assert_eq!(path(&[0.5]).others_over_own(1), Some(0.0));
        let several = path(&[1.0, -2.0, 0.25]);
        let ratios = [1, 2, 3].map(|mode| several.others_over_own(mode));
        assert_eq!(ratios, [Some(2.0), Some(0.5), Some(8.0)]);
        assert_eq!(several.others_over_own(4), None);
        assert_eq!(path(&[1.0, 0.0]).others_over_own(2), None);
    }
}
