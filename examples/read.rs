//! Read a recording: `cargo run --example read -- taps.wav`

use tapjoint::recording::{ReadSettings, Recording, RecordingError};

fn main() -> Result<(), RecordingError> {
    let file = std::env::args()
        .nth(1)
        .unwrap_or("recordings/cantilever/low.wav".into());
    let recording = Recording::open(file.as_ref(), &ReadSettings::default())?;
    println!(
        "{} Hz, {} channels",
        recording.sample_rate(),
        recording.channels().len()
    );
    let first = recording.read_channels(&[0], 0..1000)?;
    let peak = first[0].iter().fold(0.0f64, |peak, x| peak.max(x.abs()));
    println!("largest of the first 1000 samples: {peak}");
    Ok(())
}
