//! Set-ups that are not as described: places, and what the channels carry.

use tapjoint_beam::effects::{
    ActualSetUp, DescribedSetUp, Effect, EffectId, SensorSignal, SetUpError, actual_set_ups,
    check_set_up,
};

/// Three recordings of two sensors. The first sensor is moved for the last, the taps for the second.
fn described() -> Vec<DescribedSetUp> {
    let recording = |first: f64, tap: f64| DescribedSetUp {
        length: 0.4,
        sensors: vec![first, 0.1],
        tap,
    };
    vec![
        recording(0.3, 0.38),
        recording(0.3, 0.2),
        recording(0.15, 0.38),
    ]
}

fn effect(id: EffectId, pairs: &[(&str, f64)]) -> Effect {
    Effect::from_pairs(id, pairs).unwrap()
}

fn actual(effects: &[Effect]) -> Vec<ActualSetUp> {
    check_set_up(effects, &described()).unwrap();
    actual_set_ups(effects, &described())
}

fn refused(effect: Effect, described: &[DescribedSetUp]) -> SetUpError {
    check_set_up(&[effect], described).unwrap_err()
}

#[test]
fn limit_without_an_error_the_set_up_is_as_described() {
    let modulus = effect(EffectId::Modulus, &[]);
    for (actual, described) in actual(&[modulus]).iter().zip(described()) {
        assert_eq!(
            (&actual.sensors, actual.tap),
            (&described.sensors, described.tap)
        );
        let own = |sensor| SensorSignal {
            sensor,
            factor: 1.0,
        };
        assert_eq!(actual.channels, [own(0), own(1)]);
        assert_eq!(actual.channels[1].of(&[3.0, 5.0]), 5.0);
    }
}

#[test]
fn val_an_offset_acts_where_the_described_place_is_the_same() {
    let places = |recording: f64| {
        let pairs = [("offset", 0.01), ("sensor", 1.0), ("recording", recording)];
        let all = actual(&[effect(EffectId::SensorPosition, &pairs)]);
        assert!(all.iter().all(|one| one.sensors[1] == 0.1));
        all.iter().map(|one| one.sensors[0]).collect::<Vec<f64>>()
    };
    assert_eq!(places(0.0), [0.31, 0.31, 0.16]);
    // The second recording stands for the first as well.
    assert_eq!(places(2.0), places(1.0));
    assert_eq!(places(2.0), [0.31, 0.31, 0.15]);
    assert_eq!(places(3.0), [0.3, 0.3, 0.16]);
    let taps = |recording: f64| {
        let pairs = [("offset", -0.01), ("recording", recording)];
        let all = actual(&[effect(EffectId::TapPosition, &pairs)]);
        all.iter().map(|one| one.tap).collect::<Vec<f64>>()
    };
    assert_eq!(taps(0.0), [0.37, 0.19, 0.37]);
    assert_eq!(taps(3.0), [0.37, 0.2, 0.37]);
}

#[test]
fn val_polarity_and_scale_follow_the_sensor_into_another_channel() {
    let swap = effect(EffectId::SensorSwap, &[]);
    let polarity = effect(EffectId::SensorPolarity, &[("sensor", 2.0)]);
    let scale = effect(EffectId::SensorScale, &[("relative", 0.5), ("sensor", 0.0)]);
    let signals = |effects: &[Effect]| {
        let first = &actual(effects)[0];
        let shown = first.channels.iter();
        shown
            .map(|channel| channel.of(&[3.0, 5.0]))
            .collect::<Vec<f64>>()
    };
    assert_eq!(signals(std::slice::from_ref(&swap)), [5.0, 3.0]);
    assert_eq!(signals(std::slice::from_ref(&polarity)), [3.0, -5.0]);
    assert_eq!(signals(std::slice::from_ref(&scale)), [4.5, 7.5]);
    // In any order.
    let one_order = signals(&[swap.clone(), polarity.clone(), scale.clone()]);
    assert_eq!(one_order, [-7.5, 4.5]);
    assert_eq!(signals(&[scale, polarity, swap]), one_order);
}

#[test]
fn val_two_offsets_of_one_place_add_up() {
    let offset = |offset: f64| effect(EffectId::TapPosition, &[("offset", offset)]);
    let both = actual(&[offset(-0.05), offset(-0.1)]);
    // Sums round in their last digit.
    assert!((both[0].tap - 0.23).abs() < 1e-15, "{both:?}");
}

#[test]
fn limit_a_place_at_the_end_is_on_the_beam() {
    // 0.4 - 0.3 is less than 0.1 in its last digit.
    let end = [("offset", 0.1), ("recording", 1.0)];
    let all = actual(&[effect(EffectId::SensorPosition, &end)]);
    assert_eq!(all[0].sensors[0], 0.4);
    let beyond = effect(EffectId::SensorPosition, &[("offset", 0.11)]);
    let SetUpError::OffTheBeam {
        recording, allowed, ..
    } = refused(beyond, &described())
    else {
        panic!("another error");
    };
    // The least room of all recordings that it acts in.
    assert_eq!(recording, 1);
    assert!((allowed[0] + 0.15).abs() < 1e-15 && (allowed[1] - 0.1).abs() < 1e-15);
}

#[test]
fn regress_numbers_without_meaning_are_refused_and_do_nothing() {
    let cases = [
        (EffectId::SensorPolarity, vec![("sensor", 1.5)]),
        (EffectId::SensorPolarity, vec![("sensor", 3.0)]),
        (EffectId::SensorScale, vec![("sensor", 3.0)]),
        (EffectId::SensorPosition, vec![("recording", 4.0)]),
        (EffectId::TapPosition, vec![("recording", 0.5)]),
        (EffectId::SensorSwap, vec![("other", 1.0)]),
    ];
    let as_described = actual(&[]);
    for (id, pairs) in cases {
        let wrong = effect(id, &pairs);
        assert_eq!(
            actual_set_ups(std::slice::from_ref(&wrong), &described()),
            as_described,
            "{pairs:?}"
        );
        refused(wrong, &described());
    }
    let mut one_sensor = described();
    one_sensor
        .iter_mut()
        .for_each(|one| one.sensors.truncate(1));
    let swap = effect(EffectId::SensorSwap, &[]);
    assert!(matches!(
        refused(swap, &one_sensor),
        SetUpError::TooFewSensors { count: 1, .. }
    ));
}
