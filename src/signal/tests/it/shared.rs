//! Real recordings, where they are at hand.

use std::path::PathBuf;

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
