//! The picture of the study of resolution: rms errors over block size, a panel for each reading.

use super::super::format::{significant, trimmed};
use super::axis::{Axis, Tick, extent};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::palette::{Color, INK, SOFT, curve};
use super::panel::{LABEL_SIZE, Panel, Sample, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};
use tapjoint_study::resolution::{EstimateMethod, ReadingName, ResolutionStudy, WindowName};

/// Height of a panel (pixels).
const HEIGHT: f64 = 300.0;
/// Upper ends of the panels of frequencies and of stiffnesses (pixels).
const TOPS: [f64; 2] = [136.0, 560.0];
/// Space between panels side by side (pixels).
const GAP: f64 = 18.0;
/// Left edge of the first panel (pixels): powers of ten need room beside the title.
const INNER_LEFT: f64 = LEFT + 8.0;

/// A curve over block size.
struct Curve {
    color: Color,
    look: Look,
    /// Block and error (%).
    points: Vec<(f64, f64)>,
}

#[derive(Clone, Copy, PartialEq)]
enum Look {
    Dots,
    Rings,
    Dashed,
}

/// The picture of the study's first window.
pub fn draw_resolution(study: &ResolutionStudy) -> Drawing {
    let mut drawing = Drawing::new("Resolution error over block size", WIDTH, 920);
    let window = study
        .answers
        .first()
        .map_or(WindowName::Automatic, |a| a.window);
    let title = "Spectral resolution error against block size";
    let below = format!(
        "rms over {} virtual tests ({} fitted); window {}, damping {} %, noise {} dB below the peak",
        study.draws,
        study.fit_draws,
        window.name(),
        trimmed(100.0 * study.damping, 3),
        study.noise_db
    );
    draw_title(&mut drawing, title, &below);
    let mut readings: Vec<ReadingName> = study.answers.iter().map(|a| a.reading).collect();
    readings.dedup();
    readings.truncate(ReadingName::ALL.len());
    let of = |reading: &ReadingName| (study, window, *reading);
    let frequencies: Vec<Vec<Curve>> = readings.iter().map(|r| mode_curves(of(r))).collect();
    let stiffnesses: Vec<Vec<Curve>> = readings.iter().map(|r| stiffness_curves(of(r))).collect();
    draw_row(&mut drawing, (study, &readings), 0, &frequencies);
    draw_row(&mut drawing, (study, &readings), 1, &stiffnesses);
    draw_legend(&mut drawing, (LEFT, 82.0), RIGHT, &mode_legend(study));
    draw_legend(&mut drawing, (LEFT, 506.0), RIGHT, &stiffness_legend(study));
    drawing
}

type Of<'a> = (&'a ResolutionStudy, WindowName, ReadingName);

/// Errors of the frequencies in percent of each, and their half lines.
fn mode_curves((study, window, reading): Of<'_>) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (index, mode) in study.modes.iter().enumerate() {
        let rows = || {
            study.frequency_errors.iter().filter(|row| {
                (row.window, row.reading) == (window, reading)
                    && (row.mode, row.band) == (mode.mode, mode.band)
            })
        };
        let percent = |value: f64| 100.0 * value / mode.frequency;
        curves.push(Curve {
            color: curve(index),
            look: Look::Dashed,
            points: rows()
                .map(|row| (row.block as f64, percent(row.half_line)))
                .collect(),
        });
        curves.push(Curve {
            color: curve(index),
            look: Look::Dots,
            points: rows()
                .filter_map(|row| Some((row.block as f64, percent(row.rms?))))
                .collect(),
        });
    }
    curves
}

/// Errors of the stiffnesses, and what half lines make of them at most.
fn stiffness_curves((study, window, reading): Of<'_>) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (index, stiffness) in study.stiffnesses.iter().enumerate() {
        for (method, look) in [
            (EstimateMethod::Pairs, Look::Rings),
            (EstimateMethod::Consistent, Look::Dots),
        ] {
            let rows = || {
                study.stiffness_errors.iter().filter(|row| {
                    (row.window, row.reading) == (window, reading)
                        && (row.method, row.parameter) == (method, stiffness.parameter)
                })
            };
            if method == EstimateMethod::Consistent {
                curves.push(Curve {
                    color: curve(index),
                    look: Look::Dashed,
                    points: rows()
                        .filter_map(|row| Some((row.block as f64, row.half_line_bound_percent?)))
                        .collect(),
                });
            }
            curves.push(Curve {
                color: curve(index),
                look,
                points: rows()
                    .filter_map(|row| Some((row.block as f64, row.rms_percent?)))
                    .collect(),
            });
        }
    }
    curves
}

/// A row of panels with a common vertical axis.
fn draw_row(
    drawing: &mut Drawing,
    (study, readings): (&ResolutionStudy, &[ReadingName]),
    row: usize,
    curves: &[Vec<Curve>],
) {
    let values = curves
        .iter()
        .flatten()
        .flat_map(|curve| &curve.points)
        .map(|point| point.1);
    let positive = values.filter(|value| *value > 0.0);
    let (low, high) = extent(positive).unwrap_or((1e-3, 10.0));
    let count = readings.len().max(1) as f64;
    let width = (RIGHT - INNER_LEFT - GAP * (count - 1.0)) / count;
    let blocks: Vec<f64> = study
        .blocks
        .iter()
        .map(|block| block.block as f64)
        .collect();
    let ends = extent(blocks.iter().copied()).unwrap_or((512.0, 65536.0));
    for (index, (reading, curves)) in readings.iter().zip(curves).enumerate() {
        let left = INNER_LEFT + index as f64 * (width + GAP);
        let panel = Panel {
            x: Axis::logarithmic((ends.0 / 1.2, ends.1 * 1.2), (left, left + width)),
            y: Axis::logarithmic((low / 1.5, high * 1.5), (TOPS[row] + HEIGHT, TOPS[row])),
        };
        panel.draw_x_ticks(drawing, &block_ticks(&blocks, width));
        let ticks = panel.y.ticks(46.0).into_iter().map(|tick| Tick {
            // Side by side, the first panel's labels stand for all.
            label: tick
                .label
                .map(|label| if index == 0 { label } else { String::new() }),
            ..tick
        });
        panel.draw_y_ticks(drawing, &ticks.collect::<Vec<_>>());
        panel.draw_frame(drawing);
        if row == 1 {
            draw_wanted(drawing, &panel, study.accuracy_percent);
        }
        curves
            .iter()
            .for_each(|curve| draw_curve(drawing, &panel, curve));
        let name = Text::new(
            heading(*reading),
            (left + 0.5 * width, TOPS[row] - 14.0),
            LABEL_SIZE,
        );
        drawing.text(name.bold().aligned(Align::Middle));
        panel.draw_x_title(drawing, "block (samples)");
        if index == 0 {
            let titles = ["error of the frequency (%)", "error of the stiffness (%)"];
            panel.draw_y_title(drawing, titles[row]);
        }
    }
}

fn heading(reading: ReadingName) -> &'static str {
    match reading {
        ReadingName::Line => "read on the line",
        ReadingName::Interpolated => "read between the lines",
        ReadingName::Fit => "fitted",
    }
}

/// Ticks at the block sizes; as many labels as have room.
fn block_ticks(blocks: &[f64], width: f64) -> Vec<Tick> {
    let room = (width / 62.0).max(1.0) as usize;
    let stride = blocks.len().div_ceil(room).max(1);
    let tick = |(index, block): (usize, &f64)| Tick {
        value: *block,
        label: (index % stride == 0).then(|| block.to_string()),
    };
    blocks.iter().enumerate().map(tick).collect()
}

fn draw_wanted(drawing: &mut Drawing, panel: &Panel, percent: f64) {
    if panel.y.holds(percent) {
        let y = panel.y.place(percent);
        drawing.line(
            vec![(panel.x.from, y), (panel.x.to, y)],
            Stroke::new(INK, 1.2),
        );
    }
}

fn draw_curve(drawing: &mut Drawing, panel: &Panel, curve: &Curve) {
    let places: Vec<_> = curve
        .points
        .iter()
        .filter(|(_, error)| *error > 0.0)
        .map(|&(block, error)| panel.place(block, error))
        .collect();
    match curve.look {
        Look::Dashed => {
            for pair in places.windows(2) {
                let mut stroke = Stroke::new(curve.color, 1.3);
                stroke.opacity = 0.8;
                drawing.dashed(pair[0], pair[1], (6.0, 5.0), stroke);
            }
        }
        Look::Dots => {
            drawing.line(places.clone(), Stroke::new(curve.color, 2.0));
            places
                .into_iter()
                .for_each(|at| drawing.dot(at, 4.0, curve.color));
        }
        Look::Rings => {
            let mut stroke = Stroke::new(curve.color, 1.3);
            stroke.opacity = 0.6;
            drawing.line(places.clone(), stroke);
            places
                .into_iter()
                .for_each(|at| drawing.ring(at, 5.0, curve.color));
        }
    }
}

fn mode_legend(study: &ResolutionStudy) -> Vec<(Sample, String)> {
    let mode = |(index, mode): (usize, &tapjoint_study::resolution::StudiedMode)| {
        let words = format!("mode {}: {} Hz", mode.mode, significant(mode.frequency, 4));
        (Sample::Dot(curve(index)), words)
    };
    let mut entries: Vec<_> = study.modes.iter().enumerate().map(mode).collect();
    entries.push((Sample::Dashed(SOFT), "half-line bound".to_owned()));
    entries
}

fn stiffness_legend(study: &ResolutionStudy) -> Vec<(Sample, String)> {
    let mut entries = Vec::new();
    for (index, stiffness) in study.stiffnesses.iter().enumerate() {
        let name = stiffness.parameter;
        entries.push((Sample::Dot(curve(index)), format!("{name}, consistent")));
        entries.push((Sample::Ring(curve(index)), format!("{name}, pairs")));
    }
    entries.push((
        Sample::Dashed(SOFT),
        "half-line bound, consistent".to_owned(),
    ));
    let wanted = format!("wanted: {} %", trimmed(study.accuracy_percent, 3));
    entries.push((Sample::Line(INK), wanted));
    entries
}
