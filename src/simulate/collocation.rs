//! Exact response of the modes to a moment that is a cubic polynomial over one step.
//!
//! The linear structure is integrated exactly; what is approximated is one scalar, the joint's extra
//! moment u. It is taken as the polynomial through its values at Lobatto's four nodes 0,
//! (1 -+ 1/sqrt 5)/2 and 1, so that the rotation at each node is a number known from the step's
//! beginning plus a fixed matrix times these values, whatever the number of modes. Symmetric nodes
//! keep energy from drifting (Hairer, Lubich & Wanner, Geometric Numerical Integration, chapter V).

use num_complex::Complex64;

use super::reduced::{Oscillator, ReducedStructure};

/// Nodes of the polynomial.
pub(super) const NODES: usize = 4;
/// Where rotations are computed: the nodes after the first, and the middle, where the polynomial is
/// held against the moment.
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
    /// What the moment at each node adds to each mode's state at the end.
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
