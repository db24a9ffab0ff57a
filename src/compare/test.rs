//! What is compared: tests of one structure, before and after something may have changed.

use tapjoint_beam::StructureError;
use tapjoint_beam::specimen::{Body, PointMass, Specimen};

/// One test of one state of the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// The structure as it was described for this test, all items on it.
    pub structure: Specimen,
    /// What sits on the structure and has a name.
    pub items: Vec<Item>,
    /// True where the description states the joint's translational or rotational stiffness. Others are fitted to the
    /// frequencies.
    pub knows_joint: [bool; 2],
    /// Standard uncertainty that the description leaves to all frequencies in common (1, relative).
    pub common_std: f64,
    /// The measured modes.
    pub modes: Vec<MeasuredMode>,
    /// Frequencies of peaks without a number (Hz): two tests may have chosen another of two that lie close.
    pub unnumbered: Vec<f64>,
}

/// A sensor or a fastened mass. Its mass is among those of the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Name, one for each item.
    pub name: String,
    /// Place (m) and mass (kg).
    pub point: PointMass,
    /// What it is.
    pub kind: ItemKind,
}

/// What an item is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ItemKind {
    /// A fastened mass.
    Mass,
    /// A sensor, which may also have been moved.
    Sensor,
}

/// What was measured of a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredMode {
    /// Number of the mode (1 = lowest).
    pub mode: usize,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Standard uncertainty of reading it (Hz); 0 where none is known.
    pub std: f64,
    /// Damping ratio (1); `None` where it was not measured.
    pub damping: Option<Reading>,
    /// How the frequency depends on the level; `None` without decays that tell it.
    pub level: Option<Level>,
    /// What taking the mode to another level adds to its uncertainty.
    pub moved: MovedStd,
}

/// Standard uncertainties that taking a mode to another level adds; 0 where it stays as it was read.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MovedStd {
    /// Of the frequency (Hz).
    pub frequency: f64,
    /// Of the damping ratio (1).
    pub damping: f64,
}

impl MeasuredMode {
    /// A frequency (Hz) with the standard uncertainty of reading it (Hz).
    pub fn of_frequency(mode: usize, frequency: f64, std: f64) -> Self {
        Self {
            mode,
            frequency,
            std,
            damping: None,
            level: None,
            moved: MovedStd::default(),
        }
    }
}

/// Level of the taps at which a mode was read, and how it depends on the level.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Amplitude at which frequency and damping hold, in the unit of the sensor.
    pub amplitude: f64,
    /// The mode at the amplitudes that the decays show, ascending.
    pub curve: Vec<LevelPoint>,
    /// What has this amplitude: sensor, place and unit. Amplitudes of others are not compared.
    pub of: String,
    /// Relative change of the frequency per factor of ten in amplitude (1), the mean over the decays; negative where the structure
    /// is softer at higher levels.
    pub frequency_slope: Reading,
}

/// A mode at one amplitude of its decays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelPoint {
    /// Amplitude, in the unit of the sensor.
    pub amplitude: f64,
    /// Change of the frequency (logarithm) against that of the mode.
    pub frequency: Reading,
    /// Change of the damping ratio (1) against that of the mode.
    pub damping: Reading,
}

impl Level {
    /// Returns the mode at an amplitude, between the points in proportion to its logarithm; `None` where the decays do not show
    /// it.
    pub(crate) fn at(&self, amplitude: f64) -> Option<LevelPoint> {
        let pair = self.curve.windows(2).find(|pair| {
            let [low, high] = [pair[0].amplitude, pair[1].amplitude];
            low < high && (low..=high).contains(&amplitude)
        })?;
        let [below, above] = pair else {
            return None;
        };
        let share = (amplitude / below.amplitude).ln() / (above.amplitude / below.amplitude).ln();
        let between = |below: Reading, above: Reading| Reading {
            value: below.value + share * (above.value - below.value),
            std: below.std + share * (above.std - below.std),
        };
        Some(LevelPoint {
            amplitude,
            frequency: between(below.frequency, above.frequency),
            damping: between(below.damping, above.damping),
        })
    }
}

/// A measured value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Value.
    pub value: f64,
    /// Standard uncertainty of reading it, in the unit of the value; 0 where none is known.
    pub std: f64,
}

/// Tests before and after one change. Several tests of a side are repeats of one state.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Tests before.
    pub before: Vec<Test>,
    /// Tests after.
    pub after: Vec<Test>,
}

/// What a caller may choose.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Settings {
    /// Standard deviation of the difference of a frequency between two tests of one state (1, relative). `None`: it
    /// follows from repeats, else a usual one is assumed.
    pub repeatability: Option<f64>,
}

/// Reason why nothing can be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// A side without a test.
    #[error("there is no test {side} the change; give at least one before and one after")]
    NoTest {
        /// "before" or "after".
        side: &'static str,
    },
    /// Too few modes in common.
    #[error(
        "the tests have {common} modes in common, but a comparison needs at least {least}; measure the same modes in \
         all tests"
    )]
    TooFewModes {
        /// Number of modes that all tests of a pair have.
        common: usize,
        /// Least number.
        least: usize,
    },
    /// More pairs than can be compared at once.
    #[error("{count} pairs are more than the {most} that can share one change; give fewer")]
    TooManyPairs {
        /// Number of pairs.
        count: usize,
        /// Most pairs.
        most: usize,
    },
    /// Too few or too many tests of a series.
    #[error(
        "a series of {count} tests: between {least} and {most} are needed, in the order of time"
    )]
    Series {
        /// Number of tests.
        count: usize,
        /// Least number.
        least: usize,
        /// Largest number.
        most: usize,
    },
    /// A repeatability that no measurement has.
    #[error("the repeatability is {value}, but must lie between {least} and {most}")]
    Repeatability {
        /// The value given (1).
        value: f64,
        /// Least value (1).
        least: f64,
        /// Largest value (1).
        most: f64,
    },
    /// Descriptions of different structures.
    #[error(
        "the descriptions are of different structures: one has {one}, another {other}; compare tests of one structure"
    )]
    Different {
        /// Joint and body of the first test.
        one: &'static str,
        /// Those of another test.
        other: &'static str,
    },
    /// The described structure has no modes.
    #[error("the described structure has no modes: {0}")]
    Structure(#[from] StructureError),
}

/// Least number of modes: one change of the joint has two sizes.
const LEAST_MODES: usize = 3;
/// Most pairs that share one change: their residuals are compared together.
pub const MOST_PAIRS: usize = 16;
/// Most repeats on one side of a change.
pub const MOST_REPEATS: usize = 100;
/// Limits of a stated repeatability (1): no frequency is read better than the first.
pub const REPEATABILITY_LIMITS: [f64; 2] = [1e-6, 0.1];

/// Refuses what cannot be compared, and returns the modes that all tests of each pair have, ascending.
///
/// # Errors
/// [`CompareError`] without the structure's own.
pub fn common_modes(pairs: &[Pair], settings: &Settings) -> Result<Vec<Vec<usize>>, CompareError> {
    if pairs.len() > MOST_PAIRS {
        return Err(CompareError::TooManyPairs {
            count: pairs.len(),
            most: MOST_PAIRS,
        });
    }
    let [least, most] = REPEATABILITY_LIMITS;
    if let Some(value) = settings.repeatability
        && !(least..=most).contains(&value)
    {
        return Err(CompareError::Repeatability { value, least, most });
    }
    if pairs.is_empty() {
        return Err(CompareError::NoTest { side: "before" });
    }
    let mut all = Vec::with_capacity(pairs.len());
    for pair in pairs {
        for (side, tests) in [("before", &pair.before), ("after", &pair.after)] {
            if tests.is_empty() {
                return Err(CompareError::NoTest { side });
            }
        }
        let one = pairs[0].before[0].kind();
        for test in pair.before.iter().chain(&pair.after) {
            let other = test.kind();
            if one != other {
                return Err(CompareError::Different { one, other });
            }
        }
        let modes = pair.before[0].modes.iter().filter(|one| one.mode > 0);
        let mut modes: Vec<usize> = modes.map(|one| one.mode).collect();
        modes.sort_unstable();
        modes.dedup();
        modes.retain(|mode| {
            let mut tests = pair.before.iter().chain(&pair.after);
            tests.all(|test| {
                let found = test.mode(*mode);
                found.is_some_and(|one| one.frequency > 0.0 && one.frequency.is_finite())
            })
        });
        if modes.len() < LEAST_MODES {
            return Err(CompareError::TooFewModes {
                common: modes.len(),
                least: LEAST_MODES,
            });
        }
        all.push(modes);
    }
    Ok(all)
}

impl Test {
    /// Returns what the structure is, in words.
    fn kind(&self) -> &'static str {
        match (&self.structure.body, self.structure.joint) {
            (Body::Joined(_), _) => "a lap joint",
            (_, Some(_)) => "a clamped beam",
            (_, None) => "a free beam",
        }
    }

    /// Returns the mode of this number.
    pub(crate) fn mode(&self, mode: usize) -> Option<&MeasuredMode> {
        self.modes.iter().find(|one| one.mode == mode)
    }
}
