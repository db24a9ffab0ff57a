//! What can be wrong with a file of frequency response functions.

use crate::recording::text::short;

/// Why a file gives no frequency response functions.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// A recording where a response was expected.
    #[error(
        "{file}: is {what}; frequency response functions were expected because `form` is given; remove `form` (and `sensor`) from its [[recording]], or give the file with the responses"
    )]
    TimeSeries {
        /// The file.
        file: String,
        /// What it is.
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
        /// What there is.
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
        /// What is wrong.
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
        /// What is there instead.
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

/// A doubt about frequency response functions that does not keep them from being used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ResponseWarning {
    /// A dataset that is not among the responses.
    #[error(
        "dataset {dataset} ({name}) is left out: {reason}; export it to a file of its own if it is needed"
    )]
    LeftOut {
        /// The dataset, 1-based.
        dataset: usize,
        /// Its place and description.
        name: String,
        /// Why.
        reason: String,
    },
    /// The file ends before the header says.
    #[error(
        "the file is truncated: {present} of the promised {promised} lines are there; an export or a copy was probably interrupted; what is there is used"
    )]
    Truncated {
        /// Lines in the file.
        present: u64,
        /// Lines by the header.
        promised: u64,
    },
    /// A universal file that ends within a header.
    #[error(
        "the file ends within the header of dataset {dataset}, which is left out; a copy was probably interrupted; export or copy it again"
    )]
    HeaderCut {
        /// The dataset, 1-based.
        dataset: usize,
    },
    /// A unit that is not known.
    #[error(
        "{name}: the unit \"{unit}\" is not known; the numbers are taken as they stand, in SI units; check the level"
    )]
    UnknownUnit {
        /// The response.
        name: String,
        /// The unit as written.
        unit: String,
    },
    /// Axis types and unit that contradict each other.
    #[error(
        "{name}: the types of its axes make it {by_axes}, its unit \"{unit}\" makes it {by_unit}; it is taken as {by_axes}; say which it is with `form`"
    )]
    FormsDisagree {
        /// The response.
        name: String,
        /// The unit as written.
        unit: String,
        /// Form by the axes' types.
        by_axes: &'static str,
        /// Form by the unit.
        by_unit: &'static str,
    },
}

impl ResponseWarning {
    /// Short name of the kind of doubt, for reports.
    pub fn code(&self) -> &'static str {
        match self {
            Self::LeftOut { .. } => "dataset-left-out",
            Self::Truncated { .. } => "truncated",
            Self::HeaderCut { .. } => "header-cut",
            Self::UnknownUnit { .. } => "unknown-unit",
            Self::FormsDisagree { .. } => "forms-disagree",
        }
    }
}
