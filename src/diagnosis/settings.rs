//! What the diagnosis takes for granted where nobody says otherwise.

use super::error::GapError;
use tapjoint_identify::FREQUENCY_FLOOR;

/// Settings of the diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct GapSettings {
    /// Standard deviations that the joint's stiffnesses may have between visits (1), equally
    /// probable: 0.2 %, untouched; 1 %, usual; 2 %, a joint that was re-tightened.
    pub drift_stds: Vec<f64>,
    /// Standard uncertainty of a common factor on all frequencies where no tolerance is stated (1):
    /// 0.2 %, a modulus known to 0.3 % and a length to 0.1 %. What is larger than this counts as a gap
    /// that has a name (`modulus`, `length`, `timebase`); whoever knows the geometry less well states it.
    pub scale_std: f64,
    /// Standard uncertainty of a Timoshenko beam's shear flexibility and rotary inertia together (1): 2 %, by which
    /// the shear coefficient used here, 5/6, and Cowper's (1966) 10 (1 + nu)/(12 + 11 nu) differ for metals.
    pub shear_std: f64,
    /// Standard deviation of a common factor on the frequencies of one visit (1): 0.02 %, about what a kelvin does
    /// (0.015 % of steel, 0.025 % of aluminium).
    pub temperature_std: f64,
    /// Relative uncertainty of any frequency that repetition cannot show (1): [`FREQUENCY_FLOOR`].
    pub frequency_floor: f64,
    /// Relative standard uncertainty of a sensor's stated mass: 10 %, cable and mounting.
    pub sensor_mass_std: f64,
    /// Radius of gyration of a sensor about the beam's axis (m): 8 mm, of one some 12 mm high on a beam 5 mm thick.
    pub sensor_radius: f64,
    /// Relative standard uncertainty of a mass that is fastened to be known: 1 %, a kitchen scale's 0.1 g
    /// of 10 g, and the wax under it.
    pub fastened_mass_std: f64,
    /// Standard uncertainty of the places of sensors, fastened masses and taps (m): 1 mm.
    pub position_std: f64,
    /// Standard uncertainty of the calibration of hammer and sensor together (1), anew in every visit: 3 %,
    /// since a sensor that is mounted again is not aligned as before.
    pub gain_std: f64,
    /// Scatter of the nominal damping ratios about a power of the frequency (natural logarithm): 0.4.
    pub damping_scatter: f64,
    /// Standard deviation of that power: 0.5, so that damping proportional to the mass (air, cables), which falls
    /// with the frequency, and to the stiffness, which rises with it, are both two standard deviations off.
    pub damping_tilt: f64,
    /// Standard deviation of the logarithm of the joint's stiffnesses about where the search begins:
    /// 1.5, a factor of 20 either way in 95 % of cases.
    pub joint_std: f64,
    /// The highest mode that is compared: 10. Waves of higher ones are short beside the width of a joint, the height of a
    /// sensor and the thickness of the beam, of which the model takes the first order only.
    pub highest_mode: usize,
    /// Number of modes from which on the highest is withheld: 6.
    pub withhold_from: usize,
    /// How many of the highest modes are withheld: 1.
    pub withheld_modes: usize,
    /// Places tried for a sensor whose position nobody said: 12.
    pub unknown_positions: usize,
    /// Seed of what is sampled.
    pub seed: u64,
}

impl GapSettings {
    /// Refuses settings with which nothing can be compared.
    pub(super) fn check(&self) -> Result<(), GapError> {
        let refused = |setting| Err(GapError::Setting { setting });
        let positive = |std: &f64| *std > 0.0 && std.is_finite();
        match self {
            s if s.drift_stds.is_empty() || !s.drift_stds.iter().all(positive) => {
                refused("drift_stds must hold at least one standard deviation above 0")
            }
            s if s.withheld_modes >= s.withhold_from => {
                refused("withheld_modes must be less than withhold_from")
            }
            s if ![s.scale_std, s.shear_std, s.temperature_std, s.damping_tilt]
                .iter()
                .all(positive) =>
            {
                refused(
                    "scale_std, shear_std, temperature_std and damping_tilt must be finite and above 0",
                )
            }
            s if !(s.frequency_floor.is_finite() && s.frequency_floor >= 0.0) => {
                refused("frequency_floor must be finite and not below 0")
            }
            s if !(s.sensor_radius.is_finite() && s.sensor_radius >= 0.0) => {
                refused("sensor_radius must be finite and not below 0")
            }
            s if s.highest_mode == 0 => refused("highest_mode must be at least 1"),
            s if s.unknown_positions == 0 => refused("unknown_positions must be at least 1"),
            _ => Ok(()),
        }
    }
}

impl Default for GapSettings {
    fn default() -> Self {
        GapSettings {
            drift_stds: vec![0.002, 0.01, 0.02],
            scale_std: 0.002,
            shear_std: 0.02,
            temperature_std: 2e-4,
            frequency_floor: FREQUENCY_FLOOR,
            sensor_mass_std: 0.1,
            sensor_radius: 0.008,
            fastened_mass_std: 0.01,
            position_std: 0.001,
            gain_std: 0.03,
            damping_scatter: 0.4,
            damping_tilt: 0.5,
            joint_std: 1.5,
            highest_mode: 10,
            withhold_from: 6,
            withheld_modes: 1,
            unknown_positions: 12,
            seed: 0,
        }
    }
}
