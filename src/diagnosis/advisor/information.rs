//! How much a reading tells about which hypothesis is true.

use super::super::least_squares::log_determinant;
use nalgebra::{DMatrix, DVector};

/// What one hypothesis expects of the readings of a test: a normal distribution, in units in which each
/// reading's own standard uncertainty is 1.
#[derive(Debug, Clone)]
pub(super) struct Outlook {
    /// Expected readings.
    pub(super) mean: DVector<f64>,
    /// Their covariance: the readings' own uncertainty and what the hypothesis leaves open.
    pub(super) spread: DMatrix<f64>,
}

/// Bhattacharyya's distance of two normal distributions,
/// D = (m_i - m_j)' C^-1 (m_i - m_j)/8 + ln(det C/sqrt(det C_i det C_j))/2 with C = (C_i + C_j)/2.
///
/// The first term is what the expected readings differ by (Box & Hill 1967, with what each hypothesis leaves
/// open of its parameters in C); the second is what a reading tells about an effect whose size is open:
/// a test of the tap level scatters widely if the joint may soften, and hardly if it may not.
pub(super) fn distance(a: &Outlook, b: &Outlook) -> Option<f64> {
    let middle = (0.5 * (&a.spread + &b.spread)).cholesky()?;
    let apart = &a.mean - &b.mean;
    let by_mean = apart.dot(&middle.solve(&apart)) / 8.0;
    let own = log_determinant(&a.spread.clone().cholesky()?)
        + log_determinant(&b.spread.clone().cholesky()?);
    let by_spread = 0.5 * (log_determinant(&middle) - 0.5 * own);
    Some(by_mean + by_spread.max(0.0))
}

/// All distances between the outlooks; `None` where one of them is no distribution.
pub(super) fn distances(outlooks: &[Outlook]) -> Option<DMatrix<f64>> {
    let count = outlooks.len();
    let mut all = DMatrix::zeros(count, count);
    for i in 0..count {
        for j in 0..i {
            let apart = distance(&outlooks[i], &outlooks[j])?;
            all[(i, j)] = apart;
            all[(j, i)] = apart;
        }
    }
    Some(all)
}

/// Information (bit) that the readings are expected to bring at least about which hypothesis is true,
/// I >= -sum_i p_i ln sum_j p_j exp(-D_ij) (Kolchinsky & Tracey 2017). It lies between 0 and the entropy of
/// the p, and is never less than Box and Hill's sum_ij p_i p_j (1 - exp(-D_ij)).
pub(super) fn information(probabilities: &[f64], distances: &DMatrix<f64>) -> f64 {
    let alike = |i: usize| -> f64 {
        let terms = probabilities.iter().enumerate();
        terms.map(|(j, p)| p * (-distances[(i, j)]).exp()).sum()
    };
    let nats: f64 = probabilities
        .iter()
        .enumerate()
        .filter(|(_, p)| **p > 0.0)
        .map(|(i, p)| -p * alike(i).ln())
        .sum();
    (nats / std::f64::consts::LN_2).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Outlooks of three readings from numbers: means, and slopes with respect to two open parameters.
    fn outlooks(numbers: &[f64]) -> Vec<Outlook> {
        numbers
            .chunks_exact(9)
            .map(|n| {
                let slopes = DMatrix::from_column_slice(3, 2, &n[3..9]);
                Outlook {
                    mean: DVector::from_column_slice(&n[..3]),
                    spread: DMatrix::identity(3, 3) + &slopes * slopes.transpose(),
                }
            })
            .collect()
    }

    fn normalised(weights: &[f64]) -> Vec<f64> {
        let total: f64 = weights.iter().sum();
        weights.iter().map(|w| w / total).collect()
    }

    fn entropy(probabilities: &[f64]) -> f64 {
        probabilities.iter().map(|p| -p * p.log2()).sum()
    }

    proptest! {
        #[test]
        fn prop_information_lies_between_nothing_and_the_entropy(
            numbers in prop::collection::vec(-5.0..5.0_f64, 36),
            weights in prop::collection::vec(0.01..1.0_f64, 4),
        ) {
            let p = normalised(&weights);
            let all = distances(&outlooks(&numbers)).unwrap();
            let bits = information(&p, &all);
            prop_assert!(bits >= 0.0 && bits <= entropy(&p) + 1e-12, "{bits}");
            // Box and Hill's sum is the weaker bound: -ln x >= 1 - x.
            let box_hill: f64 = (0..4)
                .flat_map(|i| (0..4).map(move |j| (i, j)))
                .map(|(i, j)| p[i] * p[j] * (1.0 - (-all[(i, j)]).exp()))
                .sum();
            prop_assert!(bits * std::f64::consts::LN_2 >= box_hill - 1e-12);
        }

        #[test]
        fn prop_information_does_not_depend_on_the_order(
            numbers in prop::collection::vec(-5.0..5.0_f64, 27),
            weights in prop::collection::vec(0.01..1.0_f64, 3),
        ) {
            let (p, forward) = (normalised(&weights), outlooks(&numbers));
            let back: Vec<Outlook> = forward.iter().rev().cloned().collect();
            let q: Vec<f64> = p.iter().rev().copied().collect();
            let one = information(&p, &distances(&forward).unwrap());
            let other = information(&q, &distances(&back).unwrap());
            prop_assert!((one - other).abs() < 1e-12, "{one} {other}");
        }

        #[test]
        fn prop_what_moves_nothing_brings_nothing(
            mean in prop::collection::vec(-5.0..5.0_f64, 9),
            weights in prop::collection::vec(0.01..1.0_f64, 3),
        ) {
            let one = outlooks(&mean);
            let same = [one[0].clone(), one[0].clone(), one[0].clone()];
            let bits = information(&normalised(&weights), &distances(&same).unwrap());
            prop_assert!(bits.abs() < 1e-12, "{bits}");
        }
    }

    #[test]
    fn limit_one_hypothesis_leaves_nothing_to_learn() {
        let all = distances(&outlooks(&[1.0; 9])).unwrap();
        assert!(information(&[1.0], &all).abs() < 1e-15);
    }

    #[test]
    fn limit_readings_far_apart_bring_the_whole_entropy() {
        let numbers: Vec<f64> = (0..27)
            .map(|k| if k % 9 == 0 { 1e3 * f64::from(k) } else { 0.0 })
            .collect();
        let p = [0.5, 0.3, 0.2];
        let bits = information(&p, &distances(&outlooks(&numbers)).unwrap());
        assert!((bits - entropy(&p)).abs() < 1e-9, "{bits}");
    }

    #[test]
    fn limit_infinitely_uncertain_readings_bring_nothing() {
        // In units of their own uncertainty nothing that is expected differs.
        let scale = |outlook: &Outlook| Outlook {
            mean: 1e-9 * &outlook.mean,
            spread: DMatrix::identity(3, 3) + 1e-18 * (&outlook.spread - DMatrix::identity(3, 3)),
        };
        let sharp = outlooks(&(0..18).map(f64::from).collect::<Vec<_>>());
        let blurred: Vec<Outlook> = sharp.iter().map(scale).collect();
        let bits = information(&[0.5, 0.5], &distances(&blurred).unwrap());
        assert!(bits < 1e-12, "{bits}");
    }

    #[test]
    fn val_distance_of_two_normal_distributions() {
        // One reading, means 0 and 2, variances 1 and 4: (2^2/2.5)/8 + ln(2.5/2)/2.
        let one = |mean: f64, variance: f64| Outlook {
            mean: DVector::from_element(1, mean),
            spread: DMatrix::from_element(1, 1, variance),
        };
        let expected = 4.0 / 2.5 / 8.0 + 0.5 * 1.25_f64.ln();
        assert!((distance(&one(0.0, 1.0), &one(2.0, 4.0)).unwrap() - expected).abs() < 1e-14);
    }
}
