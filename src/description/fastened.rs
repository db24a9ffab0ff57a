//! `[[recording.mass]]`: known masses that are fastened to the beam for a recording.

use super::keys;
use super::reader::{DescriptionError, Entry, Limits, with_unit};
use super::structure::along;
use super::{BeamDescription, SensorDescription};
use tapjoint_beam::specimen::PointMass;
use tapjoint_numerics::quantity::Dimension;

/// Largest mass on a beam, in masses of the beam. More of it leaves no beam to tap, and its modes are found slowly.
const HEAVIEST: f64 = 3.0;
/// Most masses fastened for one recording.
const MOST_MASSES: usize = 100;
/// Largest mass that is fastened to a beam for a test; the heaviest beams take more than a kilogram.
const FASTENED_MASS: Limits = Limits::above(
    0.0,
    1e3,
    "give what it weighs in kg, or with its unit: \"50 g\"; leave the table out where nothing is fastened",
);

/// Names and masses, one of each for every mass.
pub(super) type Fastened = (Vec<Option<String>>, Vec<PointMass>);

/// Reads the masses of a recording, in the order of the file.
pub(super) fn read_fastened(
    entry: &Entry<'_>,
    beam: &BeamDescription,
    sensors: &[SensorDescription],
) -> Result<Fastened, DescriptionError> {
    let wanted = "a list of tables, each under its own header [[recording.mass]],";
    let (mut names, mut masses) = (Vec::new(), Vec::new());
    for entry in entry.list_up_to(MOST_MASSES, wanted)? {
        let table = entry.table(&keys::FASTENED)?;
        let name = table.optional("name", |entry| {
            let name = entry.text("a name such as \"L1\"")?;
            let is_taken = names.contains(&Some(name.clone()))
                || sensors.iter().any(|sensor| sensor.name == name);
            if is_taken {
                return Err(entry.error(format!(
                    "the name \"{name}\" belongs to another mass of this recording, or to a sensor; give each a name of its own"
                )));
            }
            Ok(name)
        })?;
        let position = table.need("position", "its place on the beam (m)", "position = 0.20")?;
        let weight = table.need("mass", "what it weighs (kg)", "mass = \"50 g\"")?;
        let position = position.within(Dimension::Length, &along(beam.length))?;
        let mass = weight.within(Dimension::Mass, &FASTENED_MASS)?;
        check_weight(&weight, mass, beam, "did you mean g? Write \"50 g\"")?;
        names.push(name);
        masses.push(PointMass::new(position, mass));
    }
    Ok((names, masses))
}

/// Warns of what weighs (kg) more than the beam itself, and refuses what weighs more than [`HEAVIEST`].
pub(super) fn check_weight(
    entry: &Entry<'_>,
    mass: f64,
    beam: &BeamDescription,
    question: &str,
) -> Result<(), DescriptionError> {
    let beam_mass = beam.length * beam.width * beam.thickness * beam.density;
    if mass > HEAVIEST * beam_mass {
        let most = with_unit(HEAVIEST * beam_mass, "kg");
        let allowed = format!("up to {most}, {HEAVIEST} times the mass of the beam");
        return Err(entry.impossible(mass, "kg", &allowed, question));
    }
    if mass > beam_mass {
        let usual = format!("less than the beam's {}", with_unit(beam_mass, "kg"));
        entry.unusual(mass, "kg", &usual, question);
    }
    Ok(())
}
