//! Arguments that several commands share, and the texts they are made of.

use anyhow::{anyhow, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tapjoint::description::{ChannelRef, JointKind};
use tapjoint::quantity::{Dimension, parse_quantity};
use tapjoint::recording::{ReadSettings, Recording, RecordingError};
use tapjoint::structure::JointStiffness;

/// Arguments of every command.
#[derive(Debug, Args)]
#[command(next_help_heading = "Common options")]
pub(super) struct CommonArguments {
    /// Write the results as JSON to FILE; `-` is standard output, to which nothing else is then
    /// printed
    #[arg(long, global = true, value_name = "FILE")]
    pub(super) json: Option<JsonDestination>,
    /// Replace existing files that tapjoint did not make, too; without it only files that it made are
    /// replaced, and inputs never are
    #[arg(long, global = true)]
    pub(super) force: bool,
    /// Print nothing but errors (and the seal of a blind check)
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
    /// Seed of everything random: the same seed gives the same numbers
    #[arg(long, global = true, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// Threads to work with; default: one for each processor
    #[arg(long, global = true, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    pub(super) threads: Option<usize>,
    /// Tell on standard error what was used and how long it took; twice: every tap and peak too
    #[arg(long, short, global = true, action = clap::ArgAction::Count)]
    pub(super) verbose: u8,
}

impl CommonArguments {
    /// Whether times are to be told.
    pub(super) fn tells_more(&self) -> bool {
        self.verbose > 0 && !self.quiet
    }

    /// Sets the number of threads for the whole program.
    ///
    /// # Errors
    /// The system refuses to start so many.
    pub(super) fn set_threads(&self) -> anyhow::Result<()> {
        if let Some(threads) = self.threads {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build_global()?;
        }
        Ok(())
    }
}

/// Where `--json` goes.
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

/// How to read a recording that no test description describes.
#[derive(Debug, Args)]
pub(super) struct RecordingArguments {
    /// Channel of the hammer: its number, counted from 1, or the name of a CSV column; default:
    /// all channels are responses
    #[arg(long, value_name = "CH")]
    pub(super) hammer: Option<ChannelRef>,
    /// Sample rate of a CSV file without a time column, such as 5120 or "51.2 kHz" (Hz)
    #[arg(long, value_name = "HZ", value_parser = sample_rate)]
    pub(super) sample_rate: Option<f64>,
}

impl RecordingArguments {
    /// Opens a recording, with the sample rate given.
    pub(super) fn open(&self, path: &Path) -> Result<Recording, RecordingError> {
        let settings = ReadSettings {
            sample_rate: self.sample_rate,
        };
        let recording = Recording::open(path, &settings)?;
        // Errors name the whole path, tables the file.
        let name = path.file_name().unwrap_or(path.as_os_str());
        Ok(recording.renamed(name.to_string_lossy()))
    }
}

fn sample_rate(text: &str) -> Result<f64, String> {
    let rate = parse_quantity(text, Dimension::Rate).map_err(|error| error.to_string())?;
    if rate > 0.0 {
        Ok(rate)
    } else {
        Err("a sample rate is greater than 0 Hz".to_owned())
    }
}

/// Parser of block sizes, with the limits of the test description's `block`.
pub(super) fn block_size() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(16..=4_000_000)
}

/// A frequency band, `LO:HI` (Hz).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Band {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl FromStr for Band {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let example = "give two frequencies in Hz such as 0:200";
        let (low, high) = text
            .split_once(':')
            .ok_or_else(|| format!("there is no colon; {example}"))?;
        let edge = |text| {
            parse_quantity(text, Dimension::Frequency)
                .map_err(|error| format!("{error}; {example}"))
        };
        let band = Self {
            low: edge(low)?,
            high: edge(high)?,
        };
        if band.low < 0.0 || band.high <= band.low {
            return Err(format!(
                "the edges must be ascending and not negative; {example}"
            ));
        }
        Ok(band)
    }
}

/// Positive ascending frequencies, separated by commas (Hz).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FrequencyList(pub(super) Vec<f64>);

impl FromStr for FrequencyList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let frequencies = positive_numbers(text, "frequencies in Hz such as 17,118,335.6")?;
        let descent = frequencies.windows(2).find(|pair| pair[1] <= pair[0]);
        match descent {
            Some(pair) => Err(format!(
                "{} does not exceed {}; give ascending frequencies in Hz, the lowest mode first",
                pair[1], pair[0]
            )),
            None => Ok(Self(frequencies)),
        }
    }
}

/// Half-line bounds, one for all frequencies or one for each (Hz).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HalfLines(pub(super) Vec<f64>);

impl FromStr for HalfLines {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        positive_numbers(text, "half of the line spacing in Hz such as 0.125").map(Self)
    }
}

/// Frequency changes, separated by commas (percent).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PercentList(pub(super) Vec<f64>);

impl FromStr for PercentList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let percents = positive_numbers(text, "percentages such as 0.05,0.1")?;
        match percents.iter().find(|percent| **percent >= 50.0) {
            Some(large) => Err(format!("{large} % is no small change; give less than 50 %")),
            None => Ok(Self(percents)),
        }
    }
}

fn positive_numbers(text: &str, wanted: &str) -> Result<Vec<f64>, String> {
    let number = |item: &str| match item.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        Ok(value) => Err(format!("{value} is not a positive number; give {wanted}")),
        Err(_) => Err(format!(
            "\"{}\" is not a number; give {wanted}",
            item.trim()
        )),
    };
    text.split(',').map(number).collect()
}

/// A non-dimensional stiffness of the joint, from 0 to infinity ("rigid").
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stiffness(f64);

impl FromStr for Stiffness {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "give a number from 0 to infinity; \"inf\" or \"rigid\" for no give";
        match text.trim().parse::<f64>() {
            Ok(value) if value >= 0.0 => Ok(Self(value)),
            Ok(value) => Err(format!("{value} is no stiffness; {wanted}")),
            Err(_) if text.trim() == "rigid" => Ok(Self(f64::INFINITY)),
            Err(_) => Err(format!("\"{text}\" is not a number; {wanted}")),
        }
    }
}

/// A non-dimensional cross-coupling stiffness: any number but 0, infinite for no coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CrossStiffness(f64);

impl FromStr for CrossStiffness {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "give any number but 0; \"inf\" for no coupling, negative for a soft root";
        match text.trim().parse::<f64>() {
            Ok(value) if value != 0.0 && !value.is_nan() => Ok(Self(value)),
            Ok(value) => Err(format!("{value} is no coupling stiffness; {wanted}")),
            Err(_) => Err(format!("\"{text}\" is not a number; {wanted}")),
        }
    }
}

/// A factor that makes SI units of a file's units; negative = mounted the other way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChannelScale(pub(super) f64);

impl FromStr for ChannelScale {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted =
            "give SI units per unit of the file, such as 500; negative = the other way round";
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value != 0.0 => Ok(Self(value)),
            Ok(value) => Err(format!("{value} is no scale; {wanted}")),
            Err(_) => Err(format!("\"{text}\" is not a number; {wanted}")),
        }
    }
}

/// A joint instead of the described one.
#[derive(Debug, Args)]
pub(super) struct StiffnessArguments {
    /// Translational stiffness, 0 to inf (non-dimensional); default: kt of TEST
    #[arg(long, value_name = "N", requires = "ky", allow_negative_numbers = true)]
    kx: Option<Stiffness>,
    /// Rotational stiffness, 0 to inf (non-dimensional); default: kr of TEST
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true)]
    ky: Option<Stiffness>,
    /// Cross-coupling stiffness, negative for a soft root (non-dimensional); default: no coupling
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true)]
    kz: Option<CrossStiffness>,
}

impl StiffnessArguments {
    /// The joint that --kx, --ky and --kz give; `None` without them.
    ///
    /// # Errors
    /// A free beam, a lap joint's coupling, a joint that would be a source of energy.
    pub(super) fn given(&self, kind: JointKind) -> anyhow::Result<Option<JointStiffness>> {
        let Some((Stiffness(kx), Stiffness(ky))) = self.kx.zip(self.ky) else {
            return Ok(None);
        };
        if kind == JointKind::Free {
            bail!("a free beam has no joint; leave out --kx, --ky and --kz");
        }
        let Some(CrossStiffness(kz)) = self.kz else {
            return Ok(Some(JointStiffness::two_parameter(kx, ky)));
        };
        if kind == JointKind::Lap {
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
}
