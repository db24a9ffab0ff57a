//! Errors of this stage: each names the file, and the line where there is one; what was found, what
//! is allowed, what to do.

use std::io;

/// A number with the digits that mean something: nine, so that roundings do not show.
pub(super) fn short(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

/// Error of opening, reading or writing a recording: the file, and the line where there is one;
/// what was found, what is allowed, what to do. Poor data are [`super::RecordingWarning`]s instead.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{file}: cannot be read: {source}; check the path and the permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// The file became shorter after it was opened.
    #[error(
        "{file}: ended before sample {frame}, though it was longer when opened; is it still being written?"
    )]
    Changed {
        /// The file.
        file: String,
        /// First sample (0-based) that is no longer there.
        frame: u64,
    },
    /// Zero bytes.
    #[error("{file}: the file is empty (0 bytes); record or export it again")]
    EmptyFile {
        /// The file.
        file: String,
    },
    /// A WAV file whose header cannot be used.
    #[error(transparent)]
    Wav(#[from] WavError),
    /// A universal file that cannot be used.
    #[error(transparent)]
    Uff(#[from] UffError),
    /// A file of frequency response functions that cannot be used.
    #[error(transparent)]
    Responses(#[from] ResponseError),
    /// A format that is known but not read.
    #[error("{file}: {format} is not read by this version; export as WAV, CSV or UFF58")]
    UnsupportedFormat {
        /// The file.
        file: String,
        /// Format by the first bytes.
        format: &'static str,
    },
    /// Text of two bytes a character.
    #[error(
        "{file}: the text is UTF-16, two bytes a character; save it as UTF-8 (in spreadsheets the type \"CSV UTF-8\")"
    )]
    Utf16 {
        /// The file.
        file: String,
    },
    /// Neither a WAV file, a universal file nor text.
    #[error(
        "{file}: neither a WAV file, a universal file nor text (first bytes {first_bytes}); export as WAV, CSV or UFF58"
    )]
    UnknownFormat {
        /// The file.
        file: String,
        /// The first bytes, in hexadecimal.
        first_bytes: String,
    },
    /// A valid frame without samples.
    #[error("{file}: holds no samples; record or export it again")]
    NoSamples {
        /// The file.
        file: String,
    },
    /// A sample that is no number of physical size.
    #[error(
        "{file}: channel {channel}, sample {frame} ({} s) is {value}; allowed: finite numbers of magnitude up to 1e100; remove the damaged part and export it again",
        short(*.time)
    )]
    NotFinite {
        /// The file.
        file: String,
        /// Channel, 1-based.
        channel: usize,
        /// Sample, 0-based.
        frame: u64,
        /// When (s).
        time: f64,
        /// The value.
        value: f64,
    },
    /// Not one line of numbers.
    #[error(
        "{file}:{line}: no line of numbers found; the best candidate holds \"{value}\" where a number is needed; allowed: numbers separated by comma, semicolon, tab or blanks"
    )]
    NoNumbers {
        /// The file.
        file: String,
        /// The line, 1-based, that came nearest.
        line: u64,
        /// Value found.
        value: String,
    },
    /// A cell that is no usable number.
    #[error("{file}:{line}: column {column}{name} {problem}")]
    BadCell {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// Column in the file, 1-based.
        column: usize,
        /// ` ("name")` where the header names the column, empty otherwise.
        name: String,
        /// Found value, allowed values, and remedy.
        problem: String,
    },
    /// More cells than columns.
    #[error(
        "{file}:{line}: {found} cells where the rows have {columns}; the first surplus cell holds \"{value}\"; correct this line"
    )]
    SurplusCells {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// Cells in this line.
        found: usize,
        /// Columns of the file.
        columns: usize,
        /// The first cell too many.
        value: String,
    },
    /// An empty line between rows of a file without a time column.
    #[error(
        "{file}:{line}: empty line between rows; without a time column it cannot be told whether a row was lost; remove the line or add a time column"
    )]
    BlankLine {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
    },
    /// Commas both as separators and within numbers.
    #[error(
        "{file}:{line}: {names} names head {columns} columns; when the comma is the decimal mark the separator must be semicolon, tab or blank; export it again"
    )]
    AmbiguousComma {
        /// The file.
        file: String,
        /// Line of the header, 1-based.
        line: u64,
        /// Names in the header.
        names: usize,
        /// Columns below it.
        columns: usize,
    },
    /// A line too long to be a row of numbers.
    #[error(
        "{file}:{line}: this line has more than {limit} bytes; allowed: one row of numbers per line"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// The limit (bytes).
        limit: usize,
    },
    /// More channels than any recorder has.
    #[error("{file}: {channels} channels; at most {limit} are read; is the header damaged?")]
    TooManyChannels {
        /// The file.
        file: String,
        /// Channels found.
        channels: usize,
        /// The limit.
        limit: usize,
    },
    /// Only a time column.
    #[error(
        "{file}:{line}: column {column} is time and there is no other; allowed: at least one channel beside the time"
    )]
    OnlyTime {
        /// The file.
        file: String,
        /// Line of the first row, 1-based.
        line: u64,
        /// The time column, 1-based.
        column: usize,
    },
    /// A time column in something else than time.
    #[error(
        "{file}:{line}: the time column's unit \"{unit}\" is not one of time; allowed: s, ms, us, ns, min, h"
    )]
    TimeUnit {
        /// The file.
        file: String,
        /// Line of the first row, 1-based.
        line: u64,
        /// The unit as the header has it.
        unit: String,
    },
    /// Sampling that is not uniform.
    #[error(
        "{file}:{line}: uneven sampling: time {} s comes {} s after the row before, the step elsewhere is {} s{lost}; allowed: 0.1 % of the step, or what rounding of the printed time explains; export without gaps or resample evenly",
        short(*.time), short(*.step), short(*.expected)
    )]
    UnevenSampling {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// Time in that line (s).
        time: f64,
        /// Step to it (s).
        step: f64,
        /// Step elsewhere (s).
        expected: f64,
        /// ` (about N rows are missing)` where the gap is a whole number of steps, empty otherwise.
        lost: String,
    },
    /// A file without a sample rate.
    #[error(
        "{file}:{line}: no time column and no sample rate{hint}; name the time column t or time (unit in brackets allowed), or give sample_rate in Hz"
    )]
    NoSampleRate {
        /// The file.
        file: String,
        /// Line of the first row, 1-based.
        line: u64,
        /// ` (column N rises evenly: is it the time?)` where one does, empty otherwise.
        hint: String,
    },
    /// A column is named as time, but its values do not rise.
    #[error(
        "{file}:{line}: column {column} is named as time, but repeats or falls here, as in most rows: {} after {}; export the time with more digits, or remove the column and give sample_rate in Hz",
        times[0],
        times[1]
    )]
    RepeatedTime {
        /// The file.
        file: String,
        /// Line of the first value that does not rise, 1-based.
        line: u64,
        /// Number, 1-based, and name of the column.
        column: String,
        /// The value there and the one before it (the column's unit).
        times: [f64; 2],
    },
    /// A rate that is none.
    #[error(
        "{file}: sample rate {value} Hz; allowed: 0.001 to 1e9 Hz; correct it or the time column"
    )]
    BadSampleRate {
        /// The file.
        file: String,
        /// The value (Hz).
        value: f64,
    },
    /// A scale that loses the signal.
    #[error(
        "{file}: channel {channel}: scale {value}; allowed: a finite number other than 0 (negative = mounted the other way)"
    )]
    BadScale {
        /// The file.
        file: String,
        /// Channel, 1-based.
        channel: usize,
        /// The value.
        value: f64,
    },
    /// A channel number that does not exist.
    #[error("{file}: no channel {number}; there are: {existing}; name one of these")]
    UnknownChannelNumber {
        /// The file.
        file: String,
        /// The number asked for, 1-based.
        number: usize,
        /// Channels that exist.
        existing: String,
    },
    /// A channel name that does not exist.
    #[error(
        "{file}: no channel named \"{name}\"{nearest}; there are: {existing}; name one of these"
    )]
    UnknownChannelName {
        /// The file.
        file: String,
        /// The name asked for.
        name: String,
        /// `; did you mean "..."?` where one is near, empty otherwise.
        nearest: String,
        /// Channels that exist.
        existing: String,
    },
    /// A name that several channels share.
    #[error("{file}: {count} channels are named \"{name}\"; use the channel's number: {existing}")]
    AmbiguousChannelName {
        /// The file.
        file: String,
        /// The name asked for.
        name: String,
        /// Number of channels that have it.
        count: usize,
        /// Channels that exist.
        existing: String,
    },
    /// Channels of different lengths.
    #[error(
        "{file}: channel {channel} has {found} samples, channel 1 has {expected}; allowed: equal lengths"
    )]
    LengthMismatch {
        /// The file.
        file: String,
        /// Channel, 1-based.
        channel: usize,
        /// Its samples.
        found: usize,
        /// Samples of channel 1.
        expected: usize,
    },
    /// A WAV file that the format cannot hold.
    #[error(
        "{file}: {channels} channels of {frames} samples at {bits} bits do not fit into a WAV file; allowed: 1 to 65535 channels and less than 4 GiB; write less"
    )]
    TooLarge {
        /// The file.
        file: String,
        /// Channels.
        channels: usize,
        /// Samples per channel.
        frames: usize,
        /// Bits per sample.
        bits: u16,
    },
    /// The operating system refused to write.
    #[error("{file}: cannot be written: {source}; check the folder, its permissions and its space")]
    Unwritable {
        /// The file.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
}

/// Error in the header of a WAV file.
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
        /// Expected place; empty for "anywhere".
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
        /// Allowed values.
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

/// Error of reading or writing a universal file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UffError {
    /// A header record that makes no sense.
    #[error(
        "{file}:{line}: record {record} of dataset {dataset} (type 58) has {field} \"{value}\"; allowed: {allowed}; export the file again"
    )]
    BadRecord {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// The dataset, 1-based.
        dataset: usize,
        /// The record, 1-based as in the format's description; 0 for the line with the type.
        record: usize,
        /// Meaning of the field.
        field: &'static str,
        /// Value found.
        value: String,
        /// Allowed values.
        allowed: &'static str,
    },
    /// Numbers in a format of computers of the past.
    #[error(
        "{file}: dataset {dataset} (58b) has byte order {order} and floating-point format {format}; allowed: byte order 1 (little endian) or 2 (big endian) and format 2 (IEEE 754); export as ASCII or IEEE"
    )]
    FloatFormat {
        /// The file.
        file: String,
        /// The dataset, 1-based.
        dataset: usize,
        /// Byte order as the header has it.
        order: u32,
        /// Floating-point format as the header has it: 1 DEC VMS, 2 IEEE 754, 3 IBM 5/370.
        format: u32,
    },
    /// Text where a number is needed.
    #[error(
        "{file}:{line}: dataset {dataset} holds \"{value}\", which is not a number; allowed: numbers in the columns of dataset 58 or between blanks; export the file again"
    )]
    NotANumber {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// The dataset, 1-based.
        dataset: usize,
        /// Value found.
        value: String,
    },
    /// A line too long to be a row of numbers.
    #[error(
        "{file}:{line}: this line of dataset {dataset} has more than {limit} bytes; allowed: one row of numbers per line; is it a binary dataset with a damaged header?"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// Line, 1-based.
        line: u64,
        /// The dataset, 1-based.
        dataset: usize,
        /// The limit (bytes).
        limit: usize,
    },
    /// No dataset 58 at all.
    #[error(
        "{file}: holds no function (dataset 58), only {found}; allowed: dataset 58 or 58b; export the time series or frequency response functions"
    )]
    NoFunctions {
        /// The file.
        file: String,
        /// Contents of the file.
        found: String,
    },
    /// Functions, but no time series.
    #[error("{file}: holds no time series (function type 1), only {found}; {remedy}")]
    NoTimeSeries {
        /// The file.
        file: String,
        /// Contents of the file.
        found: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// A time series whose header cannot be used as one.
    #[error("{file}: dataset {dataset} ({name}): {problem}; {remedy}")]
    BadTimeSeries {
        /// The file.
        file: String,
        /// The dataset, 1-based.
        dataset: usize,
        /// Its name.
        name: String,
        /// Problem.
        problem: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Times or frequencies that are not evenly spaced.
    #[error(
        "{file}: dataset {dataset}, point {point}: uneven spacing: {} {unit} comes {} {unit} after the point before, the step elsewhere is {} {unit}; allowed: 0.1 % of the step, or what rounding of the printed value explains; export with even spacing",
        short(*.value), short(*.step), short(*.expected)
    )]
    Uneven {
        /// The file.
        file: String,
        /// The dataset, 1-based.
        dataset: usize,
        /// The point, 1-based.
        point: u64,
        /// Abscissa there (s or Hz).
        value: f64,
        /// Step to it (s or Hz).
        step: f64,
        /// Step elsewhere (s or Hz).
        expected: f64,
        /// "s" or "Hz".
        unit: &'static str,
    },
    /// A dataset that is not there or is no function.
    #[error("{file}: there is no function (dataset 58) at place {dataset}; list the datasets")]
    NotAFunction {
        /// The file.
        file: String,
        /// The place asked for, 1-based.
        dataset: usize,
    },
    /// A value that is no number of physical size.
    #[error(
        "{file}: dataset {dataset}, point {point} is {value}; allowed: finite numbers of magnitude up to 1e100; export the file again"
    )]
    NotFinite {
        /// The file.
        file: String,
        /// The dataset, 1-based; when writing, the response.
        dataset: usize,
        /// The point, 1-based.
        point: u64,
        /// The value.
        value: f64,
    },
    /// Fewer or more values than lines.
    #[error(
        "{file}: response {response} has {found} values, the lines are {expected}; give equal numbers"
    )]
    LengthMismatch {
        /// The file.
        file: String,
        /// The response, 1-based.
        response: usize,
        /// Its values.
        found: usize,
        /// The lines.
        expected: usize,
    },
}

/// Error of reading frequency response functions.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// A recording where a response was expected.
    #[error(
        "{file}: is {what}; frequency response functions were expected because `form` is given; remove `form` (and `sensor`) from its [[recording]], or give the file with the responses"
    )]
    TimeSeries {
        /// The file.
        file: String,
        /// Kind of file.
        what: String,
    },
    /// Frequency response functions where a recording was expected.
    #[error(
        "{file}:{line}: the first column is a frequency (\"{column}\"): this is a frequency response function and no time series; in a test description give its [[recording]] form = \"accelerance\" (or \"mobility\", \"receptance\"); without one `tapjoint run FILE` and `tapjoint spectrum FILE` read it"
    )]
    NotTimeSeries {
        /// The file.
        file: String,
        /// Line of the first row, 1-based.
        line: u64,
        /// The column's heading.
        column: String,
    },
    /// No frequency response function.
    #[error(
        "{file}: holds no frequency response function (function type 4), only {found}; export complex responses over force"
    )]
    None {
        /// The file.
        file: String,
        /// Contents of the file.
        found: String,
    },
    /// Frequency response functions that cannot be used.
    #[error(
        "{file}: dataset {dataset} ({name}): {problem}; export complex values on evenly spaced lines"
    )]
    Unusable {
        /// The file.
        file: String,
        /// The dataset, 1-based.
        dataset: usize,
        /// Its place and description.
        name: String,
        /// Problem.
        problem: String,
    },
    /// Columns that are not frequency, real part and imaginary part.
    #[error(
        "{file}:{line}: {problem}; allowed: three columns, frequency (Hz), real part and imaginary part, and coherence as a fourth; export it so"
    )]
    Columns {
        /// The file.
        file: String,
        /// Line of the first row, 1-based.
        line: u64,
        /// Problem.
        problem: String,
    },
    /// Frequencies that are not evenly spaced.
    #[error(
        "{file}:{line}: uneven lines: {} Hz comes {} Hz after the line before, the step elsewhere is {} Hz; allowed: 0.1 % of the step, or what rounding of the printed frequency explains; export evenly spaced lines",
        short(*.frequency), short(*.step), short(*.expected)
    )]
    Uneven {
        /// The file.
        file: String,
        /// Line, 1-based, empty lines not counted.
        line: u64,
        /// Frequency in that line (Hz).
        frequency: f64,
        /// Step to it (Hz).
        step: f64,
        /// Step elsewhere (Hz).
        expected: f64,
    },
}
