//! Tables of the study of resolution.

use super::super::format::{MISSING, optional, significant, trimmed};
use super::{Column, Table, number};
use tapjoint_study::resolution::{
    EstimateMethod, FrequencyError, ReadBy, ResolutionStudy, StiffnessError, StudiedMode,
    StudiedStiffness, WindowName,
};

/// Lines, spacing and length of record of each block size.
pub fn resolution_lines(study: &ResolutionStudy) -> Table {
    let mut columns = vec![
        number("Block"),
        number("Lines"),
        number("Half line (% of band)"),
    ];
    let bands = study.blocks.first().map_or(&[][..], |block| &block.bands);
    for band in bands {
        let name = format!(
            "{}\u{2013}{} Hz",
            trimmed(band.low, 4),
            trimmed(band.high, 4)
        );
        columns.push(number(&format!("{name}: spacing (Hz)")));
        columns.push(number("record (s)"));
    }
    let row = |block: &tapjoint_study::resolution::BlockLines| {
        let mut row = vec![
            block.block.to_string(),
            block.lines.to_string(),
            significant(block.half_line_percent_of_band, 4),
        ];
        for band in &block.bands {
            row.push(significant(band.spacing, 4));
            row.push(significant(band.seconds, 3));
        }
        row
    };
    Table {
        caption:
            "Lines: half a line is band/(2 lines), lines = block/2.56; spacing; record of one tap"
                .to_owned(),
        columns,
        rows: study.blocks.iter().map(row).collect(),
        note: String::new(),
    }
}

/// The readings that the study has, in its order.
fn readings(study: &ResolutionStudy) -> Vec<ReadBy> {
    let mut readings = Vec::new();
    for answer in &study.answers {
        if !readings.contains(&answer.reading) {
            readings.push(answer.reading);
        }
    }
    readings
}

fn reading_columns(readings: &[ReadBy]) -> impl Iterator<Item = Column> + '_ {
    readings.iter().map(|reading| number(reading.name()))
}

/// rms errors of one mode's frequency in the band from which estimates take it.
pub fn resolution_frequencies(
    study: &ResolutionStudy,
    window: WindowName,
    mode: &StudiedMode,
) -> Table {
    let readings = readings(study);
    let mut columns = vec![
        number("Block"),
        number("Half line"),
        number("Spacing/\u{221a}12"),
    ];
    columns.extend(reading_columns(&readings));
    columns.push(number("Read"));
    let find = |block: usize, reading: ReadBy| {
        study.frequency_errors.iter().find(|row| {
            (row.block, row.window, row.reading) == (block, window, reading)
                && (row.mode, row.band) == (mode.mode, mode.band)
        })
    };
    let row = |block: usize| {
        let rows: Vec<Option<&FrequencyError>> = readings
            .iter()
            .map(|&reading| find(block, reading))
            .collect();
        let any = rows.iter().copied().flatten().next();
        let bounds = [
            any.map(|row| row.half_line),
            any.map(|row| row.spacing / 12f64.sqrt()),
        ];
        let errors = rows.iter().map(|row| row.and_then(|row| row.rms));
        let counts = any.map(|row| (row.found, row.draws));
        cells(block, bounds.into_iter().chain(errors), counts)
    };
    Table {
        caption: format!(
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
        ),
        columns,
        rows: study.blocks.iter().map(|block| row(block.block)).collect(),
        note: String::new(),
    }
}

/// rms errors of one stiffness.
pub fn resolution_stiffnesses(
    study: &ResolutionStudy,
    (window, method): (WindowName, EstimateMethod),
    stiffness: &StudiedStiffness,
) -> Table {
    let readings = readings(study);
    let mut columns = vec![
        number("Block"),
        number("Half-line bound"),
        number("Uniform on a line"),
    ];
    columns.extend(reading_columns(&readings));
    columns.push(number("Estimated"));
    let find = |block: usize, reading: ReadBy| {
        study.stiffness_errors.iter().find(|row| {
            (row.block, row.window, row.reading) == (block, window, reading)
                && (row.method, row.parameter) == (method, stiffness.parameter)
        })
    };
    let row = |block: usize| {
        let rows: Vec<Option<&StiffnessError>> = readings
            .iter()
            .map(|&reading| find(block, reading))
            .collect();
        let any = rows.iter().copied().flatten().next();
        let bounds = [
            any.and_then(|row| row.half_line_bound_percent),
            any.and_then(|row| row.line_rms_percent),
        ];
        let errors = rows.iter().map(|row| row.and_then(|row| row.rms_percent));
        let counts = any.map(|row| (row.found, row.draws));
        cells(block, bounds.into_iter().chain(errors), counts)
    };
    let bias = match (method, stiffness.pairs_bias_percent) {
        (EstimateMethod::Pairs, Some(bias)) if bias.abs() >= 0.05 => format!(
            "; counted from its estimate of exact frequencies, which is {bias:+.1} % off itself"
        ),
        _ => String::new(),
    };
    Table {
        caption: format!(
            "{} = {}, {} estimate: rms error (%){bias}",
            title(stiffness.parameter),
            significant(stiffness.value, 5),
            method.name(),
        ),
        columns,
        rows: study.blocks.iter().map(|block| row(block.block)).collect(),
        note: String::new(),
    }
}

/// A row of errors: the block, numbers, and how many of the draws were read.
fn cells(
    block: usize,
    numbers: impl Iterator<Item = Option<f64>>,
    counts: Option<(usize, usize)>,
) -> Vec<String> {
    let numbers = numbers.map(|value| optional(value, 3));
    std::iter::once(block.to_string())
        .chain(numbers)
        .chain([share(counts)])
        .collect()
}

/// "Kx".
fn title(parameter: &str) -> String {
    match parameter {
        "modulus" => "Modulus (Pa)".to_owned(),
        other => {
            let mut letters = other.chars();
            letters.next().map_or(String::new(), |first| {
                first.to_uppercase().chain(letters).collect()
            })
        }
    }
}

/// "98 %".
fn share(counts: Option<(usize, usize)>) -> String {
    match counts {
        Some((found, draws)) if draws > 0 => {
            // Rounded down: 100 % means all.
            format!("{} %", (100.0 * found as f64 / draws as f64).floor())
        }
        _ => MISSING.to_owned(),
    }
}
