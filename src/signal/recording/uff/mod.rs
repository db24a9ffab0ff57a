//! Universal files: the functions (datasets 58 and 58b) of analysers and recorders.
//!
//! A universal file is a row of datasets between lines of their own that hold `    -1`. A dataset 58
//! has eleven header records in fixed columns and then its values, as text in fixed columns or, as
//! 58b, as IEEE numbers. Source: the descriptions of universal datasets by the Structural Dynamics
//! Research Laboratory, University of Cincinnati (dataset 58, with addendum on units, and 164).
//!
//! Important conventions:
//! - The number of values is what record 7 says; what stands behind them is padding. A record 7 that
//!   promises more than the file holds is not believed: values are read as far as they go.
//! - The abscissa of uneven 58b data is single precision whatever the ordinate is (12 bytes a point
//!   in case 6, 20 in case 8). Files with a double precision abscissa exist; their length tells.
//! - Axis labels win over the file's unit system (dataset 164), which wins over no unit.
//! - Dataset numbers are 1-based and count every dataset of the file, whatever its type.
//!
//! [`list_datasets`] reads headers only and jumps over the values. Values are read in blocks. Of text
//! the first 16 million samples are kept in memory; beyond, it is parsed again whenever it is asked
//! for, from places remembered every 64 kB. No file has to fit into memory.

use std::fs::File;
use std::path::Path;

use super::RecordingError;
use super::riff::{read_fully, unreadable};

mod ascii;
mod axis;
mod error;
mod header;
mod list;
mod read;
mod records;
mod scan;
mod source;
mod time;
mod timing;
mod values;
mod write;

pub use axis::Axis;
pub use error::UffError;
pub use header::{Abscissa, Function, FunctionType, Ordinate, Point, Precision, UffCoding};
pub use list::{Dataset, UniversalFile, list_datasets};
pub use read::{FunctionValues, read_function};
pub use write::{UffFormat, encode_frequency_responses_uff};

pub(super) use axis::{
    ACCELERATION, DISPLACEMENT, EXCITATION_FORCE, UnitSystem, VELOCITY, label_unit,
};
pub(super) use list::describe;
pub(super) use read::read_values;
pub(super) use source::{UffCursor, UffSource};
pub(super) use time::open_uff;
pub(super) use timing::{AbscissaUnit, EvenPoints, even_points, largest_group};

/// Whether a file is a universal file, by its first bytes.
///
/// # Errors
/// A file that cannot be read.
pub fn is_universal_file(path: &Path) -> Result<bool, RecordingError> {
    let file = path.display().to_string();
    let mut head = vec![0_u8; 4096];
    let got = File::open(path)
        .and_then(|mut opened| read_fully(&mut opened, &mut head))
        .map_err(|source| unreadable(&file, source))?;
    head.truncate(got);
    Ok(is_universal(&head))
}

/// Whether a file begins like a universal file: -1 in columns 5 and 6 of a line of its own.
pub(super) fn is_universal(head: &[u8]) -> bool {
    let mut lines = head
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::trim_ascii_end);
    lines.find(|line| !line.is_empty()) == Some(b"    -1")
}
