//! The report as one HTML page that needs nothing else.

use askama::Template;

use super::ReportError;
use super::document::{Document, RecordingSection, TestSection, WarningSection};
use super::format::{significant, trimmed};
use super::tables::{self, Table};
use super::words::findings::sentences;
use tapjoint_beam::{Assembly, BeamTheory};
use tapjoint_description::JointModel;

/// A picture inside the page.
#[derive(Debug, Clone, PartialEq)]
pub struct InlineFigure {
    /// What it shows and what to look for.
    pub caption: String,
    /// An `<svg>` element that this crate made.
    pub svg: String,
    /// The same curves for the page's script, as [`super::chart::packed`] makes them.
    pub live: Option<String>,
    /// Whether it is so high that in print it takes a page of its own.
    pub tall: bool,
}

/// The plotting library, its style and the page's own script, all inside the page: a report opens
/// from a disk without a network.
const PLOT_LIBRARY: &str = include_str!("assets/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("assets/uPlot.min.css");
const PLOT_LICENSE: &str = include_str!("assets/uPlot-LICENSE.txt");
const SCRIPT: &str = include_str!("templates/report.js");
const POINTS: &str = include_str!("templates/report_points.js");

/// What makes pictures live; left out where there is none.
struct Live {
    library: &'static str,
    style: &'static str,
    license: &'static str,
    script: &'static str,
    points: &'static str,
}

/// The page's pictures by the section they stand in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PageFigures {
    /// Spectra and frequency response functions.
    pub spectra: Vec<InlineFigure>,
    /// Recordings over time.
    pub taps: Vec<InlineFigure>,
    /// Predicted beside measured frequencies, and the shapes of the modes.
    pub comparison: Vec<InlineFigure>,
    /// The gap between model and measurement.
    pub gap: Vec<InlineFigure>,
    /// Estimates under changed frequencies.
    pub cloud: Vec<InlineFigure>,
}

impl PageFigures {
    fn any_live(&self) -> bool {
        let shelves = [
            &self.spectra,
            &self.taps,
            &self.comparison,
            &self.gap,
            &self.cloud,
        ];
        let mut all = shelves.into_iter().flatten();
        all.any(|figure| figure.live.is_some())
    }
}

#[derive(Template)]
#[template(path = "report.html")]
struct Page<'a> {
    title: String,
    facts: Vec<(&'static str, String)>,
    warnings: &'a [WarningSection],
    findings: Vec<String>,
    sections: Vec<Section<'a>>,
    method: Method,
    live: Option<Live>,
    version: &'static str,
}

/// Which parts of the method were applied.
struct Method {
    recordings: bool,
    joint: bool,
}

/// A part of the page.
struct Section<'a> {
    id: &'static str,
    title: &'static str,
    missing: String,
    /// What the section says before its tables, a paragraph each.
    story: Vec<String>,
    tables: Vec<Table>,
    /// Long tables that open on demand.
    folded: Vec<Table>,
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
        method: Method {
            recordings: document.recordings.is_some(),
            joint: document.estimate.is_some() || document.prediction.is_some(),
        },
        live: figures.any_live().then_some(Live {
            library: PLOT_LIBRARY,
            style: PLOT_STYLE,
            license: PLOT_LICENSE,
            script: SCRIPT,
            points: POINTS,
        }),
        version: env!("CARGO_PKG_VERSION"),
    };
    page.render().map_err(ReportError::Html)
}

fn title(document: &Document) -> String {
    let name = document.test.as_ref().map(|test| test.name.clone());
    name.filter(|name| !name.is_empty())
        .unwrap_or_else(|| "Unnamed test".to_owned())
}

/// What was tested, in pairs of name and value; of a bare recording what the file says.
fn facts(document: &Document) -> Vec<(&'static str, String)> {
    let described = document.test.as_ref().filter(|test| test.kind.is_some());
    let all = match (described, document.recordings.as_deref()) {
        (Some(test), _) => test_facts(test),
        (None, Some([recording])) => recording_facts(recording),
        _ => Vec::new(),
    };
    all.into_iter()
        .filter_map(|(name, value)| Some((name, value?)))
        .collect()
}

fn test_facts(test: &TestSection) -> Vec<(&'static str, Option<String>)> {
    let quantity = |value: Option<f64>, unit: &str| {
        value.map(|value| format!("{} {unit}", significant(value, 4)))
    };
    let kind = test.kind.map(|kind| match kind {
        Assembly::Cantilever => "cantilever",
        Assembly::Lap => "lap joint",
        Assembly::Free => "none: free beam",
    });
    let model = test.model.map(|model| match model {
        JointModel::TwoParameter => "two stiffnesses (2p)",
        JointModel::ThreeParameter => "three stiffnesses (3p)",
    });
    let theory = test.beam_theory.map(|theory| match theory {
        BeamTheory::Timoshenko => "Timoshenko",
        BeamTheory::Euler => "Euler",
    });
    vec![
        ("Joint", kind.map(str::to_owned)),
        ("Joint model", model.map(str::to_owned)),
        ("Beam theory", theory.map(str::to_owned)),
        ("Length L", quantity(test.length, "m")),
        (
            "Bending stiffness EI",
            quantity(test.bending_stiffness, "N m\u{b2}"),
        ),
        (
            "Mass per length \u{3c1}A",
            quantity(test.mass_per_length, "kg/m"),
        ),
    ]
}

fn recording_facts(recording: &RecordingSection) -> Vec<(&'static str, Option<String>)> {
    vec![
        ("Format", Some(recording.format.clone())),
        (
            "Rate",
            recording
                .sample_rate
                .map(|rate| format!("{} Hz", trimmed(rate, 8))),
        ),
        (
            "Length",
            recording
                .seconds
                .map(|seconds| format!("{} s", trimmed(seconds, 4))),
        ),
        ("Channels", Some(recording.channels.to_string())),
    ]
}

/// The page's parts; what was not asked for has none.
fn sections<'a>(document: &Document, figures: &'a PageFigures) -> Vec<Section<'a>> {
    let all = [
        joint_section(document, figures),
        gap_section(document, figures),
        uncertainty_section(document, figures),
        Some(modes_section(document, figures)),
        quality_section(document),
        recordings_section(document, figures),
    ];
    all.into_iter().flatten().collect()
}

fn found(tables: Vec<Option<Table>>) -> Vec<Table> {
    tables.into_iter().flatten().collect()
}

fn joint_section<'a>(document: &Document, figures: &'a PageFigures) -> Option<Section<'a>> {
    if document.estimate.is_none() && document.prediction.is_none() {
        return None;
    }
    Some(Section {
        id: "joint",
        title: if document.has_joint() {
            "The joint"
        } else {
            "The beam"
        },
        missing: no_estimate(document),
        story: Vec::new(),
        tables: found(vec![
            tables::parameters(document),
            tables::correlations(document),
            tables::methods(document),
            tables::prediction(document),
            tables::pairs(document),
        ]),
        folded: Vec::new(),
        figures: &figures.comparison,
    })
}

fn gap_section<'a>(document: &Document, figures: &'a PageFigures) -> Option<Section<'a>> {
    document.gap.as_ref()?;
    Some(Section {
        id: "gap",
        title: "What the model still misses",
        missing: String::new(),
        story: tables::gap_story(document),
        tables: found(vec![
            tables::hypotheses(document),
            tables::next_tests(document),
        ]),
        folded: Vec::new(),
        figures: &figures.gap,
    })
}

fn uncertainty_section<'a>(document: &Document, figures: &'a PageFigures) -> Option<Section<'a>> {
    let tables = found(vec![
        tables::spans(document),
        tables::sensitivity(document),
        tables::perturbation(document),
        tables::averages(document),
        tables::monte_carlo(document),
    ]);
    let section = Section {
        id: "uncertainty",
        title: "How sure is the stiffness",
        missing: String::new(),
        story: Vec::new(),
        tables,
        folded: Vec::new(),
        figures: &figures.cloud,
    };
    (!section.is_empty()).then_some(section)
}

fn modes_section<'a>(document: &Document, figures: &'a PageFigures) -> Section<'a> {
    Section {
        id: "modes",
        title: match (&document.recordings, &document.test) {
            (None, _) => "Modes",
            (_, Some(test)) if test.kind.is_some() => "Modes and spectra",
            _ => "Resonances and spectra",
        },
        missing: "No resonances were found.".to_owned(),
        story: Vec::new(),
        tables: found(vec![tables::modes(document)]),
        folded: found(vec![
            tables::mode_details(document),
            tables::readings(document),
            tables::reading_details(document),
        ]),
        figures: &figures.spectra,
    }
}

fn quality_section<'a>(document: &Document) -> Option<Section<'a>> {
    let count = tables::quality_count(document)?;
    let mut tables = found(vec![
        tables::quality_doubts(document),
        tables::quality(document),
    ]);
    if let Some(last) = tables.last_mut() {
        last.note = format!("{} All {count}.", last.note);
    }
    Some(Section {
        id: "quality",
        title: "How well it was measured",
        missing: String::new(),
        story: Vec::new(),
        tables,
        folded: found(vec![tables::quality_all(document)]),
        figures: &[],
    })
}

fn recordings_section<'a>(document: &Document, figures: &'a PageFigures) -> Option<Section<'a>> {
    document.recordings.as_ref()?;
    Some(Section {
        id: "recordings",
        title: "Recordings and taps",
        missing: "There is no recording.".to_owned(),
        story: Vec::new(),
        tables: found(vec![
            tables::recordings(document),
            tables::conditions(document),
            tables::channels(document),
            tables::taps(document),
        ]),
        folded: Vec::new(),
        figures: &figures.taps,
    })
}

fn no_estimate(document: &Document) -> String {
    match (&document.estimate, &document.estimate_reason) {
        (Some(None), Some(reason)) => format!("There is no estimate: {reason}."),
        (Some(None), None) => "There is no estimate.".to_owned(),
        _ => "No estimate was asked for.".to_owned(),
    }
}

impl Section<'_> {
    /// Its tables, each with whether it is folded; those that open on demand last.
    fn all_tables(&self) -> Vec<(&Table, bool)> {
        let open = self.tables.iter().map(|table| (table, false));
        let folded = self.folded.iter().map(|table| (table, true));
        open.chain(folded).collect()
    }

    /// Whether there is nothing to show but the reason why.
    fn is_empty(&self) -> bool {
        self.tables.is_empty() && self.figures.is_empty() && self.story.is_empty()
    }
}
