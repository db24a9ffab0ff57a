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

/// Frequency (Hz) at small amplitudes, damping ratio, amplitude of a mode.
pub struct Mode {
    pub frequency: f64,
    pub damping_ratio: f64,
    pub amplitude: f64,
    /// Share by which the frequency is lower at the beginning.
    pub softening: f64,
}

impl Mode {
    fn at(&self, time: f64) -> f64 {
        let omega = TAU * self.frequency;
        let decay = self.damping_ratio * omega;
        // The frequency falls with the square of the amplitude: its integral is the phase.
        let slower = self.softening * (1.0 - (-2.0 * decay * time).exp()) / (2.0 * decay);
        self.amplitude * (-decay * time).exp() * (omega * (time - slower)).sin()
    }
}

/// Readings of one tap on modes whose response the first one modulates: x (1 + m (x_1/A_1)^power), with noise 80 dB below.
pub fn readings(modes: &[Mode], modulation: f64, power: i32, seed: u64) -> Vec<ModeReading> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut samples = Vec::new();
    for index in 0..(RATE * (QUIET + SECONDS)) as usize {
        let time = index as f64 / RATE - QUIET;
        let noise: f64 = StandardNormal.sample(&mut random);
        let mut value = 1e-4 * noise;
        if time >= 0.0 {
            let sum: f64 = modes.iter().map(|mode| mode.at(time)).sum();
            let first = modes[0].at(time) / modes[0].amplitude;
            value += sum * (1.0 + modulation * first.powi(power));
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
        softening: 0.0,
    };
    modes.into_iter().map(of).collect()
}

fn is_combination(reading: &ModeReading) -> bool {
    matches!(reading.label, Some(PeakLabel::Combination(_)))
}

/// Checks that all neighbours of the modes but the first are labelled, and no mode is.
fn assert_neighbours(modes: &[Mode], found: &[ModeReading], times: i32) {
    for mode in modes {
        let own = near(found, mode.frequency);
        assert!(!is_combination(own), "{} Hz", mode.frequency);
    }
    for mode in &modes[1..] {
        for times in [-times, times] {
            let of = modes[0].frequency;
            let own = near(found, mode.frequency + f64::from(times) * of);
            let Some(PeakLabel::Combination(sum)) = own.label else {
                panic!("{} {times} x {of} Hz: {:?}", mode.frequency, own.label);
            };
            // A line has 1/6 Hz, and all fits are far better. A softening mode of 0.1 % lies 0.1 Hz off.
            assert!((sum.line - mode.frequency).abs() < 0.2);
            assert!((sum.of - of).abs() < 0.2 && sum.times == times);
        }
    }
}

fn near(found: &[ModeReading], frequency: f64) -> &ModeReading {
    let mut near = found.iter();
    near.find(|reading| (reading.frequency - frequency).abs() < 0.4)
        .unwrap_or_else(|| panic!("no peak at {frequency} Hz"))
}

#[test]
fn recover_sums_and_differences_of_a_modulated_response() {
    let modes = modes();
    assert_neighbours(&modes, &readings(&modes, 0.1, 1, 1), 1);
    // A joint that does not tell one direction from the other.
    assert_neighbours(&modes, &readings(&modes, 0.2, 2, 1), 2);
    let mut softening = modes;
    softening[0].softening = 1e-3;
    assert_neighbours(&softening, &readings(&softening, 0.1, 1, 2), 1);
}

#[test]
fn limit_a_linear_structure_has_no_combinations() {
    let mut named = 0;
    for seed in 0..30 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut modes = Vec::new();
        for index in 0..12 {
            modes.push(Mode {
                frequency: random.random_range(60.0..1800.0),
                damping_ratio: random.random_range(0.001..0.01),
                amplitude: 10f64.powf(random.random_range(-1.5..0.0)),
                // The support of the first may slip, which moves its frequency and combines nothing.
                softening: if index == 0 && seed % 2 == 1 {
                    1e-3
                } else {
                    0.0
                },
            });
        }
        let found = readings(&modes, 0.0, 1, seed);
        named += usize::from(found.iter().any(is_combination));
    }
    // A test at 1 % errs twice or more in 30 with a probability of 4 %, and three times with 0.3 %.
    assert!(named <= 2, "{named} of 30");
}

/// Multiples of 110 Hz, weaker from one to the next, of which the first softens.
fn multiples(numbers: impl Iterator<Item = i32>, softening: f64) -> Vec<Mode> {
    let mut modes = Vec::new();
    for (place, number) in numbers.enumerate() {
        modes.push(Mode {
            frequency: 110.0 * f64::from(number),
            damping_ratio: 0.002,
            amplitude: 0.45f64.powi(place as i32).max(0.01),
            softening: if place == 0 { softening } else { 0.0 },
        });
    }
    modes
}

#[test]
fn limit_the_multiples_of_a_string_or_a_rod_are_modes() {
    for softening in [0.0, 1e-3] {
        for step in [1, 2] {
            let modes = multiples((1..14).step_by(step), softening);
            let found = readings(&modes, 0.0, 1, 3);
            assert!(found.len() >= modes.len() - 2);
            assert!(!found.iter().any(is_combination), "{step} {softening}");
        }
    }
}
