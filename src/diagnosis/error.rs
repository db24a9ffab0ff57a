//! Why a diagnosis has no answer at all.

/// Why a diagnosis cannot begin.
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
        /// What would do.
        least: usize,
    },
    /// No uncertainty, without which every misfit may be noise.
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
    /// Hardly a peak of one configuration is found again in another.
    #[error(
        "{first} and {second} do not show the same structure: {strangers} of the {peaks} peaks of {second} lie more \
         than {percent} % from every peak of {first}; diagnose recordings of one structure only"
    )]
    AnotherStructure {
        /// One configuration.
        first: String,
        /// The other.
        second: String,
        /// Peaks of the other that are not found in the one.
        strangers: usize,
        /// All peaks of the other.
        peaks: usize,
        /// How near they would have to lie (%).
        percent: f64,
    },
    /// Nothing was seen because every sensor sits where nothing moves.
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
    /// The nominal model has no modes.
    #[error("the nominal model cannot be solved: {0}")]
    Structure(#[from] tapjoint_beam::StructureError),
    /// Settings with which nothing can be compared.
    #[error("{setting}")]
    Setting {
        /// Which, and what is allowed.
        setting: &'static str,
    },
    /// No start led to a fit of the nominal model.
    #[error(
        "the nominal model could not be fitted to the frequencies; check the beam's description"
    )]
    NoFit,
}
