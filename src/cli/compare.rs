//! `tapjoint compare`: what changed between two tests, or in a series of tests.

use super::Outcome;
use super::arguments::{FullAnswer, repeatability};
use super::input::{TestFile, check_file, read_test};
use super::output::OutputFile;
use super::overwrite::Expanded;
use super::place::is_description;
use super::publication::OutputFolder;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::compare::{
    LEAST_SERIES, MOST_PAIRS, MOST_REPEATS, MOST_SERIES, Pair, Settings, Test, compare, watch,
};
use crate::pipeline::{
    IdentifySettings, RecordingResult, Stage, TestedStructure, Warning, Work, compared_test,
};
use crate::report::document::{Document, PairFiles};
use crate::report::{
    ComparedRecordings, compared_files, comparison_of, draw_compared, earlier_files,
    render_comparison_picture, render_series_csv, series_of,
};
use anyhow::{anyhow, bail};
use clap::Args;
use std::mem;
use std::path::{Path, PathBuf, absolute};

/// Say what changed between two tests, or in a series of tests.
///
/// BEFORE and AFTER are test descriptions. With --test they may also be recordings or files of functions, each read
/// in the place of the first recording that TEST describes. Errors of the model that both tests share cancel:
/// what is compared is the change of each frequency. With --out a report folder gets report.html, report.json,
/// CSV files and pictures. Where both tests have recordings of the same sensor, a picture shows their spectra over each other.
/// Files of an earlier report are replaced or removed. Other files stay.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint compare before.toml after.toml\n  tapjoint compare monday.wav friday.wav --test test.toml --repeatability \"0.1 %\"\n  tapjoint compare before.toml after.toml --out report\n  tapjoint compare --before 1.toml 2.toml --after 3.toml 4.toml\n  tapjoint compare --pair a1.toml a2.toml --pair b1.toml b2.toml\n  tapjoint compare --series week1.toml week2.toml week3.toml --png charts.png"
)]
pub(super) struct CompareArguments {
    /// Test before the change
    #[arg(value_name = "BEFORE", id = "first", requires = "second", conflicts_with_all = ["before", "after", "pair"])]
    first: Option<PathBuf>,
    /// Test after the change
    #[arg(value_name = "AFTER", id = "second")]
    second: Option<PathBuf>,
    /// Description for recordings that have none
    #[arg(long, value_name = "TEST")]
    test: Option<PathBuf>,
    /// Repeated tests before the change; their scatter is the repeatability
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "after", conflicts_with = "pair")]
    before: Vec<PathBuf>,
    /// Repeated tests after the change
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "before")]
    after: Vec<PathBuf>,
    /// Test before and test after; several pairs share one change
    #[arg(long, value_name = "FILE", num_args = 2)]
    pair: Vec<PathBuf>,
    /// Tests in the order of time. Finds the first test that differs from those before it, and says what changed
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["first", "before", "after", "pair"])]
    series: Vec<PathBuf>,
    /// Standard deviation of the difference of a frequency between two tests of one state, such as "0.1 %"; default: from
    /// repeats or the scatter of a series, else about 0.1 % is assumed
    #[arg(long, value_name = "R", value_parser = repeatability)]
    repeatability: Option<f64>,
    /// Folder of the report; default: none is written
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Draw the changes of the frequencies and the causes, or the control charts of a series, into this file (PNG, or SVG if its
    /// name ends in .svg)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write a row for each test and chart of a series into this file (CSV)
    #[arg(long, value_name = "FILE", requires = "series")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    full: FullAnswer,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

impl CompareArguments {
    /// Returns the files that a report may consist of; empty without a report.
    pub(super) fn expanded(&self) -> Vec<Expanded> {
        let Some(folder) = &self.out else {
            return Vec::new();
        };
        let mut report = serde_json::json!({ "version": 1, "compare": {}, "warnings": [] });
        if !self.series.is_empty() {
            report["series"] = serde_json::json!({});
        }
        let files = earlier_files(&report.to_string());
        vec![("out", files.iter().map(|file| folder.join(file)).collect())]
    }

    /// Returns the tests before and after of each pair; empty where none were given.
    fn pairs(&self) -> Vec<[&[PathBuf]; 2]> {
        match (&self.first, &self.second) {
            (Some(before), Some(after)) => vec![[before, after].map(std::slice::from_ref)],
            _ if !self.before.is_empty() => vec![[&self.before, &self.after]],
            _ => {
                let pairs = self.pair.chunks_exact(2);
                pairs.map(|pair| [&pair[..1], &pair[1..]]).collect()
            }
        }
    }
}

/// A test that was read and analysed.
struct Side {
    name: String,
    structure: TestedStructure,
    compared: Test,
    recordings: Vec<RecordingResult>,
}

/// Everything that is written beside the answer.
struct Outputs {
    report: Option<OutputFolder>,
    png: Option<OutputFile>,
    csv: Option<OutputFile>,
}

pub(super) fn run(arguments: &CompareArguments, terminal: Terminal) -> anyhow::Result<Outcome> {
    let count = arguments.pair.len() / 2;
    if count > MOST_PAIRS {
        bail!(
            "--pair: {count} pairs are more than the {MOST_PAIRS} that can share one change; give fewer"
        );
    }
    for (side, tests) in [("before", &arguments.before), ("after", &arguments.after)] {
        if tests.len() > MOST_REPEATS {
            bail!(
                "--{side}: {} repeats are more than the {MOST_REPEATS} that are compared; give fewer",
                tests.len()
            );
        }
    }
    let count = arguments.series.len();
    if !arguments.series.is_empty() && !(LEAST_SERIES..=MOST_SERIES).contains(&count) {
        bail!("--series: {count} tests, but a series has between {LEAST_SERIES} and {MOST_SERIES}");
    }
    // clap does not ask for a series beside arguments that exclude one.
    if arguments.csv.is_some() && arguments.series.is_empty() {
        bail!(
            "--csv holds the rows of a series; give --series, or --out, whose changes.csv has the rows of other comparisons"
        );
    }
    let report = arguments.out.as_deref();
    let report = report.map(|folder| OutputFolder::prepare(folder, terminal.files()));
    let outputs = Outputs {
        report: report.transpose()?,
        png: OutputFile::prepare_optional(arguments.png.as_deref())?,
        csv: OutputFile::prepare_optional(arguments.csv.as_deref())?,
    };
    let template = arguments
        .test
        .as_deref()
        .map(|test| read_test(test, &terminal))
        .transpose()?;
    let mut warnings = Vec::new();
    // Spectra are large: only those that the report shows are kept, of the first tests before and after.
    let shows_spectra = outputs.report.is_some() && arguments.series.is_empty();
    let mut shown = Vec::new();
    let mut read = |files: &[PathBuf]| -> anyhow::Result<Vec<Side>> {
        let mut sides = Vec::with_capacity(files.len());
        for file in files {
            let mut side = read_side(file, template.as_ref(), &terminal, &mut warnings)?;
            let recordings = mem::take(&mut side.recordings);
            if shows_spectra && sides.is_empty() && shown.len() < 2 {
                shown.push(recordings);
            }
            sides.push(side);
        }
        Ok(sides)
    };
    let settings = Settings {
        repeatability: arguments.repeatability,
    };
    if !arguments.series.is_empty() {
        let sides = read(&arguments.series)?;
        let (name, structure) = (sides[0].name.clone(), sides[0].structure);
        let tests: Vec<Test> = sides.into_iter().map(|side| side.compared).collect();
        let work = Work::begin(terminal.watch(), Stage::Comparison);
        let found = watch(&tests, &settings)?;
        drop(work);
        let mut recordings = ComparedRecordings::default();
        if let Some((_, departure)) = found.series.departure()
            && outputs.report.is_some()
        {
            // Reading two tests again takes less than keeping the spectra of all.
            let [before, after] = departure.compared();
            let again = |test: usize| {
                let file = &arguments.series[test];
                read_side(file, template.as_ref(), &terminal, &mut Vec::new())
            };
            recordings.before = again(before.start)?.recordings;
            recordings.after = again(after.start)?.recordings;
        }
        let files = names(&arguments.series);
        let document = series_of(&name, &structure, files, found, warnings);
        return answer(document, &recordings, outputs, &arguments.full, terminal);
    }
    let (mut first, mut files, mut pairs) = (None, Vec::new(), Vec::new());
    for [before, after] in arguments.pairs() {
        files.push(PairFiles {
            before: names(before),
            after: names(after),
        });
        let (before, after) = (read(before)?, read(after)?);
        first = first.or_else(|| Some((before.first()?.name.clone(), before.first()?.structure)));
        pairs.push(Pair {
            before: before.into_iter().map(|side| side.compared).collect(),
            after: after.into_iter().map(|side| side.compared).collect(),
        });
    }
    let Some((name, structure)) = first else {
        bail!(
            "there is nothing to compare; give BEFORE and AFTER, --before and --after, --pair, or --series"
        );
    };
    let work = Work::begin(terminal.watch(), Stage::Comparison);
    let found = compare(&pairs, &settings)?;
    drop(work);
    let document = comparison_of(&name, &structure, files, found, warnings);
    let mut shown = shown.into_iter();
    let recordings = ComparedRecordings {
        before: shown.next().unwrap_or_default(),
        after: shown.next().unwrap_or_default(),
    };
    answer(document, &recordings, outputs, &arguments.full, terminal)
}

/// Returns files as the user named them.
fn names(files: &[PathBuf]) -> Vec<String> {
    let names = files.iter().map(|file| file.display().to_string());
    names.collect()
}

/// Writes everything that was asked for, and prints the answer.
fn answer(
    mut document: Document,
    recordings: &ComparedRecordings,
    outputs: Outputs,
    full: &FullAnswer,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let mut work = Work::begin(terminal.watch(), Stage::Pictures);
    if let Some(file) = outputs.png
        && let Some(bytes) = render_comparison_picture(&document, file.picture_format())?
    {
        file.write(&bytes)?;
    }
    let report = outputs.report.map(|folder| {
        let drawn = draw_compared(&document, recordings);
        drawn.map(|drawn| (folder, drawn))
    });
    let report = report.transpose()?;
    work.go_on(Stage::Files);
    if let Some(file) = outputs.csv {
        file.write(render_series_csv(&document)?.as_bytes())?;
    }
    let mut published = None;
    if let Some((folder, drawn)) = report {
        document.timings = terminal.timings();
        for file in compared_files(&document, drawn)? {
            folder.add(&file.name, &file.bytes)?;
        }
        published = Some(folder.publish_report()?);
    }
    drop(work);
    let page = published
        .as_ref()
        .map(|(folder, _)| folder.join("report.html"));
    terminal.answer(&document, page.as_deref(), full)?;
    terminal.write_document(&document)?;
    let left = published.and_then(|(_, left)| left);
    left.map_or(Ok(Outcome::Answered), Err)
}

/// Reads and analyses one test, and adds its doubts about the readings to `warnings`.
fn read_side(
    path: &Path,
    template: Option<&TestFile>,
    terminal: &Terminal,
    warnings: &mut Vec<Warning>,
) -> anyhow::Result<Side> {
    let name = path.display().to_string();
    let file = match (is_description(path), template) {
        (true, _) => read_test(path, terminal)?,
        (false, Some(template)) => placed(path, template)?,
        (false, None) => {
            bail!(
                "{name}: is no test description; give --test with the description of its structure"
            )
        }
    };
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    let analysis = file.analyse(
        &IdentifySettings::unperturbed(),
        &terminal.measuring(file.test.recordings.len()),
    )?;
    let _work = Work::begin(terminal.watch(), Stage::Comparison);
    let compared = compared_test(&file.test, &analysis);
    let structure = analysis.structure;
    let (compared, structure) = compared
        .zip(structure)
        .ok_or_else(|| anyhow!("{name}: describes no structure"))?;
    // Those of the estimate do not matter: what the model misses, both tests share.
    let read = analysis
        .recordings
        .iter()
        .flat_map(|one| &one.measurement.warnings);
    let numbered = analysis
        .warnings
        .iter()
        .filter(|one| one.code == "ambiguous-pairing");
    for warning in read.chain(numbered) {
        // Recordings of two tests often have the same names.
        let warning = match is_description(path) {
            true => warning.clone().of_part(&name),
            false => warning.clone(),
        };
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }
    Ok(Side {
        name: analysis.name,
        structure,
        compared,
        recordings: analysis.recordings,
    })
}

/// Returns the description with this file in the place of its recordings.
fn placed(path: &Path, template: &TestFile) -> anyhow::Result<TestFile> {
    check_file(path)?;
    let Some(test) = template.test.with_recording(absolute(path)?) else {
        bail!(
            "{}: describes no recording; add a [[recording]] with the settings for {}",
            template.name,
            path.display()
        );
    };
    Ok(TestFile {
        test,
        name: template.name.clone(),
        folder: template.folder.clone(),
    })
}
