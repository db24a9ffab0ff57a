//! Names, places and groups of the effects.

use super::{EffectError, nearest_name};
use EffectDimension as D;
use ParameterScale::{Linear, Log};
use schemars::JsonSchema;
use serde::Serialize;

/// An effect that a model may be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EffectId {
    /// Mass of an accelerometer.
    SensorMass,
    /// Stiffness of a sensor's cable or suspension.
    SensorCable,
    /// The joint's cross compliance 1/Kz.
    CrossCoupling,
    /// Mass or inertia that moves with the joint.
    JointMass,
    /// Stiffness and damping of the joint depend on the tap level.
    JointNonlinearity,
    /// Dissipation in the joint.
    JointDamping,
    /// The joint's stiffness differs between visits.
    JointDrift,
    /// A joint that is described as rigid gives.
    JointCompliance,
    /// A flexible base with a mode of its own.
    Fixture,
    /// The beam's modulus differs from the description.
    Modulus,
    /// The beam's length differs from the description.
    Length,
    /// The beam's density differs from the description.
    Density,
    /// The beam's thickness differs from the description.
    Thickness,
    /// The recorder's clock runs fast or slow.
    Timebase,
    /// A mass on the beam.
    AddedMass,
    /// A local loss of bending stiffness.
    LocalCrack,
    /// Preload or gravity along the beam.
    AxialLoad,
    /// Shear and rotary inertia.
    ShearRotary,
    /// A constant bias of the reading of frequencies.
    Resolution,
    /// A sensor is not where the description has it.
    SensorPosition,
    /// A sensor points the other way.
    SensorPolarity,
    /// The channels of two sensors are interchanged.
    SensorSwap,
    /// The calibration of a sensor is wrong.
    SensorScale,
    /// The hammer does not strike where the description has it.
    TapPosition,
}

/// Where an effect sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Place {
    /// In the joint.
    Joint,
    /// In what holds the joint.
    Fixture,
    /// At a sensor.
    Sensor,
    /// In the beam.
    Body,
    /// In how the signals are recorded and read.
    Acquisition,
}

impl Place {
    /// All places.
    pub const ALL: [Self; 5] = [
        Self::Joint,
        Self::Fixture,
        Self::Sensor,
        Self::Body,
        Self::Acquisition,
    ];

    /// As results name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Fixture => "fixture",
            Self::Sensor => "sensor",
            Self::Body => "body",
            Self::Acquisition => "acquisition",
        }
    }
}

/// Group of effects that most data cannot distinguish.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Group {
    /// One effect alone.
    Own(EffectId),
    /// Modulus, length, density, thickness, time base: one common factor on all frequencies.
    Scale,
    /// Axial load and reading bias: nearly the same number of Hz on every frequency.
    Offset,
    /// Sensors and hammer are not as described: shapes are wrong, frequencies hardly.
    SetUp,
}

impl Group {
    /// As results name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own(id) => id.name(),
            Self::Scale => "scale",
            Self::Offset => "offset",
            Self::SetUp => "set-up",
        }
    }
}

impl EffectId {
    /// All effects.
    pub const ALL: [Self; 24] = [
        Self::SensorMass,
        Self::SensorCable,
        Self::CrossCoupling,
        Self::JointMass,
        Self::JointNonlinearity,
        Self::JointDamping,
        Self::JointDrift,
        Self::JointCompliance,
        Self::Fixture,
        Self::Modulus,
        Self::Length,
        Self::Density,
        Self::Thickness,
        Self::Timebase,
        Self::AddedMass,
        Self::LocalCrack,
        Self::AxialLoad,
        Self::ShearRotary,
        Self::Resolution,
        Self::SensorPosition,
        Self::SensorPolarity,
        Self::SensorSwap,
        Self::SensorScale,
        Self::TapPosition,
    ];

    /// As results and the command line name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::SensorMass => "sensor-mass",
            Self::SensorCable => "sensor-cable",
            Self::CrossCoupling => "cross-coupling",
            Self::JointMass => "joint-mass",
            Self::JointNonlinearity => "joint-nonlinearity",
            Self::JointDamping => "joint-damping",
            Self::JointDrift => "joint-drift",
            Self::JointCompliance => "joint-compliance",
            Self::Fixture => "fixture",
            Self::Modulus => "modulus",
            Self::Length => "length",
            Self::Density => "density",
            Self::Thickness => "thickness",
            Self::Timebase => "timebase",
            Self::AddedMass => "added-mass",
            Self::LocalCrack => "local-crack",
            Self::AxialLoad => "axial-load",
            Self::ShearRotary => "shear-rotary",
            Self::Resolution => "resolution",
            Self::SensorPosition => "sensor-position",
            Self::SensorPolarity => "sensor-polarity",
            Self::SensorSwap => "sensor-swap",
            Self::SensorScale => "sensor-scale",
            Self::TapPosition => "tap-position",
        }
    }

    /// The effect of that name.
    ///
    /// # Errors
    /// [`EffectError::UnknownEffect`], with the nearest name.
    pub fn parse(name: &str) -> Result<Self, EffectError> {
        let known = Self::ALL.map(Self::name);
        Self::ALL
            .into_iter()
            .find(|id| id.name() == name)
            .ok_or_else(|| EffectError::UnknownEffect {
                name: name.to_owned(),
                nearest: nearest_name(name, &known),
                known: known.join(", "),
            })
    }

    /// Returns the place where it sits.
    pub fn place(self) -> Place {
        match self {
            Self::SensorMass | Self::SensorCable => Place::Sensor,
            Self::CrossCoupling
            | Self::JointMass
            | Self::JointNonlinearity
            | Self::JointDamping
            | Self::JointDrift
            | Self::JointCompliance => Place::Joint,
            Self::Fixture => Place::Fixture,
            Self::Modulus
            | Self::Length
            | Self::Density
            | Self::Thickness
            | Self::AddedMass
            | Self::LocalCrack
            | Self::AxialLoad
            | Self::ShearRotary => Place::Body,
            Self::Timebase
            | Self::Resolution
            | Self::SensorPosition
            | Self::SensorPolarity
            | Self::SensorSwap
            | Self::SensorScale
            | Self::TapPosition => Place::Acquisition,
        }
    }

    /// Returns its group.
    pub fn group(self) -> Group {
        match self {
            Self::Modulus | Self::Length | Self::Density | Self::Thickness | Self::Timebase => {
                Group::Scale
            }
            Self::AxialLoad | Self::Resolution => Group::Offset,
            Self::SensorPosition
            | Self::SensorPolarity
            | Self::SensorSwap
            | Self::SensorScale
            | Self::TapPosition => Group::SetUp,
            _ => Group::Own(self),
        }
    }

    /// Describes it in half a sentence.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::SensorMass => "the accelerometers load the beam with their mass",
            Self::SensorCable => "cables or suspension hold the beam at the sensors",
            Self::CrossCoupling => "a force on the joint turns it, and a moment moves it",
            Self::JointMass => "bolts, washers or a lap's overlap move with the joint",
            Self::JointNonlinearity => "stiffness and damping of the joint depend on the tap level",
            Self::JointDamping => "the joint dissipates more than the model says",
            Self::JointDrift => "the joint's stiffness differs between visits",
            Self::JointCompliance => "the joint gives, although it is described as rigid",
            Self::Fixture => "the base under the joint gives and has a mode of its own",
            Self::Modulus => "the beam is stiffer or softer than described",
            Self::Length => "the beam is longer or shorter than described",
            Self::Density => "the beam is heavier or lighter than described",
            Self::Thickness => "the beam is thicker or thinner than described",
            Self::Timebase => "the recorder's clock is off",
            Self::AddedMass => "there is a mass on the beam",
            Self::LocalCrack => "the beam bends more easily at one place",
            Self::AxialLoad => "preload or gravity pulls or presses along the beam",
            Self::ShearRotary => "shear deformation and rotary inertia count",
            Self::Resolution => "frequencies are read with a constant bias",
            Self::SensorPosition => "a sensor is not where the description has it",
            Self::SensorPolarity => "a sensor points the other way",
            Self::SensorSwap => "the channels of two sensors are interchanged",
            Self::SensorScale => "the calibration of a sensor is wrong",
            Self::TapPosition => "the hammer does not strike where the description has it",
        }
    }
}

// Parameters of the effects: their ranges and typical sizes.

/// Division of a parameter's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterScale {
    /// Both signs, or a place: in equal steps.
    Linear,
    /// Sizes above 0: in equal factors.
    Log,
}

/// Physical dimension of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffectDimension {
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

impl EffectDimension {
    /// Returns its SI unit; empty for a pure number.
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
    pub dimension: EffectDimension,
    /// Description.
    pub meaning: &'static str,
    /// Lowest possible value (SI).
    pub lowest: f64,
    /// Highest possible value (SI); of a position the end of the beam limits it further.
    pub highest: f64,
    /// Division of its range.
    pub scale: ParameterScale,
    /// Value where none is given (SI): typical in size. `None` = it must be given.
    pub typical: Option<f64>,
}

/// Returns a parameter that is a size, from 0 to `highest`.
const fn size(
    name: &'static str,
    dimension: EffectDimension,
    meaning: &'static str,
    highest: f64,
    typical: f64,
) -> ParameterInfo {
    ParameterInfo {
        name,
        dimension,
        meaning,
        lowest: 0.0,
        highest,
        scale: Log,
        typical: Some(typical),
    }
}

/// Returns a parameter that may have either sign, from -`most` to `most`.
const fn signed(
    name: &'static str,
    dimension: EffectDimension,
    meaning: &'static str,
    most: f64,
    typical: f64,
) -> ParameterInfo {
    ParameterInfo {
        lowest: -most,
        scale: Linear,
        ..size(name, dimension, meaning, most, typical)
    }
}

// Limits of sizes are those of the kind of structure that is tapped by hand: beams of decimetres,
// first frequencies of some tens of hertz.
const POSITION: ParameterInfo = ParameterInfo {
    scale: Linear,
    typical: None,
    ..size(
        "position",
        D::Length,
        "distance from the left end",
        f64::INFINITY,
        0.0,
    )
};
const SENSOR_MASS: &[ParameterInfo] = &[size(
    "mass",
    D::Mass,
    "mass of each accelerometer that the model leaves out",
    1.0,
    0.01,
)];
const SENSOR_CABLE: &[ParameterInfo] = &[size(
    "stiffness",
    D::Stiffness,
    "stiffness to the ground at each sensor",
    1e5,
    50.0,
)];
const CROSS_COUPLING: &[ParameterInfo] = &[signed(
    "coupling",
    D::None,
    "sqrt(Kx Ky)/Kz of the joint",
    0.99,
    -0.1,
)];
const JOINT_MASS: &[ParameterInfo] = &[
    size("mass", D::Mass, "mass moving with the joint", 10.0, 0.01),
    size(
        "inertia",
        D::Inertia,
        "moment of inertia turning with the joint",
        1.0,
        0.0,
    ),
];
const JOINT_NONLINEARITY: &[ParameterInfo] = &[
    ParameterInfo {
        lowest: -0.95,
        ..signed(
            "ratio",
            D::None,
            "relative change of the rotational stiffness at the hardest tap",
            1.0,
            -0.05,
        )
    },
    ParameterInfo {
        lowest: 0.1,
        ..signed(
            "exponent",
            D::None,
            "power of the amplitude with which the stiffness changes",
            4.0,
            1.0,
        )
    },
];
const JOINT_DAMPING: &[ParameterInfo] = &[size(
    "loss_factor",
    D::None,
    "loss factor of the joint's springs",
    1.0,
    0.02,
)];
const JOINT_DRIFT: &[ParameterInfo] = &[size(
    "std",
    D::None,
    "standard deviation of the relative stiffness between visits",
    0.5,
    0.01,
)];
const JOINT_COMPLIANCE: &[ParameterInfo] = &[
    size(
        "rotation",
        D::None,
        "E I/L of the beam over the rotational stiffness in series with the joint",
        10.0,
        0.02,
    ),
    size(
        "translation",
        D::None,
        "E I/L^3 of the beam over the translational stiffness in series with the joint",
        10.0,
        0.0,
    ),
];
const FIXTURE: &[ParameterInfo] = &[
    ParameterInfo {
        lowest: 1.0,
        ..size(
            "frequency",
            D::Frequency,
            "natural frequency of the base alone",
            1e5,
            300.0,
        )
    },
    size(
        "ratio",
        D::None,
        "rotational stiffness of the joint over that of the base",
        1.0,
        0.03,
    ),
];
const MODULUS: &[ParameterInfo] = &[signed(
    "relative",
    D::None,
    "relative change of the modulus",
    0.5,
    0.02,
)];
const LENGTH: &[ParameterInfo] = &[signed(
    "relative",
    D::None,
    "relative change of the length",
    0.2,
    0.005,
)];
const DENSITY: &[ParameterInfo] = &[signed(
    "relative",
    D::None,
    "relative change of the density",
    0.5,
    0.02,
)];
const THICKNESS: &[ParameterInfo] = &[signed(
    "relative",
    D::None,
    "relative change of the thickness",
    0.5,
    0.01,
)];
const TIMEBASE: &[ParameterInfo] = &[signed(
    "relative",
    D::None,
    "relative change of all frequencies",
    0.2,
    0.005,
)];
const ADDED_MASS: &[ParameterInfo] = &[
    // As much as a description takes for fastened: what was known can be written as an effect.
    size("mass", D::Mass, "mass on the beam", 1e3, 0.01),
    POSITION,
];
const LOCAL_CRACK: &[ParameterInfo] = &[
    size(
        "compliance",
        D::None,
        "rotational compliance of the crack times E I/L",
        10.0,
        0.02,
    ),
    POSITION,
];
const AXIAL_LOAD: &[ParameterInfo] = &[signed(
    "force",
    D::Force,
    "axial force, tension positive",
    1e7,
    50.0,
)];
const SHEAR_ROTARY: &[ParameterInfo] = &[ParameterInfo {
    lowest: 0.0,
    ..signed(
        "factor",
        D::None,
        "share of shear and rotary inertia, 1 = the full effect",
        10.0,
        1.0,
    )
}];
const RESOLUTION: &[ParameterInfo] = &[signed(
    "offset",
    D::Frequency,
    "constant bias of every frequency read",
    1e4,
    0.25,
)];

/// Returns a parameter that counts things from `lowest`, which is usual.
const fn number(name: &'static str, meaning: &'static str, lowest: f64) -> ParameterInfo {
    ParameterInfo {
        lowest,
        scale: Linear,
        ..size(name, D::None, meaning, 1e4, lowest)
    }
}

const SENSOR: ParameterInfo = number("sensor", "number of the sensor in the description", 1.0);
const RECORDING: ParameterInfo = number(
    "recording",
    "recordings with the same place as this one, by number; 0 = all",
    0.0,
);
const SENSOR_POSITION: &[ParameterInfo] = &[
    signed(
        "offset",
        D::Length,
        "true less described position of the sensor",
        1e3,
        0.01,
    ),
    SENSOR,
    RECORDING,
];
const SENSOR_POLARITY: &[ParameterInfo] = &[SENSOR];
const SENSOR_SWAP: &[ParameterInfo] = &[
    SENSOR,
    ParameterInfo {
        typical: Some(2.0),
        ..number("other", "number of the other sensor", 1.0)
    },
];
const SENSOR_SCALE: &[ParameterInfo] = &[
    ParameterInfo {
        lowest: -0.99,
        ..signed(
            "relative",
            D::None,
            "relative change of the sensor's signal",
            100.0,
            0.1,
        )
    },
    number(
        "sensor",
        "number of the sensor in the description; 0 = all, as by the hammer's calibration",
        0.0,
    ),
];
const TAP_POSITION: &[ParameterInfo] = &[
    signed(
        "offset",
        D::Length,
        "true less described position of the taps",
        1e3,
        0.01,
    ),
    RECORDING,
];

impl EffectId {
    /// Returns its parameters. The first one measures its size, but for the fixture, for polarity and for a swap.
    pub fn parameters(self) -> &'static [ParameterInfo] {
        match self {
            Self::SensorMass => SENSOR_MASS,
            Self::SensorCable => SENSOR_CABLE,
            Self::CrossCoupling => CROSS_COUPLING,
            Self::JointMass => JOINT_MASS,
            Self::JointNonlinearity => JOINT_NONLINEARITY,
            Self::JointDamping => JOINT_DAMPING,
            Self::JointDrift => JOINT_DRIFT,
            Self::JointCompliance => JOINT_COMPLIANCE,
            Self::Fixture => FIXTURE,
            Self::Modulus => MODULUS,
            Self::Length => LENGTH,
            Self::Density => DENSITY,
            Self::Thickness => THICKNESS,
            Self::Timebase => TIMEBASE,
            Self::AddedMass => ADDED_MASS,
            Self::LocalCrack => LOCAL_CRACK,
            Self::AxialLoad => AXIAL_LOAD,
            Self::ShearRotary => SHEAR_ROTARY,
            Self::Resolution => RESOLUTION,
            Self::SensorPosition => SENSOR_POSITION,
            Self::SensorPolarity => SENSOR_POLARITY,
            Self::SensorSwap => SENSOR_SWAP,
            Self::SensorScale => SENSOR_SCALE,
            Self::TapPosition => TAP_POSITION,
        }
    }

    /// The parameters that measure its size: with all of them 0 the effect is absent. Empty for an effect that has no
    /// size.
    pub fn size_parameters(self) -> &'static [&'static str] {
        match self {
            Self::JointMass => &["mass", "inertia"],
            Self::JointCompliance => &["rotation", "translation"],
            Self::SensorPolarity | Self::SensorSwap => &[],
            Self::Fixture => &["ratio"],
            _ => std::slice::from_ref(&self.parameters()[0].name),
        }
    }
}
