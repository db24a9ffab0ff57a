//! Sizes in words: parameters of effects, stiffnesses, and errors in percent.

use crate::format::{RIGID, or_missing, prefix, rounded, significant, with_decimals_of};
use tapjoint_beam::effects::Group;
use tapjoint_diagnosis::{HypothesisResult, ParameterValue};
use tapjoint_numerics::stats::NORMAL_95;

/// A size below this is zero but for rounding, in the unit that it is written in.
const NOTHING: f64 = 1e-9;

/// "mass 24.10 ± 0.59 g", with half the 95 % interval; of two effects "local-crack: compliance ..., position ...; sensor-mass: mass ...".
pub(crate) fn sizes(found: &HypothesisResult) -> String {
    let mut sorted: Vec<&ParameterValue> = found.parameters.iter().collect();
    sorted.sort_by_key(|one| (one.effect.name(), one.name));
    let alone = sorted.iter().all(|one| one.effect == sorted[0].effect);
    // A place that may be anywhere, and the inertia of no mass, are left out.
    sorted.retain(|parameter| match parameter.std {
        None => !matches!(
            parameter.name,
            "position" | "frequency" | "exponent" | "inertia"
        ),
        Some(std) => parameter.name != "inertia" || std != 0.0,
    });
    // An error that stays through the test belongs to no recording.
    sorted.retain(|parameter| parameter.name != "recording" || parameter.value != 0.0);
    let of_effects = sorted.chunk_by(|one, next| one.effect == next.effect);
    let parts: Vec<String> = of_effects
        .map(|own| {
            let sizes: Vec<String> = own.iter().map(|one| size(one)).collect();
            match alone {
                true => sizes.join(", "),
                false => format!("{}: {}", own[0].effect.name(), sizes.join(", ")),
            }
        })
        .collect();
    parts.join("; ")
}

fn size(parameter: &ParameterValue) -> String {
    // Numbers of things of the set-up; 0 is all of them.
    if matches!(parameter.name, "sensor" | "other" | "recording") {
        let what = parameter.name.replace("other", "and");
        return match parameter.value {
            0.0 => format!("all {what}s"),
            number => format!("{what} {number:.0}"),
        };
    }
    let (unit, factor) = unit_of(parameter);
    let value = factor * parameter.value;
    let half = parameter.std.map(|std| factor * NORMAL_95 * std);
    let size = match half.filter(|half| half.is_finite() && *half > 0.0) {
        Some(half) => rounded(value, Some(half)).joined(),
        None if value.abs() < NOTHING => "0".to_owned(),
        None => significant(value, 3),
    };
    format!("{} {size}{unit}", parameter.name.replace('_', " "))
}

/// The unit a parameter is read in, and how many of it one SI unit is.
pub(crate) fn unit_of(parameter: &ParameterValue) -> (&'static str, f64) {
    match parameter.name {
        // A place that is off; that of readings is a frequency.
        "offset" if parameter.effect.group() == Group::SetUp => (" mm", 1e3),
        "mass" => (" g", 1e3),
        "inertia" => (" kg mm\u{b2}", 1e6),
        "position" => (" mm", 1e3),
        "stiffness" => (" N/m", 1.0),
        "frequency" | "offset" => (" Hz", 1.0),
        "force" => (" N", 1.0),
        // A hinge's rotational compliance times E I/L.
        "compliance" => (" L/EI", 1.0),
        "relative" | "ratio" | "std" | "loss_factor" => (" %", 1e2),
        _ => ("", 1.0),
    }
}

/// An error that is left (%). Far below what noise leaves (%) it says nothing but that.
pub(crate) fn left(error: Option<f64>, noise: Option<f64>) -> String {
    const FAR_BELOW: f64 = 0.2;
    let least = noise.map(|noise| FAR_BELOW * noise);
    match error.zip(least) {
        Some((error, least)) if error < least => format!("<{}", significant(least, 1)),
        _ => percent(error),
    }
}

/// A value in percent with two digits.
pub(crate) fn percent(value: Option<f64>) -> String {
    or_missing(value.map(|value| significant(value, 2)))
}

/// "1.995 MN/m (95 %: 1.991 to 1.999)", the value on one line with its unit.
pub(crate) fn stiffness_with_limits(value: f64, interval: Option<[f64; 2]>, unit: &str) -> String {
    if value.is_infinite() {
        return RIGID.to_owned();
    }
    let (factor, letter) = prefix(value);
    let [low, high] = [0, 1].map(|end| interval.map(|ends| factor * ends[end]));
    let (shown, limits) = with_limits(factor * value, low, high);
    let limits = limits.map_or_else(String::new, |limits| format!(" (95 %: {limits})"));
    format!("{shown}\u{a0}{letter}{unit}{limits}")
}

/// "1.995" and "1.991 to 1.999", all with the digits that the interval supports; an end that is not finite is none.
pub(crate) fn with_limits(
    value: f64,
    low: Option<f64>,
    high: Option<f64>,
) -> (String, Option<String>) {
    let [low, high] = [low, high].map(|end| end.filter(|end| end.is_finite()));
    let half = low.zip(high).map(|(low, high)| 0.5 * (high - low));
    let shown = rounded(value, half).value;
    let [low, high] = [low, high].map(|end| end.map(|end| with_decimals_of(end, &shown)));
    let limits = limits(low.as_deref(), high.as_deref());
    (shown, limits)
}

/// "1.991 to 1.999", "above 1.991" or "below 1.999"; `None` without an end.
pub(crate) fn limits(low: Option<&str>, high: Option<&str>) -> Option<String> {
    match (low, high) {
        (Some(low), Some(high)) => Some(format!("{low} to {high}")),
        (Some(low), None) => Some(format!("above {low}")),
        (None, Some(high)) => Some(format!("below {high}")),
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tapjoint_beam::effects::EffectId;

    #[test]
    fn regress_an_error_far_below_the_noise_has_no_digits() {
        assert_eq!(left(Some(3.5e-6), Some(0.0052)), "<0.001");
        assert_eq!(left(Some(0.0011), Some(0.0052)), "0.0011");
        assert_eq!(left(Some(3.5e-6), None), "0.0000035");
        assert_eq!(left(None, Some(0.0052)), "\u{2013}");
    }

    #[test]
    fn limit_sizes_of_two_effects_stand_under_their_names() {
        let parameter =
            |effect: EffectId, name: &'static str, value: f64, std: Option<f64>| ParameterValue {
                effect,
                name,
                value,
                std,
                smallest_detectable: None,
                smallest_separable: None,
            };
        let of = |parameters: Vec<ParameterValue>| {
            sizes(&HypothesisResult {
                parameters,
                ..HypothesisResult::default()
            })
        };
        let known = |value: f64, std: Option<f64>| {
            let mass = parameter(EffectId::AddedMass, "mass", 0.0, Some(1e-3));
            of(vec![
                mass,
                parameter(EffectId::AddedMass, "position", value, std),
            ])
        };
        // Next to nothing of it may be anywhere.
        assert_eq!(known(0.004, None), "mass 0.0 \u{b1} 2.0 g");
        let somewhere = known(0.004, Some(0.001));
        assert_eq!(
            somewhere,
            "mass 0.0 \u{b1} 2.0 g, position 4.0 \u{b1} 2.0 mm"
        );
        let mass = parameter(EffectId::SensorMass, "mass", 0.024, None);
        assert_eq!(of(vec![mass.clone()]), "mass 24.0 g");
        let whole = |name, value| parameter(EffectId::SensorScale, name, value, None);
        let scale = parameter(EffectId::SensorScale, "relative", 0.1, Some(0.01));
        let of_all = of(vec![scale, whole("sensor", 0.0), whole("recording", 0.0)]);
        assert_eq!(of_all, "relative 10.0 \u{b1} 2.0 %, all sensors");
        let of_one = of(vec![whole("sensor", 2.0), whole("recording", 1.0)]);
        assert_eq!(of_one, "recording 1, sensor 2");
        let crack = parameter(EffectId::LocalCrack, "compliance", 0.01, None);
        let words = "local-crack: compliance 0.0100 L/EI; sensor-mass: mass 24.0 g";
        assert_eq!(of(vec![mass, crack]), words);
    }
}
