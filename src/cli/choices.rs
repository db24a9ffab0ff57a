//! Options that take one of a few words.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use tapjoint::description::{
    ASSEMBLIES, Assembly, FORMS, READINGS, ReadBy, ResponseForm, SENSOR_KINDS, SensorKind, WINDOWS,
    WindowKind,
};
use tapjoint::pipeline::{EstimateMethod, IdentifySettings};
use tapjoint::spectral::FrfEstimator;

/// Returns the parser of an option that takes one of these words, each with its help.
pub(super) fn words<T: Copy + Send + Sync + 'static, const N: usize>(
    table: [(&'static str, T); N],
    help: [&'static str; N],
) -> impl TypedValueParser<Value = T> {
    let known = table.iter().zip(help);
    let known = known.map(|((word, _), help)| PossibleValue::new(*word).help(help));
    PossibleValuesParser::new(known.collect::<Vec<_>>()).try_map(move |given: String| {
        let found = table.iter().find(|(word, _)| *word == given);
        found.map(|(_, value)| *value).ok_or("an unknown word")
    })
}

pub(super) fn assembly() -> impl TypedValueParser<Value = Assembly> {
    let help = [
        "A beam held at one end",
        "Two beams joined end to end, free otherwise",
        "A free beam",
    ];
    words(ASSEMBLIES, help)
}

pub(super) fn window() -> impl TypedValueParser<Value = WindowKind> {
    let help = [
        "No window",
        "For steady signals, not for taps",
        "A decaying window, for taps that ring longer than the block",
    ];
    words(WINDOWS, help)
}

pub(super) fn reading() -> impl TypedValueParser<Value = ReadBy> {
    let help = [
        "Fit the decay of the taps, with a standard deviation",
        "Interpolate between the spectral lines about each peak",
        "Take the highest spectral line, with the half-line bound",
    ];
    words(READINGS, help)
}

pub(super) fn sensor_kind() -> impl TypedValueParser<Value = SensorKind> {
    let help = [
        "Accelerometer, m/s2",
        "Velocity, m/s",
        "Displacement, m",
        "Microphone, Pa",
    ];
    words(SENSOR_KINDS, help)
}

pub(super) fn response_form() -> impl TypedValueParser<Value = ResponseForm> {
    let help = [
        "Acceleration per force, (m/s2)/N",
        "Velocity per force, (m/s)/N",
        "Displacement per force, m/N",
    ];
    words(FORMS, help)
}

pub(super) fn estimator() -> impl TypedValueParser<Value = FrfEstimator> {
    let estimators = [
        ("h1", FrfEstimator::H1),
        ("h2", FrfEstimator::H2),
        ("hv", FrfEstimator::Hv),
    ];
    let help = [
        "Gfx/Gff: correct if only the response is noisy",
        "Gxx/Gxf: correct if only the force is noisy",
        "Total least squares: between the two",
    ];
    words(estimators, help)
}

const PAIRS_HELP: &str =
    "Only the multi-linear regression over pairs of modes (Euler beam, without sensor masses)";

pub(super) fn method() -> impl TypedValueParser<Value = EstimateMethod> {
    let methods = EstimateMethod::ALL.map(|method| (method.name(), method));
    let help = [
        "Least squares on the frequencies; the pair regression is shown beside it",
        PAIRS_HELP,
    ];
    words(methods, help)
}

/// Returns the parser of a choice of estimates to perturb. The last of them is the main estimate.
pub(super) fn perturbed_methods() -> impl TypedValueParser<Value = &'static [EstimateMethod]> {
    use EstimateMethod::{Consistent, Pairs};
    let methods: [(_, &'static [_]); 3] = [
        ("both", &[Pairs, Consistent]),
        ("consistent", &[Consistent]),
        ("pairs", &[Pairs]),
    ];
    let help = [
        "Both estimates, side by side",
        "Only the least squares on the frequencies",
        PAIRS_HELP,
    ];
    words(methods, help)
}

/// Returns the settings that estimate and perturb by these methods.
pub(super) fn perturbed_by(methods: &[EstimateMethod]) -> IdentifySettings {
    IdentifySettings {
        method: methods.last().copied().unwrap_or_default(),
        perturbed: methods.to_vec(),
        ..IdentifySettings::default()
    }
}
