//! Parameters of the effects: their ranges and typical sizes.

use super::catalogue::EffectId;

/// How the size of a parameter is best divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterScale {
    /// Both signs, or a place: in equal steps.
    Linear,
    /// Sizes above 0: in equal factors.
    Log,
}

/// Physical dimension of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// (1)
    None,
    /// (kg)
    Mass,
    /// (kg m2)
    Inertia,
    /// (N/m)
    Stiffness,
    /// (Hz)
    Frequency,
    /// (m)
    Length,
    /// (N)
    Force,
}

impl Dimension {
    /// Its SI unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Mass => "kg",
            Self::Inertia => "kg m2",
            Self::Stiffness => "N/m",
            Self::Frequency => "Hz",
            Self::Length => "m",
            Self::Force => "N",
        }
    }
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfo {
    /// Its name.
    pub name: &'static str,
    /// Its dimension.
    pub dimension: Dimension,
    /// What it is.
    pub meaning: &'static str,
    /// Lowest possible value (SI).
    pub lowest: f64,
    /// Highest possible value (SI); of a position the end of the beam limits it further.
    pub highest: f64,
    /// How to divide its range.
    pub scale: ParameterScale,
    /// Value where none is given (SI): typical in size. `None` = it must be given.
    pub typical: Option<f64>,
}

use Dimension as D;
use ParameterScale::{Linear, Log};

const fn parameter(
    (name, dimension, meaning): (&'static str, Dimension, &'static str),
    (lowest, highest): (f64, f64),
    scale: ParameterScale,
    typical: Option<f64>,
) -> ParameterInfo {
    ParameterInfo {
        name,
        dimension,
        meaning,
        lowest,
        highest,
        scale,
        typical,
    }
}

/// Limits of sizes are those of the kind of structure that is tapped by hand: beams of decimetres,
/// first frequencies of some tens of hertz.
const POSITION: ParameterInfo = parameter(
    ("position", D::Length, "distance from the left end"),
    (0.0, f64::INFINITY),
    Linear,
    None,
);
const fn relative(meaning: &'static str, most: f64, typical: f64) -> ParameterInfo {
    parameter(
        ("relative", D::None, meaning),
        (-most, most),
        Linear,
        Some(typical),
    )
}

const SENSOR_MASS: &[ParameterInfo] = &[parameter(
    (
        "mass",
        D::Mass,
        "mass of each accelerometer that the model leaves out",
    ),
    (0.0, 1.0),
    Log,
    Some(0.01),
)];
const SENSOR_CABLE: &[ParameterInfo] = &[parameter(
    (
        "stiffness",
        D::Stiffness,
        "stiffness to the ground at each sensor",
    ),
    (0.0, 1e5),
    Log,
    Some(50.0),
)];
const CROSS_COUPLING: &[ParameterInfo] = &[parameter(
    ("coupling", D::None, "sqrt(Kx Ky)/Kz of the joint"),
    (-0.99, 0.99),
    Linear,
    Some(-0.1),
)];
const JOINT_MASS: &[ParameterInfo] = &[
    parameter(
        ("mass", D::Mass, "mass moving with the joint"),
        (0.0, 10.0),
        Log,
        Some(0.01),
    ),
    parameter(
        (
            "inertia",
            D::Inertia,
            "moment of inertia turning with the joint",
        ),
        (0.0, 1.0),
        Log,
        Some(0.0),
    ),
];
const JOINT_NONLINEARITY: &[ParameterInfo] = &[
    parameter(
        (
            "ratio",
            D::None,
            "relative change of the rotational stiffness at the hardest tap",
        ),
        (-0.95, 1.0),
        Linear,
        Some(-0.05),
    ),
    parameter(
        (
            "exponent",
            D::None,
            "power of the amplitude with which the stiffness changes",
        ),
        (0.1, 4.0),
        Linear,
        Some(1.0),
    ),
];
const JOINT_DAMPING: &[ParameterInfo] = &[parameter(
    ("loss_factor", D::None, "loss factor of the joint's springs"),
    (0.0, 1.0),
    Log,
    Some(0.02),
)];
const JOINT_DRIFT: &[ParameterInfo] = &[parameter(
    (
        "std",
        D::None,
        "standard deviation of the relative stiffness between visits",
    ),
    (0.0, 0.5),
    Log,
    Some(0.01),
)];
const FIXTURE: &[ParameterInfo] = &[
    parameter(
        (
            "frequency",
            D::Frequency,
            "natural frequency of the base alone",
        ),
        (1.0, 1e5),
        Log,
        Some(300.0),
    ),
    parameter(
        (
            "ratio",
            D::None,
            "rotational stiffness of the joint over that of the base",
        ),
        (0.0, 1.0),
        Log,
        Some(0.03),
    ),
];
const MODULUS: &[ParameterInfo] = &[relative("relative change of the modulus", 0.5, 0.02)];
const LENGTH: &[ParameterInfo] = &[relative("relative change of the length", 0.2, 0.005)];
const TIMEBASE: &[ParameterInfo] = &[relative("relative change of all frequencies", 0.2, 0.005)];
const ADDED_MASS: &[ParameterInfo] = &[
    parameter(
        ("mass", D::Mass, "mass on the beam"),
        // As much as a description takes for fastened: what was known can be written as an effect.
        (0.0, 1e3),
        Log,
        Some(0.01),
    ),
    POSITION,
];
const LOCAL_CRACK: &[ParameterInfo] = &[
    parameter(
        (
            "compliance",
            D::None,
            "rotational compliance of the crack times E I/L",
        ),
        (0.0, 10.0),
        Log,
        Some(0.02),
    ),
    POSITION,
];
const AXIAL_LOAD: &[ParameterInfo] = &[parameter(
    ("force", D::Force, "axial force, tension positive"),
    (-1e7, 1e7),
    Linear,
    Some(50.0),
)];
const SHEAR_ROTARY: &[ParameterInfo] = &[parameter(
    (
        "factor",
        D::None,
        "share of shear and rotary inertia, 1 = the full effect",
    ),
    (0.0, 10.0),
    Linear,
    Some(1.0),
)];
const RESOLUTION: &[ParameterInfo] = &[parameter(
    (
        "offset",
        D::Frequency,
        "constant bias of every frequency read",
    ),
    (-1e4, 1e4),
    Linear,
    Some(0.25),
)];

impl EffectId {
    /// Its parameters, the one that measures its size first.
    pub fn parameters(self) -> &'static [ParameterInfo] {
        match self {
            Self::SensorMass => SENSOR_MASS,
            Self::SensorCable => SENSOR_CABLE,
            Self::CrossCoupling => CROSS_COUPLING,
            Self::JointMass => JOINT_MASS,
            Self::JointNonlinearity => JOINT_NONLINEARITY,
            Self::JointDamping => JOINT_DAMPING,
            Self::JointDrift => JOINT_DRIFT,
            Self::Fixture => FIXTURE,
            Self::Modulus => MODULUS,
            Self::Length => LENGTH,
            Self::Timebase => TIMEBASE,
            Self::AddedMass => ADDED_MASS,
            Self::LocalCrack => LOCAL_CRACK,
            Self::AxialLoad => AXIAL_LOAD,
            Self::ShearRotary => SHEAR_ROTARY,
            Self::Resolution => RESOLUTION,
        }
    }

    /// The parameters that measure its size: with all of them 0 the effect is absent.
    pub fn size_parameters(self) -> &'static [&'static str] {
        match self {
            Self::JointMass => &["mass", "inertia"],
            Self::Fixture => &["ratio"],
            Self::SensorMass | Self::AddedMass => &["mass"],
            Self::SensorCable => &["stiffness"],
            Self::CrossCoupling => &["coupling"],
            Self::JointNonlinearity => &["ratio"],
            Self::JointDamping => &["loss_factor"],
            Self::JointDrift => &["std"],
            Self::Modulus | Self::Length | Self::Timebase => &["relative"],
            Self::LocalCrack => &["compliance"],
            Self::AxialLoad => &["force"],
            Self::ShearRotary => &["factor"],
            Self::Resolution => &["offset"],
        }
    }
}
