//! Typed access to the tables of a TOML text. Every value knows its line and its key path, so that an error can state
//! them.

use super::keys::{self, KnownTable};
use std::cell::RefCell;
use std::fmt;
use tapjoint_numerics::quantity::{Dimension, parse_quantity};
use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

/// A problem of a test description, or a doubt about it. Displays as
/// `FILE:LINE: key: problem, allowed values, remedy`.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionError {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// Path of the key, such as `beam.length` or `sensor[2].position`; empty without a key.
    pub key: String,
    /// The problem there, what is allowed, and the remedy.
    pub problem: String,
}

impl fmt::Display for DescriptionError {
    /// Writes one line. It may quote any text of the file, so line breaks and control characters are escaped, and a
    /// very long message is cut.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        const LONGEST: usize = 1000;
        let mut text = format!("{}:{}: ", self.file, self.line);
        if !self.key.is_empty() {
            text += &format!("`{}`: ", self.key);
        }
        text += &self.problem;
        let mut line = String::with_capacity(text.len().min(LONGEST));
        for character in text.chars().take(LONGEST) {
            if character.is_control() {
                line.extend(character.escape_default());
            } else {
                line.push(character);
            }
        }
        if text.chars().nth(LONGEST).is_some() {
            line.push_str(" ...");
        }
        out.write_str(&line)
    }
}

impl std::error::Error for DescriptionError {}

/// The file's name, the positions of its lines, and the warnings so far.
pub(super) struct Source<'t> {
    file: &'t str,
    line_starts: Vec<usize>,
    /// Doubts, in the order of reading.
    pub(super) warnings: RefCell<Vec<DescriptionError>>,
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
        problem: impl Into<String>,
    ) -> DescriptionError {
        DescriptionError {
            file: self.file.to_owned(),
            line,
            key: key.into(),
            problem: problem.into(),
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
    fn checked(self, known: &KnownTable) -> Result<Self, DescriptionError> {
        let unknown = self.entries.keys().filter(|key| !known.has(key.get_ref()));
        let Some(first) = unknown.min_by_key(|key| key.span().start) else {
            return Ok(self);
        };
        let problem = format!(
            "unknown key; {}known keys of {}: {}",
            keys::suggest(first.get_ref(), known),
            known.header,
            known.listed()
        );
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
        wanted: &str,
        example: &str,
    ) -> Result<Entry<'t>, DescriptionError> {
        self.get(key).ok_or_else(|| {
            let missing = format!("missing; {wanted} is needed, such as `{example}`");
            self.source.error(self.line, self.path_of(key), missing)
        })
    }

    /// Reads a key that may be absent.
    pub(super) fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Entry<'t>) -> Result<T, DescriptionError>,
    ) -> Result<Option<T>, DescriptionError> {
        self.get(key).map(|entry| read(&entry)).transpose()
    }

    /// Reads a quantity within limits that may be absent, in SI units.
    pub(super) fn within(
        &self,
        key: &str,
        dimension: Dimension,
        limits: &Limits,
    ) -> Result<Option<f64>, DescriptionError> {
        self.optional(key, |entry| entry.within(dimension, limits))
    }

    /// Reads one of a few words that may be absent.
    pub(super) fn choice<T: Copy>(
        &self,
        key: &str,
        words: &[(&'static str, T)],
    ) -> Result<Option<T>, DescriptionError> {
        self.optional(key, |entry| entry.choice(words))
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
    pub(super) fn error(&self, problem: impl Into<String>) -> DescriptionError {
        self.source.error(self.line, self.path.clone(), problem)
    }

    /// Adds a warning about this value.
    pub(super) fn warn(&self, doubt: impl Into<String>) {
        self.source.warnings.borrow_mut().push(self.error(doubt));
    }

    /// Adds the warning about a possible, but unusual value (SI), with a question to the user.
    pub(super) fn unusual(&self, value: f64, unit: &str, usual: &str, question: &str) {
        let value = with_unit(value, unit);
        self.warn(format!("{value} is unusual; usual: {usual}; {question}"));
    }

    pub(super) fn wrong_type(&self, wanted: &str) -> DescriptionError {
        let found = match self.value.get_ref() {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) => "an integer",
            DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.error(format!("{found} stands here; wanted: {wanted}"))
    }

    pub(super) fn out_of_range(&self, value: f64, unit: &str, limits: &Limits) -> DescriptionError {
        self.impossible(value, unit, &limits.in_words(unit), limits.remedy)
    }

    /// Returns the error of a value (SI) that cannot be.
    pub(super) fn impossible(
        &self,
        value: f64,
        unit: &str,
        allowed: &str,
        remedy: &str,
    ) -> DescriptionError {
        // A share is told as it was written: "200 %" and not 2.
        let written = self.as_text().filter(|text| text.trim_end().ends_with('%'));
        let value = written.map_or_else(|| with_unit(value, unit), |text| text.trim().to_owned());
        self.error(format!(
            "{value} is impossible; allowed: {allowed}; {remedy}"
        ))
    }

    /// Returns the error of a list of a wrong length.
    pub(super) fn wrong_count(
        &self,
        found: usize,
        allowed: &str,
        remedy: &str,
    ) -> DescriptionError {
        self.error(format!(
            "{found} value{} here; allowed: {allowed}; {remedy}",
            if found == 1 { " stands" } else { "s stand" }
        ))
    }

    /// Returns the error of a value that another one has taken.
    pub(super) fn taken(&self, value: &str, first_line: usize, remedy: &str) -> DescriptionError {
        self.error(format!(
            "{value} is already taken in line {first_line}; {remedy}"
        ))
    }

    fn not_finite(&self, text: impl fmt::Display) -> DescriptionError {
        self.error(format!(
            "{text} is not a finite number; write a finite one, or leave the key out"
        ))
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
            return Err(self.error(format!("an empty string stands here; wanted: {wanted}")));
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
                let read = parse_quantity(text, dimension);
                return read.map_err(|error| self.error(error.to_string()));
            }
            DeValue::Integer(number) => (integer(number).map(|n| n as f64), number.to_string()),
            DeValue::Float(number) => (number.as_str().parse().ok(), number.to_string()),
            _ => {
                let unit = dimension.allowed_units().next().unwrap_or_default();
                let si = match dimension.si_unit() {
                    "" => "1",
                    si => si,
                };
                return Err(self.wrong_type(&format!(
                    "{} as a number ({si}) or a text such as \"1.5 {unit}\"",
                    dimension.in_words()
                )));
            }
        };
        let finite = value.filter(|value: &f64| value.is_finite());
        finite.ok_or_else(|| self.not_finite(text))
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
        let value = integer(written).ok_or_else(|| self.not_finite(written))?;
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
        let quoted = quoted(&allowed);
        let text = self
            .as_text()
            .ok_or_else(|| self.wrong_type(&format!("one of {quoted}")))?;
        if let Some((_, meaning)) = words.iter().find(|(word, _)| *word == text) {
            return Ok(*meaning);
        }
        let meant = did_you_mean(&text.to_lowercase(), &allowed);
        Err(self.error(format!(
            "\"{text}\" is not known here; allowed: {quoted}{meant}"
        )))
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

    /// Returns the items of a list of at most so many.
    pub(super) fn list_up_to(
        &self,
        most: usize,
        wanted: &str,
    ) -> Result<Vec<Entry<'t>>, DescriptionError> {
        let items = self.list(wanted)?;
        match items.get(most) {
            None => Ok(items),
            Some(first) => Err(first.wrong_count(
                items.len(),
                &format!("up to {most}"),
                "divide the test into several descriptions",
            )),
        }
    }

    /// Returns true if the value is a list.
    pub(super) fn is_list(&self) -> bool {
        self.value.get_ref().is_array()
    }

    /// Returns a table with known keys.
    pub(super) fn table(&self, known: &KnownTable) -> Result<Table<'t>, DescriptionError> {
        self.free_table(&format!(
            "a table {} with the keys {}",
            known.header,
            known.listed()
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

/// Returns the words in quotation marks.
pub(super) fn quoted(words: &[&str]) -> String {
    format!("\"{}\"", words.join("\", \""))
}

/// Returns the question for the known word that is most similar to `word`; nothing if none is.
pub(super) fn did_you_mean(word: &str, known: &[&str]) -> String {
    let nearest = keys::nearest(word, known.iter().copied());
    nearest.map_or_else(String::new, |word| format!("; did you mean \"{word}\"?"))
}

/// Returns a number with at most ten significant digits, which hides the rounding of unit conversions.
/// Very small and very large numbers have an exponent.
pub(super) fn number(value: f64) -> String {
    let rounded = format!("{value:.9e}").parse().unwrap_or(value);
    let size = f64::abs(rounded);
    if size == 0.0 || (1e-3..1e6).contains(&size) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Returns a number with its unit.
pub(super) fn with_unit(value: f64, unit: &str) -> String {
    format!("{} {unit}", number(value)).trim_end().to_owned()
}

/// Limits of a quantity, and the remedy for a value beyond them.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    low: f64,
    pub(super) high: f64,
    /// True for the lower or the upper limit where it is not itself allowed.
    open: [bool; 2],
    remedy: &'static str,
}

impl Limits {
    const fn new(low: f64, high: f64, open: [bool; 2], remedy: &'static str) -> Self {
        Self {
            low,
            high,
            open,
            remedy,
        }
    }

    /// From `low` to `high`, both included.
    pub(super) const fn between(low: f64, high: f64, remedy: &'static str) -> Self {
        Self::new(low, high, [false, false], remedy)
    }

    /// More than `low`, up to `high`.
    pub(super) const fn above(low: f64, high: f64, remedy: &'static str) -> Self {
        Self::new(low, high, [true, false], remedy)
    }

    /// More than `low`, less than `high`.
    pub(super) const fn inside(low: f64, high: f64, remedy: &'static str) -> Self {
        Self::new(low, high, [true, true], remedy)
    }

    /// From `low`, less than `high`.
    pub(super) const fn below(low: f64, high: f64, remedy: &'static str) -> Self {
        Self::new(low, high, [false, true], remedy)
    }

    pub(super) fn contain(&self, value: f64) -> bool {
        let [low_open, high_open] = self.open;
        let above = value > self.low || value == self.low && !low_open;
        above && (value < self.high || value == self.high && !high_open)
    }

    /// Returns the range for a message.
    fn in_words(&self, unit: &str) -> String {
        let high = with_unit(self.high, unit);
        if self.open == [false, false] {
            return format!("{} to {high}", number(self.low));
        }
        let low = with_unit(self.low, unit);
        let from = if self.open[0] { "more than" } else { "from" };
        let to = if self.open[1] { "less than" } else { "up to" };
        format!("{from} {low}, {to} {high}")
    }
}
