//! Which test to make next: the one that is expected to tell most, per cost, about which hypothesis is
//! true.
//!
//! Every hypothesis that is still in the running predicts each possible test from its optimum and from what
//! the readings leave open of its parameters; the further apart these predictions lie, in standard
//! deviations of what would be read, the more the test decides. Tests that keep the joint untouched gain
//! by comparison with what is at hand; all planned visits have a drift of the joint of their own.

mod direct;
mod information;
mod outlooks;
mod proposals;
mod step;

pub use step::{NextTest, Step};

use super::posterior::Entry;
use super::result::Verdict;
use super::search::Competition;
use direct::direct;
use information::{Outlook, distances, information};
use nalgebra::DMatrix;
use outlooks::{Expected, State};
use proposals::{Proposal, Proposals, Readings, Structure, beam_mass};
use rayon::prelude::*;

/// Hypotheses less probable than this are not weighed.
const LEAST_PROBABILITY: f64 = 0.003;
/// At most so many are.
const MOST: usize = 12;
/// Tests that bring less (bit) are not worth the walk.
const LEAST_BITS: f64 = 0.005;
/// At most so many tests are advised.
const ADVISED: usize = 6;
/// Pairs that contribute this share of what a test tells are named.
const NAMED_SHARE: f64 = 0.8;
/// At most so many hypotheses are named.
const NAMED: usize = 4;
/// Standard gravity (m/s2).
const GRAVITY: f64 = 9.80665;

/// Tests that would tell more, those first that tell most per cost.
pub(super) fn advise(competition: &Competition, verdict: &Verdict) -> Vec<NextTest> {
    let frame = &competition.frame;
    let weight = GRAVITY * beam_mass(frame);
    let runners = in_the_running(&competition.entries, verdict);
    let known: Vec<(f64, &Entry, State)> = runners
        .into_iter()
        .filter_map(|(p, entry)| Some((p, entry, State::new(frame, entry, weight)?)))
        .collect();
    if known.len() < 2 {
        return Vec::new();
    }
    let total: f64 = known.iter().map(|(p, ..)| p).sum();
    let probabilities: Vec<f64> = known.iter().map(|(p, ..)| p / total).collect();
    let names: Vec<String> = known
        .iter()
        .map(|(_, entry, _)| entry.hypothesis.name())
        .collect();
    let planned = Proposals::new(frame);
    let seen: Vec<Seen> = known
        .par_iter()
        .map(|(.., state)| Seen::new(state, &planned))
        .collect();
    let judged = planned.all.iter().enumerate().filter_map(|(k, proposal)| {
        let outlooks =
            known
                .iter()
                .zip(&seen)
                .map(|((.., state), seen)| match &proposal.readings {
                    Readings::Direct => direct(state, frame, &proposal.step),
                    Readings::Frequencies(..) => seen.outlook(&planned, k),
                });
        let apart = distances(&outlooks.collect::<Option<Vec<Outlook>>>()?)?;
        Some(NextTest {
            step: proposal.step.clone(),
            action: proposal.step.sentence(),
            separates: separated(&probabilities, &names, &apart),
            bits: information(&probabilities, &apart),
        })
    });
    ranked(judged.collect())
}

/// The hypotheses that are weighed, with their probabilities. Where nothing explains the readings, their
/// ranking says little: all of them count alike.
fn in_the_running<'a>(entries: &'a [Entry], verdict: &Verdict) -> Vec<(f64, &'a Entry)> {
    let likely = entries
        .iter()
        .enumerate()
        .filter(|(k, entry)| *k < MOST && entry.probability > LEAST_PROBABILITY);
    if *verdict == Verdict::Unknown {
        let first = entries.iter().take(MOST).map(|entry| (1.0, entry));
        return first.collect();
    }
    likely
        .map(|(_, entry)| (entry.probability, entry))
        .collect()
}

/// Of each kind of test the best one, the most telling per cost first.
fn ranked(mut judged: Vec<NextTest>) -> Vec<NextTest> {
    judged.retain(|test| test.bits >= LEAST_BITS);
    judged.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
    let mut advised: Vec<NextTest> = Vec::new();
    for test in judged {
        if advised
            .iter()
            .all(|other| other.step.id() != test.step.id())
        {
            advised.push(test);
        }
    }
    advised.truncate(ADVISED);
    advised
}

/// The hypotheses that a test tells apart: members of the pairs that contribute most.
fn separated(probabilities: &[f64], names: &[String], apart: &DMatrix<f64>) -> Vec<String> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for i in 0..names.len() {
        for j in 0..i {
            let gain = probabilities[i] * probabilities[j] * (1.0 - (-apart[(i, j)]).exp());
            pairs.push((gain, j, i));
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let total: f64 = pairs.iter().map(|pair| pair.0).sum();
    let mut held = 0.0;
    let mut separated: Vec<String> = Vec::new();
    for (gain, i, j) in pairs {
        if held >= NAMED_SHARE * total || separated.len() >= NAMED {
            break;
        }
        held += gain;
        for name in [&names[i], &names[j]] {
            if !separated.contains(name) && separated.len() < NAMED {
                separated.push(name.clone());
            }
        }
    }
    separated
}

/// What one hypothesis expects of all planned frequencies.
struct Seen {
    whole: Option<Expected>,
    unbiased: Option<Expected>,
    bare: Option<Expected>,
}

impl Seen {
    fn new(state: &State, planned: &Proposals) -> Self {
        let of = |wanted: Structure| {
            let rows: Vec<_> = planned
                .all
                .iter()
                .flat_map(|one| rows_of(one, wanted).iter().copied())
                .collect();
            if rows.is_empty() {
                return None;
            }
            state.expect(planned, wanted, &rows)
        };
        Seen {
            whole: of(Structure::Whole),
            unbiased: of(Structure::Unbiased),
            bare: of(Structure::Bare),
        }
    }

    /// What it expects of the k-th proposal.
    fn outlook(&self, planned: &Proposals, k: usize) -> Option<Outlook> {
        let Readings::Frequencies(structure, rows) = &planned.all[k].readings else {
            return None;
        };
        let expected = match structure {
            Structure::Whole => &self.whole,
            Structure::Unbiased => &self.unbiased,
            Structure::Bare => &self.bare,
        };
        let before = planned.all[..k].iter();
        let from = before.map(|one| rows_of(one, *structure).len()).sum();
        let stds: Vec<f64> = rows.iter().map(|(_, std)| *std).collect();
        Some(expected.as_ref()?.outlook(from, &stds))
    }
}

/// Rows of a proposal that are of this structure.
fn rows_of(proposal: &Proposal, wanted: Structure) -> &[(super::frame::Row, f64)] {
    match &proposal.readings {
        Readings::Frequencies(structure, rows) if *structure == wanted => rows,
        _ => &[],
    }
}
