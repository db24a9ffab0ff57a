//! What the page's script draws curves from that can be zoomed and hovered: the same data as the
//! pictures, with every number rounded to what a screen can show.

use serde::Serialize;

use super::figures::{FrfCurve, PeakMark, RecordingFigure, SpectraFigure, TimeOverview};
use super::format::significant;
use super::live_close_up::{LiveCloseUp, live_close_up};
use super::live_lines::{Stretch, stretches};

/// Significant digits of a value: hovering shows four.
const DIGITS: usize = 4;

/// Curves over one horizontal axis, in panels below each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LivePlot {
    /// "spectrum", "frf" or "taps".
    pub kind: &'static str,
    /// Horizontal axis.
    pub x: LiveAxis,
    /// The panels, topmost first.
    pub panels: Vec<LivePanel>,
    /// Resonances.
    pub marks: Vec<LiveMark>,
    /// Taps.
    pub taps: Vec<LiveTap>,
    /// What the curves leave out; empty where nothing.
    pub note: String,
}

/// Points, equally spaced piece by piece.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveAxis {
    /// "frequency".
    pub label: &'static str,
    /// "Hz".
    pub unit: &'static str,
    /// First point (unit), distance of the points (unit) and their number, of each piece.
    pub runs: Vec<(f64, f64, usize)>,
}

/// One panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LivePanel {
    /// What its vertical axis shows: "magnitude, rms".
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// "linear" or "logarithmic".
    pub scale: &'static str,
    /// Fixed ends of the axis; `None` = what is shown decides.
    pub range: Option<[f64; 2]>,
    /// The curves.
    pub series: Vec<LiveSeries>,
}

/// One curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveSeries {
    /// Its name in the legend.
    pub name: String,
    /// Place in the palette; curves of one sensor share it.
    pub color: usize,
    /// One value for each point; null where there is none.
    pub values: Vec<Option<f64>>,
}

/// A resonance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveMark {
    /// Best frequency (Hz).
    pub at: f64,
    /// Frequency on the line (Hz).
    pub line: f64,
    /// Bound of the line reading (Hz).
    pub half: f64,
    /// "mode 1", "mains 50 Hz".
    pub name: String,
    /// "17.003 Hz".
    pub words: String,
    /// Whether it is a mode.
    pub mode: bool,
}

/// A tap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveTap {
    /// Time (s).
    pub at: f64,
    /// Peak (unit of the panel).
    pub peak: Option<f64>,
    /// "tap 3".
    pub name: String,
    /// "used, 0.313 s, 41.2 N" or "rejected, 6.210 s, 12 N: double hit".
    pub words: String,
    /// Whether it was used.
    pub used: bool,
    /// The samples about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub close_up: Option<LiveCloseUp>,
}

/// The averaged spectra of a recording; `None` where there are none.
pub fn live_spectrum(figure: &RecordingFigure) -> Option<LivePlot> {
    let spectra = figure.spectra.as_ref()?;
    let mut panels: Vec<LivePanel> = Vec::new();
    for (color, response) in spectra.responses.iter().enumerate() {
        let label = "magnitude, rms";
        let panel = panel_of(&mut panels, label, &response.unit, "logarithmic");
        panel
            .series
            .push(series(&response.name, color, &response.values));
    }
    if let Some(force) = &spectra.force {
        let panel = panel_of(
            &mut panels,
            "force, rms",
            &spectra.force_unit,
            "logarithmic",
        );
        panel.series.push(series("force", 5, force));
    }
    over_lines("spectrum", spectra, panels)
}

/// The frequency response functions of a recording; `None` without a hammer or without taps.
pub fn live_frf(figure: &RecordingFigure) -> Option<LivePlot> {
    let spectra = figure.spectra.as_ref()?;
    let mut panels: Vec<LivePanel> = Vec::new();
    for (color, frf) in spectra.frfs.iter().enumerate() {
        let panel = panel_of(&mut panels, &frf.form, &frf.unit, "logarithmic");
        let name = format!("{}, {}", frf.name, frf.estimator);
        panel.series.push(series(&name, color, &frf.magnitude));
    }
    for (color, frf) in spectra.frfs.iter().enumerate() {
        let panel = panel_of(&mut panels, "phase", "degrees", "linear");
        panel.range = Some([-190.0, 190.0]);
        panel.series.push(series(&frf.name, color, &frf.phase));
    }
    for (color, frf) in spectra.frfs.iter().enumerate() {
        if let FrfCurve {
            coherence: Some(coherence),
            ..
        } = frf
        {
            let panel = panel_of(&mut panels, "coherence", "1", "linear");
            panel.range = Some([0.0, 1.05]);
            panel.series.push(series(&frf.name, color, coherence));
        }
    }
    over_lines("frf", spectra, panels)
}

/// A recording over time with its taps; `None` where there are no samples.
pub fn live_taps(figure: &RecordingFigure) -> Option<LivePlot> {
    let overview = figure.overview.as_ref()?;
    let count = overview.low.len().min(overview.high.len());
    if count == 0 {
        return None;
    }
    let (label, unit) = split_unit(&overview.label);
    let mut panel = LivePanel {
        label: label.to_owned(),
        unit: unit.to_owned(),
        scale: "linear",
        range: None,
        series: vec![
            series("smallest", 0, &overview.low),
            series("largest", 0, &overview.high),
        ],
    };
    panel
        .series
        .iter_mut()
        .for_each(|series| series.values.truncate(count));
    Some(LivePlot {
        kind: "taps",
        x: LiveAxis {
            label: "time",
            unit: "s",
            runs: vec![(0.5 * overview.step, overview.step, count)],
        },
        panels: vec![panel],
        marks: Vec::new(),
        taps: live_tap_marks(overview, unit),
        note: taps_note(overview),
    })
}

fn taps_note(overview: &TimeOverview) -> String {
    let step = significant(overview.step, 2);
    let kept = overview.taps.iter().any(|tap| tap.close_up.is_some());
    let click = if kept {
        " Click a tap for its samples."
    } else {
        ""
    };
    format!("Each point is the smallest and largest value of {step} s.{click}")
}

fn live_tap_marks(overview: &TimeOverview, unit: &str) -> Vec<LiveTap> {
    let taps = overview.taps.iter().enumerate();
    taps.map(|(index, tap)| {
        let place = format!("{:.3} s, {} {unit}", tap.time, significant(tap.peak, 3));
        LiveTap {
            at: tap.time,
            peak: shown(tap.peak),
            name: format!("tap {}", index + 1),
            words: match &tap.rejected {
                None => format!("used, {place}"),
                Some(reason) => format!("rejected, {place}: {reason}"),
            },
            used: tap.rejected.is_none(),
            close_up: tap.close_up.as_ref().and_then(live_close_up),
        }
    })
    .collect()
}

/// "force (N)" as "force" and "N".
fn split_unit(label: &str) -> (&str, &str) {
    let inner = label
        .strip_suffix(')')
        .and_then(|label| label.rsplit_once(" ("));
    inner.unwrap_or((label, ""))
}

/// The panel with this label and unit, made if it is new.
fn panel_of<'a>(
    panels: &'a mut Vec<LivePanel>,
    label: &str,
    unit: &str,
    scale: &'static str,
) -> &'a mut LivePanel {
    let same = |panel: &LivePanel| panel.label == label && panel.unit == unit;
    let place = panels.iter().position(same).unwrap_or(panels.len());
    if place == panels.len() {
        panels.push(LivePanel {
            label: label.to_owned(),
            unit: unit.to_owned(),
            scale,
            range: None,
            series: Vec::new(),
        });
    }
    &mut panels[place]
}

fn series(name: &str, color: usize, values: &[f64]) -> LiveSeries {
    LiveSeries {
        name: name.to_owned(),
        color,
        values: values.iter().map(|value| shown(*value)).collect(),
    }
}

/// A value as the page has it: four digits; nothing where it is no number.
fn shown(value: f64) -> Option<f64> {
    let rounded = format!("{value:.*e}", DIGITS - 1);
    rounded.parse().ok().filter(|value: &f64| value.is_finite())
}

/// A plot over the spectral lines, thinned where there are more lines than a screen can show.
fn over_lines(
    kind: &'static str,
    spectra: &SpectraFigure,
    mut panels: Vec<LivePanel>,
) -> Option<LivePlot> {
    let axis = &spectra.lines;
    let all = panels.iter().flat_map(|panel| &panel.series);
    let lines = all.map(|series| series.values.len()).max()?;
    if lines == 0 {
        return None;
    }
    let modes = spectra.peaks.iter().filter(|peak| peak.mode.is_some());
    let modes: Vec<usize> = modes.map(|peak| axis.nearest(peak.frequency)).collect();
    let stretches = stretches(lines, &modes);
    for series in panels.iter_mut().flat_map(|panel| &mut panel.series) {
        series.values.resize(lines, None);
        let thinned = stretches.iter().map(|one| one.thinned(&series.values));
        series.values = thinned.collect::<Vec<_>>().concat();
    }
    let run = |stretch: &Stretch| {
        let (first, step, count) = stretch.points();
        let start = axis.frequency(0) + first * axis.spacing;
        (start, step * axis.spacing, count)
    };
    let most = stretches.iter().map(|one| one.stride).max();
    let note = match most.filter(|stride| *stride > 1) {
        Some(stride) if modes.is_empty() => {
            format!("Of {lines} lines the smallest and largest of every {stride} are drawn.")
        }
        Some(stride) => format!(
            "All lines about the modes are drawn; of the other lines the smallest and largest of every {stride}."
        ),
        None => String::new(),
    };
    Some(LivePlot {
        kind,
        x: LiveAxis {
            label: "frequency",
            unit: "Hz",
            runs: stretches.iter().map(run).collect(),
        },
        panels,
        marks: spectra.peaks.iter().filter_map(live_mark).collect(),
        taps: Vec::new(),
        note,
    })
}

fn live_mark(peak: &PeakMark) -> Option<LiveMark> {
    let finite = [peak.frequency, peak.line_frequency, peak.half_line];
    if !finite.iter().all(|value| value.is_finite()) {
        return None;
    }
    Some(LiveMark {
        at: peak.frequency,
        line: peak.line_frequency,
        half: peak.half_line,
        name: match (peak.mode, &peak.label) {
            (Some(mode), _) => format!("mode {mode}"),
            (None, Some(label)) => label.clone(),
            (None, None) => "no mode".to_owned(),
        },
        words: super::plot::frequency_words(peak),
        mode: peak.mode.is_some(),
    })
}
