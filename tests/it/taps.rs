//! Tests of taps.
