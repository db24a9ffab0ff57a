//! What was planted against what came first.

use std::collections::BTreeMap;

use super::super::plot::Drawing;
use super::super::plot::drawing::{Align, Text};
use super::super::plot::palette::{BLUE, GRID, INK, SOFT, WHITE};
use super::super::plot::panel::{LABEL_SIZE, TICK_SIZE, draw_title};
use tapjoint_beam::effects::EffectId;
use tapjoint_study::blind_check::{Case, Class};

const WIDTH: u32 = 1200;
const LEFT: f64 = 230.0;
const TOP: f64 = 190.0;
const CELL: (f64, f64) = (62.0, 34.0);

/// The confusion matrix: rows are what was planted, columns the most probable class; each cell holds
/// the number of cases, and its shade their share of the row.
pub(super) fn draw_confusion(cases: &[Case]) -> Drawing {
    let classes = classes();
    let counts = counts(cases);
    let height = TOP + CELL.1 * classes.len() as f64 + 40.0;
    let mut drawing = Drawing::new(
        "Planted against most probable classes",
        WIDTH,
        height as u32,
    );
    draw_title(
        &mut drawing,
        "What was planted, and what came first",
        "rows: planted; columns: the most probable class; tests with two effects are left out",
    );
    for (column, class) in classes.iter().enumerate() {
        let at = (LEFT + CELL.0 * (column as f64 + 0.5), TOP - 12.0);
        drawing.text(Text::new(class.name(), at, TICK_SIZE).upwards());
    }
    for (row, planted) in classes.iter().enumerate() {
        let y = TOP + CELL.1 * row as f64;
        let label = Text::new(planted.name(), (LEFT - 12.0, y + 0.66 * CELL.1), LABEL_SIZE);
        drawing.text(label.aligned(Align::End));
        let total: usize = classes
            .iter()
            .filter_map(|class| counts.get(&(*planted, *class)))
            .sum();
        for (column, class) in classes.iter().enumerate() {
            let count = counts.get(&(*planted, *class)).copied().unwrap_or(0);
            draw_cell(
                &mut drawing,
                (LEFT + CELL.0 * column as f64, y),
                (count, total),
            );
        }
    }
    drawing
}

fn draw_cell(drawing: &mut Drawing, (x, y): (f64, f64), (count, total): (usize, usize)) {
    let far = (x + CELL.0 - 2.0, y + CELL.1 - 2.0);
    drawing.rectangle((x, y), far, GRID, 0.5);
    if count == 0 {
        return;
    }
    let share = count as f64 / total as f64;
    drawing.rectangle((x, y), far, BLUE, 0.15 + 0.85 * share);
    let color = if share > 0.45 { WHITE } else { INK };
    let at = (x + 0.5 * CELL.0, y + 0.66 * CELL.1);
    let text = Text::new(count.to_string(), at, LABEL_SIZE).aligned(Align::Middle);
    drawing.text(text.colored(if total == 0 { SOFT } else { color }));
}

/// All classes in the catalogue's order, each group once; `resolution` shares its group.
pub(super) fn classes() -> Vec<Class> {
    let mut classes = vec![Class::None];
    for id in EffectId::ALL {
        let class = Class::Group(id.group());
        if id != EffectId::JointDrift && !classes.contains(&class) {
            classes.push(class);
        }
    }
    classes.push(Class::Unknown);
    classes
}

fn counts(cases: &[Case]) -> BTreeMap<(Class, Class), usize> {
    let mut counts = BTreeMap::new();
    for (truth, answer) in cases {
        if let Some((planted, (first, _))) = truth.class().zip(answer.first()) {
            *counts.entry((planted, first)).or_insert(0) += 1;
        }
    }
    counts
}
