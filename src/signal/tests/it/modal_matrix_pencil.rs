//! Matrix pencil on free decays in closed form.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use tapjoint_signal::spectral::Window;

use crate::matrix_pencil::{MatrixPencilError, MatrixPencilSettings, PencilPole, pencil_poles};

const RATE: f64 = 1024.0;
const BAND: (f64, f64) = (115.0, 135.0);

/// Frequency (Hz), damping ratio, amplitude at the first sensor and at the second.
type Mode = (f64, f64, f64, f64);

const CLOSE: [Mode; 2] = [(124.8, 0.002, 1.0, 0.9), (125.2, 0.002, 0.7, -0.6)];
const NEIGHBOURS: [Mode; 3] = [
    (52.0, 0.004, 1.0, 0.4),
    (140.0, 0.003, 0.8, 1.0),
    (310.0, 0.003, 0.8, -0.3),
];

/// Decays of 4 s at two sensors, noise `snr_db` below the highest sample.
fn decays(modes: &[Mode], snr_db: f64, seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..2)
        .map(|sensor| {
            let mut samples: Vec<f64> = (0..(4.0 * RATE) as usize)
                .map(|n| {
                    let t = n as f64 / RATE;
                    let one = |&(f, zeta, first, second): &Mode| {
                        let omega = TAU * f;
                        let amplitude = if sensor == 0 { first } else { second };
                        let damped = omega * (1.0 - zeta * zeta).sqrt();
                        amplitude * (-zeta * omega * t).exp() * (damped * t).sin()
                    };
                    modes.iter().map(one).sum()
                })
                .collect();
            let peak = samples.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let scale = if peak > 0.0 { peak } else { 1.0 };
            let noise = Normal::new(0.0, scale * 10f64.powf(-snr_db / 20.0)).unwrap();
            for sample in &mut samples {
                *sample += noise.sample(&mut random);
            }
            samples
        })
        .collect()
}

fn poles_in(records: &[Vec<f64>], settings: &MatrixPencilSettings) -> Vec<PencilPole> {
    let columns: Vec<&[f64]> = records.iter().map(Vec::as_slice).collect();
    pencil_poles(&columns, RATE, BAND, settings).unwrap()
}

fn poles_of(modes: &[Mode], snr_db: f64, seed: u64) -> Vec<PencilPole> {
    poles_in(
        &decays(modes, snr_db, seed),
        &MatrixPencilSettings::default(),
    )
}

/// Over `seeds`: how often the number of poles is right, and of the poles' frequencies and damping
/// ratios together the share within 1.96 standard deviations.
fn recovery(modes: &[Mode], inside: usize, snr_db: f64, seeds: u64) -> (usize, f64) {
    let truth: Vec<&Mode> = modes
        .iter()
        .filter(|mode| (BAND.0..BAND.1).contains(&mode.0))
        .collect();
    assert_eq!(truth.len(), inside);
    let (mut right, mut within, mut judged) = (0, 0, 0);
    for seed in 0..seeds {
        let found = poles_of(modes, snr_db, seed);
        if found.len() != inside {
            continue;
        }
        right += 1;
        for (pole, mode) in found.iter().zip(&truth) {
            judged += 2;
            let error = (pole.frequency - mode.0).abs();
            within += usize::from(error < 1.96 * pole.frequency_std);
            let error = (pole.damping_ratio - mode.1).abs();
            within += usize::from(error < 1.96 * pole.damping_std);
        }
    }
    (right, f64::from(within as u32) / f64::from(judged))
}

#[test]
fn recover_one_mode_within_its_standard_deviation() {
    for snr_db in [60.0, 40.0, 30.0] {
        let (right, share) = recovery(&[(125.0, 0.002, 1.0, 0.4)], 1, snr_db, 40);
        assert_eq!(right, 40, "{snr_db} dB");
        // 80 statements: 95 % less three standard deviations of a share, 7 %.
        assert!(share > 0.87, "{snr_db} dB: {share} within 95 %");
    }
}

#[test]
fn recover_two_close_modes_beside_others_outside_the_band() {
    let modes: Vec<Mode> = CLOSE.iter().chain(&NEIGHBOURS).copied().collect();
    for snr_db in [60.0, 40.0, 30.0] {
        let (right, share) = recovery(&modes, 2, snr_db, 20);
        assert!(right >= 19, "{snr_db} dB: two modes in {right} of 20");
        // As above; the band's edge is not quite white, so that the deviation is a little small.
        assert!(share > 0.85, "{snr_db} dB: {share} within 95 %");
    }
}

#[test]
fn limit_exact_without_noise() {
    let found = poles_of(&CLOSE, 400.0, 1);
    assert_eq!(found.len(), 2);
    for (pole, mode) in found.iter().zip(&CLOSE) {
        // What is left is rounding, and the images of -125 Hz that the filter's 100 dB let through.
        assert!((pole.frequency / mode.0 - 1.0).abs() < 1e-9, "{pole:?}");
        assert!((pole.damping_ratio / mode.1 - 1.0).abs() < 1e-6, "{pole:?}");
        // sin = Re(-j e^{j..}); the pass band is flat to 100 dB.
        let (first, second) = (pole.amplitudes[0], pole.amplitudes[1]);
        assert!((first.im + mode.2).abs() < 1e-4, "{first}");
        assert!((second.im + mode.3).abs() < 1e-4, "{second}");
    }
}

#[test]
fn limit_noise_and_steady_tones_are_no_modes() {
    let mut invented = 0;
    for seed in 0..50 {
        invented += poles_of(&[], 0.0, seed).len();
        invented += poles_of(&[(125.0, 0.0, 1.0, 0.5)], 40.0, seed).len();
    }
    // None was seen in ten times as many records; one is left to another generator.
    assert!(invented <= 1, "{invented} poles from nothing");
}

#[test]
fn prop_the_windows_decay_is_taken_out() {
    let mut records = decays(&[(125.0, 0.002, 1.0, 0.4)], 60.0, 3);
    for record in &mut records {
        Window::Exponential { decay: 1.3 }.apply(record, RATE);
    }
    let settings = MatrixPencilSettings {
        added_decay: 1.3,
        ..MatrixPencilSettings::default()
    };
    let found = poles_in(&records, &settings);
    assert_eq!(found.len(), 1);
    let error = (found[0].damping_ratio - 0.002).abs();
    // Five standard deviations: windowed noise is not white, and the record is one.
    assert!(error < 5.0 * found[0].damping_std, "{:?}", found[0]);
}

#[test]
fn limit_bands_that_do_not_fit_are_refused() {
    let record = vec![0.0; 200];
    let columns: [&[f64]; 1] = [&record];
    let settings = MatrixPencilSettings::default();
    let refused = |band| pencil_poles(&columns, RATE, band, &settings).unwrap_err();
    assert!(matches!(
        refused((100.0, 600.0)),
        MatrixPencilError::Band { .. }
    ));
    let short = refused((115.0, 125.0));
    assert!(matches!(short, MatrixPencilError::TooShort { .. }));
    assert!(short.to_string().contains("115 to 125 Hz"), "{short}");
}
