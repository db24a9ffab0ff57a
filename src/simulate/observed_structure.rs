//! The structure of a virtual test: as planted, as the sensors observe it, and as described.

use super::laboratory::{SimulateError, SpecimenSettings};
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;
use tapjoint_beam::specimen::{Body, Joint, Mesh, PointMass, Specimen, SpecimenModes};
use tapjoint_beam::{JointStiffness, StructureError};
use tapjoint_description::{Assembly, RecordingDescription, SensorKind, TestDescription};
use tapjoint_description::{coupling, described_beam, described_specimen};

/// Modes beyond the highest that moves in time, whose compliances are added up: what is left out after
/// them has fallen with the cube of their number.
const COMPLIANT_MODES: usize = 24;
/// Most modes: of 200 elements a higher mode is not exact.
const MOST_MODES: usize = 100;
/// A mode that is damped more follows like a spring.
const MOST_DAMPING: f64 = 0.9;
/// Damping ratio of a beam on rubber bands.
const SUSPENSION_DAMPING: f64 = 0.03;

/// A structure and the test's view of it.
#[derive(Debug, Clone)]
pub struct ObservedStructure {
    /// Motions on the suspension first, then the elastic modes.
    modes: Arc<SpecimenModes>,
    /// Number of motions on the suspension among them.
    suspended: usize,
    sensors: Vec<f64>,
    reduced: ReducedStructure,
}

impl ObservedStructure {
    /// Returns the structure with `sensors` at these positions (m) and this `joint_loss` factor (1). Modes up
    /// to `highest` (Hz) move in time.
    ///
    /// # Errors
    /// As [`Specimen::modes`].
    pub fn new(
        specimen: &Specimen,
        settings: &SpecimenSettings,
        sensors: &[f64],
        joint_loss: f64,
        highest: f64,
    ) -> Result<Self, StructureError> {
        // About how many modes lie below the highest frequency: lambda grows by pi from mode to mode.
        let beams = specimen.body.beams().iter();
        let lambda: f64 = beams.map(|beam| beam.lambda_of(highest)).sum();
        let below = (lambda / std::f64::consts::PI).min(MOST_MODES as f64) as usize + 2;
        let count = (below + COMPLIANT_MODES).min(MOST_MODES);
        let elastic = specimen.modes(count, Mesh::SIMULATION)?;
        // Compliance of the joint by the modes that are not even computed.
        let beyond_computed = (specimen.joint).map_or(0.0, |_| elastic.joint_compliance_beyond());
        let (modes, suspended) = match settings.suspension {
            // No rigid-body motion at all.
            None if hangs(specimen) => (elastic, 0),
            Some(frequencies) if hangs(specimen) => elastic.on_suspension(Some(frequencies))?,
            // What turns about a pivot may be held by cables.
            _ => elastic.on_suspension(None)?,
        };
        let mut moving = Vec::new();
        for mode in 0..modes.len() {
            let frequency = modes.frequencies()[mode];
            let damping_ratio = match mode.checked_sub(suspended) {
                None => SUSPENSION_DAMPING,
                // The joint's loss acts on its share of the strain energy: zeta = eta/2 share.
                Some(elastic) => {
                    settings.damping.ratio(elastic, frequency)
                        + 0.5 * joint_loss * modes.joint_energy_share(mode)
                }
            };
            let moves = frequency <= highest && damping_ratio < MOST_DAMPING;
            if !moves {
                break;
            }
            moving.push(ReducedMode {
                frequency,
                damping_ratio,
                at_sensors: sensors
                    .iter()
                    .map(|&x| modes.middle_displacement(mode, x))
                    .collect(),
                at_joint: modes.joint_motion(mode)[1],
            });
        }
        let turned = beyond(&modes, moving.len(), |mode| {
            modes.joint_motion(mode)[1].powi(2)
        });
        let places = sensors.iter();
        let reduced = ReducedStructure {
            joint_compliance: beyond_computed + turned,
            joint_to_sensors: places.map(|&x| joint_to(&modes, moving.len(), x)).collect(),
            modes: moving,
        };
        Ok(Self {
            modes: Arc::new(modes),
            suspended,
            sensors: sensors.to_vec(),
            reduced,
        })
    }

    /// Multiplies the natural frequencies of the elastic modes, the lowest first, by these factors (1). Shapes stay.
    pub fn scale_frequencies(&mut self, factors: &[f64]) {
        let elastic = self.reduced.modes.iter_mut().skip(self.suspended);
        for (mode, factor) in elastic.zip(factors) {
            mode.frequency *= factor;
        }
    }

    /// Positions of its sensors (m).
    pub fn sensors(&self) -> &[f64] {
        &self.sensors
    }

    /// Its modes and what lies beyond them.
    pub fn reduced(&self) -> &ReducedStructure {
        &self.reduced
    }

    /// Natural frequencies (Hz) and damping ratios of the elastic modes that move in time.
    pub fn elastic_modes(&self) -> impl Iterator<Item = (f64, f64)> {
        let elastic = self.reduced.modes.iter().skip(self.suspended);
        elastic.map(|mode| (mode.frequency, mode.damping_ratio))
    }

    /// Natural frequencies (Hz) of a hanging structure on its suspension, with what else holds it to
    /// the ground.
    pub fn suspension_frequencies(&self) -> impl Iterator<Item = f64> {
        let modes = self.reduced.modes.iter().take(self.suspended);
        modes.map(|mode| mode.frequency)
    }

    /// Returns shapes and compliances of the place at a position (m), as a strike there meets them.
    pub fn struck(&self, position: f64) -> StruckPlace {
        let (modes, moving) = (&self.modes, self.reduced.modes.len());
        let to_sensors = self.sensors.iter().map(|&x| {
            beyond(modes, moving, |mode| {
                modes.middle_displacement(mode, x) * modes.middle_displacement(mode, position)
            })
        });
        StruckPlace {
            at_modes: (0..moving)
                .map(|mode| modes.middle_displacement(mode, position))
                .collect(),
            to_sensors: to_sensors.collect(),
            to_joint: joint_to(modes, moving, position),
        }
    }
}

/// Returns true for a specimen that hangs, since nothing holds it.
pub(super) fn hangs(specimen: &Specimen) -> bool {
    matches!(specimen.body, Body::Joined(_)) || specimen.joint_stiffnesses() == [0.0; 2]
}

/// Sum over the modes that do not move in time of a product of shapes, over omega^2.
fn beyond(modes: &SpecimenModes, moving: usize, product: impl Fn(usize) -> f64) -> f64 {
    (moving..modes.len())
        .map(|mode| product(mode) / (TAU * modes.frequencies()[mode]).powi(2))
        .sum()
}

fn joint_to(modes: &SpecimenModes, moving: usize, position: f64) -> f64 {
    beyond(modes, moving, |mode| {
        modes.joint_motion(mode)[1] * modes.middle_displacement(mode, position)
    })
}

/// The described specimen with the masses of one recording and with its sensors at these places. `given` is a joint in
/// place of the described one.
pub(super) fn nominal_specimen(
    test: &TestDescription,
    recording: &RecordingDescription,
    sensors: &[PointMass],
    given: Option<JointStiffness>,
) -> Result<Specimen, SimulateError> {
    let own = test.of_length(recording.length);
    let mut specimen = described_specimen(&own, joint(test, given)?);
    let known = sensors.iter().filter(|sensor| sensor.mass > 0.0);
    specimen.masses.extend(known);
    specimen.masses.extend(&recording.masses);
    Ok(specimen)
}

fn joint(
    test: &TestDescription,
    given: Option<JointStiffness>,
) -> Result<Option<Joint>, SimulateError> {
    if test.joint.kind == Assembly::Free {
        return Ok(None);
    }
    let (missing, keys) = match (given, test.joint.kt, test.joint.kr) {
        (Some(given), ..) => {
            return Ok(Some(given.in_si(&described_beam(test))));
        }
        (None, Some(kt), Some(kr)) => {
            let coupling = coupling(kt, kr, 1.0 / test.joint.ktr.unwrap_or(f64::INFINITY));
            return Ok(Some(Joint { kt, kr, coupling }));
        }
        (None, None, None) => (
            "kt and kr are",
            "`kt = 1.9e6` (N/m) and `kr = 1.2e3` (N m/rad)",
        ),
        (None, None, Some(_)) => ("kt is", "`kt = 1.9e6` (N/m)"),
        (None, Some(_), None) => ("kr is", "`kr = 1.2e3` (N m/rad)"),
    };
    Err(SimulateError::NoJoint { missing, keys })
}

/// Described places of the sensors in a recording, with their masses by the datasheet.
pub(super) fn sensor_places(
    test: &TestDescription,
    recording: &RecordingDescription,
) -> Result<Vec<PointMass>, SimulateError> {
    let places = test.sensors.iter().map(|sensor| {
        let problem = match (sensor.kind, recording.place_of(sensor)) {
            (SensorKind::Sound, _) => "sound is not simulated; leave the sensor out",
            (_, Some(x)) => return Ok(PointMass::new(x, sensor.mass.unwrap_or(0.0))),
            (_, None) => "its place is missing; add `position` (m along the beam)",
        };
        let name = sensor.name.clone();
        Err(SimulateError::Sensor { name, problem })
    });
    places.collect()
}

/// One mode of unit modal mass.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedMode {
    /// Natural frequency (Hz), undamped.
    pub frequency: f64,
    /// Damping ratio, at least 0 and below 1.
    pub damping_ratio: f64,
    /// Shape at each sensor (kg^-1/2).
    pub at_sensors: Vec<f64>,
    /// Rotation of the joint's spring (rad kg^-1/2 m^-1).
    pub at_joint: f64,
}

/// A structure as it answers: its modes up to some frequency, those beyond as springs.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedStructure {
    /// The modes that move in time.
    pub modes: Vec<ReducedMode>,
    /// Rotation of the joint's spring per moment on it (rad/(N m)), of all modes left out.
    pub joint_compliance: f64,
    /// Displacement of each sensor per moment on the joint's spring (1/N), of all modes left out.
    pub joint_to_sensors: Vec<f64>,
}

/// A place that is struck: the shapes there, and the compliance of the modes left out.
#[derive(Debug, Clone, PartialEq)]
pub struct StruckPlace {
    /// Shape of each mode (kg^-1/2).
    pub at_modes: Vec<f64>,
    /// Displacement of each sensor per force (m/N), of all modes left out.
    pub to_sensors: Vec<f64>,
    /// Rotation of the joint's spring per force (rad/N), of all modes left out.
    pub to_joint: f64,
}

/// Quantity that a sensor senses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensed {
    /// Acceleration (m/s2).
    Acceleration,
    /// Velocity (m/s).
    Velocity,
    /// Displacement (m).
    Displacement,
}

/// A mode's constants of motion, q'' + 2 zeta omega q' + omega^2 q = force.
///
/// With the pole p = -zeta omega + j omega_d the state z = q' - conj(p) q obeys z' = p z + force,
/// so that q = Im z/omega_d and q' = Re z + Re(p) q.
#[derive(Debug, Clone, Copy)]
pub(super) struct Oscillator {
    pub(super) pole: Complex64,
    omega: f64,
}

impl Oscillator {
    pub(super) fn new(mode: &ReducedMode) -> Self {
        let omega = TAU * mode.frequency;
        let damped = omega * (1.0 - mode.damping_ratio.powi(2)).sqrt();
        Self {
            pole: Complex64::new(-mode.damping_ratio * omega, damped),
            omega,
        }
    }

    /// Displacement, velocity and acceleration of the modal coordinate with the state z under a
    /// modal force.
    pub(super) fn motion(&self, z: Complex64, force: f64) -> [f64; 3] {
        let q = z.im / self.pole.im;
        let velocity = z.re + self.pole.re * q;
        let acceleration = force + 2.0 * self.pole.re * velocity - self.omega * self.omega * q;
        [q, velocity, acceleration]
    }

    /// Energy of the modal coordinate (J), (q'^2 + omega^2 q^2)/2.
    pub(super) fn energy(&self, z: Complex64) -> f64 {
        let [q, velocity, _] = self.motion(z, 0.0);
        0.5 * (velocity * velocity + (self.omega * q).powi(2))
    }
}

/// Sum over the modes of factors of their states' real and imaginary parts.
pub(super) fn seen(factors: &[[f64; 2]], states: &[Complex64]) -> f64 {
    // Sums of their own for each lane keep the processor's units busy.
    let mut sums = [[0.0; 2]; 4];
    let (fours, rest) = factors.as_chunks::<4>();
    let (state_fours, others) = states.as_chunks::<4>();
    for (factors, states) in fours.iter().zip(state_fours) {
        for ((sum, factor), state) in sums.iter_mut().zip(factors).zip(states) {
            sum[0] += factor[0] * state.re;
            sum[1] += factor[1] * state.im;
        }
    }
    let tail = rest.iter().zip(others);
    let tail: f64 = tail
        .map(|([real, imaginary], z)| real * z.re + imaginary * z.im)
        .sum();
    sums.as_flattened().iter().sum::<f64>() + tail
}

impl Sensed {
    /// Order of the derivative of the displacement: 0, 1 or 2.
    pub(super) fn derivative(self) -> usize {
        match self {
            Self::Displacement => 0,
            Self::Velocity => 1,
            Self::Acceleration => 2,
        }
    }
}
