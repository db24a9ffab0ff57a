//! Resonances and mains lines marked in a spectrum.

use super::super::figures::PeakMark;
use super::drawing::{Align, Drawing, Stroke, Text};
use super::font::{Weight, text_width};
use super::labels::spread;
use super::palette::{BLUE, Color, INK, ORANGE, SOFT};
use super::panel::{Panel, TICK_SIZE, crisp};

/// Height of the strip above a panel that labels and their leaders need (pixels).
pub const STRIP: f64 = 62.0;
/// Farthest a label stands from its mark (pixels): beyond it the leaders run almost flat.
const FARTHEST: f64 = 140.0;
/// Least space between two labels (pixels).
const GAP: f64 = 14.0;

/// Colour of a mark: modes blue, everything else orange.
pub fn color(peak: &PeakMark) -> Color {
    if peak.mode.is_some() { BLUE } else { ORANGE }
}

/// Draws a mark with its half-line band for every peak on the axis, and labels above the panel.
/// Returns how many marks had no room for a label.
pub fn draw_marks(drawing: &mut Drawing, panel: &Panel, peaks: &[PeakMark]) -> usize {
    let visible: Vec<&PeakMark> = sorted(peaks, panel);
    for peak in &visible {
        draw_mark(drawing, panel, peak);
    }
    let (labelled, centers) = chosen_labels(panel, &visible);
    for (peak, center) in labelled.iter().zip(centers) {
        draw_label(drawing, panel, peak, center);
    }
    visible.len() - labelled.len()
}

/// Peaks on the axis in order of frequency.
fn sorted<'a>(peaks: &'a [PeakMark], panel: &Panel) -> Vec<&'a PeakMark> {
    let mut visible: Vec<&PeakMark> = peaks
        .iter()
        .filter(|peak| panel.x.holds(peak.frequency))
        .collect();
    visible.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    visible
}

fn draw_mark(drawing: &mut Drawing, panel: &Panel, peak: &PeakMark) {
    let (low, high) = (
        peak.line_frequency - peak.half_line,
        peak.line_frequency + peak.half_line,
    );
    panel.draw_band(drawing, (low, high), color(peak));
    let x = crisp(panel.x.place(peak.frequency));
    let mut stroke = Stroke::new(color(peak), 1.0);
    stroke.opacity = 0.75;
    let pattern = if peak.mode.is_some() {
        (6.0, 4.0)
    } else {
        (2.0, 4.0)
    };
    drawing.dashed((x, panel.y.to), (x, panel.y.from), pattern, stroke);
}

/// The two lines of a label.
fn words(peak: &PeakMark) -> [String; 2] {
    let name = match (peak.mode, &peak.label) {
        (Some(mode), _) => format!("mode {mode}"),
        (None, Some(label)) => label.clone(),
        (None, None) => "no mode".to_owned(),
    };
    [name, frequency(peak)]
}

/// The frequency with one digit more than its half-line bound.
pub fn frequency(peak: &PeakMark) -> String {
    let bound = peak.half_line / 5.0;
    let decimals = if bound > 0.0 {
        (-bound.log10().floor()).clamp(0.0, 5.0) as usize
    } else {
        2
    };
    format!("{:.decimals$} Hz", peak.frequency)
}

/// The peaks that get a label, and the labels' centres (pixels): modes before others, the most
/// prominent first, each kept if all still have room near their marks.
fn chosen_labels<'a>(panel: &Panel, visible: &[&'a PeakMark]) -> (Vec<&'a PeakMark>, Vec<f64>) {
    let mut candidates = visible.to_vec();
    candidates.sort_by(|a, b| {
        let others_last = a.mode.is_none().cmp(&b.mode.is_none());
        others_last.then(b.prominence_db.total_cmp(&a.prominence_db))
    });
    let mut best = (Vec::new(), Vec::new());
    for candidate in candidates {
        let mut labelled = best.0.clone();
        let place =
            labelled.partition_point(|peak: &&PeakMark| peak.frequency <= candidate.frequency);
        labelled.insert(place, candidate);
        if let Some(centers) = placed(panel, &labelled) {
            best = (labelled, centers);
        }
    }
    best
}

/// Centres of the labels (pixels), or `None` where one would stand too far from its mark.
fn placed(panel: &Panel, peaks: &[&PeakMark]) -> Option<Vec<f64>> {
    let wishes: Vec<f64> = peaks
        .iter()
        .map(|peak| panel.x.place(peak.frequency))
        .collect();
    let widths: Vec<f64> = peaks.iter().map(|peak| label_width(peak)).collect();
    let bounds = (panel.x.from - 40.0, panel.x.to + 14.0);
    let near = |centers: &Vec<f64>| {
        let mut moves = centers.iter().zip(&wishes);
        moves.all(|(center, wish)| (center - wish).abs() <= FARTHEST)
    };
    spread(&wishes, &widths, GAP, bounds).filter(near)
}

fn draw_label(drawing: &mut Drawing, panel: &Panel, peak: &PeakMark, center: f64) {
    let wish = crisp(panel.x.place(peak.frequency));
    let top = panel.y.to;
    let [name, frequency] = words(peak);
    let ink = if peak.mode.is_some() { INK } else { SOFT };
    let first = Text::new(name, (center, top - 52.0), TICK_SIZE).colored(color(peak));
    drawing.text(first.bold().aligned(Align::Middle));
    let second = Text::new(frequency, (center, top - 36.0), TICK_SIZE).colored(ink);
    drawing.text(second.aligned(Align::Middle));
    let leader = vec![
        (center, top - 26.0),
        (center, top - 22.0),
        (wish, top - 4.0),
        (wish, top),
    ];
    drawing.line(leader, Stroke::new(color(peak), 1.0));
}

fn label_width(peak: &PeakMark) -> f64 {
    let [name, frequency] = words(peak);
    text_width(&name, TICK_SIZE, Weight::Bold).max(text_width(
        &frequency,
        TICK_SIZE,
        Weight::Regular,
    ))
}
