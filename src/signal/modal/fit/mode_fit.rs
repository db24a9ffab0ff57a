//! Fitted modes and how well they are known.
//!
//! The standard deviation of a frequency or damping comes from the noise that the fit leaves, or from the
//! scatter of the taps where that is larger.

use super::super::from_one;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, Matrix2};
use num_complex::Complex64;
use tapjoint_numerics::stats::{NORMAL_95, chi_square_tail, student};

use super::group::{Accepted, Group, ModeState};
use super::group_fit::{GroupFit, complex_row};
use super::variable_projection::{PoleProblem, half_width};
use super::{Basis, FitSettings, ModalData, PoleStart, StopReason, Unfit};

/// The taps scatter beyond noise if the scatter of all modes together is less probable than this. 0.2: a few taps
/// seldom show a scatter that is as large as the noise, and intervals from the noise alone are then too short. The
/// price: one recording in five without scatter has intervals that are too long. Of two taps no such test is made.
pub(in crate::modal) const SCATTERS: f64 = 0.2;
/// If the scatter of one mode is less probable than this, its value is the mean of its taps. Otherwise the joint fit is
/// more precise.
const SCATTERS_CLEARLY: f64 = 0.01;
/// Factor on two intervals of 95 % that shall both hold their values in 95 %: each must in 97.5 %, 2.241/1.960.
const BOTH: f64 = 1.143;
/// Least share of the larger energy with which a pole counts. 0.02: a seventh of the amplitude at equal decay. At 0.005 1 %
/// more of the intervals of modes read as one hold both, but those of a mode whose taps scatter or that changes with its
/// amplitude hold a pole that only mends the beginning of a decay.
const LEAST_ENERGY: f64 = 0.02;
/// A residual correlation beyond so many standard deviations is a misfit. 3: by chance one fit in 700.
const CORRELATED: f64 = 3.0;
/// Steps of the fit of one tap; it starts from the joint poles, or within a half width of its own.
const TAP_STEPS: usize = 6;
/// Half widths by which a tap's frequencies may be away from the joint ones. The band of the fit reaches to 10.
const MOST_MOVED: u8 = 8;
/// A fall of a tap's residual that a start elsewhere must bring, in variances of that residual. 25: by noise alone, one tap
/// in ten thousand of one sensor has such a fall at any of the 16 places.
const CLEARLY_LESS: f64 = 25.0;

/// Origin of a standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum UncertaintySource {
    /// The noise that the fit leaves on the lines.
    Residual,
    /// The scatter of the taps, where it exceeds that noise.
    #[serde(rename = "taps")]
    TapScatter,
    /// Two poles of one shape that explain the data better than one: two modes, or one whose frequency changes.
    TwoPoles,
    /// The decays as models of a frequency that changes with the amplitude see them, at one amplitude.
    Decays,
}

/// A value with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedValue {
    /// Value (Hz, or a ratio).
    pub value: f64,
    /// Standard deviation (unit of the value). From the scatter of a few taps, it is that of a normal distribution with
    /// the same 95 % interval: later steps take the value as normal. From two poles, it is 1/1.96 of the distance to
    /// the farther end of the interval, or that of the fit where it is larger.
    pub std: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// Origin of the standard deviation.
    pub source: UncertaintySource,
    /// Degrees of freedom behind the interval. The standard deviation contains them already where the taps scatter.
    pub freedom: f64,
    /// Probability that noise alone scatters the taps as much; `None` with fewer than two fitted taps.
    pub scatter_probability: Option<f64>,
}

/// Frequency and damping of one tap alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct TapFit {
    /// Number of the tap, from 0; in outputs from 1.
    #[serde(serialize_with = "from_one")]
    pub tap: usize,
    /// Natural frequency (Hz).
    pub frequency: f64,
    /// Standard deviation of the frequency from the noise (Hz).
    pub frequency_std: f64,
    /// Damping ratio.
    #[serde(rename = "damping")]
    pub damping_ratio: f64,
    /// Standard deviation of the damping ratio from the noise.
    pub damping_std: f64,
}

impl FittedValue {
    /// Takes value and interval from the joint fit. `taps` are values with their standard deviations.
    pub(in crate::modal) fn new(value: f64, std: f64, freedom: f64, taps: &[(f64, f64)]) -> Self {
        let half = student::quantile(0.05, freedom.max(1.0)) * std;
        FittedValue {
            value,
            std,
            low: value - half,
            high: value + half,
            source: UncertaintySource::Residual,
            freedom,
            // By the chi-squared test of the taps about their weighted mean.
            scatter_probability: (taps.len() > 1)
                .then(|| scatter_about_mean(taps))
                .filter(|scatter| scatter.is_finite())
                .map(|scatter| chi_square_tail(scatter, taps.len() as f64 - 1.0)),
        }
    }

    /// Takes the interval from the scatter of the taps, and the value too where they scatter clearly.
    pub(in crate::modal) fn take_scatter(&mut self, taps: &[(f64, f64)], clearly: bool) {
        if self.scatter_probability.is_none() {
            return;
        }
        let (mean, scatter) = weighted_mean(taps);
        let freedom = taps.len() as f64 - 1.0;
        let half = student::quantile(0.05, freedom) * scatter;
        // The mean of vague dampings may lie below zero.
        if clearly && mean > 0.0 {
            self.value = mean;
        }
        // Scatter cannot make a value better than the noise permits.
        let noise = 0.5 * (self.high - self.low);
        if half > noise {
            self.std = half / NORMAL_95;
            self.freedom = freedom;
            self.source = UncertaintySource::TapScatter;
        }
        (self.low, self.high) = (self.value - half.max(noise), self.value + half.max(noise));
    }

    /// Widens the interval to hold all of these values.
    pub(in crate::modal) fn widen_to_all(&mut self, values: impl Iterator<Item = f64>) {
        for value in values {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        }
        let farther = (self.value - self.low).max(self.high - self.value);
        self.std = self.std.max(farther / NORMAL_95);
    }

    /// Widens the interval to hold another value, each of the two in 97.5 %.
    fn widen_to(&mut self, other: &FittedValue) {
        let half = BOTH * 0.5 * (other.high - other.low);
        let middle = 0.5 * (other.high + other.low);
        self.low = self.low.min(middle - half);
        self.high = self.high.max(middle + half);
        let farther = (self.value - self.low).max(self.high - self.value);
        self.std = self.std.max(farther / NORMAL_95);
        self.source = UncertaintySource::TwoPoles;
    }
}

/// Frequencies and damping ratios of single taps, with their standard deviations.
fn values_of(taps: &[TapFit]) -> [Vec<(f64, f64)>; 2] {
    let frequencies = taps.iter().map(|tap| (tap.frequency, tap.frequency_std));
    let dampings = taps.iter().map(|tap| (tap.damping_ratio, tap.damping_std));
    [frequencies.collect(), dampings.collect()]
}

/// Takes the intervals of all modes of a recording from the scatter of their taps, where the taps scatter.
///
/// Whether they do is judged by all modes together: what moves one tap, such as a hand or a temperature, moves more than
/// one mode. How much is each mode's own matter.
fn judge_scatter(fits: &mut [Option<ModeFit>]) {
    let (mut squares, mut freedom) = ([0.0; 2], 0.0);
    for mode in fits.iter().flatten().filter(|mode| mode.taps.len() > 1) {
        let scatters = values_of(&mode.taps).map(|taps| scatter_about_mean(&taps));
        if scatters.iter().all(|scatter| scatter.is_finite()) {
            squares = [squares[0] + scatters[0], squares[1] + scatters[1]];
            freedom += mode.taps.len() as f64 - 1.0;
        }
    }
    if freedom == 0.0 {
        return;
    }
    // Two taps may differ by less than noise by chance, however much they scatter: their interval always rests on the
    // difference. Drawn with a scatter of 10^-5 to 0.3 %, it then holds the truth in 95.4 %; by the test in 93.5 %, and
    // 2 % lie beyond three standard deviations.
    let two_at_most = fits.iter().flatten().all(|mode| mode.taps.len() <= 2);
    let [frequencies_do, dampings_do] =
        squares.map(|sum| two_at_most || chi_square_tail(sum, freedom) < SCATTERS);
    for mode in fits.iter_mut().flatten() {
        let [frequencies, dampings] = values_of(&mode.taps);
        let [frequency, damping] = [&mut mode.frequency, &mut mode.damping_ratio];
        let is_clear =
            |value: &FittedValue| (value.scatter_probability).is_some_and(|p| p < SCATTERS_CLEARLY);
        let apart = frequencies_do && is_clear(frequency);
        if frequencies_do {
            frequency.take_scatter(&frequencies, apart);
        }
        // A joint fit of taps with different frequencies takes their distance for damping.
        if apart || dampings_do {
            damping.take_scatter(&dampings, apart || is_clear(damping));
        }
    }
}

impl ModeFit {
    /// Widens the intervals so that they hold two poles that explain the data better than this one alone.
    ///
    /// Two modes of one shape and one mode whose frequency changes look alike: the intervals hold both cases. A pole of
    /// far less energy only mends the beginning of a decay, and does not count.
    pub fn widen_to(&mut self, poles: [&ModeFit; 2]) {
        let sizes = poles.map(|pole| {
            // The energy of a decay is a^2/(4 sigma).
            let squares = pole.amplitudes.iter().map(|a| a.value.norm_sqr());
            squares.sum::<f64>() / pole.pole.re.abs()
        });
        for (pole, size) in poles.into_iter().zip(sizes) {
            if size > LEAST_ENERGY * sizes[0].max(sizes[1]) {
                self.frequency.widen_to(&pole.frequency);
                self.damping_ratio.widen_to(&pole.damping_ratio);
            }
        }
    }
}

/// Returns the chi-squared of values with their standard deviations about their weighted mean.
pub fn scatter_about_mean(taps: &[(f64, f64)]) -> f64 {
    weighted_moments(taps, 0.0).2
}

/// Returns the mean of values that scatter between taps beside their own standard deviations, and its standard
/// deviation.
///
/// The weights are v_i = 1/(std_i^2 + tau^2) with the variance tau^2 between taps after DerSimonian & Laird
/// 1986. The standard deviation sqrt(sum v_i (x_i - mean)^2/((n - 1) sum v_i)) goes with Student's t of
/// n - 1 (Hartung & Knapp 2001).
pub fn weighted_mean(taps: &[(f64, f64)]) -> (f64, f64) {
    let degrees = taps.len() as f64 - 1.0;
    let (total, _, scatter) = weighted_moments(taps, 0.0);
    let squares = taps.iter().map(|(_, std)| (1.0 / (std * std)).powi(2));
    let squares: f64 = squares.sum();
    let between = ((scatter - degrees) / (total - squares / total)).max(0.0);
    let (total, mean, scatter) = weighted_moments(taps, between);
    (mean, (scatter / (degrees * total)).sqrt())
}

/// Sum of the weights 1/(std^2 + `between`), weighted mean, and weighted sum of squares about it.
fn weighted_moments(taps: &[(f64, f64)], between: f64) -> (f64, f64, f64) {
    let (mut total, mut sum) = (0.0, 0.0);
    for (value, std) in taps {
        let weight = 1.0 / (std * std + between);
        total += weight;
        sum += weight * value;
    }
    let mean = sum / total;
    let scatter = taps
        .iter()
        .map(|(value, std)| (value - mean).powi(2) / (std * std + between));
    (total, mean, scatter.sum())
}

/// Complex amplitude of a mode in one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnAmplitude {
    /// Number of the tap.
    pub tap: usize,
    /// Number of the sensor.
    pub sensor: usize,
    /// Free decay: a in x(t) = Re(a e^{p t}), t from the decay's first sample (unit of the samples).
    /// Frequency response function: its residue R (unit of the function times rad/s).
    pub value: Complex64,
    /// Standard deviation of real and imaginary part from noise, at a fixed pole.
    pub std: f64,
    /// Change with the pole's angular frequency (unit of the amplitude times s).
    pub by_omega: Complex64,
    /// Change with the pole's decay (unit of the amplitude times s).
    pub by_decay: Complex64,
}

/// A fitted mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeFit {
    /// Natural frequency (Hz), undamped: modulus of the pole over 2 pi, a window's decay taken out.
    pub frequency: FittedValue,
    /// Damping ratio, a window's decay taken out.
    pub damping_ratio: FittedValue,
    /// Pole (rad/s), negative decay + j angular frequency; a window's decay is included.
    pub pole: Complex64,
    /// Covariance of the pole's angular frequency and decay from the residual ((rad/s)^2).
    pub pole_covariance: [[f64; 2]; 2],
    /// Correlation of the errors of frequency and damping ratio.
    pub correlation: f64,
    /// Fits of single taps; taps that could not be fitted are missing.
    pub taps: Vec<TapFit>,
    /// Correlation of the residual between neighbouring lines: near 0 for a good fit, near 1 for a misfit.
    pub residual_correlation: f64,
    /// Factor of the residual correlation on the standard deviations; 1 where it may be chance.
    pub inflation: f64,
    /// Band of the fit (Hz).
    pub band: (f64, f64),
    /// Number of lines in the band.
    pub lines: usize,
    /// Complex terms of the background polynomial.
    pub background_terms: usize,
    /// Indices of the starts that were fitted jointly, including this one.
    pub joint_with: Vec<usize>,
    /// Reason why the search ended.
    pub stop: StopReason,
    /// Part of the first amplitude at which a mode that changes with its amplitude has this frequency; `None` where the
    /// lines do not tell.
    pub amplitude_part: Option<f64>,
    /// Amplitude in every column of the data that is not zero.
    pub amplitudes: Vec<ColumnAmplitude>,
}

/// Fits the modes that begin at `starts`. Returns for each start a mode, or the reason why there is none.
///
/// Modes nearer than three of their half widths together and a few lines are fitted jointly. The others
/// are subtracted with their own amplitudes, or keep free ones where they lie in the band. A polynomial of
/// the frequency stands for everything else outside, where the data ask for it. Where two starts turn out
/// to be one resonance, the later one fails: put the surer ones first.
pub fn fit_modes(
    data: &ModalData,
    starts: &[PoleStart],
    settings: &FitSettings,
) -> Vec<Result<ModeFit, Unfit>> {
    Accepted::new(data, starts, settings).1
}

/// Poles of one tap fitted alone, with their covariance (lines).
struct TapPoles {
    tap: usize,
    poles: Vec<Complex64>,
    covariance: DMatrix<f64>,
    /// Relative change of all frequencies from the joint fit to the start of this one.
    moved: f64,
}

/// A place where the fit of a tap may begin.
struct TapStart {
    poles: Vec<Complex64>,
    /// Relative change of all frequencies from the joint fit to here.
    moved: f64,
    /// Sum of the squares that these poles leave of each column.
    squares: Vec<f64>,
}

/// Returns the places where the fit of a tap may begin: the joint poles first, then those half widths away. From half
/// widths away no search finds the pole.
fn tap_starts(problem: &PoleProblem, joint: &[Complex64]) -> Vec<TapStart> {
    let narrowest = joint.iter().map(|pole| half_width(*pole) / pole.im);
    let step = narrowest.fold(f64::INFINITY, f64::min);
    let half_widths = (1..=MOST_MOVED).flat_map(|count| [-f64::from(count), f64::from(count)]);
    let mut starts = Vec::new();
    for half_widths in std::iter::once(0.0).chain(half_widths) {
        let moved = half_widths * step;
        let poles = joint
            .iter()
            .map(|pole| pole + Complex64::new(0.0, moved * pole.im));
        let poles: Vec<Complex64> = poles.collect();
        let squares = problem.squares_at(&poles);
        starts.push(TapStart {
            squares: squares.unwrap_or_else(|| vec![f64::INFINITY; problem.columns.ncols()]),
            poles,
            moved,
        });
    }
    starts
}

/// Chooses where the fit of the tap with these columns begins: at the joint poles, or elsewhere where that leaves clearly
/// less residual.
fn chosen<'s>(starts: &'s [TapStart], columns: &[usize], lines: usize) -> &'s TapStart {
    let square_sum =
        |start: &TapStart| -> f64 { columns.iter().map(|&column| start.squares[column]).sum() };
    let here = square_sum(&starts[0]);
    let (mut best, mut least) = (&starts[0], here);
    for start in &starts[1..] {
        let sum = square_sum(start);
        let variance = sum / (2 * lines * columns.len()) as f64;
        if sum < least && here - sum > CLEARLY_LESS * variance {
            (best, least) = (start, sum);
        }
    }
    best
}

/// Reads the modes of one group's fit.
struct GroupReader<'a> {
    data: &'a ModalData,
    group: &'a Group,
    /// Added decay (lines).
    added: f64,
    /// Resolution over line spacing: denser lines repeat each other, and variances grow by that factor.
    repetition: f64,
    /// Correlation of the residual between neighbouring lines.
    correlation: f64,
    /// Factor that it puts on the standard deviations.
    inflation: f64,
    taps: Vec<TapPoles>,
}

impl<'a> GroupReader<'a> {
    fn new(data: &'a ModalData, settings: &FitSettings, group: &'a Group) -> Self {
        let fit = &group.fit;
        let (correlation, inflation) = residual_correlation(fit);
        // The columns of each tap are fitted alone, from the joint poles. Taps that cannot be fitted are left out.
        let mut places: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (place, &column) in fit.used.iter().enumerate() {
            let tap = data.columns()[column].tap;
            places.entry(tap).or_default().push(place);
        }
        // A single tap has the joint fit; the places of functions are no repeats.
        let is_decay = matches!(data.basis(), Basis::FreeDecay { .. });
        let starts = match is_decay && places.len() > 1 {
            true => tap_starts(&fit.problem, &fit.at.poles),
            false => Vec::new(),
        };
        let mut taps = Vec::new();
        for (tap, places) in places {
            let problem = PoleProblem {
                columns: fit.problem.columns.select_columns(&places),
                lines: Arc::clone(&fit.problem.lines),
                fixed: fit.problem.fixed.clone(),
            };
            let (start, moved) = match starts.is_empty() {
                true => (&fit.at.poles, 0.0),
                false => {
                    let start = chosen(&starts, &places, fit.problem.lines.count());
                    (&start.poles, start.moved)
                }
            };
            if let Some(best) = problem.search(start, fit.freedom, TAP_STEPS)
                && let Some(covariance) = best.slopes.covariance(match moved {
                    0.0 => fit.variance,
                    // The joint fit does not describe this tap, and its residual is no noise.
                    _ => {
                        let columns = problem.columns.ncols();
                        let linear = fit.problem.fixed.rank() + 2 * fit.at.poles.len();
                        let values = problem.columns.len() as f64;
                        let unknowns = (linear * columns + 2 * fit.at.poles.len()) as f64;
                        best.at.square_sum / (values - unknowns).max(1.0)
                    }
                })
            {
                taps.push(TapPoles {
                    tap,
                    poles: best.at.poles,
                    covariance,
                    moved,
                });
            }
        }
        GroupReader {
            data,
            group,
            added: settings.added_decay / TAU / data.spacing(),
            repetition: data.resolution() / data.spacing(),
            correlation,
            inflation,
            taps,
        }
    }

    /// Returns the mode at `place` in the group.
    fn mode(&self, place: usize) -> Result<ModeFit, Unfit> {
        let fit = &self.group.fit;
        let spacing = self.data.spacing();
        let all = fit
            .slopes
            .covariance(fit.variance)
            .ok_or(Unfit::NotIndependent)?;
        let in_lines = pole_block(&all, place) * self.repetition * self.inflation * self.inflation;
        let joint = PoleReading::new(fit.at.poles[place], spacing, self.added);
        let covariance = joint.slopes * in_lines * joint.slopes.transpose();
        let stds = [covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt()];
        let freedom = (fit.freedom / self.repetition).max(1.0);
        let taps = self.taps_of(place);
        let [frequencies, dampings] = values_of(&taps);
        let damping_ratio = FittedValue::new(joint.damping_ratio, stds[1], freedom, &dampings);
        // Less than two standard deviations beside the window's decay are no damping.
        let hidden = damping_ratio.value <= 0.0 || damping_ratio.value < 2.0 * damping_ratio.std;
        if self.added > 0.0 && hidden {
            return Err(Unfit::WindowDominates {
                remaining: damping_ratio.value,
                std: damping_ratio.std,
            });
        }
        let to_rad = TAU * spacing;
        let positions = &fit.problem.lines.positions;
        Ok(ModeFit {
            frequency: FittedValue::new(joint.frequency, stds[0], freedom, &frequencies),
            damping_ratio,
            pole: fit.at.poles[place] * to_rad,
            pole_covariance: (in_lines * to_rad * to_rad).into(),
            correlation: covariance[(0, 1)] / (stds[0] * stds[1]),
            taps,
            residual_correlation: self.correlation,
            inflation: self.inflation,
            band: (
                positions[0] * spacing,
                positions[positions.len() - 1] * spacing,
            ),
            lines: positions.len(),
            background_terms: fit.terms,
            joint_with: self.group.members.clone(),
            stop: fit.stop,
            amplitude_part: fit.problem.amplitude_part(&fit.at, place),
            amplitudes: self.amplitudes(place),
        })
    }

    /// Frequency and damping of each tap alone, where its pole stays within a half width of the joint one, or moved
    /// away with all others.
    fn taps_of(&self, place: usize) -> Vec<TapFit> {
        let joint = self.group.fit.at.poles[place];
        let mut taps = Vec::new();
        for tap in &self.taps {
            let from = joint + Complex64::new(0.0, tap.moved * joint.im);
            let near = (tap.poles[place] - from).norm() <= 1.0 + joint.re.abs();
            if !near {
                continue;
            }
            let own = PoleReading::new(tap.poles[place], self.data.spacing(), self.added);
            let in_lines = pole_block(&tap.covariance, place);
            let spread = own.slopes * in_lines * self.repetition * own.slopes.transpose();
            taps.push(TapFit {
                tap: tap.tap,
                frequency: own.frequency,
                frequency_std: spread[(0, 0)].sqrt(),
                damping_ratio: own.damping_ratio,
                damping_std: spread[(1, 1)].sqrt(),
            });
        }
        taps
    }

    /// Returns the amplitude of every used column, with its slopes.
    ///
    /// From b of the fit it is a = 2 b (2 pi df)/(1 - e^{pT}) of a decay, or the residue R = b (2 pi df).
    fn amplitudes(&self, place: usize) -> Vec<ColumnAmplitude> {
        let fit = &self.group.fit;
        let unit = TAU * self.data.spacing();
        // pT = 2 pi q of a decay; the factor's change with q relative to itself is
        // 2 pi e^{pT}/(1 - e^{pT}).
        let (factor, relative) = match self.data.basis() {
            Basis::FreeDecay { .. } => {
                let fallen = (TAU * fit.at.poles[place]).exp();
                let rest = 1.0 - fallen;
                (2.0 * unit / rest, TAU * fallen / rest)
            }
            Basis::FrequencyResponse { .. } => (Complex64::from(unit), Complex64::ZERO),
        };
        // Mean variance of the two parts of an amplitude for unit noise: (R'R)^-1.
        let inverse = &fit.at.inverse;
        let rows = [2 * place, 2 * place + 1].map(|row| inverse.row(row).norm_squared());
        let spread = 0.5 * (rows[0] + rows[1]) * fit.variance * self.repetition;
        let slopes = &fit.slopes.amplitude_slopes;
        let mut amplitudes = Vec::with_capacity(fit.used.len());
        for (index, (&column, &noise)) in fit.used.iter().zip(&fit.noise).enumerate() {
            let b = fit.amplitude(place, index);
            let by_position = complex_row(&slopes[2 * place], place, index);
            let by_position = by_position + Complex64::i() * relative * b;
            let by_decay = complex_row(&slopes[2 * place + 1], place, index) - relative * b;
            amplitudes.push(ColumnAmplitude {
                tap: self.data.columns()[column].tap,
                sensor: self.data.columns()[column].sensor,
                value: b * noise * factor,
                std: spread.sqrt() * noise * factor.norm(),
                by_omega: by_position * noise * factor / unit,
                by_decay: by_decay * noise * factor / unit,
            });
        }
        amplitudes
    }
}

/// Frequency and damping of a pole, and their derivatives.
struct PoleReading {
    /// Natural frequency (Hz).
    frequency: f64,
    damping_ratio: f64,
    /// Derivatives of frequency and damping ratio (rows) to position and decay (lines).
    slopes: Matrix2<f64>,
}

impl PoleReading {
    /// Reads a pole (lines): with w its position, s its decay less `added`, and r = hypot(w, s), the
    /// frequency is r df and the damping ratio s/r.
    fn new(pole: Complex64, spacing: f64, added: f64) -> Self {
        let (position, decay) = (pole.im, -pole.re - added);
        let modulus = position.hypot(decay);
        let cube = modulus.powi(3);
        PoleReading {
            frequency: modulus * spacing,
            damping_ratio: decay / modulus,
            slopes: Matrix2::new(
                position / modulus * spacing,
                decay / modulus * spacing,
                -decay * position / cube,
                position * position / cube,
            ),
        }
    }
}

/// Returns the covariance of position and decay of the pole at `place`, from that of all poles.
fn pole_block(covariance: &DMatrix<f64>, place: usize) -> Matrix2<f64> {
    let block = covariance.fixed_view::<2, 2>(2 * place, 2 * place);
    block.into_owned()
}

/// Returns the correlation of the residual between neighbouring lines, and the factor on the standard deviations.
///
/// r = Re sum e(m) conj(e(m+1)) / sum |e|^2 over neighbouring lines is 1 for a misfit that varies slowly.
/// By chance its standard deviation is 1/sqrt(2 N) for N independent complex pairs. A residual correlated
/// like r^k over k lines needs the factor sqrt((1 + r)/(1 - r)).
fn residual_correlation(fit: &GroupFit) -> (f64, f64) {
    let count = fit.problem.lines.count();
    let positions = &fit.problem.lines.positions;
    let neighbours: Vec<usize> = (0..count - 1)
        .filter(|&line| positions[line + 1] - positions[line] < 1.5)
        .collect();
    let mut product = 0.0;
    for e in fit.problem.residual(&fit.at).column_iter() {
        for &m in &neighbours {
            product += e[m] * e[m + 1] + e[m + count] * e[m + 1 + count];
        }
    }
    let pairs = (neighbours.len() * fit.used.len()).max(1) as f64;
    let share = pairs / (count * fit.used.len()) as f64;
    let correlation = product / (fit.at.square_sum * share).max(f64::MIN_POSITIVE);
    if correlation > CORRELATED * (2.0 * pairs).sqrt().recip() {
        let bounded = correlation.min(0.99);
        (correlation, ((1.0 + bounded) / (1.0 - bounded)).sqrt())
    } else {
        (correlation, 1.0)
    }
}

impl<'a> Accepted<'a> {
    /// Fits the modes that begin at `starts`. Returns also for each start its mode or the reason why there is
    /// none, as [`fit_modes`](super::fit_modes) does.
    pub fn new(
        data: &'a ModalData,
        starts: &[PoleStart],
        settings: &FitSettings,
    ) -> (Self, Vec<Result<ModeFit, Unfit>>) {
        let starts = starts.iter();
        let mut accepted = Accepted {
            data,
            settings: settings.clone(),
            modes: starts
                .map(|start| ModeState::new(data, start, settings.added_decay))
                .collect(),
            most_lines: usize::MAX,
        };
        let groups = accepted.run();
        let fits = accepted.read(&groups);
        (accepted, fits)
    }

    /// Drops a mode; [`refit`](Self::refit) then fits the others again.
    pub fn remove(&mut self, index: usize) {
        self.modes[index].failed = Some(Unfit::Unneeded);
    }

    /// Fits all modes again from where they are. Returns for each start its mode or the reason why there is none.
    pub fn refit(&mut self) -> Vec<Result<ModeFit, Unfit>> {
        let groups = self.run();
        self.read(&groups)
    }

    /// Reads the modes from the fits of their groups. Returns for each start its mode, or why there is none.
    pub(super) fn read(&mut self, groups: &[Group]) -> Vec<Result<ModeFit, Unfit>> {
        let mut fits: Vec<Option<ModeFit>> = vec![None; self.modes.len()];
        for group in groups {
            let reader = GroupReader::new(self.data, &self.settings, group);
            for (place, &index) in group.members.iter().enumerate() {
                match reader.mode(place) {
                    Ok(fit) => fits[index] = Some(fit),
                    Err(reason) => self.modes[index].failed = Some(reason),
                }
            }
        }
        judge_scatter(&mut fits);
        let fits = fits.into_iter().zip(&self.modes);
        fits.map(|(fit, state)| fit.ok_or_else(|| state.reason()))
            .collect()
    }
}
