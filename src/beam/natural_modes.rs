//! Natural frequencies: every root of the frequency equation, none missed and none invented.
//!
//! The number of natural frequencies below a trial value is known exactly (Wittrick & Williams
//! 1971), so that no root is missed or taken for another ([`JointedBody::root`]).

use super::interface::{JointWeights, JointedBody, LAST_STEP};
use super::{Assembly, Beam, BeamTheory, JointStiffness, Slenderness, StructureError};
use std::f64::consts::PI;

/// Largest number of modes. No beam bends like a beam at its thousandth mode; the limit only keeps a
/// slip of the hand from running for hours.
pub const MODE_LIMIT: usize = 1000;

/// Symmetry of a lap joint's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// Both halves move alike: the joint is bent and sees Ky only.
    Symmetric,
    /// The halves move oppositely: the joint is sheared and sees Kx only.
    Antisymmetric,
}

/// One natural mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NaturalMode {
    /// Non-dimensional frequency lambda (1), by the whole length of the beam.
    pub lambda: f64,
    /// Its symmetry, for a lap joint.
    pub symmetry: Option<Symmetry>,
}

/// The first `count` non-dimensional frequencies lambda (1) of an Euler beam, ascending.
///
/// Motions at zero frequency are not counted: the two rigid-body motions of a free beam, and one
/// for each spring of a cantilever whose stiffness is exactly zero. A spring of tiny stiffness
/// makes a low mode that does count.
///
/// # Errors
/// [`StructureError`] where the joint cannot exist ([`JointStiffness::check`]), a lap joint is
/// given a cross coupling, or more than [`MODE_LIMIT`] modes are asked for.
pub fn natural_lambdas(
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    let modes = natural_modes(assembly, joint, &Slenderness::EULER, count)?;
    Ok(modes.iter().map(|mode| mode.lambda).collect())
}

/// The first `count` natural frequencies (Hz) of a beam by either theory, ascending.
///
/// # Errors
/// As [`natural_lambdas`], and where the beam cannot exist ([`Beam::check`]).
pub fn natural_frequencies(
    theory: BeamTheory,
    beam: &Beam,
    assembly: Assembly,
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    beam.check()?;
    let modes = natural_modes(assembly, joint, &beam.slenderness(theory), count)?;
    Ok(modes
        .iter()
        .map(|mode| beam.frequency_of(mode.lambda))
        .collect())
}

/// The first `count` natural modes of a beam of this slenderness, ascending.
///
/// # Errors
/// As [`natural_lambdas`].
pub fn natural_modes(
    assembly: Assembly,
    joint: &JointStiffness,
    slenderness: &Slenderness,
    count: usize,
) -> Result<Vec<NaturalMode>, StructureError> {
    check_count(count)?;
    if assembly != Assembly::Free {
        joint.check()?;
    }
    let lambdas = match assembly {
        Assembly::Free => lowest_roots(&JointStiffness::FREE, *slenderness, count),
        Assembly::Cantilever => lowest_roots(joint, *slenderness, count),
        Assembly::Lap if joint.cross_compliance != 0.0 => {
            return Err(StructureError::NoCoupling {
                assembly: "lap joint",
                cross_compliance: joint.cross_compliance,
            });
        }
        Assembly::Lap => return Ok(lap_modes(joint, slenderness, count)),
    };
    let modes = lambdas.into_iter().map(|lambda| NaturalMode {
        lambda,
        symmetry: None,
    });
    Ok(modes.collect())
}

/// The first `count` lambda (1) of an Euler cantilever on any joint, physical or not.
///
/// An estimate need not be a joint that can exist. Such a joint has motions that grow instead of
/// oscillating; they have no frequency and are left out, so that mode 1 is the first that
/// oscillates.
///
/// # Errors
/// [`StructureError::Stiffness`] where a stiffness is not a number,
/// [`StructureError::TooManyModes`].
pub fn natural_lambdas_of_any_joint(
    joint: &JointStiffness,
    count: usize,
) -> Result<Vec<f64>, StructureError> {
    let values = [
        ("kx", joint.kx),
        ("ky", joint.ky),
        ("1/kz", joint.cross_compliance),
    ];
    if let Some((quantity, value)) = values.into_iter().find(|(_, value)| value.is_nan()) {
        return Err(StructureError::Stiffness { quantity, value });
    }
    check_count(count)?;
    Ok(lowest_roots(joint, Slenderness::EULER, count))
}

fn check_count(count: usize) -> Result<(), StructureError> {
    if count <= MODE_LIMIT {
        return Ok(());
    }
    Err(StructureError::TooManyModes {
        count,
        limit: MODE_LIMIT,
    })
}

/// By symmetry a lap joint is two beams of half the length. Symmetric motion bends the joint: the
/// half's end slides freely and feels Ky, for L/2 and twice the stiffness give Ky again.
/// Antisymmetric motion shears it: the half's end turns freely and feels 2 Kt (L/2)^3 = Kx/4.
fn lap_modes(joint: &JointStiffness, slenderness: &Slenderness, count: usize) -> Vec<NaturalMode> {
    // The n-th modes of both families lie below the (n+1)-th of either, a family without its
    // spring starting one later; hence half of the modes from each, and two to spare.
    let half_count = count / 2 + 2;
    let families = [
        (Symmetry::Symmetric, 0.0, joint.ky),
        (Symmetry::Antisymmetric, joint.kx / 4.0, 0.0),
    ];
    let mut modes = Vec::with_capacity(2 * half_count);
    for (symmetry, kx, ky) in families {
        let half = JointStiffness::two_parameter(kx, ky);
        let lambdas = lowest_roots(&half, slenderness.of_piece(0.5), half_count);
        modes.extend(lambdas.into_iter().map(|lambda| NaturalMode {
            lambda: 2.0 * lambda,
            symmetry: Some(symmetry),
        }));
    }
    modes.sort_by(|a, b| a.lambda.total_cmp(&b.lambda));
    modes.truncate(count);
    modes
}

/// The lowest `count` roots, rigid-body motions and growing ones left out.
fn lowest_roots(joint: &JointStiffness, slenderness: Slenderness, count: usize) -> Vec<f64> {
    let weights = JointWeights::from(joint);
    let body = JointedBody::Rooted(slenderness);
    let first = weights.uncounted() + 1;
    // The n-th root lies between those of the free and of the clamped beam, near (n - 3/2) pi and
    // (n - 1/2) pi.
    (first..first + count)
        .map(|number| {
            let guess = PI * (number as f64 - 0.9);
            body.find_root(&weights, number, guess, LAST_STEP).0
        })
        .collect()
}
