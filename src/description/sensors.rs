//! `[hammer]` and `[[sensor]]`: which channel carries what.

use super::error::{DescriptionError, DescriptionProblem, DescriptionWarning, Doubt};
use super::reader::Limits;
use super::reader::{Entry, Table};
use super::structure::along;
use super::{
    BeamDescription, ChannelPlace, ChannelRef, HammerDescription, RecordingDescription, Scale,
    SensorDescription, SensorKind, keys,
};
use tapjoint_numerics::quantity::Dimension;

const KINDS: [(&str, SensorKind); 4] = [
    ("acceleration", SensorKind::Acceleration),
    ("velocity", SensorKind::Velocity),
    ("displacement", SensorKind::Displacement),
    ("sound", SensorKind::Sound),
];
/// More channels than any recorder writes into one file.
const CHANNELS: Limits = Limits::between(
    1.0,
    4096.0,
    "channels count from 1, a time column does not count",
);
const SCALE: Limits = Limits::between(
    -1e15,
    1e15,
    "give SI units per unit of the file; a negative scale turns the direction",
);
const SENSOR_MASS: Limits = Limits::between(
    0.0,
    1e3,
    "give the data sheet's mass in kg, or with its unit: \"24 g\"",
);

/// Reads `[hammer]`.
pub(super) fn read_hammer(table: &Table<'_>) -> Result<HammerDescription, DescriptionError> {
    let channel = table.need("channel", "the hammer's channel", "channel = 1")?;
    Ok(HammerDescription {
        channel: read_channel(&channel)?,
        place: place_of(&channel),
        scale: read_scale(table, Dimension::Force, Dimension::ForceSensitivity)?,
    })
}

/// Reads all `[[sensor]]` tables; `hammer` is the entry of the hammer's channel.
pub(super) fn read_sensors(
    entries: &[Entry<'_>],
    hammer: Option<&Entry<'_>>,
    beam: &BeamDescription,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<Vec<SensorDescription>, DescriptionError> {
    let mut sensors: Vec<SensorDescription> = Vec::new();
    let mut names: Vec<(String, usize)> = Vec::new();
    let mut channels: Vec<(ChannelRef, usize)> = Vec::new();
    if let Some(entry) = hammer {
        channels.push((read_channel(entry)?, entry.line));
    }
    for entry in entries {
        let table = entry.table(&keys::SENSOR)?;
        let sensor = read_sensor(&table, beam, warnings)?;
        let name = table.get("name");
        let name = name.as_ref().unwrap_or(entry);
        let channel = table.get("channel");
        let channel = channel.as_ref().unwrap_or(name);
        claim(
            &mut names,
            sensor.name.clone(),
            name,
            "give each sensor a name of its own",
        )?;
        let remedy = "give each sensor, and the hammer, a channel of its own";
        claim(&mut channels, sensor.channel.clone(), channel, remedy)?;
        sensors.push(sensor);
    }
    Ok(sensors)
}

/// Notes that `value` is taken, unless it was before.
fn claim<T: PartialEq + Claimable>(
    taken: &mut Vec<(T, usize)>,
    value: T,
    entry: &Entry<'_>,
    remedy: &'static str,
) -> Result<(), DescriptionError> {
    if let Some((_, first_line)) = taken.iter().find(|(other, _)| *other == value) {
        let (value, first_line) = (value.in_words(), *first_line);
        return Err(entry.error(DescriptionProblem::Duplicate {
            value,
            first_line,
            remedy,
        }));
    }
    taken.push((value, entry.line));
    Ok(())
}

/// What two sensors must not share.
trait Claimable {
    fn in_words(&self) -> String;
}

impl Claimable for String {
    fn in_words(&self) -> String {
        format!("the name \"{self}\"")
    }
}

impl Claimable for ChannelRef {
    fn in_words(&self) -> String {
        format!("channel {self}")
    }
}

fn read_sensor(
    table: &Table<'_>,
    beam: &BeamDescription,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<SensorDescription, DescriptionError> {
    let named = table.need("name", "a name", "name = \"A\"")?;
    let name = named.text("a name such as \"A\"")?;
    let kind = table.optional("kind", |entry| entry.choice(&KINDS))?;
    let kind = kind.unwrap_or(SensorKind::Acceleration);
    let channel = table.optional("channel", read_channel)?;
    let (signal, sensitivity) = dimensions(kind);
    let sensor = SensorDescription {
        channel: channel.unwrap_or_else(|| ChannelRef::Name(name.clone())),
        place: place_of(&table.get("channel").unwrap_or(named)),
        name,
        scale: read_scale(table, signal, sensitivity)?,
        position: table.optional("position", |entry| read_position(entry, kind, beam.length))?,
        mass: table.optional("mass", |entry| entry.within(Dimension::Mass, &SENSOR_MASS))?,
        kind,
    };
    check_mass(table, &sensor, beam, warnings)?;
    Ok(sensor)
}

/// What a sensor's signal is measured in, and its sensitivity.
fn dimensions(kind: SensorKind) -> (Dimension, Dimension) {
    match kind {
        SensorKind::Acceleration => (Dimension::Acceleration, Dimension::AccelerationSensitivity),
        SensorKind::Velocity => (Dimension::Velocity, Dimension::VelocitySensitivity),
        SensorKind::Displacement => (Dimension::Length, Dimension::DisplacementSensitivity),
        SensorKind::Sound => (Dimension::Pressure, Dimension::PressureSensitivity),
    }
}

/// A microphone stands beside the beam, so its position is not held against the beam's length.
fn read_position(
    entry: &Entry<'_>,
    kind: SensorKind,
    length: f64,
) -> Result<f64, DescriptionError> {
    match kind {
        SensorKind::Sound => entry.quantity(Dimension::Length),
        _ => entry.within(Dimension::Length, &along(length)),
    }
}

/// Warns of masses that some recording leaves without a place, or the description where there is no recording: a mass
/// acts on the beam where it sits, and without a place only the diagnosis has a use for it.
pub(super) fn check_places(
    entries: &[Entry<'_>],
    sensors: &[SensorDescription],
    recordings: &[RecordingDescription],
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<(), DescriptionError> {
    for (entry, sensor) in entries.iter().zip(sensors) {
        let is_placed = match recordings {
            [] => sensor.position.is_some(),
            all => all.iter().all(|one| one.place_of(sensor).is_some()),
        };
        let mass = entry.table(&keys::SENSOR)?.get("mass");
        if let Some(mass) = mass.filter(|_| !is_placed && sensor.kind != SensorKind::Sound) {
            warnings.push(mass.warning(Doubt::Unplaced));
        }
    }
    Ok(())
}

/// What is doubtful about a mass wherever it sits.
fn check_mass(
    table: &Table<'_>,
    sensor: &SensorDescription,
    beam: &BeamDescription,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<(), DescriptionError> {
    let Some((entry, mass)) = table.get("mass").zip(sensor.mass) else {
        return Ok(());
    };
    if sensor.kind == SensorKind::Sound {
        let reason = "a microphone does not sit on the beam; remove `mass`";
        warnings.push(entry.warning(Doubt::NoMeaning { reason }));
        return Ok(());
    }
    let beam_mass = beam.length * beam.width * beam.thickness * beam.density;
    if mass > beam_mass {
        let usual = format!(
            "less than the beam's {}",
            crate::error::with_unit(beam_mass, "kg")
        );
        let question = "did you mean g? Write \"24 g\"";
        let doubt = Doubt::Implausible {
            value: mass,
            unit: "kg",
            usual,
            question,
        };
        warnings.push(entry.warning(doubt));
    }
    Ok(())
}

/// Where a channel is named.
fn place_of(entry: &Entry<'_>) -> ChannelPlace {
    ChannelPlace {
        line: entry.line,
        key: entry.path.clone(),
    }
}

fn read_channel(entry: &Entry<'_>) -> Result<ChannelRef, DescriptionError> {
    if entry.as_text().is_some() {
        return entry
            .text("a channel number or a column's name")
            .map(ChannelRef::Name);
    }
    entry.count(&CHANNELS).map(ChannelRef::Number)
}

/// The scale, or what a sensitivity makes of volts: SI = volts / sensitivity.
fn read_scale(
    table: &Table<'_>,
    signal: Dimension,
    sensitivity: Dimension,
) -> Result<Option<Scale>, DescriptionError> {
    match (table.get("scale"), table.get("sensitivity")) {
        (Some(_), Some(entry)) => Err(entry.error(DescriptionProblem::Conflict {
            reason: "`scale` and `sensitivity` say the same thing twice".into(),
            remedy: "keep `scale` (SI units per unit of the file) or `sensitivity` (files in volts)",
        })),
        (Some(entry), None) => Ok(Some(Scale::PerUnit(nonzero(&entry, signal)?))),
        (None, Some(entry)) => {
            let volts = nonzero(&entry, sensitivity)?;
            let scale = volts.recip();
            if scale.abs() > 1e15 {
                let allowed = Limits::between(-1e15, 1e15, "check the sensitivity's exponent");
                return Err(entry.out_of_range(volts, sensitivity.si_unit(), &allowed));
            }
            Ok(Some(Scale::PerVolt(scale)))
        }
        (None, None) => Ok(None),
    }
}

fn nonzero(entry: &Entry<'_>, dimension: Dimension) -> Result<f64, DescriptionError> {
    let value = entry.within(dimension, &SCALE)?;
    if value != 0.0 {
        return Ok(value);
    }
    Err(entry.error(DescriptionProblem::OutOfRange {
        value,
        unit: dimension.si_unit(),
        allowed: "any number but zero".to_owned(),
        remedy: "remove the key for a scale of 1".to_owned(),
    }))
}
