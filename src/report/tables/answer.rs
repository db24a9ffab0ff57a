//! Tables of the answer in short.

use super::comparison::changed_modes;
use super::joint::estimated;
use super::modes::{damping, reading};
use super::{Table, number, words};
use crate::document::{Document, HeadlineValue, ModeSection};
use crate::format::{MISSING, capital, or_missing, prefix, signed_percent};
use crate::words::sizes::{limits, with_limits};
use std::fmt;

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

/// Word for a stiffness without bound.
const NO_SPRING: &str = "rigid";

/// A value with its 95 % limits, in words: "2.00" and "1.89 to 2.12". Displays as "2.00 (1.89 to 2.12)".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limited {
    /// The value.
    pub value: String,
    /// Its limits; `None` where they are unknown.
    pub limits: Option<String>,
}

impl fmt::Display for Limited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.limits {
            Some(limits) => write!(f, "{} ({limits})", self.value),
            None => f.write_str(&self.value),
        }
    }
}

/// A stiffness or property as the answer gives it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AnsweredValue {
    /// "Kt".
    pub symbol: &'static str,
    /// Unit of both values: "MN/m".
    pub unit: String,
    /// With what the diagnosis names; `None` where that is nothing.
    pub with_cause: Option<Limited>,
    /// By the described model.
    pub described: Limited,
}

impl AnsweredValue {
    /// Returns the value to go by.
    pub fn first(&self) -> &Limited {
        self.with_cause.as_ref().unwrap_or(&self.described)
    }
}

/// Returns the joint as described and with what the diagnosis names; without a joint the beam.
pub fn answered_values(document: &Document) -> Vec<AnsweredValue> {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let headline = document.headline.as_ref();
    let headline = headline.filter(|found| !found.is_described());
    let parameters = estimate.map(estimated).unwrap_or_default();
    let physical = parameters.iter().filter(|one| one.unit != "1");
    let values = physical.map(|parameter| {
        let [mut value, _, low, high, unit] = parameter.written();
        let scale = parameter.value.value;
        if scale.is_infinite() {
            value = NO_SPRING.to_owned();
        }
        let (factor, _) = prefix(if scale.is_infinite() { 1.0 } else { scale });
        let with = headline.and_then(|found| match parameter.name {
            "kt" => found.kt,
            "kr" => found.kr,
            _ => None,
        });
        let [low, high] = [&low, &high].map(|end| Some(end.as_str()).filter(|end| *end != MISSING));
        AnsweredValue {
            symbol: parameter.symbol,
            unit,
            with_cause: with.map(|with| limited(with, factor)),
            described: Limited {
                value,
                limits: limits(low, high),
            },
        }
    });
    values.collect()
}

/// Returns a value of the headline in the unit that `factor` leads to.
fn limited(found: HeadlineValue, factor: f64) -> Limited {
    let [low, high] = [found.low, found.high].map(|end| end.map(|end| factor * end));
    let (value, limits) = with_limits(factor * found.value.unwrap_or(f64::INFINITY), low, high);
    Limited {
        value: found.value.map_or(NO_SPRING.to_owned(), |_| value),
        limits,
    }
}

/// Returns the values as a table; `None` without any. `model` has what the diagnosis names: "with sensor-mass".
pub fn answered_joint(values: &[AnsweredValue], model: Option<&str>) -> Option<Table> {
    let rows = values.iter().map(|value| {
        [
            words("95 % limits", format!("{} ({})", value.symbol, value.unit)),
            words(
                &capital(model.unwrap_or_default()),
                or_missing(value.with_cause.as_ref()),
            ),
            words("As described", value.described.to_string()),
        ]
    });
    let table = Table::of("", rows, "").without_empty_columns();
    (!table.rows.is_empty()).then_some(table)
}
