//! Fits one hypothesis: starts, signs, places, and the sum over them.

use super::branches::{keep, peaks};
use super::catalogue::{Candidate, PlaceKind, PlaceRange};
use super::decay_finding::best_law;
use super::evidence::{
    Branch, covariance, evaluate, linear_optimum, log_likelihood, log_mean, log_sum, over_drifts,
};
use super::forward::{Forward, Layout};
use super::frame::Frame;
use super::knowledge::{knowledge, with_drift};
use super::least_squares::{Knowledge, Model, Optimum, optimum_at};
use super::nominal::COUPLING;
use super::settings::GapSettings;

/// A hypothesis with its best fit.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    /// The effects it adds; none of the nominal model and of what is unknown.
    pub(super) effects: Vec<Candidate>,
    /// The best fit.
    pub(super) branch: Branch,
    /// Logarithm of the evidence of all branches together.
    pub(super) log_evidence: f64,
}

/// The nominal model with its joint refitted.
pub(super) fn fit_nominal(frame: &Frame, settings: &GapSettings) -> Option<Fit> {
    let forward = Forward::new(frame, &[]);
    let known = knowledge(frame, &forward.layout, settings);
    let known = with_drift(frame, &forward.layout, &known, settings.drift_stds[0]);
    let mut start: Vec<f64> = known.iter().map(|known| known.centre).collect();
    for (parameter, (direction, sought)) in start.iter_mut().zip(frame.nominal.sought()) {
        if direction == COUPLING {
            *parameter = sought;
        }
    }
    let branch = evaluate(&forward, &known, &start, &settings.drift_stds)?;
    Some(Fit {
        effects: Vec::new(),
        log_evidence: branch.log_evidence,
        branch,
    })
}

/// Nodes of a place at which the true model is fitted.
const CORRECTED: usize = 6;

/// One effect, or a second beside a first one, from the optimum of the model without it.
pub(super) struct Search<'a> {
    pub(super) frame: &'a Frame,
    pub(super) settings: &'a GapSettings,
    /// The fit that lacks the effect.
    pub(super) without: &'a Fit,
}

impl Search<'_> {
    /// Fits the effect beside those of the fit that lacks it.
    pub(super) fn add(&self, candidate: Candidate) -> Option<Fit> {
        let mut effects = self.without.effects.clone();
        effects.push(candidate);
        let forward = Forward::new(self.frame, &effects);
        match candidate.place {
            None => self.without_place(&forward),
            Some(range) => self.with_place(&forward, &range),
        }
    }

    /// The objective of the fit that lacks the effect, with the drift that the search begins with.
    pub(super) fn objective_without(&self) -> Option<f64> {
        let forward = Forward::new(self.frame, &self.without.effects);
        let known = self.known(&forward);
        let at = &self.without.branch.optimum;
        Some(linear_optimum(&self.frame.readings, &known, at)?.objective)
    }

    /// The least objective that the model linearised without the effect promises, over its places.
    pub(super) fn promise(&self, candidate: Candidate) -> Option<f64> {
        let mut effects = self.without.effects.clone();
        effects.push(candidate);
        let forward = Forward::new(self.frame, &effects);
        let known = self.known(&forward);
        let at = forward.layout.size(effects.len() - 1);
        let Some(range) = candidate.place else {
            return Some(self.linear_fit(&forward, &known, None)?.objective);
        };
        let (low, high) = (range.inward(range.low), range.inward(range.high));
        let spread = |node| low + (high - low) * (node as f64 + 0.5) / range.nodes as f64;
        let places = (0..range.nodes).map(spread);
        let nodes = places
            .chain(self.peak_places(range.kind))
            .filter_map(|place| {
                let mut held = known.clone();
                held[at + 1] = Knowledge::held(place);
                Some(self.linear_fit(&forward, &held, Some(place))?.objective)
            });
        nodes.min_by(f64::total_cmp)
    }

    /// The same from where the second effect has its own optimum and the first is next to nothing, if
    /// that leads further: two effects explain no less than each of them.
    pub(super) fn add_from(&self, alone: &Fit) -> Option<Fit> {
        let mut effects = self.without.effects.clone();
        effects.extend_from_slice(&alone.effects);
        let forward = Forward::new(self.frame, &effects);
        let joint = forward.layout.joint.len();
        let first = &self.without.branch.optimum.parameters;
        let mut start = alone.branch.optimum.parameters.clone();
        let own = Layout::new(self.frame, &self.without.effects).smalls() - joint;
        for k in (joint..joint + own).rev() {
            start.insert(joint, first[k]);
        }
        let size = &effects[0].size;
        start[joint] = size.nothing + 0.02 * size.scale;
        let known = self.known(&forward);
        let branch = evaluate(&forward, &known, &start, &self.settings.drift_stds)?;
        let evidence = branch.log_evidence;
        Some(self.fit(&forward, branch, evidence))
    }

    /// What is known of all parameters.
    pub(super) fn known(&self, forward: &Forward<'_>) -> Vec<Knowledge> {
        knowledge(self.frame, &forward.layout, self.settings)
    }

    /// The parameters without the effect, and the effect at a size and a place.
    fn start(&self, forward: &Forward<'_>, size: f64, place: Option<f64>) -> Vec<f64> {
        let at = forward.layout.size(forward.layout.effects.len() - 1);
        let mut start = self.without.branch.optimum.parameters.clone();
        start.insert(at, size);
        if let Some(place) = place {
            start.insert(at + 1, place);
        }
        start
    }

    fn without_place(&self, forward: &Forward<'_>) -> Option<Fit> {
        let known = self.known(forward);
        let mut found: Vec<Branch> = Vec::new();
        for size in self.sizes(forward, &known) {
            let start = self.start(forward, size, None);
            if let Some(branch) = evaluate(forward, &known, &start, &self.settings.drift_stds) {
                keep(
                    &mut found,
                    branch,
                    &[forward.layout.size(forward.layout.effects.len() - 1)],
                );
            }
        }
        let total: Vec<f64> = found.iter().map(|branch| branch.log_evidence).collect();
        let best = found.into_iter().max_by(|a, b| {
            a.optimum
                .objective
                .total_cmp(&b.optimum.objective)
                .reverse()
        })?;
        Some(self.fit(forward, best, log_sum(&total)))
    }

    pub(super) fn fit(&self, forward: &Forward<'_>, branch: Branch, log_evidence: f64) -> Fit {
        let bend = self.bend(forward, &branch);
        let most = log_likelihood(&self.frame.readings, &branch.optimum);
        let fit = Fit {
            effects: forward.layout.effects.clone(),
            branch,
            log_evidence: (log_evidence + bend).min(most),
        };
        self.with_peaks(forward, fit)
    }

    /// Sizes from which the search begins: what the model linearised without the effect asks for, and
    /// the other sign or a size well inside the range.
    fn sizes(&self, forward: &Forward<'_>, known: &[Knowledge]) -> Vec<f64> {
        let index = forward.layout.effects.len() - 1;
        let size = &forward.layout.effects[index].size;
        let asked = self
            .linear_size(forward, known)
            .unwrap_or(size.nothing)
            .clamp(
                (size.nothing - 2.0 * size.scale).max(size.low),
                (size.nothing + 2.0 * size.scale).min(size.high),
            );
        let away = asked - size.nothing;
        let other = (size.nothing - 0.5 * away).clamp(size.low, size.high);
        if away.abs() < 1e-3 * size.scale {
            vec![size.nothing + 0.05 * size.scale]
        } else if (other - size.nothing).abs() < 1e-3 * size.scale {
            vec![asked]
        } else {
            vec![asked, other]
        }
    }

    /// The size by one step of Gauss-Newton from nothing of it.
    fn linear_size(&self, forward: &Forward<'_>, known: &[Knowledge]) -> Option<f64> {
        let mut known = known.to_vec();
        let at = forward.layout.size(forward.layout.effects.len() - 1);
        known[at].low = f64::NEG_INFINITY;
        known[at].high = f64::INFINITY;
        let optimum = self.linear_fit(forward, &known, None)?;
        Some(optimum.parameters[at])
    }

    /// The optimum of the model linearised where there is next to nothing of the effect.
    pub(super) fn linear_fit(
        &self,
        forward: &Forward<'_>,
        known: &[Knowledge],
        place: Option<f64>,
    ) -> Option<Optimum> {
        let size = &forward.layout.effects[forward.layout.effects.len() - 1].size;
        // Slopes of what vanishes at nothing (a place, a frequency) are taken a little inside.
        let start = self.start(forward, size.nothing + 0.05 * size.scale, place);
        let there = forward.linearise(&start, known)?;
        let readings = &self.frame.readings;
        let here = optimum_at(readings, known, start, there);
        linear_optimum(readings, known, &here)
    }

    /// The linearised model at every node of the place's range; then the true one, free, from the best.
    fn with_place(&self, forward: &Forward<'_>, range: &PlaceRange) -> Option<Fit> {
        let at = forward.layout.size(forward.layout.effects.len() - 1);
        let known = self.known(forward);
        let (low, high) = (range.inward(range.low), range.inward(range.high));
        let spacing = (high - low) / range.nodes as f64;
        let mut nodes: Vec<Branch> = Vec::new();
        for node in 0..range.nodes {
            let mut held = known.clone();
            let place = low + spacing * (node as f64 + 0.5);
            held[at + 1] = Knowledge::held(place);
            if let Some(optimum) = self.linear_fit(forward, &held, Some(place)) {
                let drifts = &self.settings.drift_stds;
                nodes.push(over_drifts(
                    self.frame,
                    &forward.layout,
                    &held,
                    optimum,
                    drifts,
                ));
            }
        }
        self.correct(forward, &mut nodes);
        self.refine(forward, (&known, spacing), &nodes)
    }

    /// Puts the true model in the place of the linearised one at the most promising nodes: a fixture near
    /// a mode's frequency promises what it does not hold. The others are worth at most as much as these.
    fn correct(&self, forward: &Forward<'_>, nodes: &mut [Branch]) {
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by(|&a, &b| nodes[b].log_evidence.total_cmp(&nodes[a].log_evidence));
        let (first, others) = order.split_at(CORRECTED.min(nodes.len()));
        let mut least = f64::INFINITY;
        for &node in first {
            let linear = &nodes[node];
            let start = linear.optimum.parameters.clone();
            let drifts = &self.settings.drift_stds;
            match evaluate(forward, &linear.knowledge.clone(), &start, drifts) {
                Some(branch) => nodes[node] = branch,
                None => nodes[node].log_evidence = f64::NEG_INFINITY,
            }
            least = least.min(nodes[node].log_evidence);
        }
        for &node in others {
            nodes[node].log_evidence = nodes[node].log_evidence.min(least);
        }
    }

    /// Frees the place from the best nodes. Where the readings fix it within the nodes' spacing, the
    /// maxima are summed; where they do not, the effect is so small that the linearised nodes hold.
    fn refine(
        &self,
        forward: &Forward<'_>,
        (known, spacing): (&[Knowledge], f64),
        nodes: &[Branch],
    ) -> Option<Fit> {
        let at = forward.layout.size(forward.layout.effects.len() - 1);
        let evidence: Vec<f64> = nodes.iter().map(|branch| branch.log_evidence).collect();
        let mut found: Vec<Branch> = Vec::new();
        for start in peaks(&evidence) {
            let from = &nodes[start].optimum.parameters;
            if let Some(branch) = evaluate(forward, known, from, &self.settings.drift_stds) {
                keep(&mut found, branch, &[at, at + 1]);
            }
        }
        if let Some(from) = self.start_of_decays(forward, nodes)
            && let Some(branch) = evaluate(forward, known, &from, &self.settings.drift_stds)
        {
            keep(&mut found, branch, &[at, at + 1]);
        }
        let deepest = |a: &Branch, b: &Branch| a.optimum.objective.total_cmp(&b.optimum.objective);
        found.sort_by(deepest);
        // A search along a bent valley may stop short of its end: once more from either side of it. Between
        // nodes that are far apart for what the readings resolve a deeper one may lie: once more from these.
        if found
            .first()
            .is_some_and(|one| stands_out(one, at, spacing))
        {
            let mut starts = around(&found[0].optimum.parameters, nodes, (at + 1, spacing));
            for aside in [-0.4 * spacing, 0.4 * spacing] {
                let mut from = found[0].optimum.parameters.clone();
                from[at + 1] += aside;
                starts.push(from);
            }
            for from in starts {
                if let Some(branch) = evaluate(forward, known, &from, &self.settings.drift_stds) {
                    keep(&mut found, branch, &[at, at + 1]);
                }
            }
            found.sort_by(deepest);
        }
        let best = found.first()?.clone();
        let of_maxima: Vec<f64> = found.iter().map(|branch| branch.log_evidence).collect();
        let total = if stands_out(&best, at, spacing) {
            log_sum(&of_maxima)
        } else {
            log_mean(&evidence)
        };
        Some(self.fit(forward, best, total))
    }

    /// The best node with the size and the exponent that the changes along the decays call for, of a
    /// joint whose stiffness depends on the amplitude.
    fn start_of_decays(&self, forward: &Forward<'_>, nodes: &[Branch]) -> Option<Vec<f64>> {
        let index = forward.layout.effects.len() - 1;
        forward.layout.effects[index]
            .place
            .filter(|range| range.kind == PlaceKind::Exponent)?;
        let law = best_law(self.frame, self.without)?.law;
        let best = nodes
            .iter()
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        let mut start = best.optimum.parameters.clone();
        let at = forward.layout.size(index);
        start[at] = law.ratio;
        start[at + 1] = law.exponent;
        Some(start)
    }
}

/// The parameters of the nodes whose place, the parameter `at`, is next to this one or next but one.
fn around(parameters: &[f64], nodes: &[Branch], (at, spacing): (usize, f64)) -> Vec<Vec<f64>> {
    let near = |node: &&Branch| {
        let apart = (node.optimum.parameters[at] - parameters[at]).abs();
        apart > 0.5 * spacing && apart < 2.0 * spacing
    };
    let near = nodes.iter().filter(near);
    near.map(|node| node.optimum.parameters.clone()).collect()
}

/// Whether the readings fix an effect's place within the nodes' spacing, and its size so far from
/// nothing that size and place are Gaussian together.
fn stands_out(branch: &Branch, size: usize, spacing: f64) -> bool {
    let Some(covariance) = covariance(&branch.knowledge, &branch.optimum) else {
        return false;
    };
    let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let away = (branch.optimum.parameters[size] - branch.knowledge[size].centre).abs();
    std(size + 1) < 0.7 * spacing && away > 4.0 * std(size)
}
