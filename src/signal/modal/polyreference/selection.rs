//! Physical poles out of a stabilisation diagram.
//!
//! The contribution of each pole to the responses is its residue by least squares on the lines around it,
//! with a background in place of lower and upper residuals.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use tapjoint_numerics::stats::median;

use super::{LEAST_ORDER, PolyreferenceSettings, ResponseMatrix, StabilisationPole};
use crate::modal::Subspace;

/// A mode: a pole that returns over the orders and that the responses need.
#[derive(Debug, Clone, PartialEq)]
pub struct PolyreferenceMode {
    /// The pole (1/s), imaginary part positive, decay of an exponential window taken out.
    pub pole: Complex64,
    /// Natural frequency (Hz), |p|/(2 pi).
    pub frequency: f64,
    /// Damping ratio, -Re p/|p|.
    pub damping_ratio: f64,
    /// Participation of each input, of unit length, its largest entry real.
    pub participation: Vec<Complex64>,
    /// Shape factor of each output (unit of the responses times 1/s): residue = shape times
    /// participation.
    pub shape: Vec<Complex64>,
    /// Sum of squares that the mode explains around its peak over the variance of what is left
    /// (dB), mean over the outputs.
    pub above_noise_db: f64,
}

/// Distance within which poles of different orders are one, in half-power half-widths (1 = the
/// pole's own decay). 0.5: two modes a half-power width apart are 2 apart in this measure.
const RADIUS: f64 = 0.5;
/// Least such distance (lines), for poles narrower than a line. 0.1.
const LEAST_RADIUS: f64 = 0.1;
/// Least share of the orders at which the pole is found. 0.3: weak modes come in only where the
/// order suffices for the strong ones; poles of noise scatter over the band.
const LEAST_SHARE: f64 = 0.3;
/// Least ratio of what the mode explains to the noise (dB). 13 dB, a factor of 20: the
/// strongest of some hundred lines of noise alone reaches 8 to 10.
const ABOVE_NOISE_DB: f64 = 13.0;
/// Least level of the mode at its peak over the highest level around it. 1e-4: what poles of
/// rounding and of the model's own error have on noise-free data.
const LEAST_LEVEL: f64 = 1e-4;
/// Least decay over a length of 1/spacing (sigma/spacing). 0.02: a steady tone, mains hum say, is
/// rational too, and its pole scatters about no decay at all, by some 0.005 where it stands
/// 35 dB over the noise; a mode of 0.01 % damping at 50 Hz has 0.03 per second.
const LEAST_DECAY: f64 = 0.02;

/// A pole that returns at several orders.
#[derive(Debug, Clone)]
struct Candidate {
    /// The pole, decay of an exponential window taken out.
    pole: Complex64,
    /// The pole as the responses show it, the window's decay included.
    seen: Complex64,
    participation: Vec<Complex64>,
}

/// Selects the modes of `matrix` from the diagram that [`super::stabilise_poles`] made of it,
/// ascending in frequency.
///
/// The pole with the most neighbours at other orders founds a cluster, nearest pole first and one of
/// each order; then the next among those left. Distance is measured in the complex plane relative
/// to the pole's own decay, so that frequency and damping count alike and two close modes stay two.
/// A cluster at enough orders is a candidate; the candidates that the responses can do without are
/// then dropped, the least needed first.
pub fn select_modes(
    matrix: &ResponseMatrix,
    diagram: &[StabilisationPole],
    settings: &PolyreferenceSettings,
) -> Vec<PolyreferenceMode> {
    let orders = settings.order + 1 - LEAST_ORDER.min(settings.order);
    let least = (LEAST_SHARE * orders as f64).ceil().max(2.0) as usize;
    let mut candidates = cluster_poles(diagram, settings, TAU * matrix.spacing, least);
    candidates.retain(|candidate| -candidate.pole.re >= LEAST_DECAY * matrix.spacing);
    candidates.sort_by(|a, b| a.pole.im.total_cmp(&b.pole.im));
    let needed = needed_poles(matrix, candidates).into_iter();
    let mut modes: Vec<PolyreferenceMode> = needed
        .map(
            |(
                Candidate {
                    pole,
                    participation,
                    ..
                },
                part,
            )| PolyreferenceMode {
                pole,
                frequency: pole.norm() / TAU,
                damping_ratio: -pole.re / pole.norm(),
                participation,
                shape: part.shape,
                above_noise_db: 10.0 * part.above_noise.log10(),
            },
        )
        .collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    modes
}

/// Gathers the poles of different orders that are one. Distances are in units of the radius allowed between two
/// poles; `spacing` is that of the lines (rad/s), `least` the least number of orders.
fn cluster_poles(
    diagram: &[StabilisationPole],
    settings: &PolyreferenceSettings,
    spacing: f64,
    least: usize,
) -> Vec<Candidate> {
    // For every pole those of other orders within the radius, by order, with their distance.
    let mut neighbours: Vec<Vec<(usize, f64)>> = vec![Vec::new(); diagram.len()];
    for (a, near) in diagram.iter().zip(&mut neighbours) {
        for (index, b) in diagram.iter().enumerate() {
            let decay = -0.5 * (a.pole.re + b.pole.re) + settings.added_decay;
            let radius = (RADIUS * decay).max(LEAST_RADIUS * spacing);
            let distance = (a.pole - b.pole).norm() / radius;
            if a.order != b.order && distance <= 1.0 {
                near.push((index, distance));
            }
        }
    }
    let mut free = vec![true; diagram.len()];
    let mut clusters = Vec::new();
    loop {
        let rated = (0..diagram.len())
            .filter(|&index| free[index])
            .map(|index| {
                let (mut count, mut sum, mut order) = (0_usize, 0.0, 0);
                for &(other, distance) in neighbours[index].iter().filter(|(k, _)| free[*k]) {
                    // Two neighbours of the same order count once.
                    if diagram[other].order != order {
                        count += 1;
                        sum += distance;
                        order = diagram[other].order;
                    }
                }
                (index, count, sum)
            });
        let founder = rated.max_by(|a, b| a.1.cmp(&b.1).then(b.2.total_cmp(&a.2)));
        let Some((founder, ..)) = founder.filter(|(_, count, _)| count + 1 >= least) else {
            return clusters;
        };
        // The founder and its nearest free neighbour of every other order.
        let mut near = neighbours[founder].clone();
        near.retain(|(other, _)| free[*other]);
        let orders = near.chunk_by(|a, b| diagram[a.0].order == diagram[b.0].order);
        let nearest = orders.filter_map(|order| order.iter().min_by(|a, b| a.1.total_cmp(&b.1)));
        let mut members: Vec<usize> = nearest.map(|&(index, _)| index).collect();
        members.push(founder);
        members.sort_by_key(|&index| diagram[index].order);
        members.iter().for_each(|&member| free[member] = false);
        let poles = members.iter().map(|&member| diagram[member].pole);
        let (mut re, mut im): (Vec<f64>, Vec<f64>) = poles.map(|pole| (pole.re, pole.im)).unzip();
        // A few stray members do not move the medians.
        let pole = Complex64::new(median(&mut re), median(&mut im));
        // The participation is that of the highest order: vectors of a repeated root are arbitrary within
        // a plane, and only those of one order are independent of each other.
        clusters.push(Candidate {
            pole,
            seen: pole - settings.added_decay,
            participation: diagram[members[members.len() - 1]].participation.clone(),
        });
    }
}

/// Drops the candidate that the responses need least, as long as one is below the limits. Returns
/// those that stay, with their contributions.
fn needed_poles(
    matrix: &ResponseMatrix,
    mut poles: Vec<Candidate>,
) -> Vec<(Candidate, Contribution)> {
    let mut parts: Vec<Option<Contribution>> = (0..poles.len())
        .map(|index| contribution(matrix, &poles, index))
        .collect();
    loop {
        let needs = parts
            .iter()
            .map(|part| part.as_ref().map_or(0.0, Contribution::need));
        let weakest = needs.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((place, _)) = weakest.filter(|(_, need)| *need < 1.0) else {
            break;
        };
        parts.remove(place);
        let removed = poles.remove(place);
        for (index, part) in parts.iter_mut().enumerate() {
            let window = Window::around(matrix, poles[index].seen);
            if window.is_some_and(|window| window.holds(removed.seen)) {
                *part = contribution(matrix, &poles, index);
            }
        }
    }
    let parts = poles.into_iter().zip(parts);
    parts
        .filter_map(|(pole, part)| Some((pole, part?)))
        .collect()
}

/// Half-power widths to either side that take part: beyond, a mode is a background like the others.
const WIDTHS: f64 = 4.0;
/// Lines to either side at least: 25 values stand against a mode, its two neighbours with their
/// corrections, and the background.
const LEAST_REACH: usize = 12;
/// Lines to either side at most; of a wider window every second, third, ... one.
const MOST_REACH: usize = 50;
/// Background terms of each entry: a constant, a slope and a curvature. They stand for the lower and
/// the upper residual, and for everything else that is smooth over the window.
const BACKGROUND: usize = 3;

/// Least part of a column that is its own beside the others', relative to its length.
const INDEPENDENT: f64 = 1e-9;

/// Contribution of one pole to the responses.
#[derive(Debug, Clone)]
struct Contribution {
    /// Shape factor of each output: the residue is factor times participation (unit of the response
    /// times 1/s).
    shape: Vec<Complex64>,
    /// Sum of squares that the pole explains over the noise variance, mean over the outputs.
    above_noise: f64,
    /// Level of the pole at its own peak over the highest level in the window.
    share_of_peak: f64,
}

impl Contribution {
    /// Returns the smaller of the ratios to both limits: above 1 the pole is needed.
    fn need(&self) -> f64 {
        let least = 10f64.powf(0.1 * ABOVE_NOISE_DB);
        (self.above_noise / least).min(self.share_of_peak / LEAST_LEVEL)
    }
}

/// The lines around a pole.
struct Window {
    omegas: Vec<f64>,
    lines: Vec<usize>,
}

impl Window {
    fn around(matrix: &ResponseMatrix, pole: Complex64) -> Option<Self> {
        let spacing = matrix.spacing;
        let last = matrix.points().checked_sub(1)?;
        let centre = (pole.im / TAU - matrix.frequency(0)) / spacing;
        let centre = (centre.round().max(0.0) as usize).min(last);
        let width = -pole.re / PI / spacing;
        let reach = ((WIDTHS * width).ceil() as usize).clamp(LEAST_REACH, last.max(LEAST_REACH));
        let stride = reach.div_ceil(MOST_REACH);
        let range = centre.saturating_sub(reach)..=(centre + reach).min(last);
        let lines: Vec<usize> = range.step_by(stride).collect();
        let omegas = lines.iter().map(|&line| TAU * matrix.frequency(line));
        Some(Window {
            omegas: omegas.collect(),
            lines,
        })
    }

    /// Returns true where a pole lies in the window or as near to it as half its length.
    fn holds(&self, pole: Complex64) -> bool {
        let (Some(first), Some(last)) = (self.omegas.first(), self.omegas.last()) else {
            return false;
        };
        let margin = 0.5 * (last - first);
        (first - margin..=last + margin).contains(&pole.im)
    }

    /// Returns the column of `participation` 1/(j omega - p)^power, input by input.
    fn pole_column(&self, pole: &Candidate, power: i32) -> DVector<Complex64> {
        let count = self.omegas.len();
        DVector::from_fn(count * pole.participation.len(), |row, _| {
            let distance = Complex64::new(0.0, self.omegas[row % count]) - pole.seen;
            pole.participation[row / count] * distance.powi(-power)
        })
    }

    /// Returns the columns of x^degree for one input each, x running from -1 to 1.
    fn background(&self, inputs: usize) -> Vec<DVector<Complex64>> {
        let count = self.omegas.len();
        let columns = (0..inputs).flat_map(|input| (0..BACKGROUND).map(move |k| (input, k)));
        columns
            .map(|(input, degree)| {
                DVector::from_fn(count * inputs, |row, _| {
                    let x = 2.0 * (row % count) as f64 / (count.max(2) - 1) as f64 - 1.0;
                    let own = row / count == input;
                    Complex64::from(if own { x.powi(degree as i32) } else { 0.0 })
                })
            })
            .collect()
    }
}

/// Returns the contribution of pole `index` among `poles`.
///
/// Around the pole each output is fitted by
/// H_oi = sum_r psi_or L_ri/(s - p_r) + delta_or L_ri/(s - p_r)^2 + background.
/// The second term stands for the error of a neighbouring pole, and is left out for the pole itself:
/// what another pole would explain as well, if it were a little elsewhere, is no mode of its own.
fn contribution(
    matrix: &ResponseMatrix,
    poles: &[Candidate],
    index: usize,
) -> Option<Contribution> {
    let own = poles.get(index)?;
    let window = Window::around(matrix, own.seen)?;
    let mut columns = window.background(matrix.inputs);
    for (other, pole) in poles.iter().enumerate() {
        if other != index && window.holds(pole.seen) {
            columns.extend([1, 2].map(|power| window.pole_column(pole, power)));
        }
    }
    let others = Subspace::new(&DMatrix::from_columns(&columns), INDEPENDENT);
    // The pole's own column stands last: it explains only what the others do not.
    let column = window.pole_column(own, 1);
    // The second projection removes the rounding of the first.
    let rest = others.complement(others.complement(column.clone()));
    let square = rest.norm_squared();
    let degrees = column.len().checked_sub(others.rank() + 1)?;
    if degrees == 0 || square.sqrt() <= INDEPENDENT * column.norm() {
        return None;
    }
    let count = window.lines.len();
    let values = DMatrix::from_fn(column.len(), matrix.outputs, |row, output| {
        matrix.entry(output, row / count)[window.lines[row % count]]
    });
    let residuals = others.complement(others.complement(values.clone()));
    let participations = own.participation.iter().map(|factor| factor.norm());
    let strongest = participations.fold(0.0, f64::max);
    let (mut shape, mut above_noise, mut peak, mut own_peak) = (Vec::new(), 0.0, 0.0, 0.0);
    for (values, residual) in values.column_iter().zip(residuals.column_iter()) {
        peak += values.iter().map(Complex64::norm_sqr).fold(0.0, f64::max);
        // Rounding stands for the noise where there is none.
        let rounding = (f64::EPSILON * values.norm()).powi(2) / values.len() as f64;
        // psi = r^H y/|r|^2, explained sum of squares |r^H y|^2/|r|^2.
        let factor = rest.dotc(&residual) / square;
        let explained = factor.norm_sqr() * square;
        let unexplained = (residual.norm_squared() - explained).max(0.0);
        let variance = unexplained / degrees as f64;
        above_noise += explained / variance.max(rounding).max(f64::MIN_POSITIVE);
        own_peak += (factor.norm() * strongest / own.seen.re).powi(2);
        shape.push(factor);
    }
    Some(Contribution {
        shape,
        above_noise: above_noise / matrix.outputs as f64,
        share_of_peak: (own_peak / peak.max(f64::MIN_POSITIVE)).sqrt(),
    })
}
