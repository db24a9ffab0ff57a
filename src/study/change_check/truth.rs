//! The truth of pairs of tests: a JSON list of `{"name", "changes": [{"cause", "item", "parameters"}]}`.
//!
//! Without a change the list of changes is empty. A cause that the comparison does not know means a change outside of its
//! causes. `"visible"` says whether the change shows at all, and `"repeatability"` is what the comparison is told. Both may
//! be left out.

use crate::blind_check::TruthError;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, HashSet};
use tapjoint_beam::effects::{Effect, EffectId};
use tapjoint_compare::{CauseKind, REPEATABILITY_LIMITS};
use tapjoint_description::TestDescription;
use tapjoint_simulate::{Change, moved_sensor};

/// Kinds of changes outside of the causes, as truth files name them.
pub(super) const OUTSIDE: [&str; 4] =
    ["second-support", "mass-patch", "soft-patch", "three-masses"];

/// Causes that a comparison may name.
const CAUSES: [CauseKind; 8] = [
    CauseKind::JointChange,
    CauseKind::LostMass,
    CauseKind::AddedMass,
    CauseKind::LocalCrack,
    CauseKind::Length,
    CauseKind::Modulus,
    CauseKind::SensorPosition,
    CauseKind::AxialLoad,
];

/// A change between two tests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantedChange {
    /// Name of the cause.
    pub cause: String,
    /// Name of the item that it is about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub item: Option<String>,
    /// Sizes and place by name: mass (kg), position and shift (m), others relative (1).
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
}

impl PlantedChange {
    /// Returns a change by this cause without sizes; `None` is one outside of the causes, to be named later.
    pub(super) fn of(cause: Option<CauseKind>) -> Self {
        Self {
            cause: cause.map_or("", CauseKind::name).to_owned(),
            item: None,
            parameters: BTreeMap::new(),
        }
    }

    /// Returns a change of this virtual test.
    pub fn of_test(change: &Change, test: &TestDescription) -> Self {
        match change {
            Change::Joint { kt, kr } => {
                let mut planted = Self::of(Some(CauseKind::JointChange));
                planted.set(&[("kt", *kt), ("kr", *kr)]);
                planted
            }
            Change::LostMass { item } => Self {
                item: Some(item.clone()),
                ..Self::of(Some(CauseKind::LostMass))
            },
            Change::Effect(effect) => Self::of_effect(effect, test),
        }
    }

    fn of_effect(effect: &Effect, test: &TestDescription) -> Self {
        let mut planted = Self {
            cause: effect.id.name().to_owned(),
            item: None,
            parameters: BTreeMap::new(),
        };
        for (info, value) in effect.values() {
            planted.set(&[(info.name, value)]);
        }
        if effect.id == EffectId::SensorPosition {
            planted.item = moved_sensor(test, effect).map(str::to_owned);
            let sizes = &mut planted.parameters;
            sizes.remove("sensor");
            if let Some(offset) = sizes.remove("offset") {
                sizes.insert("sensor_shift".to_owned(), offset);
            }
            // 0 means all recordings.
            sizes.retain(|name, value| !(name == "recording" && *value == 0.0));
        }
        planted
    }

    /// Adds sizes.
    pub(super) fn set(&mut self, sizes: &[(&str, f64)]) {
        let sizes = sizes.iter();
        self.parameters
            .extend(sizes.map(|(name, size)| ((*name).to_owned(), *size)));
    }

    /// Returns the cause; `None` for one outside of the causes.
    pub fn kind(&self) -> Option<CauseKind> {
        CAUSES.into_iter().find(|kind| kind.name() == self.cause)
    }
}

/// The truth of one pair of tests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairTruth {
    /// The pair.
    pub name: String,
    /// What changed; empty for nothing.
    pub changes: Vec<PlantedChange>,
    /// True where the change alone is noticed against the scatter between tests; `None` where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visible: Option<bool>,
    /// The repeatability that the comparison is told (1); `None` where it is told none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeatability: Option<f64>,
}

/// Kinds of pairs, each with questions of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairKind {
    /// Nothing changed.
    Nothing,
    /// One cause.
    Single(CauseKind),
    /// Several causes.
    Several,
    /// Something that the comparison does not know.
    Outside,
}

impl PairTruth {
    /// Returns the kind of the pair.
    pub fn kind(&self) -> PairKind {
        let kinds: Option<Vec<CauseKind>> = self.changes.iter().map(PlantedChange::kind).collect();
        match kinds.as_deref() {
            None => PairKind::Outside,
            Some([]) => PairKind::Nothing,
            Some([kind]) => PairKind::Single(*kind),
            Some(_) => PairKind::Several,
        }
    }
}

impl PairKind {
    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Single(kind) => kind.name(),
            Self::Several => "two",
            Self::Outside => "outside",
        }
    }
}

/// The truths of a file, and the oddities of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct PairTruthFile {
    /// One for each pair, in the order of the file.
    pub truths: Vec<PairTruth>,
    /// Oddities that keep no truth from being used.
    pub doubts: Vec<String>,
}

/// Reads a truth file's text.
///
/// # Errors
/// [`TruthError`] where the text is no such list, names a pair twice, or has a repeatability that no test has.
pub fn parse_pair_truths(text: &str) -> Result<PairTruthFile, TruthError> {
    let entries: Vec<Value> =
        serde_json::from_str(text).map_err(|source| TruthError::PairShape { source })?;
    let truths: Vec<PairTruth> =
        serde_json::from_str(text).map_err(|source| TruthError::PairEntry { source })?;
    let mut doubts = Vec::new();
    let mut names = HashSet::new();
    for (index, truth) in truths.iter().enumerate() {
        let name = &truth.name;
        if !names.insert(name) {
            return Err(TruthError::Twice { name: name.clone() });
        }
        let [least, most] = REPEATABILITY_LIMITS;
        if let Some(value) = truth.repeatability
            && !(least..=most).contains(&value)
        {
            let name = name.clone();
            return Err(TruthError::Repeatability {
                name,
                value,
                least,
                most,
            });
        }
        for change in &truth.changes {
            let cause = change.cause.as_str();
            if change.kind().is_none() && !OUTSIDE.contains(&cause) {
                let known: Vec<&str> = CAUSES.into_iter().map(CauseKind::name).collect();
                doubts.push(format!(
                    "\"{name}\": `{cause}` counts as a change outside of the causes; the causes are: {}",
                    known.join(", ")
                ));
            }
        }
        let found = doubts_of(truth, &entries[index]).into_iter();
        doubts.extend(found.map(|doubt| format!("\"{name}\": {doubt}")));
    }
    let mut changed = truths.iter().filter(|truth| !truth.changes.is_empty());
    if changed.clone().next().is_some() && changed.all(|truth| truth.visible.is_none()) {
        doubts.push(
            "no pair says whether its change is `visible`, so that the figures of visible changes stay empty; add \
             \"visible\": true or false where that is known"
                .to_owned(),
        );
    }
    Ok(PairTruthFile { truths, doubts })
}

/// Names what may be a slip of the pen: keys and parameters that are not used, and an item that is not named.
fn doubts_of(truth: &PairTruth, entry: &Value) -> Vec<String> {
    let mut doubts = unknown_keys(entry, &["name", "changes", "visible", "repeatability"]);
    for (index, change) in truth.changes.iter().enumerate() {
        let keys = unknown_keys(&entry["changes"][index], &["cause", "item", "parameters"]);
        doubts.extend(keys);
        // Changes outside of the causes have parameters of their own.
        let Some(kind) = change.kind() else {
            continue;
        };
        let cause = kind.name();
        let allowed: &[&str] = match kind {
            CauseKind::JointChange => &["kt", "kr"],
            CauseKind::LostMass => &["mass"],
            CauseKind::AddedMass => &["mass", "position"],
            CauseKind::LocalCrack => &["compliance", "position"],
            CauseKind::SensorPosition => &["sensor_shift", "recording"],
            CauseKind::AxialLoad => &["force"],
            _ => &["relative"],
        };
        let given = change.parameters.keys();
        for name in given.filter(|name| !allowed.contains(&name.as_str())) {
            doubts.push(format!(
                "`{name}` is no parameter of `{cause}` and is left out; allowed: {}",
                allowed.join(", ")
            ));
        }
        let is_about_item = matches!(kind, CauseKind::LostMass | CauseKind::SensorPosition);
        match change.item {
            None if is_about_item => doubts.push(format!(
                "`{cause}` has no `item`, so that the item of the answer is not scored; add the name of the sensor or mass"
            )),
            Some(_) if !is_about_item => doubts.push(format!(
                "`{cause}` is about no item, so that `item` is left out; only lost-mass and sensor-position have one"
            )),
            _ => {}
        }
    }
    doubts
}

fn unknown_keys(entry: &Value, known: &[&str]) -> Vec<String> {
    let keys = entry
        .as_object()
        .into_iter()
        .flat_map(|object| object.keys());
    let unknown = keys.filter(|key| !known.contains(&key.as_str()));
    unknown
        .map(|key| {
            format!(
                "the key `{key}` is not known and is left out; known: {}",
                known.join(", ")
            )
        })
        .collect()
}

/// Returns the truths as a list, one line for each.
///
/// # Errors
/// A size that is no finite number.
pub fn pair_truths_json(truths: &[PairTruth]) -> Result<String, serde_json::Error> {
    let lines: Result<Vec<String>, _> = truths.iter().map(serde_json::to_string).collect();
    Ok(format!("[\n{}\n]\n", lines?.join(",\n")))
}
