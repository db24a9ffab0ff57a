//! The report as data: what `report.json` holds.
//!
//! Units are SI, frequencies Hz. A value that does not exist is `null`, never 0. `low` and `high`
//! are 95 % limits, `null` where unbounded or unknown.

mod gap;
mod headline;
mod measured;
mod model;
mod sheet;
mod timings;

pub use gap::{
    Baseline, BaselineSection, GapPlaceSection, GapSection, UpdatedModelSection, gap_section,
};
pub use headline::{HeadlineSection, HeadlineValue};
pub(crate) use measured::is_strong;
pub use measured::{
    AmplitudeSection, ChannelSection, DatasetSection, FitSection, FittedFunctionSection,
    FrfSection, HammerSection, ModeSection, RecordingSection, TapSection, datasets_of,
    frf_document, functions_of, method_name,
};
pub use model::{
    BudgetRow, EstimateSection, EstimatedValue, FreeBeamSection, FreeTestSection, FromReadings,
    IdentifiabilitySection, LengthSection, MisfitSection, PairsSection, PredictionSection,
};
pub use sheet::{FileSection, InstrumentSection, SheetSection};
pub use timings::{StageTiming, Timing, TimingsSection};
// Sections that are results as they are.
pub use tapjoint_analysis::{
    AverageSection, CommonScaleSection, Conditions, EstimateMethod, FrfResonance,
    MonteCarloSection, PerturbationSection, ResolutionSpanSection, SensitivitySection,
};
pub use tapjoint_identify::Uncertain;
pub use tapjoint_signal::modal::ReadBy;

use crate::format::with_minus_signs;
use model::{estimate_section, free_test_of, lengths_of};
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_analysis::{
    Analysis, MeasuredShape, RecordingResult, SampledShape, ShapeAgreement, TestedStructure,
    Warning, measured_shapes, sampled_shapes, shape_agreement,
};
use tapjoint_beam::{Assembly, BeamTheory, NaturalMode};
use tapjoint_compare::{Comparison, Series, WatchedSeries};
use tapjoint_description::JointModel;
use tapjoint_identify::{PairsModel, PredictedMode};
use tapjoint_signal::quality::QualityVerdict;

/// Version of the document's layout.
pub const VERSION: u32 = 1;

/// The whole document. Sections that a command did not compute are left out.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct Document {
    /// Version of the layout.
    pub version: u32,
    /// The tested structure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<TestSection>,
    /// Each recording: taps, spectra, its own readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recordings: Option<Vec<RecordingSection>>,
    /// Datasets of universal files, by their headers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub datasets: Option<Vec<DatasetSection>>,
    /// Resonances merged over the recordings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modes: Option<Vec<ModeSection>>,
    /// Resonances of the beam at its other free lengths, where the clamp was moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lengths: Option<Vec<LengthSection>>,
    /// The test of the same bar without its joint, whose frequencies enter the estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_test: Option<FreeTestSection>,
    /// Frequency response functions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frfs: Option<Vec<FrfSection>>,
    /// The joint; `Some(None)` = asked for, but without an answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<Option<EstimateSection>>,
    /// The joint to go by: that of the described model, or that of the model with the effect that the diagnosis names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub headline: Option<HeadlineSection>,
    /// Why there is no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate_reason: Option<String>,
    /// Measured beside predicted frequencies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prediction: Option<Vec<PredictionSection>>,
    /// Shapes of the predicted modes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode_shapes: Option<Vec<SampledShape>>,
    /// Measured shapes of these modes, of every set-up with two places or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_shapes: Option<Vec<MeasuredShape>>,
    /// How well measured and predicted shapes agree.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape_agreement: Option<ShapeAgreement>,
    /// Estimates under changed frequencies, by every method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbation: Option<Vec<PerturbationSection>>,
    /// Average errors of the estimates under changed frequencies, as Ingole & Chatterjee state them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturbation_averages: Option<Vec<AverageSection>>,
    /// Estimates under random errors of the frequencies, one entry for each method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<Vec<MonteCarloSection>>,
    /// Spans of the estimates over all sign patterns of the half-line bounds, and what each mode
    /// contributes, one entry for each method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution_span: Option<Vec<ResolutionSpanSection>>,
    /// The gap between model and measurement: where, which effect, how far it closes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<GapSection>,
    /// What changed between two tests, or in a series of tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compare: Option<ComparisonSection>,
    /// Control charts of a series of tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub series: Option<SeriesSection>,
    /// Quality of the test: every check of good practice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<Vec<QualityVerdict>>,
    /// Files for other programs beside this document; only with `--export`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exported: Option<Vec<String>>,
    /// What each stage of the command took; only with `--timings`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timings: Option<TimingsSection>,
    /// What is filed with the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet: Option<SheetSection>,
    /// Everything that a reader of the results has to know.
    pub warnings: Vec<WarningSection>,
}

/// The tested structure.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TestSection {
    /// Name of the test.
    pub name: String,
    /// Name of the description's file, or of the bare recording's; null where several tests are compared, and for a
    /// prediction.
    pub file: Option<String>,
    /// "cantilever", "lap" or "free"; null for a bare recording.
    pub kind: Option<Assembly>,
    /// "2p" or "3p"; null where there is no joint.
    pub model: Option<JointModel>,
    /// "timoshenko" or "euler": the beam theory of the prediction.
    pub beam_theory: Option<BeamTheory>,
    /// Length (m).
    pub length: Option<f64>,
    /// Bending stiffness E I (N m2).
    pub bending_stiffness: Option<f64>,
    /// Mass per length (kg/m).
    pub mass_per_length: Option<f64>,
}

/// A warning.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct WarningSection {
    /// Short code that scripts may look for.
    pub code: String,
    /// Event, likely cause and remedy.
    pub text: String,
    /// True if it concerns only the pair regression that stands beside the estimate, and not the estimate.
    pub beside: bool,
}

impl WarningSection {
    fn of(warning: &Warning, beside: bool) -> Self {
        WarningSection {
            code: warning.code.to_string(),
            text: with_minus_signs(&warning.to_string()),
            beside,
        }
    }
}

impl Document {
    /// Kind of structure; `None` for a bare recording.
    pub fn kind(&self) -> Option<Assembly> {
        self.test.as_ref()?.kind
    }

    /// Returns true if a joint is sought: a free beam has none.
    pub fn has_joint(&self) -> bool {
        self.kind() != Some(Assembly::Free)
    }

    /// Why there is no estimate.
    pub fn no_estimate(&self) -> &str {
        let reason = self.estimate_reason.as_deref();
        reason.unwrap_or("no reason was recorded")
    }

    /// Adds the diagnosis. The headline becomes the joint that belongs to what it names.
    pub fn add_gap(&mut self, gap: GapSection) {
        let described = self.headline.take();
        self.headline = HeadlineSection::with(&gap, described.as_ref()).or(described);
        self.gap = Some(gap);
    }

    /// The warnings that concern the result itself.
    pub fn main_warnings(&self) -> impl Iterator<Item = &WarningSection> {
        self.warnings.iter().filter(|warning| !warning.beside)
    }

    /// The warnings that concern only the pair regression beside the result.
    pub fn warnings_beside(&self) -> impl Iterator<Item = &WarningSection> {
        self.warnings.iter().filter(|warning| warning.beside)
    }
}

/// Returns the document of a whole analysis.
pub fn document_of(analysis: &Analysis) -> Document {
    let identification = analysis.identification.as_ref();
    let recordings = analysis.recordings.iter().enumerate();
    let recordings = recordings.map(|(index, recording)| {
        let aside = analysis.aside.get(index).cloned().flatten();
        RecordingSection::of(recording, aside)
    });
    let modes = analysis.modes.iter();
    let modes = modes.map(|mode| ModeSection::of(mode, &analysis.recordings));
    let shapes = sampled_shapes(analysis);
    let measured = measured_shapes(analysis, &shapes);
    // Doubts about the pair regression concern the result only where it is the estimate.
    let has_better = identification.is_some_and(|found| found.consistent.is_some());
    let warnings = analysis.warnings.iter();
    let warnings =
        warnings.map(|warning| WarningSection::of(warning, has_better && warning.of_pairs));
    let mut document = Document {
        version: VERSION,
        test: Some(TestSection {
            file: analysis.file.clone(),
            ..test_section(&analysis.name, analysis.structure.as_ref())
        }),
        recordings: (!analysis.recordings.is_empty()).then(|| recordings.collect()),
        modes: Some(modes.collect()),
        lengths: lengths_of(analysis),
        free_test: free_test_of(analysis),
        estimate: identification.map(estimate_section),
        estimate_reason: identification.and_then(|found| found.reason.clone()),
        prediction: identification.map(|found| predictions(&found.prediction)),
        shape_agreement: shape_agreement(&measured, &shapes),
        mode_shapes: (!shapes.is_empty()).then_some(shapes),
        measured_shapes: (!measured.is_empty()).then_some(measured),
        quality: (!analysis.verdicts.is_empty()).then(|| analysis.verdicts.clone()),
        warnings: warnings.collect(),
        ..Document::default()
    };
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    document.headline = estimate.and_then(HeadlineSection::described);
    let perturbations = identification.map(|found| &found.perturbations);
    if let Some(found) = perturbations.filter(|found| !found.is_empty()) {
        document.perturbation = Some(found.uniform.clone());
        document.perturbation_averages = Some(found.averages.clone());
        document.monte_carlo = Some(found.random.clone()).filter(|list| !list.is_empty());
        document.resolution_span = Some(found.spans.clone()).filter(|list| !list.is_empty());
    }
    document
}

/// Returns the document of recordings that were only looked at.
pub fn inspection_of(recordings: &[RecordingResult], warnings: &[Warning]) -> Document {
    let recordings = recordings.iter();
    let recordings = recordings.map(|recording| RecordingSection::of(recording, None));
    let warnings = warnings.iter();
    Document {
        version: VERSION,
        recordings: Some(recordings.collect()),
        warnings: warnings
            .map(|warning| WarningSection::of(warning, false))
            .collect(),
        ..Document::default()
    }
}

/// Returns the document of a prediction for a described beam.
pub fn prediction_of(name: &str, structure: &TestedStructure, modes: &[PredictedMode]) -> Document {
    Document {
        version: VERSION,
        test: Some(test_section(name, Some(structure))),
        prediction: Some(predictions(modes)),
        ..Document::default()
    }
}

/// What changed between two tests.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ComparisonSection {
    /// Files of the tests of each pair.
    pub tests: Vec<PairFiles>,
    /// The answer.
    #[serde(flatten)]
    pub found: Comparison,
}

/// Files of the tests of one pair.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PairFiles {
    /// Tests before the change.
    pub before: Vec<String>,
    /// Tests after the change.
    pub after: Vec<String>,
}

/// Control charts of a series of tests.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SeriesSection {
    /// Files of the tests, in order.
    pub tests: Vec<String>,
    /// The charts.
    #[serde(flatten)]
    pub series: Series,
}

/// Returns the document of a comparison of tests with these files. `name` is that of the first test, `warnings` are those of
/// all tests.
pub fn comparison_of(
    name: &str,
    structure: &TestedStructure,
    tests: Vec<PairFiles>,
    found: Comparison,
    warnings: Vec<Warning>,
) -> Document {
    Document {
        version: VERSION,
        test: Some(test_section(name, Some(structure))),
        compare: Some(ComparisonSection { tests, found }),
        warnings: warnings
            .iter()
            .map(|warning| WarningSection::of(warning, false))
            .collect(),
        ..Document::default()
    }
}

/// Returns the document of a series of tests, whose files these are.
pub fn series_of(
    name: &str,
    structure: &TestedStructure,
    tests: Vec<String>,
    found: WatchedSeries,
    warnings: Vec<Warning>,
) -> Document {
    let warnings = warnings.iter();
    let departure = found.series.departure().map(|(_, departure)| departure);
    let compare = found.change.zip(departure).map(|(found, departure)| {
        let [before, after] = departure
            .compared()
            .map(|side| tests.get(side).unwrap_or_default().to_vec());
        let pair = PairFiles { before, after };
        ComparisonSection {
            tests: vec![pair],
            found,
        }
    });
    Document {
        version: VERSION,
        test: Some(test_section(name, Some(structure))),
        compare,
        series: Some(SeriesSection {
            tests,
            series: found.series,
        }),
        warnings: warnings.map(|one| WarningSection::of(one, false)).collect(),
        ..Document::default()
    }
}

/// Returns the document of a prediction without a beam: lambda alone.
pub fn lambdas_of(modes: &[NaturalMode]) -> Document {
    let rows = modes.iter().enumerate();
    let rows = rows.map(|(index, mode)| PredictionSection {
        mode: index + 1,
        lambda: Some(mode.lambda),
        ..PredictionSection::default()
    });
    Document {
        version: VERSION,
        prediction: Some(rows.collect()),
        ..Document::default()
    }
}

fn predictions(modes: &[PredictedMode]) -> Vec<PredictionSection> {
    let rows = modes.iter().map(|mode| PredictionSection {
        mode: mode.mode,
        measured: mode.measured,
        predicted: Some(mode.predicted),
        lambda: Some(mode.lambda),
        error_percent: mode.error_percent,
        used: mode.used,
    });
    rows.collect()
}

fn test_section(name: &str, structure: Option<&TestedStructure>) -> TestSection {
    let Some(structure) = structure else {
        return TestSection {
            name: name.to_string(),
            ..Default::default()
        };
    };
    let model = match structure.regression {
        Some(PairsModel::ThreeParameter) => JointModel::ThreeParameter,
        _ => JointModel::TwoParameter,
    };
    TestSection {
        name: name.to_string(),
        file: None,
        kind: Some(structure.assembly),
        model: (structure.assembly != Assembly::Free).then_some(model),
        beam_theory: Some(structure.theory),
        length: Some(structure.beam.length),
        bending_stiffness: Some(structure.beam.bending_stiffness()),
        mass_per_length: Some(structure.beam.mass_per_length()),
    }
}
