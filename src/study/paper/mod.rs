//! Every table of Ingole & Chatterjee beside our numbers, and why some cannot be had again.
//!
//! The printed digits are in `tests/validation/tables`, as printed. Each row carries a verdict;
//! a row that does not reproduce carries a remark that says why, as far as it can be told.

mod cantilever_measured;
mod cantilever_simulated;
mod lap;
mod printed;
mod text;

pub use printed::Printed;
pub use text::render;

use tapjoint_beam::StructureError;
use tapjoint_identify::perturbation::{Span, sign_pattern_spans};
use tapjoint_identify::{
    IdentifyError, ModeLambda, PairsEstimate, PairsModel, Stiffnesses, estimate_pairs,
};

/// Why the tables cannot be set beside ours. Both would be defects of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PaperError {
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

/// How a printed number compares with ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Equal within the row's tolerance.
    Reproduces,
    /// Different, but not beyond what the rounding of the printed input does to our number.
    WithinRounding,
    /// Different; the remark says why.
    DoesNotReproduce,
    /// A measurement or a property of the specimen: there is nothing to reproduce.
    Given,
}

/// One printed number beside ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// What the number is.
    pub label: String,
    /// As printed.
    pub printed: Printed,
    /// Ours; `None` where there is nothing to compute.
    pub ours: Option<f64>,
    /// Largest difference that still counts as equal, in the unit of the numbers.
    pub tolerance: f64,
    /// How they compare.
    pub verdict: Verdict,
    /// Why they differ, or what else is to be said.
    pub remark: Option<&'static str>,
}

impl Row {
    /// A row that reproduces within one unit in the last printed digit.
    fn to_last_digit(label: String, printed: Printed, ours: f64) -> Self {
        // A millionth of a unit allows for the binary fraction that stands for the printed one.
        let tolerance = printed.unit * (1.0 + 1e-6);
        Self::within(label, printed, ours, tolerance)
    }

    /// A row that reproduces within `tolerance`.
    fn within(label: String, printed: Printed, ours: f64, tolerance: f64) -> Self {
        let equal = (ours - printed.value).abs() <= tolerance;
        Self {
            label,
            printed,
            ours: Some(ours),
            tolerance,
            verdict: if equal {
                Verdict::Reproduces
            } else {
                Verdict::DoesNotReproduce
            },
            remark: None,
        }
    }

    /// The same row judged by the digits of another printed form of its number.
    fn judged_by(self, printed: &Printed) -> Self {
        let ours = self.ours.unwrap_or(f64::NAN);
        let judged = Self::to_last_digit(String::new(), printed.clone(), ours);
        Self {
            tolerance: judged.tolerance,
            verdict: judged.verdict,
            ..self
        }
    }

    /// A row with nothing to compute.
    fn given(label: String, printed: Printed) -> Self {
        Self {
            label,
            printed,
            ours: None,
            tolerance: 0.0,
            verdict: Verdict::Given,
            remark: None,
        }
    }

    /// Takes a row that differs as explained by the rounding of its input, if the printed number
    /// lies in this span of what that rounding makes of ours.
    fn or_within(mut self, span: Option<Span>) -> Self {
        let inside = |span: Span| {
            let value = self.printed.value;
            // Half a unit on either side: the printed number is rounded too.
            let half = 0.5 * self.printed.unit;
            span.low - half <= value && value <= span.high + half
        };
        if self.verdict == Verdict::DoesNotReproduce && span.is_some_and(inside) {
            self.verdict = Verdict::WithinRounding;
        }
        self
    }

    /// The same for Kz, by way of its reciprocal.
    fn or_reciprocal_within(mut self, span: Option<Span>) -> Self {
        let compliance = 1.0 / self.printed.value;
        let inside = |span: Span| span.low <= compliance && compliance <= span.high;
        if self.verdict == Verdict::DoesNotReproduce && span.is_some_and(inside) {
            self.verdict = Verdict::WithinRounding;
        }
        self
    }

    /// Adds the remark where the row does not reproduce.
    fn or_because(mut self, remark: &'static str) -> Self {
        if self.verdict == Verdict::DoesNotReproduce {
            self.remark = Some(remark);
        }
        self
    }

    /// Adds the remark in any case.
    fn noting(mut self, remark: &'static str) -> Self {
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
    /// What it holds.
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
    /// How many rows have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        let rows = self.tables.iter().flat_map(|table| &table.rows);
        rows.filter(|row| row.verdict == verdict).count()
    }

    /// The table of that number.
    pub fn table(&self, number: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.number == number)
    }
}

/// Computes every table of the paper and sets it beside the printed one.
///
/// # Errors
/// [`PaperError`]; none for the tables as they are.
pub fn reproduce() -> Result<Reproduction, PaperError> {
    let mut tables = cantilever_simulated::tables()?;
    tables.extend(cantilever_measured::tables()?);
    tables.extend(lap::tables()?);
    Ok(Reproduction { tables })
}

/// Label of a joint, "Kx 500, Ky 100".
fn joint_label(kx: &Printed, ky: &Printed) -> String {
    format!("Kx {}, Ky {}", kx.text, ky.text)
}

/// An estimate from printed lambdas, with the spans over the rounding of their last digit. The
/// span of "kz" is that of 1/Kz, which does not pass through infinity.
fn estimate_from_printed(
    model: PairsModel,
    lambdas: &[Printed],
) -> Result<(PairsEstimate, Spans), PaperError> {
    let values: Vec<f64> = lambdas.iter().map(|lambda| lambda.value).collect();
    let halves: Vec<f64> = lambdas.iter().map(|lambda| 0.5 * lambda.unit).collect();
    let estimate = estimate_pairs(model, &ModeLambda::numbered(&values))?;
    let at = |values: &[f64]| {
        let found = estimate_pairs(model, &ModeLambda::numbered(values)).ok()?;
        found.stiffnesses()
    };
    let direct = sign_pattern_spans(&values, &halves, at)?;
    // Through the slot of Kx, which may change its sign without harm.
    let reciprocal = sign_pattern_spans(&values, &halves, |values| {
        let found = at(values)?;
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

/// Spans of an estimate.
struct Spans {
    kx: Option<Span>,
    ky: Option<Span>,
    cross_compliance: Option<Span>,
}
