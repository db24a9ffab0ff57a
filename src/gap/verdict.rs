//! From probabilities to an answer, or to none.

use super::posterior::{APART, Entry, by_group, lead};
use super::result::{Block, Closure, Hypothesis, Verdict};
use crate::effects::EffectId;

/// Probability from which a name is given.
const NAMED: f64 = 0.8;
/// Goodness of fit below which an explanation is refused.
const MISFIT: f64 = 0.01;
/// The same for the worst of many blocks.
const BLOCK_MISFIT: f64 = 0.001;
/// Probability of an error of withheld readings from which the hypothesis counts as predicting them.
const PREDICTED: f64 = 0.05;
/// Probability that a set has to hold, and the longest one that is still short.
const SET: (f64, usize) = (0.9, 4);

/// Logarithm of the Bayes factor against the nominal model from which an effect counts as seen: 20 to 1
/// (Kass & Raftery 1995, "strong").
const SEEN: f64 = 3.0;

/// What the checks on a hypothesis said.
pub(super) struct Checks<'a> {
    /// Goodness of fit of the best hypothesis with a name or none.
    pub(super) goodness: Option<f64>,
    /// The same of its blocks, the worst first.
    pub(super) blocks: &'a [Block],
    /// Goodness of its prediction of withheld readings; `None` without any.
    pub(super) withheld: Option<f64>,
    /// Readings that its parameters have to answer for, and how many these are.
    pub(super) room: Room,
    /// Its closure on withheld readings; `None` where that says nothing.
    pub(super) closure: Option<Closure>,
}

/// What a hypothesis is tested with.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Room {
    /// Frequencies of different modes and sensor places, and what else the effects act on.
    pub(super) readings: usize,
    /// Parameters of joint and effects.
    pub(super) parameters: usize,
}

/// Readings beyond the parameters from which a name is given: with fewer nearly every effect of as many
/// parameters explains them.
const SPARE: usize = 2;

impl Room {
    fn is_crowded(self) -> bool {
        self.readings < self.parameters + SPARE
    }
}

impl Checks<'_> {
    /// Whether the readings refute the hypothesis.
    pub(super) fn refuted(&self) -> bool {
        self.refuting().is_some()
    }

    /// The probability of the misfit that refutes the hypothesis, the smallest where several do; of one
    /// block among many that of any.
    pub(super) fn refuting(&self) -> Option<f64> {
        let block = self.blocks.first().map(|block| block.goodness_of_fit);
        let overall = self.goodness.filter(|p| *p < MISFIT);
        let withheld = self.withheld.filter(|p| *p < BLOCK_MISFIT);
        let block = block
            .filter(|p| *p < BLOCK_MISFIT)
            .map(|p| (p * self.blocks.len() as f64).min(MISFIT));
        let all = [overall, withheld, block].into_iter().flatten();
        all.min_by(f64::total_cmp)
    }

    /// Whether withheld readings speak for the hypothesis: it closes some of the gap for certain, or predicts
    /// them within what it leaves open.
    fn holds(&self) -> bool {
        let predicts = self.withheld.is_some_and(|p| p > PREDICTED);
        self.closure
            .is_none_or(|closure| closure.low > 0.0 || predicts && closure.value > 0.0)
    }
}

/// The verdict on a ranking.
pub(super) fn verdict(entries: &[Entry], checks: &Checks<'_>, none: &Checks<'_>) -> Verdict {
    // Many weak hypotheses share out the probability; together they are no effect either.
    if !none.refuted() && most_over_none(entries) < SEEN {
        return Verdict::NoGap;
    }
    let groups = by_group(entries);
    let first = &entries[groups[0].0[0]];
    if first.hypothesis == Hypothesis::Unknown || checks.refuted() {
        return Verdict::Unknown;
    }
    // An effect too small to matter always competes with its absence; where nothing explains the
    // readings better than the nominal model, there is no gap.
    if first.hypothesis == Hypothesis::None {
        return Verdict::NoGap;
    }
    // With as many unknowns as readings everything fits.
    if checks.goodness.is_none() {
        return Verdict::NotEnoughData(
            "as many unknowns as readings: no explanation can be tested; observe more modes, or in \
             another configuration"
                .to_owned(),
        );
    }
    if checks.room.is_crowded() {
        return Verdict::NotEnoughData(format!(
            "{} has with the joint {} parameters for {} readings of different kind, which other causes would \
             explain as well; observe more modes, or move a sensor",
            first.hypothesis.name(),
            checks.room.parameters,
            checks.room.readings
        ));
    }
    let holds = checks.holds();
    if groups[0].1 >= NAMED && holds {
        return name_of(entries, &groups[0].0);
    }
    let aliases = alias_group(entries);
    if aliases.len() > 1
        && aliases.iter().map(|&k| entries[k].probability).sum::<f64>() >= NAMED
        && holds
    {
        return Verdict::Group(
            aliases
                .iter()
                .flat_map(|&k| entries[k].effects().to_vec())
                .collect(),
        );
    }
    set_of(entries, &groups)
}

/// Logarithm of the largest Bayes factor against the nominal model.
fn most_over_none(entries: &[Entry]) -> f64 {
    let evidence = |entry: &Entry| entry.fit.log_evidence;
    let is_none = |entry: &&Entry| entry.hypothesis == Hypothesis::None;
    let none = entries.iter().find(is_none);
    let most = entries
        .iter()
        .map(evidence)
        .fold(f64::NEG_INFINITY, f64::max);
    none.map_or(f64::INFINITY, |none| most - evidence(none))
}

/// One effect by name; a group whose members the readings do not separate as a group.
fn name_of(entries: &[Entry], members: &[usize]) -> Verdict {
    let total: f64 = members.iter().map(|&k| entries[k].probability).sum();
    let first = &entries[members[0]];
    if first.probability >= NAMED * total || members.len() == 1 {
        return Verdict::Named(first.effects().to_vec());
    }
    let likely = members
        .iter()
        .filter(|&&k| entries[k].probability > 0.02 * total);
    Verdict::Group(
        likely
            .flat_map(|&k| entries[k].effects().to_vec())
            .collect::<Vec<EffectId>>(),
    )
}

/// The first entry and the single effects after it that fit as well.
fn alias_group(entries: &[Entry]) -> Vec<usize> {
    let Some(first) = entries.iter().position(|entry| entry.effects().len() == 1) else {
        return Vec::new();
    };
    (0..entries.len())
        .filter(|&k| {
            entries[k].effects().len() == 1
                && entries[k].probability > 0.02
                && lead(&entries[first].fit, &entries[k].fit).abs() < APART
        })
        .collect()
}

/// The shortest list of groups that holds 90 %, each with its likely members.
fn set_of(entries: &[Entry], groups: &[(Vec<usize>, f64)]) -> Verdict {
    let mut held = 0.0;
    let mut set = Vec::new();
    let mut counted = 0;
    for (members, probability) in groups {
        // A group is one of its members, and which one the readings need not know.
        let likely = members
            .iter()
            .filter(|&&k| entries[k].probability > 0.02 * probability);
        set.extend(likely.map(|&k| entries[k].hypothesis.clone()));
        held += probability;
        counted += 1;
        if held >= SET.0 {
            break;
        }
    }
    if counted <= SET.1 {
        Verdict::Set(set)
    } else {
        Verdict::NotEnoughData(format!(
            "{counted} explanations are needed to hold {:.0} % of the probability; more readings of another kind \
             would separate them",
            100.0 * SET.0
        ))
    }
}
