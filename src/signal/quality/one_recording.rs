//! Checks of one recording's taps and of the averages over them.
//!
//! The taps: second hits, overload, levels, and the band that the force reaches over. The averages: coherence,
//! scatter, decay, and the window's share in the damping.

use std::f64::consts::TAU;

use super::{
    Check, DampingSource, Outcome, QualityVerdict, RecordingEvidence, ResonanceEvidence, Subject,
    TapEvidence, limits,
};
use crate::spectral::{Window, random_error};
use crate::taps::{Rejection, SecondHit};
use tapjoint_numerics::stats::times;

const NO_HAMMER: &str = "Not applicable without a hammer: a second hit cannot be told from two modes that beat in the responses.";

/// Exactly one impact in each tap, by the force in time.
pub(super) fn check_double_hit(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    let limit = limits::DOUBLE_HIT;
    of_second_hits(recording, Check::DoubleHit, limit, "One impact.", |hit| {
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
pub(super) fn check_force_ripple(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    let limit = decibels(SecondHit {
        delay: 0.0,
        ratio: limits::DOUBLE_HIT,
    });
    let none = "No second hit that would ripple the force spectrum.";
    of_second_hits(recording, Check::ForceRipple, limit, none, |hit| {
        let depth = decibels(hit);
        let happened = format!(
            "The force spectrum ripples by {}{depth:.1} dB every {:.1} Hz, from a second hit of {:.1} % after {:.2} ms (limit {limit:.1} dB).",
            if hit.is_deepest() { "more than " } else { "" },
            hit.ripple_period(),
            100.0 * hit.ratio,
            1e3 * hit.delay,
        );
        (depth, happened)
    })
}

/// Depth of the ripple that a second hit leaves (dB).
fn decibels(hit: SecondHit) -> f64 {
    20.0 * hit.ripple_depth().log10()
}

/// One verdict for each tap on its second hit, or one for a recording without a force. `found` returns the value and
/// the sentence for a second hit, `none` is the sentence without one.
fn of_second_hits(
    recording: &RecordingEvidence,
    check: Check,
    limit: f64,
    none: &str,
    found: impl Fn(SecondHit) -> (f64, String),
) -> Vec<QualityVerdict> {
    if recording.force.is_none() {
        return vec![recording.verdict(check, limit).missing(NO_HAMMER)];
    }
    of_taps(recording, check, limit, |tap, verdict| {
        let Some(hit) = tap.second_hit else {
            return verdict.clear(none.to_owned());
        };
        let (value, happened) = found(hit);
        let outcome = match hit.ratio >= limits::DOUBLE_HIT {
            true => Outcome::Bad,
            false => Outcome::Doubtful,
        };
        verdict.found(value, outcome, happened)
    })
}

/// One verdict for each tap, or one for a recording without any.
fn of_taps(
    recording: &RecordingEvidence,
    check: Check,
    limit: f64,
    judge: impl Fn(&TapEvidence, QualityVerdict) -> QualityVerdict,
) -> Vec<QualityVerdict> {
    if recording.taps.is_empty() {
        let verdict = recording.verdict(check, limit);
        return vec![verdict.missing("Not applicable: no tap was found.")];
    }
    let taps = (1..).zip(&recording.taps);
    taps.map(|(number, tap)| {
        let file = recording.file.clone();
        let subject = Subject::Tap { file, tap: number };
        judge(tap, QualityVerdict::new(check, subject, limit))
    })
    .collect()
}

/// No sample at a channel's limit.
pub(super) fn check_overload(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    of_taps(recording, Check::Overload, 0.0, |tap, verdict| {
        match &tap.rejection {
            Some(Rejection::Overload(overload)) => verdict.found(
                overload.samples as f64,
                Outcome::Bad,
                format!("{} (limit 0).", overload.to_string().replacen('c', "C", 1)),
            ),
            // Other reasons are looked for first: what they reject was not searched for an overload.
            Some(_) => verdict.missing("Not applicable: rejected for another reason."),
            None => match tap.overload {
                Some(overload) => verdict.found(
                    overload.samples as f64,
                    Outcome::Doubtful,
                    format!(
                        "{} (limit 0); only the decay is used.",
                        overload.to_string().replacen('c', "C", 1)
                    ),
                ),
                None => verdict.found(0.0, Outcome::Good, "No channel at its limit.".to_owned()),
            },
        }
    })
}

/// No tap far weaker than the others; value and limit are in units of the least accepted peak.
pub(super) fn check_weak(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    of_taps(recording, Check::WeakTap, 1.0, |tap, verdict| {
        match tap.rejection.as_ref().or(tap.overruled.as_ref()) {
            Some(Rejection::TooWeak { peak, limit }) => {
                let share = peak / limit;
                let happened =
                    format!("A peak of {peak:.3}, {share:.2} of the least accepted {limit:.3}.");
                verdict.found(share, Outcome::Doubtful, happened)
            }
            Some(_) if tap.rejection.is_some() => {
                verdict.missing("Not applicable: rejected for another reason.")
            }
            _ => verdict.clear("As strong as the others.".to_owned()),
        }
    })
}

/// Largest over smallest accepted peak that was not cut off.
pub(super) fn check_tap_levels(recording: &RecordingEvidence) -> QualityVerdict {
    let verdict = recording.verdict(Check::TapLevels, limits::TAP_LEVELS);
    let taps = recording.accepted().filter(|tap| tap.has_peak());
    let peaks: Vec<f64> = taps.map(|tap| tap.peak).collect();
    let smallest = peaks.iter().copied().fold(f64::INFINITY, f64::min);
    if peaks.len() < 2 || smallest <= 0.0 {
        return verdict.missing("Not applicable: fewer than two accepted taps with a known peak.");
    }
    let ratio = peaks.iter().copied().fold(0.0, f64::max) / smallest;
    let outcome = Outcome::doubtful_unless(ratio <= limits::TAP_LEVELS);
    let happened = format!(
        "The strongest of {} taps is {ratio:.1} times the weakest (limit {:.1}).",
        peaks.len(),
        limits::TAP_LEVELS
    );
    verdict.found(ratio, outcome, happened)
}

/// Lines to either side over which the force is smoothed: a single line's noise is no fall.
const SMOOTHING: usize = 2;
const NO_FORCE: &str = "Not applicable without a hammer: the force is not known.";

/// Fall of the force spectrum over the band, largest over smallest.
pub(super) fn check_force_fall(recording: &RecordingEvidence) -> QualityVerdict {
    let verdict = recording.verdict(Check::ForceFall, limits::FORCE_FALL);
    let Some((frequencies, power)) = band_power(recording) else {
        return verdict.missing(NO_FORCE);
    };
    let largest = power.iter().copied().fold(0.0, f64::max);
    let lines = frequencies.iter().zip(&power);
    let lowest = lines.min_by(|a, b| a.1.total_cmp(b.1));
    let Some((at, &smallest)) = lowest.filter(|(_, power)| **power > 0.0) else {
        return verdict.missing("Not applicable: the force has no power.");
    };
    // Level difference of two powers, 10 log10 (dB).
    let fall = 10.0 * (largest / smallest).log10();
    let outcome = Outcome::doubtful_unless(fall <= limits::FORCE_FALL);
    let happened = format!(
        "The force spectrum falls by {fall:.1} dB over the band, lowest at {at:.1} Hz (limit {:.0} dB).",
        limits::FORCE_FALL
    );
    verdict.found(fall, outcome, happened)
}

/// Frequency above which the force is no longer clear of its noise.
pub(super) fn check_force_noise(recording: &RecordingEvidence) -> QualityVerdict {
    let (high, over) = (recording.lines.high, limits::FORCE_OVER_NOISE);
    let verdict = recording.verdict(Check::ForceNoise, high);
    let Some((frequencies, power)) = band_power(recording) else {
        return verdict.missing(NO_FORCE);
    };
    let force = recording.force.as_ref();
    let Some(noise) = force.and_then(|force| force.noise.as_ref()) else {
        return verdict.missing("Not applicable: no quiet stretch tells the force's noise.");
    };
    let clear = 10f64.powf(over / 10.0);
    let mut lines = power.iter().zip(smoothed(noise));
    let sinks = lines.position(|(p, n)| *p < clear * n);
    match sinks.and_then(|index| frequencies.get(index)) {
        None => verdict.clear(format!(
            "The force stays {over:.0} dB above its noise up to {high:.1} Hz."
        )),
        Some(&at) => verdict.found(
            at,
            Outcome::Doubtful,
            format!(
                "At {at:.1} Hz the force comes within {over:.0} dB of its noise; the band ends at {high:.1} Hz."
            ),
        ),
    }
}

/// Frequencies (Hz) and smoothed power of the force; `None` without any.
fn band_power(recording: &RecordingEvidence) -> Option<(Vec<f64>, Vec<f64>)> {
    let spectrum = &recording.force.as_ref()?.spectrum;
    (!spectrum.is_empty()).then(|| (recording.lines.frequencies(), smoothed(spectrum)))
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

/// Enough taps.
pub(super) fn check_averages(recording: &RecordingEvidence) -> QualityVerdict {
    let (enough, trusted) = (limits::AVERAGES, limits::TRUSTED_AVERAGES);
    let count = recording.averages();
    let (outcome, meaning) = match count {
        0 => (Outcome::Bad, "there is no spectrum"),
        1 => (
            Outcome::Bad,
            "nothing shows how well it repeats, and a coherence of 1 means nothing",
        ),
        n if n < enough => (Outcome::Doubtful, "chance alone gives a high coherence"),
        n if n < trusted => (Outcome::Good, "enough for FRFs, few for the coherence"),
        _ => (Outcome::Good, "enough for FRFs and coherence"),
    };
    let happened = format!(
        "{count} of {} taps are averaged: {meaning} (at least {enough}, {trusted} for the coherence).",
        recording.taps.len()
    );
    let verdict = recording.verdict(Check::Averages, enough as f64);
    verdict.found(count as f64, outcome, happened)
}

/// Coherence at each resonance, of the sensor that sees it best.
pub(super) fn check_coherence(
    recording: &RecordingEvidence,
    mode: &ResonanceEvidence,
) -> QualityVerdict {
    let limit = limits::COHERENCE;
    let verdict = recording.mode_verdict(Check::Coherence, mode, limit);
    let (sensor, value) = match coherence_at(recording, mode) {
        Ok(found) => found,
        Err(why) => return verdict.missing(why),
    };
    let outcome = match value {
        v if v >= limit => Outcome::Good,
        v if v >= 0.5 => Outcome::Doubtful,
        _ => Outcome::Bad,
    };
    let happened = format!(
        "Coherence {value:.3} of sensor {sensor} over {} taps (limit {limit:.2}; trusted from {} taps).",
        recording.averages(),
        limits::TRUSTED_AVERAGES
    );
    verdict.found(value, outcome, happened)
}

/// Random error of the FRF's magnitude at each resonance.
pub(super) fn check_random_error(
    recording: &RecordingEvidence,
    mode: &ResonanceEvidence,
) -> QualityVerdict {
    let limit = limits::RANDOM_ERROR;
    let verdict = recording.mode_verdict(Check::RandomError, mode, limit);
    let (sensor, coherence) = match coherence_at(recording, mode) {
        Ok(found) => found,
        Err(why) => return verdict.missing(why),
    };
    let Some(error) = random_error(coherence, recording.averages()) else {
        return verdict.missing("Not applicable: the coherence is 0.");
    };
    let outcome = match error / limit {
        e if e <= 1.0 => Outcome::Good,
        e if e <= 4.0 => Outcome::Doubtful,
        _ => Outcome::Bad,
    };
    let happened = format!(
        "The FRF of sensor {sensor} has a random error of {:.1} % from {} taps (limit {:.0} %).",
        100.0 * error,
        recording.averages(),
        100.0 * limit
    );
    verdict.found(error, outcome, happened)
}

/// Name and coherence of the sensor that sees a resonance best, or why there is none.
fn coherence_at<'a>(
    recording: &'a RecordingEvidence,
    mode: &ResonanceEvidence,
) -> Result<(&'a str, f64), &'static str> {
    if recording.force.is_none() {
        return Err("Not applicable without a hammer: there is no coherence.");
    }
    match recording.averages() {
        0 | 1 => {
            return Err("Not applicable: the coherence of one tap is 1 whatever was measured.");
        }
        n if n < limits::AVERAGES => {
            return Err("Not applicable: with two taps chance alone gives a coherence up to 0.95.");
        }
        _ => {}
    }
    // The highest coherence decides: levels of different quantities cannot be compared.
    let line = recording.lines.nearest(mode.frequency);
    let known = recording.sensors.iter().filter_map(|sensor| {
        let coherence = sensor.coherence.as_ref()?.get(line)?;
        Some((sensor.name.as_str(), *coherence))
    });
    known
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or("Not applicable: no coherence was computed.")
}

/// Quantile of the normal distribution beyond which one in a hundred lies.
const ONE_IN_A_HUNDRED: f64 = 2.326;
/// Unit of a scatter held against what noise explains.
const TIMES_NOISE: &str = "times noise";

/// Scatter of each frequency from tap to tap, against the limit and against what noise explains.
pub(super) fn check_frequency_scatter(
    recording: &RecordingEvidence,
    mode: &ResonanceEvidence,
) -> QualityVerdict {
    let (limit, least) = (limits::FREQUENCY_SCATTER, limits::LEAST_SCATTER);
    let verdict = recording.mode_verdict(Check::FrequencyScatter, mode, limit);
    let count = mode.tap_frequencies.len();
    if count < 2 {
        return verdict.missing("Not applicable: fewer than two taps were read one by one.");
    }
    let freedom = (count - 1) as f64;
    let mean = mode.tap_frequencies.iter().sum::<f64>() / count as f64;
    let squares = mode.tap_frequencies.iter().map(|x| (x - mean) * (x - mean));
    let scatter = (squares.sum::<f64>() / freedom).sqrt();
    let relative = scatter / mode.frequency;
    let explained = mode.tap_std.filter(|std| *std > 0.0);
    let excess = explained.map(|std| scatter / std);
    // The ratio s/sigma that one in a hundred samples exceeds: sqrt(chi2_{0.99}(k)/k) with k degrees of freedom and
    // chi2_p(k) = k (1 - 2/(9k) + z_p sqrt(2/(9k)))^3 (Wilson and Hilferty, 1931).
    let share = 2.0 / (9.0 * freedom);
    let largest = (1.0 - share + ONE_IN_A_HUNDRED * share.sqrt()).powf(1.5);
    let beyond_noise = excess.is_some_and(|excess| excess > largest);
    let mut small = String::new();
    let outcome = match relative {
        _ if relative > limit => Outcome::Bad,
        _ if !beyond_noise => Outcome::Good,
        _ if relative > least => Outcome::Doubtful,
        _ => {
            small = format!("; a scatter up to {:.3} % is no doubt", 100.0 * least);
            Outcome::Good
        }
    };
    let noise = excess.map_or("what noise explains is not known".to_owned(), |excess| {
        let excess = times(excess);
        format!("{excess} times what noise explains, where chance reaches {largest:.1}")
    });
    let held_against = match outcome {
        Outcome::Doubtful => "bad from",
        _ => "limit",
    };
    let happened = format!(
        "The frequency scatters by {:.4} % over {count} taps, {noise}{small} ({held_against} {:.0} %).",
        100.0 * relative,
        100.0 * limit
    );
    // What decides is shown: a doubt comes of the noise's share, not of the limit.
    match excess.filter(|_| outcome == Outcome::Doubtful) {
        Some(excess) => {
            let verdict = verdict.against(largest, TIMES_NOISE);
            verdict.found(excess, outcome, happened)
        }
        None => verdict.found(relative, outcome, happened),
    }
}

const NO_WINDOW: &str = "Not applicable: no exponential window was used.";

/// Level left at the record's end, under the window.
pub(super) fn check_decay(recording: &RecordingEvidence) -> QualityVerdict {
    let limit = limits::REMAINING;
    let verdict = recording.verdict(Check::Decay, limit);
    let Some(decay) = recording.decay else {
        return verdict.missing("Not applicable: no tap was accepted.");
    };
    let duration = recording.lines.duration;
    let left = decay.remaining * (-recording.window.added_decay() * duration).exp();
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
        "At the end of the {duration:.2} s record {:.1} % of the response are left{windowed} (limit {:.0} %).",
        100.0 * left,
        100.0 * limit
    );
    verdict.found(left, outcome, happened)
}

/// An exponential window only on records that decay far enough by themselves.
pub(super) fn check_exponential_window(recording: &RecordingEvidence) -> QualityVerdict {
    let limit = limits::REMAINING_FOR_WINDOW;
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
pub(super) fn check_window_damping(
    recording: &RecordingEvidence,
    mode: &ResonanceEvidence,
) -> QualityVerdict {
    let limit = limits::WINDOW_SHARE;
    let verdict = recording.mode_verdict(Check::WindowDamping, mode, limit);
    let added = recording.window.added_decay();
    if added <= 0.0 {
        return verdict.missing(NO_WINDOW);
    }
    if mode.damping_from == DampingSource::Decays {
        return verdict
            .missing("Not applicable: the damping was fitted to the decays, without the window.");
    }
    let Some(apparent) = mode.apparent_damping_ratio.filter(|ratio| *ratio > 0.0) else {
        return verdict.missing("Not applicable: no damping was read.");
    };
    let share = added / (TAU * mode.frequency) / apparent;
    // The pole moves by exactly a, so that zeta = zeta_hat - a/omega; from share 1 on no damping is left that
    // could be told from an error.
    let own = apparent - added / (TAU * mode.frequency);
    let (outcome, rest) = if own > 0.0 {
        let outcome = Outcome::doubtful_unless(share <= limit);
        (outcome, format!("{own:.5} is the structure's"))
    } else {
        let none = "so none is left, and it is not stated";
        (Outcome::Bad, none.to_owned())
    };
    let happened = format!(
        "The window makes {:.0} % of the damping ratio {apparent:.5}, {rest} (limit {:.0} %).",
        100.0 * share,
        100.0 * limit
    );
    verdict.found(share, outcome, happened)
}
