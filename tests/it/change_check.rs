//! Pairs of virtual tests with a withheld change: what is planted, recorded, found and scored.

use crate::shared::{described, effect, tapped_strip};
use assert_cmd::Command;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tapjoint::compare::{
    CauseKind, CauseResult, ChangeVerdict, Comparison, Interval, RepeatabilityOrigin,
    RepeatabilityResult, VerdictKind,
};
use tapjoint::description::TestDescription;
use tapjoint::effects::{Effect, EffectId};
use tapjoint::simulate::{Change, Laboratory, SimulateError, TestPlan, VirtualTest, plan_test};
use tapjoint::study::change_check::{
    PairAnswer, PairCampaign, PairCase, PairConduct, PairKind, PairTruth, PlantedChange,
    pair_truths_json, parse_pair_truths, score_pairs,
};

const MASS: &str = "[[recording.mass]]\nname = \"L1\"\nposition = 0.2\nmass = \"20 g\"\n";
const STRIP: &str = tapped_strip!("[[recording]]\nfile = \"taps.wav\"\ntap = 0.3\n");

/// A second sensor.
const WEIGHED: &str =
    "[[sensor]]\nname = \"W\"\nchannel = 3\nposition = \"200 mm\"\nmass = \"8 g\"\n";

fn without_joint(text: &str, kind: &str) -> String {
    let lines = text.lines();
    let left = lines.filter(|line| !line.starts_with("kt") && !line.starts_with("kr"));
    left.collect::<Vec<_>>()
        .join("\n")
        .replace("cantilever", kind)
}

fn planned(
    text: &str,
    changes: &[Change],
    effects: &[Effect],
    repeatability: f64,
    seed: u64,
) -> Result<VirtualTest, SimulateError> {
    let description = described(text);
    let laboratory = Laboratory::ideal();
    plan_test(&TestPlan {
        description: &description,
        effects,
        changes,
        repeatability,
        laboratory: &laboratory,
        joint: None,
        seed,
    })
}

fn frequencies(test: &VirtualTest) -> Vec<f64> {
    let modes = test.recordings[0].structure.elastic_modes();
    modes.map(|(frequency, _)| frequency).take(5).collect()
}

#[test]
fn prop_a_change_is_the_structure_described_so() {
    let with_mass = format!("{STRIP}{MASS}");
    let description = described(STRIP);
    let (kt, kr) = (description.joint.kt.unwrap(), description.joint.kr.unwrap());
    let mut softer = String::new();
    for line in STRIP.lines() {
        let line = match line.split_once(" = ") {
            Some(("kt", _)) => format!("kt = {:?}", 0.9 * kt),
            Some(("kr", _)) => format!("kr = {:?}", 1.05 * kr),
            _ => line.to_owned(),
        };
        softer.push_str(&line);
        softer.push('\n');
    }
    let lost = Change::LostMass {
        item: "L1".to_owned(),
    };
    let joint = Change::Joint { kt: -0.1, kr: 0.05 };
    let planted = |id, values: &[(&str, f64)]| Change::Effect(effect(id, values));
    let added = planted(EffectId::AddedMass, &[("mass", 0.02), ("position", 0.2)]);
    let added_text = with_mass.clone();
    let modulus = planted(EffectId::Modulus, &[("relative", 0.02)]);
    let modulus_before = format!("modulus = {:?}", description.beam.modulus);
    let stiffer = STRIP.lines().map(|line| match line.starts_with("modulus") {
        true => format!("modulus = {:?}\n", 1.02 * description.beam.modulus),
        false => format!("{line}\n"),
    });
    let stiffer: String = stiffer.collect();
    assert!(!stiffer.contains(&modulus_before));
    let weighed = STRIP.replacen("[[recording]]", &format!("{WEIGHED}[[recording]]"), 1);
    let moved = planted(
        EffectId::SensorPosition,
        &[("offset", 0.05), ("sensor", 2.0)],
    );
    let moved_text = weighed.replace("200 mm", "250 mm");
    let cases = [
        (with_mass.as_str(), vec![lost], STRIP),
        (STRIP, vec![joint], softer.as_str()),
        (STRIP, vec![added], added_text.as_str()),
        (STRIP, vec![modulus], stiffer.as_str()),
        (weighed.as_str(), vec![moved], moved_text.as_str()),
    ];
    for (text, changes, other) in cases {
        let changed = frequencies(&planned(text, &changes, &[], 0.0, 1).unwrap());
        let same = frequencies(&planned(other, &[], &[], 0.0, 1).unwrap());
        let unchanged = frequencies(&planned(text, &[], &[], 0.0, 1).unwrap());
        assert_eq!([changed.len(), same.len()], [5, 5], "{changes:?}");
        for (mode, (a, b)) in changed.iter().zip(&same).enumerate() {
            assert!(
                (a / b - 1.0).abs() < 1e-12,
                "{changes:?}, mode {mode}: {a} {b}"
            );
        }
        assert!(
            (changed[0] / unchanged[0] - 1.0).abs() > 1e-4,
            "{changes:?}"
        );
    }
}

#[test]
fn limit_changes_of_what_is_not_there_are_refused() {
    let gone = Change::LostMass {
        item: "L2".to_owned(),
    };
    let error = planned(&format!("{STRIP}{MASS}"), &[gone], &[], 0.0, 1).unwrap_err();
    assert!(error.to_string().contains("L1"), "{error}");
    let free = without_joint(STRIP, "free");
    let joint = Change::Joint { kt: 0.0, kr: 0.1 };
    let error = planned(&free, &[joint], &[], 0.0, 1).unwrap_err();
    assert!(
        matches!(error, SimulateError::NoSpring { key: "kr" }),
        "{error}"
    );
}

#[test]
fn limit_changes_that_change_nothing_are_refused() {
    let weighed =
        format!("{STRIP}{MASS}").replacen("[[recording]]", &format!("{WEIGHED}[[recording]]"), 1);
    let light = format!("{STRIP}{MASS}");
    let free = without_joint(&weighed, "free");
    let lost = |item: &str| Change::LostMass {
        item: item.to_owned(),
    };
    let moved = |offset, sensor| {
        let values = [("offset", offset), ("sensor", sensor)];
        Change::Effect(effect(EffectId::SensorPosition, &values))
    };
    let sized = |id, name, size| Change::Effect(effect(id, &[(name, size)]));
    let placed = |id, name| Change::Effect(effect(id, &[(name, 0.0), ("position", 0.1)]));
    let nothing = Change::Joint { kt: 0.0, kr: 0.0 };
    let cases = [
        (&weighed, vec![nothing], 1),
        (&weighed, vec![sized(EffectId::Modulus, "relative", 0.0)], 1),
        (
            &weighed,
            vec![sized(EffectId::Modulus, "relative", 1e-7)],
            1,
        ),
        (&weighed, vec![sized(EffectId::Length, "relative", 0.0)], 1),
        (&weighed, vec![sized(EffectId::AxialLoad, "force", 0.0)], 1),
        (&weighed, vec![placed(EffectId::AddedMass, "mass")], 1),
        (
            &weighed,
            vec![placed(EffectId::LocalCrack, "compliance")],
            1,
        ),
        (&weighed, vec![moved(0.0, 2.0)], 1),
        // A sensor without a mass.
        (&weighed, vec![lost("L1"), moved(0.05, 1.0)], 2),
        (&light, vec![moved(0.05, 1.0)], 1),
        // The mass is gone by another change.
        (&weighed, vec![lost("W"), lost("L1"), lost("L1")], 2),
        (&weighed, vec![lost("W"), moved(0.05, 2.0)], 2),
        (&weighed, vec![moved(0.05, 2.0), lost("W")], 1),
    ];
    for (text, changes, expected) in cases {
        let error = planned(text, &changes, &[], 0.0, 1).unwrap_err();
        let SimulateError::NoMove { change, number } = error else {
            panic!("{changes:?}: {error}");
        };
        assert_eq!((change, number), (changes[expected - 1].name(), expected));
    }
    let load = sized(EffectId::AxialLoad, "force", 9.0);
    let error = planned(&free, &[load], &[], 0.0, 1).unwrap_err();
    assert!(error.to_string().contains("on a cantilever"), "{error}");
    planned(&weighed, &[moved(0.05, 2.0), lost("L1")], &[], 0.0, 1).unwrap();
    // A mass that the description leaves out moves, too.
    let mass = effect(EffectId::SensorMass, &[("mass", 0.01)]);
    planned(&light, &[moved(0.05, 1.0)], &[mass], 0.0, 1).unwrap();
}

#[test]
fn prop_frequencies_of_two_tests_differ_by_the_repeatability() {
    const REPEATABILITY: f64 = 1e-3;
    const PAIRS: u64 = 60;
    let mut squares = 0.0;
    let mut count = 0;
    for pair in 0..PAIRS {
        let [one, other] = [2 * pair, 2 * pair + 1]
            .map(|seed| frequencies(&planned(STRIP, &[], &[], REPEATABILITY, seed).unwrap()));
        for (a, b) in one.iter().zip(&other) {
            squares += (b / a).ln().powi(2);
            count += 1;
        }
    }
    let std = (squares / f64::from(count)).sqrt();
    // A quarter of the variance is common to the five modes: the standard deviation of the estimate is below 8 %.
    assert!((std / REPEATABILITY - 1.0).abs() < 0.24, "{std}");
    let still = [1, 2].map(|seed| frequencies(&planned(STRIP, &[], &[], 0.0, seed).unwrap()));
    assert_eq!(still[0], still[1]);
}

#[test]
fn prop_modes_of_a_test_share_a_quarter_of_the_scatter() {
    const TESTS: u64 = 200;
    let still = frequencies(&planned(STRIP, &[], &[], 0.0, 0).unwrap());
    let (mut variance, mut covariance) = (0.0, 0.0);
    for seed in 0..TESTS {
        let test = frequencies(&planned(STRIP, &[], &[], 1e-3, seed).unwrap());
        let logs: Vec<f64> = test.iter().zip(&still).map(|(a, b)| (a / b).ln()).collect();
        let sum: f64 = logs.iter().sum();
        let squares: f64 = logs.iter().map(|log| log * log).sum();
        variance += squares / 5.0;
        covariance += (sum * sum - squares) / 20.0;
    }
    let share = covariance / variance;
    // The mean of ten correlations over 200 tests has a standard deviation of about 0.04.
    assert!((share - 0.25).abs() < 0.12, "{share}");
}

#[test]
fn prop_a_campaign_deals_out_all_classes_and_hides_them_in_the_description() {
    let campaign = PairCampaign {
        pairs: 14,
        noise_db: 60.0,
        seed: 5,
    };
    let pairs: Vec<_> = (0..campaign.pairs)
        .map(|index| campaign.draw(index).unwrap())
        .collect();
    let mut kinds: Vec<PairKind> = pairs.iter().map(|pair| pair.truth.kind()).collect();
    kinds.sort();
    kinds.dedup();
    // Nothing, eight causes, two at once, and outside.
    assert_eq!(kinds.len(), 11, "{kinds:?}");
    for pair in &pairs {
        let is_nothing = pair.truth.kind() == PairKind::Nothing;
        assert_eq!(pair.structure.before == pair.structure.after, is_nothing);
        assert_eq!(pair.truth.visible.is_none(), is_nothing);
    }
    let [before, after] = pairs[0].record().unwrap();
    for test in [&before, &after] {
        let read = TestDescription::parse(&test.description, "test.toml").unwrap();
        assert_eq!((read.joint.kt, read.joint.kr), (None, None));
    }
    // Each recording has noise and taps of its own.
    assert_ne!(before.recordings[0].channels, after.recordings[0].channels);
    let [again, _] = campaign.draw(0).unwrap().record().unwrap();
    assert_eq!(again.description, before.description);
    assert_eq!(again.recordings[0].channels, before.recordings[0].channels);
}

#[test]
fn val_truths_are_read_as_they_are_written() {
    let campaign = PairCampaign {
        pairs: 12,
        noise_db: 60.0,
        seed: 9,
    };
    let truths = (0..campaign.pairs).map(|index| campaign.draw(index).unwrap().truth);
    let truths: Vec<PairTruth> = truths.collect();
    let read = parse_pair_truths(&pair_truths_json(&truths).unwrap()).unwrap();
    assert_eq!((read.truths, read.doubts), (truths, Vec::new()));
    let unknown = r#"[{"name": "a", "changes": [{"cause": "joint-chnge"}]}]"#;
    let read = parse_pair_truths(unknown).unwrap();
    assert!(read.doubts[0].contains("joint-change"), "{:?}", read.doubts);
    assert_eq!(read.truths[0].kind(), PairKind::Outside);
    let slips = r#"[{"name": "a", "seen": true, "changes": [
        {"cause": "sensor-position", "parameters": {"offset": 0.01}},
        {"cause": "modulus", "item": "A", "size": 1, "parameters": {"relativ": 0.01}}]}]"#;
    let doubts = parse_pair_truths(slips).unwrap().doubts.join("\n");
    for words in [
        "key `seen` is not known",
        "key `size` is not known",
        "`offset` is no parameter of `sensor-position` and is left out; allowed: sensor_shift",
        "`relativ` is no parameter of `modulus`",
        "`sensor-position` has no `item`",
        "`modulus` is about no item",
        "no pair says whether its change is `visible`",
    ] {
        assert!(doubts.contains(words), "{words}: {doubts}");
    }
    let wrong = r#"[{"name": "a", "changes": [], "visible": 3}]"#;
    let error = parse_pair_truths(wrong).unwrap_err().to_string();
    assert!(
        !error.contains("no list")
            && error.contains("\"item\"")
            && error.contains("\"repeatability\""),
        "{error}"
    );
    for (text, words) in [
        ("{}", "no list of truths"),
        (r#"[{"name": "a"}]"#, "missing field `changes`"),
        (
            r#"[{"name": "a", "changes": []}, {"name": "a", "changes": []}]"#,
            "occurs twice",
        ),
        (
            r#"[{"name": "a", "changes": [], "repeatability": 2}]"#,
            "must lie between",
        ),
    ] {
        let error = parse_pair_truths(text).unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
}

// ---------------------------------------------------------------- score

fn truth(causes: &[(&str, &[(&str, f64)])], visible: bool) -> PairTruth {
    let changes = causes.iter().map(|(cause, sizes)| PlantedChange {
        cause: (*cause).to_owned(),
        item: (*cause == "lost-mass").then(|| "L1".to_owned()),
        parameters: sizes
            .iter()
            .map(|(name, size)| ((*name).to_owned(), *size))
            .collect(),
    });
    PairTruth {
        name: "pair".to_owned(),
        changes: changes.collect(),
        visible: Some(visible),
        repeatability: None,
    }
}

/// An answer whose hypotheses are these, the most probable first, each with the interval of one parameter.
fn answer(
    kind: VerdictKind,
    effects: &[CauseKind],
    hypotheses: &[(CauseKind, &'static str, [f64; 2])],
) -> PairAnswer {
    let hypotheses = hypotheses.iter().map(|(effect, name, [low, high])| {
        let interval = Interval {
            value: 0.5 * (low + high),
            std: 0.25 * (high - low),
            low: *low,
            high: *high,
        };
        CauseResult {
            effect: *effect,
            item: (*effect == CauseKind::LostMass).then(|| "L2".to_owned()),
            probability: 0.5,
            parameters: BTreeMap::from([(*name, interval)]),
            goodness_of_fit: None,
            explains_percent: Vec::new(),
        }
    });
    PairAnswer::Compared(Box::new(Comparison {
        modes: Vec::new(),
        matched: Vec::new(),
        joint: None,
        verdict: ChangeVerdict {
            kind,
            effects: effects.to_vec(),
            items: vec![None; effects.len()],
            probability: 0.9,
        },
        hypotheses: hypotheses.collect(),
        damping: None,
        level: None,
        repeatability: RepeatabilityResult {
            percent: 0.1,
            origin: RepeatabilityOrigin::Assumed,
        },
        no_change_goodness: 0.5,
    }))
}

fn rates(cases: &[PairCase]) -> BTreeMap<&'static str, (usize, usize)> {
    let rows = tapjoint::study::change_check::pair_rows(&score_pairs(cases));
    let counted = rows.iter();
    counted
        .filter_map(|row| Some((row.key, row.counts?)))
        .filter(|(_, (_, of))| *of > 0)
        .collect()
}

#[test]
fn val_the_score_counts_what_it_says() {
    use CauseKind::{AddedMass, JointChange, LostMass, Modulus, NoChange, Unknown};
    let joint: &[(&str, f64)] = &[("kt", -0.1)];
    let named_joint = answer(
        VerdictKind::Named,
        &[JointChange],
        &[(JointChange, "kt", [-0.2, -0.05])],
    );
    // Right, and the interval holds.
    let right = rates(&[(truth(&[("joint-change", joint)], true), named_joint.clone())]);
    let expected = [
        ("first_right", (1, 1)),
        ("first_right_visible", (1, 1)),
        ("kt_interval", (1, 1)),
        ("list_holds", (1, 1)),
        ("list_holds_or_unknown", (1, 1)),
        ("named", (1, 1)),
        ("named_right", (1, 1)),
        ("named_wrongly", (0, 1)),
    ];
    assert_eq!(right, BTreeMap::from(expected));
    // A wrong name is wrong for another cause, for nothing and for something outside.
    for causes in [&[("modulus", joint)][..], &[], &[("bed", joint)]] {
        let wrong = rates(&[(truth(causes, true), named_joint.clone())]);
        assert_eq!(wrong["named_wrongly"], (1, 1), "{causes:?}");
    }
    let nothing = truth(&[], false);
    let called = |kind, effects: &[CauseKind]| {
        rates(&[(
            nothing.clone(),
            answer(kind, effects, &[(NoChange, "", [0.0; 2])]),
        )])["nothing_called_change"]
    };
    assert_eq!(called(VerdictKind::NoChange, &[]), (0, 1));
    assert_eq!(called(VerdictKind::Unknown, &[]), (1, 1));
    assert_eq!(called(VerdictKind::Set, &[Modulus, NoChange]), (0, 1));
    assert_eq!(called(VerdictKind::Set, &[Modulus, JointChange]), (1, 1));
    // A lost mass and an added one are hardly separated, but the item is wrong; `no-change` is no cause.
    let lost = truth(&[("lost-mass", &[("mass", -0.01)])], true);
    let found = answer(
        VerdictKind::Set,
        &[Unknown, Modulus],
        &[(NoChange, "", [0.0; 2]), (LostMass, "mass", [0.0, 1.0])],
    );
    let scored = rates(&[(lost.clone(), found)]);
    assert_eq!(scored["first_right"], (1, 1));
    assert_eq!(scored["item_right"], (0, 1));
    assert_eq!(scored["named"], (0, 1));
    // The list has the modulus and unknown, but no mass.
    let lists = [scored["list_holds"], scored["list_holds_or_unknown"]];
    assert_eq!(lists, [(0, 1), (1, 1)]);
    let found = answer(
        VerdictKind::NoChange,
        &[],
        &[(AddedMass, "mass", [0.0, 1.0])],
    );
    let scored = rates(&[(lost, found)]);
    assert_eq!(scored["first_right"], (1, 1));
    assert_eq!(scored["list_holds"], (0, 1));
    assert_eq!(scored.get("item_right"), None);
    // Outside of the causes, unknown is what the answer should say.
    let bed = truth(&[("bed", joint)], true);
    for (kind, hits) in [(VerdictKind::Unknown, 1), (VerdictKind::NoChange, 0)] {
        let scored = rates(&[(bed.clone(), answer(kind, &[], &[]))]);
        assert_eq!(scored["list_holds"], (hits, 1), "{kind:?}");
        assert_eq!(scored["list_holds_or_unknown"], (hits, 1), "{kind:?}");
    }
    // Two changes: one of them is enough.
    let two = truth(&[("modulus", joint), ("joint-change", joint)], true);
    assert_eq!(
        rates(&[(two, named_joint.clone())])["several_first_right"],
        (1, 1)
    );
    // No answer counts by itself.
    let cases = [
        (
            truth(&[("modulus", joint)], true),
            PairAnswer::None("why".to_owned()),
        ),
        (truth(&[("joint-change", joint)], true), named_joint),
    ];
    let scores = score_pairs(&cases);
    assert_eq!((scores.failed, scores.counts), (1, [0, 2, 0, 0]));
    let first_right = scores.rate("first_right").unwrap();
    assert_eq!((first_right.hits, first_right.of), (1, 1));
    // Every key that is asked for elsewhere.
    for key in [
        "first_right_visible",
        "several_first_right",
        "named_wrongly",
        "list_holds",
        "kt_interval",
        "kr_interval",
        "mass_interval",
        "place_interval",
    ] {
        assert!(scores.rate(key).is_some(), "{key}");
    }
    // Dealt out, each answer goes to a pair that it is wrong for; one pair has no other.
    let right = |cause: &str, kind| {
        let found = answer(VerdictKind::NoChange, &[], &[(kind, "kt", [-0.2, 0.0])]);
        (truth(&[(cause, joint)], true), found)
    };
    let cases = [
        right("joint-change", JointChange),
        right("modulus", Modulus),
        right("added-mass", AddedMass),
    ];
    let shuffled = |cases: &[PairCase], seed| PairConduct::default().mutated(cases, seed).shuffled;
    for seed in 0..20 {
        assert_eq!(shuffled(&cases, seed), Some(0.0), "{seed}");
        assert_eq!(shuffled(&cases[..1], seed), None, "{seed}");
    }
}

// ---------------------------------------------------------------- the program

fn run(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    command.current_dir(folder).args(arguments);
    let output = command.assert().success().get_output().stdout.clone();
    String::from_utf8(output).unwrap()
}

#[test]
fn recover_a_planted_change_of_the_joint() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("strip.toml"), STRIP).unwrap();
    run(
        folder.path(),
        &[
            "simulate",
            "strip.toml",
            "--out",
            "pair",
            "--change",
            "joint-change:kr=-12%",
            "--with",
            "added-mass:mass=5g,position=0.25",
            "--repeatability",
            "0.02%",
            "--seed",
            "4",
        ],
    );
    let place = folder.path().join("pair");
    let texts = ["before", "after"]
        .map(|side| fs::read_to_string(place.join(side).join("test.toml")).unwrap());
    for text in &texts {
        assert!(!text.contains("kr") && !text.contains("effect"), "{text}");
    }
    let truth: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(place.join("truth.json")).unwrap()).unwrap();
    assert_eq!(truth["changes"][0]["cause"], "joint-change");
    assert_eq!(truth["changes"][0]["parameters"]["kr"], -0.12);
    assert_ne!(truth["before"]["seed"], truth["after"]["seed"]);
    let compare = [
        "compare",
        "pair/before/test.toml",
        "pair/after/test.toml",
        "--repeatability",
        "0.02%",
        "--json",
        "-",
    ];
    let found: serde_json::Value = serde_json::from_str(&run(folder.path(), &compare)).unwrap();
    let first = &found["compare"]["hypotheses"][0];
    assert_eq!(first["effect"], "joint-change", "{first}");
    let kr = &first["parameters"]["kr"];
    let [low, high] = ["low", "high"].map(|end| kr[end].as_f64().unwrap());
    assert!(low < -0.12 && -0.12 < high && high < 0.0, "{low} to {high}");
}

#[test]
fn prop_kept_pairs_are_what_was_sealed_and_score_the_same_again() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = ["blind-check", "--compare", "--cases", "2", "--seed", "11"];
    let first = run(
        folder.path(),
        &[&drawn[..], &["--keep", "kept", "--threads", "1"]].concat(),
    );
    let truth = fs::read_to_string(folder.path().join("kept/truth.json")).unwrap();
    let seal = tapjoint::study::blind_check::commitment(&truth);
    assert!(first.contains(&seal), "{first}");
    let file = |out: &str, name: &str| fs::read(folder.path().join(out).join(name)).unwrap();
    let before = ["cases.csv", "score.json"].map(|name| file("blind-check", name));
    // A picture of a check of the diagnosis, made by tapjoint.
    let stale = folder.path().join("blind-check/reliability.png");
    fs::copy(folder.path().join("blind-check/confusion.png"), &stale).unwrap();
    // Again over its own files, with other threads.
    run(
        folder.path(),
        &[&drawn[..], &["--keep", "kept", "--threads", "2"]].concat(),
    );
    let after = ["cases.csv", "score.json"].map(|name| file("blind-check", name));
    assert!(!stale.exists());
    assert!(
        before == after,
        "another number of threads changes the answers"
    );
    let folder_and_truth = ["--folder", "kept", "--truth", "kept/truth.json"];
    let again = ["blind-check", "--compare", "--out", "again"];
    run(folder.path(), &[&again[..], &folder_and_truth].concat());
    assert!(file("again", "cases.csv") == before[0]);
}

#[test]
fn regress_pairs_that_cannot_be_compared_have_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    for side in ["before", "after"] {
        let place = folder.path().join("pairs/a").join(side);
        fs::create_dir_all(&place).unwrap();
        fs::write(place.join("test.toml"), STRIP).unwrap();
    }
    let place = folder.path();
    fs::write(place.join("one.json"), r#"[{"name": "a", "changes": []}]"#).unwrap();
    fs::write(place.join("two.json"), r#"[{"name": "b", "changes": []}]"#).unwrap();
    let check = ["blind-check", "--compare", "--folder", "pairs", "--truth"];
    // Its recordings are missing.
    run(place, &[&check[..], &["one.json"]].concat());
    let cases = fs::read_to_string(place.join("blind-check/cases.csv")).unwrap();
    assert!(
        cases.contains("no-answer") && cases.contains("taps.wav"),
        "{cases}"
    );
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    command.current_dir(place).args(check).arg("two.json");
    let error = command.assert().code(2).get_output().stderr.clone();
    let error = String::from_utf8(error).unwrap();
    assert!(error.contains("b/before/test.toml"), "{error}");
}

#[test]
fn regress_an_item_that_weighs_nothing_is_no_right_answer() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let weighed = STRIP.replacen("[[recording]]", &format!("{WEIGHED}[[recording]]"), 1);
    // A mass that is not on the beam in the first recording.
    let later = "[[recording]]\nfile = \"later.wav\"\ntap = 0.3\n";
    let text = format!("{weighed}{later}{MASS}");
    for side in ["before", "after"] {
        let own = place.join("pairs/a").join(side);
        fs::create_dir_all(&own).unwrap();
        fs::write(own.join("test.toml"), &text).unwrap();
    }
    let lost = |item: &str| format!(r#"{{"cause": "lost-mass", "item": "{item}"}}"#);
    let changes = ["W", "A", "L1"].map(lost).join(", ");
    let truth = format!(r#"[{{"name": "a", "changes": [{changes}], "visible": true}}]"#);
    fs::write(place.join("truth.json"), truth).unwrap();
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    let check = [
        "blind-check",
        "--compare",
        "--folder",
        "pairs",
        "--truth",
        "truth.json",
    ];
    let output = command.current_dir(place).args(check).output().unwrap();
    let warnings = String::from_utf8(output.stderr).unwrap();
    for (item, is_warned) in [("W", false), ("A", true), ("L1", true)] {
        let words = format!("describes no \"{item}\" that weighs");
        assert_eq!(warnings.contains(&words), is_warned, "{item}: {warnings}");
    }
}

#[test]
fn regress_a_moved_sensor_is_scored_and_the_summary_says_what_changed() {
    let folder = tempfile::tempdir().unwrap();
    let weighed = STRIP.replacen("[[recording]]", &format!("{WEIGHED}[[recording]]"), 1);
    fs::write(folder.path().join("strip.toml"), weighed).unwrap();
    let said = run(
        folder.path(),
        &[
            "simulate",
            "strip.toml",
            "--out",
            "pair",
            "--change",
            "sensor-position:offset=50mm,sensor=2",
            "--change",
            "joint-change:kt=-10%",
            "--repeatability",
            "0.1%",
        ],
    );
    for words in [
        "Nothing planted before the change",
        "(W, sensor_shift 0.05 m)",
        "(kr 0 %, kt \u{2212}10 %)",
        "Repeatability: 0.1 %",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!said.contains("is the truth"), "{said}");
    let text = fs::read_to_string(folder.path().join("pair/truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&text).unwrap();
    let list = serde_json::json!([{"name": "a", "changes": truth["changes"], "visible": true}]);
    let read = parse_pair_truths(&list.to_string()).unwrap();
    assert!(read.doubts.is_empty(), "{:?}", read.doubts);
    let moved = &read.truths[0].changes[0];
    assert_eq!(moved.item.as_deref(), Some("W"));
    assert_eq!(moved.parameters["sensor_shift"], 0.05);
}

#[test]
fn regress_a_folder_holds_the_last_virtual_test_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("strip.toml"), STRIP).unwrap();
    let single = ["simulate", "strip.toml", "--out", "v"];
    let pair = [&single[..], &["--change", "joint-change:kr=-5%"]].concat();
    let has = |name: &str| folder.path().join("v").join(name).is_file();
    run(folder.path(), &pair);
    fs::write(folder.path().join("v/before/notes.txt"), "mine").unwrap();
    assert!(has("before/taps.wav") && has("truth.json"));
    run(folder.path(), &[&single[..], &["--no-truth"]].concat());
    assert!(has("test.toml") && has("taps.wav") && has("before/notes.txt"));
    for gone in [
        "before/test.toml",
        "before/taps.wav",
        "after/test.toml",
        "truth.json",
    ] {
        assert!(!has(gone), "{gone}");
    }
    run(folder.path(), &pair);
    assert!(has("after/taps.wav") && !has("test.toml") && !has("taps.wav"));
    fs::write(folder.path().join("strip.toml"), STRIP).unwrap();
    fs::create_dir(folder.path().join("q")).unwrap();
    fs::write(folder.path().join("q/before"), "").unwrap();
    let mut command = Command::cargo_bin("tapjoint").unwrap();
    let arguments = [
        "simulate",
        "strip.toml",
        "--out",
        "q",
        "--change",
        "joint-change:kr=-5%",
    ];
    command.current_dir(folder.path()).args(arguments);
    let error = command.assert().code(2).get_output().stderr.clone();
    let error = String::from_utf8(error).unwrap();
    assert!(
        error.contains("is a file, but a folder is needed"),
        "{error}"
    );
}

#[test]
fn regress_bad_changes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("strip.toml"), STRIP).unwrap();
    for (change, words) in [
        ("joint-change", "needs kt, kr or both"),
        ("joint-change:ktr=1%", "has no parameter `ktr`"),
        ("joint-change:kt=1%,kt=2%", "twice"),
        ("joint-change:kt", "has no value"),
        ("joint-change:kt=-100%", "kt: give -99 % to 10000 %"),
        ("lost-mass", "item=NAME"),
        ("lost-mass:item=L9", "nothing that weighs is named \"L9\""),
        ("density:relative=1%", "is no change between two tests"),
        ("added-mass:weight=1", "no parameter `weight`"),
    ] {
        let mut command = Command::cargo_bin("tapjoint").unwrap();
        command.current_dir(folder.path()).args([
            "simulate",
            "strip.toml",
            "--out",
            "pair",
            "--change",
            change,
        ]);
        let error = command.assert().code(2).get_output().stderr.clone();
        let error = String::from_utf8(error).unwrap();
        assert!(error.contains(words), "{change}: {error}");
        assert!(!folder.path().join("pair").exists(), "{change}");
    }
}
