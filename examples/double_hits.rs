//! How well a second hit is found: false alarms on clean single taps and on what only looks like a
//! second hit, and the share of second hits found, by their ratio and delay.
//!
//! `cargo run --release --example double_hits [TAPS]`; 5,000 taps unless said otherwise. The same
//! number gives the same table.

#[path = "double_hits/signals.rs"]
mod signals;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use signals::{DISTURBANCES, Disturbance, Found, Record, SHAPES, found};

fn main() {
    let taps: usize = std::env::args()
        .nth(1)
        .and_then(|text| text.parse().ok())
        .unwrap_or(5000);
    clean(taps);
    disturbed(taps / 5);
    println!(
        "\nsecond hits, force noise -60 dB of the peak, at least 8 samples per pulse, widths x 0.7 to 1.3"
    );
    println!(
        "ratio  delay (pulse widths)  records  rejected  warned  missed  rms ratio error  rms delay error (samples)"
    );
    for ratio in [0.03, 0.05, 0.08, 0.12, 0.2, 0.5, 0.9] {
        for delay in [(3.0, 3.5), (3.5, 10.0), (10.0, 40.0)] {
            detection(taps / 20, ratio, delay);
        }
    }
}

/// One line of the table of false alarms.
fn count(name: &str, taps: usize, mut one: impl FnMut(&mut ChaCha8Rng) -> Record) {
    let (mut rejected, mut warned, mut lost) = (0, 0, 0);
    for seed in 0..taps {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let record = one(&mut random);
        match found(&record) {
            Found::Nothing => {}
            Found::Warned(_) => warned += 1,
            Found::Rejected(_) => rejected += 1,
            Found::NoTap => lost += 1,
        }
    }
    println!("{name:48}  {taps:6}  {rejected:8}  {warned:6}  {lost:7}");
}

fn clean(taps: usize) {
    println!("clean single taps, 0.2 to 4 ms, 2048 to 65536 samples, 10 to 51.2 kHz");
    println!("{:48}  {:>6}  rejected  warned  no tap", "case", "taps");
    for shape in SHAPES {
        for noise in [-80.0, -60.0, -50.0] {
            let name = format!("{shape:?}, noise {noise} dB");
            count(&name, taps, |random| {
                Record::draw(random, shape, noise, 0.0)
            });
        }
    }
}

fn disturbed(taps: usize) {
    println!("\nsingle taps with what only looks like a second hit");
    for disturbance in DISTURBANCES {
        count(&format!("{disturbance:?}"), taps, |random| {
            let shape = SHAPES[random.random_range(0..SHAPES.len())];
            let least = if disturbance == Disturbance::Filter {
                0.0
            } else {
                4.0
            };
            let mut record = Record::draw(random, shape, -60.0, least);
            record.disturb(disturbance, random);
            record
        });
    }
}

fn detection(taps: usize, ratio: f64, delay: (f64, f64)) {
    let (mut rejected, mut warned, mut missed) = (0, 0, 0);
    let (mut ratio_error, mut delay_error) = (0.0, 0.0);
    for seed in 0..taps {
        let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + seed as u64);
        let shape = SHAPES[seed % SHAPES.len()];
        let mut record = Record::draw(&mut random, shape, -60.0, 8.0);
        let Some(truth) = record.hit_again(ratio, delay, &mut random) else {
            continue;
        };
        let hit = match found(&record) {
            Found::Rejected(hit) => {
                rejected += 1;
                hit
            }
            Found::Warned(hit) => {
                warned += 1;
                hit
            }
            _ => {
                missed += 1;
                continue;
            }
        };
        ratio_error += (hit.ratio / ratio - 1.0).powi(2);
        delay_error += ((hit.delay - truth) * record.rate).powi(2);
    }
    let hits = f64::from(rejected + warned).max(1.0);
    println!(
        "{ratio:5.2}  {:4.1} to {:4.1}           {:8}  {rejected:8}  {warned:6}  {missed:6}  {:13.2} %  {:.2}",
        delay.0,
        delay.1,
        rejected + warned + missed,
        100.0 * (ratio_error / hits).sqrt(),
        (delay_error / hits).sqrt()
    );
}
