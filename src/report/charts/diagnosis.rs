//! The gap between model and measurement: errors, odds of the explanations, and where along the beam it sits.

use super::spectra::HIGH;
use crate::document::{Document, GapSection};
use crate::format::{probability, rounded, signed_percent};
use crate::picture::{Axis, Block, Chart, Color, Mark, Panel, Series, extent, padded};
use crate::words::diagnosis::{found_best, place_of};
use tapjoint_diagnosis::{LocationMap, Residual};
use tapjoint_numerics::stats::NORMAL_95;

/// Hypotheses shown.
const MOST_BARS: usize = 9;
/// The axis reaches at least this far to either side of zero (%).
const LEAST_SPAN: f64 = 0.02;

/// Errors with the described model and with the effect that is probably the cause, and how probable each
/// hypothesis is; `None` without a diagnosis.
pub fn gap(document: &Document) -> Option<Chart> {
    let gap = document.gap.as_ref()?;
    let pulls = &gap.place.as_ref()?.modes;
    if pulls.is_empty() {
        return None;
    }
    // Errors are shown beside those of the described model where an effect is probably the cause.
    let shown = match found_best(gap) {
        Ok(effect) => format!("with the described model, and with {effect}"),
        Err(why) => format!("with the described model ({why})"),
    };
    let panels = vec![errors_panel(gap, pulls), odds_panel(gap)];
    Some(Chart {
        kind: "gap",
        title: "Gap between model and measurement".to_owned(),
        subtitle: format!(
            "left: every frequency of every recording {shown}; right: what may be missing"
        ),
        caption: format!(
            "The gap: every frequency's error {shown}; and how probable each hypothesis is."
        ),
        blocks: vec![Block::new(2, panels)],
        ..Chart::default()
    })
}

fn errors_panel(gap: &GapSection, pulls: &[Residual]) -> Panel {
    let last = pulls.iter().map(|pull| pull.mode).max().unwrap_or(1);
    let names = (1..=last).map(|mode| (mode as f64, mode.to_string()));
    let x = Axis::linear(0.4, last as f64 + 0.6)
        .of("mode", "")
        .named(names);
    let withheld = gap.fitted_modes.filter(|fitted| *fitted < last);
    let withheld = withheld.map_or_else(String::new, |fitted| {
        format!("; modes above {fitted} took no part")
    });
    let before = pulls.iter().map(|pull| (pull.error_percent, pull.z));
    let mut described = "exactly as described, joint fitted".to_owned();
    let mut series = Vec::new();
    if let Ok(effect) = found_best(gap) {
        let name = format!("with {effect}{withheld}");
        let after = pulls
            .iter()
            .map(|pull| (pull.error_percent_after, pull.z_after));
        let set = Series::new(&name, Color::Blue, Mark::Dot(4.0));
        series.push(with_errors(set, pulls, after));
    } else {
        described.push_str(&withheld);
    }
    let set = Series::new(&described, Color::Vermilion, Mark::Ring(4.5));
    series.insert(0, with_errors(set, pulls, before));
    let heights = series.iter().flat_map(|set| set.y.iter().copied());
    let (low, high) = extent(heights).unwrap_or((-1.0, 1.0));
    let y = padded((low.min(-LEAST_SPAN), high.max(LEAST_SPAN)), 0.1);
    let y = y.of("error of the frequency", "%");
    let panel = Panel::new(HIGH, x, y).titled("errors of the frequencies");
    Panel {
        extra: Some(["that is", "standard deviations"]),
        ..panel.with_zero().with(series)
    }
}

/// Returns the series with the errors of all frequencies with one model, each in percent and in standard deviations.
fn with_errors(
    mut series: Series,
    pulls: &[Residual],
    errors: impl Iterator<Item = (f64, f64)>,
) -> Series {
    for (pull, (percent, deviations)) in pulls.iter().zip(errors) {
        // The tap levels of all recordings that saw a mode stand beside each other over half its width. One recording
        // can hold taps of two levels, which saw the mode apart.
        let mut seats: Vec<(&str, Option<f64>)> = Vec::new();
        for other in pulls.iter().filter(|other| other.mode == pull.mode) {
            let seat = (other.recording.as_str(), other.level);
            if !seats.contains(&seat) {
                seats.push(seat);
            }
        }
        let own = (pull.recording.as_str(), pull.level);
        let place = seats.iter().position(|taken| *taken == own);
        let share = (place.unwrap_or(0) as f64 + 0.5) / seats.len().max(1) as f64;
        series.push(pull.mode as f64 + 0.5 * (share - 0.5), percent);
        series.extra.push(deviations);
        let words = format!("mode {} in {}", pull.mode, place_of(pull));
        series.words.push(words);
        series.said.push(signed_percent(Some(percent)) + " %");
    }
    series
}

fn odds_panel(gap: &GapSection) -> Panel {
    let rows = gap.hypotheses.iter().take(MOST_BARS).enumerate();
    let rows = rows.map(|(row, found)| (-(row as f64), found));
    let names = rows
        .clone()
        .map(|(row, found)| (row, found.hypothesis.name()));
    let lowest = 0.4 - gap.hypotheses.len().min(MOST_BARS) as f64;
    let y = Axis::linear(lowest, 0.6).named(names);
    let x = Axis::linear(0.0, 100.0).of("probability", "%");
    let mut found = Series::new("found", Color::Blue, Mark::Bar(9.0));
    let mut others = Series::new("other explanations", Color::Sky, Mark::Bar(9.0));
    for (row, one) in rows {
        let series = match gap.verdict.hypotheses().contains(&one.hypothesis) {
            true => &mut found,
            false => &mut others,
        };
        series.push(100.0 * one.probability, row);
        series.words.push(one.hypothesis.name());
        series.labels.push(probability(one.probability));
    }
    Panel::new(HIGH, x, y)
        .titled("what may be missing")
        .with([found, others])
}

/// Effect of a change at one place alone, and below it the changes of all places together; `None` without
/// a map.
pub fn place_map(document: &Document) -> Option<Chart> {
    let map = document.gap.as_ref()?.map.as_ref()?;
    let last = map.positions.last()?;
    let step = match map.positions.as_slice() {
        [first, second, ..] => second - first,
        _ => *last,
    };
    let x = Axis::linear(0.0, 1e3 * (last + 0.5 * step)).of("position from the joint", "mm");
    let curves = [
        (&map.stiffness_explains, &map.stiffness, &map.stiffness_std),
        (&map.mass_explains, &map.mass, &map.mass_std),
    ];
    let looks = [
        ("bending stiffness", Color::Vermilion),
        ("mass", Color::Blue),
    ];
    let (mut alone, mut together) = (Vec::new(), Vec::new());
    for ((name, color), (explains, changes, stds)) in looks.into_iter().zip(curves) {
        let mut set = along(map, name, color, explains);
        set.said = set.y.iter().map(|share| format!("{share:.0} %")).collect();
        alone.push(set);
        let mut set = along(map, name, color, changes);
        for (change, std) in changes.iter().zip(stds) {
            let half = NORMAL_95 * std;
            set.low.push(100.0 * (change - half));
            set.high.push(100.0 * (change + half));
            let said = rounded(100.0 * change, Some(100.0 * half));
            set.said.push(said.joined() + " %");
        }
        together.push(set);
    }
    let ends = together
        .iter()
        .flat_map(|set| set.low.iter().chain(&set.high));
    let range = extent(ends.copied().chain([0.0]))?;
    let y = padded(range, 0.08).of("local change", "%");
    let explained = Axis::linear(0.0, 105.0).of("misfit explained", "%");
    let panels = vec![
        Panel::new(220.0, x.clone(), explained).with(alone),
        Panel::new(240.0, x, y).with_zero().with(together),
    ];
    Some(Chart {
        kind: "gap-place",
        title: "Where along the beam".to_owned(),
        subtitle: format!(
            "above: what one place alone would explain; below: what all places together ask for, smeared over {:.0} mm, \
             bands: 1.96 standard deviations",
            1e3 * map.resolution
        ),
        caption: "Where along the beam a local change of stiffness or of mass would explain the errors: above each \
                  place by itself, which peaks where a local cause sits; below all places together, bands: 1.96 \
                  standard deviations."
            .to_owned(),
        blocks: vec![Block::new(1, panels)],
        ..Chart::default()
    })
}

/// One value (1, shown in %) for each place.
fn along(map: &LocationMap, name: &str, color: Color, values: &[f64]) -> Series {
    let places = map.positions.iter().zip(values);
    let places = places.map(|(at, value)| (1e3 * at, 100.0 * value));
    Series::points(name, color, Mark::Curve(2.0), places)
}
