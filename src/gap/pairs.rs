//! Two effects at once, where no single one suffices.

use super::catalogue::{Candidate, PlaceKind};
use super::frame::Frame;
use super::hypothesis::{Fit, Search};
use super::posterior::{Entry, set_probabilities};
use super::quality::Residuals;
use super::result::Hypothesis;
use super::search::Competition;
use super::settings::GapSettings;
use super::trial::Trial;
use rayon::prelude::*;

/// How many of the best single effects a second one is put beside.
const FIRSTS: usize = 2;
/// Logarithm of the Bayes factor from which a second effect is believed.
const SECOND: f64 = 5.0;

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
            && !misfits(frame, &entry.fit)
    };
    let seen = |entry: &Entry| entry.hypothesis != Hypothesis::None;
    if frame.rows.len() < 6 || !competition.entries.first().is_some_and(seen) {
        return;
    }
    let needed = if competition.entries.iter().any(suffices) {
        PROMISED
    } else {
        f64::NEG_INFINITY
    };
    let singles: Vec<&Entry> = competition
        .entries
        .iter()
        .filter(|entry| entry.effects().len() == 1 && entry.drift.is_none())
        .collect();
    let tasks: Vec<(&Entry, &Entry)> = singles
        .iter()
        .take(FIRSTS)
        .flat_map(|first| {
            singles
                .iter()
                .filter(|second| first.groups() != second.groups())
                .map(|second| (*first, *second))
        })
        .collect();
    let found: Vec<Option<Entry>> = promising((frame, settings), &tasks, needed)
        .par_iter()
        .map(|(first, second)| pair(frame, settings, (first, second)))
        .collect();
    let pairs = distinct(found.into_iter().flatten().collect());
    let tried = tasks.len();
    competition.entries.extend(pairs);
    spread_over_the_beam(&mut competition.entries);
    set_probabilities(&mut competition.entries, tried);
}

/// What is unknown may be spread over a part of the beam. Two changes at places of their own imitate every
/// such change, with as many parameters as its place, extent, mass and stiffness: it explains what they
/// explain, and from these readings nobody can tell which it was.
fn spread_over_the_beam(entries: &mut [Entry]) {
    let is_local = |candidate: &Candidate| {
        let place = candidate.place.as_ref();
        place.is_some_and(|place| place.kind == PlaceKind::Position)
    };
    let most = entries
        .iter()
        .filter(|entry| entry.effects().len() > 1 && entry.fit.effects.iter().all(is_local))
        .map(|entry| entry.fit.log_evidence)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut all = entries.iter_mut();
    if let Some(unknown) = all.find(|entry| entry.hypothesis == Hypothesis::Unknown) {
        unknown.fit.log_evidence = unknown.fit.log_evidence.max(most);
    }
}

/// How many pairs are fitted in earnest.
const EARNEST: usize = 4;

/// The pairs whose linearised models explain the readings best, and better than the best single one by what
/// is needed.
fn promising<'a>(
    (frame, settings): (&Frame, &GapSettings),
    tasks: &[(&'a Entry, &'a Entry)],
    needed: f64,
) -> Vec<(&'a Entry, &'a Entry)> {
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
    order.into_iter().map(|k| tasks[k]).collect()
}

/// A second effect beside a first one, if it is believed: it has to beat the better of the two by
/// themselves, in evidence and on readings that took no part.
fn pair(frame: &Frame, settings: &GapSettings, (first, second): (&Entry, &Entry)) -> Option<Entry> {
    let search = Search {
        frame,
        settings,
        without: &first.fit,
    };
    let objective = |fit: &Fit| fit.branch.optimum.objective;
    let candidate = *second.fit.effects.first()?;
    let fit = [search.add(candidate), search.add_from(&second.fit)]
        .into_iter()
        .flatten()
        .min_by(|a, b| objective(a).total_cmp(&objective(b)))?;
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
    let effects = vec![first.effects()[0], second.effects()[0]];
    Some(Entry::new(Hypothesis::Effects(effects), fit))
}

/// Of the same two effects in either order, the more probable.
fn distinct(found: Vec<Entry>) -> Vec<Entry> {
    let mut pairs: Vec<Entry> = Vec::new();
    for pair in found {
        let same = |other: &Entry| {
            other
                .effects()
                .iter()
                .all(|effect| pair.effects().contains(effect))
        };
        match pairs.iter_mut().find(|other| same(other)) {
            Some(other) if other.fit.log_evidence < pair.fit.log_evidence => *other = pair,
            Some(_) => {}
            None => pairs.push(pair),
        }
    }
    pairs
}

/// Whether the readings refute a fit.
fn misfits(frame: &Frame, fit: &Fit) -> bool {
    Trial::new(frame, fit).is_none_or(|trial| trial.refuted())
}

/// Whether the readings that took no part, or each mode from the others, are predicted better.
fn improves(frame: &Frame, before: &Fit, after: &Fit) -> bool {
    use super::withheld::WithheldErrors;
    match (
        WithheldErrors::new(frame, before),
        WithheldErrors::new(frame, after),
    ) {
        (Some(before), Some(after)) => {
            after.rms() < before.rms() || after.rms() < 1.5 * after.floor()
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
