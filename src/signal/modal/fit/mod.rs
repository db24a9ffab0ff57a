//! Fit of poles to free decays or frequency response functions, all taps and sensors together.
//!
//! After the force pulse each response is a sum of decaying oscillations. Its transform over any number of
//! samples is exactly rational on its own lines, even of a truncated record. White noise is independent
//! between those lines. Poles common to all taps and sensors, with a free amplitude in each, are therefore
//! fitted by plain least squares, the maximum of the likelihood. Neither noise of the force nor the ringing
//! from the tap before can bias it.
//!
//! [`fit_modes`] fits mode by mode over a band about each (modes near each other jointly). The standard
//! deviation comes from the noise that remains, or from the scatter of the taps where that is larger. Columns
//! come from a [`FreeDecayCollector`], or are frequency response functions.

mod extra_mode;
mod group;
mod group_fit;
mod modal_constant;
mod mode_fit;
mod steady;
mod variable_projection;

pub use extra_mode::ExtraMode;
pub use group::Accepted;
pub use modal_constant::{ModalConstant, TapForce, modal_constants, modal_constants_of_frf};
pub(super) use mode_fit::SCATTERS;
pub use mode_fit::{
    ColumnAmplitude, FittedValue, ModeFit, TapFit, UncertaintySource, fit_modes,
    scatter_about_mean, weighted_mean,
};
pub use tapjoint_numerics::least_squares::StopReason;

use num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};
use std::f64::consts::PI;
use std::sync::Arc;
use variable_projection::STEADY;

/// Start of the search for a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleStart {
    /// Natural frequency (Hz), within a line or half a half-power width.
    pub frequency: f64,
    /// Damping ratio without a window's own decay; `None` where it is not known.
    pub damping_ratio: Option<f64>,
}

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitSettings {
    /// Decay that an exponential window added to what is fitted (1/s). 0: free decays are fitted
    /// without a window.
    pub added_decay: f64,
    /// Steady lines, mains hum, to be fitted as such. None.
    pub steady_lines: Vec<SteadyLine>,
}

/// A line that does not decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyLine {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Largest error of the frequency (Hz).
    pub bound: f64,
}

/// Distance of the two poles that stand for a steady line from its frequency (lines). 0.02: between them lies what is left
/// of the frequency's error once it was read from the data. An error of 0.08 lines leaves 1 % of the line.
const OFF: f64 = 0.02;

impl SteadyLine {
    /// Returns its poles (lines) with lines `spacing` (Hz) apart. Two beside each other span the line and its change by an
    /// error of the frequency, to first order.
    fn poles(&self, spacing: f64) -> [Complex64; 2] {
        [-OFF, OFF].map(|off| Complex64::new(-STEADY, self.frequency / spacing + off))
    }
}

/// Reason why data cannot be fitted at all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Nothing to fit.
    #[error(
        "a fit needs one column and two lines at least; there are {columns} columns of {lines} lines: add taps, or widen the band"
    )]
    Empty {
        /// Columns.
        columns: usize,
        /// Lines.
        lines: usize,
    },
    /// A column does not fit the axis.
    #[error("column {column} has {values} values for {lines} lines: give one value for each line")]
    Length {
        /// Number of the column, from 0.
        column: usize,
        /// Its values.
        values: usize,
        /// Lines of the axis.
        lines: usize,
    },
    /// A value is no number.
    #[error("column {column} has no finite value on line {line}: leave the tap or the line out")]
    NotFinite {
        /// Number of the column, from 0.
        column: usize,
        /// Index of the line, from 0.
        line: usize,
    },
    /// The axis has frequencies that do not ascend, or no positive resolution.
    #[error(
        "the lines of a fit must have positive, ascending frequencies and a positive resolution"
    )]
    Axis,
    /// A line of a decay is no multiple of the line spacing.
    #[error(
        "{frequency} Hz is no line of the decays: give multiples of {spacing} Hz below half the sample rate"
    )]
    OffGrid {
        /// Frequency of the line (Hz).
        frequency: f64,
        /// Sample rate over samples (Hz).
        spacing: f64,
    },
    /// A response is shorter than the decays to be transformed.
    #[error(
        "tap {tap}, sensor {sensor}: {samples} samples of decay, {least} are needed: use fewer samples of every decay"
    )]
    Short {
        /// Number of the tap, from 0.
        tap: usize,
        /// Number of the sensor, from 0.
        sensor: usize,
        /// Samples there are.
        samples: usize,
        /// Samples needed.
        least: usize,
    },
}

/// Reason why a start did not become a mode.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// The start is no possible natural frequency.
    #[error("the start lies outside the frequencies that were measured")]
    OutsideBand,
    /// Fewer lines in the band than the unknowns need.
    #[error("{lines} lines lie in its band, {least} are needed: use longer records")]
    TooFewLines {
        /// Lines in the band.
        lines: usize,
        /// Lines needed.
        least: usize,
    },
    /// Every column is zero in the band.
    #[error("no column holds anything in its band")]
    NoSignal,
    /// The data do not need it.
    #[error("the data do not need it")]
    Unneeded,
    /// Poles or their neighbours cannot be separated.
    #[error("it cannot be told from another mode")]
    NotIndependent,
    /// The pole went elsewhere.
    #[error(
        "the pole went to {frequency:.4} Hz, {distance:.4} Hz from its start: no resonance is there"
    )]
    LeftStart {
        /// Frequency of the pole (Hz).
        frequency: f64,
        /// Distance from the start (Hz).
        distance: f64,
    },
    /// The pole grows instead of decaying.
    #[error("the oscillation does not decay")]
    NoDecay,
    /// The standard deviation is as large as a line and the half-power width.
    #[error("its frequency is known to {std:.3} Hz only, less than its line and its width tell")]
    Undetermined {
        /// Standard deviation (Hz).
        std: f64,
    },
    /// The exponential window's decay leaves nothing certain of the mode's own.
    #[error(
        "the window's decay hides its damping: {remaining:.2e} \u{b1} {std:.2e} is left of it; use a longer record and no window"
    )]
    WindowDominates {
        /// Damping ratio that is left.
        remaining: f64,
        /// Its standard deviation.
        std: f64,
    },
}

/// Kind of the lines, which determines the function of one pole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Basis {
    /// Discrete Fourier transforms of free decays that all have the same number of samples, without
    /// any window, on lines that are multiples of sample_rate/samples.
    FreeDecay {
        /// Sample rate (Hz).
        sample_rate: f64,
        /// Samples of each decay.
        samples: usize,
    },
    /// Frequency response functions.
    FrequencyResponse {
        /// Resolution 1/T of the records behind them (Hz). Denser lines are not independent of each
        /// other.
        resolution: f64,
    },
}

/// Lines of one sensor for one tap.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Number of the tap (from 0). For frequency response functions it is that of the tap's place.
    pub tap: usize,
    /// Number of the sensor (from 0). Columns of one sensor share one noise level.
    pub sensor: usize,
    /// Values on all lines (any unit).
    pub values: Vec<Complex64>,
}

/// Columns of complex lines on a common axis.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalData {
    basis: Basis,
    frequencies: Vec<f64>,
    columns: Vec<Column>,
    spacing: f64,
    /// Sine and cosine of half the turn from one sample to the next, pi f/rate, on every line of decays.
    half_turns: Vec<(f64, f64)>,
}

impl ModalData {
    /// Checks and takes the data: `frequencies` (Hz) ascending and positive, one for each value of every
    /// column. The axis may have gaps.
    ///
    /// # Errors
    /// [`FitError`] where lines and values do not belong together, or a value is no number.
    pub fn new(
        basis: Basis,
        frequencies: Vec<f64>,
        columns: Vec<Column>,
    ) -> Result<Self, FitError> {
        if columns.is_empty() || frequencies.len() < 2 {
            return Err(FitError::Empty {
                columns: columns.len(),
                lines: frequencies.len(),
            });
        }
        for (index, column) in columns.iter().enumerate() {
            if column.values.len() != frequencies.len() {
                return Err(FitError::Length {
                    column: index,
                    values: column.values.len(),
                    lines: frequencies.len(),
                });
            }
            if let Some(line) = column.values.iter().position(|value| !value.is_finite()) {
                return Err(FitError::NotFinite {
                    column: index,
                    line,
                });
            }
        }
        let ascending = frequencies.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascending || frequencies[0] <= 0.0 || frequencies.iter().any(|f| !f.is_finite()) {
            return Err(FitError::Axis);
        }
        let spacing = line_spacing(basis, &frequencies)?;
        let half_turns = match basis {
            Basis::FreeDecay { samples, .. } => {
                let lines = frequencies.iter().map(|frequency| frequency / spacing);
                lines
                    .map(|line| (PI / samples as f64 * line).sin_cos())
                    .collect()
            }
            Basis::FrequencyResponse { .. } => Vec::new(),
        };
        Ok(ModalData {
            basis,
            frequencies,
            columns,
            spacing,
            half_turns,
        })
    }

    /// Kind of the lines.
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// Frequencies of the lines (Hz).
    pub fn frequencies(&self) -> &[f64] {
        &self.frequencies
    }

    /// Columns of all taps and sensors.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Distance of neighbouring lines (Hz).
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Resolution (Hz): 1/T.
    fn resolution(&self) -> f64 {
        match self.basis {
            Basis::FreeDecay { .. } => self.spacing,
            Basis::FrequencyResponse { resolution } => resolution.max(self.spacing),
        }
    }

    /// Highest frequency that a pole can have (Hz).
    fn highest(&self) -> f64 {
        match self.basis {
            Basis::FreeDecay { sample_rate, .. } => 0.5 * sample_rate,
            Basis::FrequencyResponse { .. } => f64::INFINITY,
        }
    }
}

/// Distance of neighbouring lines (Hz).
///
/// The lines of a decay must be multiples of it, or the truncation factor differs from line to line.
fn line_spacing(basis: Basis, frequencies: &[f64]) -> Result<f64, FitError> {
    match basis {
        Basis::FreeDecay {
            sample_rate,
            samples,
        } => {
            let spacing = sample_rate / samples as f64;
            if !(spacing > 0.0 && spacing.is_finite()) {
                return Err(FitError::Axis);
            }
            for &frequency in frequencies {
                let line = frequency / spacing;
                // The largest transform has some 10^6 lines; rounding moves none by 10^-6.
                if (line - line.round()).abs() > 1e-6 || frequency >= 0.5 * sample_rate {
                    return Err(FitError::OffGrid { frequency, spacing });
                }
            }
            Ok(spacing)
        }
        Basis::FrequencyResponse { resolution } => {
            if !(resolution > 0.0 && resolution.is_finite()) {
                return Err(FitError::Axis);
            }
            let steps = frequencies.windows(2).map(|pair| pair[1] - pair[0]);
            Ok(steps.fold(f64::INFINITY, f64::min))
        }
    }
}

/// Collects the free decays after each tap, and keeps the lines of their transforms in given bands.
///
/// A decay begins after the force pulse has ended (without a hammer: where the response no longer
/// shows the pulse) and must not be windowed. All decays have the same number of samples, at best one from
/// [`largest_smooth_block`](crate::spectral::largest_smooth_block).
#[derive(Clone)]
pub struct FreeDecayCollector {
    sample_rate: f64,
    samples: usize,
    transform: Arc<dyn RealToComplex<f64>>,
    lines: Vec<usize>,
    columns: Vec<Column>,
    taps: usize,
}

impl FreeDecayCollector {
    /// Begins a collection: `samples` of each decay are used, and `bands` (Hz) may overlap.
    ///
    /// # Errors
    /// [`FitError::Empty`] where no line lies within the bands.
    pub fn new(sample_rate: f64, samples: usize, bands: &[(f64, f64)]) -> Result<Self, FitError> {
        let spacing = sample_rate / samples as f64;
        let sound = spacing.is_finite() && spacing > 0.0;
        // Neither 0 Hz nor half the sample rate: their imaginary parts hold nothing.
        let lines: Vec<usize> = (1..samples.div_ceil(2))
            .filter(|&line| {
                let frequency = line as f64 * spacing;
                bands
                    .iter()
                    .any(|&(low, high)| (low..=high).contains(&frequency))
            })
            .collect();
        if !sound || lines.len() < 2 {
            return Err(FitError::Empty {
                columns: 0,
                lines: lines.len(),
            });
        }
        Ok(FreeDecayCollector {
            sample_rate,
            samples,
            transform: RealFftPlanner::new().plan_fft_forward(samples),
            lines,
            columns: Vec::new(),
            taps: 0,
        })
    }

    /// Adds one tap with the responses of all sensors, of which the first `samples` samples are used.
    ///
    /// # Errors
    /// [`FitError::Short`] where a response has fewer.
    pub fn add_tap(&mut self, responses: &[Vec<f64>]) -> Result<(), FitError> {
        let mut spectrum = self.transform.make_output_vec();
        let mut input = self.transform.make_input_vec();
        for (sensor, response) in responses.iter().enumerate() {
            let short = FitError::Short {
                tap: self.taps,
                sensor,
                samples: response.len(),
                least: self.samples,
            };
            let decay = response.get(..self.samples).ok_or(short.clone())?;
            input.copy_from_slice(decay);
            self.transform
                .process(&mut input, &mut spectrum)
                .map_err(|_| short)?;
            self.columns.push(Column {
                tap: self.taps,
                sensor,
                // X(f) = (1/rate) sum x(n) e^{-j 2 pi f n/rate}.
                values: (self.lines.iter())
                    .map(|&line| spectrum[line] / self.sample_rate)
                    .collect(),
            });
        }
        self.taps += 1;
        Ok(())
    }

    /// Returns the collected data.
    ///
    /// # Errors
    /// [`FitError`] without any tap, or with a sample that is no number.
    pub fn finish(self) -> Result<ModalData, FitError> {
        let spacing = self.sample_rate / self.samples as f64;
        let frequencies = self.lines.iter().map(|&line| line as f64 * spacing);
        let basis = Basis::FreeDecay {
            sample_rate: self.sample_rate,
            samples: self.samples,
        };
        ModalData::new(basis, frequencies.collect(), self.columns)
    }
}
