//! `tapjoint frf`: frequency response functions of a recording with a hammer, or of a test.

use super::Outcome;
use super::arguments::{
    RecordingArguments, SpectrumSettings, TapArguments, channel_scale, estimator, response_form,
    sensor_kind,
};
use super::input::{TestFile, check_file, read_test, stem};
use super::output::OutputFile;
use super::overwrite::Expanded;
use super::place::is_description;
use super::recording::{analyse, holds_functions};
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::{ChannelRef, ReadBy, ResponseForm, SensorKind, TestDescription};
use crate::pipeline::{
    Analysis, BareSettings, Frf, FrfSettings, IdentifySettings, MeasureSettings, Response, Stage,
    Watch, Wiring, Work, channel_of, frfs_of, refuse_for_functions, run_wired, si_unit,
};
use crate::recording::{Recording, UffFormat};
use crate::report::{frf_document, render_frf_csv, render_frf_picture, render_frf_uff};
use crate::spectral::FrfEstimator;
use anyhow::bail;
use clap::Args;
use std::path::{Path, PathBuf};

/// Compute frequency response functions with their coherence.
///
/// The estimators are H1, H2 and Hv; each function has its random error. For a bare recording, give the hammer's channel with --hammer. A test description says itself how
/// its recordings are read. The form follows from the sensor: an accelerometer gives accelerance.
/// Results are in units of the file where no units or scales are given.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint frf taps.wav --hammer 1 --scale-hammer 500 --scale-sensor 2000 --png frf.png\n  tapjoint frf test.toml --form receptance --csv frf.csv"
)]
pub(super) struct FrfArguments {
    /// Recording (WAV, FLAC, CSV, UFF58, LabVIEW, MATLAB), frequency response functions (UFF58, text, LabVIEW, MATLAB) or test description (.toml)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    recording: RecordingArguments,
    #[command(flatten)]
    taps: TapArguments,
    /// Channel of a sensor, by number or name; repeat it for more sensors; default: all channels but
    /// the hammer's
    #[arg(long, value_name = "CH")]
    sensor: Vec<ChannelRef>,
    /// Force in N per unit of the file (integer WAV: full scale = 1)
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = channel_scale)]
    scale_hammer: Option<f64>,
    /// SI units per unit of the file: one number for all sensors, or one for each
    #[arg(
        long,
        value_name = "S,...",
        value_delimiter = ',',
        allow_negative_numbers = true,
        value_parser = channel_scale
    )]
    scale_sensor: Vec<f64>,
    /// Quantity that the scaled sensors measure; default: acceleration
    #[arg(long, value_name = "KIND", requires = "scale_sensor", value_parser = sensor_kind())]
    sensor_kind: Option<SensorKind>,
    #[command(flatten)]
    spectrum: SpectrumSettings,
    /// Estimator shown in table, picture and JSON. The CSV file has all estimators; the picture shows
    /// the others faintly
    #[arg(long, value_name = "E", default_value = "h1", value_parser = estimator())]
    estimator: FrfEstimator,
    /// Form of the functions; default: as measured
    #[arg(long, value_name = "FORM", value_parser = response_form())]
    form: Option<ResponseForm>,
    /// Draw magnitude, phase and coherence into this file (PNG, or SVG if its name ends in .svg). For
    /// several recordings the files are named NAME-RECORDING
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write all functions into this file, one row for each line
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write functions and coherences as a universal file, datasets 58 (text)
    #[arg(long, value_name = "FILE")]
    uff58: Option<PathBuf>,
    /// Write functions and coherences as a universal file, datasets 58b (binary, without rounding)
    #[arg(long, value_name = "FILE")]
    uff58b: Option<PathBuf>,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
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

/// Source of the functions.
enum Subject {
    Test(Box<TestFile>),
    /// A bare recording with the hammer's channel.
    Recording(ChannelRef),
    /// Functions that an analyser has computed.
    Functions,
}

/// Checks the arguments and finds the kind of source.
fn resolve(arguments: &FrfArguments, terminal: &Terminal) -> anyhow::Result<Subject> {
    let (file, bare) = (&arguments.file, &arguments.recording);
    let own_options = [
        ("--sensor", !arguments.sensor.is_empty()),
        ("--scale-hammer", arguments.scale_hammer.is_some()),
        ("--scale-sensor", !arguments.scale_sensor.is_empty()),
    ];
    if is_description(file) {
        let by_hand = arguments.taps.by_hand();
        let described = [
            ("--hammer", bare.hammer.is_some()),
            ("--sample-rate", bare.sample_rate.is_some()),
            ("--time-unit", bare.time_unit.is_some()),
            ("--values", bare.values.is_some()),
            ("--variable", !bare.variable.is_empty()),
            ("--overload", bare.overload.is_some()),
            ("--accept-taps", !by_hand.accept.is_empty()),
            ("--reject-taps", !by_hand.reject.is_empty()),
            ("--block", arguments.spectrum.block.is_some()),
            ("--zoom", arguments.spectrum.zoom.is_some()),
            ("--window", arguments.spectrum.window.is_some()),
            ("--select", arguments.spectrum.select.is_some()),
        ];
        let given = described.iter().chain(&own_options);
        if let Some((name, _)) = given.into_iter().find(|(_, given)| *given) {
            bail!(
                "{name} is for bare recordings; a test description states this with its own keys: `channel`, `scale`, `sample_rate`, `time_unit`, `values`, `variables`, `overload`, `accept_taps`, `reject_taps`, `band`, `block`, `window`, `select`"
            );
        }
        let file = read_test(file, terminal)?;
        if file.test.recordings.is_empty() {
            bail!(
                "{}: there are no [[recording]] tables, and frequencies alone make no frequency response function",
                file.name
            );
        }
        file.check_recordings()?;
        return Ok(Subject::Test(Box::new(file)));
    }
    check_file(file)?;
    if let Some(hammer) = &bare.hammer {
        return Ok(Subject::Recording(hammer.clone()));
    }
    if !holds_functions(file, bare)? {
        bail!(
            "{}: a frequency response function needs the force; name the hammer's channel with --hammer CH, or give a test description",
            file.display()
        );
    }
    refuse_for_functions(file, &own_options)?;
    Ok(Subject::Functions)
}

fn stems(test: &TestDescription) -> Vec<String> {
    let recordings = test.recordings.iter();
    recordings.map(|recording| stem(&recording.file)).collect()
}

/// Returns the picture's file, or one file for each of several recordings, with different names.
fn picture_files(png: &Path, stems: &[String]) -> Vec<PathBuf> {
    if stems.len() == 1 {
        return vec![png.to_owned()];
    }
    let name = stem(png);
    let ending = match png.extension().unwrap_or_default().to_string_lossy() {
        ending if ending.is_empty() => "png".into(),
        ending => ending,
    };
    let mut files = Vec::new();
    for (index, stem) in stems.iter().enumerate() {
        let before = stems.iter().take(index).filter(|other| *other == stem);
        files.push(png.with_file_name(match before.count() {
            0 => format!("{name}-{stem}.{ending}"),
            others => format!("{name}-{stem}-{}.{ending}", others + 1),
        }));
    }
    files
}

pub(super) fn run(arguments: &FrfArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let subject = resolve(arguments, &terminal)?;
    let stems = match &subject {
        Subject::Test(file) => stems(&file.test),
        Subject::Recording(_) | Subject::Functions => vec![stem(&arguments.file)],
    };
    let png = arguments.png.iter();
    let pictures = png
        .flat_map(|png| picture_files(png, &stems))
        .map(|path| OutputFile::prepare(&path))
        .collect::<Result<Vec<_>, _>>()?;
    // A universal file has a format.
    let outputs = [
        (&arguments.csv, None),
        (&arguments.uff58, Some(UffFormat::Ascii)),
        (&arguments.uff58b, Some(UffFormat::Binary)),
    ];
    let outputs = outputs
        .into_iter()
        .filter_map(|(path, format)| Some((path.as_deref()?, format)))
        .map(|(path, format)| Ok((OutputFile::prepare(path)?, format)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let bare = &arguments.recording;
    let analysis = match &subject {
        Subject::Test(file) => file.analyse(
            &IdentifySettings::unperturbed(),
            &terminal.measuring(file.test.recordings.len()),
        )?,
        Subject::Recording(hammer) => analyse_recording(arguments, hammer, &terminal.measuring(1))?,
        Subject::Functions => analyse(
            &arguments.file,
            &BareSettings {
                by_hand: arguments.taps.by_hand(),
                ..bare.bare(&arguments.spectrum, ReadBy::default())
            },
            &terminal.measuring(1),
        )?,
    };
    let settings = FrfSettings {
        estimator: arguments.estimator,
        form: arguments.form,
    };
    let mut work = Work::begin(terminal.watch(), Stage::Spectra);
    let frfs: Vec<Vec<Frf>> = analysis
        .recordings
        .iter()
        .map(|recording| frfs_of(recording, &settings))
        .collect::<Result<_, _>>()?;
    work.go_on(Stage::Pictures);
    let drawn = pictures.into_iter().zip(&analysis.recordings).zip(&frfs);
    for ((file, recording), frfs) in drawn {
        match render_frf_picture(recording, frfs, file.picture_format())? {
            Some(bytes) => file.write(&bytes)?,
            None => terminal.warn(&format!(
                "{}: no function to draw: no tap was accepted, or each was overloaded",
                recording.file
            )),
        }
    }
    let all = frfs.concat();
    work.go_on(Stage::Files);
    for (file, format) in outputs {
        match format {
            _ if all.is_empty() => {
                terminal.warn("no function to write: no tap was accepted, or each was overloaded");
            }
            None => file.write(render_frf_csv(&all)?.as_bytes())?,
            Some(format) => file.write(&render_frf_uff(&all, format)?)?,
        }
    }
    drop(work);
    let document = frf_document(&analysis, &all);
    terminal.tables(&document)?;
    Ok(Outcome::of(!all.is_empty()))
}

/// Analyses a bare recording with a hammer: finds the sensors' channels and scales them.
///
/// # Errors
/// Channels that do not exist or are named twice, scales that do not fit them, an impossible analysis.
fn analyse_recording(
    arguments: &FrfArguments,
    hammer: &ChannelRef,
    watch: &dyn Watch,
) -> anyhow::Result<Analysis> {
    let work = Work::begin(watch, Stage::Taps);
    let mut recording = arguments.recording.open(&arguments.file)?;
    let hammer = channel_of(&recording, "--hammer", hammer)?;
    let channels = sensor_channels(&recording, hammer, &arguments.sensor)?;
    let scales = &arguments.scale_sensor;
    if !matches!(scales.len(), 0 | 1) && scales.len() != channels.len() {
        bail!(
            "--scale-sensor has {} numbers for {} sensors; give one for all, or one for each",
            scales.len(),
            channels.len()
        );
    }
    let hammer_unit = match arguments.scale_hammer {
        Some(scale) => {
            recording.set_scale(hammer, scale)?;
            Some("N".to_owned())
        }
        None => {
            let info = recording.channels().get(hammer);
            info.and_then(|info| info.unit.clone())
        }
    };
    let mut responses = Vec::with_capacity(channels.len());
    for (place, channel) in channels.into_iter().enumerate() {
        let info = recording.channels().get(channel);
        let mut response = Response {
            name: info
                .and_then(|info| info.name.clone())
                .unwrap_or_else(|| format!("channel {}", channel + 1)),
            kind: None,
            unit: info.and_then(|info| info.unit.clone()),
        };
        if let Some(scale) = scales.get(place).or(scales.first()) {
            recording.set_scale(channel, *scale)?;
            let kind = arguments.sensor_kind.unwrap_or(SensorKind::Acceleration);
            response.kind = Some(kind);
            response.unit = Some(si_unit(kind).to_owned());
        }
        responses.push((channel, response));
    }
    let wiring = Wiring {
        hammer: Some(hammer),
        hammer_unit,
        responses,
    };
    drop(work);
    let adjust = |measure: &mut MeasureSettings| {
        arguments.spectrum.apply(measure);
        measure.taps = arguments.recording.taps();
        measure.taps.by_hand = arguments.taps.by_hand();
    };
    Ok(run_wired(recording, &wiring, adjust, watch)?)
}

/// Returns the channels of the sensors; without any, all channels but the hammer's.
fn sensor_channels(
    recording: &Recording,
    hammer: usize,
    sensors: &[ChannelRef],
) -> anyhow::Result<Vec<usize>> {
    let mut channels: Vec<usize> = Vec::new();
    for sensor in sensors {
        let channel = channel_of(recording, "--sensor", sensor)?;
        if channel == hammer || channels.contains(&channel) {
            bail!(
                "{}: channel {sensor} is named twice; give the hammer and every sensor a channel of its own",
                recording.name()
            );
        }
        channels.push(channel);
    }
    if sensors.is_empty() {
        let all = 0..recording.channels().len();
        channels = all.filter(|&channel| channel != hammer).collect();
    }
    if channels.is_empty() {
        bail!(
            "{}: there is no channel beside the hammer's, and without a response no frequency response function",
            recording.name()
        );
    }
    Ok(channels)
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
