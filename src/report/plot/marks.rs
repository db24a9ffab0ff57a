//! Resonances and mains lines marked in a spectrum.

use super::super::figures::PeakMark;
use super::drawing::{Align, Drawing, Stroke, Text};
use super::font::{Weight, text_width};
use super::labels::spread;
use super::palette::{BLUE, Color, INK, ORANGE, SOFT};
use super::panel::{Panel, TICK_SIZE, crisp};

/// Height of the strip above a panel that labels and their leaders need (pixels).
pub const STRIP: f64 = 62.0;
/// Largest share of the row that labels fill: beyond it their leaders run almost flat.
const FULLEST: f64 = 0.72;
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
    let mut labelled = visible.clone();
    while !draw_labels(drawing, panel, &labelled) {
        drop_least(&mut labelled);
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

/// Draws all labels, or nothing and `false` where they do not fit.
fn draw_labels(drawing: &mut Drawing, panel: &Panel, peaks: &[&PeakMark]) -> bool {
    let wishes: Vec<f64> = peaks
        .iter()
        .map(|peak| panel.x.place(peak.frequency))
        .collect();
    let widths: Vec<f64> = peaks.iter().map(|peak| label_width(peak)).collect();
    let bounds = (panel.x.from - 40.0, panel.x.to + 14.0);
    let filled: f64 = widths.iter().map(|width| width + GAP).sum();
    if filled > FULLEST * (bounds.1 - bounds.0) {
        return false;
    }
    let Some(centers) = spread(&wishes, &widths, GAP, bounds) else {
        return false;
    };
    let top = panel.y.to;
    for ((peak, wish), center) in peaks.iter().zip(wishes).zip(centers) {
        let [name, frequency] = words(peak);
        let ink = if peak.mode.is_some() { INK } else { SOFT };
        let first = Text::new(name, (center, top - 52.0), TICK_SIZE).colored(color(peak));
        drawing.text(first.bold().aligned(Align::Middle));
        let second = Text::new(frequency, (center, top - 36.0), TICK_SIZE).colored(ink);
        drawing.text(second.aligned(Align::Middle));
        let stroke = Stroke::new(color(peak), 1.0);
        let leader = vec![
            (center, top - 26.0),
            (center, top - 22.0),
            (crisp(wish), top - 4.0),
            (crisp(wish), top),
        ];
        drawing.line(leader, stroke);
    }
    true
}

fn label_width(peak: &PeakMark) -> f64 {
    let [name, frequency] = words(peak);
    text_width(&name, TICK_SIZE, Weight::Bold).max(text_width(
        &frequency,
        TICK_SIZE,
        Weight::Regular,
    ))
}

/// Takes away the label that is missed least: of the peaks that are no modes, else of the modes,
/// the one closest to the peak before it.
fn drop_least(peaks: &mut Vec<&PeakMark>) {
    let any_other = peaks.iter().any(|peak| peak.mode.is_none());
    let distance = |index: usize| {
        let pair = index
            .checked_sub(1)
            .and_then(|before| peaks.get(before..=index));
        match pair {
            Some([before, peak]) => peak.frequency - before.frequency,
            _ => f64::INFINITY,
        }
    };
    let least = (0..peaks.len())
        .rev()
        .filter(|index| !any_other || peaks.get(*index).is_some_and(|peak| peak.mode.is_none()))
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    if let Some(least) = least {
        peaks.remove(least);
    }
}
