//! What the score needs of a diagnosis.

use std::collections::BTreeMap;

use super::case::{Answer, Class, Verdict};
use tapjoint_beam::effects::{EffectId, Place};
use tapjoint_diagnosis::{Diagnosis, Hypothesis, Verdict as Found};

impl Answer {
    /// Of a diagnosis.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let (verdict, effects) = match &diagnosis.verdict {
            Found::NoGap => (Verdict::NoGap, Vec::new()),
            Found::Named(effects) => (Verdict::Named, effects.clone()),
            Found::Group(effects) => (Verdict::Group, effects.clone()),
            Found::Set(list) => (Verdict::Set, listed(list)),
            Found::Unknown => (Verdict::Unknown, Vec::new()),
            Found::NotEnoughData(_) => (Verdict::NotEnoughData, Vec::new()),
        };
        let named = diagnosis
            .hypotheses
            .iter()
            .find(|found| matches!(&found.hypothesis, Hypothesis::Effects(own) if *own == effects));
        let parameters = named.map(|found| {
            let values = found.parameters.iter();
            values
                .map(|value| (value.effect, value.name.to_owned(), value.value))
                .collect()
        });
        Self {
            verdict,
            classes: classes(diagnosis),
            places: places(diagnosis),
            parameters: parameters.unwrap_or_default(),
            closure: named
                .and_then(|found| found.closure)
                .map(|closure| closure.value),
            effects,
        }
    }

    /// Of a test that could not be diagnosed: no verdict and no probabilities.
    pub fn none() -> Self {
        Self {
            verdict: Verdict::NoAnswer,
            effects: Vec::new(),
            classes: BTreeMap::new(),
            places: Vec::new(),
            parameters: Vec::new(),
            closure: None,
        }
    }
}

fn listed(list: &[Hypothesis]) -> Vec<EffectId> {
    let effects = list.iter().filter_map(|hypothesis| match hypothesis {
        Hypothesis::Effects(effects) => Some(effects.as_slice()),
        Hypothesis::None | Hypothesis::Unknown => None,
    });
    effects.flatten().copied().collect()
}

/// Probabilities by group. Hypotheses of two effects belong to no class; the rest is made to add to 1.
fn classes(diagnosis: &Diagnosis) -> BTreeMap<Class, f64> {
    let mut classes = BTreeMap::new();
    for found in &diagnosis.hypotheses {
        let class = match &found.hypothesis {
            Hypothesis::None => Class::None,
            Hypothesis::Unknown => Class::Unknown,
            Hypothesis::Effects(effects) => match effects[..] {
                [one] => Class::Group(one.group()),
                _ => continue,
            },
        };
        *classes.entry(class).or_insert(0.0) += found.probability;
    }
    let sum: f64 = classes.values().sum();
    if sum > 0.0 {
        classes.values_mut().for_each(|p| *p /= sum);
    }
    classes
}

fn places(diagnosis: &Diagnosis) -> Vec<(Option<Place>, f64)> {
    let p = &diagnosis.locations;
    vec![
        (Some(Place::Joint), p.joint),
        (Some(Place::Fixture), p.fixture),
        (Some(Place::Sensor), p.sensor),
        (Some(Place::Body), p.body),
        (Some(Place::Acquisition), p.acquisition),
        (None, p.unknown),
    ]
}
