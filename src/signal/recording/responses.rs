//! Frequency response functions that an analyser has measured: from universal files (function type
//! 4) and from text with a frequency, a real and an imaginary column.
//!
//! Values are in SI units. Where a file says in which unit they are, they are converted; where it
//! does not, they are taken as they stand. Lines are evenly spaced; a file whose lines are not is an
//! error. A coherence (function type 6) of the same pair of points goes with its response.

use std::path::Path;

use num_complex::Complex64;

use super::csv::{CsvSource, split_texts};
use super::error::{RecordingError, ResponseError, UffError};
use super::health::first_unusable;
use super::spacing::TimeCheck;
use super::text::shown;
use super::uff::{
    ACCELERATION, AbscissaUnit, DISPLACEMENT, Dataset, EXCITATION_FORCE, Entry, EvenPoints,
    Function, FunctionGroup, FunctionType, Ordinate, Point, UniversalFile, VELOCITY, describe,
    even_points, list_datasets, read_values,
};
use super::units::{ResponseForm, quotient, response_unit};
use super::warning::ResponseWarning;
use super::{FileType, read_head, recognise};

/// Bytes of header that are looked at.
const HEADER_BYTES: usize = 1 << 16;

/// Rows that settle the reference step.
const HEAD_ROWS: usize = 4096;

/// Frequency response functions on the same lines.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyResponses {
    /// The file as the caller named it.
    pub file: String,
    /// Frequency of the first line (Hz).
    pub first_frequency: f64,
    /// Distance of the lines (Hz).
    pub spacing: f64,
    /// Number of lines.
    pub lines: usize,
    /// The responses in the order of the file; one at least.
    pub responses: Vec<FrequencyResponse>,
    /// Doubts about them.
    pub warnings: Vec<ResponseWarning>,
}

impl FrequencyResponses {
    /// Frequency of a line, 0-based (Hz).
    pub fn frequency(&self, line: usize) -> f64 {
        self.first_frequency + line as f64 * self.spacing
    }
}

/// One frequency response function.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrequencyResponse {
    /// Response and reference point such as "3:+Z / 1:-Z", or what else the file calls it.
    pub name: String,
    /// Point of the response.
    pub response: Point,
    /// Point of the force.
    pub reference: Point,
    /// The unit as written; `None` where the file has none.
    pub unit: Option<String>,
    /// Its form by the file: by the types of its axes, else by its unit; `None` where neither says.
    pub form: Option<ResponseForm>,
    /// One value for each line (SI units).
    pub values: Vec<Complex64>,
    /// Coherence at each line (1), where the file has it.
    pub coherence: Option<Vec<f64>>,
}

/// Reads the frequency response functions of a file, a universal file or text.
///
/// # Errors
/// Files that cannot be read or understood, that hold time series instead, or whose lines are not
/// evenly spaced; merely poor data are [`warnings`](FrequencyResponses::warnings).
pub fn open_frequency_responses(path: &Path) -> Result<FrequencyResponses, RecordingError> {
    let file = path.display().to_string();
    match recognise(path, &file)? {
        FileType::Universal => open_uff(path),
        FileType::Text => open_text(path, file),
        FileType::Wav => Err(ResponseError::TimeSeries {
            file,
            what: "a WAV file, a time series".to_owned(),
        }
        .into()),
    }
}

// ---- Text: columns of frequency, real and imaginary part, below whatever the analyser writes about them.

fn open_text(path: &Path, file: String) -> Result<FrequencyResponses, RecordingError> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let (source, _) = CsvSource::open(path, &file, |block| {
        columns.resize(block.len(), Vec::new());
        for (column, part) in columns.iter_mut().zip(block) {
            column.extend_from_slice(part);
        }
    })?;
    let header = TextHeader::read(path, &source)?;
    header.check_columns(&source, columns.len())?;
    columns.resize(4, Vec::new());
    let [frequencies, real, imaginary, coherence] = columns.as_slice() else {
        return Err(RecordingError::NoSamples { file });
    };
    let (first_frequency, spacing) = even_lines(&source, frequencies)?;
    let factor = header.frequency_factor();
    let unit = header.unit();
    let scale = unit.as_ref().map_or(1.0, |(_, scale, _)| *scale);
    let parts = real.iter().zip(imaginary);
    let (reference, response) = header.points();
    Ok(FrequencyResponses {
        file,
        first_frequency: first_frequency * factor,
        spacing: spacing * factor,
        lines: frequencies.len(),
        responses: vec![FrequencyResponse {
            name: match (&response.name, &reference.name) {
                (None, None) => "response".to_owned(),
                _ => format!("{response} / {reference}"),
            },
            response,
            reference,
            form: unit.as_ref().map(|(.., form)| *form),
            unit: unit.map(|(written, ..)| written),
            values: parts
                .map(|(re, im)| Complex64::new(*re, *im) * scale)
                .collect(),
            coherence: (coherence.len() == frequencies.len()).then(|| coherence.clone()),
        }],
        warnings: Vec::new(),
    })
}

/// Cells of the lines above the first row, the last line first.
struct TextHeader {
    lines: Vec<Vec<String>>,
}

impl TextHeader {
    fn read(path: &Path, source: &CsvSource) -> Result<Self, RecordingError> {
        let length = usize::try_from(source.layout.start).unwrap_or(HEADER_BYTES);
        let bytes = read_head(path, &source.file, length.min(HEADER_BYTES))?;
        let lines = bytes.rsplit(|byte| *byte == source.layout.line_end);
        Ok(Self {
            lines: lines
                .map(|line| split_texts(line, source.layout.separator))
                .collect(),
        })
    }

    /// The first cell that begins with one of `words`, in any case of letters.
    fn cell_beginning(&self, words: &[&str]) -> Option<&String> {
        self.lines.iter().flatten().find(|cell| {
            let cell = cell.to_lowercase();
            words.iter().any(|word| cell.starts_with(word))
        })
    }

    /// Checks that there are three columns, or four with a coherence, none of them named as something else.
    fn check_columns(&self, source: &CsvSource, count: usize) -> Result<(), ResponseError> {
        let file = source.file.clone();
        if source.layout.time.is_some() {
            return Err(ResponseError::TimeSeries {
                file,
                what: "a time series (it has a time column)".to_owned(),
            });
        }
        let polar = self.cell_beginning(&[
            "magnitude",
            "amplitude",
            "phase",
            "abs",
            "mag ",
            "mag(",
            "deg",
            "db",
        ]);
        let coherence = self.cell_beginning(&["coh", "gamma"]);
        let problem = match (polar, count, coherence) {
            (Some(cell), ..) => {
                let cell = shown(cell.as_bytes());
                format!("the heading \"{cell}\" means magnitude and phase")
            }
            (None, 3, _) | (None, 4, Some(_)) => return Ok(()),
            (None, 4, None) => {
                "there are 4 columns and no heading says what the last is".to_owned()
            }
            (None, count, _) => format!("there are {count} columns"),
        };
        Err(ResponseError::Columns {
            file,
            line: source.layout.lines_before + 1,
            problem,
        })
    }

    /// Returns the factor from the frequency column's unit to Hz: kHz and rad/s where the header says so.
    fn frequency_factor(&self) -> f64 {
        for cell in self.lines.iter().filter_map(|cells| cells.first()) {
            let cell = cell.to_lowercase();
            let cell = cell.trim_end_matches([')', ']']);
            match cell.rsplit(['(', '[', ' ']).next() {
                Some("hz") => return 1.0,
                Some("khz") => return 1e3,
                // 2 pi rad are one cycle.
                Some("rad/s") => return 0.5 / std::f64::consts::PI,
                _ => {}
            }
        }
        1.0
    }

    /// Returns the unit as written, its factor and form: the cell nearest above the numbers that is one, or
    /// that has one in its last brackets.
    fn unit(&self) -> Option<(String, f64, ResponseForm)> {
        for cell in self.lines.iter().flatten() {
            let inner = cell.split_once(['(', '[']).map(|(_, rest)| rest);
            let inner = inner.and_then(|rest| rest.strip_suffix([')', ']']));
            for text in [Some(cell.as_str()), inner].into_iter().flatten() {
                let text = text.trim();
                if let Some((factor, form)) = response_unit(text) {
                    return Some((text.to_owned(), factor, form));
                }
            }
        }
        None
    }

    /// Returns reference and response from a line such as "Ref Chan:Resp Chan", "1+Z:3+Z".
    fn points(&self) -> (Point, Point) {
        let line = self.lines.iter().find(|cells| {
            let first = cells.first().map(|cell| cell.to_lowercase());
            first.is_some_and(|cell| cell.starts_with("ref") && cell.contains("resp"))
        });
        let pair = line.and_then(|cells| cells.get(1)?.split_once(':'));
        let Some((reference, response)) = pair else {
            return Default::default();
        };
        let [reference, response] = [reference, response].map(|name| Point {
            name: Some(name.trim().to_owned()).filter(|name| !name.is_empty()),
            ..Point::default()
        });
        (reference, response)
    }
}

/// Returns first frequency and spacing (the column's unit).
fn even_lines(source: &CsvSource, frequencies: &[f64]) -> Result<(f64, f64), ResponseError> {
    let before = source.layout.lines_before;
    let printed: Vec<String> = frequencies.iter().map(|x| format!("{x:e}")).collect();
    let texts = printed.iter().map(|text| text.as_bytes());
    let cells = frequencies.iter().copied().zip(texts);
    let mut check = TimeCheck::new(cells.clone().take(HEAD_ROWS));
    for ((frequency, cell), line) in cells.zip(before + 1..) {
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
    match frequencies {
        [] => Ok((0.0, 0.0)),
        [_] => Err(ResponseError::Columns {
            file: source.file.clone(),
            line: before + 1,
            problem: "there is a single line, which has no spacing".to_owned(),
        }),
        [first, .., last] => Ok((*first, (last - first) / (frequencies.len() - 1) as f64)),
    }
}

// ---- Universal files.

fn open_uff(path: &Path) -> Result<FrequencyResponses, RecordingError> {
    let file = list_datasets(path)?;
    let mut warnings = Vec::new();
    if let Some(dataset) = file.cut_header {
        warnings.push(ResponseWarning::HeaderCut { dataset });
    }
    let responses = functions(&file, FunctionType::FREQUENCY_RESPONSE);
    let group = FunctionGroup::largest(&file, responses, AbscissaUnit::Hertz)?;
    let Some(points) = group.points else {
        return Err(nothing_usable(&file, group.left_out.first()));
    };
    for ((dataset, function), reason) in group.left_out {
        warnings.push(left_out(dataset, function, reason));
    }
    let mut responses = Vec::with_capacity(group.functions.len());
    for (dataset, function) in group.functions {
        let response = read_response(&file, dataset, function, &mut warnings)?;
        responses.push(((dataset, function), response));
    }
    let lines = complete_lines(points.points, &mut responses, &mut warnings);
    if lines == 0 {
        return Err(RecordingError::NoSamples { file: file.name });
    }
    for (dataset, function) in functions(&file, FunctionType::COHERENCE) {
        let attached = attach_coherence(&file, dataset, function, &points, lines, &mut responses)?;
        if let Err(reason) = attached {
            warnings.push(left_out(dataset, function, reason.to_owned()));
        }
    }
    let responses = responses.into_iter().map(|(_, response)| response);
    Ok(FrequencyResponses {
        first_frequency: points.start,
        spacing: points.step,
        lines,
        responses: responses.collect(),
        file: file.name,
        warnings,
    })
}

fn functions(file: &UniversalFile, wanted: FunctionType) -> impl Iterator<Item = Entry<'_>> {
    file.functions()
        .filter(move |(_, function)| function.function_type == wanted)
}

fn left_out(dataset: &Dataset, function: &Function, reason: String) -> ResponseWarning {
    ResponseWarning::LeftOut {
        dataset: dataset.number,
        name: describe(function),
        reason,
    }
}

/// Returns why there is no response.
fn nothing_usable(file: &UniversalFile, unusable: Option<&(Entry<'_>, String)>) -> RecordingError {
    let (name, found) = (file.name.clone(), file.contents());
    if let Some(((dataset, function), problem)) = unusable {
        return ResponseError::Unusable {
            file: name,
            dataset: dataset.number,
            name: describe(function),
            problem: problem.clone(),
        }
        .into();
    }
    if file.functions().next().is_none() {
        return UffError::NoFunctions { file: name, found }.into();
    }
    match file
        .functions()
        .any(|(_, function)| function.is_time_series())
    {
        true => ResponseError::TimeSeries {
            file: name,
            what: format!("a universal file with time series ({found})"),
        },
        false => ResponseError::None { file: name, found },
    }
    .into()
}

/// Reads one response in SI units, and adds the doubts about it.
fn read_response(
    file: &UniversalFile,
    dataset: &Dataset,
    function: &Function,
    warnings: &mut Vec<ResponseWarning>,
) -> Result<FrequencyResponse, RecordingError> {
    let read = read_values(file, dataset, function)?;
    let mut response = FrequencyResponse {
        name: response_name(function),
        response: function.response.clone(),
        reference: function.reference.clone(),
        ..FrequencyResponse::default()
    };
    let factor = settle_unit(&mut response, file, function, warnings);
    let imaginary = read.imaginary.unwrap_or_default();
    let parts = read.real.iter().zip(&imaginary);
    response.values = parts
        .map(|(re, im)| Complex64::new(*re, *im) * factor)
        .collect();
    let sums = response.values.iter().map(|value| value.re + value.im);
    match first_unusable(sums.clone()) {
        None => Ok(response),
        Some(at) => Err(UffError::NotFinite {
            file: file.name.clone(),
            dataset: dataset.number,
            point: at as u64 + 1,
            value: sums.clone().nth(at).unwrap_or(f64::NAN),
        }
        .into()),
    }
}

/// Names a response by both points, else by the description.
fn response_name(function: &Function) -> String {
    let response = function.response.to_string();
    let reference = function.reference.to_string();
    if response != "-" || reference != "-" {
        return format!("{response} / {reference}");
    }
    let label = function.numerator.label.clone();
    let words = function.id_lines[0].clone().or(label);
    words.unwrap_or_else(|| function.function_type.name().to_owned())
}

/// Settles unit and form of a response, and adds doubts about them. Returns the factor to SI.
///
/// The unit stands in the ordinate's label as a whole, or is split between the labels of numerator
/// and denominator; without labels the file's unit system gives the factor.
fn settle_unit(
    response: &mut FrequencyResponse,
    file: &UniversalFile,
    function: &Function,
    warnings: &mut Vec<ResponseWarning>,
) -> f64 {
    let (above, below) = (&function.numerator, &function.denominator);
    let by_axes = match (above.quantity, below.quantity) {
        (ACCELERATION, EXCITATION_FORCE) => Some(ResponseForm::Accelerance),
        (VELOCITY, EXCITATION_FORCE) => Some(ResponseForm::Mobility),
        (DISPLACEMENT, EXCITATION_FORCE) => Some(ResponseForm::Receptance),
        _ => None,
    };
    let whole = above.unit.as_deref().and_then(response_unit);
    let (written, by_unit) = match (&above.unit, &below.unit) {
        (Some(motion), Some(force)) if whole.is_none() => (
            Some(format!("({motion})/({force})")),
            quotient(motion, force),
        ),
        (written, _) => (written.clone(), whole),
    };
    let name = response.name.clone();
    if let (Some(unit), None) = (&written, by_unit) {
        let unit = unit.clone();
        warnings.push(ResponseWarning::UnknownUnit { name, unit });
    } else if let (Some(axes), Some((_, unit_form)), Some(unit)) = (by_axes, by_unit, &written)
        && axes != unit_form
    {
        warnings.push(ResponseWarning::FormsDisagree {
            name,
            unit: unit.clone(),
            by_axes: axes.name(),
            by_unit: unit_form.name(),
        });
    }
    let by_system = file
        .units
        .and_then(|system| Some(system.si(above.quantity)?.0 / system.si(below.quantity)?.0));
    response.form = by_axes.or(by_unit.map(|(_, form)| form));
    let factor = match (&written, by_unit) {
        (_, Some((factor, _))) => factor,
        (Some(_), None) => 1.0,
        (None, None) => by_system.unwrap_or(1.0),
    };
    response.unit = written;
    factor
}

/// Settles how many lines all responses have. Responses that end early are left out where others are
/// complete; where none is, all end with the shortest.
fn complete_lines(
    promised: u64,
    responses: &mut Vec<(Entry<'_>, FrequencyResponse)>,
    warnings: &mut Vec<ResponseWarning>,
) -> usize {
    let lengths = responses.iter().map(|(_, response)| response.values.len());
    if lengths.clone().any(|present| present as u64 == promised) {
        responses.retain(|((dataset, function), response)| {
            let present = response.values.len();
            let complete = present as u64 == promised;
            if !complete {
                let reason = format!("{present} of its {promised} lines are there");
                warnings.push(left_out(dataset, function, reason));
            }
            complete
        });
        return usize::try_from(promised).unwrap_or(usize::MAX);
    }
    let shortest = lengths.min().unwrap_or(0);
    for (_, response) in responses {
        response.values.truncate(shortest);
    }
    warnings.push(ResponseWarning::Truncated {
        present: shortest as u64,
        promised,
    });
    shortest
}

/// Gives a coherence to the first response of the same points that has none yet; `Err` inside says why it is unused.
fn attach_coherence(
    file: &UniversalFile,
    dataset: &Dataset,
    function: &Function,
    points: &EvenPoints,
    lines: usize,
    responses: &mut [(Entry<'_>, FrequencyResponse)],
) -> Result<Result<(), &'static str>, RecordingError> {
    if function.ordinate == Ordinate::Complex {
        return Ok(Err("a coherence is real, its values are complex"));
    }
    match even_points(file, dataset, function, AbscissaUnit::Hertz)? {
        Ok(own) if own.matches(points) => {}
        _ => return Ok(Err("its lines are not those of the responses")),
    }
    let own = responses.iter_mut().find(|((_, other), response)| {
        response.coherence.is_none()
            && other.response == function.response
            && other.reference == function.reference
    });
    let Some((_, response)) = own else {
        return Ok(Err("no response has its points"));
    };
    let mut values = read_values(file, dataset, function)?.real;
    values.truncate(lines);
    // What printing with six digits adds to a coherence of 1, and more.
    let usable = values.iter().all(|value| (-1e-3..=1.001).contains(value));
    if values.len() < lines || !usable {
        return Ok(Err("its values are not all between 0 and 1"));
    }
    response.coherence = Some(values);
    Ok(Ok(()))
}
