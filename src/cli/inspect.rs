//! `tapjoint inspect`: the contents of recordings.

use super::Outcome;
use super::arguments::RecordingArguments;
use super::input::{check_file, file_name};
use super::terminal::Terminal;
use anyhow::ensure;
use clap::Args;
use std::path::PathBuf;
use tapjoint::pipeline::{inspect_bare, together};
use tapjoint::recording::{is_universal_file, list_datasets};
use tapjoint::report::{datasets_of, inspection_of, render_text};

/// Most samples of a universal file that are read, over all its time series. Reading more takes too long
/// for a quick look, so they are only listed.
const MOST_SAMPLES: u64 = 50_000_000;

/// Show the contents and the quality of recordings.
///
/// Lists channels, sample rate, length, clipping, offsets and taps.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint inspect taps.wav --hammer 1")]
pub(super) struct InspectArguments {
    /// Recordings (WAV, CSV, UFF58). The datasets of universal files are listed as well
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Only list the datasets of universal files by their headers. This is fast for files of any size,
    /// and automatic beyond 50 million samples
    #[arg(long)]
    headers: bool,
    #[command(flatten)]
    recording: RecordingArguments,
}

pub(super) fn run(arguments: &InspectArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
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
