//! A structure of finite elements seen from its joint.

use super::StructureError;
use super::eigen::{BEAM_ROW, BandedMatrix, Eigenpairs, dot, failure, pairs_for_forces};
use super::interface::{AcrossFunctions, Coefficients, InterfaceFunctions};
use super::specimen::model::{Model, Place};
use super::specimen::modes::SHIFT;
use super::specimen::numbering::{ACROSS, Motion};
use super::specimen::{Body, Specimen};
use nalgebra::{DMatrix, SymmetricEigen};
use std::ops::{Add, Mul, Sub};

/// All modes of a structure without its joint, by finite elements.
///
/// The joint touches three motions only: displacement, rotation, and curling across the width. With a joint the
/// frequencies lie where compliance and receptance of these motions cancel. The receptance is
/// the sum over the lowest modes of the model without joint, and over motions that stand for all
/// higher ones: nothing is truncated, and one decomposition serves every joint. What elements miss of their own inertia
/// is added to second order among these motions (`SecondOrder`).
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceModes {
    /// Squares of the natural frequencies, in units of lambda^4 (1), ascending.
    squares: Vec<f64>,
    /// Motion of every mode at the joint: displacement, rotation -dw/dx, and curvature across the width; of a
    /// lap joint right minus left.
    joint: Vec<[f64; 3]>,
    /// Stiffness of the joint against curvature across the width over its Kx (1); 0 where nothing resists it.
    across_ratio: f64,
    /// Static receptance beside the modes. Curling has no inertia, so that modes miss most of it, and what higher modes
    /// add to it is nearly static.
    beyond: [[f64; 3]; 3],
    masses: Vec<Attachment>,
    springs: Vec<Attachment>,
    rigid_modes: usize,
    pub(super) uncounted: usize,
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
    /// [`StructureError`] where a part of the specimen cannot exist, or with resonators.
    pub fn new(
        specimen: &Specimen,
        elements: usize,
        highest: usize,
    ) -> Result<Self, StructureError> {
        if !specimen.resonators.is_empty() {
            return Err(failure(
                "no resonators stand on a structure that is seen from its joint",
            ));
        }
        let free = Specimen {
            joint: None,
            ..specimen.clone()
        };
        let model = Model::new(&free, &vec![elements; free.body.beams().len()])?;
        let (stiffness, mass) = model.matrices::<BEAM_ROW>();
        // The lowest mode left out then has about four times the highest frequency.
        let count = 2 * highest + 10;
        let forces = [0, 1].map(|component| model.joint_load(component));
        let rigid = model.locked_motions();
        let mut pairs = pairs_for_forces(
            [&stiffness, &mass],
            SHIFT,
            model.highest_square(),
            &rigid,
            count,
            &forces,
        )?;
        // The shift leaves some 1e-9 of itself, beside which a weak spring would be nothing.
        let rigid = rigid.len().min(pairs.values.len());
        pairs.values[..rigid].fill(0.0);
        // Motions that only rounding gives an inertia.
        let most = 1e3 * model.highest_square();
        let moving = pairs.values.partition_point(|square| *square < most);
        pairs.values.truncate(moving);
        pairs.vectors.truncate(moving);
        let second_order = SecondOrder::of(&pairs, &model.second_order_matrix())?;
        let vectors = pairs.vectors.iter();
        let motions: Vec<Motion> = vectors
            .map(|vector| model.numbering.motion(vector))
            .collect();
        let joint: Vec<[f64; 3]> = motions
            .iter()
            .map(|motion| {
                let [w, theta] = model.joint_motion(motion);
                [w, -theta, model.joint_curling(motion)]
            })
            .collect();
        let mut beyond = [[0.0; 3]; 3];
        for index in 0..pairs.values.len() {
            let motion = [0, 1, 2].map(|i| second_order.fixed(index, |row| joint[row][i]));
            for (row, a) in beyond.iter_mut().zip(motion) {
                for (entry, b) in row.iter_mut().zip(motion) {
                    *entry += a * b;
                }
            }
        }
        let mut squares = second_order.squares.clone();
        squares[..rigid].fill(0.0);
        let joint: Vec<[f64; 3]> = (0..squares.len())
            .map(|index| [0, 1, 2].map(|i| second_order.moving(index, |row| joint[row][i])))
            .collect();
        // The pairs exist, and so does this factor.
        if model.across_ratio > 0.0
            && let Some(factor) = stiffness.plus(SHIFT, &mass).cholesky()
        {
            let load = model.joint_load(ACROSS);
            let mut answer = load.clone();
            factor.solve_lower(&mut answer);
            factor.solve_upper(&mut answer);
            beyond[ACROSS][ACROSS] = dot(&load, &answer);
            for (square, motion) in squares.iter().zip(&joint) {
                beyond[ACROSS][ACROSS] -= motion[ACROSS].powi(2) / (square + SHIFT);
            }
        }
        let attached = |size: f64, place: &Place| {
            let plain = Attachment::new(size, place, &motions).motion;
            let motion =
                (0..squares.len()).map(|index| second_order.moving(index, |row| plain[row]));
            Attachment {
                size,
                motion: motion.collect(),
            }
        };
        let masses = model.masses.iter();
        let masses = masses
            .map(|item| attached(item.mass, &item.place))
            .collect();
        let springs = model.springs.iter();
        let springs = springs
            .map(|item| attached(item.stiffness, &item.place))
            .collect();
        Ok(Self {
            squares,
            joint,
            beyond,
            masses,
            springs,
            across_ratio: model.across_ratio,
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
    /// ratio `load`: the mode's shape is the sum of phi (phi . load)/(omega_i^2 - omega^2). `translation` is the
    /// joint's 1/Kx.
    pub fn attachment_sensitivity(
        &self,
        lambda: f64,
        load: [f64; 2],
        translation: f64,
    ) -> [f64; 2] {
        if self.masses.is_empty() && self.springs.is_empty() {
            return [0.0; 2];
        }
        let square = lambda.powi(4);
        let free = self.squares.iter().zip(&self.joint);
        let mut weights: Vec<f64> = free
            .map(|(free, phi)| (phi[0] * load[0] + phi[1] * load[1]) / (free - square))
            .collect();
        if self.across_ratio > 0.0 {
            // The springs' load on the curvature across the width follows from the other two.
            let compliance = translation / self.across_ratio;
            let (mut curling, mut receptance) = (0.0, compliance + self.beyond[ACROSS][ACROSS]);
            let modes = self.squares.iter().zip(&self.joint);
            for ((free, phi), weight) in modes.clone().zip(&weights) {
                curling += phi[ACROSS] * weight;
                receptance += phi[ACROSS].powi(2) / (free - square);
            }
            let load = -curling / receptance;
            for ((free, phi), weight) in modes.zip(&mut weights) {
                *weight += phi[ACROSS] * load / (free - square);
            }
        }
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
    /// With d = distance, that frequency's motion v at the joint and the rest of the receptance eta: P = d,
    /// X = d eta11 + v1^2 and likewise, Q = d det(eta) + v^T adj(eta) v. The curvature across the width makes these
    /// functions anew, with one row and column more in each determinant.
    pub(super) fn functions(&self, lambda: f64) -> InterfaceFunctions {
        let square = lambda.powi(4);
        let below = self.squares.partition_point(|free| *free < square);
        let last = self.squares.len() - 1;
        let (low, high) = (below.saturating_sub(1).min(last), below.min(last));
        let low_is_nearer =
            (self.squares[low] - square).abs() < (self.squares[high] - square).abs();
        let nearest = if low_is_nearer { low } else { high };
        let receptance = self.receptance_beside(nearest, square);
        let rise = 4.0 * lambda.powi(3);
        let free_end = receptance.functions().map(|entry| entry.value);
        let slopes = receptance.functions().map(|entry| entry.slope);
        let across = (self.across_ratio > 0.0).then(|| {
            let held = receptance.functions_held_across();
            AcrossFunctions {
                ratio: self.across_ratio,
                values: Coefficients::from(held.map(|entry| entry.value)),
                slopes: Coefficients::from(held.map(|entry| entry.slope)).scaled(rise),
            }
        });
        InterfaceFunctions {
            lambda,
            values: Coefficients::from(free_end),
            slopes: Coefficients::from(slopes).scaled(rise),
            free_count: below,
            across,
        }
    }

    /// Receptance at an omega^2, the nearest mode apart.
    fn receptance_beside(&self, nearest: usize, square: f64) -> Receptance {
        let rows = if self.across_ratio > 0.0 { 3 } else { 2 };
        let fixed = |value| Dual { value, slope: 0.0 };
        let mut rest = self.beyond.map(|row| row.map(fixed));
        for (index, (free, motion)) in self.squares.iter().zip(&self.joint).enumerate() {
            if index == nearest {
                continue;
            }
            let inverse = 1.0 / (free - square);
            for (row, a) in rest.iter_mut().zip(motion).take(rows) {
                for (entry, b) in row.iter_mut().zip(motion).take(rows) {
                    let term = a * b * inverse;
                    entry.value += term;
                    entry.slope += term * inverse;
                }
            }
        }
        Receptance {
            distance: Dual {
                value: self.squares[nearest] - square,
                slope: -1.0,
            },
            motion: self.joint[nearest].map(fixed),
            rest,
        }
    }
}

/// The motions of a model anew, with what omega^4 adds.
///
/// With unit modal masses and S = V V^T among the motions their equation is (D - omega^2 - omega^4 S) q = f. With
/// p = omega^2 V^T q it is linear in omega^2, of twice the size:
///
/// ```text
/// ( [D 0; 0 1] - omega^2 [1 V; V^T 0] ) [q; p] = [f; 0].
/// ```
///
/// Half of its eigenvalues are the squares of frequencies. The others are negative, and so far away that their share of a
/// receptance is static.
struct SecondOrder {
    squares: Vec<f64>,
    /// Columns: each motion in terms of those before, of unit modal mass.
    moving: DMatrix<f64>,
    /// Columns: what remains, by its static receptance.
    fixed: DMatrix<f64>,
}

impl SecondOrder {
    fn of(pairs: &Eigenpairs, second_order: &BandedMatrix) -> Result<Self, StructureError> {
        let count = pairs.values.len();
        let loads: Vec<Vec<f64>> = pairs
            .vectors
            .iter()
            .map(|vector| second_order.times(vector))
            .collect();
        let among = DMatrix::from_fn(count, count, |row, column| {
            0.5 * (dot(&pairs.vectors[row], &loads[column])
                + dot(&pairs.vectors[column], &loads[row]))
        });
        let among = eigen_of(among)?;
        let mut inertia = DMatrix::zeros(2 * count, 2 * count);
        let mut stiffness = DMatrix::identity(2 * count, 2 * count);
        for row in 0..count {
            inertia[(row, row)] = 1.0;
            stiffness[(row, row)] = pairs.values[row];
            for column in 0..count {
                let root = among.eigenvalues[column].max(0.0).sqrt();
                let entry = among.eigenvectors[(row, column)] * root;
                inertia[(row, count + column)] = entry;
                inertia[(count + column, row)] = entry;
            }
        }
        let mut lower = (&stiffness + SHIFT * &inertia).cholesky();
        if lower.is_none() {
            // Masses far heavier than an element: their second order is no small addition, and is left out.
            inertia = DMatrix::zeros(2 * count, 2 * count);
            inertia
                .view_mut((0, 0), (count, count))
                .fill_with_identity();
            lower = (&stiffness + SHIFT * &inertia).cholesky();
        }
        let lower =
            lower.ok_or_else(|| failure("the stiffness matrix is not positive definite"))?;
        let lower = lower.l();
        let half = lower.solve_lower_triangular(&inertia);
        let inverse = half.and_then(|half| lower.solve_lower_triangular(&half.transpose()));
        let inverse = inverse.ok_or_else(|| failure("the stiffness matrix is nearly singular"))?;
        let eigen = eigen_of(0.5 * (&inverse + inverse.transpose()))?;
        let vectors = lower.tr_solve_lower_triangular(&eigen.eigenvectors);
        let vectors = vectors.ok_or_else(|| failure("the stiffness matrix is nearly singular"))?;
        let mut order: Vec<usize> = (0..2 * count).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let inverses = eigen.eigenvalues;
        let moving = DMatrix::from_fn(count, count, |row, column| {
            vectors[(row, order[column])] / inverses[order[column]].sqrt()
        });
        let fixed = DMatrix::from_fn(count, count, |row, column| {
            vectors[(row, order[count + column])]
        });
        let squares = order[..count].iter();
        Ok(Self {
            squares: squares.map(|&i| 1.0 / inverses[i] - SHIFT).collect(),
            moving,
            fixed,
        })
    }

    /// Value of a new motion, from those of the motions before.
    fn moving(&self, index: usize, value: impl Fn(usize) -> f64) -> f64 {
        let column = self.moving.column(index);
        column
            .iter()
            .enumerate()
            .map(|(row, share)| share * value(row))
            .sum()
    }

    /// The same of a part that is static.
    fn fixed(&self, index: usize, value: impl Fn(usize) -> f64) -> f64 {
        let column = self.fixed.column(index);
        column
            .iter()
            .enumerate()
            .map(|(row, share)| share * value(row))
            .sum()
    }
}

fn eigen_of(matrix: DMatrix<f64>) -> Result<SymmetricEigen<f64, nalgebra::Dyn>, StructureError> {
    SymmetricEigen::try_new(matrix, f64::EPSILON, 10_000)
        .ok_or_else(|| failure("its eigenvalues did not settle"))
}

/// A number and its derivative with omega^2.
#[derive(Debug, Clone, Copy, Default)]
struct Dual {
    value: f64,
    slope: f64,
}

impl Add for Dual {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        }
    }
}

impl Sub for Dual {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            slope: self.slope - other.slope,
        }
    }
}

impl Mul for Dual {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        }
    }
}

/// Receptance `rest + motion motion^T/distance` of displacement, rotation and curvature across the width.
struct Receptance {
    distance: Dual,
    motion: [Dual; 3],
    rest: [[Dual; 3]; 3],
}

impl Receptance {
    /// distance times one entry.
    fn entry(&self, row: usize, column: usize) -> Dual {
        self.distance * self.rest[row][column] + self.motion[row] * self.motion[column]
    }

    /// distance times the determinant of two rows and two columns.
    fn minor(&self, [i, j]: [usize; 2], [k, l]: [usize; 2]) -> Dual {
        let (v, r) = (&self.motion, &self.rest);
        self.distance * (r[i][k] * r[j][l] - r[i][l] * r[j][k])
            + (v[i] * v[k] * r[j][l] + v[j] * v[l] * r[i][k])
            - (v[i] * v[l] * r[j][k] + v[j] * v[k] * r[i][l])
    }

    /// P, X, Y, Z, Q where nothing resists curvature across the width.
    fn functions(&self) -> [Dual; 5] {
        [
            self.distance,
            self.entry(0, 0),
            self.entry(1, 1),
            self.entry(0, 1),
            self.minor([0, 1], [0, 1]),
        ]
    }

    /// P, X, Y, Z, Q where it is held.
    fn functions_held_across(&self) -> [Dual; 5] {
        let (v, r) = (&self.motion, &self.rest);
        // distance times the whole determinant, by the third row; both parts of that row in turn.
        let cofactor = |columns: [usize; 2]| {
            let [k, l] = columns;
            r[0][k] * r[1][l] - r[0][l] * r[1][k]
        };
        let determinant = r[2][0] * self.minor([0, 1], [1, 2])
            - r[2][1] * self.minor([0, 1], [0, 2])
            + r[2][2] * self.minor([0, 1], [0, 1])
            + v[2] * (v[0] * cofactor([1, 2]) - v[1] * cofactor([0, 2]) + v[2] * cofactor([0, 1]));
        [
            self.entry(2, 2),
            self.minor([0, 2], [0, 2]),
            self.minor([1, 2], [1, 2]),
            self.minor([0, 2], [1, 2]),
            determinant,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::{JointedBody, LAST_STEP};
    use crate::specimen::{LapLayout, PointMass};
    use crate::{Assembly, Beam, BeamTheory};
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
                    // What is left out of the motions, of their second order and of the curling at a rigid joint, and
                    // the rounding of the dense matrix.
                    assert!(
                        off.abs() < 5e-8,
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
