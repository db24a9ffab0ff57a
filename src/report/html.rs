//! The report as one HTML page that needs nothing else.

use askama::Template;

use super::ReportError;
use super::document::{Document, WarningSection};
use super::format::significant;
use super::summary::sentences;
use super::tables::{self, Table};

/// A picture inside the page.
#[derive(Debug, Clone, PartialEq)]
pub struct InlineFigure {
    /// What it shows and what to look for.
    pub caption: String,
    /// An `<svg>` element that this crate made.
    pub svg: String,
}

/// The page's pictures by the section they stand in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PageFigures {
    /// Spectra and frequency response functions.
    pub spectra: Vec<InlineFigure>,
    /// Recordings over time.
    pub taps: Vec<InlineFigure>,
    /// Predicted beside measured frequencies.
    pub comparison: Vec<InlineFigure>,
    /// Estimates under changed frequencies.
    pub cloud: Vec<InlineFigure>,
}

#[derive(Template)]
#[template(path = "report.html")]
struct Page<'a> {
    title: String,
    facts: Vec<(&'static str, String)>,
    warnings: &'a [WarningSection],
    findings: Vec<String>,
    sections: Vec<Section<'a>>,
    version: &'static str,
}

/// A part of the page.
struct Section<'a> {
    id: &'static str,
    title: &'static str,
    missing: String,
    tables: Vec<Table>,
    figures: &'a [InlineFigure],
}

/// The whole page.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled.
pub fn render_html(document: &Document, figures: &PageFigures) -> Result<String, ReportError> {
    let page = Page {
        title: title(document),
        facts: facts(document),
        warnings: &document.warnings,
        findings: sentences(document),
        sections: sections(document, figures),
        version: env!("CARGO_PKG_VERSION"),
    };
    page.render().map_err(ReportError::Html)
}

fn title(document: &Document) -> String {
    let name = document.test.as_ref().map(|test| test.name.clone());
    name.filter(|name| !name.is_empty())
        .unwrap_or_else(|| "Unnamed test".to_owned())
}

/// What was tested, in pairs of name and value.
fn facts(document: &Document) -> Vec<(&'static str, String)> {
    let Some(test) = &document.test else {
        return Vec::new();
    };
    let quantity = |value: Option<f64>, unit: &str| {
        value.map(|value| format!("{} {unit}", significant(value, 4)))
    };
    let model = test.model.as_deref().map(|model| match model {
        "2p" => "two stiffnesses (2p)".to_owned(),
        "3p" => "three stiffnesses (3p)".to_owned(),
        other => other.to_owned(),
    });
    let all = [
        ("Joint", test.kind.clone()),
        ("Joint model", model),
        ("Beam theory", test.beam_theory.clone()),
        ("Length L", quantity(test.length, "m")),
        (
            "Bending stiffness EI",
            quantity(test.bending_stiffness, "N m\u{b2}"),
        ),
        (
            "Mass per length \u{3c1}A",
            quantity(test.mass_per_length, "kg/m"),
        ),
    ];
    all.into_iter()
        .filter_map(|(name, value)| Some((name, value?)))
        .collect()
}

fn sections<'a>(document: &Document, figures: &'a PageFigures) -> Vec<Section<'a>> {
    let found = |tables: Vec<Option<Table>>| tables.into_iter().flatten().collect::<Vec<_>>();
    let all = vec![
        Section {
            id: "joint",
            title: "The joint",
            missing: no_estimate(document),
            tables: found(vec![
                tables::parameters(document),
                tables::prediction(document),
                tables::pairs(document),
            ]),
            figures: &figures.comparison,
        },
        Section {
            id: "uncertainty",
            title: "How sure is the stiffness",
            missing: "Nothing to perturb: there is no estimate.".to_owned(),
            tables: found(vec![
                tables::spans(document),
                tables::sensitivity(document),
                tables::perturbation(document),
            ]),
            figures: &figures.cloud,
        },
        Section {
            id: "modes",
            title: "Modes and spectra",
            missing: "No modes were found.".to_owned(),
            tables: found(vec![tables::modes(document), tables::readings(document)]),
            figures: &figures.spectra,
        },
        Section {
            id: "recordings",
            title: "Recordings and taps",
            missing: "No recordings: the frequencies were read elsewhere.".to_owned(),
            tables: found(vec![tables::recordings(document), tables::taps(document)]),
            figures: &figures.taps,
        },
    ];
    all
}

fn no_estimate(document: &Document) -> String {
    match (&document.estimate, &document.estimate_reason) {
        (Some(None), Some(reason)) => format!("There is no estimate: {reason}."),
        (Some(None), None) => "There is no estimate.".to_owned(),
        _ => "No joint was asked for.".to_owned(),
    }
}

impl Section<'_> {
    /// Whether there is nothing to show but the reason why.
    fn is_empty(&self) -> bool {
        self.tables.is_empty() && self.figures.is_empty()
    }
}
