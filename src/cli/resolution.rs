//! `tapjoint resolution`: what block size, window and reading do to frequencies and stiffness.

use super::Outcome;
use super::arguments::{Band, StiffnessArguments, block_size};
use super::choices::{ReadingArgument, WindowArgument};
use super::input::{TestFile, read_test};
use super::output::OutputFile;
use super::terminal::Terminal;
use anyhow::anyhow;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;
use tapjoint::description::{ReadBy, WindowKind};
use tapjoint::pipeline::{IdentifySettings, TestedStructure, tested_structure};
use tapjoint::quantity::{Dimension, parse_quantity};
use tapjoint::report::{
    prediction_of, render_resolution, render_resolution_csv, render_resolution_picture,
};
use tapjoint::structure::{Assembly, JointStiffness};
use tapjoint::study::resolution::{ResolutionSettings, StudiedTest, WindowName, study_resolution};

/// Show what spectral resolution does to frequencies and joint stiffness, on virtual tests.
///
/// For each block size virtual taps are recorded, read on the line, between the lines and by a fit, and
/// the joint is estimated from each. The joint is kt and kr of TEST, or what TEST's frequencies or
/// recordings give, or --kx and --ky. Each mode is read in the narrowest band that holds it.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint resolution test.toml --band 0:200 --band 0:1000 --png resolution.png\n  tapjoint resolution test.toml --blocks 2048,4096 --draws 200 --accuracy \"2 %\""
)]
pub(super) struct ResolutionArguments {
    /// A test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Block sizes (samples); default: 512 to 65536
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', value_parser = block_size())]
    blocks: Vec<usize>,
    /// Virtual tests for each block size
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = RangedU64ValueParser::<usize>::new().range(2..=1_000_000))]
    draws: usize,
    /// How many of them are fitted too: a fit takes longer
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = RangedU64ValueParser::<usize>::new().range(2..=1_000_000))]
    fit_draws: usize,
    /// Zoom bands (Hz), one --band for each; default: those of TEST's recordings, or one for all modes
    #[arg(long = "band", value_name = "LO:HI")]
    bands: Vec<Band>,
    /// Windows; default: by the decay in the block
    #[arg(long, value_name = "W,W,...", value_delimiter = ',', value_enum)]
    windows: Vec<WindowArgument>,
    /// Ways of reading; default: all
    #[arg(long, value_name = "R,R,...", value_delimiter = ',', value_enum)]
    readings: Vec<ReadingArgument>,
    /// Wanted accuracy of every stiffness (rms), such as "5 %"
    #[arg(long, value_name = "P", default_value = "5 %", value_parser = accuracy)]
    accuracy: f64,
    /// Damping ratio of the modes, such as "0.3 %"
    #[arg(long, value_name = "Z", default_value = "0.3 %", value_parser = damping)]
    damping: f64,
    /// Peak of a response over the rms of its noise (dB)
    #[arg(long, value_name = "DB", default_value_t = 60.0, value_parser = decibels)]
    noise: f64,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    /// Draw errors over block size into this file; SVG where its name ends in .svg
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write every number into this file
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

fn share(text: &str, limits: (f64, f64), example: &str) -> Result<f64, String> {
    let value = parse_quantity(text, Dimension::Ratio).map_err(|error| error.to_string())?;
    if value > limits.0 && value < limits.1 {
        Ok(value)
    } else {
        Err(format!(
            "{} % is outside {} to {} %; give {example}",
            100.0 * value,
            100.0 * limits.0,
            100.0 * limits.1
        ))
    }
}

fn accuracy(text: &str) -> Result<f64, String> {
    share(text, (0.0, 1.0), "a share such as \"5 %\" or 0.05")
}

fn damping(text: &str) -> Result<f64, String> {
    share(
        text,
        (0.0, 0.2),
        "a damping ratio such as \"0.3 %\" or 0.003",
    )
}

fn decibels(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if (0.0..=200.0).contains(&value) => Ok(value),
        _ => Err(format!(
            "\"{text}\" is no level; give 0 to 200 dB, such as 60"
        )),
    }
}

/// The arguments, checked.
#[derive(Debug)]
struct Request {
    file: TestFile,
    structure: TestedStructure,
    test: StudiedTest,
    settings: ResolutionSettings,
    png: Option<OutputFile>,
    csv: Option<OutputFile>,
}

fn resolve(
    arguments: &ResolutionArguments,
    seed: u64,
    terminal: &Terminal,
) -> anyhow::Result<Request> {
    let file = read_test(&arguments.test, terminal)?;
    let structure = tested_structure(&file.test);
    let given = arguments.stiffness.given(file.test.joint.kind)?;
    let prepare = |path: &Option<PathBuf>| path.as_deref().map(OutputFile::prepare).transpose();
    let (png, csv) = (prepare(&arguments.png)?, prepare(&arguments.csv)?);
    let joint = match given {
        Some(given) => given,
        None => described_joint(&file, &structure)?,
    };
    let bands: Vec<(f64, f64)> = arguments
        .bands
        .iter()
        .map(|band| (band.low, band.high))
        .collect();
    Ok(Request {
        test: StudiedTest::of_description(&file.test, &structure, joint, &bands),
        settings: settings(arguments, seed),
        file,
        structure,
        png,
        csv,
    })
}

fn settings(arguments: &ResolutionArguments, seed: u64) -> ResolutionSettings {
    let default = ResolutionSettings::default();
    let mut blocks = arguments.blocks.clone();
    blocks.sort_unstable();
    blocks.dedup();
    let windows = arguments.windows.iter();
    let windows: Vec<WindowName> = windows.map(|&w| WindowKind::from(w).into()).collect();
    let asked = |name: &ReadBy| {
        let mut readings = arguments.readings.iter();
        readings.any(|&reading| ReadBy::from(reading) == *name)
    };
    let readings: Vec<ReadBy> = ReadBy::ALL.into_iter().filter(asked).collect();
    let or = |own: Vec<usize>, usual: Vec<usize>| if own.is_empty() { usual } else { own };
    ResolutionSettings {
        blocks: or(blocks, default.blocks),
        windows: if windows.is_empty() {
            default.windows
        } else {
            windows
        },
        readings: if readings.is_empty() {
            default.readings
        } else {
            readings
        },
        draws: arguments.draws,
        fit_draws: arguments.fit_draws.min(arguments.draws),
        damping_ratio: arguments.damping,
        noise_db: arguments.noise,
        accuracy: arguments.accuracy,
        seed,
    }
}

/// The joint that the description gives, or that its frequencies or recordings lead to.
fn described_joint(file: &TestFile, structure: &TestedStructure) -> anyhow::Result<JointStiffness> {
    if structure.assembly == Assembly::Free {
        return Ok(JointStiffness::FREE);
    }
    if let Some(known) = structure.known.over(None) {
        return Ok(known);
    }
    let remedy = "give --kx and --ky, or kt and kr in [joint], or frequencies in [measured]";
    let missing = |why: &str| {
        anyhow!(
            "{}: the joint's stiffness is not known{why}; {remedy}",
            file.name
        )
    };
    if file.test.measured.is_none() && file.test.recordings.is_empty() {
        return Err(missing(""));
    }
    let found = file
        .analyse(&IdentifySettings::unperturbed())?
        .identification;
    let found = found.ok_or_else(|| missing(""))?;
    let joint = found.beam_and_joint(structure).map(|(_, joint)| joint);
    joint.ok_or_else(|| {
        let reason = found.reason.as_deref().unwrap_or("no estimate");
        missing(&format!(" and cannot be estimated ({reason})"))
    })
}

pub(super) fn run(
    arguments: &ResolutionArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let request = resolve(arguments, seed, &terminal)?;
    let study = study_resolution(&request.test, &request.settings, &|done, of| {
        terminal.count("virtual tests", done, of);
    })?;
    if let Some(file) = request.png {
        let picture = render_resolution_picture(&study, file.picture_format())?;
        file.write(&picture)?;
    }
    if let Some(file) = request.csv {
        file.write(render_resolution_csv(&study)?.as_bytes())?;
    }
    let warnings = study.doubts();
    for (_, text) in &warnings {
        terminal.warn(text);
    }
    terminal.say(&render_resolution(&study))?;
    let head = prediction_of(&request.file.test.name, &request.structure, &[]);
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
