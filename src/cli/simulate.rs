//! `tapjoint simulate`: the recordings of a virtual test, or of two between which something changed.

use super::Outcome;
use super::arguments::{StiffnessArguments, percent, repeatability};
use super::input::{effect_at, read_model, read_text};
use super::laboratory::{LaboratoryArguments, laboratory_lines};
use super::overwrite::{CHECKSUMS, Expanded, listed_files};
use super::publication::OutputFolder;
use super::terminal::{Terminal, screen};
use super::timings::TimingsArguments;
use crate::description::TestDescription;
use crate::effects::{Effect, EffectDimension, EffectId};
use crate::quantity::{Dimension, parse_quantity};
use crate::recording::{WavFormat, WavLayout, WavStream};
use crate::report::format::with_minus_signs;
use crate::simulate::{
    Change, Laboratory, TestPlan, Truth, VirtualRecording, VirtualTest, nominal_description,
    plan_test, truth_of, wav_name,
};
use crate::study::change_check::PlantedChange;
use crate::study::updated_model::described_effects;
use anyhow::{Context, anyhow, bail};
use clap::Args;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

const EXAMPLES: &str = "Examples:
  tapjoint simulate test.toml --out virtual --with sensor-mass:mass=24g
  tapjoint simulate test.toml --out virtual --with sensor-position:offset=8mm,sensor=2,recording=1
  tapjoint simulate test.toml --out virtual --kx 1400 --ky 4.8 --with joint-nonlinearity:ratio=-0.1,exponent=1 --seed 7
  tapjoint run virtual/test.toml
  tapjoint simulate test.toml --out pair --change joint-change:kt=-10%,kr=5% --repeatability 0.1%
  tapjoint compare pair/before/test.toml pair/after/test.toml";

const CHANGES: &str = "Changes:
  joint-change:kt=-10%,kr=5%: relative changes of the joint's stiffnesses; its coupling stays
  lost-mass:item=L3: the mass of a sensor or of a fastened mass with this name is gone; a sensor still gives its signal
  added-mass, local-crack, length, modulus, sensor-position, axial-load: as the effects above, after the change only

";

/// Returns the effects with their parameters and typical values, and the examples.
fn list_of_effects() -> String {
    let mut text = "Effects, with the values of parameters that are not given:\n".to_owned();
    let possible = EffectId::ALL.into_iter();
    for id in possible.filter(|id| *id != EffectId::Resolution) {
        let mut parameters = Vec::new();
        for info in id.parameters() {
            let (name, unit) = (info.name, info.dimension.unit());
            let value = info.typical.map_or_else(
                || format!("{name} must be given ({unit})"),
                |typical| format!("{name}={typical} {unit}"),
            );
            parameters.push(value.trim_end().to_owned());
        }
        let _ = writeln!(text, "  {}: {}", id.name(), id.meaning());
        let _ = writeln!(text, "      {}", parameters.join(", "));
    }
    text + "\nSensors and recordings are numbered from 1, as in TEST. For sensor-scale, sensor=0 means all sensors. recording=0 \
            means all recordings. Any other number means all recordings with the same described place. An error of \
            the set-up does not change the places in the new test.toml.\n\n"
        + CHANGES
        + EXAMPLES
}

/// Make the recordings of a virtual test.
///
/// They are what a laboratory would record of the described structure. TEST describes beam, joint (with kt and kr, or --kx and --ky), sensors and recordings. The output
/// folder gets the recordings, a test.toml and truth.json. The test.toml describes the test as an analyst
/// knows it: effects of --with are left out, and the joint is to be fitted. A list of checksums lets the
/// next `tapjoint simulate` replace these files. With --change there are two such tests, in the folders before and after,
/// and truth.json lies beside them.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, after_long_help = list_of_effects())]
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
    /// Make two tests, before and after a change that no description knows, such as joint-change:kt=-10%. Effects of
    /// --with are in both tests. Noise, taps and errors of the sensors are drawn for each test. Repeat it for more changes at
    /// once
    #[arg(long = "change", value_name = "KIND:KEY=VALUE,...", value_parser = change)]
    changes: Vec<Change>,
    /// Standard deviation of the difference of a frequency between the two tests, such as "0.1 %"; default: 0. The natural frequency
    /// of each mode is scattered, by a normal distribution. A quarter of the variance is common to all modes of a
    /// test
    #[arg(long, value_name = "R", value_parser = repeatability, requires = "changes")]
    repeatability: Option<f64>,
    /// Write no truth.json, so that the folder does not reveal the effects
    #[arg(long)]
    no_truth: bool,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    #[command(flatten)]
    laboratory: LaboratoryArguments,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
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

/// Parses `KIND:key=value,...` of a change.
fn change(text: &str) -> Result<Change, String> {
    let (name, parameters) = text.split_once(':').unwrap_or((text, ""));
    match name.trim() {
        Change::JOINT => joint_change(parameters),
        Change::LOST_MASS => match parameters.split_once('=') {
            Some((key, item)) if key.trim() == "item" && !item.trim().is_empty() => {
                let item = item.trim().to_owned();
                Ok(Change::LostMass { item })
            }
            _ => Err(
                "write lost-mass:item=NAME, with the name of a sensor or of a fastened mass"
                    .to_owned(),
            ),
        },
        name => {
            let known = Change::EFFECTS.map(EffectId::name);
            if !known.contains(&name) {
                return Err(format!(
                    "`{name}` is no change between two tests; changes are: {}, {}, {}",
                    Change::JOINT,
                    Change::LOST_MASS,
                    known.join(", ")
                ));
            }
            effect(text).map(Change::Effect)
        }
    }
}

/// Range of a relative change of a stiffness (1).
const JOINT_CHANGE: [f64; 2] = [-0.99, 100.0];

/// Parses the parameters of a change of the joint.
fn joint_change(parameters: &str) -> Result<Change, String> {
    let example = "such as joint-change:kt=-10%,kr=5%";
    let [mut kt, mut kr] = [None; 2];
    for part in parameters.split(',').filter(|part| !part.trim().is_empty()) {
        let Some((key, value)) = part.split_once('=') else {
            return Err(format!(
                "\"{}\" has no value; write key=value, {example}",
                part.trim()
            ));
        };
        let size = match key.trim() {
            "kt" => &mut kt,
            "kr" => &mut kr,
            key => {
                return Err(format!(
                    "`joint-change` has no parameter `{key}`; it has: kt, kr"
                ));
            }
        };
        let [lowest, highest] = JOINT_CHANGE;
        let value = parse_quantity(value.trim(), Dimension::Ratio)
            .map_err(|error| format!("{}: {error}", key.trim()))?;
        if !(lowest..=highest).contains(&value) {
            return Err(format!(
                "{}: give {} % to {} %",
                key.trim(),
                100.0 * lowest,
                100.0 * highest
            ));
        }
        if size.replace(value).is_some() {
            return Err(format!(
                "`joint-change` is given `{}` twice; give it once",
                key.trim()
            ));
        }
    }
    if kt.is_none() && kr.is_none() {
        return Err(format!("`joint-change` needs kt, kr or both, {example}"));
    }
    Ok(Change::Joint {
        kt: kt.unwrap_or(0.0),
        kr: kr.unwrap_or(0.0),
    })
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
        EffectDimension::None => Dimension::Ratio,
        EffectDimension::Mass => Dimension::Mass,
        EffectDimension::Stiffness => Dimension::TranslationalStiffness,
        EffectDimension::Frequency => Dimension::Frequency,
        EffectDimension::Length => Dimension::Length,
        EffectDimension::Force => Dimension::Force,
        // Inertias have no unit on the command line.
        EffectDimension::Inertia => {
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
/// Folders of the tests before and after a change.
pub(super) const SIDES: [&str; 2] = ["before", "after"];

impl SimulateArguments {
    /// Returns the files of the virtual test.
    pub(super) fn expanded(&self, test: Option<&TestDescription>) -> Vec<Expanded> {
        let recordings = test.into_iter().flat_map(|test| &test.recordings);
        // A recording that is described twice, in two bands perhaps, is one file.
        let mut names: BTreeSet<String> = recordings.map(wav_name).collect();
        names.insert(DESCRIPTION.to_owned());
        if !self.changes.is_empty() {
            let sides = SIDES.iter();
            names = sides
                .flat_map(|side| names.iter().map(move |name| format!("{side}/{name}")))
                .collect();
        }
        names.insert(CHECKSUMS.to_owned());
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
    let text = read_text(&arguments.test, &terminal)?;
    let given = arguments.stiffness.given(file.test.joint.kind)?;
    let laboratory = arguments.laboratory.resolve()?;
    if !arguments.changes.is_empty() {
        for place in SIDES.map(|side| arguments.out.join(side)) {
            if place.exists() && !place.is_dir() {
                bail!(
                    "{}: is a file, but a folder is needed for one of the two tests; move it away, or give another --out",
                    place.display()
                );
            }
        }
    }
    let output = OutputFolder::prepare(&arguments.out, terminal.files())?;
    let mut effects =
        described_effects(&file.test).map_err(|error| effect_at(&file.name, &error))?;
    effects.extend(arguments.effects.iter().cloned());
    let plan = TestPlan {
        description: &file.test,
        effects: &effects,
        changes: &[],
        repeatability: arguments.repeatability.unwrap_or(0.0),
        laboratory: &laboratory,
        joint: given,
        seed,
    };
    let described = Described {
        text: &text,
        name: &file.name,
    };
    if !arguments.changes.is_empty() {
        return run_pair(arguments, &plan, &described, output, terminal);
    }
    let made = Made::plan("", &plan, &described)?;
    record(std::slice::from_ref(&made), &laboratory, &output, &terminal)?;
    if !arguments.no_truth {
        output.add(TRUTH, &lines_of(&serde_json::to_value(&made.truth)?)?)?;
    }
    let stale = earlier_files(&output);
    let (folder, left) = output.publish_without(stale)?;
    let nothing = "Nothing planted: the description is the truth";
    terminal.say(&summary(&made, &folder, nothing))?;
    terminal.write_json(&serde_json::json!({ "truth": made.truth }))?;
    left.map_or(Ok(Outcome::Answered), Err)
}

/// Makes the tests before and after a change.
fn run_pair(
    arguments: &SimulateArguments,
    plan: &TestPlan<'_>,
    described: &Described<'_>,
    output: OutputFolder,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    // The seed of one test is not that of another pair.
    let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
    let before = TestPlan {
        seed: random.next_u64(),
        ..plan.clone()
    };
    let after = TestPlan {
        seed: random.next_u64(),
        changes: &arguments.changes,
        ..plan.clone()
    };
    let made = [
        Made::plan(SIDES[0], &before, described)?,
        Made::plan(SIDES[1], &after, described)?,
    ];
    for side in SIDES {
        fs::create_dir_all(output.place_of(side))?;
    }
    record(&made, plan.laboratory, &output, &terminal)?;
    let changes: Vec<PlantedChange> = arguments
        .changes
        .iter()
        .map(|change| PlantedChange::of_test(change, plan.description))
        .collect();
    let [before, after] = &made;
    let truth = serde_json::json!({
        "version": before.truth.version,
        "name": before.truth.name,
        "seed": plan.seed,
        "changes": changes,
        "repeatability": arguments.repeatability,
        "before": before.truth,
        "after": after.truth,
    });
    if !arguments.no_truth {
        output.add(TRUTH, &lines_of(&truth)?)?;
    }
    let stale = earlier_files(&output);
    let (folder, left) = output.publish_without(stale)?;
    let nothing = "Nothing planted before the change";
    let mut text = summary(before, &folder.join(SIDES[0]), nothing);
    let _ = writeln!(
        text,
        "\nAfter the change, in {}\n",
        folder.join(SIDES[1]).display()
    );
    text.push_str(&recording_lines(&after.truth, &after.test));
    for change in changes {
        let sizes = change.parameters.iter();
        let sizes = sizes.map(|(name, value)| match name.as_str() {
            "kt" | "kr" | "relative" => format!("{name} {} %", percent(*value)),
            "mass" => format!("{name} {value} kg"),
            "position" | "sensor_shift" => format!("{name} {value} m"),
            "force" => format!("{name} {value} N"),
            _ => format!("{name} {value}"),
        });
        let values: Vec<String> = change.item.iter().cloned().chain(sizes).collect();
        let line = format!("Changed: {} ({})", change.cause, values.join(", "));
        text.push_str(&with_minus_signs(&screen().wrapped(&line, 2)));
    }
    let scatter = percent(plan.repeatability);
    let _ = writeln!(text, "Repeatability: {scatter} %");
    terminal.say(&text)?;
    terminal.write_json(&serde_json::json!({ "truth": truth }))?;
    left.map_or(Ok(Outcome::Answered), Err)
}

/// Returns the files of earlier virtual tests in the folder, of one test or of a pair.
fn earlier_files(output: &OutputFolder) -> Vec<String> {
    let list = output.earlier(CHECKSUMS).unwrap_or_default();
    let mut files = listed_files(&list);
    files.retain(|name| {
        let own = SIDES
            .iter()
            .find_map(|side| name.strip_prefix(side)?.strip_prefix('/'))
            .unwrap_or(name);
        !own.contains('/') && (own == DESCRIPTION || own == TRUTH || own.ends_with(".wav"))
    });
    files
}

/// A description as it was read.
struct Described<'a> {
    text: &'a str,
    /// Its file.
    name: &'a str,
}

/// A test ready to be recorded.
struct Made {
    /// Folder in the output folder; empty for the output folder itself.
    folder: &'static str,
    test: VirtualTest,
    truth: Truth,
    /// The description as an analyst knows it.
    believed: String,
}

impl Made {
    fn plan(
        folder: &'static str,
        plan: &TestPlan<'_>,
        described: &Described<'_>,
    ) -> anyhow::Result<Self> {
        let test = plan_test(plan).map_err(|error| anyhow!("{}: {error}", described.name))?;
        Ok(Self {
            folder,
            truth: truth_of(plan, &test),
            believed: nominal_description(described.text, plan.description, &test)?,
            test,
        })
    }

    /// Returns the name of one of its files in the output folder.
    fn named(&self, file: &str) -> String {
        match self.folder {
            "" => file.to_owned(),
            folder => format!("{folder}/{file}"),
        }
    }
}

/// Writes recordings and descriptions of these tests.
fn record(
    tests: &[Made],
    laboratory: &Laboratory,
    output: &OutputFolder,
    terminal: &Terminal,
) -> anyhow::Result<()> {
    let recordings = tests
        .iter()
        .flat_map(|made| made.test.recordings.iter().map(move |one| (made, one)));
    let recordings: Vec<(&Made, &VirtualRecording)> = recordings.collect();
    let all: Vec<&VirtualRecording> = recordings.iter().map(|(_, one)| *one).collect();
    check_sizes(&all, laboratory, output.place_of(DESCRIPTION).parent())?;
    let seconds = all.iter().map(|one| seconds_of(one)).sum();
    let done = AtomicUsize::new(0);
    let clipped = recordings
        .par_iter()
        .map(|(made, recording)| {
            let name = made.named(&recording.file);
            let progress = Progress {
                terminal,
                done: &done,
                of: seconds,
            };
            write_recording(recording, laboratory, &output.place_of(&name), &progress)
                .with_context(|| format!("{name}: could not be written"))
        })
        .collect::<anyhow::Result<Vec<u64>>>()?;
    for made in tests {
        output.add(&made.named(DESCRIPTION), made.believed.as_bytes())?;
    }
    for ((made, recording), clipped) in recordings.iter().zip(&clipped) {
        if *clipped > 0 {
            terminal.warn(&format!(
                "{}: {clipped} samples lie beyond full scale and are clipped; give a larger `scale`, or a lower --level",
                made.named(&recording.file)
            ));
        }
    }
    Ok(())
}

/// Returns a value as JSON with a line feed at the end.
fn lines_of(value: &serde_json::Value) -> anyhow::Result<Vec<u8>> {
    let mut text = serde_json::to_vec_pretty(value)?;
    text.push(b'\n');
    Ok(text)
}

/// Refuses recordings that do not fit into WAV files, or into a folder, before any is made.
fn check_sizes(
    recordings: &[&VirtualRecording],
    laboratory: &Laboratory,
    folder: Option<&Path>,
) -> anyhow::Result<()> {
    let mut bytes = 0_u64;
    for recording in recordings {
        let layout = layout_of(recording, laboratory);
        layout.check_size(&recording.file)?;
        bytes = bytes.saturating_add(layout.bytes());
    }
    // A disk that does not tell its size may have room.
    let free = folder.and_then(|folder| fs4::available_space(folder).ok());
    check_room(bytes, free.unwrap_or(u64::MAX))
}

fn check_room(bytes: u64, free: u64) -> anyhow::Result<()> {
    if bytes > free {
        bail!(
            "the recordings take {:.1} GB, and the disk of --out has {:.1} GB left; give fewer --taps, less --seconds, a lower --rate, or another --out",
            bytes as f64 / 1e9,
            free as f64 / 1e9
        );
    }
    Ok(())
}

/// Returns the length of a recording in whole seconds.
fn seconds_of(recording: &VirtualRecording) -> usize {
    (recording.plan.frames / u64::from(recording.plan.sample_rate)) as usize
}

fn layout_of(recording: &VirtualRecording, laboratory: &Laboratory) -> WavLayout {
    WavLayout {
        sample_rate: recording.plan.sample_rate,
        channels: recording.plan.channels.len(),
        frames: recording.plan.frames,
        format: match laboratory.recorder.bits {
            16 => WavFormat::Pcm16,
            24 => WavFormat::Pcm24,
            _ => WavFormat::Float32,
        },
    }
}

/// Seconds that are recorded, of all recordings.
struct Progress<'a> {
    terminal: &'a Terminal,
    done: &'a AtomicUsize,
    of: usize,
}

impl Progress<'_> {
    fn second(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.terminal.count("seconds recorded", done, self.of);
    }
}

/// Writes a recording and returns the number of clipped samples.
fn write_recording(
    recording: &VirtualRecording,
    laboratory: &Laboratory,
    path: &Path,
    progress: &Progress,
) -> anyhow::Result<u64> {
    let mut run = recording.begin(laboratory);
    let layout = layout_of(recording, laboratory);
    let mut stream = WavStream::create(path, layout)?;
    let mut frame = vec![0.0; layout.channels];
    let mut written = 0;
    while run.next_frame(&mut frame) {
        stream.write(&frame)?;
        written += 1;
        if written % layout.sample_rate == 0 {
            progress.second();
        }
    }
    Ok(stream.finish()?)
}

/// Describes the recordings.
fn recording_lines(truth: &Truth, test: &VirtualTest) -> String {
    let mut text = String::new();
    for (recording, made) in truth.recordings.iter().zip(&test.recordings) {
        let modes = recording.modes.iter().take(6);
        let modes: Vec<String> = modes.map(|mode| format!("{:.3}", mode.frequency)).collect();
        let more = if recording.modes.len() > 6 {
            " ..."
        } else {
            ""
        };
        let line = format!(
            "{}: {:.1} s at {} Hz, {} channels, {} taps (level {}, pulses of {} ms); modes at rest: {}{more} Hz",
            recording.file,
            recording.seconds,
            recording.sample_rate,
            recording.gains.len(),
            recording.taps.len(),
            recording.level,
            1e3 * made.plan.taps.pulse_length,
            modes.join(" ")
        );
        text.push_str(&screen().wrapped(&line, 2));
    }
    text
}

/// Describes the virtual test: recordings, joint, planted effects, in the words `nothing` if there are none, and laboratory.
fn summary(made: &Made, folder: &Path, nothing: &str) -> String {
    let (truth, test) = (&made.truth, &made.test);
    let mut text = format!(
        "Virtual test of \"{}\" in {}\n\n",
        truth.name,
        folder.display()
    );
    text.push_str(&recording_lines(truth, test));
    if let Some(joint) = &truth.joint {
        let [kt, kr] = [(joint.kt, "N/m"), (joint.kr, "N m/rad")].map(|(value, unit)| {
            value.map_or_else(|| "rigid".to_owned(), |value| format!("{value:.6e} {unit}"))
        });
        let mut line = format!("Joint: Kt {kt}, Kr {kr}");
        if let Some((kx, ky)) = joint.kx.zip(joint.ky) {
            let _ = write!(line, " (Kx {kx:.6}, Ky {ky:.6})");
        }
        if let Some(ktr) = joint.ktr {
            let _ = write!(line, ", Ktr {ktr:.6e} N/rad");
        }
        let _ = write!(text, "\n{}", screen().wrapped(&line, 2));
    }
    if truth.effects.is_empty() {
        let _ = writeln!(text, "{nothing}");
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
        text.push_str(&with_minus_signs(&screen().wrapped(&line, 2)));
    }
    text.push_str("\nLaboratory\n");
    for (name, value) in laboratory_lines(&truth.laboratory) {
        let _ = writeln!(text, "  {name:<18} {value}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_recordings_larger_than_the_disk_are_refused() {
        assert!(check_room(1000, 1000).is_ok());
        let error = check_room(8_000_000_000, 1_500_000_000).unwrap_err();
        let words = "the recordings take 8.0 GB, and the disk of --out has 1.5 GB left";
        assert!(error.to_string().starts_with(words), "{error}");
    }
}
