//! What errors in the frequencies do to the estimate, in the document. An infinite stiffness, of a rigid joint, is
//! null in JSON and infinity in the tables.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Document, Method, ValueSection};
use tapjoint_analysis::{BoundPerturbation, Perturbation};
use tapjoint_identify::perturbation::Span;
use tapjoint_identify::{Spread, Stiffnesses};

/// An estimate from frequencies changed by the same percentage.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct PerturbationSection {
    /// Change of all frequencies (%), signed.
    pub percent: f64,
    /// "pairs" or "consistent".
    pub method: Method,
    /// Kx.
    pub kx: Option<f64>,
    /// Ky.
    pub ky: Option<f64>,
    /// Kz.
    pub kz: Option<f64>,
}

/// Average errors of +percent and -percent: the mean of their magnitudes, as in table 9 of Ingole &
/// Chatterjee, and the error of their mean, as in table 14.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct AverageSection {
    /// "pairs" or "consistent".
    pub method: Method,
    /// Change of all frequencies (%), its size.
    pub percent: f64,
    /// Of Kx (%).
    pub kx_percent: Option<f64>,
    /// Of Ky (%).
    pub ky_percent: Option<f64>,
    /// Of Kz (%).
    pub kz_percent: Option<f64>,
    /// Magnitude of the error of the two estimates' mean (%), as in table 14: smaller, because
    /// opposite errors cancel. Of Kx.
    pub kx_of_mean_percent: Option<f64>,
    /// The same of Ky (%).
    pub ky_of_mean_percent: Option<f64>,
    /// The same of Kz (%).
    pub kz_of_mean_percent: Option<f64>,
}

/// Estimates under random errors of the frequencies: median and 95 % interval.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct MonteCarloSection {
    /// "pairs" or "consistent".
    pub method: Method,
    /// Repetitions.
    pub samples: usize,
    /// How many of them had no estimate.
    pub failed: usize,
    /// Kx.
    pub kx: Option<ValueSection>,
    /// Ky.
    pub ky: Option<ValueSection>,
    /// Kz.
    pub kz: Option<ValueSection>,
    /// The first repetitions' estimates, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
}

/// What the resolution of the readings does to the estimate.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct ResolutionSpanSection {
    /// "pairs" or "consistent".
    pub method: Method,
    /// Number of sign patterns tried.
    pub patterns: usize,
    /// Patterns that left no estimate.
    pub failed: usize,
    /// Smallest and largest Kx.
    pub kx: Option<[f64; 2]>,
    /// Smallest and largest Ky.
    pub ky: Option<[f64; 2]>,
    /// Smallest and largest Kz.
    pub kz: Option<[f64; 2]>,
    /// All estimates over the patterns, for a picture: (Kx, Ky).
    #[serde(skip)]
    pub cloud: Vec<[f64; 2]>,
    /// Change of each parameter (%) when one mode moves by its own bound.
    pub sensitivity: Vec<SensitivitySection>,
}

/// What one mode's bound does.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct SensitivitySection {
    /// Mode number.
    pub mode: usize,
    /// The bound (Hz).
    pub half_line: f64,
    /// Change of Kx (%).
    pub kx_percent: Option<f64>,
    /// Change of Ky (%).
    pub ky_percent: Option<f64>,
    /// Change of Kz (%).
    pub kz_percent: Option<f64>,
    /// Change of Kx (%) per change of this frequency (%), for small changes.
    pub kx_percent_per_percent: Option<f64>,
    /// The same of Ky.
    pub ky_percent_per_percent: Option<f64>,
    /// The same of Kz.
    pub kz_percent_per_percent: Option<f64>,
}

impl Document {
    /// Adds what the perturbations of all methods say.
    pub(super) fn add_perturbations(&mut self, found: &[Perturbation]) {
        if found.is_empty() {
            return;
        }
        let (mut uniform, mut averages) = (Vec::new(), Vec::new());
        let (mut random, mut spans) = (Vec::new(), Vec::new());
        for perturbation in found {
            let method = Method::from(perturbation.method);
            uniform.extend(perturbation.uniform.iter().map(|row| PerturbationSection {
                percent: row.percent,
                method,
                kx: row.estimate.map(|estimate| estimate.kx),
                ky: row.estimate.map(|estimate| estimate.ky),
                kz: row.estimate.and_then(|estimate| estimate.kz),
            }));
            averages.extend(perturbation.averages.iter().map(|row| AverageSection {
                method,
                percent: row.percent,
                kx_percent: finite(row.mean_magnitude.kx),
                ky_percent: finite(row.mean_magnitude.ky),
                kz_percent: row.mean_magnitude.kz.and_then(finite),
                kx_of_mean_percent: finite(row.of_mean.kx),
                ky_of_mean_percent: finite(row.of_mean.ky),
                kz_of_mean_percent: row.of_mean.kz.and_then(finite),
            }));
            random.extend(perturbation.random.as_ref().map(|found| MonteCarloSection {
                method,
                samples: found.samples,
                failed: found.failed,
                kx: found.kx.map(ValueSection::from),
                ky: found.ky.map(ValueSection::from),
                kz: found.kz.map(ValueSection::from),
                cloud: cloud(&found.cloud),
            }));
            let bounds = perturbation.bounds.as_ref();
            spans.extend(bounds.map(|found| ResolutionSpanSection::of(found, method)));
        }
        self.perturbation = Some(uniform);
        self.perturbation_averages = Some(averages);
        self.monte_carlo = (!random.is_empty()).then_some(random);
        self.resolution_span = (!spans.is_empty()).then_some(spans);
    }
}

/// A stiffness that is rigid or held has no relative change.
fn finite(percent: f64) -> Option<f64> {
    Some(percent).filter(|percent| percent.is_finite())
}

impl From<Spread> for ValueSection {
    fn from(spread: Spread) -> Self {
        ValueSection {
            value: spread.median,
            low: finite(spread.low),
            high: finite(spread.high),
            ..ValueSection::default()
        }
    }
}

fn cloud(estimates: &[Stiffnesses]) -> Vec<[f64; 2]> {
    let place = |estimate: &Stiffnesses| [estimate.kx, estimate.ky];
    estimates.iter().map(place).collect()
}

impl ResolutionSpanSection {
    fn of(found: &BoundPerturbation, method: Method) -> Self {
        let ends = |span: Option<Span>| span.map(|span| [span.low, span.high]);
        let spans = found.spans.as_ref();
        ResolutionSpanSection {
            method,
            patterns: spans.map_or(0, |spans| spans.patterns),
            failed: spans.map_or(0, |spans| spans.failed),
            kx: ends(spans.and_then(|spans| spans.kx)),
            ky: ends(spans.and_then(|spans| spans.ky)),
            kz: ends(spans.and_then(|spans| spans.kz)),
            cloud: cloud(&found.cloud),
            sensitivity: sensitivities(found),
        }
    }
}

fn sensitivities(found: &BoundPerturbation) -> Vec<SensitivitySection> {
    let rows = found.sensitivities.iter().map(|row| {
        let change = row.percent_per_bound;
        let slope = row.percent_per_percent;
        SensitivitySection {
            mode: found.modes.get(row.index).copied().unwrap_or(0),
            half_line: found.bounds.get(row.index).copied().unwrap_or(0.0),
            kx_percent: change.map(|change| change.kx),
            ky_percent: change.map(|change| change.ky),
            kz_percent: change.and_then(|change| change.kz),
            kx_percent_per_percent: slope.map(|slope| slope.kx),
            ky_percent_per_percent: slope.map(|slope| slope.ky),
            kz_percent_per_percent: slope.and_then(|slope| slope.kz),
        }
    });
    rows.collect()
}
