//! Tests of the report: what is drawn, what is written, and that nothing missing breaks it.

mod compared;
mod fixture;
mod gap_pictures;
mod gap_story;
mod numbers;
mod pictures;
mod vector_files;
mod words;

use tapjoint::pipeline::{MeasuredSpectra, RecordingResult};
use tapjoint::report::document::Document;
use tapjoint::report::{ReportFile, Screen, render_run};

/// Renders a whole report; a report that cannot be rendered fails the test with its error.
fn rendered(document: &Document, recordings: &[RecordingResult]) -> Vec<ReportFile> {
    match render_run(document, recordings) {
        Ok(files) => files,
        Err(error) => panic!("the report was not rendered: {error}"),
    }
}

/// Text of one file.
fn text_of(files: &[ReportFile], name: &str) -> String {
    let file = files.iter().find(|file| file.name == name);
    let bytes = file.map(|file| file.bytes.clone()).unwrap_or_default();
    assert!(!bytes.is_empty(), "{name} is missing or empty");
    String::from_utf8(bytes).expect("the file is UTF-8")
}

/// A page without its scripts and their data.
fn words_of(html: &str) -> String {
    let mut pieces = html.split("<script");
    let first = pieces.next().unwrap_or_default().to_owned();
    let rest = pieces.filter_map(|piece| piece.split_once("</script>"));
    first + &rest.map(|(_, words)| words).collect::<String>()
}

/// Names of the files.
fn names(files: &[ReportFile]) -> Vec<&str> {
    files.iter().map(|file| file.name.as_str()).collect()
}

/// Spectra of a recording of the fixture.
fn spectra_of(recording: &mut RecordingResult) -> &mut MeasuredSpectra {
    let spectra = recording.measurement.spectra.as_mut();
    spectra.expect("the fixture has spectra")
}

/// Documents and recordings with parts missing, each with a name.
fn incomplete() -> Vec<(&'static str, Document, Vec<RecordingResult>)> {
    let whole = fixture::document;
    let recordings = fixture::recordings;
    let mut without_hammer = recordings();
    for recording in &mut without_hammer {
        recording.has_hammer = false;
        spectra_of(recording).averages.force = None;
    }
    let mut without_taps = recordings();
    for recording in &mut without_taps {
        recording.measurement.spectra = None;
        recording.measurement.taps.taps.clear();
    }
    let measured_only = Document {
        recordings: None,
        ..whole()
    };
    let no_modes = Document {
        modes: Some(Vec::new()),
        estimate: Some(None),
        estimate_reason: Some("3 modes are needed, 0 were found".into()),
        prediction: None,
        perturbation: None,
        resolution_span: None,
        ..whole()
    };
    vec![
        ("empty", Document::default(), Vec::new()),
        ("without hammer", whole(), without_hammer),
        ("without taps", no_modes.clone(), without_taps),
        ("without modes", no_modes, recordings()),
        ("measured frequencies only", measured_only, Vec::new()),
        ("not finite", broken(), broken_recordings()),
        ("no samples", whole(), empty_recordings()),
    ]
}

/// A document in which what can be infinite or undefined is.
fn broken() -> Document {
    let mut document = fixture::document();
    if let Some(Some(estimate)) = &mut document.estimate {
        if let Some(kx) = &mut estimate.kx {
            kx.uncertain.value = f64::INFINITY;
            kx.uncertain.std = Some(f64::NAN);
            kx.uncertain.low = None;
            kx.uncertain.high = None;
        }
        if let Some(kt) = &mut estimate.kt {
            kt.uncertain.value = f64::NAN;
        }
    }
    for row in document.prediction.iter_mut().flatten() {
        row.predicted = Some(f64::NAN);
        row.error_percent = Some(f64::NAN);
    }
    for mode in document.modes.iter_mut().flatten() {
        mode.half_line = Some(f64::NAN);
        mode.interpolated_bound = Some(0.0);
        mode.std = None;
    }
    for span in document.resolution_span.iter_mut().flatten() {
        span.kx = Some([0.0, f64::INFINITY]);
        span.cloud = vec![[f64::NAN, 1.0], [f64::INFINITY, 2.0]];
    }
    document
}

fn broken_recordings() -> Vec<RecordingResult> {
    let mut recordings = fixture::recordings();
    for recording in &mut recordings {
        recording.overview.as_mut().unwrap().high[7] = f64::NAN;
        recording.measurement.taps.taps[0].peak = f64::INFINITY;
        let spectra = spectra_of(recording);
        spectra.averages.responses[0].fill(0.0);
        spectra.averages.responses[1][3] = f64::NAN;
        let cross = spectra.averages.cross.as_mut().unwrap();
        cross[0].fill(num_complex::Complex64::new(f64::NAN, 0.0));
        spectra.averages.force = Some(vec![0.0; spectra.averages.lines.points()]);
        spectra.readings[0].half_line = f64::NAN;
        spectra.readings[1].frequency = f64::NAN;
    }
    recordings
}

fn empty_recordings() -> Vec<RecordingResult> {
    let mut recordings = fixture::recordings();
    for recording in &mut recordings {
        recording.overview.as_mut().unwrap().low.clear();
        recording.overview.as_mut().unwrap().high.clear();
        recording.responses.clear();
        let averages = &mut spectra_of(recording).averages;
        averages.responses.clear();
        averages.force = Some(Vec::new());
    }
    recordings
}

#[test]
fn limit_incomplete_analyses_are_reported() {
    for (case, document, recordings) in incomplete() {
        let files = rendered(&document, &recordings);
        let names = names(&files);
        for name in ["report.html", "report.json", "parameters.csv", "modes.csv"] {
            assert!(names.contains(&name), "{case}: {name} is missing");
        }
        let html = words_of(&text_of(&files, "report.html"));
        for word in ["NaN", ">inf<", "Infinity", "null"] {
            assert!(!html.contains(word), "{case}: the page says {word}");
        }
        let text = tapjoint::report::render_text(&document, Screen::default());
        assert!(!text.contains("NaN"), "{case}: the terminal says NaN");
    }
}

#[test]
fn limit_pictures_apply_only_where_there_are_data() {
    let cases = incomplete();
    let of = |wanted: &str| {
        let (_, document, recordings) = cases
            .iter()
            .find(|(case, _, _)| *case == wanted)
            .expect("the case exists");
        let files = rendered(document, recordings);
        files
            .into_iter()
            .map(|file| file.name)
            .filter(|name| name.ends_with(".png"))
            .collect::<Vec<_>>()
    };
    let none: Vec<String> = Vec::new();
    assert_eq!(of("empty"), none);
    assert_eq!(of("without taps"), ["taps-low.png", "taps-full.png"]);
    assert_eq!(
        of("without hammer"),
        [
            "spectrum-low.png",
            "stabilisation-low.png",
            "taps-low.png",
            "spectrum-full.png",
            "stabilisation-full.png",
            "taps-full.png",
            "frequencies.png",
            "cloud.png"
        ]
    );
    assert_eq!(
        of("measured frequencies only"),
        ["frequencies.png", "cloud.png"]
    );
}

#[test]
fn prop_files_of_equal_names_stay_apart() {
    let mut recordings = fixture::recordings();
    recordings[0].file = "a/tap one.wav".into();
    recordings[1].file = "b/tap one.csv".into();
    let files = rendered(&fixture::document(), &recordings);
    let names = names(&files);
    for name in ["spectrum-tap-one.png", "spectrum-tap-one-2.png"] {
        assert!(names.contains(&name), "{name} is missing among {names:?}");
    }
}
