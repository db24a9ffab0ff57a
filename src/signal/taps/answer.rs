//! Whether the structure answers a pulse of the force channel.

use super::Event;
use crate::recording::{Recording, RecordingError};
use tapjoint_numerics::stats::root_mean_square;

/// Stretch before and after the trigger that is compared (s): several periods of the lowest modes'
/// higher companions, short beside the time between taps.
const STRETCH: f64 = 0.05;
/// A tap raises the rms of some response by this factor at least; a weaker one rings on top of what
/// is still ringing and is of no use.
const RISE: f64 = 1.5;

/// Whether any response rises when the force does. A hammer laid down, a swinging hammer and an
/// electrical spike move no sensor. Without responses, or at the very start of the recording, the
/// benefit of the doubt is given.
pub(super) fn is_answered(
    recording: &Recording,
    responses: &[usize],
    event: &Event,
) -> Result<bool, RecordingError> {
    let stretch = (STRETCH * recording.sample_rate()) as u64;
    // The filter's ringing ahead of the pulse belongs to neither side.
    let gap = stretch / 10;
    if responses.is_empty() || stretch < 8 || event.trigger < 2 * stretch {
        return Ok(true);
    }
    let before = event.trigger - gap - stretch..event.trigger - gap;
    let after = event.trigger..event.trigger + stretch;
    for &response in responses {
        let quiet = recording.read(response, before.clone())?;
        let loud = recording.read(response, after.clone())?;
        let rises = |measure: fn(&[f64]) -> f64| measure(&loud) > RISE * measure(&quiet);
        if rises(rms_about_mean) || rises(rms_of_change) {
            return Ok(true);
        }
    }
    Ok(false)
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
