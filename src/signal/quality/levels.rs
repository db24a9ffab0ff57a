//! Whether the taps of a recording are of one level.

use super::{Check, Outcome, QualitySettings, RecordingEvidence, Subject, Verdict};

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
