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
pub use analysis::PipelineError;
pub use analysis::{
    Analysis, BetweenRecordings, BoundPerturbation, CloseUp, Conditions, Estimate, EstimateMethod,
    Identification, ModeResult, Overview, Perturbation, RecordingResult, Response,
};
pub use checks::together;
pub use frf::{Frf, FrfError, FrfResonance, FrfSettings, form_of, frfs_of};
pub use identification::{IdentifySettings, SampledShape, identify, sampled_shapes};
pub use measure::{MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure};
pub use modes::{modes_of_measured, modes_of_recordings};
pub use observations::observations;
pub use observations::{diagnose_test, nominal, nominal_with};
pub use recordings::{FunctionSettings, run_functions};
pub use recordings::{Wiring, run_wired};
pub use recordings::{inspect_bare, measure_bare, si_unit};
pub use structure::{KnownJoint, TestedStructure, tested_structure};
pub use structure::{
    StructureDetails, frequencies_of, jointed as jointed_structure, predict_described,
    structure_details,
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
    // In parallel, but collected in the description's order, so that of several errors the first is told.
    let mut recordings = test
        .recordings
        .par_iter()
        .map(|recording| recordings::measure_described(test, recording, place))
        .collect::<Vec<Result<_, _>>>()
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let mut warnings: Vec<Warning> = test
        .warnings
        .iter()
        .map(|warning| Warning::Description {
            text: warning.to_string(),
        })
        .collect();
    warnings.extend(
        recordings
            .iter()
            .flat_map(|r| r.measurement.warnings.iter().cloned()),
    );
    let mut aside = vec![None; recordings.len()];
    let modes = match &test.measured {
        Some(measured) => modes_of_measured(measured, &structure),
        None => {
            aside = modes::set_aside(test, &recordings);
            let reference = modes::reference_configuration(&aside);
            let known = (&structure, &details);
            let (found, doubts) = modes_of_recordings(&mut recordings, &reference, known);
            warnings.extend(doubts);
            warnings.extend(modes::number_loaded(&mut recordings, &found, test, known));
            found
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
