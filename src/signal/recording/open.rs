//! Opening: from a path or from samples to a checked [`Recording`].

use std::path::Path;
use std::sync::Arc;

use super::coding::Coding;
use super::csv::{CsvRates, CsvSource};
use super::header::Column;
use super::layout::CsvLayout;
use super::sniff::{self, Kind};
use super::text::LARGEST;
use super::uff;
use super::wav::WavSource;
use super::{
    Channel, ChannelInfo, ChannelLabel, Format, HealthMeter, ReadSettings, Recording,
    RecordingError, RecordingWarning, ResponseError, Source, Timing, channel_unit,
};

/// Samples handled at a time when a WAV file is checked, over all channels.
const PASS_SAMPLES: usize = 1 << 16;

/// Two sample rates nearer than this, relatively, are the same.
const SAME_RATE: f64 = 1e-3;

/// A mean rate and the whole number used instead differ worth mentioning from here on, relatively.
const MENTIONED_ROUNDING: f64 = 1e-6;

pub(super) fn open(path: &Path, settings: &ReadSettings) -> Result<Recording, RecordingError> {
    let file = path.display().to_string();
    if let Some(value) = settings.sample_rate {
        check_rate(&file, value)?;
    }
    match sniff::recognise(path, &file)? {
        Kind::Wav => open_wav(path, file, settings),
        Kind::Text => open_csv(path, file, settings),
        Kind::Universal => uff::open_uff(path, file, settings),
    }
}

/// Sample rates that are taken (Hz). Nothing that is tapped needs more or does with less; beyond lie
/// damaged time columns, whose lengths in samples no longer fit a number.
const RATES: std::ops::RangeInclusive<f64> = 1e-3..=1e9;

pub(super) fn check_rate(file: &str, value: f64) -> Result<(), RecordingError> {
    match RATES.contains(&value) {
        true => Ok(()),
        false => Err(RecordingError::BadSampleRate {
            file: file.to_owned(),
            value,
        }),
    }
}

fn open_wav(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let source = WavSource::open(path, &file)?;
    let layout = &source.layout;
    let sample_rate = f64::from(layout.sample_rate);
    let mut warnings = layout.warnings.clone();
    warnings.extend(ignored_rate(settings, sample_rate));
    let format = match layout.coding {
        Coding::Integer { bits } => Format::WavInteger { bits },
        Coding::PaddedInteger { valid, .. } => Format::WavInteger { bits: valid },
        Coding::Float32 => Format::WavFloat { bits: 32 },
        Coding::Float64 => Format::WavFloat { bits: 64 },
    };
    let all: Vec<usize> = (0..layout.channels).collect();
    let mut meters = vec![HealthMeter::new(layout.coding.full_scale()); layout.channels];
    let per_block = (PASS_SAMPLES / layout.channels).max(1) as u64;
    let frames = layout.frames;
    let mut cursor = source.cursor(0)?;
    let mut at = 0;
    while at < frames {
        let mut block = vec![Vec::new(); all.len()];
        let wanted = per_block.min(frames - at);
        cursor.read(&all, wanted, &mut block)?;
        for ((channel, samples), meter) in block.iter().enumerate().zip(&mut meters) {
            check_finite(&file, sample_rate, (channel, at), samples)?;
            meter.add(samples);
        }
        at += wanted;
    }
    drop(cursor);
    let channels = meters.into_iter().map(|meter| ChannelInfo {
        name: None,
        unit: None,
        header_unit: None,
        scale: 1.0,
        health: meter.finish(),
    });
    Ok(Recording {
        name: file,
        path: Some(path.to_owned()),
        format,
        sample_rate,
        frames,
        channels: channels.collect(),
        warnings,
        source: Source::Wav(Box::new(source)),
    })
}

pub(super) fn ignored_rate(settings: &ReadSettings, used: f64) -> Option<RecordingWarning> {
    let given = settings.sample_rate?;
    let differs = (given - used).abs() > SAME_RATE * used;
    differs.then_some(RecordingWarning::SampleRateIgnored { given, used })
}

fn open_csv(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let mut meters: Vec<HealthMeter> = Vec::new();
    let (source, rates) = CsvSource::open(path, &file, |block| {
        meters.resize(block.len(), HealthMeter::new(None));
        for (samples, meter) in block.iter().zip(&mut meters) {
            meter.add(samples);
        }
    })?;
    if source.frames == 0 {
        return Err(RecordingError::NoSamples { file });
    }
    let layout = &source.layout;
    refuse_frequencies(&file, layout)?;
    let (sample_rate, mut warnings) = csv_rate(&file, layout, &rates, settings)?;
    let mut channels = Vec::new();
    for (at, (column, meter)) in layout.channel_columns().into_iter().zip(meters).enumerate() {
        let header = layout.columns.get(column).cloned().unwrap_or_default();
        let (channel, warning) = csv_channel(at, header, meter);
        channels.push(channel);
        warnings.extend(warning);
    }
    let timed = match layout.time {
        Some(_) => Timing::TimeColumn,
        None => Timing::Given,
    };
    let format = Format::Csv {
        separator: layout.separator,
        decimal: char::from(layout.decimal.unwrap_or(b'.')),
        timed,
    };
    Ok(Recording {
        name: file,
        path: Some(path.to_owned()),
        format,
        sample_rate,
        frames: source.frames,
        channels,
        warnings,
        source: Source::Csv(Box::new(source)),
    })
}

/// A first column of frequencies means a frequency response function.
fn refuse_frequencies(file: &str, layout: &CsvLayout) -> Result<(), ResponseError> {
    let Some(first) = layout.columns.first().filter(|_| layout.time.is_none()) else {
        return Ok(());
    };
    let name = first.name.as_deref().unwrap_or_default();
    let unit = first.unit.as_deref().unwrap_or_default();
    let is_unit = |text: &str| ["hz", "khz"].contains(&text.to_lowercase().as_str());
    match name.to_lowercase().starts_with("freq") || is_unit(name) || is_unit(unit) {
        false => Ok(()),
        true => Err(ResponseError::NotTimeSeries {
            file: file.to_owned(),
            line: layout.lines_before + 1,
            column: [name, unit].join(" ").trim().to_owned(),
        }),
    }
}

/// The rate of a text file and what there is to say about it.
fn csv_rate(
    file: &str,
    layout: &CsvLayout,
    rates: &CsvRates,
    settings: &ReadSettings,
) -> Result<(f64, Vec<RecordingWarning>), RecordingError> {
    if let Some((mean, used)) = rates.by_time {
        check_rate(file, used)?;
        let rounded = (mean - used).abs() > MENTIONED_ROUNDING * used;
        let rounded = rounded.then_some(RecordingWarning::RateRounded { mean, used });
        let ignored = ignored_rate(settings, used);
        return Ok((used, rounded.into_iter().chain(ignored).collect()));
    }
    if let Some(given) = settings.sample_rate {
        return Ok((given, Vec::new()));
    }
    if let Some(flat) = rates.flat_time {
        return Err(RecordingError::RepeatedTime {
            file: file.to_owned(),
            line: flat.line,
            column: format!("{}{}", flat.column + 1, layout.shown_name(flat.column)),
            times: flat.values,
        });
    }
    let hint = match (layout.time, rates.unnamed_time) {
        (Some(_), _) => " (a single row has no step)".to_owned(),
        (None, Some(column)) => {
            format!(" (column {} rises evenly: is it the time?)", column + 1)
        }
        (None, None) => String::new(),
    };
    Err(RecordingError::NoSampleRate {
        file: file.to_owned(),
        line: layout.lines_before + 1,
        hint,
    })
}

/// A channel of a text file, its values in SI where the header's unit is known.
fn csv_channel(
    at: usize,
    header: Column,
    meter: HealthMeter,
) -> (ChannelInfo, Option<RecordingWarning>) {
    let known = header.unit.as_deref().and_then(channel_unit);
    let scale = known.map_or(1.0, |(factor, _)| factor);
    let unit = match known {
        Some((_, si)) => Some(si.to_owned()),
        None => header.unit.clone(),
    };
    let warning = match (&header.unit, known) {
        (Some(unit), None) => Some(RecordingWarning::UnknownUnit {
            channel: ChannelLabel {
                number: at + 1,
                name: header.name.clone(),
            },
            unit: unit.clone(),
        }),
        _ => None,
    };
    let channel = ChannelInfo {
        name: header.name,
        unit,
        header_unit: header.unit,
        scale,
        health: meter.finish().scaled(scale),
    };
    (channel, warning)
}

pub(super) fn from_samples(
    name: String,
    sample_rate: f64,
    channels: Vec<Channel>,
) -> Result<Recording, RecordingError> {
    check_rate(&name, sample_rate)?;
    let slices: Vec<&[f64]> = channels.iter().map(|c| c.samples.as_slice()).collect();
    let frames = check_samples(&name, sample_rate, &slices)? as u64;
    let mut infos = Vec::with_capacity(channels.len());
    let mut samples = Vec::with_capacity(channels.len());
    for channel in channels {
        let mut meter = HealthMeter::new(None);
        meter.add(&channel.samples);
        infos.push(ChannelInfo {
            name: channel.name,
            unit: channel.unit,
            header_unit: None,
            scale: 1.0,
            health: meter.finish(),
        });
        samples.push(channel.samples);
    }
    Ok(Recording {
        name,
        path: None,
        format: Format::Memory,
        sample_rate,
        frames,
        channels: infos,
        warnings: Vec::new(),
        source: Source::Memory(Arc::new(samples)),
    })
}

/// Checks channels in memory and returns their common length.
pub(super) fn check_samples(
    name: &str,
    sample_rate: f64,
    channels: &[&[f64]],
) -> Result<usize, RecordingError> {
    let file = || name.to_owned();
    let frames = channels.first().map_or(0, |samples| samples.len());
    if frames == 0 {
        return Err(RecordingError::NoSamples { file: file() });
    }
    for (at, samples) in channels.iter().enumerate() {
        if samples.len() != frames {
            return Err(RecordingError::LengthMismatch {
                file: file(),
                channel: at + 1,
                found: samples.len(),
                expected: frames,
            });
        }
        check_finite(name, sample_rate, (at, 0), samples)?;
    }
    Ok(frames)
}

/// Checks that samples of one channel, the first of them at `place.1`, are finite and not absurd.
pub(super) fn check_finite(
    name: &str,
    sample_rate: f64,
    place: (usize, u64),
    samples: &[f64],
) -> Result<(), RecordingError> {
    // NaN is in no range.
    let usable = |value: &&f64| !(-LARGEST..=LARGEST).contains(*value);
    match samples
        .iter()
        .zip(place.1..)
        .find(|(value, _)| usable(value))
    {
        None => Ok(()),
        Some((value, frame)) => Err(RecordingError::NotFinite {
            file: name.to_owned(),
            channel: place.0 + 1,
            frame,
            time: frame as f64 / sample_rate,
            value: *value,
        }),
    }
}
