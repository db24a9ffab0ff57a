//! How the time of a diagnosis grows with recordings and modes: `cargo run --release --example diagnosis_speed`.
//!
//! Prints the time on one core (s) of virtual tests with a crack. Then it prints the exponent of the growth from each number of
//! recordings, and of modes, to the next: 1 where the time doubles with the number. The diagnosis compares ten modes at
//! most, so that more of them cost nothing.

use std::error::Error;
use std::time::Instant;
use tapjoint::effects::{Effect, EffectId};
use tapjoint::gap::{
    DescriptionUncertainty, GapError, GapSettings, Nominal, NominalSensor, PlannedConfiguration,
    TestPlan, diagnose, observe,
};
use tapjoint::structure::Beam;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Joint, Specimen};

const LENGTH: f64 = 0.423;
const RECORDINGS: [usize; 5] = [2, 5, 10, 20, 50];
const MODES: [usize; 5] = [3, 6, 10, 20, 40];
/// The shortest of so many times is printed: what else the machine does interrupts few of them.
const REPEATS: usize = 2;

/// A steel strip on a joint, with one sensor without mass.
fn strip() -> Nominal {
    let beam = Beam {
        length: LENGTH,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let units = StiffnessUnits::of(&beam);
    let joint = Joint {
        kt: 1400.0 * units.kt,
        kr: 1.25 * units.kr,
        coupling: 0.0,
    };
    Nominal {
        specimen: Specimen::new(Body::One(beam), Some(joint)),
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

/// Recordings with two places of the sensor, three of the taps, and two levels, in turn.
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
    let configurations = all.iter().cycle().take(recordings).map(recording);
    TestPlan {
        configurations: configurations.collect(),
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

/// Returns the time of a diagnosis (s).
fn seconds(recordings: usize, modes: usize, crack: &Effect) -> Result<f64, GapError> {
    let (nominal, settings) = (strip(), GapSettings::default());
    let observed = observe(
        &plan(recordings, modes),
        &nominal,
        std::slice::from_ref(crack),
        7,
    )?;
    let mut shortest = f64::INFINITY;
    for _ in 0..REPEATS {
        let begin = Instant::now();
        diagnose(&observed, &nominal, &settings)?;
        shortest = shortest.min(begin.elapsed().as_secs_f64());
    }
    Ok(shortest)
}

/// Returns the exponent p of t ~ n^p between two numbers with their times.
fn exponent(numbers: &[usize], times: [f64; 2]) -> f64 {
    (times[1] / times[0]).ln() / (numbers[1] as f64 / numbers[0] as f64).ln()
}

fn print_head(title: &str) {
    print!("{title:14}");
    MODES.iter().for_each(|modes| print!("{modes:8}"));
    println!(" modes");
}

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let crack = Effect::from_pairs(
        EffectId::LocalCrack,
        &[("compliance", 0.01), ("position", 0.17)],
    )?;
    print_head("seconds");
    let mut table: Vec<Vec<f64>> = Vec::new();
    for recordings in RECORDINGS {
        let mut row = Vec::new();
        print!("{recordings:3} recordings");
        for modes in MODES {
            row.push(seconds(recordings, modes, &crack)?);
            print!("{:8.3}", row[row.len() - 1]);
        }
        println!();
        table.push(row);
    }
    print_head("by recordings");
    for (numbers, rows) in RECORDINGS.windows(2).zip(table.windows(2)) {
        print!("{:8} to {:2}", numbers[0], numbers[1]);
        for (before, after) in rows[0].iter().zip(&rows[1]) {
            print!("{:8.2}", exponent(numbers, [*before, *after]));
        }
        println!();
    }
    print_head("by modes");
    for (recordings, row) in RECORDINGS.iter().zip(&table) {
        print!("{recordings:3} recordings        ");
        for (numbers, times) in MODES.windows(2).zip(row.windows(2)) {
            print!("{:8.2}", exponent(numbers, [times[0], times[1]]));
        }
        println!();
    }
    Ok(())
}
