//! The eleven header records of a dataset 58 or 58b: fields in fixed columns.

use super::axis::Axis;
use super::header::{Abscissa, Function, FunctionType, Ordinate, Point, Precision, UffCoding};
use crate::recording::text::{decode_text, shown};

/// Header records of a dataset 58.
pub(super) const HEADER_LINES: usize = 11;

/// A field of a record that makes no sense.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BadField {
    /// 1-based; 0 for the line with the dataset's type.
    pub record: usize,
    pub field: &'static str,
    pub value: String,
    pub allowed: &'static str,
}

/// The line with a dataset's type, such as "    58" or "    58b     1     2          11        6408".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TypeLine {
    pub number: u32,
    pub coding: UffCoding,
    /// Bytes of binary data by the header.
    pub bytes: Option<u64>,
}

/// Reads the line that follows the opening -1.
pub(super) fn parse_type_line(line: &[u8]) -> Option<TypeLine> {
    let text = decode_text(line.get(..line.len().min(200)).unwrap_or_default());
    let mut words = text.split_ascii_whitespace();
    let first = words.next()?;
    let digits = first.trim_end_matches(['b', 'B']);
    let number = digits.parse().ok()?;
    if digits.len() == first.len() {
        return Some(TypeLine {
            number,
            coding: UffCoding::Ascii,
            bytes: None,
        });
    }
    // Format(I6,1A1,I6,I6,I12,I12,..): byte order, floating-point format, header lines, bytes.
    let mut fields = words.map(|word| word.parse::<u64>().ok());
    let mut small = || fields.next().flatten().and_then(|n| u32::try_from(n).ok());
    let (order, format) = (small().unwrap_or(0), small().unwrap_or(0));
    let _header_lines = small();
    Some(TypeLine {
        number,
        coding: UffCoding::Binary { order, format },
        bytes: fields.next().flatten(),
    })
}

/// Reads the eleven records behind the type line.
pub(super) fn parse_header(
    lines: &[Vec<u8>; HEADER_LINES],
    coding: UffCoding,
) -> Result<Function, BadField> {
    let records: Vec<Record> = lines.iter().map(|line| Record::new(line)).collect();
    let record = |number: usize| records.get(number - 1).cloned().unwrap_or_default();
    let id_lines = std::array::from_fn(|at| record(at + 1).text(0, 80));
    // Record 6: Format(2(I5,I10),2(1X,10A1,I10,I4)).
    let degrees = record(6);
    let function_type = degrees
        .integer(0, 5)
        .or_else(|| degrees.word(0)?.parse().ok())
        .and_then(|number| u32::try_from(number).ok())
        .ok_or_else(|| degrees.bad(6, (0, 5), "the function type", "a number such as 1 or 4"))?;
    let form = parse_form(&record(7))?;
    Ok(Function {
        function_type: FunctionType(function_type),
        id_lines,
        response: degrees.point(31),
        reference: degrees.point(56),
        coding,
        ordinate: form.ordinate,
        precision: form.precision,
        points: form.points,
        abscissa: form.abscissa,
        abscissa_axis: record(8).axis(),
        numerator: record(9).axis(),
        denominator: record(10).axis(),
    })
}

/// Record 7.
struct Form {
    ordinate: Ordinate,
    precision: Precision,
    points: u64,
    abscissa: Abscissa,
}

/// Reads record 7: Format(3I10,3E13.5).
fn parse_form(record: &Record) -> Result<Form, BadField> {
    // Writers that do not keep the columns at least separate the numbers.
    let by_words = [(0, 10), (10, 10), (20, 10)]
        .iter()
        .any(|(at, width)| record.integer(*at, *width).is_none());
    let field = |number: usize, place: (usize, usize)| match by_words {
        true => record.word(number),
        false => record.text(place.0, place.1),
    };
    let integer = |number, place| field(number, place)?.parse::<i64>().ok();
    let (ordinate, precision) = match integer(0, (0, 10)) {
        Some(2) => (Ordinate::Real, Precision::Single),
        Some(4) => (Ordinate::Real, Precision::Double),
        Some(5) => (Ordinate::Complex, Precision::Single),
        Some(6) => (Ordinate::Complex, Precision::Double),
        _ => return Err(record.bad(7, (0, 10), "the ordinate data type", "2, 4, 5 or 6")),
    };
    let points = integer(1, (10, 10)).and_then(|points| u64::try_from(points).ok());
    let points = points
        .ok_or_else(|| record.bad(7, (10, 10), "the number of points", "a whole number from 0"))?;
    let abscissa = match integer(2, (20, 10)) {
        Some(0) => Abscissa::Uneven,
        Some(1) => {
            let step = field(4, (43, 13)).unwrap_or_default();
            let start = field(3, (30, 13)).unwrap_or_default();
            let read = |text: &str| super::ascii::parse_number(text.as_bytes());
            let bad = |at, field| record.bad(7, (at, 13), field, "a finite number");
            Abscissa::Even {
                start: read(&start)
                    .filter(|x| x.is_finite())
                    .ok_or_else(|| bad(30, "the first abscissa"))?,
                step: read(&step)
                    .filter(|x| x.is_finite())
                    .ok_or_else(|| bad(43, "the abscissa step"))?,
                step_digit: last_digit(&step),
            }
        }
        _ => {
            return Err(record.bad(
                7,
                (20, 10),
                "the abscissa spacing",
                "0 (uneven) or 1 (even)",
            ));
        }
    };
    Ok(Form {
        ordinate,
        precision,
        points,
        abscissa,
    })
}

/// One unit of the last digit of a printed number.
fn last_digit(text: &str) -> f64 {
    let (mantissa, exponent) = match text.trim().split_once(['e', 'E', 'd', 'D']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse().unwrap_or(0)),
        None => (text.trim(), 0_i32),
    };
    let decimals = mantissa
        .split_once('.')
        .map_or(0, |(_, digits)| digits.len());
    let decimals = i32::try_from(decimals).unwrap_or(0);
    10_f64.powi(exponent.saturating_sub(decimals))
}

/// A header line as characters: columns count characters, whatever bytes they take.
#[derive(Debug, Clone, Default)]
struct Record {
    characters: Vec<char>,
}

impl Record {
    fn new(line: &[u8]) -> Self {
        Self {
            characters: decode_text(line).trim_end().chars().collect(),
        }
    }

    fn slice(&self, at: usize, width: usize) -> String {
        self.characters.iter().skip(at).take(width).collect()
    }

    /// Text of a field; `None` where it is blank or "NONE".
    fn text(&self, at: usize, width: usize) -> Option<String> {
        let text = self.slice(at, width).replace(char::is_control, " ");
        let text = text.trim();
        (!text.is_empty() && text != "NONE").then(|| text.to_owned())
    }

    /// The field as an integer; a blank field is none.
    fn integer(&self, at: usize, width: usize) -> Option<i64> {
        self.text(at, width)?.parse().ok()
    }

    /// The word of a number, 0-based.
    fn word(&self, number: usize) -> Option<String> {
        let text: String = self.characters.iter().collect();
        text.split_ascii_whitespace().nth(number).map(str::to_owned)
    }

    /// Name, node and direction from a column on.
    fn point(&self, at: usize) -> Point {
        let direction = self.integer(at + 20, 4).unwrap_or(0);
        Point {
            name: self.text(at, 10),
            node: self.integer(at + 10, 10).unwrap_or(0),
            direction: i32::try_from(direction).unwrap_or(0),
        }
    }

    /// Records 8 to 11: Format(I10,3I5,2(1X,20A1)).
    fn axis(&self) -> Axis {
        let small = |at, width| i32::try_from(self.integer(at, width).unwrap_or(0)).unwrap_or(0);
        Axis {
            quantity: u32::try_from(small(0, 10)).unwrap_or(0),
            exponents: [small(10, 5), small(15, 5), small(20, 5)],
            label: self.text(26, 20),
            unit: self.text(47, 20),
        }
    }

    fn bad(
        &self,
        record: usize,
        (at, width): (usize, usize),
        field: &'static str,
        allowed: &'static str,
    ) -> BadField {
        BadField {
            record,
            field,
            value: shown(self.slice(at, width).trim().as_bytes()),
            allowed,
        }
    }
}
