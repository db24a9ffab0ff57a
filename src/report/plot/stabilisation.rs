//! The stabilisation diagram: poles of every order over frequency, the level behind them, and the modes.

use super::super::figures::{
    PoleMark, RecordingFigure, SpectraFigure, StabilisationBand, StabilisationFigure,
};
use super::super::format::trimmed;
use super::axis::{Axis, Tick};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::font::fitted;
use super::marks::{STRIP, draw_marks};
use super::palette::{BLUE, Color, GREEN, INK, ORANGE, PURPLE, SKY, SOFT};
use super::panel::{
    LABEL_SIZE, Panel, Sample, TICK_SIZE, X_SPACING, crisp, draw_legend, draw_title,
};
use super::spectrum::{LEFT, RIGHT, WIDTH, frequency_axis, magnitude_axis, over_lines};
use tapjoint_signal::modal::polyreference::PoleStability;

/// Upper end of the panel of the whole band (pixels).
const TOP: f64 = 98.0 + STRIP;
/// Height of that panel (pixels).
const HEIGHT: f64 = 400.0;
/// Most narrow bands drawn.
const MOST: usize = 8;
/// Narrow bands side by side.
const COLUMNS: usize = 4;
/// Height of a narrow band's panel, and of its row with heading and labels (pixels).
const BAND_HEIGHT: f64 = 150.0;
const ROW: f64 = 208.0;
/// Share of a panel's height that the level behind fills.
const LEVEL_SHARE: f64 = 0.96;
/// Radius of a pole in the wide panel and in a narrow one (pixels).
const WIDE_RADIUS: f64 = 3.2;
const NARROW_RADIUS: f64 = 2.6;
/// The level is drawn faint: the poles are what matters.
const FAINT: Color = Color(178, 186, 196);

/// Classes from the best to the worst, with words for the legend.
pub(crate) const CLASSES: [(PoleStability, &str); 5] = [
    (PoleStability::All, "stable: frequency and damping"),
    (
        PoleStability::FrequencyAndDamping,
        "frequency and damping, not vector",
    ),
    (PoleStability::FrequencyAndVector, "frequency and vector"),
    (PoleStability::Frequency, "frequency only"),
    (PoleStability::New, "new"),
];

/// The stabilisation diagram of a recording; `None` where no pole was found.
pub fn draw_stabilisation(figure: &RecordingFigure) -> Option<Drawing> {
    let spectra = figure.spectra.as_ref()?;
    let found = figure.stabilisation.as_ref()?;
    let (whole, narrow) = found.bands.split_first()?;
    if found.bands.iter().all(|band| band.poles.is_empty()) {
        return None;
    }
    let shown = narrow.len().min(MOST);
    let axis_bottom = TOP + HEIGHT + 54.0;
    let rows = shown.div_ceil(COLUMNS);
    let height = axis_bottom
        + if rows > 0 {
            34.0 + rows as f64 * ROW
        } else {
            0.0
        };
    let name = format!("Stabilisation diagram, {}", figure.file);
    let mut drawing = Drawing::new(name.as_str(), WIDTH, height as u32);
    draw_title(&mut drawing, &name, &below(found));
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(found));
    draw_whole(&mut drawing, (spectra, found), whole);
    if rows > 0 {
        draw_heading(&mut drawing, (shown, narrow.len()), axis_bottom + 14.0);
    }
    for (index, band) in narrow.iter().take(MOST).enumerate() {
        let width = (RIGHT - LEFT + 40.0) / COLUMNS as f64;
        let left = LEFT + (index % COLUMNS) as f64 * width;
        let top = axis_bottom + 56.0 + (index / COLUMNS) as f64 * ROW;
        draw_narrow(
            &mut drawing,
            (spectra, found),
            band,
            (left, left + width - 40.0, top),
        );
    }
    Some(drawing)
}

fn below(found: &StabilisationFigure) -> String {
    let poles: usize = found.bands.iter().map(|band| band.poles.len()).sum();
    let whole = found.bands.first().map_or(0, |band| band.order);
    format!(
        "{poles} poles of the polyreference fit, orders up to {whole} \u{b7} a mode returns at the same \
         frequency and damping at order after order; poles of noise scatter"
    )
}

fn legend(found: &StabilisationFigure) -> Vec<(Sample, String)> {
    let poles = || found.bands.iter().flat_map(|band| &band.poles);
    let mut entries: Vec<(Sample, String)> = CLASSES
        .iter()
        .filter(|(class, _)| poles().any(|pole| pole.stability == *class))
        .map(|(class, words)| (sample(*class), (*words).to_owned()))
        .collect();
    entries.push((Sample::Line(FAINT), "level (log)".to_owned()));
    entries.push((Sample::Dashed(BLUE), "mode".to_owned()));
    entries.push((Sample::Line(INK), "selected (lower edge)".to_owned()));
    entries
}

fn sample(class: PoleStability) -> Sample {
    match class {
        PoleStability::All => Sample::Dot(GREEN),
        PoleStability::FrequencyAndDamping => Sample::Ring(SKY),
        PoleStability::FrequencyAndVector => Sample::Ring(PURPLE),
        PoleStability::Frequency => Sample::Ring(ORANGE),
        PoleStability::New => Sample::Cross(SOFT),
    }
}

fn draw_whole(
    drawing: &mut Drawing,
    (spectra, found): (&SpectraFigure, &StabilisationFigure),
    band: &StabilisationBand,
) {
    let panel = Panel {
        x: frequency_axis(spectra),
        y: order_axis(band, (TOP + HEIGHT, TOP)),
    };
    panel.draw_x_ticks(drawing, &panel.x.ticks(X_SPACING));
    panel.draw_y_ticks(drawing, &whole_numbers(&panel.y, 40.0));
    draw_level(drawing, &panel, spectra);
    draw_marks(drawing, &panel, &spectra.peaks);
    draw_selected(drawing, &panel, found);
    draw_poles(drawing, &panel, band, WIDE_RADIUS);
    panel.draw_frame(drawing);
    panel.draw_x_title(drawing, "frequency (Hz)");
    panel.draw_y_title(drawing, "order");
}

fn draw_heading(drawing: &mut Drawing, (shown, all): (usize, usize), y: f64) {
    let words = if shown < all {
        format!("Bands about groups of peaks, the first {shown} of {all}")
    } else {
        "Bands about groups of peaks, each fitted by itself".to_owned()
    };
    drawing.text(Text::new(words, (LEFT, y), LABEL_SIZE).bold());
}

/// One narrow band over the part of it from which modes are taken.
fn draw_narrow(
    drawing: &mut Drawing,
    (spectra, found): (&SpectraFigure, &StabilisationFigure),
    band: &StabilisationBand,
    (left, right, top): (f64, f64, f64),
) {
    let panel = Panel {
        x: Axis::linear(band.core, (left, right)),
        y: order_axis(band, (top + BAND_HEIGHT, top)),
    };
    panel.draw_x_ticks(drawing, &panel.x.ticks(48.0));
    panel.draw_y_ticks(drawing, &whole_numbers(&panel.y, 34.0));
    draw_level(drawing, &panel, spectra);
    for peak in spectra
        .peaks
        .iter()
        .filter(|peak| panel.x.holds(peak.frequency))
    {
        let x = crisp(panel.x.place(peak.frequency));
        let color = super::marks::color(peak);
        drawing.dashed(
            (x, panel.y.to),
            (x, panel.y.from),
            (6.0, 4.0),
            Stroke::new(color, 1.0),
        );
    }
    draw_selected(drawing, &panel, found);
    draw_poles(drawing, &panel, band, NARROW_RADIUS);
    panel.draw_frame(drawing);
    let words = fitted(&named(spectra, band), TICK_SIZE, right - left);
    let at = (0.5 * (left + right), top - 12.0);
    drawing.text(Text::new(words, at, TICK_SIZE).aligned(Align::Middle));
}

/// "modes 1, 2 · 40 to 60 Hz".
pub(crate) fn named(spectra: &SpectraFigure, band: &StabilisationBand) -> String {
    let (low, high) = band.core;
    let within = |frequency: f64| (low..=high).contains(&frequency);
    let numbers: Vec<String> = spectra
        .peaks
        .iter()
        .filter(|peak| within(peak.frequency))
        .filter_map(|peak| Some(peak.mode?.to_string()))
        .collect();
    let modes = match numbers.len() {
        0 => String::new(),
        1 => format!("mode {} \u{b7} ", numbers.join("")),
        _ => format!("modes {} \u{b7} ", numbers.join(", ")),
    };
    format!("{modes}{} to {} Hz", trimmed(low, 4), trimmed(high, 4))
}

/// From 0 to just above the highest order.
fn order_axis(band: &StabilisationBand, pixels: (f64, f64)) -> Axis {
    Axis::linear((0.0, band.order as f64 + 1.0), pixels)
}

/// Ticks at whole orders only.
fn whole_numbers(axis: &Axis, spacing: f64) -> Vec<Tick> {
    let mut ticks = axis.ticks(spacing);
    ticks.retain(|tick| tick.value.fract().abs() < 1e-9);
    ticks
}

fn draw_level(drawing: &mut Drawing, panel: &Panel, spectra: &SpectraFigure) {
    let band = (panel.x.low, panel.x.high);
    let points = level(spectra, band, panel.y.high);
    panel.draw_curve(drawing, points, Stroke::new(FAINT, 1.3));
}

/// The largest level of all frequency response functions, or without a hammer of all responses, each
/// over its own highest value: its logarithm fills the panel up to the order `top`.
pub(crate) fn level(spectra: &SpectraFigure, band: (f64, f64), top: f64) -> Vec<(f64, f64)> {
    let curves: Vec<&[f64]> = if spectra.frfs.is_empty() {
        spectra
            .responses
            .iter()
            .map(|curve| curve.values.as_slice())
            .collect()
    } else {
        spectra
            .frfs
            .iter()
            .map(|frf| frf.magnitude.as_slice())
            .collect()
    };
    let level = composite(&curves);
    let visible: Vec<(f64, f64)> = over_lines(spectra, &level)
        .filter(|(frequency, value)| (band.0..=band.1).contains(frequency) && value.is_finite())
        .collect();
    let values: Vec<f64> = visible.iter().map(|(_, value)| *value).collect();
    let scale = magnitude_axis([values.as_slice()], (0.0, LEVEL_SHARE * top));
    let placed = visible
        .into_iter()
        .map(|(x, value)| (x, scale.place(value)));
    placed.collect()
}

/// On each line the largest of the curves, each relative to its own highest value.
fn composite(curves: &[&[f64]]) -> Vec<f64> {
    let points = curves.iter().map(|curve| curve.len()).max().unwrap_or(0);
    let mut level = vec![0.0; points];
    for curve in curves {
        let highest = curve
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .fold(0.0, f64::max);
        if highest > 0.0 {
            for (most, value) in level.iter_mut().zip(*curve) {
                // The larger of the two: f64::max passes over what is no number.
                *most = f64::max(*most, value / highest);
            }
        }
    }
    level
}

/// The frequencies that any band selected, as short lines at the lower edge.
fn draw_selected(drawing: &mut Drawing, panel: &Panel, found: &StabilisationFigure) {
    let selected = found.bands.iter().flat_map(|band| &band.selected);
    for frequency in selected.filter(|frequency| panel.x.holds(**frequency)) {
        let x = crisp(panel.x.place(*frequency));
        let ends = vec![(x, panel.y.from), (x, panel.y.from - 10.0)];
        drawing.line(ends, Stroke::new(INK, 1.6));
    }
}

/// The poles, the best class last and so on top.
fn draw_poles(drawing: &mut Drawing, panel: &Panel, band: &StabilisationBand, radius: f64) {
    for (class, _) in CLASSES.iter().rev() {
        let of_class = band.poles.iter().filter(|pole| pole.stability == *class);
        for pole in of_class.filter(|pole| panel.x.holds(pole.frequency)) {
            draw_pole(drawing, panel, pole, radius);
        }
    }
}

fn draw_pole(drawing: &mut Drawing, panel: &Panel, pole: &PoleMark, radius: f64) {
    let at = panel.place(pole.frequency, pole.order as f64);
    match sample(pole.stability) {
        Sample::Dot(color) => drawing.dot(at, radius, color),
        Sample::Ring(color) => drawing.ring(at, radius, color),
        _ => {
            let mut stroke = Stroke::new(SOFT, 1.0);
            stroke.opacity = 0.7;
            drawing.cross(at, 0.75 * radius, stroke);
        }
    }
}
