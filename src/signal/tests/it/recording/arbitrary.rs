//! Whatever the bytes, opening ends with a recording that can be read or with an error.

use proptest::prelude::*;
use tapjoint_signal::recording::{ReadSettings, Recording};

use super::file;
use super::wav::Parts;

/// Opens, and where that succeeds reads everything and compares with what was promised.
fn open_and_read(bytes: &[u8]) -> Result<(), TestCaseError> {
    let file = file("arbitrary", bytes);
    let settings = ReadSettings {
        sample_rate: Some(1000.0),
        ..ReadSettings::default()
    };
    let recording = match Recording::open(&file.path, &settings) {
        Ok(recording) => recording,
        Err(error) => {
            let message = error.to_string();
            let name = file.path.display().to_string();
            prop_assert!(message.starts_with(&name), "{message}");
            return Ok(());
        }
    };
    let count = recording.channels().len();
    // No more samples than bytes: what a header promises is not believed.
    prop_assert!(recording.frames() * count as u64 <= bytes.len() as u64);
    let all: Vec<usize> = (0..count).collect();
    let read = recording.read_channels(&all, 0..u64::MAX);
    let read = read.map_err(|error| TestCaseError::fail(error.to_string()))?;
    for (samples, info) in read.iter().zip(recording.channels()) {
        prop_assert_eq!(samples.len() as u64, recording.frames());
        prop_assert!(samples.iter().all(|x| x.is_finite()));
        let health = &info.health;
        prop_assert!(health.rms.is_finite() && health.peak.is_finite());
        let peak = samples.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
        prop_assert_eq!(peak, health.peak);
    }
    for warning in recording.warnings() {
        prop_assert!(!warning.to_string().is_empty());
    }
    Ok(())
}

/// A WAV file with arbitrary samples in any of the codings.
fn any_wav() -> impl Strategy<Value = Vec<u8>> {
    let coding = prop::sample::select(vec![
        (1_u16, 8_u16, 1_u16),
        (1, 16, 2),
        (1, 20, 3),
        (1, 24, 3),
        (1, 24, 4),
        (1, 32, 4),
        (3, 32, 4),
        (3, 64, 8),
        (6, 8, 1),
    ]);
    let size = prop::option::of(prop::sample::select(vec![0, 1, 1 << 31, u32::MAX]));
    let valid = prop::option::of(0..40_u16);
    let data = prop::collection::vec(any::<u8>(), 0..300);
    (coding, 0..5_u16, valid, size, data).prop_map(
        |((tag, bits, container), channels, valid, size, data)| {
            let mut parts = Parts::new(tag, bits, data);
            parts.channels = channels;
            parts.container = container;
            parts.valid = valid;
            parts.size = size;
            parts.bytes()
        },
    )
}

/// A text file that is nearly right.
fn any_csv() -> impl Strategy<Value = Vec<u8>> {
    let cell = prop_oneof![
        8 => (-1e3..1e3_f64).prop_map(|x| format!("{x:.4}")),
        2 => (0..9_i32).prop_map(|x| x.to_string()),
        1 => "[-+]?[0-9]{0,3}[.,]?[0-9]{0,3}([eEdD][-+]?[0-9]{1,4})?",
        1 => prop::sample::select(vec!["", "nan", "-inf", "1e308", "abc", "\"", "\"1\"", "#", "t"])
            .prop_map(str::to_owned),
    ];
    let separator = prop::sample::select(vec![",", ";", "\t", " ", " , "]);
    let end = prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n"]);
    let header = prop::sample::select(vec![
        "",
        "t,a (N)\n",
        "time;b\n",
        "# t a\n",
        "\u{feff}time (ms)\tx\n",
        "t (kN),(,)\n",
    ]);
    let rows = prop::collection::vec(prop::collection::vec(cell, 1..4), 0..12);
    (header, separator, end, rows).prop_map(|(header, separator, end, rows)| {
        let rows = rows.iter().map(|row| row.join(separator) + end);
        let text: String = std::iter::once(header.to_owned()).chain(rows).collect();
        text.into_bytes()
    })
}

/// A file with some bytes changed, put in or cut off.
fn mutated(file: impl Strategy<Value = Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    let changes = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6);
    (file, changes, any::<prop::sample::Index>(), any::<bool>()).prop_map(
        |(mut bytes, changes, end, cut)| {
            for (at, value) in changes {
                if !bytes.is_empty() {
                    let at = at.index(bytes.len());
                    bytes[at] = value;
                }
            }
            if cut && !bytes.is_empty() {
                bytes.truncate(end.index(bytes.len()));
            }
            bytes
        },
    )
}

proptest! {
    // Each case writes a file; this many take about a second on an idle machine.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20245),
        ..ProptestConfig::with_cases(800)
    })]

    #[test]
    fn prop_arbitrary_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        open_and_read(&bytes)?;
    }

    #[test]
    fn prop_arbitrary_text_does_no_harm(text in "[-0-9.,;\t eE+\nat#\"()]{0,200}") {
        open_and_read(text.as_bytes())?;
    }

    #[test]
    fn prop_chunks_of_anything_do_no_harm(
        magic in prop::sample::select(vec!["RIFF", "RF64", "BW64"]),
        chunks in prop::collection::vec(
            (
                prop::sample::select(vec!["fmt ", "data", "ds64", "LIST", "what"]),
                prop_oneof![0..60_u32, Just(u32::MAX)],
                prop::collection::vec(any::<u8>(), 0..60),
            ),
            0..6,
        ),
    ) {
        let mut bytes = magic.as_bytes().to_vec();
        bytes.extend(b"\0\0\0\0WAVE");
        for (name, size, content) in chunks {
            bytes.extend(name.as_bytes());
            bytes.extend(size.to_le_bytes());
            bytes.extend(content);
        }
        open_and_read(&bytes)?;
    }

    #[test]
    fn prop_damaged_wav_files_do_no_harm(bytes in mutated(any_wav())) {
        open_and_read(&bytes)?;
    }

    #[test]
    fn prop_damaged_text_files_do_no_harm(bytes in mutated(any_csv())) {
        open_and_read(&bytes)?;
    }

    /// Numbers come back as they were printed, in any of the forms a table may have.
    #[test]
    fn prop_tables_round_trip(
        rows in prop::collection::vec((-1e6..1e6_f64, -1e-6..1e-6_f64), 2..40),
        (separator, decimal) in prop::sample::select(vec![
            (",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), ("  ", ","),
        ]),
        rate in 10..100_000_u32,
    ) {
        let mut text = format!("time{separator}a{separator}b\n");
        for (at, (a, b)) in rows.iter().enumerate() {
            let time = at as f64 / f64::from(rate);
            let row = format!("{time:?}{separator}{a:?}{separator}{b:?}\n");
            text.push_str(&row.replace('.', decimal));
        }
        let file = file("table", text);
        let recording = Recording::open(&file.path, &ReadSettings::default());
        let recording = recording.map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(recording.sample_rate(), f64::from(rate));
        let (a, b): (Vec<f64>, Vec<f64>) = rows.into_iter().unzip();
        prop_assert_eq!(recording.read_channels(&[0, 1], 0..u64::MAX).unwrap(), vec![a, b]);
    }
}
