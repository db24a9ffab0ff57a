//! Doubts about a result: what happened, why it might be, what helps.

use super::amplitude::AmplitudeChange;
use std::fmt;
use tapjoint_numerics::stats::times;
use tapjoint_signal::modal::PeakLabel;
use tapjoint_signal::spectral::{SpectralError, Window};

/// A warning that travels with the result.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// Something about a recording's data or its search for taps.
    Recording {
        /// Short code for scripts.
        code: &'static str,
        /// The recording.
        file: String,
        /// Event, likely cause and remedy.
        text: String,
    },
    /// A check of good practice that raises a doubt.
    Quality {
        /// Short code of the check.
        code: &'static str,
        /// Event, likely cause and remedy.
        text: String,
    },
    /// Something about the test description.
    Description {
        /// Event, likely cause and remedy.
        text: String,
    },
    /// Taps were rejected.
    RejectedTaps {
        /// The recording.
        file: String,
        /// Number of them.
        rejected: usize,
        /// Number of all taps.
        total: usize,
    },
    /// The accepted taps are too short for any spectrum.
    TapsTooShort {
        /// The recording.
        file: String,
        /// The problem.
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
        /// Frequency of the peak (Hz).
        frequency: f64,
        /// Kind of peak.
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
        /// Number of them.
        count: usize,
        /// Why.
        text: String,
    },
    /// The regression left something that no joint can have.
    UnphysicalEstimate {
        /// The problem.
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
        /// Event, likely cause and remedy.
        text: String,
    },
    /// Something the method leaves out.
    Neglected {
        /// The effect and its consequence.
        text: String,
        /// True if only the pair regression leaves it out.
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

    /// Returns true if it concerns the pair regression alone.
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
                write_others(f, others, 100.0, 1, "%")
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
                write_others(f, others, 1.0, 2, "Hz")
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
            } => super::amplitude::write_dependence(f, file, changes, others),
            Warning::Misfit {
                mode,
                error_percent,
                deviations,
            } => write_misfit(f, *mode, *error_percent, *deviations),
            Warning::Closure { closure } => write!(
                f,
                "the pair regression does not satisfy its own frequency equation: the product it \
                 implies differs from the product of its estimates by {:+.0} %; the eliminated product \
                 is left free by the method, and an error of this size means that the stiffnesses are \
                 not to be trusted singly",
                100.0 * closure
            ),
            Warning::CouplingNotEstablished => f.write_str(
                "the interval of the cross coupling contains zero: these frequencies do not show one, \
                 and Kz has no interval; the two-parameter model may do",
            ),
            Warning::UnphysicalEstimate { what } => write!(
                f,
                "the regression's answer is not a joint that can exist: {what}; a missing or an extra \
                 mode, a wrong model or readings too coarse for it are the usual causes"
            ),
            Warning::NumberedInOrder => f.write_str(
                "no peak lies near a natural frequency of the described free beam, so the peaks were \
                 numbered in ascending order; check the beam's dimensions and modulus",
            ),
        }
    }
}

/// " (the same of b.wav: 4.5 %, c.wav: 8.8 %)": values times `factor` in a unit; nothing without others.
fn write_others(
    f: &mut fmt::Formatter<'_>,
    others: &[(String, f64)],
    factor: f64,
    decimals: usize,
    unit: &str,
) -> fmt::Result {
    if others.is_empty() {
        return Ok(());
    }
    let mut listed = Vec::with_capacity(others.len());
    for (file, value) in others {
        listed.push(format!("{file}: {:.decimals$} {unit}", factor * value));
    }
    write!(f, " (the same of {})", listed.join(", "))
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

fn write_misfit(
    f: &mut fmt::Formatter<'_>,
    mode: usize,
    error_percent: f64,
    deviations: Option<f64>,
) -> fmt::Result {
    write!(
        f,
        "with the estimated joint the model misses mode {mode} by {error_percent:+.2} %"
    )?;
    if let Some(deviations) = deviations {
        write!(
            f,
            " ({} standard deviations of its frequency)",
            times(deviations)
        )?;
    }
    f.write_str(
        "; the estimator, a mode numbered wrongly, or something the model lacks may be the cause",
    )
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
