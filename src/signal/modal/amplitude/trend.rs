//! Frequency and damping against log amplitude.
//!
//! Weighted polynomials with covariance.

use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use tapjoint_numerics::stats::student;

use super::{AmplitudeCurve, AmplitudePoint};

/// Powers q of the amplitude in which the curve is a polynomial (0: its logarithm), and the highest
/// degree of that polynomial. Slip in a joint changes frequencies with a power between 1/2 and 1, a
/// cubic spring with the square; the higher the power, the fewer points lie away from zero.
const POWERS: [(f64, usize); 4] = [(0.0, 8), (0.5, 6), (1.0, 4), (2.0, 2)];
/// Weight over that of the best model below which a model is left out.
const LEAST_WEIGHT: f64 = 0.01;
/// Points for every degree, at least.
const LEAST_SHARE: usize = 3;
/// Degrees of freedom that the curve leaves at least.
const LEAST_FREEDOM: usize = 2;
/// Probability outside the stated bounds.
const OUTSIDE: f64 = 0.05;
/// How far beyond the outermost points the curve is read (log amplitude): as far as the shortest
/// segment reaches to either side of its point, and a little more.
const BEYOND: f64 = 0.1;
/// How far beyond the first and last point of a decay it is read in time (shares of the step): the half
/// of a segment.
const BEYOND_TIME: f64 = 0.5;

/// One quantity (frequency in Hz, or damping ratio) against log amplitude.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Trend {
    /// Change per e-fold of the amplitude (unit of the quantity): slope of the weighted straight line.
    #[serde(skip)]
    pub slope: f64,
    /// Its standard uncertainty, scatter of the points about the line included.
    #[serde(skip)]
    pub slope_std: f64,
    /// Scatter of the points about the curve over their own uncertainties; above 1 they differ by more
    /// than noise (between taps: the structure changed).
    #[serde(skip)]
    pub scatter: f64,
    /// Value at the largest amplitude: the first usable time of the hardest tap.
    #[serde(skip)]
    pub first: f64,
    /// Value at the smallest amplitude: the last usable time of some tap.
    #[serde(skip)]
    pub last: f64,
    /// Last less first.
    pub change: f64,
    /// 95 % bound of the change.
    pub change_bound: f64,
    /// Probability of a slope at least as large without any change (Student's test).
    pub p_value: f64,
    #[serde(skip)]
    curve: Curve,
}

/// Polynomials in powers of the amplitude, over its logarithm, each with its weight: which of them
/// holds is not known, and the uncertainty has to say so.
#[derive(Debug, Clone, PartialEq)]
struct Curve {
    /// Weight, power of the amplitude, polynomial; the best one first.
    models: Vec<(f64, f64, Polynomial)>,
    /// Range of the log amplitudes.
    low: f64,
    high: f64,
}

impl Curve {
    /// All powers and degrees, weighted with e^{-(A - A_least)/2} by Akaike's criterion A (Burnham &
    /// Anderson).
    fn through(values: &[(f64, f64, f64)]) -> Option<Curve> {
        let (low, high) = extent(values);
        let most = (values.len() / LEAST_SHARE).min(values.len().checked_sub(1 + LEAST_FREEDOM)?);
        let mut models: Vec<(f64, f64, Polynomial)> = Vec::new();
        for (power, highest) in POWERS {
            let mapped: Vec<(f64, f64, f64)> = values
                .iter()
                .map(|(x, value, std)| (variable(*x, high, power), *value, *std))
                .collect();
            let degrees = (1..=most.min(highest)).filter_map(|d| Polynomial::fit(&mapped, d));
            models.extend(degrees.map(|fit| (0.0, power, fit)));
        }
        weigh(&mut models);
        models.retain(|model| model.0 > LEAST_WEIGHT);
        let total: f64 = models.iter().map(|model| model.0).sum();
        for model in &mut models {
            model.0 /= total;
        }
        Some(Curve { models, low, high })
    }

    /// Value and standard uncertainty.
    fn at(&self, x: f64) -> (f64, f64) {
        self.averaged(|power, polynomial| polynomial.at(variable(x, self.high, power)))
    }

    /// Difference of the values at two places, and its standard uncertainty.
    fn between(&self, from: f64, to: f64) -> (f64, f64) {
        self.averaged(|power, polynomial| {
            let variable = |x| variable(x, self.high, power);
            polynomial.between(variable(from), variable(to))
        })
    }

    /// Mean over the models, and sqrt(sum w (s^2 + (v - mean)^2)): their own uncertainties and how far
    /// they disagree (Burnham & Anderson).
    fn averaged(&self, of: impl Fn(f64, &Polynomial) -> (f64, f64)) -> (f64, f64) {
        let models = self.models.iter();
        let values: Vec<(f64, (f64, f64))> = models.map(|(w, q, p)| (*w, of(*q, p))).collect();
        let mean = values.iter().map(|(w, (v, _))| w * v).sum::<f64>();
        let variance = values
            .iter()
            .map(|(w, (v, s))| w * (s * s + (v - mean).powi(2)))
            .sum::<f64>();
        (mean, variance.sqrt())
    }

    /// Degrees of freedom of the best model.
    fn freedom(&self) -> f64 {
        let best = self.models.first();
        best.map_or(1.0, |(_, _, fit)| fit.freedom)
    }

    /// 95 % quantile for the best model's degrees of freedom.
    fn quantile(&self) -> f64 {
        student::quantile(OUTSIDE, self.freedom())
    }

    /// sqrt(chi^2/freedom) about the best model.
    fn scatter(&self) -> f64 {
        let best = self.models.first();
        best.map_or(0.0, |(_, _, fit)| (fit.chi_squared / fit.freedom).sqrt())
    }

    /// Whether `x` lies in the range of the points, or a little beyond.
    fn reaches(&self, x: f64) -> bool {
        (self.low - BEYOND..=self.high + BEYOND).contains(&x)
    }
}

/// Weights of models, not yet normalised, the best model first. Where even the best scatters more than
/// its points say, chi^2 counts in units of that scatter (Burnham & Anderson, quasi-likelihood):
/// otherwise bends would be fitted to it.
fn weigh(models: &mut [(f64, f64, Polynomial)]) {
    let scatter = |fit: &Polynomial| fit.chi_squared / fit.freedom;
    let least = models.iter().map(|model| scatter(&model.2));
    let inflation = least.fold(f64::INFINITY, f64::min).max(1.0);
    let criteria = models.iter().map(|model| model.2.criterion(inflation));
    let least = criteria.fold(f64::INFINITY, f64::min);
    for model in models.iter_mut() {
        model.0 = (-0.5 * (model.2.criterion(inflation) - least)).exp();
    }
    models.sort_by(|a, b| b.0.total_cmp(&a.0));
}

/// Least and largest log amplitude.
fn extent(values: &[(f64, f64, f64)]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v.0), high.max(v.0))
        })
}

/// (a/a0)^q over log amplitude x with a0 the largest; the logarithm itself for q = 0.
fn variable(x: f64, high: f64, power: f64) -> f64 {
    if power == 0.0 {
        x
    } else {
        (power * (x - high)).exp()
    }
}

/// Frequency and damping at one amplitude or time, with 95 % bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeReading {
    /// Amplitude (unit of the strongest sensor).
    pub amplitude: f64,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its 95 % bound (Hz).
    pub frequency_bound: f64,
    /// Damping ratio (1).
    pub damping_ratio: f64,
    /// Its 95 % bound (1).
    pub damping_bound: f64,
}

/// Trend of the frequency (Hz).
pub(super) fn frequency_trend(points: &[AmplitudePoint]) -> Option<Trend> {
    trend(points, |p| (p.frequency, p.frequency_std))
}

/// Trend of the damping ratio.
pub(super) fn damping_trend(points: &[AmplitudePoint]) -> Option<Trend> {
    trend(points, |p| (p.damping_ratio, p.damping_std))
}

fn trend(points: &[AmplitudePoint], of: fn(&AmplitudePoint) -> (f64, f64)) -> Option<Trend> {
    let values: Vec<(f64, f64, f64)> = points
        .iter()
        .map(|point| {
            let (value, std) = of(point);
            (point.amplitude.ln(), value, std)
        })
        .collect();
    let (low, high) = extent(&values);
    let line = Polynomial::fit(&values, 1)?;
    let (slope, slope_std) = line.between(0.0, 1.0);
    let curve = Curve::through(&values)?;
    let (change, change_std) = curve.between(high, low);
    Some(Trend {
        slope,
        slope_std,
        p_value: student::two_sided(slope / slope_std, line.freedom),
        scatter: curve.scatter(),
        first: curve.at(high).0,
        last: curve.at(low).0,
        change,
        change_bound: curve.quantile() * change_std,
        curve,
    })
}

impl Trend {
    /// Value and 95 % bound at an amplitude; `None` outside the points' range and a little beyond.
    pub fn at_amplitude(&self, amplitude: f64) -> Option<(f64, f64)> {
        let x = amplitude.ln();
        if !self.curve.reaches(x) {
            return None;
        }
        let (value, std) = self.curve.at(x);
        Some((value, self.curve.quantile() * std))
    }

    /// Value at the second amplitude less that at the first, and its standard uncertainty, in which the two
    /// are not independent; `None` outside the points' range and a little beyond.
    pub fn between(&self, from: f64, to: f64) -> Option<(f64, f64)> {
        let (from, to) = (from.ln(), to.ln());
        let reaches = self.curve.reaches(from) && self.curve.reaches(to);
        reaches.then(|| self.curve.between(from, to))
    }

    /// Degrees of freedom of the standard uncertainties, for Student's t.
    pub fn freedom(&self) -> f64 {
        self.curve.freedom()
    }
}

pub(super) fn reading_at(curve: &AmplitudeCurve, amplitude: f64) -> Option<AmplitudeReading> {
    let (frequency, frequency_bound) = curve.frequency.as_ref()?.at_amplitude(amplitude)?;
    let (damping_ratio, damping_bound) = curve.damping.as_ref()?.at_amplitude(amplitude)?;
    Some(AmplitudeReading {
        amplitude,
        frequency,
        frequency_bound,
        damping_ratio,
        damping_bound,
    })
}

/// The amplitude at a time is that of the cubic through the log amplitudes of the two points beside
/// it, with their decays as its slopes (Hermite); beyond the ends of the two outermost.
pub(super) fn reading_at_time(
    curve: &AmplitudeCurve,
    tap: usize,
    time: f64,
) -> Option<AmplitudeReading> {
    let points: Vec<&AmplitudePoint> = curve.points.iter().filter(|p| p.tap == tap).collect();
    let later = points.partition_point(|p| p.time < time);
    let from = later.saturating_sub(1).min(points.len().checked_sub(2)?);
    let (a, b) = (points[from], points[from + 1]);
    let step = b.time - a.time;
    let u = (time - a.time) / step;
    if !(-BEYOND_TIME..=1.0 + BEYOND_TIME).contains(&u) {
        return None;
    }
    // d ln a/dt = -zeta omega.
    let slope = |p: &AmplitudePoint| -p.damping_ratio * TAU * p.frequency * step;
    let log = a.amplitude.ln() * (1.0 + 2.0 * u) * (1.0 - u).powi(2)
        + b.amplitude.ln() * (3.0 - 2.0 * u) * u * u
        + slope(a) * u * (1.0 - u).powi(2)
        - slope(b) * (1.0 - u) * u * u;
    reading_at(curve, log.exp())
}

/// A polynomial in (x - middle)/half.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Polynomial {
    middle: f64,
    half: f64,
    coefficients: DVector<f64>,
    /// Covariance of the coefficients from the values' own uncertainties.
    covariance: DMatrix<f64>,
    /// Sum of squared residuals over the values' variances.
    pub chi_squared: f64,
    /// Values less coefficients.
    pub freedom: f64,
}

impl Polynomial {
    /// Least squares of values with standard uncertainties; `None` for points that do not determine it.
    pub fn fit(points: &[(f64, f64, f64)], degree: usize) -> Option<Polynomial> {
        let freedom = points.len().checked_sub(degree + 1)?;
        let (low, high) = points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                (low.min(p.0), high.max(p.0))
            });
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let usable = points.iter().all(|p| p.1.is_finite() && p.2 > 0.0);
        if !usable || half.is_nan() || half <= 0.0 {
            return None;
        }
        let rows = DMatrix::from_fn(points.len(), degree + 1, |row, power| {
            let (x, _, std) = points[row];
            ((x - middle) / half).powi(power as i32) / std
        });
        let right = DVector::from_fn(points.len(), |row, _| points[row].1 / points[row].2);
        let covariance = (rows.transpose() * &rows).try_inverse()?;
        let coefficients = &covariance * rows.transpose() * &right;
        let chi_squared = (&right - &rows * &coefficients).norm_squared();
        Some(Polynomial {
            middle,
            half,
            coefficients,
            covariance,
            chi_squared,
            freedom: freedom as f64,
        })
    }

    /// chi^2/inflation + 2 x coefficients (Akaike), to choose among polynomials.
    pub fn criterion(&self, inflation: f64) -> f64 {
        self.chi_squared / inflation + 2.0 * self.coefficients.len() as f64
    }

    /// Factor on all uncertainties where the points scatter more than they say: sqrt(chi^2/freedom),
    /// at least 1.
    pub fn scatter(&self) -> f64 {
        (self.chi_squared / self.freedom.max(1.0)).max(1.0).sqrt()
    }

    fn powers(&self, x: f64) -> DVector<f64> {
        let share = (x - self.middle) / self.half;
        DVector::from_fn(self.coefficients.len(), |power, _| share.powi(power as i32))
    }

    /// Value and standard uncertainty, scatter included.
    pub fn at(&self, x: f64) -> (f64, f64) {
        self.weighted(&self.powers(x))
    }

    /// Difference of the values at two places, and its standard uncertainty.
    pub fn between(&self, from: f64, to: f64) -> (f64, f64) {
        self.weighted(&(self.powers(to) - self.powers(from)))
    }

    fn weighted(&self, weights: &DVector<f64>) -> (f64, f64) {
        let variance = (weights.transpose() * &self.covariance * weights)[(0, 0)];
        let value = weights.dot(&self.coefficients);
        (value, variance.max(0.0).sqrt() * self.scatter())
    }
}
