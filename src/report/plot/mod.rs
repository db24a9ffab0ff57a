//! Pictures: each is drawn once as a list of shapes and written as PNG or as SVG.

pub mod amplitude;
pub mod axis;
pub mod cloud;
pub(super) mod cloud_points;
pub mod comparison;
pub mod decimate;
pub mod drawing;
pub mod frf;
pub mod gap;
pub mod labels;
pub mod palette;
pub mod place_map;
pub mod resolution;
pub mod shapes;
pub mod spectrum;
pub mod stabilisation;
pub mod time;

mod closeup;
mod font;
mod format;
mod letters;
mod marks;
pub(super) mod panel;
mod paths;
mod raster;
mod vector;

pub use drawing::Drawing;
pub use font::Weight;
pub use format::{PictureFormat, render_picture};
pub(super) use marks::frequency as frequency_words;
pub use raster::render_png;
pub use vector::{render_svg, render_svg_file};
