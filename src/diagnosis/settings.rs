//! Settings of the diagnosis, its errors, and the thresholds of all its decisions.

use tapjoint_identify::FREQUENCY_FLOOR;
use tapjoint_identify::consistent::LEAST_DISCREPANCY;

/// Reasons why a diagnosis has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GapError {
    /// Fewer modes than could show a gap.
    #[error(
        "{modes} natural {} observed; a gap shows only beyond the {needed} that the \
         joint's stiffnesses can follow: observe at least {least} modes", if *.modes == 1 { "frequency was" } else { "frequencies were" }
    )]
    TooFewModes {
        /// Modes observed.
        modes: usize,
        /// Stiffnesses of the joint.
        needed: usize,
        /// Least number of modes.
        least: usize,
    },
    /// No frequency has an uncertainty, so that every misfit may be noise.
    #[error(
        "no frequency has an uncertainty, so that a misfit cannot be told from noise: tap at least \
         three times per recording, or state `half_line`, `std` or `scatter`"
    )]
    NoUncertainty,
    /// The same mode differs by more between configurations than sensors, joint or level explain.
    #[error(
        "{first} and {second} do not show the same structure: mode {mode} is at {low} Hz and {high} Hz; \
         diagnose recordings of one structure only"
    )]
    Contradictory {
        /// One configuration.
        first: String,
        /// The other.
        second: String,
        /// The mode.
        mode: usize,
        /// Its frequency in one (Hz).
        low: f64,
        /// In the other (Hz).
        high: f64,
    },
    /// Most peaks of one configuration are missing in another.
    #[error(
        "{first} and {second} do not show the same structure: {strangers} of the {peaks} peaks of {second} lie more \
         than {percent} % from every peak of {first}; diagnose recordings of one structure only"
    )]
    AnotherStructure {
        /// One configuration.
        first: String,
        /// The other.
        second: String,
        /// Peaks of the second that the first has not.
        strangers: usize,
        /// All peaks of the second.
        peaks: usize,
        /// Largest distance of two equal peaks (%).
        percent: f64,
    },
    /// Every sensor sits at a node of every mode.
    #[error(
        "every sensor sits within {percent} % of the largest displacement of zero in all observed modes: \
         move one at least {distance:.3} m away"
    )]
    SensorsAtNodes {
        /// Largest displacement at a sensor over that of the mode (%).
        percent: f64,
        /// A distance that would do (m).
        distance: f64,
    },
    /// The nominal model has no solution.
    #[error("the nominal model cannot be solved: {0}")]
    Structure(#[from] tapjoint_beam::StructureError),
    /// A setting out of its range.
    #[error("{setting}")]
    Setting {
        /// The setting and its allowed values.
        setting: &'static str,
    },
    /// No start led to a fit of the nominal model.
    #[error(
        "the nominal model could not be fitted to the frequencies; check the beam's description"
    )]
    NoFit,
}

/// Settings of the diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct GapSettings {
    /// Standard deviations that the joint's stiffnesses may have between set-ups (1), equally
    /// probable: 0.2 %, untouched; 1 %, usual; 2 %, a joint that was re-tightened.
    pub drift_stds: Vec<f64>,
    /// Standard deviation of what the model misses of each mode's frequency (1, relative): [`LEAST_DISCREPANCY`].
    pub discrepancy: f64,
    /// Standard uncertainty of a Timoshenko beam's shear flexibility and rotary inertia together (1): 2 %, by which
    /// the shear coefficient used here, 5/6, and Cowper's (1966) 10 (1 + nu)/(12 + 11 nu) differ for metals.
    pub shear_std: f64,
    /// Standard deviation of a common factor on the frequencies of one set-up (1): 0.02 %, about what a kelvin does
    /// (0.015 % of steel, 0.025 % of aluminium).
    pub temperature_std: f64,
    /// Relative uncertainty of any frequency that repetition cannot show (1): [`FREQUENCY_FLOOR`].
    pub frequency_floor: f64,
    /// Radius of gyration of a sensor about the beam's axis (m): 8 mm, of one some 12 mm high on a beam 5 mm thick.
    pub sensor_radius: f64,
    /// Standard uncertainty of the calibration of hammer and sensor together (1), anew in every set-up: 3 %,
    /// since a sensor that is mounted again is not aligned as before.
    pub gain_std: f64,
    /// Scatter of the nominal damping ratios about a power of the frequency (natural logarithm): 0.4.
    pub damping_scatter: f64,
    /// Standard deviation of that power: 0.5. Damping proportional to the mass (air, cables) falls with the
    /// frequency, and damping proportional to the stiffness rises with it. Both are then two standard deviations off.
    pub damping_tilt: f64,
    /// Standard deviation of the logarithm of the joint's stiffnesses about where the search begins:
    /// 1.5, a factor of 20 either way in 95 % of cases.
    pub joint_std: f64,
    /// The highest mode that is compared: 10. Higher modes have waves that are short beside a joint's width, a
    /// sensor's height and the beam's thickness. The model takes these to first order only.
    pub highest_mode: usize,
    /// Number of modes from which on the highest is held out: 6.
    pub withhold_from: usize,
    /// Number of the highest modes that are held out: 1.
    pub withheld_modes: usize,
    /// Number of modes from which on the two highest are spared for the closure alone: 8, so that five are left to fit and one
    /// to test. No recording is spared. One that differs is needed in the fit, and one that repeats the others tests
    /// little.
    pub spare_modes_from: usize,
    /// Locations tried for a sensor of unknown position: 12.
    pub unknown_positions: usize,
    /// Seed of random draws.
    pub seed: u64,
}

impl GapSettings {
    /// Refuses settings out of their range.
    pub(crate) fn check(&self) -> Result<(), GapError> {
        let stds = [
            self.discrepancy,
            self.shear_std,
            self.temperature_std,
            self.damping_tilt,
        ];
        let setting = if self.drift_stds.is_empty() || !are_positive(&self.drift_stds) {
            "drift_stds must hold at least one standard deviation above 0"
        } else if self.withheld_modes >= self.withhold_from {
            "withheld_modes must be less than withhold_from"
        } else if !are_positive(&stds) {
            "discrepancy, shear_std, temperature_std and damping_tilt must be finite and above 0"
        } else if !(0.0..f64::INFINITY).contains(&self.frequency_floor) {
            "frequency_floor must be finite and not below 0"
        } else if !(0.0..f64::INFINITY).contains(&self.sensor_radius) {
            "sensor_radius must be finite and not below 0"
        } else if self.highest_mode == 0 {
            "highest_mode must be at least 1"
        } else if self.unknown_positions == 0 {
            "unknown_positions must be at least 1"
        } else {
            return Ok(());
        };
        Err(GapError::Setting { setting })
    }
}

fn are_positive(stds: &[f64]) -> bool {
    stds.iter().all(|std| *std > 0.0 && std.is_finite())
}

impl Default for GapSettings {
    fn default() -> Self {
        GapSettings {
            drift_stds: vec![0.002, 0.01, 0.02],
            discrepancy: LEAST_DISCREPANCY,
            shear_std: 0.02,
            temperature_std: 2e-4,
            frequency_floor: FREQUENCY_FLOOR,
            sensor_radius: 0.008,
            gain_std: 0.03,
            damping_scatter: 0.4,
            damping_tilt: 0.5,
            joint_std: 1.5,
            highest_mode: 10,
            withhold_from: 6,
            withheld_modes: 1,
            spare_modes_from: 8,
            unknown_positions: 12,
            seed: 0,
        }
    }
}

// Thresholds, each with its reason and its source. Step sizes, numbers of starts and the like stand beside their
// algorithms.

// Requirements on observations.

/// Ratio of the frequencies of one mode in two configurations beyond which they show two structures: a
/// heavy sensor or a re-tightened joint moves a frequency by up to 15 %.
pub const SAME_MODE_RATIO: f64 = 1.3;
/// Largest displacement at a sensor over the largest of the mode (1), below which the sensor sees nothing.
pub const NODE_DISPLACEMENT: f64 = 0.01;
/// Peaks from which on a configuration can show a structure of its own.
pub const LEAST_PEAKS: usize = 4;
/// Relative change of a frequency that moved sensors and another level reach at most (1).
pub const MOVED_FREQUENCY: f64 = 0.05;
/// Relative change of a frequency that an unstated mass or a re-tightened joint reaches (1).
pub const CHANGED_FREQUENCY: f64 = 0.15;
/// Common modes from which on two configurations show one structure: two may agree by chance.
pub const LEAST_SHARED_MODES: usize = 3;
/// Relative distance of two poles below which they share one decay (1).
pub const SPLIT_POLE: f64 = 0.01;
/// Relative distance within which two recordings show the same unpaired peak (1). Sensors that move load a
/// fixture's mode by less, and a joint that drifts turns it by less.
pub const SAME_PEAK: f64 = 0.005;
/// Relative distance up to which a peak may belong to a fixture whose frequency only the beam's modes
/// determine (1). They do so to about one percent, so that this is two standard deviations.
pub const NEAR_FIXTURE: f64 = 0.02;
/// Level over the noise (dB) that a peak needs to be read, as the search for resonances requires by default.
/// A level that is the height over the surroundings is smaller, hence on the safe side.
pub const READABLE_LEVEL: f64 = 15.0;
/// Level (dB) over the median mode of the beam at which a fixture's peak is read half of the time. At resonance the
/// accelerance is the modal constant over twice the damping ratio. 60 to 80 dB lie between the strongest modes and
/// the noise, and a peak needs 15 dB. A fixture is damped up to ten times as much as a beam: 40 to 60 dB are left.
pub const FIXTURE_LEVEL: f64 = -50.0;
/// Largest eigenvalue of a correlation matrix above which modes have a common scatter: unrelated modes are
/// shrunk towards 1.
pub const COMMON_SCATTER: f64 = 1.3;
/// Ratio of two amplitudes of a decay from which on they are two (1).
pub const DISTINCT_AMPLITUDES: f64 = 1.05;

// Amplitude dependence along decays.

/// Probability by chance below which a change along the decays counts: one false finding in a thousand tests.
pub const CHANGE_BY_CHANCE: f64 = 0.001;
/// Standard uncertainties from which on the size of a joint law counts.
pub const LAW_DETECTED: f64 = 3.0;

// Searches.

/// Standard deviation of a location over the spacing of the nodes (1), below which the data fix the location.
pub const LOCATED: f64 = 0.7;
/// Standard deviations of a size from zero, above which size and location are Gaussian together.
pub const SIZE_DETECTED: f64 = 4.0;
/// Standard deviation of a size over its scale (1), from which on its likelihood need not be a parabola.
pub const POORLY_KNOWN_SIZE: f64 = 0.3;
/// Share of the misfit so far that a coarse optimum must beat to be followed: smaller gains have other
/// reasons.
pub const FOLLOWED_SHARE: f64 = 0.9;

// Goodness of fit.

/// Goodness of fit below which an explanation is refuted: one in a hundred by chance. The nominal model is given up
/// for something unknown only from 20 to 1 against it ([`DETECTED`]), for which 1 in 300 is needed at least.
pub const MISFIT: f64 = 0.01;
/// Limit for the worst of many blocks of data: some ten of them together are wrong as often as
/// [`MISFIT`] states.
pub const BLOCK_MISFIT: f64 = 0.001;
/// Trace of the residual covariance below which a block says nothing: the parameters follow it almost exactly.
pub const LEAST_BLOCK_FREEDOM: f64 = 0.3;
/// Goodness of the hold-out errors above which a hypothesis counts as predicting them.
pub const PREDICTED: f64 = 0.05;
/// Share of the gap on hold-out data that a named effect must close: less leaves most of it to something else.
pub const CLOSED_SHARE: f64 = 0.5;
/// Closure at which the mean square of the hold-out errors has doubled (1).
pub const DOUBLED_ERRORS: f64 = -1.0;
/// Gap over its noise floor below which no closure is stated (1).
pub const GAP_OVER_FLOOR: f64 = 2.0;
/// Gap over the uncertainty of its prediction above which hold-out data can decide (1).
pub const GAP_OVER_PREDICTION: f64 = 2.0;
/// Number of data beyond the parameters from which on an effect is named: with fewer nearly every effect with
/// as many parameters explains them.
pub const SPARE_DATA: usize = 2;
/// Ratio of two tap levels from which on they are different: taps that should be alike scatter by less.
pub const ANOTHER_LEVEL: f64 = 1.5;
/// Least number of recordings for leave-one-recording-out: two others still show what changes between them.
pub const LEAST_RECORDINGS: usize = 3;
/// Probability above which a hypothesis is cross-validated over recordings (1).
pub const CROSS_VALIDATED: f64 = 0.02;
/// p-value below which its logarithm decides no more: 1e-12 is certainty in all printed digits, and the odds
/// stay finite.
pub const SMALLEST_P_VALUE: f64 = 1e-12;

// Two effects at once.

/// Logarithm of the Bayes factor from which on a second effect is accepted, 148 to 1. Two explanations
/// within it count as equally good.
pub const SECOND_EFFECT: f64 = 5.0;
/// Decrease of the objective that a second effect must promise where a single one suffices: the accepted
/// Bayes factor, and as much again for the location and size that it may choose.
pub const PROMISED_BY_SECOND: f64 = 2.0 * SECOND_EFFECT;
/// Least number of data for which pairs of effects are tried.
pub const LEAST_DATA_FOR_PAIRS: usize = 6;

// Probabilities and the verdict.

/// Prior probability of no gap over that of one group of effects. The priors of all sizes reach zero, and an
/// effect too small to be noticed is as good as none; and most of the dozen things that may be wrong
/// with a test are right.
pub const NO_GAP_PRIOR: f64 = 4.0;
/// Prior probability that a joint described as rigid gives, over that of one group of effects. All clamps give a
/// little.
pub const RIGID_PRIOR: f64 = 4.0;
/// Prior probability of something unknown over that of one group of effects. A real rig has many more causes than the
/// catalogue. Real beams miss their models by 0.1 to 1 %.
pub const UNKNOWN_PRIOR: f64 = 4.0;
/// Standard deviations of an effect's size from zero from which on it is a name: a size within two may be zero.
pub const SIZED: f64 = 2.0;
/// Chi square below which two hypotheses count as one on these data: three standard deviations.
pub const SEPARATE: f64 = 9.0;
/// Probability from which on an effect is named.
pub const NAMED_PROBABILITY: f64 = 0.8;
/// Probability that a set of explanations must hold.
pub const SET_PROBABILITY: f64 = 0.9;
/// Largest number of groups in a set that is still short.
pub const LONGEST_SET: usize = 4;
/// Share of the probability of a group from which on a member is listed.
pub const LISTED_SHARE: f64 = 0.02;
/// Logarithm of the Bayes factor against the nominal model from which on an effect counts as detected: 20 to 1
/// (Kass & Raftery 1995, "strong").
pub const DETECTED: f64 = 3.0;
/// Likelihood ratio of the two best hypotheses from which on the data decided.
pub const DECISIVE_RATIO: f64 = 3.0;
/// Non-centrality of chi square (one degree of freedom) that is found with 90 % power at the 1 % level.
pub const DETECTABLE: f64 = 14.9;
/// Least number of frequencies for a map along the beam.
pub const LEAST_MAP_DATA: usize = 4;

// The next test.

/// Hypotheses less probable than this are not compared (1).
pub const LEAST_COMPARED: f64 = 0.003;
/// Largest number of hypotheses that are compared.
pub const MOST_COMPARED: usize = 12;
/// Tests that bring less information (bit) are not proposed.
pub const LEAST_INFORMATION: f64 = 0.005;
/// Largest number of proposed tests.
pub const MOST_PROPOSED: usize = 6;
/// Share of the information of a test that the listed pairs of hypotheses contribute.
pub const LISTED_INFORMATION: f64 = 0.8;
/// Largest number of hypotheses that a test lists.
pub const MOST_LISTED: usize = 4;
/// Share of the length from which on a sensor counts as moved (1).
pub const MOVED_SENSOR: f64 = 0.08;
