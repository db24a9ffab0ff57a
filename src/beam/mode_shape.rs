//! Mode shapes of Euler beams in closed form, normalised to unit modal mass.
//!
//! A shape is written as A cos + B sin + C e^{-lambda x} + D e^{-lambda (1-x)}: decaying
//! exponentials from either end keep every digit at high modes, where the usual difference of
//! cosh and cos loses them all.

use super::natural_modes::{NaturalMode, Symmetry, natural_modes};
use super::{Assembly, Beam, JointStiffness, Slenderness, StructureError};

/// The displacement of one natural mode along a beam, of unit modal mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeShape {
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Non-dimensional frequency lambda (1), by the whole length of the beam.
    pub lambda: f64,
    /// Its symmetry, for a lap joint.
    pub symmetry: Option<Symmetry>,
    /// Length of the beam (m).
    length: f64,
    /// The shape of one piece with its joint at 0 and its free end at 1, in units of kg^-1/2.
    piece: Piece,
}

/// Returns the first `count` mode shapes of an Euler beam, ascending in frequency. Rigid-body modes are
/// left out. The free end (of a lap joint or free beam the right end) moves to the positive side.
///
/// # Errors
/// As [`natural_modes`], and where the beam cannot exist.
pub fn mode_shapes(
    beam: &Beam,
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<ModeShape>, StructureError> {
    beam.check()?;
    let modes = natural_modes(assembly, joint, &Slenderness::EULER, count)?;
    let shapes = modes.iter().map(|mode| ModeShape {
        frequency: beam.frequency_of(mode.lambda),
        lambda: mode.lambda,
        symmetry: mode.symmetry,
        length: beam.length,
        // Both halves of a lap joint move alike, so that the whole beam's mass counts either way.
        piece: Piece::of_mode(assembly, joint, mode).scaled(beam.mass().powf(-0.5)),
    });
    Ok(shapes.collect())
}

impl ModeShape {
    /// Returns the displacement (kg^-1/2) at `position` (m) from the joint, of a lap joint or a free beam from
    /// the left end. Exactly at a lap joint the right half's end is meant. Off the beam the number
    /// has no meaning.
    pub fn displacement(&self, position: f64) -> f64 {
        let (side, x) = self.place(position);
        side * self.piece.derivative(0, x)
    }

    /// Returns the slope dw/dx (kg^-1/2 / m) at `position` (m), measured as in [`Self::displacement`].
    pub fn slope(&self, position: f64) -> f64 {
        let (side, x) = self.place(position);
        // On the left half of a lap joint x runs towards the left.
        let (scale, direction) = match self.symmetry {
            None => (1.0 / self.length, 1.0),
            Some(_) if 2.0 * position < self.length => (2.0 / self.length, -1.0),
            Some(_) => (2.0 / self.length, 1.0),
        };
        side * direction * scale * self.piece.derivative(1, x)
    }

    /// Returns the sign of the piece's motion at a position, and the place on the piece (0 joint, 1 free end).
    fn place(&self, position: f64) -> (f64, f64) {
        let x = position / self.length;
        match self.symmetry {
            None => (1.0, x),
            Some(symmetry) => {
                let along = 2.0 * x - 1.0;
                let opposite = symmetry == Symmetry::Antisymmetric && along < 0.0;
                (if opposite { -1.0 } else { 1.0 }, along.abs())
            }
        }
    }
}

/// Shape of a beam piece of unit length with its joint at 0 and its free end at 1.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    lambda: f64,
    cosine: f64,
    sine: f64,
    from_joint: f64,
    from_tip: f64,
}

impl Piece {
    /// Returns the shape of unit mean square, positive at the free end.
    fn of_mode(assembly: Assembly, joint: &JointStiffness, mode: &NaturalMode) -> Self {
        let (lambda, joint) = match (assembly, mode.symmetry) {
            (Assembly::Free, _) => (mode.lambda, JointStiffness::FREE),
            (_, None) => (mode.lambda, *joint),
            (_, Some(Symmetry::Symmetric)) => {
                let half = JointStiffness::two_parameter(0.0, joint.ky);
                (0.5 * mode.lambda, half)
            }
            (_, Some(Symmetry::Antisymmetric)) => {
                let half = JointStiffness::two_parameter(joint.kx / 4.0, 0.0);
                (0.5 * mode.lambda, half)
            }
        };
        let piece = Self::with_free_tip(lambda, &joint);
        let size = piece.mean_square().sqrt();
        let sign = 1f64.copysign(piece.derivative(0, 1.0));
        piece.scaled(sign / size)
    }

    /// Two solutions leave the tip free, one decaying from the joint and one from the tip:
    /// C = 1, A = e^-lambda (cos + sin), B = e^-lambda (sin - cos); and
    /// D = 1, A = cos - sin, B = cos + sin. The joint's two conditions are, of a natural mode,
    /// one and the same; the better conditioned one mixes them.
    fn with_free_tip(lambda: f64, joint: &JointStiffness) -> Self {
        let (sine, cosine) = lambda.sin_cos();
        let decay = (-lambda).exp();
        let from_joint = Self {
            lambda,
            cosine: decay * (cosine + sine),
            sine: decay * (sine - cosine),
            from_joint: 1.0,
            from_tip: 0.0,
        };
        let from_tip = Self {
            lambda,
            cosine: cosine - sine,
            sine: cosine + sine,
            from_joint: 0.0,
            from_tip: 1.0,
        };
        let first = from_joint.joint_residuals(joint);
        let second = from_tip.joint_residuals(joint);
        let sizes = [0, 1].map(|row| f64::hypot(first[row], second[row]));
        let row = usize::from(sizes[1] > sizes[0]);
        from_joint.mixed(second[row], &from_tip, -first[row])
    }

    /// Returns the rests of the joint's two conditions, each scaled by its largest coefficient:
    /// w + a W''' + c W'' = 0 and W' - b W'' - c W''' = 0 with a, b, c the joint's compliances.
    fn joint_residuals(&self, joint: &JointStiffness) -> [f64; 2] {
        let derivatives = [0, 1, 2, 3].map(|order| self.derivative(order, 0.0));
        let conditions = [
            (joint.kx, [(0, 1.0), (3, 1.0), (2, 1.0)]),
            (joint.ky, [(1, 1.0), (2, -1.0), (3, -1.0)]),
        ];
        conditions.map(|(stiffness, terms)| {
            let (spring, give) = if stiffness > 1.0 {
                (1.0, 1.0 / stiffness)
            } else {
                (stiffness, 1.0)
            };
            let weights = [spring, give, spring * joint.cross_compliance];
            let (mut rest, mut size) = (0.0, 0.0);
            for (weight, (order, sign)) in weights.into_iter().zip(terms) {
                rest += weight * sign * derivatives[order];
                // Derivatives grow with powers of lambda; without this a row would hide the other.
                size += (weight * self.lambda.powi(order as i32)).abs();
            }
            rest / size
        })
    }

    /// Returns the derivative of the given order at x, from 0 at the joint to 1 at the tip.
    fn derivative(&self, order: u8, x: f64) -> f64 {
        let (sine, cosine) = (self.lambda * x).sin_cos();
        let circular = match order % 4 {
            0 => self.cosine * cosine + self.sine * sine,
            1 => self.sine * cosine - self.cosine * sine,
            2 => -self.cosine * cosine - self.sine * sine,
            _ => self.cosine * sine - self.sine * cosine,
        };
        let falling = self.from_joint * (-self.lambda * x).exp();
        let falling = if order % 2 == 1 { -falling } else { falling };
        let rising = self.from_tip * (-self.lambda * (1.0 - x)).exp();
        self.lambda.powi(i32::from(order)) * (circular + falling + rising)
    }

    /// Returns the integral of the square over the piece, from the values at its ends alone:
    /// 4 integral = W(1)^2 - (3 W W''' - W' W'')(0) / lambda^4 where the far end is free.
    fn mean_square(&self) -> f64 {
        let [w0, w1, w2, w3] = [0, 1, 2, 3].map(|order| self.derivative(order, 0.0));
        let tip = self.derivative(0, 1.0);
        0.25 * (tip * tip - (3.0 * w0 * w3 - w1 * w2) / self.lambda.powi(4))
    }

    fn scaled(&self, factor: f64) -> Self {
        self.mixed(factor, self, 0.0)
    }

    /// Returns the combination `weight` self + `other_weight` other.
    fn mixed(&self, weight: f64, other: &Self, other_weight: f64) -> Self {
        Self {
            lambda: self.lambda,
            cosine: weight * self.cosine + other_weight * other.cosine,
            sine: weight * self.sine + other_weight * other.sine,
            from_joint: weight * self.from_joint + other_weight * other.from_joint,
            from_tip: weight * self.from_tip + other_weight * other.from_tip,
        }
    }
}
