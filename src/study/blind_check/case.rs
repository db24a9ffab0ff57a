//! The truth of a test and the answer of the diagnosis: all that the score sees.

use std::collections::BTreeMap;
use tapjoint_beam::effects::{Effect, EffectId, Group, Place};
use tapjoint_diagnosis::{Diagnosis, Hypothesis, Verdict};

/// The number of recordings of a drawn test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Five recordings: two sensors, one of them moved once; three tap positions; two levels; six
    /// modes.
    FiveRecordings,
    /// One recording with one sensor, five modes.
    OneRecording,
}

impl Extent {
    /// Modes in the band.
    pub(super) fn modes(self) -> usize {
        match self {
            Self::FiveRecordings => 6,
            Self::OneRecording => 5,
        }
    }
}

/// A case: the truth and the answer.
pub type Case = (Truth, Answer);

/// A class between which a diagnosis chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Nothing is missing.
    None,
    /// An effect of this group is missing.
    Group(Group),
    /// Something is missing that the catalogue does not know.
    Unknown,
}

impl Class {
    /// As in a table.
    pub fn name(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Group(group) => group.name(),
            Self::Unknown => "unknown",
        }
    }
}

/// One planted effect.
#[derive(Debug, Clone, PartialEq)]
pub enum Planted {
    /// An effect of the catalogue, with its parameters by name (SI).
    Catalogue(EffectId, BTreeMap<String, f64>),
    /// Something of a kind that the catalogue does not have.
    OutOfCatalogue(String),
}

impl Planted {
    /// Returns an effect of the catalogue with its parameters.
    pub(crate) fn of(effect: &Effect) -> Self {
        let values = effect.values();
        let values = values.map(|(info, value)| (info.name.to_owned(), value));
        Self::Catalogue(effect.id, values.collect())
    }
}

/// The truth of one test.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The test.
    pub name: String,
    /// Empty: nothing.
    pub effects: Vec<Planted>,
    /// True where readings of the usual uncertainty show that something is missing, of several effects each:
    /// see [`DrawnTest::with_limits`](super::DrawnTest::with_limits). `None` where it is not known.
    pub detectable: Option<bool>,
    /// True where such readings show that nothing in the catalogue explains them.
    pub refutable: Option<bool>,
    /// True if a planted common factor lies within the tolerances of the description: it counts as no effect. `None`
    /// without such a factor, or if unknown.
    pub within_tolerance: Option<bool>,
}

/// Kinds of cases, each with questions of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CaseKind {
    /// Nothing was planted.
    Null,
    /// One effect of the catalogue.
    Single(EffectId),
    /// Several effects of the catalogue.
    Several,
    /// Something outside the catalogue.
    OutOfCatalogue,
}

impl Truth {
    /// The planted effects that an answer has to find: all but a factor within the tolerances of the description.
    pub fn counted(&self) -> impl Iterator<Item = &Planted> {
        let covered = self.within_tolerance == Some(true);
        self.effects.iter().filter(move |planted| match planted {
            Planted::Catalogue(id, _) => !(covered && id.group() == Group::Scale),
            Planted::OutOfCatalogue(_) => true,
        })
    }

    /// The catalogue's effects that were planted.
    pub fn catalogue(&self) -> impl Iterator<Item = (EffectId, &BTreeMap<String, f64>)> {
        self.effects.iter().filter_map(|planted| match planted {
            Planted::Catalogue(id, values) => Some((*id, values)),
            Planted::OutOfCatalogue(_) => None,
        })
    }

    /// Returns the kind of case by the effects that count.
    pub fn kind(&self) -> CaseKind {
        let counted: Vec<&Planted> = self.counted().collect();
        match counted[..] {
            [] => CaseKind::Null,
            [Planted::Catalogue(id, _)] => CaseKind::Single(*id),
            _ if counted
                .iter()
                .any(|p| matches!(p, Planted::OutOfCatalogue(_))) =>
            {
                CaseKind::OutOfCatalogue
            }
            _ => CaseKind::Several,
        }
    }

    /// The class that is right; of several effects none alone is.
    pub fn class(&self) -> Option<Class> {
        match self.kind() {
            CaseKind::Null => Some(Class::None),
            CaseKind::Single(id) => Some(Class::Group(id.group())),
            CaseKind::OutOfCatalogue => Some(Class::Unknown),
            CaseKind::Several => None,
        }
    }
}

/// An estimated parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimatedParameter {
    /// The effect.
    pub effect: EffectId,
    /// Name of the parameter.
    pub name: String,
    /// Value (SI).
    pub value: f64,
    /// Stated standard uncertainty (SI); `None` where the data do not bound it.
    pub std: Option<f64>,
}

/// The answer of the diagnosis to one test; the default where it could not be diagnosed: no verdict and no
/// probabilities.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Answer {
    /// Verdict of the diagnosis; `None` where the test could not be analysed or diagnosed.
    pub verdict: Option<Verdict>,
    /// The effects that the verdict names.
    pub effects: Vec<EffectId>,
    /// Probability of each class, adding to 1.
    pub classes: BTreeMap<Class, f64>,
    /// Probability of each place; `None` is the place of what is unknown.
    pub places: Vec<(Option<Place>, f64)>,
    /// Estimated parameters of the named effects.
    pub parameters: Vec<EstimatedParameter>,
    /// Share (1) of the gap that closes on withheld data; `None` where it was too small to say.
    pub closure: Option<f64>,
}

impl Answer {
    /// Returns true where the verdict names one or more effects, or one group of effects that data like these do not
    /// separate.
    pub fn is_name(&self) -> bool {
        match self.verdict {
            Some(Verdict::Named(_)) => true,
            Some(Verdict::Group(_)) => self.named_groups().len() == 1,
            _ => false,
        }
    }

    /// Returns true where the verdict names effects, not a group.
    pub fn is_single_name(&self) -> bool {
        matches!(self.verdict, Some(Verdict::Named(_)))
    }

    /// Estimate of a parameter of an effect.
    pub fn estimate(&self, effect: EffectId, name: &str) -> Option<&EstimatedParameter> {
        let mut all = self.parameters.iter();
        all.find(|one| one.effect == effect && one.name == name)
    }

    /// Name of the verdict, as in the report; "no-answer" where there is none.
    pub fn verdict_name(&self) -> &'static str {
        self.verdict.as_ref().map_or("no-answer", Verdict::kind)
    }

    /// The most probable class, and its probability.
    pub fn first(&self) -> Option<(Class, f64)> {
        self.ranked().into_iter().next()
    }

    /// Returns the stated probability of a class.
    pub(super) fn stated(&self, class: Class) -> f64 {
        self.classes.get(&class).copied().unwrap_or(0.0)
    }

    /// All classes, the most probable first; equal ones in the catalogue's order.
    pub fn ranked(&self) -> Vec<(Class, f64)> {
        let mut ranked: Vec<(Class, f64)> = self.classes.iter().map(|(c, p)| (*c, *p)).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranked
    }

    /// The most probable effect groups, `none` and `unknown` left out.
    pub fn groups(&self) -> Vec<Group> {
        let ranked = self.ranked().into_iter();
        ranked
            .filter_map(|(class, _)| match class {
                Class::Group(group) => Some(group),
                Class::None | Class::Unknown => None,
            })
            .collect()
    }

    /// The smallest set of classes that holds `share` (1) of the probability.
    pub fn set(&self, share: f64) -> Vec<Class> {
        let mut held = 0.0;
        let mut set = Vec::new();
        for (class, probability) in self.ranked() {
            if held >= share {
                break;
            }
            held += probability;
            set.push(class);
        }
        set
    }

    /// The groups that the verdict names.
    pub fn named_groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = self.effects.iter().map(|id| id.group()).collect();
        groups.sort();
        groups.dedup();
        groups
    }

    /// Returns the answer that a diagnosis gives.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let effects = match &diagnosis.verdict {
            Verdict::Named(effects) | Verdict::Group(effects) => effects.clone(),
            Verdict::Set(list) => {
                let mut effects = Vec::new();
                for hypothesis in list {
                    if let Hypothesis::Effects(own) = hypothesis {
                        effects.extend_from_slice(own);
                    }
                }
                effects
            }
            Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData(_) => Vec::new(),
        };
        let named = diagnosis
            .hypotheses
            .iter()
            .find(|found| matches!(&found.hypothesis, Hypothesis::Effects(own) if *own == effects));
        let parameters = named.into_iter().flat_map(|found| &found.parameters);
        let p = &diagnosis.locations;
        Self {
            verdict: Some(diagnosis.verdict.clone()),
            classes: classes(diagnosis),
            places: vec![
                (Some(Place::Joint), p.joint),
                (Some(Place::Fixture), p.fixture),
                (Some(Place::Sensor), p.sensor),
                (Some(Place::Body), p.body),
                (Some(Place::Acquisition), p.acquisition),
                (None, p.unknown),
            ],
            parameters: parameters
                .map(|found| EstimatedParameter {
                    effect: found.effect,
                    name: found.name.to_owned(),
                    value: found.value,
                    std: found.std,
                })
                .collect(),
            closure: named.and_then(|found| Some(found.withheld_closure?.value)),
            effects,
        }
    }
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
