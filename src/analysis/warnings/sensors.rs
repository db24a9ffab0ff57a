//! Doubts about sensors that the modes' shapes raise: mounted the other way, or with a scale that gives modal constants
//! that no beam of this mass has.

use super::Warning;
use std::collections::BTreeMap;
use tapjoint_identify::pairing::SizeAt;
use tapjoint_numerics::stats::{median, times};

/// A scale is doubted where modal constants are wrong by more than this factor. 3: wrong positions and joints change them by
/// less in the median over three modes, and every usual mistake of units by more.
const DOUBTFUL: f64 = 3.0;
/// The scatter of the modes about their median must be this many times smaller (as logarithm): the median of three modes is
/// known to about their scatter.
const CLEAR_OF_SCATTER: f64 = 3.0;
/// Sensors are wrong by the same factor within this one. 1.5: ratios scatter by a third in simulated tests.
const ALIKE: f64 = 1.5;
/// Factors of usual mistakes, and how far (1, relative) a measured one may be from them: 15 %, the scatter in simulated
/// tests.
const MISTAKES: [(f64, &str); 3] = [
    (4.448, "between lbf and N"),
    (9.807, "between g and m/s2"),
    (1000.0, "between a unit and its thousandth"),
];
const NEAR_MISTAKE: f64 = 0.15;

impl Warning {
    /// The warning about sensors whose signs are those of the model only if they are inverted.
    /// `count` is the number of all sensors.
    pub(crate) fn inverted_sensors(names: &[String], count: usize) -> Option<Self> {
        let what = match names {
            [] => return None,
            all if all.len() == count => format!(
                "half of the sensors {} move against the direction of the others",
                all.join(", ")
            ),
            [one] => format!("sensor {one} moves against the direction of the others"),
            several => format!(
                "sensors {} move against the direction of the others",
                several.join(", ")
            ),
        };
        let text = format!(
            "{what} in the modes' shapes: mounted the other way, or an inverted channel; the modes were numbered with the \
             sign reversed; turn the sensor, or reverse the sign of its `scale` or `sensitivity`"
        );
        Some(Warning::new("inverted-sensor", text))
    }

    /// The warning about a file of modes whose shapes are not used.
    pub(crate) fn shapes_left_out(file: &str, reason: &str) -> Self {
        let text = format!(
            "the modes are numbered by their frequencies alone, without their shapes: {reason}"
        );
        Warning::about(file, "shapes-left-out", text)
    }

    /// The warning about sensors whose modal constants the model cannot have. `sizes` are those at the places of each
    /// sensor.
    pub(crate) fn doubtful_scales(sizes: &BTreeMap<String, Vec<SizeAt>>) -> Option<Self> {
        let mut ratios: BTreeMap<&str, f64> = BTreeMap::new();
        let mut doubtful: Vec<&str> = Vec::new();
        for (name, places) in sizes {
            let mut of_places: Vec<f64> = places.iter().map(|at| at.ratio).collect();
            ratios.insert(name, median(&mut of_places));
            if places.iter().all(is_doubtful) {
                doubtful.push(name);
            }
        }
        let mut factors: Vec<f64> = doubtful.iter().map(|name| ratios[name]).collect();
        let factor = median(&mut factors);
        let mut all = ratios.values();
        let (of, scales) = match doubtful[..] {
            [] => return None,
            // One scale, that of the hammer, explains all of them.
            _ if all.all(|ratio| (ratio / factor).ln().abs() < ALIKE.ln()) => (
                "the measured modal constants are".to_owned(),
                format!("the hammer or of {}", doubtful.join(", ")),
            ),
            [name] => (
                format!("the modal constants of sensor {name} are"),
                format!("sensor {name}"),
            ),
            _ => {
                let words = doubtful.iter();
                let words = words.map(|name| format!("{name} ({})", factor_words(ratios[name])));
                let text = format!(
                    "the modal constants of several sensors are not those of a beam of this mass: {}; check their `scale` or \
                     `sensitivity`, and that of the hammer",
                    words.collect::<Vec<_>>().join(", ")
                );
                return Some(Warning::new("doubtful-scale", text));
            }
        };
        let larger = factor.max(1.0 / factor);
        let mistake = MISTAKES
            .iter()
            .find(|(size, _)| (larger / size - 1.0).abs() < NEAR_MISTAKE);
        let hint = mistake.map_or(String::new(), |(size, words)| {
            format!(", near the factor {size} {words}")
        });
        let text = format!(
            "{of} {} than those of a beam of this mass{hint}; check `scale` or `sensitivity` of {scales}, and the unit",
            factor_words(factor)
        );
        Some(Warning::new("doubtful-scale", text))
    }
}

/// "9.8 times larger", "more than 1000 times smaller".
fn factor_words(ratio: f64) -> String {
    let larger = ratio.max(1.0 / ratio);
    let side = if ratio > 1.0 { "larger" } else { "smaller" };
    format!("{} times {side}", times(larger))
}

fn is_doubtful(at: &SizeAt) -> bool {
    let log = at.ratio.ln().abs();
    log > DOUBTFUL.ln() && log > CLEAR_OF_SCATTER * at.spread.ln()
}
