//! What an ideal observer reaches, to hold the score against.
//!
//! A Monte Carlo study of 840 cases with frequencies good to 0.03 % and effects of the sizes drawn here, diagnosed by
//! the very model that made them: nothing is left to reach but what the readings do not hold. A diagnosis from
//! recordings whose frequencies are better known than that may surpass it.
//!
//! What it names is by a definition near to the one used here, but not the same: an effect of a probability above 0.8
//! whose model fits, from five modes, where the diagnosis gives a verdict on five of six modes and the one withheld. The
//! shares that rest on it (something is named, nothing is called an effect) compare in size alone.

use super::draw::Extent;

/// Figures by key, with one configuration and five modes, and with two sensor positions, two levels and shapes.
const IDEAL: [(&str, f64, f64); 14] = [
    ("top_1", 0.664, 0.872),
    ("top_1_detectable", 0.81, 0.94),
    ("top_3", 0.87, 0.99),
    ("where", 0.686, 0.887),
    ("named_right", 0.986, 0.993),
    ("coverage", 0.50, 0.75),
    ("null_called_effect", 0.0, 0.0),
    ("null_false_alarm", 0.25, 0.17),
    ("outside_named", 0.15, 0.17),
    ("outside_unknown", 0.25, 0.58),
    ("set_coverage", 0.95, 0.99),
    ("set_size", 2.7, 1.5),
    ("brier", 0.44, 0.21),
    ("calibration_error", 0.04, 0.03),
];

/// An ideal observer's figure with tests of this extent, where it is known.
pub(super) fn ideal(key: &str, extent: Extent) -> Option<f64> {
    let (_, one, five) = IDEAL.iter().find(|figure| figure.0 == key)?;
    Some(match extent {
        Extent::OneRecording => *one,
        Extent::FiveRecordings => *five,
    })
}
