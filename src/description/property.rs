//! Properties of a beam: limits, usual ranges, and how they are read.

use super::reader::{DescriptionError, Entry, Limits, Table, number, with_unit};
use tapjoint_numerics::quantity::Dimension;

/// A property of a beam with its limits and its usual range.
pub(super) struct Property {
    pub(super) key: &'static str,
    /// Words for a missing property.
    wanted: &'static str,
    example: &'static str,
    pub(super) dimension: Dimension,
    limits: Limits,
    /// Lowest and highest usual value.
    usual: [f64; 2],
    /// Question about an unusual value.
    question: &'static str,
}

// The limits are physical (no solid is denser than 1e5 kg/m3 or stiffer than 1e13 Pa), beyond the reach of a hammer, or
// below any beam: foams have 20 kg/m3 and 1 MPa. A number in GPa or g/cm3 without its unit lies outside. Within them no frequency leaves the range of numbers. The usual ranges are those of beams that
// people tap.
pub(super) const LENGTH: Property = Property {
    key: "length",
    wanted: "a length (m)",
    example: "length = \"423 mm\"",
    dimension: Dimension::Length,
    limits: Limits::between(
        1e-3,
        1e3,
        "give the free length in m, or with its unit: \"423 mm\"",
    ),
    usual: [5e-3, 20.0],
    question: "did you mean mm? Write \"423 mm\"",
};
pub(super) const WIDTH: Property = Property {
    key: "width",
    wanted: "a width (m)",
    example: "width = \"50 mm\"",
    dimension: Dimension::Length,
    limits: Limits::between(
        1e-6,
        1e3,
        "give the width in m, or with its unit: \"50 mm\"",
    ),
    usual: [1e-4, 2.0],
    question: "did you mean mm? Write \"50 mm\"",
};
pub(super) const THICKNESS: Property = Property {
    key: "thickness",
    wanted: "a thickness (m)",
    example: "thickness = \"5 mm\"",
    dimension: Dimension::Length,
    limits: Limits::between(
        1e-6,
        1e3,
        "give the thickness in m, or with its unit: \"5 mm\"",
    ),
    usual: [1e-5, 0.5],
    question: "did you mean mm? Write \"5 mm\"",
};
pub(super) const MODULUS: Property = Property {
    key: "modulus",
    wanted: "Young's modulus (Pa)",
    example: "modulus = \"207 GPa\"",
    dimension: Dimension::Pressure,
    limits: Limits::between(
        1e5,
        1e13,
        "give Young's modulus in Pa, or with its unit: \"207 GPa\"",
    ),
    usual: [1e6, 2e12],
    question: "did you mean GPa? Write \"207 GPa\"",
};
pub(super) const DENSITY: Property = Property {
    key: "density",
    wanted: "a density (kg/m3)",
    example: "density = 7850",
    dimension: Dimension::Density,
    limits: Limits::between(
        10.0,
        1e5,
        "give the density in kg/m3, or with its unit: \"7.85 g/cm3\"",
    ),
    usual: [20.0, 25e3],
    question: "did you mean g/cm3? Write \"7.85 g/cm3\"",
};
/// An isotropic solid is stable only within these limits.
pub(super) const POISSON: Limits =
    Limits::above(-1.0, 0.5, "metals have 0.25 to 0.35; leave it out for 0.3");
/// Reads a length (m) of the beam: the free one in a recording, or that of the whole bar.
pub(super) fn read_free_length(entry: &Entry<'_>) -> Result<f64, DescriptionError> {
    read_property(entry, &LENGTH)
}

pub(super) fn needed(table: &Table<'_>, property: &Property) -> Result<f64, DescriptionError> {
    let entry = table.need(property.key, property.wanted, property.example)?;
    read_property(&entry, property)
}

pub(super) fn optional(
    table: &Table<'_>,
    property: &Property,
) -> Result<Option<f64>, DescriptionError> {
    table.optional(property.key, |entry| read_property(entry, property))
}

pub(super) fn read_property(
    entry: &Entry<'_>,
    property: &Property,
) -> Result<f64, DescriptionError> {
    let value = entry.within(property.dimension, &property.limits)?;
    let [low, high] = property.usual;
    if !(low..=high).contains(&value) {
        let unit = property.dimension.si_unit();
        let usual = format!("{} to {}", number(low), with_unit(high, unit));
        entry.unusual(value, unit, &usual, property.question);
    }
    Ok(value)
}
