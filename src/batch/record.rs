//! The answer to one test, as plain data that goes through JSON without loss.

use serde::{Deserialize, Serialize};
use tapjoint_identify::Uncertain;

/// The answer to one test: its rows of the three tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BatchRecord {
    /// Row of the table of tests.
    pub test: TestRow,
    /// Rows of the table of modes.
    pub modes: Vec<ModeRow>,
    /// Rows of the table of hypotheses, the most probable first; empty without a diagnosis.
    pub hypotheses: Vec<HypothesisRow>,
}

impl BatchRecord {
    /// The record of a test that cannot be analysed. `files` names the files that it reads, as the error may name them.
    pub fn failed(file: &str, carried: &[String], error: String, files: &[String]) -> Self {
        Self {
            test: TestRow {
                file: file.to_owned(),
                outcome: TestOutcome::Failed,
                reason: Some(reason_of(&error, file, files)),
                error: Some(error),
                carried: carried.to_vec(),
                ..TestRow::default()
            },
            ..Self::default()
        }
    }
}

/// Returns an error without the names of files, and without the line after the first of them.
fn reason_of(error: &str, file: &str, files: &[String]) -> String {
    let mut names: Vec<&str> = files.iter().map(String::as_str).chain([file]).collect();
    // A name may begin with another one.
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    let mut reason = error.to_owned();
    for name in names {
        reason = without(&reason, name);
    }
    let after = reason.strip_prefix("FILE:");
    let after = after.map(|after| after.trim_start_matches(|c: char| c.is_ascii_digit()));
    match after.filter(|after| after.starts_with(": ")) {
        Some(after) => format!("FILE{after}"),
        None => reason,
    }
}

/// Replaces a name by FILE. A name without folder and ending may be a word, so it counts at the beginning alone.
fn without(text: &str, name: &str) -> String {
    let is_word = !name.contains(['/', '\\', '.']);
    let in_name = |c: char| c.is_alphanumeric() || "/\\_-".contains(c);
    let (mut kept, mut end) = (String::new(), 0);
    for (place, _) in text.match_indices(name).filter(|_| !name.is_empty()) {
        let (before, after) = (&text[..place], &text[place + name.len()..]);
        let is_name = match is_word {
            true => place == 0 && after.starts_with(':'),
            false => !before.ends_with(in_name) && !after.starts_with(in_name),
        };
        if is_name {
            kept.push_str(&text[end..place]);
            kept.push_str("FILE");
            end = place + name.len();
        }
    }
    kept + &text[end..]
}

/// How a test ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TestOutcome {
    /// It has an answer: an estimate or a prediction; a bare recording has a mode.
    Answered,
    /// Its data give no answer.
    NoAnswer,
    /// It could not be analysed.
    #[default]
    Failed,
}

impl TestOutcome {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Answered => "answered",
            Self::NoAnswer => "no-answer",
            Self::Failed => "failed",
        }
    }
}

/// An estimated value with its 95 % interval (SI).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimated {
    /// The value; `None` where it is infinite: rigid.
    pub value: Option<f64>,
    /// Standard deviation, where known.
    pub std: Option<f64>,
    /// Lower 95 % limit; `None` where it is unknown or unbounded.
    pub low: Option<f64>,
    /// Upper 95 % limit, likewise.
    pub high: Option<f64>,
}

impl Estimated {
    /// Takes a value with its uncertainty. What is not finite does not exist.
    pub fn of(found: &Uncertain) -> Self {
        let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
        Self {
            value: finite(Some(found.value)),
            std: finite(found.std),
            low: finite(found.low),
            high: finite(found.high),
        }
    }
}

/// The estimated parameters; `None` for each that was not estimated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Translational stiffness (N/m).
    pub kt: Option<Estimated>,
    /// Rotational stiffness (N m/rad).
    pub kr: Option<Estimated>,
    /// Coupling stiffness (N/rad).
    pub ktr: Option<Estimated>,
    /// Translational stiffness (1).
    pub kx: Option<Estimated>,
    /// Rotational stiffness (1).
    pub ky: Option<Estimated>,
    /// Coupling stiffness (1).
    pub kz: Option<Estimated>,
    /// sqrt(Kx Ky)/Kz (1).
    pub coupling: Option<Estimated>,
    /// Young's modulus (Pa).
    pub modulus: Option<Estimated>,
    /// Density (kg/m3).
    pub density: Option<Estimated>,
}

/// One test.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TestRow {
    /// The description or the recording, as the user named it.
    pub file: String,
    /// Name of the test; empty of one that could not be analysed.
    pub name: String,
    /// How it ended.
    pub outcome: TestOutcome,
    /// Why there is no answer.
    pub error: Option<String>,
    /// The same without the names and lines that differ from test to test, where they are known. FILE stands for each.
    pub reason: Option<String>,
    /// "cantilever", "lap" or "free"; `None` of a bare recording.
    pub kind: Option<String>,
    /// Number of recordings.
    pub recordings: u64,
    /// Number of taps that were used.
    pub taps_accepted: u64,
    /// Number of taps that were rejected.
    pub taps_rejected: u64,
    /// Number of modes.
    pub modes: u64,
    /// Method of the estimate: "consistent", "pairs" or "free-beam".
    pub method: Option<String>,
    /// Numbers of the modes that entered the estimate.
    pub modes_used: Vec<u64>,
    /// The estimate by the described model.
    pub parameters: Parameters,
    /// Probability of a larger misfit if the model is right.
    pub goodness_of_fit: Option<f64>,
    /// Root mean square misfit of the frequencies (%).
    pub misfit_percent: Option<f64>,
    /// Model of the headline's joint: "described", or "with sensor-mass" and the like.
    pub headline: Option<String>,
    /// Translational stiffness of the headline (N/m), without a standard deviation.
    pub headline_kt: Option<Estimated>,
    /// Rotational stiffness of the headline (N m/rad), without a standard deviation.
    pub headline_kr: Option<Estimated>,
    /// Kind of the diagnosis' verdict: "no-gap", "named", ...
    pub verdict: Option<String>,
    /// Effects that the verdict names.
    pub effects: Vec<String>,
    /// The most probable hypothesis.
    pub first_hypothesis: Option<String>,
    /// Its probability (1).
    pub first_probability: Option<f64>,
    /// Number of checks of good practice that apply.
    pub checks: u64,
    /// Codes of the checks with a doubt, each once.
    pub doubtful_checks: Vec<String>,
    /// Codes of the checks that failed, each once.
    pub bad_checks: Vec<String>,
    /// Number of warnings.
    pub warnings: u64,
    /// Codes of the warnings, each once, in their order.
    pub warning_codes: Vec<String>,
    /// Cells of the input table that are carried as they are.
    pub carried: Vec<String>,
}

/// One mode of a test, or a peak that belongs to no mode.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ModeRow {
    /// Number of the mode; `None` for a peak that belongs to no mode.
    pub mode: Option<u64>,
    /// Name of a peak that is no mode.
    pub label: Option<String>,
    /// The recording that it was read from.
    pub recording: Option<String>,
    /// "fit", "interpolated", "line", or "given".
    pub method: String,
    /// Frequency (Hz).
    pub frequency: Option<f64>,
    /// Its standard deviation (Hz).
    pub std: Option<f64>,
    /// Lower end of its interval (Hz).
    pub low: Option<f64>,
    /// Upper end of its interval (Hz).
    pub high: Option<f64>,
    /// Bound of a reading on a line (Hz).
    pub half_line: Option<f64>,
    /// Damping ratio (1).
    pub damping: Option<f64>,
    /// Its standard deviation (1).
    pub damping_std: Option<f64>,
    /// Lower end of its 95 % interval (1).
    pub damping_low: Option<f64>,
    /// Upper end of its 95 % interval (1).
    pub damping_high: Option<f64>,
    /// Non-dimensional frequency of an Euler beam (1).
    pub lambda: Option<f64>,
    /// Coherence on the line of the mode (1).
    pub coherence: Option<f64>,
    /// Frequency by the estimate (Hz).
    pub predicted: Option<f64>,
    /// Predicted less measured (% of measured).
    pub error_percent: Option<f64>,
    /// True if the mode entered the estimate; `None` without a prediction.
    pub used: Option<bool>,
}

/// One hypothesis of the diagnosis of a test.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct HypothesisRow {
    /// The hypothesis: effects joined by "+", "none" or "unknown".
    pub effect: String,
    /// Groups of its effects, joined by "+".
    pub group: Option<String>,
    /// Probability (1).
    pub probability: Option<f64>,
    /// Logarithm of its evidence over that of "none".
    pub log_bayes_factor: Option<f64>,
    /// Effects that these data cannot separate from it.
    pub confounded_with: Vec<String>,
    /// Values of its parameters.
    pub parameters: Vec<ParameterRow>,
    /// Error of the fitted frequencies under the nominal model (%, root mean square).
    pub gap_before: Option<f64>,
    /// Error under the hypothesis (%, root mean square).
    pub gap_after: Option<f64>,
    /// Error of the withheld frequencies under the nominal model (%, root mean square).
    pub withheld_before: Option<f64>,
    /// Error of the withheld frequencies under the hypothesis (%, root mean square).
    pub withheld_after: Option<f64>,
    /// Share of the gap that it closes on withheld frequencies (1).
    pub withheld_closure: Option<f64>,
}

/// A parameter of a hypothesis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterRow {
    /// Effect and parameter: "sensor-mass.mass".
    pub name: String,
    /// Value (SI).
    pub value: Option<f64>,
    /// Standard uncertainty (SI), where the data bound it.
    pub std: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_equal_reasons_are_equal_whatever_the_names() {
        let low = ["tests/a/test.toml", "tests/a/low.wav"].map(str::to_owned);
        let cases = [
            ("a.wav", "a.wav: is empty", "FILE: is empty"),
            (
                "e",
                "e: cannot be read: there is no e",
                "FILE: cannot be read: there is no e",
            ),
            (
                "tests/a/test.toml",
                "tests/a/test.toml:35: `recording.file`: tests/a/low.wav cannot be read",
                "FILE: `recording.file`: FILE cannot be read",
            ),
            (
                "tests/a/test.toml",
                "tests/a/low.wav:1: no line of numbers",
                "FILE: no line of numbers",
            ),
            ("a.wav", "aa.wav: is empty", "aa.wav: is empty"),
            ("", "is empty", "is empty"),
        ];
        for (file, error, expected) in cases {
            assert_eq!(reason_of(error, file, &low), expected);
        }
    }
}
