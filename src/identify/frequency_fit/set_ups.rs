//! Set-ups that differ: a clamp was opened and closed, a screw retightened. Each has a joint of its own.
//!
//! The estimate is that of the mean joint. Every set-up is fitted alone, by the same modes and with an exact description:
//! whatever is wrong in all of them alike moves them alike, and cancels in their deviations from their mean. The variance s^2
//! of n joints about their mean makes s^2/n the variance of the mean. Its interval is that of Student's t with n - 1
//! degrees of freedom. A further set-up has the variance s^2 (1 + 1/n).

use super::estimator::PointFit;
use super::model::{Parameter, Point};
use super::problem::value_along;
use tapjoint_numerics::stats::{NORMAL_95, student};

/// Set-ups with their mean.
pub(super) struct SetUps<'a> {
    fits: &'a [PointFit],
    /// Estimated parameters, in the order of the fits.
    fit: &'a [Parameter],
    /// True where the fits know their uncertainty.
    is_measured: bool,
    mean: Point,
}

impl<'a> SetUps<'a> {
    /// `best` stands for the mean of a parameter that no set-up determines.
    pub(super) fn new(
        fits: &'a [PointFit],
        fit: &'a [Parameter],
        is_measured: bool,
        best: &Point,
    ) -> Self {
        // Known to a factor of e: a stiffness near a rigid joint may lie decades away, and would move the mean.
        const KNOWN: f64 = 1.0;
        let mut mean = *best;
        for (index, parameter) in fit.iter().enumerate() {
            let known = fits.iter().filter(|one| {
                let variance = one.covariance.get(index).and_then(|row| row.get(index));
                !is_measured || variance.is_some_and(|variance| *variance < KNOWN * KNOWN)
            });
            let values: Vec<f64> = known.map(|one| one.point[*parameter as usize]).collect();
            if !values.is_empty() {
                mean[*parameter as usize] = values.iter().sum::<f64>() / values.len() as f64;
            }
        }
        Self {
            fits,
            fit,
            is_measured,
            mean,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.fits.len()
    }

    /// Covariance of two coordinates of the mean joint, by the scatter of the set-ups. 0 below two.
    pub(super) fn of_mean(&self, first: &Point, second: &Point) -> f64 {
        let count = self.count() as f64;
        if count < 2.0 {
            return 0.0;
        }
        let fits = self.fits.iter();
        let sum: f64 = fits
            .map(|one| self.deviation(first, one) * self.deviation(second, one))
            .sum();
        sum / (count - 1.0) / count
    }

    /// Half of the 95 % interval of a coordinate of the mean joint.
    pub(super) fn half_of_mean(&self, gradient: &Point) -> f64 {
        self.student_95() * self.of_mean(gradient, gradient).sqrt()
    }

    /// Half of the 95 % interval of a coordinate of a further set-up about the mean of these.
    pub(super) fn half_of_further(&self, gradient: &Point) -> f64 {
        (self.count() as f64 + 1.0).sqrt() * self.half_of_mean(gradient)
    }

    fn student_95(&self) -> f64 {
        match self.count() {
            0 | 1 => NORMAL_95,
            count => student::quantile(0.05, count as f64 - 1.0),
        }
    }

    /// How far a coordinate of a set-up is from the mean; 0 where the set-up's own uncertainty explains it. A stiffness that
    /// its frequencies hardly feel, as near a rigid joint, may lie anywhere.
    fn deviation(&self, gradient: &Point, set_up: &PointFit) -> f64 {
        let fit = self.fit.iter().map(|parameter| *parameter as usize);
        let parts: Vec<(usize, f64)> = fit.map(|index| (index, gradient[index])).collect();
        // Inputs that are not estimated are the same in all set-ups.
        let mut estimated = [0.0; super::model::PARAMETERS];
        for (index, part) in &parts {
            estimated[*index] = *part;
        }
        let moved = value_along(&estimated, &set_up.point) - value_along(&estimated, &self.mean);
        let mut variance = 0.0;
        for (row, (_, first)) in parts.iter().enumerate() {
            for (column, (_, second)) in parts.iter().enumerate() {
                if self.is_measured && first * second != 0.0 {
                    let own = set_up.covariance.get(row).and_then(|row| row.get(column));
                    variance += first * second * own.copied().unwrap_or(f64::INFINITY);
                }
            }
        }
        if moved * moved > 4.0 * variance {
            moved
        } else {
            0.0
        }
    }
}
