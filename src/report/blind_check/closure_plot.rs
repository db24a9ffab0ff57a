//! How far the gap closes on data that took no part in the fit, for right and for wrong names.

use super::super::plot::Drawing;
use super::super::plot::axis::Axis;
use super::super::plot::drawing::Stroke;
use super::super::plot::palette::{BLUE, VERMILION};
use super::super::plot::panel::{Panel, Sample, draw_legend, draw_title};
use tapjoint_study::blind_check::{Case, CaseKind, Verdict};

/// Closures below this are drawn at it: an effect that makes things much worse.
const LEAST: f64 = -1.0;

/// Closures of all named tests with one effect, sorted; `None` without any.
pub(super) fn draw_closure(cases: &[Case]) -> Option<Drawing> {
    let right = closures(cases, true);
    let wrong = closures(cases, false);
    if right.is_empty() && wrong.is_empty() {
        return None;
    }
    let mut drawing = Drawing::new("Closure on withheld data", 900, 640);
    draw_title(
        &mut drawing,
        "How far the named effect closes the gap on withheld data",
        "1 = down to the noise, 0 = not at all; tests sorted by closure; one effect planted",
    );
    let panel = Panel {
        x: Axis::linear((0.0, 1.0), (90.0, 860.0)),
        y: Axis::linear((LEAST - 0.05, 1.1), (560.0, 110.0)),
    };
    panel.draw_axes(&mut drawing);
    panel.draw_x_title(&mut drawing, "share of tests (1)");
    panel.draw_y_title(&mut drawing, "closure (1)");
    for (values, color) in [(&right, BLUE), (&wrong, VERMILION)] {
        let points: Vec<(f64, f64)> = values
            .iter()
            .enumerate()
            .map(|(index, value)| {
                panel.place((index as f64 + 0.5) / values.len() as f64, value.max(LEAST))
            })
            .collect();
        for at in &points {
            drawing.dot(*at, 3.5, color);
        }
        drawing.line(points, Stroke::new(color, 1.2));
    }
    let legend = [
        (
            Sample::Dot(BLUE),
            format!("right name ({} tests)", right.len()),
        ),
        (
            Sample::Dot(VERMILION),
            format!("wrong name ({} tests)", wrong.len()),
        ),
    ];
    draw_legend(&mut drawing, (90.0, 84.0), 860.0, &legend);
    Some(drawing)
}

fn closures(cases: &[Case], right: bool) -> Vec<f64> {
    let mut values: Vec<f64> = cases
        .iter()
        .filter_map(|(truth, answer)| {
            let CaseKind::Single(id) = truth.kind() else {
                return None;
            };
            let named = answer.verdict == Verdict::Named;
            let is_right = answer.named_groups() == [id.group()];
            answer.closure.filter(|_| named && is_right == right)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    values
}
