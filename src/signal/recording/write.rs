//! Writing WAV files, through hound.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use super::error::RecordingError;
use super::wav_stream::{WavLayout, WavStream};

/// Number format of a WAV file that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WavFormat {
    /// 16-bit integer.
    Pcm16,
    /// 24-bit integer, what most recorders of today write.
    Pcm24,
    /// 32-bit float: no limit at full scale.
    Float32,
}

impl WavFormat {
    pub(super) fn bits(self) -> u16 {
        match self {
            Self::Pcm16 => 16,
            Self::Pcm24 => 24,
            Self::Float32 => 32,
        }
    }
}

/// Writes channels of equal length as a WAV file and returns how many samples were clipped.
///
/// Samples are in file units: full scale of the integer formats is 1, values beyond it are clipped
/// and counted. The file appears under its name only when it is complete. `sample_rate` in Hz.
///
/// # Errors
/// Channels of unequal length, samples that are not finite, more than the format can hold, a
/// sample rate of 0, a folder that cannot be written.
pub fn write_wav(
    path: &Path,
    sample_rate: u32,
    channels: &[Vec<f64>],
    format: WavFormat,
) -> Result<u64, RecordingError> {
    let name = path.display().to_string();
    let frames = check(&name, sample_rate, channels, format)?;
    let layout = WavLayout {
        sample_rate,
        channels: channels.len(),
        frames: frames as u64,
        format,
    };
    let mut stream = WavStream::create(path, layout)?;
    let mut frame = Vec::with_capacity(channels.len());
    for index in 0..frames {
        frame.clear();
        frame.extend(channels.iter().filter_map(|channel| channel.get(index)));
        stream.write(&frame)?;
    }
    stream.finish()
}

/// Temporary files are private to their owner; a recording is an ordinary file.
#[cfg(unix)]
pub(super) fn allow_others_to_read(file: &File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
pub(super) fn allow_others_to_read(_file: &File) -> std::io::Result<()> {
    Ok(())
}

/// Like [`write_wav`], to any writer; `name` stands for the file in errors.
///
/// # Errors
/// Those of [`write_wav`].
pub fn encode_wav<W: Write + Seek>(
    name: &str,
    mut writer: W,
    sample_rate: u32,
    channels: &[Vec<f64>],
    format: WavFormat,
) -> Result<u64, RecordingError> {
    let frames = check(name, sample_rate, channels, format)?;
    let unwritable = |error| RecordingError::Unwritable {
        file: name.to_owned(),
        source: match error {
            hound::Error::IoError(source) => source,
            other => std::io::Error::other(other),
        },
    };
    let written = encode(&mut writer, sample_rate, channels, format);
    let clipped = written.map_err(unwritable)?;
    let sample_bytes = u64::from(format.bits() / 8);
    let bytes = frames as u64 * channels.len() as u64 * sample_bytes;
    pad_to_even(&mut writer, bytes)
        .and_then(|()| writer.flush())
        .map_err(|source| unwritable(hound::Error::IoError(source)))?;
    Ok(clipped)
}

fn check(
    name: &str,
    sample_rate: u32,
    channels: &[Vec<f64>],
    format: WavFormat,
) -> Result<usize, RecordingError> {
    if sample_rate == 0 {
        return Err(RecordingError::BadSampleRate {
            file: name.to_owned(),
            value: 0.0,
        });
    }
    let slices: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
    let frames = super::open::check_samples(name, f64::from(sample_rate), &slices)?;
    check_size(name, channels.len(), frames as u64, format)?;
    Ok(frames)
}

/// Whether a WAV file can hold so much.
pub(super) fn check_size(
    name: &str,
    channels: usize,
    frames: u64,
    format: WavFormat,
) -> Result<(), RecordingError> {
    let bytes = frames
        .saturating_mul(channels as u64)
        .saturating_mul(u64::from(format.bits() / 8));
    // 128 bytes are more than the header takes.
    if channels > usize::from(u16::MAX) || bytes > u64::from(u32::MAX) - 128 {
        return Err(RecordingError::TooLarge {
            file: name.to_owned(),
            channels,
            frames: usize::try_from(frames).unwrap_or(usize::MAX),
            bits: format.bits(),
        });
    }
    Ok(())
}

fn encode(
    writer: &mut (impl Write + Seek),
    sample_rate: u32,
    channels: &[Vec<f64>],
    format: WavFormat,
) -> Result<u64, hound::Error> {
    let mut wav = hound::WavWriter::new(writer, spec(sample_rate, channels.len(), format))?;
    let mut clipped = 0;
    for frame in 0..channels.first().map_or(0, Vec::len) {
        for value in channels.iter().filter_map(|channel| channel.get(frame)) {
            clipped += u64::from(write_value(&mut wav, *value, format)?);
        }
    }
    wav.finalize()?;
    Ok(clipped)
}

pub(super) fn spec(sample_rate: u32, channels: usize, format: WavFormat) -> hound::WavSpec {
    hound::WavSpec {
        channels: channels as u16,
        sample_rate,
        bits_per_sample: format.bits(),
        sample_format: match format {
            WavFormat::Float32 => hound::SampleFormat::Float,
            WavFormat::Pcm16 | WavFormat::Pcm24 => hound::SampleFormat::Int,
        },
    }
}

/// Writes one value, and says whether it was clipped.
pub(super) fn write_value(
    wav: &mut hound::WavWriter<impl Write + Seek>,
    value: f64,
    format: WavFormat,
) -> Result<bool, hound::Error> {
    if format == WavFormat::Float32 {
        wav.write_sample(value as f32)?;
        return Ok(false);
    }
    let full_scale = 2_f64.powi(i32::from(format.bits()) - 1);
    let wanted = (value * full_scale).round();
    let stored = wanted.clamp(-full_scale, full_scale - 1.0);
    wav.write_sample(stored as i32)?;
    Ok(stored != wanted)
}

/// Chunks have even length: an odd one is followed by a pad byte that counts for the whole only.
pub(super) fn pad_to_even(
    writer: &mut (impl Write + Seek),
    data_bytes: u64,
) -> std::io::Result<()> {
    if data_bytes.is_multiple_of(2) {
        return Ok(());
    }
    let end = writer.seek(SeekFrom::End(0))?;
    writer.write_all(&[0])?;
    // The size of all chunks stands at byte 4 and leaves out the first 8 bytes.
    let size = u32::try_from(end + 1 - 8).unwrap_or(u32::MAX);
    writer.seek(SeekFrom::Start(4))?;
    writer.write_all(&size.to_le_bytes())?;
    writer.seek(SeekFrom::End(0))?;
    Ok(())
}
