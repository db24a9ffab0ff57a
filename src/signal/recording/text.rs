//! Cells and numbers of a line of text.
//!
//! Lines are split here and not by the crate `csv`, which reads other values from some files: a quote behind a
//! blank (`1; "2"`) stays part of its cell, a quote that is never closed takes in the following lines, empty lines
//! disappear, and runs of blanks are no separator. Speed is the same.

use std::ops::Range;

/// Separator of the numbers of a CSV file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// `\t`.
    Tab,
    /// `;`.
    Semicolon,
    /// `,`.
    Comma,
    /// One or more blanks or tabs.
    Blanks,
}

impl Separator {
    /// In order of preference where several fit equally well.
    pub(super) const ALL: [Self; 4] = [Self::Tab, Self::Semicolon, Self::Comma, Self::Blanks];

    fn bytes(self) -> &'static [u8] {
        match self {
            Self::Tab => b"\t",
            Self::Semicolon => b";",
            Self::Comma => b",",
            Self::Blanks => b" \t",
        }
    }
}

/// Place of a cell in its line (bytes).
pub(super) type Cell = Range<usize>;

/// Splits a line into cells, quotes and surrounding blanks removed. `cells` is reused.
pub(super) fn split_cells(line: &[u8], separator: Separator, cells: &mut Vec<Cell>) {
    cells.clear();
    // Tabs at the end stay: they may be separators before an empty last cell.
    let last = line
        .iter()
        .rposition(|byte| !matches!(byte, b'\r' | b'\n' | b' ' | 0x1a | 0x0c));
    let line = line
        .get(..last.map_or(0, |last| last + 1))
        .unwrap_or_default();
    let bytes = separator.bytes();
    let (mut start, mut quoted) = (0, false);
    for (at, byte) in line.iter().enumerate() {
        quoted ^= *byte == b'"';
        if !quoted && bytes.contains(byte) {
            // One or more blanks separate, so that there is no cell between two of them.
            if at > start || separator != Separator::Blanks {
                cells.push(trimmed(line, start..at));
            }
            start = at + 1;
        }
    }
    if line.len() > start || separator != Separator::Blanks {
        cells.push(trimmed(line, start..line.len()));
    }
}

/// Returns the cell without surrounding blanks and without one pair of quotes.
fn trimmed(line: &[u8], cell: Cell) -> Cell {
    let cell = without_blanks(line, cell);
    match line.get(cell.clone()) {
        Some([b'"', .., b'"']) => without_blanks(line, cell.start + 1..cell.end - 1),
        _ => cell,
    }
}

fn without_blanks(line: &[u8], cell: Cell) -> Cell {
    let bytes = line.get(cell.clone()).unwrap_or_default();
    let start = cell.start + bytes.len() - bytes.trim_ascii_start().len();
    start..start + bytes.trim_ascii().len()
}

/// Reason why a cell is no usable number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CellProblem {
    Missing,
    Text,
    NotFinite,
    /// The other decimal mark than the file's, which is this one.
    MixedDecimal(u8),
}

/// Magnitudes from here on are damage and not physics; their squares must stay finite.
pub(super) const LARGEST: f64 = 1e100;

/// Reads a number. `decimal` is the file's decimal mark, settled by the first number that has one.
pub(super) fn parse_number(cell: &[u8], decimal: &mut Option<u8>) -> Result<f64, CellProblem> {
    if cell.is_empty() {
        return Err(CellProblem::Missing);
    }
    let mut mark = None;
    for byte in cell {
        match byte {
            b',' | b'.' if mark.is_none() => mark = Some(*byte),
            // A second mark: thousands separators, a date, an address.
            b',' | b'.' => return Err(CellProblem::Text),
            _ => {}
        }
    }
    let text = str::from_utf8(cell).map_err(|_| CellProblem::Text)?;
    let value = match mark {
        // A decimal comma has digits on both sides, unlike a comma that separates.
        Some(b',') => text
            .split_once(',')
            .filter(|(before, after)| {
                before.ends_with(|c: char| c.is_ascii_digit())
                    && after.starts_with(|c: char| c.is_ascii_digit())
            })
            .and_then(|(before, after)| parse_plain(&format!("{before}.{after}"))),
        _ => parse_plain(text),
    };
    let value = value.ok_or(CellProblem::Text)?;
    match (mark, *decimal) {
        (Some(found), Some(settled)) if found != settled => {
            return Err(CellProblem::MixedDecimal(settled));
        }
        (Some(found), None) => *decimal = Some(found),
        _ => {}
    }
    match value.abs() <= LARGEST {
        true => Ok(value),
        false => Err(CellProblem::NotFinite),
    }
}

/// Reads a number with a decimal point. Fortran writes double precision exponents with D.
pub(super) fn parse_plain(text: &str) -> Option<f64> {
    text.parse().ok().or_else(|| {
        let (mantissa, exponent) = text.split_once(['d', 'D'])?;
        format!("{mantissa}e{exponent}").parse().ok()
    })
}

/// Bytes of a text file as characters: UTF-8 where it is valid, else latin-1.
pub(super) fn decode_text(bytes: &[u8]) -> String {
    match str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// A cell as messages show it: short, without control characters.
pub(super) fn shown(cell: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = decode_text(cell);
    let mut short: String = text.chars().take(SHOWN).collect();
    if text.chars().nth(SHOWN).is_some() {
        short.push_str("...");
    }
    short.replace(char::is_control, " ")
}

/// Returns `true` for a comment, of a kind that recorders and numerical programs write.
pub(super) fn is_comment(line: &[u8]) -> bool {
    let line = line.trim_ascii_start();
    line.starts_with(b"#") || line.starts_with(b"%") || line.starts_with(b"//")
}
