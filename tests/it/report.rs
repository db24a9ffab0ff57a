//! Tests of report.

mod fixture;

use tapjoint::report::render_run;

#[test]
fn dump() {
    let Ok(dir) = std::env::var("REPORT_DUMP") else {
        return;
    };
    let start = std::time::Instant::now();
    let files = render_run(&fixture::document(), &fixture::figures()).unwrap();
    eprintln!("{:?}", start.elapsed());
    for f in files {
        println!("{} {}", f.name, f.bytes.len());
        std::fs::write(format!("{dir}/{}", f.name), f.bytes).unwrap();
    }
    print!("{}", tapjoint::report::render_text(&fixture::document()));
}
