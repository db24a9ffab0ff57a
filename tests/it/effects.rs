//! The catalogue of effects, and what each does to a specimen.

use crate::joint_law::LawInClosedForm;
use crate::shared::steel_strip;
use std::f64::consts::PI;
use tapjoint::effects::{
    Circumstances, Effect, EffectError, EffectId, Group, JointLaw, JointLawKind, Place, Seen, apply,
};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Joint, Mesh, PointMass, Specimen};

const SENSORS: &[PointMass] = &[
    PointMass {
        position: 0.33,
        mass: 0.0,
        inertia: 0.0,
    },
    PointMass {
        position: 0.21,
        mass: 0.005,
        inertia: 0.0,
    },
];

fn nominal() -> Specimen {
    let units = StiffnessUnits::of(&steel_strip());
    let mut specimen = Specimen::new(
        Body::One(steel_strip()),
        Some(Joint {
            kt: 1400.0 * units.kt,
            kr: 1.2 * units.kr,
            coupling: 0.0,
        }),
    );
    // The sensor with a datasheet mass belongs to the nominal model.
    specimen.masses.push(PointMass {
        position: 0.21,
        mass: 0.005,
        inertia: 0.0,
    });
    specimen
}

fn circumstances() -> Circumstances<'static> {
    Circumstances {
        sensors: SENSORS,
        drift: [1.0, -0.5],
        ..Circumstances::default()
    }
}

/// Typical in size, at 0.13 m where it has a place.
fn typical(id: EffectId) -> Effect {
    let needs = id.parameters().iter().any(|info| info.typical.is_none());
    let pairs: &[(&str, f64)] = if needs { &[("position", 0.13)] } else { &[] };
    Effect::from_pairs(id, pairs).unwrap()
}

/// Errors of the set-up leave the specimen as it is.
fn of_the_specimen() -> impl Iterator<Item = EffectId> {
    let all = EffectId::ALL.into_iter();
    all.filter(|id| id.group() != Group::SetUp)
}

fn absent(id: EffectId) -> Effect {
    let sizes = id.size_parameters().iter();
    sizes.fold(typical(id), |effect, name| effect.with(name, 0.0).unwrap())
}

fn read(seen: &Seen) -> Vec<f64> {
    let modes = seen.specimen.modes(5, Mesh::DIAGNOSIS).unwrap();
    modes.frequencies().iter().map(|f| seen.read(*f)).collect()
}

fn read_with(effects: &[Effect]) -> Vec<f64> {
    read(&apply(effects, &nominal(), &circumstances()))
}

// ---------------------------------------------------------------------------------------------
// Names

#[test]
fn prop_names_are_read_back() {
    for id in EffectId::ALL {
        assert_eq!(EffectId::parse(id.name()).unwrap(), id);
        assert!(!id.meaning().is_empty());
        for info in id.parameters() {
            assert!(info.lowest < info.highest, "{} {}", id.name(), info.name);
            assert!(
                info.typical
                    .is_none_or(|t| info.lowest <= t && t <= info.highest)
            );
        }
        let names: Vec<&str> = id.parameters().iter().map(|info| info.name).collect();
        assert!(id.size_parameters().iter().all(|name| names.contains(name)));
    }
}

#[test]
fn val_places_groups_and_parameters_are_those_of_the_table() {
    let table: [(&str, &str, &str, &[&str]); 24] = [
        ("sensor-mass", "sensor", "sensor-mass", &["mass"]),
        ("sensor-cable", "sensor", "sensor-cable", &["stiffness"]),
        ("cross-coupling", "joint", "cross-coupling", &["coupling"]),
        ("joint-mass", "joint", "joint-mass", &["mass", "inertia"]),
        (
            "joint-nonlinearity",
            "joint",
            "joint-nonlinearity",
            &["ratio", "exponent"],
        ),
        ("joint-damping", "joint", "joint-damping", &["loss_factor"]),
        ("joint-drift", "joint", "joint-drift", &["std"]),
        (
            "joint-compliance",
            "joint",
            "joint-compliance",
            &["rotation", "translation"],
        ),
        ("fixture", "fixture", "fixture", &["frequency", "ratio"]),
        ("modulus", "body", "scale", &["relative"]),
        ("length", "body", "scale", &["relative"]),
        ("density", "body", "scale", &["relative"]),
        ("thickness", "body", "scale", &["relative"]),
        ("timebase", "acquisition", "scale", &["relative"]),
        ("added-mass", "body", "added-mass", &["mass", "position"]),
        (
            "local-crack",
            "body",
            "local-crack",
            &["compliance", "position"],
        ),
        ("axial-load", "body", "offset", &["force"]),
        ("shear-rotary", "body", "shear-rotary", &["factor"]),
        ("resolution", "acquisition", "offset", &["offset"]),
        (
            "sensor-position",
            "acquisition",
            "set-up",
            &["offset", "sensor", "recording"],
        ),
        ("sensor-polarity", "acquisition", "set-up", &["sensor"]),
        ("sensor-swap", "acquisition", "set-up", &["sensor", "other"]),
        (
            "sensor-scale",
            "acquisition",
            "set-up",
            &["relative", "sensor"],
        ),
        (
            "tap-position",
            "acquisition",
            "set-up",
            &["offset", "recording"],
        ),
    ];
    for (id, (name, place, group, parameters)) in EffectId::ALL.into_iter().zip(table) {
        assert_eq!(
            (id.name(), id.place().name(), id.group().name()),
            (name, place, group)
        );
        let names: Vec<&str> = id.parameters().iter().map(|info| info.name).collect();
        assert_eq!(names, parameters, "{name}");
    }
    assert_eq!(EffectId::Fixture.group(), Group::Own(EffectId::Fixture));
    assert_eq!(Place::ALL.len(), 5);
}

#[test]
fn prop_unknown_names_suggest_the_nearest() {
    let text = EffectId::parse("sensor_mas").unwrap_err().to_string();
    assert!(text.contains("did you mean `sensor-mass`?"), "{text}");
    let text = EffectId::parse("qqqq").unwrap_err().to_string();
    assert!(
        !text.contains("did you mean") && text.contains("local-crack"),
        "{text}"
    );
    let unknown = Effect::from_pairs(EffectId::AddedMass, &[("postion", 0.1)]);
    let text = unknown.unwrap_err().to_string();
    assert!(
        text.contains("did you mean `position`?") && text.contains("mass"),
        "{text}"
    );
}

#[test]
fn limit_values_are_checked() {
    let missing = Effect::from_pairs(EffectId::AddedMass, &[("mass", 0.1)]).unwrap_err();
    assert!(
        matches!(
            missing,
            EffectError::Missing {
                name: "position",
                ..
            }
        ),
        "{missing}"
    );
    let id = EffectId::SensorMass;
    let negative = Effect::from_pairs(id, &[("mass", -0.1)])
        .unwrap_err()
        .to_string();
    assert_eq!(
        negative,
        "`sensor-mass`: mass is -0.1, but must lie between 0 and 1 kg"
    );
    assert!(Effect::from_pairs(id, &[("mass", f64::NAN)]).is_err());
    let infinite = [("mass", 0.1), ("position", f64::INFINITY)];
    assert!(Effect::from_pairs(EffectId::AddedMass, &infinite).is_err());
    let twice = Effect::from_pairs(id, &[("mass", 0.1), ("mass", 0.2)]).unwrap_err();
    assert!(matches!(twice, EffectError::Twice { .. }));
    let effect = Effect::from_pairs(id, &[("mass", 0.024)]).unwrap();
    assert_eq!(effect.value("mass"), Some(0.024));
    assert_eq!(effect.value("position"), None);
}

// ---------------------------------------------------------------------------------------------
// Physics

#[test]
fn limit_effects_of_no_size_change_nothing() {
    let untouched = read(&apply(&[], &nominal(), &circumstances()));
    for id in EffectId::ALL {
        let seen = apply(&[absent(id)], &nominal(), &circumstances());
        // A mass or spring of nothing is another specimen with the same numbers.
        assert_eq!(read(&seen), untouched, "{}", id.name());
        assert_eq!((seen.joint_loss_factor, seen.joint_law), (0.0, None));
    }
}

#[test]
fn prop_every_effect_of_typical_size_is_seen() {
    let untouched = read_with(&[]);
    // A base inserts a mode of its own, so that numbers shift.
    for id in of_the_specimen().filter(|id| *id != EffectId::Fixture) {
        let seen = apply(&[typical(id)], &nominal(), &circumstances());
        let shift = read(&seen)
            .iter()
            .zip(&untouched)
            .map(|(a, b)| (a / b - 1.0).abs())
            .fold(0.0, f64::max);
        let damped = seen.joint_loss_factor > 0.0;
        assert!(
            damped != (shift > 1e-4 && shift < 0.2),
            "{}: {shift:e}",
            id.name()
        );
    }
}

/// The derivative of every frequency with every size, from one solution, against new solutions.
#[test]
fn prop_rayleighs_quotient_has_the_exact_derivative() {
    for id in of_the_specimen().filter(|id| *id != EffectId::Fixture) {
        let effect = typical(id);
        let name = id.parameters()[0].name;
        let size = effect.value(name).unwrap();
        let seen_at = |factor: f64| {
            let changed = effect.with(name, factor * size).unwrap();
            apply(&[changed], &nominal(), &circumstances())
        };
        let step = 1e-3;
        let [low, middle, high] = [1.0 - step, 1.0, 1.0 + step].map(seen_at);
        let modes = middle.specimen.modes(5, Mesh::DIAGNOSIS).unwrap();
        let [low_quotient, high_quotient] =
            [&low, &high].map(|seen| modes.rayleigh_frequencies(&seen.specimen).unwrap());
        let [low_solved, high_solved] =
            [&low, &high].map(|seen| seen.specimen.modes(5, Mesh::DIAGNOSIS).unwrap());
        for mode in 0..5 {
            let quotient = high_quotient[mode] - low_quotient[mode];
            let solved = high_solved.frequencies()[mode] - low_solved.frequencies()[mode];
            // The quotient is stationary to what the second-order term leaves, 1e-5 of the slope
            // of its own correction; differences of frequencies round at 1e-13.
            let tolerance = 1e-4 * solved.abs() + 1e-9 * modes.frequencies()[mode];
            assert!(
                (quotient - solved).abs() < tolerance,
                "{} mode {mode}: {quotient:e} for {solved:e}",
                id.name()
            );
        }
    }
}

#[test]
fn val_clock_error_is_pure_scaling() {
    let off = Effect::from_pairs(EffectId::Timebase, &[("relative", 50e-6)]).unwrap();
    for (a, b) in read_with(&[off]).iter().zip(read_with(&[])) {
        assert!((a / b - 1.0 - 50e-6).abs() < 1e-14);
    }
}

#[test]
fn val_reading_bias_is_pure_offset() {
    let off = Effect::from_pairs(EffectId::Resolution, &[("offset", -0.125)]).unwrap();
    for (a, b) in read_with(&[off]).iter().zip(read_with(&[])) {
        assert!((a - b + 0.125).abs() < 1e-12 * b);
    }
}

#[test]
fn val_properties_of_the_beam_scale_a_clamped_beam() {
    let clamped = Specimen {
        joint: Some(Joint::RIGID),
        ..nominal()
    };
    // f ~ h L^-2 sqrt(E/rho); the beam's mass changes too, so that only the bare beam scales.
    let bare = Specimen {
        masses: Vec::new(),
        ..clamped
    };
    let base = read(&apply(&[], &bare, &circumstances()));
    let powers = [
        (EffectId::Modulus, 0.5),
        (EffectId::Length, -2.0),
        (EffectId::Density, -0.5),
        (EffectId::Thickness, 1.0),
    ];
    for (id, power) in powers {
        let effect = Effect::from_pairs(id, &[("relative", 0.01)]).unwrap();
        let found = read(&apply(&[effect], &bare, &circumstances()));
        for (a, b) in found.iter().zip(&base) {
            // Rounding of a re-solution.
            assert!(
                (a / b / 1.01f64.powf(power) - 1.0).abs() < 1e-11,
                "{}",
                id.name()
            );
        }
    }
}

#[test]
fn val_a_rigid_joint_that_gives_has_the_stiffness_of_the_compliance() {
    let rigid = Specimen {
        joint: Some(Joint::RIGID),
        ..nominal()
    };
    let sizes = [("rotation", 0.05), ("translation", 0.001)];
    let effect = Effect::from_pairs(EffectId::JointCompliance, &sizes).unwrap();
    let seen = apply(&[effect], &rigid, &circumstances());
    let units = StiffnessUnits::of(&steel_strip());
    let [kt, kr] = seen.specimen.joint_stiffnesses();
    // E I/L over the stiffness.
    assert!((units.kr / kr - 0.05).abs() < 1e-15 && (units.kt / kt - 0.001).abs() < 1e-15);
}

#[test]
fn prop_sensor_mass_is_added_only_where_it_is_unknown() {
    let effect = Effect::from_pairs(EffectId::SensorMass, &[("mass", 0.024)]).unwrap();
    let seen = apply(&[effect], &nominal(), &circumstances());
    let masses: Vec<(f64, f64)> = seen
        .specimen
        .masses
        .iter()
        .map(|m| (m.position, m.mass))
        .collect();
    assert_eq!(masses, [(0.21, 0.005), (0.33, 0.024)]);
}

#[test]
fn prop_a_stretched_beam_keeps_its_places_in_proportion() {
    let stretch = Effect::from_pairs(EffectId::Length, &[("relative", -0.01)]).unwrap();
    let tip = Effect::from_pairs(EffectId::AddedMass, &[("mass", 0.01), ("position", 0.423)]);
    // In either order: places are given on the nominal beam.
    for effects in [
        [stretch.clone(), tip.clone().unwrap()],
        [tip.unwrap(), stretch],
    ] {
        let seen = apply(&effects, &nominal(), &circumstances());
        let length = seen.specimen.body.length();
        assert!((length - 0.99 * 0.423).abs() < 1e-15);
        assert_eq!(seen.specimen.masses[1].position, length);
        assert!(seen.specimen.modes(1, Mesh::DIAGNOSIS).is_ok());
    }
}

#[test]
fn prop_the_base_keeps_its_stiffness_when_the_joint_drifts() {
    let drift = Effect::from_pairs(EffectId::JointDrift, &[("std", 0.1)]).unwrap();
    let fixture = typical(EffectId::Fixture);
    let stiffness = |effects: &[Effect]| {
        let specimen = apply(effects, &nominal(), &circumstances()).specimen;
        specimen.joint_stiffnesses()[1] / specimen.base.unwrap().ratio
    };
    let alone = stiffness(std::slice::from_ref(&fixture));
    for both in [
        [drift.clone(), fixture.clone()],
        [fixture.clone(), drift.clone()],
    ] {
        assert!((stiffness(&both) / alone - 1.0).abs() < 1e-14);
    }
}

#[test]
fn val_tap_level_moves_the_joint_by_its_power() {
    let effect = Effect::from_pairs(
        EffectId::JointNonlinearity,
        &[("ratio", -0.2), ("exponent", 2.0)],
    );
    let effect = effect.unwrap();
    let [_, soft] = nominal().joint_stiffnesses();
    for level in [0.0, 0.25, 1.0] {
        let seen = apply(
            std::slice::from_ref(&effect),
            &nominal(),
            &Circumstances {
                level,
                ..circumstances()
            },
        );
        let [_, kr] = seen.specimen.joint_stiffnesses();
        assert!((kr / soft - (1.0 - 0.2 * level * level)).abs() < 1e-14);
        assert_eq!(seen.joint_law.unwrap().kind(), JointLawKind::Elastic);
    }
}

// ---------------------------------------------------------------------------------------------
// The law of the non-linear joint

/// First harmonic in phase with the rotation a sin t, over k0 a, and the loss per cycle over k0,
/// summed over a cycle of Masing's branches or of the elastic law.
fn by_summation(law: &JointLaw, hardest: f64, amplitude: f64) -> (f64, f64) {
    const STEPS: usize = 200_000;
    let c = law.coefficient(hardest);
    let crest = law.first_loading(amplitude, c);
    let moment = |rotation: f64, rising: bool| match (law.kind(), rising) {
        (JointLawKind::Elastic, _) => law.first_loading(rotation, c),
        (JointLawKind::MicroSlip, true) => {
            -crest + 2.0 * law.first_loading(0.5 * (rotation + amplitude), c)
        }
        (JointLawKind::MicroSlip, false) => {
            crest - 2.0 * law.first_loading(0.5 * (amplitude - rotation), c)
        }
    };
    let (mut in_phase, mut loss) = (0.0, 0.0);
    let step = 2.0 * PI / STEPS as f64;
    for i in 0..STEPS {
        let (sine, cosine) = ((i as f64 + 0.5) * step).sin_cos();
        let m = moment(amplitude * sine, cosine > 0.0);
        in_phase += m * sine * step / (PI * amplitude);
        loss += m * amplitude * cosine * step;
    }
    (in_phase, loss)
}

#[test]
fn val_secant_and_loss_are_those_of_the_hysteresis_loop() {
    for (ratio, exponent) in [
        (-0.1, 2.0),
        (0.2, 2.0),
        (-0.1, 1.0),
        (-0.3, 0.5),
        (-0.05, 1.5),
        (0.1, 1.0),
    ] {
        let law = JointLaw { ratio, exponent };
        let hardest = 0.02;
        for level in [1.0, 0.3] {
            let amplitude = level * hardest;
            let (secant, loss) = by_summation(&law, hardest, amplitude);
            // The midpoint sum of a branch that begins with the power 1 + p leaves 1e-8.
            assert!(
                (secant - law.secant(level)).abs() < 1e-7,
                "{law:?} {level}: {secant}"
            );
            let expected = law.loss_per_cycle(amplitude, law.coefficient(hardest));
            assert!(
                (loss - expected).abs() < 1e-7 * amplitude * amplitude,
                "{law:?}: {loss}"
            );
            let factor = loss / (PI * secant * amplitude * amplitude);
            assert!(
                (factor - law.loss_factor(level)).abs() < 1e-6,
                "{law:?} {factor}"
            );
        }
    }
}

#[test]
fn val_cubic_spring_has_three_quarters() {
    let law = JointLaw {
        ratio: -0.09,
        exponent: 2.0,
    };
    assert!((law.coefficient(0.1) * 0.01 * 0.75 + 0.09).abs() < 1e-15);
}

#[test]
fn prop_sliders_make_the_first_loading() {
    let law = JointLaw {
        ratio: -0.2,
        exponent: 0.8,
    };
    let (c, end, steps) = (law.coefficient(1.0), 0.7, 20_000);
    // M'(0) - M'(end) = sum of the sliders that slip below end; substitution s = end u^4 softens
    // the density's pole at 0.
    let step = 1.0 / f64::from(steps);
    let slipped: f64 = (0..steps)
        .map(|i| {
            let u = (f64::from(i) + 0.5) * step;
            law.slider_density(end * u.powi(4), c) * 4.0 * end * u.powi(3) * step
        })
        .sum();
    let slope = |x: f64| (law.first_loading(x + 1e-6, c) - law.first_loading(x - 1e-6, c)) / 2e-6;
    assert!((1.0 - slope(end) - slipped).abs() < 1e-6, "{slipped}");
}
