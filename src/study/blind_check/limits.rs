//! What the readings of a drawn test can show at all, by what was planted and not by what was answered.

use super::case::{CaseKind, Truth};
use super::draw::{DrawError, DrawnTest};
use crate::plan::{NOTICED, PlanSettings, plan_of};
use tapjoint_analysis::nominal_with;
use tapjoint_beam::effects::Effect;
use tapjoint_diagnosis::{GapSettings, Hypothesis, diagnose, nominal_chi_square, observe};
use tapjoint_identify::observation::Observations;
use tapjoint_numerics::stats::chi_square_quantile;

/// Relative standard uncertainty of a frequency, mean of five taps at 60 dB: what a steel beam's
/// temperature leaves, since the noise is smaller.
const FREQUENCY_STD: f64 = 5e-5;

impl DrawnTest {
    /// The truth, with what readings without scatter show of it: whether the nominal model misses them by
    /// what is noticed nine times out of ten (one effect), whether so do both of two effects alone (two
    /// effects), and whether the best of the catalogue misses them so far that with the usual scatter chi
    /// square would exceed its 1 % limit (outside it).
    ///
    /// # Errors
    /// [`DrawError`]: a defect of the drawing.
    pub fn with_limits(&self) -> Result<Truth, DrawError> {
        let mut truth = self.truth.clone();
        match truth.kind() {
            CaseKind::Single(_) => truth.detectable = Some(self.is_detectable()?),
            CaseKind::Outside => truth.refutable = self.is_refutable()?,
            CaseKind::Several => truth.detectable = self.are_both_detectable()?,
            CaseKind::Null => {}
        }
        Ok(truth)
    }

    fn is_detectable(&self) -> Result<bool, DrawError> {
        let nominal = nominal_with(&self.description, None);
        let chi_square = nominal_chi_square(&self.exact()?, &nominal, &GapSettings::default())?;
        Ok(chi_square > NOTICED)
    }

    /// Whether readings without scatter are missed by each of the planted effects without the others;
    /// `None` where an effect is no hypothesis of such a test.
    fn are_both_detectable(&self) -> Result<Option<bool>, DrawError> {
        let nominal = nominal_with(&self.description, None);
        let found = diagnose(&self.exact()?, &nominal, &GapSettings::default())?;
        let alone = |effect: &Effect| {
            let own = Hypothesis::Effects(vec![effect.id]);
            let mut all = found.hypotheses.iter();
            let misfit = all.find(|one| one.hypothesis == own)?.misfit?;
            Some(misfit.chi_square)
        };
        let misses: Option<Vec<f64>> = self.effects.iter().map(alone).collect();
        Ok(misses.map(|misses| misses.iter().all(|miss| *miss > NOTICED)))
    }

    fn is_refutable(&self) -> Result<Option<bool>, DrawError> {
        let nominal = nominal_with(&self.description, None);
        let found = diagnose(&self.exact()?, &nominal, &GapSettings::default())?;
        // Scatter adds one for each degree of freedom.
        Ok(found.misfit.and_then(|misfit| {
            let limit = chi_square_quantile(0.99, misfit.freedom)?;
            Some(misfit.chi_square + misfit.freedom > limit)
        }))
    }

    /// Readings without scatter, on a mesh and by a code that the diagnosis does not use.
    fn exact(&self) -> Result<Observations, DrawError> {
        let settings = PlanSettings {
            modes: self.modes,
            frequency_std: FREQUENCY_STD,
            drift: 0.0,
            ..PlanSettings::default()
        };
        let mut plan = plan_of(&self.description, &settings)?;
        plan.scatter = 0.0;
        let mut truth = nominal_with(&self.description, None);
        self.fastened.add_to(&mut truth.specimen);
        Ok(observe(&plan, &truth, &self.effects, 0)?)
    }
}
