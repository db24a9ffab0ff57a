//! Doubts about an estimate, its prediction, and what it leaves out of the described test.

use super::Warning;
use super::measurement::frequency_words;
use crate::results::{
    BetweenRecordings, Estimate, EstimateMethod, Identification, LeftOutMode, ModeResult,
    exceeds_noise,
};
use crate::structure::TestedStructure;
use std::fmt;
use tapjoint_beam::BeamTheory;
use tapjoint_description::{FitParameter, SensorDescription, SensorKind, TestDescription, Weights};
use tapjoint_identify::consistent::{
    ConsistentEstimate, EstimatedQuantity, FitVerdict, Limit, NOTABLE_MISFIT, Quantity,
};
use tapjoint_identify::{Doubt, MeasuredMode, PredictedMode};
use tapjoint_numerics::quantity::with_prefix;
use tapjoint_numerics::stats::times;

/// A mode that moves by more than this share (1) is reported: what drift and sensors usually do is less.
const MOVED: f64 = 0.015;

impl Warning {
    /// A doubt about the pair regression alone.
    fn about_pairs(code: &'static str, sentence: impl Into<String>) -> Self {
        Warning {
            of_pairs: true,
            ..Warning::new(code, sentence)
        }
    }

    /// An effect that the method leaves out; `of_pairs` if only the pair regression does.
    fn neglected(sentence: impl Into<String>, of_pairs: bool) -> Self {
        Warning {
            of_pairs,
            ..Warning::new("neglected", sentence)
        }
    }

    /// Modes whose frequencies in the recordings are far apart.
    pub(crate) fn moved_modes(modes: &[ModeResult]) -> Option<Self> {
        let mut moved = Vec::new();
        for mode in modes {
            let (low, high) = mode
                .repeats
                .values()
                .fold((f64::INFINITY, 0.0), |ends, own| {
                    (own.min(ends.0), own.max(ends.1))
                });
            if let Some(number) = mode.mode.filter(|_| high - low > MOVED * high) {
                let (low, high) = (frequency_words(low), frequency_words(high));
                moved.push(format!("mode {number} ({low} to {high} Hz)"));
            }
        }
        let text = format!(
            "frequencies differ between the recordings, and are taken for one mode each: {}; where these may be two modes, \
             compare the shapes, or analyse the recordings one by one",
            moved.join(", ")
        );
        (!moved.is_empty()).then(|| Warning::new("moved-mode", text))
    }

    /// The estimated joint has no prediction.
    pub(crate) fn no_prediction(error: &impl fmt::Display) -> Self {
        let text = format!("the estimated joint cannot be predicted with: {error}");
        Warning::new("no-prediction", text)
    }
}

/// Another possible cause of a misfit where modes come from several recordings.
const BETWEEN: &str = "; recordings taken one after the other differ by more than \
                       single readings";
/// Remedy for it where there is a joint.
const ALLOWED: &str =
    ": the diagnosis of what is missing allows for a joint that drifts between them";

/// Doubts about the estimates of all methods.
pub(crate) fn of_estimate(
    structure: &TestedStructure,
    found: &Identification,
    modes: &[ModeResult],
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    match (&found.consistent, &found.estimate, &found.reason) {
        (Some(consistent), ..) => {
            let numbers = found.better_numbers.as_deref();
            match found.without_mode() {
                Some(modes) => warnings.push(left_out(modes, numbers)),
                None => warnings.extend(numbers.map(better_numbers)),
            }
            warnings.extend(of_consistent(consistent, modes));
        }
        // The closed form stands in the place of the consistent estimate.
        (None, Some(_), Some(reason)) => {
            let closed = match structure.regression {
                Some(_) => "the pair regression",
                None => "the closed form",
            };
            let text = match structure.known.over(None) {
                Some(_) => format!(
                    "all stiffnesses are stated in [joint], so there is none to fit: the prediction uses the \
                     stated ones, and {closed} shows what the frequencies alone would say"
                ),
                None => format!("no consistent estimate: {reason}; {closed} stands in its place"),
            };
            warnings.push(Warning::new("fallback", text));
        }
        _ => {}
    }
    let Some(Estimate::Joint(joint)) = &found.estimate else {
        return warnings;
    };
    for doubt in &joint.doubts {
        warnings.push(match doubt {
            Doubt::Closure { closure } => {
                let percent = 100.0 * closure;
                let text = format!(
                    "the pair regression fails its own check: the product of the compliances that it finds differs \
                     by {percent:+.0} % from the product of its two estimates; do not use its stiffnesses"
                );
                Warning::about_pairs("closure", text)
            }
            Doubt::CouplingNotEstablished if found.consistent.is_some() => continue,
            Doubt::CouplingNotEstablished => coupling_not_established(),
            other => Warning::about_pairs(
                "unphysical",
                format!(
                    "the regression's answer is not a joint that can exist: {other}; a missing or an extra \
                     mode, a wrong model or readings too coarse for it are the usual causes"
                ),
            ),
        });
    }
    warnings
}

/// The frequencies do not show a cross coupling.
fn coupling_not_established() -> Warning {
    Warning::new(
        "coupling-not-established",
        "the interval of the cross coupling contains zero: these frequencies do not show one, \
         and Kz has no interval; the two-parameter model may do",
    )
}

/// Returns every doubt that the numbers of a consistent estimate raise.
fn of_consistent(found: &ConsistentEstimate, modes: &[ModeResult]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(mut text) = misfit(found) {
        let between: Vec<BetweenRecordings> =
            modes.iter().filter_map(|mode| mode.between).collect();
        if exceeds_noise(&between) {
            text += BETWEEN;
            text += if has_joint(found) { ALLOWED } else { "" };
        }
        warnings.push(Warning::new("misfit", text));
    }
    if let Some(text) = moved_description(found) {
        warnings.push(Warning::new("description", text));
    }
    if found.goodness.verdict == FitVerdict::Untestable {
        warnings.push(Warning::new("untestable", found.goodness.words()));
    }
    for text in found.quantities.iter().filter_map(open_end) {
        warnings.push(Warning::new("at-limit", text));
    }
    // With one parameter alone the open end already states this.
    let several = found.fit.len() > 1;
    for flat in found.identifiability.flat.iter().filter(|_| several) {
        warnings.push(Warning::new("flat-direction", flat.words.as_str()));
    }
    // A valley whose frequencies are off by more than a beam's dimensions leave open is none to doubt.
    let most = 100.0 * NOTABLE_MISFIT;
    let minima = found.other_minima.iter();
    for other in minima.filter(|other| other.rms_percent < most) {
        let values = other.values.iter();
        let values = values.map(|(quantity, value)| value_words(*quantity, *value));
        let text = format!(
            "another joint comes near the same frequencies, to {:.2} % rms: {}",
            other.rms_percent,
            values.collect::<Vec<_>>().join(", ")
        );
        warnings.push(Warning::new("other-minimum", text));
    }
    if !found.stop.converged() {
        let text = "the search for the best joint ended before it stood still; its values are not the best ones";
        warnings.push(Warning::new("not-converged", text));
    }
    // The interval of a fitted coupling that contains zero.
    let coupling = found.quantity(Quantity::Coupling);
    if coupling.is_some_and(|coupling| {
        let interval = coupling.low.zip(coupling.high);
        coupling.std.is_some() && interval.is_none_or(|(low, high)| low * high <= 0.0)
    }) {
        warnings.push(coupling_not_established());
    }
    warnings
}

/// Returns a warning about the largest notable misfit of a prediction. A notable misfit exceeds the usual effect of a
/// beam's stated dimensions on its frequencies, and three standard deviations of its reading. A coarse reading may
/// miss by more than a sharp one and mean less.
pub(crate) fn of_prediction(
    prediction: &[PredictedMode],
    measured: &[MeasuredMode],
) -> Option<Warning> {
    let notable = prediction.iter().filter_map(|mode| {
        let error = mode.error_percent?;
        let reading = measured.iter().find(|reading| reading.mode == mode.mode)?;
        let deviations = reading
            .std
            .map(|std| (mode.predicted - reading.frequency) / std);
        let beyond = deviations.is_none_or(|deviations| deviations.abs() > 3.0);
        (beyond && error.abs() > 100.0 * NOTABLE_MISFIT).then_some((mode.mode, error, deviations))
    });
    let worst = notable.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (mode, error_percent, deviations) = worst?;
    let deviations = deviations.map(|deviations| {
        let times = times(deviations);
        format!(" ({times} standard deviations of its frequency)")
    });
    let deviations = deviations.unwrap_or_default();
    let text = format!(
        "with the estimated joint the model misses mode {mode} by {error_percent:+.2} %{deviations}; the \
         estimator, a mode numbered wrongly, or something the model lacks may be the cause"
    );
    Some(Warning::new("prediction-error", text))
}

/// Returns true if a joint's stiffness was estimated, as of every structure but a free beam.
fn has_joint(found: &ConsistentEstimate) -> bool {
    [Quantity::Kx, Quantity::Ky]
        .into_iter()
        .any(|stiffness| found.quantity(stiffness).is_some())
}

/// The model against the readings: its misfit, the uncertainties that would allow it, and what either leaves of the
/// intervals.
fn misfit(found: &ConsistentEstimate) -> Option<String> {
    let goodness = &found.goodness;
    let percent = 100.0 * goodness.relative_misfit;
    if goodness.chi_squared.is_none() {
        let doubtful = matches!(
            goodness.verdict,
            FitVerdict::Doubtful | FitVerdict::CannotExplain
        );
        return doubtful.then(|| goodness.words());
    }
    let factor = goodness.uncertainty_factor()?;
    Some(format!(
        "the model misses the frequencies by {} % rms, {} times as much as readings and description allow (goodness of \
         fit {}); the limits take what it misses for errors of {} % of each frequency at random; an effect that acts like \
         another joint may move the estimate further: see the diagnosis",
        two_digits(percent),
        times(factor),
        chance(goodness.probability.unwrap_or(0.0)),
        two_digits(100.0 * found.discrepancy)
    ))
}

/// A probability in two digits: none is nothing, however small.
fn chance(probability: f64) -> String {
    match probability < 0.001 {
        true => "<0.001".to_owned(),
        false => two_digits(probability),
    }
}

/// A number in two digits, with an exponent only where it is very small.
fn two_digits(size: f64) -> String {
    match size {
        size if size >= 10.0 => format!("{size:.0}"),
        size if size >= 1.0 => format!("{size:.1}"),
        size if size >= 0.1 => format!("{size:.2}"),
        size if size >= 0.01 => format!("{size:.3}"),
        size if size > 0.0 => format!("{size:.1e}"),
        _ => "0".to_owned(),
    }
}

/// The mode that is left out, or those of which one does not belong to the others, and the joint with and without it. Other
/// numbers that would explain all modes are another reading of the same misfit.
fn left_out(left_out: &LeftOutMode, numbers: Option<&[usize]>) -> Warning {
    let with_all = answer_words(&left_out.with_all);
    let mut text = match &left_out.answers[..] {
        several @ [_, _, ..] => {
            let mut modes: Vec<usize> = several.iter().map(|answer| answer.mode.mode).collect();
            modes.sort_unstable();
            let modes: Vec<String> = modes.iter().map(usize::to_string).collect();
            let answers: Vec<String> = several
                .iter()
                .map(|answer| {
                    format!(
                        "{} without mode {}, which then lies {:+.2} % off ({} standard deviations)",
                        answer_words(&answer.estimate),
                        answer.mode.mode,
                        answer.mode.percent,
                        times(answer.mode.deviations.abs())
                    )
                })
                .collect();
            format!(
                "one of the modes {} does not belong to the others; the frequencies do not tell which. The best fit has {}. With \
                 all modes it has {with_all}. The limits hold the limits of all these answers. The values are those without mode {}. \
                 Look at their peaks and their numbers",
                listed(&modes),
                answers.join("; "),
                left_out.found.mode,
            )
        }
        _ => {
            let found = &left_out.found;
            format!(
                "mode {} is left out: it lies {:+.2} % from what the other modes predict ({} standard deviations). Without it \
                 the model explains the rest (goodness of fit {}). With it the best fit has {with_all}. Look at its peak and its \
                 number, and at what the diagnosis makes of it",
                found.mode,
                found.percent,
                times(found.deviations.abs()),
                chance(found.goodness_without),
            )
        }
    };
    if let Some(numbers) = numbers {
        let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
        text += &format!(
            ". Or all modes belong together and are numbered wrongly: the model explains them with the numbers {}",
            numbers.join(", ")
        );
    }
    Warning::new("outlying-mode", text)
}

/// "1 and 3", "1, 2 and 3".
fn listed(words: &[String]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => words.concat(),
    }
}

/// "Kt 1.400 MN/m, Kr 900.0 N m/rad".
fn answer_words(estimate: &ConsistentEstimate) -> String {
    let mut words = Vec::new();
    for quantity in [Quantity::Kt, Quantity::Kr, Quantity::Modulus] {
        let is_asked = estimate.fit.contains(&quantity.lead());
        let own = estimate.quantity(quantity).filter(|_| is_asked);
        if let Some(value) = own.and_then(|own| own.value) {
            words.push(value_words(quantity, value));
        }
    }
    words.join(", ")
}

/// "Kt 1.400 MN/m": a value with its symbol and unit.
fn value_words(quantity: Quantity, value: f64) -> String {
    let (symbol, unit) = match quantity {
        Quantity::Kt => ("Kt", "N/m"),
        Quantity::Kr => ("Kr", "N m/rad"),
        Quantity::Modulus => ("modulus", "Pa"),
        Quantity::Density => ("density", "kg/m3"),
        _ => return format!("{} {value:.4}", quantity.name()),
    };
    format!("{symbol} {}", with_prefix(value, unit))
}

/// Other numbers of the modes that the model would explain.
fn better_numbers(numbers: &[usize]) -> Warning {
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    Warning::new(
        "other-numbers",
        format!(
            "the model does not explain the modes as they are numbered. It would with the numbers {}. Check whether a mode \
             was missed, or whether a peak is no mode",
            numbers.join(", ")
        ),
    )
}

/// Pull of a described property beyond which the description is in doubt (standard uncertainties).
const LARGE_PULL: f64 = 2.0;

/// Properties of the description that the fit moves by more than their uncertainty explains.
fn moved_description(found: &ConsistentEstimate) -> Option<String> {
    let pulls = found.description.iter();
    let pulls = pulls.filter(|pull| pull.pull.abs() > LARGE_PULL);
    let words: Vec<String> = pulls
        .map(|pull| {
            format!(
                "{} from {:.4e} to {:.4e} ({:+.1} standard uncertainties)",
                pull.input.name(),
                pull.stated,
                pull.fitted,
                pull.pull
            )
        })
        .collect();
    (!words.is_empty()).then(|| {
        format!(
            "the frequencies move the description beyond what it allows: {}; measure it, or state a larger tolerance",
            words.join(", ")
        )
    })
}

/// A value at the end of its range, or an interval without an end.
fn open_end(quantity: &EstimatedQuantity) -> Option<String> {
    let name = match quantity.quantity {
        joint @ (Quantity::Kt | Quantity::Kr | Quantity::Coupling) => joint.name(),
        _ => return None,
    };
    let limit = quantity.limit.map(|limit| match limit {
        Limit::Rigid => format!("the best fit of {name} is rigid"),
        Limit::Absent => format!("the best fit has no stiffness {name} at all"),
        Limit::FullCoupling => "the coupling is as large as any joint can have it".to_owned(),
    });
    let only = [("least", quantity.at_least), ("most", quantity.at_most)];
    let only = only.map(|(word, end)| {
        let end = end.map(|end| value_words(quantity.quantity, end));
        end.map(|end| format!("the frequencies give a limit only: {end} at {word} (95 %)"))
    });
    let parts: Vec<String> = limit
        .into_iter()
        .chain(only.into_iter().flatten())
        .collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Effects that estimate and prediction leave out. The pair regression stands beside the consistent
/// estimate in every report, so that its limits are always listed.
pub(crate) fn neglected_effects(
    test: &TestDescription,
    structure: &TestedStructure,
    method: EstimateMethod,
) -> Vec<Warning> {
    let consistent = method == EstimateMethod::Consistent;
    let mut warnings = Vec::new();
    warnings.extend(of_masses(test, structure, consistent));
    warnings.extend(of_fastened(test, structure, consistent));
    let joint = &test.joint;
    // A lap joint off the middle by more than a thousandth of the length.
    let off = joint
        .position
        .map(|position| (position - 0.5 * test.beam.length).abs());
    let off_centre = off.is_some_and(|off| off > 1e-3 * test.beam.length);
    // Effects that the pair regression cannot take into account: beside the consistent estimate, and without it.
    let of_regression = [
        (
            structure.theory == BeamTheory::Timoshenko,
            "the pair regression takes an Euler beam (no shear, no rotary inertia, no stiffening by the width); \
             the consistent estimate and the prediction include them",
            "the pair regression takes an Euler beam (no shear, no rotary inertia, no stiffening by the width); \
             the prediction includes them, so that its errors show what that neglects",
        ),
        (
            structure.known.any(),
            "the pair regression cannot hold a stiffness at its known value and estimates all of \
             them; the consistent estimate and the prediction use the known ones",
            "the pair regression cannot hold a stiffness at its known value: it estimates all of \
             them, and the prediction uses the known ones",
        ),
        (
            joint.overlap.is_some() || joint.right.is_some() || off_centre,
            "the pair regression takes two equal halves joined in the middle; the consistent estimate \
             and the prediction take overlap, position and the right half's own properties into account",
            "the lap joint's model takes two equal halves joined in the middle: overlap, position and \
             different properties of the right half are left out",
        ),
    ];
    for (is_there, beside, alone) in of_regression {
        if is_there && structure.regression.is_some() {
            let text = if consistent { beside } else { alone };
            warnings.push(Warning::neglected(text, true));
        }
    }
    if consistent {
        let texts = of_fit(test, structure).into_iter();
        warnings.extend(texts.map(|text| Warning::neglected(text, false)));
    } else if test.analysis.fit.is_some() || test.analysis.weights.is_some() {
        let text = "`fit` and `weights` belong to the consistent estimate: the pair regression estimates all \
                    stiffnesses of its model and weighs all pairs alike";
        warnings.push(Warning::neglected(text, true));
    }
    warnings
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
    consistent: bool,
) -> Option<Warning> {
    let mut loading: Vec<&SensorDescription> = test.sensors.iter().collect();
    loading.retain(|sensor| sensor.kind != SensorKind::Sound);
    let mass: f64 = loading.iter().filter_map(|sensor| sensor.mass).sum();
    let what = "the mass of the sensors,";
    let included = consistent && test.analysis.sensor_mass;
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
    let text = weighed(what, mass, structure)? + effect;
    Some(Warning::neglected(text, of_pairs))
}

/// Masses fastened in the reference configuration.
fn of_fastened(
    test: &TestDescription,
    structure: &TestedStructure,
    consistent: bool,
) -> Option<Warning> {
    let first = test.recordings.first()?;
    let mass: f64 = first.masses.iter().map(|fastened| fastened.mass).sum();
    let what = format!("what is fastened to the beam in {},", first.file.display());
    let (effect, of_pairs) = match (consistent, structure.regression) {
        (true, None) => (
            "is in the prediction and the consistent estimate; the closed form beside it neglects it",
            false,
        ),
        (true, Some(_)) => (
            "is in the prediction and the consistent estimate; the pair regression beside it neglects it",
            true,
        ),
        (false, _) => (
            "is in neither the estimate nor the prediction; begin the description with a recording of the beam \
             without it",
            false,
        ),
    };
    let text = weighed(&what, mass, structure)? + effect;
    Some(Warning::neglected(text, of_pairs))
}

/// Names what loads the beam with its mass (kg), "15 g or 1.8 % of the beam, "; `None` without a mass.
fn weighed(what: &str, mass: f64, structure: &TestedStructure) -> Option<String> {
    let percent = 100.0 * mass / structure.beam.mass();
    (mass > 0.0).then(|| format!("{what} {} g or {percent:.1} % of the beam, ", grams(mass)))
}

/// Returns a mass (kg) in grams with four significant digits, without trailing zeros.
fn grams(mass: f64) -> f64 {
    let grams = 1e3 * mass;
    format!("{grams:.3e}").parse().unwrap_or(grams)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_no_probability_is_nothing() {
        assert_eq!(chance(0.0), "<0.001");
        assert_eq!(chance(3e-7), "<0.001");
        assert_eq!(chance(0.0042), "4.2e-3");
    }

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
