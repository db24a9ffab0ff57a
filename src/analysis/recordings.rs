//! Opening a test's recordings and measuring each.

use std::path::Path;

use super::analysis::{Conditions, Overview, RecordingResult, Response};
use super::close_ups::close_ups;
use super::error::PipelineError;
use super::functions::{FunctionSettings, form_of_description, measure_functions};
use super::measure::{MeasureError, MeasureSettings, Measurement, measure};
use tapjoint_description::described::fastened_masses;
use tapjoint_description::{
    ChannelPlace, ChannelRef, FrfForm, RecordingDescription, Scale, SensorDescription, SensorKind,
    TestDescription,
};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::recording::{
    ReadSettings, Recording, RecordingError, open_frequency_responses,
};
use tapjoint_signal::taps::{TapSettings, TapSource, find_taps};

/// Pieces of the overview of a recording over time: two for each pixel of a usual picture.
const OVERVIEW_PIECES: u64 = 2400;

/// Opens and measures one recording of a described test.
pub(super) fn measure_described(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, test_file): (&Path, &str),
) -> Result<RecordingResult, PipelineError> {
    let file = description.file.display().to_string();
    if let Some(form) = description.form {
        return described_functions(test, description, (folder, form));
    }
    if test.sensors.is_empty() {
        return Err(PipelineError::NoSensors {
            file: test_file.to_string(),
        });
    }
    let (recording, source) = open_described(test, description, (folder, test_file))?;
    let mut settings = MeasureSettings::new(source);
    settings.band = description.band;
    settings.block = description.block;
    settings.window = test.analysis.window;
    settings.reading = test.analysis.reading;
    settings.kinds = response_kinds(test);
    let responses = test
        .sensors
        .iter()
        .map(|sensor| Response {
            name: sensor.name.clone(),
            kind: Some(sensor.kind),
            unit: Some(si_unit(sensor.kind).to_string()),
        })
        .collect();
    let hammer_unit = test.hammer.as_ref().map(|_| "N".to_string());
    let units = described_units(test, &settings.source);
    let placed = |error| match error {
        PipelineError::Measure(MeasureError::Spectral { file, problem }) => {
            PipelineError::Setting {
                file: test_file.to_string(),
                line: description.line,
                recording: file,
                problem,
            }
        }
        other => other,
    };
    let mut result =
        finish(recording.renamed(file), settings, (hammer_unit, responses)).map_err(placed)?;
    result.conditions = conditions(test, description);
    for (channel, unit) in units {
        if let Some(info) = result.channels.get_mut(channel) {
            info.unit.get_or_insert_with(|| unit.to_string());
        }
    }
    Ok(result)
}

/// Opens and reads a described file of frequency response functions.
fn described_functions(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, form): (&Path, FrfForm),
) -> Result<RecordingResult, PipelineError> {
    let mut functions = open_frequency_responses(&folder.join(&description.file))?;
    functions.file = description.file.display().to_string();
    let only = |sensors: &[SensorDescription]| match sensors {
        [one] => Some(one.name.clone()),
        _ => None,
    };
    let settings = FunctionSettings {
        form: Some(form_of_description(form)),
        sensor: description.sensor.clone().or_else(|| only(&test.sensors)),
        band: description.band,
        reading: test.analysis.reading,
    };
    let mut result = measure_functions(&functions, &settings)?;
    result.conditions = conditions(test, description);
    Ok(result)
}

/// What the sensors measure, where the hammer's force makes modal constants of it.
fn response_kinds(test: &TestDescription) -> Vec<Option<ResponseForm>> {
    let kind = |sensor: &SensorDescription| match sensor.kind {
        SensorKind::Acceleration => Some(ResponseForm::Accelerance),
        SensorKind::Velocity => Some(ResponseForm::Mobility),
        SensorKind::Displacement => Some(ResponseForm::Receptance),
        SensorKind::Sound => None,
    };
    match &test.hammer {
        Some(_) => test.sensors.iter().map(kind).collect(),
        None => Vec::new(),
    }
}

/// The unit that the description gives to each channel's values.
fn described_units(test: &TestDescription, source: &TapSource) -> Vec<(usize, &'static str)> {
    let (hammer, responses) = match source {
        TapSource::Hammer { channel, responses } => (Some((*channel, "N")), responses),
        TapSource::Responses(responses) => (None, responses),
    };
    let sensors = test.sensors.iter().map(|sensor| si_unit(sensor.kind));
    hammer
        .into_iter()
        .chain(responses.iter().copied().zip(sensors))
        .collect()
}

/// Opens a described recording, scales its channels, and says which of them are what.
fn open_described(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, test_file): (&Path, &str),
) -> Result<(Recording, TapSource), PipelineError> {
    let settings = ReadSettings {
        sample_rate: description.sample_rate,
    };
    let mut recording = Recording::open(&folder.join(&description.file), &settings)?;
    let mut find = |reference: &ChannelRef, scale: Option<Scale>, place: &ChannelPlace| {
        channel(&mut recording, reference, scale).map_err(|problem| PipelineError::Channel {
            file: test_file.to_string(),
            line: place.line,
            key: place.key.clone(),
            problem: Box::new(problem),
        })
    };
    let hammer = match &test.hammer {
        Some(hammer) => Some(find(&hammer.channel, hammer.scale, &hammer.place)?),
        None => None,
    };
    let mut channels = Vec::with_capacity(test.sensors.len());
    for sensor in &test.sensors {
        channels.push(find(&sensor.channel, sensor.scale, &sensor.place)?);
    }
    Ok((recording, source(hammer, channels)))
}

/// What the description says of the circumstances of a recording.
fn conditions(test: &TestDescription, description: &RecordingDescription) -> Conditions {
    let place =
        |sensor: &SensorDescription| Some((sensor.name.clone(), description.place_of(sensor)?));
    let mass = |sensor: &SensorDescription| Some((sensor.name.clone(), sensor.mass?));
    Conditions {
        tap: description.tap,
        sensor_positions: test.sensors.iter().filter_map(place).collect(),
        sensor_masses: test.sensors.iter().filter_map(mass).collect(),
        masses: fastened_masses(description),
        torque: description.torque,
        temperature: description.temperature,
        date: description.date.clone(),
    }
}

/// Measures a recording about which nothing is described: all channels but the hammer's are
/// responses.
///
/// # Errors
/// An unknown hammer channel; what [`measure`] meets.
pub fn measure_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<RecordingResult, PipelineError> {
    let (source, named) = bare_source(&recording, hammer)?;
    let mut settings = MeasureSettings::new(source);
    adjust(&mut settings);
    let mut result = finish(recording, settings, named)?;
    if hammer.is_none() {
        let forgotten = super::warning::of_hammer_by_name(&result);
        result.measurement.warnings.extend(forgotten);
    }
    Ok(result)
}

/// Unit of the hammer channel, where there is one, and the responses.
type Named = (Option<String>, Vec<Response>);

/// Where taps are looked for in a bare recording, and what the file says of its channels.
fn bare_source(
    recording: &Recording,
    hammer: Option<&ChannelRef>,
) -> Result<(TapSource, Named), RecordingError> {
    let hammer = hammer
        .map(|reference| channel_index(recording, reference))
        .transpose()?;
    let channels: Vec<usize> = (0..recording.channels().len())
        .filter(|&c| Some(c) != hammer)
        .collect();
    let named = bare_channels(recording, hammer, &channels);
    Ok((source(hammer, channels), named))
}

/// Unit of the hammer channel, and the responses with what the file says of them.
fn bare_channels(recording: &Recording, hammer: Option<usize>, channels: &[usize]) -> Named {
    let info = |channel: usize| recording.channels().get(channel);
    let responses = channels.iter().map(|&channel| Response {
        name: info(channel)
            .and_then(|info| info.name.clone())
            .unwrap_or_else(|| format!("channel {}", channel + 1)),
        kind: None,
        unit: info(channel).and_then(|info| info.unit.clone()),
    });
    let hammer = hammer.and_then(info).and_then(|info| info.unit.clone());
    (hammer, responses.collect())
}

/// Finds the taps of a recording and goes no further: what is in it and what is wrong with it.
///
/// # Errors
/// An unknown hammer channel, an unreadable recording.
pub fn inspect_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
) -> Result<RecordingResult, PipelineError> {
    let (source, named) = bare_source(&recording, hammer)?;
    let taps = find_taps(&recording, &source, &TapSettings::default())?;
    let warnings = super::warning::of_recording(&recording, &source, &taps);
    let measurement = Measurement {
        taps,
        spectra: None,
        warnings,
    };
    result(
        &recording,
        &MeasureSettings::new(source),
        named,
        measurement,
    )
}

fn source(hammer: Option<usize>, responses: Vec<usize>) -> TapSource {
    match hammer {
        Some(channel) => TapSource::Hammer { channel, responses },
        None => TapSource::Responses(responses),
    }
}

fn channel_index(recording: &Recording, reference: &ChannelRef) -> Result<usize, RecordingError> {
    match reference {
        ChannelRef::Number(number) => recording.channel_by_number(*number),
        ChannelRef::Name(name) => recording.channel_by_name(name),
    }
}

fn channel(
    recording: &mut Recording,
    reference: &ChannelRef,
    scale: Option<Scale>,
) -> Result<usize, RecordingError> {
    let index = channel_index(recording, reference)?;
    if let Some(scale) = scale {
        let info = &recording.channels()[index];
        let scale = match scale {
            Scale::PerUnit(scale) => scale,
            // What the header's unit made of the file is volts already, mV included.
            Scale::PerVolt(scale) if info.unit.as_deref() == Some("V") => scale * info.scale,
            Scale::PerVolt(scale) => scale,
        };
        recording.set_scale(index, scale)?;
    }
    Ok(index)
}

pub(super) fn finish(
    recording: Recording,
    settings: MeasureSettings,
    named: Named,
) -> Result<RecordingResult, PipelineError> {
    let measurement = measure(&recording, &settings)?;
    result(&recording, &settings, named, measurement)
}

fn result(
    recording: &Recording,
    settings: &MeasureSettings,
    (hammer_unit, responses): Named,
    measurement: Measurement,
) -> Result<RecordingResult, PipelineError> {
    let shown = settings.source.channels().first().copied().unwrap_or(0);
    let readings = measurement
        .spectra
        .as_ref()
        .map_or(0, |spectra| spectra.readings.len());
    let has_hammer = matches!(settings.source, TapSource::Hammer { .. });
    Ok(RecordingResult {
        file: recording.name().to_string(),
        format: recording.format(),
        sample_rate: Some(recording.sample_rate()),
        seconds: Some(recording.duration()),
        channels: recording.channels().to_vec(),
        has_hammer,
        conditions: Conditions::default(),
        tap_unit: if has_hammer {
            hammer_unit
        } else {
            common_unit(&responses)
        },
        responses,
        band: settings.band,
        overview: Some(Overview {
            close_ups: close_ups(recording, &settings.source, &measurement.taps)?,
            ..overview(recording, shown)?
        }),
        measurement,
        mode_numbers: vec![None; readings],
    })
}

/// The unit that all responses have.
fn common_unit(responses: &[Response]) -> Option<String> {
    let first = responses.first()?;
    let same = responses.iter().all(|other| other.unit == first.unit);
    first.unit.clone().filter(|_| same)
}

/// The SI unit of what a sensor senses.
pub fn si_unit(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Acceleration => "m/s2",
        SensorKind::Velocity => "m/s",
        SensorKind::Displacement => "m",
        SensorKind::Sound => "Pa",
    }
}

/// Smallest and largest value of each piece of a channel, its mean taken out.
fn overview(recording: &Recording, channel: usize) -> Result<Overview, RecordingError> {
    let piece = recording.frames().div_ceil(OVERVIEW_PIECES).max(1) as usize;
    let mean = recording.mean(channel);
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for block in recording.blocks(&[channel], piece * 16) {
        for samples in block?
            .samples
            .iter()
            .flat_map(|samples| samples.chunks(piece))
        {
            low.push(samples.iter().copied().fold(f64::INFINITY, f64::min) - mean);
            high.push(samples.iter().copied().fold(f64::NEG_INFINITY, f64::max) - mean);
        }
    }
    Ok(Overview {
        step: piece as f64 / recording.sample_rate(),
        low,
        high,
        close_ups: Vec::new(),
    })
}
