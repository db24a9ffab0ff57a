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

/// Columns named t, time or the like, then those named t_* or time_*, but for those whose unit says otherwise.
fn named_as_time(columns: &[Column]) -> impl Iterator<Item = usize> {
    let names = |exact: bool| {
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
            column.is_some_and(|column| is_time(column) && !has_other_unit(column))
        })
    };
    names(true).chain(names(false))
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
const TEMPERATURES: [&str; 7] = ["K", "\u{b0}C", "C", "degC", "\u{b0}F", "F", "degF"];

/// Whether a column's unit says that it is no time. One that is not known may be one of time, "sec.": that is an
/// error worth telling.
fn has_other_unit(column: &Column) -> bool {
    let unit = column.unit.as_deref().unwrap_or("s");
    match channel_unit(unit) {
        Some((_, si)) => si != "s",
        None => TEMPERATURES.contains(&unit),
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
