//! Frequency response functions and modes of arrays.

use crate::errors::refused;
use crate::work;
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tapjoint::modal::polyreference::{
    BandPeaks, BandSearch, PoleStability, PolyreferenceError, PolyreferenceMode,
    PolyreferenceSettings, ResponseMatrix, all_modes, find_modes as search_bands, select_modes,
    stabilise_poles,
};
use tapjoint::spectral::{
    AveragedSpectra, DISPLAY_RATIO, FrfEstimator, Lines, TapRecord, Transformer, Window,
    average_records, random_error,
};

/// Values of lines, NaN where there is none.
pub fn complex_lines(values: &[Option<Complex64>]) -> impl Iterator<Item = Complex64> {
    const NONE: Complex64 = Complex64::new(f64::NAN, f64::NAN);
    values.iter().map(|one| one.unwrap_or(NONE))
}

/// Returns values, one row after the other, as an array of this shape. They are not copied.
pub fn matrix<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<T>>> {
    values.into_pyarray(py).reshape(shape)
}

/// Records up to this number are one share of the work, which other threads cannot speed up.
const FEW_RECORDS: usize = 8;
/// Samples of responses that take less time than to wake a thread.
const FEW_SAMPLES: usize = 1 << 15;

/// Averages over tap records: frequency response functions and coherence.
///
/// `force` has the shape (records, samples), `response` (records, responses, samples); both are contiguous. `rate` in Hz,
/// `band` in Hz, `block` in samples at the zoomed rate, `decay` (1/s) that of an exponential window.
///
/// # Errors
/// `InputError`: shapes that differ, values that are not finite, a band or block that does not fit.
#[pyfunction]
#[pyo3(signature = (force, response, rate, band=None, block=None, window="rectangular", decay=0.0, threads=None))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn average<'py>(
    py: Python<'py>,
    force: PyReadonlyArray2<'py, f64>,
    response: PyReadonlyArray3<'py, f64>,
    rate: f64,
    band: Option<(f64, f64)>,
    block: Option<usize>,
    window: &str,
    decay: f64,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let (records, samples) = force.as_array().dim();
    let (of_records, responses, of_samples) = response.as_array().dim();
    if (of_records, of_samples) != (records, samples) {
        return Err(refused(
            py,
            &format!(
                "response: {of_records} records of {of_samples} samples, and force has {records} of {samples}; give both the same"
            ),
        ));
    }
    if records == 0 || responses == 0 || samples == 0 {
        return Err(refused(
            py,
            "force and response: there are no samples; give at least one record",
        ));
    }
    if !(rate.is_finite() && rate > 0.0) {
        return Err(refused(
            py,
            &format!(
                "rate: {rate} is not allowed; give the samples per second, a number above 0 Hz"
            ),
        ));
    }
    let window = window_of(window, decay).map_err(|text| refused(py, &text))?;
    let band = band.unwrap_or((0.0, rate / DISPLAY_RATIO));
    let seconds = samples as f64 / rate;
    let zoomed = DISPLAY_RATIO * (band.1 - band.0) * seconds;
    // All samples, as an even number at the zoomed rate.
    let block = block.unwrap_or(2 * ((zoomed * (1.0 + 1e-12)) as usize / 2));
    let axis =
        Lines::zoom(band, rate, block, seconds).map_err(|error| refused(py, &error.to_string()))?;
    let force = force
        .as_slice()
        .map_err(|_| refused(py, "force: the array is not contiguous"))?;
    let response = response
        .as_slice()
        .map_err(|_| refused(py, "response: the array is not contiguous"))?;
    let signals = Signals {
        force,
        response,
        samples,
        responses,
    };
    let is_small = records <= FEW_RECORDS && records * responses * samples <= FEW_SAMPLES;
    let found = work::compute(py, threads, is_small, || {
        let windowed = signals.windowed(window, rate);
        let signals = windowed
            .as_ref()
            .map_or(signals, |(force, response)| Signals {
                force,
                response,
                ..signals
            });
        let transformer = Transformer::new(rate, axis, samples);
        average_records(&transformer, &signals.records())
    })?;
    let found = found.filter(are_finite).ok_or_else(|| {
        refused(
            py,
            "force is zero throughout, or force or response has a value that is not finite (NaN, infinite) or whose square is too large; leave such records out",
        )
    })?;
    averaged_arrays(py, &found, window)
}

/// Returns true if there is a force and all powers are finite. A single value that is not finite spreads over all lines.
fn are_finite(averages: &AveragedSpectra) -> bool {
    let is_finite = |powers: &Vec<f64>| powers.iter().all(|power| power.is_finite());
    averages.force_power.as_ref().is_some_and(is_finite)
        && averages.response_power.iter().all(is_finite)
}

/// Reads the name of a window.
fn window_of(name: &str, decay: f64) -> Result<Window, String> {
    match name {
        "exponential" if decay.is_finite() && decay > 0.0 => Ok(Window::Exponential { decay }),
        "exponential" => {
            Err("decay: an exponential window needs one above 0 1/s; give it".to_owned())
        }
        _ if decay != 0.0 => {
            Err("decay: only an exponential window has one; leave it out".to_owned())
        }
        "rectangular" => Ok(Window::Rectangular),
        "hann" => Ok(Window::Hann),
        other => Err(format!(
            "window: \"{other}\" is no window; give \"rectangular\", \"hann\" or \"exponential\""
        )),
    }
}

/// Force and responses of all records, one record after the other.
#[derive(Clone, Copy)]
struct Signals<'a> {
    force: &'a [f64],
    response: &'a [f64],
    /// Samples of a record.
    samples: usize,
    responses: usize,
}

impl<'a> Signals<'a> {
    /// Returns windowed copies of force and response; `None` of a window that changes nothing.
    fn windowed(&self, window: Window, rate: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        if window == Window::Rectangular {
            return None;
        }
        let mut weights = vec![1.0; self.samples];
        window.apply(&mut weights, rate);
        let copy = |values: &[f64]| {
            let mut copy = Vec::with_capacity(values.len());
            for record in values.chunks_exact(self.samples) {
                copy.extend(record.iter().zip(&weights).map(|(x, weight)| x * weight));
            }
            copy
        };
        Some((copy(self.force), copy(self.response)))
    }

    fn records(&self) -> Vec<TapRecord<'a>> {
        let responses = self.response.chunks_exact(self.samples * self.responses);
        let pairs = self.force.chunks_exact(self.samples).zip(responses);
        pairs
            .map(|(force, responses)| TapRecord {
                force: Some(force),
                responses: responses.chunks_exact(self.samples).collect(),
            })
            .collect()
    }
}

/// Returns averages as arrays of the shape (responses, lines).
fn averaged_arrays<'py>(
    py: Python<'py>,
    averages: &AveragedSpectra,
    window: Window,
) -> PyResult<Bound<'py, PyDict>> {
    let shape = [averages.response_power.len(), averages.lines.points()];
    let [responses, points] = shape;
    let dict = PyDict::new(py);
    dict.set_item("frequency", averages.lines.frequencies().into_pyarray(py))?;
    for estimator in FrfEstimator::ALL {
        let values = py.detach(|| {
            let mut values = Vec::with_capacity(responses * points);
            for response in 0..responses {
                let none = || vec![None; points];
                let function = averages.frf(response, estimator).unwrap_or_else(none);
                values.extend(complex_lines(&function));
            }
            values
        });
        let name = estimator.name().to_lowercase();
        dict.set_item(name, matrix(py, values, shape)?)?;
    }
    let (coherence, errors) = py.detach(|| {
        let rows: Option<Vec<_>> = (0..responses)
            .map(|response| averages.coherence(response))
            .collect();
        let values = |of: &dyn Fn(f64) -> Option<f64>| -> Option<Vec<f64>> {
            let values = rows.as_ref()?.iter().flatten();
            Some(
                values
                    .map(|one| one.and_then(of).unwrap_or(f64::NAN))
                    .collect(),
            )
        };
        let error = |one| random_error(one, averages.taps);
        (values(&Some), values(&error))
    });
    for (name, values) in [("coherence", coherence), ("random_error", errors)] {
        let values = values.map(|values| matrix(py, values, shape));
        dict.set_item(name, values.transpose()?)?;
    }
    dict.set_item("averages", averages.taps)?;
    dict.set_item("window", window.name())?;
    dict.set_item("window_decay", window.added_decay())?;
    Ok(dict)
}

/// Finds the modes of frequency response functions by the polyreference estimator.
///
/// `values` has the shape (outputs, inputs, lines) and is contiguous. Lines begin at `first` (Hz) and are `spacing` (Hz) apart.
/// `decay` (1/s) is that of an exponential window. With `sub_bands` narrow bands about peaks are searched as well.
///
/// # Errors
/// `InputError`: values that are not finite, too few lines, nothing to fit.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn find_modes<'py>(
    py: Python<'py>,
    values: PyReadonlyArray3<'py, Complex64>,
    first: f64,
    spacing: f64,
    order: usize,
    decay: f64,
    sub_bands: bool,
) -> PyResult<Bound<'py, PyDict>> {
    const MOST_ORDER: usize = 200;
    if !(2..=MOST_ORDER).contains(&order) {
        return Err(refused(
            py,
            &format!("order: {order} is not allowed; give 2 to {MOST_ORDER}"),
        ));
    }
    let good_axis = first.is_finite() && first >= 0.0 && spacing.is_finite() && spacing > 0.0;
    let good_decay = decay.is_finite() && decay >= 0.0;
    if !(good_axis && good_decay) {
        return Err(refused(
            py,
            "frequency: give equally spaced lines in Hz that ascend from 0 or more, and a window_decay of 0 1/s or more",
        ));
    }
    let (outputs, inputs, points) = values.as_array().dim();
    if outputs * inputs * points == 0 {
        return Err(refused(
            py,
            "frf: there are no values; give at least one function",
        ));
    }
    let values = values
        .as_slice()
        .map_err(|_| refused(py, "frf: the array is not contiguous"))?;
    let settings = PolyreferenceSettings {
        order,
        added_decay: decay,
        peaks: BandPeaks::EveryFunction,
    };
    let found = py.detach(|| {
        let rows: Vec<Vec<&[Complex64]>> = values
            .chunks_exact(inputs * points)
            .map(|output| output.chunks_exact(points).collect())
            .collect();
        let matrix = ResponseMatrix::new(first, spacing, &rows)?;
        searched(&matrix, &settings, sub_bands)
    });
    let (modes, searches) = found.map_err(|error| refused(py, &error.to_string()))?;
    let dict = mode_arrays(py, &modes, [outputs, inputs])?;
    dict.set_item("poles", pole_arrays(py, &searches)?)?;
    Ok(dict)
}

/// Returns modes and searched bands.
fn searched(
    matrix: &ResponseMatrix,
    settings: &PolyreferenceSettings,
    sub_bands: bool,
) -> Result<(Vec<PolyreferenceMode>, Vec<BandSearch>), PolyreferenceError> {
    if sub_bands {
        let searches = search_bands(matrix, settings)?;
        return Ok((all_modes(&searches), searches));
    }
    let diagram = stabilise_poles(matrix, settings)?;
    let modes = select_modes(matrix, &diagram, settings);
    let (low, high) = matrix.ends();
    let whole = BandSearch {
        band: tapjoint::modal::polyreference::SubBand {
            low,
            high,
            core: (low, high),
        },
        order: settings.order,
        diagram,
        modes: Vec::new(),
    };
    Ok((modes, vec![whole]))
}

/// Returns modes of functions from so many inputs to so many outputs as arrays, one entry for each mode.
fn mode_arrays<'py>(
    py: Python<'py>,
    modes: &[PolyreferenceMode],
    [outputs, inputs]: [usize; 2],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency).collect();
    dict.set_item("frequency", frequencies.into_pyarray(py))?;
    let dampings: Vec<f64> = modes.iter().map(|mode| mode.damping_ratio).collect();
    dict.set_item("damping", dampings.into_pyarray(py))?;
    let levels: Vec<f64> = modes.iter().map(|mode| mode.above_noise_db).collect();
    dict.set_item("above_noise", levels.into_pyarray(py))?;
    let poles: Vec<Complex64> = modes.iter().map(|mode| mode.pole).collect();
    dict.set_item("pole", poles.into_pyarray(py))?;
    let shapes = modes.iter().flat_map(|mode| &mode.shape).copied().collect();
    dict.set_item("shape", matrix(py, shapes, [modes.len(), outputs])?)?;
    let participations = modes.iter().flat_map(|mode| &mode.participation);
    let participations = participations.copied().collect();
    dict.set_item(
        "participation",
        matrix(py, participations, [modes.len(), inputs])?,
    )?;
    Ok(dict)
}

/// Returns the poles of the stabilisation diagrams as arrays, one entry for each pole.
fn pole_arrays<'py>(py: Python<'py>, searches: &[BandSearch]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let poles = || searches.iter().flat_map(|search| &search.diagram);
    let orders: Vec<i64> = poles().map(|pole| pole.order as i64).collect();
    dict.set_item("order", orders.into_pyarray(py))?;
    let frequencies: Vec<f64> = poles().map(|pole| pole.frequency).collect();
    dict.set_item("frequency", frequencies.into_pyarray(py))?;
    let dampings: Vec<f64> = poles().map(|pole| pole.damping_ratio).collect();
    dict.set_item("damping", dampings.into_pyarray(py))?;
    let stable: Vec<bool> = poles()
        .map(|pole| pole.stability == PoleStability::All)
        .collect();
    dict.set_item("stable", stable.into_pyarray(py))?;
    Ok(dict)
}
