//! Tables of how far the estimate moves when the frequencies do.

use super::super::document::{Document, EstimateSection, SensitivitySection};
use super::super::format::{
    MISSING, bound_percent, optional, signed, signed_percent, significant, trimmed,
};
use super::{Column, Table, mode_of, number, words};

/// The non-dimensional values that changes are counted from.
fn base(document: &Document, method: &str) -> [Option<f64>; 3] {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let Some(estimate) = estimate else {
        return [None; 3];
    };
    match &estimate.pairs {
        Some(pairs) if method == "pairs" => [pairs.kx, pairs.ky, pairs.kz],
        _ => own(estimate),
    }
}

fn own(estimate: &EstimateSection) -> [Option<f64>; 3] {
    [&estimate.kx, &estimate.ky, &estimate.kz].map(|value| value.as_ref().map(|v| v.value))
}

fn change(value: Option<f64>, base: Option<f64>) -> Option<f64> {
    let (value, base) = value.zip(base)?;
    Some(100.0 * (value - base) / base)
}

/// Estimates with all frequencies changed by the same percentage; `None` where not computed.
pub fn perturbation(document: &Document) -> Option<Table> {
    let rows = document.perturbation.as_deref().filter(|p| !p.is_empty())?;
    let with_kz = rows.iter().any(|row| row.kz.is_some());
    let mut columns = vec![number("Frequencies (%)"), words("Method").on_page()];
    for name in names(with_kz) {
        columns.push(number(&format!("{name} (1)")));
        columns.push(number("change (%)"));
    }
    let rows = rows
        .iter()
        .map(|row| {
            let mut cells = vec![signed(row.percent), row.method.clone()];
            let base = base(document, &row.method);
            for (value, base) in [row.kx, row.ky, row.kz].into_iter().zip(base) {
                cells.push(optional(value, 5));
                cells.push(signed_percent(change(value, base)));
            }
            cells.truncate(columns.len());
            cells
        })
        .collect();
    Some(Table {
        caption: "All frequencies changed by the same percentage".to_owned(),
        columns,
        rows,
        note: "Change: against the estimate. \u{2013}: the changed frequencies leave no estimate."
            .to_owned(),
    })
}

fn names(with_kz: bool) -> &'static [&'static str] {
    if with_kz {
        &["Kx", "Ky", "Kz"]
    } else {
        &["Kx", "Ky"]
    }
}

/// Average errors under changed frequencies, as the paper's tables state them; `None` where not
/// computed.
pub fn averages(document: &Document) -> Option<Table> {
    let averages = document.perturbation_averages.as_deref();
    let list = averages.filter(|list| !list.is_empty())?;
    let rows = list.iter().map(|row| {
        let cell = |percent: Option<f64>| optional(percent, 3);
        vec![
            format!("\u{b1}{}", trimmed(row.percent, 4)),
            cell(Some(row.kx_percent)),
            cell(Some(row.ky_percent)),
            cell(row.kz_percent),
            cell(Some(row.kx_of_mean_percent)),
            cell(Some(row.ky_of_mean_percent)),
            cell(row.kz_of_mean_percent),
        ]
    });
    let table = Table {
        caption: "Average errors of the stiffnesses".to_owned(),
        columns: vec![
            number("Frequencies (%)"),
            number("Kx off by (%)"),
            number("Ky off by (%)"),
            number("Kz off by (%)"),
            number("mean of Kx (%)"),
            number("mean of Ky (%)"),
            number("mean of Kz (%)"),
        ],
        rows: rows.collect(),
        note: "Off by: mean size of the changes of the table above, up and down. Mean of: how far the \
               mean of the two estimates is off, which is less, because opposite changes cancel."
            .to_owned(),
    };
    Some(table.without_empty_columns())
}

/// Median and 95 % interval under random errors of the frequencies; `None` where not computed.
pub fn monte_carlo(document: &Document) -> Option<Table> {
    let found = document.monte_carlo.as_ref()?;
    let parameters = [("Kx", found.kx), ("Ky", found.ky), ("Kz", found.kz)];
    let rows: Vec<Vec<String>> = parameters
        .into_iter()
        .zip(base(document, "pairs"))
        .filter_map(|((name, value), base)| {
            let value = value?;
            Some(vec![
                name.to_owned(),
                optional(base, 5),
                significant(value.value, 5),
                optional(value.low, 5),
                optional(value.high, 5),
                signed_percent(change(value.low, base)),
                signed_percent(change(value.high, base)),
            ])
        })
        .collect();
    let failed = match found.failed {
        0 => String::new(),
        failed => format!(" {failed} of them leave no estimate and are left out."),
    };
    let table = Table {
        caption: "Random errors of the frequencies (Monte Carlo)".to_owned(),
        columns: vec![
            words("Parameter (1)"),
            number("Estimate"),
            number("Median"),
            number("95 % low"),
            number("95 % high"),
            number("down (%)"),
            number("up (%)"),
        ],
        rows,
        note: format!(
            "{} draws, each frequency with its own standard deviation.{failed}",
            found.samples
        ),
    };
    Some(table.without_empty_columns())
}

/// Smallest and largest estimate over all sign patterns of the bounds; `None` where not computed.
pub fn spans(document: &Document) -> Option<Table> {
    let span = document.resolution_span.as_ref()?;
    let base = base(document, "pairs");
    let rows: Vec<Vec<String>> = [("Kx", span.kx), ("Ky", span.ky), ("Kz", span.kz)]
        .into_iter()
        .zip(base)
        .filter_map(|((name, range), base)| {
            let [low, high] = range?;
            Some(vec![
                name.to_owned(),
                significant(low, 5),
                optional(base, 5),
                significant(high, 5),
                signed_percent(change(Some(low), base)),
                signed_percent(change(Some(high), base)),
            ])
        })
        .collect();
    let failed = match span.failed {
        0 => String::new(),
        failed => format!(" {failed} of them leave no estimate: the span is open."),
    };
    Some(Table {
        caption: "Every mode at one end of its bound or the other".to_owned(),
        columns: vec![
            words("Parameter (1)"),
            number("Smallest"),
            number("Estimate"),
            number("Largest"),
            number("down (%)"),
            number("up (%)"),
        ],
        rows,
        note: format!("{} sign patterns tried.{failed}", span.patterns),
    })
}

/// What each mode's bound does to each parameter; `None` where not computed.
pub fn sensitivity(document: &Document) -> Option<Table> {
    let span = document.resolution_span.as_ref()?;
    let list = span.sensitivity.as_slice();
    if list.is_empty() {
        return None;
    }
    let with_kz = list.iter().any(|row| row.kz_percent.is_some());
    let mut columns: Vec<Column> =
        vec![number("Mode"), number("Bound (Hz)"), number("Reading (%)")];
    for name in names(with_kz) {
        columns.push(number(&format!("{name} moves (%)")));
    }
    let rows = list
        .iter()
        .map(|row| {
            let mut cells = vec![
                row.mode.to_string(),
                significant(row.half_line, 3),
                reading_percent(document, row),
                signed_percent(row.kx_percent),
                signed_percent(row.ky_percent),
                signed_percent(row.kz_percent),
            ];
            cells.truncate(columns.len());
            cells
        })
        .collect();
    Some(Table {
        caption: "Which mode drives which parameter".to_owned(),
        columns,
        rows,
        note: drivers(list, with_kz),
    })
}

/// The bound in percent of the mode's frequency.
fn reading_percent(document: &Document, row: &SensitivitySection) -> String {
    let mode = mode_of(document, row.mode).filter(|mode| mode.frequency > 0.0);
    mode.map_or(MISSING.to_owned(), |mode| {
        bound_percent(100.0 * row.half_line / mode.frequency)
    })
}

/// "Kx depends most on mode 4, Ky on mode 1."
pub fn drivers(list: &[SensitivitySection], with_kz: bool) -> String {
    let pick: [fn(&SensitivitySection) -> Option<f64>; 3] = [
        |row| row.kx_percent,
        |row| row.ky_percent,
        |row| row.kz_percent,
    ];
    let sentences: Vec<String> = names(with_kz)
        .iter()
        .zip(pick)
        .filter_map(|(name, pick)| {
            let strength = |row: &SensitivitySection| pick(row).map_or(0.0, f64::abs);
            let strongest = list
                .iter()
                .filter(|row| strength(row) > 0.0)
                .max_by(|a, b| strength(a).total_cmp(&strength(b)))?;
            Some(format!("{name} on mode {}", strongest.mode))
        })
        .collect();
    if sentences.is_empty() {
        return String::new();
    }
    let list = sentences.join(", ");
    format!("{}.", list.replacen(" on mode", " depends most on mode", 1))
}
