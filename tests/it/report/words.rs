//! Page, JSON, CSV and terminal.

use serde_json::Value;
use tapjoint::recording::{ChannelHealth, ChannelInfo};
use tapjoint::report::document::{
    AverageSection, ChannelSection, Document, EstimateMethod, ModeSection, MonteCarloSection,
    PredictionSection, ReadBy, TapSection, Uncertain, WarningSection,
};
use tapjoint::report::tables::parameters;
use tapjoint::report::words::findings as summary;
use tapjoint::report::{
    Screen, render_json, render_modes_csv, render_parameters_csv, render_progress, render_taps_csv,
    render_text,
};
use tapjoint::structure::Assembly;
use tapjoint::taps::Pulse;

use super::{broken, fixture, incomplete, rendered, text_of};
use crate::golden::assert_snapshot;

fn page(document: &Document) -> String {
    text_of(&rendered(document, &fixture::recordings()), "report.html")
}

#[test]
fn prop_page_holds_every_section_and_picture() {
    let html = page(&fixture::document());
    for id in "warnings summary joint uncertainty modes recordings method".split(' ') {
        assert!(html.contains(&format!("id=\"{id}\"")), "no section {id}");
    }
    let svgs = html.split("<script>").next().unwrap_or_default();
    // With the sign of the state and the picture of the first screen.
    assert_eq!(svgs.matches("<svg").count(), 12, "pictures in the page");
    let place = |part: &str| html.find(part).unwrap_or(usize::MAX);
    assert!(
        place("id=\"answer\"") < place("id=\"warnings\""),
        "the answer comes first"
    );
}

#[test]
fn regress_words_of_a_result_so_far() {
    let lines = render_progress(&fixture::document());
    assert_snapshot("progress", &lines.join("\n"));
}

#[test]
fn prop_page_needs_nothing_from_elsewhere() {
    let html = page(&fixture::document());
    // The plotting library names its home in a comment; the policy lets nothing be fetched.
    let html = html.replace("https://github.com/leeoniya/uPlot", "");
    for part in ["http://", "https://", "src=", "@import", "url(", "<link"] {
        assert!(!html.contains(part), "the page asks for something: {part}");
    }
    assert!(html.contains("default-src 'none'"), "the policy is missing");
}

#[test]
fn regress_print_keeps_short_tables_whole_and_opens_results() {
    let html = page(&fixture::document());
    let parameters = html.split("Estimated parameters").next().unwrap();
    let (_, table) = parameters.rsplit_once("<div class=\"").unwrap();
    assert!(table.starts_with("table short\""), "{table}");
    let modes = html.split("id=\"modes\"").nth(1).unwrap();
    let modes = modes.split("</section>").next().unwrap();
    let folded = modes.matches("<details").count();
    assert!(folded > 0);
    assert_eq!(
        modes.matches("<details class=\"table result\"").count(),
        folded
    );
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
        ..WarningSection::default()
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
    let mut recordings = fixture::recordings();
    for recording in &mut recordings {
        recording.file = attack.into();
    }
    let html = text_of(&rendered(&document, &recordings), "report.html");
    assert!(!html.contains("<script>alert"), "something was not escaped");
    assert!(!html.contains(attack), "something was not escaped");
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
        (
            "/quality/0",
            "check subject recording tap frequency value limit unit outcome text",
        ),
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
        "/resolution_span/0/kx/1",
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
        Some("parameter,method,unit,value,std,low,high,std_scaled,low_scaled,high_scaled")
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
    assert_eq!(rows[4][4..], [""; 6], "unknown cells are empty");
}

/// The fixture with uneven limits of Kt.
fn misfitting() -> Document {
    let mut document = fixture::document();
    let estimate = document.estimate.as_mut().and_then(Option::as_mut);
    let kt = estimate.and_then(|e| e.kt.as_mut()).unwrap();
    let kt = &mut kt.uncertain;
    (kt.low, kt.high) = (Some(0.034e6), Some(4.91e6));
    document
}

#[test]
fn regress_without_stated_uncertainties_the_misfit_gives_the_limits() {
    let mut document = misfitting();
    let estimate = document.estimate.as_mut().and_then(Option::as_mut).unwrap();
    estimate.method = EstimateMethod::Consistent;
    let table = parameters(&document).expect("an estimate");
    let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names[5..], ["95 % low", "95 % high"]);
    assert_snapshot("parameters_note_without_uncertainties", &table.note);
}

#[test]
fn regress_doubts_about_the_regression_stand_with_it() {
    let mut document = fixture::document();
    document.warnings[0].beside = true;
    let text = render_text(&document, Screen::default());
    assert!(text.contains("note (closure)"), "{text}");
    assert!(!text.contains("warning (closure)"), "{text}");
    let html = page(&document);
    assert!(
        html.contains("<summary>1 doubt</summary>"),
        "the page counts it"
    );
    let own = html.split("<h3>Pair regression</h3>").nth(1).unwrap();
    let own = own.split("</div>\n</div>").next().unwrap_or(own);
    assert!(own.contains("The pair regression does not close"), "{own}");
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
fn val_taps_csv() {
    let mut document = fixture::document();
    let recordings = document.recordings.as_mut().expect("recordings");
    recordings[0].taps[0].pulse = Some(Pulse {
        width: 6e-4,
        fall_10_db: Some(1140.0),
        fall_20_db: None,
        usable_to: 1000.0,
    });
    let csv = render_taps_csv(&document).expect("the table is written");
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(
        lines[1], "low.wav,1,0.31,41.2,N,true,,0.0006,1140,,1000,low.wav",
        "every column has its head: {}",
        lines[0]
    );
    assert_eq!(lines[0].split(',').count(), 12);
    assert!(lines[2].ends_with(",,,,low.wav"), "{}", lines[2]);
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
        ..WarningSection::default()
    });
    for (case, document) in [("whole", fixture::document()), ("long", document)] {
        for line in render_text(&document, Screen::default()).lines() {
            let length = line.chars().count();
            assert!(length <= 80, "{case}: {length} characters in {line:?}");
        }
    }
}

#[test]
fn regress_a_narrow_interval_shows_its_width() {
    let mut document = fixture::document();
    let estimate = document.estimate.as_mut().and_then(Option::as_mut);
    let stiffness = estimate.and_then(|e| e.kt.as_mut()).expect("a stiffness");
    let stiffness = &mut stiffness.uncertain;
    // 1.96 standard deviations of 1 N/m in 1.382 MN/m.
    (stiffness.low, stiffness.high) = (Some(1_382_000.0 - 1.96), Some(1_382_000.0 + 1.96));
    stiffness.std = Some(1.0);
    let text = summary::sentences(&document)
        .join(" ")
        .replace('\u{a0}', " ");
    let expected = "Kt = 1.3820 MN/m (95 %: \u{b1}0.00014 %)";
    assert!(text.contains(expected), "{text}");
}

/// The fixture without what only a description gives, as of a bare recording.
fn bare() -> Document {
    let mut document = fixture::document();
    if let Some(test) = &mut document.test {
        test.kind = None;
        test.model = None;
    }
    for mode in document.modes.iter_mut().flatten() {
        mode.lambda = None;
    }
    document
        .recordings
        .iter_mut()
        .for_each(|list| list.truncate(1));
    Document {
        estimate: None,
        prediction: None,
        perturbation: None,
        resolution_span: None,
        warnings: Vec::new(),
        ..document
    }
}

/// A bare recording with one more peak, which is no mode.
fn with_unclear_peak() -> Document {
    let mut document = bare();
    document.modes.as_mut().unwrap().push(ModeSection {
        label: Some("no clear resonance".into()),
        frequency: 77.0,
        ..ModeSection::default()
    });
    document
}

/// The fixture as of recordings that were only looked at.
fn inspected() -> Document {
    let channel = ChannelSection {
        channel: 2,
        info: ChannelInfo {
            name: Some("ch2_response_of_the_left_beam".into()),
            unit: Some("m/s2".into()),
            header_unit: None,
            scale: 1.0,
            health: ChannelHealth {
                mean: -0.0154,
                peak: 7.47,
                rms: 1.4,
                full_scale_samples: 12,
                flat_top_count: 3,
                dropped_samples: 40,
                ..ChannelHealth::default()
            },
        },
    };
    let mut document = bare();
    for recording in document.recordings.iter_mut().flatten() {
        recording.channel_details = vec![channel.clone()];
        recording.line_spacing = None;
        recording.resolution = None;
        recording.window = None;
        recording.window_decay = None;
        recording.modes.clear();
    }
    Document {
        modes: None,
        ..document
    }
}

/// Adds what a terminal shows of a document to a text.
fn show(text: &mut String, title: &str, document: &Document) {
    text.push_str(&format!(
        "######## {title}\n{}\n",
        render_text(document, Screen::default())
    ));
}

#[test]
fn frozen_terminal_of_a_whole_test_and_of_parts_of_one() {
    let mut text = String::new();
    show(
        &mut text,
        "a described test; many taps: rejected ones alone are listed",
        &fixture::document(),
    );
    show(
        &mut text,
        "a bare recording; few taps: all are listed",
        &bare(),
    );
    let mut document = with_unclear_peak();
    for recording in document.recordings.iter_mut().flatten() {
        recording.has_hammer = false;
        recording.tap_unit = None;
        for tap in &mut recording.taps {
            tap.peak_response = tap.peak_force.take();
        }
    }
    show(
        &mut text,
        "without a hammer; a peak that is no mode",
        &document,
    );
    show(&mut text, "inspected recordings", &inspected());
    for predicted in [None, Some(22.5628)] {
        let row = PredictionSection {
            mode: 1,
            predicted,
            lambda: Some(1.849_96),
            ..PredictionSection::default()
        };
        let document = Document {
            prediction: Some(vec![row]),
            ..Document::default()
        };
        show(&mut text, "a prediction", &document);
    }
    assert_snapshot("terminal_parts", &text);
}

#[test]
fn frozen_terminal_of_doubts_and_of_the_model_that_misses() {
    let csv = render_parameters_csv(&misfitting()).unwrap();
    assert_snapshot("parameters_of_a_misfit_csv", &csv);
    let mut text = String::new();
    let mut document = misfitting();
    document.warnings[0].beside = true;
    document
        .recordings
        .as_mut()
        .unwrap()
        .last_mut()
        .unwrap()
        .aside = Some("8.8 times its tap level".to_owned());
    let modes = document.modes.iter_mut().flatten();
    for (index, mode) in modes.filter(|mode| mode.mode.is_some()).enumerate() {
        mode.method = Some(if index == 1 {
            ReadBy::Interpolated
        } else {
            ReadBy::Fit
        });
    }
    show(
        &mut text,
        "limits scaled by the misfit; a note beside the regression; a recording aside; a mode without a fit",
        &document,
    );
    let value = |value: f64| Uncertain {
        value,
        std: None,
        low: Some(0.9 * value),
        high: Some(1.2 * value),
        ..Uncertain::default()
    };
    let mut document = Document {
        perturbation_averages: Some(vec![AverageSection {
            method: EstimateMethod::Pairs,
            kx_of_mean_percent: Some(0.011),
            ky_of_mean_percent: Some(0.012),
            kz_of_mean_percent: None,
            percent: 0.05,
            kx_percent: Some(0.5811),
            ky_percent: Some(0.1333),
            kz_percent: None,
        }]),
        monte_carlo: Some(vec![MonteCarloSection {
            method: EstimateMethod::Pairs,
            cloud: Vec::new(),
            samples: 2000,
            failed: 3,
            kx: Some(value(970.5)),
            ky: Some(value(1.251)),
            kz: None,
        }]),
        ..fixture::document()
    };
    // The page has every tap, though the terminal sums them up, and no column for what was not drawn.
    let html = page(&document);
    for cell in ["10.510", "873.45", "2000 draws"] {
        assert!(html.contains(cell), "the page lacks {cell}");
    }
    assert!(!html.contains("Kz off by"), "an empty column");
    document.test.as_mut().unwrap().kind = Some(Assembly::Free);
    show(
        &mut text,
        "averages and draws; a free beam has no line for a joint",
        &document,
    );
    assert_snapshot("terminal_doubts", &text);
}

#[test]
fn frozen_sentences_of_the_summary() {
    let mut text = String::new();
    for (title, document) in [
        ("a described test", fixture::document()),
        ("a bare recording", bare()),
        ("limits scaled by the misfit", misfitting()),
        ("two kinds of peaks that are no modes", with_unclear_peak()),
        ("no modes", incomplete().remove(3).1),
    ] {
        let sentences = summary::sentences(&document)
            .join("\n")
            .replace('\u{a0}', " ");
        text.push_str(&format!("## {title}\n{sentences}\n"));
    }
    assert_snapshot("summary_sentences", &text);
}

#[test]
fn prop_terminal_cuts_nothing_off() {
    let mut long = fixture::document();
    for recording in long.recordings.iter_mut().flatten() {
        recording.file = "full_2026-03-14_second_visit_evening.wav".into();
    }
    for mode in long.modes.iter_mut().flatten() {
        mode.recording = Some("full_2026-03-14_second_visit_evening.wav".into());
        mode.frequency *= 1.0 + 1e-7;
        mode.interpolated_bound = Some(3.6e-6);
        mode.damping_std = Some(2.3e-8);
    }
    if let Some(mode) = long.modes.iter_mut().flatten().last() {
        mode.recording = Some("low.wav".into());
        mode.label = Some("no clear resonance".into());
    }
    let cases = [
        ("whole", fixture::document()),
        ("long", long),
        ("bare", bare()),
        ("inspected", inspected()),
    ];
    for (case, document) in cases {
        let text = render_text(&document, Screen::default());
        // Names of files alone give way, in their middle.
        let cut = text
            .lines()
            .find(|line| line.contains('…') && !line.contains("ful"));
        assert_eq!(cut, None, "{case}: something was cut off:\n{text}");
    }
}

/// The fixture with modes that need all digits, each from a recording of its own.
fn crowded(files: [&str; 3]) -> Document {
    let mut document = fixture::document();
    let first = document.modes.iter().flatten().next().unwrap().clone();
    let mode = |(index, file): (usize, &&str)| ModeSection {
        mode: Some(index + 1),
        label: None,
        frequency: 1457.4131,
        line_frequency: Some(1457.4592),
        half_line: Some(0.0512),
        interpolated_bound: Some(0.0005),
        damping: Some(0.00200003),
        damping_std: Some(1e-6),
        lambda: Some(14.8681),
        recording: Some((*file).to_owned()),
        ..first.clone()
    };
    document.modes = Some(files.iter().enumerate().map(mode).collect());
    document
}

#[test]
fn regress_recordings_stay_apart_in_a_crowded_table_of_modes() {
    let cases = [
        ["first.wav", "moved.wav", "low.wav"],
        ["beam-visit-1.wav", "beam-visit-2.wav", "beam-visit-12.wav"],
        [
            "2026_first_visit_north_end.wav",
            "2026_first_visit_south_end.wav",
            "2026_late.wav",
        ],
        [
            "before_lunch_at_the_wall.wav",
            "after.wav",
            "before_the_rain.wav",
        ],
    ];
    for files in cases {
        let text = render_text(&crowded(files), Screen::default());
        let mut parts = text.split("\n\n");
        let table =
            parts.find(|part| part.starts_with("Modes\n") || part.starts_with("Resonances\n"));
        let table = table.unwrap();
        assert!(
            table.lines().all(|line| line.chars().count() <= 80),
            "{table}"
        );
        let rows = table.lines().filter(|line| line.contains("1457.4131"));
        let mut shown: Vec<&str> = rows.filter_map(|row| row.rsplit("  ").next()).collect();
        assert_eq!(shown.len(), files.len(), "{table}");
        for (cell, file) in shown.iter().zip(files) {
            // What stands there are pieces of the name in their order.
            let left = cell
                .split('…')
                .try_fold(file, |rest, part| Some(rest.split_once(part)?.1));
            assert!(left.is_some(), "{cell} for {file}:\n{table}");
        }
        shown.sort_unstable();
        shown.dedup();
        assert_eq!(shown.len(), files.len(), "two names look alike:\n{table}");
    }
}

#[test]
fn regress_modes_show_no_absurd_digits() {
    let mut document = fixture::document();
    let modes = document.modes.iter_mut().flatten();
    for mode in modes.filter(|mode| mode.mode == Some(1)) {
        mode.frequency = 7.4867451;
        mode.interpolated_bound = Some(3.6e-6);
        mode.lambda = Some(1.630_513_58);
        mode.damping = Some(0.005_080_82);
        mode.damping_std = Some(2.3e-7);
    }
    for (place, text) in [
        ("terminal", render_text(&document, Screen::default())),
        ("page", page(&document)),
    ] {
        for wanted in ["7.4867 ± 0.0001", "1.63051", "0.5081 ± 0.0001"] {
            assert!(text.contains(wanted), "the {place} lacks {wanted}");
        }
        assert!(!text.contains("7.48674"), "the {place} has more digits");
    }
    let json = render_json(&document).expect("the document is written");
    assert!(json.contains("7.4867451"), "JSON keeps every digit");
}

#[test]
fn val_summary_sentences_are_grammatical() {
    let first = |accepted: &[bool]| {
        let mut document = bare();
        for recording in document.recordings.iter_mut().flatten() {
            let tap = |accepted: &bool| TapSection {
                accepted: *accepted,
                ..TapSection::default()
            };
            recording.taps = accepted.iter().map(tap).collect();
        }
        summary::sentences(&document).remove(0)
    };
    let cases: [(&[bool], &str); 6] = [
        (&[], "No taps found in 1 recording."),
        (&[true], "1 of 1 tap used, in 1 recording."),
        (&[false], "0 of 1 tap used, in 1 recording."),
        (&[true; 3], "3 of 3 taps used, in 1 recording."),
        (&[false; 3], "0 of 3 taps used, in 1 recording."),
        (&[true, false], "1 of 2 taps used, in 1 recording."),
    ];
    for (taps, wanted) in cases {
        assert_eq!(first(taps), wanted, "{taps:?}");
    }
}

#[test]
fn regress_pages_leave_out_what_was_not_asked_for() {
    let html = text_of(&rendered(&bare(), &[]), "report.html");
    // What a description would add is told, and nothing else of it.
    let html = html.replace("the joint&#39;s stiffness and the diagnosis", "");
    for unwanted in ["id=\"joint\"", "id=\"uncertainty\"", "stiffness", "λ"] {
        assert!(
            !html.contains(unwanted),
            "a bare recording's page has {unwanted}"
        );
    }
    assert!(html.contains("WAV, 24-bit integer"), "what the file says");
    let measured = Document {
        recordings: None,
        ..fixture::document()
    };
    let html = text_of(&rendered(&measured, &[]), "report.html");
    for unwanted in ["id=\"recordings\"", "<strong>Taps.", "No recordings"] {
        assert!(
            !html.contains(unwanted),
            "a page without recordings has {unwanted}"
        );
    }
}
