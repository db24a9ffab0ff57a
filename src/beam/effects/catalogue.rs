//! Names, places and groups of the effects.

use super::{EffectError, nearest_name};
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
    /// A flexible base with a mode of its own.
    Fixture,
    /// The beam's modulus differs from the description.
    Modulus,
    /// The beam's length differs from the description.
    Length,
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

/// Effects that most data cannot tell apart share a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Group {
    /// One effect alone.
    Own(EffectId),
    /// Modulus, length, time base: one common factor on all frequencies.
    Scale,
    /// Axial load and reading bias: nearly the same number of Hz on every frequency.
    Offset,
}

impl Group {
    /// As results name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own(id) => id.name(),
            Self::Scale => "scale",
            Self::Offset => "offset",
        }
    }
}

impl EffectId {
    /// All effects.
    pub const ALL: [Self; 16] = [
        Self::SensorMass,
        Self::SensorCable,
        Self::CrossCoupling,
        Self::JointMass,
        Self::JointNonlinearity,
        Self::JointDamping,
        Self::JointDrift,
        Self::Fixture,
        Self::Modulus,
        Self::Length,
        Self::Timebase,
        Self::AddedMass,
        Self::LocalCrack,
        Self::AxialLoad,
        Self::ShearRotary,
        Self::Resolution,
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
            Self::Fixture => "fixture",
            Self::Modulus => "modulus",
            Self::Length => "length",
            Self::Timebase => "timebase",
            Self::AddedMass => "added-mass",
            Self::LocalCrack => "local-crack",
            Self::AxialLoad => "axial-load",
            Self::ShearRotary => "shear-rotary",
            Self::Resolution => "resolution",
        }
    }

    /// The effect of that name.
    ///
    /// # Errors
    /// [`EffectError::UnknownEffect`], with the nearest name.
    pub fn parse(name: &str) -> Result<Self, EffectError> {
        let known = || Self::ALL.into_iter().map(Self::name);
        Self::ALL
            .into_iter()
            .find(|id| id.name() == name)
            .ok_or_else(|| EffectError::UnknownEffect {
                name: name.to_owned(),
                nearest: nearest_name(name, known()),
                known: known().collect::<Vec<_>>().join(", "),
            })
    }

    /// Where it sits.
    pub fn place(self) -> Place {
        match self {
            Self::SensorMass | Self::SensorCable => Place::Sensor,
            Self::CrossCoupling
            | Self::JointMass
            | Self::JointNonlinearity
            | Self::JointDamping
            | Self::JointDrift => Place::Joint,
            Self::Fixture => Place::Fixture,
            Self::Modulus
            | Self::Length
            | Self::AddedMass
            | Self::LocalCrack
            | Self::AxialLoad
            | Self::ShearRotary => Place::Body,
            Self::Timebase | Self::Resolution => Place::Acquisition,
        }
    }

    /// Its group.
    pub fn group(self) -> Group {
        match self {
            Self::Modulus | Self::Length | Self::Timebase => Group::Scale,
            Self::AxialLoad | Self::Resolution => Group::Offset,
            _ => Group::Own(self),
        }
    }

    /// What it is, in half a sentence.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::SensorMass => "the accelerometers load the beam with their mass",
            Self::SensorCable => "cables or suspension hold the beam at the sensors",
            Self::CrossCoupling => "a force on the joint turns it, and a moment moves it",
            Self::JointMass => "bolts, washers or a lap's overlap move with the joint",
            Self::JointNonlinearity => "stiffness and damping of the joint depend on the tap level",
            Self::JointDamping => "the joint dissipates more than the model says",
            Self::JointDrift => "the joint's stiffness differs between visits",
            Self::Fixture => "the base under the joint gives and has a mode of its own",
            Self::Modulus => "the beam is stiffer or softer than described",
            Self::Length => "the beam is longer or shorter than described",
            Self::Timebase => "the recorder's clock is off",
            Self::AddedMass => "there is a mass on the beam",
            Self::LocalCrack => "the beam bends more easily at one place",
            Self::AxialLoad => "preload or gravity pulls or presses along the beam",
            Self::ShearRotary => "shear deformation and rotary inertia count",
            Self::Resolution => "frequencies are read with a constant bias",
        }
    }
}
