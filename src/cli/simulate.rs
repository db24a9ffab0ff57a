//! `tapjoint simulate`: the recordings of a virtual test.

use super::Outcome;
use super::arguments::StiffnessArguments;
use super::input::read_model;
use super::laboratory::LaboratoryArguments;
use super::output::OutputFolder;
use super::overwrite::Expanded;
use super::signature::CHECKSUMS;
use super::terminal::Terminal;
use super::updated_model::effect_at;
use anyhow::{Context, anyhow};
use clap::Args;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use tapjoint::description::TestDescription;
use tapjoint::effects::{self, Effect, EffectId};
use tapjoint::quantity::{Dimension, parse_quantity};
use tapjoint::recording::{WavFormat, WavLayout, WavStream};
use tapjoint::report::format::with_minus_signs;
use tapjoint::report::text::wrapped;
use tapjoint::simulate::{
    AntiAlias, Damping, JointTruth, Laboratory, RecordingTruth, TestPlan, Truth, VirtualRecording,
    VirtualTest, nominal_description, plan_test, truth_of, wav_name,
};
use tapjoint::study::updated_model::described_effects;

/// Make the recordings of a virtual test.
///
/// They are what a laboratory would record of the described structure. TEST describes beam, joint (with kt and kr, or --kx and --ky), sensors and recordings. The output
/// folder gets the recordings, a test.toml and truth.json. The test.toml describes the test as an analyst
/// knows it: effects of --with are left out, and the joint is to be fitted. A list of checksums lets the
/// next `tapjoint simulate` replace these files.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint simulate test.toml --out virtual --with sensor-mass:mass=24g\n  tapjoint simulate test.toml --out virtual --kx 1400 --ky 4.8 --with joint-nonlinearity:ratio=-0.1,exponent=1 --seed 7\n  tapjoint run virtual/test.toml"
)]
pub(super) struct SimulateArguments {
    /// Test description (.toml); its recordings need not exist
    #[arg(value_name = "TEST")]
    test: PathBuf,
    /// Folder of the recordings, test.toml and truth.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Add an effect that the description leaves out, such as sensor-mass:mass=24g. Missing parameters
    /// have typical values. Repeat it for more effects
    #[arg(long = "with", value_name = "EFFECT:KEY=VALUE,...", value_parser = effect)]
    effects: Vec<Effect>,
    /// Write no truth.json, so that the folder does not reveal the effects
    #[arg(long)]
    no_truth: bool,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    #[command(flatten)]
    laboratory: LaboratoryArguments,
}

/// Parses `EFFECT:key=value,...`.
fn effect(text: &str) -> Result<Effect, String> {
    let (name, parameters) = text.split_once(':').unwrap_or((text, ""));
    let id = EffectId::parse(name.trim()).map_err(|error| error.to_string())?;
    let parts = parameters.split(',').filter(|part| !part.trim().is_empty());
    let pairs = parts
        .map(|part| parameter(id, part))
        .collect::<Result<Vec<_>, _>>()?;
    Effect::from_pairs(id, &pairs).map_err(|error| error.to_string())
}

/// Parses `key=value` of an effect.
fn parameter(id: EffectId, text: &str) -> Result<(&str, f64), String> {
    let Some((key, value)) = text.split_once('=') else {
        let example: Vec<String> = id
            .parameters()
            .iter()
            .map(|info| format!("{}={}", info.name, info.typical.unwrap_or(1.0)))
            .collect();
        return Err(format!(
            "\"{}\" has no value; write {name}:key=value, such as {name}:{}",
            text.trim(),
            example.join(","),
            name = id.name()
        ));
    };
    let (key, value) = (key.trim(), value.trim());
    let info = id.parameter(key).map_err(|error| error.to_string())?;
    let dimension = match info.dimension {
        effects::Dimension::None => Dimension::Ratio,
        effects::Dimension::Mass => Dimension::Mass,
        effects::Dimension::Stiffness => Dimension::TranslationalStiffness,
        effects::Dimension::Frequency => Dimension::Frequency,
        effects::Dimension::Length => Dimension::Length,
        effects::Dimension::Force => Dimension::Force,
        // Inertias have no unit on the command line.
        effects::Dimension::Inertia => {
            let number = value.parse();
            let number = number.map_err(|_| format!("{key}: \"{value}\" is not a number"));
            return Ok((key, number?));
        }
    };
    let number = parse_quantity(value, dimension).map_err(|error| error.to_string());
    Ok((key, number?))
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
    let file = read_model(&arguments.test, &terminal)?;
    let text = fs::read_to_string(&arguments.test)
        .with_context(|| format!("{}: cannot be read", file.name))?;
    let given = arguments.stiffness.given(file.test.joint.kind)?;
    let laboratory = arguments.laboratory.resolve()?;
    let output = OutputFolder::prepare(&arguments.out)?;
    let mut effects =
        described_effects(&file.test).map_err(|error| effect_at(&file.name, &error))?;
    effects.extend(arguments.effects.iter().cloned());
    let plan = TestPlan {
        description: &file.test,
        effects: &effects,
        laboratory: &laboratory,
        joint: given,
        seed,
    };
    let test = plan_test(&plan).map_err(|error| anyhow!("{}: {error}", file.name))?;
    let truth = truth_of(&plan, &test);
    let clipped = test
        .recordings
        .par_iter()
        .map(|recording| {
            write_recording(recording, &laboratory, &output.place_of(&recording.file))
                .with_context(|| format!("{}: could not be written", recording.file))
        })
        .collect::<anyhow::Result<Vec<u64>>>()?;
    let believed = nominal_description(&text, &file.test, &test)?;
    output.add(DESCRIPTION, believed.as_bytes())?;
    if !arguments.no_truth {
        let mut text = serde_json::to_string_pretty(&truth)?;
        text.push('\n');
        output.add(TRUTH, text.as_bytes())?;
    }
    for (recording, clipped) in test.recordings.iter().zip(&clipped) {
        if *clipped > 0 {
            terminal.warn(&format!(
                "{}: {clipped} samples lie beyond full scale and are clipped; give a larger `scale`, or a lower --level",
                recording.file
            ));
        }
    }
    let folder = output.publish(terminal.files())?;
    terminal.say(&summary(&truth, &test, &folder))?;
    terminal.write_json(&serde_json::json!({ "truth": truth }))?;
    Ok(Outcome::Answered)
}

/// Writes a recording and returns the number of clipped samples.
fn write_recording(
    recording: &VirtualRecording,
    laboratory: &Laboratory,
    path: &Path,
) -> anyhow::Result<u64> {
    let mut run = recording.begin(laboratory);
    let layout = WavLayout {
        sample_rate: recording.plan.sample_rate,
        channels: recording.plan.channels.len(),
        frames: recording.plan.frames,
        format: match laboratory.recorder.bits {
            16 => WavFormat::Pcm16,
            24 => WavFormat::Pcm24,
            _ => WavFormat::Float32,
        },
    };
    let mut stream = WavStream::create(path, layout)?;
    let mut frame = vec![0.0; layout.channels];
    while run.next_frame(&mut frame) {
        stream.write(&frame)?;
    }
    Ok(stream.finish()?)
}

/// Describes the virtual test: recordings, joint, planted effects and laboratory.
fn summary(truth: &Truth, test: &VirtualTest, folder: &Path) -> String {
    let mut text = format!(
        "Virtual test of \"{}\" in {}\n\n",
        truth.name,
        folder.display()
    );
    for (recording, made) in truth.recordings.iter().zip(&test.recordings) {
        let line = recording_line(recording, made.plan.taps.pulse_length);
        text.push_str(&wrapped(&line, 2));
    }
    if let Some(joint) = &truth.joint {
        text.push('\n');
        text.push_str(&wrapped(&joint_line(joint), 2));
    }
    if truth.effects.is_empty() {
        text.push_str("Nothing planted: the description is the truth\n");
    }
    for effect in &truth.effects {
        let id = EffectId::ALL.iter().find(|id| id.name() == effect.effect);
        let mut values = Vec::new();
        for (name, value) in &effect.parameters {
            let info = id.and_then(|id| id.parameters().iter().find(|info| info.name == *name));
            let unit = info.map_or("", |info| info.dimension.unit());
            values.push(format!("{name} {value} {unit}").trim_end().to_owned());
        }
        let line = format!("Planted: {} ({})", effect.effect, values.join(", "));
        text.push_str(&with_minus_signs(&wrapped(&line, 2)));
    }
    text.push_str("\nLaboratory\n");
    for (name, value) in laboratory_lines(&truth.laboratory) {
        let _ = writeln!(text, "  {name:<18} {value}");
    }
    text
}

fn recording_line(recording: &RecordingTruth, pulse: f64) -> String {
    let modes = recording.modes.iter().take(6);
    let modes: Vec<String> = modes.map(|mode| format!("{:.3}", mode.frequency)).collect();
    let more = if recording.modes.len() > 6 {
        " ..."
    } else {
        ""
    };
    format!(
        "{}: {:.1} s at {} Hz, {} channels, {} taps (level {}, pulses of {} ms); modes at rest: {}{more} Hz",
        recording.file,
        recording.seconds,
        recording.sample_rate,
        recording.gains.len(),
        recording.taps.len(),
        recording.level,
        1e3 * pulse,
        modes.join(" ")
    )
}

fn joint_line(joint: &JointTruth) -> String {
    let [kt, kr] = [(joint.kt, "N/m"), (joint.kr, "N m/rad")].map(|(value, unit)| match value {
        Some(value) => format!("{value:.6e} {unit}"),
        None => "rigid".to_owned(),
    });
    let mut text = format!("Joint: Kt {kt}, Kr {kr}");
    if let (Some(kx), Some(ky)) = (joint.kx, joint.ky) {
        let _ = write!(text, " (Kx {kx:.6}, Ky {ky:.6})");
    }
    if let Some(ktr) = joint.ktr {
        let _ = write!(text, ", Ktr {ktr:.6e} N/rad");
    }
    text
}

/// Returns the parts of the laboratory with their values, `off` for a part that is left out.
fn laboratory_lines(laboratory: &Laboratory) -> Vec<(&'static str, String)> {
    let Laboratory {
        hammer,
        sensors,
        recorder,
        specimen,
    } = laboratory;
    let good_sensors = "times 0.003 m/s2, 2e-6 m/s, 1e-7 m, 0.005 N (rms)";
    let filter = match recorder.anti_alias {
        AntiAlias::On => "flat to rate/2.56".to_owned(),
        AntiAlias::Off => "off".to_owned(),
    };
    let hum = format!("of full scale at {} Hz", recorder.mains);
    let damping = match &specimen.damping {
        Damping::Modal(ratios) => {
            let ratios: Vec<String> = ratios
                .iter()
                .map(|ratio| format!("{:.3}", 100.0 * ratio))
                .collect();
            format!("{} % (the last for all beyond)", ratios.join(", "))
        }
        Damping::Rayleigh { mass, stiffness } => {
            format!("{mass} 1/s of mass, {stiffness} s of stiffness")
        }
    };
    vec![
        ("hammer", format!("{} N at level 1", hammer.peak_force)),
        ("scatter of level", percent(hammer.level_scatter)),
        ("scatter of length", percent(hammer.length_scatter)),
        ("scatter of place", or_off(1e3 * hammer.place_scatter, "mm")),
        ("double hits", percent(hammer.double_hits)),
        ("weak hits", percent(hammer.weak_hits)),
        ("lead", format!("{} s", hammer.lead)),
        ("noise", or_off(sensors.noise, good_sensors)),
        ("sensitivities", percent(sensors.sensitivity_error)),
        ("AC coupling", or_off(sensors.ac_coupling, "Hz")),
        ("mounting", or_off(sensors.mounting_resonance, "Hz")),
        ("anti-alias filter", filter),
        ("bits", recorder.bits.to_string()),
        ("mains hum", small_or_off(recorder.hum, &hum)),
        ("drift", small_or_off(recorder.drift, "of full scale")),
        ("offset", small_or_off(recorder.offset, "of full scale")),
        (
            "clock",
            match recorder.clock_error {
                0.0 => "off".to_owned(),
                error => format!("{error:+e}"),
            },
        ),
        ("damping", damping),
    ]
}

fn percent(value: f64) -> String {
    or_off(100.0 * value, "%")
}

fn or_off(value: f64, unit: &str) -> String {
    match value {
        0.0 => "off".to_owned(),
        value => format!("{value} {unit}"),
    }
}

/// Writes a small value with an exponent.
fn small_or_off(value: f64, unit: &str) -> String {
    match value {
        0.0 => "off".to_owned(),
        value => format!("{value:e} {unit}"),
    }
}
