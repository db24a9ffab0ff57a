//! The program as its users see it.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod first_steps;
