//! Poles of free decays in the time domain: the matrix pencil (Hua & Sarkar 1990) on a demodulated band,
//! refined by variable projection (Golub & Pereyra 1973, Kaufman's approximation).
//!
//! Each record is mixed down, low-pass filtered and decimated. A filter of finite length answers a
//! decaying oscillation with the same decaying oscillation wherever it lies wholly within the record;
//! only those samples are used, so that no transient enters. The rest of the record's start is lost:
//! two over the bandwidth, in seconds.
//!
//! This is a route of its own to the modes of free decays, for tests: it shares no code with the crate.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use num_complex::Complex64;

/// Reason why a matrix pencil is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MatrixPencilError {
    /// The band does not fit the sample rate.
    #[error(
        "the band {low} to {high} Hz does not fit a sample rate of {sample_rate} Hz: its upper end must lie above its lower end and below half the rate"
    )]
    Band {
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
        /// Sample rate (Hz).
        sample_rate: f64,
    },
    /// Too little signal for the band.
    #[error(
        "{samples} samples leave {left} of the band {low} to {high} Hz once its filter has settled, and {least} are needed: widen the band or give longer records"
    )]
    TooShort {
        /// Samples of the shortest record.
        samples: usize,
        /// Samples left at the band's own rate.
        left: usize,
        /// Least number of them.
        least: usize,
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
    },
}

/// Settings of the search for poles in free decays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatrixPencilSettings {
    /// Most poles before the selection. 12: a band around a few modes holds no more.
    pub most_poles: usize,
    /// Decay (1/s) that an exponential window has added; taken out of each pole. 0.
    pub added_decay: f64,
    /// Least ratio of what a pole explains to the noise (dB). 13 dB, as for the polyreference fit.
    pub above_noise_db: f64,
    /// Least decay over the record (sigma T): 0.02 tells a mode from a steady tone.
    pub least_decay: f64,
    /// Least amplitude over that of the strongest pole, all records together. 1e-4: modes beyond the
    /// band, which the filter folds back by its 100 dB, stay ten times below.
    pub least_level: f64,
    /// Damping ratio from which on a pole is no mode. 0.2.
    pub most_damping: f64,
}

impl Default for MatrixPencilSettings {
    fn default() -> Self {
        MatrixPencilSettings {
            most_poles: 12,
            added_decay: 0.0,
            above_noise_db: 13.0,
            least_decay: 0.02,
            least_level: 1e-4,
            most_damping: 0.2,
        }
    }
}

/// A decaying oscillation common to all records.
#[derive(Debug, Clone, PartialEq)]
pub struct PencilPole {
    /// Natural frequency (Hz), |p|/(2 pi).
    pub frequency: f64,
    /// Damping ratio, -Re p/|p|.
    pub damping_ratio: f64,
    /// Standard deviation of the frequency (Hz): of the last step of least squares, for white noise.
    pub frequency_std: f64,
    /// Standard deviation of the damping ratio.
    pub damping_std: f64,
    /// A of each record, which is Re(A e^{pt}) with t from its start (unit of the records).
    pub amplitudes: Vec<Complex64>,
}

/// Least samples at the band's own rate: a pencil a third as long still holds several poles.
const LEAST_SAMPLES: usize = 24;
/// Complex rate of the decimated samples over the bandwidth. 2.5: the filter then settles within two
/// over the bandwidth, and noise in its transition, folded, stays nearly white.
const OVERSAMPLING: f64 = 2.5;
/// Steps of the refinement; two suffice from a pencil's poles.
const REFINEMENTS: usize = 4;

/// Least part of an oscillation that is its own beside the others', relative to its length.
const INDEPENDENT: f64 = 1e-9;

/// Records at the band's own rate, around its centre.
struct Demodulated {
    /// A column for each record.
    records: DMatrix<Complex64>,
    /// Time of each sample from the record's start (s).
    times: Vec<f64>,
    rate: f64,
    centre: f64,
}

/// Finds the poles that `columns` (free decays of all taps and sensors, equally sampled from the same moment
/// of their taps on) share within `band` (Hz), ascending in frequency.
///
/// The number of poles follows from the singular values by the minimum description length of Wax &
/// Kailath (1985); then poles that grow, lie outside the band, or explain nothing that the others do
/// not are dropped, and the rest is refined.
///
/// # Errors
/// [`MatrixPencilError::Band`] for a band outside 0 to half the rate, [`MatrixPencilError::TooShort`]
/// where the filter of the band leaves too few samples.
pub fn pencil_poles(
    columns: &[&[f64]],
    sample_rate: f64,
    band: (f64, f64),
    settings: &MatrixPencilSettings,
) -> Result<Vec<PencilPole>, MatrixPencilError> {
    let data = Demodulated::new(columns, sample_rate, band.0, band.1)?;
    let duration = data.times.last().copied().unwrap_or(0.0);
    let mut shifts = data.subspace_poles(settings.most_poles);
    // A pole outside the band, or one that grows a little, still describes what is there: the others
    // are refined beside it, and it is left out at the end.
    shifts.retain(|shift| shift.is_finite() && shift.re * duration < 3.0);
    shifts = data.needed(shifts, settings);
    let mut variances = None;
    for _ in 0..REFINEMENTS {
        variances = data.refine(&mut shifts);
    }
    shifts = data.needed(shifts, settings);
    if variances.as_ref().map(Vec::len) != Some(shifts.len()) {
        variances = data.refine(&mut shifts);
    }
    let mut found: Vec<PencilPole> = Vec::new();
    for (index, variance) in variances.unwrap_or_default().into_iter().enumerate() {
        let pole = shifts[index] + Complex64::new(settings.added_decay, TAU * data.centre);
        // The window's decay does not make a steady tone a mode.
        let decays = -pole.re * duration >= settings.least_decay;
        let inside = (band.0..=band.1).contains(&(pole.im / TAU));
        if !decays || !inside || -pole.re >= settings.most_damping * pole.norm() {
            continue;
        }
        let Some(part) = data.explained(&shifts, index) else {
            continue;
        };
        let std = variance.sqrt();
        found.push(PencilPole {
            frequency: pole.norm() / TAU,
            damping_ratio: -pole.re / pole.norm(),
            frequency_std: std / TAU,
            damping_std: std / pole.norm(),
            // Mixing down leaves half of a real oscillation.
            amplitudes: part.amplitudes.iter().map(|a| 2.0 * a).collect(),
        });
    }
    let levels: Vec<f64> = found.iter().map(PencilPole::level).collect();
    let least = settings.least_level * levels.into_iter().fold(0.0, f64::max);
    found.retain(|pole| pole.level() >= least);
    found.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    Ok(found)
}

impl PencilPole {
    /// Root of the sum of squares of the amplitudes.
    fn level(&self) -> f64 {
        let squares = self.amplitudes.iter().map(Complex64::norm_sqr);
        squares.sum::<f64>().sqrt()
    }
}

/// Contribution of one pole to the records.
struct Explained {
    /// Amplitude in each record.
    amplitudes: Vec<Complex64>,
    /// Sum of squares that the pole alone explains over the noise variance, mean over the records.
    above_noise: f64,
}

/// Most columns of the Hankel matrix; beyond, cost grows and accuracy does not.
const MOST_COLUMNS: usize = 80;

impl Demodulated {
    fn new(
        columns: &[&[f64]],
        sample_rate: f64,
        low: f64,
        high: f64,
    ) -> Result<Self, MatrixPencilError> {
        if !(low >= 0.0 && low < high && high < 0.5 * sample_rate) {
            return Err(MatrixPencilError::Band {
                low,
                high,
                sample_rate,
            });
        }
        let samples = columns.iter().map(|column| column.len()).min().unwrap_or(0);
        let (centre, width) = (0.5 * (low + high), high - low);
        let factor = ((sample_rate / (OVERSAMPLING * width)) as usize).max(1);
        let decimator = Decimator::new(sample_rate, centre, width, factor);
        let delay = decimator.delay();
        // Output m is centred on sample m factor - delay; the filter reaches `delay` to either side.
        let whole = (2 * delay).div_ceil(factor)..samples.div_ceil(factor);
        if whole.len() < LEAST_SAMPLES {
            return Err(MatrixPencilError::TooShort {
                samples,
                left: whole.len(),
                least: LEAST_SAMPLES,
                low,
                high,
            });
        }
        let zoomed: Vec<DVector<Complex64>> = columns
            .iter()
            .map(|column| DVector::from_vec(decimator.run(&column[..samples])))
            .collect();
        Ok(Demodulated {
            records: DMatrix::from_columns(&zoomed)
                .rows_range(whole.clone())
                .into_owned(),
            times: whole
                .map(|m| (m * factor - delay) as f64 / sample_rate)
                .collect(),
            rate: sample_rate / factor as f64,
            centre,
        })
    }

    /// Returns a column e^{qt} for each pole, then a column t e^{qt} for each.
    fn oscillations(&self, shifts: &[Complex64]) -> DMatrix<Complex64> {
        let count = shifts.len();
        DMatrix::from_fn(self.times.len(), 2 * count, |row, k| {
            let t = self.times[row];
            let value = (shifts[k % count] * t).exp();
            if k < count { value } else { value * t }
        })
    }

    /// Returns the contribution of pole `index`; `None` with too few samples. Neighbours may move a little,
    /// as in the polyreference fit.
    fn explained(&self, shifts: &[Complex64], index: usize) -> Option<Explained> {
        let own = self.oscillations(shifts.get(index..=index)?);
        let own = own.columns(0, 1).into_owned();
        let mut neighbours = shifts.to_vec();
        neighbours.remove(index);
        let columns = self.oscillations(&neighbours);
        let loose = Subspace::new(&columns);
        let fixed = columns.columns(0, neighbours.len()).into_owned();
        let fixed = Subspace::new(&fixed);
        // Twice: poles that are nearly equal leave rounding behind.
        let rest = fixed.complement(fixed.complement(own.clone()));
        let alone = loose.complement(loose.complement(own));
        let residuals = loose.complement(loose.complement(self.records.clone()));
        let degrees = self.times.len().checked_sub(loose.columns.ncols() + 1)?;
        let (mut amplitudes, mut ratio) = (Vec::new(), 0.0);
        for (record, residual) in self.records.column_iter().zip(residuals.column_iter()) {
            amplitudes.push(rest.dotc(&record) / rest.norm_squared());
            let share = alone.dotc(&residual).norm_sqr() / alone.norm_squared();
            let unexplained = (residual.norm_squared() - share).max(0.0);
            // Rounding stands for the noise where there is none.
            let rounding = (f64::EPSILON * record.norm()).powi(2) / record.len().max(1) as f64;
            let variance = (unexplained / degrees.max(1) as f64).max(rounding);
            ratio += share / variance.max(f64::MIN_POSITIVE);
        }
        Some(Explained {
            amplitudes,
            above_noise: ratio / self.records.ncols() as f64,
        })
    }

    /// Drops the pole that explains least, as long as one explains less than the limit.
    fn needed(
        &self,
        mut shifts: Vec<Complex64>,
        settings: &MatrixPencilSettings,
    ) -> Vec<Complex64> {
        let least = 10f64.powf(0.1 * settings.above_noise_db);
        loop {
            let ratios = (0..shifts.len())
                .map(|index| (self.explained(&shifts, index)).map_or(0.0, |part| part.above_noise));
            match ratios.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((index, ratio)) if ratio < least => shifts.remove(index),
                _ => return shifts,
            };
        }
    }

    /// Takes one step of variable projection over all records. Returns the variance of either part of each
    /// pole.
    ///
    /// With the amplitudes eliminated, the residual of record c changes by -P A_ck t e^{q_k t} dq_k, where P
    /// takes out what the oscillations explain; the variance of real and imaginary part is half the
    /// diagonal of the inverse normal matrix.
    fn refine(&self, shifts: &mut [Complex64]) -> Option<Vec<f64>> {
        let count = shifts.len();
        let columns = self.oscillations(shifts);
        let basis = Subspace::new(&columns.columns(0, count).into_owned());
        let slopes = basis.complement(columns.columns(count, count).into_owned());
        let residuals = basis.complement(self.records.clone());
        let degrees = self.times.len().checked_sub(2 * count).filter(|&d| d > 0)?;
        let amplitudes: Vec<Vec<Complex64>> = (0..count)
            .map(|index| Some(self.explained(shifts, index)?.amplitudes))
            .collect::<Option<_>>()?;
        let products = slopes.ad_mul(&slopes);
        let with_residuals = slopes.ad_mul(&residuals);
        let mut normal = DMatrix::<Complex64>::zeros(count, count);
        let mut right = DVector::<Complex64>::zeros(count);
        for (c, residual) in residuals.column_iter().enumerate() {
            let variance = residual.norm_squared().max(f64::MIN_POSITIVE) / degrees as f64;
            for i in 0..count {
                let amplitude = amplitudes[i][c].conj() / variance;
                right[i] += amplitude * with_residuals[(i, c)];
                for j in 0..count {
                    normal[(i, j)] += amplitude * amplitudes[j][c] * products[(i, j)];
                }
            }
        }
        let inverse = normal.try_inverse()?;
        let steps = &inverse * right;
        for (shift, step) in shifts.iter_mut().zip(steps.iter()) {
            *shift += step;
        }
        Some((0..count).map(|k| 0.5 * inverse[(k, k)].re).collect())
    }

    /// Returns the poles of the signal subspace, relative to the band's centre (1/s).
    ///
    /// Rows of the Hankel matrices of all records are sums of (1, z, ..., z^L); the leading eigenvectors of
    /// H^H H span their conjugates, and shifting them by one row turns them by conj(z).
    fn subspace_poles(&self, most: usize) -> Vec<Complex64> {
        let count = self.times.len();
        let size = (count / 3).min(MOST_COLUMNS) + 1;
        let rows = count + 1 - size;
        let gram = DMatrix::from_fn(size, size, |i, j| {
            self.records.rows(i, rows).dotc(&self.records.rows(j, rows))
        });
        let eigen = SymmetricEigen::new(gram);
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let values: Vec<f64> = order.iter().map(|&k| eigen.eigenvalues[k]).collect();
        let signals = number_of_signals(&values, self.records.ncols() * rows);
        let poles = signals.min(most).min(size - 2);
        if poles == 0 {
            return Vec::new();
        }
        let basis = DMatrix::from_fn(size, poles, |row, k| eigen.eigenvectors[(row, order[k])]);
        let (upper, lower) = (basis.rows(0, size - 1), basis.rows(1, size - 1));
        let square = upper.ad_mul(&upper);
        let Some(shift) = square.lu().solve(&upper.ad_mul(&lower)) else {
            return Vec::new();
        };
        shift.eigenvalues().map_or_else(Vec::new, |roots| {
            roots.iter().map(|z| z.conj().ln() * self.rate).collect()
        })
    }
}

/// Returns the number of signals k with the least description length
/// -n (m - k) ln(geometric/arithmetic mean of the m - k smallest) + k (2m - k)/2 ln n.
fn number_of_signals(values: &[f64], rows: usize) -> usize {
    // Rounding of the sums stands below all noise.
    let floor = values.first().copied().unwrap_or(0.0) * 1e-15;
    let (size, samples) = (values.len() as f64, rows as f64);
    let (mut best, mut shortest) = (0, f64::INFINITY);
    for signals in 0..values.len() - 1 {
        let rest: Vec<f64> = values[signals..].iter().map(|v| v.max(floor)).collect();
        let (count, k) = (rest.len() as f64, signals as f64);
        let mean = rest.iter().sum::<f64>() / count;
        let logarithm = rest.iter().map(|v| v.ln()).sum::<f64>() / count;
        let length =
            samples * count * (mean.ln() - logarithm) + 0.5 * k * (2.0 * size - k) * samples.ln();
        if length < shortest {
            (best, shortest) = (signals, length);
        }
    }
    best
}

/// The space that some columns span, as orthonormal columns.
struct Subspace {
    columns: DMatrix<Complex64>,
}

impl Subspace {
    /// Orthonormalises columns by Gram and Schmidt's method. A column is left out where less than
    /// [`INDEPENDENT`] of its length lies outside the columns before it.
    fn new(raw: &DMatrix<Complex64>) -> Self {
        let mut kept: Vec<DVector<Complex64>> = Vec::new();
        for column in raw.column_iter() {
            let length = column.norm();
            if length.is_nan() || length <= 0.0 {
                continue;
            }
            let mut rest = column.unscale(length);
            // The second pass removes the rounding of nearly dependent columns.
            for _ in 0..2 {
                for other in &kept {
                    let share = other.dotc(&rest);
                    rest.axpy(-share, other, Complex64::ONE);
                }
            }
            let remains = rest.norm();
            if remains > INDEPENDENT && kept.len() + 1 < raw.nrows() {
                kept.push(rest.unscale(remains));
            }
        }
        let columns = DMatrix::from_fn(raw.nrows(), kept.len(), |row, k| kept[k][row]);
        Subspace { columns }
    }

    /// Returns columns without their projections on the space.
    fn complement(&self, columns: DMatrix<Complex64>) -> DMatrix<Complex64> {
        &columns - &self.columns * self.columns.ad_mul(&columns)
    }
}

/// Mixing down, filtering and decimating, as an analyser's zoom does. Output m is at time
/// (m * factor - delay)/sample_rate from the record's start.
struct Decimator {
    /// Cycles of the mixing oscillator per sample.
    turn: f64,
    filter: Vec<f64>,
    factor: usize,
}

impl Decimator {
    /// Mixes down by `centre` (Hz) and decimates by `factor`, so that `width` (Hz) around it survives.
    fn new(sample_rate: f64, centre: f64, width: f64, factor: usize) -> Self {
        let stop = sample_rate / factor as f64 - width / 2.0;
        Decimator {
            turn: centre / sample_rate,
            filter: low_pass(width / 2.0, stop, sample_rate),
            factor,
        }
    }

    /// Samples by which the first output lies before the record's start.
    fn delay(&self) -> usize {
        self.filter.len() / 2
    }

    /// The record decimated, taken as zero outside its ends.
    fn run(&self, samples: &[f64]) -> Vec<Complex64> {
        let mixed: Vec<Complex64> = (samples.iter().enumerate())
            .map(|(n, x)| Complex64::from_polar(*x, -TAU * (self.turn * n as f64).fract()))
            .collect();
        (0..(samples.len() + 2 * self.delay()).div_ceil(self.factor))
            .map(|m| {
                let mut sum = Complex64::ZERO;
                for (k, tap) in self.filter.iter().enumerate() {
                    let index = (m * self.factor + k).checked_sub(2 * self.delay());
                    if let Some(x) = index.and_then(|index| mixed.get(index)) {
                        sum += x * tap;
                    }
                }
                sum
            })
            .collect()
    }
}

/// Low-pass with Kaiser's window: pass band up to `pass`, stop band of -100 dB from `stop` (both Hz).
fn low_pass(pass: f64, stop: f64, sample_rate: f64) -> Vec<f64> {
    const STOP_BAND_DB: f64 = 100.0;
    let transition = TAU * (stop - pass) / sample_rate;
    let half = ((STOP_BAND_DB - 7.95) / (2.285 * transition) / 2.0).ceil() as i64;
    let cut_off = PI * (pass + stop) / sample_rate;
    let taps: Vec<f64> = (-half..=half)
        .map(|n| {
            let sinc = if n == 0 {
                cut_off / PI
            } else {
                (cut_off * n as f64).sin() / (PI * n as f64)
            };
            let edge = n as f64 / (half as f64 + 1.0);
            sinc * bessel_i0(0.1102 * (STOP_BAND_DB - 8.7) * (1.0 - edge * edge).sqrt())
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    taps.iter().map(|tap| tap / sum).collect()
}

/// Modified Bessel function I0, the sum of ((x/2)^k/k!)^2.
fn bessel_i0(x: f64) -> f64 {
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > sum * 1e-17 {
        term *= (x / (2.0 * k)).powi(2);
        sum += term;
        k += 1.0;
    }
    sum
}
