//! One recording as it is made: the structure moves, the hammer strikes, the recorder takes samples.
//! Nothing is kept that grows with the recording.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::chain::{Chain, Rates, Signal};
use super::filters::HALF_LENGTH;
use super::hammer::{Hammer, Tap, TapPlan};
use super::joint_moment::JointMoment;
use super::laboratory::{AntiAlias, Laboratory};
use super::motion::{Motion, Strike};
use super::reduced::Sensed;
use super::seen::SeenStructure;

/// Least rate (Hz) of the simulation: pulses of a steel tip are resolved, and the filter sees what
/// would fold.
const LEAST_RATE: f64 = 48e3;
/// Least number of steps of the simulation for each sample.
const LEAST_FACTOR: usize = 4;
/// The mounting's resonance must lie below half the rate of the simulation, with some room.
const RATE_OVER_RESONANCE: f64 = 2.3;

/// A recording to be made.
#[derive(Debug, Clone)]
pub struct TakePlan {
    /// Sample rate that the file states (Hz).
    pub sample_rate: u32,
    /// Samples per channel.
    pub frames: u64,
    /// What a true frequency is multiplied by when the file is read: the clock's error.
    pub frequency_scale: f64,
    /// Channels in the order of the file, each with its SI units per unit of the file. Responses come
    /// in the order of the structure's sensors.
    pub channels: Vec<(Signal, f64)>,
    /// The taps.
    pub taps: TapPlan,
    /// Joint that is no linear spring.
    pub joint: Option<JointMoment>,
    /// Seed of everything random, and the recording's number, which gives it random numbers of its own.
    pub seed: (u64, u64),
}

/// Streams of the channels' sensitivities, behind those of the recordings.
const SENSITIVITIES: u64 = 1 << 42;

impl TakePlan {
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
}

/// A recording in the making.
#[derive(Debug, Clone)]
pub struct Take {
    motion: Motion,
    structure: SeenStructure,
    hammer: std::iter::Peekable<Hammer>,
    shape: super::pulse::PulseShape,
    chains: Vec<Chain>,
    /// For each channel the sensor it belongs to; `None` = the hammer.
    sources: Vec<Option<usize>>,
    factor: usize,
    frames_left: u64,
    primed: u64,
    responses: Vec<f64>,
}

impl Take {
    /// Prepares a recording of a structure.
    pub fn new(structure: SeenStructure, plan: &TakePlan, laboratory: &Laboratory) -> Self {
        let factor = plan.steps_per_sample(laboratory);
        let file_rate = plan.true_rate();
        let step = 1.0 / (file_rate * factor as f64);
        let delay = match laboratory.recorder.anti_alias {
            AntiAlias::On => HALF_LENGTH * factor,
            AntiAlias::Off => 0,
        };
        let sensed: Vec<Sensed> = plan
            .channels
            .iter()
            .filter_map(|(signal, _)| match signal {
                Signal::Force => None,
                Signal::Response(sensed) => Some(*sensed),
            })
            .collect();
        let random = |purpose: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(plan.seed.0);
            random.set_stream(plan.seed.1 << 16 | purpose);
            random
        };
        let rates = Rates {
            factor,
            file: file_rate,
        };
        let channels = plan.channels.iter().zip(1..);
        let chains = channels
            .map(|((signal, scale), number)| {
                let mut gains = ChaCha8Rng::seed_from_u64(plan.seed.0);
                gains.set_stream(SENSITIVITIES | number);
                let random = (random(number), &mut gains);
                Chain::new(*signal, *scale, laboratory, rates, random)
            })
            .collect();
        // The filter looks ahead by half its length: the simulation begins so much earlier.
        let start = (-(delay as f64) * step, step);
        Self {
            motion: Motion::new(
                structure.reduced().clone(),
                &sensed,
                start,
                plan.joint.clone(),
            ),
            structure,
            hammer: Hammer::new(&laboratory.hammer, &plan.taps, random(0)).peekable(),
            shape: plan.taps.pulse.1,
            chains,
            sources: sources(plan),
            factor,
            frames_left: plan.frames,
            primed: 2 * delay as u64,
            responses: vec![0.0; sensed.len()],
        }
    }

    /// Gain (1) of each channel beside the one its scale states: the errors of the sensitivities.
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

/// For each channel the sensor it belongs to.
fn sources(plan: &TakePlan) -> Vec<Option<usize>> {
    let mut sensors = 0..;
    let channels = plan.channels.iter();
    channels
        .map(|(signal, _)| match signal {
            Signal::Force => None,
            Signal::Response(_) => sensors.next(),
        })
        .collect()
}
