//! Banded symmetric matrices.
