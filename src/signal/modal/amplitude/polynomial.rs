//! Weighted polynomials with covariance.

use nalgebra::{DMatrix, DVector};

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
