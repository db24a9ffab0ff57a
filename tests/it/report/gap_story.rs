//! Sentences of the diagnosis, by verdict: each snapshot holds all that a test's documents lead to.

use tapjoint::effects::EffectId;
use tapjoint::gap::{
    AmplitudeDependence, FrequencyChange, Hypothesis, HypothesisResult, JointShift,
    LocationProbabilities, NextTest, ParameterValue, Proposal, Residual, Verdict,
};
use tapjoint::report::document::{
    Baseline, BaselineSection, Conditions, Document, GapPlaceSection, GapSection, RecordingSection,
    TestSection,
};
use tapjoint::report::tables::{hypotheses, next_tests};
use tapjoint::report::words::diagnosis::{gap_in_short, gap_story};
use tapjoint::report::{MOST_LINES, Screen, render_answer, render_text};
use tapjoint::structure::Assembly;

use crate::golden::assert_snapshot;

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

/// A loss factor of the joint of 2 %.
fn loss(std: Option<f64>) -> ParameterValue {
    ParameterValue {
        effect: EffectId::JointDamping,
        name: "ratio",
        value: 0.02,
        std,
        smallest_detectable: None,
        smallest_separable: None,
    }
}

/// A gap with this verdict, led by an effect, with a test to make and a softer recording that fits worst.
fn gap_with(verdict: Verdict) -> Document {
    let found = |hypothesis: Hypothesis, probability: f64, shift: f64| HypothesisResult {
        hypothesis,
        probability,
        gap_before: Some(2.0),
        gap_after: Some(0.05),
        joint_shift: JointShift {
            kx_percent: Some(shift),
            ky_percent: None,
        },
        ..HypothesisResult::default()
    };
    let mut leader = found(damping(), 0.614, -3.0);
    leader.parameters = vec![loss(Some(0.0034))];
    let gap = GapSection {
        verdict,
        hypotheses: vec![leader, found(Hypothesis::None, 0.277, 0.0)],
        place: Some(GapPlaceSection {
            modes: vec![Residual {
                mode: 4,
                recording: "high.wav".into(),
                level: Some(0.73),
                error_percent: -0.962,
                z: -9.0,
                ..Residual::default()
            }],
            probability: LocationProbabilities {
                joint: 0.614,
                unknown: 0.109,
                ..LocationProbabilities::default()
            },
            worst_block: None,
        }),
        noise_floor: Some(0.01),
        next_test: vec![NextTest {
            proposal: Proposal::WeighSensor,
            action: "weigh the sensor".into(),
            separates: vec!["joint-damping".into(), "none".into()],
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

/// Adds the sentences of a document to a text: the story and the short answer.
fn tell(text: &mut String, title: &str, document: &Document) {
    text.push_str(&format!("## {title}\n"));
    for line in gap_story(document) {
        text.push_str(&format!("- {}\n", line.replace('\u{a0}', " ")));
    }
    for line in gap_in_short(document) {
        text.push_str(&format!("- in short: {}\n", line.replace('\u{a0}', " ")));
    }
}

/// A test of this kind of structure.
fn of_kind(kind: Assembly) -> Option<TestSection> {
    Some(TestSection {
        kind: Some(kind),
        ..TestSection::default()
    })
}

#[test]
fn frozen_story_of_each_verdict() {
    let mut text = String::new();
    for (title, verdict) in [
        ("named", named()),
        ("a set", undecided()),
        (
            "unknown: nothing shrinks, the information has a premise",
            Verdict::Unknown,
        ),
        (
            "no gap: the leader of the table is explained",
            Verdict::NoGap,
        ),
        (
            "too few data",
            Verdict::NotEnoughData("too few data".into()),
        ),
    ] {
        tell(&mut text, title, &gap_with(verdict));
    }
    let mut document = gap_with(Verdict::NoGap);
    document.gap.as_mut().unwrap().hypotheses.reverse();
    tell(&mut text, "no gap, and no effect leads", &document);
    let mut document = gap_with(Verdict::NotEnoughData("too few data".into()));
    document.gap.as_mut().unwrap().hypotheses[1].probability = 0.01;
    tell(&mut text, "too few data, none improbable", &document);
    document.test = of_kind(Assembly::Free);
    tell(
        &mut text,
        "the same of a free beam: no joint is refitted",
        &document,
    );
    assert_snapshot("story_verdicts", &text);
}

#[test]
fn frozen_story_of_a_group_and_of_its_members() {
    use EffectId::{Length, Modulus, Timebase};
    let member = |hypothesis: Hypothesis, probability: f64| HypothesisResult {
        hypothesis,
        probability,
        gap_before: Some(2.0),
        gap_after: Some(0.05),
        ..HypothesisResult::default()
    };
    let effect = |effect: EffectId| Hypothesis::Effects(vec![effect]);
    let mut document = gap_with(Verdict::Group(vec![Length, Modulus, Timebase]));
    document.gap.as_mut().unwrap().hypotheses = vec![
        member(effect(Modulus), 0.4),
        member(effect(Length), 0.35),
        member(effect(Timebase), 0.2),
        member(Hypothesis::None, 0.05),
    ];
    let mut text = String::new();
    tell(
        &mut text,
        "the group has the odds of all its members",
        &document,
    );
    document.gap.as_mut().unwrap().verdict = Verdict::Named(vec![Length]);
    tell(&mut text, "a member has its own", &document);
    assert_snapshot("story_group", &text);
}

#[test]
fn frozen_story_of_what_two_local_changes_explain() {
    let mut text = String::new();
    for (title, goodness) in [("they fit", 0.9), ("not even they fit", 1e-4)] {
        let mut document = gap_with(Verdict::Unknown);
        let gap = document.gap.as_mut().unwrap();
        let two = vec![EffectId::AddedMass, EffectId::LocalCrack];
        gap.hypotheses[0].hypothesis = Hypothesis::Effects(two);
        gap.hypotheses[0].goodness_of_fit = Some(goodness);
        tell(&mut text, title, &document);
    }
    assert_snapshot("story_two_local_changes", &text);
}

#[test]
fn frozen_story_of_no_gap_beside_a_misfit() {
    let mut text = String::new();
    for goodness in [0.005, 0.2] {
        let mut document = gap_with(Verdict::NoGap);
        document.gap.as_mut().unwrap().hypotheses[1].goodness_of_fit = Some(goodness);
        tell(&mut text, &format!("goodness of fit {goodness}"), &document);
    }
    // A joint that has moved is said where nothing is missing.
    for after in [0.02, 1.5] {
        let mut document = gap_with(Verdict::NoGap);
        let gap = document.gap.as_mut().unwrap();
        gap.noise_floor = Some(0.01);
        gap.hypotheses[1].gap_after = Some(after);
        tell(
            &mut text,
            &format!("without an effect {after} % are left"),
            &document,
        );
    }
    assert_snapshot("story_no_gap", &text);
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
        (size_of("mass", 0.024, Some(0.000_62)), "mass 24.0 ± 1.2 g."),
        (size_of("ratio", 4.34e-19, Some(0.15)), "ratio 0 ± 29 %."),
        (size_of("ratio", 4.34e-19, None), "ratio 0 %."),
        (size_of("mass", 0.0241, None), "mass 24.1 g."),
        (
            size_of("compliance", 0.0414, Some(0.0035)),
            "compliance 0.0414 ± 0.0069 L/EI.",
        ),
    ];
    for (said, wanted) in cases {
        assert_eq!(said, wanted);
    }
}

#[test]
fn frozen_story_with_a_joint_and_a_sensor() {
    let mut text = String::new();
    let mut document = gap_with(named());
    let sensor = RecordingSection {
        conditions: Conditions {
            sensor_positions: [("A".to_owned(), 0.338)].into(),
            ..Conditions::default()
        },
        ..RecordingSection::default()
    };
    document.recordings = Some(vec![sensor.clone(), sensor]);
    let gap = document.gap.as_mut().unwrap();
    gap.hypotheses[0].joint = Some([1.9954e6, 1222.6]);
    gap.hypotheses[0].joint_shift.kx_percent = Some(11.46);
    gap.place.as_mut().unwrap().probability = LocationProbabilities {
        sensor: 0.997,
        ..LocationProbabilities::default()
    };
    tell(&mut text, "one sensor that stays", &document);
    let recordings = document.recordings.as_mut().unwrap();
    recordings[1].conditions.sensor_positions = [("A".to_owned(), 0.2)].into();
    tell(&mut text, "the sensor was moved", &document);
    // All digits are those that the interval supports.
    let mut document = gap_with(named());
    let gap = document.gap.as_mut().unwrap();
    gap.hypotheses[0].joint = Some([1.9954e6, f64::INFINITY]);
    gap.hypotheses[0].joint_intervals = [Some([1.9906e6, 2.0001e6]), None];
    tell(
        &mut text,
        "a joint with an interval, rigid in rotation",
        &document,
    );
    assert_snapshot("story_joint_and_sensor", &text);
}

#[test]
fn frozen_story_of_a_change_along_the_decay() {
    let mut text = String::new();
    for at_bound in [true, false] {
        let mut document = gap_with(Verdict::Unknown);
        document.gap.as_mut().unwrap().along_decays = Some(AmplitudeDependence {
            effect: Some(EffectId::JointNonlinearity),
            lawful: true,
            ratio: -0.7,
            ratio_std: 0.01,
            at_bound,
            changes: vec![FrequencyChange {
                mode: 1,
                recording: "high.wav".into(),
                percent_per_fold: -0.2,
                std: 0.1,
                ..FrequencyChange::default()
            }],
            ..AmplitudeDependence::default()
        });
        tell(&mut text, &format!("at the bound: {at_bound}"), &document);
    }
    for enough in [false, true] {
        let mut document = gap_with(Verdict::Unknown);
        document.gap.as_mut().unwrap().along_decays = Some(AmplitudeDependence {
            enough,
            changes: vec![FrequencyChange {
                mode: 1,
                recording: "high.wav".into(),
                percent_per_fold: -0.2,
                std: 0.1,
                ..FrequencyChange::default()
            }],
            ..AmplitudeDependence::default()
        });
        tell(
            &mut text,
            &format!("no law, enough frequencies: {enough}"),
            &document,
        );
    }
    assert_snapshot("story_decay", &text);
}

#[test]
fn frozen_story_of_what_drift_explains() {
    let mut text = String::new();
    let mut document = gap_with(undecided());
    document.test = of_kind(Assembly::Free);
    tell(&mut text, "a free beam: the tolerances alone", &document);
    let mut document = gap_with(undecided());
    let gap = document.gap.as_mut().unwrap();
    gap.hypotheses[1].gap_after = Some(1.5);
    tell(
        &mut text,
        "less than half of the gap: not mentioned",
        &document,
    );
    assert_snapshot("story_drift", &text);
}

#[test]
fn frozen_notes_below_the_tables() {
    let mut text = String::new();
    let mut add = |title: &str, document: &Document| {
        let tables = [hypotheses(document), next_tests(document)];
        let notes = tables.into_iter().flatten().map(|table| table.note);
        text.push_str(&format!(
            "## {title}\n{}\n",
            notes.collect::<Vec<_>>().join("\n")
        ));
    };
    add("an unknown cause", &gap_with(Verdict::Unknown));
    let mut document = gap_with(undecided());
    add("a set, one recording", &document);
    let gap = document.gap.as_mut().unwrap();
    gap.fitted_modes = Some(5);
    let pulls = &mut gap.place.as_mut().unwrap().modes;
    pulls.push(Residual {
        recording: "low.wav".into(),
        ..pulls[0].clone()
    });
    add("a set, two recordings", &document);
    assert_snapshot("story_notes", &text);
}

#[test]
fn frozen_terminal_of_a_diagnosis() {
    assert_snapshot(
        "story_terminal",
        &render_text(&gap_with(undecided()), Screen::default()),
    );
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

#[test]
fn limit_the_state_follows_the_verdict() {
    let state = |verdict: Verdict| {
        let answer = render_answer(&gap_with(verdict), None, MOST_LINES, Screen::default());
        let first = answer.lines().next().unwrap_or_default();
        first.split_once(": ").unwrap().1.to_owned()
    };
    let undecided_too = "doubtful, these data do not show whether something is missing";
    let missing = "doubtful, something is missing in the description";
    let named = Verdict::Named(vec![EffectId::JointDamping]);
    assert_eq!(state(Verdict::NoGap), "good");
    assert_eq!(state(named), missing);
    // Nothing is one of the possible causes.
    assert_eq!(state(undecided()), undecided_too);
    assert_eq!(
        state(Verdict::Set(vec![damping(), Hypothesis::Unknown])),
        missing
    );
    let unknown = "no answer, something is missing that the catalogue does not have";
    assert_eq!(state(Verdict::Unknown), unknown);
    let reason = "two modes are needed".to_owned();
    assert_eq!(state(Verdict::NotEnoughData(reason)), undecided_too);
}
