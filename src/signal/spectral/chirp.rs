//! Chirp z-transform (Bluestein): a transform on lines of any start and spacing.

use std::f64::consts::TAU;
use std::fmt;
use std::sync::Arc;

use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

use super::block::smallest_smooth_block;

/// What a chirp z-transform needs and every record shares.
pub(super) struct Chirp {
    /// e^{-j 2 pi start n} times half the chirp, for each sample.
    before: Vec<Complex64>,
    /// Transform of the conjugate chirp.
    kernel: Vec<Complex64>,
    /// Half the chirp over the length of the transforms, for each line.
    after: Vec<Complex64>,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Chirp {
    /// For at most `samples` samples and `count` lines; `start` and `step` in cycles per sample.
    pub(super) fn new(samples: usize, start: f64, step: f64, count: usize) -> Self {
        let length = smallest_smooth_block(samples + count);
        // e^{-j pi step k^2}: half the chirp, so that nk = (n^2 + k^2 - (k-n)^2)/2.
        let chirp = |k: usize| {
            let square = k as f64 * k as f64;
            Complex64::from_polar(1.0, phase(step / 2.0, square))
        };
        let mut kernel = vec![Complex64::ZERO; length];
        for (k, value) in kernel.iter_mut().take(count).enumerate() {
            *value = chirp(k).conj();
        }
        for i in 1..samples {
            kernel[length - i] = chirp(i).conj();
        }
        let mut planner = FftPlanner::new();
        let forward = planner.plan_fft_forward(length);
        forward.process(&mut kernel);
        let scale = 1.0 / length as f64;
        Chirp {
            before: (0..samples)
                .map(|i| Complex64::from_polar(1.0, phase(start, i as f64)) * chirp(i))
                .collect(),
            kernel,
            after: (0..count).map(|k| chirp(k) * scale).collect(),
            forward,
            inverse: planner.plan_fft_inverse(length),
        }
    }

    /// The transform of a record not longer than planned; what is longer is left out.
    pub(super) fn transform(&self, samples: impl Iterator<Item = Complex64>) -> Vec<Complex64> {
        let mut signal: Vec<Complex64> = samples.zip(&self.before).map(|(x, b)| x * b).collect();
        signal.resize(self.kernel.len(), Complex64::ZERO);
        self.forward.process(&mut signal);
        for (x, k) in signal.iter_mut().zip(&self.kernel) {
            *x *= k;
        }
        self.inverse.process(&mut signal);
        signal.iter().zip(&self.after).map(|(x, a)| x * a).collect()
    }
}

impl fmt::Debug for Chirp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Chirp")
            .field("samples", &self.before.len())
            .field("lines", &self.after.len())
            .finish_non_exhaustive()
    }
}

/// Chirp z-transform: sum over n of x(n) e^{-j 2 pi n (start + k step)} for k below `count`, `start`
/// and `step` in cycles per sample.
pub fn chirp_z(samples: &[Complex64], start: f64, step: f64, count: usize) -> Vec<Complex64> {
    if samples.is_empty() || count == 0 {
        return vec![Complex64::ZERO; count];
    }
    Chirp::new(samples.len(), start, step, count).transform(samples.iter().copied())
}

/// Phase -2 pi cycles n, reduced to one turn before it is rounded.
pub(super) fn phase(cycles: f64, n: f64) -> f64 {
    let product = cycles * n;
    // The rounding error of the product, recovered exactly, keeps long records accurate.
    let error = cycles.mul_add(n, -product);
    -TAU * ((product - product.round()) + error)
}
