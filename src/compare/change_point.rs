//! Whether the last tests of a series differ from those before them, and by how much they may by chance.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Probability that any chart leaves its limit at a test although nothing changed (1). Longer tails
/// give more: drawn tests with four degrees of freedom gave one in 283 and in 269.
const FALSE_ALARM: f64 = 1.0 / 250.0;
/// Numbers of last tests that are compared with those before.
const WINDOWS: [usize; 12] = [1, 2, 3, 4, 5, 6, 8, 11, 15, 20, 28, 40];
/// Least degrees of freedom of a scatter that the tests themselves tell.
const LEAST_FREEDOM: usize = 3;
/// Degrees of freedom of the scatter of tests, Student's distribution: it has longer tails than the normal one.
const TAILS: usize = 5;
/// Drawn series, and tests of each. Later limits are the mean of the last ones.
const DRAWN: usize = 2000;
const DRAWN_TESTS: usize = 60;
const LAST_LIMITS: usize = 20;
/// Seed of the drawn series: the limits are the same every time.
const SEED: u64 = 0x5e41e5;

/// Sums over the tests so far.
#[derive(Debug, Clone)]
pub(crate) struct RunningSums {
    /// Sum of the first n values, and of their squares, from n = 0.
    sums: Vec<[f64; 2]>,
}

impl Default for RunningSums {
    fn default() -> Self {
        Self {
            sums: vec![[0.0; 2]],
        }
    }
}

impl RunningSums {
    /// Adds the value of the next test.
    pub(crate) fn add(&mut self, value: f64) {
        let [sum, squares] = self.sums[self.sums.len() - 1];
        self.sums.push([sum + value, squares + value * value]);
    }
}

/// The last tests that differ most from those before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LastDifference {
    /// Difference of the means as a normal variable with standard deviation 1.
    pub(crate) score: f64,
    /// Number of last tests.
    pub(crate) last: usize,
    /// Standard deviation of one test.
    pub(crate) std: f64,
}

/// Standard deviation of one test.
#[derive(Debug, Clone, Copy)]
pub(crate) enum TestScatter {
    /// It is known.
    Known(f64),
    /// The scatter about both means tells it; it is not less than this.
    AtLeast(f64),
}

/// What the difference of two means is measured by.
struct Scale {
    /// Standard deviation of one test.
    std: f64,
    /// Degrees of freedom of the difference over `unit`, which is Student's t.
    freedom: f64,
    unit: f64,
}

impl Scale {
    /// Returns the scale for the means of `first` and `last` tests with this sum of squares about both means.
    fn new(scatter: TestScatter, first: usize, last: usize, squares: f64) -> Self {
        let (std, freedom) = match scatter {
            TestScatter::Known(std) => (std, f64::INFINITY),
            TestScatter::AtLeast(least) => {
                let freedom = (first + last).saturating_sub(2).max(1) as f64;
                ((squares / freedom).max(0.0).sqrt().max(least), freedom)
            }
        };
        let share = (1.0 / first as f64 + 1.0 / last as f64).sqrt();
        // A mean of several tests has shorter tails than one: the excess of a sum falls as one over their number.
        let tails = (4 + (TAILS - 4) * last.min(first)) as f64;
        Self {
            std,
            // An approximation: the limits are drawn with the same one.
            freedom: (freedom.recip() + tails.recip()).recip(),
            unit: std * share * ((tails - 2.0) / tails).sqrt(),
        }
    }
}

/// Returns true where the scatter is known or can be told by so many tests.
fn is_known(scatter: TestScatter, count: usize) -> bool {
    matches!(scatter, TestScatter::Known(_)) || count >= LEAST_FREEDOM + 2
}

/// Tests in two parts: those before and the last ones.
struct Parts {
    /// Mean of the last tests less that before.
    difference: f64,
    /// Sum of squares about both means.
    squares: f64,
}

impl Parts {
    fn new(sums: &RunningSums, last: usize) -> Self {
        let count = sums.sums.len() - 1;
        let [total, squares] = sums.sums[count];
        let first = count - last;
        let [sum, _] = sums.sums[first];
        let before = sum / first as f64;
        let after = (total - sum) / last as f64;
        Self {
            difference: after - before,
            squares: squares - first as f64 * before * before - last as f64 * after * after,
        }
    }
}

/// A step to which the last tests belong.
pub(crate) struct Step {
    /// Number of tests after it.
    pub(crate) last: usize,
    /// Difference of the means.
    pub(crate) difference: f64,
    /// Standard deviation of one test about the means.
    pub(crate) std: f64,
}

/// Returns the most probable step: that with the least sum of squares about the means before and after.
pub(crate) fn most_probable_step(sums: &RunningSums, scatter: TestScatter) -> Step {
    let count = sums.sums.len() - 1;
    let (mut last, mut least) = (1, f64::INFINITY);
    for own in 1..count {
        let squares = Parts::new(sums, own).squares;
        if squares < least {
            (last, least) = (own, squares);
        }
    }
    let parts = Parts::new(sums, last);
    Step {
        last,
        difference: parts.difference,
        std: Scale::new(scatter, count - last, last, parts.squares).std,
    }
}

/// Returns the last tests that differ most from those before; `None` where too few tests are known.
pub(crate) fn largest_difference(
    sums: &RunningSums,
    scatter: TestScatter,
) -> Option<LastDifference> {
    let count = sums.sums.len() - 1;
    let mut best: Option<LastDifference> = None;
    if !is_known(scatter, count) {
        return None;
    }
    for last in WINDOWS.into_iter().filter(|last| *last < count) {
        let parts = Parts::new(sums, last);
        let scale = Scale::new(scatter, count - last, last, parts.squares);
        let ratio = parts.difference / scale.unit;
        // A score is smaller than its t: this saves most logarithms.
        if best.is_some_and(|best| ratio.abs() <= best.score.abs()) {
            continue;
        }
        let score = normal_score(ratio, scale.freedom);
        if best.is_none_or(|best| score.abs() > best.score.abs()) {
            best = Some(LastDifference {
                score,
                last,
                std: scale.std,
            });
        }
    }
    best
}

/// Returns the ends between which a single next test has a score within a limit; `None` where too few tests are known.
pub(crate) fn single_limits(
    sums: &RunningSums,
    scatter: TestScatter,
    limit: f64,
) -> Option<[f64; 2]> {
    let first = sums.sums.len() - 1;
    if first == 0 || !is_known(scatter, first + 1) {
        return None;
    }
    let [sum, squares] = sums.sums[first];
    let before = sum / first as f64;
    let scale = Scale::new(scatter, first, 1, squares - first as f64 * before * before);
    let freedom = scale.freedom;
    let size = limit * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    let t = (freedom * (size * size / freedom).exp_m1()).sqrt();
    Some([-t, t].map(|t| before + t * scale.unit))
}

/// Returns the normal variable that is as improbable as Student's t (Wallace 1959, "Bounds on normal approximations to
/// Student's and the chi-square distributions", Ann. Math. Statist. 30, 1121).
fn normal_score(t: f64, freedom: f64) -> f64 {
    let size = (freedom * (t * t / freedom).ln_1p()).sqrt();
    size.copysign(t) * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
}

/// Limits of the score after each number of tests.
pub(crate) struct Limits {
    /// Limit after n + 1 tests.
    by_count: Vec<Option<f64>>,
}

impl Limits {
    /// Draws series in which nothing changes, and takes the limits that one in 250 leaves at each test, of those that did
    /// not leave them before. `sensitivities` has a row for each chart: how it follows from the frequencies. The scatter of the first
    /// `known` charts is known.
    pub(crate) fn new(sensitivities: &DMatrix<f64>, known: usize, tests: usize) -> Self {
        let drawn = tests.min(DRAWN_TESTS);
        let scatters = sensitivities.row_iter().enumerate();
        let scatters = scatters.map(|(chart, row)| match chart < known {
            true => TestScatter::Known(row.norm()),
            false => TestScatter::AtLeast(f64::MIN_POSITIVE),
        });
        let scatters: Vec<TestScatter> = scatters.collect();
        let most: Vec<Vec<f64>> = (0..DRAWN)
            .into_par_iter()
            .map(|series| highest_scores(sensitivities, &scatters, drawn, series))
            .collect();
        let mut remaining = most;
        let mut by_count: Vec<Option<f64>> = Vec::with_capacity(drawn);
        for test in 0..drawn {
            let mut scores: Vec<f64> = remaining.iter().map(|series| series[test]).collect();
            let rank = ((1.0 - FALSE_ALARM) * scores.len() as f64) as usize;
            let rank = rank.min(scores.len() - 1);
            let (_, limit, _) = scores.select_nth_unstable_by(rank, f64::total_cmp);
            let limit = *limit;
            remaining.retain(|series| series[test] <= limit);
            // Too few tests are known where no score exceeds 0.
            by_count.push((limit > 0.0).then_some(limit));
        }
        Self { by_count }
    }

    /// Returns the limit after this number of tests; `None` where too few are known.
    pub(crate) fn at(&self, tests: usize) -> Option<f64> {
        if let Some(limit) = self.by_count.get(tests - 1) {
            return *limit;
        }
        let last = self.by_count.len().saturating_sub(LAST_LIMITS);
        let known: Vec<f64> = self.by_count[last..].iter().flatten().copied().collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    }
}

/// Returns the highest score of all charts after each test of a drawn series; 0 where too few are known.
fn highest_scores(
    sensitivities: &DMatrix<f64>,
    scatters: &[TestScatter],
    tests: usize,
    series: usize,
) -> Vec<f64> {
    let mut draw = ChaCha8Rng::seed_from_u64(SEED);
    draw.set_stream(series as u64);
    let mut sums = vec![RunningSums::default(); scatters.len()];
    let mut all = Vec::with_capacity(tests);
    for _ in 0..tests {
        let errors = DVector::from_fn(sensitivities.ncols(), |_, _| drawn_scatter(&mut draw));
        let values = sensitivities * errors;
        let mut highest = 0.0_f64;
        for ((sums, value), scatter) in sums.iter_mut().zip(values.iter()).zip(scatters) {
            sums.add(*value);
            let found = largest_difference(sums, *scatter);
            highest = highest.max(found.map_or(0.0, |found| found.score.abs()));
        }
        all.push(highest);
    }
    all
}

/// Draws the scatter of a test with standard deviation 1: Student's t with [`TAILS`] degrees of freedom.
fn drawn_scatter(draw: &mut ChaCha8Rng) -> f64 {
    let mut normal = || -> f64 { StandardNormal.sample(draw) };
    let squares: f64 = (0..TAILS).map(|_| normal().powi(2)).sum();
    normal() * ((TAILS - 2) as f64 / squares).sqrt()
}

#[cfg(test)]
mod tests;
