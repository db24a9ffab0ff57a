//! Moments of a joint's rotation that are no linear spring, as what they add to one.

/// Restoring moment of the joint's rotation, M(theta).
#[derive(Debug, Clone, PartialEq)]
pub enum JointMoment {
    /// M = k theta (1 + c theta^2): elastic, so that it dissipates nothing.
    Cubic {
        /// Stiffness k at rest (N m/rad).
        stiffness: f64,
        /// c (1/rad^2); negative softens.
        cubic: f64,
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
    /// Stiffness at rest (N m/rad), which belongs to the linear structure.
    pub fn stiffness(&self) -> f64 {
        match self {
            Self::Cubic { stiffness, .. } | Self::MicroSlip { stiffness, .. } => *stiffness,
        }
    }

    /// How many positions of sliders it remembers.
    pub(super) fn memory(&self) -> usize {
        match self {
            Self::Cubic { .. } => 0,
            Self::MicroSlip { sliders, .. } => sliders.len(),
        }
    }

    /// Moves to `rotation` (rad) from where the sliders stand, `from`, to where they then stand, `to`.
    pub(super) fn follow(&self, rotation: f64, from: &[f64], to: &mut [f64]) -> Extra {
        match self {
            Self::Cubic { stiffness, cubic } => {
                let square = cubic * rotation * rotation;
                Extra {
                    moment: stiffness * square * rotation,
                    slope: 3.0 * stiffness * square,
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
            // The integral of k c theta^3.
            Self::Cubic { stiffness, cubic } => 0.25 * stiffness * cubic * rotation.powi(4),
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
