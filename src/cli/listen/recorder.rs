//! The WAV files that take the samples of a stream.

use crate::recording::{MOST_FILES, PcmLayout};
use anyhow::{Context, bail};
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

/// Largest number of bytes of samples in one file. 1 GB: any program reads such a file, and 4 channels of 16 bits at
/// 51.2 kHz take 43 minutes for it.
const LARGEST: u64 = 1 << 30;

/// Names of the files of a recording.
#[derive(Debug, Clone)]
pub(super) struct Names {
    /// Name of the first file.
    pub(super) first: PathBuf,
    /// Names that belong to other recordings.
    pub(super) reserved: Vec<PathBuf>,
}

/// Where the samples go.
#[derive(Clone)]
pub(super) struct Destination {
    /// The recording that begins the stream.
    pub(super) names: Names,
    /// Nothing more is written once this is set.
    pub(super) stop: Arc<AtomicBool>,
    /// The recording that follows, once it is asked for.
    pub(super) next: Arc<Mutex<Option<Names>>>,
}

impl Destination {
    /// Returns the recording that is to follow now, once.
    pub(super) fn turned_to(&self) -> Option<Names> {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        next.take()
    }
}

/// Writes samples as they come. The sizes in the header are those of what is written, after every call: a process that is
/// killed leaves a file that can be read.
#[derive(Debug)]
pub(super) struct Recorder {
    names: Names,
    layout: PcmLayout,
    path: PathBuf,
    file: File,
    /// Bytes of samples in this file.
    bytes: u64,
    /// Bytes of samples in one file.
    largest: u64,
    /// Bytes of a frame whose rest has not come yet.
    begun: Vec<u8>,
}

impl Recorder {
    /// Makes the next file of a recording.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub(super) fn begin(names: Names, layout: PcmLayout) -> anyhow::Result<Self> {
        let (path, file) = next_file(&names, &layout)?;
        Ok(Self {
            names,
            largest: LARGEST - LARGEST % layout.frame_bytes,
            layout,
            path,
            file,
            bytes: 0,
            begun: Vec::new(),
        })
    }

    /// Goes on in the first file of another recording.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub(super) fn turn_to(&mut self, names: Names) -> anyhow::Result<()> {
        (self.path, self.file) = next_file(&names, &self.layout)?;
        (self.names, self.bytes) = (names, 0);
        Ok(())
    }

    /// The file that is written now.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of samples in this file.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes of an incomplete frame at the end of the stream.
    pub(super) fn rest(&self) -> usize {
        self.begun.len()
    }

    /// Writes the next bytes of the stream. Returns true if another file was begun for some of them.
    ///
    /// # Errors
    /// The disk refuses.
    pub(super) fn write(&mut self, bytes: &[u8]) -> anyhow::Result<bool> {
        self.begun.extend_from_slice(bytes);
        let whole = self.begun.len() - self.begun.len() % self.layout.frame_bytes as usize;
        let fitting = whole.min((self.largest - self.bytes) as usize);
        self.append(fitting)?;
        if fitting == whole {
            return Ok(false);
        }
        (self.path, self.file) = next_file(&self.names, &self.layout)?;
        self.bytes = 0;
        self.append(whole - fitting)?;
        Ok(true)
    }

    /// Moves so many bytes into the file.
    fn append(&mut self, count: usize) -> anyhow::Result<()> {
        if count == 0 {
            return Ok(());
        }
        let head = self.layout.wav_head((self.bytes + count as u64) as u32);
        let written = self.file.write_all(&self.begun[..count]);
        // Sizes stand at bytes 4 and before the samples.
        let written = written.and_then(|()| {
            self.file.seek(SeekFrom::Start(0))?;
            self.file.write_all(&head)?;
            self.file.seek(SeekFrom::End(0)).map(drop)
        });
        written.with_context(|| {
            format!(
                "{}: could not be written; what came before is kept",
                self.path.display()
            )
        })?;
        self.begun.drain(..count);
        self.bytes += count as u64;
        Ok(())
    }
}

/// Makes the first file of a recording that is not there yet and no other recording's: taps.wav, taps-2.wav, taps-3.wav.
fn next_file(names: &Names, layout: &PcmLayout) -> anyhow::Result<(PathBuf, File)> {
    let Names { first, reserved } = names;
    for number in 1..=MOST_FILES {
        let path = part(first, number);
        if reserved.contains(&path) {
            continue;
        }
        match File::create_new(&path) {
            Ok(mut file) => {
                file.write_all(&layout.wav_head(0))
                    .with_context(|| format!("{}: could not be written", path.display()))?;
                return Ok((path, file));
            }
            Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
            Err(cause) => {
                return Err(cause)
                    .with_context(|| format!("{}: could not be written", path.display()));
            }
        }
    }
    bail!(
        "{}: has {MOST_FILES} files already; give another name",
        first.display()
    )
}

/// Returns the name of a file of a recording, from 1: taps.wav, taps-2.wav.
pub(super) fn part(first: &Path, number: usize) -> PathBuf {
    if number == 1 {
        return first.to_owned();
    }
    let stem = super::super::input::stem(first);
    first.with_file_name(format!("{stem}-{number}.wav"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{ReadSettings, Recording, SampleForm};

    fn names(first: &Path, reserved: Vec<PathBuf>) -> Names {
        Names {
            first: first.to_owned(),
            reserved,
        }
    }

    fn samples(path: &Path) -> Vec<f64> {
        let opened = Recording::open(path, &ReadSettings::default()).unwrap();
        let of_length = ["truncated", "unknown-length"];
        for warning in opened.warnings() {
            assert!(!of_length.contains(&warning.code()), "{warning}");
        }
        opened.read(1, 0..u64::MAX).unwrap()
    }

    #[test]
    fn prop_the_file_is_readable_after_every_write() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("taps.wav");
        let layout = PcmLayout::new(1000, 2, SampleForm::S16).unwrap();
        let mut recorder = Recorder::begin(names(&first, Vec::new()), layout).unwrap();
        let bytes: Vec<u8> = (0..402_u32).map(|n| (n * 7 % 251) as u8).collect();
        let mut written = 0;
        // Pieces that cut frames.
        for piece in bytes.chunks(9) {
            assert!(!recorder.write(piece).unwrap());
            written += piece.len();
            if written >= 8 {
                assert_eq!(samples(&first).len(), written / 4);
            }
        }
        assert_eq!((recorder.bytes(), recorder.rest()), (400, 2));
        let own = std::fs::read(&first).unwrap();
        assert_eq!(own[44..], bytes[..400]);
    }

    #[test]
    fn limit_a_full_file_is_followed_by_another_and_none_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("taps.wav");
        std::fs::write(folder.path().join("taps-2.wav"), "another's").unwrap();
        let layout = PcmLayout::new(1000, 2, SampleForm::S16).unwrap();
        let reserved = vec![folder.path().join("taps-3.wav")];
        let mut recorder = Recorder::begin(names(&first, reserved), layout).unwrap();
        recorder.largest = 40;
        let bytes: Vec<u8> = (0..60).collect();
        assert!(!recorder.write(&bytes[..39]).unwrap());
        assert!(recorder.write(&bytes[39..]).unwrap());
        assert_eq!(recorder.path(), folder.path().join("taps-4.wav"));
        let parts = [1, 4].map(|number| std::fs::read(part(&first, number)).unwrap());
        assert_eq!([&parts[0][44..], &parts[1][44..]].concat(), bytes);
        let kept = std::fs::read_to_string(folder.path().join("taps-2.wav")).unwrap();
        assert_eq!(kept, "another's");
    }
}
