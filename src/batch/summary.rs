//! What all tests of a batch show together: counts, distributions, trends and outliers.
//!
//! All statistics are robust. The median stands for the centre. The spread is 1.4826 times the median absolute deviation
//! from it, which is the standard deviation where values are normal. The trend is the median of the slopes between all pairs
//! of values (Theil 1950, Sen 1968), over the order of the tests.

use crate::record::{BatchRecord, Estimated, TestOutcome};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;
use tapjoint_numerics::stats::median;

/// Ratio of the standard deviation to the median absolute deviation, of normal values.
const NORMAL_RATIO: f64 = 1.4826;
/// A value is an outlier if it is more than this many spreads from the median (Iglewicz and Hoaglin 1993).
pub const OUTLIER_LIMIT: f64 = 3.5;
/// Fewest values with outliers and with a trend: below, a spread says little.
pub const LEAST_VALUES: usize = 8;
/// Most values between which slopes are taken. Of more, medians of consecutive groups are taken.
const MOST_SLOPED: usize = 1000;
/// A trend is clear if the statistic of Mann and Kendall exceeds this, as one in 1000 does by chance.
pub const CLEAR_TREND: f64 = 3.29;
/// Outliers of a quantity that are named, the largest first.
const MOST_OUTLIERS: usize = 100;
/// Different reasons that are counted; further ones are counted together.
const MOST_REASONS: usize = 100;
/// Longest reason (characters).
const LONGEST_REASON: usize = 200;
/// Highest mode of which the distribution is shown.
const MOST_MODES: u64 = 30;

/// A quantity that tests have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Frequency of the mode of this number (Hz).
    Mode(u64),
    /// Translational stiffness (N/m).
    Kt,
    /// Rotational stiffness (N m/rad).
    Kr,
    /// Young's modulus (Pa).
    Modulus,
}

impl Quantity {
    /// Returns its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Mode(_) => "Hz",
            Self::Kt => "N/m",
            Self::Kr => "N m/rad",
            Self::Modulus => "Pa",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mode(number) => write!(out, "mode {number}"),
            Self::Kt => out.write_str("Kt"),
            Self::Kr => out.write_str("Kr"),
            Self::Modulus => out.write_str("modulus"),
        }
    }
}

impl Serialize for Quantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A test and its value of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Index of the test in the order of the batch, from 0.
    pub test: u32,
    /// Its value (unit of the quantity).
    pub value: f64,
}

/// A value far from those of the other tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outlier {
    /// Index of the test in the order of the batch, from 0.
    pub test: u32,
    /// Name of the test.
    pub file: String,
    /// Its value (unit of the quantity).
    pub value: f64,
    /// Its distance from the median in spreads, signed.
    pub score: f64,
}

/// Distribution of one quantity over the tests that have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// The quantity.
    pub quantity: Quantity,
    /// Unit of all values.
    pub unit: &'static str,
    /// Number of tests that have it.
    pub count: usize,
    /// Median.
    pub median: f64,
    /// Robust standard deviation.
    pub spread: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Change from the first to the last test along the trend (% of the median); `None` of few tests.
    pub trend_percent: Option<f64>,
    /// Statistic of Mann and Kendall, standard normal without a trend; `None` of few tests.
    pub trend_z: Option<f64>,
    /// Number of outliers.
    pub outlier_count: usize,
    /// The outliers, the farthest first; of many the first.
    pub outliers: Vec<Outlier>,
    /// All values, in the order of the tests.
    #[serde(skip)]
    pub points: Vec<Point>,
}

impl Distribution {
    /// Returns the limits beyond which a value is an outlier; `None` where there is no spread to judge by.
    pub fn limits(&self) -> Option<[f64; 2]> {
        let reach = OUTLIER_LIMIT * self.spread;
        let is_judged = self.count >= LEAST_VALUES && reach > 0.0;
        is_judged.then_some([self.median - reach, self.median + reach])
    }

    /// Returns true if the values go up or down over the tests by more than chance.
    pub fn has_trend(&self) -> bool {
        self.trend_z.is_some_and(|z| z.abs() > CLEAR_TREND)
    }

    /// Returns the distribution of these values; `None` without any. `name` gives the name of a test.
    fn of(quantity: Quantity, points: Vec<Point>, name: &impl Fn(u32) -> String) -> Option<Self> {
        let mut values: Vec<f64> = points.iter().map(|point| point.value).collect();
        let (first, last) = (points.first()?, points.last()?);
        let centre = median(&mut values);
        let min = values.iter().copied().fold(f64::INFINITY, f64::min);
        let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut distances: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
        let spread = NORMAL_RATIO * median(&mut distances);
        let trend = Trend::of(&points);
        let tests = f64::from(last.test - first.test);
        let mut found = Self {
            quantity,
            unit: quantity.unit(),
            count: points.len(),
            median: centre,
            spread,
            min,
            max,
            trend_percent: trend
                .map(|trend| 100.0 * trend.slope * tests / centre)
                .filter(|percent| percent.is_finite()),
            trend_z: trend.map(|trend| trend.z),
            outlier_count: 0,
            outliers: Vec::new(),
            points: Vec::new(),
        };
        if let Some([low, high]) = found.limits() {
            let beyond = points.iter();
            let beyond = beyond.filter(|point| !(low..=high).contains(&point.value));
            let mut beyond: Vec<Point> = beyond.copied().collect();
            found.outlier_count = beyond.len();
            let score = |point: &Point| (point.value - centre) / spread;
            beyond.sort_by(|a, b| {
                let order = score(b).abs().total_cmp(&score(a).abs());
                order.then(a.test.cmp(&b.test))
            });
            found.outliers = beyond
                .iter()
                .take(MOST_OUTLIERS)
                .map(|point| Outlier {
                    test: point.test,
                    file: name(point.test),
                    value: point.value,
                    score: score(point),
                })
                .collect();
        }
        found.points = points;
        Some(found)
    }
}

/// Change of a quantity over the order of the tests.
#[derive(Debug, Clone, Copy)]
struct Trend {
    /// Median of the slopes between all pairs (unit of the quantity, per test).
    slope: f64,
    /// Statistic of Mann and Kendall.
    z: f64,
}

impl Trend {
    /// `None` of few values.
    fn of(points: &[Point]) -> Option<Self> {
        if points.len() < LEAST_VALUES {
            return None;
        }
        let size = points.len().div_ceil(MOST_SLOPED);
        let groups = points.chunks(size).map(|group| {
            let places = group.iter().map(|point| f64::from(point.test)).sum::<f64>();
            let mut values: Vec<f64> = group.iter().map(|point| point.value).collect();
            (places / group.len() as f64, median(&mut values))
        });
        let groups: Vec<(f64, f64)> = groups.collect();
        let mut slopes = Vec::with_capacity(groups.len() * groups.len() / 2);
        let mut score = 0.0;
        for (index, (place, value)) in groups.iter().enumerate() {
            for (earlier, before) in &groups[..index] {
                slopes.push((value - before) / (place - earlier));
                score += match value.total_cmp(before) {
                    std::cmp::Ordering::Less => -1.0,
                    std::cmp::Ordering::Equal => 0.0,
                    std::cmp::Ordering::Greater => 1.0,
                };
            }
        }
        let count = groups.len() as f64;
        let variance = count * (count - 1.0) * (2.0 * count + 5.0) / 18.0;
        Some(Self {
            slope: median(&mut slopes),
            z: score / variance.sqrt(),
        })
    }
}

/// A reason or a code, and the number of tests that have it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Counted {
    /// The reason or the code.
    pub name: String,
    /// Number of tests.
    pub count: u64,
    /// The first of these tests.
    pub first: String,
}

/// What all tests show together.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Number of tests.
    pub tests: u64,
    /// Number of tests with an answer.
    pub answered: u64,
    /// Number of tests whose data give no answer.
    pub no_answer: u64,
    /// Number of tests that could not be analysed.
    pub failed: u64,
    /// Reasons of those without an answer, the most frequent first. FILE stands for the name of a file.
    pub reasons: Vec<Counted>,
    /// Verdicts of the diagnoses with what they name, the most frequent first.
    pub verdicts: Vec<Counted>,
    /// Checks of good practice that failed, the most frequent first.
    pub bad_checks: Vec<Counted>,
    /// Checks of good practice with a doubt, likewise.
    pub doubtful_checks: Vec<Counted>,
    /// Warnings, likewise.
    pub warnings: Vec<Counted>,
    /// Distributions of the frequencies and of the stiffnesses.
    pub distributions: Vec<Distribution>,
}

/// Counts, each with the first test.
type Counts = BTreeMap<String, (u64, u32)>;

/// Gathers what a summary needs, one record after the other: 16 bytes for each value.
#[derive(Debug, Clone, Default)]
pub struct Collector {
    tests: u32,
    outcomes: [u64; 3],
    reasons: Counts,
    verdicts: Counts,
    bad_checks: Counts,
    doubtful_checks: Counts,
    warnings: Counts,
    values: BTreeMap<Quantity, Vec<Point>>,
}

fn add(counts: &mut Counts, name: String, test: u32) {
    counts.entry(name).or_insert((0, test)).0 += 1;
}

impl Collector {
    /// Adds the next record, in the order of the tests.
    pub fn add(&mut self, record: &BatchRecord) {
        let test = self.tests;
        self.tests += 1;
        let row = &record.test;
        self.outcomes[row.outcome as usize] += 1;
        if let Some(error) = &row.error {
            let reason = row.reason.as_ref().unwrap_or(error);
            let mut reason: String = reason.chars().take(LONGEST_REASON).collect();
            if self.reasons.len() >= MOST_REASONS && !self.reasons.contains_key(&reason) {
                reason = "other reasons".to_owned();
            }
            add(&mut self.reasons, reason, test);
        }
        if let Some(verdict) = &row.verdict {
            let words = match row.effects.is_empty() {
                true => verdict.clone(),
                false => format!("{verdict}: {}", row.effects.join(", ")),
            };
            add(&mut self.verdicts, words, test);
        }
        for (codes, counts) in [
            (&row.bad_checks, &mut self.bad_checks),
            (&row.doubtful_checks, &mut self.doubtful_checks),
            (&row.warning_codes, &mut self.warnings),
        ] {
            for code in codes {
                add(counts, code.clone(), test);
            }
        }
        let mut add = |quantity: Quantity, value: Option<f64>| {
            if let Some(value) = value.filter(|value| value.is_finite()) {
                let values = self.values.entry(quantity).or_default();
                values.push(Point { test, value });
            }
        };
        for mode in &record.modes {
            if let Some(number) = mode.mode.filter(|number| *number <= MOST_MODES) {
                add(Quantity::Mode(number), mode.frequency);
            }
        }
        let value = |found: Option<Estimated>| found.and_then(|found| found.value);
        add(Quantity::Kt, value(row.parameters.kt));
        add(Quantity::Kr, value(row.parameters.kr));
        add(Quantity::Modulus, value(row.parameters.modulus));
    }

    /// Returns the summary. `name` gives the name of a test by its index.
    pub fn finish(self, name: impl Fn(u32) -> String) -> Summary {
        let counted = |counts: Counts| {
            let mut all: Vec<(String, (u64, u32))> = counts.into_iter().collect();
            all.sort_by_key(|(_, (count, first))| (std::cmp::Reverse(*count), *first));
            let all = all.into_iter().map(|(reason, (count, first))| Counted {
                name: reason,
                count,
                first: name(first),
            });
            all.collect()
        };
        let [answered, no_answer, failed] = self.outcomes;
        let values = self.values.into_iter();
        Summary {
            tests: u64::from(self.tests),
            answered,
            no_answer,
            failed,
            reasons: counted(self.reasons),
            verdicts: counted(self.verdicts),
            bad_checks: counted(self.bad_checks),
            doubtful_checks: counted(self.doubtful_checks),
            warnings: counted(self.warnings),
            distributions: values
                .filter_map(|(quantity, points)| Distribution::of(quantity, points, &name))
                .collect(),
        }
    }
}

const _: () = assert!(TestOutcome::Answered as usize == 0 && TestOutcome::Failed as usize == 2);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ModeRow, TestRow};

    fn record(frequency: f64) -> BatchRecord {
        BatchRecord {
            test: TestRow {
                outcome: TestOutcome::Answered,
                ..TestRow::default()
            },
            modes: vec![ModeRow {
                mode: Some(1),
                frequency: Some(frequency),
                ..ModeRow::default()
            }],
            ..BatchRecord::default()
        }
    }

    fn summary_of(frequencies: impl IntoIterator<Item = f64>) -> Summary {
        let mut collector = Collector::default();
        for frequency in frequencies {
            collector.add(&record(frequency));
        }
        collector.finish(|test| format!("test {test}"))
    }

    /// Values of a normal distribution's quantiles, in an order without a trend.
    fn scattered(count: usize) -> impl Iterator<Item = f64> {
        (0..count).map(move |index| {
            let place = (index * 37 % count) as f64 + 0.5;
            100.0 + (place / count as f64 - 0.5)
        })
    }

    #[test]
    fn recover_a_drift_and_a_wild_value() {
        let drifting = scattered(101).enumerate().map(|(index, value)| {
            let wild = if index == 50 { 20.0 } else { 0.0 };
            value + 0.02 * index as f64 + wild
        });
        let summary = summary_of(drifting);
        let found = &summary.distributions[0];
        assert!(found.has_trend());
        let percent = found.trend_percent.unwrap();
        assert!((percent / 2.0 - 1.0).abs() < 0.1, "{percent}");
        assert_eq!(found.outlier_count, 1);
        assert_eq!(
            (found.outliers[0].test, &*found.outliers[0].file),
            (50, "test 50")
        );
    }

    #[test]
    fn limit_few_equal_or_no_values() {
        assert!(summary_of([]).distributions.is_empty());
        let few = summary_of([1.0, 2.0, 100.0]);
        assert_eq!(few.distributions[0].trend_z, None);
        assert_eq!(few.distributions[0].limits(), None);
        let equal = summary_of([5.0; 20]);
        let found = &equal.distributions[0];
        assert_eq!((found.spread, found.outlier_count), (0.0, 0));
        assert_eq!((found.trend_percent, found.has_trend()), (Some(0.0), false));
    }

    #[test]
    fn limit_many_values_have_the_trend_of_their_groups() {
        let summary = summary_of(
            scattered(5003)
                .enumerate()
                .map(|(i, v)| v + 1e-3 * i as f64),
        );
        let percent = summary.distributions[0].trend_percent.unwrap();
        assert!(
            (percent / (100.0 * 5.003 / 102.5) - 1.0).abs() < 0.05,
            "{percent}"
        );
    }

    #[test]
    fn limit_reasons_are_counted_without_the_name_of_the_test() {
        let mut collector = Collector::default();
        for file in ["a.wav", "b.wav"] {
            let error = format!("{file}: is empty");
            collector.add(&BatchRecord::failed(file, &[], error, &[]));
        }
        let summary = collector.finish(|test| test.to_string());
        assert_eq!(summary.failed, 2);
        assert_eq!(summary.reasons.len(), 1);
        assert_eq!(
            (&*summary.reasons[0].name, summary.reasons[0].count),
            ("FILE: is empty", 2)
        );
    }
}
