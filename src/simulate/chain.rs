//! One channel between the beam and the file: sensor, cable and converter, with their filters at the rate
//! of the simulation.

use super::laboratory::{AntiAlias, Laboratory};
use super::observed_structure::Sensed;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, TAU};
use tapjoint_numerics::bessel_i0;

/// Quality of the mounting's resonance: what screws and wax have, between 10 and 30.
const MOUNTING_QUALITY: f64 = 20.0;
/// Time constant of the zero's drift (s).
const DRIFT_TIME: f64 = 5.0;
/// The mains' third harmonic beside the first.
const THIRD_HARMONIC: f64 = 0.3;

/// Quantity that a channel carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signal {
    /// The hammer's force (N).
    Force,
    /// A sensor's signal.
    Response(Sensed),
}

impl Signal {
    /// Noise of a good sensor over the recorded band (N, m/s2, m/s, m; rms): a piezoelectric hammer, an
    /// accelerometer of 100 mV/g, a laser vibrometer, a laser triangulation sensor.
    pub fn good_noise(self) -> f64 {
        match self {
            Self::Force => 0.005,
            Self::Response(Sensed::Acceleration) => 0.003,
            Self::Response(Sensed::Velocity) => 2e-6,
            Self::Response(Sensed::Displacement) => 1e-7,
        }
    }
}

/// One channel on its way to the file.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    gain: f64,
    mounting: Option<Resonance>,
    coupling: Option<HighPass>,
    converter: Converter,
    disturbance: Disturbance,
    /// SI units per unit of the file.
    scale: f64,
}

#[derive(Debug, Clone)]
enum Converter {
    Filtered(Decimator),
    Bare(f64),
}

/// Noise, offset, drift and hum, which are added after the anti-alias filter.
#[derive(Debug, Clone)]
struct Disturbance {
    random: ChaCha8Rng,
    noise: f64,
    offset: f64,
    drift: f64,
    /// Share of the drift that is left after one sample.
    drift_memory: f64,
    drifted: f64,
    hum: f64,
    /// Angle of the mains (rad).
    mains_angle: f64,
    /// Step of that angle from sample to sample (rad).
    mains_step: f64,
}

/// The sensor that is connected to a channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct ConnectedSensor {
    pub(super) signal: Signal,
    /// Its SI units per unit of the file.
    pub(super) scale: f64,
    /// Factor on its signal (1).
    pub(super) factor: f64,
}

/// Rate of the file (Hz, in true seconds), and steps of the simulation for each of its samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates {
    pub(super) factor: usize,
    pub(super) file: f64,
}

impl Chain {
    /// `random` is the recording's own; `gains` is the same in all recordings of a test, whose sensors are
    /// the same.
    pub(super) fn new(
        sensor: ConnectedSensor,
        laboratory: &Laboratory,
        rates: Rates,
        mut random: ChaCha8Rng,
        gains: &mut ChaCha8Rng,
    ) -> Self {
        let ConnectedSensor {
            signal,
            scale,
            factor,
        } = sensor;
        let (sensors, recorder) = (&laboratory.sensors, &laboratory.recorder);
        let inner = rates.file * rates.factor as f64;
        let sensitivity_error: f64 = StandardNormal.sample(gains);
        let accelerometer = signal == Signal::Response(Sensed::Acceleration);
        let mounting = accelerometer && sensors.mounting_resonance > 0.0;
        let full_scale = scale.abs();
        let [offset, drifted]: [f64; 2] =
            std::array::from_fn(|_| StandardNormal.sample(&mut random));
        let mains_angle = random.random_range(0.0..TAU);
        Self {
            gain: factor * (1.0 + sensors.sensitivity_error * sensitivity_error),
            mounting: mounting
                .then(|| Resonance::new(sensors.mounting_resonance, MOUNTING_QUALITY, inner)),
            coupling: (sensors.ac_coupling > 0.0)
                .then(|| HighPass::new(sensors.ac_coupling, inner)),
            converter: match recorder.anti_alias {
                AntiAlias::On => Converter::Filtered(Decimator::new(rates.factor)),
                AntiAlias::Off => Converter::Bare(0.0),
            },
            disturbance: Disturbance {
                random,
                noise: sensors.noise * signal.good_noise(),
                offset: recorder.offset * full_scale * offset,
                drift: recorder.drift * full_scale,
                drift_memory: (-1.0 / (DRIFT_TIME * rates.file)).exp(),
                drifted: recorder.drift * full_scale * drifted,
                hum: recorder.hum * full_scale,
                mains_angle,
                mains_step: TAU * recorder.mains / rates.file,
            },
            scale,
        }
    }

    /// The channel's gain (1) beside the one its scale states.
    pub(super) fn gain(&self) -> f64 {
        self.gain
    }

    /// Takes one value of the true signal (SI).
    pub(super) fn push(&mut self, value: f64) {
        let mut value = self.gain * value;
        if let Some(mounting) = &mut self.mounting {
            value = mounting.push(value);
        }
        if let Some(coupling) = &mut self.coupling {
            value = coupling.push(value);
        }
        match &mut self.converter {
            Converter::Filtered(filter) => filter.push(value),
            Converter::Bare(last) => *last = value,
        }
    }

    /// Gives one sample, in units of the file.
    pub(super) fn sample(&mut self) -> f64 {
        let value = match &self.converter {
            Converter::Filtered(filter) => filter.output(),
            Converter::Bare(last) => *last,
        };
        let added = &mut self.disturbance;
        // Both are drawn for every sample, so that switching one off does not change the other.
        let [noise, push]: [f64; 2] =
            std::array::from_fn(|_| StandardNormal.sample(&mut added.random));
        let mut sum = added.offset + added.noise * noise;
        if added.drift > 0.0 {
            // An Ornstein-Uhlenbeck process of constant variance.
            let keep = added.drift_memory;
            added.drifted = keep * added.drifted + added.drift * (1.0 - keep * keep).sqrt() * push;
            sum += added.drifted;
        }
        if added.hum > 0.0 {
            let angle = added.mains_angle;
            sum += added.hum * (angle.sin() + THIRD_HARMONIC * (3.0 * angle).sin());
            added.mains_angle = (angle + added.mains_step) % TAU;
        }
        (value + sum) / self.scale
    }
}

/// A high-pass of first order, as condensers make it.
#[derive(Debug, Clone)]
struct HighPass {
    factor: f64,
    gain: f64,
    input: f64,
    output: f64,
}

impl HighPass {
    /// By the bilinear transform, which is exact enough where the corner lies far below the rate.
    pub(super) fn new(corner: f64, rate: f64) -> Self {
        let warped = (PI * corner / rate).tan();
        Self {
            factor: (1.0 - warped) / (1.0 + warped),
            gain: 1.0 / (1.0 + warped),
            input: 0.0,
            output: 0.0,
        }
    }

    pub(super) fn push(&mut self, input: f64) -> f64 {
        self.output = self.factor * self.output + self.gain * (input - self.input);
        self.input = input;
        self.output
    }
}

/// A resonance: a mass on a spring, driven by the spring's foot.
#[derive(Debug, Clone)]
pub(super) struct Resonance {
    feedback: [f64; 2],
    forward: [f64; 2],
    input: f64,
    outputs: [f64; 2],
}

impl Resonance {
    /// Poles of the continuous system, zeros so that the magnitude is right at zero, at the resonance
    /// and at half the rate (Vicanek, "Matched second order digital filters", 2016). The resonance must
    /// lie below half the rate.
    pub(super) fn new(frequency: f64, quality: f64, rate: f64) -> Self {
        let omega = TAU * frequency / rate;
        let decay = 0.5 * omega / quality;
        let turn = (omega * omega - decay * decay).max(0.0).sqrt();
        let feedback = [-2.0 * (-decay).exp() * turn.cos(), (-2.0 * decay).exp()];
        let [a1, a2] = feedback;
        let half = (0.5 * omega).sin().powi(2);
        let phi = [1.0 - half, half, 4.0 * half * (1.0 - half)];
        let squares = [(1.0 + a1 + a2).powi(2), (1.0 - a1 + a2).powi(2), -4.0 * a2];
        let at_resonance: f64 = squares.iter().zip(phi).map(|(a, phi)| a * phi).sum();
        let b0_square = squares[0];
        let wanted = at_resonance * quality * quality;
        let b1_square = ((wanted - b0_square * phi[0]) / phi[1]).max(0.0);
        let b0 = 0.5 * (b0_square.sqrt() + b1_square.sqrt());
        Self {
            feedback,
            forward: [b0, b0_square.sqrt() - b0],
            input: 0.0,
            outputs: [0.0; 2],
        }
    }

    pub(super) fn push(&mut self, input: f64) -> f64 {
        let [b0, b1] = self.forward;
        let [a1, a2] = self.feedback;
        let output = b0 * input + b1 * self.input - a1 * self.outputs[0] - a2 * self.outputs[1];
        self.input = input;
        self.outputs = [output, self.outputs[0]];
        output
    }
}

/// An anti-alias filter of linear phase that gives one sample for each `factor` of its input.
#[derive(Debug, Clone)]
struct Decimator {
    weights: Vec<f64>,
    /// The last inputs, twice, so that they lie in one piece wherever the newest stands.
    inputs: Vec<f64>,
    newest: usize,
}

/// Half the filter's length, in samples after decimation: 110 dB over a transition from rate/2.56 to
/// its mirror (1 - 1/2.56) rate take 16.2 by Kaiser's formula.
pub(super) const HALF_LENGTH: usize = 17;
/// Kaiser's beta for 110 dB, 0.1102 (110 - 8.7).
const BETA: f64 = 11.16;

impl Decimator {
    pub(super) fn new(factor: usize) -> Self {
        let half = HALF_LENGTH * factor;
        let mut weights: Vec<f64> = (0..=2 * half)
            .map(|index| {
                let offset = index as f64 - half as f64;
                let x = offset / half as f64;
                let argument = BETA * (1.0 - x * x).max(0.0).sqrt();
                // Cut-off in the middle of the transition, half the rate after decimation.
                let angle = PI * (offset / factor as f64);
                let sinc = match offset == 0.0 {
                    true => 1.0,
                    false => angle.sin() / angle,
                };
                bessel_i0(argument) * sinc
            })
            .collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        Self {
            inputs: vec![0.0; 2 * weights.len()],
            weights,
            newest: 0,
        }
    }

    pub(super) fn push(&mut self, input: f64) {
        let length = self.weights.len();
        self.newest = (self.newest + 1) % length;
        self.inputs[self.newest] = input;
        self.inputs[self.newest + length] = input;
    }

    /// The filtered signal, in the middle of the last inputs.
    pub(super) fn output(&self) -> f64 {
        let length = self.weights.len();
        let window = &self.inputs[self.newest + 1..=self.newest + length];
        // Sums of their own for each of eight lanes keep the processor's units busy.
        let mut sums = [0.0; 8];
        let (weights, rest) = self.weights.as_chunks::<8>();
        let (inputs, others) = window.as_chunks::<8>();
        for (weights, inputs) in weights.iter().zip(inputs) {
            for ((sum, weight), input) in sums.iter_mut().zip(weights).zip(inputs) {
                *sum += weight * input;
            }
        }
        let tail: f64 = rest.iter().zip(others).map(|(w, x)| w * x).sum();
        sums.iter().sum::<f64>() + tail
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    /// Gain of weights at a frequency, in parts of the rate.
    fn gain(weights: &[f64], part: f64) -> f64 {
        let terms = weights.iter().enumerate();
        terms
            .map(|(n, weight)| Complex64::from_polar(*weight, -TAU * part * n as f64))
            .sum::<Complex64>()
            .norm()
    }

    #[test]
    fn val_the_decimator_passes_its_band_and_nothing_that_would_fold_into_it() {
        for factor in [4, 10] {
            let filter = Decimator::new(factor);
            let rate = factor as f64;
            for step in 0..=100 {
                // In parts of the rate after decimation: the band ends at 1/2.56.
                let part = 0.01 * f64::from(step) / 2.56;
                let ripple = gain(&filter.weights, part / rate) - 1.0;
                assert!(ripple.abs() < 1e-5, "factor {factor}, {part}: {ripple}");
                // 105 dB; Kaiser's formula aims at 110 and errs by some.
                let folded = gain(&filter.weights, (1.0 - part) / rate);
                assert!(folded < 6e-6, "factor {factor}, {part}: {folded}");
            }
        }
    }

    #[test]
    fn val_a_constant_passes_the_decimator_unchanged_once_it_is_full() {
        let mut filter = Decimator::new(4);
        for _ in 0..=2 * HALF_LENGTH * 4 {
            filter.push(2.5);
        }
        assert!((filter.output() - 2.5).abs() < 1e-12, "{}", filter.output());
    }

    /// Amplitude that a filter makes of a sine of amplitude 1, by its largest value in the end.
    fn amplitude(mut filter: impl FnMut(f64) -> f64, frequency: f64, rate: f64) -> f64 {
        let samples = (rate * (20.0 / frequency).max(0.02)) as usize;
        let outputs: Vec<f64> = (0..samples)
            .map(|n| filter((TAU * frequency * n as f64 / rate).sin()))
            .collect();
        let end = &outputs[samples / 2..];
        end.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
    }

    #[test]
    fn val_mounting_and_coupling_have_the_gains_of_their_continuous_models() {
        let rate = 51_200.0;
        for frequency in [100.0, 1000.0, 2000.0, 5000.0] {
            let mut mounting = Resonance::new(18e3, 20.0, rate);
            let found = amplitude(|x| mounting.push(x), frequency, rate);
            let r: f64 = frequency / 18e3;
            let expected = ((1.0 - r * r).powi(2) + (r / 20.0).powi(2)).sqrt().recip();
            // The match of three points on the curve keeps 1 % of the gain in between.
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "{frequency}: {found} for {expected}"
            );
        }
        for frequency in [2.0, 10.0, 50.0] {
            let mut coupling = HighPass::new(10.0, rate);
            let found = amplitude(|x| coupling.push(x), frequency, rate);
            let expected = frequency / 10f64.hypot(frequency);
            assert!(
                (found / expected - 1.0).abs() < 5e-3,
                "{frequency}: {found} for {expected}"
            );
        }
    }
}
