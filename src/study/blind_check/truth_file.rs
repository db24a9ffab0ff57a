//! The truth of tests made elsewhere: a JSON list of `{"name", "effects": [...], "params": {...}}`.
//!
//! An empty list of effects means that nothing was planted; an id that the catalogue does not have
//! means something outside it. Parameters may stand under their effect's id, or by themselves where
//! there is but one effect. `"detectable"` and `"refutable"` say whether the effect could be noticed, and
//! whether the catalogue could be seen not to explain it; both may be left out.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use super::case::{Planted, Truth};
use crate::effects::EffectId;

/// Why a truth file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// No JSON list of such entries.
    #[error(
        "this is no list of truths ({source}); write a JSON list of \
         {{\"name\": \"...\", \"effects\": [\"...\"], \"params\": {{...}}}}, one for each test"
    )]
    Shape {
        /// What the parser says, with line and column.
        source: serde_json::Error,
    },
    /// Two entries of one name.
    #[error("the test \"{name}\" occurs twice; give each test one entry")]
    Twice {
        /// The name.
        name: String,
    },
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    effects: Vec<String>,
    #[serde(default, alias = "parameters")]
    params: BTreeMap<String, Value>,
    detectable: Option<bool>,
    refutable: Option<bool>,
}

/// Reads a truth file's text.
///
/// # Errors
/// [`TruthError`] where the text is no such list, or names a test twice.
pub fn parse_truths(text: &str) -> Result<Vec<Truth>, TruthError> {
    let entries: Vec<Entry> =
        serde_json::from_str(text).map_err(|source| TruthError::Shape { source })?;
    let mut truths: Vec<Truth> = Vec::new();
    for entry in entries {
        if truths.iter().any(|truth| truth.name == entry.name) {
            return Err(TruthError::Twice { name: entry.name });
        }
        truths.push(truth_of(entry));
    }
    Ok(truths)
}

fn truth_of(entry: Entry) -> Truth {
    let alone = entry.effects.len() == 1;
    let planted = |name: &String| match EffectId::parse(name) {
        Ok(id) => Planted::Catalogue(id, parameters_of(name, &entry.params, alone)),
        Err(_) => Planted::Outside(name.clone()),
    };
    Truth {
        effects: entry.effects.iter().map(planted).collect(),
        name: entry.name,
        detectable: entry.detectable,
        refutable: entry.refutable,
    }
}

fn parameters_of(
    effect: &str,
    params: &BTreeMap<String, Value>,
    alone: bool,
) -> BTreeMap<String, f64> {
    let numbers = |values: &mut dyn Iterator<Item = (&String, &Value)>| {
        values
            .filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)))
            .collect()
    };
    match params.get(effect) {
        Some(Value::Object(own)) => numbers(&mut own.iter()),
        _ if alone => numbers(&mut params.iter()),
        _ => BTreeMap::new(),
    }
}
