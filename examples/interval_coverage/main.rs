//! How often the interval of a frequency holds the truth, with the whole chain from samples to the stated interval.
//!
//! Each line of the table is a cell of `cells.rs`: how many modes, the share that was missed, the share of intervals
//! that hold the truth with its 95 % limits (Wilson), the share beyond three standard deviations, the length of the
//! interval over that of the Cramer-Rao bound (median, white noise), the share read by a fit, and the share of damping
//! intervals that hold the truth. The truth of a drifting frequency is that at the amplitude that the program states.
//! Where the scatter of taps decides, deviations are those of Student's t, as normal ones that are as improbable.
//!
//! `cargo run --release --example interval_coverage -- [--modes N] [--seed S] [--cell NAME] [--noise] [--misses N]
//! [--recordings DIR]`
//!
//! `--modes`: modes of each cell (200; 4000 for a verdict). `--cell`: this one alone. `--noise`: a line for each
//! noise. `--misses N`: the N worst answers of each cell. `--recordings`: each cell again with noise and hammer pulses
//! cut from the real recordings in this folder.

use std::path::Path;
use tapjoint::modal::ReadBy;

mod cells;
use cells::{Answer, Cell, Noise, RealSignals, run_cell};

const USAGE: &str = "usage: interval_coverage [--modes N] [--seed S] [--cell NAME] [--noise] [--misses N] [--recordings DIR]";

struct Arguments {
    modes: usize,
    seed: u64,
    cell: Option<String>,
    by_noise: bool,
    misses: usize,
    recordings: Option<String>,
}

impl Arguments {
    fn parse() -> Result<Self, String> {
        let mut parsed = Arguments {
            modes: 200,
            seed: 1,
            cell: None,
            by_noise: false,
            misses: 0,
            recordings: None,
        };
        let mut given = std::env::args().skip(1);
        while let Some(name) = given.next() {
            if name == "--noise" {
                parsed.by_noise = true;
                continue;
            }
            let value = given.next().ok_or(USAGE)?;
            let number = value.parse::<usize>().map_err(|_| USAGE);
            match name.as_str() {
                "--modes" => parsed.modes = number?,
                "--seed" => parsed.seed = number? as u64,
                "--misses" => parsed.misses = number?,
                "--cell" => parsed.cell = Some(value),
                "--recordings" => parsed.recordings = Some(value),
                _ => return Err(USAGE.to_owned()),
            }
        }
        Ok(parsed)
    }
}

/// Wilson's 95 % interval of a share (%).
fn wilson(part: usize, whole: usize) -> (f64, f64) {
    let (n, z) = (whole.max(1) as f64, 1.959_964f64);
    let share = part as f64 / n;
    let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt() / (1.0 + z * z / n);
    (100.0 * (middle - half), 100.0 * (middle + half))
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

fn report(name: &str, answers: &[&Answer]) {
    let found: Vec<&&Answer> = answers.iter().filter(|a| a.found.is_some()).collect();
    let inside = found.iter().filter(|a| a.is_inside() == Some(true)).count();
    let (low, high) = wilson(inside, found.len());
    let far = found.iter().filter(|a| a.deviations() > Some(3.0)).count();
    let fitted = found.iter().flat_map(|a| a.found);
    let fitted = fitted.filter(|found| found.source == ReadBy::Fit).count();
    let mut lengths: Vec<f64> = (found.iter())
        .filter_map(|a| Some((a.found?.high - a.found?.low) / (2.0 * 1.96 * a.bound?)))
        .collect();
    lengths.sort_by(f64::total_cmp);
    let length = lengths.get(lengths.len() / 2).copied().unwrap_or(f64::NAN);
    let dampings: Vec<bool> = (found.iter())
        .filter_map(|a| {
            let [_, low, high] = a.found?.damping?;
            Some((low..=high).contains(&a.damping_ratio))
        })
        .collect();
    let damping = dampings.iter().filter(|inside| **inside).count();
    println!(
        "{name:24} {:6} {:7.1} {:7.1} ({low:4.1} to {high:5.1}) {:8.2} {length:8.2} {:7.1} {:9.1}",
        answers.len(),
        percent(answers.len() - found.len(), answers.len()),
        percent(inside, found.len()),
        percent(far, found.len()),
        percent(fitted, found.len()),
        percent(damping, dampings.len()),
    );
}

/// The answers farthest from the truth, in standard deviations.
fn show_worst(answers: &[Answer], count: usize) {
    let mut sorted: Vec<&Answer> = answers.iter().filter(|a| a.found.is_some()).collect();
    sorted.sort_by(|a, b| {
        let [a, b] = [a, b].map(|answer| answer.deviations().unwrap_or(0.0));
        b.total_cmp(&a)
    });
    for answer in sorted.into_iter().take(count) {
        if let (Some(found), Some(deviations)) = (answer.found, answer.deviations()) {
            println!(
                "    case {} {:?}, {}: {:.1} deviations, truth {:.5} damping {:.5}, found {:.5} +-{:.5} ({}) damping {:.5?}, bound {:.5?}{}",
                answer.case,
                answer.noise,
                answer.about,
                deviations,
                answer.truth.0,
                answer.damping_ratio,
                found.frequency,
                found.std,
                found.source.name(),
                found.damping,
                answer.bound,
                if answer.shared { ", for both" } else { "" },
            );
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = Arguments::parse()?;
    let folder = arguments.recordings.as_ref();
    let real = folder.map(|folder| RealSignals::open(Path::new(folder)));
    let real = real.transpose()?;
    println!(
        "{:24} {:>6} {:>7} {:>7} {:16} {:>8} {:>8} {:>7} {:>9}",
        "cell", "modes", "missed%", "inside%", "(95 %)", ">3 std%", "length", "fitted%", "damping%"
    );
    let drawn = [Noise::White, Noise::Red, Noise::Blue, Noise::HeavyTailed];
    let mut kinds = vec![(&drawn[..], "", RealSignals::default())];
    if let Some(real) = real {
        kinds.push((&[Noise::Real], " real", real));
    }
    for (noises, suffix, real) in &kinds {
        for cell in Cell::ALL {
            if arguments
                .cell
                .as_ref()
                .is_some_and(|name| name != cell.name())
            {
                continue;
            }
            let answers = run_cell(cell, arguments.modes, arguments.seed, noises, real);
            let name = format!("{}{suffix}", cell.name());
            report(&name, &answers.iter().collect::<Vec<_>>());
            if cell == Cell::CloseModes {
                let (one, two): (Vec<&Answer>, Vec<&Answer>) =
                    answers.iter().partition(|answer| answer.shared);
                report("   read as one", &one);
                report("   read as two", &two);
            }
            if arguments.by_noise && noises.len() > 1 {
                for noise in *noises {
                    let own: Vec<&Answer> = answers.iter().filter(|a| a.noise == *noise).collect();
                    report(&format!("   {noise:?}"), &own);
                }
            }
            if cell == Cell::Functions {
                let invented = cells::functions::run(arguments.modes, arguments.seed).invented;
                println!("   {invented} modes listed that were not drawn");
            }
            show_worst(&answers, arguments.misses);
        }
    }
    Ok(())
}
