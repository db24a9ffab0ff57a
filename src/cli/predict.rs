//! `tapjoint predict`: natural frequencies of a known joint.

use super::Outcome;
use super::arguments::{CrossStiffness, Stiffness};
use super::choices::KindArgument;
use super::input::{TestFile, read_model};
use super::terminal::Terminal;
use anyhow::{anyhow, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::PathBuf;
use tapjoint::description::JointKind;
use tapjoint::identify::{predict, predict_lambdas};
use tapjoint::pipeline::{TestedStructure, tested_structure};
use tapjoint::report::document::{Document, PredictionSection};
use tapjoint::report::{lambdas_of, prediction_of, render_text};
use tapjoint::structure::{Assembly, JointStiffness};
use tapjoint::study::updated_model::{described_effects, frequencies_with};

/// Predict the natural frequencies of a beam with a known joint, in Hz and as lambda.
///
/// Kx = Kt L^3/(E I), Ky = Kr L/(E I), Kz = Ktr L^2/(E I) are non-dimensional. With --joint
/// instead of TEST there is no beam, and lambda alone is printed. TEST may be a model with effects, as
/// `run` and `diagnose --model` write it; sensors whose mass is stated are on the beam then.
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
    /// Translational stiffness, 0 to inf (non-dimensional); default: kt of TEST
    #[arg(long, value_name = "N", requires = "ky", allow_negative_numbers = true)]
    kx: Option<Stiffness>,
    /// Rotational stiffness, 0 to inf (non-dimensional); default: kr of TEST
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true)]
    ky: Option<Stiffness>,
    /// Cross-coupling stiffness, negative for a soft root (non-dimensional); default: no coupling
    #[arg(long, value_name = "N", requires = "kx", allow_negative_numbers = true)]
    kz: Option<CrossStiffness>,
    /// How many modes
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = RangedU64ValueParser::<usize>::new().range(1..=100))]
    modes: usize,
}

/// Non-dimensional stiffnesses of a joint: kx and ky from 0 to infinity, 1/kz with 0 for no
/// coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GivenStiffness {
    pub(super) kx: f64,
    pub(super) ky: f64,
    pub(super) cross_compliance: f64,
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
    stiffness: Option<GivenStiffness>,
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
    let stiffness = given_stiffness((arguments.kx, arguments.ky, arguments.kz), kind)?;
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

/// The stiffnesses that --kx, --ky and --kz give.
///
/// # Errors
/// A free beam, a lap joint's coupling, a joint that would be a source of energy.
pub(super) fn given_stiffness(
    (kx, ky, kz): (Option<Stiffness>, Option<Stiffness>, Option<CrossStiffness>),
    kind: JointKind,
) -> anyhow::Result<Option<GivenStiffness>> {
    let Some((Stiffness(kx), Stiffness(ky))) = kx.zip(ky) else {
        return Ok(None);
    };
    if kind == JointKind::Free {
        bail!("a free beam has no joint; leave out --kx, --ky and --kz");
    }
    let Some(CrossStiffness(kz)) = kz else {
        return Ok(Some(GivenStiffness {
            kx,
            ky,
            cross_compliance: 0.0,
        }));
    };
    if kind == JointKind::Lap {
        bail!("a lap joint has no coupling stiffness; leave out --kz");
    }
    // A passive joint's compliance matrix is positive definite: 1/Kz^2 < 1/(Kx Ky). Taken as a
    // quotient of roots, because products of large stiffnesses overflow.
    let ratio = (kx / kz.abs()) * (ky / kz.abs());
    if kz.is_finite() && (ratio.is_nan() || ratio >= 1.0) {
        let limit = kx.sqrt() * ky.sqrt();
        return Err(anyhow!(
            "--kz {kz} makes the joint a source of energy; its size must exceed sqrt(kx ky) = {limit:.6}"
        ));
    }
    Ok(Some(GivenStiffness {
        kx,
        ky,
        cross_compliance: kz.recip(),
    }))
}

pub(super) fn run(arguments: &PredictArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let request = resolve(arguments, &terminal)?;
    let document = match &request.subject {
        Subject::Test(file) if has_more_than_a_joint(&request, file) => {
            let structure = tested_structure(&file.test);
            described_joint(&structure, &file.name)?;
            let document = prediction_of(&file.test.name, &structure, &[]);
            with_effects((document, &structure), file, &request)?
        }
        Subject::Test(file) => {
            let structure = tested_structure(&file.test);
            let joint = match request.stiffness {
                Some(given) => given.joint(),
                None => described_joint(&structure, &file.name)?,
            };
            let place = (structure.assembly, &joint);
            let rows = predict(
                structure.theory,
                &structure.beam,
                place,
                (&[], &[]),
                request.modes,
            )?;
            prediction_of(&file.test.name, &structure, &rows)
        }
        Subject::Kind(kind) => {
            let joint = request
                .stiffness
                .map_or(JointStiffness::FREE, |given| given.joint());
            lambdas_of(&predict_lambdas(assembly(*kind), &joint, request.modes)?)
        }
    };
    terminal.say(&render_text(&document))?;
    terminal.write_document(&document)?;
    Ok(Outcome::Answered)
}

/// Whether there is something on the beam that its frequency equation does not know: effects, or heavy
/// sensors beside a described joint. Stiffnesses on the command line are those of the bare beam.
fn has_more_than_a_joint(request: &Request, file: &TestFile) -> bool {
    let test = &file.test;
    let heavy = test.analysis.sensor_mass && test.sensors.iter().any(|one| one.mass > Some(0.0));
    !test.effects.is_empty() || (heavy && request.stiffness.is_none())
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
    let effects = described_effects(&file.test).map_err(|e| anyhow!("{}: {e}", file.name))?;
    let frequencies = frequencies_with(&file.test, &effects, None, request.modes)?;
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

impl GivenStiffness {
    /// In the theory's terms.
    pub(super) fn joint(self) -> JointStiffness {
        JointStiffness {
            kx: self.kx,
            ky: self.ky,
            cross_compliance: self.cross_compliance,
        }
    }
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
