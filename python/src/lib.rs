//! `tapjoint._native`: the library as Python sees it.
//!
//! Arrays come in as contiguous float64 or complex128 arrays, which are read where they are, so nobody may write them
//! meanwhile. Functions and modes go out as arrays that take over the memory of the library. Python's lock is released
//! during all computation, and held where arrays and dictionaries are made. The typed layer above, which takes arrays and
//! descriptions of any kind, is the Python code beside this crate.

mod answer;
mod commands;
mod errors;
mod functions;
mod recording;
mod work;

/// The module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::answer::Answer;
    #[pymodule_export]
    use crate::commands::{call, check_description, main, toml_text};
    #[pymodule_export]
    use crate::functions::{average, find_modes};
    #[pymodule_export]
    use crate::recording::Recording;

    /// Version of the library.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
