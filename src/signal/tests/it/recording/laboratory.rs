//! Files as laboratories make them: text without headings, text by LabVIEW, functions of an analyser as text.

use tapjoint_signal::recording::{
    Format, FrequencyResponses, ReadSettings, Recording, ValueColumns, open_frequency_responses,
};

use super::{assert_message, file, open_error};
use crate::written::TestFile;

/// Rows of a time and two channels, the time in units of `unit` (s).
fn rows(separator: &str, unit: f64, time: impl Fn(usize) -> f64) -> String {
    let row = |at: usize| {
        let x = (at as f64 * 0.3).sin();
        format!(
            "{:.9}{separator}{x:.6}{separator}{:.6}\n",
            time(at) / unit,
            -x
        )
    };
    (0..64).map(row).collect()
}

fn opened(text: &str, settings: &ReadSettings) -> (TestFile, Recording) {
    let file = file("tested.dat", text);
    let recording = Recording::open(&file.path, settings);
    (file, recording.unwrap_or_else(|error| panic!("{error}")))
}

fn codes(recording: &Recording) -> Vec<&'static str> {
    recording
        .warnings()
        .iter()
        .map(|doubt| doubt.code())
        .collect()
}

#[test]
fn prop_a_rising_first_column_without_heading_is_the_time() {
    let even = |at: usize| at as f64 / 5120.0;
    for separator in ["\t", ",", ";", "   "] {
        let text = format!(
            "Analyser 4711\nmade by somebody at noon\n{}",
            rows(separator, 1.0, even)
        );
        let (_file, recording) = opened(&text, &ReadSettings::default());
        assert!(
            (recording.sample_rate() - 5120.0).abs() < 1e-6,
            "{separator:?}"
        );
        assert_eq!(recording.channels().len(), 2, "{separator:?}");
        assert_eq!(codes(&recording)[0], "time-assumed");
    }
    // In another unit, stated or shown by the rate.
    for (word, unit) in [("ms", 1e-3), ("us", 1e-6)] {
        let text = rows(",", unit, even);
        let stated = ReadSettings {
            time_unit: Some(unit),
            ..ReadSettings::default()
        };
        let by_rate = ReadSettings {
            sample_rate: Some(5120.0),
            ..ReadSettings::default()
        };
        for settings in [stated, by_rate] {
            let (_file, recording) = opened(&text, &settings);
            let error = recording.sample_rate() / 5120.0 - 1.0;
            assert!(error.abs() < 1e-9, "{word}: {}", recording.sample_rate());
            assert!(!codes(&recording).contains(&"time-assumed"));
        }
    }
    // By the heading, which a statement must not contradict.
    let text = format!("time_ms,a,b\n{}", rows(",", 1e-3, even));
    let (_file, recording) = opened(&text, &ReadSettings::default());
    assert!((recording.sample_rate() / 5120.0 - 1.0).abs() < 1e-9);
    let settings = ReadSettings {
        time_unit: Some(1.0),
        ..ReadSettings::default()
    };
    let written = file("tested.dat", &text);
    let error = Recording::open(&written.path, &settings).expect_err("two units");
    assert!(error.to_string().contains("drop time_unit"), "{error}");
}

#[test]
fn limit_counted_rows_are_no_time() {
    let counted: String = (0..20).map(|at| format!("{at},{},2\n", at % 3)).collect();
    assert_message(
        &open_error(&counted),
        "tested.dat:1: the first column counts the rows",
        &["sample_rate in Hz", "time_unit"],
    );
    let settings = ReadSettings {
        sample_rate: Some(5120.0),
        ..ReadSettings::default()
    };
    let (_file, recording) = opened(&counted, &settings);
    assert_eq!(
        (recording.sample_rate(), recording.channels().len()),
        (5120.0, 2)
    );
    // Frequencies named above the rows are no time either.
    let text = format!(
        "Freq\tRe\tIm\textra\n{}",
        rows("\t", 1.0, |at| at as f64 * 0.5)
    );
    assert_message(
        &open_error(text),
        "tested.dat:2: the text above the rows",
        &["form"],
    );
}

#[test]
fn prop_slightly_uneven_times_are_resampled() {
    // A jitter of 1 % of the step.
    let jitter = |at: usize| (at as f64 + 0.005 * (at as f64 * 1.7).sin()) / 1000.0;
    let count = 4000;
    let frequency = 120.0;
    let wave = |time: f64| (std::f64::consts::TAU * frequency * time).sin();
    let text: String = (0..count)
        .map(|at| format!("{:.9},{:.9}\n", jitter(at), wave(jitter(at))))
        .collect();
    let (_file, recording) = opened(&format!("t,a\n{text}"), &ReadSettings::default());
    let doubts = recording.warnings();
    assert_eq!(doubts[0].code(), "resampled");
    assert!(doubts[0].to_string().contains("dB"), "{}", doubts[0]);
    let samples = recording.read(0, 0..u64::MAX).expect("samples");
    let first = jitter(0);
    for (at, sample) in samples.iter().enumerate().take(count - 50).skip(50) {
        let exact = wave(first + at as f64 / recording.sample_rate());
        // -80 dB; without resampling the jitter would leave -49 dB.
        assert!((sample - exact).abs() < 1e-4, "{at}: {sample} {exact}");
    }
}

/// A file by LabVIEW of two channels in g and N, in two segments.
fn lvm(columns: &str, separator: &str, decimal: char) -> String {
    let word = match separator {
        "\t" => "Tab",
        "," => "Comma",
        _ => "Semicolon",
    };
    let header = format!(
        "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\t{word}\nDecimal_Separator\t{decimal}\nX_Columns\t{columns}\n***End_of_Header***\t\n\t\n"
    );
    let mut text = header.replace('\t', separator);
    for segment in 0..2 {
        text += &format!(
            "Channels\t2\t\t\nSamples\t8\t8\t\nY_Unit_Label\tg\tN\t\nX_Dimension\tTime\tTime\t\nX0\t0{decimal}0000E+0\t0\t\nDelta_X\t0{decimal}000500\t0{decimal}000500\t\n***End_of_Header***\t\t\t\n"
        )
        .replace('\t', separator);
        text += &match columns {
            "Multi" => "X_Value\tTip (a)\tX_Value\tForce\tComment\n",
            _ => "X_Value\tTip (a)\tForce\tComment\n",
        }
        .replace('\t', separator);
        for row in 0..8 {
            let x = format!("{:.6}", 0.0005 * f64::from(row + 8 * segment))
                .replace('.', &decimal.to_string());
            let values = [f64::from(row) * 0.5 - 1.0, f64::from(row * segment)];
            let [a, b] = values.map(|v| format!("{v:.6}").replace('.', &decimal.to_string()));
            let row = match columns {
                "Multi" => [x.clone(), a, x, b],
                "No" => [String::new(), a, b, String::new()],
                _ => [x, a, b, String::new()],
            };
            text += row.join(separator).trim_end_matches(separator);
            text += "\r\n";
        }
        text += "\r\n";
    }
    text
}

#[test]
fn prop_labview_text_with_any_columns_of_x() {
    for (columns, separator, decimal) in [
        ("One", "\t", '.'),
        ("Multi", "\t", ','),
        ("No", ",", '.'),
        ("One", ";", ','),
    ] {
        let case = format!("{columns} {separator:?}");
        let (_file, recording) =
            opened(&lvm(columns, separator, decimal), &ReadSettings::default());
        assert_eq!(recording.format(), Format::Lvm, "{case}");
        assert!((recording.sample_rate() - 2000.0).abs() < 1e-6, "{case}");
        assert_eq!(recording.frames(), 16, "{case}");
        let units: Vec<_> = recording
            .channels()
            .iter()
            .map(|c| c.unit.as_deref())
            .collect();
        assert_eq!(units, [Some("m/s2"), Some("N")], "{case}");
        assert_eq!(
            recording.channel_by_name("Force").expect("a name"),
            1,
            "{case}"
        );
        let read = recording.read_channels(&[0, 1], 9..10).expect("samples");
        assert!(
            (read[0][0] + 0.5 * 9.806_65).abs() < 1e-9,
            "{case}: {read:?}"
        );
        assert_eq!(read[1], [1.0], "{case}");
        // Without X the second segment starts again at X0.
        assert_eq!(
            codes(&recording).contains(&"segments-joined"),
            columns == "No",
            "{case}"
        );
    }
}

#[test]
fn limit_broken_labview_text_is_answered_by_line() {
    let whole = lvm("One", "\t", '.');
    let line = |row: &str| {
        1 + whole[..whole.find(row).expect("a row")]
            .matches('\n')
            .count()
    };
    let row = "0.000500\t-0.500000";
    for (broken, start, parts) in [
        (
            whole.replace(row, "0.000500\tabc"),
            format!("tested.dat:{}: column 2 (\"Tip (a)\")", line(row)),
            "not a number",
        ),
        (
            whole.replace(row, "0.000600\t-0.500000"),
            format!("tested.dat:{}: uneven sampling", line(row)),
            "2 %",
        ),
        (
            whole.replace(row, "0.000500"),
            format!("tested.dat:{}: column 3", line(row)),
            "is missing",
        ),
        (
            whole.replace("X_Value", "Time"),
            format!("tested.dat:{}: the line of names", line("X_Value")),
            "X_Value",
        ),
        (
            whole.replacen("***End_of_Header***", "***End***", 9),
            "tested.dat: a header is not ended".to_owned(),
            "End_of_Header",
        ),
        (
            whole[..whole.rfind("0.004000").expect("a row")].replacen(
                "Delta_X\t0.000500",
                "Delta_X\t1",
                1,
            ),
            String::new(),
            "",
        ),
        (
            whole.replace(row, "0.000500\t1e999"),
            format!("tested.dat:{}: column 2", line(row)),
            "finite",
        ),
    ] {
        if start.is_empty() {
            // The column of X wins over a Delta_X that it contradicts.
            let (_file, recording) = opened(&broken, &ReadSettings::default());
            assert!(codes(&recording).contains(&"sample-rate-ignored"));
            continue;
        }
        assert_message(&open_error(&broken), &start, &[parts]);
    }
}

fn functions(text: &str, values: Option<ValueColumns>) -> Result<FrequencyResponses, String> {
    let written = file("tested.txt", text);
    let settings = ReadSettings {
        values,
        ..ReadSettings::default()
    };
    open_frequency_responses(&written.path, &settings).map_err(|error| {
        let message = error.to_string();
        message[message.find("tested.txt").expect("a name")..].to_owned()
    })
}

/// Values of one mode: dB, degrees, and what they are.
fn mode(line: usize) -> (f64, f64, num_complex::Complex64) {
    let pole = num_complex::Complex64::new(-0.3, 25.0);
    let value = 1.0 / (num_complex::Complex64::new(0.0, line as f64 * 0.5) - pole);
    (20.0 * value.norm().log10(), value.arg().to_degrees(), value)
}

#[test]
fn prop_columns_are_found_by_heading_and_by_numbers() {
    let all: Vec<_> = (0..120).map(mode).collect();
    let table = |header: &str, row: &dyn Fn(usize) -> String| {
        let rows: String = (0..120)
            .map(|at| format!("{}\t{}\n", at as f64 * 0.5, row(at)))
            .collect();
        format!("{header}{rows}")
    };
    let decibels = |at: usize| format!("{:.9}\t{:.9}", all[at].0, all[at].1);
    let linear = |at: usize| format!("{:.12}\t{:.9}", all[at].2.norm(), all[at].1.to_radians());
    for (text, values) in [
        (table("Frequency\tMagnitude\tPhase\n", &decibels), None),
        (
            table("Frequency (Hz)\tMagnitude (dB)\tPhase (deg)\n", &decibels),
            None,
        ),
        (table("", &decibels), Some(ValueColumns::DecibelDegrees)),
        (table("f [Hz]\tAmplitude\tPhase [rad]\n", &linear), None),
        (
            table("Hz\tMag\tPhase\n", &linear),
            Some(ValueColumns::MagnitudePhase),
        ),
    ] {
        let found = functions(&text, values).unwrap_or_else(|message| panic!("{message}"));
        assert!(found.has_phase && found.spacing == 0.5 && found.lines == 120);
        for (value, (.., exact)) in found.responses[0].values.iter().zip(&all) {
            // Nine printed digits of dB.
            assert!((value - exact).norm() < 1e-7 * exact.norm(), "{text}");
        }
    }
    let alone = table("Hz\tLevel (dB)\n", &|at| format!("{:.9}", all[at].0));
    let found = functions(&alone, None).expect("a spectrum");
    assert!(!found.has_phase);
    assert!((found.responses[0].values[50].re - all[50].2.norm()).abs() < 1e-9);
}

#[test]
fn limit_columns_that_are_not_clear_are_asked_for() {
    let rows: String = (1..80)
        .map(|line| {
            let (level, phase, _) = mode(line);
            format!("{line}\t{level:.4}\t{phase:.3}\n")
        })
        .collect();
    let message = functions(&rows, None).expect_err("no headings");
    assert_message(
        &message,
        "tested.txt:1: columns 2 and 3",
        &["look like magnitude and phase", "--values"],
    );
    let message = functions(&rows, Some(ValueColumns::MagnitudePhase)).expect_err("negative");
    assert_message(&message, "tested.txt:1: column 2 holds -", &["dB-degrees"]);
    let four: String = (1..9).map(|at| format!("{at},1,2,3\n")).collect();
    assert_message(
        &functions(&four, None).expect_err("four"),
        "tested.txt:1: there are 4 columns",
        &["headings"],
    );
    let huge = "Hz,dB\n1,5\n2,9999\n3,4\n";
    assert_message(
        &functions(huge, None).expect_err("huge"),
        "tested.txt:3: column 2 holds 9999 dB",
        &["2000"],
    );
    let three: String = (1..9).map(|at| format!("{at},-1,2,3\n")).collect();
    let message = functions(&three, Some(ValueColumns::Complex)).expect_err("three");
    assert_message(
        &message,
        "tested.txt:1: there are 3 columns of values",
        &["two"],
    );
}

#[test]
fn regress_headings_decide_which_columns_belong_together() {
    let table = |header: &str, row: &str| {
        let rows: String = (1..40).map(|line| format!("{line},{row}\n")).collect();
        format!("{header}\n{rows}")
    };
    let found = functions(&table("Frequency (Hz),FRF real,FRF imag", "-3,4"), None).unwrap();
    assert!(found.has_phase);
    assert_eq!(
        found.responses[0].values[0],
        num_complex::Complex64::new(-3.0, 4.0)
    );
    let found = functions(&table("Hz,Re 1,Im 1,Re 2,Im 2", "1,2,3,4"), None).unwrap();
    assert_eq!(found.responses.len(), 2);
    assert_eq!(
        found.responses[1].values[0],
        num_complex::Complex64::new(3.0, 4.0)
    );
    let apart = table("Hz,Re 1,Im 1,Re 2", "1,2,3");
    assert_message(
        &functions(&apart, None).unwrap_err(),
        "tested.txt:2: the headings do not say",
        &["allowed"],
    );
    // Each function has its own coherence, and a power is a square.
    let header = "Hz,Mag 1,Phase 1,Coh 1,Mag 2,Phase 2,Coh 2";
    let found = functions(&table(header, "1,0,0.25,1,0,0.75"), None).unwrap();
    let coherences: Vec<f64> = found
        .responses
        .iter()
        .map(|one| one.coherence.as_ref().unwrap()[0])
        .collect();
    assert_eq!(coherences, [0.25, 0.75]);
    let found = functions(&table("Hz,PSD ((m/s2)^2/Hz)", "9"), None).unwrap();
    assert_eq!(found.responses[0].values[0].re, 3.0);
}
