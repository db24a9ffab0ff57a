//! The result of a diagnosis, as plain data.

use crate::thresholds::Thresholds;
use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use tapjoint_beam::Beam;
use tapjoint_beam::effects::{Effect, EffectId, Group, JointLaw, Place};

/// Answer of the diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// Kind of answer, and the effects that it names.
    pub verdict: Verdict,
    /// Probabilities of where the gap lies.
    pub locations: LocationProbabilities,
    /// Error of every frequency, before and after the best hypothesis.
    pub residuals: Vec<Residual>,
    /// Goodness of fit of each block under the best hypothesis, the worst first.
    pub blocks: Vec<Block>,
    /// All hypotheses, the most probable first.
    pub hypotheses: Vec<HypothesisResult>,
    /// Root mean square of the standard uncertainties of the fitted frequencies (%).
    pub noise_floor: f64,
    /// Goodness of fit of the best hypothesis other than `unknown`.
    pub goodness_of_fit: Option<f64>,
    /// Chi square and degrees of freedom of that goodness of fit; `None` without a fit.
    pub misfit: Option<Misfit>,
    /// Change of the joint by the best hypothesis; empty where no effect is named.
    pub joint_shift: JointShift,
    /// Changes along the beam that the residual of the nominal model calls for; `None` with too few data.
    pub location_map: Option<LocationMap>,
    /// Data or priors: what decided between the two best hypotheses.
    pub decided_by: DecidedBy,
    /// Joint whose stiffness depends on the amplitude, as the decays alone show it; `None` where no frequency
    /// changes along them.
    pub amplitude_dependence: Option<AmplitudeDependence>,
    /// Modes above this number took no part in the fit.
    pub fitted_modes: usize,
    /// Fit of the described model without sensors of unknown position; `None` where all positions are known.
    pub unlocated: Option<UnlocatedSensors>,
    /// Common factor that the frequencies ask for; `None` where they do not fix it.
    pub common_factor: Option<CommonFactor>,
    /// Least number of modes from which two are spared for the closure; `None` if two were spared.
    pub spare_modes_from: Option<usize>,
    /// Tests that would decide between the hypotheses, those with most information per cost first.
    pub next_tests: Vec<NextTest>,
}

/// Kind of answer.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[serde(into = "WrittenVerdict")]
pub enum Verdict {
    /// The nominal model explains the data within their uncertainty.
    #[default]
    NoGap,
    /// One effect, or two where both are needed.
    Named(Vec<EffectId>),
    /// Effects that these data cannot separate.
    Group(Vec<EffectId>),
    /// A short list that holds 90 %, or effects beside "none" where one mode may be read wrongly.
    Set(Vec<Hypothesis>),
    /// A gap that no effect of the catalogue explains.
    Unknown,
    /// The data cannot decide, with the reason.
    NotEnoughData(String),
}

impl Verdict {
    /// Name in reports and scripts.
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
                let effects = effects.iter();
                effects.map(|one| Hypothesis::Effects(vec![*one])).collect()
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
        WrittenVerdict {
            kind: verdict.kind(),
            effects: match &verdict {
                Verdict::Named(effects) | Verdict::Group(effects) => {
                    effects.iter().map(|one| one.name().to_owned()).collect()
                }
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

/// Explanation that is tested.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(into = "String")]
pub enum Hypothesis {
    /// The nominal model misses nothing.
    #[default]
    None,
    /// One effect, or two.
    Effects(Vec<EffectId>),
    /// Something outside the catalogue.
    Unknown,
}

impl Hypothesis {
    /// Name in reports and scripts.
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
    /// The hypothesis.
    #[serde(rename = "effect")]
    pub hypothesis: Hypothesis,
    /// Groups of its effects; empty for `none` and `unknown`.
    #[serde(rename = "group", serialize_with = "joined_groups")]
    #[schemars(with = "Option<String>")]
    pub groups: Vec<Group>,
    /// Probability (1).
    pub probability: f64,
    /// Logarithm of its evidence over that of `none`; `None` where `none` has no fit.
    pub log_bayes_factor: Option<f64>,
    /// Effects whose best fit predicts the same data within what the data resolve.
    pub confounded_with: Vec<EffectId>,
    /// Values of its parameters.
    #[serde(serialize_with = "by_name")]
    #[schemars(with = "BTreeMap<String, ParameterValue>")]
    pub parameters: Vec<ParameterValue>,
    /// Root mean square error of the fitted frequencies under the nominal model with one joint for all recordings (%);
    /// `None` where it predicts nothing.
    pub gap_before: Option<f64>,
    /// Root mean square error of the fitted frequencies under this hypothesis (%); `None` for `unknown`, which
    /// predicts nothing.
    pub gap_after: Option<f64>,
    /// Root mean square error under this hypothesis, each mode predicted from the others (%).
    #[serde(rename = "left_out_after")]
    pub left_out_modes: Option<f64>,
    /// Root mean square error of the hold-out frequencies under the nominal model, its joint free to drift between
    /// recordings as under every hypothesis (%).
    #[serde(rename = "withheld_before")]
    pub holdout_before: Option<f64>,
    /// Root mean square error of the hold-out frequencies under this hypothesis (%).
    #[serde(rename = "withheld_after")]
    pub holdout_after: Option<f64>,
    /// Root mean square error that the measurement uncertainty of the hold-out frequencies alone would leave (%).
    #[serde(rename = "withheld_floor")]
    pub holdout_floor: Option<f64>,
    /// Share of the gap on the withheld frequencies that the hypothesis closes. A name needs at least half of it where
    /// these can decide. Null where the gap is below two noise floors.
    pub withheld_closure: Option<Closure>,
    /// Root mean square error of the spared frequencies under the nominal model (%); null without spared frequencies.
    pub spare_before: Option<f64>,
    /// Root mean square error of the spared frequencies under this hypothesis (%); null without spared frequencies.
    pub spare_after: Option<f64>,
    /// Share of the gap on the spared frequencies that the hypothesis closes. They take part in nothing else. Null
    /// without them, or where the gap is below two noise floors.
    pub closure: Option<Closure>,
    /// Each recording predicted from the others; `None` with fewer than three, and for improbable hypotheses.
    #[serde(rename = "left_out_recordings")]
    pub cross_validation: Option<CrossValidation>,
    /// Goodness of fit.
    pub goodness_of_fit: Option<f64>,
    /// Chi square and degrees of freedom of that goodness of fit.
    #[serde(skip)]
    pub misfit: Option<Misfit>,
    /// Change of the joint's stiffnesses.
    pub joint_shift: JointShift,
    /// The effects with their best values, to predict with.
    #[serde(skip)]
    pub effects: Vec<Effect>,
    /// The joint's best stiffnesses (N/m, N m/rad); `None` without a joint.
    pub joint: Option<[f64; 2]>,
    /// 95 % intervals of the stiffnesses, from low to high (N/m, N m/rad); `None` for a stiffness that is not fitted or not
    /// bounded by the data.
    pub joint_intervals: [Option<[f64; 2]>; 2],
    /// Best coupling of the joint's own model (1), without that of the effects.
    #[serde(skip)]
    pub coupling: f64,
    /// The beam, of a lap joint its left half, where the fit moves it within its tolerances.
    #[serde(skip)]
    pub beam: Option<Beam>,
}

fn joined_groups<S: Serializer>(groups: &[Group], to: S) -> Result<S::Ok, S::Error> {
    let names: Vec<&str> = groups.iter().map(|group| group.name()).collect();
    (!names.is_empty()).then(|| names.join("+")).serialize(to)
}

fn by_name<S: Serializer>(parameters: &[ParameterValue], to: S) -> Result<S::Ok, S::Error> {
    let mut effects = parameters.iter().map(|one| one.effect);
    let first = effects.next();
    let alone = effects.all(|effect| Some(effect) == first);
    let mut named = BTreeMap::new();
    for one in parameters {
        let name = match alone {
            true => one.name.to_owned(),
            false => format!("{}.{}", one.effect.name(), one.name),
        };
        named.insert(name, one);
    }
    named.serialize(to)
}

/// Parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ParameterValue {
    /// The effect.
    #[serde(skip)]
    pub effect: EffectId,
    /// Name of the parameter.
    #[serde(skip)]
    pub name: &'static str,
    /// Value (SI).
    pub value: f64,
    /// Standard uncertainty; `None` where the data do not bound it.
    pub std: Option<f64>,
    /// Smallest value that is found nine times out of ten at the 1 % level; sizes only.
    pub smallest_detectable: Option<f64>,
    /// Smallest value at which these data would separate the effect from every other; `None` where
    /// none would, and for parameters other than sizes.
    #[serde(rename = "smallest_isolable")]
    pub smallest_separable: Option<f64>,
}

/// Factor on all frequencies that would suit the data best, if the description were exact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct CommonFactor {
    /// Common factor on all frequencies less 1 (%), if the description were exact.
    pub percent: f64,
    /// Its standard uncertainty (%).
    pub std_percent: f64,
    /// Standard uncertainty of the factor by tolerances, weight and free test (%).
    pub tolerance_percent: f64,
    /// Factor less that of the description, over the standard deviation of both (1); positive if measured frequencies
    /// are higher.
    pub deviation: f64,
}

/// Share of a gap that is closed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Closure {
    /// (before^2 - after^2)/(before^2 - floor^2).
    pub value: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end of its 95 % interval.
    pub high: f64,
}

/// Recordings that are predicted from all others, each in turn.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CrossValidation {
    /// Root mean square error of all their frequencies under the nominal model (%).
    pub before: f64,
    /// Root mean square error under the hypothesis (%).
    pub after: f64,
    /// Root mean square error that uncertainty alone would leave (%).
    pub floor: f64,
    /// Share of the gap that is closed; `None` where the gap is below two floors.
    pub closure: Option<Closure>,
    /// Errors of each recording.
    pub recordings: Vec<LeftOutRecording>,
}

/// Recording that is predicted from all others.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LeftOutRecording {
    /// Name of the recording.
    pub recording: String,
    /// Root mean square error of its frequencies under the nominal model (%).
    pub before: f64,
    /// Root mean square error under the hypothesis (%).
    pub after: f64,
    /// Root mean square error that uncertainty alone would leave (%).
    pub floor: f64,
}

/// Change of the joint's stiffnesses when the effect is added.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct JointShift {
    /// Translation (%); `None` where it is not fitted.
    pub kx_percent: Option<f64>,
    /// Rotation (%); `None` where it is not fitted.
    pub ky_percent: Option<f64>,
}

/// Probabilities of where the gap lies, given that there is one; the six sum to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct LocationProbabilities {
    /// Clocks and readings (1).
    pub acquisition: f64,
    /// The beam (1).
    pub body: f64,
    /// The base under the joint (1).
    pub fixture: f64,
    /// The joint (1).
    pub joint: f64,
    /// The sensors (1).
    pub sensor: f64,
    /// Outside the catalogue (1).
    pub unknown: f64,
}

impl LocationProbabilities {
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

/// Error of a fitted frequency.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Residual {
    /// Number of the mode.
    pub mode: usize,
    /// File of the recording, or the name of the given data.
    pub recording: String,
    /// Amplitude of its taps over that of the hardest configuration (1); `None` without a measured force.
    pub level: Option<f64>,
    /// 100 (predicted - measured)/measured under the nominal model with its joint refitted (%).
    pub error_percent: f64,
    /// That error over the standard uncertainty (1).
    pub z: f64,
    /// 100 (predicted - measured)/measured under the best hypothesis (%).
    pub error_percent_after: f64,
    /// That error over the standard uncertainty (1).
    pub z_after: f64,
}

/// Misfit of a fit to all data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Sum of the squared residuals in standard deviations, priors of the nuisance parameters included (1).
    pub chi_square: f64,
    /// Number of data less the parameters with weak priors.
    pub freedom: f64,
}

/// Data that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Name of the block.
    pub name: String,
    /// Probability of a misfit as large or larger.
    pub goodness_of_fit: f64,
}

/// Local changes of stiffness and of mass that the residual of the nominal model calls for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct LocationMap {
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

/// Reason for the decision between the first hypothesis and the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DecidedBy {
    /// The data: the likelihood ratio is 3 or more.
    #[serde(rename = "readings")]
    Data,
    /// The priors: the data alone would leave both.
    Priors,
}

/// Largest relative change of the joint's stiffness with the amplitude that is searched (1).
pub const LARGEST_STIFFNESS_CHANGE: f64 = 0.7;

/// Joint law that explains how frequencies change along the decays.
///
/// No other effect of the catalogue changes a frequency along a decay. It is therefore stated beside the
/// verdict: a model may miss the frequencies for another reason while its joint softens.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct AmplitudeDependence {
    /// "joint-nonlinearity" where a joint does that: a law of its rotation explains the changes, or all frequencies
    /// that change do so the same way, of which there are two at least; else null. Joints soften in translation too,
    /// which modes feel that do not turn them; the change of the rotation is then unknown.
    pub effect: Option<EffectId>,
    /// True if more than one frequency changes in a certain direction. The cause of a single change stays open.
    pub enough: bool,
    /// True if a law of the joint's rotation explains the changes. Only then `ratio` is its size.
    pub lawful: bool,
    /// Relative change of the joint's rotational stiffness at the largest amplitude (1), over that at
    /// rest: negative where it softens. No change beyond 0.7 is looked for.
    pub ratio: f64,
    /// Its standard uncertainty (1).
    pub ratio_std: f64,
    /// True if the search ended at its limit. `ratio` is then a bound, and `ratio_std` does not hold.
    pub at_bound: bool,
    /// Power of the amplitude that fits best, of 1/2, 1, 3/2 and 2.
    pub exponent: f64,
    /// Probability of changes as large if there were none: noise, and what the model leaves open of them,
    /// so that it is larger than noise alone would have it.
    pub chance: f64,
    /// Probability of a misfit as large or larger, if the joint's stiffness changes like that.
    pub goodness_of_fit: Option<f64>,
    /// The frequencies that were followed.
    pub changes: Vec<FrequencyChange>,
}

/// Change of a frequency along the decays of a recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct FrequencyChange {
    /// Number of the mode.
    pub mode: usize,
    /// Name of the recording.
    pub recording: String,
    /// Amplitude of its taps over that of the hardest recording (1); `None` without a measured force.
    pub level: Option<f64>,
    /// Change per e-fold of its amplitude (%): negative where the frequency falls with the amplitude.
    pub percent_per_fold: f64,
    /// Standard uncertainty of the change (%).
    pub std: f64,
    /// Change that the joint's law predicts (%).
    pub explained: f64,
}

impl AmplitudeDependence {
    /// Judges changes by the law that explains them best.
    pub fn new(
        law: JointLaw,
        ratio_std: f64,
        chance: f64,
        goodness_of_fit: Option<f64>,
        changes: Vec<FrequencyChange>,
        thresholds: &Thresholds,
    ) -> Self {
        let directed: Vec<&FrequencyChange> = changes
            .iter()
            .filter(|change| {
                change.percent_per_fold.abs() > thresholds.directed_change * change.std
            })
            .collect();
        let lawful = goodness_of_fit.is_some_and(|p| p >= thresholds.law_misfit);
        let enough = directed.len() >= thresholds.least_directed;
        let same_way = directed
            .iter()
            .all(|change| change.percent_per_fold * law.ratio > 0.0);
        AmplitudeDependence {
            effect: (lawful || enough && same_way).then_some(EffectId::JointNonlinearity),
            enough,
            lawful,
            ratio: law.ratio,
            ratio_std,
            at_bound: law.ratio.abs() >= LARGEST_STIFFNESS_CHANGE,
            exponent: law.exponent,
            chance,
            goodness_of_fit,
            changes,
        }
    }

    /// Returns "softens" or "stiffens".
    pub fn direction(&self) -> &'static str {
        if self.ratio < 0.0 {
            "softens"
        } else {
            "stiffens"
        }
    }
}

/// Fit of the described model without the sensors of unknown position.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UnlocatedSensors {
    /// Names of the sensors.
    pub sensors: Vec<String>,
    /// Sum of their masses (kg).
    pub mass: f64,
    /// Root mean square of the frequency errors without them (%).
    pub gap: f64,
    /// Probability of a misfit as large or larger without them.
    pub goodness_of_fit: f64,
}

/// Test that could be made, or recording that could be read again.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "String")]
pub enum Proposal {
    /// Read higher modes.
    HigherModes {
        /// The lowest of them.
        first: usize,
        /// The highest.
        last: usize,
        /// There are recordings that may show them.
        is_recorded: bool,
    },
    /// Read frequencies by a fit, or on lines so close, instead of on lines.
    FinerLines {
        /// Largest distance of the lines (Hz).
        spacing: f64,
    },
    /// Repeat the first recording with so many times the taps.
    MoreTaps {
        /// Ratio of the numbers of taps.
        factor: usize,
    },
    /// Tap at another level.
    TapLevel {
        /// Force over that of the hardest recording so far (1).
        level: f64,
    },
    /// Weigh the sensor with its mounting.
    WeighSensor,
    /// Weigh and measure the beam.
    Calipers,
    /// Record a tone whose frequency is known.
    ReferenceTone,
    /// Put a sensor elsewhere.
    MoveSensor {
        /// Name of the sensor.
        name: String,
        /// Its new position (m).
        position: f64,
    },
    /// Fasten a known mass.
    KnownMass {
        /// The mass (kg).
        mass: f64,
        /// Its position (m).
        position: f64,
    },
    /// Loosen the joint, tighten it again, and repeat the first recording.
    Retighten,
    /// Turn the set-up over, so that gravity pulls the other way along the beam.
    TurnOver,
    /// Take the beam out of its joint and test it by itself.
    BareBeam,
    /// See directly whether a cause that was named is there.
    Confirm {
        /// The cause.
        effect: EffectId,
    },
}

impl Proposal {
    /// Returns the name in reports and scripts.
    pub fn id(&self) -> &'static str {
        match self {
            Proposal::HigherModes { .. } => "higher-modes",
            Proposal::FinerLines { .. } => "finer-lines",
            Proposal::MoreTaps { .. } => "more-taps",
            Proposal::TapLevel { .. } => "tap-level",
            Proposal::WeighSensor => "weigh-sensor",
            Proposal::Calipers => "calipers",
            Proposal::ReferenceTone => "reference-tone",
            Proposal::MoveSensor { .. } => "move-sensor",
            Proposal::KnownMass { .. } => "known-mass",
            Proposal::Retighten => "retighten",
            Proposal::TurnOver => "turn-over",
            Proposal::BareBeam => "bare-beam",
            Proposal::Confirm { .. } => "confirm",
        }
    }

    /// Returns the cost in multiples of reading a recording again: 2, another recording or a weighing on
    /// the set-up as it stands; 3, something moved or fastened; 4, the joint opened; 6, the rig
    /// turned; 8, taken apart. Tests that leave the joint untouched come cheap for a second
    /// reason: the drift of a joint between set-ups hides the effect.
    pub fn effort(&self) -> f64 {
        match self {
            Proposal::HigherModes { .. } | Proposal::FinerLines { .. } => 1.0,
            Proposal::MoreTaps { .. }
            | Proposal::TapLevel { .. }
            | Proposal::WeighSensor
            | Proposal::Calipers
            | Proposal::ReferenceTone
            | Proposal::Confirm { .. } => 2.0,
            Proposal::MoveSensor { .. } | Proposal::KnownMass { .. } => 3.0,
            Proposal::Retighten => 4.0,
            Proposal::TurnOver => 6.0,
            Proposal::BareBeam => 8.0,
        }
    }
}

impl From<Proposal> for String {
    fn from(proposal: Proposal) -> String {
        proposal.id().to_owned()
    }
}

/// Test that would decide between hypotheses, and its expected information.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NextTest {
    /// The test.
    #[serde(rename = "id")]
    pub proposal: Proposal,
    /// The test in a sentence, without its full stop.
    pub action: String,
    /// Hypotheses that it would separate, those that contribute most first.
    pub separates: Vec<String>,
    /// Hypotheses that have no prediction of this test.
    pub unpredicted: Vec<String>,
    /// Least expected information about which hypothesis is true (bit), without hypotheses that have no prediction.
    #[serde(rename = "bits")]
    pub expected_information: f64,
    /// Cost in multiples of reading again what is recorded. Tests are ranked by bits over this.
    pub effort: f64,
}

impl NextTest {
    /// Returns the time that the test takes (min), for one beam with its set-up at hand: an estimate, five for each unit of effort.
    pub fn minutes(&self) -> f64 {
        5.0 * self.effort
    }

    /// Returns the information per cost (bit), by which tests are ranked.
    pub fn worth(&self) -> f64 {
        self.expected_information / self.effort
    }
}
