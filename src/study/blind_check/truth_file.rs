//! The truth of tests made elsewhere: a JSON list of `{"name", "effects": [...], "params": {...}}`.
//!
//! An empty list of effects means that nothing was planted; an id that the catalogue does not have
//! means something outside it. Parameters may stand under their effect's id, or by themselves where
//! there is but one effect. `"detectable"` and `"refutable"` say whether the effect could be noticed, and
//! whether the catalogue could be seen not to explain it; both may be left out. What a slip of the pen may
//! have left is told as a doubt: it would change the score without a word.
//!
//! A promise that the answers are not changed after the diagnosis has been seen.

use super::case::{Planted, Truth};
use super::planted_effects::OutsideKind;
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
    Outside {
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
    /// Gives parameters to the effect that has them: those written as `effect.parameter`, and of several effects those
    /// that only one of them knows, unless one lies outside the catalogue and has parameters of its own. What is given
    /// twice stays where it is, and is told.
    fn sort_parameters(&mut self) {
        let effects: Vec<EffectId> = self
            .effects
            .iter()
            .filter_map(|name| EffectId::parse(name).ok())
            .collect();
        let all_known = effects.len() == self.effects.len() && effects.len() > 1;
        let has = |id: &EffectId, name: &str| id.parameters().iter().any(|info| info.name == name);
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
            let owners = effects
                .iter()
                .filter(|id| effect.is_none_or(|effect| id.name() == effect) && has(id, name));
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
    let test = || entry.name.clone();
    let keys = entry.unknown.keys().map(|key| TruthDoubt::Key {
        test: test(),
        key: key.clone(),
    });
    let effects = entry.effects.iter().filter_map(|effect| {
        Some(TruthDoubt::Outside {
            test: test(),
            effect: effect.clone(),
            hint: hint(effect)?,
        })
    });
    let known: Vec<EffectId> = entry
        .effects
        .iter()
        .filter_map(|name| EffectId::parse(name).ok())
        .collect();
    let mut all: Vec<TruthDoubt> = effects.chain(keys).collect();
    // What lies outside the catalogue has parameters of its own.
    if known.len() == entry.effects.len() {
        all.extend(
            unused_parameters(entry, &known)
                .into_iter()
                .map(|(parameter, allowed)| TruthDoubt::Parameter {
                    test: test(),
                    parameter,
                    allowed,
                }),
        );
    }
    all
}

/// What may have been meant by an id outside the catalogue; `None` where nothing speaks for a slip: of an id in it,
/// of one that virtual tests are drawn with, and of one that is like none of these.
fn hint(effect: &str) -> Option<String> {
    let Err(error) = EffectId::parse(effect) else {
        return None;
    };
    if OutsideKind::ALL.iter().any(|kind| kind.name() == effect) {
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
    let names = |id: EffectId| id.parameters().iter().map(|info| info.name);
    let mut unused = Vec::new();
    for (key, value) in &entry.params {
        let own = effects.iter().find(|id| id.name() == key);
        match (own, value, effects) {
            (Some(&id), Value::Object(values), _) => {
                let odd = values.iter().filter(|(name, value)| {
                    !(names(id).any(|known| known == *name) && value.is_number())
                });
                let allowed = || names(id).collect::<Vec<_>>().join(", ");
                unused.extend(odd.map(|(name, _)| (name.clone(), allowed())));
            }
            (_, value, [id]) if names(*id).any(|known| known == key) && value.is_number() => {}
            (_, _, [id]) => unused.push((key.clone(), names(*id).collect::<Vec<_>>().join(", "))),
            (_, _, []) => unused.push((key.clone(), "none, for nothing was planted".to_owned())),
            _ => {
                let ids: Vec<&str> = effects.iter().map(|id| id.name()).collect();
                let allowed = format!(
                    "{} with their own parameters in braces, and what only one of them has",
                    ids.join(", ")
                );
                unused.push((key.clone(), allowed));
            }
        }
    }
    unused
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
