//! Words and pictures: JSON, CSV, HTML and PNG of a finished analysis. Computes no result.

mod convert;
mod convert_figures;
pub mod document;
pub mod figures;

pub use convert::document as document_of;
pub use convert_figures::figures as figures_of;
