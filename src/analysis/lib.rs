//! The whole chain as one library call.
//!
//! ```text
//! test.toml -> recordings -> taps -> spectra -> readings      (measure, per recording)
//!           -> one list of numbered modes                      (modes)
//!           -> joint, prediction, perturbation                 (identification)
//! ```
//!
//! [`run_test`] is that chain; [`run_recording`] stops after the readings. Nothing here prints or
//! writes.

mod amplitude;
mod analysis;
mod between_recordings;
mod checks;
mod doubts;
mod fits;
mod frf;
mod identification;
mod measure;
mod modes;
mod noise;
mod observations;
mod observed_mode;
mod recordings;
mod structure;
mod warning;

use std::path::Path;

pub use amplitude::AmplitudeChange;
pub use analysis::{
    Analysis, AverageSection, BetweenRecordings, CloseUp, Conditions, Estimate, EstimateMethod,
    Identification, ModeResult, MonteCarloSection, Overview, PerturbationSection, Perturbations,
    PipelineError, RecordingResult, ResolutionSpanSection, Response, SensitivitySection,
};
pub use checks::together;
pub use frf::{Frf, FrfError, FrfResonance, FrfSettings, form_of, frfs_of};
pub use identification::{IdentifySettings, SampledShape, identify, sampled_shapes};
pub use measure::{MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure};
pub use modes::{modes_of_measured, modes_of_recordings};
use modes::{modes_of_test, set_aside};
pub use observations::{diagnose_test, nominal, nominal_with, observations, read_elsewhere};
use recordings::measure_test;
pub use recordings::{
    FunctionSettings, Wiring, inspect_bare, measure_bare, run_functions, run_wired, si_unit,
};
pub use structure::{
    KnownJoint, StructureDetails, TestedStructure, frequencies_of, jointed as jointed_structure,
    predict_described, structure_details, tested_structure,
};
pub use warning::Warning;

use tapjoint_description::{ChannelRef, TestDescription};
use tapjoint_signal::recording::Recording;

/// Runs a described test: its recordings, or the frequencies it gives.
///
/// `place` is the folder in which recordings are looked for and the description's own name, for
/// messages. `settings.fit_modes` yields to the description's, `settings.details` are the
/// description's.
///
/// # Errors
/// Recordings that cannot be read or analysed. Too few taps or modes are no errors: the analysis
/// then says what is missing.
pub fn run_test(
    test: &TestDescription,
    place: (&Path, &str),
    settings: &IdentifySettings,
) -> Result<Analysis, PipelineError> {
    let structure = tested_structure(test);
    let details = structure_details(test, &structure.beam);
    let mut recordings = measure_test(test, place.0, place.1)?;
    let mut warnings = doubts::of_description(test);
    for recording in &recordings {
        warnings.extend_from_slice(&recording.measurement.warnings);
    }
    let mut aside = vec![None; recordings.len()];
    let modes = if let Some(measured) = &test.measured {
        modes_of_measured(measured, &structure)
    } else {
        aside = set_aside(test, &recordings);
        let (modes, doubts) = modes_of_test(test, &mut recordings, &aside, &structure, &details);
        warnings.extend(doubts);
        modes
    };
    warnings.extend(checks::of_amplitude(&recordings));
    let settings = IdentifySettings {
        fit_modes: test.analysis.fit_modes.or(settings.fit_modes),
        details,
        ..settings.clone()
    };
    let (identification, doubts) = identify(&structure, &modes, &settings);
    let method = identification.method(&structure, settings.method);
    warnings.extend(doubts::neglected_effects(test, &structure, method));
    warnings.extend(doubts);
    let (verdicts, doubts) = checks::judge(&recordings);
    warnings.extend(doubts);
    Ok(Analysis {
        name: test.name.clone(),
        structure: Some(structure),
        aside,
        recordings,
        modes,
        identification: Some(identification),
        verdicts,
        warnings: together(warnings),
    })
}

/// Takes a bare recording as far as it goes: taps, spectra, readings. `adjust` may change the
/// defaults of the measurement.
///
/// # Errors
/// An unknown hammer channel, an unreadable recording, a band or block that does not fit.
pub fn run_recording(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<Analysis, PipelineError> {
    measure_bare(recording, hammer, adjust).map(recordings::analysis_of)
}
