//! The fit of one group of modes over its band.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::Unfit;
use super::band;
use super::data::ModalData;
use super::function::{Lines, STEADY};
use super::kernel::{Evaluation, Fixed, Problem, Slopes, StopReason};

/// What is known of a mode that is not in the group.
#[derive(Debug, Clone)]
pub(super) struct Neighbour {
    /// Its pole (lines).
    pub pole: Complex64,
    /// Its amplitude in every column, once it has been fitted.
    pub amplitudes: Option<Vec<Complex64>>,
}

/// The lines of a group's band without what distant modes add, and the functions of the near ones.
pub(super) struct Local<'a> {
    pub data: &'a ModalData,
    pub lines: Lines,
    /// Indices of the columns that hold anything.
    pub used: Vec<usize>,
    values: DMatrix<f64>,
    near: Vec<Complex64>,
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
    /// Real columns of the fixed part.
    pub fixed: Fixed,
    /// Lines of the band.
    pub lines: Lines,
    /// Columns in units of noise, the fixed part taken out.
    pub columns: DMatrix<f64>,
}

impl<'a> Local<'a> {
    /// Takes the band of `poles` (lines) out of the data. Neighbours that were fitted and lie outside
    /// are subtracted; those inside, or not half a band away, keep free amplitudes. `steady` are the
    /// positions of undamped lines (lines). Of the band `most` lines are taken at most.
    pub fn new(
        data: &'a ModalData,
        (poles, neighbours): (&[Complex64], &[Neighbour]),
        steady: &[f64],
        most: usize,
    ) -> Result<Self, Unfit> {
        let (low, high) = band::reach(poles);
        let (first, end) = band::within(data, (low, high));
        // Two complex lines for a pole's two parts and its amplitude, and one to see a misfit.
        let least = 2 * poles.len() + 1;
        if end < first + least {
            return Err(Unfit::TooFewLines {
                lines: end - first,
                least,
            });
        }
        let lines = Lines::new(data, (first, end), most.max(least));
        let margin = 0.25 * (high - low);
        let inside = |position: f64| (low - margin..=high + margin).contains(&position);
        let (near, far): (Vec<&Neighbour>, Vec<&Neighbour>) =
            neighbours.iter().partition(|other| inside(other.pole.im));
        let mut near: Vec<Complex64> = near.iter().map(|other| other.pole).collect();
        let hum = steady.iter().filter(|&&position| inside(position));
        near.extend(hum.map(|&position| Complex64::new(-STEADY, position)));
        let mut local = Local {
            data,
            lines,
            used: Vec::new(),
            values: DMatrix::zeros(0, 0),
            near,
        };
        local.fill(&far);
        if local.used.is_empty() {
            return Err(Unfit::NoSignal);
        }
        Ok(local)
    }

    /// Stacks real over imaginary parts of every column that is not zero throughout.
    fn fill(&mut self, far: &[&Neighbour]) {
        let (first, stride) = (self.lines.first, self.lines.stride);
        let count = self.lines.count();
        let columns = self.data.columns();
        let holds = |&index: &usize| {
            let mut values = columns[index].values[first..].iter().step_by(stride);
            values
                .by_ref()
                .take(count)
                .any(|value| value.norm_sqr() > 0.0)
        };
        self.used = (0..columns.len()).filter(holds).collect();
        let used = &self.used;
        self.values = DMatrix::from_fn(2 * count, used.len(), |row, place| {
            let value = columns[used[place]].values[first + stride * (row % count)];
            if row < count { value.re } else { value.im }
        });
        let poles: Vec<Complex64> = far.iter().map(|other| other.pole).collect();
        let amplitudes = DMatrix::from_fn(2 * far.len(), used.len(), |row, place| {
            let known = far[row / 2].amplitudes.as_ref();
            let value = known.map_or(Complex64::ZERO, |all| all[used[place]]);
            if row % 2 == 0 { value.re } else { value.im }
        });
        self.values -= self.lines.model(&poles) * amplitudes;
    }

    /// rms of each sensor's columns, as a first scale; the same for all columns of a sensor.
    pub fn scale(&self) -> Vec<f64> {
        let freedom = self.values.nrows() as f64;
        self.by_sensor(&self.values, freedom)
    }

    /// Root of the mean square of the columns of each sensor, given to all its columns; `freedom` are
    /// the degrees of freedom of one column.
    fn by_sensor(&self, columns: &DMatrix<f64>, freedom: f64) -> Vec<f64> {
        let sensor = |place: usize| self.data.columns()[self.used[place]].sensor;
        let places = 0..self.used.len();
        let one = |place: usize| {
            let mates = places.clone().filter(|&p| sensor(p) == sensor(place));
            let (sum, count) = mates.fold((0.0, 0.0), |(sum, count), p| {
                (sum + columns.column(p).norm_squared(), count + 1.0)
            });
            (sum / (count * freedom)).sqrt()
        };
        places.clone().map(one).collect()
    }

    /// Fixed part with `terms` terms of background.
    fn fixed(&self, terms: usize) -> Fixed {
        let near = self.lines.model(&self.near);
        let background = self.lines.polynomial(terms);
        let split = near.ncols();
        let raw = DMatrix::from_fn(near.nrows(), split + background.ncols(), |row, column| {
            if column < split {
                near[(row, column)]
            } else {
                background[(row, column - split)]
            }
        });
        Fixed::new(&raw)
    }

    /// Fixed part, and the columns in units of `noise` without it.
    fn prepare(&self, terms: usize, noise: &[f64]) -> (Fixed, DMatrix<f64>) {
        let fixed = self.fixed(terms);
        let mut columns = self.values.clone();
        for (mut column, noise) in columns.column_iter_mut().zip(noise) {
            column /= *noise;
        }
        fixed.project(&mut columns);
        (fixed, columns)
    }

    /// Sum of the squares of the residual with the pole at `place` put at each of `tries`.
    pub fn square_sums(
        &self,
        poles: &[Complex64],
        place: usize,
        tries: &[Complex64],
        (terms, noise): (usize, &[f64]),
    ) -> Vec<Option<f64>> {
        let (fixed, columns) = self.prepare(terms, noise);
        let problem = Problem {
            lines: &self.lines,
            fixed: &fixed,
            columns,
        };
        let mut poles = poles.to_vec();
        let sum = |&pole: &Complex64| {
            poles[place] = pole;
            problem.evaluate(&poles).map(|at| at.square_sum)
        };
        tries.iter().map(sum).collect()
    }

    /// Sum of the squares without any pole.
    pub fn square_sum_without(&self, terms: usize, noise: &[f64]) -> f64 {
        self.prepare(terms, noise).1.norm_squared()
    }

    /// Fits from `start` with `terms` terms of background and given noise of the columns (any scale).
    pub fn fit(&self, start: &[Complex64], terms: usize, noise: &[f64]) -> Result<GroupFit, Unfit> {
        const MOST_STEPS: usize = 30;
        let (fixed, columns) = self.prepare(terms, noise);
        let freedom = self.freedom(&fixed, start.len())?;
        let problem = Problem {
            lines: &self.lines,
            fixed: &fixed,
            columns,
        };
        let (at, stop) = problem
            .search(start, freedom, MOST_STEPS)
            .ok_or(Unfit::NotIndependent)?;
        let slopes = problem.slopes(&at);
        let columns = problem.columns;
        Ok(GroupFit {
            variance: at.square_sum / freedom,
            at,
            slopes,
            stop,
            noise: noise.to_vec(),
            freedom,
            terms,
            used: self.used.clone(),
            fixed,
            lines: self.lines.clone(),
            columns,
        })
    }

    /// Degrees of freedom of the residual: real values less amplitudes, fixed part and poles. Lines
    /// denser than the resolution count for what they are worth.
    fn freedom(&self, fixed: &Fixed, poles: usize) -> Result<f64, Unfit> {
        let linear = fixed.rank() + 2 * poles;
        let rows = self.values.nrows();
        if rows < linear + 2 {
            return Err(Unfit::TooFewLines {
                lines: self.lines.count(),
                least: linear.div_ceil(2) + 1,
            });
        }
        let values = (rows - linear) * self.used.len();
        // A single column needs more lines than a pole's own unknowns.
        match values.checked_sub(2 * poles) {
            Some(rest) if rest > 0 => Ok(rest as f64),
            _ => Err(Unfit::TooFewLines {
                lines: self.lines.count(),
                least: linear.div_ceil(2) + poles + 1,
            }),
        }
    }

    /// Whether the lines bear `terms` terms of background beside the poles: half of them are left.
    pub fn has_room(&self, poles: &[Complex64], terms: usize) -> bool {
        self.lines.count() >= 2 * (terms + 2 * poles.len()) + 2
    }

    /// Noise of each column as the residual of its sensor shows it.
    pub fn noise_of(&self, fit: &GroupFit) -> Vec<f64> {
        let linear = fit.fixed.rank() + fit.at.amplitudes.nrows();
        let freedom = (self.values.nrows() - linear) as f64;
        let own = self.by_sensor(&fit.at.residual, freedom);
        // Rounding leaves 10^-13 of the values: below that a residual says nothing about the sensor.
        let floor = |place: usize| 1e-13 * self.values.column(place).amax();
        own.iter()
            .zip(&fit.noise)
            .enumerate()
            .map(|(place, (own, scale))| (own * scale).max(floor(place)).max(f64::MIN_POSITIVE))
            .collect()
    }
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

    /// Amplitude of the pole at `place` in every column of the data (its unit); zero where a column
    /// was not used.
    pub fn amplitudes(&self, place: usize, columns: usize) -> Vec<Complex64> {
        let mut all = vec![Complex64::ZERO; columns];
        for (index, (&column, noise)) in self.used.iter().zip(&self.noise).enumerate() {
            let real = self.at.amplitudes[(2 * place, index)];
            let imaginary = self.at.amplitudes[(2 * place + 1, index)];
            all[column] = Complex64::new(real, imaginary) * *noise;
        }
        all
    }
}
