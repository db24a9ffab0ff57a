//! From joint to frequencies and back: each beside what one would write instead.

#![allow(clippy::unwrap_used, reason = "in a bench a panic is the message")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use tapjoint::identify::MeasuredMode;
use tapjoint::identify::consistent::{ConsistentEstimator, ConsistentSettings, JointedStructure};
use tapjoint::identify::pairs::{ModeLambda, PairsModel, estimate_pairs};
use tapjoint::structure::interface::{JointWeights, JointedBody};
use tapjoint::structure::{
    Assembly, Beam, BeamTheory, JointStiffness, Slenderness, natural_lambdas,
};

const MODES: usize = 5;
/// The first joint of Ingole & Chatterjee's table 1a.
const KX: f64 = 500.0;
const KY: f64 = 100.0;

fn exact(kx: f64, ky: f64) -> Vec<f64> {
    let joint = JointStiffness::two_parameter(kx, ky);
    natural_lambdas(Assembly::Cantilever, &joint, MODES).unwrap()
}

/// What one writes first: walk along lambda, bisect where the sign changes. Finds nothing that lies
/// between two steps, and does not know it.
fn scan_and_bisect(joint: &JointStiffness, step: f64) -> Vec<f64> {
    let (body, weights) = (
        JointedBody::Rooted(Slenderness::EULER),
        JointWeights::from(joint),
    );
    let equation = |lambda: f64| body.functions(lambda).equation(&weights).0;
    let mut found = Vec::new();
    let (mut low, mut below) = (step, equation(step));
    while found.len() < MODES && low < 100.0 {
        let high = low + step;
        let above = equation(high);
        if below * above < 0.0 {
            let (mut a, mut b) = (low, high);
            for _ in 0..50 {
                let middle = 0.5 * (a + b);
                if below * equation(middle) < 0.0 {
                    b = middle;
                } else {
                    a = middle;
                }
            }
            found.push(0.5 * (a + b));
        }
        (low, below) = (high, above);
    }
    found
}

/// What one would use instead of the regression: Gauss and Newton on the frequencies themselves, in
/// the logarithms of both stiffnesses, from a guess.
fn gauss_newton(measured: &[f64], guess: (f64, f64)) -> (f64, f64) {
    let (mut x, mut y) = (guess.0.ln(), guess.1.ln());
    let misses = |x: f64, y: f64| -> Vec<f64> {
        exact(x.exp(), y.exp())
            .iter()
            .zip(measured)
            .map(|(found, wanted)| (found / wanted).ln())
            .collect()
    };
    for _ in 0..20 {
        let h = 1e-6;
        let at = misses(x, y);
        let slope = |moved: Vec<f64>| -> Vec<f64> {
            moved.iter().zip(&at).map(|(m, a)| (m - a) / h).collect()
        };
        let (by_x, by_y) = (slope(misses(x + h, y)), slope(misses(x, y + h)));
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let (xx, xy, yy) = (dot(&by_x, &by_x), dot(&by_x, &by_y), dot(&by_y, &by_y));
        let (rx, ry) = (dot(&by_x, &at), dot(&by_y, &at));
        let determinant = xx * yy - xy * xy;
        let step = (
            (yy * rx - xy * ry) / determinant,
            (xx * ry - xy * rx) / determinant,
        );
        x -= step.0.clamp(-1.0, 1.0);
        y -= step.1.clamp(-1.0, 1.0);
        if step.0.abs() + step.1.abs() < 1e-10 {
            break;
        }
    }
    (x.exp(), y.exp())
}

fn forward(criterion: &mut Criterion) {
    let joint = JointStiffness::two_parameter(KX, KY);
    let found = exact(KX, KY);
    for (a, b) in found.iter().zip(scan_and_bisect(&joint, 1e-3)) {
        // Bisection ends at 1e-3/2^50; the rest is rounding of the frequency equation.
        assert!((a - b).abs() < 1e-9, "the two searches differ: {a} and {b}");
    }
    let mut group = criterion.benchmark_group("five natural frequencies");
    group.bench_function("tapjoint: natural_lambdas, counted", |b| {
        b.iter(|| natural_lambdas(Assembly::Cantilever, black_box(&joint), MODES).unwrap());
    });
    for step in [1e-3, 1e-2] {
        group.bench_function(format!("scan in steps of {step}, bisect"), |b| {
            b.iter(|| scan_and_bisect(black_box(&joint), step));
        });
    }
    group.finish();
}

fn backward(criterion: &mut Criterion) {
    let lambdas = exact(KX, KY);
    let modes = ModeLambda::numbered(&lambdas);
    let (kx, ky) = gauss_newton(&lambdas, (200.0, 20.0));
    // Forward differences of 1e-6 leave the solution itself untouched; only rounding remains.
    assert!(
        (kx / KX - 1.0).abs() < 1e-6 && (ky / KY - 1.0).abs() < 1e-6,
        "the fit ends at {kx}, {ky}"
    );
    let mut group = criterion.benchmark_group("joint from five frequencies");
    group.bench_function("tapjoint: pair regression, 2 parameters", |b| {
        b.iter(|| estimate_pairs(PairsModel::TwoParameter, black_box(&modes)).unwrap());
    });
    group.bench_function("tapjoint: pair regression, 3 parameters", |b| {
        b.iter(|| estimate_pairs(PairsModel::ThreeParameter, black_box(&modes)).unwrap());
    });
    group.bench_function("Gauss-Newton on the frequencies, 2 parameters", |b| {
        b.iter(|| gauss_newton(black_box(&lambdas), (200.0, 20.0)));
    });
    group.finish();
}

/// The consistent estimator for these lambdas on some beam; readings good to 0.1 %.
fn consistent(lambdas: &[f64], settings: &ConsistentSettings) -> ConsistentEstimator {
    let beam = Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    };
    let modes: Vec<MeasuredMode> = lambdas
        .iter()
        .enumerate()
        .map(|(index, &lambda)| MeasuredMode {
            mode: index + 1,
            frequency: beam.frequency_of(lambda),
            std: Some(1e-3 * beam.frequency_of(lambda)),
        })
        .collect();
    let structure = JointedStructure::new(BeamTheory::Euler, beam, Assembly::Cantilever);
    ConsistentEstimator::new(&structure, &modes, settings).unwrap()
}

fn consistently(criterion: &mut Criterion) {
    let lambdas = exact(KX, KY);
    let two = consistent(&lambdas, &ConsistentSettings::two_parameter());
    let three = consistent(&lambdas, &ConsistentSettings::three_parameter());
    let found = two.fit().joint();
    // Exact frequencies, rounded in the last digits.
    assert!((found.kx / KX - 1.0).abs() < 1e-9 && (found.ky / KY - 1.0).abs() < 1e-9);
    let mut group = criterion.benchmark_group("consistent estimate from five frequencies");
    group.bench_function("2 parameters, with covariance, from many starts", |b| {
        b.iter(|| black_box(&two).fit());
    });
    group.bench_function("3 parameters, with covariance, from many starts", |b| {
        b.iter(|| black_box(&three).fit());
    });
    group.bench_function("3 parameters, with profile intervals and report", |b| {
        b.iter(|| black_box(&three).estimate().unwrap());
    });
    group.finish();
}

criterion_group! {
    name = identify;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = forward, backward, consistently
}
criterion_main!(identify);
