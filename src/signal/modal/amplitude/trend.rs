//! Frequency and damping against log amplitude: weighted polynomials with covariance.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;
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
/// Reach of the curve beyond the outermost points (log amplitude): as far as the shortest
/// segment reaches to either side of its point, and a little more.
const BEYOND: f64 = 0.1;

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
    // First: at the first usable time of the hardest tap. Last: at the last usable time of some tap.
    /// Last less first.
    pub change: f64,
    /// 95 % bound of the change.
    pub change_bound: f64,
    /// Probability of a slope at least as large without any change (Student's test).
    pub p_value: f64,
    #[serde(skip)]
    curve: Curve,
}

/// One point of a trend.
#[derive(Debug, Clone, Copy)]
struct Point {
    /// Log amplitude, or a power of the amplitude.
    x: f64,
    value: f64,
    std: f64,
}

/// Returns the least and the largest abscissa.
fn extent(points: &[Point]) -> (f64, f64) {
    let places = points.iter().map(|point| point.x);
    let low = places.clone().fold(f64::INFINITY, f64::min);
    (low, places.fold(f64::NEG_INFINITY, f64::max))
}

/// Polynomials in powers of the amplitude, over its logarithm, each with its weight. It is not known which
/// of them holds, and the uncertainty says so.
#[derive(Debug, Clone, PartialEq)]
struct Curve {
    /// The best model first.
    models: Vec<Model>,
    /// Range of the log amplitudes.
    low: f64,
    high: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct Model {
    weight: f64,
    /// Power of the amplitude.
    power: f64,
    polynomial: Polynomial,
}

impl Curve {
    /// Fits all powers and degrees, weighted with e^{-(A - A_least)/2} by Akaike's criterion A (Burnham &
    /// Anderson).
    fn fit(points: &[Point]) -> Option<Curve> {
        let (low, high) = extent(points);
        let most = (points.len() / LEAST_SHARE).min(points.len().checked_sub(1 + LEAST_FREEDOM)?);
        let mut models: Vec<Model> = Vec::new();
        for (power, highest) in POWERS {
            let mut mapped = points.to_vec();
            for point in &mut mapped {
                point.x = variable(point.x, high, power);
            }
            let degrees = (1..=most.min(highest)).filter_map(|d| Polynomial::fit(&mapped, d));
            models.extend(degrees.map(|polynomial| Model {
                weight: 0.0,
                power,
                polynomial,
            }));
        }
        // Where even the best scatters more than its points say, chi^2 counts in units of that scatter
        // (Burnham & Anderson, quasi-likelihood): otherwise bends would be fitted to it.
        let inflation = (models.iter())
            .map(|model| model.polynomial.chi_squared / model.polynomial.freedom)
            .fold(f64::INFINITY, f64::min)
            .max(1.0);
        let least = (models.iter())
            .map(|model| model.polynomial.criterion(inflation))
            .fold(f64::INFINITY, f64::min);
        for model in &mut models {
            model.weight = (-0.5 * (model.polynomial.criterion(inflation) - least)).exp();
        }
        models.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        models.retain(|model| model.weight > LEAST_WEIGHT);
        let total: f64 = models.iter().map(|model| model.weight).sum();
        for model in &mut models {
            model.weight /= total;
        }
        Some(Curve { models, low, high })
    }

    /// Returns the value at `to` and its standard uncertainty; with `from` what the value differs from that there.
    ///
    /// It is the mean over the models. The uncertainty is sqrt(sum w (s^2 + (v - mean)^2)): their own uncertainties
    /// and how far they disagree (Burnham & Anderson).
    fn read(&self, from: Option<f64>, to: f64) -> (f64, f64) {
        let models = self.models.iter();
        let readings: Vec<(f64, (f64, f64))> = models
            .map(|model| {
                let from = from.map(|x| variable(x, self.high, model.power));
                let to = variable(to, self.high, model.power);
                (model.weight, model.polynomial.read(from, to))
            })
            .collect();
        let mean: f64 = readings.iter().map(|(w, (value, _))| w * value).sum();
        let variances = readings
            .iter()
            .map(|(w, (value, std))| w * (std * std + (value - mean).powi(2)));
        (mean, variances.sum::<f64>().sqrt())
    }

    /// Degrees of freedom of the best model.
    fn freedom(&self) -> f64 {
        let best = self.models.first();
        best.map_or(1.0, |model| model.polynomial.freedom)
    }

    /// 95 % quantile for the best model's degrees of freedom.
    fn quantile(&self) -> f64 {
        student::quantile(OUTSIDE, self.freedom())
    }

    /// Returns true where `x` lies in the range of the points, or a little beyond.
    fn reaches(&self, x: f64) -> bool {
        (self.low - BEYOND..=self.high + BEYOND).contains(&x)
    }
}

/// Returns (a/a0)^q of the log amplitude x with a0 the largest; the logarithm itself for q = 0.
fn variable(x: f64, high: f64, power: f64) -> f64 {
    if power == 0.0 {
        x
    } else {
        (power * (x - high)).exp()
    }
}

/// Frequency and damping at one amplitude, with 95 % bounds.
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

impl Trend {
    /// Fits the quantity that `read` takes from a point, with its standard uncertainty.
    pub(super) fn fit(
        points: &[AmplitudePoint],
        read: fn(&AmplitudePoint) -> (f64, f64),
    ) -> Option<Trend> {
        let values = points.iter().map(|point| {
            let (value, std) = read(point);
            let x = point.amplitude.ln();
            Point { x, value, std }
        });
        let values: Vec<Point> = values.collect();
        let (low, high) = extent(&values);
        let line = Polynomial::fit(&values, 1)?;
        let (slope, slope_std) = line.read(Some(0.0), 1.0);
        let curve = Curve::fit(&values)?;
        let (change, change_std) = curve.read(Some(high), low);
        let best = curve.models.first().map(|model| &model.polynomial);
        Some(Trend {
            slope,
            slope_std,
            p_value: student::two_sided(slope / slope_std, line.freedom),
            scatter: best.map_or(0.0, |fit| (fit.chi_squared / fit.freedom).sqrt()),
            change,
            change_bound: curve.quantile() * change_std,
            curve,
        })
    }

    /// Returns value and 95 % bound at an amplitude; `None` outside the points' range and a little beyond.
    pub fn at_amplitude(&self, amplitude: f64) -> Option<(f64, f64)> {
        let x = amplitude.ln();
        let (value, std) = self.curve.read(None, x);
        (self.curve.reaches(x)).then(|| (value, self.curve.quantile() * std))
    }

    /// Returns the value at the second amplitude less that at the first, and its standard uncertainty, in
    /// which the two are not independent; `None` outside the points' range and a little beyond.
    pub fn between(&self, from: f64, to: f64) -> Option<(f64, f64)> {
        let (from, to) = (from.ln(), to.ln());
        let reaches = self.curve.reaches(from) && self.curve.reaches(to);
        reaches.then(|| self.curve.read(Some(from), to))
    }

    /// Returns the least and the largest amplitude at which the curve can be read: those of the points, and a little beyond.
    pub fn reach(&self) -> [f64; 2] {
        [self.curve.low - BEYOND, self.curve.high + BEYOND].map(f64::exp)
    }

    /// Degrees of freedom of the standard uncertainties, for Student's t.
    pub fn freedom(&self) -> f64 {
        self.curve.freedom()
    }
}

impl AmplitudeCurve {
    /// Returns frequency and damping at an amplitude (unit of the strongest sensor); `None` outside the
    /// points' range and a little beyond.
    pub fn at_amplitude(&self, amplitude: f64) -> Option<AmplitudeReading> {
        let (frequency, frequency_bound) = self.frequency.as_ref()?.at_amplitude(amplitude)?;
        let (damping_ratio, damping_bound) = self.damping.as_ref()?.at_amplitude(amplitude)?;
        Some(AmplitudeReading {
            amplitude,
            frequency,
            frequency_bound,
            damping_ratio,
            damping_bound,
        })
    }
}

/// A polynomial in (x - middle)/half.
#[derive(Debug, Clone, PartialEq)]
struct Polynomial {
    middle: f64,
    half: f64,
    coefficients: DVector<f64>,
    /// Covariance of the coefficients from the values' own uncertainties.
    covariance: DMatrix<f64>,
    /// Sum of squared residuals over the values' variances.
    chi_squared: f64,
    /// Values less coefficients.
    freedom: f64,
}

impl Polynomial {
    /// Fits values with standard uncertainties by least squares; `None` for points that do not determine it.
    fn fit(points: &[Point], degree: usize) -> Option<Polynomial> {
        let freedom = points.len().checked_sub(degree + 1)?;
        let (low, high) = extent(points);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let usable = points.iter().all(|p| p.value.is_finite() && p.std > 0.0);
        if !usable || half.is_nan() || half <= 0.0 {
            return None;
        }
        let rows = DMatrix::from_fn(points.len(), degree + 1, |row, power| {
            let point = points[row];
            ((point.x - middle) / half).powi(power as i32) / point.std
        });
        let right = DVector::from_fn(points.len(), |row, _| points[row].value / points[row].std);
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

    /// Returns chi^2/inflation + 2 x coefficients (Akaike), to choose among polynomials.
    fn criterion(&self, inflation: f64) -> f64 {
        self.chi_squared / inflation + 2.0 * self.coefficients.len() as f64
    }

    fn powers(&self, x: f64) -> DVector<f64> {
        let share = (x - self.middle) / self.half;
        DVector::from_fn(self.coefficients.len(), |power, _| share.powi(power as i32))
    }

    /// Returns the value at `to`, or with `from` its difference from that there, and the standard uncertainty,
    /// scatter included.
    fn read(&self, from: Option<f64>, to: f64) -> (f64, f64) {
        let mut weights = self.powers(to);
        if let Some(from) = from {
            weights -= self.powers(from);
        }
        let variance = (weights.transpose() * &self.covariance * &weights)[(0, 0)];
        let value = weights.dot(&self.coefficients);
        // Where the points scatter more than they say, all uncertainties grow by that factor.
        let scatter = (self.chi_squared / self.freedom.max(1.0)).max(1.0).sqrt();
        (value, variance.max(0.0).sqrt() * scatter)
    }
}
