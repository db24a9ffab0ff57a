//! Reading each peak: on its line, and between the lines.
//!
//! Reading a resonance between the lines.
//!
//! The discrete spectrum of one decaying oscillation, cut off anywhere, is exactly rational in the
//! frequency on lines that are 1/T apart: the truncation factor 1 - e^{(p - j omega) T} is the same
//! on every one of them. (Lines denser than that, of a block longer than its signal, show the
//! truncation as a ripple of the size of what the record still has at its end.)
//! Near a resonance a single pole on a slowly varying background therefore reads the frequency far
//! below the line spacing, truncated record or not.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::mode::{ModeReading, PeakLabel, ReadBy};
use super::peaks::{CompositeLevel, Peak};
use crate::spectral::{Lines, Window};

/// Reads all `peaks` of one recording.
///
/// `spectra` are the frequency response functions of all sensors, or without a hammer the transforms
/// of all taps and sensors; they share their poles.
///
/// The line of a reading is the highest one, except where the fitted pole is nearer to another: over
/// a resonance much wider than a line, the background of other modes and noise pull the maximum
/// along its flat top, and the half-line bound would not hold.
pub fn read_peaks(
    level: &CompositeLevel,
    spectra: &[&[Complex64]],
    peaks: &[Peak],
    window: Window,
) -> Vec<ModeReading> {
    let places: Vec<usize> = peaks.iter().map(|peak| peak.index).collect();
    let one = |peak: &Peak| match window {
        Window::Hann => {
            let between = interpolate_parabola(&level.lines, &level.level_db, peak.index);
            reading(level, peak, between, None)
        }
        Window::Rectangular | Window::Exponential { .. } => {
            let room = room_around(&places, peak.index);
            let decay = window.added_decay();
            match interpolate_pole(&level.lines, spectra, peak.index, room, decay) {
                Ok(found) if is_resonance(&found, peak, level.lines.half_line()) => {
                    reading(level, peak, Some(found), None)
                }
                Err(Unfit::TooFewLines) => reading(level, peak, None, None),
                Ok(_) | Err(Unfit::PoleElsewhere) => {
                    reading(level, peak, None, Some(PeakLabel::NoResonance))
                }
            }
        }
    };
    peaks.iter().map(one).collect()
}

/// A peak that stands out by less than this (dB) must be read within its half line, or a quarter of its
/// half-power width, to count.
const CLEAR_PROMINENCE: f64 = 8.0;
/// From this height over the noise on (dB), noise does not make peaks any more.
const CLEAR_OF_NOISE: f64 = 30.0;
/// Least prominence (dB) for the same where nothing is known of the noise.
const CLEAR_WHEN_BLIND: f64 = 20.0;

/// Least decay over the record (sigma T) of a peak that is not clear of the noise. 2: a peak of noise
/// is as narrow as the record allows, and scatters about no decay at all.
const LEAST_DECAY: f64 = 2.0;

/// Whether the fitted oscillation decays beyond doubt: by two standard deviations where the peak is
/// clear of the noise; by five, and visibly over the record, where it is not.
fn is_resonance(found: &Interpolation, peak: &Peak, half_line: f64) -> bool {
    let clear = match peak.above_noise_db {
        Some(above) => above >= CLEAR_OF_NOISE,
        None => peak.prominence_db >= CLEAR_WHEN_BLIND,
    };
    let decays_by = |deviations: f64| {
        found
            .damping_ratio
            .is_some_and(|ratio| ratio > deviations * found.damping_std)
    };
    let decays = if clear {
        decays_by(2.0)
    } else {
        decays_by(5.0) && found.decay_in_record >= LEAST_DECAY
    };
    let readable = found.bound < half_line.max(0.5 * half_width(found));
    decays && (peak.prominence_db >= CLEAR_PROMINENCE || readable)
}

/// Half of the half-power width, zeta f (Hz); 0 without damping.
fn half_width(found: &Interpolation) -> f64 {
    found.damping_ratio.unwrap_or(0.0) * found.frequency
}

/// Puts a reading together. The reading between the lines counts where its bound is below the half
/// line or below half the half-power width: over a wide resonance in noise the highest line is no
/// better than that.
fn reading(
    level: &CompositeLevel,
    peak: &Peak,
    between: Option<Interpolation>,
    label: Option<PeakLabel>,
) -> ModeReading {
    let lines = &level.lines;
    let half_line = lines.half_line();
    let sharp = between.filter(|found| found.bound < half_line.max(half_width(found)));
    let line = sharp.map_or(peak.index, |found| lines.nearest(found.frequency));
    let mut reading = ModeReading {
        interpolated: sharp.map(|found| found.frequency),
        bound: sharp.map(|found| found.bound),
        damping_ratio: sharp.and_then(|found| found.damping_ratio),
        damping_std: sharp.and_then(|found| found.damping_ratio.map(|_| found.damping_std)),
        prominence_db: Some(peak.prominence_db),
        above_noise_db: peak.above_noise_db,
        label,
        ..ModeReading::on_line(lines.frequency(line), half_line)
    };
    reading.prefer(ReadBy::Interpolated);
    reading
}

/// Lines to either side of a peak that are its own: a third of the way to its neighbour.
fn room_around(places: &[usize], place: usize) -> usize {
    places
        .iter()
        .filter(|&&other| other != place)
        .map(|&other| other.abs_diff(place) / 3)
        .min()
        .unwrap_or(usize::MAX)
}

/// A frequency read between the lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// Natural frequency (Hz), undamped: the modulus of the pole over 2 pi.
    pub frequency: f64,
    /// Bound of the reading (Hz), about 95 %: the change between two sets of lines, two standard
    /// deviations of the lines' scatter about the fitted curve, and what a single pole leaves.
    pub bound: f64,
    /// Standard deviation (Hz), half the bound.
    pub std: f64,
    /// Damping ratio, the window's own decay taken out; `None` when nothing is left of it.
    pub damping_ratio: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_std: f64,
    /// Decay over the length of the signal, sigma T, the window's own included.
    pub decay_in_record: f64,
}

/// Why a peak could not be read between the lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unfit {
    /// Fewer lines than unknowns, or lines without any level: nothing is said about the peak.
    TooFewLines,
    /// The pole lies elsewhere: the peak is not that of a resonance.
    PoleElsewhere,
}

/// Lines to each side of the peak: at least two, so that five complex values stand against three
/// unknowns.
const LEAST_REACH: usize = 2;
/// So many lines to either side take part at most; of a wider resonance every second, third, ... one.
const MOST_LINES: usize = 100;
/// From this reach on the background may slope: nine complex values against four unknowns.
const SLOPING_REACH: usize = 4;
/// What a fit of one pole leaves even without noise (lines): the image at the negative frequency and
/// the curvature of the background, as seen on noise-free virtual tests.
const MODEL_ERROR: f64 = 1e-4;
/// Iterations of the weights; they settle in two.
const REWEIGHTINGS: usize = 3;

/// Fits one pole, common to all `spectra`, to the lines around `peak`.
///
/// Model: H(u) = r/(u - q) + b with u the distance from the peak in lines, q the complex pole, a
/// residue r and a background b (constant, or linear in u where there are lines enough) for every
/// spectrum; written H u = c0 + c1 u + c2 u^2 + q H and solved by least squares with the weights
/// 1/|u - q|^2 of the previous pass (Sanathanan & Koerner).
/// The lines within the half-power width, at least two to either side, take part.
/// `added_decay` is the exponential window's (1/s); `room` how many lines to either side belong to
/// this peak alone.
///
/// # Errors
/// [`Unfit`] when there are too few lines, or the pole lies farther from the peak than a line and the
/// half-power reach: the background of other modes pulls a weak peak that far, but not farther.
pub fn interpolate_pole(
    lines: &Lines,
    spectra: &[&[Complex64]],
    peak: usize,
    room: usize,
    added_decay: f64,
) -> Result<Interpolation, Unfit> {
    let half_width = half_power_reach(spectra, peak).ok_or(Unfit::TooFewLines)?;
    let reach = (half_width + 1).max(LEAST_REACH).min(room.max(LEAST_REACH));
    let fit = fit_pole(spectra, peak, reach).ok_or(Unfit::TooFewLines)?;
    let narrower = fit_pole(spectra, peak, (reach / 2).max(1)).unwrap_or(fit);
    // Resolution, not line spacing, is the measure of "near": zero padding must not tighten it.
    let line = lines.resolution().max(lines.spacing) / lines.spacing;
    if !fit.pole.is_finite() || fit.pole.re.abs() > line + half_width as f64 {
        return Err(Unfit::PoleElsewhere);
    }
    let damped = lines.frequency(peak) + fit.pole.re * lines.spacing;
    let decay = fit.pole.im * lines.spacing - added_decay / TAU;
    let frequency = damped.hypot(decay.max(0.0));
    let change = (fit.pole.re - narrower.pole.re).abs();
    let bound = (change + 2.0 * fit.std + MODEL_ERROR) * lines.spacing;
    // The bound is two standard deviations, what the model misses included; it goes for both parts
    // of the pole.
    let std = 0.5 * bound;
    Ok(Interpolation {
        frequency,
        bound,
        std,
        damping_ratio: (decay > 0.0).then(|| decay / frequency),
        damping_std: std / frequency,
        decay_in_record: TAU * fit.pole.im * lines.spacing * lines.duration,
    })
}

/// Lines from the peak to where the summed power has fallen by half, on the nearer side: on the
/// farther one a neighbour may hold it up.
fn half_power_reach(spectra: &[&[Complex64]], peak: usize) -> Option<usize> {
    let power = |line: usize| -> Option<f64> {
        spectra
            .iter()
            .map(|spectrum| spectrum.get(line).map(Complex64::norm_sqr))
            .sum()
    };
    let half = 0.5 * power(peak)?;
    let above = |line: Option<usize>| line.and_then(power).is_some_and(|p| p > half);
    let right = (1..).find(|&k| !above(Some(peak + k)))?;
    let left = (1..).find(|&k| !above(peak.checked_sub(k)))?;
    Some(left.min(right))
}

#[derive(Clone, Copy)]
struct PoleFit {
    /// Distance from the peak's line (real part) and decay/(2 pi) (imaginary part), in lines.
    pole: Complex64,
    /// Standard deviation of each part, in lines.
    std: f64,
}

fn fit_pole(spectra: &[&[Complex64]], peak: usize, reach: usize) -> Option<PoleFit> {
    // Near the ends of the axis the lines that are there must do.
    let points = spectra.iter().map(|spectrum| spectrum.len()).min()?;
    let first = peak.saturating_sub(reach);
    let last = (peak + reach).min(points.checked_sub(1)?);
    if last < first + 2 * LEAST_REACH.min(reach) {
        return None;
    }
    let stride = reach.div_ceil(MOST_LINES);
    let lines: Vec<usize> = (first..=last).step_by(stride).collect();
    let offsets: Vec<f64> = lines.iter().map(|&k| k as f64 - peak as f64).collect();
    let mut weights = vec![1.0; offsets.len()];
    let mut fit = None;
    for _ in 0..REWEIGHTINGS {
        let next = solve_pole(spectra, &lines, &offsets, &weights)?;
        for (weight, offset) in weights.iter_mut().zip(&offsets) {
            // A pole on a line must not take all the weight: a tenth of a line is near enough.
            *weight = 1.0 / ((Complex64::from(*offset) - next.pole).norm_sqr() + 0.01);
        }
        fit = Some(next);
    }
    fit
}

/// One weighted least-squares pass. Residue and background of each spectrum are projected out, which
/// leaves a single complex unknown: q = sum conj(H') (u H)' / sum |H'|^2.
fn solve_pole(
    spectra: &[&[Complex64]],
    lines: &[usize],
    offsets: &[f64],
    weights: &[f64],
) -> Option<PoleFit> {
    let basis = polynomial_basis(offsets, weights);
    let (mut numerator, mut denominator) = (Complex64::ZERO, 0.0);
    let mut parts = Vec::with_capacity(spectra.len());
    for spectrum in spectra {
        let values: Vec<Complex64> = lines
            .iter()
            .zip(weights)
            .map(|(&line, weight)| spectrum[line] * weight.sqrt())
            .collect();
        let sloped: Vec<Complex64> = values.iter().zip(offsets).map(|(h, u)| h * u).collect();
        let (h, uh) = (project(values, &basis), project(sloped, &basis));
        numerator += h
            .iter()
            .zip(&uh)
            .map(|(h, uh)| h.conj() * uh)
            .sum::<Complex64>();
        denominator += h.iter().map(Complex64::norm_sqr).sum::<f64>();
        parts.push((h, uh));
    }
    if denominator.is_nan() || denominator <= 0.0 {
        return None;
    }
    let pole = numerator / denominator;
    let (mut squares, mut neighbours) = (0.0, 0.0);
    for (h, uh) in &parts {
        let rest: Vec<Complex64> = h.iter().zip(uh).map(|(h, uh)| uh - pole * h).collect();
        squares += rest.iter().map(Complex64::norm_sqr).sum::<f64>();
        neighbours += rest
            .windows(2)
            .map(|pair| (pair[0].conj() * pair[1]).re)
            .sum::<f64>();
    }
    // What the model misses runs smoothly over the lines, and neighbours that agree are not
    // independent: their correlation r leaves (1 - r)/(1 + r) of the lines' information.
    let agreement = (neighbours / squares.max(f64::MIN_POSITIVE)).clamp(0.0, 0.98);
    let squares = squares * (1.0 + agreement) / (1.0 - agreement);
    // Complex values less the polynomial's unknowns per spectrum less the common pole.
    let unknowns = basis.len() * spectra.len() + 1;
    let freedom = (offsets.len() * spectra.len()).saturating_sub(unknowns);
    let std = if freedom == 0 {
        0.0
    } else {
        (squares / (2.0 * freedom as f64) / denominator).sqrt()
    };
    Some(PoleFit { pole, std })
}

/// Orthonormal basis of the polynomials 1, u (and u^2 where there are lines enough) under the
/// weights, by Gram and Schmidt.
fn polynomial_basis(offsets: &[f64], weights: &[f64]) -> Vec<Vec<f64>> {
    let degrees = if offsets.len() > 2 * SLOPING_REACH {
        3
    } else {
        2
    };
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(degrees);
    for degree in 0..degrees {
        let mut vector: Vec<f64> = offsets
            .iter()
            .zip(weights)
            .map(|(u, w)| w.sqrt() * u.powi(degree as i32))
            .collect();
        for earlier in &basis {
            let share: f64 = vector.iter().zip(earlier).map(|(v, e)| v * e).sum();
            vector
                .iter_mut()
                .zip(earlier)
                .for_each(|(v, e)| *v -= share * e);
        }
        let norm = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        vector.iter_mut().for_each(|v| *v /= norm);
        basis.push(vector);
    }
    basis
}

/// Takes the span of `basis` out of `values`.
fn project(mut values: Vec<Complex64>, basis: &[Vec<f64>]) -> Vec<Complex64> {
    for vector in basis {
        let share = values
            .iter()
            .zip(vector)
            .map(|(v, b)| v * b)
            .sum::<Complex64>();
        values
            .iter_mut()
            .zip(vector)
            .for_each(|(v, b)| *v -= share * b);
    }
    values
}

/// Parabola through the three levels (dB) around the peak: for the Hann window, whose lines are not
/// those of a single pole. Its bias there stays below 0.02 lines for a steady tone; the bound is
/// 0.05 lines.
pub fn interpolate_parabola(lines: &Lines, level_db: &[f64], peak: usize) -> Option<Interpolation> {
    let (before, at, after) = (
        *level_db.get(peak.checked_sub(1)?)?,
        *level_db.get(peak)?,
        *level_db.get(peak + 1)?,
    );
    let curvature = before - 2.0 * at + after;
    if curvature.is_nan() || curvature >= 0.0 {
        return None;
    }
    let shift = 0.5 * (before - after) / curvature;
    let bound = 0.05 * lines.resolution().max(lines.spacing);
    Some(Interpolation {
        frequency: lines.frequency(peak) + shift * lines.spacing,
        bound,
        std: bound / 2.0,
        damping_ratio: None,
        damping_std: 0.0,
        decay_in_record: 0.0,
    })
}
