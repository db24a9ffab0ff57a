//! Each recording predicted from all others: a cause that is real explains recordings that it has not
//! seen.

use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::quality::Residuals;
use super::result::{LeftOutRecording, LeftOutRecordings};
use super::withheld::{WithheldErrors, closure};
use nalgebra::{DMatrix, DVector};

/// Recordings from which on one can be left out: the other two still say what changes between them.
const LEAST_RECORDINGS: usize = 3;

/// Errors of the frequencies of each recording as predicted from all others.
#[derive(Debug, Clone)]
pub(super) struct LeftOutErrors {
    recordings: Vec<(String, WithheldErrors)>,
    /// All of them at once: what two recordings are predicted from is mostly the same.
    together: WithheldErrors,
}

impl LeftOutErrors {
    /// Refits without each recording in turn, by the model linearised at the optimum of all. Damping ratios
    /// stay, since those of all recordings are one reading; they say nothing about frequencies.
    ///
    /// `None` with fewer than three recordings.
    pub(super) fn new(frame: &Frame, fit: &Fit) -> Option<Self> {
        let mut visits: Vec<usize> = frame.setups.iter().map(|setup| setup.visit).collect();
        visits.sort_unstable();
        visits.dedup();
        if visits.len() < LEAST_RECORDINGS {
            return None;
        }
        let residuals = Residuals::new(frame, fit)?;
        let mut recordings = Vec::new();
        let mut all: Vec<Predicted> = Vec::new();
        for visit in visits {
            let mut setups = frame.setups.iter();
            let file = &setups.find(|setup| setup.visit == visit)?.file;
            let Some(own) = without(frame, &residuals, visit) else {
                continue;
            };
            let errors = errors_of(frame, &residuals, std::slice::from_ref(&own));
            recordings.push((file.clone(), errors));
            all.push(own);
        }
        let together = (!all.is_empty()).then(|| errors_of(frame, &residuals, &all))?;
        Some(LeftOutErrors {
            recordings,
            together,
        })
    }

    /// What a hypothesis makes of the recordings that it has not seen, against the nominal model.
    pub(super) fn against(&self, before: &Self, seed: u64) -> Option<LeftOutRecordings> {
        let labels = |errors: &Self| -> Vec<String> {
            errors.recordings.iter().map(|one| one.0.clone()).collect()
        };
        // A recording that alone fixes an unknown cannot be left out.
        if labels(self) != labels(before) {
            return None;
        }
        let (all_before, all_after) = (&before.together, &self.together);
        let recordings = self.recordings.iter().zip(&before.recordings);
        Some(LeftOutRecordings {
            recordings: recordings
                .map(|((recording, after), (_, before))| LeftOutRecording {
                    recording: recording.clone(),
                    before: before.rms(),
                    after: after.rms(),
                    floor: after.floor(),
                })
                .collect(),
            before: all_before.rms(),
            after: all_after.rms(),
            floor: all_after.floor(),
            closure: closure(all_before, all_after, seed),
        })
    }
}

/// The frequencies of one visit, and what predicts them from the readings of all others.
struct Predicted {
    rows: Vec<usize>,
    /// One row each, one column for every residual.
    predictor: DMatrix<f64>,
}

/// Predicts one visit's frequencies without anything of that visit.
fn without(frame: &Frame, residuals: &Residuals, visit: usize) -> Option<Predicted> {
    let of = |configuration: usize| frame.setups[configuration].visit == visit;
    let rows: Vec<usize> = (0..frame.rows.len())
        .filter(|&row| match frame.rows[row] {
            Row::Frequency { configuration, .. }
            | Row::Constant { configuration, .. }
            | Row::Ratio { configuration, .. }
            | Row::Slope { configuration, .. } => of(configuration),
            Row::Damping { .. } => false,
        })
        .collect();
    let frequencies: Vec<usize> = (0..rows.len())
        .filter(|&k| matches!(frame.rows[rows[k]], Row::Frequency { .. }))
        .collect();
    if frequencies.is_empty() {
        return None;
    }
    Some(Predicted {
        predictor: residuals.predictor(&rows)?.select_rows(&frequencies),
        rows: frequencies.into_iter().map(|k| rows[k]).collect(),
    })
}

/// Errors of what was predicted, with their covariance: predictions from mostly the same readings hang
/// together.
fn errors_of(frame: &Frame, residuals: &Residuals, all: &[Predicted]) -> WithheldErrors {
    let count = all.iter().map(|one| one.rows.len()).sum();
    let mut predictor = DMatrix::zeros(count, residuals.raw.len());
    let mut at = 0;
    for one in all {
        predictor
            .rows_mut(at, one.rows.len())
            .copy_from(&one.predictor);
        at += one.rows.len();
    }
    let covariance = &predictor * residuals.residual_covariance() * predictor.transpose();
    let rows = all.iter().flat_map(|one| &one.rows);
    let stds = DVector::from_iterator(count, rows.map(|&row| 100.0 * frame.readings[row].std));
    WithheldErrors::from_parts(
        100.0 * predictor * residuals.residuals(),
        1e4 * covariance,
        stds,
    )
}
