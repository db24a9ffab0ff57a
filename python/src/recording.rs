//! Recordings: files and arrays.

use crate::answer::Answer;
use crate::errors::{self, refused};
use crate::work;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use std::path::PathBuf;
use tapjoint::cli;
use tapjoint::description::{ChannelRef, OVERLOADS, READINGS, WINDOWS};
use tapjoint::pipeline::{
    Analysis, MeasureSettings, analysis_of_bare, inspect_bare, measure_bare_watched,
};
use tapjoint::recording::{self, Channel, ReadSettings};
use tapjoint::report::document::Document;
use tapjoint::report::{document_of, inspection_of};
use tapjoint::taps::TapSettings;

/// A recording: uniformly sampled channels. Samples of a file are read when they are asked for.
#[pyclass(frozen, module = "tapjoint._native")]
pub struct Recording(recording::Recording);

#[pymethods]
impl Recording {
    /// Opens a file: one pass checks every sample.
    ///
    /// # Errors
    /// `RecordingError`.
    #[staticmethod]
    #[pyo3(signature = (path, sample_rate=None, time_unit=None))]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        sample_rate: Option<f64>,
        time_unit: Option<f64>,
    ) -> PyResult<Self> {
        let settings = ReadSettings {
            sample_rate,
            time_unit,
            ..ReadSettings::default()
        };
        // Errors of opening name the whole path, results the file.
        let name = path.file_name().unwrap_or(path.as_os_str());
        let name = name.to_string_lossy().into_owned();
        let opened = work::run(py, None, move |_| {
            recording::Recording::open(&path, &settings)
        })?;
        let opened = opened.map_err(|error| errors::of_recording(py, &error))?;
        Ok(Self(opened.renamed(name)))
    }

    /// A recording of arrays: name, unit and samples of each channel. The samples are copied once.
    ///
    /// # Errors
    /// `RecordingError`: unequal lengths, samples that are not finite, a rate that is not allowed.
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        name: String,
        sample_rate: f64,
        channels: Vec<(Option<String>, Option<String>, PyReadonlyArray1<'_, f64>)>,
    ) -> PyResult<Self> {
        let channels = channels
            .into_iter()
            .map(|(name, unit, samples)| Channel {
                name,
                unit,
                samples: samples.as_array().to_vec(),
            })
            .collect();
        let made = py.detach(|| recording::Recording::from_samples(name, sample_rate, channels));
        let made = made.map_err(|error| errors::of_recording(py, &error))?;
        Ok(Self(made))
    }

    /// Name of the file without its folder, or the name of a recording of arrays.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Format of the file, in words.
    #[getter]
    fn format(&self) -> String {
        self.0.format().to_string()
    }

    /// Samples per second (Hz).
    #[getter]
    fn sample_rate(&self) -> f64 {
        self.0.sample_rate()
    }

    /// Samples of each channel.
    #[getter]
    fn frames(&self) -> u64 {
        self.0.frames()
    }

    /// Names of the channels, None where the file gives none.
    #[getter]
    fn names(&self) -> Vec<Option<String>> {
        let channels = self.0.channels().iter();
        channels.map(|channel| channel.name.clone()).collect()
    }

    /// Units of the channels, None where there is none.
    #[getter]
    fn units(&self) -> Vec<Option<String>> {
        let channels = self.0.channels().iter();
        channels.map(|channel| channel.unit.clone()).collect()
    }

    /// Doubts about the recording.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let warnings = self.0.warnings();
        warnings.iter().map(ToString::to_string).collect()
    }

    /// Index (from 0) of the channel with a name, or with a number (from 1).
    ///
    /// # Errors
    /// `RecordingError`: no such channel, or several.
    fn channel_index(&self, py: Python<'_>, text: &str) -> PyResult<usize> {
        let found = self.0.channel_index(text);
        found.map_err(|error| errors::of_recording(py, &error))
    }

    /// Samples of channels (indices from 0), each in its unit, from frame `start` to before `stop`, read in one pass.
    ///
    /// # Errors
    /// `RecordingError`: the file cannot be read any more.
    fn samples<'py>(
        &self,
        py: Python<'py>,
        channels: Vec<usize>,
        start: u64,
        stop: u64,
    ) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        let recording = self.0.clone();
        let found = work::run(py, None, move |_| {
            recording.read_channels(&channels, start..stop)
        })?;
        let found = found.map_err(|error| errors::of_recording(py, &error))?;
        let arrays = found.into_iter().map(|samples| samples.into_pyarray(py));
        Ok(arrays.collect())
    }

    /// Finds taps, averages their spectra and reads their modes.
    ///
    /// # Errors
    /// `RecordingError`, `InputError`: an unknown channel, a band or block that does not fit.
    #[pyo3(signature = (hammer=None, band=None, block=None, window=None, reading=None, overload=None, threads=None))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn measure(
        &self,
        py: Python<'_>,
        hammer: Option<usize>,
        band: Option<(f64, f64)>,
        block: Option<usize>,
        window: Option<&str>,
        reading: Option<&str>,
        overload: Option<&str>,
        threads: Option<usize>,
    ) -> PyResult<Answer> {
        let window = named(py, "window", window, &WINDOWS)?;
        let reading = named(py, "reading", reading, &READINGS)?.unwrap_or_default();
        let keep_overload = named(py, "overload", overload, &OVERLOADS)?;
        let (recording, hammer) = (self.0.clone(), hammer_of(hammer));
        let measured = work::run(py, threads, move |cancel| {
            let adjust = |settings: &mut MeasureSettings| {
                settings.band = band;
                settings.block = block;
                settings.window = window;
                settings.reading = reading;
                settings.taps.keep_overload = keep_overload.unwrap_or_default();
            };
            let measured =
                measure_bare_watched(recording, hammer.as_ref(), adjust, cancel.as_ref())?;
            Ok(analysis_of_bare(measured.file.clone(), vec![measured]))
        })?;
        let analysis = measured.map_err(|error| errors::of_pipeline(py, &error))?;
        Ok(py.detach(|| answer_of(document_of(&analysis), analysis)))
    }

    /// Finds taps and goes no further.
    ///
    /// # Errors
    /// `RecordingError`: an unknown channel, a file that cannot be read any more.
    #[pyo3(signature = (hammer=None, overload=None, threads=None))]
    fn inspect(
        &self,
        py: Python<'_>,
        hammer: Option<usize>,
        overload: Option<&str>,
        threads: Option<usize>,
    ) -> PyResult<Answer> {
        let keep_overload = named(py, "overload", overload, &OVERLOADS)?;
        let (recording, hammer) = (self.0.clone(), hammer_of(hammer));
        let found = work::run(py, threads, move |cancel| {
            let settings = TapSettings {
                keep_overload: keep_overload.unwrap_or_default(),
                ..TapSettings::default()
            };
            inspect_bare(recording, hammer.as_ref(), &settings, cancel.as_ref())
        })?;
        let found = found.map_err(|error| errors::of_pipeline(py, &error))?;
        Ok(py.detach(|| {
            let document = inspection_of(std::slice::from_ref(&found), &found.measurement.warnings);
            answer_of(document, analysis_of_bare(found.file.clone(), vec![found]))
        }))
    }
}

/// Returns the hammer's channel, given by its index from 0.
fn hammer_of(index: Option<usize>) -> Option<ChannelRef> {
    index.map(|index| ChannelRef::Number(index.saturating_add(1)))
}

/// Returns the answer of an analysis about which nothing is described.
fn answer_of(document: Document, analysis: Analysis) -> Answer {
    Answer(cli::Answer {
        is_answered: analysis.modes.iter().any(|mode| mode.mode.is_some()),
        document: Some(document),
        recordings: analysis.recordings,
        ..cli::Answer::default()
    })
}

/// Returns the value with a name.
///
/// # Errors
/// `InputError`: a name that is not among the values.
fn named<T: Copy>(
    py: Python<'_>,
    key: &str,
    name: Option<&str>,
    values: &[(&str, T)],
) -> PyResult<Option<T>> {
    let Some(name) = name else {
        return Ok(None);
    };
    if let Some((_, value)) = values.iter().find(|(known, _)| *known == name) {
        return Ok(Some(*value));
    }
    let names: Vec<&str> = values.iter().map(|(known, _)| *known).collect();
    let text = format!(
        "{key}: \"{name}\" is not allowed; give one of {}",
        names.join(", ")
    );
    Err(refused(py, &text))
}
