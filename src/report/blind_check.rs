//! The files of a blind check: its score as JSON, every case as CSV, the truths that were sealed, and
//! pictures. And the table of what a planned test could tell apart.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::data_files::write;
use crate::picture::{Axis, Block, Chart, Color, Mark, Panel, PictureFormat, Series};
use crate::run::picture_files;
use crate::{ReportError, ReportFile};
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::Verdict;
use tapjoint_study::blind_check::{
    Calibration, Case, CaseKind, Class, Conduct, Planted, Row, Scores, Target, Truth, render_rows,
    rows, score,
};

/// Width of the square pictures (pixels).
const WIDTH: u32 = 900;
/// Height of a class in the confusion matrix (pixels).
const CELL: f64 = 34.0;
/// Closures below this are drawn at it: an effect that makes things much worse.
const LEAST: f64 = -1.0;

/// All files: `score.json`, `cases.csv`, `truth.json`, and as PNG and SVG `confusion`, `reliability`,
/// `closure`.
///
/// # Errors
/// The first that cannot be made.
pub fn render_blind_check(
    cases: &[Case],
    scores: &Scores,
    conduct: &Conduct,
) -> Result<Vec<ReportFile>, ReportError> {
    let truths: Vec<Truth> = cases.iter().map(|(truth, _)| truth.clone()).collect();
    let score =
        serde_json::to_string_pretty(&score_json(scores, conduct)).map_err(ReportError::Json)?;
    let mut files = vec![
        ReportFile::of("score.json", score + "\n"),
        ReportFile::of("cases.csv", cases_csv(cases)?),
        ReportFile::of("truth.json", truths_json(&truths)?),
    ];
    let charts = [
        Some(confusion(cases)),
        Some(reliability(&scores.calibration)),
        closure(cases),
    ];
    for chart in charts.into_iter().flatten() {
        files.extend(picture_files(chart.kind, &chart.draw())?);
    }
    Ok(files)
}

/// The confusion matrix as a picture.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_confusion_picture(
    cases: &[Case],
    format: PictureFormat,
) -> Result<Vec<u8>, ReportError> {
    confusion(cases).render(format)
}

/// The truths as a list of `{"name", "effects", "params"}`, one line for each.
///
/// # Errors
/// [`ReportError::Json`], which does not happen for finite parameters.
pub fn truths_json(truths: &[Truth]) -> Result<String, ReportError> {
    let mut lines = Vec::new();
    for truth in truths {
        let names: Vec<&str> = truth.effects.iter().map(name_of).collect();
        let params = truth.catalogue();
        let params: serde_json::Map<String, Value> = params
            .map(|(id, values)| (id.name().to_owned(), json!(values)))
            .collect();
        let mut entry = json!({"name": truth.name, "effects": names, "params": params});
        for (name, known) in [
            ("detectable", truth.detectable),
            ("refutable", truth.refutable),
            ("within_tolerance", truth.within_tolerance),
        ] {
            if let Some(known) = known {
                entry[name] = json!(known);
            }
        }
        lines.push(serde_json::to_string(&entry).map_err(ReportError::Json)?);
    }
    Ok(format!("[\n{}\n]\n", lines.join(",\n")))
}

fn name_of(planted: &Planted) -> &str {
    match planted {
        Planted::Catalogue(id, _) => id.name(),
        Planted::OutOfCatalogue(name) => name,
    }
}

/// The score: every figure with its interval, its counts, what was aimed at and what an ideal observer reaches; and how
/// the check was conducted.
pub fn score_json(scores: &Scores, conduct: &Conduct) -> Value {
    let figures = figures_json(&rows(scores, conduct.extent));
    let [nulls, singles, several, outside] = scores.counts;
    let reliability: Vec<Value> = scores
        .calibration
        .reliability
        .iter()
        .map(|bin| json!({"from": bin.from, "cases": bin.cases, "stated": bin.stated, "right": bin.right}))
        .collect();
    let mut score = json!({
        "version": crate::document::VERSION,
        "cases": {"none": nulls, "one": singles, "several": several, "outside": outside},
        "figures": figures,
        "reliability": reliability,
    });
    // A plan seals and renames nothing.
    if *conduct != Conduct::default() {
        score["commitment"] = json!(conduct.commitment);
        score["mutations"] = json!({
            "shuffled_top_1": conduct.shuffled,
            "always_scale_top_1": conduct.always_scale,
            "renamed_same_answer": conduct.renamed,
        });
    }
    score
}

/// The figures by key, each with its interval, its counts, what was aimed at and what an ideal observer reaches.
pub(crate) fn figures_json(rows: &[Row]) -> Value {
    let mut figures = serde_json::Map::new();
    for row in rows {
        let target = match row.target {
            Target::AtLeast(limit) => json!({"at_least": limit}),
            Target::AtMost(limit) => json!({"at_most": limit}),
            Target::None => Value::Null,
        };
        let figure = json!({
            "meaning": row.meaning,
            "value": row.value.filter(|value| value.is_finite()),
            "low": row.interval.map(|interval| interval.0),
            "high": row.interval.map(|interval| interval.1),
            "hits": row.counts.map(|counts| counts.0),
            "of": row.counts.map(|counts| counts.1),
            "target": target,
            "ideal": row.ideal,
        });
        figures.insert(row.key.to_owned(), figure);
    }
    Value::Object(figures)
}

/// Every case: what was planted, what was answered.
fn cases_csv(cases: &[Case]) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for (truth, answer) in cases {
        let planted: Vec<&str> = truth.effects.iter().map(name_of).collect();
        let named: Vec<&str> = answer.effects.iter().map(|id| id.name()).collect();
        let first = answer.first();
        let known = [truth.detectable, truth.refutable, truth.within_tolerance];
        let [detectable, refutable, within_tolerance] = known.map(|known| match known {
            Some(true) => "yes".to_owned(),
            Some(false) => "no".to_owned(),
            None => String::new(),
        });
        let closure = answer.closure;
        rows.push(vec![
            truth.name.clone(),
            planted.join("+"),
            detectable,
            refutable,
            answer.verdict_name().to_owned(),
            named.join("+"),
            first.map_or("", |(class, _)| class.name()).to_owned(),
            first.map_or_else(String::new, |(_, p)| format!("{p:.4}")),
            closure.map_or_else(String::new, |closure| format!("{closure:.4}")),
            within_tolerance,
        ]);
    }
    let heads = "name,planted,detectable,refutable,verdict,named,first,probability,closure,within_tolerance";
    write(heads, rows)
}

/// Meaning of the columns of [`tell_apart`].
const EXPLAINED: &str = "first: the diagnosis puts its kind first; named: the verdict gives it as the\n\
                         answer (of none: \"no-gap\"); else first: what came first instead, how often.\n";

/// For each kind of effect: how often it came first, how often it was named, and what came first
/// instead; then the figures of what was drawn. What a blind check of whole tests aims at is no target here.
pub fn tell_apart(cases: &[Case]) -> String {
    let mut text = format!(
        "{:<20}{:>7}{:>8}  {}\n",
        "planted", "first", "named", "else first"
    );
    for class in classes() {
        let own: Vec<&Case> = cases
            .iter()
            .filter(|(truth, _)| truth.class() == Some(class))
            .collect();
        if own.is_empty() {
            continue;
        }
        let first = own
            .iter()
            .filter(|(_, answer)| answer.first().is_some_and(|found| found.0 == class))
            .count();
        let named = own
            .iter()
            .filter(|(_, answer)| match answer.verdict {
                Some(Verdict::NoGap) => class == Class::None,
                _ => {
                    let mut groups = answer.named_groups().into_iter();
                    answer.is_name() && groups.any(|group| Class::Group(group) == class)
                }
            })
            .count();
        // "cross-coupling 2, none 1".
        let mut others: BTreeMap<Class, usize> = BTreeMap::new();
        let instead = own.iter().filter_map(|(_, answer)| answer.first());
        for (other, _) in instead.filter(|(other, _)| *other != class) {
            *others.entry(other).or_insert(0) += 1;
        }
        let others = others.iter();
        let others = others.map(|(other, count)| format!("{} {count}", other.name()));
        let line = format!(
            "{:<20}{:>7}{:>8}  {}",
            class.name(),
            format!("{first}/{}", own.len()),
            format!("{named}/{}", own.len()),
            others.collect::<Vec<_>>().join(", ")
        );
        text.push_str(line.trim_end());
        text.push('\n');
    }
    let mut figures = rows(&score(cases), None);
    figures.retain(|row| row.value.is_some());
    for row in &mut figures {
        row.target = Target::None;
    }
    format!("{text}{EXPLAINED}\n{}", render_rows(&figures))
}

/// The confusion matrix of all tests with one right class.
fn confusion(cases: &[Case]) -> Chart {
    let classes = classes();
    let index = |class: Class| classes.iter().position(|own| *own == class);
    let counted = cases
        .iter()
        .filter_map(|(truth, answer)| Some((index(truth.class()?)?, index(answer.first()?.0)?)));
    let names = classes.iter().map(Class::name).collect();
    Confusion::of(names, counted).chart(
        "What was planted, and what came first",
        "rows: planted; columns: the most probable class; tests with two effects are left out",
        ["planted", "most probable class"],
    )
}

/// Counts of what was true and what came first, by indices of classes.
pub(crate) struct Confusion {
    classes: Vec<&'static str>,
    counts: BTreeMap<(usize, usize), usize>,
}

impl Confusion {
    /// Counts cases: the index of the true class and of the one that came first.
    pub(crate) fn of(
        classes: Vec<&'static str>,
        cases: impl Iterator<Item = (usize, usize)>,
    ) -> Self {
        let mut counts = BTreeMap::new();
        for case in cases {
            *counts.entry(case).or_insert(0) += 1;
        }
        Self { classes, counts }
    }

    /// The matrix as a picture: rows are what was true, columns what came first; each cell holds the number of cases, and its
    /// shade their share of the row. `axes` names rows and columns.
    pub(crate) fn chart(&self, title: &str, subtitle: &str, axes: [&str; 2]) -> Chart {
        let last = self.classes.len() as f64 - 0.5;
        let names = self.classes.iter().enumerate();
        let names = names.map(|(at, name)| (at as f64, (*name).to_owned()));
        let x = Axis::linear(-0.5, last)
            .of(axes[1], "")
            .named(names.clone());
        let y = Axis::linear(-last, 0.5)
            .of(axes[0], "")
            .named(names.map(|(at, name)| (-at, name)));
        let mut cells = Series::new("", Color::Blue, Mark::Cell);
        for (&(row, column), count) in &self.counts {
            let own = self.counts.iter().filter(|((other, _), _)| *other == row);
            let total: usize = own.map(|(_, count)| *count).sum();
            cells.push(column as f64, -(row as f64));
            cells.low.push(*count as f64 / total as f64);
            cells.labels.push(count.to_string());
        }
        let panel = Panel::new(CELL * self.classes.len() as f64, x, y).with([cells]);
        Chart {
            kind: "confusion",
            title: title.to_owned(),
            subtitle: subtitle.to_owned(),
            blocks: vec![Block::new(1, vec![panel])],
            ..Chart::default()
        }
    }
}

/// All classes in the catalogue's order, each group once; `resolution` shares its group.
fn classes() -> Vec<Class> {
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
fn reliability(calibration: &Calibration) -> Chart {
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
fn closure(cases: &[Case]) -> Option<Chart> {
    let mut series = Vec::new();
    for (name, color, right) in [
        ("right name", Color::Blue, true),
        ("wrong name", Color::Vermilion, false),
    ] {
        let values = cases.iter().filter_map(|(truth, answer)| {
            let CaseKind::Single(id) = truth.kind() else {
                return None;
            };
            let is_right = answer.named_groups() == [id.group()];
            answer
                .closure
                .filter(|_| answer.is_name() && is_right == right)
        });
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
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
