//! Reads the frequency response functions of a file and writes them as a universal file.
//!
//! ```text
//! cargo run --example write_uff -- FILE OUT ascii
//! cargo run --example write_uff -- FILE OUT binary
//! ```

use std::error::Error;
use std::path::Path;

use tapjoint::recording::{
    ReadSettings, UffFormat, encode_frequency_responses_uff, open_frequency_responses,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (file, out, format) = match words.as_slice() {
        [file, out, "ascii"] => (file, out, UffFormat::Ascii),
        [file, out, "binary"] => (file, out, UffFormat::Binary),
        _ => return Err("usage: write_uff FILE OUT ascii|binary".into()),
    };
    let responses = open_frequency_responses(Path::new(file), &ReadSettings::default())?;
    for warning in &responses.warnings {
        eprintln!("warning: {warning}");
    }
    std::fs::write(out, encode_frequency_responses_uff(&responses, format)?)?;
    println!(
        "{} responses of {} lines",
        responses.responses.len(),
        responses.lines
    );
    Ok(())
}
