//! Series of tests: how often nothing is called a change, and how soon a change is seen.
//!
//! Beside it stands a CUSUM for each mode that knows what this program does not: the frequencies before, the scatter, and
//! the size of the change. It gives one false alarm in 200 tests, all modes together. Its reference is half of the step (Page
//! 1954, "Continuous inspection schemes", Biometrika 41), and for a drift the best of several.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StudentT};
use rayon::prelude::*;
use tapjoint::compare::{Item, MeasuredMode, Settings, Test, watch};
use tapjoint::structure::specimen::{Mesh, Specimen};
use tapjoint::study::blind_check::{log_uniform, normal};
use tapjoint::study::change_check::{ChangeClass, structure};

/// False alarms per test.
const FALSE_ALARM: f64 = 1.0 / 200.0;
/// Tests of a series in which nothing changes.
const LONG: usize = 100;
/// Most tests after a change.
const WATCHED: usize = 40;
/// Step (1), drift for each test (1).
const STEP: f64 = 0.005;
const DRIFT: f64 = 0.001;
/// References of the CUSUM that are tried for a drift, in standard deviations.
const REFERENCES: [f64; 6] = [0.25, 0.5, 0.75, 1.0, 1.5, 2.5];
/// Series from which the CUSUM has its limit, and tests of each.
const CALIBRATED: [usize; 2] = [400, 400];
const MODES: usize = 5;
const REPEATABILITIES: [f64; 4] = [5e-4, 1e-3, 2e-3, 4e-3];
const BEFORE: [usize; 2] = [10, 30];

/// Shape of the scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Normal,
    /// Student's with four degrees of freedom.
    LongTailed,
    Uniform,
}

const SHAPES: [Shape; 3] = [Shape::Normal, Shape::LongTailed, Shape::Uniform];

/// Scatter of the tests.
#[derive(Debug, Clone, Copy)]
struct Noise {
    shape: Shape,
    /// Share of the variance that all modes of a test have in common (1).
    share: f64,
    /// Standard deviation of the difference of two tests (1).
    repeatability: f64,
}

impl Noise {
    /// Returns the standard deviation of one test (1).
    fn std(self) -> f64 {
        self.repeatability / 2.0_f64.sqrt()
    }

    /// Draws one value with standard deviation 1.
    fn one(self, draw: &mut ChaCha8Rng) -> f64 {
        match self.shape {
            Shape::Normal => normal(draw),
            Shape::LongTailed => {
                let tail: f64 = StudentT::new(4.0).map_or(0.0, |t| t.sample(draw));
                tail / 2.0_f64.sqrt()
            }
            Shape::Uniform => 12.0_f64.sqrt() * (draw.random::<f64>() - 0.5),
        }
    }

    /// Draws what one test is off in each mode, in standard deviations.
    fn test(self, draw: &mut ChaCha8Rng, modes: usize) -> Vec<f64> {
        let common = self.share.sqrt() * self.one(draw);
        let own = (1.0 - self.share).sqrt();
        (0..modes).map(|_| common + own * self.one(draw)).collect()
    }
}

/// What changes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    /// All frequencies alike by a step.
    All,
    /// One frequency by a step.
    OneMode,
    /// The rotational stiffness, so that one frequency changes by the step and the others by less.
    Joint,
    /// All frequencies alike, and more with every test.
    Drift,
}

const CHANGES: [Change; 4] = [Change::All, Change::OneMode, Change::Joint, Change::Drift];

/// Drawn structure with its frequencies (Hz).
struct Tested {
    described: Specimen,
    items: Vec<Item>,
    frequencies: Vec<f64>,
}

impl Tested {
    fn new(draw: &mut ChaCha8Rng, modes: usize) -> Self {
        loop {
            if let Some((described, items)) = structure(draw, ChangeClass::Joint)
                && let Some(frequencies) = frequencies_of(&described, modes)
            {
                return Self {
                    described,
                    items,
                    frequencies,
                };
            }
        }
    }

    /// Returns the test in which each mode is off by this (logarithm).
    fn test(&self, off: &[f64], noise: Noise) -> Test {
        let modes = self.frequencies.iter().zip(off).enumerate();
        let modes = modes.map(|(index, (frequency, off))| {
            MeasuredMode::of_frequency(
                index + 1,
                frequency * off.exp(),
                0.05 * noise.repeatability * frequency,
            )
        });
        Test {
            structure: self.described.clone(),
            items: self.items.clone(),
            knows_joint: [false; 2],
            common_std: 0.01,
            modes: modes.collect(),
            unnumbered: Vec::new(),
        }
    }

    /// Returns the shift of each mode at a test after the change, from 1 (logarithm).
    fn shifts(&self, change: Change, test: usize) -> Vec<f64> {
        let count = self.frequencies.len();
        match change {
            Change::All => vec![STEP; count],
            Change::Drift => vec![DRIFT * test as f64; count],
            Change::OneMode => {
                let mut shifts = vec![0.0; count];
                shifts[count / 2] = STEP;
                shifts
            }
            Change::Joint => {
                let mut softer = self.described.clone();
                if let Some(joint) = &mut softer.joint {
                    joint.kr *= 0.98;
                }
                let moved = frequencies_of(&softer, count).unwrap_or_default();
                let moved = moved.iter().zip(&self.frequencies);
                let shifts: Vec<f64> = moved.map(|(one, other)| (one / other).ln()).collect();
                let most = shifts.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
                shifts.iter().map(|shift| shift * STEP / most).collect()
            }
        }
    }
}

fn frequencies_of(structure: &Specimen, count: usize) -> Option<Vec<f64>> {
    let solved = structure.modes(count, Mesh { elements: 40 }).ok()?;
    Some(solved.frequencies()[..count].to_vec())
}

fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut draw = ChaCha8Rng::seed_from_u64(seed);
    draw.set_stream((1 << 50) + number);
    draw
}

/// Returns the test at which a CUSUM of any mode exceeds its limit. `off` has a row for each test.
fn cusum(off: &[Vec<f64>], reference: f64, limit: f64) -> Option<usize> {
    let mut sums = [[0.0_f64; 2]; MODES];
    for (test, row) in off.iter().enumerate() {
        for (sums, value) in sums.iter_mut().zip(row) {
            sums[0] = (sums[0] + value - reference).max(0.0);
            sums[1] = (sums[1] - value - reference).max(0.0);
            if sums[0] > limit || sums[1] > limit {
                return Some(test);
            }
        }
    }
    None
}

/// Returns the limit of the CUSUM that gives the false alarms.
fn calibrated(noise: Noise, reference: f64, seed: u64) -> f64 {
    let [series, tests] = CALIBRATED;
    let drawn: Vec<Vec<Vec<f64>>> = (0..series)
        .map(|number| {
            let mut draw = stream(seed, (1 << 40) + number as u64);
            (0..tests).map(|_| noise.test(&mut draw, MODES)).collect()
        })
        .collect();
    let (mut low, mut high) = (0.0, 60.0);
    for _ in 0..20 {
        let limit = 0.5 * (low + high);
        let (mut alarms, mut at_risk) = (0.0, 0.0);
        for off in &drawn {
            let alarm = cusum(off, reference, limit);
            alarms += f64::from(alarm.is_some());
            at_risk += alarm.map_or(tests, |test| test + 1) as f64;
        }
        match alarms > FALSE_ALARM * at_risk {
            true => low = limit,
            false => high = limit,
        }
    }
    high
}

/// Prints the false alarms and the delays of this many series each.
pub fn print_series(series: usize, seed: u64) {
    println!(
        "series of {LONG} tests in which nothing changes: false alarms per test, all charts together"
    );
    for shape in SHAPES {
        for knows in [true, false] {
            let counted: Vec<(f64, f64)> = (0..10 * series as u64)
                .into_par_iter()
                .map(|number| {
                    let mut draw = stream(seed, number);
                    let modes = draw.random_range(3..=8);
                    let tested = Tested::new(&mut draw, modes);
                    let noise = Noise {
                        shape,
                        share: 0.6 * draw.random::<f64>(),
                        repeatability: log_uniform(1e-4, 4e-3, &mut draw),
                    };
                    let tests = (0..LONG).map(|_| {
                        let off = noise.test(&mut draw, modes);
                        let off: Vec<f64> = off.iter().map(|one| one * noise.std()).collect();
                        tested.test(&off, noise)
                    });
                    let tests: Vec<Test> = tests.collect();
                    match alarm(&tests, noise, knows) {
                        Some(test) => (1.0, (test + 1) as f64),
                        None => (0.0, LONG as f64),
                    }
                })
                .collect();
            let alarms: f64 = counted.iter().map(|one| one.0).sum();
            let tests: f64 = counted.iter().map(|one| one.1).sum();
            println!(
                "  {shape:?}, repeatability {}: {alarms} of {tests} tests, one in {:.0}",
                if knows { "stated" } else { "unknown" },
                tests / alarms.max(1.0)
            );
        }
    }
    println!(
        "tests until a change is seen, the first changed one included: this program, ideal CUSUM, their ratio"
    );
    for change in CHANGES {
        for shape in [Shape::Normal, Shape::LongTailed] {
            for repeatability in REPEATABILITIES {
                let noise = Noise {
                    shape,
                    share: 0.3,
                    repeatability,
                };
                let mut line = format!("  {change:?} {shape:?} {:.2} %:", 100.0 * repeatability);
                for (index, before) in BEFORE.into_iter().enumerate() {
                    for knows in [true, false] {
                        let numbers = (index * series * 2) as u64;
                        let found = delays(change, noise, before, knows, series, seed + numbers);
                        line.push_str(&format!(
                            "  {}{before}: {:.1} {:.1} {:.2}",
                            if knows { "" } else { "unknown " },
                            found[0],
                            found[1],
                            found[0] / found[1]
                        ));
                    }
                }
                println!("{line}");
            }
        }
    }
}

/// Returns the test at which this program sees a change.
fn alarm(tests: &[Test], noise: Noise, knows: bool) -> Option<usize> {
    let settings = Settings {
        repeatability: knows.then_some(noise.repeatability),
    };
    let found = watch(tests, &settings).expect("drawn tests have the same modes");
    Some(found.series.departure()?.1.test)
}

/// Returns the mean numbers of tests until this program and the ideal CUSUM see a change after `before` tests.
fn delays(
    change: Change,
    noise: Noise,
    before: usize,
    knows: bool,
    series: usize,
    seed: u64,
) -> [f64; 2] {
    let drawn: Vec<(Vec<Test>, Vec<Vec<f64>>)> = (0..series as u64)
        .into_par_iter()
        .map(|number| {
            let mut draw = stream(seed, (2 << 40) + number);
            let tested = Tested::new(&mut draw, MODES);
            let mut off = Vec::new();
            let mut tests = Vec::new();
            for test in 0..before + WATCHED {
                let mut row = noise.test(&mut draw, MODES);
                if test >= before {
                    let shifts = tested.shifts(change, test - before + 1);
                    for (value, shift) in row.iter_mut().zip(shifts) {
                        *value += shift / noise.std();
                    }
                }
                let log: Vec<f64> = row.iter().map(|one| one * noise.std()).collect();
                tests.push(tested.test(&log, noise));
                off.push(row);
            }
            (tests, off)
        })
        .collect();
    let delay = |alarm: Option<usize>| match alarm {
        // A false alarm is no sight of the change.
        Some(test) if test < before => None,
        Some(test) => Some((test - before + 1) as f64),
        None => Some(WATCHED as f64),
    };
    let mean = |all: Vec<Option<f64>>| {
        let known: Vec<f64> = all.into_iter().flatten().collect();
        known.iter().sum::<f64>() / known.len() as f64
    };
    let own = drawn.par_iter().map(|one| {
        // Tests long after a change cost time and tell nothing more.
        let mut seen = None;
        for after in [4, 10, WATCHED] {
            seen = alarm(&one.0[..before + after], noise, knows);
            if seen.is_some() {
                break;
            }
        }
        delay(seen)
    });
    let own = mean(own.collect());
    let half = 0.5 * STEP / noise.std();
    let references = match change {
        Change::Drift => &REFERENCES[..],
        _ => &[half],
    };
    let means = references.iter().map(|&reference| {
        let limit = calibrated(noise, reference, seed);
        let alarms = drawn.iter().map(|one| cusum(&one.1, reference, limit));
        mean(alarms.map(delay).collect())
    });
    let ideal = means.fold(f64::INFINITY, f64::min);
    [own, ideal]
}
