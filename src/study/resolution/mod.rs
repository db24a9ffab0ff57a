//! Spectral resolution error: from block size, band, window and reading to the error of each natural
//! frequency and of each joint stiffness.
//!
//! Every draw is a virtual test of one tap. Its beam and joint differ a little from the nominal ones,
//! so that natural frequencies fall anywhere between two lines; its recording is transformed and read
//! by the measurement stage, and its joint estimated by the estimators that a real test meets. Each
//! draw is judged by its own truth, so that nothing but the reading is left in its errors.

mod estimate;
mod plan;
mod result;
mod statistics;
mod virtual_test;

pub use result::{
    Answer, BandLines, BlockLines, FrequencyError, Omitted, ResolutionStudy, StiffnessError,
    StudiedMode, StudiedStiffness, WindowName,
};
pub use statistics::formula_percent;
pub use tapjoint_analysis::EstimateMethod;
pub use tapjoint_description::ReadBy;

use rayon::prelude::*;

use estimate::Estimators;
use plan::{BlockPlan, Layout};
use tapjoint_analysis::{StructureDetails, TestedStructure};
use tapjoint_beam::{JointStiffness, StructureError};
use tapjoint_identify::IdentifyError;
use tapjoint_signal::spectral::SpectralError;
use virtual_test::{Truths, drawn};

/// What is tested virtually.
#[derive(Debug, Clone, PartialEq)]
pub struct StudiedTest {
    /// The structure as described.
    pub structure: TestedStructure,
    /// What else is known of it: sensors' masses, a lap joint's layout.
    pub details: StructureDetails,
    /// The joint about which draws vary.
    pub joint: JointStiffness,
    /// Where the hammer strikes (m).
    pub tap: f64,
    /// Where the sensors sit (m).
    pub sensors: Vec<f64>,
    /// Bands (Hz) in which modes are read, each mode in the narrowest that holds it; empty = one from 0
    /// to a quarter above the highest mode.
    pub bands: Vec<(f64, f64)>,
    /// Modes wanted where no band is given.
    pub modes: usize,
    /// The first so many modes enter the estimate; `None` = all.
    pub fit_modes: Option<usize>,
}

/// How the study is made.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolutionSettings {
    /// Block sizes (samples). 512 to 65536 in octaves: 200 to 25600 displayed lines.
    pub blocks: Vec<usize>,
    /// Windows. Chosen by the decay, as in a test that asks for none.
    pub windows: Vec<WindowName>,
    /// Readings. All three.
    pub readings: Vec<ReadBy>,
    /// Virtual tests for each block size. 1000: an rms error then has a standard error of 1 to 2 %.
    pub draws: usize,
    /// Of these, so many are fitted too. 100: a fit takes longer than all else, and its errors of some
    /// hundredths of a line need no more digits.
    pub fit_draws: usize,
    /// Damping ratio of every mode. 0.003: a bolted steel beam.
    pub damping_ratio: f64,
    /// Peak of each response over the rms of its noise (dB). 60: a decent laboratory.
    pub noise_db: f64,
    /// Wanted relative accuracy (rms) of every stiffness. 0.05.
    pub accuracy: f64,
    /// Seed of all draws.
    pub seed: u64,
}

impl Default for ResolutionSettings {
    fn default() -> Self {
        ResolutionSettings {
            blocks: (9..=16).map(|power| 1 << power).collect(),
            windows: vec![WindowName::Automatic],
            readings: ReadBy::ALL.to_vec(),
            draws: 1000,
            fit_draws: 100,
            damping_ratio: 0.003,
            noise_db: 60.0,
            accuracy: 0.05,
            seed: 1,
        }
    }
}

/// What stops a study.
#[derive(Debug, thiserror::Error)]
pub enum ResolutionError {
    /// No band holds a mode.
    #[error(
        "no natural frequency lies in the bands: the lowest are {lowest} Hz, and a band must reach {room} % \
         beyond a mode; give --band LO:HI"
    )]
    NoModes {
        /// The lowest natural frequencies.
        lowest: String,
        /// Room that a mode needs (%).
        room: f64,
    },
    /// A record would not fit into memory.
    #[error(
        "a block of {block} samples in the band {low} to {high} Hz is {seconds:.0} s at {rate:.0} samples/s, {most} \
         samples are the limit; give smaller blocks, or wider bands"
    )]
    TooLong {
        /// Block (samples).
        block: usize,
        /// Lower end (Hz).
        low: f64,
        /// Upper end (Hz).
        high: f64,
        /// Length of the record (s).
        seconds: f64,
        /// Sample rate (Hz).
        rate: f64,
        /// Longest record (samples).
        most: usize,
    },
    /// The joint has no frequencies.
    #[error(transparent)]
    Structure(#[from] StructureError),
    /// The joint cannot be estimated from the modes studied.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A band or block that is none.
    #[error(transparent)]
    Spectral(#[from] SpectralError),
}

/// Makes the study. `progress` is told after each virtual test, from whatever thread, how many of all
/// are done.
///
/// # Errors
/// [`ResolutionError`] where bands, blocks or the joint cannot be.
pub fn study_resolution(
    test: &StudiedTest,
    settings: &ResolutionSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<ResolutionStudy, ResolutionError> {
    let truths = Truths::new(test)?;
    let layout = Layout::new(test, &truths)?;
    let estimators = Estimators::new(test, &layout)?;
    let plans = settings
        .blocks
        .iter()
        .map(|&block| BlockPlan::new(block, &layout, settings, (test, &truths)))
        .collect::<Result<Vec<_>, _>>()?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let total = plans.len() * settings.draws;
    let mut study = result::empty(test, settings, (&layout, &plans), &estimators);
    for (number, plan) in plans.iter().enumerate() {
        // Collected in order: sums are then the same whatever the number of threads.
        let outcomes: Vec<virtual_test::Outcome> = (0..settings.draws)
            .into_par_iter()
            .map(|index| {
                let outcome = drawn(
                    plan,
                    (number, index),
                    settings,
                    (test, &truths, &estimators),
                );
                let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                progress(count, total);
                outcome
            })
            .collect();
        statistics::gather(
            &mut study,
            plan,
            &outcomes,
            (settings, &layout, &estimators),
        );
    }
    statistics::conclude(&mut study, settings);
    Ok(study)
}
