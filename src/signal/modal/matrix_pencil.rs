//! Poles of free decays in the time domain: the matrix pencil (Hua & Sarkar 1990) on a demodulated band,
//! refined by variable projection (Golub & Pereyra 1973, Kaufman's approximation).
//!
//! Each record is mixed down, low-pass filtered and decimated. A filter of finite length answers a
//! decaying oscillation with the same decaying oscillation wherever it lies wholly within the record;
//! only those samples are used, so that no transient enters. The rest of the record's start is lost:
//! two over the bandwidth, in seconds.
//!
//! Poles from the signal subspace of Hankel matrices, and how many there are.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, SymmetricEigen};
use num_complex::Complex64;

use super::projection::{Basis, conjugate_product, norm};
use crate::spectral::Decimator;

/// What makes a matrix pencil impossible.
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

/// How poles are sought in free decays.
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
    /// The pole (1/s), imaginary part positive, decay of an exponential window taken out.
    pub pole: Complex64,
    /// Natural frequency (Hz), |p|/(2 pi).
    pub frequency: f64,
    /// Damping ratio, -Re p/|p|.
    pub damping_ratio: f64,
    /// Standard deviation of the frequency (Hz): of the last step of least squares, for white noise.
    pub frequency_std: f64,
    /// The same of the damping ratio.
    pub damping_std: f64,
    /// A of each record, which is Re(A e^{pt}) with t from its start (unit of the records).
    pub amplitudes: Vec<Complex64>,
    /// Sum of squares that the pole explains over the noise variance (dB), mean over the records.
    pub above_noise_db: f64,
}

/// Least samples at the band's own rate: a pencil a third as long still holds several poles.
const LEAST_SAMPLES: usize = 24;
/// Complex rate of the decimated samples over the bandwidth. 2.5: the filter then settles within two
/// over the bandwidth, and noise in its transition, folded, stays nearly white.
const OVERSAMPLING: f64 = 2.5;
/// Steps of the refinement; two suffice from a pencil's poles.
const REFINEMENTS: usize = 4;

/// Records at the band's own rate, around its centre.
pub(super) struct Demodulated {
    columns: Vec<Vec<Complex64>>,
    /// Time of each sample from the record's start (s).
    times: Vec<f64>,
    rate: f64,
    centre: f64,
}

/// Poles that `columns` (free decays of all taps and sensors, equally sampled from the same moment of
/// their taps on) share within `band` (Hz), ascending in frequency.
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
    let data = demodulate(columns, sample_rate, band)?;
    let duration = data.times.last().copied().unwrap_or(0.0);
    let centre = Complex64::new(0.0, TAU * data.centre);
    // The window's decay does not make a steady tone a mode.
    let usable = |shift: &Complex64| {
        let pole = shift + centre + settings.added_decay;
        let decays = -pole.re * duration >= settings.least_decay;
        let inside = (band.0..=band.1).contains(&(pole.im / TAU));
        decays && inside && -pole.re < settings.most_damping * pole.norm()
    };
    let mut shifts = subspace_poles(&data, settings.most_poles);
    // A pole outside the band, or one that grows a little, still describes what is there: the others
    // are refined beside it, and it is left out at the end.
    shifts.retain(|shift| shift.is_finite() && shift.re * duration < 3.0);
    shifts = needed(&data, shifts, settings);
    let mut covariance = None;
    for _ in 0..REFINEMENTS {
        covariance = refine(&data, &mut shifts);
    }
    shifts = needed(&data, shifts, settings);
    if covariance.as_ref().map(Vec::len) != Some(shifts.len()) {
        covariance = refine(&data, &mut shifts);
    }
    let variances = covariance.unwrap_or_default();
    let mut found: Vec<PencilPole> = (0..shifts.len())
        .filter(|&index| usable(&shifts[index]))
        .filter_map(|index| {
            let variance = *variances.get(index)?;
            let part = explained(&data, &shifts, index)?;
            Some(pole_of(shifts[index] + centre, variance, part, settings))
        })
        .collect();
    let level = |pole: &PencilPole| norm(&pole.amplitudes);
    let strongest = found.iter().map(level).fold(0.0, f64::max);
    found.retain(|pole| level(pole) >= settings.least_level * strongest);
    found.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    Ok(found)
}

fn pole_of(
    seen: Complex64,
    variance: f64,
    (amplitudes, above_noise): (Vec<Complex64>, f64),
    settings: &MatrixPencilSettings,
) -> PencilPole {
    let pole = seen + settings.added_decay;
    let std = variance.sqrt();
    PencilPole {
        pole,
        frequency: pole.norm() / TAU,
        damping_ratio: -pole.re / pole.norm(),
        frequency_std: std / TAU,
        damping_std: std / pole.norm(),
        // Mixing down leaves half of a real oscillation.
        amplitudes: amplitudes.iter().map(|a| 2.0 * a).collect(),
        above_noise_db: 10.0 * above_noise.log10(),
    }
}

fn demodulate(
    columns: &[&[f64]],
    sample_rate: f64,
    (low, high): (f64, f64),
) -> Result<Demodulated, MatrixPencilError> {
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
    let mut times = Vec::new();
    let mut shifted = Vec::with_capacity(columns.len());
    let decimator = Decimator::new(sample_rate, centre, width, factor, samples);
    let delay = decimator.delay();
    for column in columns {
        let zoomed = decimator.run(&column[..samples]);
        // Output m is centred on sample m factor - delay; the filter reaches `delay` to either side.
        let whole = |m: &usize| {
            let reach = m * factor;
            reach >= 2 * delay && reach < samples
        };
        let kept: Vec<usize> = (0..zoomed.len()).filter(whole).collect();
        times = kept
            .iter()
            .map(|&m| (m * factor - delay) as f64 / sample_rate)
            .collect();
        shifted.push(kept.iter().map(|&m| zoomed[m]).collect());
    }
    if times.len() < LEAST_SAMPLES {
        return Err(MatrixPencilError::TooShort {
            samples,
            left: times.len(),
            least: LEAST_SAMPLES,
            low,
            high,
        });
    }
    Ok(Demodulated {
        columns: shifted,
        times,
        rate: sample_rate / factor as f64,
        centre,
    })
}

/// e^{qt}, or its derivative t e^{qt}.
fn oscillation(data: &Demodulated, shift: Complex64, power: i32) -> Vec<Complex64> {
    let times = data.times.iter();
    times.map(|&t| (shift * t).exp() * t.powi(power)).collect()
}

/// Amplitude of pole `index` in each record, and the mean ratio of the sum of squares that it alone
/// explains to the noise variance; neighbours may move a little, as in the polyreference fit.
fn explained(
    data: &Demodulated,
    shifts: &[Complex64],
    index: usize,
) -> Option<(Vec<Complex64>, f64)> {
    let mut others = Basis::new(2);
    for (other, &shift) in shifts.iter().enumerate() {
        if other != index {
            others.add(oscillation(data, shift, 0));
        }
    }
    let own = oscillation(data, *shifts.get(index)?, 0);
    let rest = others.rest(own.clone());
    let mut loose = others.clone();
    for (other, &shift) in shifts.iter().enumerate() {
        if other != index {
            loose.add(oscillation(data, shift, 1));
        }
    }
    let alone = loose.rest(own);
    let degrees = data.times.len().checked_sub(loose.columns.len() + 1)?;
    let (mut amplitudes, mut ratio) = (Vec::new(), 0.0);
    for column in &data.columns {
        amplitudes.push(conjugate_product(&rest, column) / norm(&rest).powi(2));
        let left = loose.rest(column.clone());
        let share = conjugate_product(&alone, &left).norm_sqr() / norm(&alone).powi(2);
        let variance = (norm(&left).powi(2) - share).max(0.0) / degrees.max(1) as f64;
        ratio += share / variance.max(rounding_of(column)).max(f64::MIN_POSITIVE);
    }
    Some((amplitudes, ratio / data.columns.len() as f64))
}

/// Variance that rounding alone leaves.
fn rounding_of(column: &[Complex64]) -> f64 {
    (f64::EPSILON * norm(column)).powi(2) / column.len().max(1) as f64
}

/// Drops the pole that explains least, as long as one explains less than the limit.
fn needed(
    data: &Demodulated,
    mut shifts: Vec<Complex64>,
    settings: &MatrixPencilSettings,
) -> Vec<Complex64> {
    let least = 10f64.powf(0.1 * settings.above_noise_db);
    loop {
        let weakest = (0..shifts.len())
            .map(|index| {
                let part = explained(data, &shifts, index);
                (index, part.map_or(0.0, |(_, ratio)| ratio))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match weakest {
            Some((index, ratio)) if ratio < least => shifts.remove(index),
            _ => return shifts,
        };
    }
}

/// One step of variable projection over all records, and the variance of either part of each pole.
///
/// With the amplitudes eliminated, the residual of record c changes by -P A_ck t e^{q_k t} dq_k, where P
/// takes out what the oscillations explain; the variance of real and imaginary part is half the
/// diagonal of the inverse normal matrix.
fn refine(data: &Demodulated, shifts: &mut [Complex64]) -> Option<Vec<f64>> {
    let count = shifts.len();
    let mut basis = Basis::new(2);
    for &shift in shifts.iter() {
        basis.add(oscillation(data, shift, 0));
    }
    let slopes: Vec<Vec<Complex64>> = shifts
        .iter()
        .map(|&shift| basis.rest(oscillation(data, shift, 1)))
        .collect();
    let degrees = data.times.len().checked_sub(2 * count).filter(|&d| d > 0)?;
    let mut normal = DMatrix::<Complex64>::zeros(count, count);
    let mut right = DMatrix::<Complex64>::zeros(count, 1);
    let parts: Option<Vec<Vec<Complex64>>> = (0..count)
        .map(|index| explained(data, shifts, index).map(|(amplitudes, _)| amplitudes))
        .collect();
    let parts = parts?;
    for (c, column) in data.columns.iter().enumerate() {
        let left = basis.rest(column.clone());
        let variance = norm(&left).powi(2).max(f64::MIN_POSITIVE) / degrees as f64;
        for i in 0..count {
            let amplitude = parts[i][c];
            right[(i, 0)] += amplitude.conj() * conjugate_product(&slopes[i], &left) / variance;
            for j in 0..count {
                let product = conjugate_product(&slopes[i], &slopes[j]) / variance;
                normal[(i, j)] += amplitude.conj() * parts[j][c] * product;
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

/// Most columns of the Hankel matrix; beyond, cost grows and accuracy does not.
const MOST_COLUMNS: usize = 80;
/// Poles from the signal subspace, relative to the band's centre (1/s).
///
/// Rows of the Hankel matrices of all records are sums of (1, z, ..., z^L); the leading eigenvectors of
/// H^H H span their conjugates, and shifting them by one row turns them by conj(z).
fn subspace_poles(data: &Demodulated, most: usize) -> Vec<Complex64> {
    let count = data.times.len();
    let size = (count / 3).min(MOST_COLUMNS) + 1;
    let gram = DMatrix::from_fn(size, size, |i, j| {
        let rows = count + 1 - size;
        data.columns
            .iter()
            .map(|column| conjugate_product(&column[i..i + rows], &column[j..j + rows]))
            .sum::<Complex64>()
    });
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let values: Vec<f64> = order.iter().map(|&k| eigen.eigenvalues[k]).collect();
    let rows = data.columns.len() * (count + 1 - size);
    let poles = description_order(&values, rows).min(most).min(size - 2);
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
        roots.iter().map(|z| z.conj().ln() * data.rate).collect()
    })
}

/// Number of signals k with the least description length
/// -n (m - k) ln(geometric/arithmetic mean of the m - k smallest) + k (2m - k)/2 ln n.
fn description_order(values: &[f64], rows: usize) -> usize {
    let size = values.len();
    // Rounding of the sums stands below all noise.
    let floor = values.first().copied().unwrap_or(0.0) * 1e-15;
    let length = |signals: usize| {
        let rest = &values[signals..];
        let count = rest.len() as f64;
        let mean = rest.iter().map(|v| v.max(floor)).sum::<f64>() / count;
        let logarithm = rest.iter().map(|v| v.max(floor).ln()).sum::<f64>() / count;
        let samples = rows as f64;
        let k = signals as f64;
        samples * count * (mean.ln() - logarithm) + 0.5 * k * (2.0 * size as f64 - k) * samples.ln()
    };
    (0..size - 1)
        .min_by(|&a, &b| length(a).total_cmp(&length(b)))
        .unwrap_or(0)
}
