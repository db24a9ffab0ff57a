//! Words and pictures: JSON, CSV, HTML, PNG and SVG of a finished analysis. Computes no result.
//!
//! Everything is returned as bytes with a name; the command line writes the files.

pub mod blind_check;
mod brief;
pub mod change_check;
pub mod data_files;
pub mod deck;
pub mod document;
mod exchange;
pub mod format;
mod html;
pub mod picture;
mod resolution;
mod run;
mod screen;
mod sheet;
mod short_names;
pub mod tables;
mod text;

/// The charts of a report, each built once from the results that it shows.
pub mod charts {
    pub mod comparison;
    pub mod comparison_spectra;
    pub mod diagnosis;
    pub mod joint;
    pub mod modes;
    pub mod series;
    pub mod spectra;
}

/// Every sentence about a result, once.
pub mod words {
    pub mod answer;
    pub mod comparison;
    pub mod diagnosis;
    pub mod findings;
    pub mod series;
    pub(crate) mod sizes;
}

pub use brief::{MOST_LINES, render_answer, render_progress};
pub use charts::comparison_spectra::ComparedRecordings;
pub use data_files::{
    render_changes_csv, render_frf_csv, render_frf_uff, render_modes_csv, render_parameters_csv,
    render_perturbation_csv, render_series_csv, render_spectrum_csv, render_taps_csv,
};
pub use document::{
    comparison_of, datasets_of, document_of, frf_document, functions_of, gap_section,
    inspection_of, lambdas_of, prediction_of, series_of,
};
pub use exchange::{EXCHANGED, ExchangeFiles, exchange_files};
pub use html::{BatchPage, BatchSection, render_batch_page};
pub use resolution::{render_resolution, render_resolution_csv, render_resolution_picture};
pub use run::{
    DrawnPictures, MODEL_FILE, VERSION_FILE, VERSION_HEAD, compared_files, draw_compared, draw_run,
    earlier_files, render_cloud_picture, render_compared, render_comparison_picture,
    render_first_screen, render_frf_picture, render_json, render_run, render_schema,
    render_spectrum_picture, run_files, watched_files,
};
pub use screen::{Screen, joined};
pub use text::{render_readings, render_reproduction, render_stages, render_text, render_timings};

/// A finished file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportFile {
    /// Name without folder.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

impl ReportFile {
    fn of(name: &str, text: String) -> ReportFile {
        ReportFile {
            name: name.to_owned(),
            bytes: text.into_bytes(),
        }
    }
}

/// Reasons for which a report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The embedded font is damaged.
    #[error(
        "the font inside the program cannot be read: the program file is damaged, install it again"
    )]
    Font,
    /// A picture cannot be drawn.
    #[error("the picture \"{picture}\" cannot be drawn: {problem}")]
    Picture {
        /// Its title.
        picture: String,
        /// The reason.
        problem: String,
    },
    /// The document cannot be serialised.
    #[error("report.json cannot be written: {0}")]
    Json(serde_json::Error),
    /// A table cannot be written.
    #[error("the table cannot be written as CSV: {0}")]
    Csv(::csv::Error),
    /// A universal file cannot be written.
    #[error(transparent)]
    Universal(#[from] tapjoint_signal::recording::RecordingError),
    /// The page cannot be written.
    #[error("report.html cannot be written: {0}")]
    Html(askama::Error),
}
