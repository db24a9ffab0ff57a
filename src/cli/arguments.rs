//! Arguments that several commands share, and the parsers of their values.

use crate::compare::REPEATABILITY_LIMITS;
use crate::description::{
    ASSEMBLIES, Assembly, ChannelRef, FORMS, OVERLOADS, READINGS, ReadBy, ResponseForm, SELECTIONS,
    SENSOR_KINDS, SensorKind, TapSelection, WINDOWS, WindowKind,
};
use crate::pipeline::{BareSettings, EstimateMethod, IdentifySettings, MeasureSettings};
use crate::quantity::{Dimension, parse_quantity};
use crate::recording::{
    ReadSettings, Recording, RecordingError, TIME_UNITS, ValueColumns, VariableRole, Variables,
};
use crate::spectral::{FrfEstimator, LEAST_BLOCK, MOST_BLOCK};
use crate::structure::{JointStiffness, MEASURED_LIMIT};
use crate::taps::{TapSettings, TapsByHand};
use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::OnceLock;

/// Choice of how much is printed.
#[derive(Debug, Args)]
pub(super) struct FullAnswer {
    /// Print all tables below the answer
    #[arg(long)]
    pub(super) full: bool,
}

/// Most threads: no machine has more processors, and each thread takes memory.
const MOST_THREADS: u64 = 1024;

/// Arguments of every command.
#[derive(Debug, Args)]
#[command(next_help_heading = "Common options")]
pub(super) struct CommonArguments {
    /// Write the results as JSON to FILE. `-` is standard output, and nothing else is then printed
    #[arg(long, global = true, value_name = "FILE")]
    pub(super) json: Option<JsonDestination>,
    /// Overwrite any existing file except the inputs. By default only files that tapjoint made are
    /// overwritten
    #[arg(long, global = true)]
    pub(super) force: bool,
    /// Print only errors (and the seal of a blind check)
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
    /// Seed of the random numbers. The same seed gives the same results
    #[arg(long, global = true, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// Number of threads; default: one for each processor
    #[arg(long, global = true, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=MOST_THREADS))]
    pub(super) threads: Option<usize>,
    /// Print on standard error what each stage used and how long it took. Give it twice for
    /// every tap and peak
    #[arg(long, short, global = true, action = clap::ArgAction::Count)]
    pub(super) verbose: u8,
}

impl CommonArguments {
    /// Returns the same without the destination of JSON, for words before the results. They are left out where JSON goes to
    /// standard output.
    pub(super) fn for_words(&self) -> Self {
        Self {
            json: None,
            quiet: self.quiet || self.json == Some(JsonDestination::StandardOutput),
            ..*self
        }
    }

    /// Returns true if times are to be printed.
    pub(super) fn tells_more(&self) -> bool {
        self.verbose > 0 && !self.quiet
    }

    /// Sets the number of threads for the whole program.
    ///
    /// # Errors
    /// The system refuses to start so many, or the environment asks for too many.
    pub(super) fn set_threads(&self) -> anyhow::Result<()> {
        let name = "RAYON_NUM_THREADS";
        let wanted = std::env::var(name).ok();
        let wanted = wanted.filter(|_| self.threads.is_none());
        if let Some(text) = wanted
            && text
                .parse()
                .is_ok_and(|count: f64| count > MOST_THREADS as f64)
        {
            bail!("{name}={text}: give 0 to {MOST_THREADS}, 0 for one to each processor");
        }
        if let Some(threads) = self.threads {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build_global()
                .with_context(|| {
                    format!("--threads {threads}: the system cannot start so many; give fewer")
                })?;
        }
        Ok(())
    }
}

/// Destination of `--json`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum JsonDestination {
    /// `-`
    StandardOutput,
    /// A file.
    File(PathBuf),
}

impl FromStr for JsonDestination {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("an empty name; give a file, or - for standard output".to_owned()),
            "-" => Ok(Self::StandardOutput),
            file => Ok(Self::File(file.into())),
        }
    }
}

/// Options for reading a bare recording.
#[derive(Debug, Args)]
pub(super) struct RecordingArguments {
    /// Channel of the hammer: its number, counted from 1, or the name of a CSV column; default: none,
    /// all channels are responses
    #[arg(long, value_name = "CH")]
    pub(super) hammer: Option<ChannelRef>,
    /// Sample rate of a CSV file without a time column, such as 5120 or "51.2 kHz" (Hz)
    #[arg(long, value_name = "HZ", value_parser = sample_rate)]
    pub(super) sample_rate: Option<f64>,
    /// Unit of a time column without a unit in its heading; default: s
    #[arg(long, value_name = "UNIT", value_parser = time_unit())]
    pub(super) time_unit: Option<f64>,
    /// Columns of a text file of functions; default: by headings and numbers
    #[arg(long, value_name = "COLUMNS", value_parser = value_columns())]
    pub(super) values: Option<ValueColumns>,
    /// Variable of a MATLAB file, such as frf=yspec or rate=fs; repeat it. Roles: frf, spectrum, coherence,
    /// frequency, samples, time, rate, points
    #[arg(long, value_name = "ROLE=NAME", value_parser = variable)]
    pub(super) variable: Vec<(VariableRole, String)>,
    /// Taps that drove a channel to its limit: reject them, or keep the decay after the last clipped sample;
    /// default: reject
    #[arg(long, value_name = "WHAT", value_parser = overload())]
    pub(super) overload: Option<bool>,
}

/// Taps of a bare recording that are chosen by hand.
#[derive(Debug, Args)]
pub(super) struct TapArguments {
    /// Times of taps to use whatever their faults, as the table of taps shows them, such as 4.91,12.31 (s)
    #[arg(long, value_name = "S,S", value_delimiter = ',', value_parser = tap_time)]
    accept_taps: Vec<f64>,
    /// Times of taps to leave out, as the table of taps shows them (s)
    #[arg(long, value_name = "S,S", value_delimiter = ',', value_parser = tap_time)]
    reject_taps: Vec<f64>,
    /// Decisions by hand of `listen`, in place of both.
    #[arg(skip)]
    pub(super) decided: OnceLock<TapsByHand>,
}

impl TapArguments {
    /// Returns the decisions by hand.
    pub(super) fn by_hand(&self) -> TapsByHand {
        let decided = self.decided.get().cloned();
        decided.unwrap_or_else(|| TapsByHand {
            accept: self.accept_taps.clone(),
            reject: self.reject_taps.clone(),
        })
    }

    /// Refuses decisions about more than one recording.
    ///
    /// # Errors
    /// There are some, and so many files.
    pub(super) fn check(&self, files: usize) -> anyhow::Result<()> {
        ensure!(
            files == 1 || self.by_hand() == TapsByHand::default(),
            "--accept-taps and --reject-taps name taps of one recording, and there are {files}; write a description with \
             `accept_taps` and `reject_taps` in each [[recording]]"
        );
        Ok(())
    }
}

/// Parses a wanted accuracy (1).
pub(super) fn accuracy(text: &str) -> Result<f64, String> {
    share(text, 1.0, "a share such as \"5 %\" or 0.05")
}

/// Parses a share between 0 and a limit.
pub(super) fn share(text: &str, limit: f64, example: &str) -> Result<f64, String> {
    let value = parse_quantity(text, Dimension::Ratio).map_err(|error| error.to_string())?;
    if value > 0.0 && value < limit {
        return Ok(value);
    }
    Err(format!(
        "{} % is outside 0 to {} %; give {example}",
        100.0 * value,
        100.0 * limit
    ))
}

/// Parses the time of a tap (s).
fn tap_time(text: &str) -> Result<f64, String> {
    let seconds = parse_quantity(text, Dimension::Time).map_err(|error| error.to_string())?;
    match (0.0..=MOST_SECONDS).contains(&seconds) {
        true => Ok(seconds),
        false => Err(format!("{seconds} s; give 0 to {MOST_SECONDS:e} s")),
    }
}

/// Latest time of a tap (s), as in descriptions: four months.
const MOST_SECONDS: f64 = 1e7;

impl RecordingArguments {
    /// Returns the settings of the readers.
    pub(super) fn settings(&self) -> ReadSettings {
        let mut variables = Variables::new();
        for (role, name) in &self.variable {
            variables.entry(*role).or_default().push(name.clone());
        }
        ReadSettings {
            sample_rate: self.sample_rate,
            time_unit: self.time_unit,
            values: self.values,
            variables,
            frames: None,
        }
    }

    /// Returns the limits for taps.
    pub(super) fn taps(&self) -> TapSettings {
        TapSettings {
            keep_overload: self.overload.unwrap_or(false),
            ..TapSettings::default()
        }
    }

    /// Returns the settings for a file without a description.
    pub(super) fn bare(&self, spectrum: &SpectrumSettings, reading: ReadBy) -> BareSettings {
        BareSettings {
            hammer: self.hammer.clone(),
            read: self.settings(),
            keep_overload: self.overload,
            by_hand: TapsByHand::default(),
            block: spectrum.block,
            band: spectrum.zoom,
            window: spectrum.window,
            reading,
            select: spectrum.select,
        }
    }

    /// Opens a recording that has the hammer's channel.
    pub(super) fn open(&self, path: &Path) -> Result<Recording, RecordingError> {
        let spectrum = SpectrumSettings::default();
        self.bare(&spectrum, ReadBy::default()).open(path)
    }
}

/// Parses the use of a variable and its name.
pub(super) fn variable(text: &str) -> Result<(VariableRole, String), String> {
    let words = VariableRole::WORDS;
    let allowed = words.map(|(word, _)| word).join(", ");
    let (word, name) = text
        .split_once('=')
        .ok_or_else(|| format!("there is no equals sign; give ROLE=NAME; roles: {allowed}"))?;
    let found = words.iter().find(|(known, _)| *known == word.trim());
    let (_, role) = found.ok_or_else(|| format!("\"{word}\" is no role; roles: {allowed}"))?;
    match name.trim() {
        "" => Err("the name is empty; give ROLE=NAME".to_owned()),
        name => Ok((*role, name.to_owned())),
    }
}

fn sample_rate(text: &str) -> Result<f64, String> {
    let rate = parse_quantity(text, Dimension::Rate).map_err(|error| error.to_string())?;
    match (1.0..=1e8).contains(&rate) {
        true => Ok(rate),
        false => Err(format!(
            "{rate} Hz is no sample rate; give 1 to 1e8 samples per second, such as 5120 or \"51.2 kHz\""
        )),
    }
}

/// Block, band and window of a spectrum, and the choice of its taps.
#[derive(Debug, Default, Args)]
pub(super) struct SpectrumSettings {
    /// Block size (samples); default: the longest that fits the shortest tap
    #[arg(long, value_name = "N", value_parser = block_size())]
    pub(super) block: Option<usize>,
    /// Zoom band (Hz); default: 0 to sample rate/2.56
    #[arg(long, value_name = "LO:HI", value_parser = band)]
    pub(super) zoom: Option<(f64, f64)>,
    /// Window; default: rectangular if the taps decay to 1 % within the block, else exponential
    #[arg(long, value_name = "W", value_parser = window())]
    pub(super) window: Option<WindowKind>,
    /// Taps to average: all that count by themselves, or only those whose responses agree. "consistent" needs a hammer and
    /// four taps; default: all
    #[arg(long, value_name = "WHICH", value_parser = selection())]
    pub(super) select: Option<TapSelection>,
}

impl SpectrumSettings {
    /// Puts the settings into those of a measurement.
    pub(super) fn apply(&self, measure: &mut MeasureSettings) {
        measure.block = self.block;
        measure.band = self.zoom;
        measure.window = self.window;
        measure.select = self.select.unwrap_or_default();
    }
}

/// Returns the parser of block sizes, with the limits of the test description's `block`.
pub(super) fn block_size() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(LEAST_BLOCK as u64..=MOST_BLOCK as u64)
}

/// Highest edge of a band (Hz), that of a description's `band`.
const HIGHEST_EDGE: f64 = 1e8;

/// Parses a frequency band, `LO:HI` (Hz).
pub(super) fn band(text: &str) -> Result<(f64, f64), String> {
    let example = "give two frequencies in Hz such as 0:200";
    let (low, high) = text
        .split_once(':')
        .ok_or_else(|| format!("there is no colon; {example}"))?;
    let mut edges = [0.0; 2];
    for (edge, text) in edges.iter_mut().zip([low, high]) {
        *edge = parse_quantity(text, Dimension::Frequency)
            .map_err(|error| format!("{error}; {example}"))?;
    }
    let [low, high] = edges;
    if low < 0.0 || high <= low || high > HIGHEST_EDGE {
        return Err(format!(
            "the edges must be ascending, not negative and at most {HIGHEST_EDGE:e} Hz; {example}"
        ));
    }
    Ok((low, high))
}

/// Numbers separated by commas. The alias makes them one value of an option.
pub(super) type Numbers = Vec<f64>;

/// Parses positive ascending frequencies (Hz).
pub(super) fn frequencies(text: &str) -> Result<Numbers, String> {
    let frequencies = positive_numbers(text, "give frequencies in Hz such as 17,118,335.6")?;
    if frequencies.len() > MEASURED_LIMIT {
        return Err(format!(
            "{} frequencies are too many; give at most {MEASURED_LIMIT}, the lowest mode first",
            frequencies.len()
        ));
    }
    match frequencies.windows(2).find(|pair| pair[1] <= pair[0]) {
        Some(pair) => Err(format!(
            "{} does not exceed {}; give ascending frequencies in Hz, the lowest mode first",
            pair[1], pair[0]
        )),
        None => Ok(frequencies),
    }
}

/// Parses half-line bounds, one for all frequencies or one for each (Hz).
pub(super) fn half_lines(text: &str) -> Result<Numbers, String> {
    positive_numbers(text, "give half of the line spacing in Hz such as 0.125")
}

/// Most changes of a list: each takes two estimates by every method.
const MOST_PERCENTS: usize = 100;

/// Parses frequency changes (percent).
pub(super) fn percents(text: &str) -> Result<Numbers, String> {
    let percents = positive_numbers(text, "give percentages such as 0.05,0.1")?;
    if percents.len() > MOST_PERCENTS {
        let count = percents.len();
        return Err(format!(
            "{count} changes are too many; give at most {MOST_PERCENTS}"
        ));
    }
    match percents.iter().find(|percent| **percent >= 50.0) {
        Some(large) => Err(format!("{large} % is too large; give less than 50 %")),
        None => Ok(percents),
    }
}

/// Largest number of a list, that of a description's frequencies (Hz).
const LARGEST: f64 = 1e9;

fn positive_numbers(text: &str, remedy: &str) -> Result<Numbers, String> {
    text.split(',')
        .map(|item| {
            let value = number(item, "not a positive number", remedy, |value| {
                value.is_finite() && value > 0.0
            })?;
            match value <= LARGEST {
                true => Ok(value),
                false => Err(format!("{value:e} is too large; give at most {LARGEST:e}")),
            }
        })
        .collect()
}

/// Parses a factor from a file's units to SI units; negative if the sensor is mounted the other way.
pub(super) fn channel_scale(text: &str) -> Result<f64, String> {
    let remedy = "give SI units per unit of the file, a size from 1e-15 to 1e15 such as 500; negative = the other way round";
    number(text, "no scale", remedy, |value| {
        (1e-15..=1e15).contains(&value.abs())
    })
}

/// Parses a non-dimensional stiffness of the joint, from 0 to infinity ("rigid").
fn stiffness(text: &str) -> Result<f64, String> {
    if text.trim() == "rigid" {
        return Ok(f64::INFINITY);
    }
    let remedy = "give a number from 0 to infinity; \"inf\" or \"rigid\" for no give";
    number(text, "no stiffness", remedy, |value| value >= 0.0)
}

/// Parses a non-dimensional cross-coupling stiffness: any number but 0, infinite for no coupling.
fn cross_stiffness(text: &str) -> Result<f64, String> {
    let remedy = "give any number but 0; \"inf\" for no coupling, negative for a soft root";
    number(text, "no coupling stiffness", remedy, |value| {
        value != 0.0 && !value.is_nan()
    })
}

/// Parses a number. Messages call a number that is not allowed `what`.
fn number(
    text: &str,
    what: &str,
    remedy: &str,
    is_allowed: impl Fn(f64) -> bool,
) -> Result<f64, String> {
    match text.trim().parse() {
        // Too many digits are read as infinity.
        Ok(value)
            if is_allowed(value)
                && !(value.is_infinite() && text.contains(|c: char| c.is_ascii_digit())) =>
        {
            Ok(value)
        }
        Ok(_) => Err(format!("{} is {what}; {remedy}", text.trim())),
        Err(_) => Err(format!("\"{}\" is not a number; {remedy}", text.trim())),
    }
}

/// Least stiffness of a joint that holds a beam (non-dimensional). Below it, the lowest modes are those of a free
/// body, and their frequencies drown in rounding.
const LEAST_STIFFNESS: f64 = 1e-6;

/// A joint that replaces the described one.
#[derive(Debug, Args)]
pub(super) struct StiffnessArguments {
    /// Translational stiffness, 0 to inf (non-dimensional); default: kt of TEST
    #[arg(long, value_name = "N", requires = "ky", allow_negative_numbers = true, value_parser = stiffness)]
    kx: Option<f64>,
    /// Rotational stiffness, 0 to inf (non-dimensional); default: kr of TEST
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true, value_parser = stiffness)]
    ky: Option<f64>,
    /// Cross-coupling stiffness (non-dimensional), negative for a soft root; default: no coupling
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true, value_parser = cross_stiffness)]
    kz: Option<f64>,
}

impl StiffnessArguments {
    /// Returns the joint of --kx, --ky and --kz; `None` without them.
    ///
    /// # Errors
    /// A free beam, a lap joint with coupling, or a joint that would be a source of energy.
    pub(super) fn given(&self, kind: Assembly) -> anyhow::Result<Option<JointStiffness>> {
        let Some((kx, ky)) = self.kx.zip(self.ky) else {
            return Ok(None);
        };
        if kind == Assembly::Free {
            bail!("a free beam has no joint; leave out --kx, --ky and --kz");
        }
        let Some(kz) = self.kz else {
            return Ok(Some(JointStiffness::two_parameter(kx, ky)));
        };
        if kind == Assembly::Lap {
            bail!("a lap joint has no coupling stiffness; leave out --kz");
        }
        // A passive joint's compliance matrix is positive definite: 1/Kz^2 < 1/(Kx Ky). Taken as a
        // quotient of roots, because products of large stiffnesses overflow.
        let ratio = (kx / kz.abs()) * (ky / kz.abs());
        if kz.is_finite() && (ratio.is_nan() || ratio >= 1.0) {
            let limit = kx.sqrt() * ky.sqrt();
            return Err(anyhow!(
                "--kz {kz} makes the joint a source of energy; its size must exceed sqrt(kx ky) = {limit:.6}"
            ));
        }
        Ok(Some(JointStiffness::three_parameter(kx, ky, kz)))
    }

    /// As [`Self::given`], of a joint that holds the beam.
    ///
    /// # Errors
    /// Those of [`Self::given`]; a stiffness below [`LEAST_STIFFNESS`] or above `most`.
    pub(super) fn given_within(
        &self,
        kind: Assembly,
        most: f64,
    ) -> anyhow::Result<Option<JointStiffness>> {
        for (name, value) in [("--kx", self.kx), ("--ky", self.ky)] {
            let Some(value) = value.filter(|value| *value < LEAST_STIFFNESS || *value > most)
            else {
                continue;
            };
            let end = match most.is_finite() {
                true => "and finite",
                false => "or \"inf\"",
            };
            bail!("{name} {value:?}: give a number from {LEAST_STIFFNESS:?} on, {end}");
        }
        self.given(kind)
    }
}

/// Returns the parser of an option that takes one of these words, each with its help.
pub(super) fn words<T: Copy + Send + Sync + 'static, const N: usize>(
    table: [(&'static str, T); N],
    help: [&'static str; N],
) -> impl TypedValueParser<Value = T> {
    let known = table.iter().zip(help);
    let known = known.map(|((word, _), help)| PossibleValue::new(*word).help(help));
    PossibleValuesParser::new(known.collect::<Vec<_>>()).try_map(move |given: String| {
        let found = table.iter().find(|(word, _)| *word == given);
        found.map(|(_, value)| *value).ok_or("an unknown word")
    })
}

pub(super) fn assembly() -> impl TypedValueParser<Value = Assembly> {
    let help = [
        "A beam held at one end",
        "Two beams joined in the middle, free at both ends",
        "A free beam",
    ];
    words(ASSEMBLIES, help)
}

pub(super) fn window() -> impl TypedValueParser<Value = WindowKind> {
    let help = [
        "No window",
        "For steady signals, not for taps",
        "A decaying window, for taps that ring longer than the block",
    ];
    words(WINDOWS, help)
}

pub(super) fn reading() -> impl TypedValueParser<Value = ReadBy> {
    let help = [
        "Fit the decay of the taps, with a standard deviation",
        "Interpolate between the spectral lines about each peak",
        "Take the highest spectral line, with the half-line bound",
    ];
    words(READINGS, help)
}

fn time_unit() -> impl TypedValueParser<Value = f64> {
    let help = ["Seconds", "Milliseconds", "Microseconds", "Nanoseconds"];
    words(TIME_UNITS, help)
}

fn selection() -> impl TypedValueParser<Value = TapSelection> {
    let help = [
        "All that are in order",
        "Those whose responses agree with each other",
    ];
    words(SELECTIONS, help)
}

fn overload() -> impl TypedValueParser<Value = bool> {
    words(
        OVERLOADS,
        [
            "Reject them",
            "Use their decay after the last clipped sample",
        ],
    )
}

fn value_columns() -> impl TypedValueParser<Value = ValueColumns> {
    let help = [
        "Real and imaginary part",
        "Magnitude and phase, or the magnitude alone",
        "Level in dB and phase in degrees, or the level alone",
    ];
    words(ValueColumns::WORDS, help)
}

pub(super) fn sensor_kind() -> impl TypedValueParser<Value = SensorKind> {
    let help = [
        "Accelerometer, m/s2",
        "Velocity, m/s",
        "Displacement, m",
        "Microphone, Pa",
    ];
    words(SENSOR_KINDS, help)
}

pub(super) fn response_form() -> impl TypedValueParser<Value = ResponseForm> {
    let help = [
        "Acceleration per force, (m/s2)/N",
        "Velocity per force, (m/s)/N",
        "Displacement per force, m/N",
    ];
    words(FORMS, help)
}

pub(super) fn estimator() -> impl TypedValueParser<Value = FrfEstimator> {
    let estimators = [
        ("h1", FrfEstimator::H1),
        ("h2", FrfEstimator::H2),
        ("hv", FrfEstimator::Hv),
    ];
    let help = [
        "Gfx/Gff: correct if only the response is noisy",
        "Gxx/Gxf: correct if only the force is noisy",
        "Total least squares: between the two",
    ];
    words(estimators, help)
}

const PAIRS_HELP: &str =
    "Only the multi-linear regression over pairs of modes (Euler beam, without sensor masses)";

pub(super) fn method() -> impl TypedValueParser<Value = EstimateMethod> {
    let methods = EstimateMethod::ALL.map(|method| (method.name(), method));
    let help = [
        "Least squares on the frequencies; the pair regression is shown beside it",
        PAIRS_HELP,
    ];
    words(methods, help)
}

/// Returns the parser of a choice of estimates to perturb. The last of them is the main estimate.
pub(super) fn perturbed_methods() -> impl TypedValueParser<Value = &'static [EstimateMethod]> {
    use EstimateMethod::{Consistent, Pairs};
    let methods: [(_, &'static [_]); 3] = [
        ("both", &[Pairs, Consistent]),
        ("consistent", &[Consistent]),
        ("pairs", &[Pairs]),
    ];
    let help = [
        "Both estimates, side by side",
        "Only the least squares on the frequencies",
        PAIRS_HELP,
    ];
    words(methods, help)
}

/// Returns the settings that estimate and perturb by these methods.
pub(super) fn perturbed_by(methods: &[EstimateMethod]) -> IdentifySettings {
    IdentifySettings {
        method: methods.last().copied().unwrap_or_default(),
        perturbed: methods.to_vec(),
        ..IdentifySettings::default()
    }
}

/// Parses a repeatability: a ratio, or a percentage with its sign.
pub(super) fn repeatability(text: &str) -> Result<f64, String> {
    let value = parse_quantity(text, Dimension::Ratio).map_err(|error| error.to_string())?;
    let [least, most] = REPEATABILITY_LIMITS;
    match (least..=most).contains(&value) {
        true => Ok(value),
        false => Err(format!(
            "{text} is no repeatability; give \"{} %\" to \"{} %\", such as \"0.1 %\"",
            percent(least),
            percent(most)
        )),
    }
}

/// Returns a relative value in percent, without digits that the computer adds.
pub(super) fn percent(value: f64) -> f64 {
    (1e8 * value).round() / 1e6
}
