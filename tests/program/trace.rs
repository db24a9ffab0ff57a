//! Every number that a run shows comes from report.json: on the terminal, on the page, in its pictures and in the tables.

use serde_json::Value;
use std::fs;
use std::path::Path;

use super::browser::unpacked;

/// Units of what is shown over SI units: per cent and degrees apart, by thousands.
const FACTORS: [f64; 6] = [1.0, 100.0, 1e3, 1e-3, 1e-6, 1e-9];
/// Shorter numbers would be found by chance.
const LEAST_DIGITS: usize = 4;
/// Longer lists are curves and clouds: their values are drawn, not written.
const LONGEST_LIST: usize = 40;
/// Numbers with a changed digit that may be found: by chance one in ten is.
const MOST_BY_CHANCE: f64 = 0.25;

/// What report.json holds.
struct Fields {
    /// All numbers in all units, ascending.
    numbers: Vec<f64>,
    /// All numbers in its sentences.
    said: Vec<String>,
}

impl Fields {
    fn of(report: &Value) -> Self {
        let mut fields = Fields {
            numbers: Vec::new(),
            said: Vec::new(),
        };
        fields.add(report);
        fields.numbers.sort_by(f64::total_cmp);
        fields
    }

    fn add(&mut self, value: &Value) {
        match value {
            Value::Object(map) => map.values().for_each(|one| self.add(one)),
            Value::Array(list) => {
                let is_curve = list.len() > LONGEST_LIST && list.iter().all(Value::is_number);
                list.iter()
                    .filter(|_| !is_curve)
                    .for_each(|one| self.add(one));
            }
            Value::Number(number) => {
                let number = number.as_f64().unwrap().abs();
                self.numbers.extend(FACTORS.map(|factor| factor * number));
            }
            Value::String(text) => self.said.extend(numbers(text)),
            Value::Null | Value::Bool(_) => {}
        }
    }

    /// True if a number, as it is written, is a field rounded to as many digits.
    fn holds(&self, written: &str) -> bool {
        let (digits, exponent) = written.split_once('e').unwrap_or((written, "0"));
        let decimals = digits.split_once('.').map_or(0, |(_, tail)| tail.len());
        let exponent: i32 = exponent.parse().unwrap();
        // A part more: halves are rounded either way.
        let half = 0.500_001 * 10f64.powi(exponent - decimals as i32);
        let value: f64 = written.parse().unwrap();
        let from = self.numbers.partition_point(|known| *known < value - half);
        let near = self
            .numbers
            .get(from)
            .is_some_and(|known| *known <= value + half);
        near || self.said.iter().any(|said| said == written)
    }
}

/// Numbers in a text without their signs, those with enough digits.
fn numbers(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '.' || c == '_'));
    let words = words.map(|word| word.trim_matches('.'));
    let numbers = words.filter(|word| {
        let plain = word
            .bytes()
            .all(|byte| byte.is_ascii_digit() || b".e".contains(&byte));
        plain && word.starts_with(|c: char| c.is_ascii_digit()) && word.parse::<f64>().is_ok()
    });
    let long = numbers.filter(|word| {
        let digits = word.split('e').next().unwrap_or_default();
        let counted = match digits.contains('.') {
            true => digits,
            // The zeros of 1140 may stand for digits that were left out.
            false => digits.trim_end_matches('0'),
        };
        let counted = counted.replace('.', "");
        counted.trim_start_matches('0').len() >= LEAST_DIGITS
    });
    long.map(str::to_owned).collect()
}

/// The number with its last digit but one changed.
fn changed(number: &str) -> String {
    let digits = number.find('e').unwrap_or(number.len());
    let places = number[..digits].char_indices();
    let places: Vec<usize> = places
        .filter(|(_, c)| c.is_ascii_digit())
        .map(|(at, _)| at)
        .collect();
    let at = places[places.len() - 2];
    let digit = number[at..=at].parse::<u8>().unwrap();
    format!("{}{}{}", &number[..at], (digit + 4) % 10, &number[at + 1..])
}

/// The text that a page shows, and all words of its pictures.
fn shown(page: &str) -> String {
    let mut text = String::new();
    let mut rest = page;
    while let Some((before, after)) = rest.split_once('<') {
        text.push_str(before);
        text.push(' ');
        let name = after
            .split(|c: char| !c.is_ascii_alphanumeric())
            .next()
            .unwrap();
        let end = format!("</{name}>");
        rest = match name {
            "script" if after.starts_with("script type=\"text/plain\"") => {
                let (data, tail) = after.split_once('>').unwrap().1.split_once(&end).unwrap();
                words_of(&unpacked(data), &mut text);
                tail
            }
            "script" | "style" | "svg" => after.split_once(&end).map_or("", |(_, tail)| tail),
            _ => after.split_once('>').map_or("", |(_, tail)| tail),
        };
    }
    text + rest
}

/// Adds all words of a picture: names of series, of points and of marks.
fn words_of(picture: &Value, text: &mut String) {
    match picture {
        Value::Object(map) => map.values().for_each(|one| words_of(one, text)),
        Value::Array(list) => list.iter().for_each(|one| words_of(one, text)),
        Value::String(words) => {
            text.push_str(words);
            text.push(' ');
        }
        Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}

/// Numbers of a run that report.json does not hold, each with where it was shown, and the share of changed numbers that
/// it does hold.
fn untraced(folder: &Path, test: &str) -> (Vec<String>, f64) {
    let terminal = super::tapjoint(folder, &["run", test, "--out", "r", "--full"], 0);
    let read = |name: &str| fs::read_to_string(folder.join("r").join(name)).unwrap();
    let fields = Fields::of(&serde_json::from_str(&read("report.json")).unwrap());
    let mut shown = vec![
        ("terminal".to_owned(), terminal),
        ("page".to_owned(), shown(&read("report.html"))),
    ];
    for table in [
        "modes.csv",
        "parameters.csv",
        "perturbation.csv",
        "taps.csv",
    ] {
        shown.push((table.to_owned(), read(table)));
    }
    let (mut missing, mut all, mut by_chance) = (Vec::new(), 0, 0);
    for (place, text) in &shown {
        let found = numbers(text);
        assert!(found.len() > 10, "{place} of {test} shows {found:?}");
        all += found.len();
        by_chance += found
            .iter()
            .filter(|number| fields.holds(&changed(number)))
            .count();
        let lost = found.iter().filter(|number| !fields.holds(number));
        missing.extend(lost.map(|number| format!("{place}: {number}")));
    }
    (missing, by_chance as f64 / all as f64)
}

#[test]
fn prop_every_number_shown_is_a_field_of_the_report() {
    let folder = super::samples();
    for test in ["cantilever", "lap-joint"] {
        let file = format!("recordings/{test}/test.toml");
        let (mut missing, by_chance) = untraced(folder.path(), &file);
        // A coherence that rounds to one is shown by its limit.
        missing.retain(|one| one != "page: 0.9999");
        assert!(
            missing.is_empty(),
            "{test}: not in report.json: {missing:#?}"
        );
        // Else the test would find whatever is shown.
        assert!(by_chance < MOST_BY_CHANCE, "{test}: {by_chance}");
    }
}
