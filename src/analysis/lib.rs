//! The whole chain as one library call.
//!
//! ```text
//! test.toml -> recordings -> taps -> spectra -> readings      (measurement, per recording)
//!           -> one list of numbered modes                      (modes)
//!           -> joint, prediction, perturbation                 (identification)
//! ```
//!
//! [`run_test`] is that chain; [`run_recording`] stops after the readings. Nothing here prints or
//! writes.

mod amplitude;
mod averages;
mod bare;
mod checks;
mod compared;
mod decays;
mod explained;
mod fits;
mod found;
mod free_test;
mod frf;
mod function_file;
mod function_fits;
mod identification;
mod lengths;
mod live;
mod measured_shapes;
mod measurement;
mod mode_file;
mod modes;
mod observations;
mod observed_mode;
mod point_shapes;
mod pulse_window;
mod quiet;
mod recording_result;
mod results;
mod selection;
mod stages;
mod structure;
mod tap_responses;
mod warnings;
mod wiring;

pub use amplitude::AmplitudeChange;
pub use bare::{
    BareError, BareSettings, channel_of, is_no_time_series, measure_bare_file, refuse_for_functions,
};
use checks::judge;
pub use compared::{compared_items, compared_test};
pub use explained::{FittedCurves, STRONG_PEAK, UnlistedPeak};
pub use found::{hammer_doubt, look_at};
pub use free_test::{FreeTest, FreeTestError, measure_free_test};
pub use frf::{FittedCurve, Frf, FrfError, FrfResonance, FrfSettings, form_of, frfs_of};
pub use function_file::{FunctionSettings, measure_functions_watched};
use identification::identify_watched;
pub use identification::{IdentifySettings, SampledShape, identify, sampled_shapes};
use lengths::measured_modes_of;
pub use live::{RecordingPlan, TapsSoFar, taps_so_far};
pub use measured_shapes::{
    MeasuredShape, ShapeAgreement, ShapeBy, ShapePoint, measured_shapes, shape_agreement,
};
pub use measurement::{
    ForceWindow, MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure,
};
use modes::{modes_of_bare, set_aside};
pub use modes::{modes_of_measured, modes_of_recordings};
pub use observations::{diagnose_test, nominal, nominal_with, observations, read_elsewhere};
pub use point_shapes::{NumberedPoints, PointDisplacement, PointShape, PointShapes, point_shapes};
use recording_result::amplitude_changes;
pub use recording_result::{CloseUp, Conditions, Overview, RecordingResult, Response};
pub use results::{
    AverageSection, BetweenRecordings, CommonScaleSection, Estimate, EstimateMethod,
    Identification, LeftOutMode, ModeResult, MonteCarloSection, MovedLength, PerturbationSection,
    Perturbations, ResolutionSpanSection, SensitivitySection,
};
pub use stages::{Stage, Watch, Work};
pub use structure::{
    KnownJoint, StructureDetails, TestedStructure, frequencies_of, jointed as jointed_structure,
    predict_described, structure_details, tested_structure,
};
pub use warnings::{WARNING_CODES, Warning, meaning_of, severity_of, together};
use warnings::{neglected_effects, of_amplitude};
use wiring::finish;
pub use wiring::{
    PipelineError, Wiring, described_reading, inspect_bare, measure_bare, measure_bare_watched,
    si_unit,
};

use std::path::Path;
use tapjoint_description::{ChannelRef, TestDescription};
use tapjoint_signal::quality::QualityVerdict;
use tapjoint_signal::recording::{FrequencyResponses, Recording};

/// A finished analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// Name of the test.
    pub name: String,
    /// Name of the description's file, or of the bare recording's; `None` where it has none.
    pub file: Option<String>,
    /// The structure; `None` for a bare recording.
    pub structure: Option<TestedStructure>,
    /// The recordings, in the order of the description.
    pub recordings: Vec<RecordingResult>,
    /// Difference of each recording from the first, "8.8 times its tap level", for which the list of modes leaves
    /// it out; `None` where it does not.
    pub aside: Vec<Option<String>>,
    /// Resonances of the reference configuration, ascending: the first recording and all others
    /// with its sensor positions and tap level.
    pub modes: Vec<ModeResult>,
    /// Resonances of the beam at its other free lengths, where the clamp was moved.
    pub lengths: Vec<MovedLength>,
    /// The test of the same bar without its joint; `None` where the description names none.
    pub free_test: Option<FreeTest>,
    /// The joint or the material by the modes; `None` for a bare recording.
    pub identification: Option<Identification>,
    /// Quality of the test: good practice, check by check.
    pub verdicts: Vec<QualityVerdict>,
    /// Everything that a reader of the results has to know.
    pub warnings: Vec<Warning>,
}

impl Analysis {
    /// Returns true if there is an answer. A test is answered by an estimate, or by a prediction (from known stiffnesses)
    /// beside a measured mode. A bare recording is answered by a mode.
    pub fn is_answered(&self) -> bool {
        match &self.identification {
            Some(found) => {
                found.is_answered() || found.prediction.iter().any(|mode| mode.measured.is_some())
            }
            None => self.modes.iter().any(|mode| mode.mode.is_some()),
        }
    }
}

/// Runs a described test: its recordings, or the frequencies that it or its file of modes gives.
///
/// `place` is the folder in which files are looked for and the description's own name, for
/// messages. `settings.fit_modes` yields to the description's, `settings.details` are the
/// description's. The caller reads the description that `free_test` names, and has it measured
/// by [`measure_free_test`] for `settings.free_test`.
///
/// # Errors
/// Recordings that cannot be read or analysed. Too few taps or modes are no errors: the analysis
/// then says what is missing.
pub fn run_test(
    test: &TestDescription,
    place: (&Path, &str),
    settings: &IdentifySettings,
) -> Result<Analysis, PipelineError> {
    run_test_watched(test, place, settings, &())
}

/// Runs a test as [`run_test`] does, and announces the stages to `watch`.
///
/// # Errors
/// Those of [`run_test`].
pub fn run_test_watched(
    test: &TestDescription,
    place: (&Path, &str),
    settings: &IdentifySettings,
    watch: &dyn Watch,
) -> Result<Analysis, PipelineError> {
    let structure = tested_structure(test);
    let mut details = structure_details(test, &structure.beam);
    let measured = measured_modes_of(test, place, &structure, &details, watch)?;
    let (recordings, found) = (measured.recordings, measured.numbered);
    let mut warnings = measured.warnings;
    if let Some(free) = &settings.free_test {
        details.free = Some(free.bar.clone());
        warnings.extend_from_slice(&free.warnings);
    }
    warnings.extend(of_amplitude(amplitude_changes(&recordings)));
    let mut outside = test.analysis.poles.clone();
    outside.retain(|pole| {
        let mut bands = recordings.iter().filter_map(RecordingResult::looked_at);
        !bands.any(|(low, high)| (low..=high).contains(pole))
    });
    warnings.extend(Warning::poles_outside(&outside).filter(|_| !recordings.is_empty()));
    let settings = IdentifySettings {
        fit_modes: test.analysis.fit_modes.or(settings.fit_modes),
        lengths: found.lengths,
        details,
        ..settings.clone()
    };
    let (identification, doubts) = identify_watched(&structure, &found.modes, &settings, watch);
    let method = identification.method(&structure, settings.method);
    let described = test.of_length(None);
    warnings.extend(neglected_effects(&described, &structure, method));
    warnings.extend(doubts);
    let (verdicts, doubts) = judge(&recordings);
    warnings.extend(doubts);
    Ok(Analysis {
        name: test.name.clone(),
        file: Path::new(place.1)
            .file_name()
            .map(|file| file.to_string_lossy().into_owned()),
        structure: Some(structure),
        aside: found.aside,
        recordings,
        modes: found.modes,
        lengths: settings.lengths,
        free_test: settings.free_test,
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
    run_recording_watched(recording, hammer, adjust, &())
}

/// Takes a bare recording as far as [`run_recording`] does, and announces the stages to `watch`.
///
/// # Errors
/// Those of [`run_recording`].
pub fn run_recording_watched(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
    watch: &dyn Watch,
) -> Result<Analysis, PipelineError> {
    measure_bare_watched(recording, hammer, adjust, watch).map(analysis_of)
}

/// Takes a bare recording with known channels as far as it goes: taps, spectra, readings. `adjust` may
/// change the defaults of the measurement. The stages are announced to `watch`.
///
/// # Errors
/// An unreadable recording, a band or block that does not fit.
pub fn run_wired(
    recording: Recording,
    wiring: &Wiring,
    adjust: impl FnOnce(&mut MeasureSettings),
    watch: &dyn Watch,
) -> Result<Analysis, PipelineError> {
    let mut work = Work::begin(watch, Stage::Taps);
    let mut settings = MeasureSettings::new(wiring.source());
    adjust(&mut settings);
    let mut result = finish(recording, settings, wiring, &mut work)?;
    for (channel, unit) in wiring.units() {
        if let Some(info) = result.channels.get_mut(channel) {
            info.unit.clone_from(unit);
        }
    }
    Ok(analysis_of(result))
}

/// Takes frequency response functions about which nothing is described as far as they go.
///
/// # Errors
/// A band without enough lines.
pub fn run_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
) -> Result<Analysis, PipelineError> {
    run_functions_watched(functions, settings, &())
}

/// Takes functions as far as [`run_functions`] does, and announces the stages to `watch`.
///
/// # Errors
/// Those of [`run_functions`].
pub fn run_functions_watched(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
    watch: &dyn Watch,
) -> Result<Analysis, PipelineError> {
    let result = measure_functions_watched(functions, settings, watch)?;
    Ok(analysis_of(result))
}

/// Returns the analysis of measured recordings about which nothing is described, as one test of this name.
pub fn analysis_of_bare(name: String, mut recordings: Vec<RecordingResult>) -> Analysis {
    let aside = set_aside(&[], &recordings);
    let (modes, doubts) = modes_of_bare(&mut recordings, &aside);
    let measured = recordings.iter();
    let measured = measured.flat_map(|recording| recording.measurement.warnings.iter().cloned());
    let mut warnings: Vec<Warning> = measured.chain(doubts).collect();
    warnings.extend(of_amplitude(amplitude_changes(&recordings)));
    let (verdicts, doubts) = judge(&recordings);
    warnings.extend(doubts);
    Analysis {
        file: Some(name.clone()),
        name,
        structure: None,
        aside,
        verdicts,
        warnings: together(warnings),
        modes,
        lengths: Vec::new(),
        free_test: None,
        identification: None,
        recordings,
    }
}

/// The analysis of one recording about which nothing is described.
fn analysis_of(recording: RecordingResult) -> Analysis {
    analysis_of_bare(recording.file.clone(), vec![recording])
}
