//! How well planned readings will be read, by what has been read so far.

use super::super::frame::{Frame, Row};

/// Readings by a fit have this share of the bias that reading on lines may have.
pub(super) const FINER: f64 = 0.1;

/// Numbers of the modes that take part in the fit.
pub(super) fn observed_modes(frame: &Frame) -> impl Iterator<Item = usize> + '_ {
    (1..=frame.fitted_modes).filter(|mode| stds(frame, *mode).next().is_some())
}

fn stds(frame: &Frame, wanted: usize) -> impl Iterator<Item = f64> + '_ {
    let fitted = frame.rows.iter().zip(&frame.readings);
    let withheld = frame.withheld.iter().map(|(row, reading)| (row, reading));
    fitted.chain(withheld).filter_map(move |(row, reading)| {
        matches!(row, Row::Frequency { mode, .. } if *mode == wanted).then_some(reading.std)
    })
}

/// How well a mode's frequency will be read (1): as well as so far, higher modes as well as the highest.
pub(super) fn std_of(frame: &Frame, mode: usize) -> f64 {
    let below = (1..=mode).rev();
    let mut known = below.map(|mode| median(stds(frame, mode).collect()));
    known.find_map(|std| std).unwrap_or(1e-3)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    (!values.is_empty()).then(|| tapjoint_numerics::stats::median(&mut values))
}

/// The same without what reading on lines adds, b/sqrt 3.
pub(super) fn without_bias(frame: &Frame, mode: usize, bias: f64) -> f64 {
    let std = std_of(frame, mode);
    let rows = frame.rows.iter().zip(&frame.readings);
    let mut own =
        rows.filter(|(row, _)| matches!(row, Row::Frequency { mode: m, .. } if *m == mode));
    let Some((_, reading)) = own.next() else {
        return std;
    };
    let line = bias / 3.0_f64.sqrt() / reading.value.exp();
    let rest = (std * std - line * line).max(0.0);
    (rest + (FINER * line).powi(2)).sqrt()
}
