//! Which column of a text file is the time.

use super::header::Column;
use super::layout::{CsvLayout, HeadExtent, head_lines};
use super::text::{parse_number, split_cells};
use super::units::{channel_unit, split_unit};

/// The time column: named t, time (or that in German, French, Spanish), t_* or time_*, and rising in at least half of the steps of
/// the head. (That it rises in all of them is checked when the rows are read, and is an error
/// there.)
///
/// `rising_steps` tells of a column, 0-based, how many of how many steps rise.
pub(super) fn time_column(
    columns: &[Column],
    rising_steps: impl Fn(usize) -> (usize, usize),
) -> Option<usize> {
    named_as_time(columns).find(|at| {
        let (rising, steps) = rising_steps(*at);
        2 * rising >= steps
    })
}

/// Columns named t, time or the like, then those named t_* or time_*, but for those whose unit says otherwise. Those
/// whose unit nobody knows come after all others.
fn named_as_time(columns: &[Column]) -> impl Iterator<Item = usize> {
    let names = |exact: bool, known: bool| {
        let is_time = move |column: &Column| {
            // An unknown unit stays in the name; it is refused later, with its own message.
            let name = split_unit(column.name.as_deref().unwrap_or_default()).0;
            let name = name.to_ascii_lowercase();
            match exact {
                true => ["t", "time", "zeit", "temps", "tiempo"].contains(&name.as_str()),
                false => name.starts_with("t_") || name.starts_with("time_"),
            }
        };
        (0..columns.len()).filter(move |at| {
            let column = columns.get(*at);
            let wanted = match known {
                true => TimeUnit::OfTime,
                false => TimeUnit::Unknown,
            };
            column.is_some_and(|column| is_time(column) && time_unit(column) == wanted)
        })
    };
    let of_time = names(true, true).chain(names(false, true));
    of_time.chain(names(true, false)).chain(names(false, false))
}

/// A column named as time whose values do not rise throughout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FlatTime {
    /// Column, 0-based.
    pub column: usize,
    /// First line in which it does not rise, 1-based.
    pub line: u64,
    /// Value there and the one before.
    pub values: [f64; 2],
}

/// Units of temperature, which no channel has here and the names t and T often mean.
const TEMPERATURES: [&str; 9] = [
    "k", "\u{b0}c", "c", "degc", "\u{b0}f", "f", "degf", "celsius", "\u{2103}",
];

/// What the unit of a column named as time says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TimeUnit {
    /// A unit of time, or none.
    OfTime,
    /// One that is not known. It may be one of time, "sec.": that is an error worth telling.
    Unknown,
    /// That the column is no time.
    Other,
}

fn time_unit(column: &Column) -> TimeUnit {
    let unit = column.unit.as_deref().unwrap_or("s");
    let plain = unit.to_lowercase().replace([' ', '.'], "");
    match channel_unit(unit) {
        Some((_, "s")) => TimeUnit::OfTime,
        Some(_) => TimeUnit::Other,
        None if TEMPERATURES.contains(&plain.as_str()) => TimeUnit::Other,
        None => TimeUnit::Unknown,
    }
}

/// The column that is named as time without being one, and where that shows first in the head; `None` of one that
/// stands still, a temperature perhaps.
pub(super) fn flat_time(head: &[u8], whole: HeadExtent, layout: &CsvLayout) -> Option<FlatTime> {
    let column = named_as_time(&layout.columns).next()?;
    let mut cells = Vec::new();
    let lines = head_lines(head, layout.line_end, whole);
    let rows = lines.iter().enumerate();
    let values = rows
        .skip_while(|(_, (offset, _))| *offset < layout.start)
        .filter_map(|(at, (_, text))| {
            split_cells(text, layout.separator, &mut cells);
            let cell = text.get(cells.get(column)?.clone())?;
            Some((at as u64 + 1, parse_number(cell, &mut None).ok()?))
        });
    let values: Vec<(u64, f64)> = values.collect();
    let mut steps = values.windows(2);
    let (line, value, previous) = steps.clone().find_map(|step| {
        let ((_, previous), (line, value)) = (step[0], step[1]);
        (value <= previous).then_some((line, value, previous))
    })?;
    let rises = steps.any(|step| step[1].1 > step[0].1);
    rises.then_some(FlatTime {
        column,
        line,
        values: [value, previous],
    })
}
