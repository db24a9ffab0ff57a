//! A report for each test of a batch, as `tapjoint run` writes it.

use super::super::diagnose::{Reported, reported};
use super::super::input::stem;
use super::super::overwrite::Files;
use super::super::publication::OutputFolder;
use super::super::run::SAMPLES;
use crate::batch::{
    BatchRecord, BatchSettings, BatchTest, Key, Subject, analyse, failed, record_of,
};
use crate::pipeline::{IdentifySettings, Stage, Watch, Work};
use crate::report::{MODEL_FILE, ReportError, ReportFile, draw_run, run_files};
use std::path::{Path, PathBuf};

/// Folder of the reports in the folder of the tables.
const FOLDER: &str = "reports";

/// Where the reports are written.
#[derive(Debug, Clone)]
pub(super) struct Reports {
    folder: PathBuf,
}

/// A test with its report.
#[derive(Debug)]
pub(super) struct Prepared {
    /// Its record.
    pub(super) record: BatchRecord,
    /// Files of its report; `None` of a test that cannot be analysed.
    pub(super) report: Option<Vec<ReportFile>>,
}

impl Reports {
    /// Those of a batch with this folder of tables.
    pub(super) fn of(out: &Path) -> Self {
        Self {
            folder: out.join(FOLDER),
        }
    }

    /// Returns true if a test has a report.
    pub(super) fn has(&self, index: usize, name: &str, key: Key) -> bool {
        let folder = self.folder.join(folder_name(index, name, key));
        folder.join("report.html").is_file()
    }

    /// Returns the address of a test's report, seen from the folder of the tables; `None` of a test without one.
    pub(super) fn address(&self, index: usize, name: &str, key: Key) -> Option<String> {
        let folder = folder_name(index, name, key);
        self.has(index, name, key)
            .then(|| format!("{FOLDER}/{folder}/report.html"))
    }

    /// Analyses a test with everything that a report shows, and makes the files of the report.
    ///
    /// # Errors
    /// The report cannot be made.
    pub(super) fn prepare(
        &self,
        test: &BatchTest,
        settings: &BatchSettings,
        watch: &dyn Watch,
    ) -> Result<Prepared, ReportError> {
        let identify = IdentifySettings {
            monte_carlo: Some((SAMPLES, settings.seed)),
            ..IdentifySettings::default()
        };
        let found = match analyse(test, settings, &identify, watch) {
            Ok(found) => found,
            Err(problem) => {
                return Ok(Prepared {
                    record: failed(test, &problem),
                    report: None,
                });
            }
        };
        let _work = Work::begin(watch, Stage::Pictures);
        let described = match &test.subject {
            Subject::Described(described) => Some(&described.test),
            Subject::Bare(_) => None,
        };
        let diagnosis = found.diagnosis.as_ref();
        let Reported { document, model } = reported(&found.analysis, described, diagnosis);
        let drawn = draw_run(&document, &found.analysis.recordings)?;
        let mut files = run_files(&document, drawn)?;
        files.extend(model.map(|model| ReportFile {
            name: MODEL_FILE.to_owned(),
            bytes: model.into_bytes(),
        }));
        Ok(Prepared {
            record: record_of(test, &found),
            report: Some(files),
        })
    }

    /// Writes the report of a test.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn publish(
        &self,
        index: usize,
        name: &str,
        key: Key,
        report: &[ReportFile],
        files: &Files,
    ) -> anyhow::Result<()> {
        let folder = self.folder.join(folder_name(index, name, key));
        let output = OutputFolder::prepare(&folder, files)?;
        for file in report {
            output.add(&file.name, &file.bytes)?;
        }
        let (_, left) = output.publish_report()?;
        left.map_or(Ok(()), Err)
    }
}

/// Returns the folder of a test's report: its place in the order of the batch, the name of its file or folder in letters
/// that need no quotes in an address, and the beginning of its key. A test that has changed has another folder.
fn folder_name(index: usize, name: &str, key: Key) -> String {
    let path = Path::new(name);
    let own = match (stem(path), path.parent().and_then(Path::file_name)) {
        // Descriptions are often called alike, and their folders are not.
        (own, Some(folder)) if own == "test" => folder.to_string_lossy().into_owned(),
        (own, _) => own,
    };
    let plain = |c: char| match c.is_ascii_alphanumeric() || matches!(c, '-' | '_') {
        true => c,
        false => '-',
    };
    let own: String = own.chars().map(plain).take(60).collect();
    format!("{:06}-{own}-{:.8}", index + 1, key.to_string())
}
