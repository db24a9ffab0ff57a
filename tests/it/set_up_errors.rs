//! Set-ups that are not as described: what recordings and planned observations of them show.

use crate::golden::assert_snapshot;
use crate::shared::{
    calibrated_strip, described, effect, planned, record, recording_table, steel_strip,
    strip_on_springs,
};
use std::fmt::Write;
use tapjoint::description::TestDescription;
use tapjoint::effects::{Effect, EffectId};
use tapjoint::gap::{PlannedConfiguration, TestPlan, observe};
use tapjoint::identify::observation::{Observations, ObservedMode};
use tapjoint::pipeline::{IdentifySettings, observations, run_test};
use tapjoint::recording::WavFormat;
use tapjoint::simulate::{
    Laboratory, TestPlan as SimulatedTest, Truth, nominal_description, plan_test, truth_of,
};
use tapjoint::structure::specimen::{Body, Joint, Mesh, Specimen, SpecimenModes};

const CANTILEVER: &str = calibrated_strip!(
    "[[sensor]]\nname = \"B\"\nchannel = 3\nscale = 2000\nposition = 0.205\n",
    recording_table!("first.wav", 0.385, 700),
    recording_table!("moved.wav", 0.26, 700),
    "at = { A = 0.12 }\n"
);

/// Modes in the band.
const MODES: usize = 4;

fn plan<'a>(
    description: &'a TestDescription,
    effects: &'a [Effect],
    laboratory: &'a Laboratory,
) -> SimulatedTest<'a> {
    SimulatedTest {
        description,
        effects,
        laboratory,
        changes: &[],
        repeatability: 0.0,
        joint: None,
        seed: 5,
    }
}

/// What the recordings of a perfect laboratory show to the reader of the description.
fn recorded(effects: &[Effect]) -> Observations {
    let description = described(CANTILEVER);
    let mut laboratory = Laboratory::ideal();
    // Nothing rings from a tap before.
    laboratory.hammer.taps = 1;
    laboratory.hammer.interval = Some(5.0);
    let test = plan_test(&plan(&description, effects, &laboratory)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    record(&test, &laboratory, folder.path(), WavFormat::Float32);
    let text = nominal_description(CANTILEVER, &description, &test).unwrap();
    let told = described(&text);
    let settings = IdentifySettings::unperturbed();
    let analysis = run_test(&told, (folder.path(), "test.toml"), &settings).unwrap();
    let observed = observations(&analysis);
    assert_eq!(observed.configurations.len(), 2);
    for (seen, tap) in observed.configurations.iter().zip([0.385, 0.26]) {
        assert_eq!(seen.tap, Some(tap), "the description keeps its places");
        assert_eq!(seen.modes.len(), MODES);
    }
    observed
}

fn true_modes() -> SpecimenModes {
    let joint = Joint {
        kt: 1.994e6,
        kr: 1223.0,
        coupling: 0.0,
    };
    let specimen = Specimen::new(Body::One(steel_strip()), Some(joint));
    specimen.modes(MODES, Mesh::SIMULATION).unwrap()
}

/// Products of the shapes at each sensor and at the taps (1/kg), by constant and shape.
fn constants(mode: &ObservedMode) -> Vec<f64> {
    let whole = mode.constant.unwrap().value;
    let shape = mode.shape.iter();
    shape.map(|sensor| whole * sensor.value).collect()
}

/// Checks what each recording shows: for each sensor's channel the factor, and the place that it senses; and the taps.
fn assert_shows(effects: &[Effect], expected: [([(f64, f64); 2], f64); 2]) {
    let (observed, bare) = (recorded(effects), recorded(&[]));
    let truth = true_modes();
    let configurations = observed.configurations.iter();
    for ((seen, as_described), (channels, tap)) in
        configurations.zip(&bare.configurations).zip(expected)
    {
        for (number, (mode, other)) in seen.modes.iter().zip(&as_described.modes).enumerate() {
            // Sensors without mass: a frequency is what it was, but for the fit of another signal.
            let change = mode.frequency / other.frequency - 1.0;
            assert!(change.abs() < 1e-6, "mode {number}: {change:e}");
            for (found, (factor, place)) in constants(mode).iter().zip(channels) {
                let at = |x| truth.displacement(number, x);
                let wanted = factor * at(place) * at(tap);
                // 2 % of a constant at an antinode, 4/mass: fits, and filters of the recorder.
                let size = 0.02 * 4.0 / steel_strip().mass();
                assert!(
                    (found - wanted).abs() < size,
                    "mode {number} at {place}: {found} for {wanted}"
                );
            }
        }
    }
}

#[test]
fn recover_the_place_at_which_a_sensor_really_is() {
    // 24 mm is a twentieth of the longest wave, and a fifth of the shortest.
    let pairs = [("offset", 0.024), ("sensor", 1.0), ("recording", 1.0)];
    assert_shows(
        &[effect(EffectId::SensorPosition, &pairs)],
        [
            ([(1.0, 0.362), (1.0, 0.205)], 0.385),
            ([(1.0, 0.12), (1.0, 0.205)], 0.26),
        ],
    );
}

#[test]
fn recover_the_place_at_which_the_hammer_really_strikes() {
    let pairs = [("offset", -0.03), ("recording", 2.0)];
    assert_shows(
        &[effect(EffectId::TapPosition, &pairs)],
        [
            ([(1.0, 0.338), (1.0, 0.205)], 0.385),
            ([(1.0, 0.12), (1.0, 0.205)], 0.23),
        ],
    );
}

#[test]
fn recover_a_sensor_that_points_the_other_way() {
    assert_shows(
        &[effect(EffectId::SensorPolarity, &[("sensor", 2.0)])],
        [
            ([(1.0, 0.338), (-1.0, 0.205)], 0.385),
            ([(1.0, 0.12), (-1.0, 0.205)], 0.26),
        ],
    );
}

#[test]
fn recover_signals_in_the_wrong_channels() {
    // Half as sensitive, in a channel that is read as if it were twice as sensitive; and the other way round.
    assert_shows(
        &[effect(EffectId::SensorSwap, &[])],
        [
            ([(2.0, 0.205), (0.5, 0.338)], 0.385),
            ([(2.0, 0.205), (0.5, 0.12)], 0.26),
        ],
    );
}

#[test]
fn recover_a_wrong_calibration_of_one_sensor_and_of_the_hammer() {
    let one = [("relative", -0.3), ("sensor", 1.0)];
    assert_shows(
        &[effect(EffectId::SensorScale, &one)],
        [
            ([(0.7, 0.338), (1.0, 0.205)], 0.385),
            ([(0.7, 0.12), (1.0, 0.205)], 0.26),
        ],
    );
    let all = [("relative", 0.5), ("sensor", 0.0)];
    assert_shows(
        &[effect(EffectId::SensorScale, &all)],
        [
            ([(1.5, 0.338), (1.5, 0.205)], 0.385),
            ([(1.5, 0.12), (1.5, 0.205)], 0.26),
        ],
    );
}

// ---------------------------------------------------------------- the simulator

fn truth(text: &str, effects: &[Effect]) -> Truth {
    let (description, laboratory) = (described(text), Laboratory::ideal());
    let plan = plan(&description, effects, &laboratory);
    truth_of(&plan, &plan_test(&plan).unwrap())
}

#[test]
fn limit_a_moved_sensor_weighs_where_it_is() {
    let heavy = CANTILEVER.replace("scale = 4000", "scale = 4000\nmass = \"24 g\"");
    let moved = heavy.replace("position = 0.338", "position = 0.346");
    let pairs = [("offset", 0.008), ("sensor", 1.0), ("recording", 1.0)];
    let offset = effect(EffectId::SensorPosition, &pairs);
    let frequencies = |truth: &Truth| -> Vec<f64> {
        let modes = truth.recordings.iter().flat_map(|one| &one.modes);
        modes.map(|mode| mode.frequency).collect()
    };
    let wanted = frequencies(&truth(&moved, &[]));
    let found = frequencies(&truth(&heavy, std::slice::from_ref(&offset)));
    // 0.338 + 0.008 is 0.346 but for its last digit.
    for (found, wanted) in found.iter().zip(&wanted) {
        assert!((found / wanted - 1.0).abs() < 1e-12, "{found} for {wanted}");
    }
    assert_ne!(found, frequencies(&truth(&heavy, &[])));
    // The same of a mass that the description does not know.
    let unknown = effect(EffectId::SensorMass, &[("mass", 0.024)]);
    let light = frequencies(&truth(CANTILEVER, &[unknown.clone(), offset]));
    let there = CANTILEVER.replace("position = 0.338", "position = 0.346");
    for (found, wanted) in light.iter().zip(frequencies(&truth(&there, &[unknown]))) {
        assert!((found / wanted - 1.0).abs() < 1e-12, "{found} for {wanted}");
    }
}

#[test]
fn limit_the_description_does_not_tell_of_the_set_up() {
    let description = described(CANTILEVER);
    let laboratory = Laboratory::ideal();
    let written = |effects: &[Effect]| {
        let test = plan_test(&plan(&description, effects, &laboratory)).unwrap();
        nominal_description(CANTILEVER, &description, &test).unwrap()
    };
    let bare = written(&[]);
    for id in EffectId::ALL
        .into_iter()
        .filter(|id| id.group().name() == "set-up")
    {
        assert_eq!(written(&[effect(id, &[])]), bare, "{}", id.name());
    }
}

#[test]
fn limit_swapped_sensors_without_scales_are_of_one_type() {
    let text = CANTILEVER
        .replace("scale = 4000\n", "")
        .replace("scale = 2000\n", "");
    let description = described(&text);
    let laboratory = Laboratory::ideal();
    let swap = [effect(EffectId::SensorSwap, &[])];
    let test = plan_test(&plan(&description, &swap, &laboratory)).unwrap();
    assert_eq!(test.scales[1], test.scales[2]);
    let gains = truth(&text, &swap).recordings[0].gains.clone();
    assert_eq!(gains, [1.0; 3]);
    // Twice the signal needs twice the range.
    let scale = [effect(EffectId::SensorScale, &[("relative", 9.0)])];
    assert_eq!(truth(&text, &scale).recordings[0].gains, [1.0, 10.0, 10.0]);
    let wide = plan_test(&plan(&description, &scale, &laboratory)).unwrap();
    assert_ne!(wide.scales[1], test.scales[1]);
}

#[test]
fn prop_a_joint_described_as_rigid_stays_so_and_gives() {
    let text = CANTILEVER
        .replace("kt = 1.994e6", "kt = \"rigid\"")
        .replace("kr = 1223.0", "kr = \"rigid\"");
    let description = described(&text);
    let laboratory = Laboratory::ideal();
    let gives = [effect(EffectId::JointCompliance, &[("rotation", 0.04)])];
    let plan = plan(&description, &gives, &laboratory);
    let test = plan_test(&plan).unwrap();
    let told = described(&nominal_description(&text, &description, &test).unwrap());
    let rigid = Some(f64::INFINITY);
    assert_eq!((told.joint.kt, told.joint.kr), (rigid, rigid));
    let joint = truth_of(&plan, &test).recordings[0].joint.clone().unwrap();
    // E I/L over the stiffness, of the joint as it is; translation stays rigid.
    assert!((joint.ky.unwrap() - 25.0).abs() < 1e-9, "{joint:?}");
    assert_eq!(joint.kt, None);
}

/// Description, effect, parameters.
type Refused<'a> = (&'a str, EffectId, &'a [(&'a str, f64)]);

#[test]
fn regress_set_ups_that_cannot_be() {
    use EffectId::{
        JointCompliance, SensorPolarity, SensorPosition, SensorScale, SensorSwap, TapPosition,
    };
    let one_sensor = CANTILEVER.replace(
        "[[sensor]]\nname = \"B\"\nchannel = 3\nscale = 2000\nposition = 0.205\n",
        "",
    );
    let cases: [Refused; 14] = [
        (CANTILEVER, SensorPosition, &[("sensor", 1.5)]),
        (CANTILEVER, SensorPosition, &[("sensor", 3.0)]),
        (CANTILEVER, SensorPosition, &[("recording", 3.0)]),
        (CANTILEVER, SensorPosition, &[("offset", 0.09)]),
        (
            CANTILEVER,
            SensorPosition,
            &[("offset", -0.25), ("sensor", 2.0)],
        ),
        (
            CANTILEVER,
            SensorPosition,
            &[("offset", -0.2), ("recording", 2.0)],
        ),
        (CANTILEVER, SensorPolarity, &[("sensor", 7.0)]),
        (CANTILEVER, SensorSwap, &[("other", 1.0)]),
        (CANTILEVER, SensorSwap, &[("other", 3.0)]),
        (&one_sensor, SensorSwap, &[]),
        (&one_sensor, SensorScale, &[("sensor", 2.0)]),
        (CANTILEVER, TapPosition, &[("recording", 0.5)]),
        (CANTILEVER, TapPosition, &[("offset", 0.05)]),
        (CANTILEVER, JointCompliance, &[]),
    ];
    let mut messages = String::new();
    for (text, id, pairs) in cases {
        let description = described(text);
        let laboratory = Laboratory::ideal();
        let planted = [effect(id, pairs)];
        let Err(error) = plan_test(&plan(&description, &planted, &laboratory)) else {
            panic!("{pairs:?} of {} was accepted", id.name());
        };
        let sensors = description.sensors.len();
        let _ = writeln!(
            messages,
            "{} {pairs:?}; sensors: {sensors}\n    {error}",
            id.name()
        );
    }
    assert_snapshot("errors_set_ups_that_cannot_be", &messages);
}

// ---------------------------------------------------------------- planned observations

fn two_sensors(positions: [f64; 2], tap: f64) -> PlannedConfiguration {
    PlannedConfiguration {
        sensors: vec![
            ("A".to_owned(), positions[0]),
            ("B".to_owned(), positions[1]),
        ],
        tap,
        ..planned(0.5, 0.5, 1.0)
    }
}

fn observed(configurations: Vec<PlannedConfiguration>, effects: &[Effect]) -> Observations {
    let plan = TestPlan {
        configurations,
        modes: 5,
        ..crate::shared::five_recordings()
    };
    observe(&plan, &strip_on_springs(1.0, Some(0.024)), effects, 7).unwrap()
}

#[test]
fn limit_planned_places_are_described_and_true_ones_observed() {
    let described = || {
        vec![
            two_sensors([0.33, 0.2], 0.38),
            two_sensors([0.33, 0.2], 0.25),
            two_sensors([0.15, 0.2], 0.38),
        ]
    };
    // Sensor A weighs 24 g, so that frequencies move with it.
    let sensor = [("offset", 0.03), ("recording", 1.0)];
    let tap = [("offset", -0.02), ("recording", 3.0)];
    let wrong = observed(
        described(),
        &[
            effect(EffectId::SensorPosition, &sensor),
            effect(EffectId::TapPosition, &tap),
        ],
    );
    let right = observed(
        vec![
            two_sensors([0.36, 0.2], 0.36),
            two_sensors([0.36, 0.2], 0.25),
            two_sensors([0.15, 0.2], 0.36),
        ],
        &[],
    );
    for (wrong, right) in wrong.configurations.iter().zip(&right.configurations) {
        for (wrong, right) in wrong.modes.iter().zip(&right.modes) {
            // The same random numbers; sums of places round in their last digit.
            assert!((wrong.frequency / right.frequency - 1.0).abs() < 1e-9);
            for (wrong, right) in constants(wrong).iter().zip(constants(right)) {
                assert!((wrong - right).abs() < 1e-9, "{wrong} for {right}");
            }
        }
    }
    let places = wrong.configurations.iter();
    let places: Vec<_> = places
        .map(|one| (one.sensors[0].position, one.tap))
        .collect();
    let stated = [(0.33, 0.38), (0.33, 0.25), (0.15, 0.38)];
    assert_eq!(
        places,
        stated.map(|(sensor, tap)| (Some(sensor), Some(tap)))
    );
}

#[test]
fn limit_planned_channels_show_what_they_carry() {
    let exact = |effects: &[Effect]| {
        let plan = TestPlan {
            configurations: vec![two_sensors([0.33, 0.2], 0.38)],
            scatter: 0.0,
            ..crate::shared::five_recordings()
        };
        let observed = observe(&plan, &strip_on_springs(1.0, None), effects, 7).unwrap();
        observed.configurations[0].modes.clone()
    };
    let bare = exact(&[]);
    let cases: [(Effect, [(usize, f64); 2]); 4] = [
        (effect(EffectId::SensorPolarity, &[]), [(0, -1.0), (1, 1.0)]),
        (effect(EffectId::SensorSwap, &[]), [(1, 1.0), (0, 1.0)]),
        (
            effect(EffectId::SensorScale, &[("relative", 1.0), ("sensor", 2.0)]),
            [(0, 1.0), (1, 2.0)],
        ),
        (
            effect(EffectId::SensorScale, &[("relative", -0.5)]),
            [(0, 0.5), (1, 0.5)],
        ),
    ];
    for (effect, channels) in cases {
        for (mode, bare) in exact(std::slice::from_ref(&effect)).iter().zip(&bare) {
            assert_eq!(mode.frequency, bare.frequency);
            let (found, of_sensors) = (constants(mode), constants(bare));
            // The strongest channel is the reference, as in a measurement.
            let largest = found.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            assert_eq!(found[mode.reference.unwrap()].abs(), largest);
            for (found, (sensor, factor)) in found.iter().zip(channels) {
                let wanted = factor * of_sensors[sensor];
                // Products of ratios round.
                assert!((found - wanted).abs() < 1e-12 * largest, "{effect:?}");
            }
        }
    }
}
