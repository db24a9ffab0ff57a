//! What these frequencies can tell and what they cannot.

use super::covariance::Covariance;
use super::estimate::Finished;
use super::model::{Parameter, Point};
use super::problem::along;
use super::result::Limit;
use super::settings::ResidualWeights;
use nalgebra::{DMatrix, SVD};
use tapjoint_numerics::stats::median;

/// A combination of parameters known no better than this (1, relative) is called flat: a factor of
/// two either way is within its 95 % interval.
const FLAT: f64 = 0.35;
/// A parameter that even alone, all others known, is known no better than this is called dead.
const DEAD: f64 = 1.0;
/// Relative accuracy of the usual reading where none is stated: half a line of 800 in a band whose
/// middle the mode is in.
const USUAL_ACCURACY: f64 = 1e-3;
/// A stiffness counts as measurable when its standard uncertainty is this part of it.
const MEASURABLE: f64 = 0.1;
/// Shares below this part of the largest are left out of a sentence.
const NEGLIGIBLE: f64 = 0.05;

/// A combination of parameters that the frequencies hardly feel.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatDirection {
    /// The combination: a change of each parameter's logarithm (of the coupling: of its atanh).
    pub direction: Vec<(Parameter, f64)>,
    /// Standard uncertainty along it (1); `None` where nothing is known.
    pub std: Option<f64>,
    /// In a sentence.
    pub words: String,
}

/// What one more mode would bring.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraMode {
    /// Its number.
    pub mode: usize,
    /// Where it is predicted (Hz).
    pub frequency: f64,
    /// Relative standard uncertainty (1) assumed for it: the median of the measured ones.
    pub relative_std: f64,
    /// Standard uncertainty of each estimated parameter with it (1, of the logarithm; of the
    /// coupling: of its atanh), `None` where nothing is known.
    pub stds: Vec<Option<f64>>,
}

/// From what accuracy of all frequencies on a parameter is measurable to 10 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeededAccuracy {
    /// Which parameter; the coupling is measurable when its standard uncertainty is 0.1.
    pub parameter: Parameter,
    /// Relative standard uncertainty (1) of every frequency that does; `None` where none does.
    pub relative_std: Option<f64>,
}

/// The report.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Singular values of the Jacobian (residuals in standard deviations, parameters as
    /// logarithms), descending: the inverse of each is the uncertainty of one combination.
    pub singular_values: Vec<f64>,
    /// Largest over smallest.
    pub condition: Option<f64>,
    /// Parameters that no frequency feels, whatever the others are.
    pub dead: Vec<Parameter>,
    /// Combinations that they hardly feel.
    pub flat: Vec<FlatDirection>,
    /// Parameters at the end of their range.
    pub at_limit: Vec<(Parameter, Limit)>,
    /// What the missing modes below the highest and the next above it would bring.
    pub extra_modes: Vec<ExtraMode>,
    /// What accuracy each parameter asks for.
    pub needed: Vec<NeededAccuracy>,
}

pub(super) fn identifiability(finished: &Finished<'_>) -> Identifiability {
    let fit = &finished.estimator.settings.fit;
    // Without stated uncertainties misfits stand in units of the frequency: taken for usual ones.
    let unit = match finished.estimator.settings.weights {
        ResidualWeights::Measured => 1.0,
        ResidualWeights::Relative => 1.0 / USUAL_ACCURACY,
    };
    let jacobian: Vec<Point> = finished
        .best
        .at
        .jacobian
        .iter()
        .map(|row| row.map(|slope| unit * slope))
        .collect();
    let (singular_values, directions) = decompose(&jacobian, fit);
    let (largest, smallest) = (singular_values.first(), singular_values.last());
    Identifiability {
        condition: largest
            .zip(smallest)
            .map(|(largest, smallest)| largest / smallest)
            .filter(|condition| condition.is_finite()),
        dead: dead(&jacobian, fit),
        flat: flat(&singular_values, &directions, fit),
        at_limit: finished.limits(),
        extra_modes: extra_modes(finished, &jacobian, unit),
        needed: needed(finished),
        singular_values,
    }
}

/// Singular values, descending, and their directions in parameter space.
fn decompose(jacobian: &[Point], fit: &[Parameter]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let rows = jacobian.len().max(fit.len());
    let matrix = DMatrix::from_fn(rows, fit.len(), |row, column| {
        jacobian
            .get(row)
            .map_or(0.0, |slopes| slopes[fit[column].index()])
    });
    let Some(svd) = SVD::try_new(matrix, false, true, f64::EPSILON, 1000) else {
        return (Vec::new(), Vec::new());
    };
    let Some(vectors) = svd.v_t else {
        return (Vec::new(), Vec::new());
    };
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    let directions = order
        .iter()
        .map(|&row| vectors.row(row).iter().copied().collect())
        .collect();
    let values = order.iter().map(|&i| svd.singular_values[i]).collect();
    (values, directions)
}

fn dead(jacobian: &[Point], fit: &[Parameter]) -> Vec<Parameter> {
    let alone = |parameter: &&Parameter| {
        let column = parameter.index();
        let squares: f64 = jacobian.iter().map(|row| row[column].powi(2)).sum();
        squares.sqrt() * DEAD < 1.0
    };
    fit.iter().filter(alone).copied().collect()
}

fn flat(values: &[f64], directions: &[Vec<f64>], fit: &[Parameter]) -> Vec<FlatDirection> {
    let mut found = Vec::new();
    for (index, (value, direction)) in values.iter().zip(directions).enumerate() {
        if value * FLAT >= 1.0 {
            continue;
        }
        let words = match (fit.len(), index) {
            // With two parameters the other direction says it more plainly.
            (2, 1) => determined_words(&directions[0], fit, value.recip()),
            _ => flat_words(direction, fit, value.recip()),
        };
        found.push(FlatDirection {
            direction: fit.iter().copied().zip(direction.iter().copied()).collect(),
            std: Some(value.recip()).filter(|std| *std < super::covariance::NOTHING_KNOWN),
            words,
        });
    }
    found
}

/// "only kt * kr^0.30 is determined".
fn determined_words(direction: &[f64], fit: &[Parameter], std: f64) -> String {
    let largest = largest_part(direction);
    let mut product = String::new();
    for (parameter, part) in fit.iter().zip(direction) {
        let exponent = part / largest;
        if exponent.abs() > NEGLIGIBLE {
            let sign = match (product.is_empty(), exponent > 0.0) {
                (true, true) => "",
                (true, false) => "1 / ",
                (false, true) => " * ",
                (false, false) => " / ",
            };
            product += sign;
            product += &power(*parameter, exponent.abs());
        }
    }
    format!(
        "only {product} is determined; across it the estimate is open by {}",
        factor_words(std)
    )
}

/// "kt +10 % with kr -3 % together change hardly any frequency".
fn flat_words(direction: &[f64], fit: &[Parameter], std: f64) -> String {
    let largest = largest_part(direction);
    let changes: Vec<String> = fit
        .iter()
        .zip(direction)
        .map(|(parameter, part)| (parameter, part / largest))
        .filter(|(_, share)| share.abs() > NEGLIGIBLE)
        .map(|(parameter, share)| change(*parameter, share))
        .collect();
    format!(
        "{} together change hardly any frequency; along this the estimate is open by {}",
        changes.join(" with "),
        factor_words(std)
    )
}

/// The part of largest size, with its sign; of nearly equal ones the first.
fn largest_part(direction: &[f64]) -> f64 {
    let size = direction.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let first = direction.iter().find(|part| part.abs() >= 0.999 * size);
    first.copied().unwrap_or(1.0)
}

fn power(parameter: Parameter, exponent: f64) -> String {
    let name = match parameter {
        Parameter::Coupling => "exp(atanh coupling)",
        other => other.name(),
    };
    if (exponent - 1.0).abs() < 0.005 {
        name.to_owned()
    } else {
        format!("{name}^{exponent:.2}")
    }
}

fn change(parameter: Parameter, share: f64) -> String {
    match parameter {
        Parameter::Coupling => format!("coupling {:+.2}", 0.1 * share),
        other => format!("{} {:+.0} %", other.name(), 10.0 * share),
    }
}

fn factor_words(std: f64) -> String {
    let factor = (1.96 * std).exp();
    if factor < 1e3 {
        format!("a factor of {factor:.1} either way")
    } else {
        "orders of magnitude".to_owned()
    }
}

fn extra_modes(finished: &Finished<'_>, jacobian: &[Point], unit: f64) -> Vec<ExtraMode> {
    let data = &finished.problem.data;
    let highest = data.iter().map(|datum| datum.mode).max().unwrap_or(0);
    let missing = |mode: &usize| !data.iter().any(|datum| datum.mode == *mode);
    let mut relative: Vec<f64> = data
        .iter()
        .map(|datum| datum.std / datum.frequency / unit)
        .collect();
    let relative_std = median(&mut relative);
    let covariance = Covariance::new(jacobian, finished.directions);
    (1..=highest + 1)
        .filter(missing)
        .map(|mode| {
            let point = &finished.best.at.point;
            let guess = mode as f64 * std::f64::consts::PI;
            let response = finished.problem.model.response(point, mode, guess);
            let slopes = response.sensitivity.map(|slope| slope / relative_std);
            let std = |parameter: &Parameter| {
                let variance = covariance.variance_with(&along(*parameter), &slopes);
                Some(variance.max(0.0).sqrt()).filter(|std| *std < super::covariance::NOTHING_KNOWN)
            };
            ExtraMode {
                mode,
                frequency: response.frequency,
                relative_std,
                stds: finished.estimator.settings.fit.iter().map(std).collect(),
            }
        })
        .collect()
}

/// With all frequencies known equally well, a parameter's uncertainty is proportional to theirs.
fn needed(finished: &Finished<'_>) -> Vec<NeededAccuracy> {
    let at = &finished.best.at;
    let relative: Vec<Point> = finished
        .problem
        .data
        .iter()
        .zip(at.jacobian.iter().zip(&at.frequencies))
        .map(|(datum, (row, frequency))| row.map(|slope| slope * datum.std / frequency))
        .collect();
    let fit = &finished.estimator.settings.fit;
    let directions: Vec<Point> = fit.iter().map(|parameter| along(*parameter)).collect();
    let covariance = Covariance::new(&relative, &directions);
    let point = &at.point;
    fit.iter()
        .zip(&directions)
        .map(|(&parameter, direction)| {
            let slope = match parameter {
                Parameter::Coupling => 1.0 - point[parameter.index()].tanh().powi(2),
                _ => 1.0,
            };
            let std = slope * covariance.std_or_infinite(direction);
            NeededAccuracy {
                parameter,
                // An accuracy that no clock has is none.
                relative_std: Some(MEASURABLE / std).filter(|needed| *needed > 1e-9),
            }
        })
        .collect()
}
