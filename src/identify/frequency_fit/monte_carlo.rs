//! Random errors of the frequencies carried through the estimate by repetition.

use super::estimator::{ConsistentEstimator, Neighbourhood};
use super::problem::REPEATED;
use crate::perturbation::{MonteCarlo, ReadingError};
use crate::{IdentifyError, Stiffnesses};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Repetitions that share one stream of random numbers: the answer depends on this division, and
/// not on how many threads work on it.
const CHUNK: usize = 256;

impl ConsistentEstimator {
    /// Repeats the estimate `samples` times with independent errors. The frequencies have their stated
    /// standard deviations and the discrepancy. `half_widths` (Hz), in the order of [`Self::frequencies`], say which
    /// part of each is uniform. What is not listed is normal. The beam's properties and the inputs have their tolerances.
    /// Each repetition starts from those minima of the first estimate that its errors can make the deepest, four at
    /// most. The body is that of the first estimate, and changes of the beam are followed to first order. This leaves
    /// less than a thousandth of a standard deviation.
    /// The result depends on the seed, not on the number of threads. Repetitions that do not converge count as
    /// failed.
    ///
    /// # Errors
    /// [`IdentifyError::NoUncertainty`] where a mode has no standard uncertainty.
    pub fn monte_carlo(
        &self,
        near: &Neighbourhood,
        half_widths: &[f64],
        samples: usize,
        seed: u64,
    ) -> Result<MonteCarlo, IdentifyError> {
        let mut errors = Vec::with_capacity(self.modes.len());
        for (index, mode) in self.modes.iter().enumerate() {
            let std = mode.std.filter(|std| std.is_finite());
            let std = std.ok_or(IdentifyError::NoUncertainty { mode: mode.mode })?;
            let half_width = half_widths.get(index).copied().unwrap_or(0.0);
            let error = ReadingError::new(std, half_width);
            errors.push(error.with_normal(self.discrepancy * mode.frequency));
        }
        let chunks: Vec<Vec<Stiffnesses>> = (0..samples.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream(chunk as u64);
                let count = CHUNK.min(samples - chunk * CHUNK);
                self.repeat(random, count, &errors, near)
            })
            .collect();
        Ok(MonteCarlo::of(samples, &chunks.concat()))
    }

    /// Returns the stiffnesses of those of `count` repetitions that converge.
    fn repeat(
        &self,
        mut random: ChaCha8Rng,
        count: usize,
        errors: &[ReadingError],
        near: &Neighbourhood,
    ) -> Vec<Stiffnesses> {
        let models = near.models.as_ref().unwrap_or(&self.models);
        let stated = self.problem(models, &self.frequencies());
        let mut found = Vec::with_capacity(count);
        for _ in 0..count {
            let mut problem = stated.clone();
            let mut moved: f64 = 0.0;
            for (datum, error) in problem.data.iter_mut().zip(errors) {
                let error = error.draw(&mut random);
                datum.frequency += error;
                moved = moved.hypot(error / datum.std);
            }
            for input in &self.inputs {
                let error: f64 = StandardNormal.sample(&mut random);
                for (datum, change) in problem.data.iter_mut().zip(&input.changes) {
                    datum.frequency *= 1.0 + change * error;
                }
                moved = moved.hypot(error);
            }
            // A stated property of the beam is a reading too, with its own error.
            for prior in &mut problem.priors {
                let error: f64 = StandardNormal.sample(&mut random);
                prior.value += prior.std * error;
                moved = moved.hypot(error);
            }
            if problem.data.iter().all(|datum| datum.frequency > 0.0) {
                let starts = near.starts_after(moved);
                let best = self.minima(&problem, &starts, &REPEATED).into_iter().next();
                let converged = best.filter(|best| best.stop.converged());
                found.extend(converged.map(|best| self.stiffnesses_at(&best.state.point)));
            }
        }
        found
    }
}
