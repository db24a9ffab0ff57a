//! The score as rows: the meaning, value and target of each rate, beside the figures of an ideal observer.
//!
//! Those come from a Monte Carlo study of 840 cases with frequencies good to 0.03 % and effects of the sizes drawn here,
//! diagnosed by the very model that made them. A diagnosis from recordings whose frequencies are better known than that
//! may surpass it.
//!
//! The ideal observer names an effect by a slightly different definition: a probability above 0.8 whose model fits, from
//! five modes, where the diagnosis gives a verdict on five of six modes and the one withheld. The shares that rest on it
//! (something is named, nothing is called an effect) compare in size alone.

use super::case::Extent;
use super::score::{Rate, Scores};

/// The side of its target on which a figure has to stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// At least so much.
    AtLeast(f64),
    /// At most so much.
    AtMost(f64),
    /// No target; for information.
    None,
}

impl Target {
    /// Returns true where a figure meets it.
    pub fn is_met(&self, value: f64) -> bool {
        match *self {
            Self::AtLeast(limit) => value >= limit,
            Self::AtMost(limit) => value <= limit,
            Self::None => true,
        }
    }
}

/// One figure of the score.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name for programs.
    pub key: &'static str,
    /// Its meaning.
    pub meaning: &'static str,
    /// The figure; `None` without a case.
    pub value: Option<f64>,
    /// Its 95 % interval; `None` where it is no rate.
    pub interval: Option<(f64, f64)>,
    /// Hits and cases of a rate.
    pub counts: Option<(usize, usize)>,
    /// The aim with five recordings (two sensor positions, three tap positions, two
    /// levels, six modes).
    pub target: Target,
    /// The figure that an ideal observer reaches; `None` where that is not known.
    pub ideal: Option<f64>,
}

/// The figure that counts tests.
const NO_ANSWER: &str = "no_answer";

/// All figures in the order of reading, of tests of this extent; of tests made elsewhere (`None`) beside what is aimed
/// at with five recordings. With one recording nothing is aimed at but what an ideal observer reaches.
pub fn rows(scores: &Scores, extent: Option<Extent>) -> Vec<Row> {
    let mut rows = all_rows(scores);
    for row in &mut rows {
        let ideal = IDEAL.iter().find(|ideal| ideal.0 == row.key);
        row.ideal = ideal
            .zip(extent)
            .map(|((_, one, five), extent)| match extent {
                Extent::OneRecording => *one,
                Extent::FiveRecordings => *five,
            });
        if extent == Some(Extent::OneRecording) && row.key != NO_ANSWER {
            row.target = Target::None;
        }
    }
    rows
}

fn all_rows(s: &Scores) -> Vec<Row> {
    use Target::{AtLeast, AtMost, None};
    let tests: usize = s.counts.iter().sum();
    let failed = (tests > 0).then_some(s.failed as f64);
    let (median, tenth) = s.closure.unzip();
    let error = s.calibration.expected_calibration_error;
    vec![
        rate("top_1", s.top_1, AtLeast(0.80)),
        rate("top_1_detectable", s.top_1_detectable, AtLeast(0.88)),
        rate("top_3", s.top_3, AtLeast(0.94)),
        rate("where", s.place, AtLeast(0.83)),
        rate("top_1_of_all", s.top_1_of_all, None),
        rate("named_right", s.named_right, AtLeast(0.96)),
        rate("coverage", s.named, AtLeast(0.62)),
        rate("named_right_of_all", s.named_right_of_all, None),
        rate("name_share", s.name_share, None),
        rate("single_named_right", s.single_named_right, None),
        rate("single_coverage", s.single_named, None),
        rate(
            "single_named_right_of_all",
            s.single_named_right_of_all,
            None,
        ),
        rate("set_up_named", s.set_up_named, None),
        rate("null_called_effect", s.null_called_effect, AtMost(0.02)),
        rate("null_false_alarm", s.null_false_alarm, None),
        rate("outside_named", s.outside_named, AtMost(0.18)),
        rate("outside_single_named", s.outside_single_named, None),
        rate("outside_refused", s.outside_refused, AtLeast(0.80)),
        rate("outside_unknown", s.outside_unknown, None),
        rate(
            "several_found_or_refused",
            s.several_found_or_refused,
            AtLeast(0.80),
        ),
        rate("several_detectable", s.several_detectable, None),
        rate("several_found", s.several_found, None),
        rate("set_coverage", s.set_coverage, AtLeast(0.88)),
        figure(NO_ANSWER, failed, AtMost(0.0)),
        figure("set_size", s.set_size, AtMost(2.0)),
        figure("truth_probability", s.truth_probability, None),
        figure("brier", s.calibration.brier, None),
        figure("calibration_error", error, AtMost(0.08)),
        figure("closure_median", median, AtLeast(0.97)),
        figure("closure_10th", tenth, AtLeast(0.75)),
        figure("size_error", s.size_error, AtMost(0.15)),
        rate("size_within_2_std", s.size_within_2_std, None),
        rate("set_up_size_within_2_std", s.set_up_size_within_2_std, None),
    ]
}

/// The meaning of a figure.
fn meaning(key: &str) -> &'static str {
    match key {
        "top_1" => "one effect: first group is right",
        "top_1_detectable" => "the same where it can be noticed",
        "top_3" => "one effect: among the first three",
        "where" => "one effect: place is right",
        "top_1_of_all" => "one effect: first of all classes",
        "named_right" => "one effect, named: name is right",
        "coverage" => "one effect: something is named",
        "named_right_of_all" => "any case, named: name is right",
        "name_share" => "any case: something is named",
        "single_named_right" => "one effect, no group: name is right",
        "single_coverage" => "one effect: named, and no group",
        "single_named_right_of_all" => "any case, no group: name is right",
        "set_up_named" => "clear error of the set-up: named",
        "null_called_effect" => "nothing: called an effect",
        "null_false_alarm" => "nothing: an effect comes first",
        "outside_named" => "outside: named",
        "outside_single_named" => "outside: named, and no group",
        "outside_refused" => "outside, refutable: refused",
        "outside_unknown" => "outside: called unknown",
        "several_found_or_refused" => "two: both found, or refused",
        "several_detectable" => "the same where both can be noticed",
        "several_found" => "two: both found",
        "set_coverage" => "90 % set holds the truth",
        NO_ANSWER => "tests that could not be diagnosed",
        "set_size" => "mean size of the 90 % set",
        "truth_probability" => "mean probability of the truth",
        "brier" => "Brier score",
        "calibration_error" => "expected calibration error",
        "closure_median" => "withheld closure, named: median",
        "closure_10th" => "withheld closure, named: 10th pct",
        "size_error" => "size error, median |ln ratio|",
        "size_within_2_std" => "named: size within 2 std",
        "set_up_size_within_2_std" => "set-up, named: size within 2 std",
        _ => "",
    }
}

fn rate(key: &'static str, rate: Rate, target: Target) -> Row {
    Row {
        interval: rate.interval(),
        counts: Some((rate.hits, rate.of)),
        ..figure(key, rate.value(), target)
    }
}

fn figure(key: &'static str, value: Option<f64>, target: Target) -> Row {
    Row {
        key,
        meaning: meaning(key),
        value,
        interval: None,
        counts: None,
        target,
        ideal: None,
    }
}

/// The rows as a table for a terminal, 80 columns wide; targets and an ideal observer's figures where there are any.
pub fn render_rows(rows: &[Row]) -> String {
    let aimed_at = rows.iter().any(|row| row.target != Target::None);
    let compared = rows.iter().any(|row| row.ideal.is_some());
    let head = format!(
        "{:<34}{:>6}  {:<14}{:>8}{:>7}  {}",
        "figure",
        "value",
        "95 % interval",
        "cases",
        if compared { "ideal" } else { "" },
        if aimed_at { "target" } else { "" }
    );
    let mut text = head.trim_end().to_owned() + "\n";
    let mut any_missed = false;
    for row in rows {
        // A number of tests is whole.
        let [decimals, of_target] = if row.key == NO_ANSWER { [0, 0] } else { [3, 2] };
        let value = row.value.map(|value| format!("{value:.decimals$}"));
        let value = value.unwrap_or_else(|| "-".to_owned());
        let interval = row
            .interval
            .map(|(low, high)| format!("{low:.3} to {high:.3}"));
        let interval = interval.unwrap_or_default();
        let counts = row.counts.map(|(hits, of)| format!("{hits}/{of}"));
        let counts = counts.unwrap_or_default();
        let ideal = row.ideal.map(|ideal| format!("{ideal:.2}"));
        let ideal = ideal.unwrap_or_default();
        let missed = row.value.is_some_and(|value| !row.target.is_met(value));
        any_missed |= missed;
        let mark = if missed { "!" } else { "" };
        let target = match row.target {
            Target::AtLeast(limit) => format!(">={limit:.of_target$}{mark}"),
            Target::AtMost(limit) => format!("<={limit:.of_target$}{mark}"),
            Target::None => String::new(),
        };
        let line = format!(
            "{:<34}{value:>6}  {interval:<14}{counts:>8}{ideal:>7}  {target}",
            row.meaning
        );
        text += line.trim_end();
        text.push('\n');
    }
    if any_missed {
        text.push_str("! the target is missed\n");
    }
    if compared {
        text.push_str(
            "ideal: an observer with the very model that made the tests, in a study of 840;\nit names what is more than 80 % probable and fits, the program by its verdict\n",
        );
    }
    text
}

/// Figures by key, with one configuration and five modes, and with two sensor positions, two levels and shapes.
const IDEAL: [(&str, f64, f64); 14] = [
    ("top_1", 0.664, 0.872),
    ("top_1_detectable", 0.81, 0.94),
    ("top_3", 0.87, 0.99),
    ("where", 0.686, 0.887),
    ("named_right", 0.986, 0.993),
    ("coverage", 0.50, 0.75),
    ("null_called_effect", 0.0, 0.0),
    ("null_false_alarm", 0.25, 0.17),
    ("outside_named", 0.15, 0.17),
    ("outside_unknown", 0.25, 0.58),
    ("set_coverage", 0.95, 0.99),
    ("set_size", 2.7, 1.5),
    ("brier", 0.44, 0.21),
    ("calibration_error", 0.04, 0.03),
];
