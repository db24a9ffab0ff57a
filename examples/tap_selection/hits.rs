//! Hits on a clamped bar, with places, levels and joints of all kinds, as a recording in memory.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use std::f64::consts::TAU;
use tapjoint::description::{ChannelRef, TapSelection};
use tapjoint::pipeline::{Analysis, run_recording};
use tapjoint::recording::{Channel, Recording};
use tapjoint::simulate::{
    Damping, JointMoment, Motion, ObservedStructure, Pulse, PulseShape, Sensed, SpecimenSettings,
    Strike,
};
use tapjoint::structure::Beam;
use tapjoint::structure::effects::JointLaw;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Joint, Specimen};
use tapjoint::taps::{Rejection, Tap};

/// Length of the bar (m).
pub const LENGTH: f64 = 0.423;
/// Sample rate (Hz), and steps of the simulation for each sample.
const RATE: f64 = 5120.0;
const STEPS: usize = 4;
/// Modes up to this frequency move in time (Hz): those of the band. The others follow like springs.
const HIGHEST: f64 = 2000.0;
/// Place of the hits (m).
const PLACE: f64 = 0.36;

/// One hit.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Place (m).
    pub place: f64,
    /// Peak force (N).
    pub level: f64,
    /// Length of the pulse (s).
    pub length: f64,
    /// Factor on the response of the first sensor (1), which turns or comes loose.
    pub sensor: f64,
}

/// Distribution of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    White,
    /// Low frequencies: white noise through a pole at 0.98.
    Red,
    /// Student's t of three degrees of freedom.
    HeavyTailed,
    /// Half of the power in hum of 50 and 150 Hz.
    Hum,
}

/// A recording that is to be made.
#[derive(Debug, Clone)]
pub struct Trial {
    pub hits: Vec<Hit>,
    /// Time between two hits (s).
    pub interval: f64,
    /// Damping ratio of all modes (1).
    pub damping: f64,
    /// Places of the sensors (m).
    pub sensors: Vec<f64>,
    pub noise: Noise,
    /// Noise below the largest response (dB).
    pub quiet: f64,
    /// Law of the joint; its ratio holds at `hardest`.
    pub law: Option<JointLaw>,
    /// Peak force to which the law refers (N).
    pub hardest: f64,
    pub seed: u64,
}

impl Trial {
    /// Taps at one place with the scatter of a hand: 10 % in level, 3 % in length, and `scatter` (m) in place.
    pub fn by_hand(taps: usize, scatter: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let hits = (0..taps).map(|_| Hit {
            place: PLACE + scatter * normal(),
            level: 20.0 * (1.0 + 0.1 * normal()),
            length: 2e-3 * (1.0 + 0.03 * normal()),
            sensor: 1.0,
        });
        Trial {
            hits: hits.collect(),
            interval: 2.0,
            damping: 0.004,
            sensors: vec![0.338, 0.2],
            noise: Noise::White,
            quiet: 60.0,
            law: None,
            hardest: 20.0,
            seed,
        }
    }

    /// The same with drawn damping, noise, interval and sensors.
    pub fn drawn(taps: usize, scatter: f64, seed: u64) -> Self {
        let mut trial = Self::by_hand(taps, scatter, seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
        let mut between =
            |low: f64, high: f64| low * (high / low).powf(random.random_range(0.0..1.0));
        trial.damping = between(0.001, 0.01);
        trial.quiet = between(30.0, 75.0);
        trial.interval = between(1.0, 3.0);
        let place = between(0.1, 0.42);
        trial
            .hits
            .iter_mut()
            .for_each(|hit| hit.place += place - PLACE);
        trial.sensors = vec![between(0.1, 0.42), between(0.1, 0.42)];
        trial.noise =
            [Noise::White, Noise::Red, Noise::HeavyTailed, Noise::Hum][(seed % 4) as usize];
        trial
    }

    /// Natural frequencies of the modes that move (Hz).
    pub fn frequencies(&self) -> Vec<f64> {
        let (structure, _) = self.structure();
        let modes = structure.reduced().modes.iter();
        modes.map(|mode| mode.frequency).collect()
    }

    /// The bar as the sensors see it, and the rotational stiffness of its joint (N m/rad).
    fn structure(&self) -> (ObservedStructure, f64) {
        let beam = Beam {
            length: LENGTH,
            width: 0.05,
            thickness: 0.005,
            modulus: 207e9,
            density: 7850.0,
            poisson: 0.3,
        };
        let units = StiffnessUnits::of(&beam);
        let joint = Joint {
            kt: 2000.0 * units.kt,
            kr: 5.0 * units.kr,
            coupling: 0.0,
        };
        let settings = SpecimenSettings {
            damping: Damping::Modal(vec![self.damping]),
            suspension: None,
        };
        let specimen = Specimen::new(Body::One(beam), Some(joint));
        let seen = ObservedStructure::new(&specimen, &settings, &self.sensors, 0.0, HIGHEST);
        (seen.expect("modes"), joint.kr)
    }

    /// Force and responses (N, m/s2) without noise.
    pub fn signals(&self) -> Vec<Vec<f64>> {
        let (structure, stiffness) = self.structure();
        let step = 1.0 / (RATE * STEPS as f64);
        let sensed = vec![Sensed::Acceleration; self.sensors.len()];
        let strike = |hit: &Hit, start: f64, peak: f64| Strike {
            pulse: Pulse {
                start,
                length: hit.length,
                peak,
                shape: PulseShape::SineSquared,
            },
            place: structure.struck(hit.place),
        };
        let joint = self.law.as_ref().map(|law| {
            let mut motion = Motion::new(structure.reduced().clone(), &sensed, 0.0, step, None);
            motion.strike(strike(&self.hits[0], 1.3e-4, self.hardest));
            let mut largest = 0.0_f64;
            for _ in 0..(0.3 / step) as usize {
                motion.advance();
                largest = largest.max(motion.joint_rotation().abs());
            }
            JointMoment::of_law(law, stiffness, largest)
        });
        let mut motion = Motion::new(structure.reduced().clone(), &sensed, 0.0, step, joint);
        for (number, hit) in self.hits.iter().enumerate() {
            let start = 0.5 + number as f64 * self.interval + 1.3e-5 * number as f64;
            motion.strike(strike(hit, start, hit.level));
        }
        let frames = ((0.5 + self.hits.len() as f64 * self.interval) * RATE) as usize;
        let mut channels = vec![Vec::with_capacity(frames); 1 + self.sensors.len()];
        let mut now = vec![0.0; self.sensors.len()];
        for _ in 0..frames {
            motion.responses(&mut now);
            let hit = (motion.time() - 0.5) / self.interval;
            let hit = (hit.max(0.0) as usize).min(self.hits.len() - 1);
            channels[0].push(motion.force());
            for (sensor, (channel, value)) in channels[1..].iter_mut().zip(&now).enumerate() {
                let factor = if sensor == 0 {
                    self.hits[hit].sensor
                } else {
                    1.0
                };
                channel.push(factor * value);
            }
            (0..STEPS).for_each(|_| motion.advance());
        }
        channels
    }

    fn noise(&self, count: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
        let tails = StudentT::new(3.0).expect("a positive number of degrees of freedom");
        let mut before = 0.0;
        let phase = random.random_range(0.0..TAU);
        let mut samples = Vec::with_capacity(count);
        for n in 0..count {
            let normal: f64 = match self.noise {
                Noise::HeavyTailed => tails.sample(random) / 3f64.sqrt(),
                _ => StandardNormal.sample(random),
            };
            before = 0.98 * before + 0.2 * normal;
            let angle = TAU * 50.0 * n as f64 / RATE + phase;
            samples.push(match self.noise {
                Noise::Red => before,
                Noise::Hum => 0.7 * normal + angle.sin() + 0.3 * (3.0 * angle).sin(),
                _ => normal,
            });
        }
        samples
    }

    pub fn recording(&self) -> Recording {
        let mut channels = self.signals();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0xabcd);
        let peak = |x: &[f64]| x.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let largest = channels[1..].iter().map(|x| peak(x)).fold(0.0, f64::max);
        for (number, channel) in channels.iter_mut().enumerate() {
            let scale = match number {
                0 => 1e-3 * peak(channel),
                _ => largest * 10f64.powf(-self.quiet / 20.0),
            };
            let noise = match number {
                0 => (0..channel.len())
                    .map(|_| StandardNormal.sample(&mut random))
                    .collect(),
                _ => self.noise(channel.len(), &mut random),
            };
            channel
                .iter_mut()
                .zip(noise)
                .for_each(|(x, noise): (_, f64)| *x += scale * noise);
        }
        let channels = channels.into_iter().map(|samples| Channel {
            samples,
            ..Channel::default()
        });
        Recording::from_samples("taps", RATE, channels.collect()).expect("finite samples")
    }

    /// Analyses the recording.
    pub fn analysis(&self, select: TapSelection) -> Analysis {
        let hammer = ChannelRef::Number(1);
        run_recording(self.recording(), Some(&hammer), |settings| {
            settings.select = select;
        })
        .expect("a recording that can be analysed")
    }
}

/// For each of these frequencies (Hz), true where the 95 % interval of the mode that was read there holds it; modes that
/// were not read are left out.
pub fn held(analysis: &Analysis, truths: &[f64]) -> Vec<bool> {
    let mut held = Vec::new();
    for truth in truths {
        let readings = analysis
            .modes
            .iter()
            .filter_map(|mode| mode.reading.as_ref());
        let near = readings.filter(|reading| (reading.frequency / truth - 1.0).abs() < 0.02);
        let nearest = near.min_by(|a, b| {
            (a.frequency - truth)
                .abs()
                .total_cmp(&(b.frequency - truth).abs())
        });
        held.extend(nearest.map(|reading| {
            let (low, high) = reading.interval;
            (low..=high).contains(truth)
        }));
    }
    held
}

/// The taps of an analysis.
pub fn taps(analysis: &Analysis) -> &[Tap] {
    &analysis.recordings[0].measurement.taps.taps
}

/// Places of the taps that are inconsistent.
pub fn inconsistent(analysis: &Analysis) -> Vec<usize> {
    let taps = taps(analysis).iter().enumerate();
    let departing =
        taps.filter(|(_, tap)| matches!(tap.rejection, Some(Rejection::Inconsistent { .. })));
    departing.map(|(place, _)| place).collect()
}

/// The warning of this code in words; empty without one.
pub fn words(analysis: &Analysis, code: &str) -> String {
    let mut warnings = analysis.warnings.iter();
    let found = warnings.find(|warning| warning.code == code);
    found.map(ToString::to_string).unwrap_or_default()
}

/// Returns true where the analysis has a warning of this code.
pub fn warns(analysis: &Analysis, code: &str) -> bool {
    !words(analysis, code).is_empty()
}
