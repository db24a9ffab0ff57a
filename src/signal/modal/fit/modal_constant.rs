//! Modal constants: the strength of a mode's response, from its amplitudes and the hammer's force.

use nalgebra::{Matrix2, Vector2};
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;

use super::super::from_one;
use super::mode_fit::{ColumnAmplitude, ModeFit};
use crate::recording::ResponseForm;

/// The force of one tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapForce {
    /// Number of the tap in the columns.
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
    /// Standard deviation: from noise and pole, or from the scatter of the taps where that is larger.
    pub std: f64,
    /// Phase of A away from the real axis (degrees, -90 to 90): 0 for a real mode.
    pub phase_deviation: f64,
    /// Number of taps used.
    #[serde(skip)]
    pub taps: usize,
}

/// Residue, or modal constant, of one tap.
#[derive(Debug, Clone, Copy)]
struct TapEstimate {
    value: Complex64,
    variance: f64,
    /// Derivatives to the pole's angular frequency and decay.
    slopes: [Complex64; 2],
    /// Weight in the mean over the taps.
    weight: f64,
}

/// Returns the modal constants of every sensor from free decays and the force of each tap.
///
/// A force f(t) is followed by x(t) = 2 Re(r F(p) e^{p t}) with F(p) = integral f(t) e^{-p t} dt. The
/// amplitude of the decay is therefore a = 2 r F(p), where both count time from its first sample. Over the
/// taps r = sum conj(F_i) a_i/(2 sum |F_i|^2). `kinds` are the sensors' quantities, by their number. Taps
/// without force, and sensors without kind or amplitude, are left out.
pub fn modal_constants(
    mode: &ModeFit,
    forces: &[TapForce],
    kinds: &[Option<ResponseForm>],
) -> Vec<ModalConstant> {
    let mut constants = Vec::new();
    for (sensor, kind) in kinds.iter().enumerate() {
        let Some(kind) = *kind else { continue };
        let mut residues = Vec::new();
        for amplitude in mode.amplitudes.iter().filter(|own| own.sensor == sensor) {
            if let Some(force) = forces.iter().find(|force| force.tap == amplitude.tap) {
                residues.extend(TapEstimate::residue(amplitude, force, mode.pole));
            }
        }
        constants.extend(constant(mode, sensor, kind, residues));
    }
    constants
}

/// Returns the modal constants of every column, where the columns are frequency response functions.
///
/// Their `tap` is the place of the tap. `kinds` are the functions' quantities over force, by sensor.
pub fn modal_constants_of_frf(mode: &ModeFit, kinds: &[ResponseForm]) -> Vec<ModalConstant> {
    let amplitudes = mode.amplitudes.iter();
    amplitudes
        .filter_map(|amplitude| {
            let residue = TapEstimate {
                value: amplitude.value,
                variance: amplitude.std.powi(2),
                slopes: [amplitude.by_omega, amplitude.by_decay],
                weight: 1.0,
            };
            let kind = kinds.get(amplitude.sensor)?;
            constant(mode, amplitude.sensor, *kind, vec![residue])
        })
        .collect()
}

impl TapEstimate {
    /// Residue r = a/(2 F(p)) of one tap; `None` without force at the pole.
    ///
    /// The weight |F|^2 makes the mean over the taps the least-squares residue.
    fn residue(amplitude: &ColumnAmplitude, force: &TapForce, pole: Complex64) -> Option<Self> {
        // F(p) = sum f(n) e^{-p t(n)}/rate, and its derivative to p.
        let (mut laplace, mut slope) = (Complex64::ZERO, Complex64::ZERO);
        for (n, f) in force.samples.iter().enumerate() {
            let time = force.start + n as f64 / force.sample_rate;
            let term = (-pole * time).exp() * (f / force.sample_rate);
            laplace += term;
            slope -= term * time;
        }
        if laplace.norm_sqr() <= 0.0 || !laplace.is_finite() {
            return None;
        }
        let value = amplitude.value / (2.0 * laplace);
        // dr/dp of the force; the pole moves by j with omega and by -1 with the decay.
        let by_force = -value * slope / laplace;
        Some(TapEstimate {
            value,
            variance: amplitude.std.powi(2) / (4.0 * laplace.norm_sqr()),
            slopes: [
                amplitude.by_omega / (2.0 * laplace) + Complex64::i() * by_force,
                amplitude.by_decay / (2.0 * laplace) - by_force,
            ],
            weight: laplace.norm_sqr(),
        })
    }
}

/// Modal constant A = 2 j omega_d r/p^k with k time derivatives, from the residues of the taps.
///
/// Its value is the real part; the imaginary part shows in the phase deviation.
fn constant(
    mode: &ModeFit,
    sensor: usize,
    kind: ResponseForm,
    mut taps: Vec<TapEstimate>,
) -> Option<ModalConstant> {
    let derivatives = kind.derivatives();
    let pole = mode.pole;
    let factor = Complex64::new(0.0, 2.0 * pole.im) / pole.powi(derivatives);
    let order = f64::from(derivatives);
    // d factor/factor with omega: 1/omega_d - k j/p; with the decay: k/p.
    let relative = [1.0 / pole.im - order * Complex64::i() / pole, order / pole];
    for tap in &mut taps {
        tap.value *= factor;
        tap.variance *= factor.norm_sqr();
        for (slope, relative) in tap.slopes.iter_mut().zip(relative) {
            *slope = *slope * factor + tap.value * relative;
        }
    }
    let total: f64 = taps.iter().map(|tap| tap.weight).sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let (mut mean, mut variance, mut slopes) = (Complex64::ZERO, 0.0, Vector2::zeros());
    for tap in &taps {
        let share = tap.weight / total;
        mean += tap.value * share;
        variance += tap.variance * share * share;
        slopes += Vector2::new(tap.slopes[0].re * share, tap.slopes[1].re * share);
    }
    let from_noise = variance + slopes.dot(&(Matrix2::from(mode.pole_covariance) * slopes));
    // The scatter of the taps gives sum w_i^2 (x_i - mean)^2/(1 - sum w_i^2) with weights that add up to one.
    let (mut squares, mut deviations) = (0.0, 0.0);
    for tap in &taps {
        let share = tap.weight / total;
        squares += share.powi(2);
        deviations += (share * (tap.value.re - mean.re)).powi(2);
    }
    let variance = if taps.len() > 1 {
        from_noise.max(deviations / (1.0 - squares))
    } else {
        from_noise
    };
    (mean.is_finite() && variance.is_finite()).then_some(ModalConstant {
        sensor,
        value: mean.re,
        std: variance.sqrt(),
        phase_deviation: (mean.im / mean.re).atan().to_degrees(),
        taps: taps.len(),
    })
}
