//! The fixture's own resonance: a peak that belongs to no mode of the beam.

use crate::shared::{five_recordings, strip_on_springs};
use tapjoint::effects::{Circumstances, Effect, EffectId, apply};
use tapjoint::gap::{
    Diagnosis, GapSettings, Hypothesis, HypothesisResult, Nominal, Verdict, diagnose, observe,
};
use tapjoint::identify::observation::{ExtraPeak, Observations};
use tapjoint::structure::specimen::Mesh;

fn nominal(off: f64) -> Nominal {
    strip_on_springs(off, Some(0.0113))
}

fn fixture(frequency: f64, ratio: f64) -> Effect {
    let pairs = [("frequency", frequency), ("ratio", ratio)];
    Effect::from_pairs(EffectId::Fixture, &pairs).unwrap()
}

fn observed(effects: &[Effect], seed: u64) -> Observations {
    observe(&five_recordings(), &nominal(1.0), effects, seed).unwrap()
}

fn diagnosed(observed: &Observations) -> Diagnosis {
    diagnose(observed, &nominal(0.8), &GapSettings::default()).unwrap()
}

fn of_fixture(diagnosis: &Diagnosis) -> &HypothesisResult {
    let fixture = Hypothesis::Effects(vec![EffectId::Fixture]);
    let mut all = diagnosis.hypotheses.iter();
    all.find(|one| one.hypothesis == fixture).unwrap()
}

fn add_peak(observed: &mut Observations, frequency: f64, constant: Option<f64>) {
    for configuration in &mut observed.configurations {
        configuration.extra_peaks.push(ExtraPeak {
            frequency,
            std: Some(1e-4 * frequency),
            level_db: None,
            constant,
            label: "unpaired".to_owned(),
        });
    }
}

const NAMED: [EffectId; 1] = [EffectId::Fixture];

#[test]
fn recover_a_fixture_by_its_own_peak() {
    // Between the beam's modes at 11, 105, 322 Hz, where all recordings show it.
    for (seed, frequency) in [(3, 80.0), (4, 125.0), (5, 290.0)] {
        let diagnosis = diagnosed(&observed(&[fixture(frequency, 0.06)], seed));
        assert_eq!(diagnosis.verdict, Verdict::Named(NAMED.to_vec()));
        let parameters = &of_fixture(&diagnosis).parameters;
        let found = parameters.iter().find(|p| p.name == "frequency").unwrap();
        let std = found.std.unwrap();
        // The peak states it to 0.1 %; four standard uncertainties are missed once in 16 000.
        assert!(std < 0.002 * frequency, "{found:?}");
        assert!((found.value - frequency).abs() < 4.0 * std, "{found:?}");
    }
}

fn mass(grams: f64, position: f64) -> Effect {
    let pairs = [("mass", 1e-3 * grams), ("position", position)];
    Effect::from_pairs(EffectId::AddedMass, &pairs).unwrap()
}

#[test]
fn recover_a_fixture_that_a_peak_shows_beside_a_mass() {
    let tests = [(290.0, 0.06, 25.0, 0.21, 9), (80.0, 0.1, 8.0, 0.3, 10)];
    for (frequency, ratio, grams, position, seed) in tests {
        let truth = [fixture(frequency, ratio), mass(grams, position)];
        // Named, or the only effects on a list beside something unknown: all pairs share the prior of one group.
        let verdict = diagnosed(&observed(&truth, seed)).verdict;
        let mut listed = verdict.hypotheses();
        listed.retain(|one| *one != Hypothesis::Unknown);
        let [Hypothesis::Effects(effects)] = &mut listed[..] else {
            panic!("{frequency} Hz: {verdict:?}");
        };
        effects.sort();
        assert_eq!(effects[..], [EffectId::Fixture, EffectId::AddedMass]);
    }
}

#[test]
fn limit_a_fixture_that_ought_to_be_seen_and_is_not_gets_no_name() {
    let mut observed = observed(&[fixture(90.0, 0.06)], 4);
    let with = diagnosed(&observed);
    for configuration in &mut observed.configurations {
        assert_eq!(configuration.extra_peaks.len(), 1);
        configuration.extra_peaks.clear();
    }
    let without = diagnosed(&observed);
    assert_ne!(without.verdict, Verdict::Named(NAMED.to_vec()));
    let [with, without] = [&with, &without].map(|one| of_fixture(one).log_bayes_factor.unwrap());
    // 23 dB under the beam's own, by finite elements written apart: 3.4 standard deviations over what half the
    // peaks are read at, a factor of 3000; a third of its logarithm is asked for.
    assert!(without < with - 3.0, "{without} {with}");
}

#[test]
fn limit_peaks_elsewhere_or_of_another_strength_are_not_the_fixtures() {
    let truth = observed(&[fixture(90.0, 0.06)], 4);
    let read = &truth.configurations[0].extra_peaks[0];
    for (frequency, stronger) in [(1.3, 1.0), (1.0, 20.0), (1.0, 0.05)] {
        let mut moved = truth.clone();
        for peak in moved
            .configurations
            .iter_mut()
            .flat_map(|one| &mut one.extra_peaks)
        {
            peak.frequency *= frequency;
            peak.constant = peak.constant.map(|constant| constant * stronger);
        }
        let diagnosis = diagnosed(&moved);
        let verdict = &diagnosis.verdict;
        assert_ne!(*verdict, Verdict::Named(NAMED.to_vec()), "{read:?}");
    }
}

#[test]
fn limit_peaks_of_nobody_leave_the_other_hypotheses_alone() {
    let plain = observed(&[], 7);
    let mut twisted = plain.clone();
    add_peak(&mut twisted, 431.7, Some(0.4));
    add_peak(&mut twisted, 1290.0, None);
    let [plain, twisted] = [plain, twisted].map(|observed| diagnosed(&observed));
    assert_eq!(plain.verdict, Verdict::NoGap);
    assert_eq!(twisted.verdict, Verdict::NoGap);
    for one in &plain.hypotheses {
        let mut all = twisted.hypotheses.iter();
        let other = all.find(|other| other.hypothesis == one.hypothesis);
        let away = other.unwrap().log_bayes_factor.unwrap() - one.log_bayes_factor.unwrap();
        if one.hypothesis == of_fixture(&plain).hypothesis {
            // A peak may be a fixture's: a factor of 20 at most where the shifts say nothing of it.
            assert!(away < 3.0, "{away}");
        } else {
            assert!(away.abs() < 1e-9, "{:?} {away}", one.hypothesis);
        }
    }
}

#[test]
fn limit_a_fixture_above_the_highest_mode_is_judged_by_the_shifts_alone() {
    let plain = observed(&[fixture(1900.0, 0.08)], 9);
    let mut bare = plain.clone();
    for configuration in &mut bare.configurations {
        configuration.extra_peaks.clear();
    }
    let [plain, bare] =
        [plain, bare].map(|observed| of_fixture(&diagnosed(&observed)).log_bayes_factor.unwrap());
    assert!((plain - bare).abs() < 1e-9, "{plain} {bare}");
}

/// d ln f/d ln f_0 of a mode is the fixture's share in its kinetic energy, f_0 being the frequency of the
/// fixture alone: Rayleigh's quotient is stationary, and only the fixture's inertia depends on f_0.
#[test]
fn val_a_fixtures_own_mode_follows_its_frequency_by_its_share_of_energy() {
    let modes = |frequency: f64| {
        let seen = apply(
            &[fixture(frequency, 0.05)],
            &nominal(1.0).specimen,
            &Circumstances::default(),
        );
        let own = seen.specimen.beam_modes(6, Mesh::DIAGNOSIS).unwrap();
        (own.modes, own.fixture.unwrap())
    };
    for frequency in [40.0, 125.0, 300.0, 450.0] {
        let (here, base) = modes(frequency);
        let step: f64 = 1e-4;
        let at = |sign: f64| modes(frequency * (sign * step).exp()).0.frequencies()[base].ln();
        let slope = (at(1.0) - at(-1.0)) / (2.0 * step);
        let share = here.base_participation(base);
        // Central differences err by the square of the step, times what bends near a mode of the beam.
        assert!((slope - share).abs() < 1e-4, "{frequency}: {slope} {share}");
    }
}
