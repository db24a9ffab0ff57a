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
//! five functions only. A joint whose springs also resist curling across the width has a third spring, in a fixed
//! proportion to Kx. It brings five functions more ([`AcrossFunctions`]).

pub use super::modal_interface::InterfaceModes;
use super::receptance::{EndFunctions, EndSlopes};
use super::{Beam, BeamTheory, JointStiffness, Slenderness};

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

    /// Returns `weight` self + `other_weight` other.
    fn plus(&self, weight: f64, other_weight: f64, other: &Self) -> Self {
        Self {
            p: weight * self.p + other_weight * other.p,
            x: weight * self.x + other_weight * other.x,
            y: weight * self.y + other_weight * other.y,
            z: weight * self.z + other_weight * other.z,
            q: weight * self.q + other_weight * other.q,
        }
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            p: factor * self.p,
            x: factor * self.x,
            y: factor * self.y,
            z: factor * self.z,
            q: factor * self.q,
        }
    }
}

impl From<[f64; 5]> for Coefficients {
    /// P, X, Y, Z, Q in this order.
    fn from([p, x, y, z, q]: [f64; 5]) -> Self {
        Self { p, x, y, z, q }
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
    /// Translational compliance and stiffness 1/Kx and 1, by one factor that keeps both finite.
    translation: [f64; 2],
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
            translation: [cx, sx],
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
            translation: [a, 1.0],
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
    /// The same functions where the joint's end cannot curl across the width; `None` where no joint resists that.
    pub across: Option<AcrossFunctions>,
}

/// The functions of a body whose end cannot curl across the width.
///
/// A joint whose springs are spread over the width resists curling by the stiffness `ratio` Kx. With this third
/// spring every function is F + ratio Kx F', F' the one here; both are multiplied by 1/Kx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AcrossFunctions {
    /// Stiffness against curling over Kx (1).
    pub ratio: f64,
    /// P, X, Y, Z, Q.
    pub values: Coefficients,
    /// Their derivatives with lambda.
    pub slopes: Coefficients,
}

impl InterfaceFunctions {
    /// Returns value and slope of the frequency equation with this joint.
    pub fn equation(&self, joint: &JointWeights) -> (f64, f64) {
        let at = self.with_springs(joint);
        (joint.equation(&at.values), joint.equation(&at.slopes))
    }

    /// Returns the functions of the body with the joint's resistance to curling as a part of it.
    fn with_springs(&self, joint: &JointWeights) -> Self {
        let Some(across) = &self.across else {
            return *self;
        };
        let [compliance, stiffness] = joint.translation;
        let size = compliance + across.ratio * stiffness;
        let (free, held) = (compliance / size, across.ratio * stiffness / size);
        let values = self.values.plus(free, held, &across.values);
        // A spring more: the body has one frequency less below where receptance and compliance together are negative.
        let fewer = usize::from(values.p * self.values.p < 0.0);
        Self {
            lambda: self.lambda,
            values,
            slopes: self.slopes.plus(free, held, &across.slopes),
            free_count: self.free_count.saturating_sub(fewer),
            across: None,
        }
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
        let at = self.with_springs(joint);
        let v = &at.values;
        let negative = if joint.sign * value * v.p < 0.0 {
            1
        } else if joint.sign * (joint.a * v.p + joint.one * v.x) * v.p < 0.0 {
            2
        } else {
            0
        };
        (at.free_count + joint.unstable).saturating_sub(negative)
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
                    across: None,
                }
            }
            Self::Elements(modes) => modes.functions(lambda),
        }
    }

    /// Natural frequencies below `lambda` (1) on a joint.
    fn count(&self, joint: &JointWeights, lambda: f64) -> usize {
        let at = self.functions(lambda);
        at.count(joint, at.equation(joint).0)
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
        let sprung = at.with_springs(&weights);
        let slope = weights.equation(&sprung.slopes);
        let v = &sprung.values;
        let first = [b * v.p + v.y, -(c * v.p + v.z)];
        let second = [first[1], a * v.p + v.x];
        // The resistance to curling changes with a, too.
        let curling = at.across.as_ref().map_or(0.0, |across| {
            weights.equation(&at.values) / (a + across.ratio)
        });
        // d lambda/da = -(dG/da)/G'.
        let by = [first[0] + curling, second[1], -2.0 * (c * v.p + v.z)];
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
            across: None,
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
        across: None,
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
