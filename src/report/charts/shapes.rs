//! Mode shapes with the places of sensors and taps.

use std::collections::BTreeMap;

use super::super::chart::{Axis, Block, Chart, Color, Mark, Panel, Series};
use super::super::document::Document;
use super::super::format::significant;
use tapjoint_analysis::SampledShape;
use tapjoint_beam::Assembly;

/// Panels in a row.
const ACROSS: usize = 3;
/// Most modes drawn: a dozen fits a page.
const MOST: usize = 12;

/// Shapes of the predicted modes; `None` without any.
pub fn shapes(document: &Document) -> Option<Chart> {
    let shapes = document.mode_shapes.as_deref().unwrap_or_default();
    let (mut sensors, mut taps) = (BTreeMap::<&str, Vec<f64>>::new(), Vec::new());
    for recording in document.recordings.iter().flatten() {
        for (name, place) in &recording.conditions.sensor_positions {
            let places = sensors.entry(name).or_default();
            if !places.contains(place) {
                places.push(*place);
            }
        }
        taps.extend(recording.conditions.tap.filter(|tap| !taps.contains(tap)));
    }
    let kind = document.kind();
    let mut panels = Vec::new();
    for shape in shapes.iter().take(MOST) {
        panels.push(panel(shape, &sensors, &taps, kind));
    }
    (!panels.is_empty()).then(|| Chart {
        kind: "mode-shapes",
        title: "Mode shapes".to_owned(),
        subtitle: "displacement over the position along the beam, each relative to its largest".to_owned(),
        caption: "Shapes of the predicted modes, of the described beam on the estimated joint with what sits \
                  on it. A sensor or a tap near a node hardly sees the mode."
            .to_owned(),
        blocks: vec![Block::new(ACROSS, panels)],
        ..Chart::default()
    })
}

fn panel(
    shape: &SampledShape,
    sensors: &BTreeMap<&str, Vec<f64>>,
    taps: &[f64],
    kind: Option<Assembly>,
) -> Panel {
    let end = 1e3 * shape.positions.last().copied().unwrap_or(1.0);
    let x = Axis::linear(0.0, end).of("position", "mm");
    let y = Axis::linear(-1.2, 1.2).of("displacement", "");
    let points = shape.positions.iter().zip(&shape.displacements);
    let points: Vec<(f64, f64)> = points.map(|(at, y)| (1e3 * at, *y)).collect();
    let mut series = Vec::new();
    // A lap joint's halves end at one place and need not meet.
    for half in points.chunk_by(|before, after| before.0 < after.0) {
        let half = half.iter().copied();
        let mut curve = Series::points("mode shape", Color::Blue, Mark::Curve(2.5), half);
        let said = curve.y.iter().map(|value| significant(*value, 2));
        curve.said = said.map(|value| value + " of its largest").collect();
        series.push(curve);
    }
    let lap = points.windows(2).find(|pair| pair[0].0 == pair[1].0);
    let joint = match lap {
        Some(pair) => Some(pair[0].0),
        None => (kind == Some(Assembly::Cantilever)).then_some(0.0),
    };
    let joint = joint.map(|at| (at, 0.0));
    series.push(Series::points(
        "joint",
        Color::Soft,
        Mark::Square(5.0),
        joint,
    ));
    let mut tapped = Series::new("tap", Color::Vermilion, Mark::Cross(6.0));
    for place in taps {
        tapped.push(1e3 * place, displacement(shape, *place));
        tapped.words.push(format!("mode {}", shape.mode));
    }
    series.push(tapped);
    for (name, places) in sensors {
        let mut sensed = Series::new("sensor", Color::Orange, Mark::Dot(5.0));
        for place in places {
            sensed.push(1e3 * place, displacement(shape, *place));
            sensed.words.push(format!("{name}: mode {}", shape.mode));
            sensed.labels.push((*name).to_owned());
        }
        series.push(sensed);
    }
    let title = format!(
        "mode {}, {} Hz",
        shape.mode,
        significant(shape.frequency, 4)
    );
    let panel = Panel::new(128.0, x, y).titled(title);
    panel.with_zero().with(series)
}

/// Displacement at a place, between the points next to it.
fn displacement(shape: &SampledShape, place: f64) -> f64 {
    let after = shape.positions.partition_point(|x| *x < place);
    let points = shape.positions.iter().zip(&shape.displacements);
    let mut near = points.skip(after.saturating_sub(1));
    match (near.next(), near.next()) {
        (Some((x0, y0)), Some((x1, y1))) if after > 0 && x1 > x0 => {
            y0 + (y1 - y0) * (place - x0) / (x1 - x0)
        }
        (Some(_), Some((_, y))) if after > 0 => *y,
        (Some((_, y)), _) => *y,
        (None, _) => 0.0,
    }
}
