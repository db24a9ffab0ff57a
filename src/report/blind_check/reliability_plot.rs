//! Stated probabilities against how often they were right.

use super::super::plot::Drawing;
use super::super::plot::axis::Axis;
use super::super::plot::drawing::{Align, Stroke, Text};
use super::super::plot::palette::{BLUE, SOFT};
use super::super::plot::panel::{Panel, TICK_SIZE, draw_title};
use tapjoint_study::blind_check::Calibration;

/// The reliability diagram: on the diagonal probabilities are what they say.
pub(super) fn draw_reliability(calibration: &Calibration) -> Drawing {
    let mut drawing = Drawing::new(
        "Stated probability against share of right answers",
        900,
        640,
    );
    let ece = calibration
        .expected_calibration_error
        .map_or("-".to_owned(), |ece| format!("{ece:.3}"));
    let brier = calibration
        .brier
        .map_or("-".to_owned(), |brier| format!("{brier:.3}"));
    draw_title(
        &mut drawing,
        "How far the stated probabilities can be trusted",
        &format!(
            "expected calibration error {ece}, Brier score {brier}; numbers: cases in the bin"
        ),
    );
    let panel = Panel {
        x: Axis::linear((0.0, 1.0), (90.0, 860.0)),
        y: Axis::linear((0.0, 1.05), (560.0, 90.0)),
    };
    panel.draw_axes(&mut drawing);
    panel.draw_x_title(&mut drawing, "stated probability of the first class (1)");
    panel.draw_y_title(&mut drawing, "share of right answers (1)");
    let diagonal = (panel.place(0.0, 0.0), panel.place(1.0, 1.0));
    drawing.dashed(diagonal.0, diagonal.1, (6.0, 5.0), Stroke::new(SOFT, 1.5));
    let known = calibration
        .reliability
        .iter()
        .filter_map(|bin| Some((bin.stated?, bin.right?, bin.cases)));
    for (stated, right, cases) in known {
        let at = panel.place(stated, right);
        drawing.dot(at, 6.0, BLUE);
        let text = Text::new(cases.to_string(), (at.0, at.1 - 14.0), TICK_SIZE);
        drawing.text_on_paper(text.aligned(Align::Middle).colored(BLUE));
    }
    drawing
}
