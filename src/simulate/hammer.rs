//! The hand that swings the hammer, with the times, places and forces of its taps, and the pulses of the taps in
//! closed form, so that the motion they cause can be integrated exactly.

use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use std::f64::consts::PI;

/// A weak hit's share of a proper one.
const WEAK: f64 = 0.03;
/// Taps are never quite in rhythm: late by up to this (s), or a twentieth of their interval.
const LATE: f64 = 0.05;

/// One tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tap {
    /// Beginning of its pulse (s).
    pub time: f64,
    /// Place of the strike (m).
    pub position: f64,
    /// Peak force (N).
    pub peak_force: f64,
    /// Length of the pulse (s).
    pub length: f64,
    /// Clean, weak or double.
    pub kind: TapKind,
}

/// Quality of a tap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TapKind {
    /// One hit at full strength.
    Clean,
    /// A hit that is far too weak.
    Weak,
    /// Two hits.
    Double {
        /// Time from the first hit to the second (s).
        delay: f64,
        /// Peak of the second hit over that of the first (1).
        ratio: f64,
    },
}

/// Properties that all taps of a recording share.
#[derive(Debug, Clone, PartialEq)]
pub struct TapPlan {
    /// Number of taps.
    pub taps: usize,
    /// Time from tap to tap (s).
    pub interval: f64,
    /// Marked place (m).
    pub position: f64,
    /// Length of the beam (m).
    pub beam_length: f64,
    /// Mean peak force (N).
    pub peak_force: f64,
    /// Mean length of the pulse (s).
    pub pulse_length: f64,
    /// Shape of the pulse.
    pub pulse_shape: PulseShape,
}

/// Taps of a recording, one after the other.
#[derive(Debug, Clone)]
pub(super) struct Hammer {
    settings: HammerSettings,
    plan: TapPlan,
    random: ChaCha8Rng,
    index: usize,
}

impl Hammer {
    pub(super) fn new(settings: &HammerSettings, plan: &TapPlan, random: ChaCha8Rng) -> Self {
        Self {
            settings: settings.clone(),
            plan: plan.clone(),
            random,
            index: 0,
        }
    }

    /// One plus a deviation of at most three standard deviations, which keeps it positive.
    fn scattered(&mut self, std: f64) -> f64 {
        1.0 + std * self.deviation()
    }

    fn deviation(&mut self) -> f64 {
        let deviation: f64 = StandardNormal.sample(&mut self.random);
        deviation.clamp(-3.0, 3.0)
    }

    fn kind(&mut self) -> TapKind {
        // All are drawn for every tap, so that one tap's kind does not change the next one.
        let [double, weak, late, strength]: [f64; 4] =
            std::array::from_fn(|_| self.random.random_range(0.0..1.0));
        if double < self.settings.double_hits {
            TapKind::Double {
                delay: 0.005 + 0.02 * late,
                ratio: 0.15 + 0.4 * strength,
            }
        } else if weak < self.settings.weak_hits {
            TapKind::Weak
        } else {
            TapKind::Clean
        }
    }
}

impl Iterator for Hammer {
    type Item = Tap;

    fn next(&mut self) -> Option<Tap> {
        if self.index >= self.plan.taps {
            return None;
        }
        let late = LATE.min(0.05 * self.plan.interval);
        let time = self.settings.lead
            + self.index as f64 * self.plan.interval
            + self.random.random_range(0.0..1.0) * late;
        let position = self.plan.position + self.settings.place_scatter * self.deviation();
        let peak = self.plan.peak_force * self.scattered(self.settings.level_scatter).max(0.05);
        let length_factor = self.scattered(self.settings.length_scatter).max(0.05);
        let length = self.plan.pulse_length * length_factor;
        let kind = self.kind();
        self.index += 1;
        let share = if kind == TapKind::Weak { WEAK } else { 1.0 };
        Some(Tap {
            time,
            position: position.clamp(0.0, self.plan.beam_length),
            peak_force: share * peak,
            length,
            kind,
        })
    }
}

impl Tap {
    /// Returns the tap's one or two pulses.
    pub fn pulses(&self, shape: PulseShape) -> Vec<Pulse> {
        let first = Pulse {
            start: self.time,
            length: self.length,
            peak: self.peak_force,
            shape,
        };
        let TapKind::Double { delay, ratio } = self.kind else {
            return vec![first];
        };
        let second = Pulse {
            start: self.time + delay,
            peak: ratio * self.peak_force,
            ..first
        };
        vec![first, second]
    }
}

/// Form of a pulse of length w that begins at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PulseShape {
    /// peak sin^2(pi t/w): between a half sine and what a force sensor shows of a hard tip. Its spectrum
    /// has fallen by 6 dB at 1/w and vanishes first at 2/w.
    SineSquared,
    /// peak sin^4(pi t/w): the bell of a soft tip. Its spectrum has fallen by 6 dB at 1.44/w and
    /// vanishes first at 3/w.
    SineFourth,
}

impl PulseShape {
    /// The shape as a sum of a cos(2 pi n t/w): the factors a for n = 0, 1, 2.
    /// sin^2 x = 1/2 - cos(2x)/2, sin^4 x = 3/8 - cos(2x)/2 + cos(4x)/8.
    fn cosines(self) -> [f64; 3] {
        match self {
            Self::SineSquared => [0.5, -0.5, 0.0],
            Self::SineFourth => [0.375, -0.5, 0.125],
        }
    }

    /// Frequency (Hz) up to which a pulse of this `length` (s) excites, where its spectrum has fallen
    /// by 6 dB.
    pub fn half_amplitude_frequency(self, length: f64) -> f64 {
        match self {
            Self::SineSquared => 1.0 / length,
            Self::SineFourth => 1.44 / length,
        }
    }
}

/// One pulse of force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Beginning (s).
    pub start: f64,
    /// Duration (s).
    pub length: f64,
    /// Its peak (N).
    pub peak: f64,
    /// Its form.
    pub shape: PulseShape,
}

impl Pulse {
    /// End (s).
    pub fn end(&self) -> f64 {
        self.start + self.length
    }

    /// Force (N) and its first and second derivative (N/s, N/s2) at a time (s).
    pub fn force(&self, time: f64) -> [f64; 3] {
        if time <= self.start || time >= self.end() {
            return [0.0; 3];
        }
        let mut sum = [0.0; 3];
        for (n, factor) in self.shape.cosines().into_iter().enumerate() {
            let omega = self.omega(n);
            let (sine, cosine) = (omega * (time - self.start)).sin_cos();
            let amplitude = self.peak * factor;
            sum[0] += amplitude * cosine;
            sum[1] -= amplitude * omega * sine;
            sum[2] -= amplitude * omega * omega * cosine;
        }
        sum
    }

    /// Angular frequency (rad/s) of the n-th cosine.
    fn omega(&self, n: usize) -> f64 {
        2.0 * PI * n as f64 / self.length
    }

    /// Returns what the pulse adds to the state of z' = pole z + F by the end of a step: the integral
    /// of e^{pole (to - s)} F(s) ds over `from`..`to` (s).
    pub(super) fn drive(&self, pole: Complex64, from: f64, to: f64) -> Complex64 {
        let (begin, end) = (from.max(self.start), to.min(self.end()));
        if begin >= end {
            return Complex64::ZERO;
        }
        let (phase, span) = (begin - self.start, end - begin);
        let mut sum = Complex64::ZERO;
        for (n, factor) in self.shape.cosines().into_iter().enumerate() {
            let omega = self.omega(n);
            for exponent in [Complex64::I * omega, -Complex64::I * omega] {
                // cos = (e^{j omega t} + e^{-j omega t})/2; over the span the integral of
                // e^{pole (span - s)} e^{exponent s} ds = e^{pole span} span (e^x - 1)/x,
                // x = (exponent - pole) span.
                let x = (exponent - pole) * span;
                sum += 0.5 * factor * (exponent * phase).exp() * growth(x);
            }
        }
        // After the pulse's end the state moves on freely.
        self.peak * span * (pole * (to - end + span)).exp() * sum
    }
}

/// (e^x - 1)/x, also where x is small.
fn growth(x: Complex64) -> Complex64 {
    if x.norm_sqr() > 0.01 {
        return (x.exp() - 1.0) / x;
    }
    // The series' ninth term is below 1e-15 at |x| = 0.1.
    let mut term = Complex64::ONE;
    let mut sum = term;
    for n in 2..10 {
        term *= x / f64::from(n);
        sum += term;
    }
    sum
}

/// Tip of the hammer, which makes the pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tip {
    /// 0.3 ms, excites to 3.3 kHz.
    Steel,
    /// 1.4 ms, excites to 1 kHz.
    Nylon,
    /// 5 ms, excites to 290 Hz.
    Rubber,
}

impl Tip {
    /// From the softest to the hardest.
    pub const ALL: [Self; 3] = [Self::Rubber, Self::Nylon, Self::Steel];

    /// Length (s) and shape of its pulse on a beam of some hundred grams.
    pub fn pulse(self) -> (f64, PulseShape) {
        match self {
            Self::Steel => (0.3e-3, PulseShape::SineSquared),
            Self::Nylon => (1.4e-3, PulseShape::SineFourth),
            Self::Rubber => (5e-3, PulseShape::SineFourth),
        }
    }

    /// Returns the softest tip that excites up to this frequency (Hz), as good practice recommends.
    pub fn softest_for(frequency: f64) -> Self {
        let mut tips = Self::ALL.into_iter();
        let softest = tips.find(|tip| {
            let (length, shape) = tip.pulse();
            shape.half_amplitude_frequency(length) >= frequency
        });
        softest.unwrap_or(Self::Steel)
    }
}

/// The hammer and the hand that swings it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HammerSettings {
    /// Tip; `None` = the softest that excites the whole band.
    pub tip: Option<Tip>,
    /// Peak force at level 1 (N). 20: a light tap, so that recorders do not clip.
    pub peak_force: f64,
    /// Number of taps in each recording. 5, what good practice asks for.
    pub taps: usize,
    /// Time from tap to tap (s); `None` = until the slowest mode has rung down to 0.1 % and a described
    /// block fits, at least 1 s and at most 10 s.
    pub interval: Option<f64>,
    /// Quiet time before the first tap (s). 0.5: room for the pre-trigger.
    pub lead: f64,
    /// Scatter of the taps' peaks (1, standard deviation). 0.1: a practised hand.
    pub level_scatter: f64,
    /// Scatter of the pulses' lengths (1, standard deviation). 0.03.
    pub length_scatter: f64,
    /// Distance of the taps from the marked place (m, standard deviation). 0.5 mm: a marked place.
    pub place_scatter: f64,
    /// Part of the taps that strike twice (1). 0.
    pub double_hits: f64,
    /// Part of the taps that are far too weak (1). 0.
    pub weak_hits: f64,
}

impl Default for HammerSettings {
    fn default() -> Self {
        Self {
            tip: None,
            peak_force: 20.0,
            taps: 5,
            interval: None,
            lead: 0.5,
            level_scatter: 0.1,
            length_scatter: 0.03,
            place_scatter: 0.5e-3,
            double_hits: 0.0,
            weak_hits: 0.0,
        }
    }
}
