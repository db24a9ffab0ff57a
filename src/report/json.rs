//! The document as JSON.

use super::ReportError;
use super::document::Document;

/// The document as indented JSON with a newline at its end.
///
/// Values that are not finite are written as `null`.
///
/// # Errors
/// [`ReportError::Json`] if the document cannot be serialised.
pub fn render_json(document: &Document) -> Result<String, ReportError> {
    let mut text = serde_json::to_string_pretty(document).map_err(ReportError::Json)?;
    text.push('\n');
    Ok(text)
}
