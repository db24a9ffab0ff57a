//! Frequency response functions: estimators, coherence, forms, averages, windows.

use std::f64::consts::{PI, TAU};

use crate::shared::baseband;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint_signal::recording::ResponseForm;
use tapjoint_signal::spectral::{
    AveragedSpectra, DecayCheck, FrfEstimator, LinePowers, Lines, SpectralAverager, TapRecord,
    Transformer, Window, apply_force_window, average_records, choose_window, random_error,
    transform_block,
};

const RATE: f64 = 2048.0;

fn lines_of(block: usize) -> Lines {
    baseband(RATE, block, block as f64 / RATE).unwrap()
}

fn normals(random: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    (0..count).map(|_| StandardNormal.sample(random)).collect()
}

fn averages(forces: &[Vec<f64>], responses: &[Vec<f64>]) -> AveragedSpectra {
    let block = forces[0].len();
    let transformer = Transformer::new(RATE, lines_of(block), block);
    let pairs = forces.iter().zip(responses);
    let records: Vec<TapRecord<'_>> = pairs
        .map(|(force, response)| TapRecord {
            force: Some(force),
            responses: vec![response],
        })
        .collect();
    average_records(&transformer, &records).unwrap()
}

/// Values of one estimator; no number in a gap of the force.
fn values(averages: &AveragedSpectra, estimator: FrfEstimator) -> Vec<Complex64> {
    let values = averages.frf(0, estimator).unwrap();
    let gap = Complex64::new(f64::NAN, f64::NAN);
    values.into_iter().map(|h| h.unwrap_or(gap)).collect()
}

/// Line, then H1, H2 and Hv (real, imaginary) and the coherence, by numpy 2.4 and scipy 1.17:
/// `scripts/compare_frf.py --table` (scipy.signal.csd without window and overlap; Hv from
/// numpy.linalg.eigh).
const BY_SCIPY: [(usize, [f64; 7]); 5] = [
    (
        1,
        [
            1.3450807968202843,
            -0.18713043492455844,
            1.4375599084651647,
            -0.1999963210664565,
            1.4059728164757004,
            -0.19560185920515888,
            0.9356693859502403,
        ],
    ),
    (
        5,
        [
            1.2563438364504977,
            -0.8298011617887563,
            1.2732939335927118,
            -0.8409965128486855,
            1.2681391920747018,
            -0.8375918632804191,
            0.9866879934828653,
        ],
    ),
    (
        12,
        [
            -0.09493534688586881,
            -1.256041500538207,
            -0.10793426494695067,
            -1.4280236029098663,
            -0.10316253817143702,
            -1.3648913022876359,
            0.8795663446870112,
        ],
    ),
    (
        20,
        [
            -0.8448263703170414,
            -0.687738178865157,
            -0.9239778479806177,
            -0.7521721205784179,
            -0.888775156841547,
            -0.7235150668384269,
            0.9143361739282342,
        ],
    ),
    (
        25,
        [
            -0.6418472844792537,
            -0.300117254197833,
            -0.8094899963847715,
            -0.37850423440322895,
            -0.7012275328479152,
            -0.32788248359885286,
            0.7929032938588249,
        ],
    ),
];

/// The records behind the table: the congruential generator of the C standard's example.
fn table_records() -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut state: u64 = 1;
    let numbers: Vec<f64> = (0..2 * 5 * 64)
        .map(|_| {
            state = (1_103_515_245 * state + 12_345) % (1 << 31);
            state as f64 / f64::from(1 << 30) - 1.0
        })
        .collect();
    let (force, noise) = numbers.split_at(5 * 64);
    let forces: Vec<Vec<f64>> = force.chunks(64).map(<[f64]>::to_vec).collect();
    let responses = forces.iter().zip(noise.chunks(64)).map(|(force, noise)| {
        let before = |n: usize, by: usize| if n >= by { force[n - by] } else { 0.0 };
        let response = |n: usize| before(n, 1) + 0.5 * before(n, 2) + 0.4 * noise[n];
        (0..64).map(response).collect()
    });
    (forces.clone(), responses.collect())
}

#[test]
fn val_estimators_and_coherence_equal_scipy() {
    let (forces, responses) = table_records();
    let averages = averages(&forces, &responses);
    for (line, expected) in BY_SCIPY {
        let powers = averages.powers(0, line).unwrap();
        let mut found = Vec::new();
        for estimator in FrfEstimator::ALL {
            let value = powers.frf(estimator).unwrap();
            found.extend([value.re, value.im]);
        }
        found.push(powers.coherence(averages.taps).unwrap());
        for (place, (found, expected)) in found.iter().zip(expected).enumerate() {
            // Both round sums of a few hundred terms: some 1e-15.
            let error = (found - expected).abs();
            assert!(
                error < 1e-12,
                "line {line}, number {place}: {found} {expected}"
            );
        }
    }
}

#[test]
fn prop_a_delayed_copy_has_the_phase_minus_omega_tau() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for delay in [1usize, 7, 100] {
        let mut force = normals(&mut random, 400);
        force.resize(1024, 0.0);
        let mut response = vec![0.0; 1024];
        for n in delay..1024 {
            response[n] = -3.0 * force[n - delay];
        }
        let averages = averages(&[force.clone(), force], &[response.clone(), response]);
        for estimator in FrfEstimator::ALL {
            for (line, found) in values(&averages, estimator).iter().enumerate() {
                let omega = TAU * averages.lines.frequency(line);
                let tau = delay as f64 / RATE;
                let expected = Complex64::from_polar(-3.0, -omega * tau);
                // Rounding only; nothing is cut off, for the force ends before the record.
                let error = (found - expected).norm();
                assert!(
                    error < 1e-9,
                    "{estimator:?}, delay {delay}, line {line}: {error:e}"
                );
            }
        }
    }
}

/// Powers that some signals could have: |Gfx|^2 <= Gff Gxx.
fn any_powers(random: &mut ChaCha8Rng) -> LinePowers {
    let force = 10f64.powf(random.random_range(-8.0..8.0));
    let response = 10f64.powf(random.random_range(-8.0..8.0));
    let coherence: f64 = random.random_range(1e-4..1.0);
    let size = (coherence * force * response).sqrt();
    LinePowers {
        force,
        response,
        cross: Complex64::from_polar(size, random.random_range(-PI..PI)),
    }
}

#[test]
fn prop_hv_is_the_eigenvector_and_lies_between_h1_and_h2() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for case in 0..2000 {
        let powers = any_powers(&mut random);
        let [h1, h2, hv] = FrfEstimator::ALL.map(|e| powers.frf(e).unwrap());
        let slack = 1.0 + 1e-12;
        assert!(
            h1.norm() <= hv.norm() * slack && hv.norm() <= h2.norm() * slack,
            "case {case}: {h1} {hv} {h2}"
        );
        // Row by row of [[Gff, Gxf], [Gfx, Gxx]] (1, Hv) = eigenvalue (1, Hv).
        let first = powers.force + powers.cross.conj() * hv;
        let second = powers.cross + powers.response * hv;
        let error = (second - first * hv).norm() / second.norm().max((first * hv).norm());
        // Rounding, of a matrix whose entries differ by up to 16 decades.
        assert!(error < 1e-9, "case {case}: {error:e}");
        assert!(first.re >= powers.force.max(powers.response) * (1.0 - 1e-12));
        let coherence = powers.coherence(2).unwrap();
        assert!((coherence - (h1 / h2).norm()).abs() < 1e-12, "case {case}");
    }
}

#[test]
fn limit_noise_on_one_side_leaves_one_estimator_right() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let (count, block) = (400, 128);
    let draw = |random: &mut ChaCha8Rng| -> Vec<Vec<f64>> {
        (0..count).map(|_| normals(random, block)).collect()
    };
    let (clean, noise) = (draw(&mut random), draw(&mut random));
    let noisy: Vec<Vec<f64>> = clean
        .iter()
        .zip(&noise)
        .map(|(x, n)| x.iter().zip(n).map(|(x, n)| x + 0.5 * n).collect())
        .collect();
    // The true function is 1. Noise of a quarter of the power takes H2 up, or H1 down, by 1.25; the
    // total least squares for noise on one side only lies between.
    let mean = |averages: &AveragedSpectra, estimator| {
        let values = values(averages, estimator);
        values[1..].iter().map(|h| h.re).sum::<f64>() / (values.len() - 1) as f64
    };
    let on_response = averages(&clean, &noisy);
    let on_force = averages(&noisy, &clean);
    // A mean over 50 lines of 400 averages scatters by 0.5/sqrt(2*400*50) = 0.0025.
    for (averages, estimator, expected) in [
        (&on_response, FrfEstimator::H1, 1.0),
        (&on_response, FrfEstimator::H2, 1.25),
        (&on_force, FrfEstimator::H1, 0.8),
        (&on_force, FrfEstimator::H2, 1.0),
    ] {
        let found = mean(averages, estimator);
        assert!(
            (found - expected).abs() < 0.01,
            "{estimator:?}: {found} for {expected}"
        );
    }
    let between = mean(&on_response, FrfEstimator::Hv);
    assert!(between > 1.05 && between < 1.2, "{between}");
}

#[test]
fn limit_one_average_has_no_coherence() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (force, response) = (normals(&mut random, 256), normals(&mut random, 256));
    let one = averages(
        std::slice::from_ref(&force),
        std::slice::from_ref(&response),
    );
    assert_eq!(one.coherence(0), None);
    assert_eq!(one.best_quality(100.0).random_error, None);
    assert!(one.frf(0, FrfEstimator::H2).is_some());
    let two = averages(&[force.clone(), response.clone()], &[response, force]);
    assert!(two.coherence(0).unwrap().iter().all(Option::is_some));
    assert_eq!(random_error(0.9, 1), None);
    assert_eq!(random_error(0.0, 5), None, "unbounded is no number");
    assert_eq!(random_error(1.0, 5), Some(0.0));
    let silent = averages(
        &[vec![1.0; 64], vec![1.0; 64]],
        &[vec![0.0; 64], vec![0.0; 64]],
    );
    assert_eq!(silent.coherence(0).unwrap()[3], None, "without power");
    assert_eq!(silent.frf(0, FrfEstimator::H2).unwrap()[3], None, "0/0");
}

#[test]
fn limit_without_a_hammer_there_is_no_function() {
    let lines = lines_of(64);
    let transformer = Transformer::new(RATE, lines, 64);
    let response = vec![1.0; 64];
    let record = TapRecord {
        force: None,
        responses: vec![&response],
    };
    let averages = average_records(&transformer, &[record.clone(), record]).unwrap();
    assert_eq!(averages.taps, 2);
    assert!(averages.h1.is_none() && averages.frf(0, FrfEstimator::H1).is_none());
    assert!(averages.coherence(0).is_none());
    assert!(average_records(&transformer, &[]).is_none());
}

#[test]
fn recover_the_random_error_is_the_scatter_of_repeated_measurements() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let (taps, block, repetitions) = (5, 64, 400);
    let mut magnitudes = vec![Vec::new(); lines_of(block).points()];
    for _ in 0..repetitions {
        let forces: Vec<Vec<f64>> = (0..taps).map(|_| normals(&mut random, block)).collect();
        let responses: Vec<Vec<f64>> = forces
            .iter()
            .map(|force| {
                let noise = normals(&mut random, block);
                force.iter().zip(&noise).map(|(f, n)| f + 0.2 * n).collect()
            })
            .collect();
        let found = values(&averages(&forces, &responses), FrfEstimator::H1);
        for (line, value) in found.iter().enumerate() {
            magnitudes[line].push(value.norm());
        }
    }
    let scatter = |values: &Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        square / (values.len() - 1) as f64
    };
    // The 0 Hz line is real and scatters twice as much.
    let lines = &magnitudes[1..];
    let found = (lines.iter().map(scatter).sum::<f64>() / lines.len() as f64).sqrt();
    let expected = random_error(1.0 / 1.04, taps).unwrap();
    // The formula is the first order of small errors: the mean of 1/sum|F|^2 over five averages is
    // 5/4 of 1/mean, which makes the scatter sqrt(5/4) = 1.12 of it; 3 % beyond are chance.
    let ratio = found / expected;
    assert!(
        ratio > 1.08 && ratio < 1.16,
        "{found} for {expected}: {ratio}"
    );
}

#[test]
fn prop_forms_convert_by_powers_of_j_omega() {
    let value = Complex64::new(0.3, -1.7);
    let omega = TAU * 40.0;
    let j_omega = Complex64::new(0.0, omega);
    let steps = [
        (ResponseForm::Receptance, ResponseForm::Mobility, j_omega),
        (ResponseForm::Mobility, ResponseForm::Accelerance, j_omega),
        // A displacement e^{j omega t} has the acceleration -omega^2 e^{j omega t}.
        (
            ResponseForm::Receptance,
            ResponseForm::Accelerance,
            Complex64::from(-omega * omega),
        ),
    ];
    for (from, to, factor) in steps {
        let there = from.convert(to, value, 40.0).unwrap();
        assert!(
            (there / value - factor).norm() < 1e-9 * factor.norm(),
            "{from:?} to {to:?}"
        );
        let back = to.convert(from, there, 40.0).unwrap();
        assert!((back - value).norm() < 1e-12, "{to:?} back to {from:?}");
        assert_eq!(
            to.convert(from, value, 0.0),
            None,
            "nothing to integrate from"
        );
        assert_eq!(from.convert(to, value, 0.0).unwrap().norm(), 0.0);
    }
    for form in ResponseForm::ALL {
        assert_eq!(form.convert(form, value, 0.0), Some(value), "{form:?}");
        assert!(form.unit().contains(form.response_unit()));
    }
}

#[test]
fn prop_averages_are_the_same_whatever_the_number_of_threads() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let forces: Vec<Vec<f64>> = (0..150).map(|_| normals(&mut random, 120)).collect();
    let responses: Vec<Vec<f64>> = (0..150).map(|_| normals(&mut random, 120)).collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| averages(&forces, &responses))
    };
    let one = with(1);
    for threads in [2, 3, 7] {
        assert!(with(threads) == one, "{threads} threads change a bit");
    }
    let lines = lines_of(120);
    let mut averager = SpectralAverager::new(lines, 1);
    for (force, response) in forces.iter().zip(&responses) {
        averager.add(
            Some(&transform_block(force, RATE, &lines)),
            &[transform_block(response, RATE, &lines)],
        );
    }
    let single = averager.finish().unwrap().h1.unwrap();
    let error = |(a, b): (&Complex64, &Complex64)| (a - b).norm();
    let pairs = single[0].iter().zip(&one.h1.as_ref().unwrap()[0]);
    // Another order of adding 150 numbers of size one.
    assert!(pairs.map(error).fold(0.0, f64::max) < 1e-12);
}

#[test]
fn prop_a_planned_transform_equals_one_planned_for_the_record() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let available = 3000.0 / RATE;
    for band in [(0.0, 780.0), (0.0, 100.0), (210.0, 260.0), (100.0, 900.0)] {
        let lines = Lines::zoom(band, RATE, 512, available).unwrap();
        let transformer = Transformer::new(RATE, lines, 3000);
        for length in [3000, 2999, 700, 1] {
            let samples = normals(&mut random, length);
            let planned = transformer.transform(&samples);
            let alone = transform_block(&samples, RATE, &lines);
            let scale = (length as f64).sqrt() / RATE;
            for (line, (a, b)) in planned.iter().zip(&alone).enumerate() {
                // Zeros after the record change nothing but the rounding.
                let error = (a - b).norm() / scale;
                assert!(
                    error < 1e-10,
                    "{band:?}, {length} samples, line {line}: {error:e}"
                );
            }
        }
        assert!(transformer.transform(&[]).iter().all(|x| x.norm() == 0.0));
    }
}

#[test]
fn val_transforms_are_the_sums_they_stand_for() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let samples = normals(&mut random, 3000);
    // Lines of a real transform of 1024, 4096 and 2048 samples, shorter and longer than the record; then lines of none.
    let bands = [(0.0, 800.0), (200.0, 400.0), (100.0, 500.0), (211.3, 262.1)];
    for (band, most) in bands.into_iter().zip([1e-12, 1e-12, 1e-12, 1e-4]) {
        let lines = Lines::zoom(band, RATE, 1024, 3000.0 / RATE).unwrap();
        let found = transform_block(&samples, RATE, &lines);
        assert_eq!(found.len(), lines.points());
        for (index, value) in found.iter().enumerate() {
            let turn = -TAU * lines.frequency(index) / RATE;
            let terms = samples.iter().enumerate();
            let terms = terms.map(|(n, x)| Complex64::from_polar(x / RATE, turn * n as f64));
            let error = (terms.sum::<Complex64>() - value).norm() / (3000_f64.sqrt() / RATE);
            // Rounding, or what the zoom's filter lets pass from many bands at 100 dB.
            assert!(error < most, "{band:?}, line {index}: {error:e}");
        }
    }
}

/// A mode of a simulated structure: frequency (Hz), damping ratio, residue (response per N s).
type Mode = (f64, f64, f64);

const SINGLE: &[Mode] = &[(96.3, 0.006, 40.0)];
const MULTI: &[Mode] = &[
    (41.7, 0.008, 25.0),
    (118.2, 0.005, -60.0),
    (133.9, 0.004, 35.0),
    (402.6, 0.003, 110.0),
];

fn pole((frequency, ratio, _): Mode) -> Complex64 {
    let omega = TAU * frequency;
    Complex64::new(-ratio * omega, omega * (1.0 - ratio * ratio).sqrt())
}

/// A half-sine pulse of 4 samples that begins with sample 24: its spectrum has its first gap at 768 Hz.
fn pulse(length: usize) -> Vec<f64> {
    let mut force = vec![0.0; length];
    for n in 0..4 {
        force[24 + n] = 30.0 * (PI * (n as f64 + 0.5) / 4.0).sin();
    }
    force
}

/// The force convolved with the impulse response sum A e^{-sigma t} sin(omega_d t).
fn respond(modes: &[Mode], force: &[f64]) -> Vec<f64> {
    let mut response = vec![0.0; force.len()];
    for &mode in modes {
        let step = (pole(mode) / RATE).exp();
        let mut state = Complex64::ZERO;
        for (x, f) in response.iter_mut().zip(force) {
            state = state * step + f;
            *x += mode.2 * state.im;
        }
    }
    response
}

/// The two halves of a mode's function, of unit residue: 1/(1 - e^{(s - a - j omega)/rate}) and the
/// same of the conjugate pole. H(omega) = sum A/(2j) (first - second), at poles shifted by `decay`.
fn halves(mode: Mode, decay: f64, frequency: f64) -> [Complex64; 2] {
    let shifted = Complex64::new(decay, TAU * frequency);
    [pole(mode), pole(mode).conj()].map(|s| 1.0 / (1.0 - ((s - shifted) / RATE).exp()))
}

fn closed_form(modes: &[Mode], decay: f64, frequency: f64) -> Complex64 {
    let of_mode = |&mode: &Mode| {
        let [first, second] = halves(mode, decay, frequency);
        mode.2 * (first - second) / Complex64::new(0.0, 2.0)
    };
    modes.iter().map(of_mode).sum()
}

/// H1 of one windowed tap.
fn windowed_function(modes: &[Mode], window: Window, block: usize) -> (Lines, Vec<Complex64>) {
    let mut force = pulse(block);
    let mut response = respond(modes, &force);
    apply_force_window(&mut force, 40, 16);
    window.apply(&mut force, RATE);
    window.apply(&mut response, RATE);
    let averages = averages(&[force], &[response]);
    (averages.lines, values(&averages, FrfEstimator::H1))
}

/// Residues A/(2j) of all modes, fitted to the lines about each with known poles, over the truth.
fn residue_ratios(modes: &[Mode], decay: f64, lines: &Lines, h: &[Complex64]) -> Vec<Complex64> {
    let near = |line: &usize| {
        let frequency = lines.frequency(*line);
        modes.iter().any(|mode| (frequency - mode.0).abs() < 6.0)
    };
    let chosen: Vec<usize> = (1..lines.points()).filter(near).collect();
    let mut matrix = DMatrix::zeros(2 * chosen.len(), 2 * modes.len());
    let mut right = DVector::zeros(2 * chosen.len());
    for (row, &line) in chosen.iter().enumerate() {
        // H = sum R first + conj(R) second: linear in the real and imaginary part of R.
        for (column, &mode) in modes.iter().enumerate() {
            let [first, second] = halves(mode, decay, lines.frequency(line));
            let (re, im) = (first + second, (first - second) * Complex64::I);
            matrix[(2 * row, 2 * column)] = re.re;
            matrix[(2 * row + 1, 2 * column)] = re.im;
            matrix[(2 * row, 2 * column + 1)] = im.re;
            matrix[(2 * row + 1, 2 * column + 1)] = im.im;
        }
        (right[2 * row], right[2 * row + 1]) = (h[line].re, h[line].im);
    }
    let found = matrix.svd(true, true).solve(&right, 1e-12).unwrap();
    let ratio = |(index, mode): (usize, &Mode)| {
        let residue = Complex64::new(found[2 * index], found[2 * index + 1]);
        residue / (mode.2 / Complex64::new(0.0, 2.0))
    };
    modes.iter().enumerate().map(ratio).collect()
}

/// The exponential window that takes the slowest of the modes down to `end` in `duration` (s).
fn window_to(end: f64, modes: &[Mode], duration: f64) -> Window {
    let slowest = modes
        .iter()
        .map(|&mode| -pole(mode).re)
        .fold(f64::MAX, f64::min);
    Window::Exponential {
        decay: -end.ln() / duration - slowest,
    }
}

#[test]
fn recover_amplitudes_under_exponential_and_force_windows() {
    let block = 2048;
    for modes in [SINGLE, MULTI] {
        // 1 s is far too short for these modes: without a window the slowest keeps 3 % of its level.
        let window = window_to(1e-4, modes, block as f64 / RATE);
        let decay = window.added_decay();
        assert!(decay > 1.0, "the window has to do something: {decay}");
        let (lines, h) = windowed_function(modes, window, block);
        let highest = h.iter().map(|h| h.norm()).fold(0.0, f64::max);
        // The pulse has power up to some 500 Hz; beyond, what is cut off is divided by little.
        let reached = h.iter().enumerate().take(lines.nearest(500.0)).skip(1);
        for (line, h) in reached {
            let expected = closed_form(modes, decay, lines.frequency(line));
            let error = (h - expected).norm();
            // H_windowed(omega) = H(omega - j a); what is cut off has 1e-4 of its level. Where the
            // function is small (below a hundredth of its peak) that is small beside the peak only.
            let allowed = 1e-3 * expected.norm().max(0.01 * highest);
            assert!(
                error < allowed,
                "{} Hz: {error} of {expected}",
                lines.frequency(line)
            );
        }
        for (mode, ratio) in modes.iter().zip(residue_ratios(modes, decay, &lines, &h)) {
            let error = (ratio - 1.0).norm();
            assert!(
                error < 1e-3,
                "mode at {} Hz: residue wrong by {error}",
                mode.0
            );
        }
    }
}

#[test]
fn recover_residues_where_the_window_leaves_one_percent() {
    let block = 2048;
    let duration = block as f64 / RATE;
    for modes in [SINGLE, MULTI] {
        let slowest = modes
            .iter()
            .map(|&mode| -pole(mode).re)
            .fold(f64::MAX, f64::min);
        let check = DecayCheck {
            remaining: (-slowest * duration).exp(),
            noise: 0.0,
        };
        let window = choose_window(&[check], duration);
        let decay = window.added_decay();
        let (lines, h) = windowed_function(modes, window, block);
        let ratios = residue_ratios(modes, decay, &lines, &h);
        for (&mode, ratio) in modes.iter().zip(&ratios) {
            // Cutting off at e^{(s-a)T} scales a residue by 1 - e^{(s-a)(T - t0)} e^{-j omega_r (t0 - T)}
            // on the lines of the block (t0: middle of the pulse): up to the 1 % that is left.
            let rest = duration - 25.5 / RATE;
            let omega = TAU * lines.frequency(lines.nearest(mode.0));
            let cut =
                ((pole(mode) - decay) * rest).exp() * Complex64::from_polar(1.0, -omega * rest);
            assert!((ratio - 1.0).norm() < 0.011, "{} Hz: {ratio}", mode.0);
            let corrected = ratio / (1.0 - cut);
            // The pulse is not a point and the line not the pole: second order in both.
            assert!(
                (corrected - 1.0).norm() < 1e-3,
                "{} Hz: {corrected}",
                mode.0
            );
        }
        let worst = ratios.iter().map(|r| (r - 1.0).norm()).fold(0.0, f64::max);
        assert!(
            worst > 2e-3,
            "a cut that changes nothing proves nothing: {worst}"
        );
    }
}

#[test]
fn recover_the_force_window_takes_the_noise_out_and_leaves_the_pulse() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let block = 8192;
    let clean = pulse(block);
    let response = respond(SINGLE, &clean);
    let noisy: Vec<f64> = clean
        .iter()
        .zip(normals(&mut random, block))
        .map(|(f, n)| f + 0.02 * n)
        .collect();
    let mut windowed = noisy.clone();
    apply_force_window(&mut windowed, 40, 16);
    assert_eq!(windowed[..40], noisy[..40], "unity over the pulse");
    assert!(
        windowed[56..].iter().all(|&x| x == 0.0),
        "exact zero after the taper"
    );
    let error = |force: Vec<f64>| {
        let averages = averages(&[force], std::slice::from_ref(&response));
        let found = values(&averages, FrfEstimator::H1);
        let relative = |(line, h): (usize, &Complex64)| {
            let truth = closed_form(SINGLE, 0.0, averages.lines.frequency(line));
            (h / truth - 1.0).norm_sqr()
        };
        // Lines on which the pulse has power: to 200 Hz.
        let lines = 10..averages.lines.nearest(200.0);
        let count = lines.len() as f64;
        let sum: f64 = found
            .iter()
            .enumerate()
            .take(lines.end)
            .skip(10)
            .map(relative)
            .sum();
        (sum / count).sqrt()
    };
    let (with, without) = (error(windowed), error(noisy));
    // Noise of 48 samples instead of 8192: a thirteenth of the amplitude.
    assert!(
        with < without / 5.0,
        "{with} with, {without} without the window"
    );
    assert!(error(clean) < 1e-3, "the pulse itself is right to 0.1 %");
}
