//! Student's distribution.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Two-sided probability of a larger |t| with `freedom` degrees of freedom; 1 without any.
pub fn two_sided(t: f64, freedom: f64) -> f64 {
    if !t.is_finite() {
        return 0.0;
    }
    StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |student| 2.0 * student.cdf(-t.abs()))
}

/// |t| that is exceeded with the probability `level`; infinite without a degree of freedom.
pub fn quantile(level: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |student| {
        student.inverse_cdf(1.0 - 0.5 * level)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_tabulated_quantiles() {
        // Any table of Student's distribution, 5 % two-sided.
        let table = [(1.0, 12.706), (2.0, 4.303), (5.0, 2.571), (30.0, 2.042)];
        for (freedom, t) in table {
            assert!((quantile(0.05, freedom) - t).abs() < 6e-4, "{freedom}");
        }
    }

    #[test]
    fn prop_the_quantile_is_the_inverse() {
        for (level, freedom) in [(0.5, 1.0), (0.05, 3.0), (1e-4, 8.0), (0.3, 400.0)] {
            let t = quantile(level, freedom);
            // Both are exact to some parts in 1e9.
            assert!(
                (two_sided(t, freedom) / level - 1.0).abs() < 1e-7,
                "{level}"
            );
        }
    }
}
