//! Averages over taps: power spectra, cross spectra and H1.

use num_complex::Complex64;

use super::lines::Lines;

/// Sums of spectra over taps, one tap at a time, so that only one record is in memory.
#[derive(Debug, Clone)]
pub struct SpectralAverager {
    lines: Lines,
    responses: usize,
    taps: usize,
    force_power: Vec<f64>,
    cross: Vec<Vec<Complex64>>,
    response_power: Vec<Vec<f64>>,
}

/// Averages over taps, on one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AveragedSpectra {
    /// The axis.
    pub lines: Lines,
    /// Number of taps averaged.
    pub taps: usize,
    /// Root mean square of the force's transforms (N s); `None` without a hammer.
    pub force: Option<Vec<f64>>,
    /// Root mean square of each response's transforms (unit of the response times s).
    pub responses: Vec<Vec<f64>>,
    /// H1 = sum conj(F) X / sum conj(F) F of each response (unit of the response per N), in the
    /// convention e^{+j omega t}; `None` without a hammer.
    pub h1: Option<Vec<Vec<Complex64>>>,
}

impl SpectralAverager {
    /// Nothing averaged yet, for so many responses.
    pub fn new(lines: Lines, responses: usize) -> Self {
        let points = lines.points();
        SpectralAverager {
            lines,
            responses,
            taps: 0,
            force_power: vec![0.0; points],
            cross: vec![vec![Complex64::ZERO; points]; responses],
            response_power: vec![vec![0.0; points]; responses],
        }
    }

    /// Adds one tap: the force's transform (if there is a hammer) and each response's.
    pub fn add(&mut self, force: Option<&[Complex64]>, responses: &[Vec<Complex64>]) {
        self.taps += 1;
        if let Some(force) = force {
            for (sum, f) in self.force_power.iter_mut().zip(force) {
                *sum += f.norm_sqr();
            }
        }
        for (index, response) in responses.iter().enumerate().take(self.responses) {
            for (sum, x) in self.response_power[index].iter_mut().zip(response) {
                *sum += x.norm_sqr();
            }
            if let Some(force) = force {
                for ((sum, f), x) in self.cross[index].iter_mut().zip(force).zip(response) {
                    *sum += f.conj() * x;
                }
            }
        }
    }

    /// The averages; `None` before the first tap.
    pub fn finish(self) -> Option<AveragedSpectra> {
        if self.taps == 0 {
            return None;
        }
        let count = self.taps as f64;
        let root = |power: &Vec<f64>| power.iter().map(|p| (p / count).sqrt()).collect::<Vec<_>>();
        let has_force = self.force_power.iter().any(|&power| power > 0.0);
        let h1 = has_force.then(|| {
            self.cross
                .iter()
                .map(|cross| divide(cross, &self.force_power))
                .collect::<Vec<_>>()
        });
        Some(AveragedSpectra {
            lines: self.lines,
            taps: self.taps,
            force: has_force.then(|| root(&self.force_power)),
            responses: self.response_power.iter().map(root).collect(),
            h1,
        })
    }
}

/// cross/power, 0 where the force has no power at all.
fn divide(cross: &[Complex64], power: &[f64]) -> Vec<Complex64> {
    cross
        .iter()
        .zip(power)
        .map(|(c, &p)| if p > 0.0 { c / p } else { Complex64::ZERO })
        .collect()
}

impl AveragedSpectra {
    /// Averages over nothing, on an axis.
    pub fn empty(lines: Lines) -> Self {
        AveragedSpectra {
            lines,
            taps: 0,
            force: None,
            responses: Vec::new(),
            h1: None,
        }
    }
}
