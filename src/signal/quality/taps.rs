//! Checks of the taps: second hits, overload, levels, and the band that the force reaches over.

use super::{
    Check, ForceEvidence, Outcome, QualitySettings, RecordingEvidence, Subject, TapEvidence,
    Verdict,
};
use crate::taps::{Rejection, SecondHit};

const NO_HAMMER: &str = "Not applicable without a hammer: a second hit cannot be told from two modes that beat in the responses.";

/// Exactly one impact in each tap, by the force in time.
pub fn check_double_hit(recording: &RecordingEvidence, settings: &QualitySettings) -> Vec<Verdict> {
    let (check, limit) = (Check::DoubleHit, settings.double_hit);
    of_second_hits(recording, settings, check, limit, "One impact.", |hit| {
        let happened = format!(
            "A second hit of {:.1} % of the first after {:.2} ms (limit {:.0} %).",
            100.0 * hit.ratio,
            1e3 * hit.delay,
            100.0 * limit
        );
        (hit.ratio, happened)
    })
}

/// Exactly one impact in each tap, by the ripple in the force spectrum, |1 + r e^{-j omega d}|: from 1 - r to 1 + r,
/// every 1/d.
pub fn check_force_ripple(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let limit = decibels(SecondHit {
        delay: 0.0,
        ratio: settings.double_hit,
    });
    let none = "No second hit that would ripple the force spectrum.";
    of_second_hits(
        recording,
        settings,
        Check::ForceRipple,
        limit,
        none,
        |hit| {
            let depth = decibels(hit);
            let happened = format!(
                "The force spectrum ripples by {}{depth:.1} dB every {:.1} Hz, from a second hit of {:.1} % after {:.2} ms (limit {limit:.1} dB).",
                if hit.is_deepest() { "more than " } else { "" },
                hit.ripple_period(),
                100.0 * hit.ratio,
                1e3 * hit.delay,
            );
            (depth, happened)
        },
    )
}

/// Depth of the ripple that a second hit leaves (dB).
fn decibels(hit: SecondHit) -> f64 {
    20.0 * hit.ripple_depth().log10()
}

/// One verdict for each tap on its second hit, or one for a recording without a force. `found` returns the value and
/// the sentence for a second hit, `none` is the sentence without one.
fn of_second_hits(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
    check: Check,
    limit: f64,
    none: &str,
    found: impl Fn(SecondHit) -> (f64, String),
) -> Vec<Verdict> {
    if recording.force.is_none() {
        return vec![recording.verdict(check, limit).missing(NO_HAMMER)];
    }
    of_taps(recording, check, limit, |tap, verdict| {
        let Some(hit) = tap.second_hit else {
            return verdict.clear(none.to_owned());
        };
        let outcome = match hit.ratio >= settings.double_hit {
            true => Outcome::Bad,
            false => Outcome::Doubtful,
        };
        let (value, happened) = found(hit);
        verdict.found(value, outcome, happened)
    })
}

/// One verdict for each tap, or one for a recording without any.
fn of_taps(
    recording: &RecordingEvidence,
    check: Check,
    limit: f64,
    judge: impl Fn(&TapEvidence, Verdict) -> Verdict,
) -> Vec<Verdict> {
    if recording.taps.is_empty() {
        let verdict = recording.verdict(check, limit);
        return vec![verdict.missing("Not applicable: no tap was found.")];
    }
    let mut verdicts = Vec::with_capacity(recording.taps.len());
    for (number, tap) in (1..).zip(&recording.taps) {
        let subject = Subject::Tap {
            file: recording.file.clone(),
            tap: number,
        };
        verdicts.push(judge(tap, Verdict::new(check, subject, limit)));
    }
    verdicts
}

/// No sample at a channel's limit.
pub fn check_overload(recording: &RecordingEvidence) -> Vec<Verdict> {
    of_taps(recording, Check::Overload, 0.0, |tap, verdict| {
        match &tap.rejection {
            Some(Rejection::Overload { channel, samples }) => verdict.found(
                *samples as f64,
                Outcome::Bad,
                format!("Channel {channel} is at its limit for {samples} samples (limit 0)."),
            ),
            // Other reasons are looked for first: what they reject was not searched for an overload.
            Some(_) => verdict.missing("Not applicable: rejected for another reason."),
            None => verdict.found(0.0, Outcome::Good, "No channel at its limit.".to_owned()),
        }
    })
}

/// No tap far weaker than the others; value and limit are in units of the least accepted peak.
pub fn check_weak(recording: &RecordingEvidence) -> Vec<Verdict> {
    of_taps(recording, Check::WeakTap, 1.0, |tap, verdict| {
        match &tap.rejection {
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
        }
    })
}

/// Largest over smallest accepted peak.
pub fn check_tap_levels(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = recording.verdict(Check::TapLevels, settings.tap_levels);
    let peaks: Vec<f64> = recording.accepted().map(|tap| tap.peak).collect();
    let smallest = peaks.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = peaks.iter().copied().fold(0.0, f64::max);
    if peaks.len() < 2 || smallest <= 0.0 {
        return verdict.missing("Not applicable: fewer than two accepted taps.");
    }
    let ratio = largest / smallest;
    let outcome = Outcome::doubtful_unless(ratio <= settings.tap_levels);
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
    let verdict = recording.verdict(Check::ForceFall, settings.force_fall);
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
    let outcome = Outcome::doubtful_unless(fall <= settings.force_fall);
    let happened = format!(
        "The force spectrum falls by {fall:.1} dB over the band, lowest at {at:.1} Hz (limit {:.0} dB).",
        settings.force_fall
    );
    verdict.found(fall, outcome, happened)
}

/// Frequency above which the force is no longer clear of its noise.
pub fn check_force_noise(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = recording.verdict(Check::ForceNoise, recording.lines.high);
    let Some((frequencies, power)) = band_power(recording) else {
        return verdict.missing(NO_FORCE);
    };
    let force = recording.force.as_ref();
    let Some(noise) = force.and_then(|force| force.noise.as_ref()) else {
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
