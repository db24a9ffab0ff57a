//! Reports on several tests: the spectra of two tests over each other, and the files.

use super::{fixture, names, spectra_of, text_of, words_of};
use tapjoint::compare::{
    self, ChangeVerdict, Comparison, LeftOutMode, ModeChange, RepeatabilityOrigin,
    RepeatabilityResult, VerdictKind,
};
use tapjoint::pipeline::RecordingResult;
use tapjoint::report::charts::comparison_spectra::overlay;
use tapjoint::report::document::{
    ComparisonSection, Document, PairFiles, SeriesSection, VERSION, WarningSection,
};
use tapjoint::report::picture::{Block, Chart, Color, Mark, Panel, Series};
use tapjoint::report::{ComparedRecordings, MOST_LINES, Screen, render_answer, render_compared};

/// Changes of the five modes (%).
const CHANGES: [f64; 5] = [-0.9, -0.4, -0.2, -0.1, 0.05];

/// A comparison of one pair of tests.
fn document() -> Document {
    let modes = CHANGES.iter().enumerate().map(|(index, change)| {
        let before = fixture::FREQUENCIES[index];
        ModeChange {
            pair: 0,
            mode: index + 1,
            before,
            after: before * (1.0 + 0.01 * change),
            change_percent: *change,
            level_percent: 0.0,
            described_percent: if index == 1 { -0.3 } else { 0.0 },
            std_percent: 0.05,
            z: change / 0.05,
        }
    });
    let files = |name: &str| vec![format!("{name}.toml")];
    Document {
        version: VERSION,
        compare: Some(ComparisonSection {
            tests: vec![PairFiles {
                before: files("monday"),
                after: files("friday"),
            }],
            found: Comparison {
                modes: modes.collect(),
                matched: Vec::new(),
                joint: None,
                verdict: ChangeVerdict {
                    kind: VerdictKind::Unknown,
                    effects: Vec::new(),
                    items: Vec::new(),
                    probability: 0.97,
                },
                hypotheses: Vec::new(),
                damping: None,
                level: None,
                repeatability: RepeatabilityResult {
                    percent: 0.05,
                    origin: RepeatabilityOrigin::Stated,
                },
                no_change_goodness: 1e-9,
            },
        }),
        ..Document::default()
    }
}

/// The recordings of both tests.
fn recordings() -> ComparedRecordings {
    let mut after = fixture::recordings();
    for recording in &mut after {
        for reading in &mut spectra_of(recording).readings {
            let mode = fixture::FREQUENCIES
                .iter()
                .position(|one| *one == reading.frequency);
            if let Some(mode) = mode {
                reading.frequency *= 1.0 + 0.01 * CHANGES[mode];
            }
        }
    }
    ComparedRecordings {
        before: fixture::recordings(),
        after,
    }
}

fn chart(recordings: &ComparedRecordings) -> Chart {
    overlay(&document(), recordings).expect("both tests have spectra of the same sensors")
}

/// The block of close-ups, which is the last of the picture.
fn close_ups(chart: &Chart) -> &Block {
    let last = chart.blocks.last().expect("there are close-ups");
    assert_eq!(last.name, "Close-ups");
    last
}

/// Places of the frequencies as read, before and after.
fn marks(panel: &Panel) -> [f64; 2] {
    [Color::Blue, Color::Vermilion].map(|color| {
        let is_mark = |one: &&Series| one.color == color && matches!(one.mark, Mark::Dashed(_));
        panel.series.iter().find(is_mark).expect("a mark").at(0)
    })
}

/// The curve of one test.
fn curve<'a>(panel: &'a Panel, name: &str) -> &'a Series {
    let mut series = panel.series.iter();
    series.find(|one| one.name == name).expect("a curve")
}

#[test]
fn prop_a_close_up_holds_both_peaks_of_its_mode() {
    let chart = chart(&recordings());
    let panels = &close_ups(&chart).panels;
    assert_eq!(panels.len(), CHANGES.len());
    for (index, panel) in panels.iter().enumerate() {
        let before = fixture::FREQUENCIES[index];
        let after = before * (1.0 + 0.01 * CHANGES[index]);
        assert_eq!(marks(panel), [before, after], "{}", panel.title);
        for name in ["before", "after"] {
            let places = curve(panel, name).pairs().map(|(at, _)| at);
            let places: Vec<f64> = places.collect();
            let (first, last) = (places[0], places[places.len() - 1]);
            assert!(
                first < before.min(after) && last > before.max(after),
                "{}",
                panel.title
            );
            assert!(
                panel.x.holds(first) && panel.x.holds(last),
                "{}",
                panel.title
            );
        }
    }
}

#[test]
fn regress_titles_of_close_ups_have_the_change_and_where_it_was_read_best() {
    let chart = chart(&recordings());
    let titles: Vec<&str> = close_ups(&chart)
        .panels
        .iter()
        .map(|panel| panel.title.as_str())
        .collect();
    // The lines of low.wav are ten times as close.
    let expected = [
        "mode 1: \u{2212}0.90 %, low.wav",
        "mode 2: \u{2212}0.40 % (described: \u{2212}0.30 %), low.wav",
        "mode 3: \u{2212}0.20 %, full.wav",
        "mode 4: \u{2212}0.10 %, full.wav",
        "mode 5: +0.050 %, full.wav",
    ];
    assert_eq!(titles.len(), expected.len(), "{titles:?}");
    for (title, expected) in titles.iter().zip(expected) {
        assert!(title.starts_with(expected), "{titles:?}");
    }
    let bands: Vec<&str> = chart.blocks.iter().map(|one| one.name.as_str()).collect();
    assert!(
        bands[0].starts_with("Whole band, low.wav") && bands[1].starts_with("Whole band, full.wav"),
        "{bands:?}"
    );
}

#[test]
fn prop_the_shaded_places_are_those_of_the_described_change_with_the_scatter() {
    let chart = chart(&recordings());
    let panel = &close_ups(&chart).panels[1];
    let band = curve(panel, "after, if nothing changed (95 %)");
    let expected = [-0.3 - 1.96 * 0.05, -0.3 + 1.96 * 0.05];
    for (index, percent) in expected.into_iter().enumerate() {
        let place = fixture::FREQUENCIES[1] * (1.0 + 0.01 * percent);
        assert!(
            (band.at(index) - place).abs() < 1e-4,
            "{} {place}",
            band.at(index)
        );
    }
}

#[test]
fn regress_changes_of_means_have_no_shaded_places_of_single_tests() {
    let mut document = document();
    let tests = &mut document.compare.as_mut().expect("a comparison").tests;
    tests[0].after.push("saturday.toml".to_owned());
    let chart = overlay(&document, &recordings()).expect("the tests have spectra");
    assert!(
        chart.caption.contains("the first after"),
        "{}",
        chart.caption
    );
    for panel in &close_ups(&chart).panels {
        assert!(panel.title.contains(" in the mean"), "{}", panel.title);
        assert!(panel.series.iter().all(|one| one.mark != Mark::Band));
    }
    let tests = &mut document.compare.as_mut().expect("a comparison").tests;
    tests[0].after.pop();
    tests.push(tests[0].clone());
    let chart = overlay(&document, &recordings()).expect("the tests have spectra");
    assert!(
        chart
            .caption
            .ends_with("The first of several pairs is shown.")
    );
    let files = render_compared(&document, &recordings()).expect("it is rendered");
    let words = words_of(&text_of(&files, "report.html"));
    assert!(words.contains("<dt>Pairs</dt><dd>2</dd>"));
    assert!(words.contains("<td>monday.toml</td><td>friday.toml</td>"));
}

#[test]
fn prop_the_page_opens_with_the_close_ups() {
    let chart = chart(&recordings());
    let page = chart.page().expect("there are curves");
    let names: Vec<&str> = page.blocks.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names[0], "Close-ups", "{names:?}");
    assert_eq!(names.len(), chart.blocks.len());
}

#[test]
fn prop_recordings_of_other_names_match_by_their_place() {
    let mut renamed = recordings();
    for (recording, name) in renamed.after.iter_mut().zip(["a.wav", "b.wav"]) {
        recording.file = name.to_owned();
    }
    let chart = chart(&renamed);
    assert!(
        close_ups(&chart).panels[0]
            .title
            .contains("low.wav and a.wav")
    );
    // Of equal names in two folders the place decides.
    let mut alike = recordings();
    for all in [&mut alike.before, &mut alike.after] {
        for (recording, name) in all.iter_mut().zip(["x/t.wav", "y/t.wav"]) {
            recording.file = name.to_owned();
        }
    }
    let chart = overlay(&document(), &alike).expect("the places match");
    assert_eq!(close_ups(&chart).panels.len(), CHANGES.len());
    // A name decides before the place does.
    let mut swapped = recordings();
    swapped.after.reverse();
    let chart = overlay(&document(), &swapped).expect("the names match");
    assert!(close_ups(&chart).panels[0].title.contains(", low.wav"));
    assert_eq!(close_ups(&chart).panels.len(), CHANGES.len());
}

#[test]
fn prop_without_a_force_each_test_is_shown_over_its_own_peaks() {
    let with_force = chart(&recordings());
    assert_eq!(with_force.blocks[0].panels[0].y.unit, "(m/s\u{b2})/N");
    let mut bare = recordings();
    for recording in &mut bare.after {
        recording.has_hammer = false;
        // Another gain of the sensor.
        for values in &mut spectra_of(recording).averages.responses {
            values.iter_mut().for_each(|value| *value *= 40.0);
        }
    }
    let chart = chart(&bare);
    assert_eq!(
        chart.blocks[0].panels[0].y.label,
        "magnitude, strongest mode = 1"
    );
    for panel in &close_ups(&chart).panels {
        for name in ["before", "after"] {
            let highest = curve(panel, name)
                .y
                .iter()
                .copied()
                .fold(f64::MIN, f64::max);
            assert_eq!(highest, 0.0, "{}, {name}", panel.title);
        }
    }
}

#[test]
fn limit_without_common_spectra_there_is_no_overlay() {
    let changed = |change: &dyn Fn(&mut RecordingResult)| {
        let mut all = recordings();
        all.after.iter_mut().for_each(change);
        overlay(&document(), &all)
    };
    assert!(changed(&|_| {}).is_some());
    let without_spectra = changed(&|one| one.measurement.spectra = None);
    let other_sensors = changed(&|one| {
        for response in &mut one.responses {
            response.name.push('2');
        }
    });
    let other_peaks = changed(&|one| {
        for reading in &mut spectra_of(one).readings {
            reading.frequency *= 1.1;
        }
    });
    let of_readings = overlay(&document(), &ComparedRecordings::default());
    let of_one = overlay(&Document::default(), &recordings());
    for (case, found) in [
        ("without spectra", without_spectra),
        ("other sensors", other_sensors),
        ("other peaks", other_peaks),
        ("measured frequencies", of_readings),
        ("no comparison", of_one),
    ] {
        assert_eq!(found, None, "{case}");
    }
}

#[test]
fn prop_a_report_on_a_comparison_has_its_files_alone() {
    let mut document = document();
    // Five doubts of one kind: the page lists four.
    for number in 0..5 {
        document.warnings.push(WarningSection {
            code: "single-tap".to_owned(),
            text: format!("test {number}: one tap"),
            beside: false,
        });
    }
    let files = render_compared(&document, &recordings()).expect("it is rendered");
    let expected = [
        "compare.png",
        "compare.svg",
        "compare-spectra.png",
        "compare-spectra.svg",
        "report.html",
        "report.json",
        "changes.csv",
    ];
    assert_eq!(names(&files), expected);
    let words = words_of(&text_of(&files, "report.html"));
    for wanted in [
        "monday.toml",
        "friday.toml",
        "Something changed that no cause here explains.",
        "5 doubts",
        "1 more of the same kinds: report.json has all.",
    ] {
        assert!(words.contains(wanted), "{wanted}");
    }
    assert!(!words.contains("No resonances") && !words.contains("test 4: one tap"));
    let rows = text_of(&files, "changes.csv");
    assert_eq!(rows.lines().count(), 1 + CHANGES.len());
    assert!(
        rows.contains("\n1,2,118.04,117.56784,-0.4,0,-0.3,0.05,"),
        "{rows}"
    );
}

#[test]
fn limit_an_answer_with_many_findings_keeps_to_its_lines() {
    let tests: Vec<String> = (1..=40).map(|test| format!("week{test}.toml")).collect();
    let left_out = (1..=39).map(|test| LeftOutMode { mode: 3, test });
    let series = compare::Series {
        charts: Vec::new(),
        first: None,
        is_stated: true,
        matched: Vec::new(),
        left_out: left_out.collect(),
    };
    let document = Document {
        series: Some(SeriesSection { tests, series }),
        ..Document::default()
    };
    let answer = |most: usize| render_answer(&document, None, most, Screen::default());
    let (short, full) = (answer(MOST_LINES), answer(usize::MAX));
    assert!(short.lines().count() <= MOST_LINES, "{short}");
    assert!(short.contains("more (--full)"), "{short}");
    assert!(
        !full.contains("more (--full)") && full.contains("week40.toml"),
        "{full}"
    );
}
