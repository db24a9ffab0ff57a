//! `tapjoint plan`: the effects that a planned test could distinguish.

use super::Outcome;
use super::arguments::StiffnessArguments;
use super::input::read_test;
use super::output::OutputFile;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::JointModel;
use crate::pipeline::{Stage, Work};
use crate::report::blind_check::{render_confusion_picture, score_json, tell_apart};
use crate::study::blind_check::{Conduct, score};
use crate::study::plan::{PlanSettings, judge_plan};
use anyhow::{Context, ensure};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;

/// Show which effects a planned test could distinguish.
///
/// Run it before anything is measured. Recordings, sensors, taps and levels are those of the description. The recordings need not exist.
/// Virtual tests with effects of every kind are drawn, observed as planned, and diagnosed. The table
/// counts the first answer of each diagnosis. --kx and --ky are finite here, from 1e-6 on.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  tapjoint plan test.toml --modes 7 --std 0.02")]
pub(super) struct PlanArguments {
    /// Test description (.toml)
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Number of virtual tests for each kind of effect
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    draws: usize,
    /// Number of modes that will be observed
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = RangedU64ValueParser::<usize>::new().range(2..=12))]
    modes: usize,
    /// Standard uncertainty of a frequency (%)
    #[arg(long, value_name = "P", default_value_t = 0.03)]
    std: f64,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    /// Draw the table into this file (PNG, or SVG if its name ends in .svg)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

/// Largest standard uncertainty of a frequency (%). With a larger one no effect could be distinguished.
const MOST_STD: f64 = 10.0;

pub(super) fn run(
    arguments: &PlanArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let file = read_test(&arguments.test, &terminal)?;
    let std = arguments.std;
    ensure!(
        std > 0.0 && std <= MOST_STD,
        "--std {std}: give percent above 0, at most {MOST_STD}"
    );
    let png = OutputFile::prepare_optional(arguments.png.as_deref())?;
    let mut test = file.test.clone();
    // A test cannot observe a rigid joint.
    let joint = arguments
        .stiffness
        .given_within(test.joint.kind, f64::MAX)?;
    let coupled = joint.is_some_and(|joint| joint.cross_compliance != 0.0);
    ensure!(
        !coupled || test.joint.model == JointModel::ThreeParameter,
        "--kz is of a joint of three stiffnesses; write model = \"3p\" into [joint], or leave it out"
    );
    if joint.is_some() {
        // It replaces the described joint.
        (test.joint.kt, test.joint.kr, test.joint.ktr) = (None, None, None);
    }
    let settings = PlanSettings {
        draws: arguments.draws,
        modes: arguments.modes,
        frequency_std: 0.01 * std,
        joint,
        seed,
        ..PlanSettings::default()
    };
    let work = Work::begin(terminal.watch(), Stage::Study);
    let cases = judge_plan(&test, &settings, &|done, of| {
        terminal.count("tests diagnosed", done, of);
    })
    .with_context(|| file.name.clone())?;
    drop(work);
    terminal.say(&tell_apart(&cases))?;
    if let Some(png) = png {
        let _work = Work::begin(terminal.watch(), Stage::Pictures);
        let picture = render_confusion_picture(&cases, png.picture_format())?;
        png.write(&picture)?;
    }
    terminal.write_json(&score_json(&score(&cases), &Conduct::default()))?;
    Ok(Outcome::Answered)
}
