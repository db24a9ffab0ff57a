//! A blind check: planted against most probable classes, stated against real probabilities, and how far the gap
//! closes on withheld data.

use std::collections::BTreeMap;

use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::Verdict;
use tapjoint_study::blind_check::{Calibration, Case, CaseKind, Class};

use super::super::chart::{Axis, Block, Chart, Color, Mark, Panel, Series};

/// Width of the square pictures (pixels).
const WIDTH: u32 = 900;
/// Height of a class in the confusion matrix (pixels).
const CELL: f64 = 34.0;
/// Closures below this are drawn at it: an effect that makes things much worse.
const LEAST: f64 = -1.0;

/// The confusion matrix: rows are what was planted, columns the most probable class; each cell holds
/// the number of cases, and its shade their share of the row.
pub fn confusion(cases: &[Case]) -> Chart {
    let classes = classes();
    let mut counts = BTreeMap::new();
    for (truth, answer) in cases {
        if let Some((planted, (first, _))) = truth.class().zip(answer.first()) {
            *counts.entry((planted, first)).or_insert(0) += 1;
        }
    }
    let last = classes.len() as f64 - 0.5;
    let names = classes.iter().enumerate();
    let names = names.map(|(at, class)| (at as f64, class.name().to_owned()));
    let x = Axis::linear(-0.5, last).of("most probable class", "");
    let x = x.named(names.clone());
    let y = Axis::linear(-last, 0.5).of("planted", "");
    let y = y.named(names.map(|(at, name)| (-at, name)));
    let mut cells = Series::new("", Color::Blue, Mark::Cell);
    for (row, planted) in classes.iter().enumerate() {
        let own = counts.iter().filter(|((class, _), _)| class == planted);
        let total: usize = own.map(|(_, count)| *count).sum();
        for (column, class) in classes.iter().enumerate() {
            if let Some(count) = counts.get(&(*planted, *class)) {
                cells.push(column as f64, -(row as f64));
                cells.low.push(*count as f64 / total as f64);
                cells.labels.push(count.to_string());
            }
        }
    }
    let panel = Panel::new(CELL * classes.len() as f64, x, y).with([cells]);
    Chart {
        kind: "confusion",
        title: "What was planted, and what came first".to_owned(),
        subtitle:
            "rows: planted; columns: the most probable class; tests with two effects are left out"
                .to_owned(),
        blocks: vec![Block::new(1, vec![panel])],
        ..Chart::default()
    }
}

/// All classes in the catalogue's order, each group once; `resolution` shares its group.
pub(crate) fn classes() -> Vec<Class> {
    let mut classes = vec![Class::None];
    for id in EffectId::ALL {
        let class = Class::Group(id.group());
        if id != EffectId::JointDrift && !classes.contains(&class) {
            classes.push(class);
        }
    }
    classes.push(Class::Unknown);
    classes
}

/// The reliability diagram: on the diagonal a stated probability is the share of right answers.
pub fn reliability(calibration: &Calibration) -> Chart {
    let [ece, brier] = [calibration.expected_calibration_error, calibration.brier]
        .map(|value| value.map_or("-".to_owned(), |value| format!("{value:.3}")));
    let bins = calibration.reliability.iter();
    let known = bins.filter_map(|bin| Some((bin.stated?, bin.right?, bin.cases)));
    let places = known.clone().map(|(stated, right, _)| (stated, right));
    let mut dots = Series::points("", Color::Blue, Mark::Dot(6.0), places);
    dots.labels = known.map(|(_, _, cases)| cases.to_string()).collect();
    let diagonal = [(0.0, 0.0), (1.0, 1.0)];
    let diagonal = Series::points("", Color::Soft, Mark::Dashed(1.5), diagonal);
    let x = Axis::linear(0.0, 1.0).of("stated probability of the first class", "1");
    let y = Axis::linear(0.0, 1.05).of("share of right answers", "1");
    Chart {
        kind: "reliability",
        title: "How far the stated probabilities can be trusted".to_owned(),
        subtitle: format!(
            "expected calibration error {ece}, Brier score {brier}; numbers: cases in the bin"
        ),
        width: WIDTH,
        blocks: vec![Block::new(
            1,
            vec![Panel::new(470.0, x, y).with([diagonal, dots])],
        )],
        ..Chart::default()
    }
}

/// Closures of all named tests with one effect, sorted, for right and for wrong names; `None` without any.
pub fn closure(cases: &[Case]) -> Option<Chart> {
    let mut series = Vec::new();
    for (name, color, right) in [
        ("right name", Color::Blue, true),
        ("wrong name", Color::Vermilion, false),
    ] {
        let values = closures(cases, right);
        let count = values.len() as f64;
        let places = values.iter().enumerate();
        let places = places.map(|(at, value)| ((at as f64 + 0.5) / count, value.max(LEAST)));
        let places: Vec<(f64, f64)> = places.collect();
        let name = format!("{name} ({} tests)", values.len());
        series.push(Series::points(
            "",
            color,
            Mark::Line(1.2),
            places.iter().copied(),
        ));
        series.push(Series::points(&name, color, Mark::Dot(3.5), places));
    }
    let x = Axis::linear(0.0, 1.0).of("share of tests", "1");
    let y = Axis::linear(LEAST - 0.05, 1.1).of("closure", "1");
    let panel = Panel::new(450.0, x, y).with(series);
    (!panel.series.is_empty()).then(|| Chart {
        kind: "closure",
        title: "How far the named effect closes the gap on withheld data".to_owned(),
        subtitle:
            "1 = down to the noise, 0 = not at all; tests sorted by closure; one effect planted"
                .to_owned(),
        width: WIDTH,
        blocks: vec![Block::new(1, vec![panel])],
        ..Chart::default()
    })
}

fn closures(cases: &[Case], right: bool) -> Vec<f64> {
    let closures = cases.iter().filter_map(|(truth, answer)| {
        let CaseKind::Single(id) = truth.kind() else {
            return None;
        };
        let named = matches!(answer.verdict, Some(Verdict::Named(_)));
        let is_right = answer.named_groups() == [id.group()];
        answer.closure.filter(|_| named && is_right == right)
    });
    let mut values: Vec<f64> = closures.collect();
    values.sort_by(f64::total_cmp);
    values
}
