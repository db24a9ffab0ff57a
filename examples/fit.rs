//! Fit the modes of a bare recording: `cargo run --example fit -- taps.wav`

use tapjoint::description::ChannelRef;
use tapjoint::pipeline::run_recording;
use tapjoint::recording::{ReadSettings, Recording};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args()
        .nth(1)
        .unwrap_or("recordings/cantilever/low.wav".into());
    let recording = Recording::open(file.as_ref(), &ReadSettings::default())?;
    let hammer = ChannelRef::Number(1);
    let analysis = run_recording(recording, Some(&hammer), |settings| {
        settings.band = Some((0.0, 800.0))
    })?;
    for mode in &analysis.modes {
        println!(
            "{:10.4} Hz, standard deviation {:?} Hz",
            mode.frequency, mode.std
        );
    }
    Ok(())
}
