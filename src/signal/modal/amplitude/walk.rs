//! Along one decay from segment to segment, until the mode falls into the noise.
//!
//! One segment: the mode's pole, with what else is in the band held near what the whole decay says.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::band::Band;
use super::decay_model::{Context, Exponentials, Prior, fit_exponentials};
use super::{AmplitudePoint, AmplitudeSettings};

/// Fewest values of a segment: 24 real numbers against four unknowns.
const LEAST_VALUES: usize = 12;
/// A pole this many decays away from where the segment before had it is another's.
const LARGEST_JUMP: f64 = 3.0;

/// The points of one decay.
pub(super) fn walk_decay(
    series: &[Complex64],
    band: &Band,
    context: &Context,
    settings: &AmplitudeSettings,
) -> Vec<AmplitudePoint> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut pole = context.model.pole(0.0);
    pole.re = pole.re.min(0.3 * band.decay);
    let mut amplitude = context.model.amplitude.norm();
    let mut from = 0;
    while let Some(length) = next_length((amplitude, pole.re), band, context, settings) {
        let Some(values) = series.get(from..from + length) else {
            break;
        };
        let times: Vec<f64> = (from..from + length)
            .map(|n| n as f64 * band.step)
            .collect();
        let Some(segment) = fit_segment(&times, values, pole, context) else {
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
    points(&segments, band)
}

/// Values of the next segment: as few as give the damping with the wanted uncertainty; `None` where
/// even the longest segment leaves it too uncertain.
///
/// Bound of Cramer and Rao for one exponential of amplitude A in noise of variance v:
/// var(sigma) = 6 v/(A^2 N^3 step^2) with A that of the segment's middle.
fn next_length(
    (amplitude, decay): (f64, f64),
    band: &Band,
    context: &Context,
    settings: &AmplitudeSettings,
) -> Option<usize> {
    let values = |share: f64| ((share * band.scale / band.step) as usize).max(LEAST_VALUES);
    let (least, most) = (values(settings.shortest), values(settings.longest));
    let uncertainty = |length: usize| {
        let n = length as f64;
        let middle = amplitude * (0.5 * decay * n * band.step).exp();
        (6.0 * context.noise / n.powi(3)).sqrt() / (middle * band.step) / decay.abs()
    };
    let length = (least..most)
        .find(|length| uncertainty(*length) <= settings.aim)
        .unwrap_or(most);
    (uncertainty(length) <= settings.end).then_some(length)
}

fn points(segments: &[Segment], band: &Band) -> Vec<AmplitudePoint> {
    let alone = |index: usize| {
        let segment = segments[index];
        let near = &segments[index.saturating_sub(1)..(index + 2).min(segments.len())];
        let std = (0.5 * noise(near) * band.noise_ratio * segment.inverse).sqrt();
        point(&segment, std, band)
    };
    (0..segments.len()).map(alone).collect()
}

/// Noise variance from the residuals of neighbouring segments: one alone has too few values.
///
/// Residuals that agree with their neighbours (correlation r) are what the model misses; they leave
/// (1 - r)/(1 + r) of the values' information.
fn noise(segments: &[Segment]) -> f64 {
    let sum = |part: fn(&Segment) -> f64| segments.iter().map(part).sum::<f64>();
    let squares = sum(|s| s.squares);
    let agreement = sum(|s| s.products) / squares.max(f64::MIN_POSITIVE);
    // One standard deviation of a correlation by chance: 1/sqrt(2n) with n complex values.
    let chance = 1.0 / (2.0 * sum(|s| s.freedom)).sqrt();
    let agreement = (agreement - chance).clamp(0.0, 0.9);
    squares / sum(|s| s.freedom) * (1.0 + agreement) / (1.0 - agreement)
}

fn point(segment: &Segment, std: f64, band: &Band) -> AmplitudePoint {
    let pole = Complex64::new(segment.pole.re, segment.pole.im + band.omega);
    AmplitudePoint {
        tap: band.tap,
        time: band.first + segment.time,
        amplitude: segment.amplitude / band.gain(segment.pole).norm(),
        frequency: pole.norm() / TAU,
        frequency_std: std / TAU,
        damping_ratio: -pole.re / pole.norm(),
        damping_std: std / pole.norm(),
    }
}

/// How far a companion's amplitude may differ from that of the whole decay, relative.
const AMPLITUDE_FREEDOM: f64 = 0.2;
/// How far its pole may differ (shares of the mode's decay).
const POLE_FREEDOM: f64 = 0.3;

/// What a segment says about the mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// Time at which a linear drift has the value found (s after the band's first value).
    pub time: f64,
    /// Amplitude there, as the band has it.
    pub amplitude: f64,
    /// Pole relative to the band's middle (rad/s).
    pub pole: Complex64,
    /// Diagonal element of the inverse normal matrix for the pole.
    pub inverse: f64,
    /// Sum of squared residuals, their lag-one products, and complex degrees of freedom.
    pub squares: f64,
    pub products: f64,
    pub freedom: f64,
}

/// Fits the mode to values at `times` (s after the band's first value), starting at `pole`.
pub(super) fn fit_segment(
    times: &[f64],
    values: &[Complex64],
    pole: Complex64,
    context: &Context,
) -> Option<Segment> {
    let reference = effective_time(times, pole.re);
    let local: Vec<f64> = times.iter().map(|t| t - reference).collect();
    // How the drift bends within the segment is taken from the whole decay, so that the pole is that of
    // the reference time.
    let straight: Vec<Complex64> = local
        .iter()
        .zip(values)
        .map(|(s, value)| value * (-context.bend(reference, *s)).exp())
        .collect();
    let others: Vec<(Complex64, Complex64)> = context
        .model
        .others
        .iter()
        .map(|(c, p)| (c * (p * reference).exp(), *p))
        .collect();
    let start = Exponentials {
        amplitude: first_amplitude(&local, &straight, pole, &others),
        exponents: vec![pole],
        rate: context.model.rate,
        others,
    };
    let priors = priors(&start, context.noise, pole.re);
    let fit = fit_exponentials(&local, &straight, start, &priors)?;
    let pairs = fit.residuals.windows(2);
    Some(Segment {
        time: reference,
        amplitude: fit.model.amplitude.norm(),
        pole: *fit.model.exponents.first()?,
        inverse: fit.inverse[(1, 1)].re,
        squares: fit.squares,
        products: pairs.map(|r| (r[0].conj() * r[1]).re).sum(),
        freedom: values.len() as f64 - 2.0,
    })
}

/// Least-squares amplitude of the mode with everything else as the whole decay has it.
fn first_amplitude(
    times: &[f64],
    values: &[Complex64],
    pole: Complex64,
    others: &[(Complex64, Complex64)],
) -> Complex64 {
    let (mut product, mut energy) = (Complex64::ZERO, f64::MIN_POSITIVE);
    for (t, value) in times.iter().zip(values) {
        let rest: Complex64 = others.iter().map(|(c, p)| c * (p * t).exp()).sum();
        let growth = (pole * t).exp();
        product += growth.conj() * (value - rest);
        energy += growth.norm_sqr();
    }
    product / energy
}

fn priors(start: &Exponentials, noise: f64, decay: f64) -> Vec<Prior> {
    let others = start.others.iter().enumerate();
    others
        .flat_map(|(k, (amplitude, pole))| {
            let variance = |std: f64| (2.0 * std * std).max(f64::MIN_POSITIVE);
            [
                Prior {
                    parameter: 2 + 2 * k,
                    value: *amplitude,
                    weight: noise / (variance(AMPLITUDE_FREEDOM * amplitude.norm()) + noise * 1e-9),
                },
                Prior {
                    parameter: 3 + 2 * k,
                    value: *pole,
                    weight: noise / variance(POLE_FREEDOM * decay),
                },
            ]
        })
        .collect()
}

/// Time at which a parabola has the slope of the straight line fitted to it with weights w:
/// mean + mu3/(2 mu2). Log amplitude and phase are weighted with the amplitude squared,
/// w = e^{2 decay t}, so that an estimate from a drifting pole is that of this time.
fn effective_time(times: &[f64], decay: f64) -> f64 {
    let first = times.first().copied().unwrap_or(0.0);
    let weight = |t: &f64| (2.0 * decay * (t - first)).exp();
    let weights: Vec<f64> = times.iter().map(weight).collect();
    let total: f64 = weights.iter().sum();
    let moment = |about: f64, power: i32| {
        let terms = times.iter().zip(&weights);
        terms.map(|(t, w)| w * (t - about).powi(power)).sum::<f64>() / total
    };
    let mean = moment(0.0, 1);
    mean + 0.5 * moment(mean, 3) / moment(mean, 2)
}
