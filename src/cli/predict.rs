//! `tapjoint predict`: natural frequencies of a known joint.

use super::Outcome;
use super::arguments::{StiffnessArguments, assembly};
use super::input::{TestFile, effect_at, read_model};
use super::terminal::Terminal;
use crate::identify::predict_lambdas;
use crate::pipeline::{TestedStructure, predict_described, structure_details, tested_structure};
use crate::report::document::{Document, PredictionSection};
use crate::report::{lambdas_of, prediction_of};
use crate::structure::{Assembly, JointStiffness, MODE_LIMIT};
use crate::study::updated_model::described_frequencies;
use anyhow::{Context, anyhow, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;

/// Predict the natural frequencies of a beam with a known joint.
///
/// The prediction includes the masses of the sensors, an overlap, unequal halves and the effects that
/// TEST describes. `tapjoint run` and `tapjoint diagnose --model` write such effects. With --joint instead
/// of TEST there is no beam, and only lambda is printed. The stiffnesses are non-dimensional: Kx =
/// Kt L^3/(E I), Ky = Kr L/(E I), Kz = Ktr L^2/(E I).
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint predict --joint cantilever --kx 500 --ky 100 --modes 5\n  tapjoint predict test.toml --kx 970.5 --ky 1.251\n  tapjoint predict test-report/updated-model.toml"
)]
pub(super) struct PredictArguments {
    /// Test description (.toml)
    #[arg(
        value_name = "TEST",
        required_unless_present = "joint",
        conflicts_with = "joint"
    )]
    test: Option<PathBuf>,
    /// Kind of structure, instead of TEST
    #[arg(long, value_name = "KIND", value_parser = assembly())]
    joint: Option<Assembly>,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    /// Number of modes
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = RangedU64ValueParser::<usize>::new().range(1..=MODE_LIMIT as u64))]
    modes: usize,
}

pub(super) fn run(arguments: &PredictArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let document = match (&arguments.test, arguments.joint) {
        (Some(test), _) => {
            let file = read_model(test, &terminal)?;
            let given = arguments.stiffness.given(file.test.joint.kind)?;
            predict(&file, given, arguments.modes)?
        }
        (None, Some(kind)) => {
            let joint = match arguments.stiffness.given(kind)? {
                Some(given) => given,
                None if kind == Assembly::Free => JointStiffness::FREE,
                None => bail!(
                    "the joint's stiffness is missing; give --kx and --ky, \"inf\" for no give"
                ),
            };
            lambdas_of(&predict_lambdas(kind, &joint, arguments.modes)?)
        }
        (None, None) => bail!("nothing to predict; give a test description, or --joint"),
    };
    terminal.tables(&document)?;
    Ok(Outcome::Answered)
}

/// Predicts the frequencies of a described structure with its sensors and its effects.
fn predict(
    file: &TestFile,
    given: Option<JointStiffness>,
    modes: usize,
) -> anyhow::Result<Document> {
    let structure = tested_structure(&file.test);
    if file.test.effects.is_empty() {
        let joint = match given {
            Some(given) => given,
            None => described_joint(&structure, &file.name)?,
        };
        let details = structure_details(&file.test, &structure.beam);
        let rows = predict_described(&structure, &details, &joint, modes)
            .with_context(|| file.name.clone())?;
        return Ok(prediction_of(&file.test.name, &structure, &rows));
    }
    described_joint(&structure, &file.name)?;
    if given.is_some() {
        bail!("effects go with the joint they were found with; leave out --kx, --ky and --kz");
    }
    let frequencies =
        described_frequencies(&file.test, modes).map_err(|error| effect_at(&file.name, &error))?;
    let rows = (1..)
        .zip(frequencies)
        .map(|(mode, frequency)| PredictionSection {
            mode,
            predicted: Some(frequency),
            lambda: Some(structure.beam.lambda_of(frequency)),
            ..PredictionSection::default()
        });
    Ok(Document {
        prediction: Some(rows.collect()),
        ..prediction_of(&file.test.name, &structure, &[])
    })
}

/// Returns the joint that the description gives.
fn described_joint(structure: &TestedStructure, file: &str) -> anyhow::Result<JointStiffness> {
    if structure.assembly == Assembly::Free {
        return Ok(JointStiffness::FREE);
    }
    structure.known.over(None).ok_or_else(|| {
        anyhow!(
            "{file}: the joint's stiffness is missing; give --kx and --ky, or kt and kr in [joint]"
        )
    })
}
