//! The diagnosis of the gap between model and measurement in the document.

use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::{
    AmplitudeDependence, CommonFactor, DecidedBy, Diagnosis, GapError, Hypothesis,
    HypothesisResult, JointShift, LocationMap, LocationProbabilities, NextTest, Residual,
    UnlocatedSensors, Verdict,
};

/// The gap between model and measurement.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct GapSection {
    /// The answer.
    pub verdict: Verdict,
    /// Location of the gap, given that there is one; null without a diagnosis.
    #[serde(rename = "where")]
    pub place: Option<GapPlaceSection>,
    /// All hypotheses, the most probable first.
    pub hypotheses: Vec<HypothesisResult>,
    /// Root mean square of the standard uncertainties of the fitted frequencies (%).
    pub noise_floor: Option<f64>,
    /// Probability of a misfit as large or larger, under the best hypothesis.
    pub goodness_of_fit: Option<f64>,
    /// Change of the joint when the best hypothesis is added.
    pub joint_shift: Option<JointShift>,
    /// Modes above this number took no part in the fit; null without a diagnosis.
    pub fitted_modes: Option<usize>,
    /// The described model without sensors that have a mass but no stated position; null where every position is
    /// known.
    pub unplaced: Option<UnlocatedSensors>,
    /// "readings", or "priors" where the readings alone would leave the first two hypotheses.
    pub decided_by: Option<DecidedBy>,
    /// Evidence of the decays alone for a joint whose stiffness depends on the amplitude, whatever the
    /// verdict; null where no frequency changes along them.
    pub along_decays: Option<AmplitudeDependence>,
    /// Changes along the beam that would explain the residual of the nominal model.
    pub map: Option<LocationMap>,
    /// Common factor that the frequencies ask for; null where they do not fix it.
    pub common_factor: Option<CommonFactor>,
    /// Reason why there are no spared frequencies, and so no closure; null where there are some.
    pub closure_reason: Option<String>,
    /// Two plain answers beside the diagnosis: nothing added, and one common factor.
    pub baselines: Vec<BaselineSection>,
    /// Tests that would tell more, those first that tell most for their effort.
    pub next_test: Vec<NextTest>,
    /// The model with what was found, to predict with; null where nothing predicts, and where the verdict is
    /// "unknown".
    pub updated_model: Option<UpdatedModelSection>,
}

/// Location of the gap.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct GapPlaceSection {
    /// Probability (1) of joint, fixture, sensor, body, acquisition, unknown.
    pub probability: LocationProbabilities,
    /// Every frequency's error.
    pub modes: Vec<Residual>,
    /// The readings that fit worst.
    pub worst_block: Option<String>,
}

/// A plain answer to set the diagnosis against.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BaselineSection {
    /// "none" or "scale".
    pub name: Baseline,
    /// Errors of the fitted frequencies (%, rms).
    pub gap_after: Option<f64>,
    /// Errors of withheld frequencies (%, rms).
    #[serde(rename = "withheld_after")]
    pub holdout_after: Option<f64>,
}

/// Addition of a plain answer to the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Baseline {
    /// Nothing.
    None,
    /// One common factor on all frequencies.
    Scale,
}

/// A model brought up to date.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct UpdatedModelSection {
    /// The hypothesis that it takes for true.
    pub effect: String,
    /// The file that holds it as a test description; null where none was written.
    pub file: Option<String>,
    /// Its natural frequencies (Hz), sensors where the first recording has them; `tapjoint predict` of the
    /// file gives the same.
    pub frequencies: Vec<f64>,
}

/// Returns the section of a diagnosis, or of the reason why there is none.
pub fn gap_section(diagnosis: Result<&Diagnosis, &GapError>) -> GapSection {
    let found = match diagnosis {
        Ok(found) => found,
        Err(error) => {
            return GapSection {
                verdict: Verdict::NotEnoughData(error.to_string()),
                ..GapSection::default()
            };
        }
    };
    let scale = Hypothesis::Effects(vec![EffectId::Modulus]);
    let plain = [(Baseline::None, Hypothesis::None), (Baseline::Scale, scale)];
    let baselines = plain.into_iter().filter_map(|(name, hypothesis)| {
        let mut all = found.hypotheses.iter();
        let answer = all.find(|one| one.hypothesis == hypothesis)?;
        Some(BaselineSection {
            name,
            gap_after: answer.gap_after,
            holdout_after: answer.holdout_after,
        })
    });
    GapSection {
        verdict: found.verdict.clone(),
        place: Some(GapPlaceSection {
            probability: found.locations,
            modes: found.residuals.clone(),
            worst_block: found.blocks.first().map(|block| block.name.clone()),
        }),
        hypotheses: found.hypotheses.clone(),
        noise_floor: Some(found.noise_floor),
        goodness_of_fit: found.goodness_of_fit,
        joint_shift: Some(found.joint_shift),
        fitted_modes: Some(found.fitted_modes),
        unplaced: found.unlocated.clone(),
        decided_by: Some(found.decided_by),
        along_decays: found.amplitude_dependence.clone(),
        map: found.location_map.clone(),
        common_factor: found.common_factor,
        closure_reason: found.spare_modes_from.map(|modes| {
            format!("no modes are spared for the closure: that needs {modes} modes or more")
        }),
        baselines: baselines.collect(),
        next_test: found.next_tests.clone(),
        updated_model: None,
    }
}

impl GapSection {
    /// The result of a hypothesis.
    pub fn result(&self, hypothesis: &Hypothesis) -> Option<&HypothesisResult> {
        let mut all = self.hypotheses.iter();
        all.find(|found| found.hypothesis == *hypothesis)
    }

    /// The result of the hypothesis that the verdict names; `None` where it names none or several.
    pub fn named(&self) -> Option<&HypothesisResult> {
        match self.verdict.hypotheses().as_slice() {
            [one] => self.result(one),
            _ if self.verdict == Verdict::NoGap => self.result(&Hypothesis::None),
            _ => None,
        }
    }
}
