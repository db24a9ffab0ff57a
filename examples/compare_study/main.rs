//! How often a comparison of two tests is right, on drawn pairs of tests (frequencies, not recordings) of many kinds.
//!
//! Every class of changes is a cell. The model is wrong by the tolerances of a description and by one effect that both
//! tests share. The scatter between tests has long tails (Student's with four degrees of freedom), and a part of it
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
//! `--ideal`: the program is told the true structure before the change, with its joint. What it misses then, these frequencies do
//! not tell.
//!
//! `--pairs`: pairs of each cell (20); of `nothing` four times as many. The same seed gives the same answers, whatever the number
//! of threads.

mod series;
mod smallest;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tapjoint::compare::{
    CauseKind, Comparison, MeasuredMode, Pair, Settings, Test, VerdictKind, compare,
};
use tapjoint::study::change_check::{
    ChangeClass, ChangedStructure, SetUpScatter, VISIBLE, chi_square,
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
        let repeatability = SetUpScatter::draw_repeatability(draw);
        let knows = draw.random_range(0..4);
        let repeats = if knows == 2 { 3 } else { 1 };
        let scatter = SetUpScatter {
            repeatability,
            share: 0.5 * draw.random::<f64>(),
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

    /// Returns the true causes; empty for nothing, and for one that the program does not know.
    fn causes(&self) -> Vec<CauseKind> {
        let changes = self.structure.changes.iter();
        changes.filter_map(|change| change.kind()).collect()
    }

    /// Counts whether the intervals of a true single cause hold its sizes: Kt, Kr, mass, position.
    fn count_intervals(&self, found: &Comparison, mut count: impl FnMut(usize, bool)) {
        let [change] = &self.structure.changes[..] else {
            return;
        };
        let kind = change.kind();
        let Some(own) = found.hypotheses.iter().find(|one| Some(one.effect) == kind) else {
            return;
        };
        for (index, name) in ["kt", "kr", "mass", "position"].into_iter().enumerate() {
            let truth = change.parameters.get(name);
            // A mass is told only where it is seen at all.
            let is_told =
                index < 2 || (kind == Some(CauseKind::AddedMass) && self.chi_square > 30.0);
            if let (Some(truth), Some(value), true) = (truth, own.parameters.get(name), is_told) {
                count(index, (value.low..=value.high).contains(truth));
            }
        }
    }
}

struct Row {
    cell: ChangeClass,
    drawn: Drawn,
    found: Comparison,
}

/// Hits among cases.
#[derive(Default, Clone, Copy)]
struct Rate {
    hits: usize,
    cases: usize,
}

impl Rate {
    fn count(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.cases += 1;
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.cases == 0 {
            return write!(f, "-");
        }
        let share = 100.0 * self.hits as f64 / self.cases as f64;
        write!(f, "{share:.1} % ({} of {})", self.hits, self.cases)
    }
}

impl Row {
    fn is_named(&self) -> bool {
        matches!(
            self.found.verdict.kind,
            VerdictKind::Named | VerdictKind::Group
        )
    }

    fn is_right(&self, kind: CauseKind) -> bool {
        self.drawn.causes().iter().any(|own| own.is_like(kind))
    }

    fn first_is_right(&self) -> bool {
        let mut causes = self.found.hypotheses.iter();
        let first = causes.find(|one| one.effect != CauseKind::NoChange);
        first.is_some_and(|first| self.is_right(first.effect))
    }

    /// The list of the answer holds the truth.
    fn holds(&self) -> bool {
        let verdict = &self.found.verdict;
        match verdict.kind {
            VerdictKind::Unknown => true,
            VerdictKind::NoChange => self.drawn.chi_square < VISIBLE,
            _ => verdict
                .effects
                .iter()
                .any(|kind| self.is_right(*kind) || *kind == CauseKind::Unknown),
        }
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
            Some(Row { cell, drawn, found })
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
        let (mut visible, mut first, mut named) =
            (Rate::default(), Rate::default(), Rate::default());
        let (mut wrong, mut list, mut called) = (Rate::default(), Rate::default(), Rate::default());
        for row in own {
            let is_visible = row.drawn.chi_square >= VISIBLE;
            visible.count(is_visible);
            let kinds = &row.found.verdict.effects;
            let is_wrong = row.is_named() && !kinds.iter().any(|kind| row.is_right(*kind));
            wrong.count(is_wrong);
            called.count(row.is_named() || row.found.verdict.kind == VerdictKind::Unknown);
            if is_visible {
                first.count(row.first_is_right());
                named.count(row.is_named());
                list.count(row.holds());
            }
        }
        println!(
            "{:16} {:>20} {:>20} {:>20} {:>20} {:>20} {:>20}",
            cell.name(),
            visible.to_string(),
            first.to_string(),
            named.to_string(),
            wrong.to_string(),
            list.to_string(),
            called.to_string()
        );
    }
    let (mut first, mut wrong) = (Rate::default(), Rate::default());
    let mut held: [Rate; 4] = Default::default();
    let mut bins = [(0.0, Rate::default()); 5];
    for row in rows {
        let is_single = row.drawn.causes().len() == 1;
        if is_single && row.drawn.chi_square >= VISIBLE {
            first.count(row.first_is_right());
            let kinds = &row.found.verdict.effects;
            wrong.count(row.is_named() && !kinds.iter().any(|kind| row.is_right(*kind)));
        }
        row.drawn
            .count_intervals(&row.found, |index, holds| held[index].count(holds));
        // What is stated of the first cause of all.
        let top = &row.found.hypotheses[0];
        let right = match top.effect {
            CauseKind::NoChange => {
                row.drawn.causes().is_empty() && row.cell == ChangeClass::Nothing
            }
            CauseKind::Unknown => row.cell == ChangeClass::Outside,
            kind => row.is_right(kind),
        };
        let together: f64 = row
            .found
            .hypotheses
            .iter()
            .filter(|one| one.effect.is_like(top.effect))
            .map(|one| one.probability)
            .sum();
        let bin = ((together * 5.0) as usize).min(4);
        bins[bin].0 += together;
        bins[bin].1.count(right);
    }
    println!("first cause of visible single changes {first}, named wrongly {wrong}");
    for (name, rate) in ["Kt", "Kr", "mass", "position"].iter().zip(held) {
        println!("95 % interval of {name} holds {rate}");
    }
    for (sum, rate) in bins.iter().filter(|one| one.1.cases > 0) {
        println!("stated {:.3} right {rate}", sum / rate.cases as f64);
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
