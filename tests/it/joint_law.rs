//! Closed forms of the law of a non-linear joint, for tests.

use std::f64::consts::PI;
use tapjoint::structure::effects::{JointLaw, JointLawKind};

/// Moment, sliders and dissipation of a law.
pub(crate) trait LawInClosedForm {
    /// Moment over k0 (rad) on first loading, at a rotation (rad); `coefficient` is [`JointLaw::coefficient`].
    fn first_loading(&self, rotation: f64, coefficient: f64) -> f64;

    /// Density of the sliders' stiffness over k0 (1/rad), at a slip rotation (rad). From
    /// M'' = -density: `-c p (p + 1) theta^(p - 1)`; 0 for a conservative spring.
    fn slider_density(&self, slip_rotation: f64, coefficient: f64) -> f64;

    /// Energy lost in a cycle over k0 (rad2), at an amplitude (rad): the area of Masing's loop,
    /// `-4 c p/(p + 2) a^(p + 2)`; 0 for a conservative spring.
    fn loss_per_cycle(&self, amplitude: f64, coefficient: f64) -> f64;

    /// Equivalent loss factor of the joint's rotation (1) at an amplitude relative to the hardest
    /// tap's: loss per cycle over 2 pi times the energy of the secant spring at its crest.
    fn loss_factor(&self, relative_amplitude: f64) -> f64;
}

impl LawInClosedForm for JointLaw {
    fn first_loading(&self, rotation: f64, coefficient: f64) -> f64 {
        rotation * (1.0 + coefficient * rotation.abs().powf(self.exponent))
    }

    fn slider_density(&self, slip_rotation: f64, coefficient: f64) -> f64 {
        let p = self.exponent;
        match self.kind() {
            JointLawKind::Elastic => 0.0,
            JointLawKind::MicroSlip => -coefficient * p * (p + 1.0) * slip_rotation.powf(p - 1.0),
        }
    }

    fn loss_per_cycle(&self, amplitude: f64, coefficient: f64) -> f64 {
        let p = self.exponent;
        match self.kind() {
            JointLawKind::Elastic => 0.0,
            JointLawKind::MicroSlip => -4.0 * coefficient * p / (p + 2.0) * amplitude.powf(p + 2.0),
        }
    }

    fn loss_factor(&self, relative_amplitude: f64) -> f64 {
        let loss = self.loss_per_cycle(relative_amplitude, self.coefficient(1.0));
        // The crest's energy is k a^2/2.
        let energy = 0.5 * self.secant(relative_amplitude) * relative_amplitude.powi(2);
        loss / (2.0 * PI * energy)
    }
}
