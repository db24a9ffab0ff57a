//! Modes whose frequency or damping changes with the amplitude.

use std::fmt;

use super::Warning;
use crate::modal::ModeReading;
use crate::modal::amplitude::{AmplitudeVerdict, Trend};
use crate::pipeline::analysis::RecordingResult;

/// A change of the frequency below this share is not worth a word: 0.01 %, a fifth of the smallest
/// change that Ingole & Chatterjee perturb frequencies by.
const LEAST_FREQUENCY_CHANGE: f64 = 1e-4;
/// The same of the damping: 5 %, about what one repeats of a joint's damping.
const LEAST_DAMPING_CHANGE: f64 = 0.05;
/// Most modes named in one warning; the findings of the report name them all.
const MOST_NAMED: usize = 1;

/// What a mode does along its decays: values at the largest and at the smallest amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeChange {
    /// Peak amplitude of the strongest sensor (`unit`).
    pub amplitude: [f64; 2],
    /// Unit of the amplitude; `None` where nobody said.
    pub unit: Option<String>,
    /// Frequency (Hz).
    pub frequency: [f64; 2],
    /// Damping ratio.
    pub damping_ratio: [f64; 2],
}

impl AmplitudeChange {
    /// The change of a fitted mode where it is beyond its uncertainty and large enough to matter.
    pub fn of(reading: &ModeReading, recording: &RecordingResult) -> Option<AmplitudeChange> {
        let curve = reading.fit.as_ref()?.amplitude.as_ref()?;
        if curve.verdict != AmplitudeVerdict::Changes {
            return None;
        }
        let ends = |trend: &Trend| [trend.first, trend.last];
        let amplitudes = || curve.points.iter().map(|point| point.amplitude);
        let response = curve
            .sensor
            .and_then(|sensor| recording.responses.get(sensor));
        let change = AmplitudeChange {
            amplitude: [
                amplitudes().max_by(f64::total_cmp)?,
                amplitudes().min_by(f64::total_cmp)?,
            ],
            unit: response.and_then(|response| response.unit.clone()),
            frequency: ends(curve.frequency.as_ref()?),
            damping_ratio: ends(curve.damping.as_ref()?),
        };
        let share = |[first, last]: [f64; 2]| ((last - first) / first).abs();
        let matters = share(change.frequency) > LEAST_FREQUENCY_CHANGE
            || share(change.damping_ratio) > LEAST_DAMPING_CHANGE;
        matters.then_some(change)
    }
}

impl fmt::Display for AmplitudeChange {
    /// "rises from 80.28 to 80.54 Hz and its damping falls from 0.28 to 0.15 % as the amplitude falls from
    /// 33 to 2.3 m/s\u{b2}".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit.as_deref().unwrap_or("of the file's unit");
        write!(
            f,
            "{} Hz and its damping {} % as the amplitude falls from {} to {} {}",
            moves(self.frequency),
            moves(self.damping_ratio.map(|ratio| 100.0 * ratio)),
            two_digits(self.amplitude[0]),
            two_digits(self.amplitude[1]),
            unit.replace("m/s2", "m/s\u{b2}")
        )
    }
}

/// "rises from 80.28 to 80.54", with the decimals that show the change's two leading digits.
fn moves([first, last]: [f64; 2]) -> String {
    let decimals = decimals(last - first);
    let verb = if last > first { "rises" } else { "falls" };
    format!("{verb} from {first:.decimals$} to {last:.decimals$}")
}

fn two_digits(value: f64) -> String {
    format!("{value:.0$}", decimals(value))
}

/// Decimals that show the two leading digits of a value.
fn decimals(value: f64) -> usize {
    (1.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize
}

/// One warning for each recording with modes that change.
pub(in crate::pipeline) fn of_amplitude(recordings: &[RecordingResult]) -> Vec<Warning> {
    let warning = |recording: &RecordingResult| {
        let spectra = recording.measurement.spectra.as_ref()?;
        let numbered = spectra.readings.iter().zip(&recording.mode_numbers);
        let changes: Vec<(usize, AmplitudeChange)> = numbered
            .filter_map(|(reading, &mode)| Some((mode?, AmplitudeChange::of(reading, recording)?)))
            .collect();
        (!changes.is_empty()).then(|| Warning::AmplitudeDependent {
            file: recording.file.clone(),
            changes,
        })
    };
    recordings.iter().filter_map(warning).collect()
}

pub(super) fn write_dependence(
    f: &mut fmt::Formatter<'_>,
    file: &str,
    changes: &[(usize, AmplitudeChange)],
) -> fmt::Result {
    let named: Vec<String> = changes
        .iter()
        .take(MOST_NAMED)
        .map(|(mode, change)| format!("mode {mode} {change}"))
        .collect();
    write!(f, "{file}: {}", named.join("; "))?;
    let more = changes.len().saturating_sub(MOST_NAMED);
    if more > 0 {
        let modes = if more == 1 {
            "mode changes"
        } else {
            "modes change"
        };
        write!(f, "; {more} more {modes} with it")?;
    }
    f.write_str(
        "; a joint or support that slips softens and damps more the harder it is driven, and so may a \
         sensor or cable that sits loose; a recording at a second tap level would confirm it, and \
         frequencies should be stated with their amplitude, or taken from softer taps",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_change_in_words() {
        let change = AmplitudeChange {
            amplitude: [33.2, 2.31],
            unit: Some("m/s2".into()),
            frequency: [80.281, 80.543],
            damping_ratio: [0.00285, 0.00149],
        };
        assert_eq!(
            change.to_string(),
            "rises from 80.28 to 80.54 Hz and its damping falls from 0.28 to 0.15 % as the amplitude \
             falls from 33 to 2.3 m/s\u{b2}"
        );
    }
}
