//! Rotation of the joint after the taps of one recording, and the stiffness that its modes feel.
//!
//! All modes turn the joint at once, and each decays at its own rate. The stiffness that a mode feels at a time
//! depends on its own amplitude and on those of all others. A fitted frequency is an average over its
//! decay; a followed one is taken at two times.

use std::collections::BTreeMap;
use tapjoint_beam::effects::{JointLaw, ModeMotion};
use tapjoint_identify::observation::ObservedMode;

/// Times at which an average over a decay is taken; they lie denser where the decay begins. 16 leave
/// 0.5 % of the average.
const TIMES: usize = 16;
/// Decay times after which a mode adds nothing more to its average.
const DECAY_TIMES: f64 = 4.0;
/// Times in the first period of the lowest mode, at which the largest rotation is searched.
const PEAK_TIMES: usize = 400;
/// Least stiffness that is left of a joint that softens (1).
pub const LEAST_STIFFNESS: f64 = 0.05;
/// Damping ratio of a mode whose own was not measured (1): the logarithmic middle of those of beams.
const USUAL_DAMPING: f64 = 0.003;

/// Part of one mode in the rotation of the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeAmplitude {
    /// Number of the mode.
    pub mode: usize,
    /// Amplitude of the joint's rotation when the decay begins, over the largest rotation of all
    /// recordings (1); with the sign that a tap gives it.
    pub amplitude: f64,
    /// Angular frequency (rad/s).
    pub omega: f64,
    /// Rate of decay (1/s).
    pub rate: f64,
}

impl ModeAmplitude {
    /// Returns the motion at a time (s) after the decay began.
    fn at(&self, time: f64) -> ModeMotion {
        ModeMotion {
            amplitude: self.amplitude.abs() * (-self.rate * time).exp(),
            omega: self.omega,
        }
    }
}

/// Rotation of the joint after the taps of one configuration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointMotion {
    /// Modes of known amplitude.
    pub modes: Vec<ModeAmplitude>,
    /// Length of the decays that were fitted (s).
    pub seconds: f64,
}

/// Relative changes of the stiffness that the modes of one configuration feel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StiffnessChanges {
    /// Change by the number of the mode.
    modes: BTreeMap<usize, f64>,
    /// Mean of all modes, with which the structure is solved.
    pub mean: f64,
}

impl StiffnessChanges {
    /// Returns the change that one mode feels, where its amplitude is known.
    pub fn of(&self, mode: usize) -> Option<f64> {
        self.modes.get(&mode).copied()
    }
}

/// Returns the logarithm of a stiffness that has changed by this share.
pub fn log_stiffness(change: f64) -> f64 {
    (1.0 + change).max(LEAST_STIFFNESS).ln()
}

/// Returns the displacement amplitude (m) and damping ratio with which a decay begins; `None` without a calibrated
/// sensor. If the mode was followed at a larger amplitude than the initial one of the fit to the whole decay, that fit
/// has lost the begin to another pole, and the followed decay counts.
pub fn initial_amplitude(mode: &ObservedMode) -> Option<(f64, f64)> {
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

impl JointMotion {
    /// Returns the largest rotation of the free motion that a blow starts, in the unit of the amplitudes.
    pub fn peak(&self) -> f64 {
        let omegas = self.modes.iter().map(|mode| mode.omega);
        let lowest = omegas.fold(f64::INFINITY, f64::min);
        let step = std::f64::consts::TAU / lowest / PEAK_TIMES as f64;
        let mut peak: f64 = 0.0;
        for k in 1..=PEAK_TIMES {
            let t = step * k as f64;
            let turns = self.modes.iter();
            let turn: f64 = turns
                .map(|m| m.amplitude * (-m.rate * t).exp() * (m.omega * t).sin())
                .sum();
            peak = peak.max(turn.abs());
        }
        peak
    }

    /// Returns the motion in units of another amplitude.
    pub fn over(mut self, amplitude: f64) -> JointMotion {
        for mode in &mut self.modes {
            mode.amplitude /= amplitude;
        }
        self
    }

    fn index(&self, mode: usize) -> Option<usize> {
        self.modes.iter().position(|one| one.mode == mode)
    }

    /// Returns the largest initial rotation of another mode over the own one (1); `None` for a mode of unknown
    /// amplitude, and for one that does not turn the joint and so feels nothing of it.
    pub fn others_over_own(&self, mode: usize) -> Option<f64> {
        let index = self.index(mode)?;
        let others = self.modes.iter().enumerate().filter(|(k, _)| *k != index);
        let largest = others.map(|(_, m)| m.amplitude.abs()).fold(0.0, f64::max);
        let ratio = largest / self.modes[index].amplitude.abs();
        ratio.is_finite().then_some(ratio)
    }

    /// Returns the relative change of the stiffness that a mode feels at a time (s) after its decay began.
    fn change_at(&self, index: usize, time: f64, law: &JointLaw) -> f64 {
        let others = self.modes.iter().enumerate().filter(|(k, _)| *k != index);
        law.change_among(self.modes[index].at(time), others.map(|(_, m)| m.at(time)))
    }

    /// Returns the changes when the amplitude of the mode has fallen to each of two shares of its first one.
    pub fn changes_at_shares(
        &self,
        mode: usize,
        shares: [f64; 2],
        law: &JointLaw,
    ) -> Option<[f64; 2]> {
        let index = self.index(mode)?;
        let rate = self.modes[index].rate;
        Some(shares.map(|share| self.change_at(index, (-share.ln() / rate).max(0.0), law)))
    }

    /// Returns the change that the frequency of each mode stands for, which is fitted to a whole decay, and their mean.
    ///
    /// Least squares weigh the phase with e^{-bt}, b = 2 rate; a change g(t) of the angular frequency then
    /// fits as cov(t, integral of g)/var(t), which is the integral of K g with
    /// K(t) ~ integral of e^{-bs} (s - mean) from t to T.
    pub fn stiffness_changes(&self, law: &JointLaw) -> StiffnessChanges {
        let mut changes = Vec::with_capacity(self.modes.len());
        for (index, mode) in self.modes.iter().enumerate() {
            let b = 2.0 * mode.rate;
            let last = self.seconds.min(2.0 * DECAY_TIMES / b);
            let tail = (-b * last).exp();
            let mean = 1.0 / b - last * tail / (1.0 - tail);
            let upper = tail * ((last - mean) / b + 1.0 / (b * b));
            let (mut sum, mut weights) = (0.0, 0.0);
            for k in 0..TIMES {
                // t = T u^2, dt ~ u du.
                let u = (k as f64 + 0.5) / TIMES as f64;
                let t = last * u * u;
                let weight = u * ((-b * t).exp() * ((t - mean) / b + 1.0 / (b * b)) - upper);
                sum += weight * self.change_at(index, t, law);
                weights += weight;
            }
            changes.push(sum / weights);
        }
        let mean = changes.iter().sum::<f64>() / changes.len().max(1) as f64;
        let modes = self.modes.iter().map(|one| one.mode).zip(changes);
        StiffnessChanges {
            modes: modes.collect(),
            mean,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(amplitudes: &[f64]) -> JointMotion {
        let one = |(index, &amplitude): (usize, &f64)| ModeAmplitude {
            mode: index + 1,
            amplitude,
            omega: 100.0 * (index + 1) as f64,
            rate: 1.0,
        };
        JointMotion {
            modes: amplitudes.iter().enumerate().map(one).collect(),
            seconds: 10.0,
        }
    }

    /// A single mode is not disturbed; one of several by the largest of the others, whatever the signs. There is no ratio for a
    /// mode of unknown amplitude, nor for one that does not turn the joint.
    #[test]
    fn limit_only_others_disturb_a_mode() {
        assert_eq!(motion(&[0.5]).others_over_own(1), Some(0.0));
        let several = motion(&[1.0, -2.0, 0.25]);
        let ratios = [1, 2, 3].map(|mode| several.others_over_own(mode));
        assert_eq!(ratios, [Some(2.0), Some(0.5), Some(8.0)]);
        assert_eq!(several.others_over_own(4), None);
        assert_eq!(motion(&[1.0, 0.0]).others_over_own(2), None);
    }
}
