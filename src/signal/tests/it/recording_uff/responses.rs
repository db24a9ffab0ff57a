//! Frequency response functions: read, written, read again.

use num_complex::Complex64;
use proptest::prelude::*;
use tapjoint_signal::recording::{
    FrequencyResponse, FrequencyResponses, Point, ReadSettings, ResponseForm, UffFormat,
    encode_frequency_responses_uff, open_frequency_responses,
};

use super::{Made, Store, file_of, open, response, series};
use crate::recording::assert_message;
use crate::written::file;

fn responses(path: &std::path::Path) -> FrequencyResponses {
    open_frequency_responses(path, &ReadSettings::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn error(bytes: impl AsRef<[u8]>) -> String {
    let tested = file("tested.frf", bytes);
    let message = open_frequency_responses(&tested.path, &ReadSettings::default())
        .expect_err("unusable")
        .to_string();
    message[message.find("tested.frf").unwrap()..].to_owned()
}

#[test]
fn val_responses_with_their_points_units_and_coherences() {
    let values = [(1.0, -2.0), (3.5, 4.0), (0.0, 0.25)];
    let in_g = Made {
        numerator: (12, "NONE", "g"),
        response: ("NONE", 4, 3),
        ..response(&values)
    };
    let whole = Made {
        numerator: (11, "NONE", "(mm/s)/N"),
        denominator: (13, "NONE"),
        response: ("tip", 0, 0),
        ..response(&values)
    };
    let coherence = Made {
        function_type: 6,
        data_type: 2,
        numerator: (0, "NONE", "NONE"),
        denominator: (0, "NONE"),
        ..response(&[])
    };
    let coherence = Made {
        numbers: vec![0.5, 1.0, 0.75],
        ..coherence
    };
    let other = Made {
        response: ("NONE", 99, 1),
        ..coherence.clone()
    };
    let other_lines = Made {
        step: "2.50000E-01".to_owned(),
        id: "zoom",
        ..response(&values)
    };
    let spectrum = Made {
        function_type: 12,
        ..response(&values)
    };
    for store in [Store::Ascii, Store::Big] {
        let mut all = [
            coherence.clone(),
            response(&values),
            in_g.clone(),
            whole.clone(),
            spectrum.clone(),
            other.clone(),
            other_lines.clone(),
            series(vec![1.0; 8]),
        ];
        all.iter_mut().for_each(|made| made.store = store);
        let tested = file_of(&all);
        let found = responses(&tested.path);
        assert_eq!(
            (found.first_frequency, found.spacing, found.lines),
            (0.0, 0.5, 3)
        );
        assert_eq!(found.frequency(2), 1.0);
        let names: Vec<_> = found.responses.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["3:+Z / 1:-Z", "4:+Z / 1:-Z", "tip / 1:-Z"]);
        let forms: Vec<_> = found.responses.iter().map(|r| r.form).collect();
        assert_eq!(
            forms,
            [
                Some(ResponseForm::Accelerance),
                Some(ResponseForm::Accelerance),
                Some(ResponseForm::Mobility)
            ]
        );
        let second: Vec<_> = found.responses.iter().map(|r| r.values[1]).collect();
        let expected = Complex64::new(3.5, 4.0);
        assert_eq!(second, [expected, expected * 9.806_65, expected * 1e-3]);
        assert_eq!(
            found.responses[0].coherence.as_deref(),
            Some(&[0.5, 1.0, 0.75][..])
        );
        assert_eq!(found.responses[1].coherence, None);
        assert_eq!(found.responses[1].unit.as_deref(), Some("(g)/(N)"));
        let texts: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
        assert_message(
            &texts[0],
            "dataset 7 (3:+Z, \"zoom\") is left out: 3 lines from 0 Hz, 0.25 Hz apart",
            &["dataset 2"],
        );
        assert_message(
            &texts[1],
            "dataset 6 (99:+X) is left out: no response has its points",
            &[],
        );
        assert_eq!(texts.len(), 2, "{texts:?}");
        // The same file holds a time series, which is what a recording takes.
        assert_eq!(open(&tested.path).unwrap().frames(), 8);
    }
}

#[test]
fn regress_a_spacing_printed_with_six_digits_is_what_it_was() {
    // 10/512 Hz in six digits: over 51200 lines the rounding would be 0.13 of a line.
    let made = Made {
        step: "1.95313E-02".to_owned(),
        ..response(&[(1.0, 0.0); 4])
    };
    assert_eq!(responses(&file_of(&[made]).path).spacing, 10.0 / 512.0);
    let made = Made {
        step: "1.00000E-01".to_owned(),
        ..response(&[(1.0, 0.0); 4])
    };
    assert_eq!(responses(&file_of(&[made]).path).spacing, 0.1);
}

#[test]
fn val_what_holds_no_response_says_what_it_holds() {
    let time = series(vec![1.0; 8]).bytes();
    assert_message(
        &error(time),
        "tested.frf: is a universal file with time series (1 x time response)",
        &["remove `form`"],
    );
    let coherence = Made {
        function_type: 6,
        data_type: 4,
        ..series(vec![1.0; 8])
    };
    assert_message(
        &error(coherence.bytes()),
        "tested.frf: holds no frequency response function",
        &["1 x coherence"],
    );
    let real = Made {
        function_type: 4,
        ..series(vec![1.0; 8])
    };
    assert_message(
        &error(real.bytes()),
        "tested.frf: dataset 1 (1:+Z): its values are real",
        &["phase"],
    );
    let uneven: Vec<f64> = [1.0, 2.0, 4.0, 8.0, 16.0]
        .iter()
        .flat_map(|f| [*f, 1.0, 0.0])
        .collect();
    let uneven = Made {
        even: false,
        numbers: uneven,
        ..response(&[])
    };
    assert_message(
        &error(uneven.bytes()),
        "tested.frf: dataset 1, point ",
        &["uneven spacing", "Hz"],
    );
    assert_message(
        &error("t,force,response\n0,1,2\n0.1,1,2\n0.2,1,2\n"),
        "tested.frf: is a time series",
        &["form"],
    );
    assert_message(
        &error("Hz,Re\n0,1\n1,1\n2,1\n"),
        "tested.frf:2: the headings do not say which columns belong together",
        &["real and imaginary part", "dB-degrees"],
    );
    assert_message(
        &error("Hz,Re,Im\n0,1,2\n1,1,2\n3,1,2\n4,1,2\n"),
        "tested.frf:4: uneven lines: 3 Hz",
        &["0.1 %"],
    );
}

#[test]
fn val_text_with_any_separator_and_metadata_before() {
    for (separator, decimal) in [(",", "."), (";", ","), ("\t", "."), ("  ", ".")] {
        let mut text = b"Analyser 4711\r\nUnits: Ratio\r\n\r\nHz".to_vec();
        // Latin-1 for a power of two.
        for cell in [&b"(m/s\xb2)/kN"[..], b"(m/s\xb2)/kN"] {
            text.extend(separator.as_bytes());
            text.extend(cell);
        }
        text.extend(b"\r\n");
        for line in 0..20 {
            let row = [f64::from(line) * 0.25, f64::from(line) + 0.5, -0.125];
            let cells = row.map(|x| format!("{x:.6}").replace('.', decimal));
            text.extend(cells.join(separator).as_bytes());
            text.extend(b"\r\n");
        }
        let tested = file("frf.txt", &text);
        let found = responses(&tested.path);
        assert_eq!(
            (found.first_frequency, found.spacing, found.lines),
            (0.0, 0.25, 20),
            "{separator:?}"
        );
        let [only] = found.responses.as_slice() else {
            panic!("{found:?}")
        };
        assert_eq!(only.form, Some(ResponseForm::Accelerance), "{separator:?}");
        assert_eq!(only.values[3], Complex64::new(3.5, -0.125) * 1e-3);
        let message = open(&tested.path).expect_err("no time series").to_string();
        assert_message(
            &message[message.find("frf.txt").unwrap()..],
            "frf.txt:5: the first column is a frequency",
            &["form = \"accelerance\""],
        );
    }
}

#[test]
fn regress_a_column_that_is_no_coherence_is_left_out_with_a_warning() {
    for (third, kept) in [
        ("0.75", true),
        ("1.0005", true),
        ("55", false),
        ("-3", false),
    ] {
        let text = format!("Hz,Re,Im,Coherence\n1,1,2,0.5\n2,3,4,1\n3,5,6,{third}\n");
        let tested = file("frf.csv", &text);
        let found = responses(&tested.path);
        assert_eq!(found.responses[0].coherence.is_some(), kept, "{third}");
        let codes: Vec<&str> = found.warnings.iter().map(|doubt| doubt.code()).collect();
        let expected: &[&str] = if kept { &[] } else { &["coherence-left-out"] };
        assert_eq!(codes, expected, "{third}");
    }
}

fn made(values: Vec<Complex64>, coherence: Option<Vec<f64>>) -> FrequencyResponses {
    let point = |name: Option<&str>, node, direction| Point {
        name: name.map(str::to_owned),
        node,
        direction,
    };
    FrequencyResponses {
        file: "made".to_owned(),
        first_frequency: 0.5,
        spacing: 0.3125,
        lines: values.len(),
        has_phase: true,
        responses: vec![FrequencyResponse {
            name: "tip 3:+Z / 1:-RY".to_owned(),
            response: point(Some("tip"), 3, 3),
            reference: point(None, 1, -5),
            unit: Some("g/N".to_owned()),
            form: Some(ResponseForm::Mobility),
            values,
            coherence,
        }],
        warnings: Vec::new(),
    }
}

/// Numbers over all magnitudes that a file may hold.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        -1e99..1e99_f64,
        -1.0..1.0_f64,
        (-1.0..1.0_f64).prop_map(|x| x * 1e-150)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20248),
        ..ProptestConfig::default()
    })]

    #[test]
    fn prop_what_is_written_is_read_again(
        numbers in prop::collection::vec((any_number(), any_number()), 1..40),
        with_coherence in any::<bool>(),
    ) {
        let values: Vec<Complex64> = numbers.iter().map(|(re, im)| Complex64::new(*re, *im)).collect();
        let coherence = with_coherence.then(|| (0..values.len()).map(|k| 1.0 / (k + 1) as f64).collect());
        let made = made(values, coherence);
        for format in [UffFormat::Ascii, UffFormat::Binary] {
            let bytes = encode_frequency_responses_uff(&made, format).unwrap();
            let tested = file("written.uff", &bytes);
            let read = responses(&tested.path);
            prop_assert_eq!((read.first_frequency, read.spacing, read.lines), (0.5, 0.3125, made.lines));
            let (ours, theirs) = (&made.responses[0], &read.responses[0]);
            prop_assert_eq!((&ours.response, &ours.reference), (&theirs.response, &theirs.reference));
            prop_assert_eq!((&theirs.unit, theirs.form), (&Some("(m/s)/(N)".to_owned()), ours.form));
            if format == UffFormat::Binary {
                prop_assert_eq!(ours, &FrequencyResponse { unit: ours.unit.clone(), ..theirs.clone() });
            }
            for (a, b) in ours.values.iter().zip(&theirs.values) {
                // Thirteen printed digits: half a unit of the last is 5e-13 of the leading one.
                for (a, b) in [(a.re, b.re), (a.im, b.im)] {
                    prop_assert!((a - b).abs() <= 5.001e-13 * a.abs(), "{} {}", a, b);
                }
            }
            prop_assert_eq!(theirs.coherence.is_some(), with_coherence);
        }
    }
}

#[test]
fn regress_what_cannot_be_written_is_named() {
    let bad = made(
        vec![Complex64::new(1.0, 0.0), Complex64::new(0.0, f64::NAN)],
        None,
    );
    let message = encode_frequency_responses_uff(&bad, UffFormat::Ascii)
        .expect_err("NaN")
        .to_string();
    assert_message(&message, "made: dataset 1, point 2 is NaN", &[]);
    let bad = made(vec![Complex64::ZERO; 3], Some(vec![1.0]));
    let message = encode_frequency_responses_uff(&bad, UffFormat::Binary)
        .expect_err("short")
        .to_string();
    assert_message(
        &message,
        "made: response 1 has 1 values, the lines are 3",
        &[],
    );
}
