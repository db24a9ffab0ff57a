//! The readings that took no part in the fit: how far each hypothesis predicts them.

use super::evidence::covariance;
use super::forward::{Forward, Layout};
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::least_squares::Model;
use super::noise;
use super::result::Closure;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Errors of one fit on the withheld frequencies.
#[derive(Debug, Clone)]
pub(super) struct WithheldErrors {
    /// Measured less predicted (%).
    errors: DVector<f64>,
    /// Covariance of these errors if the hypothesis is true (%^2): the withheld readings' own
    /// uncertainty, and that of the prediction.
    spread: DMatrix<f64>,
    /// Standard uncertainties of the readings alone (%).
    stds: DVector<f64>,
}

impl WithheldErrors {
    /// `None` where nothing was withheld, or the hypothesis does not predict it.
    pub(super) fn new(frame: &Frame, fit: &Fit) -> Option<Self> {
        if frame.withheld.is_empty() {
            return None;
        }
        let rows: Vec<Row> = frame.withheld.iter().map(|(row, _)| *row).collect();
        let forward = Forward {
            frame,
            layout: Layout::new(frame, &fit.effects),
            rows: &rows,
        };
        let model = forward.linearise(&fit.branch.optimum.parameters, &fit.branch.knowledge)?;
        let posterior = covariance(&fit.branch.knowledge, &fit.branch.optimum)?;
        let mut spread = 1e4 * &model.slopes * posterior * model.slopes.transpose();
        let mut errors = DVector::zeros(rows.len());
        let readings = frame
            .withheld
            .iter()
            .map(|(_, reading)| 100.0 * reading.std);
        let stds = DVector::from_iterator(rows.len(), readings);
        for (row, (_, reading)) in frame.withheld.iter().enumerate() {
            errors[row] = 100.0 * (reading.value - model.predicted[row]);
            spread[(row, row)] += stds[row].powi(2);
        }
        Some(Self::from_parts(errors, spread, stds))
    }

    /// From errors (%), their covariance (%^2) and the readings' own standard uncertainties (%).
    pub(super) fn from_parts(
        errors: DVector<f64>,
        spread: DMatrix<f64>,
        stds: DVector<f64>,
    ) -> Self {
        WithheldErrors {
            errors,
            spread,
            stds,
        }
    }

    /// Root mean square of the errors (%).
    pub(super) fn rms(&self) -> f64 {
        root_mean_square(&self.errors)
    }

    /// Probability of errors as large or larger if the hypothesis is true.
    pub(super) fn goodness(&self) -> Option<f64> {
        let solved = self.spread.clone().cholesky()?.solve(&self.errors);
        noise::chi_square_tail(self.errors.dot(&solved), self.errors.len() as f64)
    }

    /// Root mean square that the readings' uncertainty alone would leave (%).
    pub(super) fn floor(&self) -> f64 {
        root_mean_square(&self.stds)
    }

    /// The same with what the prediction leaves open (%).
    pub(super) fn reach(&self) -> f64 {
        (self.spread.trace() / self.errors.len() as f64).sqrt()
    }

    /// Whether these readings could show that the other hypothesis, which leaves this gap, is worse.
    pub(super) fn decides(&self, before: &Self) -> bool {
        before.rms() > 2.0 * self.reach()
    }
}

/// Draws of the interval: 2.5 % of 400 is ten draws.
const DRAWS: usize = 400;

/// How far the hypothesis closes the gap that the nominal model leaves, with an interval from draws of
/// what the readings and the fit leave open.
pub(super) fn closure(
    before: &WithheldErrors,
    after: &WithheldErrors,
    seed: u64,
) -> Option<Closure> {
    let floor = after.floor();
    let (gap, rest) = (before.rms(), after.rms());
    if gap < 2.0 * floor {
        return None;
    }
    let share = |before: f64, after: f64| (before - after) / (before - floor * floor);
    let value = share(gap * gap, rest * rest);
    let (reach, root) = (after.reach(), square_root(&after.spread)?);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draws: Vec<f64> = (0..DRAWS)
        .filter_map(|_| {
            let unit = DVector::from_fn(after.errors.len(), |_, _| {
                random.sample::<f64, _>(StandardNormal)
            });
            let moved = &root * unit;
            // The same draw moves both errors; its own square is what it adds on average.
            let square = |errors: &DVector<f64>| {
                let sum = (errors + &moved).norm_squared() / errors.len() as f64;
                (sum - reach * reach).max(0.0)
            };
            let (gap, rest) = (square(&before.errors), square(&after.errors));
            (gap > 0.0).then(|| (1.0 - rest / gap).max(-100.0))
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let at = |share: f64| draws.get((share * draws.len() as f64) as usize).copied();
    Some(Closure {
        value,
        low: at(0.025)?.min(value),
        high: at(0.975)?.max(value),
    })
}

/// R with R R' = S. A covariance may be singular: what is predicted from all others but for one common
/// unknown is certain in some direction, and rounding then makes its eigenvalue negative.
///
/// `None` where it is not finite.
fn square_root(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if covariance.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let eigen = covariance.clone().symmetric_eigen();
    let stds = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    Some(eigen.eigenvectors * DMatrix::from_diagonal(&stds))
}

fn root_mean_square(values: &DVector<f64>) -> f64 {
    (values.norm_squared() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(size: f64, std: f64) -> WithheldErrors {
        let spread = DMatrix::from_diagonal_element(2, 2, std * std);
        WithheldErrors::from_parts(
            DVector::from_element(2, size),
            spread,
            DVector::from_element(2, std),
        )
    }

    /// (0.2^2 - 0.05^2)/(0.2^2 - 0.02^2), and none where the gap is below two floors.
    #[test]
    fn val_closure_by_hand() {
        let found = closure(&errors(0.2, 0.02), &errors(0.05, 0.02), 1).unwrap();
        assert!((found.value - 0.0375 / 0.0396).abs() < 1e-12, "{found:?}");
        assert!(found.low <= found.value && found.value <= found.high);
        assert_eq!(closure(&errors(0.039, 0.02), &errors(0.01, 0.02), 1), None);
    }

    /// A covariance of rank one, and one that rounding has made indefinite.
    #[test]
    fn limit_a_singular_covariance_has_a_root() {
        // The second is one that rounding has made indefinite.
        for least in [0.0, -1e-15] {
            let mut covariance = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]);
            covariance[(1, 1)] += least;
            let root = square_root(&covariance).expect("it is finite");
            // Rounding of numbers of this size.
            assert!((&root * root.transpose() - covariance).amax() < 1e-14);
        }
        assert!(square_root(&DMatrix::from_element(1, 1, f64::NAN)).is_none());
    }
}
