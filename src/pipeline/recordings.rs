//! Opening a test's recordings and measuring each.

use std::path::Path;

use super::analysis::{Overview, RecordingResult, Response};
use super::measure::{MeasureError, MeasureSettings, Measurement, measure};
use crate::description::{ChannelRef, RecordingDescription, TestDescription};
use crate::recording::{ReadSettings, Recording, RecordingError};
use crate::taps::{TapSettings, TapSource, find_taps};

/// Pieces of the overview of a recording over time: two for each pixel of a usual picture.
const OVERVIEW_PIECES: u64 = 2400;

/// What stops an analysis.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A recording could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A recording file of a kind this version cannot read.
    #[error(
        "{file}:{line}: {recording} is described as frequency response functions, which this version \
         does not read; give the time series of hammer and sensors (WAV or CSV)"
    )]
    FrequencyResponses {
        /// The description.
        file: String,
        /// Its line.
        line: usize,
        /// The recording.
        recording: String,
    },
    /// A description without sensors.
    #[error(
        "{file}: the recordings need at least one [[sensor]] with its channel, or there is no response \
         to analyse"
    )]
    NoSensors {
        /// The description.
        file: String,
    },
}

/// Opens and measures one recording of a described test.
pub(super) fn measure_described(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, test_file): (&Path, &str),
) -> Result<RecordingResult, PipelineError> {
    let file = description.file.display().to_string();
    if description.form.is_some() {
        let (test_file, line) = (test_file.to_string(), description.line);
        return Err(PipelineError::FrequencyResponses {
            file: test_file,
            line,
            recording: file,
        });
    }
    if test.sensors.is_empty() {
        return Err(PipelineError::NoSensors {
            file: test_file.to_string(),
        });
    }
    let settings = ReadSettings {
        sample_rate: description.sample_rate,
    };
    let mut recording = Recording::open(&folder.join(&description.file), &settings)?;
    let hammer = match &test.hammer {
        Some(hammer) => Some(channel(&mut recording, &hammer.channel, hammer.scale)?),
        None => None,
    };
    let mut channels = Vec::with_capacity(test.sensors.len());
    for sensor in &test.sensors {
        channels.push(channel(&mut recording, &sensor.channel, sensor.scale)?);
    }
    let mut settings = MeasureSettings::new(source(hammer, channels));
    settings.band = description.band;
    settings.block = description.block;
    settings.window = test.analysis.window;
    let responses = test
        .sensors
        .iter()
        .map(|sensor| Response {
            name: sensor.name.clone(),
            kind: Some(sensor.kind),
        })
        .collect();
    finish(recording.renamed(file), settings, responses)
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
    let hammer = hammer
        .map(|reference| channel_index(&recording, reference))
        .transpose()?;
    let channels: Vec<usize> = (0..recording.channels().len())
        .filter(|&c| Some(c) != hammer)
        .collect();
    let responses = channels
        .iter()
        .map(|&c| {
            let named = recording.channels()[c].name.clone();
            Response {
                name: named.unwrap_or_else(|| format!("channel {}", c + 1)),
                kind: None,
            }
        })
        .collect();
    let mut settings = MeasureSettings::new(source(hammer, channels));
    adjust(&mut settings);
    finish(recording, settings, responses)
}

/// Finds the taps of a recording and goes no further: what is in it and what is wrong with it.
///
/// # Errors
/// An unknown hammer channel, an unreadable recording.
pub fn inspect_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
) -> Result<RecordingResult, PipelineError> {
    let hammer = hammer
        .map(|reference| channel_index(&recording, reference))
        .transpose()?;
    let channels = (0..recording.channels().len())
        .filter(|&c| Some(c) != hammer)
        .collect();
    let source = source(hammer, channels);
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
        Vec::new(),
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
    scale: Option<f64>,
) -> Result<usize, RecordingError> {
    let index = channel_index(recording, reference)?;
    if let Some(scale) = scale {
        recording.set_scale(index, scale)?;
    }
    Ok(index)
}

fn finish(
    recording: Recording,
    settings: MeasureSettings,
    responses: Vec<Response>,
) -> Result<RecordingResult, PipelineError> {
    let measurement = measure(&recording, &settings)?;
    result(&recording, &settings, responses, measurement)
}

fn result(
    recording: &Recording,
    settings: &MeasureSettings,
    responses: Vec<Response>,
    measurement: Measurement,
) -> Result<RecordingResult, PipelineError> {
    let shown = settings.source.channels().first().copied().unwrap_or(0);
    let readings = measurement
        .spectra
        .as_ref()
        .map_or(0, |spectra| spectra.readings.len());
    Ok(RecordingResult {
        file: recording.name().to_string(),
        sample_rate: recording.sample_rate(),
        seconds: recording.duration(),
        channels: recording.channels().to_vec(),
        has_hammer: matches!(settings.source, TapSource::Hammer { .. }),
        responses,
        band: settings.band,
        overview: overview(recording, shown)?,
        measurement,
        mode_numbers: vec![None; readings],
    })
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
    })
}
