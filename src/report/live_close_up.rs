//! What the page shows when a tap is chosen: the samples about it, of the force and of the first response.

use serde::Serialize;

use super::figures::{TapCloseUp, TapCurve};
use super::format::significant;

/// Most numbers of a curve: the force's pulse of a millisecond keeps some ten, while a hundred taps stay below
/// half a megabyte.
const MOST_NUMBERS: usize = 400;
/// Numbers are whole parts of the largest: half a pixel of the curve's height.
const PARTS: f64 = 500.0;

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveCloseUp {
    /// First point (ms from the trigger).
    pub start: f64,
    /// Distance of the points (ms).
    pub step: f64,
    /// The curves, the force's first.
    pub curves: Vec<LiveTapCurve>,
    /// What the curves leave out; empty where nothing.
    pub note: String,
}

/// A curve about a tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveTapCurve {
    /// "force".
    pub label: String,
    /// "N".
    pub unit: String,
    /// What one whole part is (unit).
    pub part: f64,
    /// The values (parts).
    pub values: Vec<i32>,
}

/// The samples about a tap, thinned where there are more than a screen can show; `None` without any.
pub fn live_close_up(close_up: &TapCloseUp) -> Option<LiveCloseUp> {
    let count = close_up.curves.iter().map(|curve| curve.values.len());
    let count = count.max().filter(|count| *count > 0)?;
    let stride = if count > MOST_NUMBERS {
        (2 * count).div_ceil(MOST_NUMBERS)
    } else {
        1
    };
    let step = 1e3 * close_up.step;
    // The two values of a piece stand a quarter and three quarters into it.
    let (offset, spacing) = if stride > 1 {
        (0.25 * (stride as f64 - 2.0), 0.5 * stride as f64)
    } else {
        (0.0, 1.0)
    };
    Some(LiveCloseUp {
        start: 1e3 * close_up.start + offset * step,
        step: spacing * step,
        curves: close_up
            .curves
            .iter()
            .map(|one| curve(one, stride))
            .collect(),
        note: if stride > 1 {
            format!(
                "The smallest and largest value of every {} ms.",
                significant(stride as f64 * step, 2)
            )
        } else {
            String::new()
        },
    })
}

fn curve(curve: &TapCurve, stride: usize) -> LiveTapCurve {
    let finite = curve.values.iter().filter(|value| value.is_finite());
    let largest = finite.fold(0.0_f64, |most, value| most.max(value.abs()));
    let part = format!("{:.3e}", largest / PARTS).parse().unwrap_or(0.0);
    let part = if part > 0.0 { part } else { 1.0 };
    let values = if stride > 1 {
        curve.values.chunks(stride).flat_map(ends).collect()
    } else {
        curve.values.clone()
    };
    LiveTapCurve {
        label: curve.label.clone(),
        unit: curve.unit.clone(),
        part,
        // What is no number becomes 0.
        values: values
            .iter()
            .map(|value| (value / part).round() as i32)
            .collect(),
    }
}

/// Smallest and largest value in the order in which they stand.
fn ends(values: &[f64]) -> [f64; 2] {
    let numbered = || values.iter().copied().enumerate();
    let low = numbered()
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or_default();
    let high = numbered()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or_default();
    if low.0 <= high.0 {
        [low.1, high.1]
    } else {
        [high.1, low.1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pulse of half a sine, 1 ms long, that begins at the trigger.
    fn pulse(rate: f64) -> TapCloseUp {
        let value = |k: usize| {
            let time = k as f64 / rate - 2e-3;
            let inside = (0.0..1e-3).contains(&time);
            if inside {
                40.0 * (std::f64::consts::PI * time / 1e-3).sin()
            } else {
                0.0
            }
        };
        TapCloseUp {
            start: -2e-3,
            step: 1.0 / rate,
            curves: vec![TapCurve {
                label: "force".to_owned(),
                unit: "N".to_owned(),
                values: (0..(0.032 * rate) as usize).map(value).collect(),
            }],
        }
    }

    #[test]
    fn prop_a_pulse_keeps_its_height_its_place_and_its_length() {
        for rate in [2048.0, 12_800.0, 51_200.0, 200_000.0] {
            let live = live_close_up(&pulse(rate)).expect("samples");
            let curve = &live.curves[0];
            assert!(curve.values.len() <= MOST_NUMBERS + 2, "{rate}");
            let value = |k: usize| f64::from(curve.values[k]) * curve.part;
            let time = |k: usize| live.start + live.step * k as f64;
            let largest = (0..curve.values.len())
                .max_by_key(|k| curve.values[*k])
                .expect("values");
            let spacing = (1e3 / rate).max(live.step);
            assert!(
                (value(largest) - 40.0).abs() < 40.0 * (1.6 * spacing).powi(2) + 0.1,
                "{rate}"
            );
            assert!(
                (time(largest) - 0.5).abs() <= spacing,
                "{rate}: {}",
                time(largest)
            );
            let high = (0..curve.values.len())
                .filter(|k| value(*k) > 4.0)
                .map(time);
            let length = high.clone().fold(f64::MIN, f64::max) - high.fold(f64::MAX, f64::min);
            assert!((length - 0.93).abs() <= 2.0 * spacing, "{rate}: {length}");
        }
    }

    #[test]
    fn limit_without_samples_there_is_no_close_up_and_silence_is_flat() {
        let mut close_up = pulse(2048.0);
        close_up.curves[0].values.fill(0.0);
        let live = live_close_up(&close_up).expect("samples");
        assert!(live.curves[0].values.iter().all(|value| *value == 0));
        close_up.curves[0].values.clear();
        assert_eq!(live_close_up(&close_up), None);
    }
}
