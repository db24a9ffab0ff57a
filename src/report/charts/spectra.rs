//! Averaged spectra and frequency response functions of a recording, with their resonances.

use super::super::chart::axis::{extent, nice_step};
use super::super::chart::{Axis, Block, Chart, Color, InPage, Mark, Panel, Rule, Series};
use super::super::figures::{Curve, FrfCurve, PeakMark, RecordingFigure, SpectraFigure};
use super::super::format::{significant, trimmed};
use super::HIGH;

/// Smallest magnitude shown, relative to the largest: 140 dB.
const DEEPEST: f64 = 1e-7;
/// How far beyond the highest peak a shortened axis goes, in shares of the peak's frequency.
const PAST_HIGHEST: f64 = 1.25;
/// An axis is shortened when that hides more than the rest of this share of the band.
const MOST_SHOWN_PART: f64 = 0.6;
/// Opacity of curves of other estimators.
const FAINT: f64 = 0.4;
/// Most close-ups in one row; more would be too narrow to read.
const MOST_CLOSE_UPS: usize = 6;
/// Lines shown on each side of a close-up's peak.
const SIDE: f64 = 6.0;
/// Depth shown below a close-up's peak (dB).
const DEPTH: f64 = 30.0;

/// The spectra of a recording; `None` when no tap was accepted, and where only functions are known.
pub fn spectrum(figure: &RecordingFigure) -> Option<Chart> {
    let spectra = figure.spectra.as_ref()?;
    let mut groups: Vec<Vec<(usize, &Curve)>> = Vec::new();
    for (index, curve) in spectra.responses.iter().enumerate() {
        match groups
            .iter_mut()
            .find(|group| group[0].1.unit == curve.unit)
        {
            Some(group) => group.push((index, curve)),
            None => groups.push(vec![(index, curve)]),
        }
    }
    let mut panels = Vec::new();
    for group in &groups {
        let axis = magnitude_axis(group.iter().map(|(_, curve)| curve.values.as_slice()));
        let axis = axis.of("magnitude, rms", group[0].1.unit.as_str());
        let series = group.iter().map(|(index, curve)| {
            let color = Color::curve(*index);
            over_lines(spectra, &curve.name, color, curve.values.clone())
        });
        panels.push(Panel::new(HIGH, frequency_axis(spectra), axis).with(series));
    }
    if panels.is_empty() {
        return None;
    }
    panels.extend(force_panel(spectra));
    for panel in &mut panels {
        panel.rules = rules(spectra);
    }
    let file = &figure.file;
    Some(Chart {
        kind: "spectrum",
        title: format!("Averaged spectra, {file}"),
        subtitle: subtitle(spectra),
        caption: format!("Averaged spectra of {file} with the resonances found."),
        blocks: [Block::new(1, panels)]
            .into_iter()
            .chain(close_ups(spectra))
            .collect(),
        ..Chart::default()
    })
}

/// The frequency response functions of a recording; `None` without a hammer or without taps.
pub fn frf(figure: &RecordingFigure) -> Option<Chart> {
    let spectra = figure.spectra.as_ref()?;
    let mut groups: Vec<Vec<(usize, &FrfCurve)>> = Vec::new();
    for (index, frf) in spectra.frfs.iter().enumerate() {
        let kind = (&frf.form, &frf.unit);
        let same =
            |group: &&mut Vec<(usize, &FrfCurve)>| (&group[0].1.form, &group[0].1.unit) == kind;
        match groups.iter_mut().find(same) {
            Some(group) => group.push((index, frf)),
            None => groups.push(vec![(index, frf)]),
        }
    }
    let x = || frequency_axis(spectra);
    let mut panels = Vec::new();
    for group in &groups {
        let axis = magnitude_axis(group.iter().map(|(_, frf)| frf.magnitude.as_slice()));
        let axis = axis.of(group[0].1.form.as_str(), group[0].1.unit.as_str());
        let mut series = Vec::new();
        for (index, frf) in group {
            let color = Color::curve(*index);
            for (estimator, magnitude) in &frf.others {
                let name = format!("{}, {estimator}", frf.name);
                let mut other = over_lines(spectra, &name, color, magnitude.clone());
                other.mark = Mark::Line(1.0);
                other.opacity = FAINT;
                series.push(other);
            }
            let name = format!("{}, {}", frf.name, frf.estimator);
            series.push(over_lines(spectra, &name, color, frf.magnitude.clone()));
        }
        // The estimator that is meant gives the colour its name.
        series.sort_by(|a, b| b.opacity.total_cmp(&a.opacity));
        panels.push(Panel::new(HIGH, x(), axis).with(series));
    }
    if panels.is_empty() {
        return None;
    }
    let mut axis = Axis::linear(-190.0, 190.0).of("phase", "\u{b0}");
    axis.period = Some(360.0);
    let phases = [-180.0, -90.0, 0.0, 90.0, 180.0];
    axis = axis.named(
        phases.map(|degrees: f64| (degrees, format!("{degrees:.0}").replace('-', "\u{2212}"))),
    );
    let frfs = || spectra.frfs.iter().enumerate();
    let series = frfs()
        .map(|(index, frf)| over_lines(spectra, &frf.name, Color::curve(index), frf.phase.clone()));
    panels.push(Panel::new(150.0, x(), axis).with(series));
    let coherent = spectra.frfs.iter().any(|frf| frf.coherence.is_some());
    if coherent {
        let series = frfs().filter_map(|(index, frf)| {
            let values = frf.coherence.clone()?;
            Some(over_lines(spectra, &frf.name, Color::curve(index), values))
        });
        let axis = Axis::linear(0.0, 1.05).of("coherence", "");
        panels.push(Panel::new(120.0, x(), axis).with(series));
    }
    for panel in &mut panels {
        panel.rules = rules(spectra);
    }
    let mut below = subtitle(spectra);
    if !coherent {
        let why = if spectra.averages == 1 {
            "one average: "
        } else {
            ""
        };
        below.push_str(&format!(" \u{b7} {why}no coherence"));
    }
    if let Some(frf) = spectra.frfs.iter().find(|frf| !frf.others.is_empty()) {
        let names: Vec<&str> = frf.others.iter().map(|(name, _)| name.as_str()).collect();
        below.push_str(&format!(" \u{b7} faint: {}", names.join(", ")));
    }
    let file = &figure.file;
    Some(Chart {
        kind: "frf",
        title: format!("Frequency response functions, {file}"),
        subtitle: below,
        caption: format!("Response per force (H1) of {file}, magnitude, phase and coherence."),
        blocks: vec![Block::new(1, panels)],
        ..Chart::default()
    })
}

/// A curve over the spectral lines.
pub(super) fn over_lines(
    spectra: &SpectraFigure,
    name: &str,
    color: Color,
    values: Vec<f64>,
) -> Series {
    let lines = &spectra.lines;
    Series::even(name, color, lines.frequency(0), lines.spacing, values)
}

/// Averages, block, lines, spacing and resolution in words.
fn subtitle(spectra: &SpectraFigure) -> String {
    let lines = &spectra.lines;
    let end = shown_to(spectra);
    let shown = if end < lines.high {
        let (end, all) = (trimmed(end, 6), trimmed(lines.high, 6));
        format!(" \u{b7} shown to {end} of {all} Hz")
    } else {
        String::new()
    };
    let spacing = trimmed(lines.spacing, 4);
    if spectra.averages == 0 {
        return format!(
            "as the file holds them \u{b7} {} lines \u{b7} line spacing {spacing} Hz{shown}",
            lines.points()
        );
    }
    let taps = if spectra.averages == 1 { "tap" } else { "taps" };
    format!(
        "{} {taps} averaged \u{b7} block {} samples, {} lines \u{b7} line spacing {spacing} Hz \u{b7} resolution 1/T = {} Hz{shown}",
        spectra.averages,
        lines.block,
        lines.displayed(),
        trimmed(lines.resolution(), 4),
    )
}

/// The horizontal axis of a recording's spectra.
pub(super) fn frequency_axis(spectra: &SpectraFigure) -> Axis {
    Axis::linear(spectra.lines.low, shown_to(spectra)).of("frequency", "Hz")
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

/// A logarithmic axis that shows all positive values down to 140 dB below the largest.
pub(super) fn magnitude_axis<'a>(curves: impl Iterator<Item = &'a [f64]>) -> Axis {
    let all = curves.flatten().copied().filter(|value| *value > 0.0);
    let all: Vec<f64> = all.collect();
    let high = extent(all.iter().copied()).map_or(1.0, |range| range.1);
    let shown = all.into_iter().filter(|value| *value >= DEEPEST * high);
    let low = extent(shown).map_or(1e-3, |range| range.0);
    Axis::logarithmic(low / 1.4, high * 1.6)
}

/// The force's spectrum in dB below its largest value: how far the hammer reaches; `None` without a force.
fn force_panel(spectra: &SpectraFigure) -> Option<Panel> {
    let force = spectra.force.as_deref()?;
    let largest = extent(force.iter().copied())?.1;
    if largest <= 0.0 {
        return None;
    }
    let decibels = force.iter().map(|value| decibels(value / largest));
    let decibels: Vec<f64> = decibels.collect();
    let lowest = extent(decibels.iter().copied()).map_or(-20.0, |range| range.0);
    let floor = (lowest / 10.0).floor().clamp(-8.0, -1.0) * 10.0;
    let axis = Axis::linear(floor - 2.0, 4.0).of("force", "dB");
    let unit = &spectra.force_unit;
    let name = format!(
        "force, dB below its largest of {} {unit}",
        significant(largest, 3)
    );
    let series = over_lines(spectra, &name, Color::Soft, decibels);
    Some(Panel::new(114.0, frequency_axis(spectra), axis).with([series]))
}

/// Level of a ratio of amplitudes (dB), at least -120.
fn decibels(ratio: f64) -> f64 {
    20.0 * ratio.max(1e-6).log10()
}

/// The resonances as marks on the frequency axis.
pub(super) fn rules(spectra: &SpectraFigure) -> Vec<Rule> {
    let known = spectra
        .peaks
        .iter()
        .filter(|peak| peak.frequency.is_finite());
    known.map(rule).collect()
}

fn rule(peak: &PeakMark) -> Rule {
    Rule {
        at: peak.frequency,
        line: peak.line_frequency,
        half: peak.half_line,
        name: match (peak.mode, &peak.label) {
            (Some(mode), _) => format!("mode {mode}"),
            (None, Some(label)) => label.clone(),
            (None, None) => "no mode".to_owned(),
        },
        words: frequency_words(peak),
        mode: peak.mode.is_some(),
        prominence: peak.prominence_db,
    }
}

/// The frequency with one digit more than its half-line bound.
fn frequency_words(peak: &PeakMark) -> String {
    let bound = peak.half_line / 5.0;
    let decimals = if bound > 0.0 {
        (-bound.log10().floor()).clamp(0.0, 5.0) as usize
    } else {
        2
    };
    format!("{:.decimals$} Hz", peak.frequency)
}

/// Close-ups of the modes: the single lines, the bound of the reading, and the frequency between the lines. The
/// page needs none: it zooms.
fn close_ups(spectra: &SpectraFigure) -> Option<Block> {
    let modes = spectra.peaks.iter().filter(|peak| peak.mode.is_some());
    let modes: Vec<&PeakMark> = modes.filter(|peak| peak.frequency.is_finite()).collect();
    if modes.is_empty() {
        return None;
    }
    let shown = modes.iter().take(MOST_CLOSE_UPS);
    let panels: Vec<Panel> = shown.map(|peak| close_up(spectra, peak)).collect();
    let name = if modes.len() > MOST_CLOSE_UPS {
        format!(
            "Close-ups, the first {MOST_CLOSE_UPS} of {} modes",
            modes.len()
        )
    } else {
        "Close-ups".to_owned()
    };
    Some(Block {
        name,
        in_page: InPage::Absent,
        ..Block::new(panels.len().max(3), panels)
    })
}

fn close_up(spectra: &SpectraFigure, peak: &PeakMark) -> Panel {
    let center = peak.line_frequency;
    let reach = (SIDE * spectra.lines.spacing).max(2.0 * peak.half_line);
    let decimals = if peak.half_line < 0.05 { 3 } else { 2 };
    let side = significant(reach, 2);
    let x = Axis::linear(center - reach, center + reach);
    let names = [
        (x.low, format!("\u{2212}{side}")),
        (center, format!("{center:.decimals$} Hz")),
        (x.high, format!("+{side}")),
    ];
    let y = Axis::linear(-DEPTH, 4.0).of("level", "dB");
    let mut panel = Panel::new(118.0, x.named(names), y);
    panel.title = peak
        .mode
        .map_or(String::new(), |mode| format!("mode {mode}"));
    panel.rules = vec![rule(peak)];
    for (index, response) in spectra.responses.iter().enumerate() {
        let color = Color::curve(index);
        let curve = over_lines(spectra, "", color, response.values.clone());
        let near = curve
            .pairs()
            .filter(|(at, value)| panel.x.holds(*at) && value.is_finite());
        let near: Vec<(f64, f64)> = near.collect();
        let largest = extent(near.iter().map(|point| point.1)).map_or(1.0, |range| range.1);
        let levels: Vec<(f64, f64)> = near
            .into_iter()
            .map(|(at, value)| (at, decibels(value / largest)))
            .collect();
        // In one colour the legend explains the lines.
        let name = if index == 0 { "spectral line" } else { "" };
        panel = panel.with([
            Series::points("", color, Mark::Line(1.0), levels.iter().copied()),
            Series::points(name, color, Mark::Dot(2.6), levels),
        ]);
    }
    panel
}
