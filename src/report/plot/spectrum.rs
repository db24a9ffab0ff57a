//! The picture of a recording's averaged spectra with its resonances and how well they are read.

use super::super::figures::{Curve, PeakMark, RecordingFigure, SpectraFigure};
use super::super::format::{significant, trimmed};
use super::axis::{Axis, extent, nice_step};
use super::closeup::draw_closeups;
use super::drawing::{Drawing, Stroke, Text};
use super::marks::{STRIP, draw_marks};
use super::palette::{BLUE, ORANGE, SOFT, VERMILION, curve};
use super::panel::{Panel, Sample, TICK_SIZE, X_SPACING, draw_legend, draw_title};

/// Width of every picture (pixels).
pub const WIDTH: u32 = 1200;
/// Left edge of panels (pixels).
pub const LEFT: f64 = 84.0;
/// Right edge of panels (pixels): the last tick label needs the margin.
pub const RIGHT: f64 = 1164.0;
/// Smallest magnitude shown, relative to the largest: 140 dB.
const DEEPEST: f64 = 1e-7;

/// How far beyond the highest peak a shortened axis goes, in shares of the peak's frequency.
const PAST_HIGHEST: f64 = 1.25;
/// An axis is shortened when that hides more than the rest of this share of the band.
const MOST_SHOWN_PART: f64 = 0.6;

/// The spectra of a recording; `None` when no tap was accepted, and where only functions are known.
pub fn draw_spectrum(figure: &RecordingFigure) -> Option<Drawing> {
    let known = |spectra: &&SpectraFigure| !spectra.responses.is_empty();
    let spectra = figure.spectra.as_ref().filter(known)?;
    let with_closeups = spectra.peaks.iter().any(|peak| peak.mode.is_some());
    let force = spectra.force.as_deref().filter(|force| is_something(force));
    let force_height = if force.is_some() { 130.0 } else { 0.0 };
    let main_bottom = 500.0;
    let force_bottom = main_bottom + force_height;
    let axis_bottom = force_bottom + 54.0;
    let height = axis_bottom + if with_closeups { 236.0 } else { 0.0 };
    let description = format!("Averaged spectra of {}", figure.file);
    let mut drawing = Drawing::new(description, WIDTH, height as u32);
    draw_title(&mut drawing, &title(figure), &subtitle(spectra));
    let main = draw_responses(&mut drawing, spectra, main_bottom);
    let lowest = match force {
        Some(force) => {
            let edges = (main_bottom + 16.0, force_bottom);
            draw_force(&mut drawing, spectra, force, edges)
        }
        None => main,
    };
    lowest.draw_x_title(&mut drawing, "frequency (Hz)");
    if with_closeups {
        draw_closeups(&mut drawing, spectra, axis_bottom + 10.0);
    }
    Some(drawing)
}

fn title(figure: &RecordingFigure) -> String {
    format!("Averaged spectra, {}", figure.file)
}

/// Averages, block, lines, spacing and resolution in words.
pub fn subtitle(spectra: &SpectraFigure) -> String {
    let lines = &spectra.lines;
    let taps = if spectra.averages == 1 { "tap" } else { "taps" };
    let end = shown_to(spectra);
    let shown = if end < lines.high {
        let (end, all) = (trimmed(end, 6), trimmed(lines.high, 6));
        format!(" \u{b7} shown to {end} of {all} Hz")
    } else {
        String::new()
    };
    if spectra.averages == 0 {
        let spacing = trimmed(lines.spacing, 4);
        return format!(
            "as the file holds them \u{b7} {} lines \u{b7} line spacing {spacing} Hz{shown}",
            lines.points()
        );
    }
    format!(
        "{} {taps} averaged \u{b7} block {} samples, {} lines \u{b7} line spacing {} Hz \u{b7} resolution 1/T = {} Hz{shown}",
        spectra.averages,
        lines.block,
        lines.displayed(),
        trimmed(lines.spacing, 4),
        trimmed(lines.resolution(), 4),
    )
}

/// The horizontal axis of a recording's spectra.
pub fn frequency_axis(spectra: &SpectraFigure) -> Axis {
    Axis::linear((spectra.lines.low, shown_to(spectra)), (LEFT, RIGHT))
}

/// Upper end of the frequencies shown (Hz): the band's, or where nothing was found in its upper
/// part, a round frequency above the highest peak. A kilohertz of modes under twenty kilohertz of
/// noise cannot be read.
fn shown_to(spectra: &SpectraFigure) -> f64 {
    let (low, high) = (spectra.lines.low, spectra.lines.high);
    let peaks = spectra.peaks.iter().map(|peak| peak.frequency);
    let Some((_, highest)) = extent(peaks) else {
        return high;
    };
    let wanted = PAST_HIGHEST * (highest - low);
    let step = nice_step(wanted / 5.0);
    let end = (low / step).floor() * step + (wanted / step).ceil() * step;
    if end > low && end - low < MOST_SHOWN_PART * (high - low) {
        end
    } else {
        high
    }
}

/// A curve over the lines.
pub fn over_lines<'a>(
    spectra: &'a SpectraFigure,
    values: &'a [f64],
) -> impl Iterator<Item = (f64, f64)> + 'a {
    values
        .iter()
        .enumerate()
        .map(|(index, value)| (spectra.lines.frequency(index), *value))
}

/// A logarithmic axis that shows all positive values down to 140 dB below the largest.
pub fn magnitude_axis<'a>(curves: impl IntoIterator<Item = &'a [f64]>, pixels: (f64, f64)) -> Axis {
    let all: Vec<f64> = curves
        .into_iter()
        .flatten()
        .copied()
        .filter(|value| *value > 0.0)
        .collect();
    let high = extent(all.iter().copied()).map_or(1.0, |range| range.1);
    let shown = all.into_iter().filter(|value| *value >= DEEPEST * high);
    let low = extent(shown).map_or(1e-3, |range| range.0);
    Axis::logarithmic((low / 1.4, high * 1.6), pixels)
}

fn draw_responses(drawing: &mut Drawing, spectra: &SpectraFigure, bottom: f64) -> Panel {
    let (curves, unit) = comparable(&spectra.responses);
    let panel = Panel {
        x: frequency_axis(spectra),
        y: magnitude_axis(curves.iter().map(Vec::as_slice), (bottom, 98.0 + STRIP)),
    };
    panel.draw_y_ticks(drawing, &panel.y.ticks(40.0));
    let lowest = !spectra.force.as_deref().is_some_and(is_something);
    if lowest {
        panel.draw_x_ticks(drawing, &panel.x.ticks(X_SPACING));
    } else {
        draw_x_grid(drawing, &panel);
    }
    panel.draw_frame(drawing);
    panel.draw_y_title(drawing, &unit);
    let unlabelled = draw_marks(drawing, &panel, &spectra.peaks);
    for (index, values) in curves.iter().enumerate() {
        let stroke = Stroke::new(curve(index), 1.5);
        panel.draw_curve(drawing, over_lines(spectra, values), stroke);
    }
    draw_legend(drawing, (LEFT, 76.0), RIGHT, &legend(spectra, unlabelled));
    panel
}

/// The grid of a panel whose tick labels stand under another one.
pub fn draw_x_grid(drawing: &mut Drawing, panel: &Panel) {
    for mut tick in panel.x.ticks(X_SPACING) {
        tick.label = Some(String::new());
        panel.draw_x_ticks(drawing, &[tick]);
    }
}

/// Curves that one axis can show: as they are where units agree, else each relative to its peak.
fn comparable(curves: &[Curve]) -> (Vec<Vec<f64>>, String) {
    let unit = curves.first().map_or("", |first| first.unit.as_str());
    if curves.iter().all(|curve| curve.unit == unit) {
        let values = curves.iter().map(|curve| curve.values.clone()).collect();
        return (values, format!("magnitude, rms ({unit})"));
    }
    let relative = curves.iter().map(|curve| {
        let peak = extent(curve.values.iter().copied()).map_or(1.0, |range| range.1);
        let scale = if peak > 0.0 { 1.0 / peak } else { 1.0 };
        curve.values.iter().map(|value| value * scale).collect()
    });
    let title = "magnitude relative to each curve's peak (1)".to_owned();
    (relative.collect(), title)
}

fn legend(spectra: &SpectraFigure, unlabelled: usize) -> Vec<(Sample, String)> {
    let mut entries: Vec<(Sample, String)> = spectra
        .responses
        .iter()
        .enumerate()
        .map(|(index, response)| (Sample::Line(curve(index)), response.name.clone()))
        .collect();
    if has(spectra, |peak| peak.mode.is_some()) {
        let words = "mode, shaded: line \u{b1} half line";
        entries.push((Sample::Dashed(BLUE), words.to_owned()));
    }
    if has(spectra, |peak| peak.mode.is_none()) {
        entries.push((Sample::Dashed(ORANGE), "peak that is no mode".to_owned()));
    }
    if unlabelled > 0 {
        let words = format!("{unlabelled} more without a label, see the table");
        entries.push((Sample::Dashed(SOFT), words));
    }
    entries
}

fn has(spectra: &SpectraFigure, wanted: impl Fn(&PeakMark) -> bool) -> bool {
    spectra.peaks.iter().any(wanted)
}

/// Whether a spectrum has anything above zero.
fn is_something(values: &[f64]) -> bool {
    values.iter().any(|value| *value > 0.0)
}

/// The force spectrum in dB below its largest value: how far the hammer reaches.
fn draw_force(
    drawing: &mut Drawing,
    spectra: &SpectraFigure,
    force: &[f64],
    (top, bottom): (f64, f64),
) -> Panel {
    let largest = extent(force.iter().copied()).map_or(1.0, |range| range.1);
    let decibels: Vec<f64> = force
        .iter()
        .map(|value| 20.0 * (value / largest).max(1e-6).log10())
        .collect();
    let lowest = extent(decibels.iter().copied()).map_or(-20.0, |range| range.0);
    let floor = (lowest / 10.0).floor().clamp(-8.0, -1.0) * 10.0;
    let panel = Panel {
        x: frequency_axis(spectra),
        y: Axis::linear((floor - 2.0, 4.0), (bottom, top)),
    };
    panel.draw_y_ticks(drawing, &panel.y.ticks(30.0));
    panel.draw_x_ticks(drawing, &panel.x.ticks(X_SPACING));
    panel.draw_frame(drawing);
    panel.draw_y_title(drawing, "force (dB)");
    panel.draw_curve(
        drawing,
        over_lines(spectra, &decibels),
        Stroke::new(SOFT, 1.5),
    );
    let words = format!(
        "force: dB below its largest value, {} {}",
        significant(largest, 3),
        spectra.force_unit
    );
    drawing.text(Text::new(words, (LEFT + 10.0, bottom - 13.0), TICK_SIZE).colored(SOFT));
    panel
}

/// The colour of frequencies between the lines, shared with the close-ups.
pub const INTERPOLATED: super::palette::Color = VERMILION;
