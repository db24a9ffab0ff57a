//! The described model brought up to date by a diagnosis: as a description for predictions, and its natural
//! frequencies. Three results of the fit have no place in a description and are left out: the change of shear and
//! rotary inertia (2 %), the hold of the width, and what the model misses of each mode.

use tapjoint_analysis::nominal_with;
use tapjoint_beam::StructureError;
use tapjoint_beam::effects::{Circumstances, Effect, EffectError, EffectId, Seen, apply};
use tapjoint_beam::specimen::{Mesh, PointMass};
use tapjoint_description::{Assembly, BeamTheory, SensorKind, TestDescription};
use tapjoint_description::{described_beam, described_specimen};
use tapjoint_diagnosis::{Diagnosis, Hypothesis, HypothesisResult, Verdict};
use tapjoint_identify::observation::effective_share;
use toml::Value;

/// A model brought up to date.
#[derive(Debug, Clone, PartialEq)]
pub struct UpdatedModel {
    /// The hypothesis that it assumes.
    pub hypothesis: String,
    /// A test description with the joint as found and `[[effect]]` tables.
    pub text: String,
}

/// Reason for which a described structure, or an effect described with it, cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}{cause}", line.map_or_else(String::new, |line| format!("line {line}: ")))]
pub struct DescribedEffectError {
    /// Line of the effect's table; `None` where the structure without effects cannot exist either.
    pub line: Option<usize>,
    /// The fault.
    pub cause: EffectCause,
}

/// A fault of a described effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectCause {
    /// There is no such effect, or not of this size.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The described structure cannot have it.
    #[error(transparent)]
    Structure(#[from] StructureError),
}

/// Returns the described model with the effects that a diagnosis names, or else with the most probable hypothesis that
/// predicts anything. `None` where no hypothesis predicts, where the diagnosis refused all that do, and where a sensor
/// has mass but no position.
pub fn updated_model(test: &TestDescription, diagnosis: &Diagnosis) -> Option<UpdatedModel> {
    let mut loads = test
        .sensors
        .iter()
        .filter(|sensor| sensor.kind != SensorKind::Sound && sensor.mass > Some(0.0));
    if loads.any(|sensor| test.place_of(sensor).is_none()) {
        return None;
    }
    let wanted = match &diagnosis.verdict {
        Verdict::NoGap => Some(Hypothesis::None),
        Verdict::Named(effects) => Some(Hypothesis::Effects(effects.clone())),
        Verdict::Unknown => return None,
        Verdict::Group(_) | Verdict::Set(_) | Verdict::NotEnoughData(_) => None,
    };
    let mut all = diagnosis.hypotheses.iter();
    let found = match wanted {
        Some(wanted) => all.find(|one| one.hypothesis == wanted),
        None => all.find(|one| one.hypothesis != Hypothesis::Unknown),
    }?;
    let mut effects = found.effects.clone();
    // Descriptions have no coupling of the joint's own model: it goes to the effects.
    if found.coupling != 0.0 {
        let mut all = effects.iter_mut();
        let own = all.find(|one| one.id == EffectId::CrossCoupling);
        let beside = own.as_ref().and_then(|one| one.value("coupling"));
        let total = found.coupling + beside.unwrap_or(0.0);
        let whole = Effect::from_pairs(EffectId::CrossCoupling, &[("coupling", total)]).ok()?;
        match own {
            Some(own) => *own = whole,
            None => effects.push(whole),
        }
    }
    let mut text = heading(diagnosis, found);
    text.push_str(&described(test, found));
    for effect in &effects {
        let values = effect.values().map(|(info, value)| line(info.name, value));
        text.push_str(&effect_table(effect.id, &values.collect::<String>()));
    }
    Some(UpdatedModel {
        hypothesis: found.hypothesis.name(),
        text,
    })
}

fn heading(diagnosis: &Diagnosis, found: &HypothesisResult) -> String {
    let found_or_supposed = match diagnosis.verdict {
        Verdict::NoGap | Verdict::Named(_) => "what the diagnosis found",
        _ => "the most probable hypothesis, which the diagnosis does not establish",
    };
    format!(
        "# The model with {found_or_supposed} (verdict: {}; hypothesis: {}, {:.1} %).\n\
         # Natural frequencies: `tapjoint predict` with this file.\n\n",
        diagnosis.verdict.kind(),
        found.hypothesis.name(),
        100.0 * found.probability
    )
}

fn quoted(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

fn line(key: &str, value: f64) -> String {
    if value.is_infinite() {
        format!("{key} = \"rigid\"\n")
    } else {
        // Debug's form is the shortest that reads back as the same number, and TOML's.
        format!("{key} = {value:?}\n")
    }
}

/// Beam, joint and sensors of the reference configuration.
fn described(test: &TestDescription, found: &HypothesisResult) -> String {
    let beam = &test.beam;
    let mut text = format!("name = {}\n\n[beam]\n", quoted(&test.name));
    let described = described_beam(test);
    // Within its tolerance the fit moves each property to where the readings ask for it.
    let fitted = found.beam.unwrap_or(described);
    // The fit's length is that of the left half of a lap joint, the described one that of both.
    let stretched = fitted.length / described_specimen(test, None).body.beams()[0].length;
    let properties = [
        ("length", beam.length, stretched * beam.length),
        ("width", beam.width, fitted.width),
        ("thickness", beam.thickness, fitted.thickness),
        ("modulus", beam.modulus, fitted.modulus),
        ("density", beam.density, fitted.density),
    ];
    for (key, described, fitted) in properties {
        if fitted != described {
            text.push_str(&format!("# Described: {described}.\n"));
        }
        text.push_str(&line(key, fitted));
    }
    if beam.poisson.is_some() || fitted.poisson != described.poisson {
        text.push_str(&line("poisson", fitted.poisson));
    }
    if let Some(right) = &test.joint.right {
        text.push_str("\n[beam.right]\n");
        // Both halves are wrong by the same factor.
        let own = [
            ("width", right.width, fitted.width / beam.width),
            (
                "thickness",
                right.thickness,
                fitted.thickness / beam.thickness,
            ),
            ("modulus", right.modulus, fitted.modulus / beam.modulus),
            ("density", right.density, fitted.density / beam.density),
            ("poisson", right.poisson, 1.0),
        ];
        for (key, described, factor) in own {
            text.extend(described.map(|described| line(key, factor * described)));
        }
    }
    text.push_str(&joint(test, found));
    text.push_str(&sensors(test));
    text.push_str(&fastened(test));
    if !test.analysis.sensor_mass {
        text.push_str("\n[analysis]\nsensor_mass = false\n");
    }
    text
}

fn joint(test: &TestDescription, found: &HypothesisResult) -> String {
    let kind = match test.joint.kind {
        Assembly::Cantilever => "cantilever",
        Assembly::Lap => "lap",
        Assembly::Free => "free",
    };
    let beam = match test.joint.beam {
        BeamTheory::Euler => "euler",
        BeamTheory::Timoshenko => "timoshenko",
    };
    let mut text = format!("\n[joint]\nkind = \"{kind}\"\nbeam = \"{beam}\"\n");
    if let Some([kt, kr]) = found.joint {
        text.push_str(&line("kt", kt));
        text.push_str(&line("kr", kr));
    }
    text.extend(
        test.joint
            .position
            .map(|position| line("position", position)),
    );
    if let Some(overlap) = &test.joint.overlap {
        text.push_str(&format!(
            "overlap = {{ length = {:?}, mass = {:?} }}\n",
            overlap.length, overlap.mass
        ));
    }
    text
}

/// Sensors where the first recording has them.
fn sensors(test: &TestDescription) -> String {
    // A microphone is not on the beam.
    let on_beam = test
        .sensors
        .iter()
        .filter(|sensor| sensor.kind != SensorKind::Sound);
    let tables = on_beam.filter_map(|sensor| {
        let position = test.place_of(sensor)?;
        let mut text = format!("\n[[sensor]]\nname = {}\n", quoted(&sensor.name));
        text.push_str(&line("position", position));
        text.extend(sensor.mass.map(|mass| line("mass", mass)));
        Some(text)
    });
    tables.collect()
}

/// Above the tables of what is fastened in the first recording: an effect is hidden from who analyses what is
/// simulated with it, and what is fastened was known.
const KNOWN_MASSES: &str = "\n# Known, not found: what was fastened in the first recording. Where recordings are \
                            added for\n# `tapjoint simulate`, move it into their [[recording.mass]] tables.";

/// The masses of the first recording: no recording describes it any more.
fn fastened(test: &TestDescription) -> String {
    let masses = test
        .reference_recording()
        .map(|recording| &recording.masses);
    let mut tables = String::new();
    for fastened in masses.into_iter().flatten() {
        let values = line("mass", fastened.mass) + &line("position", fastened.position);
        tables.push_str(&effect_table(EffectId::AddedMass, &values));
    }
    match tables.is_empty() {
        true => tables,
        false => format!("{KNOWN_MASSES}{tables}"),
    }
}

fn effect_table(id: EffectId, values: &str) -> String {
    format!("\n[[effect]]\nid = \"{}\"\n{values}", id.name())
}

/// The effects that a description adds to its structure.
///
/// # Errors
/// The first that there is not, with the line of its table.
pub fn described_effects(test: &TestDescription) -> Result<Vec<Effect>, DescribedEffectError> {
    let mut effects = Vec::new();
    for described in &test.effects {
        let values = described.values.iter();
        let pairs: Vec<(&str, f64)> = values
            .map(|(name, value)| (name.as_str(), *value))
            .collect();
        let effect = EffectId::parse(&described.id).and_then(|id| Effect::from_pairs(id, &pairs));
        effects.push(effect.map_err(|cause| DescribedEffectError {
            line: Some(described.line),
            cause: cause.into(),
        })?);
    }
    Ok(effects)
}

/// Returns the lowest `count` natural frequencies (Hz) of a described structure, as they would be read. Its described
/// effects and its sensors count.
///
/// # Errors
/// [`DescribedEffectError`]: the first effect that does not exist or that the structure cannot have, or a fault of
/// the structure itself.
pub fn described_frequencies(
    test: &TestDescription,
    count: usize,
) -> Result<Vec<f64>, DescribedEffectError> {
    let (seen, frequencies) = described_structure(test, count)?;
    Ok(frequencies.into_iter().map(|one| seen.read(one)).collect())
}

/// Returns a described structure with its described effects and its sensors, and its lowest `count` natural
/// frequencies (Hz). These are the structure's own, before any effect of the acquisition.
///
/// # Errors
/// As [`described_frequencies`].
pub fn described_structure(
    test: &TestDescription,
    count: usize,
) -> Result<(Seen, Vec<f64>), DescribedEffectError> {
    let effects = described_effects(test)?;
    structure_with(test, &effects, count).map_err(|error| {
        // The first effect with which there is no such structure is the one to be mended.
        let first = (0..=effects.len()).find_map(|held| {
            let cause = structure_with(test, &effects[..held], count).err()?;
            Some((held, cause))
        });
        let (held, error) = first.unwrap_or((effects.len(), error));
        let described = held
            .checked_sub(1)
            .and_then(|place| test.effects.get(place));
        DescribedEffectError {
            line: described.map(|effect| effect.line),
            cause: error.into(),
        }
    })
}

/// A described structure with these effects and with its sensors on it, and its lowest natural frequencies (Hz). A
/// fixture's own mode does not count.
///
/// # Errors
/// [`StructureError`] where there is no such structure.
fn structure_with(
    test: &TestDescription,
    effects: &[Effect],
    count: usize,
) -> Result<(Seen, Vec<f64>), StructureError> {
    let nominal = nominal_with(test, None);
    let mut specimen = nominal.specimen.clone();
    let places: Vec<PointMass> = test
        .sensors
        .iter()
        .zip(&nominal.sensors)
        .filter(|(sensor, _)| sensor.kind != SensorKind::Sound)
        .filter_map(|(sensor, known)| {
            Some(PointMass::new(
                test.place_of(sensor)?,
                known.mass.unwrap_or(0.0),
            ))
        })
        .collect();
    let heavy = places.iter().filter(|sensor| sensor.mass > 0.0);
    specimen.masses.extend(heavy);
    let masses = test
        .reference_recording()
        .map(|recording| &recording.masses);
    specimen.masses.extend(masses.into_iter().flatten());
    // A joint that changes with amplitude is seen at the amplitude that counts for a whole decay.
    let power = effects.iter().find_map(|effect| effect.value("exponent"));
    let circumstances = Circumstances {
        sensors: &places,
        level: effective_share(power.unwrap_or(1.0)),
        ..Circumstances::default()
    };
    let seen = apply(effects, &specimen, &circumstances);
    let own = seen.specimen.beam_modes(count, Mesh::SIMULATION)?;
    let all = own.modes.frequencies();
    let frequencies = own.numbers.iter().map(|&mode| all[mode]).collect();
    Ok((seen, frequencies))
}
