//! The tests that a blind check draws, and what their recordings give away.

use std::collections::BTreeSet;
use std::fs;

use assert_cmd::Command;
use tapjoint::description::TestDescription;
use tapjoint::effects::{DescribedSetUp, EffectId, Group, check_set_up};
use tapjoint::study::blind_check::{Campaign, CaseKind, DrawnTest, Extent, GROUPS, commitment};

fn campaign(seed: u64) -> Campaign {
    Campaign {
        singles: GROUPS.len(),
        nulls: 3,
        outside: 5,
        pairs: 3,
        extent: Extent::OneRecording,
        seed,
        ..Campaign::default()
    }
}

#[test]
fn prop_a_campaign_holds_what_was_asked_for() {
    let campaign = campaign(101);
    let (mut counts, mut groups) = ([0; 4], BTreeSet::<Group>::new());
    for index in 0..campaign.len() {
        let test = campaign.draw(index).unwrap();
        let place = match test.truth.kind() {
            CaseKind::Single(effect) => {
                groups.insert(effect.group());
                0
            }
            // A factor within the tolerances counts as nothing.
            CaseKind::Null if test.truth.within_tolerance.is_some() => {
                groups.insert(Group::Scale);
                0
            }
            CaseKind::Null => 1,
            CaseKind::OutOfCatalogue => 2,
            CaseKind::Several => 3,
        };
        counts[place] += 1;
        assert_eq!(test.fastened.is_empty(), place != 2);
        // The joint's drift is always among the effects.
        assert_eq!(test.effects.len(), 1 + test.truth.catalogue().count());
    }
    assert_eq!(counts, [GROUPS.len(), 3, 5, 3]);
    // Effects are dealt out evenly over their groups.
    assert_eq!(groups.len(), GROUPS.len());
}

#[test]
fn prop_a_seed_draws_the_same_test_again_and_another_another() {
    let text = |seed: u64, index: usize| {
        let test = campaign(seed).draw(index).unwrap();
        (test.text, format!("{:?}", test.truth), test.seed)
    };
    assert_eq!(text(101, 4), text(101, 4));
    assert_ne!(text(101, 4).0, text(102, 4).0);
    assert_ne!(text(101, 4).0, text(101, 5).0);
}

/// Tests of five recordings with one effect each, some of every kind.
fn many_singles() -> Vec<DrawnTest> {
    let campaign = Campaign {
        singles: 40 * GROUPS.len(),
        nulls: 0,
        outside: 0,
        pairs: 0,
        extent: Extent::FiveRecordings,
        ..campaign(106)
    };
    (0..campaign.len())
        .map(|index| campaign.draw(index).unwrap())
        .collect()
}

#[test]
fn prop_drawn_errors_of_the_set_up_can_be_and_have_the_sizes_asked_for() {
    let mut seen = BTreeSet::new();
    for test in many_singles() {
        let CaseKind::Single(id) = test.truth.kind() else {
            continue;
        };
        if id.group() != Group::SetUp {
            continue;
        }
        let effect = test.effects.iter().find(|effect| effect.id == id).unwrap();
        let recordings = test.description.recordings.iter();
        let described = recordings.map(|recording| DescribedSetUp {
            length: test.description.beam.length,
            sensors: test
                .description
                .sensors
                .iter()
                .filter_map(|sensor| recording.place_of(sensor))
                .collect(),
            tap: recording.tap.unwrap(),
        });
        let described: Vec<DescribedSetUp> = described.collect();
        check_set_up(&test.effects, &described).unwrap();
        let within = |name: &str, low: f64, high: f64| {
            let size = effect.value(name).unwrap().abs();
            assert!((low..=high).contains(&size), "{effect:?}");
        };
        let sign = match id {
            EffectId::SensorPosition => {
                within("offset", 2e-3, 30e-3);
                effect.value("offset")
            }
            EffectId::TapPosition => {
                within("offset", 5e-3, 40e-3);
                effect.value("offset")
            }
            EffectId::SensorScale => {
                let factor = 1.0 + effect.value("relative").unwrap();
                assert!((1.05f64.ln()..=2f64.ln()).contains(&factor.ln().abs()));
                effect.value("relative")
            }
            _ => None,
        };
        seen.insert((id, sign.map(|size| size > 0.0)));
    }
    // Each of the five; those with a size, either way.
    assert_eq!(seen.len(), 8, "{seen:?}");
}

#[test]
fn val_a_factor_within_two_standard_deviations_of_the_tolerances_is_covered() {
    // WELL_KNOWN: (0.2 %/2)^2 + 0.1 %^2 + (0.1 %/2)^2 + (2 x 0.05 %)^2 = (0.18 %)^2.
    let limit =
        2.0 * (1e-3f64.powi(2) + 1e-3f64.powi(2) + 0.5e-3f64.powi(2) + 1e-3f64.powi(2)).sqrt();
    let (mut covered, mut open) = (0, 0);
    for test in many_singles() {
        let mut planted = test.truth.catalogue();
        let (id, values) = planted.next().unwrap();
        if id.group() != Group::Scale {
            assert_eq!(test.truth.within_tolerance, None);
            continue;
        }
        let change = 1.0 + values["relative"];
        // Frequency over the described one: h/L^2 sqrt(E/rho), and the clock.
        let factor = match id {
            EffectId::Modulus => change.sqrt(),
            EffectId::Density => change.sqrt().recip(),
            EffectId::Length => change.powi(2).recip(),
            _ => change,
        };
        let expected = factor.ln().abs() < limit;
        assert_eq!(
            test.truth.within_tolerance,
            Some(expected),
            "{id:?} {values:?}"
        );
        match expected {
            true => {
                covered += 1;
                assert_eq!(test.truth.kind(), CaseKind::Null);
                assert_eq!(test.with_limits().unwrap().detectable, None);
            }
            false => open += 1,
        }
    }
    assert!(covered > 3 && open > 3, "{covered} {open}");
}

#[test]
fn prop_the_description_gives_neither_joint_nor_effect_away() {
    let campaign = campaign(103);
    let mut all = (0..campaign.len()).map(|index| campaign.draw(index).unwrap());
    let mut outside = all.find(|test| !test.fastened.is_empty()).unwrap();
    let recorded = outside.record().unwrap();
    let read = TestDescription::parse(&recorded.description, "test.toml").unwrap();
    assert_eq!(
        (read.joint.kt, read.joint.kr, read.joint.ktr),
        (None, None, None)
    );
    assert!(
        read.recordings
            .iter()
            .all(|recording| recording.level.is_none())
    );
    for word in ["effect", "fastened", "truth", "kt", "kr"] {
        assert!(!recorded.description.contains(word), "{word}");
    }
    // What is fastened reaches the recording, and the description stays the same without it.
    outside.fastened = Default::default();
    let bare = outside.record().unwrap();
    assert_eq!(bare.description, recorded.description);
    assert_eq!(bare.recordings[0].file, recorded.recordings[0].file);
    assert_ne!(bare.recordings[0].channels, recorded.recordings[0].channels);
}

#[test]
fn limit_what_a_test_can_show_is_said_of_what_was_planted() {
    let campaign = campaign(104);
    let (mut detectable, mut pairs) = (Vec::new(), 0);
    let is_of_the_structure = |test: &DrawnTest| {
        let mut planted = test.truth.catalogue();
        planted.all(|(id, _)| id.group() != Group::SetUp)
    };
    for index in 0..campaign.len() {
        let test = campaign.draw(index).unwrap();
        match test.truth.kind() {
            CaseKind::Single(_) => detectable.extend(test.with_limits().unwrap().detectable),
            CaseKind::Null => {
                let truth = test.with_limits().unwrap();
                assert_eq!((truth.detectable, truth.refutable), (None, None));
            }
            // A pair without an error of the set-up, whose search takes long: one is enough.
            CaseKind::Several if is_of_the_structure(&test) && pairs == 0 => {
                assert!(test.with_limits().unwrap().detectable.is_some());
                pairs += 1;
            }
            CaseKind::OutOfCatalogue | CaseKind::Several => {}
        }
    }
    // A factor within the tolerances is no effect.
    assert!(detectable.len() + 1 >= GROUPS.len(), "{detectable:?}");
    assert_eq!(pairs, 1);
    // One recording shows some, but not all, of a dozen effects from small to large.
    assert!(detectable.contains(&true) && detectable.contains(&false));
}

#[test]
fn prop_kept_tests_are_what_was_sealed_and_score_the_same_again() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("tapjoint").unwrap();
        command.current_dir(folder.path()).args(arguments);
        let output = command.assert().success().get_output().stdout.clone();
        String::from_utf8(output).unwrap()
    };
    let drawn = [
        "blind-check",
        "--one-recording",
        "--cases",
        "1",
        "--seed",
        "105",
    ];
    let first = run(&[&drawn[..], &["--keep", "new/kept"]].concat());
    let truth = fs::read_to_string(folder.path().join("new/kept/truth.json")).unwrap();
    assert!(first.contains(&commitment(&truth)), "{first}");
    let entries = fs::read_dir(folder.path().join("new")).unwrap();
    assert_eq!(entries.count(), 1, "something temporary was left");
    run(&[
        "blind-check",
        "--folder",
        "new/kept",
        "--truth",
        "new/kept/truth.json",
        "--out",
        "again",
    ]);
    let cases = |out: &str| {
        let text = fs::read_to_string(folder.path().join(out).join("cases.csv")).unwrap();
        text.lines().nth(1).unwrap().to_owned()
    };
    // Detectability of the effect is written too, and read again.
    assert!(truth.contains("\"detectable\":"), "{truth}");
    assert_eq!(cases("blind-check"), cases("again"));
}
