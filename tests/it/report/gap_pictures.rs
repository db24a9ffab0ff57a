//! Pictures of the gap: where its errors stand, and what each point says.

use tapjoint::effects::EffectId;
use tapjoint::gap::{Hypothesis, HypothesisResult, LocationMap, Residual, Verdict};
use tapjoint::report::charts::diagnosis::{gap, place_map};
use tapjoint::report::document::{Document, GapPlaceSection, GapSection};
use tapjoint::report::picture::{Mark, Series, render_svg};

fn document(gap: GapSection) -> Document {
    Document {
        gap: Some(gap),
        ..Document::default()
    }
}

/// One mode, seen in a hard and in a soft level of one recording and in another recording.
fn of_three_levels() -> Document {
    let pull = |recording: &str, level: f64, error_percent: f64| Residual {
        mode: 1,
        recording: recording.into(),
        level: Some(level),
        error_percent,
        ..Residual::default()
    };
    document(GapSection {
        place: Some(GapPlaceSection {
            modes: vec![
                pull("low.wav", 1.0, 0.5),
                pull("low.wav", 0.25, -12.345),
                pull("high.wav", 0.25, 0.1),
            ],
            ..GapPlaceSection::default()
        }),
        hypotheses: vec![HypothesisResult::default()],
        ..GapSection::default()
    })
}

#[test]
fn regress_two_levels_of_one_recording_stand_apart_and_are_told_apart() {
    let document = of_three_levels();
    let chart = gap(&document).unwrap();
    let live = chart.page().unwrap();
    let errors = &live.blocks[0].panels[0].series;
    let is_ring = |set: &&Series| matches!(set.mark, Mark::Ring(_));
    let before = errors.iter().find(is_ring).unwrap();
    // Three seats over half of the mode's width, each in the middle of its third.
    let expected = [1.0 - 0.5 / 3.0, 1.0, 1.0 + 0.5 / 3.0];
    for (index, expected) in expected.into_iter().enumerate() {
        // The page has places with seven digits.
        assert!((before.at(index) - expected).abs() < 1e-3, "{:?}", before.x);
    }
    let words = [
        "mode 1 in low.wav",
        "mode 1 in low.wav (level 0.25)",
        "mode 1 in high.wav (level 0.25)",
    ];
    assert_eq!(before.words, words);
    assert_eq!(before.said[1], "\u{2212}12 %");
    let svg = render_svg(&chart.draw());
    for words in words {
        assert_eq!(
            svg.matches(&format!("{words} \u{b7}")).count(),
            1,
            "{words}"
        );
    }
}

/// Two levels, with an effect or none at the head of the hypotheses.
fn with_verdict(verdict: &Verdict, hypotheses: &[Hypothesis]) -> Document {
    let mut document = of_three_levels();
    let gap = document.gap.as_mut().unwrap();
    gap.verdict = verdict.clone();
    for pull in &mut gap.place.as_mut().unwrap().modes {
        pull.error_percent_after = 99.0;
    }
    let found = hypotheses.iter().map(|hypothesis| HypothesisResult {
        hypothesis: hypothesis.clone(),
        ..HypothesisResult::default()
    });
    gap.hypotheses = found.collect();
    document
}

#[test]
fn regress_an_effect_that_nobody_holds_for_the_cause_is_not_shown() {
    use EffectId::{JointDamping, Length, LocalCrack, Modulus, SensorMass};
    let one = |effect: EffectId| Hypothesis::Effects(vec![effect]);
    let cases = [
        (
            Verdict::Named(vec![SensorMass]),
            vec![one(SensorMass), Hypothesis::None],
            "and with sensor-mass",
        ),
        (
            Verdict::Group(vec![Modulus, Length]),
            vec![Hypothesis::Unknown, one(Modulus), one(Length)],
            "and with modulus",
        ),
        (
            Verdict::Set(vec![one(LocalCrack), Hypothesis::None]),
            vec![one(LocalCrack), Hypothesis::None],
            "and with local-crack",
        ),
        (
            Verdict::NoGap,
            vec![one(JointDamping), Hypothesis::None],
            "(nothing is missing)",
        ),
        (
            Verdict::Unknown,
            vec![one(Modulus), Hypothesis::Unknown],
            "(nothing in the catalogue explains the rest)",
        ),
        (
            Verdict::NotEnoughData(String::new()),
            vec![one(Modulus), Hypothesis::None],
            "(these data do not decide what is missing)",
        ),
    ];
    for (kind, hypotheses, words) in cases {
        let document = with_verdict(&kind, &hypotheses);
        let chart = gap(&document).unwrap();
        let live = chart.page().unwrap();
        let panel = &live.blocks[0].panels[0];
        let shown: Vec<&str> = panel.series.iter().map(|set| set.name.as_str()).collect();
        let svg = render_svg(&chart.draw());
        assert!(svg.contains(words), "{kind:?}");
        assert!(chart.caption.contains(words), "{kind:?}");
        match words.strip_prefix("and ") {
            Some(name) => {
                assert_eq!(shown.last(), Some(&name), "{kind:?}");
                assert!(svg.contains("+99 %"), "{kind:?}");
            }
            None => {
                assert_eq!(shown.len(), 2, "{kind:?}: {shown:?}");
                assert!(!svg.contains("+99 %"), "{kind:?}");
                // Nor does it stretch the axis.
                assert!(panel.y.high < 20.0, "{kind:?}: {:?}", panel.y);
            }
        }
    }
}

#[test]
fn regress_local_changes_have_the_digits_of_their_uncertainty() {
    let map = LocationMap {
        positions: vec![0.1, 0.2],
        stiffness: vec![0.034_12, 0.123_45],
        stiffness_std: vec![0.12, 0.000_005],
        ..LocationMap::default()
    };
    let document = document(GapSection {
        map: Some(map),
        ..GapSection::default()
    });
    let live = place_map(&document).unwrap().page().unwrap();
    let is_curve = |set: &&Series| matches!(set.mark, Mark::Curve(_));
    let series = &live.blocks[0].panels[1].series;
    let set = series.iter().find(is_curve).unwrap();
    assert_eq!(set.said, ["3 \u{b1} 24 %", "12.34500 \u{b1} 0.00098 %"]);
}
