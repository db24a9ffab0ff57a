//! The tests of a batch: which they are, and what each reads.

use super::super::error_text::chained;
use super::super::input::{
    TestFile, check_file, file_name, read_bytes, read_test, read_text, stem, text_of,
};
use super::super::overwrite::{carries_mark, checksum_bytes, described, files_of};
use super::super::place::{FolderContents, is_description};
use super::super::terminal::Terminal;
use crate::batch::{
    BatchRecord, BatchSettings, BatchTest, DescribedTest, InputFile, InputTable, JournalEntry, Key,
    MOST_TESTS, Subject,
};
use crate::description::{FreeTestFile, TestDescription};
use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;
use sha2::{Digest, Sha256};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Longest list of names, and largest table (bytes).
const LARGEST_LIST: u64 = 1 << 30;

/// The arguments that name the tests.
#[derive(Debug, Args)]
pub(super) struct TestArguments {
    /// Test descriptions (.toml), folders, recordings, or files of functions
    #[arg(value_name = "FILE", conflicts_with = "table")]
    files: Vec<PathBuf>,
    /// File with a list of further tests, a name on each line; `-` is standard input
    #[arg(long, value_name = "FILE", conflicts_with = "table")]
    from: Option<PathBuf>,
    /// Description for recordings that have none
    #[arg(long, value_name = "TEST")]
    test: Option<PathBuf>,
    /// Table (CSV, or Parquet in a build with the feature `parquet`) with a row for each test: a column `file`, columns
    /// named by keys of the description (`length`, `sensor.A.position`), and others, which are carried into tests.csv
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
}

/// All tests of a batch. Only their names are kept; [`load`](Self::load) reads what belongs to one.
#[derive(Debug)]
pub(super) struct Tests {
    list: Listed,
    template: Option<Template>,
    /// Settings of all tests.
    pub(super) settings: BatchSettings,
}

/// Where the tests are named.
#[derive(Debug)]
enum Listed {
    /// One by one.
    Files(Vec<PathBuf>),
    /// In a table, whose names are seen from this folder.
    Rows(InputTable, PathBuf),
}

/// A description in which recordings take their place.
#[derive(Debug)]
struct Template {
    file: TestFile,
    text: String,
    /// Its test of the free bar.
    free: Option<DescribedTest>,
    /// Files of that test.
    free_files: Vec<InputFile>,
}

/// A test that is ready to be analysed, or the record of one that cannot be.
#[derive(Debug)]
pub(super) struct Loaded {
    /// Its key.
    pub(super) key: Key,
    /// The test, or its record.
    pub(super) test: Result<BatchTest, BatchRecord>,
}

impl Tests {
    /// Lists the tests that the arguments name. `out` is the folder of the tables, where no tests are looked for.
    ///
    /// # Errors
    /// A list, table, template or folder that cannot be read; no test, or too many.
    pub(super) fn listed(
        arguments: &TestArguments,
        out: &Path,
        settings: BatchSettings,
        terminal: &Terminal,
    ) -> anyhow::Result<Self> {
        let template = arguments.test.as_deref();
        let template = template.map(|path| Template::read(path, terminal));
        let list = match &arguments.table {
            Some(path) => Listed::Rows(
                read_table(path)?,
                path.parent().map(Path::to_owned).unwrap_or_default(),
            ),
            None => Listed::Files(files(arguments, out)?),
        };
        if let (Listed::Rows(table, _), Some(_)) = (&list, &template) {
            table.check_sets_no_recording()?;
        }
        let tests = Self {
            list,
            template: template.transpose()?,
            settings,
        };
        let options = &tests.settings.bare;
        ensure!(
            tests.template.is_none() || *options == Default::default(),
            "--hammer, --sample-rate, --time-unit, --values, --variable, --overload, --zoom, --block, --window and --select are for \
             recordings without a description, and --test describes them all; say it there, or leave --test out"
        );
        ensure!(
            tests.len() > 0,
            "there is no test; give descriptions, folders with descriptions, or recordings"
        );
        let inputs = (0..tests.len()).flat_map(|test| tests.files(test));
        terminal.files().check_inputs(inputs)?;
        terminal.files().check()?;
        Ok(tests)
    }

    /// Returns the files that a test reads.
    fn files(&self, test: usize) -> Vec<PathBuf> {
        let path = self.path(test);
        let mut files = match (is_description(&path), &self.template) {
            (true, _) => match described(&path) {
                Some(own) => {
                    let text = || fs::read_to_string(&path).ok();
                    let changed = self.changed(test, text, &path);
                    files_of(&path, changed.as_ref().unwrap_or(&own))
                }
                None => Vec::new(),
            },
            // Files of the template are known; a row may name another test of the free bar.
            (false, Some(template)) => {
                let place = Path::new(&template.file.name);
                let changed = self.changed(test, || Some(template.text.clone()), place);
                changed.map_or_else(Vec::new, |mut test| {
                    test.recordings.clear();
                    test.measured = None;
                    files_of(place, &test)
                })
            }
            (false, None) => Vec::new(),
        };
        files.push(path);
        files
    }

    /// Returns the description in a text with the files that a row names; `None` where it names none.
    fn changed(
        &self,
        test: usize,
        text: impl Fn() -> Option<String>,
        file: &Path,
    ) -> Option<TestDescription> {
        let table = self.row(test).filter(|table| table.names_files())?;
        let file = file.display().to_string();
        let (changed, _) = table.described(test, &text()?, &file).ok()?;
        Some(changed)
    }

    /// Returns the number of tests.
    pub(super) fn len(&self) -> usize {
        match &self.list {
            Listed::Files(files) => files.len(),
            Listed::Rows(table, _) => table.len(),
        }
    }

    /// Returns the name of a test, as the user wrote it.
    pub(super) fn name(&self, test: usize) -> String {
        match &self.list {
            Listed::Files(files) => files
                .get(test)
                .map(|file| file.display().to_string())
                .unwrap_or_default(),
            Listed::Rows(table, _) => table.file(test).to_owned(),
        }
    }

    /// Returns the heads of the carried columns.
    pub(super) fn carried_heads(&self) -> Vec<String> {
        match &self.list {
            Listed::Files(_) => Vec::new(),
            Listed::Rows(table, _) => table.carried_heads(),
        }
    }

    fn carried(&self, test: usize) -> Vec<String> {
        match &self.list {
            Listed::Files(_) => Vec::new(),
            Listed::Rows(table, _) => table.carried(test),
        }
    }

    fn path(&self, test: usize) -> PathBuf {
        match &self.list {
            Listed::Files(files) => files.get(test).cloned().unwrap_or_default(),
            Listed::Rows(table, folder) => folder.join(table.file(test)),
        }
    }

    fn row(&self, test: usize) -> Option<&InputTable> {
        match &self.list {
            Listed::Rows(table, _) if table.changes(test) => Some(table),
            _ => None,
        }
    }

    /// Reads what belongs to a test, its recordings excepted.
    pub(super) fn load(&self, test: usize) -> Loaded {
        let (file, path) = (self.name(test), self.path(test));
        let carried = self.carried(test);
        let mut inputs = Vec::new();
        let subject = self.subject(test, &path, &mut inputs);
        let key = self.settings.key(&file, &carried, &inputs);
        let test = match subject {
            Ok(subject) => Ok(BatchTest {
                file,
                subject,
                carried,
            }),
            Err(problem) => {
                let files: Vec<String> = inputs.into_iter().map(|input| input.name).collect();
                let error = chained(&problem);
                Err(BatchRecord::failed(&file, &carried, error, &files))
            }
        };
        Loaded { key, test }
    }

    /// Returns the record of a test that was not analysed to its end, for its journal. Nothing of the test is read.
    pub(super) fn unfinished(&self, test: usize, error: String) -> JournalEntry {
        let (file, carried) = (self.name(test), self.carried(test));
        JournalEntry {
            key: self.bare_key(test),
            record: BatchRecord::failed(&file, &carried, error, &[]),
            again: true,
        }
    }

    /// Returns the key of a test. Of a description in a pipe, which may hang and can be read only once, nothing is read.
    pub(super) fn key(&self, test: usize) -> Key {
        match is_description(&self.path(test)) && !self.is_repeatable(test) {
            true => self.bare_key(test),
            false => self.load(test).key,
        }
    }

    /// Returns false for a pipe or a device: its key does not hold its content.
    pub(super) fn is_repeatable(&self, test: usize) -> bool {
        fs::metadata(self.path(test)).map_or(true, |found| found.is_file() || found.is_dir())
    }

    /// Returns the key of a test of which nothing is read.
    pub(super) fn bare_key(&self, test: usize) -> Key {
        self.settings
            .key(&self.name(test), &self.carried(test), &[])
    }

    /// Returns the names of these tests. `--from` reads such a list. Names of a table are seen from its folder.
    ///
    /// # Errors
    /// A name that no such list can hold.
    pub(super) fn names(&self, tests: &[usize]) -> anyhow::Result<Vec<String>> {
        let names = tests.iter().map(|test| {
            let (name, path) = (self.name(*test), self.path(*test));
            ensure!(
                path.to_str().is_some() && !name.contains('\n') && !name.ends_with('\r'),
                "{}: holds a line break or is no UTF-8 text, so that no list can hold it; rename it",
                name.escape_debug()
            );
            Ok(name)
        });
        names.collect()
    }

    /// Returns what is analysed. The files that it reads are added to `inputs`, also if it cannot be analysed.
    fn subject(
        &self,
        test: usize,
        path: &Path,
        inputs: &mut Vec<InputFile>,
    ) -> anyhow::Result<Subject> {
        let row = self.row(test);
        if is_description(path) {
            let described = read_described(path, row.map(|table| (table, test)), inputs)?;
            return Ok(Subject::Described(Box::new(described)));
        }
        inputs.push(summed(path));
        check_file(path)?;
        match (&self.template, row) {
            (Some(template), row) => {
                let placed = template.placed(path, row.map(|table| (table, test)), inputs)?;
                Ok(Subject::Described(Box::new(placed)))
            }
            (None, None) => Ok(Subject::Bare(path.to_owned())),
            (None, Some(_)) => bail!(
                "the table sets keys of a description, and this recording has none; give --test with the description"
            ),
        }
    }
}

impl Template {
    fn read(path: &Path, terminal: &Terminal) -> anyhow::Result<Self> {
        let file = read_test(path, terminal)?;
        let text = read_text(path, terminal)?;
        ensure!(
            !file.test.recordings.is_empty(),
            "{}: describes no recording; add a [[recording]] with the settings for the recordings of the batch",
            file.name
        );
        let mut free_files = Vec::new();
        let named = file.test.beam.free_test.as_ref();
        let free = named.map(|named| read_free(&file, named, &mut free_files));
        let free = free.transpose()?;
        Ok(Self {
            file,
            text,
            free,
            free_files,
        })
    }

    /// Returns the description with a recording in the place of its own.
    fn placed(
        &self,
        path: &Path,
        row: Option<(&InputTable, usize)>,
        inputs: &mut Vec<InputFile>,
    ) -> anyhow::Result<DescribedTest> {
        let name = &self.file.name;
        let changed = row.map(|(table, row)| table.described(row, &self.text, name));
        let (test, text) = match changed.transpose()? {
            Some((test, text)) => (test, text),
            None => (self.file.test.clone(), self.text.clone()),
        };
        inputs.push(InputFile {
            name: name.clone(),
            sha256: Some(Sha256::digest(text.as_bytes()).into()),
        });
        let own_name = test.name != self.file.test.name;
        let placed = test.with_recording(path.to_owned());
        let mut test = placed.ok_or_else(|| anyhow!("{name}: describes no recording"))?;
        if !own_name {
            test.name = stem(path);
        }
        let free = self.free_of(&test, inputs)?;
        Ok(DescribedTest {
            test,
            name: name.clone(),
            // The recording is seen from here, not from the folder of the description.
            folder: PathBuf::new(),
            free: free.map(Box::new),
        })
    }

    /// Returns the free bar's test of a changed description: that of the template, or another that a row names.
    fn free_of(
        &self,
        test: &TestDescription,
        inputs: &mut Vec<InputFile>,
    ) -> anyhow::Result<Option<DescribedTest>> {
        let Some(named) = &test.beam.free_test else {
            return Ok(None);
        };
        let own = self.file.test.beam.free_test.as_ref();
        if let Some(free) = &self.free
            && own.is_some_and(|own| own.path == named.path)
        {
            named.check(&self.file.name, test, &free.test)?;
            inputs.extend(self.free_files.iter().cloned());
            return Ok(Some(free.clone()));
        }
        let changed = TestFile {
            test: test.clone(),
            name: self.file.name.clone(),
            folder: self.file.folder.clone(),
        };
        read_free(&changed, named, inputs).map(Some)
    }
}

/// Reads a description, and that of the free bar which it names, with the keys that a row of a table sets.
fn read_described(
    path: &Path,
    row: Option<(&InputTable, usize)>,
    inputs: &mut Vec<InputFile>,
) -> anyhow::Result<DescribedTest> {
    let bytes = read_bytes(path);
    let name = path.display().to_string();
    inputs.push(InputFile {
        name: name.clone(),
        sha256: bytes
            .as_ref()
            .ok()
            .map(|bytes| Sha256::digest(bytes).into()),
    });
    let text = text_of(bytes?, &name)?;
    let mut file = TestFile::of(path, text.clone())?;
    if let Some((table, row)) = row {
        let (test, text) = table.described(row, &text, &name)?;
        file.test = test;
        inputs.push(InputFile {
            name,
            sha256: Some(Sha256::digest(text.as_bytes()).into()),
        });
    }
    inputs.extend(files_of(path, &file.test).iter().map(|file| summed(file)));
    file.check_has_no_effect()?;
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    let free = match &file.test.beam.free_test {
        Some(named) => Some(Box::new(undressed(file.free_test(named)?))),
        None => None,
    };
    Ok(DescribedTest {
        free,
        ..undressed(file)
    })
}

/// Reads the test of the free bar that a description names. Its files are added to `inputs`.
fn read_free(
    file: &TestFile,
    named: &FreeTestFile,
    inputs: &mut Vec<InputFile>,
) -> anyhow::Result<DescribedTest> {
    let path = file.path_of(&named.path);
    inputs.push(summed(&path));
    let free = file.free_test(named)?;
    inputs.extend(files_of(&path, &free.test).iter().map(|file| summed(file)));
    free.check_recordings()?;
    Ok(undressed(free))
}

fn undressed(file: TestFile) -> DescribedTest {
    DescribedTest {
        test: file.test,
        name: file.name,
        folder: file.folder,
        free: None,
    }
}

/// Returns a file with its checksum; without one where there is no file, and of a pipe, which can be read only once.
fn summed(path: &Path) -> InputFile {
    let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
    InputFile {
        name: path.display().to_string(),
        sha256: is_file.then(|| checksum_bytes(path).ok()).flatten(),
    }
}

fn read_table(path: &Path) -> anyhow::Result<InputTable> {
    let name = path.display().to_string();
    let mut bytes = Vec::new();
    let read =
        File::open(path).and_then(|file| file.take(LARGEST_LIST + 1).read_to_end(&mut bytes));
    read.with_context(|| format!("{name}: cannot be read"))?;
    ensure!(
        bytes.len() as u64 <= LARGEST_LIST,
        "{name}: is larger than 1 GB; give several smaller tables"
    );
    Ok(InputTable::parse(&bytes, &name, MOST_TESTS)?)
}

/// Returns the files that the arguments name, one by one, in a list, or by their folder.
fn files(arguments: &TestArguments, out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut named = arguments.files.clone();
    match arguments.from.as_deref() {
        None => {}
        Some(path) if path == Path::new("-") => {
            named.extend(listed_in(BufReader::new(io::stdin()), "standard input")?);
        }
        Some(path) => {
            let name = path.display().to_string();
            let file = File::open(path).with_context(|| format!("{name}: cannot be read"))?;
            named.extend(listed_in(BufReader::new(file), &name)?);
        }
    }
    let out = fs::canonicalize(out).ok();
    let mut files = Vec::new();
    for path in named {
        match path.is_dir() {
            true => {
                let before = files.len();
                add_folder(&path, arguments.test.is_some(), out.as_deref(), &mut files)?;
                if files.len() == before {
                    let (shown, wanted) = (path.display(), wanted(arguments.test.is_some()));
                    bail!("{shown}: holds no {wanted}; name a folder that does");
                }
            }
            false => files.push(path),
        }
        ensure!(
            files.len() <= MOST_TESTS,
            "more than {MOST_TESTS} tests; give fewer, in several batches"
        );
    }
    Ok(files)
}

/// Returns what is looked for in folders.
fn wanted(has_template: bool) -> &'static str {
    match has_template {
        true => "recordings",
        false => "test description (.toml)",
    }
}

/// Returns the names in a list, one on each line. Empty lines are passed over.
fn listed_in(from: impl BufRead, name: &str) -> anyhow::Result<Vec<PathBuf>> {
    let mut names = Vec::new();
    let mut read = 0;
    for line in from.take(LARGEST_LIST).split(b'\n') {
        let line = line.with_context(|| format!("{name}: cannot be read"))?;
        read += line.len() as u64 + 1;
        let line = line.strip_suffix(b"\r").unwrap_or(&line);
        if !line.is_empty() {
            names.push(path_of(line));
        }
        ensure!(
            names.len() <= MOST_TESTS && read < LARGEST_LIST,
            "{name}: names more than {MOST_TESTS} tests, or is larger than 1 GB; give a shorter list"
        );
    }
    Ok(names)
}

#[cfg(unix)]
fn path_of(name: &[u8]) -> PathBuf {
    use std::os::unix::ffi::OsStringExt;
    OsString::from_vec(name.to_vec()).into()
}

#[cfg(not(unix))]
fn path_of(name: &[u8]) -> PathBuf {
    OsString::from(String::from_utf8_lossy(name).into_owned()).into()
}

/// Adds the tests in a folder and in its subfolders, in the order of their names. Hidden folders, links to folders, and the
/// folder of the tables are left out.
fn add_folder(
    folder: &Path,
    recordings: bool,
    out: Option<&Path>,
    files: &mut Vec<PathBuf>,
) -> anyhow::Result<()> {
    let shown = || format!("{}: cannot be read", folder.display());
    let found = FolderContents::of(folder).with_context(shown)?;
    match recordings {
        // Tables and functions that the program has written are no recordings.
        true => files.extend(
            found
                .recordings
                .into_iter()
                .filter(|file| !carries_mark(file).unwrap_or(false)),
        ),
        false => files.extend(found.descriptions),
    }
    let mut folders = Vec::new();
    for entry in fs::read_dir(folder).with_context(shown)? {
        let entry = entry.with_context(shown)?;
        let is_own = entry.file_type().with_context(shown)?.is_dir();
        if is_own && !file_name(&entry.path()).starts_with('.') {
            folders.push(entry.path());
        }
    }
    folders.sort();
    for inner in folders {
        if out.is_none() || fs::canonicalize(&inner).ok().as_deref() != out {
            add_folder(&inner, recordings, out, files)?;
        }
        if files.len() > MOST_TESTS {
            return Ok(());
        }
    }
    Ok(())
}
