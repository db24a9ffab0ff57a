//! The stream of samples, from standard input or a file, and the thread that writes it.

use super::recorder::Recorder;
use crate::recording::{Format, PcmLayout, Recording, SampleForm};
use anyhow::{Context, bail};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Most bytes that are taken at once. A small piece is on the disk soon.
const PIECE: usize = 1 << 14;
/// Length of a stream that must be there before it is listened to (s): some of its signal shows how the samples lie.
const FIRST: f64 = 0.5;

/// Source of the samples.
pub(super) enum Source {
    /// Standard input: WAV, or samples of this layout.
    Standard(Option<PcmLayout>),
    /// A file that is played.
    Replay {
        /// The file.
        path: PathBuf,
        /// The recording that it holds; `None` of samples without a head.
        recording: Option<Recording>,
        /// Layout of samples without a head.
        layout: Option<PcmLayout>,
        /// Seconds of the recording in a second; `None` = as fast as it goes.
        speed: Option<f64>,
    },
}

/// What the thread tells.
pub(super) enum Event {
    /// A file is there, with its first samples.
    File(PathBuf),
    /// The stream has ended. Bytes that were left over; or why it ended.
    Ended(anyhow::Result<usize>),
}

/// Writes the samples of a source into files of which the first has this name, in a thread of its own. It ends with the
/// stream, or once `stop` is set.
pub(super) fn record(source: Source, first: PathBuf, stop: Arc<AtomicBool>) -> Receiver<Event> {
    let (tell, events) = channel();
    thread::spawn(move || {
        let mut tell_file = |path: PathBuf| drop(tell.send(Event::File(path)));
        let ended = match source {
            Source::Standard(layout) => {
                let input = io::stdin().lock();
                write_stream(input, layout, None, &first, &stop, &mut tell_file)
            }
            Source::Replay {
                path,
                recording,
                layout,
                speed,
            } => open(&path, recording, layout).and_then(|(input, layout)| {
                write_stream(input, layout, speed, &first, &stop, &mut tell_file)
            }),
        };
        // Who no longer listens has ended.
        let _ = tell.send(Event::Ended(ended));
    });
    events
}

/// Opens a file that is played, as a stream with its layout; `None` of WAV, which is played byte by byte.
fn open(
    path: &Path,
    recording: Option<Recording>,
    layout: Option<PcmLayout>,
) -> anyhow::Result<(Box<dyn Read>, Option<PcmLayout>)> {
    let is_wav = |format| matches!(format, Format::WavInteger { .. } | Format::WavFloat { .. });
    let Some(recording) = recording.filter(|recording| !is_wav(recording.format())) else {
        let file = File::open(path);
        let file = file.with_context(|| format!("{}: cannot be read", path.display()))?;
        return Ok((Box::new(file), layout));
    };
    let form = match recording.format() {
        Format::Flac { bits: 16 } => SampleForm::S16,
        Format::Flac { bits: 24 } => SampleForm::S24,
        _ => SampleForm::F64,
    };
    let rate = recording.sample_rate();
    if rate.fract() != 0.0 || rate < 1.0 {
        bail!(
            "{}: its sample rate is {rate} Hz, and a WAV file takes whole numbers; play another recording",
            path.display()
        );
    }
    let layout = PcmLayout::new(rate as u32, recording.channels().len() as u16, form)?;
    let played = Played {
        recording,
        form,
        next: 0,
        bytes: Vec::new(),
        given: 0,
    };
    Ok((Box::new(played), Some(layout)))
}

/// A recording as a stream of bytes, in units of its file.
struct Played {
    recording: Recording,
    form: SampleForm,
    /// The next frame.
    next: u64,
    bytes: Vec<u8>,
    /// Of these bytes so many were given.
    given: usize,
}

impl Read for Played {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        const FRAMES: u64 = 4096;
        if self.given == self.bytes.len() && self.next < self.recording.frames() {
            let channels: Vec<usize> = (0..self.recording.channels().len()).collect();
            let frames = self.next..self.next + FRAMES;
            let samples = self.recording.read_channels(&channels, frames);
            let samples = samples.map_err(io::Error::other)?;
            self.next += FRAMES;
            (self.given, self.bytes) = (0, Vec::new());
            for frame in 0..samples.first().map_or(0, Vec::len) {
                for (channel, info) in samples.iter().zip(self.recording.channels()) {
                    self.form
                        .write(channel[frame] / info.scale, &mut self.bytes);
                }
            }
        }
        let count = into.len().min(self.bytes.len() - self.given);
        into[..count].copy_from_slice(&self.bytes[self.given..self.given + count]);
        self.given += count;
        Ok(count)
    }
}

/// Writes a stream of WAV, or of samples of a known layout. Returns the bytes of an incomplete frame at its end.
fn write_stream(
    mut input: impl Read,
    layout: Option<PcmLayout>,
    speed: Option<f64>,
    first: &Path,
    stop: &AtomicBool,
    tell: &mut impl FnMut(PathBuf),
) -> anyhow::Result<usize> {
    let mut piece = vec![0; PIECE];
    let mut bytes = Vec::new();
    let mut left = u64::MAX;
    let layout = match layout {
        Some(layout) => layout,
        None => loop {
            let count = read(&mut input, &mut piece)?;
            bytes.extend_from_slice(&piece[..count]);
            if let Some(head) = PcmLayout::of_wav(&bytes)? {
                bytes.drain(..head.length);
                left = head.data_bytes.unwrap_or(u64::MAX);
                break head.layout;
            }
            if count == 0 {
                bail!(
                    "the stream ended after {} bytes, before its first sample; check the recorder's messages",
                    bytes.len()
                );
            }
        },
    };
    let bytes_per_second = layout.frame_bytes as f64 * f64::from(layout.sample_rate);
    let enough = (FIRST * bytes_per_second) as u64;
    let mut recorder = Recorder::begin(first, layout)?;
    let (mut is_told, mut total) = (false, 0_u64);
    let start = Instant::now();
    loop {
        // Chunks behind the samples are no samples.
        bytes.truncate(left.min(bytes.len() as u64) as usize);
        left -= bytes.len() as u64;
        total += bytes.len() as u64;
        if recorder.write(&bytes)? {
            tell(recorder.path().to_owned());
        }
        if !is_told && recorder.bytes() > enough {
            is_told = true;
            tell(recorder.path().to_owned());
        }
        if let Some(speed) = speed {
            let due = Duration::from_secs_f64(total as f64 / bytes_per_second / speed);
            thread::sleep(due.saturating_sub(start.elapsed()));
        }
        if left == 0 || stop.load(Ordering::Relaxed) {
            break;
        }
        let count = read(&mut input, &mut piece)
            .with_context(|| format!("what came before is in {}", recorder.path().display()))?;
        if count == 0 {
            break;
        }
        bytes.clear();
        bytes.extend_from_slice(&piece[..count]);
    }
    if recorder.bytes() == 0 {
        std::fs::remove_file(recorder.path())?;
        bail!("the stream ended before its first sample; check the recorder's messages");
    }
    if !is_told {
        tell(recorder.path().to_owned());
    }
    Ok(recorder.rest())
}

/// Reads some bytes; 0 at the end.
fn read(input: &mut impl Read, into: &mut [u8]) -> anyhow::Result<usize> {
    loop {
        match input.read(into) {
            Err(cause) if cause.kind() == io::ErrorKind::Interrupted => {}
            read => return read.context("the stream could not be read"),
        }
    }
}
