//! All files of a report: `report.json` with its schema, the page, tables and pictures; and the files that an earlier
//! report has left.

use rayon::prelude::*;
use schemars::generate::SchemaSettings;
use serde_json::Value;
use tapjoint_analysis::{Frf, FrfSettings, RecordingResult, frfs_of};
use tapjoint_signal::spectral::FrfEstimator;

use crate::charts::comparison_spectra::ComparedRecordings;
use crate::charts::diagnosis::{gap, place_map};
use crate::charts::joint::{agreement, cloud, frequencies, shapes};
use crate::charts::modes::{amplitude, stabilisation};
use crate::charts::spectra::{frf, spectrum, taps};
use crate::charts::{comparison, comparison_spectra, series};
use crate::document::Document;
use crate::exchange::EXCHANGED;
use crate::html::{render_first_screen_html, render_html, render_reloading_html};
use crate::picture::InlineFigure;
use crate::picture::{Block, Chart, Color, Drawing, PictureFormat, render_picture};
use crate::sheet::render_sheet;
use crate::short_names::{ends_of_paths, stems};
use crate::{
    ReportError, ReportFile, render_changes_csv, render_modes_csv, render_parameters_csv,
    render_perturbation_csv, render_series_csv, render_taps_csv,
};

/// All files of a report: `report.html`, `report.json`, `sheet.html` of a document with a sheet, `parameters.csv`, `modes.csv`,
/// `taps.csv` where there are taps, `perturbation.csv` where something was perturbed, and the pictures that apply, each as PNG and as SVG:
/// `spectrum-*`, `frf-*`, `stabilisation-*`, `amplitude-*`, `taps-*`, `frequencies`, `mode-shapes`, `shape-agreement`, `cloud`,
/// `gap`, `gap-place`.
///
/// # Errors
/// The first [`ReportError`] of any file.
pub fn render_run(
    document: &Document,
    recordings: &[RecordingResult],
) -> Result<Vec<ReportFile>, ReportError> {
    run_files(document, draw_run(document, recordings)?)
}

/// Draws the pictures of [`render_run`].
///
/// # Errors
/// [`ReportError::Picture`] if one cannot be drawn.
pub fn draw_run(
    document: &Document,
    recordings: &[RecordingResult],
) -> Result<DrawnPictures, ReportError> {
    let mut drawn = DrawnPictures::of(&pictures(document, recordings))?;
    if let Some(chart) = leading(recordings) {
        let section = section_of(&chart);
        drawn
            .figures
            .push(InlineFigure::of(section, &chart, &chart.draw())?);
    }
    Ok(drawn)
}

/// Returns the first screen of the page as a page of its own: the answer, the picture of the recording with most modes, the
/// doubts, and what was tested.
///
/// # Errors
/// [`ReportError::Picture`] if the picture cannot be drawn, [`ReportError::Html`] if the template cannot be filled.
pub fn render_first_screen(
    document: &Document,
    recordings: &[RecordingResult],
) -> Result<String, ReportError> {
    let figure = leading(recordings)
        .map(|chart| InlineFigure::of(section_of(&chart), &chart, &chart.draw()));
    render_first_screen_html(document, figure.transpose()?)
}

/// The picture of the page's first screen: one function, or spectrum, of the recording with most modes.
fn leading(recordings: &[RecordingResult]) -> Option<Chart> {
    let modes = |one: &&RecordingResult| one.mode_numbers.iter().flatten().count();
    let recording = recordings.iter().rev().max_by_key(modes)?;
    let (file, frfs) = (&recording.file, given_frfs(recording));
    let chart = frf(recording, file, &frfs, &[]);
    let what = match (&chart, frfs.iter().any(|frf| frf.fitted.is_some())) {
        (Some(_), true) => "measured; the fitted modes as thin lines",
        (Some(_), false) => "measured",
        (None, _) => "averaged spectra",
    };
    let mut chart = chart.or_else(|| spectrum(recording, file))?;
    let mut first = chart.blocks.swap_remove(0).panels.swap_remove(0);
    // There is room for what was measured and what explains it.
    first.series.retain(|series| series.opacity == 1.0);
    let names = recording.responses.iter().enumerate().take(MOST_NAMED);
    let names = names.map(|(index, one)| format!("{} {}", one.name, Color::curve(index).word()));
    let names: Vec<String> = names.collect();
    let names = match recording.responses.len() {
        2..=MOST_NAMED => format!(" ({})", names.join(", ")),
        _ => String::new(),
    };
    chart.kind = "answer";
    chart.caption = format!("{file}{names}: {what}.");
    chart.width = LEADING_WIDTH;
    chart.blocks = vec![Block::new(1, vec![first])];
    Some(chart)
}

/// Most responses that the caption of the first screen's picture names.
const MOST_NAMED: usize = 4;
/// Width of the first screen's picture (pixels).
const LEADING_WIDTH: u32 = 720;

/// All files of [`render_run`], those of its `drawn` pictures included.
///
/// # Errors
/// The first [`ReportError`] of any file.
pub fn run_files(
    document: &Document,
    drawn: DrawnPictures,
) -> Result<Vec<ReportFile>, ReportError> {
    files_of_run(document, drawn, false)
}

/// All files of [`run_files`], with a page that reloads itself when a later run has written another, and [`VERSION_FILE`].
///
/// # Errors
/// The first [`ReportError`] of any file.
pub fn watched_files(
    document: &Document,
    drawn: DrawnPictures,
) -> Result<Vec<ReportFile>, ReportError> {
    files_of_run(document, drawn, true)
}

fn files_of_run(
    document: &Document,
    drawn: DrawnPictures,
    is_watched: bool,
) -> Result<Vec<ReportFile>, ReportError> {
    let mut files = render_page(document, drawn, is_watched)?;
    files.extend([
        ReportFile::of("parameters.csv", render_parameters_csv(document)?),
        ReportFile::of("modes.csv", render_modes_csv(document)?),
    ]);
    let mut recordings = document.recordings.iter().flatten();
    if recordings.any(|recording| !recording.taps.is_empty()) {
        files.push(ReportFile::of("taps.csv", render_taps_csv(document)?));
    }
    if document.perturbation.is_some() {
        let text = render_perturbation_csv(document)?;
        files.push(ReportFile::of("perturbation.csv", text));
    }
    Ok(files)
}

/// All files of a report on a comparison: `report.html`, `report.json`, and the pictures as PNG and as SVG. A comparison has
/// `changes.csv`, `compare` and, where both tests have spectra of one sensor, `compare-spectra`. A series has `series.csv` and `series`.
///
/// # Errors
/// The first [`ReportError`] of any file.
pub fn render_compared(
    document: &Document,
    recordings: &ComparedRecordings,
) -> Result<Vec<ReportFile>, ReportError> {
    compared_files(document, draw_compared(document, recordings)?)
}

/// Draws the pictures of [`render_compared`].
///
/// # Errors
/// [`ReportError::Picture`] if one cannot be drawn.
pub fn draw_compared(
    document: &Document,
    recordings: &ComparedRecordings,
) -> Result<DrawnPictures, ReportError> {
    let charts = [
        series::control_charts(document),
        comparison::changes(document),
        comparison_spectra::overlay(document, recordings),
    ];
    let charts = charts.into_iter().flatten();
    let pictures: Vec<_> = charts.map(|chart| (chart.kind.to_owned(), chart)).collect();
    DrawnPictures::of(&pictures)
}

/// All files of [`render_compared`], those of its `drawn` pictures included.
///
/// # Errors
/// The first [`ReportError`] of any file.
pub fn compared_files(
    document: &Document,
    drawn: DrawnPictures,
) -> Result<Vec<ReportFile>, ReportError> {
    let mut files = render_page(document, drawn, false)?;
    if document.series.is_some() {
        files.push(ReportFile::of("series.csv", render_series_csv(document)?));
    }
    if document.compare.is_some() {
        files.push(ReportFile::of("changes.csv", render_changes_csv(document)?));
    }
    Ok(files)
}

/// The pictures of a report, drawn for its files and for its page.
pub struct DrawnPictures {
    files: Vec<ReportFile>,
    figures: Vec<InlineFigure>,
}

impl DrawnPictures {
    fn of(charts: &[(String, Chart)]) -> Result<Self, ReportError> {
        type Rendered = Vec<([ReportFile; 2], InlineFigure)>;
        let rendered = charts.par_iter();
        let rendered = rendered.map(|(name, chart)| render_chart(name, chart));
        let (mut files, mut figures) = (Vec::new(), Vec::new());
        for (of_picture, figure) in rendered.collect::<Result<Rendered, _>>()? {
            files.extend(of_picture);
            figures.push(figure);
        }
        // Before a figure that takes a page of its own, half of a page would stay empty.
        figures.sort_by_key(|figure| figure.tall);
        Ok(DrawnPictures { files, figures })
    }
}

/// Returns the pictures, the page with them, and `report.json`; the version of a page that reloads itself as well.
fn render_page(
    document: &Document,
    drawn: DrawnPictures,
    reloads: bool,
) -> Result<Vec<ReportFile>, ReportError> {
    let DrawnPictures { mut files, figures } = drawn;
    let sheet = render_sheet(document, &figures)?;
    files.extend(sheet.map(|sheet| ReportFile::of(SHEET, sheet)));
    let page = || match reloads {
        true => render_reloading_html(document, &figures).map(|(page, own)| (page, Some(own))),
        false => render_html(document, &figures).map(|page| (page, None)),
    };
    let (page, json) = rayon::join(page, || render_json(document));
    let (page, version) = page?;
    files.extend([
        ReportFile::of("report.html", page),
        ReportFile::of("report.json", json?),
    ]);
    files.extend(version.map(|version| {
        let text = format!("{VERSION_HEAD}\ntapjointReport = \"{version}\";\n");
        ReportFile::of(VERSION_FILE, text)
    }));
    Ok(files)
}

/// Returns the averaged spectra of a recording as a picture, its functions where the file holds nothing else; `None`
/// when no tap was accepted.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_spectrum_picture(
    recording: &RecordingResult,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    let name = ends_of_paths(&[&recording.file]).concat();
    let chart = spectrum(recording, &name);
    let chart = chart.or_else(|| frf(recording, &name, &given_frfs(recording), &[]));
    chart.map(|chart| chart.render(format)).transpose()
}

/// Returns frequency response functions of a recording as a picture, all estimators shown; `None` without a hammer or
/// an accepted tap.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_frf_picture(
    recording: &RecordingResult,
    frfs: &[Frf],
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    let name = ends_of_paths(&[&recording.file]).concat();
    let chart = frf(recording, &name, frfs, &FrfEstimator::ALL);
    chart.map(|chart| chart.render(format)).transpose()
}

/// The estimates under changed frequencies as a picture; `None` where there are none.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_cloud_picture(
    document: &Document,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    cloud(document)
        .map(|chart| chart.render(format))
        .transpose()
}

/// The control charts of a series, else the comparison of two tests, as a picture; `None` without either.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_comparison_picture(
    document: &Document,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    series::control_charts(document)
        .or_else(|| comparison::changes(document))
        .map(|chart| chart.render(format))
        .transpose()
}

/// Returns a recording's frequency response functions; none without a hammer.
fn given_frfs(recording: &RecordingResult) -> Vec<Frf> {
    frfs_of(recording, &FrfSettings::default()).unwrap_or_default()
}

/// Returns a picture as files for screens and for papers.
pub(crate) fn picture_files(name: &str, drawing: &Drawing) -> Result<[ReportFile; 2], ReportError> {
    let png = render_picture(drawing, PictureFormat::Png)?;
    let svg = render_picture(drawing, PictureFormat::Svg)?;
    Ok(
        [("png", png), ("svg", svg)].map(|(ending, bytes)| ReportFile {
            name: format!("{name}.{ending}"),
            bytes,
        }),
    )
}

/// Returns a picture as files, and for the page.
fn render_chart(name: &str, chart: &Chart) -> Result<([ReportFile; 2], InlineFigure), ReportError> {
    let drawing = chart.draw();
    let files = picture_files(name, &drawing)?;
    Ok((files, InlineFigure::of(section_of(chart), chart, &drawing)?))
}

/// Returns the section of the page in which a chart stands.
fn section_of(chart: &Chart) -> &'static str {
    match chart.kind {
        "answer" => "answer",
        "taps" => "recordings",
        "frequencies" | "mode-shapes" | "shape-agreement" => "joint",
        "gap" | "gap-place" => "gap",
        "cloud" => "uncertainty",
        "compare" | "compare-spectra" => "compare",
        "series" => "series",
        _ => "modes",
    }
}

/// Returns all pictures that there are data for, with the names of their files without ending.
fn pictures(document: &Document, recordings: &[RecordingResult]) -> Vec<(String, Chart)> {
    let files: Vec<&str> = recordings.iter().map(|one| one.file.as_str()).collect();
    let of_recordings = recordings.par_iter().zip(ends_of_paths(&files));
    let of_recordings = of_recordings.zip(stems(files.iter().copied()));
    let of_recordings = of_recordings.flat_map_iter(|((recording, name), stem)| {
        let frfs = given_frfs(recording);
        let charts = [
            spectrum(recording, &name),
            frf(recording, &name, &frfs, &[]),
            stabilisation(recording, &name, &frfs),
            amplitude(recording, &name),
            taps(recording, &name),
        ];
        let charts = charts.into_iter().flatten();
        charts.map(move |chart| (format!("{}-{stem}", chart.kind), chart))
    });
    let mut pictures: Vec<(String, Chart)> = of_recordings.collect();
    let of_model = [
        frequencies(document),
        shapes(document),
        agreement(document),
        gap(document),
        place_map(document),
        cloud(document),
    ];
    let of_model = of_model.into_iter().flatten();
    pictures.extend(of_model.map(|chart| (chart.kind.to_owned(), chart)));
    pictures
}

/// The document as indented JSON with a newline at its end.
///
/// Values that are not finite are written as `null`.
///
/// # Errors
/// [`ReportError::Json`] if the document cannot be serialised.
pub fn render_json(document: &Document) -> Result<String, ReportError> {
    let mut text = serde_json::to_string_pretty(document).map_err(ReportError::Json)?;
    text.push('\n');
    Ok(text)
}

/// The JSON Schema (draft 2020-12) of `report.json` and of every `--json` answer that is a document.
pub fn render_schema() -> String {
    let generator = SchemaSettings::draft2020_12()
        .for_serialize()
        .into_generator();
    let schema = generator.into_root_schema_for::<Document>();
    // Indented as report.json is; a value without infinities or maps of odd keys always serialises.
    let text = serde_json::to_string_pretty(schema.as_value()).unwrap_or_default();
    text + "\n"
}

/// The model that a diagnosis leads to, beside the report.
pub const MODEL_FILE: &str = "updated-model.toml";
/// The sheet, where one was asked for.
const SHEET: &str = "sheet.html";
/// Script with the version of a page that reloads itself.
pub const VERSION_FILE: &str = "report-version.js";
/// First line of that script.
pub const VERSION_HEAD: &str = "// Version of report.html, written by tapjoint.";
/// Files of every report.
const OF_ALL: [&str; 2] = ["report.html", "report.json"];
/// Tables of a test.
const TABLES: [&str; 4] = [
    "parameters.csv",
    "modes.csv",
    "taps.csv",
    "perturbation.csv",
];
/// Pictures of the whole test.
const OF_TEST: [&str; 6] = [
    "frequencies",
    "mode-shapes",
    "shape-agreement",
    "cloud",
    "gap",
    "gap-place",
];
/// Pictures of each recording, followed by its name.
const OF_RECORDING: [&str; 5] = ["spectrum", "frf", "stabilisation", "amplitude", "taps"];

/// Files of a comparison of tests and of a series of tests, the page and the document apart.
const OF_COMPARISON: [&str; 5] = [
    "changes.csv",
    "compare.png",
    "compare.svg",
    "compare-spectra.png",
    "compare-spectra.svg",
];
const OF_SERIES: [&str; 3] = ["series.csv", "series.png", "series.svg"];

/// Names of all files that `run` or `compare` may have written beside this `report.json`; empty where the text is none
/// of ours. Pictures of recordings that it does not name are somebody else's.
pub fn earlier_files(report_json: &str) -> Vec<String> {
    let Ok(report) = serde_json::from_str::<Value>(report_json) else {
        return Vec::new();
    };
    let ours = report["version"].is_u64() && report["warnings"].is_array();
    if !ours {
        return Vec::new();
    }
    let [has_compared, has_series] = ["compare", "series"].map(|key| report[key].is_object());
    if has_compared || has_series {
        let compared = OF_COMPARISON.iter().filter(|_| has_compared);
        let names = OF_ALL.iter().chain(compared);
        let of_series = OF_SERIES.iter().filter(|_| has_series);
        return names
            .chain(of_series)
            .map(|name| (*name).to_owned())
            .collect();
    }
    let recordings = report["recordings"].as_array();
    let files = recordings
        .into_iter()
        .flatten()
        .filter_map(|recording| recording["file"].as_str());
    let of_recordings = stems(files)
        .into_iter()
        .flat_map(|stem| OF_RECORDING.map(|kind| format!("{kind}-{stem}")));
    let pictures = OF_TEST
        .map(str::to_owned)
        .into_iter()
        .chain(of_recordings)
        .flat_map(|name| [format!("{name}.png"), format!("{name}.svg")]);
    // Where the earlier run wrote no model, one of that name is somebody else's.
    let model = report["gap"]["updated_model"]["file"].as_str();
    let model = model.filter(|file| *file == MODEL_FILE).map(str::to_owned);
    // Files for other programs, where an earlier run has written some.
    let summed = report["sheet"]["files"].as_array();
    let signed = summed.is_some_and(|files| !files.is_empty());
    let exported = report["exported"].as_array();
    let exported = exported.into_iter().flatten().filter_map(Value::as_str);
    let exported = exported.filter(|file| EXCHANGED.contains(file));
    OF_ALL
        .into_iter()
        .chain(TABLES)
        .chain([VERSION_FILE])
        .chain(signed.then_some(SHEET))
        .chain(exported)
        .map(str::to_owned)
        .chain(model)
        .chain(pictures)
        .collect()
}
