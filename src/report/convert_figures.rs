//! The data of the pictures, from a finished analysis.

use num_complex::Complex64;

use super::figures::{
    Curve, FrfCurve, PeakMark, RecordingFigure, SpectraFigure, TapMark, TimeOverview,
};
use super::format::unit_words;
use crate::description::SensorKind;
use crate::pipeline::{Analysis, MeasuredSpectra, RecordingResult, Response};

/// One set of pictures for each recording.
pub fn figures(analysis: &Analysis) -> Vec<RecordingFigure> {
    analysis.recordings.iter().map(recording_figure).collect()
}

fn recording_figure(recording: &RecordingResult) -> RecordingFigure {
    let taps = recording
        .measurement
        .taps
        .taps
        .iter()
        .map(|tap| TapMark {
            time: tap.time,
            peak: tap.peak,
            rejected: tap.rejection.as_ref().map(ToString::to_string),
        })
        .collect();
    let label = match recording.responses.first() {
        _ if recording.has_hammer => format!("force ({})", words_of(&recording.tap_unit)),
        Some(first) => format!("response {} ({})", first.name, words_of(&first.unit)),
        None => "response".to_string(),
    };
    RecordingFigure {
        file: recording.file.clone(),
        overview: recording.overview.as_ref().map(|overview| TimeOverview {
            label,
            step: overview.step,
            low: overview.low.clone(),
            high: overview.high.clone(),
            taps,
        }),
        spectra: recording
            .measurement
            .spectra
            .as_ref()
            .map(|spectra| spectra_figure(recording, spectra)),
    }
}

fn spectra_figure(recording: &RecordingResult, spectra: &MeasuredSpectra) -> SpectraFigure {
    let averages = &spectra.averages;
    let named = |response: &Response| match response.kind {
        Some(kind) => format!("{}, {}", response.name, words(kind)),
        None => response.name.clone(),
    };
    SpectraFigure {
        lines: averages.lines,
        averages: averages.taps,
        force: averages.force.clone(),
        force_unit: seconds_of(recording.tap_unit.as_deref()),
        responses: recording
            .responses
            .iter()
            .zip(&averages.responses)
            .map(|(response, values)| Curve {
                name: named(response),
                unit: seconds_of(response.unit.as_deref()),
                values: values.clone(),
            })
            .collect(),
        frfs: averages.h1.as_ref().map_or(Vec::new(), |h1| {
            recording
                .responses
                .iter()
                .zip(h1)
                .map(|(response, h1)| frf(response, recording.tap_unit.as_deref(), h1))
                .collect()
        }),
        peaks: spectra
            .readings
            .iter()
            .zip(&recording.mode_numbers)
            .map(|(reading, &mode)| PeakMark {
                mode,
                frequency: reading.frequency,
                line_frequency: reading.line_frequency,
                half_line: reading.half_line,
                prominence_db: reading.prominence_db,
                label: reading.label.map(|label| label.to_string()),
            })
            .collect(),
    }
}

fn frf(response: &Response, force_unit: Option<&str>, h1: &[Complex64]) -> FrfCurve {
    let form = match response.kind {
        Some(SensorKind::Acceleration) => "accelerance",
        Some(SensorKind::Velocity) => "mobility",
        Some(SensorKind::Displacement) => "receptance",
        Some(SensorKind::Sound) => "sound pressure per force",
        None => "response per force",
    };
    FrfCurve {
        name: response.name.clone(),
        form: form.to_string(),
        unit: match (response.unit.as_deref().map(unit_words), force_unit) {
            (Some(unit), Some(force)) if unit.contains('/') => format!("({unit})/{force}"),
            (Some(unit), Some(force)) => format!("{unit}/{force}"),
            _ => "units of the file".to_string(),
        },
        magnitude: h1.iter().map(|value| value.norm()).collect(),
        phase: h1.iter().map(|value| value.arg().to_degrees()).collect(),
    }
}

/// Unit of a transform: that of the signal times seconds.
fn seconds_of(unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{} s", unit_words(unit)),
        None => "unit of the file \u{d7} s".to_string(),
    }
}

/// A unit in words, also where nobody said.
fn words_of(unit: &Option<String>) -> String {
    unit_words(unit.as_deref().unwrap_or("unit of the file"))
}

fn words(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Acceleration => "acceleration",
        SensorKind::Velocity => "velocity",
        SensorKind::Displacement => "displacement",
        SensorKind::Sound => "sound pressure",
    }
}
