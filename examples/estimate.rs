//! Estimate a joint from frequencies: `cargo run --example estimate`

use std::path::Path;
use tapjoint::description::{Assembly, TestDescription, runnable_template};
use tapjoint::pipeline::{IdentifySettings, run_test};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = runnable_template(Assembly::Cantilever);
    let test = TestDescription::parse(&text, "test.toml")?;
    let analysis = run_test(
        &test,
        (Path::new("."), "test.toml"),
        &IdentifySettings::default(),
    )?;
    let found = analysis.identification.and_then(|found| found.consistent);
    let estimate = found.ok_or("the frequencies allow no estimate")?;
    println!(
        "Kx = {:.1}, Ky = {:.3}",
        estimate.joint.kx, estimate.joint.ky
    );
    Ok(())
}
