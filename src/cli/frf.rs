//! `tapjoint frf`: frequency response functions of a recording with a hammer, or of a test.

use super::Outcome;
use super::arguments::{Band, ChannelScale, RecordingArguments, block_size};
use super::bare::{BareSettings, analyse, holds_functions, refuse_given, wire};
use super::choices::{EstimatorArgument, FormArgument, SensorArgument, WindowArgument};
use super::input::{TestFile, check_file, is_description, read_test};
use super::output::OutputFile;
use super::overwrite::Expanded;
use super::terminal::Terminal;
use anyhow::bail;
use clap::Args;
use std::path::{Path, PathBuf};
use tapjoint::description::{ChannelRef, TestDescription, WindowKind};
use tapjoint::pipeline::{Analysis, Frf, FrfSettings, IdentifySettings, frfs_of, run_wired};
use tapjoint::recording::UffFormat;
use tapjoint::report::{
    frf_document, render_frf_csv, render_frf_picture, render_frf_uff, render_text,
};

/// Frequency response functions (H1, H2, Hv) with coherence and random error.
///
/// Of a bare recording name the hammer's channel; of a test description every recording is taken as
/// described. The form follows from the sensor (acceleration: accelerance) unless another is asked
/// for. Where nobody states units, results are per unit of the file.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint frf taps.wav --hammer 1 --scale-hammer 500 --scale-sensor 2000 --png frf.png\n  tapjoint frf test.toml --form receptance --csv frf.csv"
)]
pub(super) struct FrfArguments {
    /// A recording (WAV, CSV, UFF58), frequency response functions (UFF58 or text) or a test description (.toml)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    recording: RecordingArguments,
    /// Channel of a sensor, its number or name; may be given several times; default: all but the
    /// hammer's
    #[arg(long, value_name = "CH")]
    sensor: Vec<ChannelRef>,
    /// N per unit of the file (integer WAV: full scale = 1)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    scale_hammer: Option<ChannelScale>,
    /// SI units per unit of the file, one for all sensors or one for each, separated by commas
    #[arg(
        long,
        value_name = "S,...",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    scale_sensor: Vec<ChannelScale>,
    /// What scaled sensors sense; default: acceleration
    #[arg(long, value_enum, value_name = "KIND", requires = "scale_sensor")]
    sensor_kind: Option<SensorArgument>,
    /// Block size (samples); default: what fits the shortest tap
    #[arg(long, value_name = "N", value_parser = block_size())]
    block: Option<usize>,
    /// Zoom band (Hz); default: 0 to sample rate/2.56
    #[arg(long, value_name = "LO:HI")]
    zoom: Option<Band>,
    /// Window; default: rectangular where the taps ring down to 1 % in the block, else exponential
    #[arg(long, value_enum, value_name = "W")]
    window: Option<WindowArgument>,
    /// The estimator of table, picture and JSON; CSV has all, the picture the others faintly
    #[arg(long, value_enum, value_name = "E", default_value_t)]
    estimator: EstimatorArgument,
    /// The form of the functions; default: as measured
    #[arg(long, value_enum, value_name = "FORM")]
    form: Option<FormArgument>,
    /// Draw magnitude, phase and coherence into this file, SVG where its name ends in .svg; of several recordings one file each,
    /// named NAME-RECORDING with the same ending
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write all functions into this file, one row for each line
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the functions and coherences as a universal file, datasets 58 (text)
    #[arg(long, value_name = "FILE")]
    uff58: Option<PathBuf>,
    /// The same as datasets 58b (binary: every bit is kept)
    #[arg(long, value_name = "FILE")]
    uff58b: Option<PathBuf>,
}

/// What is to be transformed.
enum Subject {
    Test(Box<TestFile>),
    Recording(Box<ChannelRef>),
    /// Functions that an analyser has computed.
    Functions,
}

/// The arguments, checked, and every output shown to be writable.
struct Request {
    subject: Subject,
    settings: FrfSettings,
    /// One for each recording, or none.
    pngs: Vec<OutputFile>,
    csv: Option<OutputFile>,
    /// Universal files with their formats.
    universal: Vec<(OutputFile, UffFormat)>,
}

fn resolve(arguments: &FrfArguments, terminal: &Terminal) -> anyhow::Result<Request> {
    let (subject, stems) = if is_description(&arguments.file) {
        let file = described(arguments, terminal)?;
        let stems = stems(&file.test);
        (Subject::Test(Box::new(file)), stems)
    } else {
        check_file(&arguments.file)?;
        (bare_subject(arguments)?, vec![stem(&arguments.file)])
    };
    let pngs = match &arguments.png {
        Some(png) => picture_files(png, &stems)
            .iter()
            .map(|path| OutputFile::prepare(path))
            .collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    let csv = arguments.csv.as_deref().map(OutputFile::prepare);
    let wanted = [
        (&arguments.uff58, UffFormat::Ascii),
        (&arguments.uff58b, UffFormat::Binary),
    ];
    let universal = wanted
        .into_iter()
        .filter_map(|(path, format)| Some((path.as_deref()?, format)))
        .map(|(path, format)| Ok((OutputFile::prepare(path)?, format)))
        .collect::<anyhow::Result<_>>()?;
    Ok(Request {
        subject,
        settings: FrfSettings {
            estimator: arguments.estimator.into(),
            form: arguments.form.map(Into::into),
        },
        pngs,
        csv: csv.transpose()?,
        universal,
    })
}

/// A bare recording needs the hammer's channel; a file of functions has no channels.
fn bare_subject(arguments: &FrfArguments) -> anyhow::Result<Subject> {
    if let Some(hammer) = arguments.recording.hammer.clone() {
        return Ok(Subject::Recording(Box::new(hammer)));
    }
    if !holds_functions(&arguments.file, &arguments.recording)? {
        bail!(
            "{}: a frequency response function needs the force; name the hammer's channel with --hammer CH, or give a test description",
            arguments.file.display()
        );
    }
    let given = [
        ("--sensor", !arguments.sensor.is_empty()),
        ("--scale-hammer", arguments.scale_hammer.is_some()),
        ("--scale-sensor", !arguments.scale_sensor.is_empty()),
    ];
    refuse_given(&arguments.file, &given)?;
    Ok(Subject::Functions)
}

/// The description, which says itself what the arguments for bare recordings would.
fn described(arguments: &FrfArguments, terminal: &Terminal) -> anyhow::Result<TestFile> {
    let bare = &arguments.recording;
    let given = [
        ("--hammer", bare.hammer.is_some()),
        ("--sample-rate", bare.sample_rate.is_some()),
        ("--sensor", !arguments.sensor.is_empty()),
        ("--scale-hammer", arguments.scale_hammer.is_some()),
        ("--scale-sensor", !arguments.scale_sensor.is_empty()),
        ("--block", arguments.block.is_some()),
        ("--zoom", arguments.zoom.is_some()),
        ("--window", arguments.window.is_some()),
    ];
    if let Some((name, _)) = given.iter().find(|(_, given)| *given) {
        bail!(
            "{name} is for bare recordings; a test description says it itself: `channel`, `scale`, `sample_rate`, `band`, `block`, `window`"
        );
    }
    let file = read_test(&arguments.file, terminal)?;
    if file.test.recordings.is_empty() {
        bail!(
            "{}: there are no [[recording]] tables, and frequencies alone make no frequency response function",
            file.name
        );
    }
    file.check_recordings()?;
    Ok(file)
}

impl FrfArguments {
    /// Returns the pictures of a test's recordings.
    pub(super) fn expanded(&self, test: Option<&TestDescription>) -> Vec<Expanded> {
        let pictures = self.png.as_deref().zip(test);
        pictures
            .map(|(png, test)| ("png", picture_files(png, &stems(test))))
            .into_iter()
            .collect()
    }
}

fn stems(test: &TestDescription) -> Vec<String> {
    let recordings = test.recordings.iter();
    recordings.map(|recording| stem(&recording.file)).collect()
}

fn stem(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The picture's file, or of several recordings one for each, none twice.
fn picture_files(png: &Path, stems: &[String]) -> Vec<PathBuf> {
    if stems.len() == 1 {
        return vec![png.to_owned()];
    }
    let name = stem(png);
    let ending = png.extension().unwrap_or_default().to_string_lossy();
    let ending = if ending.is_empty() {
        "png".into()
    } else {
        ending
    };
    let numbered = |(index, stem): (usize, &String)| {
        let before = stems.iter().take(index).filter(|other| *other == stem);
        match before.count() {
            0 => format!("{name}-{stem}.{ending}"),
            others => format!("{name}-{stem}-{}.{ending}", others + 1),
        }
    };
    let names = stems.iter().enumerate().map(numbered);
    names.map(|name| png.with_file_name(name)).collect()
}

pub(super) fn run(arguments: &FrfArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let request = resolve(arguments, &terminal)?;
    let analysis = match &request.subject {
        Subject::Test(file) => file.analyse(&IdentifySettings::unperturbed())?,
        Subject::Recording(hammer) => bare(arguments, hammer)?,
        Subject::Functions => analyse(
            &arguments.file,
            &arguments.recording,
            &BareSettings {
                block: arguments.block,
                band: arguments.zoom.map(|band| (band.low, band.high)),
                window: arguments.window.map(WindowKind::from),
                ..BareSettings::default()
            },
        )?,
    };
    let frfs: Vec<Vec<Frf>> = analysis
        .recordings
        .iter()
        .map(|recording| frfs_of(recording, &request.settings))
        .collect::<Result<_, _>>()?;
    let all: Vec<Frf> = frfs.iter().flatten().cloned().collect();
    write_pictures(request.pngs, &analysis, &frfs, &terminal)?;
    if let Some(file) = request.csv {
        if all.is_empty() {
            terminal.warn("no tap was accepted, so there is no function to write");
        } else {
            file.write(render_frf_csv(&all)?.as_bytes())?;
        }
    }
    for (file, format) in request.universal {
        if all.is_empty() {
            terminal.warn("no tap was accepted, so there is no function to write");
        } else {
            file.write(&render_frf_uff(&all, format)?)?;
        }
    }
    let document = frf_document(&analysis, &all);
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(if all.is_empty() {
        Outcome::NoAnswer
    } else {
        Outcome::Answered
    })
}

fn bare(arguments: &FrfArguments, hammer: &ChannelRef) -> anyhow::Result<Analysis> {
    let recording = arguments.recording.open(&arguments.file)?;
    let scales: Vec<f64> = arguments.scale_sensor.iter().map(|scale| scale.0).collect();
    let (recording, wiring) = wire(
        recording,
        (hammer, arguments.scale_hammer.map(|scale| scale.0)),
        (&arguments.sensor, &scales),
        arguments.sensor_kind.map(Into::into),
    )?;
    Ok(run_wired(recording, &wiring, |settings| {
        settings.block = arguments.block;
        settings.band = arguments.zoom.map(|band| (band.low, band.high));
        settings.window = arguments.window.map(WindowKind::from);
    })?)
}

fn write_pictures(
    files: Vec<OutputFile>,
    analysis: &Analysis,
    frfs: &[Vec<Frf>],
    terminal: &Terminal,
) -> anyhow::Result<()> {
    for (file, (recording, frfs)) in files.into_iter().zip(analysis.recordings.iter().zip(frfs)) {
        match render_frf_picture(recording, frfs, file.picture_format())? {
            Some(bytes) => file.write(&bytes)?,
            None => terminal.warn(&format!(
                "{}: no tap was accepted, so there is no function to draw",
                recording.file
            )),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_each_recording_has_a_picture_of_its_own() {
        let stems = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let files = |png: &str, names: &[&str]| picture_files(Path::new(png), &stems(names));
        assert_eq!(files("a/frf.png", &["r1"]), [Path::new("a/frf.png")]);
        let expected = ["a/frf-r1.png", "a/frf-r2.png", "a/frf-r1-2.png"].map(PathBuf::from);
        assert_eq!(files("a/frf.png", &["r1", "r2", "r1"]), expected);
        assert_eq!(files("frf", &["x", "y"])[1], Path::new("frf-y.png"));
    }
}
