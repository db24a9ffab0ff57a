//! Writing a WAV file sample by sample, so that nothing is kept that grows with its length.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::error::RecordingError;
use super::write::{WavFormat, allow_others_to_read, check_size, pad_to_even, spec, write_value};

/// What a WAV file will hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WavLayout {
    /// Sample rate (Hz).
    pub sample_rate: u32,
    /// Channels.
    pub channels: usize,
    /// Most samples per channel.
    pub frames: u64,
    /// Number format.
    pub format: WavFormat,
}

/// A WAV file in the making; it appears under its name when it is finished.
pub struct WavStream {
    path: PathBuf,
    name: String,
    layout: WavLayout,
    aside: tempfile::NamedTempFile,
    wav: hound::WavWriter<BufWriter<File>>,
    written: u64,
    clipped: u64,
}

impl WavStream {
    /// Begins a file.
    ///
    /// # Errors
    /// More than the format can hold, a sample rate of 0, a folder that cannot be written.
    pub fn create(path: &Path, layout: WavLayout) -> Result<Self, RecordingError> {
        let name = path.display().to_string();
        if layout.sample_rate == 0 {
            return Err(RecordingError::BadSampleRate {
                file: name,
                value: 0.0,
            });
        }
        check_size(&name, layout.channels, layout.frames, layout.format)?;
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let begin = || {
            let aside = tempfile::NamedTempFile::new_in(folder)?;
            let writer = BufWriter::new(aside.reopen()?);
            Ok((aside, writer))
        };
        let (aside, writer) = begin().map_err(|source| unwritable(&name, source))?;
        let spec = spec(layout.sample_rate, layout.channels, layout.format);
        let wav = hound::WavWriter::new(writer, spec).map_err(|error| in_hound(&name, error))?;
        Ok(Self {
            path: path.to_owned(),
            name,
            layout,
            aside,
            wav,
            written: 0,
            clipped: 0,
        })
    }

    /// Writes one sample of every channel, in file units: full scale of the integer formats is 1,
    /// values beyond it are clipped and counted.
    ///
    /// # Errors
    /// Not one number for each channel, numbers that are not finite, more samples than announced, a
    /// disk that is full.
    pub fn write(&mut self, frame: &[f64]) -> Result<(), RecordingError> {
        if frame.len() != self.layout.channels {
            return Err(RecordingError::LengthMismatch {
                file: self.name.clone(),
                channel: 1,
                found: frame.len(),
                expected: self.layout.channels,
            });
        }
        let (from, rate) = (self.written, f64::from(self.layout.sample_rate));
        for (channel, value) in frame.iter().enumerate() {
            let place = (channel, from);
            super::open::check_finite(&self.name, rate, place, std::slice::from_ref(value))?;
            let clipped = write_value(&mut self.wav, *value, self.layout.format)
                .map_err(|error| in_hound(&self.name, error))?;
            self.clipped += u64::from(clipped);
        }
        self.written += 1;
        check_size(
            &self.name,
            self.layout.channels,
            self.written,
            self.layout.format,
        )
    }

    /// Completes the file, puts it in its place, and returns how many samples were clipped.
    ///
    /// # Errors
    /// No samples; the disk refuses.
    pub fn finish(self) -> Result<u64, RecordingError> {
        let name = self.name;
        if self.written == 0 {
            return Err(RecordingError::NoSamples { file: name });
        }
        self.wav
            .finalize()
            .map_err(|error| in_hound(&name, error))?;
        let sample_bytes = u64::from(self.layout.format.bits() / 8);
        let bytes = self.written * self.layout.channels as u64 * sample_bytes;
        let complete = |mut aside: tempfile::NamedTempFile| {
            pad_to_even(aside.as_file_mut(), bytes)?;
            aside.as_file_mut().flush()?;
            allow_others_to_read(aside.as_file())?;
            aside.persist(&self.path).map_err(|error| error.error)?;
            Ok(self.clipped)
        };
        complete(self.aside).map_err(|source| unwritable(&name, source))
    }
}

fn unwritable(name: &str, source: std::io::Error) -> RecordingError {
    RecordingError::Unwritable {
        file: name.to_owned(),
        source,
    }
}

fn in_hound(name: &str, error: hound::Error) -> RecordingError {
    let source = match error {
        hound::Error::IoError(source) => source,
        other => std::io::Error::other(other),
    };
    unwritable(name, source)
}
