//! The report as one HTML page that needs nothing else.

use askama::Template;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::ReportError;
use super::document::{Document, SheetSection, WarningSection};
use super::format::{capital, significant, trimmed};
use super::picture::{Chart, InlineFigure};
use super::sheet::{Sheet, running_head};
use super::tables::{self, Table};
use super::words::answer::Answer;
use super::words::diagnosis::gap_story;
use super::words::findings::{no_estimate, sentences};
use super::words::{comparison, series};
use tapjoint_analysis::severity_of;
use tapjoint_beam::{Assembly, BeamTheory};
use tapjoint_description::JointModel;

/// The plotting library, its style and the page's own script, all inside the page: a report opens
/// from a disk without a network.
const PLOT_LIBRARY: &str = include_str!("assets/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("assets/uPlot.min.css");
const PLOT_LICENSE: &str = include_str!("assets/uPlot-LICENSE.txt");
const SCRIPT: &str = include_str!("templates/report.js");
const POINTS: &str = include_str!("templates/report_points.js");
const VIEWS: &str = include_str!("templates/report_views.js");
const RELOAD: &str = include_str!("templates/report_reload.js");

/// Warnings of one code that a page on several tests lists: those of two tests with two recordings each.
const MOST_ALIKE: usize = 4;

/// The scripts that make pictures live; left out where there is no picture.
struct Live {
    library: &'static str,
    style: &'static str,
    license: &'static str,
    script: &'static str,
    points: &'static str,
    views: &'static str,
}

#[derive(Template)]
#[template(path = "report.html")]
struct Page<'a> {
    title: String,
    facts: Vec<(&'static str, String)>,
    answer: &'a Answer,
    sheet: Option<Sheet<'a>>,
    /// Number, date, operator, laboratory and specimen, as far as they are known.
    filed: Vec<&'a str>,
    /// Foot of printed pages.
    running: String,
    /// The picture of the first screen.
    first_figure: Option<&'a InlineFigure>,
    warnings: Vec<&'a WarningSection>,
    /// Number of further warnings.
    hidden_warnings: usize,
    findings: Vec<String>,
    sections: Vec<Section<'a>>,
    method: Method,
    live: Option<Live>,
    /// Version of the page, if it reloads itself when there is another.
    reload: Option<String>,
    version: &'static str,
}

/// Parts of the method that were applied.
#[derive(Default)]
struct Method {
    recordings: bool,
    joint: bool,
    comparison: bool,
    series: bool,
}

impl Method {
    fn is_told(&self) -> bool {
        self.recordings || self.joint || self.comparison || self.series
    }
}

/// A page on many tests, of which none has a document here.
#[derive(Debug, Clone, Default)]
pub struct BatchPage {
    /// Title.
    pub title: String,
    /// Facts in pairs of name and value.
    pub facts: Vec<(&'static str, String)>,
    /// What was found, in a few sentences.
    pub findings: Vec<String>,
    /// Doubts, the worst first.
    pub warnings: Vec<WarningSection>,
    /// Parts of the page.
    pub sections: Vec<BatchSection>,
}

/// A part of a page on many tests.
#[derive(Debug, Clone, Default)]
pub struct BatchSection {
    /// Short name, for links.
    pub id: &'static str,
    /// Title.
    pub title: &'static str,
    /// Tables.
    pub tables: Vec<Table>,
    /// Charts.
    pub charts: Vec<Chart>,
}

/// Returns a page on many tests, which looks like that of a report.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled, and those of the charts.
pub fn render_batch_page(page: BatchPage) -> Result<String, ReportError> {
    let (mut sections, mut figures) = (Vec::new(), Vec::new());
    for section in page.sections {
        for chart in &section.charts {
            figures.push(InlineFigure::of(section.id, chart, &chart.draw())?);
        }
        sections.push(Section {
            id: section.id,
            title: section.title,
            tables: section.tables,
            ..Section::default()
        });
    }
    for section in &mut sections {
        let own = figures.iter().filter(|figure| figure.section == section.id);
        section.figures = own.collect();
    }
    let answer = Answer {
        state: None,
        reason: String::new(),
        name: page.title.clone(),
        measured: Vec::new(),
        modes: None,
        strongest: Vec::new(),
        values: Vec::new(),
        model: None,
        findings: page.findings.clone(),
        action: None,
        doubts: Vec::new(),
    };
    let filled = Page {
        running: page.title.clone(),
        title: page.title,
        facts: page.facts,
        answer: &answer,
        sheet: None,
        filed: Vec::new(),
        first_figure: None,
        warnings: page.warnings.iter().collect(),
        hidden_warnings: 0,
        findings: page.findings,
        sections,
        method: Method::default(),
        live: live_of(&figures),
        reload: None,
        version: env!("CARGO_PKG_VERSION"),
    };
    filled.render().map_err(ReportError::Html)
}

/// Returns the scripts that figures need; `None` where none is live.
fn live_of(figures: &[InlineFigure]) -> Option<Live> {
    let any_live = figures.iter().any(|figure| figure.live.is_some());
    any_live.then_some(Live {
        library: PLOT_LIBRARY,
        style: PLOT_STYLE,
        license: PLOT_LICENSE,
        script: SCRIPT,
        points: POINTS,
        views: VIEWS,
    })
}

/// A part of the page.
#[derive(Default)]
struct Section<'a> {
    id: &'static str,
    title: &'static str,
    /// Sentence where there is nothing to show.
    missing: String,
    /// Paragraphs before the tables.
    story: Vec<String>,
    tables: Vec<Table>,
    /// Long tables that open on demand.
    folded: Vec<Table>,
    figures: Vec<&'a InlineFigure>,
}

/// Returns the whole page.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled.
pub fn render_html(document: &Document, figures: &[InlineFigure]) -> Result<String, ReportError> {
    let answer = Answer::of(document);
    let page = page_of(document, &answer, figures);
    page.render().map_err(ReportError::Html)
}

/// Returns the page without what follows its first screen: the answer, its picture, the doubts, and what was tested. It has no
/// script.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled.
pub(crate) fn render_first_screen_html(
    document: &Document,
    figure: Option<InlineFigure>,
) -> Result<String, ReportError> {
    let figure = figure.map(|figure| InlineFigure {
        live: None,
        ..figure
    });
    let figures: Vec<InlineFigure> = figure.into_iter().collect();
    let answer = Answer::of(document);
    let mut page = page_of(document, &answer, &figures);
    page.sections.clear();
    page.sheet = None;
    page.method = Method::default();
    page.render().map_err(ReportError::Html)
}

/// Returns the whole page as one that reloads itself, and its version. It loads the script [`VERSION_FILE`] beside it every
/// second, and reloads when that states another version.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled.
///
/// [`VERSION_FILE`]: crate::VERSION_FILE
pub(crate) fn render_reloading_html(
    document: &Document,
    figures: &[InlineFigure],
) -> Result<(String, String), ReportError> {
    let answer = Answer::of(document);
    let mut page = page_of(document, &answer, figures);
    let mut sum = DefaultHasher::new();
    page.render().map_err(ReportError::Html)?.hash(&mut sum);
    let version = format!("{:016x}", sum.finish());
    page.reload = Some(version.clone());
    Ok((page.render().map_err(ReportError::Html)?, version))
}

/// Fills the template of the page.
fn page_of<'a>(
    document: &'a Document,
    answer: &'a Answer,
    figures: &'a [InlineFigure],
) -> Page<'a> {
    let mut sections = match is_comparison(document) {
        true => comparison_sections(document),
        false => {
            let mut sections = model_sections(document);
            sections.extend(measurement_sections(document));
            sections
        }
    };
    for section in &mut sections {
        let own = figures.iter().filter(|figure| figure.section == section.id);
        section.figures = own.collect();
    }
    // Uncertainties may stand in pictures alone.
    sections.retain(|section| section.id != "uncertainty" || !section.is_empty());
    let name = document.test.as_ref().map(|test| test.name.clone());
    let name = name.filter(|name| !name.is_empty());
    let name = name.unwrap_or_else(|| "Unnamed test".to_owned());
    let (warnings, hidden_warnings) = listed_warnings(document);
    let first_figure = figures.iter().find(|figure| figure.section == "answer");
    let filed = document.sheet.iter().flat_map(SheetSection::facts);
    let filed = filed.map(|(_, text)| text).filter(|text| !text.is_empty());
    Page {
        title: match (&document.series, &document.compare) {
            (Some(_), _) => format!("{name}: a series of tests"),
            (None, Some(_)) => format!("{name}: before and after"),
            (None, None) => name.clone(),
        },
        facts: facts(document),
        answer,
        sheet: Sheet::of(document, answer, first_figure),
        filed: filed.collect(),
        running: running_head(document, &name),
        first_figure,
        warnings,
        hidden_warnings,
        findings: sentences(document),
        sections,
        method: Method {
            recordings: document.recordings.is_some(),
            joint: document.estimate.is_some() || document.prediction.is_some(),
            comparison: document.compare.is_some(),
            series: document.series.is_some(),
        },
        live: live_of(figures),
        reload: None,
        version: env!("CARGO_PKG_VERSION"),
    }
}

/// Returns the warnings that are listed, the worst first, and the number of others. Many tests have many doubts of one
/// kind: a few stand for all.
fn listed_warnings(document: &Document) -> (Vec<&WarningSection>, usize) {
    let mut listed: Vec<&WarningSection> = Vec::new();
    let mut hidden = 0;
    for warning in document.main_warnings() {
        let alike = listed.iter().filter(|one| one.code == warning.code).count();
        match is_comparison(document) && alike >= MOST_ALIKE {
            true => hidden += 1,
            false => listed.push(warning),
        }
    }
    listed.sort_by_key(|one| severity_of(&one.code).unwrap_or(usize::MAX));
    (listed, hidden)
}

fn is_comparison(document: &Document) -> bool {
    document.compare.is_some() || document.series.is_some()
}

/// Returns what was tested, in pairs of name and value; of a bare recording what the file says.
fn facts(document: &Document) -> Vec<(&'static str, String)> {
    let described = document.test.as_ref().filter(|test| test.kind.is_some());
    let mut facts = compared_tests(document);
    match (described, document.recordings.as_deref()) {
        (Some(test), _) => {
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
            for (name, words) in [
                ("Joint", kind),
                ("Joint model", model),
                ("Beam theory", theory),
            ] {
                facts.extend(words.map(|words| (name, words.to_owned())));
            }
            for (name, value, unit) in [
                ("Length L", test.length, "m"),
                ("Bending stiffness EI", test.bending_stiffness, "N m\u{b2}"),
                ("Mass per length \u{3c1}A", test.mass_per_length, "kg/m"),
            ] {
                facts
                    .extend(value.map(|value| (name, format!("{} {unit}", significant(value, 4)))));
            }
        }
        (None, Some([recording])) => {
            facts.push(("Format", recording.format.clone()));
            let rate = recording.sample_rate;
            facts.extend(rate.map(|rate| ("Rate", format!("{} Hz", trimmed(rate, 8)))));
            let seconds = recording.seconds;
            facts.extend(seconds.map(|seconds| ("Length", format!("{} s", trimmed(seconds, 4)))));
            facts.push(("Channels", recording.channels.to_string()));
        }
        _ => {}
    }
    facts
}

/// Returns which tests were compared, in pairs of name and value.
fn compared_tests(document: &Document) -> Vec<(&'static str, String)> {
    if let Some(series) = &document.series {
        return vec![("Tests", series.tests.len().to_string())];
    }
    let Some(section) = &document.compare else {
        return Vec::new();
    };
    // The table has the names of many.
    let said = |files: &[String]| match files {
        [only] => only.clone(),
        several => format!("{} tests", several.len()),
    };
    match section.tests.as_slice() {
        [pair] => vec![("Before", said(&pair.before)), ("After", said(&pair.after))],
        several => vec![("Pairs", several.len().to_string())],
    }
}

/// Returns the sections on a series of tests, and on what changed.
fn comparison_sections<'a>(document: &Document) -> Vec<Section<'a>> {
    let mut sections = Vec::new();
    if document.series.is_some() {
        sections.push(Section {
            id: "series",
            title: "Tests in the order of time",
            tables: found([tables::control_charts(document)]),
            folded: found([tables::tests_of_series(document)]),
            ..Section::default()
        });
    }
    if document.compare.is_some() {
        let mut story = Vec::new();
        if let Some(section) = &document.series {
            story.extend(series::compared(section));
            story.extend(comparison::answer(document));
        }
        sections.push(Section {
            id: "compare",
            title: "What changed",
            story,
            tables: found([
                tables::changes(document),
                tables::changed_modes(document),
                tables::changed_joint(document),
                tables::changed_dampings(document),
            ]),
            folded: match document.series {
                Some(_) => Vec::new(),
                None => found([tables::compared_tests(document)]),
            },
            ..Section::default()
        });
    }
    sections
}

/// Returns the sections on the joint, the gap and the uncertainty, as far as they were asked for.
fn model_sections<'a>(document: &Document) -> Vec<Section<'a>> {
    let mut sections = Vec::new();
    if document.estimate.is_some() || document.prediction.is_some() {
        sections.push(Section {
            id: "joint",
            title: match document.has_joint() {
                true => "The joint",
                false => "The beam",
            },
            missing: match no_estimate(document) {
                Some(words) => capital(&words) + ".",
                None => "No estimate was asked for.".to_owned(),
            },
            tables: found([
                tables::parameters(document),
                tables::budget(document),
                tables::correlations(document),
                tables::methods(document),
                tables::prediction(document),
                tables::lengths(document),
                tables::free_test(document),
                tables::pairs(document),
            ]),
            ..Section::default()
        });
    }
    if document.gap.is_some() {
        sections.push(Section {
            id: "gap",
            title: "What the model still misses",
            story: gap_story(document),
            tables: found([tables::hypotheses(document), tables::next_tests(document)]),
            ..Section::default()
        });
    }
    sections.push(Section {
        id: "uncertainty",
        title: "How sure is the stiffness",
        tables: found([
            tables::spans(document),
            tables::sensitivity(document),
            tables::perturbation(document),
            tables::averages(document),
            tables::monte_carlo(document),
        ]),
        ..Section::default()
    });
    sections
}

/// Returns the sections on modes, quality and recordings, as far as there are any.
fn measurement_sections<'a>(document: &Document) -> Vec<Section<'a>> {
    let mut sections = vec![Section {
        id: "modes",
        title: match (&document.recordings, &document.test) {
            (None, _) => "Modes",
            (_, Some(test)) if test.kind.is_some() => "Modes and spectra",
            _ => "Resonances and spectra",
        },
        missing: "No resonances were found.".to_owned(),
        tables: found([tables::modes(document)]),
        folded: found([
            tables::mode_details(document),
            tables::readings(document),
            tables::reading_details(document),
        ]),
        ..Section::default()
    }];
    if let Some(count) = tables::quality_count(document) {
        let mut tables = found([tables::quality_doubts(document), tables::quality(document)]);
        if let Some(last) = tables.last_mut() {
            last.note = format!("{} All {count}.", last.note);
        }
        sections.push(Section {
            id: "quality",
            title: "How well it was measured",
            tables,
            folded: found([tables::quality_all(document)]),
            ..Section::default()
        });
    }
    if document.recordings.is_some() {
        sections.push(Section {
            id: "recordings",
            title: "Recordings and taps",
            missing: "There is no recording.".to_owned(),
            tables: found([
                tables::recordings(document),
                tables::conditions(document),
                tables::channels(document),
                tables::taps(document),
                tables::hammer(document),
            ]),
            ..Section::default()
        });
    }
    sections
}

fn found<const N: usize>(tables: [Option<Table>; N]) -> Vec<Table> {
    tables.into_iter().flatten().collect()
}

impl Section<'_> {
    /// Returns its tables, each with true where it is folded; those that open on demand last.
    fn all_tables(&self) -> Vec<(&Table, bool)> {
        let open = self.tables.iter().map(|table| (table, false));
        let folded = self.folded.iter().map(|table| (table, true));
        open.chain(folded).collect()
    }

    /// True where there is nothing to show but the reason why.
    fn is_empty(&self) -> bool {
        self.tables.is_empty() && self.figures.is_empty() && self.story.is_empty()
    }
}
