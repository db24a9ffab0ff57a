//! The function of one pole on the lines, its derivative, and the real columns made of them.
//!
//! Inside the fit a line stands at m (its frequency over the line spacing df), and a pole at
//! q = p/(2 pi df) = -decay + j position. With kappa = 2 pi/M, the transform of a decay
//! x(n) = Re(a z^n), z = e^{kappa q}, over its M samples (times 1/rate) is on the line m
//!
//! ```text
//! X(m) = b phi(m; q) + conj(b) phi(m; conj q),     phi(m; q) = kappa/(1 - e^{kappa (q - j m)}),
//! a = 2 b (2 pi df)/(1 - e^{2 pi q}),
//! ```
//!
//! because e^{-j kappa m M} = 1 on every line: the truncation is a factor of the amplitude and no
//! error. For a frequency response function phi = 1/(j m - q), and its residue is R = b (2 pi df).

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::data::{Basis, ModalData};

/// Least decay (lines) of a steady line: on its own line it is a million times its neighbours.
pub(super) const STEADY: f64 = 1e-6;

/// The lines of one band.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    /// First line of the band in the data.
    pub first: usize,
    /// Which lines from there are taken: 1 all, 2 every other one.
    pub stride: usize,
    /// Positions (lines).
    pub positions: Vec<f64>,
    /// 2 pi/M of a decay; `None` for a frequency response function.
    kappa: Option<f64>,
}

/// Values of one pole and of its image on the lines, and their derivatives to the pole.
struct Values {
    pole: Vec<[Complex64; 2]>,
    image: Vec<[Complex64; 2]>,
}

impl Lines {
    /// The lines from index `first` up to `end` (not included), evenly thinned to `most` at most.
    pub fn new(data: &ModalData, (first, end): (usize, usize), most: usize) -> Self {
        let stride = (end - first).div_ceil(most).max(1);
        let positions = data.frequencies()[first..end]
            .iter()
            .step_by(stride)
            .map(|f| f / data.spacing())
            .collect();
        let kappa = match data.basis() {
            Basis::FreeDecay { samples, .. } => Some(std::f64::consts::TAU / samples as f64),
            Basis::FrequencyResponse { .. } => None,
        };
        Lines {
            first,
            stride,
            positions,
            kappa,
        }
    }

    pub fn count(&self) -> usize {
        self.positions.len()
    }

    /// phi and d phi/dq.
    fn value(&self, pole: Complex64, line: f64) -> [Complex64; 2] {
        let distance = pole - Complex64::new(0.0, line);
        match self.kappa {
            // phi = kappa/(1 - e^u), d phi/dq = e^u phi^2, u = kappa (q - j m).
            Some(kappa) => {
                let less_one = exp_less_one(kappa * distance);
                let value = -kappa / less_one;
                [value, (less_one + 1.0) * value * value]
            }
            // phi = 1/(j m - q), d phi/dq = phi^2.
            None => {
                let value = -distance.inv();
                [value, value * value]
            }
        }
    }

    fn values(&self, pole: Complex64) -> Values {
        let both = |pole: Complex64| self.positions.iter().map(move |&m| self.value(pole, m));
        Values {
            pole: both(pole).collect(),
            image: both(pole.conj()).collect(),
        }
    }

    /// Real columns of `poles`: for each pole two of the model and two of its derivative.
    ///
    /// With b = b1 + j b2 the model is b1 (phi + image) + b2 j (phi - image); rows are the real parts
    /// of all lines, then the imaginary parts. With phi' and image' the derivatives and
    /// u = phi' + image', v = j (phi' - image'), the model changes
    ///
    /// ```text
    /// with the position by  b1 v - b2 u,     with the decay by  -(b1 u + b2 v).
    /// ```
    pub fn columns(&self, poles: &[Complex64]) -> (DMatrix<f64>, DMatrix<f64>) {
        let rows = 2 * self.count();
        let mut model = DMatrix::zeros(rows, 2 * poles.len());
        let mut slopes = DMatrix::zeros(rows, 2 * poles.len());
        for (place, &pole) in poles.iter().enumerate() {
            let values = self.values(pole);
            for (line, (one, image)) in values.pole.iter().zip(&values.image).enumerate() {
                self.put(&mut model, (line, 2 * place), (one[0], image[0]));
                self.put(&mut slopes, (line, 2 * place), (one[1], image[1]));
            }
        }
        (model, slopes)
    }

    /// Only the columns of the model.
    pub fn model(&self, poles: &[Complex64]) -> DMatrix<f64> {
        let mut model = DMatrix::zeros(2 * self.count(), 2 * poles.len());
        for (place, &pole) in poles.iter().enumerate() {
            for (line, &m) in self.positions.iter().enumerate() {
                let pair = (self.value(pole, m)[0], self.value(pole.conj(), m)[0]);
                self.put(&mut model, (line, 2 * place), pair);
            }
        }
        model
    }

    fn put(
        &self,
        matrix: &mut DMatrix<f64>,
        (line, column): (usize, usize),
        (one, image): (Complex64, Complex64),
    ) {
        let sum = one + image;
        let turned = Complex64::i() * (one - image);
        let imaginary = line + self.count();
        matrix[(line, column)] = sum.re;
        matrix[(imaginary, column)] = sum.im;
        matrix[(line, column + 1)] = turned.re;
        matrix[(imaginary, column + 1)] = turned.im;
    }

    /// Columns of a complex polynomial with `terms` terms over the band, for what lies outside it.
    pub fn polynomial(&self, terms: usize) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(2 * self.count(), 2 * terms);
        let low = self.positions.first().copied().unwrap_or(0.0);
        let high = self.positions.last().copied().unwrap_or(1.0);
        for (line, m) in self.positions.iter().enumerate() {
            let place = (2.0 * m - low - high) / (high - low).max(f64::MIN_POSITIVE);
            for term in 0..terms {
                let value = place.powi(term as i32);
                columns[(line, 2 * term)] = value;
                columns[(line + self.count(), 2 * term + 1)] = value;
            }
        }
        columns
    }
}

/// e^u - 1 without cancellation near zero: with u = x + j y,
/// (e^x - 1) cos y - 2 sin^2(y/2) + j e^x sin y.
fn exp_less_one(u: Complex64) -> Complex64 {
    let (half_sin, half_cos) = (0.5 * u.im).sin_cos();
    let grown = u.re.exp_m1();
    let versine = 2.0 * half_sin * half_sin;
    Complex64::new(
        grown * (1.0 - versine) - versine,
        (grown + 1.0) * 2.0 * half_sin * half_cos,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modal::fit::Column;

    fn lines(basis: Basis) -> Lines {
        let frequencies: Vec<f64> = (20..40).map(f64::from).collect();
        let values = vec![Complex64::ONE; frequencies.len()];
        let column = Column {
            tap: 0,
            sensor: 0,
            values,
        };
        let data = ModalData::new(basis, frequencies, vec![column]).unwrap();
        Lines::new(&data, (0, 20), usize::MAX)
    }

    const DECAY: Basis = Basis::FreeDecay {
        sample_rate: 100.0,
        samples: 100,
    };
    const RESPONSE: Basis = Basis::FrequencyResponse { resolution: 1.0 };

    #[test]
    fn limit_the_model_is_the_transform_of_a_sampled_decay() {
        let (pole, amplitude) = (Complex64::new(-0.2, 30.3), Complex64::new(0.7, -1.1));
        let lines = lines(DECAY);
        // b = a (1 - e^{pT})/(2 2 pi df), all in lines; df = 1 Hz, T = 1 s.
        let tau = std::f64::consts::TAU;
        let b = amplitude * (1.0 - (tau * pole).exp()) / (2.0 * tau);
        let model = lines.model(&[pole]);
        for (row, m) in lines.positions.iter().enumerate() {
            let transform: Complex64 = (0..100)
                .map(|n| {
                    let time = f64::from(n) / 100.0;
                    let x = (amplitude * (tau * pole * time).exp()).re;
                    x * Complex64::from_polar(0.01, -tau * m * time)
                })
                .sum();
            let imaginary = row + lines.count();
            let fitted = Complex64::new(
                b.re * model[(row, 0)] + b.im * model[(row, 1)],
                b.re * model[(imaginary, 0)] + b.im * model[(imaginary, 1)],
            );
            // Rounding of a sum of a hundred terms.
            assert!((fitted - transform).norm() < 1e-12, "line {m}");
        }
    }

    #[test]
    fn prop_the_slopes_are_differences_of_the_model() {
        let pole = Complex64::new(-0.4, 29.6);
        let step = 1e-6;
        for basis in [DECAY, RESPONSE] {
            let lines = lines(basis);
            let (_, slopes) = lines.columns(&[pole]);
            let difference = |by: Complex64| {
                (lines.model(&[pole + by]) - lines.model(&[pole - by])) / (2.0 * step)
            };
            let position = difference(Complex64::new(0.0, step));
            let decay = difference(Complex64::new(-step, 0.0));
            let (u, v) = (slopes.column(0), slopes.column(1));
            // Second differences of order one over the step squared: 10^-9 at most.
            for (found, expected) in [
                (position.column(0), v.into_owned()),
                (position.column(1), -u.into_owned()),
                (decay.column(0), -u.into_owned()),
                (decay.column(1), -v.into_owned()),
            ] {
                assert!((found - expected).norm() < 1e-7, "{basis:?}");
            }
        }
    }
}
