//! H1 and coherence of many records: planned once and in parallel, one record after the other, and
//! planned anew for every record. `scripts/compare_frf.py` sets the first beside numpy and pyFRF.

#![allow(clippy::unwrap_used, reason = "in a bench a panic is the message")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tapjoint::spectral::{
    AveragedSpectra, DISPLAY_RATIO, Lines, SpectralAverager, TapRecord, Transformer,
    average_records, transform_block,
};

const RATE: f64 = 5120.0;
const BLOCK: usize = 2048;

/// Forces and responses of so many records: noise is as much work as taps.
fn signals(records: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut draw = || -> Vec<Vec<f64>> {
        let mut record = || {
            (0..BLOCK)
                .map(|_| StandardNormal.sample(&mut random))
                .collect()
        };
        (0..records).map(|_| record()).collect()
    };
    (draw(), draw())
}

fn one_by_one(
    lines: &Lines,
    (forces, responses): (&[Vec<f64>], &[Vec<f64>]),
    transform: impl Fn(&[f64]) -> Vec<num_complex::Complex64>,
) -> AveragedSpectra {
    let mut averager = SpectralAverager::new(*lines, 1);
    for (force, response) in forces.iter().zip(responses) {
        averager.add(Some(&transform(force)), &[transform(response)]);
    }
    averager.finish().unwrap()
}

fn averages(criterion: &mut Criterion) {
    let lines = Lines::zoom(
        (0.0, RATE / DISPLAY_RATIO),
        RATE,
        BLOCK,
        BLOCK as f64 / RATE,
    )
    .unwrap();
    for count in [10, 1000] {
        let (forces, responses) = signals(count);
        let pairs = forces.iter().zip(&responses);
        let records: Vec<TapRecord<'_>> = pairs
            .map(|(force, response)| TapRecord {
                force: Some(force),
                responses: vec![response],
            })
            .collect();
        let name = format!("H1 and coherence, {count} records of {BLOCK}");
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(2 * (count * BLOCK) as u64));
        group.bench_function("planned once, in parallel", |b| {
            b.iter(|| {
                let transformer = Transformer::new(RATE, lines, BLOCK);
                let averages = average_records(&transformer, black_box(&records)).unwrap();
                averages.coherence(0)
            });
        });
        group.bench_function("planned once, one record after the other", |b| {
            b.iter(|| {
                let transformer = Transformer::new(RATE, lines, BLOCK);
                let signals = (black_box(forces.as_slice()), responses.as_slice());
                one_by_one(&lines, signals, |x| transformer.transform(x)).coherence(0)
            });
        });
        group.bench_function("planned for every record", |b| {
            b.iter(|| {
                let signals = (black_box(forces.as_slice()), responses.as_slice());
                one_by_one(&lines, signals, |x| transform_block(x, RATE, &lines)).coherence(0)
            });
        });
        group.finish();
    }
}

fn zoomed(criterion: &mut Criterion) {
    let (records, _) = signals(1);
    let lines = Lines::zoom((0.0, 200.0), RATE, 512, BLOCK as f64 / RATE).unwrap();
    let mut group = criterion.benchmark_group(format!("zoom 0 to 200 Hz of a record of {BLOCK}"));
    let transformer = Transformer::new(RATE, lines, BLOCK);
    group.bench_function("planned once", |b| {
        b.iter(|| transformer.transform(black_box(&records[0])));
    });
    group.bench_function("planned for the record", |b| {
        b.iter(|| transform_block(black_box(&records[0]), RATE, &lines));
    });
    group.finish();
}

criterion_group! {
    name = frf;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = averages, zoomed
}
criterion_main!(frf);
