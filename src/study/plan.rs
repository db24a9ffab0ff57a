//! The effects that a planned test could tell apart: effects are drawn, the plan observes them, and the diagnosis
//! that will judge the real test judges these.
//!
//! Observations are drawn, not recordings: the plan states how well frequencies, shapes, damping and
//! changes along the decay will be known.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::blind_check::{Answer, Case, GROUPS, Planted, Truth, draw_effect};
use std::sync::atomic::{AtomicUsize, Ordering};
use tapjoint_analysis::nominal_with;
use tapjoint_beam::effects::{EffectError, EffectId, Group};
use tapjoint_beam::{Beam, JointStiffness};
use tapjoint_description::{Assembly, TestDescription};
use tapjoint_diagnosis::{
    DETECTABLE, GapError, GapSettings, Nominal, PlannedConfiguration, TestPlan, diagnose,
    nominal_chi_square, observe,
};

/// Settings for the judgement of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanSettings {
    /// Tests drawn for each effect group and for none. 4.
    pub draws: usize,
    /// Modes that will be observed. 6.
    pub modes: usize,
    /// Relative standard uncertainty of a frequency (1). 0.03 %, five taps with fits.
    pub frequency_std: f64,
    /// Taps of each recording. 5.
    pub taps: usize,
    /// Standard deviation of the joint's stiffnesses between recordings (1). 0.5 %.
    pub drift: f64,
    /// A joint that the description does not state.
    pub joint: Option<JointStiffness>,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self {
            draws: 4,
            modes: 6,
            frequency_std: 3e-4,
            taps: 5,
            drift: 0.005,
            joint: None,
            seed: 0,
        }
    }
}

/// Reasons for which a plan cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The description names no recordings.
    #[error(
        "the description plans no recordings; give a [[recording]] with `file` and `tap` for each"
    )]
    NoRecordings,
    /// A recording without a tap position.
    #[error("recording \"{file}\" has no tap position; give `tap` (m)")]
    NoTap {
        /// Its file.
        file: String,
    },
    /// A sensor without a position.
    #[error("sensor \"{name}\" has no position; give `position` (m)")]
    NoPosition {
        /// Its name.
        name: String,
    },
    /// An effect out of its range.
    #[error("an effect of usual size is out of range on this beam: {0}")]
    Effect(#[from] EffectError),
    /// The plan sees nothing that could be diagnosed.
    #[error(transparent)]
    Gap(#[from] GapError),
}

/// Draws, observes and diagnoses tests. `progress` is called with the number of tests done and of all.
///
/// # Errors
/// [`PlanError`] where the description lacks something or an effect is out of range.
pub fn judge_plan(
    test: &TestDescription,
    settings: &PlanSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Case>, PlanError> {
    let nominal = nominal_with(test, settings.joint);
    let plan = plan_of(test, settings)?;
    // A lap joint has no coupling and no fixture, a beam by itself no joint. Nothing pulls on either: both are free, and
    // a force that pushed them would buckle them.
    let cannot: &[EffectId] = match test.joint.kind {
        Assembly::Cantilever => &[],
        Assembly::Lap => &[
            EffectId::CrossCoupling,
            EffectId::Fixture,
            EffectId::AxialLoad,
        ],
        Assembly::Free => &[
            EffectId::CrossCoupling,
            EffectId::Fixture,
            EffectId::JointMass,
            EffectId::JointNonlinearity,
            EffectId::JointDamping,
            EffectId::AxialLoad,
        ],
    };
    let mut groups = GROUPS.to_vec();
    groups.retain(|group| !cannot.contains(&group[0]));
    // Errors of the set-up show in the shapes alone, which need hammer and sensor.
    if test.hammer.is_none() || test.sensors.is_empty() {
        groups.retain(|group| group[0].group() != Group::SetUp);
    }
    let total = (groups.len() + 1) * settings.draws;
    let done = AtomicUsize::new(0);
    (0..total)
        .into_par_iter()
        .map(|number| {
            // No effect after the last group.
            let group = groups.get(number / settings.draws).copied();
            let case = case(&plan, &nominal, number, group, settings)?;
            progress(1 + done.fetch_add(1, Ordering::Relaxed), total);
            Ok(case)
        })
        .collect()
}

/// The recordings of the description as the diagnosis will see them.
pub(super) fn plan_of(
    test: &TestDescription,
    settings: &PlanSettings,
) -> Result<TestPlan, PlanError> {
    if test.recordings.is_empty() {
        return Err(PlanError::NoRecordings);
    }
    let levels = test
        .recordings
        .iter()
        .map(|recording| recording.level.unwrap_or(1.0));
    let hardest = levels.fold(0.0, f64::max);
    // The diagnosis takes the recordings of the beam's own length.
    let recordings = test.recordings.iter().filter(|one| one.length.is_none());
    let configurations = recordings.map(|recording| {
        let sensors = test.sensors.iter().map(|sensor| {
            let place = recording
                .place_of(sensor)
                .ok_or_else(|| PlanError::NoPosition {
                    name: sensor.name.clone(),
                })?;
            Ok((sensor.name.clone(), place))
        });
        Ok(PlannedConfiguration {
            sensors: sensors.collect::<Result<_, PlanError>>()?,
            tap: recording.tap.ok_or_else(|| PlanError::NoTap {
                file: recording.name(),
            })?,
            masses: recording.masses.clone(),
            level: recording.level.unwrap_or(1.0) / hardest,
        })
    });
    Ok(TestPlan {
        configurations: configurations.collect::<Result<_, PlanError>>()?,
        modes: settings.modes,
        taps: settings.taps,
        frequency_std: settings.frequency_std,
        // Fits of calibrated sensors reach 3 % of the largest constant, and 3 % of the damping.
        shape_std: test.hammer.is_some().then_some(0.03),
        damping_std: Some(0.03),
        // A decay is followed over two e-folds with the accuracy of the frequency itself.
        slope_std: Some(0.5 * settings.frequency_std),
        drift: settings.drift,
        damping: 0.003,
        scatter: 1.0,
    })
}

/// Draws test `number` with one effect of the group, and diagnoses it.
fn case(
    plan: &TestPlan,
    nominal: &Nominal,
    number: usize,
    group: Option<&[EffectId]>,
    settings: &PlanSettings,
) -> Result<Case, PlanError> {
    let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
    random.set_stream(number as u64 + 1);
    let mut effects = Vec::new();
    if let Some(group) = group {
        // Sizes refer to the whole: of a lap joint the first beam, as long as both.
        let body = &nominal.specimen.body;
        let beam = Beam {
            length: body.length(),
            ..body.beams()[0]
        };
        let set_ups = plan.set_ups(beam.length);
        effects.push(draw_effect(&beam, &set_ups, group, &mut random)?);
    }
    let observed = observe(plan, nominal, &effects, random.random())?;
    let exact = TestPlan {
        scatter: 0.0,
        drift: 0.0,
        ..plan.clone()
    };
    let exact = observe(&exact, nominal, &effects, 0)?;
    let chi_square = nominal_chi_square(&exact, nominal, &GapSettings::default())?;
    let truth = Truth {
        name: format!("draw-{number:03}"),
        effects: effects.iter().map(Planted::of).collect(),
        detectable: (!effects.is_empty()).then_some(chi_square > DETECTABLE),
        refutable: None,
        within_tolerance: None,
    };
    let diagnosis = diagnose(&observed, nominal, &GapSettings::default());
    let answer = diagnosis.map_or_else(|_| Answer::default(), |found| Answer::of(&found));
    Ok((truth, answer))
}
