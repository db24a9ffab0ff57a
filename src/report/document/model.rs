//! The model in the document: the estimate, and predicted beside measured frequencies.

use schemars::JsonSchema;
use serde::Serialize;

use super::ModeSection;
use crate::format::significant;
use tapjoint_analysis::{Analysis, Estimate, EstimateMethod, Identification, LeftOutMode};
use tapjoint_beam::Beam;
use tapjoint_identify::consistent::{ConsistentEstimate, Correlation, Limit, Measure, Quantity};
use tapjoint_identify::{SingleMode, Uncertain};
use tapjoint_numerics::stats::times;

/// An estimated value: its own interval takes everything that is uncertain into account.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct EstimatedValue {
    /// Value, standard deviation and 95 % interval.
    #[serde(flatten)]
    pub uncertain: Uncertain,
    /// The value by the readings alone: the description exact, and a model that misses nothing. Null of a closed form.
    pub from_readings: Option<FromReadings>,
    /// What each input contributes, the largest first; empty of a closed form.
    pub budget: Vec<BudgetRow>,
    /// The 95 % limits for the joint of a further set-up; only where set-ups differ beyond noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub further_set_up: Option<[f64; 2]>,
}

impl EstimatedValue {
    /// A value of a closed form.
    pub fn of(uncertain: Uncertain) -> Self {
        Self {
            uncertain,
            ..Self::default()
        }
    }
}

/// A value by the readings alone.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct FromReadings {
    /// The value; null where it is infinite: rigid.
    pub value: Option<f64>,
    /// Standard deviation.
    pub std: Option<f64>,
    /// Lower 95 % limit.
    pub low: Option<f64>,
    /// Upper 95 % limit.
    pub high: Option<f64>,
}

/// Contribution of an input to an estimated value.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BudgetRow {
    /// "readings", "discrepancy", "modulus", "mass of A", ...
    pub input: String,
    /// Its part in the standard deviation (%); the squares add up.
    pub std_percent: f64,
}

/// Where the fit moved an uncertain property of the description.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DescriptionRow {
    /// The property, as in the budget.
    pub input: String,
    /// Value that the description states (SI).
    pub stated: f64,
    /// Value that the fit gives it (SI).
    pub fitted: f64,
    /// Their difference in standard uncertainties of the description.
    pub pull: f64,
}

/// The mode that the estimate is without. Where several may be the outlying one, it is the most probable.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct LeftOutRow {
    /// Its number.
    pub mode: usize,
    /// Measured less predicted by the other modes (%).
    pub error_percent: f64,
    /// The same in standard deviations of that prediction.
    pub deviations: f64,
    /// Kt (N/m) with all modes; null where it is not estimated.
    pub kt: Option<Uncertain>,
    /// Kr (N m/rad) with all modes, likewise.
    pub kr: Option<Uncertain>,
    /// Modulus (Pa) with all modes, likewise.
    pub modulus: Option<Uncertain>,
    /// All modes that may not belong to the others, the most probable first. With more than one the limits of the estimate hold
    /// the limits of all answers.
    pub candidates: Vec<CandidateRow>,
}

/// A mode that may not belong to the others, and the estimate without it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CandidateRow {
    /// Its number.
    pub mode: usize,
    /// Probability that it is this one of the candidates.
    pub probability: f64,
    /// Measured less predicted by the other modes (%).
    pub error_percent: f64,
    /// The same in standard deviations of that prediction.
    pub deviations: f64,
    /// Kt (N/m) without it; null where it is not estimated.
    pub kt: Option<Uncertain>,
    /// Kr (N m/rad) without it, likewise.
    pub kr: Option<Uncertain>,
    /// Modulus (Pa) without it, likewise.
    pub modulus: Option<Uncertain>,
}

/// What a further measurement would make of the estimate.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RemedyRow {
    /// "weigh-beam", "free-test", "caliper" or "weigh-masses".
    pub measure: Measure,
    /// Standard deviation of Kt with it (%); null where Kt is not estimated.
    pub kt_percent: Option<f64>,
    /// Standard deviation of Kr with it (%), likewise.
    pub kr_percent: Option<f64>,
    /// Standard deviation of the modulus with it (%), likewise.
    pub modulus_percent: Option<f64>,
}

/// The joint, or the free beam's material.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct EstimateSection {
    /// "consistent", "pairs", or "free-beam".
    pub method: EstimateMethod,
    /// Modes that entered.
    pub modes_used: Vec<usize>,
    /// Set-ups that differ beyond noise: estimate and intervals are those of their mean joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set_ups: Option<usize>,
    /// Why the estimate is doubtful, if it is.
    pub reason: Option<String>,
    /// Kx, non-dimensional.
    pub kx: Option<EstimatedValue>,
    /// Ky, non-dimensional.
    pub ky: Option<EstimatedValue>,
    /// Kz, non-dimensional.
    pub kz: Option<EstimatedValue>,
    /// sqrt(Kx Ky)/Kz.
    pub coupling: Option<EstimatedValue>,
    /// Kt (N/m).
    pub kt: Option<EstimatedValue>,
    /// Kr (N m/rad).
    pub kr: Option<EstimatedValue>,
    /// Ktr (N/rad).
    pub ktr: Option<EstimatedValue>,
    /// Young's modulus (Pa).
    pub modulus: Option<EstimatedValue>,
    /// Density (kg/m3).
    pub density: Option<EstimatedValue>,
    /// The beam that belongs to the joint: as described but for what was estimated of it; null of a closed
    /// form.
    pub beam: Option<Beam>,
    /// What the model itself may miss: one standard deviation of each frequency (%). Null of a closed form and with relative
    /// weights.
    pub discrepancy_percent: Option<f64>,
    /// Where the fit moved the uncertain properties of the description.
    pub description: Vec<DescriptionRow>,
    /// What further measurements would make of the standard deviations.
    pub remedies: Vec<RemedyRow>,
    /// The mode that was left out because it does not belong to the others; null where all belong together.
    pub left_out: Option<LeftOutRow>,
    /// Standard uncertainties that the description does not state, in words; null where all are stated.
    pub assumed: Option<String>,
    /// Covariance of ln Kx and ln Ky, of a consistent estimate with both; scaled by the misfit where no
    /// uncertainty is stated.
    pub log_covariance: Option<[[f64; 2]; 2]>,
    /// Correlations between the parameters.
    pub correlations: Vec<Correlation>,
    /// Probability of a larger misfit if the model is right; null where nothing is left to test with.
    pub goodness_of_fit: Option<f64>,
    /// The misfit behind it; null of a closed form.
    pub misfit: Option<MisfitSection>,
    /// Combinations of parameters that the frequencies determine; null of a closed form.
    pub identifiability: Option<IdentifiabilitySection>,
    /// The pair regression.
    pub pairs: Option<PairsSection>,
    /// A free beam in closed form.
    pub free_beam: Option<FreeBeamSection>,
    /// Estimates from each mode alone: of a lap joint its Kx if antisymmetric or Ky if symmetric, of a free
    /// beam its modulus; else empty.
    pub single_modes: Vec<SingleMode>,
}

/// Values of the pair regression: non-dimensional those of its equations, with units those of the joint that they make.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PairsSection {
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
    /// Kt (N/m).
    pub kt: Option<f64>,
    /// Kr (N m/rad).
    pub kr: Option<f64>,
    /// Ktr (N/rad).
    pub ktr: Option<f64>,
    /// Product implied by the regression over the product of its own estimates, minus 1.
    pub closure: Option<f64>,
    /// Largest over smallest singular value of the regression, its columns scaled to 1.
    pub condition: Option<f64>,
}

/// Fit of the model to the frequencies: the goodness of the estimate in percent and in words.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct MisfitSection {
    /// Sum of squared residuals over their standard deviations; null without uncertainties.
    pub chi_squared: Option<f64>,
    /// Frequencies and priors less parameters.
    pub degrees_of_freedom: usize,
    /// Root-mean-square relative misfit of the frequencies (%).
    pub rms_percent: f64,
    /// The verdict in a sentence.
    pub verdict: String,
}

/// Combinations of parameters that the frequencies determine, and those that they do not.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct IdentifiabilitySection {
    /// Singular values of the Jacobian, descending: the inverse of each is the relative uncertainty of
    /// one combination of the parameters.
    pub singular_values: Vec<f64>,
    /// Largest over smallest.
    pub condition: Option<f64>,
    /// Flat directions, dead parameters, parameters at the end of their range, in sentences.
    pub statements: Vec<String>,
}

/// A free beam's material in closed form: either value alone, with the other as described.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct FreeBeamSection {
    /// Young's modulus (Pa) at the described density.
    pub modulus: f64,
    /// Density (kg/m3) at the described modulus instead.
    pub density: f64,
}

/// One measured mode beside its prediction, of which there is lambda alone without a beam. error_percent = 100 (predicted - measured)/measured.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PredictionSection {
    /// Mode number.
    pub mode: usize,
    /// Measured (Hz).
    pub measured: Option<f64>,
    /// Predicted (Hz).
    pub predicted: Option<f64>,
    /// Predicted, non-dimensional.
    pub lambda: Option<f64>,
    /// Error (%).
    pub error_percent: Option<f64>,
    /// True if the mode entered the estimate.
    pub used: bool,
}

/// The beam at another free length, where the clamp was moved. Its frequencies enter the same estimate.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct LengthSection {
    /// Free length (m).
    pub length: f64,
    /// Its recordings.
    pub recordings: Vec<String>,
    /// Its resonances, numbered for this length, ascending.
    pub modes: Vec<ModeSection>,
    /// The modes that entered the estimate beside their predictions by it; empty without an estimate.
    pub prediction: Vec<PredictionSection>,
}

/// The test of the same bar without its joint. Its frequencies enter the same estimate.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FreeTestSection {
    /// Its description.
    pub file: String,
    /// Length of the bar (m).
    pub length: f64,
    /// Its recordings.
    pub recordings: Vec<String>,
    /// Its resonances, ascending.
    pub modes: Vec<ModeSection>,
    /// The modes that entered the estimate beside their predictions by it; empty without an estimate, and with relative
    /// weights, where the free bar tells nothing.
    pub prediction: Vec<PredictionSection>,
}

/// Returns the section of the free bar's test; `None` without one.
pub(super) fn free_test_of(analysis: &Analysis) -> Option<FreeTestSection> {
    let free = analysis.free_test.as_ref()?;
    let modes = free.modes.iter();
    // Its structure follows those of other free lengths.
    let structure = 1 + analysis.lengths.len();
    Some(FreeTestSection {
        file: free.file.clone(),
        length: free.bar.structure.beam.length,
        recordings: free.recordings.iter().map(|one| one.file.clone()).collect(),
        modes: modes
            .map(|mode| ModeSection::of(mode, &free.recordings))
            .collect(),
        prediction: predicted_of(analysis, structure, &free.bar.structure.beam),
    })
}

/// Returns the fitted modes of one structure of the estimate beside their predictions; `beam` is its own.
fn predicted_of(analysis: &Analysis, structure: usize, beam: &Beam) -> Vec<PredictionSection> {
    let found = analysis.identification.as_ref();
    let estimate = found.and_then(|found| found.consistent.as_ref());
    let fitted = estimate.into_iter().flat_map(|estimate| &estimate.modes);
    let fitted = fitted.filter(|mode| mode.structure == structure);
    let rows = fitted.map(|mode| PredictionSection {
        mode: mode.mode,
        measured: Some(mode.measured),
        predicted: Some(mode.predicted),
        lambda: Some(beam.lambda_of(mode.predicted)),
        error_percent: Some(mode.error_percent),
        used: true,
    });
    rows.collect()
}

/// Returns the sections of other free lengths; `None` without any.
pub(super) fn lengths_of(analysis: &Analysis) -> Option<Vec<LengthSection>> {
    let mut sections = Vec::with_capacity(analysis.lengths.len());
    for (structure, own) in (1..).zip(&analysis.lengths) {
        let modes = own.modes.iter();
        sections.push(LengthSection {
            length: own.length,
            recordings: own.recordings.clone(),
            modes: modes
                .map(|mode| ModeSection::of(mode, &analysis.recordings))
                .collect(),
            prediction: predicted_of(analysis, structure, &own.structure.beam),
        });
    }
    (!sections.is_empty()).then_some(sections)
}

/// Returns the main estimate, with the closed form beside it.
pub(super) fn estimate_section(found: &Identification) -> Option<EstimateSection> {
    let closed = found.estimate.as_ref().map(|estimate| match estimate {
        Estimate::Joint(joint) => {
            let doubts: Vec<String> = joint.doubts.iter().map(ToString::to_string).collect();
            EstimateSection {
                method: EstimateMethod::Pairs,
                modes_used: joint.modes_used.clone(),
                reason: (!doubts.is_empty()).then(|| doubts.join("; ")),
                kx: joint.kx.map(EstimatedValue::of),
                ky: joint.ky.map(EstimatedValue::of),
                kz: joint.kz.map(EstimatedValue::of),
                coupling: joint.coupling.map(EstimatedValue::of),
                kt: joint.kt.map(EstimatedValue::of),
                kr: joint.kr.map(EstimatedValue::of),
                ktr: joint.ktr.map(EstimatedValue::of),
                pairs: Some(PairsSection {
                    kx: joint.pairs.kx,
                    ky: joint.pairs.ky,
                    kz: joint.pairs.kz,
                    kt: joint.kt.map(|kt| kt.value),
                    kr: joint.kr.map(|kr| kr.value),
                    ktr: joint.ktr.map(|ktr| ktr.value),
                    closure: joint.pairs.closure,
                    condition: Some(joint.pairs.condition),
                }),
                single_modes: joint.single_modes.clone(),
                ..Default::default()
            }
        }
        Estimate::FreeBeam(free) => EstimateSection {
            method: EstimateMethod::FreeBeam,
            modes_used: free.modes_used.clone(),
            modulus: Some(EstimatedValue::of(free.modulus)),
            density: Some(EstimatedValue::of(free.density)),
            free_beam: Some(FreeBeamSection {
                modulus: free.modulus.value,
                density: free.density.value,
            }),
            single_modes: free
                .per_mode
                .iter()
                .map(|&(mode, modulus)| SingleMode {
                    mode,
                    modulus: Some(modulus),
                    ..Default::default()
                })
                .collect(),
            ..Default::default()
        },
    });
    let Some(consistent) = &found.consistent else {
        return closed;
    };
    let closed = closed.unwrap_or_default();
    Some(EstimateSection {
        assumed: Some(found.assumed.clone()).filter(|assumed| !assumed.is_empty()),
        left_out: found.without_mode().map(left_out_row),
        pairs: closed.pairs,
        free_beam: closed.free_beam,
        single_modes: closed.single_modes,
        ..consistent_section(consistent, found.from_readings.as_deref())
    })
}

/// The mode that was left out, with the values of each answer.
fn left_out_row(left_out: &LeftOutMode) -> LeftOutRow {
    let [kt, kr, modulus] = asked_values(&left_out.with_all);
    let answers = left_out.answers.iter();
    let candidates = answers.map(|answer| {
        let [kt, kr, modulus] = asked_values(&answer.estimate);
        CandidateRow {
            mode: answer.mode.mode,
            probability: answer.mode.probability,
            error_percent: answer.mode.percent,
            deviations: answer.mode.deviations,
            kt,
            kr,
            modulus,
        }
    });
    LeftOutRow {
        mode: left_out.found.mode,
        error_percent: left_out.found.percent,
        deviations: left_out.found.deviations,
        kt,
        kr,
        modulus,
        candidates: candidates.collect(),
    }
}

/// Kt, Kr and the modulus, where they were asked for.
fn asked_values(found: &ConsistentEstimate) -> [Option<Uncertain>; 3] {
    [Quantity::Kt, Quantity::Kr, Quantity::Modulus].map(|quantity| {
        let own = value(found, None, quantity);
        let own = own.filter(|_| found.fit.contains(&quantity.lead()));
        own.map(|own| own.uncertain)
    })
}

/// The main estimate; what stands beside it is added by the caller.
fn consistent_section(
    found: &ConsistentEstimate,
    from_readings: Option<&ConsistentEstimate>,
) -> EstimateSection {
    let value = |quantity: Quantity| value(found, from_readings, quantity);
    let goodness = &found.goodness;
    EstimateSection {
        method: EstimateMethod::Consistent,
        modes_used: found.modes_used.clone(),
        set_ups: Some(found.set_ups).filter(|count| *count > 0),
        reason: goodness.uncertainty_factor().map(|factor| {
            format!(
                "the model misses the frequencies by {} % rms; uncertainties that would allow \
                     that are {} times the stated ones",
                significant(100.0 * goodness.relative_misfit, 2),
                times(factor)
            )
        }),
        kx: value(Quantity::Kx),
        ky: value(Quantity::Ky),
        kz: value(Quantity::Kz),
        coupling: value(Quantity::Coupling),
        kt: value(Quantity::Kt),
        kr: value(Quantity::Kr),
        ktr: value(Quantity::Ktr),
        // A property with a tolerance is fitted along without being asked for.
        modulus: value(Quantity::Modulus).filter(|_| is_asked(found, Quantity::Modulus)),
        density: value(Quantity::Density).filter(|_| is_asked(found, Quantity::Density)),
        discrepancy_percent: (found.discrepancy > 0.0).then_some(100.0 * found.discrepancy),
        description: description(found),
        remedies: remedies(found),
        correlations: found.correlations.clone(),
        beam: Some(found.beam),
        log_covariance: found.stiffness_covariance,
        goodness_of_fit: goodness.probability,
        misfit: Some(MisfitSection {
            chi_squared: goodness.chi_squared,
            degrees_of_freedom: goodness.degrees_of_freedom,
            rms_percent: 100.0 * goodness.relative_misfit,
            verdict: goodness.words(),
        }),
        identifiability: Some(identifiability(found)),
        ..EstimateSection::default()
    }
}

/// Returns the value of an estimated quantity. A rigid joint is infinite in the tables and null in JSON; a value at the
/// edge of its range has no standard deviation.
fn value(
    found: &ConsistentEstimate,
    from_readings: Option<&ConsistentEstimate>,
    quantity: Quantity,
) -> Option<EstimatedValue> {
    let estimated = found.quantity(quantity)?;
    let exact = from_readings.and_then(|exact| exact.quantity(quantity));
    // The readings scaled by the misfit, which the headline holds already where it has a discrepancy.
    let scaled = exact.filter(|_| found.goodness.uncertainty_factor().is_some());
    let scaled = scaled.unwrap_or(estimated);
    let rigid = estimated.limit == Some(Limit::Rigid) || estimated.value.is_none();
    let spring = !matches!(quantity, Quantity::Coupling | Quantity::Kz | Quantity::Ktr);
    if estimated.value.is_none() && !spring {
        return None;
    }
    let rigid = rigid && spring;
    let limits = scaled.scaled.filter(|_| !rigid);
    let contributions = found.budget.iter().filter_map(|entry| {
        let mut stds = entry.stds.iter();
        let (_, std) = stds.find(|(of, _)| *of == quantity)?;
        Some(BudgetRow {
            input: entry.input.name().to_owned(),
            std_percent: 100.0 * std,
        })
    });
    let mut budget: Vec<BudgetRow> = contributions.collect();
    budget.sort_by(|a, b| b.std_percent.total_cmp(&a.std_percent));
    Some(EstimatedValue {
        uncertain: Uncertain {
            value: estimated.value.filter(|_| !rigid).unwrap_or(f64::INFINITY),
            std: estimated.std.filter(|_| !rigid),
            low: estimated.low,
            high: estimated.high,
            std_scaled: scaled.std_scaled.filter(|_| !rigid),
            low_scaled: limits.map(|limits| limits.0),
            high_scaled: limits.map(|limits| limits.1),
            at_least: estimated.at_least,
            at_most: estimated.at_most,
        },
        from_readings: exact.map(|exact| {
            let is_rigid = spring && exact.limit == Some(Limit::Rigid);
            FromReadings {
                value: exact.value.filter(|_| !is_rigid),
                std: exact.std.filter(|_| !is_rigid),
                low: exact.low,
                high: exact.high,
            }
        }),
        budget,
        further_set_up: estimated.further.map(|(low, high)| [low, high]),
    })
}

fn description(found: &ConsistentEstimate) -> Vec<DescriptionRow> {
    let pulls = found.description.iter();
    let rows = pulls.map(|pull| DescriptionRow {
        input: pull.input.name().to_owned(),
        stated: pull.stated,
        fitted: pull.fitted,
        pull: pull.pull,
    });
    rows.collect()
}

fn remedies(found: &ConsistentEstimate) -> Vec<RemedyRow> {
    let remedies = found.remedies.iter();
    let rows = remedies.map(|remedy| {
        let percent = |quantity: Quantity| {
            let mut stds = remedy.stds.iter();
            let found = stds.find(|(of, _)| *of == quantity);
            found.map(|(_, std)| 100.0 * std)
        };
        RemedyRow {
            measure: remedy.measure,
            kt_percent: percent(Quantity::Kt),
            kr_percent: percent(Quantity::Kr),
            modulus_percent: percent(Quantity::Modulus),
        }
    });
    rows.collect()
}

fn is_asked(found: &ConsistentEstimate, quantity: Quantity) -> bool {
    let mut parameters = found.fit.iter();
    parameters.any(|parameter| parameter.name() == quantity.name())
}

fn identifiability(found: &ConsistentEstimate) -> IdentifiabilitySection {
    let report = &found.identifiability;
    let dead = report
        .dead
        .iter()
        .map(|parameter| format!("{} is felt by none of these frequencies", parameter.name()));
    let limits = report.at_limit.iter().map(|(parameter, limit)| {
        let end = match limit {
            Limit::Rigid => "rigid",
            Limit::Absent => "absent",
            Limit::FullCoupling => "as large as any joint can have it",
        };
        format!("{} is at the end of its range: {end}", parameter.name())
    });
    // The uncertain properties of the beam that were fitted along.
    let beam = [
        (Quantity::Modulus, "Pa"),
        (Quantity::Density, "kg/m3"),
        (Quantity::Length, "m"),
        (Quantity::Width, "m"),
        (Quantity::Thickness, "m"),
    ];
    let along = beam
        .iter()
        .filter(|(quantity, _)| !is_asked(found, *quantity));
    let along = along.filter_map(|(quantity, unit)| {
        let value = found.quantity(*quantity)?.value?;
        Some(format!(
            "{} has a tolerance and was fitted along, to {value:.6e} {unit}",
            quantity.name()
        ))
    });
    let flat = report.flat.iter().map(|flat| flat.words.clone());
    IdentifiabilitySection {
        singular_values: report.singular_values.clone(),
        condition: report.condition,
        statements: flat.chain(dead).chain(limits).chain(along).collect(),
    }
}
