//! One recording as it is made: the structure moves, the hammer strikes, the recorder takes samples. Memory
//! does not grow with the length of the recording.
//!
//! Beside it a simpler simulator for tests of the measuring stages: time series of given modes, in memory.
//! A linear structure is given by its modes (natural frequency, damping ratio, shape at sensors and
//! tap, unit modal mass); hammer pulses drive each mode, whose response is computed by the exact
//! recursion for a force that is linear between samples. (Such a force is the sampled one times
//! sinc^2(f/rate): poles are exact, and amplitudes at a fifth of the sample rate 1.1 dB low.) Noise is
//! added and the channels are scaled to a recorder's full scale. The truth is an argument and never a part
//! of the recording.

use super::chain::{Chain, ConnectedSensor, HALF_LENGTH, Rates, Signal};
use super::hammer::{Hammer, Pulse, PulseShape, Tap, TapPlan};
use super::joint_moment::JointMoment;
use super::laboratory::{AntiAlias, Laboratory};
use super::motion::{Motion, Strike};
use super::observed_structure::{ObservedStructure, Sensed};
use num_complex::Complex64;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, TAU};
use tapjoint_beam::ModeShape;
use tapjoint_beam::effects::SensorSignal;
use tapjoint_numerics::stats::root_mean_square;

/// Least rate (Hz) of the simulation: pulses of a steel tip are resolved, and the filter sees what
/// would fold.
const LEAST_RATE: f64 = 48e3;
/// Least number of steps of the simulation for each sample.
const LEAST_FACTOR: usize = 4;
/// The mounting's resonance must lie below half the rate of the simulation, with some room.
const RATE_OVER_RESONANCE: f64 = 2.3;

/// A recording to be made.
#[derive(Debug, Clone)]
pub struct RecordingPlan {
    /// Sample rate that the file states (Hz).
    pub sample_rate: u32,
    /// Samples per channel.
    pub frames: u64,
    /// Factor on a true frequency when the file is read (1): the clock's error and a planted error of the time base.
    pub frequency_scale: f64,
    /// Channels in the order of the file as described, each with its SI units per unit of the file. Responses come
    /// in the order of the structure's sensors.
    pub channels: Vec<(Signal, f64)>,
    /// The content of each response's channel. A sensor that is connected to another's channel brings quantity, scale and
    /// error of sensitivity along: the file holds its voltage.
    pub signals: Vec<SensorSignal>,
    /// The taps.
    pub taps: TapPlan,
    /// Joint that is no linear spring.
    pub joint: Option<JointMoment>,
    /// Seed of everything random.
    pub seed: u64,
    /// Number of the recording, which gives it random numbers of its own.
    pub number: u64,
}

/// Streams of the channels' sensitivities, behind those of the recordings.
const SENSITIVITIES: u64 = 1 << 42;

impl RecordingPlan {
    /// Samples per true second (Hz): the clock's seconds are too long where frequencies read high.
    pub fn true_rate(&self) -> f64 {
        f64::from(self.sample_rate) / self.frequency_scale
    }

    /// Steps of the simulation for each sample.
    pub fn steps_per_sample(&self, laboratory: &Laboratory) -> usize {
        let rate = self.true_rate();
        let resonance = RATE_OVER_RESONANCE * laboratory.sensors.mounting_resonance;
        let wanted = (LEAST_RATE.max(resonance) / rate).ceil() as usize;
        wanted.max(LEAST_FACTOR)
    }

    /// Highest frequency (Hz) of a mode that moves in time; what lies beyond follows like a spring.
    pub fn highest_mode(&self, laboratory: &Laboratory) -> f64 {
        // Below half the simulation's rate, and far enough above the band that what is left of the modes
        // beyond is their compliance.
        let inner = self.true_rate() * self.steps_per_sample(laboratory) as f64;
        (1.8 * self.true_rate()).min(0.45 * inner)
    }

    /// Quantities of the sensors.
    fn sensed(&self) -> Vec<Sensed> {
        let channels = self.channels.iter();
        channels
            .filter_map(|(signal, _)| match signal {
                Signal::Force => None,
                Signal::Response(sensed) => Some(*sensed),
            })
            .collect()
    }

    /// The content of every channel; `None` = the hammer's.
    fn sources(&self) -> Vec<Option<SensorSignal>> {
        let mut signals = self.signals.iter().copied();
        let channels = self.channels.iter();
        channels
            .map(|(signal, _)| match signal {
                Signal::Force => None,
                Signal::Response(_) => signals.next(),
            })
            .collect()
    }

    /// Random numbers for one purpose of this recording.
    fn random(&self, purpose: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(self.number << 16 | purpose);
        random
    }
}

/// A recording in the making.
#[derive(Debug, Clone)]
pub struct RecordingRun {
    motion: Motion,
    structure: ObservedStructure,
    hammer: std::iter::Peekable<Hammer>,
    shape: PulseShape,
    chains: Vec<Chain>,
    /// For each channel the sensor that is connected to it; `None` = the hammer.
    sources: Vec<Option<usize>>,
    factor: usize,
    frames_left: u64,
    primed: u64,
    responses: Vec<f64>,
}

impl RecordingRun {
    /// Prepares a recording of a structure.
    pub fn new(
        structure: ObservedStructure,
        plan: &RecordingPlan,
        laboratory: &Laboratory,
    ) -> Self {
        let factor = plan.steps_per_sample(laboratory);
        let file_rate = plan.true_rate();
        let step = 1.0 / (file_rate * factor as f64);
        let delay = match laboratory.recorder.anti_alias {
            AntiAlias::On => HALF_LENGTH * factor,
            AntiAlias::Off => 0,
        };
        let sensed = plan.sensed();
        let sources = plan.sources();
        let rates = Rates {
            factor,
            file: file_rate,
        };
        // Responses follow the hammer, where there is one.
        let first = plan.channels.len() - sensed.len();
        let chains = sources.iter().zip(1..).map(|(source, number)| {
            let own = source.map_or(0, |signal| first + signal.sensor);
            let (signal, scale) = plan.channels[own];
            let mut gains = ChaCha8Rng::seed_from_u64(plan.seed);
            gains.set_stream(SENSITIVITIES | (own as u64 + 1));
            let factor = source.map_or(1.0, |signal| signal.factor);
            let sensor = ConnectedSensor {
                signal,
                scale,
                factor,
            };
            Chain::new(sensor, laboratory, rates, plan.random(number), &mut gains)
        });
        let chains = chains.collect();
        // The filter looks ahead by half its length: the simulation begins that much earlier.
        let start = -(delay as f64) * step;
        let reduced = structure.reduced().clone();
        Self {
            motion: Motion::new(reduced, &sensed, start, step, plan.joint.clone()),
            structure,
            hammer: Hammer::new(&laboratory.hammer, &plan.taps, plan.random(0)).peekable(),
            shape: plan.taps.pulse_shape,
            chains,
            sources: sources
                .iter()
                .map(|source| source.map(|signal| signal.sensor))
                .collect(),
            factor,
            frames_left: plan.frames,
            primed: 2 * delay as u64,
            responses: vec![0.0; sensed.len()],
        }
    }

    /// Gain (1) of each channel beside the scale of the sensor that is connected to it: errors of sensitivity, and what
    /// effects change.
    pub fn gains(&self) -> Vec<f64> {
        self.chains.iter().map(Chain::gain).collect()
    }

    /// The taps that are still to come.
    pub fn taps(&self) -> Vec<Tap> {
        self.hammer.clone().collect()
    }

    /// Writes the next sample of every channel into `frame`, in units of the file; `false` at the end.
    pub fn next_frame(&mut self, frame: &mut [f64]) -> bool {
        if self.frames_left == 0 {
            return false;
        }
        if self.primed != u64::MAX {
            // The state at the very beginning counts as the first step.
            self.feed();
            for _ in 0..self.primed {
                self.step();
            }
            self.primed = u64::MAX;
        } else {
            for _ in 0..self.factor {
                self.step();
            }
        }
        for (value, chain) in frame.iter_mut().zip(&mut self.chains) {
            *value = chain.sample();
        }
        self.frames_left -= 1;
        true
    }

    /// Steps that met the finest division before their tolerance ([`Motion::forced_steps`]).
    pub fn forced_steps(&self) -> u64 {
        self.motion.forced_steps()
    }

    fn step(&mut self) {
        let horizon = self.motion.time() + 2.0 * self.motion.step();
        while let Some(tap) = self.hammer.next_if(|tap| tap.time <= horizon) {
            for pulse in tap.pulses(self.shape) {
                let place = self.structure.struck(tap.position);
                self.motion.strike(Strike { pulse, place });
            }
        }
        self.motion.advance();
        self.feed();
    }

    fn feed(&mut self) {
        self.motion.responses(&mut self.responses);
        let force = self.motion.force();
        for (chain, source) in self.chains.iter_mut().zip(&self.sources) {
            let value = source.map_or(force, |sensor| self.responses[sensor]);
            chain.push(value);
        }
    }
}

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

/// Settings of a virtual test.
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
        // peak sin^2(pi t/pulse)
        let rate = settings.sample_rate;
        let first = (time * rate).ceil() as usize;
        let last = ((time + pulse) * rate) as usize;
        for (index, force) in force.iter_mut().enumerate().take(last + 1).skip(first) {
            let phase = PI * (index as f64 / rate - time) / pulse;
            *force += peak * phase.sin().powi(2);
        }
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
        let level = below(root_mean_square(response), settings.signal_to_noise_db);
        if level > 0.0 {
            add_noise(response, level, &mut random);
        }
    }
    let level = below(settings.peak_force, settings.force_to_noise_db);
    if level > 0.0 {
        add_noise(&mut force, level, &mut random);
    }
    TapTest {
        sample_rate: settings.sample_rate,
        tap_times,
        force,
        responses,
    }
}

/// Acceleration of one modal coordinate, q'' + 2 zeta omega q' + omega^2 q = shape_at_tap F, for a
/// force that is linear between samples.
///
/// With p = -zeta omega + j omega_d, z = q' - conj(p) q obeys z' = p z + F, which integrates exactly
/// over a step; q = Im z/omega_d, and q'' follows from the equation itself.
fn modal_acceleration(mode: &SimulatedMode, force: &[f64], sample_rate: f64) -> Vec<f64> {
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

/// Returns the level that lies so many decibels below another one.
pub fn below(level: f64, decibels: f64) -> f64 {
    level * 10f64.powf(-decibels / 20.0)
}

/// Adds white noise of this rms.
pub fn add_noise(samples: &mut [f64], rms: f64, random: &mut impl Rng) {
    for x in samples {
        let noise: f64 = StandardNormal.sample(random);
        *x += rms * noise;
    }
}

/// Returns the modes of a beam as a test observes them at these positions.
///
/// `shapes` are the structure's, `damping_ratios` one for each (the last one for all beyond);
/// `tap` and `sensors` are positions along the beam (m). Modes beyond `highest` (Hz) are left out:
/// nothing above half the sample rate may be simulated.
pub fn observed_modes(
    shapes: &[ModeShape],
    damping_ratios: &[f64],
    tap: f64,
    sensors: &[f64],
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
        let responses = self.responses.iter().map(|x| (x, response_scale));
        std::iter::once((&self.force, force_scale))
            .chain(responses)
            .map(|(samples, scale)| samples.iter().map(|x| x / scale).collect())
            .collect()
    }
}

/// Response to one mean tap.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trial {
    /// Largest value of the hammer's and each sensor's true signal (SI).
    pub(super) peaks: Vec<f64>,
    /// Largest rotation of the joint (rad).
    pub(super) joint_rotation: f64,
}

/// Time for which the tap is followed: some periods of the lowest mode of beams that are tapped by hand (s).
const FOLLOWED: f64 = 0.3;

/// Strikes the linear structure once, to find how far channels and joint will be driven.
pub(super) fn try_out(
    structure: &ObservedStructure,
    plan: &RecordingPlan,
    laboratory: &Laboratory,
) -> Trial {
    let sensed = plan.sensed();
    let rate = plan.true_rate() * plan.steps_per_sample(laboratory) as f64;
    let step = 1.0 / rate;
    let mut motion = Motion::new(structure.reduced().clone(), &sensed, 0.0, step, None);
    motion.strike(Strike {
        pulse: Pulse {
            start: 0.5 * step,
            length: plan.taps.pulse_length,
            peak: plan.taps.peak_force,
            shape: plan.taps.pulse_shape,
        },
        place: structure.struck(plan.taps.position),
    });
    let mut largest = vec![0.0; sensed.len()];
    let mut responses = largest.clone();
    let mut joint_rotation: f64 = 0.0;
    for _ in 0..(FOLLOWED * rate) as usize {
        motion.advance();
        motion.responses(&mut responses);
        for (largest, value) in largest.iter_mut().zip(&responses) {
            *largest = f64::max(*largest, value.abs());
        }
        joint_rotation = joint_rotation.max(motion.joint_rotation().abs());
    }
    let hammer = plan.channels.len() > sensed.len();
    let force = hammer.then_some(plan.taps.peak_force);
    Trial {
        peaks: force.into_iter().chain(largest).collect(),
        joint_rotation,
    }
}

/// The next of 1, 2, 5, 10, ... at or above.
pub(super) fn round_scale(value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 1.0;
    }
    let decade = 10f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let found = steps.into_iter().find(|step| step * decade >= value);
    found.unwrap_or(10.0) * decade
}
