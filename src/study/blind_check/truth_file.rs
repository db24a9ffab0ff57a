//! The truth of tests made elsewhere: a JSON list of `{"name", "effects": [...], "params": {...}}`.
//!
//! An empty list of effects means that nothing was planted; an id that the catalogue does not have
//! means something outside it. Parameters may stand under their effect's id, or by themselves where
//! there is but one effect. `"detectable"` and `"refutable"` say whether the effect could be noticed, and
//! whether the catalogue could be seen not to explain it; both may be left out. A likely slip of the pen is
//! reported as a doubt, because it would change the score unnoticed.
//!
//! [`commitment`] seals the truths, so that they cannot be changed once the diagnosis has been seen.

use super::case::{Planted, Truth};
use super::planted_effects::OutOfCatalogueKind;
use serde::Deserialize;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use tapjoint_beam::effects::{EffectError, EffectId, Group};

/// A reason for which a truth file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// No JSON list of such entries.
    #[error(
        "this is no list of truths ({source}); write a JSON list of \
         {{\"name\": \"...\", \"effects\": [\"...\"], \"params\": {{...}}}}, one for each test"
    )]
    Shape {
        /// The parser's message, with line and column.
        source: serde_json::Error,
    },
    /// No JSON list of pairs of tests.
    #[error(
        "this is no list of truths ({source}); write a JSON list of \
         {{\"name\": \"...\", \"changes\": [{{\"cause\": \"...\", \"item\": \"...\", \"parameters\": {{...}}}}], \
         \"visible\": true, \"repeatability\": 0.001}}, one for each pair of tests"
    )]
    PairShape {
        /// The parser's message, with line and column.
        source: serde_json::Error,
    },
    /// A list with an entry of another form.
    #[error(
        "{source}; write each pair as \
         {{\"name\": \"...\", \"changes\": [{{\"cause\": \"...\", \"item\": \"...\", \"parameters\": {{...}}}}], \
         \"visible\": true, \"repeatability\": 0.001}}; all but name, changes and cause may be left out"
    )]
    PairEntry {
        /// The parser's message, with line and column.
        source: serde_json::Error,
    },
    /// A repeatability that no comparison accepts.
    #[error("the repeatability of \"{name}\" is {value}, but must lie between {least} and {most}")]
    Repeatability {
        /// The pair.
        name: String,
        /// The value given (1).
        value: f64,
        /// Least value (1).
        least: f64,
        /// Largest value (1).
        most: f64,
    },
    /// Two entries of one name.
    #[error("the test \"{name}\" occurs twice; give each test one entry")]
    Twice {
        /// The name.
        name: String,
    },
}

/// The truths of a file, and the oddities of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthFile {
    /// One for each test, in the order of the file.
    pub truths: Vec<Truth>,
    /// Oddities that keep no truth from being used.
    pub doubts: Vec<String>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    effects: Vec<String>,
    #[serde(default, alias = "parameters")]
    params: BTreeMap<String, Value>,
    detectable: Option<bool>,
    refutable: Option<bool>,
    within_tolerance: Option<bool>,
    #[serde(flatten)]
    unknown: BTreeMap<String, Value>,
}

impl Entry {
    /// Returns the effects of the catalogue.
    fn known_effects(&self) -> Vec<EffectId> {
        let names = self.effects.iter();
        names
            .filter_map(|name| EffectId::parse(name).ok())
            .collect()
    }

    /// Gives parameters to the effect that has them. These are the ones written as `effect.parameter`. With several
    /// effects, all of the catalogue, they are also those that only one of them has. A parameter that is given twice
    /// stays where it is and raises a doubt.
    fn sort_parameters(&mut self) {
        let effects = self.known_effects();
        let all_known = effects.len() == self.effects.len() && effects.len() > 1;
        let flat: Vec<(String, Value)> = self
            .params
            .iter()
            .filter(|(_, value)| value.is_number())
            .map(|(key, value)| (key.clone(), value.clone()))
            .collect();
        for (key, value) in flat {
            let (effect, name) = match key.split_once('.') {
                Some((effect, name)) => (Some(effect), name),
                None if all_known => (None, key.as_str()),
                None => continue,
            };
            let owners = effects.iter().filter(|id| {
                effect.is_none_or(|effect| id.name() == effect)
                    && parameter_names(**id).contains(&name)
            });
            let owners: Vec<&EffectId> = owners.collect();
            let [owner] = owners[..] else { continue };
            let own = self
                .params
                .entry(owner.name().to_owned())
                .or_insert_with(|| Value::Object(serde_json::Map::new()));
            if let Value::Object(own) = own
                && !own.contains_key(name)
            {
                own.insert(name.to_owned(), value);
                self.params.remove(&key);
            }
        }
    }
}

/// Reads a truth file's text.
///
/// # Errors
/// [`TruthError`] where the text is no such list, or names a test twice.
pub fn parse_truths(text: &str) -> Result<TruthFile, TruthError> {
    let entries: Vec<Entry> =
        serde_json::from_str(text).map_err(|source| TruthError::Shape { source })?;
    let mut truths: Vec<Truth> = Vec::new();
    let mut doubts = Vec::new();
    for mut entry in entries {
        entry.sort_parameters();
        if truths.iter().any(|truth| truth.name == entry.name) {
            return Err(TruthError::Twice { name: entry.name });
        }
        let found = doubts_of(&entry).into_iter();
        doubts.extend(found.map(|doubt| format!("the test \"{}\": {doubt}", entry.name)));
        let mut planted = Vec::new();
        for name in &entry.effects {
            let Ok(id) = EffectId::parse(name) else {
                planted.push(Planted::OutOfCatalogue(name.clone()));
                continue;
            };
            // The numbers under the effect's name, or by themselves where there is but one effect.
            let given: Vec<(&String, &Value)> = match entry.params.get(name) {
                Some(Value::Object(own)) => own.iter().collect(),
                _ if entry.effects.len() == 1 => entry.params.iter().collect(),
                _ => Vec::new(),
            };
            let numbers = given.into_iter();
            let numbers = numbers.filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)));
            planted.push(Planted::Catalogue(id, numbers.collect()));
        }
        truths.push(Truth {
            effects: planted,
            name: entry.name,
            detectable: entry.detectable,
            refutable: entry.refutable,
            within_tolerance: entry.within_tolerance,
        });
    }
    Ok(TruthFile { truths, doubts })
}

/// Names what may be a slip of the pen: ids near one of the catalogue, keys and parameters that are not used.
fn doubts_of(entry: &Entry) -> Vec<String> {
    let mut doubts = Vec::new();
    for effect in &entry.effects {
        doubts.extend(hint(effect).map(|hint| {
            format!(
                "the catalogue has no effect `{effect}`, so that it counts as something outside the catalogue{hint}"
            )
        }));
    }
    for key in entry.unknown.keys() {
        doubts.push(format!(
            "the key `{key}` is not known and is left out; known: name, effects, params, detectable, refutable, \
             within_tolerance"
        ));
    }
    let effects = entry.known_effects();
    if entry.within_tolerance == Some(true) && effects.iter().all(|id| id.group() != Group::Scale) {
        doubts.push(
            "`within_tolerance` is true, but no modulus, length, density, thickness or timebase is among the effects; all \
             of them count"
                .to_owned(),
        );
    }
    // Faults outside the catalogue have parameters of their own.
    if effects.len() != entry.effects.len() {
        return doubts;
    }
    let mut unused: Vec<(&str, String)> = Vec::new();
    for (key, value) in &entry.params {
        if let Some(&id) = effects.iter().find(|id| id.name() == key)
            && let Value::Object(values) = value
        {
            let names = parameter_names(id);
            for (name, value) in values {
                if !(names.contains(&name.as_str()) && value.is_number()) {
                    unused.push((name, names.join(", ")));
                }
            }
            continue;
        }
        let allowed = match effects[..] {
            [] => "none, for nothing was planted".to_owned(),
            [id] => {
                let names = parameter_names(id);
                if names.contains(&key.as_str()) && value.is_number() {
                    continue;
                }
                names.join(", ")
            }
            _ => {
                let ids: Vec<&str> = effects.iter().map(|id| id.name()).collect();
                format!(
                    "{} with their own parameters in braces, and what only one of them has",
                    ids.join(", ")
                )
            }
        };
        unused.push((key, allowed));
    }
    for (parameter, allowed) in unused {
        doubts.push(format!(
            "`{parameter}` is no parameter with a number of its effects and is left out of the errors of size; \
             allowed: {allowed}"
        ));
    }
    doubts
}

/// The names of an effect's parameters.
fn parameter_names(id: EffectId) -> Vec<&'static str> {
    id.parameters().iter().map(|info| info.name).collect()
}

/// Names the effect that an id outside the catalogue may mean. `None` where nothing speaks for a slip: of an id in it,
/// of one that virtual tests are drawn with, and of one that is like none of these.
fn hint(effect: &str) -> Option<String> {
    let Err(error) = EffectId::parse(effect) else {
        return None;
    };
    if OutOfCatalogueKind::ALL
        .iter()
        .any(|kind| kind.name() == effect)
    {
        return None;
    }
    if effect.is_empty() || effect == "none" {
        return Some("; where nothing was planted write `\"effects\": []`".to_owned());
    }
    match error {
        EffectError::UnknownEffect { nearest, .. } => {
            nearest.map(|name| format!("; did you mean `{name}`?"))
        }
        _ => None,
    }
}

/// SHA-256 of a text, in hexadecimal digits. Printed before the diagnosis begins; whoever has the
/// text can check afterwards that it is the one that was meant.
pub fn commitment(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .fold(String::with_capacity(64), |mut digits, byte| {
            // Writing to a string cannot fail.
            let _ = write!(digits, "{byte:02x}");
            digits
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_digest_of_abc() {
        // FIPS 180-4, example of the standard.
        assert_eq!(
            commitment("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }
}
