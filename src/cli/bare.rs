//! Analysis of a bare file: samples in time, or frequency response functions.

use super::arguments::{RecordingArguments, SpectrumSettings};
use super::input::file_name;
use anyhow::bail;
use std::path::Path;
use tapjoint::description::ReadBy;
use tapjoint::pipeline::{Analysis, FunctionSettings, run_functions, run_recording};
use tapjoint::recording::{RecordingError, open_frequency_responses};

/// Analyses a recording, or the frequency response functions of a file without samples in time.
///
/// # Errors
/// The file cannot be read, an option does not apply to functions, or the analysis is not possible.
pub(super) fn analyse(
    path: &Path,
    recording: &RecordingArguments,
    spectrum: &SpectrumSettings,
    reading: ReadBy,
) -> anyhow::Result<Analysis> {
    let problem = match recording.open(path) {
        Ok(opened) => {
            let analysis = run_recording(opened, recording.hammer.as_ref(), |measure| {
                spectrum.apply(measure);
                measure.reading = reading;
            });
            return Ok(analysis?);
        }
        Err(problem) => problem,
    };
    // Only a file that is recognised as no time series is read again.
    if !is_no_time_series(&problem) {
        return Err(problem.into());
    }
    let mut functions = match (problem, open_frequency_responses(path)) {
        (_, Ok(functions)) => functions,
        // A universal file without samples may hold neither.
        (problem @ RecordingError::NoTimeSeries { .. }, Err(_)) => return Err(problem.into()),
        (_, Err(problem)) => return Err(problem.into()),
    };
    let time_options = [
        ("--hammer", recording.hammer.is_some()),
        ("--sample-rate", recording.sample_rate.is_some()),
        ("--block", spectrum.block.is_some()),
        ("--window", spectrum.window.is_some()),
    ];
    refuse_given(path, &time_options)?;
    functions.file = file_name(path);
    let settings = FunctionSettings {
        band: spectrum.zoom,
        reading,
        ..FunctionSettings::default()
    };
    Ok(run_functions(&functions, &settings)?)
}

/// Returns true if a file holds frequency response functions and no samples in time.
///
/// # Errors
/// The file can be read as neither.
pub(super) fn holds_functions(path: &Path, arguments: &RecordingArguments) -> anyhow::Result<bool> {
    match arguments.open(path) {
        Ok(_) => Ok(false),
        Err(problem) if is_no_time_series(&problem) => Ok(true),
        Err(problem) => Err(problem.into()),
    }
}

/// Returns true if a file was recognised and holds no samples in time.
fn is_no_time_series(problem: &RecordingError) -> bool {
    matches!(
        problem,
        RecordingError::FrequencyColumn { .. } | RecordingError::NoTimeSeries { .. }
    )
}

/// Refuses the first of these options that was given: they do not apply to functions.
///
/// # Errors
/// One of them was given.
pub(super) fn refuse_given(path: &Path, options: &[(&str, bool)]) -> anyhow::Result<()> {
    match options.iter().find(|(_, given)| *given) {
        Some((name, _)) => bail!(
            "{}: holds frequency response functions, and {name} is for samples in time; leave it out",
            path.display()
        ),
        None => Ok(()),
    }
}
