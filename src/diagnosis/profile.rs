//! The likelihood over an effect's size where its parabola does not hold: from point to point, all else
//! fitted anew.

use super::evidence::{Branch, covariance, log_integral};
use super::forward::Forward;
use super::hypothesis::Search;
use super::least_squares::{Knowledge, Optimum, factor_of, log_determinant, maximise};

impl Search<'_> {
    /// What the profile of the likelihood over the size adds to the evidence of its parabola. Only
    /// where the size is so badly known that the parabola need not hold.
    pub(super) fn bend(&self, forward: &Forward<'_>, branch: &Branch) -> f64 {
        let index = forward.layout.effects.len() - 1;
        // Beside another effect, or at a place that is itself sought, the parabola has to do.
        if index > 0 || forward.layout.effects[index].place.is_some() {
            return 0.0;
        }
        let at = forward.layout.size(index);
        let size = &forward.layout.effects[index].size;
        let Some(covariance) = covariance(&branch.knowledge, &branch.optimum) else {
            return 0.0;
        };
        let variance = covariance[(at, at)];
        if variance.sqrt() < 0.3 * size.scale {
            return 0.0;
        }
        self.profile(forward, branch, variance).unwrap_or(0.0)
    }

    fn profile(&self, forward: &Forward<'_>, branch: &Branch, variance: f64) -> Option<f64> {
        const NODES: usize = 9;
        let at = forward.layout.size(forward.layout.effects.len() - 1);
        let size = &forward.layout.effects[0].size;
        let here = branch.optimum.parameters[at];
        let reach = 4.0 * variance.sqrt();
        let from = (here - reach)
            .max(size.low)
            .max(size.nothing - 4.0 * size.scale);
        let to = (here + reach)
            .min(size.high)
            .min(size.nothing + 4.0 * size.scale);
        let mut logs = Vec::new();
        let regular =
            |t: f64| 0.5 * ((t - branch.knowledge[at].centre) / branch.knowledge[at].std).powi(2);
        // The regularisation of the size is no part of its likelihood; where it is held it has none.
        let base = marginal_log(branch, &branch.optimum, at)? + regular(here);
        for node in 0..NODES {
            let t = from + (to - from) * node as f64 / (NODES - 1) as f64;
            let mut held = branch.knowledge.clone();
            held[at] = Knowledge::held(t);
            let mut start = branch.optimum.parameters.clone();
            start[at] = t;
            let optimum = maximise(&self.frame.readings, &held, &start, forward);
            let log = optimum.and_then(|optimum| marginal_log(branch, &optimum, at));
            logs.push((t, log.map_or(f64::NEG_INFINITY, |log| log - base)));
        }
        let slope = branch.optimum.gradient[at];
        let parabola = |t: f64| {
            let away = t - here;
            -slope * away - 0.5 * away * away / variance + regular(t) - regular(here)
        };
        let true_one = log_integral(size, (from, to), &|t| interpolate(&logs, t));
        let taken = log_integral(size, (from, to), &parabola);
        (true_one.is_finite() && taken.is_finite()).then_some(true_one - taken)
    }
}

/// -objective - ln det/2 over all free parameters but the size.
fn marginal_log(branch: &Branch, optimum: &Optimum, size: usize) -> Option<f64> {
    let free: Vec<usize> = (0..branch.knowledge.len())
        .filter(|&k| k != size && branch.knowledge[k].low < branch.knowledge[k].high)
        .collect();
    let factor = factor_of(&optimum.curvature, &free)?;
    let log_det = log_determinant(&factor);
    Some(-optimum.objective - 0.5 * log_det)
}

/// Straight lines between points; beyond them nothing.
fn interpolate(points: &[(f64, f64)], t: f64) -> f64 {
    let above = points
        .partition_point(|point| point.0 < t)
        .clamp(1, points.len() - 1);
    let ((t0, y0), (t1, y1)) = (points[above - 1], points[above]);
    if y0 == f64::NEG_INFINITY || y1 == f64::NEG_INFINITY {
        return f64::NEG_INFINITY;
    }
    y0 + (y1 - y0) * (t - t0) / (t1 - t0)
}
