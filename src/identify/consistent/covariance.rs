//! First-order uncertainty: covariance, leverage and what a direction is worth.

use super::least_squares::{dot, triangularise};
use super::model::Point;
use super::problem::Evaluation;

/// Beyond this standard deviation (1, in logarithms) nothing at all is known of a parameter.
pub(super) const NOTHING_KNOWN: f64 = 1e3;

/// Covariance of the free coordinates, spread over all of them (zero for those held).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Covariance {
    /// Rows of R^-1 for each free direction, so that the covariance is their product.
    inverse: Vec<Vec<f64>>,
    directions: Vec<Point>,
}

impl Covariance {
    /// (J^T J)^-1 along these directions, by way of the triangle of J with its columns scaled to
    /// 1. A column of zeros counts as one of a billionth of the largest: nothing known.
    pub(super) fn new(jacobian: &[Point], directions: &[Point]) -> Self {
        let n = directions.len();
        let mut rows = Vec::with_capacity(jacobian.len() * n);
        for slopes in jacobian {
            rows.extend(directions.iter().map(|direction| dot(slopes, direction)));
        }
        let norm = |column: usize| -> f64 {
            let squares = rows.iter().skip(column).step_by(n);
            squares.map(|x| x * x).sum::<f64>().sqrt()
        };
        let norms: Vec<f64> = (0..n).map(norm).collect();
        let largest = norms.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
        let scales: Vec<f64> = norms.iter().map(|norm| norm.max(1e-9 * largest)).collect();
        for row in rows.chunks_mut(n.max(1)) {
            for (entry, scale) in row.iter_mut().zip(&scales) {
                *entry /= scale;
            }
        }
        // Weak knowledge of everything keeps the triangle regular without a visible change.
        for column in 0..n {
            let start = rows.len();
            rows.resize(start + n, 0.0);
            rows[start + column] = 1e-10;
        }
        if n > 0 {
            triangularise(&mut rows, n);
        }
        Self {
            inverse: inverse_of_triangle(&rows, &scales),
            directions: directions.to_vec(),
        }
    }

    pub(super) fn of(at: &Evaluation, directions: &[Point]) -> Self {
        Self::new(&at.jacobian, directions)
    }

    /// g^T C for a linear function with gradient g, in the coordinates in which C is 1.
    fn components(&self, gradient: &Point) -> Vec<f64> {
        let n = self.directions.len();
        (0..n)
            .map(|column| {
                self.directions
                    .iter()
                    .zip(&self.inverse)
                    .map(|(direction, row)| dot(gradient, direction) * row[column])
                    .sum()
            })
            .collect()
    }

    /// Covariance of two linear functions of the point.
    pub(super) fn between(&self, first: &Point, second: &Point) -> f64 {
        let (a, b) = (self.components(first), self.components(second));
        a.iter().zip(&b).map(|(a, b)| a * b).sum()
    }

    /// Standard deviation of a linear function of the point; `None` where nothing is known of it.
    pub(super) fn std(&self, gradient: &Point) -> Option<f64> {
        let std = self.between(gradient, gradient).sqrt();
        (std < NOTHING_KNOWN).then_some(std)
    }

    /// The same, however large it is.
    pub(super) fn std_or_infinite(&self, gradient: &Point) -> f64 {
        self.between(gradient, gradient).sqrt()
    }

    /// How much of each residual's freedom the fit takes: the diagonal of J (J^T J)^-1 J^T.
    pub(super) fn leverages(&self, jacobian: &[Point]) -> Vec<f64> {
        jacobian
            .iter()
            .map(|slopes| self.between(slopes, slopes))
            .collect()
    }

    /// Variance of `gradient` when one more residual of these slopes is known:
    /// C - C j j^T C/(1 + j^T C j).
    pub(super) fn variance_with(&self, gradient: &Point, slopes: &Point) -> f64 {
        let shared = self.between(gradient, slopes);
        self.between(gradient, gradient) - shared * shared / (1.0 + self.between(slopes, slopes))
    }
}

/// Rows of D^-1 R^-1 for the scaled triangle R, from the last row up: row i of R^-1 is that of the
/// unit matrix less the rows below it times row i of R, over the diagonal.
fn inverse_of_triangle(rows: &[f64], scales: &[f64]) -> Vec<Vec<f64>> {
    let n = scales.len();
    let mut inverse: Vec<Vec<f64>> = vec![Vec::new(); n];
    for row in (0..n).rev() {
        let mut found = vec![0.0; n];
        found[row] = 1.0;
        for (below, known) in inverse.iter().enumerate().skip(row + 1) {
            let factor = rows[row * n + below];
            for (entry, known) in found.iter_mut().zip(known) {
                *entry -= factor * known;
            }
        }
        for entry in &mut found {
            *entry /= rows[row * n + row];
        }
        inverse[row] = found;
    }
    for (row, scale) in inverse.iter_mut().zip(scales) {
        for entry in row {
            *entry /= scale;
        }
    }
    inverse
}
