//! Bare files, without a description.
//!
//! `tapjoint inspect` shows the contents of recordings. `tapjoint spectrum` shows the averaged spectrum of one recording
//! and its peaks. `run` and `frf` analyse bare files from here, too.

use super::Outcome;
use super::arguments::{FullAnswer, RecordingArguments, SpectrumSettings, TapArguments, reading};
use super::input::{check_file, file_name};
use super::output::OutputFile;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::ReadBy;
use crate::pipeline::{
    Analysis, BareSettings, Stage, Watch, Work, analysis_of_bare, inspect_bare, is_no_time_series,
    measure_bare_file, together,
};
use crate::recording::{is_universal_file, list_datasets, open_frequency_responses};
use crate::report::{
    datasets_of, document_of, functions_of, inspection_of, render_spectrum_csv,
    render_spectrum_picture,
};
use crate::taps::TapSettings;
use anyhow::ensure;
use clap::Args;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Analyses a recording, or the frequency response functions of a file without samples in time.
///
/// # Errors
/// Those of [`measure_bare_file`].
pub(super) fn analyse(
    path: &Path,
    settings: &BareSettings,
    watch: &dyn Watch,
) -> anyhow::Result<Analysis> {
    let result = measure_bare_file(path, settings, watch)?;
    Ok(analysis_of_bare(result.file.clone(), vec![result]))
}

/// Analyses several files as one test of this name.
///
/// # Errors
/// Those of [`measure_bare_file`], for the first file that has any.
pub(super) fn analyse_together(
    name: String,
    files: &[PathBuf],
    settings: &BareSettings,
    watch: &dyn Watch,
) -> anyhow::Result<Analysis> {
    // In parallel, but collected in order, so that of several errors the first is reported.
    let results: Vec<anyhow::Result<_>> = files
        .par_iter()
        .map(|file| Ok(measure_bare_file(file, settings, watch)?))
        .collect();
    let results = results.into_iter().collect::<anyhow::Result<_>>()?;
    Ok(analysis_of_bare(name, results))
}

/// Returns true if a file holds frequency response functions and no samples in time.
///
/// # Errors
/// The file can be read as neither.
pub(super) fn holds_functions(path: &Path, arguments: &RecordingArguments) -> anyhow::Result<bool> {
    match arguments.open(path) {
        Ok(_) => Ok(false),
        Err(problem) if is_no_time_series(&problem) => Ok(true),
        Err(problem) => Err(problem.into()),
    }
}

/// Most samples of a universal file that are read, over all its time series. Reading more takes too long
/// for a quick look, so they are only listed.
const MOST_SAMPLES: u64 = 50_000_000;

/// Show the contents and the quality of recordings.
///
/// Lists channels, sample rate, length, clipping, offsets and taps.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint inspect taps.wav --hammer 1")]
pub(super) struct InspectArguments {
    /// Recordings (WAV, FLAC, CSV, UFF58, LabVIEW, MATLAB). The datasets of universal files are listed as well
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Only list the datasets of universal files by their headers. This is fast for files of any size,
    /// and automatic beyond 50 million samples
    #[arg(long)]
    headers: bool,
    #[command(flatten)]
    recording: RecordingArguments,
    #[command(flatten)]
    taps: TapArguments,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

pub(super) fn inspect(arguments: &InspectArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    arguments.taps.check(arguments.files.len())?;
    for file in &arguments.files {
        check_file(file)?;
    }
    let (mut recordings, mut datasets) = (Vec::new(), Vec::new());
    for file in &arguments.files {
        let shown = file.display();
        if is_universal_file(file)? {
            let listed = list_datasets(file)?;
            if listed.functions().next().is_none() {
                let found = listed.contents();
                terminal.warn(&format!(
                    "{shown}: holds no function (dataset 58), only {found}"
                ));
            }
            datasets.extend(datasets_of(&file_name(file), &listed));
            // By the headers; a file has at most one sample a byte.
            let series = listed
                .functions()
                .filter(|(_, function)| function.is_time_series());
            let samples = series
                .map(|(dataset, function)| function.points.min(dataset.bytes))
                .fold(0, u64::saturating_add);
            if arguments.headers || samples == 0 {
                continue;
            }
            if samples > MOST_SAMPLES {
                terminal.warn(&format!(
                    "{shown}: {samples} samples by the headers: only these are listed; `tapjoint spectrum` reads the file"
                ));
                continue;
            }
        } else {
            ensure!(
                !arguments.headers,
                "{shown}: --headers lists the datasets of universal files, and this is none; leave --headers out"
            );
        }
        let _work = Work::begin(terminal.watch(), Stage::Taps);
        let recording = match arguments.recording.open(file) {
            Ok(recording) => recording,
            Err(problem) if is_no_time_series(&problem) => {
                let settings = arguments.recording.settings();
                let functions = open_frequency_responses(file, &settings)?;
                for doubt in &functions.warnings {
                    terminal.warn(&format!("{shown}: {doubt}"));
                }
                datasets.extend(functions_of(&file_name(file), &functions));
                continue;
            }
            Err(problem) => return Err(problem.into()),
        };
        recordings.push(inspect_bare(
            recording,
            arguments.recording.hammer.as_ref(),
            &TapSettings {
                by_hand: arguments.taps.by_hand(),
                ..arguments.recording.taps()
            },
            terminal.watch(),
        )?);
    }
    let warnings: Vec<_> = recordings
        .iter()
        .flat_map(|found| found.measurement.warnings.clone())
        .collect();
    let found = recordings
        .iter()
        .any(|recording| !recording.measurement.taps.taps.is_empty());
    let listed_only = recordings.is_empty() && !datasets.is_empty();
    let mut document = inspection_of(&recordings, &together(warnings));
    document.datasets = (!datasets.is_empty()).then_some(datasets);
    terminal.tables(&document)?;
    Ok(Outcome::of(found || listed_only))
}

/// Show the averaged spectrum of a recording and its peaks.
///
/// Each peak has the bounds that follow from the resolution. A block of N samples gives N/2.56 lines over the band.
/// The resolution is the larger of the line spacing and 1/T, where T is the length of signal used. Zero padding and
/// interpolation do not improve it.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  tapjoint spectrum taps.wav --hammer 1 --zoom 0:200 --block 2048 --png spectrum.png"
)]
pub(super) struct SpectrumArguments {
    /// Recording (WAV, FLAC, CSV, UFF58, LabVIEW, MATLAB), or frequency response functions (UFF58, text, LabVIEW, MATLAB)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    spectrum: SpectrumSettings,
    /// Way of reading the frequencies
    #[arg(long, value_name = "R", default_value = "fit", value_parser = reading())]
    reading: ReadBy,
    /// Draw the spectrum into this file (PNG, or SVG if its name ends in .svg)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write the spectra into this CSV file, a column for each channel
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
    #[command(flatten)]
    taps: TapArguments,
    #[command(flatten)]
    full: FullAnswer,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

pub(super) fn spectrum(
    arguments: &SpectrumArguments,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    check_file(&arguments.file)?;
    let png = OutputFile::prepare_optional(arguments.png.as_deref())?;
    let csv = OutputFile::prepare_optional(arguments.csv.as_deref())?;
    let bare = &arguments.recording;
    let settings = BareSettings {
        by_hand: arguments.taps.by_hand(),
        ..bare.bare(&arguments.spectrum, arguments.reading)
    };
    let analysis = analyse(&arguments.file, &settings, &terminal.measuring(1))?;
    let document = document_of(&analysis);
    if let Some(file) = png {
        let recording = analysis.recordings.first();
        let mut work = Work::begin(terminal.watch(), Stage::Pictures);
        let picture = recording
            .map(|recording| render_spectrum_picture(recording, file.picture_format()))
            .transpose()?
            .flatten();
        work.go_on(Stage::Files);
        match picture {
            Some(bytes) => file.write(&bytes)?,
            None => terminal.warn("no tap was accepted, so there is no spectrum to draw"),
        }
    }
    if let Some(file) = csv {
        let recording = analysis.recordings.first();
        match recording.map(render_spectrum_csv).transpose()?.flatten() {
            Some(text) => file.write(text.as_bytes())?,
            None => terminal.warn(
                "there is no spectrum to write: no tap was accepted, or the file holds functions, which `tapjoint frf --csv` \
                 writes",
            ),
        }
    }
    terminal.answer(&document, None, &arguments.full)?;
    terminal.write_document(&document)?;
    Ok(Outcome::of_analysis(&analysis))
}
