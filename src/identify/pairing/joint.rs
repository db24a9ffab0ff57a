//! The joint that suits an assignment best, and how probable the frequencies are over all joints.

use std::f64::consts::{LN_10, PI};

use nalgebra::{Matrix3, Vector3};

use super::{MeasuredPeak, PairingSettings};
use crate::consistent::{FrequencyModel, Parameter, Point};
use tapjoint_beam::joint::StiffnessUnits;
use tapjoint_beam::{Assembly, JointStiffness};

/// Degrees of freedom of the model's discrepancy: tails in which one mode may lie far off.
const FREEDOM: f64 = 4.0;
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
/// Steps of the search, and its largest step (1).
const STEPS: usize = 40;
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
        let parameters = [Parameter::Kt, Parameter::Kr, Parameter::Coupling];
        self.settings.fit.contains(&parameters[index])
    }

    /// The place with the coupling that a held Ktr has there: sqrt(Kx Ky)/Kz, and no joint's is 1.
    fn coupled(&self, [kx, ky, coupling]: [f64; 3]) -> [f64; 3] {
        if self.cross == 0.0 {
            return [kx, ky, coupling];
        }
        let held = self.cross * (0.5 * (kx + ky)).exp();
        [kx, ky, held.clamp(-STRONGEST, STRONGEST).atanh()]
    }

    /// Places (ln Kx, ln Ky, atanh of the coupling) over all joints; a held stiffness has one.
    pub fn grid(&self) -> Vec<[f64; 3]> {
        let axis = |index: usize| -> Vec<f64> {
            let (low, high) = DECADES[index];
            if !self.is_free(index) {
                let held = self.settings.held[index].unwrap_or(f64::INFINITY);
                return vec![(held / [self.units.kt, self.units.kr][index]).ln()];
            }
            let steps = ((high - low) / STEP) as usize;
            let at = |step| (low + STEP * f64::from(step)) * LN_10;
            (0..=steps as u32).map(at).collect()
        };
        let (translation, rotation) = (axis(0), axis(1));
        let rows = translation.iter();
        rows.flat_map(|&kx| rotation.iter().map(move |&ky| [kx, ky, 0.0]))
            .map(|place| self.coupled(place))
            .collect()
    }

    /// Coordinates of the model at a place.
    fn point(&self, place: [f64; 3]) -> Point {
        let mut point = self.model.nominal();
        point[Parameter::Kt as usize] = place[0] + self.units.kt.ln();
        point[Parameter::Kr as usize] = place[1] + self.units.kr.ln();
        point[Parameter::Coupling as usize] = place[2];
        point
    }

    /// Logarithms of the natural frequencies (Hz) of all modes looked at.
    pub fn predict(&self, place: [f64; 3]) -> Vec<f64> {
        (1..=self.highest)
            .map(|mode| self.response(place, mode).0)
            .collect()
    }

    /// Logarithm of a natural frequency (Hz), and its slopes.
    fn response(&self, place: [f64; 3], mode: usize) -> (f64, Vector3<f64>) {
        let guess = PI * (mode as f64 - 0.5);
        let response = self.model.response(&self.point(place), mode, guess);
        let slope = |index: usize| {
            let slope = response.sensitivity[index];
            if self.is_free(index) && slope.is_finite() {
                slope
            } else {
                0.0
            }
        };
        let mut slopes =
            [Parameter::Kt, Parameter::Kr, Parameter::Coupling].map(|p| slope(p as usize));
        let coupling = place[2].tanh();
        if self.cross != 0.0 && coupling.abs() < STRONGEST {
            // The coupling follows: d atanh(c)/d ln Kx = c/(2 (1 - c^2)), and so for Ky.
            let follows = 0.5 * coupling / (1.0 - coupling * coupling);
            let by_coupling = response.sensitivity[Parameter::Coupling as usize];
            for index in [0, 1].into_iter().filter(|&index| self.is_free(index)) {
                slopes[index] += follows * by_coupling;
            }
        }
        (response.frequency.ln(), Vector3::from(slopes))
    }

    /// The joint at a place, non-dimensional.
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

    /// Scale of a peak's relative error: its own uncertainty and what the model misses.
    fn scale(&self, peak: &MeasuredPeak) -> f64 {
        let own = peak.std.unwrap_or(0.0) / peak.frequency;
        self.settings.discrepancy.hypot(own)
    }

    /// Cost of the frequencies and of the place itself, with gradient and (Gauss-Newton) curvature.
    ///
    /// Student's t: -ln p = (nu + 1)/2 ln(1 + r^2/nu) + ln(s/density); its weight is
    /// (nu + 1)/(nu + r^2).
    fn cost(&self, pairs: &[(usize, usize)], place: [f64; 3]) -> (f64, Vector3<f64>, Matrix3<f64>) {
        let mut cost = 0.0;
        let mut gradient = Vector3::zeros();
        let mut curvature = Matrix3::zeros();
        for &(peak, mode) in pairs {
            let peak = &self.peaks[peak];
            let scale = self.scale(peak);
            let (predicted, slopes) = self.response(place, mode);
            let residual = (predicted - peak.frequency.ln()) / scale;
            let slopes = slopes / scale;
            let weight = (FREEDOM + 1.0) / (FREEDOM + residual * residual);
            cost += 0.5 * (FREEDOM + 1.0) * (residual * residual / FREEDOM).ln_1p();
            cost += (scale / DENSITY).ln();
            gradient += slopes * (weight * residual);
            curvature += slopes * slopes.transpose() * weight;
        }
        for (index, (mean, std)) in PRIOR.into_iter().enumerate() {
            if !self.is_free(index) {
                curvature[(index, index)] = 1.0;
                continue;
            }
            let deviation = (place[index] - mean) / std;
            cost += 0.5 * deviation * deviation + std.ln();
            gradient[index] += deviation / std;
            curvature[(index, index)] += 1.0 / (std * std);
        }
        (cost, gradient, curvature)
    }

    /// Follows the cost down from `start` (Levenberg and Marquardt). Laplace: the probability over all
    /// joints is the one at the best times the square root of the inverse curvature's determinant; the
    /// factors 2 pi of prior and curvature cancel.
    pub fn refine(&self, pairs: &[(usize, usize)], start: [f64; 3]) -> JointFit {
        let mut place = start;
        let mut now = self.cost(pairs, place);
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let mut damped = now.2;
            for index in 0..3 {
                damped[(index, index)] *= 1.0 + damping;
            }
            let Some(step) = damped.cholesky().map(|factor| factor.solve(&now.1)) else {
                break;
            };
            let next = [0, 1, 2].map(|i| place[i] - step[i].clamp(-LARGEST, LARGEST));
            let next = self.coupled(next);
            let there = self.cost(pairs, next);
            if there.0 < now.0 {
                let gain = now.0 - there.0;
                (place, now) = (next, there);
                damping = (0.2 * damping).max(1e-9);
                if gain < 1e-6 {
                    break;
                }
            } else {
                damping *= 8.0;
                if damping > 1e9 {
                    break;
                }
            }
        }
        let determinant = now.2.determinant().max(f64::MIN_POSITIVE);
        JointFit {
            place,
            cost: now.0 + 0.5 * determinant.ln(),
        }
    }
}
