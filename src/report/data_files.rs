//! Results as comma separated values, one row each, numbers in full precision; frequency response functions also as
//! universal file.

use std::iter::once;

use crate::ReportError;
use crate::document::{Document, EstimateMethod, Uncertain, method_name};
use crate::tables::estimated;
use crate::words::series::quantity;
use tapjoint_analysis::{Frf, RecordingResult};
use tapjoint_signal::recording::{
    FrequencyResponse, FrequencyResponses, Point, RecordingError, UffFormat,
    encode_frequency_responses_uff,
};

/// Heads of `parameters.csv`.
const PARAMETERS: &str =
    "parameter,method,unit,value,std,low,high,std_scaled,low_scaled,high_scaled";
/// Heads of `modes.csv`.
const MODES: &str = "mode,label,recording,method,frequency_Hz,std_Hz,line_frequency_Hz,half_line_Hz,\
     interpolated_frequency_Hz,interpolated_bound_Hz,damping,damping_std,lambda,coherence,random_error";
/// Heads of `taps.csv`.
const TAPS: &str = "recording,tap,time_s,peak,unit,used,reason,pulse_width_s,fall_10_dB_Hz,fall_20_dB_Hz,usable_to_Hz,file";
/// Heads of `perturbation.csv`. `kind` names the change of the frequencies. `percent` is its size where all
/// were changed alike, and `mode` the mode that was changed alone. `statistic` says how `kx`, `ky` and `kz`
/// (values without unit, or percent) follow from the estimates.
const PERTURBATION: &str = "method,kind,percent,mode,statistic,kx,ky,kz";
/// Heads of `changes.csv`.
const CHANGES: &str =
    "pair,mode,before_Hz,after_Hz,change_percent,level_percent,described_percent,std_percent,z";
/// Heads of the rows of a series of tests.
const SERIES: &str =
    "test,file,quantity,change_percent,score,last_tests,limit,low_percent,high_percent,differs";
/// Heads of the table of frequency response functions.
const FUNCTIONS: &str = "recording,response,form,unit,frequency_Hz,h1_real,h1_imaginary,h2_real,h2_imaginary,\
     hv_real,hv_imaginary,coherence,random_error";

/// Returns `parameters.csv`: one row for each parameter and method; only its header without an estimate.
///
/// The estimate's own values come first. Those of the pair regression and of the free beam's closed form follow,
/// where the estimate is by another method.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_parameters_csv(document: &Document) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    if let Some(estimate) = document.estimate.as_ref().and_then(Option::as_ref) {
        let own = estimate.method;
        let mut values = Vec::new();
        for one in estimated(estimate) {
            values.push((one.name, own, one.unit, *one.value));
        }
        // Numbers without unit come first.
        values.sort_by_key(|(_, _, unit, _)| *unit != "1");
        let pairs = estimate.pairs.iter().flat_map(|pairs| {
            [
                ("kx", "1", pairs.kx),
                ("ky", "1", pairs.ky),
                ("kz", "1", pairs.kz),
                ("kt", "N/m", pairs.kt),
                ("kr", "N m/rad", pairs.kr),
                ("ktr", "N/rad", pairs.ktr),
                ("closure", "1", pairs.closure),
            ]
        });
        let pairs = pairs.map(|value| (EstimateMethod::Pairs, value));
        let free = estimate.free_beam.iter().flat_map(|free| {
            [
                ("modulus", "Pa", Some(free.modulus)),
                ("density", "kg/m3", Some(free.density)),
            ]
        });
        let free = free.map(|value| (EstimateMethod::FreeBeam, value));
        for (method, (name, unit, value)) in pairs.chain(free) {
            // The closure is no value of the estimate itself.
            if let Some(value) = value.filter(|_| method != own || name == "closure") {
                let value = Uncertain {
                    value,
                    ..Uncertain::default()
                };
                values.push((name, method, unit, value));
            }
        }
        for (name, method, unit, value) in values {
            rows.push(vec![
                name.to_owned(),
                method.name().to_owned(),
                unit.to_owned(),
                number(Some(value.value)),
                number(value.std),
                number(value.low),
                number(value.high),
                number(value.std_scaled),
                number(value.low_scaled),
                number(value.high_scaled),
            ]);
        }
    }
    write(PARAMETERS, rows)
}

/// Returns `modes.csv`: one row for each resonance and each peak that is none.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_modes_csv(document: &Document) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for mode in document.modes.iter().flatten() {
        rows.push(vec![
            mode.mode.map(|n| n.to_string()).unwrap_or_default(),
            mode.label.clone().unwrap_or_default(),
            mode.recording.clone().unwrap_or_default(),
            method_name(mode.method).to_owned(),
            number(Some(mode.frequency)),
            number(mode.std),
            number(mode.line_frequency),
            number(mode.half_line),
            number(mode.interpolated_frequency),
            number(mode.interpolated_bound),
            number(mode.damping),
            number(mode.damping_std),
            number(mode.lambda),
            number(mode.coherence),
            number(mode.random_error),
        ]);
    }
    write(MODES, rows)
}

/// Returns `taps.csv`: one row for each tap, used or not, with its force pulse in numbers where there is a hammer.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_taps_csv(document: &Document) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for recording in document.recordings.iter().flatten() {
        for (index, tap) in recording.taps.iter().enumerate() {
            rows.push(vec![
                recording.file.clone(),
                (index + 1).to_string(),
                number(Some(tap.time)),
                number(tap.peak_force.or(tap.peak_response)),
                recording.tap_unit.clone().unwrap_or_default(),
                tap.accepted.to_string(),
                tap.reason.clone().unwrap_or_default(),
                number(tap.pulse.map(|pulse| pulse.width)),
                number(tap.pulse.and_then(|pulse| pulse.fall_10_db)),
                number(tap.pulse.and_then(|pulse| pulse.fall_20_db)),
                number(tap.pulse.map(|pulse| pulse.usable_to)),
                tap.file.clone().unwrap_or_else(|| recording.file.clone()),
            ]);
        }
    }
    write(TAPS, rows)
}

/// Returns `changes.csv`: a row for each compared mode of each pair; only its header without a comparison.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_changes_csv(document: &Document) -> Result<String, ReportError> {
    let modes = document.compare.iter().flat_map(|one| &one.found.modes);
    let rows = modes.map(|one| {
        vec![
            (one.pair + 1).to_string(),
            one.mode.to_string(),
            number(Some(one.before)),
            number(Some(one.after)),
            number(Some(one.change_percent)),
            number(Some(one.level_percent)),
            number(Some(one.described_percent)),
            number(Some(one.std_percent)),
            number(Some(one.z)),
        ]
    });
    write(CHANGES, rows)
}

/// Returns a row for each test and chart of a series; only the header without one.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_series_csv(document: &Document) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    if let Some(section) = &document.series {
        for (test, file) in section.tests.iter().enumerate() {
            for chart in &section.series.charts {
                let point = &chart.points[test];
                let [low, high] = match point.single_limits_percent {
                    Some(ends) => ends.map(Some),
                    None => [None; 2],
                };
                let differs = chart.departure.is_some_and(|one| test >= one.since);
                rows.push(vec![
                    (test + 1).to_string(),
                    file.clone(),
                    quantity(chart.quantity),
                    number(Some(point.percent)),
                    number(point.limit.map(|_| point.score)),
                    point.last.to_string(),
                    number(point.limit),
                    number(low),
                    number(high),
                    differs.to_string(),
                ]);
            }
        }
    }
    write(SERIES, rows)
}

/// Returns `perturbation.csv`; only its header where nothing was perturbed.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_perturbation_csv(document: &Document) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for found in document.perturbation.iter().flatten() {
        let values = [found.kx, found.ky, found.kz];
        let percent = Some(found.percent);
        rows.push((found.method, "uniform", percent, None, "value", values));
    }
    for found in document.perturbation_averages.iter().flatten() {
        let errors = [found.kx_percent, found.ky_percent, found.kz_percent];
        let of_mean = [
            found.kx_of_mean_percent,
            found.ky_of_mean_percent,
            found.kz_of_mean_percent,
        ];
        let percent = Some(found.percent);
        for (name, values) in [("mean error (%)", errors), ("error of mean (%)", of_mean)] {
            rows.push((found.method, "uniform", percent, None, name, values));
        }
    }
    for found in document.resolution_span.iter().flatten() {
        for (name, index) in [("smallest", 0), ("largest", 1)] {
            let values = [found.kx, found.ky, found.kz].map(|range| Some(range?[index]));
            rows.push((found.method, "sign patterns", None, None, name, values));
        }
        for mode in &found.sensitivity {
            let change = [mode.kx_percent, mode.ky_percent, mode.kz_percent];
            let slope = [
                mode.kx_percent_per_percent,
                mode.ky_percent_per_percent,
                mode.kz_percent_per_percent,
            ];
            for (name, values) in [
                ("change by its bound (%)", change),
                ("change per percent (%)", slope),
            ] {
                rows.push((
                    found.method,
                    "one mode",
                    None,
                    Some(mode.mode),
                    name,
                    values,
                ));
            }
        }
    }
    for found in document.resolution_span.iter().flatten() {
        let Some(scale) = &found.common_scale else {
            continue;
        };
        let percent = Some(scale.scale_percent);
        let change = [scale.kx_percent, scale.ky_percent, scale.kz_percent];
        let slope = [
            scale.kx_percent_per_percent,
            scale.ky_percent_per_percent,
            scale.kz_percent_per_percent,
        ];
        for (name, values) in [
            ("change by the tolerance (%)", change),
            ("change per percent (%)", slope),
        ] {
            rows.push((found.method, "all modes", percent, None, name, values));
        }
    }
    for found in document.monte_carlo.iter().flatten() {
        let values = [found.kx, found.ky, found.kz];
        for (name, values) in [
            ("median", values.map(|value| Some(value?.value))),
            ("low", values.map(|value| value?.low)),
            ("high", values.map(|value| value?.high)),
        ] {
            rows.push((found.method, "monte carlo", None, None, name, values));
        }
    }
    let rows = rows.into_iter();
    let rows = rows.map(|(method, kind, percent, mode, statistic, values)| {
        let mut cells = vec![
            method.name().to_owned(),
            kind.to_owned(),
            number(percent),
            mode.map(|mode| mode.to_string()).unwrap_or_default(),
            statistic.to_owned(),
        ];
        cells.extend(values.map(number));
        cells
    });
    write(PERTURBATION, rows)
}

/// Returns one row for each line of each function: all estimators, coherence and random error, in full
/// precision; a cell is empty where a value does not exist.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_frf_csv(frfs: &[Frf]) -> Result<String, ReportError> {
    let rows = frfs.iter().flat_map(|frf| {
        (0..frf.lines.points()).map(move |line| {
            let mut row = vec![
                frf.recording.clone(),
                frf.response.clone(),
                frf.form_words.to_string(),
                frf.unit.clone(),
                frf.lines.frequency(line).to_string(),
            ];
            for values in [&frf.h1, &frf.h2, &frf.hv] {
                let value = values.get(line).copied().flatten();
                row.extend([number(value.map(|v| v.re)), number(value.map(|v| v.im))]);
            }
            for values in [&frf.coherence, &frf.random_error] {
                let value = values.as_ref().and_then(|values| *values.get(line)?);
                row.push(number(value));
            }
            row
        })
    });
    write(FUNCTIONS, rows)
}

/// Returns the averaged spectra of a recording, a row for each line and a column for each channel. Values are root mean
/// squares of the taps' transforms (unit of the signal times s). `None` without an accepted tap, and for functions.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_spectrum_csv(recording: &RecordingResult) -> Result<Option<String>, ReportError> {
    let Some(spectra) = recording.measurement.spectra.as_ref() else {
        return Ok(None);
    };
    let averages = &spectra.averages;
    if averages.responses.is_empty() {
        return Ok(None);
    }
    let unit = |unit: &Option<String>| match unit {
        Some(unit) => format!("{unit} s"),
        None => "unit of the file x s".to_owned(),
    };
    let mut heads = vec!["spectral_line".to_owned(), "frequency_Hz".to_owned()];
    let mut columns: Vec<&[f64]> = Vec::new();
    if let Some(force) = &averages.force {
        heads.push(format!("force ({})", unit(&recording.tap_unit)));
        columns.push(force);
    }
    for (response, values) in recording.responses.iter().zip(&averages.responses) {
        heads.push(format!("{} ({})", response.name, unit(&response.unit)));
        columns.push(values);
    }
    let rows = (0..averages.lines.points()).map(|line| {
        let mut row = vec![line.to_string(), averages.lines.frequency(line).to_string()];
        let values = columns
            .iter()
            .map(|values| number(values.get(line).copied()));
        row.extend(values);
        row
    });
    write_below(heads, rows).map(Some)
}

/// Returns the shortest digits that give the same number back; empty where there is none.
pub fn number(value: Option<f64>) -> String {
    value
        .filter(|value| value.is_finite())
        .map(|value| value.to_string())
        .unwrap_or_default()
}

/// Returns a text as a cell: with an apostrophe before it where a spreadsheet would take it for a formula. Numbers may begin
/// with a sign.
pub fn cell(text: String) -> String {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    match is_formula && text.parse::<f64>().is_err() {
        true => format!("'{text}"),
        false => text,
    }
}

/// Returns rows below a line of heads, which are joined by commas.
pub(super) fn write(
    heads: &str,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Result<String, ReportError> {
    write_below(heads.split(',').map(str::to_owned).collect(), rows)
}

/// Returns rows below a line of heads.
fn write_below(
    heads: Vec<String>,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Result<String, ReportError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in once(heads).chain(rows) {
        let row = row.into_iter().map(cell);
        writer.write_record(row).map_err(ReportError::Csv)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| ReportError::Csv(error.into_error().into()))?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}

/// Returns the functions, by the estimator that each is shown by, with their coherences: datasets 58 or 58b, of
/// several recordings one after the other. Sensors are nodes 1, 2, ... of a recording, the tap of the
/// n-th recording is node 1000 + n; directions are not known and given as scalar. A line on which a
/// function does not exist (receptance at 0 Hz) is written as 0.
///
/// # Errors
/// Values that are not finite.
pub fn render_frf_uff(frfs: &[Frf], format: UffFormat) -> Result<Vec<u8>, RecordingError> {
    let mut bytes = Vec::new();
    for (number, group) in (1..).zip(frfs.chunk_by(|a, b| a.recording == b.recording)) {
        let numbered = (1..).zip(group);
        let points = numbered.map(|(node, frf)| point(&frf.response, node));
        let responses = functions_of(group, points.collect(), &point("hammer", 1000 + number));
        bytes.extend(encode_frequency_responses_uff(&responses, format)?);
    }
    Ok(bytes)
}

/// Returns the functions of one recording, by the estimator that each is shown by, between these points.
pub(crate) fn functions_of(
    frfs: &[Frf],
    points: Vec<Point>,
    reference: &Point,
) -> FrequencyResponses {
    let lines = frfs.first().map(|frf| frf.lines);
    let responses = frfs.iter().zip(points);
    FrequencyResponses {
        file: frfs
            .first()
            .map_or(String::new(), |frf| frf.recording.clone()),
        first_frequency: lines.map_or(0.0, |lines| lines.low),
        spacing: lines.map_or(0.0, |lines| lines.spacing),
        lines: lines.map_or(0, |lines| lines.points()),
        has_phase: true,
        responses: responses
            .map(|(frf, response)| FrequencyResponse {
                name: frf.response.clone(),
                response,
                reference: reference.clone(),
                unit: Some(frf.unit.clone()),
                form: frf.form,
                values: existing(frf.values()),
                coherence: frf.coherence.as_deref().map(existing),
            })
            .collect(),
        warnings: Vec::new(),
    }
}

/// Returns values with 0 for what does not exist.
fn existing<T: Copy + Default>(values: &[Option<T>]) -> Vec<T> {
    let values = values.iter().copied();
    values.map(Option::unwrap_or_default).collect()
}

fn point(name: &str, node: i64) -> Point {
    Point {
        name: Some(name.to_owned()),
        node,
        direction: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_no_cell_is_a_formula() {
        let cells = [
            "=HYPERLINK(1)",
            "+A1",
            "-A1",
            "@A1",
            "-1.5",
            "+2",
            "A=1",
            "",
        ];
        let text = write(
            "name,other",
            cells.map(|cell| vec![cell.to_owned(), String::new()]),
        )
        .unwrap();
        let first: Vec<&str> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').next().unwrap())
            .collect();
        let expected = [
            "'=HYPERLINK(1)",
            "'+A1",
            "'-A1",
            "'@A1",
            "-1.5",
            "+2",
            "A=1",
            "",
        ];
        assert_eq!(first, expected);
    }
}
