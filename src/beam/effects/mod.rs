//! What a model may be missing: the catalogue of effects, and what each does to a specimen.
//!
//! Each effect's physics is defined here once; whoever simulates and whoever diagnoses use the same.
//!
//! ```text
//! EffectId, parameters -> Effect ; apply(effects, nominal specimen, circumstances) -> Seen
//! ```

mod apply;
mod catalogue;
mod effect;
mod joint_law;
mod parameters;

pub use apply::{Circumstances, Seen, SensorPlace, apply};
pub use catalogue::{EffectId, Group, Place};
pub use effect::Effect;
pub use joint_law::{JointLaw, JointLawKind, ModeMotion};
pub use parameters::{Dimension, ParameterInfo, ParameterScale};

/// Why an effect cannot be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No effect of that name.
    #[error("there is no effect `{name}`{}; effects are: {known}", did_you_mean(.nearest))]
    UnknownEffect {
        /// The name given.
        name: String,
        /// The name that comes nearest.
        nearest: Option<&'static str>,
        /// All names.
        known: String,
    },
    /// The effect has no parameter of that name.
    #[error("`{effect}` has no parameter `{name}`{}; it has: {known}", did_you_mean(.nearest))]
    UnknownParameter {
        /// The effect.
        effect: &'static str,
        /// The name given.
        name: String,
        /// The name that comes nearest.
        nearest: Option<&'static str>,
        /// The names there are.
        known: String,
    },
    /// A parameter given twice.
    #[error("`{effect}` is given `{name}` twice; give it once")]
    Twice {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
    },
    /// A parameter without a usual value is not given.
    #[error("`{effect}` needs `{name}`: {meaning}; it has no usual value")]
    Missing {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
        /// What it is.
        meaning: &'static str,
    },
    /// A value outside its range.
    #[error("`{effect}`: {name} is {value}, but must lie between {lowest} and {highest}{}", with_space(.unit))]
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        name: &'static str,
        /// The value given (SI).
        value: f64,
        /// Lowest possible value.
        lowest: f64,
        /// Highest possible value.
        highest: f64,
        /// Its unit.
        unit: &'static str,
    },
}

fn did_you_mean(nearest: &Option<&'static str>) -> String {
    nearest.map_or_else(String::new, |name| format!(", did you mean `{name}`?"))
}

fn with_space(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    }
}

/// The name nearest to `given`, if one is near at all.
fn nearest_name(given: &str, known: impl Iterator<Item = &'static str>) -> Option<&'static str> {
    // Below this two words have little in common.
    const LEAST_LIKENESS: f64 = 0.7;
    known
        .map(|name| (strsim::jaro_winkler(given, name), name))
        .filter(|(likeness, _)| *likeness > LEAST_LIKENESS)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}
