//! The model with what a diagnosis found, as text and as frequencies.

use crate::shared::{five_recordings, steel_strip, strip_on_springs, strip_table};
use tapjoint::description::{LapOverlap, TestDescription};
use tapjoint::effects::{Effect, EffectId};
use tapjoint::gap::{GapSettings, Verdict, diagnose, observe};
use tapjoint::study::updated_model::{described_effects, described_frequencies, updated_model};

/// The strip with this joint and what follows.
fn described(joint: &str, rest: &str) -> Result<TestDescription, String> {
    let text = format!("{}[joint]\n{joint}{rest}", strip_table!());
    TestDescription::parse(&text, "test.toml").map_err(|error| error.to_string())
}

const SPRINGS: &str = "kind = \"cantilever\"\nkt = 1.9e6\nkr = 320\n";

#[test]
fn regress_the_first_recording_is_taken_whole() {
    let recording = "[[recording]]\nfile = \"a.wav\"\ntap = 0.4\n";
    let mass = "[[recording.mass]]\nposition = 0.423\nmass = 0.02\n";
    let sensor =
        |place: f64| format!("[[sensor]]\nname = \"A\"\nposition = {place}\nmass = 0.04\n");
    let frequencies = |sensor: &str, at: &str| {
        let rest = format!("{sensor}{recording}{at}{mass}");
        described_frequencies(&described(SPRINGS, &rest).unwrap(), 4).unwrap()
    };
    let moved = frequencies(&sensor(0.1), "at = { A = 0.4 }\n");
    // The same place, said in another way, and another place.
    assert_eq!(moved, frequencies(&sensor(0.4), ""));
    let elsewhere = frequencies(&sensor(0.1), "");
    assert!(moved[0] < 0.97 * elsewhere[0], "{moved:?} {elsewhere:?}");
}

#[test]
fn regress_what_was_fastened_is_written_as_known_and_can_be_read_again() {
    let nominal = strip_on_springs(1.0, Some(0.004));
    let observed = observe(&five_recordings(), &nominal, &[], 401).unwrap();
    let diagnosis = diagnose(&observed, &nominal, &GapSettings::default()).unwrap();
    assert_eq!(diagnosis.verdict, Verdict::NoGap);
    let text = |masses: &str| {
        let rest = format!("[[recording]]\nfile = \"a.wav\"\ntap = 0.4\n{masses}");
        let test = described(SPRINGS, &rest).unwrap();
        updated_model(&test, &diagnosis).unwrap().text
    };
    assert!(!text("").contains("[[effect]]"), "{}", text(""));
    // More than the beam weighs, which a description may say.
    let text = text("[[recording.mass]]\nposition = 0.2\nmass = 2\n");
    assert_eq!(text.matches("# Known, not found").count(), 1, "{text}");
    let read = TestDescription::parse(&text, "updated-model.toml").unwrap();
    let effects = described_effects(&read).unwrap();
    let pairs = [("mass", 2.0), ("position", 0.2)];
    let expected = Effect::from_pairs(EffectId::AddedMass, &pairs).unwrap();
    assert_eq!(effects, [expected]);
}

#[test]
fn regress_a_property_that_is_not_the_described_one_says_so() {
    let nominal = strip_on_springs(1.0, Some(0.004));
    let observed = observe(&five_recordings(), &nominal, &[], 401).unwrap();
    let mut diagnosis = diagnose(&observed, &nominal, &GapSettings::default()).unwrap();
    let test = described(SPRINGS, "").unwrap();
    let mut text = |factor: f64| {
        for found in &mut diagnosis.hypotheses {
            let mut beam = steel_strip();
            beam.density *= factor;
            found.beam = Some(beam);
        }
        updated_model(&test, &diagnosis).unwrap().text
    };
    assert!(!text(1.0).contains("# Described:"));
    let text = text(1.01);
    let comment = format!("# Described: {}.\ndensity = ", test.beam.density);
    assert!(text.contains(&comment), "{text}");
    let read = TestDescription::parse(&text, "updated-model.toml").unwrap();
    assert_eq!(read.beam.density, test.beam.density * 1.01);
}

#[test]
fn limit_every_mass_that_may_be_fastened_may_be_an_effect() {
    // Three times the beam's 0.83 kg.
    for (mass, possible) in [(2.49, true), (2.5, false)] {
        let fastened = format!(
            "[[recording]]\nfile = \"a.wav\"\ntap = 0.4\n[[recording.mass]]\nposition = 0.2\nmass = {mass}\n"
        );
        assert_eq!(described(SPRINGS, &fastened).is_ok(), possible, "{mass}");
        let pairs = [("mass", mass), ("position", 0.2)];
        assert!(
            Effect::from_pairs(EffectId::AddedMass, &pairs).is_ok(),
            "{mass}"
        );
    }
    let pairs = [("mass", 1001.0), ("position", 0.2)];
    assert!(Effect::from_pairs(EffectId::AddedMass, &pairs).is_err());
}

#[test]
fn regress_a_structure_that_cannot_be_is_not_blamed_on_an_effect() {
    let effect = "[[effect]]\nid = \"modulus\"\nrelative = 0.1\n";
    for effect in ["", effect] {
        let mut test = described("kind = \"lap\"\nkt = 5e6\nkr = 2000\n", effect).unwrap();
        assert!(described_frequencies(&test, 3).is_ok());
        // More than the beam is long: no description says so, but who builds one can.
        let (length, mass) = (1.0, 0.0);
        test.joint.overlap = Some(LapOverlap { length, mass });
        let error = described_frequencies(&test, 3).unwrap_err();
        assert_eq!(error.line, None, "{error}");
        assert!(
            error.to_string().starts_with("length of the overlap"),
            "{error}"
        );
    }
}
