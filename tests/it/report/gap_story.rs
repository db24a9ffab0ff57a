//! What is said of the gap, by verdict.

use tapjoint::effects::EffectId;
use tapjoint::gap::{
    AmplitudeDependence, FrequencyChange, Hypothesis, HypothesisResult, JointShift,
    LocationProbabilities, NextTest, ParameterValue, Proposal, Residual, Verdict,
};
use tapjoint::report::document::{
    Baseline, BaselineSection, Conditions, Document, GapPlaceSection, GapSection, RecordingSection,
    TestSection,
};
use tapjoint::report::render_text;
use tapjoint::report::tables::{hypotheses, next_tests};
use tapjoint::report::words::diagnosis::{gap_in_short, gap_story};
use tapjoint::structure::Assembly;

#[test]
fn val_the_odds_of_a_group_are_those_of_its_members_together() {
    use EffectId::{Length, Modulus, Timebase};
    let member = |hypothesis: Hypothesis, probability: f64| HypothesisResult {
        hypothesis,
        probability,
        ..HypothesisResult::default()
    };
    let effect = |effect: EffectId| Hypothesis::Effects(vec![effect]);
    let mut gap = GapSection {
        verdict: Verdict::Group(vec![Length, Modulus, Timebase]),
        hypotheses: vec![
            member(effect(Modulus), 0.4),
            member(effect(Length), 0.35),
            member(effect(Timebase), 0.2),
            member(Hypothesis::None, 0.05),
        ],
        ..GapSection::default()
    };
    let story = |gap: &GapSection| {
        gap_story(&Document {
            gap: Some(gap.clone()),
            ..Document::default()
        })
    };
    assert!(story(&gap)[0].contains("(95.0 %)"), "{:?}", story(&gap));
    gap.verdict = Verdict::Named(vec![Length]);
    assert!(story(&gap)[0].contains("(35.0 %)"), "{:?}", story(&gap));
}

fn damping() -> Hypothesis {
    Hypothesis::Effects(vec![EffectId::JointDamping])
}

fn named() -> Verdict {
    Verdict::Named(vec![EffectId::JointDamping])
}

/// Two hypotheses that the readings do not tell apart.
fn undecided() -> Verdict {
    Verdict::Set(vec![damping(), Hypothesis::None])
}

/// A gap with this verdict, led by an effect, with a test to make and a softer recording that fits worst.
fn gap_with(verdict: Verdict) -> Document {
    let found = |hypothesis: Hypothesis, probability: f64, shift: f64| HypothesisResult {
        hypothesis,
        probability,
        gap_before: 2.0,
        gap_after: Some(0.05),
        joint_shift: JointShift {
            kx_percent: Some(shift),
            ky_percent: None,
        },
        ..HypothesisResult::default()
    };
    let gap = GapSection {
        verdict,
        hypotheses: vec![
            found(damping(), 0.614, -3.0),
            found(Hypothesis::None, 0.277, 0.0),
        ],
        place: Some(GapPlaceSection {
            modes: vec![Residual {
                mode: 4,
                recording: "high.wav".into(),
                level: Some(0.73),
                error_percent: -0.962,
                z: -9.0,
                ..Residual::default()
            }],
            ..GapPlaceSection::default()
        }),
        next_test: vec![NextTest {
            proposal: Proposal::WeighSensor,
            action: "weigh the sensor".into(),
            separates: Vec::new(),
            unpredicted: Vec::new(),
            expected_information: 3.26,
            effort: 2.0,
        }],
        ..GapSection::default()
    };
    Document {
        gap: Some(gap),
        ..Document::default()
    }
}

#[test]
fn regress_without_a_gap_nothing_is_added_and_the_leader_of_the_table_is_explained() {
    let mut document = gap_with(Verdict::NoGap);
    let story = gap_story(&document).join("\n");
    assert!(!story.contains("Adding it"), "{story}");
    assert!(story.contains("No effect is established"), "{story}");
    if let Some(gap) = &mut document.gap {
        gap.hypotheses.reverse();
    }
    let story = gap_story(&document).join("\n");
    assert!(!story.contains("established"), "none leads: {story}");
}

#[test]
fn regress_an_unknown_gap_is_not_said_to_shrink_and_its_information_has_a_premise() {
    let document = gap_with(Verdict::Unknown);
    let story = gap_story(&document).join("\n");
    assert!(!story.contains("How far"), "{story}");
    assert!(
        story.contains("mode 4 in high.wav (level 0.73), \u{2212}0.962 %"),
        "{story}"
    );
    let premise = "taking the catalogue's effects as equally likely";
    assert!(story.contains(premise), "{story}");
    assert!(next_tests(&document).unwrap().note.contains(premise));
    let decided = gap_with(undecided());
    assert!(!gap_story(&decided).join("\n").contains(premise));
    assert!(!next_tests(&decided).unwrap().note.contains(premise));
}

#[test]
fn regress_what_two_local_changes_explain_is_said_to_be_spread() {
    let mut document = gap_with(Verdict::Unknown);
    let spread = "spread over a part of the beam";
    assert!(!gap_story(&document)[0].contains(spread));
    if let Some(gap) = &mut document.gap {
        let two = vec![EffectId::AddedMass, EffectId::LocalCrack];
        gap.hypotheses[0].hypothesis = Hypothesis::Effects(two);
        gap.hypotheses[0].goodness_of_fit = Some(0.9);
    }
    assert!(gap_story(&document)[0].contains(spread));
    // Where not even these explain the readings they are no likeness.
    if let Some(gap) = &mut document.gap {
        gap.hypotheses[0].goodness_of_fit = Some(1e-4);
    }
    assert!(!gap_story(&document)[0].contains(spread));
}

/// What is said of the size of the effect that is named.
fn size_of(name: &'static str, value: f64, std: Option<f64>) -> String {
    let mut document = gap_with(named());
    if let Some(gap) = &mut document.gap {
        gap.hypotheses[0].parameters = vec![ParameterValue {
            effect: EffectId::JointDamping,
            name,
            value,
            std,
            smallest_detectable: None,
            smallest_separable: None,
        }];
    }
    let said = gap_story(&document).remove(0);
    said.rsplit_once("): ").unwrap().1.to_owned()
}

#[test]
fn regress_digits_of_a_size_follow_its_uncertainty() {
    let cases = [
        (
            size_of("mass", 0.024, Some(0.000_62)),
            "mass 24.00 ± 0.62 g.",
        ),
        (size_of("ratio", 4.34e-19, Some(0.15)), "ratio 0 ± 15 %."),
        (size_of("ratio", 4.34e-19, None), "ratio 0 %."),
        (size_of("mass", 0.0241, None), "mass 24.1 g."),
        (
            size_of("compliance", 0.0414, Some(0.0035)),
            "compliance 0.0414 ± 0.0035 L/EI.",
        ),
    ];
    for (said, wanted) in cases {
        assert_eq!(said, wanted);
    }
}

#[test]
fn regress_the_price_of_an_effect_is_a_stiffness_and_a_sensor_has_a_name() {
    let mut document = gap_with(named());
    let sensor = RecordingSection {
        conditions: Conditions {
            sensor_positions: [("A".to_owned(), 0.338)].into(),
            ..Conditions::default()
        },
        ..RecordingSection::default()
    };
    document.recordings = Some(vec![sensor.clone(), sensor]);
    if let Some(gap) = &mut document.gap {
        gap.hypotheses[0].joint = Some([1.9954e6, 1222.6]);
        gap.hypotheses[0].joint_shift.kx_percent = Some(11.46);
        if let Some(place) = &mut gap.place {
            place.probability = LocationProbabilities {
                sensor: 0.997,
                ..LocationProbabilities::default()
            };
        }
    }
    let story = gap_story(&document).join("\n").replace('\u{a0}', " ");
    assert!(
        story.contains("With it the joint is Kt = 1.995 MN/m, Kr = 1.223 kN m/rad: Kx by +11 %"),
        "{story}"
    );
    assert!(story.contains("sensor (A at 338 mm) 99.7 %"), "{story}");
    if let Some(recordings) = &mut document.recordings {
        recordings[1].conditions.sensor_positions = [("A".to_owned(), 0.2)].into();
    }
    let story = gap_story(&document).join("\n");
    assert!(story.contains("sensor (A, which was moved)"), "{story}");
}

#[test]
fn regress_of_a_free_beam_no_joint_is_said_to_be_refitted() {
    let mut document = gap_with(Verdict::NotEnoughData("too few data".into()));
    if let Some(gap) = &mut document.gap {
        gap.hypotheses[1].probability = 0.01;
    }
    let refitted = "with its joint refitted";
    assert!(gap_story(&document)[0].contains(refitted));
    document.test = Some(TestSection {
        kind: Some(Assembly::Free),
        ..TestSection::default()
    });
    assert!(!gap_story(&document)[0].contains("joint"));
}

#[test]
fn regress_a_change_as_large_as_is_looked_for_is_a_bound() {
    let told = |at_bound: bool| {
        let mut document = gap_with(Verdict::Unknown);
        if let Some(gap) = &mut document.gap {
            gap.along_decays = Some(AmplitudeDependence {
                effect: Some(EffectId::JointNonlinearity),
                lawful: true,
                ratio: -0.7,
                ratio_std: 0.01,
                at_bound,
                changes: vec![FrequencyChange {
                    mode: 1,
                    std: 0.1,
                    ..FrequencyChange::default()
                }],
                ..AmplitudeDependence::default()
            });
        }
        gap_story(&document).join("\n")
    };
    assert!(told(true).contains("by 70 % or more"), "{}", told(true));
    assert!(told(false).contains("\u{b1} 1.0 %"), "{}", told(false));
}

#[test]
fn regress_what_drift_explains_is_said_beside_what_an_effect_does() {
    let mut document = gap_with(undecided());
    let told = |document: &Document| gap_story(document).join(" ");
    let drift = "where a joint that drifts and the tolerances leave 0.050 %";
    assert!(told(&document).contains(drift), "{}", told(&document));
    // The probabilities of places, and a misfit by its uncertainty.
    assert!(told(&document).contains("Where, if something is missing: "));
    let mut free = document.clone();
    free.test = Some(TestSection {
        kind: Some(Assembly::Free),
        ..TestSection::default()
    });
    assert!(
        told(&free).contains("where the tolerances leave 0.050 %"),
        "{}",
        told(&free)
    );
    // Less than half of the gap is not worth a word.
    document.gap.as_mut().unwrap().hypotheses[1].gap_after = Some(1.5);
    assert!(!told(&document).contains("that drifts"));
}

#[test]
fn regress_the_table_says_why_none_leaves_less_than_the_described_model() {
    let mut document = gap_with(undecided());
    let note = |document: &Document| hypotheses(document).unwrap().note;
    // With one recording there is no other for the joint to differ from.
    insta::assert_snapshot!(note(&document), @"Fitted, withheld: rms errors of the frequencies that are left; the described model leaves 2.0 %. In the described model geometry, shear and masses are exactly as described. Every hypothesis, none included, lets these and sensors' inertias move within their uncertainty, and so usually leaves less. The fit weighs each reading by its uncertainty, so a plain rms may also be larger. All are errors of fits to the readings that take part in the diagnosis; the estimate weighs all modes and may leave others. Size \u{b1} one standard deviation.");
    let gap = document.gap.as_mut().unwrap();
    gap.fitted_modes = Some(5);
    let pulls = &mut gap.place.as_mut().unwrap().modes;
    pulls.push(Residual {
        recording: "low.wav".into(),
        ..pulls[0].clone()
    });
    insta::assert_snapshot!(note(&document), @"Fitted, withheld: rms errors of the frequencies that are left; the described model leaves 2.0 %. In the described model there is one joint for all recordings, and geometry, shear and masses are exactly as described. Every hypothesis, none included, lets the joint and the temperature differ a little between recordings (so does the described model on withheld ones), and lets these and sensors' inertias move within their uncertainty, and so usually leaves less. The fit weighs each reading by its uncertainty, so a plain rms may also be larger. All are errors of fits to the readings that take part in the diagnosis (modes up to 5); the estimate weighs all modes and may leave others. Size \u{b1} one standard deviation.");
}

#[test]
fn regress_a_terminal_explains_the_columns_of_the_diagnosis() {
    let said = render_text(&gap_with(undecided()));
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "Ranked by one over the other",
        "Fitted, withheld: rms errors",
    ] {
        assert!(said.contains(part), "{part} is missing in:\n{said}");
    }
}

#[test]
fn regress_no_gap_beside_a_misfit_says_so() {
    let story = |goodness: f64| {
        let mut told = gap_with(Verdict::NoGap);
        let all = told.gap.iter_mut().flat_map(|gap| &mut gap.hypotheses);
        for none in all.filter(|found| found.hypothesis == Hypothesis::None) {
            none.goodness_of_fit = Some(goodness);
        }
        gap_story(&told)[0].clone()
    };
    assert!(
        story(0.005).contains("chance would in 0.5 % of tests"),
        "{}",
        story(0.005)
    );
    assert!(
        story(0.2).contains("within their uncertainty"),
        "{}",
        story(0.2)
    );
}

/// All digits are those that the interval supports, and nothing is said of what is not missing.
#[test]
fn val_the_short_answer_has_the_joint_with_its_interval_and_the_next_test() {
    let said = |verdict: Verdict| {
        let mut document = gap_with(verdict);
        let gap = document.gap.as_mut().unwrap();
        gap.hypotheses[0].joint = Some([1.9954e6, f64::INFINITY]);
        gap.hypotheses[0].joint_intervals = [Some([1.9906e6, 2.0001e6]), None];
        gap_in_short(&document).join("\n").replace('\u{a0}', " ")
    };
    let named = said(named());
    let answer = "With joint-damping the errors of the frequencies shrink from 2.0 to 0.050 % (rms), and the joint is \
                  Kt = 1.9954 MN/m (95 %: 1.9906 to 2.0001), Kr = \u{221e} (rigid).\nTo confirm it: weigh the sensor";
    assert!(named.starts_with(answer), "{named:?}");
    assert_eq!(said(Verdict::NoGap), "");
}

#[test]
fn regress_a_joint_that_has_moved_is_said_where_nothing_is_missing() {
    let told = |after: f64| {
        let mut document = gap_with(Verdict::NoGap);
        let gap = document.gap.as_mut().unwrap();
        gap.noise_floor = Some(0.01);
        gap.hypotheses[1].gap_after = Some(after);
        gap_story(&document).join("\n")
    };
    let moved = "once joint, geometry and masses may differ";
    assert!(told(0.02).contains(moved), "{}", told(0.02));
    assert!(
        told(0.02).contains("exactly as described 2.0 %"),
        "{}",
        told(0.02)
    );
    assert!(!told(1.5).contains(moved), "{}", told(1.5));
}

#[test]
fn regress_a_change_of_one_frequency_alone_is_nobodys() {
    let told = |enough: bool| {
        let mut document = gap_with(Verdict::Unknown);
        document.gap.as_mut().unwrap().along_decays = Some(AmplitudeDependence {
            enough,
            changes: vec![FrequencyChange {
                std: 0.1,
                ..FrequencyChange::default()
            }],
            ..AmplitudeDependence::default()
        });
        gap_story(&document).join("\n")
    };
    assert!(told(false).contains("one frequency alone cannot tell"));
    assert!(told(true).contains("but not as a joint"));
}

#[test]
fn regress_the_table_has_the_size_told_apart_and_the_baseline() {
    let mut document = gap_with(named());
    let gap = document.gap.as_mut().unwrap();
    gap.hypotheses[0].hypothesis = Hypothesis::Effects(vec![EffectId::SensorMass]);
    gap.hypotheses[0].parameters = vec![ParameterValue {
        effect: EffectId::SensorMass,
        name: "mass",
        value: 0.024,
        std: Some(0.001),
        smallest_detectable: None,
        smallest_separable: Some(0.0051),
    }];
    gap.baselines = vec![BaselineSection {
        name: Baseline::Scale,
        gap_after: Some(0.71),
        holdout_after: Some(0.93),
    }];
    let table = hypotheses(&document).unwrap();
    let place = |name: &str| {
        table
            .columns
            .iter()
            .position(|one| one.name == name)
            .unwrap()
    };
    assert_eq!(table.rows[0][place("Told apart from")], "5.1 g");
    assert_eq!(table.rows[1][place("Told apart from")], "\u{2013}");
    let baseline = "leaves an error of 0.71 % (rms), of the withheld ones 0.93 %.";
    assert!(table.note.ends_with(baseline), "{}", table.note);
}
