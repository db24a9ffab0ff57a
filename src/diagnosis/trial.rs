//! One explanation on trial: how well it fits the readings, block by block, what it predicts of those that
//! took no part, and whether enough readings are left to test it.

use super::fixture_peak;
use super::forward::Layout;
use super::frame::{Frame, Row};
use super::hypothesis::Fit;
use super::posterior::Entry;
use super::quality::Residuals;
use super::result::{Block, Closure};
use super::setup::Setup;
use super::withheld;
use tapjoint_beam::effects::EffectId;

/// Goodness of fit below which an explanation is refused: by chance one in a hundred. The nominal model is given up
/// for something unknown only from 20 to 1 against it ([`super::SEEN`]), of which 1 in 300 is the least.
pub const MISFIT: f64 = 0.01;
/// The same for the worst of many blocks, some ten of which together are wrong as often.
const BLOCK_MISFIT: f64 = 0.001;
/// Probability of an error of withheld readings from which the hypothesis counts as predicting them.
const PREDICTED: f64 = 0.05;

/// Share of the gap on withheld readings that what is named closes: less leaves most of it to something else.
const HALF: f64 = 0.5;

/// Closure at which the mean square of the errors on withheld readings has doubled.
const WORSE: f64 = -1.0;

/// Whether a misfit of withheld readings, of probability `p`, refutes an explanation. They are few, and linearised
/// about the fit: as little is believed as of one block among many.
pub(super) fn refutes_withheld(p: f64) -> bool {
    p < BLOCK_MISFIT
}

/// What the readings say of one explanation.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    /// Goodness of fit, all readings together.
    pub(super) goodness: Option<f64>,
    /// The same of its blocks, the worst first.
    pub(super) blocks: Vec<Block>,
    /// Goodness of its prediction of withheld readings; `None` without any.
    pub(super) withheld: Option<f64>,
    /// How probable the peak of its fixture is, or that there is none; `None` without a fixture.
    peak: Option<f64>,
    /// Readings that its parameters have to answer for, and how many these are; `None` where nobody asked.
    pub(super) room: Option<Room>,
    /// Its closure on withheld readings; `None` where the nominal model has no gap there.
    pub(super) closure: Option<Closure>,
    /// Whether that closure could come out certain: the gap there is larger than what the prediction leaves open.
    pub(super) decides: bool,
}

/// What a hypothesis is tested with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    /// Frequencies of different modes and sensor places, and what else the effects act on.
    pub(super) readings: usize,
    /// Parameters of joint and effects.
    pub(super) parameters: usize,
}

/// Readings beyond the parameters from which a name is given: with fewer nearly every effect of as many
/// parameters explains them.
const SPARE: usize = 2;

impl Room {
    /// What a hypothesis is tested with: each fitted mode once for every set of sensor places and fastened
    /// masses, since these see other shapes and load other places; slopes along decays, other levels and damping
    /// ratios for the effects that make them.
    pub(super) fn of(frame: &Frame, entry: &Entry) -> Self {
        let slips = entry.effects().contains(&EffectId::JointNonlinearity);
        let mut seen: Vec<(usize, Kind)> = Vec::new();
        for row in &frame.rows {
            let &Row::Frequency {
                configuration,
                mode,
            } = row
            else {
                continue;
            };
            let one = Kind::of(&frame.setups[configuration], slips);
            if !seen.iter().any(|old| old.0 == mode && old.1.is_like(&one)) {
                seen.push((mode, one));
            }
        }
        let made = |row: &&Row| match row {
            Row::Slope { .. } => slips,
            Row::Damping { .. } => entry.effects().contains(&EffectId::JointDamping),
            _ => false,
        };
        Room {
            readings: seen.len() + frame.rows.iter().filter(made).count(),
            parameters: Layout::new(frame, &entry.fit.effects).smalls(),
        }
    }

    /// Whether nothing is left to test a name with.
    pub(super) fn is_crowded(self) -> bool {
        self.readings < self.parameters + SPARE
    }
}

/// What makes a configuration another one.
#[derive(Debug)]
struct Kind {
    sensors: Vec<f64>,
    fastened: Vec<usize>,
    /// Of an effect that depends on it.
    level: Option<f64>,
}

impl Kind {
    fn of(setup: &Setup, by_level: bool) -> Self {
        Kind {
            sensors: setup.sensors.iter().map(|s| s.position).collect(),
            fastened: setup.fastened.iter().map(|one| one.0).collect(),
            level: setup.known_level.filter(|_| by_level),
        }
    }

    fn is_like(&self, other: &Self) -> bool {
        let levels = self.level.zip(other.level);
        self.sensors == other.sensors
            && self.fastened == other.fastened
            && levels.is_none_or(|(a, b)| (a / b).ln().abs() < ANOTHER_LEVEL.ln())
    }
}

/// Ratio of amplitudes from which it is another level: taps meant to be alike scatter by less.
const ANOTHER_LEVEL: f64 = 1.5;

impl Trial {
    /// Of a fit by the readings that it was made of; `None` where the fit has no uncertainty.
    pub(super) fn new(frame: &Frame, fit: &Fit) -> Option<Self> {
        let residuals = Residuals::new(frame, fit)?;
        Some(Trial {
            goodness: residuals.goodness(),
            blocks: residuals.blocks(frame),
            withheld: None,
            peak: fixture_peak::goodness(frame, fit),
            room: None,
            closure: None,
            decides: false,
        })
    }

    /// The same with what the fit predicts of readings that took no part.
    pub(super) fn with_withheld(mut self, frame: &Frame, fit: &Fit) -> Self {
        self.withheld = withheld::goodness(frame, fit, refutes_withheld);
        self
    }

    /// Whether the readings refute the hypothesis.
    pub(super) fn refuted(&self) -> bool {
        self.refuting().is_some()
    }

    /// The probability of the misfit that refutes the hypothesis, the smallest where several do; of one
    /// block among many that of any.
    pub(super) fn refuting(&self) -> Option<f64> {
        let block = self.blocks.first().map(|block| block.goodness_of_fit);
        let overall = self.goodness.filter(|p| *p < MISFIT);
        let withheld = self.withheld.filter(|p| refutes_withheld(*p));
        let block = block
            .filter(|p| *p < BLOCK_MISFIT)
            .map(|p| (p * self.blocks.len() as f64).min(MISFIT));
        let peak = self.peak.filter(|p| *p < MISFIT);
        let all = [overall, withheld, block, peak].into_iter().flatten();
        all.min_by(f64::total_cmp)
    }

    /// Whether withheld readings are not predicted worse than by the nominal model: what two effects at once must
    /// not, which have the freedom to imitate a change that no one has named.
    pub(super) fn improves(&self) -> bool {
        self.closure.is_none_or(|closure| closure.value > 0.0)
    }

    /// Whether withheld readings leave the hypothesis its name: it closes half of the gap, and some of it for certain
    /// or predicts them within what it leaves open. Where they cannot decide, closing some or predicting will do, but
    /// no name makes their errors much worse.
    pub(super) fn holds(&self) -> bool {
        let predicts = self.withheld.is_some_and(|p| p > PREDICTED);
        self.closure.is_none_or(|closure| match self.decides {
            true => closure.value >= HALF && (closure.low > 0.0 || predicts),
            false => closure.value > 0.0 || predicts && closure.value > WORSE,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(withheld: f64, decides: bool, [value, low]: [f64; 2]) -> Trial {
        let closure = Closure {
            value,
            low,
            high: 1.0,
        };
        Trial {
            goodness: None,
            blocks: Vec::new(),
            withheld: Some(withheld),
            peak: None,
            room: None,
            closure: Some(closure),
            decides,
        }
    }

    /// Two effects at once must not predict worse than none; without withheld readings nothing is said.
    #[test]
    fn limit_two_effects_have_to_improve_on_withheld_readings() {
        for (closure, improves) in [(-7.0, false), (0.1, true)] {
            assert_eq!(trial(0.5, false, [closure, -9.0]).improves(), improves);
        }
        let unknown = Trial {
            closure: None,
            ..trial(0.5, false, [0.0; 2])
        };
        assert!(unknown.improves());
    }

    #[test]
    fn limit_what_makes_withheld_readings_worse_has_to_predict_them() {
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
            let found = trial(withheld, decides, closure).holds();
            assert_eq!(found, holds, "{withheld} {decides} {closure:?}");
        }
    }
}
