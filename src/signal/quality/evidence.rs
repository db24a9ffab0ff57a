//! What the checks look at: plain data that the earlier stages produce.

use num_complex::Complex64;

use crate::recording::ResponseForm;
use crate::spectral::{DecayCheck, Lines, Window};
use crate::taps::{Rejection, SecondHit, Tap};
use tapjoint_numerics::stats::median;

/// One tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapEvidence {
    /// Peak of the force (N), or of the response (its unit).
    pub peak: f64,
    /// A second hit in its force, if any.
    pub second_hit: Option<SecondHit>,
    /// Why it was rejected; `None` = accepted.
    pub rejection: Option<Rejection>,
}

impl From<&Tap> for TapEvidence {
    fn from(tap: &Tap) -> Self {
        TapEvidence {
            peak: tap.peak,
            second_hit: tap.second_hit,
            rejection: tap.rejection.clone(),
        }
    }
}

/// The force's spectrum over the accepted taps, line by line.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceEvidence {
    /// Root mean square of the taps' transforms (N s).
    pub spectrum: Vec<f64>,
    /// What the channel's noise alone leaves (N s); `None` where it is not known.
    pub noise: Option<Vec<f64>>,
}

/// One sensor as placed in a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorEvidence {
    /// Its name.
    pub name: String,
    /// Where it is (m); `None` where nobody said.
    pub position: Option<f64>,
    /// What it measures over the force; `None` of something whose phase to the force says nothing, as
    /// sound.
    pub form: Option<ResponseForm>,
    /// H1, line by line (unit of the response per N); `None` without a hammer.
    pub frf: Option<Vec<Complex64>>,
    /// Coherence, line by line; `None` where it does not exist.
    pub coherence: Option<Vec<f64>>,
}

/// What a damping was read from.
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
    /// Whether it is a mode: `false` for a peak without a number among others that have theirs.
    pub is_mode: bool,
    /// Standard deviation of that (Hz); `None` where it is not known.
    pub std: Option<f64>,
    /// Damping ratio as the spectra show it, the window's share in it.
    pub apparent_damping_ratio: Option<f64>,
    /// What the damping was read from.
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
    /// Where the hammer strikes (m); `None` where nobody said.
    pub tap_position: Option<f64>,
    /// Places (m) and masses (kg) of what is fastened to the beam for this recording.
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
    /// How far the slowest response rings down without a window; `None` without an accepted tap.
    pub decay: Option<DecayCheck>,
    /// The window applied.
    pub window: Window,
}

impl RecordingEvidence {
    /// Number of taps averaged.
    pub fn averages(&self) -> usize {
        self.accepted().count()
    }

    /// The taps averaged.
    pub(super) fn accepted(&self) -> impl Iterator<Item = &TapEvidence> {
        self.taps.iter().filter(|tap| tap.rejection.is_none())
    }

    /// Median peak of the accepted taps; `None` without any.
    pub(super) fn tap_level(&self) -> Option<f64> {
        let mut peaks: Vec<f64> = self.accepted().map(|tap| tap.peak).collect();
        (!peaks.is_empty()).then(|| median(&mut peaks))
    }

    /// The sensor that knows a line best: the one with the highest coherence there. Levels of different
    /// quantities cannot be compared.
    pub(super) fn best_sensor(&self, line: usize) -> Option<&SensorEvidence> {
        let known = |sensor: &SensorEvidence| {
            let values = sensor.coherence.as_ref()?;
            values.get(line).copied()
        };
        self.sensors
            .iter()
            .filter(|sensor| sensor.coherence.is_some())
            .max_by(|a, b| known(a).unwrap_or(0.0).total_cmp(&known(b).unwrap_or(0.0)))
    }
}
