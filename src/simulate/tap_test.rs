//! Time series of given modes, in memory: what tests of the measuring stages need.
//!
//! A linear structure is given by its modes (natural frequency, damping ratio, shape at sensors and
//! tap, unit modal mass); hammer pulses drive each mode, whose response is computed by the exact
//! recursion for a force that is linear between samples. (Such a force is the sampled one times
//! sinc^2(f/rate): poles are exact, and amplitudes at a fifth of the sample rate 1.1 dB low.) Noise is
//! added and the channels are scaled
//! to a recorder's full scale. What the diagnosis must not see stays here: the truth is an argument,
//! never a part of the recording.

use std::f64::consts::{PI, TAU};

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use tapjoint_beam::ModeShape;
use tapjoint_numerics::stats::root_mean_square;

/// One mode of the structure as the sensors see it.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedMode {
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Mass-normalised shape where the hammer strikes (kg^-1/2).
    pub shape_at_tap: f64,
    /// Mass-normalised shape at each sensor (kg^-1/2).
    pub shape_at_sensors: Vec<f64>,
}

/// How a virtual test is carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct TapTestSettings {
    /// Sample rate (Hz). 5120, for a band to 2000 Hz.
    pub sample_rate: f64,
    /// Number of taps. 5, what good practice asks for.
    pub taps: usize,
    /// Time between taps (s).
    pub interval: f64,
    /// Quiet time before the first tap (s).
    pub lead: f64,
    /// Peak force (N); each tap varies by 20 % about it.
    pub peak_force: f64,
    /// Length of the pulse (s); each tap varies by 10 % about it. 1.5 ms: a plastic tip.
    pub pulse: f64,
    /// Noise of each response: rms of the response over the record to rms of the noise (dB);
    /// infinite for none.
    pub signal_to_noise_db: f64,
    /// Noise of the force: peak to rms of the noise (dB); infinite for none.
    pub force_to_noise_db: f64,
}

impl Default for TapTestSettings {
    fn default() -> Self {
        TapTestSettings {
            sample_rate: 5120.0,
            taps: 5,
            interval: 5.0,
            lead: 0.5,
            peak_force: 50.0,
            pulse: 1.5e-3,
            signal_to_noise_db: 60.0,
            force_to_noise_db: 70.0,
        }
    }
}

/// Time series of a virtual test, in physical units.
#[derive(Debug, Clone, PartialEq)]
pub struct TapTest {
    /// Sample rate (Hz).
    pub sample_rate: f64,
    /// Times at which the pulses begin (s).
    pub tap_times: Vec<f64>,
    /// Force (N).
    pub force: Vec<f64>,
    /// Acceleration at each sensor (m/s2).
    pub responses: Vec<Vec<f64>>,
}

/// Simulates a tap test of the structure with these `modes`; the same seed gives the same test.
pub fn simulate_tap_test(
    modes: &[SimulatedMode],
    settings: &TapTestSettings,
    seed: u64,
) -> TapTest {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let length = settings.lead + settings.interval * settings.taps as f64;
    let samples = (length * settings.sample_rate).round() as usize;
    let mut force = vec![0.0; samples];
    let mut tap_times = Vec::with_capacity(settings.taps);
    for tap in 0..settings.taps {
        // Taps fall between samples and are never quite in rhythm.
        let time = settings.lead + tap as f64 * settings.interval + random.random_range(0.0..0.02);
        let peak = settings.peak_force * (1.0 + random.random_range(-0.2..0.2));
        let pulse = settings.pulse * (1.0 + random.random_range(-0.1..0.1));
        add_pulse(&mut force, settings.sample_rate, time, (pulse, peak));
        tap_times.push(time);
    }
    let sensors = modes.first().map_or(0, |mode| mode.shape_at_sensors.len());
    let mut responses = vec![vec![0.0; samples]; sensors];
    for mode in modes {
        let acceleration = modal_acceleration(mode, &force, settings.sample_rate);
        for (response, shape) in responses.iter_mut().zip(&mode.shape_at_sensors) {
            for (x, a) in response.iter_mut().zip(&acceleration) {
                *x += shape * a;
            }
        }
    }
    for response in &mut responses {
        let level = root_mean_square(response) * decibels(-settings.signal_to_noise_db);
        add_noise(response, level, &mut random);
    }
    let level = settings.peak_force * decibels(-settings.force_to_noise_db);
    add_noise(&mut force, level, &mut random);
    TapTest {
        sample_rate: settings.sample_rate,
        tap_times,
        force,
        responses,
    }
}

/// Adds the pulse peak sin^2(pi t/pulse) that begins at `time` (s).
fn add_pulse(force: &mut [f64], sample_rate: f64, time: f64, (pulse, peak): (f64, f64)) {
    let first = (time * sample_rate).ceil() as usize;
    let last = ((time + pulse) * sample_rate) as usize;
    for index in first..=last.min(force.len().saturating_sub(1)) {
        let phase = PI * (index as f64 / sample_rate - time) / pulse;
        force[index] += peak * phase.sin().powi(2);
    }
}

/// Acceleration of one modal coordinate, q'' + 2 zeta omega q' + omega^2 q = shape_at_tap F, for a
/// force that is linear between samples.
///
/// With p = -zeta omega + j omega_d, z = q' - conj(p) q obeys z' = p z + F, which integrates exactly
/// over a step; q = Im z/omega_d, and q'' follows from the equation itself.
fn modal_acceleration(mode: &SimulatedMode, force: &[f64], sample_rate: f64) -> Vec<f64> {
    use num_complex::Complex64;
    let omega = TAU * mode.frequency;
    let damped = omega * (1.0 - mode.damping_ratio.powi(2)).sqrt();
    let pole = Complex64::new(-mode.damping_ratio * omega, damped);
    let step = pole / sample_rate;
    let advance = step.exp();
    // Integrals of e^{p (h - t)} and of e^{p (h - t)} t/h over one step h.
    let constant = (advance - 1.0) / pole;
    let ramp = (constant * sample_rate - 1.0) / pole;
    let mut z = Complex64::ZERO;
    let mut before = 0.0;
    force
        .iter()
        .map(|&f| {
            let drive = mode.shape_at_tap * f;
            z = advance * z + constant * before + ramp * (drive - before);
            before = drive;
            let q = z.im / damped;
            let velocity = z.re + pole.re * q;
            drive - 2.0 * mode.damping_ratio * omega * velocity - omega * omega * q
        })
        .collect()
}

fn decibels(level: f64) -> f64 {
    10f64.powf(level / 20.0)
}

fn add_noise(samples: &mut [f64], level: f64, random: &mut impl Rng) {
    if level > 0.0 {
        for x in samples {
            let noise: f64 = StandardNormal.sample(random);
            *x += level * noise;
        }
    }
}

/// The modes of a beam as a test with these positions sees them.
///
/// `shapes` are the structure's, `damping_ratios` one for each (the last one for all beyond);
/// `tap` and `sensors` are positions along the beam (m). Modes beyond `highest` (Hz) are left out:
/// nothing above half the sample rate may be simulated.
pub fn seen_modes(
    shapes: &[ModeShape],
    damping_ratios: &[f64],
    (tap, sensors): (f64, &[f64]),
    highest: f64,
) -> Vec<SimulatedMode> {
    let last = damping_ratios.last().copied().unwrap_or(0.0);
    shapes
        .iter()
        .enumerate()
        .filter(|(_, shape)| shape.frequency < highest)
        .map(|(index, shape)| SimulatedMode {
            frequency: shape.frequency,
            damping_ratio: damping_ratios.get(index).copied().unwrap_or(last),
            shape_at_tap: shape.displacement(tap),
            shape_at_sensors: sensors.iter().map(|&x| shape.displacement(x)).collect(),
        })
        .collect()
}

impl TapTest {
    /// Force and responses as channels in file units: divided by these scales (N, and m/s2, per
    /// unit of the file).
    pub fn channels(&self, force_scale: f64, response_scale: f64) -> Vec<Vec<f64>> {
        let scaled = |samples: &[f64], scale: f64| samples.iter().map(|x| x / scale).collect();
        std::iter::once(scaled(&self.force, force_scale))
            .chain(
                self.responses
                    .iter()
                    .map(|response| scaled(response, response_scale)),
            )
            .collect()
    }
}
