//! From spectra to natural frequencies, each with the bound of its reading.
//!
//! Peaks are found on a composite level over all sensors ([`find_peaks`]), read between the lines by
//! a pole ([`interpolate_pole`]) and on the line nearest to that, with the half-line bound
//! ([`read_peaks`]). Mains lines are recognised, and the readings of several recordings are merged
//! ([`merge_modes`]). Peaks that a nonlinear joint makes of others are labelled ([`label_combinations`]).
//!
//! [`polyreference`] finds the poles of a whole band from several responses at once, also where two
//! modes show as one peak. [`fit`] refines poles to the greatest likelihood and says how well they are known.
//! [`amplitude`] follows frequency and damping along a decay. [`synthesis`] shows what given poles explain of
//! measured functions.

pub mod amplitude;
mod combinations;
pub mod fit;
mod magnitude;
mod mains;
mod peaks;
pub mod polyreference;
mod reading;
mod strength;
pub mod synthesis;

pub use combinations::label_combinations;
pub use magnitude::{interpolate_magnitude, read_magnitude_peaks};
pub use mains::{
    GRIDS, GridFrequency, LineAmplitudes, MainsSettings, label_steady_lines, near_mains,
};
pub use peaks::{CompositeLevel, Peak, PeakSettings, find_peaks, noise_of_function};
pub use reading::{
    BandReadings, Combination, FittedReading, Interpolation, MergedMode, ModeReading,
    NoInterpolation, PeakLabel, ReadBy, interpolate_parabola, interpolate_pole, merge_modes,
    read_peaks,
};
pub use strength::{set_strengths, strengths_of};

use nalgebra::allocator::Allocator;
use nalgebra::{ComplexField, DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix};

/// Writes a number that counts from 0 as one that counts from 1.
fn from_one<S: serde::Serializer>(index: &usize, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_u64(*index as u64 + 1)
}

/// The space that some columns span, as orthonormal columns: a linear least-squares fit projects it out.
#[derive(Debug, Clone)]
struct Subspace<T> {
    columns: DMatrix<T>,
}

/// Rows that products of tall matrices take at once. 1024: as many of four columns fill the cache nearest to a core, and a
/// pole has two.
const ROWS_AT_ONCE: usize = 1024;

/// Returns left' right of tall matrices.
fn products<T, C: Dim>(left: &DMatrix<T>, right: &OMatrix<T, Dyn, C>) -> OMatrix<T, Dyn, C>
where
    T: ComplexField<RealField = f64>,
    DefaultAllocator: Allocator<Dyn, C>,
{
    let columns = right.shape_generic().1;
    let mut sums = OMatrix::zeros_generic(Dyn(left.ncols()), columns);
    for first in (0..left.nrows()).step_by(ROWS_AT_ONCE) {
        let rows = ROWS_AT_ONCE.min(left.nrows() - first);
        let (left, right) = (left.rows(first, rows), right.rows(first, rows));
        sums.gemm_ad(T::one(), &left, &right, T::one());
    }
    sums
}

impl<T: ComplexField<RealField = f64>> Subspace<T> {
    /// Orthonormalises columns by Gram and Schmidt's method. A column is left out where less than the share
    /// `distinct` of its length lies outside the columns before it.
    fn new(raw: &DMatrix<T>, distinct: f64) -> Self {
        Self::none(raw.nrows()).added(raw, distinct)
    }

    /// Returns an empty space of columns with so many rows.
    fn none(rows: usize) -> Self {
        Subspace {
            columns: DMatrix::zeros(rows, 0),
        }
    }

    /// Returns the space that this and another span, whose columns are orthogonal to this one's.
    fn with(&self, other: &Self) -> Self {
        let (own, all) = (self.rank(), self.rank() + other.rank());
        let mut columns = self.columns.clone().resize_horizontally(all, T::zero());
        columns
            .columns_mut(own, other.rank())
            .copy_from(&other.columns);
        Subspace { columns }
    }

    /// Returns the part of the span of `raw` that this space lacks; `distinct` is as in [`new`](Self::new).
    fn added(&self, raw: &DMatrix<T>, distinct: f64) -> Self {
        let mut kept: Vec<DVector<T>> = Vec::new();
        for column in raw.column_iter() {
            let length = column.norm();
            if length.is_nan() || length <= 0.0 {
                continue;
            }
            let mut rest = column.unscale(length);
            // The second pass removes the rounding of nearly dependent columns.
            for _ in 0..2 {
                rest = self.complement(rest);
                for other in &kept {
                    let share = other.dotc(&rest);
                    rest.axpy(-share, other, T::one());
                }
            }
            let remains = rest.norm();
            if remains > distinct && self.rank() + kept.len() + 1 < raw.nrows() {
                kept.push(rest.unscale(remains));
            }
        }
        let columns = DMatrix::from_fn(raw.nrows(), kept.len(), |row, k| kept[k][row].clone());
        Subspace { columns }
    }

    /// Number of independent columns.
    fn rank(&self) -> usize {
        self.columns.ncols()
    }

    /// Returns columns without their projections on the space.
    fn complement<C: Dim>(&self, mut columns: OMatrix<T, Dyn, C>) -> OMatrix<T, Dyn, C>
    where
        DefaultAllocator: Allocator<Dyn, C>,
    {
        if self.rank() > 0 {
            let shares = products(&self.columns, &columns);
            columns.gemm(-T::one(), &self.columns, &shares, T::one());
        }
        columns
    }
}
