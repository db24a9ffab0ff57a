//! The truth about a virtual test, which its diagnosis must not see.

use super::hammer::Tap;
use super::laboratory::Laboratory;
use super::plan::{TestPlan, VirtualRecording, VirtualTest, wav_name};
use serde::Serialize;
use std::collections::BTreeMap;
use tapjoint_beam::effects::Effect;
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::specimen::{Joint, Specimen};
use tapjoint_description::described_beam;
use tapjoint_description::{Scale, TestDescription};
use toml::{Table, Value};

/// The whole truth about a virtual test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Truth {
    /// Version of this form.
    pub version: u32,
    /// The test's name.
    pub name: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Effects that the description leaves out.
    pub effects: Vec<PlantedEffect>,
    /// The nominal joint.
    pub joint: Option<JointTruth>,
    /// The joint's law, where it is not linear.
    pub joint_law: Option<LawTruth>,
    /// The recordings.
    pub recordings: Vec<RecordingTruth>,
    /// The laboratory that carried the test out.
    pub laboratory: Laboratory,
}

/// An effect with its parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlantedEffect {
    /// Its name.
    pub effect: &'static str,
    /// Its parameters (SI).
    pub parameters: BTreeMap<&'static str, f64>,
}

/// Stiffnesses of a joint; a rigid spring has none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointTruth {
    /// Translational stiffness (N/m).
    pub kt: Option<f64>,
    /// Rotational stiffness (N m/rad).
    pub kr: Option<f64>,
    /// Cross-coupling stiffness (N/rad); none without coupling.
    pub ktr: Option<f64>,
    /// Kt L^3/(E I) (1), by the described beam.
    pub kx: Option<f64>,
    /// Kr L/(E I) (1).
    pub ky: Option<f64>,
    /// Ktr L^2/(E I) (1).
    pub kz: Option<f64>,
    /// sqrt(Kt Kr)/Ktr (1).
    pub coupling: f64,
}

/// Law of a joint that is not linear.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawTruth {
    /// Relative change of the secant stiffness at the hardest rotation (1).
    pub ratio: f64,
    /// Power of the rotation (1).
    pub exponent: f64,
    /// The hardest rotation: the largest that a mean tap of any recording brings to the joint at rest
    /// (rad).
    pub hardest_rotation: f64,
}

/// The truth about one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingTruth {
    /// Its file.
    pub file: String,
    /// Sample rate that the file states (Hz).
    pub sample_rate: u32,
    /// Length (s), in true seconds.
    pub seconds: f64,
    /// Level of the taps (1).
    pub level: f64,
    /// Factor on true frequencies when the file is read (1): the clock.
    pub frequency_scale: f64,
    /// The joint on this visit, at rest.
    pub joint: Option<JointTruth>,
    /// Modes up to sample rate/2.56, at rest.
    pub modes: Vec<ModeTruth>,
    /// The taps, in true seconds.
    pub taps: Vec<Tap>,
    /// Gain (1) of each channel beside the scale of the sensor that is connected to it.
    pub gains: Vec<f64>,
}

/// One mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ModeTruth {
    /// Its number, from 1; rigid-body motions do not count.
    pub mode: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Damping ratio (1).
    pub damping: f64,
}

/// The truth about a virtual test.
pub fn truth_of(plan: &TestPlan<'_>, test: &VirtualTest) -> Truth {
    let units = StiffnessUnits::of(&described_beam(plan.description));
    Truth {
        version: 1,
        name: plan.description.name.clone(),
        seed: plan.seed,
        effects: plan.effects.iter().map(planted).collect(),
        joint: joint_of(&test.nominal, &units),
        joint_law: test.joint_law.map(|(law, hardest_rotation)| LawTruth {
            ratio: law.ratio,
            exponent: law.exponent,
            hardest_rotation,
        }),
        recordings: test
            .recordings
            .iter()
            .map(|recording| recording_of(recording, plan.laboratory, &units))
            .collect(),
        laboratory: plan.laboratory.clone(),
    }
}

fn planted(effect: &Effect) -> PlantedEffect {
    PlantedEffect {
        effect: effect.id.name(),
        parameters: effect
            .values()
            .map(|(info, value)| (info.name, value))
            .collect(),
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn joint_of(specimen: &Specimen, units: &StiffnessUnits) -> Option<JointTruth> {
    let Joint { kt, kr, coupling } = specimen.joint?;
    // 1/Ktr = coupling/sqrt(Kt Kr).
    let ktr = kt.sqrt() * kr.sqrt() / coupling;
    Some(JointTruth {
        kt: finite(kt),
        kr: finite(kr),
        ktr: finite(ktr),
        kx: finite(kt / units.kt),
        ky: finite(kr / units.kr),
        kz: finite(ktr / units.ktr),
        coupling,
    })
}

fn recording_of(
    recording: &VirtualRecording,
    laboratory: &Laboratory,
    units: &StiffnessUnits,
) -> RecordingTruth {
    let plan = &recording.plan;
    let reach = f64::from(plan.sample_rate) / 2.56;
    let run = recording.begin(laboratory);
    let modes = recording.structure.elastic_modes().zip(1..);
    RecordingTruth {
        file: recording.file.clone(),
        sample_rate: plan.sample_rate,
        seconds: plan.frames as f64 / plan.true_rate(),
        level: recording.level,
        frequency_scale: plan.frequency_scale,
        joint: joint_of(&recording.seen.specimen, units),
        modes: modes
            .take_while(|((frequency, _), _)| *frequency <= reach)
            .map(|((frequency, damping), mode)| ModeTruth {
                mode,
                frequency,
                damping,
            })
            .collect(),
        taps: run.taps(),
        gains: run.gains(),
    }
}

/// Head of the description.
const HEAD: &str = "# Recordings of a virtual test, made by `tapjoint simulate`.\n\n";

/// Returns the nominal description, as its user has it: the recordings as they were written, no effects, and
/// no joint stiffnesses, so that these are fitted. A joint that is rigid but for the effects stays described as rigid.
/// `text` is the description that was simulated.
///
/// # Errors
/// A text that is no TOML; it was read before.
pub fn nominal_description(
    text: &str,
    test: &TestDescription,
    simulated: &VirtualTest,
) -> Result<String, toml::de::Error> {
    let mut table: Table = text.parse()?;
    // The user does not know the planted effects.
    table.remove("effect");
    if let Some(Value::Table(joint)) = table.get_mut("joint") {
        let nominal = simulated.nominal.joint.unwrap_or(Joint::RIGID);
        let springs = [
            ("kt", test.joint.kt, nominal.kt),
            ("kr", test.joint.kr, nominal.kr),
        ];
        for (key, described, stiffness) in springs {
            if described != Some(f64::INFINITY) || stiffness.is_finite() {
                joint.remove(key);
            }
        }
        joint.remove("ktr");
    }
    let mut scales = simulated.scales.iter().zip(1i64..);
    if test.hammer.is_some()
        && let Some(Value::Table(hammer)) = table.get_mut("hammer")
    {
        describe_channel(hammer, scales.next());
    }
    for sensor in tables(&mut table, "sensor") {
        describe_channel(sensor, scales.next());
    }
    for (recording, described) in tables(&mut table, "recording").zip(&test.recordings) {
        let file = wav_name(described);
        let mut recorded = simulated.recordings.iter();
        let recorded = recorded.find(|recording| recording.file == file);
        // The suspension as the user chose it: what cables add to it belongs to what is planted.
        if let (Some(recorded), Some([up, rock])) = (recorded, simulated.suspension)
            && !recording.contains_key("band")
        {
            // The band begins above the suspension of a structure that hangs: motions on it are no modes of the
            // beam. Five times its frequency, in whole hertz: it is 4 % of a resonance there.
            let reach = f64::from(recorded.plan.sample_rate) / 2.56;
            let band = [(5.0 * up.max(rock)).ceil(), reach];
            recording.insert("band".into(), Value::Array(band.map(Value::Float).to_vec()));
        }
        recording.insert("file".into(), file.into());
        // The times name taps of other recordings.
        for key in ["sample_rate", "level", "accept_taps", "reject_taps"] {
            recording.remove(key);
        }
    }
    Ok(format!("{HEAD}{table}"))
}

fn tables<'t>(table: &'t mut Table, key: &str) -> impl Iterator<Item = &'t mut Table> {
    let entries = table.get_mut(key).and_then(Value::as_array_mut);
    entries
        .into_iter()
        .flatten()
        .filter_map(Value::as_table_mut)
}

fn describe_channel(table: &mut Table, channel: Option<(&Scale, i64)>) {
    let Some((scale, number)) = channel else {
        return;
    };
    table.insert("channel".into(), number.into());
    if let (Scale::PerUnit(scale), false) = (scale, table.contains_key("sensitivity")) {
        table.insert("scale".into(), (*scale).into());
    }
}
