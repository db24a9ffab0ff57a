//! What the arguments say of a bare recording's channels.

use anyhow::bail;
use tapjoint::description::{ChannelRef, SensorKind};
use tapjoint::pipeline::{Response, Wiring, si_unit};
use tapjoint::recording::{Recording, RecordingError};

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
        hammer,
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
