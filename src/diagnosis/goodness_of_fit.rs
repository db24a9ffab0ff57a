//! Tests of one explanation: how well it fits the data, block by block, how well it predicts the hold-out data,
//! and whether enough data are left to test it.

use crate::dataset::Dataset;
use crate::evidence::Fit;
use crate::fixture;
use crate::result::{Block, Closure};
use crate::structure::Arrangement;
use crate::thresholds::{
    ANOTHER_LEVEL, BLOCK_MISFIT, CLOSED_SHARE, DOUBLED_ERRORS, MISFIT, PREDICTED, SPARE_DATA,
};
use crate::validate::{Residuals, holdout_goodness};
use tapjoint_beam::effects::EffectId;

/// Returns whether a misfit of hold-out data, of probability `p`, refutes an explanation. They are few, and linearised
/// about the fit: the limit is that of one block among many.
pub fn refutes_by_holdout(p: f64) -> bool {
    p < BLOCK_MISFIT
}

/// Tests of one explanation.
#[derive(Debug, Clone)]
pub struct GoodnessOfFit {
    /// Goodness of fit, all data together.
    pub overall: Option<f64>,
    /// Goodness of fit of its blocks, the worst first.
    pub blocks: Vec<Block>,
    /// Goodness of its prediction of hold-out data; `None` without any.
    pub holdout: Option<f64>,
    /// Probability of the peak of its fixture, or of its absence; `None` without a fixture.
    peak: Option<f64>,
    /// Numbers of data and parameters; `None` where they are not tested.
    pub freedom: Option<DegreesOfFreedom>,
    /// Its closure on hold-out data; `None` where the nominal model has no gap there.
    pub closure: Option<Closure>,
    /// The gap on hold-out data exceeds what the prediction leaves open, so that the closure can be certain.
    pub is_decisive: bool,
}

/// Numbers of data and parameters of a hypothesis.
#[derive(Debug, Clone, Copy)]
pub struct DegreesOfFreedom {
    /// Frequencies of different modes and arrangements, and other data on which the effects act.
    pub data: usize,
    /// Parameters of joint and effects.
    pub parameters: usize,
}

impl DegreesOfFreedom {
    /// Counts each fitted mode once for every set of sensor positions and added
    /// masses, since these see other shapes and load other positions; slopes along decays, other levels and damping
    /// ratios count for the effects that make them.
    pub fn of(dataset: &Dataset, fit: &Fit) -> Self {
        let [slips, damps] = [EffectId::JointNonlinearity, EffectId::JointDamping]
            .map(|wanted| fit.effects.iter().any(|one| one.effect == wanted));
        let mut seen: Vec<(usize, &Arrangement)> = Vec::new();
        let mut others = 0;
        for observable in &dataset.observables {
            if observable.is_frequency() {
                let (mode, one) = (
                    observable.mode,
                    &dataset.arrangements[observable.configuration],
                );
                let mut known = seen.iter().filter(|old| old.0 == mode);
                if known.all(|old| differ(old.1, one, slips)) {
                    seen.push((mode, one));
                }
            }
            others += usize::from(slips && observable.is_slope());
            others += usize::from(damps && observable.is_damping());
        }
        DegreesOfFreedom {
            data: seen.len() + others,
            parameters: dataset.layout(&fit.effects).first_nuisance(),
        }
    }

    /// Returns whether too few data are left to test a name with.
    pub fn are_too_few(self) -> bool {
        self.data < self.parameters + SPARE_DATA
    }
}

/// Returns whether two arrangements have different sensor positions or added masses, or tap levels if these count.
fn differ(one: &Arrangement, other: &Arrangement, levels_count: bool) -> bool {
    let sensors = one.sensors.iter().map(|sensor| sensor.position);
    let fastened = one.fastened.iter().map(|fastened| fastened.0);
    let levels = one.known_level.zip(other.known_level);
    let ratio = levels.map_or(0.0, |(a, b)| (a / b).ln().abs());
    sensors.ne(other.sensors.iter().map(|sensor| sensor.position))
        || fastened.ne(other.fastened.iter().map(|fastened| fastened.0))
        || levels_count && ratio >= ANOTHER_LEVEL.ln()
}

impl GoodnessOfFit {
    /// Tests a fit by its own data and by the hold-out data; `None` where the fit has no covariance.
    pub fn new(dataset: &Dataset, fit: &Fit) -> Option<Self> {
        let residuals = Residuals::new(dataset, fit)?;
        Some(GoodnessOfFit {
            overall: residuals.goodness(),
            blocks: residuals.blocks(dataset),
            holdout: holdout_goodness(dataset, fit, refutes_by_holdout),
            peak: fixture::goodness(dataset, fit),
            freedom: None,
            closure: None,
            is_decisive: false,
        })
    }

    /// Returns whether the data refute the hypothesis.
    pub fn is_refuted(&self) -> bool {
        self.refuting_p_value().is_some()
    }

    /// Returns the p-value of the misfit that refutes the hypothesis, the smallest where several do; for one
    /// block among many that of any.
    pub fn refuting_p_value(&self) -> Option<f64> {
        let worst = self.blocks.first().map(|block| block.goodness_of_fit);
        let worst = worst.filter(|p| *p < BLOCK_MISFIT);
        let all = [
            self.overall.filter(|p| *p < MISFIT),
            self.holdout.filter(|p| refutes_by_holdout(*p)),
            worst.map(|p| (p * self.blocks.len() as f64).min(MISFIT)),
            self.peak.filter(|p| *p < MISFIT),
        ];
        all.into_iter().flatten().min_by(f64::total_cmp)
    }

    /// Returns whether hold-out data are predicted no worse than by the nominal model. Two effects at once
    /// must fulfil it: they have the freedom to imitate a change outside the catalogue.
    pub fn improves_holdout(&self) -> bool {
        self.closure.is_none_or(|closure| closure.value > 0.0)
    }

    /// Returns whether the hold-out data leave the hypothesis its name: it closes half of the gap, and some of it for
    /// certain or predicts them within its uncertainty. If they cannot decide, closing some or predicting suffices, but
    /// no named effect makes their errors much worse.
    pub fn passes_holdout(&self) -> bool {
        let Some(closure) = self.closure else {
            return true;
        };
        let predicts = self.holdout.is_some_and(|p| p > PREDICTED);
        if self.is_decisive {
            closure.value >= CLOSED_SHARE && (closure.low > 0.0 || predicts)
        } else {
            closure.value > 0.0 || predicts && closure.value > DOUBLED_ERRORS
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tested(holdout: f64, is_decisive: bool, [value, low]: [f64; 2]) -> GoodnessOfFit {
        let closure = Closure {
            value,
            low,
            high: 1.0,
        };
        GoodnessOfFit {
            overall: None,
            blocks: Vec::new(),
            holdout: Some(holdout),
            peak: None,
            freedom: None,
            closure: Some(closure),
            is_decisive,
        }
    }

    /// Two effects at once must not predict worse than none; without hold-out data there is no test.
    #[test]
    fn limit_two_effects_have_to_improve_on_holdout_data() {
        for (closure, improves) in [(-7.0, false), (0.1, true)] {
            assert_eq!(
                tested(0.5, false, [closure, -9.0]).improves_holdout(),
                improves
            );
        }
        let unknown = GoodnessOfFit {
            closure: None,
            ..tested(0.5, false, [0.0; 2])
        };
        assert!(unknown.improves_holdout());
    }

    #[test]
    fn limit_what_makes_holdout_data_worse_has_to_predict_them() {
        for (withheld, decides, closure, holds) in [
            (0.01, true, [0.9, 0.5], true),
            (0.01, true, [0.9, -0.5], false),
            (0.5, true, [0.9, -0.5], true),
            (0.5, true, [-0.9, -5.0], false),
            (0.5, true, [0.45, 0.3], false),
            // Too small a gap to decide by.
            (0.01, false, [0.9, -0.5], true),
            (0.5, false, [-0.9, -5.0], true),
            (0.01, false, [-6.0, -20.0], false),
            (0.5, false, [-30.0, -60.0], false),
        ] {
            let found = tested(withheld, decides, closure).passes_holdout();
            assert_eq!(found, holds, "{withheld} {decides} {closure:?}");
        }
    }
}
