//! What the diagnosis says, as plain data.

use super::advisor::NextTest;
use super::decay_finding::DecayFinding;
use super::unplaced::Unplaced;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use tapjoint_beam::effects::{Effect, EffectId, Group, Place};

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// In one word, and which effects.
    pub verdict: Verdict,
    /// Where the gap lies.
    pub places: PlaceProbabilities,
    /// Every frequency's error, before and after the best hypothesis.
    pub pulls: Vec<Pull>,
    /// Goodness of fit of each block under the best hypothesis, the worst first.
    pub blocks: Vec<Block>,
    /// All hypotheses, the most probable first.
    pub hypotheses: Vec<HypothesisResult>,
    /// Root mean square of the standard uncertainties of the fitted frequencies (%).
    pub noise_floor: f64,
    /// Goodness of fit of the best hypothesis that has a name or none.
    pub goodness_of_fit: Option<f64>,
    /// What that rests on; `None` without a fit.
    pub misfit: Option<Misfit>,
    /// What adding the best hypothesis does to the joint; nothing where no effect is answered.
    pub joint_shift: JointShift,
    /// What the residual of the nominal model calls for along the beam; `None` where the readings are
    /// too few.
    pub map: Option<PlaceMap>,
    /// How certain it is that this was decided by the readings and not by the priors.
    pub decided_by: DecidedBy,
    /// What the decays by themselves say of a joint whose stiffness depends on the amplitude; `None` where
    /// no frequency changes along them.
    pub along_decays: Option<DecayFinding>,
    /// Modes above this number took no part in the fit.
    pub fitted_modes: usize,
    /// What the described model is worth without sensors that weigh and sat nobody knows where; `None` where
    /// every place is known.
    pub unplaced: Option<Unplaced>,
    /// Tests that would tell more, those first that tell most per cost.
    pub next_tests: Vec<NextTest>,
}

/// The kind of answer.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[serde(into = "WrittenVerdict")]
pub enum Verdict {
    /// The nominal model explains the readings within their uncertainty.
    #[default]
    NoGap,
    /// One effect, or two where both are needed.
    Named(Vec<EffectId>),
    /// Effects that these readings cannot tell apart.
    Group(Vec<EffectId>),
    /// A short list that holds 90 %.
    Set(Vec<Hypothesis>),
    /// Something is there that nothing in the catalogue explains.
    Unknown,
    /// The readings cannot decide.
    NotEnoughData(String),
}

impl Verdict {
    /// As reports and scripts call it.
    pub fn kind(&self) -> &'static str {
        match self {
            Verdict::NoGap => "no-gap",
            Verdict::Named(_) => "named",
            Verdict::Group(_) => "group",
            Verdict::Set(_) => "set",
            Verdict::Unknown => "unknown",
            Verdict::NotEnoughData(_) => "not-enough-data",
        }
    }

    /// The hypotheses among which the cause is: one, both effects of which are needed, or several.
    pub fn hypotheses(&self) -> Vec<Hypothesis> {
        match self {
            Verdict::Named(effects) => vec![Hypothesis::Effects(effects.clone())],
            Verdict::Group(effects) => {
                let single = |effect: &EffectId| Hypothesis::Effects(vec![*effect]);
                effects.iter().map(single).collect()
            }
            Verdict::Set(list) => list.clone(),
            Verdict::NoGap | Verdict::Unknown | Verdict::NotEnoughData(_) => Vec::new(),
        }
    }
}

/// A verdict as `report.json` has it.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Verdict")]
struct WrittenVerdict {
    /// "no-gap", "named", "group", "set", "unknown" or "not-enough-data".
    kind: &'static str,
    /// The effects it names.
    effects: Vec<String>,
    /// Why there is no answer; null where there is one.
    reason: Option<String>,
}

impl From<Verdict> for WrittenVerdict {
    fn from(verdict: Verdict) -> Self {
        let named = |effects: &[EffectId]| effects.iter().map(|id| id.name().to_owned()).collect();
        WrittenVerdict {
            kind: verdict.kind(),
            effects: match &verdict {
                Verdict::Named(effects) | Verdict::Group(effects) => named(effects),
                Verdict::Set(list) => list.iter().map(Hypothesis::name).collect(),
                _ => Vec::new(),
            },
            reason: match verdict {
                Verdict::NotEnoughData(reason) => Some(reason),
                _ => None,
            },
        }
    }
}

/// What was tested.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(into = "String")]
pub enum Hypothesis {
    /// Nothing is missing in the nominal model.
    #[default]
    None,
    /// One effect, or two.
    Effects(Vec<EffectId>),
    /// Something that no effect of the catalogue is.
    Unknown,
}

impl Hypothesis {
    /// As reports and scripts call it.
    pub fn name(&self) -> String {
        match self {
            Hypothesis::None => "none".to_string(),
            Hypothesis::Unknown => "unknown".to_string(),
            Hypothesis::Effects(effects) => {
                let names: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
                names.join("+")
            }
        }
    }
}

impl From<Hypothesis> for String {
    fn from(hypothesis: Hypothesis) -> String {
        hypothesis.name()
    }
}

/// One hypothesis in the ranking.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct HypothesisResult {
    /// Effect, "none", "unknown", or two effects joined by "+".
    #[serde(rename = "effect")]
    pub hypothesis: Hypothesis,
    /// Groups of its effects, joined by "+"; null of "none" and "unknown".
    #[serde(rename = "group", serialize_with = "joined_groups")]
    #[schemars(with = "Option<String>")]
    pub groups: Vec<Group>,
    /// Its probability (1).
    pub probability: f64,
    /// Logarithm of its evidence over that of `none`.
    pub log_bayes_factor: f64,
    /// Effects whose best fit predicts the same within what these readings resolve.
    pub confounded_with: Vec<EffectId>,
    /// Its parameters (SI), by name; of two effects "effect.name".
    #[serde(serialize_with = "by_name")]
    #[schemars(with = "BTreeMap<String, ParameterValue>")]
    pub parameters: Vec<ParameterValue>,
    /// Root mean square of the fitted frequencies' errors of the nominal model with one joint for all recordings (%).
    pub gap_before: f64,
    /// The same under this hypothesis; `None` of `unknown`, which predicts nothing.
    pub gap_after: Option<f64>,
    /// The same with each mode predicted from the others (%), this hypothesis.
    pub left_out_after: Option<f64>,
    /// Root mean square of the withheld frequencies' errors of the nominal model, its joint free to drift between
    /// recordings as under every hypothesis (%).
    pub withheld_before: Option<f64>,
    /// The same under this hypothesis.
    pub withheld_after: Option<f64>,
    /// What measurement uncertainty alone would leave of them (%).
    pub withheld_floor: Option<f64>,
    /// Share of the gap on withheld readings that the hypothesis closes; `None` where the gap is below
    /// two noise floors.
    pub closure: Option<Closure>,
    /// Each recording predicted from the others; `None` with fewer than three, and of hypotheses that are
    /// hardly probable.
    pub left_out_recordings: Option<LeftOutRecordings>,
    /// Goodness of fit.
    pub goodness_of_fit: Option<f64>,
    /// What that rests on.
    #[serde(skip)]
    pub misfit: Option<Misfit>,
    /// How much the joint moves when this is added.
    pub joint_shift: JointShift,
    /// The effects with their best values, to predict with.
    #[serde(skip)]
    pub effects: Vec<Effect>,
    /// The joint's stiffnesses that go with them (N/m, N m/rad); `None` without a joint.
    pub joint: Option<[f64; 2]>,
    /// 95 % intervals of these, from low to high (N/m, N m/rad); a stiffness that was not sought, or that nothing
    /// holds, has none.
    pub joint_intervals: [Option<[f64; 2]>; 2],
    /// The coupling of the joint's own model that goes with them (1), without the effects'.
    #[serde(skip)]
    pub coupling: f64,
    /// Logarithm of the common factor on all frequencies that goes with them, within the tolerance of the
    /// geometry (1).
    #[serde(skip)]
    pub scale: f64,
}

fn joined_groups<S: Serializer>(groups: &[Group], to: S) -> Result<S::Ok, S::Error> {
    let names: Vec<&str> = groups.iter().map(|group| group.name()).collect();
    (!names.is_empty()).then(|| names.join("+")).serialize(to)
}

fn by_name<S: Serializer>(parameters: &[ParameterValue], to: S) -> Result<S::Ok, S::Error> {
    let mut effects = parameters.iter().map(|one| one.effect);
    let first = effects.next();
    let alone = effects.all(|effect| Some(effect) == first);
    let key = |one: &ParameterValue| match alone {
        true => one.name.to_owned(),
        false => format!("{}.{}", one.effect.name(), one.name),
    };
    to.collect_map(
        parameters
            .iter()
            .map(|one| (key(one), one))
            .collect::<BTreeMap<_, _>>(),
    )
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ParameterValue {
    /// Of which effect.
    #[serde(skip)]
    pub effect: EffectId,
    /// Which one.
    #[serde(skip)]
    pub name: &'static str,
    /// Its value (SI).
    pub value: f64,
    /// Standard uncertainty; `None` where the readings do not bound it.
    pub std: Option<f64>,
    /// Smallest value that is found nine times out of ten at the 1 % level; sizes only.
    pub smallest_detectable: Option<f64>,
    /// Smallest value at which these readings would tell the effect from every other; `None` where
    /// none would, and of what is no size.
    pub smallest_isolable: Option<f64>,
}

/// Share of a gap that is closed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Closure {
    /// (before^2 - after^2)/(before^2 - floor^2).
    pub value: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Recordings predicted from all others, each in turn.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LeftOutRecordings {
    /// Root mean square of all their frequencies' errors under the nominal model (%).
    pub before: f64,
    /// The same under the hypothesis.
    pub after: f64,
    /// What uncertainty alone would leave (%).
    pub floor: f64,
    /// Share of the gap that is closed; `None` where the gap is below two floors.
    pub closure: Option<Closure>,
    /// Each of them.
    pub recordings: Vec<LeftOutRecording>,
}

/// A recording predicted from all others.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LeftOutRecording {
    /// Which.
    pub recording: String,
    /// Root mean square of its frequencies' errors under the nominal model (%).
    pub before: f64,
    /// The same under the hypothesis.
    pub after: f64,
    /// What uncertainty alone would leave (%).
    pub floor: f64,
}

/// Change of the joint's stiffnesses when the effect is added.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct JointShift {
    /// Translation (%); `None` where it is not sought.
    pub kx_percent: Option<f64>,
    /// Rotation (%).
    pub ky_percent: Option<f64>,
}

/// Where the gap lies, given that there is one; the six sum to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct PlaceProbabilities {
    /// Clocks and readings (1).
    pub acquisition: f64,
    /// The beam (1).
    pub body: f64,
    /// What the joint is fastened to (1).
    pub fixture: f64,
    /// The joint (1).
    pub joint: f64,
    /// The sensors (1).
    pub sensor: f64,
    /// Nowhere that the catalogue knows (1).
    pub unknown: f64,
}

impl PlaceProbabilities {
    /// Each place with its probability (1), the most probable first; `None` is a place unknown to the catalogue.
    pub fn ranked(&self) -> [(Option<Place>, f64); 6] {
        let mut places = [
            (Some(Place::Acquisition), self.acquisition),
            (Some(Place::Body), self.body),
            (Some(Place::Fixture), self.fixture),
            (Some(Place::Joint), self.joint),
            (Some(Place::Sensor), self.sensor),
            (None, self.unknown),
        ];
        places.sort_by(|a, b| b.1.total_cmp(&a.1));
        places
    }
}

/// A frequency's error.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Pull {
    /// The mode.
    pub mode: usize,
    /// File of the recording, or what else the readings are.
    pub recording: String,
    /// Amplitude of its taps over that of the hardest configuration (1); `None` where no force is known.
    pub level: Option<f64>,
    /// 100 (predicted - measured)/measured of the nominal model with its joint refitted (%).
    pub error_percent: f64,
    /// That over the standard uncertainty (1).
    pub z: f64,
    /// The same under the best hypothesis (%).
    pub error_percent_after: f64,
    /// That over the standard uncertainty (1).
    pub z_after: f64,
}

/// How far a fit misses the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Sum of the squared residuals in standard deviations, priors of the small unknowns included (1).
    pub chi_square: f64,
    /// Readings less parameters on which the priors have no hold.
    pub freedom: f64,
}

/// Readings that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// What they are.
    pub name: String,
    /// Probability of a misfit as large or larger.
    pub goodness_of_fit: f64,
}

/// Local change of stiffness and of mass that the residual of the nominal model calls for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct PlaceMap {
    /// Centres of the pieces of the beam (m).
    pub positions: Vec<f64>,
    /// Relative change of the bending stiffness of each piece (1), if stiffness alone changes.
    pub stiffness: Vec<f64>,
    /// Its standard uncertainty.
    pub stiffness_std: Vec<f64>,
    /// Relative change of the mass of each piece (1), if mass alone changes.
    pub mass: Vec<f64>,
    /// Its standard uncertainty.
    pub mass_std: Vec<f64>,
    /// Share of the misfit (1) that each piece would explain if its stiffness alone changed: it peaks where the
    /// cause sits, while changes of all pieces together share it out among look-alikes.
    pub stiffness_explains: Vec<f64>,
    /// Share of the misfit (1) that each piece would explain if its mass alone changed.
    pub mass_explains: Vec<f64>,
    /// Length over which a local change is smeared (m).
    pub resolution: f64,
}

/// What decided between the first hypothesis and the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DecidedBy {
    /// The readings: the likelihood ratio is 3 or more, or they refute what was more probable.
    Readings,
    /// The priors: the readings alone would leave both.
    Priors,
}
