//! Natural frequency and damping against amplitude: a pair of panels for every mode.

use tapjoint_signal::modal::amplitude::{AmplitudeCurve, AmplitudePoint, AmplitudeVerdict, Trend};

use super::super::format::significant;
use super::axis::{Axis, Tick, extent, padded};
use super::drawing::{Align, Drawing, Stroke, Text};
use super::font::fitted;
use super::palette::{BLUE, Color, INK, SKY, SOFT, VERMILION, curve};
use super::panel::{LABEL_SIZE, Panel, Sample, TICK_SIZE, draw_legend, draw_title};
use super::spectrum::{LEFT, RIGHT, WIDTH};

/// Most modes drawn; the tables have them all.
const MOST: usize = 8;
/// Height of one mode's row (pixels).
const ROW: f64 = 236.0;
/// Height of a panel (pixels).
const HEIGHT: f64 = 160.0;
/// Space between the two panels of a row, for the right one's labels (pixels).
const BETWEEN: f64 = 96.0;
/// Upper end of the first row (pixels).
const TOP: f64 = 96.0;
/// Width of the columns of which a band is made (pixels).
const COLUMN: f64 = 3.0;
/// Colour of a band: sky blue on white, opaque.
const BAND: Color = Color(200, 229, 247);
/// Points up to this many times the median uncertainty decide the vertical range; bars of others may
/// leave the panel.
const TELLING: f64 = 4.0;
/// Standard uncertainties by which a point lies apart from the others: chance does not reach that far.
const APART: f64 = 4.0;
/// From this many taps on all points have one colour.
pub(crate) const MOST_COLOURS: usize = 4;
/// Half length of a bar: 95 % of a normal distribution.
pub(crate) const BAR: f64 = 1.96;
/// Decades up to which 2 and 5 are labelled beside the powers of ten.
const FEW_DECADES: f64 = 2.6;

/// A mode's curve with the mode's number, and what the amplitude is.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeFigure {
    /// Name of the recording.
    pub file: String,
    /// What the amplitude is, with its unit: "amplitude (m/s2)".
    pub amplitude: String,
    /// Number and curve of every mode; those without points are left out of the picture.
    pub modes: Vec<(usize, AmplitudeCurve)>,
}

/// One quantity of a row.
pub(crate) struct Quantity {
    title: &'static str,
    /// Name and unit.
    pub(crate) words: (&'static str, &'static str),
    pub(crate) trend: fn(&AmplitudeCurve) -> Option<&Trend>,
    /// Value and standard uncertainty of a point, in the unit drawn.
    pub(crate) value: fn(&AmplitudePoint) -> (f64, f64),
    /// Unit drawn over the trend's unit.
    pub(crate) factor: f64,
}

pub(crate) const FREQUENCY: Quantity = Quantity {
    title: "frequency (Hz)",
    words: ("frequency", "Hz"),
    trend: |curve| curve.frequency.as_ref(),
    value: |point| (point.frequency, point.frequency_std),
    factor: 1.0,
};

pub(crate) const DAMPING: Quantity = Quantity {
    title: "damping ratio (%)",
    words: ("damping ratio", "%"),
    trend: |curve| curve.damping.as_ref(),
    value: |point| (100.0 * point.damping_ratio, 100.0 * point.damping_std),
    factor: 100.0,
};

/// Frequency and damping against amplitude; `None` where no mode has a curve.
pub fn draw_amplitude(figure: &AmplitudeFigure) -> Option<Drawing> {
    let with_curve = |mode: &&(usize, AmplitudeCurve)| mode.1.frequency.is_some();
    let modes: Vec<&(usize, AmplitudeCurve)> = figure.modes.iter().filter(with_curve).collect();
    if modes.is_empty() {
        return None;
    }
    let rows = modes.len().min(MOST);
    let height = TOP + rows as f64 * ROW + 18.0;
    let name = format!("Frequency and damping against amplitude, {}", figure.file);
    let mut drawing = Drawing::new(name.as_str(), WIDTH, height as u32);
    draw_title(&mut drawing, &name, &below(modes.len()));
    draw_legend(&mut drawing, (LEFT, 76.0), RIGHT, &legend(&modes));
    for (row, (number, curve)) in modes.into_iter().take(MOST).enumerate() {
        let top = TOP + row as f64 * ROW;
        draw_heading(&mut drawing, *number, curve, top + 14.0);
        let x = if row + 1 == rows {
            figure.amplitude.as_str()
        } else {
            ""
        };
        let middle = 0.5 * (LEFT + RIGHT);
        let left = (LEFT, middle - 0.5 * BETWEEN);
        let right = (middle + 0.5 * BETWEEN, RIGHT);
        for (quantity, sides) in [(&FREQUENCY, left), (&DAMPING, right)] {
            draw_panel(&mut drawing, curve, quantity, (sides, top + 30.0), x);
        }
    }
    Some(drawing)
}

fn below(modes: usize) -> String {
    let shown = if modes > MOST {
        format!(" \u{b7} the first {MOST} of {modes} modes")
    } else {
        String::new()
    };
    format!("every point a piece of a decay, none used twice \u{b7} bars and band 95 %{shown}")
}

fn legend(modes: &[&(usize, AmplitudeCurve)]) -> Vec<(Sample, String)> {
    let taps = modes.iter().map(|(_, curve)| taps(curve)).max();
    let taps = taps.unwrap_or(1);
    let mut entries: Vec<(Sample, String)> = if taps == 1 {
        vec![(Sample::Dot(BLUE), "piece of the decay".to_owned())]
    } else if taps <= MOST_COLOURS {
        (0..taps)
            .map(|tap| (Sample::Dot(curve(tap)), format!("tap {}", tap + 1)))
            .collect()
    } else {
        vec![(
            Sample::Dot(BLUE),
            format!("pieces of the decays of {taps} taps"),
        )]
    };
    let words = "curve through them with its 95 % bound".to_owned();
    entries.push((Sample::Band(SKY), words));
    entries
}

/// Number of taps with points.
pub(crate) fn taps(curve: &AmplitudeCurve) -> usize {
    let taps = curve.points.iter().map(|point| point.tap + 1);
    taps.max().unwrap_or(0)
}

fn color(curve_drawn: &AmplitudeCurve, tap: usize) -> Color {
    if taps(curve_drawn) <= MOST_COLOURS {
        curve(tap)
    } else {
        BLUE
    }
}

/// "mode 1 · change from loud to soft: frequency +0.32 ± 0.01 Hz, damping −0.14 ± 0.01 %".
fn draw_heading(drawing: &mut Drawing, number: usize, curve: &AmplitudeCurve, y: f64) {
    let name = Text::new(format!("mode {number}"), (LEFT, y), LABEL_SIZE).bold();
    let after = LEFT + name.width() + 14.0;
    drawing.text(name);
    let (words, color) = verdict(curve);
    let words = fitted(&words, TICK_SIZE, RIGHT - after);
    drawing.text(Text::new(words, (after, y), TICK_SIZE).colored(color));
}

fn verdict(curve: &AmplitudeCurve) -> (String, Color) {
    match curve.verdict {
        AmplitudeVerdict::Changes if is_seen_at_the_ends(curve) => {
            (format!("change from loud to soft: {}", changes(curve)), INK)
        }
        AmplitudeVerdict::Changes => (format!("at half the amplitude: {}", slopes(curve)), INK),
        AmplitudeVerdict::Steady => (
            format!("no change beyond its uncertainty: {}", changes(curve)),
            SOFT,
        ),
        AmplitudeVerdict::Beating { frequency } => (
            format!("beats with a neighbour at {frequency:.2} Hz: no amplitude dependence shown"),
            VERMILION,
        ),
        AmplitudeVerdict::Unresolved { frequency } => (
            format!("not to be told from its neighbour at {frequency:.2} Hz"),
            VERMILION,
        ),
        AmplitudeVerdict::TooFewPoints => ("too few points for a trend".to_owned(), SOFT),
    }
}

/// Whether the change between the largest and the smallest amplitude is beyond its bound, in frequency or damping:
/// where the softest pieces drown in noise a slope may be certain, and the ends are not.
fn is_seen_at_the_ends(curve: &AmplitudeCurve) -> bool {
    let trends = [&curve.frequency, &curve.damping];
    let mut trends = trends.into_iter().flatten();
    trends.any(|trend| trend.change.abs() > trend.change_bound)
}

/// From the largest to the smallest amplitude, with its 95 % bound.
fn changes(curve: &AmplitudeCurve) -> String {
    said(curve, |trend| (trend.change, trend.change_bound))
}

/// By the slopes of the straight lines, for a halved amplitude, with 95 % bounds (normal distribution: a line
/// leaves many degrees of freedom).
fn slopes(curve: &AmplitudeCurve) -> String {
    let half = 0.5f64.ln();
    said(curve, |trend| {
        (half * trend.slope, 1.96 * half.abs() * trend.slope_std)
    })
}

/// "frequency +0.32 ± 0.01 Hz, damping ratio −0.14 ± 0.01 %".
fn said(curve: &AmplitudeCurve, of: impl Fn(&Trend) -> (f64, f64)) -> String {
    let part = |name: &str, trend: Option<&Trend>, factor: f64, unit: &str| {
        let (change, bound) = of(trend?);
        let (change, bound) = (factor * change, factor * bound);
        // As many decimals as the bound's two leading digits have.
        let decimals = (1.0 - bound.abs().max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize;
        let unit_of_last = 10f64.powi(decimals as i32);
        // Adding zero turns -0 into 0.
        let change = (change * unit_of_last).round() / unit_of_last + 0.0;
        let change = format!("{change:+.decimals$}").replace('-', "\u{2212}");
        Some(format!(
            "{name} {change} \u{b1} {} {unit}",
            significant(bound, 2)
        ))
    };
    let frequency = part("frequency", curve.frequency.as_ref(), 1.0, "Hz");
    let damping = part("damping ratio", curve.damping.as_ref(), 100.0, "%");
    let parts: Vec<String> = [frequency, damping].into_iter().flatten().collect();
    parts.join(", ")
}

fn draw_panel(
    drawing: &mut Drawing,
    curve: &AmplitudeCurve,
    quantity: &Quantity,
    ((left, right), top): ((f64, f64), f64),
    x_title: &str,
) {
    let Some(trend) = (quantity.trend)(curve) else {
        return;
    };
    let sizes = amplitudes(curve);
    // Amplitudes rise to the right as on every axis: a decay runs from right to left.
    let panel = Panel {
        x: amplitude_axis(curve, (left, right)),
        y: quantity_axis(curve, quantity, (top + HEIGHT, top)),
    };
    let line = draw_band(drawing, &panel, (trend, quantity.factor), sizes);
    panel.draw_x_ticks(drawing, &amplitude_ticks(&panel.x));
    panel.draw_y_ticks(drawing, &panel.y.ticks(34.0));
    panel.draw_curve(drawing, line, Stroke::new(INK, 1.4));
    // All bars, then all dots: neighbours of one style are one path in an SVG.
    for draw in [draw_bar, draw_dot] {
        for point in &curve.points {
            let color = color(curve, point.tap);
            draw(drawing, &panel, (point, quantity), color);
        }
    }
    panel.draw_frame(drawing);
    if !x_title.is_empty() {
        panel.draw_x_title(drawing, x_title);
    }
    let at = (left - 66.0, top + 0.5 * HEIGHT);
    let title = Text::new(quantity.title, at, LABEL_SIZE);
    drawing.text(title.aligned(Align::Middle).upwards());
}

fn amplitudes(curve: &AmplitudeCurve) -> (f64, f64) {
    extent(curve.points.iter().map(|point| point.amplitude)).unwrap_or((1.0, 10.0))
}

/// All amplitudes, with some room.
pub(crate) fn amplitude_axis(curve: &AmplitudeCurve, pixels: (f64, f64)) -> Axis {
    let (low, high) = amplitudes(curve);
    Axis::logarithmic((low / 1.12, high * 1.12), pixels)
}

/// What [`range`] says.
pub(crate) fn quantity_axis(
    curve: &AmplitudeCurve,
    quantity: &Quantity,
    pixels: (f64, f64),
) -> Axis {
    Axis::linear(range(curve, quantity), pixels)
}

/// Values of the points that are known well enough to tell something, and of those that differ from them
/// by far more than their own uncertainty, with some room.
fn range(curve: &AmplitudeCurve, quantity: &Quantity) -> (f64, f64) {
    let values: Vec<(f64, f64)> = curve.points.iter().map(quantity.value).collect();
    let mut stds: Vec<f64> = values.iter().map(|(_, std)| *std).collect();
    stds.sort_by(f64::total_cmp);
    let limit = TELLING * stds.get(stds.len() / 2).copied().unwrap_or(0.0);
    let bar = |(value, std): &(f64, f64)| [value - BAR * std, value + BAR * std];
    let telling = values.iter().filter(|(_, std)| *std <= limit);
    let (low, high) = extent(telling.flat_map(bar)).unwrap_or((0.0, 1.0));
    let apart = values
        .iter()
        .filter(|(value, std)| value + APART * std < low || value - APART * std > high);
    let ends = extent(apart.flat_map(bar).chain([low, high]));
    padded(ends.unwrap_or((low, high)), 0.12)
}

/// Powers of ten, and 2 and 5 times them where there is room; fewer than one decade as the axis has it.
fn amplitude_ticks(axis: &Axis) -> Vec<Tick> {
    let decades = (axis.high / axis.low).log10();
    let plain = axis.low > 1e-3 && axis.high < 1e5;
    if !plain || !(0.5..FEW_DECADES).contains(&decades) {
        return axis.ticks(70.0);
    }
    let (first, last) = (
        axis.low.log10().floor() as i32,
        axis.high.log10().ceil() as i32,
    );
    (first..=last)
        .flat_map(|exponent| [1.0, 2.0, 5.0].map(|digit| (digit, exponent)))
        .map(|(digit, exponent)| (digit * 10f64.powi(exponent), exponent))
        .filter(|(value, _)| axis.holds(*value))
        .map(|(value, exponent)| {
            let decimals = usize::try_from(-exponent).unwrap_or(0);
            Tick {
                value,
                label: Some(format!("{value:.decimals$}")),
            }
        })
        .collect()
}

/// The curve's bound in narrow columns from the smallest to the largest amplitude; returns the curve.
fn draw_band(
    drawing: &mut Drawing,
    panel: &Panel,
    (trend, factor): (&Trend, f64),
    (smallest, largest): (f64, f64),
) -> Vec<(f64, f64)> {
    let (from, to) = (panel.x.place(smallest), panel.x.place(largest));
    let columns = ((to - from) / COLUMN).ceil().max(1.0);
    let mut line = Vec::new();
    for column in 0..=columns as usize {
        let share = column as f64 / columns;
        let amplitude = smallest * (share * (largest / smallest).ln()).exp();
        let Some((value, bound)) = trend.at_amplitude(amplitude) else {
            continue;
        };
        let (value, bound) = (factor * value, factor * bound);
        let upper = panel.y.place(value + bound);
        let lower = panel.y.place(value - bound).max(upper + 1.0);
        let x = (from + share * (to - from)).round();
        // Columns overlap by a pixel, so that none shows through between them: the colour is opaque.
        let right = (x + COLUMN + 1.0).min(to.round() + 1.0);
        drawing.rectangle((x, upper), (right, lower), BAND, 1.0);
        if panel.y.holds(value) {
            line.push((amplitude, value));
        }
    }
    line
}

fn draw_bar(
    drawing: &mut Drawing,
    panel: &Panel,
    (point, quantity): (&AmplitudePoint, &Quantity),
    color: Color,
) {
    let (value, std) = (quantity.value)(point);
    if panel.y.holds(value) {
        let x = panel.x.place(point.amplitude);
        let low = panel.y.place(value - BAR * std);
        let high = panel.y.place(value + BAR * std);
        drawing.line(vec![(x, low), (x, high)], Stroke::new(color, 1.3));
    }
}

fn draw_dot(
    drawing: &mut Drawing,
    panel: &Panel,
    (point, quantity): (&AmplitudePoint, &Quantity),
    color: Color,
) {
    let (value, _) = (quantity.value)(point);
    if panel.y.holds(value) {
        drawing.dot(panel.place(point.amplitude, value), 3.4, color);
    }
}
