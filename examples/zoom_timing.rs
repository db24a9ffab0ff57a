//! Times the transform of records into a zoom band, and writes the transforms, so that `scripts/compare_zoom.py` can set
//! both beside scipy's.
//!
//! ```text
//! cargo run --release --example zoom_timing -- RECORDS.f64 COUNT RATE LOW HIGH BLOCK REPETITIONS OUT.f64
//! ```
//! RECORDS.f64 holds COUNT records of equal length; OUT.f64 gets them line by line (real, imaginary). All numbers are
//! little-endian f64. Printed are the shortest and the median time (s), the first line (Hz), the spacing (Hz), and the
//! number of lines.

use std::env;
use std::error::Error;
use std::fs;
use std::hint::black_box;
use std::time::Instant;

use num_complex::Complex64;
use tapjoint::spectral::{Lines, Transformer, Workspace};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [input, count, rate, low, high, block, repetitions, output] = arguments.as_slice() else {
        return Err("give RECORDS.f64 COUNT RATE LOW HIGH BLOCK REPETITIONS OUT.f64".into());
    };
    let (count, rate): (usize, f64) = (count.parse()?, rate.parse()?);
    let bytes = fs::read(input)?;
    let (numbers, _) = bytes.as_chunks::<8>();
    let samples: Vec<f64> = numbers.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let length = samples.len() / count;
    let lines = Lines::zoom(
        (low.parse()?, high.parse()?),
        rate,
        block.parse()?,
        length as f64 / rate,
    )?;
    let mut times = Vec::new();
    let mut transforms: Vec<Vec<Complex64>> = vec![Vec::new(); count];
    for _ in 0..repetitions.parse()? {
        let start = Instant::now();
        // Planning is part of the work, as it is for the others.
        let transformer = Transformer::new(rate, lines, length);
        let mut workspace = Workspace::default();
        for (record, values) in samples.chunks_exact(length).zip(&mut transforms) {
            transformer.transform_into(black_box(record), &mut workspace, values);
        }
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let (least, median) = (times[0], times[times.len() / 2]);
    let points = lines.points();
    println!(
        "{least:e} {median:e} {} {} {points}",
        lines.low, lines.spacing
    );
    let values = transforms.iter().flatten().flat_map(|x| [x.re, x.im]);
    let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    fs::write(output, bytes)?;
    Ok(())
}
