//! Force and responses of single taps by octaves, each under a window that decays within a few periods.
//!
//! What a hit excites shows at once. Small shifts of frequency show later, when phases have run apart. So the beginning of a
//! response tells where a tap hit, and hardly how strong it was.

use super::pulse_window::{PulseWindow, remove_offset};
use num_complex::Complex64;
use rayon::prelude::*;
use tapjoint_signal::spectral::{DISPLAY_RATIO, Lines, Transformer, Window};
use tapjoint_signal::taps::Tap;

/// Damping ratio that the window adds at the lower end of an octave. 3 %: ten times the damping of metal, so that
/// resonances become broad beside their shifts, and a tenth of the way to the next mode of a beam.
const ADDED_DAMPING: f64 = 0.03;
/// The window falls to this by its end (1), so that the cut there shows nowhere.
const WINDOW_END: f64 = 1e-3;
/// Shortest window (s), longer than a pulse.
const SHORTEST: f64 = 0.01;
/// Fewest periods in a window. 5: there the lines of the window are half an octave wide.
const LEAST_PERIODS: f64 = 5.0;
/// Most octaves: from 10 kHz down to 1 Hz, and some.
const MOST_OCTAVES: usize = 16;

/// Lines of one octave.
#[derive(Debug)]
pub(super) struct Octave {
    /// Lowest line (Hz).
    low: f64,
    /// Distance of the lines (Hz): half of the resolution, so that differences of neighbours show slopes.
    pub spacing: f64,
    /// Number of lines.
    pub points: usize,
    window: Window,
    /// Length of the window (samples).
    samples: usize,
    transformer: Transformer,
}

impl Octave {
    /// Octaves over a band (Hz), the highest first, for records of `frames` frames from their triggers. They end where a
    /// record has too few periods.
    pub fn all(band: (f64, f64), sample_rate: f64, frames: usize) -> Vec<Octave> {
        let seconds = frames as f64 / sample_rate;
        let lowest = band.0.max(LEAST_PERIODS / seconds);
        let mut octaves = Vec::new();
        let mut high = band.1;
        while high > lowest && octaves.len() < MOST_OCTAVES {
            // A rest below a third of an octave goes with the octave above.
            let low = if high / 2.0 < 1.26 * lowest {
                lowest
            } else {
                high / 2.0
            };
            octaves.extend(Self::between(low, high, sample_rate, frames));
            high = low;
        }
        octaves
    }

    fn between(low: f64, high: f64, sample_rate: f64, frames: usize) -> Option<Octave> {
        let decay = -WINDOW_END.ln();
        let seconds = decay / (std::f64::consts::TAU * ADDED_DAMPING * low);
        let samples = (seconds.max(SHORTEST) * sample_rate).ceil() as usize;
        let samples = samples.min(frames);
        // Zeros as long as the window halve the distance of the lines.
        let padded = (2 * samples).next_power_of_two();
        let spacing = sample_rate / padded as f64;
        let first = (low / spacing).ceil();
        let last = (high / spacing).ceil() - 1.0;
        if last < first {
            return None;
        }
        let points = (last - first) as usize + 1;
        let lines = Lines {
            low: first * spacing,
            high: last * spacing,
            spacing,
            block: ((points - 1) as f64 * DISPLAY_RATIO).ceil() as usize,
            duration: samples as f64 / sample_rate,
        };
        Some(Octave {
            low: lines.low,
            spacing,
            points: lines.points(),
            window: Window::Exponential {
                decay: decay * sample_rate / samples as f64,
            },
            samples,
            transformer: Transformer::new(sample_rate, lines, samples),
        })
    }

    /// Geometric mean of its ends (Hz).
    pub fn middle(&self) -> f64 {
        let high = self.low + (self.points - 1) as f64 * self.spacing;
        (self.low * high).sqrt()
    }

    fn transform(&self, samples: impl Iterator<Item = f64>, sample_rate: f64) -> Vec<Complex64> {
        let mut windowed: Vec<f64> = samples.take(self.samples).collect();
        self.window.apply(&mut windowed, sample_rate);
        self.transformer.transform(&windowed)
    }
}

/// Transforms of one tap, by octaves and lines.
pub(super) struct TapResponse {
    /// Of the force.
    pub force: Vec<Vec<Complex64>>,
    /// Of each response.
    pub responses: Vec<Vec<Vec<Complex64>>>,
    /// Power of what each response did before the tap, under the same window turned about: noise, hum, and the ringing of
    /// the tap before. By octaves, responses and lines.
    pub before: Vec<Vec<Vec<f64>>>,
}

/// Samples of one tap.
pub(super) struct TapSamples {
    /// The force from the start of the record.
    pub force: Vec<f64>,
    /// The responses from the start of the record.
    pub responses: Vec<Vec<f64>>,
    /// The responses before the record.
    pub before: Vec<Vec<f64>>,
}

impl TapResponse {
    /// Transforms a tap of this sample rate (Hz); `None` without its pulse.
    pub fn of(
        tap: &Tap,
        octaves: &[Octave],
        mut samples: TapSamples,
        sample_rate: f64,
    ) -> Option<Self> {
        let gate = PulseWindow::of(tap, sample_rate)?;
        remove_offset(&mut samples.force, sample_rate);
        gate.apply(&mut samples.force);
        let start = gate.start();
        let from_start = |samples: &[f64]| samples.get(start..).unwrap_or_default().to_vec();
        let force = from_start(&samples.force);
        let responses: Vec<Vec<f64>> = samples.responses.iter().map(|x| from_start(x)).collect();
        let transformed: Vec<_> = octaves
            .par_iter()
            .map(|octave| {
                let transform =
                    |samples: &Vec<f64>| octave.transform(samples.iter().copied(), sample_rate);
                let before = samples.before.iter().zip(&samples.responses);
                // Backwards from the pulse: the part of the record before it, then what came before the record.
                let before = before.map(|(before, record)| {
                    let head = &record[..start.min(record.len())];
                    let backwards = head.iter().rev().chain(before.iter().rev());
                    let values = octave.transform(backwards.copied(), sample_rate);
                    values.iter().map(Complex64::norm_sqr).collect()
                });
                (
                    transform(&force),
                    responses.iter().map(transform).collect::<Vec<_>>(),
                    before.collect::<Vec<Vec<f64>>>(),
                )
            })
            .collect();
        let mut found = TapResponse {
            force: Vec::new(),
            responses: vec![Vec::new(); responses.len()],
            before: Vec::new(),
        };
        for (force, responses, before) in transformed {
            found.force.push(force);
            for (all, one) in found.responses.iter_mut().zip(responses) {
                all.push(one);
            }
            found.before.push(before);
        }
        Some(found)
    }
}
