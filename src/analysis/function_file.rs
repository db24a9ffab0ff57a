//! Files of frequency response functions: their resonances, as a recording's.

use super::explained::{explain, unlisted_peaks};
use super::fits::{Candidates, Stabilisation, keep_chosen, stabilisation};
use super::function_fits::{FunctionModes, level_of_functions};
use super::measurement::{MeasureError, MeasuredSpectra, Measurement};
use super::recording_result::{Conditions, RecordingResult, Response};
use super::stages::{Stage, Watch, Work};
use super::warnings::Warning;
use num_complex::Complex64;
use tapjoint_description::{FunctionForm, ReadBy, SensorKind};
use tapjoint_signal::modal::fit::{Basis, Column, ModalData, modal_constants_of_frf};
use tapjoint_signal::modal::polyreference::BandPeaks;
use tapjoint_signal::modal::{
    CompositeLevel, PeakSettings, find_peaks, read_magnitude_peaks, read_peaks, set_strengths,
};
use tapjoint_signal::recording::{Format, FrequencyResponses, ResponseForm};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, LEAST_BLOCK, Lines, SpectralError, Window,
};
use tapjoint_signal::taps::Taps;

/// Settings for a file of frequency response functions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FunctionSettings {
    /// Form of all functions; `None` = what the file says. Functions without a phase are spectra in any case.
    pub form: Option<FunctionForm>,
    /// Name of the sensor; `None` = the functions' own names.
    pub sensor: Option<String>,
    /// Band to be analysed (Hz); `None` = all lines.
    pub band: Option<(f64, f64)>,
    /// Way in which natural frequencies are read.
    pub reading: ReadBy,
    /// Frequencies (Hz) of the modes that were chosen by hand; empty where the program chooses.
    pub poles: Vec<f64>,
}

/// Reads the resonances of frequency response functions, and announces the stages to `watch`.
///
/// # Errors
/// A band without enough lines.
pub fn measure_functions_watched(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
    watch: &dyn Watch,
) -> Result<RecordingResult, MeasureError> {
    let mut work = Work::begin(watch, Stage::Spectra);
    measure_functions(functions, settings, &mut work)
}

/// Reads the resonances of frequency response functions. `work` goes through the stages of spectra and fits.
pub(super) fn measure_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
    work: &mut Work,
) -> Result<RecordingResult, MeasureError> {
    work.go_on(Stage::Spectra);
    let axis = axis(functions, settings.band);
    let (first, lines) = axis.map_err(|problem| MeasureError::Spectral {
        file: functions.file.clone(),
        problem,
    })?;
    let (mut responses, mut forms, mut values) = (Vec::new(), Vec::new(), Vec::new());
    let is_spectrum = !functions.has_phase || settings.form == Some(FunctionForm::Spectrum);
    for response in &functions.responses {
        let form = match settings.form {
            _ if is_spectrum => None,
            Some(FunctionForm::Response(form)) => Some(form),
            _ => response.form,
        };
        let sensor = settings.sensor.as_ref();
        responses.push(Response {
            name: sensor.unwrap_or(&response.name).clone(),
            kind: form.map(|form| match form {
                ResponseForm::Accelerance => SensorKind::Acceleration,
                ResponseForm::Mobility => SensorKind::Velocity,
                ResponseForm::Receptance => SensorKind::Displacement,
            }),
            unit: form.map(|form| form.response_unit().to_string()),
        });
        forms.push(form);
        values.push(response.values[first..first + lines.points()].to_vec());
    }
    let mut spectra = match is_spectrum {
        true => spectra_of_magnitudes(lines, &values, settings),
        false => spectra_of_functions(lines, values, &forms, settings, work),
    };
    spectra.fitted = explain(
        &spectra.averages,
        spectra.window.added_decay(),
        &spectra.readings,
        &forms,
        &mut spectra.unlisted,
    );
    let warnings = functions.warnings.iter();
    let warnings = warnings.map(|warning| Warning::of_file(&functions.file, warning));
    let mut warnings: Vec<Warning> = warnings.collect();
    let (file, band) = (&functions.file, (lines.low, lines.high));
    warnings.extend(Warning::unlisted_peaks(
        file,
        &spectra.unlisted,
        band,
        spectra.fitted.is_some(),
    ));
    let without_mode = &spectra.stabilisation.without_mode;
    warnings.extend(Warning::poles_without_mode(file, without_mode));
    Ok(RecordingResult {
        file: functions.file.clone(),
        files: Vec::new(),
        format: Format::FrequencyResponses,
        sample_rate: None,
        seconds: None,
        channels: Vec::new(),
        has_hammer: !is_spectrum,
        conditions: Conditions::default(),
        tap_unit: (!is_spectrum).then(|| "N".to_string()),
        responses,
        band: settings.band,
        overview: None,
        mode_numbers: vec![None; spectra.readings.len()],
        measurement: Measurement {
            taps: Taps {
                taps: Vec::new(),
                noise: 0.0,
                quiet: 0..0,
                remarks: Vec::new(),
            },
            spectra: Some(spectra),
            warnings,
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

/// Reads the resonances of spectra without a phase: frequencies and half-power damping.
fn spectra_of_magnitudes(
    lines: Lines,
    values: &[Vec<Complex64>],
    settings: &FunctionSettings,
) -> MeasuredSpectra {
    let squares = |h: &Vec<Complex64>| h.iter().map(Complex64::norm_sqr).collect();
    let powers: Vec<Vec<f64>> = values.iter().map(squares).collect();
    let level = CompositeLevel::new(lines, &powers, None);
    let peaks = find_peaks(&level, &PeakSettings::default());
    let mut readings = read_magnitude_peaks(&level, &peaks);
    for reading in &mut readings {
        reading.select_estimate(settings.reading);
    }
    let stabilisation = Stabilisation {
        without_mode: keep_chosen(&mut readings, &settings.poles, &lines),
        ..Stabilisation::default()
    };
    let roots = values
        .iter()
        .map(|h| h.iter().map(|value| value.norm()).collect());
    MeasuredSpectra {
        averages: AveragedSpectra {
            responses: roots.collect(),
            response_power: powers,
            ..AveragedSpectra::empty(lines)
        },
        window: Window::Rectangular,
        decay: None,
        // Without a phase the noise is not known.
        unlisted: Vec::new(),
        fitted: None,
        readings,
        force_noise: None,
        force_window: None,
        stabilisation,
        taps_together: None,
    }
}

/// Reads the resonances of functions, each with its form where it is known.
fn spectra_of_functions(
    lines: Lines,
    values: Vec<Vec<Complex64>>,
    forms: &[Option<ResponseForm>],
    settings: &FunctionSettings,
    work: &mut Work,
) -> MeasuredSpectra {
    let columns: Vec<&[Complex64]> = values.iter().map(Vec::as_slice).collect();
    let level = level_of_functions(lines, &columns);
    let peaks = find_peaks(&level, &PeakSettings::default());
    let mut readings = read_peaks(&level, &columns, &peaks, Window::Rectangular);
    work.go_on(Stage::Fits);
    let peaks = BandPeaks::EveryFunction;
    let mut stabilisation = stabilisation(lines.low, lines.spacing, &columns, peaks);
    // The fit takes the functions without the line at 0 Hz.
    let first_fitted = usize::from(lines.low <= 0.0);
    let basis = Basis::FrequencyResponse {
        resolution: lines.resolution(),
    };
    let fitted = values.iter().enumerate().map(|(sensor, values)| Column {
        tap: 0,
        sensor,
        values: values[first_fitted..].to_vec(),
    });
    let frequencies = lines.frequencies().split_off(first_fitted);
    if let Ok(data) = ModalData::new(basis, frequencies, fitted.collect()) {
        let modes = FunctionModes(Candidates {
            lines: &lines,
            data: &data,
            stabilisation: &stabilisation,
            hum: Vec::new(),
            chosen: &settings.poles,
        });
        stabilisation.without_mode = modes.fit(&mut readings);
        // There are modal constants where the form of every function is known.
        if let Some(forms) = forms.iter().copied().collect::<Option<Vec<ResponseForm>>>() {
            for fit in readings.iter_mut().filter_map(|r| r.fit.as_deref_mut()) {
                fit.constants = modal_constants_of_frf(&fit.mode, &forms);
            }
        }
    }
    for reading in &mut readings {
        reading.select_estimate(settings.reading);
    }
    readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    set_strengths(&mut readings, forms, false);
    MeasuredSpectra {
        averages: AveragedSpectra {
            h1: Some(values),
            ..AveragedSpectra::empty(lines)
        },
        window: Window::Rectangular,
        decay: None,
        unlisted: unlisted_peaks(&level, &PeakSettings::default(), &readings),
        fitted: None,
        readings,
        force_noise: None,
        force_window: None,
        stabilisation,
        taps_together: None,
    }
}
