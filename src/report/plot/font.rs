//! The embedded font: DejaVu Sans, a subset, so that pictures need no font of the system.
//!
//! Letters are placed here and not by plotters, whose text leaves out the space before a letter and
//! rounds every letter to whole pixels, which small axis labels show.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

use super::super::ReportError;
use super::drawing::{Align, Direction, Text};

/// Weight of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// Regular.
    Regular,
    /// Bold.
    Bold,
}

/// Family under which the font is asked for in SVG.
pub const FAMILY: &str = "sans-serif";

/// How far the letters' baseline lies below the middle line (em): half the height of capitals, 0.73 em in
/// this font.
pub(super) const BASELINE: f64 = 0.365;

static REGULAR: &[u8] = include_bytes!("../assets/DejaVuSans-sub.ttf");
static BOLD: &[u8] = include_bytes!("../assets/DejaVuSans-Bold-sub.ttf");

/// The embedded font, read once.
pub(super) fn face(weight: Weight) -> Option<&'static FontRef<'static>> {
    static FACES: OnceLock<[Option<FontRef<'static>>; 2]> = OnceLock::new();
    let read = |bytes: &'static [u8]| FontRef::try_from_slice(bytes).ok();
    let [regular, bold] = FACES.get_or_init(|| [read(REGULAR), read(BOLD)]);
    match weight {
        Weight::Regular => regular.as_ref(),
        Weight::Bold => bold.as_ref(),
    }
}

/// Checks that the embedded fonts can be read.
///
/// # Errors
/// [`ReportError::Font`] if not.
pub fn check() -> Result<(), ReportError> {
    let both = [Weight::Regular, Weight::Bold].map(|weight| face(weight).is_some());
    if both == [true, true] {
        Ok(())
    } else {
        Err(ReportError::Font)
    }
}

/// The font's own scale for letters of `size` pixels per em.
fn scale(face: &FontRef<'static>, size: f64) -> PxScale {
    let em = face.units_per_em().unwrap_or(1000.0);
    PxScale::from(size as f32 * face.height_unscaled() / em)
}

/// Width of a text (pixels); `size` in pixels per em.
pub fn text_width(text: &str, size: f64, weight: Weight) -> f64 {
    let Some(face) = face(weight) else {
        return 0.6 * size * text.chars().count() as f64;
    };
    let scaled = face.as_scaled(scale(face, size));
    let mut previous = None;
    let mut width = 0.0;
    for letter in text.chars() {
        let glyph = face.glyph_id(letter);
        width += scaled.h_advance(glyph) + previous.map_or(0.0, |last| scaled.kern(last, glyph));
        previous = Some(glyph);
    }
    f64::from(width)
}

/// Shortens a text with "…" until it fits `width` (pixels).
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size, Weight::Regular) <= width {
        return text.to_owned();
    }
    let mut short: Vec<char> = text.chars().collect();
    while !short.is_empty() {
        short.pop();
        let candidate = format!("{}\u{2026}", short.iter().collect::<String>().trim_end());
        if text_width(&candidate, size, Weight::Regular) <= width {
            return candidate;
        }
    }
    String::new()
}

/// Letters at the end of a text that stay when it is shortened before them.
const KEPT: usize = 16;

/// Shortens a text with "…" before its last letters until it fits `width` (pixels).
pub fn fitted_before_end(text: &str, (size, weight): (f64, Weight), width: f64) -> String {
    let letters: Vec<char> = text.chars().collect();
    let fits = |text: &str| text_width(text, size, weight) <= width;
    if fits(text) || letters.len() <= KEPT {
        return text.to_owned();
    }
    let (head, tail) = letters.split_at(letters.len() - KEPT);
    let tail: String = tail.iter().collect();
    let shortened = |kept: usize| {
        let head: String = head[..kept].iter().collect();
        format!("{}\u{2026}{tail}", head.trim_end())
    };
    let candidates = (0..head.len()).rev().map(shortened);
    let mut fitting = candidates.filter(|candidate| fits(candidate));
    fitting.next().unwrap_or(tail)
}

/// Calls `paint(x, y, coverage)` for every pixel of a text.
pub fn cover(text: &Text, mut paint: impl FnMut(i32, i32, f64)) {
    let Some(face) = face(text.weight) else {
        return;
    };
    let scale = scale(face, text.size);
    let scaled = face.as_scaled(scale);
    let start = match text.align {
        Align::Start => 0.0,
        Align::Middle => -text.width() / 2.0,
        Align::End => -text.width(),
    };
    let baseline = BASELINE * text.size;
    // Across, letters sit where they belong and the baseline on a whole pixel, which keeps the
    // horizontal strokes crisp; upwards, the same after the turn.
    let (origin, along) = match text.direction {
        Direction::Across => ((text.at.1 + baseline).round(), text.at.0 + start),
        Direction::Upwards => ((text.at.0 + baseline).round(), -text.at.1 + start),
    };
    let mut pen = along as f32;
    let mut previous = None;
    for letter in text.text.chars() {
        let id = face.glyph_id(letter);
        pen += previous.map_or(0.0, |last| scaled.kern(last, id));
        previous = Some(id);
        let glyph = id.with_scale_and_position(scale, point(pen, origin as f32));
        if let Some(outline) = face.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, coverage| {
                let (x, y) = (corner.x as i32 + x as i32, corner.y as i32 + y as i32);
                match text.direction {
                    Direction::Across => paint(x, y, f64::from(coverage)),
                    Direction::Upwards => paint(y, -x - 1, f64::from(coverage)),
                }
            });
        }
        pen += scaled.h_advance(id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_title_that_is_too_long_keeps_its_beginning_and_its_end() {
        let bold = (18.0, Weight::Bold);
        let title = |folders: usize| {
            let path = "measurements of the year/".repeat(folders);
            format!("Frequency and damping against amplitude, {path}visit-11.wav")
        };
        assert_eq!(fitted_before_end(&title(1), bold, 1160.0), title(1));
        let short = fitted_before_end(&title(9), bold, 1160.0);
        assert!(text_width(&short, 18.0, Weight::Bold) <= 1160.0, "{short}");
        assert!(short.starts_with("Frequency and damping against amplitude, meas"));
        assert!(short.ends_with("\u{2026}ear/visit-11.wav"), "{short}");
        // As much is kept as fits.
        assert!(text_width(&short, 18.0, Weight::Bold) > 1130.0, "{short}");
    }
}
