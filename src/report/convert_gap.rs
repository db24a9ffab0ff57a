//! From a diagnosis to its part of the document.

use super::document::{
    AlongDecaysSection, BaselineSection, ClosureSection, DecayChangeSection, GapPlaceSection,
    GapSection, GapVerdictSection, HypothesisSection, JointShiftSection, LeftOutRecordingSection,
    LeftOutSection, NextTestSection, ParameterSection, PlaceMapSection, PullSection,
    UnplacedSection,
};
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::{
    Closure, AmplitudeDependence, DecidedBy, Diagnosis, GapError, Hypothesis, HypothesisResult,
    JointShift, CrossValidation, NextTest, LocationMap, LocationProbabilities, Residual, UnlocatedSensors, Verdict,
};

/// The section of a diagnosis, or of the reason why there is none.
pub fn gap_section(diagnosis: Result<&Diagnosis, &GapError>) -> GapSection {
    let found = match diagnosis {
        Ok(found) => found,
        Err(error) => {
            return GapSection {
                verdict: GapVerdictSection {
                    kind: "not-enough-data".to_owned(),
                    effects: Vec::new(),
                    reason: Some(error.to_string()),
                },
                ..GapSection::default()
            };
        }
    };
    GapSection {
        verdict: verdict(&found.verdict),
        place: Some(GapPlaceSection {
            probability: places(&found.locations),
            modes: found.residuals.iter().map(pull).collect(),
            worst_block: found.blocks.first().map(|block| block.name.clone()),
        }),
        hypotheses: found.hypotheses.iter().map(hypothesis).collect(),
        noise_floor: Some(found.noise_floor),
        goodness_of_fit: found.goodness_of_fit,
        joint_shift: Some(shift(&found.joint_shift)),
        fitted_modes: Some(found.fitted_modes),
        unplaced: found.unlocated.as_ref().map(unplaced),
        decided_by: Some(
            match found.decided_by {
                DecidedBy::Data => "readings",
                DecidedBy::Priors => "priors",
            }
            .to_owned(),
        ),
        along_decays: found.amplitude_dependence.as_ref().map(along_decays),
        map: found.location_map.as_ref().map(map),
        baselines: baselines(&found.hypotheses),
        next_test: found.next_tests.iter().map(next_test).collect(),
        updated_model: None,
    }
}

fn unplaced(found: &UnlocatedSensors) -> UnplacedSection {
    UnplacedSection {
        sensors: found.sensors.clone(),
        mass: found.mass,
        gap: found.gap,
        goodness_of_fit: found.goodness_of_fit,
    }
}

fn along_decays(found: &AmplitudeDependence) -> AlongDecaysSection {
    AlongDecaysSection {
        effect: found
            .is_of_joint()
            .then(|| EffectId::JointNonlinearity.name().to_owned()),
        enough: found.is_enough(),
        lawful: found.is_lawful(),
        ratio: found.ratio,
        ratio_std: found.ratio_std,
        at_bound: found.is_at_bound(),
        exponent: found.exponent,
        chance: found.chance,
        goodness_of_fit: found.goodness_of_fit,
        changes: found
            .changes
            .iter()
            .map(|change| DecayChangeSection {
                mode: change.mode,
                recording: change.recording.clone(),
                level: change.level,
                percent_per_fold: change.percent_per_fold,
                std: change.std,
                explained: change.explained,
            })
            .collect(),
    }
}

fn verdict(found: &Verdict) -> GapVerdictSection {
    let names = |effects: &[EffectId]| effects.iter().map(|id| id.name().to_owned()).collect();
    let effects = match found {
        Verdict::Named(effects) | Verdict::Group(effects) => names(effects),
        Verdict::Set(list) => list.iter().map(Hypothesis::name).collect(),
        Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData(_) => Vec::new(),
    };
    GapVerdictSection {
        kind: found.kind().to_owned(),
        effects,
        reason: match found {
            Verdict::NotEnoughData(reason) => Some(reason.clone()),
            _ => None,
        },
    }
}

fn places(p: &LocationProbabilities) -> std::collections::BTreeMap<String, f64> {
    [
        ("joint", p.joint),
        ("fixture", p.fixture),
        ("sensor", p.sensor),
        ("body", p.body),
        ("acquisition", p.acquisition),
        ("unknown", p.unknown),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into()
}

fn pull(pull: &Residual) -> PullSection {
    PullSection {
        mode: pull.mode,
        recording: pull.recording.clone(),
        level: pull.level,
        error_percent: pull.error_percent,
        z: pull.z,
        error_percent_after: pull.error_percent_after,
        z_after: pull.z_after,
    }
}

fn shift(shift: &JointShift) -> JointShiftSection {
    JointShiftSection {
        kx_percent: shift.kx_percent,
        ky_percent: shift.ky_percent,
    }
}

fn hypothesis(found: &HypothesisResult) -> HypothesisSection {
    let groups: Vec<&str> = found.groups.iter().map(|group| group.name()).collect();
    let alone = found.effects.len() < 2;
    let parameters = found.parameters.iter().map(|parameter| {
        let name = if alone {
            parameter.name.to_owned()
        } else {
            format!("{}.{}", parameter.effect.name(), parameter.name)
        };
        let section = ParameterSection {
            value: parameter.value,
            std: parameter.std,
            smallest_detectable: parameter.smallest_detectable,
            smallest_isolable: parameter.smallest_separable,
        };
        (name, section)
    });
    HypothesisSection {
        effect: found.hypothesis.name(),
        group: (!groups.is_empty()).then(|| groups.join("+")),
        probability: found.probability,
        log_bayes_factor: found.log_bayes_factor,
        confounded_with: found
            .confounded_with
            .iter()
            .map(|id| id.name().to_owned())
            .collect(),
        parameters: parameters.collect(),
        gap_before: Some(found.gap_before),
        gap_after: found.gap_after,
        left_out_after: found.left_out_modes,
        withheld_before: found.holdout_before,
        withheld_after: found.holdout_after,
        withheld_floor: found.holdout_floor,
        closure: found.closure.as_ref().map(closure),
        left_out_recordings: found.cross_validation.as_ref().map(left_out),
        goodness_of_fit: found.goodness_of_fit,
        joint_shift: shift(&found.joint_shift),
        joint: found.joint,
        joint_intervals: found.joint_intervals,
    }
}

fn closure(closure: &Closure) -> ClosureSection {
    ClosureSection {
        value: closure.value,
        low: closure.low,
        high: closure.high,
    }
}

fn left_out(found: &CrossValidation) -> LeftOutSection {
    let recordings = found.recordings.iter();
    LeftOutSection {
        before: found.before,
        after: found.after,
        floor: found.floor,
        closure: found.closure.as_ref().map(closure),
        recordings: recordings
            .map(|one| LeftOutRecordingSection {
                recording: one.recording.clone(),
                before: one.before,
                after: one.after,
                floor: one.floor,
            })
            .collect(),
    }
}

fn map(map: &LocationMap) -> PlaceMapSection {
    let share = |fall: &f64| match map.misfit > 0.0 {
        true => fall / map.misfit,
        false => 0.0,
    };
    let shares = |falls: &[f64]| falls.iter().map(share).collect();
    PlaceMapSection {
        positions: map.positions.clone(),
        stiffness: map.stiffness.clone(),
        stiffness_std: map.stiffness_std.clone(),
        mass: map.mass.clone(),
        mass_std: map.mass_std.clone(),
        stiffness_explains: shares(&map.stiffness_alone),
        mass_explains: shares(&map.mass_alone),
        resolution: map.resolution,
    }
}

fn next_test(test: &NextTest) -> NextTestSection {
    NextTestSection {
        id: test.proposal.id().to_owned(),
        action: test.action.clone(),
        separates: test.separates.clone(),
        unpredicted: test.unpredicted.clone(),
        bits: test.expected_information,
        effort: test.proposal.effort(),
    }
}

/// Nothing added, and one common factor: what any diagnosis has to beat.
fn baselines(hypotheses: &[HypothesisResult]) -> Vec<BaselineSection> {
    let of = |name: &str, wanted: &Hypothesis| {
        let found = hypotheses
            .iter()
            .find(|found| found.hypothesis == *wanted)?;
        Some(BaselineSection {
            name: name.to_owned(),
            gap_after: found.gap_after,
            withheld_after: found.holdout_after,
        })
    };
    [
        of("none", &Hypothesis::None),
        of("scale", &Hypothesis::Effects(vec![EffectId::Modulus])),
    ]
    .into_iter()
    .flatten()
    .collect()
}
