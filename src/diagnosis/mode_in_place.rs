//! A mode where sensors, masses and hammer meet it: what they show of it, and how nuisance parameters move that.

use crate::dataset::{Dataset, Observable, ObservableKind};
use crate::description::{BeamShares, SectionSlopes};
use crate::modal_model::ModalModel;
use crate::parameters::{Layout, NuisanceParameter};
use crate::structure::Arrangement;
use std::cell::OnceCell;
use tapjoint_beam::effects::{EffectId, SensorSignal};
use tapjoint_beam::specimen::PointMass;
use tapjoint_identify::consistent::Parameter;

/// Mode of an observable, with the sensors and masses that it moves.
pub struct ModeInPlace<'a> {
    dataset: &'a Dataset,
    layout: &'a Layout,
    observable: Observable,
    arrangement: &'a Arrangement,
    model: &'a ModalModel,
    index: usize,
    shares: OnceCell<BeamShares>,
}

impl<'a> ModeInPlace<'a> {
    /// Returns the mode; `None` where the structure does not have it.
    pub fn new(
        dataset: &'a Dataset,
        layout: &'a Layout,
        observable: &Observable,
        models: &'a [ModalModel],
    ) -> Option<Self> {
        let model = &models[observable.configuration];
        Some(ModeInPlace {
            dataset,
            layout,
            observable: *observable,
            arrangement: &dataset.arrangements[observable.configuration],
            model,
            index: model.index(observable.mode)?,
            shares: OnceCell::new(),
        })
    }

    /// What the channel of a sensor shows.
    fn channel(&self, sensor: usize) -> SensorSignal {
        self.model.set_up.channels[sensor]
    }

    pub fn at_sensor(&self, sensor: usize) -> f64 {
        let channel = self.channel(sensor);
        channel.factor * self.on_line(self.place(channel))
    }

    /// Where the sensor sits whose signal a channel shows (m).
    fn place(&self, channel: SensorSignal) -> f64 {
        self.model.set_up.sensors[channel.sensor].position
    }

    /// Displacement on the middle line, where sensors sit and the hammer strikes.
    pub fn on_line(&self, position: f64) -> f64 {
        self.model.motion(self.index, position).middle
    }

    fn displacement(&self, position: f64) -> f64 {
        self.model.motion(self.index, position).displacement
    }

    fn slope(&self, position: f64) -> f64 {
        self.model.motion(self.index, position).slope
    }

    /// Sensors with this index among the indices `keys`: with their stated masses, where they are.
    fn sensors(&self, keys: &'a [usize], wanted: usize) -> impl Iterator<Item = PointMass> {
        let pairs = self
            .arrangement
            .sensors
            .iter()
            .zip(&self.model.set_up.sensors);
        let own = keys.iter().zip(pairs);
        own.filter(move |(key, _)| **key == wanted)
            .map(|(_, (stated, sensor))| PointMass::new(sensor.position, stated.mass))
    }

    /// Returns d ln f with respect to a nuisance parameter.
    pub fn frequency_slope(&self, nuisance: NuisanceParameter, parameters: &[f64]) -> f64 {
        let (dataset, arrangement) = (self.dataset, self.arrangement);
        let mode = self.observable.mode;
        match nuisance {
            NuisanceParameter::Property { property } => {
                let shear = SectionSlopes::of(&dataset.section.shear, mode);
                let shares = self
                    .shares
                    .get_or_init(|| self.model.beam_shares(self.index));
                shares.property_slope(property, shear)
            }
            NuisanceParameter::Shear => SectionSlopes::of(&dataset.section.shear, mode),
            NuisanceParameter::Poisson => SectionSlopes::of(&dataset.section.poisson, mode),
            NuisanceParameter::WidthHold => SectionSlopes::of(&dataset.section.hold, mode),
            NuisanceParameter::Temperature { setup } if setup == arrangement.setup => 1.0,
            NuisanceParameter::Discrepancy { mode: own } if own == mode => 1.0,
            NuisanceParameter::CommonFactor => 1.0,
            NuisanceParameter::Scatter { configuration }
                if configuration == self.observable.configuration =>
            {
                dataset.scatter_of(configuration, mode)
            }
            NuisanceParameter::Drift { setup, direction } if setup == arrangement.setup => {
                0.5 * self.model.joint_shares(self.index)[direction]
            }
            // d ln f/d m = -phi^2/2 for a mass-normalised shape.
            NuisanceParameter::SensorMass { name } => self
                .sensors(&arrangement.names, name)
                .map(|sensor| -0.5 * sensor.mass * self.displacement(sensor.position).powi(2))
                .sum(),
            // d ln f/d J = -(phi')^2/2.
            NuisanceParameter::SensorInertia { name } => self
                .sensors(&arrangement.names, name)
                .map(|sensor| {
                    let mass = self.mass_at(&sensor, parameters);
                    self.inertia_slope(mass, sensor.position)
                })
                .sum(),
            NuisanceParameter::AddedInertia => {
                let effects = self.layout.effects.iter().enumerate();
                let masses = effects.filter(|(_, one)| one.is(EffectId::AddedMass));
                masses
                    .filter_map(|(k, one)| {
                        let mass = parameters[self.layout.size(k)];
                        let location = parameters[self.layout.location(k)?];
                        Some(self.inertia_slope(mass, one.location?.value_at(location)))
                    })
                    .sum()
            }
            // d ln f = (k/omega^2 - m) phi phi' dx, of the mass there and of the spring that holds it.
            NuisanceParameter::SensorPosition { position } => self
                .sensors(&arrangement.positions, position)
                .map(|sensor| {
                    let omega = self.model.omega(self.index);
                    let spring = self.layout.size_of(EffectId::SensorCable, parameters);
                    let held = spring / (omega * omega);
                    let moved = self.displacement(sensor.position) * self.slope(sensor.position);
                    (held - self.mass_at(&sensor, parameters)) * moved
                })
                .sum(),
            // d ln f/d m = -phi^2/2, and d ln f/d x = -m phi phi'.
            NuisanceParameter::FastenedMass { fastened } => self
                .fastened(fastened)
                .map(|(mass, position)| -0.5 * mass * self.displacement(position).powi(2))
                .sum(),
            NuisanceParameter::FastenedPosition { fastened } => self
                .fastened(fastened)
                .map(|(mass, x)| -mass * self.displacement(x) * self.slope(x))
                .sum(),
            _ => 0.0,
        }
    }

    /// Returns the mass of a sensor (kg): the stated one, or that of the hypothesis if none is stated.
    fn mass_at(&self, sensor: &PointMass, parameters: &[f64]) -> f64 {
        match sensor.mass {
            0.0 => self.layout.size_of(EffectId::SensorMass, parameters),
            stated => stated,
        }
    }

    /// Returns d ln f with respect to the rotary inertia of a mass (kg) over its usual one.
    fn inertia_slope(&self, mass: f64, position: f64) -> f64 {
        let inertia = mass * self.dataset.settings.sensor_radius.powi(2);
        -0.5 * inertia * self.slope(position).powi(2)
    }

    /// Added masses (kg) with this index as stated, and where they are (m).
    fn fastened(&self, wanted: usize) -> impl Iterator<Item = (f64, f64)> + 'a {
        let own = self
            .arrangement
            .fastened
            .iter()
            .zip(&self.model.set_up.fastened);
        let own = own.filter(move |((own, _), _)| *own == wanted);
        own.map(|((_, stated), mass)| (stated.mass, mass.position))
    }

    /// Returns the derivative of a modal constant or ratio with respect to ln of a property of the beam. `by_joint`
    /// has the derivatives with respect to ln of the joint's stiffnesses. A shape of unit modal mass is m^-1/2 psi(x/L), where psi
    /// depends on Kt L^3/E I and Kr L/E I alone, but for what is fastened to the beam.
    pub fn shape_slope(&self, property: Parameter, predicted: f64, by_joint: [f64; 2]) -> f64 {
        let [translation, rotation] = by_joint;
        let by_bending = -(translation + rotation);
        let (by_mass, along) = match self.observable.kind {
            ObservableKind::Constant { sensor } => {
                let tap = self.model.set_up.tap;
                let at_tap = tap.map_or(0.0, |tap| self.stretched_at(tap));
                (-predicted, self.stretched(sensor) + at_tap)
            }
            ObservableKind::Ratio { sensor, reference } => {
                (0.0, self.stretched(sensor) - self.stretched(reference))
            }
            _ => (0.0, 0.0),
        };
        match property {
            Parameter::Modulus => by_bending,
            Parameter::Density => by_mass,
            Parameter::Thickness => 3.0 * by_bending + by_mass,
            Parameter::Width => by_bending + by_mass,
            Parameter::Length => 3.0 * translation + rotation + by_mass - predicted * along,
            _ => 0.0,
        }
    }

    /// Returns x phi'/phi at a sensor.
    fn stretched(&self, sensor: usize) -> f64 {
        self.stretched_at(self.place(self.channel(sensor)))
    }

    /// Returns x phi'/phi at a position; 0 at a rigid clamp, where nothing moves.
    fn stretched_at(&self, x: f64) -> f64 {
        let ratio = x * self.slope(x) / self.on_line(x);
        if ratio.is_finite() { ratio } else { 0.0 }
    }

    /// Returns the derivative of the modal constant at a sensor with respect to a nuisance parameter.
    pub fn constant_slope(
        &self,
        sensor: usize,
        nuisance: NuisanceParameter,
        predicted: f64,
    ) -> f64 {
        let arrangement = self.arrangement;
        let Some(tap) = self.model.set_up.tap else {
            return 0.0;
        };
        let channel = self.channel(sensor);
        let x = self.place(channel);
        match nuisance {
            NuisanceParameter::Gain { setup, name } if self.is_gain(sensor, setup, name) => {
                predicted
            }
            NuisanceParameter::SensorPosition { position }
                if arrangement.positions[channel.sensor] == position =>
            {
                channel.factor * self.slope(x) * self.on_line(tap)
            }
            NuisanceParameter::TapPosition { setup } if arrangement.setup == setup => {
                channel.factor * self.on_line(x) * self.slope(tap)
            }
            _ => 0.0,
        }
    }

    /// Returns the relative derivative of the displacement at a sensor with respect to a nuisance parameter.
    pub fn relative_slope(&self, sensor: usize, nuisance: NuisanceParameter) -> f64 {
        match nuisance {
            NuisanceParameter::Gain { setup, name } if self.is_gain(sensor, setup, name) => 1.0,
            NuisanceParameter::SensorPosition { position }
                if self.arrangement.positions[self.channel(sensor).sensor] == position =>
            {
                let x = self.place(self.channel(sensor));
                self.slope(x) / self.on_line(x)
            }
            _ => 0.0,
        }
    }

    /// Returns whether a sensor of this configuration has this gain.
    fn is_gain(&self, sensor: usize, setup: usize, name: usize) -> bool {
        self.arrangement.setup == setup && self.arrangement.names[sensor] == name
    }
}
