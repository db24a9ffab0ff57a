//! The truth of pairs of tests: a JSON list of `{"name", "changes": [{"cause", "item", "parameters"}]}`.
//!
//! Without a change the list of changes is empty. A cause that the comparison does not know means a change outside of its
//! causes. `"visible"` says whether the change shows at all, and `"repeatability"` is what the comparison is told. Both may
//! be left out.

use super::draw::OUTSIDE;
use crate::blind_check::TruthError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use tapjoint_compare::CauseKind;

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
/// Limits of a repeatability that a comparison accepts (1).
const REPEATABILITY: [f64; 2] = [1e-6, 0.1];

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
    let truths: Vec<PairTruth> =
        serde_json::from_str(text).map_err(|source| TruthError::PairShape { source })?;
    let mut doubts = Vec::new();
    for (index, truth) in truths.iter().enumerate() {
        let name = &truth.name;
        if truths[..index].iter().any(|other| other.name == *name) {
            return Err(TruthError::Twice { name: name.clone() });
        }
        let [least, most] = REPEATABILITY;
        if let Some(value) = truth.repeatability
            && !(least..=most).contains(&value)
        {
            let name = name.clone();
            return Err(TruthError::Repeatability { name, value });
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
    }
    Ok(PairTruthFile { truths, doubts })
}

/// Returns the truths as a list, one line for each.
///
/// # Errors
/// A size that is no finite number.
pub fn pair_truths_json(truths: &[PairTruth]) -> Result<String, serde_json::Error> {
    let lines: Result<Vec<String>, _> = truths.iter().map(serde_json::to_string).collect();
    Ok(format!("[\n{}\n]\n", lines?.join(",\n")))
}
