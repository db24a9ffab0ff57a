//! A verdict: the check, its outcome, the likely cause, the remedy, and its subject (a recording, a tap, a mode, a
//! sensor, or the test).

use crate::taps::Rejection;
use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

/// What is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(into = "&'static str")]
pub enum Check {
    /// One impact per tap, by the force in time.
    DoubleHit,
    /// One impact per tap, by the ripple in the force spectrum.
    ForceRipple,
    /// No channel at its limit.
    Overload,
    /// A tap hard enough beside the others.
    WeakTap,
    /// Taps of about the same level.
    TapLevels,
    /// The force spectrum reaches over the band.
    ForceFall,
    /// The force stays above its noise.
    ForceNoise,
    /// Enough taps.
    Averages,
    /// Coherence at a resonance.
    Coherence,
    /// Random error of the FRF at a resonance.
    RandomError,
    /// The response has decayed at the record's end.
    Decay,
    /// An exponential window only where the structure decays by itself.
    ExponentialWindow,
    /// The window's share in a damping.
    WindowDamping,
    /// Scatter of a frequency from tap to tap.
    FrequencyScatter,
    /// Sign of the driving-point FRF at its resonances.
    DrivingPoint,
    /// Antiresonances between the resonances of the driving-point FRF.
    Antiresonances,
    /// H of tap at a, sensor at b equals that of tap at b, sensor at a.
    Reciprocity,
    /// Frequencies do not depend on the tap's level.
    Linearity,
    /// Frequencies do not depend on where the sensors are.
    MassLoading,
}

/// Unit of a difference held against its uncertainty.
const DEVIATIONS: &str = "standard deviations";

impl Check {
    /// Short code for scripts.
    pub fn code(self) -> &'static str {
        match self {
            Self::DoubleHit => "double-hit",
            Self::ForceRipple => "force-ripple",
            Self::Overload => "overload",
            Self::WeakTap => "weak-tap",
            Self::TapLevels => "tap-levels",
            Self::ForceFall => "force-fall",
            Self::ForceNoise => "force-noise",
            Self::Averages => "averages",
            Self::Coherence => "coherence",
            Self::RandomError => "random-error",
            Self::Decay => "decay",
            Self::ExponentialWindow => "exponential-window",
            Self::WindowDamping => "window-damping",
            Self::FrequencyScatter => "frequency-scatter",
            Self::DrivingPoint => "driving-point",
            Self::Antiresonances => "antiresonance",
            Self::Reciprocity => "reciprocity",
            Self::Linearity => "linearity",
            Self::MassLoading => "mass-loading",
        }
    }

    /// Unit of value and limit, where a verdict has no other; "1" for a ratio.
    pub fn unit(self) -> &'static str {
        match self {
            Self::ForceRipple | Self::ForceFall => "dB",
            Self::Overload => "samples",
            Self::ForceNoise => "Hz",
            Self::Averages => "taps",
            Self::DrivingPoint => "resonances",
            Self::Antiresonances => "gaps",
            Self::Linearity | Self::MassLoading => DEVIATIONS,
            Self::DoubleHit
            | Self::WeakTap
            | Self::TapLevels
            | Self::Coherence
            | Self::RandomError
            | Self::Decay
            | Self::ExponentialWindow
            | Self::WindowDamping
            | Self::FrequencyScatter
            | Self::Reciprocity => "1",
        }
    }

    /// Likely cause of a failure.
    pub fn cause(self) -> &'static str {
        match self {
            Self::DoubleHit => "The structure came back and met the hammer again.",
            Self::ForceRipple => {
                "Two blows interfere: where they cancel the structure is excited less."
            }
            Self::Overload => {
                "The blow was harder than the range of an amplifier or converter allows."
            }
            Self::WeakTap => {
                "The hammer was laid down or touched the structure by accident, or the blow was a poor one."
            }
            Self::TapLevels => "The blows were of different strength.",
            Self::ForceFall => {
                "The pulse is too long for the band: a soft tip, a heavy hammer or a soft surface."
            }
            Self::ForceNoise => {
                "There the pulse has no power left, and noise in the force makes H1 too small."
            }
            Self::Averages => "Too few taps were made, or too many of them were rejected.",
            Self::Coherence => "Noise, leakage, uneven hits, or a joint that is not linear.",
            Self::RandomError => "The coherence is too low for so few taps.",
            Self::Decay => "The record ends before the structure has come to rest.",
            Self::ExponentialWindow => "The window and not the structure ends the record.",
            Self::WindowDamping => {
                "The exponential window adds its own decay to every mode, most to the lowest."
            }
            Self::FrequencyScatter => {
                "The taps are of different strength on a joint that is not linear, the support moves, or temperature or preload drifts."
            }
            Self::DrivingPoint => {
                "Sensor and hammer do not point the same way, channels are swapped, or they are not at the same place."
            }
            Self::Antiresonances => {
                "The tap is not where the sensor is, or a channel holds something else."
            }
            Self::Reciprocity => {
                "A scale, a sign or a position is wrong, a sensor's mass loads the beam, or the joint is not linear."
            }
            Self::Linearity => {
                "The joint changed between the recordings: it slips or opens with the level, it drifted, or it was touched."
            }
            Self::MassLoading => {
                "The sensor's mass lowers the modes that move where it sits, or the joint changed between the recordings."
            }
        }
    }

    /// Remedy against the cause.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::DoubleHit => {
                "Hit shorter from a loose wrist, with a lighter hammer, or nearer to a support; never hide it under the force window."
            }
            Self::ForceRipple => {
                "Repeat the tap; lines in the valleys of the ripple are the least reliable."
            }
            Self::Overload => "Set a larger range or hit softer, and repeat the tap.",
            Self::WeakTap => {
                "Nothing needs to be done where it was no tap; else repeat it at the level of the others."
            }
            Self::TapLevels => {
                "Repeat with even blows; keep a second level in a recording of its own, where it shows whether the joint is linear."
            }
            Self::ForceFall => "Take a harder tip or a lighter hammer, or end the band lower.",
            Self::ForceNoise => {
                "Take a harder tip, hit harder, use the force window, or end the band below."
            }
            Self::Averages => "Make 3 to 5 good taps; 5 where the coherence shall be trusted.",
            Self::Coherence => {
                "Record until the response has decayed, hit the same spot, take more taps, or move the sensor off the mode's node."
            }
            Self::RandomError => {
                "Take more taps: the error falls with the square root of their number."
            }
            Self::Decay => "Leave more time between taps, or give a larger block.",
            Self::ExponentialWindow => {
                "Leave more time between taps until the response decays to a quarter by itself, and let the window do the rest."
            }
            Self::WindowDamping => {
                "Leave more time between taps and use a weaker window; do not quote this damping."
            }
            Self::FrequencyScatter => {
                "Compare the taps' frequencies with their peaks and their order in time; even the blows, fasten what is loose."
            }
            Self::DrivingPoint => {
                "Check wiring, the sign of the scales, and the positions in the description."
            }
            Self::Antiresonances => {
                "Hit right behind the sensor, and check the positions in the description."
            }
            Self::Reciprocity => "Check scales and positions first, then compare two tap levels.",
            Self::Linearity => {
                "Tap softly and hard within one recording, where a joint has no time to drift; if it is the level, state it with every frequency, and identify the joint at the lowest one that rises clear of the noise."
            }
            Self::MassLoading => {
                "State the sensors' masses in the description: the model carries those that it states, and then this is no fault. Else take a lighter sensor, or place it near the joint."
            }
        }
    }
}

/// Returns the remedy against the fault for which a tap was rejected; `None` of one that was rejected by hand.
pub fn remedy_of(rejection: &Rejection) -> Option<&'static str> {
    match rejection {
        Rejection::DoubleHit { .. } => Some(Check::DoubleHit.remedy()),
        Rejection::Overload(_) => Some(Check::Overload.remedy()),
        Rejection::TooWeak { .. } => Some(Check::WeakTap.remedy()),
        Rejection::NextTooSoon { .. } => {
            Some("Leave more time between taps, or give a smaller block.")
        }
        Rejection::NoResponse => {
            Some("If it was no tap, do nothing. Otherwise check the sensors and their cables.")
        }
        Rejection::Stopped { .. } => Some("Check the sensor and its cable, and record again."),
        Rejection::CutOff { .. } => {
            Some("Let the recording go on until the structure has come to rest.")
        }
        Rejection::Inconsistent { .. } => {
            Some("Hit the same place, straight on, and touch neither the sensors nor their cables.")
        }
        Rejection::ByHand => None,
    }
}

impl From<Check> for &'static str {
    fn from(check: Check) -> &'static str {
        check.code()
    }
}

/// The outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The check does not apply: something that it needs is not there.
    #[serde(rename = "not applicable")]
    NotApplicable,
    /// As good practice asks.
    Good,
    /// Usable with care.
    Doubtful,
    /// Not as a measurement should be.
    Bad,
}

impl Outcome {
    /// Returns `Good`, or `Doubtful` where something is not as good practice asks.
    pub(super) fn doubtful_unless(is_good: bool) -> Self {
        if is_good {
            Outcome::Good
        } else {
            Outcome::Doubtful
        }
    }

    /// Name as `report.json` has it.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::NotApplicable => "not applicable",
            Outcome::Good => "good",
            Outcome::Doubtful => "doubtful",
            Outcome::Bad => "bad",
        }
    }
}

/// The result of one check.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QualityVerdict {
    /// What was checked.
    pub check: Check,
    /// Subject of the check.
    #[serde(flatten)]
    pub subject: Subject,
    /// What was found (unit: [`QualityVerdict::unit`]); `None` where there is nothing to measure.
    pub value: Option<f64>,
    /// The limit it was held against (same unit).
    pub limit: f64,
    /// Unit of value and limit; "1" for a ratio.
    pub unit: &'static str,
    /// The outcome.
    pub outcome: Outcome,
    /// What happened, with its numbers: a sentence.
    #[serde(rename = "text")]
    pub happened: String,
    /// Likely cause; `None` without a doubt.
    pub cause: Option<&'static str>,
    /// Remedy; `None` without a doubt.
    pub remedy: Option<&'static str>,
}

impl QualityVerdict {
    pub(super) fn new(check: Check, subject: Subject, limit: f64) -> Self {
        QualityVerdict {
            check,
            subject,
            value: None,
            limit,
            unit: check.unit(),
            outcome: Outcome::NotApplicable,
            happened: String::new(),
            cause: None,
            remedy: None,
        }
    }

    /// Replaces the limit and its unit.
    pub(super) fn against(mut self, limit: f64, unit: &'static str) -> Self {
        self.limit = limit;
        self.unit = unit;
        self
    }

    /// Adds the value that was found, the outcome and the sentence.
    pub(super) fn found(mut self, value: f64, outcome: Outcome, happened: String) -> Self {
        self.value = Some(value);
        self.outcome = outcome;
        self.happened = happened;
        self.cause = self.is_doubt().then(|| self.check.cause());
        self.remedy = self.is_doubt().then(|| self.check.remedy());
        self
    }

    /// Makes it good, without a value.
    pub(super) fn clear(mut self, happened: String) -> Self {
        self.outcome = Outcome::Good;
        self.happened = happened;
        self
    }

    /// Says why the check is not applicable.
    pub(super) fn missing(mut self, why: &str) -> Self {
        self.happened = why.to_owned();
        self
    }

    /// Distance from the limit, to sort the verdicts of one check; not comparable between checks.
    pub fn severity(&self) -> f64 {
        let value = self.value.unwrap_or(0.0);
        // Relative to its limit, which may differ between recordings.
        let relative = value / if self.limit > 0.0 { self.limit } else { 1.0 };
        match self.check {
            Check::Coherence | Check::ForceNoise | Check::Reciprocity => -relative,
            _ => relative,
        }
    }

    /// Returns `true` for an outcome that the reader must know about.
    pub fn is_doubt(&self) -> bool {
        matches!(self.outcome, Outcome::Doubtful | Outcome::Bad)
    }
}

impl fmt::Display for QualityVerdict {
    /// Writes the sentence; for a doubt also its cause and remedy.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.happened)?;
        match self.cause.zip(self.remedy) {
            Some((cause, remedy)) => write!(f, " {cause} {remedy}"),
            None => Ok(()),
        }
    }
}

/// What a verdict is about.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "WrittenSubject")]
pub enum Subject {
    /// A recording.
    Recording {
        /// Its name.
        file: String,
    },
    /// A tap.
    Tap {
        /// The recording.
        file: String,
        /// Its number, from 1.
        tap: usize,
    },
    /// A mode, or a peak that has no number.
    Mode {
        /// The recording.
        file: String,
        /// Its frequency (Hz).
        frequency: f64,
        /// Whether it is a mode.
        is_mode: bool,
    },
    /// A sensor.
    Sensor {
        /// The recording.
        file: String,
        /// Its name.
        sensor: String,
    },
    /// The test as a whole.
    Test,
}

impl Subject {
    /// File of the recording; `None` for the test as a whole.
    pub fn file(&self) -> Option<&str> {
        match self {
            Subject::Recording { file }
            | Subject::Tap { file, .. }
            | Subject::Mode { file, .. }
            | Subject::Sensor { file, .. } => Some(file),
            Subject::Test => None,
        }
    }
}

/// A subject as `report.json` has it.
#[derive(Serialize, JsonSchema)]
struct WrittenSubject {
    /// Subject in words: "full.wav, tap 2".
    subject: String,
    /// File of the recording; null of the test as a whole.
    recording: Option<String>,
    /// Number of the tap, from 1; null of anything else.
    tap: Option<usize>,
    /// Frequency of the mode (Hz); null of anything else.
    frequency: Option<f64>,
    /// Name of the sensor; null of anything else.
    sensor: Option<String>,
}

impl From<Subject> for WrittenSubject {
    fn from(about: Subject) -> Self {
        let (subject, recording) = (about.to_string(), about.file().map(str::to_owned));
        let (tap, frequency, sensor) = match about {
            Subject::Tap { tap, .. } => (Some(tap), None, None),
            Subject::Mode { frequency, .. } => (None, Some(frequency), None),
            Subject::Sensor { sensor, .. } => (None, None, Some(sensor)),
            Subject::Recording { .. } | Subject::Test => (None, None, None),
        };
        WrittenSubject {
            subject,
            recording,
            tap,
            frequency,
            sensor,
        }
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Subject::Recording { file } => f.write_str(file),
            Subject::Tap { file, tap } => write!(f, "{file}, tap {tap}"),
            Subject::Mode {
                file,
                frequency,
                is_mode: true,
            } => {
                write!(f, "{file}, {frequency:.2} Hz")
            }
            Subject::Mode {
                file, frequency, ..
            } => {
                write!(f, "{file}, {frequency:.2} Hz (a peak that is no mode)")
            }
            Subject::Sensor { file, sensor } => write!(f, "{file}, sensor {sensor}"),
            Subject::Test => f.write_str("test"),
        }
    }
}
