//! What becomes of a signal between the beam and the file: one channel's sensor, cable and converter.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::filters::{Decimator, HighPass, Resonance};
use super::laboratory::{AntiAlias, Laboratory};
use super::reduced::Sensed;

/// Quality of the mounting's resonance: what screws and wax have, between 10 and 30.
const MOUNTING_QUALITY: f64 = 20.0;
/// Time constant of the zero's drift (s).
const DRIFT_TIME: f64 = 5.0;
/// The mains' third harmonic beside the first.
const THIRD_HARMONIC: f64 = 0.3;

/// What a channel carries.
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

/// What is added after the anti-alias filter.
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
    /// Angle of the mains (rad), and its step.
    mains: (f64, f64),
}

/// The rates of a channel (Hz): of the simulation, and of the file in true seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates {
    pub(super) factor: usize,
    pub(super) file: f64,
}

impl Chain {
    /// `random` is the recording's own; `gains` is the same in all recordings of a test, whose sensors are
    /// the same.
    pub(super) fn new(
        signal: Signal,
        scale: f64,
        laboratory: &Laboratory,
        rates: Rates,
        (mut random, gains): (ChaCha8Rng, &mut ChaCha8Rng),
    ) -> Self {
        let (sensors, recorder) = (&laboratory.sensors, &laboratory.recorder);
        let inner = rates.file * rates.factor as f64;
        let normal = |random: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(random) };
        let gain = 1.0 + sensors.sensitivity_error * normal(gains);
        let accelerometer = signal == Signal::Response(Sensed::Acceleration);
        let mounting = accelerometer && sensors.mounting_resonance > 0.0;
        let full_scale = scale.abs();
        let offset = recorder.offset * full_scale * normal(&mut random);
        let drifted = recorder.drift * full_scale * normal(&mut random);
        let angle = random.random_range(0.0..TAU);
        Self {
            gain,
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
                offset,
                drift: recorder.drift * full_scale,
                drift_memory: (-1.0 / (DRIFT_TIME * rates.file)).exp(),
                drifted,
                hum: recorder.hum * full_scale,
                mains: (angle, TAU * recorder.mains / rates.file),
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
        (value + self.disturbance.next()) / self.scale
    }
}

impl Disturbance {
    fn next(&mut self) -> f64 {
        // Both are drawn for every sample, so that switching one off does not change the other.
        let [noise, push]: [f64; 2] =
            std::array::from_fn(|_| StandardNormal.sample(&mut self.random));
        let mut sum = self.offset + self.noise * noise;
        if self.drift > 0.0 {
            // An Ornstein-Uhlenbeck process of constant variance.
            let keep = self.drift_memory;
            self.drifted = keep * self.drifted + self.drift * (1.0 - keep * keep).sqrt() * push;
            sum += self.drifted;
        }
        if self.hum > 0.0 {
            let (angle, step) = &mut self.mains;
            sum += self.hum * (angle.sin() + THIRD_HARMONIC * (3.0 * *angle).sin());
            *angle = (*angle + *step) % TAU;
        }
        sum
    }
}
