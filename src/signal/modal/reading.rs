//! Reading each resonance: on its line, between the lines, and by a fit; one list from several recordings.
//!
//! The discrete spectrum of one decaying oscillation, cut off anywhere, is exactly rational in the
//! frequency on lines that are 1/T apart: the truncation factor 1 - e^{(p - j omega) T} is the same
//! on every one of them. (Lines denser than that, of a block longer than its signal, show the
//! truncation as a ripple of the size of what the record still has at its end.)
//! Near a resonance a single pole on a slowly varying background therefore reads the frequency far
//! below the line spacing, truncated record or not.

use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::Subspace;
use super::amplitude::{AmplitudeCurve, FrequencyAtAmplitude};
use super::fit::{FittedValue, ModalConstant, ModeFit, UncertaintySource};
use super::peaks::{CompositeLevel, Peak};
use crate::spectral::{Lines, Window};

/// One resonance as one recording reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeReading {
    /// Best frequency (Hz).
    pub frequency: f64,
    /// Way in which it was read.
    pub source: ReadBy,
    /// Its interval (Hz): 95 % of a fit, the bounds of a reading between the lines or on one.
    pub interval: (f64, f64),
    /// Frequency of the peak's line, without a peak of the nearest one (Hz).
    pub line_frequency: f64,
    /// Half of the line spacing or resolution, whichever is wider (Hz).
    pub half_line: f64,
    /// Bound of the line reading (Hz) of a resonance no wider than a line: half a line, or more where only coarser lines
    /// show the resonance.
    pub line_bound: f64,
    /// The reading between the lines, where there is one.
    pub between: Option<Interpolation>,
    /// Standard deviation of the best frequency (Hz).
    pub std: Option<f64>,
    /// Amplitude at which the mode has this frequency; `None` where the decays do not tell.
    pub at_amplitude: Option<FrequencyAtAmplitude>,
    /// Damping ratio.
    pub damping_ratio: Option<f64>,
    /// Its standard deviation.
    pub damping_std: Option<f64>,
    /// Prominence of the peak (dB); `None` of a mode that makes no peak.
    pub prominence_db: Option<f64>,
    /// Height above the noise (dB), where known.
    pub above_noise_db: Option<f64>,
    /// Amplitude over that which a mode of its frequency could have (1, see [`super::set_strengths`]). Of a pole that makes
    /// no peak a tenth counts. `None` without a fit, and where nothing tells what a mode could have.
    pub strength: Option<f64>,
    /// Kind of a peak that is no mode of the structure.
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
    /// Returns a frequency read on a spectral line (Hz) and known to half a line (Hz), and nothing else.
    pub fn on_line(frequency: f64, half_line: f64) -> Self {
        let mut reading = ModeReading {
            frequency,
            source: ReadBy::Line,
            interval: (frequency, frequency),
            line_frequency: frequency,
            half_line,
            line_bound: half_line,
            between: None,
            std: None,
            at_amplitude: None,
            damping_ratio: None,
            damping_std: None,
            prominence_db: None,
            above_noise_db: None,
            strength: None,
            label: None,
            fit: None,
        };
        reading.select_estimate(ReadBy::Line);
        reading
    }

    /// Takes the frequency that was read as `wanted`, or the next best that there is: by the fit, between
    /// the lines, on the line. The damping is that of the fit, or of the reading between the lines.
    pub fn select_estimate(&mut self, wanted: ReadBy) {
        self.at_amplitude = None;
        if let Some(fit) = self.fit.as_deref().filter(|_| wanted == ReadBy::Fit) {
            self.at_amplitude = fit.at_amplitude();
            let found = fit.frequency();
            (self.frequency, self.source) = (found.value, ReadBy::Fit);
            (self.std, self.interval) = (Some(found.std), (found.low, found.high));
        }
        let fit = self.fit.as_deref().map(|fit| &fit.mode);
        (self.damping_ratio, self.damping_std) = match (fit, self.between) {
            (Some(fit), _) => (Some(fit.damping_ratio.value), Some(fit.damping_ratio.std)),
            (None, Some(between)) => (
                between.damping_ratio,
                between.damping_ratio.map(|_| between.damping_std),
            ),
            (None, None) => (None, None),
        };
        if fit.is_some() && wanted == ReadBy::Fit {
            return;
        }
        let (frequency, bound, std) = match self.between.filter(|_| wanted != ReadBy::Line) {
            Some(between) => {
                self.source = ReadBy::Interpolated;
                (between.frequency, between.bound, between.std)
            }
            // On a line the truth lies anywhere within the bound.
            None => {
                self.source = ReadBy::Line;
                // Over the flat top of a resonance wider than a line, noise decides which line is the highest. The
                // peak of an accelerance lies zeta^2 f higher. Both remain within half of the half-power width. The
                // line nearest to a pole is as good as that pole.
                let half_width = self.damping_ratio.unwrap_or(0.0) * self.line_frequency;
                let mut bound = self.line_bound;
                if half_width > self.half_line {
                    let beyond = self.between.map_or(half_width, |between| between.bound);
                    bound = bound.max(self.half_line + beyond.min(half_width));
                }
                (self.line_frequency, bound, bound / 3f64.sqrt())
            }
        };
        (self.frequency, self.std) = (frequency, Some(std));
        self.interval = (frequency - bound, frequency + bound);
    }
}

impl ModeReading {
    /// Makes it the reading of a mains line: it keeps its line, and loses what only a resonance has.
    pub fn make_mains(&mut self, harmonic: f64) {
        self.between = None;
        self.fit = None;
        self.label = Some(PeakLabel::Mains(harmonic));
        self.select_estimate(ReadBy::Line);
    }
}

/// Results of the fit of one mode.
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
    /// Takes a fit alone.
    pub fn new(mode: ModeFit) -> Self {
        FittedReading {
            mode,
            constants: Vec::new(),
            amplitude: None,
        }
    }

    /// Returns the frequency: that of the fit. A mode that changes with its amplitude has the frequency at one amplitude.
    ///
    /// Two poles of one shape may be two modes. Only taps of different strength show that it is one that changes.
    pub fn frequency(&self) -> FittedValue {
        let fitted = self.mode.frequency;
        let drift = self.amplitude.as_ref().and_then(|curve| curve.drift);
        let drift = drift
            .filter(|drift| drift.by_amplitude || fitted.source != UncertaintySource::TwoPoles);
        drift.map_or(fitted, |drift| drift.frequency)
    }

    /// Returns the amplitude at which the mode has that frequency; `None` where the decays do not tell.
    pub fn at_amplitude(&self) -> Option<FrequencyAtAmplitude> {
        let curve = self.amplitude.as_ref()?;
        let (value, sensor) = curve.reference.zip(curve.sensor)?;
        Some(FrequencyAtAmplitude { value, sensor })
    }
}

/// A peak that is no mode of the structure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PeakLabel {
    /// Mains hum at this multiple (Hz) of 50 or 60 Hz.
    Mains(f64),
    /// The force has a gap there, and the quotient a peak.
    ForceGap,
    /// A nonlinear joint makes it of two others.
    Combination(Combination),
    /// A pole that makes no peak, and is too weak for a mode.
    Weak,
    /// No decaying oscillation explains it: speckle of noise or reverberation.
    NoResonance,
}

impl fmt::Display for PeakLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PeakLabel::Mains(harmonic) => write!(f, "mains {harmonic} Hz"),
            PeakLabel::ForceGap => f.write_str("gap of the force"),
            PeakLabel::Combination(sum) => sum.fmt(f),
            PeakLabel::Weak => f.write_str("weak, no peak"),
            PeakLabel::NoResonance => f.write_str("no clear resonance"),
        }
    }
}

/// A frequency that is the sum of a stronger line and a multiple of a mode's frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Combination {
    /// The stronger line (Hz).
    pub line: f64,
    /// Multiple of the mode's frequency: 1 or 2, negative for a difference.
    pub times: i32,
    /// The mode (Hz).
    pub of: f64,
}

impl fmt::Display for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.times < 0 { '\u{2212}' } else { '+' };
        let number = match self.times.abs() {
            1 => String::new(),
            times => format!("{times} \u{d7} "),
        };
        write!(f, "{:.1} {sign} {number}{:.1} Hz", self.line, self.of)
    }
}

/// Reads all `peaks` of one recording.
///
/// `spectra` are the frequency response functions of all sensors, or without a hammer the transforms
/// of all taps and sensors; they share their poles.
///
/// The line of a reading is the highest one, except where the fitted pole is nearer to another: over
/// a resonance much wider than a line, the background of other modes and noise pull the maximum
/// along its flat top, and the half-line bound would not hold.
pub fn read_peaks(
    level: &CompositeLevel,
    spectra: &[&[Complex64]],
    peaks: &[Peak],
    window: Window,
) -> Vec<ModeReading> {
    let mut readings = Vec::with_capacity(peaks.len());
    for peak in peaks {
        let (mut between, mut label) = (None, None);
        if window == Window::Hann {
            between = interpolate_parabola(&level.lines, &level.level_db, peak.index);
        } else {
            // A third of the way to the nearest neighbour are the peak's own lines.
            let others = peaks.iter().filter(|other| other.index != peak.index);
            let nearest = others.map(|other| other.index.abs_diff(peak.index)).min();
            let room = nearest.map_or(usize::MAX, |distance| distance / 3);
            let decay = window.added_decay();
            // The fitted oscillation must decay beyond doubt: by two standard deviations where the peak is clear of
            // the noise; by five, and visibly over the record, where it is not.
            let clear = match peak.above_noise_db {
                Some(above) => above >= CLEAR_OF_NOISE,
                None => peak.prominence_db >= CLEAR_WHEN_BLIND,
            };
            let deviations = if clear { 2.0 } else { 5.0 };
            match interpolate_pole(&level.lines, spectra, peak.index, room, decay) {
                Ok(found) => {
                    let readable = level.lines.half_line().max(0.5 * found.half_width());
                    let is_resonance = (found.damping_ratio)
                        .is_some_and(|ratio| ratio > deviations * found.damping_std)
                        && (clear || found.decay_in_record >= LEAST_DECAY)
                        && (peak.prominence_db >= CLEAR_PROMINENCE || found.bound < readable);
                    between = Some(found).filter(|_| is_resonance);
                    label = (!is_resonance).then_some(PeakLabel::NoResonance);
                }
                Err(NoInterpolation::TooFewLines) => {}
                Err(NoInterpolation::PoleElsewhere) => label = Some(PeakLabel::NoResonance),
            }
        }
        readings.push(reading(level, peak, between, label));
    }
    readings
}

/// Puts a reading together. The reading between the lines counts where its bound is below the half
/// line or below half the half-power width: over a wide resonance in noise the highest line is no
/// better than that.
pub(super) fn reading(
    level: &CompositeLevel,
    peak: &Peak,
    between: Option<Interpolation>,
    label: Option<PeakLabel>,
) -> ModeReading {
    let lines = &level.lines;
    let half_line = lines.half_line();
    let sharp = between.filter(|found| found.bound < half_line.max(found.half_width()));
    let line = sharp.map_or(peak.index, |found| lines.nearest(found.frequency));
    let mut reading = ModeReading {
        between: sharp,
        prominence_db: Some(peak.prominence_db),
        above_noise_db: peak.above_noise_db,
        label,
        ..ModeReading::on_line(lines.frequency(line), half_line)
    };
    reading.select_estimate(ReadBy::Interpolated);
    reading
}

/// A peak that stands out by less than this (dB) must be read within its half line, or a quarter of its
/// half-power width, to count.
const CLEAR_PROMINENCE: f64 = 8.0;
/// From this height over the noise on (dB), noise does not make peaks any more.
const CLEAR_OF_NOISE: f64 = 30.0;
/// Least prominence (dB) for the same where nothing is known of the noise.
const CLEAR_WHEN_BLIND: f64 = 20.0;

/// Least decay over the record (sigma T) of a peak that is not clear of the noise. 2: a peak of noise
/// is as narrow as the record allows, and scatters about no decay at all.
const LEAST_DECAY: f64 = 2.0;

/// A frequency read between the lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// Natural frequency (Hz), undamped: the modulus of the pole over 2 pi.
    pub frequency: f64,
    /// Bound of the reading (Hz), about 95 %: the change between two sets of lines, two standard
    /// deviations of the lines' scatter about the fitted curve, and what a single pole leaves.
    pub bound: f64,
    /// Standard deviation (Hz), half the bound.
    pub std: f64,
    /// Damping ratio, the window's own decay taken out; `None` when nothing is left of it, and under a Hann window.
    pub damping_ratio: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_std: f64,
    /// Decay over the length of the signal, sigma T, the window's own included.
    pub decay_in_record: f64,
}

impl Interpolation {
    /// Returns half of the half-power width, zeta f (Hz); 0 without damping.
    fn half_width(&self) -> f64 {
        self.damping_ratio.unwrap_or(0.0) * self.frequency
    }
}

/// Reason why a peak could not be read between the lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoInterpolation {
    /// Fewer lines than unknowns, or lines without any level: the peak remains undecided.
    TooFewLines,
    /// The pole lies elsewhere: the peak is not that of a resonance.
    PoleElsewhere,
}

/// Lines to each side of the peak: at least two, so that five complex values stand against three
/// unknowns.
const LEAST_REACH: usize = 2;
/// So many lines to either side take part at most; of a wider resonance every second, third, ... one.
const MOST_LINES: usize = 100;
/// From this reach on the background may slope: nine complex values against four unknowns.
const SLOPING_REACH: usize = 4;
/// Error of a fit of one pole even without noise (lines): the image at the negative frequency and
/// the curvature of the background, as seen on noise-free virtual tests.
const MODEL_ERROR: f64 = 1e-4;
/// Iterations of the weights; they settle in two.
const REWEIGHTINGS: usize = 3;

/// Fits one pole, common to all `spectra`, to the lines around `peak`.
///
/// Model: H(u) = r/(u - q) + b with u the distance from the peak in lines, q the complex pole, a
/// residue r and a background b (constant, or linear in u where there are lines enough) for every
/// spectrum; written H u = c0 + c1 u + c2 u^2 + q H and solved by least squares with the weights
/// 1/|u - q|^2 of the previous pass (Sanathanan & Koerner).
/// The lines within the half-power width, at least two to either side, take part.
/// `added_decay` is the exponential window's (1/s); `room` how many lines to either side belong to
/// this peak alone.
///
/// # Errors
/// [`NoInterpolation`] when there are too few lines, or the pole lies farther from the peak than a line and the
/// half-power reach: the background of other modes pulls a weak peak that far, but not farther.
pub fn interpolate_pole(
    lines: &Lines,
    spectra: &[&[Complex64]],
    peak: usize,
    room: usize,
    added_decay: f64,
) -> Result<Interpolation, NoInterpolation> {
    let half_width = half_power_reach(spectra, peak).ok_or(NoInterpolation::TooFewLines)?;
    let reach = (half_width + 1).max(LEAST_REACH).min(room.max(LEAST_REACH));
    let fit = fit_pole(spectra, peak, reach).ok_or(NoInterpolation::TooFewLines)?;
    let narrower = fit_pole(spectra, peak, (reach / 2).max(1)).unwrap_or(fit);
    // Resolution, not line spacing, is the measure of "near": zero padding must not tighten it.
    let line = lines.resolution().max(lines.spacing) / lines.spacing;
    if !fit.pole.is_finite() || fit.pole.re.abs() > line + half_width as f64 {
        return Err(NoInterpolation::PoleElsewhere);
    }
    let damped = lines.frequency(peak) + fit.pole.re * lines.spacing;
    let decay = fit.pole.im * lines.spacing - added_decay / TAU;
    let frequency = damped.hypot(decay.max(0.0));
    let change = (fit.pole.re - narrower.pole.re).abs();
    let bound = (change + 2.0 * fit.std + MODEL_ERROR) * lines.spacing;
    // The bound is two standard deviations, what the model misses included; it goes for both parts
    // of the pole.
    let std = 0.5 * bound;
    Ok(Interpolation {
        frequency,
        bound,
        std,
        damping_ratio: (decay > 0.0).then(|| decay / frequency),
        damping_std: std / frequency,
        decay_in_record: TAU * fit.pole.im * lines.spacing * lines.duration,
    })
}

/// Returns the lines from the peak to where the summed power has fallen by half, on the nearer side: on the
/// farther one a neighbour may hold it up.
fn half_power_reach(spectra: &[&[Complex64]], peak: usize) -> Option<usize> {
    let half = 0.5 * power(spectra, peak)?;
    (1..).find(|reach| {
        let sides = [Some(peak + reach), peak.checked_sub(*reach)];
        let powers = sides.map(|line| line.and_then(|line| power(spectra, line)));
        !powers.iter().all(|power| power.is_some_and(|p| p > half))
    })
}

/// Returns the summed power of all spectra on a line; `None` beyond the end of one.
fn power(spectra: &[&[Complex64]], line: usize) -> Option<f64> {
    let values = spectra.iter().map(|spectrum| spectrum.get(line));
    values.map(|value| value.map(Complex64::norm_sqr)).sum()
}

#[derive(Clone, Copy)]
struct PoleFit {
    /// Distance from the peak's line (real part) and decay/(2 pi) (imaginary part), in lines.
    pole: Complex64,
    /// Standard deviation of each part, in lines.
    std: f64,
}

fn fit_pole(spectra: &[&[Complex64]], peak: usize, reach: usize) -> Option<PoleFit> {
    // Near the ends of the axis the lines that are there must do.
    let points = spectra.iter().map(|spectrum| spectrum.len()).min()?;
    let first = peak.saturating_sub(reach);
    let last = (peak + reach).min(points.checked_sub(1)?);
    if last < first + 2 * LEAST_REACH.min(reach) {
        return None;
    }
    let stride = reach.div_ceil(MOST_LINES);
    let lines: Vec<usize> = (first..=last).step_by(stride).collect();
    let offsets: Vec<f64> = lines.iter().map(|&k| k as f64 - peak as f64).collect();
    let mut weights = vec![1.0; offsets.len()];
    let mut fit = None;
    for _ in 0..REWEIGHTINGS {
        let next = solve_pole(spectra, &lines, &offsets, &weights)?;
        for (weight, offset) in weights.iter_mut().zip(&offsets) {
            // A pole on a line must not take all the weight: a tenth of a line is near enough.
            *weight = 1.0 / ((Complex64::from(*offset) - next.pole).norm_sqr() + 0.01);
        }
        fit = Some(next);
    }
    fit
}

/// Solves one weighted least-squares pass. Residue and background of each spectrum are projected out, which
/// leaves a single complex unknown: q = sum conj(H') (u H)' / sum |H'|^2.
fn solve_pole(
    spectra: &[&[Complex64]],
    lines: &[usize],
    offsets: &[f64],
    weights: &[f64],
) -> Option<PoleFit> {
    // The polynomials 1, u, and u^2 where there are lines enough.
    let terms = 2 + usize::from(lines.len() > 2 * SLOPING_REACH);
    let background = DMatrix::from_fn(lines.len(), terms, |row, degree| {
        Complex64::from(weights[row].sqrt() * offsets[row].powi(degree as i32))
    });
    let background = Subspace::new(&background, 1e-9);
    let values = DMatrix::from_fn(lines.len(), spectra.len(), |row, k| {
        spectra[k][lines[row]] * weights[row].sqrt()
    });
    let mut sloped = values.clone();
    for (mut row, offset) in sloped.row_iter_mut().zip(offsets) {
        row *= Complex64::from(*offset);
    }
    let (h, uh) = (background.complement(values), background.complement(sloped));
    let denominator = h.norm_squared();
    if denominator.is_nan() || denominator <= 0.0 {
        return None;
    }
    let pole = h.dotc(&uh) / denominator;
    let rest = uh - h * pole;
    let squares = rest.norm_squared();
    // What the model misses runs smoothly over the lines, and neighbours that agree are not
    // independent: their correlation r leaves (1 - r)/(1 + r) of the lines' information.
    let pairs = lines.len() - 1;
    let neighbours = rest.rows(0, pairs).dotc(&rest.rows(1, pairs)).re;
    let agreement = (neighbours / squares.max(f64::MIN_POSITIVE)).clamp(0.0, 0.98);
    let squares = squares * (1.0 + agreement) / (1.0 - agreement);
    // Complex values less the polynomial's unknowns per spectrum less the common pole.
    let unknowns = background.rank() * spectra.len() + 1;
    let freedom = (offsets.len() * spectra.len()).saturating_sub(unknowns);
    let std = match freedom {
        0 => 0.0,
        _ => (squares / (2.0 * freedom as f64) / denominator).sqrt(),
    };
    Some(PoleFit { pole, std })
}

/// Parabola through the three levels (dB) around the peak: for the Hann window, whose lines are not
/// those of a single pole. Its bias there stays below 0.02 lines for a steady tone; the bound is
/// 0.05 lines.
pub fn interpolate_parabola(lines: &Lines, level_db: &[f64], peak: usize) -> Option<Interpolation> {
    let (before, at, after) = (
        *level_db.get(peak.checked_sub(1)?)?,
        *level_db.get(peak)?,
        *level_db.get(peak + 1)?,
    );
    let curvature = before - 2.0 * at + after;
    if curvature.is_nan() || curvature >= 0.0 {
        return None;
    }
    let shift = 0.5 * (before - after) / curvature;
    let bound = 0.05 * lines.resolution().max(lines.spacing);
    Some(Interpolation {
        frequency: lines.frequency(peak) + shift * lines.spacing,
        bound,
        std: bound / 2.0,
        damping_ratio: None,
        damping_std: 0.0,
        decay_in_record: 0.0,
    })
}

/// Readings of one recording in its band.
#[derive(Debug, Clone, PartialEq)]
pub struct BandReadings {
    /// Lower and upper end of the band (Hz).
    pub band: (f64, f64),
    /// Place of the taps (m), where it is known.
    pub tap: Option<f64>,
    /// The resonances.
    pub readings: Vec<ModeReading>,
}

/// A resonance of the structure, from the recording that resolves it best.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedMode {
    /// Index of that recording.
    pub recording: usize,
    /// The reading.
    pub reading: ModeReading,
}

/// A resonance, and the recordings that show it.
struct Resonance {
    best: MergedMode,
    shown_by: Vec<usize>,
}

impl Resonance {
    /// Takes another resonance over as the same one; the reading that resolves it better stays.
    fn absorb(&mut self, other: Resonance) {
        self.shown_by.extend(other.shown_by);
        let (a, b) = (&other.best.reading, &self.best.reading);
        let fitted = [a, b].map(|reading| reading.source == ReadBy::Fit);
        let is_better = if a.label.is_some() != b.label.is_some() {
            a.label.is_none()
        } else if fitted == [true, true] {
            a.std < b.std
        } else if fitted != [false, false] {
            fitted[0]
        } else if (a.half_line - b.half_line).abs() > 0.01 * a.half_line.max(b.half_line) {
            // Half lines that differ by less than 1 % come from blocks of nearly the same length.
            a.half_line < b.half_line
        } else {
            a.prominence_db > b.prominence_db
        };
        if is_better {
            self.best = other.best;
        }
    }

    fn is_shown_with(&self, other: &Resonance) -> bool {
        let mut shown = self.shown_by.iter();
        shown.any(|recording| other.shown_by.contains(recording))
    }
}

/// Merges the readings of several recordings, ascending in frequency.
///
/// Two readings are one resonance in one of three cases; readings of one recording are never merged.
///
/// 1. They differ by less than their half lines together plus 0.3 %. As a rule re-mounting a sensor, or a joint's
///    drift, moves a frequency by that much.
/// 2. They differ by up to 1.5 %, as after a joint's drift of 3 % where the mode lives in the joint. Each
///    recording's band must then reach to the other's reading, and no recording may show both.
/// 3. They differ by up to 5 % in the same way, at one place of the taps, and no other resonance lies that near to either.
///    Repeats after a clamp was opened and closed scatter by so much in the lowest mode. Taps elsewhere may miss a mode.
///
/// A mode stays before a peak that is none, and a fit before any other reading. Of two fits the one with the
/// smaller standard deviation stays. Of two others it is the one with the smaller half line, and among equals the
/// more prominent one.
pub fn merge_modes(recordings: &[BandReadings]) -> Vec<MergedMode> {
    let mut merged: Vec<Resonance> = Vec::new();
    for (recording, shown) in recordings.iter().enumerate() {
        for reading in &shown.readings {
            let found = Resonance {
                best: MergedMode {
                    recording,
                    reading: reading.clone(),
                },
                shown_by: vec![recording],
            };
            let mut nearest: Option<(f64, &mut Resonance)> = None;
            for known in &mut merged {
                let other = &known.best.reading;
                let distance = (other.frequency - reading.frequency).abs();
                let allowed = other.half_line
                    + reading.half_line
                    + 0.003 * other.frequency.max(reading.frequency);
                let same = distance <= allowed && !known.is_shown_with(&found);
                if same && nearest.as_ref().is_none_or(|(least, _)| distance < *least) {
                    nearest = Some((distance, known));
                }
            }
            match nearest {
                Some((_, known)) => known.absorb(found),
                None => merged.push(found),
            }
        }
    }
    while let Some((first, second)) = nearest_drifted(&merged, recordings) {
        let other = merged.remove(second);
        merged[first].absorb(other);
    }
    let mut modes: Vec<MergedMode> = merged.into_iter().map(|one| one.best).collect();
    modes.sort_by(|a, b| a.reading.frequency.total_cmp(&b.reading.frequency));
    modes
}

/// Largest relative distance of two readings of a mode that drifted from one recording to another.
const DRIFTED: f64 = 0.015;
/// The same where no third resonance lies within this distance of either.
const DRIFTED_ALONE: f64 = 0.05;

/// Returns the two nearest resonances within [`DRIFTED`], or alone within [`DRIFTED_ALONE`], that were seen in different
/// recordings. Each must have been missed by a recording that shows the other and would have shown it too: of two bands
/// that only meet, neither could.
fn nearest_drifted(merged: &[Resonance], recordings: &[BandReadings]) -> Option<(usize, usize)> {
    let mut nearest = None;
    let mut least = DRIFTED_ALONE;
    for (second, b) in merged.iter().enumerate() {
        for (first, a) in merged[..second].iter().enumerate() {
            let (one, other) = (&a.best.reading, &b.best.reading);
            let distance =
                (one.frequency - other.frequency).abs() / one.frequency.max(other.frequency);
            let resonances = one.label.is_none() && other.label.is_none();
            let missed = [(a, other), (b, one)].iter().all(|(shown, missing)| {
                shown.shown_by.iter().any(|&recording| {
                    let (low, high) = recordings[recording].band;
                    (low..=high).contains(&missing.frequency)
                })
            });
            let nearer = distance < least || distance <= least && nearest.is_none();
            let may_be_one = nearer && resonances && missed && !a.is_shown_with(b);
            // Asked last: it compares with all others.
            if may_be_one && (distance <= DRIFTED || are_alone(first, second, merged, recordings)) {
                (nearest, least) = (Some((first, second)), distance);
            }
        }
    }
    nearest
}

/// Returns true where the recordings of two resonances have one place of the taps, and show no third resonance within
/// [`DRIFTED_ALONE`] of either.
fn are_alone(
    first: usize,
    second: usize,
    merged: &[Resonance],
    recordings: &[BandReadings],
) -> bool {
    let (a, b) = (&merged[first], &merged[second]);
    let tap = recordings[a.best.recording].tap;
    let mut shown_by = a.shown_by.iter().chain(&b.shown_by);
    if shown_by.any(|&recording| recordings[recording].tap != tap) {
        return false;
    }
    let mut thirds = merged.iter().enumerate();
    !thirds.any(|(index, third)| {
        let near = [a, b].iter().any(|one| {
            let frequency = one.best.reading.frequency;
            (third.best.reading.frequency - frequency).abs() < DRIFTED_ALONE * frequency
        });
        let is_seen = third.is_shown_with(a) || third.is_shown_with(b);
        index != first && index != second && third.best.reading.label.is_none() && near && is_seen
    })
}
