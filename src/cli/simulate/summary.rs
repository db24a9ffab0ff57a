//! What the command prints.

use std::fmt::Write;
use std::path::Path;
use tapjoint::simulate::{
    AntiAlias, Damping, JointTruth, Laboratory, RecordingTruth, Truth, VirtualTest,
};

/// Recordings, joint, what was planted, and the laboratory.
pub(super) fn summary(truth: &Truth, test: &VirtualTest, folder: &Path) -> String {
    let mut text = format!(
        "Virtual test of \"{}\" in {}\n\n",
        truth.name,
        folder.display()
    );
    for (recording, made) in truth.recordings.iter().zip(&test.recordings) {
        let _ = writeln!(
            text,
            "  {}",
            of_recording(recording, made.take.taps.pulse.0)
        );
    }
    if let Some(joint) = &truth.joint {
        let _ = writeln!(text, "\nJoint: {}", of_joint(joint));
    }
    match &truth.effects[..] {
        [] => text.push_str("Nothing planted: the description is the truth\n"),
        effects => {
            for effect in effects {
                let values: Vec<String> = effect
                    .parameters
                    .iter()
                    .map(|(name, value)| format!("{name} {value}"))
                    .collect();
                let _ = writeln!(text, "Planted: {} ({})", effect.effect, values.join(", "));
            }
        }
    }
    text.push_str("\nLaboratory\n");
    text.push_str(&of_laboratory(&truth.laboratory));
    text
}

fn of_recording(recording: &RecordingTruth, pulse: f64) -> String {
    let modes = recording.modes.iter().take(6);
    let modes: Vec<String> = modes.map(|mode| format!("{:.3}", mode.frequency)).collect();
    let more = if recording.modes.len() > 6 {
        " ..."
    } else {
        ""
    };
    format!(
        "{}: {:.1} s at {} Hz, {} channels, {} taps (level {}, pulses of {} ms); modes at rest: {}{more} Hz",
        recording.file,
        recording.seconds,
        recording.sample_rate,
        recording.gains.len(),
        recording.taps.len(),
        recording.level,
        1e3 * pulse,
        modes.join(" ")
    )
}

fn of_joint(joint: &JointTruth) -> String {
    let value = |value: Option<f64>, unit: &str| match value {
        Some(value) => format!("{value:.6e} {unit}"),
        None => "rigid".to_owned(),
    };
    let mut text = format!(
        "Kt {}, Kr {}",
        value(joint.kt, "N/m"),
        value(joint.kr, "N m/rad")
    );
    if let (Some(kx), Some(ky)) = (joint.kx, joint.ky) {
        let _ = write!(text, " (Kx {kx:.6}, Ky {ky:.6})");
    }
    if let Some(ktr) = joint.ktr {
        let _ = write!(text, ", Ktr {ktr:.6e} N/rad");
    }
    text
}

/// One line for each part, `off` where it is left out.
fn of_laboratory(laboratory: &Laboratory) -> String {
    let (hammer, sensors, recorder) = (
        &laboratory.hammer,
        &laboratory.sensors,
        &laboratory.recorder,
    );
    let off = |value: f64, text: String| if value == 0.0 { "off".to_owned() } else { text };
    let percent = |value: f64| off(value, format!("{} %", 100.0 * value));
    let lines = [
        ("hammer", format!("{} N at level 1", hammer.peak_force)),
        ("scatter of level", percent(hammer.level_scatter)),
        ("scatter of length", percent(hammer.length_scatter)),
        (
            "scatter of place",
            off(
                hammer.place_scatter,
                format!("{} mm", 1e3 * hammer.place_scatter),
            ),
        ),
        ("double hits", percent(hammer.double_hits)),
        ("weak hits", percent(hammer.weak_hits)),
        ("lead", format!("{} s", hammer.lead)),
        (
            "noise",
            off(
                sensors.noise,
                format!(
                    "{} times 0.003 m/s2, 2e-6 m/s, 1e-7 m, 0.005 N (rms)",
                    sensors.noise
                ),
            ),
        ),
        ("sensitivities", percent(sensors.sensitivity_error)),
        (
            "AC coupling",
            off(sensors.ac_coupling, format!("{} Hz", sensors.ac_coupling)),
        ),
        (
            "mounting",
            off(
                sensors.mounting_resonance,
                format!("{} Hz", sensors.mounting_resonance),
            ),
        ),
        (
            "anti-alias filter",
            match recorder.anti_alias {
                AntiAlias::On => "flat to rate/2.56".to_owned(),
                AntiAlias::Off => "off".to_owned(),
            },
        ),
        ("bits", recorder.bits.to_string()),
        (
            "mains hum",
            off(
                recorder.hum,
                format!("{} of full scale at {} Hz", recorder.hum, recorder.mains),
            ),
        ),
        (
            "drift",
            off(recorder.drift, format!("{} of full scale", recorder.drift)),
        ),
        (
            "offset",
            off(
                recorder.offset,
                format!("{} of full scale", recorder.offset),
            ),
        ),
        (
            "clock",
            off(recorder.clock_error, format!("{:+e}", recorder.clock_error)),
        ),
        ("damping", of_damping(&laboratory.specimen.damping)),
    ];
    lines
        .iter()
        .map(|(name, value)| format!("  {name:<18} {value}\n"))
        .collect()
}

fn of_damping(damping: &Damping) -> String {
    match damping {
        Damping::Modal(ratios) => {
            let ratios: Vec<String> = ratios
                .iter()
                .map(|ratio| format!("{:.3} %", 100.0 * ratio))
                .collect();
            format!("{} (the last for all beyond)", ratios.join(", "))
        }
        Damping::Rayleigh { mass, stiffness } => {
            format!("{mass} 1/s of mass, {stiffness} s of stiffness")
        }
    }
}
