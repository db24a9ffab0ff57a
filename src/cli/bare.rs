//! Taking a bare file as far as it goes: samples in time, or frequency response functions.

use super::arguments::RecordingArguments;
use anyhow::bail;
use std::path::Path;
use tapjoint::description::{ChannelRef, ReadBy, SensorKind, WindowKind};
use tapjoint::pipeline::{
    Analysis, FunctionSettings, Response, Wiring, run_functions, run_recording, si_unit,
};
use tapjoint::recording::{
    Recording, RecordingError, ResponseError, UffError, open_frequency_responses,
};

/// What the command line may say of the analysis.
#[derive(Debug, Default)]
pub(super) struct BareSettings {
    pub(super) block: Option<usize>,
    pub(super) band: Option<(f64, f64)>,
    pub(super) window: Option<WindowKind>,
    pub(super) reading: ReadBy,
}

/// Analyses a recording; a file that holds frequency response functions instead is read as such.
///
/// # Errors
/// What keeps the file from being read; options that functions have no use for; an analysis that is
/// not possible.
pub(super) fn analyse(
    path: &Path,
    arguments: &RecordingArguments,
    settings: &BareSettings,
) -> anyhow::Result<Analysis> {
    let problem = match arguments.open(path) {
        Ok(recording) => {
            let analysis = run_recording(recording, arguments.hammer.as_ref(), |measure| {
                measure.block = settings.block;
                measure.band = settings.band;
                measure.window = settings.window;
                measure.reading = settings.reading;
            });
            return Ok(analysis?);
        }
        Err(problem) => problem,
    };
    // Only a file that is recognised as no time series is looked at again.
    if !is_no_time_series(&problem) {
        return Err(problem.into());
    }
    let mut functions = match (problem, open_frequency_responses(path)) {
        (_, Ok(functions)) => functions,
        // A universal file without samples may hold neither.
        (problem @ RecordingError::Uff(_), Err(_)) => return Err(problem.into()),
        (_, Err(problem)) => return Err(problem.into()),
    };
    refuse_options(path, arguments, settings)?;
    let name = path.file_name().unwrap_or(path.as_os_str());
    functions.file = name.to_string_lossy().into_owned();
    let settings = FunctionSettings {
        band: settings.band,
        reading: settings.reading,
        ..FunctionSettings::default()
    };
    Ok(run_functions(&functions, &settings)?)
}

/// Whether a file holds frequency response functions and no samples in time.
///
/// # Errors
/// What keeps it from being read as either.
pub(super) fn holds_functions(path: &Path, arguments: &RecordingArguments) -> anyhow::Result<bool> {
    match arguments.open(path) {
        Ok(_) => Ok(false),
        Err(problem) if is_no_time_series(&problem) => Ok(true),
        Err(problem) => Err(problem.into()),
    }
}

/// Whether a file was recognised and holds no samples in time.
fn is_no_time_series(problem: &RecordingError) -> bool {
    matches!(
        problem,
        RecordingError::Responses(ResponseError::NotTimeSeries { .. })
            | RecordingError::Uff(UffError::NoTimeSeries { .. })
    )
}

/// Options for samples in time say nothing of functions that an analyser has computed.
fn refuse_options(
    path: &Path,
    arguments: &RecordingArguments,
    settings: &BareSettings,
) -> anyhow::Result<()> {
    let given = [
        ("--hammer", arguments.hammer.is_some()),
        ("--sample-rate", arguments.sample_rate.is_some()),
        ("--block", settings.block.is_some()),
        ("--window", settings.window.is_some()),
    ];
    refuse_given(path, &given)
}

/// Refuses the first of these options that was given.
///
/// # Errors
/// One was.
pub(super) fn refuse_given(path: &Path, given: &[(&str, bool)]) -> anyhow::Result<()> {
    match given.iter().find(|(_, given)| *given) {
        Some((name, _)) => bail!(
            "{}: holds frequency response functions, and {name} is for samples in time; leave it out",
            path.display()
        ),
        None => Ok(()),
    }
}

/// Finds hammer and sensors (all other channels where none is named), and scales them.
///
/// # Errors
/// Channels that do not exist or are named twice, scales that do not fit them.
pub(super) fn wire(
    mut recording: Recording,
    (hammer, hammer_scale): (&ChannelRef, Option<f64>),
    (sensors, scales): (&[ChannelRef], &[f64]),
    kind: Option<SensorKind>,
) -> anyhow::Result<(Recording, Wiring)> {
    let hammer = index(&recording, hammer)?;
    let channels = channels(&recording, hammer, sensors)?;
    if !matches!(scales.len(), 0 | 1) && scales.len() != channels.len() {
        bail!(
            "--scale-sensor has {} numbers for {} sensors; give one for all, or one for each",
            scales.len(),
            channels.len()
        );
    }
    if let Some(scale) = hammer_scale {
        recording.set_scale(hammer, scale)?;
    }
    let hammer_unit = match hammer_scale {
        Some(_) => Some("N".to_owned()),
        None => unit(&recording, hammer),
    };
    let mut responses = Vec::with_capacity(channels.len());
    for (place, channel) in channels.into_iter().enumerate() {
        let response = match scales.get(place).or(scales.first()) {
            Some(scale) => {
                recording.set_scale(channel, *scale)?;
                let kind = kind.unwrap_or(SensorKind::Acceleration);
                named(
                    &recording,
                    channel,
                    (Some(kind), Some(si_unit(kind).to_owned())),
                )
            }
            None => named(&recording, channel, (None, unit(&recording, channel))),
        };
        responses.push((channel, response));
    }
    let wiring = Wiring {
        hammer: Some(hammer),
        hammer_unit,
        responses,
    };
    Ok((recording, wiring))
}

fn index(recording: &Recording, reference: &ChannelRef) -> Result<usize, RecordingError> {
    match reference {
        ChannelRef::Number(number) => recording.channel_by_number(*number),
        ChannelRef::Name(name) => recording.channel_by_name(name),
    }
}

fn channels(
    recording: &Recording,
    hammer: usize,
    sensors: &[ChannelRef],
) -> anyhow::Result<Vec<usize>> {
    let mut channels: Vec<usize> = Vec::new();
    for sensor in sensors {
        let channel = index(recording, sensor)?;
        if channel == hammer || channels.contains(&channel) {
            bail!(
                "{}: channel {sensor} is named twice; give the hammer and every sensor a channel of its own",
                recording.name()
            );
        }
        channels.push(channel);
    }
    if sensors.is_empty() {
        let all = 0..recording.channels().len();
        channels = all.filter(|&channel| channel != hammer).collect();
    }
    if channels.is_empty() {
        bail!(
            "{}: there is no channel beside the hammer's, and without a response no frequency response function",
            recording.name()
        );
    }
    Ok(channels)
}

fn unit(recording: &Recording, channel: usize) -> Option<String> {
    recording.channels().get(channel)?.unit.clone()
}

fn named(
    recording: &Recording,
    channel: usize,
    (kind, unit): (Option<SensorKind>, Option<String>),
) -> Response {
    let info = recording.channels().get(channel);
    let name = info.and_then(|info| info.name.clone());
    Response {
        name: name.unwrap_or_else(|| format!("channel {}", channel + 1)),
        kind,
        unit,
    }
}
