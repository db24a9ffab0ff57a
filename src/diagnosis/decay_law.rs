//! The law of a joint's rotation that explains best how frequencies change along the decays.

use super::noise::{self, Reading};
use tapjoint_beam::effects::JointLaw;

/// Exponents that are tried: slip with two powers and in between, and the cubic spring.
const EXPONENTS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// Largest relative change of the stiffness that a law is credited with (1): the hypothesis of such a joint
/// has the same range.
pub(super) const LARGEST: f64 = 0.7;
/// Sizes at which the search begins: the changes are logarithmic in the size, and one that is foreign to
/// the joint makes several minima.
const BEGIN: [f64; 5] = [0.01, 0.05, 0.15, 0.35, 0.6];
/// Steps of a search at most; it doubles its digits with each.
const STEPS: usize = 8;
/// Relative step that ends a search: far below any uncertainty.
const ENOUGH: f64 = 1e-5;

/// A law whose size follows from the changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Regression {
    pub(super) law: JointLaw,
    /// Standard uncertainty of its ratio (1).
    pub(super) std: f64,
    /// Twice the logarithm of the density that the readings lose to their residuals.
    misfit: f64,
}

/// What is explained, and the changes that a law predicts.
pub(super) struct Changes<'a> {
    pub(super) readings: &'a [Reading],
    pub(super) predicted: &'a dyn Fn(&JointLaw) -> Vec<f64>,
}

impl Changes<'_> {
    /// The best of all exponents and signs; `None` where no law predicts any change.
    pub(super) fn best_law(&self) -> Option<Regression> {
        let laws = [-1.0, 1.0].into_iter().flat_map(|sign| {
            EXPONENTS.map(|exponent| JointLaw {
                ratio: sign,
                exponent,
            })
        });
        laws.filter_map(|unit| self.regression(unit))
            .min_by(|a, b| a.misfit.total_cmp(&b.misfit))
    }

    /// Steps of Gauss and Newton in the size, with Student's weights at the residuals; `None` where the
    /// changes call for the other sign, or say nothing.
    fn regression(&self, unit: JointLaw) -> Option<Regression> {
        let of = |size: f64| JointLaw {
            ratio: unit.ratio * size,
            ..unit
        };
        let begins = BEGIN.map(|size| (size, self.misfit(&of(size))));
        let (mut size, mut misfit) = begins.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        for _ in 0..STEPS {
            let (mut step, _) = self.step(&of, size)?;
            let mut next = (size + step).clamp(0.0, LARGEST);
            while self.misfit(&of(next)) > misfit && step.abs() > ENOUGH * size.max(1e-3) {
                step *= 0.5;
                next = (size + step).clamp(0.0, LARGEST);
            }
            let moved = (next - size).abs();
            let reached = self.misfit(&of(next));
            if reached > misfit {
                break;
            }
            (size, misfit) = (next, reached);
            if moved <= ENOUGH * size.max(1e-3) {
                break;
            }
        }
        let (_, std) = self.step(&of, size)?;
        (size > ENOUGH).then(|| Regression {
            law: of(size),
            std,
            misfit,
        })
    }

    /// sum(w x e)/sum(w x^2) with the residuals e and the slopes x, and the size's standard uncertainty.
    fn step(&self, of: &dyn Fn(f64) -> JointLaw, size: f64) -> Option<(f64, f64)> {
        let away = 1e-4 * size.max(1e-3);
        let (here, there) = (
            (self.predicted)(&of(size)),
            (self.predicted)(&of(size + away)),
        );
        let (mut xx, mut xe, mut known) = (0.0, 0.0, 0.0);
        for (reading, (here, there)) in self.readings.iter().zip(here.iter().zip(&there)) {
            let x = (there - here) / away / reading.std;
            let e = (reading.value - here) / reading.std;
            let weight = noise::weight(e, reading.freedom);
            xx += weight * x * x;
            xe += weight * x * e;
            // No reading is worth more than its standard uncertainty says.
            known += weight.min(1.0) * x * x;
        }
        (xx > 0.0).then(|| (xe / xx, known.powf(-0.5)))
    }

    fn misfit(&self, law: &JointLaw) -> f64 {
        let predicted = (self.predicted)(law);
        let drop = |(reading, predicted): (&Reading, &f64)| {
            let residual = (reading.value - predicted) / reading.std;
            -2.0 * noise::log_density_drop(residual, reading.freedom)
        };
        self.readings.iter().zip(&predicted).map(drop).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sensitivities of four modes to the joint's rotation; the third hardly turns it.
    const SENSITIVITIES: [f64; 4] = [0.25, 0.15, 0.03, 0.2];

    /// Change of each frequency between the first amplitude and a tenth of it.
    fn predicted(law: &JointLaw) -> Vec<f64> {
        let change = law.secant(1.0).ln() - law.secant(0.1).ln();
        SENSITIVITIES.map(|s| s * change).to_vec()
    }

    fn found(values: Vec<f64>, std: f64, freedom: f64) -> Option<Regression> {
        let reading = |value| Reading {
            value,
            std,
            freedom,
        };
        let readings: Vec<Reading> = values.into_iter().map(reading).collect();
        let changes = Changes {
            readings: &readings,
            predicted: &predicted,
        };
        changes.best_law()
    }

    #[test]
    fn recover_the_size_of_a_joint_that_softens_much() {
        // A regression that is linear in the size makes -0.36 of -0.30 and -0.71 of -0.50. Two amplitudes
        // do not tell the power: the change between them is what all laws agree on.
        for truth in [-0.05, -0.3, -0.5, 0.4] {
            let law = JointLaw {
                ratio: truth,
                exponent: 1.0,
            };
            let law = found(predicted(&law), 1e-4, 8.0).unwrap().law;
            let change = |law: &JointLaw| (law.secant(1.0) / law.secant(0.1)).ln();
            let expected = change(&JointLaw {
                ratio: truth,
                exponent: 1.0,
            });
            // Far below the uncertainty, 1e-4/0.35.
            assert!((change(&law) - expected).abs() < 1e-6, "{truth} {law:?}");
            if law.exponent == 1.0 {
                assert!((law.ratio - truth).abs() < 1e-5, "{truth} {law:?}");
            }
        }
    }

    #[test]
    fn regress_a_clear_change_does_not_lose_weight() {
        // 3 to 60 standard uncertainties; the residuals are 0, and the uncertainty is that of plain least
        // squares, std/sqrt(sum x^2).
        let law = JointLaw {
            ratio: -0.1,
            exponent: 0.5,
        };
        let got = found(predicted(&law), 3e-4, 4.0).unwrap();
        let slope = |law: &JointLaw| {
            let more = JointLaw {
                ratio: law.ratio - 1e-6,
                ..*law
            };
            let pairs = predicted(&more).into_iter().zip(predicted(law));
            pairs.map(|(a, b)| ((a - b) / 1e-6).powi(2)).sum::<f64>()
        };
        let expected = 3e-4 / slope(&got.law).sqrt();
        // Differences leave 1e-4.
        assert!((got.std / expected - 1.0).abs() < 1e-3, "{got:?}");
    }

    #[test]
    fn limit_the_bound_binds() {
        let law = JointLaw {
            ratio: -0.9,
            exponent: 2.0,
        };
        let values = predicted(&law).iter().map(|v| 2.0 * v).collect();
        let got = found(values, 1e-4, 20.0).unwrap();
        assert!((got.law.ratio.abs() - LARGEST).abs() < 1e-12, "{got:?}");
    }

    #[test]
    fn regress_one_foreign_change_is_no_softening() {
        // A translation that softens moves the third frequency by 0.3 %, which would be 10 % of the rotation;
        // the others hold still within 0.03 %.
        let got = found(vec![1e-4, -2e-4, -3e-3, 1e-4], 3e-4, 6.0).unwrap();
        assert!(got.law.ratio.abs() < 3.0 * got.std, "{got:?}");
        assert!(got.law.ratio.abs() < 0.01, "{got:?}");
    }

    #[test]
    fn limit_what_no_law_moves_says_nothing() {
        let readings = [Reading {
            value: 1e-3,
            std: 1e-4,
            freedom: 5.0,
        }];
        let still = |_: &JointLaw| vec![0.0];
        let changes = Changes {
            readings: &readings,
            predicted: &still,
        };
        assert!(changes.best_law().is_none());
    }
}
