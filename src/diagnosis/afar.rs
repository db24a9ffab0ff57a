//! Fits sought from afar: effects so large that the model linearised without them leads nowhere.
//!
//! Far from the optimum exact readings make a valley of every mode. So the search begins with frequencies
//! that count as uncertain as they are unexplained, and goes on with the root of that (graduated
//! non-convexity, Blake & Zisserman 1987, "Visual Reconstruction"). What shapes owe to the joint is known
//! near the nominal model only: here they do not count.
//!
//! How much is tried, here and in [`super::pairs`], is a matter of time. Twice as many places, starts, optima and pairs
//! cost half as much again, and change no answer to the 40 virtual tests of two effects or of what the catalogue does
//! not have among those of `blind-check --cases 190 --seed 104` (measured with the constants doubled).

use super::catalogue::Candidate;
use super::evidence::evaluate;
use super::forward::{Forward, Layout};
use super::frame::{Frame, Row};
use super::hypothesis::{Fit, Search};
use super::knowledge::knowledge;
use super::least_squares::{Knowledge, Model, maximise, objective_at};
use super::noise::Reading;
use super::nominal::COUPLING;
use super::settings::GapSettings;
use tapjoint_beam::effects::EffectId;
use tapjoint_beam::specimen::Mesh;

/// Sizes from which the search begins, over the scale of the effect's prior; of effects that have two signs
/// with either.
const SIZES: [f64; 2] = [0.5, 1.5];
/// Places from which it begins.
const PLACES: usize = 3;
/// Factor by which each stiffness of the joint begins beyond and below what was described or found.
const STIFFER: f64 = 3.0;
/// Starts from which the optimum is sought, those of least misfit: of a first effect, and of a second.
const TRIED: [usize; 2] = [4, 2];
/// Optima of one effect that are followed to the end.
const FOLLOWED: usize = 2;
/// Share of the misfit so far that a rough optimum must beat to be followed: what is less has other reasons.
const PROMISES: f64 = 0.9;
/// Relative difference of the misfit below which two searches ended at one optimum: they stop within less, and
/// different places are seldom worth the same.
const SAME: f64 = 1e-3;
/// Elements of the rough model: seven frequencies to 1e-4, where the readings are widened to more.
const ROUGH: Mesh = Mesh { elements: 24 };

/// The frequencies, each with so many times its uncertainty.
pub(super) struct Rough<'a> {
    frame: Frame,
    settings: &'a GapSettings,
}

/// Where a search of some effects may begin.
#[derive(Debug, Clone)]
pub(super) struct Start {
    effects: Vec<Candidate>,
    parameters: Vec<f64>,
    /// -ln(likelihood x prior) of the rough readings.
    pub(super) objective: f64,
}

impl Start {
    /// The effect beside which the others were sought.
    pub(super) fn first(&self) -> EffectId {
        self.effects[0].effect
    }

    /// Whether another search of the same effects ended at the same optimum.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        (self.objective - other.objective).abs() < SAME * other.objective.abs().max(1.0)
    }
}

/// Root mean square of what a fit leaves of the frequencies (standard deviations), 1 at least.
pub(super) fn unexplained(frame: &Frame, fit: &Fit) -> f64 {
    let predicted = &fit.branch.optimum.model.predicted;
    let all: Vec<f64> = (frame.rows.iter().zip(&frame.readings))
        .zip(predicted)
        .filter(|((row, _), _)| matches!(row, Row::Frequency { .. }))
        .map(|((_, reading), predicted)| (reading.value - predicted) / reading.std)
        .collect();
    tapjoint_numerics::stats::root_mean_square(&all).max(1.0)
}

impl<'a> Rough<'a> {
    pub(super) fn new(frame: &Frame, settings: &'a GapSettings, factor: f64) -> Self {
        let mut rough = frame.clone();
        rough.mesh = ROUGH;
        let rows = frame.rows.iter().zip(&frame.readings);
        (rough.rows, rough.readings) = rows
            .filter(|(row, _)| matches!(row, Row::Frequency { .. }))
            .map(|(row, reading)| {
                let wider = Reading {
                    std: factor * reading.std,
                    freedom: f64::INFINITY,
                    ..*reading
                };
                (*row, wider)
            })
            .unzip();
        Rough {
            frame: rough,
            settings,
        }
    }

    /// Optima of one effect, from sizes and places of its prior beside a softer or stiffer joint; the best
    /// first.
    pub(super) fn alone(&self, candidate: Candidate) -> Vec<Start> {
        let forward = Forward::new(&self.frame, &[candidate]);
        let known = self.known(&forward);
        let centre: Vec<f64> = known.iter().map(|known| known.centre).collect();
        let mut joints = vec![centre.clone()];
        let is_stiffness = |k: &usize| forward.layout.joint[*k] != COUPLING;
        for k in (0..forward.layout.joint.len()).filter(is_stiffness) {
            for away in [STIFFER.ln(), -STIFFER.ln()] {
                let mut joint = centre.clone();
                joint[k] += away;
                joints.push(joint);
            }
        }
        self.optima(&forward, &known, joints, TRIED[0])
    }

    /// Optima of a second effect beside a first one, the best first.
    pub(super) fn beside(&self, first: &Start, candidate: Candidate) -> Vec<Start> {
        let mut effects = first.effects.clone();
        effects.push(candidate);
        let forward = Forward::new(&self.frame, &effects);
        let known = self.known(&forward);
        let at = forward.layout.size(effects.len() - 1);
        let mut start = first.parameters.clone();
        let new = forward.layout.smalls() - at;
        start.splice(at..at, std::iter::repeat_n(0.0, new));
        self.optima(&forward, &known, vec![start], TRIED[1])
    }

    /// The optimum from where another search ended.
    pub(super) fn go_on(&self, start: &Start) -> Option<Start> {
        let forward = Forward::new(&self.frame, &start.effects);
        let known = self.known(&forward);
        let found = maximise(&self.frame.readings, &known, &start.parameters, &forward)?;
        Some(Start {
            effects: start.effects.clone(),
            parameters: found.parameters,
            objective: found.objective,
        })
    }

    /// The objective of a fit to the readings as they are.
    fn misfit(&self, fit: &Fit) -> Option<f64> {
        let forward = Forward::new(&self.frame, &fit.effects);
        let at = &fit.branch.optimum.parameters;
        let (predicted, _) = forward.predict(at)?;
        let readings = &self.frame.readings;
        Some(objective_at(
            readings,
            &self.known(&forward),
            (at, &predicted),
        ))
    }

    fn known(&self, forward: &Forward<'_>) -> Vec<Knowledge> {
        knowledge(&self.frame, &forward.layout, self.settings)
    }

    /// Optima from the starts of least misfit, the last effect at several sizes and places; the best first.
    fn optima(
        &self,
        forward: &Forward<'_>,
        known: &[Knowledge],
        bases: Vec<Vec<f64>>,
        tried: usize,
    ) -> Vec<Start> {
        let readings = &self.frame.readings;
        let misfit = |start: Vec<f64>| {
            let (predicted, _) = forward.predict(&start)?;
            Some((objective_at(readings, known, (&start, &predicted)), start))
        };
        let starts = bases
            .iter()
            .flat_map(|base| with_last(&forward.layout, base));
        let starts = least(starts.filter_map(misfit), tried);
        let optima = starts.iter().filter_map(|(_, start)| {
            let found = maximise(readings, known, start, forward)?;
            Some((found.objective, found.parameters))
        });
        let start = |(objective, parameters)| Start {
            effects: forward.layout.effects.clone(),
            parameters,
            objective,
        };
        least(optima, tried).into_iter().map(start).collect()
    }
}

/// The parameters with sizes and places of the last effect.
fn with_last(layout: &Layout, base: &[f64]) -> Vec<Vec<f64>> {
    let index = layout.effects.len() - 1;
    let (at, size) = (layout.size(index), &layout.effects[index].size);
    let sizes = SIZES.iter().flat_map(|share| [*share, -share]);
    let sizes = sizes
        .map(|share| size.nothing + share * size.scale)
        .filter(|value| (size.low..=size.high).contains(value));
    let places: Vec<Option<f64>> = match layout.effects[index].place {
        None => vec![None],
        Some(range) => {
            let (low, high) = (range.inward(range.low), range.inward(range.high));
            let node = |k: usize| low + (high - low) * (k as f64 + 0.5) / PLACES as f64;
            (0..PLACES).map(|k| Some(node(k))).collect()
        }
    };
    let with = |value: f64, place: Option<f64>| {
        let mut start = base.to_vec();
        start[at] = value;
        if let Some(place) = place {
            start[at + 1] = place;
        }
        start
    };
    sizes
        .flat_map(|value| places.iter().map(move |place| (value, *place)))
        .map(|(value, place)| with(value, place))
        .collect()
}

impl Search<'_> {
    /// The effect from afar, where that promises more than the fit `found` so far.
    pub(super) fn add_from_afar(&self, candidate: Candidate, found: Option<&Fit>) -> Option<Fit> {
        let factor = unexplained(self.frame, self.without);
        let starts = Rough::new(self.frame, self.settings, factor).alone(candidate);
        let finer = Rough::new(self.frame, self.settings, factor.sqrt());
        let known = found
            .and_then(|fit| finer.misfit(fit))
            .unwrap_or(f64::INFINITY);
        let near: Vec<Start> = starts
            .iter()
            .take(FOLLOWED)
            .filter_map(|start| finer.go_on(start))
            .filter(|start| start.objective < PROMISES * known)
            .collect();
        self.settle(&near)
    }

    /// The best fit to the readings as they are, from any of these starts of the same effects.
    pub(super) fn settle(&self, starts: &[Start]) -> Option<Fit> {
        let fits = starts.iter().filter_map(|start| {
            let forward = Forward::new(self.frame, &start.effects);
            let (known, drifts) = (self.known(&forward), &self.settings.drift_stds);
            let branch = evaluate(&forward, &known, &start.parameters, drifts)?;
            let evidence = branch.log_evidence;
            Some(self.fit(&forward, branch, evidence))
        });
        fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
    }
}

/// Those with the least objective, that one first.
fn least(all: impl Iterator<Item = (f64, Vec<f64>)>, count: usize) -> Vec<(f64, Vec<f64>)> {
    let mut all: Vec<(f64, Vec<f64>)> = all.collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.truncate(count);
    all
}
