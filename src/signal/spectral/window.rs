//! Windows over a tap record.

use std::f64::consts::TAU;

/// A window as applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// None: right for a record that rings down by itself.
    Rectangular,
    /// Hann, 1 - cos; for steady signals.
    Hann,
    /// e^{-decay t} from the start of the record, on force and response alike. It moves every pole
    /// by exactly `decay` to the left, which the reading of a damping must take back.
    Exponential {
        /// Decay a (1/s).
        decay: f64,
    },
}

impl Window {
    /// Decay the window adds to every pole (1/s); 0 for windows that add none.
    pub fn added_decay(self) -> f64 {
        match self {
            Window::Exponential { decay } => decay,
            Window::Rectangular | Window::Hann => 0.0,
        }
    }

    /// Applies the window in place. The Hann window is scaled to mean 1, so that the amplitude of a
    /// steady line stays what it is.
    pub fn apply(self, samples: &mut [f64], sample_rate: f64) {
        match self {
            Window::Rectangular => {}
            Window::Hann => {
                let step = TAU / samples.len().max(1) as f64;
                for (n, x) in samples.iter_mut().enumerate() {
                    *x *= 1.0 - (step * n as f64).cos();
                }
            }
            Window::Exponential { decay } => {
                let step = -decay / sample_rate;
                for (n, x) in samples.iter_mut().enumerate() {
                    *x *= (step * n as f64).exp();
                }
            }
        }
    }

    /// The window's name as written in a description and a report.
    pub fn name(self) -> &'static str {
        match self {
            Window::Rectangular => "rectangular",
            Window::Hann => "hann",
            Window::Exponential { .. } => "exponential",
        }
    }
}

/// The force window: unity over the first `unity` samples (pre-trigger, pulse and the filter's
/// ringing), a half-cosine taper over `taper` samples, exact zero after. It takes the noise of a
/// whole record out of a force that lasts a millisecond; a second hit must have been looked for
/// before.
pub fn apply_force_window(samples: &mut [f64], unity: usize, taper: usize) {
    for (n, x) in samples.iter_mut().enumerate().skip(unity) {
        let share = (n - unity + 1) as f64 / (taper + 1) as f64;
        *x *= if share < 1.0 {
            0.5 * (1.0 + (std::f64::consts::PI * share).cos())
        } else {
            0.0
        };
    }
}
