use super::*;
use rand::RngExt;

fn moments_of(values: &[f64]) -> RunningSums {
    let mut sums = RunningSums::default();
    values.iter().for_each(|value| sums.add(*value));
    sums
}

/// Tails of a normal variable by tables: 1.6449 at 5 %, 2.5758 at 0.5 %, 3.2905 at 0.05 %. Those of Student's t are in
/// Abramowitz & Stegun (1964), table 26.10: 2.353, 5.841, 12.924 for 3 degrees of freedom, and 1.812, 3.169, 4.587 for 10.
#[test]
fn val_a_score_is_as_improbable_as_students_t() {
    let normal = [1.6449, 2.5758, 3.2905];
    for (freedom, all) in [(3.0, [2.353, 5.841, 12.924]), (10.0, [1.812, 3.169, 4.587])] {
        for (t, expected) in all.into_iter().zip(normal) {
            let score = normal_score(t, freedom);
            // Wallace's approximation: within 3 % from 3 degrees of freedom on.
            assert!(
                (score - expected).abs() < 0.03 * expected,
                "{freedom} {t}: {score}"
            );
            assert!((normal_score(-t, freedom) + score).abs() < 1e-12);
        }
    }
}

/// A test at either end of the limits of a single one has the limit as its score.
#[test]
fn prop_a_test_at_its_limits_has_the_limit_as_score() {
    let before = [0.1, -0.2, 0.05, 0.0, -0.1, 0.15, 0.02];
    for scatter in [TestScatter::Known(0.12), TestScatter::AtLeast(1e-9)] {
        let ends = single_limits(&moments_of(&before), scatter, 3.4).unwrap();
        for end in ends {
            let all = [&before[..], &[end]].concat();
            let found = largest_difference(&moments_of(&all), scatter).unwrap();
            assert_eq!(found.last, 1);
            // Rounding of the sums of squares.
            assert!((found.score.abs() - 3.4).abs() < 1e-6, "{}", found.score);
        }
    }
}

/// Equal values never differ, whatever their scatter is known to be.
#[test]
fn limit_equal_tests_agree() {
    let sums = moments_of(&[0.3; 9]);
    for scatter in [TestScatter::Known(0.1), TestScatter::AtLeast(1e-6)] {
        let found = largest_difference(&sums, scatter).unwrap();
        assert!(found.score.abs() < 1e-9);
    }
    assert!(largest_difference(&moments_of(&[0.3; 4]), TestScatter::AtLeast(1e-6)).is_none());
}

/// A shift and a scale change no score.
#[test]
fn prop_scores_have_no_unit() {
    let values = [0.0, 0.3, -0.1, 0.2, 1.4, 1.2, 1.5];
    let other = values.map(|value| 7.0 - 3.0 * value);
    let [one, other] = [&values, &other]
        .map(|values| largest_difference(&moments_of(values), TestScatter::AtLeast(1e-9)).unwrap());
    assert_eq!([one.last, other.last], [3, 3]);
    assert!((one.score + other.score).abs() < 1e-9);
    let step = most_probable_step(&moments_of(&values), TestScatter::Known(1.0));
    assert_eq!(step.last, 3);
    // 4.1/3 after less 0.4/4 before.
    assert!((step.difference - (4.1 / 3.0 - 0.1)).abs() < 1e-12);
}

/// With normal scatter, which has shorter tails than assumed, alarms are rarer than one in 200. A step of five standard
/// deviations is seen at its first three tests in nine series of ten.
#[test]
fn recover_limits_give_few_alarms_and_show_a_step() {
    const SERIES: u64 = 120;
    const TESTS: usize = 60;
    let limits = Limits::new(&DMatrix::identity(4, 4), 0, TESTS);
    let (mut alarms, mut at_risk, mut seen) = (0, 0, 0);
    for series in 0..SERIES {
        let mut draw = ChaCha8Rng::seed_from_u64(71);
        draw.set_stream(series);
        let mut charts = vec![RunningSums::default(); 4];
        for test in 1..=TESTS {
            let mut highest = 0.0_f64;
            for chart in &mut charts {
                let value: f64 = StandardNormal.sample(&mut draw);
                chart.add(value);
                let found = largest_difference(chart, TestScatter::AtLeast(1e-9));
                highest = highest.max(found.map_or(0.0, |found| found.score.abs()));
            }
            at_risk += 1;
            if limits.at(test).is_some_and(|limit| highest > limit) {
                alarms += 1;
                break;
            }
        }
        let mut chart = RunningSums::default();
        let change = draw.random_range(15..25);
        for test in 0..change + 3 {
            let value: f64 = StandardNormal.sample(&mut draw);
            chart.add(if test < change { value } else { value + 5.0 });
        }
        let found = largest_difference(&chart, TestScatter::AtLeast(1e-9)).unwrap();
        let limit = limits.at(change + 3).unwrap();
        let step = most_probable_step(&chart, TestScatter::AtLeast(1e-9));
        seen += u64::from(found.score > limit && step.last == 3);
    }
    // One in 250 would be 27 alarms of 6800 tests; normal scatter gives about half.
    assert!(200 * alarms < at_risk, "{alarms} of {at_risk}");
    assert!(10 * seen >= 9 * SERIES, "{seen} of {SERIES}");
}
