//! How true the standard deviations of the modal fit are, and how far they are from the least possible.
//!
//! Five taps of 2048 samples at 2048 Hz on a structure of five modes near 42.7, 118.3, 231.9, 383.4 and
//! 572.6 Hz, response noise 60, 40 and 30 dB below the peak of the records. Each frequency is compared
//! with the truth, its error with the Cramer-Rao bound (computed in the time domain from the true poles
//! and the true records, all amplitudes unknown), and its 95 % interval with what it promises.
//!
//! `cargo run --release --example modal_fit_study [seeds]`

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use tapjoint::modal::fit::{
    FitSettings, FreeDecayCollector, ModeFit, PoleStart, UncertaintySource, fit_modes,
};
use tapjoint::simulate::{SimulatedMode, TapTestSettings, simulate_tap_test};

const RATE: f64 = 2048.0;
const SAMPLES: usize = 2048;
const TAPS: usize = 5;
const FREQUENCIES: [f64; 5] = [42.7, 118.3, 231.9, 383.4, 572.6];
const DAMPINGS: [f64; 5] = [0.004, 0.003, 0.0035, 0.005, 0.006];
const LEVELS: [f64; 3] = [60.0, 40.0, 30.0];

/// Bands (Hz) about these modes (frequency in Hz, damping ratio), twice as wide as a fit from there asks for: a fitted
/// mode may turn out wider. `resolution` is 1/T (Hz).
fn bands_for(modes: &[(f64, f64)], resolution: f64) -> Vec<(f64, f64)> {
    let bands = modes.iter().map(|&(frequency, damping_ratio)| {
        let half_width = (damping_ratio * frequency / resolution).hypot(0.5);
        let half = 2.0 * (10.0 * half_width).max(12.0) * resolution;
        (frequency - half, frequency + half)
    });
    bands.collect()
}

/// Shape of mode k at x of a unit length.
fn shape(k: usize, x: f64) -> f64 {
    ((k as f64 + 0.5) * std::f64::consts::PI * x).sin() + 0.15
}

fn modes(random: &mut ChaCha8Rng) -> Vec<SimulatedMode> {
    (0..FREQUENCIES.len())
        .map(|k| SimulatedMode {
            frequency: FREQUENCIES[k] * (1.0 + random.random_range(-0.02..0.02)),
            damping_ratio: DAMPINGS[k],
            shape_at_tap: 1.2 * shape(k, 0.37),
            shape_at_sensors: vec![shape(k, 0.05)],
        })
        .collect()
}

/// Decays after the pulses, without noise, and the largest value of the whole records.
fn decays(modes: &[SimulatedMode], seed: u64) -> (Vec<Vec<f64>>, f64) {
    let settings = TapTestSettings {
        sample_rate: RATE,
        taps: 1,
        interval: 1.2,
        lead: 0.02,
        peak_force: 120.0,
        pulse: 1.5e-3,
        signal_to_noise_db: f64::INFINITY,
        force_to_noise_db: f64::INFINITY,
    };
    let mut peak: f64 = 0.0;
    let decays = (0..TAPS as u64)
        .map(|tap| {
            let test = simulate_tap_test(modes, &settings, seed * 100 + tap);
            // The longest pulse is 10 % longer; two samples more are clear of it.
            let end = test.tap_times[0] + 1.1 * settings.pulse;
            let first = (end * RATE).ceil() as usize + 2;
            let response = &test.responses[0];
            peak = response.iter().fold(peak, |p, x| p.max(x.abs()));
            response[first..first + SAMPLES].to_vec()
        })
        .collect();
    (decays, peak)
}

/// Cramer-Rao bounds of frequency (Hz) and damping ratio for white noise of unit standard deviation.
fn bounds(modes: &[SimulatedMode], decays: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let poles: Vec<Complex64> = modes.iter().map(pole).collect();
    let power = |k: usize, n: usize| (poles[k] * n as f64 / RATE).exp();
    let count = modes.len();
    let model = DMatrix::from_fn(SAMPLES, 2 * count, |n, c| {
        let value = power(c / 2, n);
        if c % 2 == 0 { value.re } else { -value.im }
    });
    let qr = model.qr();
    let orthonormal = qr.q();
    let mut information = DMatrix::zeros(2 * count, 2 * count);
    for decay in decays {
        let x = nalgebra::DVector::from_column_slice(decay);
        let shares = orthonormal.tr_mul(&x);
        let parts = qr
            .r()
            .solve_upper_triangular(&shares)
            .expect("poles differ");
        // x = Re(a e^{p t}): d/d omega = Re(j t a e^{p t}), d/d decay = Re(-t a e^{p t}).
        let mut slopes = DMatrix::from_fn(SAMPLES, 2 * count, |n, c| {
            let k = c / 2;
            let value = Complex64::new(parts[2 * k], parts[2 * k + 1]) * power(k, n);
            let t = n as f64 / RATE;
            if c % 2 == 0 {
                -t * value.im
            } else {
                -t * value.re
            }
        });
        let along = orthonormal.tr_mul(&slopes);
        slopes -= &orthonormal * along;
        information += slopes.tr_mul(&slopes);
    }
    let covariance = information.try_inverse().expect("poles differ");
    (0..count)
        .map(|k| {
            // To first order in the damping: omega = 2 pi f, decay = zeta omega.
            let omega = TAU * modes[k].frequency;
            let of = |i: usize| covariance[(2 * k + i, 2 * k + i)].sqrt();
            (of(0) / TAU, of(1) / omega)
        })
        .collect()
}

fn pole(mode: &SimulatedMode) -> Complex64 {
    let omega = TAU * mode.frequency;
    let zeta = mode.damping_ratio;
    Complex64::new(-zeta * omega, omega * (1.0 - zeta * zeta).sqrt())
}

/// One fitted mode against the truth.
struct Trial {
    mode: usize,
    level: usize,
    truth: (f64, f64),
    bound: (f64, f64),
    fit: Option<ModeFit>,
}

fn trials(seed: u64) -> Vec<Trial> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let modes = modes(&mut random);
    let (clean, peak) = decays(&modes, seed);
    let unit = bounds(&modes, &clean);
    let starts: Vec<PoleStart> = modes
        .iter()
        .map(|mode| PoleStart {
            frequency: mode.frequency + random.random_range(-0.4..0.4),
            damping_ratio: None,
        })
        .collect();
    let places: Vec<(f64, f64)> = starts.iter().map(|s| (s.frequency, 0.005)).collect();
    let mut all = Vec::new();
    for (level, decibels) in LEVELS.iter().enumerate() {
        let noise = peak * 10f64.powf(-decibels / 20.0);
        let bands = bands_for(&places, RATE / SAMPLES as f64);
        let mut collector =
            FreeDecayCollector::new(RATE, SAMPLES, &bands).expect("lines within the bands");
        for decay in &clean {
            let noisy = decay.iter().map(|x| {
                let one: f64 = StandardNormal.sample(&mut random);
                x + noise * one
            });
            collector.add_tap(&[noisy.collect()]).expect("long enough");
        }
        let data = collector.finish().expect("finite values");
        let fits = fit_modes(&data, &starts, &FitSettings::default());
        for (mode, fit) in fits.into_iter().enumerate() {
            all.push(Trial {
                mode,
                level,
                truth: (modes[mode].frequency, modes[mode].damping_ratio),
                bound: (unit[mode].0 * noise, unit[mode].1 * noise),
                fit: fit.ok(),
            });
        }
    }
    all
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), x| (sum + x * x, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

fn share(values: impl Iterator<Item = bool>) -> f64 {
    let (yes, all) = values.fold((0, 0), |(yes, all), x| (yes + i32::from(x), all + 1));
    100.0 * f64::from(yes) / f64::from(all.max(1))
}

fn report(name: &str, trials: &[&Trial]) {
    let good: Vec<(&Trial, &ModeFit)> = trials
        .iter()
        .filter_map(|trial| trial.fit.as_ref().map(|fit| (*trial, fit)))
        .collect();
    let f = || {
        good.iter()
            .map(|(t, fit)| (fit.frequency, t.truth.0, t.bound.0))
    };
    let z = || {
        good.iter()
            .map(|(t, fit)| (fit.damping_ratio, t.truth.1, t.bound.1))
    };
    println!(
        "{name:12} {:4} f: rms {:.5} Hz, over bound {:.3}, stated {:.3}, covered {:5.1} %  zeta: rms {:6.2} %, over bound {:.3}, covered {:5.1} %  scatter {:4.1} % inflated {:4.1} % background {:4.1} %",
        trials.len() - good.len(),
        rms(f().map(|(v, truth, _)| v.value - truth)),
        rms(f().map(|(v, truth, bound)| (v.value - truth) / bound)),
        rms(f().map(|(v, _, bound)| v.std / bound)),
        share(f().map(|(v, truth, _)| v.low <= truth && truth <= v.high)),
        100.0 * rms(z().map(|(v, truth, _)| v.value / truth - 1.0)),
        rms(z().map(|(v, truth, bound)| (v.value - truth) / bound)),
        share(z().map(|(v, truth, _)| v.low <= truth && truth <= v.high)),
        share(f().map(|(v, ..)| v.source == UncertaintySource::TapScatter)),
        share(good.iter().map(|(_, fit)| fit.inflation > 1.0)),
        share(good.iter().map(|(_, fit)| fit.background_terms > 0)),
    );
}

/// Six modes, five taps of four seconds, three sensors, 12.8 kHz.
fn time_a_recording() {
    let rate = 12_800.0;
    let frequencies = [47.0, 190.0, 402.0, 655.0, 1190.0, 1820.0];
    let modes: Vec<SimulatedMode> = frequencies
        .iter()
        .enumerate()
        .map(|(k, &frequency)| SimulatedMode {
            frequency,
            damping_ratio: 0.004,
            shape_at_tap: shape(k, 0.37),
            shape_at_sensors: vec![shape(k, 0.2), shape(k, 0.5), shape(k, 0.95)],
        })
        .collect();
    let settings = TapTestSettings {
        sample_rate: rate,
        interval: 4.0,
        ..TapTestSettings::default()
    };
    let test = simulate_tap_test(&modes, &settings, 1);
    let samples = (3.75 * rate) as usize;
    let starts: Vec<PoleStart> = frequencies
        .iter()
        .map(|frequency| PoleStart {
            frequency: frequency + 0.05,
            damping_ratio: Some(0.005),
        })
        .collect();
    let places: Vec<(f64, f64)> = starts.iter().map(|s| (s.frequency, 0.005)).collect();
    let begin = std::time::Instant::now();
    let bands = bands_for(&places, rate / samples as f64);
    let mut collector = FreeDecayCollector::new(rate, samples, &bands).expect("bands");
    for time in &test.tap_times {
        let first = ((time + 2.0e-3) * rate) as usize;
        let cut = |response: &Vec<f64>| response[first..first + samples].to_vec();
        let decays: Vec<Vec<f64>> = test.responses.iter().map(cut).collect();
        collector.add_tap(&decays).expect("long enough");
    }
    let data = collector.finish().expect("finite values");
    let transformed = begin.elapsed();
    let fits = fit_modes(&data, &starts, &FitSettings::default());
    let found = fits.iter().filter(|fit| fit.is_ok()).count();
    println!(
        "20 s at 12.8 kHz, 3 sensors, 5 taps: {found} of 6 modes; transforms {transformed:.1?}, fit {:.1?}",
        begin.elapsed() - transformed
    );
    for fit in fits.iter().flatten() {
        println!(
            "   {:.5} +-{:.5} Hz, damping {:.6} +-{:.6}, {} lines, background {}, correlation {:.2}, {:?}",
            fit.frequency.value,
            fit.frequency.std,
            fit.damping_ratio.value,
            fit.damping_ratio.std,
            fit.lines,
            fit.background_terms,
            fit.residual_correlation,
            fit.frequency.source,
        );
    }
}

fn main() {
    let seeds: u64 = std::env::args()
        .nth(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(500);
    let all: Vec<Trial> = (0..seeds).into_par_iter().flat_map_iter(trials).collect();
    println!("{seeds} seeds; failures are counted after the name");
    for (level, decibels) in LEVELS.iter().enumerate() {
        for (mode, frequency) in FREQUENCIES.iter().enumerate() {
            let cell: Vec<&Trial> = all
                .iter()
                .filter(|t| t.mode == mode && t.level == level)
                .collect();
            report(&format!("{decibels} dB {frequency}"), &cell);
        }
    }
    report("pooled", &all.iter().collect::<Vec<_>>());
    time_a_recording();
}
