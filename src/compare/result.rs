//! The answer of a comparison.

use crate::cause::CauseKind;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// A value with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Interval {
    /// Median; of a loss factor the best fit.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// A cause with its probability.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CauseResult {
    /// The cause.
    pub effect: CauseKind,
    /// Name of the item that it is about.
    pub item: Option<String>,
    /// Probability (1).
    pub probability: f64,
    /// Sizes and place: mass (kg), position, sensor_shift (m), compliance (1, E I/L of the beam), force (N); kt, kr, relative
    /// change (1); coupling, change (1); kt_compliance, kr_compliance (1, beams) of a joint that was described as rigid.
    pub parameters: BTreeMap<&'static str, Interval>,
    /// Probability of a worse fit if this cause is true (1); `null` for an unknown change.
    pub goodness_of_fit: Option<f64>,
    /// What it changes each frequency by (%), in the order of the compared modes; empty where it has no size.
    pub explains_percent: Vec<f64>,
}

/// A compared mode.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ModeChange {
    /// Index of the pair, from 0.
    pub pair: usize,
    /// Number of the mode.
    pub mode: usize,
    /// Frequency before (Hz), the mean of repeats, at the level of the first test.
    pub before: f64,
    /// Frequency after (Hz), likewise.
    pub after: f64,
    /// Change (%).
    pub change_percent: f64,
    /// Part of the change between the frequencies as they were read that other levels of the taps explain (%). It is taken out.
    pub level_percent: f64,
    /// Part of the change that the two descriptions explain (%).
    pub described_percent: f64,
    /// Standard deviation of the change if nothing changed (%).
    pub std_percent: f64,
    /// Undescribed change over its standard deviation (1).
    pub z: f64,
}

/// A mode whose number two tests gave to different peaks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct MatchedMode {
    /// Index of the pair, from 0.
    pub pair: usize,
    /// Number of the mode.
    pub mode: usize,
    /// Index of the other test among those before and then those after, from 0.
    pub test: usize,
    /// Frequency in the first test before (Hz).
    pub first: f64,
    /// Frequency that the other test gives this number (Hz).
    pub other: f64,
    /// Frequency of its peak that was taken instead (Hz); `null` where the mode was left out, since either may be right.
    pub taken: Option<f64>,
}

/// Kind of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VerdictKind {
    /// Nothing changed beyond what repeating a test changes.
    NoChange,
    /// One cause.
    Named,
    /// Causes that these data do not tell apart.
    Group,
    /// A list that holds 90 %.
    Set,
    /// Something changed that no cause explains.
    Unknown,
}

impl VerdictKind {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoChange => "no-change",
            Self::Named => "named",
            Self::Group => "group",
            Self::Set => "set",
            Self::Unknown => "unknown",
        }
    }
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ChangeVerdict {
    /// Kind.
    pub kind: VerdictKind,
    /// Causes, the most probable first. Empty for `no-change` and `unknown`.
    pub effects: Vec<CauseKind>,
    /// Item of each cause.
    pub items: Vec<Option<String>>,
    /// Probability of the answer (1).
    pub probability: f64,
}

/// A stiffness before and after.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct StiffnessChange {
    /// Stiffness before (N/m or N m/rad).
    pub before: f64,
    /// True where the description states it. Otherwise it was fitted to the frequencies before.
    pub is_stated: bool,
    /// Standard uncertainty of the stiffness before (%).
    pub before_std_percent: f64,
    /// Stiffness after if only the joint changed.
    pub after: f64,
    /// Change if only the joint changed (%).
    pub change_percent: f64,
    /// Lower end of its 95 % interval (%).
    pub low: f64,
    /// Upper end of its 95 % interval (%).
    pub high: f64,
    /// Smallest rise and fall (%) that would be seen nine times of ten; `null` where none up to a factor of 20 would be, and
    /// where the answer is not `no-change`.
    pub seen_from_percent: [Option<f64>; 2],
}

/// Change of the joint if only the joint changed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct JointResult {
    /// Translational stiffness; `null` where a description has it as rigid.
    pub kt: Option<StiffnessChange>,
    /// Rotational stiffness.
    pub kr: Option<StiffnessChange>,
}

/// Where the repeatability comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RepeatabilityOrigin {
    /// It was stated.
    Stated,
    /// From repeats.
    Repeats,
    /// Neither: a usual range is assumed.
    Assumed,
}

/// Scatter of a frequency between two tests of one state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct RepeatabilityResult {
    /// Standard deviation of the difference of two tests (%).
    pub percent: f64,
    /// Where it comes from.
    pub origin: RepeatabilityOrigin,
}

/// What the dampings say of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DampingVerdict {
    /// No more than repeating a test changes.
    NoChange,
    /// As a change of the joint's loss factor changes them.
    JointDamping,
    /// In another way.
    Other,
    /// They changed. These data do not tell whether the joint changed them.
    Undecided,
}

/// Change of a damping ratio.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ModeDamping {
    /// Index of the pair, from 0.
    pub pair: usize,
    /// Number of the mode.
    pub mode: usize,
    /// Damping ratio before (1), the mean of repeats.
    pub before: f64,
    /// Damping ratio after (1).
    pub after: f64,
    /// Standard deviation of the difference if nothing changed (1).
    pub std: f64,
}

/// Change of the dampings.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DampingResult {
    /// The modes whose damping all tests have.
    pub modes: Vec<ModeDamping>,
    /// What they say.
    pub verdict: DampingVerdict,
    /// Change of the joint's loss factor (1) if only this changed, and no stiffness. `null` where there is no elastic joint, for
    /// one mode, and where the interval reaches beyond 1: then the modes hardly feel the joint.
    pub loss_factor: Option<Interval>,
    /// Goodness of fit of no change (1): the smaller one of two tests, times two. One is of all dampings, the other of the loss
    /// factor alone.
    pub no_change_goodness: f64,
    /// Goodness of fit of a change of the joint's loss factor (1); `null` where there is no elastic joint that the modes feel, and
    /// for one mode.
    pub joint_goodness: Option<f64>,
    /// Standard deviation of the difference of a damping between two tests of one state (%).
    pub scatter_percent: f64,
}

/// How much the frequency of a mode depends on the level.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ModeLevel {
    /// Index of the pair, from 0.
    pub pair: usize,
    /// Number of the mode.
    pub mode: usize,
    /// Change of the frequency before (%) per factor of ten in amplitude, the mean of repeats.
    pub before_percent: f64,
    /// The same after.
    pub after_percent: f64,
    /// Standard deviation of the difference if nothing changed (%).
    pub std_percent: f64,
}

/// Change of the frequencies' dependence on the level.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LevelResult {
    /// The modes whose decays tell it in all tests, at about one amplitude.
    pub modes: Vec<ModeLevel>,
    /// True where it changed by more than repeating a test changes.
    pub has_changed: bool,
    /// Goodness of fit of no change (1).
    pub no_change_goodness: f64,
}

/// Result of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// Compared modes.
    pub modes: Vec<ModeChange>,
    /// Modes whose numbers differed between the tests.
    pub matched: Vec<MatchedMode>,
    /// The joint; `null` where there is none.
    pub joint: Option<JointResult>,
    /// The answer.
    pub verdict: ChangeVerdict,
    /// All causes, the most probable first.
    pub hypotheses: Vec<CauseResult>,
    /// The dampings; `null` where the tests have none in common.
    pub damping: Option<DampingResult>,
    /// The frequencies' dependence on the level; `null` where the tests have none in common.
    pub level: Option<LevelResult>,
    /// Scatter between set-ups.
    pub repeatability: RepeatabilityResult,
    /// Goodness of fit of no change (1).
    pub no_change_goodness: f64,
}
