//! From tap records to the lines of a fit, one tap after the other.

use num_complex::Complex64;
use realfft::RealFftPlanner;

use super::FitError;
use super::data::{Basis, Column, ModalData};

/// Collects the free decays after each tap, and keeps of their transforms the lines in given bands.
///
/// A decay begins after the force pulse has ended (without a hammer: where the response no longer
/// shows the pulse) and must not be windowed. All decays have the same number of samples, best one that
/// [`largest_smooth_block`](crate::spectral::largest_smooth_block) gives.
#[derive(Debug, Clone)]
pub struct FreeDecayCollector {
    sample_rate: f64,
    samples: usize,
    lines: Vec<usize>,
    columns: Vec<Column>,
    taps: usize,
}

impl FreeDecayCollector {
    /// `samples` of each decay are used; `bands` (Hz) may overlap.
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
            lines,
            columns: Vec::new(),
            taps: 0,
        })
    }

    /// Adds one tap: `responses` of all sensors, of each its first `samples` samples.
    ///
    /// # Errors
    /// [`FitError::Short`] where a response has fewer.
    pub fn add_tap(&mut self, responses: &[Vec<f64>]) -> Result<(), FitError> {
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(self.samples);
        let mut spectrum = transform.make_output_vec();
        let mut input = transform.make_input_vec();
        for (sensor, response) in responses.iter().enumerate() {
            let short = FitError::Short {
                tap: self.taps,
                sensor,
                samples: response.len(),
                least: self.samples,
            };
            let decay = response.get(..self.samples).ok_or(short.clone())?;
            input.copy_from_slice(decay);
            transform
                .process(&mut input, &mut spectrum)
                .map_err(|_| short)?;
            self.columns.push(Column {
                tap: self.taps,
                sensor,
                values: self.pick(&spectrum),
            });
        }
        self.taps += 1;
        Ok(())
    }

    /// X(f) = (1/rate) sum x(n) e^{-j 2 pi f n/rate} on the lines that are kept.
    fn pick(&self, spectrum: &[Complex64]) -> Vec<Complex64> {
        self.lines
            .iter()
            .map(|&line| spectrum[line] / self.sample_rate)
            .collect()
    }

    /// What was collected.
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
