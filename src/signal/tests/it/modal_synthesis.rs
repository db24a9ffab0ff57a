//! Curves of given poles over functions with a known answer.

use std::f64::consts::TAU;

use num_complex::Complex64;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_signal::modal::synthesis::{Synthesis, SynthesisLines};
use tapjoint_signal::recording::ResponseForm;

/// Pole of a natural frequency (Hz) and a damping ratio.
fn pole(frequency: f64, ratio: f64) -> Complex64 {
    let omega = TAU * frequency;
    Complex64::new(-ratio * omega, omega * (1.0 - ratio * ratio).sqrt())
}

/// Lines from 20 to 400 Hz.
fn lines() -> Vec<f64> {
    (40..=800).map(|line| 0.5 * f64::from(line)).collect()
}

/// Function of modes with these residues, s = j omega + `decay`.
fn function(modes: &[(Complex64, Complex64)], form: ResponseForm, decay: f64) -> Vec<Complex64> {
    let value = |frequency: &f64| {
        let s = Complex64::new(decay, TAU * frequency);
        let sum: Complex64 = (modes.iter())
            .map(|(p, r)| r / (s - p) + r.conj() / (s - p.conj()))
            .sum();
        s.powi(form.derivatives()) * sum
    };
    lines().iter().map(value).collect()
}

/// Fits one function.
fn fit(
    poles: &[Complex64],
    added_decay: f64,
    values: &[Complex64],
    form: Option<ResponseForm>,
) -> Synthesis {
    let frequencies = lines();
    let wanted = SynthesisLines {
        frequencies: &frequencies,
        poles,
        added_decay,
    };
    let found = wanted.synthesise(&[values], &[form]).remove(0);
    found.expect("a curve")
}

/// Residue of a real mode with this modal constant: A/(2 j omega).
fn residue(pole: Complex64, constant: f64) -> Complex64 {
    Complex64::new(0.0, -constant / (2.0 * pole.im))
}

#[test]
fn limit_a_sum_of_two_modes_is_reproduced() {
    let poles = [pole(80.0, 0.004), pole(250.0, 0.01)];
    let modes = [
        (poles[0], residue(poles[0], 1.3)),
        (poles[1], Complex64::new(2e-5, 4e-4)),
    ];
    for form in ResponseForm::ALL {
        for decay in [0.0, 3.0] {
            let values = function(&modes, form, decay);
            let found = fit(&poles, decay, &values, Some(form));
            assert!(found.left < 1e-20, "{form:?}: {}", found.left);
            for ((_, truth), residue) in modes.iter().zip(&found.residues) {
                let off = (residue - truth).norm() / truth.norm();
                assert!(off < 1e-9, "{form:?}, decay {decay}: {off}");
            }
            // Nothing is left for modes outside the lines.
            let largest = modes[0].1.norm();
            assert!(found.upper.norm() < 1e-10 * largest, "{}", found.upper);
        }
    }
}

#[test]
fn limit_an_unknown_form_is_that_which_fits() {
    let own = pole(120.0, 0.005);
    // A rigid body of 1 kg, and a strong mode at four times the highest line.
    let rigid = Complex64::new(-1e-9, 1e-3);
    let high = pole(1500.0, 0.01);
    let modes = [
        (own, residue(own, 1.0)),
        (rigid, residue(rigid, 1.0)),
        (high, residue(high, 20.0)),
    ];
    for form in ResponseForm::ALL {
        let values = function(&modes, form, 0.0);
        let found = fit(&[own], 0.0, &values, None);
        assert_eq!(found.form, form);
        assert!(found.left < 1e-3, "{form:?}: {}", found.left);
    }
}

#[test]
fn limit_modes_outside_the_lines_are_taken_up_by_their_terms() {
    let own = pole(120.0, 0.005);
    // A rigid body of 2 kg, and a mode at ten times the highest line.
    let rigid = Complex64::new(-1e-9, 1e-3);
    let high = pole(4000.0, 0.01);
    let modes = [
        (own, residue(own, 1.0)),
        (rigid, residue(rigid, 0.5)),
        (high, residue(high, 1.0)),
    ];
    let values = function(&modes, ResponseForm::Accelerance, 0.0);
    let found = fit(&[own], 0.0, &values, Some(ResponseForm::Accelerance));
    assert!(found.left < 1e-8, "{}", found.left);
    // L = 1/m, U = A/omega^2.
    let (lower, upper) = (found.lower, found.upper);
    assert!((lower - 0.5).norm() < 1e-3, "{lower}");
    let flexibility = 1.0 / (TAU * 4000.0_f64).powi(2);
    assert!((upper / flexibility - 1.0).norm() < 0.03, "{upper}");
}

#[test]
fn limit_a_mode_that_is_not_listed_is_left() {
    let poles = [pole(80.0, 0.01), pole(200.0, 0.01), pole(300.0, 0.01)];
    let modes = poles.map(|pole| (pole, residue(pole, 1.0)));
    let values = function(&modes, ResponseForm::Accelerance, 0.0);
    let form = Some(ResponseForm::Accelerance);
    let found = fit(&[poles[0], poles[2]], 0.0, &values, form);
    let alone = function(&modes[1..2], ResponseForm::Accelerance, 0.0);
    let power = |values: &[Complex64]| values.iter().map(Complex64::norm_sqr).sum::<f64>();
    let share = power(&alone) / power(&values);
    assert!(
        (0.9 * share..1.1 * share).contains(&found.left),
        "{} of {share}",
        found.left
    );
}

#[test]
fn recover_what_is_left_is_the_noise() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let poles = [pole(60.0, 0.02), pole(150.0, 0.02), pole(310.0, 0.02)];
    let modes = poles.map(|pole| (pole, residue(pole, 1.0)));
    let clean = function(&modes, ResponseForm::Accelerance, 0.0);
    let clean_power: f64 = clean.iter().map(Complex64::norm_sqr).sum();
    let each = (0.01 * clean_power / clean.len() as f64 / 2.0).sqrt();
    let noisy: Vec<Complex64> = (clean.iter())
        .map(|value| {
            let [re, im]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(&mut random));
            value + Complex64::new(re, im) * each
        })
        .collect();
    let found = fit(&poles, 0.0, &noisy, Some(ResponseForm::Accelerance));
    // 1 % of noise over 761 lines: its own scatter is 4 % of that, and ten unknowns take 1 %.
    assert!((0.0088..0.0111).contains(&found.left), "{}", found.left);
}

#[test]
fn limit_a_pole_twice_is_one() {
    let own = pole(120.0, 0.005);
    let values = function(&[(own, residue(own, 1.0))], ResponseForm::Mobility, 0.0);
    let found = fit(&[own, own], 0.0, &values, Some(ResponseForm::Mobility));
    assert!(found.left < 1e-18, "{}", found.left);
    let sum = found.residues[0] + found.residues[1];
    assert!((sum / residue(own, 1.0) - 1.0).norm() < 1e-6);
}

#[test]
fn limit_without_an_answer_there_is_none() {
    let frequencies = lines();
    let wanted = SynthesisLines {
        frequencies: &frequencies,
        poles: &[],
        added_decay: 0.0,
    };
    let zero = vec![Complex64::ZERO; frequencies.len()];
    let mut broken = vec![Complex64::ONE; frequencies.len()];
    broken[3].re = f64::NAN;
    let short = vec![Complex64::ONE; 5];
    let found = wanted.synthesise(&[&zero, &broken, &short], &[]);
    assert_eq!(found, vec![None, None, None]);
    // Fewer lines than unknowns.
    let few = SynthesisLines {
        frequencies: &frequencies[..4],
        ..wanted
    };
    assert_eq!(few.synthesise(&[&zero[..4]], &[]), vec![None]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// The scale of a function changes residues and curve alike, and nothing else.
    #[test]
    fn prop_the_share_that_is_left_has_no_unit(seed in 0_u64..1000, decades in -9_i32..9) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let values: Vec<Complex64> = lines().iter().map(|_| {
            let [re, im]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(&mut random));
            Complex64::new(re, im)
        }).collect();
        let scale = 10_f64.powi(decades);
        let scaled: Vec<Complex64> = values.iter().map(|value| value * scale).collect();
        let poles = [pole(60.0, 0.02), pole(150.0, 0.02)];
        let [one, other] = [&values, &scaled].map(|values| fit(&poles, 0.0, values, None));
        prop_assert!((one.left - other.left).abs() < 1e-9);
        for (a, b) in one.residues.iter().zip(&other.residues) {
            prop_assert!((a * scale - b).norm() <= 1e-6 * b.norm());
        }
    }
}
