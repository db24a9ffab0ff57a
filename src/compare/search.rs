//! Evidence of a cause with one size, and where it may sit: sums over sizes and places.
//!
//! A change is nearly proportional to its size. Its ratio to the size is solved at a few sizes and interpolated, so that
//! sums over many sizes need few solutions.

use crate::cause::{Cause, CauseKind};
use crate::likelihood::{Data, log_sum};
use crate::model::{PairModel, Predicted};
use rayon::prelude::*;

/// A point of a posterior.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Point {
    /// Logarithm of its weight.
    pub(crate) log_weight: f64,
    /// Logarithm of the prior density there.
    pub(crate) log_prior: f64,
    /// Logarithm of the density of the data there.
    pub(crate) log_density: f64,
    /// Its size or sizes, and then its place (1, lengths of the beam) where it has one.
    pub(crate) values: Vec<f64>,
}

/// Posterior of a cause.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    /// Logarithm of the evidence.
    pub(crate) log_evidence: f64,
    /// Logarithm of the largest density of the data.
    pub(crate) log_best: f64,
    /// Points, whose weights add up to 1.
    pub(crate) points: Vec<Point>,
    /// Predictions at the most probable point, for each pair.
    pub(crate) best: Vec<Predicted>,
}

/// Sizes at which a change is solved, over the largest one.
const NODES: [f64; 4] = [0.01, 0.15, 0.5, 1.0];

/// Safety of the largest load against buckling (1), and the smallest share of the range to which it is lowered.
const FROM_BUCKLING: f64 = 1.5;
const LEAST_SHARE: f64 = 0.01;

/// Change over size at some sizes of one sign.
struct Branch {
    /// Absolute sizes.
    sizes: Vec<f64>,
    /// Change over size of each mode.
    ratios: Vec<Vec<f64>>,
    /// Uncertainty over size, at the first of them.
    aside: Vec<Vec<f64>>,
}

/// Change by a cause at one place, as a function of its size.
struct Curve {
    negative: Option<Branch>,
    positive: Option<Branch>,
}

impl Branch {
    fn new(pair: &PairModel, cause: &Cause, place: f64, nodes: &[f64]) -> Option<Self> {
        let found = pair.predict_sizes(cause, nodes, place)?;
        let sizes = nodes[..found.len()].to_vec();
        let ratios = found.iter().zip(&sizes);
        Some(Self {
            ratios: ratios
                .map(|(found, size)| over(&found.change, *size))
                .collect(),
            aside: found[0]
                .aside
                .iter()
                .map(|mode| over(mode, sizes[0]))
                .collect(),
            sizes,
        })
    }

    /// Returns the change at a size, by Lagrange's polynomial through the ratios.
    fn at(&self, size: f64) -> Predicted {
        let modes = self.ratios[0].len();
        let mut change = vec![0.0; modes];
        for (i, own) in self.sizes.iter().enumerate() {
            let mut weight = size;
            for (j, other) in self.sizes.iter().enumerate() {
                if i != j {
                    weight *= (size - other) / (own - other);
                }
            }
            for (sum, ratio) in change.iter_mut().zip(&self.ratios[i]) {
                *sum += weight * ratio;
            }
        }
        let aside = self.aside.iter();
        let aside = aside.map(|mode| mode.iter().map(|one| one * size).collect());
        Predicted {
            change,
            aside: aside.collect(),
        }
    }
}

fn over(values: &[f64], size: f64) -> Vec<f64> {
    values.iter().map(|value| value / size).collect()
}

impl Curve {
    fn new(pair: &PairModel, cause: &Cause, place: f64) -> Self {
        let [low, high] = cause.range;
        if low < 0.0 && high < 0.0 {
            // One known size, a little more or less.
            let nodes = [low, 0.5 * (low + high), high];
            return Self {
                negative: Branch::new(pair, cause, place, &nodes),
                positive: None,
            };
        }
        let (mut negative, mut positive) = (None, None);
        // A sensor at an end of the beam moves to one side only.
        if high > 0.0 {
            positive = Branch::new(pair, cause, place, &NODES.map(|share| share * high));
        }
        if low < 0.0 && !pair.is_odd(cause) {
            let mut low = low;
            // Near the load that buckles the beam no polynomial follows the frequencies.
            while cause.kind == CauseKind::AxialLoad
                && low < LEAST_SHARE * cause.range[0]
                && pair.predict(cause, FROM_BUCKLING * low, place).is_none()
            {
                low *= 0.7;
            }
            negative = Branch::new(pair, cause, place, &NODES.map(|share| share * low));
        }
        Self { negative, positive }
    }

    /// Returns the change at a size; `None` where there is no such structure.
    fn at(&self, size: f64, pair: &PairModel, is_odd: bool) -> Option<Predicted> {
        if size == 0.0 {
            return Some(Predicted::nothing(pair));
        }
        if size > 0.0 || !is_odd {
            let branch = if size < 0.0 {
                &self.negative
            } else {
                &self.positive
            };
            let branch = branch.as_ref()?;
            // Not far beyond the sizes for which there is a structure.
            let largest = branch.sizes.iter().map(|one| one.abs()).fold(0.0, f64::max);
            return (size.abs() <= 1.01 * largest).then(|| branch.at(size));
        }
        let mut mirrored = self.positive.as_ref()?.at(-size);
        for value in mirrored
            .change
            .iter_mut()
            .chain(mirrored.aside.iter_mut().flatten())
        {
            *value = -*value;
        }
        Some(mirrored)
    }
}

/// Sum over the sizes of a cause at one place.
struct AtPlace {
    place: f64,
    log_sum: f64,
    /// A point for each size, without the place.
    sizes: Vec<Point>,
}

/// Sizes of either sign in the first look, and their span in decades.
const FIRST_SIZES: usize = 28;
const DECADES: f64 = 3.5;
/// Points on either side of the most probable size in the second look, and how many standard deviations apart.
const SECOND_SIZES: i32 = 20;
const SECOND_STEP: f64 = 0.3;

fn at_place(data: &Data<'_>, cause: &Cause, place: f64) -> AtPlace {
    let curves: Vec<Curve> = data
        .pairs
        .iter()
        .map(|pair| Curve::new(pair, cause, place))
        .collect();
    let log_posterior = |size: f64| {
        let mut predicted = Vec::with_capacity(curves.len());
        for (curve, pair) in curves.iter().zip(data.pairs) {
            match curve.at(size, pair, pair.is_odd(cause)) {
                Some(one) => predicted.push(one),
                None => return f64::NEG_INFINITY,
            }
        }
        data.log_density(&predicted) + cause.log_prior(size)
    };
    let [low, high] = cause.range;
    let mut sizes = Vec::new();
    if high < 0.0 {
        let step = (high - low) / FIRST_SIZES as f64;
        sizes.extend((0..=FIRST_SIZES).map(|k| low + step * k as f64));
    } else {
        for k in 0..FIRST_SIZES {
            let share = 10_f64.powf(-DECADES * k as f64 / (FIRST_SIZES - 1) as f64);
            sizes.extend([low * share, high * share]);
        }
        sizes.push(0.0);
    }
    let mut known: Vec<(f64, f64)> = sizes
        .iter()
        .map(|&size| (size, log_posterior(size)))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    known.dedup_by(|a, b| a.0 == b.0);
    // A second look about the most probable size, as wide as the first look's parabola.
    if let Some((most, std)) = peak(&known) {
        for k in -SECOND_SIZES..=SECOND_SIZES {
            let size = most + SECOND_STEP * std * f64::from(k);
            if size > low && size < high {
                known.push((size, log_posterior(size)));
            }
        }
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        known.dedup_by(|a, b| a.0 == b.0);
    }
    let mut weighted = Vec::with_capacity(known.len());
    for (k, &(size, log)) in known.iter().enumerate() {
        // The trapezoidal rule's share of the range.
        let below = if k > 0 { known[k - 1].0 } else { size };
        let above = known.get(k + 1).map_or(size, |one| one.0);
        weighted.push(Point {
            log_weight: log + (0.5 * (above - below)).ln(),
            log_prior: cause.log_prior(size),
            log_density: log - cause.log_prior(size),
            values: vec![size],
        });
    }
    AtPlace {
        place,
        log_sum: log_sum(weighted.iter().map(|one| one.log_weight)),
        sizes: weighted,
    }
}

/// Returns the most probable size, and its standard deviation by the parabola through it and its neighbours.
fn peak(known: &[(f64, f64)]) -> Option<(f64, f64)> {
    let (index, _) = known
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let index = index.clamp(1, known.len().checked_sub(2)?);
    let [(x0, y0), (x1, y1), (x2, y2)] = [known[index - 1], known[index], known[index + 1]];
    let slopes = [(y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)];
    let curvature = -(slopes[1] - slopes[0]) / (0.5 * (x2 - x0));
    if curvature.is_finite() && curvature > 0.0 {
        let top = 0.5 * (x0 + x1) + slopes[0] / curvature;
        return Some((top.clamp(x0, x2), curvature.powf(-0.5)));
    }
    Some((x1, 0.25 * (x2 - x0)))
}

/// Places of the first look for each half wave of the highest mode, and at least.
const PLACES_PER_WAVE: usize = 5;
const LEAST_PLACES: usize = 31;
/// How often places are halved between two that differ.
const HALVINGS: usize = 9;
/// Logarithm of a weight below which a place is improbable, and difference of two places that are alike.
const IMPROBABLE: f64 = 9.0;
const ALIKE: f64 = 0.7;

/// Returns the posterior of a cause; `None` where no structure has it.
pub(crate) fn posterior(data: &Data<'_>, cause: &Cause) -> Option<Posterior> {
    let mut all;
    if cause.is_placed {
        let highest = data.pairs.iter().flat_map(|pair| pair.modes.last()).max();
        let count = LEAST_PLACES.max(PLACES_PER_WAVE * highest.copied().unwrap_or(1) + 1);
        let places: Vec<f64> = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
        all = places
            .par_iter()
            .map(|place| at_place(data, cause, *place))
            .collect::<Vec<_>>();
        for _ in 0..HALVINGS {
            let most = all
                .iter()
                .map(|one| one.log_sum)
                .fold(f64::NEG_INFINITY, f64::max);
            let mut between = Vec::new();
            for two in all.windows(2) {
                let [one, other] = [two[0].log_sum, two[1].log_sum];
                if one.max(other) > most - IMPROBABLE && (one - other).abs() > ALIKE {
                    between.push(0.5 * (two[0].place + two[1].place));
                }
            }
            if between.is_empty() {
                break;
            }
            all.par_extend(
                between
                    .par_iter()
                    .map(|place| at_place(data, cause, *place)),
            );
            all.sort_by(|a, b| a.place.total_cmp(&b.place));
        }
    } else {
        all = vec![at_place(data, cause, 0.0)];
    }
    let mut points = Vec::new();
    for (k, one) in all.iter().enumerate() {
        let mut log_share = 0.0;
        if cause.is_placed {
            let below = if k > 0 { all[k - 1].place } else { one.place };
            let above = all.get(k + 1).map_or(one.place, |next| next.place);
            log_share = (0.5 * (above - below)).ln();
        }
        for own in &one.sizes {
            let mut point = own.clone();
            point.log_weight += log_share;
            if cause.is_placed {
                point.values.push(one.place);
            }
            points.push(point);
        }
    }
    normalised(points, |values| {
        let place = values.get(1).copied().unwrap_or(0.0);
        let pairs = data.pairs.iter();
        pairs
            .map(|pair| pair.predict(cause, values[0], place))
            .collect()
    })
}

/// Points with less than this share of the sum (logarithm) change no interval.
const NEGLIGIBLE: f64 = -18.0;

/// Returns the posterior of points whose weights do not add up to 1 yet. `predict` says what a point predicts.
pub(crate) fn normalised(
    mut points: Vec<Point>,
    predict: impl Fn(&[f64]) -> Option<Vec<Predicted>>,
) -> Option<Posterior> {
    let log_evidence = log_sum(points.iter().map(|point| point.log_weight));
    let densities = points.iter().map(|point| point.log_density);
    let log_best = densities.fold(f64::NEG_INFINITY, f64::max);
    if !log_evidence.is_finite() {
        return None;
    }
    for point in &mut points {
        point.log_weight -= log_evidence;
    }
    points.retain(|point| point.log_weight > NEGLIGIBLE);
    let log_posterior = |point: &Point| point.log_density + point.log_prior;
    let most = points
        .iter()
        .max_by(|a, b| log_posterior(a).total_cmp(&log_posterior(b)))?;
    let best = predict(&most.values)?;
    Some(Posterior {
        log_evidence,
        log_best,
        points,
        best,
    })
}
