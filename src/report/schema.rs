//! The JSON Schema of the document.

use schemars::generate::SchemaSettings;

use super::document::Document;

/// The JSON Schema (draft 2020-12) of `report.json` and of every `--json` answer that is a document.
pub fn render_schema() -> String {
    let generator = SchemaSettings::draft2020_12()
        .for_serialize()
        .into_generator();
    let schema = generator.into_root_schema_for::<Document>();
    // Indented as report.json is; a value without infinities or maps of odd keys always serialises.
    let text = serde_json::to_string_pretty(schema.as_value()).unwrap_or_default();
    text + "\n"
}
