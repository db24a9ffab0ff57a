//! The Fourier transform of tap records on given lines.

use std::f64::consts::TAU;
use std::fmt;
use std::sync::Arc;

use num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use super::chirp::Chirp;
use super::lines::Lines;
use super::zoom::{Decimator, decimation_factor};

/// The Fourier transform X(f) = (1/rate) sum x(n) e^{-j 2 pi f n/rate} of windowed records (unit of
/// the samples times s) on given lines; time zero is a record's first sample.
///
/// Over the full band of a block that is one FFT; over a zoom band a record is mixed down, low-pass
/// filtered, decimated and transformed on the band's own lines, as an analyser does. Everything
/// that does not depend on the samples is computed once, here.
#[derive(Debug)]
pub struct Transformer {
    lines: Lines,
    sample_rate: f64,
    plan: Plan,
}

enum Plan {
    /// The whole band of a block: a real FFT.
    Full(Arc<dyn RealToComplex<f64>>),
    /// Lines anywhere, without decimation.
    Lines(Chirp),
    /// A zoom band.
    Zoom {
        decimator: Decimator,
        chirp: Chirp,
        /// On each line: what undoes the filter's delay, times the decimation.
        turns: Vec<Complex64>,
    },
}

/// Room that one transform after the other may use.
#[derive(Debug, Default)]
pub struct Workspace {
    samples: Vec<f64>,
    spectrum: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Transformer {
    /// Plans the transform of records of at most `length` samples at `sample_rate` (Hz) on `lines`.
    pub fn new(sample_rate: f64, lines: Lines, length: usize) -> Self {
        let rate_of_block = lines.spacing * lines.block as f64;
        let full_band =
            lines.low == 0.0 && (rate_of_block - sample_rate).abs() < 1e-9 * sample_rate;
        let plan = if full_band && length <= lines.block {
            Plan::Full(RealFftPlanner::new().plan_fft_forward(lines.block))
        } else {
            Plan::zoomed(sample_rate, lines, length.max(1))
        };
        Transformer {
            lines,
            sample_rate,
            plan,
        }
    }

    /// The lines on which it transforms.
    pub fn lines(&self) -> &Lines {
        &self.lines
    }

    /// The transform of a record; of one longer than planned the rest is left out.
    pub fn transform(&self, samples: &[f64]) -> Vec<Complex64> {
        let mut values = Vec::new();
        self.transform_into(samples, &mut Workspace::default(), &mut values);
        values
    }

    /// [`transform`](Self::transform) into `values`, whose room is used again.
    pub fn transform_into(
        &self,
        samples: &[f64],
        workspace: &mut Workspace,
        values: &mut Vec<Complex64>,
    ) {
        values.clear();
        let scale = 1.0 / self.sample_rate;
        match &self.plan {
            Plan::Full(fft) => {
                workspace.full(fft.as_ref(), samples, scale);
                values.extend_from_slice(&workspace.spectrum[..self.lines.points()]);
            }
            Plan::Lines(chirp) => {
                let transformed = chirp.transform(samples.iter().map(|&x| x.into()));
                values.extend(transformed.iter().map(|x| x * scale));
            }
            Plan::Zoom {
                decimator,
                chirp,
                turns,
            } => {
                let transformed = chirp.transform(decimator.run(samples).into_iter());
                values.extend(transformed.iter().zip(turns).map(|(x, t)| x * t * scale));
            }
        }
    }
}

impl Workspace {
    /// The real FFT of `samples` times `scale`, zeros appended, into `spectrum`.
    fn full(&mut self, fft: &dyn RealToComplex<f64>, samples: &[f64], scale: f64) {
        self.samples.clear();
        let kept = samples.iter().take(fft.len());
        self.samples.extend(kept.map(|x| x * scale));
        self.samples.resize(fft.len(), 0.0);
        self.spectrum.resize(fft.complex_len(), Complex64::ZERO);
        self.scratch.resize(fft.get_scratch_len(), Complex64::ZERO);
        // It refuses buffers of a wrong length alone, and these have just been given theirs.
        let done =
            fft.process_with_scratch(&mut self.samples, &mut self.spectrum, &mut self.scratch);
        debug_assert!(done.is_ok(), "{done:?}");
    }
}

impl Plan {
    fn zoomed(sample_rate: f64, lines: Lines, length: usize) -> Plan {
        let width = lines.high - lines.low;
        let centre = 0.5 * (lines.low + lines.high);
        let factor = decimation_factor(sample_rate, width);
        let points = lines.points();
        if factor < 2 {
            let step = lines.spacing / sample_rate;
            return Plan::Lines(Chirp::new(length, lines.low / sample_rate, step, points));
        }
        let decimator = Decimator::new(sample_rate, (centre, width), factor, length);
        let rate = sample_rate / factor as f64;
        let start = (lines.low - centre) / rate;
        let outputs = decimator.outputs(length);
        let turn = |index: usize| {
            // The first decimated sample lies `delay` samples before the record's start.
            let offset = lines.frequency(index) - centre;
            let angle = TAU * offset * decimator.delay() as f64 / sample_rate;
            Complex64::from_polar(factor as f64, angle)
        };
        Plan::Zoom {
            chirp: Chirp::new(outputs, start, lines.spacing / rate, points),
            turns: (0..points).map(turn).collect(),
            decimator,
        }
    }
}

impl fmt::Debug for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Plan::Full(fft) => write!(f, "Full({})", fft.len()),
            Plan::Lines(chirp) => f.debug_tuple("Lines").field(chirp).finish(),
            Plan::Zoom { chirp, .. } => f.debug_tuple("Zoom").field(chirp).finish(),
        }
    }
}

/// One record's transform on `lines`, planned for it alone: see [`Transformer`], which saves the
/// planning where there are several records.
pub fn transform_block(samples: &[f64], sample_rate: f64, lines: &Lines) -> Vec<Complex64> {
    Transformer::new(sample_rate, *lines, samples.len()).transform(samples)
}
