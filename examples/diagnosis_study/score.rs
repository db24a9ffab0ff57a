//! Scores of a set of tests: rates with their intervals, calibration of the stated probabilities, closure.

use super::record::{Outcome, Record};
use super::trial::{Answer, Explained, Trial};
use serde_json::{Map, Value, json};
use tapjoint::effects::{Effect, EffectId, Group};
use tapjoint::gap::{Hypothesis, Thresholds, Verdict};
use tapjoint::study::blind_check::Rate;

/// Least errors of the set-up that should be named: 5 mm of a position, 10 % of a scale.
const LEAST_OFFSET: f64 = 5e-3;
const LEAST_SCALE: f64 = 0.1;
/// Standard uncertainties within which a stated size should hold the truth.
const HOLDS: f64 = 2.0;
/// Bins of a reliability table, equal in width.
pub const BINS: usize = 10;

/// A test with a diagnosis.
type Answered<'a> = (&'a Record, &'a Outcome);

/// A rate under its name.
pub struct NamedRate {
    /// As the JSON has it.
    pub key: &'static str,
    /// As the table has it.
    pub title: &'static str,
    pub rate: Rate,
    /// That of an observer who knows the study's distributions; no cases where it was not asked for.
    pub ideal: Rate,
    /// That of the diagnosis on the tests that this observer saw.
    pub beside_ideal: Rate,
}

/// All scores of a set of tests.
pub struct Scores {
    pub tests: usize,
    /// Tests without a diagnosis.
    pub failed: usize,
    pub rates: Vec<NamedRate>,
    /// Mean number of classes in the list that holds 90 %.
    pub list_size: Option<f64>,
    pub closure: Closures,
    /// Calibration of the first class of every test.
    pub first: Calibration,
    /// Calibration of all stated probabilities.
    pub every: Calibration,
    /// Calibration of the ideal observer's first class.
    pub ideal_first: Calibration,
    /// Mean over tests of the sum over classes of (p - truth)^2.
    pub brier: Option<f64>,
    pub ideal_brier: Option<f64>,
    /// Mean probability of what is true.
    pub truth_probability: Option<f64>,
    pub verdicts: Vec<(&'static str, usize)>,
    pub seconds: f64,
}

/// Closure on hold-out data where one effect is planted and something is named.
pub struct Closures {
    pub median: Option<f64>,
    pub tenth_percentile: Option<f64>,
    pub stated: usize,
    /// Named tests without a closure.
    pub nulls: usize,
}

/// Kinds of verdicts.
const VERDICTS: [&str; 6] = [
    "no-gap",
    "named",
    "group",
    "set",
    "unknown",
    "not-enough-data",
];

impl Scores {
    pub fn of(records: &[&Record]) -> Self {
        let answered = records
            .iter()
            .filter_map(|record| Some((*record, record.answer.as_ref()?)));
        let answered: Vec<Answered> = answered.collect();
        let ideal = records
            .iter()
            .filter_map(|record| Some((*record, record.ideal.as_ref()?)));
        let ideal: Vec<Answered> = ideal.collect();
        let listed: Vec<f64> = answered
            .iter()
            .filter(|(record, _)| !record.is_pair())
            .map(|(_, outcome)| list(&outcome.classes).len() as f64)
            .collect();
        let stated = answered
            .iter()
            .map(|(record, outcome)| outcome.probability_of(&record.truth));
        let stated: Vec<f64> = stated.collect();
        let verdicts = VERDICTS.map(|kind| {
            let same = answered.iter();
            (kind, same.filter(|one| one.1.verdict == kind).count())
        });
        let rates = MEASURES.iter().map(|measure| NamedRate {
            key: measure.key,
            title: measure.title,
            rate: Rate::of(&answered, |one| one.1.hit(measure.key)),
            // On the tests that the ideal observer saw, which may be a part of them.
            ideal: Rate::of(&ideal, |one| one.1.hit(measure.key)),
            beside_ideal: Rate::of(answered.iter().filter(|one| one.0.ideal.is_some()), |one| {
                one.1.hit(measure.key)
            }),
        });
        Self {
            tests: records.len(),
            failed: records.len() - answered.len(),
            rates: rates.collect(),
            list_size: mean(&listed),
            closure: closures(&answered),
            first: Calibration::of(&answered, |outcome| {
                &outcome.classes[..outcome.classes.len().min(1)]
            }),
            every: Calibration::of(&answered, |outcome| &outcome.classes),
            ideal_first: Calibration::of(&ideal, |outcome| {
                &outcome.classes[..outcome.classes.len().min(1)]
            }),
            brier: mean(&answered.iter().map(brier).collect::<Vec<f64>>()),
            ideal_brier: mean(&ideal.iter().map(brier).collect::<Vec<f64>>()),
            truth_probability: mean(&stated),
            verdicts: verdicts.to_vec(),
            seconds: records.iter().map(|record| record.seconds).sum(),
        }
    }

    /// Returns the rate of this key; no cases where there is none.
    pub fn rate(&self, key: &str) -> Rate {
        let mut rates = self.rates.iter();
        rates
            .find(|one| one.key == key)
            .map_or(Rate::default(), |one| one.rate)
    }

    pub fn json(&self) -> Value {
        let mut rates = Map::new();
        for one in &self.rates {
            let interval = one.rate.interval();
            rates.insert(
                one.key.to_owned(),
                json!({
                    "hits": one.rate.hits,
                    "cases": one.rate.of,
                    "rate": one.rate.value(),
                    "low": interval.map(|interval| interval.0),
                    "high": interval.map(|interval| interval.1),
                    "ideal": one.ideal.value(),
                    "beside_ideal": one.beside_ideal.value(),
                }),
            );
        }
        let verdicts = self.verdicts.iter();
        let verdicts: Map<String, Value> = verdicts
            .map(|(kind, count)| ((*kind).to_owned(), json!(count)))
            .collect();
        json!({
            "tests": self.tests,
            "failed": self.failed,
            "seconds": self.seconds,
            "rates": rates,
            "list_size": self.list_size,
            "closure": {
                "median": self.closure.median,
                "tenth_percentile": self.closure.tenth_percentile,
                "stated": self.closure.stated,
                "nulls": self.closure.nulls,
            },
            "brier": self.brier,
            "ideal_brier": self.ideal_brier,
            "truth_probability": self.truth_probability,
            "first_class": self.first.json(),
            "every_class": self.every.json(),
            "ideal_first_class": self.ideal_first.json(),
            "verdicts": verdicts,
        })
    }
}

/// A rate that is counted: whether a test is a hit, or `None` where the test is none of its cases.
pub struct Measure {
    pub key: &'static str,
    title: &'static str,
    pub hit: fn(&Trial, &Answer) -> Option<bool>,
}

pub const MEASURES: [Measure; 21] = [
    Measure {
        key: "first_class_right",
        title: "first class right",
        hit: first_class_right,
    },
    Measure {
        key: "first_group_right",
        title: "one effect: first group",
        hit: first_group_right,
    },
    Measure {
        key: "first_group_right_visible",
        title: "  visible",
        hit: first_group_right_visible,
    },
    Measure {
        key: "place_right",
        title: "one effect: place",
        hit: place_right,
    },
    Measure {
        key: "named",
        title: "named",
        hit: is_named,
    },
    Measure {
        key: "names_right",
        title: "names that are right",
        hit: names_right,
    },
    Measure {
        key: "singles_named_right",
        title: "one effect: named rightly",
        hit: single_named_right,
    },
    Measure {
        key: "singles_named_right_visible",
        title: "  visible",
        hit: single_named_right_visible,
    },
    Measure {
        key: "singles_named_wrong",
        title: "one effect: named wrongly",
        hit: single_named_wrong,
    },
    Measure {
        key: "nulls_named",
        title: "nulls named",
        hit: null_named,
    },
    Measure {
        key: "outside_named",
        title: "outside named",
        hit: outside_named,
    },
    Measure {
        key: "outside_named_visible",
        title: "  visible",
        hit: outside_named_visible,
    },
    Measure {
        key: "outside_unknown",
        title: "outside called unknown",
        hit: outside_unknown,
    },
    Measure {
        key: "outside_unknown_visible",
        title: "  visible",
        hit: outside_unknown_visible,
    },
    Measure {
        key: "pairs_found_or_refused",
        title: "pairs found, listed or refused",
        hit: pair_found_or_refused,
    },
    Measure {
        key: "pairs_found",
        title: "pairs both found",
        hit: pair_found,
    },
    Measure {
        key: "list_holds",
        title: "90 % list holds the truth",
        hit: list_holds,
    },
    Measure {
        key: "set_up_named",
        title: "set-up errors named",
        hit: set_up_named,
    },
    Measure {
        key: "set_up_kind_right",
        title: "set-up errors, kind right",
        hit: set_up_kind_right,
    },
    Measure {
        key: "set_up_sizes_hold",
        title: "set-up sizes within 2 std",
        hit: set_up_size_holds,
    },
    Measure {
        key: "sizes_hold",
        title: "sizes of names within 2 std",
        hit: named_size_holds,
    },
];

fn first_class_right(trial: &Trial, answer: &Answer) -> Option<bool> {
    let first = answer.classes.first().map(|first| &first.0);
    Some(first == Some(&trial.truth.explained()))
}

/// Whether the most probable group of effects is the planted one.
fn first_group_right(trial: &Trial, answer: &Answer) -> Option<bool> {
    let mut classes = answer.classes.iter();
    let first = classes.find(|one| matches!(one.0, Explained::Groups(_)));
    let is_right = first.is_some_and(|first| first.0 == trial.truth.explained());
    trial.truth.is_single().then_some(is_right)
}

fn first_group_right_visible(trial: &Trial, answer: &Answer) -> Option<bool> {
    visible(trial, first_group_right(trial, answer))
}

/// Returns what is said of a test only where its fault is visible.
fn visible(trial: &Trial, hit: Option<bool>) -> Option<bool> {
    hit.filter(|_| trial.truth.is_visible)
}

/// Whether the most probable place is that of a member of the planted group: data cannot separate them.
fn place_right(trial: &Trial, answer: &Answer) -> Option<bool> {
    if !trial.truth.is_single() {
        return None;
    }
    let group = trial.truth.effects[0].id.group();
    let mut members = EffectId::ALL.iter().filter(|id| id.group() == group);
    Some(members.any(|id| Some(id.place()) == answer.place))
}

fn is_named(_: &Trial, answer: &Answer) -> Option<bool> {
    Some(answer.named().is_some())
}

fn names_right(trial: &Trial, answer: &Answer) -> Option<bool> {
    answer.named().map(|named| named == trial.truth.explained())
}

fn single_named_right(trial: &Trial, answer: &Answer) -> Option<bool> {
    let is_right = names_right(trial, answer) == Some(true);
    trial.truth.is_single().then_some(is_right)
}

fn single_named_right_visible(trial: &Trial, answer: &Answer) -> Option<bool> {
    visible(trial, single_named_right(trial, answer))
}

fn single_named_wrong(trial: &Trial, answer: &Answer) -> Option<bool> {
    let is_wrong = names_right(trial, answer) == Some(false);
    trial.truth.is_single().then_some(is_wrong)
}

fn null_named(trial: &Trial, answer: &Answer) -> Option<bool> {
    let is_named = matches!(answer.verdict, Verdict::Named(_) | Verdict::Group(_));
    trial.truth.is_null().then_some(is_named)
}

fn outside_named(trial: &Trial, answer: &Answer) -> Option<bool> {
    trial.truth.outside.map(|_| answer.named().is_some())
}

fn outside_named_visible(trial: &Trial, answer: &Answer) -> Option<bool> {
    visible(trial, outside_named(trial, answer))
}

fn outside_unknown(trial: &Trial, answer: &Answer) -> Option<bool> {
    let is_unknown = answer.verdict == Verdict::Unknown;
    trial.truth.outside.map(|_| is_unknown)
}

fn outside_unknown_visible(trial: &Trial, answer: &Answer) -> Option<bool> {
    visible(trial, outside_unknown(trial, answer))
}

fn pair_found(trial: &Trial, answer: &Answer) -> Option<bool> {
    let is_found = names_right(trial, answer) == Some(true);
    (trial.truth.effects.len() == 2).then_some(is_found)
}

fn pair_found_or_refused(trial: &Trial, answer: &Answer) -> Option<bool> {
    let truth = trial.truth.explained();
    let is_fair = match &answer.verdict {
        Verdict::Unknown | Verdict::NotEnoughData(_) => true,
        // A short list is no name, and fair if it has both or something unknown.
        Verdict::Set(list) => list
            .iter()
            .any(|one| *one == Hypothesis::Unknown || Explained::by(one) == truth),
        _ => false,
    };
    pair_found(trial, answer).map(|is_found| is_found || is_fair)
}

/// Returns the most probable classes that hold 90 % together.
fn list<T>(classes: &[(T, f64)]) -> &[(T, f64)] {
    let mut sum = 0.0;
    let enough = classes.iter().position(|one| {
        sum += one.1;
        sum >= Thresholds::DEFAULT.set_probability
    });
    &classes[..enough.map_or(classes.len(), |last| last + 1)]
}

/// Whether the list that holds 90 % holds what is true. Tests with two effects are scored for themselves.
fn list_holds(trial: &Trial, answer: &Answer) -> Option<bool> {
    let truth = trial.truth.explained();
    let holds = list(&answer.classes).iter().any(|one| one.0 == truth);
    (trial.truth.effects.len() < 2).then_some(holds)
}

fn set_up_named(trial: &Trial, answer: &Answer) -> Option<bool> {
    let set_up = Explained::Groups(vec![Group::SetUp]);
    worthy_set_up(trial).map(|_| answer.named() == Some(set_up))
}

fn set_up_kind_right(trial: &Trial, answer: &Answer) -> Option<bool> {
    worthy_set_up(trial).map(|effect| is_named_as(answer, effect))
}

fn set_up_size_holds(trial: &Trial, answer: &Answer) -> Option<bool> {
    let effect = worthy_set_up(trial)?;
    is_named_as(answer, effect).then(|| size_holds(effect, answer))?
}

fn named_size_holds(trial: &Trial, answer: &Answer) -> Option<bool> {
    let effect = trial.truth.effects.first()?;
    let is_named = trial.truth.is_single() && is_named_as(answer, effect);
    is_named.then(|| size_holds(effect, answer))?
}

/// Returns the planted error of the set-up if it should be named.
fn worthy_set_up(trial: &Trial) -> Option<&Effect> {
    let [effect] = trial.truth.effects.as_slice() else {
        return None;
    };
    let worthy = match effect.id {
        EffectId::SensorPosition | EffectId::TapPosition => {
            effect.value("offset").unwrap_or(0.0).abs() >= LEAST_OFFSET
        }
        EffectId::SensorScale => effect.value("relative").unwrap_or(0.0).abs() >= LEAST_SCALE,
        EffectId::SensorPolarity | EffectId::SensorSwap => true,
        _ => false,
    };
    worthy.then_some(effect)
}

/// Returns whether this effect alone is named, or its group with it in the first place.
fn is_named_as(answer: &Answer, effect: &Effect) -> bool {
    let named = Explained::Groups(vec![effect.id.group()]);
    answer.named() == Some(named) && answer.first == [effect.id]
}

/// Returns whether the planted size lies within the stated uncertainty. `None` where the effect has no size or none is
/// bounded.
fn size_holds(effect: &Effect, answer: &Answer) -> Option<bool> {
    let planted = effect.id.size_parameters().iter();
    let (name, truth) = planted
        .filter_map(|name| Some((*name, effect.value(name)?)))
        .find(|(_, value)| *value != 0.0)?;
    let mut parameters = answer.parameters.iter();
    let found = parameters.find(|one| one.effect == effect.id && one.name == name)?;
    Some((found.value - truth).abs() <= HOLDS * found.std?)
}

fn closures(answered: &[Answered]) -> Closures {
    let named = answered.iter().filter(|one| one.1.is_named_single);
    let all: Vec<Option<f64>> = named.map(|one| one.1.closure).collect();
    let mut stated: Vec<f64> = all.iter().flatten().copied().collect();
    stated.sort_by(f64::total_cmp);
    Closures {
        median: quantile(&stated, 0.5),
        tenth_percentile: quantile(&stated, 0.1),
        nulls: all.len() - stated.len(),
        stated: stated.len(),
    }
}

/// Returns the value that a share of the sorted values does not exceed.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let at = share * last as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    Some(low + at.fract() * (high - low))
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn brier((record, outcome): &Answered) -> f64 {
    let others = outcome.classes.iter().filter(|one| one.0 != record.truth);
    (1.0 - outcome.probability_of(&record.truth)).powi(2)
        + others.map(|one| one.1.powi(2)).sum::<f64>()
}

/// How far stated probabilities can be trusted.
pub struct Calibration {
    pub bins: Vec<Bin>,
}

/// Statements of about one probability.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bin {
    /// Statements, and those that are right.
    pub rate: Rate,
    /// Sum of the stated probabilities.
    pub sum: f64,
}

impl Bin {
    /// Returns the mean stated probability.
    pub fn stated(&self) -> Option<f64> {
        (self.rate.of > 0).then(|| self.sum / self.rate.of as f64)
    }
}

impl Calibration {
    /// Bins the statements that these tests make of classes.
    fn of(
        answered: &[Answered],
        statements: impl for<'a> Fn(&'a Outcome) -> &'a [(String, f64)],
    ) -> Self {
        let mut bins = vec![Bin::default(); BINS];
        for (record, outcome) in answered {
            for (class, probability) in statements(outcome) {
                let bin = &mut bins[((probability * BINS as f64) as usize).min(BINS - 1)];
                bin.rate.of += 1;
                bin.rate.hits += usize::from(*class == record.truth);
                bin.sum += probability;
            }
        }
        Self { bins }
    }

    /// Returns the mean distance of stated probability and share of right statements.
    pub fn error(&self) -> Option<f64> {
        let all: usize = self.bins.iter().map(|bin| bin.rate.of).sum();
        let distances = self.bins.iter();
        let sum: f64 = distances
            .map(|bin| (bin.sum - bin.rate.hits as f64).abs())
            .sum();
        (all > 0).then(|| sum / all as f64)
    }

    fn json(&self) -> Value {
        let bins = self.bins.iter().enumerate().map(|(index, bin)| {
            let interval = bin.rate.interval();
            json!({
                "from": index as f64 / BINS as f64,
                "cases": bin.rate.of,
                "stated": bin.stated(),
                "right": bin.rate.value(),
                "low": interval.map(|interval| interval.0),
                "high": interval.map(|interval| interval.1),
            })
        });
        json!({
            "expected_calibration_error": self.error(),
            "reliability": bins.collect::<Vec<Value>>(),
        })
    }
}
