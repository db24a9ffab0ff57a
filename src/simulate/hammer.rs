//! The hand that swings the hammer: when, where and how hard it strikes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use super::laboratory::HammerSettings;
use super::pulse::{Pulse, PulseShape};

/// A weak hit's share of a proper one.
const WEAK: f64 = 0.03;
/// Taps are never quite in rhythm: late by up to this (s), or a twentieth of their interval.
const LATE: f64 = 0.05;

/// One tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tap {
    /// When its pulse begins (s).
    pub time: f64,
    /// Where it strikes (m).
    pub position: f64,
    /// Peak force (N).
    pub peak_force: f64,
    /// Length of the pulse (s).
    pub length: f64,
    /// Whether it strikes properly.
    pub kind: TapKind,
}

/// Whether a tap strikes properly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TapKind {
    /// Once.
    Clean,
    /// Far too weakly.
    Weak,
    /// A second time.
    Double {
        /// After so long (s).
        delay: f64,
        /// With this share of the first peak (1).
        ratio: f64,
    },
}

/// What all taps of a recording have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct TapPlan {
    /// How many taps.
    pub taps: usize,
    /// Time from tap to tap (s).
    pub interval: f64,
    /// Marked place (m) and length of the beam (m).
    pub place: (f64, f64),
    /// Mean peak force (N).
    pub peak_force: f64,
    /// Mean length (s) and shape of the pulse.
    pub pulse: (f64, PulseShape),
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
        let (place, length) = self.plan.place;
        let position = place + self.settings.place_scatter * self.deviation();
        let peak = self.plan.peak_force * self.scattered(self.settings.level_scatter).max(0.05);
        let pulse = self.plan.pulse.0 * self.scattered(self.settings.length_scatter).max(0.05);
        let kind = self.kind();
        self.index += 1;
        Some(Tap {
            time,
            position: position.clamp(0.0, length),
            peak_force: if kind == TapKind::Weak {
                WEAK * peak
            } else {
                peak
            },
            length: pulse,
            kind,
        })
    }
}

impl Tap {
    /// The tap's pulses, one or two.
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
