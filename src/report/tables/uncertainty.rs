//! Tables of how far the estimate moves when the frequencies do.

use super::super::document::{Document, Method, SensitivitySection};
use super::super::format::{
    RIGID, bound_percent, optional, or_missing, signed, signed_percent, significant, trimmed,
};
use super::{Column, Table, mode_of, number, words};

/// Returns the non-dimensional values that changes are counted from.
fn base(document: &Document, method: Method) -> [Option<f64>; 3] {
    let Some(estimate) = document.estimate.as_ref().and_then(Option::as_ref) else {
        return [None; 3];
    };
    match &estimate.pairs {
        Some(pairs) if method == Method::Pairs => [pairs.kx, pairs.ky, pairs.kz],
        _ => [&estimate.kx, &estimate.ky, &estimate.kz].map(|value| Some(value.as_ref()?.value)),
    }
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

/// Returns a stiffness in five digits; "rigid" beyond all bounds.
pub(super) fn stiffness(value: Option<f64>) -> String {
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
    let mut rows = Vec::new();
    for row in ordered {
        let mut cells = vec![
            format!("\u{b1}{}", trimmed(row.percent, 4)),
            row.method.name().to_owned(),
        ];
        for percent in [
            row.kx_percent,
            row.ky_percent,
            row.kz_percent,
            row.kx_of_mean_percent,
            row.ky_of_mean_percent,
            row.kz_of_mean_percent,
        ] {
            cells.push(optional(percent, 3));
        }
        rows.push(cells);
    }
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
        rows,
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
    let failed = list.iter().map(|found| (found.method, found.failed));
    let mut note = format!(
        "{} draws, each frequency with its own standard deviation.{}",
        list.first().map_or(0, |found| found.samples),
        failures(&failed.collect::<Vec<_>>(), " and are left out")
    );
    if methods.contains(&Method::Consistent) {
        note.push_str(
            " The consistent estimate draws the beam's properties that have a tolerance as well.",
        );
    }
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
        note,
    };
    Some(table.without_empty_columns())
}

/// Returns how many repetitions left no estimate, by each method, and what follows from that.
fn failures(failed: &[(Method, usize)], consequence: &str) -> String {
    let mut words = String::new();
    for (method, count) in failed.iter().filter(|(_, count)| *count > 0) {
        let by = match failed.len() {
            1 => String::new(),
            _ => format!(" by the method {}", method.name()),
        };
        words.push_str(&format!(
            " {count} of them leave no estimate{by}{consequence}."
        ));
    }
    words
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
    let failed = list.iter().map(|span| (span.method, span.failed));
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
        note: format!(
            "{} sign patterns tried.{}",
            list.first().map_or(0, |span| span.patterns),
            failures(&failed.collect::<Vec<_>>(), ": the span is open")
        ),
    })
}

/// Change of each parameter by each mode's bound; `None` where not computed.
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
        let mode = mode_of(document, row.mode).filter(|mode| mode.frequency > 0.0);
        let percent = mode.map(|mode| 100.0 * row.half_line / mode.frequency);
        let mut cells = vec![
            row.mode.to_string(),
            span.method.name().to_owned(),
            significant(row.half_line, 3),
            or_missing(percent.map(bound_percent)),
            signed_percent(row.kx_percent),
            signed_percent(row.ky_percent),
            signed_percent(row.kz_percent),
        ];
        cells.truncate(columns.len());
        cells
    });
    let mut notes = Vec::new();
    for span in list {
        let drivers = drivers(&span.sensitivity, with_kz);
        if !drivers.is_empty() {
            notes.push(match list.len() {
                1 => drivers,
                _ => format!("By the method {}: {drivers}", span.method.name()),
            });
        }
    }
    Some(Table {
        caption: "Which mode drives which parameter".to_owned(),
        rows: rows.collect(),
        note: notes.join(" "),
        columns,
    })
}

/// Returns "Kx depends most on mode 4, Ky on mode 1."; empty where nothing depends on any.
fn drivers(list: &[SensitivitySection], with_kz: bool) -> String {
    let mut drivers: Vec<String> = Vec::new();
    for (index, name) in names(with_kz).iter().enumerate() {
        let strengths = list.iter().map(|row| {
            let percent = [row.kx_percent, row.ky_percent, row.kz_percent][index];
            (percent.map_or(0.0, f64::abs), row.mode)
        });
        let strengths = strengths.filter(|(strength, _)| *strength > 0.0);
        if let Some((_, mode)) = strengths.max_by(|a, b| a.0.total_cmp(&b.0)) {
            let depends = if drivers.is_empty() {
                " depends most"
            } else {
                ""
            };
            drivers.push(format!("{name}{depends} on mode {mode}"));
        }
    }
    match drivers.is_empty() {
        true => String::new(),
        false => drivers.join(", ") + ".",
    }
}
