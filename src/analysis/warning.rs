//! Doubts about a result: what happened, why it might be, what helps.

use std::fmt;

mod amplitude;
mod estimate;
mod groups;

pub use amplitude::AmplitudeChange;
pub(super) use amplitude::of_amplitude;
pub(super) use groups::of_quality;
pub use groups::together;

use super::analysis::RecordingResult;
use super::measure::MeasuredSpectra;
use tapjoint_signal::modal::PeakLabel;
use tapjoint_signal::recording::Recording;
use tapjoint_signal::spectral::{DecayCheck, RUNG_DOWN, SpectralError, Window};
use tapjoint_signal::taps::{TapSource, Taps};

/// A warning that travels with the result.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// Something about a recording's data or its search for taps.
    Recording {
        /// Short code for scripts.
        code: &'static str,
        /// The recording.
        file: String,
        /// What happened, why, what helps.
        text: String,
    },
    /// A check of good practice that raises a doubt.
    Quality {
        /// Short code of the check.
        code: &'static str,
        /// What happened, why, what helps.
        text: String,
    },
    /// Something about the test description.
    Description {
        /// What happened, why, what helps.
        text: String,
    },
    /// Taps were rejected.
    RejectedTaps {
        /// The recording.
        file: String,
        /// How many.
        rejected: usize,
        /// Of how many.
        total: usize,
    },
    /// The accepted taps are too short for any spectrum.
    TapsTooShort {
        /// The recording.
        file: String,
        /// What does not fit.
        problem: SpectralError,
    },
    /// Only one tap was averaged.
    SingleTap {
        /// The recording.
        file: String,
    },
    /// The response does not ring down in the record.
    NotRungDown {
        /// The recording.
        file: String,
        /// Level at the end relative to the start.
        remaining: f64,
        /// The window in force.
        window: Window,
        /// Other recordings of which the same holds, and their levels.
        others: Vec<(String, f64)>,
    },
    /// A window that is wrong for taps.
    HannOnTaps {
        /// The recording.
        file: String,
    },
    /// A peak was taken for mains hum.
    Mains {
        /// The recording.
        file: String,
        /// Where (Hz).
        frequency: f64,
        /// What it is.
        label: PeakLabel,
        /// Other such peaks: recording, and where (Hz).
        others: Vec<(String, f64)>,
    },
    /// Frequency or damping changes along the decays.
    AmplitudeDependent {
        /// The recording.
        file: String,
        /// Number of every mode that changes, and how.
        changes: Vec<(usize, AmplitudeChange)>,
        /// Other recordings in which modes go the same way, and these modes.
        others: Vec<(String, Vec<usize>)>,
    },
    /// The pair regression contradicts its own frequency equation.
    Closure {
        /// Product implied over product of the estimates, minus 1.
        closure: f64,
    },
    /// The frequencies do not show a cross coupling.
    CouplingNotEstablished,
    /// No peak of a free beam lies near where the description puts its modes.
    NumberedInOrder,
    /// Peaks were left without a mode.
    Unpaired {
        /// How many.
        count: usize,
        /// Why.
        text: String,
    },
    /// The regression left something that no joint can have.
    UnphysicalEstimate {
        /// What is wrong with it.
        what: String,
    },
    /// The model with the estimated joint misses the measurement.
    Misfit {
        /// Mode number.
        mode: usize,
        /// Error (%).
        error_percent: f64,
        /// Error over the reading's standard deviation, where known.
        deviations: Option<f64>,
    },
    /// Something that limits what the estimate can say.
    Estimate {
        /// Short code of the limit.
        code: &'static str,
        /// What happened, why, what helps.
        text: String,
    },
    /// Something the method leaves out.
    Neglected {
        /// What and with what effect.
        text: String,
        /// Whether only the pair regression leaves it out.
        of_pairs: bool,
    },
}

impl Warning {
    /// Short code that scripts may look for.
    pub fn code(&self) -> &'static str {
        match self {
            Warning::Recording { code, .. }
            | Warning::Quality { code, .. }
            | Warning::Estimate { code, .. } => code,
            Warning::Description { .. } => "description",
            Warning::RejectedTaps { .. } => "rejected-taps",
            Warning::TapsTooShort { .. } => "taps-too-short",
            Warning::SingleTap { .. } => "single-tap",
            Warning::NotRungDown { .. } => "not-rung-down",
            Warning::HannOnTaps { .. } => "hann-on-taps",
            Warning::Mains { .. } => "mains",
            Warning::AmplitudeDependent { .. } => "amplitude-dependent",
            Warning::Closure { .. } => "closure",
            Warning::CouplingNotEstablished => "coupling-not-established",
            Warning::NumberedInOrder => "numbered-in-order",
            Warning::Unpaired { .. } => "unpaired",
            Warning::UnphysicalEstimate { .. } => "unphysical",
            Warning::Misfit { .. } => "prediction-error",
            Warning::Neglected { .. } => "neglected",
        }
    }
}

impl Warning {
    /// Whether it concerns the pair regression alone.
    pub fn is_of_pairs(&self) -> bool {
        match self {
            Warning::Closure { .. } | Warning::UnphysicalEstimate { .. } => true,
            Warning::Neglected { of_pairs, .. } => *of_pairs,
            _ => false,
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Recording { file, text, .. } => write!(f, "{file}: {text}"),
            Warning::Description { text }
            | Warning::Neglected { text, .. }
            | Warning::Estimate { text, .. }
            | Warning::Quality { text, .. } => f.write_str(text),
            Warning::RejectedTaps {
                file,
                rejected,
                total,
            } => write!(
                f,
                "{file}: {rejected} of {total} taps {} rejected; the list of taps says why",
                if *rejected == 1 { "was" } else { "were" }
            ),
            Warning::TapsTooShort { file, problem } => {
                write!(f, "{file}: the taps leave no spectrum: {problem}")
            }
            Warning::SingleTap { file } => write!(
                f,
                "{file}: only one tap was averaged, so nothing shows how well it repeats and a \
                 coherence would mean nothing; record three to five taps"
            ),
            Warning::NotRungDown {
                file,
                remaining,
                window,
                others,
            } => {
                write_not_rung_down(f, file, *remaining, *window)?;
                let percent = |remaining: f64| format!("{:.1} %", 100.0 * remaining);
                write_others(f, others, percent)
            }
            Warning::HannOnTaps { file } => write!(
                f,
                "{file}: a Hann window suppresses the start of every record, where a tap has its \
                 signal; it is meant for steady signals"
            ),
            Warning::Mains {
                file,
                frequency,
                label,
                others,
            } => {
                write!(
                    f,
                    "{file}: the peak at {frequency:.2} Hz was there before the tap and is taken for \
                     {label}, not for a mode; check the grounding of the sensor cables"
                )?;
                let hertz = |frequency: f64| format!("{frequency:.2} Hz");
                write_others(f, others, hertz)
            }
            Warning::Unpaired { count, text } => {
                let belong = if *count == 1 {
                    "peak belongs"
                } else {
                    "peaks belong"
                };
                write!(f, "{count} {belong} to no mode: {text}")
            }
            Warning::AmplitudeDependent {
                file,
                changes,
                others,
            } => amplitude::write_dependence(f, (file, changes), others),
            Warning::Misfit { .. }
            | Warning::Closure { .. }
            | Warning::CouplingNotEstablished
            | Warning::UnphysicalEstimate { .. }
            | Warning::NumberedInOrder => self.write_estimate_doubt(f),
        }
    }
}

/// " (the same of b.wav: 4.5 %, c.wav: 8.8 %)"; nothing of nothing.
fn write_others(
    f: &mut fmt::Formatter<'_>,
    others: &[(String, f64)],
    written: impl Fn(f64) -> String,
) -> fmt::Result {
    let listed: Vec<String> = others
        .iter()
        .map(|(file, value)| format!("{file}: {}", written(*value)))
        .collect();
    match listed.is_empty() {
        true => Ok(()),
        false => write!(f, " (the same of {})", listed.join(", ")),
    }
}

fn write_not_rung_down(
    f: &mut fmt::Formatter<'_>,
    file: &str,
    remaining: f64,
    window: Window,
) -> fmt::Result {
    write!(
        f,
        "{file}: at the end of the block the response still has {:.1} % of its level (1.0 % is \
         wanted); ",
        100.0 * remaining
    )?;
    match window {
        Window::Exponential { decay } => write!(
            f,
            "an exponential window with a decay of {decay:.3} 1/s was applied to force and response, \
             and taken out of every damping read from the spectra (fits take the decays without it); taps \
             farther apart need none"
        ),
        _ => f.write_str(
            "readings on lines suffer from it; leave the window to the program, or set the taps farther \
             apart",
        ),
    }
}

/// Doubts about a recording and its taps.
pub(super) fn of_recording(recording: &Recording, source: &TapSource, taps: &Taps) -> Vec<Warning> {
    let file = recording.name().to_string();
    let mut warnings: Vec<Warning> = recording
        .warnings()
        .iter()
        .map(|warning| Warning::Recording {
            code: warning.code(),
            file: file.clone(),
            text: warning.to_string(),
        })
        .collect();
    warnings.extend(taps.remarks.iter().map(|remark| Warning::Recording {
        code: "taps",
        file: file.clone(),
        text: remark.to_string(),
    }));
    let accepted = taps.accepted().count();
    let rejected = taps.taps.len() - accepted;
    if rejected > 0 {
        warnings.push(Warning::RejectedTaps {
            file: file.clone(),
            rejected,
            total: taps.taps.len(),
        });
    }
    if accepted == 1 && matches!(source, TapSource::Hammer { .. }) {
        warnings.push(Warning::SingleTap { file });
    }
    warnings
}

/// A channel that is taken for a response, though its name says that it is the hammer's.
pub(super) fn of_hammer_by_name(recording: &RecordingResult) -> Option<Warning> {
    let is_hammers = |name: &str| {
        let name = name.to_lowercase();
        name.contains("hammer") || name.contains("force")
    };
    let mut names = recording.responses.iter().map(|response| &response.name);
    let name = names.find(|name| is_hammers(name))?;
    let argument = match name.contains(char::is_whitespace) {
        true => format!("\"{name}\""),
        false => name.clone(),
    };
    Some(Warning::Recording {
        code: "hammer-channel",
        file: recording.file.clone(),
        text: format!(
            "channel \"{name}\" is taken for a response, but by its name it may be the hammer's; if so, \
             say --hammer {argument}: taps are then judged by their force, and there are frequency \
             response functions"
        ),
    })
}

/// Doubts about a recording's spectra.
pub(super) fn of_spectra(file: &str, spectra: &MeasuredSpectra) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let rings = |decay: &DecayCheck| decay.remaining > RUNG_DOWN && decay.remaining > decay.noise;
    if let Some(decay) = spectra.decay.filter(rings) {
        warnings.push(Warning::NotRungDown {
            file: file.to_string(),
            remaining: decay.remaining,
            window: spectra.window,
            others: Vec::new(),
        });
    }
    if spectra.window == Window::Hann {
        warnings.push(Warning::HannOnTaps {
            file: file.to_string(),
        });
    }
    for reading in &spectra.readings {
        if let Some(label @ PeakLabel::Mains(_)) = reading.label {
            warnings.push(Warning::Mains {
                file: file.to_string(),
                frequency: reading.line_frequency,
                label,
                others: Vec::new(),
            });
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_one_is_not_many() {
        let rejected = |rejected: usize| Warning::RejectedTaps {
            file: "a.wav".into(),
            rejected,
            total: 5,
        };
        assert!(rejected(1).to_string().contains("1 of 5 taps was rejected"));
        assert!(
            rejected(2)
                .to_string()
                .contains("2 of 5 taps were rejected")
        );
        let unpaired = |count: usize| Warning::Unpaired {
            count,
            text: String::new(),
        };
        assert!(unpaired(1).to_string().starts_with("1 peak belongs to"));
        assert!(unpaired(4).to_string().starts_with("4 peaks belong to"));
    }
}
