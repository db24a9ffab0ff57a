//! Printed tables, and their numbers beside ours.

use tapjoint_beam::StructureError;
use tapjoint_identify::perturbation::{Span, sign_pattern_spans};
use tapjoint_identify::{
    IdentifyError, ModeLambda, PairsEstimate, PairsModel, Stiffnesses, estimate_pairs,
};

/// Reasons for which the tables cannot be compared. All would be defects of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PublicationError {
    /// A printed number that is none.
    #[error("\"{text}\" in the printed tables is not a number")]
    Number {
        /// The text.
        text: String,
    },
    /// A cell that is not there.
    #[error("the printed tables have no {column} in row {row}")]
    Cell {
        /// Row, from 0.
        row: usize,
        /// Name of the column.
        column: String,
    },
    /// An estimate without answer.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A prediction without answer.
    #[error(transparent)]
    Structure(#[from] StructureError),
}

/// Agreement of a printed number with ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Agreement {
    /// Equal within the row's tolerance.
    Reproduces,
    /// Different, within the effect that rounding of the printed input has on our number.
    WithinRounding,
    /// Different; the remark says why.
    DoesNotReproduce,
    /// A measurement or a property of the specimen: there is nothing to reproduce.
    Given,
}

/// One printed number beside ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Meaning of the number.
    pub label: String,
    /// As printed.
    pub printed: Printed,
    /// Ours; `None` where there is nothing to compute.
    pub ours: Option<f64>,
    /// Largest difference that still counts as equal, in the unit of the numbers.
    pub tolerance: f64,
    /// Agreement of the two.
    pub verdict: Agreement,
    /// Reason of a difference, or another remark.
    pub remark: Option<&'static str>,
}

impl Row {
    /// A row that reproduces within one unit in the last printed digit.
    pub(super) fn to_last_digit(
        label: String,
        printed: Printed,
        ours: impl Into<Option<f64>>,
    ) -> Self {
        // A millionth of a unit allows for the binary fraction that stands for the printed one.
        let tolerance = printed.unit * (1.0 + 1e-6);
        Self::within(label, printed, ours, tolerance)
    }

    /// A row that reproduces within `tolerance`; an answer that is missing does not.
    pub(super) fn within(
        label: String,
        printed: Printed,
        ours: impl Into<Option<f64>>,
        tolerance: f64,
    ) -> Self {
        let ours = ours.into();
        let equal = ours.is_some_and(|ours: f64| (ours - printed.value).abs() <= tolerance);
        Self {
            label,
            printed,
            ours,
            tolerance,
            verdict: if equal {
                Agreement::Reproduces
            } else {
                Agreement::DoesNotReproduce
            },
            remark: None,
        }
    }

    /// A row that reproduces within a share (1) of its number.
    pub(super) fn near(label: String, printed: Printed, ours: Option<f64>, share: f64) -> Self {
        let tolerance = share * printed.value;
        Self::within(label, printed, ours, tolerance)
    }

    /// A row with nothing to compute.
    pub(super) fn given(label: String, printed: Printed) -> Self {
        Self {
            label,
            printed,
            ours: None,
            tolerance: 0.0,
            verdict: Agreement::Given,
            remark: None,
        }
    }

    /// Takes a row that differs as explained by the rounding of its input, if the printed number
    /// lies in this span of what that rounding makes of ours.
    pub(super) fn or_within(self, span: Option<Span>) -> Self {
        let value = self.printed.value;
        // Half a unit on either side: the printed number is rounded too.
        let half = 0.5 * self.printed.unit;
        self.or_if(span.is_some_and(|s| s.low - half <= value && value <= s.high + half))
    }

    /// Notes a Kz that does not lie within its span, by way of its reciprocal: see [`Self::or_within`].
    pub(super) fn or_reciprocal_within(self, span: Option<Span>) -> Self {
        let compliance = 1.0 / self.printed.value;
        self.or_if(span.is_some_and(|s| s.low <= compliance && compliance <= s.high))
    }

    fn or_if(mut self, is_explained: bool) -> Self {
        if self.verdict == Agreement::DoesNotReproduce && is_explained {
            self.verdict = Agreement::WithinRounding;
        }
        self
    }

    /// Adds the remark where the row does not reproduce.
    pub(super) fn or_because(mut self, remark: &'static str) -> Self {
        if self.verdict == Agreement::DoesNotReproduce {
            self.remark = Some(remark);
        }
        self
    }

    /// Adds the remark in any case.
    pub(super) fn noting(mut self, remark: &'static str) -> Self {
        self.remark = Some(remark);
        self
    }

    /// 100 (ours - printed)/printed (%), where both exist.
    pub fn difference_percent(&self) -> Option<f64> {
        let ours = self.ours?;
        let percent = 100.0 * (ours - self.printed.value) / self.printed.value;
        percent.is_finite().then_some(percent)
    }
}

/// One table of the paper.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Table {
    /// Its number, "1a".
    pub number: &'static str,
    /// Its content.
    pub title: &'static str,
    /// Its numbers.
    pub rows: Vec<Row>,
}

/// All tables.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Reproduction {
    /// In the order of the paper.
    pub tables: Vec<Table>,
}

impl Reproduction {
    /// Counts the rows that have this verdict.
    pub fn count(&self, verdict: Agreement) -> usize {
        let rows = self.tables.iter().flat_map(|table| &table.rows);
        rows.filter(|row| row.verdict == verdict).count()
    }

    /// The table of that number.
    pub fn table(&self, number: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.number == number)
    }
}

/// Label of a joint, "Kx 500, Ky 100".
pub(super) fn joint_label(kx: &Printed, ky: &Printed) -> String {
    format!("Kx {}, Ky {}", kx.text, ky.text)
}

/// An estimate from printed lambdas, with the spans over the rounding of their last digit. 1/Kz has a span and Kz
/// has none, because Kz may pass through infinity.
pub(super) fn estimate_from_printed(
    model: PairsModel,
    lambdas: &[Printed],
) -> Result<(PairsEstimate, Spans), PublicationError> {
    let values: Vec<f64> = lambdas.iter().map(|lambda| lambda.value).collect();
    let halves: Vec<f64> = lambdas.iter().map(|lambda| 0.5 * lambda.unit).collect();
    let estimate = estimate_pairs(model, &ModeLambda::numbered(&values))?;
    let direct = sign_pattern_spans(&values, &halves, 1, |values| stiffnesses(model, values))?;
    // Through the slot of Kx, which may change its sign without harm.
    let reciprocal = sign_pattern_spans(&values, &halves, 1, |values| {
        let found = stiffnesses(model, values)?;
        Some(Stiffnesses {
            kx: found.kz?.recip(),
            ..found
        })
    })?;
    let spans = Spans {
        kx: direct.kx,
        ky: direct.ky,
        cross_compliance: reciprocal.kx,
    };
    Ok((estimate, spans))
}

/// The stiffnesses estimated from these lambdas of modes 1, 2, ...
fn stiffnesses(model: PairsModel, lambdas: &[f64]) -> Option<Stiffnesses> {
    let found = estimate_pairs(model, &ModeLambda::numbered(lambdas)).ok()?;
    found.stiffnesses()
}

/// Spans of an estimate.
pub(super) struct Spans {
    /// Span of Kx (1).
    pub kx: Option<Span>,
    /// Span of Ky (1).
    pub ky: Option<Span>,
    /// Span of 1/Kz (1).
    pub cross_compliance: Option<Span>,
}

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
    /// [`PublicationError::Number`] for any other text.
    pub fn parse(text: &str) -> Result<Self, PublicationError> {
        let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let decimals = mantissa
            .split_once('.')
            .map_or(0, |(_, digits)| digits.len() as i32);
        let (Ok(value), Ok(exponent)) = (text.parse::<f64>(), exponent.parse::<i32>()) else {
            return Err(PublicationError::Number {
                text: text.to_owned(),
            });
        };
        Ok(Self {
            text: text.to_owned(),
            value,
            unit: 10f64.powi(exponent - decimals),
        })
    }

    /// Another value with one digit more than this number was printed with.
    pub fn format_like(&self, value: f64) -> String {
        if self.text.contains(['e', 'E']) || value.abs() >= 1e7 {
            return format!("{value:.3e}");
        }
        let decimals = self
            .text
            .split_once('.')
            .map_or(0, |(_, digits)| digits.len());
        format!("{value:.*}", decimals + 1)
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

    pub(super) fn text(&self, row: usize, column: &str) -> Result<&'static str, PublicationError> {
        let place = self.header.iter().position(|&name| name == column);
        place
            .and_then(|place| self.rows.get(row)?.get(place).copied())
            .ok_or_else(|| PublicationError::Cell {
                row,
                column: column.to_owned(),
            })
    }

    pub(super) fn number(&self, row: usize, column: &str) -> Result<Printed, PublicationError> {
        Printed::parse(self.text(row, column)?)
    }

    pub(super) fn value(&self, row: usize, column: &str) -> Result<f64, PublicationError> {
        Ok(self.number(row, column)?.value)
    }

    /// A whole column.
    pub(super) fn column(&self, column: &str) -> Result<Vec<Printed>, PublicationError> {
        (0..self.len())
            .map(|row| self.number(row, column))
            .collect()
    }

    /// lambda1 to lambda5 of one row.
    pub(super) fn lambdas(&self, row: usize) -> Result<Vec<Printed>, PublicationError> {
        (1..=5)
            .map(|mode| self.number(row, &format!("lambda{mode}")))
            .collect()
    }

    /// The number in column "printed" of the row whose first two cells are these.
    pub(super) fn named(&self, case: &str, quantity: &str) -> Result<Printed, PublicationError> {
        let found = self
            .rows
            .iter()
            .position(|cells| cells.first() == Some(&case) && cells.get(1) == Some(&quantity));
        match found {
            Some(row) => self.number(row, "printed"),
            None => Err(PublicationError::Cell {
                row: 0,
                column: format!("{case} {quantity}"),
            }),
        }
    }
}
