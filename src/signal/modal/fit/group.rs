//! Fit of one group of modes over its band.
//!
//! A band reaches ten half widths to either side of its modes. Modes near each other form a group and are
//! fitted jointly. Distant modes are subtracted, near ones keep free amplitudes, and a polynomial of the
//! frequency stands for everything else that the data show in the band.

use std::ops::Range;

use nalgebra::DMatrix;
use num_complex::Complex64;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::variable_projection::{DISTINCT, Evaluation, Lines, PoleProblem, STEADY, Slopes};
use super::{ModalData, StopReason, Unfit};
use crate::modal::Subspace;

/// Half of a band in effective half widths. 10: the lines outside would improve the standard deviation
/// by 3 % (computed from the information on the pole on all lines and on those of the band).
const HALF_WIDTHS: f64 = 10.0;
/// Least half of a band (lines). 12: the equivalent for resonances narrower than a line, and enough
/// values beside the unknowns.
const LEAST_HALF: f64 = 12.0;
/// Modes nearer than so many of their half widths together, and so many lines, are fitted jointly. 3:
/// the poles' common information then raises two standard deviations by less than 1 %.
const JOINT: f64 = 3.0;
/// Most terms of the background: constant, slope, curvature.
const MOST_TERMS: usize = 3;
/// Significance level at which the residual or the poles ask for one more term of background. 5 %: a term
/// too many makes a standard deviation some percent larger, one too few makes a bias.
const TERM_LEVEL: f64 = 0.05;
/// Largest error of a sensor's noise power before the weights are set anew. 20 %: that costs less than a
/// percent of the precision, and a short band does not know its noise better.
const NOISE_CHANGE: f64 = 0.2;

/// Effective half width of a pole (lines): its decay, and half a line where that is less.
pub(super) fn half_width(pole: Complex64) -> f64 {
    pole.re.hypot(0.5)
}

/// Half of the band of a pole (lines).
pub(super) fn half_band(pole: Complex64) -> f64 {
    (HALF_WIDTHS * half_width(pole)).max(LEAST_HALF)
}

/// Sorts poles into the groups that are fitted jointly, ascending in frequency. Returns their indices.
pub(super) fn groups(poles: &[(usize, Complex64)]) -> Vec<Vec<usize>> {
    let mut sorted = poles.to_vec();
    sorted.sort_by(|a, b| a.1.im.total_cmp(&b.1.im));
    sorted
        .chunk_by(|(_, a), (_, b)| b.im - a.im < JOINT * (half_width(*a) + half_width(*b) + 1.0))
        .map(|group| group.iter().map(|&(index, _)| index).collect())
        .collect()
}

/// Index range of the lines between two positions (lines).
pub(super) fn lines_between(data: &ModalData, low: f64, high: f64) -> Range<usize> {
    let frequencies = data.frequencies();
    let first = frequencies.partition_point(|f| f / data.spacing() < low);
    let end = frequencies.partition_point(|f| f / data.spacing() <= high);
    first..end.max(first)
}

/// Bands (Hz) that a fit from these starts (frequency in Hz, damping ratio) may use.
///
/// A collector of decays must keep them. They are twice as wide as the starts ask for, because a fitted
/// mode may turn out wider. `resolution` is 1/T (Hz).
pub fn bands_for(starts: &[(f64, f64)], resolution: f64) -> Vec<(f64, f64)> {
    starts
        .iter()
        .map(|&(frequency, damping_ratio)| {
            let pole = Complex64::new(-damping_ratio * frequency, frequency) / resolution;
            let half = 2.0 * half_band(pole) * resolution;
            (frequency - half, frequency + half)
        })
        .collect()
}

/// A mode that does not belong to the group.
#[derive(Debug, Clone)]
pub(super) struct Neighbour {
    /// Its pole (lines).
    pub pole: Complex64,
    /// Its amplitude in every column, once it has been fitted.
    pub amplitudes: Option<Vec<Complex64>>,
}

/// Lines of a group's band without distant modes, and the functions of the near ones.
pub(super) struct BandData<'a> {
    pub data: &'a ModalData,
    pub lines: Lines,
    /// Indices of the columns that are not zero throughout.
    pub used: Vec<usize>,
    /// Real over imaginary parts of these columns.
    values: DMatrix<f64>,
    /// Poles of near neighbours and steady lines.
    near: Vec<Complex64>,
}

impl<'a> BandData<'a> {
    /// Takes the band of `poles` (lines) out of the data, thinned to `most` lines at most.
    ///
    /// Neighbours outside the band are subtracted. Those inside, or less than a quarter of the band
    /// away, keep free amplitudes. `steady` are positions of undamped lines (lines).
    pub fn new(
        data: &'a ModalData,
        poles: &[Complex64],
        neighbours: &[Neighbour],
        steady: &[f64],
        most: usize,
    ) -> Result<Self, Unfit> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &pole in poles {
            low = low.min(pole.im - half_band(pole));
            high = high.max(pole.im + half_band(pole));
        }
        let range = lines_between(data, low, high);
        // Two complex lines for a pole's two parts and its amplitude, and one to see a misfit.
        let least = 2 * poles.len() + 1;
        if range.len() < least {
            return Err(Unfit::TooFewLines {
                lines: range.len(),
                least,
            });
        }
        let lines = Lines::new(data, range, most.max(least));
        let (first, stride, count) = (lines.first, lines.stride, lines.count());
        let mut used = Vec::new();
        for (index, column) in data.columns().iter().enumerate() {
            let mut values = column.values[first..].iter().step_by(stride).take(count);
            if values.any(|value| value.norm_sqr() > 0.0) {
                used.push(index);
            }
        }
        if used.is_empty() {
            return Err(Unfit::NoSignal);
        }
        let mut values = DMatrix::from_fn(2 * count, used.len(), |row, place| {
            let value = data.columns()[used[place]].values[first + stride * (row % count)];
            if row < count { value.re } else { value.im }
        });
        let margin = 0.25 * (high - low);
        let reach = low - margin..=high + margin;
        let mut near = Vec::new();
        for other in neighbours {
            if reach.contains(&other.pole.im) {
                near.push(other.pole);
            } else if let Some(all) = &other.amplitudes {
                let amplitudes = DMatrix::from_fn(2, used.len(), |row, place| {
                    let value = all[used[place]];
                    if row == 0 { value.re } else { value.im }
                });
                values -= lines.model(&[other.pole]) * amplitudes;
            }
        }
        let hum = steady.iter().filter(|&position| reach.contains(position));
        near.extend(hum.map(|&position| Complex64::new(-STEADY, position)));
        Ok(BandData {
            data,
            lines,
            used,
            values,
            near,
        })
    }

    /// Root mean square of each sensor's columns: a first scale of the noise, for every column.
    pub fn scale(&self) -> Vec<f64> {
        self.by_sensor(&self.values, self.values.nrows() as f64)
    }

    /// Root of the mean square over all columns of a column's sensor, for every column.
    ///
    /// `freedom` are the degrees of freedom of one column.
    fn by_sensor(&self, columns: &DMatrix<f64>, freedom: f64) -> Vec<f64> {
        let mut scales = Vec::with_capacity(self.used.len());
        for &own in &self.used {
            let (mut sum, mut count) = (0.0, 0.0);
            for (place, &other) in self.used.iter().enumerate() {
                if self.data.columns()[other].sensor == self.data.columns()[own].sensor {
                    sum += columns.column(place).norm_squared();
                    count += 1.0;
                }
            }
            scales.push((sum / (count * freedom)).sqrt());
        }
        scales
    }

    /// Returns the problem with `terms` terms of background, its columns in units of `noise`.
    fn problem(&self, terms: usize, noise: &[f64]) -> PoleProblem {
        let near = self.lines.model(&self.near);
        let split = near.ncols();
        let mut raw = near.resize_horizontally(split + 2 * terms, 0.0);
        raw.columns_mut(split, 2 * terms)
            .copy_from(&self.lines.polynomial(terms));
        let fixed = Subspace::new(&raw, DISTINCT);
        let mut columns = self.values.clone();
        for (mut column, noise) in columns.column_iter_mut().zip(noise) {
            column /= *noise;
        }
        PoleProblem {
            lines: self.lines.clone(),
            columns: fixed.complement(columns),
            fixed,
        }
    }

    /// Looks for a better start of the pole at `place`: other dampings, other places, other dampings again.
    ///
    /// A start half a line off lies outside the valley of a resonance narrower than a line.
    pub fn improve_start(
        &self,
        poles: &mut [Complex64],
        place: usize,
        damping_known: bool,
        terms: usize,
        noise: &[f64],
    ) {
        let factors: &[f64] = if damping_known {
            &[0.5, 1.0, 2.0]
        } else {
            &[0.1, 0.3, 1.0, 3.0, 10.0]
        };
        let line = self.data.resolution() / self.data.spacing();
        let offsets = [-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75].map(|share| share * line);
        let problem = self.problem(terms, noise);
        for round in 0..3 {
            let pole = poles[place];
            let tries: Vec<Complex64> = if round == 1 {
                offsets
                    .map(|offset| pole + Complex64::new(0.0, offset))
                    .into()
            } else {
                let damped = factors.iter().map(|f| Complex64::new(pole.re * f, pole.im));
                damped.collect()
            };
            let (mut best, mut least) = (pole, f64::INFINITY);
            for pole in tries {
                poles[place] = pole;
                if let Some(at) = problem.amplitudes_at(poles)
                    && at.square_sum < least
                {
                    (best, least) = (pole, at.square_sum);
                }
            }
            poles[place] = best;
        }
    }

    /// Sum of the squares without any pole.
    pub fn square_sum_without(&self, terms: usize, noise: &[f64]) -> f64 {
        self.problem(terms, noise).columns.norm_squared()
    }

    /// Fits from `start` with `terms` terms of background and given noise of the columns (any scale).
    pub fn fit(&self, start: &[Complex64], terms: usize, noise: &[f64]) -> Result<GroupFit, Unfit> {
        const MOST_STEPS: usize = 30;
        let problem = self.problem(terms, noise);
        let freedom = self.freedom(&problem.fixed, start.len())?;
        let best = problem
            .search(start, freedom, MOST_STEPS)
            .ok_or(Unfit::NotIndependent)?;
        Ok(GroupFit {
            variance: best.at.square_sum / freedom,
            at: best.at,
            slopes: best.slopes,
            stop: best.stop,
            noise: noise.to_vec(),
            freedom,
            terms,
            used: self.used.clone(),
            problem,
        })
    }

    /// Degrees of freedom of the residual: real values less amplitudes, fixed part and poles.
    fn freedom(&self, fixed: &Subspace<f64>, poles: usize) -> Result<f64, Unfit> {
        let linear = fixed.rank() + 2 * poles;
        let rows = self.values.nrows();
        let lines = self.lines.count();
        if rows < linear + 2 {
            let least = linear.div_ceil(2) + 1;
            return Err(Unfit::TooFewLines { lines, least });
        }
        match ((rows - linear) * self.used.len()).checked_sub(2 * poles) {
            Some(rest) if rest > 0 => Ok(rest as f64),
            // A single column needs more lines than a pole's own unknowns.
            _ => Err(Unfit::TooFewLines {
                lines,
                least: linear.div_ceil(2) + poles + 1,
            }),
        }
    }

    /// Returns true where `terms` terms of background and the poles leave half of the lines.
    pub fn has_room(&self, poles: &[Complex64], terms: usize) -> bool {
        self.lines.count() >= 2 * (terms + 2 * poles.len()) + 2
    }

    /// Noise of each column, from the residual of its sensor.
    pub fn noise_of(&self, fit: &GroupFit) -> Vec<f64> {
        let linear = fit.problem.fixed.rank() + fit.at.amplitudes.nrows();
        let freedom = (self.values.nrows() - linear) as f64;
        let mut noise = self.by_sensor(&fit.at.residual, freedom);
        for (place, (noise, scale)) in noise.iter_mut().zip(&fit.noise).enumerate() {
            // Rounding leaves 10^-13 of the values: a smaller residual tells nothing of the sensor.
            let floor = 1e-13 * self.values.column(place).amax();
            *noise = (*noise * scale).max(floor).max(f64::MIN_POSITIVE);
        }
        noise
    }

    /// Fits from the poles and the noise of the sweep before.
    ///
    /// Terms of background are added while the data ask for them. The noise is taken from the residual.
    pub fn settled_fit(&self, poles: &[Complex64], noise: &[f64]) -> Result<GroupFit, Unfit> {
        let mut fit = self.fit(poles, 0, noise)?;
        for terms in 1..=MOST_TERMS {
            if !self.has_room(poles, terms) {
                break;
            }
            match self.fit(&fit.at.poles, terms, noise) {
                Ok(more) if fit.needs(&more) => fit = more,
                Ok(_) | Err(_) => break,
            }
        }
        let found = self.noise_of(&fit);
        // A factor common to all columns changes no weight; the residual variance contains it.
        let variance = fit.variance.max(f64::MIN_POSITIVE);
        let mut pairs = found.iter().zip(noise);
        if pairs.any(|(new, old)| ((new / old).powi(2) / variance - 1.0).abs() > NOISE_CHANGE) {
            return self.fit(&fit.at.poles, fit.terms, &found);
        }
        Ok(fit)
    }
}

/// A group of poles fitted over its band.
#[derive(Debug, Clone)]
pub(super) struct GroupFit {
    /// Poles (lines), amplitudes and residual in units of each sensor's noise.
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
    fn needs(&self, more: &GroupFit) -> bool {
        let terms = self.freedom - more.freedom;
        let gain = (self.at.square_sum - more.at.square_sum) / terms / more.variance;
        if FisherSnedecor::new(terms, more.freedom)
            .is_ok_and(|f| gain > 0.0 && f.sf(gain) < TERM_LEVEL)
        {
            return true;
        }
        let (efficient, robust) = (&self.slopes.information, &more.slopes.information);
        let (Some(efficient), Some(robust), Ok(chi_squared)) = (
            efficient.clone().try_inverse(),
            robust.clone().try_inverse(),
            ChiSquared::new(1.0),
        ) else {
            return false;
        };
        let level = TERM_LEVEL / efficient.nrows() as f64;
        (0..efficient.nrows()).any(|i| {
            let change = more.at.poles[i / 2] - self.at.poles[i / 2];
            let change = if i % 2 == 0 { change.im } else { change.re };
            let explained = (robust[(i, i)] - efficient[(i, i)]) * more.variance;
            explained > 0.0 && chi_squared.sf(change * change / explained) < level
        })
    }
}

/// Complex value in the rows (real, imaginary) of the pole at `place`.
pub(super) fn complex_row(matrix: &DMatrix<f64>, place: usize, column: usize) -> Complex64 {
    Complex64::new(matrix[(2 * place, column)], matrix[(2 * place + 1, column)])
}
