//! Taking a bare file as far as it goes: samples in time, or frequency response functions.

use super::arguments::RecordingArguments;
use std::path::Path;
use tapjoint::description::{ReadingMethod, WindowKind};
use tapjoint::pipeline::{Analysis, FunctionSettings, run_functions, run_recording};
use tapjoint::recording::open_frequency_responses;

/// What the command line may say of the analysis.
#[derive(Debug, Default)]
pub(super) struct BareSettings {
    pub(super) block: Option<usize>,
    pub(super) band: Option<(f64, f64)>,
    pub(super) window: Option<WindowKind>,
    pub(super) reading: ReadingMethod,
}

/// Analyses a recording; a file that holds frequency response functions instead is read as such.
///
/// # Errors
/// Those of the recording, unless the file holds functions; an analysis that is not possible.
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
    let Ok(mut functions) = open_frequency_responses(path) else {
        return Err(problem.into());
    };
    let name = path.file_name().unwrap_or(path.as_os_str());
    functions.file = name.to_string_lossy().into_owned();
    let settings = FunctionSettings {
        band: settings.band,
        reading: settings.reading,
        ..FunctionSettings::default()
    };
    Ok(run_functions(&functions, &settings)?)
}
