//! The non-linear rotational spring of a joint.
//!
//! Its secant stiffness at amplitude a is k0 (1 + ratio (a/a0)^p), a0 being the amplitude of the
//! hardest tap. Two laws have such a secant:
//!
//! - *elastic*: M = k0 theta (1 + c |theta|^p), no dissipation; for p = 2 Duffing's cubic spring;
//! - *micro-slip*: sliders of many strengths side by side (Iwan 1966), which soften and dissipate.
//!   By Masing's rules the branches between turning points are the first loading curve, doubled in
//!   size.
//!
//! The secant is that of the first harmonic (describing function), the one that shifts a frequency.

use statrs::function::gamma::gamma;
use std::f64::consts::PI;

/// Dependence of a joint's rotational stiffness on the amplitude of its rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLaw {
    /// Relative change of the secant stiffness at the hardest tap's amplitude (1).
    pub ratio: f64,
    /// Power of the amplitude (1).
    pub exponent: f64,
}

/// The physics behind a [`JointLaw`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointLawKind {
    /// A conservative spring.
    Elastic,
    /// Sliders in parallel: softens and dissipates.
    MicroSlip,
}

/// One of several motions of the joint at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeMotion {
    /// Amplitude of the rotation over that of the hardest tap (1).
    pub amplitude: f64,
    /// Angular frequency (rad/s).
    pub omega: f64,
}

impl JointLaw {
    /// Highest exponent that friction is credited with: measured micro-slip lies below.
    const SLIP_EXPONENT: f64 = 1.5;

    /// Micro-slip where the stiffness falls with a power up to 1.5, else a conservative spring.
    pub fn kind(&self) -> JointLawKind {
        if self.ratio < 0.0 && self.exponent <= Self::SLIP_EXPONENT {
            JointLawKind::MicroSlip
        } else {
            JointLawKind::Elastic
        }
    }

    /// Secant stiffness over that of small amplitudes (1), at an amplitude relative to the hardest
    /// tap's.
    pub fn secant(&self, relative_amplitude: f64) -> f64 {
        1.0 + self.ratio * relative_amplitude.powf(self.exponent)
    }

    /// Returns the relative change of the stiffness that one mode feels while others move the joint too.
    ///
    /// Elastic: (A^2 + 2 sum B^2)^{p/2}, exact for the cubic spring, where another motion counts twice
    /// (R = (p + 2)/2 of a small motion beside a large one); within 6 % for powers from 1/2 on.
    /// Micro-slip: (A + (sum (w B)^{3/2})^{2/3})^p. Several others seldom reach their crests together, and
    /// none reaches less than the root of the squares; the power 3/2 lies between. Against sliders in
    /// parallel the change comes out within 13 % for two motions, and with a scatter of 13 % for three and four.
    pub fn change_among(&self, own: ModeMotion, others: impl Iterator<Item = ModeMotion>) -> f64 {
        let p = self.exponent;
        let size = match self.kind() {
            JointLawKind::Elastic => {
                let squares = others.map(|other| other.amplitude.powi(2)).sum::<f64>();
                (own.amplitude.powi(2) + 2.0 * squares).sqrt()
            }
            JointLawKind::MicroSlip => {
                let limits = self.slip_limits();
                let parts = others.map(|other| other.amplitude * slip_weight(limits, own, other));
                let sum: f64 = parts.map(|part| part.powf(1.5)).sum();
                own.amplitude + sum.powf(2.0 / 3.0)
            }
        };
        self.ratio * size.powf(p)
    }

    /// Returns the weights of a slower and a faster motion that is much larger than the own one.
    ///
    /// With D the describing function, one motion alone changes the stiffness by c D A^p. A faster one of
    /// amplitude B lets every slider slip that is weaker than B, and the slow motion finds c (p + 1) B^p. On
    /// a slower one the own motion rides along the loop's branches, whose slope lacks
    /// c (p + 1) (x/2)^p at a distance x from the turning point; its mean over the cycle is
    /// c (p + 1) B^p times that of sin^{2p}.
    fn slip_limits(&self) -> [f64; 2] {
        let p = self.exponent;
        let alone = self.describing_function();
        let mean = gamma_ratio(p) / PI.sqrt();
        [mean, 1.0].map(|share| ((p + 1.0) * share / alone).powf(p.recip()))
    }

    /// Returns the loss factor over the change of the stiffness (1): 4 p/(pi (p + 2) D), D being the describing function;
    /// 0 for a conservative spring. Of one mode by itself exact for small changes; others share in the
    /// sliders' slip.
    pub fn loss_over_change(&self) -> f64 {
        let p = self.exponent;
        match self.kind() {
            JointLawKind::Elastic => 0.0,
            JointLawKind::MicroSlip => 4.0 * p / (PI * (p + 2.0) * self.describing_function()),
        }
    }

    /// c (rad^-p) of the law `M = k0 theta (1 + c |theta|^p)` on first loading, for a hardest tap's
    /// amplitude (rad): the secant's change divided by the describing function of `|theta|^p theta`.
    pub fn coefficient(&self, hardest_amplitude: f64) -> f64 {
        self.ratio / self.describing_function() / hardest_amplitude.powf(self.exponent)
    }

    /// First harmonic of the restoring moment's non-linear part over c k0 a^(p+1) (1).
    fn describing_function(&self) -> f64 {
        let p = self.exponent;
        match self.kind() {
            // (2/pi) integral of sin^(p+2) from 0 to pi; 3/4 for the cubic spring.
            JointLawKind::Elastic => {
                2.0 / PI.sqrt() * gamma(0.5 * (p + 3.0)) / gamma(0.5 * p + 2.0)
            }
            // With s = sin^2(t/2): (4/pi) integral of s^(p+1) (2 s - 1) from 0 to pi.
            JointLawKind::MicroSlip => {
                4.0 / PI.sqrt() * (2.0 * gamma_ratio(p + 2.0) - gamma_ratio(p + 1.0))
            }
        }
    }

    /// Moment over k0 (rad) on first loading, at a rotation (rad); `coefficient` is
    /// [`Self::coefficient`].
    pub fn first_loading(&self, rotation: f64, coefficient: f64) -> f64 {
        rotation * (1.0 + coefficient * rotation.abs().powf(self.exponent))
    }

    /// Density of the sliders' stiffness over k0 (1/rad), at a slip rotation (rad). From
    /// M'' = -density: `-c p (p + 1) theta^(p - 1)`; 0 for a conservative spring.
    pub fn slider_density(&self, slip_rotation: f64, coefficient: f64) -> f64 {
        let p = self.exponent;
        match self.kind() {
            JointLawKind::Elastic => 0.0,
            JointLawKind::MicroSlip => -coefficient * p * (p + 1.0) * slip_rotation.powf(p - 1.0),
        }
    }

    /// Energy lost in a cycle over k0 (rad2), at an amplitude (rad): the area of Masing's loop,
    /// `-4 c p/(p + 2) a^(p + 2)`; 0 for a conservative spring.
    pub fn loss_per_cycle(&self, amplitude: f64, coefficient: f64) -> f64 {
        let p = self.exponent;
        match self.kind() {
            JointLawKind::Elastic => 0.0,
            JointLawKind::MicroSlip => -4.0 * coefficient * p / (p + 2.0) * amplitude.powf(p + 2.0),
        }
    }

    /// Equivalent loss factor of the joint's rotation (1) at an amplitude relative to the hardest
    /// tap's: loss per cycle over 2 pi times the energy of the secant spring at its crest.
    pub fn loss_factor(&self, relative_amplitude: f64) -> f64 {
        let loss = self.loss_per_cycle(relative_amplitude, self.coefficient(1.0));
        // The crest's energy is k a^2/2.
        let energy = 0.5 * self.secant(relative_amplitude) * relative_amplitude.powi(2);
        if loss == 0.0 {
            0.0
        } else {
            loss / (2.0 * PI * energy)
        }
    }
}

/// Returns Gamma(q + 1/2)/Gamma(q + 1): sqrt(pi) times the mean of sin^{2q} over a cycle.
fn gamma_ratio(q: f64) -> f64 {
    gamma(q + 0.5) / gamma(q + 1.0)
}

/// Returns the weight of another motion's amplitude among what a mode feels of sliders, between 0 and its
/// limit. It depends on which of the two velocities turns about. Steepness and place of the transition follow sliders
/// in parallel under two motions (velocities 0.01 to 100 to one).
fn slip_weight(limits: [f64; 2], own: ModeMotion, other: ModeMotion) -> f64 {
    let [slower, faster] = limits;
    let velocities = own.amplitude * own.omega / (other.amplitude * other.omega).max(1e-300);
    if other.omega > own.omega {
        faster / (1.0 + 1.9 * velocities)
    } else {
        slower / (1.0 + 0.3 * velocities.powf(1.5))
    }
}
