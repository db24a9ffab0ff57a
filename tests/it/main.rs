//! Integration tests: one module per stage of the pipeline.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod cli;
mod description;
mod errors;
mod identify;
mod layers;
mod modal;
mod modal_matrix_pencil;
mod modal_polyreference;
mod pipeline;
mod real_data;
mod recording;
mod report;
mod simulate;
mod spectral;
mod structure;
mod taps;
