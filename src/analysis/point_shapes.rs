//! Measured mode shapes at numbered points, as other programs read them.
//!
//! A recording shows a shape at its own sensors. Where sensors or taps were moved, the recordings show parts of one shape.
//! Parts join by a place that both have, or by their modal constants where both were tapped at one place.

use super::observed_mode::shape_of;
use super::recording_result::RecordingResult;
use super::results::ModeResult;
use super::{Analysis, Response};
use std::collections::{BTreeMap, BTreeSet};
use tapjoint_description::SensorKind;

/// Two parts of a shape join by a common place. There both have at least this share of their largest displacement (1): nearer
/// to a node of the mode the ratio is noise.
const LEAST_SHARE: f64 = 0.1;

/// Points at which motion or force was measured. Their numbers count from 1, along the beam; points without a place follow.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NumberedPoints {
    /// Place of each point (m along the beam), in the order of their numbers; `None` where the description states none.
    pub places: Vec<Option<f64>>,
    /// Numbers of the points of the responses, for each recording.
    pub responses: Vec<Vec<usize>>,
    /// Number of the tapped point of each recording; `None` without a hammer.
    pub taps: Vec<Option<usize>>,
}

/// A measured mode shape.
#[derive(Debug, Clone, PartialEq)]
pub struct PointShape {
    /// Number of the mode.
    pub mode: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its standard uncertainty (Hz), where known.
    pub std: Option<f64>,
    /// Damping ratio (1), where known.
    pub damping: Option<f64>,
    /// Displacements, by the numbers of their points.
    pub values: BTreeMap<usize, PointDisplacement>,
}

/// Displacement of a mode at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDisplacement {
    /// Displacement over the largest of the mode (1); signs are those of the motion in one direction.
    pub value: f64,
    /// Its standard uncertainty (1) from the readings of this recording; 0 where the value is 1 by definition.
    pub std: f64,
    /// Name of the sensor.
    pub sensor: String,
    /// File of the recording.
    pub recording: String,
}

/// All measured mode shapes of the beam as described.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointShapes {
    /// The points.
    pub points: NumberedPoints,
    /// The shapes, ascending in frequency.
    pub modes: Vec<PointShape>,
    /// Numbers of the modes without a shape: no fit gave their amplitudes.
    pub without: Vec<usize>,
    /// Recordings whose part of a mode cannot be joined with the others, with the numbers of these modes.
    pub apart: BTreeMap<String, BTreeSet<usize>>,
    /// Files of recordings with other fastened masses than the first one: their shapes are others.
    pub loaded: BTreeSet<String>,
}

/// Returns the measured shapes of the numbered modes. Recordings of other free lengths or with other fastened masses show
/// other shapes and are left out.
pub fn point_shapes(analysis: &Analysis) -> PointShapes {
    let mut found = PointShapes {
        points: numbered_points(&analysis.recordings),
        ..PointShapes::default()
    };
    let masses = analysis.recordings.iter();
    let mut masses = masses.filter(|one| one.conditions.free_length.is_none());
    let masses = masses.next().map(|one| one.conditions.masses.as_slice());
    for recording in &analysis.recordings {
        if Some(recording.conditions.masses.as_slice()) != masses {
            found.loaded.insert(recording.file.clone());
        }
    }
    for mode in &analysis.modes {
        let Some(number) = mode.mode else { continue };
        let parts = parts(
            mode,
            number,
            &analysis.recordings,
            &found.points,
            &found.loaded,
        );
        let (values, apart) = joined(parts);
        for file in apart {
            found.apart.entry(file).or_default().insert(number);
        }
        if values.is_empty() {
            found.without.push(number);
            continue;
        }
        let read = mode.reading.as_ref();
        found.modes.push(PointShape {
            mode: number,
            frequency: mode.frequency,
            std: mode.std,
            damping: mode.damping.or(read.and_then(|read| read.damping_ratio)),
            values,
        });
    }
    found
}

/// Numbers the points of all recordings.
fn numbered_points(recordings: &[RecordingResult]) -> NumberedPoints {
    // Places to the micrometre, so that one place has one number.
    let key = |place: f64| (1e6 * place).round() as i64;
    let mut placed = BTreeSet::new();
    let mut named = BTreeSet::new();
    for recording in recordings {
        for response in &recording.responses {
            match place_of(recording, response) {
                Some(place) => _ = placed.insert(key(place)),
                // Nothing says that a sensor of unknown place stood still between recordings.
                None => _ = named.insert((&recording.file, &response.name)),
            }
        }
        if let Some(tap) = recording.conditions.tap.filter(|_| recording.has_hammer) {
            placed.insert(key(tap));
        }
    }
    let numbers: BTreeMap<i64, usize> = placed.iter().copied().zip(1..).collect();
    let names: BTreeMap<(&String, &String), usize> =
        named.into_iter().zip(1 + placed.len()..).collect();
    let mut points = NumberedPoints::default();
    let places = placed.iter().map(|place| Some(*place as f64 / 1e6));
    points.places.extend(places);
    points.places.resize(placed.len() + names.len(), None);
    for recording in recordings {
        let responses = recording.responses.iter();
        let responses = responses.map(|response| match place_of(recording, response) {
            Some(place) => numbers[&key(place)],
            None => names[&(&recording.file, &response.name)],
        });
        points.responses.push(responses.collect());
        points.taps.push(match recording.conditions.tap {
            _ if !recording.has_hammer => None,
            Some(tap) => numbers.get(&key(tap)).copied(),
            None => {
                points.places.push(None);
                Some(points.places.len())
            }
        });
    }
    points
}

/// Place of a response on the beam (m); a microphone has none.
fn place_of(recording: &RecordingResult, response: &Response) -> Option<f64> {
    let place = recording.conditions.sensor_positions.get(&response.name);
    place
        .copied()
        .filter(|_| response.kind != Some(SensorKind::Sound))
}

/// A shape as one recording shows it.
struct Part {
    values: BTreeMap<usize, PointDisplacement>,
    /// Product of the mass-normalised shapes at tap and strongest sensor (1/kg), with its standard uncertainty.
    constant: Option<(f64, f64)>,
    /// Number of the tapped point.
    tap: Option<usize>,
    recording: String,
}

/// Returns what each recording shows of a mode; the recording that its frequency was read from comes first.
fn parts(
    mode: &ModeResult,
    number: usize,
    recordings: &[RecordingResult],
    points: &NumberedPoints,
    loaded: &BTreeSet<String>,
) -> Vec<Part> {
    let mut parts = Vec::new();
    for (index, recording) in recordings.iter().enumerate() {
        let numbered = recording.readings().iter().zip(&recording.mode_numbers);
        let mut own = numbered.filter(|(_, own)| **own == Some(number));
        let Some((reading, _)) = own.next() else {
            continue;
        };
        if recording.conditions.free_length.is_some() || loaded.contains(&recording.file) {
            continue;
        }
        let (shape, constant) = shape_of(reading, recording);
        let mut part = Part {
            values: BTreeMap::new(),
            constant: constant.map(|constant| (constant.value, constant.std)),
            tap: points.taps[index],
            recording: recording.file.clone(),
        };
        for value in shape.iter().filter(|value| value.value.is_finite()) {
            let displacement = PointDisplacement {
                value: value.value,
                std: value.std,
                sensor: recording.responses[value.sensor].name.clone(),
                recording: recording.file.clone(),
            };
            let point = points.responses[index][value.sensor];
            part.values.entry(point).or_insert(displacement);
        }
        if part.values.is_empty() {
            continue;
        }
        if mode.reading.as_ref() == Some(reading) {
            parts.insert(0, part);
        } else {
            parts.push(part);
        }
    }
    parts
}

/// A part of a shape that has joined the others.
struct Joined {
    constant: Option<(f64, f64)>,
    tap: Option<usize>,
    /// Its values in the whole over its own, with the relative standard uncertainty.
    factor: f64,
    relative: f64,
}

/// Joins the parts of a shape to the first of them, and makes its largest displacement 1. Returns the files of the parts that
/// share nothing with the others as well.
fn joined(mut parts: Vec<Part>) -> (BTreeMap<usize, PointDisplacement>, Vec<String>) {
    if parts.is_empty() {
        return (BTreeMap::new(), Vec::new());
    }
    let first = parts.remove(0);
    let mut whole = first.values;
    let mut done = vec![Joined {
        constant: first.constant,
        tap: first.tap,
        factor: 1.0,
        relative: 0.0,
    }];
    // A part may join by one that has joined after it was looked at.
    while let Some((index, (factor, relative))) = (parts.iter().enumerate())
        .find_map(|(index, part)| Some((index, part.ratio(&whole, &done)?)))
    {
        let part = parts.remove(index);
        for (point, mut own) in part.values {
            own.value *= factor;
            own.std = (own.std * factor).hypot(own.value * relative);
            whole.entry(point).or_insert(own);
        }
        done.push(Joined {
            constant: part.constant,
            tap: part.tap,
            factor,
            relative,
        });
    }
    let apart = parts.into_iter().map(|part| part.recording).collect();
    make_largest_one(&mut whole);
    (whole, apart)
}

impl Part {
    /// Returns the factor from its values to those of the whole, with its relative standard uncertainty; `None` where they
    /// share neither a place away from a node nor a tap.
    fn ratio(
        &self,
        whole: &BTreeMap<usize, PointDisplacement>,
        done: &[Joined],
    ) -> Option<(f64, f64)> {
        // The common point that is farthest from a node of the mode.
        let common = self.values.iter().filter_map(|(point, own)| {
            let other = whole.get(point)?;
            let least = own.value.abs().min(other.value.abs());
            Some((least, own, other))
        });
        let common = common.max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, own, other)) = common.filter(|(least, ..)| *least >= LEAST_SHARE) {
            let relative = (own.std / own.value).hypot(other.std / other.value);
            return Some((other.value / own.value, relative));
        }
        let (own, own_std) = self.constant?;
        let tapped = done
            .iter()
            .find(|one| one.constant.is_some() && one.tap.is_some() && one.tap == self.tap)?;
        let (other, other_std) = tapped.constant?;
        let relative = (own_std / own)
            .hypot(other_std / other)
            .hypot(tapped.relative);
        let factor = tapped.factor * own / other;
        factor.is_finite().then_some((factor, relative))
    }
}

/// Makes the largest displacement 1.
fn make_largest_one(whole: &mut BTreeMap<usize, PointDisplacement>) {
    let largest = whole
        .values()
        .max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
    let largest = largest.map(|largest| (largest.value, largest.std));
    let Some((value, std)) = largest.filter(|(value, _)| *value != 0.0) else {
        return;
    };
    for own in whole.values_mut() {
        let is_largest = own.value == value;
        own.value /= value;
        own.std = match is_largest {
            true => 0.0,
            false => (own.std / value).hypot(own.value * std / value),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(recording: &str, values: &[(usize, f64)], constant: Option<f64>) -> Part {
        let values = values.iter().map(|&(point, value)| {
            let own = PointDisplacement {
                value,
                std: 0.01,
                sensor: "A".to_owned(),
                recording: recording.to_owned(),
            };
            (point, own)
        });
        Part {
            values: values.collect(),
            constant: constant.map(|constant| (constant, 0.01)),
            tap: Some(9),
            recording: recording.to_owned(),
        }
    }

    fn values(parts: Vec<Part>) -> (Vec<f64>, Vec<String>) {
        let (whole, apart) = joined(parts);
        (whole.values().map(|own| own.value).collect(), apart)
    }

    #[test]
    fn prop_parts_of_a_shape_join_by_a_common_place_or_tap() {
        // The shape is 0.25, -0.5, 1 at the points 1, 2, 3.
        let first = || part("a", &[(1, -0.5), (2, 1.0)], Some(-2.0));
        let by_place = part("b", &[(2, -0.5), (3, 1.0)], None);
        let whole = [0.25, -0.5, 1.0];
        assert_eq!(values(vec![first(), by_place]), (whole.to_vec(), vec![]));
        // Displacements at the points 2 and 3 are as -2 to 4.
        let by_tap = part("b", &[(3, 1.0)], Some(4.0));
        assert_eq!(values(vec![first(), by_tap]), (whole.to_vec(), vec![]));
        let elsewhere = Part {
            tap: Some(8),
            ..part("b", &[(3, 1.0)], Some(4.0))
        };
        let alone = (vec![-0.5, 1.0], vec!["b".to_owned()]);
        assert_eq!(values(vec![first(), elsewhere]), alone);
        // At a node of the mode the ratio is noise.
        let at_node = part("b", &[(2, 0.01), (3, 1.0)], None);
        assert_eq!(values(vec![first(), at_node]), alone);
        assert_eq!(values(vec![]), (vec![], vec![]));
        // A part joins by one that comes after it.
        let bridge = part("c", &[(2, -0.5), (3, 1.0)], None);
        let beyond = part("b", &[(3, 1.0), (4, 0.4)], None);
        let (found, apart) = values(vec![first(), beyond, bridge]);
        assert_eq!((found.len(), apart.len()), (4, 0));
        // The uncertainty of the common place is that of all that joins by it.
        let far = part("b", &[(2, 0.5), (3, 0.1)], None);
        let whole = joined(vec![first(), far]).0;
        let stds = whole.values().map(|own| own.std).collect::<Vec<_>>();
        let relative = (0.01_f64.hypot(0.02) * 0.2).hypot(0.02);
        assert!(
            (stds[2] - relative.hypot(0.2 * 0.01)).abs() < 1e-12,
            "{stds:?}"
        );
        assert_eq!(stds[1], 0.0);
    }
}
