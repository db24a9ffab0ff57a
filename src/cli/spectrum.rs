//! `tapjoint spectrum`: the averaged spectrum of one recording and its peaks.

use super::Outcome;
use super::arguments::{Band, RecordingArguments, block_size};
use super::bare::{BareSettings, analyse};
use super::choices::{ReadingArgument, WindowArgument};
use super::input::check_file;
use super::output::OutputFile;
use super::run::outcome;
use super::terminal::Terminal;
use clap::Args;
use std::path::PathBuf;
use tapjoint::description::WindowKind;
use tapjoint::report::{document_of, render_spectrum_picture, render_text};

/// Show the averaged spectrum of a recording and its peaks with their resolution bounds.
///
/// A block of N samples shows N/2.56 lines over the band; the line spacing, and never padding or
/// interpolation, is the resolution.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  tapjoint spectrum taps.wav --hammer 1 --zoom 0:200 --block 2048 --png spectrum.png"
)]
pub(super) struct SpectrumArguments {
    /// A recording (WAV, CSV, UFF 58), or frequency response functions (UFF 58 or text)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Block size (samples); default: what fits the shortest tap
    #[arg(long, value_name = "N", value_parser = block_size())]
    block: Option<usize>,
    /// Zoom band (Hz); default: 0 to sample rate/2.56
    #[arg(long, value_name = "LO:HI")]
    zoom: Option<Band>,
    /// Window; default: rectangular where the taps ring down to 1 % in the block, else exponential
    #[arg(long, value_enum, value_name = "W")]
    window: Option<WindowArgument>,
    /// How frequencies are read
    #[arg(long, value_enum, value_name = "R", default_value_t)]
    reading: ReadingArgument,
    /// Draw the spectrum into this file; SVG where its name ends in .svg
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
}

/// The arguments, checked.
#[derive(Debug)]
struct Request {
    settings: BareSettings,
    png: Option<OutputFile>,
}

fn resolve(arguments: &SpectrumArguments) -> anyhow::Result<Request> {
    check_file(&arguments.file)?;
    let png = arguments
        .png
        .as_deref()
        .map(OutputFile::prepare)
        .transpose()?;
    Ok(Request {
        settings: BareSettings {
            block: arguments.block,
            band: arguments.zoom.map(|band| (band.low, band.high)),
            window: arguments.window.map(WindowKind::from),
            reading: arguments.reading.into(),
        },
        png,
    })
}

pub(super) fn run(arguments: &SpectrumArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let request = resolve(arguments)?;
    let analysis = analyse(&arguments.file, &arguments.recording, &request.settings)?;
    let document = document_of(&analysis);
    if let Some(file) = request.png {
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
