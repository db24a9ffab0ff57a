//! Doubts about an estimate: what its numbers show, and what it leaves out of the described test.

use super::analysis::{BetweenRecordings, Estimate, EstimateMethod, Identification, ModeResult};
use super::between_recordings::exceeds_noise;
use super::structure::TestedStructure;
use super::warning::Warning;
use tapjoint_beam::BeamTheory;
use tapjoint_description::{FitParameter, SensorDescription, SensorKind, TestDescription, Weights};
use tapjoint_identify::consistent::{
    ConsistentEstimate, EstimatedQuantity, Limit, NOTABLE_MISFIT, Quantity, Verdict,
};
use tapjoint_identify::{Doubt, MeasuredMode, PredictedMode};
use tapjoint_numerics::stats::times;

/// Another possible cause of a misfit where modes come from several recordings.
const BETWEEN: &str = "; recordings taken one after the other differ by more than \
                       single readings";
/// Remedy for it where there is a joint.
const ALLOWED: &str =
    ": the diagnosis of what is missing allows for a joint that drifts between them";

/// Doubts that the description itself raises.
pub(super) fn of_description(test: &TestDescription) -> Vec<Warning> {
    let doubts = test.warnings.iter();
    doubts
        .map(|doubt| Warning::new("description", doubt.to_string()))
        .collect()
}

/// Doubts about the estimates of all methods.
pub(super) fn of_estimate(
    structure: &TestedStructure,
    found: &Identification,
    modes: &[ModeResult],
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    match (&found.consistent, &found.estimate, &found.reason) {
        (Some(consistent), ..) => warnings.extend(of_consistent(consistent, modes)),
        (None, Some(_), Some(reason)) => warnings.push(of_fallback(structure, reason)),
        _ => {}
    }
    let Some(Estimate::Joint(joint)) = &found.estimate else {
        return warnings;
    };
    for doubt in &joint.doubts {
        warnings.extend(match doubt {
            Doubt::Closure { closure } => Some(Warning::closure(*closure)),
            Doubt::CouplingNotEstablished if found.consistent.is_some() => None,
            Doubt::CouplingNotEstablished => Some(Warning::coupling_not_established()),
            other => Some(Warning::unphysical(other)),
        });
    }
    warnings
}

/// Returns every doubt that the numbers of a consistent estimate raise.
fn of_consistent(found: &ConsistentEstimate, modes: &[ModeResult]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(text) = misfit(found) {
        let between: Vec<BetweenRecordings> =
            modes.iter().filter_map(|mode| mode.between).collect();
        let drift = match (exceeds_noise(&between), has_joint(found)) {
            (false, _) => String::new(),
            (true, false) => BETWEEN.to_owned(),
            (true, true) => format!("{BETWEEN}{ALLOWED}"),
        };
        warnings.push(Warning::new("misfit", text + &drift));
    }
    if found.goodness.verdict == Verdict::Untestable {
        warnings.push(Warning::new("untestable", found.goodness.words()));
    }
    for text in found.quantities.iter().filter_map(open_end) {
        warnings.push(Warning::new("at-limit", text));
    }
    // Of one parameter alone the open end says the same.
    let several = found.fit.len() > 1;
    for flat in found.identifiability.flat.iter().filter(|_| several) {
        warnings.push(Warning::new("flat-direction", flat.words.clone()));
    }
    // A valley whose frequencies are off by more than a beam's dimensions leave open is none to doubt.
    let most = 100.0 * NOTABLE_MISFIT;
    for other in found
        .other_minima
        .iter()
        .filter(|other| other.rms_percent < most)
    {
        let values = other.values.iter();
        let values: Vec<String> = values
            .map(|(q, v)| format!("{} {v:.4e}", q.name()))
            .collect();
        let text = format!(
            "another joint comes near the same frequencies, to {:.2} % rms: {}",
            other.rms_percent,
            values.join(", ")
        );
        warnings.push(Warning::new("other-minimum", text));
    }
    if !found.stop.converged() {
        let text = "the search for the best joint ended before it stood still; its values are not the best ones";
        warnings.push(Warning::new("not-converged", text.to_owned()));
    }
    // The interval of a fitted coupling that contains zero.
    let coupling = found.quantity(Quantity::Coupling);
    if coupling.is_some_and(|coupling| {
        let interval = coupling.low.zip(coupling.high);
        coupling.std.is_some() && interval.is_none_or(|(low, high)| low * high <= 0.0)
    }) {
        warnings.push(Warning::coupling_not_established());
    }
    warnings
}

/// The largest misfit of a prediction that is beyond what a beam's stated dimensions usually leave open in its
/// frequencies, and beyond three standard deviations of its reading. A coarse reading may miss by more than a sharp one
/// and mean less.
pub(super) fn of_prediction(
    prediction: &[PredictedMode],
    measured: &[MeasuredMode],
) -> Option<Warning> {
    let notable = prediction.iter().filter_map(|mode| {
        let error_percent = mode
            .error_percent
            .filter(|e| e.abs() > 100.0 * NOTABLE_MISFIT)?;
        let reading = measured.iter().find(|reading| reading.mode == mode.mode)?;
        let deviations = reading
            .std
            .map(|std| (mode.predicted - reading.frequency) / std);
        let beyond = deviations.is_none_or(|deviations| deviations.abs() > 3.0);
        beyond.then_some((mode.mode, error_percent, deviations))
    });
    let worst = notable.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    worst.map(|(mode, error_percent, deviations)| Warning::misfit(mode, error_percent, deviations))
}

/// The closed form stands in the place of the consistent estimate.
fn of_fallback(structure: &TestedStructure, reason: &str) -> Warning {
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
    Warning::new("fallback", text)
}

/// Returns true if a joint's stiffness was estimated, as of every structure but a free beam.
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
    // The name as tables write it.
    let name = match quantity.quantity {
        Quantity::Kx => "Kx",
        Quantity::Ky => "Ky",
        other => other.name(),
    };
    let own = Rounded(PERCENT_95 * std / value.abs());
    let scaled = within(50.0 * (high - low) / value.abs());
    Some(format!(
        "95 % interval of {name} from the frequencies' uncertainty alone \u{b1}{own} %, scaled by the misfit {scaled}"
    ))
}

/// Words for the half width (%) of an interval; one beyond the value itself determines nothing.
fn within(percent: f64) -> String {
    if percent > 100.0 {
        "not determined (beyond \u{b1}100 %)".to_owned()
    } else {
        format!("\u{b1}{} %", Rounded(percent))
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

/// Effects that estimate and prediction leave out. The pair regression stands beside the consistent
/// estimate in every report, so that its limits are always listed.
pub(super) fn neglected_effects(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Vec<Warning> {
    let consistent = method == EstimateMethod::Consistent;
    let mut warnings = Vec::new();
    warnings.extend(of_masses(test, structure, method));
    warnings.extend(of_fastened(test, structure, method));
    if structure.regression.is_some() {
        let texts = of_regression(test, structure, method);
        warnings.extend(texts.into_iter().map(|text| Warning::neglected(text, true)));
    }
    let analysis = &test.analysis;
    if consistent {
        warnings.extend(
            of_fit(test, structure)
                .into_iter()
                .map(|text| Warning::neglected(text, false)),
        );
    } else if analysis.fit.is_some() || analysis.weights.is_some() {
        let text = "`fit` and `weights` belong to the consistent estimate: the pair regression estimates all \
                    stiffnesses of its model and weighs all pairs alike";
        warnings.push(Warning::neglected(text, true));
    }
    warnings
}

/// Effects that the pair regression cannot take into account.
fn of_regression(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Vec<&'static str> {
    let mut texts = Vec::new();
    if structure.theory == BeamTheory::Timoshenko {
        texts.push(match method {
            EstimateMethod::Consistent => {
                "the pair regression takes an Euler beam (no shear, no rotary inertia); the consistent \
                 estimate and the prediction include both"
            }
            EstimateMethod::Pairs | EstimateMethod::FreeBeam => {
                "the pair regression takes an Euler beam (no shear, no rotary inertia); the prediction \
                 includes both, so that its errors show what that neglects"
            }
        });
    }
    if structure.known.any() {
        texts.push(match method {
            EstimateMethod::Consistent => {
                "the pair regression cannot hold a stiffness at its known value and estimates all of \
                 them; the consistent estimate and the prediction use the known ones"
            }
            EstimateMethod::Pairs | EstimateMethod::FreeBeam => {
                "the pair regression cannot hold a stiffness at its known value: it estimates all of \
                 them, and the prediction uses the known ones"
            }
        });
    }
    let joint = &test.joint;
    // A lap joint off the middle by more than a thousandth of the length.
    let off = joint
        .position
        .map(|position| (position - 0.5 * test.beam.length).abs());
    let off_centre = off.is_some_and(|off| off > 1e-3 * test.beam.length);
    if joint.overlap.is_some() || joint.right.is_some() || off_centre {
        texts.push(match method {
            EstimateMethod::Consistent => {
                "the pair regression takes two equal halves joined in the middle; the consistent estimate \
                 and the prediction take overlap, position and the right half's own properties into account"
            }
            EstimateMethod::Pairs | EstimateMethod::FreeBeam => {
                "the lap joint's model takes two equal halves joined in the middle: overlap, position and \
                 different properties of the right half are left out"
            }
        });
    }
    texts
}

/// Stiffnesses that `fit` leaves rigid, and weights without the uncertainties that they need.
fn of_fit(test: &TestDescription, structure: &TestedStructure) -> Vec<String> {
    let mut texts = Vec::new();
    if let Some(fit) = &test.analysis.fit
        && structure.regression.is_some()
    {
        let known = &structure.known;
        let springs = [
            (FitParameter::Kt, known.kx, "kt"),
            (FitParameter::Kr, known.ky, "kr"),
        ];
        for (parameter, known, name) in springs {
            if known.is_none() && !fit.contains(&parameter) {
                texts.push(format!(
                    "{name} is neither in `fit` nor stated in [joint], so the consistent estimate takes \
                     it as rigid; state its value, or list it in `fit`"
                ));
            }
        }
    }
    let unknown = test.measured.as_ref().is_some_and(|measured| {
        measured.std.is_none() && measured.half_line.is_none() && measured.scatter.is_none()
    });
    if test.analysis.weights == Some(Weights::Measured) && unknown {
        texts.push(
            "weights = \"measured\" needs uncertainties and there are none: equal relative weights \
             were taken, without intervals; state half_line, std or scatter in [measured]"
                .to_owned(),
        );
    }
    texts
}

/// The sensors' masses. A microphone loads nothing.
fn of_masses(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Option<Warning> {
    let mut loading: Vec<&SensorDescription> = test.sensors.iter().collect();
    loading.retain(|sensor| sensor.kind != SensorKind::Sound);
    let mass: f64 = loading.iter().filter_map(|sensor| sensor.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let size = format!(
        "the mass of the sensors, {} g or {:.1} % of the beam,",
        grams(mass),
        100.0 * mass / structure.beam.mass()
    );
    let included = method == EstimateMethod::Consistent && test.analysis.sensor_mass;
    let mut loading = loading.iter();
    let unplaced = loading.any(|sensor| sensor.mass.is_some() && test.place_of(sensor).is_none());
    let (effect, of_pairs) = match (included, unplaced, structure.regression) {
        (true, true, _) => (
            "is in the consistent estimate and the prediction only as far as the sensors' positions are known; \
             state them",
            false,
        ),
        (true, false, None) => (
            "is in the prediction and the consistent estimate; the closed form beside it neglects it",
            false,
        ),
        (true, false, Some(_)) => (
            "is in the prediction and the consistent estimate; the pair regression neglects it",
            true,
        ),
        (false, ..) => (
            "is in neither the estimate nor the prediction; it lowers the measured frequencies and thereby what is \
             estimated from them",
            false,
        ),
    };
    Some(Warning::neglected(format!("{size} {effect}"), of_pairs))
}

/// The warning about masses fastened in the reference configuration.
fn of_fastened(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Option<Warning> {
    let first = test.recordings.first()?;
    let mass: f64 = first.masses.iter().map(|fastened| fastened.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let size = format!(
        "what is fastened to the beam in {}, {} g or {:.1} % of the beam,",
        first.file.display(),
        grams(mass),
        100.0 * mass / structure.beam.mass()
    );
    let (effect, of_pairs) = match (method, structure.regression) {
        (EstimateMethod::Consistent, None) => (
            "is in the prediction and the consistent estimate; the closed form beside it neglects it",
            false,
        ),
        (EstimateMethod::Consistent, Some(_)) => (
            "is in the prediction and the consistent estimate; the pair regression beside it neglects it",
            true,
        ),
        (EstimateMethod::Pairs | EstimateMethod::FreeBeam, _) => (
            "is in neither the estimate nor the prediction; begin the description with a recording of the beam \
             without it",
            false,
        ),
    };
    Some(Warning::neglected(format!("{size} {effect}"), of_pairs))
}

/// Returns a mass (kg) in grams with four significant digits, without trailing zeros.
fn grams(mass: f64) -> f64 {
    let grams = 1e3 * mass;
    format!("{grams:.3e}").parse().unwrap_or(grams)
}

#[cfg(test)]
mod doubts_tests {
    use super::*;

    #[test]
    fn regress_no_probability_is_nothing() {
        assert_eq!(chance(0.0), "<0.001");
        assert_eq!(chance(3e-7), "<0.001");
        assert_eq!(chance(0.0042), "4.2e-3");
    }

    #[test]
    fn regress_a_half_width_beyond_the_value_is_none() {
        assert_eq!(within(8.8), "\u{b1}8.8 %");
        assert_eq!(within(30659.0), "not determined (beyond \u{b1}100 %)");
    }
}

#[cfg(test)]
mod neglect_tests {
    use super::grams;

    #[test]
    fn val_masses_have_four_digits_and_none_that_nobody_stated() {
        let cases = [
            (0.015, "15"),
            (0.0042, "4.2"),
            (0.012_345_6, "12.35"),
            (1.25, "1250"),
            (1e-6, "0.001"),
        ];
        for (mass, words) in cases {
            assert_eq!(grams(mass).to_string(), words);
        }
    }
}
