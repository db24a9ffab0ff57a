//! What can be wrong with a WAV file's header.

/// Why the header of a WAV file cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WavError {
    /// A chunk without which the samples have no meaning.
    #[error(
        "{file}: no \"{chunk}\" chunk{place}: not a usable WAV file; record or export it again"
    )]
    MissingChunk {
        /// The file.
        file: String,
        /// Its four-letter name.
        chunk: &'static str,
        /// Where it was expected, empty for "anywhere".
        place: &'static str,
    },
    /// A header field that cannot be true.
    #[error("{file}: the WAV header says {field} {value}; allowed: {allowed}; export it again")]
    BadHeader {
        /// The file.
        file: String,
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: u64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Samples coded in a way that is not read.
    #[error(
        "{file}: WAV coding {name} (format tag 0x{tag:04x}, {bits} bits) is not read; allowed: integer of 8 to 32 bits, float of 32 or 64 bits; export as PCM or float"
    )]
    UnsupportedCoding {
        /// The file.
        file: String,
        /// The format tag, of the subformat where the header is extensible.
        tag: u16,
        /// Its common name.
        name: &'static str,
        /// Bits per sample.
        bits: u16,
    },
}
