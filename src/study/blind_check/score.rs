//! The score of a blind check: how often the answers were right, each rate with its interval, and how far
//! stated probabilities can be trusted (Brier's score and a reliability table).
//!
//! Checks of the check: answers without knowledge must score as guesses do.

use super::case::{Answer, Case, CaseKind, Class, EstimatedParameter, Extent, Planted, Truth};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{Beta, ContinuousCDF};
use tapjoint_beam::effects::{EffectId, Group};
use tapjoint_diagnosis::{Thresholds, Verdict};

/// All rates of a blind check.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// Cases of each kind: nothing planted, one effect, several, outside the catalogue.
    pub counts: [usize; 4],
    /// Tests without an answer: they could not be analysed or diagnosed.
    pub failed: usize,
    /// One effect: the most probable effect group is the planted one.
    pub top_1: Rate,
    /// `top_1` of the tests whose effect such readings show at all.
    pub top_1_detectable: Rate,
    /// One effect: the planted group is among the three most probable.
    pub top_3: Rate,
    /// One effect: the most probable class of all, `none` and `unknown` included, is right.
    pub top_1_of_all: Rate,
    /// One effect: the most probable place is right.
    pub place: Rate,
    /// One effect, named: the name is right. A verdict of one group of effects names that group.
    pub named_right: Rate,
    /// One effect: something is named.
    pub named: Rate,
    /// Any case in which something is named: the names are exactly what was planted.
    pub named_right_of_all: Rate,
    /// All cases: something is named.
    pub name_share: Rate,
    /// `named_right` of verdicts that name a single effect, or two, and no group.
    pub single_named_right: Rate,
    /// `named` by such verdicts.
    pub single_named: Rate,
    /// `named_right_of_all` of such verdicts.
    pub single_named_right_of_all: Rate,
    /// One clear error of the set-up is named: an offset of 5 mm or more, a polarity, a swap, or a scale 10 % off or
    /// more.
    pub set_up_named: Rate,
    /// One error of the set-up, rightly named, its size estimated: the size lies within 2 stated standard deviations.
    pub set_up_size_within_2_std: Rate,
    /// One effect of any kind, rightly named with a size: the size lies within 2 stated standard deviations.
    pub size_within_2_std: Rate,
    /// Nothing planted, yet an effect is answered.
    pub null_called_effect: Rate,
    /// Nothing planted, yet an effect is the most probable class.
    pub null_false_alarm: Rate,
    /// Outside the catalogue, yet an effect is named.
    pub outside_named: Rate,
    /// `outside_named` by a verdict that names a single effect, or two, and no group.
    pub outside_single_named: Rate,
    /// Outside the catalogue and refutable: no name, no `no-gap`.
    pub outside_refused: Rate,
    /// Outside the catalogue, refutable or not: called unknown.
    pub outside_unknown: Rate,
    /// Several effects: all named, or refused.
    pub several_found_or_refused: Rate,
    /// `several_found_or_refused` of the tests in which each effect is noticed beside the other.
    pub several_detectable: Rate,
    /// Several effects: all named.
    pub several_found: Rate,
    /// The 90 % set holds what was planted (nothing, one effect, outside).
    pub set_coverage: Rate,
    /// Mean number of classes in that set; `None` without a case.
    pub set_size: Option<f64>,
    /// Mean probability of what was planted where one effect was noticed.
    pub truth_probability: Option<f64>,
    /// Trust that the stated probabilities deserve.
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
    let (mut nulls, mut singles, mut several, mut outside) = (vec![], vec![], vec![], vec![]);
    for (truth, answer) in cases {
        let kind = match truth.kind() {
            CaseKind::Null => &mut nulls,
            CaseKind::Single(_) => &mut singles,
            CaseKind::Several => &mut several,
            CaseKind::OutOfCatalogue => &mut outside,
        };
        kind.push((truth, answer));
    }
    let named = singles.iter().filter(|(_, answer)| answer.is_name());
    let closures = sorted(named.filter_map(|(_, answer)| answer.closure));
    let sizes = sorted(singles.iter().filter_map(|(t, a)| size_error(t, a)));
    let classed = cases.iter().filter_map(|(truth, answer)| {
        let class = truth.class()?;
        Some((class, answer.set(Thresholds::DEFAULT.set_probability)))
    });
    let sets: Vec<(Class, Vec<Class>)> = classed.collect();
    let failed = cases.iter().filter(|(_, answer)| answer.verdict.is_none());
    Scores {
        counts: [&nulls, &singles, &several, &outside].map(Vec::len),
        failed: failed.count(),
        top_1: Rate::of(&singles, |(t, a)| Some(rank_within(t, a, 1))),
        top_1_detectable: Rate::of(&singles, |(t, a)| {
            (t.detectable == Some(true)).then(|| rank_within(t, a, 1))
        }),
        top_3: Rate::of(&singles, |(t, a)| Some(rank_within(t, a, 3))),
        top_1_of_all: Rate::of(&singles, |(t, a)| {
            Some(a.first().map(|(class, _)| class) == t.class())
        }),
        place: Rate::of(&singles, |(t, a)| {
            let found = a.places.iter().max_by(|a, b| a.1.total_cmp(&b.1));
            let place = found.and_then(|(place, _)| *place);
            // A group over two places counts as right in either.
            let mut members = EffectId::ALL.iter().filter(|id| is_class(t, id.group()));
            Some(members.any(|id| Some(id.place()) == place))
        }),
        named_right: Rate::of(&singles, |(t, a)| a.is_name().then(|| names_exactly(t, a))),
        named: Rate::of(&singles, |(_, a)| Some(a.is_name())),
        named_right_of_all: Rate::of(cases, |(t, a)| a.is_name().then(|| names_exactly(t, a))),
        name_share: Rate::of(cases, |(_, a)| Some(a.is_name())),
        single_named_right: Rate::of(&singles, |(t, a)| {
            a.is_single_name().then(|| names_exactly(t, a))
        }),
        single_named: Rate::of(&singles, |(_, a)| Some(a.is_single_name())),
        single_named_right_of_all: Rate::of(cases, |(t, a)| {
            a.is_single_name().then(|| names_exactly(t, a))
        }),
        set_up_named: Rate::of(&singles, |(t, a)| {
            is_clear_set_up_error(t).then(|| a.is_name() && names_exactly(t, a))
        }),
        set_up_size_within_2_std: Rate::of(&singles, |(t, a)| {
            size_within_2_std(t, a).filter(|_| is_class(t, Group::SetUp))
        }),
        size_within_2_std: Rate::of(&singles, |(t, a)| size_within_2_std(t, a)),
        // The verdict makes its reader believe in an effect.
        null_called_effect: Rate::of(&nulls, |(_, a)| {
            Some(match &a.verdict {
                Some(Verdict::Named(_) | Verdict::Group(_)) => true,
                Some(Verdict::Set(_)) => !a
                    .set(Thresholds::DEFAULT.set_probability)
                    .contains(&Class::None),
                Some(Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData(_)) | None => false,
            })
        }),
        null_false_alarm: Rate::of(&nulls, |(_, a)| {
            Some(matches!(a.first(), Some((Class::Group(_), _))))
        }),
        outside_named: Rate::of(&outside, |(_, a)| Some(a.is_name())),
        outside_single_named: Rate::of(&outside, |(_, a)| Some(a.is_single_name())),
        outside_refused: Rate::of(&outside, |(t, a)| {
            (t.refutable == Some(true)).then(|| is_refused(a))
        }),
        outside_unknown: Rate::of(&outside, |(_, a)| Some(a.verdict == Some(Verdict::Unknown))),
        several_found_or_refused: Rate::of(&several, |(t, a)| Some(found_or_refused(t, a))),
        several_detectable: Rate::of(&several, |(t, a)| {
            (t.detectable == Some(true)).then(|| found_or_refused(t, a))
        }),
        several_found: Rate::of(&several, |(t, a)| Some(a.is_name() && names_exactly(t, a))),
        set_coverage: Rate::of(&sets, |(class, set)| Some(set.contains(class))),
        set_size: mean(sets.iter().map(|(_, set)| set.len() as f64)),
        truth_probability: mean(singles.iter().filter_map(|(truth, answer)| {
            let class = truth
                .class()
                .filter(|_| answer.verdict != Some(Verdict::NoGap))?;
            Some(answer.stated(class))
        })),
        calibration: calibrate(cases),
        closures: closures.len(),
        closure: quantile(&closures, 0.5).zip(quantile(&closures, 0.1)),
        size_error: quantile(&sizes, 0.5),
    }
}

/// Returns true where the verdict leaves the case open: neither an effect nor "nothing is missing".
fn is_refused(answer: &Answer) -> bool {
    matches!(
        answer.verdict,
        Some(Verdict::Unknown | Verdict::NotEnoughData(_))
    )
}

fn found_or_refused(truth: &Truth, answer: &Answer) -> bool {
    is_refused(answer) || answer.is_name() && names_exactly(truth, answer)
}

fn is_class(truth: &Truth, group: Group) -> bool {
    truth.class() == Some(Class::Group(group))
}

/// Returns true where the planted group is among the `most` most probable.
fn rank_within(truth: &Truth, answer: &Answer, most: usize) -> bool {
    let mut first = answer.groups().into_iter().take(most);
    first.any(|group| is_class(truth, group))
}

/// Returns true where the verdict names the groups of all that was planted, and no other. Where it names an error of the
/// set-up, it names the sensor too.
fn names_exactly(truth: &Truth, answer: &Answer) -> bool {
    if truth.kind() == CaseKind::OutOfCatalogue {
        return false;
    }
    let counted = truth.counted().filter_map(|planted| match planted {
        Planted::Catalogue(id, _) => Some(id.group()),
        Planted::OutOfCatalogue(_) => None,
    });
    let mut groups: Vec<Group> = counted.collect();
    groups.sort();
    groups.dedup();
    groups == answer.named_groups() && names_the_sensor(truth, answer)
}

/// Returns false where an effect is named, but of another sensor than the planted one. An answer that gives no sensor
/// cannot be wrong in it. Sensor 0 stands for all.
fn names_the_sensor(truth: &Truth, answer: &Answer) -> bool {
    truth.catalogue().all(|(id, values)| {
        let found = ["sensor", "other"]
            .map(|name| answer.estimate(id, name).map(|estimate| estimate.value));
        let [Some(found), other] = found else {
            return true;
        };
        let Some(&planted) = values.get("sensor") else {
            return true;
        };
        let is_same = found == planted || planted == 0.0;
        match (other, values.get("other")) {
            // A swap has no direction.
            (Some(other), Some(&planted_other)) => {
                let crossed = found == planted_other && other == planted;
                crossed || is_same && other == planted_other
            }
            _ => is_same,
        }
    })
}

/// Least offset that is a clear error of the set-up (m).
const CLEAR_OFFSET: f64 = 5e-3;
/// Least relative error of a calibration that is clear (1), either way.
const CLEAR_SCALE: f64 = 0.1;

/// Returns true of an error of the set-up that a test is expected to show.
fn is_clear_set_up_error(truth: &Truth) -> bool {
    let CaseKind::Single(id) = truth.kind() else {
        return false;
    };
    let mut planted = truth.catalogue().filter(|(own, _)| *own == id);
    let values = planted.next().map(|(_, values)| values);
    let size = |name: &str| values.and_then(|values| values.get(name)).copied();
    match id {
        EffectId::SensorPosition | EffectId::TapPosition => {
            size("offset").is_some_and(|offset| offset.abs() >= CLEAR_OFFSET)
        }
        EffectId::SensorScale => {
            size("relative").is_some_and(|relative| relative.abs() >= CLEAR_SCALE)
        }
        EffectId::SensorPolarity | EffectId::SensorSwap => true,
        _ => false,
    }
}

/// Planted size of the one effect that counts, and its estimate, where that very effect is named.
fn size_of<'a>(truth: &Truth, answer: &'a Answer) -> Option<(f64, &'a EstimatedParameter)> {
    let CaseKind::Single(id) = truth.kind() else {
        return None;
    };
    if !answer.is_name() || answer.effects != [id] {
        return None;
    }
    let (_, values) = truth.catalogue().find(|(own, _)| *own == id)?;
    let name = *id.size_parameters().first()?;
    Some((*values.get(name)?, answer.estimate(id, name)?))
}

/// abs ln(estimate/truth) of the effect's size where that very effect is named; infinite where the
/// sign is wrong.
fn size_error(truth: &Truth, answer: &Answer) -> Option<f64> {
    let (planted, found) = size_of(truth, answer)?;
    let ratio = found.value / planted;
    Some(match ratio > 0.0 {
        true => ratio.ln().abs(),
        false => f64::INFINITY,
    })
}

/// Returns true where the estimated size lies within 2 standard deviations of the planted one; `None` where that very
/// effect is not named, or its size has no standard deviation.
fn size_within_2_std(truth: &Truth, answer: &Answer) -> Option<bool> {
    let (planted, found) = size_of(truth, answer)?;
    let std = found.std?;
    Some((found.value - planted).abs() <= 2.0 * std)
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

/// So many of so many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rate {
    /// Cases that count as hits.
    pub hits: usize,
    /// Cases that could have been hits.
    pub of: usize,
}

impl Rate {
    /// Counts the cases for which `hit` says something.
    pub fn of<T>(
        cases: impl IntoIterator<Item = T>,
        mut hit: impl FnMut(T) -> Option<bool>,
    ) -> Self {
        let mut rate = Self::default();
        for case in cases {
            if let Some(hit) = hit(case) {
                rate.hits += usize::from(hit);
                rate.of += 1;
            }
        }
        rate
    }

    /// hits/of; `None` without a case.
    pub fn value(&self) -> Option<f64> {
        (self.of > 0).then(|| self.hits as f64 / self.of as f64)
    }

    /// The 95 % interval of the true rate (Clopper & Pearson 1934), which never covers less than it
    /// says: the rates at which so many hits or more, or so few or less, have a chance of 2.5 %.
    /// `None` without a case.
    pub fn interval(&self) -> Option<(f64, f64)> {
        if self.of == 0 {
            return None;
        }
        let (hits, misses) = (self.hits as f64, (self.of - self.hits) as f64);
        // There is no such distribution without a hit, or without a miss.
        let low = Beta::new(hits, misses + 1.0).map_or(0.0, |beta| beta.inverse_cdf(0.025));
        let high = Beta::new(hits + 1.0, misses).map_or(1.0, |beta| beta.inverse_cdf(0.975));
        Some((low, high))
    }
}

/// Bins of the reliability table, equal in width.
const BINS: usize = 10;

/// One row of the reliability table: answers whose first class has about this probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReliabilityBin {
    /// Lower edge of the bin (1).
    pub from: f64,
    /// Answers in it.
    pub cases: usize,
    /// Their mean stated probability; `None` without a case.
    pub stated: Option<f64>,
    /// Share of them that was right (1); `None` without a case.
    pub right: Option<f64>,
}

/// Trust that the stated probabilities deserve.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Mean over cases of the sum over classes of (p - truth)^2, from 0 (certain and right) to 2;
    /// `None` without a case. It cannot be improved by stating what one does not believe.
    pub brier: Option<f64>,
    /// Mean distance between stated probability and share of right answers, weighted by cases.
    pub expected_calibration_error: Option<f64>,
    /// The table behind it.
    pub reliability: Vec<ReliabilityBin>,
}

/// Judges the probabilities of all cases with one right class.
fn calibrate(cases: &[Case]) -> Calibration {
    let cases: Vec<(Class, &Answer)> = cases
        .iter()
        .filter_map(|(truth, answer)| Some((truth.class()?, answer)))
        .collect();
    let mut reliability = Vec::with_capacity(BINS);
    let mut error = 0.0;
    for bin in 0..BINS {
        let (mut inside, mut stated, mut right) = (0, 0.0, 0);
        for (truth, answer) in &cases {
            let Some((class, probability)) = answer.first() else {
                continue;
            };
            if ((probability * BINS as f64) as usize).min(BINS - 1) == bin {
                inside += 1;
                stated += probability;
                right += usize::from(class == *truth);
            }
        }
        let stated = (inside > 0).then(|| stated / inside as f64);
        let right = (inside > 0).then(|| right as f64 / inside as f64);
        if let Some((stated, right)) = stated.zip(right) {
            error += inside as f64 / cases.len() as f64 * (stated - right).abs();
        }
        reliability.push(ReliabilityBin {
            from: bin as f64 / BINS as f64,
            cases: inside,
            stated,
            right,
        });
    }
    Calibration {
        brier: mean(cases.iter().map(|(class, answer)| brier(*class, answer))),
        expected_calibration_error: (!cases.is_empty()).then_some(error),
        reliability,
    }
}

/// sum over classes of (p - 1 or 0)^2.
fn brier(truth: Class, answer: &Answer) -> f64 {
    let others = answer.classes.iter().filter(|(class, _)| **class != truth);
    (1.0 - answer.stated(truth)).powi(2) + others.map(|(_, p)| p * p).sum::<f64>()
}

/// The conduct of a check, and the score of answers without knowledge.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conduct {
    /// Recordings of each test; `None` of tests made elsewhere.
    pub extent: Option<Extent>,
    /// SHA-256 of the truths, printed before anything was diagnosed; `None` of tests made elsewhere.
    pub commitment: Option<String>,
    /// Share of first groups right by answers dealt out to other tests; `None` without a test of one effect.
    pub shuffled: Option<f64>,
    /// Share of first groups right by always answering one common factor on all frequencies.
    pub always_scale: Option<f64>,
    /// Tests that were diagnosed again under other names of their files, with the same answer.
    pub renamed: usize,
}

impl Conduct {
    /// Adds what the answers earn once they are dealt out to other tests, and once they are all the same.
    pub fn mutated(self, cases: &[Case], seed: u64) -> Self {
        Conduct {
            shuffled: score(&shuffled(cases, seed)).top_1.value(),
            always_scale: score(&always_scale(cases)).top_1.value(),
            ..self
        }
    }
}

/// The answers dealt out to other cases: their score is what guessing earns.
pub fn shuffled(cases: &[Case], seed: u64) -> Vec<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..cases.len()).collect();
    order.shuffle(&mut random);
    let pairs = cases.iter().zip(order);
    pairs
        .map(|((truth, _), from)| (truth.clone(), cases[from].1.clone()))
        .collect()
}

/// One answer to every case: one common factor on all frequencies.
pub fn always_scale(cases: &[Case]) -> Vec<Case> {
    let answer = Answer {
        verdict: Some(Verdict::Named(vec![EffectId::Modulus])),
        effects: vec![EffectId::Modulus],
        classes: [(Class::Group(EffectId::Modulus.group()), 1.0)].into(),
        places: vec![(Some(EffectId::Modulus.place()), 1.0)],
        parameters: Vec::new(),
        closure: None,
    };
    let truths = cases.iter().map(|(truth, _)| truth.clone());
    truths.map(|truth| (truth, answer.clone())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_intervals_of_clopper_and_pearson() {
        // scipy.stats.binomtest(k, n).proportion_ci(): 8 of 10, 0 of 100, 100 of 100.
        let close = |rate: Rate, low: f64, high: f64| {
            let (l, h) = rate.interval().expect("there are cases");
            // The digits of the table.
            assert!(
                (l - low).abs() < 1e-6 && (h - high).abs() < 1e-6,
                "{rate:?}: {l} {h}"
            );
        };
        close(Rate { hits: 8, of: 10 }, 0.443_905, 0.974_789);
        close(Rate { hits: 0, of: 100 }, 0.0, 0.036_217);
        close(Rate { hits: 100, of: 100 }, 0.963_783, 1.0);
    }

    #[test]
    fn limit_no_case_has_no_rate() {
        assert_eq!(
            (Rate::default().value(), Rate::default().interval()),
            (None, None)
        );
        let rate = Rate::of([Some(true), None, Some(false)], |hit| hit);
        assert_eq!(rate, Rate { hits: 1, of: 2 });
    }
}
