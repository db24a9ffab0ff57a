//! Which line is the header, and its cells as names and units.

use super::error::RecordingError;
use super::layout::{Candidate, FirstCell, LineKind};
use super::text::{Cell, CellProblem, Separator, decode_text, parse_number, split_cells};
use super::units::{channel_unit, split_unit};

/// One column as the header has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Column {
    /// Name without the unit.
    pub name: Option<String>,
    /// Unit as written.
    pub unit: Option<String>,
}

impl Candidate<'_> {
    /// The first row, and the header above it.
    ///
    /// A line that mixes numbers and text right below a header, or that starts with a number, is a
    /// damaged row and not a title: it becomes the first row, so that reading it names what is
    /// wrong. The same holds for a row of another length right below a header.
    pub(super) fn first_row_and_header(
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
        let is_header = |above: &usize| match self.kind(*above) {
            Some(LineKind::Text(cells) | LineKind::Mixed(cells, _)) => cells == self.cells,
            _ => false,
        };
        match self.line_above(at).filter(is_header) {
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
