//! Numbers as text: cells of a line, fixed columns, and whether printed times or frequencies are evenly spaced.
//!
//! Lines are split here and not by the crate `csv`, which reads other values from some files: a quote behind a
//! blank (`1; "2"`) stays part of its cell, a quote that is never closed takes in the following lines, empty lines
//! disappear, and runs of blanks are no separator. Speed is the same.

use std::ops::Range;

use super::error::short;

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

    /// The only byte that separates; `None` of blanks, which may be several.
    pub(super) fn single(self) -> Option<u8> {
        let [first, second] = self.bytes();
        (first == second).then_some(first)
    }

    /// The bytes that separate; twice the same where there is one.
    fn bytes(self) -> [u8; 2] {
        match self {
            Self::Tab => [b'\t'; 2],
            Self::Semicolon => [b';'; 2],
            Self::Comma => [b','; 2],
            Self::Blanks => [b' ', b'\t'],
        }
    }
}

/// Place of a cell in its line (bytes).
pub(super) type Cell = Range<usize>;

/// Splits a line into its cells, or the first `most` of them, quotes and surrounding blanks removed. `cells` is reused.
pub(super) fn split_cells(line: &[u8], separator: Separator, most: usize, cells: &mut Vec<Cell>) {
    cells.clear();
    // Tabs at the end stay: they may be separators before an empty last cell.
    let last = line
        .iter()
        .rposition(|byte| !matches!(byte, b'\r' | b'\n' | b' ' | 0x1a | 0x0c));
    let line = &line[..last.map_or(0, |last| last + 1)];
    let [first, second] = separator.bytes();
    let (mut start, mut quoted) = (0, false);
    for at in memchr::memchr3_iter(first, second, b'"', line) {
        if cells.len() >= most {
            return;
        }
        if line[at] == b'"' {
            quoted = !quoted;
        } else if !quoted {
            // One or more blanks separate, so that there is no cell between two of them.
            if at > start || separator != Separator::Blanks {
                cells.push(trimmed(line, start..at));
            }
            start = at + 1;
        }
    }
    if cells.len() < most && (line.len() > start || separator != Separator::Blanks) {
        cells.push(trimmed(line, start..line.len()));
    }
}

/// Returns the cell without surrounding blanks and without one pair of quotes.
fn trimmed(line: &[u8], cell: Cell) -> Cell {
    // Most cells of a long file.
    if let [b'+'..=b'9', .., b'0'..=b'9'] = line[cell.clone()] {
        return cell;
    }
    let cell = without_blanks(line, cell);
    match &line[cell.clone()] {
        [b'"', .., b'"'] => without_blanks(line, cell.start + 1..cell.end - 1),
        _ => cell,
    }
}

fn without_blanks(line: &[u8], cell: Cell) -> Cell {
    let bytes = &line[cell.clone()];
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
    // Without a comma or a second point, as most numbers of a long file.
    let plain = parse_plain(cell).filter(|_| *decimal == Some(b'.'));
    if let Some(value) = plain {
        return within_limit(value);
    }
    let mut marks = cell.iter().copied().filter(|byte| b",.".contains(byte));
    let mark = marks.next();
    // A second mark: thousands separators, a date, an address.
    if marks.next().is_some() {
        return Err(CellProblem::Text);
    }
    let value = match mark {
        Some(b',') => {
            let place = memchr::memchr(b',', cell).ok_or(CellProblem::Text)?;
            let (before, after) = (&cell[..place], &cell[place + 1..]);
            // A decimal comma has digits on both sides, unlike a comma that separates.
            let is_decimal = before.last().is_some_and(u8::is_ascii_digit)
                && after.first().is_some_and(u8::is_ascii_digit);
            is_decimal
                .then(|| parse_plain(&[before, after].join(&b'.')))
                .flatten()
        }
        _ => parse_plain(cell),
    };
    let value = value.ok_or(CellProblem::Text)?;
    if let Some(found) = mark {
        let settled = *decimal.get_or_insert(found);
        if settled != found {
            return Err(CellProblem::MixedDecimal(settled));
        }
    }
    within_limit(value)
}

fn within_limit(value: f64) -> Result<f64, CellProblem> {
    match value.abs() <= LARGEST {
        true => Ok(value),
        false => Err(CellProblem::NotFinite),
    }
}

/// Reads a number with a decimal point. Fortran writes double precision exponents with D.
pub(super) fn parse_plain(text: &[u8]) -> Option<f64> {
    fast_float2::parse(text).ok().or_else(|| {
        let place = memchr::memchr2(b'd', b'D', text)?;
        fast_float2::parse([&text[..place], &text[place + 1..]].join(&b'e')).ok()
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

// ---- Numbers of universal files: fixed columns, which may run together, or blanks between numbers.

/// Appends the numbers of a line to `into`, at most `room`; what stands behind them is not looked
/// at. `Err` holds what is no number.
pub(super) fn parse_line<'a>(
    line: &'a [u8],
    widths: &[usize],
    room: usize,
    into: &mut Vec<f64>,
) -> Result<(), &'a [u8]> {
    let line = line.trim_ascii_end();
    let before = into.len();
    if parse_columns(line, widths, room, into).is_some() {
        return Ok(());
    }
    into.truncate(before);
    let limit = before.saturating_add(room);
    // Blanks, tabs or commas stand between numbers.
    for mut rest in line.split(|byte| b" \t,\r\x1a".contains(byte)) {
        while !rest.is_empty() && into.len() < limit {
            let (first, after) = match parse_fortran(rest) {
                Some(_) => (rest, &[][..]),
                // Where they run together, a sign that is not an exponent's begins the next one.
                None => {
                    let sign = rest.windows(2).position(|pair| {
                        b"+-".contains(&pair[1]) && (pair[0].is_ascii_digit() || pair[0] == b'.')
                    });
                    rest.split_at(sign.ok_or(rest)? + 1)
                }
            };
            into.push(parse_fortran(first).ok_or(rest)?);
            rest = after;
        }
    }
    Ok(())
}

/// A line without the number that its end may have cut: whole columns where they can be read, else
/// everything before the last blank.
pub(super) fn without_last_number<'a>(line: &'a [u8], widths: &[usize]) -> &'a [u8] {
    let mut end = 0;
    for width in widths {
        if end + width >= line.len() {
            break;
        }
        end += width;
    }
    let columns = &line[..end];
    if parse_columns(columns, widths, usize::MAX, &mut Vec::new()).is_some() {
        return columns;
    }
    let blank = line.iter().rposition(u8::is_ascii_whitespace);
    &line[..blank.unwrap_or(0)]
}

/// Reads fixed columns; `None` where the line does not keep to them.
///
/// Numbers stand at the right end of their columns, so a line ends where a column ends. Two digits
/// on both sides of a column's end are parts of one number unless the left one has its exponent and
/// the right one its point.
fn parse_columns(line: &[u8], widths: &[usize], room: usize, into: &mut Vec<f64>) -> Option<()> {
    let (mut start, mut taken) = (0, 0);
    for width in widths {
        if taken == room || start == line.len() {
            break;
        }
        let end = start + width;
        let column = line.get(start..end)?;
        let next = line.get(end);
        if column.last()?.is_ascii_digit() && next.is_some_and(u8::is_ascii_digit) {
            let following = line.get(end..line.len().min(end + width))?;
            let has_exponent = column.iter().any(|byte| b"eEdD".contains(byte));
            if !has_exponent || !following.contains(&b'.') {
                return None;
            }
        }
        into.push(parse_fortran(column)?);
        taken += 1;
        start = end;
    }
    (taken == room || start == line.len()).then_some(())
}

/// Reads one number with blanks around it: exponents with E or D, or, as Fortran prints those of
/// three digits, without a letter ("1.0-101").
pub(super) fn parse_fortran(text: &[u8]) -> Option<f64> {
    let text = text.trim_ascii();
    parse_plain(text).or_else(|| {
        let (mantissa, exponent) = text.split_at_checked(text.len().checked_sub(4)?)?;
        let [b'+' | b'-', digits @ ..] = exponent else {
            return None;
        };
        let is_exponent = digits.iter().all(u8::is_ascii_digit);
        is_exponent.then(|| fast_float2::parse([mantissa, exponent].join(&b'e')).ok())?
    })
}

// ---- Even spacing: the check of each step, and the rate.

/// Largest deviation of a step from the step elsewhere, as a part of it.
const TOLERANCE: f64 = 1e-3;

/// The same where samples are resampled: far below the half step from which on neighbours could not be told from a
/// lost sample, and small enough for the resampling to converge in a few passes.
const RESAMPLED: f64 = 0.02;

/// A rate this near to a whole number, relatively, may be that whole number: a tenth of the
/// tolerance, far below any resolution of frequency.
const WHOLE_RATE: f64 = 1e-4;

/// Roundings of binary arithmetic in the comparisons.
const SLACK: f64 = 1.0 + 1e-9;

/// A step that is not the step elsewhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnevenStep {
    /// Line it leads to.
    pub line: u64,
    /// Time there (the column's unit).
    time: f64,
    /// The step (the column's unit).
    step: f64,
    /// The step elsewhere (the column's unit).
    expected: f64,
}

impl UnevenStep {
    /// Returns words such as "2 s comes 1 s after the row before, the step elsewhere is 0.5 s".
    ///
    /// `factor` turns the column's unit into `unit`.
    pub(super) fn words(&self, factor: f64, unit: &str, before: &str) -> String {
        let [time, step, expected] =
            [self.time, self.step, self.expected].map(|value| short(value * factor));
        format!(
            "{time} {unit} comes {step} {unit} after the {before} before, the step elsewhere is {expected} {unit}"
        )
    }

    /// Returns words on the rows that may be lost: " (as if 2 rows were missing)".
    ///
    /// They are empty where the gap is no whole number of steps.
    pub(super) fn lost_rows(&self) -> String {
        let steps = self.step / self.expected;
        let whole = steps.round();
        // Within a tenth.
        if !(2.0..1e9).contains(&whole) || (steps - whole).abs() > 0.1 {
            return String::new();
        }
        let plural = if whole > 2.0 { "s" } else { "" };
        format!(" (as if {} row{plural} were missing)", whole - 1.0)
    }
}

/// Checks the steps of a time column one after the other.
///
/// A step may deviate from the reference by 0.1 %, or by what rounding explains: times that were
/// evenly spaced before they were printed have steps that differ among themselves by at most one
/// unit of the last digit. Rounding never explains half of a step or more, for then a lost row
/// could pass for it.
#[derive(Debug, Clone)]
pub(super) struct TimeCheck {
    reference: f64,
    /// Steps behind the reference.
    reference_steps: f64,
    digits: Digits,
    /// The first time (the column's unit).
    pub first: f64,
    last: f64,
    count: u64,
    shortest: Option<UnevenStep>,
    longest: Option<UnevenStep>,
    /// True where steps may deviate by [`RESAMPLED`].
    resamples: bool,
    /// Largest deviation of a step beyond the tolerance, as a part of the step.
    uneven: Option<f64>,
}

impl TimeCheck {
    /// Takes the reference from the first times of the file, robustly: the mean of the steps within
    /// a half of their median, so that a gap among them does not count.
    pub(super) fn new<'a>(head: impl Iterator<Item = (f64, &'a [u8])>) -> Self {
        let mut digits = Digits::default();
        let mut times = Vec::new();
        for (time, cell) in head {
            digits.include(time, cell);
            times.push(time);
        }
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        steps.retain(|step| (step - median).abs() <= 0.5 * median);
        let count = steps.len().max(1) as f64;
        Self {
            reference: steps.iter().sum::<f64>() / count,
            reference_steps: count,
            digits,
            first: 0.0,
            last: 0.0,
            count: 0,
            shortest: None,
            longest: None,
            resamples: false,
            uneven: None,
        }
    }

    /// Lets steps deviate by up to 2 %, for samples that are resampled then.
    pub(super) fn for_resampling(mut self) -> Self {
        self.resamples = true;
        self
    }

    /// Returns the largest deviation of a step, as a part of it, where the samples must be resampled.
    pub(super) fn uneven(&self) -> Option<f64> {
        self.uneven
    }

    /// Takes the next time, printed as `cell` in line `line`.
    pub(super) fn add(&mut self, time: f64, cell: &[u8], line: u64) -> Result<(), UnevenStep> {
        let (step, expected) = (time - self.last, self.reference);
        self.last = time;
        self.count += 1;
        if self.count == 1 {
            self.first = time;
            return Ok(());
        }
        let new = UnevenStep {
            line,
            time,
            step,
            expected,
        };
        let deviation = (step - expected).abs();
        let allowed = TOLERANCE * expected;
        let shortest = self.shortest.get_or_insert(new);
        if step < shortest.step {
            *shortest = new;
        }
        let longest = self.longest.get_or_insert(new);
        if step > longest.step {
            *longest = new;
        }
        let (shortest, longest) = (*shortest, *longest);
        if step > 0.0 && deviation <= allowed * SLACK {
            return Ok(());
        }
        self.digits.include(time, cell);
        let unit = self.digits.unit_at(time);
        // The reference itself is known to a unit over the number of its steps.
        let by_rounding = unit * (1.0 + 1.0 / self.reference_steps);
        let limit = by_rounding.min(0.5 * expected) * SLACK;
        let spread = longest.step - shortest.step;
        if step > 0.0 && deviation <= limit && spread <= (unit + allowed) * SLACK {
            return Ok(());
        }
        if self.resamples && step > 0.0 && deviation <= RESAMPLED * expected + limit {
            let part = deviation / expected;
            self.uneven = Some(self.uneven.map_or(part, |other| other.max(part)));
            return Ok(());
        }
        // The step that deviates most is the one to blame; it may have come before.
        let blame = [shortest, longest]
            .into_iter()
            .filter(|other| other.line < line)
            .find(|other| (other.step - expected).abs() >= deviation / SLACK);
        Err(blame.filter(|_| step > 0.0).unwrap_or(new))
    }

    /// The sample rate by first and last time, and the one to use (Hz); `None` without two rows.
    ///
    /// They differ where the whole number nearest to the mean lies within the scatter of the steps
    /// or within the rounding of the last time: the clock was exact and its printing was not.
    /// `factor` turns the column's unit into seconds.
    pub(super) fn sample_rate(&self, factor: f64) -> Option<(f64, f64)> {
        let (shortest, longest) = (self.shortest?.step, self.longest?.step);
        let span = self.last - self.first;
        let mean = (self.count - 1) as f64 / (span * factor);
        let whole = mean.round();
        let whole_step = 1.0 / (whole * factor);
        let in_scatter = shortest <= whole_step * SLACK && whole_step <= longest * SLACK;
        let deviation = (whole - mean).abs() / mean;
        let by_rounding = self.digits.unit_at(self.last) / span;
        let is_whole = deviation <= WHOLE_RATE && (in_scatter || deviation <= by_rounding);
        Some((mean, if is_whole { whole } else { mean }))
    }
}

/// Rows that settle the reference step.
const HEAD_ROWS: usize = 4096;

/// Digits with which numbers were written whose text is no longer there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Printed {
    /// As few as tell the number from its neighbours.
    Shortest,
    /// So many decimals.
    Decimals(usize),
    /// All of them: binary numbers.
    Exact,
}

impl Printed {
    fn text(self, value: f64) -> String {
        match self {
            Self::Shortest => format!("{value:e}"),
            Self::Decimals(decimals) => format!("{value:.decimals$}"),
            Self::Exact => format!("{value:.16e}"),
        }
    }
}

/// Checks that values rise evenly, each with its line (1-based) in the file. Where `resamples`, steps may deviate by 2 %.
pub(super) fn check_even(
    values: &[f64],
    lines: impl Iterator<Item = u64>,
    printed: Printed,
    resamples: bool,
) -> Result<TimeCheck, UnevenStep> {
    let head = values.iter().take(HEAD_ROWS);
    let head: Vec<(f64, String)> = head.map(|value| (*value, printed.text(*value))).collect();
    let mut check = TimeCheck::new(head.iter().map(|(value, text)| (*value, text.as_bytes())));
    check.resamples = resamples;
    for (value, line) in values.iter().zip(lines) {
        check.add(*value, printed.text(*value).as_bytes(), line)?;
    }
    Ok(check)
}

/// Number of digits of the times, over all cells looked at: fixed decimals or fixed significant
/// digits, zeros at the end possibly left out, or the 24 binary digits of single precision.
#[derive(Debug, Clone, Copy)]
struct Digits {
    /// Largest number of significant digits.
    significant: i32,
    /// Power of ten of the finest last digit.
    finest: i32,
    /// `true` where every cell may be a single-precision number.
    single: bool,
}

impl Default for Digits {
    fn default() -> Self {
        Self {
            significant: 1,
            finest: 0,
            single: true,
        }
    }
}

impl Digits {
    fn include(&mut self, time: f64, cell: &[u8]) {
        let (mut significant, mut decimals, mut after_mark) = (0, 0, false);
        let mut bytes = cell.iter();
        for byte in bytes.by_ref() {
            match byte {
                b'0'..=b'9' => {
                    // Zeros in front are not significant.
                    significant += i32::from(significant > 0 || *byte != b'0');
                    decimals += i32::from(after_mark);
                }
                b'.' | b',' => after_mark = true,
                b'e' | b'E' | b'd' | b'D' => break,
                _ => {}
            }
        }
        let exponent = str::from_utf8(bytes.as_slice()).unwrap_or_default();
        let exponent: i32 = exponent.parse().unwrap_or(0);
        let last_digit = exponent.saturating_sub(decimals);
        self.significant = self.significant.max(significant);
        if significant > 0 {
            self.finest = self.finest.min(last_digit);
        }
        let from_single = (time - f64::from(time as f32)).abs();
        self.single &= from_single <= 0.5 * SLACK * 10_f64.powi(last_digit);
    }

    /// One unit of the last digit of a time: the coarsest of what fixed decimals, fixed significant
    /// digits and single precision make of it.
    fn unit_at(&self, time: f64) -> f64 {
        // Rounded to single precision and then printed with just enough digits to tell it from its
        // neighbours, a time moves by up to one of its spacings; two steps differ by four.
        let single = match self.single {
            true => 4.0 * f64::from(f32::EPSILON) * time.abs(),
            false => 0.0,
        };
        let fixed = single.max(10_f64.powi(self.finest));
        let leading = match time {
            0.0 => return fixed,
            time => time.abs().log10().floor() as i32,
        };
        fixed.max(10_f64.powi(leading.saturating_add(1).saturating_sub(self.significant)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of 6E13.5.
    const SINGLE: [usize; 6] = [13; 6];

    fn line(text: &str, widths: &[usize]) -> Option<Vec<f64>> {
        let mut numbers = Vec::new();
        let read = parse_line(text.as_bytes(), widths, 100, &mut numbers);
        read.ok().map(|()| numbers)
    }

    #[test]
    fn val_numbers_as_fortran_prints_them() {
        let cases = [
            ("1.0-101", 1e-101),
            (" -4.5D+03 ", -4500.0),
            ("+.5", 0.5),
            ("3.", 3.0),
            ("1.7333100549880001234e-04", 1.733_310_054_988_000_1e-4),
            ("1e400", f64::INFINITY),
            ("-0.00115633", -0.001_156_33),
        ];
        for (text, value) in cases {
            assert_eq!(parse_fortran(text.as_bytes()), Some(value), "{text}");
        }
        for text in [
            "", "-", ".", "1.0-10", "1e", "1e+", "e5", "1.2.3", "0x10", "1 2",
        ] {
            assert_eq!(parse_fortran(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn limit_numbers_in_columns_are_read_exactly() {
        let mut digits = 12_345_u64;
        for exponent in -99..=99 {
            digits = digits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let value = (digits >> 12) as f64 * 10_f64.powi(exponent % 40 - 15);
            let texts = [format!("{value:13.5e}"), format!("{:20.12e}", -value)];
            for text in texts {
                // Rust prints no plus sign and no leading zero in exponents.
                let (mantissa, power) = text.split_once('e').expect("an exponent");
                let power: i32 = power.parse().expect("a number");
                let width = text.len();
                let text = format!("{mantissa}E{power:+03}");
                let text = format!("{:>width$}", text.trim());
                let exact: f64 = text.trim().parse().expect("a number");
                assert_eq!(parse_fortran(text.as_bytes()), Some(exact), "{text}");
            }
        }
    }

    #[test]
    fn val_columns_that_run_together() {
        let text = "-3.09944E-004-2.74181E-004  -0.00115633 0.00000E+000";
        let expected = [-3.09944e-4, -2.74181e-4, -0.001_156_33, 0.0];
        assert_eq!(line(text, &SINGLE).as_deref(), Some(&expected[..]));
        // Without blanks and without signs, only the columns separate them.
        let text = "3.099441E-0042.741811E-004";
        assert_eq!(line(text, &SINGLE), Some(vec![3.099_441e-4, 2.741_811e-4]));
        let text = " 1.00000E+01 1.733310054988E-04 1.00288E+01-1.733310054988E-104";
        let expected = [10.0, 1.733_310_054_988e-4, 10.0288, -1.733_310_054_988e-104];
        assert_eq!(
            line(text, &[13, 20, 13, 20]).as_deref(),
            Some(&expected[..])
        );
    }

    #[test]
    fn regress_numbers_of_other_widths_are_not_cut_at_columns() {
        let cases = [
            (" 1.234567890123456e-01", vec![0.123_456_789_012_345_6]),
            ("1.5 2.5\t-3", vec![1.5, 2.5, -3.0]),
            (
                "12345678901234567890123456",
                vec![12_345_678_901_234_567_890_123_456.0],
            ),
            ("1.25-2.5", vec![1.25, -2.5]),
        ];
        for (text, expected) in cases {
            assert_eq!(line(text, &SINGLE), Some(expected), "{text}");
        }
        assert_eq!(line("1.0 abc", &SINGLE), None);
        let mut numbers = Vec::new();
        let padded = parse_line(b"1.0 2.0 rubbish", &SINGLE, 2, &mut numbers);
        assert_eq!(
            (padded, numbers.len()),
            (Ok(()), 2),
            "padding was looked at"
        );
    }
}
