//! The score of comparisons: how often causes and names were right, and intervals held the truth.

use super::truth::{PairKind, PairTruth};
use crate::blind_check::{Rate, Row, Target};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use tapjoint_compare::{CauseKind, CauseResult, ChangeVerdict, Comparison, VerdictKind};

/// The answer to one pair.
#[derive(Debug, Clone, PartialEq)]
pub enum PairAnswer {
    /// What the comparison found.
    Compared(Box<Comparison>),
    /// Reason for which the tests could not be analysed or compared.
    None(String),
}

/// A pair: the truth and the answer.
pub type PairCase = (PairTruth, PairAnswer);

/// The conduct of a check.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairConduct {
    /// SHA-256 of the truths, printed before anything was compared; `None` of pairs made elsewhere.
    pub commitment: Option<String>,
    /// Pairs that were compared again under other names of their files, with the same answer.
    pub renamed: usize,
    /// Share of first causes right by answers dealt out to other pairs; `None` of one pair, and without a pair with one change.
    pub shuffled: Option<f64>,
}

impl PairConduct {
    /// Adds what the answers earn once they are dealt out to other pairs: each goes to the next pair of a shuffled order, so
    /// that none stays where it was.
    pub fn mutated(self, cases: &[PairCase], seed: u64) -> Self {
        let mut order: Vec<usize> = (0..cases.len()).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let next = order.iter().cycle().skip(1);
        let dealt = order.iter().zip(next).filter(|(to, from)| to != from);
        let dealt: Vec<PairCase> = dealt
            .map(|(to, from)| (cases[*to].0.clone(), cases[*from].1.clone()))
            .collect();
        Self {
            shuffled: score_pairs(&dealt).first_right.value(),
            ..self
        }
    }
}

impl PairAnswer {
    /// Returns what was found; `None` without an answer.
    pub fn found(&self) -> Option<&Comparison> {
        match self {
            Self::Compared(found) => Some(found),
            Self::None(_) => None,
        }
    }

    /// Returns the most probable hypothesis, `no-change` among them.
    pub fn first(&self) -> Option<&CauseResult> {
        self.found()?.hypotheses.first()
    }
}

/// All rates of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct PairScores {
    /// Pairs of each kind: nothing, one change, several, outside of the causes.
    pub counts: [usize; 4],
    /// Pairs without an answer: one of the tests could not be analysed, or both have too few modes in common.
    pub failed: usize,
    /// One change: its cause is the most probable one, `no-change` left out.
    pub first_right: Rate,
    /// `first_right` of the visible changes.
    pub first_right_visible: Rate,
    /// One visible change about an item, whose cause comes first: the item is right.
    pub item_right: Rate,
    /// One visible change: a cause or a group of causes is named.
    pub named: Rate,
    /// One change, named: the name is right.
    pub named_right: Rate,
    /// All pairs: a wrong name, which any name is where nothing changed or something outside of the causes.
    pub named_wrongly: Rate,
    /// Visible changes: the name, the group or the list has a right cause. For one outside of the causes it is `unknown`.
    pub list_holds: Rate,
    /// `list_holds`, where `unknown` is right for all.
    pub list_holds_or_unknown: Rate,
    /// Nothing: named, unknown, or a list without `no-change`.
    pub nothing_called_change: Rate,
    /// Outside of the causes: named.
    pub outside_named: Rate,
    /// Outside of the causes, visible: called unknown.
    pub outside_unknown: Rate,
    /// Several changes, visible: the first cause is one of them.
    pub several_first_right: Rate,
    /// The joint changed: the interval of Kt holds its change.
    pub kt_interval: Rate,
    /// The joint changed: the interval of Kr holds its change.
    pub kr_interval: Rate,
    /// A mass was added, and is visible: the interval of the mass holds it.
    pub mass_interval: Rate,
    /// A mass was added, and is visible: the interval of its place holds it.
    pub place_interval: Rate,
}

/// A pair with an answer.
#[derive(Debug, Clone, Copy)]
pub struct AnsweredPair<'a> {
    /// What changed.
    pub truth: &'a PairTruth,
    /// The answer.
    pub found: &'a Comparison,
}

impl AnsweredPair<'_> {
    /// Returns true where the change alone is noticed against the scatter.
    pub fn is_visible(&self) -> bool {
        self.truth.visible == Some(true)
    }

    fn verdict(&self) -> &ChangeVerdict {
        &self.found.verdict
    }

    /// Returns true where a cause or a group of causes is named.
    pub fn is_named(&self) -> bool {
        matches!(self.verdict().kind, VerdictKind::Named | VerdictKind::Group)
    }

    /// Returns true for a cause that frequencies hardly separate from what changed.
    pub fn is_right(&self, kind: CauseKind) -> bool {
        let changes = self.truth.changes.iter();
        changes
            .filter_map(|change| change.kind())
            .any(|own| own.is_like(kind))
    }

    /// Returns the most probable cause of a change.
    fn first(&self) -> Option<&CauseResult> {
        let mut causes = self.found.hypotheses.iter();
        causes.find(|one| one.effect != CauseKind::NoChange)
    }

    /// Returns true where the most probable cause of a change is right.
    pub fn first_is_right(&self) -> bool {
        self.first()
            .is_some_and(|first| self.is_right(first.effect))
    }

    /// Returns true where a cause of the answer is right.
    pub fn name_is_right(&self) -> bool {
        self.verdict()
            .effects
            .iter()
            .any(|kind| self.is_right(*kind))
    }

    /// Returns true where the answer is a name, `unknown`, or a list without `no-change`.
    pub fn is_called_change(&self) -> bool {
        match self.verdict().kind {
            VerdictKind::NoChange => false,
            VerdictKind::Named | VerdictKind::Group | VerdictKind::Unknown => true,
            VerdictKind::Set => !self.verdict().effects.contains(&CauseKind::NoChange),
        }
    }

    /// Returns true where the name, the group or the list has a right cause. For one outside of the causes it is `unknown`.
    pub fn list_holds(&self) -> bool {
        match self.truth.kind() {
            PairKind::Outside => self.says_unknown(),
            _ => self.name_is_right(),
        }
    }

    fn says_unknown(&self) -> bool {
        let verdict = self.verdict();
        verdict.kind == VerdictKind::Unknown || verdict.effects.contains(&CauseKind::Unknown)
    }

    /// Returns true where the item of the right first cause is right; `None` where none is about an item.
    fn item_is_right(&self) -> Option<bool> {
        let [change] = &self.truth.changes[..] else {
            return None;
        };
        let item = change.item.as_ref()?;
        let first = self
            .first()
            .filter(|one| Some(one.effect) == change.kind())?;
        Some(first.item.as_ref() == Some(item))
    }

    /// Returns true where the interval of a parameter of the true single cause holds its true value; `None` without both.
    pub fn holds(&self, kind: CauseKind, name: &str) -> Option<bool> {
        let [change] = &self.truth.changes[..] else {
            return None;
        };
        let truth = change.parameters.get(name)?;
        let mut causes = self.found.hypotheses.iter();
        let own = causes.find(|one| one.effect == kind && change.kind() == Some(kind))?;
        let found = own.parameters.get(name)?;
        Some((found.low..=found.high).contains(truth))
    }
}

/// Scores all pairs. Those without an answer count in `failed` alone.
pub fn score_pairs(cases: &[PairCase]) -> PairScores {
    let mut counts = [0; 4];
    let (mut all, mut nothing, mut single, mut several, mut outside) =
        (vec![], vec![], vec![], vec![], vec![]);
    for (truth, answer) in cases {
        let (index, kind) = match truth.kind() {
            PairKind::Nothing => (0, &mut nothing),
            PairKind::Single(_) => (1, &mut single),
            PairKind::Several => (2, &mut several),
            PairKind::Outside => (3, &mut outside),
        };
        counts[index] += 1;
        if let Some(found) = answer.found() {
            kind.push(AnsweredPair { truth, found });
            all.push(AnsweredPair { truth, found });
        }
    }
    let joint = CauseKind::JointChange;
    let added = CauseKind::AddedMass;
    PairScores {
        counts,
        failed: cases.len() - all.len(),
        first_right: Rate::of(&single, |one| Some(one.first_is_right())),
        first_right_visible: Rate::of(&single, |one| {
            one.is_visible().then(|| one.first_is_right())
        }),
        item_right: Rate::of(&single, |one| {
            one.item_is_right().filter(|_| one.is_visible())
        }),
        named: Rate::of(&single, |one| one.is_visible().then(|| one.is_named())),
        named_right: Rate::of(&single, |one| one.is_named().then(|| one.name_is_right())),
        named_wrongly: Rate::of(&all, |one| Some(one.is_named() && !one.name_is_right())),
        list_holds: Rate::of(&all, |one| one.is_visible().then(|| one.list_holds())),
        list_holds_or_unknown: Rate::of(&all, |one| {
            one.is_visible()
                .then(|| one.list_holds() || one.says_unknown())
        }),
        nothing_called_change: Rate::of(&nothing, |one| Some(one.is_called_change())),
        outside_named: Rate::of(&outside, |one| Some(one.is_named())),
        outside_unknown: Rate::of(&outside, |one| {
            one.is_visible()
                .then(|| one.verdict().kind == VerdictKind::Unknown)
        }),
        several_first_right: Rate::of(&several, |one| {
            one.is_visible().then(|| one.first_is_right())
        }),
        kt_interval: Rate::of(&single, |one| one.holds(joint, "kt")),
        kr_interval: Rate::of(&single, |one| one.holds(joint, "kr")),
        mass_interval: Rate::of(&single, |one| {
            one.holds(added, "mass").filter(|_| one.is_visible())
        }),
        place_interval: Rate::of(&single, |one| {
            one.holds(added, "position").filter(|_| one.is_visible())
        }),
    }
}

/// Returns all figures in the order of reading.
pub fn pair_rows(scores: &PairScores) -> Vec<Row> {
    let s = scores;
    let rates = [
        (
            "first_right",
            "one change: first cause is right",
            s.first_right,
        ),
        (
            "first_right_visible",
            "the same where it is visible",
            s.first_right_visible,
        ),
        ("item_right", "lost or moved: item is right", s.item_right),
        ("named", "one visible change: named", s.named),
        (
            "named_right",
            "one change, named: name is right",
            s.named_right,
        ),
        ("named_wrongly", "any pair: a wrong name", s.named_wrongly),
        ("list_holds", "visible: the answer holds it", s.list_holds),
        (
            "list_holds_or_unknown",
            "the same, or says unknown",
            s.list_holds_or_unknown,
        ),
        (
            "nothing_called_change",
            "nothing: called a change",
            s.nothing_called_change,
        ),
        ("outside_named", "outside: named", s.outside_named),
        (
            "outside_unknown",
            "outside, visible: unknown",
            s.outside_unknown,
        ),
        (
            "several_first_right",
            "two, visible: first is one of them",
            s.several_first_right,
        ),
        ("kt_interval", "95 % interval of Kt holds", s.kt_interval),
        ("kr_interval", "95 % interval of Kr holds", s.kr_interval),
        (
            "mass_interval",
            "visible: interval of mass holds",
            s.mass_interval,
        ),
        (
            "place_interval",
            "visible: interval of place holds",
            s.place_interval,
        ),
    ];
    let mut rows: Vec<Row> = rates
        .map(|(key, meaning, rate)| Row {
            key,
            meaning,
            value: rate.value(),
            interval: rate.interval(),
            counts: Some((rate.hits, rate.of)),
            target: Target::None,
            ideal: None,
        })
        .to_vec();
    let pairs: usize = s.counts.iter().sum();
    rows.push(Row {
        key: "no_answer",
        meaning: "pairs without an answer",
        value: (pairs > 0).then_some(s.failed as f64),
        interval: None,
        counts: None,
        target: Target::None,
        ideal: None,
    });
    rows
}
