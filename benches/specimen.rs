//! Modes of a specimen with everything on it, and the derivatives that need no new solution.

#![allow(clippy::unwrap_used, reason = "in a bench a panic is the message")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;
use tapjoint::structure::Beam;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Hinge, Joint, Mesh, PointMass, Specimen};

/// A steel strip on a three-parameter joint, with a sensor and a crack.
fn strip() -> Specimen {
    let beam = Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let units = StiffnessUnits::of(&beam);
    let joint = Some(Joint {
        kt: 1400.0 * units.kt,
        kr: 1.2 * units.kr,
        coupling: 0.1,
    });
    Specimen {
        shear_rotary: 1.0,
        masses: vec![PointMass {
            position: 0.33,
            mass: 0.024,
            inertia: 0.0,
        }],
        hinges: vec![Hinge {
            position: 0.2,
            compliance: 1e-4,
        }],
        ..Specimen::new(Body::One(beam), joint)
    }
}

fn modes(criterion: &mut Criterion) {
    let specimen = strip();
    let mut other = specimen.clone();
    other.masses[0].mass = 0.025;
    let mut group = criterion.benchmark_group("seven modes of a specimen");
    for elements in [30, 60, 200] {
        let mesh = Mesh { elements };
        let solved = specimen.modes(7, mesh).unwrap();
        group.bench_function(format!("{elements} elements, solved"), |b| {
            b.iter(|| black_box(&specimen).modes(7, mesh).unwrap());
        });
        group.bench_function(format!("{elements} elements, Rayleigh's quotients"), |b| {
            b.iter(|| solved.rayleigh_frequencies(black_box(&other)).unwrap());
        });
    }
    group.finish();
}

criterion_group! {
    name = specimen;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = modes
}
criterion_main!(specimen);
