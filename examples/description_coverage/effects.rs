//! Tests of cantilevers with an effect that their description lacks, through the whole program: description, estimate,
//! diagnosis, headline.

use super::worlds::{log_uniform, normal};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use tapjoint::effects::{Circumstances, Effect, EffectId, apply};
use tapjoint::gap::{Diagnosis, GapSettings, Verdict};
use tapjoint::report::document::HeadlineValue;
use tapjoint::report::{document_of, gap_section};
use tapjoint::structure::specimen::{Joint, LapLayout, Mesh, PointMass, Specimen};
use tapjoint::structure::{Assembly, Beam, BeamTheory};
use tapjoint::study::blind_check::draw_effect;
use tapjoint::{IdentifySettings, TestDescription, diagnose_test, run_test};

/// Effects that frequencies of one set-up can show, and none.
pub const PLANTED: [Option<EffectId>; 13] = [
    None,
    Some(EffectId::SensorMass),
    Some(EffectId::SensorCable),
    Some(EffectId::CrossCoupling),
    Some(EffectId::JointMass),
    Some(EffectId::Fixture),
    Some(EffectId::Modulus),
    Some(EffectId::Length),
    Some(EffectId::Timebase),
    Some(EffectId::AddedMass),
    Some(EffectId::LocalCrack),
    Some(EffectId::AxialLoad),
    Some(EffectId::ShearRotary),
];

/// What the diagnosis made of the planted effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Named {
    /// The planted effect, or effects that hold it.
    Rightly,
    /// Another effect.
    Wrongly,
    /// None.
    Nothing,
}

/// One test and its answer.
pub struct EffectAnswer {
    /// Root mean square of the changes of the frequencies by the effect at the same joint (%).
    pub moved_percent: f64,
    /// What was named.
    pub named: Named,
    /// True where the headline holds Kt and Kr.
    pub headline_holds: [bool; 2],
    /// True where the interval of the described model holds Kt and Kr.
    pub described_holds: [bool; 2],
}

/// Answers to `count` tests with this effect; the same for the same seed.
pub fn effect_answers(planted: Option<EffectId>, count: usize, seed: u64) -> Vec<EffectAnswer> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let answers = (0..count).filter_map(|_| answer(planted, &mut random));
    answers.collect()
}

fn answer(planted: Option<EffectId>, random: &mut ChaCha8Rng) -> Option<EffectAnswer> {
    let test = EffectTest::draw(planted, random);
    let description = TestDescription::parse(&test.text, "test.toml").expect("a drawn description");
    let settings = IdentifySettings::unperturbed();
    let analysis = run_test(&description, (Path::new("."), "test.toml"), &settings).ok()?;
    let diagnosis = diagnose_test(&description, &analysis, &GapSettings::default());
    let mut document = document_of(&analysis);
    let described = document.headline.clone()?;
    document.add_gap(gap_section(diagnosis.as_ref()));
    let headline = document.headline.as_ref()?;
    let [kt, kr] = test.joint;
    Some(EffectAnswer {
        moved_percent: test.moved_percent,
        named: diagnosis
            .as_ref()
            .map_or(Named::Nothing, |found| named(found, planted)),
        headline_holds: [holds(headline.kt, kt), holds(headline.kr, kr)],
        described_holds: [holds(described.kt, kt), holds(described.kr, kr)],
    })
}

fn named(found: &Diagnosis, planted: Option<EffectId>) -> Named {
    let is_planted = |one: &EffectId| planted.is_some_and(|planted| one.group() == planted.group());
    let is_right = match &found.verdict {
        Verdict::Named(effects) => effects.iter().all(is_planted),
        Verdict::Group(effects) => effects.iter().any(is_planted),
        _ => return Named::Nothing,
    };
    if is_right {
        Named::Rightly
    } else {
        Named::Wrongly
    }
}

fn holds(found: Option<HeadlineValue>, truth: f64) -> bool {
    found.is_some_and(|found| {
        found.low.is_none_or(|low| low <= truth) && found.high.is_none_or(|high| truth <= high)
    })
}

/// A drawn test.
struct EffectTest {
    text: String,
    /// Kt (N/m) and Kr (N m/rad).
    joint: [f64; 2],
    moved_percent: f64,
}

impl EffectTest {
    /// Draws a beam that differs from its description by the default tolerances, on a random joint, with one sensor whose mass is
    /// not stated. Five to eight frequencies miss the model by 0.05 % each.
    fn draw(planted: Option<EffectId>, random: &mut ChaCha8Rng) -> Self {
        let length = log_uniform(random, 0.2, 1.0);
        let described = Beam {
            length,
            width: length * log_uniform(random, 0.03, 0.12),
            thickness: length * log_uniform(random, 0.006, 0.02),
            modulus: 207e9,
            density: 7850.0,
            poisson: 0.3,
        };
        let position = length * (0.3 + 0.65 * random.random::<f64>());
        let relative = |share: f64, least: f64, value: f64| share.max(least / value);
        let mut wrong = |value: f64, std: f64| value * (1.0 + std * normal(random));
        let beam = Beam {
            length: wrong(length, relative(1e-3, 0.5e-3, length)),
            width: wrong(described.width, relative(2e-3, 0.05e-3, described.width)),
            thickness: wrong(
                described.thickness,
                relative(5e-3, 0.02e-3, described.thickness),
            ),
            modulus: wrong(described.modulus, 0.01),
            density: wrong(described.density, 0.005),
            poisson: 0.3 + 0.02 * normal(random),
        };
        let stiffness = beam.bending_stiffness();
        let kt = log_uniform(random, 100.0, 3000.0) * stiffness / beam.length.powi(3);
        let kr = log_uniform(random, 1.0, 30.0) * stiffness / beam.length;
        let joint = Joint {
            kt,
            kr,
            coupling: 0.0,
        };
        // Where shear is the effect, a beam without it is described.
        let (theory, named) = match planted {
            Some(EffectId::ShearRotary) => (BeamTheory::Euler, "euler"),
            _ => (BeamTheory::Timoshenko, "timoshenko"),
        };
        let lap = LapLayout::default();
        let specimen = Specimen::jointed(theory, &beam, Assembly::Cantilever, &lap, Some(joint));
        let count = random.random_range(5..9);
        let effects: Vec<Effect> = planted
            .map(|id| draw_effect(&beam, &[], &[id], random).expect("a size within its range"))
            .into_iter()
            .collect();
        let sensors = [PointMass::new(position.min(beam.length), 0.0)];
        let circumstances = Circumstances {
            sensors: &sensors,
            ..Circumstances::default()
        };
        let seen = apply(&effects, &specimen, &circumstances);
        let without = specimen.modes(count, Mesh::SIMULATION).expect("a beam");
        let with = seen.specimen.beam_modes(count, Mesh::SIMULATION);
        let with = with.expect("a beam with the effect");
        let reading = log_uniform(random, 2e-5, 5e-4);
        let (mut frequencies, mut stds, mut squares) = (Vec::new(), Vec::new(), 0.0);
        for mode in 0..count {
            let own = seen.read(with.modes.frequencies()[with.numbers[mode]]);
            squares += (own / without.frequencies()[mode] - 1.0).powi(2);
            let error = reading * normal(random) + 5e-4 * normal(random);
            frequencies.push(format!("{:e}", own * (1.0 + error)));
            stds.push(format!("{:e}", own * reading));
        }
        let text = format!(
            "name = \"drawn\"\n[beam]\nlength = {length:e}\nwidth = {:e}\nthickness = {:e}\nmodulus = 207e9\n\
             density = 7850\n[joint]\nkind = \"cantilever\"\nbeam = \"{named}\"\n[[sensor]]\nname = \"A\"\n\
             position = {:e}\n[measured]\nfrequencies = [{}]\nstd = [{}]\n",
            described.width,
            described.thickness,
            position.min(beam.length).min(length),
            frequencies.join(", "),
            stds.join(", "),
        );
        Self {
            text,
            joint: [kt, kr],
            moved_percent: 100.0 * (squares / count as f64).sqrt(),
        }
    }
}
