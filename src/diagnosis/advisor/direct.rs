//! Tests that need no vibration of the beam: scales, calipers, a clock.

use super::super::forward::Layout;
use super::super::frame::Frame;
use super::super::small_unknowns::Small;
use super::information::Outlook;
use super::outlooks::{Expected, State};
use super::proposals::beam_mass;
use super::step::Step;
use nalgebra::{DMatrix, DVector};
use tapjoint_beam::effects::EffectId;

/// What one reading is expected to be: its value, its slopes with respect to the hypothesis's parameters, and
/// a standard deviation that it has besides.
struct Expectation {
    value: f64,
    slopes: Vec<(usize, f64)>,
    besides: f64,
}

impl Expectation {
    /// Nothing but what is usual.
    fn usual(spread: f64) -> Self {
        Expectation {
            value: 0.0,
            slopes: Vec::new(),
            besides: spread,
        }
    }

    /// The size of an effect times a factor where the hypothesis has it, else what is usual.
    fn of(state: &State, (frame, effect): (&Frame, EffectId), factor: f64, usual: f64) -> Self {
        match state.size(frame, effect) {
            Some(column) => Expectation {
                value: factor * state.parameters[column],
                slopes: vec![(column, factor)],
                besides: 0.0,
            },
            None => Expectation::usual(usual),
        }
    }
}

/// Standard uncertainty of a sensor's mass on a kitchen scale with its share of the cable (kg).
const SENSOR_MASS: f64 = 5e-4;
/// Of the beam's free length by a tape (m).
const TAPE: f64 = 2e-4;
/// Of the factor that thickness and mass put on frequencies, by calipers and scale (1).
const CALIPERS: f64 = 1.5e-3;
/// Of the beam's mass (1), and by how much stock differs from its nominal mass.
const BEAM_MASS: (f64, f64) = (1e-3, 3e-3);
/// Of a clock compared with a reference (1), and by how much clocks are usually off.
const CLOCK: (f64, f64) = (2e-5, 5e-5);

/// What the hypothesis expects of a test that reads something else than frequencies; `None` where it is
/// none of these.
pub(super) fn direct(state: &State, frame: &Frame, step: &Step) -> Option<Outlook> {
    let length = frame.nominal.specimen.body.length();
    let of = |effect, factor, usual| Expectation::of(state, (frame, effect), factor, usual);
    let (expected, stds) = match step {
        Step::WeighSensor => (
            vec![of(EffectId::SensorMass, 1.0, 2.0 * SENSOR_MASS)],
            vec![SENSOR_MASS],
        ),
        Step::Calipers => (
            vec![
                scale(state, frame),
                of(EffectId::Length, 1.0, 1e-3),
                of(EffectId::AddedMass, 1.0 / beam_mass(frame), BEAM_MASS.1),
            ],
            vec![CALIPERS, TAPE / length, BEAM_MASS.0],
        ),
        Step::ReferenceTone => (vec![of(EffectId::Timebase, 1.0, CLOCK.1)], vec![CLOCK.0]),
        _ => return None,
    };
    Some(outlook(state, &expected, &stds))
}

/// Thickness and density show on calipers and scale, the modulus does not: of a common factor on all
/// frequencies half is expected to, and no less uncertain than that.
fn scale(state: &State, frame: &Frame) -> Expectation {
    let layout = Layout::new(frame, &state.effects);
    let mut value = 0.0;
    let mut slopes = Vec::new();
    if let Some(small) = frame.small_index(Small::Scale) {
        let column = layout.smalls() + small;
        value += 0.5 * state.parameters[column];
        slopes.push((column, 0.5));
    }
    if let Some(column) = state.size(frame, EffectId::Modulus) {
        // f grows as the square root of E/rho.
        value += 0.25 * state.parameters[column];
        slopes.push((column, 0.25));
    }
    Expectation {
        value,
        slopes,
        besides: value.abs(),
    }
}

fn outlook(state: &State, expected: &[Expectation], stds: &[f64]) -> Outlook {
    let mut slopes = DMatrix::zeros(expected.len(), state.parameters.len());
    for (row, one) in expected.iter().enumerate() {
        for (column, slope) in &one.slopes {
            slopes[(row, *column)] = *slope;
        }
    }
    let mut spread = &slopes * &state.covariance * slopes.transpose();
    for (row, one) in expected.iter().enumerate() {
        spread[(row, row)] += one.besides * one.besides;
    }
    let mean = DVector::from_iterator(expected.len(), expected.iter().map(|one| one.value));
    Expected { mean, spread }.outlook(0, stds)
}
