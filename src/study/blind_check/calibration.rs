//! Whether stated probabilities are what they say: Brier's score and a reliability table.

use super::case::{Answer, Class, Truth};

/// Bins of the reliability table, equal in width.
const BINS: usize = 10;

/// One row of the reliability table: answers whose first class has about this probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReliabilityBin {
    /// Lower edge of the bin (1).
    pub from: f64,
    /// Answers in it.
    pub cases: usize,
    /// Their mean stated probability; `None` without a case.
    pub stated: Option<f64>,
    /// How many of them were right (1); `None` without a case.
    pub right: Option<f64>,
}

/// How far stated probabilities can be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Mean over cases of the sum over classes of (p - truth)^2, from 0 (certain and right) to 2;
    /// `None` without a case. It cannot be improved by stating what one does not believe.
    pub brier: Option<f64>,
    /// Mean distance between stated probability and share of right answers, weighted by cases.
    pub expected_calibration_error: Option<f64>,
    /// The table behind it.
    pub reliability: Vec<ReliabilityBin>,
}

/// Judges the probabilities of all cases with one right class.
pub fn calibrate(cases: &[(Truth, Answer)]) -> Calibration {
    let cases: Vec<(Class, &Answer)> = cases
        .iter()
        .filter_map(|(truth, answer)| Some((truth.class()?, answer)))
        .collect();
    let reliability: Vec<ReliabilityBin> = (0..BINS).map(|bin| row(bin, &cases)).collect();
    let total = cases.len() as f64;
    let distance = |bin: &ReliabilityBin| {
        let (stated, right) = bin.stated.zip(bin.right)?;
        Some(bin.cases as f64 / total * (stated - right).abs())
    };
    Calibration {
        brier: (!cases.is_empty()).then(|| {
            cases
                .iter()
                .map(|(class, answer)| brier(*class, answer))
                .sum::<f64>()
                / total
        }),
        expected_calibration_error: (!cases.is_empty())
            .then(|| reliability.iter().filter_map(distance).sum()),
        reliability,
    }
}

/// sum over classes of (p - 1 or 0)^2.
fn brier(truth: Class, answer: &Answer) -> f64 {
    let stated = |class: &Class| answer.classes.get(class).copied().unwrap_or(0.0);
    let others = answer.classes.iter().filter(|(class, _)| **class != truth);
    (1.0 - stated(&truth)).powi(2) + others.map(|(_, p)| p * p).sum::<f64>()
}

fn row(bin: usize, cases: &[(Class, &Answer)]) -> ReliabilityBin {
    let inside: Vec<(bool, f64)> = cases
        .iter()
        .filter_map(|(truth, answer)| {
            let (class, probability) = answer.first()?;
            let own = ((probability * BINS as f64) as usize).min(BINS - 1);
            (own == bin).then_some((class == *truth, probability))
        })
        .collect();
    let count = inside.len() as f64;
    let mean = |sum: f64| (!inside.is_empty()).then(|| sum / count);
    ReliabilityBin {
        from: bin as f64 / BINS as f64,
        cases: inside.len(),
        stated: mean(inside.iter().map(|(_, p)| p).sum()),
        right: mean(inside.iter().filter(|(right, _)| *right).count() as f64),
    }
}
