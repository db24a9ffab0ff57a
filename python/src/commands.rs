//! The commands of tapjoint: in this process with results as values, and as the program.

use crate::answer::Answer;
use crate::errors::{self, Kind, exception, refused};
use crate::work;
use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::PathBuf;
use tapjoint::cli::{self, Host};
use tapjoint::description::TestDescription;

/// Runs a command and returns what it has found. `arguments` begin with the command's name. `descriptions` are those in
/// memory: path and text.
///
/// # Errors
/// `InputError`, `DescriptionError` or `RecordingError` with the message of the command line.
#[pyfunction]
#[pyo3(signature = (arguments, descriptions, threads=None))]
pub fn call(
    py: Python<'_>,
    arguments: Vec<OsString>,
    descriptions: Vec<(PathBuf, String)>,
    threads: Option<usize>,
) -> PyResult<Answer> {
    let found = work::run(py, threads, move |cancel| {
        let host = Host {
            descriptions,
            watch: cancel.clone(),
        };
        cli::call(arguments, host)
    })?;
    match found {
        Ok(found) => Ok(Answer(found)),
        Err(error) => Err(errors::of_call(py, &error)),
    }
}

/// Runs the program: reads the arguments, the program's name first, prints, and returns the exit code.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| cli::run(arguments))
}

/// Checks the text of a test description, which messages call `file`. Returns its warnings.
///
/// # Errors
/// `DescriptionError` with file, line and remedy.
#[pyfunction]
pub fn check_description(py: Python<'_>, text: &str, file: &str) -> PyResult<Vec<String>> {
    let test = py
        .detach(|| TestDescription::parse(text, file))
        .map_err(|error| exception(py, Kind::Description, &error.to_string()))?;
    Ok(test.warnings.iter().map(ToString::to_string).collect())
}

/// Returns the TOML text of tables that are given as JSON.
///
/// # Errors
/// `InputError` for a value that TOML does not have.
#[pyfunction]
pub fn toml_text(py: Python<'_>, json: &str) -> PyResult<String> {
    let written = py.detach(|| {
        let tables: toml::Table = serde_json::from_str(json).map_err(|cause| cause.to_string())?;
        toml::to_string(&tables).map_err(|cause| cause.to_string())
    });
    written.map_err(|cause| {
        let text = format!(
            "the description cannot be written as TOML: {cause}; give texts, finite numbers, true or false, lists and tables of these"
        );
        refused(py, &text)
    })
}
