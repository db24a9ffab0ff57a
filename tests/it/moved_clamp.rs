//! Recordings of other free lengths, where the clamp was moved: described, simulated, identified together.

use std::fs;
use std::path::Path;
use std::process::Command;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use tapjoint::description::TestDescription;
use tapjoint::identify::consistent::{
    BeamTolerances, ConsistentEstimator, ConsistentSettings, FrequencyModel, JointedStructure,
    MovedClamp, Parameter, Quantity,
};
use tapjoint::identify::{IdentifyError, MeasuredMode};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::specimen::PointMass;
use tapjoint::structure::{Assembly, Beam, BeamTheory};

use crate::shared::{steel_strip, strip_table, tapped_strip};

// ---------------------------------------------------------------- the description

/// Two recordings of the strip; what is given belongs to the second, whose `file` stands on line 17.
fn parse(joint: &str, second: &str) -> Result<TestDescription, String> {
    let text = format!(
        "{}[joint]\nkind = \"{joint}\"\n[hammer]\nchannel = 1\n[[sensor]]\nname = \"A\"\nposition = 0.338\n\
         [[recording]]\nfile = \"a.wav\"\n[[recording]]\nfile = \"b.wav\"\n{second}",
        strip_table!()
    );
    TestDescription::parse(&text, "test.toml").map_err(|error| error.to_string())
}

#[test]
fn regress_a_recording_has_a_free_length_of_its_own() {
    let test = parse(
        "cantilever",
        "length = \"200 mm\"\ntap = 0.15\nat = { A = 0.19 }\n",
    )
    .unwrap();
    assert!(test.warnings.is_empty(), "{:?}", test.warnings);
    assert_eq!(test.recordings[0].length, None);
    assert_eq!(test.recordings[1].length, Some(0.2));
    assert_eq!(test.moved_lengths(), [0.2]);
    let own = test.of_length(Some(0.2));
    assert_eq!((own.beam.length, own.recordings.len()), (0.2, 1));
    // A longer overhang is a free length too, with places beyond the described one.
    let longer = parse(
        "cantilever",
        "length = 0.5\ntap = 0.48\nat = { A = 0.45 }\n",
    )
    .unwrap();
    assert_eq!(longer.recordings[1].length, Some(0.5));
    // The length of the beam is no other length.
    let same = parse("cantilever", "length = \"423 mm\"\n").unwrap();
    assert!(same.moved_lengths().is_empty() && same.warnings.is_empty());
    // A sensor that is not placed anew is taken where it was, and a warning says so.
    let unplaced = parse("cantilever", "length = 0.4\n").unwrap();
    let warning = unplaced.warnings[0].to_string();
    assert!(warning.contains("\"A\" is taken where"), "{warning}");
}

#[test]
fn regress_lengths_that_cannot_be_name_line_range_and_remedy() {
    let other =
        |length: f64| format!("[[recording]]\nfile = \"{length}.wav\"\nlength = {length}\n");
    let five: String = [0.41, 0.42, 0.43, 0.44].map(other).concat();
    let at = "at = { A = 0.19 }\n";
    for (joint, second, parts) in [
        (
            "lap",
            "length = 0.2\n".to_owned(),
            &["test.toml:18: ", "a lap joint of other lengths"][..],
        ),
        (
            "free",
            "length = 0.2\n".to_owned(),
            &["test.toml:18: ", "only a clamped beam", "remove `length`"],
        ),
        (
            "cantilever",
            "length = 0.2\n".to_owned(),
            &[
                "test.toml:18: ",
                "sensor A at 0.338 m",
                "0 to 0.2 m",
                "at = { A = ... }",
            ],
        ),
        (
            "cantilever",
            format!("length = 0.2\ntap = 0.3\n{at}"),
            &["test.toml:19: ", "recording[2].tap", "0 to 0.2 m"],
        ),
        (
            "cantilever",
            "length = \"200 kg\"\n".to_owned(),
            &["test.toml:18: ", "recording[2].length"],
        ),
        (
            "cantilever",
            "length = -0.2\n".to_owned(),
            &["test.toml:18: ", "0.001 to 1000 m"],
        ),
        (
            "cantilever",
            format!("length = 0.4\n{five}"),
            &["free length 6 of the test", "up to 5 lengths"],
        ),
        (
            "cantilever",
            "lenght = 0.2\n".to_owned(),
            &["test.toml:18: ", "did you mean `length`?"],
        ),
    ] {
        let error = parse(joint, &second).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "{part} is missing: {error}");
        }
    }
    // The estimate refers to the length of the beam.
    let text = concat!(
        strip_table!(),
        "[joint]\nkind = \"cantilever\"\n[[recording]]\nfile = \"a.wav\"\nlength = 0.2\n"
    );
    let error = TestDescription::parse(text, "test.toml").unwrap_err();
    let error = error.to_string();
    assert!(error.contains("write this length into [beam]"), "{error}");
}

// ---------------------------------------------------------------- the fit

const KT: f64 = 1.4e6;
const KR: f64 = 900.0;
/// Relative standard uncertainty of a frequency (1).
const STD: f64 = 2e-4;

/// The strip of this free length with a sensor of 10 g at its end.
fn strip(length: f64) -> JointedStructure {
    let beam = Beam {
        length,
        ..steel_strip()
    };
    let mut structure = JointedStructure::new(BeamTheory::Timoshenko, beam, Assembly::Cantilever);
    structure.masses = vec![PointMass::new(length, 0.01)];
    structure
}

/// Frequencies of the strip of this length on the joint, the length off by this much (m), with random errors.
fn read(length: f64, off: f64, count: usize, random: &mut ChaCha8Rng) -> Vec<MeasuredMode> {
    let model = FrequencyModel::new(&strip(length + off), count).unwrap();
    let mut point = model.nominal();
    point[Parameter::Kt as usize] = KT.ln();
    point[Parameter::Kr as usize] = KR.ln();
    let mut modes = Vec::new();
    for mode in 1..=count {
        let frequency = model.response(&point, mode, mode as f64).frequency;
        let error: f64 = StandardNormal.sample(random);
        modes.push(MeasuredMode {
            mode,
            frequency: frequency * (1.0 + STD * error),
            std: Some(STD * frequency),
        });
    }
    modes
}

fn moved(length: f64, modes: Vec<MeasuredMode>) -> MovedClamp {
    MovedClamp {
        attachments: Vec::new(),
        structure: strip(length),
        modes,
    }
}

/// Over seeds: intervals of two lengths hold the truth as often as they say, and are shorter than those of one. Every
/// length is off by its own error.
#[test]
fn recover_one_joint_from_two_free_lengths() {
    let seeds = 60;
    let length_std = 5e-4;
    let mut settings = ConsistentSettings::two_parameter();
    settings.tolerances = BeamTolerances {
        length: Some(length_std / 0.423),
        ..BeamTolerances::default()
    };
    let (mut held, mut widths) = ([[0usize; 2]; 2], [[0.0; 2]; 2]);
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut off = || -> f64 {
            let error: f64 = StandardNormal.sample(&mut random);
            length_std * error
        };
        let offs = [off(), off()];
        let long = read(0.423, offs[0], 5, &mut random);
        let short = moved(0.2, read(0.2, offs[1], 4, &mut random));
        let both = [
            ConsistentEstimator::new(&strip(0.423), &long, &settings),
            ConsistentEstimator::of_lengths(&strip(0.423), &long, &[short], &settings),
        ];
        for (which, estimator) in both.into_iter().enumerate() {
            let estimate = estimator.unwrap().estimate().unwrap();
            for (place, (quantity, truth)) in [(Quantity::Kt, KT), (Quantity::Kr, KR)]
                .into_iter()
                .enumerate()
            {
                let found = estimate.quantity(quantity).unwrap();
                let (low, high) = (found.low.unwrap(), found.high.unwrap());
                held[which][place] += usize::from(low <= truth && truth <= high);
                widths[which][place] += (high - low) / truth;
            }
            assert_eq!(estimate.modes_used, [1, 2, 3, 4, 5]);
            let of_short = estimate.modes.iter().filter(|mode| mode.structure == 1);
            assert_eq!(of_short.count(), 4 * which);
        }
    }
    for (which, own) in held.iter().enumerate() {
        // 95 % of 60 are 57; 52 or fewer happen once in 60.
        assert!(own.iter().all(|held| *held > 52), "{which}: {held:?}");
    }
    for place in 0..2 {
        let ratio = widths[1][place] / widths[0][place];
        assert!(ratio < 0.8, "{place}: {widths:?}");
    }
}

#[test]
fn limit_the_same_length_twice_is_two_readings_of_one_beam() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let [first, second] = [0, 1].map(|_| read(0.423, 0.0, 5, &mut random));
    let settings = ConsistentSettings::two_parameter();
    let structure = strip(0.423);
    let joined = moved(0.423, second.clone());
    let joined = ConsistentEstimator::of_lengths(&structure, &first, &[joined], &settings).unwrap();
    let mut mean = first.clone();
    for (mean, second) in mean.iter_mut().zip(&second) {
        mean.frequency = 0.5 * (mean.frequency + second.frequency);
        mean.std = mean.std.map(|std| std / 2f64.sqrt());
    }
    let single = ConsistentEstimator::new(&structure, &mean, &settings).unwrap();
    let [joined, single] = [joined, single].map(|one| one.estimate().unwrap());
    for quantity in [Quantity::Kt, Quantity::Kr] {
        let [joined, single] = [&joined, &single].map(|one| *one.quantity(quantity).unwrap());
        assert!((joined.value.unwrap() / single.value.unwrap() - 1.0).abs() < 1e-5);
        assert!((joined.std.unwrap() / single.std.unwrap() - 1.0).abs() < 1e-2);
    }
}

#[test]
fn limit_more_lengths_than_a_fit_takes_are_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let long = read(0.423, 0.0, 3, &mut random);
    let others = [0.2, 0.25, 0.3, 0.35, 0.4, 0.45].map(|length| moved(length, Vec::new()));
    let settings = ConsistentSettings::two_parameter();
    let refused = ConsistentEstimator::of_lengths(&strip(0.423), &long, &others, &settings);
    assert!(matches!(
        refused,
        Err(IdentifyError::TooManyLengths { found: 7, most: 6 })
    ));
    // A length at which nothing was read says nothing.
    let without = ConsistentEstimator::new(&strip(0.423), &long, &settings).unwrap();
    let with = ConsistentEstimator::of_lengths(&strip(0.423), &long, &others[..5], &settings);
    let [without, with] = [without, with.unwrap()].map(|one| one.fit().joint());
    assert_eq!(without, with);
    let units = StiffnessUnits::of(&steel_strip());
    assert!((with.kx * units.kt / KT - 1.0).abs() < 0.05, "{with:?}");
}

// ---------------------------------------------------------------- the chain

/// The strip, and the same with its clamp moved and the sensor at four fifths again.
const VIRTUAL: &str = tapped_strip!(
    "mass = 0.004\n[[recording]]\nfile = \"long.wav\"\ntap = 0.25\nband = [0, 1200]\n\
     [[recording]]\nfile = \"short.wav\"\nlength = \"200 mm\"\ntap = 0.11\nat = { A = 0.16 }\nband = [0, 2400]\n"
);

fn tapjoint(folder: &Path, arguments: &str) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tapjoint"));
    command
        .current_dir(folder)
        .args(arguments.split_whitespace());
    let done = command.output().unwrap();
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{arguments}: {error}");
    serde_json::from_slice(&done.stdout).unwrap_or_default()
}

#[test]
fn recover_the_joint_from_recordings_of_two_lengths() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("source.toml"), VIRTUAL).unwrap();
    let simulate = "simulate source.toml --out out --quiet --taps 3 --bits 32 --seed 4";
    tapjoint(folder.path(), simulate);
    let text = fs::read_to_string(folder.path().join("out/test.toml")).unwrap();
    assert!(text.contains("length = \"200 mm\""), "{text}");
    let both = tapjoint(folder.path(), "diagnose out/test.toml --quiet --json -");
    let place = text.rfind("[[recording]]").unwrap();
    fs::write(folder.path().join("out/one.toml"), &text[..place]).unwrap();
    let one = tapjoint(folder.path(), "diagnose out/one.toml --quiet --json -");
    for (key, truth) in [("kt", 1.994e6), ("kr", 1223.0)] {
        let [both, one] = [&both, &one].map(|report| {
            let value = |name: &str| report["estimate"][key][name].as_f64().unwrap();
            assert!(
                value("low") <= truth && truth <= value("high"),
                "{key}: {}",
                report["estimate"][key]
            );
            value("high") - value("low")
        });
        assert!(both < 0.9 * one, "{key}: {both} against {one}");
    }
    let lengths = both["lengths"].as_array().unwrap();
    assert_eq!(lengths.len(), 1);
    assert_eq!(lengths[0]["length"], 0.2);
    assert_eq!(lengths[0]["recordings"][0], "short.wav");
    let rows = lengths[0]["prediction"].as_array().unwrap();
    assert!(rows.len() >= 4, "{rows:?}");
    for row in rows {
        assert!(row["error_percent"].as_f64().unwrap().abs() < 0.01, "{row}");
    }
    // Its readings have the numbers of its own length, and the list of modes is that of the beam as described.
    assert_eq!(both["recordings"][1]["modes"][0]["mode"], 1);
    assert_eq!(both["recordings"][1]["aside"], "free length 0.2 m");
    assert_eq!(both["recordings"][1]["free_length"], 0.2);
    assert_eq!(both["modes"], one["modes"]);
    assert_eq!(both["gap"]["verdict"]["kind"], "no-gap");
    assert!(one.get("lengths").is_none());
}

#[test]
fn regress_effects_at_a_place_are_not_simulated_with_a_moved_clamp() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("source.toml"), VIRTUAL).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tapjoint"));
    command.current_dir(folder.path()).args([
        "simulate",
        "source.toml",
        "--out",
        "out",
        "--with",
        "added-mass:mass=0.01,position=0.3",
    ]);
    let done = command.output().unwrap();
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(error.contains("`added-mass` sits at a place"), "{error}");
    assert!(!folder.path().join("out").exists());
}
