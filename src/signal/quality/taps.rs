//! Checks of each tap.
//!
//! Whether the taps of a recording are of one level.
//!
//! Whether the force reaches over the band.

use super::{
    Check, ForceEvidence, Outcome, QualitySettings, RecordingEvidence, Subject, TapEvidence,
    Verdict,
};
use crate::taps::{Rejection, SecondHit};

const NO_HAMMER: &str = "Not applicable without a hammer: a second hit cannot be told from two modes that beat in the responses.";

/// Exactly one impact in each tap, by the force in time.
pub fn check_double_hit(recording: &RecordingEvidence, settings: &QualitySettings) -> Vec<Verdict> {
    of_force(
        recording,
        (Check::DoubleHit, settings.double_hit),
        |tap, verdict| {
            let Some(hit) = tap.second_hit else {
                return verdict.clear("One impact.".to_owned());
            };
            let happened = format!(
                "A second hit of {:.1} % of the first after {:.2} ms (limit {:.0} %).",
                100.0 * hit.ratio,
                1e3 * hit.delay,
                100.0 * settings.double_hit
            );
            verdict.found(hit.ratio, outcome(hit, settings), happened)
        },
    )
}

/// The same as a ripple in the force spectrum, |1 + r e^{-j omega d}|: from 1 - r to 1 + r, every 1/d.
pub fn check_force_ripple(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let limit = decibels(SecondHit {
        delay: 0.0,
        ratio: settings.double_hit,
    });
    of_force(recording, (Check::ForceRipple, limit), |tap, verdict| {
        let Some(hit) = tap.second_hit else {
            return verdict.clear("No second hit that would ripple the force spectrum.".to_owned());
        };
        let depth = decibels(hit);
        let happened = format!(
            "The force spectrum ripples by {}{depth:.1} dB every {:.1} Hz, from a second hit of {:.1} % after {:.2} ms (limit {limit:.1} dB).",
            if hit.is_deepest() { "more than " } else { "" },
            hit.ripple_period(),
            100.0 * hit.ratio,
            1e3 * hit.delay,
        );
        verdict.found(depth, outcome(hit, settings), happened)
    })
}

/// Depth of the ripple that a second hit leaves (dB).
fn decibels(hit: SecondHit) -> f64 {
    20.0 * hit.ripple_depth().log10()
}

fn outcome(hit: SecondHit, settings: &QualitySettings) -> Outcome {
    match hit.ratio >= settings.double_hit {
        true => Outcome::Bad,
        false => Outcome::Doubtful,
    }
}

/// One verdict for each tap, or one for the recording that has no force.
fn of_force(
    recording: &RecordingEvidence,
    (check, limit): (Check, f64),
    judge: impl Fn(&TapEvidence, Verdict) -> Verdict,
) -> Vec<Verdict> {
    if recording.force.is_none() {
        let file = recording.file.clone();
        return vec![Verdict::new(check, Subject::Recording { file }, limit).missing(NO_HAMMER)];
    }
    of_taps(recording, (check, limit), judge)
}

fn of_taps(
    recording: &RecordingEvidence,
    (check, limit): (Check, f64),
    judge: impl Fn(&TapEvidence, Verdict) -> Verdict,
) -> Vec<Verdict> {
    let one = |(index, tap): (usize, &TapEvidence)| {
        let subject = Subject::Tap {
            file: recording.file.clone(),
            tap: index + 1,
        };
        judge(tap, Verdict::new(check, subject, limit))
    };
    if recording.taps.is_empty() {
        let file = recording.file.clone();
        let verdict = Verdict::new(check, Subject::Recording { file }, limit);
        return vec![verdict.missing("Not applicable: no tap was found.")];
    }
    recording.taps.iter().enumerate().map(one).collect()
}

/// No sample at a channel's limit.
pub fn check_overload(recording: &RecordingEvidence) -> Vec<Verdict> {
    of_taps(
        recording,
        (Check::Overload, 0.0),
        |tap, verdict| match &tap.rejection {
            Some(Rejection::Overload { channel, samples }) => verdict.found(
                *samples as f64,
                Outcome::Bad,
                format!("Channel {channel} is at its limit for {samples} samples (limit 0)."),
            ),
            // Other reasons are looked for first: what they reject was not searched for an overload.
            Some(_) => verdict.missing("Not applicable: rejected for another reason."),
            None => verdict.found(0.0, Outcome::Good, "No channel at its limit.".to_owned()),
        },
    )
}

/// No tap far weaker than the others.
pub fn check_weak(recording: &RecordingEvidence) -> Vec<Verdict> {
    // In units of the least accepted peak.
    of_taps(
        recording,
        (Check::WeakTap, 1.0),
        |tap, verdict| match &tap.rejection {
            Some(Rejection::TooWeak { peak, limit }) => verdict.found(
                peak / limit,
                Outcome::Doubtful,
                format!(
                    "A peak of {peak:.3}, {:.2} of the least accepted {limit:.3}.",
                    peak / limit
                ),
            ),
            Some(_) => verdict.missing("Not applicable: rejected for another reason."),
            None => verdict.clear("As strong as the others.".to_owned()),
        },
    )
}

/// Largest over smallest accepted peak.
pub fn check_tap_levels(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let file = recording.file.clone();
    let verdict = Verdict::new(
        Check::TapLevels,
        Subject::Recording { file },
        settings.tap_levels,
    );
    let peaks: Vec<f64> = recording.accepted().map(|tap| tap.peak).collect();
    let smallest = peaks.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = peaks.iter().copied().fold(0.0, f64::max);
    if peaks.len() < 2 || smallest <= 0.0 {
        return verdict.missing("Not applicable: fewer than two accepted taps.");
    }
    let ratio = largest / smallest;
    let outcome = match ratio <= settings.tap_levels {
        true => Outcome::Good,
        false => Outcome::Doubtful,
    };
    let happened = format!(
        "The strongest of {} taps is {ratio:.1} times the weakest (limit {:.1}).",
        peaks.len(),
        settings.tap_levels
    );
    verdict.found(ratio, outcome, happened)
}

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
