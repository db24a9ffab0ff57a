//! `tapjoint batch`: many tests in one call.
//!
//! `inputs.rs` lists the tests and loads them, `journal_file.rs` keeps what is finished, and this file runs the tests and
//! writes the tables.

mod inputs;
mod journal_file;
mod reports;

use super::Outcome;
use super::arguments::{RecordingArguments, SpectrumSettings};
use super::output::failed;
use super::overwrite::Expanded;
use super::publication::OutputFolder;
use super::terminal::Terminal;
use super::timings::TimingsArguments;
#[cfg(feature = "parquet")]
use crate::batch::ParquetWriter;
use crate::batch::page::TestNames;
use crate::batch::{
    BatchRecord, BatchSettings, Collector, JOURNAL_HEAD, Summary, TABLES, TableWriter,
    WITHOUT_PARQUET, answer_watched,
};
use crate::description::ReadBy;
use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use inputs::{Loaded, Tests};
use journal_file::{JournalFile, Place, ShardJournals};
use reports::Reports;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

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
    /// Test descriptions (.toml), folders, recordings, or files of functions
    #[arg(value_name = "FILE", conflicts_with = "table")]
    files: Vec<PathBuf>,
    /// File with a list of further tests, a name on each line; `-` is standard input
    #[arg(long, value_name = "FILE", conflicts_with = "table")]
    from: Option<PathBuf>,
    /// Description for recordings that have none
    #[arg(long, value_name = "TEST")]
    test: Option<PathBuf>,
    /// Table (CSV) with a row for each test: a column `file`, columns named by keys of the description (`length`,
    /// `sensor.A.position`), and others, which are carried into tests.csv
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
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

/// Most tests at the same time: no machine has more processors, and each test takes memory.
const MOST_JOBS: u64 = 1024;
/// Most parts.
const MOST_PARTS: usize = 10_000;
/// Stack of a worker (bytes), that of a program's first thread.
const STACK: usize = 8 << 20;
/// Name of the page.
const PAGE: &str = "batch.html";
/// Name of the journal of all tests.
const JOURNAL: &str = "batch.jsonl";

/// One of several parts of the tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shard {
    /// Its number, from 1.
    part: usize,
    /// Number of parts.
    parts: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/');
        let numbers =
            numbers.and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
        match numbers {
            Some((part, parts)) if (1..=parts).contains(&part) && parts <= MOST_PARTS => {
                Ok(Self { part, parts })
            }
            _ => Err(format!(
                "give the number of the part and the number of parts, such as 1/4, up to {MOST_PARTS} parts"
            )),
        }
    }
}

impl Shard {
    /// Returns the name of its journal.
    fn journal(self) -> String {
        format!("batch-{}-of-{}.jsonl", self.part, self.parts)
    }

    /// Returns true if the test of this index belongs to it.
    fn holds(self, test: usize) -> bool {
        test % self.parts == self.part - 1
    }
}

impl BatchArguments {
    /// Returns the files that are written into the folder.
    pub(super) fn expanded(&self) -> Vec<Expanded> {
        let names = match self.shard {
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
        !arguments.parquet || cfg!(feature = "parquet"),
        "--parquet: {WITHOUT_PARQUET}"
    );
    let tests = Tests::listed(arguments, arguments.settings(seed), &terminal)?;
    let reports = arguments.reports.then(|| Reports::of(&arguments.out));
    let reports = reports.as_ref();
    if arguments.merge {
        let journals = ShardJournals::open(&arguments.out, tests.len())?;
        let places = merged_places(&tests, &journals, arguments)?;
        let read = |place: Place| journals.line(place);
        return finish(&tests, &places, reports, read, arguments, terminal);
    }
    let name = arguments.shard.map_or(JOURNAL.to_owned(), Shard::journal);
    let journal = JournalFile::open(&arguments.out, &name, terminal.files().force)?;
    let shard = arguments.shard.unwrap_or(Shard { part: 1, parts: 1 });
    let own: Vec<usize> = (0..tests.len()).filter(|test| shard.holds(*test)).collect();
    let done = analyse_all(&tests, &own, journal, reports, arguments, &terminal)?;
    if arguments.shard.is_some() {
        terminal.say(&format!(
            "part {} of {}: {} tests, {} of them analysed now; `tapjoint batch --merge` with the same tests and settings writes the tables\n",
            shard.part,
            shard.parts,
            own.len(),
            done.analysed
        ))?;
        terminal.write_json(&serde_json::json!({
            "shard": { "part": shard.part, "parts": shard.parts, "tests": own.len() }
        }))?;
        return Ok(Outcome::Answered);
    }
    let read = |place: Place| done.journal.line(place);
    finish(&tests, &done.places, reports, read, arguments, terminal)
}

/// What the workers leave.
struct Done {
    journal: JournalFile,
    /// Place of each test's record, in the order of the tests.
    places: Vec<Place>,
    /// Number of tests that were analysed in this run.
    analysed: usize,
}

/// What the workers share.
struct Shared {
    done: Done,
    finished: usize,
    problem: Option<anyhow::Error>,
}

/// Analyses the tests of these indices that the journal lacks.
///
/// Each worker is a pool of one thread: a test is analysed by one thread, and several tests at the same time.
///
/// # Errors
/// The journal cannot be written, or the system cannot start the threads.
fn analyse_all(
    tests: &Tests,
    own: &[usize],
    journal: JournalFile,
    reports: Option<&Reports>,
    arguments: &BatchArguments,
    terminal: &Terminal,
) -> anyhow::Result<Done> {
    let next = AtomicUsize::new(0);
    let shared = Mutex::new(Shared {
        done: Done {
            journal,
            places: vec![Place::default(); own.len()],
            analysed: 0,
        },
        finished: 0,
        problem: None,
    });
    let work = || {
        loop {
            let slot = next.fetch_add(1, Ordering::Relaxed);
            let Some(&index) = own.get(slot) else { return };
            let test = tests.load(index);
            let known = locked(&shared).done.journal.place(test.key);
            // A report that was not written, or not wholly, needs the analysis again.
            let name = tests.name(index);
            let has_report = reports.is_none_or(|reports| reports.has(index, &name));
            let known = known.filter(|_| has_report || test.test.is_err());
            let record = known.is_none().then(|| {
                let wanted = reports.map(|reports| (reports, index));
                record_of(&test, tests, wanted, terminal)
            });
            let mut shared = locked(&shared);
            if shared.problem.is_some() {
                return;
            }
            shared.finish(slot, &test, known, record.as_ref());
            shared.finished += 1;
            terminal.count("tests", shared.finished, own.len());
        }
    };
    let jobs = arguments.jobs.unwrap_or_else(rayon::current_num_threads);
    thread::scope(|scope| {
        let mut workers = Vec::new();
        for _ in 0..jobs.min(own.len()) {
            let worker = thread::Builder::new().stack_size(STACK);
            let worker = worker.spawn_scoped(scope, || -> anyhow::Result<()> {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
                let _pool = pool.use_current_thread().build()?;
                work();
                Ok(())
            });
            let worker = worker.with_context(|| {
                format!("--jobs {jobs}: the system cannot start so many threads; give fewer")
            })?;
            workers.push(worker);
        }
        for worker in workers {
            worker
                .join()
                .map_err(|_| anyhow!("a worker ended early; run again, it goes on from there"))??;
        }
        Ok::<(), anyhow::Error>(())
    })?;
    let shared = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    match shared.problem {
        Some(problem) => Err(problem),
        None => Ok(shared.done),
    }
}

/// A panic elsewhere is no reason to lose what is finished.
fn locked(shared: &Mutex<Shared>) -> std::sync::MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Notes the place of a record: that in the journal, or that to which it is appended now.
    fn finish(
        &mut self,
        slot: usize,
        test: &Loaded,
        known: Option<Place>,
        record: Option<&BatchRecord>,
    ) {
        let place = match (known, record) {
            (Some(place), _) => Ok(place),
            (None, Some(record)) => {
                self.done.analysed += 1;
                self.done.journal.append(test.key, record)
            }
            (None, None) => return,
        };
        match place {
            Ok(place) => self.done.places[slot] = place,
            Err(problem) => self.problem = Some(problem),
        }
    }
}

/// Analyses a test. A panic is our fault, and no reason to lose the other tests.
fn record_of(
    test: &Loaded,
    tests: &Tests,
    reports: Option<(&Reports, usize)>,
    terminal: &Terminal,
) -> BatchRecord {
    let own = match &test.test {
        Ok(own) => own,
        Err(problem) => return problem.clone(),
    };
    let answered = catch_unwind(AssertUnwindSafe(|| match reports {
        None => answer_watched(own, &tests.settings, terminal.watch()),
        Some((reports, index)) => reports
            .write(index, own, &tests.settings, terminal)
            .unwrap_or_else(|error| {
                BatchRecord::failed(&own.file, &own.carried, inputs::words(&error))
            }),
    }));
    answered.unwrap_or_else(|_| {
        let error = "internal error; please report it with this test".to_owned();
        BatchRecord::failed(&own.file, &own.carried, error)
    })
}

/// Most names that a message lists.
const MOST_NAMES: usize = 10;

/// Returns the place of each test's record in the journals of all parts.
///
/// # Errors
/// A test has no record there.
fn merged_places(
    tests: &Tests,
    journals: &ShardJournals,
    arguments: &BatchArguments,
) -> anyhow::Result<Vec<Place>> {
    let (mut places, mut missing) = (Vec::with_capacity(tests.len()), Vec::new());
    for index in 0..tests.len() {
        match journals.place(tests.load(index).key) {
            Some(place) => places.push(place),
            None => missing.push(index),
        }
    }
    if missing.is_empty() {
        return Ok(places);
    }
    let mut names: Vec<String> = Vec::new();
    for index in missing.iter().take(MOST_NAMES) {
        let part = index % journals.parts() + 1;
        names.push(format!("{} (part {part})", tests.name(*index)));
    }
    if missing.len() > MOST_NAMES {
        names.push("...".to_owned());
    }
    bail!(
        "{}: {} of {} tests have no record with these settings and files: {}; run their parts with --shard I/{} again, then --merge",
        arguments.out.display(),
        missing.len(),
        tests.len(),
        names.join(", "),
        journals.parts()
    )
}

/// Writes tables, page and the journal in the order of the tests, and prints the summary.
fn finish(
    tests: &Tests,
    places: &[Place],
    reports: Option<&Reports>,
    read: impl Fn(Place) -> anyhow::Result<(Vec<u8>, BatchRecord)>,
    arguments: &BatchArguments,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let output = OutputFolder::prepare(&arguments.out, terminal.files())?;
    let summary = write_all(tests, places, reports, read, arguments, &output)
        .map_err(|cause| unless_told(cause, &arguments.out))?;
    let folder = output.publish()?;
    let page = folder.join(PAGE);
    terminal.say(&crate::batch::words::answer(
        &summary,
        &page.display().to_string(),
        terminal.screen(),
    ))?;
    let outcome = Outcome::of(summary.answered > 0);
    terminal.write_json(&serde_json::json!({ "batch": summary }))?;
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
}

impl TestNames for Named<'_> {
    fn name(&self, test: u32) -> String {
        self.tests.name(test as usize)
    }

    fn report(&self, test: u32) -> Option<String> {
        let reports = self.reports?;
        Some(reports.address(test as usize, &self.name(test)))
    }
}

fn write_all(
    tests: &Tests,
    places: &[Place],
    reports: Option<&Reports>,
    read: impl Fn(Place) -> anyhow::Result<(Vec<u8>, BatchRecord)>,
    arguments: &BatchArguments,
    output: &OutputFolder,
) -> anyhow::Result<Summary> {
    let carried = tests.carried_heads();
    let mut tables = Vec::new();
    for table in TABLES {
        let file = File::create(output.place_of(&format!("{}.csv", table.stem())))?;
        tables.push(TableWriter::new(table, &carried, BufWriter::new(file))?);
    }
    #[cfg(feature = "parquet")]
    let mut parquet = Vec::new();
    #[cfg(feature = "parquet")]
    for table in TABLES.into_iter().filter(|_| arguments.parquet) {
        let file = File::create(output.place_of(&format!("{}.parquet", table.stem())))?;
        parquet.push(ParquetWriter::new(table, &carried, file)?);
    }
    let mut journal = BufWriter::new(File::create(output.place_of(JOURNAL))?);
    journal.write_all(JOURNAL_HEAD.as_bytes())?;
    let mut collector = Collector::default();
    for place in places {
        let (line, record) = read(*place)?;
        for table in &mut tables {
            table.add(&record)?;
        }
        #[cfg(feature = "parquet")]
        for table in &mut parquet {
            table.add(&record)?;
        }
        collector.add(&record);
        journal.write_all(&line)?;
    }
    for table in tables {
        table.finish()?;
    }
    #[cfg(feature = "parquet")]
    for table in parquet {
        table.finish()?;
    }
    journal.flush()?;
    let summary = collector.finish(|test| tests.name(test as usize));
    let page = crate::batch::page::render(&summary, &Named { tests, reports })?;
    output.add(PAGE, page.as_bytes())?;
    Ok(summary)
}
