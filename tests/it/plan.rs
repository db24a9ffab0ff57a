//! Plans of lap joints and free beams: what a test of them could tell apart.

use crate::shared::strip_table;
use tapjoint::description::TestDescription;
use tapjoint::effects::{EffectId, Group, Place};
use tapjoint::gap::Verdict;
use tapjoint::pipeline::nominal_with;
use tapjoint::report::blind_check::tell_apart;
use tapjoint::structure::specimen::{Joint, Mesh};
use tapjoint::study::blind_check::{Case, Class, Planted};
use tapjoint::study::plan::{PlanSettings, judge_plan};

/// A joint of this kind, a sensor of unknown mass that is moved once.
fn described(joint: &str) -> TestDescription {
    let rest = concat!(
        "[hammer]\nchannel = 1\n",
        "[[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.03\n",
        "[[recording]]\nfile = \"a.wav\"\ntap = 0.4\n",
        "[[recording]]\nfile = \"b.wav\"\ntap = 0.4\nat = { A = 0.33 }\n",
    );
    let text = format!("{}[joint]\n{joint}{rest}", strip_table!());
    TestDescription::parse(&text, "test.toml").unwrap()
}

/// One test for each kind of effect, and one of none.
fn judged(test: &TestDescription) -> Vec<Case> {
    let settings = PlanSettings {
        draws: 1,
        modes: 5,
        seed: 101,
        ..PlanSettings::default()
    };
    judge_plan(test, &settings, &|_, _| ()).unwrap()
}

fn groups(cases: &[Case]) -> Vec<Group> {
    let planted = cases.iter().flat_map(|(truth, _)| &truth.effects);
    let group = |planted: &Planted| match planted {
        Planted::Catalogue(id, _) => Some(id.group()),
        Planted::OutOfCatalogue(_) => None,
    };
    planted.filter_map(group).collect()
}

/// What no structure of this kind can have: neither drawn nor answered nor in the table.
fn assert_never(cases: &[Case], impossible: &[Group]) {
    let drawn = groups(cases);
    let table = tell_apart(cases);
    for group in impossible {
        assert!(!drawn.contains(group), "{group:?} was drawn");
        assert!(!table.contains(group.name()), "{}: {table}", group.name());
        for (truth, answer) in cases {
            let odds = answer.classes.get(&Class::Group(*group));
            assert!(odds.is_none(), "{}: {group:?} {odds:?}", truth.name);
        }
    }
}

/// Every test was answered.
fn assert_answered(cases: &[Case]) {
    for (truth, answer) in cases {
        let total: f64 = answer.classes.values().sum();
        assert!((total - 1.0).abs() < 1e-6, "{}: {total}", truth.name);
    }
    let (_, nothing) = cases.last().unwrap();
    assert!(!matches!(nothing.verdict, Some(Verdict::Named(_))));
}

/// Half of what shows, at least, came back as the right kind.
fn assert_told_apart(cases: &[Case]) {
    let odds = |(truth, answer): &Case| {
        let own = Class::Group(groups(&[(truth.clone(), answer.clone())])[0]);
        answer.classes.get(&own).copied().unwrap_or(0.0)
    };
    let shown = cases
        .iter()
        .filter(|(truth, _)| truth.detectable == Some(true));
    let odds: Vec<f64> = shown.map(odds).collect();
    let first = odds.iter().filter(|odds| **odds > 0.5).count();
    assert!(2 * first >= odds.len(), "{odds:?}");
}

#[test]
fn regress_a_free_beam_has_no_joint_to_tell_of() {
    let cases = judged(&described("kind = \"free\"\n"));
    assert_never(
        &cases,
        &[
            Group::Own(EffectId::CrossCoupling),
            Group::Own(EffectId::JointMass),
            Group::Own(EffectId::JointNonlinearity),
            Group::Own(EffectId::JointDamping),
            Group::Own(EffectId::Fixture),
        ],
    );
    assert!(groups(&cases).contains(&Group::Own(EffectId::SensorCable)));
    assert!(!groups(&cases).contains(&EffectId::AxialLoad.group()));
    for (truth, answer) in &cases {
        let joint = answer
            .places
            .iter()
            .filter(|(place, _)| matches!(place, Some(Place::Joint | Place::Fixture)));
        let odds: f64 = joint.map(|(_, odds)| odds).sum();
        assert!(odds == 0.0, "{}: {odds}", truth.name);
    }
    assert_answered(&cases);
    assert_told_apart(&cases);
}

#[test]
fn regress_a_lap_joint_is_planned_with_cables_and_masses() {
    let cases = judged(&described("kind = \"lap\"\n"));
    assert_never(
        &cases,
        &[
            Group::Own(EffectId::CrossCoupling),
            Group::Own(EffectId::Fixture),
        ],
    );
    let drawn = groups(&cases);
    assert!(!drawn.contains(&EffectId::AxialLoad.group()), "{drawn:?}");
    for group in [
        Group::Own(EffectId::SensorCable),
        Group::Own(EffectId::JointMass),
        Group::Own(EffectId::JointNonlinearity),
    ] {
        assert!(drawn.contains(&group), "{drawn:?}");
    }
    assert_answered(&cases);
}

#[test]
fn regress_a_described_coupling_beside_usual_stiffnesses_is_a_joint_that_can_be() {
    // With the usual Kt and Kr the coupling would be 8, but no joint was described.
    for (joint, expected) in [
        ("ktr = 6000\n", 0.95),
        ("ktr = -6000\n", -0.95),
        ("ktr = 6000\nkt = 1e6\n", 0.95),
        // Described whole it is taken as it is: sqrt(1e6 * 400)/4e4.
        ("ktr = 4e4\nkt = 1e6\nkr = 400\n", 0.5),
    ] {
        let test = described(&format!("kind = \"cantilever\"\nmodel = \"3p\"\n{joint}"));
        let specimen = nominal_with(&test, None).specimen;
        let Some(Joint { coupling, .. }) = specimen.joint else {
            panic!("{joint}: {:?}", specimen.joint);
        };
        // Square roots and a quotient.
        assert!((coupling - expected).abs() < 1e-12, "{joint}: {coupling}");
        assert!(specimen.modes(3, Mesh::SIMULATION).is_ok(), "{joint}");
    }
}
