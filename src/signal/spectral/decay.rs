//! How far a tap record rings down, and the window that follows from it.

use super::Window;

/// Level at a record's end that counts as rung down: 1 % (field practice after ISO 7626-5).
pub const RUNG_DOWN: f64 = 0.01;

/// The end of a record judged against its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayCheck {
    /// rms over the last twentieth of the record over the largest rms of any twentieth, the
    /// noise power taken out of both.
    pub remaining: f64,
    /// The noise alone, on the same scale: below it nothing can be said.
    pub noise: f64,
}

impl DecayCheck {
    /// Of a record that never rises above its noise.
    pub const NOTHING: Self = Self {
        remaining: 0.0,
        noise: 1.0,
    };
}

/// Measures how far `samples` (a tap record without window, its mean taken out) rings down.
///
/// `noise_rms` is the rms of the noise before the taps (same unit as the samples).
pub fn measure_decay(samples: &[f64], noise_rms: f64) -> DecayCheck {
    let piece = (samples.len() / 20).max(1);
    let powers: Vec<f64> = samples
        .chunks_exact(piece)
        .map(|chunk| chunk.iter().map(|x| x * x).sum::<f64>() / piece as f64)
        .collect();
    let noise_power = noise_rms * noise_rms;
    let largest = powers.iter().copied().fold(0.0, f64::max) - noise_power;
    if largest <= 0.0 {
        return DecayCheck::NOTHING;
    }
    let last = (powers.last().copied().unwrap_or(0.0) - noise_power).max(0.0);
    DecayCheck {
        remaining: (last / largest).sqrt(),
        noise: noise_rms / largest.sqrt(),
    }
}

/// Rectangular where the slowest response rings down to 1 % in the record (or into its noise), else
/// the exponential window that takes it there: e^{-aT} = 1 %/remaining.
///
/// `duration` is the record's length T (s).
pub fn choose_window(checks: &[DecayCheck], duration: f64) -> Window {
    let remaining = checks
        .iter()
        .filter(|check| check.remaining > check.noise)
        .map(|check| check.remaining)
        .fold(0.0, f64::max);
    if remaining <= RUNG_DOWN {
        Window::Rectangular
    } else {
        Window::Exponential {
            decay: (remaining / RUNG_DOWN).ln() / duration,
        }
    }
}

/// End of an exponential window on a record that has rung down already: 10 %, so that what was asked for
/// is there, and the decay it adds stays below that of the record.
const GENTLE: f64 = 0.1;

/// The exponential window for one who asks for it: it brings a response that keeps `remaining` of its
/// level down to 1 %, and falls to 10 % at least.
pub fn exponential_to(remaining: f64, duration: f64) -> Window {
    let fall = (RUNG_DOWN / remaining.max(f64::MIN_POSITIVE)).clamp(RUNG_DOWN, GENTLE);
    Window::Exponential {
        decay: -fall.ln() / duration,
    }
}
