//! Tests of modal.
