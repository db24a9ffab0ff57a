//! Errors of the library as exceptions of `tapjoint.errors`.

use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyType};
use tapjoint::cli::CallError;
use tapjoint::description::DescriptionError;
use tapjoint::pipeline::PipelineError;
use tapjoint::recording::RecordingError;

/// Kinds of exceptions, by the name of their class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Arguments or data that cannot be used.
    Input,
    /// A recording that cannot be read.
    Recording,
    /// A test description that is not valid.
    Description,
}

impl Kind {
    fn class(self) -> &'static str {
        match self {
            Self::Input => "InputError",
            Self::Recording => "RecordingError",
            Self::Description => "DescriptionError",
        }
    }
}

/// Returns the exception of wrong arguments, with this message.
pub fn refused(py: Python<'_>, text: &str) -> PyErr {
    made(py, Kind::Input, text, Place::default()).unwrap_or_else(|error| error)
}

/// Returns the exception of a file, with this message: file and line stand at its beginning.
pub fn exception(py: Python<'_>, kind: Kind, text: &str) -> PyErr {
    made(py, kind, text, place_of(text)).unwrap_or_else(|error| error)
}

fn made(py: Python<'_>, kind: Kind, text: &str, place: Place<'_>) -> PyResult<PyErr> {
    let class = py.import("tapjoint.errors")?.getattr(kind.class())?;
    let keys = [
        ("file", place.file.into_pyobject(py)?.into_any()),
        ("line", place.line.into_pyobject(py)?.into_any()),
    ];
    let value = class
        .cast_into::<PyType>()?
        .call((text,), Some(&keys.into_py_dict(py)?))?;
    Ok(PyErr::from_value(value))
}

/// Where the problem is.
#[derive(Default)]
struct Place<'a> {
    file: Option<&'a str>,
    /// From 1.
    line: Option<u64>,
}

/// Returns the place at the beginning of a message, `FILE:LINE: ` or `FILE: `.
fn place_of(text: &str) -> Place<'_> {
    let Some((head, _)) = text.split_once(": ") else {
        return Place::default();
    };
    let numbered = head.rsplit_once(':');
    let numbered = numbered.and_then(|(file, line)| Some((file, line.parse().ok()?)));
    match numbered {
        Some((file, line)) => Place {
            file: Some(file),
            line: Some(line),
        },
        // Words, and options of a command, are no file.
        None if head.contains(' ') && !std::path::Path::new(head).exists() => Place::default(),
        None if head.starts_with("--") || head.starts_with('`') => Place::default(),
        None => Place {
            file: Some(head),
            line: None,
        },
    }
}

/// Returns the exception of a recording that cannot be read.
pub fn of_recording(py: Python<'_>, error: &RecordingError) -> PyErr {
    exception(py, Kind::Recording, &error.to_string())
}

/// Returns the exception of an analysis that has stopped.
pub fn of_pipeline(py: Python<'_>, error: &PipelineError) -> PyErr {
    let kind = match error {
        PipelineError::Recording(_) => Kind::Recording,
        PipelineError::Description(_) => Kind::Description,
        PipelineError::Measure(_) => Kind::Input,
    };
    exception(py, kind, &error.to_string())
}

/// Returns the exception of a command that has failed.
pub fn of_call(py: Python<'_>, error: &CallError) -> PyErr {
    let CallError::Failed { text, cause } = error else {
        return refused(py, &error.to_string());
    };
    let kind = cause.chain().find_map(|cause| {
        if cause.is::<DescriptionError>() {
            return Some(Kind::Description);
        }
        if cause.is::<RecordingError>() {
            return Some(Kind::Recording);
        }
        match cause.downcast_ref()? {
            PipelineError::Recording(_) => Some(Kind::Recording),
            PipelineError::Description(_) => Some(Kind::Description),
            PipelineError::Measure(_) => None,
        }
    });
    exception(py, kind.unwrap_or(Kind::Input), text)
}
