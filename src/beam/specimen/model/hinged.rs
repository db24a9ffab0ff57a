//! An element with hinges inside, condensed exactly: the element takes its static shape under end
//! loads, kinks included, so that nothing jumps when a hinge moves across a node.
//!
//! With the element held at both ends, a unit kink at x_k bends it by kappa_k and causes the moment
//! M_k(x). A hinge of compliance c turns by `alpha = c (moment there)`, the moment being that of the
//! end motions, b v, and of all kinks:
//!
//! ```text
//! alpha = C (B v + M alpha)   =>   alpha = (1 - C M)^-1 C B v = A v,   K = K0 - B^T A.
//! ```

use super::{Section, Square, Weights};
use crate::StructureError;
use crate::specimen::section::slopes;
use nalgebra::DMatrix;

/// An element with its hinges: place within it (0 to 1) and compliance.
#[derive(Debug, Clone)]
pub(super) struct HingedElement {
    pub(super) run: usize,
    pub(super) index: usize,
    pub(super) hinges: Vec<(f64, f64)>,
    /// A: kink of each hinge for a unit of each end motion.
    kinks: Vec<[f64; 4]>,
    pub(super) stiffness: Square,
    pub(super) mass: Square,
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
    pub(super) fn new(
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
    pub(super) fn add_weights(&self, section: &Section, x: f64, weights: &mut Weights) {
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
    pub(super) fn strain_energy(&self, section: &Section, ends: &[f64; 4]) -> f64 {
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
