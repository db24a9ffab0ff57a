//! Letters of the embedded font as SVG outlines: each is defined once and used wherever it stands.

use std::collections::BTreeMap;

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve};

use super::drawing::{Align, Direction, Text};
use super::font::{self, BASELINE, Weight};
use super::vector::UNITS;

/// The letters that a picture has used.
#[derive(Debug, Default)]
pub(super) struct Letters {
    /// Outline by name; those without one (spaces) are not kept.
    outlines: BTreeMap<String, String>,
}

impl Letters {
    /// A text as references to its letters' outlines.
    pub(super) fn element(&mut self, text: &Text) -> String {
        let Some(face) = font::face(text.weight) else {
            return String::new();
        };
        let em = f64::from(face.units_per_em().unwrap_or(1000.0));
        let scale = text.size * UNITS / em;
        let (letters, width) = self.set(face, text);
        let start = match text.align {
            Align::Start => 0.0,
            Align::Middle => -0.5 * width,
            Align::End => -width,
        };
        // Font units count upwards, and from the baseline's start.
        let below = BASELINE * em;
        let turn = match text.direction {
            Direction::Across => "",
            Direction::Upwards => " rotate(-90)",
        };
        let (x, y) = (text.at.0 * UNITS, text.at.1 * UNITS);
        let color = text.color;
        format!(
            "<g fill=\"#{:02X}{:02X}{:02X}\" transform=\"translate({x:.1} {y:.1}){turn} scale({scale:.5}) \
             translate({start:.0} {below:.0}) scale(1 -1)\">{letters}</g>\n",
            color.0, color.1, color.2
        )
    }

    /// References from left to right, and the width of all (font units).
    fn set(&mut self, face: &FontRef<'static>, text: &Text) -> (String, f64) {
        let (mut uses, mut pen, mut previous) = (String::new(), 0.0, None);
        for letter in text.text.chars() {
            let id = face.glyph_id(letter);
            pen += previous.map_or(0.0, |last| face.kern_unscaled(last, id));
            previous = Some(id);
            if let Some(name) = self.define(face, (id, text.weight)) {
                uses.push_str(&format!("<use xlink:href=\"#{name}\" x=\"{pen:.0}\"/>"));
            }
            pen += face.h_advance_unscaled(id);
        }
        (uses, f64::from(pen))
    }

    /// The name of a letter's outline; `None` where there is nothing to draw.
    fn define(
        &mut self,
        face: &FontRef<'static>,
        (id, weight): (GlyphId, Weight),
    ) -> Option<String> {
        let name = match weight {
            Weight::Regular => format!("r{}", id.0),
            Weight::Bold => format!("b{}", id.0),
        };
        if !self.outlines.contains_key(&name) {
            let outline = face.outline(id)?;
            self.outlines.insert(name.clone(), path(&outline.curves));
        }
        Some(name)
    }

    /// The definitions of all letters used.
    pub(super) fn definitions(&self) -> String {
        let paths = self.outlines.iter();
        let paths: String = paths
            .map(|(name, path)| format!("<path id=\"{name}\" d=\"{path}\"/>\n"))
            .collect();
        format!("<defs>\n{paths}</defs>\n")
    }
}

/// Curves as a path in font units; where one does not begin at the end of the one before, a new contour
/// does.
fn path(curves: &[OutlineCurve]) -> String {
    let mut path = String::new();
    let mut last = None;
    for curve in curves {
        let (from, words, to) = match curve {
            OutlineCurve::Line(a, b) => (a, format!("L{} {}", b.x, b.y), b),
            OutlineCurve::Quad(a, b, c) => (a, format!("Q{} {} {} {}", b.x, b.y, c.x, c.y), c),
            OutlineCurve::Cubic(a, b, c, d) => (
                a,
                format!("C{} {} {} {} {} {}", b.x, b.y, c.x, c.y, d.x, d.y),
                d,
            ),
        };
        if last != Some((from.x, from.y)) {
            path.push_str(&format!("M{} {}", from.x, from.y));
        }
        path.push_str(&words);
        last = Some((to.x, to.y));
    }
    path
}
