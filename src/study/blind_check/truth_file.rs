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
use tapjoint_beam::effects::{EffectError, EffectId};

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

/// The truths of a file, and what about them is odd.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthFile {
    /// One for each test, in the order of the file.
    pub truths: Vec<Truth>,
    /// Oddities that keep no truth from being used.
    pub doubts: Vec<TruthDoubt>,
}

/// Something in a truth file that may be a slip of the pen.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TruthDoubt {
    /// An id that the catalogue does not have, and that is near one which it has, or says that there is none.
    #[error(
        "the test \"{test}\": the catalogue has no effect `{effect}`, so that it counts as something outside \
         the catalogue{hint}"
    )]
    OutOfCatalogue {
        /// The test.
        test: String,
        /// The id.
        effect: String,
        /// `; did you mean ...?`, or what to write instead.
        hint: String,
    },
    /// A parameter that is not used.
    #[error(
        "the test \"{test}\": `{parameter}` is no parameter with a number of its effects and is left out of the \
         errors of size; allowed: {allowed}"
    )]
    Parameter {
        /// The test.
        test: String,
        /// The parameter.
        parameter: String,
        /// Those that are known.
        allowed: String,
    },
    /// A key that is not used.
    #[error(
        "the test \"{test}\": the key `{key}` is not known and is left out; known: name, effects, params, \
         detectable, refutable"
    )]
    Key {
        /// The test.
        test: String,
        /// The key.
        key: String,
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

    /// Gives parameters to the effect that has them: those written as `effect.parameter`, and of several effects those
    /// that only one of them knows, unless one lies outside the catalogue and has parameters of its own. What is given
    /// twice stays where it is, and is told.
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
        doubts.extend(doubts_of(&entry));
        truths.push(truth_of(entry));
    }
    Ok(TruthFile { truths, doubts })
}

fn doubts_of(entry: &Entry) -> Vec<TruthDoubt> {
    let mut doubts = Vec::new();
    for effect in &entry.effects {
        if let Some(hint) = hint(effect) {
            doubts.push(TruthDoubt::OutOfCatalogue {
                test: entry.name.clone(),
                effect: effect.clone(),
                hint,
            });
        }
    }
    for key in entry.unknown.keys() {
        doubts.push(TruthDoubt::Key {
            test: entry.name.clone(),
            key: key.clone(),
        });
    }
    let known = entry.known_effects();
    // Faults outside the catalogue have parameters of their own.
    if known.len() == entry.effects.len() {
        for (parameter, allowed) in unused_parameters(entry, &known) {
            doubts.push(TruthDoubt::Parameter {
                test: entry.name.clone(),
                parameter,
                allowed,
            });
        }
    }
    doubts
}

/// The names of an effect's parameters.
fn parameter_names(id: EffectId) -> Vec<&'static str> {
    id.parameters().iter().map(|info| info.name).collect()
}

/// What may have been meant by an id outside the catalogue; `None` where nothing speaks for a slip: of an id in it,
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

/// Parameters that no effect of the entry takes up, each with those that would be.
fn unused_parameters(entry: &Entry, effects: &[EffectId]) -> Vec<(String, String)> {
    let mut unused = Vec::new();
    for (key, value) in &entry.params {
        if let Some(&id) = effects.iter().find(|id| id.name() == key)
            && let Value::Object(values) = value
        {
            let names = parameter_names(id);
            for (name, value) in values {
                if !(names.contains(&name.as_str()) && value.is_number()) {
                    unused.push((name.clone(), names.join(", ")));
                }
            }
            continue;
        }
        let allowed = match effects {
            [] => "none, for nothing was planted".to_owned(),
            [id] => {
                let names = parameter_names(*id);
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
        unused.push((key.clone(), allowed));
    }
    unused
}

fn truth_of(entry: Entry) -> Truth {
    let mut planted = Vec::new();
    for name in &entry.effects {
        planted.push(match EffectId::parse(name) {
            Ok(id) => Planted::Catalogue(id, parameters_of(&entry, name)),
            Err(_) => Planted::OutOfCatalogue(name.clone()),
        });
    }
    Truth {
        effects: planted,
        name: entry.name,
        detectable: entry.detectable,
        refutable: entry.refutable,
    }
}

/// The numbers given for an effect: under its name, or by themselves where there is but one effect.
fn parameters_of(entry: &Entry, effect: &str) -> BTreeMap<String, f64> {
    let values: Vec<(&String, &Value)> = match entry.params.get(effect) {
        Some(Value::Object(own)) => own.iter().collect(),
        _ if entry.effects.len() == 1 => entry.params.iter().collect(),
        _ => Vec::new(),
    };
    let numbers = values.into_iter();
    numbers
        .filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)))
        .collect()
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
