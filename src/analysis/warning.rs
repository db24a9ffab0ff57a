//! Doubts about a result: event, likely cause and remedy.

use super::amplitude::AmplitudeChange;
use std::fmt;
use tapjoint_numerics::stats::times;
use tapjoint_signal::modal::PeakLabel;
use tapjoint_signal::spectral::{SpectralError, Window};

/// A warning that travels with the result.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// A doubt in words.
    Plain {
        /// Short code that scripts may look for.
        code: &'static str,
        /// Event, likely cause and remedy.
        text: String,
        /// True if it concerns the pair regression alone.
        of_pairs: bool,
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
    /// A peak was taken for mains hum.
    Mains {
        /// The recording.
        file: String,
        /// Frequency of the peak (Hz).
        frequency: f64,
        /// Kind of peak.
        label: PeakLabel,
        /// Other such peaks: recording, and frequency (Hz).
        others: Vec<(String, f64)>,
    },
    /// Frequency or damping changes along the decays.
    AmplitudeDependent {
        /// The recording.
        file: String,
        /// Number of every mode that changes, and its change.
        changes: Vec<(usize, AmplitudeChange)>,
        /// Other recordings in which modes go the same way, and these modes.
        others: Vec<(String, Vec<usize>)>,
    },
}

impl Warning {
    /// A doubt with a short code for scripts.
    pub fn new(code: &'static str, text: impl Into<String>) -> Self {
        Warning::Plain {
            code,
            text: text.into(),
            of_pairs: false,
        }
    }

    /// A doubt about a recording or its search for taps.
    pub(super) fn about(file: &str, code: &'static str, text: impl fmt::Display) -> Self {
        Warning::new(code, format!("{file}: {text}"))
    }

    /// A doubt about the pair regression alone.
    fn about_pairs(code: &'static str, text: String) -> Self {
        Warning::Plain {
            code,
            text,
            of_pairs: true,
        }
    }

    /// An effect that the method leaves out; `of_pairs` if only the pair regression does.
    pub(super) fn neglected(text: impl Into<String>, of_pairs: bool) -> Self {
        Warning::Plain {
            code: "neglected",
            text: text.into(),
            of_pairs,
        }
    }

    /// Taps of a recording were rejected.
    pub(super) fn rejected_taps(file: &str, rejected: usize, total: usize) -> Self {
        let were = if rejected == 1 { "was" } else { "were" };
        let text = format!("{rejected} of {total} taps {were} rejected; the list of taps says why");
        Warning::about(file, "rejected-taps", text)
    }

    /// The accepted taps are too short for any spectrum.
    pub(super) fn taps_too_short(file: &str, problem: &SpectralError) -> Self {
        let text = format!("the taps leave no spectrum: {problem}");
        Warning::about(file, "taps-too-short", text)
    }

    /// Only one tap was averaged.
    pub(super) fn single_tap(file: &str) -> Self {
        let text = "only one tap was averaged, so nothing shows how well it repeats and a \
                    coherence would mean nothing; record three to five taps";
        Warning::about(file, "single-tap", text)
    }

    /// A window that is wrong for taps.
    pub(super) fn hann_on_taps(file: &str) -> Self {
        let text = "a Hann window suppresses the start of every record, where a tap has its \
                    signal; it is meant for steady signals";
        Warning::about(file, "hann-on-taps", text)
    }

    /// Peaks were left without a mode; `text` says why.
    pub(super) fn unpaired(count: usize, text: &str) -> Self {
        let belong = if count == 1 {
            "peak belongs"
        } else {
            "peaks belong"
        };
        Warning::new("unpaired", format!("{count} {belong} to no mode: {text}"))
    }

    /// No peak of a free beam lies near where the description puts its modes.
    pub(super) fn numbered_in_order() -> Self {
        Warning::new(
            "numbered-in-order",
            "no peak lies near a natural frequency of the described free beam, so the peaks were \
             numbered in ascending order; check the beam's dimensions and modulus",
        )
    }

    /// The pair regression contradicts its own frequency equation: `closure` is the product implied over the product
    /// of the estimates, minus 1.
    pub(super) fn closure(closure: f64) -> Self {
        let text = format!(
            "the pair regression does not satisfy its own frequency equation: the product it \
             implies differs from the product of its estimates by {:+.0} %; the eliminated product \
             is left free by the method, and an error of this size means that the stiffnesses are \
             not to be trusted singly",
            100.0 * closure
        );
        Warning::about_pairs("closure", text)
    }

    /// The regression left something that no joint can have.
    pub(super) fn unphysical(what: impl fmt::Display) -> Self {
        let text = format!(
            "the regression's answer is not a joint that can exist: {what}; a missing or an extra \
             mode, a wrong model or readings too coarse for it are the usual causes"
        );
        Warning::about_pairs("unphysical", text)
    }

    /// The frequencies do not show a cross coupling.
    pub(super) fn coupling_not_established() -> Self {
        Warning::new(
            "coupling-not-established",
            "the interval of the cross coupling contains zero: these frequencies do not show one, \
             and Kz has no interval; the two-parameter model may do",
        )
    }

    /// The model with the estimated joint misses a mode by an error (%), where known by so many standard deviations
    /// of its reading.
    pub(super) fn misfit(mode: usize, error_percent: f64, deviations: Option<f64>) -> Self {
        let deviations = deviations.map_or(String::new(), |deviations| {
            let times = times(deviations);
            format!(" ({times} standard deviations of its frequency)")
        });
        let text = format!(
            "with the estimated joint the model misses mode {mode} by {error_percent:+.2} %{deviations}; the \
             estimator, a mode numbered wrongly, or something the model lacks may be the cause"
        );
        Warning::new("prediction-error", text)
    }

    /// Short code that scripts may look for.
    pub fn code(&self) -> &'static str {
        match self {
            Warning::Plain { code, .. } => code,
            Warning::NotRungDown { .. } => "not-rung-down",
            Warning::Mains { .. } => "mains",
            Warning::AmplitudeDependent { .. } => "amplitude-dependent",
        }
    }

    /// Returns true if it concerns the pair regression alone.
    pub fn is_of_pairs(&self) -> bool {
        matches!(self, Warning::Plain { of_pairs: true, .. })
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Plain { text, .. } => f.write_str(text),
            Warning::NotRungDown {
                file,
                remaining,
                window,
                others,
            } => {
                write_not_rung_down(f, file, *remaining, *window)?;
                write_others(f, others, 100.0, 1, "%")
            }
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
            Warning::AmplitudeDependent {
                file,
                changes,
                others,
            } => super::amplitude::write_dependence(f, file, changes, others),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_one_is_not_many() {
        let rejected = |rejected: usize| Warning::rejected_taps("a.wav", rejected, 5);
        assert!(rejected(1).to_string().contains("1 of 5 taps was rejected"));
        assert!(
            rejected(2)
                .to_string()
                .contains("2 of 5 taps were rejected")
        );
        let unpaired = |count: usize| Warning::unpaired(count, "");
        assert!(unpaired(1).to_string().starts_with("1 peak belongs to"));
        assert!(unpaired(4).to_string().starts_with("4 peaks belong to"));
    }
}
