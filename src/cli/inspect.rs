//! `tapjoint inspect`: what is in a recording.

use super::Outcome;
use super::arguments::RecordingArguments;
use super::input::check_file;
use super::terminal::Terminal;
use anyhow::ensure;
use clap::Args;
use std::path::{Path, PathBuf};
use tapjoint::pipeline::{inspect_bare, together};
use tapjoint::recording::{UniversalFile, is_universal_file, list_datasets};
use tapjoint::report::{datasets_of, inspection_of, render_text};

/// More samples than this, over all time series of a universal file, are only listed: reading them
/// takes longer than one waits for a look.
const MOST_SAMPLES: u64 = 50_000_000;

/// Show what is in recordings: channels, rate, length, clipping, DC, taps found, what is wrong
/// with them.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint inspect taps.wav --hammer 1")]
pub(super) struct InspectArguments {
    /// Recordings (WAV, CSV, UFF 58); of universal files the datasets are listed as well
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Only list the datasets of universal files by their headers, fast however large they are; done
    /// without asking where time series have more than 50 million samples
    #[arg(long)]
    headers: bool,
    #[command(flatten)]
    recording: RecordingArguments,
}

pub(super) fn run(arguments: &InspectArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    arguments
        .files
        .iter()
        .try_for_each(|file| check_file(file))?;
    let (mut recordings, mut datasets) = (Vec::new(), Vec::new());
    for file in &arguments.files {
        let listed = list(file, arguments.headers)?;
        let samples = listed.as_ref().map(time_samples);
        if let Some(listed) = listed.iter().find(|l| l.functions().next().is_none()) {
            let (file, found) = (file.display(), listed.contents());
            terminal.warn(&format!(
                "{file}: holds no function (dataset 58), only {found}"
            ));
        }
        datasets.extend(
            listed
                .iter()
                .flat_map(|listed| datasets_of(&shown(file), listed)),
        );
        if arguments.headers || samples == Some(0) {
            continue;
        }
        if let Some(samples) = samples.filter(|samples| *samples > MOST_SAMPLES) {
            terminal.warn(&format!(
                "{}: {samples} samples by the headers: only these are listed; `tapjoint spectrum` reads the file",
                file.display()
            ));
            continue;
        }
        let recording = arguments.recording.open(file)?;
        recordings.push(inspect_bare(
            recording,
            arguments.recording.hammer.as_ref(),
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
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(if found || listed_only {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    })
}

/// The datasets of a universal file; `None` for other files.
fn list(file: &Path, headers: bool) -> anyhow::Result<Option<UniversalFile>> {
    if is_universal_file(file)? {
        return Ok(Some(list_datasets(file)?));
    }
    ensure!(
        !headers,
        "{}: --headers lists the datasets of universal files, and this is none; leave --headers out",
        file.display()
    );
    Ok(None)
}

/// Samples of all time series, by the headers; a promise of more than a sample a byte is none.
fn time_samples(file: &UniversalFile) -> u64 {
    let series = file
        .functions()
        .filter(|(_, function)| function.is_time_series());
    let samples = series.map(|(dataset, function)| function.points.min(dataset.bytes));
    samples.fold(0, u64::saturating_add)
}

/// The file as tables name it.
fn shown(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str());
    name.to_string_lossy().into_owned()
}
