//! A structure seen from its joint: the frequency equation of any body on any joint, and the change
//! of each natural frequency with the joint.
//!
//! With the receptance eta of the body without joint and the joint's compliance
//! `[[a, c], [c, b]]` (Ingole & Chatterjee, eq. 10), multiplied by a function P that removes what
//! is infinite in eta:
//!
//! ```text
//! G = (ab - c^2) P + a Y + b X - 2c Z + Q = 0,
//! X = P eta11, Y = P eta22, Z = P eta12, Q = P det eta.
//! ```
//!
//! G is linear in each of the compliances but one square, so that d lambda/da = -(bP + Y)/G' and
//! the like are exact. One beam, two beams joined end to end and finite elements differ in these
//! five functions only.

use super::eigen::pairs_for_forces;
use super::receptance::{EndFunctions, EndSlopes};
use super::specimen::model::{Model, Motion, Place};
use super::specimen::modes::SHIFT;
use super::specimen::{Body, Specimen};
use super::{Beam, BeamTheory, JointStiffness, Slenderness, StructureError};

/// The five functions P, X, Y, Z, Q at one frequency, or their slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// P (1).
    pub p: f64,
    /// X = P eta11 (1).
    pub x: f64,
    /// Y = P eta22 (1).
    pub y: f64,
    /// Z = P eta12 (1), rotation = -dw/dx.
    pub z: f64,
    /// Q = P det eta (1).
    pub q: f64,
}

impl Coefficients {
    /// P = lambda^4 F3 in the scale of [`EndFunctions`]: X = -F5/lambda^3, Y = F6/lambda,
    /// Z = F1/lambda^2, Q = -F4/lambda^4.
    fn rooted(ends: &EndFunctions) -> Self {
        let power = ends.lambda.powi(4);
        Self {
            p: power * ends.f3,
            x: -ends.f5,
            y: ends.f6,
            z: ends.f1,
            q: -ends.f4 / power,
        }
    }

    fn scaled(&self, factor: f64) -> Self {
        Self {
            p: factor * self.p,
            x: factor * self.x,
            y: factor * self.y,
            z: factor * self.z,
            q: factor * self.q,
        }
    }
}

/// The joint's weights of the five functions in the frequency equation.
///
/// Of a stiffness the equation is multiplied by Kx Ky/((1 + |Kx|)(1 + |Ky|)). Then every weight
/// stays between -1 and 1, and both limits (no spring, rigid) are ordinary numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointWeights {
    /// Weight ab - c^2 of P.
    product: f64,
    /// Weight of Y.
    a: f64,
    /// Weight of X.
    b: f64,
    /// Weight of -2 Z.
    c: f64,
    /// Weight of Q.
    one: f64,
    /// Sign of the factor by which the equation is multiplied.
    sign: f64,
    /// Number of springs of exactly zero stiffness, each of which leaves a rigid-body motion.
    missing: usize,
    /// Number of negative eigenvalues of the joint's stiffness: motions that grow.
    unstable: usize,
}

impl From<&JointStiffness> for JointWeights {
    /// Returns the weights of any real stiffness, negative and unphysical ones included.
    fn from(joint: &JointStiffness) -> Self {
        // Stiffness K/(1 + |K|) and compliance 1/(1 + |K|), of which at most one is zero.
        let [(sx, cx), (sy, cy)] = [joint.kx, joint.ky].map(|stiffness| {
            let compliance = 1.0 / (1.0 + stiffness.abs());
            if stiffness.is_infinite() {
                (1.0, 0.0)
            } else {
                (stiffness * compliance, compliance)
            }
        });
        let cross = joint.cross_compliance;
        let product = cx * cy - cross * cross * sx * sy;
        let missing = usize::from(sx == 0.0) + usize::from(sy == 0.0);
        let definite = if product < 0.0 { -1.0 } else { 1.0 };
        let unstable = if missing > 0 {
            usize::from(sx < 0.0) + usize::from(sy < 0.0)
        } else if definite * sx * sy < 0.0 {
            1
        } else if definite * (sx + sy) < 0.0 {
            2
        } else {
            0
        };
        Self {
            product,
            a: cx * sy,
            b: sx * cy,
            c: cross * sx * sy,
            one: sx * sy,
            sign: if (sx < 0.0) == (sy < 0.0) { 1.0 } else { -1.0 },
            missing,
            unstable,
        }
    }
}

impl JointWeights {
    /// Returns the weights of a joint that can exist, from 1/Kx, 1/Ky and 1/Kz (1).
    pub fn from_compliances(compliances: [f64; 3]) -> Self {
        let [a, b, c] = compliances;
        Self {
            product: a * b - c * c,
            a,
            b,
            c,
            one: 1.0,
            sign: 1.0,
            missing: 0,
            unstable: 0,
        }
    }

    /// Returns the number of natural motions that are no modes: rigid-body motions at zero frequency, one for
    /// each spring of exactly zero stiffness, and those that an unphysical joint lets grow.
    pub fn uncounted(&self) -> usize {
        self.missing + self.unstable
    }

    /// G, or with the slopes of the functions its slope.
    fn equation(&self, of: &Coefficients) -> f64 {
        self.product * of.p + self.a * of.y + self.b * of.x - 2.0 * self.c * of.z + self.one * of.q
    }
}

/// The body's functions at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterfaceFunctions {
    /// Non-dimensional frequency lambda (1).
    pub lambda: f64,
    /// P, X, Y, Z, Q.
    pub values: Coefficients,
    /// Their derivatives with lambda.
    pub slopes: Coefficients,
    /// Natural frequencies of the body without joint below lambda, rigid-body motions included.
    pub free_count: usize,
}

impl InterfaceFunctions {
    /// Returns value and slope of the frequency equation with this joint.
    pub fn equation(&self, joint: &JointWeights) -> (f64, f64) {
        (joint.equation(&self.values), joint.equation(&self.slopes))
    }

    /// Returns Newton's step of lambda towards a root: on lambda^4 G, which has no pole at zero frequency
    /// and is nearly linear in omega^2 where the springs are soft.
    pub fn newton_step(&self, value: f64, slope: f64) -> f64 {
        -value / (slope + 4.0 * value / self.lambda)
    }

    /// Returns the number of natural frequencies below lambda with this joint, where its equation has this value (Wittrick
    /// & Williams 1971): those of the free body, less the negative eigenvalues of compliance plus
    /// receptance, and those of the compliance itself.
    pub fn count(&self, joint: &JointWeights, value: f64) -> usize {
        let v = &self.values;
        let negative = if joint.sign * value * v.p < 0.0 {
            1
        } else if joint.sign * (joint.a * v.p + joint.one * v.x) * v.p < 0.0 {
            2
        } else {
            0
        };
        (self.free_count + joint.unstable).saturating_sub(negative)
    }
}

/// A body whose joint is still to be chosen. Frequencies are lambda by a reference beam.
#[derive(Debug, Clone, PartialEq)]
pub enum JointedBody {
    /// A uniform beam with one free end, in closed form; itself the reference.
    Rooted(Slenderness),
    /// Two uniform beams joined end to end, left and right, in closed form.
    Joined([JoinedHalf; 2]),
    /// Finite elements.
    Elements(Box<InterfaceModes>),
}

impl JointedBody {
    /// Returns two equal halves of one beam of this slenderness.
    pub fn halves(slenderness: &Slenderness) -> Self {
        let half = JoinedHalf {
            slenderness: slenderness.of_piece(0.5),
            lambda: 0.5,
            compliance: 0.5,
            length: 0.5,
        };
        Self::Joined([half; 2])
    }

    /// Returns P, X, Y, Z, Q at `lambda` (1), positive.
    pub fn coefficients(&self, lambda: f64) -> Coefficients {
        match self {
            Self::Rooted(slenderness) => {
                Coefficients::rooted(&EndFunctions::new(lambda, slenderness))
            }
            Self::Joined([left, right]) => {
                combined(&left.coefficients(lambda), &right.coefficients(lambda))
            }
            Self::Elements(modes) => modes.functions(lambda).values,
        }
    }

    /// Returns the functions and their slopes at `lambda` (1), positive.
    pub fn functions(&self, lambda: f64) -> InterfaceFunctions {
        match self {
            Self::Rooted(slenderness) => rooted(slenderness, lambda),
            Self::Joined(halves) => {
                let [left, right] = halves.each_ref().map(|half| half.functions(lambda));
                // The receptance of the relative motion is the sum of both.
                let first = combined(&left.slopes, &right.values);
                let second = combined(&left.values, &right.slopes);
                InterfaceFunctions {
                    lambda: left.lambda,
                    values: combined(&left.values, &right.values),
                    slopes: Coefficients {
                        p: first.p + second.p,
                        x: first.x + second.x,
                        y: first.y + second.y,
                        z: first.z + second.z,
                        q: first.q + second.q,
                    },
                    free_count: left.free_count + right.free_count,
                }
            }
            Self::Elements(modes) => modes.functions(lambda),
        }
    }

    /// Natural frequencies below `lambda` (1) on a joint.
    fn count(&self, joint: &JointWeights, lambda: f64) -> usize {
        let at = self.functions(lambda);
        at.count(joint, joint.equation(&at.values))
    }

    /// Returns the number of rigid-body motions that no joint with springs takes away; they are no modes.
    pub fn uncounted(&self) -> usize {
        match self {
            Self::Rooted(_) => 0,
            Self::Joined(_) => 2,
            Self::Elements(modes) => modes.uncounted,
        }
    }

    /// Returns natural frequency number `mode` (from 1) on a joint of compliances 1/Kx, 1/Ky and 1/Kz (1),
    /// looked for from `guess` (1) on. A relative step below `last_step` is the last: [`LAST_STEP`] for
    /// all digits.
    pub fn root(
        &self,
        compliances: [f64; 3],
        mode: usize,
        guess: f64,
        last_step: f64,
    ) -> InterfaceRoot {
        let [a, b, c] = compliances;
        let weights = JointWeights::from_compliances(compliances);
        let number = mode + self.uncounted();
        let (lambda, at) = self.find_root(&weights, number, guess, last_step);
        let (_, slope) = at.equation(&weights);
        let v = &at.values;
        let first = [b * v.p + v.y, -(c * v.p + v.z)];
        let second = [first[1], a * v.p + v.x];
        // d lambda/da = -(dG/da)/G'.
        let by = [first[0], second[1], -2.0 * (c * v.p + v.z)];
        InterfaceRoot {
            lambda,
            by_compliance: by.map(|by| -by / slope),
            // Either row of the adjugate is the load; the larger is the more exact.
            load: if first[0].abs() > second[1].abs() {
                first
            } else {
                second
            },
        }
    }

    /// Returns root number `number` (from 1, uncounted motions included), and the functions beside it.
    ///
    /// Newton's steps on the frequency equation as long as the count of frequencies below agrees with
    /// them, bisection by that count where it does not. No root is missed or taken for another.
    pub(super) fn find_root(
        &self,
        joint: &JointWeights,
        number: usize,
        guess: f64,
        last_step: f64,
    ) -> (f64, InterfaceFunctions) {
        // Bisection alone needs 60 steps from the whole range; doubling upwards a few more.
        const STEPS: usize = 200;
        let (mut lower, mut upper) = (0.0, f64::INFINITY);
        let mut lambda = guess;
        let mut at = self.functions(lambda);
        for _ in 0..STEPS {
            let (value, slope) = at.equation(joint);
            let count = at.count(joint, value);
            if count < number {
                lower = lambda;
            } else {
                upper = lambda;
            }
            let near = count == number || count + 1 == number;
            let newton = lambda + at.newton_step(value, slope);
            let inside = newton > lower && newton < upper;
            let step = (newton - lambda).abs();
            if near && step <= last_step * lambda {
                // On the root itself rounding decides on which side the count is; the neighbouring
                // root would be on the other side.
                let is_ahead = (count == number) == (newton <= lambda);
                if is_ahead || self.count(joint, (1.0 - 1e-7) * newton) + 1 == number {
                    lambda = newton;
                    break;
                }
            }
            lambda = if near && inside && step < 0.2 * lambda {
                newton
            } else if near && inside && 4.0 * step < lambda && newton < lambda {
                // Far above the root of a weak spring: the same step in lambda^4.
                let lower_root = lambda * (1.0 - 4.0 * step / lambda).powf(0.25);
                lower_root.clamp(lower.max(1e-3 * lambda), lambda)
            } else if near && inside && step < 0.5 * lambda && lower > 0.0 {
                newton
            } else if upper.is_infinite() {
                lower + 1.5
            } else if lower == 0.0 {
                // Roots of weak springs lie orders of magnitude lower: quarters reach them.
                0.25 * upper
            } else {
                0.5 * (lower + upper)
            };
            if upper.is_finite() && upper - lower <= 4.0 * f64::EPSILON * upper {
                break;
            }
            at = self.functions(lambda);
        }
        (lambda, at)
    }
}

/// Newton converges quadratically: after a relative step of this size the next is beyond the last
/// digit.
pub const LAST_STEP: f64 = 1e-9;

/// One natural frequency of a body on a joint, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterfaceRoot {
    /// lambda (1).
    pub lambda: f64,
    /// Derivatives of lambda with the compliances a, b and c.
    pub by_compliance: [f64; 3],
    /// Ratio of force to moment at the joint.
    pub load: [f64; 2],
}

/// One of two joined beams, in units of the reference beam: the left beam's properties and the
/// total length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JoinedHalf {
    slenderness: Slenderness,
    /// Its own lambda per reference lambda.
    lambda: f64,
    /// Its own L/(E I) in units of the reference's.
    compliance: f64,
    length: f64,
}

impl JoinedHalf {
    /// A piece of a joined structure `total` (m) long, whose left beam is `reference`.
    pub fn new(theory: BeamTheory, beam: &Beam, reference: &Beam, total: f64) -> Self {
        let length = beam.length / total;
        let stiffness = beam.bending_stiffness() / reference.bending_stiffness();
        let mass = beam.mass_per_length() / reference.mass_per_length();
        Self {
            slenderness: beam.slenderness(theory),
            // lambda^4 = omega^2 rho A L^4/(E I).
            lambda: length * (mass / stiffness).powf(0.25),
            compliance: length / stiffness,
            length,
        }
    }

    fn coefficients(&self, lambda: f64) -> Coefficients {
        let ends = EndFunctions::new(self.lambda * lambda, &self.slenderness);
        self.in_units(&Coefficients::rooted(&ends))
    }

    /// The functions at the reference's lambda.
    fn functions(&self, lambda: f64) -> InterfaceFunctions {
        let own = rooted(&self.slenderness, self.lambda * lambda);
        InterfaceFunctions {
            lambda,
            values: self.in_units(&own.values),
            slopes: self.in_units(&own.slopes).scaled(self.lambda),
            free_count: own.free_count,
        }
    }

    /// Compliances in the reference's units.
    fn in_units(&self, own: &Coefficients) -> Coefficients {
        let (b, l) = (self.compliance, self.length);
        Coefficients {
            p: own.p,
            x: b * l * l * own.x,
            y: b * own.y,
            z: b * l * own.z,
            q: b * b * l * l * own.q,
        }
    }
}

/// The functions of a uniform beam with one free end.
fn rooted(slenderness: &Slenderness, lambda: f64) -> InterfaceFunctions {
    let ends = EndFunctions::new(lambda, slenderness);
    let slopes = EndSlopes::of(&ends, slenderness);
    let power = lambda.powi(4);
    let values = Coefficients::rooted(&ends);
    let rise = 4.0 / lambda;
    // The free beam's count from the clamped one's: released, it gains the negative eigenvalues of
    // its receptance at the end, whose determinant has the sign of -F4/F3.
    let released = if ends.f4 * ends.f3 > 0.0 {
        1
    } else if values.x * values.p < 0.0 {
        2
    } else {
        0
    };
    InterfaceFunctions {
        lambda,
        values,
        slopes: Coefficients {
            p: power * (slopes.f3 + rise * ends.f3),
            x: -slopes.f5,
            y: slopes.f6,
            z: slopes.f1,
            q: (rise * ends.f4 - slopes.f4) / power,
        },
        free_count: ends.clamped_free_count() + released,
    }
}

/// Functions of the sum of two receptances. The left beam is seen in the mirror, which turns the sign
/// of its eta12: Q = P1 Q2 + P2 Q1 + X1 Y2 + X2 Y1 + 2 Z1 Z2.
fn combined(l: &Coefficients, r: &Coefficients) -> Coefficients {
    Coefficients {
        p: l.p * r.p,
        x: l.x * r.p + l.p * r.x,
        y: l.y * r.p + l.p * r.y,
        z: l.p * r.z - l.z * r.p,
        q: l.q * r.p + l.p * r.q + l.x * r.y + l.y * r.x + 2.0 * l.z * r.z,
    }
}

/// All modes of a structure without its joint, by finite elements.
///
/// The joint touches two motions only, so that the finite-element model with any joint has the
/// frequencies at which compliance and receptance of those two motions cancel. The receptance is
/// the sum over the lowest modes of the model without joint, and over motions that stand for all
/// higher ones: nothing is truncated, and one decomposition serves every joint.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceModes {
    /// Squares of the natural frequencies, in units of lambda^4 (1), ascending.
    squares: Vec<f64>,
    /// Motion of every mode at the joint: displacement, and rotation -dw/dx; of a lap joint right
    /// minus left.
    joint: Vec<[f64; 2]>,
    masses: Vec<Attachment>,
    springs: Vec<Attachment>,
    rigid_modes: usize,
    uncounted: usize,
}

/// A mass or spring that is part of the model.
#[derive(Debug, Clone, PartialEq)]
struct Attachment {
    /// In the model's unit of mass or stiffness.
    size: f64,
    /// Displacement of every mode at its place.
    motion: Vec<f64>,
}

impl Attachment {
    fn new(size: f64, place: &Place, modes: &[Motion]) -> Self {
        let motion = modes
            .iter()
            .map(|mode| place.displacement(&mode.ends(place.node)));
        let motion = motion.collect();
        Self { size, motion }
    }
}

impl InterfaceModes {
    /// Modes of a specimen without its joint, each of its beams divided into `elements`, for frequencies up to
    /// those of mode `highest` on any joint.
    ///
    /// # Errors
    /// [`StructureError`] where a part of the specimen cannot exist.
    pub fn new(
        specimen: &Specimen,
        elements: usize,
        highest: usize,
    ) -> Result<Self, StructureError> {
        let free = Specimen {
            joint: None,
            ..specimen.clone()
        };
        let model = Model::new(&free, &vec![elements; free.body.beams().len()])?;
        let (stiffness, mass) = model.matrices();
        // The lowest mode left out then has about four times the highest frequency.
        let count = 2 * highest + 10;
        let forces = [0, 1].map(|component| model.joint_load(component));
        let pairs = pairs_for_forces(
            [&stiffness, &mass],
            SHIFT,
            model.highest_square(),
            &model.locked_motions(),
            count,
            &forces,
        )?;
        let vectors = pairs.vectors.iter();
        let motions: Vec<Motion> = vectors.map(|vector| model.motion(vector)).collect();
        let joint = motions.iter().map(|motion| {
            let [w, theta] = model.joint_motion(motion);
            [w, -theta]
        });
        let masses = model.masses.iter();
        let masses = masses.map(|item| Attachment::new(item.mass, &item.place, &motions));
        let springs = model.springs.iter();
        let springs = springs.map(|item| Attachment::new(item.stiffness, &item.place, &motions));
        Ok(Self {
            squares: pairs.values,
            joint: joint.collect(),
            masses: masses.collect(),
            springs: springs.collect(),
            rigid_modes: model.rigid_motions(),
            uncounted: match specimen.body {
                Body::One(_) => 0,
                Body::Joined(_) => 2,
            },
        })
    }

    /// Squares of lambda of the modes without any joint, rigid-body motions left out: those of the
    /// free beam.
    pub fn free_squares(&self) -> &[f64] {
        &self.squares[self.rigid_modes.min(self.squares.len())..]
    }

    /// Relative change of the n-th free frequency (from 0) per relative change of all attached
    /// masses, and of all support springs.
    pub fn free_attachment_sensitivity(&self, mode: usize) -> [f64; 2] {
        let index = mode + self.rigid_modes;
        // d(omega^2)/dm = -omega^2 psi^2 and d(omega^2)/dk = psi^2 for unit modal mass.
        let [masses, springs] = [&self.masses, &self.springs].map(|list| -> f64 {
            let list = list.iter();
            list.map(|item| item.size * item.motion[index].powi(2))
                .sum()
        });
        [-0.5 * masses, 0.5 * springs / self.squares[index]]
    }

    /// Relative change of the frequency of a mode at `lambda` (1) on a joint, per relative change of
    /// all attached masses, and of all support springs. Force and moment of the joint are in the
    /// ratio `load`: the mode's shape is the sum of phi (phi . load)/(omega_i^2 - omega^2).
    pub fn attachment_sensitivity(&self, lambda: f64, load: [f64; 2]) -> [f64; 2] {
        if self.masses.is_empty() && self.springs.is_empty() {
            return [0.0; 2];
        }
        let square = lambda.powi(4);
        let free = self.squares.iter().zip(&self.joint);
        let weights: Vec<f64> = free
            .map(|(free, phi)| (phi[0] * load[0] + phi[1] * load[1]) / (free - square))
            .collect();
        let modal_mass: f64 = weights.iter().map(|weight| weight * weight).sum();
        let [masses, springs] = [&self.masses, &self.springs].map(|list| {
            let energies = list.iter().map(|item| {
                let psi: f64 = item.motion.iter().zip(&weights).map(|(m, w)| m * w).sum();
                item.size * psi.powi(2)
            });
            energies.fold(0.0, |sum, energy| sum + energy) / modal_mass
        });
        [-0.5 * masses, 0.5 * springs / square]
    }

    /// The functions of the frequency equation, multiplied by the distance to the nearest
    /// frequency without joint, where each of them would be infinite.
    ///
    /// With d = distance, that frequency's motion (w, t) at the joint and the rest of the receptance
    /// eta: P = d, X = d eta11 + w^2 and likewise, Q = d det(eta) + w^2 eta22 + t^2 eta11
    /// - 2 w t eta12. Their slopes are those with omega^2, which lowers d.
    fn functions(&self, lambda: f64) -> InterfaceFunctions {
        let square = lambda.powi(4);
        let below = self.squares.partition_point(|free| *free < square);
        let last = self.squares.len() - 1;
        let (low, high) = (below.saturating_sub(1).min(last), below.min(last));
        let low_is_nearer =
            (self.squares[low] - square).abs() < (self.squares[high] - square).abs();
        let nearest = if low_is_nearer { low } else { high };
        let (mut eta, mut slope) = ([0.0; 3], [0.0; 3]);
        for (index, (free, [w, t])) in self.squares.iter().zip(&self.joint).enumerate() {
            if index != nearest {
                let inverse = 1.0 / (free - square);
                let terms = [w * w, w * t, t * t].map(|term| term * inverse);
                for i in 0..3 {
                    eta[i] += terms[i];
                    slope[i] += terms[i] * inverse;
                }
            }
        }
        let d = self.squares[nearest] - square;
        let [w, t] = self.joint[nearest];
        let [a, c, b] = eta;
        let [a_slope, c_slope, b_slope] = slope;
        let determinant = a * b - c * c;
        let determinant_slope = a_slope * b + a * b_slope - 2.0 * c * c_slope;
        let mixed = w * w * b + t * t * a - 2.0 * w * t * c;
        let mixed_slope = w * w * b_slope + t * t * a_slope - 2.0 * w * t * c_slope;
        let slopes = Coefficients {
            p: -1.0,
            x: d * a_slope - a,
            y: d * b_slope - b,
            z: d * c_slope - c,
            q: d * determinant_slope - determinant + mixed_slope,
        };
        InterfaceFunctions {
            lambda,
            values: Coefficients {
                p: d,
                x: d * a + w * w,
                y: d * b + t * t,
                z: d * c + w * t,
                q: d * determinant + mixed,
            },
            slopes: slopes.scaled(4.0 * lambda.powi(3)),
            free_count: below,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Assembly;
    use crate::specimen::{LapLayout, PointMass};
    use std::f64::consts::PI;

    fn specimen(assembly: Assembly) -> Specimen {
        let beam = Beam {
            length: 0.423,
            width: 0.05,
            thickness: 0.005,
            modulus: 207e9,
            density: 7850.0,
            poisson: 0.3,
        };
        let layout = LapLayout::default();
        let mut specimen =
            Specimen::jointed(BeamTheory::Timoshenko, &beam, assembly, &layout, None);
        if assembly == Assembly::Cantilever {
            specimen.masses.push(PointMass::new(0.2, 0.02));
        }
        specimen
    }

    #[test]
    fn prop_few_motions_stand_for_all_modes() {
        // A lap joint of equal halves has every frequency twice without its joint.
        for assembly in [Assembly::Cantilever, Assembly::Lap] {
            let specimen = specimen(assembly);
            let [few, all] =
                [20, 1000].map(|highest| InterfaceModes::new(&specimen, 100, highest).unwrap());
            assert_eq!(few.squares.len(), 2 * 20 + 10 + 8);
            assert!(all.squares.len() > 200);
            let [few, all] = [few, all].map(|modes| JointedBody::Elements(Box::new(modes)));
            for compliances in [[1e-3, 1e-2, 0.0], [0.0, 0.1, 0.0], [10.0, 1e-6, 0.0]] {
                for mode in 1..=20 {
                    let guess = PI * mode as f64;
                    let [found, exact] =
                        [&few, &all].map(|body| body.root(compliances, mode, guess, LAST_STEP));
                    let off = found.lambda / exact.lambda - 1.0;
                    // What is left out, and the rounding of the dense matrix, are less than 1e-9.
                    assert!(
                        off.abs() < 1e-9,
                        "{assembly:?} {compliances:?} {mode}: {off:e}"
                    );
                }
            }
        }
    }

    #[test]
    fn limit_a_hundred_modes_need_no_dense_matrix() {
        let modes = InterfaceModes::new(&specimen(Assembly::Cantilever), 500, 100).unwrap();
        assert_eq!(modes.squares.len(), 2 * 100 + 10 + 8);
    }
}
