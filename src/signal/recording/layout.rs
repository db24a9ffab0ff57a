//! How a text file is laid out: separator, columns, header, first row.
//!
//! Decided from the head of the file. Of the four separators the one wins under which most lines
//! are rows of equally many numbers; the header is the text above the first row.

use super::error::RecordingError;
use super::header::Column;
use super::text::{Cell, CellProblem, Separator, is_comment, parse_number, shown, split_cells};
use super::time_column::time_column;

/// The layout of a text file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CsvLayout {
    pub separator: Separator,
    /// Decimal mark, once a number has shown it.
    pub decimal: Option<u8>,
    /// Columns that hold numbers, those of the header included; an always empty last one (from a
    /// separator at the end of each line) does not count.
    pub columns: Vec<Column>,
    /// Which column is the time, 0-based.
    pub time: Option<usize>,
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
}

/// A line of the head.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeadLine<'a> {
    pub text: &'a [u8],
    pub offset: u64,
    pub kind: LineKind,
}

/// What a line is under one separator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LineKind {
    Blank,
    Comment,
    /// Numbers only (empty cells allowed): this many cells.
    Row(usize),
    /// No number at all: this many cells.
    Text(usize),
    /// Both: this many cells, and whether the first is a number.
    Mixed(usize, FirstCell),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FirstCell {
    Number,
    Other,
}

/// The head under one separator.
pub(super) struct Candidate<'a> {
    pub separator: Separator,
    pub lines: Vec<HeadLine<'a>>,
    /// Cells of the commonest kind of row.
    pub cells: usize,
    /// Lines of that kind.
    rows: usize,
    /// The first of them.
    pub first: usize,
}

/// Finds the layout of a text that begins with `head`. `whole` says whether the head is the file.
pub(super) fn detect(
    head: &[u8],
    whole: HeadExtent,
    file: &str,
) -> Result<CsvLayout, RecordingError> {
    let line_end = match head.contains(&b'\n') {
        false if head.contains(&b'\r') => b'\r',
        _ => b'\n',
    };
    let lines = head_lines(head, line_end, whole);
    let candidates = Separator::ALL.map(|separator| Candidate::new(&lines, separator));
    // Most rows first, then a header that fits, then most columns, then the order of preference.
    let best = candidates
        .iter()
        .rev()
        .max_by_key(|candidate| (candidate.rows, candidate.header_fits(), candidate.cells));
    match best {
        Some(best) if best.rows > 0 => best.layout(line_end, file),
        _ => Err(no_numbers(&lines, file)),
    }
}

/// Whether the head is all there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HeadExtent {
    WholeFile,
    Part,
}

/// The lines of the head with their offsets; one that is cut off by the end of the head is left out.
pub(super) fn head_lines(head: &[u8], line_end: u8, whole: HeadExtent) -> Vec<(u64, &[u8])> {
    let byte_order_mark = b"\xef\xbb\xbf";
    let mut offset = 0;
    let mut lines = Vec::new();
    for line in head.split_inclusive(|byte| *byte == line_end) {
        if whole == HeadExtent::WholeFile || line.ends_with(&[line_end]) {
            let text = match offset {
                0 => line.strip_prefix(byte_order_mark).unwrap_or(line),
                _ => line,
            };
            lines.push((offset + (line.len() - text.len()) as u64, text));
        }
        offset += line.len() as u64;
    }
    lines
}

fn line_kind(text: &[u8], separator: Separator, cells: &mut Vec<Cell>) -> LineKind {
    if text.trim_ascii().is_empty() {
        return LineKind::Blank;
    }
    if is_comment(text) {
        return LineKind::Comment;
    }
    split_cells(text, separator, cells);
    let (mut numbers, mut others, mut first) = (0, 0, FirstCell::Other);
    for (at, cell) in cells.iter().enumerate() {
        // Each cell may use either mark here; mixtures are found when the rows are read.
        match parse_number(text.get(cell.clone()).unwrap_or_default(), &mut None) {
            Ok(_) | Err(CellProblem::NotFinite) => {
                numbers += 1;
                if at == 0 {
                    first = FirstCell::Number;
                }
            }
            Err(CellProblem::Missing) => {}
            Err(CellProblem::Text | CellProblem::MixedDecimal(_)) => others += 1,
        }
    }
    match (numbers, others) {
        // Nothing but separators.
        (0, 0) => LineKind::Text(cells.len()),
        (_, 0) => LineKind::Row(cells.len()),
        (0, _) => LineKind::Text(cells.len()),
        _ => LineKind::Mixed(cells.len(), first),
    }
}

impl<'a> Candidate<'a> {
    fn new(lines: &[(u64, &'a [u8])], separator: Separator) -> Self {
        let mut cells = Vec::new();
        let lines: Vec<HeadLine<'a>> = lines
            .iter()
            .map(|&(offset, text)| HeadLine {
                text,
                offset,
                kind: line_kind(text, separator, &mut cells),
            })
            .collect();
        let mut counts = std::collections::BTreeMap::new();
        for line in &lines {
            if let LineKind::Row(cells) = line.kind {
                *counts.entry(cells).or_insert(0_usize) += 1;
            }
        }
        let commonest = counts.into_iter().max_by_key(|(_, rows)| *rows);
        let (cells, rows) = commonest.unwrap_or((0, 0));
        let first = lines.iter().position(|l| l.kind == LineKind::Row(cells));
        Self {
            separator,
            lines,
            cells,
            rows,
            first: first.unwrap_or(0),
        }
    }

    /// Index of the nearest line above `below` that is neither blank nor a comment.
    pub(super) fn line_above(&self, below: usize) -> Option<usize> {
        let above = self.lines.get(..below).unwrap_or_default();
        above
            .iter()
            .rposition(|line| !matches!(line.kind, LineKind::Blank | LineKind::Comment))
    }

    pub(super) fn kind(&self, at: usize) -> Option<LineKind> {
        self.lines.get(at).map(|line| line.kind)
    }

    /// Whether there is text above the first row with as many cells as the row.
    fn header_fits(&self) -> bool {
        let header = self.line_above(self.first).and_then(|at| self.kind(at));
        header == Some(LineKind::Text(self.cells))
    }

    fn layout(&self, line_end: u8, file: &str) -> Result<CsvLayout, RecordingError> {
        let (first, header) = self.first_row_and_header(file)?;
        let mut columns = header.unwrap_or_default();
        columns.resize(self.cells, Column::default());
        let used = self.used_columns(&columns);
        columns.truncate(used);
        let time = self.time_column(&columns, first);
        let start = self.lines.get(first).map_or(0, |line| line.offset);
        Ok(CsvLayout {
            separator: self.separator,
            decimal: None,
            columns,
            time,
            start,
            lines_before: first as u64,
            line_end,
        })
    }

    /// Columns without those at the end that are empty in every row and in the header.
    fn used_columns(&self, columns: &[Column]) -> usize {
        let mut cells = Vec::new();
        let mut used = columns
            .iter()
            .rposition(|c| c.name.is_some() || c.unit.is_some());
        for line in &self.lines {
            if line.kind == LineKind::Row(self.cells) {
                split_cells(line.text, self.separator, &mut cells);
                used = used.max(cells.iter().rposition(|cell| !cell.is_empty()));
            }
        }
        used.map_or(0, |last| last + 1)
    }

    fn time_column(&self, columns: &[Column], first: usize) -> Option<usize> {
        time_column(columns, |at| self.rising_steps(at, first))
    }

    /// How many steps of a column in the head rise, and of how many.
    fn rising_steps(&self, column: usize, first: usize) -> (usize, usize) {
        let values = self.column_values(column, first);
        let rising = values.windows(2).filter(|pair| pair[1] > pair[0]).count();
        (rising, values.len().saturating_sub(1))
    }

    /// The readable numbers of one column in the head.
    fn column_values(&self, column: usize, first: usize) -> Vec<f64> {
        let mut cells = Vec::new();
        let rows = self.lines.iter().skip(first);
        rows.filter(|line| line.kind == LineKind::Row(self.cells))
            .filter_map(|line| {
                split_cells(line.text, self.separator, &mut cells);
                let cell = line.text.get(cells.get(column)?.clone())?;
                parse_number(cell, &mut None).ok()
            })
            .collect()
    }
}

/// The error of a text without rows shows the line that has most numbers.
fn no_numbers(lines: &[(u64, &[u8])], file: &str) -> RecordingError {
    let digits = |text: &[u8]| text.iter().filter(|byte| byte.is_ascii_digit()).count();
    let nearest = lines
        .iter()
        .enumerate()
        .rev()
        .max_by_key(|(_, (_, text))| digits(text));
    RecordingError::NoNumbers {
        file: file.to_owned(),
        line: nearest.map_or(1, |(at, _)| at as u64 + 1),
        value: nearest.map_or(String::new(), |(_, (_, text))| shown(text.trim_ascii())),
    }
}

/// The readable numbers of one column in the head, with their text, rows of any kind included.
pub(super) fn column_cells<'a>(
    head: &'a [u8],
    whole: HeadExtent,
    layout: &CsvLayout,
    column: usize,
) -> Vec<(f64, &'a [u8])> {
    let mut cells = Vec::new();
    let lines = head_lines(head, layout.line_end, whole);
    let rows = lines
        .iter()
        .skip_while(|(offset, _)| *offset < layout.start);
    rows.filter_map(|(_, text)| {
        split_cells(text, layout.separator, &mut cells);
        let cell = text.get(cells.get(column)?.clone())?;
        Some((parse_number(cell, &mut None).ok()?, cell))
    })
    .collect()
}

/// A channel without a name whose values in the head rise in equal steps: probably the time.
pub(super) fn evenly_rising_column(
    head: &[u8],
    whole: HeadExtent,
    layout: &CsvLayout,
) -> Option<usize> {
    layout.channel_columns().into_iter().find(|column| {
        let cells = column_cells(head, whole, layout, *column);
        let steps: Vec<f64> = cells
            .windows(2)
            .filter_map(|pair| Some(pair.last()?.0 - pair.first()?.0))
            .collect();
        let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = steps.iter().copied().fold(0.0, f64::max);
        // A tenth: only a hint is made of it, and printed times are rounded.
        steps.len() >= 2 && shortest > 0.0 && longest - shortest <= 0.1 * longest
    })
}
