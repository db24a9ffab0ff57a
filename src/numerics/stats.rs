//! Small statistics that several stages share; knows nothing of taps or beams.

pub mod student;

use statrs::distribution::{ChiSquared, ContinuousCDF};

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

/// Root of the mean square, sqrt(sum x^2/n), in the unit of the values; 0 of nothing.
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Ratio beyond which its size says nothing more.
const MOST_TIMES: f64 = 1000.0;

/// A ratio of a size to its uncertainty as a text has it, "2.4" or "120": two digits below a hundred, and
/// "more than 1000" where the uncertainty is next to nothing.
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

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(root_mean_square(&[1.0, 7.0]), 5.0);
    }
}
