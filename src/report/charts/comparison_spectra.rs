//! Spectra of two tests over each other: the whole band, and a close-up of every mode whose shift is too small to be seen there.

use std::path::Path;

use super::spectra::{HIGH, decibels, frequency_axis, magnitude_axis, magnitudes, over_lines};
use crate::document::Document;
use crate::format::{signed_percent, unit_words};
use crate::picture::{
    Axis, Block, Chart, Color, InPage, Mark, Panel, Places, Rule, Series, extent,
};
use crate::short_names::ends_of_paths;
use tapjoint_analysis::{Frf, FrfSettings, RecordingResult, frfs_of};
use tapjoint_compare::ModeChange;
use tapjoint_numerics::stats::NORMAL_95;
use tapjoint_signal::modal::ModeReading;
use tapjoint_signal::spectral::Lines;

/// Colours of the tests before and after.
const COLORS: [Color; 2] = [Color::Blue, Color::Vermilion];
/// Names of the tests.
const NAMES: [&str; 2] = ["before", "after"];
/// Widths (pixels) in the whole band: the curve after is a thin one over a thick one, so that both are seen where they agree.
const WIDTHS: [f64; 2] = [3.0, 1.2];
/// Height of a whole band where there are several (pixels).
const LOW: f64 = 240.0;
/// Most recordings of which the whole band is shown.
const MOST_BANDS: usize = 3;
/// Most close-ups; higher modes are left to the table.
const MOST_CLOSE_UPS: usize = 12;
/// Height of a close-up (pixels).
const CLOSE_UP: f64 = 190.0;
/// Half-power widths shown on either side of the two peaks.
const SIDE: f64 = 3.0;
/// Lines shown at least on either side of the two peaks.
const LEAST_LINES: f64 = 3.0;
/// Up to so many lines in a close-up each is drawn as a dot.
const MOST_DOTS: usize = 60;
/// Depth shown below a peak (dB), at least and at most.
const DEPTH: [f64; 2] = [12.0, 40.0];
/// A reading in a recording belongs to a compared frequency within this share of it (1). Recordings of one test scatter less.
const SAME_PEAK: f64 = 0.01;
/// Changes that the descriptions explain are written from here on (%): less is written as zero.
const LEAST_EXPLAINED: f64 = 5e-4;

/// One sensor in recordings of both tests that match.
struct Overlay<'a> {
    recordings: [&'a RecordingResult; 2],
    /// Their files, shortened as far as names stay apart.
    file: String,
    sensor: &'a str,
    /// Magnitudes on each line, both in one unit.
    curves: [Curve; 2],
    /// Quantity and unit of the magnitudes.
    axis: Axis,
    /// True where both peaks have a common scale. Without a force each test has its own.
    has_force: bool,
}

/// Magnitudes over spectral lines.
struct Curve {
    lines: Lines,
    values: Vec<f64>,
}

/// A mode on an overlay.
struct CloseUp<'a> {
    change: &'a ModeChange,
    overlay: &'a Overlay<'a>,
    readings: [&'a ModeReading; 2],
}

/// Recordings of the two tests whose spectra are shown over each other; empty where tests have none.
#[derive(Debug, Clone, Default)]
pub struct ComparedRecordings {
    /// Those of the first test before.
    pub before: Vec<RecordingResult>,
    /// Those of the first test after.
    pub after: Vec<RecordingResult>,
}

/// The spectra of the first tests before and after over each other; `None` where they have no spectra of the same sensor, or
/// none of them shows a compared mode.
pub fn overlay(document: &Document, recordings: &ComparedRecordings) -> Option<Chart> {
    let section = document.compare.as_ref()?;
    let modes = section.found.modes.iter().filter(|one| one.pair == 0);
    let modes: Vec<&ModeChange> = modes.collect();
    let overlays = overlays(recordings, &modes);
    let mut close_ups = read_best(&modes, &overlays);
    let bands = bands(&overlays, &close_ups);
    let first = bands.first()?;
    let (mut title, mut shown) = ("Spectra before and after".to_owned(), String::new());
    if bands.len() == 1 {
        title.push_str(&format!(", {}, {}", first.sensor, first.file));
        shown.push_str(&format!(", {} in {}", first.sensor, first.file));
    }
    let mut blocks = Vec::new();
    for band in &bands {
        let (name, height) = match bands.len() {
            1 => ("Whole band".to_owned(), HIGH),
            _ => (format!("Whole band, {}, {}", band.file, band.sensor), LOW),
        };
        blocks.push(Block {
            name,
            ..Block::new(1, vec![whole_band(band, &modes, height)])
        });
    }
    let mut caption = format!(
        "Spectra before and after{shown}, and a close-up of every compared mode. Vertical lines: the frequency as read."
    );
    let pair = section.tests.first();
    let is_mean = pair.is_some_and(|pair| pair.before.len() > 1 || pair.after.len() > 1);
    caption.push_str(match is_mean {
        true => {
            " Shown are the first test before and the first after; the changes are those of the means of all tests."
        }
        false => {
            " Shaded: where the peak after is in 95 of 100 tests if nothing changed but what is described."
        }
    });
    if section.tests.len() > 1 {
        caption.push_str(" The first of several pairs is shown.");
    }
    let level = match close_ups.iter().all(|one| one.overlay.has_force) {
        true => "below the highest shown",
        false => "below the highest of each test",
    };
    let all = close_ups.len();
    close_ups.truncate(MOST_CLOSE_UPS);
    // Four fill two rows of two.
    let columns = match close_ups.len() {
        1 | 2 | 4 => 2,
        _ => 3,
    };
    blocks.push(Block {
        name: match all > close_ups.len() {
            true => format!("Close-ups, the first {MOST_CLOSE_UPS} of {all} modes"),
            false => "Close-ups".to_owned(),
        },
        in_page: InPage::First,
        ..Block::new(columns, panels(&close_ups, is_mean))
    });
    Some(Chart {
        kind: "compare-spectra",
        title,
        subtitle: format!(
            "close-ups: level {level}, dots are spectral lines; dashed: the frequency as read"
        ),
        caption,
        blocks,
        ..Chart::default()
    })
}

/// Returns each mode where it was read best, on the sensor that shows it most clearly.
fn read_best<'a>(modes: &[&'a ModeChange], overlays: &'a [Overlay<'a>]) -> Vec<CloseUp<'a>> {
    let mut close_ups = Vec::new();
    for change in modes {
        let seen = overlays.iter().filter_map(|one| CloseUp::of(change, one));
        close_ups.extend(seen.min_by(|a, b| {
            let by_reading = a.uncertainty().total_cmp(&b.uncertainty());
            by_reading.then(b.prominence().total_cmp(&a.prominence()))
        }));
    }
    close_ups
}

/// Returns one sensor for each recording in which modes were read best: the one that shows most of them.
fn bands<'a>(overlays: &'a [Overlay<'a>], close_ups: &[CloseUp]) -> Vec<&'a Overlay<'a>> {
    let mut bands: Vec<(usize, &Overlay)> = Vec::new();
    for overlay in overlays {
        let own = close_ups.iter();
        let own = own.filter(|one| std::ptr::eq(one.overlay, overlay)).count();
        let same = |known: &Overlay| std::ptr::eq(known.recordings[0], overlay.recordings[0]);
        match bands.iter_mut().find(|(_, known)| same(known)) {
            Some(known) if own > known.0 => *known = (own, overlay),
            Some(_) => {}
            None => bands.push((own, overlay)),
        }
    }
    bands.retain(|(own, _)| *own > 0);
    bands.truncate(MOST_BANDS);
    bands.into_iter().map(|(_, overlay)| overlay).collect()
}

/// Returns the recordings of both tests that match: those with the same file stem, else those at the same place in the descriptions.
fn matching(recordings: &ComparedRecordings) -> Vec<[&RecordingResult; 2]> {
    let (before, after) = (&recordings.before, &recordings.after);
    let stem = |one: &RecordingResult| Path::new(&one.file).file_stem().map(ToOwned::to_owned);
    let mut pairs = Vec::new();
    for (index, one) in before.iter().enumerate() {
        // Of several with this name, the one at the same place.
        let at_place = after.get(index).into_iter();
        let named = at_place.chain(after).find(|other| stem(other) == stem(one));
        let placed = after.get(index).filter(|other| {
            let mut own = before.iter();
            own.all(|one| stem(one) != stem(other))
        });
        pairs.extend(named.or(placed).map(|other| [one, other]));
    }
    pairs
}

/// Returns the sensors that both tests have, in all recordings that match.
fn overlays<'a>(recordings: &'a ComparedRecordings, modes: &[&ModeChange]) -> Vec<Overlay<'a>> {
    let mut overlays = Vec::new();
    let pairs = matching(recordings);
    let names = [0, 1].map(|side| {
        let files: Vec<&str> = pairs.iter().map(|pair| pair[side].file.as_str()).collect();
        ends_of_paths(&files)
    });
    let [before, after] = &names;
    for (pair, names) in pairs.into_iter().zip(before.iter().zip(after)) {
        let file = match names {
            (before, after) if before == after => before.clone(),
            (before, after) => format!("{before} and {after}"),
        };
        let frfs = pair.map(|one| frfs_of(one, &FrfSettings::default()).unwrap_or_default());
        for response in &pair[0].responses {
            let sensor = response.name.as_str();
            let functions = functions(&frfs, sensor);
            let has_force = functions.is_some();
            let found = functions.or_else(|| spectra(pair, sensor, modes));
            overlays.extend(found.map(|(curves, axis)| Overlay {
                recordings: pair,
                file: file.clone(),
                sensor,
                curves,
                axis,
                has_force,
            }));
        }
    }
    overlays
}

/// Returns the frequency response functions of a sensor with their axis; `None` unless both tests have them in one unit.
fn functions(frfs: &[Vec<Frf>; 2], sensor: &str) -> Option<([Curve; 2], Axis)> {
    let [before, after] = frfs;
    let before = before.iter().find(|one| one.response == sensor)?;
    let after = after.iter().find(|one| one.response == sensor)?;
    if before.unit != after.unit {
        return None;
    }
    let curves = [before, after].map(|frf| Curve {
        lines: frf.lines,
        values: magnitudes(frf.values()),
    });
    let axis = Axis::linear(0.0, 1.0).of(before.form_words, unit_words(&before.unit));
    Some((curves, axis))
}

/// Returns the spectra of a sensor, each over its strongest compared peak, with their axis; `None` unless both tests have them.
fn spectra(
    pair: [&RecordingResult; 2],
    sensor: &str,
    modes: &[&ModeChange],
) -> Option<([Curve; 2], Axis)> {
    let mut curves = Vec::new();
    for (side, recording) in pair.into_iter().enumerate() {
        let averages = &recording.measurement.spectra.as_ref()?.averages;
        let index = recording
            .responses
            .iter()
            .position(|one| one.name == sensor)?;
        let (lines, values) = (averages.lines, averages.responses.get(index)?);
        let peaks = modes.iter().filter_map(|change| {
            let reading = reading(recording, as_read(change)[side])?;
            values.get(lines.nearest(reading.frequency)).copied()
        });
        let (_, strongest) = extent(peaks)?;
        if strongest <= 0.0 {
            return None;
        }
        let values = values.iter().map(|value| value / strongest).collect();
        curves.push(Curve { lines, values });
    }
    let axis = Axis::linear(0.0, 1.0).of("magnitude, strongest mode = 1", "");
    Some((curves.try_into().ok()?, axis))
}

/// Returns the frequencies before and after (Hz) at the levels at which they were read.
fn as_read(change: &ModeChange) -> [f64; 2] {
    [
        change.before,
        change.after * (1.0 + 0.01 * change.level_percent),
    ]
}

/// Returns the reading of a compared frequency (Hz) in a recording.
fn reading(recording: &RecordingResult, frequency: f64) -> Option<&ModeReading> {
    let distance = |one: &&ModeReading| (one.frequency - frequency).abs();
    let nearest = recording.readings().iter();
    let nearest = nearest.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.filter(|one| distance(one) <= SAME_PEAK * frequency)
}

impl<'a> CloseUp<'a> {
    fn of(change: &'a ModeChange, overlay: &'a Overlay<'a>) -> Option<Self> {
        let [before, after] = overlay.recordings;
        let [first, second] = as_read(change);
        let readings = [reading(before, first)?, reading(after, second)?];
        Some(Self {
            change,
            overlay,
            readings,
        })
    }

    /// Standard deviation of the shift as read in these recordings (Hz).
    fn uncertainty(&self) -> f64 {
        let [before, after] = self.readings.map(|one| one.std.unwrap_or(one.half_line));
        before.hypot(after)
    }

    /// Level of the lower peak above the lowest line shown (dB): how clearly this sensor sees the mode.
    fn prominence(&self) -> f64 {
        let heights = [0, 1].map(|side| {
            let (_, values) = self.shown(side);
            extent(values).map_or(0.0, |(low, high)| decibels(high / low))
        });
        heights[0].min(heights[1])
    }

    /// Frequencies shown (Hz): both peaks, with some half-power widths and some lines on either side.
    fn ends(&self) -> [f64; 2] {
        let sides = self.readings.iter().zip(&self.overlay.curves);
        let sides = sides.map(|(reading, curve)| {
            let width = 2.0 * reading.damping_ratio.unwrap_or(0.0) * reading.frequency;
            let reach = (SIDE * width).max(LEAST_LINES * curve.lines.spacing);
            [reading.frequency - reach, reading.frequency + reach]
        });
        let ends = sides.fold([f64::INFINITY, f64::NEG_INFINITY], |ends, one| {
            [ends[0].min(one[0]), ends[1].max(one[1])]
        });
        // Both sides alike, whichever peak is the wider one; and up to the next line.
        let middle = 0.5 * (self.readings[0].frequency + self.readings[1].frequency);
        let reach = (ends[1] - middle).max(middle - ends[0]);
        let lines = &self.overlay.curves[0].lines;
        let line = |frequency: f64| (frequency - lines.low) / lines.spacing;
        let first = line(middle - reach).floor().max(0.0);
        let last = line(middle + reach).ceil().max(0.0);
        [first, last].map(|line| lines.frequency(line as usize))
    }

    /// First line shown of one test, and the magnitudes from there on.
    fn shown(&self, side: usize) -> (f64, Vec<f64>) {
        let Curve { lines, values } = &self.overlay.curves[side];
        let [low, high] = self.ends();
        let first = ((low - lines.low) / lines.spacing).ceil().max(0.0) as usize;
        let numbered = values.iter().enumerate().skip(first);
        let shown = numbered.take_while(|(line, _)| lines.frequency(*line) <= high);
        let shown = shown.map(|(_, value)| *value).collect();
        (lines.frequency(first), shown)
    }

    /// Levels of both tests below the peaks (dB), over the frequencies shown.
    fn levels(&self) -> [Series; 2] {
        let shown = [0, 1].map(|side| self.shown(side));
        let peaks = shown.each_ref().map(|(_, values)| {
            let range = extent(values.iter().copied());
            range.map_or(1.0, |(_, high)| high)
        });
        let higher = peaks[0].max(peaks[1]);
        let mut side = 0;
        shown.map(|(first, values)| {
            let (curve, peak) = (&self.overlay.curves[side], peaks[side]);
            let over = if self.overlay.has_force { higher } else { peak };
            // On some lines a function does not exist.
            let levels = values.iter().map(|value| match *value > 0.0 {
                true => decibels(value / over),
                false => f64::NAN,
            });
            let levels = levels.collect();
            let series = Series::even(
                NAMES[side],
                COLORS[side],
                first,
                curve.lines.spacing,
                levels,
            );
            side += 1;
            Series {
                mark: Mark::Curve(1.5),
                ..series
            }
        })
    }
}

/// Returns both curves over all frequencies, with the modes.
fn whole_band(overlay: &Overlay, modes: &[&ModeChange], height: f64) -> Panel {
    let values = overlay.curves.iter().flat_map(|curve| &curve.values);
    let y = magnitude_axis(values.copied()).of(&overlay.axis.label, &overlay.axis.unit);
    let axes = overlay.recordings.iter();
    let axes = axes.filter_map(|one| one.measurement.spectra.as_ref());
    let axes: Vec<Axis> = axes.map(frequency_axis).collect();
    let low = extent(axes.iter().map(|axis| axis.low)).map_or(0.0, |range| range.0);
    let high = extent(axes.iter().map(|axis| axis.high)).map_or(1.0, |range| range.1);
    let x = Axis::linear(low, high).of("frequency", "Hz");
    let mut panel = Panel::new(height, x, y);
    for side in [0, 1] {
        let Curve { lines, values } = &overlay.curves[side];
        let curve = over_lines(lines, NAMES[side], COLORS[side], values.clone());
        panel = panel.with([Series {
            mark: Mark::Curve(WIDTHS[side]),
            ..curve
        }]);
    }
    let rules = modes.iter().map(|one| Rule {
        at: one.before,
        line: one.before,
        half: 0.0,
        name: format!("mode {}", one.mode),
        words: signed_percent(Some(one.change_percent)) + " %",
        mode: true,
        prominence: one.change_percent.abs(),
    });
    panel.rules = rules.collect();
    panel
}

/// Returns the close-ups, all with the same levels. Changes of means are no changes of the tests that are shown.
fn panels(close_ups: &[CloseUp], is_mean: bool) -> Vec<Panel> {
    let levels: Vec<[Series; 2]> = close_ups.iter().map(CloseUp::levels).collect();
    let all = levels
        .iter()
        .flatten()
        .flat_map(|one| one.y.iter().copied());
    let lowest = extent(all).map_or(-DEPTH[0], |range| range.0);
    let y = Axis::linear(lowest.clamp(-DEPTH[1], -DEPTH[0]), 2.0).of("level", "dB");
    let mut neighbours = close_ups.windows(2);
    let has_one_file = neighbours.all(|two| two[0].overlay.file == two[1].overlay.file);
    let mut neighbours = close_ups.windows(2);
    let has_one_sensor = neighbours.all(|two| two[0].overlay.sensor == two[1].overlay.sensor);
    let mut panels = Vec::new();
    for (one, levels) in close_ups.iter().zip(levels) {
        let change = one.change;
        let mut title = format!(
            "mode {}: {} %",
            change.mode,
            signed_percent(Some(change.change_percent))
        );
        if is_mean {
            title.push_str(" in the mean");
        }
        let explained = [
            ("described", change.described_percent),
            ("level", change.level_percent),
        ];
        for (reason, percent) in explained {
            if percent.abs() >= LEAST_EXPLAINED {
                let percent = signed_percent(Some(percent));
                title.push_str(&format!(" ({reason}: {percent} %)"));
            }
        }
        if !has_one_file {
            title.push_str(&format!(", {}", one.overlay.file));
        }
        if !has_one_sensor {
            title.push_str(&format!(", {}", one.overlay.sensor));
        }
        let [low, high] = one.ends();
        let x = Axis::linear(low, high).of("frequency", "Hz");
        // The scatter of means is smaller than that of the tests that are shown.
        let repeated = repeated(one, &x, &y).filter(|_| !is_mean);
        let mut panel = Panel::new(CLOSE_UP, x, y.clone()).titled(title);
        panel = panel.with(repeated);
        for (side, curve) in levels.into_iter().enumerate() {
            let at = one.readings[side].frequency;
            let mark = [(at, y.low), (at, y.high)];
            let dots = Series::points("", COLORS[side], Mark::Dot(2.0), curve.pairs());
            let has_dots = dots.count() <= MOST_DOTS;
            panel = panel.with([
                Series::points("", COLORS[side], Mark::Dashed(1.3), mark),
                curve,
            ]);
            panel = panel.with(has_dots.then_some(dots));
        }
        panels.push(panel);
    }
    panels
}

/// Returns the places of the peak after if nothing but what is described changed, with what repeating a test changes; `None` where
/// none of them is shown.
fn repeated(one: &CloseUp, x: &Axis, y: &Axis) -> Option<Series> {
    let change = one.change;
    let explained = change.described_percent + change.level_percent;
    let ends = [-NORMAL_95, NORMAL_95].map(|reach| {
        let percent = explained + reach * change.std_percent;
        one.readings[0].frequency * (1.0 + 0.01 * percent)
    });
    let is_shown = ends[0] < x.high && ends[1] > x.low;
    is_shown.then(|| Series {
        x: Places::Each(ends.map(|end| end.clamp(x.low, x.high)).to_vec()),
        low: vec![y.low; 2],
        high: vec![y.high; 2],
        ..Series::new("after, if nothing changed (95 %)", Color::Data, Mark::Band)
    })
}
