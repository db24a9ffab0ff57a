//! How well frequency and damping are known: from the noise, and from the scatter of the taps.

use nalgebra::{DMatrix, Matrix2, Vector2};
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::super::from_one;
use super::kernel::{Evaluation, Problem};
use super::local::GroupFit;

/// What a standard deviation rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum UncertaintySource {
    /// The noise that the fit leaves on the lines.
    Residual,
    /// The scatter of the taps, which is more than that noise explains.
    #[serde(rename = "taps")]
    TapScatter,
}

/// A value with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedValue {
    /// The value (Hz, or a ratio).
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// What the standard deviation rests on.
    pub source: UncertaintySource,
    /// Its degrees of freedom.
    pub freedom: f64,
    /// Probability that noise alone makes the taps scatter as much as they do; `None` with fewer
    /// than two taps that could be fitted alone.
    pub scatter_probability: Option<f64>,
}

/// Frequency and damping of one tap alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct TapFit {
    /// Number of the tap, from 0; in outputs from 1.
    #[serde(serialize_with = "from_one")]
    pub tap: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its standard deviation from the noise (Hz).
    pub frequency_std: f64,
    /// Damping ratio.
    #[serde(rename = "damping")]
    pub damping_ratio: f64,
    /// Its standard deviation from the noise.
    pub damping_std: f64,
}

/// A scatter less probable than this is not noise alone.
const SCATTER_LEVEL: f64 = 0.01;
/// A residual correlation beyond so many standard deviations is a misfit. 3: by chance one fit in 700.
const CORRELATED: f64 = 3.0;
/// Steps of the fit of one tap; it starts from the joint poles.
const TAP_STEPS: usize = 6;

/// Frequency (Hz) and damping ratio of a pole (lines), and their derivatives to position and decay.
pub(super) struct Reading {
    pub value: Vector2<f64>,
    pub slopes: Matrix2<f64>,
}

/// With w the position and s the decay that is left without `added`, r = hypot(w, s):
/// frequency = r df, damping ratio = s/r.
pub(super) fn reading(pole: Complex64, spacing: f64, added: f64) -> Reading {
    let (position, decay) = (pole.im, -pole.re - added);
    let modulus = position.hypot(decay);
    let cube = modulus.powi(3);
    Reading {
        value: Vector2::new(modulus * spacing, decay / modulus),
        slopes: Matrix2::new(
            position / modulus * spacing,
            decay / modulus * spacing,
            -decay * position / cube,
            position * position / cube,
        ),
    }
}

/// Standard deviations of position and decay of each pole (lines), from the residual.
pub(super) fn deviations(fit: &GroupFit) -> Vec<(f64, f64)> {
    let covariance = covariance(&fit.slopes.information, fit.variance);
    (0..fit.at.poles.len())
        .map(|place| {
            let of = |i: usize| covariance.as_ref().map_or(f64::NAN, |c| c[(i, i)].sqrt());
            (of(2 * place), of(2 * place + 1))
        })
        .collect()
}

fn covariance(information: &DMatrix<f64>, variance: f64) -> Option<DMatrix<f64>> {
    let factor = information.clone().cholesky()?;
    Some(factor.inverse() * variance)
}

/// Covariance of position and decay of the pole at `place` (lines squared).
pub(super) fn pole_covariance(fit: &GroupFit, place: usize) -> Option<Matrix2<f64>> {
    let all = covariance(&fit.slopes.information, fit.variance)?;
    Some(all.fixed_view::<2, 2>(2 * place, 2 * place).into_owned())
}

/// Correlation of the residual between neighbouring lines (1 for a misfit that varies slowly), and the
/// standard deviation it has by chance.
///
/// r = Re sum e(m) conj(e(m+1)) / sum |e|^2, over lines that are neighbours; of N independent complex
/// pairs its standard deviation is 1/sqrt(2 N).
pub(super) fn residual_correlation(fit: &GroupFit) -> (f64, f64) {
    let count = fit.lines.count();
    let positions = &fit.lines.positions;
    let neighbours: Vec<usize> = (0..count - 1)
        .filter(|&line| positions[line + 1] - positions[line] < 1.5)
        .collect();
    let product: f64 = fit
        .at
        .residual
        .column_iter()
        .map(|column| {
            let pair = |&line: &usize| {
                column[line] * column[line + 1] + column[line + count] * column[line + 1 + count]
            };
            neighbours.iter().map(pair).sum::<f64>()
        })
        .sum();
    let pairs = (neighbours.len() * fit.used.len()).max(1) as f64;
    let share = pairs / (count * fit.used.len()) as f64;
    let power = (fit.at.square_sum * share).max(f64::MIN_POSITIVE);
    (product / power, (2.0 * pairs).sqrt().recip())
}

/// Factor on the standard deviations for a residual correlated like r^k over k lines,
/// sqrt((1 + r)/(1 - r)); 1 where the correlation may be chance.
pub(super) fn inflation((correlation, by_chance): (f64, f64)) -> f64 {
    if correlation > CORRELATED * by_chance {
        let bounded = correlation.min(0.99);
        ((1.0 + bounded) / (1.0 - bounded)).sqrt()
    } else {
        1.0
    }
}

/// Fits of each tap's columns alone, from the joint poles: number of the tap, poles and standard
/// deviations (lines). `taps` gives the tap of every column that was used.
pub(super) fn fit_taps(fit: &GroupFit, taps: &[usize]) -> Vec<(usize, Evaluation, DMatrix<f64>)> {
    let mut numbers = taps.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
        .into_iter()
        .filter_map(|number| {
            let places: Vec<usize> = (0..taps.len()).filter(|&p| taps[p] == number).collect();
            let problem = Problem {
                lines: &fit.lines,
                fixed: &fit.fixed,
                columns: fit.columns.select_columns(&places),
            };
            let (at, _) = problem.search(&fit.at.poles, fit.freedom, TAP_STEPS)?;
            let slopes = problem.slopes(&at);
            let covariance = covariance(&slopes.information, fit.variance)?;
            Some((number, at, covariance))
        })
        .collect()
}

/// Value and interval from the joint fit (its value and standard deviation), or where the taps scatter
/// more than their own standard deviations explain, from the taps (value and standard deviation).
pub(super) fn judge(joint: (f64, f64), freedom: f64, taps: &[(f64, f64)]) -> FittedValue {
    let probability = scatter_probability(taps);
    if probability.is_some_and(|p| p < SCATTER_LEVEL) {
        let (value, std) = weighted_mean(taps);
        // Scatter cannot make a value better than the noise lets it be.
        let (std, freedom) = (std.max(joint.1), taps.len() as f64 - 1.0);
        interval(
            (value, std),
            freedom,
            UncertaintySource::TapScatter,
            probability,
        )
    } else {
        interval(joint, freedom, UncertaintySource::Residual, probability)
    }
}

/// Chi-squared test of the scatter about the weighted mean.
fn scatter_probability(taps: &[(f64, f64)]) -> Option<f64> {
    if taps.len() < 2 {
        return None;
    }
    let scatter = scatter_about_mean(taps);
    let distribution = ChiSquared::new(taps.len() as f64 - 1.0).ok()?;
    scatter.is_finite().then(|| distribution.sf(scatter))
}

/// Chi-squared of values with their standard deviations about their weighted mean.
pub fn scatter_about_mean(taps: &[(f64, f64)]) -> f64 {
    let weight = |std: f64| 1.0 / (std * std);
    let total: f64 = taps.iter().map(|tap| weight(tap.1)).sum();
    let mean = taps.iter().map(|tap| weight(tap.1) * tap.0).sum::<f64>() / total;
    taps.iter()
        .map(|tap| weight(tap.1) * (tap.0 - mean).powi(2))
        .sum()
}

/// Mean of values that scatter between taps by tau beside their own std_i, and its standard deviation.
///
/// Weights v_i = 1/(std_i^2 + tau^2), tau^2 after DerSimonian & Laird 1986; standard deviation
/// sqrt(sum v_i (x_i - mean)^2/((n - 1) sum v_i)), which goes with Student's t of n - 1 (Hartung & Knapp
/// 2001).
pub fn weighted_mean(taps: &[(f64, f64)]) -> (f64, f64) {
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| taps.iter().map(of).sum::<f64>();
    let degrees = taps.len() as f64 - 1.0;
    let weight = |std: f64| 1.0 / (std * std);
    let total = sum(&|tap| weight(tap.1));
    let mean = sum(&|tap| weight(tap.1) * tap.0) / total;
    let scatter = sum(&|tap| weight(tap.1) * (tap.0 - mean).powi(2));
    let squares = sum(&|tap| weight(tap.1).powi(2));
    let between = ((scatter - degrees) / (total - squares / total)).max(0.0);
    let share = |std: f64| 1.0 / (std * std + between);
    let total = sum(&|tap| share(tap.1));
    let mean = sum(&|tap| share(tap.1) * tap.0) / total;
    let scatter = sum(&|tap| share(tap.1) * (tap.0 - mean).powi(2));
    (mean, (scatter / (degrees * total)).sqrt())
}

fn interval(
    (value, std): (f64, f64),
    freedom: f64,
    source: UncertaintySource,
    scatter_probability: Option<f64>,
) -> FittedValue {
    let quantile = student_quantile(freedom);
    FittedValue {
        value,
        std,
        low: value - quantile * std,
        high: value + quantile * std,
        source,
        freedom,
        scatter_probability,
    }
}

/// Student's t that 2.5 % exceed.
pub(super) fn student_quantile(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(1.96, |t| t.inverse_cdf(0.975))
}
