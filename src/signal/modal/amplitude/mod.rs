//! Natural frequency and damping of each mode against amplitude, along the decays of a recording.
//!
//! A joint that slips softens and dissipates more the harder it is driven: frequency and damping of a
//! mode then drift along every decay. Five steps:
//! 1. *Band* (`band`): every response is mixed down to the mode's frequency and low-pass filtered by
//!    a finite filter of length M that is only ever laid over samples that exist. An exponential stays
//!    an exponential that way, so the abrupt start of the decay leaves no transient; the price is that
//!    the first value belongs to the time M/2 after the start.
//! 2. *Sensors* (`band`): their bands are added with the weights of best signal to noise.
//! 3. *Whole decay* (`decay`): fits to it find everything else in the band (neighbouring modes, hum,
//!    unlisted lines). The same fits say whether poles that do not change explain the decay as well as
//!    one pole that does. Two close modes beat, and a beat is no amplitude dependence.
//! 4. *Segments* (`decay`): pieces that do not overlap, each fitted by the mode's pole with everything
//!    else held near the model of the whole decay.
//! 5. *Trend* (`trend`): points of all segments and taps against log amplitude.
//!
//! A point is an average over its segment, attributed to the time at which a linear drift
//! has the same value. How the drift bends within the segment is taken from the fit to the whole decay.
//! The error of that fit within a segment (at most [`AmplitudeSettings::longest`] of the decay time)
//! remains as bias. Frequencies are undamped natural frequencies. Damping is the rate at which the
//! measured quantity falls: for an acceleration that contains omega squared, whose own drift is a few
//! thousandths of it and is left in. An unlisted neighbour nearer than about the half-power width
//! cannot be distinguished from a drift by one decay.

mod band;
mod decay;
mod trend;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

pub use trend::{AmplitudeReading, Trend};

use super::from_one;
use decay::DecayModel;

/// The ringing after one tap, force no longer acting.
#[derive(Debug, Clone, PartialEq)]
pub struct Decay {
    /// Time of the first sample after the tap (s).
    pub start: f64,
    /// Samples per second (Hz).
    pub sample_rate: f64,
    /// Samples of every sensor, in the same order for all taps.
    pub responses: Vec<Vec<f64>>,
}

/// A mode, roughly known: within its half-power width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownMode {
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Damping ratio (1), within a factor of about three.
    pub damping_ratio: f64,
}

/// Settings of the cut and the judgement of decays. Times are shares of the decay time 1/sigma, or of a quarter of the
/// record where that is shorter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeSettings {
    /// Length of the band filter where neighbours leave room: 0.1. It decides how early the curve
    /// begins.
    pub filter: f64,
    /// Longest filter accepted to keep a neighbour out; one that is nearer is fitted instead: 0.35.
    pub longest_filter: f64,
    /// Shortest segment: 0.15.
    pub shortest: f64,
    /// Longest segment: 0.7, over which the amplitude falls to a half.
    pub longest: f64,
    /// Uncertainty of the damping at which a segment is long enough, relative: 3 %.
    pub aim: f64,
    /// Uncertainty of the damping at which the curve ends, relative: 40 %, where the mode stands about
    /// 18 dB above the noise of a segment.
    pub end: f64,
    /// Level of the test for a change: 1 %, since a recording has many modes to be tested.
    pub level: f64,
}

impl Default for AmplitudeSettings {
    fn default() -> Self {
        AmplitudeSettings {
            filter: 0.1,
            longest_filter: 0.35,
            shortest: 0.15,
            longest: 0.7,
            aim: 0.03,
            end: 0.4,
            level: 0.01,
        }
    }
}

/// One segment of one decay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct AmplitudePoint {
    /// Number of the tap, from 0; in outputs from 1.
    #[serde(serialize_with = "from_one")]
    pub tap: usize,
    /// Time after the tap (s).
    pub time: f64,
    /// Peak amplitude of the strongest sensor (its unit).
    pub amplitude: f64,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Its standard uncertainty (Hz).
    pub frequency_std: f64,
    /// Damping ratio (1).
    #[serde(rename = "damping")]
    pub damping_ratio: f64,
    /// Its standard uncertainty (1).
    pub damping_std: f64,
}

/// A line in the mode's band that was fitted along with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Companion {
    /// Number of the decay, from 0.
    pub tap: usize,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its amplitude over the mode's at the start of the decay.
    pub share: f64,
    /// Its origin.
    pub origin: Origin,
}

/// Origin of a companion line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// It is one of the modes given.
    Listed,
    /// It was found in the residual of the fit: hum, or an unlisted mode.
    Found,
}

/// What a curve says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(into = "&'static str")]
pub enum AmplitudeVerdict {
    /// Frequency or damping changes along the decay by more than its uncertainty.
    Changes,
    /// Neither changes by more than its uncertainty.
    Steady,
    /// The curve changes, but poles that do not change explain the decay as well: a neighbour at
    /// `frequency` (Hz) beats with the mode.
    Beating {
        /// Frequency of the neighbour (Hz).
        frequency: f64,
    },
    /// A mode given lies nearer than the decay can tell apart.
    Unresolved {
        /// Frequency of that mode (Hz).
        frequency: f64,
    },
    /// Fewer points than a trend needs.
    TooFewPoints,
}

impl From<AmplitudeVerdict> for &'static str {
    fn from(verdict: AmplitudeVerdict) -> &'static str {
        match verdict {
            AmplitudeVerdict::Changes => "changes",
            AmplitudeVerdict::Steady => "steady",
            AmplitudeVerdict::Beating { .. } => "beating",
            AmplitudeVerdict::Unresolved { .. } => "unresolved",
            AmplitudeVerdict::TooFewPoints => "too-few-points",
        }
    }
}

/// Frequency and damping of one mode against amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeCurve {
    /// The mode as given.
    pub mode: KnownMode,
    /// Points of all taps: by tap, then by time; independent of each other.
    pub points: Vec<AmplitudePoint>,
    /// Sensor (0-based) whose amplitude is given; `None` without points.
    pub sensor: Option<usize>,
    /// Length of the band filter (s). The first half of it has no points.
    pub filter_length: Option<f64>,
    /// Frequency (Hz) against log amplitude; `None` with too few points.
    pub frequency: Option<Trend>,
    /// Damping ratio against log amplitude; `None` with too few points.
    pub damping: Option<Trend>,
    /// Lines fitted along with the mode.
    pub companions: Vec<Companion>,
    /// Verdict on the curve.
    pub verdict: AmplitudeVerdict,
}

/// Farthest that a point may lie from its mode's frequency (1, relative). Joints that slip move a frequency by a few
/// percent; a segment that is fitted farther off has followed noise or another mode.
const FARTHEST: f64 = 0.1;

/// Least points of a trend: two of its own, and two more for its uncertainty.
const LEAST_POINTS: usize = 4;

/// Follows frequency and damping against amplitude, for every mode.
pub fn follow_amplitude(
    decays: &[Decay],
    modes: &[KnownMode],
    settings: &AmplitudeSettings,
) -> Vec<AmplitudeCurve> {
    (0..modes.len())
        .into_par_iter()
        .map(|mode| follow_mode(decays, modes, mode, settings))
        .collect()
}

fn follow_mode(
    decays: &[Decay],
    modes: &[KnownMode],
    index: usize,
    settings: &AmplitudeSettings,
) -> AmplitudeCurve {
    let mode = modes[index];
    let mut curve = AmplitudeCurve {
        mode,
        points: Vec::new(),
        sensor: None,
        filter_length: None,
        frequency: None,
        damping: None,
        companions: Vec::new(),
        verdict: AmplitudeVerdict::TooFewPoints,
    };
    let bands = band::extract_bands(decays, modes, index, settings);
    curve.sensor = band::strongest(&bands);
    let Some(sensor) = curve.sensor else {
        return curve;
    };
    curve.filter_length = bands.iter().map(|band| band.filter).max_by(f64::total_cmp);
    let (mut doubts, mut followed) = (Vec::new(), 0);
    for band in &bands {
        let Some(series) = band::combine(band, sensor) else {
            continue;
        };
        let model = DecayModel::fit(&series, band);
        let mut points = decay::follow_decay(&series, band, &model, settings);
        let found = !points.is_empty();
        points.retain(|point| (point.frequency / mode.frequency - 1.0).abs() <= FARTHEST);
        if found && points.is_empty() {
            // The decay that was followed is not the mode's.
            continue;
        }
        curve.companions.extend(model.companions(band));
        curve.points.extend(points);
        doubts.extend(model.doubt(band));
        followed += 1;
    }
    if curve.points.len() < LEAST_POINTS {
        return curve;
    }
    curve.frequency = Trend::fit(&curve.points, |p| (p.frequency, p.frequency_std));
    curve.damping = Trend::fit(&curve.points, |p| (p.damping_ratio, p.damping_std));
    let changes = [&curve.frequency, &curve.damping]
        .into_iter()
        .flatten()
        // Two tests share the level (Bonferroni).
        .any(|trend| trend.p_value < 0.5 * settings.level);
    curve.verdict = match doubts.first() {
        _ if !changes => AmplitudeVerdict::Steady,
        // One decay without a doubt settles it for all.
        Some(doubt) if doubts.len() == followed => *doubt,
        _ => AmplitudeVerdict::Changes,
    };
    curve
}
