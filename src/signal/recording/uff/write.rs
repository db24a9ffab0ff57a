//! Writing frequency response functions as datasets 58 or 58b.

use std::fmt::Write;

use super::error::UffError;
use super::header::Point;
use crate::recording::{FrequencyResponse, FrequencyResponses, ResponseForm};

/// How datasets are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UffFormat {
    /// Dataset 58: text with thirteen digits.
    Ascii,
    /// Dataset 58b: IEEE double precision, little endian; every bit is kept.
    Binary,
}

/// Factors to SI are 1: dataset 164 for SI units.
const SI_UNITS: &str = "    -1\n   164\n         1SI: Meter (newton)           2\n  \
     1.00000000000000000D+00  1.00000000000000000D+00  1.00000000000000000D+00\n  \
     2.73149999999999977D+02\n    -1\n";

/// Frequency response functions and their coherences as a universal file: units (dataset 164), then
/// for each response a dataset 58 or 58b of function type 4 and, where there is a coherence, one of
/// function type 6. Complex and real double precision, evenly spaced.
///
/// The header has room for seven digits of first frequency and spacing.
///
/// # Errors
/// Values that are not finite; responses or coherences whose length is not the number of lines.
pub fn encode_frequency_responses_uff(
    responses: &FrequencyResponses,
    format: UffFormat,
) -> Result<Vec<u8>, UffError> {
    let mut bytes = SI_UNITS.as_bytes().to_vec();
    for (number, response) in (1..).zip(&responses.responses) {
        let parts = response
            .values
            .iter()
            .flat_map(|value| [value.re, value.im]);
        let values: Vec<f64> = parts.collect();
        check(responses, (number, 2), &values)?;
        let header = header(responses, response, Kind::Response);
        write_dataset(&mut bytes, &header, &values, format);
        if let Some(coherence) = &response.coherence {
            check(responses, (number, 1), coherence)?;
            let header = self::header(responses, response, Kind::Coherence);
            write_dataset(&mut bytes, &header, coherence, format);
        }
    }
    Ok(bytes)
}

fn check(
    responses: &FrequencyResponses,
    (response, width): (usize, usize),
    values: &[f64],
) -> Result<(), UffError> {
    let file = || responses.file.clone();
    if values.len() != responses.lines.saturating_mul(width) {
        return Err(UffError::LengthMismatch {
            file: file(),
            response,
            found: values.len() / width,
            expected: responses.lines,
        });
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Err(UffError::NotFinite {
            file: file(),
            dataset: response,
            point: (at / width) as u64 + 1,
            value: values.get(at).copied().unwrap_or(f64::NAN),
        }),
    }
}

/// What a dataset holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Response,
    Coherence,
}

/// The eleven header records.
fn header(responses: &FrequencyResponses, response: &FrequencyResponse, kind: Kind) -> String {
    let (function_type, data_type) = match kind {
        Kind::Response => (4, 6),
        Kind::Coherence => (6, 4),
    };
    let mut text = String::new();
    for line in [
        field(&response.name, 80).as_str(),
        "NONE",
        "NONE",
        "NONE",
        "NONE",
    ] {
        let _ = writeln!(text, "{line}");
    }
    let _ = writeln!(
        text,
        "{function_type:5}{:10}{:5}{:10}{}{}",
        0,
        0,
        0,
        point(&response.response),
        point(&response.reference)
    );
    let _ = writeln!(
        text,
        "{data_type:10}{:10}{:10}{:>13}{:>13}{:>13}",
        responses.lines,
        1,
        exponential(responses.first_frequency, 6),
        exponential(responses.spacing, 6),
        exponential(0.0, 6)
    );
    text.push_str(&axis(18, "Frequency", "Hz"));
    let (numerator, denominator) = ordinate_axes(response, kind);
    text.push_str(&numerator);
    text.push_str(&denominator);
    text.push_str(&axis(0, "NONE", "NONE"));
    text
}

/// Records 9 and 10. Values are in SI units where the form is known; else the unit is the file's.
fn ordinate_axes(response: &FrequencyResponse, kind: Kind) -> (String, String) {
    let none = axis(0, "NONE", "NONE");
    let numerator = match (kind, response.form) {
        (Kind::Coherence, _) => return (axis(0, "Coherence", "NONE"), none),
        (_, Some(ResponseForm::Accelerance)) => axis(12, "Acceleration", "m/s2"),
        (_, Some(ResponseForm::Mobility)) => axis(11, "Velocity", "m/s"),
        (_, Some(ResponseForm::Receptance)) => axis(8, "Displacement", "m"),
        (_, None) => {
            let unit = response.unit.as_deref().unwrap_or("NONE");
            return (axis(0, "Response", unit), none);
        }
    };
    (numerator, axis(13, "Force", "N"))
}

/// Records 8 to 11: Format(I10,3I5,2(1X,20A1)).
fn axis(quantity: u32, label: &str, unit: &str) -> String {
    format!(
        "{quantity:10}{:5}{:5}{:5} {:<20} {:<20}\n",
        0,
        0,
        0,
        field(label, 20),
        field(unit, 20)
    )
}

/// Half of record 6: 1X,10A1,I10,I4.
fn point(point: &Point) -> String {
    let name = point.name.as_deref().unwrap_or("NONE");
    format!(
        " {:<10}{:>10}{:>4}",
        field(name, 10),
        point.node,
        point.direction
    )
}

/// Text cut to its field, without what would break the line; "NONE" where nothing is left.
fn field(text: &str, width: usize) -> String {
    let kept: String = text
        .replace(char::is_control, " ")
        .chars()
        .take(width)
        .collect();
    match kept.trim() {
        "" => "NONE".to_owned(),
        _ => kept,
    }
}

/// A number as Fortran's E format prints it: two digits of exponent at least.
fn exponential(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$E}");
    let Some((mantissa, exponent)) = text.split_once('E') else {
        return text;
    };
    let (sign, digits) = match exponent.strip_prefix('-') {
        Some(digits) => ('-', digits),
        None => ('+', exponent),
    };
    format!("{mantissa}E{sign}{digits:0>2}")
}

fn write_dataset(into: &mut Vec<u8>, header: &str, values: &[f64], format: UffFormat) {
    match format {
        UffFormat::Ascii => {
            into.extend_from_slice(b"    -1\n    58\n");
            into.extend_from_slice(header.as_bytes());
            for row in values.chunks(4) {
                let row: String = row
                    .iter()
                    .map(|x| format!("{:>20}", exponential(*x, 12)))
                    .collect();
                into.extend_from_slice(row.as_bytes());
                into.push(b'\n');
            }
        }
        UffFormat::Binary => {
            // Little endian, IEEE 754, eleven lines of header, then this many bytes.
            let bytes = 8 * values.len();
            let line = format!(
                "    -1\n    58b{:6}{:6}{:12}{bytes:12}{:6}{:6}{:12}{:12}\n",
                1, 2, 11, 0, 0, 0, 0
            );
            into.extend_from_slice(line.as_bytes());
            into.extend_from_slice(header.as_bytes());
            into.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    // Behind binary data the mark follows at once, as readers expect that count bytes.
    into.extend_from_slice(b"    -1\n");
}
