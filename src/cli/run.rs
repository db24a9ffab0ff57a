//! `tapjoint run`: from recordings to the joint, with a report.

use super::Outcome;
use super::arguments::{
    FullAnswer, RecordingArguments, SpectrumSettings, TapArguments, perturbed_by,
    perturbed_methods, reading,
};
use super::diagnose::{Reported, reported};
use super::input::{TestFile, check_file, file_name, read_test, stem};
use super::overwrite::{Expanded, carries_mark, checksum, files_of};
use super::place::{FolderContents, RECORDINGS, is_description, report_in};
use super::publication::OutputFolder;
use super::recording::{analyse, analyse_together};
use super::terminal::Terminal;
use super::timings::TimingsArguments;
use crate::description::{ReadBy, TestDescription};
use crate::gap::GapSettings;
use crate::pipeline::{BareSettings, EstimateMethod, IdentifySettings, Stage, Work, diagnose_test};
use crate::recording::{MOST_FILES, ReadSettings};
use crate::report::document::FileSection;
use crate::report::{
    EXCHANGED, MODEL_FILE, VERSION_FILE, draw_run, earlier_files, exchange_files, run_files,
    watched_files,
};
use crate::taps::TapsByHand;
use anyhow::{Context, bail};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use std::slice::from_ref;

/// Analyse a test, from recordings to joint, and write a report.
///
/// Finds taps, spectra and modes, estimates the joint stiffness and its uncertainty, and diagnoses what
/// the model misses. The report folder gets report.html, report.json, CSV files (parameters, modes,
/// perturbation), pictures and, after a diagnosis, updated-model.toml. Files of an earlier report are
/// replaced or removed. Other files stay.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  tapjoint run test.toml\n  tapjoint run taps.wav --hammer 1 --out taps-report"
)]
pub(super) struct RunArguments {
    /// Test description (.toml), recording (WAV, FLAC, CSV, UFF58, LabVIEW, MATLAB), frequency response functions (UFF58,
    /// text, LabVIEW, MATLAB), or a folder with one description. All recordings in a folder without one are one test
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    /// Folder of the report; default: NAME-report beside FILE, or NAME-2-report where that holds the report of another
    /// file
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Way of reading the frequencies; default: that of the description, else fit
    #[arg(long, value_name = "R", value_parser = reading())]
    reading: Option<ReadBy>,
    /// Estimate to perturb. With `pairs` the pair regression is the only estimate
    #[arg(long, value_name = "M", default_value = "both", value_parser = perturbed_methods())]
    method: &'static [EstimateMethod],
    /// Also write mode shapes and functions for other programs into the report's folder: modes.uff (datasets 15 and 55) and
    /// shapes.csv; with a hammer frfs.uff (datasets 58) and frfs.csv
    #[arg(long)]
    export: bool,
    #[command(flatten)]
    spectrum: SpectrumSettings,
    #[command(flatten)]
    recording: RecordingArguments,
    #[command(flatten)]
    pub(super) taps: TapArguments,
    /// Also write sheet.html, one page to sign and file, with the checksums of all files read. Texts for it stand under
    /// [sheet] of the description. Print it for a PDF
    #[arg(long)]
    sheet: bool,
    #[command(flatten)]
    full: FullAnswer,
    #[command(flatten)]
    pub(super) timings: TimingsArguments,
}

impl RunArguments {
    /// Returns the settings for a file without a description.
    pub(super) fn bare(&self) -> BareSettings {
        let reading = self.reading.unwrap_or_default();
        BareSettings {
            by_hand: self.taps.by_hand(),
            ..self.recording.bare(&self.spectrum, reading)
        }
    }

    /// Refuses options that a description has keys for.
    ///
    /// # Errors
    /// One of them was given.
    pub(super) fn check_for_description(&self) -> anyhow::Result<()> {
        let bare = &self.recording;
        if bare.hammer.is_some()
            || bare.overload.is_some()
            || self.taps.by_hand() != TapsByHand::default()
            || bare.settings() != ReadSettings::default()
        {
            bail!(
                "--hammer, --sample-rate, --time-unit, --values, --variable, --overload, --accept-taps and --reject-taps are for bare recordings; a test description says all of them: `channel` in [hammer], the others in [[recording]]"
            );
        }
        let spectrum = &self.spectrum;
        if spectrum.zoom.is_some()
            || spectrum.block.is_some()
            || spectrum.window.is_some()
            || spectrum.select.is_some()
        {
            bail!(
                "--zoom, --block, --window and --select are for bare recordings; a test description says `band` and `block` in [[recording]], and `window` and `select` in [analysis]"
            );
        }
        Ok(())
    }

    /// Returns what is to be run.
    ///
    /// # Errors
    /// A folder that cannot be read, or that is no test.
    pub(super) fn subject(&self) -> anyhow::Result<Subject> {
        let path = &self.file;
        if !path.is_dir() {
            let path = path.clone();
            return Ok(match is_description(&path) {
                true => Subject::Described(path),
                false => Subject::Bare(path),
            });
        }
        let shown = path.display();
        let mut found =
            FolderContents::of(path).with_context(|| format!("{shown}: cannot be read"))?;
        // Tables and functions that the program has written are no recordings.
        found
            .recordings
            .retain(|file| !carries_mark(file).unwrap_or(false));
        match (&found.descriptions[..], &found.recordings[..]) {
            ([only], _) => Ok(Subject::Described(only.clone())),
            ([], [only]) => Ok(Subject::Bare(only.clone())),
            ([], []) => bail!(
                "{shown}: a folder without a description (.toml) and without recordings ({}); name a recording, or \
                 write a description: `tapjoint init` prints one",
                RECORDINGS.map(|ending| format!(".{ending}")).join(", ")
            ),
            ([], files) if files.len() > MOST_FILES => bail!(
                "{shown}: a folder with {} recordings; allowed: up to {MOST_FILES}; write a description, which names \
                 those of one test",
                files.len()
            ),
            ([], files) => Ok(Subject::Folder(path.clone(), files.to_vec())),
            (several, _) => {
                let count = several.len();
                let names = several.iter().take(MOST_NAMES).map(|file| file_name(file));
                let mut names = names.collect::<Vec<_>>().join(", ");
                if count > MOST_NAMES {
                    names.push_str(", ...");
                }
                bail!("{shown}: a folder with {count} descriptions: {names}; name one")
            }
        }
    }

    /// Returns the report's folder, for a test of this name. Folders with the report of another file are passed over; the
    /// last of them comes second, with the name of that file.
    fn folder(&self, subject: &Subject, name: &str) -> (PathBuf, Option<(PathBuf, String)>) {
        if let Some(out) = &self.out {
            return (out.clone(), None);
        }
        let numbered = |number| match subject {
            Subject::Described(file) | Subject::Bare(file) => {
                file.with_file_name(report_folder(name, number))
            }
            Subject::Folder(folder, _) => folder.join(report_folder(name, number)),
        };
        let own = match subject {
            Subject::Described(file) | Subject::Bare(file) => file_name(file),
            Subject::Folder(..) => name.to_owned(),
        };
        let (mut number, mut passed) = (1, None);
        while let Some(other) = reported_file(&numbered(number)).filter(|other| *other != own) {
            passed = Some((numbered(number), other));
            number += 1;
        }
        (numbered(number), passed)
    }

    /// Returns the files that a report may consist of, also one that is watched.
    pub(super) fn expanded(
        &self,
        test: Option<&TestDescription>,
        is_watched: bool,
    ) -> Vec<Expanded> {
        // A folder that is no test is reported later.
        let Ok(subject) = self.subject() else {
            return Vec::new();
        };
        let name = test.map_or_else(|| subject.name(), |test| test.name.clone());
        let recordings: Vec<PathBuf> = match (test, &subject) {
            (Some(test), _) => test
                .recordings
                .iter()
                .map(|one| one.name().into())
                .collect(),
            (None, Subject::Described(file) | Subject::Bare(file)) => vec![file.clone()],
            (None, Subject::Folder(_, files)) => files.clone(),
        };
        let recordings: Vec<_> = recordings
            .into_iter()
            .map(|file| serde_json::json!({ "file": file_name(&file) }))
            .collect();
        let report = serde_json::json!({
            "version": 1,
            "recordings": recordings,
            "gap": { "updated_model": { "file": MODEL_FILE } },
            "exported": if self.export { &EXCHANGED[..] } else { &[] },
            "sheet": { "files": if self.sheet { &["any"][..] } else { &[] } },
            "warnings": [],
        });
        let (folder, _) = self.folder(&subject, &name);
        let mut files = earlier_files(&report.to_string());
        files.retain(|file| is_watched || file != VERSION_FILE);
        vec![("out", files.iter().map(|file| folder.join(file)).collect())]
    }
}

/// What is run.
#[derive(Debug)]
pub(super) enum Subject {
    /// A test that a description describes.
    Described(PathBuf),
    /// A recording, or a file of functions.
    Bare(PathBuf),
    /// A folder, all recordings in which are one test.
    Folder(PathBuf, Vec<PathBuf>),
}

impl Subject {
    /// Returns the description, or the recordings.
    pub(super) fn files(&self) -> &[PathBuf] {
        match self {
            Self::Described(file) | Self::Bare(file) => from_ref(file),
            Self::Folder(_, files) => files,
        }
    }

    /// Returns the name of a test without a description: that of its recording, or of their folder.
    fn name(&self) -> String {
        match self {
            Self::Described(file) | Self::Bare(file) => stem(file),
            // The folder may be `.` or `..`.
            Self::Folder(folder, _) => {
                file_name(&fs::canonicalize(folder).unwrap_or_else(|_| folder.clone()))
            }
        }
    }
}

/// Most descriptions that a message lists.
const MOST_NAMES: usize = 10;

/// Monte Carlo samples of the report, as many as its picture shows; `perturb` draws more.
pub(super) const SAMPLES: usize = 1000;

/// Reads the description, and checks that options and recordings go with it.
fn resolve(arguments: &RunArguments, file: &Path, terminal: &Terminal) -> anyhow::Result<TestFile> {
    arguments.check_for_description()?;
    let mut file = read_test(file, terminal)?;
    if let Some(reading) = arguments.reading {
        file.test.analysis.reading = reading;
    }
    file.test.check_has_data(&file.name)?;
    file.check_recordings()?;
    Ok(file)
}

/// Returns the description and the files that it names, or the bare recordings, with their checksums.
fn summed_files(
    given: &[PathBuf],
    described: Option<&TestFile>,
) -> anyhow::Result<Vec<FileSection>> {
    let folder = given.first().and_then(|file| file.parent());
    let folder = folder.unwrap_or(Path::new(""));
    let mut paths = given.to_vec();
    if let (Some(file), [path]) = (described, given) {
        paths.extend(files_of(path, &file.test));
    }
    let mut files: Vec<FileSection> = Vec::new();
    for path in paths {
        let file = path.strip_prefix(folder).unwrap_or(&path);
        let file = file.display().to_string();
        if files.iter().any(|known| known.file == file) {
            continue;
        }
        let summed = fs::metadata(&path).and_then(|data| Ok((data.len(), checksum(&path)?)));
        let (bytes, sha256) =
            summed.with_context(|| format!("{}: cannot be read", path.display()))?;
        files.push(FileSection {
            file,
            bytes,
            sha256,
        });
    }
    Ok(files)
}

/// Returns the name of the file whose report a folder holds; `None` without a report, and of one that does not name it.
fn reported_file(folder: &Path) -> Option<String> {
    let report: serde_json::Value = serde_json::from_str(&report_in(folder)?).ok()?;
    Some(report["test"]["file"].as_str()?.to_owned())
}

/// Returns the folder name for a test's name. Blanks and characters that file systems refuse become hyphens. `number` tells
/// the reports of one name apart, from 1.
fn report_folder(name: &str, number: usize) -> String {
    let name = name.trim_matches(|c: char| c == '.' || c.is_whitespace());
    let name: String = name
        .chars()
        .map(|c| match c {
            '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|' => '-',
            c if c.is_control() || c.is_whitespace() => '-',
            c => c,
        })
        .take(100)
        .collect();
    let name = if name.is_empty() { "test" } else { &name };
    match number {
        1 => format!("{name}-report"),
        number => format!("{name}-{number}-report"),
    }
}

/// Runs a test. The page of one that is watched reloads itself.
pub(super) fn run(
    arguments: &RunArguments,
    is_watched: bool,
    seed: u64,
    terminal: Terminal,
) -> anyhow::Result<Outcome> {
    let subject = arguments.subject()?;
    let described = match &subject {
        Subject::Described(file) => Some(resolve(arguments, file, &terminal)?),
        Subject::Bare(file) => {
            check_file(file)?;
            None
        }
        Subject::Folder(..) => None,
    };
    let name = match &described {
        Some(file) => file.test.name.clone(),
        None => subject.name(),
    };
    let (folder, passed) = arguments.folder(&subject, &name);
    if let Some((earlier, other)) = passed {
        terminal.warn(&format!(
            "{} holds the report of {other}; this report goes to {}; --out names another folder",
            earlier.display(),
            folder.display()
        ));
    }
    // Another program gets values, and a report where it names a folder.
    let is_written = terminal.session().is_none() || arguments.out.is_some();
    let output = is_written.then(|| OutputFolder::prepare(&folder, terminal.files()));
    let output = output.transpose()?;
    let summed = match arguments.sheet {
        true => Some(summed_files(subject.files(), described.as_ref())?),
        false => None,
    };
    let measuring = terminal.measuring(match &described {
        Some(file) => file.test.recordings.len(),
        None => subject.files().len(),
    });
    let analysis = match (&described, &subject) {
        (Some(file), _) => file.analyse(
            &IdentifySettings {
                monte_carlo: Some((SAMPLES, seed)),
                ..perturbed_by(arguments.method)
            },
            &measuring,
        )?,
        (None, Subject::Described(file) | Subject::Bare(file)) => {
            analyse(file, &arguments.bare(), &measuring)?
        }
        (None, Subject::Folder(_, files)) => {
            arguments.taps.check(files.len())?;
            analyse_together(name, files, &arguments.bare(), &measuring)?
        }
    };
    // A file that a recorder still writes would have the checksum of other content than was analysed.
    if let Some(files) = &summed
        && summed_files(subject.files(), described.as_ref())? != *files
    {
        bail!(
            "a file has changed while it was analysed, so --sheet has no checksum for it; run again"
        );
    }
    let test = described.as_ref().map(|file| &file.test);
    let work = test.map(|_| Work::begin(terminal.watch(), Stage::Diagnosis));
    let settings = GapSettings {
        seed,
        ..GapSettings::default()
    };
    let diagnosis = test.map(|test| diagnose_test(test, &analysis, &settings));
    let Reported {
        mut document,
        model,
    } = reported(&analysis, test, diagnosis.as_ref());
    drop(work);
    if let Some(files) = summed {
        document.sheet.get_or_insert_default().files = files;
    }
    drop(measuring);
    terminal.keep(&analysis);
    let Some(output) = output else {
        terminal.answer(&document, None, &arguments.full)?;
        terminal.write_document(&document)?;
        return Ok(Outcome::of_analysis(&analysis));
    };
    let mut work = Work::begin(terminal.watch(), Stage::Pictures);
    let drawn = draw_run(&document, &analysis.recordings)?;
    work.go_on(Stage::Files);
    let exchange = arguments.export.then(|| exchange_files(&analysis));
    let exchange = exchange.transpose()?;
    document.exported = exchange.as_ref().map(|exchange| {
        let files = exchange.files.iter();
        files.map(|file| file.name.clone()).collect()
    });
    document.timings = terminal.timings();
    if let Some(model) = model {
        output.add(MODEL_FILE, model.as_bytes())?;
    }
    let files = match is_watched {
        true => watched_files(&document, drawn)?,
        false => run_files(&document, drawn)?,
    };
    let exchange = exchange.unwrap_or_default();
    for file in files.iter().chain(&exchange.files) {
        output.add(&file.name, &file.bytes)?;
    }
    let (folder, left) = output.publish_report()?;
    drop(work);
    let page = folder.join("report.html");
    terminal.answer(&document, Some(&page), &arguments.full)?;
    for doubt in &exchange.doubts {
        terminal.warn(doubt);
    }
    terminal.write_document(&document)?;
    left.map_or_else(|| Ok(Outcome::of_analysis(&analysis)), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_report_folders_have_names_that_can_be_made() {
        let cases = [
            (
                "Cantilever, one-bolt clamp",
                "Cantilever,-one-bolt-clamp-report",
            ),
            ("../a/b", "-a-b-report"),
            (" ... ", "test-report"),
            ("x\ny", "x-y-report"),
        ];
        for (name, expected) in cases {
            assert_eq!(report_folder(name, 1), expected, "{name:?}");
            assert_eq!(Path::new(expected).components().count(), 1, "{expected:?}");
        }
        assert_eq!(report_folder("x", 2), "x-2-report");
    }
}
