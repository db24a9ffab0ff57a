//! Real recordings, where they are at hand.

use std::path::PathBuf;

/// A file or folder of the folder that TAPJOINT_DATA names; `None` without the variable. A missing file fails the test.
pub fn data(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("TAPJOINT_DATA") else {
        eprintln!("skipped: TAPJOINT_DATA is not set");
        return None;
    };
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "{} is missing", path.display());
    Some(path)
}
