//! The units of every dimension.

use super::{Dimension, STANDARD_GRAVITY};

/// One inch (m), exact by definition.
const INCH: f64 = 0.0254;
/// One avoirdupois pound (kg), exact by definition.
const POUND: f64 = 0.453_592_37;
/// One pound-force (N): a pound under standard gravity.
const POUND_FORCE: f64 = POUND * STANDARD_GRAVITY;
/// One degree of arc (rad).
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A unit: SI value = `factor` times number plus `offset`.
pub(super) struct Unit {
    pub(super) symbol: &'static str,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

/// A unit without an offset, as all are but temperatures.
const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit {
        symbol,
        factor,
        offset: 0.0,
    }
}

// The first unit of each list is the SI unit, which messages quote. Symbols stand here in the
// form that `normalise` makes of what people write: no blanks, no dots, plain digits.
const LENGTH: &[Unit] = &[
    unit("m", 1.0),
    unit("mm", 1e-3),
    unit("cm", 1e-2),
    unit("um", 1e-6),
    unit("nm", 1e-9),
    unit("km", 1e3),
    unit("in", INCH),
    unit("ft", 12.0 * INCH),
];
const PRESSURE: &[Unit] = &[
    unit("Pa", 1.0),
    unit("GPa", 1e9),
    unit("MPa", 1e6),
    unit("kPa", 1e3),
    unit("mPa", 1e-3),
    unit("N/m2", 1.0),
    unit("N/mm2", 1e6),
    unit("kN/mm2", 1e9),
    unit("bar", 1e5),
    unit("psi", POUND_FORCE / (INCH * INCH)),
    unit("ksi", 1e3 * POUND_FORCE / (INCH * INCH)),
    unit("Msi", 1e6 * POUND_FORCE / (INCH * INCH)),
];
const DENSITY: &[Unit] = &[
    unit("kg/m3", 1.0),
    unit("g/cm3", 1e3),
    unit("kg/dm3", 1e3),
    unit("t/m3", 1e3),
    unit("g/m3", 1e-3),
    unit("kg/l", 1e3),
    unit("lb/in3", POUND / (INCH * INCH * INCH)),
    unit("lb/ft3", POUND / (1728.0 * INCH * INCH * INCH)),
];
const MASS: &[Unit] = &[
    unit("kg", 1.0),
    unit("g", 1e-3),
    unit("mg", 1e-6),
    unit("t", 1e3),
    unit("lb", POUND),
    unit("oz", POUND / 16.0),
];
const FORCE: &[Unit] = &[
    unit("N", 1.0),
    unit("kN", 1e3),
    unit("mN", 1e-3),
    unit("MN", 1e6),
    unit("lbf", POUND_FORCE),
];
const FREQUENCY: &[Unit] = &[
    unit("Hz", 1.0),
    unit("kHz", 1e3),
    unit("mHz", 1e-3),
    unit("MHz", 1e6),
    unit("1/s", 1.0),
];
const RATE: &[Unit] = &[
    unit("Hz", 1.0),
    unit("kHz", 1e3),
    unit("MHz", 1e6),
    unit("S/s", 1.0),
    unit("kS/s", 1e3),
    unit("samples/s", 1.0),
    unit("1/s", 1.0),
];
const TRANSLATIONAL_STIFFNESS: &[Unit] = &[
    unit("N/m", 1.0),
    unit("kN/m", 1e3),
    unit("MN/m", 1e6),
    unit("GN/m", 1e9),
    unit("N/mm", 1e3),
    unit("kN/mm", 1e6),
    unit("N/um", 1e6),
    unit("lbf/in", POUND_FORCE / INCH),
];
const ROTATIONAL_STIFFNESS: &[Unit] = &[
    unit("Nm/rad", 1.0),
    unit("kNm/rad", 1e3),
    unit("MNm/rad", 1e6),
    unit("Nmm/rad", 1e-3),
    unit("Nm/deg", 1.0 / DEGREE),
    unit("Nm", 1.0),
    unit("kNm", 1e3),
    unit("lbfin/rad", POUND_FORCE * INCH),
];
const COUPLING_STIFFNESS: &[Unit] = &[
    unit("N/rad", 1.0),
    unit("kN/rad", 1e3),
    unit("MN/rad", 1e6),
    unit("N", 1.0),
    unit("kN", 1e3),
    unit("lbf/rad", POUND_FORCE),
];
const RATIO: &[Unit] = &[unit("%", 1e-2), unit("ppm", 1e-6)];
const TORQUE: &[Unit] = &[
    unit("Nm", 1.0),
    unit("kNm", 1e3),
    unit("mNm", 1e-3),
    unit("Nmm", 1e-3),
    unit("Ncm", 1e-2),
    unit("lbfin", POUND_FORCE * INCH),
    unit("lbfft", POUND_FORCE * 12.0 * INCH),
];
const TEMPERATURE: &[Unit] = &[
    unit("degC", 1.0),
    unit("C", 1.0),
    Unit {
        symbol: "K",
        factor: 1.0,
        offset: -273.15,
    },
    Unit {
        symbol: "degF",
        factor: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
    Unit {
        symbol: "F",
        factor: 5.0 / 9.0,
        offset: -160.0 / 9.0,
    },
];
const ACCELERATION: &[Unit] = &[
    unit("m/s2", 1.0),
    unit("g", STANDARD_GRAVITY),
    unit("mg", 1e-3 * STANDARD_GRAVITY),
    unit("mm/s2", 1e-3),
    unit("cm/s2", 1e-2),
    unit("ft/s2", 12.0 * INCH),
];
const VELOCITY: &[Unit] = &[
    unit("m/s", 1.0),
    unit("mm/s", 1e-3),
    unit("cm/s", 1e-2),
    unit("um/s", 1e-6),
    unit("km/h", 1.0 / 3.6),
    unit("in/s", INCH),
];
const ACCELERATION_SENSITIVITY: &[Unit] = &[
    unit("V/(m/s2)", 1.0),
    unit("mV/g", 1e-3 / STANDARD_GRAVITY),
    unit("V/g", 1.0 / STANDARD_GRAVITY),
    unit("mV/(m/s2)", 1e-3),
    unit("mVs2/m", 1e-3),
    unit("Vs2/m", 1.0),
];
const VELOCITY_SENSITIVITY: &[Unit] = &[
    unit("V/(m/s)", 1.0),
    unit("mV/(m/s)", 1e-3),
    unit("mV/(mm/s)", 1.0),
    unit("V/(mm/s)", 1e3),
    unit("mVs/m", 1e-3),
    unit("Vs/m", 1.0),
];
const DISPLACEMENT_SENSITIVITY: &[Unit] = &[
    unit("V/m", 1.0),
    unit("V/mm", 1e3),
    unit("mV/mm", 1.0),
    unit("mV/um", 1e3),
    unit("V/um", 1e6),
];
const PRESSURE_SENSITIVITY: &[Unit] = &[unit("V/Pa", 1.0), unit("mV/Pa", 1e-3)];
const FORCE_SENSITIVITY: &[Unit] = &[
    unit("V/N", 1.0),
    unit("mV/N", 1e-3),
    unit("uV/N", 1e-6),
    unit("mV/lbf", 1e-3 / POUND_FORCE),
];

/// The units of a dimension, SI unit first.
pub(super) fn units_of(dimension: Dimension) -> &'static [Unit] {
    match dimension {
        Dimension::Length => LENGTH,
        Dimension::Pressure => PRESSURE,
        Dimension::Density => DENSITY,
        Dimension::Mass => MASS,
        Dimension::Force => FORCE,
        Dimension::Frequency => FREQUENCY,
        Dimension::Rate => RATE,
        Dimension::TranslationalStiffness => TRANSLATIONAL_STIFFNESS,
        Dimension::RotationalStiffness => ROTATIONAL_STIFFNESS,
        Dimension::CouplingStiffness => COUPLING_STIFFNESS,
        Dimension::Ratio => RATIO,
        Dimension::Torque => TORQUE,
        Dimension::Temperature => TEMPERATURE,
        Dimension::Acceleration => ACCELERATION,
        Dimension::Velocity => VELOCITY,
        Dimension::AccelerationSensitivity => ACCELERATION_SENSITIVITY,
        Dimension::VelocitySensitivity => VELOCITY_SENSITIVITY,
        Dimension::DisplacementSensitivity => DISPLACEMENT_SENSITIVITY,
        Dimension::PressureSensitivity => PRESSURE_SENSITIVITY,
        Dimension::ForceSensitivity => FORCE_SENSITIVITY,
    }
}
