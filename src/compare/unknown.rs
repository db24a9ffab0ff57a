//! Evidence of a change that no cause explains.
//!
//! It changes each mode by itself, or one mode alone, or all modes smoothly with their number. Pairs share it. Its size has
//! a prior of equal weight for each factor.

use crate::likelihood::{self, Data, Factored, log_sum};
use crate::model::Predicted;
use nalgebra::{DMatrix, DVector};

/// Smallest and largest size (1), and the number of sizes between them.
const SIZES: [f64; 2] = [5e-4, 0.1];
const STEPS: usize = 12;
/// Modes over which a smooth change is alike.
const REACH: f64 = 2.0;

/// How a change differs from mode to mode.
#[derive(Clone, Copy)]
enum Shape {
    /// Every mode by itself.
    Each,
    /// Smoothly with the number of the mode.
    Smooth,
    /// This mode alone.
    One(usize),
}

impl Shape {
    /// Correlation of the changes of two modes; 0 without a change.
    fn correlation(self, one: usize, other: usize) -> f64 {
        match self {
            Self::Each => f64::from(u8::from(one == other)),
            Self::Smooth => {
                let apart = one as f64 - other as f64;
                (-0.5 * (apart / REACH).powi(2)).exp()
            }
            Self::One(mode) => f64::from(u8::from(one == mode && other == mode)),
        }
    }
}

/// Returns the logarithm of the evidence of an unknown change.
pub(crate) fn log_evidence(data: &Data<'_>) -> f64 {
    let mut modes: Vec<usize> = data
        .pairs
        .iter()
        .flat_map(|pair| pair.modes.clone())
        .collect();
    modes.sort_unstable();
    modes.dedup();
    let mut shapes = vec![
        (Shape::Each, -(3.0_f64.ln())),
        (Shape::Smooth, -(3.0_f64.ln())),
    ];
    let of_one = -(3.0 * modes.len() as f64).ln();
    shapes.extend(modes.iter().map(|mode| (Shape::One(*mode), of_one)));
    let mut logs = Vec::new();
    for (shape, log_weight) in shapes {
        for step in 0..STEPS {
            let share = step as f64 / (STEPS - 1) as f64;
            let size = SIZES[0] * (SIZES[1] / SIZES[0]).powf(share);
            logs.push(log_weight - (STEPS as f64).ln() + log_density(data, shape, size));
        }
    }
    log_sum(logs.iter().copied())
}

/// Returns the logarithm of the density of all measured changes, for a change of one shape and size.
fn log_density(data: &Data<'_>, shape: Shape, size: f64) -> f64 {
    let modes: Vec<usize> = data
        .pairs
        .iter()
        .flat_map(|pair| pair.modes.clone())
        .collect();
    let measured = data.pairs.iter().flat_map(|pair| pair.measured.clone());
    let measured = DVector::from_iterator(modes.len(), measured);
    let shared = DMatrix::from_fn(modes.len(), modes.len(), |row, column| {
        size * size * shape.correlation(modes[row], modes[column])
    });
    let logs: Vec<f64> = (data.scatters.iter().zip(&data.errors))
        .map(|(scatter, errors)| {
            let mut covariance = shared.clone();
            let mut first = 0;
            for (pair, errors) in data.pairs.iter().zip(errors) {
                let own = likelihood::covariance(pair, errors, &Predicted::nothing(pair));
                let count = pair.modes.len();
                let mut block = covariance.view_mut((first, first), (count, count));
                block += own;
                first += count;
            }
            let own = Factored::new(covariance);
            scatter.log_weight + own.map_or(f64::NEG_INFINITY, |own| own.log_density(&measured))
        })
        .collect();
    log_sum(logs.iter().copied())
}
