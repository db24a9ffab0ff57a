//! Modes whose frequency or damping changes with the amplitude, and the warnings about them.

use super::recording_result::RecordingResult;
use super::warnings::Warning;
use schemars::JsonSchema;
use serde::Serialize;
use std::cmp::Ordering;
use std::fmt;
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudeReading, AmplitudeVerdict};

/// Smallest relative change of a frequency that is reported: 0.01 %, a fifth of the smallest
/// change that Ingole & Chatterjee perturb frequencies by.
const LEAST_FREQUENCY_CHANGE: f64 = 1e-4;
/// Smallest relative change of a damping that is reported: 5 %, about the repeatability of a joint's damping.
const LEAST_DAMPING_CHANGE: f64 = 0.05;
/// Bounds of a curve up to this many times their median count as well known.
const USUAL: f64 = 3.0;
/// Most modes named in one warning; the findings of the report name them all.
const MOST_NAMED: usize = 1;

/// Change of a mode along its decays: values at the largest and at the smallest amplitude at which its
/// curve is well known.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AmplitudeChange {
    /// Peak amplitude of the strongest sensor (`unit`).
    pub amplitude: [f64; 2],
    /// Unit of the amplitude; `None` where it is not known.
    pub unit: Option<String>,
    /// Frequency (Hz).
    pub frequency: [f64; 2],
    /// 95 % bounds of the frequency (Hz).
    pub frequency_bound: [f64; 2],
    /// Damping ratio.
    #[serde(rename = "damping")]
    pub damping_ratio: [f64; 2],
    /// 95 % bounds of the damping ratio.
    pub damping_bound: [f64; 2],
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

impl AmplitudeChange {
    /// The change of a mode's curve where it is beyond its uncertainty and large enough to matter, its amplitude
    /// without a unit.
    fn of(curve: &AmplitudeCurve) -> Option<AmplitudeChange> {
        if curve.verdict != AmplitudeVerdict::Changes {
            return None;
        }
        let points = curve.points.iter();
        let mut known: Vec<AmplitudeReading> = points
            .filter_map(|point| curve.at_amplitude(point.amplitude))
            .collect();
        known.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        // At a curve's ends a polynomial says little: its bounds there are far beyond the usual ones.
        let mut frequency_bounds: Vec<f64> = known.iter().map(|r| r.frequency_bound).collect();
        let mut damping_bounds: Vec<f64> = known.iter().map(|r| r.damping_bound).collect();
        let most_of_frequency = USUAL * median(&mut frequency_bounds);
        let most_of_damping = USUAL * median(&mut damping_bounds);
        known.retain(|reading| {
            reading.frequency_bound <= most_of_frequency && reading.damping_bound <= most_of_damping
        });
        let ends = [known.first()?, known.last()?];
        let change = AmplitudeChange {
            amplitude: ends.map(|end| end.amplitude),
            unit: None,
            frequency: ends.map(|end| end.frequency),
            frequency_bound: ends.map(|end| end.frequency_bound),
            damping_ratio: ends.map(|end| end.damping_ratio),
            damping_bound: ends.map(|end| end.damping_bound),
        };
        let (frequency, damping) = change.size();
        let matters = frequency > LEAST_FREQUENCY_CHANGE || damping > LEAST_DAMPING_CHANGE;
        matters.then_some(change)
    }

    /// Changes of the frequency and of the damping ratio relative to them; 0 within their bounds. They are
    /// compared in this order.
    fn size(&self) -> (f64, f64) {
        (
            relative_change(self.frequency, self.frequency_bound),
            relative_change(self.damping_ratio, self.damping_bound),
        )
    }

    /// Returns the way in which a mode changes, by the signs of the changes beyond their bounds.
    fn way(&self) -> Way {
        let frequency = direction(self.frequency, self.frequency_bound);
        let damping = direction(self.damping_ratio, self.damping_bound);
        match (frequency, damping) {
            (Ordering::Greater, _) => Way::Stiffens,
            (Ordering::Less, Ordering::Less) => Way::Mixed,
            (Ordering::Equal, Ordering::Less) => Way::Rubs,
            _ => Way::Slips,
        }
    }
}

/// Returns true if two values differ by more than the sum of their bounds.
fn differs(values: [f64; 2], bounds: [f64; 2]) -> bool {
    (values[1] - values[0]).abs() > bounds[0] + bounds[1]
}

/// Change from the first to the second value over the first (1), without its sign; 0 within the bounds.
fn relative_change(values: [f64; 2], bounds: [f64; 2]) -> f64 {
    match differs(values, bounds) {
        true => ((values[1] - values[0]) / values[0]).abs(),
        false => 0.0,
    }
}

/// Order of the first and the second value; equal within the bounds.
fn direction(values: [f64; 2], bounds: [f64; 2]) -> Ordering {
    match differs(values, bounds) {
        true => values[0].total_cmp(&values[1]),
        false => Ordering::Equal,
    }
}

impl fmt::Display for AmplitudeChange {
    /// "rises from 80.28 to 80.54 Hz and its damping falls from 0.28 to 0.15 % as the amplitude falls from
    /// 33 to 2.3 m/s\u{b2}".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit.as_deref().unwrap_or("of the file's unit");
        let values = self.damping_ratio.map(|ratio| 100.0 * ratio);
        let bounds = self.damping_bound.map(|bound| 100.0 * bound);
        let (mean, bound) = (0.5 * (values[0] + values[1]), bounds[0].max(bounds[1]));
        // A damping is never negative, whatever noise makes of it.
        let damping = if differs(values, bounds) {
            moves(values.map(|value| value.max(0.0)), bounds)
        } else if mean > bound {
            moves(values, bounds)
        } else {
            format!("stays below {}", two_digits(mean.max(0.0) + bound))
        };
        write!(
            f,
            "{} Hz and its damping {damping} % as the amplitude falls from {} to {} {}",
            moves(self.frequency, self.frequency_bound),
            two_digits(self.amplitude[0]),
            two_digits(self.amplitude[1]),
            unit.replace("m/s2", "m/s\u{b2}")
        )
    }
}

/// "rises from 80.28 to 80.54", with the decimals that show the change's two leading digits, or "stays
/// near 80.4".
fn moves([first, last]: [f64; 2], bounds: [f64; 2]) -> String {
    if !differs([first, last], bounds) {
        let decimals = decimals(bounds[0] + bounds[1]).saturating_sub(1);
        return format!("stays near {:.decimals$}", 0.5 * (first + last));
    }
    let decimals = decimals(last - first);
    let verb = if last > first { "rises" } else { "falls" };
    format!("{verb} from {first:.decimals$} to {last:.decimals$}")
}

/// Way in which a mode changes with the amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Softer, or more damped, the harder it is driven.
    Slips,
    /// Stiffer the harder it is driven.
    Stiffens,
    /// Less damped the harder it is driven.
    Rubs,
    /// Softer and less damped: no single one of these.
    Mixed,
}

impl Way {
    /// The usual causes of such a change.
    fn cause(self) -> &'static str {
        match self {
            Way::Slips => {
                "a joint or support that slips softens and damps more the harder it is driven, and so may a \
                 sensor or cable that sits loose"
            }
            Way::Stiffens => {
                "it stiffens the harder it is driven, which slip does not do: a contact that closes, a \
                 support that tightens, or a beam held at both ends does"
            }
            Way::Rubs => {
                "it is damped less the harder it is driven, which slip that only begins does not do: dry friction of a \
                 constant force (a cable or support that rubs) does, and a decay that ends in noise or in another \
                 mode looks like it"
            }
            Way::Mixed => {
                "it softens but is damped less the harder it is driven, which slip that only begins does not do: a \
                 contact that slides all the way, or another mode nearby, may"
            }
        }
    }
}

fn two_digits(value: f64) -> String {
    format!("{value:.0$}", decimals(value))
}

/// Decimals that show the two leading digits of a value.
fn decimals(value: f64) -> usize {
    (1.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize
}

/// Returns one warning for each way in which modes change, with the recording in which they change most.
pub(super) fn of_amplitude(recordings: &[RecordingResult]) -> Vec<Warning> {
    let mut all = Vec::new();
    for recording in recordings {
        let numbered = recording.readings().iter().zip(&recording.mode_numbers);
        let changes: Changes = numbered
            .filter_map(|(reading, &mode)| Some((mode?, recording.amplitude_change(reading)?)))
            .collect();
        all.push((recording.file.clone(), changes));
    }
    by_way(all)
}

/// Numbers of modes, and how each changes.
type Changes = Vec<(usize, AmplitudeChange)>;

/// Groups the changes of all recordings by their way.
fn by_way(all: Vec<(String, Changes)>) -> Vec<Warning> {
    let mut groups: Vec<(Way, Vec<(String, Changes)>)> = Vec::new();
    for (file, changes) in all {
        for (mode, change) in changes {
            let way = change.way();
            let place = groups.iter().position(|group| group.0 == way);
            let place = place.unwrap_or_else(|| {
                groups.push((way, Vec::new()));
                groups.len() - 1
            });
            let own = &mut groups[place].1;
            match own.last_mut().filter(|one| one.0 == file) {
                Some(one) => one.1.push((mode, change)),
                None => own.push((file.clone(), vec![(mode, change)])),
            }
        }
    }
    let warnings = groups.into_iter().map(|(_, group)| dependence(group));
    warnings.collect()
}

/// The warning about recordings, at least one, whose modes change in one way: that in which they change most, and the
/// others.
fn dependence(mut group: Vec<(String, Changes)>) -> Warning {
    let (mut worst, mut most) = (0, (0.0, 0.0));
    for (place, (_, changes)) in group.iter().enumerate() {
        for (_, change) in changes {
            if change.size() > most {
                (worst, most) = (place, change.size());
            }
        }
    }
    let (file, changes) = group.remove(worst);
    let named: Vec<String> = changes
        .iter()
        .take(MOST_NAMED)
        .map(|(mode, change)| format!("mode {mode} {change}"))
        .collect();
    let mut text = named.join("; ");
    match changes.len().saturating_sub(MOST_NAMED) {
        0 => {}
        1 => text += "; 1 more mode changes with it",
        more => text += &format!("; {more} more modes change with it"),
    }
    if let Some((_, first)) = changes.first() {
        text += &format!("; {}", first.way().cause());
    }
    text += "; a recording at a second tap level would confirm it, and frequencies should be stated with their \
             amplitude, or taken from softer taps";
    for (place, (file, changes)) in group.iter().enumerate() {
        let begin = if place == 0 { "; the same in" } else { ";" };
        let numbers: Vec<String> = changes.iter().map(|(mode, _)| mode.to_string()).collect();
        let plural = if changes.len() == 1 { "" } else { "s" };
        text += &format!("{begin} {file}: mode{plural} {}", numbers.join(", "));
    }
    Warning::about(&file, "amplitude-dependent", text)
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
            frequency_bound: [0.01, 0.02],
            damping_ratio: [0.00283, 0.00149],
            damping_bound: [0.0001, 0.0001],
        };
        let plain = |change: &AmplitudeChange| change.to_string().replace('\u{a0}', " ");
        assert_eq!(
            plain(&change),
            "rises from 80.28 to 80.54 Hz and its damping falls from 0.28 to 0.15 % as the amplitude \
             falls from 33 to 2.3 m/s\u{b2}"
        );
        let steady = AmplitudeChange {
            damping_bound: [0.001, 0.001],
            ..change
        };
        assert!(plain(&steady).contains("its damping stays near 0.2 %"));
        let undamped = AmplitudeChange {
            damping_ratio: [-0.000_12, -0.000_05],
            damping_bound: [0.0002, 0.0002],
            ..steady
        };
        assert!(plain(&undamped).contains("its damping stays below 0.020 %"));
    }

    /// A change of frequency and damping as the amplitude falls.
    fn change(frequency: [f64; 2], damping_ratio: [f64; 2]) -> AmplitudeChange {
        AmplitudeChange {
            amplitude: [10.0, 1.0],
            unit: None,
            frequency,
            frequency_bound: [0.01, 0.01],
            damping_ratio,
            damping_bound: [0.0001, 0.0001],
        }
    }

    #[test]
    fn regress_the_cause_follows_the_sign_of_the_change() {
        let steady = [0.002, 0.002];
        let cases = [
            ([80.0, 80.5], steady, "softens and damps more"),
            ([80.0, 80.0], [0.004, 0.002], "softens and damps more"),
            ([80.5, 80.0], steady, "stiffens the harder"),
            ([80.0, 80.0], [0.002, 0.004], "damped less the harder"),
            ([80.0, 80.5], [0.002, 0.004], "softens but is damped less"),
        ];
        for (frequency, damping, cause) in cases {
            let changes = vec![(1, change(frequency, damping))];
            let text = by_way(vec![("a.wav".into(), changes)])[0].to_string();
            assert!(text.contains(cause), "{frequency:?} {damping:?}: {text}");
        }
    }

    #[test]
    fn regress_a_cause_is_said_of_the_modes_that_go_its_way_alone() {
        let softer = change([80.0, 80.5], [0.002, 0.002]);
        let stiffer = change([500.5, 500.0], [0.002, 0.002]);
        let text = |changes: Vec<(usize, AmplitudeChange)>| {
            by_way(vec![("a.wav".into(), changes)])[0].to_string()
        };
        let alike = text(vec![(1, softer.clone()), (2, softer.clone())]);
        assert!(
            alike.contains("1 more mode changes with it; a joint"),
            "{alike}"
        );
        let mixed = by_way(vec![(
            "a.wav".into(),
            vec![(1, softer.clone()), (2, softer), (3, stiffer)],
        )]);
        let texts: Vec<String> = mixed.iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), 2, "{texts:?}");
        let told = "1 more mode changes with it; a joint";
        assert!(texts[0].contains(told), "{texts:?}");
        let other = texts[1].starts_with("a.wav: mode 3 falls");
        assert!(
            other && texts[1].contains("stiffens the harder"),
            "{texts:?}"
        );
    }

    #[test]
    fn regress_recordings_that_change_alike_are_one_warning() {
        let softer = change([80.0, 80.5], [0.002, 0.002]);
        let softest = change([79.0, 80.5], [0.002, 0.002]);
        let stiffer = change([500.5, 500.0], [0.002, 0.002]);
        let one = |file: &str, changes: &[(usize, &AmplitudeChange)]| {
            let own = changes.iter().map(|&(mode, one)| (mode, one.clone()));
            (file.to_owned(), own.collect())
        };
        let found = by_way(vec![
            one("a.wav", &[(1, &softer), (2, &softer)]),
            one("b.wav", &[(3, &stiffer)]),
            one("c.wav", &[(1, &softest)]),
            one("d.wav", &[(2, &softer), (3, &stiffer)]),
        ]);
        let texts: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), 2, "{texts:?}");
        assert!(texts[0].starts_with("c.wav: mode 1 rises"), "{}", texts[0]);
        let also = "; the same in a.wav: modes 1, 2; d.wav: mode 2";
        assert!(texts[0].ends_with(also), "{}", texts[0]);
        assert!(texts[1].starts_with("b.wav: mode 3 falls"), "{}", texts[1]);
        assert!(
            texts[1].ends_with("; the same in d.wav: mode 3"),
            "{}",
            texts[1]
        );
    }

    /// A mode whose frequency stays within its bounds is ranked by its damping, and not by noise.
    #[test]
    fn regress_modes_that_rub_are_ranked_by_their_damping() {
        let little = change([80.0, 80.015], [0.002, 0.003]);
        let much = change([80.0, 80.001], [0.002, 0.006]);
        let found = by_way(vec![
            ("a.wav".to_owned(), vec![(1, little)]),
            ("b.wav".to_owned(), vec![(1, much)]),
        ]);
        assert_eq!(found.len(), 1);
        assert!(found[0].to_string().starts_with("b.wav"), "{found:?}");
    }
}
