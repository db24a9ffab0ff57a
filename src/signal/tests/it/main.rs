//! Tests of measurement alone: one module per stage.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod modal;
mod modal_fit;
mod modal_matrix_pencil;
mod modal_polyreference;
mod quality;
mod spectral;
mod spectral_frf;
mod taps;
