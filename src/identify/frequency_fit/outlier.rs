//! One mode that does not belong to the others: a wrong peak, a wrong number, a reading spoiled.
//!
//! Each mode is left out in turn. The fall of chi-squared is the square of its deviation from what the others predict, in
//! standard deviations of that prediction (Cook & Weisberg 1982, 2.2). A mode is an outlier where all of this holds:
//! 1. with all modes the model fails, with the least discrepancy: probability below [`FAILS`];
//! 2. without the mode it explains the rest: probability above [`EXPLAINS`];
//! 3. the mode deviates by [`DEVIATION`] standard deviations or more;
//! 4. no other mode left out explains the rest as well: its probability is below a twentieth of the best one's;
//! 5. the rest has two modes more than parameters to be tested by.
//!
//! What a model misses in all modes is no outlier: then the rest is not explained either.

use super::ResidualWeights;
use super::estimator::ConsistentEstimator;
use super::model::Point;
use super::problem::FULL;
use super::uncertainty::LEAST_DISCREPANCY;
use tapjoint_numerics::stats::chi_square_tail;

const FAILS: f64 = 1e-3;
const EXPLAINS: f64 = 0.02;
const DEVIATION: f64 = 4.0;
const SECOND: f64 = 0.05;

/// A mode that does not belong to the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlyingMode {
    /// Its number.
    pub mode: usize,
    /// Measured less predicted by the other modes, in percent of the prediction.
    pub percent: f64,
    /// The same in standard deviations of that prediction, its own reading included.
    pub deviations: f64,
    /// Probability of a larger misfit with all modes.
    pub goodness: f64,
    /// Probability of a larger misfit of the other modes.
    pub goodness_without: f64,
}

/// A fit without one mode.
struct Without {
    index: usize,
    misfit: f64,
    /// Frequency (Hz) that the others predict.
    predicted: f64,
}

impl ConsistentEstimator {
    /// Returns the mode of the described structure that does not belong to the others; `None` where there is none, or no
    /// rule finds it. The estimator has to be [`Self::settled`].
    pub fn outlying_mode(&self) -> Option<OutlyingMode> {
        let described = self.structures.iter().filter(|index| **index == 0).count();
        let unknowns = self.settings.fit.len();
        let is_tested = self.settings.weights == ResidualWeights::Measured
            && self.settings.discrepancy
            && described >= unknowns + 3;
        let goodness = self.goodness?.probability?;
        if !is_tested || goodness >= FAILS {
            return None;
        }
        let mut floor = self.clone();
        floor.discrepancy = LEAST_DISCREPANCY;
        let frequencies = floor.frequencies();
        let (renewed, minima) = floor.solve(&frequencies);
        let models = renewed.unwrap_or_else(|| floor.models.clone());
        let all = minima.first()?.state.cost;
        let starts: Vec<Point> = minima.iter().map(|minimum| minimum.state.point).collect();
        let known = floor.modes.len() + floor.priors().len();
        let freedom = (known - 1).saturating_sub(floor.directions().len()) as f64;
        let mut fits = Vec::with_capacity(described);
        for index in 0..described {
            let rest = floor.without(index);
            let own = rest.frequencies();
            let best = rest.minima(&rest.problem(&models, &own), &starts, &FULL);
            let best = best.into_iter().next()?;
            let mode = floor.modes[index];
            let guess = floor.models[0]
                .beam_at(&best.state.point)
                .lambda_of(mode.frequency);
            let response = models[0].response(&best.state.point, mode.mode, guess);
            fits.push(Without {
                index,
                misfit: best.state.cost,
                predicted: response.frequency,
            });
        }
        fits.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        let [best, second, ..] = &fits[..] else {
            return None;
        };
        let [own, other] = [best, second].map(|fit| chi_square_tail(fit.misfit, freedom));
        let deviations = (all - best.misfit).max(0.0).sqrt();
        let is_outlier = own > EXPLAINS && other < SECOND * own && deviations >= DEVIATION;
        let mode = floor.modes[best.index];
        let percent = 100.0 * (mode.frequency / best.predicted - 1.0);
        is_outlier.then_some(OutlyingMode {
            mode: mode.mode,
            percent,
            deviations: deviations.copysign(percent),
            goodness,
            goodness_without: own,
        })
    }

    /// Returns the estimator without one of its modes, counted from 0. It is to be [`Self::settled`] anew.
    ///
    /// # Panics
    /// Where there is no such mode.
    #[must_use]
    pub fn without(&self, index: usize) -> Self {
        let mut rest = self.clone();
        rest.goodness = None;
        rest.modes.remove(index);
        rest.structures.remove(index);
        for input in &mut rest.inputs {
            input.changes.remove(index);
        }
        rest
    }
}
