//! Probability of the measured changes, given a predicted one.
//!
//! The measured change of each mode is the predicted one, plus scatter between set-ups. Its covariance is
//! r^2 ((1 - c) I + c 1 1') + sum of g g' + (e d)^2 + (e/2)^2 d d':
//!
//! - r: the repeatability; readings that are worse, or not held in it, have a variance of their own. So has taking a mode to another
//!   level
//! - c: correlation of the scatter of two modes
//! - g: change of the prediction with the joint one standard deviation aside, for each of its axes; of a sensor that was moved
//!   also with its place aside
//! - d: predicted and described change together. It has the relative error e in each mode, and half of it in all

use crate::model::{PairModel, Predicted};
use crate::test::Settings;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::f64::consts::PI;
use tapjoint_numerics::stats::chi_square_tail;

/// Median of the repeatability where nothing is known of it (1), and spread of its logarithm: frequencies of a beam that
/// is set up again scatter by 0.05 to 0.4 %.
const USUAL_REPEATABILITY: f64 = 1e-3;
const USUAL_SPREAD: f64 = 0.8;
/// Steps over a repeatability that is not known, in its logarithm, to either side, and how many spreads they reach.
const STEPS: i32 = 12;
const REACH: f64 = 3.5;

/// Goodness of fit below which a cause does not explain the changes.
pub(crate) const NO_FIT: f64 = 0.01;
/// Correlation of the scatter of two modes: temperature and a joint that settles move all frequencies in common.
pub(crate) const SCATTER_CORRELATION: f64 = 0.25;
/// Error that the predicted changes of all modes have in common, over that of one.
const COMMON_SHARE: f64 = 0.5;

/// A value of the repeatability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scatter {
    /// Standard deviation of the difference between two tests of one state (1).
    pub(crate) std: f64,
    /// Logarithm of its weight.
    pub(crate) log_weight: f64,
}

/// Returns the values of the repeatability with their weights, which add up to 1.
pub(crate) fn scatters(pairs: &[PairModel], settings: &Settings) -> Vec<Scatter> {
    if let Some(std) = settings.repeatability {
        return vec![Scatter {
            std,
            log_weight: 0.0,
        }];
    }
    // The grid lies about what prior and repeats say together.
    let (mut squares, mut freedom) = (0.0, 0.0);
    for pair in pairs {
        // Correlated modes tell less of their variance: m of them as much as m/(1 + (m - 1) c^2).
        let others = pair.modes.len() as f64 - 1.0;
        let repeated = 1.0 + others * SCATTER_CORRELATION * SCATTER_CORRELATION;
        squares += pair.repeat_squares / repeated;
        freedom += pair.repeat_freedom / repeated;
    }
    let (mut centre, mut spread) = (USUAL_REPEATABILITY.ln(), USUAL_SPREAD);
    if freedom > 0.0 && squares > 0.0 {
        // The difference of two tests has twice the variance of one.
        let of_repeats = 0.5 * (2.0 * squares / freedom).ln();
        let precision = USUAL_SPREAD.powi(-2);
        centre = (precision * centre + 2.0 * freedom * of_repeats) / (precision + 2.0 * freedom);
        spread = (precision + 2.0 * freedom).powf(-0.5);
    }
    let mut all = Vec::new();
    for step in -STEPS..=STEPS {
        let log_std = centre + REACH * spread * f64::from(step) / f64::from(STEPS);
        let away = (log_std - USUAL_REPEATABILITY.ln()) / USUAL_SPREAD;
        let variance = 0.5 * (2.0 * log_std).exp();
        all.push(Scatter {
            std: log_std.exp(),
            log_weight: -0.5 * (away * away + freedom * variance.ln() + squares / variance),
        });
    }
    let total = log_sum(all.iter().map(|one| one.log_weight));
    for one in &mut all {
        one.log_weight -= total;
    }
    // What is next to impossible takes time and changes nothing.
    all.retain(|one| one.log_weight > -16.0);
    all
}

/// Returns the logarithm of a sum of exponentials.
pub(crate) fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return most;
    }
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}

/// Returns the covariance of the measured changes by scatter, readings and other levels alone.
pub(crate) fn errors(pair: &PairModel, std: f64, is_stated: bool) -> DMatrix<f64> {
    let scatter = std * std * pair.scatter_share;
    let count = pair.modes.len();
    let mut errors = DMatrix::from_element(count, count, SCATTER_CORRELATION * scatter);
    // A stated repeatability and the scatter of repeats hold the readings' own noise. An assumed one does not.
    let holds_readings = is_stated || pair.repeat_freedom > 0.0;
    for (k, (reading, moved)) in pair.reading.iter().zip(&pair.moved).enumerate() {
        let at_own_level = match holds_readings {
            true => scatter.max(*reading),
            false => scatter + reading,
        };
        errors[(k, k)] = at_own_level + moved;
    }
    errors
}

/// Returns the covariance of the measured changes: scatter and readings, and the uncertainty of what is predicted and of what
/// the descriptions tell.
pub(crate) fn covariance(
    pair: &PairModel,
    errors: &DMatrix<f64>,
    predicted: &Predicted,
) -> DMatrix<f64> {
    let count = pair.modes.len();
    let mut covariance = errors.clone();
    let common = (COMMON_SHARE * pair.shape_error).powi(2);
    let both = predicted.change.iter().zip(&pair.described);
    let total: Vec<f64> = both.map(|(change, described)| change + described).collect();
    for (i, one) in total.iter().enumerate() {
        covariance[(i, i)] += (pair.shape_error * one).powi(2);
        for (j, other) in total.iter().enumerate() {
            covariance[(i, j)] += common * one * other;
        }
    }
    for axis in 0..pair.described_aside.len().max(predicted.aside.len()) {
        let mut aside = vec![0.0; count];
        for own in [&pair.described_aside, &predicted.aside] {
            if let Some(own) = own.get(axis) {
                aside.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
            }
        }
        for i in 0..count {
            for j in 0..count {
                covariance[(i, j)] += aside[i] * aside[j];
            }
        }
    }
    covariance
}

/// A covariance and its factor.
pub(crate) struct Factored {
    factor: Cholesky<f64, Dyn>,
    log_determinant: f64,
}

impl Factored {
    /// Factors a covariance; `None` where it is none.
    pub(crate) fn new(covariance: DMatrix<f64>) -> Option<Self> {
        let factor = covariance.cholesky()?;
        let diagonal = factor.l_dirty().diagonal();
        let log_determinant = 2.0 * diagonal.iter().map(|one| one.ln()).sum::<f64>();
        Some(Self {
            factor,
            log_determinant,
        })
    }

    /// Returns one' covariance^-1 other.
    pub(crate) fn product(&self, one: &DVector<f64>, other: &DVector<f64>) -> f64 {
        one.dot(&self.factor.solve(other))
    }

    /// Returns the logarithm of the density that has this chi square.
    fn log_density_at(&self, chi_square: f64) -> f64 {
        let count = self.factor.l_dirty().nrows() as f64;
        -0.5 * (chi_square + self.log_determinant + count * (2.0 * PI).ln())
    }

    /// Returns the logarithm of the density of a residual.
    pub(crate) fn log_density(&self, residual: &DVector<f64>) -> f64 {
        self.log_density_at(self.product(residual, residual))
    }
}

/// Returns measured less predicted changes.
fn residual(pair: &PairModel, predicted: &Predicted) -> DVector<f64> {
    let both = pair.measured.iter().zip(&predicted.change);
    let both = both.map(|(measured, predicted)| measured - predicted);
    DVector::from_iterator(pair.measured.len(), both)
}

/// What a prediction has at one value of the repeatability.
struct AtScatter {
    /// Logarithm of the density of all measured changes, with the value's weight.
    log_density: f64,
    /// Chi square.
    chi_square: f64,
}

/// All pairs with the values of their repeatability.
pub(crate) struct Data<'a> {
    /// The pairs.
    pub(crate) pairs: &'a [PairModel],
    /// Values of the repeatability.
    pub(crate) scatters: Vec<Scatter>,
    /// Covariance by scatter and readings, by value of the repeatability and by pair.
    pub(crate) errors: Vec<Vec<DMatrix<f64>>>,
}

impl<'a> Data<'a> {
    /// Takes the pairs.
    pub(crate) fn new(pairs: &'a [PairModel], settings: &Settings) -> Self {
        let scatters = scatters(pairs, settings);
        let is_stated = settings.repeatability.is_some();
        let of_scatter = scatters.iter().map(|scatter| {
            let of_pair = pairs
                .iter()
                .map(|pair| errors(pair, scatter.std, is_stated));
            of_pair.collect()
        });
        Self {
            pairs,
            errors: of_scatter.collect(),
            scatters,
        }
    }

    /// Returns the probability of changes with the covariance that this prediction has; `None` where it is none.
    pub(crate) fn about(&self, reference: &[Predicted]) -> Option<Likelihood<'_>> {
        let mut factors = Vec::with_capacity(self.scatters.len());
        for errors in &self.errors {
            let own = self.pairs.iter().zip(errors).zip(reference);
            let own = own.map(|((pair, errors), reference)| {
                Factored::new(covariance(pair, errors, reference))
            });
            factors.push(own.collect::<Option<Vec<Factored>>>()?);
        }
        Some(Likelihood {
            data: self,
            factors,
        })
    }

    /// Returns the logarithm of the density of all measured changes, the repeatability averaged over.
    pub(crate) fn log_density(&self, predicted: &[Predicted]) -> f64 {
        let likelihood = self.about(predicted);
        likelihood.map_or(f64::NEG_INFINITY, |own| own.log_density(predicted))
    }

    /// Returns the logarithm of the density at each value of the repeatability, with its weight; and chi square there. Nothing
    /// where the prediction has no covariance.
    fn by_scatter(&self, predicted: &[Predicted]) -> Vec<AtScatter> {
        let likelihood = self.about(predicted);
        likelihood.map_or(Vec::new(), |own| own.by_scatter(predicted))
    }

    /// Returns the probability of a larger chi square, averaged over the repeatability by what the data say of it. `sizes` were
    /// fitted.
    pub(crate) fn goodness(&self, predicted: &[Predicted], sizes: usize) -> f64 {
        let all = self.by_scatter(predicted);
        let total = log_sum(all.iter().map(|one| one.log_density));
        let count: usize = self.pairs.iter().map(|pair| pair.measured.len()).sum();
        let freedom = count.saturating_sub(sizes).max(1) as f64;
        let shares = all.iter().filter(|one| one.log_density.is_finite());
        shares
            .map(|one| (one.log_density - total).exp() * chi_square_tail(one.chi_square, freedom))
            .sum()
    }

    /// Returns chi square at the mean repeatability.
    pub(crate) fn mean_chi_square(&self, predicted: &[Predicted]) -> f64 {
        let all = self.by_scatter(predicted);
        let weighted = self.scatters.iter().zip(&all);
        weighted
            .map(|(scatter, one)| scatter.log_weight.exp() * one.chi_square)
            .sum()
    }

    /// Returns the mean of the repeatability by its weights (1).
    pub(crate) fn mean_scatter(&self) -> f64 {
        self.scatters
            .iter()
            .map(|one| one.log_weight.exp() * one.std)
            .sum()
    }
}

/// Probability of the measured changes with the covariance that one prediction has.
pub(crate) struct Likelihood<'a> {
    data: &'a Data<'a>,
    /// By value of the repeatability and by pair.
    factors: Vec<Vec<Factored>>,
}

impl Likelihood<'_> {
    /// Returns the logarithm of the density of all measured changes, the repeatability averaged over.
    pub(crate) fn log_density(&self, predicted: &[Predicted]) -> f64 {
        log_sum(self.by_scatter(predicted).iter().map(|one| one.log_density))
    }

    /// Returns the logarithm of the density at each value of the repeatability, with its weight; and chi square there.
    fn by_scatter(&self, predicted: &[Predicted]) -> Vec<AtScatter> {
        let pairs = self.data.pairs.iter().zip(predicted);
        let residuals = pairs.map(|(pair, predicted)| residual(pair, predicted));
        let residuals: Vec<DVector<f64>> = residuals.collect();
        let mut all = Vec::with_capacity(self.factors.len());
        for (scatter, factors) in self.data.scatters.iter().zip(&self.factors) {
            let (mut log, mut total) = (scatter.log_weight, 0.0);
            for (factor, residual) in factors.iter().zip(&residuals) {
                let chi_square = factor.product(residual, residual);
                log += factor.log_density_at(chi_square);
                total += chi_square;
            }
            all.push(AtScatter {
                log_density: log,
                chi_square: total,
            });
        }
        all
    }

    /// Returns the index of the repeatability that the data favour, given a prediction.
    pub(crate) fn favoured(&self, predicted: &[Predicted]) -> usize {
        let all = self.by_scatter(predicted).into_iter().enumerate();
        let most = all.max_by(|a, b| a.1.log_density.total_cmp(&b.1.log_density));
        most.map_or(0, |one| one.0)
    }

    /// Returns residuals in standard deviations, independent of each other, at one value of the repeatability; `None` where they
    /// have none.
    pub(crate) fn whitened(&self, scatter: usize, predicted: &[Predicted]) -> Option<Vec<f64>> {
        let mut all = Vec::new();
        let pairs = self.data.pairs.iter().zip(predicted);
        for ((pair, predicted), own) in pairs.zip(&self.factors[scatter]) {
            let factor = own.factor.l_dirty();
            let whitened = factor.solve_lower_triangular(&residual(pair, predicted))?;
            all.extend(whitened.iter());
        }
        Some(all)
    }

    /// Returns the distance of two predictions in standard deviations, at one value of the repeatability.
    pub(crate) fn distance(
        &self,
        scatter: usize,
        one: &[Predicted],
        other: &[Predicted],
    ) -> Option<f64> {
        let [one, other] = [one, other].map(|predicted| self.whitened(scatter, predicted));
        let both = one?.into_iter().zip(other?);
        Some(both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt())
    }

    /// Returns by how much the variances must grow for a prediction with this many fitted sizes to fit; 1 where it fits.
    pub(crate) fn excess(&self, predicted: &[Predicted], sizes: usize) -> f64 {
        let all = self.by_scatter(predicted);
        let total = log_sum(all.iter().map(|one| one.log_density));
        let weighted = all
            .iter()
            .map(|one| (one.log_density - total).exp() * one.chi_square);
        let chi_square: f64 = weighted.sum();
        let count: usize = self.data.pairs.iter().map(|pair| pair.measured.len()).sum();
        let freedom = count.saturating_sub(sizes).max(1) as f64;
        match chi_square_tail(chi_square, freedom) < NO_FIT {
            true => (chi_square / freedom).max(1.0),
            false => 1.0,
        }
    }
}
