//! The set-up as it is under a hypothesis: where sensors, masses and hammer are, and what the channels show.
//!
//! Errors of the set-up and the tolerances of the description enter the solved structure. Slopes would not do: a mass
//! a few millimetres off moves high modes by more than its slope predicts.

use crate::parameters::{Layout, Nuisance, NuisanceParameter, Target};
use crate::structure::Arrangement;
use tapjoint_beam::effects::{EffectId, SensorSignal};
use tapjoint_beam::specimen::{PointMass, Specimen};

/// Sensors, masses and hammer of one configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct SetUp {
    /// Masses and positions of the sensors.
    pub sensors: Vec<PointMass>,
    /// What each channel shows, in the order of the sensors.
    pub channels: Vec<SensorSignal>,
    /// Known added masses, in the order of the arrangement.
    pub fastened: Vec<PointMass>,
    /// Position of the taps (m).
    pub tap: Option<f64>,
}

impl SetUp {
    /// Returns the set-up of a configuration with the errors that the parameters give it.
    pub fn new(
        arrangement: &Arrangement,
        layout: &Layout,
        nuisances: &[Nuisance],
        parameters: &[f64],
    ) -> Self {
        let sensors = 0..arrangement.sensors.len();
        let fastened = arrangement.fastened.iter().map(|one| one.1);
        let mut set_up = SetUp {
            sensors: arrangement.sensors.clone(),
            channels: sensors
                .map(|sensor| SensorSignal {
                    sensor,
                    factor: 1.0,
                })
                .collect(),
            fastened: fastened.collect(),
            tap: arrangement.tap,
        };
        let values = &parameters[layout.first_nuisance()..];
        for (nuisance, value) in nuisances.iter().zip(values) {
            set_up.tolerate(nuisance.parameter, *value, arrangement);
        }
        for (k, one) in layout.effects.iter().enumerate() {
            let size = parameters[layout.size(k)];
            if let Some(effect) = one.effect() {
                set_up.add(effect, one.target, size, arrangement);
            }
        }
        let length = arrangement.specimen.body.length();
        let masses = set_up.sensors.iter_mut().chain(&mut set_up.fastened);
        let places = masses.map(|one| &mut one.position).chain(&mut set_up.tap);
        for place in places {
            *place = place.clamp(0.0, length);
        }
        set_up
    }

    /// Adds what a tolerance leaves open.
    fn tolerate(&mut self, nuisance: NuisanceParameter, value: f64, arrangement: &Arrangement) {
        match nuisance {
            NuisanceParameter::SensorMass { name } => {
                for (sensor, own) in self.sensors.iter_mut().zip(&arrangement.names) {
                    if *own == name {
                        sensor.mass *= (1.0 + value).max(0.0);
                    }
                }
            }
            NuisanceParameter::SensorPosition { position } => {
                self.move_sensors(position, value, arrangement);
            }
            NuisanceParameter::FastenedMass { fastened } => {
                for (mass, (own, _)) in self.fastened.iter_mut().zip(&arrangement.fastened) {
                    if *own == fastened {
                        mass.mass *= (1.0 + value).max(0.0);
                    }
                }
            }
            NuisanceParameter::FastenedPosition { fastened } => {
                for (mass, (own, _)) in self.fastened.iter_mut().zip(&arrangement.fastened) {
                    if *own == fastened {
                        mass.position += value;
                    }
                }
            }
            NuisanceParameter::TapPosition { setup } if setup == arrangement.setup => {
                self.tap = self.tap.map(|x| x + value);
            }
            _ => {}
        }
    }

    /// Adds an error of the set-up.
    fn add(&mut self, effect: EffectId, target: Target, size: f64, arrangement: &Arrangement) {
        match (effect, target) {
            (EffectId::SensorPosition, Target::Place { position }) => {
                self.move_sensors(position, size, arrangement);
            }
            (EffectId::SensorPosition, Target::Sensor { name }) => {
                for (sensor, own) in self.sensors.iter_mut().zip(&arrangement.names) {
                    if *own == name {
                        sensor.position += size;
                    }
                }
            }
            (EffectId::TapPosition, Target::All) => self.tap = self.tap.map(|x| x + size),
            (EffectId::TapPosition, Target::Taps { tap }) if arrangement.tap_index == Some(tap) => {
                self.tap = self.tap.map(|x| x + size);
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

    /// Moves the sensors with this index of their stated position by a distance (m).
    fn move_sensors(&mut self, position: usize, distance: f64, arrangement: &Arrangement) {
        for (sensor, own) in self.sensors.iter_mut().zip(&arrangement.positions) {
            if *own == position {
                sensor.position += distance;
            }
        }
    }

    /// Multiplies the signal of the sensor with this name, or all.
    fn multiply(&mut self, name: Option<usize>, factor: f64, arrangement: &Arrangement) {
        for channel in &mut self.channels {
            if name.is_none_or(|name| arrangement.names[channel.sensor] == name) {
                channel.factor *= factor;
            }
        }
    }

    /// Returns the structure of a configuration with the sensors and masses where they are.
    pub fn loaded(&self, arrangement: &Arrangement) -> Specimen {
        let mut specimen = arrangement.specimen.clone();
        // They stand behind what sits on the structure for good.
        let heavy = arrangement.sensors.iter().zip(&self.sensors);
        let heavy = heavy.filter(|(stated, _)| stated.mass > 0.0);
        let moved: Vec<PointMass> = heavy
            .map(|(_, sensor)| *sensor)
            .chain(self.fastened.iter().copied())
            .collect();
        let own = specimen.masses.len().saturating_sub(moved.len());
        specimen.masses.truncate(own);
        specimen.masses.extend(moved);
        specimen
    }

    /// Returns the sensors that sit on the structure, where they are.
    pub fn carried(&self, arrangement: &Arrangement) -> Vec<PointMass> {
        let mut carried = arrangement.carried.clone();
        let mut next = carried.iter_mut().peekable();
        for (stated, sensor) in arrangement.sensors.iter().zip(&self.sensors) {
            // In the order of the sensors, without those that do not touch it.
            if let Some(own) = next.next_if(|own| **own == *stated) {
                own.position = sensor.position;
            }
        }
        carried
    }
}
