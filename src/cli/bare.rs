//! Taking a bare file as far as it goes: samples in time, or frequency response functions.

use super::arguments::RecordingArguments;
use anyhow::bail;
use std::path::Path;
use tapjoint::description::{ReadBy, WindowKind};
use tapjoint::pipeline::{Analysis, FunctionSettings, run_functions, run_recording};
use tapjoint::recording::{RecordingError, ResponseError, UffError, open_frequency_responses};

/// What the command line may say of the analysis.
#[derive(Debug, Default)]
pub(super) struct BareSettings {
    pub(super) block: Option<usize>,
    pub(super) band: Option<(f64, f64)>,
    pub(super) window: Option<WindowKind>,
    pub(super) reading: ReadBy,
}

/// Analyses a recording; a file that holds frequency response functions instead is read as such.
///
/// # Errors
/// What keeps the file from being read; options that functions have no use for; an analysis that is
/// not possible.
pub(super) fn analyse(
    path: &Path,
    arguments: &RecordingArguments,
    settings: &BareSettings,
) -> anyhow::Result<Analysis> {
    let problem = match arguments.open(path) {
        Ok(recording) => {
            let analysis = run_recording(recording, arguments.hammer.as_ref(), |measure| {
                measure.block = settings.block;
                measure.band = settings.band;
                measure.window = settings.window;
                measure.reading = settings.reading;
            });
            return Ok(analysis?);
        }
        Err(problem) => problem,
    };
    // Only a file that is recognised as no time series is looked at again.
    if !is_no_time_series(&problem) {
        return Err(problem.into());
    }
    let mut functions = match (problem, open_frequency_responses(path)) {
        (_, Ok(functions)) => functions,
        // A universal file without samples may hold neither.
        (problem @ RecordingError::Uff(_), Err(_)) => return Err(problem.into()),
        (_, Err(problem)) => return Err(problem.into()),
    };
    refuse_options(path, arguments, settings)?;
    let name = path.file_name().unwrap_or(path.as_os_str());
    functions.file = name.to_string_lossy().into_owned();
    let settings = FunctionSettings {
        band: settings.band,
        reading: settings.reading,
        ..FunctionSettings::default()
    };
    Ok(run_functions(&functions, &settings)?)
}

/// Whether a file holds frequency response functions and no samples in time.
///
/// # Errors
/// What keeps it from being read as either.
pub(super) fn holds_functions(path: &Path, arguments: &RecordingArguments) -> anyhow::Result<bool> {
    match arguments.open(path) {
        Ok(_) => Ok(false),
        Err(problem) if is_no_time_series(&problem) => Ok(true),
        Err(problem) => Err(problem.into()),
    }
}

/// Whether a file was recognised and holds no samples in time.
fn is_no_time_series(problem: &RecordingError) -> bool {
    matches!(
        problem,
        RecordingError::Responses(ResponseError::NotTimeSeries { .. })
            | RecordingError::Uff(UffError::NoTimeSeries { .. })
    )
}

/// Options for samples in time say nothing of functions that an analyser has computed.
fn refuse_options(
    path: &Path,
    arguments: &RecordingArguments,
    settings: &BareSettings,
) -> anyhow::Result<()> {
    let given = [
        ("--hammer", arguments.hammer.is_some()),
        ("--sample-rate", arguments.sample_rate.is_some()),
        ("--block", settings.block.is_some()),
        ("--window", settings.window.is_some()),
    ];
    refuse_given(path, &given)
}

/// Refuses the first of these options that was given.
///
/// # Errors
/// One was.
pub(super) fn refuse_given(path: &Path, given: &[(&str, bool)]) -> anyhow::Result<()> {
    match given.iter().find(|(_, given)| *given) {
        Some((name, _)) => bail!(
            "{}: holds frequency response functions, and {name} is for samples in time; leave it out",
            path.display()
        ),
        None => Ok(()),
    }
}
