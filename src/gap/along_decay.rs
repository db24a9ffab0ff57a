//! Damping, and how frequencies change along a decay.

use super::forward::{Forward, Solved};
use super::frame::Small;
use super::joint_energy::joint_shares;
use crate::effects::EffectId;

impl Forward<'_> {
    /// Damping ratio: the nominal level and eta/2 times the joint's share of the strain energy; and the
    /// nominal level alone.
    pub(super) fn damping(
        &self,
        mode: usize,
        solved: &Solved,
        parameters: &[f64],
    ) -> Option<(f64, f64)> {
        let level = self.frame.small_index(Small::Damping)?;
        let nominal = parameters[self.layout.smalls() + level].exp();
        let shares = joint_shares(solved, solved.index(mode)?);
        Some((
            nominal + 0.5 * solved.seen.joint_loss_factor * (shares[0] + shares[1]).max(0.0),
            nominal,
        ))
    }

    /// d ln f/d ln a = S_i d ln kr/d ln a, with the mode's sensitivity S_i = d ln f_i/d ln kr and
    /// kr(a) = kr0 (1 + ratio a^p), averaged over the followed part of the decay.
    pub(super) fn slope_along_decay(
        &self,
        (configuration, mode): (usize, usize),
        solved: &Solved,
        parameters: &[f64],
    ) -> f64 {
        let Some((ratio, power)) = self.softening(parameters) else {
            return 0.0;
        };
        let Some(index) = solved.index(mode) else {
            return 0.0;
        };
        let setup = &self.frame.setups[configuration];
        let sensitivity = 0.5 * joint_shares(solved, index)[1];
        let spans = setup.spans.iter().find(|span| span.0 == mode);
        let stiffness = |amplitude: f64| {
            (1.0 + ratio * (setup.level * amplitude).powf(power))
                .max(0.05)
                .ln()
        };
        match spans {
            Some(&(_, early, late)) => {
                sensitivity * (stiffness(early) - stiffness(late)) / (early / late).ln()
            }
            None => {
                let a = self.share(parameters);
                // A factor of 1 % either way: the derivative at the effective amplitude.
                sensitivity * (stiffness(a * 1.01) - stiffness(a / 1.01)) / (2.0 * 1.01_f64.ln())
            }
        }
    }

    /// Relative stiffness change at the hardest tap and its exponent, where that is a hypothesis.
    pub(super) fn softening(&self, parameters: &[f64]) -> Option<(f64, f64)> {
        let index = self
            .layout
            .effects
            .iter()
            .position(|one| one.effect == EffectId::JointNonlinearity)?;
        Some((
            parameters[self.layout.size(index)],
            parameters[self.layout.place(index)?],
        ))
    }
}
