//! Sweeps over the groups of modes until the poles stay.
//!
//! A sweep fits one group after the other, with the amplitudes that the other groups had before.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::group::{BandData, GroupFit, Neighbour, groups, half_band, half_width, lines_between};
use super::{ModalData, PoleStart, Unfit};

/// Most sweeps in which no start fails; two suffice for modes far apart.
const MOST_SWEEPS: usize = 8;
/// A sweep that moves no pole by more than this share of its standard deviation is the last.
const STILL: f64 = 0.02;
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
    fn new(data: &ModalData, start: &PoleStart, added: f64) -> Self {
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

    /// Returns the reason why the fitted pole is no mode near its start.
    ///
    /// `deviations` are the standard deviations of position and decay (lines).
    fn refusal(&self, data: &ModalData, deviations: [f64; 2]) -> Option<Unfit> {
        let spacing = data.spacing();
        let line = data.resolution() / spacing;
        let pole = self.pole;
        let allowed = 3.0 * line + 3.0 * self.start.re.abs().max(pole.re.abs());
        let first = data.frequencies().first().copied().unwrap_or(0.0);
        let last = data.frequencies().last().copied().unwrap_or(0.0);
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

/// All modes and their surroundings.
#[derive(Debug, Clone)]
pub(super) struct Sweeper<'a> {
    pub data: &'a ModalData,
    pub modes: Vec<ModeState>,
    /// Positions of undamped lines (lines).
    steady: Vec<f64>,
    /// Decay that a window has added (1/s).
    added_decay: f64,
    /// Most lines of a band that are taken.
    pub most_lines: usize,
}

impl<'a> Sweeper<'a> {
    /// Begins at `starts`. `steady` are frequencies of undamped lines (Hz).
    pub fn new(
        data: &'a ModalData,
        starts: &[PoleStart],
        steady: &[f64],
        added_decay: f64,
    ) -> Self {
        let modes = starts.iter();
        let modes = modes.map(|start| ModeState::new(data, start, added_decay));
        Sweeper {
            data,
            modes: modes.collect(),
            steady: steady.iter().map(|&f| f / data.spacing()).collect(),
            added_decay,
            most_lines: usize::MAX,
        }
    }

    /// Fits one more start beside modes that were swept; `None` where it fails.
    ///
    /// Returns its group once the poles stay. Modes of other groups do not change.
    pub fn add(&mut self, start: &PoleStart) -> Option<Group> {
        let place = self.modes.len();
        self.modes
            .push(ModeState::new(self.data, start, self.added_decay));
        let mut fitted = Vec::new();
        for sweep in 0..MOST_SWEEPS {
            let groups = groups(&self.alive());
            let mut own = groups.into_iter().find(|group| group.contains(&place))?;
            // Other modes of the group stay as they are where they are too narrow for thinned lines.
            let stride = 2.0 * half_band(self.modes[place].pole) / self.most_lines as f64;
            own.retain(|&index| {
                index == place || stride <= 1.0 || half_width(self.modes[index].pole) >= stride
            });
            let moved = self.sweep(vec![own], &mut fitted);
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

    /// Sweeps until the poles stay; returns the groups of the last sweep.
    pub fn run(&mut self) -> Vec<Group> {
        let mut fitted = Vec::new();
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
            let moved = self.sweep(groups, &mut fitted);
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

    /// Fits each group once. Returns how far the poles moved, in their standard deviations.
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

    /// Takes over the poles of a fit. Returns how far they moved in standard deviations.
    fn accept(&mut self, members: &[usize], fit: &GroupFit) -> f64 {
        let deviations = fit.deviations();
        let columns = self.data.columns().len();
        let mut most: f64 = 0.0;
        let mut refused: Option<(usize, Unfit)> = None;
        for (place, &index) in members.iter().enumerate() {
            let mode = &mut self.modes[index];
            let pole = fit.at.poles[place];
            let change = pole - mode.pole;
            most = most
                .max(change.im.abs() / deviations[place][0])
                .max(change.re.abs() / deviations[place][1]);
            mode.pole = pole;
            mode.amplitudes = Some(fit.amplitudes(place, columns));
            mode.noise = fit.noise_by_column(columns);
            // The latest start of several doubtful poles goes: two poles for one resonance make each
            // other doubtful.
            if let Some(reason) = mode.refusal(self.data, deviations[place])
                && refused.as_ref().is_none_or(|(other, _)| index >= *other)
            {
                refused = Some((index, reason));
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

    /// Fits a group from its present poles.
    fn fit_group(&self, members: &[usize]) -> Result<GroupFit, Unfit> {
        let band = self.band(members)?;
        let mut poles = self.poles(members);
        let mut modes = members.iter().map(|&index| &self.modes[index]);
        if modes.all(|mode| mode.amplitudes.is_some()) {
            // The noise of the sweep before, where all columns had one.
            let first = members.first();
            let known = first.map_or(&[][..], |&index| &self.modes[index].noise);
            let noise: Option<Vec<f64>> = (band.used.iter())
                .map(|&column| known.get(column).copied().filter(|&noise| noise > 0.0))
                .collect();
            let noise = match noise {
                Some(noise) => noise,
                None => band.noise_of(&band.fit(&poles, 0, &band.scale())?),
            };
            return band.settled_fit(&poles, &noise);
        }
        let mut numbers = (0..=FIRST_TERMS).rev();
        let terms = numbers
            .find(|&terms| band.has_room(&poles, terms))
            .unwrap_or(0);
        let scale = band.scale();
        for (place, &index) in members.iter().enumerate() {
            let known = self.modes[index].damping_known;
            band.improve_start(&mut poles, place, known, terms, &scale);
        }
        let fit = band.fit(&poles, terms, &scale)?;
        let noise = band.noise_of(&fit);
        band.fit(&fit.at.poles, terms, &noise)
    }

    /// Present poles of these modes (lines).
    fn poles(&self, members: &[usize]) -> Vec<Complex64> {
        members
            .iter()
            .map(|&index| self.modes[index].pole)
            .collect()
    }

    /// Band of these modes at their present poles.
    pub fn band(&self, members: &[usize]) -> Result<BandData<'a>, Unfit> {
        let mut neighbours = Vec::new();
        for (index, mode) in self.modes.iter().enumerate() {
            if !members.contains(&index) && mode.failed.is_none() {
                neighbours.push(Neighbour {
                    pole: mode.pole,
                    amplitudes: mode.amplitudes.clone(),
                });
            }
        }
        let poles = self.poles(members);
        BandData::new(
            self.data,
            &poles,
            &neighbours,
            &self.steady,
            self.most_lines,
        )
    }
}
