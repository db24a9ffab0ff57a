//! The table of good practice as verdicts: how well a tap test was made.
//!
//! Each check takes plain evidence ([`RecordingEvidence`]) and returns verdicts; it rejects nothing and
//! changes no result. [`judge_recording`] makes the checks of one recording, [`judge_test`] those that
//! need several. Limits are in [`QualitySettings`], each with its source.

mod averages;
mod evidence;
mod recordings;
mod taps;
mod verdict;

pub use averages::{
    check_averages, check_coherence, check_decay, check_exponential_window,
    check_frequency_scatter, check_random_error, check_window_damping,
};
pub use evidence::{
    DampingSource, ForceEvidence, QualitySettings, RecordingEvidence, ResonanceEvidence,
    SensorEvidence, TapEvidence,
};
pub use recordings::{
    check_antiresonances, check_driving_point, check_linearity, check_mass_loading,
    check_reciprocity,
};
pub use taps::{
    check_double_hit, check_force_fall, check_force_noise, check_force_ripple, check_overload,
    check_tap_levels, check_weak,
};
pub use verdict::{Check, Outcome, Subject, Verdict};

/// All checks of one recording.
pub fn judge_recording(recording: &RecordingEvidence, settings: &QualitySettings) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    verdicts.extend(check_double_hit(recording, settings));
    verdicts.extend(check_force_ripple(recording, settings));
    verdicts.extend(check_overload(recording));
    verdicts.extend(check_weak(recording));
    verdicts.push(check_tap_levels(recording, settings));
    verdicts.push(check_force_fall(recording, settings));
    verdicts.push(check_force_noise(recording, settings));
    verdicts.push(check_averages(recording, settings));
    verdicts.extend(check_coherence(recording, settings));
    verdicts.extend(check_random_error(recording, settings));
    verdicts.push(check_decay(recording, settings));
    verdicts.push(check_exponential_window(recording, settings));
    verdicts.extend(check_window_damping(recording, settings));
    verdicts.extend(check_frequency_scatter(recording, settings));
    verdicts.extend(check_driving_point(recording, settings));
    verdicts.extend(check_antiresonances(recording, settings));
    verdicts
}

/// All checks of a test: those of each recording, then those across recordings.
pub fn judge_test(recordings: &[RecordingEvidence], settings: &QualitySettings) -> Vec<Verdict> {
    let mut verdicts: Vec<Verdict> = recordings
        .iter()
        .flat_map(|recording| judge_recording(recording, settings))
        .collect();
    verdicts.extend(check_reciprocity(recordings, settings));
    verdicts.extend(check_linearity(recordings, settings));
    verdicts.extend(check_mass_loading(recordings, settings));
    verdicts
}
