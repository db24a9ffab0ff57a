//! Numbers as text: fixed columns, which may run together, or blanks between numbers.

use crate::recording::text::parse_plain;

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
    parse_words(line, room, into)
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
    let columns = line.get(..end).unwrap_or_default();
    if parse_columns(columns, widths, usize::MAX, &mut Vec::new()).is_some() {
        return columns;
    }
    let blank = line.iter().rposition(u8::is_ascii_whitespace);
    line.get(..blank.unwrap_or(0)).unwrap_or_default()
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
            let has_exponent = column
                .iter()
                .any(|byte| matches!(byte, b'e' | b'E' | b'd' | b'D'));
            if !has_exponent || !following.contains(&b'.') {
                return None;
            }
        }
        into.push(parse_number(column)?);
        taken += 1;
        start = end;
    }
    (taken == room || start == line.len()).then_some(())
}

/// Reads numbers between blanks, tabs or commas; where they run together a sign that is not an
/// exponent's begins the next one.
fn parse_words<'a>(line: &'a [u8], room: usize, into: &mut Vec<f64>) -> Result<(), &'a [u8]> {
    let limit = into.len() + room;
    for mut rest in line.split(|byte| b" \t,\r\x1a".contains(byte)) {
        while !rest.is_empty() && into.len() < limit {
            let (first, after) = match parse_number(rest) {
                Some(_) => (rest, &[][..]),
                None => rest.split_at(next_sign(rest).ok_or(rest)?),
            };
            into.push(parse_number(first).ok_or(rest)?);
            rest = after;
        }
    }
    Ok(())
}

/// Returns the place of a sign that begins another number: not at the start and not behind an exponent's letter.
fn next_sign(word: &[u8]) -> Option<usize> {
    let pairs = word.iter().zip(word.iter().skip(1));
    let at = pairs.enumerate().find(|(_, (before, sign))| {
        matches!(sign, b'+' | b'-') && (before.is_ascii_digit() || **before == b'.')
    });
    at.map(|(at, _)| at + 1)
}

/// Reads one number with blanks around it: exponents with E or D, or, as Fortran prints those of
/// three digits, without a letter ("1.0-101").
pub(super) fn parse_number(text: &[u8]) -> Option<f64> {
    let text = str::from_utf8(text.trim_ascii()).ok()?;
    parse_plain(text).or_else(|| {
        let (mantissa, exponent) = text.split_at_checked(text.len().checked_sub(4)?)?;
        let digits = exponent.strip_prefix(['+', '-'])?;
        let is_exponent = digits.bytes().all(|digit| digit.is_ascii_digit());
        is_exponent.then(|| format!("{mantissa}e{exponent}").parse().ok())?
    })
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
            assert_eq!(parse_number(text.as_bytes()), Some(value), "{text}");
        }
        for text in [
            "", "-", ".", "1.0-10", "1e", "1e+", "e5", "1.2.3", "0x10", "1 2",
        ] {
            assert_eq!(parse_number(text.as_bytes()), None, "{text}");
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
                assert_eq!(parse_number(text.as_bytes()), Some(exact), "{text}");
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
