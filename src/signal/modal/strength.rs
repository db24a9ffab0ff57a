//! How strong each mode is beside the others of its recording.
//!
//! The amplitude of a mode as a modal constant, or as the velocity after a tap, is the product of its shapes at sensor and
//! tap (Ewins 2000, section 2.4). Over random places of both it is about uniform between zero and that of the strongest
//! mode: a hundredth of that is rare. Poles that mend the line of another mode, reverberation and echoes are weaker by any
//! number of decades, and most make no peak.

use std::f64::consts::TAU;

use super::{ModeReading, PeakLabel};
use crate::recording::ResponseForm;

/// Least part of the strongest mode's amplitude that a mode above it in frequency is compared with: 3 % (30 dB), to which
/// the force of a tap has fallen at the end of its usable range.
const FALLEN: f64 = 0.03;
/// A pole that makes no peak counts a tenth where others make peaks: poles that only mend the line of another have large
/// amplitudes that cancel.
const NO_PEAK: f64 = 0.1;
/// A pole that makes no peak is weak below this strength: a hundredth of the amplitude that a mode could have. Simulated
/// cantilevers with one to three sensors have 2 % of their modes there, and the peak of a mode is seen nearly always.
const WEAK: f64 = 0.01 * NO_PEAK;

/// Sets the strengths of ascending readings of one recording, and labels poles that are too weak for a mode. `kinds` are
/// the quantities of the sensors, by their number; one that is not known is an acceleration.
pub fn set_strengths(readings: &mut [ModeReading], kinds: &[Option<ResponseForm>]) {
    let mut fits = readings.iter().flat_map(|reading| reading.fit.as_deref());
    let of_constants = fits.any(|fit| !fit.constants.is_empty());
    let may_be_mode = readings.iter().map(|reading| reading.label.is_none());
    let may_be_mode: Vec<bool> = may_be_mode.collect();
    let own = readings.iter().zip(&may_be_mode);
    let any_peak = own
        .clone()
        .any(|(own, mode)| *mode && own.prominence_db.is_some());
    let mut amplitudes: Vec<Option<f64>> = Vec::with_capacity(readings.len());
    for (reading, may_be_mode) in own {
        let squares = match (reading.fit.as_deref(), of_constants) {
            (Some(fit), true) => fit.constants.iter().map(|one| one.value.powi(2)).sum(),
            (Some(_), false) => squares_of_velocities(reading, kinds),
            (None, _) => 0.0,
        };
        let peakless = any_peak && reading.prominence_db.is_none();
        let amplitude = squares.sqrt() * if peakless { NO_PEAK } else { 1.0 };
        amplitudes.push((*may_be_mode && amplitude > 0.0).then_some(amplitude));
    }
    // The force of a tap falls with frequency. A mode is compared with the strongest at its frequency or above.
    let strongest = amplitudes.iter().flatten().copied().fold(0.0, f64::max);
    let mut reference: f64 = FALLEN * strongest;
    for (reading, amplitude) in readings.iter_mut().zip(amplitudes).rev() {
        reference = reference.max(amplitude.unwrap_or(0.0));
        reading.strength = amplitude.map(|amplitude| amplitude / reference);
        if reading.prominence_db.is_none()
            && reading.strength < Some(WEAK)
            && reading.strength.is_some()
        {
            reading.label = Some(PeakLabel::Weak);
        }
    }
}

/// Sum over all columns of the squared amplitudes of velocity (any unit that all readings share).
fn squares_of_velocities(reading: &ModeReading, kinds: &[Option<ResponseForm>]) -> f64 {
    let omega = TAU * reading.frequency;
    let amplitudes = reading.fit.iter().flat_map(|fit| &fit.mode.amplitudes);
    let squares = amplitudes.map(|own| {
        let kind = kinds.get(own.sensor).copied().flatten();
        let to_velocity = match kind.unwrap_or(ResponseForm::Accelerance) {
            ResponseForm::Accelerance => 1.0 / omega,
            ResponseForm::Mobility => 1.0,
            ResponseForm::Receptance => omega,
        };
        (to_velocity * own.value.norm()).powi(2)
    });
    squares.sum()
}
