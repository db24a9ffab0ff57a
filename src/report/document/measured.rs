//! The measurement in the document: recordings, resonances, frequency response functions, datasets of universal files.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

use super::{Document, WarningSection, document_of};
use tapjoint_analysis::{
    AmplitudeChange, Analysis, Conditions, Frf, FrfResonance, ModeResult, RecordingResult,
    STRONG_PEAK, Warning,
};
use tapjoint_signal::modal::amplitude::{
    AmplitudePoint, AmplitudeVerdict, FrequencyAtAmplitude, Trend,
};
use tapjoint_signal::modal::fit::{ModalConstant, TapFit, UncertaintySource};
use tapjoint_signal::modal::{FittedReading, ModeReading, PeakLabel, ReadBy};
use tapjoint_signal::quality::Check;
use tapjoint_signal::recording::{
    Abscissa, ChannelInfo, FrequencyResponses, Ordinate, Precision, UffCoding, UniversalFile,
};
use tapjoint_signal::spectral::Window;
use tapjoint_signal::taps::Pulse;

/// One recording.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct RecordingSection {
    /// File as the description names it.
    pub file: String,
    /// Its files, in their order, where it has several; they follow one another in time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
    /// Difference from the first recording, for which the list of modes leaves it out: "8.8 times its tap level", "free
    /// length 0.2 m"; null where it does not. The estimate takes recordings of another free length by modes of their own.
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
    /// Number of consecutive taps for each fitted decay. With a hammer it is their mean, weighted by their peaks; without one
    /// it is the strongest of them. Left out where each tap is fitted by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taps_together: Option<usize>,
    /// Circumstances, as described.
    #[serde(flatten)]
    pub conditions: Conditions,
    /// Band (Hz).
    pub band: Option<[f64; 2]>,
    /// Bands about groups of peaks (Hz), in each of which poles were looked for beside the whole band.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pole_bands: Vec<[f64; 2]>,
    /// "rectangular", "hann" or "exponential".
    pub window: Option<String>,
    /// Decay the window adds (1/s).
    pub window_decay: Option<f64>,
    /// The force pulses in the mean of the accepted taps, and the window about them; null without a hammer.
    pub hammer: Option<HammerSection>,
    /// Level at the record's end relative to its start, the largest of the responses.
    pub remaining_at_end: Option<f64>,
    /// This recording's own readings.
    pub modes: Vec<ModeSection>,
    /// What the fitted modes leave of each frequency response function; empty without functions or fitted modes.
    pub fitted_functions: Vec<FittedFunctionSection>,
}

/// What the fitted modes leave of one frequency response function. Their poles are those of the fits; residues, and a
/// term each for the modes below and above the band, are those of the least squares over the band.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FittedFunctionSection {
    /// Name of the sensor or channel.
    pub response: String,
    /// Number of fitted modes.
    pub modes: usize,
    /// Band (Hz): from the lowest to the highest band of a fit.
    pub band: [f64; 2],
    /// Share of the measured function's power in the band that is left (%).
    pub left_percent: f64,
    /// The same in dB: 10 log10 of the share; null where nothing is left.
    pub left_db: Option<f64>,
}

impl FittedFunctionSection {
    fn new(response: &str, modes: usize, band: (f64, f64), left: f64) -> Self {
        FittedFunctionSection {
            response: response.to_owned(),
            modes,
            band: [band.0, band.1],
            left_percent: 100.0 * left,
            left_db: (left > 0.0).then(|| 10.0 * left.log10()),
        }
    }
}

/// One tap: its peak is a force with a hammer, and a response without one.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct TapSection {
    /// Its file, where the recording has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// When it begins (s from the start of the recording).
    pub time: f64,
    /// Peak force (`tap_unit`: N in a described test); null without a hammer.
    pub peak_force: Option<f64>,
    /// Peak of the response on which it stands out most (`tap_unit`); null with a hammer.
    pub peak_response: Option<f64>,
    /// True if it enters the averages.
    pub accepted: bool,
    /// Why not. Of a tap that was accepted by hand, or gives its decay alone: what speaks against it.
    pub reason: Option<String>,
    /// Its force pulse; null without a hammer.
    pub pulse: Option<Pulse>,
}

/// The force pulses of a recording.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct HammerSection {
    /// Mean of the accepted taps. A fall that one of them lacks is null.
    pub pulse: Pulse,
    /// Length of the window about each pulse, outside of which the force counts as zero (s), half of its taper included;
    /// null without spectra.
    pub force_window: Option<f64>,
    /// Largest change of H1 at a resonance by that window (%); null without a resonance.
    pub h1_change_percent: Option<f64>,
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
    /// Type of the dataset: 58 for functions, 164 for units, ...; 0 of a function in a file that is no universal file.
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

/// Returns a section for each function of a file that is no universal file.
pub fn functions_of(file: &str, functions: &FrequencyResponses) -> Vec<DatasetSection> {
    let kind = match functions.has_phase {
        true => "frequency response function",
        false => "spectrum",
    };
    let sections = functions.responses.iter().enumerate();
    let sections = sections.map(|(index, function)| DatasetSection {
        file: file.to_owned(),
        dataset: index + 1,
        kind: kind.to_owned(),
        points: Some(functions.lines as u64),
        start: Some(functions.first_frequency),
        spacing: Some(functions.spacing),
        spacing_unit: Some("Hz".to_owned()),
        response: Some(function.name.clone()),
        unit: function.unit.clone(),
        ..DatasetSection::default()
    });
    sections.collect()
}

impl RecordingSection {
    /// The section of a recording; `aside` says how it differs from the first one.
    pub(super) fn of(recording: &RecordingResult, aside: Option<String>) -> Self {
        let spectra = recording.measurement.spectra.as_ref();
        let lines = spectra.map(|spectra| spectra.averages.lines);
        let channels = (1..).zip(recording.channels.iter().cloned());
        let taps = recording.measurement.taps.taps.iter();
        let taps = taps.map(|tap| TapSection {
            file: tap.file.clone(),
            time: tap.time,
            peak_force: recording.has_hammer.then_some(tap.peak),
            peak_response: (!recording.has_hammer).then_some(tap.peak),
            accepted: tap.accepted(),
            reason: match (&tap.rejection, &tap.overruled, &tap.overload) {
                (Some(rejection), ..) => Some(rejection.to_string()),
                (None, Some(fault), _) => Some(format!("accepted by hand; {fault}")),
                (None, None, Some(overload)) => Some(format!("decay only: {overload}")),
                (None, None, None) => None,
            },
            pulse: tap.pulse,
        });
        let gate = spectra.and_then(|spectra| spectra.force_window);
        let mean_pulse = recording.measurement.taps.mean_pulse();
        let hammer = mean_pulse.map(|pulse| HammerSection {
            pulse,
            force_window: gate.map(|gate| gate.length),
            h1_change_percent: gate.and_then(|gate| Some(100.0 * gate.h1_change?)),
        });
        let readings = recording.readings().iter().zip(&recording.mode_numbers);
        let modes = readings.map(|(reading, &mode)| ModeSection {
            mode,
            recording: Some(recording.file.clone()),
            ..ModeSection::of_reading(reading, Some(recording))
        });
        let mut fitted_functions = Vec::new();
        if let Some(fitted) = spectra.and_then(|spectra| spectra.fitted.as_ref()) {
            for (response, own) in recording.responses.iter().zip(&fitted.functions) {
                let (name, modes) = (&response.name, fitted.modes);
                let own = own.as_ref();
                fitted_functions.extend(
                    own.map(|own| FittedFunctionSection::new(name, modes, fitted.band, own.left)),
                );
            }
        }
        let searches = spectra.map_or(&[][..], |spectra| &spectra.stabilisation.searches);
        let narrow = searches.iter().skip(1).map(|search| search.band.core);
        RecordingSection {
            pole_bands: narrow.map(|(low, high)| [low, high]).collect(),
            fitted_functions,
            aside,
            file: recording.file.clone(),
            files: recording.files.clone(),
            format: recording.format.to_string(),
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
            taps_together: spectra.and_then(|spectra| spectra.taps_together),
            conditions: recording.conditions.clone(),
            band: lines.map(|lines| [lines.low, lines.high]),
            window: spectra.map(|spectra| spectra.window.name().to_string()),
            window_decay: spectra.and_then(|spectra| added_decay(spectra.window)),
            hammer,
            remaining_at_end: spectra.and_then(|spectra| Some(spectra.decay?.remaining)),
            modes: modes.collect(),
        }
    }
}

/// Decay that a window adds to every pole (1/s); `None` where it adds none.
fn added_decay(window: Window) -> Option<f64> {
    matches!(window, Window::Exponential { .. }).then(|| window.added_decay())
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
        let Some(function) = &dataset.function else {
            sections.push(listed);
            continue;
        };
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
        sections.push(DatasetSection {
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
        });
    }
    sections
}

/// Returns true for a peak that is too high for noise, and is shown whatever it is. `above_noise_db`: its height (dB),
/// where known.
pub(crate) fn is_strong(above_noise_db: Option<f64>) -> bool {
    above_noise_db.is_some_and(|height| height >= STRONG_PEAK)
}

/// One resonance.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ModeSection {
    /// The model's number; null for a peak that belongs to no mode.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// "fit", "interpolated" or "line" ("given" when read elsewhere).
    #[serde(serialize_with = "write_method")]
    #[schemars(schema_with = "method_schema")]
    pub method: Option<ReadBy>,
    /// Frequency on the line (Hz).
    pub line_frequency: Option<f64>,
    /// Bound of the line reading (Hz).
    pub half_line: Option<f64>,
    /// Frequency between the lines (Hz).
    pub interpolated_frequency: Option<f64>,
    /// Bound of the frequency between the lines (Hz), about 95 %.
    pub interpolated_bound: Option<f64>,
    /// Standard deviation of the best frequency (Hz).
    pub std: Option<f64>,
    /// Lower end of its interval (Hz): 95 % of a fit, else the bound of the reading.
    pub low: Option<f64>,
    /// Upper end of its interval (Hz).
    pub high: Option<f64>,
    /// Amplitude at which the mode has this frequency; null where its decays do not tell.
    pub at_amplitude: Option<FrequencyAtAmplitude>,
    /// Damping ratio.
    pub damping: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_std: Option<f64>,
    /// The fit; null where the mode was not fitted.
    pub fit: Option<FitSection>,
    /// Coherence on the mode's line, of the sensor that knows it best; null below two averages.
    pub coherence: Option<f64>,
    /// Relative random error (standard deviation) of that sensor's frequency response there.
    pub random_error: Option<f64>,
    /// Non-dimensional frequency (Euler).
    pub lambda: Option<f64>,
    /// Prominence of the peak (dB).
    pub prominence_db: Option<f64>,
    /// Height above the noise (dB).
    pub above_noise_db: Option<f64>,
    /// The recording it was read from.
    pub recording: Option<String>,
    /// Name of a peak that is no mode: "mains 50 Hz", or the sum that a nonlinear joint makes, "845.7 + 80.5 Hz".
    pub label: Option<String>,
    /// True for a peak that no resonance explains.
    #[serde(skip)]
    pub is_unclear: bool,
    /// True for a pole that makes no peak and is too weak for a mode.
    #[serde(skip)]
    pub is_weak: bool,
    /// True for a sum or difference of others.
    #[serde(skip)]
    pub is_combination: bool,
}

/// Name of the way in which a frequency was read; "given" for one that was read elsewhere.
pub fn method_name(method: Option<ReadBy>) -> &'static str {
    method.map_or("given", ReadBy::name)
}

fn write_method<S: Serializer>(method: &Option<ReadBy>, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(method_name(*method))
}

fn method_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "string", "enum": ["fit", "interpolated", "line", "given"] })
}

/// The fit of one mode.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FitSection {
    /// Lower end of the damping ratio's 95 % interval.
    pub damping_low: f64,
    /// Upper end of the damping ratio's 95 % interval.
    pub damping_high: f64,
    /// Source of the frequency's interval: "residual" (the noise that the fit leaves), "taps" (their scatter, where it is
    /// more than that noise explains), "two-poles" (it holds two poles that explain the data better than one) or "decays"
    /// (it changes along the decays, and is known at one amplitude).
    pub uncertainty_from: UncertaintySource,
    /// Degrees of freedom behind the interval (1). Where the source is "taps" or "two-poles", take the standard deviation as
    /// that of a normal distribution.
    pub freedom: f64,
    /// Probability that noise alone makes the taps scatter so; null with a single tap.
    pub scatter_probability: Option<f64>,
    /// Correlation of the residual between neighbouring lines: near 0 for a good fit.
    pub residual_correlation: f64,
    /// Band of the fit (Hz).
    pub band: [f64; 2],
    /// Every tap alone, or every group of taps where `taps_together` is stated.
    pub taps: Vec<TapFit>,
    /// Modal constants of the sensors.
    pub constants: Vec<ModalConstant>,
    /// Frequency and damping against amplitude.
    pub amplitude: Option<AmplitudeSection>,
}

/// Frequency and damping of a mode along its decays.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct AmplitudeSection {
    /// "changes", "steady", "beating", "unresolved" or "too-few-points".
    pub verdict: AmplitudeVerdict,
    /// Change of the frequency (Hz); null with too few points.
    pub frequency: Option<Trend>,
    /// Change of the damping ratio; null with too few points.
    pub damping: Option<Trend>,
    /// Response whose amplitude is given, from 1; null without points.
    pub sensor: Option<usize>,
    /// From the largest to the smallest amplitude; null where the change is within its uncertainty or too
    /// small to matter.
    pub ends: Option<AmplitudeChange>,
    /// The points, by tap and time; left out in the merged list of modes, whose recording has them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<AmplitudePoint>,
}

impl ModeSection {
    /// The section of a resonance of the merged list.
    pub(super) fn of(mode: &ModeResult, recordings: &[RecordingResult]) -> Self {
        let mut of_file = recordings.iter();
        let recording = of_file.find(|one| mode.recording.as_ref() == Some(&one.file));
        let reading = mode.reading.as_ref();
        let mut reading = reading.map_or_else(ModeSection::default, |reading| {
            ModeSection::of_reading(reading, recording)
        });
        // The points of the curve against amplitude stand with the recording's own reading.
        let fit = reading.fit.as_mut();
        if let Some(amplitude) = fit.and_then(|fit| fit.amplitude.as_mut()) {
            amplitude.points.clear();
        }
        ModeSection {
            mode: mode.mode,
            frequency: mode.frequency,
            half_line: mode.half_line,
            std: mode.std.filter(|_| !reading.is_unclear),
            damping: mode.damping.or(reading.damping),
            lambda: mode.lambda,
            recording: mode.recording.clone(),
            label: mode.label(),
            ..reading
        }
    }

    /// The section of one recording's reading, with the quality of its line in that recording.
    pub(super) fn of_reading(reading: &ModeReading, recording: Option<&RecordingResult>) -> Self {
        let spectra = recording.and_then(|recording| recording.measurement.spectra.as_ref());
        let quality = spectra.map(|spectra| spectra.averages.best_quality(reading.frequency));
        let change = recording.and_then(|recording| recording.amplitude_change(reading));
        let fit = reading.fit.as_deref();
        let is_unclear = reading.label == Some(PeakLabel::NoResonance);
        ModeSection {
            mode: None,
            frequency: reading.frequency,
            method: Some(reading.source),
            line_frequency: Some(reading.line_frequency),
            half_line: Some(reading.half_line),
            interpolated_frequency: reading.between.map(|between| between.frequency),
            interpolated_bound: reading.between.map(|between| between.bound),
            // Noise has no frequency of its own.
            std: reading.std.filter(|_| !is_unclear),
            low: (!is_unclear).then_some(reading.interval.0),
            high: (!is_unclear).then_some(reading.interval.1),
            at_amplitude: reading.at_amplitude.clone(),
            damping: reading.damping_ratio,
            damping_std: reading.damping_std,
            fit: fit.map(|fit| FitSection::of(fit, change)),
            coherence: quality.and_then(|quality| quality.coherence),
            random_error: quality.and_then(|quality| quality.random_error),
            lambda: None,
            prominence_db: reading.prominence_db,
            above_noise_db: reading.above_noise_db,
            recording: None,
            label: reading.label.map(|label| label.to_string()),
            is_unclear,
            is_weak: reading.label == Some(PeakLabel::Weak),
            is_combination: matches!(reading.label, Some(PeakLabel::Combination(_))),
        }
    }
}

impl FitSection {
    fn of(fit: &FittedReading, change: Option<AmplitudeChange>) -> Self {
        let mode = &fit.mode;
        FitSection {
            damping_low: mode.damping_ratio.low,
            damping_high: mode.damping_ratio.high,
            uncertainty_from: fit.frequency().source,
            freedom: fit.frequency().freedom,
            scatter_probability: mode.frequency.scatter_probability,
            residual_correlation: mode.residual_correlation,
            band: [mode.band.0, mode.band.1],
            taps: mode.taps.clone(),
            constants: fit.constants.clone(),
            amplitude: fit.amplitude.as_ref().map(|curve| AmplitudeSection {
                verdict: curve.verdict,
                frequency: curve.frequency.clone(),
                damping: curve.damping.clone(),
                sensor: curve.sensor.map(|sensor| sensor + 1),
                ends: change,
                points: curve.points.clone(),
            }),
        }
    }
}

/// The frequency response function of one sensor in one recording: lists of numbers instead of complex values on an
/// axis, one for each line; null where a value does not exist.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct FrfSection {
    /// File of the recording.
    pub recording: String,
    /// Name of the sensor or channel.
    pub response: String,
    /// "accelerance", "mobility" or "receptance"; null for sound and for unknown units.
    pub form: Option<String>,
    /// "(m/s2)/N" and the like; "per unit of the file" where no units are stated.
    pub unit: String,
    /// "H1", "H2" or "Hv": the estimator of `real` and `imaginary`.
    pub estimator: String,
    /// Taps averaged.
    pub averages: usize,
    /// "rectangular", "hann" or "exponential".
    pub window: String,
    /// Decay the window adds to every pole (1/s); null for windows that add none.
    pub window_decay: Option<f64>,
    /// The recording's resonances on this function.
    pub resonances: Vec<FrfResonance>,
    /// Frequencies (Hz).
    pub frequency: Vec<f64>,
    /// Real part (unit above), in the convention e^{+j omega t}.
    pub real: Vec<Option<f64>>,
    /// Imaginary part (unit above).
    pub imaginary: Vec<Option<f64>>,
    /// What the recording's fitted modes leave of H1, in its form as measured; null without fitted modes.
    pub fitted: Option<FittedFunctionSection>,
    /// Real part of the curve of the fitted modes (unit above); null outside its band.
    pub fitted_real: Option<Vec<Option<f64>>>,
    /// Imaginary part of that curve.
    pub fitted_imaginary: Option<Vec<Option<f64>>>,
    /// Coherence; null below two averages.
    pub coherence: Option<Vec<Option<f64>>>,
    /// Relative random error (standard deviation) of the magnitude; null below two averages.
    pub random_error: Option<Vec<Option<f64>>>,
}

/// The document of frequency response functions: of the analysis only what comes before any model.
pub fn frf_document(analysis: &Analysis, frfs: &[Frf]) -> Document {
    let whole = document_of(analysis);
    let of_recordings = analysis.recordings.iter();
    let of_recordings = of_recordings.flat_map(|recording| &recording.measurement.warnings);
    let of_functions = analysis
        .warnings
        .iter()
        .filter(|warning| is_of_function(warning));
    let warnings = of_recordings.chain(of_functions);
    let sections = frfs.iter().map(|frf| {
        let values = frf.values();
        let fitted = frf.fitted.as_ref();
        FrfSection {
            fitted: fitted.map(|one| {
                FittedFunctionSection::new(&frf.response, one.modes, one.band, one.left)
            }),
            fitted_real: fitted.map(|one| one.values.iter().map(|v| Some((*v)?.re)).collect()),
            fitted_imaginary: fitted.map(|one| one.values.iter().map(|v| Some((*v)?.im)).collect()),
            recording: frf.recording.clone(),
            response: frf.response.clone(),
            form: frf.form.map(|form| form.name().to_string()),
            unit: frf.unit.clone(),
            estimator: frf.estimator.name().to_string(),
            averages: frf.averages,
            window: frf.window.name().to_string(),
            window_decay: added_decay(frf.window),
            resonances: frf.resonances.clone(),
            frequency: frf.lines.frequencies(),
            real: values.iter().map(|value| value.map(|v| v.re)).collect(),
            imaginary: values.iter().map(|value| value.map(|v| v.im)).collect(),
            coherence: frf.coherence.clone(),
            random_error: frf.random_error.clone(),
        }
    });
    Document {
        version: whole.version,
        test: whole.test,
        recordings: whole.recordings,
        modes: whole.modes,
        frfs: Some(sections.collect()),
        warnings: warnings
            .map(|warning| WarningSection::of(warning, false))
            .collect(),
        ..Document::default()
    }
}

/// Checks of good practice that a function stands on: of the force and of the averages on its lines.
const OF_FUNCTION: [Check; 4] = [
    Check::ForceFall,
    Check::ForceNoise,
    Check::Coherence,
    Check::RandomError,
];

fn is_of_function(warning: &Warning) -> bool {
    let mut checks = OF_FUNCTION.iter();
    checks.any(|check| check.code() == warning.code)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn regress_a_function_carries_the_doubts_that_it_stands_on() {
        let told = |check: Check| is_of_function(&Warning::new(check.code(), ""));
        assert!(told(Check::ForceFall) && told(Check::ForceNoise) && told(Check::Coherence));
        assert!(!told(Check::Linearity) && !told(Check::TapLevels));
        assert!(!is_of_function(&Warning::new("numbered-in-order", "")));
    }
}
