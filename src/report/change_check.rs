//! The files of a check of comparisons: its score as JSON, every pair as CSV, the truths that were sealed, and a picture.

use crate::blind_check::{Confusion, figures_json};
use crate::data_files::write;
use crate::run::picture_files;
use crate::{ReportError, ReportFile};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use tapjoint_compare::CauseKind;
use tapjoint_study::change_check::{
    ChangeClass, PairAnswer, PairCase, PairConduct, PairKind, PairScores, PairTruth, pair_rows,
    pair_truths_json, score_pairs,
};

/// All files: `score.json`, `cases.csv`, `truth.json`, and as PNG and SVG `confusion`.
///
/// # Errors
/// The first that cannot be made.
pub fn render_change_check(
    cases: &[PairCase],
    scores: &PairScores,
    conduct: &PairConduct,
) -> Result<Vec<ReportFile>, ReportError> {
    let truths: Vec<PairTruth> = cases.iter().map(|(truth, _)| truth.clone()).collect();
    let mut score = pair_score_json(scores, conduct);
    score["classes"] = classes_json(cases);
    let score = serde_json::to_string_pretty(&score).map_err(ReportError::Json)?;
    let truths = pair_truths_json(&truths).map_err(ReportError::Json)?;
    let mut files = vec![
        ReportFile::of("score.json", score + "\n"),
        ReportFile::of("cases.csv", cases_csv(cases)?),
        ReportFile::of("truth.json", truths),
    ];
    let classes = classes();
    let index = |name: &str| classes.iter().position(|own| *own == name);
    let counted = cases.iter().filter_map(|(truth, answer)| {
        let first = match answer.first()?.effect {
            CauseKind::NoChange => PairKind::Nothing,
            CauseKind::Unknown => PairKind::Outside,
            kind => PairKind::Single(kind),
        };
        Some((index(truth.kind().name())?, index(first.name())?))
    });
    let chart = Confusion::of(classes.clone(), counted).chart(
        "What changed, and what came first",
        "rows: what changed; columns: the most probable cause; pairs with two changes are left out",
        ["changed", "most probable cause"],
    );
    files.extend(picture_files(chart.kind, &chart.draw())?);
    Ok(files)
}

/// Classes with one right answer, in the order of tables.
fn classes() -> Vec<&'static str> {
    let all = ChangeClass::ALL.iter();
    all.filter(|class| **class != ChangeClass::Two)
        .map(|class| class.name())
        .collect()
}

/// The score: every figure with its interval and its counts, and how the check was conducted.
pub fn pair_score_json(scores: &PairScores, conduct: &PairConduct) -> Value {
    let [nothing, single, several, outside] = scores.counts;
    json!({
        "version": crate::document::VERSION,
        "cases": {"none": nothing, "one": single, "several": several, "outside": outside},
        "figures": figures_json(&pair_rows(scores)),
        "commitment": conduct.commitment,
        "mutations": {
            "shuffled_first_right": conduct.shuffled,
            "renamed_same_answer": conduct.renamed,
        },
    })
}

/// For each kind of pairs: how many, how many are visible, the right first causes of those, names and wrong names.
fn classes_json(cases: &[PairCase]) -> Value {
    let mut kinds: BTreeMap<PairKind, Vec<PairCase>> = BTreeMap::new();
    for case in cases {
        kinds.entry(case.0.kind()).or_default().push(case.clone());
    }
    let mut rows = serde_json::Map::new();
    for (kind, own) in kinds {
        let scores = score_pairs(&own);
        let visible = own.iter().filter(|(truth, _)| truth.visible == Some(true));
        let first = match kind {
            PairKind::Several => "several_first_right",
            _ => "first_right_visible",
        };
        let count = |key: &str| {
            let rate = scores.rate(key);
            rate.map(|rate| json!({"hits": rate.hits, "of": rate.of}))
        };
        let row = json!({
            "pairs": own.len(),
            "visible": visible.count(),
            "first_right_visible": count(first),
            "named_wrongly": count("named_wrongly"),
            "list_holds": count("list_holds"),
            "no_answer": scores.failed,
        });
        rows.insert(kind.name().to_owned(), row);
    }
    Value::Object(rows)
}

/// Every pair: what changed, what was answered.
fn cases_csv(cases: &[PairCase]) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for (truth, answer) in cases {
        let changed: Vec<&str> = truth.changes.iter().map(|one| one.cause.as_str()).collect();
        let items = truth.changes.iter().filter_map(|one| one.item.as_deref());
        let visible = match truth.visible {
            Some(true) => "yes",
            Some(false) => "no",
            None => "",
        };
        let repeatability = truth.repeatability;
        let mut row = vec![
            truth.name.clone(),
            changed.join("+"),
            items.collect::<Vec<_>>().join("+"),
            visible.to_owned(),
            repeatability.map_or_else(String::new, |value| format!("{value:.6}")),
        ];
        match answer {
            PairAnswer::Compared(found) => {
                let verdict = &found.verdict;
                let named: Vec<&str> = verdict.effects.iter().map(|kind| kind.name()).collect();
                let first = answer.first();
                let cause = first.map_or("", |one| one.effect.name());
                let item = first.and_then(|one| one.item.clone());
                row.extend([
                    verdict.kind.name().to_owned(),
                    named.join("+"),
                    cause.to_owned(),
                    item.unwrap_or_default(),
                    first.map_or_else(String::new, |one| format!("{:.4}", one.probability)),
                    found.modes.len().to_string(),
                    String::new(),
                ]);
            }
            PairAnswer::None(reason) => {
                row.push("no-answer".to_owned());
                row.extend(std::iter::repeat_n(String::new(), 5));
                row.push(reason.clone());
            }
        }
        rows.push(row);
    }
    let heads = "name,changed,item,visible,repeatability,verdict,named,first,first_item,probability,modes,reason";
    write(heads, rows)
}
