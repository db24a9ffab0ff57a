//! Along one decay from segment to segment, until the mode falls into the noise.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::band::Band;
use super::context::Context;
use super::segment::{Segment, fit_segment};
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
