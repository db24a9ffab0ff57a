//! Natural frequencies: every root of the frequency equation, none missed and none invented.
//!
//! The number of natural frequencies below a trial value is known exactly (Wittrick & Williams
//! 1971), so that each root is first isolated by that count and only then refined on the scaled
//! frequency equation by Brent's method.

use super::receptance::EndFunctions;
use super::{Beam, BeamTheory, JointStiffness, Slenderness, StructureError};
use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::PI;

/// No beam bends like a beam at its thousandth mode; the limit only keeps a slip of the hand from
/// running for hours.
pub const MODE_LIMIT: usize = 1000;

/// What the joint joins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Assembly {
    /// A beam held at one end by the joint.
    Cantilever,
    /// Two halves of one beam joined in the middle by relative springs, free otherwise.
    Lap,
    /// A free beam; the joint is ignored.
    Free,
}

/// Which half of a lap joint's motion mirrors the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// Both halves move alike: the joint is bent and sees Ky only.
    Symmetric,
    /// The halves move oppositely: the joint is sheared and sees Kx only.
    Antisymmetric,
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
    let modes = natural_modes(assembly, joint, &beam.slenderness(theory), count)?;
    Ok(modes
        .iter()
        .map(|mode| beam.frequency_of(mode.lambda))
        .collect())
}

/// The first `count` natural modes of a beam of this slenderness, ascending.
///
/// # Errors
/// As [`natural_lambdas`].
pub fn natural_modes(
    assembly: Assembly,
    joint: &JointStiffness,
    slenderness: &Slenderness,
    count: usize,
) -> Result<Vec<NaturalMode>, StructureError> {
    if count > MODE_LIMIT {
        return Err(StructureError::TooManyModes {
            count,
            limit: MODE_LIMIT,
        });
    }
    let single = |joint: &JointStiffness| {
        let lambdas = lowest_roots(&RootedBeam::new(joint, *slenderness), count);
        let plain = |lambda| NaturalMode {
            lambda,
            symmetry: None,
        };
        lambdas.into_iter().map(plain).collect()
    };
    match assembly {
        Assembly::Free => Ok(single(&JointStiffness::FREE)),
        Assembly::Cantilever => {
            joint.check()?;
            Ok(single(joint))
        }
        Assembly::Lap => {
            joint.check()?;
            if joint.cross_compliance != 0.0 {
                return Err(StructureError::NoCoupling {
                    assembly: "lap joint",
                    cross_compliance: joint.cross_compliance,
                });
            }
            Ok(lap_modes(joint, slenderness, count))
        }
    }
}

/// The first `count` lambda (1) of an Euler cantilever on any joint, physical or not.
///
/// An estimate need not be a joint that can exist. Such a joint has motions that grow instead of
/// oscillating; they have no frequency and are left out, so that mode 1 is the first that
/// oscillates.
///
/// # Errors
/// [`StructureError::Stiffness`] where a stiffness is not a number,
/// [`StructureError::TooManyModes`].
pub fn natural_lambdas_of_any_joint(
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    let values = [
        ("kx", joint.kx),
        ("ky", joint.ky),
        ("1/kz", joint.cross_compliance),
    ];
    for (quantity, value) in values {
        if value.is_nan() {
            return Err(StructureError::Stiffness { quantity, value });
        }
    }
    if count > MODE_LIMIT {
        return Err(StructureError::TooManyModes {
            count,
            limit: MODE_LIMIT,
        });
    }
    let beam = RootedBeam::new(joint, Slenderness::EULER);
    Ok(lowest_roots(&beam, count))
}

/// By symmetry a lap joint is two beams of half the length. Symmetric motion bends the joint: the
/// half's end slides freely and feels Ky, for L/2 and twice the stiffness give Ky again.
/// Antisymmetric motion shears it: the half's end turns freely and feels 2 Kt (L/2)^3 = Kx/4.
fn lap_modes(joint: &JointStiffness, slenderness: &Slenderness, count: usize) -> Vec<NaturalMode> {
    // The n-th modes of both families lie below the (n+1)-th of either, a family without its
    // spring starting one later; hence half of the modes from each, and two to spare.
    let half_count = count / 2 + 2;
    let family = |kx: f64, ky: f64, symmetry: Symmetry| {
        let half = JointStiffness::two_parameter(kx, ky);
        let beam = RootedBeam::new(&half, slenderness.of_piece(0.5));
        lowest_roots(&beam, half_count)
            .into_iter()
            .map(move |lambda| NaturalMode {
                lambda: 2.0 * lambda,
                symmetry: Some(symmetry),
            })
    };
    let mut modes: Vec<NaturalMode> = family(0.0, joint.ky, Symmetry::Symmetric)
        .chain(family(joint.kx / 4.0, 0.0, Symmetry::Antisymmetric))
        .collect();
    modes.sort_by(|a, b| a.lambda.total_cmp(&b.lambda));
    modes.truncate(count);
    modes
}

/// A trial value with the number of roots below it.
#[derive(Clone, Copy)]
struct Trial {
    lambda: f64,
    value: f64,
    count: usize,
}

/// The lowest `count` roots of a rooted beam that oscillate.
fn lowest_roots(beam: &RootedBeam, count: usize) -> Vec<f64> {
    let uncounted = beam.uncounted();
    let mut roots = Vec::with_capacity(count);
    let mut below = Trial {
        lambda: 0.0,
        value: 0.0,
        count: uncounted,
    };
    for number in uncounted + 1..=uncounted + count {
        let (lower, upper) = isolate(beam, below, number);
        roots.push(refine(beam, lower, upper));
        below = if upper.count == number { upper } else { lower };
    }
    roots
}

/// Closes in on root `number` until it is alone between two trial values, or until those differ
/// only in the last digits, as at two roots that coincide.
fn isolate(beam: &RootedBeam, below: Trial, number: usize) -> (Trial, Trial) {
    let trial = |lambda: f64| {
        let evaluation = beam.evaluate(lambda);
        Trial {
            lambda,
            value: evaluation.value,
            count: evaluation.count,
        }
    };
    let mut lower = below;
    // No joint holds a beam tighter than a clamp, whose n-th root lies below n pi.
    let mut upper = trial(number as f64 * PI);
    while upper.count < number {
        lower = upper;
        upper = trial(upper.lambda + PI);
    }
    loop {
        let isolated = lower.count + 1 == number && upper.count == number;
        if isolated && lower.lambda > 0.0 {
            return (lower, upper);
        }
        // Roots of weak springs lie orders of magnitude lower: quarters reach them, halves not.
        let middle = if lower.lambda == 0.0 {
            0.25 * upper.lambda
        } else {
            0.5 * (lower.lambda + upper.lambda)
        };
        let narrow = upper.lambda - lower.lambda <= 4.0 * f64::EPSILON * upper.lambda;
        if narrow || middle < f64::MIN_POSITIVE.sqrt() {
            return (lower, upper);
        }
        let middle = trial(middle);
        if middle.count < number {
            lower = middle;
        } else {
            upper = middle;
        }
    }
}

/// Brent's method on the frequency equation between two trial values.
fn refine(beam: &RootedBeam, lower: Trial, upper: Trial) -> f64 {
    if lower.value * upper.value > 0.0 || lower.lambda == 0.0 {
        return 0.5 * (lower.lambda + upper.lambda);
    }
    let bracket = [(lower.lambda, lower.value), (upper.lambda, upper.value)];
    brent(|lambda| beam.frequency_equation(lambda), bracket)
}

/// A root between two points (place, value) of opposite sign, to about two units in the last
/// digit: inverse quadratic interpolation where it converges, bisection where it does not
/// (Brent 1973, "Algorithms for Minimization without Derivatives", chapter 4).
fn brent(function: impl Fn(f64) -> f64, bracket: [(f64, f64); 2]) -> f64 {
    // Bisection alone would need 60 steps for the whole range of an f64 mantissa.
    const STEPS: usize = 200;
    let [(mut a, mut fa), (mut b, mut fb)] = bracket;
    let (mut c, mut fc) = (a, fa);
    let mut step = b - a;
    let mut previous_step = step;
    for _ in 0..STEPS {
        if (fb > 0.0) == (fc > 0.0) {
            (c, fc) = (a, fa);
            step = b - a;
            previous_step = step;
        }
        if fc.abs() < fb.abs() {
            (a, b, c) = (b, c, b);
            (fa, fb, fc) = (fb, fc, fb);
        }
        let tolerance = 2.0 * f64::EPSILON * b.abs();
        let half = 0.5 * (c - b);
        if half.abs() <= tolerance || fb == 0.0 {
            break;
        }
        let trial = interpolate([(a, fa), (b, fb), (c, fc)]);
        let accepted = trial.filter(|trial| {
            let inside = *trial * half > 0.0;
            inside && trial.abs() < 1.5 * half.abs() && trial.abs() < 0.5 * previous_step.abs()
        });
        previous_step = if accepted.is_some() { step } else { half };
        step = accepted.unwrap_or(half);
        (a, fa) = (b, fb);
        b += if step.abs() > tolerance {
            step
        } else {
            tolerance.copysign(half)
        };
        fb = function(b);
    }
    b
}

/// Step from the middle point to the root of the secant or the inverse parabola through the
/// points, `None` where there is none.
fn interpolate([(a, fa), (b, fb), (c, fc)]: [(f64, f64); 3]) -> Option<f64> {
    if fa.abs() <= fb.abs() {
        return None;
    }
    let s = fb / fa;
    let (p, q) = if a == c {
        ((c - b) * s, 1.0 - s)
    } else {
        let (q, r) = (fa / fc, fb / fc);
        let p = s * ((c - b) * q * (q - r) - (b - a) * (r - 1.0));
        (p, (q - 1.0) * (r - 1.0) * (s - 1.0))
    };
    let step = -p / q;
    step.is_finite().then_some(step)
}

// The frequency equation of a beam with one free end and a joint at the other.
//
// Substructure synthesis (Ingole & Chatterjee, eq. 10) with the joint's compliance
// delta = `[[a, c], [c, b]]`, a = 1/Kx, b = 1/Ky, c = 1/Kz, and the beam's receptances:
//
// ```text
// (a + eta11)(b + eta22) - (c + eta12)^2 = 0, multiplied by F3:
// (ab - c^2) F3 + a F6/lambda - b F5/lambda^3 - 2c F1/lambda^2 - F4/lambda^4 = 0.
// ```
//
// Multiplied by Kx Ky/((1 + Kx)(1 + Ky)) every coefficient stays between -1 and 1, whatever the
// stiffness, and both limits (no spring, rigid) are ordinary numbers.

/// A beam with its far end free and its near end held by a joint; lengths in units of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootedBeam {
    slenderness: Slenderness,
    /// Stiffness and compliance of the translation, K/(1 + |K|) and 1/(1 + |K|).
    x: Spring,
    /// The same of the rotation.
    y: Spring,
    /// Cross compliance 1/Kz.
    cross: f64,
    /// (ab - c^2), scaled: cx cy - c^2 sx sy.
    product: f64,
}

/// A spring as a pair (stiffness, compliance) of which at most one is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spring {
    stiffness: f64,
    compliance: f64,
}

impl Spring {
    fn new(stiffness: f64) -> Self {
        if stiffness.is_infinite() {
            return Self {
                stiffness: 1.0,
                compliance: 0.0,
            };
        }
        let compliance = 1.0 / (1.0 + stiffness.abs());
        Self {
            stiffness: stiffness * compliance,
            compliance,
        }
    }
}

/// The frequency equation at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// Scaled value of the frequency equation (1); zero at a natural frequency.
    pub value: f64,
    /// Number of natural frequencies below, rigid-body motions and any unstable ones included.
    pub count: usize,
}

impl RootedBeam {
    /// A beam of this slenderness on this joint, whose stiffnesses are in units of the beam's own
    /// length. Any real stiffness is taken, negative and unphysical ones included.
    pub fn new(joint: &JointStiffness, slenderness: Slenderness) -> Self {
        let (x, y) = (Spring::new(joint.kx), Spring::new(joint.ky));
        let cross = joint.cross_compliance;
        let coupled = cross * cross * x.stiffness * y.stiffness;
        Self {
            slenderness,
            x,
            y,
            cross,
            product: x.compliance * y.compliance - coupled,
        }
    }

    /// The scaled frequency equation at `lambda` (1), positive.
    pub fn frequency_equation(&self, lambda: f64) -> f64 {
        self.value(&EndFunctions::new(lambda, &self.slenderness))
    }

    /// The frequency equation and the number of natural frequencies below `lambda` (1), positive.
    pub fn evaluate(&self, lambda: f64) -> Evaluation {
        let ends = EndFunctions::new(lambda, &self.slenderness);
        let value = self.value(&ends);
        Evaluation {
            value,
            count: ends.clamped_free_count() + self.negative_pivots(&ends, value),
        }
    }

    fn value(&self, ends: &EndFunctions) -> f64 {
        let (x, y) = (self.x, self.y);
        let square = ends.lambda * ends.lambda;
        let both = (x.stiffness / square) * (y.stiffness / square);
        self.product * square * square * ends.f3 + x.compliance * y.stiffness * ends.f6
            - x.stiffness * y.compliance * ends.f5
            - 2.0 * self.cross * x.stiffness * y.stiffness * ends.f1
            - both * ends.f4
    }

    /// Negative eigenvalues of the dynamic stiffness at the joint, S + D (Wittrick & Williams
    /// 1971): S is the inverse of the joint's compliance and D that of the beam's receptance,
    /// D11 = -lambda^3 F6/F4, D22 = lambda F5/F4, det(S + D) = -value lambda^4/(product F4) > 0
    /// up to positive factors.
    fn negative_pivots(&self, ends: &EndFunctions, value: f64) -> usize {
        let sign = if self.product < 0.0 { -1.0 } else { 1.0 };
        if (sign * value > 0.0) == (ends.f4 >= 0.0) && value != 0.0 {
            return 1;
        }
        // The determinant is positive, so that both diagonal terms have the same sign.
        let inertia = self.product.abs() * ends.lambda.powi(4) / ends.f4;
        let translation = sign * self.x.stiffness * self.y.compliance - inertia * ends.f6;
        let rotation = sign * self.x.compliance * self.y.stiffness + inertia * ends.f5;
        if translation + rotation < 0.0 { 2 } else { 0 }
    }

    /// How many natural motions do not count: rigid-body motions at zero frequency (one for each
    /// spring of exactly zero stiffness) and the unstable ones of an unphysical joint.
    pub fn uncounted(&self) -> usize {
        let springs = [self.x.stiffness, self.y.stiffness];
        let zero = springs
            .iter()
            .filter(|&&stiffness| stiffness == 0.0)
            .count();
        let unstable = match zero {
            0 => self.unstable(),
            _ => springs.iter().filter(|&&stiffness| stiffness < 0.0).count(),
        };
        zero + unstable
    }

    /// Negative eigenvalues of the joint's stiffness matrix, where neither spring is missing.
    fn unstable(&self) -> usize {
        let sign = if self.product < 0.0 { -1.0 } else { 1.0 };
        if sign * self.x.stiffness * self.y.stiffness < 0.0 {
            1
        } else if sign * (self.x.stiffness + self.y.stiffness) < 0.0 {
            2
        } else {
            0
        }
    }
}
