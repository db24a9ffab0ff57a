//! The score of a blind check: how often the answers were right, each rate with its interval.

use super::calibration::{Calibration, calibrate};
use super::case::{Answer, CaseKind, Class, Planted, Truth, Verdict};
use super::rate::Rate;
use tapjoint_beam::effects::{EffectId, Group, Place};

/// Share of the probability that an answer's set holds.
pub const SET_SHARE: f64 = 0.9;

/// A case: what was planted, and what was answered.
pub type Case = (Truth, Answer);

/// All rates of a blind check.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// Cases of each kind: nothing planted, one effect, several, outside the catalogue.
    pub counts: [usize; 4],
    /// Tests without an answer: they could not be analysed or diagnosed.
    pub failed: usize,
    /// One effect: the most probable effect group is the planted one.
    pub top_1: Rate,
    /// The same among those that such readings show at all.
    pub top_1_detectable: Rate,
    /// One effect: the planted group is among the three most probable.
    pub top_3: Rate,
    /// One effect: the most probable class of all, `none` and `unknown` included, is right.
    pub top_1_of_all: Rate,
    /// One effect: the most probable place is right.
    pub place: Rate,
    /// One effect, named: the name is right.
    pub named_right: Rate,
    /// One effect: something is named.
    pub named: Rate,
    /// Any case in which something is named: the names are exactly what was planted.
    pub named_right_of_all: Rate,
    /// Nothing planted, yet an effect is answered.
    pub null_called_effect: Rate,
    /// Nothing planted, yet an effect is the most probable class.
    pub null_false_alarm: Rate,
    /// Outside the catalogue, yet an effect is named.
    pub outside_named: Rate,
    /// Outside the catalogue and refutable: no name, no `no-gap`.
    pub outside_refused: Rate,
    /// Outside the catalogue, refutable or not: called unknown.
    pub outside_unknown: Rate,
    /// Several effects: all named, or refused.
    pub several_found_or_refused: Rate,
    /// The same among those of whose effects each is noticed beside the other.
    pub several_detectable: Rate,
    /// Several effects: all named.
    pub several_found: Rate,
    /// The 90 % set holds what was planted (nothing, one effect, outside).
    pub set_coverage: Rate,
    /// Mean number of classes in that set; `None` without a case.
    pub set_size: Option<f64>,
    /// Mean probability of what was planted where one effect was noticed.
    pub truth_probability: Option<f64>,
    /// How far stated probabilities can be trusted.
    pub calibration: Calibration,
    /// Closure on withheld data where one effect was planted and something was named: median and
    /// tenth percentile.
    pub closure: Option<(f64, f64)>,
    /// Cases in that figure.
    pub closures: usize,
    /// Median of abs ln(estimate/truth) of the size where the name is right.
    pub size_error: Option<f64>,
}

/// Scores all cases.
pub fn score(cases: &[Case]) -> Scores {
    let kinds = [Kind::Null, Kind::Single, Kind::Several, Kind::Outside];
    let of = |kind: Kind| {
        cases
            .iter()
            .filter(move |(truth, _)| Kind::of(truth) == kind)
    };
    let closures = sorted(of(Kind::Single).filter_map(closure_of_named));
    let sizes = sorted(of(Kind::Single).filter_map(size_error));
    let sets: Vec<_> = cases
        .iter()
        .filter(|(truth, _)| truth.class().is_some())
        .collect();
    Scores {
        counts: kinds.map(|kind| of(kind).count()),
        failed: cases
            .iter()
            .filter(|(_, answer)| answer.verdict == Verdict::NoAnswer)
            .count(),
        top_1: Rate::of(of(Kind::Single), |case| rank_within(case, 1)),
        top_1_detectable: Rate::of(of(Kind::Single), |case| {
            rank_within(case, 1).filter(|_| case.0.detectable == Some(true))
        }),
        top_3: Rate::of(of(Kind::Single), |case| rank_within(case, 3)),
        top_1_of_all: Rate::of(of(Kind::Single), |(truth, answer)| {
            Some(answer.first().map(|(class, _)| class) == truth.class())
        }),
        place: Rate::of(of(Kind::Single), place_right),
        named_right: Rate::of(of(Kind::Single), |case| {
            is_named(&case.1).then(|| names_exactly(case))
        }),
        named: Rate::of(of(Kind::Single), |case| Some(is_named(&case.1))),
        named_right_of_all: Rate::of(cases, |case| is_named(&case.1).then(|| names_exactly(case))),
        null_called_effect: Rate::of(of(Kind::Null), |(_, answer)| Some(calls_effect(answer))),
        null_false_alarm: Rate::of(of(Kind::Null), |(_, answer)| {
            Some(matches!(answer.first(), Some((Class::Group(_), _))))
        }),
        outside_named: Rate::of(of(Kind::Outside), |(_, answer)| Some(is_named(answer))),
        outside_refused: Rate::of(of(Kind::Outside), |(truth, answer)| {
            (truth.refutable == Some(true)).then(|| is_refused(answer))
        }),
        outside_unknown: Rate::of(of(Kind::Outside), |(_, answer)| {
            Some(answer.verdict == Verdict::Unknown)
        }),
        several_found_or_refused: Rate::of(of(Kind::Several), |case| Some(found_or_refused(case))),
        several_detectable: Rate::of(of(Kind::Several), |case| {
            (case.0.detectable == Some(true)).then(|| found_or_refused(case))
        }),
        several_found: Rate::of(of(Kind::Several), |case| {
            Some(is_named(&case.1) && names_exactly(case))
        }),
        set_coverage: Rate::of(&sets, |(truth, answer)| {
            Some(answer.set(SET_SHARE).contains(&truth.class()?))
        }),
        set_size: mean(
            sets.iter()
                .map(|(_, answer)| answer.set(SET_SHARE).len() as f64),
        ),
        truth_probability: mean(of(Kind::Single).filter_map(|(truth, answer)| {
            let class = truth.class().filter(|_| answer.verdict != Verdict::NoGap)?;
            Some(answer.classes.get(&class).copied().unwrap_or(0.0))
        })),
        calibration: calibrate(cases),
        closures: closures.len(),
        closure: quantile(&closures, 0.5).zip(quantile(&closures, 0.1)),
        size_error: quantile(&sizes, 0.5),
    }
}

/// Kinds of cases without what was planted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Null,
    Single,
    Several,
    Outside,
}

impl Kind {
    fn of(truth: &Truth) -> Self {
        match truth.kind() {
            CaseKind::Null => Self::Null,
            CaseKind::Single(_) => Self::Single,
            CaseKind::Several => Self::Several,
            CaseKind::Outside => Self::Outside,
        }
    }
}

fn is_named(answer: &Answer) -> bool {
    answer.verdict == Verdict::Named
}

/// Whether somebody who reads the verdict believes in an effect.
fn calls_effect(answer: &Answer) -> bool {
    match answer.verdict {
        Verdict::Named | Verdict::Group => true,
        Verdict::Set => !answer.set(SET_SHARE).contains(&Class::None),
        Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData | Verdict::NoAnswer => false,
    }
}

/// Neither a name nor a clean bill: the user is told that the catalogue does not decide it.
fn is_refused(answer: &Answer) -> bool {
    matches!(answer.verdict, Verdict::Unknown | Verdict::NotEnoughData)
}

fn found_or_refused(case: &Case) -> bool {
    is_refused(&case.1) || is_named(&case.1) && names_exactly(case)
}

fn rank_within((truth, answer): &Case, most: usize) -> Option<bool> {
    let Some(Class::Group(group)) = truth.class() else {
        return None;
    };
    Some(
        answer
            .groups()
            .iter()
            .take(most)
            .any(|found| *found == group),
    )
}

/// A group over two places counts as right in either.
fn place_right((truth, answer): &Case) -> Option<bool> {
    let Some(Class::Group(group)) = truth.class() else {
        return None;
    };
    let places: Vec<Place> = places_of(group);
    let found = answer.places.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    Some(
        found
            .and_then(|(place, _)| *place)
            .is_some_and(|place| places.contains(&place)),
    )
}

fn places_of(group: Group) -> Vec<Place> {
    let members = EffectId::ALL.iter().filter(|id| id.group() == group);
    members.map(|id| id.place()).collect()
}

/// Whether the verdict names the groups of all that was planted, and no other.
fn names_exactly((truth, answer): &Case) -> bool {
    if truth
        .effects
        .iter()
        .any(|p| matches!(p, Planted::Outside(_)))
    {
        return false;
    }
    let mut groups: Vec<Group> = truth.catalogue().map(|(id, _)| id.group()).collect();
    groups.sort();
    groups.dedup();
    groups == answer.named_groups()
}

fn closure_of_named((_, answer): &Case) -> Option<f64> {
    answer.closure.filter(|_| is_named(answer))
}

/// abs ln(estimate/truth) of the effect's size where that very effect is named; infinite where the
/// sign is wrong.
fn size_error((truth, answer): &Case) -> Option<f64> {
    let (id, values) = truth.catalogue().next()?;
    if !is_named(answer) || answer.effects != [id] {
        return None;
    }
    let name = *id.size_parameters().first()?;
    let planted = values.get(name)?;
    let (.., found) = answer
        .parameters
        .iter()
        .find(|(effect, parameter, _)| *effect == id && parameter == name)?;
    let ratio = found / planted;
    Some(if ratio > 0.0 {
        ratio.ln().abs()
    } else {
        f64::INFINITY
    })
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The value that a share of the sorted values does not exceed; `None` of nothing.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let at = share * last as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    Some(if low == high {
        low
    } else {
        low + at.fract() * (high - low)
    })
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), x| (sum + x, count + 1));
    (count > 0).then(|| sum / count as f64)
}
