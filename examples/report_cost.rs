//! What a report costs beyond the analysis, and how large its page is.
//!
//! ```console
//! $ tapjoint simulate examples/five_recordings.toml --out five --seed 7
//! $ cargo run --release --example report_cost -- five/test.toml
//! ```

use std::path::Path;
use std::time::Instant;
use tapjoint::description::TestDescription;
use tapjoint::gap::GapSettings;
use tapjoint::pipeline::{IdentifySettings, diagnose_test, run_test};
use tapjoint::report::{document_of, gap_section, render_run};

/// As `tapjoint run` draws.
const DRAWS: (usize, u64) = (1000, 1);
/// The report is made so often; the median is printed.
const REPEATS: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let named = std::env::args().nth(1);
    let path = named.unwrap_or_else(|| "recordings/cantilever/test.toml".to_owned());
    let test = TestDescription::parse(&std::fs::read_to_string(&path)?, &path)?;
    let folder = Path::new(&path).parent().unwrap_or(Path::new("."));
    let settings = IdentifySettings {
        monte_carlo: Some(DRAWS),
        ..IdentifySettings::default()
    };
    let begin = Instant::now();
    let analysis = run_test(&test, (folder, &path), &settings)?;
    let measured = begin.elapsed();
    let diagnosis = diagnose_test(&test, &analysis, &GapSettings::default());
    let diagnosed = begin.elapsed() - measured;
    let mut seconds = Vec::new();
    let mut files = Vec::new();
    for _ in 0..REPEATS {
        let begin = Instant::now();
        let mut document = document_of(&analysis);
        document.gap = Some(gap_section(diagnosis.as_ref()));
        files = render_run(&document, &analysis.recordings)?;
        seconds.push(begin.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    println!("recordings            {}", analysis.recordings.len());
    println!("measured, identified  {:.2} s", measured.as_secs_f64());
    println!("gap diagnosed         {:.2} s", diagnosed.as_secs_f64());
    println!("report made           {:.3} s", seconds[REPEATS / 2]);
    let size = |end: &str| {
        let of_kind = files.iter().filter(|file| file.name.ends_with(end));
        of_kind.map(|file| file.bytes.len()).sum::<usize>() as f64 / 1e6
    };
    for end in [".html", ".json", ".png", ".svg"] {
        println!("{end:5}                 {:.2} MB", size(end));
    }
    Ok(())
}
