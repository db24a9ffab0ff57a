//! Makes the virtual tests in `recordings/`: `cargo run --release --example make_recordings`.
//!
//! Modal superposition of the exact modes of an Euler beam on a joint of known stiffness, with
//! viscous damping, hammer pulses, noise and 24-bit quantisation. What it leaves out: sensors'
//! masses, rigid-body motion of the free lap-jointed beam, shear. The test descriptions beside the
//! recordings are written by hand; the README there says what the truth is.

use std::path::Path;

use tapjoint::recording::{WavFormat, write_wav};
use tapjoint::simulate::{TapTestSettings, seen_modes, simulate_tap_test};
use tapjoint::structure::{Assembly, Beam, JointStiffness, ModeShape, mode_shapes};

/// Full scale of the recorder (N, m/s2): also in the test descriptions.
const FORCE_SCALE: f64 = 100.0;
const RESPONSE_SCALE: f64 = 500.0;

/// One recording to be made.
struct Recipe {
    file: &'static str,
    positions: (f64, &'static [f64]),
    settings: TapTestSettings,
    seed: u64,
}

/// A steel beam (m).
fn steel(length: f64, width: f64, thickness: f64) -> Beam {
    Beam {
        length,
        width,
        thickness,
        modulus: 207e9,
        density: 7850.0,
        poisson: 0.3,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    make_cantilever()?;
    make_lap_joint()
}

fn make_cantilever() -> Result<(), Box<dyn std::error::Error>> {
    let joint = JointStiffness::two_parameter(1400.0, 4.8);
    let shapes = mode_shapes(&steel(0.423, 0.05, 0.005), Assembly::Cantilever, &joint, 20)?;
    let damping = [0.012, 0.009, 0.005, 0.004];
    let positions: (f64, &[f64]) = (0.385, &[0.338, 0.205]);
    let usual = TapTestSettings::default();
    let low = Recipe {
        file: "recordings/cantilever/low.wav",
        positions,
        settings: TapTestSettings {
            sample_rate: 2560.0,
            pulse: 3e-3,
            ..usual.clone()
        },
        seed: 17,
    };
    let high = Recipe {
        file: "recordings/cantilever/high.wav",
        positions,
        settings: TapTestSettings {
            interval: 4.0,
            pulse: 1e-3,
            ..usual
        },
        seed: 18,
    };
    make(&shapes, &damping, &low)?;
    make(&shapes, &damping, &high)
}

fn make_lap_joint() -> Result<(), Box<dyn std::error::Error>> {
    let joint = JointStiffness::two_parameter(824.0, 15.4);
    let shapes = mode_shapes(&steel(0.6, 0.044, 0.0057), Assembly::Lap, &joint, 20)?;
    let recipe = Recipe {
        file: "recordings/lap-joint/taps.wav",
        positions: (0.01, &[0.59, 0.21]),
        settings: TapTestSettings {
            interval: 3.0,
            pulse: 1e-3,
            ..TapTestSettings::default()
        },
        seed: 19,
    };
    make(&shapes, &[0.006, 0.004, 0.003], &recipe)
}

fn make(
    shapes: &[ModeShape],
    damping: &[f64],
    recipe: &Recipe,
) -> Result<(), Box<dyn std::error::Error>> {
    let rate = recipe.settings.sample_rate;
    let modes = seen_modes(shapes, damping, recipe.positions, 0.45 * rate);
    let test = simulate_tap_test(&modes, &recipe.settings, recipe.seed);
    let channels = test.channels(FORCE_SCALE, RESPONSE_SCALE);
    let clipped = write_wav(
        Path::new(recipe.file),
        rate as u32,
        &channels,
        WavFormat::Pcm24,
    )?;
    let frequencies: Vec<String> = modes
        .iter()
        .map(|mode| format!("{:.4}", mode.frequency))
        .collect();
    println!(
        "{}: {} Hz, {clipped} samples clipped",
        recipe.file,
        frequencies.join(" ")
    );
    Ok(())
}
