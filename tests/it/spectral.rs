//! Tests of spectral.
