//! Tests of the level of the taps.

use crate::fixture::{self, cantilever, frequencies, pair, springs};
use crate::test::{Level, LevelPoint, Reading, Settings, Test};
use crate::{Comparison, VerdictKind, compare, watch};

const MODES: usize = 5;

/// Returns a test whose frequencies fall by these shares per factor of ten in amplitude, read at an amplitude.
fn test(slopes: [f64; MODES], amplitude: f64) -> Test {
    let structure = cantilever(springs());
    let mut frequencies = frequencies(&structure, MODES);
    for (frequency, slope) in frequencies.iter_mut().zip(slopes) {
        *frequency *= (slope * amplitude.log10()).exp();
    }
    let mut test = fixture::test(&structure, &[], &frequencies);
    for (mode, slope) in test.modes.iter_mut().zip(slopes) {
        let point = |factor: f64| LevelPoint {
            amplitude: factor * amplitude,
            frequency: read(slope * factor.log10()),
            damping: read(0.001 * factor.log10()),
        };
        mode.damping = Some(read(0.003 + 0.001 * amplitude.log10()));
        mode.level = Some(Level {
            amplitude,
            curve: vec![point(0.1), point(1.0)],
            of: "A".to_owned(),
            frequency_slope: read(slope),
        });
    }
    test
}

fn read(value: f64) -> Reading {
    Reading { value, std: 1e-5 }
}

fn compared(before: Test, after: Test) -> Comparison {
    let settings = Settings {
        repeatability: Some(5e-4),
    };
    compare(&[pair(before, after)], &settings).unwrap()
}

const SLOPES: [f64; MODES] = [-0.01, -0.006, -0.004, -0.003, -0.002];

#[test]
fn prop_harder_taps_on_a_joint_that_slips_are_no_change() {
    let found = compared(test(SLOPES, 1.0), test(SLOPES, 5.0));
    assert_eq!(found.verdict.kind, VerdictKind::NoChange);
    // At other levels slopes are not compared.
    assert!(found.level.is_none());
    for (mode, slope) in found.modes.iter().zip(SLOPES) {
        assert!(mode.z.abs() < 1e-6, "{mode:?}");
        let explained = 100.0 * (slope * 5.0_f64.log10()).exp_m1();
        assert!(
            (mode.level_percent - explained).abs() < 1e-3 * explained.abs(),
            "{mode:?}"
        );
    }
    for mode in &found.damping.unwrap().modes {
        assert!((mode.after - mode.before).abs() < 1e-12, "{mode:?}");
    }
    // Without the slopes it looks like a change.
    let mut blind = [test(SLOPES, 1.0), test(SLOPES, 5.0)];
    for mode in blind.iter_mut().flat_map(|test| &mut test.modes) {
        mode.level = None;
    }
    let [before, after] = blind;
    let found = compared(before, after);
    assert_ne!(found.verdict.kind, VerdictKind::NoChange);
    assert!(found.level.is_none());
}

#[test]
fn prop_amplitudes_of_two_sensors_or_far_apart_are_not_compared() {
    let mut other = test(SLOPES, 5.0);
    for mode in &mut other.modes {
        mode.level.as_mut().unwrap().of = "B".to_owned();
    }
    for after in [other, test(SLOPES, 20.0)] {
        let found = compared(test(SLOPES, 1.0), after);
        assert!(found.modes.iter().all(|mode| mode.level_percent == 0.0));
    }
}

#[test]
fn prop_a_joint_that_begins_to_slip_is_told_by_the_slopes() {
    let found = compared(test([0.0; MODES], 1.0), test(SLOPES, 1.0));
    assert_eq!(found.verdict.kind, VerdictKind::NoChange);
    let level = found.level.unwrap();
    assert!(level.has_changed);
    assert_eq!(level.modes.len(), MODES);
    let first = &level.modes[0];
    assert_eq!([first.before_percent, first.after_percent], [0.0, -1.0]);
}

#[test]
fn limit_a_mode_is_taken_to_amplitudes_of_its_curve_alone() {
    let point = |amplitude: f64, value: f64| LevelPoint {
        amplitude,
        frequency: read(value),
        damping: read(-value),
    };
    let mut level = Level {
        amplitude: 4.0,
        curve: vec![point(1.0, 0.003), point(2.0, 0.002), point(4.0, 0.0)],
        of: "A".to_owned(),
        frequency_slope: read(0.0),
    };
    for (amplitude, expected) in [
        (1.0, 0.003),
        (2.0, 0.002),
        (8.0_f64.sqrt(), 0.001),
        (4.0, 0.0),
    ] {
        let found = level.at(amplitude).unwrap();
        assert!(
            (found.frequency.value - expected).abs() < 1e-15,
            "{found:?}"
        );
        assert!((found.damping.value + expected).abs() < 1e-15, "{found:?}");
    }
    assert!(
        [0.9, 4.1, f64::NAN]
            .iter()
            .all(|one| level.at(*one).is_none())
    );
    level.curve = vec![point(4.0, 0.0); 2];
    assert!(level.at(4.0).is_none());
}

#[test]
fn prop_uncertain_slopes_add_to_the_scatter() {
    // Taking a frequency from 5 to 1 is as uncertain as the repeatability.
    let uncertain = |amplitude| {
        let mut test = test(SLOPES, amplitude);
        for mode in &mut test.modes {
            let level = mode.level.as_mut().unwrap();
            for point in &mut level.curve {
                let tens = (point.amplitude / amplitude).log10().abs();
                point.frequency.std = 5e-4 / 5.0_f64.log10() * tens;
                point.damping.std = 0.01 * tens;
            }
        }
        test
    };
    let sure = compared(test(SLOPES, 1.0), test(SLOPES, 5.0));
    let unsure = compared(uncertain(1.0), uncertain(5.0));
    for (sure, unsure) in sure.modes.iter().zip(&unsure.modes) {
        let added = (unsure.std_percent.powi(2) - sure.std_percent.powi(2)).sqrt();
        assert!((added - 0.05).abs() < 1e-4, "{sure:?} {unsure:?}");
    }
    let [sure, unsure] = [sure, unsure].map(|found| found.damping.unwrap());
    for (sure, unsure) in sure.modes.iter().zip(&unsure.modes) {
        assert!(unsure.std > sure.std.hypot(0.006), "{sure:?} {unsure:?}");
    }
    let tests = [1.0, 5.0, 5.0, 5.0, 5.0, 5.0].map(uncertain);
    let settings = Settings {
        repeatability: Some(5e-4),
    };
    let watched = watch(&tests, &settings).unwrap();
    // The variance of one test is half of that of a difference, and that of the other level.
    let scatter = watched.series.charts[0].scatter_percent.unwrap();
    assert!((scatter / 0.05 - 1.5_f64.sqrt()).abs() < 0.01, "{scatter}");
}

#[test]
fn prop_harder_taps_in_a_series_are_no_change() {
    let tests = [1.0, 2.0, 1.0, 3.0, 2.0, 5.0].map(|amplitude| test(SLOPES, amplitude));
    let settings = Settings {
        repeatability: Some(5e-4),
    };
    let watched = watch(&tests, &settings).unwrap();
    assert!(watched.series.first.is_none());
    // The last test alone differs, by a softer joint and not by its taps.
    let mut softer = tests.to_vec();
    for mode in &mut softer[5].modes {
        mode.frequency *= 0.99;
    }
    let change = watch(&softer, &settings).unwrap().change.unwrap();
    for mode in &change.modes {
        assert!((mode.change_percent + 1.0).abs() < 1e-6, "{mode:?}");
        assert!(mode.level_percent < -0.05, "{mode:?}");
    }
}
