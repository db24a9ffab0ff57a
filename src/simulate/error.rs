//! Why a described test cannot be simulated.

use tapjoint_beam::StructureError;
use tapjoint_signal::recording::RecordingError;

/// Why a described test cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// Nothing is to be recorded.
    #[error(
        "there is no recording to simulate; add [[recording]] with `file` and `tap` in place of [measured]"
    )]
    NoRecordings,
    /// No sensor to record with.
    #[error("there is no sensor to record with; add [[sensor]] with `name` and `position`")]
    NoSensors,
    /// The hammer's place is missing.
    #[error(
        "line {line}: {file}: where the hammer strikes is missing; add `tap` (m along the beam)"
    )]
    NoTap {
        /// The recording.
        file: String,
        /// Its line in the description.
        line: usize,
    },
    /// Frequency response functions are not recorded.
    #[error(
        "line {line}: {file} is a file of frequency response functions, and time series are simulated; remove `form`"
    )]
    Responses {
        /// The recording.
        file: String,
        /// Its line in the description.
        line: usize,
    },
    /// Two recordings have one file and are not the same.
    #[error(
        "line {line}: {file} was described before with another `tap`, `level`, `at` or `mass`; give each recording a file of its own"
    )]
    SameFile {
        /// The file.
        file: String,
        /// The second one's line in the description.
        line: usize,
    },
    /// A sensor without a place.
    #[error("sensor {name}: its place is missing; add `position` (m along the beam)")]
    NoPosition {
        /// The sensor.
        name: String,
    },
    /// A microphone.
    #[error("sensor {name}: sound is not simulated; leave the sensor out")]
    Sound {
        /// The sensor.
        name: String,
    },
    /// The joint's stiffness is not given.
    #[error(
        "the joint's stiffness is not given: {missing} missing; add {keys} to [joint], or give --kx and --ky"
    )]
    NoJoint {
        /// What is missing.
        missing: &'static str,
        /// What to add.
        keys: &'static str,
    },
    /// A reading bias needs no simulator.
    #[error(
        "`resolution` is a bias of reading frequencies, which no recording contains; plant it in [measured]"
    )]
    Resolution,
    /// An effect that acts on sensors of unknown mass alone.
    #[error(
        "`sensor-mass` is the mass of sensors that the description does not state, and it states that of every sensor; \
         remove `mass` from the [[sensor]] that shall weigh more than is known"
    )]
    NothingToWeigh,
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
        /// What it reaches to (Hz).
        reach: f64,
        /// Where the band ends (Hz).
        band: f64,
        /// What is needed (Hz).
        needed: f64,
    },
    /// A number of the laboratory that cannot be.
    #[error("{quantity} is {value}, but must be {allowed}")]
    Setting {
        /// Which.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        allowed: &'static str,
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
