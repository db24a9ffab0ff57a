//! What the diagnosis of the gap adds to the document.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

/// The gap between model and measurement.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct GapSection {
    /// The answer.
    pub verdict: GapVerdictSection,
    /// Where the gap lies, given that there is one; null without a diagnosis.
    #[serde(rename = "where")]
    pub place: Option<GapPlaceSection>,
    /// All hypotheses, the most probable first.
    pub hypotheses: Vec<HypothesisSection>,
    /// Root mean square of the standard uncertainties of the fitted frequencies (%).
    pub noise_floor: Option<f64>,
    /// Probability of a misfit as large or larger, under the best hypothesis.
    pub goodness_of_fit: Option<f64>,
    /// How much the joint moves when the best hypothesis is added.
    pub joint_shift: Option<JointShiftSection>,
    /// Modes above this number took no part in the fit; null without a diagnosis.
    pub fitted_modes: Option<usize>,
    /// What the described model is worth without sensors that weigh and sat nobody knows where; null where every
    /// place is known.
    pub unplaced: Option<UnplacedSection>,
    /// "readings", or "priors" where the readings alone would leave the first two hypotheses.
    pub decided_by: Option<String>,
    /// What the decays by themselves say of a joint whose stiffness depends on the amplitude, whatever the
    /// verdict; null where no frequency changes along them.
    pub along_decays: Option<AlongDecaysSection>,
    /// What the residual of the nominal model calls for along the beam.
    pub map: Option<PlaceMapSection>,
    /// Two plain answers beside the diagnosis: nothing added, and one common factor.
    pub baselines: Vec<BaselineSection>,
    /// Tests that would tell more, those first that tell most for their effort.
    pub next_test: Vec<NextTestSection>,
    /// The model with what was found, to predict with; null where nothing predicts, and where the verdict is
    /// "unknown".
    pub updated_model: Option<UpdatedModelSection>,
}

/// Sensors that weigh and sat nobody knows where.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct UnplacedSection {
    /// Their names.
    pub sensors: Vec<String>,
    /// Their mass together (kg).
    pub mass: f64,
    /// Root mean square of the frequency errors of the described model without them (%).
    pub gap: f64,
    /// Probability of a misfit as large or larger without them.
    pub goodness_of_fit: f64,
}

/// A model brought up to date.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct UpdatedModelSection {
    /// The hypothesis that it takes for true.
    pub effect: String,
    /// The file that holds it as a test description; null where none was written.
    pub file: Option<String>,
    /// Its natural frequencies (Hz), sensors where the first recording has them; `tapjoint predict` of the
    /// file gives the same.
    pub frequencies: Vec<f64>,
}

/// Frequencies that change along the decays, and what joint would do that.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct AlongDecaysSection {
    /// "joint-nonlinearity" where a joint's law explains the changes, or all frequencies that change do so
    /// the same way; null where neither holds.
    pub effect: Option<String>,
    /// Whether more than one frequency changes in a certain direction; of one alone nobody can tell what does that.
    pub enough: bool,
    /// Whether a law of the joint's rotation explains the changes: only then `ratio` is its size.
    pub lawful: bool,
    /// Relative change of the joint's rotational stiffness at the largest amplitude (1): negative where it
    /// softens.
    pub ratio: f64,
    /// Its standard uncertainty (1).
    pub ratio_std: f64,
    /// Whether the changes ask for as much as is looked for: `ratio` is then a bound, and `ratio_std` does
    /// not hold.
    pub at_bound: bool,
    /// Power of the amplitude that fits best, of 1/2, 1, 3/2 and 2.
    pub exponent: f64,
    /// Probability that noise, and what the model of a joint's motion leaves open, make the frequencies change
    /// as much: larger than that of noise alone.
    pub chance: f64,
    /// Probability of a misfit as large or larger, if the joint's stiffness changes like that.
    pub goodness_of_fit: Option<f64>,
    /// The frequencies that were followed.
    pub changes: Vec<DecayChangeSection>,
}

/// How a frequency changes along the decays of a recording.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct DecayChangeSection {
    /// The mode.
    pub mode: usize,
    /// The recording.
    pub recording: String,
    /// Amplitude of its taps over that of the hardest recording (1); null where no force was measured.
    pub level: Option<f64>,
    /// Change per e-fold of its amplitude (%): negative where the frequency falls with the amplitude.
    pub percent_per_fold: f64,
    /// Its standard uncertainty (%).
    pub std: f64,
    /// What the joint's law makes of it (%).
    pub explained: f64,
}

/// The answer.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct GapVerdictSection {
    /// "no-gap", "named", "group", "set", "unknown" or "not-enough-data".
    pub kind: String,
    /// The effects it names.
    pub effects: Vec<String>,
    /// Why there is no answer; null where there is one.
    pub reason: Option<String>,
}

impl GapVerdictSection {
    /// The effects as a hypothesis that has them all is called.
    pub fn joined(&self) -> String {
        self.effects.join("+")
    }

    /// Whether this hypothesis is what the verdict names: both of two effects together, or one of several that cannot be
    /// told apart.
    pub fn holds(&self, effect: &str) -> bool {
        match self.kind.as_str() {
            "named" => self.joined() == effect,
            _ => self.effects.iter().any(|one| one == effect),
        }
    }
}

/// Where the gap lies.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct GapPlaceSection {
    /// Probability (1) of joint, fixture, sensor, body, acquisition, unknown.
    pub probability: BTreeMap<String, f64>,
    /// Every frequency's error.
    pub modes: Vec<PullSection>,
    /// The readings that fit worst.
    pub worst_block: Option<String>,
}

/// A frequency's error.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PullSection {
    /// The mode.
    pub mode: usize,
    /// File of the recording, as in `recordings`; "the given frequencies" where none was read.
    pub recording: String,
    /// Amplitude of its taps over that of the hardest recording (1); null where no force is known.
    pub level: Option<f64>,
    /// 100 (predicted - measured)/measured of the nominal model with its joint refitted (%).
    pub error_percent: f64,
    /// That over the standard uncertainty.
    pub z: f64,
    /// The same with the best hypothesis (%).
    pub error_percent_after: f64,
    /// That over the standard uncertainty.
    pub z_after: f64,
}

/// One hypothesis.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct HypothesisSection {
    /// Effect, "none", "unknown", or two effects joined by "+".
    pub effect: String,
    /// Its group; of two effects both, joined by "+".
    pub group: Option<String>,
    /// Its probability (1).
    pub probability: f64,
    /// Logarithm of its evidence over that of "none".
    pub log_bayes_factor: f64,
    /// Effects that predict the same within what these data resolve.
    pub confounded_with: Vec<String>,
    /// Its parameters (SI), by name; of two effects "effect.name".
    pub parameters: BTreeMap<String, ParameterSection>,
    /// Errors of the fitted frequencies with the nominal model, one joint for all recordings (%, rms).
    pub gap_before: Option<f64>,
    /// The same with this hypothesis.
    pub gap_after: Option<f64>,
    /// The same with each mode predicted from the others.
    pub left_out_after: Option<f64>,
    /// Errors of frequencies that took no part, with the nominal model, its joint free to drift between recordings as
    /// under every hypothesis (%, rms).
    pub withheld_before: Option<f64>,
    /// The same with this hypothesis.
    pub withheld_after: Option<f64>,
    /// What measurement uncertainty alone would leave of them (%, rms).
    pub withheld_floor: Option<f64>,
    /// Share of the gap that is closed on withheld data.
    pub closure: Option<ClosureSection>,
    /// Each recording predicted from the others; null with fewer than three, and where the hypothesis is
    /// hardly probable.
    pub left_out_recordings: Option<LeftOutSection>,
    /// Probability of a misfit as large or larger.
    pub goodness_of_fit: Option<f64>,
    /// How much the joint moves when this is added.
    pub joint_shift: JointShiftSection,
    /// Stiffnesses of the joint with it (N/m, N m/rad).
    pub joint: Option<[f64; 2]>,
    /// Their 95 % intervals, low and high (N/m, N m/rad); null where a stiffness was not sought.
    pub joint_intervals: [Option<[f64; 2]>; 2],
}

/// A parameter of an effect.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ParameterSection {
    /// The value (SI).
    pub value: f64,
    /// Its standard uncertainty.
    pub std: Option<f64>,
    /// Smallest size that would be noticed nine times out of ten.
    pub smallest_detectable: Option<f64>,
    /// Smallest size that these data would tell from every other effect.
    pub smallest_isolable: Option<f64>,
}

/// Share of a gap that is closed, with its 95 % interval.
#[derive(Debug, Clone, Copy, Default, Serialize, JsonSchema)]
pub struct ClosureSection {
    /// (before^2 - after^2)/(before^2 - floor^2).
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Recordings predicted from all others, each in turn; the refits are linearised at the optimum.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct LeftOutSection {
    /// Errors of their frequencies with the nominal model (%, rms).
    pub before: f64,
    /// The same with this hypothesis.
    pub after: f64,
    /// What uncertainty alone would leave (%, rms).
    pub floor: f64,
    /// Share of the gap that is closed on them.
    pub closure: Option<ClosureSection>,
    /// Each recording.
    pub recordings: Vec<LeftOutRecordingSection>,
}

/// A recording predicted from all others.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct LeftOutRecordingSection {
    /// Which.
    pub recording: String,
    /// Errors of its frequencies with the nominal model (%, rms).
    pub before: f64,
    /// The same with this hypothesis.
    pub after: f64,
    /// What uncertainty alone would leave (%, rms).
    pub floor: f64,
}

/// Change of the joint (%).
#[derive(Debug, Clone, Copy, Default, Serialize, JsonSchema)]
pub struct JointShiftSection {
    /// Of Kx.
    pub kx_percent: Option<f64>,
    /// Of Ky.
    pub ky_percent: Option<f64>,
}

/// Local changes along the beam.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PlaceMapSection {
    /// Centres of the pieces (m).
    pub positions: Vec<f64>,
    /// Relative change of the bending stiffness, if stiffness alone changes.
    pub stiffness: Vec<f64>,
    /// Its standard uncertainty.
    pub stiffness_std: Vec<f64>,
    /// Relative change of the mass, if mass alone changes.
    pub mass: Vec<f64>,
    /// Its standard uncertainty.
    pub mass_std: Vec<f64>,
    /// Share of the misfit (1) that each piece would explain if its stiffness alone changed.
    pub stiffness_explains: Vec<f64>,
    /// The same of its mass.
    pub mass_explains: Vec<f64>,
    /// Length over which a local change is smeared (m).
    pub resolution: f64,
}

/// A plain answer to set the diagnosis against.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct BaselineSection {
    /// "none" or "scale".
    pub name: String,
    /// Errors of the fitted frequencies (%, rms).
    pub gap_after: Option<f64>,
    /// Errors of withheld frequencies (%, rms).
    pub withheld_after: Option<f64>,
}

/// A test that would tell more.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct NextTestSection {
    /// Its kind: "higher-modes", "move-sensor", "known-mass", ...
    pub id: String,
    /// What to do.
    pub action: String,
    /// Which hypotheses it would tell apart.
    pub separates: Vec<String>,
    /// Hypotheses that could not be predicted in this test: nothing is said of them.
    pub unpredicted: Vec<String>,
    /// Information about the cause that it is expected to bring at least (bit), by the probabilities of the
    /// hypotheses; where the verdict is "unknown", taking the catalogue's effects as equally likely.
    pub bits: f64,
    /// What it costs, in multiples of reading again what is recorded; tests are ranked by bits over this.
    pub effort: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_a_verdict_on_two_effects_holds_for_neither_alone() {
        let verdict = |kind: &str| GapVerdictSection {
            kind: kind.to_owned(),
            effects: vec!["local-crack".to_owned(), "sensor-mass".to_owned()],
            reason: None,
        };
        assert!(verdict("named").holds("local-crack+sensor-mass"));
        assert!(!verdict("named").holds("local-crack"));
        assert!(verdict("group").holds("local-crack"));
        assert!(!verdict("group").holds("fixture"));
    }
}
