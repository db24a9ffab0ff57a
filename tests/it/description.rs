//! Tests of description.
