//! The joint that suits an assignment best, and how probable the frequencies are over all joints.

use std::f64::consts::{LN_10, PI};

use nalgebra::{DMatrix, DVector};

use super::{MeasuredPeak, PairingSettings};
use crate::frequency_fit::{FrequencyModel, Parameter, Point};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, JointStiffness};
use tapjoint_numerics::least_squares::{Linearised, Loss, Problem, Settings, minimise};

/// The model's discrepancy has tails in which one mode may lie far off.
const LOSS: Loss = Loss::StudentT(4.0);
/// Density of Student's t with that many at its middle: 3/8.
const DENSITY: f64 = 0.375;
/// Prior means of ln Kx, ln Ky and atanh of the coupling, and their standard deviations: joints of
/// built structures lie within some decades of the beam's own stiffness, couplings within 0.3.
const PRIOR: [(f64, f64); 3] = [(3.0 * LN_10, 3.0), (LN_10, 3.0), (0.0, 0.3)];
/// Decades of the grid, Kx and Ky, and its step. A frequency rises at most with the root of both
/// stiffnesses together, so that the nearest place of the grid, half a step off in both, misses it by
/// 10^(0.3/4) - 1 = 19 % at most, where all stiffness is in soft springs. The candidates allow for that,
/// and the search for the joint goes on from there.
const DECADES: [(f64, f64); 2] = [(-1.0, 6.0), (-2.0, 4.5)];
const STEP: f64 = 0.3;
/// Largest step of the search (1).
const LARGEST: f64 = 2.0;
/// Largest coupling (1) that a held Ktr is taken to have.
const STRONGEST: f64 = 0.999;

/// Peaks and the model they are compared with.
pub(super) struct JointSearch<'a> {
    model: &'a FrequencyModel,
    pub(super) peaks: &'a [MeasuredPeak],
    settings: &'a PairingSettings,
    units: StiffnessUnits,
    /// 1/Kz (1) of a coupling that is held; 0 without one.
    cross: f64,
    highest: usize,
}

/// A joint and how well it suits.
pub(super) struct JointFit {
    /// ln Kx, ln Ky, atanh of the coupling.
    pub place: [f64; 3],
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

    pub fn model(&self) -> &FrequencyModel {
        self.model
    }

    pub fn log_frequencies(&self) -> Vec<f64> {
        self.peaks.iter().map(|peak| peak.frequency.ln()).collect()
    }

    pub fn in_band(&self, frequency: f64) -> bool {
        let bands = &self.settings.bands;
        bands.is_empty()
            || bands
                .iter()
                .any(|&(low, high)| (low..=high).contains(&frequency))
    }

    fn is_free(&self, index: usize) -> bool {
        self.settings.fit.contains(&Parameter::JOINT[index])
    }

    /// Returns the place with the coupling that a held Ktr has there: sqrt(Kx Ky)/Kz, and no joint's is 1.
    fn coupled(&self, place: [f64; 3]) -> [f64; 3] {
        if self.cross == 0.0 {
            return place;
        }
        let [kx, ky, _] = place;
        let held = self.cross * (0.5 * (kx + ky)).exp();
        [kx, ky, held.clamp(-STRONGEST, STRONGEST).atanh()]
    }

    /// Returns places (ln Kx, ln Ky, atanh of the coupling) over all joints; a held stiffness has one.
    pub fn grid(&self) -> Vec<[f64; 3]> {
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
        let mut places = Vec::with_capacity(translation.len() * rotation.len());
        for &kx in &translation {
            places.extend(rotation.iter().map(|&ky| self.coupled([kx, ky, 0.0])));
        }
        places
    }

    /// Returns the coordinates of the model at a place.
    fn point(&self, place: [f64; 3]) -> Point {
        let mut point = self.model.nominal();
        point[Parameter::Kt as usize] = place[0] + self.units.kt.ln();
        point[Parameter::Kr as usize] = place[1] + self.units.kr.ln();
        point[Parameter::Coupling as usize] = place[2];
        point
    }

    /// Returns the logarithms of the natural frequencies (Hz) of all modes looked at.
    pub fn predict(&self, place: [f64; 3]) -> Vec<f64> {
        (1..=self.highest)
            .map(|mode| self.response(place, mode).0)
            .collect()
    }

    /// Returns the logarithm of a natural frequency (Hz), and its slopes along the place.
    fn response(&self, place: [f64; 3], mode: usize) -> (f64, [f64; 3]) {
        let guess = PI * (mode as f64 - 0.5);
        let response = self.model.response(&self.point(place), mode, guess);
        let mut slopes = Parameter::JOINT.map(|parameter| response.sensitivity[parameter as usize]);
        let by_coupling = slopes[2];
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
        (response.frequency.ln(), slopes)
    }

    /// Returns the joint at a place, non-dimensional.
    pub fn joint(&self, place: [f64; 3]) -> JointStiffness {
        let (kx, ky) = (place[0].exp(), place[1].exp());
        JointStiffness {
            kx,
            ky,
            // coupling = sqrt(Kx Ky)/Kz.
            cross_compliance: match self.model.structure().assembly {
                Assembly::Cantilever => place[2].tanh() / (kx * ky).sqrt(),
                Assembly::Lap | Assembly::Free => 0.0,
            },
        }
    }

    /// Returns the scale of a peak's relative error: its own uncertainty and what the model misses.
    fn scale(&self, peak: &MeasuredPeak) -> f64 {
        let own = peak.std.unwrap_or(0.0) / peak.frequency;
        self.settings.discrepancy.hypot(own)
    }

    /// Returns the joint that suits these pairs of peak and mode best, looked for downhill of `start`.
    ///
    /// Laplace: the probability over all joints is the one at the best times the square root of the inverse
    /// curvature's determinant. The factors 2 pi of prior and curvature cancel.
    pub fn refine(&self, pairs: &[(usize, usize)], start: [f64; 3]) -> JointFit {
        let assigned = Assigned {
            search: self,
            pairs,
            bounds: [0, 1, 2].map(|index| {
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
        match minimise(&assigned, &start, &settings) {
            None => JointFit {
                place: start,
                cost: f64::INFINITY,
            },
            Some(found) => JointFit {
                place: found.state.place,
                cost: found.state.cost
                    + 0.5
                        * found
                            .state
                            .curvature
                            .determinant()
                            .max(f64::MIN_POSITIVE)
                            .ln(),
            },
        }
    }
}

/// An assignment of peaks to modes, whose joint is looked for.
struct Assigned<'a> {
    search: &'a JointSearch<'a>,
    /// Peaks (from 0) with their modes (from 1).
    pairs: &'a [(usize, usize)],
    /// Limits of the place: a held coordinate has no room.
    bounds: [[f64; 2]; 3],
}

/// The assignment's cost at a place, with gradient and Gauss-Newton curvature.
struct AssignedAt {
    place: [f64; 3],
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
            gradient: DVector::zeros(3),
            curvature: DMatrix::zeros(3, 3),
        };
        for &(peak, mode) in self.pairs {
            let peak = &self.search.peaks[peak];
            let scale = self.search.scale(peak);
            let (predicted, slopes) = self.search.response(place, mode);
            let residual = (predicted - peak.frequency.ln()) / scale;
            let weight = LOSS.weight(residual);
            at.cost += 0.5 * LOSS.of(residual) + (scale / DENSITY).ln();
            for (i, a) in slopes.iter().enumerate() {
                at.gradient[i] += weight * residual * a / scale;
                for (j, b) in slopes.iter().enumerate() {
                    at.curvature[(i, j)] += weight * (a / scale) * (b / scale);
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
        let moved = [0, 1, 2].map(|i| place[i] + step[i].clamp(-LARGEST, LARGEST));
        Some(self.search.coupled(moved).to_vec())
    }
}
