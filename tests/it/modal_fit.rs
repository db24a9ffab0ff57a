//! Fits of poles against the virtual tap test, and against recordings by an analyser.

use num_complex::Complex64;
use tapjoint::modal::fit::{
    Basis, Column, FitSettings, FreeDecayCollector, ModalData, ModeFit, PoleStart, TapForce,
    fit_modes, modal_constants,
};
use tapjoint::recording::ResponseForm;
use tapjoint::simulate::{SimulatedMode, TapTestSettings, simulate_tap_test};

fn all_fitted(data: &ModalData, starts: &[PoleStart]) -> Vec<ModeFit> {
    fit_modes(data, starts, &FitSettings::default())
        .into_iter()
        .map(|fit| fit.unwrap_or_else(|reason| panic!("{reason}")))
        .collect()
}

fn five_taps() -> TapTestSettings {
    TapTestSettings {
        sample_rate: 4096.0,
        interval: 1.3,
        lead: 0.1,
        taps: 1,
        force_to_noise_db: 80.0,
        signal_to_noise_db: 60.0,
        ..TapTestSettings::default()
    }
}

#[test]
fn recover_modal_constants_with_their_signs() {
    let modes = [
        SimulatedMode {
            frequency: 91.3,
            damping_ratio: 0.004,
            shape_at_tap: 1.3,
            shape_at_sensors: vec![0.9, -0.4],
        },
        SimulatedMode {
            frequency: 240.6,
            damping_ratio: 0.003,
            shape_at_tap: -0.8,
            shape_at_sensors: vec![0.7, 1.1],
        },
    ];
    let settings = five_taps();
    let (rate, samples) = (settings.sample_rate, 4096);
    let (mut taps, mut forces) = (Vec::new(), Vec::new());
    for tap in 0..5 {
        let test = simulate_tap_test(&modes, &settings, tap as u64);
        let onset = (test.tap_times[0] * rate) as usize;
        let gate = onset + 10;
        let cut = |response: &Vec<f64>| response[gate..gate + samples].to_vec();
        taps.push(test.responses.iter().map(cut).collect::<Vec<_>>());
        forces.push(TapForce {
            tap,
            samples: test.force[onset - 2..gate].to_vec(),
            sample_rate: rate,
            start: -12.0 / rate,
        });
    }
    let mut collector = FreeDecayCollector::new(rate, samples, &[(20.0, 400.0)]).unwrap();
    for tap in &taps {
        collector.add_tap(tap).unwrap();
    }
    let data = collector.finish().unwrap();
    let starts: Vec<PoleStart> = modes
        .iter()
        .map(|mode| PoleStart {
            frequency: mode.frequency + 0.2,
            damping_ratio: Some(mode.damping_ratio),
        })
        .collect();
    let kinds = [ResponseForm::Accelerance; 2];
    for (fit, mode) in all_fitted(&data, &starts).iter().zip(&modes) {
        let constants = modal_constants(fit, &forces, &kinds.map(Some));
        assert_eq!(constants.len(), 2);
        for (constant, shape) in constants.iter().zip(&mode.shape_at_sensors) {
            // The simulator's force is linear between samples: sinc^2(f/rate) of the sampled one.
            let x = std::f64::consts::PI * mode.frequency / rate;
            let truth = mode.shape_at_tap * shape * (x.sin() / x).powi(2);
            let error = (constant.value - truth).abs();
            // Twenty constants would be needed to see one beyond three deviations; these are four.
            assert!(error < 3.5 * constant.std, "{constant:?} for {truth}");
            assert!(constant.std < 0.005 * truth.abs(), "{constant:?}");
            assert!(constant.phase_deviation.abs() < 0.5, "{constant:?}");
            assert_eq!(constant.taps, 5);
        }
    }
}

#[test]
#[ignore = "needs TAPJOINT_DATA"]
fn val_a_free_beam_by_an_analyser_has_its_four_modes() {
    let folder = crate::shared::data("modelab_freefree_beam");
    let (mut frequencies, mut columns) = (Vec::new(), Vec::new());
    for (sensor, name) in ["Hxysv00001.txt", "Hxysv00005.txt"].iter().enumerate() {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        let text: String = bytes.iter().map(|&byte| char::from(byte)).collect();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .map(|line| {
                line.split_whitespace()
                    .map_while(|cell| cell.parse().ok())
                    .collect()
            })
            .filter(|row: &Vec<f64>| row.len() == 3 && row[0] > 0.0)
            .collect();
        frequencies = rows.iter().map(|row| row[0]).collect();
        columns.push(Column {
            tap: 0,
            sensor,
            values: rows
                .iter()
                .map(|row| Complex64::new(row[1], row[2]))
                .collect(),
        });
    }
    let resolution = frequencies[1] - frequencies[0];
    let basis = Basis::FrequencyResponse { resolution };
    let data = ModalData::new(basis, frequencies, columns).unwrap();
    // Read by other programs from the same files.
    let expected = [
        (111.995, 1.39e-4),
        (306.855, 1.18e-4),
        (596.368, 0.98e-4),
        (974.132, 1.0e-4),
    ];
    let starts = expected.map(|(frequency, _)| PoleStart {
        frequency,
        damping_ratio: None,
    });
    for (fit, (frequency, ratio)) in all_fitted(&data, &starts).iter().zip(expected) {
        // Those programs agree to 0.03 Hz, and in damping to 20 %.
        assert!(
            (fit.frequency.value - frequency).abs() < 0.03,
            "{:?}",
            fit.frequency
        );
        let damping = fit.damping_ratio.value;
        assert!((damping / ratio - 1.0).abs() < 0.2, "{damping} for {ratio}");
    }
}
