//! Sensors whose mass is known and whose place is not: what the described model is worth without them.

use super::nominal::Nominal;
use super::quality::Residuals;
use super::search::{filled, nominal_of};
use super::settings::GapSettings;
use super::trial::MISFIT;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_identify::observation::Observations;

/// What the described model leaves of the readings without the masses whose place nobody said.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Unplaced {
    /// The sensors.
    pub sensors: Vec<String>,
    /// Their mass together (kg).
    pub mass: f64,
    /// Root mean square of the frequency errors without them (%).
    pub gap: f64,
    /// Probability of a misfit as large or larger without them.
    pub goodness_of_fit: f64,
}

impl Unplaced {
    /// Whether the readings refute the model without these masses.
    pub(super) fn is_gap(&self) -> bool {
        self.goodness_of_fit < MISFIT
    }
}

/// Fits the nominal model without the masses whose place nobody said of any recording; `None` where there are none.
pub(super) fn unplaced(
    observations: &Observations,
    nominal: &Nominal,
    settings: &GapSettings,
) -> Option<Unplaced> {
    let observations = filled(observations, nominal);
    let open = |name: &str| {
        let sensors = observations.configurations.iter().flat_map(|c| &c.sensors);
        let mut places = sensors
            .filter(|sensor| sensor.name == name)
            .map(|sensor| sensor.position)
            .peekable();
        places.peek().is_some() && places.all(|place| place.is_none())
    };
    let mut without = nominal.clone();
    let (mut sensors, mut mass) = (Vec::new(), 0.0);
    for sensor in &mut without.sensors {
        let own = sensor.mass.unwrap_or(0.0);
        if own > 0.0 && open(&sensor.name) {
            sensors.push(sensor.name.clone());
            mass += own;
            sensor.mass = Some(0.0);
        }
    }
    if sensors.is_empty() {
        return None;
    }
    let (frame, fit) = nominal_of(&observations, &without, settings)?;
    let residuals = Residuals::new(&frame, &fit)?;
    Some(Unplaced {
        sensors,
        mass,
        gap: residuals.frequency_rms(&frame),
        goodness_of_fit: residuals.goodness()?,
    })
}
