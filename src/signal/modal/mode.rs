//! One list of modes from several recordings and bands.

use serde::Serialize;
use std::fmt;

use super::amplitude::AmplitudeCurve;
use super::fit::{ModalConstant, ModeFit};

/// One resonance as one recording reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeReading {
    /// Best frequency (Hz).
    pub frequency: f64,
    /// Where that comes from.
    pub source: ReadBy,
    /// Its interval (Hz): 95 % of a fit, the bounds of a reading between the lines or on one.
    pub interval: (f64, f64),
    /// Frequency of the peak's line, without a peak of the nearest one (Hz).
    pub line_frequency: f64,
    /// Bound of the line reading (Hz).
    pub half_line: f64,
    /// Frequency between the lines (Hz), where it could be had.
    pub interpolated: Option<f64>,
    /// Bound of that (Hz).
    pub bound: Option<f64>,
    /// Standard deviation of the best frequency (Hz).
    pub std: Option<f64>,
    /// Damping ratio.
    pub damping_ratio: Option<f64>,
    /// Its standard deviation.
    pub damping_std: Option<f64>,
    /// How far the peak stands out (dB); `None` of a mode that makes no peak.
    pub prominence_db: Option<f64>,
    /// Height above the noise (dB), where known.
    pub above_noise_db: Option<f64>,
    /// What it is when it is no mode of the structure.
    pub label: Option<PeakLabel>,
    /// The fit of the mode, where it succeeded.
    pub fit: Option<Box<FittedReading>>,
}

/// Way of reading a natural frequency, wanted or used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadBy {
    /// By a fit of decaying oscillations, with a standard deviation. Modes that cannot be fitted are read
    /// between the lines or on their line.
    #[default]
    Fit,
    /// Between the lines about the peak, or on its line where that fails.
    Interpolated,
    /// On the highest spectral line, as Ingole & Chatterjee read their frequencies.
    Line,
}

impl ReadBy {
    /// All ways, from the coarsest to the finest.
    pub const ALL: [Self; 3] = [Self::Line, Self::Interpolated, Self::Fit];

    /// Name in descriptions and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Interpolated => "interpolated",
            Self::Fit => "fit",
        }
    }
}

impl ModeReading {
    /// A frequency read on a spectral line (Hz) and known to half a line (Hz), of which nothing else is known.
    pub fn on_line(frequency: f64, half_line: f64) -> Self {
        let mut reading = ModeReading {
            frequency,
            source: ReadBy::Line,
            interval: (frequency, frequency),
            line_frequency: frequency,
            half_line,
            interpolated: None,
            bound: None,
            std: None,
            damping_ratio: None,
            damping_std: None,
            prominence_db: None,
            above_noise_db: None,
            label: None,
            fit: None,
        };
        reading.prefer(ReadBy::Line);
        reading
    }

    /// Takes as the best frequency what `wanted` gives, or the next best that there is: fit, between
    /// the lines, line. The damping stays that of the fit, or of the reading between the lines.
    pub fn prefer(&mut self, wanted: ReadBy) {
        let fit = self.fit.as_deref().map(|fit| &fit.mode);
        if let Some(fit) = fit {
            self.damping_ratio = Some(fit.damping_ratio.value);
            self.damping_std = Some(fit.damping_ratio.std);
        }
        let fitted = fit
            .filter(|_| wanted == ReadBy::Fit)
            .map(|fit| fit.frequency);
        let between = self
            .interpolated
            .zip(self.bound)
            .filter(|_| wanted != ReadBy::Line);
        let within = |value: f64, bound: f64| (value - bound, value + bound);
        (self.frequency, self.source, self.std, self.interval) = match (fitted, between) {
            (Some(fit), _) => (fit.value, ReadBy::Fit, Some(fit.std), (fit.low, fit.high)),
            (None, Some((value, bound))) => (
                value,
                ReadBy::Interpolated,
                // The bound is two standard deviations.
                Some(0.5 * bound),
                within(value, bound),
            ),
            // On a line the truth lies anywhere within the half line.
            (None, None) => (
                self.line_frequency,
                ReadBy::Line,
                Some(self.half_line / 3f64.sqrt()),
                within(self.line_frequency, self.half_line),
            ),
        };
    }
}

/// What a fit says of one mode.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedReading {
    /// Frequency, damping, amplitudes, each with its standard deviation.
    pub mode: ModeFit,
    /// Modal constants of the sensors; empty without a hammer, or where a sensor's quantity is unknown.
    pub constants: Vec<ModalConstant>,
    /// Frequency and damping against amplitude; `None` where they were not followed.
    pub amplitude: Option<AmplitudeCurve>,
}

impl FittedReading {
    /// A fit alone.
    pub fn new(mode: ModeFit) -> Self {
        FittedReading {
            mode,
            constants: Vec::new(),
            amplitude: None,
        }
    }
}

/// A peak that is no mode of the structure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PeakLabel {
    /// Mains hum at this multiple (Hz) of 50 or 60 Hz.
    Mains(f64),
    /// The force has a gap there, and the quotient a peak.
    ForceGap,
    /// No decaying oscillation explains it: speckle of noise or reverberation.
    NoResonance,
}

impl fmt::Display for PeakLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PeakLabel::Mains(harmonic) => write!(f, "mains {harmonic} Hz"),
            PeakLabel::ForceGap => f.write_str("gap of the force"),
            PeakLabel::NoResonance => f.write_str("no clear resonance"),
        }
    }
}

/// What one recording shows of a band.
#[derive(Debug, Clone, PartialEq)]
pub struct BandReadings {
    /// Frequencies that were looked at (Hz).
    pub band: (f64, f64),
    /// The resonances.
    pub readings: Vec<ModeReading>,
}

impl BandReadings {
    fn covers(&self, frequency: f64) -> bool {
        self.band.0 <= frequency && frequency <= self.band.1
    }
}

/// A resonance of the structure, from the recording that resolves it best.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedMode {
    /// Index of that recording.
    pub recording: usize,
    /// The reading.
    pub reading: ModeReading,
}

/// Merges the readings of several recordings, ascending in frequency.
///
/// Readings are the same resonance when they differ by less than their half lines together plus
/// 0.3 % (what re-mounting a sensor or a joint's drift moves a frequency as a rule), or by up to 1.5 % (a joint's
/// drift of 3 %, where the mode lives in the joint) and no recording shows both, though the band of each reaches to
/// where the other has its own; a fitted
/// one stays before one that is not, of two fits the one with the smaller standard deviation, else the
/// one with the smaller half line, and among equals the one that stands out most. Two readings of one recording are
/// never merged.
pub fn merge_modes(recordings: &[BandReadings]) -> Vec<MergedMode> {
    let mut merged: Vec<(MergedMode, Vec<usize>)> = Vec::new();
    for (recording, shown) in recordings.iter().enumerate() {
        for reading in &shown.readings {
            let candidate = MergedMode {
                recording,
                reading: reading.clone(),
            };
            let nearest = merged
                .iter_mut()
                .filter(|(mode, seen)| {
                    !seen.contains(&recording) && same_resonance(&mode.reading, reading)
                })
                .min_by(|a, b| {
                    let distance =
                        |mode: &MergedMode| (mode.reading.frequency - reading.frequency).abs();
                    distance(&a.0).total_cmp(&distance(&b.0))
                });
            match nearest {
                Some((mode, seen)) => {
                    seen.push(recording);
                    if resolves_better(reading, &mode.reading) {
                        *mode = candidate;
                    }
                }
                None => merged.push((candidate, vec![recording])),
            }
        }
    }
    merge_drifted(&mut merged, recordings);
    let mut modes: Vec<MergedMode> = merged.into_iter().map(|(mode, _)| mode).collect();
    modes.sort_by(|a, b| a.reading.frequency.total_cmp(&b.reading.frequency));
    modes
}

/// Largest relative distance of two readings of a mode that drifted from one recording to another.
const DRIFTED: f64 = 0.015;

/// Merges resonances that no recording shows side by side, the nearest first.
fn merge_drifted(merged: &mut Vec<(MergedMode, Vec<usize>)>, recordings: &[BandReadings]) {
    while let Some((first, second)) = nearest_apart(merged, recordings) {
        let (other, seen) = merged.remove(second);
        let (mode, own) = &mut merged[first];
        own.extend(seen);
        if resolves_better(&other.reading, &mode.reading) {
            *mode = other;
        }
    }
}

/// The two nearest resonances within [`DRIFTED`] that were seen in different recordings. Each must have been missed by
/// a recording that shows the other and would have shown it too: of two bands that only meet, neither could.
fn nearest_apart(
    merged: &[(MergedMode, Vec<usize>)],
    recordings: &[BandReadings],
) -> Option<(usize, usize)> {
    let distance = |&(a, b): &(usize, usize)| {
        let of = |k: usize| merged[k].0.reading.frequency;
        (of(a) - of(b)).abs() / of(a).max(of(b))
    };
    let apart = |&(a, b): &(usize, usize)| {
        let resonances = [a, b].iter().all(|&k| merged[k].0.reading.label.is_none());
        let missed = |shown: usize, other: usize| {
            let frequency = merged[other].0.reading.frequency;
            let mut seen = merged[shown].1.iter();
            seen.any(|&recording| recordings[recording].covers(frequency))
        };
        resonances
            && missed(a, b)
            && missed(b, a)
            && merged[a]
                .1
                .iter()
                .all(|recording| !merged[b].1.contains(recording))
    };
    let pairs = (0..merged.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    pairs
        .filter(apart)
        .filter(|pair| distance(pair) <= DRIFTED)
        .min_by(|one, other| distance(one).total_cmp(&distance(other)))
}

fn same_resonance(a: &ModeReading, b: &ModeReading) -> bool {
    let allowed = a.half_line + b.half_line + 0.003 * a.frequency.max(b.frequency);
    (a.frequency - b.frequency).abs() <= allowed
}

fn resolves_better(a: &ModeReading, b: &ModeReading) -> bool {
    if a.label.is_some() != b.label.is_some() {
        return a.label.is_none();
    }
    let fitted = |reading: &ModeReading| reading.source == ReadBy::Fit;
    match (fitted(a), fitted(b)) {
        (true, true) => return a.std < b.std,
        (true, false) => return true,
        (false, true) => return false,
        (false, false) => {}
    }
    // Half lines that differ by less than 1 % come from blocks of nearly the same length.
    if (a.half_line - b.half_line).abs() > 0.01 * a.half_line.max(b.half_line) {
        a.half_line < b.half_line
    } else {
        a.prominence_db > b.prominence_db
    }
}
