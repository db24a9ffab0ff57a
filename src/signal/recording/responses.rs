//! Frequency response functions that an analyser has measured: from universal files (function type
//! 4) and from text with a frequency, a real and an imaginary column.
//!
//! Values are in SI units. Where a file says in which unit they are, they are converted; where it
//! does not, they are taken as they stand. Lines are evenly spaced; a file whose lines are not is an
//! error. A coherence (function type 6) of the same pair of points goes with its response.

use std::path::Path;

use num_complex::Complex64;

use super::csv::{CsvSource, split_texts};
use super::error::{RecordingError, RecordingWarning};
use super::health::first_unusable;
use super::text::{TimeCheck, shown};
use super::uff::{
    ACCELERATION, AbscissaUnit, DISPLACEMENT, EXCITATION_FORCE, Entry, EvenPoints, Function,
    FunctionGroup, FunctionType, Ordinate, Point, UniversalFile, VELOCITY, even_points, left_out,
    list_datasets, read_function,
};
use super::units::{ResponseForm, quotient, response_unit};
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
    pub warnings: Vec<RecordingWarning>,
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
        FileType::Wav => Err(time_series(&file, "a WAV file, a time series")),
    }
}

/// Returns the error of a recording where responses were expected.
fn time_series(file: &str, what: &str) -> RecordingError {
    let problem = format!(
        "is {what}; frequency response functions were expected because `form` is given; remove `form` (and `sensor`) from its [[recording]], or give the file with the responses"
    );
    RecordingError::new(file, problem)
}

// ---- Text: columns of frequency, real and imaginary part, below whatever the analyser writes about them.

/// Returns the error of columns that are not frequency, real part and imaginary part.
fn wrong_columns(source: &CsvSource, problem: &str) -> RecordingError {
    source.error(format!(
        "{problem}; allowed: three columns, frequency (Hz), real part and imaginary part, and coherence as a fourth; export it so"
    ))
}

fn open_text(path: &Path, file: String) -> Result<FrequencyResponses, RecordingError> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let source = CsvSource::open(path, &file, |block| {
        columns.resize(block.len(), Vec::new());
        for (column, part) in columns.iter_mut().zip(block) {
            column.extend_from_slice(part);
        }
    })?;
    // Cells of the lines above the first row, the last line first.
    let length = usize::try_from(source.layout.start).unwrap_or(HEADER_BYTES);
    let bytes = read_head(path, &source.file, length.min(HEADER_BYTES))?;
    let lines = bytes.rsplit(|byte| *byte == source.layout.line_end);
    let header: Vec<Vec<String>> = lines
        .map(|line| split_texts(line, source.layout.separator))
        .collect();
    check_columns(&header, &source, columns.len())?;
    columns.resize(4, Vec::new());
    let [frequencies, real, imaginary, coherence] = columns.as_slice() else {
        return Err(RecordingError::no_samples(&file));
    };
    let (first_frequency, spacing) = even_lines(&source, frequencies)?;
    let (factor, unit) = units_in(&header);
    let scale = unit.as_ref().map_or(1.0, |(_, scale, _)| *scale);
    let parts = real.iter().zip(imaginary);
    // A line such as "Ref Chan:Resp Chan", "1+Z:3+Z".
    let points = header.iter().find(|cells| {
        let first = cells.first().map(|cell| cell.to_lowercase());
        first.is_some_and(|cell| cell.starts_with("ref") && cell.contains("resp"))
    });
    let points = points.and_then(|cells| cells.get(1)?.split_once(':'));
    let (reference, response) = points.unwrap_or_default();
    let [reference, response] = [reference, response].map(|name| Point {
        name: Some(name.trim().to_owned()).filter(|name| !name.is_empty()),
        ..Point::default()
    });
    let is_coherence = coherence.len() == frequencies.len() && all_within_coherence(coherence);
    let doubt = (!coherence.is_empty() && !is_coherence).then(|| {
        let message = "the column of the coherence is left out: its values are not all between 0 and 1; export it again if it is needed";
        RecordingWarning::new("coherence-left-out", message.to_owned())
    });
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
            coherence: is_coherence.then(|| coherence.clone()),
        }],
        warnings: Vec::from_iter(doubt),
    })
}

/// Returns true where all values lie between 0 and 1, but for what printing with six digits adds, and more.
fn all_within_coherence(values: &[f64]) -> bool {
    values.iter().all(|value| (-1e-3..=1.001).contains(value))
}

/// Words that begin the heading of a magnitude or a phase.
const POLAR: [&str; 8] = [
    "magnitude",
    "amplitude",
    "phase",
    "abs",
    "mag ",
    "mag(",
    "deg",
    "db",
];

/// The first cell that begins with one of `words`, in any case of letters.
fn cell_beginning<'a>(header: &'a [Vec<String>], words: &[&str]) -> Option<&'a String> {
    header.iter().flatten().find(|cell| {
        let cell = cell.to_lowercase();
        words.iter().any(|word| cell.starts_with(word))
    })
}

/// Checks that there are three columns, or four with a coherence, none of them named as something else.
fn check_columns(
    header: &[Vec<String>],
    source: &CsvSource,
    count: usize,
) -> Result<(), RecordingError> {
    if source.layout.time.is_some() {
        let what = "a time series (it has a time column)";
        return Err(time_series(&source.file, what));
    }
    let polar = cell_beginning(header, &POLAR);
    let coherence = cell_beginning(header, &["coh", "gamma"]);
    let problem = match (polar, count, coherence) {
        (Some(cell), ..) => {
            let cell = shown(cell.as_bytes());
            format!("the heading \"{cell}\" means magnitude and phase")
        }
        (None, 3, _) | (None, 4, Some(_)) => return Ok(()),
        (None, 4, None) => "there are 4 columns and no heading says what the last is".to_owned(),
        (None, count, _) => format!("there are {count} columns"),
    };
    Err(wrong_columns(source, &problem))
}

/// Returns the factor from the frequency column's unit to Hz, and the unit of the values: as written, its factor, its
/// form.
fn units_in(header: &[Vec<String>]) -> (f64, Option<(String, f64, ResponseForm)>) {
    let mut first_cells = header.iter().filter_map(|cells| cells.first());
    let factor = first_cells.find_map(|cell| {
        let cell = cell.to_lowercase();
        let cell = cell.trim_end_matches([')', ']']);
        match cell.rsplit(['(', '[', ' ']).next() {
            Some("hz") => Some(1.0),
            Some("khz") => Some(1e3),
            // 2 pi rad are one cycle.
            Some("rad/s") => Some(0.5 / std::f64::consts::PI),
            _ => None,
        }
    });
    // The cell nearest above the numbers that is a unit, or that has one in its last brackets.
    let unit = header.iter().flatten().find_map(|cell| {
        let inner = cell.split_once(['(', '[']).map(|(_, rest)| rest);
        let inner = inner.and_then(|rest| rest.strip_suffix([')', ']']));
        [Some(cell.as_str()), inner].into_iter().find_map(|text| {
            let text = text?.trim();
            let (factor, form) = response_unit(text)?;
            Some((text.to_owned(), factor, form))
        })
    });
    (factor.unwrap_or(1.0), unit)
}

/// Returns first frequency and spacing (the column's unit).
fn even_lines(source: &CsvSource, frequencies: &[f64]) -> Result<(f64, f64), RecordingError> {
    let printed: Vec<String> = frequencies.iter().map(|x| format!("{x:e}")).collect();
    let texts = printed.iter().map(|text| text.as_bytes());
    let cells = frequencies.iter().copied().zip(texts);
    let mut check = TimeCheck::new(cells.clone().take(HEAD_ROWS));
    // Empty lines are not counted.
    for ((frequency, cell), line) in cells.zip(source.layout.lines_before + 1..) {
        check.add(frequency, cell, line).map_err(|uneven| {
            let problem = format!(
                "uneven lines: {}; allowed: 0.1 % of the step, or what rounding of the printed frequency explains; export evenly spaced lines",
                uneven.words(1.0, "Hz", "line")
            );
            RecordingError::at_line(&source.file, uneven.line, problem)
        })?;
    }
    match frequencies {
        [] => Ok((0.0, 0.0)),
        [_] => {
            let problem = "there is a single line, which has no spacing";
            Err(wrong_columns(source, problem))
        }
        [first, .., last] => Ok((*first, (last - first) / (frequencies.len() - 1) as f64)),
    }
}

// ---- Universal files.

fn open_uff(path: &Path) -> Result<FrequencyResponses, RecordingError> {
    let file = list_datasets(path)?;
    let unit = AbscissaUnit::Hertz;
    let mut warnings = Vec::from_iter(file.cut_header_doubt());
    let responses = functions(&file, FunctionType::FREQUENCY_RESPONSE);
    let Some(group) = FunctionGroup::largest(&file, responses, unit)? else {
        let found = file.contents();
        let series = file
            .functions()
            .any(|(_, function)| function.is_time_series());
        return Err(match series {
            true => {
                let what = format!("a universal file with time series ({found})");
                time_series(&file.name, &what)
            }
            false => RecordingError::new(
                &file.name,
                format!(
                    "holds no frequency response function (function type 4), only {found}; export complex responses over force"
                ),
            ),
        });
    };
    for (entry, reason) in group.left_out {
        warnings.push(left_out(entry, &reason, unit));
    }
    let mut responses = Vec::with_capacity(group.functions.len());
    for entry in group.functions {
        responses.push((entry, read_response(&file, entry, &mut warnings)?));
    }
    let lines = complete_lines(group.points.points, &mut responses, &mut warnings);
    if lines == 0 {
        return Err(RecordingError::no_samples(&file.name));
    }
    for entry in functions(&file, FunctionType::COHERENCE) {
        let attached = attach_coherence(&file, entry, &group.points, lines, &mut responses)?;
        if let Err(reason) = attached {
            warnings.push(left_out(entry, reason, unit));
        }
    }
    let responses = responses.into_iter().map(|(_, response)| response);
    Ok(FrequencyResponses {
        first_frequency: group.points.start,
        spacing: group.points.step,
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

/// Reads one response in SI units, and adds the doubts about it.
fn read_response(
    file: &UniversalFile,
    entry: Entry<'_>,
    warnings: &mut Vec<RecordingWarning>,
) -> Result<FrequencyResponse, RecordingError> {
    let (dataset, function) = entry;
    let read = read_function(file, dataset.number)?;
    let (response, reference) = (
        function.response.to_string(),
        function.reference.to_string(),
    );
    // Both points, else the description.
    let name = if response != "-" || reference != "-" {
        format!("{response} / {reference}")
    } else {
        let label = function.numerator.label.clone();
        let words = function.id_lines[0].clone().or(label);
        words.unwrap_or_else(|| function.function_type.name().to_owned())
    };
    let mut response = FrequencyResponse {
        name,
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
    match first_unusable(sums) {
        None => Ok(response),
        Some(at) => {
            let value = response.values[at].re + response.values[at].im;
            Err(not_finite(&file.name, dataset.number, at, value))
        }
    }
}

/// Returns the error of a value that is no number of physical size.
///
/// `dataset` is 1-based (when writing: the response), `point` 0-based.
pub(super) fn not_finite(file: &str, dataset: usize, point: usize, value: f64) -> RecordingError {
    let problem = format!(
        "dataset {dataset}, point {} is {value}; allowed: finite numbers of magnitude up to 1e100; export the file again",
        point + 1
    );
    RecordingError::new(file, problem)
}

/// Settles unit and form of a response, and adds doubts about them. Returns the factor to SI.
///
/// The unit stands in the ordinate's label as a whole, or is split between the labels of numerator
/// and denominator; without labels the file's unit system gives the factor.
fn settle_unit(
    response: &mut FrequencyResponse,
    file: &UniversalFile,
    function: &Function,
    warnings: &mut Vec<RecordingWarning>,
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
    let name = &response.name;
    if let (Some(unit), None) = (&written, by_unit) {
        let message = format!(
            "{name}: the unit \"{unit}\" is not known; the numbers are taken as they stand, in SI units; check the level"
        );
        warnings.push(RecordingWarning::new("unknown-unit", message));
    } else if let (Some(axes), Some((_, unit_form)), Some(unit)) = (by_axes, by_unit, &written)
        && axes != unit_form
    {
        let (by_axes, by_unit) = (axes.name(), unit_form.name());
        let message = format!(
            "{name}: the types of its axes make it {by_axes}, its unit \"{unit}\" makes it {by_unit}; it is taken as {by_axes}; say which it is with `form`"
        );
        warnings.push(RecordingWarning::new("forms-disagree", message));
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
    warnings: &mut Vec<RecordingWarning>,
) -> usize {
    let lengths = responses.iter().map(|(_, response)| response.values.len());
    if lengths.clone().any(|present| present as u64 == promised) {
        responses.retain(|(entry, response)| {
            let present = response.values.len();
            let complete = present as u64 == promised;
            if !complete {
                let reason = format!("{present} of its {promised} lines are there");
                warnings.push(left_out(*entry, &reason, AbscissaUnit::Hertz));
            }
            complete
        });
        return usize::try_from(promised).unwrap_or(usize::MAX);
    }
    let shortest = lengths.min().unwrap_or(0);
    for (_, response) in responses {
        response.values.truncate(shortest);
    }
    let message = format!(
        "the file is truncated: {shortest} of the promised {promised} lines are there; an export or a copy was probably interrupted; what is there is used"
    );
    warnings.push(RecordingWarning::new("truncated", message));
    shortest
}

/// Gives a coherence to the first response of the same points that has none yet; `Err` inside says why it is unused.
fn attach_coherence(
    file: &UniversalFile,
    entry: Entry<'_>,
    points: &EvenPoints,
    lines: usize,
    responses: &mut [(Entry<'_>, FrequencyResponse)],
) -> Result<Result<(), &'static str>, RecordingError> {
    let (dataset, function) = entry;
    if function.ordinate == Ordinate::Complex {
        return Ok(Err("a coherence is real, its values are complex"));
    }
    match even_points(file, entry, AbscissaUnit::Hertz)? {
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
    let mut values = read_function(file, dataset.number)?.real;
    values.truncate(lines);
    if values.len() < lines || !all_within_coherence(&values) {
        return Ok(Err("its values are not all between 0 and 1"));
    }
    response.coherence = Some(values);
    Ok(Ok(()))
}
