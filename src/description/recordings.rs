//! `[hammer]` and `[[sensor]]`: channels of the recordings and their scales. `[[recording]]`: files of the test, each
//! with its own settings. `[measured]`: natural frequencies that were read elsewhere.

use super::fastened::{check_weight, read_fastened};
use super::property::read_free_length;
use super::reader::{
    DescriptionError, Entry, Limits, Table, did_you_mean, number, quoted, with_unit,
};
use super::sheet::instrument;
use super::structure::along;
use super::{
    Assembly, BeamDescription, ChannelPlace, ChannelRef, FirstNode, FunctionForm,
    HammerDescription, MeasuredFrequencies, ModeFile, RecordingDescription, ResponseForm, Scale,
    SensorDescription, SensorKind, ValueColumns, VariableRole, Variables, keys,
};
use std::collections::BTreeMap;
use std::path::PathBuf;
use tapjoint_beam::MEASURED_LIMIT;
use tapjoint_numerics::quantity::Dimension;
use tapjoint_signal::recording::{MOST_FILES, TIME_UNITS};
use tapjoint_signal::spectral::{LEAST_BLOCK, MOST_BLOCK};
use tapjoint_signal::taps::{REACH, TapsByHand};

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
const SCALE_SIZE: Limits = Limits::between(
    1e-15,
    1e15,
    "give SI units per unit of the file; a negative scale turns the direction",
);
const SENSOR_MASS: Limits = Limits::between(
    0.0,
    1e3,
    "give the data sheet's mass in kg, or with its unit: \"24 g\"",
);

const BESIDE: Limits = Limits::between(-1e4, 1e4, "positions run along the beam in m");

/// Reads `[hammer]`.
pub(super) fn read_hammer(table: &Table<'_>) -> Result<HammerDescription, DescriptionError> {
    let channel = table.need("channel", "the hammer's channel", "channel = 1")?;
    Ok(HammerDescription {
        channel: read_channel(&channel)?,
        place: place_of(&channel),
        scale: read_scale(table, Dimension::Force, Dimension::ForceSensitivity)?,
        instrument: instrument(table)?,
    })
}

/// Adds a name or a channel to those that are `taken`, each with its line, unless it is one of them. `words` name it in
/// a message.
fn take<T: PartialEq>(
    taken: &mut Vec<(T, usize)>,
    value: T,
    words: &str,
    entry: &Entry<'_>,
    remedy: &str,
) -> Result<(), DescriptionError> {
    if let Some((_, first_line)) = taken.iter().find(|(other, _)| *other == value) {
        return Err(entry.taken(words, *first_line, remedy));
    }
    taken.push((value, entry.line));
    Ok(())
}

/// Reads all `[[sensor]]` tables. `hammer` is the entry of the hammer's channel.
pub(super) fn read_sensors(
    entries: &[Entry<'_>],
    hammer: Option<&Entry<'_>>,
    beam: &BeamDescription,
) -> Result<Vec<SensorDescription>, DescriptionError> {
    let mut sensors: Vec<SensorDescription> = Vec::new();
    let (mut names, mut channels) = (Vec::new(), Vec::new());
    if let Some(entry) = hammer {
        channels.push((read_channel(entry)?, entry.line));
    }
    for entry in entries {
        let table = entry.table(&keys::SENSOR)?;
        let sensor = read_sensor(&table, beam)?;
        let name = table.get("name");
        let name = name.as_ref().unwrap_or(entry);
        let words = format!("the name \"{}\"", sensor.name);
        let remedy = "give each sensor a name of its own";
        take(&mut names, sensor.name.clone(), &words, name, remedy)?;
        let channel = table.get("channel");
        let channel = channel.as_ref().unwrap_or(name);
        let words = format!("channel {}", sensor.channel);
        let remedy = "give each sensor, and the hammer, a channel of its own";
        take(
            &mut channels,
            sensor.channel.clone(),
            &words,
            channel,
            remedy,
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
    let kind = table.choice("kind", &SENSOR_KINDS)?;
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
            SensorKind::Sound => entry.within(Dimension::Length, &BESIDE),
            _ => entry.within(Dimension::Length, &along(beam.length)),
        })?,
        mass: table.within("mass", Dimension::Mass, &SENSOR_MASS)?,
        kind,
        instrument: instrument(table)?,
    };
    if let Some((entry, mass)) = table.get("mass").zip(sensor.mass) {
        if kind == SensorKind::Sound {
            entry.warn("has no effect; a microphone does not sit on the beam; remove `mass`");
        } else {
            check_weight(&entry, mass, beam, "did you mean g? Write \"24 g\"")?;
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
            mass.warn(
                "has no `position`: the diagnosis tries places along the beam, prediction and estimate leave the mass \
                 out; add `position` (m along the beam) if it is known",
            );
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
    match entry.as_text() {
        Some(_) => Ok(ChannelRef::Name(
            entry.text("a channel number or a column's name")?,
        )),
        None => Ok(ChannelRef::Number(entry.count(&CHANNELS)?)),
    }
}

/// Reads the scale, or the scale that follows from a sensitivity: SI = volts / sensitivity.
fn read_scale(
    table: &Table<'_>,
    signal: Dimension,
    sensitivity: Dimension,
) -> Result<Option<Scale>, DescriptionError> {
    match (table.get("scale"), table.get("sensitivity")) {
        (Some(_), Some(entry)) => Err(entry.error(
            "`scale` and `sensitivity` say the same thing twice; keep `scale` (SI units per unit of the file) or \
             `sensitivity` (files in volts)",
        )),
        (Some(entry), None) => Ok(Some(Scale::PerUnit(factor(&entry, signal)?))),
        (None, Some(entry)) => {
            let volts = factor(&entry, sensitivity)?;
            Ok(Some(Scale::PerVolt(volts.recip())))
        }
        (None, None) => Ok(None),
    }
}

/// Reads a scale or a sensitivity of either sign.
fn factor(entry: &Entry<'_>, dimension: Dimension) -> Result<f64, DescriptionError> {
    let value = entry.quantity(dimension)?;
    match value {
        0.0 => {
            let remedy = "remove the key for a scale of 1";
            Err(entry.impossible(value, dimension.si_unit(), "any number but zero", remedy))
        }
        _ if SCALE_SIZE.contain(value.abs()) => Ok(value),
        _ => Err(entry.out_of_range(value.abs(), dimension.si_unit(), &SCALE_SIZE)),
    }
}

/// Words of `form` in `[[recording]]`.
pub const FORMS: [(&str, ResponseForm); 3] = [
    ("accelerance", ResponseForm::Accelerance),
    ("mobility", ResponseForm::Mobility),
    ("receptance", ResponseForm::Receptance),
];
/// Words of `overload` in `[[recording]]`: true to use overloaded taps.
pub const OVERLOADS: [(&str, bool); 2] = [("reject", false), ("keep", true)];
/// Words of `form` in `[[recording]]`, those of spectra included.
const FUNCTION_FORMS: [(&str, FunctionForm); 4] = [
    (
        "accelerance",
        FunctionForm::Response(ResponseForm::Accelerance),
    ),
    ("mobility", FunctionForm::Response(ResponseForm::Mobility)),
    (
        "receptance",
        FunctionForm::Response(ResponseForm::Receptance),
    ),
    ("spectrum", FunctionForm::Spectrum),
];
const BLOCK: Limits = Limits::between(
    LEAST_BLOCK as f64,
    MOST_BLOCK as f64,
    "a block of 2048 samples shows 800 lines; leave it out to have it chosen",
);
const SAMPLE_RATE: Limits = Limits::between(
    1.0,
    1e8,
    "give samples per second, such as 5120 or \"51.2 kHz\"",
);
const BAND_EDGE: Limits =
    Limits::between(0.0, 1e8, "write two frequencies in Hz: `band = [0, 200]`");
const LEVEL: Limits = Limits::above(
    0.0,
    1e3,
    "give how many times as hard as level 1 it is struck",
);
const TORQUE: Limits = Limits::between(0.0, 1e9, "give the tightening torque in N m");
const TEMPERATURE: Limits = Limits::between(
    -273.15,
    5000.0,
    "give degrees Celsius, or a unit: \"293 K\"",
);

/// Reads one `[[recording]]`.
pub(super) fn read_recording(
    entry: &Entry<'_>,
    beam: &BeamDescription,
    kind: Assembly,
    sensors: &[SensorDescription],
) -> Result<RecordingDescription, DescriptionError> {
    let table = entry.table(&keys::RECORDING)?;
    let (named, mut files) = read_files(&table)?;
    let length = table.optional("length", |entry| {
        check_is_clamped(entry, kind)?;
        read_free_length(entry)
    })?;
    let described = beam.length;
    // The beam as this recording has it.
    let beam = &BeamDescription {
        length: length.unwrap_or(beam.length),
        ..beam.clone()
    };
    let position = along(beam.length);
    let mut at = BTreeMap::new();
    if let Some(entry) = table.get("at") {
        let moves = entry.free_table("a table of sensors and positions such as { A = 0.20 }")?;
        for (name, entry) in moves.all() {
            check_sensor(name, &entry, sensors)?;
            at.insert(name.to_owned(), entry.within(Dimension::Length, &position)?);
        }
    }
    if let Some(entry) = table.get("length").filter(|_| length != Some(described)) {
        check_places_at_length(&entry, beam.length, &at, sensors)?;
    }
    let fastened = table.optional("mass", |entry| read_fastened(entry, beam, sensors))?;
    let (mass_names, masses) = fastened.unwrap_or_default();
    let form = table.choice("form", &FUNCTION_FORMS)?;
    let values = table.choice("values", &ValueColumns::WORDS)?;
    let sensor = table.optional("sensor", |entry| {
        let name = entry.text("a sensor's name such as \"A\"")?;
        check_sensor(&name, entry, sensors)?;
        Ok(name)
    })?;
    match (table.get("form"), table.get("sensor")) {
        // A spectrum need not belong to a sensor: it gives frequencies alone.
        (Some(_), None) if form == Some(FunctionForm::Spectrum) => {}
        (Some(entry), None) if sensors.len() > 1 => {
            return Err(entry.error(
                "a response function belongs to one sensor, and several are declared; add `sensor = \"A\"`",
            ));
        }
        (None, Some(entry)) => {
            return Err(entry.error(
                "`sensor` names the sensor of a response function, and `form` is missing; add `form = \
                 \"accelerance\"`, or remove `sensor`: a time recording finds its sensors by channel",
            ));
        }
        _ => {}
    }
    if let (Some(entry), None) = (table.get("values"), form) {
        return Err(entry.error(
            "`values` names the columns of a function, and `form` is missing; add `form = \"accelerance\"`, \
             or remove `values`",
        ));
    }
    for key in ["overload", "accept_taps", "reject_taps"] {
        if let (Some(entry), Some(_)) = (table.get(key), form) {
            return Err(entry.error(format!(
                "`{key}` is about taps, and `form` says that the file holds functions; remove one of them"
            )));
        }
    }
    let accept = table.optional("accept_taps", read_taps)?;
    let reject = table.optional("reject_taps", read_taps)?;
    let by_hand = TapsByHand {
        accept: accept.unwrap_or_default(),
        reject: reject.unwrap_or_default(),
    };
    if let Some(entry) = table.get("reject_taps") {
        check_chosen_once(&entry, &by_hand.accept, &by_hand.reject)?;
    }
    Ok(RecordingDescription {
        poles: table.optional("poles", read_poles)?,
        file: files.remove(0),
        shown_as: None,
        more_files: files,
        frames: None,
        line: named.line,
        // To the micrometre, so that 35 cm and 0.35 m are one length.
        length: length
            .map(|length| (1e6 * length).round() / 1e6)
            .filter(|length| (length - described).abs() > 1e-6),
        tap: table.within("tap", Dimension::Length, &position)?,
        level: table.within("level", Dimension::Ratio, &LEVEL)?,
        band: table.optional("band", read_band)?,
        block: table.optional("block", |entry| entry.count(&BLOCK))?,
        at,
        masses,
        mass_names,
        sample_rate: table.within("sample_rate", Dimension::Rate, &SAMPLE_RATE)?,
        time_unit: table.choice("time_unit", &TIME_UNITS)?,
        form,
        values,
        variables: table
            .optional("variables", read_variables)?
            .unwrap_or_default(),
        sensor,
        keep_overload: table.choice("overload", &OVERLOADS)?.unwrap_or(false),
        by_hand,
        torque: table.within("torque", Dimension::Torque, &TORQUE)?,
        temperature: table.within("temperature", Dimension::Temperature, &TEMPERATURE)?,
        date: table.optional("date", Entry::date)?,
    })
}

/// Refuses a free length of a structure that no clamp holds.
fn check_is_clamped(entry: &Entry<'_>, kind: Assembly) -> Result<(), DescriptionError> {
    let problem = match kind {
        Assembly::Cantilever => return Ok(()),
        Assembly::Lap => {
            "only a clamped beam gets another free length when its clamp is moved; describe a lap joint of other \
             lengths as a test of its own, or remove `length`"
        }
        Assembly::Free => {
            "only a clamped beam gets another free length when its clamp is moved; describe a free beam of another \
             length as a test of its own, or remove `length`"
        }
    };
    Err(entry.error(problem))
}

/// Looks at the sensors that a recording of another free length (m) does not place itself. `entry` is its `length`.
fn check_places_at_length(
    entry: &Entry<'_>,
    length: f64,
    at: &BTreeMap<String, f64>,
    sensors: &[SensorDescription],
) -> Result<(), DescriptionError> {
    let mut unmoved = Vec::new();
    for sensor in sensors {
        let Some(position) = sensor.position else {
            continue;
        };
        if sensor.kind == SensorKind::Sound || at.contains_key(&sensor.name) {
            continue;
        }
        if position > length {
            let (name, place) = (&sensor.name, with_unit(position, "m"));
            return Err(entry.error(format!(
                "sensor {name} at {place} is outside the beam of this recording, 0 to {}; give its distance from \
                 the moved clamp: `at = {{ {name} = ... }}`",
                with_unit(length, "m")
            )));
        }
        unmoved.push(sensor.name.as_str());
    }
    if !unmoved.is_empty() {
        entry.warn(format!(
            "moves the clamp, and positions count from it; {} is taken where [[sensor]] has it: add `at` with its \
             distance from the moved clamp",
            quoted(&unmoved)
        ));
    }
    Ok(())
}

/// Most free lengths of one test, that of the beam included.
const MOST_LENGTHS: usize = 5;

/// Refuses a test in which no recording has the length of the beam, and one with too many lengths.
pub(super) fn check_lengths(
    entries: &[Entry<'_>],
    recordings: &[RecordingDescription],
) -> Result<(), DescriptionError> {
    let mut lengths: Vec<f64> = Vec::new();
    for (entry, recording) in entries.iter().zip(recordings) {
        let Some(length) = recording.length.filter(|length| !lengths.contains(length)) else {
            continue;
        };
        lengths.push(length);
        let table = entry.table(&keys::RECORDING)?;
        let entry = table
            .get("length")
            .unwrap_or(table.need("file", "a file", "")?);
        if recordings.iter().all(|one| one.length.is_some()) {
            return Err(entry.error(
                "no recording has the length of [beam], to which the estimate refers; write this length into [beam], \
                 and `length` only where the clamp was moved",
            ));
        }
        if lengths.len() >= MOST_LENGTHS {
            return Err(entry.error(format!(
                "this is free length {} of the test, that of [beam] included; allowed: up to {MOST_LENGTHS} lengths; \
                 describe the others as a test of their own",
                lengths.len() + 1
            )));
        }
    }
    Ok(())
}

/// Reads `file` or `files`: the entry that names them, and at least one file.
fn read_files<'t>(table: &Table<'t>) -> Result<(Entry<'t>, Vec<PathBuf>), DescriptionError> {
    let wanted = "a file such as \"taps.wav\"";
    let Some(entry) = table.get("files") else {
        let file = table.need("file", "a file", "file = \"taps.wav\"")?;
        let one = file.text(wanted)?.into();
        return Ok((file, vec![one]));
    };
    if table.get("file").is_some() {
        return Err(entry.error(
            "`file` and `files` name the recording twice; keep `files` for one set-up in several files, else `file`",
        ));
    }
    if table.get("form").is_some() {
        return Err(entry.error(
            "`form` belongs to a file of functions, and several of these are not one recording; write a \
             [[recording]] with `file` for each",
        ));
    }
    let list = entry.list_up_to(MOST_FILES, "a list of files such as [\"1.wav\", \"2.wav\"]")?;
    let mut files: Vec<PathBuf> = Vec::new();
    for item in &list {
        let file = PathBuf::from(item.text(wanted)?);
        if files.contains(&file) {
            return Err(item.error(format!(
                "\"{}\" is listed twice; its taps would count twice: list each file once",
                file.display()
            )));
        }
        files.push(file);
    }
    if files.is_empty() {
        let remedy = "write `file = \"taps.wav\"` for a single one";
        return Err(entry.wrong_count(0, "at least 1 file", remedy));
    }
    Ok((entry, files))
}

/// Reads the names of variables, each a text or a list of texts, by what they are for.
fn read_variables(entry: &Entry<'_>) -> Result<Variables, DescriptionError> {
    let table = entry.free_table("a table such as { frf = \"yspec\", rate = \"freq\" }")?;
    let mut variables = Variables::new();
    for (word, entry) in table.all() {
        let words = VariableRole::WORDS;
        let Some((_, role)) = words.iter().find(|(known, _)| *known == word) else {
            let known = words.map(|(known, _)| known);
            let meant = did_you_mean(word, &known);
            return Err(entry.error(format!(
                "\"{word}\" is no use of a variable; allowed: {}{meant}",
                quoted(&known)
            )));
        };
        let wanted = "the name of a variable, or a list of names";
        let names = match entry.is_list() {
            true => entry
                .list(wanted)?
                .iter()
                .map(|item| item.text(wanted))
                .collect::<Result<_, _>>()?,
            false => vec![entry.text(wanted)?],
        };
        variables.insert(*role, names);
    }
    Ok(variables)
}

fn read_band(entry: &Entry<'_>) -> Result<(f64, f64), DescriptionError> {
    let edges = entry.list("two frequencies such as [0, 200] (Hz)")?;
    let [low, high] = edges.as_slice() else {
        let allowed = "2, the lower and the upper edge in Hz";
        return Err(entry.wrong_count(edges.len(), allowed, "write `band = [0, 200]`"));
    };
    let low = low.within(Dimension::Frequency, &BAND_EDGE)?;
    let upper = high.within(Dimension::Frequency, &BAND_EDGE)?;
    if upper > low {
        return Ok((low, upper));
    }
    let remedy = "write the lower edge first: `band = [0, 200]`";
    Err(high.out_of_range(upper, "Hz", &Limits::above(low, BAND_EDGE.high, remedy)))
}

fn check_sensor(
    name: &str,
    entry: &Entry<'_>,
    sensors: &[SensorDescription],
) -> Result<(), DescriptionError> {
    let known: Vec<&str> = sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    if known.contains(&name) {
        return Ok(());
    }
    let listed = match known[..] {
        [] => "none is declared; add a [[sensor]] of that name".to_owned(),
        _ => quoted(&known),
    };
    let meant = did_you_mean(name, &known);
    Err(entry.error(format!(
        "no sensor is called \"{name}\"; sensors: {listed}{meant}"
    )))
}

const FREQUENCY: Limits = Limits::above(
    0.0,
    1e9,
    "natural frequencies in Hz, rigid-body modes left out",
);
const HALF_LINE: Limits = Limits::above(
    0.0,
    1e9,
    "half the line spacing in Hz; leave it out when the resolution is unknown",
);
const STD: Limits = Limits::above(0.0, 1e9, "one standard deviation in Hz");
const SCATTER: Limits = Limits::inside(
    0.0,
    1.0,
    "give the repeatability as a share of the frequency: \"0.3 %\"",
);
const MODE: Limits = Limits::between(
    1.0,
    MEASURED_LIMIT as f64,
    "modes count from 1; rigid-body modes do not count",
);
const NODE: Limits = Limits::between(0.0, 1e9, "the number of a node in the file");
/// Repeated tests scatter less than this.
const LARGE_SCATTER: f64 = 0.1;

/// Reads `[measured]`, of a beam of this length (m).
pub(super) fn read_measured(
    table: &Table<'_>,
    length: f64,
) -> Result<MeasuredFrequencies, DescriptionError> {
    let file = read_mode_file(table, length)?;
    let frequencies = match &file {
        Some(_) => Vec::new(),
        None => read_frequencies(table)?,
    };
    // The caller compares the lists with a file.
    let count = file.is_none().then_some(frequencies.len());
    if let (Some(entry), Some(_)) = (table.get("std"), table.get("half_line")) {
        return Err(entry.error(
            "`half_line` and `std` both state the reading's uncertainty; keep the one you know; a repeatability \
             beside it goes into `scatter`",
        ));
    }
    let modes = table.optional("modes", |entry| {
        let items = one_for_each(entry, "a list of mode numbers such as [1, 2, 4]", count)?;
        let modes = items
            .iter()
            .map(|item| item.count(&MODE))
            .collect::<Result<Vec<_>, _>>()?;
        let values: Vec<f64> = modes.iter().map(|mode| *mode as f64).collect();
        check_ascending(&items, &values)?;
        Ok(modes)
    })?;
    let half_line = table.optional("half_line", |entry| read_bounds(entry, &HALF_LINE, count))?;
    let std = table.optional("std", |entry| read_bounds(entry, &STD, count))?;
    let scatter = table.within("scatter", Dimension::Ratio, &SCATTER)?;
    if let Some((entry, large)) = table.get("scatter").zip(scatter)
        && large > LARGE_SCATTER
    {
        let question = "did you mean percent? Write \"0.3 %\"";
        entry.unusual(large, "", "0.0001 to 0.03", question);
    }
    Ok(MeasuredFrequencies {
        file,
        modes: modes.unwrap_or_else(|| (1..=frequencies.len()).collect()),
        frequencies,
        half_line,
        std,
        scatter,
    })
}

fn read_frequencies(table: &Table<'_>) -> Result<Vec<f64>, DescriptionError> {
    let wanted = "a list of frequencies (Hz), or `file = \"modes.unv\"`,";
    let entry = table.need("frequencies", wanted, "frequencies = [17, 118]")?;
    read_ascending(&entry, MEASURED_LIMIT, MEASURED_REMEDY)
}

/// Reads the frequencies (Hz) of the free beam from this entry, and their standard uncertainties (Hz).
pub(super) fn read_free_frequencies(
    table: &Table<'_>,
    entry: &Entry<'_>,
) -> Result<(Vec<f64>, Vec<f64>), DescriptionError> {
    let frequencies = read_ascending(entry, MEASURED_LIMIT, MEASURED_REMEDY)?;
    let stds = table.need(
        "free_std",
        "their standard uncertainty (Hz)",
        "free_std = 0.05",
    )?;
    let stds = read_bounds(&stds, &STD, Some(frequencies.len()))?;
    Ok((frequencies, stds))
}

/// Remedy for another number of measured frequencies.
const MEASURED_REMEDY: &str =
    "list the natural frequencies in Hz, lowest first; a joint needs two to four";
/// Most modes that may be chosen by hand.
const MOST_POLES: usize = 100;

/// Reads the frequencies (Hz) of the modes that were chosen by hand, the lowest first.
pub(super) fn read_poles(entry: &Entry<'_>) -> Result<Vec<f64>, DescriptionError> {
    let remedy = "list the modes of interest, or leave `poles` out";
    read_ascending(entry, MOST_POLES, remedy)
}

/// Most taps that may be chosen by hand in one recording: an hour of taps, three a second.
const MOST_TAPS: usize = 10_000;
const TAP_TIME: Limits = Limits::between(
    0.0,
    1e7,
    "write the times that the table of taps shows: `reject_taps = [4.905, 12.31]`",
);

/// Reads the times of taps (s from the start of the recording), the earliest first.
fn read_taps(entry: &Entry<'_>) -> Result<Vec<f64>, DescriptionError> {
    let items = entry.list("a list of times such as [4.905, 12.31] (s)")?;
    if items.len() > MOST_TAPS {
        let remedy = "divide the recording, or list fewer taps";
        return Err(entry.wrong_count(items.len(), &format!("0 to {MOST_TAPS}"), remedy));
    }
    let times = items
        .iter()
        .map(|item| item.within(Dimension::Time, &TAP_TIME));
    let times = times.collect::<Result<Vec<_>, _>>()?;
    check_ascending(&items, &times)?;
    Ok(times)
}

/// Refuses times (s) that may name one tap in both lists. `entry` holds those of rejected taps.
fn check_chosen_once(
    entry: &Entry<'_>,
    accept: &[f64],
    reject: &[f64],
) -> Result<(), DescriptionError> {
    for &time in reject {
        // The tap between two times may be within reach of both.
        let near = accept
            .iter()
            .find(|other| (**other - time).abs() <= 2.0 * REACH);
        if let Some(other) = near {
            return Err(entry.error(format!(
                "`reject_taps` names the tap at {} and `accept_taps` the one at {}: times this close may name the same \
                 tap; remove one of them",
                with_unit(time, "s"),
                with_unit(*other, "s")
            )));
        }
    }
    Ok(())
}

/// Reads natural frequencies (Hz), the lowest first, `most` of them. `remedy` goes with another number of them.
fn read_ascending(
    entry: &Entry<'_>,
    most: usize,
    remedy: &str,
) -> Result<Vec<f64>, DescriptionError> {
    let items = entry.list("a list of frequencies such as [17, 118] (Hz)")?;
    if items.is_empty() || items.len() > most {
        return Err(entry.wrong_count(items.len(), &format!("1 to {most}"), remedy));
    }
    let frequencies = items
        .iter()
        .map(|item| item.within(Dimension::Frequency, &FREQUENCY))
        .collect::<Result<Vec<_>, _>>()?;
    check_ascending(&items, &frequencies)?;
    Ok(frequencies)
}

/// Reads the file of modes and its first node.
fn read_mode_file(table: &Table<'_>, length: f64) -> Result<Option<ModeFile>, DescriptionError> {
    let Some(entry) = table.get("file") else {
        return match table.get("first_node") {
            Some(node) => Err(node.error(
                "a node belongs to a file of modes; add `file = \"modes.unv\"`, or remove it",
            )),
            None => Ok(None),
        };
    };
    if let Some(frequencies) = table.get("frequencies") {
        return Err(entry.error(format!(
            "frequencies come from `file` or from `frequencies` (line {}), not from both; remove one of them",
            frequencies.line
        )));
    }
    let first_node = table.optional("first_node", |entry| {
        let table = entry.table(&keys::FIRST_NODE)?;
        let number = table.need("number", "its number in the file", "number = 1")?;
        let position = table.need("position", "its place on the beam (m)", "position = 0.03")?;
        Ok(FirstNode {
            number: number.count(&NODE)? as i64,
            position: position.within(Dimension::Length, &along(length))?,
        })
    })?;
    let compared = ["modes", "half_line", "std", "first_node"];
    let key_lines = compared
        .into_iter()
        .filter_map(|key| Some((key, table.get(key)?.line)));
    Ok(Some(ModeFile {
        key_lines: key_lines.collect(),
        path: PathBuf::from(entry.text("the name of a universal file such as \"modes.unv\"")?),
        line: entry.line,
        first_node,
    }))
}

/// Reads one number for all frequencies, or a list with one for each.
fn read_bounds(
    entry: &Entry<'_>,
    limits: &Limits,
    count: Option<usize>,
) -> Result<Vec<f64>, DescriptionError> {
    if !entry.is_list() {
        return Ok(vec![
            entry.within(Dimension::Frequency, limits)?;
            count.unwrap_or(1)
        ]);
    }
    one_for_each(entry, "a number or a list of numbers (Hz)", count)?
        .iter()
        .map(|item| item.within(Dimension::Frequency, limits))
        .collect()
}

/// Returns the items of a list that has one for each of the `frequencies`; `None` of a file's, which are not known here.
fn one_for_each<'t>(
    entry: &Entry<'t>,
    wanted: &str,
    frequencies: Option<usize>,
) -> Result<Vec<Entry<'t>>, DescriptionError> {
    let items = entry.list(wanted)?;
    let Some(frequencies) = frequencies else {
        let remedy = "give one for each mode of the file, lowest first";
        return match items.len() {
            1..=MEASURED_LIMIT => Ok(items),
            count => Err(entry.wrong_count(count, &format!("1 to {MEASURED_LIMIT}"), remedy)),
        };
    };
    if items.len() == frequencies {
        return Ok(items);
    }
    let allowed = format!("{frequencies}, one for each frequency");
    Err(entry.wrong_count(items.len(), &allowed, "make both lists equally long"))
}

fn check_ascending(items: &[Entry<'_>], values: &[f64]) -> Result<(), DescriptionError> {
    for (index, (pair, item)) in values.windows(2).zip(items.iter().skip(1)).enumerate() {
        if pair[1] <= pair[0] {
            return Err(item.error(format!(
                "value {} is {} and follows {}; allowed: ascending values, each once; sort them or remove the repeated \
                 one",
                index + 2,
                number(pair[1]),
                number(pair[0])
            )));
        }
    }
    Ok(())
}
