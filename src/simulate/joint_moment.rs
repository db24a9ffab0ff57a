//! The moment of a non-linear joint, as an addition to a linear spring, and the exact response of the modes
//! to a moment that is a cubic polynomial over one step.
//!
//! The linear structure is integrated exactly; what is approximated is one scalar, the joint's extra
//! moment u. It is taken as the polynomial through its values at Lobatto's four nodes 0,
//! (1 -+ 1/sqrt 5)/2 and 1, so that the rotation at each node is a number known from the step's
//! beginning plus a fixed matrix times these values, whatever the number of modes. Symmetric nodes
//! keep energy from drifting (Hairer, Lubich & Wanner, Geometric Numerical Integration, chapter V).

use super::observed_structure::{Oscillator, ReducedStructure};
use num_complex::Complex64;
use tapjoint_beam::effects::{JointLaw, JointLawKind};

/// Number of sliders that stand for a continuous distribution: kinks are then a fortieth of the whole.
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

/// Moment beyond that of the linear spring, at one rotation.
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
    /// Returns the moment of a law, with the stiffness at rest (N m/rad) and the rotation (rad) that the hardest
    /// tap brings.
    pub fn of_law(law: &JointLaw, stiffness: f64, hardest: f64) -> Self {
        let coefficient = law.coefficient(hardest);
        match law.kind() {
            JointLawKind::Elastic => Self::elastic(stiffness, coefficient, law.exponent),
            JointLawKind::MicroSlip => Self::MicroSlip {
                stiffness,
                sliders: sliders(law, stiffness, hardest, coefficient),
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

    /// Number of positions of sliders that it remembers.
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
                    slider.follow(rotation, from, to, &mut extra);
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
fn sliders(law: &JointLaw, stiffness: f64, hardest: f64, c: f64) -> Vec<Slider> {
    let p = law.exponent;
    // The slope 1 + c (p + 1) theta^p vanishes where everything slips.
    let all_slip = (-1.0 / (c * (p + 1.0))).powf(p.recip());
    let last = all_slip.min(BEYOND_HARDEST * hardest);
    // Between two rotations that stiffness slips by which the slope falls. Closer together near zero,
    // because a ring-down ends there.
    let edges: Vec<f64> = (0..=SLIDERS)
        .map(|n| last * (n as f64 / SLIDERS as f64).powi(2))
        .collect();
    edges
        .windows(2)
        .map(|edges| {
            let (low, high) = (edges[0], edges[1]);
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
    fn follow(&self, rotation: f64, from: f64, to: &mut f64, extra: &mut Extra) {
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

/// Nodes of the polynomial.
pub(super) const NODES: usize = 4;
/// Number of places at which rotations are computed: the nodes after the first, and the middle, where the
/// polynomial is held against the moment.
pub(super) const PLACES: usize = 4;
/// The place that is the middle of the step.
pub(super) const MIDDLE: usize = 3;

/// The nodes, as parts of the step.
pub(super) fn nodes() -> [f64; NODES] {
    let offset = 0.5 / 5f64.sqrt();
    [0.0, 0.5 - offset, 0.5 + offset, 1.0]
}

/// The places, as parts of the step.
pub(super) fn places() -> [f64; PLACES] {
    let [_, first, second, end] = nodes();
    [first, second, end, 0.5]
}

/// All that a step of one length needs.
#[derive(Debug, Clone)]
pub(super) struct Collocation {
    /// Length of the step (s).
    pub(super) step: f64,
    /// Rotation at each place by the states at the step's beginning: factors of their real and
    /// imaginary parts, mode by mode.
    pub(super) rotation: [Vec<[f64; 2]>; PLACES],
    /// Rotation at each place by the moment at each node.
    pub(super) influence: [[f64; NODES]; PLACES],
    /// Free motion of each mode over the step.
    pub(super) advance: Vec<Complex64>,
    /// Addition to each mode's state at the end by the moment at each node.
    pub(super) drive: Vec<[Complex64; NODES]>,
}

impl Collocation {
    pub(super) fn new(structure: &ReducedStructure, oscillators: &[Oscillator], step: f64) -> Self {
        let mut this = Self {
            step,
            rotation: Default::default(),
            influence: [[0.0; NODES]; PLACES],
            advance: Vec::new(),
            drive: Vec::new(),
        };
        let basis = lagrange_coefficients();
        for (mode, oscillator) in structure.modes.iter().zip(oscillators) {
            let pole = oscillator.pole;
            // Rotation = shape q = shape Im z/omega_d.
            let seen = mode.at_joint / pole.im;
            for (place, part) in places().into_iter().enumerate() {
                let free = (pole * part * step).exp();
                this.rotation[place].push([seen * free.im, seen * free.re]);
                let weights = weights(pole * step, part, &basis);
                for (influence, weight) in this.influence[place].iter_mut().zip(weights) {
                    *influence += seen * mode.at_joint * step * weight.im;
                }
            }
            this.advance.push((pole * step).exp());
            let end = weights(pole * step, 1.0, &basis);
            this.drive
                .push(end.map(|weight| mode.at_joint * step * weight));
        }
        // The modes left out follow at once.
        for (place, node) in [(0, 1), (1, 2), (2, 3)] {
            this.influence[place][node] += structure.joint_compliance;
        }
        let middle = at_middle();
        for (influence, value) in this.influence[MIDDLE].iter_mut().zip(middle) {
            *influence += structure.joint_compliance * value;
        }
        this
    }
}

/// The polynomial's value in the middle, as factors of its values at the nodes.
pub(super) fn at_middle() -> [f64; NODES] {
    lagrange_coefficients().map(|c| c[0] + 0.5 * (c[1] + 0.5 * (c[2] + 0.5 * c[3])))
}

/// First and second derivative of the polynomial at the step's end, in units of 1/step and 1/step^2.
pub(super) fn derivatives_at_end() -> [[f64; NODES]; 2] {
    let basis = lagrange_coefficients();
    [
        basis.map(|c| c[1] + 2.0 * c[2] + 3.0 * c[3]),
        basis.map(|c| 2.0 * c[2] + 6.0 * c[3]),
    ]
}

/// Coefficients (of 1, x, x^2, x^3) of the polynomials that are 1 at one node and 0 at the others.
fn lagrange_coefficients() -> [[f64; NODES]; NODES] {
    let nodes = nodes();
    std::array::from_fn(|j| {
        let mut coefficients = [1.0, 0.0, 0.0, 0.0];
        for (_, &node) in nodes.iter().enumerate().filter(|(m, _)| *m != j) {
            let scale = 1.0 / (nodes[j] - node);
            let old = coefficients;
            coefficients = std::array::from_fn(|power| {
                let lower = if power > 0 { old[power - 1] } else { 0.0 };
                scale * (lower - node * old[power])
            });
        }
        coefficients
    })
}

/// Integrals over x from 0 to `part` of e^{z (part - x)} times each of the basis polynomials.
fn weights(z: Complex64, part: f64, basis: &[[f64; NODES]; NODES]) -> [Complex64; NODES] {
    // The integral of e^{z (c - x)} x^m is m! c^{m+1} phi_{m+1}(c z).
    let phi = phi_functions(z * part);
    let factorials = [1.0, 1.0, 2.0, 6.0];
    let powers: [Complex64; NODES] =
        std::array::from_fn(|m| factorials[m] * part.powi(m as i32 + 1) * phi[m]);
    basis.map(|coefficients| {
        coefficients
            .iter()
            .zip(powers)
            .map(|(coefficient, power)| *coefficient * power)
            .sum()
    })
}

/// phi_1 to phi_4 (Hochbruck & Ostermann 2010): phi_0 = e^z, phi_{k+1} = (phi_k - 1/k!)/z.
fn phi_functions(z: Complex64) -> [Complex64; NODES] {
    let factorials = [1.0, 1.0, 2.0, 6.0, 24.0];
    if z.norm_sqr() > 1.0 {
        let mut phi = z.exp();
        return std::array::from_fn(|k| {
            phi = (phi - 1.0 / factorials[k]) / z;
            phi
        });
    }
    // phi_k = sum z^n/(n + k)!: within the unit circle 18 terms reach the last digit.
    std::array::from_fn(|k| {
        let mut term = Complex64::from(1.0 / factorials[k + 1]);
        let mut sum = term;
        for n in 1..18 {
            term *= z / (n + k + 1) as f64;
            sum += term;
        }
        sum
    })
}
