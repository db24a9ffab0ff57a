//! Many tests of one structure in the order of time: which is the first that differs from those before it.
//!
//! Every mode has a chart, and so have all modes together and the stiffnesses of the joint. After each test the mean of the last j tests is compared
//! with the mean of all before them, for several j (the change-point model of Hawkins, Qiu & Kang 2003, "The changepoint model
//! for statistical process control"). One test far off is seen at once, and a slow drift after some tests. No test has to be
//! declared healthy.

use crate::change_point::{
    Limits, RunningSums, TestScatter, largest_difference, most_probable_step, single_limits,
};
use crate::joint::JointChange;
use crate::level::take_one_level;
use crate::matching::match_modes;
use crate::model::{Differences, PairModel};
use crate::result::{Comparison, MatchedMode};
use crate::test::{
    CompareError, MOST_REPEATS, Pair, REPEATABILITY_LIMITS, Settings, Test, common_modes,
};
use nalgebra::DMatrix;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::ops::Range;
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings as SearchSettings, minimise};
use tapjoint_numerics::stats::median;

/// Least number of tests: two that agree, and one that may differ.
pub const LEAST_SERIES: usize = 3;
/// Most tests of a series.
pub const MOST_SERIES: usize = 1000;
/// Largest change of a stiffness (logarithm).
const MOST_CHANGE: f64 = 3.0;
/// Unit of the residuals of the search for stiffnesses (1): the precision of a good reading.
const RESIDUAL: f64 = 1e-5;
/// A stiffness whose standard deviation exceeds that of the frequencies by this factor has no chart: the modes do not feel it.
const MOST_SENSITIVITY: f64 = 200.0;

/// What a chart shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChartedQuantity {
    /// Frequency of the mode of this number.
    Mode(usize),
    /// All frequencies together: the mean of their changes.
    AllModes,
    /// Translational stiffness, if only the joint changes.
    Kt,
    /// Rotational stiffness, if only the joint changes.
    Kr,
}

/// One test on a chart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ChartPoint {
    /// Change since the first test, beyond what the descriptions explain (%).
    pub percent: f64,
    /// How improbable the difference of the last tests is, as a standard normal variable (1); 0 where too few tests are known.
    pub score: f64,
    /// Number of last tests that differ most; 0 where too few tests are known.
    pub last: usize,
    /// Limit of the score (1); `null` where too few tests are known.
    pub limit: Option<f64>,
    /// A single test below or above these leaves the limit (%); after a departure they stay. `null` where too few tests are
    /// known.
    pub single_limits_percent: Option<[f64; 2]>,
}

/// The first time that a chart leaves its limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Departure {
    /// Index of the test that shows it, from 0.
    pub test: usize,
    /// Index of the first test that seems to have changed, from 0.
    pub since: usize,
    /// Mean change of the tests from there to `test`, against the mean before (%).
    pub percent: f64,
}

impl Departure {
    /// Returns the indices of the tests that are compared: the last ones before the step, and the last ones from there to the test
    /// that shows it.
    pub fn compared(&self) -> [Range<usize>; 2] {
        [0..self.since, self.since..self.test + 1].map(|tests| {
            let first = tests.end.saturating_sub(MOST_REPEATS);
            tests.start.max(first)..tests.end
        })
    }
}

/// Control chart of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ControlChart {
    /// What it shows.
    pub quantity: ChartedQuantity,
    /// Standard deviation of one test (%): as stated, or about the means before and after the change. `null` with too few
    /// tests.
    pub scatter_percent: Option<f64>,
    /// All tests in order.
    pub points: Vec<ChartPoint>,
    /// The first departure; `null` where all tests agree.
    pub departure: Option<Departure>,
}

/// A mode without a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LeftOutMode {
    /// Its number.
    pub mode: usize,
    /// Index of the first test that lacks it, from 0.
    pub test: usize,
}

/// A series of tests.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Series {
    /// A chart for each mode, for all modes together, and for each stiffness of the joint that the modes feel.
    pub charts: Vec<ControlChart>,
    /// The earliest departure of all charts: index of the chart, from 0; `null` where all tests agree.
    pub first: Option<usize>,
    /// True where the repeatability was stated. Otherwise the scatter of the tests themselves decides.
    pub is_stated: bool,
    /// Modes whose numbers differed between the tests.
    pub matched: Vec<MatchedMode>,
    /// Modes that the first test has and another one lacks.
    pub left_out: Vec<LeftOutMode>,
}

impl Series {
    /// Returns the earliest departure of all charts, and its chart; `None` where all tests agree.
    pub fn departure(&self) -> Option<(&ControlChart, Departure)> {
        let chart = self.charts.get(self.first?)?;
        Some((chart, chart.departure?))
    }
}

/// A series of tests, and what changed in it.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchedSeries {
    /// The charts.
    pub series: Series,
    /// What changed between the tests of [`Departure::compared`]. `None` where all tests agree.
    pub change: Option<Comparison>,
}

/// Charts a series of tests of one structure.
///
/// The limits are set for one false alarm in 250 drawn tests, all charts together.
///
/// # Errors
/// [`CompareError`]: too few or too many tests, too few modes in common, a structure without modes.
pub fn watch(tests: &[Test], settings: &Settings) -> Result<WatchedSeries, CompareError> {
    if !(LEAST_SERIES..=MOST_SERIES).contains(&tests.len()) {
        return Err(CompareError::Series {
            count: tests.len(),
            least: LEAST_SERIES,
            most: MOST_SERIES,
        });
    }
    let mut all = Pair {
        before: tests[..1].to_vec(),
        after: tests[1..].to_vec(),
    };
    let matched = match_modes(&mut all, 0);
    let modes = common_modes(std::slice::from_ref(&all), settings)?.swap_remove(0);
    // `compare` takes one level by itself.
    let as_read = [all.before.clone(), all.after.clone()].concat();
    take_one_level(&mut all);
    let (first, others) = (&all.before[0], &all.after);
    let model = PairModel::new(
        &Pair {
            before: vec![first.clone()],
            after: vec![first.clone()],
        },
        &modes,
    )?;
    let measured = others.par_iter().map(|test| model.beyond(first, test));
    let measured: Vec<Differences> = measured.collect::<Result<_, _>>()?;
    let count = modes.len();
    let SeriesChanges {
        quantities,
        sensitivities,
        rows,
    } = SeriesChanges::new(&model, &measured);
    // A stated repeatability holds the readings' own noise, unless these are worse. Half of the variance of a difference is that of one test.
    let is_stated = settings.repeatability.is_some();
    let repeatability = settings.repeatability.unwrap_or(REPEATABILITY_LIMITS[0]);
    let stds = (0..count).map(|k| {
        let mut readings: Vec<f64> = measured.iter().map(|one| one.reading[k]).collect();
        let at_own_level = 0.5 * repeatability.powi(2).max(median(&mut readings));
        // The first test keeps its level.
        let moved: f64 = measured.iter().map(|one| one.moved[k]).sum();
        (at_own_level + moved / measured.len() as f64).sqrt()
    });
    let stds: Vec<f64> = stds.collect();
    let limits = Limits::new(
        &sensitivities,
        if is_stated { count } else { 0 },
        tests.len(),
    );
    let charts = quantities.iter().enumerate().map(|(index, quantity)| {
        let values: Vec<f64> = rows.iter().map(|row| row[index]).collect();
        let row = sensitivities.row(index);
        let variances = row.iter().zip(&stds);
        let variance: f64 = variances
            .map(|(sensitivity, std)| (sensitivity * std).powi(2))
            .sum();
        // How much of the scatter all modes share is not stated.
        let scatter = match is_stated && index < count {
            true => TestScatter::Known(stds[index]),
            false => TestScatter::AtLeast(variance.sqrt()),
        };
        chart(*quantity, &values, scatter, &limits)
    });
    let charts: Vec<ControlChart> = charts.collect();
    let series = Series {
        first: earliest(&charts),
        charts,
        is_stated,
        matched,
        left_out: left_out(&all, &modes),
    };
    let mut change = None;
    if let Some((_, departure)) = series.departure() {
        // What comes later may be another change.
        let [before, after] = departure.compared().map(|tests| as_read[tests].to_vec());
        let pair = Pair { before, after };
        change = Some(crate::compare(&[pair], settings)?);
    }
    Ok(WatchedSeries { series, change })
}

/// Changes of all quantities.
struct SeriesChanges {
    quantities: Vec<ChartedQuantity>,
    /// Changes of the quantities over those of the frequencies (all logarithms): a row for each quantity, the modes first.
    sensitivities: DMatrix<f64>,
    /// Logarithms of all quantities over those of the first test: a row for each test.
    rows: Vec<Vec<f64>>,
}

impl SeriesChanges {
    /// Returns the changes from the measured ones of the modes (logarithms), from the second test on.
    fn new(model: &PairModel, measured: &[Differences]) -> Self {
        let count = model.modes.len();
        let modes = model.modes.iter().map(|mode| ChartedQuantity::Mode(*mode));
        let sensitivities = DMatrix::identity(count, count);
        let mut rows = vec![vec![0.0; count + 1]];
        for differences in measured {
            let changes = &differences.measured;
            let mut row = changes.clone();
            row.push(changes.iter().sum::<f64>() / count as f64);
            rows.push(row);
        }
        let mut all = Self {
            quantities: modes.chain([ChartedQuantity::AllModes]).collect(),
            sensitivities: sensitivities.insert_row(count, 1.0 / count as f64),
            rows,
        };
        if let Some(joint) = JointSensitivity::new(model) {
            let fits = measured.par_iter();
            let fits = fits.map(|one| joint.changes(model, &one.measured));
            // Without a fit of every test the stiffnesses have no charts.
            if let Some(fits) = fits.collect::<Option<Vec<Vec<f64>>>>() {
                all.add_joint(&joint, fits);
            }
        }
        all
    }

    fn add_joint(&mut self, joint: &JointSensitivity, fits: Vec<Vec<f64>>) {
        let known = self.quantities.len();
        self.quantities.extend(&joint.quantities);
        let sensitivities = self.sensitivities.clone();
        self.sensitivities = sensitivities.resize_vertically(self.quantities.len(), 0.0);
        let mut below = self
            .sensitivities
            .rows_mut(known, joint.sensitivity.nrows());
        below.copy_from(&joint.sensitivity);
        self.rows[0].resize(self.quantities.len(), 0.0);
        for (row, fit) in self.rows[1..].iter_mut().zip(fits) {
            row.extend(fit);
        }
    }
}

/// Returns the chart that leaves its limit first; of several that by the largest score over its limit.
fn earliest(charts: &[ControlChart]) -> Option<usize> {
    let mut best: Option<(usize, usize, f64)> = None;
    for (index, chart) in charts.iter().enumerate() {
        let Some(departure) = chart.departure else {
            continue;
        };
        let point = chart.points[departure.test];
        let excess = point.score.abs() / point.limit.unwrap_or(f64::INFINITY);
        if best.is_none_or(|(_, test, most)| (departure.test, -excess) < (test, -most)) {
            best = Some((index, departure.test, excess));
        }
    }
    best.map(|one| one.0)
}

/// Returns the modes of the first test that others lack.
fn left_out(all: &Pair, modes: &[usize]) -> Vec<LeftOutMode> {
    let first = all.before[0].modes.iter().map(|one| one.mode);
    let missing = first.filter(|mode| *mode > 0 && !modes.contains(mode));
    let found = missing.filter_map(|mode| {
        let mut tests = all.after.iter();
        let without = tests.position(|test| test.mode(mode).is_none())?;
        Some(LeftOutMode {
            mode,
            test: without + 1,
        })
    });
    found.collect()
}

/// Charts one quantity by its values (logarithms over the first test).
fn chart(
    quantity: ChartedQuantity,
    values: &[f64],
    scatter: TestScatter,
    limits: &Limits,
) -> ControlChart {
    let percent = |log: f64| 100.0 * log.exp_m1();
    let mut points = Vec::with_capacity(values.len());
    let mut departure = None;
    let mut sums = RunningSums::default();
    let (mut single, mut std) = (None, None);
    for (test, value) in values.iter().enumerate() {
        let limit = limits.at(test + 1);
        if departure.is_none() {
            let found = limit.and_then(|limit| single_limits(&sums, scatter, limit));
            single = found.map(|ends| ends.map(percent));
        }
        sums.add(*value);
        let mut point = ChartPoint {
            percent: percent(*value),
            score: 0.0,
            last: 0,
            limit: None,
            single_limits_percent: single,
        };
        if let Some((found, limit)) = largest_difference(&sums, scatter).zip(limit) {
            point.limit = Some(limit);
            (point.score, point.last) = (found.score, found.last);
            if departure.is_none() {
                std = Some(found.std);
            }
            if departure.is_none() && found.score.abs() > limit {
                let step = most_probable_step(&sums, scatter);
                std = Some(step.std);
                departure = Some(Departure {
                    test,
                    since: test + 1 - step.last,
                    percent: percent(step.difference),
                });
            }
        }
        points.push(point);
    }
    ControlChart {
        quantity,
        scatter_percent: std.map(|std| 100.0 * std),
        points,
        departure,
    }
}

/// How the stiffnesses of the joint follow from the frequencies.
struct JointSensitivity {
    quantities: Vec<ChartedQuantity>,
    directions: Vec<usize>,
    /// Changes of the stiffnesses (logarithms) over those of the frequencies: a row for each stiffness.
    sensitivity: DMatrix<f64>,
}

impl JointSensitivity {
    /// Returns the stiffnesses that the modes feel; `None` where there are none.
    fn new(model: &PairModel) -> Option<Self> {
        let joint = JointChange::new(std::slice::from_ref(model))?;
        let names = joint.names(model);
        let mut directions = Vec::new();
        let mut quantities = Vec::new();
        for (direction, name) in joint.directions.iter().zip(names) {
            let quantity = match name {
                "kt" => ChartedQuantity::Kt,
                "kr" => ChartedQuantity::Kr,
                _ => continue,
            };
            directions.push(*direction);
            quantities.push(quantity);
        }
        while !directions.is_empty() {
            let slopes = model.joint_slopes(&directions, &vec![0.0; directions.len()])?;
            let sensitivity = slopes.pseudo_inverse(1e-12).ok()?;
            let norms: Vec<f64> = sensitivity.row_iter().map(|row| row.norm()).collect();
            let worst = (0..norms.len()).max_by(|a, b| norms[*a].total_cmp(&norms[*b]))?;
            if norms[worst] <= MOST_SENSITIVITY {
                return Some(Self {
                    quantities,
                    directions,
                    sensitivity,
                });
            }
            directions.remove(worst);
            quantities.remove(worst);
        }
        None
    }

    /// Returns the changes of the stiffnesses (logarithms) that fit measured changes of the frequencies (logarithms) best, by
    /// least squares. `None` where the search fails.
    fn changes(&self, model: &PairModel, measured: &[f64]) -> Option<Vec<f64>> {
        let fit = JointFit {
            model,
            directions: &self.directions,
            measured,
            bounds: vec![[-MOST_CHANGE, MOST_CHANGE]; self.directions.len()],
        };
        let start = vec![0.0; self.directions.len()];
        Some(minimise(&fit, &start, &SearchSettings::default())?.parameters)
    }
}

/// Fit of stiffnesses (logarithms) to changes of the frequencies.
struct JointFit<'a> {
    model: &'a PairModel,
    directions: &'a [usize],
    measured: &'a [f64],
    bounds: Vec<[f64; 2]>,
}

impl Problem for JointFit<'_> {
    type State = Vec<f64>;

    /// Returns measured less predicted changes, over [`RESIDUAL`].
    fn evaluate(&self, parameters: &[f64], _: Option<&Vec<f64>>) -> Option<Vec<f64>> {
        let predicted = self.model.joint_change(self.directions, parameters)?;
        let pairs = self.measured.iter().zip(&predicted);
        Some(
            pairs
                .map(|(measured, predicted)| (measured - predicted) / RESIDUAL)
                .collect(),
        )
    }

    fn cost(&self, residuals: &Vec<f64>) -> f64 {
        0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
    }

    fn linearise(&self, parameters: &[f64], residuals: &mut Vec<f64>) -> Option<Linearised> {
        let slopes = self.model.joint_slopes(self.directions, parameters)?;
        Some(Linearised::of_rows(-slopes / RESIDUAL, residuals))
    }

    fn bounds(&self) -> &[[f64; 2]] {
        &self.bounds
    }
}
