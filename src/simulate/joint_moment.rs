//! Moments of a joint's rotation that are no linear spring, as what they add to one.

use tapjoint_beam::effects::{JointLaw, JointLawKind};

/// How many sliders stand for a continuous distribution of them: kinks are then a fortieth of the whole.
const SLIDERS: usize = 40;
/// Sliders are distributed up to this multiple of the hardest tap's rotation, or to where the joint
/// would slip as a whole.
const BEYOND_HARDEST: f64 = 3.0;
/// Least slope of a softening elastic joint, relative to that at rest.
pub(super) const LEAST_SLOPE: f64 = 0.02;

/// Restoring moment of the joint's rotation, M(theta).
#[derive(Debug, Clone, PartialEq)]
pub enum JointMoment {
    /// M = k theta (1 + c |theta|^p): elastic, so that it dissipates nothing; p = 2 is the cubic spring.
    Elastic {
        /// Stiffness k at rest (N m/rad).
        stiffness: f64,
        /// c (rad^-p); negative softens.
        coefficient: f64,
        /// p (1), positive.
        exponent: f64,
        /// Rotation (rad) beyond which a softening moment goes on as a straight line; infinite where
        /// it stiffens.
        limit: f64,
    },
    /// Micro-slip: springs in parallel, each in series with a slider (Iwan 1966), beside one that never
    /// slips.
    MicroSlip {
        /// Stiffness of all together at rest (N m/rad).
        stiffness: f64,
        /// Those that slip.
        sliders: Vec<Slider>,
    },
}

/// A spring in series with a slider (Jenkins's element).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slider {
    /// Stiffness (N m/rad).
    pub stiffness: f64,
    /// Moment at which it slips (N m).
    pub slip: f64,
}

/// What the moment adds to that of the linear spring, at one rotation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Extra {
    /// M - k theta (N m).
    pub(super) moment: f64,
    /// Its slope with theta (N m/rad).
    pub(super) slope: f64,
    /// Energy lost in slip on the way (J).
    pub(super) loss: f64,
}

impl JointMoment {
    /// Of a law, with the stiffness at rest (N m/rad) and the rotation (rad) that the hardest tap brings.
    pub fn of_law(law: &JointLaw, stiffness: f64, hardest: f64) -> Self {
        let coefficient = law.coefficient(hardest);
        match law.kind() {
            JointLawKind::Elastic => Self::elastic(stiffness, coefficient, law.exponent),
            JointLawKind::MicroSlip => Self::MicroSlip {
                stiffness,
                sliders: sliders(law, stiffness, (hardest, coefficient)),
            },
        }
    }

    /// M = k theta (1 + c |theta|^p). A softening moment has a crest, beyond which it would let go of the
    /// beam: from where its slope has fallen to 2 % it keeps that slope.
    pub fn elastic(stiffness: f64, coefficient: f64, exponent: f64) -> Self {
        let limit = if coefficient < 0.0 {
            // 1 + c (p + 1) theta^p = 0.02
            ((1.0 - LEAST_SLOPE) / (-coefficient * (exponent + 1.0))).powf(exponent.recip())
        } else {
            f64::INFINITY
        };
        Self::Elastic {
            stiffness,
            coefficient,
            exponent,
            limit,
        }
    }

    /// Stiffness at rest (N m/rad), which belongs to the linear structure.
    pub fn stiffness(&self) -> f64 {
        match self {
            Self::Elastic { stiffness, .. } | Self::MicroSlip { stiffness, .. } => *stiffness,
        }
    }

    /// How many positions of sliders it remembers.
    pub(super) fn memory(&self) -> usize {
        match self {
            Self::Elastic { .. } => 0,
            Self::MicroSlip { sliders, .. } => sliders.len(),
        }
    }

    /// Moves to `rotation` (rad) from where the sliders stand, `from`, to where they then stand, `to`.
    pub(super) fn follow(&self, rotation: f64, from: &[f64], to: &mut [f64]) -> Extra {
        match self {
            Self::Elastic {
                stiffness,
                coefficient,
                exponent,
                limit,
            } => {
                let bent = rotation.abs().min(*limit);
                let change = coefficient * power(bent, *exponent);
                let slope = (exponent + 1.0) * change;
                let straight = slope * (rotation.abs() - bent);
                Extra {
                    moment: stiffness * (change * bent + straight) * rotation.signum(),
                    slope: stiffness * slope,
                    loss: 0.0,
                }
            }
            Self::MicroSlip { sliders, .. } => {
                let mut extra = Extra::default();
                for ((slider, &from), to) in sliders.iter().zip(from).zip(to) {
                    slider.follow(rotation, (from, to), &mut extra);
                }
                extra
            }
        }
    }

    /// Elastic energy (J) beyond that of the linear spring, with the sliders at `memory`.
    pub(super) fn stored(&self, rotation: f64, memory: &[f64]) -> f64 {
        match self {
            // The integral of k c theta^{p+1}, and of the straight line from the limit on.
            Self::Elastic {
                stiffness,
                coefficient,
                exponent,
                limit,
            } => {
                let bent = rotation.abs().min(*limit);
                let more = rotation.abs() - bent;
                let change = coefficient * power(bent, *exponent);
                let straight = more * (bent + 0.5 * (exponent + 1.0) * more);
                stiffness * change * (bent * bent / (exponent + 2.0) + straight)
            }
            Self::MicroSlip { sliders, .. } => sliders
                .iter()
                .zip(memory)
                .map(|(slider, at)| {
                    0.5 * slider.stiffness * ((rotation - at).powi(2) - rotation * rotation)
                })
                .sum(),
        }
    }
}

/// Sliders whose moment on first loading is k theta (1 + c theta^p), c negative.
fn sliders(law: &JointLaw, stiffness: f64, (hardest, c): (f64, f64)) -> Vec<Slider> {
    let p = law.exponent;
    // The slope 1 + c (p + 1) theta^p vanishes where everything slips.
    let all_slip = (-1.0 / (c * (p + 1.0))).powf(p.recip());
    let last = all_slip.min(BEYOND_HARDEST * hardest);
    // Between two rotations that stiffness slips by which the slope falls. Closer together near zero,
    // because a ring-down ends there.
    let edge = |n: usize| last * (n as f64 / SLIDERS as f64).powi(2);
    (0..SLIDERS)
        .map(|n| {
            let (low, high) = (edge(n), edge(n + 1));
            let part = -c * (p + 1.0) * (high.powf(p) - low.powf(p)) * stiffness;
            Slider {
                stiffness: part,
                slip: part * 0.5 * (low + high),
            }
        })
        .collect()
}

/// The usual square without the general power, which takes ten times as long.
fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 2.0 {
        base * base
    } else {
        base.powf(exponent)
    }
}

impl Slider {
    fn follow(&self, rotation: f64, (from, to): (f64, &mut f64), extra: &mut Extra) {
        let stick = self.stiffness * (rotation - from);
        if stick.abs() <= self.slip {
            *to = from;
            extra.moment += stick - self.stiffness * rotation;
            return;
        }
        let moment = self.slip.copysign(stick);
        *to = rotation - moment / self.stiffness;
        extra.moment += moment - self.stiffness * rotation;
        extra.slope -= self.stiffness;
        extra.loss += self.slip * (*to - from).abs();
    }
}
