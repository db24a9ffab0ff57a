//! Numbers as text: fixed columns, which may run together, or blanks between numbers.

use super::header::{Abscissa, Function, Ordinate, Precision};

/// Columns of the formats of dataset 58, by their widths.
const SINGLE: &[usize] = &[13; 6];

const DOUBLE_EVEN: &[usize] = &[20; 4];

const DOUBLE_REAL_UNEVEN: &[usize] = &[13, 20, 13, 20];

const DOUBLE_COMPLEX_UNEVEN: &[usize] = &[13, 20, 20];

/// Widths of the columns of a function's lines: 6E13.5, 4E20.12, 2(E13.5,E20.12) or E13.5,2E20.12.
pub(super) fn column_widths(function: &Function) -> &'static [usize] {
    match (function.precision, function.abscissa, function.ordinate) {
        (Precision::Single, _, _) => SINGLE,
        (Precision::Double, Abscissa::Even { .. }, _) => DOUBLE_EVEN,
        (Precision::Double, Abscissa::Uneven, Ordinate::Real) => DOUBLE_REAL_UNEVEN,
        (Precision::Double, Abscissa::Uneven, Ordinate::Complex) => DOUBLE_COMPLEX_UNEVEN,
    }
}

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
        into.push(parse_full_column(column).or_else(|| parse_number(column))?);
        taken += 1;
        start = end;
    }
    (taken == room || start == line.len()).then_some(())
}

/// Reads a column that is filled as the format prints it: "-1.23456E-02" at the right end of 13
/// characters, or twelve decimals in 20. `None` for anything else; only speed depends on it.
fn parse_full_column(column: &[u8]) -> Option<f64> {
    match column.len() {
        13 => parse_full::<5>(column),
        20 => parse_full::<12>(column),
        _ => None,
    }
}

fn parse_full<const DECIMALS: usize>(column: &[u8]) -> Option<f64> {
    let digit = |byte: u8| Some(u64::from(byte.wrapping_sub(b'0'))).filter(|digit| *digit < 10);
    let (front, tail) = column.split_at_checked(column.len().checked_sub(4 + DECIMALS + 2)?)?;
    let (head, exponent) = tail.split_at_checked(DECIMALS + 2)?;
    let (&[leading, b'.'], decimals) = head.split_first_chunk::<2>()? else {
        return None;
    };
    let &[b'E' | b'e', sign @ (b'+' | b'-'), tens, ones] = exponent else {
        return None;
    };
    let (before, blanks) = front.split_last()?;
    if !matches!(before, b' ' | b'-') || blanks.iter().any(|byte| *byte != b' ') {
        return None;
    }
    let mut mantissa = digit(leading)?;
    let mut all_digits = true;
    for byte in decimals {
        let next = byte.wrapping_sub(b'0');
        all_digits &= next < 10;
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(next));
    }
    let exponent = (10 * digit(tens)? + digit(ones)?) as i32;
    let power = if sign == b'-' { -exponent } else { exponent } - DECIMALS as i32;
    // Thirteen digits are below 2^53; see parse_number.
    let scale = EXACT_POWERS
        .get(power.unsigned_abs() as usize)
        .filter(|_| all_digits)?;
    let value = mantissa as f64;
    let value = if power < 0 {
        value / scale
    } else {
        value * scale
    };
    Some(if *before == b'-' { -value } else { value })
}

/// Reads numbers between blanks, tabs or commas; where they run together a sign that is not an
/// exponent's begins the next one.
fn parse_words<'a>(line: &'a [u8], room: usize, into: &mut Vec<f64>) -> Result<(), &'a [u8]> {
    let limit = into.len() + room;
    let is_between = |byte: &u8| matches!(byte, b' ' | b'\t' | b',' | b'\r' | 0x1a);
    for word in line.split(is_between).filter(|word| !word.is_empty()) {
        let mut rest = word;
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

/// Where a sign begins another number: not at the start and not behind an exponent's letter.
fn next_sign(word: &[u8]) -> Option<usize> {
    let pairs = word.iter().zip(word.iter().skip(1));
    let at = pairs.enumerate().find(|(_, (before, sign))| {
        matches!(sign, b'+' | b'-') && (before.is_ascii_digit() || **before == b'.')
    });
    at.map(|(at, _)| at + 1)
}

/// Powers of ten that are exact in double precision.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Reads one number with blanks around it: exponents with E or D, or, as Fortran prints those of
/// three digits, without a letter ("1.0-101").
///
/// A mantissa below 2^53 and a power of ten up to 22 are both exact, so that one multiplication or
/// division rounds correctly (Clinger 1990); anything else goes to the standard library.
pub(super) fn parse_number(text: &[u8]) -> Option<f64> {
    let text = text.trim_ascii();
    let (negative, unsigned) = match text.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, text),
    };
    let (mut mantissa, mut digits, mut decimals) = (0_u64, 0_u32, 0_i32);
    let (mut at, mut after_point) = (0, false);
    while let Some(byte) = unsigned.get(at) {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa
                    .wrapping_mul(10)
                    .wrapping_add(u64::from(byte - b'0'));
                digits += 1;
                decimals += i32::from(after_point);
            }
            b'.' if !after_point => after_point = true,
            _ => break,
        }
        at += 1;
    }
    if digits == 0 {
        return parse_named(unsigned).map(|value| if negative { -value } else { value });
    }
    let exponent = parse_exponent(unsigned.get(at..).unwrap_or_default())?;
    let power = exponent.saturating_sub(decimals);
    // 19 digits always fit into 64 bits.
    if digits <= 19 && mantissa < 1 << 53 && (-22..=22).contains(&power) {
        let scale = EXACT_POWERS.get(power.unsigned_abs() as usize)?;
        let value = mantissa as f64;
        let value = if power < 0 {
            value / scale
        } else {
            value * scale
        };
        return Some(if negative { -value } else { value });
    }
    let plain = str::from_utf8(unsigned.get(..at)?).ok()?;
    let value: f64 = format!("{plain}e{exponent}").parse().ok()?;
    Some(if negative { -value } else { value })
}

/// The exponent behind a mantissa: nothing, a letter and an integer, or a signed integer.
fn parse_exponent(text: &[u8]) -> Option<i32> {
    let signed = match text.split_first() {
        None => return Some(0),
        Some((b'e' | b'E' | b'd' | b'D', rest)) => rest,
        // Without a letter there are three digits, or it is the next number.
        Some((b'+' | b'-', digits)) if digits.len() == 3 => text,
        Some(_) => return None,
    };
    let (negative, digits) = match signed.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, signed),
    };
    if digits.is_empty() || digits.len() > 6 {
        return None;
    }
    let mut exponent = 0_i32;
    for byte in digits {
        if !byte.is_ascii_digit() {
            return None;
        }
        exponent = exponent * 10 + i32::from(byte - b'0');
    }
    Some(if negative { -exponent } else { exponent })
}

/// Not a number and infinity, which are no usable values but deserve a message of their own.
fn parse_named(text: &[u8]) -> Option<f64> {
    let is = |name: &[u8]| text.eq_ignore_ascii_case(name);
    if is(b"nan") {
        Some(f64::NAN)
    } else if is(b"inf") || is(b"infinity") {
        Some(f64::INFINITY)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn limit_the_fast_way_reads_what_the_slow_way_reads() {
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
                let fast = parse_full_column(text.as_bytes());
                let slow: f64 = text.trim().parse().expect("a number");
                assert_eq!(parse_number(text.as_bytes()), Some(slow), "{text}");
                assert!(fast.is_none_or(|fast| fast == slow), "{text}");
                assert!(fast.is_some() || power.abs() > 9, "{text} was not read");
            }
        }
    }

    #[test]
    fn val_columns_that_run_together() {
        let text = "-3.09944E-004-2.74181E-004  -0.00115633 0.00000E+000";
        let expected = [-3.09944e-4, -2.74181e-4, -0.001_156_33, 0.0];
        assert_eq!(line(text, SINGLE).as_deref(), Some(&expected[..]));
        // Without blanks and without signs, only the columns separate them.
        let text = "3.099441E-0042.741811E-004";
        assert_eq!(line(text, SINGLE), Some(vec![3.099_441e-4, 2.741_811e-4]));
        let text = " 1.00000E+01 1.733310054988E-04 1.00288E+01-1.733310054988E-104";
        let expected = [10.0, 1.733_310_054_988e-4, 10.0288, -1.733_310_054_988e-104];
        assert_eq!(
            line(text, DOUBLE_REAL_UNEVEN).as_deref(),
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
            assert_eq!(line(text, SINGLE), Some(expected), "{text}");
        }
        assert_eq!(line("1.0 abc", SINGLE), None);
        let mut numbers = Vec::new();
        let padded = parse_line(b"1.0 2.0 rubbish", SINGLE, 2, &mut numbers);
        assert_eq!(
            (padded, numbers.len()),
            (Ok(()), 2),
            "padding was looked at"
        );
    }
}
