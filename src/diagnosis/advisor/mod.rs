//! Which test to make next: the one that is expected to tell most, per cost, about which hypothesis is
//! true.
//!
//! Every hypothesis that is still in the running predicts each possible test from its optimum and from what
//! the readings leave open of its parameters; the further apart these predictions lie, in standard
//! deviations of what would be read, the more the test decides. Tests that keep the joint untouched gain
//! by comparison with what is at hand; all planned visits have a drift of the joint of their own.

mod accuracy;
mod confirm;
mod direct;
mod information;
mod outlooks;
mod proposals;
mod step;

pub(super) use proposals::MORE_MODES;
pub use step::{NextTest, Step};

use super::posterior::Entry;
use super::result::Verdict;
use super::search::Competition;
use super::settings::GapSettings;
use direct::direct;
use information::{Outlook, distances, information};
use nalgebra::DMatrix;
use outlooks::{Expected, State};
use proposals::{Proposal, Proposals, Readings, Structure, beam_mass};
use rayon::prelude::*;
use tapjoint_beam::effects::EffectId;

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

/// Tests that would tell more, those first that tell most per cost; and last how a cause that was named can be seen
/// directly, where none of these shows it as well.
pub(super) fn advise(
    competition: &Competition,
    verdict: &Verdict,
    settings: &GapSettings,
) -> Vec<NextTest> {
    let mut advised = telling(competition, verdict, settings);
    if let Verdict::Named(effects) = verdict {
        advised.truncate(ADVISED - effects.len());
        for confirming in effects.iter().map(|effect| confirmation(*effect)) {
            let is_new = advised.iter().all(|test| test.action != confirming.action);
            advised.extend(is_new.then_some(confirming));
        }
    }
    advised
}

/// What shows directly whether a named cause is there: it tells nothing that the readings have not told already.
fn confirmation(effect: EffectId) -> NextTest {
    let step = Step::Confirm { effect };
    NextTest {
        action: step.sentence(),
        effort: step.effort(),
        step,
        separates: vec![effect.name().to_owned()],
        unpredicted: Vec::new(),
        bits: 0.0,
    }
}

/// Tests that tell hypotheses apart, those first that tell most per cost.
fn telling(competition: &Competition, verdict: &Verdict, settings: &GapSettings) -> Vec<NextTest> {
    let frame = &competition.frame;
    let weight = GRAVITY * beam_mass(frame);
    let runners = in_the_running(&competition.entries, verdict);
    if runners.len() < 2 {
        return Vec::new();
    }
    let runners = Runners::new(&runners);
    let states = runners.entries.iter();
    let states: Vec<Option<State>> = states
        .map(|entry| State::new(frame, entry, weight))
        .collect();
    let planned = Proposals::new(frame, settings);
    let seen: Vec<Option<Seen>> = states
        .par_iter()
        .map(|state| Some(Seen::new(state.as_ref()?, &planned)))
        .collect();
    let judged = planned.all.iter().enumerate().filter_map(|(k, proposal)| {
        let outlook = |(state, seen): (&Option<State>, &Option<Seen>)| match &proposal.readings {
            Readings::Direct => direct(state.as_ref()?, frame, &proposal.step),
            Readings::Frequencies(..) => seen.as_ref()?.outlook(&planned, k),
        };
        runners.judge(&proposal.step, states.iter().zip(&seen).map(outlook))
    });
    ranked(judged.collect())
}

/// The hypotheses that are weighed.
struct Runners<'a> {
    entries: Vec<&'a Entry>,
    names: Vec<String>,
    /// Their probabilities, which sum to 1.
    probabilities: Vec<f64>,
}

impl<'a> Runners<'a> {
    fn new(runners: &[(f64, &'a Entry)]) -> Self {
        let total: f64 = runners.iter().map(|(p, _)| p).sum();
        let entries: Vec<&Entry> = runners.iter().map(|(_, entry)| *entry).collect();
        Runners {
            names: entries
                .iter()
                .map(|entry| entry.hypothesis.name())
                .collect(),
            probabilities: runners.iter().map(|(p, _)| p / total).collect(),
            entries,
        }
    }

    /// What a test tells, from what each hypothesis expects of it.
    fn judge(
        &self,
        step: &Step,
        outlooks: impl Iterator<Item = Option<Outlook>>,
    ) -> Option<NextTest> {
        let told = told((&self.names, &self.probabilities), outlooks.collect())?;
        Some(NextTest {
            step: step.clone(),
            action: step.sentence(),
            effort: step.effort(),
            separates: told.separates,
            unpredicted: told.unpredicted,
            bits: told.bits,
        })
    }
}

/// What a test tells of which hypotheses.
struct Told {
    separates: Vec<String>,
    unpredicted: Vec<String>,
    bits: f64,
}

/// Information about which of the hypotheses that could be predicted is true. They hold the share P of all
/// probability: knowing whether the truth is among them cannot hurt, so that all hypotheses together are told
/// apart by P times that at least. `None` where fewer than two could be predicted.
fn told(
    (names, probabilities): (&[String], &[f64]),
    outlooks: Vec<Option<Outlook>>,
) -> Option<Told> {
    let missing = |k: &usize| outlooks[*k].is_none();
    let (without, with): (Vec<usize>, Vec<usize>) = (0..names.len()).partition(missing);
    let name = |k: &usize| names[*k].clone();
    let (unpredicted, names): (Vec<String>, Vec<String>) = (
        without.iter().map(name).collect(),
        with.iter().map(name).collect(),
    );
    let share: f64 = with.iter().map(|k| probabilities[*k]).sum();
    let probabilities: Vec<f64> = with.iter().map(|k| probabilities[*k] / share).collect();
    let outlooks: Vec<Outlook> = outlooks.into_iter().flatten().collect();
    if outlooks.len() < 2 {
        return None;
    }
    let apart = distances(&outlooks)?;
    Some(Told {
        separates: separated(&probabilities, &names, &apart),
        unpredicted,
        bits: share * information(&probabilities, &apart),
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    const NAMES: [&str; 3] = ["none", "sensor-mass", "modulus"];

    fn outlook(mean: f64) -> Option<Outlook> {
        Some(Outlook {
            mean: DVector::from_element(1, mean),
            spread: DMatrix::identity(1, 1),
        })
    }

    fn told_of(outlooks: [Option<Outlook>; 3]) -> Option<Told> {
        let names = NAMES.map(str::to_owned);
        told((&names, &[0.5, 0.25, 0.25]), outlooks.to_vec())
    }

    #[test]
    fn regress_a_hypothesis_that_cannot_be_predicted_is_said_and_the_others_are_told_apart() {
        let all = told_of([outlook(0.0), outlook(100.0), outlook(-100.0)]).unwrap();
        assert!(all.unpredicted.is_empty());
        // Three that lie far apart: the whole entropy of 1/2, 1/4, 1/4.
        assert!((all.bits - 1.5).abs() < 1e-9, "{}", all.bits);
        let two = told_of([outlook(0.0), outlook(100.0), None]).unwrap();
        assert_eq!(two.unpredicted, ["modulus"]);
        assert_eq!(two.separates, ["none", "sensor-mass"]);
        // Three quarters of the entropy of 2/3 and 1/3.
        let entropy =
            -(2.0 / 3.0_f64) * (2.0 / 3.0_f64).log2() - (1.0 / 3.0_f64) * (1.0 / 3.0_f64).log2();
        assert!((two.bits - 0.75 * entropy).abs() < 1e-9, "{}", two.bits);
        assert!(two.bits < all.bits);
    }

    #[test]
    fn limit_of_one_hypothesis_alone_nothing_is_told() {
        assert!(told_of([outlook(0.0), None, None]).is_none());
        assert!(told_of([None, None, None]).is_none());
    }
}
