//! `tapjoint simulate`: the recordings of a virtual test.

mod laboratory;
mod planted;
mod summary;

use super::Outcome;
use super::arguments::StiffnessArguments;
use super::input::{TestFile, read_model};
use super::output::OutputFolder;
use super::overwrite::Expanded;
use super::signature::CHECKSUMS;
use super::terminal::Terminal;
use super::updated_model::effect_at;
use anyhow::{Context, anyhow};
use clap::Args;
use laboratory::LaboratoryArguments;
use planted::PlantedArgument;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use tapjoint::description::TestDescription;
use tapjoint::effects::Effect;
use tapjoint::recording::{WavFormat, WavLayout, WavStream};
use tapjoint::simulate::{
    Laboratory, TestPlan, VirtualRecording, VirtualTest, nominal_description, plan_test, truth_of,
    wav_name,
};
use tapjoint::structure::JointStiffness;
use tapjoint::study::updated_model::described_effects;

/// Make the recordings of a virtual test: what a laboratory would record of a described structure.
///
/// TEST describes beam, joint (with kt and kr, or --kx and --ky), sensors and recordings. DIR gets the
/// recordings, a test.toml that describes them as a user would believe them (what --with plants is
/// left out, the joint is to be fitted), truth.json, and a list of checksums by which the next
/// `simulate` knows what it may replace.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint simulate test.toml --out virtual --with sensor-mass:mass=24g\n  tapjoint simulate test.toml --out virtual --kx 1400 --ky 4.8 --with joint-nonlinearity:ratio=-0.1,exponent=1 --seed 7\n  tapjoint run virtual/test.toml"
)]
pub(super) struct SimulateArguments {
    /// A test description (.toml); its recordings need not exist
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Folder of the recordings, test.toml and truth.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Plant an effect that the description leaves out, such as sensor-mass:mass=24g; may be given
    /// several times; parameters left out have typical values
    #[arg(long = "with", value_name = "EFFECT:KEY=VALUE,...")]
    effects: Vec<PlantedArgument>,
    /// Write no truth.json: a folder for whoever diagnoses
    #[arg(long)]
    no_truth: bool,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    #[command(flatten)]
    laboratory: LaboratoryArguments,
}

/// The arguments, checked.
struct Request {
    file: TestFile,
    text: String,
    output: OutputFolder,
    effects: Vec<Effect>,
    laboratory: Laboratory,
    format: WavFormat,
    joint: Option<JointStiffness>,
}

fn resolve(arguments: &SimulateArguments, terminal: &Terminal) -> anyhow::Result<Request> {
    let file = read_model(&arguments.test, terminal)?;
    let text = fs::read_to_string(&arguments.test)
        .with_context(|| format!("{}: cannot be read", file.name))?;
    let given = arguments.stiffness.given(file.test.joint.kind)?;
    let laboratory = arguments.laboratory.resolve()?;
    Ok(Request {
        output: OutputFolder::prepare(&arguments.out)?,
        effects: described_effects(&file.test)
            .map_err(|error| effect_at(&file.name, &error))?
            .into_iter()
            .chain(arguments.effects.iter().map(|planted| planted.0.clone()))
            .collect(),
        format: match laboratory.recorder.bits {
            16 => WavFormat::Pcm16,
            24 => WavFormat::Pcm24,
            _ => WavFormat::Float32,
        },
        joint: given,
        laboratory,
        file,
        text,
    })
}

/// Name of the description beside the recordings.
const DESCRIPTION: &str = "test.toml";
/// Name of the file with what was planted.
const TRUTH: &str = "truth.json";

impl SimulateArguments {
    /// Returns the files of the virtual test.
    pub(super) fn expanded(&self, test: Option<&TestDescription>) -> Vec<Expanded> {
        let recordings = test.into_iter().flat_map(|test| &test.recordings);
        // A recording that is described twice, in two bands perhaps, is one file.
        let mut names: BTreeSet<String> = recordings.map(wav_name).collect();
        names.extend([DESCRIPTION, CHECKSUMS].map(str::to_owned));
        if !self.no_truth {
            names.insert(TRUTH.to_owned());
        }
        vec![(
            "out",
            names.iter().map(|name| self.out.join(name)).collect(),
        )]
    }
}

pub(super) fn run(
    arguments: &SimulateArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let request = resolve(arguments, &terminal)?;
    let plan = TestPlan {
        description: &request.file.test,
        effects: &request.effects,
        laboratory: &request.laboratory,
        joint: request.joint,
        seed,
    };
    let test = plan_test(&plan).map_err(|error| anyhow!("{}: {error}", request.file.name))?;
    let truth = truth_of(&plan, &test);
    let clipped = record(&request, &test)?;
    let believed = nominal_description(&request.text, &request.file.test, &test)?;
    request.output.add(DESCRIPTION, believed.as_bytes())?;
    if !arguments.no_truth {
        let mut text = serde_json::to_string_pretty(&truth)?;
        text.push('\n');
        request.output.add(TRUTH, text.as_bytes())?;
    }
    for (recording, clipped) in test.recordings.iter().zip(&clipped) {
        if *clipped > 0 {
            terminal.warn(&format!(
                "{}: {clipped} samples lie beyond full scale and are clipped; give a larger `scale`, or a lower --level",
                recording.file
            ));
        }
    }
    let folder = request.output.publish(terminal.files())?;
    terminal.say(&summary::summary(&truth, &test, &folder))?;
    terminal.write_json(&serde_json::json!({ "truth": truth }))?;
    Ok(Outcome::Answered)
}

/// Writes all recordings and returns how many samples of each were clipped.
fn record(request: &Request, test: &VirtualTest) -> anyhow::Result<Vec<u64>> {
    test.recordings
        .par_iter()
        .map(|recording| {
            let path = request.output.place_of(&recording.file);
            let written = write(recording, &request.laboratory, &path, request.format);
            written.with_context(|| format!("{}: could not be written", recording.file))
        })
        .collect()
}

fn write(
    recording: &VirtualRecording,
    laboratory: &Laboratory,
    path: &Path,
    format: WavFormat,
) -> anyhow::Result<u64> {
    let mut run = recording.begin(laboratory);
    let layout = WavLayout {
        sample_rate: recording.plan.sample_rate,
        channels: recording.plan.channels.len(),
        frames: recording.plan.frames,
        format,
    };
    let mut stream = WavStream::create(path, layout)?;
    let mut frame = vec![0.0; layout.channels];
    while run.next_frame(&mut frame) {
        stream.write(&frame)?;
    }
    Ok(stream.finish()?)
}
