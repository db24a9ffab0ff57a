//! The data that pictures are drawn from.

use super::plot::amplitude::AmplitudeFigure;
use tapjoint_signal::modal::polyreference::PoleStability;
use tapjoint_signal::spectral::Lines;

/// What the pictures of one recording need.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingFigure {
    /// Its file, by as much of the end of its path as tells it from the others.
    pub file: String,
    /// Envelope over time of the channel on which taps were found; `None` where there are no samples.
    pub overview: Option<TimeOverview>,
    /// The spectra; `None` when no tap was accepted.
    pub spectra: Option<SpectraFigure>,
    /// Poles over the orders; `None` where none were looked for or found.
    pub stabilisation: Option<StabilisationFigure>,
    /// Frequency and damping against amplitude; `None` where no mode changes.
    pub amplitude: Option<AmplitudeFigure>,
}

/// Poles over the orders of a polyreference fit.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationFigure {
    /// The whole band, then the bands about groups of peaks.
    pub bands: Vec<StabilisationBand>,
}

/// One band's stabilisation diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationBand {
    /// Between these (Hz) modes are taken from this band.
    pub core: (f64, f64),
    /// Highest order.
    pub order: usize,
    /// Poles of all orders.
    pub poles: Vec<PoleMark>,
    /// Frequencies selected as modes (Hz).
    pub selected: Vec<f64>,
}

/// A pole in a stabilisation diagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleMark {
    /// Order it was found at.
    pub order: usize,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Damping ratio (1).
    pub damping_ratio: f64,
    /// What of it the order before had.
    pub stability: PoleStability,
}

/// Smallest and largest value in equal pieces of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeOverview {
    /// What is shown: "force (N)" or "response A (m/s2)".
    pub label: String,
    /// Length of a piece (s).
    pub step: f64,
    /// Smallest value in each piece.
    pub low: Vec<f64>,
    /// Largest value in each piece.
    pub high: Vec<f64>,
    /// Taps: time (s), peak value, accepted.
    pub taps: Vec<TapMark>,
}

/// A tap in the time overview.
#[derive(Debug, Clone, PartialEq)]
pub struct TapMark {
    /// Time (s).
    pub time: f64,
    /// Peak value (unit of the overview).
    pub peak: f64,
    /// Why it was rejected; `None` = accepted.
    pub rejected: Option<String>,
    /// The samples about it; `None` where they were not kept.
    pub close_up: Option<TapCloseUp>,
}

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapCloseUp {
    /// First sample (s from the trigger).
    pub start: f64,
    /// Distance of the samples (s).
    pub step: f64,
    /// The force, where there is one, and the first response.
    pub curves: Vec<TapCurve>,
}

/// A channel about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapCurve {
    /// "force" or "response A".
    pub label: String,
    /// Its unit: "N".
    pub unit: String,
    /// Every sample (unit), the channel's mean taken out.
    pub values: Vec<f64>,
}

/// Magnitudes over the lines.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectraFigure {
    /// The axis.
    pub lines: Lines,
    /// Taps averaged.
    pub averages: usize,
    /// Root mean square of the force's transforms (N s); `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// Unit of the force's transforms: "N s".
    pub force_unit: String,
    /// One curve for each response: its transform's root mean square (unit s).
    pub responses: Vec<Curve>,
    /// One curve for each frequency response function, complex parts kept; empty without a hammer.
    pub frfs: Vec<FrfCurve>,
    /// Resonances to mark.
    pub peaks: Vec<PeakMark>,
}

/// A named curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Sensor's name and what it senses: "A, acceleration".
    pub name: String,
    /// Unit of the values: "m/s2 s".
    pub unit: String,
    /// One value a line.
    pub values: Vec<f64>,
}

/// A frequency response function; where something does not exist stands what is no number (NaN).
#[derive(Debug, Clone, PartialEq)]
pub struct FrfCurve {
    /// Sensor's name.
    pub name: String,
    /// "accelerance", "mobility", "receptance" or "sound pressure per force".
    pub form: String,
    /// Its unit: "(m/s2)/N".
    pub unit: String,
    /// Magnitude (unit above).
    pub magnitude: Vec<f64>,
    /// Phase (degrees), -180 to 180.
    pub phase: Vec<f64>,
    /// The estimator: "H1".
    pub estimator: String,
    /// Magnitudes by other estimators, with their names (unit above); may be empty.
    pub others: Vec<(String, Vec<f64>)>,
    /// Coherence; `None` below two averages.
    pub coherence: Option<Vec<f64>>,
}

/// A resonance in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakMark {
    /// Mode number of this recording's peak, or `None` for mains and the like.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// Frequency on the line (Hz).
    pub line_frequency: f64,
    /// Bound of the line reading (Hz).
    pub half_line: f64,
    /// How far it stands out (dB): the most prominent peaks get their labels first.
    pub prominence_db: f64,
    /// "mains 50 Hz" and the like.
    pub label: Option<String>,
}
