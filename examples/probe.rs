//! probe
#![allow(clippy::unwrap_used)]
use tapjoint::pipeline::*;
use tapjoint::recording::*;
use tapjoint::simulate::*;
use tapjoint::taps::*;
fn wav(p: &str) -> Recording {
    Recording::open(std::path::Path::new(p), &ReadSettings::default()).unwrap()
}
fn show(n: &str, r: &Recording, s: &MeasureSettings) {
    let t0 = std::time::Instant::now();
    let m = measure(r, s).unwrap();
    println!("== {n} {:.3}s", t0.elapsed().as_secs_f64());
    for t in &m.taps.taps {
        println!(
            "  tap {:.3} peak {:.4} frames {} {}",
            t.time,
            t.peak,
            t.frames(),
            t.rejection.as_ref().map_or("ok".into(), |r| r.to_string())
        );
    }
    if let Some(q) = m.spectra {
        println!(
            "  {:?} decay {:?} spacing {:.4} T {:.3}",
            q.window, q.decay, q.averages.lines.spacing, q.averages.lines.duration
        );
        for p in q.readings {
            println!(
                "   {:9.3} line {:9.3}+-{:.3} bound {:?} zeta {:?} prom {:.1} snr {:?} {:?}",
                p.frequency,
                p.line_frequency,
                p.half_line,
                p.bound.map(|b| (b * 1e4).round() / 1e4),
                p.damping_ratio,
                p.prominence_db,
                p.above_noise_db.map(|x| x.round()),
                p.label
            );
        }
    }
    for w in m.warnings {
        println!("  ! {}: {w}", w.code());
    }
}
fn main() {
    let d = "/work/shared/data/";
    show(
        "spruce",
        &wav(&format!(
            "{d}guitar_tap_wav/brace-umik-1-swift-mac-1778816093.wav"
        )),
        &MeasureSettings::new(TapSource::Responses(vec![0])),
    );
    show(
        "guitar",
        &wav(&format!("{d}guitar_tap_wav/Recording.wav")),
        &MeasureSettings::new(TapSource::Responses(vec![0, 1])),
    );
    show(
        "brb",
        &wav(&format!(
            "{d}brb_bolted_beam/DERIVED_HammerImpact_3acc_float32.wav"
        )),
        &MeasureSettings::new(TapSource::Responses(vec![0, 1, 2])),
    );
    for k in 1..=5 {
        show(
            &format!("indep{k}"),
            &wav(&format!("{d}independent_cantilever/r{k}.wav")),
            &MeasureSettings::new(TapSource::Hammer {
                channel: 0,
                responses: vec![1, 2],
            }),
        );
    }
    let r = wav(&format!("{d}slater_cantilever/DERIVED_case1_time.csv"));
    show(
        "slater",
        &r,
        &MeasureSettings::new(TapSource::Hammer {
            channel: 0,
            responses: vec![1],
        }),
    );
    show(
        "slater resp",
        &r,
        &MeasureSettings::new(TapSource::Responses(vec![1])),
    );
    show(
        "slater resp both",
        &r,
        &MeasureSettings::new(TapSource::Responses(vec![0, 1])),
    );
    let modes: Vec<SimulatedMode> = [
        (17.13, 0.011),
        (118.4, 0.004),
        (337.2, 0.003),
        (631.1, 0.003),
        (996.3, 0.003),
    ]
    .iter()
    .enumerate()
    .map(|(i, &(f, z))| SimulatedMode {
        frequency: f,
        damping_ratio: z,
        shape_at_tap: 1.0 - 0.1 * i as f64,
        shape_at_sensors: vec![1.0, if i % 2 == 0 { -0.6 } else { 0.7 }],
    })
    .collect();
    let t = simulate_tap_test(&modes, &TapTestSettings::default(), 3);
    let ch = std::iter::once(t.force.clone())
        .chain(t.responses.clone())
        .map(|s| Channel {
            samples: s,
            ..Default::default()
        })
        .collect();
    let r = Recording::from_samples("x", 5120.0, ch).unwrap();
    let mut s = MeasureSettings::new(TapSource::Hammer {
        channel: 0,
        responses: vec![1, 2],
    });
    show("sim", &r, &s);
    s.band = Some((0.0, 200.0));
    s.block = Some(2048);
    show("sim 200", &r, &s);
    s.band = Some((0.0, 1000.0));
    show("sim 1000", &r, &s);
}
