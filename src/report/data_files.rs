//! Results as comma separated values, one row each, numbers in full precision; frequency response functions also as
//! universal file.

use super::ReportError;
use super::document::{
    Document, EstimateSection, FreeBeamSection, Method, ModeSection, MonteCarloSection,
    PairsSection, ResolutionSpanSection, ValueSection, method_name,
};
use num_complex::Complex64;
use tapjoint_analysis::Frf;
use tapjoint_signal::recording::{
    FrequencyResponse, FrequencyResponses, Point, UffError, UffFormat,
    encode_frequency_responses_uff,
};
use tapjoint_signal::spectral::FrfEstimator;

/// Columns of `parameters.csv`.
const PARAMETER_COLUMNS: [&str; 10] = [
    "parameter",
    "method",
    "unit",
    "value",
    "std",
    "low",
    "high",
    "std_scaled",
    "low_scaled",
    "high_scaled",
];

/// Columns of `modes.csv`.
const MODE_COLUMNS: [&str; 15] = [
    "mode",
    "label",
    "recording",
    "method",
    "frequency_Hz",
    "std_Hz",
    "line_frequency_Hz",
    "half_line_Hz",
    "interpolated_frequency_Hz",
    "interpolated_bound_Hz",
    "damping",
    "damping_std",
    "lambda",
    "coherence",
    "random_error",
];

/// `parameters.csv`: one row for each parameter and method; only its header without an estimate.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_parameters_csv(document: &Document) -> Result<String, ReportError> {
    let estimate = document.estimate.as_ref().and_then(Option::as_ref);
    let rows = estimate.map(parameter_rows).unwrap_or_default();
    write(&PARAMETER_COLUMNS, rows)
}

/// `modes.csv`: one row for each resonance and each peak that is none.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_modes_csv(document: &Document) -> Result<String, ReportError> {
    let modes = document.modes.as_deref().unwrap_or_default();
    write(&MODE_COLUMNS, modes.iter().map(mode_row).collect())
}

/// The estimate's own values, then those of the pair regression where it is another method.
fn parameter_rows(estimate: &EstimateSection) -> Vec<Vec<String>> {
    let values = [
        ("kx", "1", &estimate.kx),
        ("ky", "1", &estimate.ky),
        ("kz", "1", &estimate.kz),
        ("coupling", "1", &estimate.coupling),
        ("kt", "N/m", &estimate.kt),
        ("kr", "N m/rad", &estimate.kr),
        ("ktr", "N/rad", &estimate.ktr),
        ("modulus", "Pa", &estimate.modulus),
        ("density", "kg/m3", &estimate.density),
    ];
    let own = values.into_iter().filter_map(|(name, unit, value)| {
        let value = value.as_ref()?;
        Some(parameter_row(name, estimate.method, unit, value))
    });
    let pairs = estimate
        .pairs
        .iter()
        .flat_map(|pairs| pairs_rows(pairs, estimate.method));
    let free = estimate
        .free_beam
        .iter()
        .flat_map(|free| free_beam_rows(free, estimate.method));
    own.chain(pairs).chain(free).collect()
}

fn pairs_rows(pairs: &PairsSection, method: Method) -> Vec<Vec<String>> {
    let repeated = method == Method::Pairs;
    [
        ("kx", "1", pairs.kx),
        ("ky", "1", pairs.ky),
        ("kz", "1", pairs.kz),
        ("kt", "N/m", pairs.kt),
        ("kr", "N m/rad", pairs.kr),
        ("ktr", "N/rad", pairs.ktr),
        ("closure", "1", pairs.closure),
    ]
    .into_iter()
    .filter(|(name, _, _)| !repeated || *name == "closure")
    .filter_map(|(name, unit, value)| Some(closed_row(name, Method::Pairs, unit, value?)))
    .collect()
}

fn free_beam_rows(free: &FreeBeamSection, method: Method) -> Vec<Vec<String>> {
    if method == Method::FreeBeam {
        return Vec::new();
    }
    vec![
        closed_row("modulus", Method::FreeBeam, "Pa", free.modulus),
        closed_row("density", Method::FreeBeam, "kg/m3", free.density),
    ]
}

/// A value in closed form beside the main estimate, without its uncertainty.
fn closed_row(name: &str, method: Method, unit: &str, value: f64) -> Vec<String> {
    let value = ValueSection {
        value,
        ..ValueSection::default()
    };
    parameter_row(name, method, unit, &value)
}

fn parameter_row(name: &str, method: Method, unit: &str, value: &ValueSection) -> Vec<String> {
    vec![
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
    ]
}

fn mode_row(mode: &ModeSection) -> Vec<String> {
    vec![
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
    ]
}

/// Columns of `perturbation.csv`: `kind` is what was done to the frequencies, `percent` by how much
/// where all were changed alike, `mode` which one where one was changed alone, `statistic` what of the
/// estimates the three numbers are.
const PERTURBATION_COLUMNS: [&str; 8] = [
    "method",
    "kind",
    "percent",
    "mode",
    "statistic",
    "kx",
    "ky",
    "kz",
];

/// `perturbation.csv`; only its header where nothing was perturbed.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_perturbation_csv(document: &Document) -> Result<String, ReportError> {
    let spans = document.resolution_span.iter().flatten();
    let random = document.monte_carlo.iter().flatten();
    let rows = uniform(document)
        .into_iter()
        .chain(averages(document))
        .chain(spans.flat_map(bounds))
        .chain(random.flat_map(monte_carlo));
    write(&PERTURBATION_COLUMNS, rows.collect())
}

/// What a row is about: method, kind, percent, mode, statistic.
type About<'a> = (Method, &'a str, Option<f64>, Option<usize>, &'a str);

fn changed_row(
    (method, kind, percent, mode, statistic): About<'_>,
    values: [Option<f64>; 3],
) -> Vec<String> {
    let mut cells = vec![
        method.name().to_owned(),
        kind.to_owned(),
        number(percent),
        mode.map(|mode| mode.to_string()).unwrap_or_default(),
        statistic.to_owned(),
    ];
    cells.extend(values.map(number));
    cells
}

fn uniform(document: &Document) -> Vec<Vec<String>> {
    let rows = document.perturbation.iter().flatten();
    rows.map(|found| {
        let about = (found.method, "uniform", Some(found.percent), None, "value");
        changed_row(about, [found.kx, found.ky, found.kz])
    })
    .collect()
}

fn averages(document: &Document) -> Vec<Vec<String>> {
    let list = document.perturbation_averages.iter().flatten();
    list.flat_map(|found| {
        let about = |statistic| {
            (
                found.method,
                "uniform",
                Some(found.percent),
                None,
                statistic,
            )
        };
        let errors = [found.kx_percent, found.ky_percent, found.kz_percent];
        let of_mean = [
            found.kx_of_mean_percent,
            found.ky_of_mean_percent,
            found.kz_of_mean_percent,
        ];
        [
            changed_row(about("mean error (%)"), errors),
            changed_row(about("error of mean (%)"), of_mean),
        ]
    })
    .collect()
}

fn bounds(found: &ResolutionSpanSection) -> Vec<Vec<String>> {
    let ranges = [found.kx, found.ky, found.kz];
    let end = |statistic, index: usize| {
        let values = ranges.map(|range| range.and_then(|range| range.get(index).copied()));
        changed_row(
            (found.method, "sign patterns", None, None, statistic),
            values,
        )
    };
    let mut rows = vec![end("smallest", 0), end("largest", 1)];
    for mode in &found.sensitivity {
        let about = |statistic| (found.method, "one mode", None, Some(mode.mode), statistic);
        let change = [mode.kx_percent, mode.ky_percent, mode.kz_percent];
        let slope = [
            mode.kx_percent_per_percent,
            mode.ky_percent_per_percent,
            mode.kz_percent_per_percent,
        ];
        rows.push(changed_row(about("change by its bound (%)"), change));
        rows.push(changed_row(about("change per percent (%)"), slope));
    }
    rows
}

fn monte_carlo(found: &MonteCarloSection) -> Vec<Vec<String>> {
    let values = [found.kx, found.ky, found.kz];
    let of = |statistic, pick: fn(ValueSection) -> Option<f64>| {
        let about = (found.method, "monte carlo", None, None, statistic);
        changed_row(about, values.map(|value| value.and_then(pick)))
    };
    vec![
        of("median", |value| Some(value.value)),
        of("low", |value| value.low),
        of("high", |value| value.high),
    ]
}

/// Columns of the table of frequency response functions.
const FRF_COLUMNS: [&str; 13] = [
    "recording",
    "response",
    "form",
    "unit",
    "frequency_Hz",
    "h1_real",
    "h1_imaginary",
    "h2_real",
    "h2_imaginary",
    "hv_real",
    "hv_imaginary",
    "coherence",
    "random_error",
];

/// One row for each line of each function: all estimators, coherence and random error, in full
/// precision; a cell is empty where a value does not exist.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_frf_csv(frfs: &[Frf]) -> Result<String, ReportError> {
    write(&FRF_COLUMNS, frfs.iter().flat_map(frf_rows).collect())
}

fn frf_rows(frf: &Frf) -> impl Iterator<Item = Vec<String>> {
    (0..frf.lines.points()).map(move |line| {
        let on_line = |values: &Option<Vec<Option<f64>>>| {
            number(values.as_ref().and_then(|values| *values.get(line)?))
        };
        let mut row = vec![
            frf.recording.clone(),
            frf.response.clone(),
            frf.form_words.to_string(),
            frf.unit.clone(),
            frf.lines.frequency(line).to_string(),
        ];
        for values in [&frf.h1, &frf.h2, &frf.hv] {
            let value: Option<Complex64> = values.get(line).copied().flatten();
            row.extend([number(value.map(|v| v.re)), number(value.map(|v| v.im))]);
        }
        row.extend([on_line(&frf.coherence), on_line(&frf.random_error)]);
        row
    })
}

/// The shortest digits that give the same number back; empty where there is none.
fn number(value: Option<f64>) -> String {
    value
        .filter(|value| value.is_finite())
        .map(|value| value.to_string())
        .unwrap_or_default()
}

pub(super) fn write(header: &[&str], rows: Vec<Vec<String>>) -> Result<String, ReportError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header).map_err(ReportError::Csv)?;
    for row in rows {
        writer.write_record(row).map_err(ReportError::Csv)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| ReportError::Csv(error.into_error().into()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The functions, by the estimator that each is shown by, with their coherences: datasets 58 or 58b, of
/// several recordings one after the other. Sensors are nodes 1, 2, ... of a recording, the tap of the
/// n-th recording is node 1000 + n; directions are not known and given as scalar. A line on which a
/// function does not exist (receptance at 0 Hz) is written as 0.
///
/// # Errors
/// Values that are not finite.
pub fn render_frf_uff(frfs: &[Frf], format: UffFormat) -> Result<Vec<u8>, UffError> {
    let mut bytes = Vec::new();
    for (number, group) in (1..).zip(frfs.chunk_by(|a, b| a.recording == b.recording)) {
        let Some(first) = group.first() else { continue };
        let responses = FrequencyResponses {
            file: first.recording.clone(),
            first_frequency: first.lines.low,
            spacing: first.lines.spacing,
            lines: first.lines.points(),
            responses: (1..)
                .zip(group)
                .map(|(node, frf)| response(frf, node, 1000 + number))
                .collect(),
            warnings: Vec::new(),
        };
        bytes.extend(encode_frequency_responses_uff(&responses, format)?);
    }
    Ok(bytes)
}

fn response(frf: &Frf, node: i64, tap: i64) -> FrequencyResponse {
    let values = match frf.estimator {
        FrfEstimator::H1 => &frf.h1,
        FrfEstimator::H2 => &frf.h2,
        FrfEstimator::Hv => &frf.hv,
    };
    let place = |name: &str, node: i64| Point {
        name: Some(name.to_string()),
        node,
        direction: 0,
    };
    FrequencyResponse {
        name: frf.response.clone(),
        response: place(&frf.response, node),
        reference: place("hammer", tap),
        unit: Some(frf.unit.clone()),
        form: frf.form,
        values: values
            .iter()
            .map(|value| value.unwrap_or(Complex64::ZERO))
            .collect(),
        coherence: frf.coherence.as_ref().map(|values| {
            let of = |value: &Option<f64>| value.unwrap_or(0.0);
            values.iter().map(of).collect()
        }),
    }
}
