//! All files of one run.

use rayon::prelude::*;
use serde::Serialize;

use super::document::Document;
use super::figures::RecordingFigure;
use super::html::{InlineFigure, PageFigures, packed, render_html};
use super::live::{LivePlot, live_frf, live_spectrum, live_taps};
use super::live_amplitude::live_amplitude;
use super::live_model::{live_frequencies, live_gap, live_place_map, live_shapes};
use super::live_points::{LivePoints, live_cloud, live_stabilisation};
use super::plot::amplitude::draw_amplitude;
use super::plot::cloud::draw_cloud;
use super::plot::comparison::draw_frequencies;
use super::plot::frf::draw_frf;
use super::plot::gap::{draw_gap, gap_caption};
use super::plot::place_map::draw_place_map;
use super::plot::shapes::draw_shapes;
use super::plot::spectrum::draw_spectrum;
use super::plot::stabilisation::draw_stabilisation;
use super::plot::time::draw_taps;
use super::plot::{Drawing, PictureFormat, render_picture, render_svg};
use super::{
    ReportError, ReportFile, render_json, render_modes_csv, render_parameters_csv,
    render_perturbation_csv,
};

/// Where a picture stands in the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shelf {
    Spectra,
    Taps,
    Comparison,
    Gap,
    Cloud,
}

/// A picture on its way to a file and to the page.
struct Picture {
    shelf: Shelf,
    name: String,
    caption: String,
    drawing: Drawing,
    /// The same curves for the page's script.
    live: Option<Live>,
}

/// What the page's script draws in the picture's place.
#[derive(Serialize)]
#[serde(untagged)]
enum Live {
    Curves(LivePlot),
    Points(LivePoints),
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
        match picture.shelf {
            Shelf::Spectra => page.spectra.push(inline),
            Shelf::Taps => page.taps.push(inline),
            Shelf::Comparison => page.comparison.push(inline),
            Shelf::Gap => page.gap.push(inline),
            Shelf::Cloud => page.cloud.push(inline),
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
    optional(draw_spectrum(figure).or_else(|| draw_frf(figure)), format)
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
    optional(draw_frf(figure), format)
}

/// The estimates under changed frequencies as a picture; `None` where there are none.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn.
pub fn render_cloud_picture(
    document: &Document,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    optional(draw_cloud(document), format)
}

fn optional(
    drawing: Option<Drawing>,
    format: PictureFormat,
) -> Result<Option<Vec<u8>>, ReportError> {
    let picture = drawing.map(|drawing| render_picture(&drawing, format));
    picture.transpose()
}

/// A picture as files for screens and for papers, and for the page.
fn rendered(picture: &Picture) -> Result<([ReportFile; 2], InlineFigure), ReportError> {
    let file = |ending: &str, format: PictureFormat| {
        Ok::<_, ReportError>(ReportFile {
            name: format!("{}.{ending}", picture.name),
            bytes: render_picture(&picture.drawing, format)?,
        })
    };
    let inline = InlineFigure {
        caption: picture.caption.clone(),
        svg: render_svg(&picture.drawing)?,
        tall: picture.drawing.height > picture.drawing.width,
        live: picture.live.as_ref().map(packed).transpose()?,
    };
    let files = [
        file("png", PictureFormat::Png)?,
        file("svg", PictureFormat::Svg)?,
    ];
    Ok((files, inline))
}

fn pictures(document: &Document, figures: &[RecordingFigure]) -> Vec<Picture> {
    let stems = stems(figures.iter().map(|figure| figure.file.as_str()));
    let of_recordings = figures.par_iter().zip(&stems);
    let of_recordings =
        of_recordings.flat_map_iter(|(figure, stem)| recording_pictures(figure, stem));
    let mut pictures: Vec<Picture> = of_recordings.collect();
    pictures.extend(draw_frequencies(document).map(|drawing| {
        Picture {
            shelf: Shelf::Comparison,
            name: "frequencies".to_owned(),
            caption: "Errors of the predicted frequencies. A bar that passes zero means that the \
                  reading alone explains the error."
                .to_owned(),
            drawing,
            live: live_frequencies(document).map(Live::Points),
        }
    }));
    pictures.extend(draw_shapes(document).map(|drawing| {
        Picture {
            shelf: Shelf::Comparison,
            name: "mode-shapes".to_owned(),
            caption: "Shapes of the predicted modes, of the described beam on the estimated joint with what sits \
                      on it. A sensor or a tap near a node hardly sees the mode."
                .to_owned(),
            drawing,
            live: live_shapes(document).map(Live::Points),
        }
    }));
    pictures.extend(gap_pictures(document));
    pictures.extend(draw_cloud(document).map(|drawing| {
        Picture {
            shelf: Shelf::Cloud,
            name: "cloud".to_owned(),
            caption: "Estimates when the frequencies are changed within what their readings allow."
                .to_owned(),
            drawing,
            live: live_cloud(document).map(Live::Points),
        }
    }));
    pictures
}

fn gap_pictures(document: &Document) -> Vec<Picture> {
    let kinds = [
        (
            "gap",
            draw_gap(document),
            live_gap(document),
            gap_caption(document),
        ),
        (
            "gap-place",
            draw_place_map(document),
            live_place_map(document),
            "Where along the beam a local change of stiffness or of mass would explain the errors: above each place by \
             itself, which peaks where a local cause sits; below all places together, bars: one standard deviation."
                .to_owned(),
        ),
    ];
    let picture =
        |(name, drawing, live, caption): (&str, Option<_>, Option<LivePoints>, String)| {
            Some(Picture {
                shelf: Shelf::Gap,
                name: name.to_owned(),
                caption,
                drawing: drawing?,
                live: live.map(Live::Points),
            })
        };
    kinds.into_iter().filter_map(picture).collect()
}

fn recording_pictures(figure: &RecordingFigure, stem: &str) -> Vec<Picture> {
    let file = &figure.file;
    let amplitude = figure.amplitude.as_ref();
    let kinds = [
        (
            Shelf::Spectra,
            "spectrum",
            draw_spectrum(figure),
            live_spectrum(figure).map(Live::Curves),
            format!("Averaged spectra of {file} with the resonances found."),
        ),
        (
            Shelf::Spectra,
            "frf",
            draw_frf(figure),
            live_frf(figure).map(Live::Curves),
            format!("Response per force (H1) of {file}, magnitude, phase and coherence."),
        ),
        (
            Shelf::Spectra,
            "stabilisation",
            draw_stabilisation(figure),
            live_stabilisation(figure).map(Live::Points),
            format!(
                "Stabilisation diagram of {file}: poles that the fit finds at each order, marked by \
                 what of them the order before had."
            ),
        ),
        (
            Shelf::Spectra,
            "amplitude",
            figure.amplitude.as_ref().and_then(draw_amplitude),
            amplitude.and_then(live_amplitude).map(Live::Points),
            format!("Frequency and damping of the modes of {file} against amplitude."),
        ),
        (
            Shelf::Taps,
            "taps",
            draw_taps(figure),
            live_taps(figure).map(Live::Curves),
            format!("{file} over time; numbers count the taps."),
        ),
    ];
    kinds
        .into_iter()
        .filter_map(|(shelf, kind, drawing, live, caption)| {
            Some(Picture {
                shelf,
                name: format!("{kind}-{stem}"),
                caption,
                drawing: drawing?,
                live,
            })
        })
        .collect()
}

/// File names without folder and ending, safe as part of a name, each different.
pub(super) fn stems<'a>(files: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for file in files {
        let stem = stem(file);
        let mut unique = stem.clone();
        let mut number = 2;
        while stems.contains(&unique) {
            unique = format!("{stem}-{number}");
            number += 1;
        }
        stems.push(unique);
    }
    stems
}

fn stem(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let safe: String = stem
        .chars()
        .map(|c| {
            let plain = c.is_alphanumeric() || matches!(c, '-' | '_');
            if plain { c } else { '-' }
        })
        .collect();
    if safe.is_empty() {
        "recording".to_owned()
    } else {
        safe
    }
}
