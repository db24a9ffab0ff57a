//! Results of the study as data, with the answers and doubts that follow from them.

use serde::Serialize;
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
    /// Number of them that were fitted.
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
    /// True where the mode enters the estimate.
    pub used: bool,
}

/// A mode that could not be studied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Omitted {
    /// Number.
    pub mode: usize,
    /// Nominal natural frequency (Hz).
    pub frequency: f64,
    /// The reason.
    pub reason: String,
}

/// A stiffness of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudiedStiffness {
    /// "kx", "ky", "kz" (1), of a free beam "modulus" (Pa).
    pub parameter: &'static str,
    /// Nominal true value.
    pub value: f64,
    /// Error of the pair regression from exact frequencies (%): it assumes an Euler beam without sensors. The
    /// errors of its estimates count from there. `None` where it has no estimate.
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
    /// True where the estimates take the mode from this band.
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
    /// Number of them that were read by the method named; the others could be read on the line only.
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
    /// rms error that frequency errors uniform over a line cause, to first order (%).
    pub line_rms_percent: Option<f64>,
    /// Largest error that frequency errors of half a line cause, to first order (%).
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

/// Least share of the draws that must have an estimate.
const LEAST_SHARE: f64 = 0.95;
/// Least spread of the truths (lines) that is as good as uniform over a line.
const LEAST_SPREAD: f64 = 0.35;

/// Half a line in percent of the band, 100/(2 lines): Ingole & Chatterjee, section 3.3.
pub fn formula_percent(lines: usize) -> f64 {
    100.0 / (2.0 * lines as f64)
}

impl ResolutionStudy {
    /// Adds the smallest sufficient block for each window, reading and estimator, and the sentence.
    pub(super) fn conclude(&mut self, windows: &[WindowName], readings: &[ReadBy]) {
        for &window in windows {
            for &reading in readings {
                for method in EstimateMethod::ALL {
                    let answer = self.answer(window, reading, method);
                    self.answers.push(answer);
                }
            }
        }
        let subject = match self.stiffnesses.len() {
            1 => "the stiffness",
            _ => "every stiffness",
        };
        self.sentence = format!(
            "For {} % (rms) in {subject} the consistent estimate needs {}; the pair regression needs {}.",
            self.accuracy_percent,
            self.needs(EstimateMethod::Consistent),
            self.needs(EstimateMethod::Pairs)
        );
    }

    fn answer(&self, window: WindowName, reading: ReadBy, method: EstimateMethod) -> Answer {
        let mut sufficient: Vec<usize> = self.blocks.iter().map(|lines| lines.block).collect();
        for row in &self.stiffness_errors {
            let is_accurate = row
                .rms_percent
                .is_some_and(|rms| rms <= self.accuracy_percent)
                && row.found as f64 >= LEAST_SHARE * row.draws as f64;
            if (row.window, row.reading, row.method) == (window, reading, method) && !is_accurate {
                sufficient.retain(|&block| block != row.block);
            }
        }
        let block = sufficient.into_iter().min();
        Answer {
            window,
            reading,
            method,
            block,
            seconds: block.map(|block| self.seconds(block)),
        }
    }

    /// Returns the longest record (s) that a block takes in the bands of the modes used.
    fn seconds(&self, block: usize) -> f64 {
        let lines = self.blocks.iter().filter(|lines| lines.block == block);
        lines
            .flat_map(|lines| &lines.bands)
            .filter(|band| {
                let mut modes = self.modes.iter();
                modes.any(|mode| mode.used && mode.band == [band.low, band.high])
            })
            .map(|band| band.seconds)
            .fold(0.0, f64::max)
    }

    /// "a block of 512 or less (1 s a tap) read on the line, ...": the smallest block of each reading.
    fn needs(&self, method: EstimateMethod) -> String {
        let blocks: Vec<usize> = self.blocks.iter().map(|lines| lines.block).collect();
        let least = blocks.iter().copied().min().unwrap_or(0);
        let most = blocks.iter().copied().max().unwrap_or(0);
        let several_windows = self
            .answers
            .iter()
            .any(|answer| answer.window != self.answers[0].window);
        let mut parts = Vec::new();
        for answer in self.answers.iter().filter(|one| one.method == method) {
            let mut how = match answer.reading {
                ReadBy::Line => "read on the line",
                ReadBy::Interpolated => "read between the lines",
                ReadBy::Fit => "fitted",
            }
            .to_owned();
            if several_windows {
                how = format!("{how} (window {})", answer.window.name());
            }
            parts.push(match (answer.block, answer.seconds) {
                (Some(block), Some(seconds)) => {
                    let less = if block == least { " or less" } else { "" };
                    // Three digits, without zeros at the end.
                    let decimals =
                        (2.0 - seconds.max(1e-3).log10().floor()).clamp(0.0, 3.0) as usize;
                    let mut time = format!("{seconds:.decimals$}");
                    if time.contains('.') {
                        time = time.trim_end_matches('0').trim_end_matches('.').to_owned();
                    }
                    format!("a block of {block}{less} ({time} s a tap) {how}")
                }
                _ if least == most => format!("more than a block of {most} {how}"),
                _ => format!("another block than {least} to {most} {how}"),
            });
        }
        parts.join(", ")
    }

    /// Returns the doubts about the numbers of the study, each a code and a text.
    pub fn doubts(&self) -> Vec<(&'static str, String)> {
        let mut doubts = Vec::new();
        for mode in &self.omitted {
            doubts.push((
                "mode-not-studied",
                format!("mode {} is not studied: {}", mode.mode, mode.reason),
            ));
        }
        for mode in &self.modes {
            let own = self.frequency_errors.iter();
            let own = own.filter(|row| row.used && row.mode == mode.mode);
            let missed = own
                .clone()
                .filter(|row| (row.found as f64) < LEAST_SHARE * row.draws as f64);
            if let Some(largest) = missed.map(|row| row.block).max() {
                doubts.push((
                    "mode-missed",
                    format!(
                        "mode {} is missed in more than 5 % of the tests at blocks up to {largest}: those \
                         tests have no estimate",
                        mode.mode
                    ),
                ));
            }
            let narrow = own.filter(|row| row.spread_lines.is_some_and(|s| s < LEAST_SPREAD));
            if let Some(largest) = narrow.map(|row| row.block).max() {
                doubts.push((
                    "narrow-spread",
                    format!(
                        "mode {} varies by less than a line at blocks up to {largest}: its errors there \
                         depend on where it lies; a narrower band has finer lines",
                        mode.mode
                    ),
                ));
            }
        }
        // Modes whose peak is so wide that from some block on finer lines read it no better.
        for mode in &self.modes {
            let width = 2.0 * self.damping * mode.frequency;
            let rows = self.frequency_errors.iter().filter(|row| {
                let of_line = (row.mode, row.reading) == (mode.mode, ReadBy::Line);
                of_line && row.band == mode.band && row.spacing < width
            });
            // Errors uniform over a line have this rms; a tenth more is beyond the draws' chance.
            let worse = rows.filter(|row| row.rms > Some(1.1 * row.spacing / 12f64.sqrt()));
            if let Some(block) = worse.map(|row| row.block).min() {
                doubts.push((
                    "wide-peak",
                    format!(
                        "mode {} is {width:.2} Hz wide at half power: from a block of {block} on noise moves the \
                         reading of its line, and finer lines help less than they promise",
                        mode.mode
                    ),
                ));
            }
        }
        for stiffness in &self.stiffnesses {
            if stiffness.pairs_bias_percent.is_none() {
                doubts.push((
                    "no-pairs",
                    format!(
                        "the pair regression has no estimate of {} even from exact frequencies",
                        stiffness.parameter
                    ),
                ));
            }
        }
        doubts
    }
}
