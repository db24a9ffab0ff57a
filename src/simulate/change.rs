//! What changes between two virtual tests of one structure, and how far the set-up scatters from test to test.

use super::laboratory::SimulateError;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use tapjoint_beam::Assembly;
use tapjoint_beam::effects::{Effect, EffectId, scale_joint};
use tapjoint_beam::specimen::{PointMass, Specimen};
use tapjoint_description::{RecordingDescription, TestDescription};

/// A change that a description does not know.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The joint's stiffnesses change; its coupling stays.
    Joint {
        /// Relative change of the translational stiffness (1).
        kt: f64,
        /// Relative change of the rotational stiffness (1).
        kr: f64,
    },
    /// The mass of a described item is gone. A sensor still gives its signal.
    LostMass {
        /// Name of the sensor or of the fastened mass.
        item: String,
    },
    /// An effect of the catalogue.
    Effect(Effect),
}

impl Change {
    /// Effects of the catalogue that may come between two tests.
    pub const EFFECTS: [EffectId; 6] = [
        EffectId::AddedMass,
        EffectId::LocalCrack,
        EffectId::Length,
        EffectId::Modulus,
        EffectId::SensorPosition,
        EffectId::AxialLoad,
    ];
    /// Name of a change of the joint.
    pub const JOINT: &'static str = "joint-change";
    /// Name of a loss.
    pub const LOST_MASS: &'static str = "lost-mass";

    /// Returns its name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Joint { .. } => Self::JOINT,
            Self::LostMass { .. } => Self::LOST_MASS,
            Self::Effect(effect) => effect.id.name(),
        }
    }
}

/// Refuses changes of what the test does not have.
pub(super) fn check_changes(
    test: &TestDescription,
    changes: &[Change],
) -> Result<(), SimulateError> {
    for change in changes {
        match change {
            Change::LostMass { item } => check_item(test, item)?,
            Change::Effect(effect)
                if effect.id == EffectId::AxialLoad && test.joint.kind != Assembly::Cantilever =>
            {
                return Err(SimulateError::NoLoad);
            }
            Change::Joint { .. } | Change::Effect(_) => {}
        }
    }
    Ok(())
}

fn check_item(test: &TestDescription, item: &str) -> Result<(), SimulateError> {
    let sensors = test.sensors.iter();
    let weighed = sensors.filter(|sensor| sensor.mass.is_some_and(|mass| mass > 0.0));
    let mut known: Vec<&str> = weighed.map(|sensor| sensor.name.as_str()).collect();
    for recording in &test.recordings {
        known.extend(recording.mass_names.iter().flatten().map(String::as_str));
    }
    known.sort_unstable();
    known.dedup();
    if known.contains(&item) {
        return Ok(());
    }
    Err(SimulateError::NoItem {
        item: item.to_owned(),
        known: match &known[..] {
            [] => "nothing with a name and a mass".to_owned(),
            names => names.join(", "),
        },
    })
}

/// Returns the name of the sensor that an effect moves; `None` where the test has none of that number.
pub fn moved_sensor<'a>(test: &'a TestDescription, effect: &Effect) -> Option<&'a str> {
    let number = effect.value("sensor")?;
    let mut numbered = (1..).zip(&test.sensors);
    let (_, sensor) = numbered.find(|(own, _)| f64::from(*own) == number)?;
    Some(&sensor.name)
}

/// Returns the recording without the fastened masses that are lost.
pub(super) fn without_lost_masses(
    recording: &RecordingDescription,
    changes: &[Change],
) -> RecordingDescription {
    let mut left = recording.clone();
    let names = recording.mass_names.iter().zip(&recording.masses);
    let kept = names.filter(|(name, _)| !is_lost(name.as_deref(), changes));
    (left.mass_names, left.masses) = kept.map(|(name, mass)| (name.clone(), *mass)).unzip();
    left
}

/// Returns the sensors, of which those that are lost weigh nothing.
pub(super) fn without_lost_sensors(
    test: &TestDescription,
    places: &[PointMass],
    changes: &[Change],
) -> Vec<PointMass> {
    let mut left = places.to_vec();
    for (place, sensor) in left.iter_mut().zip(&test.sensors) {
        if is_lost(Some(&sensor.name), changes) {
            place.mass = 0.0;
        }
    }
    left
}

fn is_lost(name: Option<&str>, changes: &[Change]) -> bool {
    let mut changes = changes.iter();
    changes.any(|change| matches!(change, Change::LostMass { item } if Some(item.as_str()) == name))
}

/// Changes the joint of a specimen.
///
/// # Errors
/// [`SimulateError::NoSpring`] where a spring that shall change is rigid or is not there.
pub(super) fn change_joint(
    specimen: &mut Specimen,
    changes: &[Change],
) -> Result<(), SimulateError> {
    for change in changes {
        let Change::Joint { kt, kr } = *change else {
            continue;
        };
        let stiffnesses = specimen.joint_stiffnesses();
        for (key, size, stiffness) in [("kt", kt, stiffnesses[0]), ("kr", kr, stiffnesses[1])] {
            if size != 0.0 && !(stiffness > 0.0 && stiffness.is_finite()) {
                return Err(SimulateError::NoSpring { key });
            }
        }
        scale_joint(specimen, [1.0 + kt, 1.0 + kr]);
    }
    Ok(())
}

/// Distribution of a mode's own scatter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScatterTails {
    /// Normal.
    Normal,
    /// Student's with four degrees of freedom.
    Long,
}

/// Scatter of natural frequencies between set-ups of one state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetUpScatter {
    /// Standard deviation of the difference of two tests of one state (1, relative).
    pub repeatability: f64,
    /// Share of the variance that all modes of a test have in common (1): temperature and the like.
    pub share: f64,
    /// Distribution of the rest.
    pub tails: ScatterTails,
}

impl SetUpScatter {
    /// Draws the factor on the natural frequency of each mode in one test: exp(r/sqrt(2) (sqrt(c) n + sqrt(1 - c) own)) with the
    /// repeatability r and the share c.
    pub fn factors(&self, modes: usize, draw: &mut ChaCha8Rng) -> Vec<f64> {
        // The difference of two tests has the variance of both.
        let std = self.repeatability / 2.0_f64.sqrt();
        let normal = |draw: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(draw) };
        let common = self.share.sqrt() * normal(draw);
        let rest = (1.0 - self.share).sqrt();
        let mut factors = Vec::with_capacity(modes);
        for _ in 0..modes {
            let own = match self.tails {
                ScatterTails::Normal => rest * normal(draw),
                ScatterTails::Long => {
                    let tail: f64 = StudentT::new(4.0).map_or(0.0, |t| t.sample(draw));
                    // Its variance is 2.
                    rest * tail / 2.0_f64.sqrt()
                }
            };
            factors.push((std * (common + own)).exp());
        }
        factors
    }
}
