//! Samples of a WAV file as numbers, full scale = 1 for integers, block by block.
//!
//! The chunks are walked by [`super::riff`]; the samples are then decoded by hound, which is given
//! a plain header of our own in front of each block. What hound cannot decode (64-bit float,
//! integers that do not fill their containers) is decoded here.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::coding::{Coding, RightAligned};
use super::error::RecordingError;
use super::riff::{self, WavLayout, read_fully, unreadable};
use super::warning::RecordingWarning;

/// Bytes read at a time: large enough for speed, small against any memory.
const BLOCK_BYTES: u64 = 1 << 19;

/// Samples looked at to find out which end of a container is used: silence decides nothing.
const ALIGNMENT_FRAMES: u64 = 1 << 20;

/// A WAV file whose header has been understood.
#[derive(Debug, Clone)]
pub(super) struct WavSource {
    pub path: PathBuf,
    pub file: String,
    pub layout: WavLayout,
}

impl WavSource {
    pub(super) fn open(path: &Path, file: &str) -> Result<Self, RecordingError> {
        let mut opened = File::open(path).map_err(|source| unreadable(file, source))?;
        let layout = riff::walk(&mut opened, file)?;
        let mut source = Self {
            path: path.to_owned(),
            file: file.to_owned(),
            layout,
        };
        source.settle_alignment()?;
        Ok(source)
    }

    /// Positions a reader at `frame`.
    pub(super) fn cursor(&self, frame: u64) -> Result<WavCursor<'_>, RecordingError> {
        let layout = &self.layout;
        let at = frame.min(layout.frames);
        let mut reader = File::open(&self.path).map_err(|source| unreadable(&self.file, source))?;
        reader
            .seek(SeekFrom::Start(layout.data_start + at * layout.frame_bytes))
            .map_err(|source| unreadable(&self.file, source))?;
        Ok(WavCursor {
            source: self,
            reader,
            at,
            bytes: Vec::new(),
            values: Vec::new(),
        })
    }

    /// Finds out which end of wide containers the valid bits sit at.
    ///
    /// At the high end the low bits are all zero. When they are not, and every value fits into the
    /// valid bits, the writer used the low end; when neither holds, all bits are taken as valid.
    fn settle_alignment(&mut self) -> Result<(), RecordingError> {
        let Coding::PaddedInteger { bits, valid, .. } = self.layout.coding else {
            return Ok(());
        };
        let unused = i32::from(bits - valid);
        let limit = 2_f64.powi(-unused);
        let (mut low_bits_zero, mut fits) = (true, true);
        let mut cursor = self.cursor(0)?;
        let mut seen = 0;
        while seen < ALIGNMENT_FRAMES {
            let block = cursor.next_interleaved(ALIGNMENT_FRAMES - seen)?;
            if block.is_empty() {
                break;
            }
            seen += (block.len() / self.layout.channels) as u64;
            for value in block {
                let steps = value * 2_f64.powi(i32::from(valid) - 1);
                low_bits_zero &= steps == steps.trunc();
                fits &= (-limit..limit).contains(value);
            }
        }
        if !low_bits_zero && fits {
            self.layout.coding = Coding::PaddedInteger {
                bits,
                valid,
                right_aligned: RightAligned::Yes,
            };
            self.layout.warnings.push(RecordingWarning::RightAligned {
                bits: valid,
                container: bits,
            });
        }
        Ok(())
    }
}

/// A reader somewhere in the samples.
#[derive(Debug)]
pub(super) struct WavCursor<'a> {
    source: &'a WavSource,
    reader: File,
    at: u64,
    bytes: Vec<u8>,
    values: Vec<f64>,
}

impl WavCursor<'_> {
    /// Appends up to `limit` frames of the wanted channels to `into`; fewer only at the end.
    pub(super) fn read(
        &mut self,
        channels: &[usize],
        limit: u64,
        into: &mut [Vec<f64>],
    ) -> Result<(), RecordingError> {
        let count = self.source.layout.channels;
        let mut left = limit;
        while left > 0 {
            let values = self.next_interleaved(left)?;
            if values.is_empty() {
                break;
            }
            left = left.saturating_sub((values.len() / count) as u64);
            for (channel, samples) in channels.iter().zip(into.iter_mut()) {
                samples.extend(values.iter().skip(*channel).step_by(count));
            }
        }
        Ok(())
    }

    /// The next frames, at most `limit` and at most one block, channel after channel.
    fn next_interleaved(&mut self, limit: u64) -> Result<&[f64], RecordingError> {
        let layout = &self.source.layout;
        let per_block = (BLOCK_BYTES / layout.frame_bytes).max(1);
        let frames = limit.min(per_block).min(layout.frames - self.at);
        self.values.clear();
        self.bytes.resize((frames * layout.frame_bytes) as usize, 0);
        let got = read_fully(&mut self.reader, &mut self.bytes)
            .map_err(|source| unreadable(&self.source.file, source))?;
        if got < self.bytes.len() {
            return Err(RecordingError::Changed {
                file: self.source.file.clone(),
                frame: self.at + got as u64 / layout.frame_bytes,
            });
        }
        decode(layout.coding, &self.bytes, &mut self.values)
            .map_err(|error| unreadable(&self.source.file, std::io::Error::other(error)))?;
        self.at += frames;
        Ok(&self.values)
    }
}

/// Decodes whole samples; integers with full scale 1.
fn decode(coding: Coding, bytes: &[u8], into: &mut Vec<f64>) -> Result<(), hound::Error> {
    match coding {
        // hound takes at most 2^32 bytes and a block is far smaller, so the length fits.
        Coding::Integer { bits } => {
            let full_scale = 2_f64.powi(i32::from(bits) - 1);
            let mut reader = hound_reader(1, bits, bytes)?;
            for sample in reader.samples::<i32>() {
                into.push(f64::from(sample?) / full_scale);
            }
        }
        Coding::Float32 => {
            let mut reader = hound_reader(3, 32, bytes)?;
            for sample in reader.samples::<f32>() {
                into.push(f64::from(sample?));
            }
        }
        Coding::Float64 => {
            let (samples, _) = bytes.as_chunks::<8>();
            into.extend(samples.iter().map(|sample| f64::from_le_bytes(*sample)));
        }
        Coding::PaddedInteger {
            bits,
            valid,
            right_aligned,
        } => {
            let used = match right_aligned {
                RightAligned::No => bits,
                RightAligned::Yes => valid,
            };
            let full_scale = 2_f64.powi(i32::from(used) - 1);
            let samples = bytes.chunks_exact(usize::from(bits / 8));
            into.extend(samples.map(|sample| signed(sample) as f64 / full_scale));
        }
    }
    Ok(())
}

/// A little-endian signed integer of up to 8 bytes.
fn signed(bytes: &[u8]) -> i64 {
    let mut padded = [0_u8; 8];
    let unused = 8_usize.saturating_sub(bytes.len());
    // Filled from the high end and shifted down again, so that the sign extends itself.
    for (to, from) in padded.iter_mut().skip(unused).zip(bytes) {
        *to = *from;
    }
    i64::from_le_bytes(padded) >> (8 * unused.min(7))
}

/// hound over one block of samples behind a minimal header: one channel, since the order of the
/// samples is all that matters here.
fn hound_reader(
    tag: u16,
    bits: u16,
    bytes: &[u8],
) -> Result<hound::WavReader<impl Read + '_>, hound::Error> {
    let length = bytes.len() as u32;
    let mut header = Vec::with_capacity(44);
    header.extend(b"RIFF");
    header.extend((36 + length).to_le_bytes());
    header.extend(b"WAVEfmt ");
    header.extend(16_u32.to_le_bytes());
    header.extend(tag.to_le_bytes());
    header.extend(1_u16.to_le_bytes());
    header.extend(1_u32.to_le_bytes());
    header.extend(u32::from(bits / 8).to_le_bytes());
    header.extend((bits / 8).to_le_bytes());
    header.extend(bits.to_le_bytes());
    header.extend(b"data");
    header.extend(length.to_le_bytes());
    hound::WavReader::new(Cursor::new(header).chain(bytes))
}
