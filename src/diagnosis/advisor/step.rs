//! What could be done next, in plain words and numbers.

use super::confirm::confirming;
use schemars::JsonSchema;
use serde::Serialize;
use tapjoint_beam::effects::EffectId;

/// A test that could be made, or a record that could be read again.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "String")]
pub enum Step {
    /// Read higher modes.
    HigherModes {
        /// The lowest of them.
        first: usize,
        /// The highest.
        last: usize,
        /// Whether recordings are at hand that may show them.
        is_recorded: bool,
    },
    /// Read frequencies by a fit, or on lines so close, instead of on lines.
    FinerLines {
        /// Largest distance of the lines (Hz).
        spacing: f64,
    },
    /// Repeat the first recording with so many times the taps.
    MoreTaps {
        /// How many times as many.
        factor: usize,
    },
    /// Tap at another level.
    TapLevel {
        /// Force over that of the hardest recording so far (1).
        level: f64,
    },
    /// Weigh the sensor with its mounting.
    WeighSensor,
    /// Weigh and measure the beam.
    Calipers,
    /// Record a tone whose frequency is known.
    ReferenceTone,
    /// Put a sensor elsewhere.
    MoveSensor {
        /// Which.
        name: String,
        /// Its new place (m).
        position: f64,
    },
    /// Fasten a known mass.
    KnownMass {
        /// The mass (kg).
        mass: f64,
        /// Where (m).
        position: f64,
    },
    /// Loosen the joint, tighten it again, and repeat the first recording.
    Retighten,
    /// Turn the set-up over, so that gravity pulls the other way along the beam.
    TurnOver,
    /// Take the beam out of its joint and test it by itself.
    BareBeam,
    /// See directly whether a cause that was named is there.
    Confirm {
        /// Which.
        effect: EffectId,
    },
}

impl Step {
    /// As reports and scripts call it.
    pub fn id(&self) -> &'static str {
        match self {
            Step::HigherModes { .. } => "higher-modes",
            Step::FinerLines { .. } => "finer-lines",
            Step::MoreTaps { .. } => "more-taps",
            Step::TapLevel { .. } => "tap-level",
            Step::WeighSensor => "weigh-sensor",
            Step::Calipers => "calipers",
            Step::ReferenceTone => "reference-tone",
            Step::MoveSensor { .. } => "move-sensor",
            Step::KnownMass { .. } => "known-mass",
            Step::Retighten => "retighten",
            Step::TurnOver => "turn-over",
            Step::BareBeam => "bare-beam",
            Step::Confirm { .. } => "confirm",
        }
    }

    /// What it costs, in multiples of reading again what is recorded: 2, another recording or a weighing on
    /// the set-up as it stands; 3, something moved or fastened; 4, the joint opened; 6, the rig
    /// turned; 8, taken apart. Tests that leave the joint untouched come cheap for a second
    /// reason: what a joint drifts between visits hides what was to be seen.
    pub fn effort(&self) -> f64 {
        match self {
            Step::HigherModes { .. } | Step::FinerLines { .. } => 1.0,
            Step::MoreTaps { .. }
            | Step::TapLevel { .. }
            | Step::WeighSensor
            | Step::Calipers
            | Step::ReferenceTone
            | Step::Confirm { .. } => 2.0,
            Step::MoveSensor { .. } | Step::KnownMass { .. } => 3.0,
            Step::Retighten => 4.0,
            Step::TurnOver => 6.0,
            Step::BareBeam => 8.0,
        }
    }

    /// In one sentence, without its full stop.
    pub(super) fn sentence(&self) -> String {
        match self {
            Step::HigherModes {
                first,
                last,
                is_recorded,
            } => format!(
                "read modes {first} to {last} as well{}",
                match is_recorded {
                    true => ", from the recordings at hand if their band reaches so far",
                    false => "",
                }
            ),
            Step::FinerLines { spacing } => format!(
                "read the frequencies by a curve fit, or on lines of {spacing:.3} Hz or closer"
            ),
            Step::MoreTaps { factor } => format!(
                "repeat the first measurement with {factor} times as many taps, everything else untouched"
            ),
            Step::TapLevel { level } if *level < 1.0 => format!(
                "tap at {:.0} % of the force, everything else untouched",
                100.0 * level
            ),
            Step::TapLevel { level } => {
                format!("tap {level:.0} times as hard, everything else untouched")
            }
            Step::WeighSensor => {
                "weigh each sensor of unknown mass with its mounting and the cable that hangs on it to 0.5 g, and state it".into()
            }
            Step::Calipers => {
                "weigh the beam to 0.1 %, measure its thickness to 0.01 mm and its free length to 0.2 mm".into()
            }
            Step::ReferenceTone => {
                "record a tone of known frequency beside the taps and compare the clocks to 20 ppm".into()
            }
            Step::MoveSensor { name, position } => format!(
                "move {name} to {position:.3} m, leave everything else untouched, and tap again"
            ),
            Step::KnownMass { mass, position } => format!(
                "fasten {0} at {position:.3} m, leave everything else untouched, tap again, and describe that \
                 [[recording]] with mass = [{{ position = {position:.3}, mass = \"{0}\" }}]",
                weight(*mass)
            ),
            Step::Confirm { effect } => confirming(*effect),
            Step::Retighten => {
                "loosen the joint, tighten it as before, and repeat the first recording".into()
            }
            Step::TurnOver => {
                "turn the set-up over, so that gravity pulls the other way along the beam, and tap again".into()
            }
            Step::BareBeam => {
                "take the beam out of its joint, lay it on soft foam without a sensor, and tap it with a \
                 microphone beside it"
                    .into()
            }
        }
    }
}

impl From<Step> for String {
    fn from(step: Step) -> String {
        step.id().to_owned()
    }
}

/// "15 g", "1.5 kg".
fn weight(mass: f64) -> String {
    if mass < 1.0 {
        format!("{} g", rounded(1e3 * mass))
    } else {
        format!("{} kg", rounded(mass))
    }
}

fn rounded(value: f64) -> f64 {
    (1e3 * value).round() / 1e3
}

/// A test that would tell more, and how much.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NextTest {
    /// What to do: "higher-modes", "move-sensor", "known-mass", ...
    #[serde(rename = "id")]
    pub step: Step,
    /// The same in a sentence, without its full stop.
    pub action: String,
    /// Hypotheses that it would tell apart, those that contribute most first.
    pub separates: Vec<String>,
    /// Hypotheses that could not be predicted in this test, so that nothing is said of them.
    pub unpredicted: Vec<String>,
    /// Information about which hypothesis is true that it is expected to bring at least (bit); what it might
    /// tell of hypotheses that could not be predicted is no part of it.
    pub bits: f64,
    /// What it costs, in multiples of reading again what is recorded; tests are ranked by bits over this.
    pub effort: f64,
}

impl NextTest {
    /// Information per cost (bit), by which tests are ranked.
    pub fn worth(&self) -> f64 {
        self.bits / self.effort
    }
}
