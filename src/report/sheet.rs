//! The sheet of a test: one page to be signed and filed.

use askama::Template;

use crate::ReportError;
use crate::document::{Document, InstrumentSection, SheetSection};
use crate::format::significant;
use crate::picture::InlineFigure;
use crate::words::answer::Answer;

/// Most files and instruments on the sheet; report.json has all.
const MOST_LISTED: usize = 6;
/// Longest name on it (characters).
const LONGEST_NAME: usize = 28;
/// Most doubts on it.
const MOST_DOUBTS: usize = 4;

/// The sheet on a page of its own.
#[derive(Template)]
#[template(path = "sheet.html")]
struct Page<'a> {
    title: &'a str,
    running: String,
    sheet: Sheet<'a>,
}

/// The sheet as it stands on a page.
#[derive(Template)]
#[template(path = "sheet_body.html")]
pub struct Sheet<'a> {
    section: &'a SheetSection,
    answer: &'a Answer,
    figure: Option<&'a InlineFigure>,
    version: &'static str,
}

impl<'a> Sheet<'a> {
    /// Returns the sheet of a document that has one with files; `None` of any other.
    pub fn of(
        document: &'a Document,
        answer: &'a Answer,
        figure: Option<&'a InlineFigure>,
    ) -> Option<Self> {
        let section = document.sheet.as_ref()?;
        (!section.files.is_empty()).then_some(Sheet {
            section,
            answer,
            figure,
            version: env!("CARGO_PKG_VERSION"),
        })
    }

    fn listed<T>(&self, all: &'a [T]) -> &'a [T] {
        &all[..all.len().min(MOST_LISTED)]
    }

    fn doubts(&self) -> &[&'static str] {
        &self.answer.doubts[..self.answer.doubts.len().min(MOST_DOUBTS)]
    }
}

impl InstrumentSection {
    /// "338 mm, 24 g"; empty where neither is known.
    fn place_and_mass(&self) -> String {
        let parts = [(self.position, "mm"), (self.mass, "g")];
        let parts = parts
            .into_iter()
            .filter_map(|(value, unit)| Some(format!("{} {unit}", significant(1e3 * value?, 4))));
        parts.collect::<Vec<_>>().join(", ")
    }
}

/// A name with its middle left out where it is longer than its place.
fn short(name: &str) -> String {
    let count = name.chars().count();
    if count <= LONGEST_NAME {
        return name.to_owned();
    }
    let half = LONGEST_NAME / 2;
    let begin: String = name.chars().take(half).collect();
    let end: String = name.chars().skip(count - half).collect();
    format!("{begin}\u{2026}{end}")
}

/// Returns the sheet as a page; `None` where none was asked for.
///
/// # Errors
/// [`ReportError::Html`] if the template cannot be filled.
pub fn render_sheet(
    document: &Document,
    figures: &[InlineFigure],
) -> Result<Option<String>, ReportError> {
    let answer = Answer::of(document);
    let figure = figures.iter().find(|figure| figure.section == "answer");
    let Some(sheet) = Sheet::of(document, &answer, figure) else {
        return Ok(None);
    };
    let page = Page {
        title: &answer.name,
        running: running_head(document, &answer.name),
        sheet,
    };
    page.render().map(Some).map_err(ReportError::Html)
}

/// Returns name, number and date for the foot of every printed page, as a string of a style sheet.
pub fn running_head(document: &Document, name: &str) -> String {
    let sheet = document.sheet.as_ref();
    let number = sheet.and_then(|sheet| sheet.texts.number.as_deref());
    let date = sheet.and_then(|sheet| sheet.texts.date.as_deref());
    let name = short(name);
    let parts = [Some(name.as_str()), number, date].into_iter().flatten();
    let text = parts.collect::<Vec<_>>().join(" \u{b7} ");
    // Whatever could end the string, or the style, is written as a code.
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '"' | '\\' | '<' | '>' | '&' => {
                escaped.push_str(&format!("\\{:x} ", u32::from(character)))
            }
            character if character.is_control() => escaped.push(' '),
            character => escaped.push(character),
        }
    }
    escaped
}
