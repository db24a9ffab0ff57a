//! Fits of groups of modes, each over its band, swept until the poles stay.
//!
//! A sweep fits one group after the other, with the amplitudes that the other groups had before. A band reaches
//! ten half widths to either side of its modes. Modes near each other form a group and are fitted jointly.
//! Distant modes are subtracted, near ones keep free amplitudes, and a polynomial of the frequency stands for
//! everything else that the data show in the band.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::group_fit::GroupFit;
use super::variable_projection::{Lines, PoleProblem, half_width};
use super::{Basis, FitSettings, ModalData, PoleStart, Unfit};
use crate::modal::Subspace;

/// Half of a band in effective half widths. 10: the lines outside would improve the standard deviation
/// by 3 % (computed from the information on the pole on all lines and on those of the band).
const HALF_WIDTHS: f64 = 10.0;
/// Least half of a band (lines). 12: the equivalent for resonances narrower than a line, and enough
/// values beside the unknowns.
const LEAST_HALF: f64 = 12.0;
/// Modes nearer than so many of their half widths together, and so many lines, are fitted jointly. 3:
/// the poles' common information then raises two standard deviations by less than 1 %.
const JOINT: f64 = 3.0;
/// Most terms of the background: constant, slope, curvature.
const MOST_TERMS: usize = 3;
/// Most steps of a search. 30: one that has not ended by then has no minimum near its start.
const MOST_STEPS: usize = 30;
/// Largest error of a sensor's noise power before the weights are set anew. 20 %: that costs less than a
/// percent of the precision, and a short band does not know its noise better.
const NOISE_CHANGE: f64 = 0.2;

/// Half of the band of a pole (lines).
pub(super) fn half_band(pole: Complex64) -> f64 {
    (HALF_WIDTHS * half_width(pole)).max(LEAST_HALF)
}

/// Sorts poles into the groups that are fitted jointly, ascending in frequency. Returns their indices.
pub(super) fn groups(poles: &[(usize, Complex64)]) -> Vec<Vec<usize>> {
    let mut sorted = poles.to_vec();
    sorted.sort_by(|a, b| a.1.im.total_cmp(&b.1.im));
    sorted
        .chunk_by(|(_, a), (_, b)| b.im - a.im < JOINT * (half_width(*a) + half_width(*b) + 1.0))
        .map(|group| group.iter().map(|&(index, _)| index).collect())
        .collect()
}

/// Index range of the lines between two positions (lines).
pub(super) fn lines_between(data: &ModalData, low: f64, high: f64) -> Range<usize> {
    let frequencies = data.frequencies();
    let first = frequencies.partition_point(|f| f / data.spacing() < low);
    let end = frequencies.partition_point(|f| f / data.spacing() <= high);
    first..end.max(first)
}

/// Lines of a group's band without distant modes, and the functions of the near ones.
pub(super) struct BandData<'a> {
    pub data: &'a ModalData,
    pub lines: Arc<Lines>,
    /// Indices of the columns that are not zero throughout.
    pub used: Vec<usize>,
    /// Real over imaginary parts of these columns.
    values: DMatrix<f64>,
    /// Poles of near neighbours and steady lines.
    near: Vec<Complex64>,
}

impl<'a> BandData<'a> {
    /// Takes the band of some modes at their present poles out of the data.
    ///
    /// Neighbours outside the band are subtracted, once they have been fitted. Those inside, or less than a quarter
    /// of the band away, keep free amplitudes.
    pub fn new(accepted: &Accepted<'a>, members: &[usize]) -> Result<Self, Unfit> {
        let data = accepted.data;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for pole in accepted.poles(members) {
            low = low.min(pole.im - half_band(pole));
            high = high.max(pole.im + half_band(pole));
        }
        let range = lines_between(data, low, high);
        // Two complex lines for a pole's two parts and its amplitude, and one to see a misfit.
        let least = 2 * members.len() + 1;
        if range.len() < least {
            return Err(Unfit::TooFewLines {
                lines: range.len(),
                least,
            });
        }
        let lines = Arc::new(Lines::new(data, range, accepted.most_lines.max(least)));
        let (first, stride, count) = (lines.first, lines.stride, lines.count());
        let mut used: Vec<usize> = (0..data.columns().len()).collect();
        used.retain(|&index| {
            let values = data.columns()[index].values[first..].iter();
            let mut values = values.step_by(stride).take(count);
            values.any(|value| value.norm_sqr() > 0.0)
        });
        if used.is_empty() {
            return Err(Unfit::NoSignal);
        }
        let mut values = DMatrix::zeros(2 * count, used.len());
        for (mut column, &index) in values.column_iter_mut().zip(&used) {
            let taken = data.columns()[index].values[first..].iter().step_by(stride);
            for (line, value) in taken.take(count).enumerate() {
                column[line] = value.re;
                column[line + count] = value.im;
            }
        }
        let margin = 0.25 * (high - low);
        let reach = low - margin..=high + margin;
        let (mut near, mut distant) = (Vec::new(), Vec::new());
        let mut amplitudes = Vec::new();
        for (index, pole) in accepted.alive() {
            if members.contains(&index) {
                continue;
            }
            if reach.contains(&pole.im) {
                near.push(pole);
            } else if let Some(all) = &accepted.modes[index].amplitudes {
                distant.push(pole);
                amplitudes.push(all);
            }
        }
        if !distant.is_empty() {
            let amplitudes = DMatrix::from_fn(2 * distant.len(), used.len(), |row, place| {
                let value = amplitudes[row / 2][used[place]];
                if row % 2 == 0 { value.re } else { value.im }
            });
            values.gemm(-1.0, &lines.model(&distant), &amplitudes, 1.0);
        }
        let steady = accepted.settings.steady_lines.iter();
        let hum = steady.filter(|line| reach.contains(&(line.frequency / data.spacing())));
        near.extend(hum.flat_map(|line| line.poles(data.spacing())));
        Ok(BandData {
            data,
            lines,
            used,
            values,
            near,
        })
    }

    /// Root mean square of each sensor's columns: a first scale of the noise, for every column.
    pub fn scale(&self) -> Vec<f64> {
        let squares = self
            .values
            .column_iter()
            .map(|column| column.norm_squared());
        self.by_sensor(&Vec::from_iter(squares), self.values.nrows() as f64)
    }

    /// Root of the mean square over all columns of a column's sensor, for every column, from the sum of the `squares` of each.
    ///
    /// `freedom` are the degrees of freedom of one column.
    fn by_sensor(&self, squares: &[f64], freedom: f64) -> Vec<f64> {
        let sensor = |&column: &usize| self.data.columns()[column].sensor;
        let mut sums: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for (column, square) in self.used.iter().zip(squares) {
            let (sum, count) = sums.entry(sensor(column)).or_default();
            *sum += square;
            *count += 1.0;
        }
        let scales = self.used.iter().map(|column| {
            let (sum, count) = sums[&sensor(column)];
            (sum / (count * freedom)).sqrt()
        });
        scales.collect()
    }

    /// Returns the problem with `terms` terms of background, its columns in units of `noise`.
    pub fn problem(&self, terms: usize, noise: &[f64]) -> PoleProblem {
        let mut columns = self.values.clone();
        for (mut column, noise) in columns.column_iter_mut().zip(noise) {
            column /= *noise;
        }
        let alone = PoleProblem {
            lines: Arc::clone(&self.lines),
            fixed: Subspace::none(columns.nrows()),
            columns,
        };
        let near = alone.beside(&self.lines.model(&self.near));
        near.beside(&self.lines.polynomial(0..terms))
    }

    /// Looks for a better start of the pole at `place`: other dampings, other places, other dampings again.
    ///
    /// A start half a line off lies outside the valley of a resonance narrower than a line.
    pub fn improve_start(
        &self,
        poles: &mut [Complex64],
        place: usize,
        damping_known: bool,
        terms: usize,
        noise: &[f64],
    ) {
        let factors: &[f64] = match damping_known {
            true => &[0.5, 1.0, 2.0],
            false => &[0.1, 0.3, 1.0, 3.0, 10.0],
        };
        let line = self.data.resolution() / self.data.spacing();
        let shares = [-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75].iter();
        let problem = self.problem(terms, noise);
        for round in 0..3 {
            let pole = poles[place];
            let tries: Vec<Complex64> = match round {
                1 => (shares.clone())
                    .map(|share| pole + Complex64::new(0.0, share * line))
                    .collect(),
                _ => (factors.iter())
                    .map(|factor| Complex64::new(pole.re * factor, pole.im))
                    .collect(),
            };
            let (mut best, mut least) = (pole, f64::INFINITY);
            for pole in tries {
                poles[place] = pole;
                if let Some(at) = problem.amplitudes_at(poles)
                    && at.square_sum < least
                {
                    (best, least) = (pole, at.square_sum);
                }
            }
            poles[place] = best;
        }
    }

    /// Fits from `start` with `terms` terms of background and given noise of the columns (any scale).
    pub fn fit(&self, start: &[Complex64], terms: usize, noise: &[f64]) -> Result<GroupFit, Unfit> {
        self.search(start, terms, noise, MOST_STEPS)
    }

    /// Fits with at most so many steps of the poles; without any, only the amplitudes.
    pub fn search(
        &self,
        start: &[Complex64],
        terms: usize,
        noise: &[f64],
        steps: usize,
    ) -> Result<GroupFit, Unfit> {
        self.search_in(self.problem(terms, noise), start, terms, noise, steps)
    }

    /// Fits as [`search`](Self::search) does, where the problem with these terms and this noise is known.
    fn search_in(
        &self,
        problem: PoleProblem,
        start: &[Complex64],
        terms: usize,
        noise: &[f64],
        steps: usize,
    ) -> Result<GroupFit, Unfit> {
        let freedom = self.freedom(&problem.fixed, start.len())?;
        let best = problem
            .search(start, freedom, steps)
            .ok_or(Unfit::NotIndependent)?;
        Ok(GroupFit {
            variance: best.at.square_sum / freedom,
            at: best.at,
            slopes: best.slopes,
            stop: best.stop,
            noise: noise.to_vec(),
            freedom,
            terms,
            used: self.used.clone(),
            problem,
        })
    }

    /// Degrees of freedom of the residual: real values less amplitudes, fixed part and poles.
    pub fn freedom(&self, fixed: &Subspace<f64>, poles: usize) -> Result<f64, Unfit> {
        let linear = fixed.rank() + 2 * poles;
        let rows = self.values.nrows();
        let lines = self.lines.count();
        if rows < linear + 2 {
            let least = linear.div_ceil(2) + 1;
            return Err(Unfit::TooFewLines { lines, least });
        }
        match ((rows - linear) * self.used.len()).checked_sub(2 * poles) {
            Some(rest) if rest > 0 => Ok(rest as f64),
            // A single column needs more lines than a pole's own unknowns.
            _ => Err(Unfit::TooFewLines {
                lines,
                least: linear.div_ceil(2) + poles + 1,
            }),
        }
    }

    /// Returns true where `terms` terms of background and the poles leave half of the lines.
    pub fn has_room(&self, poles: &[Complex64], terms: usize) -> bool {
        self.lines.count() >= 2 * (terms + 2 * poles.len()) + 2
    }

    /// Noise of each column, from the residual of its sensor.
    pub fn noise_of(&self, fit: &GroupFit) -> Vec<f64> {
        let linear = fit.problem.fixed.rank() + fit.at.amplitudes.nrows();
        let freedom = (self.values.nrows() - linear) as f64;
        let mut noise = self.by_sensor(&fit.at.column_squares, freedom);
        for (place, (noise, scale)) in noise.iter_mut().zip(&fit.noise).enumerate() {
            // Rounding leaves 10^-13 of the values: a smaller residual tells nothing of the sensor.
            let floor = 1e-13 * self.values.column(place).amax();
            *noise = (*noise * scale).max(floor).max(f64::MIN_POSITIVE);
        }
        noise
    }

    /// Fits from the poles and the noise of the sweep before.
    ///
    /// Terms of background are added while the data ask for them. The noise is taken from the residual.
    pub fn settled_fit(&self, poles: &[Complex64], noise: &[f64]) -> Result<GroupFit, Unfit> {
        let mut fit = self.fit(poles, 0, noise)?;
        for terms in 1..=MOST_TERMS {
            if !self.has_room(poles, terms) {
                break;
            }
            let problem = fit.problem.beside(&self.lines.polynomial(terms - 1..terms));
            match self.search_in(problem, &fit.at.poles, terms, noise, MOST_STEPS) {
                Ok(more) if fit.needs(&more) => fit = more,
                Ok(_) | Err(_) => break,
            }
        }
        let found = self.noise_of(&fit);
        // A factor common to all columns changes no weight; the residual variance contains it.
        let variance = fit.variance.max(f64::MIN_POSITIVE);
        let mut pairs = found.iter().zip(noise);
        if pairs.any(|(new, old)| ((new / old).powi(2) / variance - 1.0).abs() > NOISE_CHANGE) {
            return self.fit(&fit.at.poles, fit.terms, &found);
        }
        Ok(fit)
    }
}

/// Most sweeps in which no start fails; two suffice for modes far apart.
const MOST_SWEEPS: usize = 8;
/// Most sweeps that test one more start. 6: after as many the poles of a dozen damped modes move by about a standard
/// deviation, and a mode that is needed stands far clearer. All modes are fitted again after the tests.
const TEST_SWEEPS: usize = 6;
/// A sweep that moves no pole by more than this share of its standard deviation is the last.
const STILL: f64 = 0.02;
/// Number of first sweeps over functions that fit amplitudes only and keep poles of known damping. 2: the second sweep
/// knows the amplitudes of all neighbours. Without them a pole would move to its neighbour.
const HELD_SWEEPS: usize = 2;
/// Number of times that steady lines are placed. 2: the first time the modes beside them are disturbed by the wrong place.
const PLACED: usize = 2;
/// Terms of the background while neighbours have not been fitted.
const FIRST_TERMS: usize = 2;

/// One mode between the sweeps.
#[derive(Debug, Clone)]
pub(super) struct ModeState {
    start: Complex64,
    /// True where the start has a damping of its own.
    damping_known: bool,
    pole: Complex64,
    amplitudes: Option<Vec<Complex64>>,
    /// Noise of every column in its band; 0 where a column was not used.
    noise: Vec<f64>,
    pub failed: Option<Unfit>,
}

impl ModeState {
    /// Begins at a start; `added` is a window's decay (1/s).
    pub fn new(data: &ModalData, start: &PoleStart, added: f64) -> Self {
        let position = start.frequency / data.spacing();
        let unknown = 0.3 * data.resolution() / data.spacing();
        let decay = start
            .damping_ratio
            .filter(|ratio| *ratio > 0.0)
            .map_or(unknown, |ratio| ratio * position);
        let pole = Complex64::new(-decay - added / TAU / data.spacing(), position);
        let possible = position > 0.0 && start.frequency < data.highest() && pole.is_finite();
        ModeState {
            start: pole,
            damping_known: start.damping_ratio.is_some(),
            pole,
            amplitudes: None,
            noise: Vec::new(),
            failed: (!possible).then_some(Unfit::OutsideBand),
        }
    }

    /// Reason why there is no mode; where none is known, the mode cannot be told from another.
    pub fn reason(&self) -> Unfit {
        self.failed.clone().unwrap_or(Unfit::NotIndependent)
    }

    /// Returns the reason why the fitted pole is no mode near its start.
    ///
    /// `deviations` are the standard deviations of position and decay (lines).
    fn refusal(&self, data: &ModalData, deviations: [f64; 2]) -> Option<Unfit> {
        let spacing = data.spacing();
        let line = data.resolution() / spacing;
        let pole = self.pole;
        let allowed = 3.0 * line + 3.0 * self.start.re.abs().max(pole.re.abs());
        let lines = data.frequencies();
        let (first, last) = (lines[0], lines[lines.len() - 1]);
        let away = (pole.im - self.start.im).abs();
        if pole.im < first / spacing || pole.im > last / spacing || away > allowed {
            return Some(Unfit::LeftStart {
                frequency: pole.im * spacing,
                distance: away * spacing,
            });
        }
        if pole.re >= 0.0 {
            return Some(Unfit::NoDecay);
        }
        let wide = line.max(pole.re.abs());
        let vague = deviations.iter().any(|std| std.is_nan() || *std > wide);
        vague.then_some(Unfit::Undetermined {
            std: deviations[0] * spacing,
        })
    }
}

/// A group after the last sweep.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub members: Vec<usize>,
    pub fit: GroupFit,
}

/// Fitted modes, beside which other modes are tested.
#[derive(Debug, Clone)]
pub struct Accepted<'a> {
    pub(super) data: &'a ModalData,
    pub(super) settings: FitSettings,
    pub(super) modes: Vec<ModeState>,
    /// Most lines of a band that are taken.
    pub(super) most_lines: usize,
}

impl Accepted<'_> {
    /// Fits one more start beside modes that were swept; `None` where it fails.
    ///
    /// Returns its group after the last sweep. Modes of other groups do not change.
    pub(super) fn add(&mut self, start: &PoleStart) -> Option<Group> {
        let place = self.modes.len();
        let added = self.settings.added_decay;
        self.modes.push(ModeState::new(self.data, start, added));
        let mut fitted = Vec::new();
        for sweep in 0..TEST_SWEEPS {
            let groups = groups(&self.alive());
            let mut own = groups.into_iter().find(|group| group.contains(&place))?;
            // Other modes of the group stay as they are where they are too narrow for thinned lines.
            let stride = 2.0 * half_band(self.modes[place].pole) / self.most_lines as f64;
            own.retain(|&index| {
                index == place || stride <= 1.0 || half_width(self.modes[index].pole) >= stride
            });
            let moved = self.sweep(vec![own], &mut fitted, false);
            let may_be_needed =
                (fitted.last()).is_none_or(|group| self.may_be_needed(group, place));
            if !may_be_needed {
                self.modes[place].failed = Some(Unfit::Unneeded);
                return None;
            }
            if sweep > 0 && moved < STILL {
                break;
            }
        }
        let settled = self.modes[place].amplitudes.is_some();
        fitted.pop().filter(|_| settled)
    }

    /// Indices and poles of the modes that have not failed.
    fn alive(&self) -> Vec<(usize, Complex64)> {
        let modes = self.modes.iter().enumerate();
        let alive = modes.filter(|(_, mode)| mode.failed.is_none());
        alive.map(|(index, mode)| (index, mode.pole)).collect()
    }

    /// Sweeps until the poles stay, and again where steady lines move; returns the groups of the last sweep.
    pub(super) fn run(&mut self) -> Vec<Group> {
        let mut fitted = self.sweeps();
        for _ in 0..PLACED {
            if !self.place_steady_lines(&fitted) {
                break;
            }
            fitted = self.sweeps();
        }
        fitted
    }

    /// Sweeps until the poles stay; returns the groups of the last sweep.
    fn sweeps(&mut self) -> Vec<Group> {
        let mut fitted = Vec::new();
        let is_function = matches!(self.data.basis(), Basis::FrequencyResponse { .. });
        // Poles that were fitted before know their neighbours.
        let known =
            (self.modes.iter()).all(|mode| mode.failed.is_some() || mode.amplitudes.is_some());
        let mut sweeps = 0;
        // A sweep in which a start fails adds one: modes that were fitted together with it begin again.
        let mut most = MOST_SWEEPS;
        while sweeps < most {
            let mut groups = groups(&self.alive());
            if sweeps == 0 {
                // Strong modes first: their flanks disturb the weak ones.
                groups.sort_by(|a, b| self.power(b[0]).total_cmp(&self.power(a[0])));
            }
            let before = self.alive().len();
            let held = is_function && !known && sweeps < HELD_SWEEPS && groups.len() > 1;
            let moved = self.sweep(groups, &mut fitted, held);
            most += usize::from(self.alive().len() < before);
            sweeps += 1;
            if sweeps > 1 && moved < STILL {
                break;
            }
        }
        fitted.retain(|group: &Group| {
            let mut members = group.members.iter();
            members.all(|&index| self.modes[index].amplitudes.is_some())
        });
        fitted
    }

    /// Power of all columns within half a line of a mode.
    fn power(&self, index: usize) -> f64 {
        let position = self.modes[index].pole.im;
        let lines = lines_between(self.data, position - 0.5, position + 0.5);
        let columns = self.data.columns().iter();
        columns
            .flat_map(|column| &column.values[lines.clone()])
            .map(Complex64::norm_sqr)
            .sum()
    }

    /// Fits each group once. Returns how far the poles moved, in their standard deviations. Poles of known damping
    /// stay where they are `held`.
    fn sweep(&mut self, groups: Vec<Vec<usize>>, fitted: &mut Vec<Group>, held: bool) -> f64 {
        fitted.clear();
        let mut moved: f64 = 0.0;
        for members in groups {
            let held = held && members.iter().all(|&index| self.modes[index].damping_known);
            let fit = match held {
                true => self.fit_amplitudes(&members),
                false => self.fit_group(&members),
            };
            match fit {
                Ok(fit) if held => {
                    moved = f64::INFINITY;
                    self.take_over(&members, &fit);
                }
                Ok(fit) => {
                    moved = moved.max(self.accept(&members, &fit));
                    fitted.push(Group { members, fit });
                }
                Err(reason) => {
                    moved = f64::INFINITY;
                    if let Some(&last) = members.iter().max() {
                        self.give_up(&members, last, reason);
                    }
                }
            }
        }
        moved
    }

    /// Drops one start; the modes fitted together with it begin again.
    fn give_up(&mut self, members: &[usize], failed: usize, reason: Unfit) {
        for &index in members {
            let mode = &mut self.modes[index];
            mode.pole = mode.start;
            mode.amplitudes = None;
        }
        self.modes[failed].failed = Some(reason);
    }

    /// Takes over poles, amplitudes and noise of a fit.
    fn take_over(&mut self, members: &[usize], fit: &GroupFit) {
        let columns = self.data.columns().len();
        for (place, &index) in members.iter().enumerate() {
            let mode = &mut self.modes[index];
            mode.pole = fit.at.poles[place];
            mode.amplitudes = Some(fit.amplitudes(place, columns));
            mode.noise = fit.noise_by_column(columns);
        }
    }

    /// Takes over the poles of a fit, and drops a start whose pole is no mode near it. Returns how far they moved in
    /// standard deviations.
    fn accept(&mut self, members: &[usize], fit: &GroupFit) -> f64 {
        let deviations = fit.deviations();
        let mut most: f64 = 0.0;
        let mut refused: Option<(usize, Unfit)> = None;
        for (place, &index) in members.iter().enumerate() {
            let change = fit.at.poles[place] - self.modes[index].pole;
            most = most
                .max(change.im.abs() / deviations[place][0])
                .max(change.re.abs() / deviations[place][1]);
        }
        self.take_over(members, fit);
        for (place, &index) in members.iter().enumerate() {
            let mode = &self.modes[index];
            // The latest start of several doubtful poles goes: two poles for one resonance make each
            // other doubtful.
            if let Some(reason) = mode.refusal(self.data, deviations[place])
                && refused.as_ref().is_none_or(|(other, _)| index >= *other)
            {
                refused = Some((index, reason));
            }
        }
        for (place, &index) in members.iter().enumerate() {
            let same = (0..place).find(|&other| fit.is_one_mode(self.data, other, place));
            if let (None, Some(other)) = (&refused, same) {
                refused = Some((index.max(members[other]), Unfit::NotIndependent));
            }
        }
        if let Some((index, reason)) = refused {
            // Two starts within a line are one resonance, of which the later one goes.
            let line = self.data.resolution() / self.data.spacing();
            let start = self.modes[index].start.im;
            let later = members.iter().copied().filter(|&other| {
                other >= index && (self.modes[other].start.im - start).abs() < line
            });
            let last = later.max().unwrap_or(index);
            self.give_up(members, last, reason);
            return f64::INFINITY;
        }
        if most.is_nan() { f64::INFINITY } else { most }
    }

    /// Fits the amplitudes of a group at its present poles.
    fn fit_amplitudes(&self, members: &[usize]) -> Result<GroupFit, Unfit> {
        let band = BandData::new(self, members)?;
        let poles = self.poles(members);
        let mut numbers = (0..=FIRST_TERMS).rev();
        let terms = numbers.find(|&terms| band.has_room(&poles, terms));
        band.search(&poles, terms.unwrap_or(0), &band.scale(), 0)
    }

    /// Fits a group from its present poles.
    fn fit_group(&self, members: &[usize]) -> Result<GroupFit, Unfit> {
        let band = BandData::new(self, members)?;
        let mut poles = self.poles(members);
        let mut modes = members.iter().map(|&index| &self.modes[index]);
        if modes.all(|mode| mode.amplitudes.is_some()) {
            let noise = match self.noise(members, &band.used) {
                Some(noise) => noise,
                None => band.noise_of(&band.fit(&poles, 0, &band.scale())?),
            };
            return band.settled_fit(&poles, &noise);
        }
        let mut numbers = (0..=FIRST_TERMS).rev();
        let terms = numbers.find(|&terms| band.has_room(&poles, terms));
        let terms = terms.unwrap_or(0);
        let scale = band.scale();
        for (place, &index) in members.iter().enumerate() {
            let known = self.modes[index].damping_known;
            band.improve_start(&mut poles, place, known, terms, &scale);
        }
        let fit = band.fit(&poles, terms, &scale)?;
        let noise = band.noise_of(&fit);
        band.fit(&fit.at.poles, terms, &noise)
    }

    /// Noise of these columns in the sweep before; `None` where a column had none.
    pub(super) fn noise(&self, members: &[usize], columns: &[usize]) -> Option<Vec<f64>> {
        let known = &self.modes[*members.first()?].noise;
        let columns = columns.iter();
        columns
            .map(|&column| known.get(column).copied().filter(|&noise| noise > 0.0))
            .collect()
    }

    /// Present poles of these modes (lines).
    pub(super) fn poles(&self, members: &[usize]) -> Vec<Complex64> {
        let members = members.iter();
        members.map(|&index| self.modes[index].pole).collect()
    }
}
