//! The picture of the gap: errors with the described model and with the effect that is held for the cause, and
//! the odds.

use super::super::document::{Document, GapSection};
use super::super::format::{probability, signed_percent};
use super::super::tables::place_of;
use super::axis::{Axis, extent, padded};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::palette::{BLUE, GRID, INK, SKY, SOFT, VERMILION};
use super::panel::{LABEL_SIZE, Panel, Sample, TICK_SIZE, crisp, draw_legend, draw_title};
use super::spectrum::{LEFT, WIDTH};
use tapjoint_diagnosis::{Hypothesis, Residual, Verdict};

const HEIGHT: u32 = 520;
/// Right edge of the errors, left and right edge of the odds (pixels).
const ERRORS_RIGHT: f64 = 700.0;
const ODDS: (f64, f64) = (930.0, 1120.0);
const TOP: f64 = 112.0;
const BOTTOM: f64 = 450.0;
/// Hypotheses shown.
pub const MOST_BARS: usize = 9;
/// The axis reaches at least this far to either side of zero (%).
const LEAST_SPAN: f64 = 0.02;

/// What stands beside the errors of the described model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Explanation {
    /// The errors that this effect leaves: the most probable one of those that the verdict names.
    Effect(String),
    /// Nothing, because of this: what nobody holds for the cause explains nothing.
    Nothing(&'static str),
}

impl Explanation {
    /// What the verdict lets a picture show.
    pub fn of(gap: &GapSection) -> Explanation {
        match gap.verdict {
            Verdict::Named(_) | Verdict::Group(_) | Verdict::Set(_) => leader(gap).map_or(
                Explanation::Nothing("no effect is more probable than none"),
                Explanation::Effect,
            ),
            Verdict::NoGap => Explanation::Nothing("nothing is missing"),
            Verdict::Unknown => Explanation::Nothing("nothing in the catalogue explains the rest"),
            _ => Explanation::Nothing("these data do not decide what is missing"),
        }
    }

    /// The effect, where there is one.
    pub fn effect(self) -> Option<String> {
        match self {
            Explanation::Effect(name) => Some(name),
            Explanation::Nothing(_) => None,
        }
    }

    /// "with the described model, and with sensor-mass", or why there is nothing to compare it with.
    fn words(self) -> String {
        match self {
            Explanation::Effect(name) => format!("with the described model, and with {name}"),
            Explanation::Nothing(why) => format!("with the described model ({why})"),
        }
    }
}

/// The hypothesis whose errors the diagnosis gives: the most probable one that predicts anything. `None` where
/// that is the described model itself.
fn leader(gap: &GapSection) -> Option<String> {
    let mut predicting = gap.hypotheses.iter().map(|found| &found.hypothesis);
    let first = predicting.find(|one| **one != Hypothesis::Unknown)?;
    (*first != Hypothesis::None).then(|| first.name())
}

/// What the picture shows, for the page.
pub fn gap_caption(document: &Document) -> String {
    let gap = document.gap.as_ref();
    let shown = gap.map_or_else(String::new, |gap| Explanation::of(gap).words());
    format!("The gap: every frequency's error {shown}; and how probable each hypothesis is.")
}

/// Errors and odds; `None` without a diagnosis.
pub fn draw_gap(document: &Document) -> Option<Drawing> {
    let gap = document.gap.as_ref()?;
    let pulls = &gap.place.as_ref()?.modes;
    if pulls.is_empty() {
        return None;
    }
    let shown = Explanation::of(gap).words();
    let description = format!("The gap: errors of the frequencies {shown}");
    let mut drawing = Drawing::new(description, WIDTH, HEIGHT);
    draw_title(
        &mut drawing,
        "Gap between model and measurement",
        &format!("left: every frequency of every recording {shown}; right: what may be missing"),
    );
    draw_errors(&mut drawing, gap, pulls);
    draw_odds(&mut drawing, gap);
    Some(drawing)
}

fn draw_errors(drawing: &mut Drawing, gap: &GapSection, pulls: &[Residual]) {
    let panel = errors_panel(gap, pulls);
    let last = last_mode(pulls);
    panel.draw_y_ticks(drawing, &panel.y.ticks(36.0));
    let y = crisp(panel.y.place(0.0));
    drawing.line(
        vec![(LEFT + 8.0, y), (ERRORS_RIGHT, y)],
        Stroke::new(INK, 1.0),
    );
    panel.draw_frame(drawing);
    let effect = Explanation::of(gap).effect();
    for pull in pulls {
        draw_pull(drawing, &panel, (pulls, pull), effect.as_deref());
    }
    for mode in 1..=last {
        let at = (panel.x.place(mode as f64), BOTTOM + 18.0);
        drawing.text(Text::new(format!("mode {mode}"), at, TICK_SIZE).aligned(Align::Middle));
    }
    panel.draw_y_title(drawing, "error of the frequency (%)");
    draw_legend(drawing, (LEFT, 88.0), ERRORS_RIGHT, &legend(gap, last));
}

fn legend(gap: &GapSection, last: usize) -> Vec<(Sample, String)> {
    let withheld = gap
        .fitted_modes
        .filter(|fitted| *fitted < last)
        .map_or_else(String::new, |fitted| {
            format!("; modes above {fitted} took no part")
        });
    let described = "described model, joint fitted";
    match Explanation::of(gap) {
        Explanation::Effect(name) => vec![
            (Sample::Ring(VERMILION), described.to_owned()),
            (Sample::Dot(BLUE), format!("with {name}{withheld}")),
        ],
        Explanation::Nothing(_) => {
            vec![(Sample::Ring(VERMILION), format!("{described}{withheld}"))]
        }
    }
}

/// The errors of one frequency, and what they are in words.
fn draw_pull(
    drawing: &mut Drawing,
    panel: &Panel,
    (pulls, pull): (&[Residual], &Residual),
    effect: Option<&str>,
) {
    let x = abscissa(pulls, pull);
    let before = panel.place(x, pull.error_percent);
    drawing.ring(before, 4.5, VERMILION);
    let mut words = format!(
        "mode {} in {}: error {} % with the described model",
        pull.mode,
        place_of(pull),
        signed_percent(Some(pull.error_percent))
    );
    let mut after = before;
    if let Some(effect) = effect {
        after = panel.place(x, pull.error_percent_after);
        drawing.dot(after, 4.0, BLUE);
        let left = signed_percent(Some(pull.error_percent_after));
        words.push_str(&format!(", {left} % with {effect}"));
    }
    let (top, bottom) = (before.1.min(after.1), before.1.max(after.1));
    drawing.note(
        (before.0 - 6.0, top - 7.0),
        (before.0 + 6.0, bottom + 7.0),
        words,
    );
}

/// The axes: mode numbers, and errors of their frequencies (%).
pub fn errors_panel(gap: &GapSection, pulls: &[Residual]) -> Panel {
    let explained = Explanation::of(gap).effect().is_some();
    let after = |pull: &Residual| explained.then_some(pull.error_percent_after);
    let ends = pulls
        .iter()
        .flat_map(|pull| [pull.error_percent, after(pull).unwrap_or(0.0), 0.0]);
    let (low, high) = extent(ends).unwrap_or((-1.0, 1.0));
    let last = last_mode(pulls) as f64 + 0.6;
    Panel {
        x: Axis::linear((0.4, last), (LEFT + 8.0, ERRORS_RIGHT)),
        y: Axis::linear(
            padded((low.min(-LEAST_SPAN), high.max(LEAST_SPAN)), 0.1),
            (BOTTOM, TOP),
        ),
    }
}

fn last_mode(pulls: &[Residual]) -> usize {
    pulls.iter().map(|pull| pull.mode).max().unwrap_or(1)
}

/// Where an error stands: the tap levels of all recordings that saw a mode stand beside each other over half
/// its width.
pub fn abscissa(pulls: &[Residual], pull: &Residual) -> f64 {
    // One recording can hold taps of two levels, which saw the mode apart.
    let seat = |pull: &Residual| (pull.recording.clone(), pull.level);
    let mut seats = Vec::new();
    for other in pulls.iter().filter(|other| other.mode == pull.mode) {
        if !seats.contains(&seat(other)) {
            seats.push(seat(other));
        }
    }
    let place = seats.iter().position(|taken| *taken == seat(pull));
    let share = (place.unwrap_or(0) as f64 + 0.5) / seats.len().max(1) as f64;
    pull.mode as f64 + 0.5 * (share - 0.5)
}

fn draw_odds(drawing: &mut Drawing, gap: &GapSection) {
    let title = Text::new("probability", (ODDS.0, TOP - 18.0), LABEL_SIZE);
    drawing.text(title.bold());
    let step = (BOTTOM - TOP) / MOST_BARS as f64;
    for (row, found) in gap.hypotheses.iter().take(MOST_BARS).enumerate() {
        let top = TOP + step * row as f64 + 4.0;
        let bottom = top + step - 12.0;
        drawing.rectangle((ODDS.0, top), (ODDS.1, bottom), GRID, 0.6);
        let end = ODDS.0 + found.probability * (ODDS.1 - ODDS.0);
        let named = gap.verdict.hypotheses().contains(&found.hypothesis);
        drawing.rectangle(
            (ODDS.0, top),
            (end, bottom),
            if named { BLUE } else { SKY },
            1.0,
        );
        let middle = 0.5 * (top + bottom);
        let name = Text::new(found.hypothesis.name(), (ODDS.0 - 10.0, middle), TICK_SIZE);
        drawing.text(name.aligned(Align::End));
        let value = probability(found.probability);
        let words = format!("{}: probability {value}", found.hypothesis.name());
        drawing.note((ERRORS_RIGHT + 20.0, top), (ODDS.1, bottom), words);
        drawing.text(Text::new(value, (ODDS.1 + 8.0, middle), TICK_SIZE).colored(SOFT));
    }
}
