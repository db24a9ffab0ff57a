//! Small unknowns that every hypothesis shares.

use super::frame::{Frame, Row};
use super::nominal::COUPLING;
use super::settings::GapSettings;
use super::setup::Lists;

/// A small unknown whose influence is linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Small {
    /// Common factor on all frequencies (logarithm).
    Scale,
    /// Shear flexibility and rotary inertia of a Timoshenko beam over the nominal ones (1).
    Shear,
    /// Stiffness of the joint in one visit (logarithm): direction 0 translation, 1 rotation.
    Drift { visit: usize, direction: usize },
    /// Common factor on all frequencies of one visit (logarithm): it was warmer or colder than the others.
    Temperature { visit: usize },
    /// Mass of a sensor over its stated one (1).
    SensorMass { name: usize },
    /// Rotary inertia of a sensor over its mass times the square of [`GapSettings::sensor_radius`] (1).
    SensorInertia { name: usize },
    /// Rotary inertia of a mass that a hypothesis adds over that mass times the square of
    /// [`GapSettings::sensor_radius`] (1).
    AddedInertia,
    /// Place of a sensor (m), the same in all configurations where it has the same stated one.
    SensorPlace { place: usize },
    /// A fastened mass over its stated one (1).
    FastenedMass { fastened: usize },
    /// Place of a fastened mass (m).
    FastenedPlace { fastened: usize },
    /// Where the hammer struck in one visit (m).
    TapPlace { visit: usize },
    /// Calibration of a sensor as it was mounted for one visit (1).
    Gain { visit: usize, name: usize },
    /// Common level of the nominal damping ratios (logarithm).
    Damping,
    /// Power of the frequency by which the nominal damping ratios rise.
    DampingTilt,
    /// Amplitude of the joint over what the sensors' amplitudes and the shapes make of it (logarithm).
    Amplitude,
    /// What the taps of one configuration scatter in common (standard deviations).
    Scatter { configuration: usize },
    /// What no effect explains in one mode, the same in all configurations (logarithm).
    Discrepancy { mode: usize },
}

/// The joint's amplitude over what the sensors' amplitudes and the shapes make of it, and the scatter
/// of its logarithm: the largest rotation under the hammer is not seen, nor all modes that share in it.
pub(super) const AMPLITUDE: (f64, f64) = (1.0, 0.25);

impl Frame {
    pub(super) fn add_smalls(&mut self, lists: &Lists, settings: &GapSettings) {
        let scale = self.nominal.scale_std.unwrap_or(settings.scale_std);
        self.small(Small::Scale, 0.0, scale);
        if self.nominal.specimen.shear_rotary > 0.0 {
            self.small(Small::Shear, 0.0, settings.shear_std);
        }
        let mut visits: Vec<usize> = self.setups.iter().map(|setup| setup.visit).collect();
        visits.sort_unstable();
        visits.dedup();
        self.add_drifts(&visits, settings);
        for configuration in 0..self.setups.len() {
            if !self.setups[configuration].scatter.is_empty() {
                self.small(Small::Scatter { configuration }, 0.0, 1.0);
            }
        }
        for (name, text) in lists.names.iter().enumerate() {
            if self.nominal.mass_of(text) > 0.0 {
                self.small(Small::SensorMass { name }, 0.0, settings.sensor_mass_std);
            }
            self.small(Small::SensorInertia { name }, 0.0, 1.0);
        }
        self.small(Small::AddedInertia, 0.0, 1.0);
        self.add_places_and_gains(lists, &visits, settings);
        self.add_damping_level(settings);
        self.small(Small::Amplitude, AMPLITUDE.0.ln(), AMPLITUDE.1);
    }

    /// What differs between visits: the joint's stiffness and the temperature.
    fn add_drifts(&mut self, visits: &[usize], settings: &GapSettings) {
        if visits.len() > 1 {
            for &visit in visits {
                let sought = self.nominal.sought();
                for (direction, _) in sought.into_iter().filter(|one| one.0 != COUPLING) {
                    self.small(
                        Small::Drift { visit, direction },
                        0.0,
                        settings.drift_stds[0],
                    );
                }
                self.small(Small::Temperature { visit }, 0.0, settings.temperature_std);
            }
        }
    }

    /// What shapes and modal constants depend on: places of sensors and of the taps, and calibrations.
    fn add_places_and_gains(&mut self, lists: &Lists, visits: &[usize], settings: &GapSettings) {
        let names = &lists.names;
        let shapes = self
            .rows
            .iter()
            .any(|row| matches!(row, Row::Constant { .. }));
        let ratios = self.rows.iter().any(|row| matches!(row, Row::Ratio { .. }));
        for place in 0..lists.places.len() {
            self.small(Small::SensorPlace { place }, 0.0, settings.position_std);
        }
        if shapes {
            for &visit in visits {
                self.small(Small::TapPlace { visit }, 0.0, settings.position_std);
            }
        }
        if shapes || ratios {
            for &visit in visits {
                for name in 0..names.len() {
                    self.small(Small::Gain { visit, name }, 0.0, settings.gain_std);
                }
            }
        }
    }

    /// Level and tilt of the nominal damping ratios, where any was observed.
    fn add_damping_level(&mut self, settings: &GapSettings) {
        if self
            .rows
            .iter()
            .any(|row| matches!(row, Row::Damping { .. }))
        {
            let (count, sum) =
                self.rows
                    .iter()
                    .zip(&self.readings)
                    .fold((0.0, 0.0), |sum, (row, reading)| match row {
                        Row::Damping { .. } => (sum.0 + 1.0, sum.1 + reading.value),
                        _ => sum,
                    });
            // Wide: nobody knows the damping of a beam beforehand.
            self.small(Small::Damping, sum / count, 2.0);
            self.small(Small::DampingTilt, 0.0, settings.damping_tilt);
        }
    }

    pub(super) fn small(&mut self, small: Small, centre: f64, std: f64) {
        self.smalls.push(small);
        self.small_centres.push(centre);
        self.small_stds.push(std);
    }

    /// Place of a small unknown among all, if it is there.
    pub(super) fn small_index(&self, small: Small) -> Option<usize> {
        self.smalls.iter().position(|&one| one == small)
    }
}
