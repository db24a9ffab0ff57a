//! How what is estimated hangs together: covariances and correlations of the estimate's numbers.

use super::estimate::{Finished, limit_of};
use super::model::Parameter;
use super::problem::along;
use super::quantities::Quantity;
use super::result::Correlation;

impl Finished<'_> {
    /// Factor from the covariance's unit to a variance: the misfit's where no uncertainty is stated.
    fn variance_unit(&self) -> Option<f64> {
        if self.measured() {
            Some(1.0)
        } else {
            Some(self.scale()?.powi(2))
        }
    }

    /// Of ln Kx and ln Ky, where both are estimated and neither is at its limit.
    pub(super) fn stiffness_covariance(&self) -> Option<[[f64; 2]; 2]> {
        let both = [Quantity::Kx, Quantity::Ky];
        let fit = &self.estimator.settings.fit;
        let point = &self.best.at.point;
        let open = |quantity: &Quantity| {
            fit.contains(&quantity.lead())
                && limit_of(*quantity, point).is_none()
                && self.covariance.std(&quantity.gradient()).is_some()
        };
        if !both.iter().all(open) {
            return None;
        }
        let factor = self.variance_unit()?;
        let entry = |first: Quantity, second: Quantity| {
            let between = self
                .covariance
                .between(&first.gradient(), &second.gradient());
            factor * between
        };
        Some(both.map(|first| both.map(|second| entry(first, second))))
    }

    pub(super) fn covariance_matrix(&self) -> Option<Vec<Vec<f64>>> {
        let factor = self.variance_unit()?;
        let fit = &self.estimator.settings.fit;
        let row = |first: &Parameter| {
            let entry = |second: &Parameter| {
                factor * self.covariance.between(&along(*first), &along(*second))
            };
            fit.iter().map(entry).collect()
        };
        Some(fit.iter().map(row).collect())
    }

    pub(super) fn correlations(&self) -> Vec<Correlation> {
        let fit = &self.estimator.settings.fit;
        let mut found = Vec::new();
        for (index, &first) in fit.iter().enumerate() {
            for &second in &fit[index + 1..] {
                let (a, b) = (along(first), along(second));
                let size = self.covariance.between(&a, &a) * self.covariance.between(&b, &b);
                found.push(Correlation {
                    first,
                    second,
                    value: (self.covariance.between(&a, &b) / size.sqrt()).clamp(-1.0, 1.0),
                });
            }
        }
        found
    }
}
