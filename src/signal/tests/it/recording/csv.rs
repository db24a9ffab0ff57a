//! CSV files as people and programs write them.

use tapjoint_signal::recording::{
    Format, ReadSettings, Recording, Separator, Timing, channel_unit,
};

use tapjoint_numerics::quantity::STANDARD_GRAVITY;

use super::{TestFile, assert_message, file, open, open_error, read_all};

fn with_rate(bytes: impl AsRef<[u8]>, sample_rate: f64) -> (TestFile, Recording) {
    let file = file("tested.dat", bytes);
    let settings = ReadSettings {
        sample_rate: Some(sample_rate),
        ..ReadSettings::default()
    };
    let recording = Recording::open(&file.path, &settings);
    let recording = recording.unwrap_or_else(|error| panic!("{error}"));
    (file, recording)
}

/// Time at 1 kHz and two channels of primes, nine rows.
const PRIMES: [(f64, f64); 9] = [
    (2.5, -3.25),
    (5.5, -7.25),
    (11.5, -13.25),
    (17.5, -19.25),
    (23.5, -29.25),
    (31.5, -37.25),
    (41.5, -43.25),
    (47.5, -53.25),
    (59.5, -61.25),
];

fn table(header: &str, separator: &str, decimal: &str, line_end: &str) -> String {
    let mut text = format!("{header}{line_end}");
    for (at, (a, b)) in PRIMES.iter().enumerate() {
        let row = format!("0.{at:03}{separator}{a}{separator}{b}");
        text.push_str(&row.replace('.', decimal));
        text.push_str(line_end);
    }
    text
}

fn channels() -> Vec<Vec<f64>> {
    let (a, b): (Vec<f64>, Vec<f64>) = PRIMES.iter().copied().unzip();
    vec![a, b]
}

#[test]
fn prop_every_separator_and_decimal_mark_is_found() {
    let cases = [
        (",", ".", Separator::Comma),
        (", ", ".", Separator::Comma),
        (";", ".", Separator::Semicolon),
        (";", ",", Separator::Semicolon),
        ("\t", ".", Separator::Tab),
        ("\t", ",", Separator::Tab),
        (" ", ".", Separator::Blanks),
        ("   ", ",", Separator::Blanks),
    ];
    for (separator, decimal, found) in cases {
        for line_end in ["\n", "\r\n", "\r"] {
            let case = format!("{separator:?} {decimal:?} {line_end:?}");
            let header = ["time", "force", "response"].join(separator);
            let text = table(&header, separator, decimal, line_end);
            assert_eq!(read_all(&text, &case), channels(), "{case}");
            let (_file, recording) = open(&text);
            let recording = recording.unwrap();
            let format = Format::Csv {
                separator: found,
                decimal: decimal.chars().next().unwrap(),
                timed: Timing::TimeColumn,
            };
            assert_eq!(recording.format(), format, "{case}");
            assert_eq!(recording.sample_rate(), 1000.0, "{case}");
            assert_eq!(recording.channel_by_name("response").unwrap(), 1, "{case}");
        }
    }
}

#[test]
fn prop_what_surrounds_the_numbers_does_not_matter() {
    let plain = table("time,force,response", ",", ".", "\n");
    let quoted = table("time,force,response", ",", ".", "\n").replace(',', "\",\"");
    let quoted = quoted.trim_end().replace('\n', "\"\n\"");
    let cases: Vec<(&str, String)> = vec![
        ("byte order mark", format!("\u{feff}{plain}")),
        ("no line end at the end", plain.trim_end().to_owned()),
        ("blank lines at the end", format!("{plain}\n\n  \n")),
        ("a Ctrl-Z at the end", format!("{plain}\u{1a}")),
        ("a separator at each end", plain.replace('\n', ",\n")),
        ("two separators at each end", plain.replace('\n', ",,\n")),
        ("cells in quotes", format!("\"{quoted}\"\n")),
        (
            "comments",
            format!("# made by a recorder, 2 channels\n{plain}# the end\n"),
        ),
        (
            "a preamble",
            format!("Recorder 3000\nRate: 1000 Hz\nSamples,9\n2024-05-06,10:11:12\n\n{plain}"),
        ),
        (
            "a header in the last comment",
            plain.replace("time,", "# time, "),
        ),
        (
            "units in a line of their own",
            plain.replace("response\n", "response\n(s),(N),(m/s2)\n\n"),
        ),
        ("a sign and an exponent", plain.replace("2.5,", "+25E-1,")),
        ("a Fortran exponent", plain.replace("2.5,", "0.25D+01,")),
    ];
    for (case, text) in cases {
        assert_eq!(read_all(&text, case), channels(), "{case}");
        let (_file, recording) = open(&text);
        let recording = recording.unwrap();
        assert_eq!(recording.sample_rate(), 1000.0, "{case}");
        assert_eq!(recording.channel_by_name("force").unwrap(), 0, "{case}");
    }
}

#[test]
fn prop_units_in_the_header_become_si() {
    let cases = [
        ("force (kN)", 1e3, Some("N"), "force"),
        ("force [mN]", 1e-3, Some("N"), "force"),
        ("acc (g)", STANDARD_GRAVITY, Some("m/s2"), "acc"),
        ("acc (mm/s^2)", 1e-3, Some("m/s2"), "acc"),
        ("acc (m/s\u{b2})", 1.0, Some("m/s2"), "acc"),
        ("velocity (mm/s)", 1e-3, Some("m/s"), "velocity"),
        ("x (\u{b5}m)", 1e-6, Some("m"), "x"),
        ("Mic (top) [Pa]", 1.0, Some("Pa"), "Mic (top)"),
        ("u (mV)", 1e-3, Some("V"), "u"),
        ("plain", 1.0, None, "plain"),
    ];
    for (header, factor, unit, name) in cases {
        let text = table(&format!("t;{header};response (N)"), ";", ".", "\n");
        let (_file, recording) = open(&text);
        let recording = recording.unwrap();
        let info = &recording.channels()[0];
        assert_eq!(info.name.as_deref(), Some(name), "{header}");
        assert_eq!(info.unit.as_deref(), unit, "{header}");
        assert_eq!(info.scale, factor, "{header}");
        let expected: Vec<f64> = PRIMES.iter().map(|(a, _)| a * factor).collect();
        assert_eq!(recording.read(0, 0..99).unwrap(), expected, "{header}");
        assert_eq!(info.health.maximum, 59.5 * factor, "{header}");
        assert_eq!(recording.channel_by_name(name).unwrap(), 0, "{header}");
        assert_eq!(recording.channel_by_name(header).unwrap(), 0, "{header}");
        let upper = name.to_uppercase();
        assert_eq!(recording.channel_index(&upper).unwrap(), 0, "{header}");
    }
}

#[test]
fn prop_latin_1_bytes_are_understood() {
    let text = table("t,acc (m/s?),\u{fc}ber", ",", ".", "\n");
    let bytes: Vec<u8> = text
        .chars()
        .map(|c| if c == '?' { 0xb2 } else { c as u32 as u8 })
        .collect();
    let (_file, recording) = open(bytes);
    let recording = recording.unwrap();
    assert_eq!(recording.channels()[0].unit.as_deref(), Some("m/s2"));
    assert_eq!(recording.channels()[1].name.as_deref(), Some("\u{fc}ber"));
}

#[test]
fn limit_an_unknown_unit_is_kept_with_a_warning() {
    let (_file, recording) = open(table("t,force [tons],b", ",", ".", "\n"));
    let recording = recording.unwrap();
    assert_eq!(recording.channels()[0].scale, 1.0);
    assert_eq!(recording.channels()[0].unit.as_deref(), Some("tons"));
    assert_eq!(recording.channel_by_name("force").unwrap(), 0);
    let warnings = recording.warnings();
    assert_eq!(warnings[0].code(), "unknown-unit", "{warnings:?}");
    assert!(warnings[0].to_string().contains("\"tons\""));
}

#[test]
fn prop_a_scale_beside_a_unit_wins_with_a_warning() {
    let (_file, recording) = open(table("t,force (kN),b", ",", ".", "\n"));
    let mut recording = recording.unwrap();
    recording.set_scale(0, 2.0).unwrap();
    recording.set_scale(1, 3.0).unwrap();
    assert_eq!(recording.read(0, 0..2).unwrap(), [5.0, 11.0]);
    assert_eq!(recording.channels()[0].unit, None);
    assert_eq!(recording.channels()[0].health.maximum, 119.0);
    let warnings = recording.warnings();
    let about: Vec<_> = warnings
        .iter()
        .filter(|w| w.code() == "scale-over-unit")
        .collect();
    assert_eq!(about.len(), 1, "{warnings:?}");
    let text = about[0].to_string();
    assert_message(&text, "channel 1 (\"force\")", &["scale 2", "\"kN\""]);
}

#[test]
fn regress_a_scale_that_turns_the_sign_overrules_no_unit() {
    let scaled = |scale: f64, header: &str| {
        let (_file, recording) = open(table(header, ",", ".", "\n"));
        let mut recording = recording.unwrap();
        recording.set_scale(0, scale).unwrap();
        let warnings = recording.warnings();
        let about = warnings.iter().filter(|w| w.code() == "scale-over-unit");
        about.count()
    };
    assert_eq!(scaled(-1.0, "t,force (N),b"), 0);
    assert_eq!(scaled(-1000.0, "t,force (kN),b"), 0);
    // -1 N for every kN is another unit.
    assert_eq!(scaled(-1.0, "t,force (kN),b"), 1);
    assert_eq!(scaled(-1.0, "t,force (tons),b"), 1);
    // A scale per volt gives a header in V its meaning. Beside mV it may be per volt or per millivolt.
    assert_eq!(scaled(200.0, "t,force (V),b"), 0);
    assert_eq!(scaled(200.0, "t,force (mV),b"), 1);
}

#[test]
fn prop_units_are_told_apart() {
    let known = [
        ("N", 1.0, "N"),
        ("mN", 1e-3, "N"),
        ("MN", 1e6, "N"),
        ("V", 1.0, "V"),
        ("g", 9.806_65, "m/s2"),
        ("m s^-2", 1.0, "m/s2"),
        ("m/s**2", 1.0, "m/s2"),
        ("m\u{b7}s\u{207b}\u{b2}", 1.0, "m/s2"),
        ("um", 1e-6, "m"),
        ("\u{3bc}m", 1e-6, "m"),
        ("ms", 1e-3, "s"),
        (" us ", 1e-6, "s"),
    ];
    for (text, factor, si) in known {
        assert_eq!(channel_unit(text), Some((factor, si)), "{text}");
    }
    for text in ["", "n", "kv", "m/", "furlong", "G", "kg"] {
        assert_eq!(channel_unit(text), None, "{text}");
    }
}

#[test]
fn prop_the_time_column_is_found_by_name_and_in_its_unit() {
    // The factor from the printed time to seconds, printed steps of 0.001.
    let cases = [
        ("t", 1000.0),
        ("T", 1000.0),
        ("Time", 1000.0),
        ("t (s)", 1000.0),
        ("time [ms]", 1e6),
        ("Time (min)", 1000.0 / 60.0),
        ("t_s", 1000.0),
        ("time_ms", 1e6),
        ("t_rel", 1000.0),
    ];
    for (name, rate) in cases {
        let (_file, recording) = open(table(&format!("{name},a,b"), ",", ".", "\n"));
        let recording = recording.unwrap();
        // A factor and a quotient: a few roundings.
        let deviation = (recording.sample_rate() / rate - 1.0).abs();
        assert!(deviation < 1e-12, "{name}: {} Hz", recording.sample_rate());
        assert_eq!(recording.channels().len(), 2, "{name}");
    }
    // The time need not come first, and takes no channel number.
    let text = "a,time,b\n2,0.0,3\n5,0.5,7\n11,1.0,13\n";
    assert_eq!(
        read_all(text, "middle"),
        [[2.0, 5.0, 11.0], [3.0, 7.0, 13.0]]
    );
    // An ordinary channel whose name begins with t_, beside the time.
    let text = "t_room,t,b\n20,0.0,3\n20,0.5,7\n20,1.0,13\n";
    assert_eq!(
        read_all(text, "t_room"),
        [[20.0, 20.0, 20.0], [3.0, 7.0, 13.0]]
    );
    // A temperature before the time, in whatever unit.
    for unit in ["deg C", "Celsius", "\u{2103}", "\u{b0}C", "Grad"] {
        let text = format!("T ({unit}),time (s),b\n20,0.0,3\n21,0.5,7\n20,1.0,13\n");
        let read = read_all(&text, "temperature");
        assert_eq!(read, [[20.0, 21.0, 20.0], [3.0, 7.0, 13.0]], "{unit}");
    }
    let message = open_error(table("t (kg),a,b", ",", ".", "\n"));
    assert_message(&message, "tested.dat:2: ", &["\"kg\"", "allowed: s, ms"]);
}

#[test]
fn limit_without_a_time_column_the_rate_must_be_given() {
    let text = table("x,force,response", ",", ".", "\n");
    let message = open_error(&text);
    assert_message(
        &message,
        "tested.dat:2: no time column and no sample rate",
        &["column 1 rises evenly", "sample_rate in Hz"],
    );
    let (_file, recording) = with_rate(&text, 5120.0);
    assert_eq!(recording.sample_rate(), 5120.0);
    assert_eq!(recording.channels().len(), 3);
    let headless: String = text
        .lines()
        .skip(1)
        .map(|line| format!("{line}\n"))
        .collect();
    // Without headings the first column is the time, and must agree with a rate that is given.
    let settings = ReadSettings {
        sample_rate: Some(5120.0),
        ..ReadSettings::default()
    };
    let headless = file("tested.dat", headless);
    let error = Recording::open(&headless.path, &settings).expect_err("two rates");
    assert!(
        error.to_string().contains("as a time of 1000 Hz"),
        "{error}"
    );
    // One column with a decimal comma: the header shows that the comma separates nothing.
    let (_file, recording) = with_rate("force (N)\n2,5\n3,5\n5,25\n", 5120.0);
    assert_eq!(recording.read(0, 0..9).unwrap(), [2.5, 3.5, 5.25]);
}

#[test]
fn prop_a_given_rate_gives_way_to_the_time_column() {
    let (_file, recording) = with_rate(table("t,a,b", ",", ".", "\n"), 5120.0);
    assert_eq!(recording.sample_rate(), 1000.0);
    let warnings = recording.warnings();
    let ignored = "given (5120 Hz) differs from the file's own (1000 Hz)";
    let mut found = warnings
        .iter()
        .filter(|w| w.code() == "sample-rate-ignored");
    assert!(found.any(|warning| warning.to_string().contains(ignored)));
}

#[test]
fn limit_bad_cells_are_named_by_line_column_and_value() {
    let good = "time,force,response\n0.000,2,3\n0.001,5,7\n0.002,11,13\n0.003,17,19\n";
    let cases = [
        (
            "0.001,5,7",
            "0.001,abc,7",
            3,
            "column 2 (\"force\") holds \"abc\"",
        ),
        (
            "0.000,2,3",
            "0.000,abc,3",
            2,
            "column 2 (\"force\") holds \"abc\"",
        ),
        (
            "0.000,2,3",
            "abc,2,3",
            2,
            "column 1 (\"time\") holds \"abc\"",
        ),
        (
            "0.003,17,19",
            "0.003,17,1 9",
            5,
            "column 3 (\"response\") holds \"1 9\"",
        ),
        ("0.002,11,13", "0.002,1.1.1,13", 4, "holds \"1.1.1\""),
        (
            "0.001,5,7",
            "0.001,NaN,7",
            3,
            "holds \"NaN\"; allowed: finite",
        ),
        (
            "0.000,2,3",
            "0.000,nan,3",
            2,
            "holds \"nan\"; allowed: finite",
        ),
        ("0.001,5,7", "0.001,5,-inf", 3, "holds \"-inf\""),
        ("0.001,5,7", "0.001,5,1e999", 3, "holds \"1e999\""),
        (
            "0.001,5,7",
            "0.001,,7",
            3,
            "column 2 (\"force\") is missing",
        ),
        (
            "0.000,2,3",
            "0.000,2,",
            2,
            "column 3 (\"response\") is missing",
        ),
        (
            "0.000,2,3",
            "0.000,2",
            2,
            "column 3 (\"response\") is missing",
        ),
        (
            "0.003,17,19",
            "0.003,17",
            5,
            "is missing; every row needs 3",
        ),
        (
            "0.001,5,7",
            "0.001,5,7,9",
            3,
            "4 cells where the rows have 3",
        ),
    ];
    assert_eq!(read_all(good, "good").len(), 2);
    for (from, to, line, text) in cases {
        let message = open_error(good.replace(from, to));
        assert_message(&message, &format!("tested.dat:{line}: "), &[text]);
    }
}

#[test]
fn limit_decimal_marks_are_not_mixed() {
    let text = "time;a\n0,000;1,5\n0,001;2,5\n0,002;1.234,5\n0,003;2,5\n";
    assert_message(&open_error(text), "tested.dat:4: ", &["\"1.234,5\""]);
    let text = "time;a\n0,000;1,5\n0,001;2,5\n0,002;1.5\n0,003;2,5\n";
    assert_message(
        &open_error(text),
        "tested.dat:4: column 2 (\"a\")",
        &["\"1.5\"", "use \",\" as decimal mark"],
    );
    let text = "time,a\n0,000,1,5\n0,001,2,5\n0,002,3,5\n";
    assert_message(
        &open_error(text),
        "tested.dat:1: ",
        &["2 names head 4 columns", "semicolon"],
    );
}

#[test]
fn limit_what_holds_no_table_is_refused() {
    assert_message(
        &open_error("once upon a time\nthere was 1 beam\n"),
        "tested.dat:2: no line of numbers",
        &["\"there was 1 beam\""],
    );
    assert_message(
        &open_error("\n\n\n"),
        "tested.dat:",
        &["no line of numbers"],
    );
    assert_message(
        &open_error("time\n0.1\n0.2\n0.3\n"),
        "tested.dat:2: column 1 is time",
        &["at least one channel"],
    );
    assert_message(
        &open_error("time,a\n0.1,2\n"),
        "tested.dat:2: no time column and no sample rate (a single row",
        &[],
    );
    // A blank line may stand for a lost row where no time shows that none is.
    let file = file("tested.dat", "a,b\n1,2\n\n3,4\n5,6\n");
    let settings = ReadSettings {
        sample_rate: Some(100.0),
        ..ReadSettings::default()
    };
    let error = Recording::open(&file.path, &settings).expect_err("a blank line");
    assert!(
        error.to_string().contains("tested.dat:3: empty line"),
        "{error}"
    );
    assert_eq!(
        read_all("t,b\n1,2\n\n2,4\n3,6\n", "blank line beside a time"),
        [[2.0, 4.0, 6.0]]
    );
}

#[test]
fn limit_a_line_without_end_is_refused_and_not_kept() {
    let mut text = b"time,a\n0,1\n1,2\n2,3\n".to_vec();
    text.extend(std::iter::repeat_n(b'1', 3 << 20));
    assert_message(
        &open_error(&text),
        "tested.dat:5: ",
        &["more than 1048576 bytes"],
    );
    let digits = vec![b'1'; 3 << 20];
    assert_message(&open_error(&digits), "tested.dat:1: ", &[]);
}

/// A table whose times are printed by `print`.
fn timed(rows: usize, rate: f64, print: impl Fn(f64) -> String) -> String {
    let rows = (0..rows).map(|at| format!("{},{}\n", print(at as f64 / rate), at % 7));
    std::iter::once("time,a\n".to_owned()).chain(rows).collect()
}

#[test]
fn prop_rounded_times_give_the_exact_rate() {
    let six_digits = |t: f64| {
        // Six significant digits, as many programs print by default.
        let leading = if t > 0.0 { t.log10().floor() as i32 } else { 0 };
        format!("{t:.*}", (5 - leading).max(0) as usize)
    };
    for rate in [1280.0, 44_100.0, 600.0, 51_200.0] {
        let cases = [
            ("exact", timed(9000, rate, |t| t.to_string())),
            ("7 decimals", timed(9000, rate, |t| format!("{t:.7}"))),
            (
                "single precision",
                timed(9000, rate, |t| (t as f32).to_string()),
            ),
        ];
        for (case, text) in cases {
            let (_file, recording) = open(text);
            let recording = recording.unwrap_or_else(|error| panic!("{case}: {error}"));
            assert_eq!(recording.sample_rate(), rate, "{case}");
            assert_eq!(recording.frames(), 9000, "{case}");
        }
    }
    for (rate, text) in [
        (1280.0, timed(9000, 1280.0, six_digits)),
        (600.0, timed(9000, 600.0, |t| format!("{t:.3}"))),
        (1000.0, timed(9000, 1000.0, |t| format!("{t:.3}"))),
        (100.5, timed(9000, 100.5, |t| t.to_string())),
    ] {
        let (_file, recording) = open(text);
        let recording = recording.unwrap_or_else(|error| panic!("{rate}: {error}"));
        // A rate that is no whole number keeps the roundings of the last time.
        let deviation = (recording.sample_rate() / rate - 1.0).abs();
        assert!(deviation < 1e-9, "{rate}: {}", recording.sample_rate());
    }
}

#[test]
fn limit_uneven_sampling_is_named_where_it_happens() {
    let print = |t: f64| format!("{t:.6}");
    let even = timed(3000, 1000.0, print);
    assert_eq!(read_all(&even, "even")[0].len(), 3000);
    // Row 2000 stands in line 2002.
    let replace = |time: &str| even.replace("\n2.000000,", &format!("\n{time},"));
    for (time, line) in [
        ("2.000100", 2002),
        ("1.999900", 2002),
        // 2.2 % of the step; what is allowed is 2 % and one unit of the last digit.
        ("2.000022", 2002),
        ("1.999000", 2002),
        ("1.000000", 2002),
        ("-2.000000", 2002),
    ] {
        let message = open_error(replace(time));
        assert_message(
            &message,
            &format!("tested.dat:{line}: uneven sampling"),
            &["the step elsewhere is 0.001", "2 %"],
        );
    }
    let message = open_error("time,a\n0,1\n0.001,2\n0.001,3\n");
    assert_message(&message, "tested.dat:4: uneven sampling", &[]);
    // Every step off by 0.04 % to either side, beyond what rounding explains.
    let jitter = |t: f64| format!("{:.12}", t + 4e-7 * (1e3 * t).round().rem_euclid(2.0));
    assert_eq!(
        read_all(timed(3000, 1000.0, jitter), "jitter")[0].len(),
        3000
    );
    // One unit of the last digit is 0.1 % here.
    assert_eq!(read_all(replace("2.000001"), "within")[0].len(), 3000);
}

#[test]
fn limit_lost_rows_are_counted() {
    // With three decimals the step is one unit of the last digit, which rounding must not excuse.
    for decimals in [3, 6] {
        let even = timed(3000, 1000.0, |t| format!("{t:.decimals$}"));
        let lines: Vec<&str> = even.lines().collect();
        for (lost, text) in [(1, "1 row were missing"), (64, "64 rows were missing")] {
            // Lines 2 to 1501 hold 1500 rows; then the gap.
            let kept = [&lines[..1501], &lines[1501 + lost..]].concat().join("\n");
            let message = open_error(kept);
            assert_message(&message, "tested.dat:1502: uneven sampling", &[text]);
        }
    }
    // A gap among the first rows does not spoil the reference.
    let early = "time,a\n0,1\n1,2\n2,3\n5,4\n6,5\n7,6\n";
    assert_message(
        &open_error(early),
        "tested.dat:5: ",
        &["2 rows were missing"],
    );
}

#[test]
fn limit_rounding_does_not_excuse_what_it_cannot_explain() {
    // Three decimals at 10 Hz: 0.004 is 4 % of the step, but no rounding moves one time alone.
    let even = timed(500, 10.0, |t| format!("{t:.3}"));
    let message = open_error(even.replace("\n20.000,", "\n20.004,"));
    assert_message(&message, "tested.dat:202: uneven sampling", &[]);
}

/// A file of several index entries and read blocks.
fn long_table() -> (TestFile, Vec<Vec<f64>>) {
    let channel = |stride: u64| (0..20_000_u64).map(move |at| (at * stride % 100_003) as f64);
    let channels: Vec<Vec<f64>> = [7919, 104_729].map(|s| channel(s).collect()).to_vec();
    let mut text = "# a comment\ntime,a (mN),b\n".to_owned();
    for (at, (a, b)) in channels[0].iter().zip(&channels[1]).enumerate() {
        if at % 1000 == 500 {
            text.push_str("# a mark set by the operator\n\n");
        }
        text.push_str(&format!("{:.4},{a},{b}\n", at as f64 / 5000.0));
    }
    (file("long.csv", text), channels)
}

#[test]
fn prop_a_range_is_a_slice_of_all_and_blocks_join() {
    let (file, channels) = long_table();
    let recording = Recording::open(&file.path, &ReadSettings::default()).unwrap();
    assert_eq!(recording.frames(), 20_000);
    let milli: Vec<f64> = channels[0].iter().map(|x| x * 1e-3).collect();
    for (start, end) in [
        (0, 1),
        (4095, 4097),
        (4096, 4097),
        (8191, 12_289),
        (500, 501),
        (19_999, 20_000),
        (0, 20_000),
    ] {
        let read = recording
            .read_channels(&[1, 0], start as u64..end as u64)
            .unwrap();
        assert_eq!(read[0], channels[1][start..end], "{start}..{end}");
        assert_eq!(read[1], milli[start..end], "{start}..{end}");
    }
    for block in [997, 4096, 50_000] {
        let mut joined = Vec::<f64>::new();
        for part in recording.blocks(&[1], block) {
            let part = part.unwrap();
            assert_eq!(part.start, joined.len() as u64, "block of {block}");
            joined.extend(&part.samples[0]);
        }
        assert_eq!(joined, channels[1], "block of {block}");
    }
}

#[test]
fn limit_names_that_miss_are_answered_with_what_exists() {
    let (_file, recording) = open(table("time,force (N),response", ",", ".", "\n"));
    let recording = recording.unwrap();
    let error = recording.channel_by_name("forse").expect_err("unknown");
    assert_message(
        &error.to_string(),
        recording.name(),
        &[
            "no channel named \"forse\"; did you mean \"force\"?",
            "1 (\"force\"), 2 (\"response\")",
        ],
    );
    let error = recording.channel_by_name("zzz").expect_err("unknown");
    assert!(!error.to_string().contains("did you mean"), "{error}");
    let error = recording.channel_index("3").expect_err("unknown");
    assert!(error.to_string().contains("no channel 3"), "{error}");
    let (_file, twice) = open(table("time,acc,acc", ",", ".", "\n"));
    let error = twice
        .unwrap()
        .channel_by_name("acc")
        .expect_err("two of them");
    assert_message(
        error.to_string().split(": ").nth(1).unwrap(),
        "2 channels are named \"acc\"",
        &["number"],
    );
    // Columns named by number: the name goes before the number.
    let (_file, numbered) = open(table("time,2,1", ",", ".", "\n"));
    assert_eq!(numbered.unwrap().channel_index("2").unwrap(), 0);
}

#[test]
fn regress_a_time_column_with_too_few_digits_is_told_as_such() {
    let rows: String = (0..40)
        .map(|row| format!("{:.3},{row},1\n", f64::from(row) / 4096.0))
        .collect();
    let message = open_error(format!("Time (s),force,response\n{rows}"));
    // 0/4096 and 1/4096 s are 0.000 both: line 3.
    assert_message(
        &message,
        "tested.dat:3: column 1 (\"Time\") is named as time",
        &["repeats", "more digits", "sample_rate in Hz"],
    );
}

#[test]
fn regress_a_temperature_named_t_is_no_time() {
    let rows: String = (0..40)
        .map(|row| format!("{},{row},1\n", 20 + row % 2))
        .collect();
    for header in ["T (\u{b0}C)", "T (K)", "T (V)", "time (V)"] {
        let message = open_error(format!("{header},force,response\n{rows}"));
        assert!(!message.contains("named as time"), "{message}");
        assert!(message.contains("sample_rate"), "{message}");
    }
    // One that rises throughout, with and without a time beside it.
    let both = "T (K),time (s),a\n20,0.000,1\n21,0.001,2\n22,0.002,3\n";
    let (_file, recording) = open(both);
    assert_eq!(recording.expect("it has a time").sample_rate(), 1000.0);
    let (_file, german) = open("Zeit [s],a\n0.000,1\n0.001,2\n0.002,3\n");
    assert_eq!(german.expect("it has a time").sample_rate(), 1000.0);
    let furlongs = open_error("t (furlong),a\n0,1\n1,2\n2,3\n");
    assert!(furlongs.contains("not one of time"), "{furlongs}");
}

#[test]
fn regress_utf_16_is_named_with_its_remedy() {
    let mut bytes = vec![0xff, 0xfe];
    bytes.extend("t;a\n0;1\n".encode_utf16().flat_map(u16::to_le_bytes));
    assert_message(&open_error(bytes), "tested.dat: ", &["UTF-16", "UTF-8"]);
}
