//! Thresholds of the diagnosis: the limits of its decisions, each with its reason.
//!
//! docs/decisions.md has them in one table, with what half and twice of each value does to the answers. Priors of sizes stand in
//! `candidates.rs`, `foreign_fits.rs` and `unknown.rs`. Step sizes and numbers of starts stand beside their algorithms.

/// Part of the diagnosis that a threshold acts on. Whoever changes it repeats this part and the later ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Whether observations can be diagnosed at all.
    Requirements,
    /// Data, and fits of single effects.
    Fits,
    /// Prior probabilities of the hypotheses, and fits of two effects.
    Pairs,
    /// The verdict.
    Verdict,
    /// What stands beside the verdict: next tests, the map along the beam, what the decays show.
    Beside,
}

/// What half and twice of a threshold mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Half and twice of the value.
    Value,
    /// A share of 0.5 or more: half and twice of what it lacks of 1.
    Complement,
    /// A ratio of two like quantities: half and twice of what it exceeds 1 by.
    Excess,
}

/// Reasons why a threshold cannot be set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ThresholdError {
    /// No threshold has this name.
    #[error("there is no threshold `{name}`; thresholds are: {}", Thresholds::names().join(", "))]
    Unknown {
        /// The name.
        name: String,
    },
    /// A value that is no number.
    #[error("the threshold `{name}` must be finite, not {value}")]
    NotFinite {
        /// The name.
        name: &'static str,
        /// The value.
        value: f64,
    },
}

/// Number that may be a threshold.
trait Number: Copy {
    fn to_f64(self) -> f64;
    fn from_f64(value: f64) -> Self;
}

impl Number for f64 {
    fn to_f64(self) -> f64 {
        self
    }

    fn from_f64(value: f64) -> Self {
        value
    }
}

impl Number for usize {
    fn to_f64(self) -> f64 {
        self as f64
    }

    /// Rounds, and returns 1 at least.
    fn from_f64(value: f64) -> Self {
        value.round().max(1.0) as usize
    }
}

/// Makes the struct, its default values and its access by name from one list: name, type, value, what half and twice mean
/// and the stage.
macro_rules! thresholds {
    ($($(#[$doc:meta])* $name:ident: $kind:ty = $value:expr, $scale:ident, $stage:ident;)*) => {
        /// Thresholds of all decisions.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Thresholds {
            $($(#[$doc])* pub $name: $kind,)*
        }

        impl Thresholds {
            /// The values in use.
            pub const DEFAULT: Thresholds = Thresholds { $($name: $value,)* };

            /// Returns the names of all thresholds.
            pub fn names() -> Vec<&'static str> {
                vec![$(stringify!($name),)*]
            }

            /// Returns the value of a threshold; `None` where none has this name.
            pub fn value(&self, name: &str) -> Option<f64> {
                match name {
                    $(stringify!($name) => Some(self.$name.to_f64()),)*
                    _ => None,
                }
            }

            /// Sets a threshold. A count is rounded and at least 1.
            ///
            /// # Errors
            /// [`ThresholdError`] for an unknown name, or a value that is not finite.
            pub fn set(&mut self, name: &str, value: f64) -> Result<(), ThresholdError> {
                match name {
                    $(stringify!($name) if !value.is_finite() => {
                        Err(ThresholdError::NotFinite { name: stringify!($name), value })
                    })*
                    $(stringify!($name) => {
                        self.$name = Number::from_f64(value);
                        Ok(())
                    })*
                    _ => Err(ThresholdError::Unknown { name: name.to_owned() }),
                }
            }

            /// Returns the part of the diagnosis that a threshold acts on; `None` where none has this name.
            pub fn stage(name: &str) -> Option<Stage> {
                match name {
                    $(stringify!($name) => Some(Stage::$stage),)*
                    _ => None,
                }
            }

            /// Returns what half and twice of a threshold mean; `None` where none has this name.
            pub fn scale(name: &str) -> Option<Scale> {
                match name {
                    $(stringify!($name) => Some(Scale::$scale),)*
                    _ => None,
                }
            }
        }
    };
}

impl Default for Thresholds {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Thresholds {
    /// Returns these thresholds with `factor` times (1) the value of one, or of its distance to 1, see [`Scale`].
    ///
    /// # Errors
    /// [`ThresholdError`] for an unknown name, or a factor that is not finite.
    pub fn with_factor(&self, name: &str, factor: f64) -> Result<Self, ThresholdError> {
        let (Some(value), Some(scale)) = (self.value(name), Self::scale(name)) else {
            return Err(ThresholdError::Unknown {
                name: name.to_owned(),
            });
        };
        let scaled = match scale {
            Scale::Value => factor * value,
            Scale::Complement | Scale::Excess => 1.0 + factor * (value - 1.0),
        };
        let mut changed = self.clone();
        changed.set(name, scaled)?;
        Ok(changed)
    }
}

thresholds! {
    // Requirements on observations.

    /// Ratio of the frequencies of one mode in two configurations beyond which they show two structures: a
    /// heavy sensor or a re-tightened joint moves a frequency by up to 15 %.
    same_mode_ratio: f64 = 1.3, Excess, Requirements;
    /// Largest displacement at a sensor over the largest of the mode (1), below which the sensor sees nothing.
    node_displacement: f64 = 0.01, Value, Requirements;
    /// Peaks from which on a configuration can show a structure of its own.
    least_peaks: usize = 4, Value, Requirements;
    /// Relative change of a frequency that moved sensors and another level reach at most (1).
    moved_frequency: f64 = 0.05, Value, Requirements;
    /// Relative change of a frequency that an unstated mass or a re-tightened joint reaches (1).
    changed_frequency: f64 = 0.15, Value, Requirements;
    /// Common modes from which on two configurations show one structure: two may agree by chance.
    least_shared_modes: usize = 3, Value, Requirements;

    // The data.

    /// Number of modes from which on the highest is held out: five are left to fit two stiffnesses and an effect with its
    /// place.
    withhold_from: usize = 6, Value, Fits;
    /// Number of the highest modes that are held out.
    withheld_modes: usize = 1, Value, Fits;
    /// Number of modes from which on the two highest are spared for the closure alone: 8, so that five are left to fit and
    /// one to test. No recording is spared. One that differs is needed in the fit, and one that repeats the others tests
    /// little.
    spare_modes_from: usize = 8, Value, Fits;
    /// Number of the highest modes that are spared for the closure, where there are enough. One alone says little about a
    /// root mean square.
    spared_modes: usize = 2, Value, Fits;
    /// Relative distance of two poles below which they share one decay (1).
    split_pole: f64 = 0.01, Value, Fits;
    /// Relative distance within which two recordings show the same unpaired peak (1). Sensors that move load a
    /// fixture's mode by less, and a joint that drifts turns it by less.
    same_peak: f64 = 0.005, Value, Fits;
    /// Relative distance up to which a peak may belong to a fixture whose frequency only the beam's modes
    /// determine (1). They do so to about one percent, so that this is two standard deviations.
    near_fixture: f64 = 0.02, Value, Fits;
    /// Level over the noise (dB) that a peak needs to be read, as the search for resonances requires by default.
    /// A level that is the height over the surroundings is smaller, hence on the safe side.
    readable_level: f64 = 15.0, Value, Fits;
    /// Level (dB) over the median mode of the beam at which a fixture's peak is read half of the time. At resonance the
    /// accelerance is the modal constant over twice the damping ratio. 60 to 80 dB lie between the strongest modes and
    /// the noise, and a peak needs 15 dB. A fixture is damped up to ten times as much as a beam: 40 to 60 dB are left.
    fixture_level: f64 = -50.0, Value, Fits;
    /// Largest eigenvalue of a correlation matrix above which modes have a common scatter: unrelated modes are
    /// shrunk towards 1.
    common_scatter: f64 = 1.3, Excess, Fits;
    /// Ratio of two amplitudes of a decay from which on they are two (1).
    distinct_amplitudes: f64 = 1.05, Excess, Fits;

    // Amplitude dependence along decays.

    /// Probability by chance below which a change along the decays counts: one false finding in a thousand tests.
    change_by_chance: f64 = 0.001, Value, Beside;
    /// Standard uncertainties from which on the size of a joint law counts.
    law_detected: f64 = 3.0, Value, Fits;
    /// Goodness of fit below which a law of the joint does not explain the changes.
    law_misfit: f64 = 0.001, Value, Beside;
    /// Standard uncertainties beyond which a change has a direction, 95 % two-sided: it is certain before that there are
    /// changes at all.
    directed_change: f64 = 2.0, Value, Beside;
    /// Number of directed changes of one sign that belong to the joint: a single one always has one sign.
    least_directed: usize = 2, Value, Beside;

    // Searches.

    /// Factor on the scales of the prior distributions of all sizes (1). Each scale stands with its reason in
    /// src/diagnosis/candidates.rs: what such things weigh, yield or are known to.
    prior_scale: f64 = 1.0, Value, Fits;
    /// Factor on all spreads of something unknown (1). Each spread stands with its reason in src/diagnosis/unknown.rs.
    unknown_spread: f64 = 1.0, Value, Fits;
    /// Standard deviation of a location over the spacing of the nodes (1), below which the data fix the location.
    located: f64 = 0.7, Value, Fits;
    /// Standard deviations of a size from zero, above which size and location are Gaussian together.
    size_detected: f64 = 4.0, Value, Fits;
    /// Standard deviation of a size over its scale (1), from which on its likelihood need not be a parabola.
    poorly_known_size: f64 = 0.3, Value, Fits;
    /// Share of the misfit so far that a coarse optimum must beat to be followed: smaller gains have other
    /// reasons.
    followed_share: f64 = 0.9, Complement, Fits;

    // Goodness of fit.

    /// Goodness of fit below which an explanation is refuted: one in a hundred by chance. The nominal model is given up
    /// for something unknown only from 20 to 1 against it (`detected`), for which 1 in 300 is needed at least.
    misfit: f64 = 0.01, Value, Fits;
    /// Limit for the worst of many blocks of data: some ten of them together are wrong as often as
    /// `misfit` states.
    block_misfit: f64 = 0.001, Value, Fits;
    /// Trace of the residual covariance below which a block says nothing: the parameters follow it almost exactly.
    least_block_freedom: f64 = 0.3, Value, Fits;
    /// Goodness of the hold-out errors above which a hypothesis counts as predicting them.
    predicted: f64 = 0.05, Value, Verdict;
    /// Share of the gap on hold-out data that a named effect must close: less leaves most of it to something else.
    closed_share: f64 = 0.5, Complement, Verdict;
    /// Closure at which the mean square of the hold-out errors has doubled (1).
    doubled_errors: f64 = -1.0, Value, Verdict;
    /// Gap over its noise floor below which no closure is stated (1).
    gap_over_floor: f64 = 2.0, Value, Verdict;
    /// Gap over the uncertainty of its prediction above which hold-out data can decide (1).
    gap_over_prediction: f64 = 2.0, Value, Verdict;
    /// Number of data beyond the parameters from which on an effect is named: with fewer nearly every effect with
    /// as many parameters explains them.
    spare_data: usize = 2, Value, Verdict;
    /// Ratio of two tap levels from which on they are different: taps that should be alike scatter by less.
    another_level: f64 = 1.5, Excess, Verdict;
    /// Least number of recordings for leave-one-recording-out: two others still show what changes between them.
    least_recordings: usize = 3, Value, Beside;
    /// Probability above which a hypothesis is cross-validated over recordings (1).
    cross_validated: f64 = 0.02, Value, Beside;

    // Two effects at once.

    /// Logarithm of the Bayes factor from which on a second effect is accepted, 148 to 1. Two explanations
    /// within it count as equally good.
    second_effect: f64 = 5.0, Value, Pairs;
    /// Least decrease of the objective by a second effect where a single one suffices. It is twice `second_effect`, because
    /// place and size may be chosen.
    promised_by_second: f64 = 10.0, Value, Pairs;
    /// Least number of data for which pairs of effects are tried: two stiffnesses and two effects with places have six
    /// parameters.
    least_data_for_pairs: usize = 6, Value, Pairs;

    // Probabilities and the verdict.

    /// Prior probability of no gap over that of one group of effects. Most of the things that may be wrong with a test are
    /// right. An effect too small to be noticed counts as none.
    no_gap_prior: f64 = 4.0, Value, Pairs;
    /// Prior probability that a joint described as rigid gives, over that of one group of effects. All clamps give a
    /// little.
    rigid_prior: f64 = 4.0, Value, Pairs;
    /// Prior probability of something unknown over that of one group of effects. A real rig has about as many causes
    /// outside the catalogue as in it. Ten is their share in `diagnosis_study`, whose figures are therefore favourable.
    unknown_prior: f64 = 10.0, Value, Pairs;
    /// Weight of a second cause that the data do not show, over that of the effect that they show. Without it, first answers above
    /// 0.9 stated 0.99 on drawn tests. Of these, 222 were right and 13 wrong: odds of 0.06.
    hidden_second: f64 = 0.06, Value, Pairs;
    /// Standard deviations of an effect's size from zero from which on it is a name: a size within two may be zero.
    sized: f64 = 2.0, Value, Verdict;
    /// Chi square below which two hypotheses count as one on these data: three standard deviations.
    separate: f64 = 9.0, Value, Verdict;
    /// Probability from which on an effect is named.
    named_probability: f64 = 0.8, Complement, Verdict;
    /// Probability that a set of explanations must hold.
    set_probability: f64 = 0.9, Complement, Verdict;
    /// Largest number of groups in a set that is still short.
    longest_set: usize = 4, Value, Verdict;
    /// Share of the probability of a group from which on a member is listed.
    listed_share: f64 = 0.02, Value, Verdict;
    /// Logarithm of the Bayes factor against the nominal model from which on an effect counts as detected: 20 to 1
    /// (Kass & Raftery 1995, "strong"). From here on simple causes outside the catalogue are sought.
    detected: f64 = 3.0, Value, Fits;
    /// Likelihood ratio of the two best hypotheses from which on the data decided.
    decisive_ratio: f64 = 3.0, Excess, Beside;
    /// Least number of frequencies for a map along the beam.
    least_map_data: usize = 4, Value, Beside;

    // The next test.

    /// Hypotheses less probable than this are not compared (1).
    least_compared: f64 = 0.003, Value, Beside;
    /// Largest number of hypotheses that are compared.
    most_compared: usize = 12, Value, Beside;
    /// Tests that bring less information (bit) are not proposed.
    least_information: f64 = 0.005, Value, Beside;
    /// Largest number of proposed tests.
    most_proposed: usize = 6, Value, Beside;
    /// Share of the information of a test that the listed pairs of hypotheses contribute.
    listed_information: f64 = 0.8, Complement, Beside;
    /// Largest number of hypotheses that a test lists.
    most_listed: usize = 4, Value, Beside;
    /// Share of the length from which on a sensor counts as moved (1).
    moved_sensor: f64 = 0.08, Value, Beside;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Documents that state the thresholds must not fall behind: same names in the same order, values and stages.
    #[test]
    fn regress_the_table_of_decisions_has_every_threshold_and_nothing_else() {
        let document = include_str!("../../docs/decisions.md");
        let (_, section) = document
            .split_once("## Thresholds of the diagnosis")
            .expect("docs/decisions.md has this section");
        let rows = section.lines().filter(|line| line.starts_with("| `"));
        let stated: Vec<Vec<&str>> = rows
            .map(|row| row.trim_matches('|').split(" | ").map(str::trim).collect())
            .collect();
        let expected: Vec<[String; 2]> = Thresholds::names()
            .into_iter()
            .map(|name| {
                let stage = format!("{:?}", Thresholds::stage(name).unwrap()).to_lowercase();
                let value = Thresholds::DEFAULT.value(name).unwrap();
                [format!("`{name}` ({stage})"), value.to_string()]
            })
            .collect();
        let found: Vec<[String; 2]> = stated
            .iter()
            .map(|cells| [0, 1].map(|k| cells[k].to_owned()))
            .collect();
        assert_eq!(found, expected);
        for cells in &stated {
            let is_whole = cells.len() == 6 && cells.iter().all(|cell| !cell.is_empty());
            assert!(is_whole, "{cells:?}");
        }
    }

    #[test]
    fn limit_half_and_twice_keep_shares_below_one_and_ratios_above_it() {
        for (name, half, twice) in [
            ("misfit", 0.005, 0.02),
            ("fixture_level", -25.0, -100.0),
            ("named_probability", 0.9, 0.6),
            ("closed_share", 0.75, 0.0),
            ("same_mode_ratio", 1.15, 1.6),
            // Counts are rounded, and 1 at least.
            ("least_shared_modes", 2.0, 6.0),
            ("withheld_modes", 1.0, 2.0),
        ] {
            for (factor, expected) in [(0.5, half), (2.0, twice)] {
                let changed = Thresholds::DEFAULT.with_factor(name, factor).unwrap();
                let value = changed.value(name).unwrap();
                // Rounding of a sum of numbers near 1.
                assert!((value - expected).abs() < 1e-15, "{name}: {value}");
                let mut restored = changed;
                let before = Thresholds::DEFAULT.value(name).unwrap();
                restored.set(name, before).unwrap();
                assert_eq!(restored, Thresholds::DEFAULT, "{name} changes another one");
            }
        }
    }

    #[test]
    fn limit_no_other_name_and_no_infinite_value_can_be_set() {
        let mut thresholds = Thresholds::DEFAULT;
        let unknown = thresholds.set("misfits", 0.1).unwrap_err().to_string();
        assert!(unknown.contains("`misfits`") && unknown.contains("block_misfit"));
        for value in [f64::NAN, f64::INFINITY] {
            assert!(thresholds.set("misfit", value).is_err());
        }
        thresholds.set("longest_set", -3.0).unwrap();
        assert_eq!(thresholds.longest_set, 1);
    }
}
