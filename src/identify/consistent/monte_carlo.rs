//! Random errors of the frequencies carried through the consistent estimate by repetition.

use super::estimator::ConsistentEstimator;
use super::model::Point;
use super::quantities::Quantity;
use crate::identify::IdentifyError;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Repetitions that share one stream of random numbers: the answer depends on this division, and
/// not on how many threads work on it.
const CHUNK: usize = 256;

/// Distribution of one quantity over the repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuantitySpread {
    /// Which.
    pub quantity: Quantity,
    /// Median, in the quantity's unit.
    pub median: f64,
    /// 2.5 % point.
    pub low: f64,
    /// 97.5 % point.
    pub high: f64,
}

/// Estimates from randomly disturbed frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentMonteCarlo {
    /// Repetitions.
    pub samples: usize,
    /// How many did not converge.
    pub failed: usize,
    /// Every estimated quantity but Kz and Ktr, which a coupling near zero makes infinite.
    pub spreads: Vec<QuantitySpread>,
}

impl ConsistentEstimator {
    /// Repeats the estimate `samples` times with independent normal errors of the frequencies of
    /// their stated standard deviations, each repetition from every valley of the first estimate.
    /// The same seed gives the same answer on any number of threads.
    ///
    /// # Errors
    /// [`IdentifyError::NoUncertainty`] where a mode has no standard uncertainty.
    pub fn monte_carlo(
        &self,
        samples: usize,
        seed: u64,
    ) -> Result<ConsistentMonteCarlo, IdentifyError> {
        let mut errors = Vec::with_capacity(self.modes.len());
        for mode in &self.modes {
            let std = mode.std.filter(|std| std.is_finite());
            let std = std.ok_or(IdentifyError::NoUncertainty { mode: mode.mode })?;
            errors.push((mode.frequency, std));
        }
        let first = self.fit();
        let mut starts = vec![first.point];
        starts.extend(first.others.iter().map(|(_, point)| *point));
        let chunks: Vec<Vec<Option<Point>>> = (0..samples.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let count = CHUNK.min(samples - chunk * CHUNK);
                self.repeat((seed, chunk as u64), count, (&errors, &starts))
            })
            .collect();
        let found: Vec<Point> = chunks.into_iter().flatten().flatten().collect();
        let quantities = self
            .settings
            .fit
            .iter()
            .flat_map(|parameter| Quantity::of(*parameter).iter().copied())
            .filter(|quantity| !matches!(quantity, Quantity::Kz | Quantity::Ktr));
        Ok(ConsistentMonteCarlo {
            samples,
            failed: samples - found.len(),
            spreads: quantities
                .filter_map(|quantity| spread(quantity, &found))
                .collect(),
        })
    }

    fn repeat(
        &self,
        (seed, stream): (u64, u64),
        count: usize,
        (errors, starts): (&[(f64, f64)], &[Point]),
    ) -> Vec<Option<Point>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        let mut disturbed = vec![0.0; errors.len()];
        (0..count)
            .map(|_| {
                for (frequency, (mean, std)) in disturbed.iter_mut().zip(errors) {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    *frequency = mean + std * normal;
                }
                if disturbed.iter().any(|frequency| *frequency <= 0.0) {
                    return None;
                }
                let fit = self.refit(&disturbed, starts);
                fit.stop.converged().then_some(fit.point)
            })
            .collect()
    }
}

fn spread(quantity: Quantity, points: &[Point]) -> Option<QuantitySpread> {
    let mut sorted: Vec<f64> = points
        .iter()
        .filter_map(|point| quantity.value(point))
        .collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)? as f64;
    let at = |share: f64| sorted[(share * last).round() as usize];
    Some(QuantitySpread {
        quantity,
        median: at(0.5),
        low: at(0.025),
        high: at(0.975),
    })
}
