//! The study of resolution as text, table of values and picture.

use super::ReportError;
use super::chart::{PictureFormat, render_picture};
use super::charts::resolution::resolution;
use super::tables::{resolution_frequencies, resolution_lines, resolution_stiffnesses};
use super::text::{render_table, wrapped};
use tapjoint_study::resolution::{EstimateMethod, ResolutionStudy, WindowName};

/// Columns of the CSV.
const COLUMNS: [&str; 20] = [
    "quantity",
    "name",
    "method",
    "unit",
    "block",
    "lines",
    "window",
    "reading",
    "band_low_Hz",
    "band_high_Hz",
    "line_spacing_Hz",
    "half_line_bound",
    "uniform_on_line_rms",
    "rms",
    "mean",
    "p95",
    "largest",
    "found",
    "own",
    "draws",
];

/// The study for a terminal of 80 columns.
pub fn render_resolution(study: &ResolutionStudy) -> String {
    let mut parts = vec![conditions(study), render_table(&resolution_lines(study))];
    for window in windows(study) {
        if windows(study).len() > 1 {
            parts.push(format!("WINDOW {}\n", window.name()));
        }
        for mode in &study.modes {
            parts.push(render_table(&resolution_frequencies(study, window, mode)));
        }
        for stiffness in &study.stiffnesses {
            for method in EstimateMethod::ALL {
                let of = (window, method);
                parts.push(render_table(&resolution_stiffnesses(study, of, stiffness)));
            }
        }
    }
    parts.push(wrapped(&study.sentence, 0));
    parts.join("\n")
}

fn windows(study: &ResolutionStudy) -> Vec<WindowName> {
    let mut windows: Vec<WindowName> = Vec::new();
    for answer in &study.answers {
        if !windows.contains(&answer.window) {
            windows.push(answer.window);
        }
    }
    windows
}

fn conditions(study: &ResolutionStudy) -> String {
    wrapped(
        &format!(
            "{} virtual tests of one tap for each block size ({} of them fitted), frequencies spread over the \
         lines, {:.0} samples/s, damping {} %, noise {} dB below the peak, seed {}. Columns of readings are \
         rms errors; \"Read\" and \"Estimated\" are shares of the draws.",
            study.draws,
            study.fit_draws,
            study.sample_rate,
            super::format::trimmed(100.0 * study.damping, 3),
            study.noise_db,
            study.seed
        ),
        0,
    )
}

/// The study as comma separated values: one row for each mode and band or stiffness and estimator, block,
/// window and reading. Errors of frequencies are in Hz, of stiffnesses in percent.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_resolution_csv(study: &ResolutionStudy) -> Result<String, ReportError> {
    super::data_files::write(&COLUMNS, rows(study))
}

fn rows(study: &ResolutionStudy) -> Vec<Vec<String>> {
    let lines = |block: usize| {
        let found = study.blocks.iter().find(|lines| lines.block == block);
        found.map_or(String::new(), |found| found.lines.to_string())
    };
    let value = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    let frequencies = study.frequency_errors.iter().map(|row| {
        vec![
            "frequency".to_owned(),
            format!("mode {}", row.mode),
            String::new(),
            "Hz".to_owned(),
            row.block.to_string(),
            lines(row.block),
            row.window.name().to_owned(),
            row.reading.name().to_owned(),
            row.band[0].to_string(),
            row.band[1].to_string(),
            row.spacing.to_string(),
            row.half_line.to_string(),
            (row.spacing / 12f64.sqrt()).to_string(),
            value(row.rms),
            value(row.mean),
            value(row.p95),
            value(row.largest),
            row.found.to_string(),
            row.own.to_string(),
            row.draws.to_string(),
        ]
    });
    let stiffnesses = study.stiffness_errors.iter().map(|row| {
        vec![
            "stiffness".to_owned(),
            row.parameter.to_owned(),
            row.method.name().to_owned(),
            "%".to_owned(),
            row.block.to_string(),
            lines(row.block),
            row.window.name().to_owned(),
            row.reading.name().to_owned(),
            String::new(),
            String::new(),
            String::new(),
            value(row.half_line_bound_percent),
            value(row.line_rms_percent),
            value(row.rms_percent),
            value(row.mean_percent),
            value(row.p95_percent),
            value(row.largest_percent),
            row.found.to_string(),
            String::new(),
            row.draws.to_string(),
        ]
    });
    frequencies.chain(stiffnesses).collect()
}

/// The study as a picture, of its first window.
///
/// # Errors
/// [`ReportError`] where it cannot be drawn.
pub fn render_resolution_picture(
    study: &ResolutionStudy,
    format: PictureFormat,
) -> Result<Vec<u8>, ReportError> {
    render_picture(&resolution(study).draw(), format)
}
