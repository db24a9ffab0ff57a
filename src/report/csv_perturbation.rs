//! Estimates under changed frequencies as comma separated values, one row each, numbers in full
//! precision.

use super::ReportError;
use super::csv::{number, write};
use super::document::{Document, MonteCarloSection, ResolutionSpanSection, ValueSection};

/// Columns of `perturbation.csv`: `kind` is what was done to the frequencies, `percent` by how much
/// where all were changed alike, `mode` which one where one was changed alone, `statistic` what of the
/// estimates the three numbers are.
const COLUMNS: [&str; 8] = [
    "method",
    "kind",
    "percent",
    "mode",
    "statistic",
    "kx",
    "ky",
    "kz",
];

/// `perturbation.csv`; only its header where nothing was perturbed.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_perturbation_csv(document: &Document) -> Result<String, ReportError> {
    let spans = document.resolution_span.iter().flatten();
    let random = document.monte_carlo.iter().flatten();
    let rows = uniform(document)
        .into_iter()
        .chain(averages(document))
        .chain(spans.flat_map(bounds))
        .chain(random.flat_map(monte_carlo));
    write(&COLUMNS, rows.collect())
}

/// What a row is about: method, kind, percent, mode, statistic.
type About<'a> = (&'a str, &'a str, Option<f64>, Option<usize>, &'a str);

fn row(
    (method, kind, percent, mode, statistic): About<'_>,
    values: [Option<f64>; 3],
) -> Vec<String> {
    let mut cells = vec![
        method.to_owned(),
        kind.to_owned(),
        number(percent),
        mode.map(|mode| mode.to_string()).unwrap_or_default(),
        statistic.to_owned(),
    ];
    cells.extend(values.map(number));
    cells
}

fn uniform(document: &Document) -> Vec<Vec<String>> {
    let rows = document.perturbation.iter().flatten();
    rows.map(|found| {
        let about = (
            &*found.method,
            "uniform",
            Some(found.percent),
            None,
            "value",
        );
        row(about, [found.kx, found.ky, found.kz])
    })
    .collect()
}

fn averages(document: &Document) -> Vec<Vec<String>> {
    let list = document.perturbation_averages.iter().flatten();
    list.flat_map(|found| {
        let about = |statistic| {
            (
                &*found.method,
                "uniform",
                Some(found.percent),
                None,
                statistic,
            )
        };
        let errors = [found.kx_percent, found.ky_percent, found.kz_percent];
        let of_mean = [
            found.kx_of_mean_percent,
            found.ky_of_mean_percent,
            found.kz_of_mean_percent,
        ];
        [
            row(about("mean error (%)"), errors),
            row(about("error of mean (%)"), of_mean),
        ]
    })
    .collect()
}

fn bounds(found: &ResolutionSpanSection) -> Vec<Vec<String>> {
    let ranges = [found.kx, found.ky, found.kz];
    let end = |statistic, index: usize| {
        let values = ranges.map(|range| range.and_then(|range| range.get(index).copied()));
        row(
            (&found.method, "sign patterns", None, None, statistic),
            values,
        )
    };
    let mut rows = vec![end("smallest", 0), end("largest", 1)];
    for mode in &found.sensitivity {
        let about = |statistic| (&*found.method, "one mode", None, Some(mode.mode), statistic);
        let change = [mode.kx_percent, mode.ky_percent, mode.kz_percent];
        let slope = [
            mode.kx_percent_per_percent,
            mode.ky_percent_per_percent,
            mode.kz_percent_per_percent,
        ];
        rows.push(row(about("change by its bound (%)"), change));
        rows.push(row(about("change per percent (%)"), slope));
    }
    rows
}

fn monte_carlo(found: &MonteCarloSection) -> Vec<Vec<String>> {
    let values = [found.kx, found.ky, found.kz];
    let of = |statistic, pick: fn(ValueSection) -> Option<f64>| {
        let about = (&*found.method, "monte carlo", None, None, statistic);
        row(about, values.map(|value| value.and_then(pick)))
    };
    vec![
        of("median", |value| Some(value.value)),
        of("low", |value| value.low),
        of("high", |value| value.high),
    ]
}
