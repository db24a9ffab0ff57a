//! `--with EFFECT:key=value,...`.

use std::str::FromStr;
use tapjoint::effects::{self, Effect, EffectId};
use tapjoint::quantity::{Dimension, parse_quantity};

/// An effect as the command line names it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlantedArgument(pub(super) Effect);

impl FromStr for PlantedArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, parameters) = text.split_once(':').unwrap_or((text, ""));
        let id = EffectId::parse(name.trim()).map_err(|error| error.to_string())?;
        let parts = parameters.split(',').filter(|part| !part.trim().is_empty());
        let pairs = parts
            .map(|part| pair(id, part))
            .collect::<Result<Vec<_>, _>>()?;
        Effect::from_pairs(id, &pairs)
            .map(Self)
            .map_err(|error| error.to_string())
    }
}

fn pair(id: EffectId, text: &str) -> Result<(&str, f64), String> {
    let (key, value) = text.split_once('=').ok_or_else(|| {
        format!(
            "\"{}\" has no value; write {}:key=value, such as {}",
            text.trim(),
            id.name(),
            example(id)
        )
    })?;
    let (key, value) = (key.trim(), value.trim());
    let info = id.parameter(key).map_err(|error| error.to_string())?;
    let number = match quantity(info.dimension) {
        Some(dimension) => parse_quantity(value, dimension).map_err(|error| error.to_string()),
        None => value
            .parse()
            .map_err(|_| format!("{key}: \"{value}\" is not a number")),
    };
    Ok((key, number?))
}

fn example(id: EffectId) -> String {
    let names: Vec<String> = id
        .parameters()
        .iter()
        .map(|info| format!("{}={}", info.name, info.typical.unwrap_or(1.0)))
        .collect();
    format!("{}:{}", id.name(), names.join(","))
}

/// The dimension in which a text with a unit is read; `None` = a plain number.
fn quantity(dimension: effects::Dimension) -> Option<Dimension> {
    match dimension {
        effects::Dimension::None => Some(Dimension::Ratio),
        effects::Dimension::Mass => Some(Dimension::Mass),
        effects::Dimension::Stiffness => Some(Dimension::TranslationalStiffness),
        effects::Dimension::Frequency => Some(Dimension::Frequency),
        effects::Dimension::Length => Some(Dimension::Length),
        effects::Dimension::Force => Some(Dimension::Force),
        effects::Dimension::Inertia => None,
    }
}
