//! The consistent estimate in the document.

use super::document::{
    BeamSection, CorrelationSection, EstimateSection, IdentifiabilitySection, MisfitSection,
    ValueSection,
};
use super::format::significant;
use tapjoint_beam::Beam;
use tapjoint_identify::consistent::{ConsistentEstimate, EstimatedQuantity, Limit, Quantity};
use tapjoint_numerics::stats::times;

/// The main estimate; what stands beside it is added by the caller.
pub(super) fn consistent_section(found: &ConsistentEstimate) -> EstimateSection {
    let value = |quantity: Quantity| found.quantity(quantity).and_then(value_section);
    // A property with a tolerance is fitted along, but nobody asked for it.
    let asked = |quantity: Quantity| value(quantity).filter(|_| is_asked(found, quantity));
    let goodness = &found.goodness;
    EstimateSection {
        method: "consistent".to_owned(),
        modes_used: found.modes_used.clone(),
        reason: goodness.uncertainty_factor().map(|factor| {
            format!(
                "the model misses the frequencies by {} % rms; uncertainties that would allow \
                     that are {} times the stated ones",
                significant(100.0 * goodness.relative_misfit, 2),
                times(factor)
            )
        }),
        kx: value(Quantity::Kx),
        ky: value(Quantity::Ky),
        kz: value(Quantity::Kz),
        coupling: value(Quantity::Coupling),
        kt: value(Quantity::Kt),
        kr: value(Quantity::Kr),
        ktr: value(Quantity::Ktr),
        modulus: asked(Quantity::Modulus),
        density: asked(Quantity::Density),
        correlations: found
            .correlations
            .iter()
            .map(|correlation| CorrelationSection {
                first: correlation.first.name().to_owned(),
                second: correlation.second.name().to_owned(),
                value: correlation.value,
            })
            .collect(),
        beam: Some(beam_section(&found.beam)),
        log_covariance: found.stiffness_covariance,
        goodness_of_fit: goodness.probability,
        misfit: Some(MisfitSection {
            chi_squared: goodness.chi_squared,
            degrees_of_freedom: goodness.degrees_of_freedom,
            rms_percent: 100.0 * goodness.relative_misfit,
            verdict: goodness.words(),
        }),
        identifiability: Some(identifiability(found)),
        ..EstimateSection::default()
    }
}

fn beam_section(beam: &Beam) -> BeamSection {
    BeamSection {
        length: beam.length,
        width: beam.width,
        thickness: beam.thickness,
        modulus: beam.modulus,
        density: beam.density,
    }
}

/// A rigid joint is infinite in the tables and null in JSON; a value at the edge of its range has no
/// standard deviation.
fn value_section(quantity: &EstimatedQuantity) -> Option<ValueSection> {
    let rigid = quantity.limit == Some(Limit::Rigid) || quantity.value.is_none();
    let spring = !matches!(
        quantity.quantity,
        Quantity::Coupling | Quantity::Kz | Quantity::Ktr
    );
    if quantity.value.is_none() && !spring {
        return None;
    }
    let rigid = rigid && spring;
    let scaled = quantity.scaled.filter(|_| !rigid);
    Some(ValueSection {
        value: quantity.value.filter(|_| !rigid).unwrap_or(f64::INFINITY),
        std: quantity.std.filter(|_| !rigid),
        low: quantity.low,
        high: quantity.high,
        std_scaled: quantity.std_scaled.filter(|_| !rigid),
        low_scaled: scaled.map(|scaled| scaled.0),
        high_scaled: scaled.map(|scaled| scaled.1),
        at_least: quantity.at_least,
        at_most: quantity.at_most,
    })
}

fn is_asked(found: &ConsistentEstimate, quantity: Quantity) -> bool {
    found
        .fit
        .iter()
        .any(|parameter| parameter.name() == quantity.name())
}

/// Where the beam's uncertain properties went.
fn fitted_along(found: &ConsistentEstimate) -> Vec<String> {
    let beam = [
        (Quantity::Modulus, "Pa"),
        (Quantity::Density, "kg/m3"),
        (Quantity::Length, "m"),
        (Quantity::Width, "m"),
        (Quantity::Thickness, "m"),
    ];
    beam.iter()
        .filter(|(quantity, _)| !is_asked(found, *quantity))
        .filter_map(|(quantity, unit)| {
            let value = found.quantity(*quantity)?.value?;
            Some(format!(
                "{} has a tolerance and was fitted along, to {value:.6e} {unit}",
                quantity.name()
            ))
        })
        .collect()
}

fn identifiability(found: &ConsistentEstimate) -> IdentifiabilitySection {
    let report = &found.identifiability;
    let dead = report
        .dead
        .iter()
        .map(|parameter| format!("{} is felt by none of these frequencies", parameter.name()));
    let limits = report.at_limit.iter().map(|(parameter, limit)| {
        let end = match limit {
            Limit::Rigid => "rigid",
            Limit::Absent => "absent",
            Limit::FullCoupling => "as large as any joint can have it",
        };
        format!("{} is at the end of its range: {end}", parameter.name())
    });
    let flat = report.flat.iter().map(|flat| flat.words.clone());
    IdentifiabilitySection {
        singular_values: report.singular_values.clone(),
        condition: report.condition,
        statements: flat
            .chain(dead)
            .chain(limits)
            .chain(fitted_along(found))
            .collect(),
    }
}
