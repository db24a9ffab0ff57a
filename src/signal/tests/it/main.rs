//! Tests of measurement, with files that the tests write and with recordings by others.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod recording;
mod recording_uff;
mod shared;
mod written;
