//! `report.json`: its text, its schema, and what it says of the files of an earlier run.

use schemars::generate::SchemaSettings;
use serde_json::Value;

use super::ReportError;
use super::document::Document;
use super::short_names::stems;

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

/// The model that a diagnosis leads to, beside the report.
pub const MODEL_FILE: &str = "updated-model.toml";
/// Files of words, the model apart.
const WORDS: [&str; 5] = [
    "report.html",
    "report.json",
    "parameters.csv",
    "modes.csv",
    "perturbation.csv",
];
/// Pictures of the whole test.
const OF_TEST: [&str; 5] = ["frequencies", "mode-shapes", "cloud", "gap", "gap-place"];
/// Pictures of each recording, followed by its name.
const OF_RECORDING: [&str; 5] = ["spectrum", "frf", "stabilisation", "amplitude", "taps"];

/// Names of all files that a run may have written beside this `report.json`; empty where the text is none
/// of ours. Pictures of recordings that it does not name are somebody else's.
pub fn earlier_files(report_json: &str) -> Vec<String> {
    let Ok(report) = serde_json::from_str::<Value>(report_json) else {
        return Vec::new();
    };
    let ours = report["version"].is_u64() && report["warnings"].is_array();
    if !ours {
        return Vec::new();
    }
    let recordings = report["recordings"].as_array();
    let files = recordings
        .into_iter()
        .flatten()
        .filter_map(|recording| recording["file"].as_str());
    let of_recordings = stems(files)
        .into_iter()
        .flat_map(|stem| OF_RECORDING.map(|kind| format!("{kind}-{stem}")));
    let pictures = OF_TEST
        .map(str::to_owned)
        .into_iter()
        .chain(of_recordings)
        .flat_map(|name| [format!("{name}.png"), format!("{name}.svg")]);
    // Where the earlier run wrote no model, one of that name is somebody else's.
    let model = report["gap"]["updated_model"]["file"].as_str();
    let model = model.filter(|file| *file == MODEL_FILE).map(str::to_owned);
    WORDS
        .map(str::to_owned)
        .into_iter()
        .chain(model)
        .chain(pictures)
        .collect()
}
