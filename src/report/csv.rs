//! Parameters and modes as comma separated values, one row each, numbers in full precision.

use super::ReportError;
use super::document::{
    Document, EstimateSection, FreeBeamSection, ModeSection, PairsSection, ValueSection,
};

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
        Some(parameter_row(name, &estimate.method, unit, value))
    });
    let pairs = estimate
        .pairs
        .iter()
        .flat_map(|pairs| pairs_rows(pairs, &estimate.method));
    let free = estimate
        .free_beam
        .iter()
        .flat_map(|free| free_beam_rows(free, &estimate.method));
    own.chain(pairs).chain(free).collect()
}

fn pairs_rows(pairs: &PairsSection, method: &str) -> Vec<Vec<String>> {
    let repeated = method == "pairs";
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
    .filter_map(|(name, unit, value)| Some(closed_row(name, "pairs", unit, value?)))
    .collect()
}

fn free_beam_rows(free: &FreeBeamSection, method: &str) -> Vec<Vec<String>> {
    if method == "free-beam" {
        return Vec::new();
    }
    vec![
        closed_row("modulus", "free-beam", "Pa", free.modulus),
        closed_row("density", "free-beam", "kg/m3", free.density),
    ]
}

/// A value in closed form beside the main estimate, without its uncertainty.
fn closed_row(name: &str, method: &str, unit: &str, value: f64) -> Vec<String> {
    let value = ValueSection {
        value,
        ..ValueSection::default()
    };
    parameter_row(name, method, unit, &value)
}

fn parameter_row(name: &str, method: &str, unit: &str, value: &ValueSection) -> Vec<String> {
    vec![
        name.to_owned(),
        method.to_owned(),
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
        mode.method.clone(),
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

/// The shortest digits that give the same number back; empty where there is none.
pub(super) fn number(value: Option<f64>) -> String {
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
