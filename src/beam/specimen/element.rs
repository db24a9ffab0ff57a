//! The two-node beam element, with the displacement that a beam takes under end loads (cubic; with
//! shear, the factor phi = 12 E I/(k G A h^2) enters), consistent mass and rotary inertia
//! (Przemieniecki, "Theory of Matrix Structural Analysis", 5.6 and 11.5).

use crate::StructureError;
use nalgebra::DMatrix;

/// One beam element, in the model's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Element {
    pub(crate) length: f64,
    pub(crate) bending_stiffness: f64,
    pub(crate) mass_per_length: f64,
    pub(crate) rotary_inertia: f64,
    /// phi = 12 E I / (k G A h^2); 0 without shear.
    pub(crate) shear: f64,
}

impl Element {
    /// Stiffness for (w, theta) at either node.
    pub(crate) fn stiffness(&self) -> [[f64; 4]; 4] {
        let (h, phi) = (self.length, self.shear);
        let scale = self.bending_stiffness / (h.powi(3) * (1.0 + phi));
        let terms = EndTerms {
            ww: 12.0,
            wt: 6.0 * h,
            ww_far: -12.0,
            wt_far: 6.0 * h,
            tt: (4.0 + phi) * h * h,
            tt_far: (2.0 - phi) * h * h,
        };
        terms.matrix(scale)
    }

    /// Twice the energy of one bent and one sheared shape: a difference of rotations gives the
    /// first, their mean against the chord the second.
    pub(crate) fn strain_energy(&self, [w0, t0, w1, t1]: &[f64; 4]) -> f64 {
        let bend = t1 - t0;
        let shear = 0.5 * (t0 + t1) - (w1 - w0) / self.length;
        self.bending_stiffness / self.length
            * (bend * bend + 12.0 / (1.0 + self.shear) * shear * shear)
    }

    /// Consistent mass: translation of the element's displacement, rotation of its sections.
    pub(crate) fn mass(&self) -> [[f64; 4]; 4] {
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
        let of_inertia = rotation.matrix(scale * self.rotary_inertia / h);
        std::array::from_fn(|i| std::array::from_fn(|j| of_mass[i][j] + of_inertia[i][j]))
    }

    /// Displacement at x, from 0 to 1, for a unit of each of the four end motions.
    pub(crate) fn displacement(&self, x: f64) -> [f64; 4] {
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
    /// The matrix for (w, theta) near and (w, theta) far; seen from the far end x runs backwards,
    /// which turns the sign of every rotation.
    fn matrix(&self, scale: f64) -> [[f64; 4]; 4] {
        let rows = [
            [self.ww, self.wt, self.ww_far, self.wt_far],
            [self.wt, self.tt, -self.wt_far, self.tt_far],
            [self.ww_far, -self.wt_far, self.ww, -self.wt],
            [self.wt_far, self.tt_far, -self.wt, self.tt],
        ];
        rows.map(|row| row.map(|entry| scale * entry))
    }
}

// One beam element of a specimen: its matrices, its shape, and what the shape misses.
//
// Between its nodes an element takes its static shape under end loads. Inertia loads it inside as
// well, and bends it a little further; that motion has no load on the nodes, and to second order
// in omega^2 it adds `omega^4 v^T S v` to the mass term, with S = [`Section::second_order`]: the
// leading term of the exact dynamic stiffness (Przemieniecki, "Theory of Matrix Structural
// Analysis", 10.5). With it the error of a frequency falls with the eighth power of the element's
// length instead of the fourth.

/// Matrix for (w, theta) near and (w, theta) far.
pub(crate) type Square = [[f64; 4]; 4];

/// An element and the axial force in it (both in the model's units), with its matrices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Section {
    pub(crate) element: Element,
    pub(crate) axial_force: f64,
    /// Elastic stiffness and that of the axial force.
    pub(crate) stiffness: Square,
    /// Of the axial force alone.
    geometric: Square,
    pub(crate) mass: Square,
    /// S of the module's text.
    pub(crate) second_order: Square,
    /// Displacement inside, over omega^2, for each end motion.
    inner: [Polynomial; 4],
}

/// Displacement and rotation of the section at one place for a unit of each end motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weights {
    pub(crate) displacement: [f64; 4],
    pub(crate) rotation: [f64; 4],
}

impl Section {
    pub(crate) fn new(element: Element, axial_force: f64) -> Self {
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
    pub(crate) fn strain_energy(&self, ends: &[f64; 4]) -> f64 {
        let elastic = self.element.strain_energy(ends);
        if self.axial_force == 0.0 {
            elastic
        } else {
            elastic + quadratic(&self.geometric, ends)
        }
    }

    /// At x from 0 to 1.
    pub(crate) fn weights(&self, x: f64) -> Weights {
        let slope = slopes(&self.element, x);
        let strain = shear_strains(&self.element);
        Weights {
            displacement: self.element.displacement(x),
            rotation: std::array::from_fn(|i| slope[i] - strain[i]),
        }
    }

    /// Displacement at x (0 to 1) over omega^2 that the inertia of each end motion adds inside.
    pub(crate) fn inner_displacement(&self, x: f64) -> [f64; 4] {
        let value =
            |polynomial: &Polynomial| polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
        std::array::from_fn(|i| value(&self.inner[i]))
    }

    /// Displacement at x (0 to 1) for a unit force at another place of the element held at both
    /// ends: [`inner_response`] for a force at one point.
    pub(crate) fn inner_compliance(&self, x: f64, force: f64) -> f64 {
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
    pub(crate) fn moment(&self, x: f64) -> [f64; 4] {
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
pub(crate) fn quadratic(matrix: &Square, v: &[f64; 4]) -> f64 {
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
pub(crate) fn slopes(element: &Element, x: f64) -> [f64; 4] {
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

// An element with hinges inside, condensed exactly: the element takes its static shape under end
// loads, kinks included, so that nothing jumps when a hinge moves across a node.
//
// With the element held at both ends, a unit kink at x_k bends it by kappa_k and causes the moment
// M_k(x). A hinge of compliance c turns by `alpha = c (moment there)`, the moment being that of the
// end motions, b v, and of all kinks:
//
// ```text
// alpha = C (B v + M alpha)   =>   alpha = (1 - C M)^-1 C B v = A v,   K = K0 - B^T A.
// ```

/// An element with its hinges: place within it (0 to 1) and compliance.
#[derive(Debug, Clone)]
pub(crate) struct HingedElement {
    pub(crate) run: usize,
    pub(crate) index: usize,
    pub(crate) hinges: Vec<(f64, f64)>,
    /// A: kink of each hinge for a unit of each end motion.
    kinks: Vec<[f64; 4]>,
    pub(crate) stiffness: Square,
    pub(crate) mass: Square,
}

/// The shape that a unit kink gives the element held at both ends.
struct Kink {
    place: f64,
    /// theta = a x + b x^2/2, and 1 more behind the kink.
    a: f64,
    b: f64,
    /// phi/12.
    shear: f64,
    length: f64,
}

impl Kink {
    fn new(section: &Section, place: f64) -> Self {
        let phi = section.element.shear;
        // Rotation and displacement vanish at the far end:
        // a + b/2 + 1 = 0, a/2 + b/6 + 1 - x_k - b phi/12 = 0.
        let b = 6.0 * (1.0 - 2.0 * place) / (1.0 + phi);
        Self {
            place,
            a: -1.0 - 0.5 * b,
            b,
            shear: phi / 12.0,
            length: section.element.length,
        }
    }

    fn behind(&self, x: f64) -> f64 {
        (x - self.place).max(0.0)
    }

    fn displacement(&self, x: f64) -> f64 {
        let bent = 0.5 * self.a * x * x + self.b * x * x * x / 6.0 - self.b * self.shear * x;
        self.length * (bent + self.behind(x))
    }

    fn rotation(&self, x: f64) -> f64 {
        let turned = if x > self.place { 1.0 } else { 0.0 };
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

impl HingedElement {
    pub(crate) fn new(
        section: &Section,
        (run, index): (usize, usize),
        hinges: Vec<(f64, f64)>,
    ) -> Result<Self, StructureError> {
        let kinks = kinks_per_end_motion(section, &hinges)?;
        let mut element = Self {
            run,
            index,
            hinges,
            kinks,
            stiffness: section.element.stiffness(),
            mass: [[0.0; 4]; 4],
        };
        for (kink, &(place, _)) in element.kinks.iter().zip(&element.hinges) {
            let moment = section.moment(place);
            for (row, moment) in element.stiffness.iter_mut().zip(moment) {
                for (entry, turn) in row.iter_mut().zip(kink) {
                    *entry -= moment * turn;
                }
            }
        }
        element.integrate(section);
        Ok(element)
    }

    /// Mass and stiffness of the axial force, piece by piece between the kinks.
    fn integrate(&mut self, section: &Section) {
        let mut borders: Vec<f64> = self.hinges.iter().map(|(place, _)| *place).collect();
        borders.extend([0.0, 1.0]);
        borders.sort_by(f64::total_cmp);
        let element = &section.element;
        for piece in borders.windows(2) {
            for (point, weight) in GAUSS {
                let x = piece[0] + (piece[1] - piece[0]) * point;
                let scale = (piece[1] - piece[0]) * weight * element.length;
                let mut weights = section.weights(x);
                self.add_weights(section, x, &mut weights);
                let slope = self.slopes(section, x);
                let (w, t) = (weights.displacement, weights.rotation);
                for i in 0..4 {
                    for j in 0..4 {
                        self.mass[i][j] += scale
                            * (element.mass_per_length * w[i] * w[j]
                                + element.rotary_inertia * t[i] * t[j]);
                        self.stiffness[i][j] += scale * section.axial_force * slope[i] * slope[j];
                    }
                }
            }
        }
    }

    fn kinks(&self, section: &Section) -> impl Iterator<Item = (Kink, &[f64; 4])> {
        let shapes = self
            .hinges
            .iter()
            .map(|(place, _)| Kink::new(section, *place));
        shapes.zip(&self.kinks)
    }

    /// Adds to the motion of the whole element what the kinks add.
    pub(crate) fn add_weights(&self, section: &Section, x: f64, weights: &mut Weights) {
        for (kink, per_motion) in self.kinks(section) {
            for (i, share) in per_motion.iter().enumerate() {
                weights.displacement[i] += share * kink.displacement(x);
                weights.rotation[i] += share * kink.rotation(x);
            }
        }
    }

    fn slopes(&self, section: &Section, x: f64) -> [f64; 4] {
        let mut slope = slopes(&section.element, x);
        for (kink, per_motion) in self.kinks(section) {
            for (total, share) in slope.iter_mut().zip(per_motion) {
                *total += share * kink.slope(x);
            }
        }
        slope
    }

    /// Twice the strain energy: that of the whole element less what the kinks release.
    pub(crate) fn strain_energy(&self, section: &Section, ends: &[f64; 4]) -> f64 {
        let dot = |row: &[f64; 4]| row.iter().zip(ends).map(|(a, b)| a * b).sum::<f64>();
        let released = self
            .kinks
            .iter()
            .zip(&self.hinges)
            .map(|(kink, (place, _))| dot(&section.moment(*place)) * dot(kink));
        let elastic = section.element.strain_energy(ends) - released.sum::<f64>();
        elastic + self.axial_energy(section, ends)
    }

    fn axial_energy(&self, section: &Section, ends: &[f64; 4]) -> f64 {
        if section.axial_force == 0.0 {
            return 0.0;
        }
        let mut borders: Vec<f64> = self.hinges.iter().map(|(place, _)| *place).collect();
        borders.extend([0.0, 1.0]);
        borders.sort_by(f64::total_cmp);
        let mut sum = 0.0;
        for piece in borders.windows(2) {
            let width = piece[1] - piece[0];
            for (point, weight) in GAUSS {
                let slope = self.slopes(section, piece[0] + width * point);
                let along: f64 = slope.iter().zip(ends).map(|(a, b)| a * b).sum();
                sum += width * weight * along * along;
            }
        }
        sum * section.axial_force * section.element.length
    }
}

/// Gauss's four points from 0 to 1 and their weights: exact to the seventh power.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// A of the module's text.
fn kinks_per_end_motion(
    section: &Section,
    hinges: &[(f64, f64)],
) -> Result<Vec<[f64; 4]>, StructureError> {
    let count = hinges.len();
    let scale = section.element.bending_stiffness / section.element.length;
    let mut matrix = DMatrix::identity(count, count);
    let mut right = DMatrix::zeros(count, 4);
    for (i, (place, compliance)) in hinges.iter().enumerate() {
        for (j, (other, _)) in hinges.iter().enumerate() {
            matrix[(i, j)] -= compliance * scale * Kink::new(section, *other).moment(*place);
        }
        for (j, moment) in section.moment(*place).iter().enumerate() {
            right[(i, j)] = compliance * moment;
        }
    }
    // The moments of unit kinks form a negative semidefinite matrix, so that there is a solution.
    let solution = matrix
        .lu()
        .solve(&right)
        .ok_or_else(|| StructureError::FiniteElements {
            reason: "the hinges in one element have no solution".to_owned(),
        })?;
    Ok((0..count)
        .map(|i| std::array::from_fn(|j| solution[(i, j)]))
        .collect())
}
