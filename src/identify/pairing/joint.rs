//! The joint that suits an assignment best, how probable the frequencies are over all joints, and how well
//! measured shapes suit it.

use super::{MeasuredPeak, MissingCause, MissingMode, PairingSettings, ShapeAt};
use crate::frequency_fit::{FrequencyModel, Parameter, Point, joint_at};
use nalgebra::{DMatrix, DVector};
use statrs::function::gamma::ln_gamma;
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::f64::consts::{LN_10, PI};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{ModeShape, mode_shapes};
use tapjoint_numerics::least_squares::{Linearised, Problem, Settings, minimise};

/// Degrees of freedom of the common scale of the model's discrepancies. 2: one structure in twelve is missed by more
/// than 5 % where 1.5 % are usual.
const FREEDOM: f64 = 2.0;
/// Numbers that are looked for: ln Kx, ln Ky, atanh of the coupling, and ln of the factor that all frequencies have in
/// common.
pub(super) type Place = [f64; 4];
/// Index of the common factor.
const FACTOR: usize = 3;
/// Prior means of a place, and their standard deviations: joints of built structures lie within some decades of the
/// beam's own stiffness, couplings within 0.3. A modulus wrong by a quarter moves all frequencies by 12 %.
const PRIOR: [(f64, f64); 4] = [(3.0 * LN_10, 3.0), (LN_10, 3.0), (0.0, 0.3), (0.0, 0.12)];
/// Common factors of the grid (ln): zero, and one standard deviation to either side. The candidates allow for the
/// distance to factors between these.
const FACTORS: [f64; 3] = [-0.12, 0.0, 0.12];
/// Decades of the grid, Kx and Ky, and its step. A frequency rises at most with the root of both stiffnesses
/// together. The nearest place of the grid is half a step off in both at most, and misses it by up to 10^(0.3/4) - 1
/// = 19 %, where all stiffness is in soft springs. The candidates allow for that, and the search for the joint goes
/// on from there.
const DECADES: [(f64, f64); 2] = [(-1.0, 6.0), (-2.0, 4.5)];
const STEP: f64 = 0.3;
/// Largest step of the search (1).
const LARGEST: f64 = 2.0;
/// Largest coupling (1) that a held Ktr is taken to have.
const STRONGEST: f64 = 0.999;

/// Peaks and the model they are compared with.
pub(super) struct JointSearch<'a> {
    model: &'a FrequencyModel,
    /// The measured peaks, ascending.
    pub peaks: &'a [MeasuredPeak],
    settings: &'a PairingSettings,
    units: StiffnessUnits,
    /// 1/Kz (1) of a coupling that is held; 0 without one.
    cross: f64,
    /// Number of modes looked at.
    highest: usize,
}

/// A joint and how well it suits.
pub(super) struct JointFit {
    pub place: Place,
    /// Negative logarithm of the frequencies' probability density, over all joints.
    pub cost: f64,
}

impl<'a> JointSearch<'a> {
    pub fn new(
        model: &'a FrequencyModel,
        peaks: &'a [MeasuredPeak],
        settings: &'a PairingSettings,
    ) -> Self {
        let units = StiffnessUnits::of(&model.structure().beam);
        let [kt, kr, ktr] = settings.held;
        let rigid = [kt, kr].contains(&Some(f64::INFINITY));
        let coupled = !settings.fit.contains(&Parameter::Coupling) && !rigid;
        JointSearch {
            model,
            peaks,
            settings,
            units,
            cross: ktr.filter(|_| coupled).map_or(0.0, |ktr| units.ktr / ktr),
            highest: peaks.len() + super::MOST_MISSING,
        }
    }

    /// Returns true for a frequency (Hz) inside one of the bands, or anywhere if there are no bands.
    pub fn in_band(&self, frequency: f64) -> bool {
        let mut bands = self.settings.bands.iter();
        bands.len() == 0 || bands.any(|&(low, high)| (low..=high).contains(&frequency))
    }

    fn is_free(&self, index: usize) -> bool {
        match Parameter::JOINT.get(index) {
            Some(parameter) => self.settings.fit.contains(parameter),
            None => self.settings.common_factor,
        }
    }

    /// Returns the place with the coupling that a held Ktr has there: sqrt(Kx Ky)/Kz, and no joint's is 1.
    fn coupled(&self, place: Place) -> Place {
        if self.cross == 0.0 {
            return place;
        }
        let [kx, ky, _, factor] = place;
        let held = self.cross * (0.5 * (kx + ky)).exp();
        [kx, ky, held.clamp(-STRONGEST, STRONGEST).atanh(), factor]
    }

    /// Returns places over all joints; a held stiffness has one.
    pub fn grid(&self) -> Vec<Place> {
        let units = [self.units.kt, self.units.kr];
        let [translation, rotation] = [0, 1].map(|index| {
            let mut values = Vec::new();
            if self.is_free(index) {
                let (low, high) = DECADES[index];
                let steps = ((high - low) / STEP) as u32;
                values.extend((0..=steps).map(|step| (low + STEP * f64::from(step)) * LN_10));
            } else {
                let held = self.settings.held[index].unwrap_or(f64::INFINITY);
                values.push((held / units[index]).ln());
            }
            values
        });
        let factors = match self.settings.common_factor {
            true => &FACTORS[..],
            false => &[0.0],
        };
        let mut places = Vec::with_capacity(translation.len() * rotation.len() * factors.len());
        for &kx in &translation {
            for &ky in &rotation {
                let factors = factors.iter();
                places.extend(factors.map(|&factor| self.coupled([kx, ky, 0.0, factor])));
            }
        }
        places
    }

    /// Returns the coordinates of the model at a place.
    fn point(&self, place: Place) -> Point {
        let mut point = self.model.nominal();
        point[Parameter::Kt as usize] = place[0] + self.units.kt.ln();
        point[Parameter::Kr as usize] = place[1] + self.units.kr.ln();
        point[Parameter::Coupling as usize] = place[2];
        point
    }

    /// Returns the logarithms of the natural frequencies (Hz) of all modes looked at.
    pub fn predict(&self, place: Place) -> Vec<f64> {
        (1..=self.highest)
            .map(|mode| self.response(place, mode).0)
            .collect()
    }

    /// Returns the logarithm of a natural frequency (Hz), with the common factor applied, and its derivatives by the place.
    fn response(&self, place: Place, mode: usize) -> (f64, Place) {
        let guess = PI * (mode as f64 - 0.5);
        let response = self.model.response(&self.point(place), mode, guess);
        let [by_kt, by_kr, by_coupling] =
            Parameter::JOINT.map(|parameter| response.sensitivity[parameter as usize]);
        let mut slopes = [by_kt, by_kr, by_coupling, 1.0];
        let coupling = place[2].tanh();
        for (index, slope) in slopes.iter_mut().enumerate() {
            if !(self.is_free(index) && slope.is_finite()) {
                *slope = 0.0;
            }
            if index < 2 && self.is_free(index) && self.cross != 0.0 && coupling.abs() < STRONGEST {
                // The coupling follows: d atanh(c)/d ln Kx = c/(2 (1 - c^2)), and so for Ky.
                *slope += 0.5 * coupling / (1.0 - coupling * coupling) * by_coupling;
            }
        }
        (response.frequency.ln() + place[FACTOR], slopes)
    }

    /// Returns the joint that suits these pairs of peak and mode best, looked for downhill of `start`.
    ///
    /// Laplace: the probability over all joints is the one at the best times the square root of the inverse
    /// curvature's determinant. The factors 2 pi of prior and curvature cancel.
    pub fn refine(&self, pairs: &[(usize, usize)], start: Place) -> JointFit {
        let assigned = Assigned {
            search: self,
            pairs,
            bounds: [0, 1, 2, FACTOR].map(|index| {
                if self.is_free(index) {
                    [f64::NEG_INFINITY, f64::INFINITY]
                } else {
                    [start[index]; 2]
                }
            }),
        };
        let settings = Settings {
            steps: 40,
            gain: 1e-9,
            ..Settings::default()
        };
        let found = minimise(&assigned, &start, &settings).map(|found| found.state);
        let (place, cost) = found.map_or((start, f64::INFINITY), |at| {
            let determinant = at.curvature.determinant().max(f64::MIN_POSITIVE);
            (at.place, at.cost + 0.5 * determinant.ln())
        });
        JointFit { place, cost }
    }
}

/// An assignment of peaks to modes, whose joint is looked for.
struct Assigned<'a> {
    search: &'a JointSearch<'a>,
    /// Peaks (from 0) with their modes (from 1).
    pairs: &'a [(usize, usize)],
    /// Limits of the place: a held coordinate has no room.
    bounds: [[f64; 2]; 4],
}

/// The assignment's cost at a place, with gradient and Gauss-Newton curvature.
struct AssignedAt {
    place: Place,
    /// Negative logarithm of the probability density.
    cost: f64,
    gradient: DVector<f64>,
    curvature: DMatrix<f64>,
}

impl Problem for Assigned<'_> {
    type State = AssignedAt;

    fn evaluate(&self, place: &[f64], _: Option<&AssignedAt>) -> Option<AssignedAt> {
        let place = *place.first_chunk()?;
        let mut at = AssignedAt {
            place,
            cost: 0.0,
            gradient: DVector::zeros(place.len()),
            curvature: DMatrix::zeros(place.len(), place.len()),
        };
        // The discrepancies d_i are normal with one common scale, of which only the usual size s is known. Their density
        // is the multivariate t: Gamma((v + n)/2)/(Gamma(v/2) (v pi)^(n/2) prod s_i) (1 + sum (d_i/s_i)^2/v)^(-(v + n)/2).
        let mut residuals = Vec::with_capacity(self.pairs.len());
        for &(peak, mode) in self.pairs {
            let peak = &self.search.peaks[peak];
            // Its own uncertainty, and what the model misses.
            let own = peak.std.unwrap_or(0.0) / peak.frequency;
            let scale = self.search.settings.discrepancy.hypot(own);
            let (predicted, slopes) = self.search.response(place, mode);
            residuals.push((
                (predicted - peak.frequency.ln()) / scale,
                slopes.map(|s| s / scale),
            ));
            at.cost += scale.ln() + 0.5 * (FREEDOM * PI).ln();
        }
        let squares: f64 = residuals
            .iter()
            .map(|(residual, _)| residual * residual)
            .sum();
        let freedom = FREEDOM + residuals.len() as f64;
        at.cost += 0.5 * freedom * (squares / FREEDOM).ln_1p();
        at.cost += ln_gamma(0.5 * FREEDOM) - ln_gamma(0.5 * freedom);
        let weight = freedom / (FREEDOM + squares);
        for (residual, slopes) in &residuals {
            for (i, a) in slopes.iter().enumerate() {
                at.gradient[i] += weight * residual * a;
                for (j, b) in slopes.iter().enumerate() {
                    at.curvature[(i, j)] += weight * a * b;
                }
            }
        }
        for (index, (mean, std)) in PRIOR.into_iter().enumerate() {
            if !self.search.is_free(index) {
                at.curvature[(index, index)] = 1.0;
                continue;
            }
            let deviation = (place[index] - mean) / std;
            at.cost += 0.5 * deviation * deviation + std.ln();
            at.gradient[index] += deviation / std;
            at.curvature[(index, index)] += 1.0 / (std * std);
        }
        at.cost.is_finite().then_some(at)
    }

    fn cost(&self, at: &AssignedAt) -> f64 {
        at.cost
    }

    fn linearise(&self, _: &[f64], at: &mut AssignedAt) -> Option<Linearised> {
        Some(Linearised::Normal {
            curvature: at.curvature.clone(),
            gradient: at.gradient.clone(),
        })
    }

    fn bounds(&self) -> &[[f64; 2]] {
        &self.bounds
    }

    fn moved(&self, place: &[f64], step: &DVector<f64>) -> Option<Vec<f64>> {
        let moved = [0, 1, 2, FACTOR].map(|i| place[i] + step[i].clamp(-LARGEST, LARGEST));
        Some(self.search.coupled(moved).to_vec())
    }
}

// Measured shapes against those of a joint, and where a mode cannot be seen.

/// Standard deviation of the angle between a measured shape and its model (rad): positions, axes and
/// calibrations of sensors, and the closed form without masses.
const ANGLE: f64 = 0.25;
/// A share of the shapes is nothing like their model: another direction of motion, a loose sensor.
const UNLIKE: f64 = 0.1;
/// A sign contradicts its model in this share of the cases.
const WRONG_SIGN: f64 = 0.05;
/// A mode is at its node where it moves less than this share of what the modes usually do there.
const AT_NODE: f64 = 0.12;
/// Values that together are no more than this many of their standard deviations have neither sign nor
/// direction.
const CLEAR: f64 = 3.0;

/// Predicted shapes of one joint, where they can be had.
pub(super) struct View {
    shapes: Vec<ModeShape>,
    /// Places of sensors and taps at which any peak was seen.
    places: Vec<(f64, Option<f64>)>,
}

impl View {
    /// Returns the shapes of the fitted joint; none for unequal halves, or where no peak has a shape.
    pub fn new(search: &JointSearch<'_>, fit: &JointFit) -> Self {
        let mut places = Vec::new();
        for at in search.peaks.iter().flat_map(|peak| &peak.shape) {
            if !places.contains(&(at.sensor, at.tap)) {
                places.push((at.sensor, at.tap));
            }
        }
        let structure = search.model.structure();
        let mut shapes = Vec::new();
        // The closed form has equal halves only.
        let known = structure.lap.position.is_none() && structure.lap.right.is_none();
        if known && !places.is_empty() {
            let (beam, joint) = (&structure.beam, joint_at(&search.point(fit.place)));
            let found = mode_shapes(beam, structure.assembly, &joint, search.highest);
            shapes = found.unwrap_or_default();
        }
        View { shapes, places }
    }

    /// Returns the product of a mode's shapes at sensor and tap (1/kg), or the shape at the sensor
    /// (kg^-1/2).
    fn at(shape: &ModeShape, sensor: f64, tap: Option<f64>) -> f64 {
        shape.displacement(sensor) * tap.map_or(1.0, |tap| shape.displacement(tap))
    }

    /// Returns a mode without a peak, and why.
    pub fn missing(&self, search: &JointSearch<'_>, fit: &JointFit, mode: usize) -> MissingMode {
        let frequency = search.predict(fit.place)[mode - 1].exp();
        let own = self.shapes.get(mode - 1);
        let at_node = own.filter(|_| !self.places.is_empty()).is_some_and(|own| {
            self.places.iter().all(|&(sensor, tap)| {
                let all = self.shapes.iter();
                let squares: f64 = all.map(|shape| Self::at(shape, sensor, tap).powi(2)).sum();
                let usual = (squares / self.shapes.len() as f64).sqrt();
                Self::at(own, sensor, tap).abs() < AT_NODE * usual
            })
        });
        let cause = if !search.in_band(frequency) {
            MissingCause::OutsideBand
        } else if at_node {
            MissingCause::AtNode
        } else {
            MissingCause::Unknown
        };
        MissingMode {
            mode,
            frequency,
            cause,
        }
    }

    /// Returns the negative logarithm of the shapes' probability over that of shapes in any direction.
    pub fn cost(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> f64 {
        let mut total = 0.0;
        for polarities in self.polarities(search, pairs) {
            let least = least_cost(&polarities);
            let sum: f64 = polarities.iter().map(|one| (least - one.cost).exp()).sum();
            total += least - sum.ln();
        }
        total
    }

    /// Returns the places (m) of the sensors that are inverted against the others, where the shapes leave no doubt.
    pub fn inverted(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> Vec<f64> {
        let mut places = Vec::new();
        for polarities in self.polarities(search, pairs) {
            let least = least_cost(&polarities);
            let mut near = polarities
                .iter()
                .filter(|one| one.cost < least + BEYOND_DOUBT);
            if let (Some(only), None) = (near.next(), near.next()) {
                places.extend(&only.inverted);
            }
        }
        places
    }

    /// Returns what the shapes of each group say of the polarities of its sensors.
    fn polarities(&self, search: &JointSearch<'_>, pairs: &[(usize, usize)]) -> Vec<Vec<Polarity>> {
        let seen = search.peaks.iter().flat_map(|peak| &peak.shape);
        let groups: BTreeSet<usize> = seen.map(|at| at.group).collect();
        let mut all = Vec::with_capacity(groups.len());
        for group in groups {
            let mut polarities = Polarity::all(search.peaks, group);
            for polarity in &mut polarities {
                polarity.cost += self.group_cost(search, pairs, group, polarity);
            }
            all.push(polarities);
        }
        all
    }

    /// Returns the part of one group, whose sensors have this polarity.
    fn group_cost(
        &self,
        search: &JointSearch<'_>,
        pairs: &[(usize, usize)],
        group: usize,
        polarity: &Polarity,
    ) -> f64 {
        let (mut cost, mut signs) = (0.0, [0usize; 2]);
        for &(peak, mode) in pairs {
            let Some(shape) = self.shapes.get(mode - 1) else {
                continue;
            };
            let seen = search.peaks[peak].shape.iter();
            let seen: Vec<&ShapeAt> = seen.filter(|at| at.group == group).collect();
            let products = Products::new(&seen, shape, polarity);
            cost -= products.likeness();
            // The size that the modes usually show at these places.
            let squares = self.shapes.iter().flat_map(|shape| {
                let sizes = seen.iter().map(|at| Self::at(shape, at.sensor, at.tap));
                sizes.map(|size| size.powi(2))
            });
            let count = (self.shapes.len() * seen.len()).max(1) as f64;
            let usual = (squares.sum::<f64>() / count).sqrt();
            let is_tapped = seen.iter().all(|at| at.tap.is_some());
            if let Some(positive) = products.sign(usual).filter(|_| is_tapped) {
                signs[usize::from(positive)] += 1;
            }
        }
        // Signs agree in all modes or, all sensors mounted against the hammer, in none. One is as likely as the other.
        let (right, wrong) = ((2.0 * (1.0 - WRONG_SIGN)).ln(), (2.0 * WRONG_SIGN).ln());
        let [no, yes] = signs.map(|count| count as f64);
        let (a, b) = (yes * right + no * wrong, no * right + yes * wrong);
        let most = a.max(b);
        cost - (most + (0.5 * ((a - most).exp() + (b - most).exp())).ln())
    }
}

/// Prior probability that a sensor is mounted against the direction of the others, or its channel is inverted.
const INVERTED: f64 = 0.1;
/// A polarity less probable than the best by e to this power is out: one in a thousand.
const BEYOND_DOUBT: f64 = 7.0;
/// Up to so many sensors all of their polarities are tried (32), beyond it those of one inverted sensor at most.
const FEW_SENSORS: usize = 6;

/// Which sensors of a group are inverted against the others.
#[derive(Debug, Clone)]
struct Polarity {
    /// Places of the inverted sensors (m).
    inverted: Vec<f64>,
    /// Negative logarithm of its probability.
    cost: f64,
}

fn least_cost(polarities: &[Polarity]) -> f64 {
    let costs = polarities.iter().map(|one| one.cost);
    costs.fold(f64::INFINITY, f64::min)
}

impl Polarity {
    /// Returns all polarities of a group's sensors with their prior; the sign of all together is another matter.
    fn all(peaks: &[MeasuredPeak], group: usize) -> Vec<Self> {
        let mut places: Vec<f64> = Vec::new();
        let seen = peaks.iter().flat_map(|peak| &peak.shape);
        for at in seen.filter(|at| at.group == group) {
            if !places.contains(&at.sensor) {
                places.push(at.sensor);
            }
        }
        let count = places.len() as u32;
        let is_few = places.len() <= FEW_SENSORS;
        let masks: Vec<u32> = match is_few {
            // Inverting a set is inverting the others: the smaller set stands for both.
            true => (0..1 << count)
                .filter(|mask: &u32| match (2 * mask.count_ones()).cmp(&count) {
                    Ordering::Less => true,
                    Ordering::Equal => mask & 1 == 0,
                    Ordering::Greater => false,
                })
                .collect(),
            false => Vec::new(),
        };
        let sets: Vec<Vec<f64>> = match is_few {
            true => masks
                .iter()
                .map(|mask| {
                    let bits = (0..).zip(&places).filter(|(bit, _)| mask >> bit & 1 == 1);
                    bits.map(|(_, &place)| place).collect()
                })
                .collect(),
            false => std::iter::once(Vec::new())
                .chain(places.iter().map(|&place| vec![place]))
                .collect(),
        };
        let price = ((1.0 - INVERTED) / INVERTED).ln();
        let mut all = Vec::with_capacity(sets.len());
        for inverted in sets {
            let cost = price * inverted.len() as f64;
            all.push(Polarity { inverted, cost });
        }
        let sum: f64 = all.iter().map(|one: &Polarity| (-one.cost).exp()).sum();
        for one in &mut all {
            one.cost += sum.ln();
        }
        all
    }

    fn sign(&self, sensor: f64) -> f64 {
        if self.inverted.contains(&sensor) {
            -1.0
        } else {
            1.0
        }
    }
}

/// Returns true where any group of sensors shows a direction.
pub(super) fn is_clear(shape: &[ShapeAt]) -> bool {
    shape.iter().any(|one| {
        let group = shape.iter().filter(|at| at.group == one.group);
        let (measured, noise) = group.fold((0.0, 0.0), |(measured, noise), at| {
            (measured + at.value.powi(2), noise + at.std.powi(2))
        });
        measured > CLEAR.powi(2) * noise
    })
}

/// A measured shape and that of a model: their product, and the squares of them and of the uncertainties.
struct Products {
    count: usize,
    product: f64,
    measured: f64,
    model: f64,
    noise: f64,
}

impl Products {
    fn new(seen: &[&ShapeAt], shape: &ModeShape, polarity: &Polarity) -> Self {
        let predicted = seen.iter().map(|at| View::at(shape, at.sensor, at.tap));
        let pairs = seen.iter().zip(predicted.clone());
        Products {
            count: seen.len(),
            product: pairs
                .map(|(at, p)| polarity.sign(at.sensor) * at.value * p)
                .sum(),
            measured: seen.iter().map(|at| at.value.powi(2)).sum(),
            model: predicted.map(|p| p * p).sum(),
            noise: seen.iter().map(|at| at.std.powi(2)).sum(),
        }
    }

    /// Returns ln of the density of the angle between the shapes over that of any direction: a normal one of width
    /// s has pi/(s sqrt(2 pi)) of it in a plane, 1/s^2 in space (half a circle, half a sphere); more
    /// dimensions count as three.
    fn likeness(&self) -> f64 {
        let (measured, model) = (self.measured, self.model);
        if self.count < 2 || !(measured > CLEAR.powi(2) * self.noise && model > 0.0) {
            return 0.0;
        }
        let width = ANGLE.hypot((self.noise / measured).sqrt());
        let cosine = self.product.abs() / (measured * model).sqrt();
        let peak = match self.count {
            2 => PI / (width * (2.0 * PI).sqrt()),
            _ => width.powi(-2),
        };
        let normal = peak * (-0.5 * (cosine.min(1.0).acos() / width).powi(2)).exp();
        ((1.0 - UNLIKE) * normal + UNLIKE).ln()
    }

    /// Returns true where measured and predicted signs agree; `None` where either has none.
    fn sign(&self, usual: f64) -> Option<bool> {
        let [measured, model, noise] = [self.measured, self.model, self.noise].map(f64::sqrt);
        // Near a node, or across it, the model's own sign is not certain.
        let clear =
            measured > CLEAR * noise && model > AT_NODE * usual * (self.count as f64).sqrt();
        (clear && self.product.abs() > 0.5 * measured * model).then_some(self.product > 0.0)
    }
}
