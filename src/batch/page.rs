//! The page of a batch.

use crate::summary::{Distribution, Point, Quantity, Summary};
use crate::words::{counted, counted_table, distributions, findings, outliers, tests};
use tapjoint_report::document::WarningSection;
use tapjoint_report::format::{capital, significant, unit_words};
use tapjoint_report::picture::{
    Axis, Block, Chart, Color, InPage, Mark, Panel, Places, Series, extent, padded,
};
use tapjoint_report::tables::Table;
use tapjoint_report::{BatchPage, BatchSection, ReportError, render_batch_page};

/// Height of a panel (pixels).
const HEIGHT: f64 = 190.0;
/// Most points of a series. Of more, the farthest outliers are drawn, and one in several of the other tests.
const MOST_POINTS: usize = 2000;
/// Quantities that are drawn.
const MOST_PANELS: usize = 12;

/// Caption of the chart.
const CAPTION: &str = "Each point is a test. The band holds the values that are no outliers.";

/// Names and reports of the tests, by their index.
pub trait TestNames {
    /// Returns the name of a test.
    fn name(&self, test: u32) -> String;

    /// Returns the address of a test's report, seen from the page; `None` of a test without a report.
    fn report(&self, test: u32) -> Option<String>;
}

/// Returns the page.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled, and those of the charts.
pub fn render(summary: &Summary, names: &dyn TestNames) -> Result<String, ReportError> {
    let mut sections = Vec::new();
    if !summary.distributions.is_empty() {
        let mut own = vec![distributions(&summary.distributions)];
        own.extend(outliers(summary));
        sections.push(BatchSection {
            id: "distributions",
            title: "All tests together",
            tables: own,
            charts: vec![chart(summary, names)],
        });
    }
    let (reasons, verdicts) = (&summary.reasons, &summary.verdicts);
    let counts = [
        (
            "reasons",
            "Tests without an answer",
            vec![counted_table("Reasons", "Reason", reasons)],
        ),
        (
            "verdicts",
            "What the models miss",
            vec![counted_table("Verdicts", "Verdict", verdicts)],
        ),
        (
            "checks",
            "How well the tests were measured",
            vec![
                counted_table("Failed checks", "Check", &summary.bad_checks),
                counted_table("Doubtful checks", "Check", &summary.doubtful_checks),
                counted_table("Warnings", "Code", &summary.warnings),
            ],
        ),
    ];
    for (id, title, tables) in counts {
        let tables: Vec<Table> = tables.into_iter().flatten().collect();
        if !tables.is_empty() {
            sections.push(BatchSection {
                id,
                title,
                tables,
                ..BatchSection::default()
            });
        }
    }
    let warnings = reasons.iter().map(|reason| WarningSection {
        code: "no-answer".to_owned(),
        text: counted(reason),
        beside: false,
    });
    render_batch_page(BatchPage {
        title: format!("Batch of {}", tests(summary.tests)),
        facts: vec![
            ("Tests", summary.tests.to_string()),
            ("Answered", summary.answered.to_string()),
            ("Without an answer", summary.no_answer.to_string()),
            ("Failed", summary.failed.to_string()),
        ],
        findings: findings(summary),
        warnings: warnings.collect(),
        sections,
    })
}

/// Returns the values of all tests in their order, a panel for each quantity.
fn chart(summary: &Summary, names: &dyn TestNames) -> Chart {
    // Stiffnesses first: there may be more modes than panels.
    let mut all: Vec<&Distribution> = summary.distributions.iter().collect();
    all.sort_by_key(|one| matches!(one.quantity, Quantity::Mode(_)));
    let panels = all.iter().take(MOST_PANELS);
    let panels: Vec<Panel> = panels.map(|one| panel(one, summary.tests, names)).collect();
    let mut series = panels.iter().flat_map(|panel| &panel.series);
    let is_linked = series.any(|series| !series.links.is_empty());
    Chart {
        kind: "batch",
        title: "Tests in their order".to_owned(),
        subtitle: "values in the band are no outliers".to_owned(),
        caption: match is_linked {
            true => format!("{CAPTION} A click on a point opens its report."),
            false => CAPTION.to_owned(),
        },
        blocks: vec![Block {
            in_page: InPage::Together,
            ..Block::new(2, panels)
        }],
        ..Chart::default()
    }
}

fn panel(found: &Distribution, count: u64, names: &dyn TestNames) -> Panel {
    let limits = found.limits();
    let is_outlier =
        |point: &Point| limits.is_some_and(|[low, high]| !(low..=high).contains(&point.value));
    let (mut outliers, others): (Vec<Point>, Vec<Point>) =
        found.points.iter().partition(|point| is_outlier(point));
    let distance = |point: &Point| (point.value - found.median).abs();
    outliers.sort_by(|a, b| {
        distance(b)
            .total_cmp(&distance(a))
            .then(a.test.cmp(&b.test))
    });
    outliers.truncate(MOST_POINTS);
    outliers.sort_by_key(|point| point.test);
    let stride = others.len().div_ceil(MOST_POINTS).max(1);
    let others: Vec<Point> = others.into_iter().step_by(stride).collect();
    let series = |name, color, mark, points: &[Point]| {
        let mut own = Series::new(name, color, mark);
        for point in points {
            own.push(f64::from(point.test) + 1.0, point.value);
            own.words.push(names.name(point.test));
            own.links.push(names.report(point.test).unwrap_or_default());
            let (value, unit) = (significant(point.value, 5), unit_words(found.unit));
            own.said.push(format!("{value} {unit}"));
        }
        if own.links.iter().all(String::is_empty) {
            own.links.clear();
        }
        own
    };
    let inside = series("test", Color::Blue, Mark::Dot(2.5), &others);
    let outside = series("outlier", Color::Vermilion, Mark::Ring(4.0), &outliers);
    let last = count as f64 + 0.5;
    let ends = extent([found.min, found.max]).unwrap_or((0.0, 1.0));
    let mut band = Series::new("no outliers", Color::Data, Mark::Band);
    if let Some([low, high]) = limits {
        band.x = Places::Each(vec![0.5, last]);
        band.low = vec![low; 2];
        band.high = vec![high; 2];
    }
    let quantity = capital(&found.quantity.to_string());
    let y = padded(ends, 0.1).of(quantity.clone(), found.unit);
    let mut shown = vec![band, inside, outside];
    shown.retain(|series| !series.low.is_empty() || !series.y.is_empty());
    let mut note = Vec::new();
    if outliers.len() < found.outlier_count {
        let (drawn, all) = (outliers.len(), found.outlier_count);
        note.push(format!("The farthest {drawn} of {all} outliers are drawn."));
    }
    if stride > 1 {
        note.push(format!("One in {stride} of the other tests is drawn."));
    }
    Panel {
        note: note.join(" "),
        ..Panel::new(HEIGHT, Axis::linear(0.5, last).of("test", ""), y)
            .titled(quantity)
            .with(shown)
    }
}
