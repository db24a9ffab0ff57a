//! Joint stiffness from natural frequencies: here measurement and theory meet.
//!
//! ```text
//! measured frequencies -> pairs      multi-linear regression over mode pairs (Ingole & Chatterjee)
//!                         frequency_fit  least squares on the frequencies themselves
//!                      -> estimate   with uncertainty, in SI units, with what speaks against it
//!                      -> predict    frequencies of the estimate beside the measured ones; modulus of a free beam
//!                      -> perturbation  how far errors in the frequencies move the estimate
//! ```
//!
//! [`observation`] holds what the measurement saw, for a diagnosis to compare with predictions. [`pairing`]
//! numbers the peaks.
//!
//! An estimate that no joint can have (negative, infinite, not positive definite) is a result with
//! a [`Doubt`], not an error; an error means that no number exists.

pub mod frequency_fit;
pub mod observation;
pub mod pairing;
pub mod pairs;
pub mod perturbation;
pub mod predict;

/// The name that reports give the frequency fit.
pub use frequency_fit as consistent;
pub use pairing::pair_modes;
pub use pairs::{
    Doubt, FREQUENCY_FLOOR, JointEstimate, MeasuredMode, ModeLambda, PairsEstimate, PairsModel,
    SingleMode, Uncertain, estimate_joint, estimate_pairs, pairs_estimator, single_mode_stiffness,
};
pub use perturbation::{MonteCarlo, Spread, Stiffnesses, monte_carlo};
pub use predict::{
    FreeBeamEstimate, PredictedMode, WeightedPeak, compare, estimate_modulus, pair_by_frequency,
    pair_by_ratio, predict, predict_lambdas,
};

use tapjoint_beam::StructureError;

/// Reason for which an estimate does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Fewer modes than the model has unknowns and one more.
    #[error(
        "{found} mode(s) given, but the {model} needs at least {needed}: its {unknowns} unknown(s) \
         and their product; measure more modes{simpler}"
    )]
    TooFewModes {
        /// The model, in words.
        model: &'static str,
        /// Number of its unknown stiffnesses.
        unknowns: usize,
        /// Number of modes that it needs.
        needed: usize,
        /// Number given.
        found: usize,
        /// A model that needs fewer, as the end of the sentence; empty where there is none.
        simpler: &'static str,
    },
    /// The modes given do not determine all unknowns.
    #[error(
        "the modes given determine only {rank} of the {unknowns} unknowns of the {model}; {remedy}"
    )]
    Undetermined {
        /// The model, in words.
        model: &'static str,
        /// Number of its unknowns.
        unknowns: usize,
        /// Rank of the regression.
        rank: usize,
        /// Advice.
        remedy: &'static str,
    },
    /// Fewer frequencies than unknowns.
    #[error(
        "{found} {} cannot determine {unknowns} unknowns; measure more modes, or estimate \
         fewer parameters", if *.found == 1 { "frequency" } else { "frequencies" }
    )]
    TooFewFrequencies {
        /// Number of parameters to be estimated.
        unknowns: usize,
        /// Number of frequencies given.
        found: usize,
    },
    /// More lengths of the beam than one fit takes.
    #[error(
        "the recordings have {found} free lengths, and one estimate takes up to {most}; leave out the recordings of \
         some lengths"
    )]
    TooManyLengths {
        /// Number of lengths given, that of the beam included.
        found: usize,
        /// Number of lengths allowed.
        most: usize,
    },
    /// Measured weights without an uncertainty to weigh by.
    #[error(
        "mode {mode} has no standard uncertainty to weigh it by; state half_line, std or scatter, \
         or take weights = \"relative\""
    )]
    NoUncertainty {
        /// The mode's number.
        mode: usize,
    },
    /// Nothing was asked for, or what the structure does not have.
    #[error(
        "there is nothing to estimate: name at least one parameter, and no joint stiffness of a \
         free beam"
    )]
    NothingToEstimate,
    /// A frequency that is no frequency.
    #[error("mode {mode} has the frequency {value}, but it must be positive and finite")]
    Frequency {
        /// The mode's number.
        mode: usize,
        /// Its frequency (Hz) or lambda (1).
        value: f64,
    },
    /// Two lists that belong together differ in length.
    #[error("{frequencies} frequencies but {bounds} bounds were given; one bound for each")]
    Bounds {
        /// Number of frequencies.
        frequencies: usize,
        /// Number of bounds.
        bounds: usize,
    },
    /// The beam or the joint cannot exist.
    #[error(transparent)]
    Structure(#[from] StructureError),
}
