//! Warnings: every doubt of the analysis. Each is a sentence with event, likely cause and remedy. The type, the list of
//! codes and what joins warnings stand here, the sentences in two files: doubts about the measurement and about the
//! estimate. A new warning is a code in [`WARNING_CODES`], a row of the table in docs/reference.md, and a constructor.

mod estimate;
mod measurement;
mod sensors;

pub(super) use estimate::{neglected_effects, of_estimate, of_prediction};
pub(super) use measurement::{of_amplitude, of_quality, of_recording};
use std::fmt;
use std::mem::{swap, take};

/// The code of every warning, and when it is given. docs/reference.md shows the same table.
pub const WARNING_CODES: [(&str, &str); 80] = [
    // Of the description and of files, by their readers.
    (
        "description",
        "a key or value of the description is doubtful",
    ),
    (
        "right-aligned",
        "samples of a WAV file fill the low bits of their containers",
    ),
    (
        "unknown-length",
        "the header of a WAV file gives no valid length",
    ),
    ("truncated", "a file holds less than its header promises"),
    ("header-cut", "a UFF file ends within a header"),
    (
        "repeated-place",
        "two channels of a UFF file have the same place and quantity",
    ),
    ("dataset-left-out", "a dataset of a UFF file is left out"),
    (
        "damping-left-out",
        "the damping ratios of a file of modes are left out",
    ),
    (
        "rate-rounded",
        "the steps of a time column scatter around the sample rate",
    ),
    (
        "sample-rate-ignored",
        "a given sample rate differs from the file's own",
    ),
    (
        "time-assumed",
        "no heading names the time: the first column is taken for it",
    ),
    (
        "resampled",
        "slightly uneven samples were resampled to even times",
    ),
    (
        "segments-joined",
        "segments of a LabVIEW file are joined that do not follow each other",
    ),
    (
        "values-assumed",
        "a column of a function is taken as linear magnitudes, or as a phase in degrees",
    ),
    (
        "lines-assumed",
        "functions of a MATLAB file are taken to reach to half the sample rate",
    ),
    ("coherence-left-out", "a coherence is left out"),
    (
        "shapes-left-out",
        "the shapes of a file of modes are not used",
    ),
    (
        "other-direction",
        "modes of a file move in another direction than the others",
    ),
    (
        "unknown-unit",
        "the unit of a channel or function is not known",
    ),
    (
        "units-disagree",
        "label and unit system of a channel do not agree",
    ),
    (
        "scale-over-unit",
        "a given scale is used instead of the file's unit",
    ),
    ("forms-disagree", "axes and unit of a function do not agree"),
    ("constant-channel", "all samples of a channel are equal"),
    ("full-scale", "samples lie at full scale"),
    ("flat-tops", "a channel is flat at its extreme level"),
    (
        "dropped-samples",
        "samples are repeated inside the moving signal",
    ),
    ("stopped-channel", "a sensor gives no signal in some taps"),
    ("offset", "the mean of a channel is large beside its peak"),
    (
        "header-length",
        "a file holds more samples than its header states",
    ),
    (
        "hammer-channel",
        "by its name or its pulses another channel may be the hammer's",
    ),
    // Of taps and spectra.
    ("taps", "the search for taps has a remark"),
    ("rejected-taps", "taps were rejected"),
    ("single-tap", "only one tap was averaged"),
    (
        "not-selected",
        "taps could not be chosen by their responses",
    ),
    (
        "taps-disagree",
        "responses to the taps differ, and it is open which are right",
    ),
    ("taps-too-short", "the taps leave no spectrum"),
    ("hann-on-taps", "a Hann window was chosen for taps"),
    (
        "not-rung-down",
        "the response does not come to rest within the block",
    ),
    ("mains", "a peak was taken for mains hum"),
    (
        "combinations",
        "peaks are sums and differences of others, as a nonlinear joint makes them",
    ),
    ("unlisted-peak", "a strong peak is no listed mode"),
    (
        "pole-without-mode",
        "no mode could be fitted where `poles` names one",
    ),
    // Of the checks of good practice.
    (
        "force-ripple",
        "the force spectrum ripples, as two blows make it",
    ),
    ("tap-levels", "the taps have different levels"),
    (
        "force-fall",
        "the force spectrum falls too far within the band",
    ),
    (
        "force-noise",
        "the force sinks into its noise within the band",
    ),
    ("coherence", "the coherence at a resonance is low"),
    ("random-error", "the random error at a resonance is large"),
    (
        "exponential-window",
        "the exponential window ends the record, not the structure",
    ),
    ("window-damping", "a damping is mostly the window's"),
    ("frequency-scatter", "a frequency scatters from tap to tap"),
    (
        "driving-point",
        "resonances at the driving point differ in sign",
    ),
    (
        "antiresonance",
        "antiresonances at the driving point are missing",
    ),
    (
        "reciprocity",
        "tap and sensor exchanged give another response",
    ),
    ("linearity", "a frequency depends on the tap's level"),
    ("mass-loading", "a frequency depends on the sensors' places"),
    // Of the numbers of the modes.
    ("amplitude-dependent", "a mode changes with its amplitude"),
    ("unpaired", "peaks belong to no mode"),
    ("missing-mode", "no peak was taken for a mode"),
    (
        "ambiguous-pairing",
        "another numbering of the modes is nearly as probable",
    ),
    ("moved-mode", "a mode is far apart in the recordings"),
    (
        "doubtful-scale",
        "by the model the scale of a sensor or of the hammer cannot be right",
    ),
    (
        "outlying-mode",
        "a mode, or one of a few, does not belong to the others and is left out of the estimate",
    ),
    (
        "other-numbers",
        "the modes would be explained if they were numbered otherwise",
    ),
    (
        "inverted-sensor",
        "a sensor seems to be mounted the other way",
    ),
    (
        "numbered-in-order",
        "no peak of a free beam lies where one is expected",
    ),
    (
        "unnumbered",
        "the modes of a recording with other masses have no numbers",
    ),
    // Of the estimate.
    ("neglected", "estimate or prediction leave out an effect"),
    (
        "fallback",
        "a closed form stands in the place of the consistent estimate",
    ),
    ("closure", "the pair regression fails its own check"),
    (
        "unphysical",
        "the stiffnesses of the pair regression belong to no joint",
    ),
    (
        "coupling-not-established",
        "the frequencies do not show a cross coupling",
    ),
    ("misfit", "the model does not explain the frequencies"),
    ("untestable", "nothing can test whether the model fits"),
    (
        "at-limit",
        "a stiffness is at the end of its range, or its interval is open",
    ),
    (
        "flat-direction",
        "the frequencies leave a combination of parameters open",
    ),
    (
        "other-minimum",
        "another joint comes near the same frequencies",
    ),
    ("not-converged", "the search for the best joint did not end"),
    ("no-prediction", "the estimated joint has no prediction"),
    ("prediction-error", "the prediction misses a mode notably"),
];

/// Codes of the warnings that concern the answer itself, the worst first. All others concern how it was measured.
const OF_THE_ANSWER: [&str; 20] = [
    "unphysical",
    "not-converged",
    "no-prediction",
    "taps-too-short",
    "misfit",
    "other-numbers",
    "outlying-mode",
    "ambiguous-pairing",
    "moved-mode",
    "inverted-sensor",
    "doubtful-scale",
    "units-disagree",
    "unknown-unit",
    "flat-direction",
    "at-limit",
    "other-minimum",
    "fallback",
    "numbered-in-order",
    "missing-mode",
    "prediction-error",
];

/// Returns the place of a code among those that concern the answer itself, the worst first; `None` for any other.
pub fn severity_of(code: &str) -> Option<usize> {
    OF_THE_ANSWER.iter().position(|known| *known == code)
}

/// Returns when a warning of this code is given, in half a sentence; `None` for an unknown code.
pub fn meaning_of(code: &str) -> Option<&'static str> {
    let mut known = WARNING_CODES.iter();
    known
        .find(|(known, _)| *known == code)
        .map(|(_, when)| *when)
}

/// A warning that travels with the result. Displays as event, likely cause and remedy.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Warning {
    /// Short code that scripts may look for.
    pub code: &'static str,
    /// True if it concerns the pair regression alone.
    pub of_pairs: bool,
    sentence: String,
    /// Kind of a doubt that recordings may share: of one kind the worst stands for all. `None` of all else.
    shared: Option<&'static str>,
    /// Size by which the worst is chosen.
    severity: f64,
    /// The recording and its number, "a.wav: 4.5 %", of a doubt that may be shared.
    about: String,
    /// The other recordings and their numbers.
    others: Vec<String>,
}

impl Warning {
    /// A doubt with a code of [`WARNING_CODES`].
    pub fn new(code: &'static str, sentence: impl Into<String>) -> Self {
        debug_assert!(
            WARNING_CODES.iter().any(|(known, _)| *known == code),
            "the list of codes lacks {code}"
        );
        Warning {
            code,
            sentence: sentence.into(),
            ..Warning::default()
        }
    }

    /// The doubt about a part of the test, in these words: "free length 0.2 m", "free test free.toml".
    #[must_use]
    pub fn of_part(self, words: &str) -> Self {
        Warning {
            sentence: format!("{words}: {}", self.sentence),
            ..self
        }
    }

    /// A doubt about a recording, its search for taps, or a file of modes.
    pub(super) fn about(file: &str, code: &'static str, sentence: impl fmt::Display) -> Self {
        Warning::new(code, format!("{file}: {sentence}"))
    }
}

impl fmt::Display for Warning {
    /// Writes "... (the same of b.wav: 4.5 %, c.wav: 8.8 %)".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)?;
        match self.others.is_empty() {
            true => Ok(()),
            false => write!(f, " (the same of {})", self.others.join(", ")),
        }
    }
}

/// Warnings that differ in their recording and a number alone become one, in the place of the first.
pub fn together(warnings: Vec<Warning>) -> Vec<Warning> {
    let mut kept: Vec<Warning> = Vec::new();
    for mut warning in warnings {
        let shared = warning.shared;
        let mut earlier = kept.iter_mut().filter(|_| shared.is_some());
        let same = earlier.find(|one| (one.code, one.shared) == (warning.code, shared));
        let Some(earlier) = same else {
            kept.push(warning);
            continue;
        };
        // The worst stands in front.
        if warning.severity > earlier.severity {
            swap(earlier, &mut warning);
            earlier.others = take(&mut warning.others);
        }
        earlier.others.push(warning.about);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_severe_code_is_one_of_the_list() {
        let unknown = OF_THE_ANSWER
            .iter()
            .filter(|code| meaning_of(code).is_none());
        assert_eq!(unknown.count(), 0);
    }
}
