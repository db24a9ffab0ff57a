//! Frequency response functions of a universal file.

use std::path::Path;

use num_complex::Complex64;

use super::unit::{quotient, response_unit};
use super::{FrequencyResponse, FrequencyResponses, ResponseError, ResponseForm, ResponseWarning};
use crate::recording::RecordingError;
use crate::recording::text::{LARGEST, short};
use crate::recording::uff::{
    ACCELERATION, AbscissaUnit, DISPLACEMENT, Dataset, EXCITATION_FORCE, EvenPoints, Function,
    FunctionType, Ordinate, UffError, UniversalFile, VELOCITY, describe, even_points,
    largest_group, list_datasets, read_values,
};

/// A function and its header.
type Entry<'a> = (&'a Dataset, &'a Function);

pub(super) fn open(path: &Path) -> Result<FrequencyResponses, RecordingError> {
    let file = list_datasets(path)?;
    let (kept, points, mut warnings) = choose(&file)?;
    let mut responses = Vec::with_capacity(kept.len());
    for (dataset, function) in kept {
        let (response, doubts) = read_response(&file, (dataset, function))?;
        responses.push(((dataset, function), response));
        warnings.extend(doubts);
    }
    let lines = complete_lines(points.points, &mut responses, &mut warnings);
    if lines == 0 {
        return Err(RecordingError::NoSamples { file: file.name });
    }
    attach_coherences(&file, (points, lines), &mut responses, &mut warnings)?;
    Ok(FrequencyResponses {
        file: file.name.clone(),
        first_frequency: points.start,
        spacing: points.step,
        lines,
        responses: responses
            .into_iter()
            .map(|(_, response)| response)
            .collect(),
        warnings,
    })
}

/// The functions that are read, their lines, and what there is to say about the others.
fn choose(
    file: &UniversalFile,
) -> Result<(Vec<Entry<'_>>, EvenPoints, Vec<ResponseWarning>), RecordingError> {
    let cut = file
        .cut_header
        .map(|dataset| ResponseWarning::HeaderCut { dataset });
    let mut warnings: Vec<ResponseWarning> = cut.into_iter().collect();
    let (mut usable, mut unusable) = (Vec::new(), Vec::new());
    for entry in functions(file, FunctionType::FREQUENCY_RESPONSE) {
        let points = match entry.1.ordinate {
            Ordinate::Real => Err("its values are real and say nothing of the phase".to_owned()),
            Ordinate::Complex => even_points(file, entry, AbscissaUnit::Hertz)?,
        };
        match points {
            Ok(points) => usable.push((entry, points)),
            Err(problem) => unusable.push((entry, problem)),
        }
    }
    let (kept, others) = largest_group(usable);
    let Some(points) = kept.first().map(|(_, points)| *points) else {
        return Err(nothing_usable(file, unusable.first()));
    };
    let first = kept.first().map_or(0, |((dataset, _), _)| dataset.number);
    let others = others.into_iter().map(|(entry, other)| {
        let words = |lines: &EvenPoints| {
            let (start, step) = (short(lines.start), short(lines.step));
            format!("{} lines from {start} Hz, {step} Hz apart", lines.points)
        };
        let reason = format!(
            "{}, where dataset {first} has {}",
            words(&other),
            words(&points)
        );
        (entry, reason)
    });
    for ((dataset, function), reason) in unusable.into_iter().chain(others) {
        warnings.push(left_out(dataset, function, reason));
    }
    Ok((
        kept.into_iter().map(|(entry, _)| entry).collect(),
        points,
        warnings,
    ))
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

/// Why there is no response.
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
    let mut all = file.functions();
    if file.functions().next().is_none() {
        return UffError::NoFunctions { file: name, found }.into();
    }
    match all.any(|(_, function)| function.is_time_series()) {
        true => ResponseError::TimeSeries {
            file: name,
            what: format!("a universal file with time series ({found})"),
        },
        false => ResponseError::None { file: name, found },
    }
    .into()
}

/// One response in SI units, and the doubts about it.
fn read_response(
    file: &UniversalFile,
    (dataset, function): Entry<'_>,
) -> Result<(FrequencyResponse, Vec<ResponseWarning>), RecordingError> {
    let read = read_values(file, dataset, function)?;
    let name = response_name(function);
    let (unit, factor, form, warnings) = unit_of(file, function, &name);
    let imaginary = read.imaginary.unwrap_or_default();
    let parts = read.real.iter().zip(&imaginary);
    let values: Vec<Complex64> = parts
        .map(|(re, im)| Complex64::new(*re, *im) * factor)
        .collect();
    check_finite(
        file,
        dataset.number,
        values.iter().map(|value| value.re + value.im),
    )?;
    let response = FrequencyResponse {
        name,
        response: function.response.clone(),
        reference: function.reference.clone(),
        unit,
        form,
        values,
        coherence: None,
    };
    Ok((response, warnings))
}

fn check_finite(
    file: &UniversalFile,
    dataset: usize,
    mut values: impl Iterator<Item = f64>,
) -> Result<(), UffError> {
    // NaN is in no range.
    let found = values
        .by_ref()
        .zip(1..)
        .find(|(x, _)| !(-LARGEST..=LARGEST).contains(x));
    match found {
        None => Ok(()),
        Some((value, point)) => Err(UffError::NotFinite {
            file: file.name.clone(),
            dataset,
            point,
            value,
        }),
    }
}

/// Both points, else the description.
fn response_name(function: &Function) -> String {
    let (response, reference) = (
        function.response.to_string(),
        function.reference.to_string(),
    );
    if response != "-" || reference != "-" {
        return format!("{response} / {reference}");
    }
    let label = function.numerator.label.clone();
    let words = function.id_lines[0].clone().or(label);
    words.unwrap_or_else(|| function.function_type.name().to_owned())
}

/// Unit as written, factor to SI, form, and what is doubtful about them.
///
/// The unit stands in the ordinate's label as a whole, or is split between the labels of numerator
/// and denominator; without labels the file's unit system gives the factor.
fn unit_of(
    file: &UniversalFile,
    function: &Function,
    name: &str,
) -> (
    Option<String>,
    f64,
    Option<ResponseForm>,
    Vec<ResponseWarning>,
) {
    let (above, below) = (&function.numerator, &function.denominator);
    let by_axes = match (above.quantity, below.quantity) {
        (ACCELERATION, EXCITATION_FORCE) => Some(ResponseForm::Accelerance),
        (VELOCITY, EXCITATION_FORCE) => Some(ResponseForm::Mobility),
        (DISPLACEMENT, EXCITATION_FORCE) => Some(ResponseForm::Receptance),
        _ => None,
    };
    let (written, by_unit) = match (&above.unit, &below.unit) {
        (Some(whole), None) => (Some(whole.clone()), response_unit(whole)),
        (Some(motion), Some(force)) => match response_unit(motion) {
            Some(found) => (Some(motion.clone()), Some(found)),
            None => (
                Some(format!("({motion})/({force})")),
                quotient(motion, force),
            ),
        },
        (None, _) => (None, None),
    };
    let by_system = file
        .units
        .and_then(|system| Some(system.si(above.quantity)?.0 / system.si(below.quantity)?.0));
    let mut warnings = Vec::new();
    let factor = match (&written, by_unit) {
        (_, Some((factor, _))) => factor,
        (Some(unit), None) => {
            let (name, unit) = (name.to_owned(), unit.clone());
            warnings.push(ResponseWarning::UnknownUnit { name, unit });
            1.0
        }
        (None, None) => by_system.unwrap_or(1.0),
    };
    if let (Some(axes), Some((_, unit_form)), Some(unit)) = (by_axes, by_unit, &written)
        && axes != unit_form
    {
        warnings.push(ResponseWarning::FormsDisagree {
            name: name.to_owned(),
            unit: unit.clone(),
            by_axes: axes.name(),
            by_unit: unit_form.name(),
        });
    }
    let form = by_axes.or(by_unit.map(|(_, form)| form));
    (written, factor, form, warnings)
}

/// How many lines all responses have. Responses that end early are left out where others are
/// complete; where none is, all end with the shortest.
fn complete_lines(
    promised: u64,
    responses: &mut Vec<(Entry<'_>, FrequencyResponse)>,
    warnings: &mut Vec<ResponseWarning>,
) -> usize {
    let complete = |response: &FrequencyResponse| response.values.len() as u64 == promised;
    if responses.iter().any(|(_, response)| complete(response)) {
        responses.retain(|((dataset, function), response)| {
            if !complete(response) {
                let present = response.values.len();
                let reason = format!("{present} of its {promised} lines are there");
                warnings.push(left_out(dataset, function, reason));
            }
            complete(response)
        });
        return usize::try_from(promised).unwrap_or(usize::MAX);
    }
    let present = responses
        .iter()
        .map(|(_, response)| response.values.len())
        .min();
    let present = present.unwrap_or(0);
    for (_, response) in responses {
        response.values.truncate(present);
    }
    let (present_lines, promised) = (present as u64, promised);
    warnings.push(ResponseWarning::Truncated {
        present: present_lines,
        promised,
    });
    present
}

/// Gives each coherence to the first response of the same points that has none yet.
fn attach_coherences(
    file: &UniversalFile,
    (points, lines): (EvenPoints, usize),
    responses: &mut [(Entry<'_>, FrequencyResponse)],
    warnings: &mut Vec<ResponseWarning>,
) -> Result<(), RecordingError> {
    for (dataset, function) in functions(file, FunctionType::COHERENCE) {
        let mut unused =
            |reason: &str| warnings.push(left_out(dataset, function, reason.to_owned()));
        if function.ordinate == Ordinate::Complex {
            unused("a coherence is real, its values are complex");
            continue;
        }
        match even_points(file, (dataset, function), AbscissaUnit::Hertz)? {
            Ok(own) if own.matches(&points) => {}
            _ => {
                unused("its lines are not those of the responses");
                continue;
            }
        }
        let pair = |function: &Function| (function.response.clone(), function.reference.clone());
        let own = responses.iter_mut().find(|((_, other), response)| {
            response.coherence.is_none() && pair(other) == pair(function)
        });
        let Some((_, response)) = own else {
            unused("no response has its points");
            continue;
        };
        let mut values = read_values(file, dataset, function)?.real;
        values.truncate(lines);
        // What printing with six digits adds to a coherence of 1, and more.
        let usable = values.iter().all(|value| (-1e-3..=1.001).contains(value));
        if values.len() < lines || !usable {
            unused("its values are not all between 0 and 1");
            continue;
        }
        response.coherence = Some(values);
    }
    Ok(())
}
