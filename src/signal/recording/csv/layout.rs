//! Layout of a text file: separator, columns, header, time column, first row.
//!
//! Decided from the head of the file. Of the four separators the one wins under which most lines
//! are rows of equally many numbers; the header is the text above the first row.

use std::collections::BTreeMap;

use crate::recording::error::RecordingError;
use crate::recording::text::{
    Cell, CellProblem, Separator, decode_text, is_comment, parse_number, shown, split_cells,
};
use crate::recording::units::{channel_unit, split_unit};

/// Bytes from which the layout is decided: thousands of ordinary rows.
pub(super) const HEAD_BYTES: usize = 1 << 18;

/// Units of temperature, which no channel has here and the names t and T often mean.
const TEMPERATURES: [&str; 9] = [
    "k", "\u{b0}c", "c", "degc", "\u{b0}f", "f", "degf", "celsius", "\u{2103}",
];

/// Layout of a text file.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::recording) struct CsvLayout {
    pub separator: Separator,
    /// Decimal mark, once a number has shown it.
    pub decimal: Option<u8>,
    /// Columns that hold numbers, those of the header included; an always empty last one (from a
    /// separator at the end of each line) does not count.
    pub columns: Vec<Column>,
    /// The time column, 0-based.
    pub time: Option<usize>,
    /// True where no heading names the time: the first column rises evenly.
    pub time_is_inferred: bool,
    /// Byte at which the first row begins.
    pub start: u64,
    /// Number of the line before the first row.
    pub lines_before: u64,
    /// Line end: `\n`, or `\r` in files of old.
    pub line_end: u8,
}

impl CsvLayout {
    /// Columns that are channels, in order.
    pub(super) fn channel_columns(&self) -> Vec<usize> {
        let all = 0..self.columns.len();
        all.filter(|column| Some(*column) != self.time).collect()
    }

    /// ` ("name")` for messages.
    pub(super) fn shown_name(&self, column: usize) -> String {
        let name = self.columns.get(column).and_then(|c| c.name.as_deref());
        name.map_or(String::new(), |name| format!(" (\"{name}\")"))
    }

    /// Returns the factor from the time column's unit to seconds.
    ///
    /// The unit stands in brackets, or at the end of the name ("t_ms"); without one it is the `stated` one (s), else
    /// seconds.
    pub(super) fn time_factor(
        &self,
        file: &str,
        stated: Option<f64>,
    ) -> Result<f64, RecordingError> {
        let column = self.time.map(|at| &self.columns[at]);
        let Some(column) = column else {
            return Ok(1.0);
        };
        let name = column.name.as_deref().unwrap_or_default();
        let suffix = name.rsplit('_').next().unwrap_or_default();
        let unit = channel_unit(column.unit.as_deref().unwrap_or(suffix));
        match (unit, &column.unit) {
            (Some((factor, "s")), _) => match stated {
                Some(stated) if stated != factor => {
                    let problem = format!(
                        "the heading gives the time in units of {factor} s, and time_unit states {stated} s; drop time_unit, or correct the heading"
                    );
                    Err(RecordingError::at_line(file, self.lines_before, problem))
                }
                _ => Ok(factor),
            },
            (_, None) => Ok(stated.unwrap_or(1.0)),
            (_, Some(unit)) => {
                let problem = format!(
                    "the time column's unit \"{unit}\" is not one of time; allowed: s, ms, us, ns, min, h"
                );
                Err(RecordingError::at_line(
                    file,
                    self.lines_before + 1,
                    problem,
                ))
            }
        }
    }
}

/// One column as the header has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::recording) struct Column {
    /// Name without the unit.
    pub name: Option<String>,
    /// Unit as written.
    pub unit: Option<String>,
}

impl Column {
    pub fn new(name: &str, unit: &str) -> Self {
        let [name, unit] = [name, unit].map(|text| Some(text.trim().to_owned()));
        Self {
            name: name.filter(|name| !name.is_empty()),
            unit: unit.filter(|unit| !unit.is_empty()),
        }
    }
}

/// A number in the head.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeadNumber<'a> {
    /// Line, 1-based.
    line: u64,
    pub value: f64,
    pub text: &'a [u8],
}

/// The complete lines at the beginning of a text file.
pub(super) struct Head<'a> {
    /// Byte at which each line begins, and the line.
    lines: Vec<(u64, &'a [u8])>,
    line_end: u8,
}

impl<'a> Head<'a> {
    /// Cuts the first [`HEAD_BYTES`] of a file, or all of them, into lines. A line that is cut off by the end of the
    /// head is left out.
    pub(super) fn new(head: &'a [u8]) -> Self {
        let line_end = match head.contains(&b'\n') {
            false if head.contains(&b'\r') => b'\r',
            _ => b'\n',
        };
        let is_whole_file = head.len() < HEAD_BYTES;
        let mut offset = 0;
        let mut lines = Vec::new();
        for line in head.split_inclusive(|byte| *byte == line_end) {
            if is_whole_file || line.ends_with(&[line_end]) {
                let byte_order_mark: &[u8] = if offset == 0 { b"\xef\xbb\xbf" } else { b"" };
                let text = line.strip_prefix(byte_order_mark).unwrap_or(line);
                lines.push((offset + (line.len() - text.len()) as u64, text));
            }
            offset += line.len() as u64;
        }
        Self { lines, line_end }
    }

    /// Finds the layout of the file; `file` names it in errors. Where `infers_time`, a first column without heading may
    /// be the time.
    pub(super) fn layout(
        &self,
        file: &str,
        infers_time: bool,
    ) -> Result<CsvLayout, RecordingError> {
        let candidates = Separator::ALL.map(|separator| Candidate::new(self, separator));
        // Most rows first, then a header that fits, then most columns, then the order of preference.
        let best = candidates.iter().rev().max_by_key(|one| {
            let above = one.line_above(one.first).map(|at| one.kinds[at]);
            let header_fits = above == Some(LineKind::Text(one.cells));
            (one.rows, header_fits, one.cells)
        });
        if let Some(best) = best.filter(|best| best.rows > 0) {
            let mut layout = best.layout(file)?;
            if infers_time && layout.time.is_none() && self.first_rises_evenly(&layout) {
                (layout.time, layout.time_is_inferred) = (Some(0), true);
            }
            return Ok(layout);
        }
        // The line with most digits, the first of several.
        let lines = self.lines.iter().enumerate().rev();
        let nearest = lines.max_by_key(|(_, (_, text))| {
            let digits = text.iter().filter(|byte| byte.is_ascii_digit());
            digits.count()
        });
        let (at, text) = nearest.map_or((0, &b""[..]), |(at, (_, text))| (at, text));
        let problem = format!(
            "no line of numbers found; the best candidate holds \"{}\" where a number is needed; allowed: numbers separated by comma, semicolon, tab or blanks",
            shown(text.trim_ascii())
        );
        Err(RecordingError::at_line(file, at as u64 + 1, problem))
    }

    /// Returns the readable numbers of one column below the header, rows of any kind included.
    pub(super) fn numbers(&self, layout: &CsvLayout, column: usize) -> Vec<HeadNumber<'a>> {
        let rows = layout.lines_before as usize..self.lines.len();
        self.numbers_in(rows, layout.separator, column)
    }

    /// Returns true where no column has a heading and the first rises in every row, nearly evenly in nine of ten steps:
    /// no signal does that. (Which steps are too uneven is found when the rows are read.)
    fn first_rises_evenly(&self, layout: &CsvLayout) -> bool {
        let named = |column: &Column| column.name.is_some() || column.unit.is_some();
        if layout.columns.len() < 2 || layout.columns.iter().any(named) {
            return false;
        }
        let numbers = self.numbers(layout, 0);
        let steps = numbers.windows(2).map(|pair| pair[1].value - pair[0].value);
        let mut sorted: Vec<f64> = steps.collect();
        sorted.sort_by(f64::total_cmp);
        let Some(median) = sorted.get(sorted.len() / 2) else {
            return false;
        };
        // Three rows are two steps; printed times are rounded, so a tenth.
        let near = sorted
            .iter()
            .filter(|step| (*step - median).abs() <= 0.1 * median);
        sorted.len() >= 2 && sorted[0] > 0.0 && 10 * near.count() >= 9 * sorted.len()
    }

    /// Returns true where text above the rows says that the columns are functions of frequency.
    pub(super) fn says_frequency(&self, layout: &CsvLayout) -> bool {
        let above = self.lines.iter().take(layout.lines_before as usize);
        above.clone().any(|(_, text)| {
            let cells = split_texts(text, layout.separator);
            let first = cells.first().map(|cell| cell.to_lowercase());
            let first = first.unwrap_or_default();
            cells.len() > 1
                && cells[1..].iter().all(|cell| cell.parse::<f64>().is_err())
                && (first == "hz" || first.starts_with("freq"))
        })
    }

    /// Returns the readable numbers of one column in some lines (0-based).
    fn numbers_in(
        &self,
        lines: impl Iterator<Item = usize>,
        separator: Separator,
        column: usize,
    ) -> Vec<HeadNumber<'a>> {
        let mut cells = Vec::new();
        let mut numbers = Vec::new();
        for at in lines {
            let line = self.lines[at].1;
            split_cells(line, separator, usize::MAX, &mut cells);
            if let Some(text) = cells.get(column).and_then(|cell| line.get(cell.clone()))
                && let Ok(value) = parse_number(text, &mut None)
            {
                let line = at as u64 + 1;
                numbers.push(HeadNumber { line, value, text });
            }
        }
        numbers
    }

    /// Returns the error of a file without a sample rate, with what the head shows of the time.
    pub(super) fn no_sample_rate(&self, layout: &CsvLayout, file: &str) -> RecordingError {
        let mut hint = String::new();
        if layout.time.is_some() {
            hint.push_str(" (a single row has no step)");
        } else {
            if let Some(column) = named_as_time(&layout.columns).first() {
                let numbers = self.numbers(layout, *column);
                let mut steps = numbers.windows(2);
                let flat = steps.clone().find(|step| step[1].value <= step[0].value);
                // A column that never rises is not blamed: T may be a temperature.
                if let Some([before, flat]) = flat
                    && steps.any(|step| step[1].value > step[0].value)
                {
                    let problem = format!(
                        "column {}{} is named as time, but repeats or falls here, as in most rows: {} after {}; export the time with more digits, or remove the column and give sample_rate in Hz",
                        column + 1,
                        layout.shown_name(*column),
                        flat.value,
                        before.value
                    );
                    return RecordingError::at_line(file, flat.line, problem);
                }
            }
            let evenly_rising = layout.channel_columns().into_iter().find(|column| {
                let numbers = self.numbers(layout, *column);
                let steps = numbers.windows(2).map(|pair| pair[1].value - pair[0].value);
                let shortest = steps.clone().fold(f64::INFINITY, f64::min);
                let longest = steps.clone().fold(0.0, f64::max);
                // A tenth: only a hint is made of it, and printed times are rounded.
                steps.len() >= 2 && shortest > 0.0 && longest - shortest <= 0.1 * longest
            });
            if let Some(column) = evenly_rising {
                hint = format!(" (column {} rises evenly: is it the time?)", column + 1);
            }
        }
        let problem = format!(
            "no time column and no sample rate{hint}; name the time column t or time (unit in brackets allowed), or give sample_rate in Hz"
        );
        RecordingError::at_line(file, layout.lines_before + 1, problem)
    }
}

/// Returns the columns named t, time (or that in German, French, Spanish), then those named t_* or time_*, but for
/// those whose unit says otherwise. Those with an unknown unit come after all others.
fn named_as_time(columns: &[Column]) -> Vec<usize> {
    let mut ranked = Vec::new();
    for (at, column) in columns.iter().enumerate() {
        // An unknown unit stays in the name; it is refused later, with its own message.
        let name = split_unit(column.name.as_deref().unwrap_or_default()).0;
        let name = name.to_ascii_lowercase();
        let exact = ["t", "time", "zeit", "temps", "tiempo"].contains(&name.as_str());
        if !exact && !name.starts_with("t_") && !name.starts_with("time_") {
            continue;
        }
        let unit = column.unit.as_deref().unwrap_or("s");
        let plain = unit.to_lowercase().replace([' ', '.'], "");
        let known = match channel_unit(unit) {
            Some((_, si)) if si != "s" => continue,
            None if TEMPERATURES.contains(&plain.as_str()) => continue,
            unit => unit.is_some(),
        };
        ranked.push((!known, !exact, at));
    }
    ranked.sort_unstable();
    ranked.into_iter().map(|(.., at)| at).collect()
}

/// Kind of a line under one separator, with its number of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LineKind {
    Blank,
    Comment,
    /// Numbers only (empty cells allowed).
    Row(usize),
    /// No number at all.
    Text(usize),
    /// Both; a number stands first.
    MixedNumberFirst(usize),
    /// Both; something else stands first.
    Mixed(usize),
}

impl LineKind {
    fn of(text: &[u8], separator: Separator, cells: &mut Vec<Cell>) -> Self {
        if text.trim_ascii().is_empty() {
            return Self::Blank;
        }
        if is_comment(text) {
            return Self::Comment;
        }
        split_cells(text, separator, usize::MAX, cells);
        let (mut numbers, mut others, mut number_first) = (0, 0, false);
        for (at, cell) in cells.iter().enumerate() {
            // Each cell may use either mark here; mixtures are found when the rows are read.
            match parse_number(text.get(cell.clone()).unwrap_or_default(), &mut None) {
                Ok(_) | Err(CellProblem::NotFinite) => {
                    numbers += 1;
                    number_first |= at == 0;
                }
                Err(CellProblem::Missing) => {}
                Err(CellProblem::Text | CellProblem::MixedDecimal(_)) => others += 1,
            }
        }
        match (numbers, others) {
            // Nothing but separators is text as well.
            (0, _) => Self::Text(cells.len()),
            (_, 0) => Self::Row(cells.len()),
            _ if number_first => Self::MixedNumberFirst(cells.len()),
            _ => Self::Mixed(cells.len()),
        }
    }

    /// Returns `true` for a line with text that has this many cells.
    fn is_header_of(self, columns: usize) -> bool {
        match self {
            Self::Text(cells) | Self::Mixed(cells) | Self::MixedNumberFirst(cells) => {
                cells == columns
            }
            Self::Blank | Self::Comment | Self::Row(_) => false,
        }
    }
}

/// The head under one separator.
struct Candidate<'a> {
    head: &'a Head<'a>,
    separator: Separator,
    /// Kind of each line.
    kinds: Vec<LineKind>,
    /// Cells of the commonest kind of row.
    cells: usize,
    /// Lines of that kind.
    rows: usize,
    /// The first of them.
    first: usize,
}

impl<'a> Candidate<'a> {
    fn new(head: &'a Head<'a>, separator: Separator) -> Self {
        let mut cells = Vec::new();
        let mut counts = BTreeMap::new();
        let lines = head.lines.iter();
        let kinds: Vec<LineKind> = lines
            .map(|(_, text)| LineKind::of(text, separator, &mut cells))
            .collect();
        for kind in &kinds {
            if let LineKind::Row(cells) = kind {
                *counts.entry(*cells).or_insert(0_usize) += 1;
            }
        }
        let commonest = counts.into_iter().max_by_key(|(_, rows)| *rows);
        let (cells, rows) = commonest.unwrap_or((0, 0));
        let first = kinds.iter().position(|kind| *kind == LineKind::Row(cells));
        Self {
            head,
            separator,
            kinds,
            cells,
            rows,
            first: first.unwrap_or(0),
        }
    }

    /// Index of the nearest line above `below` that is neither blank nor a comment.
    fn line_above(&self, below: usize) -> Option<usize> {
        self.kinds[..below]
            .iter()
            .rposition(|kind| !matches!(kind, LineKind::Blank | LineKind::Comment))
    }

    /// The layout under this separator, where there is a row.
    fn layout(&self, file: &str) -> Result<CsvLayout, RecordingError> {
        // A line that mixes numbers and text right below a header, or that starts with a number, is a damaged row and
        // not a title: it becomes the first row, so that reading it names what is wrong. The same holds for a row of
        // another length right below a header.
        let mut first = self.first;
        while let Some(at) = self.line_above(first) {
            let next = self.line_above(at);
            let below_header = next.is_some_and(|n| self.kinds[n] == LineKind::Text(self.cells));
            match self.kinds[at] {
                LineKind::MixedNumberFirst(_) => {}
                LineKind::Mixed(_) | LineKind::Row(_) if below_header => {}
                _ => break,
            }
            first = at;
        }
        let mut columns = self.header_above(first, file)?.unwrap_or_default();
        columns.resize(self.cells, Column::default());
        // Columns at the end that are empty in every row and in the header do not count.
        let mut last = columns
            .iter()
            .rposition(|column| column.name.is_some() || column.unit.is_some());
        let mut cells = Vec::new();
        let rows = (0..self.kinds.len()).filter(|at| self.kinds[*at] == LineKind::Row(self.cells));
        for at in rows.clone() {
            split_cells(
                self.head.lines[at].1,
                self.separator,
                usize::MAX,
                &mut cells,
            );
            last = last.max(cells.iter().rposition(|cell| !cell.is_empty()));
        }
        columns.truncate(last.map_or(0, |last| last + 1));
        // Time is named as such and rises in at least half of the steps of the head. (That it rises in all of them is
        // checked when the rows are read, and is an error there.)
        let time = named_as_time(&columns).into_iter().find(|column| {
            let rows = rows.clone().filter(|at| *at >= first);
            let numbers = self.head.numbers_in(rows, self.separator, *column);
            let steps = numbers.windows(2);
            let rising = steps.filter(|pair| pair[1].value > pair[0].value).count();
            2 * rising >= numbers.len().saturating_sub(1)
        });
        Ok(CsvLayout {
            separator: self.separator,
            decimal: None,
            time,
            time_is_inferred: false,
            columns,
            start: self.head.lines[first].0,
            lines_before: first as u64,
            line_end: self.head.line_end,
        })
    }

    /// Reads the header above the first row; `None` where there is none.
    fn header_above(
        &self,
        first: usize,
        file: &str,
    ) -> Result<Option<Vec<Column>>, RecordingError> {
        let Some(at) = self.line_above(first) else {
            return Ok(self.header_in_comment(first));
        };
        let (kind, here) = (self.kinds[at], self.texts(at));
        if kind.is_header_of(self.cells) {
            // It may itself be a line of units below the names: empty cells, units in brackets, or known ones.
            let units_only = here.iter().all(|cell| {
                let (name, unit) = split_unit(cell);
                cell.is_empty()
                    || (name.is_empty() && unit.is_some())
                    || channel_unit(cell).is_some()
            });
            let names = self
                .line_above(at)
                .filter(|above| units_only && self.kinds[*above].is_header_of(self.cells));
            let Some(names) = names.map(|above| self.texts(above)) else {
                return Ok(self.columns_of(here));
            };
            let cells = names.iter().zip(&here);
            let columns = cells.map(|(name, unit)| match split_unit(unit) {
                ("", Some(inner)) => Column::new(name, inner),
                _ => Column::new(name, unit),
            });
            return Ok(Some(columns.collect()));
        }
        Ok(match (kind, self.separator) {
            // Twice as many columns as names under the comma: it is the decimal mark as well.
            (LineKind::Text(names), Separator::Comma) if names > 1 && self.cells == 2 * names => {
                let problem = format!(
                    "{names} names head {} columns; when the comma is the decimal mark the separator must be semicolon, tab or blank; export it again",
                    self.cells
                );
                return Err(RecordingError::at_line(file, at as u64 + 1, problem));
            }
            (LineKind::Text(_), Separator::Blanks) => self.columns_of(joined_brackets(here)),
            _ => self.header_in_comment(first),
        })
    }

    /// Some programs write the names into the last comment above the rows.
    fn header_in_comment(&self, first: usize) -> Option<Vec<Column>> {
        let above = &self.kinds[..first];
        let comment = above.iter().rposition(|kind| *kind == LineKind::Comment)?;
        let text = decode_text(self.head.lines[comment].1.trim_ascii());
        let text = text.trim_start_matches(['#', '%', '/']);
        let mut names = split_texts(text.as_bytes(), self.separator);
        if self.separator == Separator::Blanks {
            names = joined_brackets(names);
        }
        let numbers = names
            .iter()
            .any(|name| parse_number(name.as_bytes(), &mut None) != Err(CellProblem::Text));
        self.columns_of(names).filter(|_| !numbers)
    }

    /// Columns of header cells, where they are as many as those of the rows.
    fn columns_of(&self, names: Vec<String>) -> Option<Vec<Column>> {
        let columns = names.iter().map(|cell| match split_unit(cell) {
            // Brackets that hold no known unit stay in the name as well, since "sensor (1)" and "sensor (2)" are two.
            (_, Some(unit)) if channel_unit(unit).is_none() => Column::new(cell, unit),
            (name, unit) => Column::new(name, unit.unwrap_or_default()),
        });
        (names.len() == self.cells).then(|| columns.collect())
    }

    fn texts(&self, at: usize) -> Vec<String> {
        split_texts(self.head.lines[at].1, self.separator)
    }
}

/// Splits a line into the texts of its cells.
pub(in crate::recording) fn split_texts(line: &[u8], separator: Separator) -> Vec<String> {
    let mut cells = Vec::new();
    split_cells(line, separator, usize::MAX, &mut cells);
    let cells = cells.into_iter().filter_map(|cell| line.get(cell));
    cells.map(decode_text).collect()
}

/// Joins cells that begin with a bracket to the cell before: under blanks a name such as "force (N)" falls into two.
pub(in crate::recording) fn joined_brackets(cells: Vec<String>) -> Vec<String> {
    let mut joined: Vec<String> = Vec::new();
    for cell in cells {
        match joined.last_mut() {
            Some(last) if cell.starts_with(['(', '[']) => {
                last.push(' ');
                last.push_str(&cell);
            }
            _ => joined.push(cell),
        }
    }
    joined
}
