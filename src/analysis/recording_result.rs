//! One measured recording: its circumstances, its channels over time, its taps and spectra.

use super::amplitude::{AmplitudeChange, AmplitudeChanges};
use super::measurement::Measurement;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use tapjoint_beam::specimen::PointMass;
use tapjoint_description::SensorKind;
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::recording::{ChannelInfo, Extremes, Format, Recording, RecordingError};
use tapjoint_signal::taps::{TapSource, Taps};

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingResult {
    /// File as the description names it.
    pub file: String,
    /// Its files, where it has several.
    pub files: Vec<String>,
    /// Kind of file.
    pub format: Format,
    /// Sample rate (Hz); `None` of frequency response functions from a file.
    pub sample_rate: Option<f64>,
    /// Length (s); `None` of frequency response functions from a file.
    pub seconds: Option<f64>,
    /// Every channel in the file.
    pub channels: Vec<ChannelInfo>,
    /// True if there is a hammer channel.
    pub has_hammer: bool,
    /// Unit of the taps' peaks: the hammer's, or without one that of all responses; `None` where
    /// they are not known or differ.
    pub tap_unit: Option<String>,
    /// The responses analysed.
    pub responses: Vec<Response>,
    /// The analysed zoom band (Hz), where one was asked for.
    pub band: Option<(f64, f64)>,
    /// Circumstances as described; empty for a bare recording.
    pub conditions: Conditions,
    /// Taps, spectra, readings.
    pub measurement: Measurement,
    /// Numbers of the modes that this recording's readings belong to, one for each reading.
    pub mode_numbers: Vec<Option<usize>>,
    /// The channel on which taps were found, over time; `None` of frequency response functions from a
    /// file.
    pub overview: Option<Overview>,
}

/// Circumstances of a recording that are carried to the outputs as described.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Conditions {
    /// Free length of the beam (m) where the clamp was moved for this recording; left out where it was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_length: Option<f64>,
    /// Position of the taps (m).
    pub tap: Option<f64>,
    /// Position of each sensor (m); that in this recording of a sensor that was moved.
    pub sensor_positions: BTreeMap<String, f64>,
    /// Mass of each sensor (kg) whose mass is stated.
    pub sensor_masses: BTreeMap<String, f64>,
    /// Known masses that are fastened to the beam.
    pub masses: Vec<PointMass>,
    /// Tightening torque (N m).
    pub torque: Option<f64>,
    /// Temperature (degrees Celsius).
    pub temperature: Option<f64>,
    /// Date.
    pub date: Option<String>,
}

/// A response channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// The sensor's name, or the channel's.
    pub name: String,
    /// Kind of sensor; `None` where it is not known.
    pub kind: Option<SensorKind>,
    /// Unit of its values; `None` where it is not known.
    pub unit: Option<String>,
}

/// Smallest and largest value in equal pieces of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Overview {
    /// Length of a piece (s).
    pub step: f64,
    /// Smallest value of each piece (unit of the channel, its mean taken out).
    pub low: Vec<f64>,
    /// Largest value of each piece.
    pub high: Vec<f64>,
    /// The samples about each of the first 200 taps.
    pub close_ups: Vec<CloseUp>,
}

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct CloseUp {
    /// First sample (s from the trigger).
    pub start: f64,
    /// Distance of the samples (s).
    pub step: f64,
    /// The force's samples (N), the channel's mean taken out; `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// The first response's (its unit).
    pub response: Option<Vec<f64>>,
}

impl RecordingResult {
    /// Returns the recording's own readings of resonances, ascending; none without spectra.
    pub fn readings(&self) -> &[ModeReading] {
        let spectra = self.measurement.spectra.as_ref();
        spectra.map_or(&[], |spectra| &spectra.readings)
    }

    /// Returns true where the force of every accepted tap is known: there is a hammer, and no pulse was cut off.
    pub(super) fn has_tap_forces(&self) -> bool {
        let mut taps = self.measurement.taps.accepted();
        self.has_hammer && taps.all(|tap| tap.overload.is_none_or(|overload| !overload.is_force))
    }

    /// Peaks of the accepted taps (`tap_unit`).
    pub(super) fn tap_peaks(&self) -> Vec<f64> {
        let taps = self.measurement.taps.accepted();
        taps.map(|tap| tap.peak).collect()
    }

    /// Frequencies (Hz) between which it was searched for resonances; `None` without spectra.
    pub(super) fn looked_at(&self) -> Option<(f64, f64)> {
        let lines = self.measurement.spectra.as_ref()?.averages.lines;
        Some((lines.low, lines.high))
    }
}

/// Pieces of the overview of a recording over time: two for each pixel of a usual picture.
const OVERVIEW_PIECES: u64 = 2400;

/// Smallest and largest value of each piece of a channel, its mean taken out.
pub(super) fn overview(recording: &Recording, channel: usize) -> Result<Overview, RecordingError> {
    let piece = recording.frames().div_ceil(OVERVIEW_PIECES).max(1) as usize;
    let mean = recording.mean(channel);
    let (mut pieces, mut length) = (Vec::new(), piece);
    match recording.outline(channel) {
        // Of a long recording the extremes are known.
        Some(outline) if outline.length <= piece => {
            let together = piece.div_ceil(outline.length);
            length = together * outline.length;
            pieces.extend(outline.pieces.chunks(together).map(|pieces| {
                let pieces = pieces.iter().copied();
                pieces.fold(Extremes::NONE, Extremes::with)
            }));
        }
        _ => {
            for block in recording.blocks(&[channel], piece * 16) {
                let block = block?.samples;
                let samples = block.iter().flat_map(|samples| samples.chunks(piece));
                pieces.extend(samples.map(Extremes::of));
            }
        }
    }
    Ok(Overview {
        step: length as f64 / recording.sample_rate(),
        low: pieces.iter().map(|piece| piece.low - mean).collect(),
        high: pieces.iter().map(|piece| piece.high - mean).collect(),
        close_ups: Vec::new(),
    })
}

/// Shown before a tap's trigger (s).
const BEFORE: f64 = 2e-3;
/// Shown after it (s): the pulse, and how the response sets out.
const AFTER: f64 = 30e-3;
/// Shown after a second hit (s): its pulse.
const AFTER_SECOND: f64 = 10e-3;

/// Most taps whose samples are kept for the page, the first ones: each takes some kilobytes.
const MOST_CLOSE_UPS: usize = 200;

/// The samples about the first taps.
pub(super) fn close_ups(
    recording: &Recording,
    source: &TapSource,
    taps: &Taps,
) -> Result<Vec<CloseUp>, RecordingError> {
    let (force, responses) = match source {
        TapSource::Hammer { channel, responses } => (Some(*channel), responses),
        TapSource::Responses(responses) => (None, responses),
    };
    let rate = recording.sample_rate();
    let shown_taps = &taps.taps[..taps.taps.len().min(MOST_CLOSE_UPS)];
    let mut all = Vec::with_capacity(shown_taps.len());
    for tap in shown_taps {
        let second = tap.second_hit.map(|second| second.delay + AFTER_SECOND);
        let after = second.map_or(AFTER, |second| second.max(AFTER));
        let first = ((tap.time - BEFORE) * rate).round().max(0.0) as u64;
        let last = ((tap.time + after) * rate).round().max(0.0) as u64;
        let mut shown = [None, None];
        for (shown, channel) in shown.iter_mut().zip([force, responses.first().copied()]) {
            if let Some(channel) = channel {
                let mean = recording.mean_at(channel, first);
                let samples = recording.read(channel, first..last)?.into_iter();
                *shown = Some(samples.map(|value| value - mean).collect());
            }
        }
        let [force, response] = shown;
        all.push(CloseUp {
            start: first as f64 / rate - tap.time,
            step: 1.0 / rate,
            force,
            response,
        });
    }
    Ok(all)
}

impl RecordingResult {
    /// Change of a mode with its amplitude, where it is beyond the uncertainty and large enough to matter.
    pub fn amplitude_change(&self, reading: &ModeReading) -> Option<AmplitudeChange> {
        let curve = reading.fit.as_ref()?.amplitude.as_ref()?;
        let change = AmplitudeChange::of(curve)?;
        let response = curve.sensor.and_then(|sensor| self.responses.get(sensor));
        let unit = response.and_then(|response| response.unit.clone());
        Some(AmplitudeChange { unit, ..change })
    }
}

/// Changes of the numbered modes of each recording with their amplitude.
pub(super) fn amplitude_changes(recordings: &[RecordingResult]) -> Vec<(String, AmplitudeChanges)> {
    let mut all = Vec::new();
    for recording in recordings {
        let numbered = recording.readings().iter().zip(&recording.mode_numbers);
        let changes = numbered
            .filter_map(|(reading, &mode)| Some((mode?, recording.amplitude_change(reading)?)));
        all.push((recording.file.clone(), changes.collect()));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::recording::Channel;
    use tapjoint_signal::taps::{SecondHit, Tap};

    #[test]
    fn limit_a_close_up_ends_where_the_recording_does() {
        let channel = |from: f64| Channel {
            name: None,
            unit: None,
            samples: (0..100).map(|k| from + f64::from(k)).collect(),
        };
        let channels = vec![channel(0.0), channel(500.0)];
        let recording = Recording::from_samples("taps", 1000.0, channels).expect("samples");
        let hit = |time, second_hit| Tap {
            file: None,
            time,
            peak: 1.0,
            pulse_end: None,
            pulse: None,
            record: 0..100,
            second_hit,
            overload: None,
            rejection: None,
            overruled: None,
        };
        let far = SecondHit {
            delay: 0.035,
            ratio: 0.6,
        };
        let taps = Taps {
            taps: vec![
                hit(0.001, None),
                hit(0.050, None),
                hit(0.090, None),
                // As far as a second hit, which is why a tap is rejected.
                hit(0.010, Some(far)),
            ],
            noise: 0.0,
            quiet: 0..0,
            remarks: Vec::new(),
        };
        let source = TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        };
        let all = close_ups(&recording, &source, &taps).expect("samples");
        let forces: Vec<&Vec<f64>> = all.iter().flat_map(|one| &one.force).collect();
        let lengths: Vec<usize> = forces.iter().map(|force| force.len()).collect();
        assert_eq!(lengths, [31, 32, 12, 47]);
        assert!((all[1].start + 0.002).abs() < 1e-12, "{}", all[1].start);
        // Both channels show the same frames, each less its mean.
        assert_eq!(all[1].force, all[1].response);
        assert_eq!(forces[1][0], 48.0 - 49.5);
        let alone = close_ups(&recording, &TapSource::Responses(vec![0]), &taps).expect("samples");
        assert!(alone.iter().all(|one| one.force.is_none()));
        assert_eq!(alone[3].response.as_ref(), Some(forces[3]));
    }
}
