//! Checks of good practice in the document.

use schemars::JsonSchema;
use serde::Serialize;

/// The result of one check.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct VerdictSection {
    /// Short code of the check: "double-hit".
    pub check: String,
    /// On what, in words: "full.wav, tap 2".
    pub subject: String,
    /// File of the recording; null of the test as a whole.
    pub recording: Option<String>,
    /// Number of the tap, from 1; null of anything else.
    pub tap: Option<usize>,
    /// Frequency of the mode (Hz); null of anything else.
    pub frequency: Option<f64>,
    /// Name of the sensor; null of anything else.
    pub sensor: Option<String>,
    /// What was found (`unit`); null where there is nothing to measure.
    pub value: Option<f64>,
    /// The limit (`unit`).
    pub limit: f64,
    /// Unit of value and limit; "1" for a ratio.
    pub unit: String,
    /// "good", "doubtful", "bad" or "not applicable".
    pub outcome: String,
    /// What happened.
    pub text: String,
    /// Of a doubt why it might be; else null.
    pub cause: Option<String>,
    /// Of a doubt what helps; else null.
    pub remedy: Option<String>,
    /// How far off it is, in its limit: tells the worst of one check.
    #[serde(skip)]
    pub severity: f64,
}
