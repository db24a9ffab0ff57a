//! All files of one run.

use rayon::prelude::*;

use super::chart::{Chart, PictureFormat, packed, render_picture, render_svg};
use super::charts::amplitude::amplitude;
use super::charts::gap::{gap, place_map};
use super::charts::joint::{cloud, frequencies};
use super::charts::shapes::shapes;
use super::charts::spectra::{frf, spectrum};
use super::charts::stabilisation::stabilisation;
use super::charts::taps::taps;
use super::document::Document;
use super::figures::RecordingFigure;
use super::html::{InlineFigure, PageFigures, render_html};
use super::short_names::stems;
use super::{
    ReportError, ReportFile, render_json, render_modes_csv, render_parameters_csv,
    render_perturbation_csv,
};

/// A picture on its way to a file and to the page.
struct Picture {
    /// Name of its files, without ending.
    name: String,
    chart: Chart,
}

/// All files of a report: `report.html`, `report.json`, `parameters.csv`, `modes.csv`,
/// `perturbation.csv` where something was perturbed, and the pictures that apply, each as PNG and as SVG:
/// `spectrum-*`, `frf-*`, `stabilisation-*`, `amplitude-*`, `taps-*`, `frequencies`, `mode-shapes`, `cloud`,
/// `gap`, `gap-place`.
///
/// # Errors
/// The first [`ReportError`] of any file.
pub fn render_run(
    document: &Document,
    figures: &[RecordingFigure],
) -> Result<Vec<ReportFile>, ReportError> {
    let pictures = pictures(document, figures);
    type Rendered = Vec<([ReportFile; 2], InlineFigure)>;
    let (rendered, json) = rayon::join(
        || {
            pictures
                .par_iter()
                .map(rendered)
                .collect::<Result<Rendered, _>>()
        },
        || render_json(document),
    );
    let mut page = PageFigures::default();
    let mut files = Vec::new();
    for (picture, (of_picture, inline)) in pictures.iter().zip(rendered?) {
        files.extend(of_picture);
        match picture.chart.kind {
            "taps" => page.taps.push(inline),
            "frequencies" | "mode-shapes" => page.comparison.push(inline),
            "gap" | "gap-place" => page.gap.push(inline),
            "cloud" => page.cloud.push(inline),
            _ => page.spectra.push(inline),
        }
    }
    // Before a figure that takes a page of its own, half of a page would stay empty.
    page.spectra.sort_by_key(|figure| figure.tall);
    let mut words = vec![
        ("report.html", render_html(document, &page)?),
        ("report.json", json?),
        ("parameters.csv", render_parameters_csv(document)?),
        ("modes.csv", render_modes_csv(document)?),
    ];
    if document.perturbation.is_some() {
        words.push(("perturbation.csv", render_perturbation_csv(document)?));
    }
    files.extend(words.into_iter().map(|(name, text)| ReportFile {
        name: name.to_owned(),
        bytes: text.into_bytes(),
    }));
    Ok(files)
}

/// The averaged spectra of a recording as a picture, its functions where the file holds nothing else; `None` when no
/// tap was accepted.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_spectrum_picture(
    figure: &RecordingFigure,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    optional(spectrum(figure).or_else(|| frf(figure)), format)
}

/// The frequency response functions of a recording as a picture; `None` without a hammer or an accepted
/// tap.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_frf_picture(
    figure: &RecordingFigure,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    optional(frf(figure), format)
}

/// The estimates under changed frequencies as a picture; `None` where there are none.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_cloud_picture(
    document: &Document,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    optional(cloud(document), format)
}

fn optional(chart: Option<Chart>, format: PictureFormat) -> Result<Option<Vec<u8>>, ReportError> {
    let picture = chart.map(|chart| render_picture(&chart.draw(), format));
    picture.transpose()
}

/// A picture as files for screens and for papers, and for the page.
fn rendered(picture: &Picture) -> Result<([ReportFile; 2], InlineFigure), ReportError> {
    let drawing = picture.chart.draw();
    let file = |ending: &str, format: PictureFormat| {
        Ok::<_, ReportError>(ReportFile {
            name: format!("{}.{ending}", picture.name),
            bytes: render_picture(&drawing, format)?,
        })
    };
    let inline = InlineFigure {
        caption: picture.chart.caption.clone(),
        svg: render_svg(&drawing),
        tall: drawing.height > drawing.width,
        live: picture.chart.page().as_ref().map(packed).transpose()?,
    };
    let files = [
        file("png", PictureFormat::Png)?,
        file("svg", PictureFormat::Svg)?,
    ];
    Ok((files, inline))
}

/// All pictures that there are data for.
fn pictures(document: &Document, figures: &[RecordingFigure]) -> Vec<Picture> {
    let stems = stems(figures.iter().map(|figure| figure.file.as_str()));
    let of_recordings = figures.par_iter().zip(&stems);
    let of_recordings = of_recordings.flat_map_iter(|(figure, stem)| {
        let charts = [
            spectrum(figure),
            frf(figure),
            stabilisation(figure),
            figure.amplitude.as_ref().and_then(amplitude),
            taps(figure),
        ];
        charts.into_iter().flatten().map(move |chart| Picture {
            name: format!("{}-{stem}", chart.kind),
            chart,
        })
    });
    let mut pictures: Vec<Picture> = of_recordings.collect();
    let of_model = [
        frequencies(document),
        shapes(document),
        gap(document),
        place_map(document),
        cloud(document),
    ];
    pictures.extend(of_model.into_iter().flatten().map(|chart| Picture {
        name: chart.kind.to_owned(),
        chart,
    }));
    pictures
}
