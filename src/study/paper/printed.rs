//! Numbers as printed: their text, their value, and what one unit in the last digit is worth.

use super::PaperError;

/// A printed number.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Printed {
    /// As printed, "1.8066" or "-8.11e5".
    pub text: String,
    /// Its value.
    pub value: f64,
    /// One unit in the last printed digit.
    pub unit: f64,
}

impl Printed {
    /// Reads a decimal number with an optional exponent.
    ///
    /// # Errors
    /// [`PaperError::Number`] for any other text.
    pub fn parse(text: &str) -> Result<Self, PaperError> {
        let wrong = || PaperError::Number {
            text: text.to_owned(),
        };
        let value: f64 = text.parse().map_err(|_| wrong())?;
        let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let exponent: i32 = exponent.parse().map_err(|_| wrong())?;
        let decimals = mantissa
            .split_once('.')
            .map_or(0, |(_, digits)| digits.len());
        let decimals = i32::try_from(decimals).map_err(|_| wrong())?;
        Ok(Self {
            text: text.to_owned(),
            value,
            unit: 10f64.powi(exponent - decimals),
        })
    }

    /// Another value with one digit more than this number was printed with.
    pub fn format_like(&self, value: f64) -> String {
        if self.text.contains(['e', 'E']) {
            return format!("{value:.3e}");
        }
        let decimals = self
            .text
            .split_once('.')
            .map_or(0, |(_, digits)| digits.len());
        let large = value.abs() >= 1e7;
        if large {
            format!("{value:.3e}")
        } else {
            format!("{value:.*}", decimals + 1)
        }
    }
}

/// A printed table: comma-separated text with a header line.
pub(super) struct PrintedTable {
    header: Vec<&'static str>,
    rows: Vec<Vec<&'static str>>,
}

impl PrintedTable {
    pub(super) fn new(text: &'static str) -> Self {
        let mut lines = text
            .lines()
            .map(|line| line.split(',').map(str::trim).collect::<Vec<_>>());
        Self {
            header: lines.next().unwrap_or_default(),
            rows: lines.collect(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn text(&self, row: usize, column: &str) -> Result<&'static str, PaperError> {
        let place = self.header.iter().position(|&name| name == column);
        place
            .and_then(|place| self.rows.get(row)?.get(place).copied())
            .ok_or_else(|| PaperError::Cell {
                row,
                column: column.to_owned(),
            })
    }

    pub(super) fn number(&self, row: usize, column: &str) -> Result<Printed, PaperError> {
        Printed::parse(self.text(row, column)?)
    }

    pub(super) fn value(&self, row: usize, column: &str) -> Result<f64, PaperError> {
        Ok(self.number(row, column)?.value)
    }

    /// A whole column.
    pub(super) fn column(&self, column: &str) -> Result<Vec<Printed>, PaperError> {
        (0..self.len())
            .map(|row| self.number(row, column))
            .collect()
    }

    /// lambda1 to lambda5 of one row.
    pub(super) fn lambdas(&self, row: usize) -> Result<Vec<Printed>, PaperError> {
        (1..=5)
            .map(|mode| self.number(row, &format!("lambda{mode}")))
            .collect()
    }

    /// The number in column "printed" of the row whose first two cells are these.
    pub(super) fn named(&self, case: &str, quantity: &str) -> Result<Printed, PaperError> {
        let found = self
            .rows
            .iter()
            .position(|cells| cells.first() == Some(&case) && cells.get(1) == Some(&quantity));
        match found {
            Some(row) => self.number(row, "printed"),
            None => Err(PaperError::Cell {
                row: 0,
                column: format!("{case} {quantity}"),
            }),
        }
    }
}
