//! `[[effect]]`: what a model that was brought up to date has besides beam and joint.

use super::EffectDescription;
use super::error::DescriptionError;
use super::keys;
use super::reader::Entry;
use tapjoint_numerics::quantity::Dimension;

/// Reads one `[[effect]]`. Whether there is such an effect with such parameters is for whoever uses it to
/// say.
pub(super) fn read_effect(entry: &Entry<'_>) -> Result<EffectDescription, DescriptionError> {
    let table = entry.table(&keys::EFFECT)?;
    let id = table
        .need("id", "the effect's name", "id = \"sensor-mass\"")?
        .text("an effect such as \"sensor-mass\"")?;
    let values = table
        .all()
        .filter(|(key, _)| *key != "id")
        .map(|(key, entry)| Ok((key.to_owned(), entry.quantity(dimension(key))?)))
        .collect::<Result<_, DescriptionError>>()?;
    Ok(EffectDescription {
        id,
        values,
        line: entry.line,
    })
}

fn dimension(key: &str) -> Dimension {
    match key {
        "mass" => Dimension::Mass,
        "position" => Dimension::Length,
        "stiffness" => Dimension::TranslationalStiffness,
        "frequency" | "offset" => Dimension::Frequency,
        "force" => Dimension::Force,
        // Inertias too are plain numbers (kg m2).
        _ => Dimension::Ratio,
    }
}
