//! Combination tones of a nonlinear joint: labelled where they are, and only there.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint::modal::{ModeReading, PeakLabel};
use tapjoint::pipeline::measure_bare;
use tapjoint::recording::{Channel, Recording};

const RATE: f64 = 4096.0;
const SECONDS: f64 = 6.0;
/// Time before the tap (s).
const QUIET: f64 = 1.0;

/// Frequency (Hz), damping ratio, amplitude of a mode.
struct Mode {
    frequency: f64,
    damping_ratio: f64,
    amplitude: f64,
}

impl Mode {
    fn at(&self, time: f64) -> f64 {
        let omega = TAU * self.frequency;
        self.amplitude * (-self.damping_ratio * omega * time).exp() * (omega * time).sin()
    }
}

/// Readings of one tap on modes whose response the first one modulates: x (1 + m x_1/A_1), with noise 80 dB below.
fn readings(modes: &[Mode], modulation: f64, seed: u64) -> Vec<ModeReading> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut samples = Vec::new();
    for index in 0..(RATE * (QUIET + SECONDS)) as usize {
        let time = index as f64 / RATE - QUIET;
        let noise: f64 = StandardNormal.sample(&mut random);
        let mut value = 1e-4 * noise;
        if time >= 0.0 {
            let sum: f64 = modes.iter().map(|mode| mode.at(time)).sum();
            value += sum * (1.0 + modulation * modes[0].at(time) / modes[0].amplitude);
        }
        samples.push(value);
    }
    let channel = Channel {
        samples,
        ..Channel::default()
    };
    let recording = Recording::from_samples("nonlinear", RATE, vec![channel]).unwrap();
    let found = measure_bare(recording, None, |_| {}).unwrap();
    found.measurement.spectra.unwrap().readings
}

/// Six modes of no simple ratio.
fn modes() -> Vec<Mode> {
    let modes = [
        (80.3, 0.002, 1.0),
        (297.1, 0.0012, 0.8),
        (411.7, 0.0015, 0.3),
        (580.9, 0.0025, 0.9),
        (845.6, 0.0024, 0.7),
        (1213.4, 0.0015, 0.4),
    ];
    let of = |(frequency, damping_ratio, amplitude)| Mode {
        frequency,
        damping_ratio,
        amplitude,
    };
    modes.into_iter().map(of).collect()
}

fn is_combination(reading: &ModeReading) -> bool {
    matches!(reading.label, Some(PeakLabel::Combination { .. }))
}

#[test]
fn recover_sums_and_differences_of_a_modulated_response() {
    let modes = modes();
    let found = readings(&modes, 0.1, 1);
    let near = |frequency: f64| {
        let mut near = found.iter();
        near.find(|reading| (reading.frequency - frequency).abs() < 0.3)
    };
    for mode in &modes {
        let own = near(mode.frequency).expect("a mode");
        assert!(!is_combination(own), "{} Hz", mode.frequency);
    }
    for mode in &modes[1..] {
        for step in [-80.3, 80.3] {
            let own = near(mode.frequency + step).expect("a combination");
            let Some(PeakLabel::Combination { line, times, of }) = own.label else {
                panic!("{} {step} Hz: {:?}", mode.frequency, own.label);
            };
            // A line has 1/6 Hz, and all fits are far better.
            assert!((line - mode.frequency).abs() < 0.1);
            assert!((f64::from(times) * of - step).abs() < 0.1);
        }
    }
}

#[test]
fn limit_a_linear_structure_has_no_combinations() {
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut modes = Vec::new();
        for _ in 0..12 {
            modes.push(Mode {
                frequency: random.random_range(60.0..1800.0),
                damping_ratio: random.random_range(0.001..0.01),
                amplitude: 10f64.powf(random.random_range(-1.5..0.0)),
            });
        }
        let labelled = readings(&modes, 0.0, seed)
            .into_iter()
            .filter(is_combination);
        assert_eq!(labelled.count(), 0, "seed {seed}");
    }
}

#[test]
fn limit_the_multiples_of_a_string_are_modes() {
    let mut modes = Vec::new();
    for number in 1..=14 {
        modes.push(Mode {
            frequency: 110.0 * f64::from(number),
            damping_ratio: 0.001,
            amplitude: 0.5f64.powi(number - 1).max(0.01),
        });
    }
    let found = readings(&modes, 0.0, 3);
    assert!(found.len() >= 10);
    assert!(!found.iter().any(is_combination));
}
