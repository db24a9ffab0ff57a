//! Functions of a universal file that lie on the same points; time series among them as a recording.
//!
//! The channels are the file's time series in their order. They must have been sampled together:
//! the same step, number of points and start. Where some were not (a slow tacho beside vibration,
//! a second run), the largest set that was is the recording, the first of equally large ones, and a
//! warning names each dataset that is left out. Where the file ends early, all channels end with
//! the shortest that has a value at all.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use super::list::{Entry, UniversalFile, describe, list_datasets};
use super::values::{ValueReader, Values};
use super::{Abscissa, Function, FunctionType, MODES_REMEDY, Ordinate, UffCoding};
use crate::recording::error::{
    RecordingError, RecordingWarning, channel_label, check_channel_count, short,
};
use crate::recording::health::{HealthMeter, check_finite, check_rate};
use crate::recording::text::TimeCheck;
use crate::recording::units::label_unit;
use crate::recording::{ChannelInfo, Cursor, Format, ReadSettings, Recording, Source};

/// Points that settle the reference step of an uneven abscissa.
const HEAD_POINTS: usize = 4096;

/// Steps nearer than this, relatively, are the same: headers print them with six digits.
const SAME_STEP: f64 = 2e-6;

/// Samples handled at a time when the file is checked.
const PASS_SAMPLES: u64 = 1 << 16;
/// Samples of text kept in memory, over all channels (128 MB): parsing them again at each reading
/// costs more than everything that is done with them. Beyond, text is parsed again.
const KEPT_SAMPLES: usize = 1 << 24;

/// Opens the time series of a universal file.
pub(in crate::recording) fn open_uff(
    path: &Path,
    file: String,
    settings: &ReadSettings,
) -> Result<Recording, RecordingError> {
    let listed = list_datasets(path)?;
    let mut warnings = Vec::from_iter(listed.cut_header_doubt());
    let unit = AbscissaUnit::Seconds;
    let series = listed.functions().filter(|(_, f)| f.is_time_series());
    let Some(mut group) = FunctionGroup::largest(&listed, series, unit)? else {
        let responses = listed
            .functions()
            .any(|(_, f)| f.function_type == FunctionType::FREQUENCY_RESPONSE);
        return Err(RecordingError::NoTimeSeries {
            file,
            found: listed.contents(),
            remedy: match responses {
                true => {
                    "its frequency response functions are read in a test description: give the file's [[recording]] form = \"accelerance\" (or \"mobility\", \"receptance\"), or without one by `tapjoint run FILE` and `tapjoint spectrum FILE`"
                }
                false => "export the time series of hammer and sensors",
            },
        });
    };
    check_channel_count(&file, group.functions.len())?;
    group
        .left_out
        .sort_by_key(|((dataset, _), _)| dataset.number);
    for (entry, reason) in group.left_out {
        warnings.push(left_out(entry, &reason, unit));
    }
    let sample_rate = 1.0 / group.points.step;
    check_rate(&file, sample_rate)?;
    warnings.extend(settings.ignored_rate(sample_rate));
    let mut measured = Vec::with_capacity(group.functions.len());
    let mut room = KEPT_SAMPLES;
    for (at, entry) in group.functions.into_iter().enumerate() {
        let values = Values::new(&listed, entry)?;
        let channel = Measured::read(sample_rate, at, values, u64::MAX, &mut room)?;
        if channel.count == 0 {
            let reason = "the file ends before its first value";
            warnings.push(left_out(entry, reason, unit));
        } else {
            measured.push(channel);
        }
    }
    let Some(frames) = measured.iter().map(|channel| channel.count).min() else {
        return Err(RecordingError::no_samples(&file));
    };
    warnings.extend(RecordingWarning::truncated(frames, group.points.points));
    let (mut channels, mut values) = (Vec::new(), Vec::new());
    let names = channel_names(&measured);
    for ((at, mut channel), name) in measured.into_iter().enumerate().zip(names) {
        // What is beyond the shortest channel is no part of the recording's health either.
        if channel.count > frames {
            channel = Measured::read(sample_rate, at, channel.values, frames, &mut 0)?;
        }
        let (info, own) = channel.info(&listed, at + 1, name, &mut warnings);
        channels.push(info);
        values.push(own);
    }
    warnings.extend(repeated_place(&values, &channels));
    Ok(Recording {
        name: file,
        format: Format::Uff58 {
            coding: values[0].function.coding,
        },
        sample_rate,
        frames,
        channels,
        warnings,
        source: Arc::new(UffSource { values, frames }),
        parts: Vec::new(),
    })
}

/// Returns the names of the channels.
///
/// Candidates are entity name, degree of freedom, axis label and description, in this order. The first that differs
/// from channel to channel is taken for all of them. Where none does, each channel takes its own first candidate.
fn channel_names(channels: &[Measured]) -> Vec<Option<String>> {
    let functions = channels.iter().map(|channel| &channel.values.function);
    let names: Vec<[Option<String>; 4]> = functions
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

/// Finds the first channel that claims the place and the quantity of an earlier one: several runs in one file.
fn repeated_place(values: &[Values], channels: &[ChannelInfo]) -> Option<RecordingWarning> {
    for (at, Values { function, .. }) in values.iter().enumerate() {
        let place = &function.response;
        let mut before = values[..at].iter().map(|values| &values.function);
        let earlier = before.position(|other| {
            other.response == *place && other.numerator.quantity == function.numerator.quantity
        });
        if let Some(earlier) = earlier.filter(|_| place.node != 0) {
            let [channel, earlier] =
                [at, earlier].map(|at| channel_label(at + 1, channels[at].name.as_deref()));
            let message = format!(
                "{channel} has the same place and quantity ({place}) as {earlier}; the file probably holds several runs, which are not simultaneous; use channels of one run"
            );
            return Some(RecordingWarning::new("repeated-place", message));
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
        sample_rate: f64,
        channel: usize,
        mut values: Values,
        frames: u64,
        room: &mut usize,
    ) -> Result<Self, RecordingError> {
        let mut meter = HealthMeter::new(None);
        let is_text = values.function.coding == UffCoding::Ascii;
        let mut kept = is_text.then(Vec::new);
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
            check_finite(&values.file, sample_rate, channel, at, &samples)?;
            meter.add(&samples);
            kept = kept.filter(|kept: &Vec<f64>| kept.len() + samples.len() <= *room);
            if let Some(kept) = &mut kept {
                kept.extend_from_slice(&samples);
            }
        }
        let count = reader.at;
        values.checkpoints = places;
        if let Some(kept) = kept {
            *room -= kept.len();
            values.kept = Some(kept);
        }
        Ok(Self {
            values,
            count,
            meter,
        })
    }

    /// Describes a channel (1-based), its values in SI where its unit is known, and adds the doubts about its unit.
    ///
    /// The unit is the label's, else that of the file's unit system.
    fn info(
        self,
        file: &UniversalFile,
        number: usize,
        name: Option<String>,
        warnings: &mut Vec<RecordingWarning>,
    ) -> (ChannelInfo, Values) {
        let function = &self.values.function;
        let axis = &function.numerator;
        // Rotations have other exponents, and no sensor here measures them.
        let system = file.units.filter(|_| !function.response.is_rotational());
        let by_system = system.and_then(|system| system.si(axis.quantity));
        let by_label = axis.unit.as_deref().and_then(label_unit);
        let (scale, unit) = match (&axis.unit, by_label, by_system) {
            (Some(label), None, _) => {
                warnings.push(RecordingWarning::unknown_unit(
                    number,
                    name.as_deref(),
                    label,
                ));
                (1.0, Some(label.clone()))
            }
            (Some(label), Some((used, unit)), by_system) => {
                // Beyond rounding of printed factors two factors are two units.
                if let Some((by_system, _)) = by_system
                    && (used / by_system - 1.0).abs() > 1e-4
                {
                    let problem = format!(
                        "the label says \"{label}\" (times {used} to SI), the file's unit system means times {by_system}; the label is used; check the level, or give a scale"
                    );
                    let (code, name) = ("units-disagree", name.as_deref());
                    warnings.push(RecordingWarning::of_channel(code, number, name, problem));
                }
                (used, Some(unit.to_owned()))
            }
            (None, _, Some((factor, unit))) => (factor, Some(unit.to_owned())),
            (None, _, None) => (1.0, None),
        };
        let info = ChannelInfo {
            name,
            unit,
            header_unit: axis.unit.clone(),
            scale,
            health: self.meter.finish().scaled(scale),
        };
        (info, self.values)
    }
}

/// The time series of a universal file that are channels.
#[derive(Debug)]
struct UffSource {
    values: Vec<Values>,
    frames: u64,
}

impl Source for UffSource {
    fn cursor(&self, frame: u64) -> Result<Box<dyn Cursor + '_>, RecordingError> {
        Ok(Box::new(UffCursor {
            source: self,
            file: None,
            readers: Vec::new(),
            at: frame.min(self.frames),
        }))
    }
}

/// A reader somewhere in the samples. Channels lie one behind the other in the file, so that each
/// has a place of its own.
#[derive(Debug)]
struct UffCursor<'a> {
    source: &'a UffSource,
    file: Option<File>,
    /// Readers of the channels that were read last.
    readers: Vec<(usize, ValueReader<'a>)>,
    at: u64,
}

impl Cursor for UffCursor<'_> {
    fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let end = self.at + limit.min(self.source.frames - self.at);
        for (channel, samples) in channels.iter().zip(into.iter_mut()) {
            let values = &self.source.values[*channel];
            if let Some(kept) = &values.kept {
                samples.extend_from_slice(&kept[self.at as usize..end as usize]);
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
                    return Err(RecordingError::changed(&values.file, reader.at));
                }
            }
            self.readers.push((*channel, reader));
        }
        self.at = end;
        Ok(())
    }
}

// ---- Points along time or frequency.

/// Evenly spaced points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::recording) struct EvenPoints {
    /// First abscissa (s or Hz).
    pub start: f64,
    /// Distance (s or Hz).
    pub step: f64,
    /// Number that the header promises.
    pub points: u64,
}

impl EvenPoints {
    /// Returns `true` where values on these and on other points belong together: equal in number and distance,
    /// beginning within half a step, as channels of one converter do.
    pub(in crate::recording) fn matches(&self, other: &Self) -> bool {
        let step = (self.step / other.step - 1.0).abs() <= SAME_STEP;
        step && self.points == other.points && (self.start - other.start).abs() <= 0.5 * self.step
    }
}

/// Unit that an abscissa has inside this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::recording) enum AbscissaUnit {
    /// Unit of time series.
    Seconds,
    /// Unit of frequency responses.
    Hertz,
}

impl AbscissaUnit {
    fn name(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Hertz => "Hz",
        }
    }

    /// Factor from the axis's unit; 1 where it has none that is known.
    fn factor(self, function: &Function) -> f64 {
        let Some(label) = &function.abscissa_axis.unit else {
            return 1.0;
        };
        let plain = label.trim_matches(['(', ')', '[', ']', ' ']);
        match self {
            Self::Seconds => [plain.to_owned(), plain.to_ascii_lowercase()]
                .iter()
                .find_map(|text| label_unit(text).filter(|(_, si)| *si == "s"))
                .map_or(1.0, |(factor, _)| factor),
            Self::Hertz if plain.eq_ignore_ascii_case("kHz") => 1e3,
            // 2 pi rad are one cycle.
            Self::Hertz if plain.eq_ignore_ascii_case("rad/s") => 0.5 / std::f64::consts::PI,
            Self::Hertz => 1.0,
        }
    }
}

/// The doubt about a function that is not used with the others.
pub(in crate::recording) fn left_out(
    entry: Entry<'_>,
    reason: &str,
    unit: AbscissaUnit,
) -> RecordingWarning {
    let (dataset, function) = entry;
    let of_channels = match unit {
        AbscissaUnit::Seconds => {
            "; channels of a recording are sampled together, and their numbers count those kept"
        }
        AbscissaUnit::Hertz => "",
    };
    let message = format!(
        "dataset {} ({}) is left out: {reason}{of_channels}; export it to a file of its own if it is needed",
        dataset.number,
        describe(function)
    );
    RecordingWarning::new("dataset-left-out", message)
}

/// Functions on the same points, one at least, and the others with the reason why they are left out.
pub(in crate::recording) struct FunctionGroup<'a> {
    pub functions: Vec<Entry<'a>>,
    pub points: EvenPoints,
    /// First those that cannot be used, then those on other points.
    pub left_out: Vec<(Entry<'a>, String)>,
}

impl<'a> FunctionGroup<'a> {
    /// Finds the largest set of functions on the same points, the first of several equally large ones; `None` without
    /// candidates. None that can be used is an error.
    pub(in crate::recording) fn largest(
        file: &UniversalFile,
        candidates: impl Iterator<Item = Entry<'a>>,
        unit: AbscissaUnit,
    ) -> Result<Option<Self>, RecordingError> {
        let (mut usable, mut left_out) = (Vec::new(), Vec::new());
        for entry in candidates {
            // Time series are real, frequency responses complex.
            let points = match (unit, entry.1.ordinate) {
                (AbscissaUnit::Seconds, Ordinate::Complex) => {
                    Err("its values are complex".to_owned())
                }
                (AbscissaUnit::Hertz, Ordinate::Real) => {
                    Err("its values are real and say nothing of the phase".to_owned())
                }
                _ => even_points(file, entry, unit)?,
            };
            match points {
                Ok(points) => usable.push((entry, points)),
                Err(problem) => left_out.push((entry, problem)),
            }
        }
        let largest = usable.iter().rev().max_by_key(|(_, points)| {
            let same = usable.iter().filter(|(_, other)| points.matches(other));
            same.count()
        });
        let Some(((first, _), points)) = largest.copied() else {
            let problem = if let Some(((dataset, function), problem)) = left_out.first() {
                let remedy = match unit {
                    AbscissaUnit::Seconds => "export real values at an even step",
                    AbscissaUnit::Hertz => "export complex values on evenly spaced lines",
                };
                let name = describe(function);
                format!("dataset {} ({name}): {problem}; {remedy}", dataset.number)
            } else if file.functions().next().is_none() {
                let remedy = match file.has_data_at_nodes() {
                    true => MODES_REMEDY,
                    false => "export the time series or frequency response functions",
                };
                format!(
                    "holds no function (dataset 58), only {}; allowed: dataset 58 or 58b; {remedy}",
                    file.contents()
                )
            } else {
                return Ok(None);
            };
            return Err(RecordingError::new(&file.name, problem));
        };
        let mut functions = Vec::new();
        for (entry, own) in usable {
            if points.matches(&own) {
                functions.push(entry);
                continue;
            }
            let [own, chosen] = [own, points].map(
                |EvenPoints {
                     start,
                     step,
                     points,
                 }| {
                    let start = short(start);
                    match unit {
                        AbscissaUnit::Seconds => {
                            format!("{points} points at {} Hz from {start} s", short(1.0 / step))
                        }
                        AbscissaUnit::Hertz => {
                            format!("{points} lines from {start} Hz, {} Hz apart", short(step))
                        }
                    }
                },
            );
            let reason = format!("{own}, where dataset {} has {chosen}", first.number);
            left_out.push((entry, reason));
        }
        Ok(Some(Self {
            functions,
            points,
            left_out,
        }))
    }
}

/// Settles where the points of a function lie. A stored abscissa is read and must be even.
///
/// The inner `Err` holds the reason why the points are not known.
///
/// The header prints the step with six digits. Where a simpler number lies within that rounding, it
/// is used: for time a whole sample rate, for frequency a whole number of 2^-12 Hz.
pub(in crate::recording) fn even_points(
    file: &UniversalFile,
    entry: Entry<'_>,
    unit: AbscissaUnit,
) -> Result<Result<EvenPoints, String>, RecordingError> {
    let function = entry.1;
    let factor = unit.factor(function);
    let (start, step) = match function.abscissa {
        Abscissa::Even {
            start,
            step,
            step_digit,
        } => {
            let (step, digit) = (step * factor, step_digit * factor);
            let simple = match unit {
                AbscissaUnit::Seconds => {
                    let whole = (1.0 / step).round();
                    // A digit, and not half of one: some writers cut off instead of rounding.
                    let near = (1.0 / whole - step).abs() <= digit * (1.0 + 1e-9);
                    (near && digit <= 1e-4 * step).then_some(1.0 / whole)
                }
                AbscissaUnit::Hertz => {
                    // The coarsest multiple of a power of 1/2 that was printed as `step`, where all six digits show
                    // that it was rounded. Sample rate over a block of 2^n samples is such a number.
                    let rounded =
                        digit <= 1e-4 * step && (step / digit / 10.0).fract().abs() >= 1e-6;
                    let scales = (0..=12).map(|power| 2_f64.powi(power));
                    let mut multiples = scales.map(|scale| (step * scale).round() / scale);
                    multiples.find(|multiple| {
                        let near = (multiple - step).abs() <= 0.5 * digit * (1.0 + 1e-6);
                        rounded && near && *multiple > 0.0
                    })
                }
            };
            (start * factor, simple.unwrap_or(step))
        }
        Abscissa::Uneven => match stored_abscissa(file, entry, unit)? {
            Some((start, step)) => (start * factor, step * factor),
            None => return Ok(Err("it has fewer than two points and no step".to_owned())),
        },
    };
    if !(step > 0.0 && step.is_finite() && start.is_finite()) {
        return Ok(Err(format!("its step is {step} {}", unit.name())));
    }
    Ok(Ok(EvenPoints {
        start,
        step,
        points: function.points,
    }))
}

/// Returns start and step of an abscissa that is stored with every point (file units); `None` for fewer than two points.
fn stored_abscissa(
    file: &UniversalFile,
    entry: Entry<'_>,
    unit: AbscissaUnit,
) -> Result<Option<(f64, f64)>, RecordingError> {
    let values = Values::new(file, entry)?;
    let mut opened = values.open()?;
    let mut reader = values.reader(0, &mut opened)?;
    let mut check: Option<TimeCheck> = None;
    let mut point = 0;
    loop {
        // The reference step is taken from a full head.
        let mut abscissas: Vec<(f64, String)> = Vec::new();
        while abscissas.len() < HEAD_POINTS {
            let missing = (HEAD_POINTS - abscissas.len()) as u64;
            let points = reader.next(&mut opened, missing)?;
            if points.is_empty() {
                break;
            }
            for x in points
                .iter()
                .step_by(values.function.numbers_per_point())
                .copied()
            {
                // As it may have been printed: with the digits of single precision, which is what the format gives
                // it, text or binary.
                let single = x as f32;
                abscissas.push(match f64::from(single) == x {
                    true => (x, format!("{single:e}")),
                    false => (x, format!("{x:e}")),
                });
            }
        }
        if abscissas.is_empty() {
            let rate = check.and_then(|check| Some((check.first, check.sample_rate(1.0)?.1)));
            return Ok(rate.map(|(start, used)| (start, 1.0 / used)));
        }
        let cells = abscissas.iter().map(|(x, cell)| (*x, cell.as_bytes()));
        let check = check.get_or_insert_with(|| TimeCheck::new(cells.clone()));
        for (x, cell) in cells {
            point += 1;
            check.add(x, cell, point).map_err(|uneven| {
                let words = uneven.words(unit.factor(entry.1), unit.name(), "point");
                let problem = format!(
                    "dataset {}, point {}: uneven spacing: {words}; allowed: 0.1 % of the step, or what rounding of the printed value explains; export with even spacing",
                    entry.0.number, uneven.line
                );
                RecordingError::new(&file.name, problem)
            })?;
        }
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
        let entry = listed.functions().next().unwrap();
        let values = Values::new(&listed, entry).unwrap();
        let measured = Measured::read(1000.0, 0, values, u64::MAX, &mut 0).unwrap();
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
            let mut cursor = source.cursor(start as u64).unwrap();
            let mut read = [Vec::new()];
            // Twice, so that the second goes on where the first ended.
            cursor.read(&[0], 7, &mut read).unwrap();
            cursor.read(&[0], 9000, &mut read).unwrap();
            let end = samples.len().min(start + 9007);
            assert_eq!(read[0], samples[start..end], "from {start}");
        }
    }
}
