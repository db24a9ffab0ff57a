//! Whether the force reaches over the band.

use super::{Check, ForceEvidence, Outcome, QualitySettings, RecordingEvidence, Subject, Verdict};

/// Lines to either side over which the force is smoothed: a single line's noise is no fall.
const SMOOTHING: usize = 2;
const NO_FORCE: &str = "Not applicable without a hammer: the force is not known.";

/// Fall of the force spectrum over the band, largest over smallest.
pub fn check_force_fall(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = of_band(recording, Check::ForceFall, settings.force_fall);
    let Some((frequencies, power)) = band_power(recording) else {
        return verdict.missing(NO_FORCE);
    };
    let largest = power.iter().copied().fold(0.0, f64::max);
    let lowest = frequencies
        .iter()
        .zip(&power)
        .min_by(|a, b| a.1.total_cmp(b.1));
    let Some((at, &smallest)) = lowest.filter(|(_, power)| **power > 0.0) else {
        return verdict.missing("Not applicable: the force has no power.");
    };
    // Level difference of two powers, 10 log10 (dB).
    let fall = 10.0 * (largest / smallest).log10();
    let outcome = match fall <= settings.force_fall {
        true => Outcome::Good,
        false => Outcome::Doubtful,
    };
    let happened = format!(
        "The force spectrum falls by {fall:.1} dB over the band, lowest at {at:.1} Hz (limit {:.0} dB).",
        settings.force_fall
    );
    verdict.found(fall, outcome, happened)
}

/// The frequency from which on the force is no longer clear of its noise.
pub fn check_force_noise(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = of_band(recording, Check::ForceNoise, recording.lines.high);
    let Some((frequencies, power)) = band_power(recording) else {
        return verdict.missing(NO_FORCE);
    };
    let noise = recording
        .force
        .as_ref()
        .and_then(|force| force.noise.as_ref());
    let Some(noise) = noise else {
        return verdict.missing("Not applicable: no quiet stretch tells the force's noise.");
    };
    let clear = 10f64.powf(settings.force_over_noise / 10.0);
    let noise_power = smoothed(noise);
    let sinks = power
        .iter()
        .zip(&noise_power)
        .position(|(p, n)| *p < clear * n);
    let over = settings.force_over_noise;
    match sinks.and_then(|index| frequencies.get(index)) {
        None => verdict.clear(format!(
            "The force stays {over:.0} dB above its noise up to {:.1} Hz.",
            recording.lines.high
        )),
        Some(&at) => verdict.found(
            at,
            Outcome::Doubtful,
            format!(
                "At {at:.1} Hz the force comes within {over:.0} dB of its noise; the band ends at {:.1} Hz.",
                recording.lines.high
            ),
        ),
    }
}

fn of_band(recording: &RecordingEvidence, check: Check, limit: f64) -> Verdict {
    let file = recording.file.clone();
    Verdict::new(check, Subject::Recording { file }, limit)
}

/// Frequencies (Hz) and smoothed power of the force; `None` without any.
fn band_power(recording: &RecordingEvidence) -> Option<(Vec<f64>, Vec<f64>)> {
    let ForceEvidence { spectrum, .. } = recording.force.as_ref()?;
    let frequencies: Vec<f64> = recording.lines.frequencies();
    (!spectrum.is_empty()).then(|| (frequencies, smoothed(spectrum)))
}

/// Mean power over the neighbouring lines.
fn smoothed(amplitudes: &[f64]) -> Vec<f64> {
    (0..amplitudes.len())
        .map(|index| {
            let end = (index + SMOOTHING + 1).min(amplitudes.len());
            let about = &amplitudes[index.saturating_sub(SMOOTHING)..end];
            about.iter().map(|x| x * x).sum::<f64>() / about.len() as f64
        })
        .collect()
}
