//! How the samples of a WAV file are coded.

use super::error::RecordingError;
use super::wav_error::WavError;

/// How the samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// Integers that fill their containers of `bits` bits; 8 bits are unsigned.
    Integer { bits: u16 },
    /// Integers of `valid` bits in wider containers of `bits` bits.
    PaddedInteger {
        bits: u16,
        valid: u16,
        right_aligned: RightAligned,
    },
    /// 32-bit float.
    Float32,
    /// 64-bit float.
    Float64,
}

/// At which end of the container the valid bits sit. The format demands the high end; some writers
/// use the low one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RightAligned {
    /// At the high end, as the format demands.
    No,
    /// At the low end, with the sign extended.
    Yes,
}

impl Coding {
    /// Bytes per sample.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Integer { bits } | Self::PaddedInteger { bits, .. } => u64::from(bits / 8),
            Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }

    /// Magnitude from which on a sample sits at the end of the integer range (full scale = 1).
    pub(super) fn full_scale(self) -> Option<f64> {
        let bits = match self {
            Self::Integer { bits } => bits,
            Self::PaddedInteger { valid, .. } => valid,
            Self::Float32 | Self::Float64 => return None,
        };
        // The largest positive integer is 2^(bits-1) - 1.
        Some(1.0 - 0.5_f64.powi(i32::from(bits) - 1))
    }
}

/// The numbers of a "fmt " chunk that decide the coding.
#[derive(Debug, Clone, Copy)]
pub(super) struct FormatFields {
    pub tag: u16,
    pub channels: u16,
    pub frame_bytes: u16,
    pub bits: u16,
    pub valid: u16,
}

impl FormatFields {
    /// The coding, or why it cannot be read. `file` names the file in errors.
    pub(super) fn coding(&self, file: &str) -> Result<Coding, RecordingError> {
        let unsupported = || {
            RecordingError::from(WavError::UnsupportedCoding {
                file: file.to_owned(),
                tag: self.tag,
                name: coding_name(self.tag),
                bits: self.bits,
            })
        };
        // Only of these two is it known how samples lie in a frame.
        if !matches!(self.tag, 1 | 3) {
            return Err(unsupported());
        }
        let bytes = self.sample_bytes(file)?;
        // Writers that leave the valid bits at 0, or above the container, mean all of them.
        let valid = match self.valid {
            0 => self.bits,
            valid => valid.min(self.bits),
        };
        match (self.tag, bytes) {
            (1, 1..=4) if valid == 8 * bytes => Ok(Coding::Integer { bits: valid }),
            // One byte is unsigned and cannot be shifted about; fewer than 2 bits are no signal.
            (1, 2..=4) if valid >= 2 => Ok(Coding::PaddedInteger {
                bits: 8 * bytes,
                valid,
                right_aligned: RightAligned::No,
            }),
            (3, 4) if self.bits == 32 => Ok(Coding::Float32),
            (3, 8) if self.bits == 64 => Ok(Coding::Float64),
            _ => Err(unsupported()),
        }
    }

    /// Bytes of one sample of one channel: from the frame size, or from the bits where that is 0.
    fn sample_bytes(&self, file: &str) -> Result<u16, RecordingError> {
        let needed = self.bits.div_ceil(8);
        if self.frame_bytes == 0 {
            return Ok(needed);
        }
        let bytes = self.frame_bytes / self.channels.max(1);
        if bytes < needed || !self.frame_bytes.is_multiple_of(self.channels.max(1)) {
            return Err(WavError::BadHeader {
                file: file.to_owned(),
                field: "bytes per frame",
                value: u64::from(self.frame_bytes),
                allowed: "channels times bytes per sample",
            }
            .into());
        }
        Ok(bytes)
    }
}

/// Names of the codings that occur in WAV files (mmreg.h).
fn coding_name(tag: u16) -> &'static str {
    match tag {
        0x0001 => "integer PCM",
        0x0002 => "Microsoft ADPCM",
        0x0003 => "IEEE float",
        0x0006 => "A-law",
        0x0007 => "mu-law",
        0x0011 => "IMA ADPCM",
        0x0031 => "GSM 6.10",
        0x0050 => "MPEG",
        0x0055 => "MP3",
        0x00ff => "AAC",
        0x0161 => "Windows Media Audio",
        0xfffe => "extensible without a subformat",
        _ => "of an unknown kind",
    }
}
