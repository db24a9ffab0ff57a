//! Whether the data ask for one more mode.

use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::data::{Basis, ModalData};
use super::group::{BandData, GroupFit};
use super::mode_fit::{ModeFit, mode_fits};
use super::sweep::{Group, Sweeper};
use super::{FitSettings, PoleStart, Unfit};

/// What speaks for one more mode, and what against it.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraMode {
    /// Whether the data ask for it: all of what follows speaks for it.
    pub verdict: ExtraVerdict,
    /// Fall of the residual per unknown over the residual per degree of freedom.
    pub f_statistic: f64,
    /// Probability of a larger fall by noise alone at one given place.
    pub probability: f64,
    /// Fall of Schwarz's criterion; positive speaks for the mode.
    pub information_gain: f64,
    /// Size of its amplitudes over their standard deviation, root of the mean square over the columns.
    pub amplitude_over_std: f64,
    /// Likeness of its shape to that of the nearest other mode of its group: the modal assurance criterion over the
    /// sensors of a decay, mean of all taps weighted by their power, of functions over all columns; `None` without such a mode, or with one
    /// sensor. Near 1 the second pole may only mend a line that is no straight decay: one mode whose frequency
    /// changes while it rings. How the two share a tap depends then on the tap's strength, and is no sign of another
    /// shape.
    pub likeness: Option<f64>,
    /// Its fit together with the others, where there is one.
    pub fit: Result<ModeFit, Unfit>,
}

/// Outcome of the test for one more mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExtraVerdict {
    /// The data ask for it.
    Needed,
    /// Noise alone would do as well.
    NotSignificant,
    /// It has no pole of its own near its start, or one that does not decay by two standard deviations.
    NoMode,
}

/// The fall of the residual by chance must be less probable than this. 10^-4: the place of the pole was
/// chosen to suit the data, out of some tens of lines.
const LEVEL: f64 = 1e-4;
/// Least amplitude in standard deviations.
const LEAST_AMPLITUDE: f64 = 4.0;
/// Lines of its band on which a mode is tried first. In a record much longer than its decay a mode has ten
/// thousand of them, and to fit them all for every proposal of chance takes too long. The price: of one line in s an
/// amplitude has sqrt(s) times its standard deviation, so that a mode that only all lines together show is not found.
const SCREENED: usize = 1000;

/// Modes that are fitted, beside which others are tested.
#[derive(Debug, Clone)]
pub struct Accepted<'a> {
    sweeper: Sweeper<'a>,
    settings: FitSettings,
}

impl<'a> Accepted<'a> {
    /// The modes that begin at `starts`, and for each start its mode or why there is none, as [`fit_modes`] has
    /// them.
    ///
    /// [`fit_modes`]: super::fit_modes
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

    /// Tests whether the data ask for a mode that begins at `extra` beside these; and all of them together.
    ///
    /// Both models are fitted to the same lines with the same background; the one more pole must lower the
    /// residual by far more than its unknowns explain, decay, and stand out of its own uncertainty. Modes that
    /// are not fitted jointly with it stay as they are. What fails on the lines of a thinned band is not tried on
    /// all of them.
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

    /// The test on so many lines of its band at most, and of how many lines one was taken.
    fn test_on(&self, extra: &PoleStart, most_lines: usize) -> (ExtraMode, Self, usize) {
        let mut beside = self.clone();
        beside.sweeper.most_lines = most_lines;
        let group = beside.sweeper.add(extra);
        let stride = group.as_ref().map_or(1, |group| group.fit.lines.stride);
        let test = match group {
            Some(group) => beside.judge(&group),
            None => {
                let last = beside.sweeper.modes.last();
                let failed = last.and_then(|mode| mode.failed.clone());
                without_mode(Err(failed.unwrap_or(Unfit::NotIndependent)))
            }
        };
        (test, beside, stride)
    }

    /// What speaks for the last mode, one of this group.
    fn judge(&mut self, group: &Group) -> ExtraMode {
        let last = self.sweeper.modes.len() - 1;
        let groups = std::slice::from_ref(group);
        let fit = mode_fits(&mut self.sweeper, groups, &self.settings)
            .pop()
            .unwrap_or(Err(Unfit::NotIndependent));
        let inside = group.members.iter().position(|&index| index == last);
        let (Some(inside), Ok(mode)) = (inside, &fit) else {
            return without_mode(fit);
        };
        let local = self.sweeper.band(&group.members).ok();
        let compared = local.and_then(|local| compare(&local, &group.fit, inside));
        let Some((f_statistic, probability, information_gain)) = compared else {
            return without_mode(fit);
        };
        let amplitude_over_std = over_std(mode);
        let decays = mode.damping_ratio.value > 2.0 * mode.damping_ratio.std;
        let needed =
            probability < LEVEL && information_gain > 0.0 && amplitude_over_std > LEAST_AMPLITUDE;
        ExtraMode {
            verdict: match (needed, decays) {
                (true, true) => ExtraVerdict::Needed,
                (true, false) => ExtraVerdict::NoMode,
                (false, _) => ExtraVerdict::NotSignificant,
            },
            f_statistic,
            probability,
            information_gain,
            amplitude_over_std,
            likeness: likeness(self.sweeper.data, &group.fit, inside),
            fit,
        }
    }
}

fn without_mode(fit: Result<ModeFit, Unfit>) -> ExtraMode {
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

/// F statistic, its probability by chance, and the fall of Schwarz's criterion for the pole at `place`.
///
/// With residuals S0 and S1 of the models without and with it, k unknowns more (two of the pole, two
/// amplitudes a column) and n real values: F = (S0 - S1)/k/(S1/freedom); criterion n ln S + k ln n.
fn compare(local: &BandData, fit: &GroupFit, place: usize) -> Option<(f64, f64, f64)> {
    let mut fewer: Vec<Complex64> = fit.at.poles.clone();
    fewer.remove(place);
    let columns = fit.used.len() as f64;
    let unknowns = 2.0 + 2.0 * columns;
    let values = 2.0 * local.lines.count() as f64 * columns;
    // Both anew over the same lines: those of the last sweep followed from the poles before it.
    let with = local.fit(&fit.at.poles, fit.terms, &fit.noise).ok()?;
    let without = if fewer.is_empty() {
        local.square_sum_without(fit.terms, &fit.noise)
    } else {
        local.fit(&fewer, fit.terms, &fit.noise).ok()?.at.square_sum
    };
    let statistic = (without - with.at.square_sum) / unknowns / with.variance;
    let chance = FisherSnedecor::new(unknowns, with.freedom).ok()?;
    let probability = if statistic > 0.0 {
        chance.sf(statistic)
    } else {
        1.0
    };
    let gain = values * (without / with.at.square_sum).ln() - unknowns * values.ln();
    Some((statistic, probability, gain))
}

/// Root of the mean square of amplitude over standard deviation.
fn over_std(mode: &ModeFit) -> f64 {
    let squares = mode
        .amplitudes
        .iter()
        .map(|a| (a.value.norm() / a.std).powi(2));
    (squares.sum::<f64>() / mode.amplitudes.len().max(1) as f64).sqrt()
}

/// sum_t |sum_s conj(b) c|^2/(sum_t sum_s |b|^2 sum_s |c|^2) over taps t and sensors s with the nearest pole of the
/// group, in units of noise. Functions of places or groups of taps count together: their places are part of a shape.
fn likeness(data: &ModalData, fit: &GroupFit, place: usize) -> Option<f64> {
    let poles = &fit.at.poles;
    let distance = |other: &usize| (poles[*other] - poles[place]).norm();
    let nearest = (0..poles.len())
        .filter(|&other| other != place)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let of = |pole: usize, column: usize| {
        let amplitudes = &fit.at.amplitudes;
        Complex64::new(
            amplitudes[(2 * pole, column)],
            amplitudes[(2 * pole + 1, column)],
        )
    };
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
        let product: Complex64 = shape
            .iter()
            .map(|&c| of(place, c).conj() * of(nearest, c))
            .sum();
        let power = |pole: usize| shape.iter().map(|&c| of(pole, c).norm_sqr()).sum::<f64>();
        alike += product.norm_sqr();
        whole += power(place) * power(nearest);
    }
    (whole > 0.0).then(|| alike / whole)
}
