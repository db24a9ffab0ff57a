//! Segments of one decay, each with the mode's pole.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::band::Band;
use super::decay::DecayModel;
use super::exponentials::{Exponentials, Prior, Times, fit_exponentials};
use super::{AIM, AmplitudePoint, END, LONGEST, SHORTEST};

/// Fewest values of a segment: 24 real numbers against four unknowns.
const LEAST_IN_SEGMENT: usize = 12;
/// A pole this many decays away from that of the segment before is another's.
const LARGEST_JUMP: f64 = 3.0;
/// Freedom of a companion's amplitude about that of the whole decay, relative.
const AMPLITUDE_FREEDOM: f64 = 0.2;
/// Freedom of its pole (shares of the mode's decay).
const POLE_FREEDOM: f64 = 0.3;

/// A part of a decay and the mode's pole in it.
#[derive(Debug, Clone, Copy)]
struct Segment {
    /// Time at which a linear drift has the value found (s after the band's first value).
    time: f64,
    /// Amplitude there, as the band has it.
    amplitude: f64,
    /// Pole relative to the band's middle (rad/s).
    pole: Complex64,
    /// Diagonal element of the inverse normal matrix for the pole.
    inverse: f64,
    /// Sum of squared residuals.
    squares: f64,
    /// Sum of the residuals' lag-one products.
    products: f64,
    /// Complex degrees of freedom.
    freedom: f64,
}

/// Returns the mode's pole along one decay, until it falls into the noise.
pub(super) fn follow_decay(
    series: &[Complex64],
    band: &Band,
    model: &DecayModel,
) -> Vec<AmplitudePoint> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut pole = model.exponentials.pole(0.0);
    pole.re = pole.re.min(0.3 * band.decay);
    let mut amplitude = model.exponentials.amplitude.norm();
    let mut from = 0;
    while let Some(length) = segment_length(amplitude, pole.re, model.noise, band) {
        let Some(values) = series.get(from..from + length) else {
            break;
        };
        let indices = from..from + length;
        let times: Vec<f64> = indices.map(|n| n as f64 * band.step).collect();
        let Some(segment) = fit_segment(&times, values, pole, model) else {
            break;
        };
        if (segment.pole - pole).norm() > LARGEST_JUMP / band.scale {
            break;
        }
        from += length;
        pole = Complex64::new(segment.pole.re.min(0.3 * band.decay), segment.pole.im);
        let ahead = from as f64 * band.step - segment.time;
        amplitude = segment.amplitude * (pole.re * ahead).exp();
        segments.push(segment);
    }
    let mut points = Vec::with_capacity(segments.len());
    for (index, segment) in segments.iter().enumerate() {
        // The noise variance comes from the residuals of neighbouring segments: one alone has too few values.
        let (mut squares, mut products, mut freedom) = (0.0, 0.0, 0.0);
        for near in &segments[index.saturating_sub(1)..(index + 2).min(segments.len())] {
            squares += near.squares;
            products += near.products;
            freedom += near.freedom;
        }
        // Residuals that agree with their neighbours (correlation r) are what the model misses. They leave
        // (1 - r)/(1 + r) of the values' information. One standard deviation of a correlation by chance is
        // 1/sqrt(2n) with n complex values.
        let agreement = products / f64::max(squares, f64::MIN_POSITIVE);
        let agreement = (agreement - 1.0 / f64::sqrt(2.0 * freedom)).clamp(0.0, 0.9);
        let noise = squares / freedom * (1.0 + agreement) / (1.0 - agreement);
        let std = (0.5 * noise * band.noise_ratio * segment.inverse).sqrt();
        let pole = Complex64::new(segment.pole.re, segment.pole.im + band.omega);
        points.push(AmplitudePoint {
            tap: band.tap,
            time: band.first + segment.time,
            amplitude: segment.amplitude / band.gain(segment.pole).norm(),
            frequency: pole.norm() / TAU,
            frequency_std: std / TAU,
            damping_ratio: -pole.re / pole.norm(),
            damping_std: std / pole.norm(),
        });
    }
    points
}

/// Returns the number of values of the next segment: as few as give the damping with the wanted
/// uncertainty. `None` where even the longest segment leaves it too uncertain.
///
/// Bound of Cramer and Rao for one exponential of amplitude A in noise of variance v:
/// var(sigma) = 6 v/(A^2 N^3 step^2) with A that of the segment's middle.
fn segment_length(amplitude: f64, decay: f64, noise: f64, band: &Band) -> Option<usize> {
    let [least, most] = [SHORTEST, LONGEST]
        .map(|share| ((share * band.scale / band.step) as usize).max(LEAST_IN_SEGMENT));
    let mut length = least.min(most);
    loop {
        let n = length as f64;
        let middle = amplitude * (0.5 * decay * n * band.step).exp();
        let uncertainty = (6.0 * noise / n.powi(3)).sqrt() / (middle * band.step) / decay.abs();
        if uncertainty <= AIM || length >= most {
            return (uncertainty <= END).then_some(length);
        }
        length += 1;
    }
}

/// Fits the mode to values at `times` (s after the band's first value), starting at `pole`.
fn fit_segment(
    times: &[f64],
    values: &[Complex64],
    pole: Complex64,
    model: &DecayModel,
) -> Option<Segment> {
    let reference = effective_time(times, pole.re);
    let local: Vec<f64> = times.iter().map(|t| t - reference).collect();
    // How the drift bends within the segment is taken from the whole decay, so that the pole is that of
    // the reference time.
    let straight: Vec<Complex64> = local
        .iter()
        .zip(values)
        .map(|(s, value)| value * (-model.bend(reference, *s)).exp())
        .collect();
    let others: Vec<(Complex64, Complex64)> = (model.exponentials.others.iter())
        .map(|(c, p)| (c * (p * reference).exp(), *p))
        .collect();
    let mut priors = Vec::with_capacity(2 * others.len());
    for (k, (amplitude, other)) in others.iter().enumerate() {
        let [vague_amplitude, vague_pole] =
            [AMPLITUDE_FREEDOM * amplitude.norm(), POLE_FREEDOM * pole.re]
                .map(|std| (2.0 * std * std).max(f64::MIN_POSITIVE));
        priors.push(Prior {
            parameter: 2 + 2 * k,
            value: *amplitude,
            weight: model.noise / (vague_amplitude + model.noise * 1e-9),
        });
        priors.push(Prior {
            parameter: 3 + 2 * k,
            value: *other,
            weight: model.noise / vague_pole,
        });
    }
    // Least-squares amplitude of the mode with everything else as the whole decay has it.
    let (mut product, mut energy) = (Complex64::ZERO, f64::MIN_POSITIVE);
    for (t, value) in local.iter().zip(&straight) {
        let rest: Complex64 = others.iter().map(|(c, p)| c * (p * t).exp()).sum();
        let growth = (pole * t).exp();
        product += growth.conj() * (value - rest);
        energy += growth.norm_sqr();
    }
    let start = Exponentials {
        amplitude: product / energy,
        exponents: vec![pole],
        rate: model.exponentials.rate,
        others,
    };
    let equal = Times {
        first: local[0],
        step: (local[local.len() - 1] - local[0]) / (local.len() - 1) as f64,
        count: local.len(),
    };
    let fit = fit_exponentials(equal, &straight, start, &priors)?;
    let pairs = fit.residuals.windows(2);
    Some(Segment {
        time: reference,
        amplitude: fit.model.amplitude.norm(),
        pole: *fit.model.exponents.first()?,
        inverse: fit.inverse()?[(1, 1)].re,
        squares: fit.squares,
        products: pairs.map(|r| (r[0].conj() * r[1]).re).sum(),
        freedom: values.len() as f64 - 2.0,
    })
}

/// Returns the time at which a parabola has the slope of the straight line fitted to it with weights w:
/// mean + mu3/(2 mu2). Log amplitude and phase are weighted with the amplitude squared,
/// w = e^{2 decay t}, so that an estimate from a drifting pole is that of this time.
fn effective_time(times: &[f64], decay: f64) -> f64 {
    let first = times.first().copied().unwrap_or(0.0);
    let weights: Vec<f64> = times
        .iter()
        .map(|t| (2.0 * decay * (t - first)).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    let mean = times.iter().zip(&weights).map(|(t, w)| w * t).sum::<f64>() / total;
    let (mut second, mut third) = (0.0, 0.0);
    for (t, w) in times.iter().zip(&weights) {
        second += w * (t - mean).powi(2);
        third += w * (t - mean).powi(3);
    }
    mean + 0.5 * third / second
}
