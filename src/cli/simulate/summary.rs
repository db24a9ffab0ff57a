//! What the command prints.

use std::fmt::Write;
use std::path::Path;
use tapjoint::effects::EffectId;
use tapjoint::report::format::with_minus_signs;
use tapjoint::report::text::wrapped;
use tapjoint::simulate::{
    AntiAlias, Damping, HammerSettings, JointTruth, Laboratory, RecorderSettings, RecordingTruth,
    SensorSettings, Truth, VirtualTest,
};

/// Recordings, joint, what was planted, and the laboratory.
pub(super) fn summary(truth: &Truth, test: &VirtualTest, folder: &Path) -> String {
    let mut text = format!(
        "Virtual test of \"{}\" in {}\n\n",
        truth.name,
        folder.display()
    );
    for (recording, made) in truth.recordings.iter().zip(&test.recordings) {
        let line = of_recording(recording, made.plan.taps.pulse_length);
        text.push_str(&wrapped(&line, 2));
    }
    if let Some(joint) = &truth.joint {
        text.push('\n');
        text.push_str(&wrapped(&format!("Joint: {}", of_joint(joint)), 2));
    }
    match &truth.effects[..] {
        [] => text.push_str("Nothing planted: the description is the truth\n"),
        effects => {
            for effect in effects {
                let values: Vec<String> = effect
                    .parameters
                    .iter()
                    .map(|(name, value)| of_parameter(effect.effect, name, *value))
                    .collect();
                let line = format!("Planted: {} ({})", effect.effect, values.join(", "));
                text.push_str(&with_minus_signs(&wrapped(&line, 2)));
            }
        }
    }
    text.push_str("\nLaboratory\n");
    text.push_str(&of_laboratory(&truth.laboratory));
    text
}

/// "mass 0.024 kg".
fn of_parameter(effect: &str, name: &str, value: f64) -> String {
    let id = EffectId::ALL.iter().find(|id| id.name() == effect);
    let info = id.and_then(|id| id.parameters().iter().find(|info| info.name == name));
    let unit = info.map_or("", |info| info.dimension.unit());
    format!("{name} {value} {unit}").trim_end().to_owned()
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

/// A part of the laboratory and what is said of it.
type Line = (&'static str, String);

/// One line for each part, `off` where it is left out.
fn of_laboratory(laboratory: &Laboratory) -> String {
    let damping = ("damping", of_damping(&laboratory.specimen.damping));
    of_hammer(&laboratory.hammer)
        .into_iter()
        .chain(of_sensors(&laboratory.sensors))
        .chain(of_recorder(&laboratory.recorder))
        .chain([damping])
        .map(|(name, value)| format!("  {name:<18} {value}\n"))
        .collect()
}

fn off(value: f64, text: String) -> String {
    if value == 0.0 { "off".to_owned() } else { text }
}

fn percent(value: f64) -> String {
    off(value, format!("{} %", 100.0 * value))
}

fn of_hammer(hammer: &HammerSettings) -> Vec<Line> {
    let place = format!("{} mm", 1e3 * hammer.place_scatter);
    vec![
        ("hammer", format!("{} N at level 1", hammer.peak_force)),
        ("scatter of level", percent(hammer.level_scatter)),
        ("scatter of length", percent(hammer.length_scatter)),
        ("scatter of place", off(hammer.place_scatter, place)),
        ("double hits", percent(hammer.double_hits)),
        ("weak hits", percent(hammer.weak_hits)),
        ("lead", format!("{} s", hammer.lead)),
    ]
}

fn of_sensors(sensors: &SensorSettings) -> Vec<Line> {
    let good = "times 0.003 m/s2, 2e-6 m/s, 1e-7 m, 0.005 N (rms)";
    let hertz = |value: f64| off(value, format!("{value} Hz"));
    vec![
        (
            "noise",
            off(sensors.noise, format!("{} {good}", sensors.noise)),
        ),
        ("sensitivities", percent(sensors.sensitivity_error)),
        ("AC coupling", hertz(sensors.ac_coupling)),
        ("mounting", hertz(sensors.mounting_resonance)),
    ]
}

fn of_recorder(recorder: &RecorderSettings) -> Vec<Line> {
    let part = |value: f64| off(value, format!("{value:e} of full scale"));
    let hum = format!("{:e} of full scale at {} Hz", recorder.hum, recorder.mains);
    let filter = match recorder.anti_alias {
        AntiAlias::On => "flat to rate/2.56".to_owned(),
        AntiAlias::Off => "off".to_owned(),
    };
    let clock = format!("{:+e}", recorder.clock_error);
    vec![
        ("anti-alias filter", filter),
        ("bits", recorder.bits.to_string()),
        ("mains hum", off(recorder.hum, hum)),
        ("drift", part(recorder.drift)),
        ("offset", part(recorder.offset)),
        ("clock", off(recorder.clock_error, clock)),
    ]
}

fn of_damping(damping: &Damping) -> String {
    match damping {
        Damping::Modal(ratios) => {
            let ratios: Vec<String> = ratios
                .iter()
                .map(|ratio| format!("{:.3}", 100.0 * ratio))
                .collect();
            format!("{} % (the last for all beyond)", ratios.join(", "))
        }
        Damping::Rayleigh { mass, stiffness } => {
            format!("{mass} 1/s of mass, {stiffness} s of stiffness")
        }
    }
}
