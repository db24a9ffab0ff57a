//! Helpers of several tests: lines without a zoom band, and real recordings where they are at hand.

use std::path::PathBuf;

use tapjoint_signal::spectral::{DISPLAY_RATIO, Lines, SpectralError};

/// Lines of a block without a zoom band: 0 to rate/2.56. `available` is the length of signal at hand (s).
pub fn baseband(rate: f64, block: usize, available: f64) -> Result<Lines, SpectralError> {
    Lines::zoom((0.0, rate / DISPLAY_RATIO), rate, block, available)
}

/// Returns the path of a file or folder in the folder that TAPJOINT_DATA names.
///
/// Tests that call it are ignored by default. `--include-ignored` runs them.
pub fn data(name: &str) -> PathBuf {
    let folder = std::env::var_os("TAPJOINT_DATA")
        .expect("TAPJOINT_DATA has to name the folder of real recordings");
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "{} is missing", path.display());
    path
}
