//! The data that the pictures of a recording show, taken out of the finished analysis.

use num_complex::Complex64;
use tapjoint_analysis::{
    Analysis, CloseUp, Frf, FrfSettings, MeasuredSpectra, RecordingResult, Response, frfs_of,
};
use tapjoint_description::SensorKind;
use tapjoint_signal::modal::amplitude::AmplitudeCurve;
use tapjoint_signal::modal::polyreference::{BandSearch, PoleStability};
use tapjoint_signal::spectral::{FrfEstimator, Lines};

use super::format::unit_words;
use super::short_names::ends_of_paths;

/// What the pictures of one recording need.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingFigure {
    /// Its file, by as much of the end of its path as tells it from the others.
    pub file: String,
    /// Envelope over time of the channel on which taps were found; `None` where there are no samples.
    pub overview: Option<TimeOverview>,
    /// The spectra; `None` when no tap was accepted.
    pub spectra: Option<SpectraFigure>,
    /// Poles over the orders; `None` where none were looked for or found.
    pub stabilisation: Option<StabilisationFigure>,
    /// Frequency and damping against amplitude; `None` where no mode changes.
    pub amplitude: Option<AmplitudeFigure>,
}

/// Poles over the orders of a polyreference fit.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationFigure {
    /// The whole band, then the bands about groups of peaks.
    pub bands: Vec<StabilisationBand>,
}

/// One band's stabilisation diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationBand {
    /// Between these (Hz) modes are taken from this band.
    pub core: (f64, f64),
    /// Highest order.
    pub order: usize,
    /// Poles of all orders.
    pub poles: Vec<PoleMark>,
    /// Frequencies selected as modes (Hz).
    pub selected: Vec<f64>,
}

/// A pole in a stabilisation diagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleMark {
    /// Order it was found at.
    pub order: usize,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Damping ratio (1).
    pub damping_ratio: f64,
    /// What of it the order before had.
    pub stability: PoleStability,
}

/// Smallest and largest value in equal pieces of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeOverview {
    /// What is shown: "force (N)" or "response A (m/s2)".
    pub label: String,
    /// Length of a piece (s).
    pub step: f64,
    /// Smallest value in each piece.
    pub low: Vec<f64>,
    /// Largest value in each piece.
    pub high: Vec<f64>,
    /// Taps: time (s), peak value, accepted.
    pub taps: Vec<TapMark>,
}

/// A tap in the time overview.
#[derive(Debug, Clone, PartialEq)]
pub struct TapMark {
    /// Time (s).
    pub time: f64,
    /// Peak value (unit of the overview).
    pub peak: f64,
    /// Why it was rejected; `None` = accepted.
    pub rejected: Option<String>,
    /// The samples about it; `None` where they were not kept.
    pub close_up: Option<TapCloseUp>,
}

/// The samples about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapCloseUp {
    /// First sample (s from the trigger).
    pub start: f64,
    /// Distance of the samples (s).
    pub step: f64,
    /// The force, where there is one, and the first response.
    pub curves: Vec<TapCurve>,
}

/// A channel about a tap.
#[derive(Debug, Clone, PartialEq)]
pub struct TapCurve {
    /// "force" or "response A".
    pub label: String,
    /// Its unit: "N".
    pub unit: String,
    /// Every sample (unit), the channel's mean taken out.
    pub values: Vec<f64>,
}

/// Magnitudes over the lines.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectraFigure {
    /// The axis.
    pub lines: Lines,
    /// Taps averaged.
    pub averages: usize,
    /// Root mean square of the force's transforms (N s); `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// Unit of the force's transforms: "N s".
    pub force_unit: String,
    /// One curve for each response: its transform's root mean square (unit s).
    pub responses: Vec<Curve>,
    /// One curve for each frequency response function, complex parts kept; empty without a hammer.
    pub frfs: Vec<FrfCurve>,
    /// Resonances to mark.
    pub peaks: Vec<PeakMark>,
}

/// A named curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Sensor's name and what it senses: "A, acceleration".
    pub name: String,
    /// Unit of the values: "m/s2 s".
    pub unit: String,
    /// One value a line.
    pub values: Vec<f64>,
}

/// A frequency response function; where something does not exist stands what is no number (NaN).
#[derive(Debug, Clone, PartialEq)]
pub struct FrfCurve {
    /// Sensor's name.
    pub name: String,
    /// "accelerance", "mobility", "receptance" or "sound pressure per force".
    pub form: String,
    /// Its unit: "(m/s2)/N".
    pub unit: String,
    /// Magnitude (unit above).
    pub magnitude: Vec<f64>,
    /// Phase (degrees), -180 to 180.
    pub phase: Vec<f64>,
    /// The estimator: "H1".
    pub estimator: String,
    /// Magnitudes by other estimators, with their names (unit above); may be empty.
    pub others: Vec<(String, Vec<f64>)>,
    /// Coherence; `None` below two averages.
    pub coherence: Option<Vec<f64>>,
}

/// A resonance in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakMark {
    /// Mode number of this recording's peak, or `None` for mains and the like.
    pub mode: Option<usize>,
    /// Best frequency (Hz).
    pub frequency: f64,
    /// Frequency on the line (Hz).
    pub line_frequency: f64,
    /// Bound of the line reading (Hz).
    pub half_line: f64,
    /// How far it stands out (dB): the most prominent peaks get their labels first.
    pub prominence_db: f64,
    /// "mains 50 Hz" and the like.
    pub label: Option<String>,
}

/// A mode's curve with the mode's number, and what the amplitude is.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeFigure {
    /// Name of the recording.
    pub file: String,
    /// What the amplitude is, with its unit: "amplitude (m/s2)".
    pub amplitude: String,
    /// Number and curve of every mode; those without points are left out of the picture.
    pub modes: Vec<(usize, AmplitudeCurve)>,
}

/// One set of pictures for each recording.
pub fn figures(analysis: &Analysis) -> Vec<RecordingFigure> {
    let files = analysis.recordings.iter().map(|one| one.file.as_str());
    let names = ends_of_paths(&files.collect::<Vec<_>>());
    let named = analysis.recordings.iter().zip(&names);
    named
        .map(|(recording, name)| recording_figure(recording, name))
        .collect()
}

fn recording_figure(recording: &RecordingResult, name: &str) -> RecordingFigure {
    let close_ups = recording.overview.iter().flat_map(|all| &all.close_ups);
    let mut close_ups = close_ups.map(|one| close_up(recording, one));
    let taps = recording
        .measurement
        .taps
        .taps
        .iter()
        .map(|tap| TapMark {
            time: tap.time,
            peak: tap.peak,
            rejected: tap.rejection.as_ref().map(ToString::to_string),
            close_up: close_ups.next(),
        })
        .collect();
    let label = match recording.responses.first() {
        _ if recording.has_hammer => format!("force ({})", words_of(&recording.tap_unit)),
        Some(first) => format!("response {} ({})", first.name, words_of(&first.unit)),
        None => "response".to_string(),
    };
    RecordingFigure {
        file: name.to_owned(),
        overview: recording.overview.as_ref().map(|overview| TimeOverview {
            label,
            step: overview.step,
            low: overview.low.clone(),
            high: overview.high.clone(),
            taps,
        }),
        spectra: recording
            .measurement
            .spectra
            .as_ref()
            .map(|spectra| spectra_figure(recording, spectra)),
        stabilisation: recording
            .measurement
            .spectra
            .as_ref()
            .and_then(|spectra| stabilisation_figure(&spectra.stabilisation.searches)),
        amplitude: amplitude_figure(recording, name),
    }
}

/// The samples about a tap with the names of their channels.
fn close_up(recording: &RecordingResult, found: &CloseUp) -> TapCloseUp {
    let curve = |label: String, unit: &Option<String>, values: &Option<Vec<f64>>| {
        Some(TapCurve {
            label,
            unit: words_of(unit),
            values: values.clone()?,
        })
    };
    let force = curve("force".to_owned(), &recording.tap_unit, &found.force);
    let first = recording.responses.first();
    let response = first.and_then(|first| {
        let label = format!("response {}", first.name);
        curve(label, &first.unit, &found.response)
    });
    TapCloseUp {
        start: found.start,
        step: found.step,
        curves: force.into_iter().chain(response).collect(),
    }
}

/// `None` where no band was searched.
fn stabilisation_figure(searches: &[BandSearch]) -> Option<StabilisationFigure> {
    let band = |search: &BandSearch| StabilisationBand {
        core: search.band.core,
        order: search.order,
        poles: search
            .diagram
            .iter()
            .map(|pole| PoleMark {
                order: pole.order,
                frequency: pole.frequency,
                damping_ratio: pole.damping_ratio,
                stability: pole.stability,
            })
            .collect(),
        selected: search.modes.iter().map(|mode| mode.frequency).collect(),
    };
    (!searches.is_empty()).then(|| StabilisationFigure {
        bands: searches.iter().map(band).collect(),
    })
}

/// The curves of all numbered modes; `None` where none of them changes enough to matter.
fn amplitude_figure(recording: &RecordingResult, name: &str) -> Option<AmplitudeFigure> {
    let spectra = recording.measurement.spectra.as_ref()?;
    let numbered = || spectra.readings.iter().zip(&recording.mode_numbers);
    numbered()
        .find(|(reading, mode)| mode.is_some() && recording.amplitude_change(reading).is_some())?;
    let modes: Vec<(usize, AmplitudeCurve)> = numbered()
        .filter_map(|(reading, &mode)| {
            Some((mode?, reading.fit.as_ref()?.amplitude.as_ref()?.clone()))
        })
        .collect();
    Some(AmplitudeFigure {
        file: name.to_owned(),
        amplitude: amplitude_words(recording, &modes),
        modes,
    })
}

/// "peak amplitude of A (m/s\u{b2})", or of the strongest sensor where the modes differ in it.
fn amplitude_words(recording: &RecordingResult, modes: &[(usize, AmplitudeCurve)]) -> String {
    let mut sensors: Vec<usize> = modes.iter().filter_map(|(_, curve)| curve.sensor).collect();
    sensors.sort_unstable();
    sensors.dedup();
    let responses: Vec<&Response> = sensors
        .iter()
        .filter_map(|&sensor| recording.responses.get(sensor))
        .collect();
    let unit = responses.first().and_then(|first| first.unit.clone());
    let same = responses.iter().all(|response| response.unit == unit);
    let unit = if same {
        words_of(&unit)
    } else {
        "each sensor's unit".to_string()
    };
    match responses.as_slice() {
        [one] => format!("peak amplitude of {} ({unit})", one.name),
        _ => format!("peak amplitude of the mode's strongest sensor ({unit})"),
    }
}

fn spectra_figure(recording: &RecordingResult, spectra: &MeasuredSpectra) -> SpectraFigure {
    let averages = &spectra.averages;
    let named = |response: &Response| match response.kind {
        Some(kind) => format!("{}, {}", response.name, words(kind)),
        None => response.name.clone(),
    };
    SpectraFigure {
        lines: averages.lines,
        averages: averages.taps,
        force: averages.force.clone(),
        force_unit: seconds_of(recording.tap_unit.as_deref()),
        responses: recording
            .responses
            .iter()
            .zip(&averages.responses)
            .map(|(response, values)| Curve {
                name: named(response),
                unit: seconds_of(response.unit.as_deref()),
                values: values.clone(),
            })
            .collect(),
        // Without a hammer there are none.
        frfs: frfs_of(recording, &FrfSettings::default())
            .unwrap_or_default()
            .iter()
            .map(|frf| frf_curve(frf, Vec::new()))
            .collect(),
        peaks: spectra
            .readings
            .iter()
            .zip(&recording.mode_numbers)
            .map(|(reading, &mode)| PeakMark {
                mode,
                frequency: reading.frequency,
                line_frequency: reading.line_frequency,
                half_line: reading.half_line,
                prominence_db: reading.prominence_db.unwrap_or(0.0),
                label: reading.label.map(|label| label.to_string()),
            })
            .collect(),
    }
}

/// The recording's pictures with these frequency response functions, all estimators shown.
pub fn frf_figure(recording: &RecordingResult, frfs: &[Frf]) -> RecordingFigure {
    let names = ends_of_paths(&[&recording.file]);
    let mut figure = recording_figure(recording, &names.concat());
    if let Some(spectra) = &mut figure.spectra {
        spectra.frfs = frfs
            .iter()
            .map(|frf| frf_curve(frf, other_estimators(frf)))
            .collect();
    }
    figure
}

/// The estimators that are not meant; of one average all are the same.
fn other_estimators(frf: &Frf) -> Vec<FrfEstimator> {
    let all = FrfEstimator::ALL.into_iter().filter(|_| frf.averages > 1);
    all.filter(|&estimator| estimator != frf.estimator)
        .collect()
}

fn frf_curve(frf: &Frf, others: Vec<FrfEstimator>) -> FrfCurve {
    let magnitudes = |values: &[Option<Complex64>]| {
        let magnitude = |value: &Option<Complex64>| value.map_or(f64::NAN, |value| value.norm());
        values.iter().map(magnitude).collect::<Vec<f64>>()
    };
    let phase = |value: &Option<Complex64>| value.map_or(f64::NAN, |v| v.arg().to_degrees());
    let known = |g2: &Option<f64>| g2.unwrap_or(f64::NAN);
    FrfCurve {
        name: frf.response.clone(),
        form: frf.form_words.to_string(),
        unit: unit_words(&frf.unit),
        magnitude: magnitudes(frf.values()),
        phase: frf.values().iter().map(phase).collect(),
        // Of what an analyser has made nobody says by which.
        estimator: match frf.averages {
            0 => "of the file".to_owned(),
            _ => frf.estimator.name().to_owned(),
        },
        others: others
            .into_iter()
            .map(|estimator| (estimator.name().to_string(), magnitudes(frf.of(estimator))))
            .collect(),
        coherence: frf
            .coherence
            .as_ref()
            .map(|coherence| coherence.iter().map(known).collect()),
    }
}

/// Unit of a transform: that of the signal times seconds.
fn seconds_of(unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{} s", unit_words(unit)),
        None => "unit of the file \u{d7} s".to_string(),
    }
}

/// A unit in words, also where nobody said.
fn words_of(unit: &Option<String>) -> String {
    unit_words(unit.as_deref().unwrap_or("unit of the file"))
}

fn words(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Acceleration => "acceleration",
        SensorKind::Velocity => "velocity",
        SensorKind::Displacement => "displacement",
        SensorKind::Sound => "sound pressure",
    }
}
