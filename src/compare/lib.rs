//! What changed between two tests of one structure: whether anything did beyond what repeating a test changes, where, what,
//! and how much.
//!
//! ```text
//! Test, Pair -> test        what is compared, and what cannot be
//!               matching    one numbering of the modes for all tests
//!               level       one level of the taps for all tests, and changes of how frequencies depend on it
//!               cause       what may have changed, and how much
//!               model       the structure with its joint: what a cause changes
//!               likelihood  how probable the measured changes are
//!               search      evidence of causes with one size (joint: several sizes; unknown: none)
//!               limits      the smallest change of the joint that would be seen
//!               verdict     probabilities and the answer
//!               value_change  changes of another value of each mode, and their scatter
//!               dissipation  changes of the dampings
//!               result      the answer in numbers
//! Test, ..   -> series      control charts of many tests, and the first that differs from those before
//!               change_point  how much the last tests differ from those before, and may by chance
//! ```
//!
//! A model misses many small things of a real structure. Both tests share them, so that they cancel in the ratio of two
//! frequencies; what is left is what changed between the tests. This crate sees no recording.

mod cause;
mod change_point;
mod dissipation;
#[cfg(test)]
mod fixture;
mod joint;
mod level;
mod likelihood;
mod limits;
mod matching;
mod model;
mod result;
mod search;
mod series;
mod test;
#[cfg(test)]
mod tests;
mod unknown;
mod value_change;
mod verdict;

pub use cause::CauseKind;
pub use result::{
    CauseResult, ChangeVerdict, Comparison, DampingResult, DampingVerdict, Interval, JointResult,
    LevelResult, MatchedMode, ModeChange, ModeDamping, ModeLevel, RepeatabilityOrigin,
    RepeatabilityResult, StiffnessChange, VerdictKind,
};
pub use series::{
    ChartPoint, ChartedQuantity, ControlChart, Departure, LEAST_SERIES, LeftOutMode, MOST_SERIES,
    Series, WatchedSeries, watch,
};
pub use test::{
    CompareError, Item, ItemKind, Level, LevelPoint, MOST_PAIRS, MOST_REPEATS, MeasuredMode,
    MovedStd, Pair, REPEATABILITY_LIMITS, Reading, Settings, Test,
};

use cause::Cause;
use joint::JointChange;
use level::Moved;
use likelihood::Data;
use model::{PairModel, Predicted};
use verdict::Candidate;

/// Says what changed between the tests of pairs that share one change.
///
/// # Errors
/// [`CompareError`]: no test, too few modes in common, a structure without modes.
pub fn compare(pairs: &[Pair], settings: &Settings) -> Result<Comparison, CompareError> {
    let mut pairs = pairs.to_vec();
    let (mut matched, mut moved) = (Vec::new(), Vec::new());
    for (index, pair) in pairs.iter_mut().enumerate() {
        matched.extend(matching::match_modes(pair, index));
    }
    let modes = test::common_modes(&pairs, settings)?;
    let level = level::levels(&pairs, &modes);
    for pair in &mut pairs {
        moved.push(level::take_one_level(pair));
    }
    let mut models = Vec::with_capacity(pairs.len());
    for (pair, modes) in pairs.iter().zip(&modes) {
        models.push(PairModel::new(pair, modes)?);
    }
    let data = Data::new(&models, settings);
    let nothing: Vec<Predicted> = models.iter().map(Predicted::nothing).collect();
    let no_change_goodness = data.goodness(&nothing, 0);
    let log_nothing = data.log_density(&nothing);
    let log_unknown = unknown::log_evidence(&data);
    let mut candidates = vec![
        Candidate::without_size(CauseKind::NoChange, log_nothing, Some(no_change_goodness)),
        Candidate::without_size(CauseKind::Unknown, log_unknown, None),
    ];
    let first = &pairs[0].before[0];
    // An item that a pair lacks did not change in all of them.
    let items = first.items.iter().filter(|item| {
        let mut tests = pairs
            .iter()
            .flat_map(|pair| pair.before.iter().chain(&pair.after));
        tests.all(|test| test.items.iter().any(|other| other.name == item.name))
    });
    let items: Vec<Item> = items.cloned().collect();
    for cause in Cause::all(models[0].structure(), &items) {
        if let Some(found) = search::posterior(&data, &cause) {
            candidates.push(Candidate::of_one_size(&data, &cause, &found));
        }
    }
    let joint = JointChange::new(&models);
    if let Some(joint) = &joint
        && let Some(found) = joint.posterior(&data)
    {
        candidates.push(Candidate::of_joint(&data, joint, &found));
    }
    let probabilities = verdict::probabilities(&candidates);
    let order = verdict::order(&probabilities);
    let hypotheses: Vec<CauseResult> = order
        .iter()
        .map(|&index| candidates[index].result(probabilities[index]))
        .collect();
    let verdict = verdict::verdict(&candidates, &probabilities);
    Ok(Comparison {
        modes: mode_changes(&data, settings, &moved),
        matched,
        joint: joint.map(|joint| joint_result(&models, settings, &joint, &hypotheses, &verdict)),
        verdict,
        damping: dissipation::dampings(&pairs, &models),
        level,
        repeatability: RepeatabilityResult {
            percent: 100.0 * data.mean_scatter(),
            origin: match settings.repeatability {
                Some(_) => RepeatabilityOrigin::Stated,
                None if models.iter().any(|pair| pair.repeat_freedom > 0.0) => {
                    RepeatabilityOrigin::Repeats
                }
                None => RepeatabilityOrigin::Assumed,
            },
        },
        no_change_goodness,
        hypotheses,
    })
}

fn mode_changes(data: &Data<'_>, settings: &Settings, moved: &[Vec<Moved>]) -> Vec<ModeChange> {
    let mut all = Vec::new();
    for (index, pair) in data.pairs.iter().enumerate() {
        let is_stated = settings.repeatability.is_some();
        let errors = likelihood::errors(pair, data.mean_scatter(), is_stated);
        // What the descriptions tell is uncertain, too.
        let covariance = likelihood::covariance(pair, &errors, &Predicted::nothing(pair));
        for (k, &mode) in pair.modes.iter().enumerate() {
            let [before, after] = pair.frequencies[k];
            let std = covariance[(k, k)].sqrt();
            let level = moved[index].iter().find(|one| one.mode == mode);
            all.push(ModeChange {
                pair: index,
                mode,
                before,
                after,
                change_percent: 100.0 * (after / before - 1.0),
                described_percent: 100.0 * pair.described[k].exp_m1(),
                level_percent: level.map_or(0.0, |one| 100.0 * (-one.change).exp_m1()),
                std_percent: 100.0 * std,
                z: pair.measured[k] / std,
            });
        }
    }
    all
}

/// Returns the joint before and after, if only the joint changed.
fn joint_result(
    pairs: &[PairModel],
    settings: &Settings,
    change: &JointChange,
    hypotheses: &[CauseResult],
    verdict: &ChangeVerdict,
) -> JointResult {
    let found = hypotheses
        .iter()
        .find(|one| one.effect == CauseKind::JointChange);
    let joints = pairs[0].joints();
    let mut both = [None, None];
    for (direction, name) in ["kt", "kr"].into_iter().enumerate() {
        let size = found.and_then(|found| found.parameters.get(name));
        let (Some(size), Some(joints)) = (size, joints) else {
            continue;
        };
        let [before, after] = joints.map(|joint| [joint.kt, joint.kr][direction]);
        // It takes time, and only `no change` needs it.
        let seen = match verdict.kind {
            VerdictKind::NoChange => limits::seen_from(pairs, settings, change, direction),
            _ => [None; 2],
        };
        both[direction] = Some(StiffnessChange {
            before,
            is_stated: pairs[0].is_stated(direction),
            before_std_percent: 100.0 * pairs[0].joint_stds()[direction],
            after: after * (1.0 + size.value),
            change_percent: 100.0 * size.value,
            low: 100.0 * size.low,
            high: 100.0 * size.high,
            seen_from_percent: seen.map(|one| one.map(|one| 100.0 * one)),
        });
    }
    let [kt, kr] = both;
    JointResult { kt, kr }
}
