//! Checks of the averages over taps: coherence, scatter, decay, and the window's share in the damping.

use std::f64::consts::TAU;

use super::{
    Check, DampingSource, Outcome, QualitySettings, RecordingEvidence, ResonanceEvidence, Verdict,
};
use crate::spectral::{Window, random_error};
use tapjoint_numerics::stats::times;

/// Quantile of the normal distribution beyond which one in a hundred lies.
const ONE_IN_A_HUNDRED: f64 = 2.326;

/// Enough taps.
pub fn check_averages(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = recording.verdict(Check::Averages, settings.averages as f64);
    let count = recording.averages();
    let (outcome, meaning) = match count {
        0 => (Outcome::Bad, "there is no spectrum"),
        1 => (
            Outcome::Bad,
            "nothing shows how well it repeats, and a coherence of 1 means nothing",
        ),
        n if n < settings.averages => (Outcome::Doubtful, "chance alone gives a high coherence"),
        n if n < settings.trusted_averages => {
            (Outcome::Good, "enough for FRFs, few for the coherence")
        }
        _ => (Outcome::Good, "enough for FRFs and coherence"),
    };
    let happened = format!(
        "{count} of {} taps are averaged: {meaning} (at least {}, {} for the coherence).",
        recording.taps.len(),
        settings.averages,
        settings.trusted_averages
    );
    verdict.found(count as f64, outcome, happened)
}

/// Coherence at each resonance, of the sensor that sees it best.
pub fn check_coherence(recording: &RecordingEvidence, settings: &QualitySettings) -> Vec<Verdict> {
    let modes = recording.resonances.iter();
    modes.map(|mode| {
        let verdict = recording.mode_verdict(Check::Coherence, mode, settings.coherence);
        let (sensor, value) = match coherence_at(recording, mode, settings) {
            Ok(found) => found,
            Err(why) => return verdict.missing(why),
        };
        let outcome = match value {
            v if v >= settings.coherence => Outcome::Good,
            v if v >= 0.5 => Outcome::Doubtful,
            _ => Outcome::Bad,
        };
        let happened = format!(
            "Coherence {value:.3} of sensor {sensor} over {} taps (limit {:.2}; trusted from {} taps).",
            recording.averages(),
            settings.coherence,
            settings.trusted_averages
        );
        verdict.found(value, outcome, happened)
    })
    .collect()
}

/// Random error of the FRF's magnitude at each resonance.
pub fn check_random_error(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let modes = recording.resonances.iter();
    modes.map(|mode| {
        let verdict = recording.mode_verdict(Check::RandomError, mode, settings.random_error);
        let (sensor, coherence) = match coherence_at(recording, mode, settings) {
            Ok(found) => found,
            Err(why) => return verdict.missing(why),
        };
        let Some(error) = random_error(coherence, recording.averages()) else {
            return verdict.missing("Not applicable: the coherence is 0.");
        };
        let outcome = match error / settings.random_error {
            e if e <= 1.0 => Outcome::Good,
            e if e <= 4.0 => Outcome::Doubtful,
            _ => Outcome::Bad,
        };
        let happened = format!(
            "The FRF of sensor {sensor} has a random error of {:.1} % from {} taps (limit {:.0} %).",
            100.0 * error,
            recording.averages(),
            100.0 * settings.random_error
        );
        verdict.found(error, outcome, happened)
    })
    .collect()
}

/// Name and coherence of the sensor that sees a resonance best, or why there is none.
fn coherence_at<'a>(
    recording: &'a RecordingEvidence,
    mode: &ResonanceEvidence,
    settings: &QualitySettings,
) -> Result<(&'a str, f64), &'static str> {
    if recording.force.is_none() {
        return Err("Not applicable without a hammer: there is no coherence.");
    }
    match recording.averages() {
        0 | 1 => {
            return Err("Not applicable: the coherence of one tap is 1 whatever was measured.");
        }
        n if n < settings.averages => {
            return Err("Not applicable: with two taps chance alone gives a coherence up to 0.95.");
        }
        _ => {}
    }
    let line = recording.lines.nearest(mode.frequency);
    recording
        .best_coherence(line)
        .ok_or("Not applicable: no coherence was computed.")
}

/// Scatter of each frequency from tap to tap, against the limit and against what noise explains.
pub fn check_frequency_scatter(
    recording: &RecordingEvidence,
    settings: &QualitySettings,
) -> Vec<Verdict> {
    let modes = recording.resonances.iter();
    modes
        .map(|mode| {
            let limit = settings.frequency_scatter;
            let verdict = recording.mode_verdict(Check::FrequencyScatter, mode, limit);
            let Some(scatter) = deviation(&mode.tap_frequencies) else {
                return verdict
                    .missing("Not applicable: fewer than two taps were read one by one.");
            };
            let relative = scatter / mode.frequency;
            let explained = mode.tap_std.filter(|std| *std > 0.0);
            let excess = explained.map(|std| scatter / std);
            let largest = largest_ratio(mode.tap_frequencies.len());
            let beyond_noise = excess.is_some_and(|excess| excess > largest);
            let (outcome, small) = match relative {
                _ if relative > limit => (Outcome::Bad, String::new()),
                _ if !beyond_noise => (Outcome::Good, String::new()),
                _ if relative > settings.least_scatter => (Outcome::Doubtful, String::new()),
                _ => (
                    Outcome::Good,
                    format!(
                        "; up to {:.3} % is none to doubt",
                        100.0 * settings.least_scatter
                    ),
                ),
            };
            let noise = excess.map_or("what noise explains is not known".to_owned(), |excess| {
                let excess = times(excess);
                format!("{excess} times what noise explains, where chance reaches {largest:.1}")
            });
            let limit = match outcome {
                Outcome::Doubtful => format!("bad from {:.0} %", 100.0 * limit),
                _ => format!("limit {:.0} %", 100.0 * limit),
            };
            let happened = format!(
                "The frequency scatters by {:.4} % over {} taps, {noise}{small} ({limit}).",
                100.0 * relative,
                mode.tap_frequencies.len()
            );
            // What decides is shown: a doubt comes of the noise's share, not of the limit.
            match excess.filter(|_| outcome == Outcome::Doubtful) {
                Some(excess) => verdict
                    .against(largest, TIMES_NOISE)
                    .found(excess, outcome, happened),
                None => verdict.found(relative, outcome, happened),
            }
        })
        .collect()
}

/// Unit of a scatter held against what noise explains.
const TIMES_NOISE: &str = "times noise";

/// Sample standard deviation; `None` of fewer than two.
fn deviation(values: &[f64]) -> Option<f64> {
    if values.len() < 2 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    Some((squares / (values.len() - 1) as f64).sqrt())
}

/// The ratio s/sigma that one in a hundred samples of `count` exceeds: sqrt(chi2_{0.99}(k)/k), k = count
/// - 1, with chi2_p(k) = k (1 - 2/(9k) + z_p sqrt(2/(9k)))^3 (Wilson and Hilferty, 1931).
fn largest_ratio(count: usize) -> f64 {
    let k = count.saturating_sub(1).max(1) as f64;
    let share = 2.0 / (9.0 * k);
    (1.0 - share + ONE_IN_A_HUNDRED * share.sqrt()).powf(1.5)
}

const NO_WINDOW: &str = "Not applicable: no exponential window was used.";

/// Level left at the record's end, under the window.
pub fn check_decay(recording: &RecordingEvidence, settings: &QualitySettings) -> Verdict {
    let verdict = recording.verdict(Check::Decay, settings.remaining);
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
    let verdict = recording.verdict(Check::ExponentialWindow, limit);
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
    let modes = recording.resonances.iter();
    modes.map(|mode| {
        let verdict = recording.mode_verdict(Check::WindowDamping, mode, settings.window_share);
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
        // The pole moves by exactly a, so that zeta = zeta_hat - a/omega; from share 1 on no damping is left that
        // could be told from an error.
        let own = apparent - added / (TAU * mode.frequency);
        let (outcome, rest) = if own > 0.0 {
            let outcome = Outcome::doubtful_unless(share <= settings.window_share);
            (outcome, format!("{own:.5} is the structure's"))
        } else {
            let none = "so that none is left: it is refused";
            (Outcome::Bad, none.to_owned())
        };
        let happened = format!(
            "Of the damping ratio {apparent:.5} the window makes {:.0} %, {rest} (limit {:.0} %).",
            100.0 * share,
            100.0 * settings.window_share
        );
        verdict.found(share, outcome, happened)
    })
    .collect()
}
