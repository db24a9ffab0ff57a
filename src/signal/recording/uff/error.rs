//! What can be wrong with a universal file.

use crate::recording::text::short;

/// Why a universal file cannot be read or written.
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
        /// What the field means.
        field: &'static str,
        /// What stands there.
        value: String,
        /// What is allowed.
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
        /// What stands there.
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
        /// What there is.
        found: String,
    },
    /// Functions, but no time series.
    #[error("{file}: holds no time series (function type 1), only {found}; {remedy}")]
    NoTimeSeries {
        /// The file.
        file: String,
        /// What there is.
        found: String,
        /// What to do.
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
        /// What is wrong.
        problem: String,
        /// What to do.
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
