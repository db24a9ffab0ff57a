//! The answer in short: what a reader asks first. Terminal and page show the same.

use super::comparison;
use super::diagnosis::{brief_verdict, next_in_short, shows_gap};
use super::findings::{described, no_estimate, tapped_channels, taps};
use super::series;
use crate::document::Document;
use crate::format::capital;
use crate::tables::{
    AnsweredValue, Table, answered_changes, answered_modes, answered_values, quality_count,
};
use tapjoint_analysis::{meaning_of, severity_of};
use tapjoint_diagnosis::{Hypothesis, Verdict};
use tapjoint_signal::quality::{Outcome, Subject};

/// How far an answer can be relied on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Nothing speaks against it.
    Good,
    /// Something speaks against it.
    Doubtful,
    /// There is none.
    NoAnswer,
}

impl State {
    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            State::Good => "good",
            State::Doubtful => "doubtful",
            State::NoAnswer => "no answer",
        }
    }

    /// Its class in the page's style.
    pub fn class(self) -> &'static str {
        match self {
            State::Good => "good",
            State::Doubtful => "doubtful",
            State::NoAnswer => "none",
        }
    }

    /// Its shape in the page, on 20 by 20: a disc with a tick, a triangle, a square with a cross.
    pub fn icon(self) -> &'static str {
        match self {
            State::Good => {
                r#"<circle cx="10" cy="10" r="9" fill="var(--state)"/><path d="M5.5 10.5l3 3 6-7" fill="none" stroke="var(--paper)" stroke-width="2"/>"#
            }
            State::Doubtful => {
                r#"<path d="M10 1l9.5 17.5h-19z" fill="var(--state)"/><path d="M10 7v6m0 2v2" stroke="var(--paper)" stroke-width="2"/>"#
            }
            State::NoAnswer => {
                r#"<path d="M1 1h18v18h-18z" fill="var(--state)"/><path d="M6 6l8 8m0-8l-8 8" stroke="var(--paper)" stroke-width="2"/>"#
            }
        }
    }
}

/// Most modes of an answer.
pub const MOST_MODES: usize = 8;

/// The answer of a command.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// How far it can be relied on; `None` of a comparison, whose first sentence says it.
    pub state: Option<State>,
    /// Why not farther, in half a sentence; empty of a good answer.
    pub reason: String,
    /// Name of the test, or of the recording.
    pub name: String,
    /// What it rests on, in half sentences: "10 of 10 taps used, in 2 recordings".
    pub measured: Vec<String>,
    /// The numbered modes, in order; `None` without any.
    pub modes: Option<Table>,
    /// Places of the modes in the table, the strongest first.
    pub strongest: Vec<usize>,
    /// The joint, as described and with what is missing; without a joint the beam.
    pub values: Vec<AnsweredValue>,
    /// What the first values belong to, "with sensor-mass"; `None` where that is the described model.
    pub model: Option<String>,
    /// What was found, in a few sentences.
    pub findings: Vec<String>,
    /// What to do next; `None` where nothing is needed.
    pub action: Option<String>,
    /// Doubts in half a sentence each, the worst first.
    pub doubts: Vec<&'static str>,
}

impl Answer {
    /// Returns the answer that a document holds.
    pub fn of(document: &Document) -> Self {
        let is_comparison = document.compare.is_some() || document.series.is_some();
        let (modes, strongest) = match is_comparison {
            true => answered_changes(document),
            false => answered_modes(document),
        };
        let (state, reason) = state(document);
        let headline = document.headline.as_ref();
        let headline = headline.filter(|found| !found.is_described());
        Answer {
            state: Some(state).filter(|_| !is_comparison),
            doubts: doubts(document, &reason),
            reason,
            name: name(document),
            measured: measured(document),
            modes,
            strongest,
            values: answered_values(document),
            model: headline.map(|found| found.model.clone()),
            findings: findings(document),
            action: action(document),
        }
    }

    /// Rows of the strongest modes, so many at most, in their order.
    pub fn strongest_rows(&self, most: usize) -> Vec<&Vec<String>> {
        let mut places: Vec<usize> = self.strongest.iter().copied().take(most).collect();
        places.sort_unstable();
        let rows = self.modes.iter().flat_map(|table| &table.rows).enumerate();
        let kept = rows.filter(|(place, _)| places.contains(place));
        kept.map(|(_, row)| row).collect()
    }

    /// Rows of the strongest modes, as many as an answer lists.
    pub fn strong_rows(&self) -> Vec<&Vec<String>> {
        self.strongest_rows(MOST_MODES)
    }

    /// Number of modes that are not listed.
    pub fn weaker(&self) -> usize {
        self.strongest.len().saturating_sub(MOST_MODES)
    }
}

fn name(document: &Document) -> String {
    let test = document.test.as_ref().map(|test| test.name.as_str());
    let test = test.filter(|name| !name.is_empty());
    let mut files = document.recordings.iter().flatten().map(|one| &one.file);
    let name = test.or(files.next().map(String::as_str));
    name.unwrap_or("Unnamed test").to_owned()
}

/// How far the answer can be relied on, and why not farther.
fn state(document: &Document) -> (State, String) {
    let modes = document.modes.as_deref();
    if modes.is_some_and(|modes| modes.iter().all(|mode| mode.mode.is_none())) {
        return (State::NoAnswer, "no mode was found".to_owned());
    }
    if let Some(words) = no_estimate(document) {
        return (State::NoAnswer, words.replace("no estimate: ", ""));
    }
    let said = match document
        .gap
        .as_ref()
        .map(|gap| (&gap.verdict, shows_gap(gap)))
    {
        Some((Verdict::Unknown, _)) => {
            let reason = "something is missing that the catalogue does not have";
            return (State::NoAnswer, reason.to_owned());
        }
        Some((Verdict::NotEnoughData(_), false)) => {
            Some("these data do not show whether something is missing")
        }
        // Nothing is among what may be the cause.
        Some((Verdict::Set(list), _)) if list.contains(&Hypothesis::None) => {
            Some("these data do not show whether something is missing")
        }
        Some((Verdict::NoGap, _)) | None => None,
        Some(_) => Some("something is missing in the description"),
    };
    let codes = document.main_warnings().map(|one| one.code.as_str());
    let of_answer = codes.filter(|code| severity_of(code).is_some());
    let worst = of_answer.min_by_key(|code| severity_of(code));
    // Where no model tests the frequencies, a bad reading of one is a doubt about the answer.
    let of_mode = |subject: &Subject| matches!(subject, Subject::Mode { is_mode: true, .. });
    let mut checks = document.quality.iter().flatten();
    let bad = checks.find(|one| one.outcome == Outcome::Bad && of_mode(&one.subject));
    let bad = bad.filter(|_| document.estimate.is_none());
    let bad = bad.map(|one| one.check.code());
    match said.or(worst.or(bad).and_then(meaning_of)) {
        Some(words) => (State::Doubtful, words.to_owned()),
        None => (State::Good, String::new()),
    }
}

fn measured(document: &Document) -> Vec<String> {
    let channels = tapped_channels(document);
    let channels = channels.map(|names| format!("no hammer: taps were looked for on {names}"));
    let parts = [taps(document), quality_count(document), channels];
    parts.into_iter().flatten().collect()
}

fn findings(document: &Document) -> Vec<String> {
    if let Some(section) = &document.series {
        let change = comparison::answer(document).into_iter().take(2);
        return series::answer(section).into_iter().chain(change).collect();
    }
    if document.compare.is_some() {
        return comparison::answer(document);
    }
    let missing = no_estimate(document).map(|words| capital(&words) + ".");
    let gap = document.gap.as_ref();
    let gap = gap.map(|gap| brief_verdict(gap, document.has_joint()));
    missing.into_iter().chain(gap).collect()
}

fn action(document: &Document) -> Option<String> {
    if let Some(gap) = &document.gap {
        let needs = match gap.verdict {
            Verdict::NoGap => false,
            Verdict::NotEnoughData(_) => shows_gap(gap),
            _ => true,
        };
        return next_in_short(gap).filter(|_| needs);
    }
    let warning = |code: &str| document.warnings.iter().find(|one| one.code == code);
    if let Some(forgotten) = warning("hammer-channel") {
        return Some(format!("{}.", forgotten.text));
    }
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let in_time = recordings.iter().filter(|one| one.sample_rate.is_some());
    let taps = in_time.clone().flat_map(|one| &one.taps);
    if in_time.count() == 0 || taps.clone().any(|tap| tap.accepted) {
        return described(document);
    }
    // Without taps a description would help nothing.
    Some(match (taps.count(), warning("stopped-channel")) {
        (0, _) => "Check the cables, the gain and the numbers of the channels.".to_owned(),
        (_, Some(stopped)) => format!("{}.", stopped.text),
        _ => "Each tap is rejected. The list of taps has the reasons.".to_owned(),
    })
}

/// Returns each kind of doubt once, the worst first, but for the one that `reason` gives.
fn doubts(document: &Document, reason: &str) -> Vec<&'static str> {
    let mut codes: Vec<&str> = Vec::new();
    for warning in document.main_warnings() {
        if !codes.contains(&warning.code.as_str()) {
            codes.push(&warning.code);
        }
    }
    codes.sort_by_key(|code| severity_of(code).unwrap_or(usize::MAX));
    let meanings = codes.into_iter().filter_map(meaning_of);
    meanings.filter(|meaning| *meaning != reason).collect()
}
