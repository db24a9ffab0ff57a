//! Opening recordings and measuring each: described, bare, with channels named on the command line, or files of
//! frequency response functions.

use super::analysis::{
    Analysis, CloseUp, Conditions, Overview, PipelineError, RecordingResult, Response,
};
use super::checks::{judge, of_amplitude, together};
use super::fits::{Candidates, stabilisation};
use super::frf::form_of_kind;
use super::measure::{MeasureError, MeasureSettings, MeasuredSpectra, Measurement, measure};
use super::modes::modes_of_bare;
use super::warning::Warning;
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use tapjoint_description::{
    ChannelPlace, ChannelRef, ReadBy, RecordingDescription, Scale, SensorKind, TestDescription,
};
use tapjoint_signal::modal::fit::{Basis, Column, ModalData, modal_constants_of_frf};
use tapjoint_signal::modal::{CompositeLevel, PeakSettings, find_peaks, read_peaks};
use tapjoint_signal::recording::{
    Format, FrequencyResponses, ReadSettings, Recording, RecordingError, ResponseForm,
    open_frequency_responses,
};
use tapjoint_signal::spectral::{
    AveragedSpectra, DISPLAY_RATIO, LEAST_BLOCK, Lines, SpectralError, Window,
};
use tapjoint_signal::taps::{TapSettings, TapSource, Taps, find_taps};

/// Pieces of the overview of a recording over time: two for each pixel of a usual picture.
const OVERVIEW_PIECES: u64 = 2400;

/// Opens and measures the recordings of a described test, `test_file`, which lie in `folder`.
pub(super) fn measure_test(
    test: &TestDescription,
    folder: &Path,
    test_file: &str,
) -> Result<Vec<RecordingResult>, PipelineError> {
    // In parallel, but collected in the description's order, so that of several errors the first is reported.
    let recordings = test.recordings.par_iter();
    let results: Vec<Result<_, _>> = recordings
        .map(|recording| measure_described(test, recording, folder, test_file))
        .collect();
    results.into_iter().collect()
}

fn measure_described(
    test: &TestDescription,
    description: &RecordingDescription,
    folder: &Path,
    test_file: &str,
) -> Result<RecordingResult, PipelineError> {
    let path = folder.join(&description.file);
    let file = description.file.display().to_string();
    if let Some(form) = description.form {
        let mut functions = open_frequency_responses(&path)?;
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
        };
        let mut result = measure_functions(&functions, &settings)?;
        result.conditions = conditions(test, description);
        return Ok(result);
    }
    let read = ReadSettings {
        sample_rate: description.sample_rate,
    };
    if test.sensors.is_empty() {
        return Err(PipelineError::NoSensors {
            file: test_file.to_string(),
        });
    }
    let mut recording = Recording::open(&path, &read)?;
    let wiring = described_wiring(test, &mut recording, test_file)?;
    let mut settings = MeasureSettings::new(wiring.source());
    settings.band = description.band;
    settings.block = description.block;
    settings.window = test.analysis.window;
    settings.reading = test.analysis.reading;
    if wiring.hammer.is_some() {
        // The hammer's force makes modal constants of the responses.
        let kinds = test.sensors.iter().map(|sensor| form_of_kind(sensor.kind));
        settings.kinds = kinds.collect();
    }
    let finished = finish(recording.renamed(file), settings, &wiring);
    let mut result = finished.map_err(|error| match error {
        PipelineError::Measure(MeasureError::Spectral { file, problem }) => {
            PipelineError::Setting {
                file: test_file.to_string(),
                line: description.line,
                recording: file,
                problem,
            }
        }
        other => other,
    })?;
    result.conditions = conditions(test, description);
    for (channel, unit) in wiring.units() {
        if let Some(info) = result
            .channels
            .get_mut(channel)
            .filter(|info| info.unit.is_none())
        {
            info.unit.clone_from(unit);
        }
    }
    Ok(result)
}

/// Finds and scales the described channels of a recording.
fn described_wiring(
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
    PipelineError::Channel {
        file: test_file.to_string(),
        line: place.line,
        key: place.key.clone(),
        problem: Box::new(problem),
    }
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
/// An unknown hammer channel; what [`measure`] meets.
pub fn measure_bare(
    recording: Recording,
    hammer: Option<&ChannelRef>,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<RecordingResult, PipelineError> {
    let wiring = bare_wiring(&recording, hammer)?;
    let mut settings = MeasureSettings::new(wiring.source());
    adjust(&mut settings);
    let mut result = finish(recording, settings, &wiring)?;
    if hammer.is_none() {
        let forgotten = of_hammer_by_name(&result);
        result.measurement.warnings.extend(forgotten);
    }
    Ok(result)
}

/// The channels of a bare recording, with the names and units that the file gives.
fn bare_wiring(
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
) -> Result<RecordingResult, PipelineError> {
    let wiring = bare_wiring(&recording, hammer)?;
    let source = wiring.source();
    let taps = find_taps(&recording, &source, &TapSettings::default())?;
    let warnings = super::measure::of_recording(&recording, &source, &taps);
    let measurement = Measurement {
        taps,
        spectra: None,
        warnings,
    };
    let settings = MeasureSettings::new(source);
    result(&recording, &settings, &wiring, measurement)
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

/// Measures a recording whose channels are known.
fn finish(
    recording: Recording,
    settings: MeasureSettings,
    wiring: &Wiring,
) -> Result<RecordingResult, PipelineError> {
    let measurement = measure(&recording, &settings)?;
    result(&recording, &settings, wiring, measurement)
}

fn result(
    recording: &Recording,
    settings: &MeasureSettings,
    wiring: &Wiring,
    measurement: Measurement,
) -> Result<RecordingResult, PipelineError> {
    let shown = settings.source.channels().first().copied().unwrap_or(0);
    let spectra = measurement.spectra.as_ref();
    let readings = spectra.map_or(0, |spectra| spectra.readings.len());
    let responses = wiring.responses.iter();
    let responses: Vec<Response> = responses.map(|(_, response)| response.clone()).collect();
    // Without a hammer the unit that all responses have.
    let common_unit = responses.first().and_then(|first| {
        let same = responses.iter().all(|other| other.unit == first.unit);
        first.unit.clone().filter(|_| same)
    });
    Ok(RecordingResult {
        file: recording.name().to_string(),
        format: recording.format(),
        sample_rate: Some(recording.sample_rate()),
        seconds: Some(recording.duration()),
        channels: recording.channels().to_vec(),
        has_hammer: wiring.hammer.is_some(),
        conditions: Conditions::default(),
        tap_unit: match wiring.hammer {
            Some(_) => wiring.hammer_unit.clone(),
            None => common_unit,
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

/// The warning about a channel that is taken for a response, though its name says that it is the hammer's.
fn of_hammer_by_name(recording: &RecordingResult) -> Option<Warning> {
    let mut names = recording.responses.iter().map(|response| &response.name);
    let name = names.find(|name| {
        let name = name.to_lowercase();
        name.contains("hammer") || name.contains("force")
    })?;
    let argument = match name.contains(char::is_whitespace) {
        true => format!("\"{name}\""),
        false => name.clone(),
    };
    let text = format!(
        "channel \"{name}\" is taken for a response, but by its name it may be the hammer's; if so, \
         say --hammer {argument}: taps are then judged by their force, and there are frequency \
         response functions"
    );
    Some(Warning::about(&recording.file, "hammer-channel", text))
}

/// Settings for a file of frequency response functions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FunctionSettings {
    /// Form of all functions; `None` = what the file says.
    pub form: Option<ResponseForm>,
    /// Name of the sensor; `None` = the functions' own names.
    pub sensor: Option<String>,
    /// Band to be analysed (Hz); `None` = all lines.
    pub band: Option<(f64, f64)>,
    /// Way in which natural frequencies are read.
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
fn measure_functions(
    functions: &FrequencyResponses,
    settings: &FunctionSettings,
) -> Result<RecordingResult, PipelineError> {
    let axis = axis(functions, settings.band);
    let (first, lines) = axis.map_err(|problem| MeasureError::Spectral {
        file: functions.file.clone(),
        problem,
    })?;
    let (mut responses, mut forms, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for response in &functions.responses {
        let form = settings.form.or(response.form);
        let sensor = settings.sensor.as_ref();
        responses.push(Response {
            name: sensor.unwrap_or(&response.name).clone(),
            kind: form.map(|form| match form {
                ResponseForm::Accelerance => SensorKind::Acceleration,
                ResponseForm::Mobility => SensorKind::Velocity,
                ResponseForm::Receptance => SensorKind::Displacement,
            }),
            unit: form.map(|form| form.response_unit().to_string()),
        });
        forms.push(form);
        values.push(response.values[first..first + lines.points()].to_vec());
    }
    let spectra = spectra_of_functions(lines, values, &forms, settings.reading);
    let warnings = functions.warnings.iter();
    let warnings = warnings.map(|warning| Warning::about(&functions.file, warning.code(), warning));
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

/// Reads the resonances of functions, each with its form where it is known.
fn spectra_of_functions(
    lines: Lines,
    values: Vec<Vec<Complex64>>,
    forms: &[Option<ResponseForm>],
    wanted: ReadBy,
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
    // The fit takes the functions without the line at 0 Hz.
    let first_fitted = usize::from(lines.low <= 0.0);
    let basis = Basis::FrequencyResponse {
        resolution: lines.resolution(),
    };
    let fitted = values.iter().enumerate().map(|(sensor, values)| Column {
        tap: 0,
        sensor,
        values: values[first_fitted..].to_vec(),
    });
    let frequencies = lines.frequencies().split_off(first_fitted);
    if let Ok(data) = ModalData::new(basis, frequencies, fitted.collect()) {
        let candidates = Candidates {
            lines: &lines,
            data: &data,
            stabilisation: &stabilisation,
        };
        candidates.fit(&mut readings);
        // There are modal constants where the form of every function is known.
        if let Some(forms) = forms.iter().copied().collect::<Option<Vec<ResponseForm>>>() {
            for fit in readings.iter_mut().filter_map(|r| r.fit.as_deref_mut()) {
                fit.constants = modal_constants_of_frf(&fit.mode, &forms);
            }
        }
    }
    for reading in &mut readings {
        reading.select_estimate(wanted);
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

/// Shown before a tap's trigger (s).
const BEFORE: f64 = 2e-3;
/// Shown after it (s): the pulse, and how the response sets out.
const AFTER: f64 = 30e-3;
/// Shown after a second hit (s): its pulse.
const AFTER_SECOND: f64 = 10e-3;

/// The samples about each tap.
fn close_ups(
    recording: &Recording,
    source: &TapSource,
    taps: &Taps,
) -> Result<Vec<CloseUp>, RecordingError> {
    let (force, responses) = match source {
        TapSource::Hammer { channel, responses } => (Some(*channel), responses),
        TapSource::Responses(responses) => (None, responses),
    };
    let rate = recording.sample_rate();
    let mut all = Vec::with_capacity(taps.taps.len());
    for tap in &taps.taps {
        let second = tap.second_hit.map(|second| second.delay + AFTER_SECOND);
        let after = second.map_or(AFTER, |second| second.max(AFTER));
        let first = ((tap.time - BEFORE) * rate).round().max(0.0) as u64;
        let last = ((tap.time + after) * rate).round().max(0.0) as u64;
        let (mut of_force, mut of_response) = (None, None);
        if let Some(channel) = force {
            of_force = Some(samples(recording, channel, first..last)?);
        }
        if let Some(&channel) = responses.first() {
            of_response = Some(samples(recording, channel, first..last)?);
        }
        all.push(CloseUp {
            start: first as f64 / rate - tap.time,
            step: 1.0 / rate,
            force: of_force,
            response: of_response,
        });
    }
    Ok(all)
}

/// Samples of a channel, its mean taken out.
fn samples(
    recording: &Recording,
    channel: usize,
    frames: Range<u64>,
) -> Result<Vec<f64>, RecordingError> {
    let mean = recording.mean(channel);
    let samples = recording.read(channel, frames)?;
    Ok(samples.into_iter().map(|value| value - mean).collect())
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
    fn source(&self) -> TapSource {
        let responses = self.responses.iter().map(|(channel, _)| *channel).collect();
        match self.hammer {
            Some(channel) => TapSource::Hammer { channel, responses },
            None => TapSource::Responses(responses),
        }
    }

    /// Every channel with its unit.
    fn units(&self) -> impl Iterator<Item = (usize, &Option<String>)> {
        let responses = self.responses.iter();
        let responses = responses.map(|(channel, response)| (*channel, &response.unit));
        responses.chain(self.hammer.map(|hammer| (hammer, &self.hammer_unit)))
    }
}

/// Takes a bare recording with known channels as far as it goes: taps, spectra, readings. `adjust` may
/// change the defaults of the measurement.
///
/// # Errors
/// An unreadable recording, a band or block that does not fit.
pub fn run_wired(
    recording: Recording,
    wiring: &Wiring,
    adjust: impl FnOnce(&mut MeasureSettings),
) -> Result<Analysis, PipelineError> {
    let mut settings = MeasureSettings::new(wiring.source());
    adjust(&mut settings);
    let mut result = finish(recording, settings, wiring)?;
    for (channel, unit) in wiring.units() {
        if let Some(info) = result.channels.get_mut(channel) {
            info.unit.clone_from(unit);
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
    use tapjoint_signal::taps::{SecondHit, Tap};

    #[test]
    fn limit_a_close_up_ends_where_the_recording_does() {
        let channel = |from: f64| Channel {
            name: None,
            unit: None,
            samples: (0..100).map(|k| from + f64::from(k)).collect(),
        };
        let channels = vec![channel(0.0), channel(500.0)];
        let recording = Recording::from_samples("taps", 1000.0, channels).expect("samples");
        let hit = |time, second_hit| Tap {
            time,
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
            taps: vec![
                hit(0.001, None),
                hit(0.050, None),
                hit(0.090, None),
                // As far as a second hit, which is why a tap is rejected.
                hit(0.010, Some(far)),
            ],
            noise: 0.0,
            remarks: Vec::new(),
        };
        let source = TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        };
        let all = close_ups(&recording, &source, &taps).expect("samples");
        let forces: Vec<&Vec<f64>> = all.iter().flat_map(|one| &one.force).collect();
        let lengths: Vec<usize> = forces.iter().map(|force| force.len()).collect();
        assert_eq!(lengths, [31, 32, 12, 47]);
        assert!((all[1].start + 0.002).abs() < 1e-12, "{}", all[1].start);
        // Of both channels the same frames, each less its mean.
        assert_eq!(all[1].force, all[1].response);
        assert_eq!(forces[1][0], 48.0 - 49.5);
        let alone = close_ups(&recording, &TapSource::Responses(vec![0]), &taps).expect("samples");
        assert!(alone.iter().all(|one| one.force.is_none()));
        assert_eq!(alone[3].response.as_ref(), Some(forces[3]));
    }
}
