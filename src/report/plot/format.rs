//! Which kind of file a picture becomes.

use super::super::ReportError;
use super::drawing::Drawing;
use super::raster::render_png;
use super::vector::render_svg_file;
use std::path::Path;

/// A kind of picture file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Pixels.
    Png,
    /// Lines, for print: letters are outlines, so that no font is needed.
    Svg,
}

impl PictureFormat {
    /// What a file of this name should be: SVG where it ends in `.svg`, else PNG.
    pub fn of(file: &Path) -> PictureFormat {
        let ending = file.extension().unwrap_or_default();
        if ending.eq_ignore_ascii_case("svg") {
            PictureFormat::Svg
        } else {
            PictureFormat::Png
        }
    }
}

/// The bytes of a picture file.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn or encoded.
pub fn render_picture(drawing: &Drawing, format: PictureFormat) -> Result<Vec<u8>, ReportError> {
    match format {
        PictureFormat::Png => render_png(drawing),
        PictureFormat::Svg => Ok(render_svg_file(drawing)?.into_bytes()),
    }
}
