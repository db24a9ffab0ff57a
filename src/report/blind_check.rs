//! The files of a blind check: its score as JSON, every case as CSV, the truths that were sealed, and
//! pictures. And the table of what a planned test could tell apart.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::chart::{PictureFormat, render_picture};
use super::charts::blind_check::{classes, closure, confusion, reliability};
use super::{ReportError, ReportFile};
use tapjoint_diagnosis::Verdict;
use tapjoint_study::blind_check::{
    Case, Class, Conduct, Planted, Row, Scores, Target, Truth, render_rows, rows, score,
};

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
    let mut files: Vec<ReportFile> = [
        ("score.json", score + "\n"),
        ("cases.csv", cases_csv(cases)),
        ("truth.json", truths_json(&truths)?),
    ]
    .into_iter()
    .map(|(name, text)| ReportFile {
        name: name.to_owned(),
        bytes: text.into_bytes(),
    })
    .collect();
    let charts = [
        Some(confusion(cases)),
        Some(reliability(&scores.calibration)),
        closure(cases),
    ];
    for chart in charts.into_iter().flatten() {
        let drawing = chart.draw();
        for (ending, format) in [("png", PictureFormat::Png), ("svg", PictureFormat::Svg)] {
            files.push(ReportFile {
                name: format!("{}.{ending}", chart.kind),
                bytes: render_picture(&drawing, format)?,
            });
        }
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
    render_picture(&confusion(cases).draw(), format)
}

/// The truths as a list of `{"name", "effects", "params"}`, one line for each.
///
/// # Errors
/// [`ReportError::Json`], which does not happen for finite parameters.
pub fn truths_json(truths: &[Truth]) -> Result<String, ReportError> {
    let lines = truths
        .iter()
        .map(|truth| serde_json::to_string(&truth_json(truth)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(ReportError::Json)?;
    Ok(format!("[\n{}\n]\n", lines.join(",\n")))
}

fn truth_json(truth: &Truth) -> Value {
    let names: Vec<&str> = truth.effects.iter().map(name_of).collect();
    let params: serde_json::Map<String, Value> = truth
        .catalogue()
        .map(|(id, values)| (id.name().to_owned(), json!(values)))
        .collect();
    let mut entry = json!({"name": truth.name, "effects": names, "params": params});
    let limits = [
        ("detectable", truth.detectable),
        ("refutable", truth.refutable),
    ];
    for (name, known) in limits {
        if let Some(known) = known {
            entry[name] = json!(known);
        }
    }
    entry
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
    let figures: serde_json::Map<String, Value> = rows(scores, conduct.extent)
        .iter()
        .map(|row| (row.key.to_owned(), figure_json(row)))
        .collect();
    let [nulls, singles, several, outside] = scores.counts;
    let reliability: Vec<Value> = scores
        .calibration
        .reliability
        .iter()
        .map(|bin| json!({"from": bin.from, "cases": bin.cases, "stated": bin.stated, "right": bin.right}))
        .collect();
    let mut score = json!({
        "version": super::document::VERSION,
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

fn figure_json(row: &Row) -> Value {
    let target = match row.target {
        Target::AtLeast(limit) => json!({"at_least": limit}),
        Target::AtMost(limit) => json!({"at_most": limit}),
        Target::None => Value::Null,
    };
    json!({
        "meaning": row.meaning,
        "value": row.value.filter(|value| value.is_finite()),
        "low": row.interval.map(|interval| interval.0),
        "high": row.interval.map(|interval| interval.1),
        "hits": row.counts.map(|counts| counts.0),
        "of": row.counts.map(|counts| counts.1),
        "target": target,
        "ideal": row.ideal,
    })
}

/// Every case: what was planted, what was answered.
fn cases_csv(cases: &[Case]) -> String {
    let mut text =
        String::from("name,planted,detectable,refutable,verdict,named,first,probability,closure\n");
    for (truth, answer) in cases {
        let planted: Vec<&str> = truth.effects.iter().map(name_of).collect();
        let named: Vec<&str> = answer.effects.iter().map(|id| id.name()).collect();
        let (first, probability) = answer.first().map_or(("", String::new()), |(class, p)| {
            (class.name(), format!("{p:.4}"))
        });
        let [detectable, refutable] =
            [truth.detectable, truth.refutable].map(|known| match known {
                Some(true) => "yes",
                Some(false) => "no",
                None => "",
            });
        let closure = answer
            .closure
            .map_or(String::new(), |closure| format!("{closure:.4}"));
        text.push_str(&format!(
            "{},{},{},{},{},{},{first},{probability},{closure}\n",
            quoted(&truth.name),
            quoted(&planted.join("+")),
            detectable,
            refutable,
            answer.verdict_name(),
            named.join("+"),
        ));
    }
    text
}

/// A word of a CSV file; names made elsewhere may hold anything.
fn quoted(word: &str) -> String {
    if word.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", word.replace('"', "\"\""))
    } else {
        word.to_owned()
    }
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
                Some(Verdict::Named(_)) => answer
                    .named_groups()
                    .iter()
                    .any(|g| Class::Group(*g) == class),
                Some(Verdict::NoGap) => class == Class::None,
                _ => false,
            })
            .count();
        let line = format!(
            "{:<20}{:>7}{:>8}  {}",
            class.name(),
            format!("{first}/{}", own.len()),
            format!("{named}/{}", own.len()),
            others(&own, class)
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

/// "cross-coupling 2, none 1".
fn others(cases: &[&Case], own: Class) -> String {
    let mut counts: BTreeMap<Class, usize> = BTreeMap::new();
    for (_, answer) in cases {
        match answer.first() {
            Some((class, _)) if class != own => *counts.entry(class).or_insert(0) += 1,
            _ => {}
        }
    }
    let words: Vec<String> = counts
        .iter()
        .map(|(class, count)| format!("{} {count}", class.name()))
        .collect();
    words.join(", ")
}
