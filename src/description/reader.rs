//! Typed access to the tables of a TOML text: every value knows its line and its key path, so
//! that whatever is wrong with it can say where.

use super::error::{
    DescriptionError, DescriptionProblem, DescriptionWarning, Doubt, number, with_unit,
};
use super::keys::{self, KnownTable};
use std::cell::RefCell;
use std::ops::{Bound, RangeBounds};
use tapjoint_numerics::quantity::{Dimension, parse_quantity};
use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

/// The file's name, the positions of its lines, and the warnings so far.
pub(super) struct Source<'t> {
    file: &'t str,
    line_starts: Vec<usize>,
    warnings: RefCell<Vec<DescriptionWarning>>,
}

impl<'t> Source<'t> {
    pub(super) fn new(file: &'t str, text: &str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let line_starts = std::iter::once(0)
            .chain(breaks.map(|(at, _)| at + 1))
            .collect();
        Self {
            file,
            line_starts,
            warnings: RefCell::default(),
        }
    }

    /// Returns all warnings, in the order of reading.
    pub(super) fn into_warnings(self) -> Vec<DescriptionWarning> {
        self.warnings.into_inner()
    }

    /// Returns the line of a byte position, counted from 1.
    pub(super) fn line_at(&self, byte: usize) -> usize {
        self.line_starts
            .partition_point(|start| *start <= byte)
            .max(1)
    }

    /// Returns an error at a line.
    pub(super) fn error(
        &self,
        line: usize,
        key: impl Into<String>,
        problem: DescriptionProblem,
    ) -> DescriptionError {
        DescriptionError {
            file: self.file.to_owned(),
            line,
            key: key.into(),
            problem: Box::new(problem),
        }
    }
}

/// A table whose keys were checked against the known ones.
pub(super) struct Table<'t> {
    source: &'t Source<'t>,
    entries: &'t DeTable<'t>,
    path: String,
    /// Line of the table's header.
    pub(super) line: usize,
}

impl<'t> Table<'t> {
    /// Returns the whole document as a table.
    pub(super) fn top(
        source: &'t Source<'t>,
        entries: &'t DeTable<'t>,
    ) -> Result<Self, DescriptionError> {
        Self {
            source,
            entries,
            path: String::new(),
            line: 1,
        }
        .checked(&keys::TOP)
    }

    /// Refuses the first unknown key, in the order of the text.
    fn checked(self, known: &'static KnownTable) -> Result<Self, DescriptionError> {
        let unknown = self
            .entries
            .keys()
            .filter(|key| !known.keys.contains(&&**key.get_ref()));
        let Some(first) = unknown.min_by_key(|key| key.span().start) else {
            return Ok(self);
        };
        let suggestion = keys::suggest(first.get_ref(), known);
        let problem = DescriptionProblem::UnknownKey {
            table: known.header,
            suggestion,
            known: known.keys,
        };
        let line = self.source.line_at(first.span().start);
        Err(self
            .source
            .error(line, self.path_of(first.get_ref()), problem))
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        }
    }

    /// Returns the value of a key, if it is there.
    pub(super) fn get(&self, key: &str) -> Option<Entry<'t>> {
        let (name, value) = self.entries.get_key_value(key)?;
        let line = self.source.line_at(name.span().start);
        Some(Entry {
            source: self.source,
            value,
            path: self.path_of(key),
            line,
        })
    }

    /// Returns every entry, for tables with free keys.
    pub(super) fn all(&self) -> impl Iterator<Item = (&'t str, Entry<'t>)> {
        self.entries
            .keys()
            .filter_map(|key| Some((&**key.get_ref(), self.get(key.get_ref())?)))
    }

    /// Returns the value of a required key.
    pub(super) fn need(
        &self,
        key: &str,
        wanted: &'static str,
        example: &'static str,
    ) -> Result<Entry<'t>, DescriptionError> {
        let missing = DescriptionProblem::Missing { wanted, example };
        self.get(key)
            .ok_or_else(|| self.source.error(self.line, self.path_of(key), missing))
    }

    /// Reads a key that may be absent.
    pub(super) fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Entry<'t>) -> Result<T, DescriptionError>,
    ) -> Result<Option<T>, DescriptionError> {
        self.get(key).map(|entry| read(&entry)).transpose()
    }
}

/// A value with its place.
pub(super) struct Entry<'t> {
    source: &'t Source<'t>,
    value: &'t Spanned<DeValue<'t>>,
    /// Key path.
    pub(super) path: String,
    /// Line, counted from 1.
    pub(super) line: usize,
}

impl<'t> Entry<'t> {
    pub(super) fn error(&self, problem: DescriptionProblem) -> DescriptionError {
        self.source.error(self.line, self.path.clone(), problem)
    }

    /// Returns the error of a value that contradicts another one.
    pub(super) fn conflict(
        &self,
        reason: impl Into<String>,
        remedy: &'static str,
    ) -> DescriptionError {
        self.error(DescriptionProblem::Conflict {
            reason: reason.into(),
            remedy,
        })
    }

    /// Adds a warning about this value.
    pub(super) fn warn(&self, doubt: Doubt) {
        self.source.warnings.borrow_mut().push(DescriptionWarning {
            file: self.source.file.to_owned(),
            line: self.line,
            key: self.path.clone(),
            doubt,
        });
    }

    pub(super) fn wrong_type(&self, wanted: impl Into<String>) -> DescriptionError {
        let found = match self.value.get_ref() {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) => "an integer",
            DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.error(DescriptionProblem::WrongType {
            found,
            wanted: wanted.into(),
        })
    }

    pub(super) fn out_of_range(
        &self,
        value: f64,
        unit: &'static str,
        limits: &Limits,
    ) -> DescriptionError {
        self.error(DescriptionProblem::OutOfRange {
            value,
            unit,
            allowed: limits.in_words(unit),
            remedy: limits.remedy.to_owned(),
        })
    }

    /// Returns the value as a string, if it is one.
    pub(super) fn as_text(&self) -> Option<&'t str> {
        self.value.get_ref().as_str()
    }

    /// Returns a text that is not empty.
    pub(super) fn text(&self, wanted: &str) -> Result<String, DescriptionError> {
        let text = self
            .as_text()
            .ok_or_else(|| self.wrong_type(wanted))?
            .trim();
        if text.is_empty() {
            return Err(self.error(DescriptionProblem::WrongType {
                found: "an empty string",
                wanted: wanted.to_owned(),
            }));
        }
        Ok(text.to_owned())
    }

    /// Returns a text or a TOML date, as it is written.
    pub(super) fn date(&self) -> Result<String, DescriptionError> {
        match self.value.get_ref() {
            DeValue::Datetime(date) => Ok(date.to_string()),
            _ => self.text("a date such as 2024-05-17, or a text"),
        }
    }

    pub(super) fn boolean(&self) -> Result<bool, DescriptionError> {
        self.value
            .get_ref()
            .as_bool()
            .ok_or_else(|| self.wrong_type("true or false"))
    }

    /// Returns a finite quantity in SI units: a bare number, or a string with a unit.
    pub(super) fn quantity(&self, dimension: Dimension) -> Result<f64, DescriptionError> {
        let (value, text) = match self.value.get_ref() {
            DeValue::String(text) => {
                return parse_quantity(text, dimension).map_err(|error| self.error(error.into()));
            }
            DeValue::Integer(number) => (integer(number).map(|n| n as f64), number.to_string()),
            DeValue::Float(number) => (number.as_str().parse().ok(), number.to_string()),
            _ => {
                let unit = dimension.allowed_units().next().unwrap_or_default();
                let si = match dimension.si_unit() {
                    "" => "1",
                    si => si,
                };
                return Err(self.wrong_type(format!(
                    "{} as a number ({si}) or a text such as \"1.5 {unit}\"",
                    dimension.in_words()
                )));
            }
        };
        let finite = value.filter(|value: &f64| value.is_finite());
        finite.ok_or_else(|| self.error(DescriptionProblem::NotFinite { text }))
    }

    /// Returns a quantity within limits, in SI units.
    pub(super) fn within(
        &self,
        dimension: Dimension,
        limits: &Limits,
    ) -> Result<f64, DescriptionError> {
        let value = self.quantity(dimension)?;
        if limits.contain(value) {
            Ok(value)
        } else {
            Err(self.out_of_range(value, dimension.si_unit(), limits))
        }
    }

    /// Returns a whole number within limits.
    pub(super) fn count(&self, limits: &Limits) -> Result<usize, DescriptionError> {
        let DeValue::Integer(written) = self.value.get_ref() else {
            return Err(self.wrong_type("a whole number"));
        };
        let Some(value) = integer(written) else {
            let text = written.to_string();
            return Err(self.error(DescriptionProblem::NotFinite { text }));
        };
        let in_range = limits.contain(value as f64);
        usize::try_from(value)
            .ok()
            .filter(|_| in_range)
            .ok_or_else(|| self.out_of_range(value as f64, "", limits))
    }

    /// Returns the meaning of one of a few words.
    pub(super) fn choice<T: Copy>(
        &self,
        words: &[(&'static str, T)],
    ) -> Result<T, DescriptionError> {
        let allowed: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let text = self
            .as_text()
            .ok_or_else(|| self.wrong_type(format!("one of \"{}\"", allowed.join("\", \""))))?;
        if let Some((_, meaning)) = words.iter().find(|(word, _)| *word == text) {
            return Ok(*meaning);
        }
        let lower = text.to_lowercase();
        let nearest = keys::nearest(&lower, allowed.iter().copied()).map(str::to_owned);
        Err(self.error(DescriptionProblem::UnknownChoice {
            value: text.to_owned(),
            allowed,
            nearest,
        }))
    }

    /// Returns the items of a list.
    pub(super) fn list(&self, wanted: &str) -> Result<Vec<Entry<'t>>, DescriptionError> {
        let items = self
            .value
            .get_ref()
            .as_array()
            .ok_or_else(|| self.wrong_type(wanted))?;
        Ok((1..)
            .zip(items.iter())
            .map(|(position, value)| Entry {
                source: self.source,
                value,
                path: format!("{}[{position}]", self.path),
                line: self.source.line_at(value.span().start),
            })
            .collect())
    }

    /// Returns true if the value is a list.
    pub(super) fn is_list(&self) -> bool {
        self.value.get_ref().is_array()
    }

    /// Returns a table with known keys.
    pub(super) fn table(&self, known: &'static KnownTable) -> Result<Table<'t>, DescriptionError> {
        self.free_table(&format!(
            "a table {} with the keys {}",
            known.header,
            known.keys.join(", ")
        ))?
        .checked(known)
    }

    /// Returns a table with free keys.
    pub(super) fn free_table(&self, wanted: &str) -> Result<Table<'t>, DescriptionError> {
        let entries = self
            .value
            .get_ref()
            .as_table()
            .ok_or_else(|| self.wrong_type(wanted))?;
        Ok(Table {
            source: self.source,
            entries,
            path: self.path.clone(),
            line: self.line,
        })
    }
}

/// Returns the value of a TOML integer; `None` beyond 64 bits.
fn integer(number: &DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// Limits of a quantity, and the remedy for a value beyond them.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) low: Bound<f64>,
    pub(super) high: Bound<f64>,
    pub(super) remedy: &'static str,
}

impl Limits {
    /// From `low` to `high`, both included.
    pub(super) const fn between(low: f64, high: f64, remedy: &'static str) -> Self {
        Self {
            low: Bound::Included(low),
            high: Bound::Included(high),
            remedy,
        }
    }

    /// Greater than zero, up to `high`.
    pub(super) const fn positive(high: f64, remedy: &'static str) -> Self {
        Self {
            low: Bound::Excluded(0.0),
            high: Bound::Included(high),
            remedy,
        }
    }

    /// Returns true if a value is within the limits.
    pub(super) fn contain(&self, value: f64) -> bool {
        (self.low, self.high).contains(&value)
    }

    /// Returns the range for a message.
    pub(super) fn in_words(&self, unit: &str) -> String {
        if let (Bound::Included(low), Bound::Included(high)) = (self.low, self.high) {
            return format!("{} to {}", number(low), with_unit(high, unit));
        }
        let low = match self.low {
            Bound::Included(low) => format!("from {}", with_unit(low, unit)),
            Bound::Excluded(low) => format!("more than {}", with_unit(low, unit)),
            Bound::Unbounded => String::new(),
        };
        let high = match self.high {
            Bound::Included(high) => format!("up to {}", with_unit(high, unit)),
            Bound::Excluded(high) => format!("less than {}", with_unit(high, unit)),
            Bound::Unbounded => String::new(),
        };
        [low, high]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }
}
