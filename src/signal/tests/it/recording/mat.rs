//! MATLAB files of level 5: written here in both byte orders, and by scipy.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use proptest::prelude::*;
use tapjoint_signal::recording::{
    Format, ReadSettings, Recording, VariableRole, Variables, open_frequency_responses,
};

use super::{assert_message, file};

/// Writes elements in one byte order.
#[derive(Clone, Copy)]
struct Writer {
    big: bool,
    compressed: bool,
}

impl Writer {
    fn word(self, value: u32) -> [u8; 4] {
        if self.big {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        }
    }

    fn element(self, kind: u32, bytes: &[u8]) -> Vec<u8> {
        let mut all = [self.word(kind), self.word(bytes.len() as u32)].concat();
        all.extend(bytes);
        all.resize(all.len().next_multiple_of(8), 0);
        all
    }

    /// Numbers stored as double (9), single (7) or 16-bit integers (3).
    fn numbers(self, kind: u32, values: &[f64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for value in values {
            let mut own = match kind {
                9 => value.to_le_bytes().to_vec(),
                7 => (*value as f32).to_le_bytes().to_vec(),
                _ => (*value as i16).to_le_bytes().to_vec(),
            };
            if self.big {
                own.reverse();
            }
            bytes.extend(own);
        }
        self.element(kind, &bytes)
    }

    fn variable(self, name: &str, sizes: [u32; 2], kind: u32, parts: &[&[f64]]) -> Vec<u8> {
        let flags = 6 | if parts.len() > 1 { 0x0800 } else { 0 };
        let mut body = self.element(6, &[self.word(flags), self.word(0)].concat());
        body.extend(self.element(5, &[self.word(sizes[0]), self.word(sizes[1])].concat()));
        // Short names use the small format.
        match name.len() {
            1..=4 => {
                body.extend(self.word((name.len() as u32) << 16 | 1));
                let mut bytes = name.as_bytes().to_vec();
                bytes.resize(4, 0);
                body.extend(bytes);
            }
            _ => body.extend(self.element(1, name.as_bytes())),
        }
        for part in parts {
            body.extend(self.numbers(kind, part));
        }
        let whole = self.element(14, &body);
        if !self.compressed {
            return whole;
        }
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&whole).expect("memory");
        let bytes = encoder.finish().expect("memory");
        let mut all = [self.word(15), self.word(bytes.len() as u32)].concat();
        all.extend(bytes);
        all
    }

    fn file(self, variables: &[Vec<u8>]) -> Vec<u8> {
        let mut all = b"MATLAB 5.0 MAT-file, made by a test".to_vec();
        all.resize(124, b' ');
        all.extend(if self.big { [1, 0] } else { [0, 1] });
        all.extend(if self.big { b"MI" } else { b"IM" });
        all.extend(variables.concat());
        all
    }
}

fn named(names: &[(VariableRole, &str)]) -> ReadSettings {
    let mut variables = Variables::new();
    for (role, name) in names {
        variables.entry(*role).or_default().push((*name).to_owned());
    }
    ReadSettings {
        variables,
        ..ReadSettings::default()
    }
}

const SAMPLES: [f64; 12] = [
    1.0, -2.0, 3.0, 4.0, 500.0, 6.0, 7.0, 8.0, 9.0, -10.0, 11.0, 12.0,
];
const WAYS: [Writer; 3] = [
    Writer {
        big: false,
        compressed: false,
    },
    Writer {
        big: true,
        compressed: false,
    },
    Writer {
        big: false,
        compressed: true,
    },
];

#[test]
fn prop_variables_come_back_in_any_storage() {
    use VariableRole::{Frf, Points, Rate, Samples, Time};
    for writer in WAYS {
        for kind in [9, 7, 3] {
            let times: Vec<f64> = (0..6).map(|at| f64::from(at) / 2000.0).collect();
            let bytes = writer.file(&[
                writer.variable("tapdata", [6, 2], kind, &[&SAMPLES]),
                writer.variable("row", [2, 6], kind, &[&SAMPLES]),
                writer.variable("t", [1, 6], 9, &[&times]),
                writer.variable("fs", [1, 1], 9, &[&[2000.0]]),
                writer.variable("npts", [1, 1], kind, &[&[10.0]]),
                writer.variable("H", [6, 2], kind, &[&SAMPLES, &SAMPLES]),
            ]);
            let written = file("tested.mat", bytes);
            let series = [
                named(&[(Samples, "tapdata"), (Rate, "fs")]),
                named(&[(Samples, "tapdata"), (Time, "t")]),
            ];
            for settings in series {
                let recording = Recording::open(&written.path, &settings)
                    .unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(recording.format(), Format::Mat);
                assert!((recording.sample_rate() - 2000.0).abs() < 1e-6);
                let read = recording.read_channels(&[0, 1], 0..9).expect("samples");
                assert_eq!(read.concat(), SAMPLES, "kind {kind}");
            }
            // Channels in rows.
            let settings = named(&[(Samples, "row"), (Rate, "fs")]);
            let recording = Recording::open(&written.path, &settings).expect("a recording");
            assert_eq!(recording.read(0, 0..3).expect("samples"), [1.0, 3.0, 500.0]);
            let settings = named(&[(Frf, "H"), (Rate, "fs"), (Points, "npts")]);
            let found = open_frequency_responses(&written.path, &settings)
                .unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(
                (found.spacing, found.lines, found.responses.len()),
                (200.0, 6, 2)
            );
            let value = found.responses[1].values[2];
            assert_eq!((value.re, value.im), (9.0, 9.0));
        }
    }
}

#[test]
fn val_a_file_by_scipy() {
    use VariableRole::{Frequency, Frf, Samples, Time};
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scipy.mat");
    let settings = named(&[(Samples, "data"), (Time, "t")]);
    let recording = Recording::open(&path, &settings).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        (
            recording.sample_rate(),
            recording.frames(),
            recording.channels().len()
        ),
        (1280.0, 64, 2)
    );
    let samples = recording.read_channels(&[0, 1], 5..6).expect("samples");
    let time = 5.0 / 1280.0;
    let exact = (-20.0_f64 * time).exp() * (std::f64::consts::TAU * 100.0 * time).sin();
    // Single precision.
    assert!((samples[0][0] - exact).abs() < 1e-7 && samples[0][0] == -samples[1][0]);
    // Fields of a structure.
    let settings = named(&[(Frf, "run.H"), (Frequency, "run.f")]);
    let found =
        open_frequency_responses(&path, &settings).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((found.spacing, found.responses[0].values[3].im), (0.5, 3.0));
    // Without names there is a list and a proposal.
    let error = Recording::open(&path, &ReadSettings::default()).expect_err("no names");
    let message = error.to_string();
    for part in [
        "data (64 x 2, single)",
        "fs (1 x 1, ",
        "run.H (1 x 5, complex double)",
        "samples = \"data\", rate = \"fs\"",
    ] {
        assert!(message.contains(part), "{message}");
    }
}

fn message_of(bytes: Vec<u8>, names: &[(VariableRole, &str)]) -> String {
    let written = file("tested.mat", bytes);
    let error = Recording::open(&written.path, &named(names))
        .expect_err("broken")
        .to_string();
    error[error.find("tested.mat").expect("the name")..].to_owned()
}

#[test]
fn limit_broken_files_are_answered_by_byte_or_name() {
    use VariableRole::{Rate, Samples};
    let writer = WAYS[0];
    let good = || writer.variable("tapdata", [6, 2], 9, &[&SAMPLES]);
    let roles = [(Samples, "tapdata"), (Rate, "fs")];
    let whole = writer.file(&[good()]);
    let cut = whole[..whole.len() - 20].to_vec();
    assert_message(
        &message_of(cut, &roles),
        "tested.mat: byte 129: an element of 152 bytes",
        &["copy or save"],
    );
    assert_message(
        &message_of(whole[..127].to_vec(), &roles),
        "tested.mat: byte 127: the header",
        &["-v7"],
    );
    let wrong_count = writer.file(&[writer.variable("tapdata", [7, 2], 9, &[&SAMPLES])]);
    assert_message(
        &message_of(wrong_count, &roles),
        "tested.mat: byte",
        &["12 numbers where its size promises 14"],
    );
    let packed = WAYS[2];
    let mut damaged = packed.file(&[packed.variable("tapdata", [6, 2], 9, &[&SAMPLES])]);
    damaged[150] ^= 0xFF;
    assert_message(
        &message_of(damaged, &roles),
        "tested.mat: byte 129: the compressed variable is damaged",
        &[],
    );
    let zeros = vec![0.0; 1_000_000];
    let bomb = packed.file(&[packed.variable("tapdata", [1_000_000, 1], 9, &[&zeros])]);
    assert_message(
        &message_of(bomb, &roles),
        "tested.mat: byte 129: ",
        &["more than 32 times", "-v6"],
    );
    assert_message(
        &message_of(whole.clone(), &[(Samples, "tapdat")]),
        "tested.mat: no variable \"tapdat\"",
        &["did you mean \"tapdata\"?"],
    );
    assert_message(
        &message_of(whole.clone(), &[(Samples, "tapdata")]),
        "tested.mat: the samples have no time",
        &["rate"],
    );
    let not_finite =
        writer.file(&[writer.variable("tapdata", [3, 1], 9, &[&[1.0, f64::NAN, 2.0]])]);
    assert_message(
        &message_of(not_finite, &roles),
        "tested.mat: variable \"tapdata\", element 2",
        &["finite"],
    );
    let complex = writer.file(&[writer.variable("tapdata", [6, 2], 9, &[&SAMPLES, &SAMPLES])]);
    assert_message(
        &message_of(complex, &roles),
        "tested.mat: variable \"tapdata\" is complex",
        &["frf"],
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(505),
        ..ProptestConfig::with_cases(400)
    })]

    /// Whatever the bytes, there are no more numbers than the bytes allow, and no panic.
    #[test]
    fn prop_damaged_files_do_no_harm(
        way in 0..3_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        end in any::<prop::sample::Index>(),
        cut in any::<bool>(),
    ) {
        let writer = WAYS[way];
        let mut bytes = writer.file(&[
            writer.variable("tapdata", [6, 2], 9, &[&SAMPLES]),
            writer.variable("fs", [1, 1], 9, &[&[2000.0]]),
        ]);
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if cut {
            bytes.truncate(end.index(bytes.len()));
        }
        let size = bytes.len();
        let written = file("tested.mat", bytes);
        let settings = named(&[(VariableRole::Samples, "tapdata"), (VariableRole::Rate, "fs")]);
        if let Ok(recording) = Recording::open(&written.path, &settings) {
            prop_assert!(recording.frames() * recording.channels().len() as u64 <= 32 * size as u64);
        }
        let settings = named(&[(VariableRole::Frf, "tapdata"), (VariableRole::Rate, "fs")]);
        let _ = open_frequency_responses(&written.path, &settings);
    }
}
