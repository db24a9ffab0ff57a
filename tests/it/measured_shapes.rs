//! Measured shapes beside predicted ones, and modes chosen by hand, on virtual tests whose answer is known.

use crate::shared::{described, record, virtual_strip};
use tapjoint::pipeline::{
    Analysis, IdentifySettings, MeasuredShape, ShapeBy, measured_shapes, point_shapes, run_test,
    sampled_shapes, shape_agreement,
};
use tapjoint::recording::WavFormat;
use tapjoint::simulate::{Laboratory, TestPlan, nominal_description, plan_test};

const HAMMER: &str = concat!(virtual_strip!(""), "[hammer]\nchannel = 1\n");
const PLACES: [f64; 6] = [0.06, 0.13, 0.205, 0.28, 0.338, 0.41];

/// Six sensors, one recording.
fn six_sensors() -> String {
    let mut text = HAMMER.to_owned();
    for (index, place) in PLACES.iter().enumerate() {
        let (name, channel) = (char::from(b'A' + index as u8), index + 2);
        text.push_str(&format!(
            "[[sensor]]\nname = \"{name}\"\nchannel = {channel}\nposition = {place}\nmass = 0.001\n"
        ));
    }
    text + "[[recording]]\nfile = \"all.wav\"\ntap = 0.385\nband = [0, 1000]\n"
}

/// One sensor near the tip, taps at five places.
fn roving_hammer() -> String {
    let mut text = HAMMER.to_owned()
        + "[[sensor]]\nname = \"A\"\nchannel = 2\nposition = 0.41\nmass = 0.001\n";
    for (index, place) in PLACES[..5].iter().enumerate() {
        text.push_str(&format!(
            "[[recording]]\nfile = \"{index}.wav\"\ntap = {place}\nband = [0, 1000]\n"
        ));
    }
    text
}

/// The virtual test of a description, as its user describes it with `change`.
fn analysed(text: &str, change: impl Fn(String) -> String) -> Analysis {
    let description = described(text);
    let laboratory = Laboratory::ideal();
    let plan = TestPlan {
        description: &description,
        effects: &[],
        laboratory: &laboratory,
        changes: &[],
        repeatability: 0.0,
        joint: None,
        seed: 11,
    };
    let test = plan_test(&plan).unwrap();
    let folder = tempfile::tempdir().unwrap();
    record(&test, &laboratory, folder.path(), WavFormat::Float32);
    let told = change(nominal_description(text, &description, &test).unwrap());
    let settings = IdentifySettings::unperturbed();
    run_test(&described(&told), (folder.path(), "test.toml"), &settings).unwrap()
}

fn shapes_of(analysis: &Analysis) -> Vec<MeasuredShape> {
    measured_shapes(analysis, &sampled_shapes(analysis))
}

/// Distance of a point from the predicted curve.
fn off(analysis: &Analysis, shape: &MeasuredShape, point: usize) -> f64 {
    let predicted = sampled_shapes(analysis);
    let own = predicted.iter().find(|one| one.mode == shape.mode).unwrap();
    let point = &shape.points[point];
    (point.displacement - own.at(point.position)).abs()
}

#[test]
fn recover_shapes_of_sensors_and_of_a_roving_hammer() {
    // Sensors see one motion: what is left are modes beyond the band. Constants of taps, each on what still rings from the
    // tap before, scatter by half a percent.
    for (text, by, places, room) in [
        (six_sensors(), ShapeBy::Sensors, 6, 1e-3),
        (roving_hammer(), ShapeBy::Taps, 5, 1e-2),
    ] {
        let analysis = analysed(&text, |told| told);
        let shapes = shapes_of(&analysis);
        assert_eq!(shapes.len(), 5, "a shape for each mode below 1 kHz");
        for shape in &shapes {
            assert_eq!((shape.by, shape.points.len()), (by, places));
            for point in 0..places {
                let off = off(&analysis, shape, point);
                assert!(off < room, "{by:?}, mode {}: {off}", shape.mode);
            }
        }
        let agreement = shape_agreement(&shapes, &sampled_shapes(&analysis)).unwrap();
        assert_eq!((agreement.by, agreement.places), (by, places));
        for (row, values) in agreement.values.iter().enumerate() {
            assert!(values[row] > 0.9999, "mode {}: {values:?}", row + 1);
            let others = values
                .iter()
                .enumerate()
                .filter(|(column, _)| *column != row);
            // Few places: other modes look alike by a fifth.
            assert!(others.clone().all(|(_, value)| *value < 0.3), "{values:?}");
        }
    }
}

#[test]
fn prop_a_sensor_described_elsewhere_lies_off_its_curves() {
    let analysis = analysed(&six_sensors(), |told| {
        told.replace("position = 0.28\n", "position = 0.24\n")
    });
    let shapes = shapes_of(&analysis);
    // Modes 1 and 2 change little between the two places.
    for shape in shapes.iter().filter(|shape| shape.mode > 2) {
        let offs: Vec<f64> = (0..6).map(|point| off(&analysis, shape, point)).collect();
        let wrong = shape.points.iter().position(|point| point.position == 0.24);
        let most = offs.iter().copied().fold(0.0, f64::max);
        assert_eq!(offs[wrong.unwrap()], most, "mode {}: {offs:?}", shape.mode);
        assert!(most > 0.05, "mode {}: {offs:?}", shape.mode);
    }
}

fn numbered(analysis: &Analysis) -> Vec<(usize, f64)> {
    let modes = analysis.modes.iter();
    modes
        .filter_map(|mode| Some((mode.mode?, mode.frequency)))
        .collect()
}

#[test]
fn prop_poles_chosen_by_hand_are_the_modes() {
    let free = analysed(&six_sensors(), |told| told);
    let all = numbered(&free);
    assert_eq!(all.len(), 5);
    let list = |frequencies: &[f64]| {
        let words = frequencies.iter().map(|one| format!("{one:.3}"));
        format!(
            "[analysis]\npoles = [{}]\n",
            words.collect::<Vec<_>>().join(", ")
        )
    };
    let [one, two, three, _, five] = [0, 1, 2, 3, 4].map(|index| all[index].1);
    // The same modes: chosen poles start the same fits.
    let same = analysed(&six_sensors(), |told| {
        told + &list(&all.iter().map(|mode| mode.1).collect::<Vec<_>>())
    });
    for ((mode, frequency), (number, found)) in all.iter().zip(numbered(&same)) {
        assert_eq!(*mode, number);
        assert!(
            (frequency - found).abs() < 1e-6 * frequency,
            "{frequency} {found}"
        );
    }
    // Fewer modes, and one where there is none.
    let fewer = analysed(&six_sensors(), |told| {
        told + &list(&[one, two, three, 500.0, five])
    });
    let numbers: Vec<usize> = numbered(&fewer).iter().map(|mode| mode.0).collect();
    assert_eq!(numbers, [1, 2, 3, 5]);
    let warned = fewer
        .warnings
        .iter()
        .find(|one| one.code == "pole-without-mode");
    assert!(
        warned.unwrap().to_string().contains("500.0 Hz"),
        "{warned:?}"
    );
}

/// A recording with a mass at the tip, beside those of the roving hammer, and its shape by itself.
#[test]
fn regress_a_recording_with_other_masses_has_other_shapes() {
    let loaded = "[[recording]]\nfile = \"loaded.wav\"\ntap = 0.385\nband = [0, 1000]\n\
                  mass = [{ position = 0.42, mass = 0.2 }]\n";
    let analysis = analysed(&(roving_hammer() + loaded), |told| told);
    for shape in shapes_of(&analysis) {
        assert!(
            !shape.recordings.contains(&"loaded.wav".to_owned()),
            "{shape:?}"
        );
        assert_eq!(shape.points.len(), 5);
    }
    let exported = point_shapes(&analysis);
    assert!(exported.loaded.contains("loaded.wav"));
    for shape in &exported.modes {
        let mut points = shape.values.values();
        assert!(
            points.all(|point| point.recording != "loaded.wav"),
            "{shape:?}"
        );
    }
}

#[test]
fn prop_poles_of_one_recording_are_its_own() {
    let poles = |told: String| {
        let places = "poles = [16.9, 116.7]\n[[recording]]\nfile = \"1.wav\"";
        told.replacen("[[recording]]\nfile = \"1.wav\"", places, 1)
            + "[analysis]\npoles = [332.4, 5000]\n"
    };
    let analysis = analysed(&roving_hammer(), poles);
    for recording in &analysis.recordings {
        let spectra = recording.measurement.spectra.as_ref().unwrap();
        let found: Vec<i64> = spectra
            .readings
            .iter()
            .map(|one| one.frequency.round() as i64)
            .collect();
        match recording.file.as_str() {
            "0.wav" => assert_eq!(found, [17, 117]),
            _ => assert_eq!(found, [332]),
        }
    }
    let outside = analysis
        .warnings
        .iter()
        .find(|one| one.code == "pole-without-mode");
    let outside = outside.unwrap().to_string();
    assert!(
        outside.contains("5000") && outside.contains("no recording"),
        "{outside}"
    );
}
