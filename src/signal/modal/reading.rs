//! Reading each peak: on its line, and between the lines.

use num_complex::Complex64;

use super::interpolation::{Interpolation, Unfit, interpolate_parabola, interpolate_pole};
use super::merge::{FrequencySource, ModeReading, PeakLabel};
use super::peaks::{CompositeLevel, Peak};
use crate::spectral::Window;

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
    reading.prefer(FrequencySource::BetweenLines);
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
