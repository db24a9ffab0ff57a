//! Modes of frequency response functions that were computed from known ones.

use crate::shared::data;
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use tapjoint::modal::ModeReading;
use tapjoint::pipeline::{FunctionSettings, run_functions};
use tapjoint::recording::{
    FrequencyResponse, FrequencyResponses, ReadSettings, ResponseForm, open_frequency_responses,
};

/// Lines of a function (Hz).
struct Axis {
    first: f64,
    spacing: f64,
    lines: usize,
}

/// Accelerance of modes (frequency in Hz, damping ratio), each with a peak of 1, and white noise of root mean square
/// `noise`.
fn function(axis: &Axis, modes: &[(f64, f64)], noise: f64) -> FrequencyResponses {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let values = (0..axis.lines).map(|line| {
        let at = TAU * (axis.first + line as f64 * axis.spacing);
        let mut value: Complex64 = modes
            .iter()
            .map(|&(frequency, damping)| {
                let own = TAU * frequency;
                let denominator = Complex64::new(own * own - at * at, 2.0 * damping * own * at);
                -2.0 * damping * at * at / denominator
            })
            .sum();
        let [re, im]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(&mut random));
        value += Complex64::new(re, im) * noise / 2f64.sqrt();
        value
    });
    FrequencyResponses {
        file: "functions".to_string(),
        first_frequency: axis.first,
        spacing: axis.spacing,
        lines: axis.lines,
        has_phase: true,
        responses: vec![FrequencyResponse {
            form: Some(ResponseForm::Accelerance),
            values: values.collect(),
            ..FrequencyResponse::default()
        }],
        warnings: Vec::new(),
    }
}

/// Everything taken for a mode in a band.
fn modes(functions: &FrequencyResponses, band: Option<(f64, f64)>) -> Vec<ModeReading> {
    let settings = FunctionSettings {
        band,
        ..FunctionSettings::default()
    };
    let analysis = run_functions(functions, &settings).unwrap();
    let modes = analysis.modes.into_iter();
    let modes = modes.filter(|mode| mode.mode.is_some());
    modes.filter_map(|mode| mode.reading).collect()
}

#[test]
fn recover_damped_modes_beside_light_ones_in_any_band() {
    let truth = [(100.0, 0.03), (112.0, 0.001), (130.0, 0.04), (150.0, 0.002)];
    let axis = Axis {
        first: 0.0,
        spacing: 0.25,
        lines: 1200,
    };
    let functions = function(&axis, &truth, 10f64.powf(-50.0 / 20.0));
    for band in [None, Some((40.0, 250.0)), Some((70.0, 200.0))] {
        let found = modes(&functions, band);
        let listed: Vec<f64> = found.iter().map(|mode| mode.frequency).collect();
        assert_eq!(listed.len(), truth.len(), "{band:?}: {listed:?}");
        for ((frequency, _), mode) in truth.iter().zip(&found) {
            let off = (mode.frequency - frequency).abs();
            // Beyond four standard deviations lies one value of 16000.
            assert!(off < 4.0 * mode.std.unwrap(), "{band:?}: {listed:?}");
        }
    }
}

/// A resonance of some 250 lines, on each of which noise is half as high: its own lines show peaks of noise alone.
#[test]
fn recover_a_mode_that_only_coarser_lines_show() {
    let axis = Axis {
        first: 400.0,
        spacing: 0.02,
        lines: 10_001,
    };
    let functions = function(&axis, &[(500.0, 0.005)], 0.5);
    let found = modes(&functions, None);
    let listed: Vec<f64> = found.iter().map(|mode| mode.frequency).collect();
    assert_eq!(listed.len(), 1, "{listed:?}");
    assert!((listed[0] - 500.0).abs() < 4.0 * found[0].std.unwrap());
}

#[test]
fn limit_noise_alone_has_no_modes() {
    let axis = Axis {
        first: 0.0,
        spacing: 0.5,
        lines: 1601,
    };
    let found = modes(&function(&axis, &[], 1.0), None);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn regress_stable_columns_of_a_damped_structure_are_modes() {
    let path = data("ufffiles_jl_uff/dataset58_FRF.unv");
    let functions = open_frequency_responses(&path, &ReadSettings::default()).unwrap();
    for band in [None, Some((20.0, 600.0)), Some((20.0, 800.0))] {
        let found = modes(&functions, band);
        let listed: Vec<f64> = found.iter().map(|mode| mode.frequency).collect();
        // Peaks that the README names; 1 %, as they were read on lines of 0.5 Hz over modes several Hz wide.
        for frequency in [81.4, 239.27, 463.9, 544.0] {
            let near = |f: &f64| (f - frequency).abs() < 0.01 * frequency;
            assert!(listed.iter().any(near), "{band:?}, {frequency}: {listed:?}");
        }
    }
}
