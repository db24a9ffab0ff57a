//! Random errors of the frequencies carried through the consistent estimate by repetition.

use super::estimator::{ConsistentEstimator, Neighbourhood};
use super::model::Point;
use super::quantities::Quantity;
use crate::monte_carlo::{self, MonteCarlo, Spread};
use crate::{IdentifyError, Stiffnesses};
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
    /// The non-dimensional stiffnesses, Kz by way of its reciprocal.
    pub joint: MonteCarlo,
}

impl ConsistentEstimator {
    /// Repeats the estimate `samples` times with independent normal errors of the frequencies of
    /// their stated standard deviations, and of the properties of the beam that have a tolerance of
    /// theirs, each repetition from every valley of the first estimate. The body is that of the first
    /// estimate: what a repetition moves of the beam is followed to first order, which leaves less
    /// than a thousandth of a standard deviation. The same seed gives the same answer on any number
    /// of threads.
    ///
    /// # Errors
    /// [`IdentifyError::NoUncertainty`] where a mode has no standard uncertainty.
    pub fn monte_carlo(
        &self,
        samples: usize,
        seed: u64,
    ) -> Result<ConsistentMonteCarlo, IdentifyError> {
        self.monte_carlo_near(&self.neighbourhood(), samples, seed)
    }

    /// The same from a [`ConsistentEstimator::neighbourhood`] that is known already.
    ///
    /// # Errors
    /// As [`ConsistentEstimator::monte_carlo`].
    pub fn monte_carlo_near(
        &self,
        near: &Neighbourhood,
        samples: usize,
        seed: u64,
    ) -> Result<ConsistentMonteCarlo, IdentifyError> {
        let mut errors = Vec::with_capacity(self.modes.len());
        for mode in &self.modes {
            let std = mode.std.filter(|std| std.is_finite());
            let std = std.ok_or(IdentifyError::NoUncertainty { mode: mode.mode })?;
            errors.push((mode.frequency, std));
        }
        let chunks: Vec<Vec<Option<Point>>> = (0..samples.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let count = CHUNK.min(samples - chunk * CHUNK);
                self.repeat((seed, chunk as u64), count, (&errors, near))
            })
            .collect();
        let found: Vec<Point> = chunks.into_iter().flatten().flatten().collect();
        let quantities = self
            .settings
            .fit
            .iter()
            .flat_map(|parameter| Quantity::of(*parameter).iter().copied())
            .filter(|quantity| !matches!(quantity, Quantity::Kz | Quantity::Ktr));
        let joints: Vec<Stiffnesses> = found.iter().map(|at| self.stiffnesses_at(at)).collect();
        Ok(ConsistentMonteCarlo {
            joint: MonteCarlo::of(samples, &joints),
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
        (errors, near): (&[(f64, f64)], &Neighbourhood),
    ) -> Vec<Option<Point>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        let model = near.model.as_ref().unwrap_or(&self.model);
        let stated = self.problem(model, &self.frequencies());
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        (0..count)
            .map(|_| {
                let mut problem = stated.clone();
                for (datum, (mean, std)) in problem.data.iter_mut().zip(errors) {
                    datum.frequency = mean + std * normal();
                }
                // What is stated of the beam is a reading too, with its own error.
                for prior in &mut problem.priors {
                    prior.value += prior.std * normal();
                }
                if problem.data.iter().any(|datum| datum.frequency <= 0.0) {
                    return None;
                }
                self.rescale(&mut problem, &near.starts);
                let best = self.valleys(&problem, &near.starts).into_iter().next()?;
                best.stop.converged().then_some(best.at.point)
            })
            .collect()
    }
}

fn spread(quantity: Quantity, points: &[Point]) -> Option<QuantitySpread> {
    let values = points.iter().filter_map(|point| quantity.value(point));
    let Spread { median, low, high } = monte_carlo::spread(values)?;
    Some(QuantitySpread {
        quantity,
        median,
        low,
        high,
    })
}
