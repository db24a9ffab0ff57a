//! `[measured]`: natural frequencies that were read elsewhere.

use super::MeasuredFrequencies;
use super::error::{DescriptionError, DescriptionProblem, DescriptionWarning, Doubt};
use super::limits::Limits;
use super::reader::{Entry, Table};
use std::ops::Bound;
use tapjoint_numerics::quantity::Dimension;

const FREQUENCY: Limits =
    Limits::positive(1e9, "natural frequencies in Hz, rigid-body modes left out");
const HALF_LINE: Limits = Limits::positive(
    1e9,
    "half the line spacing in Hz; leave it out when the resolution is unknown",
);
const STD: Limits = Limits::positive(1e9, "one standard deviation in Hz");
const SCATTER: Limits = Limits {
    low: Bound::Excluded(0.0),
    high: Bound::Excluded(1.0),
    remedy: "give the repeatability as a share of the frequency: \"0.3 %\"",
};
/// Beam theory has nothing to say about higher modes than this.
const MODE: Limits = Limits::between(
    1.0,
    1000.0,
    "modes count from 1; rigid-body modes do not count",
);
/// Repeated tests that scatter by more than this are not repeated tests.
const LARGE_SCATTER: f64 = 0.1;

/// Reads `[measured]`.
pub(super) fn read_measured(
    table: &Table<'_>,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<MeasuredFrequencies, DescriptionError> {
    let entry = table.need(
        "frequencies",
        "a list of frequencies (Hz)",
        "frequencies = [17, 118]",
    )?;
    let frequencies = read_frequencies(&entry)?;
    let count = frequencies.len();
    if let Some(entry) = table
        .get("std")
        .filter(|_| table.get("half_line").is_some())
    {
        return Err(entry.error(DescriptionProblem::Conflict {
            reason: "`half_line` and `std` both state the reading's uncertainty".into(),
            remedy: "keep the one you know; a repeatability beside it goes into `scatter`",
        }));
    }
    let modes = table.optional("modes", |entry| read_modes(entry, count))?;
    Ok(MeasuredFrequencies {
        frequencies,
        modes: modes.unwrap_or_else(|| (1..=count).collect()),
        half_line: table.optional("half_line", |entry| read_bounds(entry, &HALF_LINE, count))?,
        std: table.optional("std", |entry| read_bounds(entry, &STD, count))?,
        scatter: table.optional("scatter", |entry| read_scatter(entry, warnings))?,
    })
}

fn read_frequencies(entry: &Entry<'_>) -> Result<Vec<f64>, DescriptionError> {
    let items = entry.list("a list of frequencies such as [17, 118] (Hz)")?;
    if items.is_empty() {
        return Err(entry.error(DescriptionProblem::Count {
            found: 0,
            allowed: "at least 1".to_owned(),
            remedy: "list the natural frequencies in Hz, lowest first",
        }));
    }
    let read = |item: &Entry<'_>| item.within(Dimension::Frequency, &FREQUENCY);
    let frequencies = items.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    check_ascending(&items, &frequencies)?;
    Ok(frequencies)
}

fn read_modes(entry: &Entry<'_>, count: usize) -> Result<Vec<usize>, DescriptionError> {
    let items = entry.list("a list of mode numbers such as [1, 2, 4]")?;
    check_count(entry, items.len(), count)?;
    let modes = items
        .iter()
        .map(|item| item.count(&MODE))
        .collect::<Result<Vec<_>, _>>()?;
    let values: Vec<f64> = modes.iter().map(|mode| *mode as f64).collect();
    check_ascending(&items, &values)?;
    Ok(modes)
}

/// One number for all frequencies, or a list with one for each.
fn read_bounds(
    entry: &Entry<'_>,
    limits: &Limits,
    count: usize,
) -> Result<Vec<f64>, DescriptionError> {
    if !entry.is_list() {
        return Ok(vec![entry.within(Dimension::Frequency, limits)?; count]);
    }
    let items = entry.list("a number or a list of numbers (Hz)")?;
    check_count(entry, items.len(), count)?;
    items
        .iter()
        .map(|item| item.within(Dimension::Frequency, limits))
        .collect()
}

fn read_scatter(
    entry: &Entry<'_>,
    warnings: &mut Vec<DescriptionWarning>,
) -> Result<f64, DescriptionError> {
    let value = entry.within(Dimension::Ratio, &SCATTER)?;
    if value > LARGE_SCATTER {
        let usual = "0.0001 to 0.03".to_owned();
        let question = "did you mean percent? Write \"0.3 %\"";
        warnings.push(entry.warning(Doubt::Implausible {
            value,
            unit: "",
            usual,
            question,
        }));
    }
    Ok(value)
}

fn check_count(
    entry: &Entry<'_>,
    found: usize,
    frequencies: usize,
) -> Result<(), DescriptionError> {
    if found == frequencies {
        return Ok(());
    }
    Err(entry.error(DescriptionProblem::Count {
        found,
        allowed: format!("{frequencies}, one for each frequency"),
        remedy: "make both lists equally long",
    }))
}

fn check_ascending(items: &[Entry<'_>], values: &[f64]) -> Result<(), DescriptionError> {
    let pairs = values
        .iter()
        .zip(values.iter().skip(1))
        .zip(items.iter().skip(1))
        .enumerate();
    for (index, ((previous, value), item)) in pairs {
        if value <= previous {
            return Err(item.error(DescriptionProblem::NotAscending {
                position: index + 2,
                value: *value,
                previous: *previous,
            }));
        }
    }
    Ok(())
}
