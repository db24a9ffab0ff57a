//! How often the 95 % intervals of a joint hold the truth where the description is not exact.
//!
//! Each line of the table is a cell: structures whose beam, attached masses and model differ from the description as the
//! stated standard uncertainties say. It has the number of intervals, the share that holds the truth with its 95 % limits
//! (Wilson), and the median length over that of a fit that knows the size of the discrepancies. `exact` has none of these,
//! `missing` has up to 1 %, with heavy tails. In `outlier` one mode is off by 0.3 to 5 %. Where the theory takes notice of the
//! width, the joint of a cantilever holds it anywhere between springs and a clamp; `wide` beams feel that most.
//!
//! The second table is about outlying modes. "Beyond 5": the planted mode lies more than 5 standard deviations off. Of
//! these tests it has three shares. Found: this mode alone is named. Among: it is one of those named. Ideal: an
//! observer who knows the distributions finds it most probable. The other columns are of all tests: the mean number of
//! modes named together, the share in which only others are named, and how often the final limits hold the truth. In
//! brackets: the same of the tests beyond 5.
//!
//! The third table (`--world effect`, cantilevers) is of descriptions that lack one effect. Each row is one effect and
//! one range of its size (`--kind`: one effect alone). It has how often the effect is named. It also has how often the
//! headline and the described model's interval hold Kt and Kr.
//!
//! `cargo run --release --example description_coverage -- [--tests N] [--seed S] [--world NAME] [--kind NAME] [--section NAME]`
//!
//! `--tests`: tests of each cell (200; 1000 for a verdict).

use rayon::prelude::*;
use tapjoint::effects::EffectId;

mod effects;
mod worlds;
use effects::{EffectAnswer, Named, PLANTED, effect_answers};
use worlds::{Answer, Kind, OutlierAnswer, Section, World, answers, outlier_answers};

const USAGE: &str = "usage: description_coverage [--tests N] [--seed S] [--world NAME] [--kind NAME] \
                     [--section NAME]";
/// Tests that share a seed: the answer does not depend on the number of threads.
const CHUNK: usize = 25;

fn main() -> Result<(), String> {
    let (mut tests, mut seed) = (200usize, 1u64);
    let (mut world, mut kind, mut section) = (None, None, None);
    let mut given = std::env::args().skip(1);
    while let Some(name) = given.next() {
        let value = given.next().ok_or(USAGE)?;
        match name.as_str() {
            "--tests" => tests = value.parse().map_err(|_| USAGE)?,
            "--seed" => seed = value.parse().map_err(|_| USAGE)?,
            "--world" => world = Some(value),
            "--kind" => kind = Some(value),
            "--section" => section = Some(value),
            _ => return Err(USAGE.to_owned()),
        }
    }
    let mut cells = Vec::new();
    for of_world in World::ALL {
        for of_kind in Kind::ALL {
            for of_section in Section::ALL {
                let wanted = [
                    (&world, of_world.name()),
                    (&kind, of_kind.name()),
                    (&section, of_section.name()),
                ];
                let mut wanted = wanted.into_iter();
                if wanted.all(|(wanted, name)| wanted.as_deref().is_none_or(|one| one == name)) {
                    cells.push((of_world, of_kind, of_section));
                }
            }
        }
    }
    println!("world        kind  section     quantity  intervals  inside (%)              length");
    for &(world, kind, section) in &cells {
        // An outlying mode has a table of its own.
        if world != World::Outlier {
            print_cell(world, kind, section, tests, seed);
        }
    }
    println!(
        "\nworld        kind  section     tests  beyond 5  found (%)  among (%)  ideal (%)  modes in a set  \
         named wrongly (%)  inside (%)"
    );
    for (world, kind, section) in cells {
        if [World::Normal, World::Missing, World::Outlier].contains(&world) {
            print_outliers(world, kind, section, tests, seed);
        }
    }
    if world.as_deref().is_none_or(|name| name == "effect") {
        println!(
            "\neffect          moves (%)     tests  named (%)  wrongly (%)  headline holds Kt, Kr (%)  described model (%)"
        );
        for planted in PLANTED {
            let name = planted.map_or("none", |planted| planted.name());
            if kind.as_deref().is_none_or(|kind| kind == name) {
                print_effect(planted, tests, seed);
            }
        }
    }
    Ok(())
}

fn print_cell(world: World, kind: Kind, section: Section, tests: usize, seed: u64) {
    let chunks = (0..tests.div_ceil(CHUNK)).into_par_iter();
    let chunks: Vec<Vec<Answer>> = chunks
        .map(|chunk| {
            let count = CHUNK.min(tests - chunk * CHUNK);
            answers(kind, section, world, count, seed * 1_000_003 + chunk as u64)
        })
        .collect();
    for quantity in kind.quantities() {
        let own = chunks
            .iter()
            .flatten()
            .filter(|answer| answer.quantity == *quantity);
        let own: Vec<&Answer> = own.collect();
        let holds = own.iter().filter(|answer| answer.holds).count();
        let mut lengths: Vec<f64> = own.iter().filter_map(|answer| answer.length).collect();
        lengths.sort_by(f64::total_cmp);
        let median = lengths.get(lengths.len() / 2).copied().unwrap_or(f64::NAN);
        let (low, high) = wilson(holds, own.len());
        println!(
            "{:11}  {:4}  {:10}  {:8}  {:9}  {:5.1} ({:5.1} to {:5.1})  {median:8.2}",
            world.name(),
            kind.name(),
            section.name(),
            quantity.name(),
            own.len(),
            100.0 * holds as f64 / own.len().max(1) as f64,
            100.0 * low,
            100.0 * high,
        );
    }
}

/// Root mean squares of the changes of the frequencies (%) that part small, middle and large effects.
const MOVES: [f64; 4] = [0.0, 0.1, 0.5, f64::INFINITY];

fn print_effect(planted: Option<EffectId>, tests: usize, seed: u64) {
    let chunks = (0..tests.div_ceil(CHUNK)).into_par_iter();
    let chunks: Vec<Vec<EffectAnswer>> = chunks
        .map(|chunk| {
            let count = CHUNK.min(tests - chunk * CHUNK);
            effect_answers(planted, count, seed * 1_000_003 + chunk as u64)
        })
        .collect();
    for range in MOVES.windows(2) {
        let all = chunks.iter().flatten();
        let own: Vec<&EffectAnswer> = all
            .filter(|answer| (range[0]..range[1]).contains(&answer.moved_percent))
            .collect();
        if own.is_empty() {
            continue;
        }
        let share = |count: usize| 100.0 * count as f64 / own.len() as f64;
        let of = |named: Named| share(own.iter().filter(|answer| answer.named == named).count());
        let headline =
            [0, 1].map(|k| share(own.iter().filter(|one| one.headline_holds[k]).count()));
        let described =
            [0, 1].map(|k| share(own.iter().filter(|one| one.described_holds[k]).count()));
        println!(
            "{:14}  {:4} to {:4}  {:5}  {:9.1}  {:11.1}  {:12.1} {:12.1}  {:9.1} {:9.1}",
            planted.map_or("none", |planted| planted.name()),
            range[0],
            range[1],
            own.len(),
            of(Named::Rightly),
            of(Named::Wrongly),
            headline[0],
            headline[1],
            described[0],
            described[1],
        );
    }
}

fn print_outliers(world: World, kind: Kind, section: Section, tests: usize, seed: u64) {
    let chunks = (0..tests.div_ceil(CHUNK)).into_par_iter();
    let chunks: Vec<Vec<OutlierAnswer>> = chunks
        .map(|chunk| {
            let count = CHUNK.min(tests - chunk * CHUNK);
            let seed = seed * 1_000_003 + chunk as u64;
            outlier_answers(kind, section, world, count, seed)
        })
        .collect();
    let (mut beyond, mut found, mut among, mut ideal) = (0, 0, 0, 0);
    let (mut wrong, mut alarms, mut named, mut all) = (0, 0, 0, 0);
    for answer in chunks.iter().flatten() {
        all += 1;
        let planted = answer.planted.map(|(mode, _)| mode);
        let is_among = planted.is_some_and(|mode| answer.named.contains(&mode));
        if answer
            .planted
            .is_some_and(|(_, deviations)| deviations > 5.0)
        {
            beyond += 1;
            among += usize::from(is_among);
            found += usize::from(is_among && answer.named.len() == 1);
            ideal += usize::from(answer.ideal == planted);
        }
        alarms += usize::from(!answer.named.is_empty());
        named += answer.named.len();
        wrong += usize::from(!answer.named.is_empty() && !is_among);
    }
    let share = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    print!(
        "{:11}  {:4}  {:10}  {all:5}  {beyond:8}  {:9.1}  {:9.1}  {:9.1}  {:13.2}  {:17.1} ",
        world.name(),
        kind.name(),
        section.name(),
        share(found, beyond),
        share(among, beyond),
        share(ideal, beyond),
        named as f64 / alarms.max(1) as f64,
        share(wrong, all),
    );
    for quantity in kind.quantities() {
        let shares = [f64::NEG_INFINITY, 5.0].map(|least| {
            let tests = chunks.iter().flatten();
            let tests = tests.filter(|test| test.planted.map_or(least < 0.0, |one| one.1 > least));
            let answers = tests.flat_map(|test| &test.answers);
            let own: Vec<bool> = answers
                .filter(|answer| answer.quantity == *quantity)
                .map(|answer| answer.holds)
                .collect();
            share(own.iter().filter(|holds| **holds).count(), own.len())
        });
        print!(" {} {:.1} ({:.1})", quantity.name(), shares[0], shares[1]);
    }
    println!();
}

/// Wilson's 95 % limits of a share.
fn wilson(holds: usize, count: usize) -> (f64, f64) {
    const NORMAL_95: f64 = 1.96;
    let n = count.max(1) as f64;
    let share = holds as f64 / n;
    let square = NORMAL_95 * NORMAL_95 / n;
    let centre = share + 0.5 * square;
    let half = NORMAL_95 * (share * (1.0 - share) / n + 0.25 * square / n).sqrt();
    (
        (centre - half) / (1.0 + square),
        (centre + half) / (1.0 + square),
    )
}
