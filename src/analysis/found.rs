//! What the files of a test hold, for a description that is yet to be written.

use std::path::Path;

use tapjoint_description::{FoundChannel, FoundContent, FoundRecording, FunctionForm, SensorKind};
use tapjoint_signal::recording::{
    FrequencyResponses, ReadSettings, Recording, RecordingError, open_frequency_responses,
};
use tapjoint_signal::taps::{Rejection, TapSettings, TapSource, Taps, find_taps};

/// Samples of each channel by which a hammer is recognised.
const LOOKED_AT: u64 = 4_000_000;

/// Least kurtosis of a hammer's channel. A pulse of a thousandth of the record has about a thousand; a tap that rings
/// for a tenth of it has some thirty, noise 3.
const PULSES: f64 = 100.0;

/// Least ratio of a hammer's kurtosis to that of any other channel: pulses last far shorter than what they excite.
const SHORTER: f64 = 3.0;

/// Opens a file and tells what it holds. A file that cannot be opened is told as such.
pub fn look_at(path: &Path, name: &str) -> FoundRecording {
    let settings = ReadSettings::default();
    let content = match Recording::open(path, &settings) {
        Ok(recording) => series(&recording),
        Err(
            RecordingError::FrequencyColumn { .. }
            | RecordingError::Functions { .. }
            | RecordingError::NoTimeSeries { .. },
        ) => open_frequency_responses(path, &settings).map(|found| functions(&found)),
        Err(problem) => Err(problem),
    };
    FoundRecording {
        file: name.to_owned(),
        content: content.unwrap_or_else(|problem| FoundContent::Unread(problem.to_string())),
    }
}

fn functions(found: &FrequencyResponses) -> FoundContent {
    let form = found.responses.first().and_then(|response| response.form);
    FoundContent::Functions {
        form: match found.has_phase {
            true => form.map(FunctionForm::Response),
            false => Some(FunctionForm::Spectrum),
        },
        band: (
            found.frequency(0),
            found.frequency(found.lines.saturating_sub(1)),
        ),
        count: found.responses.len(),
    }
}

fn series(recording: &Recording) -> Result<FoundContent, RecordingError> {
    let mut channels = Vec::new();
    for info in recording.channels() {
        channels.push(FoundChannel {
            name: info.name.clone(),
            unit: info.unit.clone(),
            kind: match info.unit.as_deref() {
                Some("m/s") => Some(SensorKind::Velocity),
                Some("m") => Some(SensorKind::Displacement),
                Some("Pa") => Some(SensorKind::Sound),
                Some("m/s2") => Some(SensorKind::Acceleration),
                _ => None,
            },
        });
    }
    let hammer = hammer(recording)?;
    let force = hammer.map(|(channel, _)| channel);
    let responses = (0..channels.len()).filter(|channel| Some(*channel) != force);
    let responses = responses.collect();
    let source = match force {
        Some(channel) => TapSource::Hammer { channel, responses },
        None => TapSource::Responses(responses),
    };
    // A file with one tap is short.
    let taps = match recording.frames() <= LOOKED_AT {
        true => find_taps(recording, &source, &TapSettings::default())?
            .taps
            .len(),
        false => 0,
    };
    Ok(FoundContent::Series {
        hammer,
        channels,
        sample_rate: recording.sample_rate(),
        taps,
    })
}

/// Returns the channel of the hammer (0-based), and what shows it: its name, its unit, or the shape of its signal.
fn hammer(recording: &Recording) -> Result<Option<(usize, &'static str)>, RecordingError> {
    let channels = recording.channels();
    let named = channels.iter().position(|info| {
        let name = info.name.as_deref().unwrap_or_default().to_lowercase();
        ["hammer", "force", "kraft", "impact"]
            .iter()
            .any(|word| name.contains(word))
    });
    if let Some(channel) = named {
        return Ok(Some((channel, "by its name")));
    }
    let in_newton = channels
        .iter()
        .position(|info| info.unit.as_deref() == Some("N"));
    if let Some(channel) = in_newton {
        return Ok(Some((channel, "by its unit")));
    }
    let sharpest = channel_of_pulses(recording)?;
    Ok(sharpest.map(|channel| (channel, "by its short pulses; check it")))
}

/// Time about a trigger in which the pulse of another channel belongs to it (s). 30 ms: the trigger on a
/// response comes later than the pulse.
const TOGETHER: f64 = 0.03;

/// Share of a channel's peak that its pulses reach at taps (1). 10 %: hits differ in strength.
const PULSE_OF_PEAK: f64 = 0.1;

/// Returns a doubt where most taps are no hits of a hammer, and another channel has short pulses at the others.
pub fn hammer_doubt(recording: &Recording, source: &TapSource, taps: &Taps) -> Option<String> {
    let TapSource::Hammer { channel, .. } = source else {
        return None;
    };
    if taps.odd() <= taps.accepted().count() {
        return None;
    }
    // A file that cannot be read is an error elsewhere.
    let other = channel_of_pulses(recording).ok().flatten()?;
    let hits = taps.taps.iter();
    let hits = hits.filter(|tap| !matches!(tap.rejection, Some(Rejection::NoResponse)));
    let together = hits
        .clone()
        .filter(|tap| has_pulse(recording, other, tap.time));
    let coincide = 2 * together.count() > hits.count();
    (*channel != other && coincide).then(|| {
        format!(
            "most taps are rejected. Channel {other} has the short pulses of a hammer. If it is the hammer, say --hammer {other}, or \
             correct the hammer's `channel` in the description",
            other = other + 1
        )
    })
}

/// Returns true where a channel (0-based) has a pulse about this time (s).
fn has_pulse(recording: &Recording, channel: usize, time: f64) -> bool {
    let rate = recording.sample_rate();
    let frame = |time: f64| (time.max(0.0) * rate) as u64;
    let about = frame(time - TOGETHER)..frame(time + TOGETHER);
    let mean = recording.mean(channel);
    let peak = recording.channels()[channel].health.peak;
    let samples = recording.read(channel, about).unwrap_or_default();
    let mut heights = samples.iter().map(|sample| (sample - mean).abs());
    heights.any(|height| height > PULSE_OF_PEAK * peak)
}

/// Returns the channel (0-based) whose pulses are far shorter than those of the others; `None` where there is none.
fn channel_of_pulses(recording: &Recording) -> Result<Option<usize>, RecordingError> {
    let channels = recording.channels().len();
    let mut sharpness = Vec::with_capacity(channels);
    for channel in 0..channels {
        sharpness.push(kurtosis(&recording.read(channel, 0..LOOKED_AT)?));
    }
    let sharpest = (0..channels).max_by(|a, b| sharpness[*a].total_cmp(&sharpness[*b]));
    let is_hammer = |channel: &usize| {
        let mut others = (0..sharpness.len()).filter(|other| other != channel);
        sharpness[*channel] >= PULSES
            && sharpness.len() > 1
            && others.all(|other| sharpness[*channel] >= SHORTER * sharpness[other])
    };
    Ok(sharpest.filter(is_hammer))
}

/// Returns the fourth moment over the square of the second, about the mean; 0 for a constant.
fn kurtosis(samples: &[f64]) -> f64 {
    let count = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / count;
    let (mut second, mut fourth) = (0.0, 0.0);
    for sample in samples {
        let square = (sample - mean).powi(2);
        second += square;
        fourth += square * square;
    }
    if second > 0.0 {
        count * fourth / (second * second)
    } else {
        0.0
    }
}
