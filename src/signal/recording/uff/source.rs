//! Samples of time series, block by block.

use std::fs::File;
use std::sync::Arc;

use super::values::{Checkpoint, ValueReader, Values};
use crate::recording::RecordingError;
use crate::recording::health::HealthMeter;
use crate::recording::open::check_finite;

/// Samples handled at a time when the file is checked.
const PASS_SAMPLES: u64 = 1 << 16;

/// Samples of text kept in memory, over all channels (128 MB): parsing them again at each reading
/// costs more than everything that is done with them. Beyond, text is parsed again.
pub(super) const KEPT_SAMPLES: usize = 1 << 24;

/// The time series of a universal file that are channels.
#[derive(Debug, Clone)]
pub(in crate::recording) struct UffSource {
    pub(super) values: Vec<Values>,
    pub frames: u64,
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
    readers: Vec<(usize, SampleReader<'a>)>,
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
        let count = limit.min(self.source.frames - self.at);
        for (channel, samples) in channels.iter().zip(into.iter_mut()) {
            let Some(values) = self.source.values.get(*channel) else {
                continue;
            };
            if let Some(kept) = &values.kept {
                let place = |at: u64| usize::try_from(at).unwrap_or(usize::MAX);
                let part = kept.get(place(self.at)..place(self.at + count));
                samples.extend_from_slice(part.unwrap_or_default());
                continue;
            }
            let file = match &mut self.file {
                Some(file) => file,
                none => none.insert(values.open()?),
            };
            let known = self.readers.iter().position(|(of, _)| of == channel);
            let mut reader = match known.map(|at| self.readers.swap_remove(at).1) {
                Some(reader) if reader.at == self.at => reader,
                _ => SampleReader::new(values, self.at, file)?,
            };
            let before = samples.len();
            while reader.at < self.at + count {
                if reader.next(file, self.at + count - reader.at, samples)? == 0 {
                    return Err(RecordingError::Changed {
                        file: values.file.clone(),
                        frame: self.at + (samples.len() - before) as u64,
                    });
                }
            }
            self.readers.push((*channel, reader));
        }
        self.at += count;
        Ok(())
    }
}

/// Ordinates of one time series.
#[derive(Debug)]
struct SampleReader<'a> {
    reader: ValueReader<'a>,
    numbers: usize,
    ordinate: usize,
    /// Numbers of a point that is not complete.
    rest: Vec<f64>,
    /// Samples handed out since the first of the dataset.
    at: u64,
}

impl<'a> SampleReader<'a> {
    fn new(values: &'a Values, sample: u64, file: &mut File) -> Result<Self, RecordingError> {
        Ok(Self {
            reader: values.reader(sample, file)?,
            numbers: values.numbers,
            ordinate: values.ordinate,
            rest: Vec::new(),
            at: sample,
        })
    }

    /// Appends up to `limit` samples; how many is the result, 0 at the end.
    fn next(
        &mut self,
        file: &mut File,
        limit: u64,
        into: &mut Vec<f64>,
    ) -> Result<u64, RecordingError> {
        let samples = if self.numbers == 1 {
            self.reader.next(file, limit, into)?
        } else {
            self.next_of_points(file, limit, into)?
        };
        self.at += samples;
        Ok(samples)
    }

    fn next_of_points(
        &mut self,
        file: &mut File,
        limit: u64,
        into: &mut Vec<f64>,
    ) -> Result<u64, RecordingError> {
        let wanted = limit.saturating_mul(self.numbers as u64);
        loop {
            let missing = wanted.saturating_sub(self.rest.len() as u64);
            let got = self.reader.next(file, missing, &mut self.rest)?;
            let points = self.rest.chunks_exact(self.numbers);
            let (count, left) = (points.len(), points.remainder().len());
            into.extend(points.filter_map(|point| point.get(self.ordinate)));
            let done = self.rest.len() - left;
            self.rest.drain(..done);
            if count > 0 || got == 0 {
                return Ok(count as u64);
            }
        }
    }
}

/// A time series that has been read once.
#[derive(Debug)]
pub(super) struct Measured<T> {
    /// What the caller knows it by.
    pub series: T,
    pub values: Values,
    /// Samples that are there.
    pub count: u64,
    pub meter: HealthMeter,
}

/// Cuts all channels to the shortest and returns its length: what is beyond it is no part of the
/// recording's health either.
pub(super) fn cut_to_shortest<T>(
    file: &str,
    sample_rate: f64,
    channels: &mut [Measured<T>],
) -> Result<u64, RecordingError> {
    let frames = channels.iter().map(|channel| channel.count).min();
    let frames = frames.unwrap_or(0);
    for (at, channel) in channels.iter_mut().enumerate() {
        if channel.count > frames {
            let values = &mut channel.values;
            (channel.count, channel.meter) = pass(file, sample_rate, (at, values), frames, &mut 0)?;
        }
    }
    Ok(frames)
}

/// Reads up to `frames` samples once: checks them, gathers their health, and remembers where text
/// can be read from. Text is kept where `room` (samples) has room for it. How many samples there are
/// is the first result.
pub(super) fn pass(
    name: &str,
    sample_rate: f64,
    (channel, values): (usize, &mut Values),
    frames: u64,
    room: &mut usize,
) -> Result<(u64, HealthMeter), RecordingError> {
    let mut kept = values.is_text().then(Vec::new);
    let mut meter = HealthMeter::new(None);
    let mut places: Vec<Checkpoint> = Vec::new();
    let mut file = values.open()?;
    let mut reader = SampleReader::new(values, 0, &mut file)?;
    let mut samples = Vec::new();
    while reader.at < frames {
        let at = reader.at;
        samples.clear();
        let wanted = PASS_SAMPLES.min(frames - at);
        if reader.next(&mut file, wanted, &mut samples)? == 0 {
            break;
        }
        let place = reader.reader.checkpoint();
        if places.last() != Some(&place) {
            places.push(place);
        }
        check_finite(name, sample_rate, (channel, at), &samples)?;
        meter.add(&samples);
        kept = kept.filter(|kept: &Vec<f64>| kept.len() + samples.len() <= *room);
        if let Some(kept) = &mut kept {
            kept.extend_from_slice(&samples);
        }
    }
    let count = reader.at;
    if !places.is_empty() {
        values.checkpoints = Arc::new(places);
    }
    if let Some(kept) = kept {
        *room -= kept.len();
        values.kept = Some(Arc::new(kept));
    }
    Ok((count, meter))
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
        let mut values = Values::new(&listed, dataset, function).unwrap();
        let (count, _) = pass("file", 1000.0, (0, &mut values), u64::MAX, &mut 0).unwrap();
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
