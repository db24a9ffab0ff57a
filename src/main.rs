//! The command line of tapjoint.
fn main() {}
