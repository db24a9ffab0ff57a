//! One test in, one record out.

use crate::record::{
    BatchRecord, Estimated, HypothesisRow, ModeRow, ParameterRow, Parameters, TestOutcome, TestRow,
};
use crate::settings::{BatchSettings, BatchTest, DescribedTest, Subject};
use std::collections::BTreeMap;
use tapjoint_analysis::{
    Analysis, BareError, FreeTest, IdentifySettings, PipelineError, Stage, Watch, Work,
    analysis_of_bare, diagnose_test, measure_bare_file, measure_free_test, run_test_watched,
};
use tapjoint_description::{ASSEMBLIES, Assembly, DescriptionError};
use tapjoint_diagnosis::{Diagnosis, GapError, GapSettings, HypothesisResult};
use tapjoint_identify::Uncertain;
use tapjoint_report::document::{
    Document, EstimateSection, EstimatedValue, HeadlineValue, ModeSection, PredictionSection,
    method_name,
};
use tapjoint_report::{document_of, gap_section};
use tapjoint_signal::quality::Outcome;

/// Reasons for which a test cannot be analysed.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// A file without a description cannot be analysed.
    #[error(transparent)]
    Bare(#[from] BareError),
    /// A described test cannot be analysed.
    #[error(transparent)]
    Test(#[from] PipelineError),
    /// The description, or the test of the free bar that it names, cannot be used.
    #[error(transparent)]
    Description(#[from] DescriptionError),
}

/// An analysed test.
#[derive(Debug)]
pub struct Analysed {
    /// The analysis.
    pub analysis: Analysis,
    /// The diagnosis, or why there is none; `None` where none was asked for, and of a bare recording.
    pub diagnosis: Option<Result<Diagnosis, GapError>>,
}

/// Analyses one test. A test that cannot be analysed gives a record with its error.
pub fn answer(test: &BatchTest, settings: &BatchSettings) -> BatchRecord {
    answer_watched(test, settings, &())
}

/// Analyses one test as [`answer`] does, and announces the stages to `watch`.
pub fn answer_watched(
    test: &BatchTest,
    settings: &BatchSettings,
    watch: &dyn Watch,
) -> BatchRecord {
    let identify = IdentifySettings::unperturbed();
    match analyse(test, settings, &identify, watch) {
        Ok(found) => record_of(test, &found),
        Err(error) => failed(test, &error),
    }
}

/// Returns the record of a test that cannot be analysed.
pub fn failed(test: &BatchTest, error: &BatchError) -> BatchRecord {
    let files = test.file_names();
    BatchRecord::failed(&test.file, &test.carried, error.to_string(), &files)
}

/// Analyses one test, and diagnoses it where the settings ask for it. The stages are announced to `watch`.
///
/// # Errors
/// Files that cannot be read or analysed, and a test of the free bar that gives no data.
pub fn analyse(
    test: &BatchTest,
    settings: &BatchSettings,
    identify: &IdentifySettings,
    watch: &dyn Watch,
) -> Result<Analysed, BatchError> {
    match &test.subject {
        Subject::Bare(path) => {
            let measured = measure_bare_file(path, &settings.bare, watch)?;
            Ok(Analysed {
                analysis: analysis_of_bare(measured.file.clone(), vec![measured]),
                diagnosis: None,
            })
        }
        Subject::Described(described) => {
            let identify = IdentifySettings {
                free_test: measured_free_test(described, watch)?,
                ..identify.clone()
            };
            let place = (described.folder.as_path(), described.name.as_str());
            let analysis = run_test_watched(&described.test, place, &identify, watch)?;
            let gap = GapSettings {
                seed: settings.seed,
                ..GapSettings::default()
            };
            let diagnosis = settings.diagnosis.then(|| {
                let _work = Work::begin(watch, Stage::Diagnosis);
                diagnose_test(&described.test, &analysis, &gap)
            });
            Ok(Analysed {
                analysis,
                diagnosis,
            })
        }
    }
}

/// Measures the free bar; `None` where the description names no test of it.
fn measured_free_test(
    described: &DescribedTest,
    watch: &dyn Watch,
) -> Result<Option<FreeTest>, BatchError> {
    let named = described.test.beam.free_test.as_ref();
    let Some((named, free)) = named.zip(described.free.as_deref()) else {
        return Ok(None);
    };
    let place = (free.folder.as_path(), free.name.as_str());
    let measured = measure_free_test(&described.test, &free.test, place, watch);
    let measured = measured.map_err(|cause| named.error(&described.name, cause.to_string()))?;
    Ok(Some(measured))
}

/// Returns the record of an analysed test. Its numbers are those of `report.json`.
pub fn record_of(test: &BatchTest, found: &Analysed) -> BatchRecord {
    let mut document = document_of(&found.analysis);
    if let Some(diagnosis) = &found.diagnosis {
        document.add_gap(gap_section(diagnosis.as_ref()));
    }
    let modes = document.modes.as_deref().unwrap_or_default();
    let predictions = document.prediction.as_deref().unwrap_or_default();
    let gap = document.gap.as_ref();
    BatchRecord {
        test: test_row(test, &found.analysis, &document),
        modes: modes
            .iter()
            .map(|mode| mode_row(mode, predictions))
            .collect(),
        hypotheses: gap.map_or_else(Vec::new, |gap| {
            gap.hypotheses.iter().map(hypothesis_row).collect()
        }),
    }
}

fn test_row(test: &BatchTest, analysis: &Analysis, document: &Document) -> TestRow {
    let recordings = document.recordings.as_deref().unwrap_or_default();
    let taps = recordings.iter().flat_map(|one| &one.taps);
    let (accepted, rejected): (Vec<_>, Vec<_>) = taps.partition(|tap| tap.accepted);
    let modes = document.modes.as_deref().unwrap_or_default();
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let misfit = estimate.and_then(|estimate| estimate.misfit.as_ref());
    let headline = document.headline.as_ref();
    let gap = document.gap.as_ref();
    let first = gap.and_then(|gap| gap.hypotheses.first());
    let checks = document.quality.as_deref().unwrap_or_default();
    let failing = |outcome: Outcome| {
        let all = checks.iter().filter(|one| one.outcome == outcome);
        each_once(all.map(|one| one.check.code()))
    };
    let is_answered = analysis.is_answered();
    TestRow {
        file: test.file.clone(),
        name: analysis.name.clone(),
        outcome: match is_answered {
            true => TestOutcome::Answered,
            false => TestOutcome::NoAnswer,
        },
        error: (!is_answered).then(|| no_answer(document)),
        reason: None,
        kind: document.kind().and_then(kind_name),
        recordings: recordings.len() as u64,
        taps_accepted: accepted.len() as u64,
        taps_rejected: rejected.len() as u64,
        modes: modes.iter().filter(|mode| mode.mode.is_some()).count() as u64,
        method: estimate.map(|estimate| estimate.method.name().to_owned()),
        modes_used: estimate.map_or_else(Vec::new, |estimate| {
            estimate
                .modes_used
                .iter()
                .map(|mode| *mode as u64)
                .collect()
        }),
        parameters: estimate.map_or_else(Parameters::default, parameters),
        goodness_of_fit: estimate.and_then(|estimate| estimate.goodness_of_fit),
        misfit_percent: misfit.map(|misfit| misfit.rms_percent),
        headline: headline.map(|headline| headline.model.clone()),
        headline_kt: headline.and_then(|headline| headline.kt.map(stated)),
        headline_kr: headline.and_then(|headline| headline.kr.map(stated)),
        verdict: gap.map(|gap| gap.verdict.kind().to_owned()),
        effects: gap.map_or_else(Vec::new, |gap| {
            let named = gap.verdict.hypotheses();
            named.iter().map(|one| one.name()).collect()
        }),
        first_hypothesis: first.map(|first| first.hypothesis.name()),
        first_probability: first.map(|first| first.probability),
        checks: checks
            .iter()
            .filter(|one| one.outcome != Outcome::NotApplicable)
            .count() as u64,
        doubtful_checks: failing(Outcome::Doubtful),
        bad_checks: failing(Outcome::Bad),
        warnings: document.warnings.len() as u64,
        warning_codes: each_once(document.warnings.iter().map(|one| one.code.as_str())),
        carried: test.carried.clone(),
    }
}

/// Returns the word of a description for a kind of structure.
fn kind_name(kind: Assembly) -> Option<String> {
    let mut words = ASSEMBLIES.iter();
    let (word, _) = words.find(|(_, own)| *own == kind)?;
    Some((*word).to_owned())
}

/// Returns why an analysed test has no answer.
fn no_answer(document: &Document) -> String {
    match &document.estimate_reason {
        Some(reason) => reason.clone(),
        None => "no mode was found".to_owned(),
    }
}

/// Returns texts without repetitions, in the order in which they first occur.
fn each_once<'a>(texts: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for text in texts {
        if found.iter().all(|one| one != text) {
            found.push(text.to_owned());
        }
    }
    found
}

fn parameters(estimate: &EstimateSection) -> Parameters {
    let value = |found: &Option<EstimatedValue>| {
        let found = found.as_ref()?;
        Some(Estimated::of(&found.uncertain))
    };
    Parameters {
        kt: value(&estimate.kt),
        kr: value(&estimate.kr),
        ktr: value(&estimate.ktr),
        kx: value(&estimate.kx),
        ky: value(&estimate.ky),
        kz: value(&estimate.kz),
        coupling: value(&estimate.coupling),
        modulus: value(&estimate.modulus),
        density: value(&estimate.density),
    }
}

fn stated(value: HeadlineValue) -> Estimated {
    Estimated::of(&Uncertain {
        value: value.value.unwrap_or(f64::INFINITY),
        low: value.low,
        high: value.high,
        ..Uncertain::default()
    })
}

fn mode_row(mode: &ModeSection, predictions: &[PredictionSection]) -> ModeRow {
    let mut predictions = predictions.iter();
    let predicted = predictions.find(|one| Some(one.mode) == mode.mode);
    let fit = mode.fit.as_ref();
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    ModeRow {
        mode: mode.mode.map(|mode| mode as u64),
        label: mode.label.clone(),
        recording: mode.recording.clone(),
        method: method_name(mode.method).to_owned(),
        frequency: finite(Some(mode.frequency)),
        std: finite(mode.std),
        low: finite(mode.low),
        high: finite(mode.high),
        half_line: finite(mode.half_line),
        damping: finite(mode.damping),
        damping_std: finite(mode.damping_std),
        damping_low: finite(fit.map(|fit| fit.damping_low)),
        damping_high: finite(fit.map(|fit| fit.damping_high)),
        lambda: finite(mode.lambda),
        coherence: finite(mode.coherence),
        predicted: finite(predicted.and_then(|one| one.predicted)),
        error_percent: finite(predicted.and_then(|one| one.error_percent)),
        used: predicted.map(|one| one.used),
    }
}

fn hypothesis_row(found: &HypothesisResult) -> HypothesisRow {
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    let groups: Vec<&str> = found.groups.iter().map(|group| group.name()).collect();
    let mut named = BTreeMap::new();
    for one in &found.parameters {
        named.insert(format!("{}.{}", one.effect.name(), one.name), one);
    }
    let parameters = named.into_iter().map(|(name, one)| ParameterRow {
        name,
        value: finite(Some(one.value)),
        std: finite(one.std),
    });
    HypothesisRow {
        effect: found.hypothesis.name(),
        group: (!groups.is_empty()).then(|| groups.join("+")),
        probability: finite(Some(found.probability)),
        log_bayes_factor: finite(found.log_bayes_factor),
        confounded_with: found
            .confounded_with
            .iter()
            .map(|one| one.name().to_owned())
            .collect(),
        parameters: parameters.collect(),
        gap_before: finite(found.gap_before),
        gap_after: finite(found.gap_after),
        withheld_before: finite(found.holdout_before),
        withheld_after: finite(found.holdout_after),
        withheld_closure: finite(found.withheld_closure.map(|closure| closure.value)),
    }
}
