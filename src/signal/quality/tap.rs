//! Checks of each tap.

use super::{Check, Outcome, QualitySettings, RecordingEvidence, Subject, TapEvidence, Verdict};
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
