//! Random errors of the frequencies, carried through an estimator by repetition.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::IdentifyError;
use super::perturbation::Stiffnesses;

/// Middle and 95 % interval of a parameter over the repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Median (1).
    pub median: f64,
    /// 2.5 % point (1).
    pub low: f64,
    /// 97.5 % point (1).
    pub high: f64,
}

/// So many of the estimates are kept one by one: enough for a picture.
pub const KEPT: usize = 1000;

/// Estimates from randomly disturbed frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct MonteCarlo {
    /// Repetitions.
    pub samples: usize,
    /// How many of them had no estimate.
    pub failed: usize,
    /// Kx; `None` where no repetition has an estimate.
    pub kx: Option<Spread>,
    /// Ky.
    pub ky: Option<Spread>,
    /// Kz; of 1/Kz, turned back, so that a Kz near infinity of either sign does no harm; `None`
    /// where the interval of 1/Kz contains 0.
    pub kz: Option<Spread>,
    /// The first [`KEPT`] estimates.
    pub cloud: Vec<Stiffnesses>,
}

impl MonteCarlo {
    /// From the estimates of `samples` repetitions, those without one left out.
    pub fn of(samples: usize, found: &[Stiffnesses]) -> Self {
        let each = |pick: fn(&Stiffnesses) -> f64| spread(found.iter().map(pick));
        let compliance = spread(found.iter().filter_map(|e| e.kz).map(f64::recip));
        Self {
            samples,
            failed: samples - found.len(),
            kx: each(|estimate| estimate.kx),
            ky: each(|estimate| estimate.ky),
            kz: compliance.filter(|c| c.low * c.high > 0.0).map(|c| Spread {
                median: 1.0 / c.median,
                low: 1.0 / c.high,
                high: 1.0 / c.low,
            }),
            cloud: found.iter().take(KEPT).copied().collect(),
        }
    }
}

/// Repeats the estimate `samples` times with independent normal errors of the frequencies (Hz) of
/// these standard deviations (Hz). The same seed gives the same answer.
///
/// # Errors
/// [`IdentifyError::Bounds`] unless there is one standard deviation for each frequency.
pub fn monte_carlo(
    frequencies: &[f64],
    stds: &[f64],
    (samples, seed): (usize, u64),
    estimator: impl Fn(&[f64]) -> Option<Stiffnesses>,
) -> Result<MonteCarlo, IdentifyError> {
    if frequencies.len() != stds.len() {
        return Err(IdentifyError::Bounds {
            frequencies: frequencies.len(),
            bounds: stds.len(),
        });
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::with_capacity(samples);
    for _ in 0..samples {
        let disturbed: Vec<f64> = frequencies
            .iter()
            .zip(stds)
            .map(|(frequency, std)| {
                let normal: f64 = StandardNormal.sample(&mut random);
                frequency + std * normal
            })
            .collect();
        found.extend(estimator(&disturbed));
    }
    Ok(MonteCarlo::of(samples, &found))
}

/// Median and 95 % interval; an infinite value, a rigid joint, counts as the largest there is.
pub(super) fn spread(values: impl Iterator<Item = f64>) -> Option<Spread> {
    let mut sorted: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)? as f64;
    let at = |share: f64| sorted[(share * last).round() as usize];
    Some(Spread {
        median: at(0.5),
        low: at(0.025),
        high: at(0.975),
    })
}
