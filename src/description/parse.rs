//! From text to [`TestDescription`]: the tables in their order, and the settings of the analysis.

use super::free_test::read_free_test;
use super::property::{
    DENSITY, LENGTH, MODULUS, POISSON, THICKNESS, WIDTH, needed, optional, read_free_length,
};
use super::reader::{DescriptionError, Entry, Limits, Source, Table, with_unit};
use super::recordings::{
    check_lengths, check_places, read_hammer, read_measured, read_poles, read_recording,
    read_sensors,
};
use super::structure::{read_effect, read_joint};
use super::tolerance::{BeamTolerance, Described, read_free, read_weighed};
use super::{
    AnalysisDescription, Assembly, BeamDescription, ChannelRef, FitParameter, JointDescription,
    JointModel, ModeFile, RecordingDescription, SensorDescription, SheetDescription, TapSelection,
    TestDescription, Weights, WindowKind, keys,
};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tapjoint_beam::beam::DEFAULT_POISSON;
use tapjoint_numerics::quantity::Dimension;
use tapjoint_signal::modal::ReadBy;
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
        let top = Table::top(&source, document.get_ref())?;
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
        check_bar(&beam_table, &joint_table)?;
        let joint = read_joint(&joint_table, beam_table.get("right"), beam.length)?;
        let hammer_table = top.optional("hammer", |entry| entry.table(&keys::HAMMER))?;
        let hammer = hammer_table.as_ref().map(read_hammer).transpose()?;
        let hammer_channel = hammer_table.and_then(|table| table.get("channel"));
        let sensor_tables = array_of_tables(&top, "sensor", "[[sensor]]", MOST_SENSORS)?;
        let sensors = read_sensors(&sensor_tables, hammer_channel.as_ref(), &beam)?;
        let recording_tables =
            array_of_tables(&top, "recording", "[[recording]]", MOST_RECORDINGS)?;
        let recordings = recording_tables
            .iter()
            .map(|entry| read_recording(entry, &beam, joint.kind, &sensors))
            .collect::<Result<Vec<_>, _>>()?;
        check_lengths(&recording_tables, &recordings)?;
        check_places(&sensor_tables, &sensors, &recordings)?;
        let measured = top.optional("measured", |entry| {
            let measured = read_measured(&entry.table(&keys::MEASURED)?, beam.length)?;
            match recordings.first() {
                None => Ok(measured),
                Some(first) => Err(entry.error(format!(
                    "frequencies come from [measured] or from recordings (line {}), not from both; remove one of them",
                    first.line
                ))),
            }
        })?;
        let analysis = top.optional("analysis", |entry| entry.table(&keys::ANALYSIS))?;
        let analysis = read_analysis(analysis.as_ref(), &joint)?;
        let effects = array_of_tables(&top, "effect", "[[effect]]", MOST_EFFECTS)?
            .iter()
            .map(read_effect)
            .collect::<Result<Vec<_>, _>>()?;
        let sheet = top.optional("sheet", |entry| {
            SheetDescription::read(&entry.table(&keys::SHEET)?)
        })?;
        // A test without a name is called like its file, without the ending.
        let stem = Path::new(file_name).file_stem();
        let stem = stem.map(|stem| stem.to_string_lossy().into_owned());
        let stem = stem.filter(|stem| !stem.trim().is_empty());
        Ok(TestDescription {
            name: name.or(stem).unwrap_or_else(|| "test".to_owned()),
            beam,
            joint,
            hammer,
            sensors,
            recordings,
            measured,
            analysis,
            effects,
            sheet: sheet.unwrap_or_default(),
            warnings: source.warnings.take(),
        })
    }

    /// Returns the description with this file in the place of its recordings: with the settings of the first of them, and
    /// without measured frequencies. `None` where it describes no recording.
    pub fn with_recording(&self, file: PathBuf) -> Option<Self> {
        let mut test = self.clone();
        test.measured = None;
        test.recordings.truncate(1);
        let recording = test.recordings.first_mut()?;
        recording.file = file;
        recording.more_files.clear();
        Some(test)
    }

    /// Asks for something to analyse.
    ///
    /// # Errors
    /// Neither recordings nor measured frequencies.
    pub fn check_has_data(&self, file_name: &str) -> Result<(), DescriptionError> {
        if self.measured.is_some() || !self.recordings.is_empty() {
            return Ok(());
        }
        let problem = "nothing to analyse: neither [[recording]] nor [measured] is given; add `[[recording]]` with \
                       `file = \"taps.wav\"`, or `[measured]` with `frequencies = [17, 118]` or `file = \"modes.unv\"`";
        Err(Source::new(file_name, "").error(1, "", problem))
    }
}

// Every table costs time and memory in all commands. No test of a beam has as many.
const MOST_SENSORS: usize = 128;
const MOST_RECORDINGS: usize = 1000;
const MOST_EFFECTS: usize = 100;

/// Refuses keys of the bar without its joint where the beam is another: two halves, or free already.
fn check_bar(beam: &Table<'_>, joint: &Table<'_>) -> Result<(), DescriptionError> {
    let kind = joint.get("kind");
    let kind = kind.as_ref().and_then(|kind| kind.as_text());
    for key in ["bar_length", "free_frequencies", "free_test"] {
        if let Some(entry) = beam
            .get(key)
            .filter(|_| matches!(kind, Some("lap" | "free")))
        {
            return Err(entry.error(
                "only a cantilever can state this about its bare bar; remove this key, or set `kind = \"cantilever\"`",
            ));
        }
    }
    Ok(())
}

/// Smallest length of a slender beam, in thicknesses.
const STOCKY: f64 = 3.0;

/// Reads `[beam]` without its right half.
fn read_beam(table: &Table<'_>) -> Result<BeamDescription, DescriptionError> {
    let length = needed(table, &LENGTH)?;
    let width = needed(table, &WIDTH)?;
    let thickness = needed(table, &THICKNESS)?;
    let modulus = needed(table, &MODULUS)?;
    let weighed = read_weighed(table)?;
    let bar_length = table.optional("bar_length", read_free_length)?;
    if let Some(entry) = table.get("bar_length")
        && bar_length < Some(length)
    {
        return Err(entry.error(
            "the whole bar is shorter than its free `length`; measure it from end to end, clamped part included",
        ));
    }
    let free_test = read_free_test(table)?;
    let density = match (optional(table, &DENSITY)?, weighed) {
        (Some(density), _) => density,
        // The weight says it: nothing else is known of it.
        (None, Some(weighed)) if table.get("right").is_none() => {
            weighed.mass / (bar_length.unwrap_or(length) * width * thickness)
        }
        (None, _) => needed(table, &DENSITY)?,
    };
    let described = [
        (&LENGTH, length),
        (&WIDTH, width),
        (&THICKNESS, thickness),
        (&MODULUS, modulus),
        (&DENSITY, density),
    ];
    let described = described.map(|(property, value)| Described { property, value });
    let poisson = table.within("poisson", Dimension::Ratio, &POISSON)?;
    let beam = BeamDescription {
        length,
        width,
        thickness,
        modulus,
        density,
        poisson,
        tolerance: BeamTolerance::read(table, described, poisson.unwrap_or(DEFAULT_POISSON))?,
        weighed,
        density_stated: table.get("density").is_some(),
        free: read_free(table)?,
        free_test,
        bar_length,
    };
    let stocky = beam.length < STOCKY * beam.thickness;
    if let Some(entry) = table.get("thickness").filter(|_| stocky) {
        let length = with_unit(beam.length, "m");
        let usual = format!("less than a third of the length, {length}");
        let question = "did you swap thickness and length, or mix units?";
        entry.unusual(beam.thickness, "m", &usual, question);
    }
    Ok(beam)
}

fn array_of_tables<'t>(
    top: &Table<'t>,
    key: &str,
    header: &str,
    most: usize,
) -> Result<Vec<Entry<'t>>, DescriptionError> {
    let wanted = format!("a list of tables, each under its own header {header},");
    let entries = top.optional(key, |entry| entry.list_up_to(most, &wanted))?;
    Ok(entries.unwrap_or_default())
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
    source.error(line, "", format!("not valid TOML: {message}; {remedy}"))
}

/// Words of `window` in `[analysis]`.
pub const WINDOWS: [(&str, WindowKind); 3] = [
    ("rectangular", WindowKind::Rectangular),
    ("hann", WindowKind::Hann),
    ("exponential", WindowKind::Exponential),
];
/// Words of `reading` in `[analysis]`.
pub const READINGS: [(&str, ReadBy); 3] = [
    ("fit", ReadBy::Fit),
    ("interpolated", ReadBy::Interpolated),
    ("line", ReadBy::Line),
];
/// Words of `select` in `[analysis]`.
pub const SELECTIONS: [(&str, TapSelection); 2] = [
    ("all", TapSelection::All),
    ("consistent", TapSelection::Consistent),
];
const WEIGHTS: [(&str, Weights); 2] = [
    ("measured", Weights::Measured),
    ("relative", Weights::Relative),
];
const PARAMETERS: [(&str, FitParameter); 5] = [
    ("kt", FitParameter::Kt),
    ("kr", FitParameter::Kr),
    ("ktr", FitParameter::Ktr),
    ("modulus", FitParameter::Modulus),
    ("density", FitParameter::Density),
];
const FIT_MODES: Limits = Limits::between(1.0, 1000.0, "leave it out to use all modes");

/// Reads `[analysis]`; an absent table is all defaults.
fn read_analysis(
    table: Option<&Table<'_>>,
    joint: &JointDescription,
) -> Result<AnalysisDescription, DescriptionError> {
    let mut analysis = AnalysisDescription {
        window: None,
        reading: ReadBy::default(),
        select: TapSelection::default(),
        fit_modes: None,
        poles: Vec::new(),
        weights: None,
        sensor_mass: true,
        fit: None,
    };
    if let Some(table) = table {
        analysis.window = table.choice("window", &WINDOWS)?;
        analysis.reading = table.choice("reading", &READINGS)?.unwrap_or_default();
        analysis.select = table.choice("select", &SELECTIONS)?.unwrap_or_default();
        analysis.fit_modes = table.optional("fit_modes", |entry| entry.count(&FIT_MODES))?;
        let poles = table.optional("poles", read_poles)?;
        analysis.poles = poles.unwrap_or_default();
        analysis.weights = table.choice("weights", &WEIGHTS)?;
        let sensor_mass = table.optional("sensor_mass", Entry::boolean)?;
        analysis.sensor_mass = sensor_mass.unwrap_or(true);
        analysis.fit = table.optional("fit", |entry| read_fit(entry, joint))?;
    }
    Ok(analysis)
}

fn read_fit(
    entry: &Entry<'_>,
    joint: &JointDescription,
) -> Result<Vec<FitParameter>, DescriptionError> {
    let items = entry.list("a list such as [\"kr\", \"modulus\"]")?;
    if items.is_empty() {
        let remedy = "leave `fit` out for the joint's stiffnesses";
        return Err(entry.wrong_count(0, "at least 1", remedy));
    }
    let mut fit: Vec<FitParameter> = Vec::new();
    for item in &items {
        let parameter = item.choice(&PARAMETERS)?;
        let stated = match parameter {
            FitParameter::Kt => Some(joint.kt),
            FitParameter::Kr => Some(joint.kr),
            FitParameter::Ktr => Some(joint.ktr),
            FitParameter::Modulus | FitParameter::Density => None,
        };
        let is_ktr = parameter == FitParameter::Ktr;
        let objection = match stated {
            Some(_) if joint.kind == Assembly::Free => {
                Some("a free beam has no joint stiffness; fit \"modulus\" or \"density\"")
            }
            Some(_) if is_ktr && joint.model == JointModel::TwoParameter => Some(
                "the two-parameter model has no coupling stiffness; write `model = \"3p\"` in [joint], or remove it here",
            ),
            Some(Some(_)) => Some(
                "this stiffness is stated as known in [joint], and known ones are compared, not fitted; remove it here \
                 or there",
            ),
            Some(None) | None => None,
        };
        if let Some(objection) = objection {
            return Err(item.error(objection));
        }
        if fit.contains(&parameter) {
            let word = format!("\"{}\"", item.as_text().unwrap_or_default());
            return Err(item.taken(&word, entry.line, "list each parameter once"));
        }
        fit.push(parameter);
    }
    Ok(fit)
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
    /// Returns the position of a sensor (m) in the reference configuration, that of the first recording with the beam's own
    /// length.
    pub fn place_of(&self, sensor: &SensorDescription) -> Option<f64> {
        let first = self.reference_recording();
        first.map_or(sensor.position, |recording| recording.place_of(sensor))
    }
}

impl RecordingDescription {
    /// All files, in their order.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        std::iter::once(&self.file).chain(&self.more_files)
    }

    /// Name for tables: the file, or "1.wav + 2 more".
    pub fn name(&self) -> String {
        if let Some(name) = &self.shown_as {
            return name.clone();
        }
        let first = self.file.display();
        match self.more_files.len() {
            0 => first.to_string(),
            more => format!("{first} + {more} more"),
        }
    }

    /// Returns the position of a sensor (m) in this recording.
    pub fn place_of(&self, sensor: &SensorDescription) -> Option<f64> {
        self.at.get(&sensor.name).copied().or(sensor.position)
    }

    /// Returns the error of a recording that the caller cannot open. It points to the line of the
    /// description that names the file.
    pub fn file_error(&self, description: &str, path: &Path, cause: &str) -> DescriptionError {
        let problem = format!(
            "{} cannot be read: {cause}; name a file that exists, seen from the folder of this description",
            path.display()
        );
        Source::new(description, "").error(self.line, "recording.file", problem)
    }
}

impl ModeFile {
    /// Returns the error of a key of `[measured]` that does not fit the file, or of a file that cannot be opened. It
    /// points to the line of the key, or to that which names the file.
    pub fn error(&self, description: &str, key: &str, problem: String) -> DescriptionError {
        let line = self.key_lines.get(key).copied().unwrap_or(self.line);
        Source::new(description, "").error(line, format!("measured.{key}"), problem)
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
