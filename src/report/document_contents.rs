//! What files hold, as data: channels of recordings, datasets of universal files. A part of the
//! document.

use schemars::JsonSchema;
use serde::Serialize;

/// One dataset of a universal file, as its header describes it.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct DatasetSection {
    /// The file.
    pub file: String,
    /// Place in the file, from 1.
    pub dataset: usize,
    /// Type of the dataset: 58 for functions, 164 for units, ...
    pub dataset_type: u32,
    /// What it holds, in words: "frequency response function".
    pub kind: String,
    /// Number of the function's type; null for other datasets, like all below.
    pub function_type: Option<u32>,
    /// Points that the header promises.
    pub points: Option<u64>,
    /// First abscissa (in `spacing_unit`); null where the abscissa is stored.
    pub start: Option<f64>,
    /// Distance of the points (in `spacing_unit`); null where the abscissa is stored.
    pub spacing: Option<f64>,
    /// Unit of the abscissa as written.
    pub spacing_unit: Option<String>,
    /// Response point: name, node and direction.
    pub response: Option<String>,
    /// Reference point.
    pub reference: Option<String>,
    /// What the ordinate, or its numerator, measures.
    pub quantity: Option<String>,
    /// Unit of the ordinate, or of its numerator, as written.
    pub unit: Option<String>,
    /// Unit of the ordinate's denominator as written.
    pub denominator_unit: Option<String>,
    /// "text", "binary, little endian" or "binary, big endian".
    pub coding: Option<String>,
    /// "real, single", "complex, double", ...
    pub values: Option<String>,
    /// First line of free text.
    pub description: Option<String>,
    /// Third line of free text: date and time as a rule.
    pub date: Option<String>,
    /// Bytes of its values, of other datasets of all.
    pub bytes: u64,
}

/// One channel of a recording, in the unit that its values have.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ChannelSection {
    /// Number, from 1.
    pub channel: usize,
    /// Name, where the file gives one.
    pub name: Option<String>,
    /// Unit, where known.
    pub unit: Option<String>,
    /// Units per unit of the file.
    pub scale: f64,
    /// Mean (DC offset).
    pub mean: f64,
    /// Root mean square about the mean.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
    /// Samples at the format's full scale.
    pub full_scale_samples: u64,
    /// Flat tops.
    pub flat_tops: u64,
    /// Samples in runs that repeat one value.
    pub dropped_samples: u64,
}
