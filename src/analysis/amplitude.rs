//! Modes whose frequency or damping changes with the amplitude.

use schemars::JsonSchema;
use serde::Serialize;
use std::cmp::Ordering;
use std::fmt;
use tapjoint_numerics::stats::median;
use tapjoint_signal::modal::amplitude::{
    AmplitudeCurve, AmplitudeReading, AmplitudeVerdict, LEAST_CHANGE,
};

/// Smallest relative change of a damping that is reported: 5 %, about the repeatability of a joint's damping.
const LEAST_DAMPING_CHANGE: f64 = 0.05;
/// Bounds of a curve up to this many times their median count as well known.
const USUAL: f64 = 3.0;

/// Change of a mode along its decays: values at the largest and at the smallest amplitude at which its
/// curve is well known.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AmplitudeChange {
    /// Peak amplitude of the strongest sensor (`unit`).
    pub amplitude: [f64; 2],
    /// Unit of the amplitude; `None` where it is not known.
    pub unit: Option<String>,
    /// Amplitude at which the mode's one frequency holds (`unit`); `None` where it is that of a pole that does not change.
    pub holds_at: Option<f64>,
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

/// Numbers of a recording's modes, and how each changes.
pub(super) type AmplitudeChanges = Vec<(usize, AmplitudeChange)>;

impl AmplitudeChange {
    /// The change of a mode's curve where it is beyond its uncertainty and large enough to matter, its amplitude
    /// without a unit.
    pub(super) fn of(curve: &AmplitudeCurve) -> Option<AmplitudeChange> {
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
            holds_at: curve.stated.and(curve.amplitude),
            frequency: ends.map(|end| end.frequency),
            frequency_bound: ends.map(|end| end.frequency_bound),
            damping_ratio: ends.map(|end| end.damping_ratio),
            damping_bound: ends.map(|end| end.damping_bound),
        };
        let (frequency, damping) = change.size();
        let matters = frequency > LEAST_CHANGE || damping > LEAST_DAMPING_CHANGE;
        matters.then_some(change)
    }

    /// Changes of the frequency and of the damping ratio relative to them; 0 within their bounds. They are
    /// compared in this order.
    pub(super) fn size(&self) -> (f64, f64) {
        (
            relative_change(self.frequency, self.frequency_bound),
            relative_change(self.damping_ratio, self.damping_bound),
        )
    }

    /// Returns the way in which a mode changes, by the signs of the changes beyond their bounds.
    pub(super) fn way(&self) -> Way {
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
        )?;
        match self.holds_at {
            Some(amplitude) => write!(f, "; the one listed holds at {}", two_digits(amplitude)),
            None => Ok(()),
        }
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
pub(super) enum Way {
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
    pub(super) fn cause(self) -> &'static str {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_change_in_words() {
        let change = AmplitudeChange {
            amplitude: [33.2, 2.31],
            unit: Some("m/s2".into()),
            holds_at: None,
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
        let listed = AmplitudeChange {
            holds_at: Some(14.2),
            ..change.clone()
        };
        assert!(plain(&listed).ends_with("2.3 m/s\u{b2}; the one listed holds at 14"));
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
}
