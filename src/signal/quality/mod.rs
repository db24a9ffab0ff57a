//! The table of good practice as verdicts: how well a tap test was made.
//!
//! Each check takes plain evidence ([`RecordingEvidence`]) and returns verdicts; it rejects nothing and
//! changes no result. [`judge_recording`] makes the checks of one recording, [`judge_test`] those that
//! need several. The [`limits`] are constants, each with its source.

mod one_recording;
mod recordings;
mod verdict;

use num_complex::Complex64;

use crate::recording::ResponseForm;
use crate::spectral::{DecayCheck, Lines, Window};
use crate::taps::{Overload, Rejection, SecondHit, Tap};
use tapjoint_numerics::stats::median;

pub use verdict::{Check, Outcome, QualityVerdict, Subject, remedy_of};

/// All checks of one recording.
pub fn judge_recording(recording: &RecordingEvidence) -> Vec<QualityVerdict> {
    let mut verdicts = one_recording::check_double_hit(recording);
    verdicts.extend(one_recording::check_force_ripple(recording));
    verdicts.extend(one_recording::check_overload(recording));
    verdicts.extend(one_recording::check_weak(recording));
    verdicts.push(one_recording::check_tap_levels(recording));
    verdicts.push(one_recording::check_force_fall(recording));
    verdicts.push(one_recording::check_force_noise(recording));
    verdicts.push(one_recording::check_averages(recording));
    verdicts.extend(recording.of_modes(one_recording::check_coherence));
    verdicts.extend(recording.of_modes(one_recording::check_random_error));
    verdicts.push(one_recording::check_decay(recording));
    verdicts.push(one_recording::check_exponential_window(recording));
    verdicts.extend(recording.of_modes(one_recording::check_window_damping));
    verdicts.extend(recording.of_modes(one_recording::check_frequency_scatter));
    verdicts.extend(recordings::check_driving_point(recording));
    verdicts.extend(recordings::check_antiresonances(recording));
    verdicts
}

/// All checks of a test: those of each recording, then those across recordings.
pub fn judge_test(recordings: &[RecordingEvidence]) -> Vec<QualityVerdict> {
    let mut verdicts: Vec<QualityVerdict> = recordings.iter().flat_map(judge_recording).collect();
    verdicts.extend(recordings::check_reciprocity(recordings));
    verdicts.extend(recordings::check_linearity(recordings));
    verdicts.extend(recordings::check_mass_loading(recordings));
    verdicts
}

/// One tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapEvidence {
    /// Peak of the force (N), or of the response (its unit).
    pub peak: f64,
    /// A second hit in its force, if any.
    pub second_hit: Option<SecondHit>,
    /// Samples at the limit of a channel, if any.
    pub overload: Option<Overload>,
    /// Why it was rejected; `None` = accepted.
    pub rejection: Option<Rejection>,
    /// Why it would have been rejected, had it not been accepted by hand.
    pub overruled: Option<Rejection>,
}

impl TapEvidence {
    /// Returns false where its peak was cut off.
    fn has_peak(&self) -> bool {
        self.overload.is_none_or(|overload| !overload.is_force)
    }
}

impl From<&Tap> for TapEvidence {
    fn from(tap: &Tap) -> Self {
        TapEvidence {
            peak: tap.peak,
            second_hit: tap.second_hit,
            overload: tap.overload,
            rejection: tap.rejection.clone(),
            overruled: tap.overruled.clone(),
        }
    }
}

/// The force's spectrum over the accepted taps, line by line.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceEvidence {
    /// Root mean square of the taps' transforms (N s).
    pub spectrum: Vec<f64>,
    /// Part of the channel's noise alone (N s); `None` where it is not known.
    pub noise: Option<Vec<f64>>,
}

/// One sensor as placed in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorEvidence {
    /// Its name.
    pub name: String,
    /// Position (m); `None` where it is not given.
    pub position: Option<f64>,
    /// Form of its FRF; `None` for a quantity whose phase to the force means nothing, such as sound.
    pub form: Option<ResponseForm>,
    /// H1, line by line (unit of the response per N); `None` without a hammer.
    pub frf: Option<Vec<Complex64>>,
    /// Coherence, line by line; `None` where it does not exist.
    pub coherence: Option<Vec<f64>>,
}

/// Source of a damping.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DampingSource {
    /// Spectra, under their window.
    Spectra,
    /// Decays without any window.
    Decays,
}

/// One resonance.
#[derive(Debug, Clone, PartialEq)]
pub struct ResonanceEvidence {
    /// Its frequency (Hz).
    pub frequency: f64,
    /// `false` for a peak that has no mode number, where other peaks of the recording have one.
    pub is_mode: bool,
    /// Standard deviation of the frequency (Hz); `None` where it is not known.
    pub std: Option<f64>,
    /// Damping ratio as the spectra show it, the window's share in it.
    pub apparent_damping_ratio: Option<f64>,
    /// Source of the damping.
    pub damping_from: DampingSource,
    /// Frequency of each tap alone (Hz); empty where they were not read.
    pub tap_frequencies: Vec<f64>,
    /// Standard deviation of one tap's frequency that the noise explains (Hz).
    pub tap_std: Option<f64>,
}

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingEvidence {
    /// Its name.
    pub file: String,
    /// Position of the hammer (m); `None` where it is not given.
    pub tap_position: Option<f64>,
    /// Free length of the beam (m), where the clamp was moved for this recording. Places count from the moved clamp.
    pub free_length: Option<f64>,
    /// Position (m) and mass (kg) of each mass fastened to the beam for this recording.
    pub fastened: Vec<(f64, f64)>,
    /// All taps, accepted and rejected, in order of time.
    pub taps: Vec<TapEvidence>,
    /// The axis of all that is given line by line.
    pub lines: Lines,
    /// The force; `None` without a hammer.
    pub force: Option<ForceEvidence>,
    /// The sensors.
    pub sensors: Vec<SensorEvidence>,
    /// The resonances, ascending.
    pub resonances: Vec<ResonanceEvidence>,
    /// Decay of the slowest response without a window; `None` without an accepted tap.
    pub decay: Option<DecayCheck>,
    /// The window applied.
    pub window: Window,
}

impl RecordingEvidence {
    /// Number of taps averaged: with a hammer those that were not overloaded.
    pub fn averages(&self) -> usize {
        let taps = self.accepted();
        taps.filter(|tap| self.force.is_none() || tap.overload.is_none())
            .count()
    }

    /// The taps that are used.
    fn accepted(&self) -> impl Iterator<Item = &TapEvidence> {
        self.taps.iter().filter(|tap| tap.rejection.is_none())
    }

    /// Median peak of the accepted taps whose peak is known; `None` without any.
    fn tap_level(&self) -> Option<f64> {
        let taps = self.accepted().filter(|tap| tap.has_peak());
        let mut peaks: Vec<f64> = taps.map(|tap| tap.peak).collect();
        (!peaks.is_empty()).then(|| median(&mut peaks))
    }

    /// One verdict for each resonance.
    fn of_modes(
        &self,
        check: fn(&RecordingEvidence, &ResonanceEvidence) -> QualityVerdict,
    ) -> impl Iterator<Item = QualityVerdict> {
        self.resonances.iter().map(move |mode| check(self, mode))
    }

    /// Begins a verdict on this recording.
    fn verdict(&self, check: Check, limit: f64) -> QualityVerdict {
        let file = self.file.clone();
        QualityVerdict::new(check, Subject::Recording { file }, limit)
    }

    /// Begins a verdict on a mode of this recording.
    fn mode_verdict(&self, check: Check, mode: &ResonanceEvidence, limit: f64) -> QualityVerdict {
        let subject = Subject::Mode {
            file: self.file.clone(),
            frequency: mode.frequency,
            is_mode: mode.is_mode,
        };
        QualityVerdict::new(check, subject, limit)
    }

    /// Begins a verdict on a sensor of this recording.
    fn sensor_verdict(&self, check: Check, sensor: &SensorEvidence, limit: f64) -> QualityVerdict {
        let subject = Subject::Sensor {
            file: self.file.clone(),
            sensor: sensor.name.clone(),
        };
        QualityVerdict::new(check, subject, limit)
    }
}

/// Limits, each with its source. "ISO 7626-5" is ISO 7626-5:2019, impact excitation, in the reading of
/// field practice.
pub mod limits {
    /// Second hit over the first that rejects a tap. 0.1: a ripple of 1.7 dB in the force spectrum
    /// (field practice after ISO 7626-5: one impact per record).
    pub const DOUBLE_HIT: f64 = 0.1;
    /// Fall of the force spectrum over the band (dB). 20: 10 to 20 dB are common, beyond that the far end
    /// is hardly excited (ISO 7626-5).
    pub const FORCE_FALL: f64 = 20.0;
    pub use crate::taps::FORCE_OVER_NOISE;
    /// Largest over smallest accepted tap. 3: 10 dB, one range of an amplifier; wider, a joint that is not
    /// linear shows in the averages.
    pub const TAP_LEVELS: f64 = 3.0;
    /// Fewest taps that are enough. 3 (ISO 7626-5: 3 to 5).
    pub const AVERAGES: usize = 3;
    /// Fewest taps from which a coherence is trusted. 5: chance alone gives 1 - 0.05^(1/(n-1)), 0.53 for 5
    /// taps and 0.78 for 3.
    pub const TRUSTED_AVERAGES: usize = 5;
    /// High coherence. 0.9 (ISO 7626-5).
    pub const COHERENCE: f64 = 0.9;
    /// Random error of an FRF's magnitude at a resonance. 5 % (ISO 7626-5).
    pub const RANDOM_ERROR: f64 = 0.05;
    /// Level left at the record's end. 1 % (ISO 7626-5: 10 % at half time).
    pub const REMAINING: f64 = 0.01;
    /// Natural decay from which an exponential window may be used. 25 % (ISO 7626-5): beyond, the window
    /// and not the structure decides what is measured.
    pub const REMAINING_FOR_WINDOW: f64 = 0.25;
    /// Share of a window in the damping read under it, from which that damping is doubtful. 0.5: the
    /// structure's own share is then the smaller one, and carries the error of both.
    pub const WINDOW_SHARE: f64 = 0.5;
    /// Relative scatter of a frequency from tap to tap. 1 % (ASTM E1876: readings agree within 1 %).
    pub const FREQUENCY_SCATTER: f64 = 0.01;
    /// Relative scatter below which there is no doubt, whatever noise explains. 0.005 %: a third of a kelvin does as
    /// much to steel.
    pub const LEAST_SCATTER: f64 = 5e-5;
    /// Standard deviations by which two frequencies must differ. 3: one in 370 by chance.
    pub const DEVIATIONS: f64 = 3.0;
    /// Relative change of a frequency that time, and taking a sensor off, may leave between recordings.
    /// 0.5 %: bolted joints drift by some 1 % of their stiffness, and no frequency changes by more than half
    /// of that, f^2 being at most proportional to the stiffness.
    pub const DRIFT: f64 = 5e-3;
    /// Agreement of two FRFs that should be equal, |sum H1 conj(H2)|^2/(sum |H1|^2 sum |H2|^2). 0.9: they
    /// share nine tenths of their power.
    pub const RECIPROCITY: f64 = 0.9;
    /// Relative difference of their levels. 0.2: twice the 10 % to which hammer and accelerometer are
    /// usually calibrated together.
    pub const RECIPROCITY_GAIN: f64 = 0.2;
    /// Distance within which two positions are the same (m). 5 mm: about the size of a hammer tip or an
    /// accelerometer's base.
    pub const SAME_POSITION: f64 = 0.005;
    /// Ratio of two tap levels from which they can show a non-linearity. 1.5: below, one series scatters as
    /// much.
    pub const TWO_LEVELS: f64 = 1.5;
    /// Relative difference within which two resonances of two recordings are the same mode. 3 %: what an
    /// accelerometer's mass or a joint's level usually move, and less than modes lie apart.
    pub const SAME_MODE: f64 = 0.03;
}
