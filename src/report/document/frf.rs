//! Frequency response functions in the document.

use schemars::JsonSchema;
use serde::Serialize;

use super::recordings::added_decay;
use super::{Document, WarningSection, document_of};
use tapjoint_analysis::{Analysis, Frf, FrfResonance, Warning};
use tapjoint_signal::quality::Check;

/// The frequency response function of one sensor in one recording: lists of numbers instead of complex values on an
/// axis, one for each line; null where a value does not exist.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FrfSection {
    /// File of the recording.
    pub recording: String,
    /// Name of the sensor or channel.
    pub response: String,
    /// "accelerance", "mobility" or "receptance"; null for sound and for unknown units.
    pub form: Option<String>,
    /// "(m/s2)/N" and the like; "per unit of the file" where no units are stated.
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
    pub resonances: Vec<FrfResonance>,
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

/// The document of frequency response functions: of the analysis only what comes before any model.
pub fn frf_document(analysis: &Analysis, frfs: &[Frf]) -> Document {
    let whole = document_of(analysis);
    let of_recordings = analysis.recordings.iter();
    let of_recordings = of_recordings.flat_map(|recording| &recording.measurement.warnings);
    let of_functions = analysis
        .warnings
        .iter()
        .filter(|warning| is_of_function(warning));
    let warnings = of_recordings.chain(of_functions);
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
    let mut checks = OF_FUNCTION.iter();
    checks.any(|check| check.code() == warning.code)
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
        resonances: frf.resonances.clone(),
        frequency: frf.lines.frequencies(),
        real: values.iter().map(|value| value.map(|v| v.re)).collect(),
        imaginary: values.iter().map(|value| value.map(|v| v.im)).collect(),
        coherence: frf.coherence.clone(),
        random_error: frf.random_error.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_function_carries_the_doubts_that_it_stands_on() {
        let told = |check: Check| is_of_function(&Warning::new(check.code(), ""));
        assert!(told(Check::ForceFall) && told(Check::ForceNoise) && told(Check::Coherence));
        assert!(!told(Check::Linearity) && !told(Check::TapLevels));
        assert!(!is_of_function(&Warning::new("numbered-in-order", "")));
    }
}
