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
//! 4. *Segments* (`segments`): pieces that do not overlap, each fitted by the mode's pole with everything
//!    else held near the model of the whole decay.
//! 5. *Trend* ([`Trend`]): points of all segments and taps against log amplitude.
//!
//! A point is an average over its segment, attributed to the time at which a linear drift
//! has the same value. How the drift bends within the segment is taken from the fit to the whole decay.
//! The error of that fit within a segment (at most 0.7 of the decay time)
//! remains as bias. Frequencies are undamped natural frequencies. Damping is the rate at which the
//! measured quantity falls: for an acceleration that contains omega squared, whose own drift is a few
//! thousandths of it and is left in. An unlisted neighbour nearer than about the half-power width
//! cannot be distinguished from a drift by one decay.

mod band;
mod decay;
mod exponentials;
mod followed;
mod segments;
mod stated;
mod trend;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::from_one;
use followed::FollowedMode;
pub use stated::{Drift, FrequencyAtAmplitude};
pub use trend::{AmplitudeReading, Trend};

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
    /// Part of its first amplitude at which it has that frequency; where it is not known, that of a fit of the whole decay.
    pub amplitude_part: Option<f64>,
}

// Times below are shares of the decay time 1/sigma, or of a quarter of the record where that is shorter.

/// Length of the band filter where neighbours leave room: 0.1. It decides how early the curve begins.
const FILTER: f64 = 0.1;
/// Longest filter accepted to keep a neighbour out; one that is nearer is fitted instead: 0.35.
const LONGEST_FILTER: f64 = 0.35;
/// Shortest segment: 0.15.
const SHORTEST: f64 = 0.15;
/// Longest segment: 0.7, over which the amplitude falls to a half.
const LONGEST: f64 = 0.7;
/// Uncertainty of the damping at which a segment is long enough, relative: 3 %.
const AIM: f64 = 0.03;
/// Uncertainty of the damping at which the curve ends, relative: 40 %, where the mode stands about
/// 18 dB above the noise of a segment.
const END: f64 = 0.4;
/// Rounds in which neighbours that drift are subtracted. 2: the second knows them without each other.
const ROUNDS: usize = 2;
/// Level of the test for a change: 1 %, since a recording has many modes to be tested.
const LEVEL: f64 = 0.01;

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

/// A line in the mode's band that was fitted along with it: a listed mode, an unlisted one, or hum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Companion {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Its amplitude over the mode's at the start of the decay.
    pub share: f64,
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
    /// Another given mode lies so near that one decay cannot separate the two.
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
    /// Amplitude at which a pole that does not change has the frequency of one that does (unit of the sensor); `None`
    /// where no decay was followed.
    pub reference: Option<f64>,
    /// The frequency there, where the decays show that it changes.
    pub drift: Option<Drift>,
}

/// Farthest that a point may lie from its mode's frequency (1, relative). Joints that slip move a frequency by a few
/// percent; a segment that is fitted farther off has followed noise or another mode.
const FARTHEST: f64 = 0.1;

/// Least points of a trend: two of its own, and two more for its uncertainty.
const LEAST_POINTS: usize = 4;

/// Modes followed along the decays.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedModes {
    /// What the decays say of each mode.
    pub curves: Vec<AmplitudeCurve>,
    /// Modes whose frequency changes, and which `rest` no longer has.
    pub subtracted: Vec<usize>,
    /// Decays without those modes; `None` without any.
    pub rest: Option<Vec<Decay>>,
}

/// Follows frequency and damping against amplitude, for every mode. `steady_lines`: frequencies of hum (Hz); no change of
/// the stated frequency is read in a band that holds one.
///
/// A neighbour whose frequency changes is no line. It is subtracted as its own model has it, and the mode is followed
/// again.
pub fn follow_amplitude(
    decays: &[Decay],
    modes: &[KnownMode],
    steady_lines: &[f64],
) -> FollowedModes {
    let indices = (0..modes.len()).into_par_iter();
    let followed = indices.map(|index| FollowedMode::new(decays, modes, index, &[]));
    let mut followed: Vec<Option<FollowedMode>> = followed.collect();
    let mut modes = modes.to_vec();
    for _ in 0..ROUNDS {
        let dampings: Vec<Option<f64>> = followed
            .iter()
            .map(|mode| mode.as_ref().and_then(FollowedMode::other_damping))
            .collect();
        for (mode, damping) in modes.iter_mut().zip(&dampings) {
            mode.damping_ratio = damping.unwrap_or(mode.damping_ratio);
        }
        let again = followed.par_iter().flatten().filter_map(|mode| {
            let neighbours = followed.iter().flatten();
            let neighbours: Vec<&FollowedMode> = neighbours
                .filter(|other| other.drifts && mode.is_disturbed_by(other))
                .collect();
            let taken: Vec<usize> = neighbours.iter().map(|other| other.index).collect();
            let has_changed = !taken.is_empty() || dampings[mode.index].is_some();
            let rest = has_changed.then(|| without(&neighbours, decays))?;
            FollowedMode::new(&rest, &modes, mode.index, &taken)
        });
        let again: Vec<FollowedMode> = again.collect();
        if again.is_empty() {
            break;
        }
        for mode in again {
            let index = mode.index;
            followed[index] = Some(mode);
        }
    }
    let drifting = followed.iter().flatten().filter(|mode| {
        let mut others = followed.iter().flatten();
        mode.drifts && others.all(|other| other.index == mode.index || other.is_apart_from(mode))
    });
    let drifting: Vec<&FollowedMode> = drifting.collect();
    let curves = followed.iter().map(|mode| match mode {
        Some(mode) => mode.curve(steady_lines),
        None => AmplitudeCurve::without_points(None),
    });
    FollowedModes {
        curves: curves.collect(),
        subtracted: drifting.iter().map(|mode| mode.index).collect(),
        rest: (!drifting.is_empty()).then(|| without(&drifting, decays)),
    }
}

/// Returns the decays without some modes.
fn without(modes: &[&FollowedMode], decays: &[Decay]) -> Vec<Decay> {
    let mut rest = decays.to_vec();
    for mode in modes {
        mode.subtract_from(&mut rest);
    }
    rest
}

/// Returns true where a frequency (Hz) is too far from that of its mode to be of it.
fn is_far(frequency: f64, mode: f64) -> bool {
    (frequency / mode - 1.0).abs() > FARTHEST
}
