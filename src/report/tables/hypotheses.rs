//! What may be missing in the model, as a table.

use super::super::document::{Baseline, Document, GapSection};
use super::super::format::{MISSING, probability, rounded, significant};
use super::{Table, has_joint, number, words};
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::{Hypothesis, HypothesisResult, ParameterValue};

/// Hypotheses less probable than this are not listed.
pub(super) const LEAST_PROBABILITY: f64 = 0.005;
/// At least so many hypotheses are listed.
const LEAST_LISTED: usize = 4;
/// What a search leaves of a size at zero, in the unit it is read in: by rounding alone.
const NOTHING: f64 = 1e-9;

/// The hypotheses, the most probable first; `None` without a diagnosis.
pub fn hypotheses(document: &Document) -> Option<Table> {
    let gap = document.gap.as_ref()?;
    if gap.hypotheses.is_empty() {
        return None;
    }
    let listed = gap
        .hypotheses
        .iter()
        .enumerate()
        .filter(|(index, found)| {
            *index < LEAST_LISTED
                || found.probability >= LEAST_PROBABILITY
                || !matches!(found.hypothesis, Hypothesis::Effects(_))
        })
        .map(|(_, found)| row(found, gap.noise_floor));
    Some(Table {
        caption: "What may be missing".to_owned(),
        columns: vec![
            words("Hypothesis"),
            number("Probability"),
            number("Fitted (%)"),
            number("Withheld (%)"),
            words("Size"),
            words("Told apart from").on_page(),
            words("Looks like").on_page(),
        ],
        rows: listed.collect(),
        note: note(document, gap),
    })
}

/// What the columns are, why even the hypothesis that nothing is missing mostly leaves less than the described model,
/// and why the errors are not those of the estimate.
fn note(document: &Document, gap: &GapSection) -> String {
    let described = percent(Some(gap.hypotheses[0].gap_before));
    let withheld = gap.hypotheses[0].holdout_before;
    let withheld = withheld.map_or_else(String::new, |before| {
        format!(" and {} %", significant(before, 2))
    });
    let (one_joint, drift) = match !has_joint(document) || recordings(gap) < 2 {
        true => ("", ""),
        false => (
            "one joint for all recordings and ",
            "lets the joint and the warmth differ a little from recording to recording (so does the described model \
             on withheld ones), and ",
        ),
    };
    let part = gap
        .fitted_modes
        .map_or_else(String::new, |last| format!(" (modes up to {last})"));
    format!(
        "Fitted, withheld: errors of the frequencies left (rms); of the described model {described} %{withheld}. \
         The described model has {one_joint}geometry, shear and masses exactly as described; every hypothesis, none \
         too, {drift}lets these and sensors' inertias move within their uncertainty, and so usually leaves less; the fit \
         weighs each reading by its uncertainty, so that a plain rms may also be larger. All are errors of fits to the \
         readings that take part in the diagnosis{part}; those of the estimate, which weighs all modes, may differ. Size \u{b1} one standard deviation.{}",
        one_factor(gap)
    )
}

/// What the baseline leaves that needs no cause, only a factor.
fn one_factor(gap: &GapSection) -> String {
    let scale = gap.baselines.iter().find(|one| one.name == Baseline::Scale);
    let floor = gap.noise_floor;
    scale.map_or_else(String::new, |scale| {
        let withheld = scale.holdout_after.map_or_else(String::new, |after| {
            format!(", of the withheld ones {} %", left(Some(after), floor))
        });
        format!(
            " For comparison: one unnamed factor on all frequencies leaves an error of {} % (rms){withheld}.",
            left(scale.gap_after, floor)
        )
    })
}

/// How many recordings the diagnosis compares.
fn recordings(gap: &GapSection) -> usize {
    let pulls = gap.place.iter().flat_map(|place| &place.modes);
    let files: std::collections::BTreeSet<&str> =
        pulls.map(|pull| pull.recording.as_str()).collect();
    files.len()
}

fn row(found: &HypothesisResult, floor: Option<f64>) -> Vec<String> {
    vec![
        together(&found.hypothesis),
        probability(found.probability),
        left(found.gap_after, floor),
        left(found.holdout_after, floor),
        sizes(found),
        told_apart(found),
        looks_like(&found.confounded_with),
    ]
}

/// The size of a single effect from which these readings would tell it from every other.
fn told_apart(found: &HypothesisResult) -> String {
    let least = |parameter: &ParameterValue| {
        let (unit, factor) = unit_of(parameter.name);
        let least = factor * parameter.smallest_separable?;
        Some(format!("{}{unit}", significant(least, 2)))
    };
    let is_pair = matches!(&found.hypothesis, Hypothesis::Effects(effects) if effects.len() > 1);
    let mut parameters = found.parameters.iter().filter(|_| !is_pair);
    let least = parameters.find_map(least);
    least.unwrap_or_else(|| MISSING.to_owned())
}

/// How many hypotheses that cannot be told from one are named; report.json has them all.
const NAMED: usize = 4;

/// "timebase, modulus", "timebase, modulus, length, fixture and 9 more".
fn looks_like(effects: &[EffectId]) -> String {
    let named = names(&effects[..effects.len().min(NAMED)]);
    match effects.len().saturating_sub(NAMED) {
        0 => named,
        1 => names(effects),
        more => format!("{named} and {more} more"),
    }
}

/// "timebase, modulus".
pub(super) fn names(effects: &[EffectId]) -> String {
    let names: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
    names.join(", ")
}

/// "local-crack + joint-nonlinearity": both names of two effects, which a line may be broken between.
pub(crate) fn together(hypothesis: &Hypothesis) -> String {
    hypothesis.name().replace('+', " + ")
}

/// "mass 24.10 ± 0.30 g"; of two effects "local-crack: compliance ..., position ...; sensor-mass: mass ...".
pub(super) fn sizes(found: &HypothesisResult) -> String {
    // Of what may be anywhere, and of an inertia of no mass, no digit says anything.
    let is_known = |parameter: &&ParameterValue| match parameter.std {
        None => !is_place(parameter.name),
        Some(std) => parameter.name != "inertia" || std != 0.0,
    };
    let mut sorted: Vec<&ParameterValue> = found.parameters.iter().collect();
    sorted.sort_by_key(|one| (one.effect.name(), one.name));
    let alone = sorted.iter().all(|one| one.effect == sorted[0].effect);
    sorted.retain(is_known);
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

/// Whether a parameter says where an effect sits, at which frequency or after which law, and not how large it is.
fn is_place(name: &str) -> bool {
    matches!(name, "position" | "frequency" | "exponent" | "inertia")
}

fn size(parameter: &ParameterValue) -> String {
    let (unit, factor) = unit_of(parameter.name);
    let value = factor * parameter.value;
    let known = parameter.std.map(|std| factor * std);
    let size = match known.filter(|std| std.is_finite() && *std > 0.0) {
        Some(std) => rounded(value, Some(std)).joined(),
        None if value.abs() < NOTHING => "0".to_owned(),
        None => significant(value, 3),
    };
    format!("{} {size}{unit}", parameter.name.replace('_', " "))
}

/// The unit a parameter is read in, and how many of it one SI unit is.
fn unit_of(name: &str) -> (&'static str, f64) {
    match name {
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
pub(super) fn left(error: Option<f64>, noise: Option<f64>) -> String {
    const FAR_BELOW: f64 = 0.2;
    let least = noise.map(|noise| FAR_BELOW * noise);
    match error.zip(least) {
        Some((error, least)) if error < least => format!("<{}", significant(least, 1)),
        _ => percent(error),
    }
}

/// A value in percent with two digits.
pub(super) fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| MISSING.to_owned(), |value| significant(value, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_an_error_far_below_the_noise_has_no_digits() {
        assert_eq!(left(Some(3.5e-6), Some(0.0052)), "<0.001");
        assert_eq!(left(Some(0.0011), Some(0.0052)), "0.0011");
        assert_eq!(left(Some(3.5e-6), None), "0.0000035");
        assert_eq!(left(None, Some(0.0052)), MISSING);
    }

    #[test]
    fn limit_a_few_of_many_likenesses_are_named() {
        let all = &EffectId::ALL[7..14];
        assert_eq!(looks_like(&all[..0]), "");
        let five = "fixture, modulus, length, timebase, added-mass";
        assert_eq!(looks_like(&all[..5]), five);
        let seven = "fixture, modulus, length, timebase and 3 more";
        assert_eq!(looks_like(all), seven);
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
        assert_eq!(known(0.004, None), "mass 0.0 \u{b1} 1.0 g");
        let somewhere = known(0.004, Some(0.001));
        assert_eq!(
            somewhere,
            "mass 0.0 \u{b1} 1.0 g, position 4.0 \u{b1} 1.0 mm"
        );
        let mass = parameter(EffectId::SensorMass, "mass", 0.024, None);
        assert_eq!(of(vec![mass.clone()]), "mass 24.0 g");
        let crack = parameter(EffectId::LocalCrack, "compliance", 0.01, None);
        let words = "local-crack: compliance 0.0100 L/EI; sensor-mass: mass 24.0 g";
        assert_eq!(of(vec![mass, crack]), words);
    }
}
