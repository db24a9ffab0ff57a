//! The study of resolution: rms errors over block size, a panel for each reading.

use tapjoint_study::resolution::{EstimateMethod, ReadBy, ResolutionStudy, WindowName};

use super::super::chart::axis::{Axis, Tick, extent};
use super::super::chart::{Block, Chart, Color, Mark, Panel, Series};
use super::super::format::{significant, trimmed};

/// Labels of block sizes that fit under a panel.
const MOST_BLOCKS: usize = 5;

/// The study's first window.
pub fn resolution(study: &ResolutionStudy) -> Chart {
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
