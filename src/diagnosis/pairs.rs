//! Two effects at once, where no single one suffices.

use super::afar::{Rough, Start, unexplained};
use super::catalogue::{Candidate, PlaceKind};
use super::forward::Layout;
use super::frame::Frame;
use super::hypothesis::{Fit, Search};
use super::posterior::{Entry, set_probabilities};
use super::quality::Residuals;
use super::result::Hypothesis;
use super::search::Competition;
use super::settings::GapSettings;
use super::trial::{Trial, refutes_withheld};
use super::withheld::{self, WithheldErrors};
use rayon::prelude::*;
use tapjoint_beam::effects::EffectId;

/// How many of the best single effects a second one is put beside.
const FIRSTS: usize = 2;
/// Logarithm of the Bayes factor from which a second effect is believed, 148 to 1: up to that two explanations
/// count as equally good ones.
pub(super) const SECOND: f64 = 5.0;

/// How much further a second effect must promise to lower the objective where a single one suffices: what is
/// believed, and as much again for the place and size that it may choose.
const PROMISED: f64 = 2.0 * SECOND;

/// A second effect beside each of the best single ones, where none of these suffices or the second promises
/// much.
pub(super) fn add_pairs(competition: &mut Competition, settings: &GapSettings) {
    let frame = &competition.frame;
    let suffices = |entry: &Entry| {
        entry.hypothesis != Hypothesis::Unknown
            && entry.drift.is_none()
            && stands(frame, &entry.fit)
    };
    let seen = |entry: &Entry| entry.hypothesis != Hypothesis::None;
    if frame.rows.len() < 6 || !competition.entries.first().is_some_and(seen) {
        return;
    }
    let suffices_one = competition.entries.iter().any(suffices);
    let singles: Vec<&Entry> = competition
        .entries
        .iter()
        .filter(|entry| entry.effects().len() == 1 && entry.drift.is_none())
        .collect();
    let needed = if suffices_one {
        PROMISED
    } else {
        f64::NEG_INFINITY
    };
    let (mut tried, mut tasks) = promising((frame, settings), &singles, needed);
    if !suffices_one {
        let (asked, far) = from_afar((frame, settings), &singles);
        tasks.truncate(BESIDE);
        tasks.extend(far);
        tried = tried.max(asked);
    }
    let found: Vec<Option<Entry>> = tasks
        .par_iter()
        .map(|task| pair(frame, settings, task))
        .collect();
    let pairs = distinct(found.into_iter().flatten().collect());
    competition.entries.extend(pairs);
    spread_over_the_beam(&competition.frame, &mut competition.entries);
    set_probabilities(&mut competition.entries, tried);
}

/// Whether an effect sits somewhere along the beam.
fn is_local(candidate: &Candidate) -> bool {
    let place = candidate.place.as_ref();
    place.is_some_and(|place| place.kind == PlaceKind::Position)
}

/// Whether a fit has as many parameters of its own choice as a change that is spread over the beam: all its effects
/// choose their places, or a frequency that no peak states.
fn is_flexible(frame: &Frame, fit: &Fit) -> bool {
    let layout = Layout::new(frame, &fit.effects);
    let is_free = |k: usize| {
        let place = layout.place(k);
        // What a peak states is known to a standard deviation; else only its range is.
        place.is_some_and(|place| !fit.branch.knowledge[place].std.is_finite())
    };
    let chooses = |k: usize| {
        let place = fit.effects[k].place.as_ref();
        place.is_some_and(|place| match place.kind {
            PlaceKind::Position => true,
            PlaceKind::FixtureFrequency => is_free(k),
            PlaceKind::Exponent | PlaceKind::Gyration => false,
        })
    };
    fit.effects.iter().any(is_local) && (0..fit.effects.len()).all(chooses)
}

/// How many times their standard uncertainty withheld readings may be missed by two effects that get a name: chance
/// alone reaches that in 3 of 1000 (Gaussian, one mode of common error).
const MISSED: f64 = 3.0;

/// Whether a fit foretells the withheld readings within their own uncertainty, however much it leaves open itself; so
/// where nothing was withheld.
fn foretells(frame: &Frame, fit: &Fit) -> bool {
    let withheld = WithheldErrors::new(frame, fit);
    withheld.is_none_or(|errors| errors.rms() <= MISSED * errors.floor())
}

/// What is unknown may be spread over a part of the beam. Two changes at places of their own imitate every
/// such change, with as many parameters as its place, extent, mass and stiffness: it explains what they
/// explain, and from these readings nobody can tell which it was; and so does one beside a fixture at a frequency of
/// its choice, and the best two effects of any kind that miss what took no part in the fit by more than its noise. Two
/// of the same kind are no hypothesis of their own: they are one way of being unknown.
fn spread_over_the_beam(frame: &Frame, entries: &mut Vec<Entry>) {
    let pairs = entries.iter().filter(|entry| entry.effects().len() > 1);
    let fits: Vec<&Fit> = pairs.map(|entry| &entry.fit).collect();
    let more = |a: &&&Fit, b: &&&Fit| a.log_evidence.total_cmp(&b.log_evidence);
    let best = fits.iter().max_by(more);
    let failing = best.filter(|fit| !foretells(frame, fit));
    let most = fits
        .iter()
        .filter(|fit| is_flexible(frame, fit))
        .chain(failing)
        .map(|fit| fit.log_evidence)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut all = entries.iter_mut();
    if let Some(unknown) = all.find(|entry| entry.hypothesis == Hypothesis::Unknown) {
        unknown.fit.log_evidence = unknown.fit.log_evidence.max(most);
    }
    entries.retain(|entry| match entry.effects() {
        [first, second] => first != second,
        _ => true,
    });
}

/// How many pairs are fitted in earnest.
const EARNEST: usize = 4;

/// A second effect that is tried beside a first one, and where the search may begin from afar, the most
/// promising first.
type Task<'a> = (&'a Entry, &'a Entry, Vec<Start>);

/// The pairs of one of the best effects with a second whose linearised models explain the readings best, and
/// better than the first by what is needed; and how many were asked.
fn promising<'a>(
    (frame, settings): (&Frame, &GapSettings),
    singles: &[&'a Entry],
    needed: f64,
) -> (usize, Vec<Task<'a>>) {
    let tasks: Vec<(&Entry, &Entry)> = singles
        .iter()
        .take(FIRSTS)
        .flat_map(|first| {
            let others = singles.iter();
            let others = others.filter(|second| first.groups() != second.groups());
            others.map(|second| (*first, *second))
        })
        .collect();
    let promise = |(first, second): &(&Entry, &Entry)| {
        let search = Search {
            frame,
            settings,
            without: &first.fit,
        };
        let candidate = *second.fit.effects.first()?;
        Some((search.objective_without()?, search.promise(candidate)?))
    };
    let promises: Vec<Option<(f64, f64)>> = tasks.par_iter().map(promise).collect();
    let alone = promises.iter().flatten().map(|promise| promise.0);
    let alone = alone.fold(f64::INFINITY, f64::min);
    let of = |k: usize| promises[k].map_or(f64::INFINITY, |promise| promise.1);
    let mut order: Vec<usize> = (0..tasks.len())
        .filter(|&k| of(k) < alone - needed)
        .collect();
    order.sort_by(|&a, &b| of(a).total_cmp(&of(b)));
    order.truncate(EARNEST);
    let chosen = order
        .into_iter()
        .map(|k| (tasks[k].0, tasks[k].1, Vec::new()));
    (tasks.len(), chosen.collect())
}

/// How many pairs are looked at again with finer readings, each from so many optima.
const FINER: usize = 12;
const OPTIMA: usize = 3;

/// How many promising pairs are fitted beside those that were found from afar.
const BESIDE: usize = 2;

/// Of all pairs those that explain the frequencies best, which count at first as uncertain as the best single
/// effect leaves them unexplained; and how many were asked.
fn from_afar<'a>(
    (frame, settings): (&Frame, &GapSettings),
    singles: &[&'a Entry],
) -> (usize, Vec<Task<'a>>) {
    let left = singles.iter().map(|one| unexplained(frame, &one.fit));
    let factor = left.fold(f64::INFINITY, f64::min);
    let rough = Rough::new(frame, settings, factor);
    let candidate = |one: &Entry| one.fit.effects[0];
    let alone: Vec<Option<Start>> = singles
        .par_iter()
        .map(|one| rough.alone(candidate(one)).into_iter().next())
        .collect();
    let of = |k: usize| (0..=k).map(move |first| (first, k));
    let all: Vec<(usize, usize)> = (0..singles.len())
        .flat_map(of)
        .filter(|&(a, b)| match a == b {
            true => is_local(&candidate(singles[a])),
            false => singles[a].groups() != singles[b].groups(),
        })
        .collect();
    let sorted = |mut starts: Vec<Start>| {
        starts.sort_by(|a, b| a.objective.total_cmp(&b.objective));
        starts.dedup_by(|one, better| one.is_like(better));
        starts.truncate(OPTIMA);
        starts
    };
    let both = |&(a, b): &(usize, usize)| {
        let after = |first: usize, second: usize| {
            let (first, second) = (&alone[first], candidate(singles[second]));
            let beside = |first| rough.beside(first, second);
            first.as_ref().map_or_else(Vec::new, beside)
        };
        let starts = sorted([after(a, b), after(b, a)].concat());
        (singles[a], singles[b], starts)
    };
    let best = |mut found: Vec<Task<'a>>, count: usize| {
        let misfit = |task: &Task<'a>| task.2.first().map_or(f64::INFINITY, |one| one.objective);
        found.sort_by(|a, b| misfit(a).total_cmp(&misfit(b)));
        found.truncate(count);
        found
    };
    let found: Vec<Task<'a>> = all.par_iter().map(both).collect();
    let finer = Rough::new(frame, settings, factor.sqrt());
    let again = |(first, second, starts): &Task<'a>| {
        let starts = starts.iter().filter_map(|start| finer.go_on(start));
        (*first, *second, sorted(starts.collect()))
    };
    let found = best(found, FINER).par_iter().map(again).collect();
    // Two of a kind are no name, but what is unknown may look like them.
    let (alike, others): (Vec<Task<'a>>, Vec<Task<'a>>) = best(found, FINER)
        .into_iter()
        .partition(|task| task.0.effects() == task.1.effects());
    let others = best(others, EARNEST);
    (all.len(), [others, best(alike, 1)].concat())
}

/// A second effect beside a first one, if it is believed: it has to beat the better of the two by
/// themselves in evidence, and hold on readings that took no part.
fn pair(frame: &Frame, settings: &GapSettings, (first, second, afar): &Task<'_>) -> Option<Entry> {
    let search = Search {
        frame,
        settings,
        without: &first.fit,
    };
    let objective = |fit: &Fit| fit.branch.optimum.objective;
    let candidate = *second.fit.effects.first()?;
    let more = |a: &Fit, b: &Fit| a.log_evidence.total_cmp(&b.log_evidence);
    let fit = if afar.is_empty() {
        let near = [search.add(candidate), search.add_from(&second.fit)];
        near.into_iter().flatten().max_by(more)
    } else {
        let settled = afar.iter().filter_map(|start| {
            let is_first = first.effects() == [start.first()];
            let without = if is_first { &first.fit } else { &second.fit };
            Search { without, ..search }.settle(std::slice::from_ref(start))
        });
        settled.max_by(more)
    }?;
    let alone = if first.fit.log_evidence > second.fit.log_evidence {
        &first.fit
    } else {
        &second.fit
    };
    // What explains less than one of its members has not reached its optimum.
    if objective(&fit) > objective(&first.fit).min(objective(&second.fit))
        || fit.log_evidence < alone.log_evidence + SECOND
        || !improves(frame, alone, &fit)
    {
        return None;
    }
    let effects = fit.effects.iter().map(|one| one.effect).collect();
    Some(Entry::new(Hypothesis::Effects(effects), fit))
}

/// Of the same two effects in either order, the more probable.
fn distinct(found: Vec<Entry>) -> Vec<Entry> {
    let mut pairs: Vec<Entry> = Vec::new();
    for pair in found {
        let reversed: Vec<EffectId> = pair.effects().iter().rev().copied().collect();
        let same = |other: &Entry| [pair.effects(), &reversed[..]].contains(&other.effects());
        match pairs.iter_mut().find(|other| same(other)) {
            Some(other) if other.fit.log_evidence < pair.fit.log_evidence => *other = pair,
            Some(_) => {}
            None => pairs.push(pair),
        }
    }
    pairs
}

/// Whether neither the readings refute a fit nor those that took no part.
pub(super) fn stands(frame: &Frame, fit: &Fit) -> bool {
    let trial = Trial::new(frame, fit).map(|trial| trial.with_withheld(frame, fit));
    trial.is_some_and(|trial| !trial.refuted())
}

/// Whether the readings that took no part are predicted better, or at least do not refute the fit: two effects leave
/// more open than one does. Where that cannot be said, whether each mode is predicted better from the others.
fn improves(frame: &Frame, before: &Fit, after: &Fit) -> bool {
    let foretold = || withheld::goodness(frame, after, refutes_withheld);
    match (
        WithheldErrors::new(frame, before),
        WithheldErrors::new(frame, after),
    ) {
        (Some(before), Some(after)) => {
            after.rms() < before.rms() || foretold().is_some_and(|p| !refutes_withheld(p))
        }
        _ => {
            let left_out =
                |fit: &Fit| Residuals::new(frame, fit).and_then(|r| r.left_out_rms(frame));
            match (left_out(before), left_out(after)) {
                (Some(before), Some(after)) => after < before,
                _ => false,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::fitted;
    use super::*;

    /// Two effects that chance did not favour: where they miss the withheld readings by more than these can be off,
    /// what is unknown explains the others as well.
    #[test]
    fn regress_two_effects_that_foretell_badly_are_as_good_as_something_unknown() {
        let (mut frame, fit) = fitted();
        let exact = WithheldErrors::new(&frame, &fit).unwrap();
        assert!(foretells(&frame, &fit), "{exact:?}");
        let unknown_beside = |frame: &Frame| {
            let pair = vec![EffectId::CrossCoupling, EffectId::SensorMass];
            let mut entries = vec![
                Entry::new(Hypothesis::Effects(pair), fit.clone()),
                Entry::new(Hypothesis::Unknown, fit.clone()),
            ];
            entries[1].fit.log_evidence -= 50.0;
            spread_over_the_beam(frame, &mut entries);
            entries[1].fit.log_evidence - fit.log_evidence
        };
        assert_eq!(unknown_beside(&frame), -50.0);
        for (_, reading) in &mut frame.withheld {
            reading.value += 2.0 * MISSED * reading.std;
        }
        assert_eq!(unknown_beside(&frame), 0.0);
    }
}
