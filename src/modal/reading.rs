//! Reading each peak: on its line, and between the lines.

use num_complex::Complex64;

use super::interpolation::{Interpolation, interpolate_parabola, interpolate_pole};
use super::merge::{ModeReading, PeakLabel};
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
    peaks
        .iter()
        .map(|peak| {
            let between = match window {
                Window::Hann => interpolate_parabola(&level.lines, &level.level_db, peak.index),
                Window::Rectangular | Window::Exponential { .. } => {
                    let room = room_around(&places, peak.index);
                    let decay = window.added_decay();
                    interpolate_pole(&level.lines, spectra, peak.index, room, decay)
                        .filter(|found| is_resonance(found, peak, level.lines.half_line()))
                }
            };
            reading(level, peak, between)
        })
        .collect()
}

/// A peak that stands out by less than this (dB) must be read within its half line to count.
const CLEAR_PROMINENCE: f64 = 8.0;

/// Whether the fitted oscillation decays beyond doubt (two standard deviations).
fn is_resonance(found: &Interpolation, peak: &Peak, half_line: f64) -> bool {
    let decays = found
        .damping_ratio
        .is_some_and(|ratio| ratio > 2.0 * found.damping_std);
    decays && (peak.prominence_db >= CLEAR_PROMINENCE || found.bound < half_line)
}

fn reading(level: &CompositeLevel, peak: &Peak, between: Option<Interpolation>) -> ModeReading {
    let lines = &level.lines;
    let half_line = lines.half_line();
    let label = between.is_none().then_some(PeakLabel::NoResonance);
    let sharp = between.filter(|found| found.bound < half_line);
    let line = sharp.map_or(peak.index, |found| lines.nearest(found.frequency));
    ModeReading {
        frequency: sharp.map_or(lines.frequency(line), |found| found.frequency),
        line_frequency: lines.frequency(line),
        half_line,
        interpolated: sharp.map(|found| found.frequency),
        bound: sharp.map(|found| found.bound),
        // Without interpolation the truth lies anywhere within the half line.
        std: Some(sharp.map_or(half_line / 3f64.sqrt(), |found| {
            (found.bound / 2.0).max(found.std)
        })),
        damping_ratio: sharp.and_then(|found| found.damping_ratio),
        damping_std: sharp.and_then(|found| found.damping_ratio.map(|_| found.damping_std)),
        prominence_db: peak.prominence_db,
        above_noise_db: peak.above_noise_db,
        label,
    }
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
