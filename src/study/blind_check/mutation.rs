//! Checks of the check: answers that cannot know must score as if they did not know.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::case::{Answer, Class, Truth, Verdict};
use super::draw::Extent;
use super::score::{Case, score};
use tapjoint_beam::effects::EffectId;

/// How a check was conducted, and what answers earn that cannot know.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conduct {
    /// Recordings of each test; `None` of tests made elsewhere.
    pub extent: Option<Extent>,
    /// SHA-256 of the truths, printed before anything was diagnosed; `None` of tests made elsewhere.
    pub commitment: Option<String>,
    /// Share of first groups right by answers dealt out to other tests; `None` without a test of one effect.
    pub shuffled: Option<f64>,
    /// The same by always answering one common factor on all frequencies.
    pub always_scale: Option<f64>,
    /// Tests that were diagnosed again under other names of their files, with the same answer.
    pub renamed: usize,
}

impl Conduct {
    /// With what the answers earn once they are dealt out to other tests, and once they are all the same.
    pub fn mutated(self, cases: &[Case], seed: u64) -> Self {
        Conduct {
            shuffled: score(&shuffled(cases, seed)).top_1.value(),
            always_scale: score(&always_scale(cases)).top_1.value(),
            ..self
        }
    }
}

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
