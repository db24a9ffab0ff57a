//! The ideal observer: the same fits, by one who knows from which distributions the study draws.
//!
//! Sizes of effects have a log-normal distribution, with median and spread of the study's own draws for this structure and
//! test. Nothing, one effect and faults outside the catalogue are as probable as the study makes them. Everything else is
//! that of the diagnosis: the share of pairs, and the sizes of faults outside. What this observer finds and the diagnosis
//! does not is the price of wide priors.

use super::outside::OutsideKind;
use super::plans::PlannedTest;
use super::plants::{Class, GROUPS, draw_effect, size_of};
use super::structures::{Structure, Support};
use rand_chacha::ChaCha8Rng;
use tapjoint::effects::EffectId;
use tapjoint::gap::{GapSettings, LogNormal};

/// Draws from which median and spread of a size are taken: the spread is then known to 4 %.
const DRAWS: usize = 300;

/// Returns the settings of the ideal observer for a test, beside those of the diagnosis.
pub fn settings(
    random: &mut ChaCha8Rng,
    structure: &Structure,
    test: &PlannedTest,
    diagnosis: &GapSettings,
) -> GapSettings {
    let mut settings = diagnosis.clone();
    let thresholds = &mut settings.thresholds;
    thresholds.no_gap_prior = Class::Nothing.multiple() as f64;
    thresholds.unknown_prior = OutsideKind::ALL.len() as f64;
    // The study draws this effect as often as any other group, but only on rigid joints, which few other tests have.
    thresholds.rigid_prior = Support::RigidCantilever.share().recip();
    for id in GROUPS.iter().flat_map(|members| members.iter()) {
        if let Some(sizes) = sizes_of(random, *id, structure, test) {
            settings.known_sizes.push((*id, sizes));
        }
    }
    settings
}

/// Returns median and spread of the sizes of an effect. `None` where it has no size or cannot be drawn.
fn sizes_of(
    random: &mut ChaCha8Rng,
    id: EffectId,
    structure: &Structure,
    test: &PlannedTest,
) -> Option<LogNormal> {
    // These have no size.
    if matches!(id, EffectId::SensorPolarity | EffectId::SensorSwap) {
        return None;
    }
    let drawn = (0..DRAWS).filter_map(|_| draw_effect(random, id, structure, test));
    let logs: Vec<f64> = drawn
        .map(|effect| size_of(&effect))
        .filter(|size| *size > 0.0)
        .map(f64::ln)
        .collect();
    if logs.len() < DRAWS / 4 {
        return None;
    }
    let count = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / count;
    Some(LogNormal {
        median: mean.exp(),
        spread: variance.sqrt().max(0.05),
    })
}
