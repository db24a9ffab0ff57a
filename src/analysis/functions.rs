//! A recording that is frequency response functions already: an analyser's text, or a universal file.

use num_complex::Complex64;

use super::analysis::{Analysis, Conditions, RecordingResult, Response};
use super::error::PipelineError;
use super::fits::{Candidates, stabilisation};
use super::measure::{MeasuredSpectra, Measurement};
use super::warning::Warning;
use super::wired::analysis_of;
use tapjoint_description::{FrfForm, ReadBy, SensorKind};
use tapjoint_signal::modal::fit::{Basis, Column, ModalData, modal_constants_of_frf};
use tapjoint_signal::modal::{CompositeLevel, ModeReading, PeakSettings, find_peaks, read_peaks};
use tapjoint_signal::recording::{Format, FrequencyResponses, ResponseForm};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, LEAST_BLOCK, Lines, SpectralError, Window,
};
use tapjoint_signal::taps::Taps;

/// What is known of a file of frequency response functions beside its numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FunctionSettings {
    /// Form of all functions; `None` = what the file says.
    pub form: Option<ResponseForm>,
    /// Name of the sensor; `None` = the functions' own names.
    pub sensor: Option<String>,
    /// Band to be analysed (Hz); `None` = all lines.
    pub band: Option<(f64, f64)>,
    /// How natural frequencies are read.
    pub reading: ReadBy,
}

/// Takes frequency response functions about which nothing is described as far as they go.
///
/// # Errors
/// A band without enough lines.
pub fn run_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
) -> Result<Analysis, PipelineError> {
    measure_functions(functions, settings).map(analysis_of)
}

/// Reads the resonances of frequency response functions.
pub(super) fn measure_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
) -> Result<RecordingResult, PipelineError> {
    let fits = |problem| PipelineError::Functions {
        file: functions.file.clone(),
        problem,
    };
    let (first, lines) = axis(functions, settings.band).map_err(fits)?;
    let values: Vec<Vec<Complex64>> = functions
        .responses
        .iter()
        .map(|response| response.values[first..first + lines.points()].to_vec())
        .collect();
    let responses = responses(functions, settings);
    let spectra = spectra(lines, values, (functions, settings));
    let warnings = functions.warnings.iter().map(|warning| Warning::Recording {
        code: warning.code(),
        file: functions.file.clone(),
        text: warning.to_string(),
    });
    Ok(RecordingResult {
        file: functions.file.clone(),
        format: Format::FrequencyResponses,
        sample_rate: None,
        seconds: None,
        channels: Vec::new(),
        has_hammer: true,
        conditions: Conditions::default(),
        tap_unit: Some("N".to_string()),
        responses,
        band: settings.band,
        overview: None,
        mode_numbers: vec![None; spectra.readings.len()],
        measurement: Measurement {
            taps: Taps {
                taps: Vec::new(),
                noise: 0.0,
                remarks: Vec::new(),
            },
            spectra: Some(spectra),
            warnings: warnings.collect(),
        },
    })
}

/// Index of the first line analysed, and the axis from there.
fn axis(
    functions: &FrequencyResponses,
    band: Option<(f64, f64)>,
) -> Result<(usize, Lines), SpectralError> {
    let spacing = functions.spacing;
    let last_line = functions.lines.saturating_sub(1);
    let ends = (functions.frequency(0), functions.frequency(last_line));
    let (low, high) = band.unwrap_or(ends);
    // A hair inside, so that a line on the band's end belongs to it.
    let hair = 1e-6 * spacing;
    let first = ((low - hair - ends.0) / spacing).ceil().max(0.0) as usize;
    let last = (((high + hair - ends.0) / spacing).floor().max(0.0) as usize).min(last_line);
    let count = (last + 1).saturating_sub(first);
    if (count as f64) < LEAST_BLOCK as f64 / DISPLAY_RATIO {
        return Err(SpectralError::TooNarrow {
            low,
            high,
            seconds: 1.0 / spacing,
            resolution: spacing,
            least_width: LEAST_BLOCK as f64 / DISPLAY_RATIO * spacing,
        });
    }
    let width = (count - 1) as f64 * spacing;
    let lines = Lines {
        low: functions.frequency(first),
        high: functions.frequency(first) + width,
        spacing,
        // The block of which an analyser would show so many lines.
        block: (DISPLAY_RATIO * (count - 1) as f64).ceil() as usize,
        duration: 1.0 / spacing,
    };
    Ok((first, lines))
}

fn responses(functions: &FrequencyResponses, settings: &FunctionSettings) -> Vec<Response> {
    let one = |response: &tapjoint_signal::recording::FrequencyResponse| {
        let form = settings.form.or(response.form);
        Response {
            name: settings
                .sensor
                .clone()
                .unwrap_or_else(|| response.name.clone()),
            kind: form.map(|form| match form {
                ResponseForm::Accelerance => SensorKind::Acceleration,
                ResponseForm::Mobility => SensorKind::Velocity,
                ResponseForm::Receptance => SensorKind::Displacement,
            }),
            unit: form.map(|form| form.response_unit().to_string()),
        }
    };
    functions.responses.iter().map(one).collect()
}

fn spectra(
    lines: Lines,
    values: Vec<Vec<Complex64>>,
    (functions, settings): (&FrequencyResponses, &FunctionSettings),
) -> MeasuredSpectra {
    let powers: Vec<Vec<f64>> = values
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let columns: Vec<&[Complex64]> = values.iter().map(Vec::as_slice).collect();
    let level = CompositeLevel::new(lines, &powers, None);
    let peaks = find_peaks(&level, &PeakSettings::default());
    let mut readings = read_peaks(&level, &columns, &peaks, Window::Rectangular);
    let stabilisation = stabilisation(lines.low, lines.spacing, &columns);
    if let Some(data) = modal_data(&lines, &values) {
        let candidates = Candidates {
            lines: &lines,
            data: &data,
            stabilisation: &stabilisation,
        };
        candidates.fit(&mut readings);
        add_constants(&mut readings, (functions, settings));
    }
    for reading in &mut readings {
        reading.prefer(settings.reading);
    }
    readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    MeasuredSpectra {
        averages: AveragedSpectra {
            h1: Some(values),
            ..AveragedSpectra::empty(lines)
        },
        window: Window::Rectangular,
        decay: None,
        readings,
        force_noise: None,
        stabilisation,
    }
}

/// The functions without the line at 0 Hz; `None` where they cannot be fitted.
fn modal_data(lines: &Lines, values: &[Vec<Complex64>]) -> Option<ModalData> {
    let first = usize::from(lines.low <= 0.0);
    let basis = Basis::FrequencyResponse {
        resolution: lines.resolution(),
    };
    let columns = values.iter().enumerate().map(|(sensor, values)| Column {
        tap: 0,
        sensor,
        values: values[first..].to_vec(),
    });
    let frequencies = lines.frequencies().split_off(first);
    ModalData::new(basis, frequencies, columns.collect()).ok()
}

/// Modal constants, where the form of every function is known.
fn add_constants(
    readings: &mut [ModeReading],
    (functions, settings): (&FrequencyResponses, &FunctionSettings),
) {
    let forms = functions.responses.iter();
    let forms: Option<Vec<ResponseForm>> = forms
        .map(|response| settings.form.or(response.form))
        .collect();
    let Some(forms) = forms else { return };
    for fit in readings.iter_mut().filter_map(|r| r.fit.as_deref_mut()) {
        fit.constants = modal_constants_of_frf(&fit.mode, &forms);
    }
}

/// The form that a description states.
pub(super) fn form_of_description(form: FrfForm) -> ResponseForm {
    match form {
        FrfForm::Accelerance => ResponseForm::Accelerance,
        FrfForm::Mobility => ResponseForm::Mobility,
        FrfForm::Receptance => ResponseForm::Receptance,
    }
}
