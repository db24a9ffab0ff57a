//! A chart as the page's script draws it: thinned where there is more than a screen can show, with every number
//! rounded to what zooming can tell apart.

use std::ops::Range;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::drawing::{Drawing, Point};
use super::files::render_svg;
use super::{Block, Chart, Event, InPage, Mark, Panel, Places, Run, Series};
use crate::ReportError;
use crate::format::significant;

/// Most numbers of a curve about a tap: the force's pulse of a millisecond keeps some ten, while a hundred taps
/// stay below half a megabyte.
const MOST_NUMBERS: usize = 400;
/// Numbers about a tap are whole parts of the largest: half a pixel of the curve's height.
const PARTS: f64 = 500.0;
/// Significant digits of a curve's values, of which hovering shows four.
const CURVE_DIGITS: usize = 4;
/// Significant digits of places, so that close poles stay apart when they are zoomed.
const PLACE_DIGITS: usize = 7;
/// Height of the panels of a view with few and with many of them (pixels).
const HIGH: f64 = 360.0;
const LOW: f64 = 210.0;
/// Panels up to which a view has few.
const FEW: usize = 3;
/// Effort of deflating the page's curves: zlib's usual level 6 takes nearly three times as long and saves a tenth.
const DEFLATION: Compression = Compression::new(3);

/// A picture inside the page.
#[derive(Debug, Clone, PartialEq)]
pub struct InlineFigure {
    /// Section that it stands in: "modes".
    pub section: &'static str,
    /// Contents, and what to look for.
    pub caption: String,
    /// An `<svg>` element that this crate made.
    pub svg: String,
    /// Its curves for the page's script, as [`packed`] makes them.
    pub live: Option<String>,
    /// True where it is so high that in print it takes a page of its own.
    pub tall: bool,
}

impl InlineFigure {
    /// Takes a chart for a section of the page, with its drawing.
    ///
    /// # Errors
    /// [`ReportError::Json`] where the chart is no JSON.
    pub fn of(
        section: &'static str,
        chart: &Chart,
        drawing: &Drawing,
    ) -> Result<Self, ReportError> {
        Ok(Self {
            section,
            caption: chart.caption.clone(),
            svg: render_svg(drawing),
            tall: drawing.height > drawing.width,
            live: chart.page().as_ref().map(packed).transpose()?,
        })
    }
}

/// Returns a chart as it stands in the page: JSON, deflated, since numbers take up most of it, and in base 64.
/// Browsers inflate it by themselves; one that cannot shows the picture.
///
/// # Errors
/// [`ReportError::Json`] where it is no JSON.
pub fn packed(chart: &Chart) -> Result<String, ReportError> {
    let mut deflated = ZlibEncoder::new(Vec::new(), DEFLATION);
    serde_json::to_writer(&mut deflated, chart).map_err(ReportError::Json)?;
    let finished = deflated.finish().map_err(serde_json::Error::io);
    Ok(BASE64_STANDARD.encode(finished.map_err(ReportError::Json)?))
}

impl Chart {
    /// Returns the chart with the points that the page's script needs; `None` where there are none.
    ///
    /// Curves over equally spaced places become one block, all their panels below each other. Of other charts each
    /// block is one view of the page, or each panel of a block that is shown apart.
    pub fn page(&self) -> Option<Chart> {
        let blocks = self.blocks.iter();
        let shown = blocks.filter(|block| block.in_page != InPage::Absent);
        let panels: Vec<&Panel> = shown.clone().flat_map(|block| &block.panels).collect();
        let series = panels.iter().flat_map(|panel| &panel.series);
        let most = series.clone().map(Series::count).max();
        let most = most.filter(|most| *most > 0)?;
        // A table of numbers has nothing to zoom.
        if series.clone().any(|one| one.mark == Mark::Cell) {
            return None;
        }
        let mut page = Chart {
            kind: self.kind,
            ..Chart::default()
        };
        if series.clone().all(|one| matches!(one.x, Places::Even(_))) {
            page.blocks = vec![Block::new(1, curves(&panels, most)?)];
            return Some(page);
        }
        let mut shown: Vec<&Block> = shown.collect();
        shown.sort_by_key(|block| block.in_page != InPage::First);
        for block in shown {
            if block.in_page != InPage::Apart {
                page.blocks.push(view(&block.name, &block.panels));
                continue;
            }
            for panel in &block.panels {
                let alone = std::slice::from_ref(panel);
                page.blocks.push(view(&panel.title, alone));
            }
        }
        Some(page)
    }
}

/// Returns panels of curves of at most so many lines, all thinned at the same places; `None` without a first curve.
fn curves(panels: &[&Panel], lines: usize) -> Option<Vec<Panel>> {
    let first = panels.first()?;
    let Places::Even(runs) = &first.series.first()?.x else {
        return None;
    };
    let whole = *runs.first()?;
    let mut modes = Vec::new();
    for rule in first.rules.iter().filter(|rule| rule.mode) {
        modes.push(((rule.at - whole.first) / whole.step).round().max(0.0) as usize);
    }
    let mut series = panels.iter().flat_map(|panel| &panel.series);
    let envelope = series.any(|series| series.mark == Mark::Band);
    let stretches = match envelope {
        true => vec![Stretch::whole(lines, 1)],
        false => stretches(lines, &modes),
    };
    let mut runs = Vec::new();
    for stretch in &stretches {
        let (first, apart, count) = stretch.points();
        runs.push(Run {
            first: whole.first + first * whole.step,
            step: apart * whole.step,
            count,
        });
    }
    let stride = stretches.iter().map(|one| one.stride).max().unwrap_or(1);
    let note = if envelope {
        let click = match first.events.iter().any(|event| !event.close_up.is_empty()) {
            true => " Click a tap for its samples.",
            false => "",
        };
        let step = significant(whole.step, 2);
        format!("Each point is the smallest and largest value of {step} s.{click}")
    } else if stride > 1 && modes.is_empty() {
        format!("Of {lines} lines the smallest and largest of every {stride} are drawn.")
    } else if stride > 1 {
        format!(
            "All lines about the modes are drawn; of the other lines the smallest and largest of every {stride}."
        )
    } else {
        String::new()
    };
    let shown = panels.iter().map(|panel| Panel {
        note: note.clone(),
        ..curve_panel(panel, lines, &stretches, &runs)
    });
    Some(shown.collect())
}

/// Returns a panel of curves of so many lines, thinned to stretches, which begin and end at these places.
fn curve_panel(panel: &Panel, lines: usize, stretches: &[Stretch], runs: &[Run]) -> Panel {
    let mut shown = panel_like(panel, panel.height);
    shown.rules.clone_from(&panel.rules);
    shown.rules.retain(|rule| {
        let mut places = [rule.at, rule.line, rule.half].into_iter();
        places.all(f64::is_finite)
    });
    for event in &panel.events {
        shown.events.push(Event {
            peak: rounded(event.peak, CURVE_DIGITS),
            close_up: close_up(&event.close_up).unwrap_or_default(),
            ..event.clone()
        });
    }
    for one in &panel.series {
        let [y, low, high] = [&one.y, &one.low, &one.high].map(|values| {
            let mut values = each(values, CURVE_DIGITS);
            if !values.is_empty() {
                values.resize(lines, f64::NAN);
            }
            let parts = stretches.iter().flat_map(|part| part.thinned(&values));
            parts.collect::<Vec<f64>>()
        });
        shown.series.push(Series {
            x: Places::Even(runs.to_vec()),
            y,
            low,
            high,
            opacity: one.opacity,
            ..Series::new(&one.name, one.color, one.mark)
        });
    }
    shown
}

/// Returns an empty panel with the title, the axes and the further facts of another one.
fn panel_like(panel: &Panel, height: f64) -> Panel {
    Panel {
        title: panel.title.clone(),
        extra: panel.extra,
        ..Panel::new(height, panel.x.clone(), panel.y.clone())
    }
}

/// Returns a value with so many significant digits; what is no number stays none.
fn rounded(value: f64, digits: usize) -> f64 {
    let rounded = format!("{value:.*e}", digits - 1);
    let rounded = rounded.parse().ok().filter(|value: &f64| value.is_finite());
    rounded.unwrap_or(f64::NAN)
}

fn each(values: &[f64], digits: usize) -> Vec<f64> {
    let rounded = values.iter().map(|value| rounded(*value, digits));
    rounded.collect()
}

/// Returns the samples about a tap, thinned where there are more than a screen can show; `None` without any.
fn close_up(panels: &[Panel]) -> Option<Vec<Panel>> {
    let series = panels.iter().flat_map(|panel| panel.series.first());
    let count = series.clone().map(Series::count).max();
    let count = count.filter(|count| *count > 0)?;
    let Places::Even(runs) = &series.clone().next()?.x else {
        return None;
    };
    let samples = *runs.first()?;
    let stride = if count > MOST_NUMBERS {
        (2 * count).div_ceil(MOST_NUMBERS)
    } else {
        1
    };
    let whole = Stretch::whole(count, stride);
    let (first, apart, points) = whole.points();
    let note = if stride > 1 {
        let every = significant(stride as f64 * samples.step, 2);
        format!("The smallest and largest value of every {every} ms.")
    } else {
        String::new()
    };
    let mut shown = Vec::new();
    for (panel, series) in panels.iter().zip(series) {
        let finite = series.y.iter().filter(|value| value.is_finite());
        let largest = finite.fold(0.0_f64, |most, value| most.max(value.abs()));
        // Whole parts of the largest value have few digits.
        let part = largest / PARTS;
        let mut values = each(&series.y, PLACE_DIGITS);
        values.resize(count, f64::NAN);
        let mut values = whole.thinned(&values);
        for value in &mut values {
            let parts = (*value / part).round();
            *value = match parts.is_finite() {
                true => rounded(parts * part, CURVE_DIGITS) + 0.0,
                false => 0.0,
            };
        }
        let mut curve = Series::new(&series.name, series.color, series.mark);
        let start = samples.first + first * samples.step;
        curve.x = Places::even(start, apart * samples.step, points);
        curve.y = values;
        shown.push(Panel {
            note: note.clone(),
            series: vec![curve],
            ..panel_like(panel, panel.height)
        });
    }
    Some(shown)
}

/// Returns panels of single points that are shown together, with rounded numbers.
fn view(name: &str, panels: &[Panel]) -> Block {
    let height = if panels.len() > FEW { LOW } else { HIGH };
    let mut shown = Vec::new();
    for panel in panels {
        let mut points = panel_like(panel, height);
        for axis in [&mut points.x, &mut points.y] {
            axis.names.retain(|tick| tick.label.is_some());
            for label in axis.names.iter_mut().filter_map(|tick| tick.label.as_mut()) {
                let first = label.lines().next().unwrap_or_default();
                *label = first.to_owned();
            }
        }
        points.rules = panel.rules.clone();
        for rule in &mut points.rules {
            rule.at = rounded(rule.at, PLACE_DIGITS);
        }
        for one in &panel.series {
            let at = (0..one.count()).map(|index| one.at(index));
            let mut x = each(&at.collect::<Vec<f64>>(), PLACE_DIGITS);
            let mut y = each(&one.y, PLACE_DIGITS);
            // Equally spaced points are thinned to what lies on the axis.
            if let Places::Even(_) = one.x {
                let all = x.into_iter().zip(y);
                let all = all.filter(|(x, y)| panel.x.holds(*x) && y.is_finite());
                let most = match one.mark {
                    Mark::Curve(_) => MOST_POINTS,
                    _ => BEHIND,
                };
                (x, y) = thinned(all.collect(), most).into_iter().unzip();
            }
            points.series.push(Series {
                x: Places::Each(x),
                y,
                low: each(&one.low, PLACE_DIGITS),
                high: each(&one.high, PLACE_DIGITS),
                extra: each(&one.extra, PLACE_DIGITS),
                words: one.words.clone(),
                said: one.said.clone(),
                links: one.links.clone(),
                ..Series::new(&one.name, one.color, one.mark)
            });
        }
        shown.push(points);
    }
    Block {
        name: name.to_owned(),
        ..Block::new(1, shown)
    }
}

/// Most points of a curve beside those about modes: more than one for each pixel of the page's width. Five long
/// recordings stay below 2 MB.
const MOST_POINTS: usize = 1400;
/// Width of a column of a curve (pixels), and points in it up to which all are drawn.
const COLUMN: f64 = 2.0;
const FEW_IN_COLUMN: usize = 4;
/// Lines kept on either side of a mode: what zooming to it shows.
const ABOUT_MODES: usize = 40;
/// Most points of a curve behind single points: it is faint, and the spectra have all of it.
const BEHIND: usize = 400;

/// Reduces a curve, ascending in x (pixels): of two pixels with many points the lowest and the highest stay, in
/// their order.
///
/// The picture looks the same; a peak of one sample stays. Points that are not finite are left out.
pub fn decimate(points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let finite = points
        .into_iter()
        .filter(|(x, y)| x.is_finite() && y.is_finite());
    let finite: Vec<Point> = finite.collect();
    let mut reduced = Vec::new();
    for column in
        finite.chunk_by(|before, after| (before.0 / COLUMN).floor() == (after.0 / COLUMN).floor())
    {
        if column.len() <= FEW_IN_COLUMN {
            reduced.extend(column);
            continue;
        }
        let (mut low, mut high) = (0, 0);
        for (index, point) in column.iter().enumerate() {
            if point.1 < column[low].1 {
                low = index;
            }
            if point.1 > column[high].1 {
                high = index;
            }
        }
        reduced.push(column[low.min(high)]);
        reduced.push(column[low.max(high)]);
    }
    // A curve reaches from its first to its last point.
    if let [first, .., last] = finite.as_slice() {
        if reduced.first() != Some(first) {
            reduced.insert(0, *first);
        }
        if reduced.last() != Some(last) {
            reduced.push(*last);
        }
    }
    reduced
}

/// At most so many points: of every few the highest and the lowest, in their order.
fn thinned(points: Vec<(f64, f64)>, most: usize) -> Vec<(f64, f64)> {
    if points.len() <= most {
        return points;
    }
    let stride = (2 * points.len()).div_ceil(most);
    let mut kept = Vec::new();
    for some in points.chunks(stride) {
        let low = some.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = some.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut both: Vec<(f64, f64)> = low.into_iter().chain(high).copied().collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(both);
    }
    kept
}

/// Lines that are drawn in the same way.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    /// The lines.
    lines: Range<usize>,
    /// 1: every line is a point; else so many lines become two points, the smallest and the largest value.
    stride: usize,
}

/// All lines in their order: every one about the lines `modes`, the others thinned where they are too many.
fn stretches(lines: usize, modes: &[usize]) -> Vec<Stretch> {
    if lines <= MOST_POINTS {
        return vec![Stretch::whole(lines, 1)];
    }
    let stride = (2 * lines).div_ceil(MOST_POINTS);
    let mut modes = modes.to_vec();
    modes.sort_unstable();
    let mut all = Vec::new();
    let mut done = 0;
    for line in modes {
        let first = line.saturating_sub(ABOUT_MODES) / stride * stride;
        let end = (line + ABOUT_MODES + 1).div_ceil(stride) * stride;
        let (first, end) = (first.min(lines).max(done), end.min(lines).max(done));
        all.push((done..first, stride));
        all.push((first..end.max(first), 1));
        done = end.max(first);
    }
    all.push((done..lines, stride));
    let some = all.into_iter().filter(|(lines, _)| !lines.is_empty());
    some.map(|(lines, stride)| Stretch { lines, stride })
        .collect()
}

impl Stretch {
    fn whole(lines: usize, stride: usize) -> Stretch {
        let lines = 0..lines;
        Stretch { lines, stride }
    }

    /// First point, distance of points and their number, in lines. The two points of some lines stand at their
    /// quarters.
    fn points(&self) -> (f64, f64, usize) {
        let first = self.lines.start as f64;
        if self.stride == 1 {
            return (first, 1.0, self.lines.len());
        }
        let half = 0.5 * self.stride as f64;
        let count = 2 * self.lines.len().div_ceil(self.stride);
        (first + 0.5 * half - 0.5, half, count)
    }

    /// The values of the points.
    fn thinned(&self, values: &[f64]) -> Vec<f64> {
        let lines = self.lines.start.min(values.len())..self.lines.end.min(values.len());
        if self.stride == 1 {
            return values[lines].to_vec();
        }
        values[lines].chunks(self.stride).flat_map(ends).collect()
    }
}

/// Smallest and largest of some values, in the order in which they stand; none where no value is a number.
fn ends(values: &[f64]) -> [f64; 2] {
    let known = values
        .iter()
        .enumerate()
        .filter(|(_, value)| !value.is_nan());
    let low = known.clone().min_by(|a, b| a.1.total_cmp(b.1));
    let high = known.max_by(|a, b| a.1.total_cmp(b.1));
    match (low, high) {
        (Some(low), Some(high)) if low.0 <= high.0 => [*low.1, *high.1],
        (Some(low), Some(high)) => [*high.1, *low.1],
        _ => [f64::NAN; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Color};
    use super::*;
    use proptest::prelude::*;

    /// A pulse of half a sine, 1 ms long, that begins at the trigger.
    fn pulse(rate: f64) -> Panel {
        let value = |k: usize| {
            let time = k as f64 / rate - 2e-3;
            let inside = (0.0..1e-3).contains(&time);
            if inside {
                40.0 * (std::f64::consts::PI * time / 1e-3).sin()
            } else {
                0.0
            }
        };
        let values = (0..(0.032 * rate) as usize).map(value).collect();
        let series = Series::even("force", Color::Soft, -2.0, 1e3 / rate, values);
        Panel::new(190.0, Axis::linear(0.0, 1.0), Axis::linear(0.0, 1.0)).with([series])
    }

    #[test]
    fn prop_a_pulse_keeps_its_height_its_place_and_its_length() {
        for rate in [2048.0, 12_800.0, 51_200.0, 200_000.0] {
            let live = close_up(&[pulse(rate)]).expect("samples");
            let curve = &live[0].series[0];
            assert!(curve.y.len() <= MOST_NUMBERS + 2, "{rate}");
            let value = |k: usize| curve.y[k];
            let time = |k: usize| curve.at(k);
            let largest = (0..curve.y.len())
                .max_by(|a, b| value(*a).total_cmp(&value(*b)))
                .expect("values");
            let spacing = (1e3 / rate).max(time(1) - time(0));
            assert!(
                (value(largest) - 40.0).abs() < 40.0 * (1.6 * spacing).powi(2) + 0.1,
                "{rate}"
            );
            assert!(
                (time(largest) - 0.5).abs() <= spacing,
                "{rate}: {}",
                time(largest)
            );
            let high = (0..curve.y.len()).filter(|k| value(*k) > 4.0).map(time);
            let length = high.clone().fold(f64::MIN, f64::max) - high.fold(f64::MAX, f64::min);
            assert!((length - 0.93).abs() <= 2.0 * spacing, "{rate}: {length}");
        }
    }

    #[test]
    fn limit_without_samples_there_is_no_close_up_and_silence_is_flat() {
        let mut panel = pulse(2048.0);
        panel.series[0].y.fill(0.0);
        let live = close_up(&[panel.clone()]).expect("samples");
        assert!(live[0].series[0].y.iter().all(|value| *value == 0.0));
        panel.series[0].y.clear();
        assert_eq!(close_up(&[panel]), None);
    }

    #[test]
    fn limit_few_lines_are_all_kept() {
        let all = stretches(MOST_POINTS, &[7]);
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].points(), (0.0, 1.0, MOST_POINTS));
    }

    #[test]
    fn limit_what_is_no_number_leaves_a_hole() {
        assert!(ends(&[f64::NAN, f64::NAN]).iter().all(|end| end.is_nan()));
        assert_eq!(ends(&[2.0, f64::NAN, 1.0]), [2.0, 1.0]);
    }

    proptest! {
        /// Every line lies in one stretch, those about modes are points at their own places, and each stretch has
        /// as many values as points.
        #[test]
        fn prop_lines_about_modes_stay_where_they_are(
            lines in 2001_usize..60_000,
            places in proptest::collection::vec(0.0_f64..1.0, 0..8),
        ) {
            let modes: Vec<usize> = places.iter().map(|x| (x * lines as f64) as usize).collect();
            let all = stretches(lines, &modes);
            prop_assert_eq!(all[0].lines.start, 0);
            prop_assert_eq!(all[all.len() - 1].lines.end, lines);
            prop_assert!(all.windows(2).all(|two| two[0].lines.end == two[1].lines.start));
            let values: Vec<f64> = (0..lines).map(|line| line as f64).collect();
            for stretch in &all {
                let (first, step, count) = stretch.points();
                let found = stretch.thinned(&values);
                prop_assert_eq!(found.len(), count);
                if stretch.stride == 1 {
                    prop_assert_eq!(found[0], first);
                    prop_assert_eq!(step, 1.0);
                }
                // The smallest and largest of some lines are their ends, half a distance from the points.
                for (point, value) in found.iter().enumerate() {
                    let at = first + step * point as f64;
                    prop_assert!((at - value).abs() <= stretch.stride as f64);
                }
            }
            for mode in modes {
                for line in mode.saturating_sub(ABOUT_MODES)..(mode + ABOUT_MODES).min(lines) {
                    let own = all.iter().find(|one| one.lines.contains(&line)).unwrap();
                    prop_assert_eq!(own.stride, 1);
                }
            }
            // Two points a stride, all lines about modes, and what rounding adds.
            let points: usize = all.iter().map(|one| one.points().2).sum();
            prop_assert!(points <= MOST_POINTS + 8 * (2 * ABOUT_MODES + 2 * 61));
        }
    }
}
