//! Poles of frequency response functions from a file, with the time it takes:
//! `cargo run --release --example plscf_timing FILE REPEATS`, for `scripts/compare_plscf.py`.
//!
//! The file holds little-endian 64-bit numbers: outputs, lines, first frequency (Hz), spacing (Hz), order,
//! then output by output the real and the imaginary part of each line. One line of text comes back for
//! the shortest time (ms) of poles, selection and search with sub-bands, and one for each mode.

use std::time::Instant;

use num_complex::Complex64;
use tapjoint::modal::polyreference::{
    PolyreferenceMode, PolyreferenceSettings, ResponseMatrix, all_modes, find_modes, select_modes,
    stabilise_poles,
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("name the file of responses")?;
    let repeats: usize = arguments.next().map_or(Ok(20), |text| text.parse())?;
    let numbers = read_numbers(&path)?;
    let [outputs, lines, first, spacing, order, values @ ..] = &numbers[..] else {
        return Err("the file ends within its first five numbers".into());
    };
    let (outputs, lines) = (*outputs as usize, *lines as usize);
    let complex: Vec<Complex64> = values
        .chunks_exact(2)
        .map(|pair| Complex64::new(pair[0], pair[1]))
        .collect();
    if complex.len() != outputs * lines {
        return Err(format!("{} values for {outputs} x {lines}", complex.len()).into());
    }
    let rows: Vec<Vec<&[Complex64]>> = complex.chunks(lines).map(|row| vec![row]).collect();
    let matrix = ResponseMatrix::new(*first, *spacing, &rows)?;
    let settings = PolyreferenceSettings {
        order: *order as usize,
        ..PolyreferenceSettings::default()
    };
    let mut shortest = [f64::INFINITY; 3];
    let (mut whole, mut parts) = (Vec::new(), Vec::new());
    for _ in 0..repeats {
        let start = Instant::now();
        let diagram = stabilise_poles(&matrix, &settings)?;
        let found = start.elapsed();
        whole = select_modes(&matrix, &diagram, &settings);
        let selected = start.elapsed();
        parts = all_modes(&find_modes(&matrix, &settings)?);
        let times = [found, selected - found, start.elapsed() - selected];
        for (least, time) in shortest.iter_mut().zip(times) {
            *least = least.min(1e3 * time.as_secs_f64());
        }
    }
    println!("times {} {} {}", shortest[0], shortest[1], shortest[2]);
    print_modes("whole", &whole);
    print_modes("sub-bands", &parts);
    Ok(())
}

fn read_numbers(path: &str) -> Result<Vec<f64>, Failure> {
    let bytes = std::fs::read(path)?;
    Ok(bytes
        .chunks_exact(8)
        .map(|chunk| {
            let mut number = [0; 8];
            number.copy_from_slice(chunk);
            f64::from_le_bytes(number)
        })
        .collect())
}

fn print_modes(name: &str, modes: &[PolyreferenceMode]) {
    for mode in modes {
        println!("{name} {:.9} {:.9e}", mode.frequency, mode.damping_ratio);
    }
}
