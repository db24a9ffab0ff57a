//! Time series of a universal file as a recording.
//!
//! The channels are the file's time series in their order. They must have been sampled together:
//! the same step, number of points and start. Where some were not (a slow tacho beside vibration,
//! a second run), the largest set that was is the recording, the first of equally large ones, and a
//! warning names each dataset that is left out. Where the file ends early, all channels end with
//! the shortest that has a value at all.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use super::abscissa::{AbscissaUnit, FunctionGroup};
use super::list::{Dataset, Entry, UniversalFile, describe, list_datasets};
use super::values::{ValueReader, Values};
use super::{Function, FunctionType, UffCoding, UnitSystem};
use crate::recording::error::{RecordingError, UffError};
use crate::recording::health::{HealthMeter, check_finite, check_rate};
use crate::recording::units::label_unit;
use crate::recording::warning::{ChannelLabel, RecordingWarning};
use crate::recording::{ChannelInfo, Format, MAX_CHANNELS, ReadSettings, Recording, Source};

/// Samples handled at a time when the file is checked.
const PASS_SAMPLES: u64 = 1 << 16;
/// Samples of text kept in memory, over all channels (128 MB): parsing them again at each reading
/// costs more than everything that is done with them. Beyond, text is parsed again.
pub(super) const KEPT_SAMPLES: usize = 1 << 24;

/// Opens the time series of a universal file.
pub(in crate::recording) fn open_uff(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let listed = list_datasets(path)?;
    let mut warnings = Vec::new();
    if let Some(dataset) = listed.cut_header {
        warnings.push(RecordingWarning::HeaderCut { dataset });
    }
    let series = listed.functions().filter(|(_, f)| f.is_time_series());
    let mut group = FunctionGroup::largest(&listed, series, AbscissaUnit::Seconds)?;
    let Some(points) = group.points else {
        return Err(no_time_series(&listed, group.left_out.first()).into());
    };
    if group.functions.len() > MAX_CHANNELS {
        return Err(RecordingError::TooManyChannels {
            file,
            channels: group.functions.len(),
            limit: MAX_CHANNELS,
        });
    }
    group
        .left_out
        .sort_by_key(|((dataset, _), _)| dataset.number);
    for ((dataset, function), reason) in group.left_out {
        warnings.push(left_out(dataset, function, reason));
    }
    let sample_rate = 1.0 / points.step;
    check_rate(&file, sample_rate)?;
    warnings.extend(settings.ignored_rate(sample_rate));
    let mut functions = Vec::with_capacity(group.functions.len());
    let mut measured = Vec::with_capacity(group.functions.len());
    let mut room = KEPT_SAMPLES;
    for (at, (dataset, function)) in group.functions.into_iter().enumerate() {
        let values = Values::new(&listed, dataset, function)?;
        let channel = Measured::read(&file, sample_rate, at, values, u64::MAX, &mut room)?;
        if channel.count == 0 {
            let reason = "the file ends before its first value".to_owned();
            warnings.push(left_out(dataset, function, reason));
        } else {
            functions.push(function);
            measured.push(channel);
        }
    }
    let Some(frames) = measured.iter().map(|channel| channel.count).min() else {
        return Err(RecordingError::NoSamples { file });
    };
    if frames < points.points {
        warnings.push(RecordingWarning::Truncated {
            present: frames,
            promised: points.points,
        });
    }
    let names = channel_names(&functions);
    let (mut channels, mut values) = (Vec::new(), Vec::new());
    for (at, (mut channel, name)) in measured.into_iter().zip(names).enumerate() {
        // What is beyond the shortest channel is no part of the recording's health either.
        if channel.count > frames {
            channel = Measured::read(&file, sample_rate, at, channel.values, frames, &mut 0)?;
        }
        let number = at + 1;
        let label = ChannelLabel { number, name };
        let function = functions[at];
        let info = channel_info(listed.units, label, function, channel.meter, &mut warnings);
        channels.push(info);
        values.push(channel.values);
    }
    warnings.extend(repeated_place(&functions, &channels));
    let coding = functions.first().map(|function| function.coding);
    Ok(Recording {
        name: file,
        path: Some(path.to_owned()),
        format: Format::Uff58 {
            coding: coding.unwrap_or(UffCoding::Ascii),
        },
        sample_rate,
        frames,
        channels,
        warnings,
        source: Source::Uff(Box::new(UffSource { values, frames })),
    })
}

fn left_out(dataset: &Dataset, function: &Function, reason: String) -> RecordingWarning {
    RecordingWarning::DatasetLeftOut {
        dataset: dataset.number,
        name: describe(function),
        reason,
    }
}

/// Returns why there is no time series, and what to do.
fn no_time_series(file: &UniversalFile, unusable: Option<&(Entry<'_>, String)>) -> UffError {
    let name = file.name.clone();
    if let Some(((dataset, function), problem)) = unusable {
        return UffError::BadTimeSeries {
            file: name,
            dataset: dataset.number,
            name: describe(function),
            problem: problem.clone(),
            remedy: "export real values at an even step",
        };
    }
    let found = file.contents();
    if file.functions().next().is_none() {
        return UffError::NoFunctions { file: name, found };
    }
    let responses = file
        .functions()
        .any(|(_, f)| f.function_type == FunctionType::FREQUENCY_RESPONSE);
    let remedy = match responses {
        true => {
            "its frequency response functions are read in a test description: give the file's [[recording]] form = \"accelerance\" (or \"mobility\", \"receptance\"), or without one by `tapjoint run FILE` and `tapjoint spectrum FILE`"
        }
        false => "export the time series of hammer and sensors",
    };
    UffError::NoTimeSeries {
        file: name,
        found,
        remedy,
    }
}

/// Returns the names of the channels: the first of entity name, degree of freedom, axis label and description
/// that every channel has and that tells all of them apart; else whatever a channel has.
fn channel_names(channels: &[&Function]) -> Vec<Option<String>> {
    let names: Vec<[Option<String>; 4]> = channels
        .iter()
        .map(|function| {
            [
                function.response.name.clone(),
                function.response.degree_of_freedom(),
                function.numerator.label.clone(),
                function.id_lines[0].clone(),
            ]
        })
        .collect();
    for kind in 0..4 {
        let of_kind: Vec<Option<String>> = names.iter().map(|of| of[kind].clone()).collect();
        let mut different: Vec<&String> = of_kind.iter().flatten().collect();
        different.sort();
        different.dedup();
        if different.len() == channels.len() {
            return of_kind;
        }
    }
    names
        .into_iter()
        .map(|of| of.into_iter().flatten().next())
        .collect()
}

/// Describes a channel, its values in SI where its unit is known, and adds the doubts about its unit.
///
/// The unit is the label's, else that of the file's unit system.
fn channel_info(
    system: Option<UnitSystem>,
    channel: ChannelLabel,
    function: &Function,
    meter: HealthMeter,
    warnings: &mut Vec<RecordingWarning>,
) -> ChannelInfo {
    let axis = &function.numerator;
    // Rotations have other exponents, and no sensor here measures them.
    let system = system.filter(|_| !function.response.is_rotational());
    let by_system = system.and_then(|system| system.si(axis.quantity));
    let by_label = axis.unit.as_deref().and_then(label_unit);
    let name = channel.name.clone();
    let (factor, unit) = match (&axis.unit, by_label.or(by_system)) {
        (Some(label), _) if by_label.is_none() => (1.0, Some(label.clone())),
        (_, Some((factor, unit))) => (factor, Some(unit.to_owned())),
        (_, None) => (1.0, None),
    };
    match (&axis.unit, by_label, by_system) {
        (Some(label), None, _) => warnings.push(RecordingWarning::UnknownUnit {
            channel,
            unit: label.clone(),
        }),
        // Beyond rounding of printed factors two factors are two units.
        (Some(label), Some((used, _)), Some((by_system, _)))
            if (used / by_system - 1.0).abs() > 1e-4 =>
        {
            warnings.push(RecordingWarning::UnitsDisagree {
                channel,
                unit: label.clone(),
                used,
                by_system,
            });
        }
        _ => {}
    }
    ChannelInfo {
        name,
        unit,
        header_unit: axis.unit.clone(),
        scale: factor,
        health: meter.finish().scaled(factor),
    }
}

/// Finds the first channel that claims the place and the quantity of an earlier one: several runs in one file.
fn repeated_place(functions: &[&Function], channels: &[ChannelInfo]) -> Option<RecordingWarning> {
    for (at, function) in functions.iter().enumerate() {
        let place = &function.response;
        let earlier = functions.iter().take(at).position(|other| {
            other.response == *place && other.numerator.quantity == function.numerator.quantity
        });
        if let Some(earlier) = earlier.filter(|_| place.node != 0) {
            let [channel, earlier] = [at, earlier].map(|at| ChannelLabel {
                number: at + 1,
                name: channels.get(at).and_then(|info| info.name.clone()),
            });
            return Some(RecordingWarning::RepeatedPlace {
                channel,
                earlier,
                place: place.to_string(),
            });
        }
    }
    None
}

/// A time series that has been read once.
#[derive(Debug)]
struct Measured {
    values: Values,
    /// Samples that are there.
    count: u64,
    meter: HealthMeter,
}

impl Measured {
    /// Reads a channel (0-based) up to so many samples: checks them, gathers their health, and remembers where text
    /// can be read from. Text is kept where `room` (samples) has room for it.
    fn read(
        name: &str,
        sample_rate: f64,
        channel: usize,
        mut values: Values,
        frames: u64,
        room: &mut usize,
    ) -> Result<Self, RecordingError> {
        let mut meter = HealthMeter::new(None);
        let mut kept = values.is_text().then(Vec::new);
        let mut file = values.open()?;
        let mut reader = values.reader(0, &mut file)?;
        let mut places = vec![reader.block];
        let mut samples = Vec::new();
        while reader.at < frames {
            let at = reader.at;
            samples.clear();
            let wanted = PASS_SAMPLES.min(frames - at);
            if reader.next_ordinates(&mut file, wanted, &mut samples)? == 0 {
                break;
            }
            if places.last() != Some(&reader.block) {
                places.push(reader.block);
            }
            check_finite(name, sample_rate, channel, at, &samples)?;
            meter.add(&samples);
            kept = kept.filter(|kept: &Vec<f64>| kept.len() + samples.len() <= *room);
            if let Some(kept) = &mut kept {
                kept.extend_from_slice(&samples);
            }
        }
        let count = reader.at;
        values.checkpoints = Arc::new(places);
        if let Some(kept) = kept {
            *room -= kept.len();
            values.kept = Some(Arc::new(kept));
        }
        Ok(Self {
            values,
            count,
            meter,
        })
    }
}

/// The time series of a universal file that are channels.
#[derive(Debug, Clone)]
pub(in crate::recording) struct UffSource {
    values: Vec<Values>,
    frames: u64,
}

impl UffSource {
    /// Positions a reader at `frame`.
    pub(in crate::recording) fn cursor(&self, frame: u64) -> UffCursor<'_> {
        UffCursor {
            source: self,
            file: None,
            readers: Vec::new(),
            at: frame.min(self.frames),
        }
    }
}

/// A reader somewhere in the samples. Channels lie one behind the other in the file, so that each
/// has a place of its own.
#[derive(Debug)]
pub(in crate::recording) struct UffCursor<'a> {
    source: &'a UffSource,
    file: Option<File>,
    /// Readers of the channels that were read last.
    readers: Vec<(usize, ValueReader<'a>)>,
    at: u64,
}

impl UffCursor<'_> {
    /// Appends up to `limit` samples of the wanted channels to `into`; fewer only at the end.
    pub(in crate::recording) fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let end = self.at + limit.min(self.source.frames - self.at);
        for (channel, samples) in channels.iter().zip(into.iter_mut()) {
            let Some(values) = self.source.values.get(*channel) else {
                continue;
            };
            if let Some(kept) = &values.kept {
                let [from, to] = [self.at, end].map(|at| usize::try_from(at).unwrap_or(usize::MAX));
                samples.extend_from_slice(kept.get(from..to).unwrap_or_default());
                continue;
            }
            let file = match &mut self.file {
                Some(file) => file,
                none => none.insert(values.open()?),
            };
            let known = self.readers.iter().position(|(of, _)| of == channel);
            let mut reader = match known.map(|at| self.readers.swap_remove(at).1) {
                Some(reader) if reader.at == self.at => reader,
                _ => values.reader(self.at, file)?,
            };
            while reader.at < end {
                if reader.next_ordinates(file, end - reader.at, samples)? == 0 {
                    return Err(RecordingError::Changed {
                        file: values.file.clone(),
                        frame: reader.at,
                    });
                }
            }
            self.readers.push((*channel, reader));
        }
        self.at = end;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::list_datasets;

    /// A file with one time series of six digits, 13 characters each, six a line.
    fn text(samples: &[f64]) -> String {
        let axis = |kind: u32| format!("{kind:10}    0    0    0 NONE                 NONE\n");
        let point = format!(" NONE      {:10}{:4}", 1, 3);
        let mut text = format!(
            "    -1\n    58\nNONE\nNONE\nNONE\nNONE\nNONE\n    1{:10}{:5}{:10}{point}{point}\n{:10}{:10}{:10}  0.00000E+00  1.00000E-03  0.00000E+00\n",
            0,
            0,
            0,
            2,
            samples.len(),
            1
        );
        text += &[axis(17), axis(12), axis(0), axis(0)].concat();
        for row in samples.chunks(6) {
            text.extend(row.iter().map(|x| format!("{:>13}", format!("{x:.5e}"))));
            text.push('\n');
        }
        text + "    -1\n"
    }

    #[test]
    fn regress_text_that_is_not_kept_is_read_from_remembered_places() {
        let samples: Vec<f64> = (0..50_000).map(|n| f64::from(n * 7 % 1999)).collect();
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text(&samples)).unwrap();
        let listed = list_datasets(file.path()).unwrap();
        let (dataset, function) = listed.functions().next().unwrap();
        let values = Values::new(&listed, dataset, function).unwrap();
        let measured = Measured::read("file", 1000.0, 0, values, u64::MAX, &mut 0).unwrap();
        let (values, count) = (measured.values, measured.count);
        assert_eq!(count, 50_000);
        // 660 kB of text in blocks of 64 kB.
        assert_eq!(
            (values.kept.is_some(), values.checkpoints.len()),
            (false, 11)
        );
        let source = UffSource {
            values: vec![values],
            frames: count,
        };
        for start in [0, 1, 4999, 5041, 25_000, 49_990, 49_999, 50_000] {
            let mut cursor = source.cursor(start as u64);
            let mut read = [Vec::new()];
            // Twice, so that the second goes on where the first ended.
            cursor.read(&[0], 7, &mut read).unwrap();
            cursor.read(&[0], 9000, &mut read).unwrap();
            let end = samples.len().min(start + 9007);
            assert_eq!(read[0], samples[start..end], "from {start}");
        }
    }
}
