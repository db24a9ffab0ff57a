//! `tapjoint run`: from recordings to the joint, with a report.

use super::Outcome;
use super::arguments::RecordingArguments;
use super::bare::{BareSettings, analyse};
use super::choices::{MethodsArgument, ReadingArgument};
use super::input::{TestFile, check_file, is_description, read_test};
use super::output::OutputFolder;
use super::overwrite::Expanded;
use super::terminal::Terminal;
use super::updated_model::add_model;
use anyhow::bail;
use clap::Args;
use std::path::{Path, PathBuf};
use tapjoint::description::TestDescription;
use tapjoint::gap::GapSettings;
use tapjoint::pipeline::{Analysis, IdentifySettings, diagnose_test};
use tapjoint::report::{
    MODEL_FILE, document_of, earlier_files, gap_section, render_run, render_text,
};

/// The main job: recordings to taps, spectra, modes, joint stiffness, perturbation, report.
///
/// Writes report.html, report.json, parameters.csv, modes.csv, perturbation.csv, the model with what the
/// diagnosis found (updated-model.toml) and pictures into a folder. What an earlier run left there is
/// replaced or removed; other files stay.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint run test.toml\n  tapjoint run taps.wav --hammer 1 --out taps-report"
)]
pub(super) struct RunArguments {
    /// A test description (.toml), or a bare recording (WAV, CSV, UFF58; or frequency response
    /// functions in UFF58 or text)
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Folder of the report; default: <name>-report beside FILE
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How frequencies are read; default: as the description says, else fit
    #[arg(long, value_enum, value_name = "R")]
    reading: Option<ReadingArgument>,
    /// Whose estimate is perturbed; with `pairs` the regression is the only estimate
    #[arg(long, value_enum, value_name = "M", default_value_t)]
    method: MethodsArgument,
    #[command(flatten)]
    recording: RecordingArguments,
}

impl RunArguments {
    /// The report's folder, for a test of this name.
    fn folder(&self, name: &str) -> PathBuf {
        let beside = || self.file.with_file_name(report_folder(name));
        self.out.clone().unwrap_or_else(beside)
    }

    /// Returns the files that a report may consist of.
    pub(super) fn expanded(&self, test: Option<&TestDescription>) -> Vec<Expanded> {
        let name = test.map_or_else(|| stem(&self.file), |test| test.name.clone());
        let recordings: Vec<&Path> = match test {
            Some(test) => test
                .recordings
                .iter()
                .map(|recording| recording.file.as_path())
                .collect(),
            None => vec![&self.file],
        };
        let recordings = recordings.iter().filter_map(|file| file.file_name());
        let recordings: Vec<_> = recordings
            .map(|file| serde_json::json!({ "file": file.to_string_lossy() }))
            .collect();
        let report = serde_json::json!({
            "version": 1,
            "recordings": recordings,
            "gap": { "updated_model": { "file": MODEL_FILE } },
            "warnings": [],
        });
        let folder = self.folder(&name);
        let files = earlier_files(&report.to_string());
        vec![("out", files.iter().map(|file| folder.join(file)).collect())]
    }
}

fn stem(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Monte Carlo samples of the report, as many as its picture shows; `perturb` draws more.
const SAMPLES: usize = 1000;

/// What is to be run.
#[derive(Debug)]
enum Subject {
    /// A described test.
    Test(Box<TestFile>),
    /// A bare recording.
    Recording(PathBuf),
}

/// The arguments, checked.
#[derive(Debug)]
struct Request {
    subject: Subject,
    /// Where the report is to appear.
    output: OutputFolder,
}

/// Reads the description and checks, before any work, that its recordings can be read and the
/// report can be written.
fn resolve(arguments: &RunArguments, terminal: &Terminal) -> anyhow::Result<Request> {
    let (subject, name) = if is_description(&arguments.file) {
        if arguments.recording.hammer.is_some() || arguments.recording.sample_rate.is_some() {
            bail!(
                "--hammer and --sample-rate are for bare recordings; a test description says both: `channel` in [hammer], `sample_rate` in [[recording]]"
            );
        }
        let mut file = read_test(&arguments.file, terminal)?;
        if let Some(reading) = arguments.reading {
            file.test.analysis.reading = reading.into();
        }
        file.test.check_has_data(&file.name)?;
        file.check_recordings()?;
        let name = file.test.name.clone();
        (Subject::Test(Box::new(file)), name)
    } else {
        check_file(&arguments.file)?;
        (
            Subject::Recording(arguments.file.clone()),
            stem(&arguments.file),
        )
    };
    let output = OutputFolder::prepare(&arguments.folder(&name))?;
    Ok(Request { subject, output })
}

/// The folder name that belongs to a test's name. What no file system takes becomes a hyphen.
fn report_folder(name: &str) -> String {
    let taken = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    let name: String = name
        .chars()
        .map(|c| if taken(c) { '-' } else { c })
        .take(100)
        .collect();
    let name = name.trim_matches(|c: char| c == '.' || c.is_whitespace());
    if name.is_empty() {
        "test-report".to_owned()
    } else {
        format!("{name}-report")
    }
}

pub(super) fn run(
    arguments: &RunArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let request = resolve(arguments, &terminal)?;
    let progress = terminal.progress("measuring, fitting and estimating");
    let analysis = match &request.subject {
        Subject::Test(file) => file.analyse(&IdentifySettings {
            monte_carlo: Some((SAMPLES, seed)),
            ..arguments.method.settings()
        })?,
        Subject::Recording(path) => {
            let settings = BareSettings {
                reading: arguments.reading.unwrap_or_default().into(),
                ..BareSettings::default()
            };
            analyse(path, &arguments.recording, &settings)?
        }
    };
    let mut document = document_of(&analysis);
    let mut model = None;
    if let Subject::Test(file) = &request.subject {
        let settings = GapSettings {
            seed,
            ..GapSettings::default()
        };
        let diagnosis = diagnose_test(&file.test, &analysis, &settings);
        let mut gap = gap_section(diagnosis.as_ref());
        model = add_model(
            &mut gap,
            (file, Some(MODEL_FILE.to_owned())),
            (&analysis, diagnosis.as_ref()),
        );
        document.gap = Some(gap);
    }
    drop(progress);
    if let Some(model) = model {
        request.output.add(MODEL_FILE, model.as_bytes())?;
    }
    for file in render_run(&document, &analysis.recordings)? {
        request.output.add(&file.name, &file.bytes)?;
    }
    // Where the folder holds an earlier run's report, what this run does not make again would belong to
    // nothing. Other commands write a report.json alone.
    let page = request.output.earlier("report.html");
    let earlier = page.and(request.output.earlier("report.json"));
    let stale = earlier.map_or_else(Vec::new, |report| earlier_files(&report));
    let (folder, left) = request.output.publish_without(&stale, terminal.files())?;
    terminal.say(&render_text(&document))?;
    terminal.say(&format!("Report  {}", folder.join("report.html").display()))?;
    terminal.write_document(&document)?;
    left.map_or_else(|| Ok(outcome(&analysis)), |left| Err(left.into()))
}

/// A test is answered when there is an estimate, or a prediction (from known stiffnesses) beside a
/// measured mode; a bare recording when there is a mode.
pub(super) fn outcome(analysis: &Analysis) -> Outcome {
    let answered = match &analysis.identification {
        Some(found) => {
            found.is_answered() || found.prediction.iter().any(|mode| mode.measured.is_some())
        }
        None => analysis.modes.iter().any(|mode| mode.mode.is_some()),
    };
    if answered {
        Outcome::Answered
    } else {
        Outcome::NoAnswer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_report_folders_have_names_that_can_be_made() {
        let cases = [
            (
                "Cantilever, one-bolt clamp",
                "Cantilever, one-bolt clamp-report",
            ),
            ("../a/b", "-a-b-report"),
            (" ... ", "test-report"),
            ("x\ny", "x-y-report"),
        ];
        for (name, expected) in cases {
            assert_eq!(report_folder(name), expected, "{name:?}");
            assert_eq!(Path::new(expected).components().count(), 1, "{expected:?}");
        }
    }
}
