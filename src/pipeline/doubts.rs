//! Doubts about how well the resonances of one recording are known.

use std::f64::consts::TAU;

use super::measure::MeasuredSpectra;
use super::warning::Warning;
use crate::modal::ModeReading;
use crate::spectral::window_share;

/// Share of a measured damping from which the window's part is called dominant: half.
const DOMINANT: f64 = 0.5;
/// Random error of an FRF at a resonance that good practice stays below (ISO 7626-5).
const MOST_RANDOM_ERROR: f64 = 0.05;

/// What a reader has to know of the readings of `file`.
pub(super) fn of_readings(file: &str, spectra: &MeasuredSpectra) -> Vec<Warning> {
    [window_damping(spectra), random_errors(spectra)]
        .into_iter()
        .flatten()
        .map(|(code, text)| Warning::Recording {
            code,
            file: file.to_string(),
            text,
        })
        .collect()
}

/// Dampings that are the small difference between what was measured and what the window added.
fn window_damping(spectra: &MeasuredSpectra) -> Option<(&'static str, String)> {
    let share = |reading: &ModeReading| {
        let decay = TAU * reading.frequency * reading.damping_ratio?;
        let share = window_share(spectra.window, decay);
        (share > DOMINANT).then_some((reading.frequency, share))
    };
    let found: Vec<(f64, f64)> = resonances(spectra).filter_map(share).collect();
    let (_, worst) = found.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let text = format!(
        "the exponential window makes up more than half of the measured damping of the mode(s) at {} (up to \
         {:.0} %): what is left after taking it out is a small difference, to be trusted no further than \
         its standard deviation; set the taps farther apart to need a weaker window",
        frequencies(found.iter().map(|mode| mode.0)),
        100.0 * worst
    );
    Some(("window-damping", text))
}

/// Resonances at which even the sensor that knows them best scatters more than good practice allows.
fn random_errors(spectra: &MeasuredSpectra) -> Option<(&'static str, String)> {
    let large = |reading: &ModeReading| {
        let quality = spectra.averages.best_quality(reading.frequency);
        let error = quality.random_error?;
        (error > MOST_RANDOM_ERROR).then_some((reading.frequency, error))
    };
    let found: Vec<(f64, f64)> = resonances(spectra).filter_map(large).collect();
    let (_, worst) = found.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let text = format!(
        "the random error of the frequency response is above {:.0} % at {} (up to {:.0} %): the coherence is \
         low there or the taps are few; more taps, and harder ones where the force has little power, help",
        100.0 * MOST_RANDOM_ERROR,
        frequencies(found.iter().map(|mode| mode.0)),
        100.0 * worst
    );
    Some(("random-error", text))
}

/// The readings that are taken for resonances.
fn resonances(spectra: &MeasuredSpectra) -> impl Iterator<Item = &ModeReading> {
    let readings = spectra.readings.iter();
    readings.filter(|reading| reading.label.is_none())
}

fn frequencies(values: impl Iterator<Item = f64>) -> String {
    let words: Vec<String> = values.map(|value| format!("{value:.1} Hz")).collect();
    words.join(", ")
}
