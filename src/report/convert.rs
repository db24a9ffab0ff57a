//! From a finished analysis to the document and the data of the pictures.

use super::convert_estimate::{estimate_section, prediction_section};
use super::convert_fit::fit_section;
use super::convert_perturbation::with_perturbations;
use super::convert_quality::verdict_section;
use super::document::{
    ChannelSection, Document, FastenedMassSection, ModeSection, ModeShapeSection,
    PredictionSection, RecordingSection, TapSection, TestSection, VERSION, WarningSection,
};
use super::format::with_minus_signs;
use tapjoint_analysis::{
    AmplitudeChange, Analysis, Identification, MeasuredSpectra, ModeResult, RecordingResult,
    TestedStructure, Warning, sampled_shapes,
};
use tapjoint_beam::specimen::PointMass;
use tapjoint_beam::{Assembly, BeamTheory, NaturalMode};
use tapjoint_identify::{PairsModel, PredictedMode};
use tapjoint_signal::modal::{FrequencySource, ModeReading};
use tapjoint_signal::recording::{Format, Separator, UffCoding};
use tapjoint_signal::spectral::Window;

/// The document of a whole analysis.
pub fn document(analysis: &Analysis) -> Document {
    let identification = analysis.identification.as_ref();
    let given = analysis.recordings.is_empty();
    let document = Document {
        version: VERSION,
        test: Some(test_section(&analysis.name, analysis.structure.as_ref())),
        recordings: (!given).then(|| recordings(analysis)),
        modes: Some(
            analysis
                .modes
                .iter()
                .map(|mode| mode_section(mode, &analysis.recordings))
                .collect(),
        ),
        estimate: identification.map(estimate_section),
        estimate_reason: identification.and_then(|found| found.reason.clone()),
        prediction: identification
            .map(|found| found.prediction.iter().map(prediction_section).collect()),
        gap: None,
        mode_shapes: shapes(analysis),
        quality: (!analysis.verdicts.is_empty())
            .then(|| analysis.verdicts.iter().map(verdict_section).collect()),
        warnings: warning_sections(&analysis.warnings, identification),
        ..Document::default()
    };
    match identification {
        Some(found) => with_perturbations(document, &found.perturbations),
        None => document,
    }
}

fn shapes(analysis: &Analysis) -> Option<Vec<ModeShapeSection>> {
    let sections: Vec<ModeShapeSection> = sampled_shapes(analysis)
        .into_iter()
        .map(|shape| ModeShapeSection {
            mode: shape.mode,
            frequency: shape.frequency,
            positions: shape.positions,
            displacements: shape.displacements,
        })
        .collect();
    (!sections.is_empty()).then_some(sections)
}

/// The document of recordings that were only looked at.
pub fn inspection(recordings: &[RecordingResult], warnings: &[Warning]) -> Document {
    Document {
        version: VERSION,
        recordings: Some(recordings.iter().map(recording_section).collect()),
        warnings: warning_sections(warnings, None),
        ..Default::default()
    }
}

/// The document of a prediction for a described beam.
pub fn prediction(name: &str, structure: &TestedStructure, modes: &[PredictedMode]) -> Document {
    Document {
        version: VERSION,
        test: Some(test_section(name, Some(structure))),
        prediction: Some(modes.iter().map(prediction_section).collect()),
        ..Default::default()
    }
}

/// The document of a prediction without a beam: lambda alone.
pub fn lambdas(modes: &[NaturalMode]) -> Document {
    let rows = modes
        .iter()
        .enumerate()
        .map(|(index, mode)| PredictionSection {
            mode: index + 1,
            lambda: Some(mode.lambda),
            ..Default::default()
        });
    Document {
        version: VERSION,
        prediction: Some(rows.collect()),
        ..Default::default()
    }
}

fn test_section(name: &str, structure: Option<&TestedStructure>) -> TestSection {
    let Some(structure) = structure else {
        return TestSection {
            name: name.to_string(),
            ..Default::default()
        };
    };
    let (kind, model) = match (structure.assembly, structure.regression) {
        (Assembly::Free, _) => ("free", None),
        (Assembly::Lap, _) => ("lap", Some("2p")),
        (Assembly::Cantilever, Some(PairsModel::ThreeParameter)) => ("cantilever", Some("3p")),
        (Assembly::Cantilever, _) => ("cantilever", Some("2p")),
    };
    TestSection {
        name: name.to_string(),
        kind: Some(kind.to_string()),
        model: model.map(str::to_string),
        beam_theory: Some(theory_name(structure.theory).to_string()),
        length: Some(structure.beam.length),
        bending_stiffness: Some(structure.beam.bending_stiffness()),
        mass_per_length: Some(structure.beam.mass_per_length()),
    }
}

fn theory_name(theory: BeamTheory) -> &'static str {
    match theory {
        BeamTheory::Timoshenko => "timoshenko",
        BeamTheory::Euler => "euler",
    }
}

fn recordings(analysis: &Analysis) -> Vec<RecordingSection> {
    let section = |(index, recording): (usize, &RecordingResult)| RecordingSection {
        aside: analysis.aside.get(index).cloned().flatten(),
        ..recording_section(recording)
    };
    analysis
        .recordings
        .iter()
        .enumerate()
        .map(section)
        .collect()
}

fn recording_section(recording: &RecordingResult) -> RecordingSection {
    let spectra = recording.measurement.spectra.as_ref();
    let lines = spectra.map(|spectra| spectra.averages.lines);
    let decay = spectra.map(|spectra| spectra.window.added_decay());
    let modes = spectra.map_or(Vec::new(), |spectra| {
        spectra
            .readings
            .iter()
            .zip(&recording.mode_numbers)
            .map(|(reading, &mode)| ModeSection {
                mode,
                recording: Some(recording.file.clone()),
                ..with_quality(reading_section(reading, Some(recording)), spectra)
            })
            .collect()
    });
    RecordingSection {
        aside: None,
        file: recording.file.clone(),
        format: format_words(recording.format),
        sample_rate: recording.sample_rate,
        channels: recording.channels.len(),
        channel_details: channel_sections(recording),
        seconds: recording.seconds,
        has_hammer: recording.has_hammer,
        responses: recording.responses.iter().map(|r| r.name.clone()).collect(),
        tap_unit: recording.tap_unit.clone(),
        taps: tap_sections(recording),
        line_spacing: lines.map(|lines| lines.spacing),
        resolution: lines.map(|lines| lines.resolution()),
        half_line: lines.map(|lines| lines.half_line()),
        block: lines.map(|lines| lines.block),
        lines: lines.map(|lines| lines.displayed()),
        averages: spectra.map_or(0, |spectra| spectra.averages.taps),
        tap: recording.conditions.tap,
        sensor_positions: recording.conditions.sensor_positions.clone(),
        sensor_masses: recording.conditions.sensor_masses.clone(),
        masses: recording.conditions.masses.iter().map(fastened).collect(),
        torque: recording.conditions.torque,
        temperature: recording.conditions.temperature,
        date: recording.conditions.date.clone(),
        band: lines.map(|lines| [lines.low, lines.high]),
        window: spectra.map(|spectra| spectra.window.name().to_string()),
        window_decay: spectra
            .filter(|spectra| matches!(spectra.window, Window::Exponential { .. }))
            .and(decay),
        remaining_at_end: spectra.and_then(|spectra| Some(spectra.decay?.remaining)),
        modes,
    }
}

fn fastened(mass: &PointMass) -> FastenedMassSection {
    FastenedMassSection {
        position: mass.position,
        mass: mass.mass,
    }
}

fn format_words(format: Format) -> String {
    match format {
        Format::WavInteger { bits } => format!("WAV, {bits}-bit integer"),
        Format::WavFloat { bits } => format!("WAV, {bits}-bit float"),
        Format::Csv {
            separator, decimal, ..
        } => {
            let separator = match separator {
                Separator::Tab => "tab",
                Separator::Semicolon => "semicolon",
                Separator::Comma => "comma",
                Separator::Blanks => "blanks",
            };
            let decimal = if decimal == ',' {
                ", decimal comma"
            } else {
                ""
            };
            format!("CSV, {separator}{decimal}")
        }
        Format::Uff58 {
            coding: UffCoding::Ascii,
        } => "UFF 58, text".to_owned(),
        Format::Uff58 { .. } => "UFF 58b, binary".to_owned(),
        Format::FrequencyResponses => "frequency response functions".to_owned(),
        Format::Memory => "samples in memory".to_owned(),
    }
}

fn channel_sections(recording: &RecordingResult) -> Vec<ChannelSection> {
    recording
        .channels
        .iter()
        .enumerate()
        .map(|(index, channel)| ChannelSection {
            channel: index + 1,
            name: channel.name.clone(),
            unit: channel.unit.clone(),
            scale: channel.scale,
            mean: channel.health.mean,
            rms: channel.health.rms,
            peak: channel.health.peak,
            full_scale_samples: channel.health.full_scale_samples,
            flat_tops: channel.health.flat_top_count,
            dropped_samples: channel.health.dropped_samples,
        })
        .collect()
}

fn tap_sections(recording: &RecordingResult) -> Vec<TapSection> {
    let taps = &recording.measurement.taps.taps;
    let force = |peak: f64| recording.has_hammer.then_some(peak);
    taps.iter()
        .map(|tap| TapSection {
            time: tap.time,
            peak_force: force(tap.peak),
            peak_response: if recording.has_hammer {
                None
            } else {
                Some(tap.peak)
            },
            accepted: tap.accepted(),
            reason: tap.rejection.as_ref().map(ToString::to_string),
        })
        .collect()
}

fn reading_section(reading: &ModeReading, recording: Option<&RecordingResult>) -> ModeSection {
    let change = recording.and_then(|recording| AmplitudeChange::of(reading, recording));
    let method = match reading.source {
        FrequencySource::Fit => "fit",
        FrequencySource::BetweenLines => "interpolated",
        FrequencySource::Line => "line",
    };
    ModeSection {
        mode: None,
        frequency: reading.frequency,
        method: method.to_string(),
        line_frequency: Some(reading.line_frequency),
        half_line: Some(reading.half_line),
        interpolated_frequency: reading.interpolated,
        interpolated_bound: reading.bound,
        std: reading.std,
        low: Some(reading.interval.0),
        high: Some(reading.interval.1),
        damping: reading.damping_ratio,
        damping_std: reading.damping_std,
        fit: reading.fit.as_deref().map(|fit| fit_section(fit, change)),
        coherence: None,
        random_error: None,
        lambda: None,
        prominence_db: reading.prominence_db,
        above_noise_db: reading.above_noise_db,
        recording: None,
        label: reading.label.map(|label| label.to_string()),
    }
}

/// The section with the quality of its line in the recording that it was read from.
fn with_quality(section: ModeSection, spectra: &MeasuredSpectra) -> ModeSection {
    let quality = spectra.averages.best_quality(section.frequency);
    ModeSection {
        coherence: quality.coherence,
        random_error: quality.random_error,
        ..section
    }
}

fn mode_section(mode: &ModeResult, recordings: &[RecordingResult]) -> ModeSection {
    let recording = recordings
        .iter()
        .find(|recording| mode.recording.as_ref() == Some(&recording.file));
    let spectra = recording.and_then(|recording| recording.measurement.spectra.as_ref());
    let mut reading = match &mode.reading {
        Some(reading) => match spectra {
            Some(spectra) => with_quality(reading_section(reading, recording), spectra),
            None => reading_section(reading, recording),
        },
        None => ModeSection {
            method: "given".to_string(),
            ..Default::default()
        },
    };
    // The points of the curve against amplitude stand with the recording's own reading.
    let fit = reading.fit.as_mut().and_then(|fit| fit.amplitude.as_mut());
    if let Some(amplitude) = fit {
        amplitude.points.clear();
    }
    ModeSection {
        mode: mode.mode,
        frequency: mode.frequency,
        half_line: mode.half_line,
        std: mode.std,
        lambda: mode.lambda,
        recording: mode.recording.clone(),
        label: mode.label.clone(),
        ..reading
    }
}

/// Doubts about the pair regression concern the result only where it is the estimate.
fn warning_sections(
    warnings: &[Warning],
    identification: Option<&Identification>,
) -> Vec<WarningSection> {
    let has_better = identification.is_some_and(|found| found.consistent.is_some());
    let section = |warning: &Warning| WarningSection {
        code: warning.code().to_string(),
        text: with_minus_signs(&warning.to_string()),
        beside: has_better && warning.is_of_pairs(),
    };
    warnings.iter().map(section).collect()
}
