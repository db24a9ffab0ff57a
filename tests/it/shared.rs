//! What several modules begin with: a beam, and the real recordings where they are at hand.

use std::path::PathBuf;
use tapjoint::structure::Beam;

/// The cantilever of Ingole & Chatterjee, table 2.
pub fn steel_strip() -> Beam {
    Beam {
        length: 0.423,
        width: 0.05,
        thickness: 0.005,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

/// The same cantilever with a joint, as a virtual test is described.
pub const VIRTUAL_CANTILEVER: &str = r#"
name = "virtual"
[beam]
length = 0.423
width = 0.05
thickness = 0.005
modulus = 207e9
density = 7850
[joint]
kind = "cantilever"
kt = 1.994e6
kr = 1223.0
beam = "euler"
[hammer]
channel = 1
[[sensor]]
name = "A"
position = 0.338
[[sensor]]
name = "B"
position = 0.205
[[recording]]
file = "taps.csv"
tap = 0.385
band = [0, 1000]
"#;

/// A file or folder of the folder that TAPJOINT_DATA names; `None` where it is not set. A file that is
/// missing there fails the test.
pub fn data(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("TAPJOINT_DATA") else {
        eprintln!("skipped: TAPJOINT_DATA is not set");
        return None;
    };
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "{} is missing", path.display());
    Some(path)
}
