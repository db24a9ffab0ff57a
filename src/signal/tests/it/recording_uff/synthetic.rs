//! Time series and the eight cases, from files that the tests write.

use proptest::prelude::*;
use tapjoint_signal::recording::{Format, ReadSettings, UffCoding, list_datasets, read_function};

use super::{Made, Store, file_of, function, open, response, samples, series};
use crate::recording::assert_message;
use crate::written::file;

/// Numbers about zero that single precision and six digits hold exactly: no tolerance is needed.
fn exact(count: usize) -> Vec<f64> {
    let middle = (count as f64 - 1.0) / 2.0;
    (0..count).map(|k| (k as f64 - middle) * 0.25).collect()
}

#[test]
fn val_all_eight_cases_as_text_and_in_both_byte_orders() {
    for data_type in [2, 4, 5, 6] {
        for even in [true, false] {
            for store in [Store::Ascii, Store::Little, Store::Big] {
                let mut made = Made {
                    data_type,
                    even,
                    store,
                    ..series(Vec::new())
                };
                made.numbers = exact(11 * made.width());
                let tested = file_of(&[series(exact(5)), made.clone()]);
                let read = function(&tested.path, 2);
                let what = format!("type {data_type}, even {even}, {store:?}");
                let column = |at: usize| -> Vec<f64> {
                    made.numbers
                        .iter()
                        .skip(at)
                        .step_by(made.width())
                        .copied()
                        .collect()
                };
                let first = usize::from(!even);
                assert_eq!(read.abscissa, (!even).then(|| column(0)), "{what}");
                assert_eq!(read.real, column(first), "{what}");
                let imaginary = (data_type > 4).then(|| column(first + 1));
                assert_eq!(read.imaginary, imaginary, "{what}");
            }
        }
    }
}

#[test]
fn val_uneven_double_binary_with_an_abscissa_of_either_precision() {
    let made = Made {
        even: false,
        store: Store::Little,
        ..series(exact(20))
    };
    let wide: Vec<u8> = made.numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    // The count of bytes that some writers give is that of the ordinates alone.
    let mut bytes = made.header(80).into_bytes();
    bytes.extend(wide);
    bytes.extend(b"    -1\n");
    let tested = file("wide.uff", bytes);
    let expected: Vec<f64> = made.numbers.iter().skip(1).step_by(2).copied().collect();
    assert_eq!(function(&tested.path, 1).real, expected);
}

#[test]
fn val_channels_in_order_with_their_names_units_and_rate() {
    let count = 100_000;
    let ramp = |k: usize| {
        (0..count)
            .map(|n| ((n * 7 + k) % 1000) as f64 - 499.5)
            .collect::<Vec<f64>>()
    };
    for store in [Store::Ascii, Store::Little] {
        let force = Made {
            store,
            data_type: 2,
            step: "1.95312E-05".to_owned(),
            ..series(ramp(0))
        };
        let sensor = Made {
            response: ("NONE", 12, -1),
            numerator: (12, "Acceleration", "g"),
            ..force.clone()
        };
        let sensor = Made {
            numbers: ramp(3),
            ..sensor
        };
        let tested = file_of(&[force, sensor]);
        let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
        // 1.95312E-05 is what is left of 1/51200 in six digits.
        assert_eq!(recording.sample_rate(), 51_200.0, "{store:?}");
        assert_eq!(recording.frames(), count as u64);
        let binary = matches!(
            recording.format(),
            Format::Uff58 {
                coding: UffCoding::Binary { .. }
            }
        );
        assert_eq!(binary, store != Store::Ascii);
        let names: Vec<_> = recording
            .channels()
            .iter()
            .map(|c| c.name.as_deref())
            .collect();
        assert_eq!(names, [Some("1:+Z"), Some("12:-X")]);
        let units: Vec<_> = recording
            .channels()
            .iter()
            .map(|c| c.unit.as_deref())
            .collect();
        assert_eq!(units, [Some("N"), Some("m/s2")]);
        assert_eq!(recording.warnings(), [], "{store:?}");
        let read = samples(&recording);
        assert_eq!(read[0], ramp(0));
        let in_g: Vec<f64> = ramp(3).iter().map(|x| x * 9.806_65).collect();
        assert_eq!(read[1], in_g);
        // A piece from the middle, in the other order, is what the whole has there.
        let piece = recording.read_channels(&[1, 0], 70_001..70_123).unwrap();
        assert_eq!(piece[0], in_g[70_001..70_123]);
        assert_eq!(piece[1], ramp(0)[70_001..70_123]);
        let blocks = recording.blocks(&[0, 1], 4097);
        let joined: Vec<f64> = blocks
            .flat_map(|block| block.unwrap().samples[1].clone())
            .collect();
        assert_eq!(joined, in_g);
    }
}

#[test]
fn regress_what_a_header_promises_is_not_believed() {
    for store in [Store::Ascii, Store::Little] {
        let made = Made {
            store,
            points: Some(u64::from(u32::MAX) * 2),
            ..series(exact(42))
        };
        let tested = file_of(&[made]);
        let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(recording.frames(), 42, "{store:?}");
        let warnings = recording.warnings();
        let [warning] = warnings.as_slice() else {
            panic!("{warnings:?}")
        };
        assert_eq!(warning.code(), "truncated");
        assert_message(
            &warning.to_string(),
            "the file is truncated: 42 of the promised 8589934590",
            &[],
        );
    }
}

#[test]
fn regress_padding_is_no_data() {
    for store in [Store::Ascii, Store::Little] {
        let made = Made {
            store,
            points: Some(10),
            ..series(exact(12))
        };
        let tested = file_of(&[made, series(exact(12)[..10].to_vec())]);
        let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(samples(&recording)[0], exact(12)[..10], "{store:?}");
        assert_eq!(samples(&recording)[1], exact(12)[..10], "{store:?}");
    }
}

#[test]
fn regress_a_file_cut_anywhere_is_read_as_far_as_it_goes() {
    for store in [Store::Ascii, Store::Little] {
        let first = Made {
            store,
            ..series(exact(12))
        };
        let second = Made {
            response: ("NONE", 2, 3),
            ..first.clone()
        };
        let (data, header) = (first.bytes().len() - 7, first.bytes().len() + 13);
        let bytes = [first.bytes(), second.bytes()].concat();
        for length in 0..bytes.len() {
            let tested = file("cut.uff", &bytes[..length]);
            let Ok(recording) = open(&tested.path) else {
                // Less than one number.
                let none = length < data - 11 * 8;
                assert!(
                    none,
                    "{store:?}, {length}: {}",
                    open(&tested.path).unwrap_err()
                );
                continue;
            };
            let whole = recording.frames() == 12;
            let silent = whole && (length <= header || recording.channels().len() == 2);
            assert!(
                silent || !recording.warnings().is_empty(),
                "{store:?}, {length}"
            );
            for channel in samples(&recording) {
                assert_eq!(channel, exact(12)[..channel.len()], "{store:?}, {length}");
            }
        }
    }
}

#[test]
fn val_series_that_were_not_sampled_together_are_named() {
    let fast = |node| Made {
        response: ("NONE", node, 3),
        ..series(exact(12))
    };
    let slow = Made {
        step: "1.00000E-01".to_owned(),
        id: "tacho",
        ..fast(9)
    };
    let late = Made {
        start: "1.00000E+00".to_owned(),
        id: "later run",
        ..fast(8)
    };
    let complex = Made {
        data_type: 5,
        id: "analytic",
        ..series(exact(12))
    };
    let tested = file_of(&[slow, fast(1), complex, fast(2), late]);
    let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(recording.channels().len(), 2);
    assert_eq!(recording.sample_rate(), 1000.0);
    let texts: Vec<String> = recording
        .warnings()
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_message(
        &texts[0],
        "dataset 1 (9:+Z, \"tacho\") is left out: 12 points at 10 Hz",
        &["dataset 2"],
    );
    assert_message(
        &texts[1],
        "dataset 3 (1:+Z, \"analytic\") is left out: its values are complex",
        &[],
    );
    assert_message(
        &texts[2],
        "dataset 5 (8:+Z, \"later run\") is left out:",
        &["from 1 s"],
    );
    assert_eq!(texts.len(), 3, "{texts:?}");
}

#[test]
fn val_two_runs_in_one_file_are_named() {
    let tested = file_of(&[series(exact(12)), series(exact(12))]);
    let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
    let codes: Vec<_> = recording.warnings().iter().map(|w| w.code()).collect();
    assert_eq!(codes, ["repeated-place"]);
}

#[test]
fn val_a_stored_abscissa_must_be_even() {
    let points =
        |times: &[f64]| -> Vec<f64> { times.iter().flat_map(|t| [*t, 2.0 * t + 1.0]).collect() };
    let even: Vec<f64> = (0..3000).map(|k| f64::from(k) * 0.001).collect();
    for store in [Store::Ascii, Store::Little] {
        for data_type in [2, 4] {
            let made = Made {
                even: false,
                data_type,
                store,
                ..series(points(&even))
            };
            let tested = file_of(&[made]);
            let recording =
                open(&tested.path).unwrap_or_else(|error| panic!("{store:?} {data_type}: {error}"));
            assert_eq!(recording.sample_rate(), 1000.0, "{store:?} {data_type}");
            assert_eq!(recording.frames(), 3000);
            // Single precision and six digits hold 2t + 1 to 1e-6 of its size.
            assert!((samples(&recording)[0][2999] - 6.998).abs() < 1e-5);
        }
        let mut gap = even.clone();
        gap.remove(1200);
        let tested = file_of(&[Made {
            even: false,
            store,
            ..series(points(&gap))
        }]);
        let message = open(&tested.path).expect_err("uneven").to_string();
        let from = message.find("dataset 1").unwrap();
        assert_message(
            &message[from..],
            "dataset 1, point 1201: uneven spacing: 1.20",
            &["0.1 %"],
        );
    }
}

#[test]
fn val_units_from_the_label_else_from_the_unit_system() {
    let millimetres = "    -1\n   164\n         5mm (milli-newton)            2\n  1.00000000000000000D+03  1.00000000000000000D+03  1.00000000000000000D+00\n  2.73150000000000003D+02\n    -1\n";
    let bare = Made {
        numerator: (12, "NONE", "NONE"),
        ..series(exact(12))
    };
    let labelled = Made {
        response: ("NONE", 2, 3),
        numerator: (12, "NONE", "m/s2"),
        ..series(exact(12))
    };
    let mut bytes = millimetres.as_bytes().to_vec();
    bytes.extend(bare.bytes());
    bytes.extend(labelled.bytes());
    let tested = file("units.uff", bytes);
    let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(recording.channels()[0].scale, 1e-3);
    assert_eq!(recording.channels()[0].unit.as_deref(), Some("m/s2"));
    assert_eq!(recording.channels()[1].scale, 1.0);
    let codes: Vec<_> = recording.warnings().iter().map(|w| w.code()).collect();
    assert_eq!(codes, ["units-disagree"]);
    let tested = file_of(&[bare]);
    let recording = open(&tested.path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        (recording.channels()[0].scale, &recording.channels()[0].unit),
        (1.0, &None)
    );
}

#[test]
fn val_what_cannot_be_used_is_named() {
    let error = |bytes: Vec<u8>| {
        let tested = file("tested.uff", bytes);
        let message = open(&tested.path).expect_err("unusable").to_string();
        message[message.find("tested.uff").unwrap()..].to_owned()
    };
    let vax = String::from_utf8(
        Made {
            store: Store::Little,
            ..series(Vec::new())
        }
        .bytes(),
    )
    .unwrap();
    let vax = vax.replace("58b     1     2", "58b     1     1");
    assert_message(
        &error(vax.into_bytes()),
        "tested.uff: dataset 1 (58b)",
        &["format 1", "IEEE"],
    );
    let text = String::from_utf8(series(exact(12)).bytes()).unwrap();
    let bad = text.replace("\n         4        12", "\n         7        12");
    assert_message(
        &error(bad.into_bytes()),
        "tested.uff:9: record 7 of dataset 1",
        &["\"7\"", "2, 4, 5 or 6"],
    );
    let bad = text.replacen("-1.375000000000e0", "      unreadable ", 1);
    assert_message(
        &error(bad.into_bytes()),
        "tested.uff:14: dataset 1 holds \"unreadable\"",
        &["not a number"],
    );
    let bad = text.replacen("-1.375000000000e0", "              NaN", 1);
    assert_message(
        &error(bad.into_bytes()),
        "tested.uff: channel 1, sample 0",
        &["NaN"],
    );
    let spectrum = Made {
        function_type: 12,
        ..series(exact(12))
    };
    assert_message(
        &error(spectrum.bytes()),
        "tested.uff: holds no time series (function type 1), only 1 x spectrum",
        &["export"],
    );
    let frf = response(&[(1.0, 2.0); 4]);
    assert_message(
        &error(frf.bytes()),
        "tested.uff: holds no time series",
        &["form = \"accelerance\""],
    );
    let bad = Made {
        step: "0.00000E+00".to_owned(),
        ..series(exact(12))
    };
    assert_message(
        &error(bad.bytes()),
        "tested.uff: dataset 1 (1:+Z): its step is 0 s",
        &[],
    );
    assert_message(
        &error(b"    -1\n   151\nmodel\n    -1\n".to_vec()),
        "tested.uff: holds no function (dataset 58), only 1 x header",
        &[],
    );
    assert_message(
        &error(b"    -1\n    58\nline\n".to_vec()),
        "tested.uff: holds no function",
        &["only an incomplete dataset"],
    );
}

#[test]
fn limit_headers_of_a_large_file_are_listed_without_its_values() {
    // A sparse file of 3 GB: reading it would take seconds, and no memory could hold it.
    let made = Made {
        store: Store::Little,
        points: Some(400_000_000),
        ..series(Vec::new())
    };
    let tested = file("large.uff", made.header(0));
    let mut opened = std::fs::OpenOptions::new()
        .append(true)
        .open(&tested.path)
        .unwrap();
    let start = opened.metadata().unwrap().len();
    opened.set_len(start + 8 * 400_000_000).unwrap();
    std::io::Write::write_all(&mut opened, b"    -1\n").unwrap();
    let listed = list_datasets(&tested.path).unwrap();
    assert_eq!(listed.datasets.len(), 1);
    assert_eq!(listed.datasets[0].bytes, 3_200_000_000);
}

/// A file that is nearly right.
fn any_file() -> impl Strategy<Value = Vec<u8>> {
    let store = prop::sample::select(vec![Store::Ascii, Store::Little, Store::Big]);
    let data_type = prop::sample::select(vec![2_u32, 4, 5, 6]);
    let function_type = prop::sample::select(vec![0_u32, 1, 1, 1, 4, 4, 6, 9]);
    let points = prop::option::of(prop::sample::select(vec![
        0,
        1,
        3,
        40,
        u64::MAX / 16,
        9_999_999_999,
    ]));
    let numbers = prop::collection::vec(-1e3..1e3_f64, 0..60);
    let made = (
        store,
        data_type,
        function_type,
        any::<bool>(),
        points,
        numbers,
    )
        .prop_map(
            |(store, data_type, function_type, even, points, numbers)| Made {
                store,
                data_type,
                function_type,
                even,
                points,
                ..series(numbers)
            },
        );
    let damage = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6);
    (
        prop::collection::vec(made, 1..4),
        damage,
        any::<prop::sample::Index>(),
    )
        .prop_map(|(datasets, damage, end)| {
            let mut bytes: Vec<u8> = datasets.iter().flat_map(Made::bytes).collect();
            for (place, value) in damage {
                let place = place.index(bytes.len());
                bytes[place] = value;
            }
            // One in four is cut.
            if end.index(4) == 0 {
                bytes.truncate(end.index(bytes.len()));
            }
            bytes
        })
}

/// Everything that reads a file of these bytes ends, with no more numbers than bytes.
fn read_everything(bytes: &[u8]) -> Result<(), TestCaseError> {
    let tested = file("arbitrary", bytes);
    if let Ok(recording) = open(&tested.path) {
        let read = samples(&recording);
        for (channel, info) in read.iter().zip(recording.channels()) {
            prop_assert_eq!(channel.len() as u64, recording.frames());
            let peak = channel.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
            prop_assert_eq!(peak, info.health.peak);
        }
        prop_assert!(recording.frames() * read.len() as u64 <= bytes.len() as u64);
    }
    if let Ok(listed) = list_datasets(&tested.path) {
        for (dataset, _) in listed.functions() {
            if let Ok(values) = read_function(&listed, dataset.number) {
                prop_assert!(values.real.len() <= bytes.len());
            }
        }
    }
    if let Ok(found) =
        tapjoint_signal::recording::open_frequency_responses(&tested.path, &ReadSettings::default())
    {
        for response in &found.responses {
            prop_assert_eq!(response.values.len(), found.lines);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20247),
        ..ProptestConfig::with_cases(300)
    })]

    #[test]
    fn prop_damaged_files_end_in_data_or_in_an_error(bytes in any_file()) {
        read_everything(&bytes)?;
    }

    #[test]
    fn prop_arbitrary_bytes_behind_a_mark(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut whole = b"    -1\n    58b     1     2          11         400\n".to_vec();
        whole.extend(bytes);
        read_everything(&whole)?;
    }
}
