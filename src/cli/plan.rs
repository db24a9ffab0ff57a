//! `tapjoint plan`: before anything is measured, which effects a test could tell apart.

use super::Outcome;
use super::input::read_test;
use super::output::OutputFile;
use super::terminal::Terminal;
use anyhow::Context;
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;
use tapjoint::report::blind_check::{render_confusion_picture, score_json, tell_apart};
use tapjoint::structure::JointStiffness;
use tapjoint::study::blind_check::score;
use tapjoint::study::plan::{PlanSettings, judge_plan};

/// Before measuring: which effects this test could tell apart.
///
/// Recordings, sensors, taps and levels are those of the description; the files need not be there.
/// Effects of every kind are drawn, observed as planned, and diagnosed; the table counts what came
/// first.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint plan test.toml --modes 7 --std 0.02")]
pub(super) struct PlanArguments {
    /// A test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Tests drawn for each kind of effect
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    draws: usize,
    /// Modes that will be observed
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = RangedU64ValueParser::<usize>::new().range(2..=12))]
    modes: usize,
    /// Standard uncertainty of a frequency (%)
    #[arg(long, value_name = "P", default_value_t = 0.03)]
    std: f64,
    /// Kx of a joint that the description does not state
    #[arg(long, value_name = "K", requires = "ky")]
    kx: Option<f64>,
    /// Ky likewise
    #[arg(long, value_name = "K", requires = "kx")]
    ky: Option<f64>,
    /// Picture of the table; SVG where the name ends in .svg
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
}

pub(super) fn run(
    arguments: &PlanArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = read_test(&arguments.test, &terminal)?;
    let positive = |name: &str, value: f64| {
        anyhow::ensure!(
            value > 0.0 && value.is_finite(),
            "{name} {value}: give a positive number"
        );
        Ok(value)
    };
    let png = arguments
        .png
        .as_deref()
        .map(OutputFile::prepare)
        .transpose()?;
    let settings = PlanSettings {
        draws: arguments.draws,
        modes: arguments.modes,
        frequency_std: 0.01 * positive("--std", arguments.std)?,
        joint: match (arguments.kx, arguments.ky) {
            (Some(kx), Some(ky)) => Some(JointStiffness::two_parameter(
                positive("--kx", kx)?,
                positive("--ky", ky)?,
            )),
            _ => None,
        },
        seed,
        ..PlanSettings::default()
    };
    let progress = |done, of| terminal.count("tests diagnosed", done, of);
    let cases = judge_plan(&file.test, &settings, &progress).with_context(|| file.name.clone())?;
    terminal.say(&tell_apart(&cases))?;
    if let Some(png) = png {
        let picture = render_confusion_picture(&cases, png.picture_format())?;
        png.write(&picture)?;
    }
    terminal.write_json(&score_json(&score(&cases)))?;
    Ok(Outcome::Answered)
}
