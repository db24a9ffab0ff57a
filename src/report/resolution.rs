//! The study of resolution as text, table of values and picture.

use crate::ReportError;
use crate::data_files::{number, write};
use crate::format::{MISSING, capital, optional, significant, trimmed};
use crate::picture::{Axis, Block, Chart, Color, Mark, Panel, PictureFormat, Series, Tick, extent};
use crate::screen::Screen;
use crate::tables::{Table, number as cell};
use tapjoint_study::resolution::{
    EstimateMethod, ReadBy, ResolutionStudy, StudiedMode, StudiedStiffness, WindowName,
};

/// Heads of the CSV.
const HEADS: &str = "quantity,name,method,unit,block,lines,window,reading,band_low_Hz,band_high_Hz,line_spacing_Hz,\
     half_line_bound,uniform_on_line_rms,rms,mean,p95,largest,found,own,draws";
/// Labels of block sizes that fit under a panel.
const MOST_BLOCKS: usize = 5;

/// The study for a terminal of 80 columns.
pub fn render_resolution(study: &ResolutionStudy, screen: Screen) -> String {
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
    let lines = screen.table(&lines_table(study));
    let mut parts = vec![screen.wrapped(&conditions, 0), lines];
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
            parts.push(screen.table(&frequencies_table(study, window, mode)));
        }
        for stiffness in &study.stiffnesses {
            for method in EstimateMethod::ALL {
                let table = stiffnesses_table(study, window, method, stiffness);
                parts.push(screen.table(&table));
            }
        }
    }
    parts.push(screen.wrapped(&study.sentence, 0));
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
    write(HEADS, rows)
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
    resolution(study).render(format)
}

/// Lines, spacing and length of record of each block size.
fn lines_table(study: &ResolutionStudy) -> Table {
    let rows = study.blocks.iter().map(|block| {
        let half_line = significant(block.half_line_percent_of_band, 4);
        let mut row = vec![
            cell("Block", block.block.to_string()),
            cell("Lines", block.lines.to_string()),
            cell("Half line (% of band)", half_line),
        ];
        for band in &block.bands {
            let (low, high) = (trimmed(band.low, 4), trimmed(band.high, 4));
            let head = format!("{low}\u{2013}{high} Hz: spacing (Hz)");
            row.push(cell(&head, significant(band.spacing, 4)));
            row.push(cell("record (s)", significant(band.seconds, 3)));
        }
        row
    });
    let caption =
        "Lines: half a line is band/(2 lines), lines = block/2.56; spacing; record of one tap";
    Table::of(caption, rows, "")
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
    let rows = study.blocks.iter().map(|block| {
        let errors = readings.iter().map(|reading| find(block.block, *reading));
        let errors: Vec<Option<Errors>> = errors.collect();
        let any = errors.iter().flatten().next();
        let mut row = vec![cell("Block", block.block.to_string())];
        for (head, bound) in heads.iter().zip(any.map_or([None; 2], |any| any.bounds)) {
            row.push(cell(head, optional(bound, 3)));
        }
        for (reading, errors) in readings.iter().zip(&errors) {
            let rms = errors.as_ref().and_then(|errors| errors.rms);
            row.push(cell(reading.name(), optional(rms, 3)));
        }
        let share = match any {
            // Rounded down: 100 % means all.
            Some(any) if any.draws > 0 => {
                let percent = 100.0 * any.found as f64 / any.draws as f64;
                format!("{} %", percent.floor())
            }
            _ => MISSING.to_owned(),
        };
        row.push(cell(heads[2], share));
        row
    });
    Table::of(caption, rows, "")
}

/// Returns the rms errors of one mode's frequency in the band from which estimates take it.
fn frequencies_table(study: &ResolutionStudy, window: WindowName, mode: &StudiedMode) -> Table {
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
fn stiffnesses_table(
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

/// The study's first window as a chart.
fn resolution(study: &ResolutionStudy) -> Chart {
    let window = study.answers.first();
    let window = window.map_or(WindowName::Automatic, |answer| answer.window);
    let mut readings: Vec<ReadBy> = study.answers.iter().map(|one| one.reading).collect();
    readings.dedup();
    readings.truncate(ReadBy::ALL.len());
    let frequencies = readings
        .iter()
        .map(|reading| mode_curves(study, window, *reading));
    let stiffnesses = readings
        .iter()
        .map(|reading| stiffness_curves(study, window, *reading));
    let rows = [
        (
            "Frequencies",
            "error of the frequency",
            frequencies.collect(),
        ),
        (
            "Stiffnesses",
            "error of the stiffness",
            stiffnesses.collect(),
        ),
    ];
    let blocks = rows.map(
        |(name, label, curves): (&str, &str, Vec<Vec<Series>>)| Block {
            name: name.to_owned(),
            ..Block::new(
                readings.len().max(1),
                panels(study, &readings, label, curves),
            )
        },
    );
    Chart {
        kind: "resolution",
        title: "Spectral resolution error against block size".to_owned(),
        subtitle: format!(
            "rms over {} virtual tests ({} fitted); window {}, damping {} %, noise {} dB below the peak",
            study.draws,
            study.fit_draws,
            window.name(),
            trimmed(100.0 * study.damping, 3),
            study.noise_db
        ),
        blocks: blocks.into_iter().collect(),
        ..Chart::default()
    }
}

/// A panel for each reading, all with the same vertical axis.
fn panels(
    study: &ResolutionStudy,
    readings: &[ReadBy],
    label: &str,
    curves: Vec<Vec<Series>>,
) -> Vec<Panel> {
    let heights = curves.iter().flatten().flat_map(|series| &series.y);
    let (low, high) = extent(heights.copied()).unwrap_or((1e-3, 10.0));
    let blocks = study.blocks.iter().map(|block| block.block as f64);
    let (first, last) = extent(blocks.clone()).unwrap_or((512.0, 65536.0));
    let mut x = Axis::logarithmic(first / 1.2, last * 1.2).of("block", "samples");
    let stride = study.blocks.len().div_ceil(MOST_BLOCKS).max(1);
    for (index, value) in blocks.enumerate() {
        let label = (index % stride == 0).then(|| value.to_string());
        x.names.push(Tick { value, label });
    }
    let mut panels = Vec::new();
    for (reading, series) in readings.iter().zip(curves) {
        let title = match reading {
            ReadBy::Line => "read on the line",
            ReadBy::Interpolated => "read between the lines",
            ReadBy::Fit => "fitted",
        };
        let y = Axis::logarithmic(low / 1.5, high * 1.5).of(label, "%");
        panels.push(Panel::new(300.0, x.clone(), y).titled(title).with(series));
    }
    panels
}

/// Errors over block size; values that are not positive have no place on the axis.
fn curve(points: impl Iterator<Item = (usize, Option<f64>)>) -> Vec<(f64, f64)> {
    let known = points.filter_map(|(block, error)| Some((block as f64, error?)));
    known.filter(|(_, error)| *error > 0.0).collect()
}

/// A line with its points.
fn marked(name: &str, color: Color, mark: Mark, points: Vec<(f64, f64)>) -> [Series; 2] {
    let width = if matches!(mark, Mark::Dot(_)) {
        2.0
    } else {
        1.3
    };
    let line = Series::points("", color, Mark::Line(width), points.clone());
    [line, Series::points(name, color, mark, points)]
}

/// Errors of the frequencies in percent of each, and their half lines.
fn mode_curves(study: &ResolutionStudy, window: WindowName, reading: ReadBy) -> Vec<Series> {
    let mut curves = Vec::new();
    for (index, mode) in study.modes.iter().enumerate() {
        let color = Color::curve(index);
        let rows = study.frequency_errors.iter().filter(|row| {
            (row.window, row.reading) == (window, reading)
                && (row.mode, row.band) == (mode.mode, mode.band)
        });
        let bounds = curve(
            rows.clone()
                .map(|row| (row.block, Some(100.0 * row.half_line / mode.frequency))),
        );
        // One entry of the legend explains the broken lines of all colours.
        let name = if index == 0 { "half-line bound" } else { "" };
        curves.push(Series::points(name, color, Mark::Dashed(1.3), bounds));
        let name = format!("mode {}: {} Hz", mode.mode, significant(mode.frequency, 4));
        let errors = curve(rows.map(|row| {
            let percent = row.rms.map(|rms| 100.0 * rms / mode.frequency);
            (row.block, percent)
        }));
        curves.extend(marked(&name, color, Mark::Dot(4.0), errors));
    }
    curves
}

/// Errors of the stiffnesses, the largest that half lines make of them, and the wanted accuracy.
fn stiffness_curves(study: &ResolutionStudy, window: WindowName, reading: ReadBy) -> Vec<Series> {
    let mut curves = Vec::new();
    for (index, stiffness) in study.stiffnesses.iter().enumerate() {
        let color = Color::curve(index);
        for (method, words, mark) in [
            (EstimateMethod::Pairs, "pairs", Mark::Ring(5.0)),
            (EstimateMethod::Consistent, "consistent", Mark::Dot(4.0)),
        ] {
            let rows = study.stiffness_errors.iter().filter(|row| {
                (row.window, row.reading) == (window, reading)
                    && (row.method, row.parameter) == (method, stiffness.parameter)
            });
            if method == EstimateMethod::Consistent {
                let bounds = rows
                    .clone()
                    .map(|row| (row.block, row.half_line_bound_percent));
                curves.push(Series::points("", color, Mark::Dashed(1.3), curve(bounds)));
            }
            let name = format!("{}, {words}", stiffness.parameter);
            let errors = curve(rows.map(|row| (row.block, row.rms_percent)));
            curves.extend(marked(&name, color, mark, errors));
        }
    }
    let blocks = study.blocks.iter().map(|block| block.block as f64);
    if let Some((first, last)) = extent(blocks) {
        let wanted = study.accuracy_percent;
        let name = format!("wanted: {} %", trimmed(wanted, 3));
        let ends = [(first, wanted), (last, wanted)];
        curves.push(Series::points(&name, Color::Ink, Mark::Line(1.2), ends));
    }
    curves
}
