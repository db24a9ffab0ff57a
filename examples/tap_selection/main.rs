//! How often the choice of consistent taps takes out wrong hits, and how often right ones.
//!
//! `cargo run --release --example tap_selection -- [--trials N]`

mod hits;

use hits::{LENGTH, Trial, held, inconsistent, taps, warns};
use rayon::prelude::*;
use tapjoint::description::TapSelection;
use tapjoint::structure::effects::JointLaw;

/// Runs trials of one kind. `wrong` are the taps that ought to go.
fn report(name: &str, trials: u64, wrong: &[usize], make: impl Fn(u64) -> Trial + Sync) {
    let found: Vec<(usize, usize, usize, usize, bool)> = (0..trials)
        .into_par_iter()
        .map(|seed| {
            let trial = make(seed);
            let analysis = trial.analysis(TapSelection::Consistent);
            let out = inconsistent(&analysis);
            let hit = out.iter().filter(|tap| wrong.contains(tap)).count();
            let used = taps(&analysis).iter().filter(|tap| tap.accepted()).count();
            (
                used + out.len(),
                hit,
                out.len() - hit,
                wrong.len(),
                warns(&analysis, "taps-disagree"),
            )
        })
        .collect();
    let sum =
        |f: fn(&(usize, usize, usize, usize, bool)) -> usize| found.iter().map(f).sum::<usize>();
    let (all, hit, false_ones, wrong) = (sum(|x| x.0), sum(|x| x.1), sum(|x| x.2), sum(|x| x.3));
    println!(
        "{name:34} {all:6} taps  wrong found {hit:4}/{wrong:<4}  right rejected {false_ones:4} ({:.2} %)  warned {}",
        100.0 * false_ones as f64 / (all - wrong).max(1) as f64,
        found.iter().filter(|x| x.4).count()
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
        for scatter in [0.0005, 0.002, 0.005] {
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
