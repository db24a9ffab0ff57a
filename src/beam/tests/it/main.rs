//! Tests of the theory alone: no recording, no estimate.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod plate;
mod sections;
mod set_up;
mod shared;
mod specimen;
mod width;
