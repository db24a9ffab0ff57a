//! What speaks against a consistent estimate, in words.

use super::analysis::ModeResult;
use super::between::differ;
use super::model::TestedStructure;
use super::warning::Warning;
use tapjoint_identify::consistent::NOTABLE_MISFIT;
use tapjoint_identify::consistent::{
    ConsistentEstimate, EstimatedQuantity, Limit, Quantity, Verdict,
};
use tapjoint_numerics::stats::times;

/// What else may be behind a misfit where modes come from several recordings.
const BETWEEN: &str = "; recordings taken one after the other differ by more than \
                       single readings";
/// What is done about it where there is a joint.
const ALLOWED: &str =
    ": the diagnosis of what is missing allows for a joint that drifts between them";

/// Everything that a reader of the estimate has to know.
pub(super) fn of_consistent(found: &ConsistentEstimate, modes: &[ModeResult]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut add =
        |code: &'static str, text: String| warnings.push(Warning::Estimate { code, text });
    if let Some(text) = misfit(found) {
        let drift = match (differ(modes), has_joint(found)) {
            (false, _) => String::new(),
            (true, false) => BETWEEN.to_owned(),
            (true, true) => format!("{BETWEEN}{ALLOWED}"),
        };
        add("misfit", text + &drift);
    }
    if found.goodness.verdict == Verdict::Untestable {
        add("untestable", found.goodness.words());
    }
    for text in found.quantities.iter().filter_map(open_end) {
        add("at-limit", text);
    }
    // Of one parameter alone the open end says the same.
    let several = found.fit.len() > 1;
    for flat in found.identifiability.flat.iter().filter(|_| several) {
        add("flat-direction", flat.words.clone());
    }
    // A valley whose frequencies are off by more than a beam's dimensions leave open is none to doubt.
    let near = |rms_percent: f64| rms_percent < 100.0 * NOTABLE_MISFIT;
    for other in found.other_minima.iter().filter(|o| near(o.rms_percent)) {
        let values = other
            .values
            .iter()
            .map(|(q, v)| format!("{} {v:.4e}", q.name()));
        let values: Vec<String> = values.collect();
        add(
            "other-minimum",
            format!(
                "another joint comes near the same frequencies, to {:.2} % rms: {}",
                other.rms_percent,
                values.join(", ")
            ),
        );
    }
    if !found.stop.converged() {
        add(
            "not-converged",
            "the search for the best joint ended before it stood still; its values are not the best \
             ones"
                .to_owned(),
        );
    }
    if coupling_is_open(found) {
        warnings.push(Warning::CouplingNotEstablished);
    }
    warnings
}

/// The closed form stands in the place of the consistent estimate.
pub(super) fn of_fallback(structure: &TestedStructure, reason: &str) -> Warning {
    let closed = match structure.regression {
        Some(_) => "the pair regression",
        None => "the closed form",
    };
    let text = if structure.known.over(None).is_some() {
        format!(
            "all stiffnesses are stated in [joint], so there is none to fit: the prediction uses the \
             stated ones, and {closed} shows what the frequencies alone would say"
        )
    } else {
        format!("no consistent estimate: {reason}; {closed} stands in its place")
    };
    Warning::Estimate {
        code: "fallback",
        text,
    }
}

/// Whether the interval of a fitted coupling contains zero.
fn coupling_is_open(found: &ConsistentEstimate) -> bool {
    let coupling = found.quantity(Quantity::Coupling);
    coupling.is_some_and(|coupling| {
        let low = coupling.low.zip(coupling.high);
        coupling.std.is_some() && low.is_none_or(|(low, high)| low * high <= 0.0)
    })
}

/// Whether a joint's stiffness was sought: of a free beam its properties alone are.
fn has_joint(found: &ConsistentEstimate) -> bool {
    [Quantity::Kx, Quantity::Ky]
        .into_iter()
        .any(|stiffness| found.quantity(stiffness).is_some())
}

/// The model against the readings: how far it misses, how many times larger uncertainties would allow that, and
/// what either leaves of the intervals.
fn misfit(found: &ConsistentEstimate) -> Option<String> {
    let goodness = &found.goodness;
    let percent = 100.0 * goodness.relative_misfit;
    if goodness.chi_squared.is_none() {
        let doubtful = matches!(goodness.verdict, Verdict::Doubtful | Verdict::CannotExplain);
        return doubtful.then(|| goodness.words());
    }
    let factor = goodness.uncertainty_factor()?;
    let sought = match has_joint(found) {
        true => "the joint",
        false => "the beam's modulus",
    };
    let intervals: Vec<String> = found.quantities.iter().filter_map(two_intervals).collect();
    let intervals = if intervals.is_empty() {
        String::new()
    } else {
        format!("; {}", intervals.join("; "))
    };
    Some(format!(
        "the model misses the frequencies by {} % rms; uncertainties that would allow that are {} times the stated \
         ones (goodness of fit {}); std and 95 % limits stand for the frequencies' uncertainty alone, and {sought} is \
         not known that well{intervals}",
        Rounded(percent),
        times(factor),
        chance(goodness.probability.unwrap_or(0.0))
    ))
}

/// A probability in two digits: none is nothing, however small.
fn chance(probability: f64) -> String {
    if probability < 0.001 {
        "<0.001".to_owned()
    } else {
        Rounded(probability).to_string()
    }
}

/// A number in two digits, with an exponent only where it is very small.
struct Rounded(f64);

impl std::fmt::Display for Rounded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            size if size >= 10.0 => write!(f, "{size:.0}"),
            size if size >= 1.0 => write!(f, "{size:.1}"),
            size if size >= 0.1 => write!(f, "{size:.2}"),
            size if size >= 0.01 => write!(f, "{size:.3}"),
            size if size > 0.0 => write!(f, "{size:.1e}"),
            _ => f.write_str("0"),
        }
    }
}

/// "Kx: ±0.01 % from the frequencies' uncertainty alone, ±1.3 % scaled by the misfit", for non-dimensional ones
/// and the material.
fn two_intervals(quantity: &EstimatedQuantity) -> Option<String> {
    // Half width of a 95 % interval of a normal distribution, in standard deviations, in percent.
    const PERCENT_95: f64 = 196.0;
    let told = matches!(
        quantity.quantity,
        Quantity::Kx | Quantity::Ky | Quantity::Modulus | Quantity::Density
    );
    let value = quantity.value.filter(|value| told && *value != 0.0)?;
    let (std, (low, high)) = quantity.std.zip(quantity.scaled)?;
    Some(format!(
        "95 % interval of {} from the frequencies' uncertainty alone \u{b1}{} %, scaled by the misfit {}",
        symbol(quantity.quantity),
        Rounded(PERCENT_95 * std / value.abs()),
        within(50.0 * (high - low) / value.abs())
    ))
}

/// A half width (%): one beyond the value itself determines nothing.
fn within(percent: f64) -> String {
    if percent > 100.0 {
        "not determined (beyond \u{b1}100 %)".to_owned()
    } else {
        format!("\u{b1}{} %", Rounded(percent))
    }
}

/// As tables write it.
fn symbol(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Kx => "Kx",
        Quantity::Ky => "Ky",
        other => other.name(),
    }
}

/// A value at the end of its range, or an interval without an end.
fn open_end(quantity: &EstimatedQuantity) -> Option<String> {
    let name = quantity.quantity.name();
    if !matches!(
        quantity.quantity,
        Quantity::Kt | Quantity::Kr | Quantity::Coupling
    ) {
        return None;
    }
    let limit = quantity.limit.map(|limit| match limit {
        Limit::Rigid => format!("the best fit of {name} is rigid"),
        Limit::Absent => format!("the best fit has no stiffness {name} at all"),
        Limit::FullCoupling => "the coupling is as large as any joint can have it".to_owned(),
    });
    let least = quantity.at_least.map(|least| {
        format!("the frequencies say only that {name} is at least {least:.4e} (95 %)")
    });
    let most = quantity
        .at_most
        .map(|most| format!("the frequencies say only that {name} is at most {most:.4e} (95 %)"));
    let parts: Vec<String> = [limit, least, most].into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_no_probability_is_nothing() {
        assert_eq!(chance(0.0), "<0.001");
        assert_eq!(chance(3e-7), "<0.001");
        assert_eq!(chance(0.0042), "4.2e-3");
        assert_eq!(symbol(Quantity::Kx), "Kx");
    }

    #[test]
    fn regress_a_half_width_beyond_the_value_is_none() {
        assert_eq!(within(8.8), "\u{b1}8.8 %");
        assert_eq!(within(30659.0), "not determined (beyond \u{b1}100 %)");
    }
}
