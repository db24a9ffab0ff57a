//! Poles from frequency response functions: the polyreference least-squares complex frequency
//! estimator (Guillaume et al. 2003; Peeters et al. 2004), its stabilisation diagram, and the
//! selection of the physical poles.
//!
//! # Coefficients and band
//! The band is laid on four fifths of the unit circle, z_k = e^{j 2 pi (f_k - f_1) T_a}, and the
//! coefficients are complex. Real coefficients would say that every pole has a mirror image across
//! the band's lower end, which is so only where the band begins at 0 Hz; elsewhere they spend half
//! the order on images that are not there. With complex ones a band may begin anywhere, an order n
//! gives n poles within it, and the conjugate poles belong to the background. A mode is exactly
//! rational in j omega (and, of a sampled decay, in e^{j omega/rate}), not in z; but the difference
//! to 1/(1 - z_p/z) is smooth over the band, and the numerator takes it up.
//!
//! # Constraint
//! One coefficient must be fixed, and which one decides where the surplus poles go (Cauberghe 2004).
//! M is close to a Toeplitz matrix. Of such a matrix the minimiser with the highest coefficient fixed
//! is a linear predictor: all its roots lie within the unit circle, and surplus poles would look
//! like damped modes. Fixed here is the lowest, A_0 = I: the minimiser is the reversed predictor,
//! its surplus roots lie outside, |z| > 1, which is a growing oscillation, and are told by the sign
//! of their real part. Poles of the structure, which the data ask for, stay where they are.
//!
//! # What it does not do
//! The estimator is linear and not efficient: its frequencies are a start for a maximum-likelihood fit,
//! and the spread over the orders is a measure of stability, not an uncertainty.

mod selection;
mod stabilisation;
mod sub_bands;

use num_complex::Complex64;

pub use selection::{PolyreferenceMode, SelectionSettings, select_modes};
pub use stabilisation::{PoleStability, StabilisationPole, stabilise_poles};
pub use sub_bands::{BandSearch, SubBand, SubBandSettings, all_modes, find_modes, sub_bands};

/// What makes a polyreference fit impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PolyreferenceError {
    /// An output with another shape than the first one.
    #[error(
        "output {output} has {inputs} inputs on {lines} lines, output 1 has {expected_inputs} on {expected_lines}: give every entry on the same lines"
    )]
    Shape {
        /// Output, counted from 1.
        output: usize,
        /// Its inputs.
        inputs: usize,
        /// Inputs of output 1.
        expected_inputs: usize,
        /// Its lines.
        lines: usize,
        /// Lines of output 1.
        expected_lines: usize,
    },
    /// A value that is no number.
    #[error(
        "output {output}, input {input} has no finite value at {frequency} Hz: leave the line out or replace it"
    )]
    NotFinite {
        /// Output, counted from 1.
        output: usize,
        /// Input, counted from 1.
        input: usize,
        /// Frequency of the line (Hz).
        frequency: f64,
    },
    /// Fewer lines than the order needs.
    #[error(
        "{lines} lines are too few for order {order}: at least {least} are needed; widen the band or lower the order"
    )]
    TooFewLines {
        /// Lines in the band.
        lines: usize,
        /// Order asked for.
        order: usize,
        /// Least number of lines.
        least: usize,
    },
    /// Weights that do not fit the outputs.
    #[error(
        "{weights} weights for {outputs} outputs: give each output one positive weight, or none at all"
    )]
    Weights {
        /// Usable weights.
        weights: usize,
        /// Outputs.
        outputs: usize,
    },
    /// Nothing to fit.
    #[error(
        "the responses from {low} to {high} Hz have no content that a fit could use: check the band and the channels"
    )]
    Singular {
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
    },
}

/// From which change on a pole of the stabilisation diagram is not the same as one order before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StabilityTolerances {
    /// Relative change of the frequency. 1 %, as usual in the field.
    pub frequency: f64,
    /// Change of the frequency in half-power widths. 0.25: of a mode with 0.1 % damping 1 % is five
    /// half-power widths, within which another mode has room; the narrower of both limits holds.
    pub half_power_share: f64,
    /// Relative change of the damping ratio. 5 %, as usual in the field.
    pub damping: f64,
    /// 1 - MAC of the participation vectors. 2 %, as usual in the field.
    pub participation: f64,
}

impl Default for StabilityTolerances {
    fn default() -> Self {
        StabilityTolerances {
            frequency: 0.01,
            half_power_share: 0.25,
            damping: 0.05,
            participation: 0.02,
        }
    }
}

/// How poles are sought.
#[derive(Debug, Clone, PartialEq)]
pub struct PolyreferenceSettings {
    /// Highest order of the denominator; that times the inputs is the number of poles. 40: three to
    /// four times the modes of a band, as the surplus takes up noise and background.
    pub order: usize,
    /// Lowest order. 2: one pole alone says nothing of a band with several.
    pub least_order: usize,
    /// Decay (1/s) that an exponential window has added to every pole; taken out of each. 0.
    pub added_decay: f64,
    /// Weight of each output's sum of squares, 1 over its noise variance where that is known; equal
    /// weights by default.
    pub weights: Option<Vec<f64>>,
    /// Damping ratio from which on a pole is no mode. 0.2: bolted structures have a few per cent.
    pub most_damping: f64,
    /// Tolerances of the stabilisation diagram.
    pub tolerances: StabilityTolerances,
    /// What makes a pole a mode.
    pub selection: SelectionSettings,
}

impl Default for PolyreferenceSettings {
    fn default() -> Self {
        PolyreferenceSettings {
            order: 40,
            least_order: 2,
            added_decay: 0.0,
            weights: None,
            most_damping: 0.2,
            tolerances: StabilityTolerances::default(),
            selection: SelectionSettings::default(),
        }
    }
}

impl PolyreferenceSettings {
    fn weights_for(&self, matrix: &ResponseMatrix) -> Result<Vec<f64>, PolyreferenceError> {
        let outputs = matrix.outputs();
        let Some(weights) = &self.weights else {
            return Ok(vec![1.0; outputs]);
        };
        let usable = weights.iter().filter(|w| w.is_finite() && **w > 0.0);
        let usable = usable.count();
        if usable != outputs || weights.len() != outputs {
            return Err(PolyreferenceError::Weights {
                weights: usable,
                outputs,
            });
        }
        Ok(weights.clone())
    }

    /// Each column of unknowns meets outputs times lines equations.
    fn check_lines(&self, matrix: &ResponseMatrix) -> Result<(), PolyreferenceError> {
        let least = least_lines(matrix, self.order);
        if matrix.points() < least || self.order == 0 {
            return Err(PolyreferenceError::TooFewLines {
                lines: matrix.points(),
                order: self.order,
                least,
            });
        }
        Ok(())
    }
}

/// Lines that an order needs: numerators and the denominator's share of each output, and a quarter
/// more so that noise is averaged at all.
fn least_lines(matrix: &ResponseMatrix, order: usize) -> usize {
    let numerator = order + 1 + 2 * stabilisation::EXTRA_POWERS;
    let denominator = (order * matrix.inputs()).div_ceil(matrix.outputs().max(1));
    (numerator + denominator) * 5 / 4
}

/// Responses on equally spaced lines: frequency response functions, or transforms of free decays
/// (then each tap and sensor is an output of one input).
#[derive(Debug, Clone)]
pub struct ResponseMatrix<'a> {
    first: f64,
    spacing: f64,
    outputs: usize,
    inputs: usize,
    /// Entry (output, input) stands at output * inputs + input.
    entries: Vec<&'a [Complex64]>,
}

impl<'a> ResponseMatrix<'a> {
    /// Takes `values[output][input][line]` on lines `first + line * spacing` (both Hz).
    ///
    /// # Errors
    /// [`PolyreferenceError::Shape`] where an output lacks an input or an entry lacks lines,
    /// [`PolyreferenceError::NotFinite`] where a value is no number.
    pub fn new(
        first: f64,
        spacing: f64,
        values: &[Vec<&'a [Complex64]>],
    ) -> Result<Self, PolyreferenceError> {
        let inputs = values.first().map_or(0, Vec::len);
        let points = values
            .first()
            .and_then(|row| row.first())
            .map_or(0, |entry| entry.len());
        for (output, row) in values.iter().enumerate() {
            let least = row.iter().map(|entry| entry.len()).min().unwrap_or(0);
            let most = row.iter().map(|entry| entry.len()).max().unwrap_or(0);
            if row.len() != inputs || least != points || most != points {
                return Err(PolyreferenceError::Shape {
                    output: output + 1,
                    inputs: row.len(),
                    expected_inputs: inputs,
                    lines: if least == points { most } else { least },
                    expected_lines: points,
                });
            }
        }
        let entries: Vec<&[Complex64]> = values.iter().flatten().copied().collect();
        check_finite(&entries, inputs, first, spacing)?;
        Ok(ResponseMatrix {
            first,
            spacing,
            outputs: values.len(),
            inputs,
            entries,
        })
    }

    /// The part between two frequencies (Hz), both ends included.
    #[must_use]
    pub fn band(&self, low: f64, high: f64) -> Self {
        // A millionth of a line more, so that an end that lies on a line is not lost by rounding.
        let index = |frequency: f64| (frequency - self.first) / self.spacing;
        let start = (index(low) - 1e-6).ceil().max(0.0) as usize;
        let end = ((index(high) + 1e-6).floor().max(-1.0) + 1.0) as usize;
        let end = end.min(self.points());
        let start = start.min(end);
        ResponseMatrix {
            first: self.frequency(start),
            entries: self
                .entries
                .iter()
                .map(|entry| &entry[start..end])
                .collect(),
            ..*self
        }
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of lines.
    pub fn points(&self) -> usize {
        self.entries.first().map_or(0, |entry| entry.len())
    }

    /// Distance between lines (Hz).
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Frequency of line `index` (Hz).
    pub fn frequency(&self, index: usize) -> f64 {
        self.first + index as f64 * self.spacing
    }

    /// First and last frequency (Hz).
    pub fn ends(&self) -> (f64, f64) {
        (self.first, self.frequency(self.points().saturating_sub(1)))
    }

    /// Values of one entry on all lines.
    pub fn entry(&self, output: usize, input: usize) -> &'a [Complex64] {
        self.entries[output * self.inputs + input]
    }

    /// Power of each entry, line by line.
    pub(super) fn powers(&self) -> Vec<Vec<f64>> {
        let power = |entry: &&[Complex64]| entry.iter().map(Complex64::norm_sqr).collect();
        self.entries.iter().map(power).collect()
    }
}

fn check_finite(
    entries: &[&[Complex64]],
    inputs: usize,
    first: f64,
    spacing: f64,
) -> Result<(), PolyreferenceError> {
    for (index, entry) in entries.iter().enumerate() {
        if let Some(line) = entry.iter().position(|value| !value.is_finite()) {
            return Err(PolyreferenceError::NotFinite {
                output: index / inputs + 1,
                input: index % inputs + 1,
                frequency: first + line as f64 * spacing,
            });
        }
    }
    Ok(())
}
