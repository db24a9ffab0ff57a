//! The stream of samples, from standard input or a file, and the thread that writes it.

use super::arrival::{Arrival, Shown};
use super::recorder::{Destination, Names, Recorder};
use crate::recording::{Format, PcmLayout, Recording, SampleForm};
use anyhow::{Context, bail};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Most bytes that are taken at once. A small piece is on the disk soon.
const PIECE: usize = 1 << 14;
/// Length of a stream that must be there before it is listened to (s): some of its signal shows how the samples lie.
const FIRST: f64 = 0.5;
/// Length of the pieces of a replay (s).
const TACT: f64 = 0.02;

/// Source of the samples.
pub(super) enum Source {
    /// Standard input: WAV, or raw samples of this layout.
    Standard(Option<PcmLayout>),
    /// A sound device.
    #[cfg(feature = "sound")]
    Sound(super::sound::SoundDevice),
    /// A file that is played.
    Replay {
        /// The file.
        path: PathBuf,
        /// The recording that it holds; `None` of raw samples.
        recording: Option<Recording>,
        /// Layout of raw samples.
        layout: Option<PcmLayout>,
        /// Seconds of the recording in a second; `None` = as fast as it goes.
        speed: Option<f64>,
    },
}

/// What the thread reports.
pub(super) enum Event {
    /// A file is there, with its first samples.
    File(PathBuf),
    /// The next recording has begun in this file, as it was asked for.
    Turned(PathBuf),
    /// The next recording cannot be written, in words. The last one goes on.
    NotTurned(String),
    /// Something is wrong with the stream, which goes on.
    Doubt(String),
    /// The stream arrives at another rate than stated, or again at this one. It goes on.
    Rate {
        /// In words.
        text: String,
        /// True of another rate.
        is_wrong: bool,
    },
    /// The stream has ended, or it cannot be read or written.
    Ended(anyhow::Result<End>),
}

/// End of a stream.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct End {
    /// Bytes of an incomplete frame.
    pub(super) rest: usize,
    /// Length that the header promises and that did not come (s).
    pub(super) missing: f64,
}

/// A stream that is written in a thread of its own.
pub(super) struct Running {
    /// What the thread reports.
    pub(super) events: Receiver<Event>,
    destination: Destination,
}

impl Running {
    /// Begins to write the samples of a source into the files of a recording. It ends with the stream, or when it is stopped.
    pub(super) fn begin(source: Source, names: Names) -> Self {
        let (report, events) = channel();
        let destination = Destination {
            names,
            stop: Arc::default(),
            next: Arc::default(),
        };
        let own = destination.clone();
        thread::spawn(move || {
            let stream = match source {
                Source::Standard(layout) => Ok(Stream {
                    input: Box::new(io::stdin()),
                    layout,
                    speed: None,
                    frames: None,
                    is_live: true,
                }),
                #[cfg(feature = "sound")]
                Source::Sound(device) => {
                    let report = report.clone();
                    // The recording may have ended.
                    let doubt = move |words| drop(report.send(Event::Doubt(words)));
                    device.open(doubt).map(|(layout, sound)| Stream {
                        input: Box::new(sound),
                        layout: Some(layout),
                        speed: None,
                        frames: None,
                        is_live: true,
                    })
                }
                Source::Replay {
                    path,
                    recording,
                    layout,
                    speed,
                } => open(&path, recording, layout, speed),
            };
            let ended = stream.and_then(|stream| stream.write(&own, &report));
            // The command may have ended.
            let _ = report.send(Event::Ended(ended));
        });
        Self {
            events,
            destination,
        }
    }

    /// Returns what stops the stream once it is set.
    pub(super) fn stopper(&self) -> Arc<AtomicBool> {
        self.destination.stop.clone()
    }

    /// Stops the stream. Nothing more is written.
    pub(super) fn stop(&self) {
        self.destination.stop.store(true, Ordering::Relaxed);
    }

    /// Returns true once it was stopped.
    pub(super) fn is_stopped(&self) -> bool {
        self.destination.stop.load(Ordering::Relaxed)
    }

    /// Writes what follows into the files of another recording.
    pub(super) fn turn_to(&self, names: Names) {
        let next = self.destination.next.lock();
        *next.unwrap_or_else(PoisonError::into_inner) = Some(names);
    }
}

/// Samples as they come.
struct Stream {
    input: Box<dyn Read>,
    /// Layout of raw samples; `None` of WAV.
    layout: Option<PcmLayout>,
    /// Seconds of samples in a second; `None` = as they come.
    speed: Option<f64>,
    /// Number of frames where it is known better than by the header.
    frames: Option<u64>,
    /// True of samples that come as they are taken.
    is_live: bool,
}

/// Opens a file that is played. WAV is played byte by byte.
fn open(
    path: &Path,
    recording: Option<Recording>,
    layout: Option<PcmLayout>,
    speed: Option<f64>,
) -> anyhow::Result<Stream> {
    let form = match recording.as_ref().map(Recording::format) {
        None | Some(Format::WavInteger { .. } | Format::WavFloat { .. }) => {
            let file = File::open(path);
            let file = file.with_context(|| format!("{}: cannot be read", path.display()))?;
            return Ok(Stream {
                input: Box::new(file),
                layout,
                speed,
                frames: recording.map(|recording| recording.frames()),
                is_live: false,
            });
        }
        Some(Format::Flac { bits: 16 }) => SampleForm::S16,
        Some(Format::Flac { bits: 24 }) => SampleForm::S24,
        Some(_) => SampleForm::F64,
    };
    let recording = recording.context("there is no recording")?;
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
    Ok(Stream {
        input: Box::new(played),
        layout: Some(layout),
        speed,
        frames: None,
        is_live: false,
    })
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

impl Stream {
    /// Writes the stream, and reports its files.
    fn write(mut self, destination: &Destination, report: &Sender<Event>) -> anyhow::Result<End> {
        let mut bytes = Vec::new();
        let Some((layout, promised)) = self.begin(&mut bytes, destination)? else {
            return Ok(End::default());
        };
        let bytes_per_second = layout.frame_bytes as f64 * f64::from(layout.sample_rate);
        let frames = self.frames.map(|frames| frames * layout.frame_bytes);
        let mut left = frames.or(promised).unwrap_or(u64::MAX);
        let is_known = left < u64::MAX;
        let enough = (FIRST * bytes_per_second).max(layout.frame_bytes as f64) as usize;
        // Of a replay small pieces, so that it goes on as steadily as a recording.
        let most = self
            .speed
            .map_or(PIECE as f64, |speed| TACT * speed * bytes_per_second);
        let mut piece = vec![0; (most as usize).clamp(1, PIECE)];
        let mut recorder: Option<Recorder> = None;
        let (mut total, start) = (0_u64, Instant::now());
        let mut arrival = Arrival::new(f64::from(layout.sample_rate));
        let (mut is_turning, mut fault) = (false, None);
        loop {
            let is_there = bytes.len() as u64 >= left;
            let count = match is_there {
                true => Ok(0),
                false => read(&mut self.input, &mut piece),
            };
            let count = match count {
                Ok(count) => count,
                Err(cause) => {
                    fault = Some(cause);
                    break;
                }
            };
            total += count as u64;
            if let Some(speed) = self.speed {
                let due = Duration::from_secs_f64(total as f64 / bytes_per_second / speed);
                thread::sleep(due.saturating_sub(start.elapsed()));
            }
            if destination.stop.load(Ordering::Relaxed) {
                break;
            }
            if self.is_live
                && let frames = count as f64 / layout.frame_bytes as f64
                && let Some(shown) = arrival.takes(start.elapsed(), frames)
            {
                let is_wrong = matches!(shown, Shown::WrongRate(_));
                let _ = report.send(match shown {
                    Shown::WrongRate(text) | Shown::RightRate(text) => {
                        Event::Rate { text, is_wrong }
                    }
                    Shown::Loss(text) => Event::Doubt(text),
                });
            }
            bytes.extend_from_slice(&piece[..count]);
            // Chunks behind the samples are no samples.
            bytes.truncate(left.min(bytes.len() as u64) as usize);
            let is_over = count == 0 || bytes.len() as u64 == left;
            // The file is begun with the first samples: a stream without any leaves none.
            let is_enough = bytes.len()
                >= if is_over {
                    layout.frame_bytes as usize
                } else {
                    enough
                };
            if recorder.is_none() && is_enough {
                recorder = Some(Recorder::begin(destination.names.clone(), layout.clone())?);
            }
            if let Some(recorder) = &mut recorder {
                if let Some(names) = destination.turned_to() {
                    match recorder.turn_to(names) {
                        Ok(()) => is_turning = true,
                        Err(cause) => {
                            let words = format!("{cause:#}; the recording before it goes on");
                            let _ = report.send(Event::NotTurned(words));
                        }
                    }
                }
                let is_first = recorder.bytes() == 0;
                let is_next = match recorder.write(&bytes) {
                    Ok(is_next) => is_next,
                    Err(cause) => {
                        fault = Some(cause);
                        break;
                    }
                };
                if is_turning && recorder.bytes() >= enough as u64 {
                    is_turning = false;
                    let _ = report.send(Event::Turned(recorder.path().to_owned()));
                } else if !is_turning && (is_first || is_next) {
                    let _ = report.send(Event::File(recorder.path().to_owned()));
                }
                left -= bytes.len() as u64;
                bytes.clear();
            }
            if is_over {
                break;
            }
        }
        // A recording that has just begun: short, but not lost.
        if let Some(recorder) = recorder.as_ref().filter(|_| is_turning) {
            let path = recorder.path().to_owned();
            match recorder.bytes() {
                0 => fs::remove_file(path)?,
                _ => drop(report.send(Event::Turned(path))),
            }
        }
        if let Some(fault) = fault {
            return Err(fault);
        }
        if destination.stop.load(Ordering::Relaxed) {
            return Ok(End::default());
        }
        let Some(recorder) = recorder else {
            bail!("the stream ended before its first sample; check the recorder's messages");
        };
        Ok(End {
            rest: recorder.rest(),
            missing: if is_known {
                left as f64 / bytes_per_second
            } else {
                0.0
            },
        })
    }

    /// Returns the layout, and the bytes of samples that a header promises. `bytes` takes the samples that came with the
    /// header. `None` where it was stopped before.
    fn begin(
        &mut self,
        bytes: &mut Vec<u8>,
        destination: &Destination,
    ) -> anyhow::Result<Option<(PcmLayout, Option<u64>)>> {
        // "RIFF", the length, "WAVE".
        const HEAD: usize = 12;
        let mut piece = vec![0; if self.layout.is_some() { HEAD } else { PIECE }];
        loop {
            let count = read(&mut self.input, &mut piece)?;
            if destination.stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            bytes.extend_from_slice(&piece[..count]);
            if self.layout.is_some() && bytes.len() < HEAD && count > 0 {
                continue;
            }
            if let Some(layout) = self.layout.take() {
                if bytes.len() >= HEAD && PcmLayout::may_be_wav(bytes) {
                    bail!(
                        "the stream is WAV, and --rate, --channels and --format are for raw samples; leave them out, \
                         or record raw samples (arecord -t raw)"
                    );
                }
                return Ok(Some((layout, None)));
            }
            if let Some(head) = PcmLayout::of_wav(bytes)? {
                bytes.drain(..head.length);
                return Ok(Some((head.layout, head.data_bytes)));
            }
            if count == 0 {
                bail!(
                    "the stream ended after {} bytes, before its first sample; check the recorder's messages",
                    bytes.len()
                );
            }
        }
    }
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
