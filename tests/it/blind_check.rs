//! The score of a blind check, on answers made by hand.

use std::collections::BTreeMap;

use tapjoint::effects::{EffectId, Place};
use tapjoint::gap::Verdict;
use tapjoint::study::blind_check::{
    Answer, Case, CaseKind, Class, EstimatedParameter, Extent, Planted, Rate, Row, Target, Truth,
    always_scale, parse_truths, render_rows, rows, score, shuffled,
};

/// The parameter that measures the size, where there is one.
fn sized(id: EffectId, size: f64) -> BTreeMap<String, f64> {
    let names = id.size_parameters().iter().take(1);
    names.map(|name| ((*name).to_owned(), size)).collect()
}

fn planted(name: &str, effects: &[EffectId], size: f64) -> Truth {
    let effects = effects
        .iter()
        .map(|id| Planted::Catalogue(*id, sized(*id, size)));
    Truth {
        name: name.to_owned(),
        effects: effects.collect(),
        detectable: Some(true),
        refutable: None,
        within_tolerance: None,
    }
}

fn outside(name: &str) -> Truth {
    Truth {
        name: name.to_owned(),
        effects: vec![Planted::OutOfCatalogue("second support".to_owned())],
        detectable: Some(true),
        refutable: Some(true),
        within_tolerance: None,
    }
}

/// An answer that gives `p` to one class and the rest to none (or to unknown, where the class is none).
fn answer(verdict: Verdict, class: Class, p: f64) -> Answer {
    let other = if class == Class::None {
        Class::Unknown
    } else {
        Class::None
    };
    let effects: Vec<EffectId> = match (&verdict, class) {
        (Verdict::Named(_), Class::Group(group)) => EffectId::ALL
            .iter()
            .copied()
            .filter(|id| id.group() == group)
            .take(1)
            .collect(),
        _ => Vec::new(),
    };
    let place = effects.first().map(|id: &EffectId| id.place());
    Answer {
        verdict: Some(match verdict {
            Verdict::Named(_) => Verdict::Named(effects.clone()),
            other => other,
        }),
        parameters: effects
            .iter()
            .flat_map(|id| sized(*id, 1.1).into_iter().map(|one| (*id, one)))
            .map(|(effect, (name, value))| EstimatedParameter {
                effect,
                name,
                value,
                std: Some(0.04),
            })
            .collect(),
        effects,
        classes: [(class, p), (other, 1.0 - p)].into(),
        places: vec![(place, p), (Some(Place::Fixture), 0.0)],
        closure: Some(p),
    }
}

fn group(id: EffectId) -> Class {
    Class::Group(id.group())
}

/// One of each: right name, wrong name, no gap called, named null, right null, refused outside,
/// two effects of which one is named.
fn cases() -> Vec<Case> {
    use EffectId::{AddedMass, CrossCoupling, JointMass, SensorMass};
    vec![
        (
            planted("right", &[SensorMass], 1.0),
            answer(Verdict::Named(Vec::new()), group(SensorMass), 0.95),
        ),
        (
            planted("wrong", &[AddedMass], 1.0),
            answer(Verdict::Named(Vec::new()), group(JointMass), 0.85),
        ),
        (
            planted("missed", &[CrossCoupling], 1.0),
            answer(Verdict::NoGap, Class::None, 0.75),
        ),
        (
            planted("called", &[], 1.0),
            answer(Verdict::Named(Vec::new()), group(JointMass), 0.85),
        ),
        (
            planted("clean", &[], 1.0),
            answer(Verdict::NoGap, Class::None, 0.65),
        ),
        (
            outside("refused"),
            answer(Verdict::Unknown, Class::Unknown, 0.65),
        ),
        (
            planted("two", &[SensorMass, CrossCoupling], 1.0),
            answer(Verdict::Named(Vec::new()), group(SensorMass), 0.95),
        ),
    ]
}

#[test]
fn val_a_score_counted_by_hand() {
    let scores = score(&cases());
    let of = |hits, of| Rate { hits, of };
    assert_eq!(scores.counts, [2, 3, 1, 1]);
    assert_eq!(scores.top_1, of(1, 3));
    assert_eq!(scores.top_1_of_all, of(1, 3));
    assert_eq!(scores.top_3, of(1, 3));
    // Sensor and joint were named; the joint is not where the mass was added.
    assert_eq!(scores.place, of(1, 3));
    assert_eq!(scores.named, of(2, 3));
    assert_eq!(scores.named_right, of(1, 2));
    assert_eq!(scores.named_right_of_all, of(1, 4));
    assert_eq!(scores.null_called_effect, of(1, 2));
    assert_eq!(scores.null_false_alarm, of(1, 2));
    assert_eq!(scores.outside_named, of(0, 1));
    assert_eq!(scores.outside_refused, of(1, 1));
    assert_eq!(scores.several_found_or_refused, of(0, 1));
    assert_eq!(scores.several_detectable, of(0, 1));
    // Sets: {sensor-mass} holds it; {joint-mass, none} does not hold added-mass, but the null;
    // {none, unknown} does not hold cross-coupling, but the other null; {unknown, none} the outside.
    assert_eq!(scores.set_coverage, of(4, 6));
    assert_eq!(scores.set_size, Some(11.0 / 6.0));
    assert_eq!(scores.closures, 2);
    let (median, tenth) = scores.closure.expect("two were named");
    // Linear between 0.85 and 0.95.
    assert!((median - 0.90).abs() < 1e-12 && (tenth - 0.86).abs() < 1e-12);
    // ln 1.1, of the one right name.
    let size = scores.size_error.expect("one was named rightly");
    assert!((size - 1.1f64.ln()).abs() < 1e-12);
}

#[test]
fn val_brier_and_reliability_by_hand() {
    let scores = score(&cases());
    // (0.05^2 + 0.05^2, 1 + 0.85^2 + 0.15^2, 1 + 0.75^2 + 0.25^2, 0.85^2 + 0.85^2,
    // 0.35^2 + 0.35^2, 0.35^2 + 0.35^2)/6.
    let expected = (0.005 + 1.745 + 1.625 + 1.445 + 0.245 + 0.245) / 6.0;
    let found = scores.calibration.brier.expect("there are cases");
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    let bins = &scores.calibration.reliability;
    assert_eq!(bins.iter().map(|bin| bin.cases).sum::<usize>(), 6);
    let bin = bins[6];
    assert_eq!((bin.cases, bin.right), (2, Some(1.0)));
    // |0.65 - 1| x 2/6 + |0.75 - 0|/6 + |0.85 - 0| x 2/6 + |0.95 - 1|/6.
    let expected = (0.35 * 2.0 + 0.75 + 0.85 * 2.0 + 0.05) / 6.0;
    let found = scores.calibration.expected_calibration_error;
    assert!((found.expect("there are cases") - expected).abs() < 1e-12);
}

#[test]
fn val_a_group_counts_as_its_name_and_a_set_of_several_groups_does_not() {
    let of_verdict = |truth: EffectId, effects: &[EffectId]| {
        let answer = Answer {
            verdict: Some(Verdict::Group(effects.to_vec())),
            effects: effects.to_vec(),
            classes: [(group(effects[0]), 1.0)].into(),
            ..Answer::default()
        };
        (planted("a", &[truth], 0.02), answer)
    };
    use EffectId::{AddedMass, Length, LocalCrack, Modulus, SensorPosition, TapPosition};
    let scores = score(&[
        of_verdict(Modulus, &[Modulus, Length]),
        of_verdict(SensorPosition, &[SensorPosition, TapPosition]),
        of_verdict(AddedMass, &[SensorPosition, TapPosition]),
        of_verdict(AddedMass, &[AddedMass, LocalCrack]),
    ]);
    let of = |hits, of| Rate { hits, of };
    assert_eq!((scores.named, scores.named_right), (of(3, 4), of(2, 3)));
    assert_eq!(scores.named_right_of_all, of(2, 3));
    assert_eq!(scores.name_share, of(3, 4));
    assert_eq!(scores.set_up_named, of(1, 1));
    // None of them is a single name.
    let single = (scores.single_named, scores.single_named_right);
    assert_eq!(single, (of(0, 4), of(0, 0)));
}

#[test]
fn val_clear_errors_of_the_set_up_are_counted_with_their_sensor() {
    let case = |id: EffectId, planted: &[(&str, f64)], found: &[(&str, f64)]| {
        let values = planted
            .iter()
            .map(|(name, value)| ((*name).to_owned(), *value));
        let truth = Truth {
            effects: vec![Planted::Catalogue(id, values.collect())],
            ..self::planted("a", &[], 0.0)
        };
        let parameters = found.iter().map(|(name, value)| EstimatedParameter {
            effect: id,
            name: (*name).to_owned(),
            value: *value,
            std: Some(1e-3),
        });
        let answer = Answer {
            verdict: Some(Verdict::Named(vec![id])),
            effects: vec![id],
            parameters: parameters.collect(),
            ..Answer::default()
        };
        (truth, answer)
    };
    use EffectId::{SensorPolarity, SensorPosition, SensorScale, SensorSwap, TapPosition};
    let of = |hits, of| Rate { hits, of };
    let clear = [
        // Off by 1.5 standard deviations.
        case(
            SensorPosition,
            &[("offset", 8e-3), ("sensor", 2.0)],
            &[("offset", 9.5e-3), ("sensor", 2.0)],
        ),
        // The other sensor.
        case(
            SensorPosition,
            &[("offset", -5e-3), ("sensor", 2.0)],
            &[("offset", 5e-3), ("sensor", 1.0)],
        ),
        case(SensorPolarity, &[("sensor", 1.0)], &[]),
        case(
            SensorSwap,
            &[("sensor", 2.0), ("other", 1.0)],
            &[("sensor", 1.0), ("other", 2.0)],
        ),
        case(
            SensorSwap,
            &[("sensor", 2.0), ("other", 1.0)],
            &[("sensor", 1.0), ("other", 3.0)],
        ),
        // Of one sensor all are as good as the first.
        case(
            SensorScale,
            &[("relative", -0.1), ("sensor", 0.0)],
            &[("relative", -0.097), ("sensor", 1.0)],
        ),
    ];
    let scores = score(&clear);
    assert_eq!(scores.set_up_named, of(4, 6));
    // Two offsets and a scale have sizes.
    assert_eq!(scores.set_up_size_within_2_std, of(1, 3));
    assert_eq!(scores.size_within_2_std, of(1, 3));
    let unclear = [
        case(TapPosition, &[("offset", 4.9e-3)], &[]),
        case(SensorScale, &[("relative", 0.09)], &[]),
        case(
            EffectId::Modulus,
            &[("relative", 0.1)],
            &[("relative", 0.101)],
        ),
    ];
    let scores = score(&unclear);
    assert_eq!(scores.set_up_named, of(0, 0));
    assert_eq!(
        (scores.set_up_size_within_2_std, scores.size_within_2_std),
        (of(0, 0), of(1, 1))
    );
}

#[test]
fn limit_a_factor_within_the_tolerances_is_no_effect() {
    use EffectId::{Density, Modulus, SensorMass};
    let covered = |effects: &[EffectId], within_tolerance| Truth {
        within_tolerance,
        ..planted("a", effects, 0.001)
    };
    let kind = |effects: &[EffectId]| covered(effects, Some(true)).kind();
    assert_eq!(kind(&[Density]), CaseKind::Null);
    assert_eq!(kind(&[SensorMass, Modulus]), CaseKind::Single(SensorMass));
    assert_eq!(
        covered(&[Density], Some(false)).kind(),
        CaseKind::Single(Density)
    );
    assert_eq!(covered(&[Density], None).kind(), CaseKind::Single(Density));
    // To name the density is then a false alarm, and to name the mass alone is right.
    let scores = score(&[
        (
            covered(&[Density], Some(true)),
            answer(Verdict::Named(Vec::new()), group(Density), 0.9),
        ),
        (
            covered(&[SensorMass, Modulus], Some(true)),
            answer(Verdict::Named(Vec::new()), group(SensorMass), 0.9),
        ),
    ]);
    assert_eq!(scores.counts, [1, 1, 0, 0]);
    assert_eq!(scores.null_called_effect, Rate { hits: 1, of: 1 });
    assert_eq!(scores.named_right, Rate { hits: 1, of: 1 });
    assert_eq!(scores.named_right_of_all, Rate { hits: 1, of: 2 });
}

#[test]
fn prop_mutations_lose() {
    let all: Vec<Case> = EffectId::ALL
        .iter()
        .map(|id| {
            let class = group(*id);
            (
                planted(id.name(), &[*id], 1.0),
                answer(Verdict::Named(Vec::new()), class, 0.95),
            )
        })
        .collect();
    let right = score(&all).top_1;
    assert_eq!(right.hits, right.of);
    let share = |cases: &[Case]| score(cases).top_1.hits as f64 / right.of as f64;
    // Of 24 effects in 15 groups at most the five of one group can be right by chance together,
    // plus a few that the shuffle left in place.
    assert!(share(&shuffled(&all, 1)) < 0.4);
    let scale = EffectId::ALL
        .iter()
        .filter(|id| id.group() == EffectId::Modulus.group())
        .count();
    assert_eq!(score(&always_scale(&all)).top_1.hits, scale);
}

#[test]
fn prop_rates_do_not_depend_on_the_order_of_cases() {
    let (first, mut second) = (cases(), cases());
    second.reverse();
    for (a, b) in rows(&score(&first), None)
        .iter()
        .zip(rows(&score(&second), None))
    {
        assert_eq!((a.key, a.counts), (b.key, b.counts));
        // Sums in another order differ in their last digit.
        let difference = a.value.zip(b.value).map_or(0.0, |(a, b)| (a - b).abs());
        assert!(difference < 1e-12, "{}: {:?} {:?}", a.key, a.value, b.value);
        assert_eq!(a.value.is_some(), b.value.is_some(), "{}", a.key);
    }
}

#[test]
fn limit_one_recording_is_held_against_an_ideal_observer_and_no_target_of_five() {
    let wrong = answer(Verdict::Named(Vec::new()), group(EffectId::LocalCrack), 0.9);
    let missed: Vec<Case> = vec![(planted("a", &[EffectId::SensorMass], 1.0), wrong)];
    let with = |extent| rows(&score(&missed), extent);
    let of = |rows: &[Row], key: &str| rows.iter().find(|row| row.key == key).unwrap().clone();
    let one = with(Some(Extent::OneRecording));
    assert_eq!(of(&one, "top_1").target, Target::None);
    // The study's figure for one configuration and five modes.
    assert_eq!(of(&one, "top_1").ideal, Some(0.664));
    let five = with(Some(Extent::FiveRecordings));
    assert_eq!(of(&five, "top_1").ideal, Some(0.872));
    assert_eq!(of(&with(None), "top_1").ideal, None);
    let text = render_rows(&five);
    assert!(
        text.contains(">=0.80!") && text.contains("! the target is missed"),
        "{text}"
    );
    assert!(!render_rows(&one).contains('!'));
    assert!(
        text.lines().all(|line| line.chars().count() <= 80),
        "{text}"
    );
}

#[test]
fn limit_no_cases_have_no_figures() {
    let rows = rows(&score(&[]), None);
    assert!(rows.iter().all(|row| row.value.is_none()), "{rows:?}");
}

#[test]
fn val_truths_of_tests_made_elsewhere() {
    let text = r#"[
        {"name": "a", "effects": []},
        {"name": "b", "effects": ["added-mass"], "params": {"mass": 0.02, "position": 0.3}},
        {"name": "c", "effects": ["sensor-mass", "local-crack"],
         "params": {"sensor-mass": {"mass": 0.008}, "local-crack": {"compliance": 0.01}}},
        {"name": "d", "effects": ["loose-screw"], "params": {"torque": 1}}
    ]"#;
    let truths = parse_truths(text).expect("a list of truths").truths;
    assert_eq!(truths.len(), 4);
    assert_eq!(truths[0].class(), Some(Class::None));
    let values: BTreeMap<_, _> = [("mass".to_owned(), 0.02), ("position".to_owned(), 0.3)].into();
    assert_eq!(
        truths[1].effects,
        [Planted::Catalogue(EffectId::AddedMass, values)]
    );
    assert_eq!(truths[2].class(), None);
    assert_eq!(truths[2].catalogue().count(), 2);
    assert_eq!(truths[3].class(), Some(Class::Unknown));
    let text = r#"[{"name": "e", "effects": ["modulus"], "params": {"relative": 0.001}, "within_tolerance": true}]"#;
    let truths = parse_truths(text).expect("a list of truths");
    assert_eq!(truths.truths[0].class(), Some(Class::None));
    assert!(truths.doubts.is_empty(), "{:?}", truths.doubts);
}

/// What only one of two effects has needs no braces, nor what names its effect; what both have does.
#[test]
fn regress_parameters_of_two_effects_find_their_owner() {
    let of = |params: &str| {
        let entry = format!(
            r#"[{{"name": "a", "effects": ["sensor-mass", "local-crack"], "params": {params}}}]"#
        );
        parse_truths(&entry).expect("a list of truths")
    };
    let braces = of(
        r#"{"sensor-mass": {"mass": 0.008}, "local-crack": {"compliance": 0.01, "position": 0.2}}"#,
    );
    for params in [
        r#"{"mass": 0.008, "compliance": 0.01, "position": 0.2}"#,
        r#"{"sensor-mass.mass": 0.008, "local-crack.compliance": 0.01, "local-crack.position": 0.2}"#,
        r#"{"mass": 0.008, "local-crack": {"compliance": 0.01}, "position": 0.2}"#,
    ] {
        let flat = of(params);
        assert_eq!(flat.truths[0].effects, braces.truths[0].effects, "{params}");
        assert!(flat.doubts.is_empty(), "{:?}", flat.doubts);
    }
    let told = |text: &str| parse_truths(text).unwrap().doubts.len();
    let shared =
        r#"[{"name": "a", "effects": ["sensor-mass", "added-mass"], "params": {"mass": 0.01}}]"#;
    assert_eq!(told(shared), 1);
    let alone = r#"[{"name": "a", "effects": ["length"], "params": {"length.relative": 0.01}}]"#;
    assert_eq!(told(alone), 0);
    // Of two values neither is dropped in silence.
    assert_eq!(
        of(r#"{"mass": 0.008, "sensor-mass": {"mass": 0.009}}"#)
            .doubts
            .len(),
        1
    );
    // A fault outside the catalogue may have a mass too.
    let outside =
        r#"[{"name": "a", "effects": ["sensor-mass", "loose-screw"], "params": {"mass": 0.01}}]"#;
    let truth = &parse_truths(outside).unwrap().truths[0];
    assert_eq!(
        truth.effects[0],
        Planted::Catalogue(EffectId::SensorMass, BTreeMap::new())
    );
}

#[test]
fn regress_a_wrong_truth_file_says_what_is_expected() {
    for (text, expected) in [
        ("{}", "write a JSON list"),
        ("[{\"name\": \"a\"}]", "effects"),
        (
            "[{\"name\": \"a\", \"effects\": []}, {\"name\": \"a\", \"effects\": []}]",
            "occurs twice",
        ),
    ] {
        let error = parse_truths(text).expect_err("no truths").to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}

#[test]
fn regress_a_slip_in_a_truth_file_is_told() {
    let told = |entry: &str| -> Vec<String> {
        let file = parse_truths(&format!("[{entry}]")).expect("a list of truths");
        file.doubts.iter().map(ToString::to_string).collect()
    };
    for (entry, expected) in [
        (
            r#"{"name": "a", "effects": ["joint_mass"]}"#,
            "did you mean `joint-mass`?",
        ),
        (r#"{"name": "a", "effects": ["none"]}"#, "`\"effects\": []`"),
        (
            r#"{"name": "a", "effects": ["joint-mass"], "params": {"mas": 0.012}}"#,
            "`mas` is no parameter",
        ),
        (
            r#"{"name": "a", "effects": ["joint-mass"], "params": {"mass": "12 g"}}"#,
            "`mass` is no parameter with a number",
        ),
        (
            r#"{"name": "a", "effects": ["modulus", "length"], "params": {"relative": 0.01}}"#,
            "modulus, length with their own",
        ),
        (r#"{"name": "a", "effects": [], "extra": 1}"#, "`extra`"),
        (
            r#"{"name": "a", "effects": ["sensor-mass"], "within_tolerance": true}"#,
            "`within_tolerance` is true, but",
        ),
    ] {
        let told = told(entry);
        assert_eq!(told.len(), 1, "{entry}: {told:?}");
        assert!(told[0].contains(expected), "{entry}: {}", told[0]);
    }
    for entry in [
        r#"{"name": "a", "effects": []}"#,
        r#"{"name": "a", "effects": ["joint-mass"], "params": {"mass": 0.012, "inertia": 1e-6}}"#,
        r#"{"name": "a", "effects": ["modulus"], "params": {"modulus": {"relative": 0.01}}}"#,
        // What is like no effect is outside the catalogue on purpose, and has parameters of its own.
        r#"{"name": "a", "effects": ["loose-screw"], "params": {"torque": 1}}"#,
        r#"{"name": "a", "effects": ["soft-patch"], "params": {}}"#,
    ] {
        assert_eq!(told(entry), [""; 0], "{entry}");
    }
}
