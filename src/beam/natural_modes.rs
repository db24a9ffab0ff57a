//! Natural frequencies: every root of the frequency equation, none missed and none invented.
//!
//! The number of natural frequencies below a trial value is known exactly (Wittrick & Williams
//! 1971), so that no root is missed or taken for another ([`JointedBody::root`]).
//!
//! A beam that its width stiffens has no such closed form and is divided into elements.
//!
//! Mode shapes of Euler beams follow in closed form, normalised to unit modal mass. A shape is written as
//! A cos + B sin + C e^{-lambda x} + D e^{-lambda (1-x)}: decaying exponentials from either end keep every
//! digit at high modes, where the usual difference of cosh and cos loses them all.

use super::interface::{JointWeights, JointedBody, LAST_STEP};
use super::specimen::{LapLayout, Mesh, Specimen};
use super::{
    Assembly, Beam, BeamTheory, JointStiffness, STIFFNESS_RULE, Slenderness, StructureError,
    require,
};
use std::f64::consts::PI;

/// Largest number of modes of a prediction. The hundredth mode of a slender bar has waves as short as the bar is
/// thick: there it bends like no beam.
pub const MODE_LIMIT: usize = 100;

/// Highest mode and largest number of modes that are measured. A tap excites some dozen modes. The time of an
/// estimate grows with the square of the highest one, and some thousand estimates show what errors of the
/// frequencies do to it: this limit keeps them below 10 s.
pub const MEASURED_LIMIT: usize = 30;

/// Symmetry of a lap joint's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// Both halves move alike: the joint is bent and sees Ky only.
    Symmetric,
    /// The halves move oppositely: the joint is sheared and sees Kx only.
    Antisymmetric,
}

impl Symmetry {
    /// Returns the joint that a half of a lap-jointed beam feels, by its own length. By symmetry a lap joint is two
    /// such beams. Symmetric motion bends the joint: the half's end slides freely and feels Ky, for L/2 and twice
    /// the stiffness give Ky again. Antisymmetric motion shears it: the half's end turns freely and feels
    /// 2 Kt (L/2)^3 = Kx/4.
    fn half_joint(self, joint: &JointStiffness) -> JointStiffness {
        match self {
            Self::Symmetric => JointStiffness::two_parameter(0.0, joint.ky),
            Self::Antisymmetric => JointStiffness::two_parameter(joint.kx / 4.0, 0.0),
        }
    }
}

/// One natural mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NaturalMode {
    /// Non-dimensional frequency lambda (1), by the whole length of the beam.
    pub lambda: f64,
    /// Its symmetry, for a lap joint.
    pub symmetry: Option<Symmetry>,
}

/// The first `count` non-dimensional frequencies lambda (1) of an Euler beam, ascending.
///
/// Motions at zero frequency are not counted: the two rigid-body motions of a free beam, and one
/// for each spring of a cantilever whose stiffness is exactly zero. A spring of tiny stiffness
/// makes a low mode that does count.
///
/// # Errors
/// [`StructureError`] where the joint cannot exist ([`JointStiffness::check`]), a lap joint is
/// given a cross coupling, or more than [`MODE_LIMIT`] modes are asked for.
pub fn natural_lambdas(
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    let modes = natural_modes(assembly, joint, &Slenderness::EULER, count)?;
    Ok(modes.iter().map(|mode| mode.lambda).collect())
}

/// The first `count` natural frequencies (Hz) of a beam by either theory, ascending.
///
/// # Errors
/// As [`natural_lambdas`], and where the beam cannot exist ([`Beam::check`]).
pub fn natural_frequencies(
    theory: BeamTheory,
    beam: &Beam,
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    beam.check()?;
    if beam.is_stiffened(theory) {
        return stiffened_frequencies(beam, assembly, joint, count);
    }
    let modes = natural_modes(assembly, joint, &beam.slenderness(theory), count)?;
    let lambdas = modes.iter().map(|mode| mode.lambda);
    Ok(lambdas.map(|lambda| beam.frequency_of(lambda)).collect())
}

/// Frequencies (Hz) of a Timoshenko beam that its width stiffens.
fn stiffened_frequencies(
    beam: &Beam,
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    check_count(count)?;
    let mut springs = None;
    if assembly != Assembly::Free {
        joint.check()?;
        springs = Some(joint.in_si(beam));
    }
    let (theory, layout) = (BeamTheory::Timoshenko, LapLayout::default());
    let specimen = Specimen::jointed(theory, beam, assembly, &layout, springs);
    // So many elements leave errors of 2e-7 in the seventh mode.
    let mesh = Mesh {
        elements: Mesh::SIMULATION.elements.max(16 * count),
    };
    Ok(specimen.modes(count, mesh)?.frequencies().to_vec())
}

/// The first `count` natural modes of a beam of this slenderness, ascending. Stiffening by the width is left out.
///
/// # Errors
/// As [`natural_lambdas`].
pub fn natural_modes(
    assembly: Assembly,
    joint: &JointStiffness,
    slenderness: &Slenderness,
    count: usize,
) -> Result<Vec<NaturalMode>, StructureError> {
    check_count(count)?;
    if assembly != Assembly::Free {
        joint.check()?;
    }
    // The families of modes: their symmetry, the joint of one piece, its share of the length, and their number.
    // The n-th modes of both families of a lap joint lie below the (n+1)-th of either, a family without its spring
    // starting one later; hence half of the modes from each, and two to spare.
    let families = match assembly {
        Assembly::Free => vec![(None, JointStiffness::FREE, 1.0, count)],
        Assembly::Cantilever => vec![(None, *joint, 1.0, count)],
        Assembly::Lap if joint.cross_compliance != 0.0 => {
            return Err(StructureError::NoCoupling {
                assembly: "lap joint",
                cross_compliance: joint.cross_compliance,
            });
        }
        Assembly::Lap => [Symmetry::Symmetric, Symmetry::Antisymmetric]
            .map(|family| (Some(family), family.half_joint(joint), 0.5, count / 2 + 2))
            .to_vec(),
    };
    let mut modes = Vec::with_capacity(count + 4);
    for (symmetry, joint, part, number) in families {
        let lambdas = lowest_roots(&joint, slenderness.of_piece(part), number).into_iter();
        modes.extend(lambdas.map(|lambda| NaturalMode {
            lambda: lambda / part,
            symmetry,
        }));
    }
    if assembly == Assembly::Lap {
        modes.sort_by(|a, b| a.lambda.total_cmp(&b.lambda));
        modes.truncate(count);
    }
    Ok(modes)
}

/// The first `count` lambda (1) of an Euler cantilever on any joint, physical or not.
///
/// An estimate need not be a joint that can exist. Such a joint has motions that grow instead of
/// oscillating; they have no frequency and are left out, so that mode 1 is the first that
/// oscillates.
///
/// # Errors
/// [`StructureError::Unphysical`] where a stiffness is not a number,
/// [`StructureError::TooManyModes`].
pub fn natural_lambdas_of_any_joint(
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    let [kx, ky, cross] = [joint.kx, joint.ky, joint.cross_compliance];
    for (quantity, value) in [("kx", kx), ("ky", ky), ("1/kz", cross)] {
        require(!value.is_nan(), quantity, value, STIFFNESS_RULE)?;
    }
    check_count(count)?;
    Ok(lowest_roots(joint, Slenderness::EULER, count))
}

fn check_count(count: usize) -> Result<(), StructureError> {
    // An estimate asks for one mode more than those measured or predicted.
    match count <= MODE_LIMIT + 1 {
        true => Ok(()),
        false => Err(StructureError::TooManyModes { count }),
    }
}

/// The lowest `count` roots, rigid-body motions and growing ones left out.
fn lowest_roots(joint: &JointStiffness, slenderness: Slenderness, count: usize) -> Vec<f64> {
    let weights = JointWeights::from(joint);
    let body = JointedBody::Rooted(slenderness);
    let first = weights.uncounted() + 1;
    // The n-th root lies between those of the free and of the clamped beam, near (n - 3/2) pi and
    // (n - 1/2) pi.
    (first..first + count)
        .map(|number| {
            let guess = PI * (number as f64 - 0.9);
            body.find_root(&weights, number, guess, LAST_STEP).0
        })
        .collect()
}

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
    let shapes = modes.iter().map(|mode| {
        let (part, joint) = match (assembly, mode.symmetry) {
            (Assembly::Free, _) => (1.0, JointStiffness::FREE),
            (_, None) => (1.0, *joint),
            (_, Some(symmetry)) => (0.5, symmetry.half_joint(joint)),
        };
        ModeShape {
            frequency: beam.frequency_of(mode.lambda),
            lambda: mode.lambda,
            symmetry: mode.symmetry,
            length: beam.length,
            // Both halves of a lap joint move alike, so that the whole beam's mass counts either way.
            piece: Piece::with_free_tip(part * mode.lambda, &joint)
                .normalised()
                .scaled(beam.mass().powf(-0.5)),
        }
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
    fn normalised(&self) -> Self {
        // The integral of the square over the piece follows from the values at its ends alone:
        // 4 integral = W(1)^2 - (3 W W''' - W' W'')(0) / lambda^4 where the far end is free.
        let [w0, w1, w2, w3] = [0, 1, 2, 3].map(|order| self.derivative(order, 0.0));
        let tip = self.derivative(0, 1.0);
        let mean_square = 0.25 * (tip * tip - (3.0 * w0 * w3 - w1 * w2) / self.lambda.powi(4));
        self.scaled(1f64.copysign(tip) / mean_square.sqrt())
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
