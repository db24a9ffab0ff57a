//! How often the choice of consistent taps takes out wrong hits, and how often right ones.
//!
//! `cargo run --release --example tap_selection -- [--trials N] [NAME]`. NAME runs only the kinds whose names hold it. The figures in
//! `docs/decisions.md` are those of `--trials 60`.

mod hits;

use hits::{LENGTH, Trial, held, inconsistent, taps, warns};
use rayon::prelude::*;
use tapjoint::description::TapSelection;
use tapjoint::structure::effects::JointLaw;
use tapjoint::taps::Rejection;

/// What was found in one trial.
struct Found {
    /// Taps that were compared.
    taps: usize,
    /// Wrong taps that were taken out.
    wrong: usize,
    /// Right taps that were taken out.
    right: usize,
    is_warned: bool,
    /// Departures of the wrong taps that were taken out (1).
    departures: Vec<f64>,
}

/// Runs trials of one kind. `wrong` are the taps that ought to go.
fn report(name: &str, trials: u64, wrong: &[usize], make: impl Fn(u64) -> Trial + Sync) {
    let found: Vec<Found> = (0..trials)
        .into_par_iter()
        .map(|seed| {
            let analysis = make(seed).analysis(TapSelection::Consistent);
            let out = inconsistent(&analysis);
            let hit: Vec<usize> = out
                .iter()
                .copied()
                .filter(|tap| wrong.contains(tap))
                .collect();
            let used = taps(&analysis).iter().filter(|tap| tap.accepted()).count();
            let departure = |tap: &usize| match taps(&analysis)[*tap].rejection {
                Some(Rejection::Inconsistent { departure, .. }) => Some(departure),
                _ => None,
            };
            Found {
                taps: used + out.len(),
                wrong: hit.len(),
                right: out.len() - hit.len(),
                is_warned: warns(&analysis, "taps-disagree"),
                departures: hit.iter().filter_map(departure).collect(),
            }
        })
        .collect();
    let all: usize = found.iter().map(|one| one.taps).sum();
    let right: usize = found.iter().map(|one| one.right).sum();
    let hit: usize = found.iter().map(|one| one.wrong).sum();
    let warned = found.iter().filter(|one| one.is_warned).count();
    let planted = wrong.len() * trials as usize;
    let mut departures: Vec<f64> = found.into_iter().flat_map(|one| one.departures).collect();
    departures.sort_by(f64::total_cmp);
    let median = departures.get(departures.len() / 2);
    let median = median.map_or(String::new(), |median| {
        format!("  by {:.0} % in the median", 100.0 * median)
    });
    println!(
        "{name:34} {all:6} taps  wrong found {hit:4}/{planted:<4}{median}  right rejected {right:4} ({:.2} %)  warned {warned}",
        100.0 * right as f64 / (all - planted).max(1) as f64,
    );
}

/// Counts how often intervals of frequencies hold the truth, with all taps and with the consistent ones.
fn coverage(name: &str, trials: u64, make: impl Fn(u64) -> Trial + Sync) {
    for select in [TapSelection::All, TapSelection::Consistent] {
        let held: Vec<bool> = (0..trials)
            .into_par_iter()
            .flat_map(|seed| {
                let trial = make(seed);
                held(&trial.analysis(select), &trial.frequencies())
            })
            .collect();
        println!(
            "coverage {name:25} {select:?}: {:.1} % of {}",
            100.0 * held.iter().filter(|held| **held).count() as f64 / held.len().max(1) as f64,
            held.len()
        );
    }
}

fn main() {
    let mut given = std::env::args().skip(1);
    let mut trials = 20;
    let mut only = String::new();
    while let Some(name) = given.next() {
        match name.as_str() {
            "--trials" => trials = given.next().and_then(|x| x.parse().ok()).expect("a number"),
            _ => only = name,
        }
    }
    let report =
        |name: &str, trials: u64, wrong: &[usize], make: &(dyn Fn(u64) -> Trial + Sync)| {
            if name.contains(&only) {
                report(name, trials, wrong, make);
            }
        };
    for count in [4, 6, 10, 20] {
        for scatter in [0.0005, 0.002, 0.005, 0.01] {
            let name = format!("clean {count} taps, {} mm", 1e3 * scatter);
            report(&name, trials, &[], &|seed| {
                Trial::drawn(count, scatter, seed)
            });
        }
    }
    for count in [4, 6, 10, 20] {
        for away in [0.03, 0.05, 0.1] {
            let wrong: &[usize] = if count < 6 { &[2] } else { &[2, 4] };
            let name = format!("wrong {count} taps, {} %", 100.0 * away);
            report(&name, trials, wrong, &|seed| {
                let mut trial = Trial::drawn(count, 0.001, seed);
                trial.quiet = trial.quiet.max(45.0);
                for &tap in wrong {
                    let away = if trial.hits[tap].place > 0.35 {
                        -away
                    } else {
                        away
                    };
                    trial.hits[tap].place += away * LENGTH;
                }
                trial
            });
        }
    }
    for count in [4, 6, 10] {
        let name = format!("levels of 30 %, wrong {count} taps, 5 %");
        let wrong: &[usize] = if count < 6 { &[2] } else { &[2, 4] };
        report(&name, trials, wrong, &|seed| {
            let mut trial = Trial::drawn(count, 0.001, seed);
            trial.quiet = trial.quiet.max(45.0);
            for hit in &mut trial.hits {
                // From a scatter of 10 % to one of 30 %.
                hit.level = (20.0 + 3.0 * (hit.level - 20.0)).max(4.0);
            }
            for &tap in wrong {
                let is_outside = trial.hits[tap].place > 0.35;
                trial.hits[tap].place += if is_outside { -0.05 } else { 0.05 } * LENGTH;
            }
            trial
        });
    }
    for away in [0.05, 0.1] {
        let name = format!("groups 5:5, {} %", 100.0 * away);
        report(&name, trials, &[], &|seed| {
            let mut trial = Trial::by_hand(10, 0.001, seed);
            trial.hits[5..]
                .iter_mut()
                .for_each(|hit| hit.place -= away * LENGTH);
            trial
        });
    }
    report("sensor 40 %", trials, &[3], &|seed| {
        let mut trial = Trial::by_hand(8, 0.001, seed);
        trial.hits[3].sensor = 0.6;
        trial
    });
    for (ratio, exponent) in [
        (-0.05, 1.0),
        (-0.2, 1.0),
        (-0.4, 1.0),
        (-0.2, 2.0),
        (0.2, 2.0),
    ] {
        let law = JointLaw { ratio, exponent };
        let name = format!("levels 1:3, joint {ratio} {exponent}");
        report(&name, trials / 2, &[], &|seed| {
            let mut trial = Trial::by_hand(8, 0.0005, seed);
            for (tap, hit) in trial.hits.iter_mut().enumerate() {
                hit.level *= (1.0 + 2.0 * (tap * 3 % 8) as f64 / 7.0) / 3.0;
            }
            trial.law = Some(law);
            trial
        });
        let name = format!("two strong of 8, joint {ratio} {exponent}");
        report(&name, trials / 2, &[], &|seed| {
            let mut trial = Trial::by_hand(8, 0.0005, seed);
            for (tap, hit) in trial.hits.iter_mut().enumerate() {
                hit.level *= if tap % 4 == 1 { 1.0 } else { 0.4 };
            }
            trial.law = Some(law);
            trial
        });
    }
    for interval in [0.4, 0.7] {
        report(&format!("overlap {interval} s"), trials, &[], &|seed| {
            let mut trial = Trial::by_hand(10, 0.001, seed);
            trial.interval = interval;
            trial.damping = 0.001;
            trial
        });
    }
    if "coverage".contains(&only) {
        for scatter in [0.0005, 0.005] {
            let name = format!("8 taps, {} mm", 1e3 * scatter);
            coverage(&name, 5 * trials, |seed| Trial::drawn(8, scatter, seed));
        }
        coverage("10 taps, 2 wrong by 5 %", 5 * trials, |seed| {
            let mut trial = Trial::drawn(10, 0.001, seed);
            for tap in [2, 4] {
                let away = if trial.hits[tap].place > 0.35 {
                    -0.05
                } else {
                    0.05
                };
                trial.hits[tap].place += away * LENGTH;
            }
            trial
        });
    }
}
