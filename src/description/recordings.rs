//! `[[recording]]`: files of the test, each with its own settings.
//!
//! `[measured]`: natural frequencies that were read elsewhere.

use super::error::{DescriptionError, DescriptionProblem, Doubt, with_unit};
use super::reader::{Entry, Limits, Table};
use super::structure::along;
use super::{
    BeamDescription, MeasuredFrequencies, PointMass, RecordingDescription, ResponseForm,
    SensorDescription, keys,
};
use std::collections::BTreeMap;
use std::ops::Bound;
use tapjoint_numerics::quantity::Dimension;

/// Words of `form` in `[[recording]]`.
pub const FORMS: [(&str, ResponseForm); 3] = [
    ("accelerance", ResponseForm::Accelerance),
    ("mobility", ResponseForm::Mobility),
    ("receptance", ResponseForm::Receptance),
];
/// 16 samples give six lines. 4 million samples are 78 s at 51.2 kHz and still fit into a small memory.
const BLOCK: Limits = Limits::between(
    16.0,
    4e6,
    "a block of 2048 samples shows 800 lines; leave it out to have it chosen",
);
const SAMPLE_RATE: Limits = Limits::between(
    1.0,
    1e8,
    "give samples per second, such as 5120 or \"51.2 kHz\"",
);
const BAND_EDGE: Limits =
    Limits::between(0.0, 1e8, "write two frequencies in Hz: `band = [0, 200]`");
const LEVEL: Limits = Limits::positive(1e3, "give how many times as hard as level 1 it is struck");
const TORQUE: Limits = Limits::between(0.0, 1e9, "give the tightening torque in N m");
const TEMPERATURE: Limits = Limits::between(
    -273.15,
    5000.0,
    "give degrees Celsius, or a unit: \"293 K\"",
);

/// Largest mass that is fastened to a beam for a test; the heaviest beams take more than a kilogram.
const FASTENED_MASS: Limits = Limits::positive(
    1e3,
    "give what it weighs in kg, or with its unit: \"50 g\"; leave the table out where nothing is fastened",
);

/// Beam and sensors that the recordings refer to.
pub(super) struct Surroundings<'s> {
    pub(super) beam: &'s BeamDescription,
    pub(super) sensors: &'s [SensorDescription],
}

/// Reads one `[[recording]]`.
pub(super) fn read_recording(
    entry: &Entry<'_>,
    surroundings: &Surroundings<'_>,
) -> Result<RecordingDescription, DescriptionError> {
    let table = entry.table(&keys::RECORDING)?;
    let file = table.need("file", "a file", "file = \"taps.wav\"")?;
    let position = along(surroundings.beam.length);
    let at = table.optional("at", |entry| read_moves(entry, surroundings))?;
    let masses: Option<Vec<_>> = table.optional("mass", |entry| {
        let wanted = "a list of tables, each under its own header [[recording.mass]],";
        let entries = entry.list(wanted)?;
        entries
            .iter()
            .map(|entry| read_fastened(entry, surroundings.beam))
            .collect()
    })?;
    let (form, sensor) = read_form(&table, surroundings)?;
    Ok(RecordingDescription {
        file: file.text("a file such as \"taps.wav\"")?.into(),
        line: file.line,
        tap: table.optional("tap", |entry| entry.within(Dimension::Length, &position))?,
        level: table.optional("level", |entry| entry.within(Dimension::Ratio, &LEVEL))?,
        band: table.optional("band", read_band)?,
        block: table.optional("block", |entry| entry.count(&BLOCK))?,
        at: at.unwrap_or_default(),
        masses: masses.unwrap_or_default(),
        sample_rate: table.optional("sample_rate", |entry| {
            entry.within(Dimension::Rate, &SAMPLE_RATE)
        })?,
        form,
        sensor,
        torque: table.optional("torque", |entry| entry.within(Dimension::Torque, &TORQUE))?,
        temperature: table.optional("temperature", |entry| {
            entry.within(Dimension::Temperature, &TEMPERATURE)
        })?,
        date: table.optional("date", Entry::date)?,
    })
}

fn read_band(entry: &Entry<'_>) -> Result<(f64, f64), DescriptionError> {
    let edges = entry.list("two frequencies such as [0, 200] (Hz)")?;
    let [low, high] = edges.as_slice() else {
        return Err(entry.error(DescriptionProblem::Count {
            found: edges.len(),
            allowed: "2, the lower and the upper edge in Hz".to_owned(),
            remedy: "write `band = [0, 200]`",
        }));
    };
    let low = low.within(Dimension::Frequency, &BAND_EDGE)?;
    let upper = high.within(Dimension::Frequency, &BAND_EDGE)?;
    if upper > low {
        return Ok((low, upper));
    }
    let above = Limits {
        low: Bound::Excluded(low),
        high: BAND_EDGE.high,
        remedy: "write the lower edge first: `band = [0, 200]`",
    };
    Err(high.out_of_range(upper, "Hz", &above))
}

fn read_moves(
    entry: &Entry<'_>,
    surroundings: &Surroundings<'_>,
) -> Result<BTreeMap<String, f64>, DescriptionError> {
    let table = entry.free_table("a table of sensors and positions such as { A = 0.20 }")?;
    let position = along(surroundings.beam.length);
    let mut moves = BTreeMap::new();
    for (name, entry) in table.all() {
        check_sensor(name, &entry, surroundings.sensors)?;
        moves.insert(name.to_owned(), entry.within(Dimension::Length, &position)?);
    }
    Ok(moves)
}

fn read_fastened(entry: &Entry<'_>, beam: &BeamDescription) -> Result<PointMass, DescriptionError> {
    let table = entry.table(&keys::FASTENED)?;
    let position = table.need("position", "its place on the beam (m)", "position = 0.20")?;
    let weight = table.need("mass", "what it weighs (kg)", "mass = \"50 g\"")?;
    let position = position.within(Dimension::Length, &along(beam.length))?;
    let mass = weight.within(Dimension::Mass, &FASTENED_MASS)?;
    let beam_mass = beam.length * beam.width * beam.thickness * beam.density;
    if mass > beam_mass {
        weight.warn(Doubt::Implausible {
            value: mass,
            unit: "kg",
            usual: format!("less than the beam's {}", with_unit(beam_mass, "kg")),
            question: "did you mean g? Write \"50 g\"",
        });
    }
    Ok(PointMass {
        position,
        mass,
        inertia: 0.0,
    })
}

fn check_sensor(
    name: &str,
    entry: &Entry<'_>,
    sensors: &[SensorDescription],
) -> Result<(), DescriptionError> {
    let known: Vec<String> = sensors.iter().map(|sensor| sensor.name.clone()).collect();
    if known.iter().any(|sensor| sensor == name) {
        return Ok(());
    }
    let nearest = keys::nearest(name, known.iter().map(String::as_str)).map(str::to_owned);
    Err(entry.error(DescriptionProblem::UnknownSensor {
        name: name.to_owned(),
        known,
        nearest,
    }))
}

/// Reads form and sensor of a file that holds a frequency response function.
fn read_form(
    table: &Table<'_>,
    surroundings: &Surroundings<'_>,
) -> Result<(Option<ResponseForm>, Option<String>), DescriptionError> {
    let form = table.optional("form", |entry| entry.choice(&FORMS))?;
    let sensor = table.optional("sensor", |entry| {
        let name = entry.text("a sensor's name such as \"A\"")?;
        check_sensor(&name, entry, surroundings.sensors)?;
        Ok(name)
    })?;
    match (table.get("form"), table.get("sensor")) {
        (Some(entry), None) if surroundings.sensors.len() > 1 => Err(entry.conflict(
            "a response function belongs to one sensor, and several are declared",
            "add `sensor = \"A\"`",
        )),
        (None, Some(entry)) => Err(entry.conflict(
            "`sensor` names the sensor of a response function, and `form` is missing",
            "add `form = \"accelerance\"`, or remove `sensor`: a time recording finds its sensors by channel",
        )),
        _ => Ok((form, sensor)),
    }
}

const FREQUENCY: Limits =
    Limits::positive(1e9, "natural frequencies in Hz, rigid-body modes left out");
const HALF_LINE: Limits = Limits::positive(
    1e9,
    "half the line spacing in Hz; leave it out when the resolution is unknown",
);
const STD: Limits = Limits::positive(1e9, "one standard deviation in Hz");
const SCATTER: Limits = Limits {
    low: Bound::Excluded(0.0),
    high: Bound::Excluded(1.0),
    remedy: "give the repeatability as a share of the frequency: \"0.3 %\"",
};
/// Beam theory does not describe higher modes.
const MODE: Limits = Limits::between(
    1.0,
    1000.0,
    "modes count from 1; rigid-body modes do not count",
);
/// Repeated tests scatter less than this.
const LARGE_SCATTER: f64 = 0.1;

/// Reads `[measured]`.
pub(super) fn read_measured(table: &Table<'_>) -> Result<MeasuredFrequencies, DescriptionError> {
    let wanted = "a list of frequencies (Hz)";
    let entry = table.need("frequencies", wanted, "frequencies = [17, 118]")?;
    let items = entry.list("a list of frequencies such as [17, 118] (Hz)")?;
    if items.is_empty() {
        return Err(entry.error(DescriptionProblem::Count {
            found: 0,
            allowed: "at least 1".to_owned(),
            remedy: "list the natural frequencies in Hz, lowest first",
        }));
    }
    let frequencies = items
        .iter()
        .map(|item| item.within(Dimension::Frequency, &FREQUENCY))
        .collect::<Result<Vec<_>, _>>()?;
    check_ascending(&items, &frequencies)?;
    let count = frequencies.len();
    if let (Some(entry), Some(_)) = (table.get("std"), table.get("half_line")) {
        return Err(entry.conflict(
            "`half_line` and `std` both state the reading's uncertainty",
            "keep the one you know; a repeatability beside it goes into `scatter`",
        ));
    }
    let modes = table.optional("modes", |entry| read_modes(entry, count))?;
    Ok(MeasuredFrequencies {
        frequencies,
        modes: modes.unwrap_or_else(|| (1..=count).collect()),
        half_line: table.optional("half_line", |entry| read_bounds(entry, &HALF_LINE, count))?,
        std: table.optional("std", |entry| read_bounds(entry, &STD, count))?,
        scatter: table.optional("scatter", read_scatter)?,
    })
}

fn read_modes(entry: &Entry<'_>, count: usize) -> Result<Vec<usize>, DescriptionError> {
    let items = entry.list("a list of mode numbers such as [1, 2, 4]")?;
    check_count(entry, items.len(), count)?;
    let modes = items
        .iter()
        .map(|item| item.count(&MODE))
        .collect::<Result<Vec<_>, _>>()?;
    let values: Vec<f64> = modes.iter().map(|mode| *mode as f64).collect();
    check_ascending(&items, &values)?;
    Ok(modes)
}

/// Reads one number for all frequencies, or a list with one for each.
fn read_bounds(
    entry: &Entry<'_>,
    limits: &Limits,
    count: usize,
) -> Result<Vec<f64>, DescriptionError> {
    if !entry.is_list() {
        return Ok(vec![entry.within(Dimension::Frequency, limits)?; count]);
    }
    let items = entry.list("a number or a list of numbers (Hz)")?;
    check_count(entry, items.len(), count)?;
    items
        .iter()
        .map(|item| item.within(Dimension::Frequency, limits))
        .collect()
}

fn read_scatter(entry: &Entry<'_>) -> Result<f64, DescriptionError> {
    let value = entry.within(Dimension::Ratio, &SCATTER)?;
    if value > LARGE_SCATTER {
        entry.warn(Doubt::Implausible {
            value,
            unit: "",
            usual: "0.0001 to 0.03".to_owned(),
            question: "did you mean percent? Write \"0.3 %\"",
        });
    }
    Ok(value)
}

fn check_count(
    entry: &Entry<'_>,
    found: usize,
    frequencies: usize,
) -> Result<(), DescriptionError> {
    if found == frequencies {
        return Ok(());
    }
    Err(entry.error(DescriptionProblem::Count {
        found,
        allowed: format!("{frequencies}, one for each frequency"),
        remedy: "make both lists equally long",
    }))
}

fn check_ascending(items: &[Entry<'_>], values: &[f64]) -> Result<(), DescriptionError> {
    for (index, (pair, item)) in values.windows(2).zip(items.iter().skip(1)).enumerate() {
        if pair[1] <= pair[0] {
            return Err(item.error(DescriptionProblem::NotAscending {
                position: index + 2,
                value: pair[1],
                previous: pair[0],
            }));
        }
    }
    Ok(())
}
