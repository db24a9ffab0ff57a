//! Whether the records ring down, and what a window does to their damping.

use std::f64::consts::TAU;

use super::averages::of_mode;
use super::{
    Check, DampingSource, Outcome, QualitySettings, RecordingEvidence, ResonanceEvidence, Subject,
    Verdict,
};
use crate::spectral::Window;

const NO_WINDOW: &str = "Not applicable: no exponential window was used.";

fn of_recording(recording: &RecordingEvidence, check: Check, limit: f64) -> Verdict {
    let file = recording.file.clone();
    Verdict::new(check, Subject::Recording { file }, limit)
}

/// Level left at the record's end, under the window.
pub fn check_decay(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = of_recording(recording, Check::Decay, settings.remaining);
    let Some(decay) = recording.decay else {
        return verdict.missing("Not applicable: no tap was accepted.");
    };
    let window = (-recording.window.added_decay() * recording.lines.duration).exp();
    let left = decay.remaining * window;
    let limit = settings.remaining;
    // What has sunk into the noise has rung down as far as it can be seen.
    let outcome = match left {
        l if l <= limit * (1.0 + 1e-9) || decay.remaining <= decay.noise => Outcome::Good,
        // 10 % is what a record of half the needed length leaves.
        l if l <= limit.sqrt() => Outcome::Doubtful,
        _ => Outcome::Bad,
    };
    let windowed = match recording.window {
        Window::Exponential { .. } => {
            format!(", {:.1} % before the window", 100.0 * decay.remaining)
        }
        _ => String::new(),
    };
    let happened = format!(
        "At the end of the {:.2} s record {:.1} % of the response are left{windowed} (limit {:.0} %).",
        recording.lines.duration,
        100.0 * left,
        100.0 * limit
    );
    verdict.found(left, outcome, happened)
}

/// An exponential window only on records that decay far enough by themselves.
pub fn check_exponential_window(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Verdict {
    let limit = settings.remaining_for_window;
    let verdict = of_recording(recording, Check::ExponentialWindow, limit);
    let (Window::Exponential { decay: added }, Some(decay)) = (recording.window, recording.decay)
    else {
        return verdict.missing(NO_WINDOW);
    };
    let outcome = match decay.remaining <= limit {
        true => Outcome::Good,
        false => Outcome::Bad,
    };
    let happened = format!(
        "An exponential window of {added:.2} 1/s on a record that keeps {:.1} % by itself (limit {:.0} %).",
        100.0 * decay.remaining,
        100.0 * limit
    );
    verdict.found(decay.remaining, outcome, happened)
}

/// The window's share in each damping, (a/omega)/zeta_hat; from 1 on no damping is left.
pub fn check_window_damping(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let of_mode = |mode: &ResonanceEvidence| {
        let verdict = of_mode(
            recording,
            Check::WindowDamping,
            (mode, settings.window_share),
        );
        let added = recording.window.added_decay();
        if added <= 0.0 {
            return verdict.missing(NO_WINDOW);
        }
        if mode.damping_from == DampingSource::Decays {
            return verdict.missing(
                "Not applicable: the damping was fitted to the decays, without the window.",
            );
        }
        let Some(apparent) = mode.apparent_damping_ratio.filter(|ratio| *ratio > 0.0) else {
            return verdict.missing("Not applicable: no damping was read.");
        };
        let share = added / (TAU * mode.frequency) / apparent;
        let (outcome, rest) = match corrected_damping(apparent, added, mode.frequency) {
            None => (
                Outcome::Bad,
                "so that none is left: it is refused".to_owned(),
            ),
            Some(own) => {
                let good = share <= settings.window_share;
                let outcome = if good {
                    Outcome::Good
                } else {
                    Outcome::Doubtful
                };
                (outcome, format!("{own:.5} is the structure's"))
            }
        };
        let happened = format!(
            "Of the damping ratio {apparent:.5} the window makes {:.0} %, {rest} (limit {:.0} %).",
            100.0 * share,
            100.0 * settings.window_share
        );
        verdict.found(share, outcome, happened)
    };
    recording.resonances.iter().map(of_mode).collect()
}

/// Damping ratio without the window's share: the pole moves by exactly a, zeta = zeta_hat - a/omega.
/// `None` where a/omega >= zeta_hat: no damping is left that could be told from an error.
///
/// `added_decay` is a (1/s), `frequency` in Hz.
fn corrected_damping(apparent: f64, added_decay: f64, frequency: f64) -> Option<f64> {
    let own = apparent - added_decay / (TAU * frequency);
    (own > 0.0).then_some(own)
}
