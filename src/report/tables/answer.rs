//! Tables of the answer in short.

use super::comparison::changed_modes;
use super::joint::estimated;
use super::modes::reading;
use super::{Table, number, words};
use crate::document::{Document, HeadlineValue, ModeSection};
use crate::format::{
    MISSING, capital, or_missing, prefix, rounded, rounded_digits, signed_percent,
};
use crate::words::sizes::NORMAL;

/// The numbered modes with their bounds and the model's errors, and their places in the order of strength.
pub fn answered_modes(document: &Document) -> (Option<Table>, Vec<usize>) {
    let modes = document.modes.as_deref().unwrap_or_default().iter();
    let modes: Vec<&ModeSection> = modes.filter(|mode| mode.mode.is_some()).collect();
    let mut strongest: Vec<usize> = (0..modes.len()).collect();
    strongest.sort_by(|a, b| {
        let [a, b] = [a, b].map(|place| modes[*place].prominence_db.unwrap_or(f64::NEG_INFINITY));
        b.total_cmp(&a)
    });
    let prediction = document.prediction.as_deref().unwrap_or_default();
    let rows = modes.iter().map(|mode| {
        let own = prediction.iter().find(|row| Some(row.mode) == mode.mode);
        let error = own.and_then(|row| row.error_percent);
        [
            number("Mode", or_missing(mode.mode)),
            number("Frequency \u{b1} 95 % (Hz)", reading(mode).joined()),
            number("Damping \u{b1} 95 % (%)", or_missing(damping(mode))),
            number("Model error (%)", signed_percent(error)),
        ]
    });
    let table = Table::of("", rows, "").without_empty_columns();
    ((!table.rows.is_empty()).then_some(table), strongest)
}

/// The modes whose frequencies were compared, and their places in the order of their change.
pub fn answered_changes(document: &Document) -> (Option<Table>, Vec<usize>) {
    let table = changed_modes(document).map(|table| Table {
        caption: String::new(),
        note: String::new(),
        ..table
    });
    let compared = document.compare.as_ref();
    let modes = compared.map_or(&[][..], |section| &section.found.modes);
    let mut strongest: Vec<usize> = (0..modes.len()).collect();
    strongest.sort_by(|a, b| {
        let [a, b] = [a, b].map(|place| modes[*place].change_percent.abs());
        b.total_cmp(&a)
    });
    (table, strongest)
}

/// "1.200 \u{b1} 0.002": the damping ratio (%) with half its 95 % interval.
pub(crate) fn damping(mode: &ModeSection) -> Option<String> {
    const DIGITS: i32 = 4;
    let ratio = mode.damping?;
    let own = mode.fit.as_ref();
    let half = own.map(|fit| 50.0 * (fit.damping_high - fit.damping_low));
    let half = half.or(mode.damping_std.map(|std| 100.0 * NORMAL * std));
    Some(rounded_digits(100.0 * ratio, half, DIGITS).joined())
}

/// Word for a stiffness without bound.
const NO_SPRING: &str = "rigid";

/// A stiffness or property with its 95 % limits, as the answer gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct AnsweredValue {
    /// "Kt".
    pub symbol: &'static str,
    /// "MN/m".
    pub unit: String,
    /// With what the diagnosis names: "2.00 (1.89 to 2.12)"; `None` where that is nothing.
    pub with_cause: Option<String>,
    /// By the described model: "1.636 (1.544 to 1.736)".
    pub described: String,
}

impl AnsweredValue {
    /// The value to go by, and its limits: "2.00" and "1.89 to 2.12".
    pub fn parts(&self) -> (&str, &str) {
        let text = self.with_cause.as_deref().unwrap_or(&self.described);
        let (value, limits) = text.split_once(" (").unwrap_or((text, ""));
        (value, limits.trim_end_matches(')'))
    }
}

/// The joint with its 95 % limits, as described and with what the diagnosis names; without a joint the beam.
pub fn answered_values(document: &Document) -> Vec<AnsweredValue> {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let headline = document.headline.as_ref();
    let headline = headline.filter(|found| !found.is_described());
    let parameters = estimate.map(estimated).unwrap_or_default();
    let physical = parameters.iter().filter(|one| one.unit != "1");
    let values = physical.map(|parameter| {
        let [mut value, _, low, high, unit] = parameter.written();
        if parameter.value.value.is_infinite() {
            value = NO_SPRING.to_owned();
        }
        let scale = parameter.value.value;
        let (factor, _) = prefix(if scale.is_infinite() { 1.0 } else { scale });
        let with = headline.and_then(|found| match parameter.name {
            "kt" => found.kt,
            "kr" => found.kr,
            _ => None,
        });
        AnsweredValue {
            symbol: parameter.symbol,
            unit,
            with_cause: with.map(|with| with_limits(with, factor)),
            described: match (low == MISSING, high == MISSING) {
                (false, false) => format!("{value} ({low} to {high})"),
                (false, true) => format!("{value} (above {low})"),
                (true, false) => format!("{value} (below {high})"),
                (true, true) => value,
            },
        }
    });
    values.collect()
}

/// The same as a table; `None` without an estimate.
pub fn answered_joint(document: &Document) -> Option<Table> {
    let values = answered_values(document);
    let model = document
        .headline
        .as_ref()
        .map(|found| capital(&found.model));
    let rows = values.into_iter().map(|value| {
        [
            words("95 % limits", format!("{} ({})", value.symbol, value.unit)),
            words(
                model.as_deref().unwrap_or_default(),
                or_missing(value.with_cause),
            ),
            words("As described", value.described),
        ]
    });
    let table = Table::of("", rows, "").without_empty_columns();
    (!table.rows.is_empty()).then_some(table)
}

/// "2.00 (1.89 to 2.12)", in the unit that `factor` leads to.
fn with_limits(found: HeadlineValue, factor: f64) -> String {
    let Some(value) = found.value else {
        return NO_SPRING.to_owned();
    };
    let half = found
        .low
        .zip(found.high)
        .map(|(low, high)| 0.5 * (high - low));
    let shown = rounded(factor * value, half.map(|half| factor * half)).value;
    let decimals = shown.split_once('.').map_or(0, |(_, behind)| behind.len());
    match (found.low, found.high) {
        (Some(low), Some(high)) => format!(
            "{shown} ({:.decimals$} to {:.decimals$})",
            factor * low,
            factor * high
        ),
        _ => shown,
    }
}
