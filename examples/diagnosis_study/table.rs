//! The scores as text.

use super::record::Record;
use super::score::{BINS, Bin, Calibration, NamedRate, Scores};
use std::collections::BTreeMap;
use tapjoint::study::blind_check::Rate;

/// Prints all scores of all tests.
pub fn print_total(scores: &Scores) {
    println!(
        "all tests: {} tests, {} without a diagnosis, {:.2} s each by the clock",
        scores.tests,
        scores.failed,
        scores.seconds / scores.tests.max(1) as f64
    );
    println!(
        "{:30} {:>11} {:>7}  {:15} {:>6} {:>6}",
        "rate", "hits/cases", "%", "95 % interval", "beside", "ideal"
    );
    for one in &scores.rates {
        println!("{}", rate_line(one));
    }
    println!(
        "mean size of the 90 % list     {}",
        number(scores.list_size, 2)
    );
    println!(
        "closure: median {}, 10th percentile {}, of {} named tests with one, {} without",
        number(scores.closure.median, 2),
        number(scores.closure.tenth_percentile, 2),
        scores.closure.stated,
        scores.closure.nulls
    );
    println!(
        "Brier {} (ideal {}), mean probability of the truth {}, expected calibration error: first class {}, every class {}; ideal, first class {}",
        number(scores.brier, 3),
        number(scores.ideal_brier, 3),
        number(scores.truth_probability, 3),
        number(scores.first.error(), 3),
        number(scores.every.error(), 3),
        number(scores.ideal_first.error(), 3)
    );
    print_reliability(&[&scores.first, &scores.every, &scores.ideal_first]);
}

fn rate_line(one: &NamedRate) -> String {
    let count = format!("{}/{}", one.rate.hits, one.rate.of);
    let interval = one.rate.interval().map_or("-".to_owned(), |(low, high)| {
        format!("{:.1} to {:.1}", 100.0 * low, 100.0 * high)
    });
    format!(
        "{:30} {count:>11} {:>7}  {interval:15} {:>6} {:>6}",
        one.title,
        percent(&one.rate),
        percent(&one.beside_ideal),
        percent(&one.ideal)
    )
}

fn print_reliability(all: &[&Calibration; 3]) {
    let titles = ["first class", "every class", "ideal, first class"];
    let titles = titles.map(|title| format!("{title:36}"));
    println!("\nreliability     {}", titles.join(""));
    let columns = format!("{:36}", " cases  stated   right  95 %").repeat(all.len());
    println!("probability    {columns}");
    for index in 0..BINS {
        println!(
            "{:.1} to {:.1}     {}",
            index as f64 / BINS as f64,
            (index + 1) as f64 / BINS as f64,
            all.map(|one| format!("{:36}", bin(&one.bins[index])))
                .join("")
        );
    }
}

fn bin(bin: &Bin) -> String {
    let interval = bin.rate.interval().map_or("-".to_owned(), |(low, high)| {
        format!("{low:.2} to {high:.2}")
    });
    format!(
        "{:>6} {:>7} {:>7}  {interval:12}",
        bin.rate.of,
        number(bin.stated(), 3),
        number(bin.rate.value(), 3)
    )
}

/// Prints one row of rates for each class.
pub fn print_classes(rows: &[(String, Scores)]) {
    println!(
        "\n{:26} {:>5} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "class (%)",
        "tests",
        "class",
        "group",
        "place",
        "named",
        "right",
        "wrong",
        "null",
        "list",
        "size",
        "Brier"
    );
    for (class, scores) in rows {
        let named = scores.rate("named");
        let right = scores.rate("names_right");
        let wrong = Rate {
            hits: right.of - right.hits,
            of: named.of,
        };
        let right = Rate {
            of: named.of,
            ..right
        };
        println!(
            "{:26} {:>5} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}",
            class,
            scores.tests,
            percent(&scores.rate("first_class_right")),
            percent(&scores.rate("first_group_right")),
            percent(&scores.rate("place_right")),
            percent(&named),
            percent(&right),
            percent(&wrong),
            percent(&scores.rate("nulls_named")),
            percent(&scores.rate("list_holds")),
            number(scores.list_size, 2),
            number(scores.brier, 3)
        );
    }
    println!(
        "class, group: the first of all, of effects, is right; right, wrong: named so, of all tests; null: nulls named; \
         list, size: the 90 % list"
    );
}

/// Prints the verdicts of each class, and what is most often named or first instead of the truth.
pub fn print_verdicts(rows: &[(String, Scores)], records: &[Record]) {
    println!(
        "\n{:26} verdicts; most often first instead of the truth",
        "class"
    );
    for (class, scores) in rows {
        let verdicts = scores.verdicts.iter().filter(|one| one.1 > 0);
        let verdicts: Vec<String> = verdicts
            .map(|(kind, count)| format!("{kind} {count}"))
            .collect();
        let mut others: BTreeMap<String, usize> = BTreeMap::new();
        for record in records.iter().filter(|record| record.class == *class) {
            let outcome = record.answer.as_ref();
            let Some((first, _)) = outcome.and_then(|outcome| outcome.classes.first()) else {
                continue;
            };
            if *first != record.truth {
                *others.entry(first.clone()).or_default() += 1;
            }
        }
        let mut others: Vec<(String, usize)> = others.into_iter().collect();
        others.sort_by_key(|other| std::cmp::Reverse(other.1));
        let others = others.iter().take(4);
        let others: Vec<String> = others
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        println!(
            "{:26} {}; {}",
            class,
            verdicts.join(", "),
            others.join(", ")
        );
    }
}

/// Prints the main rates of parts of the tests.
pub fn print_parts(rows: &[(String, Scores)]) {
    println!(
        "\n{:30} {:>5} {:>18} {:>18} {:>18} {:>18}",
        "tests", "tests", "first group right", "names right", "nulls named", "90 % list"
    );
    for (name, scores) in rows {
        let rates = [
            "first_group_right",
            "names_right",
            "nulls_named",
            "list_holds",
        ];
        let rates = rates.map(|key| {
            let rate = scores.rate(key);
            format!("{}/{} {}", rate.hits, rate.of, percent(&rate))
        });
        println!(
            "{name:30} {:>5} {:>18} {:>18} {:>18} {:>18}",
            scores.tests, rates[0], rates[1], rates[2], rates[3]
        );
    }
}

fn percent(rate: &Rate) -> String {
    number(rate.value().map(|value| 100.0 * value), 1)
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}
