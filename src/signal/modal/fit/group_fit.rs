//! The fit of a group of poles over its band, and what follows from it.

use nalgebra::DMatrix;
use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use tapjoint_numerics::stats::chi_square_tail;

use super::variable_projection::{Evaluation, PoleProblem, Slopes};
use super::{Basis, ModalData, StopReason};

/// Significance level at which the residual or the poles ask for one more term of background. 5 %: a term
/// too many makes a standard deviation some percent larger, one too few makes a bias.
const TERM_LEVEL: f64 = 0.05;
/// Least common share of the powers of two modes over the taps. It is 1 where every tap excites them in the same
/// proportion, and 0 where one mode rings at either frequency after a tap of its own: half way between.
const SAME_TAPS: f64 = 0.5;
/// Likeness from which two shapes count as one, the usual limit of the modal assurance criterion.
const SAME_SHAPE: f64 = 0.9;

/// A group of poles fitted over its band.
#[derive(Debug, Clone)]
pub(super) struct GroupFit {
    /// Poles (lines), amplitudes and sums of squares in units of each sensor's noise.
    pub at: Evaluation,
    pub slopes: Slopes,
    pub stop: StopReason,
    /// Noise of each column that was used (unit of the data, each real component).
    pub noise: Vec<f64>,
    /// Residual variance in units of `noise` squared.
    pub variance: f64,
    /// Degrees of freedom of the residual.
    pub freedom: f64,
    /// Complex terms of the background polynomial.
    pub terms: usize,
    /// Indices of the columns that were used.
    pub used: Vec<usize>,
    /// Problem that the poles solve.
    pub problem: PoleProblem,
}

impl GroupFit {
    /// Noise of every column of the data; zero where a column was not used.
    pub fn noise_by_column(&self, columns: usize) -> Vec<f64> {
        let mut all = vec![0.0; columns];
        for (&column, noise) in self.used.iter().zip(&self.noise) {
            all[column] = noise * self.variance.sqrt();
        }
        all
    }

    /// Amplitude b of the pole at `place` in the used column `index`, in units of noise.
    pub fn amplitude(&self, place: usize, index: usize) -> Complex64 {
        complex_row(&self.at.amplitudes, place, index)
    }

    /// Amplitude of the pole at `place` in every column of the data (its unit); zero in unused columns.
    pub fn amplitudes(&self, place: usize, columns: usize) -> Vec<Complex64> {
        let mut all = vec![Complex64::ZERO; columns];
        for (index, (&column, noise)) in self.used.iter().zip(&self.noise).enumerate() {
            all[column] = self.amplitude(place, index) * *noise;
        }
        all
    }

    /// Returns the place of the pole nearest to that at `place`; `None` without another.
    pub fn nearest(&self, place: usize) -> Option<usize> {
        let poles = &self.at.poles;
        let distance = |other: &usize| (poles[*other] - poles[place]).norm();
        let others = (0..poles.len()).filter(|other| *other != place);
        others.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Returns the likeness of the shapes of two poles, in units of noise; `None` with one sensor.
    ///
    /// It is sum_tu |sum_s conj(b_ts) c_us|^2/(sum_t sum_s |b_ts|^2 sum_u sum_s |c_us|^2) over all pairs of taps t, u and
    /// sensors s. Each tap excites the two in a proportion of its own where one mode moves from tap to tap. Frequency
    /// response functions count as one tap: the places of their taps are part of a shape.
    pub fn likeness(&self, data: &ModalData, one: usize, other: usize) -> Option<f64> {
        let as_one = matches!(data.basis(), Basis::FrequencyResponse { .. });
        let taps: Vec<usize> = (self.used.iter())
            .map(|&column| data.columns()[column].tap)
            .collect();
        let columns: Vec<usize> = (0..taps.len()).collect();
        let shapes = columns.chunk_by(|&a, &b| as_one || taps[a] == taps[b]);
        let shapes: Vec<&[usize]> = shapes.filter(|shape| shape.len() > 1).collect();
        let sensors = |shape: &[usize]| -> Vec<usize> {
            let shape = shape.iter();
            shape
                .map(|&index| data.columns()[self.used[index]].sensor)
                .collect()
        };
        let (mut alike, mut whole) = (0.0, 0.0);
        for mine in &shapes {
            for theirs in shapes
                .iter()
                .filter(|theirs| sensors(theirs) == sensors(mine))
            {
                let (mut product, mut own_power, mut other_power) = (Complex64::ZERO, 0.0, 0.0);
                for (&a, &b) in mine.iter().zip(*theirs) {
                    let (own, other) = (self.amplitude(one, a), self.amplitude(other, b));
                    product += own.conj() * other;
                    own_power += own.norm_sqr();
                    other_power += other.norm_sqr();
                }
                alike += product.norm_sqr();
                whole += own_power * other_power;
            }
        }
        (whole > 0.0).then(|| alike / whole)
    }

    /// Returns true where two poles are one mode whose frequency changed between the taps. They have one shape, but
    /// different taps excite them. Every tap excites two neighbouring modes in the same proportion.
    pub fn is_one_mode(&self, data: &ModalData, one: usize, other: usize) -> bool {
        let taps = data.columns().iter().map(|column| column.tap + 1).max();
        let taps = taps.unwrap_or(0);
        if matches!(data.basis(), Basis::FrequencyResponse { .. }) || taps < 2 {
            return false;
        }
        let mut powers = vec![[0.0; 2]; taps];
        for (index, &column) in self.used.iter().enumerate() {
            let power = &mut powers[data.columns()[column].tap];
            power[0] += self.amplitude(one, index).norm_sqr();
            power[1] += self.amplitude(other, index).norm_sqr();
        }
        let whole = powers.iter().fold([0.0, 0.0], |sum, power| {
            [sum[0] + power[0], sum[1] + power[1]]
        });
        let shares = powers
            .iter()
            .map(|power| (power[0] / whole[0]).min(power[1] / whole[1]));
        let alike = || self.likeness(data, one, other);
        shares.sum::<f64>() < SAME_TAPS && alike().is_none_or(|alike| alike > SAME_SHAPE)
    }

    /// Standard deviations of position and decay of each pole (lines), from the residual.
    ///
    /// NaN where two poles cannot be separated.
    pub fn deviations(&self) -> Vec<[f64; 2]> {
        let covariance = self.slopes.covariance(self.variance);
        (0..self.at.poles.len())
            .map(|place| {
                [2 * place, 2 * place + 1]
                    .map(|i| covariance.as_ref().map_or(f64::NAN, |c| c[(i, i)].sqrt()))
            })
            .collect()
    }

    /// Returns true where the data ask for the background of `more`.
    ///
    /// They do where the residual falls (F test), or where a pole moves by more than the precision that
    /// the term costs explains (Hausman 1978).
    pub fn needs(&self, more: &GroupFit) -> bool {
        let terms = self.freedom - more.freedom;
        let gain = (self.at.square_sum - more.at.square_sum) / terms / more.variance;
        let chance = FisherSnedecor::new(terms, more.freedom);
        if chance.is_ok_and(|chance| gain > 0.0 && chance.sf(gain) < TERM_LEVEL) {
            return true;
        }
        let [efficient, robust] =
            [self, more].map(|fit| fit.slopes.information.clone().try_inverse());
        let (Some(efficient), Some(robust)) = (efficient, robust) else {
            return false;
        };
        let level = TERM_LEVEL / efficient.nrows() as f64;
        (0..efficient.nrows()).any(|i| {
            let change = more.at.poles[i / 2] - self.at.poles[i / 2];
            let change = if i % 2 == 0 { change.im } else { change.re };
            let explained = (robust[(i, i)] - efficient[(i, i)]) * more.variance;
            explained > 0.0 && chi_square_tail(change * change / explained, 1.0) < level
        })
    }
}

/// Complex value in the rows (real, imaginary) of the pole at `place`.
pub(super) fn complex_row(matrix: &DMatrix<f64>, place: usize, column: usize) -> Complex64 {
    Complex64::new(matrix[(2 * place, column)], matrix[(2 * place + 1, column)])
}
