//! `tapjoint compare`: what changed between two tests of one structure.

use super::Outcome;
use super::arguments::repeatability;
use super::input::{TestFile, check_file, read_test};
use super::output::OutputFile;
use super::place::is_description;
use super::terminal::Terminal;
use anyhow::{anyhow, bail};
use clap::Args;
use std::path::{Path, PathBuf, absolute};
use tapjoint::compare::{
    LEAST_SERIES, MOST_PAIRS, MOST_REPEATS, MOST_SERIES, Pair, Settings, Test, compare, watch,
};
use tapjoint::pipeline::{IdentifySettings, TestedStructure, Warning, compared_test};
use tapjoint::report::document::Document;
use tapjoint::report::{
    comparison_of, render_comparison, render_comparison_picture, render_series_csv, series_of,
};

/// Say what changed between two tests of one structure, or in a series of tests.
///
/// BEFORE and AFTER are test descriptions. With --test they may also be recordings or files of functions, each read
/// in the place of the first recording that TEST describes. Errors of the model that both tests share cancel:
/// what is compared is the change of each frequency.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint compare before.toml after.toml\n  tapjoint compare monday.wav friday.wav --test test.toml --repeatability \"0.1 %\"\n  tapjoint compare --before 1.toml 2.toml --after 3.toml 4.toml\n  tapjoint compare --pair a1.toml a2.toml --pair b1.toml b2.toml\n  tapjoint compare --series week1.toml week2.toml week3.toml --png charts.png"
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
    /// Draw the changes of the frequencies and the causes, or the control charts of a series, into this file (PNG, or SVG if its
    /// name ends in .svg)
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Write a row for each test and chart of a series into this file (CSV)
    #[arg(long, value_name = "FILE", requires = "series")]
    csv: Option<PathBuf>,
}

/// A test that was read and analysed.
struct Side {
    name: String,
    structure: TestedStructure,
    compared: Test,
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
    let png = OutputFile::prepare_optional(arguments.png.as_deref())?;
    let csv = OutputFile::prepare_optional(arguments.csv.as_deref())?;
    let template = arguments
        .test
        .as_deref()
        .map(|test| read_test(test, &terminal))
        .transpose()?;
    let mut warnings = Vec::new();
    let mut read = |files: &[PathBuf]| -> anyhow::Result<Vec<Side>> {
        let mut sides = Vec::with_capacity(files.len());
        for file in files {
            sides.push(read_side(
                file,
                template.as_ref(),
                &terminal,
                &mut warnings,
            )?);
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
        let files = arguments.series.iter();
        let files = files.map(|file| file.display().to_string()).collect();
        let found = watch(&tests, &settings)?;
        let document = series_of(&name, &structure, files, found, warnings);
        return answer(&document, png, csv, terminal);
    }
    let mut groups = Vec::new();
    match (&arguments.first, &arguments.second) {
        (Some(before), Some(after)) => {
            groups.push([
                read(std::slice::from_ref(before))?,
                read(std::slice::from_ref(after))?,
            ]);
        }
        _ if !arguments.before.is_empty() => {
            groups.push([read(&arguments.before)?, read(&arguments.after)?]);
        }
        _ => {
            for pair in arguments.pair.chunks_exact(2) {
                groups.push([read(&pair[..1])?, read(&pair[1..])?]);
            }
        }
    }
    let Some(first) = groups.first().and_then(|group| group[0].first()) else {
        bail!(
            "there is nothing to compare; give BEFORE and AFTER, --before and --after, --pair, or --series"
        );
    };
    let (name, structure) = (first.name.clone(), first.structure);
    let mut pairs = Vec::with_capacity(groups.len());
    for [before, after] in groups {
        pairs.push(Pair {
            before: before.into_iter().map(|side| side.compared).collect(),
            after: after.into_iter().map(|side| side.compared).collect(),
        });
    }
    let found = compare(&pairs, &settings)?;
    let document = comparison_of(&name, &structure, found, warnings);
    answer(&document, png, csv, terminal)
}

/// Writes the picture and the rows, and prints the answer.
fn answer(
    document: &Document,
    png: Option<OutputFile>,
    csv: Option<OutputFile>,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    if let Some(file) = png
        && let Some(bytes) = render_comparison_picture(document, file.picture_format())?
    {
        file.write(&bytes)?;
    }
    if let Some(file) = csv {
        file.write(render_series_csv(document)?.as_bytes())?;
    }
    terminal.say(&render_comparison(document))?;
    terminal.write_document(document)?;
    Ok(Outcome::Answered)
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
    let analysis = file.analyse(&IdentifySettings::unperturbed())?;
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
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    Ok(Side {
        name: analysis.name,
        structure,
        compared,
    })
}

/// Returns the description with this file in the place of its recordings.
fn placed(path: &Path, template: &TestFile) -> anyhow::Result<TestFile> {
    check_file(path)?;
    let mut test = template.test.clone();
    test.measured = None;
    test.recordings.truncate(1);
    let Some(recording) = test.recordings.first_mut() else {
        bail!(
            "{}: describes no recording; add a [[recording]] with the settings for {}",
            template.name,
            path.display()
        );
    };
    recording.file = absolute(path)?;
    recording.more_files.clear();
    Ok(TestFile {
        test,
        name: template.name.clone(),
        folder: template.folder.clone(),
    })
}
