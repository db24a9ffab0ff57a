//! The set-up as it is under a hypothesis: where sensors and hammer are, and what the channels show.

use crate::parameters::{Layout, Target};
use crate::structure::Arrangement;
use tapjoint_beam::effects::EffectId;
use tapjoint_beam::specimen::{PointMass, Specimen};

/// Sensors and hammer of one configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct SetUp {
    /// What each channel shows, in the order of the sensors.
    pub channels: Vec<Channel>,
    /// Position of the taps (m).
    pub tap: Option<f64>,
}

/// What a channel shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Index of the sensor whose signal it is.
    pub sensor: usize,
    /// Position of that sensor (m).
    pub position: f64,
    /// Signal over what the description makes of it (1).
    pub factor: f64,
}

impl SetUp {
    /// Returns the set-up of a configuration with the errors that the parameters give it.
    pub fn new(arrangement: &Arrangement, layout: &Layout, parameters: &[f64]) -> Self {
        let sensors = arrangement.sensors.iter().enumerate();
        let channels = sensors.map(|(sensor, placed)| Channel {
            sensor,
            position: placed.position,
            factor: 1.0,
        });
        let mut set_up = SetUp {
            channels: channels.collect(),
            tap: arrangement.tap,
        };
        for (k, one) in layout.effects.iter().enumerate() {
            set_up.add(
                one.effect,
                one.target,
                parameters[layout.size(k)],
                arrangement,
            );
        }
        set_up
    }

    fn add(&mut self, effect: EffectId, target: Target, size: f64, arrangement: &Arrangement) {
        match (effect, target) {
            (EffectId::SensorPosition, Target::Place { position }) => {
                for channel in &mut self.channels {
                    if arrangement.positions[channel.sensor] == position {
                        channel.position += size;
                    }
                }
            }
            (EffectId::TapPosition, Target::Taps { tap }) => {
                if arrangement.tap_index == Some(tap) {
                    self.tap = self.tap.map(|x| x + size);
                }
            }
            (EffectId::SensorPolarity, Target::Sensor { name }) => {
                self.multiply(Some(name), -1.0, arrangement);
            }
            (EffectId::SensorScale, Target::Sensor { name }) => {
                self.multiply(Some(name), 1.0 + size, arrangement);
            }
            (EffectId::SensorScale, Target::All) => self.multiply(None, 1.0 + size, arrangement),
            (EffectId::SensorSwap, Target::Pair { names }) => {
                let [first, second] =
                    names.map(|name| arrangement.names.iter().position(|own| *own == name));
                if let (Some(first), Some(second)) = (first, second) {
                    self.channels.swap(first, second);
                }
            }
            _ => {}
        }
    }

    /// Multiplies the channels of the sensor with this name, or all.
    fn multiply(&mut self, name: Option<usize>, factor: f64, arrangement: &Arrangement) {
        for (channel, own) in self.channels.iter_mut().zip(&arrangement.names) {
            if name.is_none_or(|name| *own == name) {
                channel.factor *= factor;
            }
        }
    }
}

/// Returns the structure of a configuration, and the sensors that sit on it, with the sensors where the parameters have
/// them.
pub fn loaded(
    arrangement: &Arrangement,
    layout: &Layout,
    parameters: &[f64],
) -> (Specimen, Vec<PointMass>) {
    let (mut specimen, mut carried) = (arrangement.specimen.clone(), arrangement.carried.clone());
    for (k, one) in layout.effects.iter().enumerate() {
        let (EffectId::SensorPosition, Target::Place { position }) = (one.effect, one.target)
        else {
            continue;
        };
        let sensors = arrangement.sensors.iter().zip(&arrangement.positions);
        for (sensor, _) in sensors.filter(|(_, own)| **own == position) {
            let moved = sensor.position + parameters[layout.size(k)];
            for list in [&mut specimen.masses, &mut carried] {
                if let Some(own) = list.iter_mut().find(|one| *one == sensor) {
                    own.position = moved;
                }
            }
        }
    }
    (specimen, carried)
}
