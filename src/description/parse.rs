//! From text to [`TestDescription`]: the tables in their order.

use super::analysis::read_analysis;
use super::error::{DescriptionError, DescriptionProblem};
use super::reader::{Entry, Source, Table};
use super::recordings::{Surroundings, read_measured, read_recording};
use super::sensors::{check_places, read_hammer, read_sensors};
use super::structure::{read_beam, read_effect, read_joint};
use super::{ChannelRef, RecordingDescription, SensorDescription, TestDescription, keys};
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use toml::de::DeTable;

impl TestDescription {
    /// Reads a test description. Messages call the file `file_name`; no file is opened.
    ///
    /// A description without recordings and frequencies is valid, because a prediction needs
    /// neither; [`TestDescription::check_has_data`] asks for them.
    ///
    /// # Errors
    /// [`DescriptionError`] with line, key, allowed range and remedy: TOML that cannot be read,
    /// unknown or missing keys, values of the wrong kind or unit, impossible values, and
    /// contradictions between keys.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, DescriptionError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let source = Source::new(file_name, text);
        let document = DeTable::parse(text).map_err(|error| syntax_error(&source, text, &error))?;
        let mut test = read_document(&Table::top(&source, document.get_ref())?, file_name)?;
        test.warnings = source.into_warnings();
        Ok(test)
    }

    /// Asks for something to analyse.
    ///
    /// # Errors
    /// [`DescriptionProblem::NothingToAnalyse`] when there are neither recordings nor measured
    /// frequencies.
    pub fn check_has_data(&self, file_name: &str) -> Result<(), DescriptionError> {
        if self.measured.is_some() || !self.recordings.is_empty() {
            return Ok(());
        }
        Err(Source::new(file_name, "").error(1, "", DescriptionProblem::NothingToAnalyse))
    }
}

fn read_document(top: &Table<'_>, file_name: &str) -> Result<TestDescription, DescriptionError> {
    let name = top.optional("name", |entry| {
        entry.text("a name such as \"Cantilever, one-bolt clamp\"")
    })?;
    let example = "[beam]` with `length`, `width`, `thickness`, `modulus` and `density";
    let beam_table = top
        .need("beam", "a description of the beam", example)?
        .table(&keys::BEAM)?;
    let beam = read_beam(&beam_table)?;
    let example = "[joint]` with `kind = \"cantilever\"";
    let joint_table = top
        .need("joint", "the kind of joint", example)?
        .table(&keys::JOINT)?;
    let right = beam_table.get("right");
    let joint = read_joint(&joint_table, right.as_ref(), beam.length)?;
    let hammer_table = top.optional("hammer", |entry| entry.table(&keys::HAMMER))?;
    let hammer = hammer_table.as_ref().map(read_hammer).transpose()?;
    let hammer_channel = hammer_table.and_then(|table| table.get("channel"));
    let sensor_tables = array_of_tables(top, "sensor", "[[sensor]]")?;
    let sensors = read_sensors(&sensor_tables, hammer_channel.as_ref(), &beam)?;
    let surroundings = Surroundings {
        beam: &beam,
        sensors: &sensors,
    };
    let recordings = array_of_tables(top, "recording", "[[recording]]")?
        .iter()
        .map(|entry| read_recording(entry, &surroundings))
        .collect::<Result<Vec<_>, _>>()?;
    check_places(&sensor_tables, &sensors, &recordings)?;
    let measured = top.optional("measured", |entry| {
        let measured = read_measured(&entry.table(&keys::MEASURED)?)?;
        match recordings.first() {
            None => Ok(measured),
            Some(first) => Err(entry.conflict(
                format!(
                    "frequencies come from [measured] or from recordings (line {}), not from both",
                    first.line
                ),
                "remove one of them",
            )),
        }
    })?;
    let analysis = top.optional("analysis", |entry| entry.table(&keys::ANALYSIS))?;
    let analysis = read_analysis(analysis.as_ref(), &joint)?;
    let effects = array_of_tables(top, "effect", "[[effect]]")?
        .iter()
        .map(read_effect)
        .collect::<Result<Vec<_>, _>>()?;
    Ok(TestDescription {
        name: name.unwrap_or_else(|| name_from_file(file_name)),
        beam,
        joint,
        hammer,
        sensors,
        recordings,
        measured,
        analysis,
        effects,
        warnings: Vec::new(),
    })
}

fn array_of_tables<'t>(
    top: &Table<'t>,
    key: &str,
    header: &str,
) -> Result<Vec<Entry<'t>>, DescriptionError> {
    let wanted = format!("a list of tables, each under its own header {header},");
    Ok(top
        .optional(key, |entry| entry.list(&wanted))?
        .unwrap_or_default())
}

/// Returns the file's name without its ending, for a test without a name.
fn name_from_file(file_name: &str) -> String {
    let stem = Path::new(file_name)
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| !stem.trim().is_empty())
        .unwrap_or_else(|| "test".to_owned())
}

fn syntax_error(source: &Source<'_>, text: &str, error: &toml::de::Error) -> DescriptionError {
    // An error at the end of the text belongs to the last line that is not empty.
    let last = text.trim_end().len();
    let line = source.line_at(error.span().map_or(0, |span| span.start).min(last));
    let message = error.message().replace('\n', " ");
    let remedy = if message.contains("duplicate key") {
        "each key and each [table] may stand only once (but [[sensor]] and [[recording]], in double brackets); remove one or merge the two"
    } else if message.contains("string values must be quoted") {
        "put texts and numbers with a unit into quotes: \"423 mm\""
    } else {
        "expected are lines such as `key = value` and headers such as `[beam]` or `[[sensor]]`"
    };
    source.error(line, "", DescriptionProblem::Syntax { message, remedy })
}

impl fmt::Display for ChannelRef {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(out, "{number}"),
            Self::Name(name) => write!(out, "\"{name}\""),
        }
    }
}

impl TestDescription {
    /// Returns the position of a sensor (m) in the reference configuration, that of the first recording.
    pub fn place_of(&self, sensor: &SensorDescription) -> Option<f64> {
        let first = self.recordings.first();
        first.map_or(sensor.position, |recording| recording.place_of(sensor))
    }
}

impl RecordingDescription {
    /// Returns the position of a sensor (m) in this recording.
    pub fn place_of(&self, sensor: &SensorDescription) -> Option<f64> {
        self.at.get(&sensor.name).copied().or(sensor.position)
    }

    /// Returns the error of a recording that the caller cannot open. It points to the line of the
    /// description that names the file.
    pub fn file_error(&self, description: &str, path: &Path, cause: &str) -> DescriptionError {
        let (path, cause) = (path.display().to_string(), cause.to_owned());
        let problem = DescriptionProblem::UnreadableFile { path, cause };
        Source::new(description, "").error(self.line, "recording.file", problem)
    }
}

/// A text that names no channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ChannelRefError {
    /// Empty.
    #[error("an empty channel; give its number, counted from 1, or its column's name")]
    Empty,
    /// Zero.
    #[error("channels count from 1, not from 0")]
    Zero,
}

impl FromStr for ChannelRef {
    type Err = ChannelRefError;

    /// A whole number is a channel's number, anything else a column's name.
    fn from_str(text: &str) -> Result<Self, ChannelRefError> {
        match (text.trim(), text.trim().parse()) {
            ("", _) => Err(ChannelRefError::Empty),
            (_, Ok(0)) => Err(ChannelRefError::Zero),
            (_, Ok(number)) => Ok(Self::Number(number)),
            (name, Err(_)) => Ok(Self::Name(name.to_owned())),
        }
    }
}
