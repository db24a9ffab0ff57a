//! Recordings in the document: channels, taps, spectra, readings; and the datasets of universal files.

use schemars::JsonSchema;
use serde::Serialize;

use super::ModeSection;
use tapjoint_analysis::{Conditions, RecordingResult};
use tapjoint_signal::recording::{
    Abscissa, ChannelInfo, Format, Function, Ordinate, Precision, Separator, UffCoding,
    UniversalFile,
};
use tapjoint_signal::spectral::Window;

/// One recording.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct RecordingSection {
    /// File as the description names it.
    pub file: String,
    /// Difference from the first recording, for which modes and estimate leave it out: "8.8 times its tap level";
    /// null where they do not.
    pub aside: Option<String>,
    /// Format in words: "WAV, 24-bit integer".
    pub format: String,
    /// Sample rate (Hz); null of frequency response functions from a file.
    pub sample_rate: Option<f64>,
    /// Number of channels.
    pub channels: usize,
    /// Every channel.
    pub channel_details: Vec<ChannelSection>,
    /// Length (s); null of frequency response functions from a file.
    pub seconds: Option<f64>,
    /// True if there is a hammer channel.
    pub has_hammer: bool,
    /// Names of the responses: sensors, or channels.
    pub responses: Vec<String>,
    /// Unit of the taps' peaks; null where it is not known.
    pub tap_unit: Option<String>,
    /// Taps in order of time.
    pub taps: Vec<TapSection>,
    /// Distance of the spectral lines (Hz).
    pub line_spacing: Option<f64>,
    /// Resolution 1/T (Hz), T the length of signal used.
    pub resolution: Option<f64>,
    /// Bound of a line reading (Hz).
    pub half_line: Option<f64>,
    /// Block size (samples at the zoomed rate).
    pub block: Option<usize>,
    /// Displayed lines.
    pub lines: Option<usize>,
    /// Taps averaged.
    pub averages: usize,
    /// Circumstances, as described.
    #[serde(flatten)]
    pub conditions: Conditions,
    /// Band (Hz).
    pub band: Option<[f64; 2]>,
    /// "rectangular", "hann" or "exponential".
    pub window: Option<String>,
    /// Decay the window adds (1/s).
    pub window_decay: Option<f64>,
    /// Level at the record's end relative to its start, the largest of the responses.
    pub remaining_at_end: Option<f64>,
    /// This recording's own readings.
    pub modes: Vec<ModeSection>,
}

/// One tap: its peak is a force with a hammer, and a response without one.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TapSection {
    /// When it begins (s from the start of the recording).
    pub time: f64,
    /// Peak force (`tap_unit`: N in a described test); null without a hammer.
    pub peak_force: Option<f64>,
    /// Peak of the response on which it stands out most (`tap_unit`); null with a hammer.
    pub peak_response: Option<f64>,
    /// True if it enters the averages.
    pub accepted: bool,
    /// Why not.
    pub reason: Option<String>,
}

/// One channel of a recording, in the unit that its values have.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChannelSection {
    /// Number, from 1.
    pub channel: usize,
    /// Name, unit, scale and quality of the samples.
    #[serde(flatten)]
    pub info: ChannelInfo,
}

/// One dataset of a universal file, as its header describes it: words for the codes of the format, and the numbers of a
/// function beside those of the dataset.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct DatasetSection {
    /// The file.
    pub file: String,
    /// Place in the file, from 1.
    pub dataset: usize,
    /// Type of the dataset: 58 for functions, 164 for units, ...
    pub dataset_type: u32,
    /// Contents in words: "frequency response function".
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
    /// Quantity of the ordinate, or of its numerator.
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

impl RecordingSection {
    /// The section of a recording; `aside` says how it differs from the first one.
    pub(super) fn of(recording: &RecordingResult, aside: Option<String>) -> Self {
        let spectra = recording.measurement.spectra.as_ref();
        let lines = spectra.map(|spectra| spectra.averages.lines);
        let channels = (1..).zip(recording.channels.iter().cloned());
        let taps = recording.measurement.taps.taps.iter();
        let taps = taps.map(|tap| TapSection {
            time: tap.time,
            peak_force: recording.has_hammer.then_some(tap.peak),
            peak_response: (!recording.has_hammer).then_some(tap.peak),
            accepted: tap.accepted(),
            reason: tap.rejection.as_ref().map(ToString::to_string),
        });
        let readings = recording.readings().iter().zip(&recording.mode_numbers);
        let modes = readings.map(|(reading, &mode)| ModeSection {
            mode,
            recording: Some(recording.file.clone()),
            ..ModeSection::of_reading(reading, Some(recording))
        });
        RecordingSection {
            aside,
            file: recording.file.clone(),
            format: format_words(recording.format),
            sample_rate: recording.sample_rate,
            channels: recording.channels.len(),
            channel_details: channels
                .map(|(channel, info)| ChannelSection { channel, info })
                .collect(),
            seconds: recording.seconds,
            has_hammer: recording.has_hammer,
            responses: recording.responses.iter().map(|r| r.name.clone()).collect(),
            tap_unit: recording.tap_unit.clone(),
            taps: taps.collect(),
            line_spacing: lines.map(|lines| lines.spacing),
            resolution: lines.map(|lines| lines.resolution()),
            half_line: lines.map(|lines| lines.half_line()),
            block: lines.map(|lines| lines.block),
            lines: lines.map(|lines| lines.displayed()),
            averages: spectra.map_or(0, |spectra| spectra.averages.taps),
            conditions: recording.conditions.clone(),
            band: lines.map(|lines| [lines.low, lines.high]),
            window: spectra.map(|spectra| spectra.window.name().to_string()),
            window_decay: spectra.and_then(|spectra| added_decay(spectra.window)),
            remaining_at_end: spectra.and_then(|spectra| Some(spectra.decay?.remaining)),
            modes: modes.collect(),
        }
    }
}

/// Decay that a window adds to every pole (1/s); `None` where it adds none.
pub(super) fn added_decay(window: Window) -> Option<f64> {
    matches!(window, Window::Exponential { .. }).then(|| window.added_decay())
}

fn format_words(format: Format) -> String {
    match format {
        Format::WavInteger { bits } => format!("WAV, {bits}-bit integer"),
        Format::WavFloat { bits } => format!("WAV, {bits}-bit float"),
        Format::Csv {
            separator, decimal, ..
        } => {
            let separator = match separator {
                Separator::Tab => "tab",
                Separator::Semicolon => "semicolon",
                Separator::Comma => "comma",
                Separator::Blanks => "blanks",
            };
            let decimal = if decimal == ',' {
                ", decimal comma"
            } else {
                ""
            };
            format!("CSV, {separator}{decimal}")
        }
        Format::Uff58 {
            coding: UffCoding::Ascii,
        } => "UFF 58, text".to_owned(),
        Format::Uff58 { .. } => "UFF 58b, binary".to_owned(),
        Format::FrequencyResponses => "frequency response functions".to_owned(),
        Format::Memory => "samples in memory".to_owned(),
    }
}

/// Returns the datasets of universal files, in their order. `name` is the file as tables show it.
pub fn datasets_of(name: &str, file: &UniversalFile) -> Vec<DatasetSection> {
    let mut sections = Vec::with_capacity(file.datasets.len());
    for dataset in &file.datasets {
        let listed = DatasetSection {
            file: name.to_owned(),
            dataset: dataset.number,
            dataset_type: dataset.kind,
            kind: dataset.kind_name(),
            bytes: dataset.bytes,
            ..Default::default()
        };
        sections.push(match &dataset.function {
            Some(function) => with_function(listed, function),
            None => listed,
        });
    }
    sections
}

/// The section of a dataset that holds a function.
fn with_function(listed: DatasetSection, function: &Function) -> DatasetSection {
    let (start, spacing) = match function.abscissa {
        Abscissa::Even { start, step, .. } => (Some(start), Some(step)),
        Abscissa::Uneven => (None, None),
    };
    let coding = match function.coding {
        UffCoding::Ascii => "text",
        UffCoding::Binary { order: 2, .. } => "binary, big endian",
        UffCoding::Binary { .. } => "binary, little endian",
    };
    let values = match (function.ordinate, function.precision) {
        (Ordinate::Real, Precision::Single) => "real, single",
        (Ordinate::Real, Precision::Double) => "real, double",
        (Ordinate::Complex, Precision::Single) => "complex, single",
        (Ordinate::Complex, Precision::Double) => "complex, double",
    };
    let [response, reference] = [&function.response, &function.reference]
        .map(|point| Some(point.to_string()).filter(|text| text != "-"));
    DatasetSection {
        function_type: Some(function.function_type.0),
        points: Some(function.points),
        start,
        spacing,
        spacing_unit: function.abscissa_axis.unit.clone(),
        response,
        reference,
        quantity: function.numerator.quantity_name().map(str::to_owned),
        unit: function.numerator.unit.clone(),
        denominator_unit: function.denominator.unit.clone(),
        coding: Some(coding.to_owned()),
        values: Some(values.to_owned()),
        description: function.id_lines[0].clone(),
        date: function.id_lines[2].clone(),
        ..listed
    }
}
