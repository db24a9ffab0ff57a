//! The parts of the document that say something about the joint.

use super::convert_consistent::consistent_section;
use super::document::{
    EstimateSection, FreeBeamSection, PairsSection, PredictionSection, SingleModeSection,
    ValueSection,
};
use tapjoint_analysis::{Estimate, Identification};
use tapjoint_identify::{FreeBeamEstimate, JointEstimate, PredictedMode, Uncertain};

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
