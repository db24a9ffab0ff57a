//! The joint that suits an assignment best, and how probable the frequencies are over all joints.

use super::{MeasuredPeak, PairingSettings};
use crate::frequency_fit::{FrequencyModel, Parameter, Point, joint_at};
use nalgebra::{DMatrix, DVector};
use statrs::function::gamma::ln_gamma;
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

    /// Returns the shapes of all modes looked at; none for unequal halves, of which there is no closed form.
    pub fn shapes(&self, place: Place) -> Vec<ModeShape> {
        let structure = self.model.structure();
        if !structure.has_equal_halves() {
            return Vec::new();
        }
        let (beam, joint) = (&structure.beam, joint_at(&self.point(place)));
        mode_shapes(beam, structure.assembly, &joint, self.highest).unwrap_or_default()
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
