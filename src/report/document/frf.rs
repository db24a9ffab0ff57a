//! Frequency response functions in the document.

use schemars::JsonSchema;
use serde::Serialize;

use super::recordings::added_decay;
use super::{Document, WarningSection, document_of};
use tapjoint_analysis::{Analysis, Frf, FrfResonance, Warning};
use tapjoint_signal::quality::Check;

/// The frequency response function of one sensor in one recording, one value for each line; null
/// where a value does not exist.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FrfSection {
    /// File of the recording.
    pub recording: String,
    /// Name of the sensor or channel.
    pub response: String,
    /// "accelerance", "mobility" or "receptance"; null for sound and for unknown units.
    pub form: Option<String>,
    /// "(m/s2)/N" and the like; "per unit of the file" where nobody stated units.
    pub unit: String,
    /// "H1", "H2" or "Hv": the estimator of `real` and `imaginary`.
    pub estimator: String,
    /// Taps averaged.
    pub averages: usize,
    /// "rectangular", "hann" or "exponential".
    pub window: String,
    /// Decay the window adds to every pole (1/s); null for windows that add none.
    pub window_decay: Option<f64>,
    /// The recording's resonances on this function.
    pub resonances: Vec<FrfResonanceSection>,
    /// Frequencies (Hz).
    pub frequency: Vec<f64>,
    /// Real part (unit above), in the convention e^{+j omega t}.
    pub real: Vec<Option<f64>>,
    /// Imaginary part (unit above).
    pub imaginary: Vec<Option<f64>>,
    /// Coherence; null below two averages.
    pub coherence: Option<Vec<Option<f64>>>,
    /// Relative random error (standard deviation) of the magnitude; null below two averages.
    pub random_error: Option<Vec<Option<f64>>>,
}

/// A resonance on a frequency response function.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FrfResonanceSection {
    /// Number of the mode; null for a peak that belongs to none.
    pub mode: Option<usize>,
    /// What a peak that is no mode is.
    pub label: Option<String>,
    /// Best reading of its frequency (Hz).
    pub frequency: f64,
    /// The nearest line (Hz), on which the following stand.
    pub line_frequency: f64,
    /// Magnitude (unit of the function).
    pub magnitude: Option<f64>,
    /// Phase (degrees).
    pub phase: Option<f64>,
    /// Coherence.
    pub coherence: Option<f64>,
    /// Relative random error (standard deviation) of the magnitude.
    pub random_error: Option<f64>,
}

/// The document of frequency response functions: of the analysis only what comes before any model.
pub fn frf_document(analysis: &Analysis, frfs: &[Frf]) -> Document {
    let whole = document_of(analysis);
    let measured = analysis.recordings.iter();
    let warnings = measured
        .flat_map(|recording| &recording.measurement.warnings)
        .chain(
            analysis
                .warnings
                .iter()
                .filter(|warning| is_of_function(warning)),
        );
    Document {
        version: whole.version,
        test: whole.test,
        recordings: whole.recordings,
        modes: whole.modes,
        frfs: Some(frfs.iter().map(section).collect()),
        warnings: warnings
            .map(|warning| WarningSection::of(warning, false))
            .collect(),
        ..Document::default()
    }
}

/// Checks of good practice that a function stands on: of the force and of the averages on its lines.
const OF_FUNCTION: [Check; 4] = [
    Check::ForceFall,
    Check::ForceNoise,
    Check::Coherence,
    Check::RandomError,
];

fn is_of_function(warning: &Warning) -> bool {
    matches!(warning, Warning::Quality { code, .. } if OF_FUNCTION.iter().any(|check| check.code() == *code))
}

fn section(frf: &Frf) -> FrfSection {
    let values = frf.values();
    FrfSection {
        recording: frf.recording.clone(),
        response: frf.response.clone(),
        form: frf.form.map(|form| form.name().to_string()),
        unit: frf.unit.clone(),
        estimator: frf.estimator.name().to_string(),
        averages: frf.averages,
        window: frf.window.name().to_string(),
        window_decay: added_decay(frf.window),
        resonances: frf.resonances.iter().map(resonance).collect(),
        frequency: frf.lines.frequencies(),
        real: values.iter().map(|value| value.map(|v| v.re)).collect(),
        imaginary: values.iter().map(|value| value.map(|v| v.im)).collect(),
        coherence: frf.coherence.clone(),
        random_error: frf.random_error.clone(),
    }
}

fn resonance(found: &FrfResonance) -> FrfResonanceSection {
    FrfResonanceSection {
        mode: found.mode,
        label: found.label.clone(),
        frequency: found.frequency,
        line_frequency: found.line_frequency,
        magnitude: found.value.map(|value| value.norm()),
        phase: found.value.map(|value| value.arg().to_degrees()),
        coherence: found.quality.coherence,
        random_error: found.quality.random_error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_function_carries_the_doubts_that_it_stands_on() {
        let told = |check: Check| {
            is_of_function(&Warning::Quality {
                code: check.code(),
                text: String::new(),
            })
        };
        assert!(told(Check::ForceFall) && told(Check::ForceNoise) && told(Check::Coherence));
        assert!(!told(Check::Linearity) && !told(Check::TapLevels));
        assert!(!is_of_function(&Warning::NumberedInOrder));
    }
}
