//! What a diagnosis costs with more readings and with more hypotheses, beside one solution of the
//! structure's modes, which is what all of it is made of.

#![allow(clippy::unwrap_used, reason = "in a bench a panic is the message")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;
use tapjoint::effects::{Effect, EffectId};
use tapjoint::gap::{
    DescriptionUncertainty, GapSettings, Nominal, NominalSensor, PlannedConfiguration, TestPlan,
    diagnose, observe,
};
use tapjoint::structure::Beam;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Joint, Mesh, Specimen};

const LENGTH: f64 = 0.423;

fn strip(held: bool) -> Nominal {
    let beam = Beam {
        length: LENGTH,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let units = StiffnessUnits::of(&beam);
    let joint = held.then_some(Joint {
        kt: 1400.0 * units.kt,
        kr: 1.25 * units.kr,
        coupling: 0.0,
    });
    Nominal {
        specimen: Specimen::new(Body::One(beam), joint),
        sensors: vec![NominalSensor {
            name: "A".to_owned(),
            mass: None,
            position: None,
        }],
        joint_before: None,
        uncertainty: DescriptionUncertainty::default(),
        reading_bias: None,
    }
}

/// The first of five recordings: two sensor places, three tap places, two levels.
fn plan(recordings: usize, modes: usize) -> TestPlan {
    let all = [
        (0.8, 0.95, 1.0),
        (0.45, 0.95, 1.0),
        (0.8, 0.95, 0.25),
        (0.8, 0.55, 1.0),
        (0.45, 0.3, 1.0),
    ];
    let recording = |&(sensor, tap, level): &(f64, f64, f64)| PlannedConfiguration {
        sensors: vec![("A".to_owned(), sensor * LENGTH)],
        masses: Vec::new(),
        tap: tap * LENGTH,
        level,
    };
    TestPlan {
        configurations: all[..recordings].iter().map(recording).collect(),
        modes,
        taps: 5,
        frequency_std: 1e-4,
        shape_std: Some(0.03),
        damping_std: Some(0.03),
        slope_std: Some(1e-4),
        drift: 0.003,
        damping: 0.003,
        scatter: 1.0,
    }
}

/// A crack; two effects, of which no single one is enough.
fn planted(count: usize) -> Vec<Effect> {
    let crack = [("compliance", 0.01), ("position", 0.17)];
    let mass = [("mass", 0.02), ("position", 0.3)];
    [
        Effect::from_pairs(EffectId::LocalCrack, &crack).unwrap(),
        Effect::from_pairs(EffectId::AddedMass, &mass).unwrap(),
    ][..count]
        .to_vec()
}

fn diagnosis(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("diagnosis");
    group.sample_size(10);
    group.measurement_time(Duration::from_secs(6));
    let held = strip(true);
    group.bench_function("beside it: seven modes of the structure", |b| {
        b.iter(|| black_box(&held.specimen).modes(7, Mesh::DIAGNOSIS).unwrap());
    });
    // (held by a joint, recordings, modes, effects planted)
    let cases = [
        (true, 1, 4, 1),
        (true, 1, 6, 1),
        (true, 2, 6, 1),
        (true, 3, 6, 1),
        (true, 5, 6, 1),
        (true, 5, 8, 1),
        (true, 5, 6, 0),
        (true, 5, 6, 2),
        (false, 5, 6, 1),
    ];
    for (is_held, recordings, modes, effects) in cases {
        let nominal = strip(is_held);
        let observed = observe(&plan(recordings, modes), &nominal, &planted(effects), 7).unwrap();
        let settings = GapSettings::default();
        let found = diagnose(&observed, &nominal, &settings).unwrap();
        let name = format!(
            "{} beam, {recordings} recordings, {modes} modes, {effects} effects: {} hypotheses",
            if is_held { "held" } else { "free" },
            found.hypotheses.len()
        );
        group.bench_function(name, |b| {
            b.iter(|| diagnose(black_box(&observed), &nominal, &settings).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, diagnosis);
criterion_main!(benches);
