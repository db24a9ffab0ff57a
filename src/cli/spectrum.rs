//! `tapjoint spectrum`: the averaged spectrum of one recording and its peaks.

use super::Outcome;
use super::arguments::{Band, RecordingArguments, WindowArgument, block_size};
use super::input::check_file;
use super::output::OutputFile;
use super::terminal::Terminal;
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;
use tapjoint::description::WindowKind;

/// Show the averaged spectrum of a recording and its peaks with their resolution bounds.
///
/// A block of N samples shows N/2.56 lines over the band; the line spacing, and never padding or
/// interpolation, is the resolution.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  tapjoint spectrum taps.wav --hammer 1 --zoom 0:200 --block 2048 --png spectrum.png"
)]
pub(super) struct SpectrumArguments {
    /// A recording (WAV, CSV)
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
    /// Draw the spectrum into this file
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
}

/// The arguments, checked.
#[derive(Debug)]
struct Request {
    block: Option<usize>,
    band: Option<(f64, f64)>,
    window: Option<WindowKind>,
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
        block: arguments.block,
        band: arguments.zoom.map(|band| (band.low, band.high)),
        window: arguments.window.map(WindowKind::from),
        png,
    })
}

pub(super) fn run(arguments: &SpectrumArguments, _terminal: Terminal) -> anyhow::Result<Outcome> {
    let _request = resolve(arguments)?;
    bail!("`spectrum` is not connected to the library yet")
}
