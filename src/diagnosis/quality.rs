//! How well a fit explains the readings: overall, by block, mode by mode, and with each mode left out.

use super::evidence::covariance;
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::noise;
use super::result::{Block, Misfit, Pull};
use super::small_unknowns::Small;
use nalgebra::{DMatrix, DVector};

/// Residuals of a fit and how they hang together.
pub(super) struct Residuals {
    /// Reading less prediction, natural units.
    pub(super) raw: Vec<f64>,
    /// In standard deviations, as normal deviates.
    pub(super) unit: DVector<f64>,
    /// Standard deviations with which the fit weighted the readings, natural units: outlying readings have
    /// larger ones than their own.
    pub(super) weighted_stds: DVector<f64>,
    /// Their covariance if the hypothesis is true: I - H, H being the influence of each reading on
    /// each prediction.
    pub(super) spread: DMatrix<f64>,
    /// What the priors add to chi square.
    prior: f64,
    /// Parameters on which the priors have no hold.
    wide: usize,
}

impl Residuals {
    pub(super) fn new(frame: &Frame, fit: &Fit) -> Option<Self> {
        let optimum = &fit.branch.optimum;
        let count = frame.readings.len();
        let mut raw = Vec::with_capacity(count);
        let mut unit = DVector::zeros(count);
        let mut weighted_stds = DVector::zeros(count);
        let mut influence = optimum.model.slopes.clone();
        for (row, reading) in frame.readings.iter().enumerate() {
            let residual = reading.value - optimum.model.predicted[row];
            raw.push(residual);
            let own = residual / reading.std;
            unit[row] = noise::gaussian_square(own, reading.freedom)
                .sqrt()
                .copysign(own);
            weighted_stds[row] = reading.std / noise::weight(own, reading.freedom).sqrt();
            influence.row_mut(row).scale_mut(1.0 / weighted_stds[row]);
        }
        let known = &fit.branch.knowledge;
        let posterior = covariance(known, optimum)?;
        let spread =
            DMatrix::identity(count, count) - &influence * posterior * influence.transpose();
        let smalls = known.len() - frame.smalls.len();
        let prior = (0..frame.smalls.len())
            .map(|k| {
                let known = &known[smalls + k];
                ((optimum.parameters[smalls + k] - known.centre) / known.std).powi(2)
            })
            .sum();
        let damping = usize::from(frame.small_index(Small::Damping).is_some());
        let free = known[..smalls]
            .iter()
            .filter(|known| known.low < known.high)
            .count();
        Some(Residuals {
            raw,
            unit,
            weighted_stds,
            spread,
            prior,
            wide: free + damping,
        })
    }

    /// Probability of a chi square as large or larger, all readings and priors together.
    pub(super) fn goodness(&self) -> Option<f64> {
        let misfit = self.misfit();
        noise::chi_square_tail(misfit.chi_square, misfit.freedom)
    }

    pub(super) fn misfit(&self) -> Misfit {
        Misfit {
            chi_square: self.unit.norm_squared() + self.prior,
            freedom: self.unit.len() as f64 - self.wide as f64,
        }
    }

    /// The same of some rows alone. Their sum of squares is taken as g chi2_n with the mean tr B and the
    /// variance 2 tr B^2 that their covariance B gives it (Satterthwaite).
    fn goodness_of(&self, rows: &[usize]) -> Option<f64> {
        let block = self.spread.select_rows(rows).select_columns(rows);
        let (mean, square) = (block.trace(), (&block * &block).trace());
        // Readings that the parameters follow almost exactly say nothing.
        if mean < 0.3 {
            return None;
        }
        let sum: f64 = rows.iter().map(|&row| self.unit[row].powi(2)).sum();
        noise::chi_square_tail(sum * mean / square, (mean * mean / square).max(0.5))
    }

    /// All blocks whose readings are more than the parameters that follow them, the worst first.
    pub(super) fn blocks(&self, frame: &Frame) -> Vec<Block> {
        let mut blocks: Vec<Block> = block_rows(frame)
            .into_iter()
            .filter_map(|(name, rows)| {
                Some(Block {
                    name,
                    goodness_of_fit: self.goodness_of(&rows)?,
                })
            })
            .collect();
        blocks.sort_by(|a, b| a.goodness_of_fit.total_cmp(&b.goodness_of_fit));
        blocks
    }

    /// Root mean square of the frequencies' errors (%).
    pub(super) fn frequency_rms(&self, frame: &Frame) -> f64 {
        let errors: Vec<f64> = frequency_rows(frame)
            .map(|row| 100.0 * self.raw[row])
            .collect();
        tapjoint_numerics::stats::root_mean_square(&errors)
    }

    /// Root mean square of the errors (%) with which each mode's frequencies are predicted from all
    /// other readings. `None` where a mode is needed.
    pub(super) fn left_out_rms(&self, frame: &Frame) -> Option<f64> {
        let mut errors = Vec::new();
        for mode in 1..=frame.fitted_modes {
            let rows: Vec<usize> = (0..frame.rows.len())
                .filter(|&row| matches!(frame.rows[row], Row::Frequency { mode: own, .. } if own == mode))
                .collect();
            if rows.is_empty() {
                continue;
            }
            let predictor = self.predictor(&rows)?;
            errors.extend((predictor * self.residuals()).iter().map(|x| 100.0 * x));
        }
        (!errors.is_empty()).then(|| tapjoint_numerics::stats::root_mean_square(&errors))
    }

    /// Reading less prediction, natural units.
    pub(super) fn residuals(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.raw)
    }

    /// Covariance of [`residuals`](Self::residuals) if the hypothesis is true, natural units.
    pub(super) fn residual_covariance(&self) -> DMatrix<f64> {
        let stds = DMatrix::from_diagonal(&self.weighted_stds);
        &stds * &self.spread * &stds
    }

    /// What takes all residuals to the errors with which the readings `rows` are predicted from all others,
    /// natural units: with the influence H of each reading on each prediction, both over the standard
    /// deviations s of the fit, these are s_b (I - H)_bb^-1 r_b/s_b (Cook & Weisberg 1982). `None` where the
    /// other readings leave a parameter open.
    pub(super) fn predictor(&self, rows: &[usize]) -> Option<DMatrix<f64>> {
        let block = self.spread.select_rows(rows).select_columns(rows);
        let inverse = block.cholesky()?.inverse();
        let mut predictor = DMatrix::zeros(rows.len(), self.raw.len());
        for (i, &to) in rows.iter().enumerate() {
            for (j, &from) in rows.iter().enumerate() {
                let stds = self.weighted_stds[to] / self.weighted_stds[from];
                predictor[(i, from)] = inverse[(i, j)] * stds;
            }
        }
        Some(predictor)
    }
}

/// Rows of frequencies.
fn frequency_rows(frame: &Frame) -> impl Iterator<Item = usize> + '_ {
    (0..frame.rows.len()).filter(|&row| matches!(frame.rows[row], Row::Frequency { .. }))
}

/// Root mean square of the frequencies' standard uncertainties (%).
pub(super) fn noise_floor(frame: &Frame) -> f64 {
    let stds: Vec<f64> = frequency_rows(frame)
        .map(|row| 100.0 * frame.readings[row].std)
        .collect();
    tapjoint_numerics::stats::root_mean_square(&stds)
}

/// Rows by configuration, by mode, by tap level, by sensor place, and by kind.
fn block_rows(frame: &Frame) -> Vec<(String, Vec<usize>)> {
    let mut blocks: Vec<(String, Vec<usize>)> = Vec::new();
    let mut add = |name: String, row: usize| match blocks.iter_mut().find(|block| block.0 == name) {
        Some(block) => block.1.push(row),
        None => blocks.push((name, vec![row])),
    };
    for (row, kind) in frame.rows.iter().enumerate() {
        match *kind {
            Row::Frequency {
                configuration,
                mode,
            } => {
                add(format!("mode {mode}"), row);
                if frame.setups.len() > 1 {
                    add(frame.setups[configuration].label(), row);
                }
            }
            Row::Constant { .. } | Row::Ratio { .. } => add("shapes".to_string(), row),
            Row::Damping { .. } => add("damping".to_string(), row),
            Row::Slope { .. } => add("along the decays".to_string(), row),
        }
    }
    blocks
}

/// The frequencies' errors before and after.
pub(super) fn pulls(frame: &Frame, before: &Residuals, after: &Residuals) -> Vec<Pull> {
    frequency_rows(frame)
        .filter_map(|row| {
            let Row::Frequency {
                configuration,
                mode,
            } = frame.rows[row]
            else {
                return None;
            };
            let std = frame.readings[row].std;
            // error_percent = 100 (predicted - measured)/measured.
            let percent = |raw: f64| 100.0 * ((-raw).exp() - 1.0);
            Some(Pull {
                mode,
                recording: frame.setups[configuration].file.clone(),
                level: frame.setups[configuration].known_level,
                error_percent: percent(before.raw[row]),
                z: -before.raw[row] / std,
                error_percent_after: percent(after.raw[row]),
                z_after: -after.raw[row] / std,
            })
        })
        .collect()
}
