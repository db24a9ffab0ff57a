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

use rayon::prelude::*;

pub use amplitude::AmplitudeChange;
pub use analysis::{
    Analysis, BetweenRecordings, BoundPerturbation, CloseUp, Conditions, Estimate, EstimateMethod,
    Identification, ModeResult, Overview, Perturbation, PipelineError, RecordingResult, Response,
};
pub use checks::together;
pub use frf::{Frf, FrfError, FrfResonance, FrfSettings, form_of, frfs_of};
pub use identification::{IdentifySettings, SampledShape, identify, sampled_shapes};
pub use measure::{MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure};
pub use modes::{modes_of_measured, modes_of_recordings};
use modes::{number_loaded, set_aside};
pub use observations::{diagnose_test, nominal, nominal_with, observations, read_elsewhere};
use recordings::measure_described;
pub use recordings::{
    FunctionSettings, Wiring, inspect_bare, measure_bare, run_functions, run_wired, si_unit,
};
pub use structure::{
    KnownJoint, StructureDetails, TestedStructure, frequencies_of, jointed as jointed_structure,
    predict_described, structure_details, tested_structure,
};
pub use warning::Warning;

pub use tapjoint_description::described::fastened_masses;
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
    // In parallel, but collected in the description's order, so that of several errors the first is told.
    let (folder, test_file) = place;
    let measured = test.recordings.par_iter();
    let measured: Vec<Result<_, _>> = measured
        .map(|recording| measure_described(test, recording, folder, test_file))
        .collect();
    let mut recordings: Vec<RecordingResult> = measured.into_iter().collect::<Result<_, _>>()?;
    let doubts = test.warnings.iter().map(|warning| Warning::Description {
        text: warning.to_string(),
    });
    let mut warnings: Vec<Warning> = doubts.collect();
    for recording in &recordings {
        warnings.extend_from_slice(&recording.measurement.warnings);
    }
    let mut aside = vec![None; recordings.len()];
    let modes = match &test.measured {
        Some(measured) => modes_of_measured(measured, &structure),
        None => {
            aside = set_aside(test, &recordings);
            let mut reference: Vec<usize> = (0..recordings.len()).collect();
            reference.retain(|&index| aside[index].is_none());
            let (modes, doubts) =
                modes_of_recordings(&mut recordings, &reference, &structure, &details);
            warnings.extend(doubts);
            warnings.extend(number_loaded(
                &mut recordings,
                &modes,
                test,
                &structure,
                &details,
            ));
            modes
        }
    };
    warnings.extend(checks::of_amplitude(&recordings));
    let settings = IdentifySettings {
        fit_modes: test.analysis.fit_modes.or(settings.fit_modes),
        details,
        ..settings.clone()
    };
    let (identification, doubts) = identify(&structure, &modes, &settings);
    let known = structure.known.over(None).is_some();
    let method = match settings.method {
        EstimateMethod::Consistent if known || identification.consistent.is_some() => {
            EstimateMethod::Consistent
        }
        _ => EstimateMethod::Pairs,
    };
    warnings.extend(doubts::of_neglect(test, &structure, method));
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
