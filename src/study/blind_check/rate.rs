//! A rate of right answers and what so many cases can say of it.

use statrs::distribution::{Beta, ContinuousCDF};

/// So many of so many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rate {
    /// Cases that count as hits.
    pub hits: usize,
    /// Cases that could have been hits.
    pub of: usize,
}

impl Rate {
    /// Of all cases for which `hit` says something.
    pub fn of<T>(
        cases: impl IntoIterator<Item = T>,
        mut hit: impl FnMut(T) -> Option<bool>,
    ) -> Self {
        let mut rate = Self::default();
        for case in cases {
            if let Some(hit) = hit(case) {
                rate.hits += usize::from(hit);
                rate.of += 1;
            }
        }
        rate
    }

    /// hits/of; `None` without a case.
    pub fn value(&self) -> Option<f64> {
        (self.of > 0).then(|| self.hits as f64 / self.of as f64)
    }

    /// The 95 % interval of the true rate (Clopper & Pearson 1934), which never covers less than it
    /// says: the rates at which so many hits or more, or so few or less, have a chance of 2.5 %.
    /// `None` without a case.
    pub fn interval(&self) -> Option<(f64, f64)> {
        if self.of == 0 {
            return None;
        }
        let quantile = |first: usize, second: usize, chance: f64| {
            Beta::new(first as f64, second as f64).map(|beta| beta.inverse_cdf(chance))
        };
        let misses = self.of - self.hits;
        let low = match self.hits {
            0 => 0.0,
            hits => quantile(hits, misses + 1, 0.025).unwrap_or(0.0),
        };
        let high = match misses {
            0 => 1.0,
            misses => quantile(self.hits + 1, misses, 0.975).unwrap_or(1.0),
        };
        Some((low, high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_intervals_of_clopper_and_pearson() {
        // scipy.stats.binomtest(k, n).proportion_ci(): 8 of 10, 0 of 100, 100 of 100.
        let close = |rate: Rate, low: f64, high: f64| {
            let (l, h) = rate.interval().expect("there are cases");
            // The digits of the table.
            assert!(
                (l - low).abs() < 1e-6 && (h - high).abs() < 1e-6,
                "{rate:?}: {l} {h}"
            );
        };
        close(Rate { hits: 8, of: 10 }, 0.443_905, 0.974_789);
        close(Rate { hits: 0, of: 100 }, 0.0, 0.036_217);
        close(Rate { hits: 100, of: 100 }, 0.963_783, 1.0);
    }

    #[test]
    fn limit_no_case_has_no_rate() {
        assert_eq!(
            (Rate::default().value(), Rate::default().interval()),
            (None, None)
        );
        let rate = Rate::of([Some(true), None, Some(false)], |hit| hit);
        assert_eq!(rate, Rate { hits: 1, of: 2 });
    }
}
