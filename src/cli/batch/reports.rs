//! A report for each test of a batch, as `tapjoint run` writes it.

use super::super::diagnose::add_model;
use super::super::input::{TestFile, stem};
use super::super::publication::OutputFolder;
use super::super::run::SAMPLES;
use super::super::terminal::Terminal;
use crate::batch::{BatchRecord, BatchSettings, BatchTest, Subject, analyse, record_of};
use crate::pipeline::IdentifySettings;
use crate::report::document::SheetSection;
use crate::report::{MODEL_FILE, document_of, draw_run, gap_section, run_files};
use std::path::{Path, PathBuf};

/// Folder of the reports in the folder of the tables.
const FOLDER: &str = "reports";

/// Where the reports are written.
#[derive(Debug)]
pub(super) struct Reports {
    folder: PathBuf,
}

impl Reports {
    /// Those of a batch with this folder of tables.
    pub(super) fn of(out: &Path) -> Self {
        Self {
            folder: out.join(FOLDER),
        }
    }

    /// Returns true if a test of this index and name has a report.
    pub(super) fn has(&self, index: usize, name: &str) -> bool {
        let folder = self.folder.join(folder_name(index, name));
        folder.join("report.html").is_file()
    }

    /// Returns the address of a test's report, seen from the folder of the tables.
    pub(super) fn address(&self, index: usize, name: &str) -> String {
        format!("{FOLDER}/{}/report.html", folder_name(index, name))
    }

    /// Analyses a test with everything that a report shows, writes the report, and returns the record.
    ///
    /// # Errors
    /// The test cannot be analysed, or the report cannot be written.
    pub(super) fn write(
        &self,
        index: usize,
        test: &BatchTest,
        settings: &BatchSettings,
        terminal: &Terminal,
    ) -> anyhow::Result<BatchRecord> {
        let identify = IdentifySettings {
            monte_carlo: Some((SAMPLES, settings.seed)),
            ..IdentifySettings::default()
        };
        let found = analyse(test, settings, &identify, terminal.watch())?;
        let record = record_of(test, &found);
        let folder = self.folder.join(folder_name(index, &test.file));
        let output = OutputFolder::prepare(&folder, terminal.files())?;
        let mut document = document_of(&found.analysis);
        if let Subject::Described(described) = &test.subject {
            document.sheet = Some(SheetSection::of(&described.test));
        }
        if let (Some(diagnosis), Subject::Described(described)) = (&found.diagnosis, &test.subject)
        {
            let mut gap = gap_section(diagnosis.as_ref());
            let file = TestFile {
                test: described.test.clone(),
                name: described.name.clone(),
                folder: described.folder.clone(),
            };
            let model = add_model(
                &mut gap,
                &file,
                Some(MODEL_FILE.to_owned()),
                &found.analysis,
                diagnosis.as_ref().ok(),
            );
            document.add_gap(gap);
            if let Some(model) = model {
                output.add(MODEL_FILE, model.as_bytes())?;
            }
        }
        let drawn = draw_run(&document, &found.analysis.recordings)?;
        for file in run_files(&document, drawn)? {
            output.add(&file.name, &file.bytes)?;
        }
        let (_, left) = output.publish_report()?;
        left.map_or(Ok(record), Err)
    }
}

/// Returns the folder of a test's report: its place in the order of the batch, and the name of its file or folder in letters
/// that need no quotes in an address.
fn folder_name(index: usize, name: &str) -> String {
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
    format!("{:06}-{own}", index + 1)
}
