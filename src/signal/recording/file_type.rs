//! Formats are told apart by the first bytes of a file, never by its name.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::error::RecordingError;

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FileType {
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

/// Recognises the format of the file at `path`.
pub(super) fn recognise(path: &Path, file: &str) -> Result<FileType, RecordingError> {
    let head = read_head(path, file, HEAD_BYTES)?;
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
    let riff = [b"RIFF", b"RF64", b"BW64"]
        .iter()
        .any(|mark| head.starts_with(*mark));
    if riff && stands_at(&head, 8, b"WAVE") {
        return Ok(FileType::Wav);
    }
    let unread = UNREAD
        .iter()
        .find(|(at, bytes, _)| stands_at(&head, *at, bytes));
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
    if begins_with_mark(&head) {
        return Ok(FileType::Universal);
    }
    // Text has no control characters but tabs, line ends and form feeds; latin-1 letters may occur.
    if head
        .iter()
        .all(|byte| matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c | 0x1a | 0x20..))
    {
        return Ok(FileType::Text);
    }
    let first_bytes: Vec<String> = head.iter().take(8).map(|b| format!("{b:02x}")).collect();
    Err(RecordingError::UnknownFormat {
        file: file.to_owned(),
        first_bytes: first_bytes.join(" "),
    })
}

fn stands_at(head: &[u8], at: usize, bytes: &[u8]) -> bool {
    head.get(at..).is_some_and(|rest| rest.starts_with(bytes))
}

/// Returns `true` for a universal file, by its first bytes.
///
/// # Errors
/// A file that cannot be read.
pub fn is_universal_file(path: &Path) -> Result<bool, RecordingError> {
    let head = read_head(path, &path.display().to_string(), HEAD_BYTES)?;
    Ok(begins_with_mark(&head))
}

/// Returns `true` where the first line that is not empty has -1 in columns 5 and 6, the mark of universal files.
fn begins_with_mark(head: &[u8]) -> bool {
    let mut lines = head
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::trim_ascii_end);
    lines.find(|line| !line.is_empty()) == Some(b"    -1")
}

/// Reads the first `limit` bytes of a file, or as many as there are.
pub(super) fn read_head(path: &Path, file: &str, limit: usize) -> Result<Vec<u8>, RecordingError> {
    let mut head = vec![0_u8; limit];
    let got = File::open(path)
        .and_then(|mut opened| read_fully(&mut opened, &mut head))
        .map_err(|source| unreadable(file, source))?;
    head.truncate(got);
    Ok(head)
}

/// Fills `into` as far as the reader goes, and returns how many bytes it read.
pub(super) fn read_fully(reader: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
    let mut got = 0;
    while let Some(rest) = into.get_mut(got..).filter(|rest| !rest.is_empty()) {
        match reader.read(rest) {
            Ok(0) => break,
            Ok(more) => got += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(got)
}

/// Returns the error of a file that the operating system does not give.
pub(super) fn unreadable(file: &str, source: io::Error) -> RecordingError {
    RecordingError::Unreadable {
        file: file.to_owned(),
        source,
    }
}
