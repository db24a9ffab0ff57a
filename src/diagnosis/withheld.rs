//! The readings that took no part in the fit: how far each hypothesis predicts them.

use super::evidence::{covariance, log_sum};
use super::forward::{Forward, Layout};
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::knowledge::with_drift;
use super::least_squares::{Model, maximise};
use super::noise::{self, Reading};
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

/// Probability of errors on the withheld frequencies as large or larger if the hypothesis is true; `None` where nothing
/// was withheld, or the hypothesis does not predict it.
///
/// What `refutes` it by the prediction linearised about the fit is tried once more without that, and with every spread
/// of the joint's drift, as probable as the fit has left it: the most probable one is not the only one, and a drift
/// multiplies an effect at the joint.
pub(super) fn goodness(frame: &Frame, fit: &Fit, refutes: impl Fn(f64) -> bool) -> Option<f64> {
    let linearised = WithheldErrors::new(frame, fit)?.goodness()?;
    if !refutes(linearised) {
        return Some(linearised);
    }
    let logs: Vec<f64> = fit.branch.drifts.iter().map(|drift| drift.1).collect();
    let all = log_sum(&logs);
    let of_drift = |&(drift, log): &(f64, f64)| {
        let weight = (log - all).exp();
        // What weighs so little cannot keep it from being refuted.
        let counts = weight.is_finite() && !refutes(weight);
        let found = counts.then(|| goodness_together(frame, fit, drift));
        weight * found.flatten().unwrap_or(0.0)
    };
    let bent: f64 = fit.branch.drifts.iter().map(of_drift).sum();
    Some(linearised.max(bent))
}

/// The probability of what the withheld readings add to the misfit when the same parameters have to explain them as
/// well, with this spread of the joint's drift.
///
/// Twice the growth is chi square of as many degrees of freedom as there are readings; of a linear model it is the
/// quadratic form of [`WithheldErrors::goodness`].
fn goodness_together(frame: &Frame, fit: &Fit, drift: f64) -> Option<f64> {
    let layout = Layout::new(frame, &fit.effects);
    let known = with_drift(frame, &layout, &fit.branch.knowledge, drift);
    let (more, stated): (Vec<Row>, Vec<Reading>) = frame.withheld.iter().copied().unzip();
    // As the linearised prediction takes them.
    let normal = stated.iter().map(|reading| Reading {
        freedom: f64::INFINITY,
        ..*reading
    });
    let readings: Vec<Reading> = frame.readings.iter().copied().chain(normal).collect();
    let rows = [&frame.rows[..], &more].concat();
    let least = |readings: &[Reading], rows: &[Row], start: &[f64]| {
        let layout = layout.clone();
        let forward = Forward {
            frame,
            layout,
            rows,
        };
        maximise(readings, &known, start, &forward)
    };
    let own = least(&frame.readings, &frame.rows, &fit.branch.optimum.parameters)?;
    let both = least(&readings, &rows, &own.parameters)?;
    let grown = 2.0 * (both.objective - own.objective).max(0.0);
    noise::chi_square_tail(grown, stated.len() as f64)
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
    use super::super::example::fitted;
    use super::super::hypothesis::fit_nominal;
    use super::super::settings::GapSettings;
    use super::super::small_unknowns::Small;
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

    /// Within what readings of 0.005 % leave open the structure is as good as linear: both probabilities are then the
    /// same.
    #[test]
    fn limit_near_the_fit_the_misfit_grows_as_the_linearised_errors_say() {
        let (mut frame, _) = fitted();
        // Student's t gives way where it is pulled, which no linear model does.
        for reading in &mut frame.readings {
            reading.freedom = f64::INFINITY;
        }
        let fit = fit_nominal(&frame, &GapSettings::default()).unwrap();
        for (k, (_, reading)) in frame.withheld.iter_mut().enumerate() {
            reading.value += [3.0, -2.0][k % 2] * reading.std;
        }
        let linearised = WithheldErrors::new(&frame, &fit).unwrap().goodness();
        let linearised = linearised.unwrap();
        let together = goodness_together(&frame, &fit, drift_of(&frame, &fit)).unwrap();
        // Curvature over 1e-4 is a share of 1e-4 of the slopes; the search ends 1e-4 from the optimum.
        assert!(
            (together / linearised - 1.0).abs() < 2e-3,
            "{together} {linearised}"
        );
        assert!(linearised < 0.05, "{linearised}: the errors are not small");
        assert_eq!(goodness(&frame, &fit, |_| false), Some(linearised));
    }

    /// The drift's standard deviation in a fit.
    fn drift_of(frame: &Frame, fit: &Fit) -> f64 {
        let is_drift = |small: &Small| matches!(small, Small::Drift { .. });
        let first = frame.smalls.iter().position(is_drift).unwrap();
        let smalls = Layout::new(frame, &fit.effects).smalls();
        fit.branch.knowledge[smalls + first].std
    }

    /// What only a joint that drifts by more explains is refuted as long as it is known to drift by less.
    #[test]
    fn regress_a_drift_that_is_as_probable_keeps_an_explanation_from_being_refuted() {
        let (mut frame, _) = fitted();
        // Readings so poor that they say nothing of the drift, and nothing else that could move the withheld ones.
        for reading in &mut frame.readings {
            reading.std *= 1e3;
        }
        let is_drift = |small: &Small| matches!(small, Small::Drift { .. });
        let others = frame.smalls.iter().zip(&mut frame.small_stds);
        for (_, std) in others.filter(|(small, _)| !is_drift(small)) {
            *std = 1e-9;
        }
        let settings = GapSettings {
            drift_stds: vec![0.002],
            ..GapSettings::default()
        };
        let mut fit = fit_nominal(&frame, &settings).unwrap();
        let refutes = |p: f64| p < 1e-3;
        let errors = WithheldErrors::new(&frame, &fit).unwrap().errors;
        // Ten times what the smaller drift moves mode 6 by, against each other in both recordings.
        let layout = Layout::new(&frame, &[]);
        let first = layout.smalls();
        let rows: Vec<Row> = frame.withheld.iter().map(|one| one.0).collect();
        let forward = Forward {
            frame: &frame,
            layout,
            rows: &rows,
        };
        let at = &fit.branch.optimum.parameters;
        let slopes = forward.linearise(at, &fit.branch.knowledge).unwrap().slopes;
        let drifts = (0..frame.smalls.len()).filter(|k| is_drift(&frame.smalls[*k]));
        let by_drift = drifts
            .map(|k| slopes.column(first + k).amax())
            .fold(0.0, f64::max);
        for (k, (_, reading)) in frame.withheld.iter_mut().enumerate() {
            let away = 10.0 * 0.002 * by_drift * [1.0, -1.0][k % 2];
            reading.value += away - errors[k] / 100.0;
            reading.std = 1e-3 * by_drift * 0.002;
        }
        let known = goodness(&frame, &fit, refutes).unwrap();
        fit.branch.drifts = vec![(0.002, 0.0), (0.05, 0.0)];
        let open = goodness(&frame, &fit, refutes).unwrap();
        assert!(refutes(known) && !refutes(open), "{known} {open}");
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
