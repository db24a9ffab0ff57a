//! Which column of a text file is the time.

use super::header::Column;
use super::layout::{CsvLayout, HeadExtent, head_lines};
use super::text::{parse_number, split_cells};
use super::units::{channel_unit, split_unit};

/// The time column: named t, time (or that in German, French, Spanish), t_* or time_*, and rising in at least half of the steps of
/// the head. (That it rises in all of them is checked when the rows are read, and is an error
/// there.) One that may as well be a temperature has to rise in all of them, and comes last.
///
/// `rising_steps` tells of a column, 0-based, how many of how many steps rise.
pub(super) fn time_column(
    columns: &[Column],
    rising_steps: impl Fn(usize) -> (usize, usize),
) -> Option<usize> {
    let rises = |doubt: Doubt| {
        named_as_time(columns).find(|at| {
            let (rising, steps) = rising_steps(*at);
            let enough = match doubt {
                Doubt::None => 2 * rising >= steps,
                Doubt::Temperature => steps > 0 && rising == steps,
                Doubt::OtherUnit => false,
            };
            columns.get(*at).map(doubt_of_time) == Some(doubt) && enough
        })
    };
    rises(Doubt::None).or_else(|| rises(Doubt::Temperature))
}

/// Columns named t, time or the like, then those named t_* or time_*.
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
        (0..columns.len()).filter(move |at| columns.get(*at).is_some_and(is_time))
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

/// What speaks against the time in a column that is named as time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doubt {
    None,
    /// "T (°C)": a unit that is not known, which for "time (sec.)" is an error worth telling.
    Temperature,
    /// A unit that is known, and none of time.
    OtherUnit,
}

fn doubt_of_time(column: &Column) -> Doubt {
    let name = split_unit(column.name.as_deref().unwrap_or_default()).0;
    match column.unit.as_deref().map(channel_unit) {
        Some(Some((_, si))) if si != "s" => Doubt::OtherUnit,
        Some(None) if name.to_ascii_lowercase().split('_').next() == Some("t") => {
            Doubt::Temperature
        }
        _ => Doubt::None,
    }
}

/// The column that is named as time without being one, and where that shows first in the head; `None` of one that
/// stands still, a temperature perhaps.
pub(super) fn flat_time(head: &[u8], whole: HeadExtent, layout: &CsvLayout) -> Option<FlatTime> {
    let is_time = |at: &usize| layout.columns.get(*at).map(doubt_of_time) == Some(Doubt::None);
    let column = named_as_time(&layout.columns).find(is_time)?;
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
