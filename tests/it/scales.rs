//! Wrong scales of hammer and sensors, through the whole pipeline: modal constants that no beam of this mass has.

use std::fs;
use std::path::Path;
use tapjoint::description::TestDescription;
use tapjoint::pipeline::{IdentifySettings, run_test};

/// Doubts about scales in a sample, with the scales of the channels (hammer, A, B) changed by these factors.
fn doubts(sample: &str, factors: [f64; 3]) -> Vec<String> {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let folder = samples.join(sample);
    let text = fs::read_to_string(folder.join("test.toml")).unwrap();
    let (mut changed, mut channel) = (String::new(), factors.iter());
    for line in text.lines() {
        match line.strip_prefix("scale = ") {
            Some(scale) => {
                let scale: f64 = scale.parse().unwrap();
                let factor = channel.next().unwrap();
                changed.push_str(&format!("scale = {:?}\n", scale * factor));
            }
            None => changed.push_str(&format!("{line}\n")),
        }
    }
    assert!(channel.next().is_none(), "{sample}: {text}");
    let test = TestDescription::parse(&changed, "test.toml").unwrap();
    let place = (folder.as_path(), "test.toml");
    let analysis = run_test(&test, place, &IdentifySettings::default()).unwrap();
    let found = analysis.warnings.iter();
    let found = found.filter(|warning| warning.code == "doubtful-scale");
    found.map(ToString::to_string).collect()
}

#[test]
fn recover_wrong_scales_are_named() {
    const HAMMER: &str = "the hammer or of A, B";
    for (sample, factors, words) in [
        // A hammer whose newtons are kgf, as accelerations in g give the same constants.
        ("cantilever", [9.807, 1.0, 1.0], ["smaller", HAMMER]),
        ("cantilever", [1e-3, 1.0, 1.0], ["larger", HAMMER]),
        (
            "cantilever",
            [1.0, 1.0 / 9.807, 1.0],
            ["smaller", "sensor A"],
        ),
        ("cantilever", [1.0, 1.0, 4.448], ["larger", "sensor B"]),
        ("lap-joint", [1.0, 9.807, 9.807], ["larger", HAMMER]),
        ("lap-joint", [1.0, 5.0, 0.2], ["A (", "B ("]),
    ] {
        let found = doubts(sample, factors);
        let [text] = &found[..] else {
            panic!("{sample}, {factors:?}: {found:?}");
        };
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    }
}

#[test]
fn limit_right_scales_are_not_doubted() {
    // A calibration wrong by a third is not a mistake of units.
    for factors in [[1.0; 3], [1.3, 1.0, 0.75]] {
        for sample in ["cantilever", "cantilever-3p", "lap-joint"] {
            let found = doubts(sample, factors);
            assert!(found.is_empty(), "{sample}, {factors:?}: {found:?}");
        }
    }
}
