//! Times the averaging of records that another program wrote, and writes what came out, so that
//! `scripts/compare_frf.py` can set both beside other implementations.
//!
//! ```text
//! cargo run --release --example frf_timing -- RECORDS.f64 COUNT BLOCK RATE REPETITIONS OUT.f64
//! ```
//! RECORDS.f64 holds COUNT records of BLOCK forces each, then COUNT of BLOCK responses; OUT.f64
//! gets, line by line, H1, H2 and Hv (real, imaginary) and the coherence. All numbers are
//! little-endian f64.

use std::env;
use std::error::Error;
use std::fs;
use std::hint::black_box;
use std::time::Instant;

use tapjoint::spectral::{
    AveragedSpectra, DISPLAY_RATIO, FrfEstimator, Lines, TapRecord, Transformer, average_records,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [input, count, block, rate, repetitions, output] = arguments.as_slice() else {
        return Err("give RECORDS.f64 COUNT BLOCK RATE REPETITIONS OUT.f64".into());
    };
    let (count, block): (usize, usize) = (count.parse()?, block.parse()?);
    let (rate, repetitions): (f64, usize) = (rate.parse()?, repetitions.parse()?);
    let samples = read(input)?;
    if samples.len() != 2 * count * block {
        return Err("the file does not hold that many records".into());
    }
    let (forces, responses) = samples.split_at(count * block);
    let records: Vec<TapRecord<'_>> = forces
        .chunks_exact(block)
        .zip(responses.chunks_exact(block))
        .map(|(force, response)| TapRecord {
            force: Some(force),
            responses: vec![response],
        })
        .collect();
    let lines = Lines::zoom(
        (0.0, rate / DISPLAY_RATIO),
        rate,
        block,
        block as f64 / rate,
    )?;
    let mut times = Vec::with_capacity(repetitions);
    for _ in 0..repetitions {
        let start = Instant::now();
        // Planning is part of the work, as it is for the others.
        let transformer = Transformer::new(rate, lines, block);
        let averages = average_records(&transformer, black_box(&records)).ok_or("no records")?;
        black_box(averages.coherence(0));
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
    let least = times.first().copied().unwrap_or(f64::NAN);
    println!("{least:e} {median:e}");
    let transformer = Transformer::new(rate, lines, block);
    let averages = average_records(&transformer, &records).ok_or("no records")?;
    fs::write(output, encoded(&averages))?;
    Ok(())
}

fn read(file: &str) -> Result<Vec<f64>, Box<dyn Error>> {
    let bytes = fs::read(file)?;
    let numbers = bytes.chunks_exact(8);
    Ok(numbers
        .map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
        .collect())
}

/// H1, H2, Hv and coherence of each line; what does not exist is no number.
fn encoded(averages: &AveragedSpectra) -> Vec<u8> {
    let mut numbers = Vec::new();
    for line in 0..averages.lines.points() {
        let powers = averages.powers(0, line);
        for estimator in FrfEstimator::ALL {
            let value = powers.and_then(|powers| powers.frf(estimator));
            numbers.push(value.map_or(f64::NAN, |value| value.re));
            numbers.push(value.map_or(f64::NAN, |value| value.im));
        }
        let coherence = powers.and_then(|powers| powers.coherence(averages.taps));
        numbers.push(coherence.unwrap_or(f64::NAN));
    }
    numbers.iter().flat_map(|x: &f64| x.to_le_bytes()).collect()
}
