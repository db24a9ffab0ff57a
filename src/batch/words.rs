//! What a batch shows, in words and tables: for the terminal and for the page.

use crate::summary::{Counted, Distribution, LEAST_VALUES, OUTLIER_LIMIT, Quantity, Summary};
use tapjoint_report::Screen;
use tapjoint_report::format::{
    MISSING, capital, optional, signed_percent, significant, unit_words,
};
use tapjoint_report::tables::{Table, number, words};

/// Quantities, outliers and reasons that the terminal shows.
const MOST_QUANTITIES: usize = 8;
const MOST_SHOWN: usize = 3;

/// Returns the summary in at most [`MOST_LINES`](tapjoint_report::MOST_LINES) lines. `page` is the path of the page.
pub fn answer(summary: &Summary, page: &str, screen: Screen) -> String {
    let mut text = screen.wrapped(&counts(summary), 2);
    for reason in summary.reasons.iter().take(2) {
        text.push_str(&shortened(&format!("! {}", counted(reason)), screen));
    }
    if !summary.distributions.is_empty() {
        let shown: Vec<&Distribution> = shown(&summary.distributions);
        let hidden = summary.distributions.len() - shown.len();
        text.push('\n');
        text.push_str(&screen.table(&Table {
            caption: String::new(),
            ..distributions(shown)
        }));
        if hidden > 0 {
            text.push_str(&format!("... and {hidden} more\n"));
        }
    }
    let mut tail = Vec::new();
    let count = outlier_count(summary);
    for (found, outlier) in worst_outliers(summary).into_iter().take(MOST_SHOWN) {
        tail.push(format!(
            "! {}: {} {} {}, {} spreads from the median",
            outlier.file,
            found.quantity,
            significant(outlier.value, 5),
            unit_words(found.unit),
            significant(outlier.score.abs(), 2)
        ));
    }
    if count > MOST_SHOWN {
        tail.push(format!("... and {} more outliers", count - MOST_SHOWN));
    }
    tail.extend(worst_codes(summary));
    if !tail.is_empty() {
        text.push('\n');
    }
    for line in tail {
        text.push_str(&shortened(&line, screen));
    }
    text.push_str(&format!("Page  {page}\n"));
    text
}

/// Returns a line that is cut where the screen ends: a long name would take the room of other findings.
fn shortened(text: &str, screen: Screen) -> String {
    let most = screen.columns();
    let mut line: String = text.chars().take(most).collect();
    if text.chars().count() > most {
        line.pop();
        line.push('\u{2026}');
    }
    line.push('\n');
    line
}

/// Returns the distributions that a terminal has room for: stiffnesses, and the lowest modes.
fn shown(all: &[Distribution]) -> Vec<&Distribution> {
    let is_mode = |one: &&Distribution| matches!(one.quantity, Quantity::Mode(_));
    let others = all.iter().filter(|one| !is_mode(one)).count();
    let modes = all.iter().filter(is_mode);
    let mut shown: Vec<_> = modes.take(MOST_QUANTITIES.saturating_sub(others)).collect();
    shown.extend(all.iter().filter(|one| !is_mode(one)));
    shown
}

/// Returns how many tests there are, and how they ended.
pub fn counts(summary: &Summary) -> String {
    let mut parts = vec![format!("{} answered", summary.answered)];
    for (count, name) in [
        (summary.no_answer, "without an answer"),
        (summary.failed, "failed"),
    ] {
        if count > 0 {
            parts.push(format!("{count} {name}"));
        }
    }
    format!("{}: {}", tests(summary.tests), parts.join(", "))
}

/// Returns "1 test" or "2 tests".
pub fn tests(count: u64) -> String {
    match count {
        1 => "1 test".to_owned(),
        count => format!("{count} tests"),
    }
}

/// Returns a reason with the number of tests that have it, and the first of them.
pub fn counted(one: &Counted) -> String {
    let more = if one.count > 1 { ", ..." } else { "" };
    format!("{} ({}{more}): {}", tests(one.count), one.first, one.name)
}

/// Returns the most frequent checks and warnings, one line each.
fn worst_codes(summary: &Summary) -> Vec<String> {
    let kinds = [
        ("failed checks", &summary.bad_checks),
        ("doubtful checks", &summary.doubtful_checks),
        ("warnings", &summary.warnings),
    ];
    let mut lines = Vec::new();
    for (name, codes) in kinds {
        let all = codes.iter().take(MOST_SHOWN);
        let all: Vec<String> = all
            .map(|one| format!("{} in {}", one.name, one.count))
            .collect();
        if !all.is_empty() {
            let (name, tests) = (capital(name), tests(summary.tests));
            lines.push(format!("{name}: {} of {tests}", all.join(", ")));
        }
    }
    lines
}

/// Returns the number of all outliers, also of those that are not listed.
fn outlier_count(summary: &Summary) -> usize {
    let all = summary.distributions.iter();
    all.map(|one| one.outlier_count).sum()
}

/// Returns all outliers that are listed, with their distributions, the farthest first.
pub fn worst_outliers(summary: &Summary) -> Vec<(&Distribution, &crate::summary::Outlier)> {
    let all = summary.distributions.iter();
    let mut all: Vec<_> = all
        .flat_map(|one| one.outliers.iter().map(move |outlier| (one, outlier)))
        .collect();
    all.sort_by(|a, b| b.1.score.abs().total_cmp(&a.1.score.abs()));
    all
}

/// Returns sentences on counts, trends and outliers.
pub fn findings(summary: &Summary) -> Vec<String> {
    let mut sentences = vec![format!("{}.", counts(summary))];
    let drifting = summary.distributions.iter().filter(|one| one.has_trend());
    for one in drifting {
        sentences.push(format!(
            "{} changes by {} % from the first to the last test.",
            capital(&one.quantity.to_string()),
            signed_percent(one.trend_percent)
        ));
    }
    sentences.push(match outlier_count(summary) {
        0 => format!("No value is more than {OUTLIER_LIMIT} spreads from its median."),
        1 => format!("1 value is more than {OUTLIER_LIMIT} spreads from its median."),
        count => {
            format!("{count} values are more than {OUTLIER_LIMIT} spreads from their medians.")
        }
    });
    sentences
}

/// Returns the distributions, a row each.
pub fn distributions<'a>(all: impl IntoIterator<Item = &'a Distribution>) -> Table {
    let rows = all.into_iter().map(|one| {
        let percent = 100.0 * one.spread / one.median.abs();
        let percent = Some(percent).filter(|percent| percent.is_finite());
        [
            words("Quantity", quantity_with_unit(one)),
            number("Tests", one.count.to_string()),
            number("Median", significant(one.median, 5)),
            number("Spread (%)", optional(percent, 2)),
            number("Least", significant(one.min, 5)),
            number("Largest", significant(one.max, 5)),
            number("Trend (%)", signed_percent(one.trend_percent)),
            words("Clear", trend_words(one)),
            number("Outliers", one.outlier_count.to_string()),
        ]
    });
    Table::of(
        "Frequencies and stiffnesses of all tests",
        rows,
        format!(
            "Spread: 1.4826 times the median distance from the median, the standard deviation of normal values. Trend: change \
             from the first to the last test, by the median slope between all pairs of tests (Theil and Sen); of more than \
             1,000 tests, between medians of consecutive groups. A trend is clear where fewer than one in 1,000 would be as \
             clear by chance (Mann and Kendall). Outliers: values more than {OUTLIER_LIMIT} spreads from the median (Iglewicz \
             and Hoaglin). Fewer than {LEAST_VALUES} tests have no trend (a dash) and no outliers."
        ),
    )
}

fn quantity_with_unit(one: &Distribution) -> String {
    format!(
        "{} ({})",
        capital(&one.quantity.to_string()),
        unit_words(one.unit)
    )
}

fn trend_words(one: &Distribution) -> &'static str {
    match (one.trend_z, one.has_trend()) {
        (None, _) => MISSING,
        (Some(_), true) => "yes",
        (Some(_), false) => "no",
    }
}

/// Returns the outliers, a row each; `None` without any.
pub fn outliers(summary: &Summary) -> Option<Table> {
    let all = worst_outliers(summary);
    let rows = all.into_iter().map(|(found, outlier)| {
        let [low, high] = found.limits().unwrap_or([f64::NAN; 2]);
        [
            words("Test", outlier.file.as_str()),
            words("Quantity", quantity_with_unit(found)),
            number("Value", significant(outlier.value, 5)),
            number("Spreads", significant(outlier.score, 2)),
            number("Lower limit", significant(low, 5)),
            number("Upper limit", significant(high, 5)),
        ]
    });
    let table = Table::of(
        "Outliers",
        rows,
        "Spreads: distance from the median. The farthest stand first; of each quantity at most 100 are listed.",
    );
    (!table.rows.is_empty()).then_some(table)
}

/// Returns reasons or codes with their counts; `None` without any.
pub fn counted_table(caption: &str, head: &str, all: &[Counted]) -> Option<Table> {
    let rows = all.iter().map(|one| {
        [
            words(head, one.name.as_str()),
            number("Tests", one.count.to_string()),
            words("First test", one.first.as_str()),
        ]
    });
    let table = Table::of(caption, rows, "");
    (!table.rows.is_empty()).then_some(table)
}
