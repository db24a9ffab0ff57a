//! Opening recordings and measuring each: described, bare, with channels named on the command line, or files of
//! frequency response functions.

use super::analysis::{
    Analysis, CloseUp, Conditions, Overview, PipelineError, RecordingResult, Response,
};
use super::checks::{judge, of_amplitude, together};
use super::fits::{Candidates, stabilisation};
use super::measure::{MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure};
use super::modes::modes_of_bare;
use super::warning::Warning;
use num_complex::Complex64;
use std::ops::Range;
use std::path::Path;
use tapjoint_description::described::fastened_masses;
use tapjoint_description::{
    ChannelPlace, ChannelRef, FrfForm, ReadBy, RecordingDescription, Scale, SensorDescription,
    SensorKind, TestDescription,
};
use tapjoint_signal::modal::fit::{Basis, Column, ModalData, modal_constants_of_frf};
use tapjoint_signal::modal::{CompositeLevel, ModeReading, PeakSettings, find_peaks, read_peaks};
use tapjoint_signal::recording::{
    Format, FrequencyResponses, ReadSettings, Recording, RecordingError, ResponseForm,
    open_frequency_responses,
};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, LEAST_BLOCK, Lines, SpectralError, Window,
};
use tapjoint_signal::taps::{Tap, TapSettings, TapSource, Taps, find_taps};

/// Pieces of the overview of a recording over time: two for each pixel of a usual picture.
const OVERVIEW_PIECES: u64 = 2400;

/// Opens and measures one recording of a described test.
pub(super) fn measure_described(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, test_file): (&Path, &str),
) -> Result<RecordingResult, PipelineError> {
    let file = description.file.display().to_string();
    if let Some(form) = description.form {
        return described_functions(test, description, (folder, form));
    }
    if test.sensors.is_empty() {
        return Err(PipelineError::NoSensors {
            file: test_file.to_string(),
        });
    }
    let (recording, source) = open_described(test, description, (folder, test_file))?;
    let mut settings = MeasureSettings::new(source);
    settings.band = description.band;
    settings.block = description.block;
    settings.window = test.analysis.window;
    settings.reading = test.analysis.reading;
    settings.kinds = response_kinds(test);
    let responses = test
        .sensors
        .iter()
        .map(|sensor| Response {
            name: sensor.name.clone(),
            kind: Some(sensor.kind),
            unit: Some(si_unit(sensor.kind).to_string()),
        })
        .collect();
    let hammer_unit = test.hammer.as_ref().map(|_| "N".to_string());
    let units = described_units(test, &settings.source);
    let placed = |error| match error {
        PipelineError::Measure(MeasureError::Spectral { file, problem }) => {
            PipelineError::Setting {
                file: test_file.to_string(),
                line: description.line,
                recording: file,
                problem,
            }
        }
        other => other,
    };
    let mut result =
        finish(recording.renamed(file), settings, (hammer_unit, responses)).map_err(placed)?;
    result.conditions = conditions(test, description);
    for (channel, unit) in units {
        if let Some(info) = result.channels.get_mut(channel) {
            info.unit.get_or_insert_with(|| unit.to_string());
        }
    }
    Ok(result)
}

/// Opens and reads a described file of frequency response functions.
fn described_functions(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, form): (&Path, FrfForm),
) -> Result<RecordingResult, PipelineError> {
    let mut functions = open_frequency_responses(&folder.join(&description.file))?;
    functions.file = description.file.display().to_string();
    let only = |sensors: &[SensorDescription]| match sensors {
        [one] => Some(one.name.clone()),
        _ => None,
    };
    let settings = FunctionSettings {
        form: Some(form_of_description(form)),
        sensor: description.sensor.clone().or_else(|| only(&test.sensors)),
        band: description.band,
        reading: test.analysis.reading,
    };
    let mut result = measure_functions(&functions, &settings)?;
    result.conditions = conditions(test, description);
    Ok(result)
}

/// What the sensors measure, where the hammer's force makes modal constants of it.
fn response_kinds(test: &TestDescription) -> Vec<Option<ResponseForm>> {
    let kind = |sensor: &SensorDescription| match sensor.kind {
        SensorKind::Acceleration => Some(ResponseForm::Accelerance),
        SensorKind::Velocity => Some(ResponseForm::Mobility),
        SensorKind::Displacement => Some(ResponseForm::Receptance),
        SensorKind::Sound => None,
    };
    match &test.hammer {
        Some(_) => test.sensors.iter().map(kind).collect(),
        None => Vec::new(),
    }
}

/// The unit that the description gives to each channel's values.
fn described_units(test: &TestDescription, source: &TapSource) -> Vec<(usize, &'static str)> {
    let (hammer, responses) = match source {
        TapSource::Hammer { channel, responses } => (Some((*channel, "N")), responses),
        TapSource::Responses(responses) => (None, responses),
    };
    let sensors = test.sensors.iter().map(|sensor| si_unit(sensor.kind));
    hammer
        .into_iter()
        .chain(responses.iter().copied().zip(sensors))
        .collect()
}

/// Opens a described recording, scales its channels, and says which of them are what.
fn open_described(
    test: &TestDescription,
    description: &RecordingDescription,
    (folder, test_file): (&Path, &str),
) -> Result<(Recording, TapSource), PipelineError> {
    let settings = ReadSettings {
        sample_rate: description.sample_rate,
    };
    let mut recording = Recording::open(&folder.join(&description.file), &settings)?;
    let mut find = |reference: &ChannelRef, scale: Option<Scale>, place: &ChannelPlace| {
        channel(&mut recording, reference, scale).map_err(|problem| PipelineError::Channel {
            file: test_file.to_string(),
            line: place.line,
            key: place.key.clone(),
            problem: Box::new(problem),
        })
    };
    let hammer = match &test.hammer {
        Some(hammer) => Some(find(&hammer.channel, hammer.scale, &hammer.place)?),
        None => None,
    };
    let mut channels = Vec::with_capacity(test.sensors.len());
    for sensor in &test.sensors {
        channels.push(find(&sensor.channel, sensor.scale, &sensor.place)?);
    }
    Ok((recording, source(hammer, channels)))
}

/// What the description says of the circumstances of a recording.
fn conditions(test: &TestDescription, description: &RecordingDescription) -> Conditions {
    let place =
        |sensor: &SensorDescription| Some((sensor.name.clone(), description.place_of(sensor)?));
    let mass = |sensor: &SensorDescription| Some((sensor.name.clone(), sensor.mass?));
    Conditions {
        tap: description.tap,
        sensor_positions: test.sensors.iter().filter_map(place).collect(),
        sensor_masses: test.sensors.iter().filter_map(mass).collect(),
        masses: fastened_masses(description),
        torque: description.torque,
        temperature: description.temperature,
        date: description.date.clone(),
    }
}

/// Measures a recording about which nothing is described: all channels but the hammer's are
/// responses.
///
/// # Errors
/// An unknown hammer channel; what [`measure`] meets.
pub fn measure_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<RecordingResult, PipelineError> {
    let (source, named) = bare_source(&recording, hammer)?;
    let mut settings = MeasureSettings::new(source);
    adjust(&mut settings);
    let mut result = finish(recording, settings, named)?;
    if hammer.is_none() {
        let forgotten = of_hammer_by_name(&result);
        result.measurement.warnings.extend(forgotten);
    }
    Ok(result)
}

/// Unit of the hammer channel, where there is one, and the responses.
type Named = (Option<String>, Vec<Response>);

/// Where taps are looked for in a bare recording, and what the file says of its channels.
fn bare_source(
    recording: &Recording,
    hammer: Option<&ChannelRef>,
) -> Result<(TapSource, Named), RecordingError> {
    let hammer = hammer
        .map(|reference| channel_index(recording, reference))
        .transpose()?;
    let channels: Vec<usize> = (0..recording.channels().len())
        .filter(|&c| Some(c) != hammer)
        .collect();
    let named = bare_channels(recording, hammer, &channels);
    Ok((source(hammer, channels), named))
}

/// Unit of the hammer channel, and the responses with what the file says of them.
fn bare_channels(recording: &Recording, hammer: Option<usize>, channels: &[usize]) -> Named {
    let info = |channel: usize| recording.channels().get(channel);
    let responses = channels.iter().map(|&channel| Response {
        name: info(channel)
            .and_then(|info| info.name.clone())
            .unwrap_or_else(|| format!("channel {}", channel + 1)),
        kind: None,
        unit: info(channel).and_then(|info| info.unit.clone()),
    });
    let hammer = hammer.and_then(info).and_then(|info| info.unit.clone());
    (hammer, responses.collect())
}

/// Finds the taps of a recording and goes no further: what is in it and what is wrong with it.
///
/// # Errors
/// An unknown hammer channel, an unreadable recording.
pub fn inspect_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
) -> Result<RecordingResult, PipelineError> {
    let (source, named) = bare_source(&recording, hammer)?;
    let taps = find_taps(&recording, &source, &TapSettings::default())?;
    let warnings = super::measure::of_recording(&recording, &source, &taps);
    let measurement = Measurement {
        taps,
        spectra: None,
        warnings,
    };
    result(
        &recording,
        &MeasureSettings::new(source),
        named,
        measurement,
    )
}

fn source(hammer: Option<usize>, responses: Vec<usize>) -> TapSource {
    match hammer {
        Some(channel) => TapSource::Hammer { channel, responses },
        None => TapSource::Responses(responses),
    }
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
            // What the header's unit made of the file is volts already, mV included.
            Scale::PerVolt(scale) if info.unit.as_deref() == Some("V") => scale * info.scale,
            Scale::PerVolt(scale) => scale,
        };
        recording.set_scale(index, scale)?;
    }
    Ok(index)
}

pub(super) fn finish(
    recording: Recording,
    settings: MeasureSettings,
    named: Named,
) -> Result<RecordingResult, PipelineError> {
    let measurement = measure(&recording, &settings)?;
    result(&recording, &settings, named, measurement)
}

fn result(
    recording: &Recording,
    settings: &MeasureSettings,
    (hammer_unit, responses): Named,
    measurement: Measurement,
) -> Result<RecordingResult, PipelineError> {
    let shown = settings.source.channels().first().copied().unwrap_or(0);
    let readings = measurement
        .spectra
        .as_ref()
        .map_or(0, |spectra| spectra.readings.len());
    let has_hammer = matches!(settings.source, TapSource::Hammer { .. });
    Ok(RecordingResult {
        file: recording.name().to_string(),
        format: recording.format(),
        sample_rate: Some(recording.sample_rate()),
        seconds: Some(recording.duration()),
        channels: recording.channels().to_vec(),
        has_hammer,
        conditions: Conditions::default(),
        tap_unit: if has_hammer {
            hammer_unit
        } else {
            common_unit(&responses)
        },
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

/// The unit that all responses have.
fn common_unit(responses: &[Response]) -> Option<String> {
    let first = responses.first()?;
    let same = responses.iter().all(|other| other.unit == first.unit);
    first.unit.clone().filter(|_| same)
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

/// Smallest and largest value of each piece of a channel, its mean taken out.
fn overview(recording: &Recording, channel: usize) -> Result<Overview, RecordingError> {
    let piece = recording.frames().div_ceil(OVERVIEW_PIECES).max(1) as usize;
    let mean = recording.mean(channel);
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for block in recording.blocks(&[channel], piece * 16) {
        for samples in block?
            .samples
            .iter()
            .flat_map(|samples| samples.chunks(piece))
        {
            low.push(samples.iter().copied().fold(f64::INFINITY, f64::min) - mean);
            high.push(samples.iter().copied().fold(f64::NEG_INFINITY, f64::max) - mean);
        }
    }
    Ok(Overview {
        step: piece as f64 / recording.sample_rate(),
        low,
        high,
        close_ups: Vec::new(),
    })
}

/// A channel that is taken for a response, though its name says that it is the hammer's.
pub(super) fn of_hammer_by_name(recording: &RecordingResult) -> Option<Warning> {
    let is_hammers = |name: &str| {
        let name = name.to_lowercase();
        name.contains("hammer") || name.contains("force")
    };
    let mut names = recording.responses.iter().map(|response| &response.name);
    let name = names.find(|name| is_hammers(name))?;
    let argument = match name.contains(char::is_whitespace) {
        true => format!("\"{name}\""),
        false => name.clone(),
    };
    Some(Warning::Recording {
        code: "hammer-channel",
        file: recording.file.clone(),
        text: format!(
            "channel \"{name}\" is taken for a response, but by its name it may be the hammer's; if so, \
             say --hammer {argument}: taps are then judged by their force, and there are frequency \
             response functions"
        ),
    })
}

/// What is known of a file of frequency response functions beside its numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FunctionSettings {
    /// Form of all functions; `None` = what the file says.
    pub form: Option<ResponseForm>,
    /// Name of the sensor; `None` = the functions' own names.
    pub sensor: Option<String>,
    /// Band to be analysed (Hz); `None` = all lines.
    pub band: Option<(f64, f64)>,
    /// How natural frequencies are read.
    pub reading: ReadBy,
}

/// Takes frequency response functions about which nothing is described as far as they go.
///
/// # Errors
/// A band without enough lines.
pub fn run_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
) -> Result<Analysis, PipelineError> {
    measure_functions(functions, settings).map(analysis_of)
}

/// Reads the resonances of frequency response functions.
pub(super) fn measure_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
) -> Result<RecordingResult, PipelineError> {
    let fits = |problem| PipelineError::Functions {
        file: functions.file.clone(),
        problem,
    };
    let (first, lines) = axis(functions, settings.band).map_err(fits)?;
    let values: Vec<Vec<Complex64>> = functions
        .responses
        .iter()
        .map(|response| response.values[first..first + lines.points()].to_vec())
        .collect();
    let responses = responses(functions, settings);
    let spectra = spectra(lines, values, (functions, settings));
    let warnings = functions.warnings.iter().map(|warning| Warning::Recording {
        code: warning.code(),
        file: functions.file.clone(),
        text: warning.to_string(),
    });
    Ok(RecordingResult {
        file: functions.file.clone(),
        format: Format::FrequencyResponses,
        sample_rate: None,
        seconds: None,
        channels: Vec::new(),
        has_hammer: true,
        conditions: Conditions::default(),
        tap_unit: Some("N".to_string()),
        responses,
        band: settings.band,
        overview: None,
        mode_numbers: vec![None; spectra.readings.len()],
        measurement: Measurement {
            taps: Taps {
                taps: Vec::new(),
                noise: 0.0,
                remarks: Vec::new(),
            },
            spectra: Some(spectra),
            warnings: warnings.collect(),
        },
    })
}

/// Index of the first line analysed, and the axis from there.
fn axis(
    functions: &FrequencyResponses,
    band: Option<(f64, f64)>,
) -> Result<(usize, Lines), SpectralError> {
    let spacing = functions.spacing;
    let last_line = functions.lines.saturating_sub(1);
    let ends = (functions.frequency(0), functions.frequency(last_line));
    let (low, high) = band.unwrap_or(ends);
    // A hair inside, so that a line on the band's end belongs to it.
    let hair = 1e-6 * spacing;
    let first = ((low - hair - ends.0) / spacing).ceil().max(0.0) as usize;
    let last = (((high + hair - ends.0) / spacing).floor().max(0.0) as usize).min(last_line);
    let count = (last + 1).saturating_sub(first);
    if (count as f64) < LEAST_BLOCK as f64 / DISPLAY_RATIO {
        return Err(SpectralError::TooNarrow {
            low,
            high,
            seconds: 1.0 / spacing,
            resolution: spacing,
            least_width: LEAST_BLOCK as f64 / DISPLAY_RATIO * spacing,
        });
    }
    let width = (count - 1) as f64 * spacing;
    let lines = Lines {
        low: functions.frequency(first),
        high: functions.frequency(first) + width,
        spacing,
        // The block of which an analyser would show so many lines.
        block: (DISPLAY_RATIO * (count - 1) as f64).ceil() as usize,
        duration: 1.0 / spacing,
    };
    Ok((first, lines))
}

fn responses(functions: &FrequencyResponses, settings: &FunctionSettings) -> Vec<Response> {
    let one = |response: &tapjoint_signal::recording::FrequencyResponse| {
        let form = settings.form.or(response.form);
        Response {
            name: settings
                .sensor
                .clone()
                .unwrap_or_else(|| response.name.clone()),
            kind: form.map(|form| match form {
                ResponseForm::Accelerance => SensorKind::Acceleration,
                ResponseForm::Mobility => SensorKind::Velocity,
                ResponseForm::Receptance => SensorKind::Displacement,
            }),
            unit: form.map(|form| form.response_unit().to_string()),
        }
    };
    functions.responses.iter().map(one).collect()
}

fn spectra(
    lines: Lines,
    values: Vec<Vec<Complex64>>,
    (functions, settings): (&FrequencyResponses, &FunctionSettings),
) -> MeasuredSpectra {
    let powers: Vec<Vec<f64>> = values
        .iter()
        .map(|h| h.iter().map(Complex64::norm_sqr).collect())
        .collect();
    let columns: Vec<&[Complex64]> = values.iter().map(Vec::as_slice).collect();
    let level = CompositeLevel::new(lines, &powers, None);
    let peaks = find_peaks(&level, &PeakSettings::default());
    let mut readings = read_peaks(&level, &columns, &peaks, Window::Rectangular);
    let stabilisation = stabilisation(lines.low, lines.spacing, &columns);
    if let Some(data) = modal_data(&lines, &values) {
        let candidates = Candidates {
            lines: &lines,
            data: &data,
            stabilisation: &stabilisation,
        };
        candidates.fit(&mut readings);
        add_constants(&mut readings, (functions, settings));
    }
    for reading in &mut readings {
        reading.select_estimate(settings.reading);
    }
    readings.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    MeasuredSpectra {
        averages: AveragedSpectra {
            h1: Some(values),
            ..AveragedSpectra::empty(lines)
        },
        window: Window::Rectangular,
        decay: None,
        readings,
        force_noise: None,
        stabilisation,
    }
}

/// The functions without the line at 0 Hz; `None` where they cannot be fitted.
fn modal_data(lines: &Lines, values: &[Vec<Complex64>]) -> Option<ModalData> {
    let first = usize::from(lines.low <= 0.0);
    let basis = Basis::FrequencyResponse {
        resolution: lines.resolution(),
    };
    let columns = values.iter().enumerate().map(|(sensor, values)| Column {
        tap: 0,
        sensor,
        values: values[first..].to_vec(),
    });
    let frequencies = lines.frequencies().split_off(first);
    ModalData::new(basis, frequencies, columns.collect()).ok()
}

/// Modal constants, where the form of every function is known.
fn add_constants(
    readings: &mut [ModeReading],
    (functions, settings): (&FrequencyResponses, &FunctionSettings),
) {
    let forms = functions.responses.iter();
    let forms: Option<Vec<ResponseForm>> = forms
        .map(|response| settings.form.or(response.form))
        .collect();
    let Some(forms) = forms else { return };
    for fit in readings.iter_mut().filter_map(|r| r.fit.as_deref_mut()) {
        fit.constants = modal_constants_of_frf(&fit.mode, &forms);
    }
}

/// The form that a description states.
pub(super) fn form_of_description(form: FrfForm) -> ResponseForm {
    match form {
        FrfForm::Accelerance => ResponseForm::Accelerance,
        FrfForm::Mobility => ResponseForm::Mobility,
        FrfForm::Receptance => ResponseForm::Receptance,
    }
}

/// Shown before a tap's trigger (s).
const BEFORE: f64 = 2e-3;
/// Shown after it (s): the pulse, and how the response sets out.
const AFTER: f64 = 30e-3;
/// Shown after a second hit (s): its pulse.
const AFTER_SECOND: f64 = 10e-3;

/// One for each tap.
pub(super) fn close_ups(
    recording: &Recording,
    source: &TapSource,
    taps: &Taps,
) -> Result<Vec<CloseUp>, RecordingError> {
    let (force, responses) = match source {
        TapSource::Hammer { channel, responses } => (Some(*channel), responses),
        TapSource::Responses(responses) => (None, responses),
    };
    let channels = (force, responses.first().copied());
    let shown = |tap: &Tap| {
        let second = tap.second_hit.map(|second| second.delay + AFTER_SECOND);
        (tap.time, second.map_or(AFTER, |second| second.max(AFTER)))
    };
    let all = taps.taps.iter().map(shown);
    all.map(|about| close_up(recording, channels, about))
        .collect()
}

fn close_up(
    recording: &Recording,
    (force, response): (Option<usize>, Option<usize>),
    (time, after): (f64, f64),
) -> Result<CloseUp, RecordingError> {
    let rate = recording.sample_rate();
    let first = ((time - BEFORE) * rate).round().max(0.0) as u64;
    let last = ((time + after) * rate).round().max(0.0) as u64;
    let read = |channel| samples(recording, channel, first..last);
    Ok(CloseUp {
        start: first as f64 / rate - time,
        step: 1.0 / rate,
        force: force.map(read).transpose()?,
        response: response.map(read).transpose()?,
    })
}

fn samples(
    recording: &Recording,
    channel: usize,
    frames: Range<u64>,
) -> Result<Vec<f64>, RecordingError> {
    let mean = recording.mean(channel);
    let samples = recording.read(channel, frames)?;
    Ok(samples.into_iter().map(|value| value - mean).collect())
}

/// What the channels of a bare recording are; the recording carries their scales already.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// Channel of the hammer (0-based).
    pub hammer: usize,
    /// Unit of the force; `None` = the file's, whatever that is.
    pub hammer_unit: Option<String>,
    /// Channels of the responses (0-based), each with what is known of it.
    pub responses: Vec<(usize, Response)>,
}

/// Takes a bare recording with a hammer as far as it goes: taps, spectra, readings. `adjust` may
/// change the defaults of the measurement.
///
/// # Errors
/// An unreadable recording, a band or block that does not fit.
pub fn run_wired(
    recording: Recording,
    wiring: &Wiring,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<Analysis, PipelineError> {
    let (channels, responses): (Vec<usize>, Vec<Response>) =
        wiring.responses.iter().cloned().unzip();
    let mut settings = MeasureSettings::new(TapSource::Hammer {
        channel: wiring.hammer,
        responses: channels.clone(),
    });
    adjust(&mut settings);
    let units = responses.iter().map(|response| response.unit.clone());
    let units: Vec<Option<String>> = units.collect();
    let named = (wiring.hammer_unit.clone(), responses);
    let mut result = finish(recording, settings, named)?;
    let stated = channels.into_iter().zip(units);
    for (channel, unit) in stated.chain([(wiring.hammer, wiring.hammer_unit.clone())]) {
        if let Some(info) = result.channels.get_mut(channel) {
            info.unit = unit;
        }
    }
    Ok(analysis_of(result))
}

/// The analysis of a recording about which nothing is described.
pub(super) fn analysis_of(mut recording: RecordingResult) -> Analysis {
    let modes = modes_of_bare(&mut recording);
    let (verdicts, doubts) = judge(std::slice::from_ref(&recording));
    let mut warnings = recording.measurement.warnings.clone();
    warnings.extend(of_amplitude(std::slice::from_ref(&recording)));
    warnings.extend(doubts);
    Analysis {
        name: recording.file.clone(),
        structure: None,
        aside: vec![None],
        verdicts,
        warnings: together(warnings),
        modes,
        identification: None,
        recordings: vec![recording],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_signal::recording::Channel;
    use tapjoint_signal::taps::SecondHit;

    #[test]
    fn limit_a_close_up_ends_where_the_recording_does() {
        let channel = |from: f64| Channel {
            name: None,
            unit: None,
            samples: (0..100).map(|k| from + f64::from(k)).collect(),
        };
        let channels = vec![channel(0.0), channel(500.0)];
        let recording = Recording::from_samples("taps", 1000.0, channels).expect("samples");
        let found =
            |time: f64| close_up(&recording, (Some(0), Some(1)), (time, AFTER)).expect("samples");
        let lengths = [0.001, 0.050, 0.090].map(|time| found(time).force.map(|force| force.len()));
        assert_eq!(lengths, [Some(31), Some(32), Some(12)]);
        let middle = found(0.050);
        assert!((middle.start + 0.002).abs() < 1e-12, "{}", middle.start);
        // Of both channels the same frames, each less its mean.
        assert_eq!(middle.force, middle.response);
        assert_eq!(middle.force.map(|force| force[0]), Some(48.0 - 49.5));
        // As far as a second hit, which is why a tap is rejected.
        let hit = |second_hit| Tap {
            time: 0.010,
            peak: 1.0,
            pulse_end: None,
            record: 0..100,
            second_hit,
            rejection: None,
        };
        let far = SecondHit {
            delay: 0.035,
            ratio: 0.6,
        };
        let taps = Taps {
            taps: vec![hit(None), hit(Some(far))],
            noise: 0.0,
            remarks: Vec::new(),
        };
        let all = close_ups(&recording, &TapSource::Responses(vec![0]), &taps).expect("samples");
        let lengths: Vec<_> = all
            .iter()
            .map(|one| one.response.as_ref().map(Vec::len))
            .collect();
        assert_eq!(lengths, [Some(32), Some(47)]);
    }
}
