//! The picture of a recording's frequency response functions: magnitude over phase.

use super::super::figures::{FrfCurve, RecordingFigure, SpectraFigure};
use super::axis::{Axis, Tick};
use super::drawing::{Drawing, Stroke};
use super::marks::{STRIP, draw_marks};
use super::palette::{BLUE, ORANGE, curve};
use super::panel::{Panel, Sample, X_SPACING, draw_legend, draw_title};
use super::spectrum::{
    LEFT, RIGHT, WIDTH, draw_x_grid, frequency_axis, magnitude_axis, over_lines, subtitle,
};

/// Phase steps above this many degrees are the wrap at 180 degrees, where no line is drawn.
const WRAP: f64 = 180.0;
/// Height of one magnitude panel (pixels).
const MAGNITUDE: f64 = 320.0;
/// Height of the phase panel (pixels).
const PHASE: f64 = 150.0;

/// The frequency response functions of a recording; `None` without a hammer or without taps.
pub fn draw_frf(figure: &RecordingFigure) -> Option<Drawing> {
    let spectra = figure.spectra.as_ref()?;
    let groups = by_unit(&spectra.frfs);
    if groups.is_empty() {
        return None;
    }
    let top = 98.0 + STRIP;
    let phase_top = top + groups.len() as f64 * (MAGNITUDE + 18.0);
    let height = phase_top + PHASE + 60.0;
    let description = format!("Frequency response functions of {}", figure.file);
    let mut drawing = Drawing::new(description, WIDTH, height as u32);
    let title = format!("Frequency response functions, {}", figure.file);
    draw_title(&mut drawing, &title, &subtitle(spectra));
    for (index, group) in groups.iter().enumerate() {
        let panel_top = top + index as f64 * (MAGNITUDE + 18.0);
        let panel = draw_magnitude(&mut drawing, spectra, group, panel_top);
        if index == 0 {
            draw_marks(&mut drawing, &panel, &spectra.peaks);
        }
        for (color, frf) in group {
            let stroke = Stroke::new(curve(*color), 1.5);
            panel.draw_curve(&mut drawing, over_lines(spectra, &frf.magnitude), stroke);
        }
    }
    draw_phase(&mut drawing, spectra, phase_top);
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(spectra));
    Some(drawing)
}

/// Curves with their colour's index, one group for each form and unit.
fn by_unit(frfs: &[FrfCurve]) -> Vec<Vec<(usize, &FrfCurve)>> {
    let mut groups: Vec<Vec<(usize, &FrfCurve)>> = Vec::new();
    for (index, frf) in frfs.iter().enumerate() {
        let same = groups.iter_mut().find(|group| {
            group
                .first()
                .is_some_and(|(_, first)| first.unit == frf.unit && first.form == frf.form)
        });
        match same {
            Some(group) => group.push((index, frf)),
            None => groups.push(vec![(index, frf)]),
        }
    }
    groups
}

fn draw_magnitude(
    drawing: &mut Drawing,
    spectra: &SpectraFigure,
    group: &[(usize, &FrfCurve)],
    top: f64,
) -> Panel {
    let curves = group.iter().map(|(_, frf)| frf.magnitude.as_slice());
    let panel = Panel {
        x: frequency_axis(spectra),
        y: magnitude_axis(curves, (top + MAGNITUDE, top)),
    };
    panel.draw_y_ticks(drawing, &panel.y.ticks(40.0));
    draw_x_grid(drawing, &panel);
    panel.draw_frame(drawing);
    if let Some((_, first)) = group.first() {
        panel.draw_y_title(drawing, &format!("{} ({})", first.form, first.unit));
    }
    panel
}

fn draw_phase(drawing: &mut Drawing, spectra: &SpectraFigure, top: f64) {
    let panel = Panel {
        x: frequency_axis(spectra),
        y: Axis::linear((-190.0, 190.0), (top + PHASE, top)),
    };
    let ticks = [-180.0, -90.0, 0.0, 90.0, 180.0].map(|value: f64| Tick {
        value,
        label: Some(format!("{value:.0}").replace('-', "\u{2212}")),
    });
    panel.draw_y_ticks(drawing, &ticks);
    panel.draw_x_ticks(drawing, &panel.x.ticks(X_SPACING));
    panel.draw_frame(drawing);
    for (index, frf) in spectra.frfs.iter().enumerate() {
        for piece in unwrapped_pieces(spectra, &frf.phase) {
            panel.draw_curve(drawing, piece, Stroke::new(curve(index), 1.2));
        }
    }
    panel.draw_y_title(drawing, "phase (\u{b0})");
    panel.draw_x_title(drawing, "frequency (Hz)");
}

/// The phase cut where it wraps, so that no line runs from -180 to 180 degrees.
fn unwrapped_pieces(spectra: &SpectraFigure, phase: &[f64]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    let mut previous: Option<f64> = None;
    for (frequency, value) in over_lines(spectra, phase) {
        if previous.is_some_and(|last| (value - last).abs() > WRAP) {
            pieces.push(Vec::new());
        }
        previous = Some(value);
        if let Some(piece) = pieces.last_mut() {
            piece.push((frequency, value));
        }
    }
    pieces
}

fn legend(spectra: &SpectraFigure) -> Vec<(Sample, String)> {
    let mut entries: Vec<(Sample, String)> = spectra
        .frfs
        .iter()
        .enumerate()
        .map(|(index, frf)| {
            let words = format!("{}, {}", frf.name, frf.form);
            (Sample::Line(curve(index)), words)
        })
        .collect();
    if spectra.peaks.iter().any(|peak| peak.mode.is_some()) {
        entries.push((Sample::Dashed(BLUE), "mode".to_owned()));
    }
    if spectra.peaks.iter().any(|peak| peak.mode.is_none()) {
        entries.push((Sample::Dashed(ORANGE), "mains or other, no mode".to_owned()));
    }
    entries
}
