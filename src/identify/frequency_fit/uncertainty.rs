//! Uncertainty beyond the readings: inputs that the fit does not move, and what the model itself misses.
//!
//! An uncertain property of the beam is a parameter of the fit with a prior. An attached mass or its place is none: to
//! first order it changes every frequency by a known share. Such an input u of standard normal distribution adds t u
//! to the residuals, so that their covariance becomes
//!
//! ```text
//! C = diag(reading^2 + discrepancy^2) + T T^T        (1, relative)
//! ```
//!
//! which is the fit with u as a parameter (JCGM 102:2011, 6.2).
//!
//! The discrepancy is the error of the model itself, drawn anew for each mode. Its size d is unknown. It has the prior
//! density d^-2.5 between [`LEAST_DISCREPANCY`] and [`MOST_DISCREPANCY`]: one model in three misses by more than twice the least, one in thirty by more than ten times.
//! The residuals give its posterior by the likelihood over all parameters (Laplace's approximation about the fit).
//! The fit takes the one size whose normal distribution has the 95 % interval of the mixture over all sizes.

use super::model::{JointedStructure, Parameter, Point};
use super::problem::{Evaluation, Problem, dot};
use super::{Limit, Quantity, limit_of};
use nalgebra::{DMatrix, DVector};
use tapjoint_beam::Joint;
use tapjoint_beam::specimen::Mesh;
use tapjoint_numerics::stats::{NORMAL_95, chi_square_tail};

/// Least discrepancy of any model (1, relative): what uniform bars of well-kept dimensions leave.
pub const LEAST_DISCREPANCY: f64 = 5e-4;
/// Largest discrepancy that is still called an uncertainty: beyond it the model is another structure's.
pub const MOST_DISCREPANCY: f64 = 0.5;

/// Standard uncertainty of the hold of the width (1) about 0, that of springs over the width.
///
/// A joint that grips the whole width holds it anywhere between 0 and 1: a mean of 0.5, and a standard deviation of 0.29 about
/// it. The model stays at 0, as prediction, diagnosis and simulation do, and a joint that grips the middle alone lies below
/// it. The uncertainty is therefore the root mean square of that range, sqrt(0.5^2 + 0.29^2).
pub const WIDTH_HOLD_STD: f64 = 0.58;

/// What contributes to the uncertainty of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub enum BudgetInput {
    /// The readings of the frequencies.
    Readings,
    /// What the model itself misses.
    Discrepancy,
    /// A stated property of the beam.
    Property(Parameter),
    /// The mass of the beam by a balance.
    Weighing,
    /// Mass or place of something attached, by name.
    Attachment(String),
    /// Poisson's ratio.
    Poisson,
    /// How the joint holds the section across the width.
    WidthHold,
    /// Differences between set-ups.
    SetUps,
    /// Several modes, one of which does not belong to the others.
    OutlyingMode,
}

impl BudgetInput {
    /// Name as in reports.
    pub fn name(&self) -> &str {
        match self {
            Self::Readings => "readings",
            Self::Discrepancy => "discrepancy",
            Self::Property(parameter) => parameter.name(),
            Self::Weighing => "weighing",
            Self::Attachment(name) => name,
            Self::Poisson => "poisson",
            Self::WidthHold => "hold of the width",
            Self::SetUps => "set-ups",
            Self::OutlyingMode => "outlying mode",
        }
    }
}

/// An uncertain property of the description after the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionPull {
    /// The property.
    pub input: BudgetInput,
    /// Value that the description states (SI).
    pub stated: f64,
    /// Value that the fit gives it (SI).
    pub fitted: f64,
    /// Their difference in standard uncertainties of the description.
    pub pull: f64,
}

/// Standard uncertainties of an attached mass.
#[derive(Debug, Clone, PartialEq)]
pub struct AttachmentTolerance {
    /// Name in the budget: that of the sensor, or of what is fastened.
    pub name: String,
    /// Standard uncertainty of its mass (kg).
    pub mass: f64,
    /// Standard uncertainty of its place (m).
    pub position: f64,
}

/// An input that the fit does not move.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct UncertainInput {
    /// What it is in the budget.
    pub(super) input: BudgetInput,
    /// True for a mass, which a balance tells.
    pub(super) is_mass: bool,
    /// Value that the description states (SI).
    pub(super) stated: f64,
    /// Standard uncertainty (SI).
    pub(super) std: f64,
    /// Relative change of each frequency (1) by one standard uncertainty.
    pub(super) changes: Vec<f64>,
}

/// Returns the inputs that the masses on a structure are: the mass and the place of each, where they are uncertain and
/// change a frequency. `tolerances` are in the order of its masses, `modes` are the numbers of the structure's modes, `joint` is near the fitted one.
pub(super) fn attachment_inputs(
    structure: &JointedStructure,
    joint: Option<Joint>,
    modes: &[usize],
    tolerances: &[AttachmentTolerance],
) -> Vec<UncertainInput> {
    let specimen = structure.specimen(joint);
    let count = modes.iter().copied().max().unwrap_or(0);
    let mut inputs = Vec::new();
    // A structure that cannot be solved has no estimate either; its error is told there.
    let Ok(shapes) = specimen.modes(count, Mesh::DIAGNOSIS) else {
        return inputs;
    };
    let length = structure.beam.length;
    for (index, tolerance) in tolerances.iter().enumerate().take(specimen.masses.len()) {
        let at = specimen.masses[index];
        if at.mass == 0.0 {
            continue;
        }
        let mut heavier = specimen.clone();
        heavier.masses[index].mass += tolerance.mass;
        // At the end of the beam a mass can move to one side only.
        let inward = if at.position + tolerance.position > length {
            -1.0
        } else {
            1.0
        };
        let mut moved = specimen.clone();
        let there = at.position + inward * tolerance.position;
        moved.masses[index].position = there.clamp(0.0, length);
        let changed = [
            (true, at.mass, tolerance.mass, 1.0, heavier),
            (false, at.position, tolerance.position, inward, moved),
        ];
        for (is_mass, stated, std, sign, other) in changed {
            let Ok(frequencies) = shapes.rayleigh_frequencies(&other) else {
                continue;
            };
            let changes: Vec<f64> = modes
                .iter()
                .map(|mode| sign * (frequencies[mode - 1] / shapes.frequencies()[mode - 1] - 1.0))
                .collect();
            let name = match is_mass {
                true => format!("mass of {}", tolerance.name),
                false => format!("position of {}", tolerance.name),
            };
            if std > 0.0 && changes.iter().any(|change| *change != 0.0) {
                inputs.push(UncertainInput {
                    input: BudgetInput::Attachment(name),
                    is_mass,
                    stated,
                    std,
                    changes,
                });
            }
        }
    }
    inputs
}

/// Returns the inputs that the width is: Poisson's ratio, and how the joint holds the section across the width. Empty where
/// the model takes no notice of the width.
///
/// The model spreads the joint's springs over the width (hold 0). A clamp that keeps the slope gives the frequencies of
/// `Specimen::clamp_differences` (hold 1).
pub(super) fn width_inputs(
    structure: &JointedStructure,
    joint: Option<Joint>,
    modes: &[usize],
    poisson: f64,
) -> Vec<UncertainInput> {
    let specimen = structure.specimen(joint);
    let count = modes.iter().copied().max().unwrap_or(0);
    let mut inputs = Vec::new();
    if poisson == 0.0 || !structure.beam.is_stiffened(structure.theory) {
        return inputs;
    }
    let stated = structure.beam.poisson;
    // No isotropic solid reaches 0.5.
    let sign = if stated + poisson < 0.5 { 1.0 } else { -1.0 };
    let mut other = specimen.clone();
    for beam in other.body.beams_mut() {
        beam.poisson += sign * poisson;
    }
    let both = [&specimen, &other].map(|specimen| specimen.modes(count, Mesh::DIAGNOSIS));
    if let [Ok(own), Ok(other)] = &both {
        let (own, other) = (own.frequencies(), other.frequencies());
        let changes = modes
            .iter()
            .map(|mode| sign * (other[mode - 1] / own[mode - 1] - 1.0));
        inputs.push(UncertainInput {
            input: BudgetInput::Poisson,
            is_mass: false,
            stated,
            std: poisson,
            changes: changes.collect(),
        });
    }
    let differences = specimen.clamp_differences(count, Mesh::DIAGNOSIS);
    if let Ok(differences) = differences
        && differences.iter().any(|difference| *difference != 0.0)
    {
        inputs.push(UncertainInput {
            input: BudgetInput::WidthHold,
            is_mass: false,
            stated: 0.0,
            std: WIDTH_HOLD_STD,
            changes: modes
                .iter()
                .map(|mode| WIDTH_HOLD_STD * differences[mode - 1])
                .collect(),
        });
    }
    inputs
}

/// Returns the joint at a point in SI; a spring at the rigid end of its range is rigid.
pub(super) fn joint_near(point: &Point) -> Joint {
    let rigid = [Quantity::Kx, Quantity::Ky]
        .map(|quantity| limit_of(quantity, point) == Some(Limit::Rigid));
    let [kt, kr, coupling, ..] = *point;
    Joint {
        kt: if rigid[0] { f64::INFINITY } else { kt.exp() },
        kr: if rigid[1] { f64::INFINITY } else { kr.exp() },
        coupling: if rigid.contains(&true) {
            0.0
        } else {
            coupling.tanh()
        },
    }
}

/// Returns the triangle W with W C W^T = 1 for the covariance C of standardised residuals with these inputs; `None` where
/// there are none.
pub(super) fn whitening(inputs: &[DVector<f64>], count: usize) -> Option<DMatrix<f64>> {
    if inputs.is_empty() {
        return None;
    }
    let mut covariance = DMatrix::identity(count, count);
    for input in inputs {
        covariance += input * input.transpose();
    }
    covariance.cholesky()?.l().try_inverse()
}

/// Size of the discrepancy (1, relative) that the residuals at a point ask for. `readings` are the relative standard
/// uncertainties of the frequencies, `inputs` the relative changes by the inputs.
pub(super) fn discrepancy(
    problem: &Problem<'_>,
    at: &Evaluation,
    directions: &[Point],
    readings: &[f64],
    inputs: &[&[f64]],
) -> f64 {
    const STEP: f64 = 1.2;
    let mut sizes = vec![LEAST_DISCREPANCY];
    while sizes[sizes.len() - 1] < MOST_DISCREPANCY {
        sizes.push(STEP * sizes[sizes.len() - 1]);
    }
    let logs: Option<Vec<f64>> = sizes
        .iter()
        .map(|size| {
            let likelihood = log_likelihood(problem, at, directions, readings, inputs, *size)?;
            // The prior density d^-2.5 on a grid of ln d.
            Some(likelihood - 1.5 * size.ln())
        })
        .collect();
    let Some(logs) = logs else {
        return LEAST_DISCREPANCY;
    };
    let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut weights: Vec<f64> = logs.iter().map(|log| (log - largest).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    // Bisection for the end of the mixture's 95 % interval.
    let (mut low, mut high) = (NORMAL_95 * sizes[0], NORMAL_95 * sizes[sizes.len() - 1]);
    for _ in 0..60 {
        let end = 0.5 * (low + high);
        let outside: f64 = sizes
            .iter()
            .zip(&weights)
            .map(|(size, weight)| weight * chi_square_tail((end / size).powi(2), 1.0))
            .sum();
        if outside > 0.05 {
            low = end
        } else {
            high = end
        }
    }
    low / NORMAL_95
}

/// Returns the logarithm of the likelihood of the residuals over all parameters, but for a constant; `None` where it is no
/// number. The model is linear about the point.
fn log_likelihood(
    problem: &Problem<'_>,
    at: &Evaluation,
    directions: &[Point],
    readings: &[f64],
    inputs: &[&[f64]],
    size: f64,
) -> Option<f64> {
    // What keeps a parameter that no frequency feels from spoiling the determinant.
    const RIDGE: f64 = 1e-6;
    let (count, columns) = (problem.data.len(), directions.len());
    let mut covariance = DMatrix::from_diagonal(&DVector::from_iterator(
        count,
        readings
            .iter()
            .map(|reading| reading * reading + size * size),
    ));
    for input in inputs {
        let input = DVector::from_column_slice(input);
        covariance += &input * input.transpose();
    }
    let triangle = covariance.cholesky()?.l();
    let rows = count + problem.priors.len() + columns;
    let mut matrix = DMatrix::zeros(rows, columns);
    let mut residuals = DVector::zeros(rows);
    let mut errors = DVector::zeros(count);
    let mut slopes = DMatrix::zeros(count, columns);
    for (row, (datum, response)) in problem.data.iter().zip(&at.responses).enumerate() {
        errors[row] = response.frequency / datum.frequency - 1.0;
        for (column, direction) in directions.iter().enumerate() {
            slopes[(row, column)] = dot(&response.sensitivity, direction);
        }
    }
    residuals
        .rows_mut(0, count)
        .copy_from(&triangle.solve_lower_triangular(&errors)?);
    matrix
        .rows_mut(0, count)
        .copy_from(&triangle.solve_lower_triangular(&slopes)?);
    // The residuals of priors follow those of the modes.
    for prior in 0..problem.priors.len() {
        residuals[count + prior] = at.residuals[count + prior];
        for (column, direction) in directions.iter().enumerate() {
            matrix[(count + prior, column)] = dot(&at.jacobian[count + prior], direction);
        }
    }
    for column in 0..columns {
        matrix[(count + problem.priors.len() + column, column)] = RIDGE;
    }
    let factors = matrix.qr();
    let along = factors.q().transpose() * &residuals;
    let misfit = residuals.norm_squared() - along.norm_squared();
    let of_covariance: f64 = triangle.diagonal().iter().map(|entry| entry.ln()).sum();
    let of_parameters: f64 = factors
        .r()
        .diagonal()
        .iter()
        .map(|entry| entry.abs().ln())
        .sum();
    let log = -0.5 * misfit.max(0.0) - of_covariance - of_parameters;
    log.is_finite().then_some(log)
}
