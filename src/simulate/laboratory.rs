//! The laboratory that carries out a test, and the reasons for which a described test cannot be simulated.
//!
//! The defaults are those of a decent laboratory: calibrated sensors glued or screwed on, a 24-bit recorder
//! with an anti-alias filter, a practised hand.

use super::hammer::HammerSettings;
use serde::Serialize;
use tapjoint_beam::StructureError;
use tapjoint_beam::effects::SetUpError;
use tapjoint_signal::recording::RecordingError;

/// Everything about the laboratory.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Laboratory {
    /// The hammer and the hand that swings it.
    pub hammer: HammerSettings,
    /// The sensors and how they are fastened.
    pub sensors: SensorSettings,
    /// The recorder.
    pub recorder: RecorderSettings,
    /// Damping and suspension of the structure.
    pub specimen: SpecimenSettings,
}

impl Laboratory {
    /// Nothing that disturbs: no noise, errors or scatter, and no filter but the one against aliasing,
    /// without which modes beyond half the rate would appear below it.
    pub fn ideal() -> Self {
        Self {
            hammer: HammerSettings {
                level_scatter: 0.0,
                length_scatter: 0.0,
                place_scatter: 0.0,
                ..HammerSettings::default()
            },
            sensors: SensorSettings {
                noise: 0.0,
                sensitivity_error: 0.0,
                ac_coupling: 0.0,
                mounting_resonance: 0.0,
            },
            recorder: RecorderSettings {
                hum: 0.0,
                drift: 0.0,
                offset: 0.0,
                clock_error: 0.0,
                ..RecorderSettings::default()
            },
            specimen: SpecimenSettings::default(),
        }
    }
}

/// The sensors and how they are fastened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorSettings {
    /// Noise of hammer and sensors, in multiples of that of good ones ([`crate::Signal::good_noise`]). 1.
    pub noise: f64,
    /// Error of each sensor's and the hammer's sensitivity (1, standard deviation). 0.01: as calibrated.
    pub sensitivity_error: f64,
    /// Corner (Hz) of the high-pass that couples the signals; 0 = none. 0.5.
    pub ac_coupling: f64,
    /// Resonance (Hz) of an accelerometer on its mounting; 0 = none. 18 kHz: 24 g on wax or a thin
    /// glue line.
    pub mounting_resonance: f64,
}

impl Default for SensorSettings {
    fn default() -> Self {
        Self {
            noise: 1.0,
            sensitivity_error: 0.01,
            ac_coupling: 0.5,
            mounting_resonance: 18e3,
        }
    }
}

/// Anti-alias filter of the recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AntiAlias {
    /// As in sigma-delta converters: linear phase, flat to rate/2.56, 110 dB down beyond its mirror.
    On,
    /// Samples are taken as they are.
    Off,
}

/// The recorder. What is relative refers to a channel's full scale.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecorderSettings {
    /// Sample rate (Hz); `None` = the lowest usual one that covers the band.
    pub sample_rate: Option<u32>,
    /// Bits of a sample: 16, 24, or 32 for floating point. 24.
    pub bits: u16,
    /// Anti-alias filter. On.
    pub anti_alias: AntiAlias,
    /// Frequency of the mains (Hz). 50.
    pub mains: f64,
    /// Amplitude of mains hum (1); its third harmonic has 30 % of that. 1e-6.
    pub hum: f64,
    /// Slow drift of the zero (1, standard deviation). 1e-6.
    pub drift: f64,
    /// Offset of the zero (1, standard deviation). 1e-5.
    pub offset: f64,
    /// Relative error of the clock: positive = its seconds are too long, frequencies read high.
    /// 5e-6: a quartz.
    pub clock_error: f64,
}

impl Default for RecorderSettings {
    fn default() -> Self {
        Self {
            sample_rate: None,
            bits: 24,
            anti_alias: AntiAlias::On,
            mains: 50.0,
            hum: 1e-6,
            drift: 1e-6,
            offset: 1e-5,
            clock_error: 5e-6,
        }
    }
}

/// Damping of the structure beside the joint's own loss, and the suspension of a free one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpecimenSettings {
    /// Damping.
    pub damping: Damping,
    /// Natural frequencies (Hz) of a free or lap-jointed beam on its suspension, up and down and
    /// rocking; `None` = no rigid-body motion at all. 1.5 and 2: rubber bands.
    pub suspension: Option<[f64; 2]>,
}

impl Default for SpecimenSettings {
    fn default() -> Self {
        Self {
            damping: Damping::Modal(vec![0.004, 0.003, 0.0025, 0.002]),
            suspension: Some([1.5, 2.0]),
        }
    }
}

/// Damping of the structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Damping {
    /// Damping ratio of each mode, the last one for all beyond. 0.4, 0.3, 0.25, then 0.2 %: a bolted
    /// steel beam.
    Modal(Vec<f64>),
    /// In proportion to mass and stiffness: ratio = mass/(2 omega) + stiffness omega/2.
    Rayleigh {
        /// Factor of the mass matrix (1/s).
        mass: f64,
        /// Factor of the stiffness matrix (s).
        stiffness: f64,
    },
}

impl Damping {
    /// Damping ratio of the mode with this index (0-based) and natural frequency (Hz).
    pub fn ratio(&self, index: usize, frequency: f64) -> f64 {
        match self {
            Self::Modal(ratios) => {
                let ratio = ratios.get(index).or(ratios.last());
                ratio.copied().unwrap_or(0.0)
            }
            Self::Rayleigh { mass, stiffness } => {
                let omega = std::f64::consts::TAU * frequency;
                0.5 * (mass / omega + stiffness * omega)
            }
        }
    }
}

/// Reason for which a described test cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// There is no recording to make, or no sensor to make it with.
    #[error("there is no {0}")]
    Nothing(&'static str),
    /// A recording that cannot be made.
    #[error("line {line}: {file}{problem}")]
    Described {
        /// The recording.
        file: String,
        /// Its line in the description.
        line: usize,
        /// Cause and remedy, in words that continue the sentence.
        problem: &'static str,
    },
    /// A sensor that cannot be simulated.
    #[error("sensor {name}: {problem}")]
    Sensor {
        /// The sensor.
        name: String,
        /// Cause and remedy.
        problem: &'static str,
    },
    /// The joint's stiffness is not given.
    #[error(
        "the joint's stiffness is not given: {missing} missing; add {keys} to [joint], or give --kx and --ky"
    )]
    NoJoint {
        /// The springs that are missing.
        missing: &'static str,
        /// Keys to add.
        keys: &'static str,
    },
    /// The effect `resolution`: a bias of reading, which no recording contains.
    #[error(
        "`resolution` is a bias of reading frequencies, which no recording contains; plant it in [measured]"
    )]
    Resolution,
    /// An effect at a place on a beam whose clamp is moved.
    #[error(
        "`{id}` sits at a place on the beam, and a [[recording]] with `length` moves the clamp from which places count; \
         leave the effect or the recordings with `length` out"
    )]
    PlaceOfLengths {
        /// The effect.
        id: &'static str,
    },
    /// An effect that acts on sensors of unknown mass alone.
    #[error(
        "`sensor-mass` is the mass of sensors that the description does not state, and it states that of every sensor; \
         remove `mass` from the [[sensor]] that shall weigh more than is known"
    )]
    NothingToWeigh,
    /// A joint that gives where the description does not call it rigid.
    #[error(
        "`joint-compliance`: {parameter} is {value}, but [joint] has no `{key} = \"rigid\"`; a fitted stiffness would hold \
         the compliance; write `{key} = \"rigid\"` in [joint] and leave --kx and --ky out, or leave the effect out"
    )]
    NotRigid {
        /// The parameter of the effect.
        parameter: &'static str,
        /// Its value (1).
        value: f64,
        /// Key of the stiffness in the description.
        key: &'static str,
    },
    /// The loss of a mass that the description does not name.
    #[error("`lost-mass`: nothing that weighs is named \"{item}\"; the description names: {known}")]
    NoItem {
        /// The name given.
        item: String,
        /// Sensors and fastened masses with a name and a mass.
        known: String,
    },
    /// A change without which the natural frequencies are the same.
    #[error(
        "`{change}` (change {number}) changes no natural frequency; give it a larger size, or an item that weighs and that no \
         other change takes away, or leave it out"
    )]
    NoMove {
        /// Name of the change.
        change: &'static str,
        /// Its number among the changes, from 1.
        number: usize,
    },
    /// An axial load that changes on a beam that nothing holds.
    #[error(
        "`axial-load`: nothing holds the axial load of a free beam or of a lap joint, so that it cannot change; plant it \
         on a cantilever, or choose another change"
    )]
    NoLoad,
    /// A change of a spring that the joint does not have.
    #[error(
        "`joint-change`: {key} cannot change, since the joint is rigid there or is none; leave it out, or describe a \
         finite stiffness"
    )]
    NoSpring {
        /// Key of the stiffness.
        key: &'static str,
    },
    /// A set-up that the test cannot have.
    #[error(transparent)]
    SetUp(#[from] SetUpError),
    /// A non-linear joint without a rotational spring.
    #[error(
        "`joint-nonlinearity` needs a joint that turns: its rotational stiffness is {stiffness} N m/rad, and must be positive and finite"
    )]
    NoRotation {
        /// The stiffness given.
        stiffness: f64,
    },
    /// The sample rate is too low for the band.
    #[error(
        "{file}: a sample rate of {rate} Hz reaches to {reach} Hz, and the band ends at {band} Hz; give at least {needed} Hz"
    )]
    RateTooLow {
        /// The recording.
        file: String,
        /// The rate (Hz).
        rate: u32,
        /// Highest frequency that it reaches to (Hz).
        reach: f64,
        /// End of the band (Hz).
        band: f64,
        /// Rate that is needed (Hz).
        needed: f64,
    },
    /// A setting of the laboratory outside its range.
    #[error("{quantity} is {value:?}, but must lie between {lowest} and {highest}")]
    Setting {
        /// Name of the number.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Least possible value.
        lowest: f64,
        /// Largest possible value.
        highest: f64,
    },
    /// The structure cannot exist.
    #[error("the structure cannot be simulated: {0}")]
    Structure(#[from] StructureError),
    /// A joint whose moment has its crest below the hardest tap's rotation.
    #[error(
        "joint-nonlinearity: ratio {ratio} with exponent {exponent} is past the crest of the joint's moment, \
         beyond which it would let go of the beam; allowed: {least:.3} and above"
    )]
    SoftensTooFar {
        /// Relative change of the secant at the hardest tap (1).
        ratio: f64,
        /// Power of the amplitude.
        exponent: f64,
        /// The least ratio that can be simulated (1).
        least: f64,
    },
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
