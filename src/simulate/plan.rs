//! From a described test and the effects planted in it to recordings ready to be made, with the checks of
//! laboratory and effects.

use super::chain::Signal;
use super::change::{
    Change, ScatterTails, SetUpScatter, change_joint, check_changes, without_lost_masses,
    without_lost_sensors,
};
use super::hammer::{TapPlan, Tip};
use super::joint_moment::{JointMoment, LEAST_SLOPE};
use super::laboratory::{Damping, Laboratory, SimulateError};
use super::observed_structure::{
    ObservedStructure, Sensed, hangs, nominal_specimen, sensor_places,
};
use super::recording_run::{RecordingPlan, RecordingRun, Trial, round_scale, try_out};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_beam::JointStiffness;
use tapjoint_beam::effects::{
    ActualSetUp, Circumstances, DescribedSetUp, Effect, EffectId, JointLaw, Seen, actual_set_ups,
    apply, check_set_up,
};
use tapjoint_beam::specimen::{PointMass, Specimen};
use tapjoint_description::{RecordingDescription, Scale, SensorKind, TestDescription};

/// A test to be simulated.
#[derive(Debug, Clone)]
pub struct TestPlan<'a> {
    /// The test as described: the nominal structure, with its joint.
    pub description: &'a TestDescription,
    /// Effects that the description leaves out.
    pub effects: &'a [Effect],
    /// Changes since an earlier test of this structure, which the description leaves out, too.
    pub changes: &'a [Change],
    /// Standard deviation of the difference of a natural frequency between two tests of one state (1, relative).
    pub repeatability: f64,
    /// The laboratory that carries the test out.
    pub laboratory: &'a Laboratory,
    /// The joint, where it is not the description's.
    pub joint: Option<JointStiffness>,
    /// Seed of everything random.
    pub seed: u64,
}

/// A test ready to be recorded.
#[derive(Debug, Clone)]
pub struct VirtualTest {
    /// The recordings, each file once.
    pub recordings: Vec<VirtualRecording>,
    /// SI units per unit of the file of each channel: the hammer's first, where there is one, then the
    /// sensors'.
    pub scales: Vec<Scale>,
    /// The nominal structure, without sensors that were moved.
    pub nominal: Specimen,
    /// Frequencies (Hz) of the described structure on its suspension, up and down and rocking, where it
    /// hangs: what a user knows of them.
    pub suspension: Option<[f64; 2]>,
    /// Law of the joint that is not linear, with the largest rotation (rad) that it refers to.
    pub joint_law: Option<(JointLaw, f64)>,
}

/// One recording, ready to be made.
#[derive(Debug, Clone)]
pub struct VirtualRecording {
    /// Name of the file: a WAV file in the test's folder.
    pub file: String,
    /// Level of the taps (1).
    pub level: f64,
    /// The structure as it is seen: at rest, where its joint is not linear.
    pub seen: Seen,
    /// The structure in its modes.
    pub structure: ObservedStructure,
    /// Settings of the recording.
    pub plan: RecordingPlan,
}

/// Prepares a virtual test.
///
/// # Errors
/// [`SimulateError`]: what the description must say and does not, what cannot be simulated.
pub fn plan_test(plan: &TestPlan<'_>) -> Result<VirtualTest, SimulateError> {
    check_laboratory(plan.laboratory)?;
    let test = plan.description;
    let described = distinct_files(test)?;
    check_changes(test, plan.changes)?;
    let mut recordings = prepare_all(plan, &described)?;
    check_moves(plan, &described, &recordings)?;
    let trials = recordings.iter();
    let trials = trials.map(|one| try_out(&one.structure, &one.plan, plan.laboratory));
    let trials: Vec<Trial> = trials.collect();
    let scales = scales(test, &recordings, &trials);
    let joint_law = hardest(&recordings, &trials);
    for recording in &mut recordings {
        let channels = recording.plan.channels.iter_mut();
        for ((_, scale), wanted) in channels.zip(&scales) {
            *scale = match wanted {
                Scale::PerUnit(scale) | Scale::PerVolt(scale) => *scale,
            };
        }
        if let Some((law, hardest)) = &joint_law {
            let [_, stiffness] = recording.seen.specimen.joint_stiffnesses();
            if !(stiffness > 0.0 && stiffness.is_finite()) {
                return Err(SimulateError::NoRotation { stiffness });
            }
            recording.plan.joint = Some(JointMoment::of_law(law, stiffness, *hardest));
        }
    }
    let first = test.reference_recording();
    let first = first.unwrap_or(described[0].recording);
    let nominal = nominal_specimen(test, first, &sensor_places(test, first)?, plan.joint)?;
    let suspension = plan.laboratory.specimen.suspension;
    Ok(VirtualTest {
        suspension: suspension.filter(|_| hangs(&nominal)),
        nominal,
        recordings,
        scales,
        joint_law,
    })
}

impl VirtualRecording {
    /// Puts another structure in the place of the planned one, with its sensors at these positions (m). Taps stay where they
    /// are marked, in proportion to the length.
    ///
    /// # Errors
    /// As [`ObservedStructure::new`].
    pub fn replace_structure(
        &mut self,
        specimen: Specimen,
        sensors: &[f64],
        laboratory: &Laboratory,
    ) -> Result<(), SimulateError> {
        let (before, after) = (self.seen.specimen.body.length(), specimen.body.length());
        let taps = &mut self.plan.taps;
        taps.position = marked_position(taps.position, before, after);
        taps.beam_length = after;
        self.structure = ObservedStructure::new(
            &specimen,
            &laboratory.specimen,
            sensors,
            self.seen.joint_loss_factor,
            self.plan.highest_mode(laboratory),
        )?;
        self.seen.specimen = specimen;
        Ok(())
    }

    /// Begins the recording.
    pub fn begin(&self, laboratory: &Laboratory) -> RecordingRun {
        RecordingRun::new(self.structure.clone(), &self.plan, laboratory)
    }
}

/// A file that is to be recorded, however often it is described.
struct WantedFile<'a> {
    /// Its first description.
    recording: &'a RecordingDescription,
    /// Index of that description among all.
    number: usize,
    /// Its name as a WAV file.
    name: String,
    /// Highest frequency that is wanted of it (Hz); `None` without a band.
    highest: Option<f64>,
    /// Longest block that is wanted of it (s), where it does not depend on the sample rate.
    block_seconds: f64,
}

fn distinct_files(test: &TestDescription) -> Result<Vec<WantedFile<'_>>, SimulateError> {
    if test.recordings.is_empty() {
        return Err(SimulateError::Nothing(
            "recording to simulate; add [[recording]] with `file` and `tap` in place of [measured]",
        ));
    }
    if test.sensors.is_empty() {
        return Err(SimulateError::Nothing(
            "sensor to record with; add [[sensor]] with `name` and `position`",
        ));
    }
    let mut distinct: Vec<WantedFile<'_>> = Vec::new();
    for (number, recording) in test.recordings.iter().enumerate() {
        let file = wav_name(recording);
        let line = recording.line;
        if recording.form.is_some() {
            let problem = " is a file of frequency response functions, and time series are simulated; remove `form`";
            return Err(SimulateError::Described {
                file,
                line,
                problem,
            });
        }
        if !recording.more_files.is_empty() {
            let problem = " is one of several `files`, and each recording is simulated as one file; write `file`";
            return Err(SimulateError::Described {
                file,
                line,
                problem,
            });
        }
        let highest = recording.band.map(|(_, high)| high);
        let block_seconds = match (recording.block, recording.band) {
            // block/2.56 lines over the band.
            (Some(block), Some((low, high))) => block as f64 / (2.56 * (high - low)),
            _ => 0.0,
        };
        let Some(found) = distinct.iter_mut().find(|found| found.name == file) else {
            distinct.push(WantedFile {
                recording,
                number,
                name: file,
                highest,
                block_seconds,
            });
            continue;
        };
        let first = found.recording;
        if (first.tap, first.level) != (recording.tap, recording.level)
            || first.at != recording.at
            || first.masses != recording.masses
            || first.length != recording.length
        {
            let problem = " was described before with another `tap`, `level`, `at`, `mass` or `length`; give each recording a file of its own";
            return Err(SimulateError::Described {
                file,
                line,
                problem,
            });
        }
        let both = [found.highest, highest].into_iter().flatten();
        found.highest = both.reduce(f64::max);
        found.block_seconds = found.block_seconds.max(block_seconds);
    }
    Ok(distinct)
}

/// A file's name as a WAV file, in the test's folder.
pub fn wav_name(recording: &RecordingDescription) -> String {
    let stem = recording.file.file_stem().unwrap_or_default();
    format!("{}.wav", stem.to_string_lossy())
}

/// The described places of sensors and taps in every recording.
fn described_set_ups(test: &TestDescription) -> Result<Vec<DescribedSetUp>, SimulateError> {
    let set_ups = test.recordings.iter().map(|recording| {
        let tap = recording.tap.ok_or_else(|| SimulateError::Described {
            file: wav_name(recording),
            line: recording.line,
            problem: ": where the hammer strikes is missing; add `tap` (m along the beam)",
        })?;
        let sensors = sensor_places(test, recording)?;
        Ok(DescribedSetUp {
            length: recording.length.unwrap_or(test.beam.length),
            sensors: sensors.iter().map(|sensor| sensor.position).collect(),
            tap,
        })
    });
    set_ups.collect()
}

/// Prepares all recordings. Changes that are effects join the others.
fn prepare_all(
    plan: &TestPlan<'_>,
    described: &[WantedFile<'_>],
) -> Result<Vec<VirtualRecording>, SimulateError> {
    let mut effects = plan.effects.to_vec();
    for change in plan.changes {
        if let Change::Effect(effect) = change {
            effects.push(effect.clone());
        }
    }
    let plan = &TestPlan {
        effects: &effects,
        ..plan.clone()
    };
    check_effects(plan)?;
    let set_ups = described_set_ups(plan.description)?;
    check_set_up(plan.effects, &set_ups)?;
    let set_ups = actual_set_ups(plan.effects, &set_ups);
    let mut recordings = Vec::new();
    for (visit, file) in described.iter().enumerate() {
        recordings.push(prepare(plan, file, &set_ups[file.number], visit)?);
    }
    Ok(recordings)
}

/// Least relative change of a natural frequency that a change makes (1). No test sees less.
const LEAST_MOVE: f64 = 1e-6;

/// Refuses a change without which all natural frequencies are the same: the truth would not be true.
fn check_moves(
    plan: &TestPlan<'_>,
    described: &[WantedFile<'_>],
    recordings: &[VirtualRecording],
) -> Result<(), SimulateError> {
    for (index, change) in plan.changes.iter().enumerate() {
        let mut others = plan.changes.to_vec();
        others.remove(index);
        let without = TestPlan {
            changes: &others,
            ..plan.clone()
        };
        let without = prepare_all(&without, described)?;
        let moves = recordings.iter().zip(&without).any(|(with, without)| {
            let modes = with.structure.elastic_modes();
            let mut both = modes.zip(without.structure.elastic_modes());
            both.any(|((with, _), (without, _))| (with / without - 1.0).abs() > LEAST_MOVE)
        });
        if !moves {
            return Err(SimulateError::NoMove {
                change: change.name(),
                number: index + 1,
            });
        }
    }
    Ok(())
}

/// Share of the set-up scatter's variance that all modes of a test have in common.
const COMMON_SHARE: f64 = 0.25;
/// Modes whose scatter is drawn, more than any test has.
const SCATTERED: usize = 100;

fn prepare(
    plan: &TestPlan<'_>,
    wanted: &WantedFile<'_>,
    set_up: &ActualSetUp,
    visit: usize,
) -> Result<VirtualRecording, SimulateError> {
    let (test, laboratory, described) = (plan.description, plan.laboratory, wanted.recording);
    // Sensors weigh where they really are.
    let weighed = sensor_places(test, described)?.into_iter();
    let places: Vec<PointMass> = weighed
        .zip(&set_up.sensors)
        .map(|(sensor, &position)| PointMass { position, ..sensor })
        .collect();
    let weighed = without_lost_sensors(test, &places, plan.changes);
    let masses = without_lost_masses(described, plan.changes);
    let nominal = nominal_specimen(test, &masses, &weighed, plan.joint)?;
    let level = described.level.unwrap_or(1.0);
    let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
    // Streams of their own, behind those of the recordings' channels.
    random.set_stream(1 << 40 | visit as u64);
    // A joint that is not linear is seen at rest.
    let circumstances = Circumstances {
        sensors: &places,
        level: 0.0,
        drift: std::array::from_fn(|_| StandardNormal.sample(&mut random)),
    };
    let mut seen = apply(plan.effects, &nominal, &circumstances);
    change_joint(&mut seen.specimen, plan.changes)?;
    let (nominal_length, length) = (nominal.body.length(), seen.specimen.body.length());
    let sample_rate = sample_rate(laboratory, &wanted.name, wanted.highest)?;
    let reach = f64::from(sample_rate) / 2.56;
    let tip = laboratory.hammer.tip;
    let tip = tip.unwrap_or_else(|| Tip::softest_for(wanted.highest.unwrap_or(reach)));
    let (pulse_length, pulse_shape) = tip.pulse();
    let mut recording = RecordingPlan {
        sample_rate,
        frames: 0,
        frequency_scale: seen.frequency_scale * (1.0 + laboratory.recorder.clock_error),
        channels: channels(test),
        signals: set_up.channels.clone(),
        taps: TapPlan {
            taps: laboratory.hammer.taps,
            interval: 0.0,
            position: marked_position(set_up.tap, nominal_length, length),
            beam_length: length,
            peak_force: laboratory.hammer.peak_force * level,
            pulse_length,
            pulse_shape,
        },
        joint: None,
        seed: plan.seed,
        number: visit as u64,
    };
    let positions = places.iter().map(|place| place.position);
    let positions: Vec<f64> = positions
        .map(|position| marked_position(position, nominal_length, length))
        .collect();
    let mut structure = ObservedStructure::new(
        &seen.specimen,
        &laboratory.specimen,
        &positions,
        seen.joint_loss_factor,
        recording.highest_mode(laboratory),
    )?;
    if plan.repeatability > 0.0 {
        let scatter = SetUpScatter {
            repeatability: plan.repeatability,
            share: COMMON_SHARE,
            tails: ScatterTails::Normal,
        };
        let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
        // A stream of its own, behind those of the visits.
        random.set_stream(1 << 41);
        structure.scale_frequencies(&scatter.factors(SCATTERED, &mut random));
    }
    let block = match described.block.filter(|_| described.band.is_none()) {
        Some(block) => block as f64 / f64::from(sample_rate),
        None => wanted.block_seconds,
    };
    recording.taps.interval = interval(laboratory, &structure, block);
    let seconds = laboratory.hammer.lead + laboratory.hammer.taps as f64 * recording.taps.interval;
    // The hand that stops the recorder goes by true time, like the taps: the last tap rings down in the
    // file, however wrong the clock is.
    recording.frames = (seconds * recording.true_rate()).round() as u64;
    Ok(VirtualRecording {
        file: wanted.name.clone(),
        level,
        seen,
        structure,
        plan: recording,
    })
}

/// Position (m) on a beam of this length that a position on the nominal beam stands for: positions are
/// marked in proportion to the length.
fn marked_position(position: f64, nominal_length: f64, length: f64) -> f64 {
    (position * length / nominal_length).min(length)
}

/// Usual sample rates (Hz) of analysers: 2.56 times the band.
const USUAL_RATES: [u32; 7] = [2560, 5120, 10_240, 12_800, 25_600, 51_200, 102_400];

fn sample_rate(
    laboratory: &Laboratory,
    file: &str,
    highest: Option<f64>,
) -> Result<u32, SimulateError> {
    let band = highest.unwrap_or(0.0);
    let reach = f64::from(MOST_RATE) / 2.56;
    check_setting("the upper end of the band (Hz)", band, 0.0, reach)?;
    let Some(rate) = laboratory.recorder.sample_rate else {
        // Without a band, 2000 Hz: the modes of a beam of some decimetres that the method uses.
        let needed = 2.56 * highest.unwrap_or(2000.0);
        let mut usual = USUAL_RATES.into_iter();
        let usual = usual.find(|rate| f64::from(*rate) >= needed);
        return Ok(usual.unwrap_or(needed.ceil() as u32));
    };
    let reach = f64::from(rate) / 2.56;
    if band > reach {
        return Err(SimulateError::RateTooLow {
            file: file.to_owned(),
            rate,
            reach,
            band,
            needed: (2.56 * band).ceil(),
        });
    }
    Ok(rate)
}

fn interval(laboratory: &Laboratory, structure: &ObservedStructure, block: f64) -> f64 {
    laboratory.hammer.interval.unwrap_or_else(|| {
        // e^{-zeta omega t} = 0.001 after 6.9/(zeta omega).
        let ring = structure
            .elastic_modes()
            .map(|(frequency, damping)| 6.9 / (damping * std::f64::consts::TAU * frequency))
            .fold(0.0, f64::max);
        // A block begins a little before its tap, and no tap is quite on time.
        ring.clamp(1.0, 10.0).max(1.03 * block + 0.1)
    })
}

/// Hammer and sensors in the order of the file.
fn channels(test: &TestDescription) -> Vec<(Signal, f64)> {
    let hammer = test.hammer.iter().map(|_| Signal::Force);
    let sensors = test.sensors.iter().map(|sensor| {
        Signal::Response(match sensor.kind {
            SensorKind::Velocity => Sensed::Velocity,
            SensorKind::Displacement => Sensed::Displacement,
            SensorKind::Acceleration | SensorKind::Sound => Sensed::Acceleration,
        })
    });
    hammer.chain(sensors).map(|signal| (signal, 1.0)).collect()
}

/// The described scales, and round ones with room for harder taps where none is described. Interchanged sensors of one
/// kind without a described scale are of one type: they get the same one.
fn scales(test: &TestDescription, recordings: &[VirtualRecording], trials: &[Trial]) -> Vec<Scale> {
    let Some(plan) = recordings.first().map(|first| &first.plan) else {
        return Vec::new();
    };
    let mut peaks = vec![0.0; plan.channels.len()];
    for trial in trials {
        for (peak, of_trial) in peaks.iter_mut().zip(&trial.peaks) {
            *peak = f64::max(*peak, *of_trial);
        }
    }
    let first = plan.channels.len() - plan.signals.len();
    for signal in &plan.signals {
        // The recorder is set by what comes in.
        peaks[first + signal.sensor] *= signal.factor.abs();
    }
    let sensors = test.sensors.iter().map(|sensor| sensor.scale);
    let hammer = test.hammer.iter().map(|hammer| hammer.scale);
    let described: Vec<Option<Scale>> = hammer.chain(sensors).collect();
    for (channel, signal) in plan.signals.iter().enumerate() {
        let pair = [first + channel, first + signal.sensor];
        let of_one_kind = plan.channels[pair[0]].0 == plan.channels[pair[1]].0;
        if of_one_kind && pair.iter().all(|one| described[*one].is_none()) {
            let largest = f64::max(peaks[pair[0]], peaks[pair[1]]);
            pair.iter().for_each(|one| peaks[*one] = largest);
        }
    }
    let scales = described.into_iter().zip(peaks);
    scales
        .map(|(scale, peak)| scale.unwrap_or(Scale::PerUnit(round_scale(3.0 * peak))))
        .collect()
}

/// The joint's law, and the largest rotation that a mean tap of any recording brings.
fn hardest(recordings: &[VirtualRecording], trials: &[Trial]) -> Option<(JointLaw, f64)> {
    let law = recordings.first()?.seen.joint_law?;
    let rotations = trials.iter().map(|trial| trial.joint_rotation);
    Some((law, rotations.fold(0.0, f64::max)))
}

/// Highest sample rate (Hz) that analysers have. Beyond it a simulation takes long and shows nothing more.
pub const MOST_RATE: u32 = 204_800;
/// Highest resonance (Hz) of a mounted accelerometer. The simulation takes twice as many steps a second.
const MOST_MOUNTING: f64 = 1e5;
const DAY: f64 = 86_400.0;

/// Looks at every number: what it is, its value, the lowest and the highest that is allowed.
fn check_laboratory(laboratory: &Laboratory) -> Result<(), SimulateError> {
    let (hammer, sensors, recorder) = (
        &laboratory.hammer,
        &laboratory.sensors,
        &laboratory.recorder,
    );
    let [up, rock] = laboratory.specimen.suspension.unwrap_or([1.0; 2]);
    let rate = f64::from(recorder.sample_rate.unwrap_or(MOST_RATE));
    let mut settings = vec![
        ("the peak force (N)", hammer.peak_force, 1e-6, 1e6),
        ("the number of taps", hammer.taps as f64, 1.0, 1e5),
        (
            "the time between taps (s)",
            hammer.interval.unwrap_or(1.0),
            1e-3,
            DAY,
        ),
        (
            "the suspension's frequency, up and down (Hz),",
            up,
            1e-3,
            1e3,
        ),
        ("the suspension's frequency, rocking (Hz),", rock, 1e-3, 1e3),
        ("the sample rate (Hz)", rate, 1.0, f64::from(MOST_RATE)),
        ("the time before the first tap (s)", hammer.lead, 0.0, DAY),
        ("the scatter of the level", hammer.level_scatter, 0.0, 1.0),
        (
            "the scatter of the pulse's length",
            hammer.length_scatter,
            0.0,
            1.0,
        ),
        (
            "the scatter of the place (m)",
            hammer.place_scatter,
            0.0,
            1e3,
        ),
        ("the noise", sensors.noise, 0.0, 1e9),
        (
            "the sensitivity's error",
            sensors.sensitivity_error,
            0.0,
            1.0,
        ),
        (
            "the corner of the AC coupling (Hz)",
            sensors.ac_coupling,
            0.0,
            1e4,
        ),
        (
            "the mounting's resonance (Hz)",
            sensors.mounting_resonance,
            0.0,
            MOST_MOUNTING,
        ),
        ("the mains frequency (Hz)", recorder.mains, 0.0, 1e5),
        ("the hum", recorder.hum, 0.0, 1.0),
        ("the drift", recorder.drift, 0.0, 1.0),
        ("the offset", recorder.offset, 0.0, 1.0),
        ("the share of double hits", hammer.double_hits, 0.0, 1.0),
        ("the share of weak hits", hammer.weak_hits, 0.0, 1.0),
        ("the clock's error", recorder.clock_error, -0.5, 0.5),
    ];
    match &laboratory.specimen.damping {
        // A mode that is damped by 1 and more does not swing.
        Damping::Modal(ratios) => {
            settings.extend(
                ratios
                    .iter()
                    .map(|&ratio| ("a damping ratio", ratio, 0.0, 1.0)),
            );
        }
        Damping::Rayleigh { mass, stiffness } => settings.extend([
            ("the mass-proportional damping (1/s)", *mass, 0.0, 1e6),
            (
                "the stiffness-proportional damping (s)",
                *stiffness,
                0.0,
                1.0,
            ),
        ]),
    }
    for (quantity, value, lowest, highest) in settings {
        check_setting(quantity, value, lowest, highest)?;
    }
    Ok(())
}

fn check_setting(
    quantity: &'static str,
    value: f64,
    lowest: f64,
    highest: f64,
) -> Result<(), SimulateError> {
    match (lowest..=highest).contains(&value) {
        true => Ok(()),
        false => Err(SimulateError::Setting {
            quantity,
            value,
            lowest,
            highest,
        }),
    }
}

/// Refuses effects that would change nothing or that no recording contains: the truth would not be true.
///
/// It also refuses a joint whose slope 1 + c (p + 1) a^p falls below [`LEAST_SLOPE`] before the hardest tap's
/// rotation a. There the simulated moment leaves the planted law.
fn check_effects(plan: &TestPlan<'_>) -> Result<(), SimulateError> {
    let (test, effects) = (plan.description, plan.effects);
    let planted: Vec<EffectId> = effects.iter().map(|effect| effect.id).collect();
    if planted.contains(&EffectId::Resolution) {
        return Err(SimulateError::Resolution);
    }
    let mut placed = effects
        .iter()
        .filter(|effect| effect.value("position").is_some());
    if let Some(effect) = placed.next()
        && !test.moved_lengths().is_empty()
    {
        let id = effect.id.name();
        return Err(SimulateError::PlaceOfLengths { id });
    }
    let mut masses = test.sensors.iter().map(|sensor| sensor.mass);
    let all_stated = masses.all(|mass| mass.is_some_and(|mass| mass > 0.0));
    if planted.contains(&EffectId::SensorMass) && all_stated {
        return Err(SimulateError::NothingToWeigh);
    }
    let springs = [
        ("rotation", "kr", test.joint.kr),
        ("translation", "kt", test.joint.kt),
    ];
    for effect in effects
        .iter()
        .filter(|effect| effect.id == EffectId::JointCompliance)
    {
        for (parameter, key, stiffness) in springs {
            let value = effect.value(parameter).unwrap_or(0.0);
            let is_rigid = plan.joint.is_none() && stiffness == Some(f64::INFINITY);
            if value > 0.0 && !is_rigid {
                return Err(SimulateError::NotRigid {
                    parameter,
                    value,
                    key,
                });
            }
        }
    }
    let mut nonlinear = effects.iter();
    let nonlinear = nonlinear.find(|effect| effect.id == EffectId::JointNonlinearity);
    let values = nonlinear.map(|effect| [effect.value("ratio"), effect.value("exponent")]);
    if let Some([Some(ratio), Some(exponent)]) = values {
        let law = JointLaw { ratio, exponent };
        let least = -(1.0 - LEAST_SLOPE) / (exponent + 1.0);
        let coefficient = law.coefficient(1.0);
        if coefficient.is_nan() || coefficient < least {
            let least = ratio * least / coefficient;
            return Err(SimulateError::SoftensTooFar {
                ratio,
                exponent,
                least,
            });
        }
    }
    Ok(())
}
