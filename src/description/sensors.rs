//! `[hammer]` and `[[sensor]]`: channels of the recordings and their scales.

use super::error::{DescriptionError, DescriptionProblem, Doubt, with_unit};
use super::reader::{Entry, Limits, Table};
use super::structure::along;
use super::{
    BeamDescription, ChannelPlace, ChannelRef, HammerDescription, RecordingDescription, Scale,
    SensorDescription, SensorKind, keys,
};
use tapjoint_numerics::quantity::Dimension;

/// Words of `kind` in `[[sensor]]`.
pub const SENSOR_KINDS: [(&str, SensorKind); 4] = [
    ("acceleration", SensorKind::Acceleration),
    ("velocity", SensorKind::Velocity),
    ("displacement", SensorKind::Displacement),
    ("sound", SensorKind::Sound),
];
/// No recorder writes more channels into one file.
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

/// Names or channels that are taken, each with its line.
struct Taken<T>(Vec<(T, usize)>);

impl<T: PartialEq> Taken<T> {
    /// Adds a value, unless it is taken already. `words` name it in a message.
    fn add(
        &mut self,
        value: T,
        words: String,
        entry: &Entry<'_>,
        remedy: &'static str,
    ) -> Result<(), DescriptionError> {
        if let Some((_, first_line)) = self.0.iter().find(|(other, _)| *other == value) {
            return Err(entry.error(DescriptionProblem::Duplicate {
                value: words,
                first_line: *first_line,
                remedy,
            }));
        }
        self.0.push((value, entry.line));
        Ok(())
    }
}

/// Reads all `[[sensor]]` tables. `hammer` is the entry of the hammer's channel.
pub(super) fn read_sensors(
    entries: &[Entry<'_>],
    hammer: Option<&Entry<'_>>,
    beam: &BeamDescription,
) -> Result<Vec<SensorDescription>, DescriptionError> {
    let mut sensors: Vec<SensorDescription> = Vec::new();
    let mut names = Taken(Vec::new());
    let mut channels = Taken(Vec::new());
    if let Some(entry) = hammer {
        channels.0.push((read_channel(entry)?, entry.line));
    }
    for entry in entries {
        let table = entry.table(&keys::SENSOR)?;
        let sensor = read_sensor(&table, beam)?;
        let name = table.get("name");
        let name = name.as_ref().unwrap_or(entry);
        let channel = table.get("channel");
        let channel = channel.as_ref().unwrap_or(name);
        names.add(
            sensor.name.clone(),
            format!("the name \"{}\"", sensor.name),
            name,
            "give each sensor a name of its own",
        )?;
        channels.add(
            sensor.channel.clone(),
            format!("channel {}", sensor.channel),
            channel,
            "give each sensor, and the hammer, a channel of its own",
        )?;
        sensors.push(sensor);
    }
    Ok(sensors)
}

fn read_sensor(
    table: &Table<'_>,
    beam: &BeamDescription,
) -> Result<SensorDescription, DescriptionError> {
    let named = table.need("name", "a name", "name = \"A\"")?;
    let name = named.text("a name such as \"A\"")?;
    let kind = table.optional("kind", |entry| entry.choice(&SENSOR_KINDS))?;
    let kind = kind.unwrap_or(SensorKind::Acceleration);
    let channel = table.optional("channel", read_channel)?;
    let (signal, sensitivity) = match kind {
        SensorKind::Acceleration => (Dimension::Acceleration, Dimension::AccelerationSensitivity),
        SensorKind::Velocity => (Dimension::Velocity, Dimension::VelocitySensitivity),
        SensorKind::Displacement => (Dimension::Length, Dimension::DisplacementSensitivity),
        SensorKind::Sound => (Dimension::Pressure, Dimension::PressureSensitivity),
    };
    let sensor = SensorDescription {
        channel: channel.unwrap_or_else(|| ChannelRef::Name(name.clone())),
        place: place_of(&table.get("channel").unwrap_or(named)),
        name,
        scale: read_scale(table, signal, sensitivity)?,
        position: table.optional("position", |entry| match kind {
            // A microphone stands beside the beam, perhaps beyond its end.
            SensorKind::Sound => entry.quantity(Dimension::Length),
            _ => entry.within(Dimension::Length, &along(beam.length)),
        })?,
        mass: table.optional("mass", |entry| entry.within(Dimension::Mass, &SENSOR_MASS))?,
        kind,
    };
    if let Some((entry, mass)) = table.get("mass").zip(sensor.mass) {
        let beam_mass = beam.length * beam.width * beam.thickness * beam.density;
        if kind == SensorKind::Sound {
            let reason = "a microphone does not sit on the beam; remove `mass`";
            entry.warn(Doubt::NoMeaning { reason });
        } else if mass > beam_mass {
            entry.warn(Doubt::Implausible {
                value: mass,
                unit: "kg",
                usual: format!("less than the beam's {}", with_unit(beam_mass, "kg")),
                question: "did you mean g? Write \"24 g\"",
            });
        }
    }
    Ok(sensor)
}

/// Warns of each mass without a place in some recording, or in the description if there is no recording.
///
/// A mass acts on the beam where it sits. Without a place only the diagnosis can use it.
pub(super) fn check_places(
    entries: &[Entry<'_>],
    sensors: &[SensorDescription],
    recordings: &[RecordingDescription],
) -> Result<(), DescriptionError> {
    for (entry, sensor) in entries.iter().zip(sensors) {
        let is_placed = match recordings {
            [] => sensor.position.is_some(),
            all => all.iter().all(|one| one.place_of(sensor).is_some()),
        };
        let mass = entry.table(&keys::SENSOR)?.get("mass");
        if let Some(mass) = mass.filter(|_| !is_placed && sensor.kind != SensorKind::Sound) {
            mass.warn(Doubt::Unplaced);
        }
    }
    Ok(())
}

/// Returns the place that names a channel.
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

/// Reads the scale, or the scale that follows from a sensitivity: SI = volts / sensitivity.
fn read_scale(
    table: &Table<'_>,
    signal: Dimension,
    sensitivity: Dimension,
) -> Result<Option<Scale>, DescriptionError> {
    match (table.get("scale"), table.get("sensitivity")) {
        (Some(_), Some(entry)) => Err(entry.conflict(
            "`scale` and `sensitivity` say the same thing twice",
            "keep `scale` (SI units per unit of the file) or `sensitivity` (files in volts)",
        )),
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
