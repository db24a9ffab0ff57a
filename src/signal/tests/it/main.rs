//! Tests of measurement: one module per stage, with files that the tests write and with recordings by others.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]
#![allow(
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests write the files that they read"
)]

mod modal;
mod modal_fit;
mod modal_polyreference;
mod modal_synthesis;
mod quality;
mod recording;
mod recording_uff;
mod shared;
mod spectral;
mod spectral_frf;
mod taps;
mod written;
