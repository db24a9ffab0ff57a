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
            shuffled: score_pairs(&dealt)
                .rate("first_right")
                .and_then(|rate| rate.value()),
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
    /// A rate for each of [`FIGURES`].
    rates: [Rate; FIGURES.len()],
}

impl PairScores {
    /// Returns the rate of this key, such as "first_right"; `None` where there is no such rate.
    pub fn rate(&self, key: &str) -> Option<Rate> {
        let mut both = FIGURES.iter().zip(&self.rates);
        let (_, rate) = both.find(|(figure, _)| figure.key == key)?;
        Some(*rate)
    }
}

/// A rate of a check: which pairs count, and which of them are hits.
struct PairFigure {
    /// Name for programs.
    key: &'static str,
    /// Its meaning.
    meaning: &'static str,
    /// Kinds of pairs that count, by their index in [`PairScores::counts`].
    kinds: &'static [usize],
    /// True for a hit; `None` where a pair does not count.
    is_hit: fn(AnsweredPair<'_>) -> Option<bool>,
}

/// Indices of the kinds of pairs.
const NOTHING: usize = 0;
const SINGLE: usize = 1;
const SEVERAL: usize = 2;
const OUTSIDE: usize = 3;
const ALL: &[usize] = &[NOTHING, SINGLE, SEVERAL, OUTSIDE];

/// All rates in the order of reading. A first cause is the most probable one, `no-change` left out. Any name is wrong where nothing
/// changed, or something outside of the causes did.
const FIGURES: [PairFigure; 16] = [
    PairFigure {
        key: "first_right",
        meaning: "one change: first cause is right",
        kinds: &[SINGLE],
        is_hit: |one| Some(one.first_is_right()),
    },
    PairFigure {
        key: "first_right_visible",
        meaning: "the same where it is visible",
        kinds: &[SINGLE],
        is_hit: |one| one.is_visible().then(|| one.first_is_right()),
    },
    PairFigure {
        key: "item_right",
        meaning: "lost or moved: item is right",
        kinds: &[SINGLE],
        is_hit: |one| one.item_is_right().filter(|_| one.is_visible()),
    },
    PairFigure {
        key: "named",
        meaning: "one visible change: named",
        kinds: &[SINGLE],
        is_hit: |one| one.is_visible().then(|| one.is_named()),
    },
    PairFigure {
        key: "named_right",
        meaning: "one change, named: name is right",
        kinds: &[SINGLE],
        is_hit: |one| one.is_named().then(|| one.name_is_right()),
    },
    PairFigure {
        key: "named_wrongly",
        meaning: "any pair: a wrong name",
        kinds: ALL,
        is_hit: |one| Some(one.is_named() && !one.name_is_right()),
    },
    PairFigure {
        key: "list_holds",
        meaning: "visible: the answer holds it",
        kinds: ALL,
        is_hit: |one| one.is_visible().then(|| one.list_holds()),
    },
    PairFigure {
        key: "list_holds_or_unknown",
        meaning: "the same, or says unknown",
        kinds: ALL,
        is_hit: |one| {
            one.is_visible()
                .then(|| one.list_holds() || one.says_unknown())
        },
    },
    PairFigure {
        key: "nothing_called_change",
        meaning: "nothing: called a change",
        kinds: &[NOTHING],
        is_hit: |one| Some(one.is_called_change()),
    },
    PairFigure {
        key: "outside_named",
        meaning: "outside: named",
        kinds: &[OUTSIDE],
        is_hit: |one| Some(one.is_named()),
    },
    PairFigure {
        key: "outside_unknown",
        meaning: "outside, visible: unknown",
        kinds: &[OUTSIDE],
        is_hit: |one| {
            one.is_visible()
                .then(|| one.verdict().kind == VerdictKind::Unknown)
        },
    },
    PairFigure {
        key: "several_first_right",
        meaning: "two, visible: first is one of them",
        kinds: &[SEVERAL],
        is_hit: |one| one.is_visible().then(|| one.first_is_right()),
    },
    PairFigure {
        key: "kt_interval",
        meaning: "95 % interval of Kt holds",
        kinds: &[SINGLE],
        is_hit: |one| one.holds(CauseKind::JointChange, "kt"),
    },
    PairFigure {
        key: "kr_interval",
        meaning: "95 % interval of Kr holds",
        kinds: &[SINGLE],
        is_hit: |one| one.holds(CauseKind::JointChange, "kr"),
    },
    PairFigure {
        key: "mass_interval",
        meaning: "visible: interval of mass holds",
        kinds: &[SINGLE],
        is_hit: |one| {
            one.holds(CauseKind::AddedMass, "mass")
                .filter(|_| one.is_visible())
        },
    },
    PairFigure {
        key: "place_interval",
        meaning: "visible: interval of place holds",
        kinds: &[SINGLE],
        is_hit: |one| {
            one.holds(CauseKind::AddedMass, "position")
                .filter(|_| one.is_visible())
        },
    },
];

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
    let mut answered = Vec::new();
    for (truth, answer) in cases {
        let kind = match truth.kind() {
            PairKind::Nothing => NOTHING,
            PairKind::Single(_) => SINGLE,
            PairKind::Several => SEVERAL,
            PairKind::Outside => OUTSIDE,
        };
        counts[kind] += 1;
        if let Some(found) = answer.found() {
            answered.push((kind, AnsweredPair { truth, found }));
        }
    }
    PairScores {
        counts,
        failed: cases.len() - answered.len(),
        rates: FIGURES.map(|figure| {
            let own = answered
                .iter()
                .filter(|(kind, _)| figure.kinds.contains(kind));
            Rate::of(own, |(_, pair)| (figure.is_hit)(*pair))
        }),
    }
}

/// Returns all figures in the order of reading.
pub fn pair_rows(scores: &PairScores) -> Vec<Row> {
    let rates = FIGURES.iter().zip(&scores.rates);
    let mut rows: Vec<Row> = rates
        .map(|(figure, rate)| Row {
            key: figure.key,
            meaning: figure.meaning,
            value: rate.value(),
            interval: rate.interval(),
            counts: Some((rate.hits, rate.of)),
            target: Target::None,
            ideal: None,
        })
        .collect();
    let pairs: usize = scores.counts.iter().sum();
    rows.push(Row {
        key: "no_answer",
        meaning: "pairs without an answer",
        value: (pairs > 0).then_some(scores.failed as f64),
        interval: None,
        counts: None,
        target: Target::None,
        ideal: None,
    });
    rows
}
