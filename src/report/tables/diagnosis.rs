//! Tables of the diagnosis: what may be missing in the model, and what to do next.

use std::collections::BTreeSet;

use super::{Table, number, page_number, page_words, words};
use crate::document::{Baseline, Document, GapSection};
use crate::format::{MISSING, or_missing, probability, significant};
use crate::words::diagnosis::{
    EQUALLY_LIKELY, LEAST_PROBABILITY, confirms, gain, names, not_predicted, together,
};
use crate::words::sizes::{left, percent, sizes, unit_of};
use tapjoint_beam::effects::EffectId;
use tapjoint_diagnosis::{Hypothesis, Verdict};

/// At least so many hypotheses are listed.
const LEAST_LISTED: usize = 4;

/// The hypotheses, the most probable first; `None` without a diagnosis.
pub fn hypotheses(document: &Document) -> Option<Table> {
    let gap = document.gap.as_ref()?;
    if gap.hypotheses.is_empty() {
        return None;
    }
    let mut rows = Vec::new();
    for (index, found) in gap.hypotheses.iter().enumerate() {
        let effects = match &found.hypothesis {
            Hypothesis::Effects(effects) => effects.len(),
            _ => 0,
        };
        if index >= LEAST_LISTED && found.probability < LEAST_PROBABILITY && effects > 0 {
            continue;
        }
        // The size of a single effect from which these readings would tell it from every other.
        let told_apart = found.parameters.iter().find_map(|parameter| {
            let (unit, factor) = unit_of(parameter);
            let least = factor * parameter.smallest_separable?;
            Some(format!("{}{unit}", significant(least, 2)))
        });
        rows.push([
            words("Hypothesis", together(&found.hypothesis)),
            number("Probability", probability(found.probability)),
            number("Fitted (%)", left(found.gap_after, gap.noise_floor)),
            number("Withheld (%)", left(found.holdout_after, gap.noise_floor)),
            words("Size", sizes(found)),
            page_words(
                "Told apart from",
                or_missing(told_apart.filter(|_| effects < 2)),
            ),
            page_words("Looks like", looks_like(&found.confounded_with)),
        ]);
    }
    Some(Table::of("What may be missing", rows, note(document, gap)))
}

/// Explains the columns. Also says why even the hypothesis `none` mostly leaves smaller errors than the described
/// model, and why the errors differ from those of the estimate.
fn note(document: &Document, gap: &GapSection) -> String {
    let described = percent(gap.hypotheses[0].gap_before);
    let withheld = gap.hypotheses[0].holdout_before;
    let withheld = withheld.map_or_else(String::new, |before| {
        format!(" and {} %", significant(before, 2))
    });
    let residuals = gap.place.iter().flat_map(|place| &place.modes);
    let recordings: BTreeSet<&str> = residuals.map(|one| one.recording.as_str()).collect();
    let (one_joint, drift) = match !document.has_joint() || recordings.len() < 2 {
        true => ("", ""),
        false => (
            "It has one joint for all recordings. ",
            "joint and temperature differ a little between recordings, and ",
        ),
    };
    let part = gap
        .fitted_modes
        .map_or_else(String::new, |last| format!(" (modes up to {last})"));
    let mut note = format!(
        "Fitted, withheld: rms errors that are left at the frequencies that were fitted, and at those withheld from the \
         fit. The described model leaves {described} %{withheld}. {one_joint}Its beam and masses are exactly as \
         described. Every hypothesis, also none, lets {drift}the beam's properties, masses and the inertia of sensors move within \
         their uncertainty. So it usually leaves less. The fit weighs each reading by its uncertainty and lets the model miss \
         each mode by 0.05 %, so a plain rms may also be larger. The errors are those of the diagnosis{part}. The estimate uses all modes and can leave other errors. Size \
         \u{b1} half the 95 % interval."
    );
    if let Some(scale) = gap.baselines.iter().find(|one| one.name == Baseline::Scale) {
        let withheld = scale.holdout_after.map_or_else(String::new, |after| {
            let after = left(Some(after), gap.noise_floor);
            format!(", of the withheld ones {after} %")
        });
        note.push_str(&format!(
            " For comparison: one unnamed factor on all frequencies leaves an error of {} % (rms){withheld}.",
            left(scale.gap_after, gap.noise_floor)
        ));
    }
    note
}

/// Hypotheses named among those that cannot be told from one; report.json has them all.
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

/// Tests that would tell more; `None` where none would.
pub fn next_tests(document: &Document) -> Option<Table> {
    let gap = document.gap.as_ref()?;
    let premise = match gap.verdict {
        Verdict::Unknown => EQUALLY_LIKELY,
        _ => "with the probabilities above",
    };
    let rows = gap.next_test.iter().map(|test| {
        let unpredicted = not_predicted(test, "; could not be predicted for ");
        let (gain, information) = match confirms(test) {
            true => ("confirmed or not", MISSING.to_owned()),
            false => (gain(test), format!("{:.2}", test.expected_information)),
        };
        [
            words("Test", test.action.clone() + &unpredicted),
            number("Time (min)", format!("{:.0}", test.minutes())),
            words("Tells", gain),
            page_words("Tells apart", test.separates.join(", ")),
            page_number("Information (bit)", information),
        ]
    });
    let note = format!(
        "Time: an estimate for one beam with its set-up at hand. What it tells follows from the least information that is \
         expected, {premise}. One bit decides between two equally probable causes. The test that tells most for its time \
         stands first."
    );
    (!gap.next_test.is_empty()).then(|| Table::of("What to do next", rows, note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_a_few_of_many_likenesses_are_named() {
        let all = &EffectId::ALL[8..15];
        assert_eq!(looks_like(&all[..0]), "");
        let five = "fixture, modulus, length, density, thickness";
        assert_eq!(looks_like(&all[..5]), five);
        let seven = "fixture, modulus, length, density and 3 more";
        assert_eq!(looks_like(all), seven);
    }
}
