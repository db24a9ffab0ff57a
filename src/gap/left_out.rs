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
        let recordings: Vec<(String, WithheldErrors)> = visits
            .into_iter()
            .filter_map(|visit| {
                let file = &frame.setups.iter().find(|setup| setup.visit == visit)?.file;
                Some((file.clone(), without(frame, &residuals, visit)?))
            })
            .collect();
        (!recordings.is_empty()).then_some(LeftOutErrors { recordings })
    }

    fn together(&self) -> Option<WithheldErrors> {
        WithheldErrors::together(self.recordings.iter().map(|(_, errors)| errors))
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
        let (all_before, all_after) = (before.together()?, self.together()?);
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
            closure: closure(&all_before, &all_after, seed),
        })
    }
}

/// Errors of one visit's frequencies without anything of that visit: with the influence H of each reading
/// on each prediction, the residual of a block that took no part is (I - H)_bb^-1 r_b, and its covariance
/// (I - H)_bb^-1 (Cook & Weisberg 1982).
fn without(frame: &Frame, residuals: &Residuals, visit: usize) -> Option<WithheldErrors> {
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
    let block = residuals.spread.select_rows(&rows).select_columns(&rows);
    let own = DVector::from_iterator(rows.len(), rows.iter().map(|&row| residuals.unit[row]));
    let factor = block.cholesky()?;
    let (predicted, spread) = (factor.solve(&own), factor.inverse());
    let percent = |k: usize| 100.0 * frame.readings[rows[frequencies[k]]].std;
    let count = frequencies.len();
    let errors = DVector::from_fn(count, |k, _| percent(k) * predicted[frequencies[k]]);
    let covariance = DMatrix::from_fn(count, count, |i, j| {
        percent(i) * percent(j) * spread[(frequencies[i], frequencies[j])]
    });
    let stds = DVector::from_fn(count, |k, _| percent(k));
    Some(WithheldErrors::from_parts(errors, covariance, stds))
}
