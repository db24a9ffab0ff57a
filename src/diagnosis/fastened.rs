//! Known masses that are fastened for single recordings: known as well as a scale and a ruler know them.

use super::frame::Frame;
use super::settings::GapSettings;
use super::setup::Setup;
use super::small_unknowns::Small;
use super::solved::Solved;
use tapjoint_beam::specimen::PointMass;

impl Frame {
    /// The small unknowns of each distinct mass.
    pub(super) fn add_fastened(&mut self, all: &[PointMass], settings: &GapSettings) {
        for fastened in 0..all.len() {
            let small = Small::FastenedMass { fastened };
            self.small(small, 0.0, settings.fastened_mass_std);
            let small = Small::FastenedPlace { fastened };
            self.small(small, 0.0, settings.position_std);
        }
    }
}

/// d ln f of a mode for each of the masses of one configuration that a small unknown is of. With a
/// mass-normalised shape d ln f/d m = -phi^2/2, and d ln f/d x = -m phi phi'.
pub(super) fn fastened_slope(small: &Small, setup: &Setup, (one, index): (&Solved, usize)) -> f64 {
    let displacement = |mass: &PointMass| one.modes().displacement(index, mass.position);
    let of = |wanted: usize, slope: &dyn Fn(&PointMass) -> f64| -> f64 {
        let own = setup.fastened.iter().filter(|(own, _)| *own == wanted);
        own.map(|(_, mass)| slope(mass)).sum()
    };
    match *small {
        Small::FastenedMass { fastened } => of(fastened, &|mass| {
            -0.5 * mass.mass * displacement(mass).powi(2)
        }),
        Small::FastenedPlace { fastened } => of(fastened, &|mass| {
            -mass.mass * displacement(mass) * one.modes().slope(index, mass.position)
        }),
        _ => 0.0,
    }
}
