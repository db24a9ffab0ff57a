//! Averages over the taps of one recording: spectra with and without the force window, and the decays for the fits.

use super::decays::{MOST_KEPT, MOST_SINGLE};
use super::pulse_window::{PulseWindow, remove_offset};
use num_complex::Complex64;
use std::f64::consts::TAU;
use tapjoint_signal::spectral::{AveragedSpectra, Lines, SpectralAverager, Transformer, Window};
use tapjoint_signal::taps::Tap;

/// Longer records are transformed on several cores (samples).
const LONG: u64 = 1 << 15;
/// Most values kept of the transforms of many taps without a hammer.
const MOST_OF_MANY: usize = 1 << 20;
/// Most taps from which the change by the force window is taken, the first ones.
const MOST_UNGATED: usize = 32;

/// Averages over the accepted taps, and what is read from the transforms besides.
pub(super) struct Averages {
    pub averages: AveragedSpectra,
    /// Every tap's own transforms without a hammer, up to a bound on memory: their phases differ, so that they cannot be
    /// averaged.
    pub transforms: Vec<Vec<Complex64>>,
    /// Change by the force window; `None` without a hammer.
    pub window_change: Option<WindowChange>,
}

/// What the force window changes in H1, summed over the responses, line by line.
pub(super) struct WindowChange {
    /// Sum of |H1w - H1|^2, H1w with the window.
    pub changed: Vec<f64>,
    /// Sum of |H1|^2, H1 without it.
    pub whole: Vec<f64>,
}

/// Sums over the taps of one recording.
pub(super) struct TapSums {
    lines: Lines,
    sample_rate: f64,
    window: Window,
    has_force: bool,
    transformer: Transformer,
    averager: SpectralAverager,
    /// By the force without its window; taken out once there are enough taps.
    ungated: Option<SpectralAverager>,
    window_change: Option<WindowChange>,
    kept: Vec<Vec<Complex64>>,
    most_kept: usize,
    /// Transforms of the channels.
    values: Vec<Vec<Complex64>>,
    /// Room for two transforms at a time.
    scratch: [Vec<Complex64>; 2],
}

impl TapSums {
    /// Begins with `taps` taps of `gate` frames.
    pub fn new(
        lines: Lines,
        sample_rate: f64,
        gate: u64,
        window: Window,
        has_force: bool,
        responses: usize,
        taps: usize,
    ) -> Self {
        let averager = SpectralAverager::new(lines, responses);
        TapSums {
            lines,
            sample_rate,
            window,
            has_force,
            transformer: Transformer::new(sample_rate, lines, gate as usize),
            ungated: has_force.then(|| averager.clone()),
            averager,
            window_change: None,
            kept: Vec::new(),
            most_kept: if taps > MOST_SINGLE {
                MOST_OF_MANY
            } else {
                MOST_KEPT
            },
            values: Vec::new(),
            scratch: Default::default(),
        }
    }

    /// Adds a tap. `record` has the usable samples of the force, where there is one, and of the responses; they are
    /// windowed in place.
    pub fn add(&mut self, tap: &Tap, record: &mut Vec<Vec<f64>>) {
        let gate = PulseWindow::of(tap, self.sample_rate).filter(|_| self.has_force);
        let responses = record.len() - usize::from(self.has_force);
        if let (Some(gate), Some(force)) = (gate, record.first_mut()) {
            remove_offset(force, self.sample_rate);
            let copy = self.ungated.is_some().then(|| force.clone());
            gate.apply(force);
            // The force without its window comes last.
            record.extend(copy);
        }
        let count = record.len();
        self.values
            .resize_with(count.max(self.values.len()), Vec::new);
        let (transformer, window, rate) = (&self.transformer, self.window, self.sample_rate);
        let transform =
            |samples: &mut [Vec<f64>], values: &mut [Vec<Complex64>], scratch: &mut _| {
                for (samples, values) in samples.iter_mut().zip(values) {
                    window.apply(samples, rate);
                    transformer.transform_in_place(samples, scratch, values);
                }
            };
        // Of long records one half of the channels each.
        let half = match record
            .first()
            .is_some_and(|samples| samples.len() as u64 > LONG)
        {
            true => count.div_ceil(2),
            false => count,
        };
        let (left, right) = record.split_at_mut(half);
        let (left_values, right_values) = self.values[..count].split_at_mut(half);
        let [one, two] = &mut self.scratch;
        match right.is_empty() {
            true => transform(left, left_values, one),
            false => {
                rayon::join(
                    || transform(left, left_values, one),
                    || transform(right, right_values, two),
                );
            }
        }
        let first = usize::from(self.has_force);
        let of_responses = &self.values[first..first + responses];
        let force = self.has_force.then(|| self.values[0].as_slice());
        self.averager.add(force, of_responses);
        if let Some(whole) = &mut self.ungated
            && record.len() > first + responses
        {
            whole.add(Some(&self.values[first + responses]), of_responses);
            record.truncate(first + responses);
            if self.averager.taps() == MOST_UNGATED {
                self.compare_with_ungated();
            }
        }
        if !self.has_force && self.kept.len() * self.lines.points() < self.most_kept {
            self.keep(tap);
        }
    }

    /// Keeps the transforms of a tap, time zero at its trigger. The quiet stretch before it tilts the phase, and a fit of
    /// few lines could not follow that tilt as a background.
    fn keep(&mut self, tap: &Tap) {
        let delay = tap.time - tap.usable_from() as f64 / self.sample_rate;
        for values in &self.values {
            let mut transform = values.clone();
            for (line, value) in transform.iter_mut().enumerate() {
                let turn = TAU * self.lines.frequency(line) * delay;
                *value *= Complex64::from_polar(1.0, turn);
            }
            self.kept.push(transform);
        }
    }

    /// Takes the change by the force window from the taps so far.
    fn compare_with_ungated(&mut self) {
        let Some(ungated) = self.ungated.take() else {
            return;
        };
        let points = self.lines.points();
        let mut change = WindowChange {
            changed: vec![0.0; points],
            whole: vec![0.0; points],
        };
        for response in 0..self.averager.responses() {
            for line in 0..points {
                let without = ungated.h1(response, line);
                let with = self.averager.h1(response, line);
                change.changed[line] += (with - without).norm_sqr();
                change.whole[line] += without.norm_sqr();
            }
        }
        self.window_change = Some(change);
    }

    /// The averages of the responses over the taps so far.
    pub fn responses_so_far(&self) -> AveragedSpectra {
        self.averager.responses_so_far()
    }

    /// The averages over all taps.
    pub fn finish(mut self) -> Averages {
        self.compare_with_ungated();
        // At least one tap was accepted, or there would be no axis.
        let averages = self.averager.finish();
        Averages {
            averages: averages.unwrap_or_else(|| AveragedSpectra::empty(self.lines)),
            transforms: self.kept,
            window_change: self.window_change,
        }
    }
}
