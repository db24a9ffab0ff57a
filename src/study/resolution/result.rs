//! What the study found, as data.

use serde::Serialize;

use super::estimate::Estimators;
use super::plan::{BlockPlan, Layout};
use super::statistics::formula_percent;
use super::{ResolutionSettings, StudiedTest};
use tapjoint_analysis::EstimateMethod;
use tapjoint_description::{ReadBy, WindowKind};

/// A window of the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WindowName {
    /// None where the decay reaches 1 % in the block, else exponential.
    Automatic,
    /// None.
    Rectangular,
    /// Hann.
    Hann,
    /// Exponential.
    Exponential,
}

impl WindowName {
    /// As written.
    pub fn name(self) -> &'static str {
        match self {
            WindowName::Automatic => "automatic",
            WindowName::Rectangular => "rectangular",
            WindowName::Hann => "hann",
            WindowName::Exponential => "exponential",
        }
    }
}

impl From<WindowKind> for WindowName {
    fn from(kind: WindowKind) -> Self {
        match kind {
            WindowKind::Rectangular => WindowName::Rectangular,
            WindowKind::Hann => WindowName::Hann,
            WindowKind::Exponential => WindowName::Exponential,
        }
    }
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResolutionStudy {
    /// Virtual tests for each block size.
    pub draws: usize,
    /// Of these, fitted.
    pub fit_draws: usize,
    /// Seed.
    pub seed: u64,
    /// Damping ratio of every mode.
    pub damping: f64,
    /// Peak of the responses over the rms of their noise (dB).
    pub noise_db: f64,
    /// Wanted accuracy (rms, %).
    pub accuracy_percent: f64,
    /// Sample rate of the virtual recordings (Hz).
    pub sample_rate: f64,
    /// Modes that were studied.
    pub modes: Vec<StudiedMode>,
    /// Modes that were not.
    pub omitted: Vec<Omitted>,
    /// Stiffnesses that were estimated.
    pub stiffnesses: Vec<StudiedStiffness>,
    /// Lines of each block size.
    pub blocks: Vec<BlockLines>,
    /// Errors of the frequencies.
    pub frequency_errors: Vec<FrequencyError>,
    /// Errors of the stiffnesses.
    pub stiffness_errors: Vec<StiffnessError>,
    /// Block sizes that reach the wanted accuracy.
    pub answers: Vec<Answer>,
    /// The answer in one sentence.
    pub sentence: String,
}

/// A mode of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudiedMode {
    /// Number.
    pub mode: usize,
    /// Nominal natural frequency (Hz).
    pub frequency: f64,
    /// Band in which it is read (Hz).
    pub band: [f64; 2],
    /// Whether it enters the estimate.
    pub used: bool,
}

/// A mode that could not be studied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Omitted {
    /// Number.
    pub mode: usize,
    /// Nominal natural frequency (Hz).
    pub frequency: f64,
    /// Why.
    pub reason: String,
}

/// A stiffness of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudiedStiffness {
    /// "kx", "ky", "kz" (1), of a free beam "modulus" (Pa).
    pub parameter: &'static str,
    /// Nominal true value.
    pub value: f64,
    /// What the pair regression makes of exact frequencies, error in percent: it takes an Euler beam
    /// without sensors. Errors of its estimates count from there. `None` where it has no estimate.
    pub pairs_bias_percent: Option<f64>,
}

/// Lines of one block size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockLines {
    /// Block (samples).
    pub block: usize,
    /// Displayed lines, block/2.56.
    pub lines: usize,
    /// Half a line in percent of the band: 100/(2 lines).
    pub half_line_percent_of_band: f64,
    /// Each band.
    pub bands: Vec<BandLines>,
}

/// Lines of one block size in one band.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BandLines {
    /// Lower end (Hz).
    pub low: f64,
    /// Upper end (Hz).
    pub high: f64,
    /// Line spacing (Hz).
    pub spacing: f64,
    /// Bound of a line reading (Hz).
    pub half_line: f64,
    /// Length of record for one tap (s).
    pub seconds: f64,
    /// The window of each of the study's windows, as applied.
    pub windows: Vec<&'static str>,
}

/// Error of one mode's frequency over the draws.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrequencyError {
    /// Block (samples).
    pub block: usize,
    /// Window.
    pub window: WindowName,
    /// Reading.
    pub reading: ReadBy,
    /// Mode.
    pub mode: usize,
    /// Band (Hz).
    pub band: [f64; 2],
    /// Whether the estimates take the mode from this band.
    pub used: bool,
    /// Line spacing (Hz).
    pub spacing: f64,
    /// Half-line bound (Hz).
    pub half_line: f64,
    /// Standard deviation over the draws of the true frequency, in lines: from 0.5 on truths are as good
    /// as uniform over a line.
    pub spread_lines: Option<f64>,
    /// Draws that had a reading.
    pub found: usize,
    /// Of these, read by the method named; the others could be read on the line only.
    pub own: usize,
    /// Draws.
    pub draws: usize,
    /// rms error (Hz).
    pub rms: Option<f64>,
    /// Mean error (Hz).
    pub mean: Option<f64>,
    /// 95 % of the errors are not larger (Hz).
    pub p95: Option<f64>,
    /// Largest error (Hz).
    pub largest: Option<f64>,
}

/// Error of one stiffness over the draws.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StiffnessError {
    /// Block (samples).
    pub block: usize,
    /// Window.
    pub window: WindowName,
    /// Reading.
    pub reading: ReadBy,
    /// Estimator.
    pub method: EstimateMethod,
    /// "kx", "ky", "kz" or "modulus".
    pub parameter: &'static str,
    /// Draws that had an estimate: every mode was read, and the estimator converged.
    pub found: usize,
    /// Draws.
    pub draws: usize,
    /// rms error (%).
    pub rms_percent: Option<f64>,
    /// Mean error (%).
    pub mean_percent: Option<f64>,
    /// 95 % of the errors are not larger (%).
    pub p95_percent: Option<f64>,
    /// Largest error (%).
    pub largest_percent: Option<f64>,
    /// What errors uniform over a line give to first order, rms (%).
    pub line_rms_percent: Option<f64>,
    /// What half-line errors give at most, to first order (%).
    pub half_line_bound_percent: Option<f64>,
}

/// The smallest block that reaches the wanted accuracy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// Window.
    pub window: WindowName,
    /// Reading.
    pub reading: ReadBy,
    /// Estimator.
    pub method: EstimateMethod,
    /// Block (samples); `None` where none in the range does.
    pub block: Option<usize>,
    /// Length of record for one tap (s), the longest of its bands.
    pub seconds: Option<f64>,
}

/// The study before its draws.
pub(super) fn empty(
    test: &StudiedTest,
    settings: &ResolutionSettings,
    (layout, plans): (&Layout, &[BlockPlan]),
    estimators: &Estimators,
) -> ResolutionStudy {
    let mode = |mode: &super::plan::ModePlan| StudiedMode {
        mode: mode.number,
        frequency: mode.frequency,
        band: layout.band(mode.band),
        used: mode.used,
    };
    ResolutionStudy {
        draws: settings.draws,
        fit_draws: settings.fit_draws.min(settings.draws),
        seed: settings.seed,
        damping: settings.damping_ratio,
        noise_db: settings.noise_db,
        accuracy_percent: 100.0 * settings.accuracy,
        sample_rate: layout.sample_rate,
        modes: layout.modes.iter().map(mode).collect(),
        omitted: layout.omitted.clone(),
        stiffnesses: estimators.described(&test.joint),
        blocks: plans.iter().map(block_lines).collect(),
        frequency_errors: Vec::new(),
        stiffness_errors: Vec::new(),
        answers: Vec::new(),
        sentence: String::new(),
    }
}

fn block_lines(plan: &BlockPlan) -> BlockLines {
    let band = |band: &super::plan::BandPlan| BandLines {
        low: band.lines.low,
        high: band.lines.high,
        spacing: band.lines.spacing,
        half_line: band.lines.half_line(),
        seconds: band.lines.duration,
        windows: band.windows.iter().map(|window| window.name()).collect(),
    };
    let lines = plan.bands.first().map_or(0, |band| band.lines.displayed());
    BlockLines {
        block: plan.block,
        lines,
        half_line_percent_of_band: formula_percent(lines),
        bands: plan.bands.iter().map(band).collect(),
    }
}
