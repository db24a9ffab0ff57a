//! Two effects at once, where no single one suffices.

use crate::dataset::Dataset;
use crate::evidence::Fit;
use crate::fit::{CoarseModel, Search, Start, refit_nominal, settle, start_without, unexplained};
use crate::forward::Forward;
use crate::parameters::CandidateEffect;
use crate::result::Hypothesis;
use crate::verdict::{Candidate, GoodnessOfFit, none_of, set_probabilities};
use rayon::prelude::*;
use tapjoint_beam::effects::EffectId;

/// Number of the best single effects beside which a second one is tried.
const FIRST_EFFECTS: usize = 2;
/// Number of pairs that are fitted completely.
const FITTED_PAIRS: usize = 4;
/// Number of pairs that are searched again with finer data.
const FINER_PAIRS: usize = 12;
/// Optima from which each pair is searched.
const PAIR_OPTIMA: usize = 3;
/// Number of screened pairs that are fitted beside those of the multi-start search.
const SCREENED_PAIRS: usize = 2;

/// Adds a second effect beside each of the best single ones, where none of these suffices or the second promises
/// much. `positions` is the number of positions of sensors over which the evidence of the others is averaged.
pub fn add_pairs(dataset: &Dataset, candidates: &mut Vec<Candidate>, positions: usize) {
    let is_seen = candidates
        .first()
        .is_some_and(|one| one.hypothesis != Hypothesis::None);
    let thresholds = &dataset.settings.thresholds;
    if dataset.observables.len() < thresholds.least_data_for_pairs || !is_seen {
        return;
    }
    let suffices_one = candidates
        .iter()
        .any(|one| !one.is_unknown() && one.drift.is_none() && stands(dataset, &one.fit));
    let search = PairSearch {
        dataset,
        singles: singles_of(candidates),
    };
    let needed = if suffices_one {
        thresholds.promised_by_second
    } else {
        f64::NEG_INFINITY
    };
    let (mut tried, mut pairs) = search.screened(needed);
    if !suffices_one {
        let (asked, far) = search.by_multi_start();
        pairs.truncate(SCREENED_PAIRS);
        pairs.extend(far);
        tried = tried.max(asked);
    }
    let fitted: Vec<Option<Fit>> = pairs.par_iter().map(|pair| search.fit(pair)).collect();
    let mut fitted: Vec<Fit> = fitted.into_iter().flatten().collect();
    for fit in &mut fitted {
        // These fits are those of one position. The others count as impossible.
        fit.log_evidence -= (positions as f64).ln();
    }
    refit(dataset, candidates, &fitted, positions);
    let singles = singles_of(candidates);
    let found = fitted.into_par_iter();
    let found = found.filter_map(|fit| accepted(dataset, &singles, fit));
    let found: Vec<Candidate> = found.collect();
    candidates.extend(distinct(found));
    set_probabilities(candidates, tried, thresholds);
}

/// Returns the candidates of one effect.
fn singles_of(candidates: &[Candidate]) -> Vec<&Candidate> {
    let all = candidates.iter();
    all.filter(|one| one.effects().len() == 1 && one.drift.is_none())
        .collect()
}

/// Returns the effects of the catalogue in a fit.
fn catalogue_effects(fit: &Fit) -> Vec<EffectId> {
    let effects = fit.effects.iter();
    effects.filter_map(CandidateEffect::effect).collect()
}

/// Fits single effects and the nominal model again from where pairs were fitted. A search for two effects may lead further than
/// that for one. Without this the second effect would get credit for the better search.
fn refit(dataset: &Dataset, candidates: &mut [Candidate], pairs: &[Fit], positions: usize) {
    let Some(none) = none_of(candidates).map(|none| none.fit.clone()) else {
        return;
    };
    let search = Search {
        dataset,
        without: &none,
        by_frequencies: None,
    };
    let both: Vec<(&Fit, usize)> = pairs.iter().flat_map(|fit| [(fit, 0), (fit, 1)]).collect();
    let singles = both.par_iter().map(|(pair, left_out)| {
        let alone = pair.effects[1 - left_out];
        let forward = Forward::new(dataset, &[alone]);
        let mut fit = search.fit_from(&forward, &start_without(dataset, pair, *left_out))?;
        // One of several things that the effect may act on.
        fit.log_evidence -= ((alone.variants * positions) as f64).ln();
        Some(fit)
    });
    let singles: Vec<Option<Fit>> = singles.collect();
    for fit in singles.into_iter().flatten() {
        let effects = catalogue_effects(&fit);
        let mut all = candidates.iter_mut();
        let known = all.find(|one| one.effects() == effects);
        if !known.is_some_and(|known| known.fit.replace_by_better(fit.clone())) {
            continue;
        }
        let mut all = candidates.iter_mut();
        let none = all.find(|one| one.hypothesis == Hypothesis::None);
        if let Some((none, mut nominal)) = none.zip(refit_nominal(dataset, &fit)) {
            nominal.log_evidence -= (positions as f64).ln();
            none.fit.replace_by_better(nominal);
        }
    }
}

/// Two single effects that are tried together, and points where a multi-start search ended, the most
/// promising first.
#[derive(Clone)]
struct Pair<'a> {
    first: &'a Candidate,
    second: &'a Candidate,
    starts: Vec<Start>,
}

impl Pair<'_> {
    /// Least objective of the starts.
    fn objective(&self) -> f64 {
        let first = self.starts.first();
        first.map_or(f64::INFINITY, |one| one.objective)
    }
}

/// Returns the only effect of a single candidate.
fn effect_of(single: &Candidate) -> CandidateEffect {
    single.fit.effects[0]
}

/// Search for pairs of single effects.
struct PairSearch<'a> {
    dataset: &'a Dataset,
    singles: Vec<&'a Candidate>,
}

impl<'a> PairSearch<'a> {
    fn beside<'b>(&'b self, without: &'b Fit) -> Search<'b> {
        Search {
            dataset: self.dataset,
            without,
            by_frequencies: None,
        }
    }

    /// Returns how many pairs were tried, and the most promising ones: one of the best effects with a second. Their
    /// linearised models lower the objective (1) of the best first effect by more than `needed`.
    fn screened(&self, needed: f64) -> (usize, Vec<Pair<'a>>) {
        let mut tasks: Vec<(&Candidate, &Candidate)> = Vec::new();
        for first in self.singles.iter().take(FIRST_EFFECTS) {
            let others = self.singles.iter();
            let others = others.filter(|second| first.groups() != second.groups());
            tasks.extend(others.map(|second| (*first, *second)));
        }
        let promises: Vec<Option<(f64, f64)>> = tasks
            .par_iter()
            .map(|(first, second)| {
                let search = self.beside(&first.fit);
                let promised = search.linear_screen(effect_of(second));
                Some((search.objective_without()?, promised?))
            })
            .collect();
        let alone = promises.iter().flatten().map(|promise| promise.0);
        let alone = alone.fold(f64::INFINITY, f64::min);
        let mut order: Vec<(f64, usize)> = Vec::new();
        for (k, promise) in promises.iter().enumerate() {
            let promised = promise.map_or(f64::INFINITY, |promise| promise.1);
            if promised < alone - needed {
                order.push((promised, k));
            }
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        order.truncate(FITTED_PAIRS);
        let pairs = order.into_iter().map(|(_, k)| Pair {
            first: tasks[k].0,
            second: tasks[k].1,
            starts: Vec::new(),
        });
        (tasks.len(), pairs.collect())
    }

    /// Returns how many pairs were tried, and those of all that explain the data best. The search is by the frequencies
    /// alone, which at first count as uncertain as the best single effect leaves them unexplained. Many pairs explain
    /// those equally well, so that shapes help to choose among them.
    fn by_multi_start(&self) -> (usize, Vec<Pair<'a>>) {
        let singles = &self.singles;
        let left = singles
            .iter()
            .map(|one| unexplained(self.dataset, &one.fit));
        let factor = left.fold(f64::INFINITY, f64::min);
        let coarse = CoarseModel::new(self.dataset, factor);
        let alone: Vec<Option<Start>> = singles
            .par_iter()
            .map(|one| coarse.alone(effect_of(one)).into_iter().next())
            .collect();
        let mut all: Vec<(usize, usize)> = Vec::new();
        for b in 0..singles.len() {
            for a in 0..b {
                if singles[a].groups() != singles[b].groups() {
                    all.push((a, b));
                }
            }
        }
        let found: Vec<Pair<'a>> = all
            .par_iter()
            .map(|&(a, b)| {
                let mut starts = Vec::new();
                for (first, second) in [(a, b), (b, a)] {
                    if let Some(first) = &alone[first] {
                        starts.extend(coarse.with_second(first, effect_of(singles[second])));
                    }
                }
                Pair {
                    first: singles[a],
                    second: singles[b],
                    starts: best_starts(starts),
                }
            })
            .collect();
        let finer = CoarseModel::new(self.dataset, factor.sqrt());
        let found: Vec<Pair<'a>> = best_pairs(found, FINER_PAIRS)
            .into_par_iter()
            .map(|pair| {
                let starts = pair.starts.iter();
                let starts = starts.filter_map(|start| finer.continued(start));
                let starts = starts
                    .filter_map(|start| start.by_all_data(self.dataset))
                    .collect();
                Pair {
                    starts: best_starts(starts),
                    ..pair
                }
            })
            .collect();
        (all.len(), best_pairs(found, FITTED_PAIRS))
    }

    /// Fits a pair from all its starts.
    fn fit(&self, pair: &Pair<'_>) -> Option<Fit> {
        let (first, second) = (&pair.first.fit, &pair.second.fit);
        let mut fits: Vec<Fit> = Vec::new();
        if pair.starts.is_empty() {
            let search = self.beside(first);
            fits.extend(search.add(effect_of(pair.second)));
            fits.extend(search.add_from(second));
        }
        for start in &pair.starts {
            let is_first = effect_of(pair.first).cause == start.first();
            let search = self.beside(if is_first { first } else { second });
            fits.extend(settle(&search, std::slice::from_ref(start)));
        }
        let mut fit = fits
            .into_iter()
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        // Only the best of several things that an effect may act on is fitted.
        let variants = fit.effects.iter().map(|one| (one.variants as f64).ln());
        fit.log_evidence -= variants.sum::<f64>();
        Some(fit)
    }
}

/// Returns a pair as a candidate, if it beats the better of the two by themselves in evidence. Whether it holds on data outside
/// the fit decides on its name, not on its probability.
fn accepted(dataset: &Dataset, singles: &[&Candidate], fit: Fit) -> Option<Candidate> {
    let thresholds = &dataset.settings.thresholds;
    let effects = catalogue_effects(&fit);
    let alone = singles
        .iter()
        .filter(|one| effects.contains(&one.effects()[0]));
    let alone: Vec<&Fit> = alone.map(|one| &one.fit).collect();
    let objectives = alone.iter().map(|one| one.best.optimum.objective);
    // A pair that explains less than one of its members has not reached its optimum.
    if fit.best.optimum.objective > objectives.fold(f64::INFINITY, f64::min) {
        return None;
    }
    let alone = alone
        .into_iter()
        .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
    if fit.log_evidence < alone.log_evidence + thresholds.second_effect {
        return None;
    }
    Some(Candidate::new(Hypothesis::Effects(effects), fit))
}

/// Returns the distinct starts of least objective, the best first.
fn best_starts(mut starts: Vec<Start>) -> Vec<Start> {
    starts.sort_by(|a, b| a.objective.total_cmp(&b.objective));
    starts.dedup_by(|one, better| one.is_like(better));
    starts.truncate(PAIR_OPTIMA);
    starts
}

/// Returns the pairs of least objective, the best first.
fn best_pairs(mut pairs: Vec<Pair<'_>>, count: usize) -> Vec<Pair<'_>> {
    pairs.sort_by(|a, b| a.objective().total_cmp(&b.objective()));
    pairs.truncate(count);
    pairs
}

/// Returns the more probable of the same two effects in either order.
fn distinct(found: Vec<Candidate>) -> Vec<Candidate> {
    let mut pairs: Vec<Candidate> = Vec::new();
    for pair in found {
        let reversed: Vec<EffectId> = pair.effects().iter().rev().copied().collect();
        let same = pairs
            .iter_mut()
            .find(|other| [pair.effects(), &reversed[..]].contains(&other.effects()));
        match same {
            Some(other) if other.fit.log_evidence < pair.fit.log_evidence => *other = pair,
            Some(_) => {}
            None => pairs.push(pair),
        }
    }
    pairs
}

/// Returns whether neither the fitted data refute a fit nor the hold-out data.
pub fn stands(dataset: &Dataset, fit: &Fit) -> bool {
    GoodnessOfFit::new(dataset, fit).is_some_and(|one| one.refuting_p_value().is_none())
}
