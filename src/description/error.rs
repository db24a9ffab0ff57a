//! Errors and warnings of a test description.

use std::fmt;
use tapjoint_numerics::quantity::QuantityError;

/// An error in a test description. Displays as `FILE:LINE: problem, allowed values, remedy`.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionError {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// Path of the key, such as `beam.length` or `sensor[2].position`; empty without a key.
    pub key: String,
    /// The problem there.
    pub problem: Box<DescriptionProblem>,
}

impl fmt::Display for DescriptionError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let key = if self.key.is_empty() {
            String::new()
        } else {
            format!("`{}`: ", self.key)
        };
        let text = format!("{}:{}: {key}{}", self.file, self.line, self.problem);
        out.write_str(&on_one_line(&text))
    }
}

impl std::error::Error for DescriptionError {}

/// Kinds of problems, each with the data of its message.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DescriptionProblem {
    /// The text is not TOML.
    #[error("not valid TOML: {message}; {remedy}")]
    Syntax {
        /// Message of the TOML reader.
        message: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// An unknown key.
    #[error("unknown key; {suggestion}known keys of {table}: {}", .known.join(", "))]
    UnknownKey {
        /// The key's table.
        table: &'static str,
        /// Suggested key.
        suggestion: Suggestion,
        /// All keys of this table.
        known: &'static [&'static str],
    },
    /// A missing key.
    #[error("missing; {wanted} is needed, such as `{example}`")]
    Missing {
        /// Wanted value.
        wanted: &'static str,
        /// Example.
        example: &'static str,
    },
    /// A value of the wrong kind.
    #[error("{found} stands here; wanted: {wanted}")]
    WrongType {
        /// Kind of the value.
        found: &'static str,
        /// Wanted kind, with an example.
        wanted: String,
    },
    /// A number with a unit that cannot be understood.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// Infinite or not a number.
    #[error("{text} is not a finite number; write a finite one, or leave the key out")]
    NotFinite {
        /// The value.
        text: String,
    },
    /// A value outside its limits.
    #[error("{} is impossible; allowed: {allowed}; {remedy}", with_unit(*value, unit))]
    OutOfRange {
        /// The value, SI.
        value: f64,
        /// Unit of the value.
        unit: &'static str,
        /// Allowed range in words.
        allowed: String,
        /// Remedy.
        remedy: String,
    },
    /// An unknown word.
    #[error("\"{value}\" is not known here; allowed: {}{}", quoted(allowed), did_you_mean(.nearest))]
    UnknownChoice {
        /// The word.
        value: String,
        /// The known words.
        allowed: Vec<&'static str>,
        /// The most similar one.
        nearest: Option<String>,
    },
    /// No sensor of this name.
    #[error("no sensor is called \"{name}\"; sensors: {}{}", sensor_list(known), did_you_mean(.nearest))]
    UnknownSensor {
        /// The name.
        name: String,
        /// The sensors there are.
        known: Vec<String>,
        /// The most similar one.
        nearest: Option<String>,
    },
    /// A name or channel that is used twice.
    #[error("{value} is already taken in line {first_line}; {remedy}")]
    Duplicate {
        /// The repeated value.
        value: String,
        /// Line of its first use.
        first_line: usize,
        /// Remedy.
        remedy: &'static str,
    },
    /// Two values that exclude each other.
    #[error("{reason}; {remedy}")]
    Conflict {
        /// Reason.
        reason: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// A list of the wrong length.
    #[error("{found} values stand here; allowed: {allowed}; {remedy}")]
    Count {
        /// Number of values.
        found: usize,
        /// Wanted number.
        allowed: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// A list that does not ascend.
    #[error(
        "value {position} is {} and follows {}; allowed: ascending values, each once; sort them or remove the repeated one",
        number(*value),
        number(*previous)
    )]
    NotAscending {
        /// Place in the list, counted from 1.
        position: usize,
        /// Value at this place.
        value: f64,
        /// Value before it.
        previous: f64,
    },
    /// A recording that cannot be opened.
    #[error(
        "{path} cannot be read: {cause}; name a file that exists, seen from the folder of this description"
    )]
    UnreadableFile {
        /// Path of the file.
        path: String,
        /// The system's reason.
        cause: String,
    },
    /// Neither recordings nor frequencies.
    #[error(
        "nothing to analyse: neither [[recording]] nor [measured] is given; add `[[recording]]` with `file = \"taps.wav\"`, or `[measured]` with `frequencies = [17, 118]`"
    )]
    NothingToAnalyse,
}

/// A suggestion for an unknown key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Suggestion {
    /// A similar key of the same table.
    Nearest(&'static str),
    /// The key exists in other tables.
    BelongsInto {
        /// The key as these tables spell it.
        key: &'static str,
        /// Those tables.
        tables: Vec<&'static str>,
    },
    /// No similar key.
    Nothing,
}

impl fmt::Display for Suggestion {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nearest(key) => write!(out, "did you mean `{key}`? "),
            Self::BelongsInto { key, tables } => {
                write!(out, "`{key}` belongs into {}; ", tables.join(" or "))
            }
            Self::Nothing => Ok(()),
        }
    }
}

/// A doubt about a description that can still be used.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionWarning {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// Path of the key.
    pub key: String,
    /// The doubt.
    pub doubt: Doubt,
}

impl fmt::Display for DescriptionWarning {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!(
            "{}:{}: `{}`: {}",
            self.file, self.line, self.key, self.doubt
        );
        out.write_str(&on_one_line(&text))
    }
}

/// Kinds of doubts.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// Possible, but unusual.
    Implausible {
        /// The value, SI.
        value: f64,
        /// Unit of the value.
        unit: &'static str,
        /// Usual range.
        usual: String,
        /// Question to the user.
        question: &'static str,
    },
    /// A mass without a position.
    Unplaced,
    /// A value without effect.
    NoMeaning {
        /// Reason.
        reason: &'static str,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Implausible {
                value,
                unit,
                usual,
                question,
            } => {
                write!(
                    out,
                    "{} is unusual; usual: {usual}; {question}",
                    with_unit(*value, unit)
                )
            }
            Self::Unplaced => out.write_str(
                "has no `position`: the diagnosis tries places along the beam, prediction and estimate leave the mass out; \
                 add `position` (m along the beam) if it is known",
            ),
            Self::NoMeaning { reason } => write!(out, "has no effect; {reason}"),
        }
    }
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

/// Returns a message on one line. It may quote any text of the file, so line breaks and control characters
/// are escaped, and a very long message is cut.
fn on_one_line(text: &str) -> String {
    const LONGEST: usize = 1000;
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
    line
}

fn quoted(words: &[impl fmt::Display]) -> String {
    words
        .iter()
        .map(|word| format!("\"{word}\""))
        .collect::<Vec<_>>()
        .join(", ")
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map_or_else(String::new, |word| format!("; did you mean \"{word}\"?"))
}

fn sensor_list(known: &[String]) -> String {
    match known {
        [] => "none is declared; add a [[sensor]] of that name".to_owned(),
        known => quoted(known),
    }
}
