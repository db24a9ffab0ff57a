//! The perturbation in the document. What is infinite, a joint that became rigid, is `null` in JSON and
//! kept as infinity for the tables.

use super::document::{
    AverageSection, Document, MonteCarloSection, PerturbationSection, ResolutionSpanSection,
    SensitivitySection, ValueSection,
};
use tapjoint_analysis::{BoundPerturbation, EstimateMethod, Perturbation};
use tapjoint_identify::perturbation::{AverageError, Span, UniformPerturbation};
use tapjoint_identify::{MonteCarlo, Spread, Stiffnesses};

/// The document with what the perturbations of all methods say.
pub(super) fn with_perturbations(document: Document, found: &[Perturbation]) -> Document {
    if found.is_empty() {
        return document;
    }
    let random = found.iter().filter_map(monte_carlo_section);
    let random: Vec<MonteCarloSection> = random.collect();
    let spans = found.iter().filter_map(|perturbation| {
        let bounds = perturbation.bounds.as_ref()?;
        Some(span_section(bounds, perturbation.method))
    });
    let spans: Vec<ResolutionSpanSection> = spans.collect();
    Document {
        perturbation: Some(found.iter().flat_map(uniform_sections).collect()),
        perturbation_averages: Some(found.iter().flat_map(average_sections).collect()),
        monte_carlo: (!random.is_empty()).then_some(random),
        resolution_span: (!spans.is_empty()).then_some(spans),
        ..document
    }
}

fn name(method: EstimateMethod) -> String {
    match method {
        EstimateMethod::Consistent => "consistent",
        EstimateMethod::Pairs => "pairs",
    }
    .to_owned()
}

fn uniform_sections(found: &Perturbation) -> Vec<PerturbationSection> {
    let section = |row: &UniformPerturbation| PerturbationSection {
        percent: row.percent,
        method: name(found.method),
        kx: row.estimate.map(|estimate| estimate.kx),
        ky: row.estimate.map(|estimate| estimate.ky),
        kz: row.estimate.and_then(|estimate| estimate.kz),
    };
    found.uniform.iter().map(section).collect()
}

fn average_sections(found: &Perturbation) -> Vec<AverageSection> {
    // A stiffness that is rigid or held has no relative change.
    let finite = |percent: f64| Some(percent).filter(|percent| percent.is_finite());
    let section = |row: &AverageError| AverageSection {
        method: name(found.method),
        percent: row.percent,
        kx_percent: finite(row.mean_magnitude.kx),
        ky_percent: finite(row.mean_magnitude.ky),
        kz_percent: row.mean_magnitude.kz.and_then(finite),
        kx_of_mean_percent: finite(row.of_mean.kx),
        ky_of_mean_percent: finite(row.of_mean.ky),
        kz_of_mean_percent: row.of_mean.kz.and_then(finite),
    };
    found.averages.iter().map(section).collect()
}

fn monte_carlo_section(perturbation: &Perturbation) -> Option<MonteCarloSection> {
    let found: &MonteCarlo = perturbation.random.as_ref()?;
    let ends = |spread: Option<Spread>| {
        spread.map(|spread| ValueSection {
            value: spread.median,
            low: Some(spread.low).filter(|low| low.is_finite()),
            high: Some(spread.high).filter(|high| high.is_finite()),
            ..ValueSection::default()
        })
    };
    Some(MonteCarloSection {
        method: name(perturbation.method),
        samples: found.samples,
        failed: found.failed,
        kx: ends(found.kx),
        ky: ends(found.ky),
        kz: ends(found.kz),
        cloud: cloud(&found.cloud),
    })
}

fn cloud(estimates: &[Stiffnesses]) -> Vec<[f64; 2]> {
    let place = |estimate: &Stiffnesses| [estimate.kx, estimate.ky];
    estimates.iter().map(place).collect()
}

fn span_section(found: &BoundPerturbation, method: EstimateMethod) -> ResolutionSpanSection {
    let ends = |span: Option<Span>| span.map(|span| [span.low, span.high]);
    let spans = found.spans.as_ref();
    ResolutionSpanSection {
        method: name(method),
        patterns: spans.map_or(0, |spans| spans.patterns),
        failed: spans.map_or(0, |spans| spans.failed),
        kx: ends(spans.and_then(|spans| spans.kx)),
        ky: ends(spans.and_then(|spans| spans.ky)),
        kz: ends(spans.and_then(|spans| spans.kz)),
        cloud: cloud(&found.cloud),
        sensitivity: sensitivities(found),
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
