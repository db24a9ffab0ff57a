//! The parts of the document that say something about the joint.

use super::convert_consistent::consistent_section;
use super::document::{
    AverageSection, EstimateSection, FreeBeamSection, MonteCarloSection, PairsSection,
    PerturbationSection, PredictionSection, ResolutionSpanSection, SensitivitySection,
    SingleModeSection, ValueSection,
};
use crate::identify::perturbation::{AverageError, Span, UniformPerturbation};
use crate::identify::{
    FreeBeamEstimate, JointEstimate, MonteCarlo, PredictedMode, Spread, Uncertain,
};
use crate::pipeline::{BoundPerturbation, Estimate, Identification};

pub(super) fn estimate_section(found: &Identification) -> Option<EstimateSection> {
    let closed = found.estimate.as_ref().map(|estimate| match estimate {
        Estimate::Joint(joint) => joint_section(joint),
        Estimate::FreeBeam(free) => free_section(free),
    });
    let Some(consistent) = &found.consistent else {
        return closed;
    };
    let closed = closed.unwrap_or_default();
    Some(EstimateSection {
        pairs: closed.pairs,
        free_beam: closed.free_beam,
        single_modes: closed.single_modes,
        ..consistent_section(consistent)
    })
}

fn joint_section(joint: &JointEstimate) -> EstimateSection {
    let doubts: Vec<String> = joint.doubts.iter().map(ToString::to_string).collect();
    EstimateSection {
        method: "pairs".to_string(),
        modes_used: joint.modes_used.clone(),
        reason: (!doubts.is_empty()).then(|| doubts.join("; ")),
        kx: value(joint.kx),
        ky: value(joint.ky),
        kz: value(joint.kz),
        coupling: value(joint.coupling),
        kt: value(joint.kt),
        kr: value(joint.kr),
        ktr: value(joint.ktr),
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
        single_modes: joint
            .single_modes
            .iter()
            .map(|single| SingleModeSection {
                mode: single.mode,
                kx: single.kx,
                ky: single.ky,
                modulus: None,
            })
            .collect(),
        ..Default::default()
    }
}

fn free_section(free: &FreeBeamEstimate) -> EstimateSection {
    EstimateSection {
        method: "free-beam".to_string(),
        modes_used: free.modes_used.clone(),
        modulus: value(Some(free.modulus)),
        density: value(Some(free.density)),
        free_beam: Some(FreeBeamSection {
            modulus: free.modulus.value,
            density: free.density.value,
        }),
        single_modes: free
            .per_mode
            .iter()
            .map(|&(mode, modulus)| SingleModeSection {
                mode,
                modulus: Some(modulus),
                ..Default::default()
            })
            .collect(),
        ..Default::default()
    }
}

fn value(found: Option<Uncertain>) -> Option<ValueSection> {
    found.map(|found| ValueSection {
        value: found.value,
        std: found.std,
        low: found.low,
        high: found.high,
        ..ValueSection::default()
    })
}

pub(super) fn prediction_section(mode: &PredictedMode) -> PredictionSection {
    PredictionSection {
        mode: mode.mode,
        measured: mode.measured,
        predicted: Some(mode.predicted),
        lambda: Some(mode.lambda),
        error_percent: mode.error_percent,
        used: mode.used,
    }
}

pub(super) fn perturbation_section(row: &UniformPerturbation) -> PerturbationSection {
    PerturbationSection {
        percent: row.percent,
        method: "pairs".to_string(),
        kx: row.estimate.map(|estimate| estimate.kx),
        ky: row.estimate.map(|estimate| estimate.ky),
        kz: row.estimate.and_then(|estimate| estimate.kz),
    }
}

pub(super) fn average_section(row: &AverageError) -> AverageSection {
    AverageSection {
        percent: row.percent,
        kx_percent: row.mean_magnitude.kx,
        ky_percent: row.mean_magnitude.ky,
        kz_percent: row.mean_magnitude.kz,
        kx_of_mean_percent: row.of_mean.kx,
        ky_of_mean_percent: row.of_mean.ky,
        kz_of_mean_percent: row.of_mean.kz,
    }
}

pub(super) fn monte_carlo_section(found: &MonteCarlo) -> MonteCarloSection {
    let ends = |spread: Option<Spread>| {
        spread.map(|spread| ValueSection {
            value: spread.median,
            std: None,
            low: Some(spread.low),
            high: Some(spread.high),
            ..ValueSection::default()
        })
    };
    MonteCarloSection {
        samples: found.samples,
        failed: found.failed,
        kx: ends(found.kx),
        ky: ends(found.ky),
        kz: ends(found.kz),
    }
}

pub(super) fn span_section(found: &BoundPerturbation) -> ResolutionSpanSection {
    let ends = |span: Option<Span>| span.map(|span| [span.low, span.high]);
    let spans = found.spans.as_ref();
    ResolutionSpanSection {
        patterns: spans.map_or(0, |spans| spans.patterns),
        failed: spans.map_or(0, |spans| spans.failed),
        kx: ends(spans.and_then(|spans| spans.kx)),
        ky: ends(spans.and_then(|spans| spans.ky)),
        kz: ends(spans.and_then(|spans| spans.kz)),
        cloud: found
            .cloud
            .iter()
            .map(|estimate| [estimate.kx, estimate.ky])
            .collect(),
        sensitivity: found
            .sensitivities
            .iter()
            .map(|row| {
                let change = row.percent_per_bound;
                let slope = row.percent_per_percent;
                SensitivitySection {
                    mode: found.modes.get(row.index).copied().unwrap_or(0),
                    half_line: found.bounds.get(row.index).copied().unwrap_or(0.0),
                    kx_percent: change.map(|change| change.kx),
                    ky_percent: change.map(|change| change.ky),
                    kz_percent: change.and_then(|change| change.kz),
                    kx_percent_per_percent: slope.map(|slope| slope.kx),
                    ky_percent_per_percent: slope.map(|slope| slope.ky),
                    kz_percent_per_percent: slope.and_then(|slope| slope.kz),
                }
            })
            .collect(),
    }
}
