//! `tapjoint simulate`: the recordings of a virtual test, and the options of the laboratory that records it.

use super::Outcome;
use super::arguments::{StiffnessArguments, words};
use super::input::{effect_at, read_model};
use super::overwrite::{CHECKSUMS, Expanded};
use super::publication::OutputFolder;
use super::terminal::Terminal;
use anyhow::{Context, anyhow, bail};
use clap::builder::{RangedU64ValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use tapjoint::description::TestDescription;
use tapjoint::effects::{Effect, EffectDimension, EffectId};
use tapjoint::quantity::{Dimension, parse_quantity};
use tapjoint::recording::{WavFormat, WavLayout, WavStream};
use tapjoint::report::format::with_minus_signs;
use tapjoint::report::wrapped;
use tapjoint::simulate::{
    AntiAlias, Damping, Laboratory, MOST_RATE, TestPlan, Tip, Truth, VirtualRecording, VirtualTest,
    nominal_description, plan_test, truth_of, wav_name,
};
use tapjoint::study::updated_model::described_effects;

const EXAMPLES: &str = "Examples:
  tapjoint simulate test.toml --out virtual --with sensor-mass:mass=24g
  tapjoint simulate test.toml --out virtual --with sensor-position:offset=8mm,sensor=2,recording=1
  tapjoint simulate test.toml --out virtual --kx 1400 --ky 4.8 --with joint-nonlinearity:ratio=-0.1,exponent=1 --seed 7
  tapjoint run virtual/test.toml";

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
        + EXAMPLES
}

/// Make the recordings of a virtual test.
///
/// They are what a laboratory would record of the described structure. TEST describes beam, joint (with kt and kr, or --kx and --ky), sensors and recordings. The output
/// folder gets the recordings, a test.toml and truth.json. The test.toml describes the test as an analyst
/// knows it: effects of --with are left out, and the joint is to be fitted. A list of checksums lets the
/// next `tapjoint simulate` replace these files.
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
    let output = OutputFolder::prepare(&arguments.out, terminal.files())?;
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
    check_sizes(&test, &laboratory, output.place_of(DESCRIPTION).parent())?;
    let seconds = test.recordings.iter().map(seconds_of).sum();
    let done = AtomicUsize::new(0);
    let clipped = test
        .recordings
        .par_iter()
        .map(|recording| {
            let path = output.place_of(&recording.file);
            let progress = Progress {
                terminal: &terminal,
                done: &done,
                of: seconds,
            };
            write_recording(recording, &laboratory, &path, &progress)
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
    let folder = output.publish()?;
    terminal.say(&summary(&truth, &test, &folder))?;
    terminal.write_json(&serde_json::json!({ "truth": truth }))?;
    Ok(Outcome::Answered)
}

/// Refuses recordings that do not fit into WAV files, or into a folder, before any is made.
fn check_sizes(
    test: &VirtualTest,
    laboratory: &Laboratory,
    folder: Option<&Path>,
) -> anyhow::Result<()> {
    let mut bytes = 0_u64;
    for recording in &test.recordings {
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

/// Describes the virtual test: recordings, joint, planted effects and laboratory.
fn summary(truth: &Truth, test: &VirtualTest, folder: &Path) -> String {
    let mut text = format!(
        "Virtual test of \"{}\" in {}\n\n",
        truth.name,
        folder.display()
    );
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
        text.push_str(&wrapped(&line, 2));
    }
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
        let _ = write!(text, "\n{}", wrapped(&line, 2));
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

/// Settings of a virtual test. The defaults are those of a good laboratory; the command prints them.
#[derive(Debug, Args)]
#[command(next_help_heading = "Laboratory")]
pub(super) struct LaboratoryArguments {
    /// Leave out all disturbances: noise, scatter, errors, and all filters but the anti-alias filter. The
    /// other options still apply
    #[arg(long)]
    ideal: bool,
    /// Leave out parts of the laboratory
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PART,...")]
    without: Vec<Part>,
    /// Number of taps in each recording; default: 5
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=100_000))]
    taps: Option<usize>,
    /// Length of each recording (s); default: long enough for the taps to ring down
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Sample rate (Hz), 100 to 204800; default: the lowest usual rate that covers the band
    #[arg(long, value_name = "HZ", value_parser = sample_rate)]
    rate: Option<u32>,
    /// Bits of a sample, 32 = floating point; default: 24
    #[arg(long, value_name = "N", value_parser = ["16", "24", "32"])]
    bits: Option<String>,
    /// Tip of the hammer; default: the softest that excites the band
    #[arg(long, value_parser = tip())]
    tip: Option<Tip>,
    /// Peak force of a tap (N), multiplied by each recording's `level`; default: 20
    #[arg(long, value_name = "N", value_parser = within(Dimension::Force, 1e-6, 1e6))]
    level: Option<f64>,
    /// Noise of sensors and hammer relative to that of good ones; default: 1
    #[arg(long, value_name = "X", value_parser = within(Dimension::Ratio, 0.0, 1e9))]
    noise: Option<f64>,
    /// Share of the taps that strike twice; default: 0
    #[arg(long, value_name = "SHARE", value_parser = within(Dimension::Ratio, 0.0, 1.0))]
    double_hits: Option<f64>,
    /// Share of the taps that are far too weak; default: 0
    #[arg(long, value_name = "SHARE", value_parser = within(Dimension::Ratio, 0.0, 1.0))]
    weak_hits: Option<f64>,
    /// Quiet time before the first tap (s); default: 0.5
    #[arg(long, value_name = "S", value_parser = seconds)]
    lead: Option<f64>,
    /// Relative error of the recorder's clock, positive = frequencies are read too high; default: 5e-6
    #[arg(long, value_name = "X", value_parser = within(Dimension::Ratio, -0.5, 0.5), allow_negative_numbers = true)]
    clock_error: Option<f64>,
    /// Resonance frequency of a mounted accelerometer (Hz), up to 100000, 0 = none; default: 18000
    #[arg(long, value_name = "HZ", value_parser = within(Dimension::Frequency, 0.0, 1e5))]
    mounting: Option<f64>,
    /// Mains frequency (Hz); default: 50
    #[arg(long, value_name = "HZ", value_parser = within(Dimension::Frequency, 0.0, 1e5))]
    mains: Option<f64>,
    /// Damping ratio of each mode. The last one applies to all higher modes; default:
    /// 0.4%,0.3%,0.25%,0.2%
    #[arg(long, value_name = "Z,...", value_delimiter = ',', value_parser = within(Dimension::Ratio, 0.0, 1.0), conflicts_with = "rayleigh")]
    damping: Vec<f64>,
    /// Damping proportional to mass (1/s) and stiffness (s), instead of --damping
    #[arg(long, value_name = "MASS,STIFFNESS", value_delimiter = ',', value_parser = within(Dimension::Ratio, 0.0, 1e6))]
    rayleigh: Vec<f64>,
}

/// Parts of the laboratory that can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Noise of sensors and hammer
    Noise,
    /// Mains hum
    Hum,
    /// Slow drift of the zero
    Drift,
    /// Offset of the zero
    Offset,
    /// Anti-alias filter
    AntiAlias,
    /// High-pass of AC-coupled inputs
    AcCoupling,
    /// Resonance of the mounted accelerometers
    Mounting,
    /// Errors of the sensitivities
    SensitivityError,
    /// Error of the clock
    ClockError,
    /// Scatter of level, length and place of the taps
    Scatter,
    /// Rigid-body motion of a free or lap-jointed beam on its suspension
    Suspension,
}

fn tip() -> impl TypedValueParser<Value = Tip> {
    let tips = [
        ("steel", Tip::Steel),
        ("nylon", Tip::Nylon),
        ("rubber", Tip::Rubber),
    ];
    words(
        tips,
        ["0.3 ms, to 3.3 kHz", "1.4 ms, to 1 kHz", "5 ms, to 290 Hz"],
    )
}

impl LaboratoryArguments {
    /// Returns the laboratory with these options.
    pub(super) fn resolve(&self) -> anyhow::Result<Laboratory> {
        let mut laboratory = if self.ideal {
            Laboratory::ideal()
        } else {
            Laboratory::default()
        };
        for part in &self.without {
            part.leave_out(&mut laboratory);
        }
        self.set_hammer(&mut laboratory)?;
        laboratory.recorder.sample_rate = self.rate;
        if let Some(bits) = &self.bits {
            laboratory.recorder.bits = bits.parse()?;
        }
        set(&mut laboratory.recorder.clock_error, self.clock_error);
        set(&mut laboratory.recorder.mains, self.mains);
        set(&mut laboratory.sensors.noise, self.noise);
        set(&mut laboratory.sensors.mounting_resonance, self.mounting);
        if !self.damping.is_empty() {
            laboratory.specimen.damping = Damping::Modal(self.damping.clone());
        }
        match self.rayleigh[..] {
            [] => {}
            [_, stiffness] if stiffness > 1.0 => bail!(
                "--rayleigh: the stiffness part is {stiffness:?} s; give 0 to 1 s, such as 0.5,1e-6"
            ),
            [mass, stiffness] => {
                laboratory.specimen.damping = Damping::Rayleigh { mass, stiffness };
            }
            _ => bail!(
                "--rayleigh has {} numbers; give two, MASS (1/s) and STIFFNESS (s), such as 0.5,1e-6",
                self.rayleigh.len()
            ),
        }
        Ok(laboratory)
    }

    fn set_hammer(&self, laboratory: &mut Laboratory) -> anyhow::Result<()> {
        let hammer = &mut laboratory.hammer;
        set(&mut hammer.taps, self.taps);
        set(&mut hammer.lead, self.lead);
        set(&mut hammer.peak_force, self.level);
        set(&mut hammer.double_hits, self.double_hits);
        set(&mut hammer.weak_hits, self.weak_hits);
        hammer.tip = self.tip;
        if let Some(seconds) = self.seconds {
            let interval = (seconds - hammer.lead) / hammer.taps as f64;
            // A tap needs room for its pulse and some of what rings.
            if interval < 0.05 {
                bail!(
                    "--seconds {seconds} leaves {interval:.3} s for each of {} taps after {} s of lead; give at least {:.1} s, or fewer --taps",
                    hammer.taps,
                    hammer.lead,
                    hammer.lead + 0.05 * hammer.taps as f64
                );
            }
            hammer.interval = Some(interval);
        }
        Ok(())
    }
}

fn set<T>(value: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *value = given;
    }
}

impl Part {
    fn leave_out(self, laboratory: &mut Laboratory) {
        let Laboratory {
            hammer,
            sensors,
            recorder,
            specimen,
        } = laboratory;
        match self {
            Self::Noise => sensors.noise = 0.0,
            Self::Hum => recorder.hum = 0.0,
            Self::Drift => recorder.drift = 0.0,
            Self::Offset => recorder.offset = 0.0,
            Self::AntiAlias => recorder.anti_alias = AntiAlias::Off,
            Self::AcCoupling => sensors.ac_coupling = 0.0,
            Self::Mounting => sensors.mounting_resonance = 0.0,
            Self::SensitivityError => sensors.sensitivity_error = 0.0,
            Self::ClockError => recorder.clock_error = 0.0,
            Self::Scatter => {
                hammer.level_scatter = 0.0;
                hammer.length_scatter = 0.0;
                hammer.place_scatter = 0.0;
            }
            Self::Suspension => specimen.suspension = None,
        }
    }
}

fn quantity(text: &str, dimension: Dimension) -> Result<f64, String> {
    parse_quantity(text, dimension).map_err(|error| error.to_string())
}

/// Returns the parser of a quantity between these limits (SI).
fn within(
    dimension: Dimension,
    lowest: f64,
    highest: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let value = quantity(text, dimension)?;
        match (lowest..=highest).contains(&value) {
            true => Ok(value),
            false => Err(format!("give a number from {lowest} to {highest}")),
        }
    }
}

/// Parses a time of at most a day.
fn seconds(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('s').trim().parse::<f64>() {
        Ok(value) if (0.0..=86_400.0).contains(&value) => Ok(value),
        _ => Err(format!(
            "\"{text}\" is no time; give seconds from 0 to 86400"
        )),
    }
}

fn sample_rate(text: &str) -> Result<u32, String> {
    let rate = quantity(text, Dimension::Rate)?;
    if rate.fract() == 0.0 && (100.0..=f64::from(MOST_RATE)).contains(&rate) {
        Ok(rate as u32)
    } else {
        Err(format!(
            "{rate} Hz is no sample rate of an analyser; give a whole number from 100 to {MOST_RATE}"
        ))
    }
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
