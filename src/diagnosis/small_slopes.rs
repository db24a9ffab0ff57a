//! What the small unknowns do to each reading.

use super::fastened::fastened_slope;
use super::forward::Forward;
use super::frame::Row;
use super::joint_energy::joint_shares;
use super::small_unknowns::Small;
use super::solved::Solved;
use nalgebra::DMatrix;
use std::f64::consts::TAU;
use tapjoint_beam::effects::{EffectId, SensorPlace};

impl Forward<'_> {
    /// Adds the small unknowns to the predictions, and their columns to the slopes.
    pub(super) fn add_smalls(
        &self,
        solved: &[Solved],
        mut predicted: Vec<f64>,
        (parameters, slopes): (&[f64], &mut DMatrix<f64>),
    ) -> Vec<f64> {
        let first = self.layout.smalls();
        for (row, kind) in self.rows.iter().enumerate() {
            for (k, small) in self.frame.smalls.iter().enumerate() {
                if *small != Small::Amplitude {
                    let slope = self.small_slope(kind, small, (solved, predicted[row]), parameters);
                    slopes[(row, first + k)] = slope;
                }
            }
        }
        for (k, small) in self.frame.smalls.iter().enumerate() {
            // These enter the solution itself.
            if matches!(
                small,
                Small::Damping | Small::DampingTilt | Small::Amplitude
            ) {
                continue;
            }
            let value = parameters[first + k];
            for (row, predicted) in predicted.iter_mut().enumerate() {
                *predicted += value * slopes[(row, first + k)];
            }
        }
        predicted
    }

    /// Slopes with respect to the effective amplitude, by finite differences.
    pub(super) fn amplitude_slopes(
        &self,
        parameters: &[f64],
        (solved, base): (&[Solved], &[f64]),
        slopes: &mut DMatrix<f64>,
    ) {
        const STEP: f64 = 1e-2;
        let Some(k) = self.frame.small_index(Small::Amplitude) else {
            return;
        };
        let column = self.layout.smalls() + k;
        let mut moved = parameters.to_vec();
        moved[column] += STEP;
        let solved = self.solve_near(&moved, solved);
        if let Some(new) = solved.and_then(|solved| self.rows_of(&solved, &moved)) {
            for (row, (new, old)) in new.iter().zip(base).enumerate() {
                slopes[(row, column)] = (new - old) / STEP;
            }
        }
    }

    /// Derivative of a row with respect to a small unknown.
    fn small_slope(
        &self,
        row: &Row,
        small: &Small,
        (solved, predicted): (&[Solved], f64),
        parameters: &[f64],
    ) -> f64 {
        match *row {
            Row::Frequency {
                configuration,
                mode,
            } => {
                let one = &solved[configuration];
                self.frequency_slope(small, (configuration, mode), (one, parameters))
            }
            Row::Constant {
                configuration,
                mode,
                sensor,
            } => self.constant_slope(
                small,
                (configuration, mode, sensor),
                (&solved[configuration], predicted),
            ),
            Row::Ratio {
                configuration,
                mode,
                sensor,
                reference,
            } => {
                let one = &solved[configuration];
                let towards = self.ratio_slope(small, (configuration, mode, sensor), one);
                let away = self.ratio_slope(small, (configuration, mode, reference), one);
                predicted * (towards - away)
            }
            Row::Damping { mode } if matches!(small, Small::Damping | Small::DampingTilt) => {
                let (all, nominal) = self.damping(mode, solved, parameters).unwrap_or((1.0, 1.0));
                match small {
                    Small::DampingTilt => nominal / all * self.frame.tilt(mode),
                    _ => nominal / all,
                }
            }
            Row::Damping { .. } | Row::Slope { .. } => 0.0,
        }
    }

    fn frequency_slope(
        &self,
        small: &Small,
        (configuration, mode): (usize, usize),
        (one, parameters): (&Solved, &[f64]),
    ) -> f64 {
        let setup = &self.frame.setups[configuration];
        let Some(index) = one.index(mode) else {
            return 0.0;
        };
        let displacement = |x: f64| one.modes().displacement(index, x);
        let slope = |x: f64| one.modes().slope(index, x);
        // The sum over the sensors with this name or place.
        let over = |keys: &[usize], wanted: usize, part: &dyn Fn(&SensorPlace) -> f64| -> f64 {
            let own = keys.iter().zip(&setup.sensors);
            own.filter(|(key, _)| **key == wanted)
                .map(|(_, sensor)| part(sensor))
                .sum()
        };
        match *small {
            Small::Scale => 1.0,
            Small::Shear => self.frame.shear_slope(mode),
            Small::Temperature { visit } if visit == setup.visit => 1.0,
            Small::Discrepancy { mode: own } if own == mode => 1.0,
            Small::Scatter { configuration: own } if own == configuration => {
                self.frame.scatter_of(configuration, mode)
            }
            Small::Drift { visit, direction } if visit == setup.visit => {
                0.5 * joint_shares(one, index)[direction]
            }
            // d ln f/d m = -phi^2/2 for a mass-normalised shape.
            Small::SensorMass { name } => over(&setup.names, name, &|sensor| {
                -0.5 * sensor.mass * displacement(sensor.position).powi(2)
            }),
            // d ln f/d J = -(phi')^2/2.
            Small::SensorInertia { name } => over(&setup.names, name, &|sensor| {
                let inertia = self.mass_at(sensor, parameters) * self.frame.sensor_radius.powi(2);
                -0.5 * inertia * slope(sensor.position).powi(2)
            }),
            Small::AddedInertia => {
                let added = self.added_masses(parameters);
                let inertia = |mass: f64| mass * self.frame.sensor_radius.powi(2);
                added
                    .map(|(mass, x)| -0.5 * inertia(mass) * slope(x).powi(2))
                    .sum()
            }
            // d ln f = (k/omega^2 - m) phi phi' dx, of what sits there and of what holds it there.
            Small::SensorPlace { place } => over(&setup.places, place, &|sensor| {
                let omega = TAU * one.modes().frequencies()[index];
                let held = self.size_of(EffectId::SensorCable, parameters) / (omega * omega);
                let moved = displacement(sensor.position) * slope(sensor.position);
                (held - self.mass_at(sensor, parameters)) * moved
            }),
            _ => fastened_slope(small, setup, (one, index)),
        }
    }

    /// Size of an effect under the hypothesis, all of its kind together; 0 without it.
    fn size_of(&self, wanted: EffectId, parameters: &[f64]) -> f64 {
        let effects = self.layout.effects.iter().enumerate();
        let own = effects.filter(|(_, one)| one.effect == wanted);
        own.map(|(k, _)| parameters[self.layout.size(k)]).sum()
    }

    /// Mass of a sensor (kg): the stated one, and of one that weighs nobody knows what that of the hypothesis.
    fn mass_at(&self, sensor: &SensorPlace, parameters: &[f64]) -> f64 {
        match sensor.mass {
            0.0 => self.size_of(EffectId::SensorMass, parameters),
            stated => stated,
        }
    }

    /// Masses that the hypothesis adds (kg), and where (m).
    fn added_masses<'b>(&'b self, parameters: &'b [f64]) -> impl Iterator<Item = (f64, f64)> + 'b {
        let layout = &self.layout;
        let effects = layout.effects.iter().enumerate();
        let own = effects.filter(|(_, one)| one.effect == EffectId::AddedMass);
        own.filter_map(move |(k, one)| {
            let place = one.place?.outward(parameters[layout.place(k)?]);
            Some((parameters[layout.size(k)], place))
        })
    }

    fn constant_slope(
        &self,
        small: &Small,
        (configuration, mode, sensor): (usize, usize, usize),
        (one, predicted): (&Solved, f64),
    ) -> f64 {
        let setup = &self.frame.setups[configuration];
        let (Some(index), Some(tap)) = (one.index(mode), setup.tap) else {
            return 0.0;
        };
        let x = setup.sensors[sensor].position;
        match *small {
            Small::Gain { visit, name } if setup.visit == visit && setup.names[sensor] == name => {
                predicted
            }
            Small::SensorPlace { place } if setup.places[sensor] == place => {
                one.modes().slope(index, x) * one.modes().displacement(index, tap)
            }
            Small::TapPlace { visit } if setup.visit == visit => {
                one.modes().displacement(index, x) * one.modes().slope(index, tap)
            }
            _ => 0.0,
        }
    }

    /// Relative derivative of the displacement at one sensor.
    fn ratio_slope(
        &self,
        small: &Small,
        (configuration, mode, sensor): (usize, usize, usize),
        one: &Solved,
    ) -> f64 {
        let setup = &self.frame.setups[configuration];
        let Some(index) = one.index(mode) else {
            return 0.0;
        };
        match *small {
            Small::Gain { visit, name } if setup.visit == visit && setup.names[sensor] == name => {
                1.0
            }
            Small::SensorPlace { place } if setup.places[sensor] == place => {
                let x = setup.sensors[sensor].position;
                one.modes().slope(index, x) / one.modes().displacement(index, x)
            }
            _ => 0.0,
        }
    }
}
