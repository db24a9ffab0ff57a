//! Whether a laboratory can be, and what it is asked to plant.

use super::error::SimulateError;
use super::laboratory::{Damping, Laboratory};
use tapjoint_beam::effects::{Effect, EffectId};
use tapjoint_description::TestDescription;

/// Looks at every number.
pub(super) fn check_laboratory(laboratory: &Laboratory) -> Result<(), SimulateError> {
    let (hammer, sensors, recorder) = (
        &laboratory.hammer,
        &laboratory.sensors,
        &laboratory.recorder,
    );
    let [up, rock] = laboratory.specimen.suspension.unwrap_or([1.0; 2]);
    let positive = [
        ("the peak force", hammer.peak_force),
        ("the number of taps", hammer.taps as f64),
        ("the time between taps", hammer.interval.unwrap_or(1.0)),
        ("the suspension's frequency, up and down,", up),
        ("the suspension's frequency, rocking,", rock),
        (
            "the sample rate",
            f64::from(recorder.sample_rate.unwrap_or(1)),
        ),
    ];
    let not_negative = [
        ("the time before the first tap", hammer.lead),
        ("the scatter of the level", hammer.level_scatter),
        ("the scatter of the pulse's length", hammer.length_scatter),
        ("the scatter of the place", hammer.place_scatter),
        ("the noise", sensors.noise),
        ("the sensitivity's error", sensors.sensitivity_error),
        ("the corner of the AC coupling", sensors.ac_coupling),
        ("the mounting's resonance", sensors.mounting_resonance),
        ("the mains frequency", recorder.mains),
        ("the hum", recorder.hum),
        ("the drift", recorder.drift),
        ("the offset", recorder.offset),
    ];
    let shares = [
        ("the share of double hits", hammer.double_hits),
        ("the share of weak hits", hammer.weak_hits),
    ];
    check_all(&positive, |value| value > 0.0, "positive")?;
    check_all(&not_negative, |value| value >= 0.0, "at least 0")?;
    check_all(
        &shares,
        |value| (0.0..=1.0).contains(&value),
        "between 0 and 1",
    )?;
    let clock = [("the clock's error", recorder.clock_error)];
    check_all(&clock, |value| value.abs() < 0.5, "smaller than 0.5")?;
    check_all(&damping(laboratory), |value| value >= 0.0, "at least 0")
}

/// Refuses effects that would change nothing or that no recording contains: the truth would say what is not so.
pub(super) fn check_effects(
    test: &TestDescription,
    effects: &[Effect],
) -> Result<(), SimulateError> {
    let planted = |id: EffectId| effects.iter().any(|effect| effect.id == id);
    if planted(EffectId::Resolution) {
        return Err(SimulateError::Resolution);
    }
    let stated = |mass: Option<f64>| mass.is_some_and(|mass| mass > 0.0);
    if planted(EffectId::SensorMass) && test.sensors.iter().all(|one| stated(one.mass)) {
        return Err(SimulateError::NothingToWeigh);
    }
    Ok(())
}

fn damping(laboratory: &Laboratory) -> Vec<(&'static str, f64)> {
    match &laboratory.specimen.damping {
        Damping::Modal(ratios) => ratios.iter().map(|&r| ("a damping ratio", r)).collect(),
        Damping::Rayleigh { mass, stiffness } => vec![
            ("the mass-proportional damping", *mass),
            ("the stiffness-proportional damping", *stiffness),
        ],
    }
}

fn check_all(
    values: &[(&'static str, f64)],
    good: impl Fn(f64) -> bool,
    allowed: &'static str,
) -> Result<(), SimulateError> {
    let bad = values
        .iter()
        .find(|(_, value)| !value.is_finite() || !good(*value));
    match bad {
        None => Ok(()),
        Some(&(quantity, value)) => Err(SimulateError::Setting {
            quantity,
            value,
            allowed,
        }),
    }
}
