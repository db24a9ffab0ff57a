//! Files of frequency response functions and spectra, and how universal files hold them (function type 4).
//!
//! Text is read in `function_text`, LabVIEW text in `lvm`, MATLAB files in `mat`. A coherence (function type 6) of the
//! same pair of points goes with its response.

use std::path::Path;

use num_complex::Complex64;

use super::error::{RecordingError, RecordingWarning};
use super::function_text::{all_within_coherence, open_text};
use super::health::first_unusable;
use super::responses::{FrequencyResponse, FrequencyResponses, not_finite, time_series};
use super::uff::{
    ACCELERATION, AbscissaUnit, DISPLACEMENT, EXCITATION_FORCE, Entry, EvenPoints, Function,
    FunctionGroup, FunctionType, Ordinate, UniversalFile, VELOCITY, even_points, left_out,
    list_datasets, read_function,
};
use super::units::{ResponseForm, quotient, response_unit};
use super::{FileType, ReadSettings, lvm, mat, recognise};

/// Reads the frequency response functions or spectra of a file: a universal file, text, text by LabVIEW, or a
/// MATLAB file.
///
/// # Errors
/// Files that cannot be read or understood, that hold time series instead, or whose lines are not
/// evenly spaced; merely poor data are [`warnings`](FrequencyResponses::warnings).
pub fn open_frequency_responses(
    path: &Path,
    settings: &ReadSettings,
) -> Result<FrequencyResponses, RecordingError> {
    let file = path.display().to_string();
    match recognise(path, &file)? {
        FileType::Universal => open_uff(path),
        FileType::Text => open_text(path, file, settings),
        FileType::Lvm => lvm::open_functions(path, file, settings),
        FileType::Mat => mat::open_functions(path, file, settings),
        FileType::Flac => Err(time_series(&file, "a FLAC file, a time series")),
        FileType::Wav => Err(time_series(&file, "a WAV file, a time series")),
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
        has_phase: true,
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
