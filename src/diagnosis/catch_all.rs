//! The hypotheses that name no effect of a certain size: something unknown, and a joint that is another
//! one at every visit.

use super::evidence::{Branch, evaluate, log_mean, over_drifts};
use super::forward::Forward;
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::knowledge::knowledge;
use super::settings::GapSettings;
use super::small_unknowns::Small;

/// Spreads of what no effect explains (1): 0.05 to 3 %, equally spaced in their logarithm.
const SPREADS: [f64; 7] = [5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 1.6e-2, 3e-2];

/// Something that no effect of the catalogue is: every mode's frequency off by an amount of its own,
/// the same in all configurations, with a tenth of it for each reading and twice of it in the shapes.
pub(super) fn fit_unknown(frame: &Frame, settings: &GapSettings, nominal: &Fit) -> Option<Fit> {
    let mut branches: Vec<Branch> = Vec::new();
    for spread in SPREADS {
        let loose = loosened(frame, spread);
        let forward = Forward::new(&loose, &[]);
        let known = knowledge(&loose, &forward.layout, settings);
        let mut start = nominal.branch.optimum.parameters.clone();
        start.resize(known.len(), 0.0);
        branches.extend(evaluate(&forward, &known, &start, &settings.drift_stds));
    }
    let all: Vec<f64> = branches.iter().map(|branch| branch.log_evidence).collect();
    let best = branches
        .into_iter()
        .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
    Some(Fit {
        effects: Vec::new(),
        branch: best,
        log_evidence: log_mean(&all),
    })
}

/// The frame in which nothing is predicted better than `spread`.
pub(super) fn loosened(frame: &Frame, spread: f64) -> Frame {
    let mut loose = frame.clone();
    for mode in 1..=frame.fitted_modes {
        loose.smalls.push(Small::Discrepancy { mode });
        loose.small_centres.push(0.0);
        loose.small_stds.push(spread);
    }
    let shapes = |row: &Row| matches!(row, Row::Constant { .. } | Row::Ratio { .. });
    let sizes: Vec<f64> = frame
        .rows
        .iter()
        .zip(&frame.readings)
        .filter(|(row, _)| shapes(row))
        .map(|(_, reading)| reading.value)
        .collect();
    let size = tapjoint_numerics::stats::root_mean_square(&sizes);
    for (row, reading) in loose.rows.iter().zip(&mut loose.readings) {
        let extra = match row {
            Row::Frequency { .. } => 0.1 * spread,
            row if shapes(row) => 2.0 * spread * size,
            // Damping and slopes may be anything where nothing is known.
            Row::Damping { .. } => 50.0 * spread,
            _ => 0.1 * spread,
        };
        reading.std = reading.std.hypot(extra);
    }
    loose
}

/// Spreads of the joint between visits that are no longer a nuisance (1).
const LARGE_DRIFTS: [f64; 3] = [0.04, 0.07, 0.12];

/// A joint that is another one at every visit: the nominal model with a wide drift.
pub(super) fn fit_drift(frame: &Frame, nominal: &Fit) -> Option<(Fit, f64)> {
    if !frame
        .smalls
        .iter()
        .any(|small| matches!(small, Small::Drift { .. }))
    {
        return None;
    }
    let forward = Forward::new(frame, &[]);
    let known = &nominal.branch.knowledge;
    let mut all = Vec::new();
    let mut best: Option<(Branch, f64)> = None;
    for drift in LARGE_DRIFTS {
        let optimum = nominal.branch.optimum.clone();
        let branch = over_drifts(frame, &forward.layout, known, optimum, &[drift]);
        all.push(branch.log_evidence);
        if best
            .as_ref()
            .is_none_or(|(best, _)| branch.log_evidence > best.log_evidence)
        {
            best = Some((branch, drift));
        }
    }
    let (branch, drift) = best?;
    let fit = Fit {
        effects: Vec::new(),
        branch,
        log_evidence: log_mean(&all),
    };
    Some((fit, drift))
}
