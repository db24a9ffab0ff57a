//! Colours that readers with any colour vision tell apart: the palette of Okabe and Ito (2008).

/// A colour, red green blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

/// Blue.
pub const BLUE: Color = Color(0, 114, 178);
/// Vermilion.
pub const VERMILION: Color = Color(213, 94, 0);
/// Bluish green.
pub const GREEN: Color = Color(0, 158, 115);
/// Reddish purple.
pub const PURPLE: Color = Color(204, 121, 167);
/// Orange.
pub const ORANGE: Color = Color(230, 159, 0);
/// Sky blue.
pub const SKY: Color = Color(86, 180, 233);

/// Text and axes.
pub const INK: Color = Color(34, 34, 34);
/// Secondary text.
pub const SOFT: Color = Color(95, 95, 95);
/// Grid lines.
pub const GRID: Color = Color(226, 226, 226);
/// Raw data in the background.
pub const DATA: Color = Color(120, 140, 160);
/// The paper.
pub const WHITE: Color = Color(255, 255, 255);

/// Colours of curves in order; the palette repeats after six curves.
const CURVES: [Color; 6] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY];

/// Colour of the curve with this index.
pub fn curve(index: usize) -> Color {
    CURVES[index % CURVES.len()]
}
