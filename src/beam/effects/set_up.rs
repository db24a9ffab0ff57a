//! The set-up of a test as it really was, where effects say that it is not as described.
//!
//! ```text
//! described places of each recording, effects -> true places, and the signal that each sensor's channel carries
//! ```
//!
//! Sensors and recordings are numbered from 1, as in the description. An offset adds to the place; it acts in all recordings
//! with the same described place. Polarity and scale belong to a sensor and its cable: they follow it into another channel.

use super::{Effect, EffectId, Group};

/// Places of sensors and hammer in one recording, as described.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedSetUp {
    /// Length of the beam (m).
    pub length: f64,
    /// Position of each sensor (m).
    pub sensors: Vec<f64>,
    /// Position of the taps (m).
    pub tap: f64,
}

/// Places and signals of one recording as they really were.
#[derive(Debug, Clone, PartialEq)]
pub struct ActualSetUp {
    /// Position of each sensor (m).
    pub sensors: Vec<f64>,
    /// Position of the taps (m).
    pub tap: f64,
    /// The content of each sensor's channel.
    pub channels: Vec<SensorSignal>,
}

/// The content of a sensor's channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorSignal {
    /// Index of the sensor that it comes from.
    pub sensor: usize,
    /// Factor on the true signal of that sensor (1); negative where the sensor points the other way.
    pub factor: f64,
}

impl SensorSignal {
    /// Returns what the channel shows of the true signals of all sensors.
    pub fn of(&self, signals: &[f64]) -> f64 {
        self.factor * signals[self.sensor]
    }
}

/// Reason for which a test cannot have an error of its set-up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SetUpError {
    /// A number that counts things has a fraction.
    #[error("`{effect}`: {name} is {value}, but must be a whole number")]
    NotWhole {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// There is no sensor or recording of that number.
    #[error(
        "`{effect}`: {name} is {value}, but the test has {count} {}; give a whole number from {lowest} to {count}",
        plural(.things, *.count)
    )]
    NoSuch {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
        /// The number given.
        value: f64,
        /// "sensor" or "recording".
        things: &'static str,
        /// Number of these.
        count: usize,
        /// Lowest number that is allowed.
        lowest: f64,
    },
    /// There is no other sensor.
    #[error(
        "`{effect}` needs two sensors, and the test has {count}; add a [[sensor]], or leave the effect out"
    )]
    TooFewSensors {
        /// The effect.
        effect: &'static str,
        /// Number of sensors.
        count: usize,
    },
    /// A sensor cannot be interchanged with itself.
    #[error(
        "`{effect}`: sensor and other are both {sensor}; give two different whole numbers from 1 to {count}"
    )]
    SameSensor {
        /// The effect.
        effect: &'static str,
        /// The number given.
        sensor: f64,
        /// Number of sensors.
        count: usize,
    },
    /// A place would not be on the beam.
    #[error(
        "`{effect}`: offset is {offset} m, which moves {thing} from {place} m to {} m in recording {recording}; \
         the beam reaches from 0 to {length} m; give an offset from {} to {} m",
        rounded(.place + .offset), rounded(.allowed[0]), rounded(.allowed[1])
    )]
    OffTheBeam {
        /// The effect.
        effect: &'static str,
        /// "sensor 2" or "the taps".
        thing: String,
        /// The offset given (m).
        offset: f64,
        /// Place before the offset (m).
        place: f64,
        /// Length of the beam (m).
        length: f64,
        /// Number of the recording.
        recording: usize,
        /// Lowest and highest offset that stay on the beam (m).
        allowed: [f64; 2],
    },
}

fn plural(thing: &str, count: usize) -> String {
    format!("{thing}{}", if count == 1 { "" } else { "s" })
}

/// A place so little off an end of the beam is at the end (m): numbers in messages have so many digits.
const ROUNDING: f64 = 1e-6;

fn rounded(value: f64) -> f64 {
    // Adding 0 turns -0 into 0.
    (value * 1e6).round() / 1e6 + 0.0
}

/// Returns the set-up of each recording as it really is. Numbers of sensors or recordings that do not exist are without
/// effect, and places stay on the beam; [`check_set_up`] refuses both.
pub fn actual_set_ups(effects: &[Effect], described: &[DescribedSetUp]) -> Vec<ActualSetUp> {
    let mut actual: Vec<ActualSetUp> = described.iter().map(ActualSetUp::as_described).collect();
    for effect in effects {
        move_places(effect, described, &mut actual);
        for set_up in &mut actual {
            set_up.connect(effect);
        }
    }
    for (actual, described) in actual.iter_mut().zip(described) {
        let places = actual.sensors.iter_mut().chain([&mut actual.tap]);
        places.for_each(|place| *place = place.clamp(0.0, described.length));
    }
    actual
}

/// Checks that a test with these recordings can have the errors of the set-up that are among the effects.
///
/// # Errors
/// [`SetUpError`]: a number is not whole, there is nothing of that number, a sensor is to be interchanged with itself, or
/// a place lies off the beam.
pub fn check_set_up(effects: &[Effect], described: &[DescribedSetUp]) -> Result<(), SetUpError> {
    let mut actual: Vec<ActualSetUp> = described.iter().map(ActualSetUp::as_described).collect();
    let of_set_up = effects
        .iter()
        .filter(|effect| effect.id.group() == Group::SetUp);
    for effect in of_set_up {
        check_numbers(effect, described)?;
        move_places(effect, described, &mut actual);
        check_places(effect, described, &actual)?;
    }
    Ok(())
}

impl ActualSetUp {
    fn as_described(described: &DescribedSetUp) -> Self {
        let sensors = 0..described.sensors.len();
        Self {
            sensors: described.sensors.clone(),
            tap: described.tap,
            channels: sensors
                .map(|sensor| SensorSignal {
                    sensor,
                    factor: 1.0,
                })
                .collect(),
        }
    }

    /// The place that an effect moves.
    fn moved_by(&mut self, effect: &Effect) -> Option<&mut f64> {
        match effect.id {
            EffectId::SensorPosition => {
                let sensor = index_of(effect, "sensor", self.sensors.len())?;
                Some(&mut self.sensors[sensor])
            }
            EffectId::TapPosition => Some(&mut self.tap),
            _ => None,
        }
    }

    /// Changes the content of the channels.
    fn connect(&mut self, effect: &Effect) {
        let sensor = index_of(effect, "sensor", self.channels.len());
        let factor = match effect.id {
            EffectId::SensorPolarity => -1.0,
            EffectId::SensorScale => 1.0 + effect.value("relative").unwrap_or(0.0),
            EffectId::SensorSwap => {
                let other = index_of(effect, "other", self.channels.len());
                if let Some((sensor, other)) = sensor.zip(other) {
                    self.channels.swap(sensor, other);
                }
                return;
            }
            _ => return,
        };
        // Sensor 0 stands for all.
        let is_all = effect.value("sensor") == Some(0.0);
        let own = self.channels.iter_mut();
        for channel in own.filter(|channel| is_all || Some(channel.sensor) == sensor) {
            channel.factor *= factor;
        }
    }
}

/// Index of the sensor or recording that a parameter numbers; `None` where there is none of that number.
fn index_of(effect: &Effect, name: &str, count: usize) -> Option<usize> {
    let value = effect.value(name)?;
    (0..count).find(|index| (index + 1) as f64 == value)
}

/// Indices of the recordings in which an offset acts: those with the same described place as the one that is named.
fn recordings_of(effect: &Effect, described: &[DescribedSetUp]) -> Vec<usize> {
    let all = 0..described.len();
    if effect.value("recording") == Some(0.0) {
        return all.collect();
    }
    let Some(named) = index_of(effect, "recording", described.len()) else {
        return Vec::new();
    };
    let place = |index: usize| {
        ActualSetUp::as_described(&described[index])
            .moved_by(effect)
            .copied()
    };
    all.filter(|index| place(*index) == place(named)).collect()
}

/// Adds the offset of an effect to the place that it moves.
fn move_places(effect: &Effect, described: &[DescribedSetUp], actual: &mut [ActualSetUp]) {
    for recording in recordings_of(effect, described) {
        if let Some(place) = actual[recording].moved_by(effect) {
            *place += effect.value("offset").unwrap_or(0.0);
        }
    }
}

fn check_numbers(effect: &Effect, described: &[DescribedSetUp]) -> Result<(), SetUpError> {
    let sensors = described.first().map_or(0, |first| first.sensors.len());
    let id = effect.id.name();
    if effect.id == EffectId::SensorSwap && sensors < 2 {
        return Err(SetUpError::TooFewSensors {
            effect: id,
            count: sensors,
        });
    }
    for (info, value) in effect.values() {
        let (things, count) = match info.name {
            "sensor" | "other" => ("sensor", sensors),
            "recording" => ("recording", described.len()),
            _ => continue,
        };
        if value.fract() != 0.0 {
            let name = info.name;
            return Err(SetUpError::NotWhole {
                effect: id,
                name,
                value,
            });
        }
        if value > count as f64 {
            return Err(SetUpError::NoSuch {
                effect: id,
                name: info.name,
                value,
                things,
                count,
                lowest: info.lowest,
            });
        }
    }
    match (effect.value("sensor"), effect.value("other")) {
        (Some(sensor), Some(other)) if sensor == other => Err(SetUpError::SameSensor {
            effect: id,
            sensor,
            count: sensors,
        }),
        _ => Ok(()),
    }
}

/// Refuses a place off the beam. `actual` has the places with the offset.
fn check_places(
    effect: &Effect,
    described: &[DescribedSetUp],
    actual: &[ActualSetUp],
) -> Result<(), SetUpError> {
    let offset = effect.value("offset").unwrap_or(0.0);
    let mut allowed = [f64::NEG_INFINITY, f64::INFINITY];
    let mut off = None;
    for recording in recordings_of(effect, described) {
        let length = described[recording].length;
        let Some(moved) = actual[recording].clone().moved_by(effect).copied() else {
            continue;
        };
        let place = moved - offset;
        allowed = [allowed[0].max(-place), allowed[1].min(length - place)];
        if off.is_none() && !(-ROUNDING..=length + ROUNDING).contains(&moved) {
            off = Some((recording, place, length));
        }
    }
    let Some((recording, place, length)) = off else {
        return Ok(());
    };
    Err(SetUpError::OffTheBeam {
        effect: effect.id.name(),
        thing: match effect.value("sensor") {
            Some(sensor) => format!("sensor {sensor}"),
            None => "the taps".to_owned(),
        },
        offset,
        place,
        length,
        recording: recording + 1,
        allowed,
    })
}
