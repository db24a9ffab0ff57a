//! How a text file is laid out: separator, columns, header, first row.
//!
//! Decided from the head of the file. Of the four separators the one wins under which most lines
//! are rows of equally many numbers; the header is the text above the first row.

use super::error::RecordingError;
use super::text::{
    Cell, CellProblem, Separator, decode_text, is_comment, parse_number, shown, split_cells,
};
use super::units::{channel_unit, split_unit};

/// One column as the header has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Column {
    /// Name without the unit.
    pub name: Option<String>,
    /// Unit as written.
    pub unit: Option<String>,
}

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
struct HeadLine<'a> {
    text: &'a [u8],
    offset: u64,
    kind: LineKind,
}

/// What a line is under one separator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LineKind {
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
enum FirstCell {
    Number,
    Other,
}

/// The head under one separator.
struct Candidate<'a> {
    separator: Separator,
    lines: Vec<HeadLine<'a>>,
    /// Cells of the commonest kind of row.
    cells: usize,
    /// Lines of that kind.
    rows: usize,
    /// The first of them.
    first: usize,
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
fn head_lines(head: &[u8], line_end: u8, whole: HeadExtent) -> Vec<(u64, &[u8])> {
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
    fn line_above(&self, below: usize) -> Option<usize> {
        let above = self.lines.get(..below).unwrap_or_default();
        above
            .iter()
            .rposition(|line| !matches!(line.kind, LineKind::Blank | LineKind::Comment))
    }

    fn kind(&self, at: usize) -> Option<LineKind> {
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

    /// The first row, and the header above it.
    ///
    /// A line that mixes numbers and text right below a header, or that starts with a number, is a
    /// damaged row and not a title: it becomes the first row, so that reading it names what is
    /// wrong. The same holds for a row of another length right below a header.
    fn first_row_and_header(
        &self,
        file: &str,
    ) -> Result<(usize, Option<Vec<Column>>), RecordingError> {
        let mut first = self.first;
        let mut above = self.line_above(first);
        while let Some(at) = above {
            let next = self.line_above(at);
            let below_header =
                next.is_some_and(|n| self.kind(n) == Some(LineKind::Text(self.cells)));
            let damaged = match self.kind(at) {
                Some(LineKind::Mixed(_, FirstCell::Number)) => true,
                Some(LineKind::Mixed(..) | LineKind::Row(_)) => below_header,
                _ => false,
            };
            if !damaged {
                break;
            }
            first = at;
            above = next;
        }
        let header = match above.map(|at| (at, self.kind(at))) {
            Some((at, Some(LineKind::Text(cells) | LineKind::Mixed(cells, _))))
                if cells == self.cells =>
            {
                Some(self.header(at))
            }
            Some((at, Some(LineKind::Text(names)))) if self.comma_is_ambiguous(names) => {
                return Err(RecordingError::AmbiguousComma {
                    file: file.to_owned(),
                    line: at as u64 + 1,
                    names,
                    columns: self.cells,
                });
            }
            Some((at, Some(LineKind::Text(_)))) if self.separator == Separator::Blanks => {
                self.header_with_blanks(at)
            }
            _ => self.header_in_comment(first),
        };
        Ok((first, header))
    }

    /// Twice as many columns as names under the comma: it is the decimal mark as well.
    fn comma_is_ambiguous(&self, names: usize) -> bool {
        self.separator == Separator::Comma && names > 1 && self.cells == 2 * names
    }

    /// Names and units from the line at `at`, which may itself be a line of units below the names.
    fn header(&self, at: usize) -> Vec<Column> {
        let here = self.texts(at);
        let above = self
            .line_above(at)
            .filter(|above| self.kind(*above) == Some(LineKind::Text(self.cells)));
        match above {
            Some(above) if here.iter().all(|cell| is_unit_cell(cell)) => {
                let names = self.texts(above);
                names.iter().zip(&here).map(name_and_unit).collect()
            }
            _ => here.iter().map(|cell| column(cell)).collect(),
        }
    }

    /// Under blanks a name such as "force (N)" falls into two cells: brackets join the cell before.
    fn header_with_blanks(&self, at: usize) -> Option<Vec<Column>> {
        let names = joined_brackets(self.texts(at));
        (names.len() == self.cells).then(|| names.iter().map(|cell| column(cell)).collect())
    }

    /// Some programs write the names into the last comment above the rows.
    fn header_in_comment(&self, first: usize) -> Option<Vec<Column>> {
        let above = self.lines.get(..first)?;
        let comment = above.iter().rfind(|line| line.kind == LineKind::Comment)?;
        let text = decode_text(comment.text.trim_ascii());
        let text = text.trim_start_matches(['#', '%', '/']);
        let mut cells = Vec::new();
        split_cells(text.as_bytes(), self.separator, &mut cells);
        let mut names = texts_of(text.as_bytes(), &cells);
        if self.separator == Separator::Blanks {
            names = joined_brackets(names);
        }
        let is_number =
            |name: &String| parse_number(name.as_bytes(), &mut None) != Err(CellProblem::Text);
        let fits = names.len() == self.cells && !names.iter().any(is_number);
        fits.then(|| names.iter().map(|cell| column(cell)).collect())
    }

    fn texts(&self, at: usize) -> Vec<String> {
        let text = self.lines.get(at).map_or(&b""[..], |line| line.text);
        let mut cells = Vec::new();
        split_cells(text, self.separator, &mut cells);
        texts_of(text, &cells)
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

    /// The time column: named t, time, t_* or time_*, and rising in most steps of the head. (That
    /// it rises in all of them is checked when the rows are read, and is an error there.)
    fn time_column(&self, columns: &[Column], first: usize) -> Option<usize> {
        let names = |exact: bool| {
            let is_time = move |column: &Column| {
                let name = column.name.as_deref().unwrap_or_default();
                let name = name.to_ascii_lowercase();
                match exact {
                    true => name == "t" || name == "time",
                    false => name.starts_with("t_") || name.starts_with("time_"),
                }
            };
            (0..columns.len()).filter(move |at| columns.get(*at).is_some_and(is_time))
        };
        names(true)
            .chain(names(false))
            .find(|column| self.rises(*column, first))
    }

    fn rises(&self, column: usize, first: usize) -> bool {
        let values = self.column_values(column, first);
        let steps = values.len().saturating_sub(1);
        let rising = values
            .windows(2)
            .filter(|pair| pair.last() > pair.first())
            .count();
        steps == 0 || 2 * rising > steps
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

fn texts_of(text: &[u8], cells: &[Cell]) -> Vec<String> {
    let cells = cells.iter();
    cells
        .map(|cell| decode_text(text.get(cell.clone()).unwrap_or_default()))
        .collect()
}

/// A cell of a line of units: empty, in brackets, or a known unit.
fn is_unit_cell(cell: &str) -> bool {
    let (name, unit) = split_unit(cell);
    cell.is_empty() || (name.is_empty() && unit.is_some()) || channel_unit(cell).is_some()
}

fn name_and_unit((name, unit): (&String, &String)) -> Column {
    let bare = match split_unit(unit) {
        ("", Some(inner)) => inner.to_owned(),
        _ => unit.clone(),
    };
    Column {
        name: some_text(name),
        unit: some_text(&bare),
    }
}

/// A header cell as name and unit. Brackets that hold no known unit stay in the name as well,
/// since "sensor (1)" and "sensor (2)" are two names.
fn column(cell: &str) -> Column {
    let (name, unit) = split_unit(cell);
    match unit {
        Some(unit) if channel_unit(unit).is_some() => Column {
            name: some_text(name),
            unit: some_text(unit),
        },
        Some(unit) => Column {
            name: some_text(cell),
            unit: some_text(unit),
        },
        None => Column {
            name: some_text(name),
            unit: None,
        },
    }
}

fn some_text(text: &str) -> Option<String> {
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

fn joined_brackets(cells: Vec<String>) -> Vec<String> {
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
