//! Sweeps over the groups until the poles stay.

use num_complex::Complex64;

use super::background::settled_fit;
use super::data::ModalData;
use super::local::{GroupFit, Local, Neighbour};
use super::{PoleStart, Unfit, band};

/// Most sweeps in which no start fails; two suffice for modes far apart.
const MOST_SWEEPS: usize = 8;
/// A sweep that moves no pole by more than this share of its standard deviation is the last.
const STILL: f64 = 0.02;
/// Terms of the background while neighbours have not been fitted.
const FIRST_TERMS: usize = 2;
/// State of one mode between the sweeps.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    pub start: Complex64,
    /// Whether the start has a damping of its own.
    pub damping_known: bool,
    pub pole: Complex64,
    pub amplitudes: Option<Vec<Complex64>>,
    /// Noise of every column in its band; 0 where a column was not used.
    noise: Vec<f64>,
    pub failed: Option<Unfit>,
}

/// A group after the last sweep.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub members: Vec<usize>,
    pub fit: GroupFit,
}

/// All modes and what surrounds them.
#[derive(Debug, Clone)]
pub(super) struct Sweeper<'a> {
    pub data: &'a ModalData,
    pub modes: Vec<Mode>,
    /// Positions of undamped lines (lines).
    pub steady: Vec<f64>,
    /// Most lines of a band that are taken.
    pub most_lines: usize,
}

impl<'a> Sweeper<'a> {
    pub fn new(data: &'a ModalData, starts: &[PoleStart], steady: &[f64], added: f64) -> Self {
        let lines = |hertz: f64| hertz / data.spacing();
        let modes = starts
            .iter()
            .map(|start| mode(data, start, added / std::f64::consts::TAU))
            .collect();
        Sweeper {
            data,
            modes,
            steady: steady.iter().map(|&f| lines(f)).collect(),
            most_lines: usize::MAX,
        }
    }

    /// One more start beside modes that were swept: its group once it stays, or nothing where it fails. Modes of
    /// other groups stay as they are.
    pub fn add(&mut self, start: &PoleStart, added: f64) -> Option<Group> {
        let place = self.modes.len();
        self.modes
            .push(mode(self.data, start, added / std::f64::consts::TAU));
        let mut fitted = Vec::new();
        for sweep in 0..MOST_SWEEPS {
            let groups = band::groups(&self.alive());
            let own = groups.into_iter().find(|group| group.contains(&place))?;
            let own = self.resolved(own, place);
            let moved = self.sweep(vec![own], &mut fitted);
            if sweep > 0 && moved < STILL {
                break;
            }
        }
        let settled = self.modes[place].amplitudes.is_some();
        fitted.pop().filter(|_| settled)
    }

    /// Of a group those that lines thinned for the mode at `place` still resolve: the others, far narrower than
    /// it, keep their poles.
    fn resolved(&self, mut group: Vec<usize>, place: usize) -> Vec<usize> {
        let lines = 2.0 * band::half_band(self.modes[place].pole);
        let stride = lines / self.most_lines as f64;
        let width = |index: usize| band::half_width(self.modes[index].pole);
        group.retain(|&index| index == place || stride <= 1.0 || width(index) >= stride);
        group
    }

    fn alive(&self) -> Vec<(usize, Complex64)> {
        self.modes
            .iter()
            .enumerate()
            .filter(|(_, mode)| mode.failed.is_none())
            .map(|(index, mode)| (index, mode.pole))
            .collect()
    }

    /// Sweeps until the poles stay; the groups of the last sweep.
    pub fn run(&mut self) -> Vec<Group> {
        let mut fitted = Vec::new();
        let mut sweeps = 0;
        // A sweep in which a start fails is one more: what was fitted together with it begins again.
        let mut most = MOST_SWEEPS;
        while sweeps < most {
            let mut groups = band::groups(&self.alive());
            if sweeps == 0 {
                self.strongest_first(&mut groups);
            }
            let before = self.alive().len();
            let moved = self.sweep(groups, &mut fitted);
            most += usize::from(self.alive().len() < before);
            sweeps += 1;
            if sweeps > 1 && moved < STILL {
                break;
            }
        }
        let settled = |&index: &usize| self.modes[index].amplitudes.is_some();
        fitted.retain(|group: &Group| group.members.iter().all(settled));
        fitted
    }

    /// One sweep over the groups; how far the poles moved, in their standard deviations.
    fn sweep(&mut self, groups: Vec<Vec<usize>>, fitted: &mut Vec<Group>) -> f64 {
        fitted.clear();
        let mut moved: f64 = 0.0;
        for members in groups {
            match self.fit_group(&members) {
                Ok(fit) => {
                    moved = moved.max(self.accept(&members, &fit));
                    fitted.push(Group { members, fit });
                }
                Err(reason) => {
                    moved = f64::INFINITY;
                    let last = members.iter().copied().max();
                    self.give_up(&members, last.map(|index| (index, reason)));
                }
            }
        }
        moved
    }

    /// One start fails; those fitted together with it begin again without it.
    fn give_up(&mut self, members: &[usize], failure: Option<(usize, Unfit)>) {
        for &index in members {
            let mode = &mut self.modes[index];
            mode.pole = mode.start;
            mode.amplitudes = None;
        }
        if let Some((index, reason)) = failure {
            self.modes[index].failed = Some(reason);
        }
    }

    /// Strong modes first: their flanks disturb the weak ones.
    fn strongest_first(&self, groups: &mut [Vec<usize>]) {
        let height = |group: &Vec<usize>| {
            let index = group.first().copied().unwrap_or(0);
            let position = self.modes[index].pole.im;
            let (first, end) = band::within(self.data, (position - 0.5, position + 0.5));
            let columns = self.data.columns().iter();
            columns
                .flat_map(|column| &column.values[first..end])
                .map(Complex64::norm_sqr)
                .sum::<f64>()
        };
        groups.sort_by(|a, b| height(b).total_cmp(&height(a)));
    }

    /// Takes the poles of a fit over; how far they moved in standard deviations.
    fn accept(&mut self, members: &[usize], fit: &GroupFit) -> f64 {
        let deviations = super::uncertainty::deviations(fit);
        let mut most: f64 = 0.0;
        for (place, &index) in members.iter().enumerate() {
            let mode = &mut self.modes[index];
            let pole = fit.at.poles[place];
            let (of_position, of_decay) = deviations[place];
            let change = pole - mode.pole;
            most = most
                .max(change.im.abs() / of_position)
                .max(change.re.abs() / of_decay);
            mode.pole = pole;
            mode.amplitudes = Some(fit.amplitudes(place, self.data.columns().len()));
            mode.noise = fit.noise_by_column(self.data.columns().len());
        }
        // Of several doubtful poles the one whose start came last goes: two poles for one resonance
        // make each other doubtful.
        let refused = members.iter().enumerate().filter_map(|(place, &index)| {
            let reason = refusal(self.data, &self.modes[index], deviations[place])?;
            Some((index, reason))
        });
        let worst = refused.max_by_key(|(index, _)| *index);
        if worst.is_some() {
            self.give_up(members, worst);
            return f64::INFINITY;
        }
        if most.is_nan() { f64::INFINITY } else { most }
    }

    fn fit_group(&self, members: &[usize]) -> Result<GroupFit, Unfit> {
        let new = |&index: &usize| self.modes[index].amplitudes.is_none();
        let poles: Vec<Complex64> = members
            .iter()
            .map(|&index| self.modes[index].pole)
            .collect();
        let local = self.local(members)?;
        if members.iter().any(new) {
            self.first_fit(&local, members, poles)
        } else {
            let noise = self.noise_before(&local, members);
            let noise = match noise {
                Some(noise) => noise,
                None => local.noise_of(&local.fit(&poles, 0, &local.scale())?),
            };
            settled_fit(&local, &poles, &noise)
        }
    }

    /// Noise of the columns in the sweep before, where all of them had one.
    fn noise_before(&self, local: &Local, members: &[usize]) -> Option<Vec<f64>> {
        let known = &self.modes[*members.first()?].noise;
        local
            .used
            .iter()
            .map(|&column| known.get(column).copied().filter(|&noise| noise > 0.0))
            .collect()
    }

    /// The band of these modes as their present poles have it.
    pub fn local(&self, members: &[usize]) -> Result<Local<'a>, Unfit> {
        let poles: Vec<Complex64> = members
            .iter()
            .map(|&index| self.modes[index].pole)
            .collect();
        let neighbours = self.neighbours(members);
        Local::new(
            self.data,
            (&poles, &neighbours),
            &self.steady,
            self.most_lines,
        )
    }

    fn neighbours(&self, members: &[usize]) -> Vec<Neighbour> {
        self.modes
            .iter()
            .enumerate()
            .filter(|(index, mode)| !members.contains(index) && mode.failed.is_none())
            .map(|(_, mode)| Neighbour {
                pole: mode.pole,
                amplitudes: mode.amplitudes.clone(),
            })
            .collect()
    }

    /// From the starts, after a look about each.
    fn first_fit(
        &self,
        local: &Local,
        members: &[usize],
        mut poles: Vec<Complex64>,
    ) -> Result<GroupFit, Unfit> {
        let terms = (0..=FIRST_TERMS)
            .rev()
            .find(|&terms| local.has_room(&poles, terms))
            .unwrap_or(0);
        let scale = local.scale();
        for (place, &index) in members.iter().enumerate() {
            let known = self.modes[index].damping_known;
            local.look_about(&mut poles, place, (terms, &scale), known);
        }
        let fit = local.fit(&poles, terms, &scale)?;
        let noise = local.noise_of(&fit);
        local.fit(&fit.at.poles, terms, &noise)
    }
}

fn mode(data: &ModalData, start: &PoleStart, added: f64) -> Mode {
    let position = start.frequency / data.spacing();
    let unknown = 0.3 * data.resolution() / data.spacing();
    let decay = start
        .damping_ratio
        .filter(|ratio| *ratio > 0.0)
        .map_or(unknown, |ratio| ratio * position);
    let pole = Complex64::new(-decay - added / data.spacing(), position);
    let within = position > 0.0 && start.frequency < data.highest() && pole.is_finite();
    Mode {
        start: pole,
        damping_known: start.damping_ratio.is_some(),
        pole,
        amplitudes: None,
        noise: Vec::new(),
        failed: (!within).then_some(Unfit::OutsideBand),
    }
}

/// Why a fitted pole is no mode near its start.
fn refusal(data: &ModalData, mode: &Mode, (of_position, of_decay): (f64, f64)) -> Option<Unfit> {
    let lines = |hertz: f64| hertz / data.spacing();
    let line = lines(data.resolution());
    let pole = mode.pole;
    let allowed = 3.0 * line + 3.0 * mode.start.re.abs().max(pole.re.abs());
    let first = data.frequencies().first().copied().unwrap_or(0.0);
    let last = data.frequencies().last().copied().unwrap_or(0.0);
    let away = (pole.im - mode.start.im).abs();
    if pole.im < lines(first) || pole.im > lines(last) || away > allowed {
        return Some(Unfit::LeftStart {
            frequency: pole.im * data.spacing(),
            distance: away * data.spacing(),
        });
    }
    if pole.re >= 0.0 {
        return Some(Unfit::NoDecay);
    }
    let wide = line.max(pole.re.abs());
    let vague = of_position.is_nan() || of_position > wide || of_decay.is_nan() || of_decay > wide;
    vague.then_some(Unfit::Undetermined {
        std: of_position * data.spacing(),
    })
}

impl Local<'_> {
    /// Tries some dampings, some places and some dampings again for one pole, and keeps the best: a start
    /// half a line off lies outside the valley of a resonance narrower than a line.
    fn look_about(
        &self,
        poles: &mut [Complex64],
        place: usize,
        (terms, scale): (usize, &[f64]),
        damping_known: bool,
    ) {
        let factors: &[f64] = if damping_known {
            &[0.5, 1.0, 2.0]
        } else {
            &[0.1, 0.3, 1.0, 3.0, 10.0]
        };
        let line = self.data.resolution() / self.data.spacing();
        let offsets = [-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75].map(|share| share * line);
        let damped = |pole: Complex64| {
            factors
                .iter()
                .map(move |f| Complex64::new(pole.re * f, pole.im))
        };
        for round in 0..3 {
            let pole = poles[place];
            let tries: Vec<Complex64> = if round == 1 {
                offsets
                    .iter()
                    .map(|&o| pole + Complex64::new(0.0, o))
                    .collect()
            } else {
                damped(pole).collect()
            };
            let found = self.best(poles, place, &tries, (terms, scale));
            poles[place] = found.unwrap_or(pole);
        }
    }

    fn best(
        &self,
        poles: &[Complex64],
        place: usize,
        tries: &[Complex64],
        (terms, scale): (usize, &[f64]),
    ) -> Option<Complex64> {
        let sums = self.square_sums(poles, place, tries, (terms, scale));
        tries
            .iter()
            .zip(sums)
            .filter_map(|(&pole, sum)| sum.map(|sum| (pole, sum)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(pole, _)| pole)
    }
}
