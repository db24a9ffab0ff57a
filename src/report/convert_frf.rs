//! Frequency response functions as a document and as comma separated values.

use num_complex::Complex64;

use super::ReportError;
use super::convert::document;
use super::csv::write;
use super::document::{Document, FrfResonanceSection, FrfSection, WarningSection};
use super::format::with_minus_signs;
use tapjoint_analysis::{Analysis, Frf, FrfResonance, Warning};
use tapjoint_signal::quality::Check;
use tapjoint_signal::spectral::Window;

/// Columns of the table of frequency response functions.
const COLUMNS: [&str; 13] = [
    "recording",
    "response",
    "form",
    "unit",
    "frequency_Hz",
    "h1_real",
    "h1_imaginary",
    "h2_real",
    "h2_imaginary",
    "hv_real",
    "hv_imaginary",
    "coherence",
    "random_error",
];

/// The document of frequency response functions: of the analysis only what comes before any model.
pub fn frf_document(analysis: &Analysis, frfs: &[Frf]) -> Document {
    let whole = document(analysis);
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
            .map(|warning| WarningSection {
                code: warning.code().to_string(),
                text: with_minus_signs(&warning.to_string()),
                beside: false,
            })
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
    let decay = matches!(frf.window, Window::Exponential { .. });
    FrfSection {
        recording: frf.recording.clone(),
        response: frf.response.clone(),
        form: frf.form.map(|form| form.name().to_string()),
        unit: frf.unit.clone(),
        estimator: frf.estimator.name().to_string(),
        averages: frf.averages,
        window: frf.window.name().to_string(),
        window_decay: decay.then(|| frf.window.added_decay()),
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

/// One row for each line of each function: all estimators, coherence and random error, in full
/// precision; a cell is empty where a value does not exist.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_frf_csv(frfs: &[Frf]) -> Result<String, ReportError> {
    write(&COLUMNS, frfs.iter().flat_map(rows).collect())
}

fn rows(frf: &Frf) -> impl Iterator<Item = Vec<String>> {
    (0..frf.lines.points()).map(move |line| {
        let on_line = |values: &Option<Vec<Option<f64>>>| {
            number(values.as_ref().and_then(|values| *values.get(line)?))
        };
        let mut row = vec![
            frf.recording.clone(),
            frf.response.clone(),
            frf.form_words.to_string(),
            frf.unit.clone(),
            frf.lines.frequency(line).to_string(),
        ];
        for values in [&frf.h1, &frf.h2, &frf.hv] {
            let value: Option<Complex64> = values.get(line).copied().flatten();
            row.extend([number(value.map(|v| v.re)), number(value.map(|v| v.im))]);
        }
        row.extend([on_line(&frf.coherence), on_line(&frf.random_error)]);
        row
    })
}

fn number(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| value.to_string())
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
