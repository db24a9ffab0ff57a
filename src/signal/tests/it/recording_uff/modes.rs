//! Modes of universal files: files that the tests write, and two that pyuff wrote (`pyuff_modes.py` beside them).

use num_complex::Complex64;
use std::collections::BTreeMap;
use tapjoint_signal::recording::{
    ModeShapes, NoLine, NodalMode, Node, ReadSettings, RecordingError, encode_mode_shapes_uff,
    encode_nodes_uff, open_frequency_responses, read_mode_shapes,
};

use super::open;
use crate::recording::assert_message;
use crate::written::{TestFile, file};

/// Normal modes with dataset 15, by pyuff 2.5.8.
const NORMAL: &str = include_str!("pyuff-normal.unv");
/// The same modes as complex eigenvalues, turned by 0.7 rad, with dataset 2411, by pyuff 2.5.8.
const COMPLEX: &str = include_str!("pyuff-complex.unv");

fn read(tested: &TestFile) -> ModeShapes {
    read_mode_shapes(&tested.path).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> String {
    let tested = file("modes.unv", text);
    let error: RecordingError = read_mode_shapes(&tested.path).expect_err("a broken file");
    let message = error.to_string();
    let folder = tested
        .path
        .parent()
        .map(|folder| format!("{}/", folder.display()));
    message.replace(&folder.unwrap_or_default(), "")
}

fn dataset(kind: u32, lines: &[String]) -> String {
    format!("    -1\n{kind:6}\n{}\n    -1\n", lines.join("\n"))
}

/// A number as Fortran writes it.
fn cell(value: f64, width: usize, digits: usize) -> String {
    let text = format!("{value:.digits$E}");
    let (mantissa, exponent) = text.split_once('E').unwrap();
    let exponent: i32 = exponent.parse().unwrap();
    let sign = if exponent < 0 { '-' } else { '+' };
    let text = format!("{mantissa}E{sign}{:02}", exponent.abs());
    format!("{text:>width$}")
}

/// A dataset 55 of the tests' own making.
struct Made {
    analysis: u32,
    /// 2, 4, 5 or 6.
    data_type: u32,
    /// Values of each node.
    values: usize,
    quantity: u32,
    mode: u32,
    reals: Vec<f64>,
    nodes: Vec<(i64, Vec<f64>)>,
}

impl Made {
    /// A normal mode of this frequency (Hz) that moves along Z.
    fn normal(mode: u32, frequency: f64, along_z: &[f64]) -> Self {
        let nodes = (1..)
            .zip(along_z)
            .map(|(node, z)| (node, vec![0.0, 0.0, *z]));
        Made {
            analysis: 2,
            data_type: 2,
            values: 3,
            quantity: 8,
            mode,
            reals: vec![frequency, 0.0, 0.01, 0.0],
            nodes: nodes.collect(),
        }
    }

    fn text(&self) -> String {
        let mut lines: Vec<String> = ["a test", "NONE", "", "NONE", "NONE"]
            .map(str::to_owned)
            .to_vec();
        let record = [
            1,
            self.analysis,
            2,
            self.quantity,
            self.data_type,
            self.values as u32,
        ];
        lines.push(record.iter().map(|field| format!("{field:10}")).collect());
        let record = [2, self.reals.len() as u32, 1, self.mode];
        lines.push(record.iter().map(|field| format!("{field:10}")).collect());
        lines.push(self.reals.iter().map(|real| cell(*real, 13, 5)).collect());
        let (per_line, width, digits) = match self.data_type {
            4 | 6 => (4, 20, 12),
            _ => (6, 13, 5),
        };
        for (node, values) in &self.nodes {
            lines.push(format!("{node:10}"));
            for row in values.chunks(per_line) {
                lines.push(
                    row.iter()
                        .map(|value| cell(*value, width, digits))
                        .collect(),
                );
            }
        }
        dataset(55, &lines)
    }
}

/// Nodes in dataset 15 at these places.
fn nodes(places: &[[f64; 3]]) -> String {
    let mut lines = Vec::new();
    for (number, place) in (1..).zip(places) {
        let place: String = place.iter().map(|part| cell(*part, 13, 5)).collect();
        lines.push(format!("{number:10}{:10}{:10}{:10}{place}", 0, 0, 11));
    }
    dataset(15, &lines)
}

#[test]
fn val_modes_by_pyuff_have_its_frequencies_damping_and_shapes() {
    let dampings = [0.012, 0.006, 0.004, 0.003, 0.0025];
    // Frequencies as pyuff_modes.py computes them.
    let frequencies = [
        16.95031108,
        115.8416128,
        323.60089892,
        600.53538121,
        950.39914108,
    ];
    let [normal, complex] = [NORMAL, COMPLEX].map(|text| read(&file("modes.unv", text)));
    for modes in [&normal, &complex] {
        assert!(modes.warnings.is_empty(), "{:?}", modes.warnings);
        assert_eq!(modes.modes.len(), 5);
        for (mode, (frequency, damping)) in modes.modes.iter().zip(frequencies.iter().zip(dampings))
        {
            // Six printed digits, of the imaginary part and of the real part.
            assert!(
                (mode.frequency / frequency - 1.0).abs() < 5e-6,
                "{} {frequency}",
                mode.frequency
            );
            assert!((mode.damping.unwrap() / damping - 1.0).abs() < 1e-5);
        }
        assert_eq!(modes.nodes.len(), 8);
        let place = modes.nodes[&8].place;
        assert!(
            (place[0] - 0.383).abs() < 1e-12 && place[1] == 0.0,
            "{place:?}"
        );
    }
    let [normal, complex] = [&normal, &complex].map(|modes| modes.along_line(Some(8)).unwrap());
    assert_eq!(
        (normal.direction.as_str(), normal.nodes[0].number),
        ("Z", 8)
    );
    assert!((normal.nodes[7].distance - 0.35).abs() < 1e-12);
    for (normal, complex) in normal.shapes.iter().zip(&complex.shapes) {
        assert_eq!(normal.len(), 8);
        let sign = (normal[0].value * complex[0].value).signum();
        for (normal, complex) in normal.iter().zip(complex) {
            // Six printed digits of two parts.
            assert!(
                (normal.value - sign * complex.value).abs() < 1e-5,
                "{normal:?} {complex:?}"
            );
        }
    }
}

#[test]
fn prop_every_kind_of_values_is_read_as_it_was_written() {
    for data_type in [2, 4, 5, 6] {
        for values in [3, 6] {
            for analysis in [2, 3, 7] {
                let parts = if data_type > 4 { 2 } else { 1 };
                // Quarters, which six digits hold exactly: no tolerance is needed.
                let numbers = |node: i64| -> Vec<f64> {
                    (0..parts * values)
                        .map(|k| node as f64 + 0.25 * k as f64 - 3.0)
                        .collect()
                };
                let made = Made {
                    analysis,
                    data_type,
                    values,
                    reals: match analysis {
                        2 => vec![12.5, 0.0, 0.0, 0.02],
                        _ => vec![-3.0, 4.0, 1.0, 0.0, 1.0, 0.0],
                    },
                    nodes: [7, 4_000_000]
                        .map(|node| (node, numbers(node.min(9))))
                        .to_vec(),
                    ..Made::normal(3, 0.0, &[])
                };
                for text in [made.text(), made.text().replace('\n', "\r\n")] {
                    let modes = read(&file("modes.unv", text));
                    let what = format!("type {data_type}, {values} values, analysis {analysis}");
                    let mode = &modes.modes[0];
                    let wanted = match analysis {
                        2 => (12.5, Some(0.01)),
                        _ => (5.0 / std::f64::consts::TAU, Some(0.6)),
                    };
                    assert_eq!((mode.frequency, mode.damping), wanted, "{what}");
                    assert_eq!(mode.shape.len(), 2, "{what}");
                    for (node, shape) in &mode.shape {
                        let numbers = numbers((*node).min(9));
                        let wanted = [0, 1, 2].map(|axis| match parts {
                            1 => Complex64::new(numbers[axis], 0.0),
                            _ => Complex64::new(numbers[2 * axis], numbers[2 * axis + 1]),
                        });
                        assert_eq!(*shape, wanted, "{what}");
                    }
                }
            }
        }
    }
}

#[test]
fn val_places_are_metres_by_the_unit_system() {
    let units = dataset(
        164,
        &[
            "         5mm (milli-newton)   2".to_owned(),
            [1e3, 1e3, 1.0].map(|factor| cell(factor, 25, 16)).concat(),
            cell(273.15, 25, 16),
        ],
    );
    let mut wide = String::from("    -1\n  2411\n");
    for (number, x) in [(1, 30.0), (2, 330.0)] {
        wide += &format!("{number:10}{:10}{:10}{:10}\n", 0, 0, 11);
        wide += &[x, -5.0, 0.0]
            .map(|part| cell(part, 25, 16).replace('E', "D"))
            .concat();
        wide += "\n";
    }
    wide += "    -1\n";
    let mode = Made::normal(1, 17.0, &[0.5, 1.0]).text();
    let modes = read(&file("modes.unv", units + &wide + &mode));
    assert_eq!(modes.nodes[&2].place, [0.33, -0.005, 0.0]);
}

#[test]
fn limit_what_is_no_oscillation_is_left_out_and_parts_of_a_mode_are_joined() {
    let rigid = Made::normal(1, 0.0, &[1.0, 1.0]);
    let nearly = Made::normal(2, 1e-5, &[1.0, 1.0]);
    let frf = Made {
        analysis: 5,
        ..Made::normal(1, 20.0, &[1.0, 1.0])
    };
    let eigenvalue = |imaginary: f64| Made {
        analysis: 3,
        reals: vec![-1.0, imaginary, 0.0, 0.0, 0.0, 0.0],
        ..Made::normal(9, 0.0, &[1.0, -1.0])
    };
    // A stress, of which the frequency alone is taken, whatever values it has.
    let stress = Made {
        quantity: 2,
        values: 9,
        ..Made::normal(3, 50.0, &[])
    };
    let mut far = Made::normal(3, 50.0, &[0.25]);
    far.nodes[0].0 = 12;
    let text: String = [
        rigid,
        nearly,
        frf,
        eigenvalue(700.0),
        eigenvalue(-700.0),
        stress,
        Made::normal(3, 50.0, &[1.0, 0.5]),
        far,
    ]
    .iter()
    .map(Made::text)
    .collect();
    let modes = read(&file("modes.unv", text));
    let found: Vec<(f64, usize)> = modes
        .modes
        .iter()
        .map(|mode| (mode.frequency.round(), mode.shape.len()))
        .collect();
    assert_eq!(found, [(50.0, 3), (111.0, 2)]);
    let doubts: Vec<String> = modes.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        doubts[0],
        "2 datasets are left out: rigid-body or overdamped modes"
    );
    assert_eq!(
        doubts[1],
        "1 datasets are left out: eigenvalues with a negative imaginary part, the conjugates of the others"
    );
}

#[test]
fn limit_a_cut_file_is_read_as_far_as_it_goes() {
    // The first mode ends with the second mark behind its type.
    let first = NORMAL.find("\n    55").unwrap();
    let first_end = first + NORMAL[first..].find("\n    -1").unwrap() + "\n    -1\n".len();
    let whole = read(&file("modes.unv", NORMAL));
    // Every byte of the last mode, and every 37th before.
    let last = NORMAL.rfind("\n    55").unwrap();
    for cut in (0..last).step_by(37).chain(last..NORMAL.len()) {
        let tested = file("modes.unv", &NORMAL[..cut]);
        let modes = match read_mode_shapes(&tested.path) {
            Ok(modes) => modes,
            Err(error) => {
                assert!(cut < first_end, "cut at {cut}: {error}");
                continue;
            }
        };
        for (mode, whole) in modes.modes.iter().zip(&whole.modes) {
            assert_eq!(whole.frequency, mode.frequency, "cut at {cut}");
            for (node, value) in &mode.shape {
                assert_eq!(whole.shape[node], *value, "cut at {cut}");
            }
        }
        for (number, node) in &modes.nodes {
            assert_eq!(whole.nodes[number], *node, "cut at {cut}");
        }
    }
    // Within the number of the last node: the node before it is whole.
    let line = NORMAL.rfind("\n         8").unwrap();
    let modes = read(&file("modes.unv", &NORMAL[..line + 5]));
    assert_eq!(modes.modes[4].shape.len(), 7);
    let cut = &NORMAL[..NORMAL.len() - 60];
    let modes = read(&file("modes.unv", cut));
    assert_eq!((modes.modes.len(), modes.modes[4].shape.len()), (5, 6));
    assert_eq!(modes.warnings[0].code(), "truncated");
}

#[test]
fn regress_broken_files_are_answered_by_file_line_value_and_remedy() {
    let change = |from: &str, to: &str| {
        assert!(NORMAL.contains(from), "{from}");
        refused(&NORMAL.replacen(from, to, 1))
    };
    let cases = [
        (
            change(
                "         1         2         2         8         2         3",
                "         1         2         2         8         9         3",
            ),
            "modes.unv:25: dataset 3 (type 55) has the data type \"9\" in its record 6; allowed: 2 or 4 (real), 5 or 6 (complex); export the file again",
        ),
        (
            change(
                "         1         2         2         8         2         3",
                "         1         2         2         8         2         5",
            ),
            "modes.unv:25: dataset 3 (type 55) has \"5\" values of each node in its record 6; allowed: 3 (translations) or 6 (translations and rotations); export the file again",
        ),
        (
            change(
                "         1         2         2         8         2         3",
                "         1       two         2         8         2         3",
            ),
            "modes.unv:25: dataset 3 (type 55) has the analysis type \"two\" in its record 6; allowed: a whole number; export the file again",
        ),
        (
            change("  1.69503e+01", " -1.69503e+01"),
            "modes.unv:27: dataset 3 (type 55) has the frequency \"-16.9503\" in its record 8; allowed: 0 to 1e9 Hz; export the file again",
        ),
        (
            change("  4.79629e-02", "          NaN"),
            "modes.unv:29: dataset 3 (type 55) has \"NaN\"; allowed: finite numbers in columns of 13 or 20, or between blanks; export the file again",
        ),
        (
            change("         2\n  0.00000e+00", "       two\n  0.00000e+00"),
            "modes.unv:30: dataset 3 (type 55) has the node number \"two\"; allowed: a whole number; export the file again",
        ),
        (
            change(
                "  3.30000E-02  0.00000E+00  2.50000E-03",
                "  3.30000E-02  0.00000E+00",
            ),
            "modes.unv:9: dataset 2 (type 15) has 6 numbers for a node; allowed: 7, its number, three more whole numbers, X, Y and Z; export the file again",
        ),
        (
            refused(&dataset(164, &["         1SI".to_owned()])),
            "modes.unv: holds no mode (dataset 55 of analysis type 2, 3 or 7 with a frequency above 0), only 1 x units (dataset 164); export the modes as a universal file with datasets 55 and 15 or 2411",
        ),
        (
            refused("17, 118, 335"),
            "modes.unv: is no universal file; export the modes as a universal file with datasets 55 and 15 or 2411",
        ),
    ];
    for (found, wanted) in cases {
        assert_eq!(found, wanted);
    }
}

#[test]
fn limit_nodes_are_on_one_line_or_say_why_not() {
    let mode = Made::normal(1, 17.0, &[0.1, 0.5, 1.0]).text();
    let line = |places: &[[f64; 3]], first: Option<i64>| {
        read(&file("modes.unv", nodes(places) + &mode)).along_line(first)
    };
    let slanted = [[1.0, 1.0, 0.0], [1.1, 1.2, 0.0], [1.2, 1.4, 0.0]];
    let found = line(&slanted, Some(3)).unwrap();
    let distances: Vec<f64> = found.nodes.iter().map(|node| node.distance).collect();
    for (distance, wanted) in distances.iter().zip([0.0, 0.05_f64.sqrt(), 0.2_f64.sqrt()]) {
        // Rounding of coordinates near 1.
        assert!((distance - wanted).abs() < 1e-12, "{distance} {wanted}");
    }
    let values: Vec<f64> = found.shapes[0].iter().map(|at| at.value).collect();
    assert_eq!(values, [1.0, 0.5, 0.1]);
    let bent = line(&[[0.0; 3], [0.1, 0.003, 0.0], [0.2, 0.0, 0.0]], None);
    assert_message(
        &bent.unwrap_err().to_string(),
        "its nodes lie on no straight line: node 2 is off the line from node 1 to node 3 by 1.5 %",
        &["up to 1 %"],
    );
    let straight = [[0.0; 3], [0.1, 0.0015, 0.0], [0.2, 0.0, 0.0]];
    assert!(line(&straight, None).is_ok());
    let (number, from, to) = (2, 1, 3);
    assert_eq!(
        line(&slanted, Some(2)).unwrap_err(),
        NoLine::NotAtEnd { number, from, to }
    );
    assert_eq!(line(&[[0.0; 3]], None).unwrap_err(), NoLine::NoPlaces);
    let text = nodes(&slanted).replacen("         3         0", "         3         5", 1);
    let several = read(&file("modes.unv", text + &mode)).along_line(None);
    assert_eq!(several.unwrap_err(), NoLine::SeveralSystems);
}

#[test]
fn limit_a_mode_in_another_direction_has_no_shape_across_the_line() {
    let mut side = Made::normal(2, 90.0, &[0.0; 3]);
    for ((_, value), y) in side.nodes.iter_mut().zip([0.2, 0.6, 1.0]) {
        *value = vec![0.0, y, 0.1];
    }
    let text = nodes(&[[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]])
        + &Made::normal(1, 17.0, &[0.1, 0.5, 1.0]).text()
        + &side.text()
        + &Made::normal(3, 118.0, &[-0.4, -0.2, 1.0]).text();
    let line = read(&file("modes.unv", text)).along_line(None).unwrap();
    assert_eq!(
        (line.direction.as_str(), &line.other_direction[..]),
        ("Z", &[1][..])
    );
    let counts: Vec<usize> = line.shapes.iter().map(Vec::len).collect();
    assert_eq!(counts, [3, 0, 3]);
}

#[test]
fn limit_displacements_in_own_coordinate_systems_are_left_out() {
    let places = [[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]];
    let mode = Made::normal(1, 17.0, &[0.1, 0.5, 1.0]).text();
    let line = |text: String| read(&file("modes.unv", text + &mode)).along_line(None);
    let one = |number: usize| format!("{number:10}{:10}", 0);
    let own = |number: usize, system: usize| format!("{}{system:10}", one(number));
    let first_column = nodes(&places).replacen(&own(2, 0), &own(2, 4), 1);
    assert_eq!(
        line(first_column).unwrap_err(),
        NoLine::SeveralDisplacementSystems
    );
    let mut all = nodes(&places);
    for number in 1..4 {
        all = all.replacen(&own(number, 0), &own(number, 4), 1);
    }
    assert!(line(all.clone()).is_ok());
    let systems = dataset(2420, &["         1".to_owned()]);
    assert!(line(nodes(&places) + &systems).is_ok());
    assert_eq!(line(all + &systems).unwrap_err(), NoLine::DefinedSystem(4));
    assert_eq!(line(nodes(&[[0.3; 3]; 3])).unwrap_err(), NoLine::SamePlace);
}

#[test]
fn limit_damping_in_per_cent_is_left_out_of_the_whole_file() {
    let damped = |mode: u32, frequency: f64, damping: f64| Made {
        reals: vec![frequency, 0.0, damping, 0.0],
        ..Made::normal(mode, frequency, &[0.5, 1.0])
    };
    let text = damped(1, 17.0, 1.2).text() + &damped(2, 118.0, 0.6).text();
    let modes = read(&file("modes.unv", text));
    let damping: Vec<Option<f64>> = modes.modes.iter().map(|mode| mode.damping).collect();
    assert_eq!(damping, [None, None]);
    let doubt = &modes.warnings[0];
    assert_eq!(doubt.code(), "damping-left-out");
    assert_message(
        &doubt.to_string(),
        "damping ratios are left out: one is 1.2",
        &["per cent"],
    );
}

#[test]
fn regress_parts_of_a_mode_are_of_one_quantity_and_one_load_case() {
    let mut displacement = Made::normal(1, 17.0, &[0.5]);
    displacement.reals[2] = 0.0;
    let mut acceleration = Made {
        quantity: 12,
        ..Made::normal(1, 17.0, &[400.0, 800.0])
    };
    acceleration.nodes[0].0 = 7;
    let case = |number: u32| format!("{:10}{:10}{number:10}", 2, 4);
    let other = Made::normal(2, 17.0, &[1.0, 1.0]).text();
    let other = other.replace(&case(1), &case(5));
    let text = displacement.text() + &acceleration.text() + &other;
    let modes = read(&file("modes.unv", text));
    assert_eq!(modes.modes.len(), 1);
    let mode = &modes.modes[0];
    assert_eq!((mode.damping, mode.shape.len()), (Some(0.01), 1));
    assert_eq!(
        modes.warnings[0].to_string(),
        "1 datasets are left out: modes with a frequency of an earlier load case"
    );
}

#[test]
fn regress_conjugates_alone_are_modes() {
    let text: String = [-100.0, -700.0]
        .map(|imaginary| Made {
            analysis: 3,
            reals: vec![-1.0, imaginary, 0.0, 0.0, 0.0, 0.0],
            ..Made::normal(1, 0.0, &[1.0, -1.0])
        })
        .iter()
        .map(Made::text)
        .collect();
    let modes = read(&file("modes.unv", text));
    assert_eq!(modes.modes.len(), 2);
    assert!(modes.warnings.is_empty(), "{:?}", modes.warnings);
}

#[test]
fn limit_modes_count_as_values() {
    let empty = Made::normal(1, 17.0, &[]).text();
    // 100 values each.
    assert!(read(&file("modes.unv", empty.repeat(10_000))).modes.len() == 1);
    let message = refused(&empty.repeat(10_001));
    assert_message(
        &message,
        "modes.unv:",
        &[
            "with dataset 10001",
            "a mode counts as 100",
            "up to 1000000",
        ],
    );
}

/// A bar that is turned about its length, whose modes have a little motion along it and beside.
#[test]
fn recover_the_direction_of_a_bar_at_any_angle() {
    let places = [[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]];
    let shapes = [[0.1, 0.4, 1.0], [-0.5, -0.4, 1.0], [0.7, -0.5, 1.0]];
    for (angle, words) in [
        (0.0_f64, "Z"),
        (8.0, "Z"),
        (45.0, "(0.0, 0.7, 0.7)"),
        (85.0, "Y"),
    ] {
        let (sin, cos) = angle.to_radians().sin_cos();
        let mut text = nodes(&places);
        for (mode, shape) in (1..).zip(shapes) {
            // Beside the bar alternately to either side, as noise is.
            let beside = if mode % 2 == 0 { 0.03 } else { -0.03 };
            let mut made = Made::normal(mode, 17.0 * f64::from(mode * mode), &shape);
            for ((_, value), z) in made.nodes.iter_mut().zip(shape) {
                *value = vec![0.1 * z, z * (sin + beside * cos), z * (cos - beside * sin)];
            }
            text += &made.text();
        }
        let line = read(&file("modes.unv", text)).along_line(None).unwrap();
        assert_eq!(line.direction, words);
        assert!(line.other_direction.is_empty(), "{angle}");
        for (found, wanted) in line.shapes.iter().zip(shapes) {
            // All motion of a mode has one direction: six printed digits.
            let sign = found[2].value.signum();
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((sign * found.value - wanted).abs() < 1e-5, "{angle}");
            }
        }
    }
}

#[test]
fn regress_modes_where_samples_are_wanted_name_the_key_that_reads_them() {
    let tested = file("modes.unv", NORMAL);
    let opened = open(&tested.path).map(drop);
    let functions = open_frequency_responses(&tested.path, &ReadSettings::default()).map(drop);
    for error in [opened, functions] {
        let message = error.unwrap_err().to_string();
        assert!(
            message.contains("file = \"modes.unv\" into its [measured]"),
            "{message}"
        );
    }
}

#[test]
fn prop_modes_that_were_written_are_read_back() {
    let node = |x: f64| Node {
        place: [x, 0.0, 0.0],
        system: 0,
        displacement_system: 0,
    };
    let nodes: BTreeMap<i64, Node> = [(1, node(0.205)), (2, node(0.338))].into();
    let mode = |frequency: f64, damping: Option<f64>, values: [f64; 2]| NodalMode {
        frequency,
        damping,
        shape: (1..)
            .zip(values.map(|z| [0.0, 0.0, z].map(Complex64::from)))
            .collect(),
    };
    let modes = [
        (1, mode(17.003, Some(0.0031), [0.25, 1.0])),
        (3, mode(335.63, None, [-1.0, 0.125])),
    ];
    let written = |modes: &[(i64, NodalMode)]| encode_mode_shapes_uff("A \n test", modes);
    let mut bytes = encode_nodes_uff(&nodes);
    bytes.extend(written(&modes).unwrap());
    let read = read(&file("modes.unv", std::str::from_utf8(&bytes).unwrap()));
    assert_eq!(read.nodes, nodes);
    assert_eq!(read.modes, modes.map(|(_, mode)| mode));
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    let line = read.along_line(Some(1)).unwrap();
    assert_eq!((line.direction.as_str(), line.shapes[0].len()), ("Z", 2));
    for damaged in [
        mode(f64::NAN, None, [0.0; 2]),
        mode(1.0, Some(f64::INFINITY), [0.0; 2]),
        mode(1.0, None, [f64::NAN, 0.0]),
    ] {
        let error = written(&[(1, damaged)]).expect_err("no number");
        assert!(error.to_string().contains("finite numbers"), "{error}");
    }
    // Without nodes only the units are left.
    let text = String::from_utf8(encode_nodes_uff(&BTreeMap::new())).unwrap();
    assert!(
        text.contains("   164\n") && !text.contains("    15\n"),
        "{text}"
    );
}
