//! How far the recordings of one test are apart, beyond what each frequency's own uncertainty explains.

use super::analysis::ModeResult;
use crate::modal::ModeReading;
use crate::stats::chi_square_quantile;

/// One mode in the recordings of one configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BetweenRecordings {
    /// Variance of its frequency between the recordings, sum (f - mean)^2/(n - 1), over the mean's square (1).
    pub variance: f64,
    /// What the readings' own standard uncertainties make of that, over the same (1).
    pub own: f64,
    /// Recordings less one.
    pub freedom: usize,
}

/// From the readings of one mode that have an uncertainty; `None` below two.
pub(super) fn between(readings: &[ModeReading]) -> Option<BetweenRecordings> {
    let known = |reading: &ModeReading| {
        let std = reading.std.filter(|std| *std > 0.0)?;
        Some((reading.frequency, std))
    };
    of_known(&readings.iter().filter_map(known).collect::<Vec<_>>())
}

/// From frequencies and their standard uncertainties.
fn of_known(readings: &[(f64, f64)]) -> Option<BetweenRecordings> {
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

/// Steps of the iteration for the common share: each changes it by less than the one before, and ten leave less
/// than a tenth of a percent.
const ROUNDS: usize = 10;

/// The share of its frequency (1) by which every mode scatters between recordings beyond its own uncertainty.
///
/// The variances less what is expected of them, weighed by the inverse of their own variance, which is
/// 2 (own + share^2)^2/freedom (after DerSimonian & Laird 1986, iterated): a mode that is read coarsely says
/// little, and where the share is large all count alike. 0 where there is no more than noise.
pub(super) fn scatter(modes: &[ModeResult]) -> f64 {
    common_share(&of_modes(modes))
}

fn common_share(all: &[BetweenRecordings]) -> f64 {
    let mut square = 0.0;
    for _ in 0..ROUNDS {
        let (mut weights, mut sum) = (0.0, 0.0);
        for one in all {
            let weight = one.freedom as f64 / (one.own + square).powi(2);
            weights += weight;
            sum += weight * (one.variance - one.own);
        }
        if weights > 0.0 {
            square = (sum / weights).max(0.0);
        }
    }
    square.sqrt()
}

/// Whether the recordings differ by more than single readings, as one test in a hundred does by chance.
pub(super) fn differ(modes: &[ModeResult]) -> bool {
    exceeds_noise(&of_modes(modes))
}

fn exceeds_noise(all: &[BetweenRecordings]) -> bool {
    let ratios = all
        .iter()
        .map(|one| one.freedom as f64 * one.variance / one.own);
    let freedom: usize = all.iter().map(|one| one.freedom).sum();
    chi_square_quantile(0.99, freedom as f64).is_some_and(|most| ratios.sum::<f64>() > most)
}

fn of_modes(modes: &[ModeResult]) -> Vec<BetweenRecordings> {
    modes.iter().filter_map(|mode| mode.between).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Modes in three recordings between which all drift by their own draw of `share`; each is read to its own
    /// relative standard deviation.
    fn drawn(stds: &[f64], share: f64, random: &mut ChaCha8Rng) -> Vec<BetweenRecordings> {
        let of_mode = |(mode, std): (usize, &f64)| {
            let nominal = 40.0 * (mode as f64 + 1.0).powi(2);
            let reading = |_| {
                let (own, drift): (f64, f64) =
                    (random.sample(StandardNormal), random.sample(StandardNormal));
                (nominal * (1.0 + std * own + share * drift), nominal * std)
            };
            of_known(&(0..3).map(reading).collect::<Vec<_>>()).unwrap()
        };
        stds.iter().enumerate().map(of_mode).collect()
    }

    const STDS: [f64; 5] = [1e-4, 5e-5, 2e-4, 1e-4, 5e-5];

    #[test]
    fn limit_one_reading_says_nothing_and_equal_ones_scatter_by_nothing() {
        assert_eq!(of_known(&[(40.0, 0.1)]), None);
        let still = of_known(&[(40.0, 0.1), (40.0, 0.1)]).unwrap();
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
        // The finest readings are known to 5e-5 each, and a share that is not there is below that.
        let mean = all.iter().map(|one| common_share(one)).sum::<f64>() / 2000.0;
        assert!(mean < 3e-5, "{mean}");
    }

    /// A mode read to 1 % scatters by that; the others, read to 0.01 %, know that nothing drifted.
    #[test]
    fn limit_a_coarse_mode_says_little_beside_fine_ones() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let coarse = of_known(&[(40.0, 0.4), (41.0, 0.4), (39.2, 0.4)]).unwrap();
        let mut all = drawn(&STDS, 0.0, &mut random);
        let without = common_share(&all);
        all.push(coarse);
        assert!((common_share(&all) - without).abs() < 1e-5);
    }
}
