//! What several modules begin with: a beam, its tests, and the real recordings where they are at hand.

use std::path::{Path, PathBuf};
use tapjoint::description::TestDescription;
use tapjoint::effects::{Effect, EffectId};
use tapjoint::gap::{
    DescriptionUncertainty, Nominal, NominalSensor, PlannedConfiguration, TestPlan,
};
use tapjoint::identify::consistent::{
    BeamTolerances, ConsistentEstimate, ConsistentEstimator, ConsistentSettings, JointedStructure,
};
use tapjoint::identify::{IdentifyError, MeasuredMode};
use tapjoint::recording::{WavFormat, write_wav};
use tapjoint::simulate::{Laboratory, VirtualTest};
use tapjoint::structure::Beam;
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::{Body, Joint, Specimen};

/// The cantilever of Ingole & Chatterjee, table 2.
pub fn steel_strip() -> Beam {
    Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

/// The consistent estimate of a structure from its modes.
pub fn estimate_consistently(
    structure: &JointedStructure,
    modes: &[MeasuredMode],
    settings: &ConsistentSettings,
) -> Result<ConsistentEstimate, IdentifyError> {
    ConsistentEstimator::new(structure, modes, settings)?.estimate()
}

/// The strip's table in a description.
macro_rules! strip_table {
    () => {
        "[beam]\nlength = 0.423\nwidth = 0.05\nthickness = 0.005\nmodulus = 207e9\ndensity = 7850\n"
    };
}
pub(crate) use strip_table;

/// The strip on a joint as a virtual test is described; what is given goes on in [joint].
macro_rules! virtual_strip {
    ($rest:literal) => {
        concat!(
            "name = \"virtual\"\n",
            $crate::shared::strip_table!(),
            "[joint]\nkind = \"cantilever\"\nkt = 1.994e6\nkr = 1223.0\nbeam = \"euler\"\n",
            $rest
        )
    };
}
pub(crate) use virtual_strip;

/// The strip with a hammer and sensor A at four fifths; the given text follows.
macro_rules! tapped_strip {
    ($($rest:expr),* $(,)?) => {
        concat!(
            $crate::shared::virtual_strip!(""),
            "[hammer]\nchannel = 1\n[[sensor]]\nname = \"A\"\nposition = 0.338\n",
            $($rest),*
        )
    };
}
pub(crate) use tapped_strip;

/// The strip with a calibrated hammer and a calibrated sensor A at four fifths; the given text follows.
macro_rules! calibrated_strip {
    ($($rest:expr),* $(,)?) => {
        concat!(
            $crate::shared::virtual_strip!("model = \"2p\"\n"),
            "[hammer]\nchannel = 1\nscale = 400\n",
            "[[sensor]]\nname = \"A\"\nchannel = 2\nscale = 4000\nposition = 0.338\n",
            $($rest),*
        )
    };
}
pub(crate) use calibrated_strip;

/// A recording's table: its file, the place of its taps (m), and the end of its band (Hz).
macro_rules! recording_table {
    ($file:literal, $tap:literal, $highest:literal) => {
        concat!(
            "[[recording]]\nfile = \"",
            $file,
            "\"\ntap = ",
            $tap,
            "\nband = [0, ",
            $highest,
            "]\n"
        )
    };
}
pub(crate) use recording_table;

/// The description that this text is.
pub fn described(text: &str) -> TestDescription {
    TestDescription::parse(text, "test.toml").unwrap()
}

/// An effect with these values (SI); the others are typical ones.
pub fn effect(id: EffectId, pairs: &[(&str, f64)]) -> Effect {
    Effect::from_pairs(id, pairs).unwrap()
}

/// Writes the recordings of a virtual test into a folder.
pub fn record(test: &VirtualTest, laboratory: &Laboratory, folder: &Path, format: WavFormat) {
    for recording in &test.recordings {
        let mut run = recording.begin(laboratory);
        let mut frame = vec![0.0; test.scales.len()];
        let mut channels = vec![Vec::new(); frame.len()];
        while run.next_frame(&mut frame) {
            for (channel, value) in channels.iter_mut().zip(&frame) {
                channel.push(*value);
            }
        }
        let path = folder.join(&recording.file);
        write_wav(&path, recording.plan.sample_rate, &channels, format).unwrap();
    }
}

/// The strip on springs of `off` times the joint of Ingole & Chatterjee, without coupling, as it is described
/// with a sensor A of this mass (kg).
pub fn strip_on_springs(off: f64, mass: Option<f64>) -> Nominal {
    let sensor = NominalSensor {
        name: "A".to_owned(),
        mass,
        position: None,
    };
    let beam = steel_strip();
    let units = StiffnessUnits::of(&beam);
    let joint = Some(Joint {
        kt: off * 1400.0 * units.kt,
        kr: off * 1.25 * units.kr,
        coupling: 0.0,
    });
    Nominal {
        specimen: Specimen::new(Body::One(beam), joint),
        sensors: vec![sensor],
        joint_before: None,
        uncertainty: well_known(),
        reading_bias: None,
    }
}

/// How well a carefully measured bar is known: its properties together to 0.2 % of the frequencies.
pub fn well_known() -> DescriptionUncertainty {
    DescriptionUncertainty {
        beam: BeamTolerances {
            length: Some(5e-4),
            width: Some(1e-3),
            thickness: Some(1e-3),
            modulus: Some(2e-3),
            density: Some(1e-3),
            poisson: Some(0.02),
        },
        masses: 0.02,
        positions: 1e-3,
        ..DescriptionUncertainty::default()
    }
}
/// A planned recording of sensor A, places as shares of the length.
pub fn planned(sensor: f64, tap: f64, level: f64) -> PlannedConfiguration {
    let length = steel_strip().length;
    PlannedConfiguration {
        sensors: vec![("A".to_owned(), sensor * length)],
        masses: Vec::new(),
        tap: tap * length,
        level,
    }
}

/// Five recordings of six modes: two sensor places, three tap places, two tap levels.
pub fn five_recordings() -> TestPlan {
    TestPlan {
        configurations: vec![
            planned(0.8, 0.95, 1.0),
            planned(0.8, 0.95, 0.25),
            planned(0.8, 0.55, 1.0),
            planned(0.45, 0.95, 1.0),
            planned(0.45, 0.3, 1.0),
        ],
        modes: 6,
        taps: 5,
        frequency_std: 3e-4,
        shape_std: Some(0.03),
        damping_std: Some(0.03),
        slope_std: Some(1e-4),
        drift: 0.005,
        damping: 0.003,
        scatter: 1.0,
    }
}

/// Returns the path of a file or folder in the folder that TAPJOINT_DATA names.
///
/// Tests that call it are ignored by default. `--include-ignored` runs them.
pub fn data(name: &str) -> PathBuf {
    let folder = std::env::var_os("TAPJOINT_DATA")
        .expect("TAPJOINT_DATA has to name the folder of real recordings");
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "{} is missing", path.display());
    path
}
