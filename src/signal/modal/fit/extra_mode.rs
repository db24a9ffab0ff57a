//! Test for one more mode.

use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use tapjoint_numerics::stats::root_mean_square;

use super::data::{Basis, ModalData};
use super::group::{BandData, GroupFit};
use super::mode_fit::{ModeFit, mode_fits};
use super::sweep::{Group, Sweeper};
use super::{FitSettings, PoleStart, Unfit};

/// Test result for one more mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraMode {
    /// Outcome of the test; every figure below must support the mode.
    pub verdict: ExtraVerdict,
    /// Fall of the residual per unknown over the residual per degree of freedom.
    pub f_statistic: f64,
    /// Probability of a larger fall by noise alone at one given place.
    pub probability: f64,
    /// Fall of Schwarz's criterion; a positive value supports the mode.
    pub information_gain: f64,
    /// Root mean square over the columns of amplitude over standard deviation.
    pub amplitude_over_std: f64,
    /// Modal assurance criterion between its shape and that of the nearest other mode of its group.
    ///
    /// For free decays it is taken over the sensors, as the mean of all taps weighted by their power; for
    /// frequency response functions over all columns. `None` without such a mode, or with one sensor. Near 1
    /// the second pole may only correct a decay that is not straight: one mode whose frequency changes while
    /// it rings. The two poles' shares of a tap then depend on the tap's strength, which is no other shape.
    pub likeness: Option<f64>,
    /// Fit of the mode together with the others.
    pub fit: Result<ModeFit, Unfit>,
}

/// Outcome of the test for one more mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExtraVerdict {
    /// The data need the mode.
    Needed,
    /// Noise alone explains it as well.
    NotSignificant,
    /// It has no pole of its own near its start, or one that does not decay by two standard deviations.
    NoMode,
}

/// Largest probability of the residual's fall by chance. 10^-4: the place of the pole was chosen to suit
/// the data, out of some tens of lines.
const LEVEL: f64 = 1e-4;
/// Least amplitude in standard deviations.
const LEAST_AMPLITUDE: f64 = 4.0;
/// Lines of its band on which a mode is tried first. In a record much longer than its decay a mode has ten
/// thousand of them, too many to fit for every chance proposal. On one line in s an amplitude has sqrt(s)
/// times its standard deviation, so that a mode that only all lines together show is not found.
const SCREENED: usize = 1000;

/// Fitted modes, beside which other modes are tested.
#[derive(Debug, Clone)]
pub struct Accepted<'a> {
    sweeper: Sweeper<'a>,
    settings: FitSettings,
}

impl<'a> Accepted<'a> {
    /// Fits the modes that begin at `starts`. Returns also for each start its mode or the reason why there is
    /// none, as [`fit_modes`](super::fit_modes) does.
    pub fn new(
        data: &'a ModalData,
        starts: &[PoleStart],
        settings: &FitSettings,
    ) -> (Self, Vec<Result<ModeFit, Unfit>>) {
        let mut sweeper = Sweeper::new(data, starts, &settings.steady_lines, settings.added_decay);
        let groups = sweeper.run();
        let fits = mode_fits(&mut sweeper, &groups, settings);
        let settings = settings.clone();
        (Accepted { sweeper, settings }, fits)
    }

    /// Tests whether the data ask for a mode that begins at `extra`. Returns the test, and all modes together.
    ///
    /// The models with and without it are fitted to the same lines with the same background. The extra pole
    /// must lower the residual by far more than its unknowns explain, decay, and exceed its own uncertainty.
    /// Modes that are not fitted jointly with it do not change. A start that fails on thinned lines is not
    /// tried on all lines.
    pub fn test(&self, extra: &PoleStart) -> (ExtraMode, Self) {
        let (test, together, stride) = self.test_on(extra, SCREENED);
        if test.verdict != ExtraVerdict::Needed || stride == 1 {
            return (test, together.with_all_lines());
        }
        let (test, together, _) = self.test_on(extra, usize::MAX);
        (test, together)
    }

    fn with_all_lines(mut self) -> Self {
        self.sweeper.most_lines = usize::MAX;
        self
    }

    /// Tests on at most so many lines of the band. Returns also the step between the lines taken.
    fn test_on(&self, extra: &PoleStart, most_lines: usize) -> (ExtraMode, Self, usize) {
        let mut beside = self.clone();
        beside.sweeper.most_lines = most_lines;
        let Some(group) = beside.sweeper.add(extra) else {
            let last = beside.sweeper.modes.last();
            let failed = last.and_then(|mode| mode.failed.clone());
            let reason = failed.unwrap_or(Unfit::NotIndependent);
            return (ExtraMode::none(Err(reason)), beside, 1);
        };
        let test = beside.judge(&group);
        (test, beside, group.fit.lines.stride)
    }

    /// Judges the last mode, which belongs to this group.
    fn judge(&mut self, group: &Group) -> ExtraMode {
        let last = self.sweeper.modes.len() - 1;
        let groups = std::slice::from_ref(group);
        let fit = mode_fits(&mut self.sweeper, groups, &self.settings)
            .pop()
            .unwrap_or(Err(Unfit::NotIndependent));
        let place = group.members.iter().position(|&index| index == last);
        let (Some(place), Ok(mode)) = (place, &fit) else {
            return ExtraMode::none(fit);
        };
        let band = self.sweeper.band(&group.members).ok();
        let compared = band.and_then(|band| Comparison::new(&band, &group.fit, place));
        let Some(compared) = compared else {
            return ExtraMode::none(fit);
        };
        let amplitudes = mode.amplitudes.iter();
        let ratios: Vec<f64> = amplitudes.map(|a| a.value.norm() / a.std).collect();
        let amplitude_over_std = root_mean_square(&ratios);
        let decays = mode.damping_ratio.value > 2.0 * mode.damping_ratio.std;
        let needed = compared.probability < LEVEL
            && compared.information_gain > 0.0
            && amplitude_over_std > LEAST_AMPLITUDE;
        ExtraMode {
            verdict: match (needed, decays) {
                (true, true) => ExtraVerdict::Needed,
                (true, false) => ExtraVerdict::NoMode,
                (false, _) => ExtraVerdict::NotSignificant,
            },
            f_statistic: compared.f_statistic,
            probability: compared.probability,
            information_gain: compared.information_gain,
            amplitude_over_std,
            likeness: likeness(self.sweeper.data, &group.fit, place),
            fit,
        }
    }
}

impl ExtraMode {
    /// Result where the start has no mode.
    fn none(fit: Result<ModeFit, Unfit>) -> Self {
        ExtraMode {
            verdict: ExtraVerdict::NoMode,
            f_statistic: 0.0,
            probability: 1.0,
            information_gain: f64::NEG_INFINITY,
            amplitude_over_std: 0.0,
            likeness: None,
            fit,
        }
    }
}

/// Comparison of the models with and without one pole.
struct Comparison {
    f_statistic: f64,
    /// Probability of a larger statistic by chance.
    probability: f64,
    /// Fall of Schwarz's criterion.
    information_gain: f64,
}

impl Comparison {
    /// Compares the fits with and without the pole at `place`.
    ///
    /// S0 and S1 are the residuals without and with it. It has k unknowns (two of the pole, two amplitudes
    /// a column), and there are n real values. Then F = (S0 - S1)/k/(S1/freedom), and the criterion is
    /// n ln S + k ln n.
    fn new(band: &BandData, fit: &GroupFit, place: usize) -> Option<Self> {
        let mut fewer: Vec<Complex64> = fit.at.poles.clone();
        fewer.remove(place);
        let columns = fit.used.len() as f64;
        let unknowns = 2.0 + 2.0 * columns;
        let values = 2.0 * band.lines.count() as f64 * columns;
        // Both fits are made anew on the same lines: the lines of the last sweep came from earlier poles.
        let with = band.fit(&fit.at.poles, fit.terms, &fit.noise).ok()?;
        let without = if fewer.is_empty() {
            band.square_sum_without(fit.terms, &fit.noise)
        } else {
            band.fit(&fewer, fit.terms, &fit.noise).ok()?.at.square_sum
        };
        let f_statistic = (without - with.at.square_sum) / unknowns / with.variance;
        let chance = FisherSnedecor::new(unknowns, with.freedom).ok()?;
        let significant = f_statistic > 0.0;
        Some(Comparison {
            f_statistic,
            probability: if significant {
                chance.sf(f_statistic)
            } else {
                1.0
            },
            information_gain: values * (without / with.at.square_sum).ln() - unknowns * values.ln(),
        })
    }
}

/// Likeness of the shapes of a pole and of the nearest pole of its group, in units of noise.
///
/// It is sum_t |sum_s conj(b) c|^2/(sum_t sum_s |b|^2 sum_s |c|^2) over taps t and sensors s. Frequency
/// response functions count together: the places of their taps are part of a shape.
fn likeness(data: &ModalData, fit: &GroupFit, place: usize) -> Option<f64> {
    let poles = &fit.at.poles;
    let distances = poles.iter().map(|pole| (pole - poles[place]).norm());
    let (nearest, _) = distances
        .enumerate()
        .filter(|(other, _)| *other != place)
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let tap = |column: usize| match data.basis() {
        Basis::FreeDecay { .. } => data.columns()[fit.used[column]].tap,
        Basis::FrequencyResponse { .. } => 0,
    };
    let columns: Vec<usize> = (0..fit.used.len()).collect();
    let (mut alike, mut whole) = (0.0, 0.0);
    for shape in columns.chunk_by(|a, b| tap(*a) == tap(*b)) {
        if shape.len() < 2 {
            continue;
        }
        let (mut product, mut own_power, mut other_power) = (Complex64::ZERO, 0.0, 0.0);
        for &column in shape {
            let own = fit.amplitude(place, column);
            let other = fit.amplitude(nearest, column);
            product += own.conj() * other;
            own_power += own.norm_sqr();
            other_power += other.norm_sqr();
        }
        alike += product.norm_sqr();
        whole += own_power * other_power;
    }
    (whole > 0.0).then(|| alike / whole)
}
