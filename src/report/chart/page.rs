//! A chart as the page's script draws it: JSON for uPlot, thinned where there is more than a screen can
//! show, with every number rounded to what zooming can tell apart.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;

use super::axis::{Axis, Scale};
use super::thinning::{Stretch, stretches, thinned};
use super::{Chart, InPage, Mark, Panel, Places, Rule, Series};
use crate::ReportError;
use crate::format::significant;

/// Most numbers of a curve about a tap: the force's pulse of a millisecond keeps some ten, while a hundred taps
/// stay below half a megabyte.
const MOST_NUMBERS: usize = 400;
/// Numbers about a tap are whole parts of the largest: half a pixel of the curve's height.
const PARTS: f64 = 500.0;
/// Significant digits of a curve's values, of which hovering shows four.
const CURVE_DIGITS: usize = 4;
/// Significant digits of places, so that close poles stay apart when they are zoomed.
const PLACE_DIGITS: usize = 7;
/// Height of the panels of a view with few and with many of them (pixels).
const HIGH: f64 = 360.0;
const LOW: f64 = 210.0;
/// Panels up to which a view has few.
const FEW: usize = 3;
/// Effort of deflating the page's curves: zlib's usual level 6 takes nearly three times as long and saves a tenth.
const DEFLATION: Compression = Compression::new(3);

/// A chart for the page's script.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum PageChart {
    /// Curves over one horizontal axis.
    Curves(Curves),
    /// Single points.
    Points(Points),
}

/// Curves over one horizontal axis, in panels below each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curves {
    /// "spectrum", "frf" or "taps".
    pub kind: &'static str,
    /// Horizontal axis.
    pub x: CurveAxis,
    /// The panels, topmost first.
    pub panels: Vec<CurvePanel>,
    /// Resonances.
    pub marks: Vec<CurveMark>,
    /// Taps.
    pub taps: Vec<Tap>,
    /// Sentence on what the curves leave out; empty where nothing.
    pub note: String,
}

/// Points, equally spaced piece by piece.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurveAxis {
    /// "frequency".
    pub label: String,
    /// "Hz".
    pub unit: String,
    /// First point (unit), distance of the points (unit) and their number, of each piece.
    pub runs: Vec<(f64, f64, usize)>,
}

/// One panel of curves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurvePanel {
    /// Quantity of its vertical axis: "magnitude, rms".
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// "linear" or "logarithmic".
    pub scale: &'static str,
    /// Height (pixels).
    pub height: f64,
    /// Fixed ends of the axis; `None` = what is shown decides.
    pub range: Option<[f64; 2]>,
    /// Length of a turn where values come round again.
    pub period: Option<f64>,
    /// The curves.
    pub series: Vec<CurveValues>,
}

/// One curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurveValues {
    /// Its name in the legend.
    pub name: String,
    /// Name of its colour in the page's style.
    pub color: &'static str,
    /// 0 to 1.
    pub opacity: f64,
    /// One value for each point; null where there is none.
    pub values: Vec<Option<f64>>,
}

/// A resonance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurveMark {
    /// Best frequency (Hz).
    pub at: f64,
    /// Frequency on the line (Hz).
    pub line: f64,
    /// Bound of the line reading (Hz).
    pub half: f64,
    /// "mode 1", "mains 50 Hz".
    pub name: String,
    /// "17.003 Hz".
    pub words: String,
    /// True for a mode.
    pub mode: bool,
}

/// A tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tap {
    /// Time (s).
    pub at: f64,
    /// Peak (unit of the panel).
    pub peak: Option<f64>,
    /// "tap 3".
    pub name: String,
    /// "used, 0.313 s, 41.2 N" or "rejected, 6.210 s, 12 N: double hit".
    pub words: String,
    /// True for a tap that was used.
    pub used: bool,
    /// The samples about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub close_up: Option<CloseUp>,
}

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CloseUp {
    /// First point (ms from the trigger).
    pub start: f64,
    /// Distance of the points (ms).
    pub step: f64,
    /// The curves, the force's first.
    pub curves: Vec<CloseUpCurve>,
    /// Sentence on what the curves leave out; empty where nothing.
    pub note: String,
}

/// A curve about a tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CloseUpCurve {
    /// "force".
    pub label: String,
    /// "N".
    pub unit: String,
    /// One whole part (unit).
    pub part: f64,
    /// The values (parts).
    pub values: Vec<i32>,
}

/// Panels of single points, one view of them at a time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Points {
    /// "points".
    pub kind: &'static str,
    /// Views to choose among; the first is shown.
    pub views: Vec<View>,
}

/// Panels that are shown together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct View {
    /// "whole band", "mode 1".
    pub name: String,
    /// The panels.
    pub panels: Vec<PointPanel>,
}

/// One panel of points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointPanel {
    /// Its title.
    pub title: String,
    /// Height (pixels).
    pub height: f64,
    /// Horizontal axis.
    pub x: PointAxis,
    /// Vertical axis.
    pub y: PointAxis,
    /// Name and unit of the points' further facts.
    pub extra: Option<[&'static str; 2]>,
    /// The points, the lowest layer first.
    pub sets: Vec<PointSet>,
    /// Upright lines.
    pub rules: Vec<PointRule>,
}

/// An axis of a panel of points.
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
    /// Name of its colour in the page's style.
    pub color: &'static str,
    /// "dot", "ring", "cross", "square", "line", "band", "bar" from 0 to its place, or "curve": a line whose
    /// points answer the pointer.
    pub mark: &'static str,
    /// Radius, of a line its width (pixels).
    pub size: f64,
    /// Places (unit of the axis).
    pub x: Vec<f64>,
    /// Places (unit of the axis); empty for a band.
    pub y: Vec<f64>,
    /// Lower ends of error bars or of a band; may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub low: Vec<f64>,
    /// Upper ends.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub high: Vec<f64>,
    /// Further facts (unit of the panel's `extra`).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub extra: Vec<f64>,
    /// Name of each point.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// Height of each point with its uncertainty and its unit; where empty, the numbers are shown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub said: Vec<String>,
}

/// An upright line with its name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointRule {
    /// Place (unit of the horizontal axis).
    pub at: f64,
    /// "mode 1".
    pub name: String,
    /// True for a mode.
    pub mode: bool,
}

/// A chart as it stands in the page: JSON, deflated, since numbers take up most of it, and in base 64. Browsers
/// inflate it by themselves; one that cannot shows the picture.
///
/// # Errors
/// [`ReportError::Json`] where it is no JSON.
pub fn packed(chart: &PageChart) -> Result<String, ReportError> {
    let mut deflated = ZlibEncoder::new(Vec::new(), DEFLATION);
    serde_json::to_writer(&mut deflated, chart).map_err(ReportError::Json)?;
    let finished = deflated.finish().map_err(serde_json::Error::io);
    Ok(BASE64_STANDARD.encode(finished.map_err(ReportError::Json)?))
}

impl Chart {
    /// The chart for the page's script; `None` where nothing can be drawn.
    pub fn page(&self) -> Option<PageChart> {
        let blocks = self.blocks.iter();
        let shown = blocks.filter(|block| block.in_page != InPage::Absent);
        let panels: Vec<&Panel> = shown.flat_map(|block| &block.panels).collect();
        let series = || panels.iter().flat_map(|panel| &panel.series);
        let most = series().map(Series::count).max().filter(|most| *most > 0)?;
        if series().all(|one| matches!(one.x, Places::Even(..))) {
            return self.curves(&panels, most).map(PageChart::Curves);
        }
        let mut views = Vec::new();
        for block in self
            .blocks
            .iter()
            .filter(|one| one.in_page != InPage::Absent)
        {
            if block.in_page == InPage::Together {
                let name = block.name.clone();
                views.push(view(name, &block.panels));
                continue;
            }
            for panel in &block.panels {
                let name = panel.title.clone();
                views.push(view(name, std::slice::from_ref(panel)));
            }
        }
        let kind = "points";
        Some(PageChart::Points(Points { kind, views }))
    }

    fn curves(&self, panels: &[&Panel], lines: usize) -> Option<Curves> {
        let first = panels.first()?;
        let Places::Even(start, step) = first.series.first()?.x else {
            return None;
        };
        let modes = first.rules.iter().filter(|rule| rule.mode);
        let modes = modes.map(|rule| ((rule.at - start) / step).round().max(0.0) as usize);
        let modes: Vec<usize> = modes.collect();
        let bands = panels.iter().flat_map(|panel| &panel.series);
        let envelope = bands.into_iter().any(|series| series.mark == Mark::Band);
        let stretches = if envelope {
            vec![Stretch {
                lines: 0..lines,
                stride: 1,
            }]
        } else {
            stretches(lines, &modes)
        };
        let mut runs = Vec::new();
        for stretch in &stretches {
            let (first, apart, count) = stretch.points();
            runs.push((start + first * step, apart * step, count));
        }
        let stride = stretches.iter().map(|one| one.stride).max().unwrap_or(1);
        let note = if envelope {
            let kept = first.events.iter().any(|event| !event.close_up.is_empty());
            let click = if kept {
                " Click a tap for its samples."
            } else {
                ""
            };
            let step = significant(step, 2);
            format!("Each point is the smallest and largest value of {step} s.{click}")
        } else if stride > 1 && modes.is_empty() {
            format!("Of {lines} lines the smallest and largest of every {stride} are drawn.")
        } else if stride > 1 {
            format!(
                "All lines about the modes are drawn; of the other lines the smallest and largest of every {stride}."
            )
        } else {
            String::new()
        };
        Some(Curves {
            kind: self.kind,
            x: CurveAxis {
                label: first.x.label.clone(),
                unit: first.x.unit.clone(),
                runs,
            },
            panels: panels
                .iter()
                .map(|panel| curve_panel(panel, lines, &stretches))
                .collect(),
            marks: first.rules.iter().filter_map(mark).collect(),
            taps: taps(first),
            note,
        })
    }
}

fn curve_panel(panel: &Panel, lines: usize, stretches: &[Stretch]) -> CurvePanel {
    let mut series = Vec::new();
    for one in &panel.series {
        let parts = match one.mark {
            Mark::Band => vec![("smallest", &one.low), ("largest", &one.high)],
            _ => vec![(one.name.as_str(), &one.y)],
        };
        for (name, values) in parts {
            let known = values.iter().map(|value| shown(*value, CURVE_DIGITS));
            let missing = std::iter::repeat_n(None, lines.saturating_sub(values.len()));
            let all: Vec<Option<f64>> = known.chain(missing).collect();
            series.push(CurveValues {
                name: name.to_owned(),
                color: one.color.css(),
                opacity: one.opacity,
                values: stretches
                    .iter()
                    .flat_map(|part| part.thinned(&all))
                    .collect(),
            });
        }
    }
    let linear = panel.y.scale == Scale::Linear;
    let fixed = linear && panel.series.iter().all(|one| one.mark != Mark::Band);
    CurvePanel {
        label: panel.y.label.clone(),
        unit: panel.y.unit.clone(),
        scale: scale(&panel.y),
        height: panel.height,
        range: fixed.then_some([panel.y.low, panel.y.high]),
        period: panel.y.period,
        series,
    }
}

fn scale(axis: &Axis) -> &'static str {
    match axis.scale {
        Scale::Linear => "linear",
        Scale::Logarithmic => "logarithmic",
    }
}

/// A value with so many significant digits; `None` where it is no number.
fn shown(value: f64, digits: usize) -> Option<f64> {
    let rounded = format!("{value:.*e}", digits - 1);
    rounded.parse().ok().filter(|value: &f64| value.is_finite())
}

/// A place with as many digits as zooming can show.
fn rounded(value: f64) -> f64 {
    shown(value, PLACE_DIGITS).unwrap_or(value)
}

fn mark(rule: &Rule) -> Option<CurveMark> {
    let finite = [rule.at, rule.line, rule.half];
    finite
        .iter()
        .all(|value| value.is_finite())
        .then(|| CurveMark {
            at: rule.at,
            line: rule.line,
            half: rule.half,
            name: rule.name.clone(),
            words: rule.words.clone(),
            mode: rule.mode,
        })
}

fn taps(panel: &Panel) -> Vec<Tap> {
    let events = panel.events.iter().enumerate();
    let tap = events.map(|(index, event)| Tap {
        at: event.at,
        peak: shown(event.peak, CURVE_DIGITS),
        name: format!("tap {}", index + 1),
        words: event.words.clone(),
        used: event.used,
        close_up: close_up(&event.close_up),
    });
    tap.collect()
}

/// The samples about a tap, thinned where there are more than a screen can show; `None` without any.
fn close_up(panels: &[Panel]) -> Option<CloseUp> {
    let series = || panels.iter().flat_map(|panel| panel.series.first());
    let count = series()
        .map(Series::count)
        .max()
        .filter(|count| *count > 0)?;
    let Places::Even(start, step) = series().next()?.x else {
        return None;
    };
    let stride = if count > MOST_NUMBERS {
        (2 * count).div_ceil(MOST_NUMBERS)
    } else {
        1
    };
    let whole = Stretch {
        lines: 0..count,
        stride,
    };
    let (first, apart, _) = whole.points();
    let mut curves = Vec::new();
    for (panel, series) in panels.iter().zip(series()) {
        let finite = series.y.iter().filter(|value| value.is_finite());
        let largest = finite.fold(0.0_f64, |most, value| most.max(value.abs()));
        let part = shown(largest / PARTS, 4).filter(|part| *part > 0.0);
        let part = part.unwrap_or(1.0);
        // A value that is no number becomes 0.
        let known = series
            .y
            .iter()
            .map(|value| Some(*value).filter(|value| value.is_finite()));
        let missing = std::iter::repeat_n(None, count - series.y.len());
        let values = whole.thinned(&known.chain(missing).collect::<Vec<_>>());
        let parts = values
            .iter()
            .map(|value| (value.unwrap_or(0.0) / part).round() as i32);
        curves.push(CloseUpCurve {
            label: panel.y.label.clone(),
            unit: panel.y.unit.clone(),
            part,
            values: parts.collect(),
        });
    }
    let note = if stride > 1 {
        let every = significant(stride as f64 * step, 2);
        format!("The smallest and largest value of every {every} ms.")
    } else {
        String::new()
    };
    Some(CloseUp {
        start: start + first * step,
        step: apart * step,
        curves,
        note,
    })
}

fn view(name: String, panels: &[Panel]) -> View {
    let height = if panels.len() > FEW { LOW } else { HIGH };
    let panels = panels.iter().map(|panel| PointPanel {
        title: panel.title.clone(),
        height,
        x: point_axis(&panel.x),
        y: point_axis(&panel.y),
        extra: panel.extra,
        sets: panel
            .series
            .iter()
            .map(|series| set(series, &panel.x))
            .collect(),
        rules: panel.rules.iter().map(point_rule).collect(),
    });
    View {
        name,
        panels: panels.collect(),
    }
}

fn point_axis(axis: &Axis) -> PointAxis {
    let labelled = axis.names.iter().filter_map(|tick| {
        let label = tick.label.as_deref()?;
        Some((
            tick.value,
            label.lines().next().unwrap_or_default().to_owned(),
        ))
    });
    let (at, names) = labelled.unzip();
    PointAxis {
        label: axis.label.clone(),
        unit: axis.unit.clone(),
        scale: scale(axis),
        range: [axis.low, axis.high],
        at,
        names,
    }
}

fn point_rule(rule: &Rule) -> PointRule {
    PointRule {
        at: rounded(rule.at),
        name: rule.name.clone(),
        mode: rule.mode,
    }
}

fn set(series: &Series, axis: &Axis) -> PointSet {
    let (mark, size) = match series.mark {
        Mark::Dot(size) => ("dot", size),
        Mark::Ring(size) => ("ring", size),
        Mark::Cross(size) => ("cross", size),
        Mark::Square(size) => ("square", size),
        Mark::Line(size) | Mark::Dashed(size) => ("line", size),
        Mark::Curve(size) => ("curve", size),
        Mark::Band => ("band", 0.0),
        Mark::Bar(size) => ("bar", size),
        Mark::Cell => ("square", 8.0),
    };
    let each = |values: &[f64]| {
        values
            .iter()
            .map(|value| rounded(*value))
            .collect::<Vec<f64>>()
    };
    let mut x: Vec<f64> = (0..series.count())
        .map(|index| rounded(series.at(index)))
        .collect();
    let mut y = each(&series.y);
    if let Places::Even(..) = series.x {
        let points = x
            .into_iter()
            .zip(y)
            .filter(|(x, y)| axis.holds(*x) && y.is_finite());
        (x, y) = thinned(points.collect()).into_iter().unzip();
    }
    PointSet {
        name: series.name.clone(),
        color: series.color.css(),
        mark,
        size,
        x,
        y,
        low: each(&series.low),
        high: each(&series.high),
        extra: each(&series.extra),
        words: series.words.clone(),
        said: series.said.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Color;
    use super::*;

    /// A pulse of half a sine, 1 ms long, that begins at the trigger.
    fn pulse(rate: f64) -> Panel {
        let value = |k: usize| {
            let time = k as f64 / rate - 2e-3;
            let inside = (0.0..1e-3).contains(&time);
            if inside {
                40.0 * (std::f64::consts::PI * time / 1e-3).sin()
            } else {
                0.0
            }
        };
        let values = (0..(0.032 * rate) as usize).map(value).collect();
        let series = Series::even("force", Color::Soft, -2.0, 1e3 / rate, values);
        Panel::new(190.0, Axis::linear(0.0, 1.0), Axis::linear(0.0, 1.0)).with([series])
    }

    #[test]
    fn prop_a_pulse_keeps_its_height_its_place_and_its_length() {
        for rate in [2048.0, 12_800.0, 51_200.0, 200_000.0] {
            let live = close_up(&[pulse(rate)]).expect("samples");
            let curve = &live.curves[0];
            assert!(curve.values.len() <= MOST_NUMBERS + 2, "{rate}");
            let value = |k: usize| f64::from(curve.values[k]) * curve.part;
            let time = |k: usize| live.start + live.step * k as f64;
            let largest = (0..curve.values.len())
                .max_by_key(|k| curve.values[*k])
                .expect("values");
            let spacing = (1e3 / rate).max(live.step);
            assert!(
                (value(largest) - 40.0).abs() < 40.0 * (1.6 * spacing).powi(2) + 0.1,
                "{rate}"
            );
            assert!(
                (time(largest) - 0.5).abs() <= spacing,
                "{rate}: {}",
                time(largest)
            );
            let high = (0..curve.values.len())
                .filter(|k| value(*k) > 4.0)
                .map(time);
            let length = high.clone().fold(f64::MIN, f64::max) - high.fold(f64::MAX, f64::min);
            assert!((length - 0.93).abs() <= 2.0 * spacing, "{rate}: {length}");
        }
    }

    #[test]
    fn limit_without_samples_there_is_no_close_up_and_silence_is_flat() {
        let mut panel = pulse(2048.0);
        panel.series[0].y.fill(0.0);
        let live = close_up(&[panel.clone()]).expect("samples");
        assert!(live.curves[0].values.iter().all(|value| *value == 0));
        panel.series[0].y.clear();
        assert_eq!(close_up(&[panel]), None);
    }
}
