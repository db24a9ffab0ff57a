//! Walking through the bytes of a universal file: lines, and the -1 that ends a dataset.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use memchr::memchr;
use memchr::memmem::Finder;

use crate::recording::riff::read_fully;

/// What stands in columns 1 to 6 of the line that opens and the line that closes a dataset.
pub(super) const MARK: &[u8] = b"    -1";

/// A longer line is none; the limit keeps a file without line ends out of memory.
pub(super) const MAX_LINE_BYTES: usize = 1 << 20;

/// Bytes read at a time when values are jumped over: large, since nothing else is done.
const SCAN_BYTES: usize = 1 << 20;

/// Bytes behind a mark that tell whether its line is blank otherwise: to column 80 and the line's end.
const TAIL_BYTES: usize = 76;

/// A file with a place in it; lines are read through a buffer, which a jump throws away.
#[derive(Debug)]
pub(super) struct Scanner {
    file: File,
    pub length: u64,
    buffer: Vec<u8>,
    /// Where the buffer begins in the file.
    base: u64,
    /// Place in the buffer.
    at: usize,
}

impl Scanner {
    pub(super) fn new(file: File) -> io::Result<Self> {
        Ok(Self {
            length: file.metadata()?.len(),
            file,
            buffer: Vec::new(),
            base: 0,
            at: 0,
        })
    }

    /// Where the next line begins (bytes).
    pub(super) fn position(&self) -> u64 {
        self.base + self.at as u64
    }

    /// Goes on at byte `place`.
    pub(super) fn jump(&mut self, place: u64) -> io::Result<()> {
        self.buffer.clear();
        self.at = 0;
        self.base = self.file.seek(SeekFrom::Start(place))?;
        Ok(())
    }

    /// The next line without its end, or the first [`MAX_LINE_BYTES`] of it; `None` at the end of
    /// the file.
    pub(super) fn line(&mut self) -> io::Result<Option<Vec<u8>>> {
        loop {
            let rest = self.buffer.get(self.at..).unwrap_or_default();
            let end = memchr(b'\n', rest);
            if let Some(end) = end.or((rest.len() >= MAX_LINE_BYTES).then_some(rest.len())) {
                let line = rest.get(..end).unwrap_or_default();
                let line = line.strip_suffix(b"\r").unwrap_or(line).to_vec();
                self.at = (self.at + end + 1).min(self.buffer.len());
                return Ok(Some(line));
            }
            if self.fill(1 << 13)? == 0 {
                let last = self.buffer.get(self.at..).unwrap_or_default().to_vec();
                self.at = self.buffer.len();
                return Ok((!last.is_empty()).then_some(last));
            }
        }
    }

    /// Goes to the line of the next mark that stands at the beginning of a line and returns the
    /// mark's place; `None` at the end of the file.
    pub(super) fn find_mark(&mut self) -> io::Result<Option<u64>> {
        self.find(&Finder::new(b"\n    -1"), 1)
    }

    /// Like [`find_mark`](Self::find_mark) for a mark that binary data may precede directly.
    pub(super) fn find_mark_behind_data(&mut self) -> io::Result<Option<u64>> {
        self.find(&Finder::new(MARK), 0)
    }

    fn find(&mut self, finder: &Finder<'_>, skipped: usize) -> io::Result<Option<u64>> {
        // The line end before a mark may be the byte just read; what was read before it can go.
        let kept = self.at.saturating_sub(skipped);
        self.buffer.drain(..kept);
        self.base += kept as u64;
        self.at -= kept;
        let mut from = 0;
        loop {
            let rest = self.buffer.get(from..).unwrap_or_default();
            match finder.find(rest) {
                Some(found) => {
                    let mark = from + found + skipped;
                    let behind = mark + MARK.len();
                    while self.buffer.len() < behind + TAIL_BYTES && self.fill(1 << 13)? > 0 {}
                    if is_blank_to_line_end(self.buffer.get(behind..).unwrap_or_default()) {
                        self.at = mark;
                        return Ok(Some(self.position()));
                    }
                    from = behind;
                }
                None => {
                    // What may be the beginning of a mark stays.
                    from = from.max(self.buffer.len().saturating_sub(MARK.len()));
                    self.buffer.drain(..from);
                    self.base += from as u64;
                    (from, self.at) = (0, 0);
                    if self.fill(SCAN_BYTES)? == 0 {
                        self.at = self.buffer.len();
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// Whether a dataset ends at `place`: at the end of the file, or at a mark with at most one line
    /// end before it. The scanner then stands at the mark.
    pub(super) fn ends_at(&mut self, place: u64) -> io::Result<bool> {
        if place >= self.length {
            self.jump(self.length)?;
            return Ok(place == self.length);
        }
        self.jump(place)?;
        while self.buffer.len() < MARK.len() + TAIL_BYTES + 2 && self.fill(1 << 13)? > 0 {}
        let line_ends = self.buffer.iter().take(2);
        let line_ends = line_ends
            .take_while(|byte| matches!(byte, b'\r' | b'\n'))
            .count();
        let rest = self.buffer.get(line_ends..).unwrap_or_default();
        let ended = match rest.strip_prefix(MARK) {
            Some(behind) => is_blank_to_line_end(behind),
            None => {
                rest.trim_ascii().is_empty() && self.base + self.buffer.len() as u64 == self.length
            }
        };
        self.at = line_ends;
        Ok(ended)
    }

    /// Reads more into the buffer; how many bytes is the result.
    fn fill(&mut self, bytes: usize) -> io::Result<usize> {
        if self.at > SCAN_BYTES {
            self.buffer.drain(..self.at);
            self.base += self.at as u64;
            self.at = 0;
        }
        let before = self.buffer.len();
        self.buffer.resize(before + bytes, 0);
        let got = read_fully(
            &mut self.file,
            self.buffer.get_mut(before..).unwrap_or_default(),
        )?;
        self.buffer.truncate(before + got);
        Ok(got)
    }
}

/// Whether only blanks stand before the end of the line or of the file.
fn is_blank_to_line_end(behind: &[u8]) -> bool {
    let first = behind.iter().find(|byte| **byte != b' ');
    matches!(first, None | Some(b'\r' | b'\n'))
}

/// Lines before byte `place`, counted for a message.
pub(super) fn lines_before(file: &mut File, place: u64) -> io::Result<u64> {
    file.seek(SeekFrom::Start(0))?;
    let (mut left, mut lines) = (place, 0);
    let mut block = vec![0_u8; 1 << 16];
    while left > 0 {
        let wanted = block.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        let part = block.get_mut(..wanted).unwrap_or_default();
        let got = file.read(part)?;
        if got == 0 {
            break;
        }
        let newlines = part.iter().take(got).filter(|byte| **byte == b'\n').count();
        lines += newlines as u64;
        left -= got as u64;
    }
    Ok(lines)
}
