//! A frequency response function as text: columns of frequency, real and imaginary part, below
//! whatever the analyser writes about them.

use std::fs::File;
use std::path::Path;

use num_complex::Complex64;

use super::unit::response_unit;
use super::{FrequencyResponse, FrequencyResponses, ResponseError};
use crate::recording::RecordingError;
use crate::recording::csv::CsvSource;
use crate::recording::riff::{read_fully, unreadable};
use crate::recording::text::{decode_text, shown, split_cells};
use crate::recording::time::TimeCheck;
use crate::recording::uff::Point;

/// Bytes of header that are looked at.
const HEADER_BYTES: usize = 1 << 16;

/// Rows that settle the reference step.
const HEAD_ROWS: usize = 4096;

pub(super) fn open(path: &Path, file: String) -> Result<FrequencyResponses, RecordingError> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let (source, _) = CsvSource::open(path, &file, |block| {
        columns.resize(block.len(), Vec::new());
        for (column, part) in columns.iter_mut().zip(block) {
            column.extend_from_slice(part);
        }
    })?;
    let header = read_header(path, &source)?;
    check_columns(&source, &header, columns.len())?;
    let mut columns = columns.into_iter();
    let mut next = || columns.next().unwrap_or_default();
    let (frequencies, real, imaginary, coherence) = (next(), next(), next(), next());
    let (first_frequency, spacing) = even_lines(&source, &frequencies)?;
    let factor = frequency_factor(&header);
    let (unit, found) = match unit_of(&header) {
        Some((unit, found)) => (Some(unit), Some(found)),
        None => (None, None),
    };
    let scale = found.map_or(1.0, |(factor, _)| factor);
    let parts = real.iter().zip(&imaginary);
    let (reference, response) = points(&header);
    let lines = frequencies.len();
    let response = FrequencyResponse {
        name: match (&response.name, &reference.name) {
            (None, None) => "response".to_owned(),
            _ => format!("{response} / {reference}"),
        },
        response,
        reference,
        unit,
        form: found.map(|(_, form)| form),
        values: parts
            .map(|(re, im)| Complex64::new(*re, *im) * scale)
            .collect(),
        coherence: (coherence.len() == lines).then_some(coherence),
    };
    Ok(FrequencyResponses {
        file,
        first_frequency: first_frequency * factor,
        spacing: spacing * factor,
        lines,
        responses: vec![response],
        warnings: Vec::new(),
    })
}

/// The cells of the lines above the first row, the last line first.
fn read_header(path: &Path, source: &CsvSource) -> Result<Vec<Vec<String>>, RecordingError> {
    let length = usize::try_from(source.layout.start).unwrap_or(HEADER_BYTES);
    let mut bytes = vec![0_u8; length.min(HEADER_BYTES)];
    let got = File::open(path)
        .and_then(|mut opened| read_fully(&mut opened, &mut bytes))
        .map_err(|error| unreadable(&source.file, error))?;
    bytes.truncate(got);
    let mut places = Vec::new();
    let lines = bytes.split(|byte| *byte == source.layout.line_end);
    let mut rows: Vec<Vec<String>> = lines
        .map(|line| {
            split_cells(line, source.layout.separator, &mut places);
            let cells = places.iter().filter_map(|place| line.get(place.clone()));
            cells.map(decode_text).collect()
        })
        .collect();
    rows.reverse();
    Ok(rows)
}

/// Three columns, or four with a coherence, none of them named as something else.
fn check_columns(
    source: &CsvSource,
    header: &[Vec<String>],
    count: usize,
) -> Result<(), ResponseError> {
    let line = source.layout.lines_before + 1;
    let file = || source.file.clone();
    if source.layout.time.is_some() {
        return Err(ResponseError::TimeSeries {
            file: file(),
            what: "a time series (it has a time column)".to_owned(),
        });
    }
    let named = |words: &[&str]| {
        let cells = header.iter().flatten();
        cells.clone().find(|cell| {
            let cell = cell.to_lowercase();
            words.iter().any(|word| cell.starts_with(word))
        })
    };
    let wrong = |problem: String| {
        Err(ResponseError::Columns {
            file: file(),
            line,
            problem,
        })
    };
    if let Some(cell) = named(&[
        "magnitude",
        "amplitude",
        "phase",
        "abs",
        "mag ",
        "mag(",
        "deg",
        "db",
    ]) {
        let cell = shown(cell.as_bytes());
        return wrong(format!("the heading \"{cell}\" means magnitude and phase"));
    }
    match count {
        3 => Ok(()),
        4 if named(&["coh", "gamma"]).is_some() => Ok(()),
        4 => wrong("there are 4 columns and no heading says what the last is".to_owned()),
        count => wrong(format!("there are {count} columns")),
    }
}

/// First frequency and spacing (the column's unit).
fn even_lines(source: &CsvSource, frequencies: &[f64]) -> Result<(f64, f64), ResponseError> {
    let before = source.layout.lines_before;
    let printed: Vec<String> = frequencies.iter().map(|x| format!("{x:e}")).collect();
    let cells = || {
        frequencies
            .iter()
            .zip(&printed)
            .map(|(x, cell)| (*x, cell.as_bytes()))
    };
    let mut check = TimeCheck::new(cells().take(HEAD_ROWS));
    for ((frequency, cell), line) in cells().zip(before + 1..) {
        check
            .add(frequency, cell, line)
            .map_err(|uneven| ResponseError::Uneven {
                file: source.file.clone(),
                line: uneven.line,
                frequency: uneven.time,
                step: uneven.step,
                expected: check.reference(),
            })?;
    }
    let (Some(first), Some(last)) = (frequencies.first(), frequencies.last()) else {
        return Ok((0.0, 0.0));
    };
    if frequencies.len() < 2 {
        return Err(ResponseError::Columns {
            file: source.file.clone(),
            line: before + 1,
            problem: "there is a single line, which has no spacing".to_owned(),
        });
    }
    Ok((*first, (last - first) / (frequencies.len() - 1) as f64))
}

/// Factor from the frequency column's unit to Hz: kHz and rad/s where the header says so.
fn frequency_factor(header: &[Vec<String>]) -> f64 {
    let first_cells = header.iter().filter_map(|cells| cells.first());
    for cell in first_cells {
        let cell = cell.to_lowercase();
        let unit = cell
            .trim_end_matches([')', ']'])
            .rsplit(['(', '[', ' '])
            .next()
            .unwrap_or("");
        match unit {
            "hz" => return 1.0,
            "khz" => return 1e3,
            // 2 pi rad are one cycle.
            "rad/s" => return 0.5 / std::f64::consts::PI,
            _ => {}
        }
    }
    1.0
}

/// The unit as written, its factor and form: the cell nearest above the numbers that is one, or
/// that has one in its last brackets.
fn unit_of(header: &[Vec<String>]) -> Option<(String, (f64, super::ResponseForm))> {
    header.iter().flatten().find_map(|cell| {
        let inner = cell.split_once(['(', '[']).map(|(_, rest)| rest);
        let inner = inner.and_then(|rest| rest.strip_suffix([')', ']']));
        [Some(cell.as_str()), inner]
            .into_iter()
            .flatten()
            .find_map(|text| {
                let text = text.trim();
                response_unit(text).map(|found| (text.to_owned(), found))
            })
    })
}

/// Reference and response from a line such as "Ref Chan:Resp Chan", "1+Z:3+Z".
fn points(header: &[Vec<String>]) -> (Point, Point) {
    let line = header.iter().find(|cells| {
        let first = cells.first().map(|cell| cell.to_lowercase());
        first.is_some_and(|cell| cell.starts_with("ref") && cell.contains("resp"))
    });
    let pair = line.and_then(|cells| cells.get(1)?.split_once(':'));
    let point = |name: &str| Point {
        name: Some(name.trim().to_owned()).filter(|name| !name.is_empty()),
        ..Point::default()
    };
    pair.map_or_else(Default::default, |(reference, response)| {
        (point(reference), point(response))
    })
}
