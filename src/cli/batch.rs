//! `tapjoint batch`: many tests in one call.
//!
//! `inputs.rs` lists the tests and loads them, `workers.rs` analyses them, `journal_file.rs` keeps what is finished, and this
//! file writes the tables.

mod inputs;
mod journal_file;
mod reports;
mod shard;
mod workers;

use super::Outcome;
use super::arguments::{RecordingArguments, SpectrumSettings};
use super::error_text::{MOST_NAMES, listed};
use super::output::failed;
use super::overwrite::Expanded;
use super::publication::OutputFolder;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::batch::page::TestNames;
use crate::batch::{
    BatchSettings, Collector, HAS_PARQUET, JOURNAL_HEAD, JournalEntry, Key, Summary, TABLES,
    TableFile, TestOutcome, WITHOUT_PARQUET,
};
use crate::description::ReadBy;
use anyhow::{bail, ensure};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use inputs::{TestArguments, Tests};
use journal_file::{JournalFile, Line, Place, ShardJournals};
use rayon::prelude::*;
use reports::Reports;
use serde_json::json;
use shard::Shard;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use workers::{Finished, Found, Work, Workers};

/// Analyse many tests in one call, into tables.
///
/// FILE is a test description, a folder whose descriptions are taken, subfolders included, or a recording. With --test,
/// recordings are read in the place of the first recording that TEST describes, and folders give their recordings. Each
/// test has a row in tests.csv, its modes in modes.csv, and the hypotheses of its diagnosis in hypotheses.csv. A test that
/// cannot be analysed is a row with its error. What is finished stands in batch.jsonl: the same call goes on where it was
/// interrupted. The page batch.html shows distributions, trends and outliers.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint batch tests\n  tapjoint batch *.wav --test strip.toml --out strips\n  tapjoint batch --test strip.toml --table strips.csv\n  find . -name '*.wav' | tapjoint batch --from - --hammer 1\n  tapjoint batch tests --shard 1/2; tapjoint batch tests --shard 2/2; tapjoint batch tests --merge"
)]
pub(super) struct BatchArguments {
    #[command(flatten)]
    tests: TestArguments,
    /// Folder of the tables
    #[arg(long, value_name = "DIR", default_value = "batch-report")]
    out: PathBuf,
    /// Analyse only the I-th of N parts of the tests. Then --merge writes the tables
    #[arg(long, value_name = "I/N", conflicts_with = "merge")]
    shard: Option<Shard>,
    /// Write the tables of tests that were analysed in parts. Give the same tests and settings again
    #[arg(long)]
    merge: bool,
    /// Number of tests that are analysed at the same time; default: one for each thread
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=MOST_JOBS))]
    jobs: Option<usize>,
    /// Give up a test that takes longer, up to 86400 s. Its row has the error, and the next call tries it again
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    limit: Option<Duration>,
    /// Print the names of the tests, a line each, and do nothing else. With --shard those of the part
    #[arg(long, conflicts_with = "merge")]
    list: bool,
    /// Write a report for each test, as `run` does, into the folder `reports`. It takes many times as long
    #[arg(long)]
    reports: bool,
    /// Leave the diagnosis out
    #[arg(long)]
    no_diagnosis: bool,
    /// Write the tables as Parquet as well. A build without the feature `parquet` cannot
    #[arg(long, conflicts_with = "shard")]
    parquet: bool,
    #[command(flatten)]
    spectrum: SpectrumSettings,
    #[command(flatten)]
    recording: RecordingArguments,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

/// Longest time that a test may take (s): a day.
const LONGEST: f64 = 86_400.0;

/// Reads the time that a test may take.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok();
    let seconds = seconds.filter(|seconds: &f64| *seconds > 0.0 && *seconds <= LONGEST);
    let found = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    found.ok_or_else(|| format!("give a number of seconds above 0, up to {LONGEST}"))
}

/// Most tests at the same time: no machine has more processors, and each test takes memory.
const MOST_JOBS: u64 = 1024;
/// Name of the page.
const PAGE: &str = "batch.html";
/// Name of the journal of all tests.
const JOURNAL: &str = "batch.jsonl";

impl BatchArguments {
    /// Returns the files that are written into the folder.
    pub(super) fn expanded(&self) -> Vec<Expanded> {
        let names = match self.shard {
            _ if self.list => Vec::new(),
            Some(shard) => vec![shard.journal()],
            None => {
                let tables = TABLES.map(|table| format!("{}.csv", table.stem()));
                let mut names = tables.to_vec();
                if self.parquet {
                    names.extend(TABLES.map(|table| format!("{}.parquet", table.stem())));
                }
                names.extend([JOURNAL, PAGE].map(str::to_owned));
                names
            }
        };
        let names = names.into_iter();
        vec![("out", names.map(|name| self.out.join(name)).collect())]
    }

    fn settings(&self, seed: u64) -> BatchSettings {
        BatchSettings {
            diagnosis: !self.no_diagnosis,
            seed,
            bare: self.recording.bare(&self.spectrum, ReadBy::default()),
        }
    }
}

/// Runs the tests, and writes the tables.
pub(super) fn run(
    arguments: &BatchArguments,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    ensure!(
        !arguments.parquet || HAS_PARQUET,
        "--parquet: {WITHOUT_PARQUET}"
    );
    let settings = arguments.settings(seed);
    let tests = Tests::listed(&arguments.tests, &arguments.out, settings, &terminal)?;
    let own = arguments.shard.unwrap_or(Shard::WHOLE).tests(tests.len());
    if arguments.list {
        let names = tests.names(&own)?;
        terminal.say(&(names.join("\n") + "\n"))?;
        terminal.write_json(&json!({ "tests": names }))?;
        return Ok(Outcome::Answered);
    }
    let reports = arguments.reports.then(|| Reports::of(&arguments.out));
    if arguments.merge {
        let journals = ShardJournals::open(&arguments.out, tests.len())?;
        let force = terminal.files().force;
        let earlier = JournalFile::open_existing(&arguments.out, JOURNAL, force)?;
        let places = merged_places(&tests, &journals, earlier.as_ref(), arguments, &terminal)?;
        let output = Output {
            tests: &tests,
            places: &places,
            reports: reports.as_ref(),
            earlier: earlier.as_ref(),
        };
        return finish(&output, |place| journals.line(place), arguments, terminal);
    }
    let name = arguments.shard.map_or(JOURNAL.to_owned(), Shard::journal);
    let mut journal = JournalFile::open(&arguments.out, &name, terminal.files().force)?;
    let tests = Arc::new(tests);
    let work = Work {
        tests: tests.clone(),
        own,
        known: journal.known(),
        reports: reports.clone(),
        watch: terminal.shared_watch(),
        is_embedded: terminal.session().is_some(),
    };
    let done = analyse_all(work, &mut journal, arguments, &terminal)?;
    let Some(shard) = arguments.shard else {
        let output = Output {
            tests: &tests,
            places: &done.places,
            reports: reports.as_ref(),
            earlier: Some(&journal),
        };
        return finish(&output, |place| journal.line(place), arguments, terminal);
    };
    terminal.say(&format!(
        "part {} of {}: {} tests, {} of them analysed now; `tapjoint batch --merge` with the same tests and settings writes the tables\n",
        shard.part,
        shard.parts,
        done.places.len(),
        done.analysed
    ))?;
    terminal.write_json(&json!({
        "shard": { "part": shard.part, "parts": shard.parts, "tests": done.places.len() }
    }))?;
    for place in &done.places {
        if journal.line(*place)?.entry.record.test.outcome == TestOutcome::Answered {
            return Ok(Outcome::Answered);
        }
    }
    Ok(Outcome::of(done.places.is_empty()))
}

/// What the workers leave.
struct Done {
    /// Place of each test's record, in the order of the tests.
    places: Vec<Place>,
    /// Number of tests that were analysed in this run.
    analysed: usize,
}

/// Analyses the tests that the journal lacks, and writes their records and reports.
///
/// # Errors
/// The journal or a report cannot be written, the system starts no thread, or too many tests hang.
fn analyse_all(
    work: Work,
    journal: &mut JournalFile,
    arguments: &BatchArguments,
    terminal: &Terminal,
) -> anyhow::Result<Done> {
    let (tests, own) = (work.tests.clone(), work.own.clone());
    let reports = work.reports.clone();
    let mut done = Done {
        places: vec![Place::default(); own.len()],
        analysed: 0,
    };
    let jobs = arguments.jobs.unwrap_or_else(rayon::current_num_threads);
    let jobs = jobs.min(own.len());
    let mut workers = Workers::start(work, jobs, arguments.limit)?;
    if workers.count() < jobs {
        terminal.warn(&format!(
            "--jobs {jobs}: the system starts {} threads, and the batch goes on with these",
            workers.count()
        ));
    }
    for finished in 1..=own.len() {
        let Finished { slot, found } = workers.next()?;
        let index = own[slot];
        done.analysed += usize::from(matches!(found, Found::Analysed { .. }));
        done.places[slot] = match found {
            Found::Known { key, place } => {
                journal.known().replace(key);
                place
            }
            Found::Analysed { key, prepared } => {
                if let (Some(reports), Some(report)) = (&reports, &prepared.report) {
                    let name = tests.name(index);
                    reports.publish(index, &name, key, report, terminal.files())?;
                }
                journal.known().replace(key);
                // The key of a pipe does not hold its content.
                let again = !tests.is_repeatable(index);
                let key = if again { tests.key(index) } else { key };
                let record = prepared.record;
                journal.append(&JournalEntry { key, record, again })?
            }
            Found::Unfinished(error) => journal.append(&tests.unfinished(index, error))?,
        };
        terminal.count("tests", finished, own.len());
    }
    Ok(done)
}

/// Returns the place of each test's record in the journals of all parts.
///
/// # Errors
/// A test has no record there.
fn merged_places(
    tests: &Tests,
    journals: &ShardJournals,
    earlier: Option<&JournalFile>,
    arguments: &BatchArguments,
    terminal: &Terminal,
) -> anyhow::Result<Vec<Place>> {
    let read = AtomicUsize::new(0);
    let places = (0..tests.len()).into_par_iter().map(|index| {
        let key = tests.key(index);
        terminal.count(
            "tests",
            read.fetch_add(1, Ordering::Relaxed) + 1,
            tests.len(),
        );
        let place = journals.place(index, key);
        // The new record replaces an earlier one. That of an unfinished test has another key, and replaces none.
        if let (Some(earlier), Some(_)) = (earlier, place) {
            earlier.known().replace(key);
        }
        place.or_else(|| journals.place(index, tests.bare_key(index)))
    });
    let places: Vec<Option<Place>> = places.collect();
    let missing = (0..tests.len()).filter(|index| places[*index].is_none());
    let missing: Vec<usize> = missing.collect();
    if missing.is_empty() {
        return Ok(places.into_iter().flatten().collect());
    }
    let named = missing.iter().take(MOST_NAMES + 1).map(|index| {
        let part = index % journals.parts() + 1;
        format!("{} (part {part})", tests.name(*index))
    });
    bail!(
        "{}: {} of {} tests have no record with these settings and files: {}; run their parts with --shard I/{} again, then --merge",
        arguments.out.display(),
        missing.len(),
        tests.len(),
        listed(&named.collect::<Vec<_>>()),
        journals.parts()
    )
}

/// What is written at the end.
struct Output<'a> {
    tests: &'a Tests,
    /// Place of each test's record, in the order of the tests.
    places: &'a [Place],
    reports: Option<&'a Reports>,
    /// The journal that is replaced. Its records of other tests are kept.
    earlier: Option<&'a JournalFile>,
}

/// Writes tables, page and the journal in the order of the tests, and prints the summary.
fn finish(
    written: &Output,
    read: impl Fn(Place) -> anyhow::Result<Line>,
    arguments: &BatchArguments,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let output = OutputFolder::prepare(&arguments.out, terminal.files())?;
    let summary = write_all(written, read, arguments, &output)
        .map_err(|cause| unless_told(cause, &arguments.out))?;
    let folder = output.publish()?;
    let page = folder.join(PAGE);
    terminal.say(&crate::batch::words::answer(
        &summary,
        &page.display().to_string(),
        terminal.screen(),
    ))?;
    let outcome = Outcome::of(summary.answered > 0);
    terminal.write_json(&json!({ "batch": summary }))?;
    Ok(outcome)
}

/// Returns an error of the system as one of the output folder; others stay as they are.
fn unless_told(cause: anyhow::Error, folder: &Path) -> anyhow::Error {
    match cause.downcast::<std::io::Error>() {
        Ok(cause) => failed(folder, &cause),
        Err(cause) => cause,
    }
}

/// Names and reports for the page.
struct Named<'a> {
    tests: &'a Tests,
    reports: Option<&'a Reports>,
    /// Key of each test; empty without reports.
    keys: Vec<Key>,
}

impl TestNames for Named<'_> {
    fn name(&self, test: u32) -> String {
        self.tests.name(test as usize)
    }

    fn report(&self, test: u32) -> Option<String> {
        let key = *self.keys.get(test as usize)?;
        self.reports?.address(test as usize, &self.name(test), key)
    }
}

fn write_all(
    written: &Output,
    read: impl Fn(Place) -> anyhow::Result<Line>,
    arguments: &BatchArguments,
    output: &OutputFolder,
) -> anyhow::Result<Summary> {
    let (tests, reports) = (written.tests, written.reports);
    let carried = tests.carried_heads();
    let mut tables = Vec::new();
    for table in TABLES {
        let file = File::create(output.place_of(&format!("{}.csv", table.stem())))?;
        tables.push(TableFile::csv(table, &carried, file)?);
    }
    for table in TABLES.into_iter().filter(|_| arguments.parquet) {
        let file = File::create(output.place_of(&format!("{}.parquet", table.stem())))?;
        tables.push(TableFile::parquet(table, &carried, file)?);
    }
    let mut journal = BufWriter::new(File::create(output.place_of(JOURNAL))?);
    journal.write_all(JOURNAL_HEAD.as_bytes())?;
    let (mut collector, mut keys) = (Collector::default(), Vec::new());
    for place in written.places {
        let line = read(*place)?;
        for table in &mut tables {
            table.add(&line.entry.record)?;
        }
        collector.add(&line.entry.record);
        keys.extend(reports.map(|_| line.entry.key));
        journal.write_all(&line.bytes)?;
    }
    if let Some(earlier) = written.earlier {
        for place in earlier.others() {
            journal.write_all(&earlier.line(place)?.bytes)?;
        }
    }
    for table in tables {
        table.finish()?;
    }
    journal.flush()?;
    let summary = collector.finish(|test| tests.name(test as usize));
    let named = Named {
        tests,
        reports,
        keys,
    };
    let page = crate::batch::page::render(&summary, &named)?;
    output.add(PAGE, page.as_bytes())?;
    Ok(summary)
}
