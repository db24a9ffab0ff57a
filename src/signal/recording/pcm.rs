//! Samples that come as a stream of bytes: their form, and the head of the WAV file that takes them.

use super::error::{RecordingError, check_channel_count};
use super::health::check_rate;
use super::wav::{WavHead, read_head};

/// Longest head of a WAV stream (bytes). Recorders put some kilobytes of text there.
const LONGEST_HEAD: usize = 1 << 20;
/// From this size on (bytes) the length in a stream's header is a placeholder. sox writes the last whole frame below 0x7ffff000. A
/// frame has at most 32 kB; 64 kB leave room.
const NO_PROMISE: u32 = 0x7fff_f000 - (1 << 16);

/// Form of the samples of a stream, little end first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleForm {
    /// Integers of 16 bits.
    S16,
    /// Integers of 24 bits in three bytes.
    S24,
    /// Integers of 32 bits.
    S32,
    /// Floating-point numbers of 32 bits.
    F32,
    /// Floating-point numbers of 64 bits.
    F64,
}

impl SampleForm {
    /// The words for the forms, as sox and ffmpeg have them.
    pub const WORDS: [(&str, SampleForm); 5] = [
        ("s16le", SampleForm::S16),
        ("s24le", SampleForm::S24),
        ("s32le", SampleForm::S32),
        ("f32le", SampleForm::F32),
        ("f64le", SampleForm::F64),
    ];

    /// Bits of a sample.
    pub fn bits(self) -> u16 {
        match self {
            Self::S16 => 16,
            Self::S24 => 24,
            Self::S32 | Self::F32 => 32,
            Self::F64 => 64,
        }
    }

    /// Format tag of a WAV file: 1 = integers, 3 = floating-point numbers.
    fn tag(self) -> u16 {
        match self {
            Self::S16 | Self::S24 | Self::S32 => 1,
            Self::F32 | Self::F64 => 3,
        }
    }

    /// Appends a sample, full scale = 1. Integers are rounded, and cut off at full scale.
    pub fn write(self, value: f64, into: &mut Vec<u8>) {
        match self {
            Self::F32 => into.extend((value as f32).to_le_bytes()),
            Self::F64 => into.extend(value.to_le_bytes()),
            Self::S16 | Self::S24 | Self::S32 => {
                let full = 2f64.powi(i32::from(self.bits()) - 1);
                let steps = (value * full).round().clamp(-full, full - 1.0) as i32;
                let bytes = steps.to_le_bytes();
                into.extend(&bytes[..usize::from(self.bits() / 8)]);
            }
        }
    }
}

/// Rate, channels and form of the samples of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PcmLayout {
    /// Sample rate (Hz).
    pub sample_rate: u32,
    /// Channels.
    pub channels: u16,
    /// Bytes of one sample of all channels.
    pub frame_bytes: u64,
    /// Content of the "fmt " chunk.
    format_chunk: Vec<u8>,
}

/// Head of a WAV stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PcmHead {
    /// What it says of the samples.
    pub layout: PcmLayout,
    /// Bytes before the samples.
    pub length: usize,
    /// Bytes of samples that follow; `None` where it does not know them.
    pub data_bytes: Option<u64>,
}

impl PcmLayout {
    /// Layout of raw samples.
    ///
    /// # Errors
    /// A sample rate or a number of channels that no recording has.
    pub fn new(sample_rate: u32, channels: u16, form: SampleForm) -> Result<Self, RecordingError> {
        const NAME: &str = "the stream";
        check_rate(NAME, sample_rate.into())?;
        check_channel_count(NAME, channels.into())?;
        let frame_bytes = channels * (form.bits() / 8);
        let bytes_per_second = sample_rate.saturating_mul(frame_bytes.into());
        let mut format_chunk = Vec::new();
        for word in [form.tag(), channels] {
            format_chunk.extend(word.to_le_bytes());
        }
        for word in [sample_rate, bytes_per_second] {
            format_chunk.extend(word.to_le_bytes());
        }
        for word in [frame_bytes, form.bits()] {
            format_chunk.extend(word.to_le_bytes());
        }
        Ok(Self {
            sample_rate,
            channels,
            frame_bytes: frame_bytes.into(),
            format_chunk,
        })
    }

    /// Returns true where bytes begin as a WAV file does, as far as there are any.
    pub fn may_be_wav(bytes: &[u8]) -> bool {
        let mark = bytes.get(..4).unwrap_or(bytes);
        let is_riff = [b"RIFF", b"RF64", b"BW64"]
            .iter()
            .any(|known| known.starts_with(mark));
        is_riff && (bytes.len() < 12 || bytes.get(8..12) == Some(b"WAVE"))
    }

    /// Reads the head of a WAV stream from its first bytes; `None` while more of them are needed.
    ///
    /// # Errors
    /// Bytes that are no WAV file, or a coding that is not read.
    pub fn of_wav(bytes: &[u8]) -> Result<Option<PcmHead>, RecordingError> {
        const NAME: &str = "the stream";
        if !Self::may_be_wav(bytes) {
            let problem = "does not begin with the header of a WAV file; give --rate, --channels and --format for raw \
                           samples, or have the recorder write WAV";
            return Err(RecordingError::new(NAME, problem));
        }
        let Some(head) = read_head(NAME, bytes)? else {
            if bytes.len() > LONGEST_HEAD {
                let problem = format!(
                    "a WAV header without samples in its first {LONGEST_HEAD} bytes; have the recorder write plain WAV"
                );
                return Err(RecordingError::new(NAME, problem));
            }
            return Ok(None);
        };
        let WavHead {
            sample_rate,
            channels,
            frame_bytes,
            format_chunk,
            length,
            promised,
        } = head;
        check_rate(NAME, sample_rate.into())?;
        let is_known = (1..NO_PROMISE).contains(&promised);
        Ok(Some(PcmHead {
            layout: Self {
                sample_rate,
                channels,
                frame_bytes,
                format_chunk,
            },
            length,
            data_bytes: is_known.then_some(promised.into()),
        }))
    }

    /// Returns the header of a WAV file with so many bytes of samples. Its length does not depend on them.
    pub fn wav_head(&self, data_bytes: u32) -> Vec<u8> {
        let format = &self.format_chunk;
        let mut head = Vec::with_capacity(28 + format.len());
        // A chunk has an even length, and the size of the whole leaves out the first eight bytes.
        let padding = format.len() % 2;
        let whole = (20 + format.len() + padding) as u32;
        head.extend(b"RIFF");
        head.extend(whole.saturating_add(data_bytes).to_le_bytes());
        head.extend(b"WAVEfmt ");
        head.extend((format.len() as u32).to_le_bytes());
        head.extend(format);
        head.extend(&[0][..padding]);
        head.extend(b"data");
        head.extend(data_bytes.to_le_bytes());
        head
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_head_is_read_from_any_number_of_its_bytes() {
        for (_, form) in SampleForm::WORDS {
            let layout = PcmLayout::new(51_200, 4, form).unwrap();
            let head = layout.wav_head(800);
            for count in 0..head.len() {
                assert_eq!(
                    PcmLayout::of_wav(&head[..count]).unwrap(),
                    None,
                    "{count} bytes"
                );
            }
            let found = PcmLayout::of_wav(&head).unwrap().expect("all is there");
            assert_eq!(found.layout, layout);
            assert_eq!((found.length, found.data_bytes), (head.len(), Some(800)));
        }
    }

    #[test]
    fn limit_lengths_that_a_recorder_does_not_know_are_no_lengths() {
        let layout = PcmLayout::new(48_000, 2, SampleForm::S24).unwrap();
        // ffmpeg writes the largest number, arecord 2 GB, sox the last whole frame of 4 bytes below 0x7ffff000, others nothing.
        for unknown in [0, u32::MAX, 1 << 31, 0x7fff_f000, 0x7fff_eff8] {
            let head = PcmLayout::of_wav(&layout.wav_head(unknown)).unwrap();
            assert_eq!(head.expect("whole").data_bytes, None, "{unknown}");
        }
    }

    #[test]
    fn regress_what_is_no_wav_head_is_named() {
        let text = |bytes: &[u8]| PcmLayout::of_wav(bytes).unwrap_err().to_string();
        assert_eq!(
            text(b"time,force\n0,0\n"),
            "the stream: does not begin with the header of a WAV file; give --rate, --channels and --format for raw \
             samples, or have the recorder write WAV"
        );
        let mut endless = PcmLayout::new(1000, 1, SampleForm::S16)
            .unwrap()
            .wav_head(0);
        endless.truncate(36);
        endless.extend(b"LIST\xff\xff\xff\x7f");
        endless.resize(LONGEST_HEAD + 2, 0);
        assert_eq!(
            text(&endless),
            "the stream: a WAV header without samples in its first 1048576 bytes; have the recorder write plain WAV"
        );
    }

    #[test]
    fn val_samples_have_the_bytes_of_their_form() {
        let bytes = |form: SampleForm, value| {
            let mut bytes = Vec::new();
            form.write(value, &mut bytes);
            bytes
        };
        assert_eq!(bytes(SampleForm::S16, -1.0), [0x00, 0x80]);
        // Full scale itself has no integer.
        assert_eq!(bytes(SampleForm::S24, 1.0), [0xff, 0xff, 0x7f]);
        assert_eq!(bytes(SampleForm::S32, 0.5), [0, 0, 0, 0x40]);
        assert_eq!(bytes(SampleForm::F32, 1.0), [0, 0, 0x80, 0x3f]);
        assert_eq!(bytes(SampleForm::F64, -2.0), [0, 0, 0, 0, 0, 0, 0, 0xc0]);
    }
}
