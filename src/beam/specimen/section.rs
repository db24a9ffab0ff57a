//! One beam element of a specimen: its matrices, its shape, and what the shape misses.
//!
//! Between its nodes an element takes its static shape under end loads. Inertia loads it inside as
//! well, and bends it a little further; that motion has no load on the nodes, and to second order
//! in omega^2 it adds `omega^4 v^T S v` to the mass term, with S = [`Section::second_order`]: the
//! leading term of the exact dynamic stiffness (Przemieniecki, "Theory of Matrix Structural
//! Analysis", 10.5). With it the error of a frequency falls with the eighth power of the element's
//! length instead of the fourth.

use crate::element::Element;

/// Matrix for (w, theta) near and (w, theta) far.
pub(super) type Square = [[f64; 4]; 4];

/// An element and the axial force in it (both in the model's units), with its matrices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Section {
    pub(super) element: Element,
    pub(super) axial_force: f64,
    /// Elastic stiffness and that of the axial force.
    pub(super) stiffness: Square,
    /// Of the axial force alone.
    geometric: Square,
    pub(super) mass: Square,
    /// S of the module's text.
    pub(super) second_order: Square,
    /// Displacement inside, over omega^2, for each end motion.
    inner: [Polynomial; 4],
}

/// Displacement and rotation of the section at one place for a unit of each end motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights {
    pub(super) displacement: [f64; 4],
    pub(super) rotation: [f64; 4],
}

impl Section {
    pub(super) fn new(element: Element, axial_force: f64) -> Self {
        let geometric = if axial_force == 0.0 {
            [[0.0; 4]; 4]
        } else {
            geometric_stiffness(&element, axial_force)
        };
        let elastic = element.stiffness();
        let motions = end_motions(&element);
        let responses = motions.map(|motion| inertia_response(&element, &motion));
        Self {
            element,
            axial_force,
            stiffness: sum(&elastic, &geometric),
            geometric,
            mass: element.mass(),
            second_order: second_order(&element, &motions, &responses),
            inner: responses.map(|response| response.displacement),
        }
    }

    /// Twice the strain energy, without the small differences that v^T K v consists of.
    pub(super) fn strain_energy(&self, ends: &[f64; 4]) -> f64 {
        let elastic = self.element.strain_energy(ends);
        if self.axial_force == 0.0 {
            elastic
        } else {
            elastic + quadratic(&self.geometric, ends)
        }
    }

    /// At x from 0 to 1.
    pub(super) fn weights(&self, x: f64) -> Weights {
        let slope = slopes(&self.element, x);
        let strain = shear_strains(&self.element);
        Weights {
            displacement: self.element.displacement(x),
            rotation: std::array::from_fn(|i| slope[i] - strain[i]),
        }
    }

    /// Displacement at x (0 to 1) over omega^2 that the inertia of each end motion adds inside.
    pub(super) fn inner_displacement(&self, x: f64) -> [f64; 4] {
        let value =
            |polynomial: &Polynomial| polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
        std::array::from_fn(|i| value(&self.inner[i]))
    }

    /// Displacement at x (0 to 1) for a unit force at another place of the element held at both
    /// ends: [`inner_response`] for a force at one point.
    pub(super) fn inner_compliance(&self, x: f64, force: f64) -> f64 {
        let Element {
            length: h,
            bending_stiffness,
            shear: phi,
            ..
        } = self.element;
        let rest = 1.0 - force;
        let at_end = 0.5 * rest * rest;
        let c1 = near_shear_force(phi, at_end, rest * rest * rest / 6.0, rest);
        let c3 = 0.5 * c1 - at_end;
        let behind = (x - force).max(0.0);
        let bent = (behind.powi(3) - c1 * x.powi(3)) / 6.0 + 0.5 * c3 * x * x;
        let sheared = (c1 * x - behind) * phi / 12.0;
        h.powi(3) / bending_stiffness * (bent + sheared)
    }

    /// Bending moment at x from 0 to 1, from the two ways the element is strained.
    pub(super) fn moment(&self, x: f64) -> [f64; 4] {
        let Element {
            length: h,
            bending_stiffness,
            shear: phi,
            ..
        } = self.element;
        // M = E I/h (theta1 - theta0 + 6 (2x - 1)/(1 + phi) ((theta0 + theta1)/2 - (w1 - w0)/h)).
        let tilt = 6.0 * (2.0 * x - 1.0) / (1.0 + phi);
        [tilt / h, 0.5 * tilt - 1.0, -tilt / h, 0.5 * tilt + 1.0]
            .map(|entry| bending_stiffness / h * entry)
    }
}

/// v^T A v of a symmetric matrix.
pub(super) fn quadratic(matrix: &Square, v: &[f64; 4]) -> f64 {
    let (mut diagonal, mut beside) = (0.0, 0.0);
    for i in 0..4 {
        diagonal += matrix[i][i] * v[i] * v[i];
        for j in 0..i {
            beside += matrix[i][j] * v[i] * v[j];
        }
    }
    diagonal + 2.0 * beside
}

fn sum(a: &Square, b: &Square) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// dw/dx at x from 0 to 1 for a unit of each end motion.
pub(super) fn slopes(element: &Element, x: f64) -> [f64; 4] {
    let (h, phi) = (element.length, element.shear);
    let scale = 1.0 / ((1.0 + phi) * h);
    let bend = 6.0 * (x - x * x);
    [
        scale * (-bend - phi),
        scale * h * (1.0 - 4.0 * x + 3.0 * x * x + 0.5 * phi * (1.0 - 2.0 * x)),
        scale * (bend + phi),
        scale * h * (3.0 * x * x - 2.0 * x - 0.5 * phi * (1.0 - 2.0 * x)),
    ]
}

/// Shear strain dw/dx - theta, the same all along the element.
fn shear_strains(element: &Element) -> [f64; 4] {
    let (h, phi) = (element.length, element.shear);
    let share = phi / (1.0 + phi);
    [-share / h, -0.5 * share, share / h, -0.5 * share]
}

/// P times the integral of the product of slopes.
fn geometric_stiffness(element: &Element, axial_force: f64) -> Square {
    // Three of Gauss's points integrate the fourth power exactly.
    let off = 0.5 * 0.6f64.sqrt();
    let points = [
        (0.5 - off, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.5 + off, 5.0 / 18.0),
    ];
    let mut matrix = [[0.0; 4]; 4];
    for (x, weight) in points {
        let slope = slopes(element, x);
        for (row, a) in matrix.iter_mut().zip(slope) {
            for (entry, b) in row.iter_mut().zip(slope) {
                *entry += axial_force * element.length * weight * a * b;
            }
        }
    }
    matrix
}

/// Coefficients of a polynomial, constant first.
type Polynomial = [f64; 8];

/// Displacement and rotation along the element, x from 0 to 1.
#[derive(Clone, Copy)]
struct Motion {
    displacement: Polynomial,
    rotation: Polynomial,
}

fn end_motions(element: &Element) -> [Motion; 4] {
    let (h, phi) = (element.length, element.shear);
    let s = 1.0 / (1.0 + phi);
    let shapes = [
        [s * (1.0 + phi), -s * phi, -3.0 * s, 2.0 * s],
        [
            0.0,
            s * h * (1.0 + 0.5 * phi),
            -s * h * (2.0 + 0.5 * phi),
            s * h,
        ],
        [0.0, s * phi, 3.0 * s, -2.0 * s],
        [0.0, -0.5 * s * h * phi, s * h * (0.5 * phi - 1.0), s * h],
    ];
    let strains = shear_strains(element);
    std::array::from_fn(|i| {
        let mut motion = Motion {
            displacement: [0.0; 8],
            rotation: [0.0; 8],
        };
        motion.displacement[..4].copy_from_slice(&shapes[i]);
        for (power, coefficient) in shapes[i].iter().enumerate().skip(1) {
            motion.rotation[power - 1] = power as f64 * coefficient / h;
        }
        motion.rotation[0] -= strains[i];
        motion
    })
}

/// What the inertia of an end motion causes inside, over omega^2.
fn inertia_response(element: &Element, motion: &Motion) -> Motion {
    let (m, j) = (element.mass_per_length, element.rotary_inertia);
    let force = motion.displacement.map(|c| m * c);
    inner_response(element, &force, &motion.rotation.map(|c| j * c))
}

fn second_order(element: &Element, motions: &[Motion; 4], responses: &[Motion; 4]) -> Square {
    let (m, j) = (element.mass_per_length, element.rotary_inertia);
    std::array::from_fn(|i| {
        std::array::from_fn(|k| {
            element.length
                * (m * integral_of_product(&motions[k].displacement, &responses[i].displacement)
                    + j * integral_of_product(&motions[k].rotation, &responses[i].rotation))
        })
    })
}

/// Static motion of the element held at both ends, under a distributed force and moment.
///
/// With the shear force V: V' = -h q, theta'' = -h^2/(E I) (V + moment), w' = h (theta + V/S) and
/// 1/S = phi h^2/(12 E I); all motions vanish at 0 and 1.
fn inner_response(element: &Element, force: &Polynomial, moment: &Polynomial) -> Motion {
    let (h, phi) = (element.length, element.shear);
    let flexibility = h * h / element.bending_stiffness;
    let once = integral(force);
    let bent = integral(&integral(&combine((h, &once), (-1.0, moment))));
    let (at_end, area) = (value_at_end(&bent), value_at_end(&integral(&bent)));
    let sheared = h * value_at_end(&integral(&once));
    let c1 = near_shear_force(phi, at_end, area, sheared);
    let c3 = 0.5 * c1 - at_end;
    let mut rotation = bent;
    rotation[2] -= 0.5 * c1;
    rotation[1] += c3;
    let mut slope = combine((1.0, &rotation), (-h * phi / 12.0, &once));
    slope[0] += c1 * phi / 12.0;
    Motion {
        displacement: integral(&slope).map(|c| h * flexibility * c),
        rotation: rotation.map(|c| flexibility * c),
    }
}

/// Shear force at the near end, so that both motions vanish at the far end.
fn near_shear_force(phi: f64, at_end: f64, area: f64, sheared: f64) -> f64 {
    12.0 / (1.0 + phi) * (0.5 * at_end - area + sheared * phi / 12.0)
}

fn combine((a, x): (f64, &Polynomial), (b, y): (f64, &Polynomial)) -> Polynomial {
    std::array::from_fn(|i| a * x[i] + b * y[i])
}

/// Integral from 0; the highest coefficient is never in use before.
fn integral(polynomial: &Polynomial) -> Polynomial {
    std::array::from_fn(|i| {
        if i == 0 {
            0.0
        } else {
            polynomial[i - 1] / i as f64
        }
    })
}

fn value_at_end(polynomial: &Polynomial) -> f64 {
    polynomial.iter().sum()
}

/// 1/(n + 1).
const INVERSES: [f64; 11] = {
    let mut inverses = [1.0; 11];
    let mut n = 0;
    while n < 11 {
        inverses[n] = 1.0 / (n + 1) as f64;
        n += 1;
    }
    inverses
};

fn integral_of_product(a: &Polynomial, b: &Polynomial) -> f64 {
    // Shapes of end motions are cubic.
    let mut sum = 0.0;
    for (i, x) in a[..4].iter().enumerate() {
        for (y, inverse) in b.iter().zip(&INVERSES[i..]) {
            sum += x * y * inverse;
        }
    }
    sum
}
