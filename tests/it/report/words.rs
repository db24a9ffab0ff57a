//! Page, JSON, CSV and terminal.

use serde_json::Value;
use tapjoint::report::document::{Document, TapSection, WarningSection};
use tapjoint::report::{
    render_json, render_modes_csv, render_parameters_csv, render_text, summary,
};

use super::{broken, fixture, incomplete, rendered, text_of};

fn page(document: &Document) -> String {
    text_of(&rendered(document, &fixture::figures()), "report.html")
}

#[test]
fn prop_page_holds_every_section_and_number() {
    let html = page(&fixture::document());
    let wanted = [
        "id=\"warnings\"",
        "id=\"summary\"",
        "id=\"joint\"",
        "id=\"uncertainty\"",
        "id=\"modes\"",
        "id=\"recordings\"",
        "id=\"method\"",
        "Estimated parameters",
        "Measured and predicted frequencies",
        "Pair regression",
        "All frequencies changed by the same percentage",
        "Which mode drives which parameter",
        "Readings of each recording",
        "Recordings and their spectra",
        "double hit: second excursion of 31 % after 14 ms",
        "MN/m",
        "N m/rad",
        "17.0030 ± 0.0094",
        "mains 50 Hz",
        env!("CARGO_PKG_VERSION"),
    ];
    for part in wanted {
        assert!(html.contains(part), "the page lacks {part}");
    }
    assert_eq!(html.matches("<svg").count(), 8, "pictures in the page");
    let place = |part: &str| html.find(part).unwrap_or(usize::MAX);
    assert!(
        place("id=\"warnings\"") < place("id=\"summary\""),
        "warnings come first"
    );
}

#[test]
fn prop_page_needs_nothing_from_elsewhere() {
    let html = page(&fixture::document());
    for part in ["http", "<script", "src=", "@import", "url(", "<link"] {
        assert!(!html.contains(part), "the page asks for something: {part}");
    }
}

#[test]
fn prop_page_escapes_what_users_write() {
    let mut document = fixture::document();
    let attack = "<script>alert('x')</script>&\"";
    if let Some(test) = &mut document.test {
        test.name = attack.into();
    }
    document.warnings.push(WarningSection {
        code: "odd".into(),
        text: attack.into(),
    });
    for recording in document.recordings.iter_mut().flatten() {
        recording.file = attack.into();
        for tap in &mut recording.taps {
            tap.reason = Some(attack.into());
        }
    }
    for mode in document.modes.iter_mut().flatten() {
        mode.label = Some(attack.into());
    }
    let mut figures = fixture::figures();
    for figure in &mut figures {
        figure.file = attack.into();
    }
    let html = text_of(&rendered(&document, &figures), "report.html");
    assert!(!html.contains("<script"), "something was not escaped");
    assert!(html.contains("&#60;script"), "the name is not shown");
}

#[test]
fn prop_json_has_the_promised_keys() {
    let text = render_json(&fixture::document()).expect("the document is written");
    let json: Value = serde_json::from_str(&text).expect("it is JSON");
    let wanted = [
        (
            "",
            "version test recordings modes estimate prediction perturbation warnings",
        ),
        ("/test", "name kind model"),
        (
            "/recordings/0",
            "file sample_rate channels seconds taps line_spacing band window window_decay modes",
        ),
        ("/recordings/0/taps/0", "time peak_force accepted reason"),
        ("/recordings/0/modes/0", "mode frequency std damping"),
        (
            "/modes/0",
            "mode frequency method line_frequency half_line std damping damping_std lambda \
             recording label",
        ),
        (
            "/estimate",
            "method modes_used reason kx ky kz coupling kt kr ktr modulus density correlations \
             pairs",
        ),
        ("/estimate/kx", "value std low high"),
        ("/estimate/pairs", "kx ky kz closure"),
        (
            "/prediction/0",
            "mode measured predicted lambda error_percent used",
        ),
        ("/perturbation/0", "percent method kx ky kz"),
        ("/warnings/0", "code text"),
    ];
    for (place, keys) in wanted {
        let object = json.pointer(place).and_then(Value::as_object);
        let object = object.unwrap_or_else(|| panic!("{place} is no object"));
        for key in keys.split_whitespace() {
            assert!(object.contains_key(key), "{place} lacks {key}");
        }
    }
    assert_eq!(json.pointer("/version"), Some(&Value::from(1)));
    assert_eq!(
        json.pointer("/modes/0/frequency"),
        Some(&Value::from(17.003))
    );
    assert_eq!(json.pointer("/modes/0/label"), Some(&Value::Null));
}

#[test]
fn limit_json_writes_null_for_what_is_not_finite() {
    let text = render_json(&broken()).expect("the document is written");
    let json: Value = serde_json::from_str(&text).expect("it is JSON");
    for place in [
        "/estimate/kx/value",
        "/estimate/kt/value",
        "/prediction/0/error_percent",
        "/resolution_span/kx/1",
    ] {
        assert_eq!(json.pointer(place), Some(&Value::Null), "{place}");
    }
}

#[test]
fn limit_json_of_an_unanswered_question_is_null_with_its_reason() {
    let (_, document, _) = incomplete().remove(3);
    let text = render_json(&document).expect("the document is written");
    let json: Value = serde_json::from_str(&text).expect("it is JSON");
    assert_eq!(json.pointer("/estimate"), Some(&Value::Null));
    let reason = "3 modes are needed, 0 were found";
    assert_eq!(json.pointer("/estimate_reason"), Some(&Value::from(reason)));
    assert_eq!(json.pointer("/prediction"), None, "left out, not null");
}

#[test]
fn val_parameters_csv() {
    let csv = render_parameters_csv(&fixture::document()).expect("the table is written");
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("parameter,method,unit,value,std,low,high")
    );
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let named: Vec<[&str; 4]> = rows
        .iter()
        .map(|row| [row[0], row[1], row[2], row[3]])
        .collect();
    let wanted = [
        ["kx", "pairs", "1", "970.5"],
        ["ky", "pairs", "1", "1.251"],
        ["kt", "pairs", "N/m", "1382000"],
        ["kr", "pairs", "N m/rad", "318.9"],
        ["closure", "pairs", "1", "0.0021"],
    ];
    assert_eq!(named, wanted);
    let std: f64 = rows[0][4].parse().expect("a number");
    // Written with all digits: only the fixture's own product rounds.
    assert!((std - 0.041 * 970.5).abs() < 1e-12, "std {std}");
    assert_eq!(rows[4][4..], ["", "", ""], "unknown cells are empty");
}

#[test]
fn val_modes_csv() {
    let csv = render_modes_csv(&fixture::document()).expect("the table is written");
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 7, "a header, five modes and the mains line");
    assert!(
        lines[1].starts_with("1,,low.wav,interpolated,17.003,"),
        "{}",
        lines[1]
    );
    assert!(
        lines[6].starts_with(",mains 50 Hz,low.wav,line,50,,50,0.125,,"),
        "{}",
        lines[6]
    );
}

#[test]
fn prop_terminal_lines_fit_80_columns() {
    let mut document = fixture::document();
    for recording in document.recordings.iter_mut().flatten() {
        recording.file = "folder/with/a/very/long/name/of/a/recording/full_2026-03-14.wav".into();
        recording.taps.extend((0..100).map(|index| TapSection {
            time: 100.0 + index as f64,
            peak_response: Some(1234.5678e9),
            reason: Some("a reason that goes on and on and on until the line is full".into()),
            ..TapSection::default()
        }));
    }
    document.warnings.push(WarningSection {
        code: "long".into(),
        text: "x".repeat(300),
    });
    for (case, document) in [("whole", fixture::document()), ("long", document)] {
        for line in render_text(&document).lines() {
            let length = line.chars().count();
            assert!(length <= 80, "{case}: {length} characters in {line:?}");
        }
    }
}

#[test]
fn prop_terminal_ends_with_what_was_found() {
    let text = render_text(&fixture::document());
    let ending = text.split("What was found\n").nth(1).unwrap_or_default();
    for part in [
        "8 of 12 taps",
        "5 modes",
        "1.382 MN/m",
        "−0.32 %",
        "Kx from",
    ] {
        assert!(ending.contains(part), "{part} is missing in {ending}");
    }
}

#[test]
fn val_summary_counts() {
    let sentences = summary::sentences(&fixture::document());
    assert_eq!(sentences.len(), 5, "{sentences:?}");
    assert_eq!(
        sentences[0],
        "8 of 12 taps in 2 recordings were used, 4 were rejected."
    );
    let (_, document, _) = incomplete().remove(3);
    let sentences = summary::sentences(&document);
    assert!(
        sentences.contains(&"No modes were found.".to_owned()),
        "{sentences:?}"
    );
    let reason = "No stiffness was estimated: 3 modes are needed, 0 were found.";
    assert!(sentences.contains(&reason.to_owned()), "{sentences:?}");
}
