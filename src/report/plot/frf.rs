//! The picture of a recording's frequency response functions: magnitude, phase, coherence.

use super::super::figures::{FrfCurve, RecordingFigure, SpectraFigure};
use super::axis::{Axis, Tick};
use super::drawing::{Drawing, Stroke, Text};
use super::marks::{STRIP, draw_marks};
use super::palette::{BLUE, Color, ORANGE, SOFT, curve};
use super::panel::{LABEL_SIZE, Panel, Sample, X_SPACING, draw_legend, draw_title};
use super::spectrum::{
    LEFT, RIGHT, WIDTH, draw_x_grid, frequency_axis, magnitude_axis, over_lines, subtitle,
};

/// Colour that stands for faint curves in the legend.
const FAINT_SAMPLE: Color = Color(190, 190, 190);
/// Phase steps above this many degrees are the wrap at 180 degrees, where no line is drawn.
const WRAP: f64 = 180.0;
/// Height of one magnitude panel (pixels).
const MAGNITUDE: f64 = 320.0;
/// Height of the phase panel (pixels).
const PHASE: f64 = 150.0;
/// Height of the coherence panel (pixels), and where there is none of the sentence that says so.
const COHERENCE: f64 = 120.0;
const NO_COHERENCE: f64 = 26.0;
/// Space between panels (pixels).
const SPACE: f64 = 18.0;
/// How strongly curves of other estimators show.
const FAINT: f64 = 0.4;

/// The frequency response functions of a recording; `None` without a hammer or without taps.
pub fn draw_frf(figure: &RecordingFigure) -> Option<Drawing> {
    let spectra = figure.spectra.as_ref()?;
    let groups = by_unit(&spectra.frfs);
    if groups.is_empty() {
        return None;
    }
    let top = 98.0 + STRIP;
    let phase_top = top + groups.len() as f64 * (MAGNITUDE + SPACE);
    let coherence_top = phase_top + PHASE + SPACE;
    let coherent = spectra.frfs.iter().any(|frf| frf.coherence.is_some());
    let coherence = if coherent { COHERENCE } else { NO_COHERENCE };
    let height = coherence_top + coherence + 60.0;
    let description = format!("Frequency response functions of {}", figure.file);
    let mut drawing = Drawing::new(description, WIDTH, height as u32);
    let title = format!("Frequency response functions, {}", figure.file);
    draw_title(&mut drawing, &title, &subtitle(spectra));
    for (index, group) in groups.iter().enumerate() {
        let panel_top = top + index as f64 * (MAGNITUDE + SPACE);
        let panel = draw_magnitude(&mut drawing, spectra, group, panel_top);
        if index == 0 {
            draw_marks(&mut drawing, &panel, &spectra.peaks);
        }
        for (color, frf) in group {
            draw_magnitudes(&mut drawing, &panel, spectra, (curve(*color), frf));
        }
    }
    let phase = draw_phase(&mut drawing, spectra, phase_top);
    let lowest = if coherent {
        draw_coherence(&mut drawing, spectra, coherence_top)
    } else {
        say_no_coherence(&mut drawing, spectra, coherence_top);
        phase
    };
    lowest.draw_x_ticks(&mut drawing, &lowest.x.ticks(X_SPACING));
    lowest.draw_x_title(&mut drawing, "frequency (Hz)");
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

/// One function by its estimator, and fainter by the others.
fn draw_magnitudes(
    drawing: &mut Drawing,
    panel: &Panel,
    spectra: &SpectraFigure,
    (color, frf): (Color, &FrfCurve),
) {
    for (_, magnitude) in &frf.others {
        let mut stroke = Stroke::new(color, 1.0);
        stroke.opacity = FAINT;
        panel.draw_curve(drawing, over_lines(spectra, magnitude), stroke);
    }
    let stroke = Stroke::new(color, 1.5);
    panel.draw_curve(drawing, over_lines(spectra, &frf.magnitude), stroke);
}

/// The coherence of every response with the force.
fn draw_coherence(drawing: &mut Drawing, spectra: &SpectraFigure, top: f64) -> Panel {
    let panel = Panel {
        x: frequency_axis(spectra),
        y: Axis::linear((0.0, 1.05), (top + COHERENCE, top)),
    };
    let ticks = [0.0, 0.5, 1.0].map(|value: f64| Tick {
        value,
        label: Some(format!("{value}")),
    });
    panel.draw_y_ticks(drawing, &ticks);
    draw_x_grid(drawing, &panel);
    panel.draw_frame(drawing);
    for (index, frf) in spectra.frfs.iter().enumerate() {
        if let Some(coherence) = &frf.coherence {
            let stroke = Stroke::new(curve(index), 1.2);
            panel.draw_curve(drawing, over_lines(spectra, coherence), stroke);
        }
    }
    panel.draw_y_title(drawing, "coherence");
    panel
}

/// Of one average the coherence is 1 whatever the noise: it is not drawn.
fn say_no_coherence(drawing: &mut Drawing, spectra: &SpectraFigure, top: f64) {
    let words = if spectra.averages == 1 {
        "one average: no coherence"
    } else {
        "no coherence"
    };
    let at = (LEFT, top + 42.0);
    drawing.text(Text::new(words, at, LABEL_SIZE).colored(SOFT));
}

fn draw_phase(drawing: &mut Drawing, spectra: &SpectraFigure, top: f64) -> Panel {
    let panel = Panel {
        x: frequency_axis(spectra),
        y: Axis::linear((-190.0, 190.0), (top + PHASE, top)),
    };
    let ticks = [-180.0, -90.0, 0.0, 90.0, 180.0].map(|value: f64| Tick {
        value,
        label: Some(format!("{value:.0}").replace('-', "\u{2212}")),
    });
    panel.draw_y_ticks(drawing, &ticks);
    draw_x_grid(drawing, &panel);
    panel.draw_frame(drawing);
    for (index, frf) in spectra.frfs.iter().enumerate() {
        for piece in unwrapped_pieces(spectra, &frf.phase) {
            panel.draw_curve(drawing, piece, Stroke::new(curve(index), 1.2));
        }
    }
    panel.draw_y_title(drawing, "phase (\u{b0})");
    panel
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
            let words = format!("{}, {} {}", frf.name, frf.form, frf.estimator);
            (Sample::Line(curve(index)), words)
        })
        .collect();
    if let Some(frf) = spectra.frfs.iter().find(|frf| !frf.others.is_empty()) {
        let names: Vec<&str> = frf.others.iter().map(|(name, _)| name.as_str()).collect();
        let words = format!("faint: {}", names.join(", "));
        entries.push((Sample::Line(FAINT_SAMPLE), words));
    }
    if spectra.peaks.iter().any(|peak| peak.mode.is_some()) {
        entries.push((Sample::Dashed(BLUE), "mode".to_owned()));
    }
    if spectra.peaks.iter().any(|peak| peak.mode.is_none()) {
        entries.push((Sample::Dashed(ORANGE), "mains or other, no mode".to_owned()));
    }
    entries
}
