//! Words and pictures: JSON, CSV, HTML and PNG of a finished analysis. Computes no result.

pub mod document;
pub mod figures;
