//! Telling formats apart by their first bytes, never by the file's name.

use std::fs::File;
use std::path::Path;

use super::error::RecordingError;
use super::riff::{read_fully, unreadable};
use super::uff;

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Wav,
    Text,
    Universal,
}

/// First bytes, where they stand, and what they mean. Known so that the message can name them.
const UNREAD: &[(usize, &[u8], &str)] = &[
    (0, b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    (512, b"\x89HDF\r\n\x1a\n", "a MATLAB 7.3 (HDF5) file"),
    (0, b"MATLAB 5.0", "a MATLAB file"),
    (0, b"MATLAB 7.3", "a MATLAB 7.3 (HDF5) file"),
    (0, b"fLaC", "FLAC audio"),
    (0, b"OggS", "Ogg audio"),
    (0, b"ID3", "MP3 audio"),
    (0, b"\xff\xfb", "MP3 audio"),
    (0, b"\xff\xf3", "MP3 audio"),
    (0, b"\xff\xf2", "MP3 audio"),
    (4, b"ftyp", "MPEG-4 audio"),
    (0, b"riff\x2e\x91\xcf\x11", "Wave64 (W64) audio"),
    (0, b"RIFX", "big-endian WAV (RIFX)"),
    (0, b"FORM", "AIFF audio"),
    (0, b"caff", "Core Audio (CAF)"),
    (0, b".snd", "Sun/NeXT audio (AU)"),
    (0, b"wvpk", "WavPack audio"),
    (0, b"TDSm", "a LabVIEW TDMS file"),
    (0, b"PK\x03\x04", "a zip archive or Excel workbook"),
    (0, b"\xd0\xcf\x11\xe0", "an old Excel workbook"),
    (0, b"\x1f\x8b", "a gzip archive"),
    (0, b"%PDF", "a PDF document"),
    (0, b"PAR1", "a Parquet file"),
];

/// How many bytes decide.
const HEAD_BYTES: usize = 4096;

/// What the file at `path` is.
pub(super) fn recognise(path: &Path, file: &str) -> Result<Kind, RecordingError> {
    let mut head = vec![0_u8; HEAD_BYTES];
    let got = File::open(path)
        .and_then(|mut opened| read_fully(&mut opened, &mut head))
        .map_err(|source| unreadable(file, source))?;
    head.truncate(got);
    recognise_head(&head, file)
}

fn recognise_head(head: &[u8], file: &str) -> Result<Kind, RecordingError> {
    if head.is_empty() {
        return Err(RecordingError::EmptyFile {
            file: file.to_owned(),
        });
    }
    // The mark that begins such text in either order of bytes.
    if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
        return Err(RecordingError::Utf16 {
            file: file.to_owned(),
        });
    }
    let is_at = |at: usize, bytes: &[u8]| head.get(at..).is_some_and(|h| h.starts_with(bytes));
    let riff = [&b"RIFF"[..], b"RF64", b"BW64"].iter().any(|m| is_at(0, m));
    if riff && is_at(8, b"WAVE") {
        return Ok(Kind::Wav);
    }
    let unread = UNREAD.iter().find(|(at, bytes, _)| is_at(*at, bytes));
    let format = match unread {
        Some((_, _, format)) => Some(*format),
        None if riff => Some("a RIFF file without WAVE data"),
        None => None,
    };
    if let Some(format) = format {
        return Err(RecordingError::UnsupportedFormat {
            file: file.to_owned(),
            format,
        });
    }
    if uff::is_universal(head) {
        return Ok(Kind::Universal);
    }
    if looks_like_text(head) {
        return Ok(Kind::Text);
    }
    let first_bytes: Vec<String> = head.iter().take(8).map(|b| format!("{b:02x}")).collect();
    Err(RecordingError::UnknownFormat {
        file: file.to_owned(),
        first_bytes: first_bytes.join(" "),
    })
}

/// Text has no control characters but tabs, line ends and form feeds; latin-1 letters may occur.
fn looks_like_text(head: &[u8]) -> bool {
    let is_text = |byte: &u8| matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c | 0x1a | 0x20..);
    head.iter().all(is_text)
}
