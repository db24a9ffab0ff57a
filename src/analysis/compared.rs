//! A finished analysis as one side of a comparison.

use super::Analysis;
use super::ModeResult;
use super::observations::nominal_with;
use tapjoint_beam::specimen::PointMass;
use tapjoint_compare::{Item, ItemKind, Level, LevelPoint, MeasuredMode, MovedStd, Reading, Test};
use tapjoint_description::{SensorKind, TestDescription};
use tapjoint_signal::modal::amplitude::AmplitudeVerdict;

/// Least standard uncertainty that a described beam leaves to all frequencies in common (1): its own error cancels between two
/// tests, and only the joint's stiffness follows it.
const LEAST_COMMON: f64 = 0.01;
/// Points over the amplitudes of a mode's decays.
const LEVEL_POINTS: usize = 40;

/// Returns what a comparison needs of a test: the described structure in the reference configuration, what sits on it,
/// and its modes. `None` for a bare recording, which has no structure.
pub fn compared_test(test: &TestDescription, analysis: &Analysis) -> Option<Test> {
    analysis.structure.as_ref()?;
    let found = analysis.identification.as_ref();
    let estimate = found.and_then(|found| found.consistent.as_ref());
    // Properties of the beam stay as described: an estimate of them would take in what changed.
    let nominal = nominal_with(test, estimate.map(|estimate| estimate.joint));
    let items = compared_items(test);
    let mut structure = nominal.specimen;
    structure.masses.extend(items.iter().map(|item| item.point));
    let tolerances = nominal.uncertainty.beam;
    let modulus = tolerances.modulus.unwrap_or(0.0);
    let density = tolerances.density.unwrap_or(0.0);
    let length = tolerances.length.unwrap_or(0.0);
    let thickness = tolerances.thickness.unwrap_or(0.0);
    // f is in proportion to h sqrt(E/rho)/L^2.
    let common = (0.5 * modulus.hypot(density)).hypot(thickness);
    let modes = analysis.modes.iter().filter_map(|mode| {
        let half_line = mode.half_line.unwrap_or(0.0);
        Some(MeasuredMode {
            mode: mode.mode?,
            frequency: mode.frequency,
            // A reading on a line is uniform within half a line.
            std: mode.std.unwrap_or(half_line / 3.0_f64.sqrt()),
            damping: damping_of(mode),
            level: level_of(mode, test, analysis),
            moved: MovedStd::default(),
        })
    });
    let modes: Vec<MeasuredMode> = modes
        .filter(|one| {
            test.analysis
                .fit_modes
                .is_none_or(|highest| one.mode <= highest)
        })
        .collect();
    let unnumbered = analysis.modes.iter().filter(|mode| mode.is_unpaired());
    Some(Test {
        unnumbered: unnumbered.map(|mode| mode.frequency).collect(),
        structure,
        items,
        knows_joint: [test.joint.kt.is_some(), test.joint.kr.is_some()],
        common_std: common.hypot(2.0 * length).max(LEAST_COMMON),
        modes,
    })
}

/// Returns what weighs on the structure in the reference configuration: sensors of known mass and place, and fastened masses. A
/// comparison may name each of them.
pub fn compared_items(test: &TestDescription) -> Vec<Item> {
    let recording = test.reference_recording();
    let mut items = Vec::new();
    for sensor in &test.sensors {
        let position = recording.map_or(sensor.position, |one| one.place_of(sensor));
        let mass = sensor.mass.filter(|_| test.analysis.sensor_mass);
        if let (Some(position), Some(mass)) = (position, mass)
            && sensor.kind != SensorKind::Sound
            && mass > 0.0
        {
            items.push(Item {
                name: sensor.name.clone(),
                point: PointMass::new(position, mass),
                kind: ItemKind::Sensor,
            });
        }
    }
    if let Some(recording) = recording {
        for (index, point) in recording.masses.iter().enumerate() {
            let name = recording.mass_names.get(index).cloned().flatten();
            items.push(Item {
                name: name.unwrap_or_else(|| format!("fastened mass {}", index + 1)),
                point: *point,
                kind: ItemKind::Mass,
            });
        }
    }
    items
}

/// Returns the damping ratio of a mode (1).
fn damping_of(mode: &ModeResult) -> Option<Reading> {
    let reading = mode.reading.as_ref();
    let own = reading.and_then(|reading| {
        Some(Reading {
            value: reading.damping_ratio?,
            std: reading.damping_std.unwrap_or(0.0),
        })
    });
    let stated = mode.damping.map(|value| Reading { value, std: 0.0 });
    own.or(stated)
}

/// Returns the level at which a mode was read, and how it depends on the level; `None` where its decays do not tell it.
fn level_of(mode: &ModeResult, test: &TestDescription, analysis: &Analysis) -> Option<Level> {
    let reading = mode.reading.as_ref()?;
    let curve = reading.fit.as_ref()?.amplitude.as_ref()?;
    let tells = matches!(
        curve.verdict,
        AmplitudeVerdict::Changes | AmplitudeVerdict::Steady
    );
    let frequency = curve.frequency.as_ref().filter(|_| tells)?;
    let damping = curve.damping.as_ref()?;
    let at = reading.at_amplitude.as_ref()?;
    let [low, high] = frequency.reach();
    let points = (0..LEVEL_POINTS).filter_map(|point| {
        // In the middle of each step, since the curve cannot be read beyond its ends.
        let share = (point as f64 + 0.5) / LEVEL_POINTS as f64;
        let amplitude = low * (high / low).powf(share);
        let (change, std) = frequency.between(at.value, amplitude)?;
        let (damping, damping_std) = damping.between(at.value, amplitude)?;
        Some(LevelPoint {
            amplitude,
            frequency: Reading {
                value: (change / mode.frequency).ln_1p(),
                std: std / mode.frequency,
            },
            damping: Reading {
                value: damping,
                std: damping_std,
            },
        })
    });
    // Slopes are per factor of e in amplitude.
    let per_ten = std::f64::consts::LN_10 / mode.frequency;
    Some(Level {
        amplitude: at.value,
        curve: points.collect(),
        of: amplitude_of(mode, at.sensor, test, analysis)?,
        frequency_slope: Reading {
            value: per_ten * frequency.slope,
            std: per_ten * frequency.slope_std,
        },
    })
}

/// Returns what an amplitude is of: sensor, unit and place, "A in m/s2 at 0.338 m".
fn amplitude_of(
    mode: &ModeResult,
    sensor: usize,
    test: &TestDescription,
    analysis: &Analysis,
) -> Option<String> {
    let file = mode.recording.as_ref()?;
    let recording = analysis
        .recordings
        .iter()
        .position(|one| one.file == *file)?;
    let response = analysis.recordings[recording].responses.get(sensor)?;
    let described = test.recordings.get(recording);
    let own = test.sensors.iter().find(|one| one.name == response.name);
    let place = own.and_then(|own| described.map_or(own.position, |one| one.place_of(own)));
    let unit = response.unit.as_deref().unwrap_or("?");
    let place = place.map_or(String::new(), |place| format!(" at {place} m"));
    Some(format!("{} in {unit}{place}", response.name))
}
