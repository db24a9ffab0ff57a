//! `tapjoint predict`: natural frequencies of a known joint.

use super::Outcome;
use super::arguments::StiffnessArguments;
use super::choices::KindArgument;
use super::input::{TestFile, read_model};
use super::terminal::Terminal;
use super::updated_model::effect_at;
use anyhow::{Context, anyhow, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;
use tapjoint::description::JointKind;
use tapjoint::identify::predict_lambdas;
use tapjoint::pipeline::{TestedStructure, predict_described, structure_details, tested_structure};
use tapjoint::report::document::{Document, PredictionSection};
use tapjoint::report::{lambdas_of, prediction_of, render_text};
use tapjoint::structure::{Assembly, JointStiffness};
use tapjoint::study::updated_model::described_frequencies;

/// Predict the natural frequencies of a beam with a known joint, in Hz and as lambda.
///
/// Kx = Kt L^3/(E I), Ky = Kr L/(E I), Kz = Ktr L^2/(E I) are non-dimensional. What TEST says of
/// sensors' masses, of an overlap and of unequal halves is part of the prediction, and so are its
/// effects, as `run` and `diagnose --model` write them. With --joint instead of TEST there is no beam,
/// and lambda alone is printed.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint predict --joint cantilever --kx 500 --ky 100 --modes 5\n  tapjoint predict test.toml --kx 970.5 --ky 1.251\n  tapjoint predict test-report/updated-model.toml"
)]
pub(super) struct PredictArguments {
    /// A test description (.toml)
    #[arg(
        value_name = "TEST",
        required_unless_present = "joint",
        conflicts_with = "joint"
    )]
    test: Option<PathBuf>,
    /// Kind of structure, instead of TEST
    #[arg(long, value_enum, value_name = "KIND")]
    joint: Option<KindArgument>,
    #[command(flatten)]
    stiffness: StiffnessArguments,
    /// How many modes
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = RangedU64ValueParser::<usize>::new().range(1..=100))]
    modes: usize,
}

/// What the frequencies are wanted of.
#[derive(Debug)]
enum Subject {
    /// A described beam.
    Test(Box<TestFile>),
    /// No beam, lambda alone.
    Kind(JointKind),
}

/// The arguments, checked.
#[derive(Debug)]
struct Request {
    subject: Subject,
    stiffness: Option<JointStiffness>,
    modes: usize,
}

fn resolve(arguments: &PredictArguments, terminal: &Terminal) -> anyhow::Result<Request> {
    let subject = match (&arguments.test, arguments.joint) {
        (Some(test), _) => Subject::Test(Box::new(read_model(test, terminal)?)),
        (None, Some(kind)) => Subject::Kind(kind.into()),
        (None, None) => bail!("nothing to predict; give a test description, or --joint"),
    };
    let kind = match &subject {
        Subject::Test(file) => file.test.joint.kind,
        Subject::Kind(kind) => *kind,
    };
    let stiffness = arguments.stiffness.given(kind)?;
    if stiffness.is_none()
        && matches!(
            subject,
            Subject::Kind(JointKind::Cantilever | JointKind::Lap)
        )
    {
        bail!("the joint's stiffness is missing; give --kx and --ky, \"inf\" for no give");
    }
    Ok(Request {
        subject,
        stiffness,
        modes: arguments.modes,
    })
}

pub(super) fn run(arguments: &PredictArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let request = resolve(arguments, &terminal)?;
    let document = match &request.subject {
        Subject::Test(file) if !file.test.effects.is_empty() => {
            let structure = tested_structure(&file.test);
            described_joint(&structure, &file.name)?;
            let document = prediction_of(&file.test.name, &structure, &[]);
            with_effects((document, &structure), file, &request)?
        }
        Subject::Test(file) => {
            let structure = tested_structure(&file.test);
            let joint = match request.stiffness {
                Some(given) => given,
                None => described_joint(&structure, &file.name)?,
            };
            let details = structure_details(&file.test, &structure.beam);
            let rows = predict_described(&structure, &details, &joint, request.modes)
                .with_context(|| file.name.clone())?;
            prediction_of(&file.test.name, &structure, &rows)
        }
        Subject::Kind(kind) => {
            let joint = request.stiffness.unwrap_or(JointStiffness::FREE);
            lambdas_of(&predict_lambdas(assembly(*kind), &joint, request.modes)?)
        }
    };
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(Outcome::Answered)
}

/// The frequencies of a described structure with its sensors and its effects.
fn with_effects(
    (mut document, structure): (Document, &TestedStructure),
    file: &TestFile,
    request: &Request,
) -> anyhow::Result<Document> {
    if request.stiffness.is_some() {
        bail!("effects go with the joint they were found with; leave out --kx, --ky and --kz");
    }
    let frequencies = described_frequencies(&file.test, request.modes)
        .map_err(|error| effect_at(&file.name, &error))?;
    let rows = frequencies
        .iter()
        .enumerate()
        .map(|(index, frequency)| PredictionSection {
            mode: index + 1,
            predicted: Some(*frequency),
            lambda: Some(structure.beam.lambda_of(*frequency)),
            ..PredictionSection::default()
        });
    document.prediction = Some(rows.collect());
    Ok(document)
}

/// The joint that the description gives.
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

fn assembly(kind: JointKind) -> Assembly {
    match kind {
        JointKind::Cantilever => Assembly::Cantilever,
        JointKind::Lap => Assembly::Lap,
        JointKind::Free => Assembly::Free,
    }
}
