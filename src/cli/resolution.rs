//! `tapjoint resolution`: errors of frequencies and stiffness by block size, window and reading.

use super::Outcome;
use super::arguments::{StiffnessArguments, accuracy, band, block_size, reading, share, window};
use super::input::{TestFile, read_test};
use super::output::OutputFile;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::{ReadBy, WindowKind};
use crate::pipeline::{IdentifySettings, Stage, TestedStructure, Watch, Work, tested_structure};
use crate::report::{
    prediction_of, render_resolution, render_resolution_csv, render_resolution_picture,
};
use crate::structure::{Assembly, JointStiffness};
use crate::study::resolution::{ResolutionSettings, StudiedTest, study_resolution};
use anyhow::{bail, ensure};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;

/// Show how resolution limits frequencies and joint stiffness.
///
/// For each block size, virtual taps are recorded and their frequencies read: on the spectral line,
/// between the lines, and by a fit. The joint is estimated from each reading. Its true stiffness is
/// --kx and --ky, or kt and kr of TEST, or the estimate from the frequencies or recordings of TEST. Each
/// mode is read in the narrowest band that contains it.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint resolution test.toml --band 0:200 --band 0:1000 --png resolution.png\n  tapjoint resolution test.toml --blocks 2048,4096 --draws 200 --accuracy \"2 %\""
)]
pub(super) struct ResolutionArguments {
    /// Test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Block sizes (samples); default: 512 to 65536
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', value_parser = block_size())]
    blocks: Vec<usize>,
    /// Number of virtual tests for each block size
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = RangedU64ValueParser::<usize>::new().range(2..=1_000_000))]
    draws: usize,
    /// Number of these tests that are also fitted, which takes longer
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = RangedU64ValueParser::<usize>::new().range(2..=1_000_000))]
    fit_draws: usize,
    /// Zoom band (Hz); repeat it for more bands; default: the bands of TEST's recordings, or one band
    /// for all modes
    #[arg(long = "band", value_name = "LO:HI", value_parser = band)]
    bands: Vec<(f64, f64)>,
    /// Windows; default: chosen by the decay in the block
    #[arg(long, value_name = "W,W,...", value_delimiter = ',', value_parser = window())]
    windows: Vec<WindowKind>,
    /// Ways of reading; default: all
    #[arg(long, value_name = "R,R,...", value_delimiter = ',', value_parser = reading())]
    readings: Vec<ReadBy>,
    /// Required accuracy of every stiffness (rms), such as "5 %"
    #[arg(long, value_name = "P", default_value = "5 %", value_parser = accuracy)]
    accuracy: f64,
    /// Damping ratio of the modes, such as "0.3 %"
    #[arg(long, value_name = "Z", default_value = "0.3 %", value_parser = damping)]
    damping: f64,
    /// Ratio of a response's peak to the rms of its noise (dB)
    #[arg(long, value_name = "DB", default_value_t = 60.0, value_parser = decibels)]
    noise: f64,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    /// Draw the errors over the block size into this file (PNG, or SVG if its name ends in .svg)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write all numbers as comma-separated values into this file
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

fn damping(text: &str) -> Result<f64, String> {
    share(text, 0.2, "a damping ratio such as \"0.3 %\" or 0.003")
}

fn decibels(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if (0.0..=200.0).contains(&value) => Ok(value),
        _ => Err(format!(
            "\"{text}\" is no level; give 0 to 200 dB, such as 60"
        )),
    }
}

/// Most block sizes and most bands of a study: each takes all virtual tests anew.
const MOST_SIZES: usize = 20;

fn settings(arguments: &ResolutionArguments, seed: u64) -> ResolutionSettings {
    let mut settings = ResolutionSettings {
        draws: arguments.draws,
        fit_draws: arguments.fit_draws.min(arguments.draws),
        damping_ratio: arguments.damping,
        noise_db: arguments.noise,
        accuracy: arguments.accuracy,
        seed,
        ..ResolutionSettings::default()
    };
    if !arguments.blocks.is_empty() {
        settings.blocks = arguments.blocks.clone();
        settings.blocks.sort_unstable();
        settings.blocks.dedup();
    }
    if !arguments.windows.is_empty() {
        let windows = arguments.windows.iter();
        settings.windows = windows.map(|window| (*window).into()).collect();
    }
    if !arguments.readings.is_empty() {
        // From the coarsest to the finest, each once.
        settings.readings = ReadBy::ALL.to_vec();
        let given = &arguments.readings;
        settings.readings.retain(|reading| given.contains(reading));
    }
    settings
}

/// Returns the joint that the description gives, or that is estimated from its frequencies or recordings.
fn described_joint(
    file: &TestFile,
    structure: &TestedStructure,
    watch: &dyn Watch,
) -> anyhow::Result<JointStiffness> {
    if structure.assembly == Assembly::Free {
        return Ok(JointStiffness::FREE);
    }
    if let Some(known) = structure.known.over(None) {
        return Ok(known);
    }
    let mut why = String::new();
    if file.test.measured.is_some() || !file.test.recordings.is_empty() {
        let analysis = file.analyse(&IdentifySettings::unperturbed(), watch)?;
        if let Some(found) = analysis.identification {
            if let Some((_, joint)) = found.beam_and_joint(structure) {
                return Ok(joint);
            }
            let reason = found.reason.as_deref().unwrap_or("no estimate");
            why = format!(" and cannot be estimated ({reason})");
        }
    }
    bail!(
        "{}: the joint's stiffness is not known{why}; give --kx and --ky, or kt and kr in [joint], or frequencies in [measured]",
        file.name
    )
}

pub(super) fn run(
    arguments: &ResolutionArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    for (name, count) in [
        ("--blocks", arguments.blocks.len()),
        ("--band", arguments.bands.len()),
    ] {
        ensure!(
            count <= MOST_SIZES,
            "{name} is given {count} times; give at most {MOST_SIZES}"
        );
    }
    let file = read_test(&arguments.test, &terminal)?;
    let structure = tested_structure(&file.test);
    let given = arguments
        .stiffness
        .given_within(file.test.joint.kind, f64::INFINITY)?;
    let png = OutputFile::prepare_optional(arguments.png.as_deref())?;
    let csv = OutputFile::prepare_optional(arguments.csv.as_deref())?;
    let joint = match given {
        Some(given) => given,
        None => described_joint(&file, &structure, terminal.watch())?,
    };
    let mut test = StudiedTest::of_description(&file.test, &structure, joint, &arguments.bands);
    if let Some(free) = file.measured_free_test(terminal.watch())? {
        test.details.free = Some(free.bar);
    }
    let mut work = Work::begin(terminal.watch(), Stage::Study);
    let study = study_resolution(&test, &settings(arguments, seed), &|done, of| {
        terminal.count("virtual tests", done, of);
    })?;
    work.go_on(Stage::Pictures);
    if let Some(file) = png {
        let picture = render_resolution_picture(&study, file.picture_format())?;
        file.write(&picture)?;
    }
    work.go_on(Stage::Files);
    if let Some(file) = csv {
        file.write(render_resolution_csv(&study)?.as_bytes())?;
    }
    drop(work);
    let warnings = study.doubts();
    for (_, text) in &warnings {
        terminal.warn(text);
    }
    terminal.say(&render_resolution(&study, terminal.screen()))?;
    let head = prediction_of(&file.test.name, &structure, &[]);
    let warnings: Vec<_> = warnings
        .iter()
        .map(|(code, text)| serde_json::json!({"code": code, "text": text, "beside": false}))
        .collect();
    terminal.write_json(&serde_json::json!({
        "version": head.version,
        "test": head.test,
        "resolution": study,
        "warnings": warnings,
    }))?;
    Ok(Outcome::Answered)
}
