//! The two-node beam element: its shape under end loads, its matrices, and what the shape misses.
//!
//! Between its nodes an element takes the displacement that a beam takes under end loads: a cubic,
//! with shear the factor phi = 12 E I/(k G A h^2) enters. Mass and rotary inertia are consistent
//! with it (Przemieniecki, "Theory of Matrix Structural Analysis", 5.6 and 11.5).
//!
//! Inertia loads the element inside as well, and bends it a little further. That motion has no load
//! on the nodes, and to second order in omega^2 it adds `omega^4 v^T S v` to the mass term, with
//! S = [`Section::second_order`]: the leading term of the exact dynamic stiffness (Przemieniecki,
//! 10.5). With it the error of a frequency falls with the eighth power of the element's length
//! instead of the fourth.

use crate::width::Curling;
use crate::{Beam, BeamTheory, StructureError};
use nalgebra::DMatrix;

/// Matrix for (w, theta) near and (w, theta) far.
pub(super) type Square = [[f64; 4]; 4];

/// Motions of an element's ends: (w, theta) near, (w, theta) far, curvature across the width near and far.
pub(super) type Ends = [f64; 6];

/// Units of a model: those in which the first beam has E I = rho A = 1 and the structure length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Units {
    /// Length (m).
    pub(crate) length: f64,
    /// Mass (kg).
    pub(crate) mass: f64,
    /// Angular frequency (rad/s).
    pub(crate) omega: f64,
}

impl Units {
    pub(super) fn of(beam: &Beam, length: f64) -> Self {
        let (stiffness, density) = (beam.bending_stiffness(), beam.mass_per_length());
        Self {
            length,
            mass: density * length,
            omega: (stiffness / density).sqrt() / (length * length),
        }
    }

    /// Stiffness, that of mass times that of omega squared: E I/L^3 (N/m).
    pub(crate) fn stiffness(&self) -> f64 {
        self.mass * self.omega * self.omega
    }

    /// Rotational stiffness (N m/rad).
    pub(super) fn rotational_stiffness(&self) -> f64 {
        self.stiffness() * self.length.powi(2)
    }
}

/// A uniform beam element, in the model's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Element {
    pub(super) length: f64,
    bending_stiffness: f64,
    mass_per_length: f64,
    rotary_inertia: f64,
    /// phi = 12 E I / (k G A h^2); 0 without shear.
    shear: f64,
}

impl Element {
    /// One of `elements` equal elements of a beam. `shear_rotary` is the share of shear flexibility
    /// and rotary inertia (1).
    fn of(beam: &Beam, elements: usize, shear_rotary: f64, units: &Units) -> Self {
        // The unit of bending stiffness is that in which the unit of omega is 1.
        let mass_unit = units.mass / units.length;
        let stiffness_unit = units.omega.powi(2) * mass_unit * units.length.powi(4);
        let length = beam.length / units.length / elements.max(1) as f64;
        let mass_per_length = beam.mass_per_length() / mass_unit;
        let slenderness = beam.slenderness(BeamTheory::Timoshenko);
        let scale = (beam.length / units.length).powi(2);
        Self {
            length,
            bending_stiffness: beam.bending_stiffness() / stiffness_unit,
            mass_per_length,
            rotary_inertia: shear_rotary * (mass_per_length * slenderness.rotary * scale),
            shear: shear_rotary * (12.0 * slenderness.shear * scale / (length * length)),
        }
    }

    /// Stiffness for (w, theta) at either node.
    fn stiffness(&self) -> Square {
        let (h, phi) = (self.length, self.shear);
        let terms = EndTerms {
            ww: 12.0,
            wt: 6.0 * h,
            ww_far: -12.0,
            wt_far: 6.0 * h,
            tt: (4.0 + phi) * h * h,
            tt_far: (2.0 - phi) * h * h,
        };
        terms.matrix(self.bending_stiffness / (h.powi(3) * (1.0 + phi)))
    }

    /// Twice the energy of one bent and one sheared shape. A difference of rotations gives the
    /// first, their mean against the chord the second.
    fn strain_energy(&self, [w0, t0, w1, t1]: &[f64; 4]) -> f64 {
        let bend = t1 - t0;
        let shear = 0.5 * (t0 + t1) - (w1 - w0) / self.length;
        self.bending_stiffness / self.length
            * (bend * bend + 12.0 / (1.0 + self.shear) * shear * shear)
    }

    /// Consistent mass: translation of the element's displacement, rotation of its sections.
    fn mass(&self) -> Square {
        let (h, phi) = (self.length, self.shear);
        let scale = (1.0 + phi).powi(-2);
        let translation = EndTerms {
            ww: 13.0 / 35.0 + 7.0 * phi / 10.0 + phi * phi / 3.0,
            wt: (11.0 / 210.0 + 11.0 * phi / 120.0 + phi * phi / 24.0) * h,
            ww_far: 9.0 / 70.0 + 3.0 * phi / 10.0 + phi * phi / 6.0,
            wt_far: -(13.0 / 420.0 + 3.0 * phi / 40.0 + phi * phi / 24.0) * h,
            tt: (1.0 / 105.0 + phi / 60.0 + phi * phi / 120.0) * h * h,
            tt_far: -(1.0 / 140.0 + phi / 60.0 + phi * phi / 120.0) * h * h,
        };
        let rotation = EndTerms {
            ww: 6.0 / 5.0,
            wt: (0.1 - 0.5 * phi) * h,
            ww_far: -6.0 / 5.0,
            wt_far: (0.1 - 0.5 * phi) * h,
            tt: (2.0 / 15.0 + phi / 6.0 + phi * phi / 3.0) * h * h,
            tt_far: (-1.0 / 30.0 - phi / 6.0 + phi * phi / 6.0) * h * h,
        };
        let of_mass = translation.matrix(scale * self.mass_per_length * h);
        sum(&of_mass, &rotation.matrix(scale * self.rotary_inertia / h))
    }

    /// Displacement at x from 0 to 1 for a unit of each end motion.
    fn displacement(&self, x: f64) -> [f64; 4] {
        let (h, phi) = (self.length, self.shear);
        let (x2, x3) = (x * x, x * x * x);
        let scale = 1.0 / (1.0 + phi);
        [
            scale * (1.0 - 3.0 * x2 + 2.0 * x3 + phi * (1.0 - x)),
            scale * h * (x - 2.0 * x2 + x3 + 0.5 * phi * (x - x2)),
            scale * (3.0 * x2 - 2.0 * x3 + phi * x),
            scale * h * (x3 - x2 - 0.5 * phi * (x - x2)),
        ]
    }

    /// dw/dx at x from 0 to 1 for a unit of each end motion.
    fn slopes(&self, x: f64) -> [f64; 4] {
        let (h, phi) = (self.length, self.shear);
        let scale = 1.0 / ((1.0 + phi) * h);
        let bend = 6.0 * (x - x * x);
        [
            scale * (-bend - phi),
            scale * h * (1.0 - 4.0 * x + 3.0 * x * x + 0.5 * phi * (1.0 - 2.0 * x)),
            scale * (bend + phi),
            scale * h * (3.0 * x * x - 2.0 * x - 0.5 * phi * (1.0 - 2.0 * x)),
        ]
    }

    /// Shear strain dw/dx - theta for a unit of each end motion, constant along the element.
    fn shear_strains(&self) -> [f64; 4] {
        let (h, phi) = (self.length, self.shear);
        let share = phi / (1.0 + phi);
        [-share / h, -0.5 * share, share / h, -0.5 * share]
    }

    /// Stiffness of an axial force P: P times the integral of the product of slopes.
    fn geometric_stiffness(&self, axial_force: f64) -> Square {
        let mut matrix = [[0.0; 4]; 4];
        if axial_force == 0.0 {
            return matrix;
        }
        // Three of Gauss's points integrate the fourth power exactly.
        let off = 0.5 * 0.6f64.sqrt();
        let points = [
            (0.5 - off, 5.0 / 18.0),
            (0.5, 8.0 / 18.0),
            (0.5 + off, 5.0 / 18.0),
        ];
        for (x, weight) in points {
            let slope = self.slopes(x);
            for (row, a) in matrix.iter_mut().zip(slope) {
                for (entry, b) in row.iter_mut().zip(slope) {
                    *entry += axial_force * self.length * weight * a * b;
                }
            }
        }
        matrix
    }

    /// Displacement and rotation along the element for a unit of each end motion.
    fn end_motions(&self) -> [Motion; 4] {
        let (h, phi) = (self.length, self.shear);
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
        let strains = self.shear_strains();
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

    /// Static motion of the element held at both ends under the inertia of a motion, over omega^2.
    ///
    /// The inertia is a distributed force q and moment m. With the shear force V: V' = -h q,
    /// theta'' = -h^2/(E I) (V + m), w' = h (theta + V/S) and 1/S = phi h^2/(12 E I). All motions
    /// vanish at 0 and 1.
    fn inertia_response(&self, motion: &Motion) -> Motion {
        let (h, phi) = (self.length, self.shear);
        let force = motion.displacement.map(|c| self.mass_per_length * c);
        let moment = motion.rotation.map(|c| self.rotary_inertia * c);
        let flexibility = h * h / self.bending_stiffness;
        let once = integral(&force);
        let bent = integral(&integral(&std::array::from_fn(|i| h * once[i] - moment[i])));
        let (at_end, area) = (value_at_end(&bent), value_at_end(&integral(&bent)));
        let sheared = h * value_at_end(&integral(&once));
        let c1 = near_shear_force(phi, at_end, area, sheared);
        let c3 = 0.5 * c1 - at_end;
        let mut rotation = bent;
        rotation[2] -= 0.5 * c1;
        rotation[1] += c3;
        let mut slope: Polynomial =
            std::array::from_fn(|i| rotation[i] + -h * phi / 12.0 * once[i]);
        slope[0] += c1 * phi / 12.0;
        Motion {
            displacement: integral(&slope).map(|c| h * flexibility * c),
            rotation: rotation.map(|c| flexibility * c),
        }
    }

    /// S of the module's text: the work of each end motion's inertia on the response to another's.
    fn second_order(&self, motions: &[Motion; 4], responses: &[Motion; 4]) -> Square {
        let (m, j) = (self.mass_per_length, self.rotary_inertia);
        std::array::from_fn(|i| {
            std::array::from_fn(|k| {
                let (motion, response) = (&motions[k], &responses[i]);
                self.length
                    * (m * integral_of_product(&motion.displacement, &response.displacement)
                        + j * integral_of_product(&motion.rotation, &response.rotation))
            })
        })
    }
}

/// The six different entries of a uniform element's symmetric matrix; near and far node alike.
struct EndTerms {
    ww: f64,
    wt: f64,
    ww_far: f64,
    wt_far: f64,
    tt: f64,
    tt_far: f64,
}

impl EndTerms {
    /// The matrix for (w, theta) near and (w, theta) far. Seen from the far end x runs backwards,
    /// which turns the sign of every rotation.
    fn matrix(&self, scale: f64) -> Square {
        let rows = [
            [self.ww, self.wt, self.ww_far, self.wt_far],
            [self.wt, self.tt, -self.wt_far, self.tt_far],
            [self.ww_far, -self.wt_far, self.ww, -self.wt],
            [self.wt_far, self.tt_far, -self.wt, self.tt],
        ];
        rows.map(|row| row.map(|entry| scale * entry))
    }
}

/// An element and the axial force in it, with its matrices, in the model's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Section {
    pub(super) element: Element,
    pub(super) axial_force: f64,
    /// Elastic stiffness and that of the axial force.
    pub(super) stiffness: Square,
    /// Stiffness of the axial force alone.
    geometric: Square,
    pub(super) mass: Square,
    /// S of the module's text.
    pub(super) second_order: Square,
    /// Displacement inside, over omega^2, for each end motion.
    inner: [Polynomial; 4],
    curling: Option<Curling>,
    /// What the width adds.
    pub(super) across: Across,
}

/// Stiffening of an element by its width: twice the strain energy that the curling adds (`width.rs`).
///
/// Along the element the curvature kappa is linear, and `a` without mass follows exactly: a + nu kappa is a sum of
/// e^(qx) and e^(-qx) with q^2 = follow/twist. With s and d the mean of a + nu kappa at the nodes and half of its
/// change, and c = q h/2, the energy is
///
/// ```text
/// E I h ( follow tanh(c)/c s^2 + follow (c coth(c) - 1)/c^2 d^2 + twist/h^2 (a1 - a0)^2 ).
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Across {
    /// Weight, and what of the end motions is squared.
    terms: [(f64, Ends); 3],
}

impl Across {
    /// For the curvature at both ends of the element for a unit of each end motion.
    fn new(element: &Element, curling: &Curling, near: &[f64; 4], far: &[f64; 4]) -> Self {
        let (nu, follow, twist) = (curling.poisson, curling.follow, curling.twist);
        let scale = element.bending_stiffness * element.length;
        let c = 0.5 * element.length * (follow / twist).sqrt();
        // The rest of the series is 2 c^4/945, and beyond it c coth(c) - 1 has lost five digits at most.
        let odd = match c < 0.005 {
            true => 1.0 / 3.0 - c * c / 45.0,
            false => (c / c.tanh() - 1.0) / (c * c),
        };
        let (mut mean, mut change) = ([0.0; 6], [0.0; 6]);
        for i in 0..4 {
            mean[i] = 0.5 * nu * (near[i] + far[i]);
            change[i] = 0.5 * nu * (far[i] - near[i]);
        }
        (mean[4], mean[5]) = (0.5, 0.5);
        (change[4], change[5]) = (-0.5, 0.5);
        Self {
            terms: [
                (scale * follow * c.tanh() / c, mean),
                (scale * follow * odd, change),
                (
                    scale * twist / element.length.powi(2),
                    [0.0, 0.0, 0.0, 0.0, -1.0, 1.0],
                ),
            ],
        }
    }

    /// Twice the strain energy.
    pub(super) fn strain_energy(&self, ends: &Ends) -> f64 {
        let terms = self.terms.iter();
        terms
            .map(|(weight, of)| weight * product(of, ends).powi(2))
            .sum()
    }

    /// The stiffness matrix.
    pub(super) fn matrix(&self) -> [Ends; 6] {
        let mut matrix = [[0.0; 6]; 6];
        for (weight, of) in &self.terms {
            for (row, a) in matrix.iter_mut().zip(of) {
                for (entry, b) in row.iter_mut().zip(of) {
                    *entry += weight * a * b;
                }
            }
        }
        matrix
    }
}

fn product(a: &Ends, b: &Ends) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Displacement and rotation of the section at one place for a unit of each end motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights {
    pub(super) displacement: [f64; 4],
    pub(super) rotation: [f64; 4],
}

impl Section {
    /// One of `elements` equal elements of a beam, with a share of shear flexibility and rotary
    /// inertia (1) and an axial force (N). `stiffened` where its width stiffens it.
    pub(super) fn new(
        beam: &Beam,
        elements: usize,
        shear_rotary: f64,
        axial_force: f64,
        stiffened: bool,
        units: &Units,
    ) -> Self {
        let element = Element::of(beam, elements, shear_rotary, units);
        // The unit of force: that of bending stiffness over length squared.
        let axial_force = axial_force / (units.stiffness() * units.length);
        let geometric = element.geometric_stiffness(axial_force);
        let motions = element.end_motions();
        let responses = motions.map(|motion| element.inertia_response(&motion));
        let curling = stiffened.then(|| {
            let curling = Curling::of(beam);
            Curling {
                twist: curling.twist / units.length.powi(2),
                ..curling
            }
        });
        let mut section = Self {
            element,
            axial_force,
            stiffness: sum(&element.stiffness(), &geometric),
            geometric,
            mass: element.mass(),
            second_order: element.second_order(&motions, &responses),
            inner: responses.map(|response| response.displacement),
            curling,
            across: Across::default(),
        };
        let [near, far] = [0.0, 1.0].map(|x| section.curvature(x));
        section.across = section.across_for(&near, &far);
        section
    }

    /// Returns the section with another modulus and density, as multiples of its own. Shear follows the modulus, and rotary
    /// inertia the density. The static answer to inertia is proportional to the density over the modulus, and its
    /// inertia once more to the density.
    pub(super) fn changed(&self, stiffness: f64, mass: f64) -> Self {
        let element = Element {
            bending_stiffness: stiffness * self.element.bending_stiffness,
            mass_per_length: mass * self.element.mass_per_length,
            rotary_inertia: mass * self.element.rotary_inertia,
            ..self.element
        };
        let flexible = mass / stiffness;
        let mut across = self.across;
        across.terms.iter_mut().for_each(|term| term.0 *= stiffness);
        Self {
            stiffness: sum(&element.stiffness(), &self.geometric),
            mass: self.mass.map(|row| row.map(|entry| mass * entry)),
            second_order: self
                .second_order
                .map(|row| row.map(|entry| mass * flexible * entry)),
            inner: self.inner.map(|one| one.map(|c| flexible * c)),
            element,
            across,
            ..*self
        }
    }

    /// What the width adds where the element has this curvature at its ends.
    fn across_for(&self, near: &[f64; 4], far: &[f64; 4]) -> Across {
        match &self.curling {
            Some(curling) => Across::new(&self.element, curling, near, far),
            None => Across::default(),
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

    /// Motions at x from 0 to 1.
    pub(super) fn weights(&self, x: f64) -> Weights {
        let slope = self.element.slopes(x);
        let strain = self.element.shear_strains();
        Weights {
            displacement: self.element.displacement(x),
            rotation: std::array::from_fn(|i| slope[i] - strain[i]),
        }
    }

    /// Displacement at x (0 to 1) over omega^2 that the inertia of each end motion adds inside.
    pub(super) fn inner_displacement(&self, x: f64) -> [f64; 4] {
        self.inner
            .map(|inner| inner.iter().rev().fold(0.0, |sum, c| sum * x + c))
    }

    /// Displacement at x (0 to 1) for a unit force at another place of the element held at both
    /// ends: [`Element::inertia_response`] for a force at one point.
    pub(super) fn inner_compliance(&self, x: f64, force: f64) -> f64 {
        let (h, phi) = (self.element.length, self.element.shear);
        let rest = 1.0 - force;
        let at_end = 0.5 * rest * rest;
        let c1 = near_shear_force(phi, at_end, rest * rest * rest / 6.0, rest);
        let c3 = 0.5 * c1 - at_end;
        let behind = (x - force).max(0.0);
        let bent = (behind.powi(3) - c1 * x.powi(3)) / 6.0 + 0.5 * c3 * x * x;
        let sheared = (c1 * x - behind) * phi / 12.0;
        h.powi(3) / self.element.bending_stiffness * (bent + sheared)
    }

    /// Bending moment at x from 0 to 1.
    fn moment(&self, x: f64) -> [f64; 4] {
        let stiffness = self.element.bending_stiffness;
        self.curvature(x).map(|entry| stiffness * entry)
    }

    /// Curvature at x from 0 to 1, from the two ways the element is strained.
    fn curvature(&self, x: f64) -> [f64; 4] {
        let (h, phi) = (self.element.length, self.element.shear);
        // kappa = 1/h (theta1 - theta0 + 6 (2x - 1)/(1 + phi) ((theta0 + theta1)/2 - (w1 - w0)/h)).
        let tilt = 6.0 * (2.0 * x - 1.0) / (1.0 + phi);
        [tilt / h, 0.5 * tilt - 1.0, -tilt / h, 0.5 * tilt + 1.0].map(|entry| entry / h)
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

/// Inner product.
pub(super) fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn sum(a: &Square, b: &Square) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// Coefficients of a polynomial, constant first.
type Polynomial = [f64; 8];

/// Displacement and rotation along the element, x from 0 to 1.
#[derive(Clone, Copy)]
struct Motion {
    displacement: Polynomial,
    rotation: Polynomial,
}

/// Shear force at the near end, so that both motions vanish at the far end.
fn near_shear_force(phi: f64, at_end: f64, area: f64, sheared: f64) -> f64 {
    12.0 / (1.0 + phi) * (0.5 * at_end - area + sheared * phi / 12.0)
}

/// Integral from 0. The highest coefficient is never in use before.
fn integral(polynomial: &Polynomial) -> Polynomial {
    let mut integral = [0.0; 8];
    for (i, coefficient) in polynomial[..7].iter().enumerate() {
        integral[i + 1] = coefficient / (i + 1) as f64;
    }
    integral
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

/// Integral from 0 to 1 of the product of a cubic, as end motions are, and another polynomial.
fn integral_of_product(a: &Polynomial, b: &Polynomial) -> f64 {
    let mut sum = 0.0;
    for (i, x) in a[..4].iter().enumerate() {
        for (y, inverse) in b.iter().zip(&INVERSES[i..]) {
            sum += x * y * inverse;
        }
    }
    sum
}

/// A hinge inside an element.
#[derive(Debug, Clone, Copy)]
pub(super) struct ElementHinge {
    /// Place within the element (0 to 1).
    pub(super) within: f64,
    /// Rotation per moment, in the model's units.
    pub(super) compliance: f64,
}

/// An element with hinges inside, condensed exactly. The element takes its static shape under end
/// loads, kinks included, so that nothing jumps when a hinge moves across a node.
///
/// With the element held at both ends, a unit kink at x_k bends it by kappa_k and causes the moment
/// M_k(x). A hinge of compliance c turns by `alpha = c (moment there)`, the moment being that of
/// the end motions, b v, and of all kinks:
///
/// ```text
/// alpha = C (B v + M alpha)   =>   alpha = (1 - C M)^-1 C B v = A v,   K = K0 - B^T A.
/// ```
#[derive(Debug, Clone)]
pub(super) struct HingedElement {
    /// The element's near node.
    pub(super) node: usize,
    pub(super) hinges: Vec<ElementHinge>,
    /// A: kink of each hinge for a unit of each end motion.
    kinks: Vec<[f64; 4]>,
    pub(super) stiffness: Square,
    pub(super) mass: Square,
    /// What the width adds.
    pub(super) across: Across,
}

impl HingedElement {
    /// # Errors
    /// [`StructureError::FiniteElements`] where the hinges have no solution.
    pub(super) fn new(
        section: &Section,
        node: usize,
        hinges: Vec<ElementHinge>,
    ) -> Result<Self, StructureError> {
        let element = &section.element;
        let kinks = kinks_per_end_motion(section, &hinges)?;
        let mut stiffness = element.stiffness();
        for (kink, hinge) in kinks.iter().zip(&hinges) {
            for (row, moment) in stiffness.iter_mut().zip(section.moment(hinge.within)) {
                for (entry, turn) in row.iter_mut().zip(kink) {
                    *entry -= moment * turn;
                }
            }
        }
        let mut hinged = Self {
            node,
            hinges,
            kinks,
            stiffness,
            mass: [[0.0; 4]; 4],
            across: Across::default(),
        };
        let [near, far] = [0.0, 1.0].map(|x| hinged.curvature(section, x));
        hinged.across = section.across_for(&near, &far);
        // Mass and stiffness of the axial force, piece by piece between the kinks.
        for (x, weight) in hinged.gauss_points() {
            let scale = weight * element.length;
            let mut weights = section.weights(x);
            hinged.add_weights(section, x, &mut weights);
            let slope = hinged.slopes(section, x);
            let (w, t) = (weights.displacement, weights.rotation);
            for i in 0..4 {
                for j in 0..4 {
                    hinged.mass[i][j] += scale
                        * (element.mass_per_length * w[i] * w[j]
                            + element.rotary_inertia * t[i] * t[j]);
                    hinged.stiffness[i][j] += scale * section.axial_force * slope[i] * slope[j];
                }
            }
        }
        Ok(hinged)
    }

    /// Places (0 to 1) and weights that integrate exactly to the seventh power between the kinks.
    fn gauss_points(&self) -> Vec<(f64, f64)> {
        let mut borders: Vec<f64> = self.hinges.iter().map(|hinge| hinge.within).collect();
        borders.extend([0.0, 1.0]);
        borders.sort_by(f64::total_cmp);
        let mut points = Vec::with_capacity(4 * borders.len());
        for piece in borders.windows(2) {
            let width = piece[1] - piece[0];
            points.extend(GAUSS.map(|(x, weight)| (piece[0] + width * x, width * weight)));
        }
        points
    }

    fn kinks(&self, section: &Section) -> impl Iterator<Item = (Kink, &[f64; 4])> {
        let hinges = self.hinges.iter().zip(&self.kinks);
        hinges.map(|(hinge, turns)| (Kink::new(&section.element, hinge.within), turns))
    }

    /// Adds to the motion of the whole element what the kinks add.
    pub(super) fn add_weights(&self, section: &Section, x: f64, weights: &mut Weights) {
        for (kink, per_motion) in self.kinks(section) {
            for (i, share) in per_motion.iter().enumerate() {
                weights.displacement[i] += share * kink.displacement(x);
                weights.rotation[i] += share * kink.rotation(x);
            }
        }
    }

    fn slopes(&self, section: &Section, x: f64) -> [f64; 4] {
        let mut slope = section.element.slopes(x);
        for (kink, per_motion) in self.kinks(section) {
            for (total, share) in slope.iter_mut().zip(per_motion) {
                *total += share * kink.slope(x);
            }
        }
        slope
    }

    /// Curvature at x, by bending between the kinks.
    fn curvature(&self, section: &Section, x: f64) -> [f64; 4] {
        let mut curvature = section.curvature(x);
        for (kink, per_motion) in self.kinks(section) {
            for (total, share) in curvature.iter_mut().zip(per_motion) {
                *total += share * kink.moment(x) / section.element.length;
            }
        }
        curvature
    }

    /// Twice the strain energy: that of the whole element less what the kinks release.
    pub(super) fn strain_energy(&self, section: &Section, ends: &[f64; 4]) -> f64 {
        let mut released = 0.0;
        for (kink, hinge) in self.kinks.iter().zip(&self.hinges) {
            released += dot(&section.moment(hinge.within), ends) * dot(kink, ends);
        }
        let mut axial = 0.0;
        if section.axial_force != 0.0 {
            for (x, weight) in self.gauss_points() {
                let along = dot(&self.slopes(section, x), ends);
                axial += weight * along * along;
            }
        }
        section.element.strain_energy(ends) - released
            + axial * section.axial_force * section.element.length
    }
}

/// Gauss's four points from 0 to 1 and their weights.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// A of the text of [`HingedElement`].
fn kinks_per_end_motion(
    section: &Section,
    hinges: &[ElementHinge],
) -> Result<Vec<[f64; 4]>, StructureError> {
    let count = hinges.len();
    let scale = section.element.bending_stiffness / section.element.length;
    let mut matrix = DMatrix::identity(count, count);
    let mut right = DMatrix::zeros(count, 4);
    for (i, hinge) in hinges.iter().enumerate() {
        for (j, other) in hinges.iter().enumerate() {
            let kink = Kink::new(&section.element, other.within);
            matrix[(i, j)] -= hinge.compliance * scale * kink.moment(hinge.within);
        }
        for (j, moment) in section.moment(hinge.within).iter().enumerate() {
            right[(i, j)] = hinge.compliance * moment;
        }
    }
    // The moments of unit kinks form a negative semidefinite matrix, so that there is a solution.
    let solution = matrix.lu().solve(&right);
    let solution = solution.ok_or_else(|| StructureError::FiniteElements {
        reason: "the hinges in one element have no solution".to_owned(),
    })?;
    Ok((0..count)
        .map(|i| std::array::from_fn(|j| solution[(i, j)]))
        .collect())
}

/// The shape that a unit kink gives the element held at both ends.
struct Kink {
    within: f64,
    /// theta = a x + b x^2/2, and 1 more behind the kink.
    a: f64,
    b: f64,
    /// phi/12.
    shear: f64,
    length: f64,
}

impl Kink {
    fn new(element: &Element, within: f64) -> Self {
        let phi = element.shear;
        // Rotation and displacement vanish at the far end:
        // a + b/2 + 1 = 0, a/2 + b/6 + 1 - x_k - b phi/12 = 0.
        let b = 6.0 * (1.0 - 2.0 * within) / (1.0 + phi);
        Self {
            within,
            a: -1.0 - 0.5 * b,
            b,
            shear: phi / 12.0,
            length: element.length,
        }
    }

    fn displacement(&self, x: f64) -> f64 {
        let bent = 0.5 * self.a * x * x + self.b * x * x * x / 6.0 - self.b * self.shear * x;
        self.length * (bent + (x - self.within).max(0.0))
    }

    fn rotation(&self, x: f64) -> f64 {
        let turned = if x > self.within { 1.0 } else { 0.0 };
        self.a * x + 0.5 * self.b * x * x + turned
    }

    /// dw/dx.
    fn slope(&self, x: f64) -> f64 {
        self.rotation(x) - self.b * self.shear
    }

    /// Moment times h/(E I).
    fn moment(&self, x: f64) -> f64 {
        self.a + self.b * x
    }
}
