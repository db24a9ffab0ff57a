//! Many tests of one structure in the order of time: which is the first that differs from those before it.
//!
//! Every mode has a chart, and so have the stiffnesses of the joint. After each test the mean of the last j tests is compared
//! with the mean of all before them, for several j (the change-point model of Hawkins, Qiu & Kang 2003, "The changepoint model
//! for statistical process control"). One test far off is seen at once, and a slow drift after some tests. No test has to be
//! declared healthy.

use crate::change_point::{
    Limits, Moments, Scatter, most_probable_step, most_unlike, single_limits,
};
use crate::joint::JointChange;
use crate::matching::match_modes;
use crate::model::PairModel;
use crate::result::{Comparison, MatchedMode};
use crate::test::{CompareError, MOST_REPEATS, Pair, Settings, Test, common_modes};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// Least number of tests: two that agree, and one that may differ.
pub const LEAST_SERIES: usize = 3;
/// Most tests of a series.
pub const MOST_SERIES: usize = 1000;
/// Least repeatability where none is stated (1): no frequency is read better.
const LEAST_REPEATABILITY: f64 = 1e-6;
/// Step of a joint's stiffness for its influence on the frequencies (logarithm).
const STEP: f64 = 0.01;
/// Largest change of a stiffness (logarithm).
const MOST_CHANGE: f64 = 3.0;
/// Turns of the search for a stiffness, and the step at which it ends (logarithm).
const TURNS: usize = 30;
const SETTLED: f64 = 1e-7;
/// A stiffness whose standard deviation exceeds that of the frequencies by this factor has no chart: the modes do not feel it.
const MOST_LEVER: f64 = 200.0;

/// What a chart shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Charted {
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
    /// How much the last tests differ from those before them, in standard deviations (1); 0 where too few tests are known.
    pub score: f64,
    /// Number of last tests that differ most.
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

/// Control chart of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ControlChart {
    /// What it shows.
    pub quantity: Charted,
    /// Standard deviation of one test (%): as stated, or of the tests before the change.
    pub scatter_percent: f64,
    /// All tests in order.
    pub points: Vec<ChartPoint>,
    /// The first departure; `null` where all tests agree.
    pub departure: Option<Departure>,
}

/// A series of tests.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Series {
    /// A chart for each mode, and for each stiffness of the joint that the modes feel.
    pub charts: Vec<ControlChart>,
    /// The earliest departure of all charts: index of the chart, from 0; `null` where all tests agree.
    pub first: Option<usize>,
    /// True where the repeatability was stated. Otherwise the scatter of the tests themselves decides.
    pub is_stated: bool,
    /// Modes whose numbers differed between the tests.
    pub matched: Vec<MatchedMode>,
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
pub struct Watched {
    /// The charts.
    pub series: Series,
    /// What changed between the tests before the earliest departure and those from there on; `None` where all tests
    /// agree.
    pub change: Option<Comparison>,
}

/// Charts a series of tests of one structure.
///
/// The limits are left once in 200 tests by chance or less often, all charts together.
///
/// # Errors
/// [`CompareError`]: too few or too many tests, too few modes in common, a structure without modes.
pub fn watch(tests: &[Test], settings: &Settings) -> Result<Watched, CompareError> {
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
    let (first, others) = (&all.before[0], &all.after);
    let model = PairModel::new(
        &Pair {
            before: vec![first.clone()],
            after: vec![others[0].clone()],
        },
        &modes,
    )?;
    let measured = others.par_iter().map(|test| model.beyond(first, test));
    let measured: Vec<[Vec<f64>; 2]> = measured.collect::<Result<_, _>>()?;
    let joint = JointLever::new(&model);
    let count = modes.len();
    let quantities = modes.iter().map(|mode| Charted::Mode(*mode));
    let mut quantities: Vec<Charted> = quantities.chain([Charted::AllModes]).collect();
    let mut levers = DMatrix::identity(count, count);
    levers = levers.insert_row(count, 1.0 / count as f64);
    if let Some(joint) = &joint {
        quantities.extend(&joint.quantities);
        levers = stacked(&levers, &joint.lever);
    }
    // One row for each test: logarithms of all quantities over those of the first test.
    let rows = measured.par_iter().map(|[changes, _]| {
        let mut row = changes.clone();
        row.push(changes.iter().sum::<f64>() / count as f64);
        row.extend(
            joint
                .iter()
                .flat_map(|joint| joint.changes(&model, changes)),
        );
        row
    });
    let mut rows: Vec<Vec<f64>> = rows.collect();
    rows.insert(0, vec![0.0; quantities.len()]);
    // Half of the variance of a difference is that of one test.
    let reading =
        |k: usize| measured.iter().map(|one| one[1][k]).sum::<f64>() / measured.len() as f64;
    let repeatability = settings.repeatability.unwrap_or(LEAST_REPEATABILITY);
    let variances = (0..count).map(|k| 0.5 * (repeatability.powi(2) + reading(k)));
    let stds: Vec<f64> = variances.map(f64::sqrt).collect();
    let is_stated = settings.repeatability.is_some();
    let limits = Limits::new(&levers, if is_stated { count } else { 0 }, tests.len());
    let charts = quantities.iter().enumerate().map(|(index, quantity)| {
        let values: Vec<f64> = rows.iter().map(|row| row[index]).collect();
        let parts = levers
            .row(index)
            .iter()
            .zip(&stds)
            .map(|(lever, std)| (lever * std).powi(2))
            .sum::<f64>();
        // How much of the scatter all modes share is not stated.
        let scatter = match is_stated && index < count {
            true => Scatter::Known(stds[index]),
            false => Scatter::AtLeast(parts.sqrt()),
        };
        chart(*quantity, &values, scatter, &limits)
    });
    let charts: Vec<ControlChart> = charts.collect();
    let series = Series {
        first: earliest(&charts),
        charts,
        is_stated,
        matched,
    };
    let mut change = None;
    if let Some((_, departure)) = series.departure() {
        let (before, after) = tests.split_at(departure.since);
        let pair = Pair {
            before: before[before.len().saturating_sub(MOST_REPEATS)..].to_vec(),
            after: after[..after.len().min(MOST_REPEATS)].to_vec(),
        };
        change = Some(crate::compare(&[pair], settings)?);
    }
    Ok(Watched { series, change })
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

/// Returns one matrix above another.
fn stacked(above: &DMatrix<f64>, below: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = above
        .clone()
        .resize_vertically(above.nrows() + below.nrows(), 0.0);
    all.rows_mut(above.nrows(), below.nrows()).copy_from(below);
    all
}

/// Charts one quantity by its values (logarithms over the first test).
fn chart(quantity: Charted, values: &[f64], scatter: Scatter, limits: &Limits) -> ControlChart {
    let percent = |log: f64| 100.0 * log.exp_m1();
    let mut points = Vec::with_capacity(values.len());
    let mut departure = None;
    let mut moments = Moments::default();
    let (Scatter::Known(mut std) | Scatter::AtLeast(mut std)) = scatter;
    let mut single = None;
    for (test, value) in values.iter().enumerate() {
        let limit = limits.at(test + 1);
        if departure.is_none() {
            let found = limit.and_then(|limit| single_limits(&moments, scatter, limit));
            single = found.map(|ends| ends.map(percent));
        }
        moments.add(*value);
        let mut point = ChartPoint {
            percent: percent(*value),
            score: 0.0,
            last: 0,
            limit: None,
            single_limits_percent: single,
        };
        if let Some((found, limit)) = most_unlike(&moments, scatter).zip(limit) {
            point.limit = Some(limit);
            (point.score, point.last) = (found.score, found.last);
            if departure.is_none() {
                std = found.std;
            }
            if departure.is_none() && found.score.abs() > limit {
                let step = most_probable_step(&moments);
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
        scatter_percent: 100.0 * std,
        points,
        departure,
    }
}

/// How the stiffnesses of the joint follow from the frequencies.
struct JointLever {
    quantities: Vec<Charted>,
    directions: Vec<usize>,
    /// Changes of the stiffnesses (logarithms) over those of the frequencies: a row for each stiffness.
    lever: DMatrix<f64>,
}

impl JointLever {
    /// Returns the stiffnesses that the modes feel; `None` where there are none.
    fn new(model: &PairModel) -> Option<Self> {
        let joint = JointChange::new(std::slice::from_ref(model))?;
        let names = joint.names(model);
        let mut directions = Vec::new();
        let mut quantities = Vec::new();
        for (direction, name) in joint.directions.iter().zip(names) {
            let quantity = match name {
                "kt" => Charted::Kt,
                "kr" => Charted::Kr,
                _ => continue,
            };
            directions.push(*direction);
            quantities.push(quantity);
        }
        while !directions.is_empty() {
            let lever = inverse_slopes(model, &directions)?;
            let norms: Vec<f64> = lever.row_iter().map(|row| row.norm()).collect();
            let worst = (0..norms.len()).max_by(|a, b| norms[*a].total_cmp(&norms[*b]))?;
            if norms[worst] <= MOST_LEVER {
                return Some(Self {
                    quantities,
                    directions,
                    lever,
                });
            }
            directions.remove(worst);
            quantities.remove(worst);
        }
        None
    }

    /// Returns the changes of the stiffnesses (logarithms) that fit the changes of a pair best, by least squares. The slopes at
    /// no change serve all turns.
    fn changes(&self, model: &PairModel, measured: &[f64]) -> Vec<f64> {
        let mut steps = DVector::zeros(self.directions.len());
        for _ in 0..TURNS {
            let Some(predicted) = model.joint_change(&self.directions, steps.as_slice()) else {
                break;
            };
            let rest = DVector::from_column_slice(measured) - DVector::from_vec(predicted);
            let step = &self.lever * rest;
            steps = (&steps + &step).map(|one| one.clamp(-MOST_CHANGE, MOST_CHANGE));
            if step.amax() < SETTLED {
                break;
            }
        }
        steps.as_slice().to_vec()
    }
}

/// Returns the pseudo-inverse of the slopes of the frequencies with respect to stiffnesses (logarithms); `None` where the
/// structure has no modes.
fn inverse_slopes(model: &PairModel, directions: &[usize]) -> Option<DMatrix<f64>> {
    let count = model.modes.len();
    let mut slopes = DMatrix::zeros(count, directions.len());
    for column in 0..directions.len() {
        let mut sides = Vec::new();
        for step in [STEP, -STEP] {
            let mut steps = vec![0.0; directions.len()];
            steps[column] = step;
            sides.push(model.joint_change(directions, &steps)?);
        }
        for row in 0..count {
            slopes[(row, column)] = (sides[0][row] - sides[1][row]) / (2.0 * STEP);
        }
    }
    slopes.pseudo_inverse(1e-12).ok()
}
