//! Cholesky's factor of a symmetric matrix that keeps its zeros.
//!
//! Unknowns that know of few others are eliminated first. Of the parameters of many recordings each knows those of its own
//! recording and some common ones: their elimination changes few columns.

use nalgebra::{DMatrix, DVectorView};

/// Number of unknowns up to which an order of their own costs more than it saves.
const FEW: usize = 64;

/// Factor L of a positive definite matrix A = L L', with its unknowns in an order of its own.
pub struct Cholesky {
    /// Unknowns in the order of elimination.
    order: Vec<usize>,
    /// L below and on the diagonal. What stands above is of no use.
    lower: DMatrix<f64>,
}

impl Cholesky {
    /// Returns the factor; `None` where the matrix is not positive definite.
    pub fn new(matrix: &DMatrix<f64>) -> Option<Self> {
        let size = matrix.nrows();
        let mut order: Vec<usize> = (0..size).collect();
        let mut lower = matrix.clone();
        if size > FEW {
            let known = matrix.column_iter();
            let known: Vec<usize> = known
                .map(|column| column.iter().filter(|entry| **entry != 0.0).count())
                .collect();
            order.sort_by_key(|k| known[*k]);
            for (step, &k) in order.iter().enumerate() {
                let (from, mut to) = (matrix.column(k), lower.column_mut(step));
                for row in step..size {
                    to[row] = from[order[row]];
                }
            }
        }
        let entries = lower.as_mut_slice();
        for step in 0..size {
            let (before, behind) = entries.split_at_mut((step + 1) * size);
            let own = &mut before[step * size + step..];
            if own[0].is_nan() || own[0] <= 0.0 {
                return None;
            }
            own[0] = own[0].sqrt();
            let root = own[0];
            own[1..].iter_mut().for_each(|entry| *entry /= root);
            for (index, other) in behind.chunks_exact_mut(size).enumerate() {
                let below = &own[index + 1..];
                if below[0] != 0.0 {
                    subtract(&mut other[step + index + 1..], below[0], below);
                }
            }
        }
        Some(Self { order, lower })
    }

    /// Column of L from its diagonal.
    fn column(&self, step: usize) -> &[f64] {
        let size = self.order.len();
        &self.lower.as_slice()[step * size + step..(step + 1) * size]
    }

    /// Replaces b, in the order of elimination, by the solution of L y = b.
    fn solve_lower(&self, right: &mut [f64]) {
        for step in 0..right.len() {
            if right[step] != 0.0 {
                let own = self.column(step);
                right[step] /= own[0];
                let value = right[step];
                subtract(&mut right[step + 1..], value, &own[1..]);
            }
        }
    }

    /// Replaces the right-hand side b by the solution of A x = b.
    pub fn solve(&self, right: &mut [f64]) {
        let mut ordered: Vec<f64> = self.order.iter().map(|k| right[*k]).collect();
        self.solve_lower(&mut ordered);
        for step in (0..ordered.len()).rev() {
            let own = self.column(step);
            let known = dot(&own[1..], &ordered[step + 1..]);
            ordered[step] = (ordered[step] - known) / own[0];
        }
        for (k, value) in self.order.iter().zip(ordered) {
            right[*k] = value;
        }
    }

    /// Returns the k-th entry on the diagonal of the inverse of A.
    pub fn variance(&self, k: usize) -> f64 {
        let unit = self.order.iter().map(|own| f64::from(u8::from(*own == k)));
        let mut unit: Vec<f64> = unit.collect();
        self.solve_lower(&mut unit);
        dot(&unit, &unit)
    }

    /// Returns the inverse of A.
    pub fn inverse(&self) -> DMatrix<f64> {
        let size = self.order.len();
        let mut inverse = DMatrix::identity(size, size);
        for mut column in inverse.column_iter_mut() {
            self.solve(column.as_mut_slice());
        }
        inverse
    }

    /// Returns ln det A.
    pub fn log_determinant(&self) -> f64 {
        2.0 * self
            .lower
            .diagonal()
            .iter()
            .map(|root| root.ln())
            .sum::<f64>()
    }
}

/// Subtracts a multiple of other values.
fn subtract(values: &mut [f64], factor: f64, others: &[f64]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value -= factor * other;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let [a, b] = [a, b].map(|values| DVectorView::from_slice(values, values.len()));
    a.dot(&b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three shared unknowns, then groups of three that know nothing of each other.
    fn arrow(groups: usize) -> DMatrix<f64> {
        let size = 3 * (groups + 1);
        DMatrix::from_fn(size, size, |row, column| {
            match (row.min(column), row.max(column)) {
                (a, b) if a == b => (4 * groups) as f64 + a as f64,
                (a, b) if a < 3 || a / 3 == b / 3 => 0.1 * (1 + (a * b) % 7) as f64,
                _ => 0.0,
            }
        })
    }

    #[test]
    fn val_determinant_solution_and_inverse_are_those_of_the_dense_factor() {
        for groups in [3, 30] {
            let dense = arrow(groups).cholesky().unwrap();
            let own = Cholesky::new(&arrow(groups)).unwrap();
            let logs = dense.l().diagonal().map(f64::ln);
            let apart = own.log_determinant() / (2.0 * logs.sum()) - 1.0;
            assert!(apart.abs() < 1e-14, "{apart}");
            assert!((own.inverse() - dense.inverse()).amax() < 1e-15);
            assert!((own.variance(4) - dense.inverse()[(4, 4)]).abs() < 1e-15);
        }
    }

    #[test]
    fn prop_unknowns_of_separate_groups_stay_separate() {
        let groups = 30;
        let own = Cholesky::new(&arrow(groups)).unwrap();
        let below = (0..3 * (groups + 1)).flat_map(|step| &own.column(step)[1..]);
        // Of each group 3 entries among its own unknowns and 9 to the shared ones, and 3 among these.
        assert_eq!(
            below.filter(|entry| **entry != 0.0).count(),
            groups * 12 + 3
        );
    }

    #[test]
    fn limit_an_indefinite_matrix_has_no_factor() {
        assert!(Cholesky::new(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0])).is_none());
        assert!(Cholesky::new(&DMatrix::from_element(1, 1, f64::NAN)).is_none());
    }
}
