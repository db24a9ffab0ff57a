//! Tables of how far the estimate moves when the frequencies do.

use super::super::document::{
    Document, EstimateSection, Method, MonteCarloSection, ResolutionSpanSection, SensitivitySection,
};
use super::super::format::{
    MISSING, RIGID, bound_percent, optional, signed, signed_percent, significant, trimmed,
};
use super::{Column, Table, mode_of, number, words};

/// The non-dimensional values that changes are counted from.
fn base(document: &Document, method: Method) -> [Option<f64>; 3] {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let Some(estimate) = estimate else {
        return [None; 3];
    };
    match &estimate.pairs {
        Some(pairs) if method == Method::Pairs => [pairs.kx, pairs.ky, pairs.kz],
        _ => own(estimate),
    }
}

fn own(estimate: &EstimateSection) -> [Option<f64>; 3] {
    [&estimate.kx, &estimate.ky, &estimate.kz].map(|value| value.as_ref().map(|v| v.value))
}

/// A column that says by which method, shown where there are several.
fn method_column(methods: &[Method]) -> Column {
    let several = methods.iter().any(|method| Some(method) != methods.first());
    let column = words("Method");
    if several { column } else { column.on_page() }
}

/// Rows of several methods, those about the same thing side by side: the consistent estimate first, in
/// the order of the things as they come.
fn side_by_side<T: Copy, K: PartialEq>(
    rows: impl Iterator<Item = T>,
    thing: impl Fn(T) -> K,
    method: impl Fn(T) -> Method,
) -> Vec<T> {
    let mut things: Vec<K> = Vec::new();
    let mut placed: Vec<(usize, Method, T)> = Vec::new();
    for row in rows {
        let key = thing(row);
        let known = things.iter().position(|other| *other == key);
        let place = known.unwrap_or(things.len());
        if known.is_none() {
            things.push(key);
        }
        placed.push((place, method(row), row));
    }
    placed.sort_by_key(|(place, method, _)| (*place, *method));
    placed.into_iter().map(|(_, _, row)| row).collect()
}

/// A stiffness in five digits; "rigid" beyond all bounds.
fn stiffness(value: Option<f64>) -> String {
    match value {
        Some(value) if value.is_infinite() => RIGID.to_owned(),
        value => optional(value, 5),
    }
}

fn change(value: Option<f64>, base: Option<f64>) -> Option<f64> {
    let (value, base) = value.zip(base)?;
    Some(100.0 * (value - base) / base)
}

/// Estimates with all frequencies changed by the same percentage; `None` where not computed.
pub fn perturbation(document: &Document) -> Option<Table> {
    let rows = document.perturbation.as_deref().filter(|p| !p.is_empty())?;
    let with_kz = rows.iter().any(|row| row.kz.is_some());
    let methods: Vec<Method> = rows.iter().map(|row| row.method).collect();
    let mut columns = vec![number("Frequencies (%)"), method_column(&methods)];
    for name in names(with_kz) {
        columns.push(number(&format!("{name} (1)")));
        columns.push(number("change (%)"));
    }
    let ordered = side_by_side(rows.iter(), |row| row.percent.to_bits(), |row| row.method);
    let rows = ordered
        .into_iter()
        .map(|row| {
            let mut cells = vec![signed(row.percent), row.method.name().to_owned()];
            let base = base(document, row.method);
            for (value, base) in [row.kx, row.ky, row.kz].into_iter().zip(base) {
                cells.push(stiffness(value));
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
        note: "Change: against the estimate by the same method. \u{2013}: the changed frequencies leave \
               no estimate."
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
    let methods: Vec<Method> = list.iter().map(|row| row.method).collect();
    let ordered = side_by_side(list.iter(), |row| row.percent.to_bits(), |row| row.method);
    let rows = ordered.into_iter().map(|row| {
        let cell = |percent: Option<f64>| optional(percent, 3);
        vec![
            format!("\u{b1}{}", trimmed(row.percent, 4)),
            row.method.name().to_owned(),
            cell(row.kx_percent),
            cell(row.ky_percent),
            cell(row.kz_percent),
            cell(row.kx_of_mean_percent),
            cell(row.ky_of_mean_percent),
            cell(row.kz_of_mean_percent),
        ]
    });
    let table = Table {
        caption: "Average errors of the stiffnesses".to_owned(),
        columns: vec![
            number("Frequencies (%)"),
            method_column(&methods),
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
    let list = document.monte_carlo.as_deref().filter(|l| !l.is_empty())?;
    let methods: Vec<Method> = list.iter().map(|found| found.method).collect();
    let parameters = list.iter().flat_map(|found| {
        let values = [found.kx, found.ky, found.kz];
        (0..3).filter_map(move |index| Some((index, found, values[index]?)))
    });
    let ordered = side_by_side(parameters, |row| row.0, |row| row.1.method);
    let rows = ordered.into_iter().map(|(index, found, value)| {
        let base = base(document, found.method)[index];
        vec![
            names(true)[index].to_owned(),
            found.method.name().to_owned(),
            stiffness(base),
            stiffness(Some(value.value)),
            optional(value.low, 5),
            optional(value.high, 5),
            signed_percent(change(value.low, base)),
            signed_percent(change(value.high, base)),
        ]
    });
    let table = Table {
        caption: "Random errors of the frequencies (Monte Carlo)".to_owned(),
        columns: vec![
            words("Parameter (1)"),
            method_column(&methods),
            number("Estimate"),
            number("Median"),
            number("95 % low"),
            number("95 % high"),
            number("down (%)"),
            number("up (%)"),
        ],
        rows: rows.collect(),
        note: draws(list),
    };
    Some(table.without_empty_columns())
}

/// How often it was repeated, and how often in vain.
fn draws(list: &[MonteCarloSection]) -> String {
    let samples = list.first().map_or(0, |found| found.samples);
    let failed = list.iter().filter(|found| found.failed > 0).map(|found| {
        let by = if list.len() > 1 {
            format!(" by the method {}", found.method.name())
        } else {
            String::new()
        };
        format!(
            " {} of them leave no estimate{by} and are left out.",
            found.failed
        )
    });
    let tolerances = if list.iter().any(|found| found.method == Method::Consistent) {
        " The consistent estimate draws the beam's properties that have a tolerance as well."
    } else {
        ""
    };
    format!(
        "{samples} draws, each frequency with its own standard deviation.{}{tolerances}",
        failed.collect::<String>()
    )
}

/// Smallest and largest estimate over all sign patterns of the bounds; `None` where not computed.
pub fn spans(document: &Document) -> Option<Table> {
    let list = document.resolution_span.as_deref()?;
    let methods: Vec<Method> = list.iter().map(|span| span.method).collect();
    let parameters = list.iter().flat_map(|span| {
        let ranges = [span.kx, span.ky, span.kz];
        (0..3).filter_map(move |index| Some((index, span, ranges[index]?)))
    });
    let ordered = side_by_side(parameters, |row| row.0, |row| row.1.method);
    let rows = ordered.into_iter().map(|(index, span, [low, high])| {
        let base = base(document, span.method)[index];
        vec![
            names(true)[index].to_owned(),
            span.method.name().to_owned(),
            stiffness(Some(low)),
            stiffness(base),
            stiffness(Some(high)),
            signed_percent(change(Some(low), base)),
            signed_percent(change(Some(high), base)),
        ]
    });
    Some(Table {
        caption: "Every mode at one end of its bound or the other".to_owned(),
        columns: vec![
            words("Parameter (1)"),
            method_column(&methods),
            number("Smallest"),
            number("Estimate"),
            number("Largest"),
            number("down (%)"),
            number("up (%)"),
        ],
        rows: rows.collect(),
        note: tried(list),
    })
}

/// How many sign patterns were tried, and how many in vain.
fn tried(list: &[ResolutionSpanSection]) -> String {
    let patterns = list.first().map_or(0, |span| span.patterns);
    let failed = list.iter().filter(|span| span.failed > 0).map(|span| {
        let method = span.method.name();
        let by = if list.len() > 1 {
            format!(" by the method {method}")
        } else {
            String::new()
        };
        format!(
            " {} of them leave no estimate{by}: the span is open.",
            span.failed
        )
    });
    let failed: String = failed.collect();
    format!("{patterns} sign patterns tried.{failed}")
}

/// What each mode's bound does to each parameter; `None` where not computed.
pub fn sensitivity(document: &Document) -> Option<Table> {
    let list = document.resolution_span.as_deref()?;
    let methods: Vec<Method> = list.iter().map(|span| span.method).collect();
    let all = list
        .iter()
        .flat_map(|span| span.sensitivity.iter().map(move |row| (span, row)));
    let ordered = side_by_side(all, |row| row.1.mode, |row| row.0.method);
    if ordered.is_empty() {
        return None;
    }
    let with_kz = ordered.iter().any(|(_, row)| row.kz_percent.is_some());
    let mut columns: Vec<Column> = vec![
        number("Mode"),
        method_column(&methods),
        number("Bound (Hz)"),
        number("Reading (%)"),
    ];
    for name in names(with_kz) {
        columns.push(number(&format!("{name} moves (%)")));
    }
    let rows = ordered.into_iter().map(|(span, row)| {
        let mut cells = vec![
            row.mode.to_string(),
            span.method.name().to_owned(),
            significant(row.half_line, 3),
            reading_percent(document, row),
            signed_percent(row.kx_percent),
            signed_percent(row.ky_percent),
            signed_percent(row.kz_percent),
        ];
        cells.truncate(columns.len());
        cells
    });
    Some(Table {
        caption: "Which mode drives which parameter".to_owned(),
        rows: rows.collect(),
        note: all_drivers(list, with_kz),
        columns,
    })
}

/// The drivers by each method.
fn all_drivers(list: &[ResolutionSpanSection], with_kz: bool) -> String {
    let sentences = list.iter().filter_map(|span| {
        let drivers = drivers(&span.sensitivity, with_kz);
        let said = (!drivers.is_empty()).then_some(drivers)?;
        Some(match list.len() {
            1 => said,
            _ => format!("By the method {}: {said}", span.method.name()),
        })
    });
    sentences.collect::<Vec<_>>().join(" ")
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
