//! A structure seen from its joint: the frequency equation of any body on any joint, and how each
//! natural frequency changes with the joint.
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

use super::Slenderness;
use super::receptance::{EndFunctions, EndSlopes};
use crate::banded::all_modes;
use crate::finite_elements::{FiniteElementModel, Place};
use crate::{Assembly, Beam, BeamTheory, JointStiffness, StructureError};

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
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            p: factor * self.p,
            x: factor * self.x,
            y: factor * self.y,
            z: factor * self.z,
            q: factor * self.q,
        }
    }

    /// G = (ab - c^2) P + a Y + b X - 2c Z + Q.
    fn equation(&self, joint: &JointCompliance) -> f64 {
        let JointCompliance { a, b, c } = *joint;
        (a * b - c * c) * self.p + a * self.y + b * self.x - 2.0 * c * self.z + self.q
    }
}

/// Compliance of a joint in units of L^3/(E I), L/(E I), L^2/(E I).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointCompliance {
    /// 1/Kx (1).
    pub a: f64,
    /// 1/Ky (1).
    pub b: f64,
    /// 1/Kz (1).
    pub c: f64,
}

/// The body's functions at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterfaceFunctions {
    /// Where (1).
    pub lambda: f64,
    /// P, X, Y, Z, Q.
    pub values: Coefficients,
    /// Their derivatives with lambda.
    pub slopes: Coefficients,
    /// Natural frequencies of the body without joint below lambda, rigid-body motions included.
    pub free_count: usize,
}

impl InterfaceFunctions {
    /// Value and slope of the frequency equation with this joint.
    pub fn equation(&self, joint: &JointCompliance) -> (f64, f64) {
        (self.values.equation(joint), self.slopes.equation(joint))
    }

    /// Newton's step of lambda towards a root: on lambda^4 G, which has no pole at zero frequency
    /// and is nearly linear in omega^2 where the springs are soft.
    pub fn newton_step(&self, (value, slope): (f64, f64)) -> f64 {
        -value / (slope + 4.0 * value / self.lambda)
    }

    /// Natural frequencies below lambda with this joint (Wittrick & Williams 1971): those of the
    /// free body, less the negative eigenvalues of compliance plus receptance.
    pub fn count(&self, joint: &JointCompliance, value: f64) -> usize {
        let v = &self.values;
        let negative = if value * v.p < 0.0 {
            1
        } else if (joint.a * v.p + v.x) * v.p < 0.0 {
            2
        } else {
            0
        };
        self.free_count.saturating_sub(negative)
    }

    /// Derivatives of the frequency equation with a, b and c.
    fn by_compliance(&self, joint: &JointCompliance) -> [f64; 3] {
        let v = &self.values;
        [
            joint.b * v.p + v.y,
            joint.a * v.p + v.x,
            -2.0 * (joint.c * v.p + v.z),
        ]
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

/// One of two joined beams, in units of the reference beam: the left beam's properties and the
/// total length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JoinedHalf {
    slenderness: Slenderness,
    /// Its own lambda per reference lambda.
    lambda: f64,
    /// Its own L/(E I) in units of the reference's, and its length.
    compliance: f64,
    length: f64,
}

impl JoinedHalf {
    /// A piece of a joined structure `total` (m) long, whose left beam is `reference`.
    pub fn new(theory: BeamTheory, beam: &Beam, (reference, total): (&Beam, f64)) -> Self {
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

    /// Its functions at the reference's lambda, with compliances in the reference's units.
    fn functions(&self, lambda: f64) -> InterfaceFunctions {
        let own = rooted(&self.slenderness, self.lambda * lambda);
        let (b, l) = (self.compliance, self.length);
        let in_units = |own: &Coefficients| Coefficients {
            p: own.p,
            x: b * l * l * own.x,
            y: b * own.y,
            z: b * l * own.z,
            q: b * b * l * l * own.q,
        };
        InterfaceFunctions {
            lambda,
            values: in_units(&own.values),
            slopes: in_units(&own.slopes).scaled(self.lambda),
            free_count: own.free_count,
        }
    }
}

impl JointedBody {
    /// The functions at `lambda` (1), positive.
    pub fn functions(&self, lambda: f64) -> InterfaceFunctions {
        match self {
            Self::Rooted(slenderness) => rooted(slenderness, lambda),
            Self::Joined([left, right]) => {
                joined(&left.functions(lambda), &right.functions(lambda))
            }
            Self::Elements(modes) => modes.functions(lambda),
        }
    }

    /// Rigid-body motions that no joint with springs takes away; they are no modes.
    pub fn uncounted(&self) -> usize {
        match self {
            Self::Rooted(_) => 0,
            Self::Joined(_) => 2,
            Self::Elements(modes) => modes.uncounted(),
        }
    }
}

/// P = lambda^4 F3 in the scale of [`EndFunctions`]: X = -F5/lambda^3, Y = F6/lambda,
/// Z = F1/lambda^2, Q = -F4/lambda^4.
fn rooted(slenderness: &Slenderness, lambda: f64) -> InterfaceFunctions {
    let ends = EndFunctions::new(lambda, slenderness);
    let slopes = EndSlopes::of(&ends, slenderness);
    let power = lambda.powi(4);
    let values = Coefficients {
        p: power * ends.f3,
        x: -ends.f5,
        y: ends.f6,
        z: ends.f1,
        q: -ends.f4 / power,
    };
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

/// Receptance of the relative motion: the sum of both, the left beam seen in the mirror, which
/// turns the sign of its eta12. Q = P1 Q2 + P2 Q1 + X1 Y2 + X2 Y1 + 2 Z1 Z2.
fn joined(left: &InterfaceFunctions, right: &InterfaceFunctions) -> InterfaceFunctions {
    let mix = |l: &Coefficients, r: &Coefficients| Coefficients {
        p: l.p * r.p,
        x: l.x * r.p + l.p * r.x,
        y: l.y * r.p + l.p * r.y,
        z: l.p * r.z - l.z * r.p,
        q: l.q * r.p + l.p * r.q + l.x * r.y + l.y * r.x + 2.0 * l.z * r.z,
    };
    let (first, second) = (
        mix(&left.slopes, &right.values),
        mix(&left.values, &right.slopes),
    );
    InterfaceFunctions {
        lambda: left.lambda,
        values: mix(&left.values, &right.values),
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

/// Natural frequency number `mode` (from 1) of a body on a joint, looked for from `guess` (1) on:
/// Newton's steps on the frequency equation as long as the count of frequencies below agrees with
/// them, bisection by that count where it does not. No root is missed or taken for another. A relative
/// step below `last_step` is the last: [`LAST_STEP`] for all digits.
pub fn interface_root(
    body: &JointedBody,
    joint: &JointCompliance,
    mode: usize,
    (guess, last_step): (f64, f64),
) -> InterfaceRoot {
    // Bisection alone needs 60 steps from the whole range; doubling upwards a few more.
    const STEPS: usize = 200;
    let number = mode + body.uncounted();
    let (mut lower, mut upper) = (0.0, f64::INFINITY);
    let mut lambda = guess;
    let mut at = body.functions(lambda);
    for _ in 0..STEPS {
        let (value, slope) = at.equation(joint);
        let count = at.count(joint, value);
        if count < number {
            lower = lambda;
        } else {
            upper = lambda;
        }
        let near = count == number || count + 1 == number;
        let newton = lambda + at.newton_step((value, slope));
        let inside = newton > lower && newton < upper;
        // On the root itself rounding decides on which side the count is.
        let step = (newton - lambda).abs();
        if near && step <= last_step * lambda {
            lambda = newton;
            break;
        }
        lambda = if near && inside && step < 0.5 * lambda {
            newton
        } else if upper.is_finite() {
            0.5 * (lower + upper)
        } else {
            lower + 1.5
        };
        if upper.is_finite() && upper - lower <= 4.0 * f64::EPSILON * upper {
            break;
        }
        at = body.functions(lambda);
    }
    root_at(&at, joint, lambda)
}

/// d lambda/da = -(dG/da)/G', at a root.
fn root_at(at: &InterfaceFunctions, joint: &JointCompliance, lambda: f64) -> InterfaceRoot {
    let (_, slope) = at.equation(joint);
    let by = at.by_compliance(joint);
    let v = &at.values;
    let first = [joint.b * v.p + v.y, -(joint.c * v.p + v.z)];
    let second = [first[1], joint.a * v.p + v.x];
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

// All modes of the structure without its joint, and what they say of any joint put in.
//
// The joint touches two motions only, so that the finite-element model with any joint has the
// frequencies at which compliance and receptance of those two motions cancel. The receptance is
// the sum over all modes of the model without joint: nothing is truncated, and one decomposition
// serves every joint.

/// The modes of a finite-element model whose joint has been taken out.
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

/// A mass (kg) or support spring (N/m) at a position (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointAttachment {
    /// Where it is (m), from the joint or the left end.
    pub position: f64,
    /// Mass (kg) or stiffness (N/m).
    pub size: f64,
}

impl InterfaceModes {
    /// Of a beam (`halves` = one beam, or the two beams of a lap joint) with masses and support
    /// springs; each beam divided into `elements`.
    ///
    /// # Errors
    /// [`StructureError`] where a beam or an attachment cannot exist.
    pub fn new(
        theory: BeamTheory,
        halves: &[Beam],
        (masses, springs): (&[PointAttachment], &[PointAttachment]),
        elements: usize,
    ) -> Result<Self, StructureError> {
        let free = &JointStiffness::FREE;
        let (mut model, uncounted) = match halves {
            [left, right] => (
                FiniteElementModel::lap(theory, [left, right], free, elements)?,
                2,
            ),
            [beam] => {
                let assembly = Assembly::Cantilever;
                let model = FiniteElementModel::new(theory, beam, assembly, free, elements)?;
                (model, 0)
            }
            _ => {
                return Err(StructureError::FiniteElements {
                    reason: format!("it needs one beam or two, not {}", halves.len()),
                });
            }
        };
        for mass in masses {
            model = model.with_point_mass(mass.position, mass.size)?;
        }
        for spring in springs {
            model = model.with_support_spring(spring.position, spring.size)?;
        }
        model.interface_modes((masses, springs), uncounted)
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
        let square = self.squares[index];
        // d(omega^2)/dm = -omega^2 psi^2 and d(omega^2)/dk = psi^2 for unit modal mass.
        let energy = |list: &[Attachment]| -> f64 {
            list.iter()
                .map(|item| item.size * item.motion[index].powi(2))
                .sum()
        };
        [
            -0.5 * energy(&self.masses),
            0.5 * energy(&self.springs) / square,
        ]
    }

    /// The same of a mode at `lambda` (1) with a joint, whose force and moment are in the ratio
    /// `load`: the mode's shape is the sum of phi (phi . load)/(omega_i^2 - omega^2).
    pub fn attachment_sensitivity(&self, lambda: f64, load: [f64; 2]) -> [f64; 2] {
        if self.masses.is_empty() && self.springs.is_empty() {
            return [0.0; 2];
        }
        let square = lambda.powi(4);
        let weights: Vec<f64> = self
            .squares
            .iter()
            .zip(&self.joint)
            .map(|(free, phi)| (phi[0] * load[0] + phi[1] * load[1]) / (free - square))
            .collect();
        let modal_mass: f64 = weights.iter().map(|weight| weight * weight).sum();
        let energy = |list: &[Attachment]| -> f64 {
            let psi = |item: &Attachment| -> f64 {
                item.motion.iter().zip(&weights).map(|(m, w)| m * w).sum()
            };
            let sum: f64 = list.iter().map(|item| item.size * psi(item).powi(2)).sum();
            sum / modal_mass
        };
        [
            -0.5 * energy(&self.masses),
            0.5 * energy(&self.springs) / square,
        ]
    }

    pub(crate) fn uncounted(&self) -> usize {
        self.uncounted
    }

    /// The functions of the frequency equation, multiplied by the distance to the nearest
    /// frequency without joint, where each of them would be infinite.
    pub(crate) fn functions(&self, lambda: f64) -> InterfaceFunctions {
        let square = lambda.powi(4);
        let below = self.squares.partition_point(|free| *free < square);
        let nearest = self.nearest(below, square);
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
        let distance = self.squares[nearest] - square;
        let (values, slopes) = without_pole(&eta, &slope, (distance, self.joint[nearest]));
        InterfaceFunctions {
            lambda,
            values,
            slopes: slopes.scaled(4.0 * lambda.powi(3)),
            free_count: below,
        }
    }

    fn nearest(&self, below: usize, square: f64) -> usize {
        let last = self.squares.len() - 1;
        let (low, high) = (below.saturating_sub(1).min(last), below.min(last));
        if (self.squares[low] - square).abs() < (self.squares[high] - square).abs() {
            low
        } else {
            high
        }
    }
}

/// With d = distance and the rest of the receptance eta: P = d, X = d eta11 + w^2 and likewise,
/// Q = d det(eta) + w^2 eta22 + t^2 eta11 - 2 w t eta12; and their slopes with omega^2, which
/// lowers d.
fn without_pole(
    eta: &[f64; 3],
    slope: &[f64; 3],
    (distance, [w, t]): (f64, [f64; 2]),
) -> (Coefficients, Coefficients) {
    let [a, c, b] = *eta;
    let [a_slope, c_slope, b_slope] = *slope;
    let determinant = a * b - c * c;
    let determinant_slope = a_slope * b + a * b_slope - 2.0 * c * c_slope;
    let mixed = |a: f64, c: f64, b: f64| w * w * b + t * t * a - 2.0 * w * t * c;
    let values = Coefficients {
        p: distance,
        x: distance * a + w * w,
        y: distance * b + t * t,
        z: distance * c + w * t,
        q: distance * determinant + mixed(a, c, b),
    };
    let slopes = Coefficients {
        p: -1.0,
        x: distance * a_slope - a,
        y: distance * b_slope - b,
        z: distance * c_slope - c,
        q: distance * determinant_slope - determinant + mixed(a_slope, c_slope, b_slope),
    };
    (values, slopes)
}

impl FiniteElementModel {
    fn interface_modes(
        &self,
        (masses, springs): (&[PointAttachment], &[PointAttachment]),
        uncounted: usize,
    ) -> Result<InterfaceModes, StructureError> {
        // As for the lowest frequencies: about the first elastic eigenvalue of a free beam.
        const SHIFT: f64 = 500.0;
        let stiffness = self.stiffness.plus(SHIFT, &self.mass);
        let (squares, vectors) = all_modes(&stiffness, &self.mass, SHIFT)?;
        let motion = |place: &Place| -> Vec<f64> {
            let at = |mode: usize| {
                let terms = place.equations.iter().zip(place.shape);
                terms
                    .map(|(row, weight)| row.map_or(0.0, |row| weight * vectors[(row, mode)]))
                    .sum()
            };
            (0..squares.len()).map(at).collect()
        };
        let attach = |list: &[PointAttachment], unit: f64| {
            let attached = list.iter().map(|item| {
                Ok(Attachment {
                    size: item.size / unit,
                    motion: motion(&self.place(item.position)?),
                })
            });
            attached.collect::<Result<Vec<_>, StructureError>>()
        };
        let joint = |mode: usize| {
            let node = |node: usize| {
                let at = |row: Option<usize>| row.map_or(0.0, |row| vectors[(row, mode)]);
                self.equations[node].map(at)
            };
            let Some(second) = self.pieces.get(1) else {
                let [w, theta] = node(0);
                return [w, -theta];
            };
            let (right, left) = (node(second.first_node), node(second.first_node - 1));
            [right[0] - left[0], left[1] - right[1]]
        };
        Ok(InterfaceModes {
            joint: (0..squares.len()).map(joint).collect(),
            masses: attach(masses, self.units.mass)?,
            springs: attach(springs, self.units.mass * self.units.omega.powi(2))?,
            rigid_modes: self.rigid_modes,
            uncounted,
            squares,
        })
    }
}
