//! Poles of six responses on 1380 lines up to order 40. The roots of the denominators, most of the cost, stand beside
//! nalgebra's eigenvalues of the same matrices.

#![allow(clippy::unwrap_used, reason = "in a bench a panic is the message")]

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tapjoint::modal::polyreference::{
    PolyreferenceSettings, ResponseMatrix, find_modes, select_modes, stabilise_poles,
};

const MODES: [(f64, f64); 5] = [
    (42.7, 0.004),
    (118.3, 0.003),
    (231.9, 0.0035),
    (383.4, 0.005),
    (572.6, 0.006),
];

/// Six accelerances from 10 to 700 Hz every 0.5 Hz, with noise of about a thousandth of their peaks.
fn responses() -> Vec<Vec<Complex64>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    (1..=6)
        .map(|output| {
            (0..1380)
                .map(|line| {
                    let s = Complex64::new(0.0, TAU * (10.0 + 0.5 * f64::from(line)));
                    let sum: Complex64 = MODES
                        .iter()
                        .zip(1..)
                        .map(|(&(frequency, damping), index)| {
                            let omega = TAU * frequency;
                            let factor = (0.9 * f64::from(output * index)).sin();
                            factor * s * s / (s * s + 2.0 * damping * omega * s + omega * omega)
                        })
                        .sum();
                    let noise = |r: &mut ChaCha8Rng| 0.15 * r.random_range(-1.0..1.0);
                    sum + Complex64::new(noise(&mut random), noise(&mut random))
                })
                .collect()
        })
        .collect()
}

fn whole_band(criterion: &mut Criterion) {
    let values = responses();
    let rows: Vec<Vec<&[Complex64]>> = values.iter().map(|row| vec![&row[..]]).collect();
    let matrix = ResponseMatrix::new(10.0, 0.5, &rows).unwrap();
    let settings = PolyreferenceSettings::default();
    let diagram = stabilise_poles(&matrix, &settings).unwrap();
    let mut group = criterion.benchmark_group("six responses of 1380 lines, order 40");
    group.bench_function("tapjoint: stabilisation diagram", |b| {
        b.iter(|| stabilise_poles(black_box(&matrix), &settings).unwrap());
    });
    group.bench_function("tapjoint: selection", |b| {
        b.iter(|| select_modes(black_box(&matrix), &diagram, &settings));
    });
    group.bench_function("tapjoint: all, with sub-bands", |b| {
        b.iter(|| find_modes(black_box(&matrix), &settings).unwrap());
    });
    group.bench_function("nalgebra: eigenvalues of companions of 2 to 40", |b| {
        let companions: Vec<DMatrix<Complex64>> = (2..=40).map(companion).collect();
        b.iter(|| -> Vec<_> { companions.iter().map(DMatrix::eigenvalues).collect() });
    });
    group.finish();
}

/// Companion matrix of a polynomial with roots near the unit circle.
fn companion(order: usize) -> DMatrix<Complex64> {
    DMatrix::from_fn(order, order, |row, column| {
        if row == 0 {
            Complex64::from_polar(0.9, (column * column) as f64)
        } else if row == column + 1 {
            Complex64::ONE
        } else {
            Complex64::ZERO
        }
    })
}

criterion_group!(benches, whole_band);
criterion_main!(benches);
