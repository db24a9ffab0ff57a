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

mod abscissa;
mod header;
mod list;
mod numbers;
mod time_series;
mod values;

pub use header::{Abscissa, Axis, Function, FunctionType, Ordinate, Point, Precision, UffCoding};
pub use list::{Dataset, UniversalFile, list_datasets};
pub use values::{FunctionValues, read_function};

pub(super) use abscissa::{AbscissaUnit, EvenPoints, FunctionGroup, even_points};
pub(super) use header::{ACCELERATION, DISPLACEMENT, EXCITATION_FORCE, VELOCITY};
pub(super) use list::{Entry, describe};
pub(super) use time_series::{UffCursor, UffSource, open_uff};
pub(super) use values::read_values;
