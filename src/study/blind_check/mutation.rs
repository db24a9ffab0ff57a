//! Checks of the check: answers that cannot know must score as if they did not know.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::case::{Answer, Class, Truth, Verdict};
use super::score::Case;
use crate::effects::EffectId;

/// The same answers, dealt out to other cases: what is left is what guessing earns.
pub fn shuffled(cases: &[Case], seed: u64) -> Vec<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..cases.len()).collect();
    order.shuffle(&mut random);
    let with = |((truth, _), from): (&Case, &usize)| (truth.clone(), cases[*from].1.clone());
    cases.iter().zip(&order).map(with).collect()
}

/// What somebody would score who always answers with one common factor on all frequencies.
pub fn always_scale(cases: &[Case]) -> Vec<Case> {
    let answer = Answer {
        verdict: Verdict::Named,
        effects: vec![EffectId::Modulus],
        classes: [(Class::Group(EffectId::Modulus.group()), 1.0)].into(),
        places: vec![(Some(EffectId::Modulus.place()), 1.0)],
        parameters: Vec::new(),
        closure: None,
    };
    let with = |(truth, _): &(Truth, Answer)| (truth.clone(), answer.clone());
    cases.iter().map(with).collect()
}
