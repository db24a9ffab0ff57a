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
/// A pole that makes no peak and has less than this part of the amplitude that a mode could have is too weak for one. 1 %
/// of modes are weaker where amplitudes are uniform, and the peak of a mode is seen nearly always.
const WEAK: f64 = 0.01;

/// Sets the strengths of ascending readings of one recording, and labels poles that are too weak for a mode.
///
/// `kinds` are the quantities of the sensors, by their number; one that is not known is an acceleration. `force_falls`:
/// the readings are decays after taps, whose force falls with frequency. Where it was measured, modal constants do
/// without it.
pub fn set_strengths(
    readings: &mut [ModeReading],
    kinds: &[Option<ResponseForm>],
    force_falls: bool,
) {
    let mut fits = readings.iter().flat_map(|reading| reading.fit.as_deref());
    let of_constants = fits.any(|fit| !fit.constants.is_empty());
    let mut amplitudes: Vec<Option<f64>> = Vec::with_capacity(readings.len());
    for reading in readings.iter() {
        let squares = match (reading.fit.as_deref(), of_constants) {
            _ if reading.label.is_some() => 0.0,
            (Some(fit), true) => fit.constants.iter().map(|one| one.value.powi(2)).sum(),
            (Some(_), false) => squares_of_velocities(reading, kinds),
            (None, _) => 0.0,
        };
        amplitudes.push((squares > 0.0).then(|| squares.sqrt()));
    }
    let of_peaks = readings.iter().zip(&amplitudes);
    let any_peak = of_peaks
        .clone()
        .any(|(reading, own)| own.is_some() && reading.prominence_db.is_some());
    let mut counted = Vec::with_capacity(readings.len());
    for (reading, amplitude) in of_peaks {
        let peakless = any_peak && reading.prominence_db.is_none();
        let part = if peakless { NO_PEAK } else { 1.0 };
        counted.push(amplitude.map(|amplitude| part * amplitude));
    }
    let force_falls = force_falls && !of_constants;
    let strengths = strengths_of(&counted, force_falls);
    let references = references(&counted, force_falls);
    for (index, reading) in readings.iter_mut().enumerate() {
        reading.strength = strengths[index];
        let is_weak = amplitudes[index].is_some_and(|own| own < WEAK * references[index]);
        if is_weak && reading.prominence_db.is_none() {
            reading.label = Some(PeakLabel::Weak);
        }
    }
}

/// Returns the strengths of modes with these amplitudes (any unit), ascending in frequency; `None` of one without an
/// amplitude, and where the force falls by an unknown part: at a mode that is the strongest from its frequency on, and
/// not the strongest of all.
pub fn strengths_of(amplitudes: &[Option<f64>], force_falls: bool) -> Vec<Option<f64>> {
    let strongest = amplitudes.iter().flatten().copied().fold(0.0, f64::max);
    let references = references(amplitudes, force_falls);
    let mut strengths = Vec::with_capacity(amplitudes.len());
    for (own, reference) in amplitudes.iter().zip(&references) {
        let known = own.filter(|own| own < reference || *own == strongest);
        strengths.push(known.map(|own| own / reference));
    }
    strengths
}

/// Amplitude that a mode at each reading's frequency could have: that of the strongest of all or, where the force falls
/// with frequency, of the strongest at this frequency or above.
fn references(amplitudes: &[Option<f64>], force_falls: bool) -> Vec<f64> {
    let strongest = amplitudes.iter().flatten().copied().fold(0.0, f64::max);
    let mut reference = if force_falls {
        FALLEN * strongest
    } else {
        strongest
    };
    let mut references = vec![reference; amplitudes.len()];
    for (index, amplitude) in amplitudes.iter().enumerate().rev() {
        reference = reference.max(amplitude.unwrap_or(0.0));
        references[index] = reference;
    }
    references
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
