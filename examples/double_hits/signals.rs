//! Force records of one tap, and what disturbs them.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint::recording::{Channel, Recording};
use tapjoint::taps::{Rejection, SecondHit, TapSettings, TapSource, find_taps};

/// Form of a hammer pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Half a sine: begins and ends with a corner.
    HalfSine,
    /// sin^2: without corners.
    SineSquared,
    /// A steep rise and a slow fall: sin^2 of a warped time, the crest at 0.35 of the width.
    Skewed,
}

/// All forms.
pub const SHAPES: [Shape; 3] = [Shape::HalfSine, Shape::SineSquared, Shape::Skewed];

impl Shape {
    /// Height at a share of the width.
    pub fn at(self, share: f64) -> f64 {
        if !(0.0..=1.0).contains(&share) {
            return 0.0;
        }
        match self {
            Shape::HalfSine => (PI * share).sin(),
            Shape::SineSquared => (PI * share).sin().powi(2),
            Shape::Skewed => (PI * share.powf(0.66)).sin().powi(2),
        }
    }
    /// Where the crest is, as a share of the width.
    pub fn crest(self) -> f64 {
        match self {
            Shape::Skewed => 0.5f64.powf(1.0 / 0.66),
            _ => 0.5,
        }
    }
}

/// What only looks like a second hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// Short pulses through a linear-phase anti-alias filter.
    Filter,
    /// A decaying oscillation after the pulse: a filter of minimum phase, the hammer's own resonance.
    Ringing,
    /// A baseline that swings by up to 10 % of the peak, and steps back after the pulse.
    Drift,
    /// Hum of up to 5 % of the peak, with its third and fifth harmonic.
    Hum,
    /// The hammer in the hand: bumps of 10 to 80 ms of both signs, up to 8 % of the peak.
    Handling,
}

/// All of them.
pub const DISTURBANCES: [Disturbance; 5] = [
    Disturbance::Filter,
    Disturbance::Ringing,
    Disturbance::Drift,
    Disturbance::Hum,
    Disturbance::Handling,
];

/// A force record of one tap, its peak 1.
#[derive(Debug, Clone)]
pub struct Record {
    /// Sample rate (Hz).
    pub rate: f64,
    /// The force.
    pub samples: Vec<f64>,
    /// Form of the pulse.
    pub shape: Shape,
    /// Begin of the pulse (s).
    pub begin: f64,
    /// Length of the pulse (s).
    pub width: f64,
}

impl Record {
    /// A record with its pulse and noise (dB of the peak); the pulse has at least `least` samples.
    pub fn draw(random: &mut ChaCha8Rng, shape: Shape, noise: f64, least: f64) -> Record {
        let rate: f64 =
            [10_000.0, 12_800.0, 20_480.0, 25_600.0, 44_100.0, 51_200.0][random.random_range(0..6)];
        // Evenly over the logarithm, so that short pulses and records are as frequent as long ones.
        let width = 1e-3 * 10f64.powf(random.random_range(0.2f64.log10()..4f64.log10()));
        let width = width.max(least / rate);
        let count = 2f64.powf(random.random_range(11.0..=16.0)) as usize;
        let begin = random.random_range(0.05..0.15) * count as f64 / rate;
        let mut record = Record {
            rate,
            samples: vec![0.0; count],
            shape,
            begin,
            width,
        };
        record.add_pulse(begin, width, 1.0);
        let deviation = 10f64.powf(noise / 20.0);
        for sample in &mut record.samples {
            let x: f64 = StandardNormal.sample(random);
            *sample += deviation * x;
        }
        record
    }

    fn add_pulse(&mut self, begin: f64, width: f64, peak: f64) {
        for (index, sample) in self.samples.iter_mut().enumerate() {
            *sample += peak * self.shape.at((index as f64 / self.rate - begin) / width);
        }
    }

    fn seconds(&self) -> f64 {
        self.samples.len() as f64 / self.rate
    }

    /// A second pulse after a delay drawn between these, in pulse widths, 0.7 to 1.3 times as wide;
    /// returns the time between the crests (s), or nothing where the record is too short for it.
    pub fn hit_again(
        &mut self,
        ratio: f64,
        delay: (f64, f64),
        random: &mut ChaCha8Rng,
    ) -> Option<f64> {
        let width = self.width * random.random_range(0.7..1.3);
        let delay = self.width * random.random_range(delay.0..delay.1);
        // 0.2 s is where the next tap may be.
        if delay > 0.19 || self.begin + delay + 2.0 * width > self.seconds() {
            return None;
        }
        self.add_pulse(self.begin + delay, width, ratio);
        Some(delay + self.shape.crest() * (width - self.width))
    }

    /// Adds a disturbance.
    pub fn disturb(&mut self, disturbance: Disturbance, random: &mut ChaCha8Rng) {
        match disturbance {
            Disturbance::Filter => self.filter(random),
            Disturbance::Ringing => self.ring(random),
            Disturbance::Drift => self.drift(random),
            Disturbance::Hum => self.hum(random),
            Disturbance::Handling => self.handle(random),
        }
    }

    /// The pulse through a windowed sinc with its edge at 0.39 to 0.49 of the sample rate, the pulse
    /// no longer than three samples.
    fn filter(&mut self, random: &mut ChaCha8Rng) {
        let cutoff = random.random_range(0.39..0.49);
        let width = random.random_range(0.3..3.0) / self.rate;
        // 64 zero crossings to either side, as converters have.
        let reach = 32.0 / cutoff;
        let steps = 40;
        for (index, sample) in self.samples.iter_mut().enumerate() {
            let time = index as f64 / self.rate;
            if (time - self.begin).abs() * self.rate > reach + 8.0 + self.width * self.rate {
                continue;
            }
            *sample -= self.shape.at((time - self.begin) / self.width);
            for step in 0..steps {
                let share = (f64::from(step) + 0.5) / f64::from(steps);
                let x = (time - self.begin - share * width) * self.rate;
                if x.abs() > reach {
                    continue;
                }
                let angle = TAU * cutoff * x;
                let sinc = if angle == 0.0 {
                    1.0
                } else {
                    angle.sin() / angle
                };
                let taper = 0.5 + 0.5 * (PI * x / reach).cos();
                let weight = width * self.rate / f64::from(steps);
                *sample += self.shape.at(share) * weight * 2.0 * cutoff * sinc * taper;
            }
        }
        self.width = width;
    }

    fn ring(&mut self, random: &mut ChaCha8Rng) {
        // From as slow as the pulse is wide to near half the sample rate.
        let highest = (0.45 * self.rate * self.width).max(0.6);
        let frequency =
            10f64.powf(random.random_range(0.3f64.log10()..highest.log10())) / self.width;
        let damping = random.random_range(0.02..0.3);
        let level = random.random_range(0.02..0.25);
        let begin = self.begin + self.shape.crest() * self.width;
        let omega = TAU * frequency;
        for (index, sample) in self.samples.iter_mut().enumerate() {
            let t = index as f64 / self.rate - begin;
            if t > 0.0 {
                *sample -= level * (-damping * omega * t).exp() * (omega * t).sin();
            }
        }
    }

    fn drift(&mut self, random: &mut ChaCha8Rng) {
        let swing = random.random_range(-0.1..0.1);
        let frequency = random.random_range(0.1..3.0);
        let phase = random.random_range(0.0..TAU);
        // The high-pass of a charge amplifier leaves an undershoot that creeps back.
        let step = random.random_range(0.0..0.05);
        let creep = random.random_range(0.02..1.0);
        for (index, sample) in self.samples.iter_mut().enumerate() {
            let time = index as f64 / self.rate;
            *sample += swing * (TAU * frequency * time + phase).sin();
            if time > self.begin + self.width {
                *sample -= step * (-(time - self.begin - self.width) / creep).exp();
            }
        }
    }

    fn hum(&mut self, random: &mut ChaCha8Rng) {
        let mains = [50.0, 60.0][random.random_range(0..2)];
        let level = random.random_range(0.0..0.05);
        let lines: Vec<(f64, f64, f64)> = [(1.0, 1.0), (3.0, 0.5), (5.0, 0.3)]
            .map(|(order, share)| (order * mains, share * level, random.random_range(0.0..TAU)))
            .to_vec();
        for (index, sample) in self.samples.iter_mut().enumerate() {
            let time = index as f64 / self.rate;
            for (frequency, level, phase) in &lines {
                *sample += level * (TAU * frequency * time + phase).sin();
            }
        }
    }

    fn handle(&mut self, random: &mut ChaCha8Rng) {
        for _ in 0..random.random_range(1..6) {
            let width = random.random_range(0.01..0.08_f64).max(3.0 * self.width);
            let begin = random.random_range(0.0..self.seconds());
            // Beside the pulse: what lies upon it is part of the tap.
            if begin < self.begin + 2.0 * self.width && begin + width > self.begin {
                continue;
            }
            let peak = random.random_range(-0.08..0.08);
            for (index, sample) in self.samples.iter_mut().enumerate() {
                let share = (index as f64 / self.rate - begin) / width;
                *sample += peak * Shape::SineSquared.at(share);
            }
        }
    }
}

/// What the search makes of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found {
    /// An accepted tap, and nothing beside it.
    Nothing,
    /// An accepted tap with a second hit.
    Warned(SecondHit),
    /// A rejected double hit.
    Rejected(SecondHit),
    /// No tap, or rejected for another reason.
    NoTap,
}

/// Searches a record that holds one tap.
pub fn found(record: &Record) -> Found {
    let channel = Channel {
        samples: record.samples.clone(),
        ..Channel::default()
    };
    let source = TapSource::Hammer {
        channel: 0,
        responses: Vec::new(),
    };
    let taps = Recording::from_samples("one tap", record.rate, vec![channel])
        .and_then(|recording| find_taps(&recording, &source, &TapSettings::default()));
    let Ok(taps) = taps else { return Found::NoTap };
    // Drift above the threshold lets a tap begin early: what counts is the tap that holds the pulse.
    let frame = ((record.begin + 0.5 * record.width) * record.rate) as u64;
    let mut taps = taps.taps.iter();
    let Some(tap) = taps.find(|tap| tap.record.contains(&frame)) else {
        return Found::NoTap;
    };
    match (&tap.rejection, tap.second_hit) {
        (Some(Rejection::DoubleHit { .. }), Some(hit)) => Found::Rejected(hit),
        (None, Some(hit)) => Found::Warned(hit),
        (None, None) => Found::Nothing,
        _ => Found::NoTap,
    }
}
