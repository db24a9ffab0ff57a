//! Scatter between the recordings of one test, beyond each frequency's own uncertainty.

use super::analysis::BetweenRecordings;
use tapjoint_numerics::stats::chi_square_quantile;

/// From the frequencies of one mode and their standard uncertainties; `None` below two.
pub(super) fn between(readings: &[(f64, f64)]) -> Option<BetweenRecordings> {
    let freedom = readings
        .len()
        .checked_sub(1)
        .filter(|freedom| *freedom > 0)?;
    let count = readings.len() as f64;
    let mean = readings.iter().map(|one| one.0).sum::<f64>() / count;
    let squares: f64 = readings.iter().map(|one| (one.0 - mean).powi(2)).sum();
    let own: f64 = readings.iter().map(|one| one.1 * one.1).sum();
    Some(BetweenRecordings {
        variance: squares / freedom as f64 / (mean * mean),
        own: own / count / (mean * mean),
        freedom,
    })
}

/// The share of its frequency (1) by which every mode scatters between recordings beyond its own uncertainty.
///
/// That with which the squares are as large as expected, sum f variance/(own + share^2) = sum f with f degrees of
/// freedom each (in the manner of Paule & Mandel 1982, "Consensus values and weighting factors"): a mode that is read coarsely says
/// little, and one that stands still beside others that do not decides nothing by itself. 0 where there is no more
/// than noise.
pub(super) fn common_share(all: &[BetweenRecordings]) -> f64 {
    let freedom: f64 = all.iter().map(|one| one.freedom as f64).sum();
    if all.is_empty() || squares(all, 0.0) <= freedom {
        return 0.0;
    }
    // Without uncertainties of their own the mean variance would be the square: it is no larger.
    let mean = all
        .iter()
        .map(|one| one.freedom as f64 * one.variance)
        .sum::<f64>()
        / freedom;
    let (mut low, mut high) = (0.0, mean);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if squares(all, middle) > freedom {
            low = middle;
        } else {
            high = middle;
        }
    }
    high.sqrt()
}

/// Halvings of the interval in which the square lies: it is known to 1e-15 of its largest possible value.
const HALVINGS: usize = 50;

/// Sum of the squares over their variances, a common one included.
fn squares(all: &[BetweenRecordings], common: f64) -> f64 {
    let modes = all.iter();
    modes
        .map(|one| one.freedom as f64 * one.variance / (one.own + common))
        .sum()
}

/// Returns true if the recordings differ by more than their readings' uncertainty explains.
///
/// One test in a hundred does so by chance where the uncertainty is known and alike in all recordings; of a few taps,
/// several.
pub(super) fn exceeds_noise(all: &[BetweenRecordings]) -> bool {
    let freedom: usize = all.iter().map(|one| one.freedom).sum();
    chi_square_quantile(0.99, freedom as f64).is_some_and(|most| squares(all, 0.0) > most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Modes in three recordings, each drifting by a draw of its own of `share`, and read to its own relative standard
    /// deviation.
    fn drawn(stds: &[f64], share: f64, random: &mut ChaCha8Rng) -> Vec<BetweenRecordings> {
        let of_mode = |(mode, std): (usize, &f64)| {
            let nominal = 40.0 * (mode as f64 + 1.0).powi(2);
            let reading = |_| {
                let (own, drift): (f64, f64) =
                    (random.sample(StandardNormal), random.sample(StandardNormal));
                (nominal * (1.0 + std * own + share * drift), nominal * std)
            };
            between(&(0..3).map(reading).collect::<Vec<_>>()).unwrap()
        };
        stds.iter().enumerate().map(of_mode).collect()
    }

    const STDS: [f64; 5] = [1e-4, 5e-5, 2e-4, 1e-4, 5e-5];

    #[test]
    fn limit_one_reading_says_nothing_and_equal_ones_scatter_by_nothing() {
        assert_eq!(between(&[(40.0, 0.1)]), None);
        let still = between(&[(40.0, 0.1), (40.0, 0.1)]).unwrap();
        assert_eq!(common_share(&[still]), 0.0);
        assert_eq!(common_share(&[]), 0.0);
        assert!(!exceeds_noise(&[]) && !exceeds_noise(&[still]));
    }

    /// Over 400 tests of 10 degrees of freedom the mean square is known to sqrt(2/4000) = 2 % where the share is
    /// far above the readings' own; 8 % are four times that.
    #[test]
    fn recover_the_share_of_a_drift() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for share in [1e-3, 1e-2] {
            let squares = (0..400).map(|_| common_share(&drawn(&STDS, share, &mut random)).powi(2));
            let found = (squares.sum::<f64>() / 400.0).sqrt();
            assert!((found / share - 1.0).abs() < 0.04, "{found} for {share}");
        }
    }

    /// One in a hundred of 2000 is 20 with a standard deviation of 4.5; 40 are more than four of these.
    #[test]
    fn recover_readings_without_drift_seldom_differ_and_hardly_scatter() {
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let all: Vec<_> = (0..2000).map(|_| drawn(&STDS, 0.0, &mut random)).collect();
        let told = all.iter().filter(|one| exceeds_noise(one)).count();
        assert!((2..40).contains(&told), "{told}");
        // The finest readings are known to 5e-5 each; what ten degrees of freedom take for a share is below that.
        let mean = all.iter().map(|one| common_share(one)).sum::<f64>() / 2000.0;
        assert!(mean < 5e-5, "{mean}");
    }

    /// A mode that feels no drift, and is read best of all, does not hide that of the others.
    #[test]
    fn regress_one_mode_that_stands_still_does_not_hide_the_others() {
        let one = |variance: f64, own: f64| BetweenRecordings {
            variance,
            own,
            freedom: 2,
        };
        let found = common_share(&[one(0.5e-12, 1e-12), one(2.5e-5, 1e-8)]);
        // 4 = 2 variance/share^2, to the other mode's own variance.
        assert!(
            (found / (2.5e-5_f64 / 2.0).sqrt() - 1.0).abs() < 1e-3,
            "{found}"
        );
    }

    /// A mode read to 1 % may say that nothing drifted, with its two of twelve degrees of freedom: sqrt(12/10) is 1.1.
    #[test]
    fn limit_a_coarse_mode_says_little_beside_fine_ones() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut all = drawn(&STDS, 1e-3, &mut random);
        let without = common_share(&all);
        for off in [0.0, 0.3] {
            let coarse = between(&[(40.0 - off, 0.4), (40.0 + off, 0.4), (40.0, 0.4)]);
            all.push(coarse.unwrap());
            let with = common_share(&all);
            assert!((with / without - 1.0).abs() < 0.1, "{with} for {without}");
            all.pop();
        }
    }
}
