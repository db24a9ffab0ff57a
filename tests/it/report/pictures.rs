//! Pictures: that they are pictures, and that the data drawn are the data.

use std::collections::HashMap;

use proptest::prelude::*;
use tapjoint::pipeline::{FrfSettings, RecordingResult, frfs_of};
use tapjoint::report::charts::joint::{cloud, frequencies};
use tapjoint::report::charts::modes::stabilisation;
use tapjoint::report::charts::spectra::taps;
use tapjoint::report::charts::spectra::{frf, spectrum};
use tapjoint::report::picture::decimate;
use tapjoint::report::picture::drawing::{Point, Rgb, Shape};
use tapjoint::report::picture::labels::spread;
use tapjoint::report::picture::{Axis, Tick, nice_step};
use tapjoint::report::picture::{Chart, Color, Drawing, render_png, render_svg};

use super::{fixture, spectra_of};

/// All pictures of the fixture.
pub(super) fn drawings() -> Vec<Drawing> {
    let document = fixture::document();
    let mut drawings: Vec<Drawing> = fixture::recordings()
        .iter()
        .flat_map(|recording| {
            let frfs = frfs_of(recording, &FrfSettings::default()).expect("there is a hammer");
            [
                spectrum(recording, &recording.file),
                frf_of(recording),
                stabilisation(recording, &recording.file, &frfs),
                taps(recording, &recording.file),
            ]
        })
        .flatten()
        .map(|chart| chart.draw())
        .collect();
    drawings.extend(frequencies(&document).map(|chart| chart.draw()));
    drawings.extend(cloud(&document).map(|chart| chart.draw()));
    assert_eq!(drawings.len(), 10, "two recordings have four pictures each");
    drawings
}

/// The frequency response functions of a recording.
fn frf_of(recording: &RecordingResult) -> Option<Chart> {
    let frfs = frfs_of(recording, &FrfSettings::default()).expect("there is a hammer");
    frf(recording, &recording.file, &frfs, &[])
}

/// The spectra of a recording of the fixture.
fn spectrum_of(recording: &RecordingResult) -> Chart {
    spectrum(recording, &recording.file).expect("there are spectra")
}

/// Width, height, and how often each colour occurs.
fn decoded(png: &[u8]) -> (u32, u32, HashMap<[u8; 3], usize>) {
    let mut reader = png::Decoder::new(png).read_info().expect("it is a PNG");
    let mut pixels = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut pixels).expect("it has a picture");
    let mut colors = HashMap::new();
    for pixel in pixels.chunks_exact(3) {
        *colors.entry([pixel[0], pixel[1], pixel[2]]).or_insert(0) += 1;
    }
    (info.width, info.height, colors)
}

fn count(colors: &HashMap<[u8; 3], usize>, color: Rgb) -> usize {
    let key = [color.0, color.1, color.2];
    colors.get(&key).copied().unwrap_or(0)
}

#[test]
fn prop_pictures_are_not_blank() {
    for drawing in drawings() {
        let name = &drawing.description;
        let png = render_png(&drawing).expect("the picture is drawn");
        let (width, height, colors) = decoded(&png);
        assert_eq!((width, height), (1200, drawing.height), "{name}");
        let white = count(&colors, Rgb(255, 255, 255));
        let total = (width * height) as usize;
        assert!(white > total / 2, "{name}: paper is white");
        // Frame, grid and words alone are more than a hundredth of a picture.
        assert!(total - white > total / 100, "{name}: almost nothing drawn");
        assert!(
            count(&colors, Color::Blue.rgb()) > 20,
            "{name}: no data in blue"
        );
    }
}

#[test]
fn prop_nothing_lies_outside_a_picture() {
    for drawing in drawings() {
        let (width, height) = (f64::from(drawing.width), f64::from(drawing.height));
        let inside =
            |point: &Point| (0.0..=width).contains(&point.0) && (0.0..=height).contains(&point.1);
        for shape in &drawing.shapes {
            let held = match shape {
                Shape::Line { points, .. } | Shape::Area { points, .. } => {
                    points.iter().all(inside)
                }
                Shape::Rectangle { from, to, .. } => inside(from) && inside(to),
                Shape::Dot { center, .. } | Shape::Ring { center, .. } => inside(center),
                Shape::Text(text) => text_inside(text, &drawing),
            };
            assert!(held, "{}: {shape:?} is cut off", drawing.description);
        }
    }
}

fn text_inside(text: &tapjoint::report::picture::drawing::Text, drawing: &Drawing) -> bool {
    use tapjoint::report::picture::drawing::{Align, Direction};
    let width = text.width();
    let (before, after) = match text.align {
        Align::Start => (0.0, width),
        Align::Middle => (width / 2.0, width / 2.0),
        Align::End => (width, 0.0),
    };
    let (along, across, length, breadth) = match text.direction {
        Direction::Across => (text.at.0, text.at.1, drawing.width, drawing.height),
        // Read upwards: the end of the words is higher up.
        Direction::Upwards => (
            f64::from(drawing.height) - text.at.1,
            text.at.0,
            drawing.height,
            drawing.width,
        ),
    };
    along - before >= 0.0
        && along + after <= f64::from(length)
        && across - text.size / 2.0 >= 0.0
        && across + text.size / 2.0 <= f64::from(breadth)
}

#[test]
fn prop_spectrum_says_what_it_shows() {
    let drawing = spectrum_of(&fixture::recordings()[0]).draw();
    let words = drawing.words().join("\n");
    for wanted in [
        "low.wav",
        "4 taps averaged",
        "block 2048 samples, 800 lines",
        "line spacing 0.25 Hz",
        "resolution 1/T = 0.3125 Hz",
        "frequency (Hz)",
        "m/s² s",
        "mode 1",
        "118.04 Hz",
        "mains 50 Hz",
        "A, acceleration",
        "B, acceleration",
    ] {
        assert!(words.contains(wanted), "the spectrum does not say {wanted}");
    }
}

#[test]
fn prop_frf_names_form_and_unit() {
    let drawing = frf_of(&fixture::recordings()[1])
        .expect("there are functions")
        .draw();
    let words = drawing.words();
    for wanted in ["accelerance ((m/s²)/N)", "phase (°)", "frequency (Hz)"] {
        assert!(words.contains(&wanted), "{wanted} is missing in {words:?}");
    }
}

#[test]
fn prop_responses_of_different_units_have_a_panel_each() {
    let mut recording = fixture::recordings().remove(0);
    recording.responses[1].unit = Some("Pa".into());
    let chart = spectrum_of(&recording);
    let units = chart.blocks[0].panels.iter().map(|panel| panel.y.title());
    let units: Vec<String> = units.collect();
    let wanted = ["magnitude, rms (m/s² s)", "magnitude, rms (Pa s)"];
    assert_eq!(units[..2], wanted, "{units:?}");
}

/// The page's curves are the picture's: same panels, same names, same values but for rounding.
#[test]
fn prop_the_page_has_the_curves_of_the_picture() {
    for recording in fixture::recordings() {
        for chart in [Some(spectrum_of(&recording)), frf_of(&recording)]
            .into_iter()
            .flatten()
        {
            let page = chart.page().expect("there are curves");
            let panels = &chart.blocks[0].panels;
            let shown = &page.blocks[0].panels;
            assert_eq!(page.blocks.len(), 1, "{}", chart.title);
            assert_eq!(shown.len(), panels.len(), "{}", chart.title);
            for (shown, panel) in shown.iter().zip(panels) {
                assert_eq!(shown.y, panel.y);
                assert_eq!(shown.series.len(), panel.series.len());
                for (curve, series) in shown.series.iter().zip(&panel.series) {
                    assert_eq!(curve.name, series.name);
                    assert_eq!(curve.color, series.color);
                    for (rounded, value) in curve.y.iter().zip(&series.y) {
                        let close = (rounded - value).abs() <= 5.1e-4 * value.abs();
                        assert!(close || value.is_nan(), "{value} became {rounded}");
                    }
                }
            }
        }
    }
}

#[test]
fn prop_rejected_taps_carry_their_reason() {
    let drawing = taps(&fixture::recordings()[0], "low.wav")
        .expect("there are samples")
        .draw();
    let words = drawing.words();
    let reason =
        "tap 2 at 3.71 s: double hit: a second excursion of 31 % after 14.0 ms (limit 10 %)";
    assert!(words.contains(&reason), "{words:?}");
    let dots = dots(&drawing, Color::Blue);
    // Four taps used and one in the legend.
    assert_eq!(dots, 5, "blue dots");
}

fn dots(drawing: &Drawing, wanted: Color) -> usize {
    let is_dot = |shape: &&Shape| match shape {
        Shape::Dot { color, .. } | Shape::Ring { color, .. } => *color == wanted.rgb(),
        _ => false,
    };
    drawing.shapes.iter().filter(is_dot).count()
}

#[test]
fn prop_used_and_unused_modes_differ() {
    let drawing = frequencies(&fixture::document())
        .expect("there is a prediction")
        .draw();
    // Four used modes and the legend; one unused mode and the legend.
    assert_eq!(dots(&drawing, Color::Blue), 5, "used modes");
    assert_eq!(dots(&drawing, Color::Vermilion), 2, "unused modes");
}

#[test]
fn prop_cloud_shows_every_pattern() {
    let document = fixture::document();
    let drawing = cloud(&document).expect("there is a cloud").draw();
    // The fixture's 16 patterns lie apart; one more in the legend.
    assert_eq!(dots(&drawing, Color::Sky), 17, "patterns");
    assert!(
        drawing.words().contains(&"−0.05 %"),
        "{:?}",
        drawing.words()
    );
}

#[test]
fn prop_many_marks_keep_their_labels_apart() {
    let mut recording = fixture::recordings().remove(1);
    recording.mode_numbers = (1..=40).map(Some).collect();
    spectra_of(&mut recording).readings = (1..=40)
        .map(|mode| {
            let prominence = 40.0 - f64::from(mode);
            fixture::mode_reading(600.0 + 2.5 * f64::from(mode), 1.25, prominence)
        })
        .collect();
    let drawing = spectrum_of(&recording).draw();
    let words = drawing.words().join("\n");
    assert!(
        words.contains("more without a label, see the table"),
        "40 labels cannot stand in one row: {words}"
    );
    assert!(words.contains("mode 1\n"), "the first modes keep theirs");
    assert!(
        words.contains("Close-ups, the first 6 of 40 modes"),
        "{words}"
    );
}

#[test]
fn prop_svg_holds_the_picture_and_escapes_names() {
    let mut recording = fixture::recordings().remove(0);
    recording.file = "<script>&\"x\".wav".into();
    let drawing = spectrum_of(&recording).draw();
    let svg = render_svg(&drawing);
    assert!(
        svg.starts_with("<svg viewBox=\"0 0 4800 "),
        "{}",
        &svg[..80]
    );
    assert!(svg.trim_end().ends_with("</svg>"), "the element is closed");
    assert!(!svg.contains("<script"), "a file name became an element");
    assert!(svg.contains("&lt;script&gt;&amp;"), "the name is not shown");
    assert!(!svg.contains("http") && !svg.contains("NaN"), "clean");
    // Two responses, the force, frames, grid, leaders, dashes.
    // Pieces of one style are one path.
    let pieces = svg.matches("<polyline").count() + svg.matches('M').count();
    assert!(pieces > 40, "curves are missing");
}

#[test]
fn val_ticks_are_one_two_five() {
    for (least, wanted) in [
        (0.3, 0.5),
        (1.0, 1.0),
        (1.1, 2.0),
        (2.3, 5.0),
        (70.0, 100.0),
    ] {
        let step = nice_step(least);
        // One part in 10^12: the step is a product of two roundings.
        assert!((step / wanted - 1.0).abs() < 1e-12, "{least}: {step}");
    }
    let labels = |low: f64, high: f64| -> Vec<String> {
        let ticks = Axis::linear(low, high).ticks(1080.0 / 110.0);
        ticks.into_iter().filter_map(|tick| tick.label).collect()
    };
    assert_eq!(labels(0.0, 200.0), ["0", "50", "100", "150", "200"]);
    assert_eq!(labels(-0.2, 0.2)[..2], ["−0.20", "−0.15"]);
    let decades = Axis::logarithmic(2e-3, 40.0).ticks(340.0 / 40.0);
    let labels: Vec<String> = decades.into_iter().filter_map(|tick| tick.label).collect();
    assert_eq!(labels, ["10⁻²", "10⁻¹", "10⁰", "10¹"]);
}

proptest! {
    #[test]
    fn prop_ticks_lie_on_the_axis_and_are_few(
        low in -1e6f64..1e6,
        exponent in -6.0f64..9.0,
    ) {
        let high = low + 10f64.powf(exponent);
        // Shorter ranges are widened on purpose.
        prop_assume!(high - low > 1e-6 * low.abs());
        let ticks = Axis::linear(low, high).ticks(10.0);
        // Steps of 1, 2, 5 are at most 2.5 times the wish: at least 10/2.5 - 1 ticks.
        prop_assert!((3..=11).contains(&ticks.len()), "{} ticks", ticks.len());
        // Ticks a billionth of a step outside count as on the end.
        let slack = 1e-8 * (high - low);
        for tick in ticks {
            let held = tick.value >= low - slack && tick.value <= high + slack;
            prop_assert!(held, "{} on {low} to {high}", tick.value);
        }
    }

    #[test]
    fn prop_decimation_keeps_extremes(
        values in prop::collection::vec(-1e3f64..1e3, 1..4000),
        width in 1.0f64..300.0,
    ) {
        let count = values.len() as f64;
        let points: Vec<Point> = values
            .iter()
            .enumerate()
            .map(|(index, value)| (index as f64 / count * width, *value))
            .collect();
        let reduced = decimate(points.iter().copied());
        prop_assert!(reduced.len() <= 4 * (0.5 * width).ceil() as usize + 2, "{}", reduced.len());
        prop_assert!(reduced.iter().all(|point| points.contains(point)), "an invented point");
        prop_assert!(reduced.is_sorted_by(|a, b| a.0 <= b.0), "out of order");
        prop_assert_eq!(columns(&points), columns(&reduced), "an extreme was lost");
        prop_assert_eq!(reduced.first(), points.first());
        prop_assert_eq!(reduced.last(), points.last());
    }

    #[test]
    fn prop_labels_never_overlap(
        mut centers in prop::collection::vec(0.0f64..1000.0, 0..15),
        widths in prop::collection::vec(10.0f64..120.0, 15),
    ) {
        centers.sort_by(f64::total_cmp);
        let widths = &widths[..centers.len()];
        let total: f64 = widths.iter().sum::<f64>() + 5.0 * widths.len().saturating_sub(1) as f64;
        let placed = spread(&centers, widths, 5.0, 0.0, 1000.0);
        prop_assert_eq!(placed.is_some(), total <= 1000.0, "fits: {}", total);
        let mut end = -5.0;
        for (center, width) in placed.unwrap_or_default().iter().zip(widths) {
            // A billionth of a pixel for rounding.
            prop_assert!(center - width / 2.0 >= end + 5.0 - 1e-9, "overlap at {center}");
            end = center + width / 2.0;
            prop_assert!(end <= 1000.0 + 1e-9, "{center} is outside");
        }
    }
}

/// Lowest and highest value in each column of two pixels.
fn columns(points: &[Point]) -> Vec<(i64, f64, f64)> {
    let mut columns: Vec<(i64, f64, f64)> = Vec::new();
    for (x, y) in points {
        let number = (0.5 * x).floor() as i64;
        match columns.last_mut().filter(|column| column.0 == number) {
            Some(column) => *column = (number, column.1.min(*y), column.2.max(*y)),
            None => columns.push((number, *y, *y)),
        }
    }
    columns
}

#[test]
fn limit_labels_with_room_stay_where_they_are() {
    let placed = spread(&[100.0, 500.0], &[50.0, 50.0], 5.0, 0.0, 1000.0);
    assert_eq!(placed, Some(vec![100.0, 500.0]));
}

#[test]
fn limit_decimation_leaves_out_what_is_not_finite() {
    let points = [
        (0.0, 1.0),
        (0.5, f64::NAN),
        (1.0, f64::INFINITY),
        (2.0, 3.0),
    ];
    assert_eq!(decimate(points), [(0.0, 1.0), (2.0, 3.0)]);
}

#[test]
fn prop_the_most_prominent_modes_keep_their_labels() {
    let mut recording = fixture::recordings().remove(1);
    recording.mode_numbers = (1..=30).map(Some).collect();
    spectra_of(&mut recording).readings = (1..=30)
        .map(|mode| {
            let prominence = if mode == 17 { 90.0 } else { 10.0 };
            fixture::mode_reading(600.0 + 2.5 * f64::from(mode), 1.25, prominence)
        })
        .collect();
    let drawing = spectrum_of(&recording).draw();
    assert!(
        drawing.words().contains(&"mode 17"),
        "{:?}",
        drawing.words()
    );
}

#[test]
fn prop_an_empty_upper_part_is_not_shown_and_said_so() {
    let mut recording = fixture::recordings().remove(1);
    let whole = spectrum_of(&recording).draw();
    assert!(
        !whole.words().join(" ").contains("shown to"),
        "modes to 994 of 2000 Hz"
    );
    let spectra = spectra_of(&mut recording);
    spectra.readings.retain(|reading| reading.frequency < 400.0);
    let drawing = spectrum_of(&recording).draw();
    let words = drawing.words().join(" ");
    assert!(words.contains("shown to 500 of 2000 Hz"), "{words}");
}

#[test]
fn prop_labels_in_the_cloud_cover_nothing() {
    let mut document = fixture::document();
    // Crosses as close as some parts in a hundred of the span; closer ones have no words.
    for row in document.perturbation.iter_mut().flatten() {
        row.kx = Some(970.5 * (1.0 + 0.1 * row.percent));
        row.ky = Some(1.251);
    }
    let drawing = cloud(&document).expect("there is a cloud").draw();
    let labels: Vec<(f64, f64, f64)> = drawing
        .shapes
        .iter()
        .filter_map(|shape| match shape {
            Shape::Text(text) if text.text.ends_with(" %") => {
                Some((text.at.0, text.at.1, text.width() / 2.0))
            }
            _ => None,
        })
        .collect();
    assert!(!labels.is_empty(), "no cross has a label");
    for (index, a) in labels.iter().enumerate() {
        for b in labels.iter().skip(index + 1) {
            let apart = (a.0 - b.0).abs() >= a.2 + b.2 || (a.1 - b.1).abs() >= 13.0;
            assert!(apart, "labels at {a:?} and {b:?} overlap");
        }
    }
}

#[test]
fn regress_ticks_of_one_axis_are_written_in_one_style() {
    let labels = |low: f64, high: f64| -> Vec<String> {
        let ticks = Axis::linear(low, high).ticks(5.0);
        let label = |tick: Tick| tick.label;
        ticks.into_iter().filter_map(label).collect()
    };
    assert_eq!(
        labels(-2e-5, 2e-5),
        [
            "\u{2212}2\u{b7}10\u{207b}\u{2075}",
            "\u{2212}1\u{b7}10\u{207b}\u{2075}",
            "0",
            "1\u{b7}10\u{207b}\u{2075}",
            "2\u{b7}10\u{207b}\u{2075}"
        ]
    );
    assert_eq!(
        labels(0.0, 0.002),
        ["0.0000", "0.0005", "0.0010", "0.0015", "0.0020"]
    );
}
