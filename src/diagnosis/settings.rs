//! Settings of the diagnosis, and its errors.

use crate::parameters::LogNormal;
use crate::thresholds::Thresholds;
use tapjoint_beam::effects::EffectId;
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
    /// Locations tried for a sensor of unknown position: 12.
    pub unknown_positions: usize,
    /// Distributions of the sizes of some effects (SI), if they are known, as in a study. All other effects have the
    /// catalogue's priors.
    pub known_sizes: Vec<(EffectId, LogNormal)>,
    /// Seed of random draws.
    pub seed: u64,
    /// Thresholds of all decisions. The words of reports state the default ones.
    pub thresholds: Thresholds,
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
        } else if self.thresholds.withheld_modes >= self.thresholds.withhold_from {
            "withheld_modes must be less than withhold_from"
        } else if self.thresholds.spared_modes >= self.thresholds.spare_modes_from {
            "spared_modes must be less than spare_modes_from"
        } else if !self
            .known_sizes
            .iter()
            .all(|(_, known)| are_positive(&[known.median, known.spread]))
        {
            "medians and spreads of known_sizes must be finite and above 0"
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
            unknown_positions: 12,
            known_sizes: Vec::new(),
            seed: 0,
            thresholds: Thresholds::DEFAULT,
        }
    }
}

/// p-value below which its logarithm decides no more: 1e-12 is certainty in all printed digits, and the odds
/// stay finite.
pub const SMALLEST_P_VALUE: f64 = 1e-12;
/// Non-centrality of chi square (one degree of freedom) that is found with 90 % power at the 1 % level.
pub const DETECTABLE: f64 = 14.9;
