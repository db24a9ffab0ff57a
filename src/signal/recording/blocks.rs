//! A whole recording, block after block.

use super::source::Cursor;
use super::{Block, Recording, RecordingError};

/// The blocks of a recording, see [`Recording::blocks`].
#[derive(Debug)]
pub struct Blocks<'a> {
    recording: &'a Recording,
    channels: Vec<usize>,
    block: u64,
    at: u64,
    cursor: Option<Cursor<'a>>,
}

impl<'a> Blocks<'a> {
    pub(super) fn new(recording: &'a Recording, channels: &[usize], block: usize) -> Self {
        Self {
            recording,
            channels: channels.to_vec(),
            block: block.max(1) as u64,
            at: 0,
            cursor: None,
        }
    }

    fn next_block(&mut self) -> Result<Block, RecordingError> {
        let recording = self.recording;
        let cursor = match &mut self.cursor {
            Some(cursor) => cursor,
            none => {
                recording.check_channels(&self.channels)?;
                none.insert(recording.source.cursor(self.at)?)
            }
        };
        let start = self.at;
        let frames = self.block.min(recording.frames - start);
        let samples = cursor.read(&self.channels, frames)?;
        self.at += frames;
        Ok(Block {
            start,
            samples: recording.scaled(&self.channels, samples),
        })
    }
}

impl Iterator for Blocks<'_> {
    type Item = Result<Block, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.at >= self.recording.frames {
            return None;
        }
        let block = self.next_block();
        if block.is_err() {
            self.at = self.recording.frames;
        }
        Some(block)
    }
}
