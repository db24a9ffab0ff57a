//! Lists a universal file, writes its values for other programs to compare, or times reading it.
//!
//! ```text
//! cargo run --release --example read_uff -- FILE
//! cargo run --release --example read_uff -- FILE values OUT
//! cargo run --release --example read_uff -- FILE time PASSES
//! ```
//!
//! `values` prints a JSON line for each function and writes its numbers to OUT, 64-bit little-endian:
//! the abscissa where it is stored, the real parts, the imaginary parts where there are any. `time`
//! prints as JSON the shortest of PASSES passes (s) of: listing the headers, reading every function
//! (`read`), and opening the time series as a checked recording and reading all its channels
//! (`recording`; null without time series).

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use tapjoint::recording::{ReadSettings, Recording, UniversalFile, list_datasets, read_function};

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        [file] => list(&list_datasets(Path::new(file))?),
        [file, "values", out] => write_values(&list_datasets(Path::new(file))?, Path::new(out))?,
        [file, "time", passes] => time(Path::new(file), passes.parse()?)?,
        _ => return Err("usage: read_uff FILE [values OUT | time PASSES]".into()),
    }
    Ok(())
}

fn list(file: &UniversalFile) {
    for dataset in &file.datasets {
        let points = dataset
            .function
            .as_ref()
            .map_or(0, |function| function.points);
        println!(
            "{:5}  {}  {points} points, {} bytes",
            dataset.number,
            dataset.kind_name(),
            dataset.bytes
        );
    }
}

fn write_values(file: &UniversalFile, out: &Path) -> Outcome<()> {
    let mut out = BufWriter::new(File::create(out)?);
    for (dataset, function) in file.functions() {
        let read = read_function(file, dataset.number)?;
        println!(
            "{{\"dataset\": {}, \"function\": {}, \"points\": {}, \"abscissa\": {}, \"imaginary\": {}}}",
            dataset.number,
            function.function_type.0,
            read.real.len(),
            read.abscissa.is_some(),
            read.imaginary.is_some()
        );
        for column in [read.abscissa, Some(read.real), read.imaginary]
            .into_iter()
            .flatten()
        {
            for value in column {
                out.write_all(&value.to_le_bytes())?;
            }
        }
    }
    Ok(out.flush()?)
}

/// Seconds of the shortest of some passes, and what the last one gave.
fn shortest<T>(passes: usize, mut pass: impl FnMut() -> Outcome<T>) -> Outcome<(f64, T)> {
    let (mut best, mut result) = (f64::INFINITY, None);
    for _ in 0..passes.max(1) {
        let start = Instant::now();
        let found = pass()?;
        best = best.min(start.elapsed().as_secs_f64());
        result = Some(found);
    }
    result
        .map(|result| (best, result))
        .ok_or_else(|| "no pass".into())
}

fn time(path: &Path, passes: usize) -> Outcome<()> {
    let (listing, file) = shortest(passes, || Ok(list_datasets(path)?))?;
    let (reading, samples) = shortest(passes, || {
        let mut samples = 0;
        for (dataset, _) in file.functions() {
            samples += read_function(&file, dataset.number)?.real.len();
        }
        Ok(samples)
    })?;
    let has_time = file
        .functions()
        .any(|(_, function)| function.is_time_series());
    let recording = match has_time {
        false => "null".to_owned(),
        true => {
            let (seconds, _) = shortest(passes, || {
                let recording = Recording::open(path, &ReadSettings::default())?;
                let channels: Vec<usize> = (0..recording.channels().len()).collect();
                Ok(recording.read_channels(&channels, 0..u64::MAX)?)
            })?;
            seconds.to_string()
        }
    };
    println!(
        "{{\"samples\": {samples}, \"list\": {listing}, \"read\": {reading}, \"recording\": {recording}}}"
    );
    Ok(())
}
