//! A WAV file that is still being written, and the recording that it holds so far.

use super::error::RecordingError;
use super::health::{HealthMeter, check_finite};
use super::outline::Extremes;
use super::wav::WavSource;
use super::{ChannelInfo, Cursor, Recording, RecordingWarning};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A WAV file that grows while it is read.
///
/// Each sample is read once, for the health of its channel. The sizes in the header are not believed: all complete
/// frames of the file count.
#[derive(Debug)]
pub struct GrowingRecording {
    /// The file, up to the last frame that was read.
    source: WavSource,
    path: PathBuf,
    /// Its name in messages.
    file: String,
    meters: Vec<HealthMeter>,
    /// Doubts about the header.
    warnings: Vec<RecordingWarning>,
    /// Samples that were read last, channel by channel.
    block: Vec<Vec<f64>>,
}

impl GrowingRecording {
    /// Opens a file that has at least one frame. No frame is read yet. Integers that do not fill their containers may sit
    /// at either end, and the first million frames decide: let some of the signal be there.
    ///
    /// # Errors
    /// A file that cannot be read, or is no WAV file.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = path.display().to_string();
        let mut warnings = Vec::new();
        let mut source = WavSource::open(path, &file, &mut warnings)?;
        // The length in the header is not the last one.
        warnings.retain(|warning| warning.code() == "right-aligned");
        source.frames = 0;
        Ok(Self {
            meters: source.meters(),
            block: vec![Vec::new(); source.channels],
            source,
            path: path.to_owned(),
            file,
            warnings,
        })
    }

    /// Returns the file from its beginning again. How its samples lie is decided by all that is there now.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn reopened(&self) -> Result<Self, RecordingError> {
        Self::open(&self.path)
    }

    /// Samples per second (Hz).
    pub fn sample_rate(&self) -> f64 {
        f64::from(self.source.sample_rate)
    }

    /// Frames that were read so far.
    pub fn frames(&self) -> u64 {
        self.source.frames
    }

    /// Reads the next `frames` of the file, and returns the lowest and the highest value of each channel among them, in
    /// file units; `None` where the file does not hold so many yet, and then none are read.
    ///
    /// # Errors
    /// The file can no longer be read, or holds a sample that is not finite.
    pub fn grow(&mut self, frames: u64) -> Result<Option<Vec<Extremes>>, RecordingError> {
        let before = self.source.frames;
        self.source.take_all()?;
        let end = before.saturating_add(frames);
        if frames == 0 || self.source.frames < end {
            self.source.frames = before;
            return Ok(None);
        }
        self.source.frames = end;
        let all: Vec<usize> = (0..self.source.channels).collect();
        let mut swings = vec![Extremes::NONE; self.source.channels];
        let mut cursor = self.source.reader(before)?;
        let (mut start, per_block) = (before, self.source.frames_of_a_pass());
        while start < end {
            let count = per_block.min(end - start);
            self.block.iter_mut().for_each(Vec::clear);
            cursor.read(&all, count, &mut self.block)?;
            for (channel, samples) in self.block.iter().enumerate() {
                check_finite(
                    &self.file,
                    self.source.sample_rate.into(),
                    channel,
                    start,
                    samples,
                )?;
                self.meters[channel].add(samples);
                swings[channel] = swings[channel].with(Extremes::of(samples));
            }
            start += count;
        }
        Ok(Some(swings))
    }

    /// Reads the rest of the file.
    ///
    /// # Errors
    /// Those of [`grow`](Self::grow).
    pub fn grow_to_end(&mut self) -> Result<(), RecordingError> {
        let mut all = self.source.clone();
        all.take_all()?;
        let rest = all.frames.saturating_sub(self.source.frames);
        self.grow(rest)?;
        Ok(())
    }

    /// Returns the whole recording once it has ended. Its outlines are coarse, so that many such recordings take little
    /// memory.
    pub fn finished(&self) -> Recording {
        let mut finished = self.snapshot();
        for info in &mut finished.channels {
            info.health.outline = Arc::new(info.health.outline.coarse());
        }
        finished
    }

    /// Returns the recording so far. Its samples are read from the file, which goes on growing behind them.
    pub fn snapshot(&self) -> Recording {
        let meters = self.meters.iter().cloned();
        Recording {
            name: self.file.clone(),
            format: self.source.format(),
            sample_rate: self.sample_rate(),
            frames: self.source.frames,
            channels: meters
                .map(|meter| ChannelInfo::unscaled(None, None, meter))
                .collect(),
            warnings: self.warnings.clone(),
            source: Arc::new(self.source.clone()),
            parts: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{PcmLayout, ReadSettings, SampleForm};
    use super::*;
    use std::io::Write;

    /// A noisy decay, cut off at 0.5, in two channels.
    fn frames(form: SampleForm) -> Vec<Vec<u8>> {
        let mut state = 1u32;
        let mut frames = Vec::new();
        for n in 0..20_000 {
            let mut frame = Vec::new();
            for channel in 0..2 {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = 1e-3 * (f64::from(state) / f64::from(u32::MAX) - 0.5);
                let time = f64::from((n + 500 * channel) % 4000) / 1000.0;
                let decay = (-3.0 * time).exp() * (150.0 * time).sin();
                form.write((decay + noise).clamp(-0.5, 0.5), &mut frame);
            }
            frames.push(frame);
        }
        frames
    }

    #[test]
    fn prop_a_growing_file_gives_the_recording_that_opening_it_gives() {
        let folder = tempfile::tempdir().unwrap();
        for (word, form) in SampleForm::WORDS {
            let path = folder.path().join(format!("{word}.wav"));
            let layout = PcmLayout::new(1000, 2, form).unwrap();
            let mut file = std::fs::File::create(&path).unwrap();
            // The writer has not come to the sizes yet.
            file.write_all(&layout.wav_head(u32::MAX)).unwrap();
            let frames = frames(form);
            let mut growing = None;
            let mut written = 0;
            // Steps that fit no block.
            for some in frames.chunks(377) {
                // A part of the next frame is there already.
                file.write_all(&some.concat()).unwrap();
                written += some.len() as u64;
                let growing = growing.get_or_insert_with(|| GrowingRecording::open(&path).unwrap());
                assert_eq!(growing.grow(some.len() as u64 + 1).unwrap(), None);
                let swings = growing
                    .grow(some.len() as u64 - 1)
                    .unwrap()
                    .expect("they are there");
                assert_eq!(swings.len(), 2);
                growing.grow_to_end().unwrap();
                assert_eq!(growing.frames(), written);
            }
            let growing = growing.unwrap();
            let bytes = written * layout.frame_bytes;
            drop(file);
            let mut whole = layout.wav_head(bytes as u32);
            whole.extend(frames.concat());
            std::fs::write(&path, whole).unwrap();
            let opened = Recording::open(&path, &ReadSettings::default()).unwrap();
            let snapshot = growing.snapshot();
            assert_eq!(snapshot.format(), opened.format());
            assert_eq!(snapshot.frames(), opened.frames());
            assert_eq!(snapshot.warnings(), opened.warnings());
            assert_eq!(
                snapshot.read(1, 0..20_000).unwrap(),
                opened.read(1, 0..20_000).unwrap()
            );
            for (own, other) in snapshot.channels().iter().zip(opened.channels()) {
                let (own, other) = (&own.health, &other.health);
                assert_eq!((own.rails, own.peak), (other.rails, other.peak));
                assert_eq!(own.outline, other.outline);
                assert_eq!(own.flat_top_count, other.flat_top_count);
                // Sums in blocks of other lengths.
                assert!((own.mean - other.mean).abs() < 1e-15);
                assert!((own.rms / other.rms - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn limit_a_file_that_does_not_grow_has_no_new_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taps.wav");
        let layout = PcmLayout::new(1000, 1, SampleForm::S16).unwrap();
        let mut bytes = layout.wav_head(4);
        bytes.extend([1, 0, 2, 0, 3]);
        std::fs::write(&path, bytes).unwrap();
        let mut growing = GrowingRecording::open(&path).unwrap();
        assert_eq!(growing.frames(), 0);
        // Half a frame does not count.
        assert_eq!(growing.grow(3).unwrap(), None);
        for _ in 0..2 {
            growing.grow_to_end().unwrap();
            assert_eq!(growing.frames(), 2);
        }
        assert_eq!(growing.grow(0).unwrap(), None);
    }
}
