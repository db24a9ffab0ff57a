//! `tapjoint spectrum`: the averaged spectrum of one recording and its peaks.

use super::Outcome;
use super::arguments::{RecordingArguments, SpectrumSettings};
use super::bare::analyse;
use super::choices::reading;
use super::input::check_file;
use super::output::OutputFile;
use super::run::outcome;
use super::terminal::Terminal;
use clap::Args;
use std::path::PathBuf;
use tapjoint::description::ReadBy;
use tapjoint::report::{document_of, render_spectrum_picture, render_text};

/// Show the averaged spectrum of a recording and its peaks.
///
/// Each peak has the bounds that follow from the resolution. A block of N samples gives N/2.56 lines over the band. The line spacing is the resolution. Zero
/// padding and interpolation do not improve it.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  tapjoint spectrum taps.wav --hammer 1 --zoom 0:200 --block 2048 --png spectrum.png"
)]
pub(super) struct SpectrumArguments {
    /// Recording (WAV, CSV, UFF58), or frequency response functions (UFF58, text)
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
    #[command(flatten)]
    recording: RecordingArguments,
}

pub(super) fn run(arguments: &SpectrumArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    check_file(&arguments.file)?;
    let png = OutputFile::prepare_optional(arguments.png.as_deref())?;
    let analysis = analyse(
        &arguments.file,
        &arguments.recording,
        &arguments.spectrum,
        arguments.reading,
    )?;
    let document = document_of(&analysis);
    if let Some(file) = png {
        let recording = analysis.recordings.first();
        let picture = recording
            .map(|recording| render_spectrum_picture(recording, file.picture_format()))
            .transpose()?
            .flatten();
        match picture {
            Some(bytes) => file.write(&bytes)?,
            None => terminal.warn("no tap was accepted, so there is no spectrum to draw"),
        }
    }
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(outcome(&analysis))
}
