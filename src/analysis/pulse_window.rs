//! The window about the force pulse of a tap, and the level at which the force rests.

use tapjoint_numerics::stats::median;
use tapjoint_signal::spectral::apply_force_window;
use tapjoint_signal::taps::Tap;

/// Window about the pulse of a tap in its record (samples): zero before `start`, unity for `length`
/// from there, a taper of the pulse's own length after it.
#[derive(Clone, Copy)]
pub(super) struct PulseWindow {
    start: usize,
    length: usize,
    taper: usize,
}

/// The ringing of a filter ahead of a pulse lasts no longer than this (s), or eight samples.
const AHEAD_OF_PULSE: f64 = 2e-3;

impl PulseWindow {
    /// The force window of a tap, from just before the trigger to the end of the pulse. It goes on for as long again,
    /// since the search for that end may stop early. Noise and offset of the hammer before and after would ripple through
    /// every quotient. `None` without a hammer.
    pub fn of(tap: &Tap, sample_rate: f64) -> Option<Self> {
        let trigger = (tap.time * sample_rate).round() as u64;
        let pulse = tap.pulse_end?.saturating_sub(trigger).max(1) as usize;
        let into = trigger.saturating_sub(tap.record.start) as usize;
        let ahead = ((AHEAD_OF_PULSE * sample_rate) as usize).max(8).min(into);
        Some(PulseWindow {
            start: into - ahead,
            length: ahead + 2 * pulse,
            taper: pulse,
        })
    }

    /// Applies the window to a force that begins with the tap's record.
    pub fn apply(self, force: &mut [f64]) {
        let start = self.start.min(force.len());
        force[..start].fill(0.0);
        apply_force_window(&mut force[start..], self.length, self.taper);
    }

    /// First sample of the record that the window keeps.
    pub fn start(self) -> usize {
        self.start
    }

    /// Length of the window (samples), half of its taper included.
    pub fn length(self) -> f64 {
        self.length as f64 + 0.5 * self.taper as f64
    }

    /// Energy of the window (samples): a half-cosine taper has 3/8 of its length.
    pub fn energy(self) -> f64 {
        self.length as f64 + 0.375 * self.taper as f64
    }
}

/// Stretch of the force in which its offset is looked for (s): long beside the pulse, so that the
/// median is the level at rest, and short beside the drift of its amplifier.
const OFFSET_STRETCH: f64 = 0.2;

/// Samples from the start of a record in which the offset is looked for.
pub(super) fn offset_stretch(sample_rate: f64) -> usize {
    ((OFFSET_STRETCH * sample_rate) as usize).max(1)
}

/// Takes out the level at which the force rests about its pulse. The mean of the recording is not
/// that level: the pulses are in it, and over the force window the difference amounts to a percent
/// of a pulse's momentum.
pub(super) fn remove_offset(force: &mut [f64], sample_rate: f64) {
    let about = force.iter().copied().take(offset_stretch(sample_rate));
    let rest = median(&mut about.collect::<Vec<f64>>());
    force.iter_mut().for_each(|x| *x -= rest);
}
