//! The model of a chart: axes with units, series with words, marks and legend.
//!
//! Each kind of chart is built once, in `charts`. [`Chart::draw`] makes a PNG or SVG of it. [`Chart::page`] thins
//! it for the report's script, which reads this model as JSON. Both show the same data with the same labels.

pub mod drawing;
mod files;
pub mod labels;
mod layout;
mod page;

use std::path::Path;

use serde::{Serialize, Serializer};

use crate::ReportError;
pub use drawing::Drawing;
use drawing::Rgb;
pub use files::{render_png, render_svg, render_svg_file};
pub use page::{InlineFigure, decimate, packed};

/// A picture of one kind.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Chart {
    /// Kind, the beginning of its file's name: "spectrum".
    pub kind: &'static str,
    /// Title.
    #[serde(skip)]
    pub title: String,
    /// Line beneath the title.
    #[serde(skip)]
    pub subtitle: String,
    /// Caption in the page: contents, and what to look for.
    #[serde(skip)]
    pub caption: String,
    /// Width of the picture (pixels); 0 for the width of a page.
    #[serde(skip)]
    pub width: u32,
    /// Parts of the picture below each other. The page shows one at a time where they have names.
    pub blocks: Vec<Block>,
    /// Lines beneath the picture.
    #[serde(skip)]
    pub footnotes: Vec<String>,
}

/// Panels that belong together.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Block {
    /// Heading of the block, and its button in the page.
    pub name: String,
    /// Words after the heading.
    #[serde(skip)]
    pub aside: String,
    /// The panels.
    pub panels: Vec<Panel>,
    /// Panels beside each other.
    #[serde(skip)]
    pub columns: usize,
    /// Panels that the picture has room for; the page has all.
    #[serde(skip)]
    pub drawn: usize,
    /// Part that the block has in the page.
    #[serde(skip)]
    pub in_page: InPage,
}

/// Part of a block in the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InPage {
    /// Its panels are shown together.
    #[default]
    Together,
    /// The same, before all other blocks: the page opens with them.
    First,
    /// Each of its panels is shown by itself.
    Apart,
    /// None: zooming shows more.
    Absent,
}

/// A rectangle with axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Title above it; empty where the block's says enough.
    pub title: String,
    /// Height (pixels).
    pub height: f64,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series, the lowest layer first.
    pub series: Vec<Series>,
    /// Resonances and other places on the horizontal axis.
    pub rules: Vec<Rule>,
    /// Taps.
    pub events: Vec<Event>,
    /// Name and unit of the series' `extra`.
    pub extra: Option<[&'static str; 2]>,
    /// Sentence on the points that the page leaves out; empty where it has all.
    pub note: String,
}

/// Look of a series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "mark", content = "size", rename_all = "lowercase")]
pub enum Mark {
    /// Filled circles of this radius (pixels).
    Dot(f64),
    /// Circles of this radius with paper inside (pixels).
    Ring(f64),
    /// Diagonal crosses of this radius (pixels).
    Cross(f64),
    /// Filled squares of this half width (pixels).
    Square(f64),
    /// A line of this width (pixels).
    Line(f64),
    /// A broken line of this width (pixels); the page draws it whole.
    #[serde(rename = "line")]
    Dashed(f64),
    /// A line of this width (pixels) whose points answer the pointer.
    Curve(f64),
    /// The area between `low` and `high`.
    Band,
    /// Bars from zero to `x`, of this half height (pixels).
    Bar(f64),
    /// Cells of a table, whose shade is `low` (0 to 1).
    Cell,
}

/// Horizontal places of a series.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Places {
    /// One by one.
    Each(Vec<f64>),
    /// Equally spaced piece by piece, as spectral lines and samples are.
    Even(Vec<Run>),
}

/// Equally spaced places.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Run {
    /// The first.
    pub first: f64,
    /// Their distance.
    pub step: f64,
    /// Their number.
    pub count: usize,
}

/// Points that look alike.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour.
    pub color: Color,
    /// Look.
    #[serde(flatten)]
    pub mark: Mark,
    /// 0 to 1.
    pub opacity: f64,
    /// Horizontal places (unit of the axis).
    pub x: Places,
    /// Heights (unit of the axis); empty for a band.
    pub y: Vec<f64>,
    /// Lower ends of error bars or of a band (unit of the axis); may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub low: Vec<f64>,
    /// Upper ends of the same (unit of the axis).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub high: Vec<f64>,
    /// Further facts for the pointer (unit of the panel's `extra`).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub extra: Vec<f64>,
    /// Name of each point.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// Height of each point with its uncertainty and unit; where empty, the number itself is shown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub said: Vec<String>,
    /// Address that a click on each point of the page opens; may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub links: Vec<String>,
    /// Words beside each point in the picture, as far as there is room.
    #[serde(skip)]
    pub labels: Vec<String>,
}

/// A place on the horizontal axis, such as a resonance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rule {
    /// Best value (unit of the axis).
    pub at: f64,
    /// Value on the spectral line (unit of the axis).
    pub line: f64,
    /// Bound of the reading on the line (unit of the axis).
    pub half: f64,
    /// "mode 1", "mains 50 Hz".
    pub name: String,
    /// "17.003 Hz".
    pub words: String,
    /// True for a mode.
    pub mode: bool,
    /// The most prominent rules get their names first (dB).
    #[serde(skip)]
    pub prominence: f64,
}

/// A tap in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Time (s).
    pub at: f64,
    /// Peak (unit of the vertical axis).
    pub peak: f64,
    /// "used, 0.313 s, 41.2 N" or "rejected, 6.210 s, 12 N: double hit".
    pub words: String,
    /// True for a tap that was used.
    pub used: bool,
    /// Samples about it, a panel for each channel; empty where they were not kept.
    pub close_up: Vec<Panel>,
}

/// Colours that readers with any colour vision tell apart: the palette of Okabe and Ito (2008), and greys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Color {
    /// Blue.
    Blue,
    /// Vermilion.
    Vermilion,
    /// Bluish green.
    Green,
    /// Reddish purple.
    Purple,
    /// Orange.
    Orange,
    /// Sky blue.
    Sky,
    /// Text.
    Ink,
    /// Secondary text.
    Soft,
    /// Raw data in the background.
    Data,
}

impl Color {
    /// Colour of the curve with this index; the palette repeats after six curves.
    pub fn curve(index: usize) -> Color {
        use Color::{Blue, Green, Orange, Purple, Sky, Vermilion};
        [Blue, Vermilion, Green, Purple, Orange, Sky][index % 6]
    }

    /// Its name in a sentence.
    pub fn word(self) -> &'static str {
        match self {
            Color::Blue => "blue",
            Color::Vermilion => "red",
            Color::Green => "green",
            Color::Purple => "purple",
            Color::Orange => "orange",
            Color::Sky => "light blue",
            Color::Ink => "black",
            Color::Soft | Color::Data => "grey",
        }
    }

    /// On white paper.
    pub fn rgb(self) -> Rgb {
        match self {
            Color::Blue => Rgb(0, 114, 178),
            Color::Vermilion => Rgb(213, 94, 0),
            Color::Green => Rgb(0, 158, 115),
            Color::Purple => Rgb(204, 121, 167),
            Color::Orange => Rgb(230, 159, 0),
            Color::Sky => Rgb(86, 180, 233),
            Color::Ink => Rgb(34, 34, 34),
            Color::Soft => Rgb(95, 95, 95),
            Color::Data => Rgb(120, 140, 160),
        }
    }

    /// Name in the page's style.
    pub fn css(self) -> &'static str {
        match self {
            Color::Blue => "c0",
            Color::Vermilion => "c1",
            Color::Green => "c2",
            Color::Purple => "c3",
            Color::Orange => "c4",
            Color::Sky => "c5",
            Color::Ink => "ink",
            Color::Soft => "soft",
            Color::Data => "data",
        }
    }
}

impl Serialize for Color {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.css())
    }
}

impl Block {
    /// Panels in so many columns.
    pub fn new(columns: usize, panels: Vec<Panel>) -> Block {
        Block {
            columns,
            drawn: panels.len(),
            panels,
            ..Block::default()
        }
    }
}

impl Panel {
    /// An empty panel.
    pub fn new(height: f64, x: Axis, y: Axis) -> Panel {
        Panel {
            title: String::new(),
            height,
            x,
            y,
            series: Vec::new(),
            rules: Vec::new(),
            events: Vec::new(),
            extra: None,
            note: String::new(),
        }
    }

    /// The panel with a title.
    pub fn titled(mut self, title: impl Into<String>) -> Panel {
        self.title = title.into();
        self
    }

    /// The panel with more series; those without points are left out unless the legend needs them.
    pub fn with(mut self, series: impl IntoIterator<Item = Series>) -> Panel {
        let some = series.into_iter().filter(|one| one.count() > 0);
        self.series.extend(some);
        self
    }

    /// The panel with a line at zero.
    pub fn with_zero(self) -> Panel {
        let ends = [self.x.low, self.x.high].map(|end| (end, 0.0));
        self.with([Series::points("", Color::Soft, Mark::Line(1.0), ends)])
    }
}

impl Chart {
    /// The bytes of a picture file.
    ///
    /// # Errors
    /// [`ReportError::Picture`] if it cannot be drawn or encoded.
    pub fn render(&self, format: PictureFormat) -> Result<Vec<u8>, ReportError> {
        render_picture(&self.draw(), format)
    }
}

impl Series {
    /// A series without points.
    pub fn new(name: &str, color: Color, mark: Mark) -> Series {
        Series {
            name: name.to_owned(),
            color,
            mark,
            opacity: 1.0,
            x: Places::Each(Vec::new()),
            y: Vec::new(),
            low: Vec::new(),
            high: Vec::new(),
            extra: Vec::new(),
            words: Vec::new(),
            said: Vec::new(),
            links: Vec::new(),
            labels: Vec::new(),
        }
    }

    /// Points one by one.
    pub fn points(
        name: &str,
        color: Color,
        mark: Mark,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Series {
        let (x, y) = points.into_iter().unzip();
        Series {
            x: Places::Each(x),
            y,
            ..Series::new(name, color, mark)
        }
    }

    /// A line through equally spaced values.
    pub fn even(name: &str, color: Color, first: f64, step: f64, values: Vec<f64>) -> Series {
        Series {
            x: Places::even(first, step, values.len()),
            y: values,
            ..Series::new(name, color, Mark::Line(1.5))
        }
    }

    /// Adds a point to those that stand one by one.
    pub fn push(&mut self, at: f64, height: f64) {
        if let Places::Each(places) = &mut self.x {
            places.push(at);
            self.y.push(height);
        }
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.y.len().max(self.low.len().min(self.high.len()))
    }

    /// Horizontal place of a point.
    pub fn at(&self, index: usize) -> f64 {
        match &self.x {
            Places::Each(places) => places.get(index).copied().unwrap_or(f64::NAN),
            Places::Even(runs) => {
                let mut before = 0;
                for run in runs {
                    if index < before + run.count {
                        return run.first + run.step * (index - before) as f64;
                    }
                    before += run.count;
                }
                f64::NAN
            }
        }
    }

    /// Every point.
    pub fn pairs(&self) -> impl Iterator<Item = (f64, f64)> {
        let heights = self.y.iter().enumerate();
        heights.map(|(index, height)| (self.at(index), *height))
    }
}

impl Places {
    /// One run of equally spaced places.
    pub fn even(first: f64, step: f64, count: usize) -> Places {
        Places::Even(vec![Run { first, step, count }])
    }
}

/// A kind of picture file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Pixels.
    Png,
    /// Lines, for print: letters are outlines, so that no font is needed.
    Svg,
}

impl PictureFormat {
    /// The kind by a file's name: SVG where it ends in `.svg`, else PNG.
    pub fn of(file: &Path) -> PictureFormat {
        let ending = file.extension().unwrap_or_default();
        if ending.eq_ignore_ascii_case("svg") {
            PictureFormat::Svg
        } else {
            PictureFormat::Png
        }
    }
}

/// The bytes of a picture file.
///
/// # Errors
/// [`ReportError::Picture`] if it cannot be drawn or encoded.
pub fn render_picture(drawing: &Drawing, format: PictureFormat) -> Result<Vec<u8>, ReportError> {
    match format {
        PictureFormat::Png => render_png(drawing),
        PictureFormat::Svg => Ok(render_svg_file(drawing)?.into_bytes()),
    }
}

/// Equal distances are equal differences or equal ratios.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

/// One axis of a panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// The quantity: "frequency".
    pub label: String,
    /// Its unit: "Hz"; empty for a count or a name, "1" for a ratio.
    pub unit: String,
    /// Scale.
    pub scale: Scale,
    /// Value at the start.
    pub low: f64,
    /// Value at the end.
    pub high: f64,
    /// Ticks with names; empty where the axis has numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<Tick>,
    /// Length of a turn where values come round again, as 360 degrees do.
    pub period: Option<f64>,
}

/// A tick and its words; small ticks have none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tick {
    /// Value at which it stands.
    pub value: f64,
    /// Its number or name. Lines after the first are further facts, for pictures alone.
    pub label: Option<String>,
}

/// Decades below which a logarithmic axis has 1, 2 and 5 times each power of ten.
const FEW_DECADES: f64 = 2.6;

impl Axis {
    /// A linear axis from `low` to `high`; an empty or broken range is widened.
    pub fn linear(low: f64, high: f64) -> Axis {
        let (low, high) = usable(low, high);
        Axis {
            label: String::new(),
            unit: String::new(),
            scale: Scale::Linear,
            low,
            high,
            names: Vec::new(),
            period: None,
        }
    }

    /// A logarithmic axis; an end that is not positive is replaced.
    pub fn logarithmic(low: f64, high: f64) -> Axis {
        let high = if high.is_finite() && high > 0.0 {
            high
        } else {
            1.0
        };
        let low = if low > 0.0 && low < high {
            low
        } else {
            high * 1e-3
        };
        Axis {
            scale: Scale::Logarithmic,
            low,
            high,
            ..Axis::linear(0.0, 1.0)
        }
    }

    /// The axis with a quantity and its unit.
    pub fn of(mut self, label: impl Into<String>, unit: impl Into<String>) -> Axis {
        self.label = label.into();
        self.unit = unit.into();
        self
    }

    /// The axis with names at some values instead of numbers.
    pub fn named(mut self, names: impl IntoIterator<Item = (f64, String)>) -> Axis {
        for (value, name) in names {
            let label = Some(name);
            self.names.push(Tick { value, label });
        }
        self
    }

    /// "frequency (Hz)".
    pub fn title(&self) -> String {
        match self.unit.as_str() {
            "" => self.label.clone(),
            unit => format!("{} ({unit})", self.label),
        }
    }

    /// Place of a value as a share of the axis, 0 at its start. Values beyond an end lie on it, and what is
    /// no number lies at the start.
    pub fn share(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => {
                (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
            }
        };
        if share.is_nan() {
            0.0
        } else {
            share.clamp(0.0, 1.0)
        }
    }

    /// True for a value on the axis.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Ticks with room for about so many labels: names, or round numbers.
    pub fn ticks(&self, room: f64) -> Vec<Tick> {
        if !self.names.is_empty() {
            return self.names.clone();
        }
        let room = room.max(1.0);
        let decades = (self.high / self.low).log10();
        // 1, 2 and 5 times each power of ten, all with their numbers.
        let digits = decades < FEW_DECADES && self.low > 1e-3 && self.high < 1e5;
        let least = if digits { 0.5 } else { 1.2 };
        match self.scale == Scale::Linear || decades < least {
            true => self.linear_ticks(room),
            false => self.power_ticks(room, digits),
        }
    }

    fn linear_ticks(&self, room: f64) -> Vec<Tick> {
        let step = nice_step((self.high - self.low) / room);
        // A hair of slack keeps a tick that rounding puts outside the end.
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        let numbers = first..=last.min(first.saturating_add(100));
        let ticks = numbers.map(|number| {
            let value = number as f64 * step;
            let shown = if value.abs() < step * 1e-6 {
                0.0
            } else {
                value
            };
            // Large and small numbers with a power of ten.
            let label = if (1e-4..1e5).contains(&step) {
                let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
                format!("{shown:.decimals$}")
            } else if shown == 0.0 {
                "0".to_owned()
            } else {
                let exponent = shown.abs().log10().floor();
                let mantissa = shown / 10f64.powf(exponent);
                let digits = (exponent - step.log10().floor()).clamp(0.0, 6.0) as usize;
                format!("{mantissa:.digits$}\u{b7}{}", power_of_ten(exponent as i32))
            };
            let label = Some(label.replace('-', "\u{2212}"));
            Tick { value, label }
        });
        ticks.collect()
    }

    /// Ticks at multiples of powers of ten: some with their numbers, or all with the powers as far as there is room.
    fn power_ticks(&self, room: f64, digits: bool) -> Vec<Tick> {
        let (first, last) = (self.low.log10(), self.high.log10());
        let stride = ((last - first) / room).ceil().max(1.0) as i32;
        let multiples: &[i32] = match stride {
            _ if digits => &[1, 2, 5],
            1 => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
            _ => &[1],
        };
        let mut ticks = Vec::new();
        for exponent in first.floor() as i32..=last.ceil() as i32 {
            for multiple in multiples {
                let value = f64::from(*multiple) * 10f64.powi(exponent);
                let decimals = usize::try_from(-exponent).unwrap_or(0);
                let power = *multiple == 1 && exponent.rem_euclid(stride) == 0;
                let label = match digits {
                    true => Some(format!("{value:.decimals$}")),
                    false => power.then(|| power_of_ten(exponent)),
                };
                ticks.extend(self.holds(value).then_some(Tick { value, label }));
            }
        }
        ticks
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
pub fn nice_step(least: f64) -> f64 {
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|digit| digit * decade)
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

/// "10⁻³".
fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|letter| match letter {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    });
    format!("10{}", raised.collect::<String>())
}

/// A range with some length and finite ends.
fn usable(low: f64, high: f64) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        return (0.0, 1.0);
    }
    let least = 1e-9 * low.abs().max(high.abs()).max(1e-300);
    if high - low > least {
        (low, high)
    } else {
        let widen = (0.01 * low.abs()).max(1e-12);
        (low - widen, low + widen)
    }
}

/// Smallest and largest of the finite values; `None` if there is none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

/// A linear axis over a range with `share` of its length added at both ends.
pub fn padded(range: (f64, f64), share: f64) -> Axis {
    let (low, high) = usable(range.0, range.1);
    let margin = share * (high - low);
    Axis::linear(low - margin, high + margin)
}
