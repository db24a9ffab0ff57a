//! From files and channels to measured recordings: described, bare, or with channels named on the command line.

use super::explained::explain;
use super::frf::{form_of, form_of_kind};
use super::function_file::{FunctionSettings, measure_functions};
use super::measurement::{MeasureError, MeasureSettings, Measurement, measure_watched};
use super::recording_result::{
    Conditions, Overview, RecordingResult, Response, close_ups, overview,
};
use super::stages::{Stage, Watch, Work};
use super::warnings::{Warning, of_recording};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use tapjoint_description::{
    ChannelPlace, ChannelRef, FunctionForm, RecordingDescription, Scale, SensorKind,
    TestDescription,
};
use tapjoint_signal::recording::{
    ReadSettings, Recording, RecordingError, open_frequency_responses,
};
use tapjoint_signal::taps::{TapSettings, TapSource, find_taps};

/// Reasons for which an analysis stops.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A recording could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// A description that does not fit its recordings. The message names file, line and key.
    #[error("{0}")]
    Description(String),
}

/// Opens and measures the recordings of a described test, `test_file`, which lie in `folder`.
pub(super) fn measure_test(
    test: &TestDescription,
    folder: &Path,
    test_file: &str,
    watch: &dyn Watch,
) -> Result<Vec<RecordingResult>, PipelineError> {
    // In parallel, but collected in the description's order, so that of several errors the first is reported.
    let recordings = test.recordings.par_iter();
    let results: Vec<Result<_, _>> = recordings
        .map(|recording| {
            let mut work = Work::begin(watch, Stage::Taps);
            measure_described(test, recording, folder, test_file, &mut work)
        })
        .collect();
    results.into_iter().collect()
}

fn measure_described(
    test: &TestDescription,
    description: &RecordingDescription,
    folder: &Path,
    test_file: &str,
    work: &mut Work,
) -> Result<RecordingResult, PipelineError> {
    let path = folder.join(&description.file);
    let file = description.name();
    let read = described_reading(description);
    if let Some(form) = description.form {
        let mut functions = open_frequency_responses(&path, &read)?;
        if let FunctionForm::Response(form) = form
            && !functions.has_phase
        {
            let form = form.name();
            return Err(PipelineError::Description(format!(
                "{test_file}:{}: {file} holds magnitudes without a phase, and form = \"{form}\" needs one; write form = \"spectrum\", or export the phase as well",
                description.line
            )));
        }
        functions.file = file;
        let mut sensor = description.sensor.clone();
        if let ([one], None) = (test.sensors.as_slice(), &sensor) {
            sensor = Some(one.name.clone());
        }
        let settings = FunctionSettings {
            form: Some(form),
            sensor,
            band: description.band,
            reading: test.analysis.reading,
            poles: poles_of(test, description),
        };
        let mut result = measure_functions(&functions, &settings, work)?;
        result.conditions = conditions(test, description);
        return Ok(result);
    }
    if test.sensors.is_empty() {
        return Err(PipelineError::Description(format!(
            "{test_file}: the recordings need at least one [[sensor]] with its channel, or there is no response to \
             analyse"
        )));
    }
    let mut recording = match description.more_files[..] {
        [] => Recording::open(&path, &read)?,
        _ => open_joined(description, folder, &read)?,
    };
    let wiring = described_wiring(test, &mut recording, test_file)?;
    let settings = described_settings(test, description, &wiring);
    let finished = finish(recording.renamed(file), settings, &wiring, work);
    let mut result = finished.map_err(|error| match error {
        PipelineError::Measure(problem @ MeasureError::Spectral { .. }) => {
            PipelineError::Description(format!("{test_file}:{}: {problem}", description.line))
        }
        other => other,
    })?;
    result.conditions = conditions(test, description);
    for (channel, unit) in wiring.units() {
        let info = result.channels.get_mut(channel);
        if let Some(info) = info.filter(|info| info.unit.is_none()) {
            info.unit.clone_from(unit);
        }
    }
    Ok(result)
}

/// Returns the frequencies (Hz) of the modes that were chosen by hand for a recording, else for the test.
fn poles_of(test: &TestDescription, description: &RecordingDescription) -> Vec<f64> {
    let own = description.poles.as_ref();
    own.unwrap_or(&test.analysis.poles).clone()
}

/// Opens the files of a recording and joins them, each under its described name.
fn open_joined(
    description: &RecordingDescription,
    folder: &Path,
    read: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let whole = ReadSettings {
        frames: None,
        ..read.clone()
    };
    let mut parts = Vec::new();
    for (number, file) in description.files().enumerate() {
        // The last one may go on growing.
        let is_last = number == description.more_files.len();
        let read = if is_last { read } else { &whole };
        let opened = Recording::open(&folder.join(file), read)?;
        parts.push(opened.renamed(file.display().to_string()));
    }
    Recording::joined(description.name(), parts)
}

/// Returns what a description says of the file of a recording.
pub fn described_reading(description: &RecordingDescription) -> ReadSettings {
    ReadSettings {
        sample_rate: description.sample_rate,
        time_unit: description.time_unit,
        values: description.values,
        variables: description.variables.clone(),
        frames: description.frames,
    }
}

/// Returns the settings of a described recording.
pub(super) fn described_settings(
    test: &TestDescription,
    description: &RecordingDescription,
    wiring: &Wiring,
) -> MeasureSettings {
    let mut settings = MeasureSettings::new(wiring.source());
    settings.band = description.band;
    settings.block = description.block;
    settings.taps.keep_overload = description.keep_overload;
    settings.taps.by_hand = description.by_hand.clone();
    settings.window = test.analysis.window;
    settings.reading = test.analysis.reading;
    settings.select = test.analysis.select;
    settings.poles = poles_of(test, description);
    let kinds = test.sensors.iter().map(|sensor| form_of_kind(sensor.kind));
    settings.kinds = kinds.collect();
    settings
}

/// Finds and scales the described channels of a recording.
pub(super) fn described_wiring(
    test: &TestDescription,
    recording: &mut Recording,
    test_file: &str,
) -> Result<Wiring, PipelineError> {
    let mut wiring = Wiring::default();
    if let Some(hammer) = &test.hammer {
        let found = channel(recording, &hammer.channel, hammer.scale);
        wiring.hammer = Some(found.map_err(|problem| at(problem, test_file, &hammer.place))?);
        wiring.hammer_unit = Some("N".to_string());
    }
    for sensor in &test.sensors {
        let found = channel(recording, &sensor.channel, sensor.scale);
        let channel = found.map_err(|problem| at(problem, test_file, &sensor.place))?;
        let response = Response {
            name: sensor.name.clone(),
            kind: Some(sensor.kind),
            unit: Some(si_unit(sensor.kind).to_string()),
        };
        wiring.responses.push((channel, response));
    }
    Ok(wiring)
}

/// The error about a channel, with its place in the description.
fn at(problem: RecordingError, test_file: &str, place: &ChannelPlace) -> PipelineError {
    let (line, key) = (place.line, &place.key);
    PipelineError::Description(format!("{test_file}:{line}: `{key}`: {problem}"))
}

/// Circumstances of a recording, as described.
fn conditions(test: &TestDescription, description: &RecordingDescription) -> Conditions {
    let (mut positions, mut masses) = (BTreeMap::new(), BTreeMap::new());
    for sensor in &test.sensors {
        if let Some(place) = description.place_of(sensor) {
            positions.insert(sensor.name.clone(), place);
        }
        if let Some(mass) = sensor.mass {
            masses.insert(sensor.name.clone(), mass);
        }
    }
    Conditions {
        free_length: description.length,
        tap: description.tap,
        sensor_positions: positions,
        sensor_masses: masses,
        masses: description.masses.clone(),
        torque: description.torque,
        temperature: description.temperature,
        date: description.date.clone(),
    }
}

/// Measures a recording about which nothing is described: all channels but the hammer's are
/// responses.
///
/// # Errors
/// An unknown hammer channel; what [`measure`](crate::measure) meets.
pub fn measure_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<RecordingResult, PipelineError> {
    measure_bare_watched(recording, hammer, adjust, &())
}

/// Measures as [`measure_bare`] does, and announces the stages to `watch`.
///
/// # Errors
/// Those of [`measure_bare`].
pub fn measure_bare_watched(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
    watch: &dyn Watch,
) -> Result<RecordingResult, PipelineError> {
    let mut work = Work::begin(watch, Stage::Taps);
    let wiring = bare_wiring(&recording, hammer)?;
    let mut settings = MeasureSettings::new(wiring.source());
    adjust(&mut settings);
    let mut result = finish(recording, settings, &wiring, &mut work)?;
    let mut names = result.responses.iter().map(|response| &response.name);
    let forgotten = names.find(|name| {
        let name = name.to_lowercase();
        hammer.is_none() && (name.contains("hammer") || name.contains("force"))
    });
    if let Some(name) = forgotten {
        let warning = Warning::hammer_channel(&result.file, name);
        result.measurement.warnings.push(warning);
    }
    Ok(result)
}

/// The channels of a bare recording, with the names and units that the file gives.
pub(super) fn bare_wiring(
    recording: &Recording,
    hammer: Option<&ChannelRef>,
) -> Result<Wiring, RecordingError> {
    let mut wiring = Wiring::default();
    if let Some(reference) = hammer {
        wiring.hammer = Some(channel_index(recording, reference)?);
    }
    for (channel, info) in recording.channels().iter().enumerate() {
        if Some(channel) == wiring.hammer {
            wiring.hammer_unit.clone_from(&info.unit);
            continue;
        }
        let name = info.name.clone();
        let response = Response {
            name: name.unwrap_or_else(|| format!("channel {}", channel + 1)),
            kind: None,
            unit: info.unit.clone(),
        };
        wiring.responses.push((channel, response));
    }
    Ok(wiring)
}

/// Finds the taps of a recording and goes no further: what is in it and what is wrong with it.
///
/// # Errors
/// An unknown hammer channel, an unreadable recording.
pub fn inspect_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    taps: &TapSettings,
    watch: &dyn Watch,
) -> Result<RecordingResult, PipelineError> {
    let mut work = Work::begin(watch, Stage::Taps);
    let wiring = bare_wiring(&recording, hammer)?;
    let source = wiring.source();
    let taps = find_taps(&recording, &source, taps)?;
    let warnings = of_recording(&recording, &source, &taps);
    let measurement = Measurement {
        taps,
        spectra: None,
        warnings,
    };
    let settings = MeasureSettings::new(source);
    result(&recording, &settings, &wiring, measurement, &mut work)
}

fn channel_index(recording: &Recording, reference: &ChannelRef) -> Result<usize, RecordingError> {
    match reference {
        ChannelRef::Number(number) => recording.channel_by_number(*number),
        ChannelRef::Name(name) => recording.channel_by_name(name),
    }
}

fn channel(
    recording: &mut Recording,
    reference: &ChannelRef,
    scale: Option<Scale>,
) -> Result<usize, RecordingError> {
    let index = channel_index(recording, reference)?;
    if let Some(scale) = scale {
        let info = &recording.channels()[index];
        let scale = match scale {
            Scale::PerUnit(scale) => scale,
            // Where the header states volts, mV included, its own factor gives volts and is kept.
            Scale::PerVolt(scale) if info.unit.as_deref() == Some("V") => scale * info.scale,
            Scale::PerVolt(scale) => scale,
        };
        recording.set_scale(index, scale)?;
    }
    Ok(index)
}

/// Measures a recording whose channels are known. `work` is in the stage of the taps, and ends there.
pub(super) fn finish(
    recording: Recording,
    settings: MeasureSettings,
    wiring: &Wiring,
    work: &mut Work,
) -> Result<RecordingResult, PipelineError> {
    let measurement = measure_watched(&recording, &settings, work)?;
    result(&recording, &settings, wiring, measurement, work)
}

fn result(
    recording: &Recording,
    settings: &MeasureSettings,
    wiring: &Wiring,
    mut measurement: Measurement,
    work: &mut Work,
) -> Result<RecordingResult, PipelineError> {
    let shown = settings.source.channels().first().copied().unwrap_or(0);
    let spectra = measurement.spectra.as_ref();
    let readings = spectra.map_or(0, |spectra| spectra.readings.len());
    let responses = wiring.responses.iter();
    let responses: Vec<Response> = responses.map(|(_, response)| response.clone()).collect();
    if let Some(spectra) = measurement.spectra.as_mut() {
        let force_unit = wiring.hammer_unit.as_deref();
        let forms = responses.iter().map(|one| form_of(one, force_unit));
        spectra.fitted = explain(
            &spectra.averages,
            spectra.window.added_decay(),
            &spectra.readings,
            &forms.collect::<Vec<_>>(),
            &mut spectra.unlisted,
        );
        let lines = &spectra.averages.lines;
        let band = (lines.low, lines.high);
        let unlisted = Warning::unlisted_peaks(
            recording.name(),
            &spectra.unlisted,
            band,
            spectra.fitted.is_some(),
        );
        measurement.warnings.extend(unlisted);
        let without_mode = &spectra.stabilisation.without_mode;
        let poles = Warning::poles_without_mode(recording.name(), without_mode);
        measurement.warnings.extend(poles);
    }
    // What is shown of the recording is read again.
    work.go_on(Stage::Taps);
    Ok(RecordingResult {
        file: recording.name().to_string(),
        files: recording
            .parts()
            .map(|(_, part)| part.name().to_owned())
            .collect(),
        format: recording.format(),
        sample_rate: Some(recording.sample_rate()),
        seconds: Some(recording.duration()),
        channels: recording.channels().to_vec(),
        has_hammer: wiring.hammer.is_some(),
        conditions: Conditions::default(),
        tap_unit: wiring.tap_unit(),
        responses,
        band: settings.band,
        overview: Some(Overview {
            close_ups: close_ups(recording, &settings.source, &measurement.taps)?,
            ..overview(recording, shown)?
        }),
        measurement,
        mode_numbers: vec![None; readings],
    })
}

/// The SI unit of what a sensor senses.
pub fn si_unit(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Acceleration => "m/s2",
        SensorKind::Velocity => "m/s",
        SensorKind::Displacement => "m",
        SensorKind::Sound => "Pa",
    }
}

/// The channels of hammer and responses; the recording carries their scales already.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wiring {
    /// Channel of the hammer (0-based); `None` without one.
    pub hammer: Option<usize>,
    /// Unit of the force; `None` where it is not known.
    pub hammer_unit: Option<String>,
    /// Channels of the responses (0-based), each with what is known of it.
    pub responses: Vec<(usize, Response)>,
}

impl Wiring {
    /// The channels in which taps are searched.
    pub(super) fn source(&self) -> TapSource {
        let responses = self.responses.iter().map(|(channel, _)| *channel).collect();
        match self.hammer {
            Some(channel) => TapSource::Hammer { channel, responses },
            None => TapSource::Responses(responses),
        }
    }

    /// The unit of the force, or without a hammer the one that all responses have.
    pub(super) fn tap_unit(&self) -> Option<String> {
        if self.hammer.is_some() {
            return self.hammer_unit.clone();
        }
        let (_, first) = self.responses.first()?;
        let mut responses = self.responses.iter();
        let is_common = responses.all(|(_, other)| other.unit == first.unit);
        first.unit.clone().filter(|_| is_common)
    }

    /// Every channel with the name of its sensor, or "hammer".
    pub(super) fn names(&self) -> Vec<(usize, String)> {
        let responses = self.responses.iter();
        let responses = responses.map(|(channel, response)| (*channel, response.name.clone()));
        let hammer = self.hammer.map(|channel| (channel, "hammer".to_owned()));
        hammer.into_iter().chain(responses).collect()
    }

    /// Every channel with its unit.
    pub(super) fn units(&self) -> impl Iterator<Item = (usize, &Option<String>)> {
        let responses = self.responses.iter();
        let responses = responses.map(|(channel, response)| (*channel, &response.unit));
        responses.chain(self.hammer.map(|hammer| (hammer, &self.hammer_unit)))
    }
}
