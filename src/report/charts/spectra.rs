//! The contents of a recording.
//!
//! Charts of averaged spectra and frequency response functions with their resonances, and of the signal with its taps.

use num_complex::Complex64;

use crate::document::is_strong;
use crate::format::{significant, trimmed, unit_words};
use crate::picture::{
    Axis, Block, Chart, Color, Event, InPage, Mark, Panel, Places, Rule, Series, extent, nice_step,
    padded,
};
use tapjoint_analysis::{CloseUp, Frf, MeasuredSpectra, RecordingResult};
use tapjoint_description::SensorKind;
use tapjoint_signal::modal::{ModeReading, PeakLabel};
use tapjoint_signal::spectral::{FrfEstimator, Lines};
use tapjoint_signal::taps::Tap;

/// Height of a panel that stands alone (pixels).
pub(super) const HIGH: f64 = 340.0;

/// Smallest magnitude shown, relative to the largest: 140 dB.
const DEEPEST: f64 = 1e-7;
/// Upper end of a shortened axis in shares of the peak's frequency.
const PAST_HIGHEST: f64 = 1.25;
/// An axis is shortened when that hides more than the rest of this share of the band.
const MOST_SHOWN_PART: f64 = 0.6;
/// Opacity of curves of other estimators.
const FAINT: f64 = 0.4;
/// Widths (pixels) of a measured curve and of the curve of the fitted modes over it. A thin dark line over a thick coloured
/// one: both are seen where they agree.
const UNDER: f64 = 3.4;
const OVER: f64 = 1.0;
/// Most close-ups in one row; more would be too narrow to read.
const MOST_CLOSE_UPS: usize = 6;
/// Lines shown on each side of a close-up's peak.
const SIDE: f64 = 6.0;
/// The same in half-power widths, where that is more: there a mode is 15 dB below its peak.
const SIDE_WIDTHS: f64 = 3.0;
/// Depth shown below a close-up's peak (dB).
const DEPTH: f64 = 30.0;

/// Returns the spectra of a recording; `None` when no tap was accepted, and where only functions are known.
pub fn spectrum(recording: &RecordingResult, name: &str) -> Option<Chart> {
    let spectra = recording.measurement.spectra.as_ref()?;
    let lines = &spectra.averages.lines;
    let x = frequency_axis(spectra);
    let mut panels = Vec::new();
    let responses = recording.responses.iter().zip(&spectra.averages.responses);
    for (index, (response, values)) in responses.enumerate() {
        let sensed = match response.kind {
            None => "",
            Some(SensorKind::Acceleration) => ", acceleration",
            Some(SensorKind::Velocity) => ", velocity",
            Some(SensorKind::Displacement) => ", displacement",
            Some(SensorKind::Sound) => ", sound pressure",
        };
        let sensed = format!("{}{sensed}", response.name);
        let curve = over_lines(lines, &sensed, Color::curve(index), values.clone());
        let unit = unit_of_transform(&response.unit);
        panel_of(&mut panels, &x, "magnitude, rms", &unit).push(curve);
    }
    if panels.is_empty() {
        return None;
    }
    scale_to_magnitudes(&mut panels);
    panels.extend(force_panel(
        spectra,
        &unit_of_transform(&recording.tap_unit),
    ));
    let rules = rules(recording, spectra);
    for panel in &mut panels {
        panel.rules.clone_from(&rules);
    }
    Some(Chart {
        kind: "spectrum",
        title: format!("Averaged spectra, {name}"),
        subtitle: subtitle(spectra),
        caption: format!("Averaged spectra of {name} with the resonances found."),
        blocks: [Block::new(1, panels)]
            .into_iter()
            .chain(close_ups(spectra, &rules))
            .collect(),
        ..Chart::default()
    })
}

/// Returns the frequency response functions of a recording, other estimators faintly beside those that they are
/// given by; `None` without a hammer or without taps.
pub fn frf(
    recording: &RecordingResult,
    name: &str,
    frfs: &[Frf],
    others: &[FrfEstimator],
) -> Option<Chart> {
    let spectra = recording.measurement.spectra.as_ref()?;
    let mut panels = magnitude_panels(spectra, frfs, others);
    if panels.is_empty() {
        return None;
    }
    let (mut phases, mut coherences) = (Vec::new(), Vec::new());
    let mut fitted_phases = Vec::new();
    for (index, frf) in frfs.iter().enumerate() {
        let (lines, color) = (&spectra.averages.lines, Color::curve(index));
        let measured = over_lines(lines, &frf.response, color, degrees(frf.values()));
        phases.push(under_fit(measured, frf));
        if let Some(fitted) = &frf.fitted {
            let name = fitted_name(frfs, index);
            fitted_phases.push(fitted_curve(lines, &name, degrees(&fitted.values)));
        }
        if let Some(coherence) = &frf.coherence {
            let values = coherence.iter().map(|value| value.unwrap_or(f64::NAN));
            let series = over_lines(lines, &frf.response, color, values.collect());
            coherences.push(series);
        }
    }
    let x = frequency_axis(spectra);
    let mut phase = Axis::linear(-190.0, 190.0).of("phase", "\u{b0}");
    phase.period = Some(360.0);
    let names = ["\u{2212}180", "\u{2212}90", "0", "90", "180"];
    let names = names.iter().zip([-180.0, -90.0, 0.0, 90.0, 180.0]);
    let phase = phase.named(names.map(|(words, value)| (value, (*words).to_owned())));
    phases.extend(fitted_phases);
    panels.push(Panel::new(150.0, x.clone(), phase).with(phases));
    let mut below = subtitle(spectra);
    if coherences.is_empty() {
        let why = if spectra.averages.taps == 1 {
            "one average: "
        } else {
            ""
        };
        below.push_str(&format!(" \u{b7} {why}no coherence"));
    } else {
        let axis = Axis::linear(0.0, 1.05).of("coherence", "");
        panels.push(Panel::new(120.0, x, axis).with(coherences));
    }
    let faint = frfs.first().into_iter().flat_map(|frf| beside(frf, others));
    let mut faint: Vec<&str> = faint.map(FrfEstimator::name).collect();
    if frfs.iter().any(|frf| frf.fitted.is_some()) {
        faint.push("residual");
    }
    if !faint.is_empty() {
        below.push_str(&format!(" \u{b7} faint: {}", faint.join(", ")));
    }
    let rules = rules(recording, spectra);
    for panel in &mut panels {
        panel.rules.clone_from(&rules);
    }
    let mut caption = format!("Response per force (H1) of {name}, magnitude, phase and coherence.");
    if frfs.iter().any(|frf| frf.fitted.is_some()) {
        caption.push_str(
            " Thin dark line: what the fitted modes explain, with a term each for modes below and above the band. Faint \
             line: the residual, measured less fitted. Where it has a peak, a mode may be missing.",
        );
    }
    Some(Chart {
        kind: "frf",
        title: format!("Frequency response functions, {name}"),
        subtitle: below,
        caption,
        blocks: vec![Block::new(1, panels)],
        ..Chart::default()
    })
}

/// Returns the panels of the magnitudes, one for each form and unit.
fn magnitude_panels(
    spectra: &MeasuredSpectra,
    frfs: &[Frf],
    others: &[FrfEstimator],
) -> Vec<Panel> {
    let lines = &spectra.averages.lines;
    let x = frequency_axis(spectra);
    let mut panels: Vec<Panel> = Vec::new();
    for (index, frf) in frfs.iter().enumerate() {
        let color = Color::curve(index);
        // An analyser does not say by which estimator it has made a function.
        let estimator = match frf.averages {
            0 => "of the file",
            _ => frf.estimator.name(),
        };
        let named = match &frf.fitted {
            Some(fitted) if frfs.len() > 1 => {
                let left = percent(fitted.left);
                format!("{}, {estimator}, {left} left", frf.response)
            }
            _ => format!("{}, {estimator}", frf.response),
        };
        let curve = over_lines(lines, &named, color, magnitudes(frf.values()));
        let curve = under_fit(curve, frf);
        let unit = unit_words(&frf.unit);
        let series = panel_of(&mut panels, &x, frf.form_words, &unit);
        series.push(curve);
        for other in beside(frf, others) {
            let named = format!("{}, {}", frf.response, other.name());
            series.push(Series {
                mark: Mark::Line(1.0),
                opacity: FAINT,
                ..over_lines(lines, &named, color, magnitudes(frf.of(other)))
            });
        }
    }
    for panel in &mut panels {
        // The estimator that is meant gives the colour its name.
        panel.series.sort_by(|a, b| b.opacity.total_cmp(&a.opacity));
    }
    // The axes are those of what was measured.
    scale_to_magnitudes(&mut panels);
    // Measured curves, fitted ones, residuals: the page matches the first two with those of the phases by their order.
    for (index, frf) in frfs.iter().enumerate() {
        let Some(fitted) = &frf.fitted else { continue };
        let name = fitted_name(frfs, index);
        let curve = fitted_curve(lines, &name, magnitudes(&fitted.values));
        panel_of(&mut panels, &x, frf.form_words, &unit_words(&frf.unit)).push(curve);
    }
    for (index, frf) in frfs.iter().enumerate() {
        let Some(fitted) = &frf.fitted else { continue };
        let values = frf.values().iter().zip(&fitted.values);
        let residual = values.map(|(measured, fitted)| Some((*measured)? - (*fitted)?));
        let residual: Vec<Option<Complex64>> = residual.collect();
        let name = match frfs.len() {
            1 => "residual: measured less fitted".to_owned(),
            _ => format!("residual, {}", frf.response),
        };
        let series = panel_of(&mut panels, &x, frf.form_words, &unit_words(&frf.unit));
        series.push(Series {
            mark: Mark::Line(OVER),
            opacity: FAINT,
            ..over_lines(lines, &name, Color::curve(index), magnitudes(&residual))
        });
    }
    panels
}

/// Makes a measured curve as wide as a curve of fitted modes over it needs.
fn under_fit(measured: Series, frf: &Frf) -> Series {
    match frf.fitted {
        Some(_) => Series {
            mark: Mark::Line(UNDER),
            ..measured
        },
        None => measured,
    }
}

/// Returns the curve of fitted modes.
fn fitted_curve(lines: &Lines, name: &str, values: Vec<f64>) -> Series {
    Series {
        mark: Mark::Line(OVER),
        ..over_lines(lines, name, Color::Ink, values)
    }
}

/// Returns the name of the curve over a function: "24 fitted modes leave 0.30 % of the power, 12 to 830 Hz". In a
/// picture all curves look alike, so that the first one speaks for all, and the others name their response.
fn fitted_name(frfs: &[Frf], index: usize) -> String {
    let fitted = frfs.iter().filter_map(|frf| frf.fitted.as_ref());
    let Some(first) = fitted.clone().next() else {
        return String::new();
    };
    let modes = match first.modes {
        1 => "1 fitted mode".to_owned(),
        count => format!("{count} fitted modes"),
    };
    if frfs[..index].iter().any(|frf| frf.fitted.is_some()) {
        return format!("{modes}, {}", frfs[index].response);
    }
    let leaves = if first.modes == 1 { "leaves" } else { "leave" };
    let Some((least, most)) = extent(fitted.map(|one| one.left)) else {
        return modes;
    };
    let left = match (percent(least), percent(most)) {
        (least, most) if least == most => most,
        (least, most) => format!("{} to {most}", least.trim_end_matches(" %")),
    };
    let [low, high] = [first.band.0, first.band.1].map(|end| trimmed(end, 4));
    format!("{modes} {leaves} {left} of the power, {low} to {high} Hz")
}

/// Returns a share in percent with two digits: "0.30 %"; "under 0.001 %" for less.
fn percent(share: f64) -> String {
    match 100.0 * share {
        percent if percent < 1e-3 => "under 0.001 %".to_owned(),
        percent => format!("{} %", significant(percent, 2)),
    }
}

/// Returns the estimators shown beside the one that a function is given by; none of one average, where all are the same.
fn beside(frf: &Frf, others: &[FrfEstimator]) -> impl Iterator<Item = FrfEstimator> {
    let shown = others.iter().filter(|_| frf.averages > 1);
    shown.copied().filter(|other| *other != frf.estimator)
}

/// Returns the magnitude on each line; what does not exist is no number.
pub(super) fn magnitudes(values: &[Option<Complex64>]) -> Vec<f64> {
    let magnitudes = values
        .iter()
        .map(|value| value.map_or(f64::NAN, |h| h.norm()));
    magnitudes.collect()
}

/// Returns the phase on each line (degrees); what does not exist is no number.
fn degrees(values: &[Option<Complex64>]) -> Vec<f64> {
    let degrees = values
        .iter()
        .map(|value| value.map_or(f64::NAN, |h| h.arg().to_degrees()));
    degrees.collect()
}

/// Returns the series of the panel of this quantity and unit, which is added where there is none yet.
fn panel_of<'a>(
    panels: &'a mut Vec<Panel>,
    x: &Axis,
    label: &str,
    unit: &str,
) -> &'a mut Vec<Series> {
    let known = panels.iter();
    let known = known.map(|panel| (panel.y.label.as_str(), panel.y.unit.as_str()));
    let index = known.take_while(|own| *own != (label, unit)).count();
    if index == panels.len() {
        let y = Axis::linear(0.0, 1.0).of(label, unit);
        panels.push(Panel::new(HIGH, x.clone(), y));
    }
    &mut panels[index].series
}

/// Gives panels logarithmic axes over their curves, faint ones apart.
fn scale_to_magnitudes(panels: &mut [Panel]) {
    for panel in panels {
        panel.series.retain(|series| series.count() > 0);
        let main = panel.series.iter().filter(|series| series.opacity == 1.0);
        let y = magnitude_axis(main.flat_map(|series| series.y.iter().copied()));
        panel.y = y.of(&panel.y.label, &panel.y.unit);
    }
}

/// Returns a unit as print has it, also where none was stated.
pub(super) fn unit_of(unit: &Option<String>) -> String {
    unit_words(unit.as_deref().unwrap_or("unit of the file"))
}

/// Returns the unit of a transform: that of the signal times seconds.
fn unit_of_transform(unit: &Option<String>) -> String {
    match unit {
        Some(unit) => format!("{} s", unit_words(unit)),
        None => "unit of the file \u{d7} s".to_owned(),
    }
}

/// Returns a curve over the spectral lines.
pub(super) fn over_lines(lines: &Lines, name: &str, color: Color, values: Vec<f64>) -> Series {
    Series::even(name, color, lines.frequency(0), lines.spacing, values)
}

/// Averages, block, lines, spacing and resolution in words.
fn subtitle(spectra: &MeasuredSpectra) -> String {
    let lines = &spectra.averages.lines;
    let end = shown_to(spectra);
    let shown = if end < lines.high {
        let (end, all) = (trimmed(end, 6), trimmed(lines.high, 6));
        format!(" \u{b7} shown to {end} of {all} Hz")
    } else {
        String::new()
    };
    let spacing = trimmed(lines.spacing, 4);
    let taps = match spectra.averages.taps {
        0 => {
            return format!(
                "as the file holds them \u{b7} {} lines \u{b7} line spacing {spacing} Hz{shown}",
                lines.points()
            );
        }
        1 => "1 tap".to_owned(),
        count => format!("{count} taps"),
    };
    format!(
        "{taps} averaged \u{b7} block {} samples, {} lines \u{b7} line spacing {spacing} Hz \u{b7} resolution 1/T = {} Hz{shown}",
        lines.block,
        lines.displayed(),
        trimmed(lines.resolution(), 4),
    )
}

/// Returns the horizontal axis of a recording's spectra.
pub(super) fn frequency_axis(spectra: &MeasuredSpectra) -> Axis {
    Axis::linear(spectra.averages.lines.low, shown_to(spectra)).of("frequency", "Hz")
}

/// Upper end of the frequencies shown (Hz): the band's, or where nothing was found in its upper
/// part, a round frequency above the highest peak. A kilohertz of modes under twenty kilohertz of
/// noise cannot be read.
fn shown_to(spectra: &MeasuredSpectra) -> f64 {
    let (low, high) = (spectra.averages.lines.low, spectra.averages.lines.high);
    let peaks = spectra.readings.iter().filter(|reading| is_marked(reading));
    let Some((_, highest)) = extent(peaks.map(|reading| reading.frequency)) else {
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

/// Returns a logarithmic axis that shows all positive values down to 140 dB below the largest.
pub(super) fn magnitude_axis(values: impl Iterator<Item = f64>) -> Axis {
    let all: Vec<f64> = values.filter(|value| *value > 0.0).collect();
    let high = extent(all.iter().copied()).map_or(1.0, |range| range.1);
    let shown = all.into_iter().filter(|value| *value >= DEEPEST * high);
    let low = extent(shown).map_or(1e-3, |range| range.0);
    Axis::logarithmic(low / 1.4, high * 1.6)
}

/// Returns the force's spectrum in dB below its largest value: how far the hammer reaches; `None` without a force.
fn force_panel(spectra: &MeasuredSpectra, unit: &str) -> Option<Panel> {
    let force = spectra.averages.force.as_deref()?;
    let largest = extent(force.iter().copied())?.1;
    if largest <= 0.0 {
        return None;
    }
    let decibels = force.iter().map(|value| decibels(value / largest));
    let decibels: Vec<f64> = decibels.collect();
    let lowest = extent(decibels.iter().copied()).map_or(-20.0, |range| range.0);
    let floor = (lowest / 10.0).floor().clamp(-8.0, -1.0) * 10.0;
    let axis = Axis::linear(floor - 2.0, 4.0).of("force", "dB");
    let largest = significant(largest, 3);
    let name = format!("force, dB below its largest of {largest} {unit}");
    let series = over_lines(&spectra.averages.lines, &name, Color::Soft, decibels);
    Some(Panel::new(114.0, frequency_axis(spectra), axis).with([series]))
}

/// Returns the level of a ratio of amplitudes (dB), at least -120.
pub(super) fn decibels(ratio: f64) -> f64 {
    20.0 * ratio.max(1e-6).log10()
}

/// True for a peak that is marked. The tables leave out the same peaks.
fn is_marked(reading: &ModeReading) -> bool {
    let is_noise = match reading.label {
        Some(PeakLabel::Weak) => true,
        Some(PeakLabel::NoResonance) => !is_strong(reading.above_noise_db),
        _ => false,
    };
    reading.frequency.is_finite() && !is_noise
}

/// Returns the resonances as marks on the frequency axis.
pub(super) fn rules(recording: &RecordingResult, spectra: &MeasuredSpectra) -> Vec<Rule> {
    let read = spectra.readings.iter().zip(&recording.mode_numbers);
    let known = read.filter(|(reading, _)| is_marked(reading));
    let rules = known.map(|(reading, mode)| {
        // One digit more than the half-line bound.
        let bound = reading.half_line / 5.0;
        let decimals = match bound > 0.0 {
            true => (-bound.log10().floor()).clamp(0.0, 5.0) as usize,
            false => 2,
        };
        Rule {
            at: reading.frequency,
            line: reading.line_frequency,
            half: reading.half_line,
            name: match (mode, reading.label) {
                (Some(mode), _) => format!("mode {mode}"),
                (None, Some(label)) => label.to_string(),
                (None, None) => "no mode".to_owned(),
            },
            words: format!("{:.decimals$} Hz", reading.frequency),
            mode: mode.is_some(),
            prominence: reading.prominence_db.unwrap_or(0.0),
        }
    });
    rules.collect()
}

/// Returns close-ups of the modes: the single lines, the bound of the reading, and the frequency between the lines.
/// The page needs none: it zooms.
fn close_ups(spectra: &MeasuredSpectra, rules: &[Rule]) -> Option<Block> {
    let modes: Vec<&Rule> = rules.iter().filter(|rule| rule.mode).collect();
    let name = match modes.len() {
        0 => return None,
        count if count > MOST_CLOSE_UPS => {
            format!("Close-ups, the first {MOST_CLOSE_UPS} of {count} modes")
        }
        _ => "Close-ups".to_owned(),
    };
    let shown = modes.into_iter().take(MOST_CLOSE_UPS);
    let panels: Vec<Panel> = shown.map(|rule| close_up(spectra, rule)).collect();
    Some(Block {
        name,
        in_page: InPage::Absent,
        ..Block::new(panels.len().max(3), panels)
    })
}

fn close_up(spectra: &MeasuredSpectra, rule: &Rule) -> Panel {
    let center = rule.line;
    let lines = &spectra.averages.lines;
    let own = spectra
        .readings
        .iter()
        .find(|reading| reading.frequency == rule.at);
    let damping = own.and_then(|reading| reading.damping_ratio).unwrap_or(0.0);
    let width = 2.0 * damping * rule.at;
    let reach = (SIDE * lines.spacing)
        .max(2.0 * rule.half)
        .max(SIDE_WIDTHS * width);
    let decimals = if rule.half < 0.05 { 3 } else { 2 };
    let side = significant(reach, 2);
    let x = Axis::linear(center - reach, center + reach);
    let names = [
        (x.low, format!("\u{2212}{side}")),
        (center, format!("{center:.decimals$} Hz")),
        (x.high, format!("+{side}")),
    ];
    let y = Axis::linear(-DEPTH, 4.0).of("level", "dB");
    let mut panel = Panel::new(118.0, x.named(names), y).titled(&rule.name);
    panel.rules = vec![rule.clone()];
    for (index, values) in spectra.averages.responses.iter().enumerate() {
        let numbered = values.iter().enumerate();
        let near = numbered.map(|(line, value)| {
            let at = lines.frequency(0) + lines.spacing * line as f64;
            (at, *value)
        });
        let near = near.filter(|(at, value)| panel.x.holds(*at) && value.is_finite());
        let near: Vec<(f64, f64)> = near.collect();
        let largest = extent(near.iter().map(|point| point.1)).map_or(1.0, |range| range.1);
        let levels = near.into_iter();
        let levels = levels.map(|(at, value)| (at, decibels(value / largest)));
        let levels: Vec<(f64, f64)> = levels.collect();
        let color = Color::curve(index);
        // In one colour the legend explains the lines.
        let name = if index == 0 { "spectral line" } else { "" };
        panel = panel.with([
            Series::points("", color, Mark::Line(1.0), levels.iter().copied()),
            Series::points(name, color, Mark::Dot(2.6), levels),
        ]);
    }
    panel
}

/// Most reasons written under the picture; the table of taps has them all.
const MOST_REASONS: usize = 6;

/// Returns the recording over time; `None` for a recording without samples.
pub fn taps(recording: &RecordingResult, name: &str) -> Option<Chart> {
    let overview = recording.overview.as_ref()?;
    let count = overview.low.len().min(overview.high.len());
    if count == 0 {
        return None;
    }
    let (low, high) = (&overview.low[..count], &overview.high[..count]);
    let taps = &recording.measurement.taps.taps;
    let peaks = taps.iter().map(|tap| tap.peak);
    let range = extent(low.iter().chain(high).copied().chain(peaks)).unwrap_or((-1.0, 1.0));
    let (label, unit) = match recording.responses.first() {
        _ if recording.has_hammer => ("force".to_owned(), unit_of(&recording.tap_unit)),
        Some(first) => (format!("response {}", first.name), unit_of(&first.unit)),
        None => ("response".to_owned(), String::new()),
    };
    let seconds = overview.step * count as f64;
    // Room at the start: a recording may begin with a tap, whose mark would lie on the frame.
    let x = Axis::linear(-0.015 * seconds, seconds).of("time", "s");
    // Room above the tallest tap for its number.
    let y = padded(range, 0.14).of(label, &unit);
    let signal = Series {
        x: Places::even(0.5 * overview.step, overview.step, count),
        low: low.to_vec(),
        high: high.to_vec(),
        ..Series::new(&y.title(), Color::Data, Mark::Band)
    };
    let mut panel = Panel::new(262.0, x, y).with([signal]);
    for (index, tap) in taps.iter().enumerate() {
        let close_up = overview.close_ups.get(index);
        panel.events.push(event(tap, &unit, recording, close_up));
    }
    let found = match taps.len() {
        1 => "1 tap".to_owned(),
        count => format!("{count} taps"),
    };
    let used = taps.iter().filter(|tap| tap.accepted()).count();
    let rejected = taps.len() - used;
    // "tap 3 at 6.21 s: double hit".
    let mut reasons = Vec::new();
    for (index, tap) in taps.iter().enumerate() {
        if let Some(reason) = &tap.rejection {
            reasons.push(format!("tap {} at {:.2} s: {reason}", index + 1, tap.time));
        }
    }
    let more = reasons.len().saturating_sub(MOST_REASONS);
    reasons.truncate(MOST_REASONS);
    if more > 0 {
        reasons.push(format!("and {more} more, see the table of taps"));
    }
    Some(Chart {
        kind: "taps",
        title: format!("Taps, {name}"),
        subtitle: format!("{found} found \u{b7} {used} used \u{b7} {rejected} rejected"),
        caption: format!("{name} over time; numbers count the taps."),
        blocks: vec![Block::new(1, vec![panel])],
        footnotes: reasons,
        ..Chart::default()
    })
}

fn event(tap: &Tap, unit: &str, recording: &RecordingResult, found: Option<&CloseUp>) -> Event {
    let mut close_up = Vec::new();
    if let Some(found) = found {
        let force = found.force.as_ref();
        let force = force.map(|values| ("force".to_owned(), &recording.tap_unit, values));
        let response = recording.responses.first().zip(found.response.as_ref());
        let response =
            response.map(|(one, values)| (format!("response {}", one.name), &one.unit, values));
        for (label, unit, values) in force.into_iter().chain(response) {
            let (start, step) = (1e3 * found.start, 1e3 * found.step);
            let series = Series::even(&label, Color::Soft, start, step, values.clone());
            let x = Axis::linear(0.0, 1.0).of("time from the trigger", "ms");
            let y = Axis::linear(0.0, 1.0).of(label, unit_of(unit));
            close_up.push(Panel::new(190.0, x, y).with([series]));
        }
    }
    let place = format!("{:.3} s, {} {unit}", tap.time, significant(tap.peak, 3));
    Event {
        at: tap.time,
        peak: tap.peak,
        words: match &tap.rejection {
            None => format!("used, {place}"),
            Some(reason) => format!("rejected, {place}: {reason}"),
        },
        used: tap.accepted(),
        close_up,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_analysis::FittedCurve;
    use tapjoint_signal::spectral::{AveragedSpectra, Window};

    fn lines() -> Lines {
        Lines {
            low: 0.0,
            high: 40.0,
            spacing: 1.0,
            block: 103,
            duration: 1.0,
        }
    }

    /// A function of which the fitted modes leave this share between 10 and 30 Hz.
    fn function(response: &str, left: Option<f64>) -> Frf {
        let value = |line: usize| Complex64::new(0.0, line as f64);
        let h1: Vec<Option<Complex64>> = (0..lines().points())
            .map(|line| Some(value(line)))
            .collect();
        let shown = |line: usize| (10..=30).contains(&line).then(|| value(line));
        Frf {
            recording: "a.uff".to_owned(),
            response: response.to_owned(),
            form: None,
            form_words: "accelerance",
            unit: "(m/s2)/N".to_owned(),
            lines: lines(),
            averages: 0,
            window: Window::Rectangular,
            estimator: FrfEstimator::H1,
            h2: Vec::new(),
            hv: Vec::new(),
            coherence: None,
            random_error: None,
            resonances: Vec::new(),
            fitted: left.map(|left| FittedCurve {
                modes: 24,
                band: (10.0, 30.0),
                left,
                values: (0..lines().points()).map(shown).collect(),
            }),
            h1,
        }
    }

    fn series(frfs: &[Frf]) -> Vec<Series> {
        let spectra = MeasuredSpectra {
            averages: AveragedSpectra::empty(lines()),
            window: Window::Rectangular,
            decay: None,
            readings: Vec::new(),
            unlisted: Vec::new(),
            fitted: None,
            force_noise: None,
            force_window: None,
            stabilisation: Default::default(),
            taps_together: None,
        };
        let mut panels = magnitude_panels(&spectra, frfs, &[]);
        assert_eq!(panels.len(), 1);
        panels.remove(0).series
    }

    #[test]
    fn regress_fitted_modes_are_a_thin_dark_line_over_what_was_measured() {
        let shown = series(&[function("A", Some(0.003))]);
        let names: Vec<&str> = shown.iter().map(|one| one.name.as_str()).collect();
        let fitted = "24 fitted modes leave 0.30 % of the power, 10 to 30 Hz";
        let residual = "residual: measured less fitted";
        assert_eq!(names, ["A, of the file", fitted, residual]);
        assert_eq!((shown[2].mark, shown[2].opacity), (Mark::Line(OVER), FAINT));
        // The fit is exact, and the residual has no place outside its band.
        assert!(shown[2].y[10..=30].iter().all(|value| *value == 0.0));
        assert!(shown[2].y[..10].iter().all(|value| value.is_nan()));
        assert_eq!(shown[0].mark, Mark::Line(UNDER));
        assert_eq!(
            (shown[1].mark, shown[1].color),
            (Mark::Line(OVER), Color::Ink)
        );
        // Nothing is drawn outside the band.
        let drawn: Vec<usize> = (0..shown[1].y.len())
            .filter(|&line| shown[1].y[line].is_finite())
            .collect();
        assert_eq!(
            (drawn[0], drawn[drawn.len() - 1], drawn.len()),
            (10, 30, 21)
        );
    }

    #[test]
    fn regress_every_function_says_what_is_left_of_it() {
        let shown = series(&[
            function("A", Some(0.003)),
            function("B", Some(0.02)),
            function("C", None),
        ]);
        let names: Vec<&str> = shown.iter().map(|one| one.name.as_str()).collect();
        let expected = [
            "A, of the file, 0.30 % left",
            "B, of the file, 2.0 % left",
            "C, of the file",
            "24 fitted modes leave 0.30 to 2.0 % of the power, 10 to 30 Hz",
            "24 fitted modes, B",
            "residual, A",
            "residual, B",
        ];
        assert_eq!(names, expected);
        assert_eq!(shown[2].mark, Mark::Line(1.5));
    }

    #[test]
    fn limit_shares_that_round_to_nothing() {
        assert_eq!(percent(0.0), "under 0.001 %");
        assert_eq!(percent(0.5), "50 %");
    }
}
