//! The responses that a polyreference fit reads: values on equally spaced lines.

use num_complex::Complex64;

use super::PolyreferenceError;

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
