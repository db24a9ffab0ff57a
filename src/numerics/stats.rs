//! Small statistics that several stages share; knows nothing of taps or beams.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Half width of a 95 % interval of a normal distribution, in standard deviations.
pub const NORMAL_95: f64 = 1.959_964;

/// Median (the upper one of an even count), in the unit of the values; 0 of nothing. Reorders them.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

/// Values in ascending order, of which one comes and one goes from place to place.
#[derive(Debug, Clone, Default)]
pub struct Sorted(Vec<f64>);

impl Sorted {
    /// Takes these values.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        Sorted(values)
    }

    /// Adds a value.
    pub fn insert(&mut self, value: f64) {
        self.0.insert(self.place(value), value);
    }

    /// Takes a value out that is there.
    pub fn remove(&mut self, value: f64) {
        self.0.remove(self.place(value));
    }

    /// The same as [`median`].
    pub fn median(&self) -> f64 {
        self.0.get(self.0.len() / 2).copied().unwrap_or(0.0)
    }

    fn place(&self, value: f64) -> usize {
        self.0.partition_point(|own| own.total_cmp(&value).is_lt())
    }
}

/// Root of the mean square, sqrt(sum x^2/n), in the unit of the values; 0 of nothing.
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Largest ratio that is written with its size.
const MOST_TIMES: f64 = 1000.0;

/// Magnitude of a ratio (of a size to its uncertainty, say) in words: "0.25", "2.4", "120", or "more than 1000".
pub fn times(ratio: f64) -> String {
    match ratio.abs() {
        size if size > MOST_TIMES => format!("more than {MOST_TIMES:.0}"),
        size if size >= 9.95 => format!("{size:.0}"),
        size if size >= 0.995 => format!("{size:.1}"),
        size => format!("{size:.2}"),
    }
}

/// Value that chi square of `freedom` degrees of freedom stays below with this probability; `None` without
/// a degree of freedom.
pub fn chi_square_quantile(probability: f64, freedom: f64) -> Option<f64> {
    let chi_square = ChiSquared::new(freedom).ok()?;
    Some(chi_square.inverse_cdf(probability))
}

/// Returns the probability that chi square of `freedom` degrees of freedom exceeds a value; 1 without a
/// degree of freedom.
pub fn chi_square_tail(value: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom).map_or(1.0, |chi_square| chi_square.sf(value))
}

/// Returns the probability that the ratio of two mean squares, of `above` and `below` degrees of freedom, exceeds a value; 1
/// without a degree of freedom, or for a value that is no number.
pub fn fisher_tail(value: f64, above: f64, below: f64) -> f64 {
    if value.is_nan() {
        return 1.0;
    }
    FisherSnedecor::new(above, below).map_or(1.0, |fisher| fisher.sf(value))
}

/// Student's distribution.
pub mod student {
    use statrs::distribution::{ContinuousCDF, StudentsT};

    /// Returns what a standardised residual contributes to the sum of squares: -2 ln p = (nu + 1) ln(1 + r^2/nu), up
    /// to a constant. A wild value hardly counts.
    pub fn loss(residual: f64, freedom: f64) -> f64 {
        (freedom + 1.0) * (residual * residual / freedom).ln_1p()
    }

    /// Returns the weight of the residual's square in the linearised problem, (nu + 1)/(nu + r^2).
    pub fn weight(residual: f64, freedom: f64) -> f64 {
        (freedom + 1.0) / (freedom + residual * residual)
    }

    /// Two-sided probability of a larger |t| with `freedom` degrees of freedom; 1 without any, or for a t that is no
    /// number.
    pub fn two_sided(t: f64, freedom: f64) -> f64 {
        if t.is_nan() {
            return 1.0;
        }
        if t.is_infinite() {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_fishers_tail_has_its_tabled_values() {
        // Upper 5 % points F(4, 10) = 3.478 and F(10, 4) = 5.964 (Box, Hunter & Hunter 1978, table D).
        assert!((fisher_tail(3.478, 4.0, 10.0) - 0.05).abs() < 1e-4);
        assert!((fisher_tail(5.964, 10.0, 4.0) - 0.05).abs() < 1e-4);
        assert_eq!(fisher_tail(1.0, 0.0, 4.0), 1.0);
    }

    #[test]
    fn regress_a_ratio_has_the_digits_that_say_something() {
        let written = [0.0, 0.25, 0.999, 2.44, 9.96, 120.4, 1000.0, 1000.1, 4e6];
        let expected = [
            "0.00",
            "0.25",
            "1.0",
            "2.4",
            "10",
            "120",
            "1000",
            "more than 1000",
            "more than 1000",
        ];
        assert_eq!(written.map(times), expected);
        assert_eq!(times(-3.0), "3.0");
        assert_eq!(times(f64::INFINITY), "more than 1000");
    }

    #[test]
    fn limit_nothing_one_and_an_even_count() {
        assert_eq!((median(&mut []), root_mean_square(&[])), (0.0, 0.0));
        assert_eq!(
            (median(&mut [-3.0]), root_mean_square(&[-3.0])),
            (-3.0, 3.0)
        );
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 3.0);
        let mut sorted = Sorted::of(vec![4.0, 3.0, 2.0, 5.0]);
        sorted.remove(5.0);
        sorted.insert(1.0);
        assert_eq!((sorted.median(), Sorted::default().median()), (3.0, 0.0));
        assert_eq!(root_mean_square(&[1.0, 7.0]), 5.0);
    }

    #[test]
    fn val_chi_square_tail() {
        // Percentage points of chi square from printed tables, to their last digit.
        let table = [
            (3.841_459, 1.0, 0.05),
            (5.991_465, 2.0, 0.05),
            (7.814_728, 3.0, 0.05),
            (11.344_867, 3.0, 0.01),
            (18.307_038, 10.0, 0.05),
            (0.351_846, 3.0, 0.95),
            (30.577_914, 15.0, 0.01),
        ];
        for (value, freedom, expected) in table {
            let found = chi_square_tail(value, freedom);
            assert!(
                (found / expected - 1.0).abs() < 2e-6,
                "{value} with {freedom}: {found}"
            );
        }
        let far_out = chi_square_tail(100.0, 1.0);
        assert!((far_out / 1.523_970_6e-23 - 1.0).abs() < 1e-6, "{far_out}");
        assert_eq!(chi_square_tail(f64::INFINITY, 2.0), 0.0);
        assert_eq!(chi_square_tail(1e9, 2.0), 0.0);
    }

    #[test]
    fn val_tabulated_student_quantiles() {
        // Any table of Student's distribution, 5 % two-sided.
        let table = [(1.0, 12.706), (2.0, 4.303), (5.0, 2.571), (30.0, 2.042)];
        for (freedom, t) in table {
            assert!(
                (student::quantile(0.05, freedom) - t).abs() < 6e-4,
                "{freedom}"
            );
        }
    }

    #[test]
    fn prop_the_student_quantile_is_the_inverse() {
        for (level, freedom) in [(0.5, 1.0), (0.05, 3.0), (1e-4, 8.0), (0.3, 400.0)] {
            let t = student::quantile(level, freedom);
            // Both are exact to some parts in 1e9.
            assert!(
                (student::two_sided(t, freedom) / level - 1.0).abs() < 1e-7,
                "{level}"
            );
        }
    }
}
