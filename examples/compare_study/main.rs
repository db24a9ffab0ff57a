//! How often a comparison of two tests is right, on drawn pairs of tests (frequencies, not recordings) of many kinds.
//!
//! Every class of changes is a cell. The model is wrong by the tolerances of a description. In four of
//! five pairs it also lacks an effect that both tests share. The scatter between tests has long tails (Student's with four degrees of freedom), and a part of it
//! is common to all modes. Half of the pairs state their repeatability, a quarter has three tests on either side, and a
//! quarter knows nothing of it.
//!
//! "Visible" are the pairs in which the change alone has a chi square of 14.9 or more: one in a hundred false alarms and one
//! in ten misses, for an observer who knows what to look for. A first cause is right where its group is.
//!
//! `cargo run --release --example compare_study -- [--pairs N | --series N | --smallest N] [--seed S] [--cell NAME] [--ideal] [--list]`
//!
//! `--series N`: series of tests in the order of time instead, N for each delay and ten times as many in which nothing changes.
//!
//! `--smallest N`: the smallest change of the joint that is seen, on at most 2 N cantilevers.
//!
//! `--ideal`: the program is told the true structure before the change, with its joint. These frequencies do not tell what it
//! then misses.
//!
//! `--pairs`: pairs of each cell (20); of `nothing` four times as many. The same seed gives the same answers, whatever the number
//! of threads.

mod series;
mod smallest;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tapjoint::compare::{CauseKind, Comparison, MeasuredMode, Pair, Settings, Test, compare};
use tapjoint::simulate::{ScatterTails, SetUpScatter};
use tapjoint::study::blind_check::Rate;
use tapjoint::study::change_check::{
    AnsweredPair, ChangeClass, ChangedStructure, PairAnswer, PairCase, PairTruth, VISIBLE,
    chi_square, draw_repeatability, score_pairs,
};

const USAGE: &str = "usage: compare_study [--pairs N | --series N | --smallest N] [--seed S] [--cell NAME] [--ideal] [--list]";
/// Structures drawn for one pair until one of them can be.
const ATTEMPTS: u64 = 50;

/// What is drawn, and what the program is told of it.
#[derive(Clone, Copy)]
struct Study {
    seed: u64,
    /// True where the program is told the true structure before the change.
    is_ideal: bool,
}

/// A drawn pair.
struct Drawn {
    /// What the program sees.
    pairs: Vec<Pair>,
    /// What it is told.
    settings: Settings,
    /// Structure and change.
    structure: ChangedStructure,
    /// Chi square of the change alone.
    chi_square: f64,
    /// True standard deviation of the difference of two tests (1).
    repeatability: f64,
}

impl Drawn {
    /// Draws a pair; `None` where the drawn structure cannot be.
    fn new(cell: ChangeClass, study: Study, number: u64, attempt: u64) -> Option<Self> {
        let Study { seed, is_ideal } = study;
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        draw.set_stream(((cell as u64) << 40) + (number << 8) + attempt);
        let draw = &mut draw;
        let structure = ChangedStructure::draw(cell, draw)?;
        let frequencies = structure.frequencies(draw.random_range(4..=8))?;
        let repeatability = draw_repeatability(draw);
        let knows = draw.random_range(0..4);
        let repeats = if knows == 2 { 3 } else { 1 };
        let scatter = SetUpScatter {
            repeatability,
            share: 0.5 * draw.random::<f64>(),
            tails: ScatterTails::Long,
        };
        let described = match is_ideal {
            true => &structure.before,
            false => &structure.described,
        };
        let mut items = structure.items.clone();
        for (item, mass) in items.iter_mut().zip(&described.masses) {
            item.point = *mass;
        }
        let mut tests = |frequencies: &[f64]| -> Vec<Test> {
            (0..repeats)
                .map(|_| {
                    let factors = scatter.factors(frequencies.len(), draw);
                    let read = frequencies.iter().zip(factors).enumerate();
                    let modes = read.map(|(index, (frequency, factor))| {
                        let std = 0.05 * repeatability * frequency;
                        MeasuredMode::of_frequency(index + 1, frequency * factor, std)
                    });
                    Test {
                        structure: described.clone(),
                        items: items.clone(),
                        knows_joint: [is_ideal; 2],
                        common_std: 0.01,
                        modes: modes.collect(),
                        unnumbered: Vec::new(),
                    }
                })
                .collect()
        };
        let pair = Pair {
            before: tests(&frequencies[0]),
            after: tests(&frequencies[1]),
        };
        Some(Self {
            pairs: vec![pair],
            settings: Settings {
                repeatability: (knows < 2).then_some(repeatability),
            },
            chi_square: chi_square(&frequencies, repeatability),
            structure,
            repeatability,
        })
    }
}

struct Row {
    cell: ChangeClass,
    drawn: Drawn,
    truth: PairTruth,
    found: Comparison,
}

impl Row {
    fn answer(&self) -> AnsweredPair<'_> {
        AnsweredPair {
            truth: &self.truth,
            found: &self.found,
        }
    }
}

/// Returns a rate as text: "96.1 % (245 of 255)".
fn shown(rate: Rate) -> String {
    match rate.value() {
        Some(share) => format!("{:.1} % ({} of {})", 100.0 * share, rate.hits, rate.of),
        None => "-".to_owned(),
    }
}

fn main() -> Result<(), String> {
    let (mut pairs, mut cells, mut list) = (20_usize, Vec::new(), false);
    let mut study = Study {
        seed: 1,
        is_ideal: false,
    };
    let (mut series, mut smallest) = (None, None);
    let mut given = std::env::args().skip(1);
    while let Some(name) = given.next() {
        let mut value = || given.next().ok_or(USAGE);
        match name.as_str() {
            "--list" => list = true,
            "--ideal" => study.is_ideal = true,
            "--pairs" => pairs = value()?.parse().map_err(|_| USAGE)?,
            "--series" => series = Some(value()?.parse().map_err(|_| USAGE)?),
            "--smallest" => smallest = Some(value()?.parse().map_err(|_| USAGE)?),
            "--seed" => study.seed = value()?.parse().map_err(|_| USAGE)?,
            "--cell" => cells.push(value()?),
            _ => return Err(USAGE.to_owned()),
        }
    }
    if let Some(series) = series {
        series::print_series(series, study.seed);
        return Ok(());
    }
    if let Some(structures) = smallest {
        smallest::print_smallest(structures, study.seed);
        return Ok(());
    }
    let mut tasks = Vec::new();
    for cell in ChangeClass::ALL {
        if cells.is_empty() || cells.iter().any(|name| name == cell.name()) {
            let count = if cell == ChangeClass::Nothing {
                4 * pairs
            } else {
                pairs
            };
            tasks.extend((0..count as u64).map(|number| (cell, number)));
        }
    }
    let rows: Vec<Row> = tasks
        .par_iter()
        .filter_map(|&(cell, number)| {
            let drawn =
                (0..ATTEMPTS).find_map(|attempt| Drawn::new(cell, study, number, attempt))?;
            let found = compare(&drawn.pairs, &drawn.settings).ok()?;
            let truth = PairTruth {
                name: String::new(),
                changes: drawn.structure.changes.clone(),
                visible: Some(drawn.chi_square >= VISIBLE),
                repeatability: drawn.settings.repeatability,
            };
            Some(Row {
                cell,
                drawn,
                truth,
                found,
            })
        })
        .collect();
    if list {
        for row in &rows {
            print_row(row);
            print_causes(row);
        }
    }
    print_scores(&rows);
    Ok(())
}

fn print_row(row: &Row) {
    let verdict = &row.found.verdict;
    let names: Vec<&str> = verdict.effects.iter().map(|kind| kind.name()).collect();
    println!(
        "{:16} chi2 {:9.1} r {:.4} {:?} -> {} {} {:.3}; first {} {:.3}",
        row.cell.name(),
        row.drawn.chi_square,
        100.0 * row.drawn.repeatability,
        row.drawn.structure.changes,
        verdict.kind.name(),
        names.join(","),
        verdict.probability,
        row.found.hypotheses[0].effect.name(),
        row.found.hypotheses[0].probability,
    );
}

fn print_scores(rows: &[Row]) {
    println!(
        "{:16} {:>20} {:>20} {:>20} {:>20} {:>20} {:>20}",
        "cell", "visible", "first right", "named", "named wrongly", "list holds", "called a change"
    );
    for cell in ChangeClass::ALL {
        let own: Vec<&Row> = rows.iter().filter(|row| row.cell == cell).collect();
        if own.is_empty() {
            continue;
        }
        let visible = |row: &&Row| row.answer().is_visible();
        let seen: Vec<&Row> = own.iter().copied().filter(visible).collect();
        let rates = [
            Rate::of(&own, |row| Some(row.answer().is_visible())),
            Rate::of(&seen, |row| Some(row.answer().first_is_right())),
            Rate::of(&seen, |row| Some(row.answer().is_named())),
            Rate::of(&own, |row| Some(is_wrong(row))),
            Rate::of(&seen, |row| Some(row.answer().list_holds())),
            Rate::of(&own, |row| Some(row.answer().is_called_change())),
        ];
        let columns = rates.map(|rate| format!(" {:>20}", shown(rate)));
        println!("{:16}{}", cell.name(), columns.concat());
    }
    let of_cases: Vec<PairCase> = rows
        .iter()
        .map(|row| {
            let answer = PairAnswer::Compared(Box::new(row.found.clone()));
            (row.truth.clone(), answer)
        })
        .collect();
    let scores = score_pairs(&of_cases);
    let single = rows.iter().filter(|row| row.cell.cause().is_some());
    let wrong = Rate::of(single, |row| {
        row.answer().is_visible().then(|| is_wrong(row))
    });
    println!(
        "first cause of visible single changes {}, named wrongly {}",
        shown(scores.rate("first_right_visible").unwrap_or_default()),
        shown(wrong)
    );
    let intervals = [
        ("Kt", "kt_interval"),
        ("Kr", "kr_interval"),
        ("visible mass", "mass_interval"),
        ("visible position", "place_interval"),
    ];
    for (name, key) in intervals {
        let rate = scores.rate(key).unwrap_or_default();
        println!("95 % interval of {name} holds {}", shown(rate));
    }
    print_calibration(rows);
}

fn is_wrong(row: &Row) -> bool {
    row.answer().is_named() && !row.answer().name_is_right()
}

/// Prints what is stated of the first cause of all, with those that are like it, and how often it is right.
fn print_calibration(rows: &[Row]) {
    let mut bins: [Vec<(f64, bool)>; 5] = Default::default();
    for row in rows {
        let top = &row.found.hypotheses[0];
        let right = match top.effect {
            CauseKind::NoChange => row.cell == ChangeClass::Nothing,
            CauseKind::Unknown => row.cell == ChangeClass::Outside,
            kind => row.answer().is_right(kind),
        };
        let alike = row.found.hypotheses.iter();
        let alike = alike.filter(|one| one.effect.is_like(top.effect));
        let together: f64 = alike.map(|one| one.probability).sum();
        bins[((together * 5.0) as usize).min(4)].push((together, right));
    }
    for bin in bins.iter().filter(|bin| !bin.is_empty()) {
        let mean = bin.iter().map(|one| one.0).sum::<f64>() / bin.len() as f64;
        let rate = Rate::of(bin, |one| Some(one.1));
        println!("stated {mean:.3} right {}", shown(rate));
    }
}

/// Prints the first causes with their sizes.
fn print_causes(row: &Row) {
    for cause in row.found.hypotheses.iter().take(5) {
        let sizes: Vec<String> = cause
            .parameters
            .iter()
            .map(|(name, value)| {
                format!(
                    "{name} {:.4} ({:.4} to {:.4})",
                    value.value, value.low, value.high
                )
            })
            .collect();
        println!(
            "    {:16} {:.4} fit {:.3} {}",
            cause.effect.name(),
            cause.probability,
            cause.goodness_of_fit.unwrap_or(f64::NAN),
            sizes.join(", ")
        );
    }
}
