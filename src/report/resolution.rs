//! The study of resolution as text, table of values and picture.

use super::ReportError;
use super::chart::{PictureFormat, render_picture};
use super::charts::resolution::resolution;
use super::data_files::{number, write};
use super::format::{MISSING, capital, optional, significant, trimmed};
use super::tables::{Table, number as column};
use super::text::{render_table, wrapped};
use tapjoint_study::resolution::{
    EstimateMethod, ReadBy, ResolutionStudy, StudiedMode, StudiedStiffness, WindowName,
};

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
    let conditions = format!(
        "{} virtual tests of one tap for each block size ({} of them fitted), frequencies spread over the \
         lines, {:.0} samples/s, damping {} %, noise {} dB below the peak, seed {}. Columns of readings are \
         rms errors; \"Read\" and \"Estimated\" are shares of the draws.",
        study.draws,
        study.fit_draws,
        study.sample_rate,
        trimmed(100.0 * study.damping, 3),
        study.noise_db,
        study.seed
    );
    let lines = render_table(&resolution_lines(study));
    let mut parts = vec![wrapped(&conditions, 0), lines];
    let mut windows: Vec<WindowName> = Vec::new();
    for answer in &study.answers {
        if !windows.contains(&answer.window) {
            windows.push(answer.window);
        }
    }
    for &window in &windows {
        if windows.len() > 1 {
            parts.push(format!("WINDOW {}\n", window.name()));
        }
        for mode in &study.modes {
            parts.push(render_table(&resolution_frequencies(study, window, mode)));
        }
        for stiffness in &study.stiffnesses {
            for method in EstimateMethod::ALL {
                let table = resolution_stiffnesses(study, window, method, stiffness);
                parts.push(render_table(&table));
            }
        }
    }
    parts.push(wrapped(&study.sentence, 0));
    parts.join("\n")
}

/// Returns the study as comma separated values: one row for each mode and band or stiffness and estimator, block,
/// window and reading. Errors of frequencies are in Hz, of stiffnesses in percent.
///
/// # Errors
/// [`ReportError::Csv`] if a row cannot be written.
pub fn render_resolution_csv(study: &ResolutionStudy) -> Result<String, ReportError> {
    let mut rows = Vec::new();
    for row in &study.frequency_errors {
        rows.push(vec![
            "frequency".to_owned(),
            format!("mode {}", row.mode),
            String::new(),
            "Hz".to_owned(),
            row.block.to_string(),
            lines_of(study, row.block),
            row.window.name().to_owned(),
            row.reading.name().to_owned(),
            row.band[0].to_string(),
            row.band[1].to_string(),
            row.spacing.to_string(),
            row.half_line.to_string(),
            (row.spacing / 12f64.sqrt()).to_string(),
            number(row.rms),
            number(row.mean),
            number(row.p95),
            number(row.largest),
            row.found.to_string(),
            row.own.to_string(),
            row.draws.to_string(),
        ]);
    }
    for row in &study.stiffness_errors {
        rows.push(vec![
            "stiffness".to_owned(),
            row.parameter.to_owned(),
            row.method.name().to_owned(),
            "%".to_owned(),
            row.block.to_string(),
            lines_of(study, row.block),
            row.window.name().to_owned(),
            row.reading.name().to_owned(),
            String::new(),
            String::new(),
            String::new(),
            number(row.half_line_bound_percent),
            number(row.line_rms_percent),
            number(row.rms_percent),
            number(row.mean_percent),
            number(row.p95_percent),
            number(row.largest_percent),
            row.found.to_string(),
            String::new(),
            row.draws.to_string(),
        ]);
    }
    write(&COLUMNS, rows)
}

fn lines_of(study: &ResolutionStudy, block: usize) -> String {
    let found = study.blocks.iter().find(|lines| lines.block == block);
    found.map_or(String::new(), |found| found.lines.to_string())
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

/// Lines, spacing and length of record of each block size.
fn resolution_lines(study: &ResolutionStudy) -> Table {
    let mut columns = vec![
        column("Block"),
        column("Lines"),
        column("Half line (% of band)"),
    ];
    let bands = study.blocks.first().map_or(&[][..], |block| &block.bands);
    for band in bands {
        let name = format!(
            "{}\u{2013}{} Hz",
            trimmed(band.low, 4),
            trimmed(band.high, 4)
        );
        columns.push(column(&format!("{name}: spacing (Hz)")));
        columns.push(column("record (s)"));
    }
    let mut rows = Vec::new();
    for block in &study.blocks {
        let mut row = vec![
            block.block.to_string(),
            block.lines.to_string(),
            significant(block.half_line_percent_of_band, 4),
        ];
        for band in &block.bands {
            row.push(significant(band.spacing, 4));
            row.push(significant(band.seconds, 3));
        }
        rows.push(row);
    }
    Table {
        caption:
            "Lines: half a line is band/(2 lines), lines = block/2.56; spacing; record of one tap"
                .to_owned(),
        columns,
        rows,
        note: String::new(),
    }
}

/// Errors of one quantity at one block size and by one way of reading.
struct Errors {
    /// Two bounds that hold for every way of reading.
    bounds: [Option<f64>; 2],
    rms: Option<f64>,
    /// Draws with an answer.
    found: usize,
    draws: usize,
}

/// Returns a table of rms errors: a row for each block size, a column for each way of reading.
fn errors_table(
    study: &ResolutionStudy,
    caption: String,
    heads: [&str; 3],
    find: impl Fn(usize, ReadBy) -> Option<Errors>,
) -> Table {
    let mut readings: Vec<ReadBy> = Vec::new();
    for answer in &study.answers {
        if !readings.contains(&answer.reading) {
            readings.push(answer.reading);
        }
    }
    let [first, second, share] = heads;
    let mut columns = vec![column("Block"), column(first), column(second)];
    columns.extend(readings.iter().map(|reading| column(reading.name())));
    columns.push(column(share));
    let mut rows = Vec::new();
    for block in study.blocks.iter().map(|block| block.block) {
        let errors = readings.iter().map(|reading| find(block, *reading));
        let errors: Vec<Option<Errors>> = errors.collect();
        let any = errors.iter().flatten().next();
        let mut row = vec![block.to_string()];
        for bound in any.map_or([None; 2], |any| any.bounds) {
            row.push(optional(bound, 3));
        }
        for errors in &errors {
            row.push(optional(errors.as_ref().and_then(|errors| errors.rms), 3));
        }
        row.push(match any {
            // Rounded down: 100 % means all.
            Some(any) if any.draws > 0 => {
                let percent = 100.0 * any.found as f64 / any.draws as f64;
                format!("{} %", percent.floor())
            }
            _ => MISSING.to_owned(),
        });
        rows.push(row);
    }
    Table {
        caption,
        columns,
        rows,
        note: String::new(),
    }
}

/// Returns the rms errors of one mode's frequency in the band from which estimates take it.
fn resolution_frequencies(
    study: &ResolutionStudy,
    window: WindowName,
    mode: &StudiedMode,
) -> Table {
    let caption = format!(
        "Mode {}, {} Hz, read in {}\u{2013}{} Hz{}: rms error of the frequency (Hz)",
        mode.mode,
        significant(mode.frequency, 5),
        trimmed(mode.band[0], 4),
        trimmed(mode.band[1], 4),
        if mode.used {
            ""
        } else {
            " (not in the estimate)"
        }
    );
    let heads = ["Half line", "Spacing/\u{221a}12", "Read"];
    errors_table(study, caption, heads, |block, reading| {
        let row = study.frequency_errors.iter().find(|row| {
            (row.block, row.window, row.reading) == (block, window, reading)
                && (row.mode, row.band) == (mode.mode, mode.band)
        })?;
        Some(Errors {
            bounds: [Some(row.half_line), Some(row.spacing / 12f64.sqrt())],
            rms: row.rms,
            found: row.found,
            draws: row.draws,
        })
    })
}

/// Returns the rms errors of one stiffness by one method.
fn resolution_stiffnesses(
    study: &ResolutionStudy,
    window: WindowName,
    method: EstimateMethod,
    stiffness: &StudiedStiffness,
) -> Table {
    let bias = match (method, stiffness.pairs_bias_percent) {
        (EstimateMethod::Pairs, Some(bias)) if bias.abs() >= 0.05 => format!(
            "; counted from its estimate of exact frequencies, which is {bias:+.1} % off itself"
        ),
        _ => String::new(),
    };
    let title = match stiffness.parameter {
        "modulus" => "Modulus (Pa)".to_owned(),
        other => capital(other),
    };
    let value = significant(stiffness.value, 5);
    let method_name = method.name();
    let caption = format!("{title} = {value}, {method_name} estimate: rms error (%){bias}");
    let heads = ["Half-line bound", "Uniform on a line", "Estimated"];
    errors_table(study, caption, heads, |block, reading| {
        let row = study.stiffness_errors.iter().find(|row| {
            (row.block, row.window, row.reading) == (block, window, reading)
                && (row.method, row.parameter) == (method, stiffness.parameter)
        })?;
        Some(Errors {
            bounds: [row.half_line_bound_percent, row.line_rms_percent],
            rms: row.rms_percent,
            found: row.found,
            draws: row.draws,
        })
    })
}
