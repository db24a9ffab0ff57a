//! Where samples come from: a WAV file, a text file, a universal file, memory. One way to read them all.

use std::sync::Arc;

use super::csv::{CsvCursor, CsvSource};
use super::error::RecordingError;
use super::uff::{UffCursor, UffSource};
use super::wav::{WavCursor, WavSource};

/// Where the samples of a recording are.
#[derive(Debug, Clone)]
pub(super) enum Source {
    Wav(Box<WavSource>),
    Csv(Box<CsvSource>),
    Uff(Box<UffSource>),
    Memory(Arc<Vec<Vec<f64>>>),
}

impl Source {
    /// Positions a reader at `frame`.
    pub(super) fn cursor(&self, frame: u64) -> Result<Cursor<'_>, RecordingError> {
        Ok(match self {
            Self::Wav(source) => Cursor::Wav(source.cursor(frame)?),
            Self::Csv(source) => Cursor::Csv(source.cursor(frame)?),
            Self::Uff(source) => Cursor::Uff(source.cursor(frame)),
            Self::Memory(channels) => Cursor::Memory(MemoryCursor {
                channels,
                at: usize::try_from(frame).unwrap_or(usize::MAX),
            }),
        })
    }
}

/// A reader somewhere in the samples; one per pass, since it moves.
#[derive(Debug)]
pub(super) enum Cursor<'a> {
    Wav(WavCursor<'a>),
    Csv(CsvCursor<'a>),
    Uff(UffCursor<'a>),
    Memory(MemoryCursor<'a>),
}

impl Cursor<'_> {
    /// Up to `limit` samples of the wanted channels, in file units; fewer only at the end.
    pub(super) fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
    ) -> Result<Vec<Vec<f64>>, RecordingError> {
        let mut samples = vec![Vec::new(); channels.len()];
        match self {
            Self::Wav(cursor) => cursor.read(channels, limit, &mut samples)?,
            Self::Csv(cursor) => cursor.read(channels, limit, &mut samples)?,
            Self::Uff(cursor) => cursor.read(channels, limit, &mut samples)?,
            Self::Memory(cursor) => cursor.read(channels, limit, &mut samples),
        }
        Ok(samples)
    }
}

/// A place in samples held in memory.
#[derive(Debug)]
pub(super) struct MemoryCursor<'a> {
    channels: &'a [Vec<f64>],
    at: usize,
}

impl MemoryCursor<'_> {
    fn read(&mut self, channels: &[usize], limit: u64, into: &mut [Vec<f64>]) {
        let limit = usize::try_from(limit).unwrap_or(usize::MAX);
        let frames = self.channels.first().map_or(0, Vec::len);
        let end = self.at.saturating_add(limit).min(frames);
        for (channel, samples) in channels.iter().zip(into.iter_mut()) {
            let all = self.channels.get(*channel);
            let part = all.and_then(|all| all.get(self.at.min(end)..end));
            samples.extend_from_slice(part.unwrap_or_default());
        }
        self.at = end;
    }
}
