//! One function with its values, as the file has them.

use super::error::UffError;
use super::header::{Abscissa, Function, Ordinate};
use super::list::{Dataset, UniversalFile};
use super::values::Values;
use crate::recording::RecordingError;

/// Numbers asked for at a time.
const BLOCK_NUMBERS: u64 = 1 << 16;

/// The values of a function in file units.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionValues {
    /// The stored abscissa; `None` where it is even and only its start and step are stored.
    pub abscissa: Option<Vec<f64>>,
    /// The ordinate, its real part where it is complex.
    pub real: Vec<f64>,
    /// Its imaginary part; `None` where it is real.
    pub imaginary: Option<Vec<f64>>,
    /// Points that the header promises; there may be fewer in a truncated file.
    pub promised: u64,
}

/// Reads the values of the dataset at place `number` (1-based): as many points as the header
/// promises, or as many as there are. Meant for functions that fit into memory; long time series
/// are read in blocks by [`Recording`](crate::recording::Recording).
///
/// # Errors
/// No function at that place; text where a number is needed; a file that can no longer be read.
pub fn read_function(
    file: &UniversalFile,
    number: usize,
) -> Result<FunctionValues, RecordingError> {
    let found = file
        .functions()
        .find(|(dataset, _)| dataset.number == number);
    let (dataset, function) = found.ok_or_else(|| UffError::NotAFunction {
        file: file.name.clone(),
        dataset: number,
    })?;
    read_values(file, dataset, function)
}

pub(in crate::recording) fn read_values(
    file: &UniversalFile,
    dataset: &Dataset,
    function: &Function,
) -> Result<FunctionValues, RecordingError> {
    let values = Values::new(file, dataset, function)?;
    let mut opened = values.open()?;
    let mut reader = values.reader(0, &mut opened)?;
    let mut numbers = Vec::new();
    let (mut abscissa, mut real, mut imaginary) = (Vec::new(), Vec::new(), Vec::new());
    let uneven = function.abscissa == Abscissa::Uneven;
    let complex = function.ordinate == Ordinate::Complex;
    loop {
        let got = reader.next(&mut opened, BLOCK_NUMBERS, &mut numbers)?;
        let (width, ordinate) = (values.numbers, values.ordinate);
        let points = numbers.chunks_exact(width);
        let rest = points.remainder().len();
        for point in points {
            if uneven {
                abscissa.extend(point.first());
            }
            real.extend(point.get(ordinate));
            if complex {
                imaginary.extend(point.get(ordinate + 1));
            }
        }
        // A point that is cut by the block's end waits for its other numbers.
        let done = numbers.len() - rest;
        numbers.drain(..done);
        if got == 0 {
            break;
        }
    }
    Ok(FunctionValues {
        abscissa: uneven.then_some(abscissa),
        real,
        imaginary: complex.then_some(imaginary),
        promised: function.points,
    })
}
