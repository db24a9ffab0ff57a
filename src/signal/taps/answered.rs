//! Whether a sensor answers a pulse of force.

use super::Event;
use crate::recording::{Recording, RecordingError};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use tapjoint_numerics::stats::root_mean_square;

/// Stretch before and after the trigger that is compared (s): several periods of the lowest modes'
/// higher companions, short beside the time between taps.
const STRETCH: f64 = 0.05;
/// A tap raises the rms of some response by this factor at least, or that of what cannot be predicted of it.
const RISE: f64 = 1.5;

/// Returns `true` where any response rises, or does not ring on as before, when the force rises. A hammer laid down, a swinging hammer and an
/// electrical spike move no sensor. Without responses that give a signal, or at the very start of the recording, the
/// benefit of the doubt is given.
pub(super) fn is_answered(
    recording: &Recording,
    responses: &[usize],
    event: &Event,
) -> Result<bool, RecordingError> {
    // A sensor that has failed says nothing.
    let has_failed = |channel: usize| {
        let stopped = recording.channels().get(channel)?.health.stopped?;
        Some(stopped.start < event.trigger)
    };
    let responses = responses.iter().copied();
    let responses: Vec<usize> = responses
        .filter(|channel| has_failed(*channel) != Some(true))
        .collect();
    let stretch = (STRETCH * recording.sample_rate()) as u64;
    // The filter's ringing ahead of the pulse belongs to neither side.
    let gap = stretch / 10;
    if responses.is_empty() || stretch < 8 || event.trigger < 2 * stretch {
        return Ok(true);
    }
    let continued = (CONTINUED * recording.sample_rate()) as u64;
    // Two taps lie no nearer, so that the stretch before the trigger is part of what is read.
    let first = (event.trigger - gap).saturating_sub(continued.max(stretch));
    let samples = recording.read_channels(&responses, first..event.trigger + stretch)?;
    let turn = (event.trigger - gap - first) as usize;
    let trigger = (event.trigger - first) as usize;
    let lag = ((LAG * recording.sample_rate()) as usize).max(1);
    for ringing in &samples {
        let quiet = &ringing[turn - stretch as usize..turn];
        let loud = &ringing[trigger.min(ringing.len())..];
        if rms_about_mean(loud) > RISE * rms_about_mean(quiet)
            || rms_of_change(loud) > RISE * rms_of_change(quiet)
        {
            return Ok(true);
        }
        // A hit on a structure that still rings loudly may leave it no louder.
        if let Some((quiet, loud)) = unpredicted(ringing, turn, lag)
            && loud > RISE * quiet
        {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Stretch before the trigger from which the ringing is continued (s): two taps lie no nearer.
const CONTINUED: f64 = 0.2;
/// Distance of the past values from which the next one is predicted (s): a part of a period of the strong low modes,
/// so that noise on neighbouring samples does not hide their curvature.
const LAG: f64 = 1e-3;
/// Number of past values: two for each of eight oscillations.
const LAGS: usize = 16;

/// Root mean squares of what a linear prediction misses before the sample `turn`, from which its weights come, and
/// after it; `None` where there are too few samples.
///
/// A sum of n decaying oscillations is predicted exactly by 2 n equally spaced past values (de Prony 1795), whatever
/// its beats. A new hit breaks the prediction.
fn unpredicted(samples: &[f64], turn: usize, lag: usize) -> Option<(f64, f64)> {
    let reach = LAGS * lag;
    let rows = turn.checked_sub(reach).filter(|rows| *rows >= 4 * LAGS)?;
    let past = |row: usize| (1..=LAGS).map(move |k| samples[row - k * lag]);
    let mut normal = DMatrix::<f64>::zeros(LAGS, LAGS);
    let mut right = DVector::<f64>::zeros(LAGS);
    for (row, &value) in samples.iter().enumerate().take(turn).skip(reach) {
        let values = DVector::from_iterator(LAGS, past(row));
        normal.ger(1.0, &values, &values, 1.0);
        right.axpy(value, &values, 1.0);
    }
    // Fewer oscillations than the weights could follow leave the equations nearly singular.
    let trace = normal.trace();
    for k in 0..LAGS {
        normal[(k, k)] += 1e-12 * trace;
    }
    let weights = normal.cholesky()?.solve(&right);
    let misses = |rows: Range<usize>| -> f64 {
        let errors = rows.map(|row| {
            let predicted: f64 = past(row).zip(&weights).map(|(x, w)| x * w).sum();
            (samples[row] - predicted).powi(2)
        });
        errors.sum()
    };
    let before = misses(reach..turn) / (rows - LAGS) as f64;
    let after = misses(turn..samples.len()) / samples.len().saturating_sub(turn).max(1) as f64;
    Some((before.sqrt(), after.sqrt()))
}

/// rms of the second differences: it weighs high modes, which die first and which a new hit wakes
/// even while the low ones still ring loudly.
fn rms_of_change(samples: &[f64]) -> f64 {
    let change: Vec<f64> = samples
        .windows(3)
        .map(|x| x[2] - 2.0 * x[1] + x[0])
        .collect();
    root_mean_square(&change)
}

/// Root mean square about the mean; 0 of nothing.
fn rms_about_mean(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    let about: Vec<f64> = samples.iter().map(|x| x - mean).collect();
    root_mean_square(&about)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_oscillations_are_predicted_until_something_new_comes() {
        let rings = |n: usize| -> f64 {
            let waves = [(0.31, 1.0), (0.47, 0.5), (1.13, 0.2)];
            let at = |(omega, amplitude): &(f64, f64)| amplitude * (omega * n as f64).sin();
            (-1e-3 * n as f64).exp() * waves.iter().map(at).sum::<f64>()
        };
        let mut samples: Vec<f64> = (0..400).map(rings).collect();
        let (before, after) = unpredicted(&samples, 300, 2).unwrap();
        // The ridge of 10^-12 leaves some 10^-6 of the amplitude.
        assert!(before < 1e-4 && after < 1e-4, "{before} {after}");
        samples[320] += 0.01;
        let (before, after) = unpredicted(&samples, 300, 2).unwrap();
        assert!(after > 10.0 * before, "{before} {after}");
        assert_eq!(unpredicted(&samples, 90, 2), None);
    }
}
