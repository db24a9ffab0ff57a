//! Modal constants: how strongly a mode answers, from its amplitudes and the hammer's force.

use super::super::from_one;
use nalgebra::Vector2;
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;

use super::mode_fit::{ColumnAmplitude, ModeFit};
use crate::recording::ResponseForm;

/// The force of one tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapForce {
    /// Number of the tap, as in the columns.
    pub tap: usize,
    /// Force (N), windowed to the pulse, without its offset.
    pub samples: Vec<f64>,
    /// Sample rate (Hz).
    pub sample_rate: f64,
    /// Time of the first force sample (s), 0 at the first sample of the tap's decay: negative.
    pub start: f64,
}

/// Modal constant of one sensor and tap place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ModalConstant {
    /// Number of the sensor, from 0; in outputs from 1, in the order of the recording's responses.
    #[serde(serialize_with = "from_one")]
    pub sensor: usize,
    /// A (1/kg for a sensor in SI units) in the receptance A/(omega_n^2 - omega^2 + 2 j zeta omega_n
    /// omega): product of the mass-normalised shapes at sensor and tap, with its sign.
    pub value: f64,
    /// Its standard deviation: noise and pole, or the scatter of the taps where that is larger.
    pub std: f64,
    /// Phase of A away from the real axis (degrees, -90 to 90): 0 for a real mode.
    pub phase_deviation: f64,
    /// Taps that took part.
    #[serde(skip)]
    pub taps: usize,
}

/// An estimate with its slopes to the pole's angular frequency and decay.
#[derive(Debug, Clone, Copy)]
struct Uncertain {
    value: Complex64,
    variance: f64,
    slopes: [Complex64; 2],
}

/// Modal constants of every sensor from free decays and the force of each tap.
///
/// A force f(t) leaves behind it x(t) = 2 Re(r F(p) e^{p t}) with F(p) = integral f(t) e^{-p t} dt, so the
/// amplitude of the decay is a = 2 r F(p) when both count time from its first sample, and over the taps
/// r = sum conj(F_i) a_i/(2 sum |F_i|^2). `kinds` are the sensors' quantities, by their number. A tap
/// without force, a sensor without kind or without amplitude is left out.
pub fn modal_constants(
    mode: &ModeFit,
    forces: &[TapForce],
    kinds: &[Option<ResponseForm>],
) -> Vec<ModalConstant> {
    (0..kinds.len())
        .filter_map(|sensor| {
            let kind = kinds[sensor]?;
            let seen: Vec<(&ColumnAmplitude, Complex64, Complex64)> = mode
                .amplitudes
                .iter()
                .filter(|amplitude| amplitude.sensor == sensor)
                .filter_map(|amplitude| {
                    let force = forces.iter().find(|force| force.tap == amplitude.tap)?;
                    let (value, slope) = laplace(force, mode.pole);
                    (value.norm_sqr() > 0.0 && value.is_finite())
                        .then_some((amplitude, value, slope))
                })
                .collect();
            let residues: Vec<(Uncertain, f64)> = seen.iter().map(residue_of_tap).collect();
            constant(mode, sensor, kind, &residues)
        })
        .collect()
}

/// Modal constants of every column where the columns are frequency response functions: those of one
/// sensor for the same `tap` place. `kinds` are the functions' quantities over force, by sensor.
pub fn modal_constants_of_frf(mode: &ModeFit, kinds: &[ResponseForm]) -> Vec<ModalConstant> {
    mode.amplitudes
        .iter()
        .filter_map(|amplitude| {
            let residue = Uncertain {
                value: amplitude.value,
                variance: amplitude.std.powi(2),
                slopes: [amplitude.by_omega, amplitude.by_decay],
            };
            let kind = kinds.get(amplitude.sensor)?;
            constant(mode, amplitude.sensor, *kind, &[(residue, 1.0)])
        })
        .collect()
}

/// F(p) = sum f(n) e^{-p t(n)}/rate, and its derivative to p.
fn laplace(force: &TapForce, pole: Complex64) -> (Complex64, Complex64) {
    let mut sums = (Complex64::ZERO, Complex64::ZERO);
    for (n, f) in force.samples.iter().enumerate() {
        let time = force.start + n as f64 / force.sample_rate;
        let term = (-pole * time).exp() * (f / force.sample_rate);
        sums.0 += term;
        sums.1 -= term * time;
    }
    sums
}

/// r = a/(2 F(p)) of one tap, and its weight |F|^2: with it the mean over the taps is the least-squares
/// residue.
fn residue_of_tap(
    (amplitude, force, force_slope): &(&ColumnAmplitude, Complex64, Complex64),
) -> (Uncertain, f64) {
    let value = amplitude.value / (2.0 * force);
    // dr/dp of the force; the pole moves by j with omega and by -1 with the decay.
    let by_force = -value * force_slope / force;
    let residue = Uncertain {
        value,
        variance: amplitude.std.powi(2) / (4.0 * force.norm_sqr()),
        slopes: [
            amplitude.by_omega / (2.0 * force) + Complex64::i() * by_force,
            amplitude.by_decay / (2.0 * force) - by_force,
        ],
    };
    (residue, force.norm_sqr())
}

/// A = 2 j omega_d r/p^k with k time derivatives; its real part counts, the rest shows in the phase.
fn constant(
    mode: &ModeFit,
    sensor: usize,
    kind: ResponseForm,
    residues: &[(Uncertain, f64)],
) -> Option<ModalConstant> {
    let derivatives = match kind {
        ResponseForm::Receptance => 0,
        ResponseForm::Mobility => 1,
        ResponseForm::Accelerance => 2,
    };
    let pole = mode.pole;
    let factor = Complex64::new(0.0, 2.0 * pole.im) / pole.powi(derivatives);
    let order = f64::from(derivatives);
    // d factor/factor with omega: 1/omega_d - k j/p; with the decay: k/p.
    let relative = [1.0 / pole.im - order * Complex64::i() / pole, order / pole];
    let constants: Vec<(Uncertain, f64)> = residues
        .iter()
        .map(|(residue, weight)| {
            let value = residue.value * factor;
            let slope = |i: usize| residue.slopes[i] * factor + value * relative[i];
            let scaled = Uncertain {
                value,
                variance: residue.variance * factor.norm_sqr(),
                slopes: [slope(0), slope(1)],
            };
            (scaled, *weight)
        })
        .collect();
    let mean = weighted(&constants)?;
    let slopes = Vector2::new(mean.slopes[0].re, mean.slopes[1].re);
    let covariance = nalgebra::Matrix2::from(mode.pole_covariance);
    let from_noise = mean.variance + slopes.dot(&(covariance * slopes));
    let variance = from_noise.max(scatter(&constants, mean.value.re).unwrap_or(0.0));
    let phase = (mean.value.im / mean.value.re).atan().to_degrees();
    (mean.value.is_finite() && variance.is_finite()).then_some(ModalConstant {
        sensor,
        value: mean.value.re,
        std: variance.sqrt(),
        phase_deviation: phase,
        taps: constants.len(),
    })
}

fn weighted(values: &[(Uncertain, f64)]) -> Option<Uncertain> {
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let start = Uncertain {
        value: Complex64::ZERO,
        variance: 0.0,
        slopes: [Complex64::ZERO; 2],
    };
    let mean = values.iter().fold(start, |mean, (one, weight)| {
        let share = weight / total;
        Uncertain {
            value: mean.value + one.value * share,
            variance: mean.variance + one.variance * share * share,
            slopes: [0, 1].map(|i| mean.slopes[i] + one.slopes[i] * share),
        }
    });
    (total > 0.0).then_some(mean)
}

/// Variance of the weighted mean from the scatter of the taps, sum w_i^2 (x_i - mean)^2/(1 - sum w_i^2)
/// with weights that add up to one.
fn scatter(values: &[(Uncertain, f64)], mean: f64) -> Option<f64> {
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let squares: f64 = values.iter().map(|(_, w)| (w / total).powi(2)).sum();
    let sum: f64 = values
        .iter()
        .map(|(one, w)| (w / total * (one.value.re - mean)).powi(2))
        .sum();
    (values.len() > 1).then(|| sum / (1.0 - squares))
}
