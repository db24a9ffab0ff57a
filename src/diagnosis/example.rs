//! What unit tests of the diagnosis begin with.

use super::frame::Frame;
use super::hypothesis::{Fit, fit_nominal};
use super::nominal::{Nominal, NominalSensor};
use super::settings::GapSettings;
use super::synthetic::{PlannedConfiguration, TestPlan, observe};
use tapjoint_beam::Beam;
use tapjoint_beam::specimen::{Body, Specimen, SpecimenJoint};

/// A steel strip of 0.42 m on springs, with a sensor of this mass (kg).
pub(super) fn strip(mass: f64) -> Nominal {
    let beam = Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let joint = SpecimenJoint::Springs {
        kt: 1.994e6,
        kr: 1223.0,
        coupling: 0.0,
    };
    let sensor = NominalSensor {
        name: "A".to_owned(),
        mass: Some(mass),
        position: None,
    };
    Nominal {
        specimen: Specimen::new(Body::One(beam), joint),
        sensors: vec![sensor],
        joint_before: None,
        scale_std: None,
        reading_bias: None,
    }
}

/// A recording for each place (m) of the sensor, five taps near the end, frequencies alone.
pub(super) fn plan(places: &[f64]) -> TestPlan {
    let recording = |place: &f64| PlannedConfiguration {
        sensors: vec![("A".to_owned(), *place)],
        tap: 0.4,
        level: 1.0,
        masses: Vec::new(),
    };
    TestPlan {
        configurations: places.iter().map(recording).collect(),
        modes: 6,
        taps: 5,
        frequency_std: 5e-5,
        shape_std: None,
        damping_std: None,
        slope_std: None,
        drift: 0.0,
        damping: 0.003,
        scatter: 1.0,
    }
}

/// That strip with a sensor of 4 g at two places, without any effect, and the nominal model's fit.
pub(super) fn fitted() -> (Frame, Fit) {
    let settings = GapSettings::default();
    let observations = observe(&plan(&[0.34, 0.19]), &strip(0.004), &[], 3).unwrap();
    let frame = Frame::new(&observations, &strip(0.004), &settings);
    let fit = fit_nominal(&frame, &settings).unwrap();
    (frame, fit)
}
