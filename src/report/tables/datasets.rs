//! The table of a universal file's datasets.

use super::super::document::{DatasetSection, Document};
use super::super::format::{MISSING, trimmed};
use super::{Table, number, words};

/// One row for each dataset; `None` without any.
pub fn datasets(document: &Document) -> Option<Table> {
    let datasets = document.datasets.as_deref().filter(|d| !d.is_empty())?;
    let first = datasets.first().map(|dataset| &dataset.file);
    let several = datasets.iter().any(|dataset| Some(&dataset.file) != first);
    let rows = datasets.iter().map(|dataset| row(dataset, several));
    let table = Table {
        caption: "Datasets".to_owned(),
        columns: vec![
            words("File"),
            number("Number"),
            words("Kind"),
            number("Points"),
            number("Step"),
            words("Response"),
            words("Reference"),
            words("Unit"),
            words("Values").on_page(),
            words("Stored as").on_page(),
            words("Description").on_page(),
        ],
        rows: rows.collect(),
        note: "As the headers say; values were not read.".to_owned(),
    };
    Some(table.without_empty_columns())
}

fn row(dataset: &DatasetSection, several: bool) -> Vec<String> {
    let words = |text: &Option<String>| text.clone().unwrap_or_else(|| MISSING.to_owned());
    let step = match (dataset.spacing, &dataset.spacing_unit) {
        (Some(step), Some(unit)) => format!("{} {unit}", trimmed(step, 6)),
        (Some(step), None) => trimmed(step, 6),
        (None, _) if dataset.points.is_some() => "uneven".to_owned(),
        (None, _) => MISSING.to_owned(),
    };
    let unit = match (&dataset.unit, &dataset.denominator_unit) {
        (Some(above), Some(below)) => format!("({above})/({below})"),
        (above, _) => words(above),
    };
    vec![
        if several {
            dataset.file.clone()
        } else {
            String::new()
        },
        dataset.dataset.to_string(),
        dataset.kind.clone(),
        dataset
            .points
            .map_or(MISSING.to_owned(), |points| points.to_string()),
        step,
        words(&dataset.response),
        words(&dataset.reference),
        unit,
        words(&dataset.values),
        words(&dataset.coding),
        words(&dataset.description),
    ]
}
