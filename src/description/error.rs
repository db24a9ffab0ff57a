//! What can be wrong with a test description, and what is merely odd.

use std::fmt;
use tapjoint_numerics::quantity::QuantityError;

/// Why a test description cannot be used. Displays as
/// `FILE:LINE: what is wrong, what is allowed, what to do`.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionError {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// Path of the key, such as `beam.length` or `sensor[2].position`; empty where no key is to
    /// blame.
    pub key: String,
    /// What is wrong there.
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

/// The kinds of problems, each with what is needed to mend it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DescriptionProblem {
    /// The text is not TOML.
    #[error("not valid TOML: {message}; {remedy}")]
    Syntax {
        /// What the TOML reader says.
        message: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Nobody knows this key.
    #[error("unknown key; {suggestion}known keys of {table}: {}", .known.join(", "))]
    UnknownKey {
        /// The table it stands in.
        table: &'static str,
        /// What may have been meant.
        suggestion: Suggestion,
        /// The keys this table has.
        known: &'static [&'static str],
    },
    /// A key without which nothing can be done.
    #[error("missing; {wanted} is needed, such as `{example}`")]
    Missing {
        /// What is wanted.
        wanted: &'static str,
        /// How it may look.
        example: &'static str,
    },
    /// Not the kind of value that belongs here.
    #[error("{found} stands here; wanted: {wanted}")]
    WrongType {
        /// What stands there.
        found: &'static str,
        /// What is wanted, with an example.
        wanted: String,
    },
    /// A number with a unit that cannot be understood.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// Infinite or not a number.
    #[error("{text} is not a finite number; write a finite one, or leave the key out")]
    NotFinite {
        /// What stands there.
        text: String,
    },
    /// A value that cannot be.
    #[error("{} is impossible; allowed: {allowed}; {remedy}", with_unit(*value, unit))]
    OutOfRange {
        /// The value, SI.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The allowed range in words.
        allowed: String,
        /// What to do.
        remedy: String,
    },
    /// None of the words that are known here.
    #[error("\"{value}\" is not known here; allowed: {}{}", quoted(allowed), did_you_mean(.nearest))]
    UnknownChoice {
        /// The word.
        value: String,
        /// The known words.
        allowed: Vec<&'static str>,
        /// The one that resembles it.
        nearest: Option<String>,
    },
    /// No sensor of this name.
    #[error("no sensor is called \"{name}\"; sensors: {}{}", sensor_list(known), did_you_mean(.nearest))]
    UnknownSensor {
        /// The name.
        name: String,
        /// The sensors there are.
        known: Vec<String>,
        /// The one that resembles it.
        nearest: Option<String>,
    },
    /// The same name or channel twice.
    #[error("{value} is already taken in line {first_line}; {remedy}")]
    Duplicate {
        /// What is used twice.
        value: String,
        /// Where it is used first.
        first_line: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// Two things that exclude each other.
    #[error("{reason}; {remedy}")]
    Conflict {
        /// Why they exclude each other.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A list of the wrong length.
    #[error("{found} values stand here; allowed: {allowed}; {remedy}")]
    Count {
        /// How many stand there.
        found: usize,
        /// How many are wanted.
        allowed: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A list that does not ascend.
    #[error(
        "value {position} is {} and follows {}; allowed: ascending values, each once; sort them or remove the repeated one",
        number(*value),
        number(*previous)
    )]
    NotAscending {
        /// Where in the list, counted from 1.
        position: usize,
        /// The value there.
        value: f64,
        /// The value before it.
        previous: f64,
    },
    /// A recording that cannot be opened.
    #[error(
        "{path} cannot be read: {cause}; name a file that exists, seen from the folder of this description"
    )]
    UnreadableFile {
        /// Where it was looked for.
        path: String,
        /// What the system says.
        cause: String,
    },
    /// Neither recordings nor frequencies.
    #[error(
        "nothing to analyse: neither [[recording]] nor [measured] is given; add `[[recording]]` with `file = \"taps.wav\"`, or `[measured]` with `frequencies = [17, 118]`"
    )]
    NothingToAnalyse,
}

/// What may have been meant by an unknown key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Suggestion {
    /// A key of the same table that resembles it.
    Nearest(&'static str),
    /// The key exists, in other tables.
    BelongsInto {
        /// The key as it is spelled there.
        key: &'static str,
        /// Those tables.
        tables: Vec<&'static str>,
    },
    /// Nothing resembles it.
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

/// Something odd that does not keep a description from being used.
#[derive(Debug, Clone, PartialEq)]
pub struct DescriptionWarning {
    /// The file, as the caller named it.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// Path of the key.
    pub key: String,
    /// What is odd.
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

/// The kinds of oddities.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// Possible, but far from what tests are made of.
    Implausible {
        /// The value, SI.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// What is usual.
        usual: String,
        /// What may have been meant.
        question: &'static str,
    },
    /// A mass whose place nobody said.
    Unplaced,
    /// Has no effect where it stands.
    NoMeaning {
        /// Why.
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
                "acts where the sensor sits, and `position` is missing: the diagnosis tries places along the beam, \
                 prediction and estimate leave the mass out where no place is said; add `position` (m along the beam) if it is known",
            ),
            Self::NoMeaning { reason } => write!(out, "has no effect; {reason}"),
        }
    }
}

/// A number as people write it: ten significant digits at most, which hides the last-digit
/// noise of a unit conversion, and an exponent only where the zeros would be hard to count.
pub(super) fn number(value: f64) -> String {
    let rounded = format!("{value:.9e}").parse().unwrap_or(value);
    let size = f64::abs(rounded);
    if size == 0.0 || (1e-3..1e6).contains(&size) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// A number and its unit.
pub(super) fn with_unit(value: f64, unit: &str) -> String {
    format!("{} {unit}", number(value)).trim_end().to_owned()
}

/// A message quotes what stands in the file, whatever that is: line breaks and control characters
/// are escaped, and what is longer than anybody reads is cut.
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

fn quoted(words: &[&str]) -> String {
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
    if known.is_empty() {
        return "none is declared; add a [[sensor]] of that name".to_owned();
    }
    known
        .iter()
        .map(|name| format!("\"{name}\""))
        .collect::<Vec<_>>()
        .join(", ")
}
