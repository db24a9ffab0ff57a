//! Pictures of single points for the page's script: stabilisation diagram, clouds of estimates, frequency
//! and damping against amplitude. Points can be hovered, and panels zoomed in both directions.

use serde::Serialize;

use super::document::Document;
use super::figures::{PoleMark, RecordingFigure, SpectraFigure, StabilisationBand};
use super::format::signed;
use super::plot::axis::{Axis, Scale};
use super::plot::cloud::method_words;
use super::plot::cloud_points::{Cloud, clouds};
use super::plot::stabilisation::{CLASSES, level, named};
use tapjoint_signal::modal::polyreference::PoleStability;

/// Most points of the level behind a stabilisation diagram: it is faint, and the spectra have all of it.
const LEVEL_POINTS: usize = 400;
/// Height of a panel (pixels).
pub(super) const HEIGHT: u32 = 380;
/// Significant digits of positions, so that close poles stay apart when they are zoomed.
const DIGITS: usize = 7;

/// Panels of points, one view of them at a time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LivePoints {
    /// "points".
    pub kind: &'static str,
    /// What can be chosen among; the first is shown.
    pub views: Vec<LiveView>,
}

/// Panels that are shown together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveView {
    /// "whole band", "mode 1".
    pub name: String,
    /// The panels.
    pub panels: Vec<PointPanel>,
}

/// One panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointPanel {
    /// What it shows.
    pub title: String,
    /// Height (pixels).
    pub height: u32,
    /// Horizontal axis.
    pub x: PointAxis,
    /// Vertical axis.
    pub y: PointAxis,
    /// What else a point says when hovered: name and unit; `None` = nothing.
    pub extra: Option<[&'static str; 2]>,
    /// What is drawn, the lowest layer first.
    pub sets: Vec<PointSet>,
    /// Upright lines.
    pub rules: Vec<PointRule>,
}

/// An axis of a panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointAxis {
    /// "frequency".
    pub label: String,
    /// "Hz".
    pub unit: String,
    /// "linear" or "logarithmic".
    pub scale: &'static str,
    /// Its ends as long as nothing is zoomed (unit).
    pub range: [f64; 2],
    /// Places with names instead of numbers; empty where the axis has numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub at: Vec<f64>,
    /// Their names.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
}

/// Points that look alike.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointSet {
    /// Its name in the legend.
    pub name: String,
    /// Colour by its name in the page's style.
    pub color: String,
    /// "dot", "ring", "cross", "line", "band", "bar" from 0 to its place, or "curve": a line whose points
    /// answer the pointer.
    pub mark: &'static str,
    /// Radius, of a line its width (pixels).
    pub size: f64,
    /// Places (unit of the axis).
    pub x: Vec<f64>,
    /// Places (unit of the axis); empty for a band.
    pub y: Vec<f64>,
    /// Lower ends of bars or of a band; may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub low: Vec<f64>,
    /// Upper ends.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub high: Vec<f64>,
    /// What else each point says (unit of the panel's `extra`).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub extra: Vec<f64>,
    /// Each point's own words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// What each point's height is, with its uncertainty and its unit; where empty, the numbers are said as
    /// they are.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub said: Vec<String>,
}

/// An upright line with its name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointRule {
    /// Where (unit of the horizontal axis).
    pub at: f64,
    /// "mode 1".
    pub name: String,
    /// Whether it is a mode.
    pub mode: bool,
}

impl PointSet {
    /// Points at these places.
    pub(super) fn new(
        name: impl Into<String>,
        color: impl Into<String>,
        (mark, size): (&'static str, f64),
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> PointSet {
        let round = |(x, y)| (rounded(x), rounded(y));
        let (x, y) = points.into_iter().map(round).unzip();
        PointSet {
            name: name.into(),
            color: color.into(),
            mark,
            size,
            x,
            y,
            low: Vec::new(),
            high: Vec::new(),
            extra: Vec::new(),
            words: Vec::new(),
            said: Vec::new(),
        }
    }
}

impl PointAxis {
    /// An axis with the ends and the scale of the picture's.
    pub(super) fn of(axis: &Axis, label: &str, unit: &str) -> PointAxis {
        PointAxis {
            label: label.to_owned(),
            unit: unit.to_owned(),
            scale: match axis.scale {
                Scale::Linear => "linear",
                Scale::Logarithmic => "logarithmic",
            },
            range: [axis.low, axis.high],
            at: Vec::new(),
            names: Vec::new(),
        }
    }

    /// The same axis with names at some places.
    pub(super) fn named(mut self, places: impl IntoIterator<Item = (f64, String)>) -> PointAxis {
        (self.at, self.names) = places.into_iter().unzip();
        self
    }
}

/// A value with as many digits as zooming can show.
pub(super) fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", DIGITS - 1);
    text.parse().unwrap_or(value)
}

/// The stabilisation diagram: the whole band, then the bands about groups of peaks.
pub fn live_stabilisation(figure: &RecordingFigure) -> Option<LivePoints> {
    let spectra = figure.spectra.as_ref()?;
    let found = figure.stabilisation.as_ref()?;
    if found.bands.iter().all(|band| band.poles.is_empty()) {
        return None;
    }
    let views = found.bands.iter().enumerate().map(|(index, band)| {
        let name = if index == 0 {
            "whole band".to_owned()
        } else {
            named(spectra, band)
        };
        LiveView {
            name,
            panels: vec![pole_panel(spectra, band)],
        }
    });
    Some(LivePoints {
        kind: "points",
        views: views.collect(),
    })
}

fn pole_panel(spectra: &SpectraFigure, band: &StabilisationBand) -> PointPanel {
    let top = band.order as f64 + 1.0;
    let behind = thinned(level(spectra, band.core, top));
    let mut sets = vec![PointSet::new("level (log)", "data", ("line", 1.0), behind)];
    let classes = CLASSES.iter().rev();
    sets.extend(classes.filter_map(|(class, words)| pole_set(band, *class, words)));
    let on_axis = |at: f64| (band.core.0..=band.core.1).contains(&at);
    let rules = spectra.peaks.iter().filter(|peak| on_axis(peak.frequency));
    let axis = |label: &str, unit: &str, range: (f64, f64)| {
        PointAxis::of(&Axis::linear(range, (0.0, 1.0)), label, unit)
    };
    PointPanel {
        title: String::new(),
        height: HEIGHT,
        x: axis("frequency", "Hz", band.core),
        y: axis("order", "", (0.0, top)),
        extra: Some(["damping", "%"]),
        sets,
        rules: rules
            .map(|peak| PointRule {
                at: rounded(peak.frequency),
                name: peak.mode.map_or_else(
                    || peak.label.clone().unwrap_or_default(),
                    |mode| format!("mode {mode}"),
                ),
                mode: peak.mode.is_some(),
            })
            .collect(),
    }
}

/// The poles of one class; `None` without any.
fn pole_set(band: &StabilisationBand, class: PoleStability, words: &str) -> Option<PointSet> {
    let poles: Vec<&PoleMark> = band
        .poles
        .iter()
        .filter(|pole| pole.stability == class && pole.frequency.is_finite())
        .collect();
    if poles.is_empty() {
        return None;
    }
    let (color, mark) = match class {
        PoleStability::All => ("c2", ("dot", 3.5)),
        PoleStability::FrequencyAndDamping => ("c0", ("ring", 3.0)),
        PoleStability::FrequencyAndVector => ("c3", ("ring", 3.0)),
        PoleStability::Frequency => ("c4", ("ring", 3.0)),
        PoleStability::New => ("soft", ("cross", 2.5)),
    };
    let places = poles.iter().map(|pole| (pole.frequency, pole.order as f64));
    let mut set = PointSet::new(words, color, mark, places);
    let damping = |pole: &&PoleMark| format!("{:.3}", 100.0 * pole.damping_ratio).parse().ok();
    set.extra = poles.iter().filter_map(damping).collect();
    Some(set)
}

/// At most so many points: of every few the highest and the lowest, in their order.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= LEVEL_POINTS {
        return points;
    }
    let stride = (2 * points.len()).div_ceil(LEVEL_POINTS);
    let ends = |some: &[(f64, f64)]| {
        let low = some.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = some.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut both: Vec<(f64, f64)> = low.into_iter().chain(high).collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        both
    };
    points.chunks(stride).flat_map(ends).collect()
}

/// The estimates under changed frequencies, a panel for each method.
pub fn live_cloud(document: &Document) -> Option<LivePoints> {
    let clouds = clouds(document);
    if clouds.is_empty() {
        return None;
    }
    let panels = clouds.iter().map(|cloud| PointPanel {
        title: if clouds.len() > 1 {
            method_words(&cloud.method).to_owned()
        } else {
            String::new()
        },
        ..cloud_panel(cloud)
    });
    Some(LivePoints {
        kind: "points",
        views: vec![LiveView {
            name: "all".to_owned(),
            panels: panels.collect(),
        }],
    })
}

fn cloud_panel(cloud: &Cloud) -> PointPanel {
    let (x, y) = cloud.axes((0.0, 1.0), (0.0, 1.0));
    let random = cloud.random.iter().copied();
    let patterns = cloud.patterns.iter().copied();
    let shifted = cloud.shifted.iter().map(|(_, at)| *at);
    let mut alike = PointSet::new("all changed alike", "c4", ("cross", 5.0), shifted);
    let changed = |percent: f64| format!("{} %", signed(percent));
    alike.words = cloud.shifted.iter().map(|(p, _)| changed(*p)).collect();
    let sets = [
        PointSet::new("random errors", "data", ("dot", 1.8), random),
        PointSet::new(
            "every mode at an end of its bound",
            "c0",
            ("ring", 3.5),
            patterns,
        ),
        PointSet::new(
            "95 % ellipse",
            "c1",
            ("line", 2.0),
            cloud.ellipse.iter().copied(),
        ),
        alike,
        PointSet::new("estimate", "mode", ("dot", 5.0), cloud.estimate),
    ];
    PointPanel {
        title: String::new(),
        height: HEIGHT,
        x: PointAxis::of(&x, "Kx", ""),
        y: PointAxis::of(&y, "Ky", ""),
        extra: None,
        sets: sets.into_iter().filter(|set| !set.x.is_empty()).collect(),
        rules: Vec::new(),
    }
}
