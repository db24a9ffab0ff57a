//! The model of a picture: axes with units, series with words, marks and legend.
//!
//! Each kind of picture is built once, in `charts`. [`Chart::draw`] makes a PNG or SVG of it. [`Chart::page`] thins
//! it for the report's script, which reads this model as JSON. Both show the same data with the same labels.

pub mod axis;
pub mod drawing;
pub mod labels;
mod page;
mod picture;
mod png;
mod svg;
pub mod thinning;

use std::path::Path;

use serde::{Serialize, Serializer};

use crate::ReportError;
pub use axis::Axis;
pub use drawing::Drawing;
use drawing::Rgb;
pub use page::packed;
pub use png::render_png;
pub use svg::{render_svg, render_svg_file};

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
    /// Lower ends of error bars or of a band; may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub low: Vec<f64>,
    /// Upper ends.
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
