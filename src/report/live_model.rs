//! Pictures of the model for the page's script: errors of predicted frequencies, shapes of the modes, the
//! gap and its places. Each point says its values when hovered.

use super::document::{Document, GapSection};
use super::format::{rounded, rounded_to, signed_percent, significant};
use super::live_points::{LivePoints, LiveView, PointAxis, PointPanel, PointRule, PointSet};
use super::plot::axis::Axis;
use super::plot::comparison::{Error, errors, frequencies_words, panel};
use super::plot::gap::{Explanation, MOST_BARS, abscissa, errors_panel};
use super::plot::place_map::{explained_panel, map_panel};
use super::plot::shapes::{Places, displacement, joint_of, places, shown};
use super::tables::place_of;
use tapjoint_analysis::SampledShape;
use tapjoint_diagnosis::{LocationMap, Residual};

/// Height of a panel with errors or changes (pixels).
const HEIGHT: u32 = 320;
/// Height of a mode's panel, of which there are many (pixels).
const SHAPE_HEIGHT: u32 = 210;
/// Room of a hypothesis on its axis, half of it to either side.
const BAR: f64 = 0.6;

/// All panels at once.
fn together(panels: Vec<PointPanel>) -> LivePoints {
    LivePoints {
        kind: "points",
        views: vec![LiveView {
            name: "all".to_owned(),
            panels,
        }],
    }
}

fn panel_of(x: PointAxis, y: PointAxis, sets: Vec<PointSet>) -> PointPanel {
    PointPanel {
        title: String::new(),
        height: HEIGHT,
        x,
        y,
        extra: None,
        sets: sets.into_iter().filter(|set| !set.x.is_empty()).collect(),
        rules: Vec::new(),
    }
}

/// A place with four digits, more than the picture shows. What a point says has digits of its own.
fn coarse(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// The line of no error, without a name in the legend.
fn zero(x: &PointAxis) -> PointSet {
    PointSet::new("", "soft", ("line", 1.0), x.range.map(|end| (end, 0.0)))
}

/// Errors of the predicted frequencies; `None` where nothing was predicted for a measured mode.
pub fn live_frequencies(document: &Document) -> Option<LivePoints> {
    let errors = errors(document);
    if errors.is_empty() {
        return None;
    }
    let panel = panel(&errors);
    let numbers = errors.iter().enumerate();
    let numbers = numbers.map(|(at, error)| (at as f64, error.prediction.mode.to_string()));
    let x = PointAxis::of(&panel.x, "mode", "").named(numbers);
    let y = PointAxis::of(&panel.y, "error", "%");
    let mut sets = vec![zero(&x)];
    for used in [true, false] {
        // Bars are drawn where all points of a set have one.
        for bounded in [true, false] {
            sets.push(error_set(&errors, used, |error| {
                error.bound.is_some() == bounded
            }));
        }
    }
    Some(together(vec![panel_of(x, y, sets)]))
}

fn error_set(errors: &[Error<'_>], used: bool, belongs: impl Fn(&Error<'_>) -> bool) -> PointSet {
    let all = errors.iter().enumerate();
    let found: Vec<(usize, &Error<'_>)> = all
        .filter(|(_, error)| error.prediction.used == used && belongs(error))
        .collect();
    let (name, color, mark) = if used {
        ("mode used in the estimate", "c0", ("dot", 5.0))
    } else {
        ("mode not used: a true prediction", "c1", ("ring", 5.0))
    };
    let places = found.iter().map(|(at, error)| (*at as f64, error.percent));
    let mut set = PointSet::new(name, color, mark, places);
    let end = |sign: f64| {
        let known = found
            .iter()
            .filter_map(|(_, error)| Some(error.percent + sign * error.bound?));
        known.collect::<Vec<f64>>()
    };
    (set.low, set.high) = (end(-1.0), end(1.0));
    set.words = found
        .iter()
        .map(|(_, error)| frequencies_words(error))
        .collect();
    // Thousandths of a percent, as in the picture.
    let said = found
        .iter()
        .map(|(_, error)| rounded_to(error.percent, error.bound, -3).joined() + " %");
    set.said = said.collect();
    set
}

/// Errors with the described model and with the effect that is held for the cause, and how probable each
/// hypothesis is; `None` without a diagnosis.
pub fn live_gap(document: &Document) -> Option<LivePoints> {
    let gap = document.gap.as_ref()?;
    let pulls = &gap.place.as_ref()?.modes;
    if pulls.is_empty() {
        return None;
    }
    Some(together(vec![pulls_panel(gap, pulls), odds_panel(gap)]))
}

fn pulls_panel(gap: &GapSection, pulls: &[Residual]) -> PointPanel {
    let axes = errors_panel(gap, pulls);
    let last = pulls.iter().map(|pull| pull.mode).max().unwrap_or(1);
    let numbers = (1..=last).map(|mode| (mode as f64, mode.to_string()));
    let x = PointAxis::of(&axes.x, "mode", "").named(numbers);
    let y = PointAxis::of(&axes.y, "error of the frequency", "%");
    let before = ("described model, joint fitted", "c1", ("ring", 4.5));
    let mut sets = vec![
        zero(&x),
        pulls_set(before, pulls, |pull| (pull.error_percent, pull.z)),
    ];
    if let Some(effect) = Explanation::of(gap).effect() {
        let name = format!("with {effect}");
        let after = (name.as_str(), "c0", ("dot", 4.0));
        let left = |pull: &Residual| (pull.error_percent_after, pull.z_after);
        sets.push(pulls_set(after, pulls, left));
    }
    PointPanel {
        title: "errors of the frequencies".to_owned(),
        extra: Some(["that is", "standard deviations"]),
        ..panel_of(x, y, sets)
    }
}

/// The errors of all frequencies with one model, each in percent and in standard deviations.
fn pulls_set(
    (name, color, mark): (&str, &str, (&'static str, f64)),
    pulls: &[Residual],
    value: impl Fn(&Residual) -> (f64, f64),
) -> PointSet {
    let points = pulls
        .iter()
        .map(|pull| (abscissa(pulls, pull), coarse(value(pull).0)));
    let mut set = PointSet::new(name, color, mark, points);
    set.extra = pulls.iter().map(|pull| coarse(value(pull).1)).collect();
    let words = pulls
        .iter()
        .map(|pull| format!("mode {} in {}", pull.mode, place_of(pull)));
    set.words = words.collect();
    let said = pulls
        .iter()
        .map(|pull| signed_percent(Some(value(pull).0)) + " %");
    set.said = said.collect();
    set
}

fn odds_panel(gap: &GapSection) -> PointPanel {
    let rows: Vec<_> = gap.hypotheses.iter().take(MOST_BARS).enumerate().collect();
    let linear = |range: (f64, f64)| Axis::linear(range, (0.0, 1.0));
    let names = rows
        .iter()
        .map(|(row, found)| (-(*row as f64), found.hypothesis.name()));
    let lowest = -(rows.len() as f64) + 1.0 - BAR;
    let x = PointAxis::of(&linear((0.0, 100.0)), "probability", "%");
    let y = PointAxis::of(&linear((lowest, BAR)), "", "").named(names);
    let bars = |name: &str, color: &str, found: bool| {
        let rows = rows
            .iter()
            .filter(|(_, entry)| gap.verdict.hypotheses().contains(&entry.hypothesis) == found);
        let percent = |probability: f64| (1e5 * probability).round() / 1e3;
        let places = rows
            .clone()
            .map(|(row, entry)| (percent(entry.probability), -(*row as f64)));
        let mut set = PointSet::new(name, color, ("bar", 9.0), places);
        set.words = rows.map(|(_, entry)| entry.hypothesis.name()).collect();
        set
    };
    let sets = vec![
        bars("found", "c0", true),
        bars("other explanations", "data", false),
    ];
    PointPanel {
        title: "what may be missing".to_owned(),
        ..panel_of(x, y, sets)
    }
}

/// Local changes along the beam that the errors call for; `None` without a map.
pub fn live_place_map(document: &Document) -> Option<LivePoints> {
    let map = document.gap.as_ref()?.map.as_ref()?;
    let axes = map_panel(map)?;
    let x = PointAxis::of(&axes.x, "position from the joint", "mm");
    let y = PointAxis::of(&axes.y, "local change", "%");
    let sets = vec![
        zero(&x),
        change(
            map,
            ("bending stiffness", "c1"),
            (&map.stiffness, &map.stiffness_std),
        ),
        change(map, ("mass", "c0"), (&map.mass, &map.mass_std)),
    ];
    let explained = explained_panel(map)?;
    let share = |name: &str, color: &str, values: &[f64]| {
        let places = map.positions.iter().zip(values);
        let places = places.map(|(at, value)| (coarse(1e3 * at), coarse(100.0 * value)));
        let mut set = PointSet::new(name, color, ("curve", 2.0), places);
        let said = |value: &f64| format!("{:.0} %", 100.0 * value);
        set.said = values.iter().map(said).collect();
        set
    };
    let shares = vec![
        share("bending stiffness", "c1", &map.stiffness_explains),
        share("mass", "c0", &map.mass_explains),
    ];
    let above = panel_of(
        PointAxis::of(&explained.x, "position from the joint", "mm"),
        PointAxis::of(&explained.y, "misfit explained by one place alone", "%"),
        shares,
    );
    Some(together(vec![above, panel_of(x, y, sets)]))
}

fn change(
    map: &LocationMap,
    (name, color): (&str, &str),
    (values, stds): (&[f64], &[f64]),
) -> PointSet {
    let places = map.positions.iter().zip(values);
    let places = places.map(|(at, value)| (coarse(1e3 * at), coarse(100.0 * value)));
    let mut set = PointSet::new(name, color, ("curve", 2.0), places);
    let pairs = || values.iter().zip(stds);
    set.low = pairs()
        .map(|(value, std)| coarse(100.0 * (value - std)))
        .collect();
    set.high = pairs()
        .map(|(value, std)| coarse(100.0 * (value + std)))
        .collect();
    set.said = pairs()
        .map(|(value, std)| rounded(100.0 * value, Some(100.0 * std)).joined() + " %")
        .collect();
    set
}

/// Shapes of the predicted modes, a panel each; `None` without any.
pub fn live_shapes(document: &Document) -> Option<LivePoints> {
    let shapes = shown(document);
    let places = places(document);
    let panels: Vec<PointPanel> = shapes
        .iter()
        .map(|shape| shape_panel(shape, &places))
        .collect();
    (!panels.is_empty()).then(|| together(panels))
}

fn shape_panel(shape: &SampledShape, places: &Places) -> PointPanel {
    let end = 1e3 * shape.positions.last().copied().unwrap_or(1.0);
    let axis = |range: (f64, f64), label: &str, unit: &str| {
        PointAxis::of(&Axis::linear(range, (0.0, 1.0)), label, unit)
    };
    let x = axis((0.0, end), "position", "mm");
    let points = shape.positions.iter().zip(&shape.displacements);
    let points: Vec<(f64, f64)> = points
        .map(|(at, y)| (coarse(1e3 * at), coarse(*y)))
        .collect();
    let mut sets = vec![zero(&x)];
    // A lap joint's halves end at one place and need not meet.
    let halves = points.chunk_by(|before, after| before.0 < after.0);
    sets.extend(
        halves.map(|half| PointSet::new("mode shape", "c0", ("curve", 2.5), half.iter().copied())),
    );
    let sites = |sites: &[f64]| {
        let site = |place: &f64| (coarse(1e3 * place), coarse(displacement(shape, *place)));
        sites.iter().map(site).collect::<Vec<_>>()
    };
    sets.push(PointSet::new(
        "tap",
        "c1",
        ("cross", 5.0),
        sites(&places.taps),
    ));
    let mut sensors = PointSet::new("sensor", "c4", ("dot", 4.5), []);
    for (name, of_sensor) in &places.sensors {
        for (x, y) in sites(of_sensor) {
            sensors.x.push(x);
            sensors.y.push(y);
            sensors.words.push(name.clone());
        }
    }
    sets.push(sensors);
    let joint = joint_of(shape).map(|place| PointRule {
        at: coarse(1e3 * place),
        name: "joint".to_owned(),
        mode: false,
    });
    PointPanel {
        title: format!(
            "mode {}, {} Hz",
            shape.mode,
            significant(shape.frequency, 4)
        ),
        height: SHAPE_HEIGHT,
        rules: joint.into_iter().collect(),
        ..panel_of(x, axis((-1.15, 1.15), "displacement", ""), sets)
    }
}
