//! What a command or a measurement has found, and its arrays.

use crate::errors::{Kind, exception, refused};
use crate::functions::{complex_lines, matrix};
use num_complex::Complex64;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tapjoint::cli;
use tapjoint::description::FORMS;
use tapjoint::pipeline::{Frf, FrfSettings, RecordingResult, frfs_of};
use tapjoint::report::document::Document;
use tapjoint::report::{render_first_screen, render_json};
use tapjoint::spectral::FrfEstimator;

/// What a command or a measurement has found.
#[pyclass(frozen, module = "tapjoint._native")]
pub struct Answer(pub cli::Answer);

#[pymethods]
impl Answer {
    /// False where the data give no answer.
    #[getter]
    fn is_answered(&self) -> bool {
        self.0.is_answered
    }

    /// What the command prints on a terminal.
    #[getter]
    fn text(&self) -> &str {
        &self.0.text
    }

    /// Warnings of the command, in their order.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    /// The document as JSON, the same text as that of `--json`.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        if let Some(document) = &self.0.document {
            let rendered = py.detach(|| render_json(document));
            return rendered.map_err(|error| refused(py, &error.to_string()));
        }
        let other = self.0.other.as_ref();
        Ok(other.unwrap_or(&serde_json::Value::Null).to_string())
    }

    /// The first screen of the report's page, as HTML.
    fn first_screen(&self, py: Python<'_>) -> PyResult<String> {
        let (document, recordings) = (self.0.document.as_ref(), &self.0.recordings);
        let none = Document::default();
        py.detach(|| render_first_screen(document.unwrap_or(&none), recordings))
            .map_err(|error| refused(py, &error.to_string()))
    }

    /// Number of measured recordings.
    #[getter]
    fn recordings(&self) -> usize {
        self.0.recordings.len()
    }

    /// Averaged spectra of a recording (from 0) as arrays; None without an accepted tap.
    fn spectrum<'py>(
        &self,
        py: Python<'py>,
        recording: usize,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let recording = self.recording(py, recording)?;
        let Some(spectra) = &recording.measurement.spectra else {
            return Ok(None);
        };
        let averages = &spectra.averages;
        let dict = PyDict::new(py);
        dict.set_item("frequency", averages.lines.frequencies().into_pyarray(py))?;
        let shape = [averages.responses.len(), averages.lines.points()];
        dict.set_item("response", matrix(py, averages.responses.concat(), shape)?)?;
        let force = averages.force.clone();
        dict.set_item("force", force.map(|force| force.into_pyarray(py)))?;
        dict.set_item("averages", averages.taps)?;
        dict.set_item("window", spectra.window.name())?;
        dict.set_item("window_decay", spectra.window.added_decay())?;
        let responses = recording.responses.iter();
        let (names, units): (Vec<_>, Vec<_>) = responses
            .map(|one| (one.name.as_str(), one.unit.as_deref()))
            .unzip();
        dict.set_item("names", names)?;
        dict.set_item("units", units)?;
        dict.set_item("force_unit", recording.tap_unit.as_deref())?;
        Ok(Some(dict))
    }

    /// Frequency response functions of a recording (from 0) as arrays, one dictionary for each response. `form` is
    /// "accelerance", "mobility" or "receptance"; None = as measured.
    #[pyo3(signature = (recording, form=None))]
    fn functions<'py>(
        &self,
        py: Python<'py>,
        recording: usize,
        form: Option<&str>,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let recording = self.recording(py, recording)?;
        let form = match form {
            None => None,
            Some(name) => {
                let known = FORMS.iter().find(|(known, _)| *known == name);
                let names = FORMS.map(|(known, _)| known).join(", ");
                let text = format!("form: \"{name}\" is no form; give one of {names}");
                Some(known.ok_or_else(|| refused(py, &text))?.1)
            }
        };
        let settings = FrfSettings {
            estimator: FrfEstimator::H1,
            form,
        };
        let found = py.detach(|| frfs_of(recording, &settings));
        let found = found.map_err(|error| exception(py, Kind::Input, &error.to_string()))?;
        found.into_iter().map(|frf| arrays_of(py, frf)).collect()
    }
}

impl Answer {
    fn recording(&self, py: Python<'_>, index: usize) -> PyResult<&RecordingResult> {
        let count = self.0.recordings.len();
        let text = format!("recording: there are {count}, counted from 0; give one of them");
        let recording = self.0.recordings.get(index);
        recording.ok_or_else(|| refused(py, &text))
    }
}

/// Returns the arrays of a function.
fn arrays_of<'py>(py: Python<'py>, frf: Frf) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("name", &frf.response)?;
    dict.set_item("unit", &frf.unit)?;
    dict.set_item("form", frf.form_words)?;
    dict.set_item("averages", frf.averages)?;
    dict.set_item("window", frf.window.name())?;
    dict.set_item("window_decay", frf.window.added_decay())?;
    dict.set_item("frequency", frf.lines.frequencies().into_pyarray(py))?;
    for (name, values) in [("h1", &frf.h1), ("h2", &frf.h2), ("hv", &frf.hv)] {
        let values: Vec<Complex64> = complex_lines(values).collect();
        dict.set_item(name, values.into_pyarray(py))?;
    }
    for (name, values) in [
        ("coherence", &frf.coherence),
        ("random_error", &frf.random_error),
    ] {
        let values = values.as_ref().map(|values| {
            let values: Vec<f64> = values.iter().map(|one| one.unwrap_or(f64::NAN)).collect();
            values.into_pyarray(py)
        });
        dict.set_item(name, values)?;
    }
    Ok(dict)
}
