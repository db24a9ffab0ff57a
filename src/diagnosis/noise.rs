//! How far the readings can be trusted: standard deviations from few repeats, moderated by each other.
//!
//! A standard deviation from five taps is itself known to a third. The readings of one kind share what
//! they have in common (Smyth 2004, "Linear models and empirical Bayes methods", section 6.2): their
//! variances are taken as draws from a scaled inverse chi-square distribution whose own two numbers
//! come from all of them, and each is moved towards the common value as far as its repeats allow.
//! What remains uncertain makes the likelihood a Student t one, never a Gaussian.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};
use statrs::function::gamma::{digamma, ln_gamma};

/// A measured value with what its repeats and its fit say about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty (unit of the value).
    pub std: f64,
    /// Degrees of freedom of that uncertainty: taps less one, infinite where it is stated and not
    /// estimated.
    pub freedom: f64,
}

/// Degrees of freedom beyond which Student's t is taken as the normal distribution: their tails
/// differ by less than 1 % at five standard deviations.
const NORMAL_FROM: f64 = 2000.0;

/// Moves the standard deviations of readings of one kind towards what they have in common; those
/// without degrees of freedom of their own (stated ones) stay.
///
/// `std` and `freedom` of each reading are replaced; `std` must be relative to a scale on which the
/// readings can be compared.
pub(super) fn moderate(readings: &mut [Reading]) {
    let estimated: Vec<Reading> = readings
        .iter()
        .copied()
        .filter(|reading| reading.freedom < NORMAL_FROM && reading.std > 0.0)
        .collect();
    // Two variances say nothing about how variances scatter.
    if estimated.len() < 3 {
        return;
    }
    // E ln(chi2_n / n) = psi(n/2) - ln(n/2): what is left of ln s^2 is ln sigma^2 and its scatter.
    let logs: Vec<f64> = estimated
        .iter()
        .map(|r| (r.std * r.std).ln() - digamma(0.5 * r.freedom) + (0.5 * r.freedom).ln())
        .collect();
    let count = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let scatter = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let chance = estimated
        .iter()
        .map(|r| trigamma(0.5 * r.freedom))
        .sum::<f64>()
        / count;
    let common_freedom = if scatter > chance {
        2.0 * inverse_trigamma(scatter - chance)
    } else {
        // No more scatter than chance: one variance for all, known as well as all together know it.
        estimated.iter().map(|r| r.freedom).sum::<f64>()
    };
    let common = (mean + digamma(0.5 * common_freedom) - (0.5 * common_freedom).ln()).exp();
    for reading in readings
        .iter_mut()
        .filter(|reading| reading.freedom < NORMAL_FROM)
    {
        let total = common_freedom + reading.freedom;
        let own = reading.freedom * reading.std * reading.std;
        reading.std = ((common_freedom * common + own) / total).sqrt();
        reading.freedom = total;
    }
}

/// Logarithm of Student's t density of a residual r (in standard deviations) over its value at 0.
pub(super) fn log_density_drop(residual: f64, freedom: f64) -> f64 {
    if freedom >= NORMAL_FROM {
        return -0.5 * residual * residual;
    }
    -0.5 * (freedom + 1.0) * (residual * residual / freedom).ln_1p()
}

/// Logarithm of the density at residual 0 of a reading with that standard deviation.
pub(super) fn log_density_peak(std: f64, freedom: f64) -> f64 {
    let shape = if freedom >= NORMAL_FROM {
        -0.5 * (2.0 * std::f64::consts::PI).ln()
    } else {
        ln_gamma(0.5 * (freedom + 1.0))
            - ln_gamma(0.5 * freedom)
            - 0.5 * (freedom * std::f64::consts::PI).ln()
    };
    shape - std.ln()
}

/// Weight of a residual in iteratively reweighted least squares, (n + 1)/(n + r^2).
pub(super) fn weight(residual: f64, freedom: f64) -> f64 {
    if freedom >= NORMAL_FROM {
        return 1.0;
    }
    (freedom + 1.0) / (freedom + residual * residual)
}

/// The square of the normal deviate that is as improbable as this residual under Student's t.
pub(super) fn gaussian_square(residual: f64, freedom: f64) -> f64 {
    if freedom >= NORMAL_FROM {
        return residual * residual;
    }
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else {
        return residual * residual;
    };
    let Ok(normal) = Normal::new(0.0, 1.0) else {
        return residual * residual;
    };
    // Beyond 1e-14 the tail is no longer resolved: it is 7.7 standard deviations.
    let tail = student.cdf(-residual.abs()).clamp(1e-14, 0.5);
    normal.inverse_cdf(tail).powi(2)
}

/// Probability that chi square exceeds a value; `None` without a degree of freedom.
pub(super) fn chi_square_tail(value: f64, freedom: f64) -> Option<f64> {
    if freedom < 0.5 || !value.is_finite() {
        return None;
    }
    ChiSquared::new(freedom)
        .ok()
        .map(|chi| chi.sf(value.max(0.0)))
}

/// psi'(x) by recurrence to x > 6 and the asymptotic series (Abramowitz & Stegun 6.4.12).
fn trigamma(mut x: f64) -> f64 {
    let mut sum = 0.0;
    while x < 6.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    sum + 0.5 * y + (1.0 + y * (1.0 / 6.0 - y * (1.0 / 30.0 - y / 42.0))) / x
}

/// The x > 0 with psi'(x) = value, by bisection in ln x: psi' falls from infinity to 0.
fn inverse_trigamma(value: f64) -> f64 {
    let (mut low, mut high) = (1e-4_f64.ln(), 1e4_f64.ln());
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if trigamma(middle.exp()) > value {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).exp()
}
