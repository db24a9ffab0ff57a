//! All modes of the structure without its joint, and what they say of any joint put in.
//!
//! The joint touches two motions only, so that the finite-element model with any joint has the
//! frequencies at which compliance and receptance of those two motions cancel. The receptance is
//! the sum over all modes of the model without joint: nothing is truncated, and one decomposition
//! serves every joint.

use super::{FiniteElementModel, Place};
use crate::banded::all_modes;
use crate::interface::{Coefficients, InterfaceFunctions};
use crate::{Assembly, Beam, BeamTheory, JointStiffness, StructureError};

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
