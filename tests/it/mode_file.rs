//! `[measured] file`: modes of a universal file, from the file to the joint.

use std::fs;
use tapjoint::description::TestDescription;
use tapjoint::identify::consistent::Quantity;
use tapjoint::pipeline::{Analysis, IdentifySettings, PipelineError, run_test};
use tapjoint::structure::joint::StiffnessUnits;
use tapjoint::structure::{
    Assembly, BeamTheory, JointStiffness, ModeShape, mode_shapes, natural_frequencies,
};

use crate::shared::{steel_strip, strip_table};

/// Five modes of the strip on 1.4 MN/m and 1200 N m/rad: 80 finite elements, exported by pyuff 2.5.8.
const BY_PYUFF: &str = include_str!("../../src/signal/tests/it/recording_uff/pyuff-complex.unv");

/// Places of the measured points (m).
const POINTS: [f64; 6] = [0.04, 0.11, 0.18, 0.25, 0.33, 0.4];

/// Runs the strip's test with this file of modes; `more` goes on in [measured].
fn run(file: &str, kind: &str, more: &str) -> Result<Analysis, PipelineError> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("modes.unv"), file).unwrap();
    let text = format!(
        "{}[joint]\nkind = \"{kind}\"\nbeam = \"euler\"\n[measured]\nfile = \"modes.unv\"\n{more}\n",
        strip_table!()
    );
    let test = TestDescription::parse(&text, "test.toml").unwrap();
    run_test(
        &test,
        (folder.path(), "test.toml"),
        &IdentifySettings::default(),
    )
}

fn numbers(analysis: &Analysis) -> Vec<Option<usize>> {
    analysis.modes.iter().map(|mode| mode.mode).collect()
}

fn codes(analysis: &Analysis) -> Vec<&'static str> {
    analysis
        .warnings
        .iter()
        .map(|warning| warning.code)
        .collect()
}

/// The joint of the virtual strip.
fn joint() -> JointStiffness {
    let units = StiffnessUnits::of(&steel_strip());
    JointStiffness::two_parameter(1.4e6 / units.kt, 1200.0 / units.kr)
}

/// A mode of the virtual strip in a file.
#[derive(Clone, Copy)]
struct Written {
    /// Mode (from 1) whose frequency it has.
    mode: usize,
    /// Factor on this frequency.
    factor: f64,
    /// Mode (from 1) whose shape it has.
    shape: usize,
}

/// A file of these modes (from 1) of the virtual strip.
fn file_of(modes: &[usize]) -> String {
    let written = modes.iter().map(|&mode| Written {
        mode,
        factor: 1.0,
        shape: mode,
    });
    file_with(&written.collect::<Vec<_>>())
}

/// A file of modes with dataset 2411 in mm.
fn file_with(modes: &[Written]) -> String {
    let beam = steel_strip();
    let frequencies =
        natural_frequencies(BeamTheory::Euler, &beam, Assembly::Cantilever, &joint(), 8).unwrap();
    let shapes: Vec<ModeShape> = mode_shapes(&beam, Assembly::Cantilever, &joint(), 8).unwrap();
    let mut text = format!(
        "    -1\n   164\n{:10}mm{:18}{:10}\n{:25.17}{:25.17}{:25.17}\n{:25.17}\n    -1\n    -1\n  2411\n",
        5, "", 2, 1e3, 1e3, 1.0, 273.15
    );
    for (node, point) in (1..).zip(POINTS) {
        text += &format!(
            "{node:10}{0:10}{0:10}{0:10}\n{1:25.16}{2:25.16}{2:25.16}\n",
            0,
            1e3 * point,
            0.0
        );
    }
    text += "    -1\n";
    for (count, written) in (1..).zip(modes) {
        text += &format!("    -1\n    55\n{}", "NONE\n".repeat(5));
        text += &format!("{:10}{:10}{:10}{:10}{:10}{:10}\n", 1, 2, 2, 12, 2, 3);
        text += &format!("{:10}{:10}{:10}{count:10}\n", 2, 4, 1);
        text += &format!(
            "{:13.6}{:13.6}{:13.6}{:13.6}\n",
            written.factor * frequencies[written.mode - 1],
            0.0,
            0.01,
            0.0
        );
        for (node, point) in (1..).zip(POINTS) {
            let value = shapes[written.shape - 1].displacement(point);
            text += &format!("{node:10}\n{:13.5}{value:13.6}{:13.5}\n", 0.0, 0.0);
        }
        text += "    -1\n";
    }
    text
}

const FIRST: &str = "std = 0.05\nfirst_node = { number = 1, position = \"40 mm\" }";

#[test]
fn recover_the_joint_from_modes_that_pyuff_wrote() {
    let more = "std = 0.05\nfirst_node = { number = 1, position = \"33 mm\" }";
    let analysis = run(BY_PYUFF, "cantilever", more).unwrap();
    assert_eq!(numbers(&analysis), [1, 2, 3, 4, 5].map(Some));
    assert!(codes(&analysis).is_empty(), "{:?}", analysis.warnings);
    let damping: Vec<Option<f64>> = analysis.modes.iter().map(|mode| mode.damping).collect();
    for (found, wanted) in damping.iter().zip([0.012, 0.006, 0.004, 0.003, 0.0025]) {
        // Six printed digits of the real part.
        assert!(
            (found.unwrap() / wanted - 1.0).abs() < 1e-5,
            "{found:?} {wanted}"
        );
    }
    let found = analysis.identification.unwrap().consistent.unwrap();
    for (quantity, truth) in [(Quantity::Kt, 1.4e6), (Quantity::Kr, 1200.0)] {
        let value = found.quantity(quantity).unwrap().value.unwrap();
        // Frequencies are printed to 5e-6 and of elements to 1e-6 (mode 5); Kt reacts some 7 times as strongly.
        assert!(
            (value / truth - 1.0).abs() < 1e-4,
            "{quantity:?}: {value} for {truth}"
        );
    }
}

#[test]
fn recover_the_numbers_of_modes_whose_first_is_missing() {
    let file = file_of(&[2, 3, 4, 5]);
    let analysis = run(&file, "cantilever", FIRST).unwrap();
    assert_eq!(
        numbers(&analysis),
        [2, 3, 4, 5].map(Some),
        "{:?}",
        analysis.warnings
    );
    assert!(codes(&analysis).contains(&"missing-mode"));
}

/// Two peaks about the third mode, 0.7 % to either side of its frequency: the one with its shape is the mode.
#[test]
fn recover_the_mode_of_two_peaks_by_its_shape() {
    let written = |mode: usize, factor: f64, shape: usize| Written {
        mode,
        factor,
        shape,
    };
    let [one, two, four] = [1, 2, 4].map(|mode| written(mode, 1.0, mode));
    for (low, high, wanted) in [
        (3, 1, [Some(1), Some(2), Some(3), None, Some(4)]),
        (1, 3, [Some(1), Some(2), None, Some(3), Some(4)]),
    ] {
        let pair = [written(3, 0.993, low), written(3, 1.007, high)];
        let file = file_with(&[one, two, pair[0], pair[1], four]);
        let analysis = run(&file, "cantilever", FIRST).unwrap();
        assert_eq!(numbers(&analysis), wanted, "{:?}", analysis.warnings);
        assert!(!codes(&analysis).contains(&"ambiguous-pairing"));
        // The free end as the joint: the lowest mode shows it, and without shapes the numbers are not certain.
        let mirrored = FIRST.replace("number = 1", "number = 6");
        let analysis = run(&file, "cantilever", &mirrored).unwrap();
        let note = analysis.warnings[0].to_string();
        assert!(
            note.contains(
                "node 6 at the joint moves over 3 times as far as node 1; are the ends exchanged?"
            ),
            "{note}"
        );
        assert!(codes(&analysis).contains(&"ambiguous-pairing"));
    }
}

#[test]
fn limit_without_the_first_node_shapes_are_left_out_and_a_note_says_so() {
    let analysis = run(&file_of(&[1, 2, 3, 4]), "cantilever", "std = 0.05").unwrap();
    assert_eq!(numbers(&analysis), [1, 2, 3, 4].map(Some));
    assert_eq!(codes(&analysis), ["shapes-left-out"]);
    let note = analysis.warnings[0].to_string();
    assert!(
        note.contains("first_node = { number = 1") && note.contains("number = 6"),
        "{note}"
    );
    // Without a unit system the nodes are metres, far beyond the beam.
    let metres = file_of(&[1, 2, 3, 4]).replace("   164\n", "   999\n");
    let analysis = run(&metres, "cantilever", FIRST).unwrap();
    assert_eq!(codes(&analysis), ["shapes-left-out"]);
    assert!(
        analysis.warnings[0]
            .to_string()
            .contains("beyond the beam's end")
    );
}

#[test]
fn limit_stated_numbers_need_no_shapes() {
    let analysis = run(
        &file_of(&[1, 3, 4]),
        "cantilever",
        "modes = [1, 3, 4]\nhalf_line = [0.1, 0.2, 0.3]",
    )
    .unwrap();
    assert_eq!(numbers(&analysis), [1, 3, 4].map(Some));
    assert!(codes(&analysis).is_empty(), "{:?}", analysis.warnings);
    let half_lines: Vec<Option<f64>> = analysis.modes.iter().map(|mode| mode.half_line).collect();
    assert_eq!(half_lines, [0.1, 0.2, 0.3].map(Some));
}

#[test]
fn limit_a_free_beam_is_numbered_by_its_frequencies() {
    let beam = steel_strip();
    let free = JointStiffness::FREE;
    let found = natural_frequencies(BeamTheory::Euler, &beam, Assembly::Free, &free, 4).unwrap();
    let virtual_strip =
        natural_frequencies(BeamTheory::Euler, &beam, Assembly::Cantilever, &joint(), 8).unwrap();
    let mut file = file_of(&[1, 2, 3]);
    for (own, free) in virtual_strip.iter().zip([found[0], found[1], found[3]]) {
        file = file.replace(&format!("{own:13.6}"), &format!("{free:13.6}"));
    }
    let analysis = run(&file, "free", "std = 0.05").unwrap();
    assert_eq!(
        numbers(&analysis),
        [1, 2, 4].map(Some),
        "{:?}",
        analysis.warnings
    );
    assert!(codes(&analysis).is_empty(), "{:?}", analysis.warnings);
}

#[test]
fn regress_keys_that_do_not_fit_the_file_are_answered_with_its_line() {
    let file = file_of(&[1, 2, 3]);
    for (more, wanted) in [
        (
            "scatter = 0.001\nmodes = [1, 2]",
            "test.toml:13: `measured.modes`: 2 values for 3 modes of modes.unv; give one for each mode, lowest first",
        ),
        (
            "std = [0.1, 0.2, 0.3, 0.4]",
            "test.toml:12: `measured.std`: 4 values for 3 modes of modes.unv; give one for each mode, lowest first",
        ),
        (
            "first_node = { number = 3, position = 0.1 }",
            "test.toml:12: `measured.first_node`: node 3 is not at an end of the line of nodes; allowed: 1 or 6; name the node that is nearest to the joint, or to the left end",
        ),
    ] {
        let error = run(&file, "cantilever", more).unwrap_err();
        assert_eq!(error.to_string(), wanted);
    }
}
